//! One register for each region of a statechart, whose history is the register's kept value: circuits compared with the reference simulator.
//!
//! The charts below are the smallest in which a register that keeps its value could differ from a history that is recorded.

#![allow(
    clippy::print_stdout,
    clippy::disallowed_methods,
    reason = "tests report what they ran, and read the examples"
)]

use grafsynth_backend_pld::Dialect;
use grafsynth_driver::read::{Design, ReadLimits, Texts, read};
use grafsynth_driver::run::{logic_trace, net_trace};
use grafsynth_driver::source::Sources;
use grafsynth_driver::{coding, pipeline};
use grafsynth_engines::{Availability, EngineError, Job};
use grafsynth_ir::Valid;
use grafsynth_ir::logic::{Logic, Node, NodeId, PinRole};
use grafsynth_ir::net::{Net, Policy, StepKind};
use grafsynth_ir::program::Origin;
use grafsynth_logic::state_assignment::{Encoding, recode};
use grafsynth_logic::{BusyMode, kept_apart};
use grafsynth_sim::{Difference, Stimulus, compare};
use grafsynth_tests::large_chart::LargeChart;
use grafsynth_tests::random_net::{Features, random_net, shrink};
use grafsynth_tests::{readable, rounds};
use grafsynth_verify::equiv::{by_chance, by_enumeration};
use grafsynth_verify::{Limits, Verdict};

fn chart(text: &str) -> Valid<Net> {
    let mut sources = Sources::default();
    let main = sources.add("chart.graf", text);
    let (design, found) =
        read(&sources, &Texts { main, ..Texts::default() }, ReadLimits::default());
    match design {
        Some(Design::Net(design)) => design.net,
        Some(Design::Logic(_)) | None => panic!("{text}\n{found:?}"),
    }
}

/// The number of flip-flops for the states of a chart with one register for each region: one for each child of a composite state or of the chart.
fn children_of_regions(net: &Net) -> usize {
    let in_a_region = |parent| net.steps[parent].kind != StepKind::Parallel;
    net.steps.values().filter(|step| step.parent.is_none_or(in_a_region)).count()
}

fn n_flops(logic: &Logic, wanted: impl Fn(Origin) -> bool) -> usize {
    logic.flops.values().filter(|flop| flop.holds.is_some_and(|bit| wanted(bit.origin))).count()
}

fn is_state(origin: Origin) -> bool {
    matches!(origin, Origin::Step(_) | Origin::Region(_))
}

/// A chart, the number of flip-flops of its states, and the histories that have their own.
struct Case {
    name: &'static str,
    text: &'static str,
    n_states: usize,
    apart: &'static [&'static str],
}

const CASES: &[Case] = &[
    Case {
        name: "before the region was ever entered a history is its default, which is not the first state, and runs its content",
        text: "chart c { conflict inner-first  event go, next, back
            var n: int 0..3 = 0
            initial state off
            state on { history h -> b do { n := n + 1 }  initial state a  state b  state d
                a -> d on next  b -> a on next }
            off -> on.h on go  off -> on on next  on -> off on back }",
        n_states: 5,
        apart: &[],
    },
    Case {
        name: "the region is active at reset, so that it is recorded though nothing entered it",
        text: "chart c { conflict inner-first  event go, next, back
            initial state on { history h -> b  initial state a  state b  a -> b on next  b -> a on next }
            state off
            off -> on.h on go  off -> on on next  on -> off on back }",
        n_states: 4,
        apart: &[],
    },
    Case {
        name: "the region is left through the parent of its parent, or alone, or not active when that is left",
        text: "chart c { conflict inner-first  event go, next, back, turn
            initial state off
            state outer { initial state other
                state mid { history h -> y  initial state x  state y  state z  x -> y on next  y -> z on next }
                other -> mid on turn  mid -> other on turn  other -> mid.h on next }
            outer -> off on back  off -> outer on go  off -> mid.h on next }",
        n_states: 7,
        apart: &[],
    },
    Case {
        name: "a deep history over a parallel state: its regions have no flip-flops of their own",
        text: "chart c { conflict inner-first  event go, next, back, turn
            initial state off
            state on { history deep h -> q  initial state q
                parallel p {
                    region r { initial state a  state b { initial state b1  state b2  b1 -> b2 on turn }  a -> b on next  b -> a on next }
                    region s { initial state d  state e  d -> e on turn } }
                q -> p on go  p -> q on go }
            off -> on.h on go  off -> on on next  on -> off on back }",
        n_states: 10,
        apart: &[],
    },
    Case {
        name: "a shallow history of a parallel state knows that it was active once, and enters its regions by default",
        text: "chart c { conflict inner-first  event go, next, back
            var n: int 0..3 = 0
            initial state off
            parallel p { history h -> b & e do { n := n + 1 }
                region r { initial state a  state b  a -> b on next }
                region s { initial state d  state e  d -> e on next } }
            off -> p.h on go  off -> p on next  p -> off on back }",
        n_states: 8,
        apart: &[],
    },
    Case {
        name: "a deep history around a shallow one, entered by either",
        text: "chart c { conflict inner-first  event go, next, back, turn
            initial state off
            state on { history deep h -> w  initial state w
                state mid { history k -> y  initial state x  state y { initial state y1  state y2  y1 -> y2 on next }
                    x -> y on next  y -> x on turn }
                w -> mid.k on turn  mid -> w on go }
            on -> off on back  off -> on.h on go  off -> mid.k on next }",
        n_states: 8,
        apart: &[],
    },
    Case {
        name: "left and entered again in one micro-step: what is recorded just now is entered",
        text: "chart c { conflict inner-first  event go, next, back
            initial state off
            state on { history h -> b  initial state a  state b { initial state b1  state b2  b1 -> b2 on next }  a -> b on next }
            off -> on.h on go  on -> off on back  on -> on.h on go }",
        n_states: 6,
        apart: &[],
    },
    Case {
        name: "left and entered again in one reaction of several micro-steps",
        text: "chart c { conflict inner-first  event go, next, back  input x
            initial state off
            state on { history h -> b  initial state a  state b  state d  a -> b on next  b -> d on next  d -> a on next  b -> d when x and rise(x) }
            off -> on.h on go  on -> off on back  off -> on.h when x }",
        n_states: 5,
        apart: &[],
    },
    Case {
        name: "entered from inside without leaving the owner: the register has moved on, so the history has its own flip-flops",
        text: "chart c { conflict inner-first  event go, next, back, turn
            initial state off
            state on { history h -> b  initial state a  state b  state d  a -> b on next  b -> d on next  d -> on.h on turn }
            off -> on on go  on -> off on back }",
        n_states: 5,
        apart: &["on.h"],
    },
    Case {
        name: "final states: what is recorded is final, and its completion is reported again",
        text: "chart c { conflict inner-first  queue 2  event go, next, back
            initial state off
            state live { history h -> a  initial state a  final state f  a -> f on next }
            state done
            live -> done on live.done  done -> live.h on go  off -> live.h on go  live -> off on back  done -> off on back }",
        n_states: 5,
        apart: &[],
    },
    Case {
        name: "all regions final under a deep history, and a chart that ends",
        text: "chart c { conflict inner-first  queue 2  event go, next, back, turn
            initial state off
            state live { history deep h -> p
                initial parallel p {
                    region r { initial state a  final state f  a -> f on next }
                    region s { initial state d  final state g  d -> g on turn } } }
            final state over
            p -> off on p.done  off -> live.h on go  live -> off on back  off -> over on turn }",
        n_states: 8,
        apart: &[],
    },
];

/// Checks that the circuit does not differ from the net: with a random stimulus, and by enumeration.
fn check(what: &str, net: &Valid<Net>, logic: &Logic) {
    let stimulus = Stimulus::random(net, 300, 1, 1);
    let got = logic_trace(net, logic, &stimulus).expect("the stimulus is for a chip");
    assert_eq!(compare(&net_trace(net, &stimulus), &got), None, "{what}");
    let verdict = by_enumeration(net, logic, &Limits::default());
    assert!(matches!(verdict, Verdict::Proved(_)), "{what}: {verdict:?}");
}

#[test]
fn each_small_chart_is_its_registers() {
    for Case { name, text, n_states, apart } in CASES {
        let net = chart(text);
        let facts = pipeline::facts(&net, &Limits::default());
        let own: Vec<&str> = kept_apart(&net)
            .into_iter()
            .map(|(history, _)| net.histories[history].name.text.as_str())
            .collect();
        assert_eq!(&own, apart, "{name}");
        for busy in [BusyMode::Never, BusyMode::Always] {
            let logic = pipeline::logic_as(&net, &facts, busy).expect("a circuit");
            assert_eq!(n_flops(&logic, is_state), *n_states, "{name}");
            let n_recorded = n_flops(&logic, |origin| matches!(origin, Origin::Recorded(..)));
            assert_eq!(n_recorded > 0, !apart.is_empty(), "{name}");
            check(name, &net, &logic);
        }
        let logic = pipeline::logic(&net, &facts).expect("a circuit");
        for dialect in [Dialect::Verilog, Dialect::Palasm, Dialect::Blif] {
            let options = pipeline::emit_options(&net, None, None);
            match pipeline::through(&logic, dialect, &options) {
                Ok(through) => check(name, &net, &through.read_back),
                // A queue is too large for sums of products.
                Err(found) => assert!(
                    dialect == Dialect::Palasm && found.iter().all(|one| one.code.id == "G0710"),
                    "{name}: {found:?}"
                ),
            }
        }
    }
}

/// A register that is cleared when its state is left is an error, which is detected if the value matters.
#[test]
fn a_register_that_forgets_is_found_out() {
    let mut n_refuted = 0;
    for Case { name, text, .. } in CASES {
        let net = chart(text);
        let facts = pipeline::facts(&net, &Limits::default());
        let right = pipeline::logic_as(&net, &facts, BusyMode::Never).expect("a circuit");
        let of = |logic: &Logic, wanted: Origin| -> Option<NodeId> {
            logic
                .flops
                .values()
                .find(|flop| flop.holds.is_some_and(|bit| bit.origin == wanted))
                .map(|flop| flop.next)
        };
        for step in net.steps.ids() {
            let Some(parent) = net.steps[step].parent else { continue };
            let mut logic = right.clone();
            let own = of(&logic, Origin::Region(step));
            let around = of(&logic, Origin::Step(parent));
            let (Some(own), Some(around)) = (own, around) else { continue };
            let cleared = logic.nodes.push(Node::And(vec![own, around]));
            for (_, flop) in logic.flops.iter_mut() {
                if flop.holds.is_some_and(|bit| bit.origin == Origin::Region(step)) {
                    flop.next = cleared;
                }
            }
            let verdict = by_enumeration(&net, &logic, &Limits::default());
            // The value of the default child does not need to be kept, so not every circuit is refuted.
            n_refuted += u32::from(matches!(verdict, Verdict::Refuted(_)));
            assert!(!matches!(verdict, Verdict::Open(_)), "{name}: {verdict:?}");
        }
    }
    println!("{n_refuted} registers that forget were found out");
    assert!(n_refuted >= 12, "only {n_refuted}");
}

fn with_history() -> Features {
    let policies = vec![Policy::InnerFirst, Policy::OuterFirst];
    // Wide values are expensive here and are tested elsewhere.
    Features { policies, integers: false, arrays: false, ..Features::everything() }
}

fn difference(net: &Valid<Net>, logic: &Logic, seed: u64) -> Option<Difference> {
    let stimulus = Stimulus::random(net, 80, seed, 1);
    let got = logic_trace(net, logic, &stimulus).expect("the stimulus is for a chip");
    compare(&net_trace(net, &stimulus), &got)
}

/// Charts whose registers of regions are encoded as numbers, with the expected number of flip-flops. They have a register that is empty until its state is
/// entered, one that is set at once, and registers below a deep history, which become empty again when their state is left for another.
const CODED: [(&str, usize); 3] = [
    (
        "chart late { conflict inner-first event a, b, c, d, down, up
         initial state O { O -> H on up }
         state W { initial -> A  history H -> A
           W -> O on down  W -> A on a  W -> B on b  W -> C on c  W -> D on d
           state A  state B  state C  state D } }",
        // The register of the chart has two values (O or W); the other register has five: empty, or one of four states.
        1 + 3,
    ),
    (
        "chart early { conflict inner-first event a, b, c, d, down, up
         initial state W { initial -> A  history H -> A
           W -> O on down  W -> A on a  W -> B on b  W -> C on c  W -> D on d
           state A  state B  state C  state D }
         state O { O -> H on up } }",
        1 + 2,
    ),
    (
        "chart deep { conflict inner-first event a, b, c, x, down, up
         initial state O { O -> H on up }
         state W { initial -> A  history deep H -> A
           W -> O on down  W -> A on a  W -> B on b  W -> C on c
           state A { initial -> A1  A1 -> A2 on x  A2 -> A3 on x  A3 -> A1 on x
             state A1  state A2  state A3 }
           state B  state C } }",
        // The register of A too may be empty.
        1 + 2 + 2,
    ),
];

#[test]
fn registers_of_regions_are_numbers() {
    for (text, n_wanted) in CODED {
        let net = chart(text);
        let facts = pipeline::facts(&net, &Limits::default());
        let logic = pipeline::logic(&net, &facts).expect("it has a circuit");
        let groups = coding::groups(&net, &facts, &logic);
        let coded = recode(&logic, &groups, Encoding::Compact, 0);
        let name = &net.name;
        assert_eq!(coded.flops.len(), n_wanted, "{name}: {groups:?}");
        let of_region = |origin| matches!(origin, Origin::Region(_));
        assert!(coded.decoded.iter().any(|bit| of_region(bit.holds.origin)), "{name}");
        for seed in 0..rounds(20, 100) {
            assert!(difference(&net, &coded, seed).is_none(), "{name}, seed {seed}");
        }
        let verdict = grafsynth_verify::equiv(&net, &facts, &coded, &Limits::default());
        assert!(matches!(verdict, Verdict::Proved(_)), "{name}: {verdict:?}");
    }
}

#[test]
fn random_statecharts_with_history() {
    let total = rounds(80, 300);
    let (mut n_kept, mut n_apart, mut n_texts, mut n_coded) = (0, 0, 0, 0_u64);
    let limits = Limits { pairs: 500, states: 100, image_work: 1, ..Limits::default() };
    for seed in 0..total {
        let net = random_net(seed, &with_history());
        if net.histories.is_empty() {
            continue;
        }
        n_apart += u64::from(!kept_apart(&net).is_empty());
        let facts = grafsynth_verify::facts(&net, &limits);
        for busy in [BusyMode::WhenUnproved, BusyMode::Always] {
            let make = |net: &Valid<Net>| pipeline::logic_as(net, &facts, busy).ok();
            let Some(logic) = make(&net) else { continue };
            if n_flops(&logic, |origin| matches!(origin, Origin::Region(_))) == 0 {
                continue;
            }
            n_kept += 1;
            if difference(&net, &logic, seed).is_some() {
                let again = |net: &Valid<Net>| {
                    let facts = grafsynth_verify::facts(net, &limits);
                    let logic = pipeline::logic_as(net, &facts, busy).ok()?;
                    difference(net, &logic, seed)
                };
                let small = shrink(&net, |net| again(net).is_some());
                panic!("seed {seed}, {busy:?}: {:?}\n{}", again(&small), readable(&small));
            }
            // If the data about the groups of a region were wrong, some step would differ when the registers are numbers.
            let is_busy = logic.outputs.values().any(|output| output.role == PinRole::Busy);
            if !is_busy {
                let groups = coding::groups(&net, &facts, &logic);
                let coded = recode(&logic, &groups, Encoding::Compact, 0);
                n_coded += u64::from(!coded.decoded.is_empty());
                let found = difference(&net, &coded, seed);
                assert!(found.is_none(), "seed {seed}, coded: {found:?}\n{}", readable(&net));
            }
            let dialect = [Dialect::Verilog, Dialect::Blif][(seed % 2) as usize];
            let options = pipeline::emit_options(&net, None, None);
            if let Ok(through) = pipeline::through(&logic, dialect, &options) {
                n_texts += 1;
                let found = by_chance(&net, &through.read_back, 256);
                assert!(found.is_none(), "seed {seed}: {found:?}\n{}", readable(&net));
            }
        }
    }
    println!(
        "{n_kept} circuits with registers that keep, {n_coded} of them coded, {n_apart} charts with others, {n_texts} texts"
    );
    assert!(n_kept * 8 >= total, "only {n_kept} of {total}");
    assert!(n_apart > 0 && n_texts * 8 >= total, "{n_apart}, {n_texts} of {total}");
}

/// Runs engines on a chart; returns how many of them gave a trace.
fn run_engines(net: &Valid<Net>, wanted: &[&str]) -> usize {
    let facts = pipeline::facts(net, &Limits { pairs: 2_000, image_work: 1, ..Limits::default() });
    let stimulus = Stimulus::random(net, 100, 7, 1);
    let expected = net_trace(net, &stimulus);
    let mut n_run = 0;
    for engine in grafsynth_engines::all().into_iter().filter(|engine| engine.by_default()) {
        if !wanted.is_empty() && !wanted.contains(&engine.name()) {
            continue;
        }
        if let Availability::Missing(tool) = engine.availability() {
            println!("skipped: {tool} is not installed");
            continue;
        }
        match engine.run(&Job { net, facts: &facts, stimulus: &stimulus }) {
            Ok(got) => {
                n_run += 1;
                let found = compare(&expected, &got);
                assert_eq!(found, None, "{}\n{}", engine.name(), readable(net));
            }
            // The chart does not fit the device, or its sums of products are too large.
            Err(EngineError::Refused(found)) => assert!(
                found.iter().all(|one| one.code.id.starts_with("G07")),
                "{}: {found:?}",
                engine.name()
            ),
            Err(why) => panic!("{}: {why:?}\n{}", engine.name(), readable(net)),
        }
    }
    n_run
}

/// Every available engine, on the small charts; other forms of the same circuit only in deep tests.
#[test]
fn all_engines_keep_what_is_left() {
    let wanted: &[&str] =
        if rounds(0, 1) == 1 { &[] } else { &["ir", "c", "equations", "verilog"] };
    let n_run: usize = CASES.iter().map(|case| run_engines(&chart(case.text), wanted)).sum();
    println!("{n_run} runs");
    assert!(n_run >= CASES.len() * 2, "only {n_run}");
}

/// The Verilog of random charts in an independent simulator.
#[test]
fn random_charts_in_a_verilog_simulator() {
    let mut n_run = 0;
    for seed in 0..rounds(60, 600) {
        let net = random_net(seed, &with_history());
        if net.histories.is_empty() {
            continue;
        }
        let limits = Limits { pairs: 2_000, image_work: 1, ..Limits::default() };
        let facts = pipeline::facts(&net, &limits);
        let Ok(logic) = pipeline::logic(&net, &facts) else { continue };
        let n_kept = n_flops(&logic, |origin| matches!(origin, Origin::Region(_)));
        if n_kept > 0 && logic.nodes.len() < 3_000 {
            n_run += run_engines(&net, &["verilog"]);
        }
    }
    println!("{n_run} runs");
}

/// The flip-flops for the states of a large chart are those of its regions, with or without histories, shallow or deep; its circuit is linear in size.
#[test]
fn a_large_chart_has_a_flip_flop_for_each_child_of_a_region() {
    let mut of_size = Vec::new();
    let sizes: &[usize] = if rounds(0, 1) == 1 { &[217, 513, 1001] } else { &[217, 513] };
    for &size in sizes {
        for history in [None, Some(false), Some(true)] {
            let chart = LargeChart::of_size(size).expect("a size that is measured");
            let net = LargeChart { history, raises: true, ..chart }.net().expect("it is a chart");
            let facts = grafsynth_verify::structural_facts(&net);
            let logic = pipeline::logic(&net, &facts).expect("a circuit");
            assert_eq!(n_flops(&logic, is_state), children_of_regions(&net), "{size} {history:?}");
            assert_eq!(n_flops(&logic, |origin| matches!(origin, Origin::Recorded(..))), 0);
            println!("{size} {history:?}: {} flip-flops", logic.flops.len());
            of_size.push((net.steps.len(), history, logic.nodes.len()));
        }
    }
    for (small, large) in of_size.iter().zip(&of_size[3..]) {
        assert_eq!(small.1, large.1);
        let wanted = small.2 as f64 * large.0 as f64 / small.0 as f64;
        assert!((large.2 as f64) < wanted * 1.1, "{small:?} {large:?}");
    }
}
