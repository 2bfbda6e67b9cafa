//! An emergency dominates: this is proved over every state of a circuit, and a circuit in which it does not is refuted.

use grafsynth_backend_pld::Dialect;
use grafsynth_driver::judge::{self, Renames};
use grafsynth_driver::pipeline::{self, BuildOptions};
use grafsynth_driver::read::{Design, ReadLimits, Texts};
use grafsynth_driver::run::{logic_trace, net_trace};
use grafsynth_driver::source::Sources;
use grafsynth_driver::target::Target;
use grafsynth_ir::logic::{Logic, Node, NodeId, PinRole};
use grafsynth_ir::net::{Driver, Net, Output};
use grafsynth_ir::program::Origin;
use grafsynth_ir::{FileId, Valid, validate};
use grafsynth_sim::Stimulus;
use grafsynth_tests::random_net::{Features, random_net};
use grafsynth_tests::rounds;
use grafsynth_verify::{Dominance, Limits, Verdict, dominates, facts};

/// Two steps, an output whose safe value is on, one whose safe value is off, and an emergency on inputs, a step's time and a number. Its flip-flops and outputs
/// fit the ten macrocells of a GAL22V10, because one dialect supports only GALs.
const PRESS: &str = "net press
part press level 1
input stop bool
input go bool
output close bool continuous
    emit down
output brake bool safe 1 continuous
    emit up
output level int 0..3 safe 2 stored level
var level int 0..3 stored = 0
step up in press initial
step down in press
    entry { level := level + 1 }
transition t1 in press up -> down when go
transition t2 in press down -> up when not go
emergency when stop or down.t >= 2 or level = 3
";

fn net(text: &str) -> Valid<Net> {
    let (net, found) = grafsynth_ir::text::parse(FileId(0), text);
    validate(net.unwrap_or_else(|| panic!("{found:?}"))).expect("a net of the test is valid")
}

fn circuit(net: &Valid<Net>) -> Option<Logic> {
    circuit_within(net, &Limits::default())
}

fn circuit_within(net: &Valid<Net>, limits: &Limits) -> Option<Logic> {
    pipeline::logic(net, &facts(net, limits)).ok()
}

#[test]
fn every_text_of_a_circuit_is_proved_over_all_states() {
    let net = net(PRESS);
    let logic = circuit(&net).unwrap();
    for dialect in Dialect::ALL {
        let options = pipeline::emit_options(&net, None, None);
        let back = pipeline::through(&logic, dialect, &options).unwrap().read_back;
        match dominates(&net, &back, &Limits::default()) {
            Some(Dominance::Proved { pins, flops }) => {
                // The pins are close, brake and two bits of level; the flip-flops are two for steps, two for level, and two for
                // the time.
                assert_eq!(pins, 4, "{}", dialect.name());
                assert_eq!(flops, 6, "{}: {flops}", dialect.name());
            }
            other => panic!("{}: {other:?}", dialect.name()),
        }
    }
}

/// The circuit with another function on one pin.
fn with_pin(logic: &Logic, pin: usize, change: impl Fn(&mut Logic, NodeId) -> NodeId) -> Logic {
    let mut changed = logic.clone();
    let id = changed.outputs.ids().nth(pin).expect("a circuit has this pin");
    let value = changed.outputs[id].value;
    changed.outputs[id].value = change(&mut changed, value);
    changed
}

#[test]
fn a_pin_that_is_not_forced_is_found_out() {
    let plain = net(&PRESS.replace("emergency when", "// emergency when"));
    let net = net(PRESS);
    let limits = Limits::default();
    // The circuit without the emergency has no flip-flops for a time that only the condition reads.
    let (forced, free) = (circuit(&net).unwrap(), circuit(&plain).unwrap());
    assert!(matches!(dominates(&net, &free, &limits), Some(Dominance::Open(_))));
    let short = self::net(&PRESS.replace(" or down.t >= 2 or level = 3", ""));
    assert!(matches!(dominates(&short, &free, &limits), Some(Dominance::Refuted { .. })));
    for pin in 0..forced.outputs.len() {
        let inverted = with_pin(&forced, pin, |logic, value| logic.nodes.push(Node::Not(value)));
        let found = dominates(&net, &inverted, &limits);
        assert!(matches!(found, Some(Dominance::Refuted { .. })), "pin {pin}: {found:?}");
        let mut clocked = forced.clone();
        let id = clocked.outputs.ids().nth(pin).unwrap();
        clocked.outputs[id].registered = Some(false);
        let found = dominates(&net, &clocked, &limits);
        assert!(matches!(found, Some(Dominance::Open(_))), "pin {pin}: {found:?}");
    }
}

/// A pin that is wrong in an unreachable state: both steps at once. Equality with the net does not detect it; dominance does.
#[test]
fn states_that_are_never_reached_count() {
    let net = net(PRESS);
    let logic = circuit(&net).unwrap();
    let close = (logic.outputs.values())
        .position(|output| matches!(output.role, PinRole::Output(id, _) if id.index() == 0))
        .unwrap();
    let wrong = with_pin(&logic, close, |logic, value| {
        let steps: Vec<NodeId> =
            logic.flops.ids().take(2).map(|flop| logic.nodes.push(Node::Flop(flop))).collect();
        let both = logic.nodes.push(Node::And(steps));
        logic.nodes.push(Node::Or(vec![value, both]))
    });
    let facts = facts(&net, &Limits::default());
    let same = grafsynth_verify::equiv(&net, &facts, &wrong, &Limits::default());
    assert!(matches!(same, grafsynth_verify::Verdict::Proved(_)), "{same:?}");
    let found = dominates(&net, &wrong, &Limits::default());
    assert!(matches!(found, Some(Dominance::Refuted { .. })), "{found:?}");
}

/// A chart with two inputs and two variables whose types leave invalid codes: 5, 6 and 7.
const SORT: &str = "net sort
part sort level 1
input stop bool
input k int 0..4
output close bool safe 1 continuous
    emit up if n > 2
var n int 0..4 = 0
step up in sort initial
step down in sort
    entry { n := k }
transition t1 in sort up -> down when k > 0
transition t2 in sort down -> up when k = 0
emergency when CONDITION
";

/// A node that is true if the input `stop` has the value `stop` and the variable (with `of_input`, the input `k`) has one of the codes 5, 6 and 7.
fn without_value(logic: &mut Logic, of_input: bool, stop: bool) -> NodeId {
    let mut bits = Vec::new();
    let mut when = Vec::new();
    for (id, input) in logic.inputs.iter() {
        let PinRole::Input(one, bit) = input.role else { continue };
        if one.index() == 0 {
            when.push(Node::Input(id));
        } else if of_input {
            bits.push((bit, Node::Input(id)));
        }
    }
    for (id, flop) in logic.flops.iter().filter(|_| !of_input) {
        if let Some(holds) = flop.holds.filter(|holds| matches!(holds.origin, Origin::Var(_))) {
            assert!(!holds.inverted);
            bits.push((holds.bit, Node::Flop(id)));
        }
    }
    bits.sort_by_key(|(bit, _)| *bit);
    let bits: Vec<NodeId> = bits.into_iter().map(|(_, node)| logic.nodes.push(node)).collect();
    let [low, middle, high] = bits[..] else { panic!("three bits hold 0..4: {bits:?}") };
    let lower = logic.nodes.push(Node::Or(vec![low, middle]));
    let Some(pressed) = when.pop() else { panic!("no pin is `stop`") };
    let pressed = logic.nodes.push(pressed);
    let pressed = if stop { pressed } else { logic.nodes.push(Node::Not(pressed)) };
    logic.nodes.push(Node::And(vec![high, lower, pressed]))
}

/// If a number has an invalid code, the rest of the condition may still decide; only if it does not, the value of the condition is undefined.
#[test]
fn codes_without_a_value_count_where_the_rest_decides() {
    let cases = [
        // Condition, whether it is about the input or the variable, `stop`, and whether the modified circuit is refuted.
        ("stop or n > 3", false, true, true),
        ("stop or n > 3", false, false, false),
        ("stop or k > 3", true, true, true),
        ("stop or k > 3", true, false, false),
        // Conditions that are not tested, or cannot matter, leave nothing undefined.
        ("stop", false, true, true),
        ("stop and (n > 3 or up.active)", false, true, true),
        ("not (not stop and n > 3)", false, true, true),
        ("not (stop and n > 3)", false, false, true),
        // The condition is neither certainly true nor certainly false, so nothing that depends on it is certain.
        ("not (n > 3)", false, true, false),
        ("stop and n > 3", false, true, false),
        ("n + k > 3", true, true, false),
        ("(n > 3) = stop", false, true, false),
    ];
    for (condition, of_input, stop, is_found) in cases {
        let net = net(&SORT.replace("CONDITION", condition));
        let logic = circuit(&net).unwrap();
        let found = dominates(&net, &logic, &Limits::default());
        assert!(matches!(found, Some(Dominance::Proved { .. })), "{condition}: {found:?}");
        let spoiled = with_pin(&logic, 0, |logic, value| {
            let wrong = without_value(logic, of_input, stop);
            let right = logic.nodes.push(Node::Not(wrong));
            logic.nodes.push(Node::And(vec![value, right]))
        });
        let found = dominates(&net, &spoiled, &Limits::default());
        let is_as_expected = match found {
            Some(Dominance::Refuted { .. }) => is_found,
            Some(Dominance::Proved { .. }) => !is_found,
            Some(Dominance::Open(_)) | None => false,
        };
        assert!(is_as_expected, "{condition}, stop {stop}: {found:?}");
    }
}

/// If a net has only extern actions, or only Mealy outputs and a condition that reads more than inputs, no row could violate the property. Then there is no
/// property, rather than an empty proof.
#[test]
fn there_is_no_property_of_nothing() {
    let of = |outputs: &str, condition: &str| {
        let net = net(&format!(
            "net few
part few level 1
input stop bool
{outputs}step up in few initial
step down in few
transition t1 in few up -> down when stop
emergency when {condition}
"
        ));
        grafsynth_verify::with_emergency(&net).unwrap().properties.len()
    };
    let (function, mealy) =
        ("output beep bool extern\n    call up()\n", "output pulse bool mealy\n    emit up\n");
    assert_eq!(of("", "stop"), 0);
    assert_eq!(of(function, "stop"), 0);
    assert_eq!(of(mealy, "stop or down.active"), 0);
    assert_eq!(of(mealy, "stop"), 1);
    assert_eq!(of("output lamp bool continuous\n    emit up\n", "down.active"), 1);
}

/// The features that circuits support, with few steps.
fn small() -> Features {
    Features {
        max_steps: 4,
        tasks: false,
        history: false,
        sends: false,
        several_parts: false,
        ..Features::chip()
    }
}

/// Random nets: rows in which the condition is true show safe values; their circuits are proved, and are equal to them including the emergency.
#[test]
fn emergencies_of_random_nets_dominate() {
    let (mut n_circuits, mut n_open, mut n_properties) = (0, 0, 0);
    // This test is not about the facts; a net whose states cannot be enumerated quickly is often too large for the usual limits too.
    let limits = Limits { pairs: 20_000, states: 2_000, image_work: 500_000, ..Limits::default() };
    for seed in 0..rounds(150, 1_000) {
        // Half of the nets are small and have few features, so that many of them become circuits.
        let is_small = seed % 2 == 0;
        let features = if is_small { small() } else { Features::everything() };
        let net = random_net(seed, &features);
        if net.emergency.is_none() {
            continue;
        }
        let property = grafsynth_verify::with_emergency(&net).unwrap();
        let stimulus = Stimulus::random(&net, 60, seed, 1);
        if let [last] = &property.properties[net.properties.len()..] {
            n_properties += 1;
            let mut simulator = grafsynth_sim::Simulator::new(&property);
            assert!(!simulator.is_violated(last), "seed {seed}, row 0");
            for row in stimulus.rows() {
                simulator.step(&row);
                assert!(!simulator.is_violated(last), "seed {seed}");
            }
        } else {
            let is_silent = |output: &Output| {
                matches!(output.driver, Driver::Extern { .. } | Driver::Mealy(_) | Driver::Fires(_))
            };
            assert!(net.outputs.values().all(is_silent), "seed {seed}");
        }
        if !is_small {
            continue;
        }
        let Some(logic) = circuit_within(&net, &limits) else { continue };
        n_circuits += 1;
        match dominates(&net, &logic, &limits) {
            Some(Dominance::Proved { .. }) => {}
            Some(Dominance::Open(_)) => n_open += 1,
            other => panic!("seed {seed}: {other:?}\n{}", grafsynth_tests::readable(&net)),
        }
        let got = logic_trace(&net, &logic, &stimulus).unwrap();
        let found = grafsynth_sim::compare(&net_trace(&net, &stimulus), &got);
        assert!(found.is_none(), "seed {seed}: {found:?}");
    }
    assert!(n_properties > 20, "{n_properties} properties");
    assert!(n_circuits > 10 && n_open * 4 <= n_circuits, "{n_circuits} circuits, {n_open} open");
}

/// After the assumption was violated, the pins of a design with an emergency are still right. Its chip is equal to the design without the assumption,
/// from power-up on, for every input.
#[test]
fn no_pin_of_a_design_with_an_emergency_rests_on_an_assumption() {
    let text = include_str!("../../examples/drill/drill.graf");
    let read = |text: &str| {
        let mut sources = Sources::default();
        let main = sources.add("drill.graf", text);
        let texts = Texts { main, ..Texts::default() };
        match grafsynth_driver::read::read(&sources, &texts, ReadLimits::default()) {
            (Some(Design::Net(design)), _) => design.net,
            (_, found) => panic!("the drill is a chart: {found:?}"),
        }
    };
    let drill = read(text);
    let free = text.replacen("assume never (up and down)", "", 1);
    assert!(free.len() < text.len(), "the drill has an assumption");
    let free = read(&free);
    let limits = Limits::default();
    let options = BuildOptions {
        device: Some("gal22v10".to_owned()),
        prove: true,
        dont_cares: true,
        ..BuildOptions::default()
    };
    let facts = pipeline::facts(&drill, &limits);
    let built = pipeline::build(&drill, &facts, &[Target::Jedec], &options);
    assert!(built.found.iter().all(|finding| !finding.is_error()), "{:?}", built.found);
    let file = built.files.first().expect("a fuse map");
    let (jedec, _) = grafsynth_backend_pld::jedec::read(FileId(0), &file.text);
    let (burned, _) =
        grafsynth_driver::fuse_design::design(&jedec.expect("a map"), FileId(0)).expect("a device");
    let circuit = burned.circuit().expect("one clock");
    let renames = Renames::parse(&renames(&free, circuit)).expect("pairs of names");
    let stimulus = Stimulus::random(&free, 5_000, 1, 1);
    let outcome = judge::with_net(&free, circuit, &stimulus, &renames).expect("common pins");
    assert_eq!(outcome.n_columns, free.outputs.len());
    assert_eq!(outcome.difference, None);
    let verdict = judge::prove_with_net(&free, circuit, &renames, &limits).expect("common pins");
    assert!(matches!(verdict, Verdict::Proved(_)), "{verdict:?}");
}

/// Renames for a device whose pins cannot have the dots in the names of a design with several charts.
fn renames(net: &Net, circuit: &Logic) -> Vec<String> {
    let inputs = net.inputs.values().map(|input| &input.name.text);
    let outputs = net.outputs.values().map(|output| &output.name.text);
    let pins = circuit.inputs.values().map(|pin| &pin.name);
    let pins: Vec<&String> = pins.chain(circuit.outputs.values().map(|pin| &pin.name)).collect();
    let plain = |name: &str| name.replace(|c: char| !c.is_ascii_alphanumeric(), "").to_lowercase();
    let pair = |name: &String| {
        let pin = pins.iter().find(|pin| plain(pin) == plain(name))?;
        Some(format!("{pin}={name}"))
    };
    inputs.chain(outputs).filter_map(pair).collect()
}
