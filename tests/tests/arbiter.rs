//! The arbiter example in every engine. Requests are served within the bound that `check` prints, no smaller bound is correct, and with unequal
//! priorities the printed cycle starves its client everywhere.

#![allow(clippy::print_stdout, reason = "tests report what they skip and what they measured")]

use grafsynth_backend_c::{Options, Style};
use grafsynth_driver::run::net_trace;
use grafsynth_engines::{Availability, CEngine, Engine, EngineError, Job};
use grafsynth_ir::Valid;
use grafsynth_ir::net::{Enter, Leaf, Net, Policy, TransitionId};
use grafsynth_sim::{Simulator, Stimulus, compare};
use grafsynth_tests::random_net::{Features, random_net};
use grafsynth_tests::{chart, in_parallel, rounds};
use grafsynth_verify::{Limits, Wait, may_lose, waiting};

fn by_age() -> Valid<Net> {
    chart("arbiter.graf", include_str!("../../examples/arbiter/arbiter.graf"))
}

fn fixed() -> Valid<Net> {
    chart("arbiter_fixed.graf", include_str!("../../examples/arbiter/arbiter_fixed.graf"))
}

/// The arbiter whose third client has the lowest priority.
fn unequal() -> Valid<Net> {
    let text = include_str!("../../examples/arbiter/arbiter.graf")
        .replace("step client1 {", "step client1 { priority 1;")
        .replace("step client2 {", "step client2 { priority 1;");
    chart("unequal.graf", &text)
}

/// Checks that every engine that supports the chart agrees with the simulator.
fn everywhere(net: &Valid<Net>, stimulus: &Stimulus) {
    let expected = net_trace(net, stimulus);
    let facts = grafsynth_verify::facts(net, &Limits::default());
    let mut engines: Vec<(String, Box<dyn Engine>)> =
        grafsynth_engines::all().into_iter().map(|it| (it.name().to_owned(), it)).collect();
    for style in [Style::Switch, Style::Tables, Style::Bits, Style::Engine] {
        let engine = CEngine { options: Options { style, ..Options::default() } };
        engines.push((format!("c as {}", style.name()), Box::new(engine)));
    }
    let said = in_parallel(&engines, |(name, engine)| {
        if let Availability::Missing(what) = engine.availability() {
            assert!(std::env::var_os("CI").is_none(), "{what} is missing, and CI must have it");
            return format!("skipped: {name}: {what} is not here");
        }
        match engine.run(&Job { net, facts: &facts, stimulus }) {
            Ok(got) => {
                let found = compare(&expected, &got);
                assert!(found.is_none(), "{name}: {found:?}");
                format!("{name}: equal")
            }
            Err(EngineError::Refused(found)) => format!("{name}: refused, {}", found[0].message),
            Err(EngineError::Failed(why)) => panic!("{name}: {why}"),
        }
    });
    said.iter().for_each(|line| println!("{line}"));
    let n_equal = said.iter().filter(|line| line.ends_with("equal")).count();
    assert!(n_equal >= 8 || std::env::var_os("CI").is_none(), "{said:#?}");
}

/// For a transition: the maximum number of reactions in which it is fireable without firing between two of its firings, and the maximum in which its
/// receptivity is true until it fires, including that reaction.
fn observed(net: &Valid<Net>, transition: TransitionId, stimulus: &Stimulus) -> (u32, u32) {
    let data = &net.transitions[transition];
    let mut simulator = Simulator::new(net);
    simulator.reset();
    let (mut turns, mut held, mut most) = (0, 0, (0, 0));
    for row in stimulus.rows() {
        let enabled = data.requires.iter().all(|step| simulator.is_active(*step));
        let holds = data.guard.eval(&mut |leaf: &Leaf, _: i64| {
            let Leaf::Input(input) = leaf else { panic!("{leaf:?} in a request") };
            row.value(*input)
        }) != 0;
        let is_served = data
            .enters
            .iter()
            .any(|it| matches!(it, Enter::Step(step) if simulator.is_active(*step)));
        simulator.step(&row);
        held = if holds && !is_served { held + 1 } else { 0 };
        most.1 = most.1.max(held);
        if simulator.fired().contains(&transition) {
            (turns, held) = (0, 0);
        } else if enabled && holds {
            turns += 1;
            most.0 = most.0.max(turns);
        }
    }
    most
}

#[test]
fn every_request_is_served_within_the_bound_and_the_bound_is_attained() {
    let net = by_age();
    let waits = waiting(&net, &Limits::default()).expect("it is small");
    let requests: Vec<TransitionId> = net.transitions.ids().take(3).collect();
    assert_eq!(waits.iter().map(|it| it.transition).collect::<Vec<_>>(), requests);
    let mut adversary: Vec<_> = Vec::new();
    for it in &waits {
        let Wait::Bounded { turns, worst, reactions: Some(reactions), slowest: Some(slowest) } =
            &it.wait
        else {
            panic!("{it:?}")
        };
        // The two other clients are served once each.
        assert_eq!(*turns, 2, "{it:?}");
        assert_eq!(observed(&net, it.transition, worst).0, *turns);
        assert_eq!(observed(&net, it.transition, slowest).1, *reactions - 1);
        // After one more reaction it has fired, whatever else is requested.
        for seed in 0..rounds(50, 5_000) {
            let stimulus = Stimulus::random(&net, 300, seed, 1);
            let (most_turns, most_reactions) = observed(&net, it.transition, &stimulus);
            assert!(most_turns <= *turns && most_reactions <= *reactions, "seed {seed}");
        }
        adversary.extend(worst.rows());
        adversary.extend(slowest.rows());
    }
    adversary.extend(Stimulus::random(&net, 200, 7, 1).rows());
    everywhere(&net, &Stimulus::of_rows(&net, &adversary));
}

#[test]
fn among_unequal_priorities_the_cycle_starves_its_client_in_every_engine() {
    for (net, starved) in [(unequal(), vec![2]), (fixed(), vec![1, 2])] {
        let waits = waiting(&net, &Limits::default()).expect("it is small");
        let mut found = Vec::new();
        for it in &waits {
            let Wait::Starves { way, cycle } = &it.wait else { continue };
            found.push(it.transition.index());
            // In each round of the cycle, the client is ready and never served.
            let mut rows: Vec<_> = way.rows().collect();
            let n_way = rows.len();
            for _ in 0..20 {
                rows.extend(cycle.rows());
            }
            let stimulus = Stimulus::of_rows(&net, &rows);
            let mut simulator = Simulator::new(&net);
            simulator.reset();
            for (at, row) in stimulus.rows().enumerate() {
                simulator.step(&row);
                assert!(at < n_way || !simulator.fired().contains(&it.transition), "row {at}");
            }
            assert!(
                observed(&net, it.transition, &stimulus).0 >= 20,
                "it is passed over each time"
            );
            everywhere(&net, &stimulus);
        }
        assert_eq!(found, starved, "{}", net.name);
    }
}

/// If no transition can lose its turn, as judged from the structure, the search finds none that does.
#[test]
fn the_first_transition_of_a_step_never_waits_for_others() {
    let policies = vec![Policy::Priority];
    let features = Features { policies, max_steps: 5, timers: true, ..Features::plain() };
    let (mut n_first, mut n_lose) = (0, 0);
    for seed in 0..rounds(150, 3_000) {
        let net = random_net(seed, &features);
        let Ok(waits) = waiting(&net, &Limits::default()) else { continue };
        let loses = |wait: &Wait| !matches!(wait, Wait::Bounded { turns: 0, .. });
        if may_lose(&net) {
            n_lose += waits.iter().filter(|it| loses(&it.wait)).count();
        } else {
            n_first += waits.len();
            for one in &waits {
                assert!(
                    !loses(&one.wait),
                    "seed {seed}: {one:?}\n{}",
                    grafsynth_ir::text::print(&net)
                );
            }
        }
    }
    println!("{n_first} are first, {n_lose} of the others lose their turn");
    assert!(n_first > 0 && n_lose > 0);
}
