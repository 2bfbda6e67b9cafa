//! Free-running splits in one run: the part on the CPU compiled, the chips as fuses or as the circuit of their text, with and without the wire `reset`. Where the
//! proof accepts a split, each output and step has the values of the chart.

#![allow(clippy::print_stdout, reason = "tests report what they did")]

use crate::free_running::{part_of_name, random_text};
use grafsynth_driver::pipeline::BuildOptions;
use grafsynth_driver::run::net_trace;
use grafsynth_driver::split::{Item, Objective, PartDevice, Place, Request, RequestedPart, split};
use grafsynth_driver::stem::FileStem;
use grafsynth_engines::{Engine as _, Job, OfCpu, SplitEngine};
use grafsynth_ir::division::Running;
use grafsynth_ir::net::Net;
use grafsynth_ir::{Span, Valid};
use grafsynth_sim::{Events, Random, Stimulus, compare};
use grafsynth_split::{Groups, together};
use grafsynth_tests::{chart, rounds};
use grafsynth_verify::verdict::Verdict;
use grafsynth_verify::{Limits, settles, structural_facts};

/// Chips with a fuse map, and one of which only the text is written.
const CHIPS: [&str; 3] = ["gal22v10", "atf1504-plcc44", "gal20ra10"];

fn parts(n_parts: usize, random: &mut Random) -> Vec<RequestedPart> {
    let part = |name: &str, device: &str| RequestedPart {
        name: name.to_owned(),
        device: PartDevice::named(device).expect("the device is known"),
    };
    let chips = (1..n_parts)
        .map(|at| part(&format!("chip{at}"), random.pick(&CHIPS).expect("there are devices")));
    chips.collect::<Vec<_>>().into_iter().chain([part("cpu", "atmega328p")]).collect()
}

/// Each cycle on its own part.
fn places(net: &Net, groups: &Groups, n_parts: usize) -> Vec<Place> {
    let of = |items: &Vec<Item>| {
        let item = *items.iter().find(|item| !matches!(item, Item::Event(_)))?;
        let named = items.iter().find_map(|item| match *item {
            Item::Step(id) => part_of_name(&net.steps[id].name.text),
            Item::Output(id) => part_of_name(&net.outputs[id].name.text),
            _ => None,
        });
        Some(Place { item, part: named?.min(n_parts - 1), span: Span::default() })
    };
    groups.groups.iter().filter_map(of).collect()
}

#[test]
fn free_running_splits_with_their_links_give_the_values_of_the_chart() {
    let (mut seed, mut run, mut texts, mut resets) = (0, 0, 0, 0);
    while run < rounds(6, 300) {
        seed += 1;
        let mut random = Random::new(seed);
        let (text, n_parts) = random_text(&mut random);
        let net: Valid<Net> = chart("c.graf", &text);
        let Ok(groups) = together(&net, Running::Free) else { continue };
        let division = crate::free_running::random_division(&net, n_parts);
        if !matches!(settles(&net, &division, &Limits::default()), Verdict::Proved(_)) {
            continue;
        }
        let parts = parts(n_parts, &mut random);
        let places = places(&net, &groups, n_parts);
        let (stem, options) = (FileStem::of_name("random"), BuildOptions::default());
        let reset = random.below(2) == 0;
        let request = Request {
            parts: &parts,
            places: &places,
            running: Running::Free,
            reset,
            objective: Objective::Cycles,
            fits: 1,
            stem: &stem,
            options: &options,
            compile: None,
            told: |_| (),
        };
        // A chip can be too small for the synchronisers.
        let Ok(made) = split(&net, &request) else { continue };
        // The divisions may differ where a place does not matter.
        if !matches!(settles(&net, &made.division, &Limits::default()), Verdict::Proved(_)) {
            continue;
        }
        run += 1;
        resets += usize::from(reset);
        texts += parts.iter().filter(|part| part.device.name().starts_with("atf")).count();
        let engine = SplitEngine::new(&net, made, &parts, &stem, OfCpu::Host)
            .unwrap_or_else(|found| panic!("seed {seed}: {found:?}\n{text}"));
        let facts = structural_facts(&net);
        for again in 0..3 {
            let stimulus = Stimulus::random(&net, 60, seed * 8 + again, 1);
            let events = Events::of(&net, &stimulus).expect("nothing is assumed");
            let job = Job { net: &net, facts: &facts, stimulus: &stimulus };
            let got = engine.run(&job).unwrap_or_else(|why| panic!("seed {seed}: {why:?}\n{text}"));
            let wanted = net_trace(&net, &events.stimulus);
            let parts: Vec<&str> = parts.iter().map(|part| part.device.name()).collect();
            assert_eq!(
                compare(&wanted, &got),
                None,
                "seed {seed}, {parts:?}, reset {reset}\n{text}"
            );
        }
    }
    println!("{run} splits, {texts} chips as text, {resets} with a reset");
    assert!(texts > 0 && resets > 0 && resets < run as usize);
}
