//! The partition of a split is the best of all partitions that really fit: each partition of small random nets is built, and the search finds none that is
//! worse, claims no bound that one of them breaks, and finds a partition if there is one. The CPU of every third net has few pins: a partition whose plant does
//! not fit them is chosen only if there is no other one.
//!
//! `SPLIT_GROUPS=12` uses larger nets; `SPLIT_SEED=77` runs one net and prints all its partitions.

#![allow(clippy::disallowed_methods, reason = "the environment defines how large the nets are")]
#![allow(clippy::print_stdout, reason = "tests report what they did")]

use grafsynth_driver::pipeline::{self, BuildOptions};
use grafsynth_driver::split::{
    Compile, Cpu, Item, Objective, PartDevice, Place, Program, Request, RequestedPart, Sizes,
    Split, crowded, link, split,
};
use grafsynth_driver::stem::FileStem;
use grafsynth_driver::target::Target;
use grafsynth_ir::division::{Running, round_of};
use grafsynth_ir::net::Net;
use grafsynth_ir::{Span, Valid, text};
use grafsynth_sim::Random;
use grafsynth_split::codes::{MEMORY, PINS};
use grafsynth_split::partition::owners;
use grafsynth_split::{Cells, Groups, divide, together};
use grafsynth_tests::random_net::{Features, random_net};
use grafsynth_tests::{in_parallel, rounds};
use grafsynth_verify::Limits;

fn net(seed: u64) -> Valid<Net> {
    let features = Features {
        max_steps: 3,
        timers: true,
        edges: true,
        integers: seed.is_multiple_of(2),
        stored_outputs: true,
        mealy: true,
        emergency: seed.is_multiple_of(3),
        ..Features::plain()
    };
    random_net(seed, &features)
}

/// A compiler for which a part with much text is too large.
fn long_code(_: &Cpu, program: &Program) -> Option<Result<Sizes, String>> {
    let of_part = program.files.iter().find(|file| file.name.ends_with("_cpu.c"))?;
    let flash = of_part.text.len() as u64 * 3 / 2;
    Some(Ok(Sizes { compiler: "none", flash, data: 0, stack: Some(0), unplaced: 0 }))
}

/// The places of all groups, by the bits of a number: a bit that is set places its group on the CPU. `None` if only the CPU can have one of the others.
fn places(groups: &Groups, bits: u64) -> Option<Vec<Place>> {
    let mut all = Vec::new();
    for (at, items) in groups.groups.iter().enumerate() {
        let part = (bits >> at & 1) as usize;
        if part == 0 && groups.cpu_only.contains_key(&at) {
            return None;
        }
        let item = items.iter().find(|item| !matches!(item, Item::Event(_)))?;
        all.push(Place { item: *item, part, span: Span::default() });
    }
    Some(all)
}

#[test]
fn no_partition_that_fits_is_better_than_the_best() {
    let most_groups =
        std::env::var("SPLIT_GROUPS").ok().and_then(|text| text.parse().ok()).unwrap_or(5);
    let only: Option<u64> = std::env::var("SPLIT_SEED").ok().and_then(|text| text.parse().ok());
    let (mut nets, mut seed, mut misfits, mut none, mut optimal) = (0, 0, 0, 0, 0);
    seed += only.map_or(0, |only| only - 1);
    let (mut too_large, mut too_few_pins, mut crowded_nets) = (0, 0, 0);
    while nets < only.map_or(rounds(4, 200), |_| 1) {
        seed += 1;
        let net = net(seed);
        let Ok(groups) = together(&net, Running::Lockstep) else { continue };
        let n_groups = groups.groups.len();
        if !(2..=most_groups).contains(&n_groups) {
            continue;
        }
        nets += 1;
        let mut random = Random::new(seed);
        let chip = *random.pick(&["gal16v8", "gal16v8", "gal22v10"]).expect("there are devices");
        let part = |name: &str, device: &str| RequestedPart {
            name: name.to_owned(),
            device: PartDevice::named(device).expect("the device is known"),
        };
        let cpu = if seed % 3 == 1 { "attiny85" } else { "attiny2313" };
        let parts = [part("chip", chip), part("cpu", cpu)];
        let objective = Objective::ALL[(seed / 2) as usize % 4];
        // Every second net has a compiler whose code is as long as the text of the part, so that the memory of the CPU decides.
        let compile = (seed % 2 == 0).then_some(long_code as Compile);
        let stem = FileStem::of_name("random");
        let options = BuildOptions { dont_cares: true, ..BuildOptions::default() };
        let split = |places: &[Place], fits| {
            let stem = &stem;
            let request = Request {
                parts: &parts,
                places,
                running: Running::Lockstep,
                reset: true,
                objective,
                fits,
                stem,
                options: &options,
                compile,
                told: |_| (),
            };
            split(&net, &request)
        };
        // First whether the plant fits the pins of the CPU, then the objective.
        let rank = |split: &Split| {
            let linked = link(&net, split, &parts, &stem).expect("a split that fits is linked");
            (crowded(&net, &split.division, &linked).is_some(), split.value)
        };
        // All groups of this partition are already placed, so the search has no choice.
        let mut best: Option<(bool, i64)> = None;
        for bits in 0..1u64 << n_groups {
            let Some(places) = places(&groups, bits) else { continue };
            let one = split(&places, 1);
            if only.is_some() {
                let said = one.as_ref().map(rank).map_err(|why| &why[0].message);
                println!("{bits:0n_groups$b}: {said:?}");
            }
            match one {
                Ok(one) => {
                    let own = rank(&one);
                    best = Some(best.map_or(own, |best| best.min(own)));
                }
                Err(why) => {
                    misfits += 1;
                    too_large += u32::from(why.iter().any(|one| one.code == MEMORY));
                    too_few_pins += u32::from(why.iter().any(|one| one.code == PINS));
                }
            }
        }
        let found = split(&[], 1 << n_groups);
        let place = || format!("seed {seed} on {chip}, {objective:?}\n{}", text::print(&net));
        match (found, best) {
            (Ok(found), Some(best)) => {
                assert_eq!(rank(&found), best, "{}", place());
                let (is_crowded, value) = best;
                assert!(found.bound <= value, "bound {} of {value}: {}", found.bound, place());
                optimal += u32::from(found.bound == value);
                crowded_nets += u32::from(is_crowded);
            }
            (Err(_), None) => none += 1,
            (Ok(found), None) => panic!("{} fits, but none should: {}", found.value, place()),
            (Err(why), Some((_, best))) => panic!("{best} fits, but {why:?}: {}", place()),
        }
        // Even after few fits, the bound is valid.
        if let (Ok(early), Some(best)) = (split(&[], 1), best) {
            assert!(rank(&early) >= best, "{}", place());
            assert!(rank(&early).0 != best.0 || early.bound <= best.1, "{}", place());
        }
    }
    println!(
        "{nets} nets, {misfits} partitions do not fit ({too_large} the memory of the CPU, {too_few_pins} its pins), {none} nets fit nowhere, {optimal} proved best; the plant of {crowded_nets} needs more pins than the CPU has"
    );
    if only.is_none() {
        assert!(misfits > too_large, "the chips are never too small");
        assert!(too_large > 0, "the memory is never too small");
    }
}

/// The number of macrocells that a part probably needs decides what is built first, so it should seldom be more than what a chip uses.
#[test]
fn few_chips_hold_their_part_in_fewer_macrocells_than_they_probably_need() {
    let seeds: Vec<u64> = (1..=rounds(60, 3000)).collect();
    let of = |seed: &u64| {
        let net = net(*seed);
        let groups = together(&net, Running::Lockstep).ok()?;
        let mut random = Random::new(*seed);
        let part: Vec<usize> = (0..groups.groups.len())
            .map(|group| usize::from(groups.cpu_only.contains_key(&group) || random.below(3) == 0))
            .collect();
        let limits = Limits::default();
        let facts = pipeline::facts(&net, &limits);
        let decisions: Vec<(usize, usize)> = part.iter().copied().enumerate().collect();
        let least = Cells::new(&net, &facts, &groups).least(0, &decisions);
        let names = ["chip".to_owned(), "cpu".to_owned()];
        let components = pipeline::facts(&round_of(&net).ok()?, &limits).components;
        let division = divide(&net, &groups, owners(&net, &groups, &part), &names, &components);
        let division = division.expect("the groups are together");
        let chip = &division.parts[0].net;
        let options = BuildOptions {
            dont_cares: true,
            prove: false,
            report: true,
            device: Some("gal22v10".to_owned()),
            ..BuildOptions::default()
        };
        let built =
            pipeline::build(chip, &pipeline::facts(chip, &limits), &[Target::Jedec], &options);
        let made = built.chips.first().filter(|chip| chip.misfit.is_none())?;
        let found = made.cells.len() as u64;
        Some(found < least)
    };
    let all = in_parallel(&seeds, of);
    let n_built = all.iter().flatten().count();
    let fewer = all.iter().flatten().filter(|is_fewer| **is_fewer).count();
    println!("{n_built} chips built, {fewer} need fewer macrocells");
    assert!(fewer * 10 < n_built, "{fewer} of {n_built} chips need fewer macrocells");
    assert!(n_built > seeds.len() / 3, "most parts fit the chip");
}
