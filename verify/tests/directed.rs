//! Property-directed reachability against enumeration, on random nets: the same verdicts, and invariants that the checker accepts.

use grafsynth_frontend::graf;
use grafsynth_ir::expr::{CompareOp, Type};
use grafsynth_ir::facts::Proof;
use grafsynth_ir::logic::{Flop, FlopId};
use grafsynth_ir::lower::lower;
use grafsynth_ir::lower::program::{ProgramOptions, program};
use grafsynth_ir::net::{Enter, Leaf, Net, Property, PropertyExpr, PropertyLeaf, PropertyRole};
use grafsynth_ir::program::Origin;
use grafsynth_ir::{FileId, Span, Valid, validate};
use grafsynth_logic::build::Builder;
use grafsynth_logic::{EncodeOptions, encode};
use grafsynth_sim::{Random, Simulator, breaks_assumption};
use grafsynth_verify::equiv::by_induction;
use grafsynth_verify::exclusive::entered;
use grafsynth_verify::{
    Directed, Limits, Outcome, PropertyVerdict, Times, Verdict, directed, properties, recheck,
    structural_facts,
};

use crate::oracle::{in_parallel, rounds};
use crate::random_net::{Features, random_net};

fn leaf(leaf: Leaf) -> PropertyExpr {
    PropertyExpr::leaf(PropertyLeaf::Net(leaf), Span::default())
}

/// A condition on one step, input, variable or output.
fn condition(net: &Net, random: &mut Random) -> PropertyExpr {
    let of_type = |value: PropertyExpr, ty: Type, random: &mut Random| match ty {
        Type::Bool => value,
        Type::Int { lo, hi } => {
            let op = [CompareOp::Eq, CompareOp::Ge, CompareOp::Lt][random.below(3)];
            let least = random.between(lo, hi);
            PropertyExpr::compare(op, value, PropertyExpr::int(least))
        }
    };
    let steps: Vec<_> = net.steps.ids().collect();
    let condition = match random.below(8) {
        0 if !net.inputs.is_empty() => {
            let inputs: Vec<_> = net.inputs.iter().collect();
            let (id, input) = inputs[random.below(inputs.len())];
            of_type(leaf(Leaf::Input(id)), input.ty, random)
        }
        1 | 2 if net.vars.values().any(|var| var.len.is_none()) => {
            let vars: Vec<_> = net.vars.iter().filter(|(_, var)| var.len.is_none()).collect();
            let (id, var) = vars[random.below(vars.len())];
            of_type(leaf(Leaf::Var(id)), var.ty, random)
        }
        3 if !net.outputs.is_empty() => {
            let outputs: Vec<_> = net.outputs.iter().collect();
            let (id, output) = outputs[random.below(outputs.len())];
            let value = PropertyExpr::leaf(PropertyLeaf::Output(id), Span::default());
            of_type(value, output.ty, random)
        }
        _ => leaf(Leaf::Active(steps[random.below(steps.len())])),
    };
    if random.below(4) == 0 { condition.not() } else { condition }
}

/// A random net with a few more asserts.
fn asserting(seed: u64, features: &Features) -> Option<Valid<Net>> {
    let mut net = Net::clone(&random_net(seed, features));
    let mut random = Random::new(seed ^ 0x5eed);
    for number in 0..4 {
        let n = 1 + random.below(3);
        let all: Vec<_> = (0..n).map(|_| condition(&net, &mut random)).collect();
        net.properties.push(Property {
            name: format!("asserted{number}"),
            role: PropertyRole::Assert,
            never: PropertyExpr::and(all),
            meta: Default::default(),
        });
    }
    validate(net).ok()
}

fn features() -> Features {
    let mut features = Features::everything().without_statecharts();
    (features.unspecified, features.max_steps) = (false, 9);
    features
}

#[derive(Debug, Default)]
struct Score {
    proved: usize,
    refuted: usize,
    open: usize,
    faults: Vec<String>,
}

/// True if the last row of the stimulus, and no row that breaks an assumption, shows the violation.
fn shows(net: &Valid<Net>, property: &Property, stimulus: &grafsynth_sim::Stimulus) -> bool {
    let mut simulator = Simulator::new(net);
    for row in stimulus.rows() {
        if breaks_assumption(net, &row) {
            return false;
        }
        simulator.step(&row);
    }
    simulator.is_violated(property)
}

fn compare(seed: u64) -> Score {
    let mut score = Score::default();
    let Some(net) = asserting(seed, &features()) else { return score };
    // This variant uses only the enumeration.
    let only = Limits {
        pairs: 3_000,
        rows_per_state: 256,
        image_work: 0,
        directed_work: 0,
        circuit_nodes: 1_000,
        conflicts: 10,
        random_rows: 0,
        ..Limits::default()
    };
    let limits = Limits {
        directed_work: 300_000,
        conflicts: 500,
        circuit_nodes: 20_000,
        ..Limits::default()
    };
    let facts = structural_facts(&net);
    for verdict in properties(&net, &only) {
        let property = &net.properties[verdict.property];
        let rows = match &verdict.outcome {
            Outcome::Proved { by: Proof::Explicit, .. } => None,
            // The search does not examine the reset.
            Outcome::Refuted { row, is_shortest: true, .. } if *row > 0 => Some(*row),
            Outcome::Proved { .. } | Outcome::Refuted { .. } | Outcome::Open(_) => continue,
        };
        for facts in [Some(&facts), None] {
            let mut fault = |text: String| {
                score.faults.push(format!("seed {seed}, {}: {text}", property.name));
            };
            match (directed(&net, facts, &limits, property), rows) {
                (Directed::Proved(invariant), None) => {
                    score.proved += 1;
                    if let Err(why) = recheck(&net, &limits, property, &invariant) {
                        fault(format!("the invariant is refused: {why}"));
                    }
                }
                (Directed::Refuted { stimulus, is_shortest }, Some(rows)) => {
                    score.refuted += 1;
                    if !shows(&net, property, &stimulus) {
                        fault("the stimulus does not violate it".to_owned());
                    }
                    if is_shortest && stimulus.len() != rows || stimulus.len() < rows {
                        fault(format!("{} rows instead of {rows}", stimulus.len()));
                    }
                }
                (Directed::Open(_), _) => score.open += 1,
                (Directed::Unconfirmed, _) => fault("the simulator shows no violation".to_owned()),
                (Directed::Proved(_), Some(rows)) => fault(format!("violated in row {rows}")),
                (Directed::Refuted { .. }, None) => fault("nothing violates it".to_owned()),
            }
        }
    }
    score
}

#[test]
fn the_verdicts_are_those_of_the_enumeration() {
    let scores = in_parallel(rounds(150, 20_000), compare);
    let faults: Vec<&String> = scores.iter().flat_map(|score| &score.faults).collect();
    let count = |of: fn(&Score) -> usize| scores.iter().map(of).sum::<usize>();
    let (proved, refuted, open) =
        (count(|one| one.proved), count(|one| one.refuted), count(|one| one.open));
    println!("{proved} proved, {refuted} refuted, {open} open");
    assert!(faults.is_empty(), "{} faults: {:#?}", faults.len(), &faults[..faults.len().min(20)]);
    assert!(
        proved > 100 && refuted > 100 && open * 3 < proved + refuted,
        "{proved} {refuted} {open}"
    );
}

/// A ring of philosophers, each of whom takes one fork and then the other.
fn philosophers(n: usize) -> Valid<Net> {
    let inputs: Vec<String> =
        (0..n).flat_map(|at| ["take", "left", "put"].map(|word| format!("{word}{at}"))).collect();
    let mut text = format!("chart ring {{ conflict priority\n input {}\n", inputs.join(", "));
    text += "assert never (eat0.active and eat1.active)\n";
    for at in 0..n {
        text += &format!("initial step think{at}\ninitial step fork{at}\n");
        text += &format!("step wait{at}\nstep eat{at}\n");
    }
    for at in 0..n {
        let other = (at + 1) % n;
        text += &format!("think{at} & fork{at} -> wait{at} when take{at}\n");
        text += &format!("wait{at} & fork{other} -> eat{at} when left{at}\n");
        text += &format!("eat{at} -> think{at} & fork{at} & fork{other} when put{at}\n");
    }
    let parsed = graf::parse(FileId(0), &(text + "}"));
    lower(&parsed.design.expect("a design")).0.expect("a net")
}

#[test]
fn a_circuit_may_differ_where_neighbours_eat_at_once() {
    let net = philosophers(12);
    let program = program(&net, &ProgramOptions::default()).expect("a program");
    let facts = structural_facts(&net);
    let logic = encode(&net, &program, &facts, &EncodeOptions::default()).expect("a circuit");
    let flop_of = |name: &str| {
        let step = net.steps.iter().find(|(_, step)| step.name.text == name);
        let origin = Origin::Step(step.expect("a step").0);
        let holds = |flop: &Flop| flop.holds.is_some_and(|holds| holds.origin == origin);
        logic.flops.iter().find(|(_, flop)| holds(flop)).map(|(id, _)| id).expect("a flip-flop")
    };
    let inverted = |id: FlopId| logic.flops[id].holds.is_some_and(|holds| holds.inverted);
    let limits = Limits { pairs: 1_000, random_rows: 500, ..Limits::default() };
    // The next value of `wait5` is inverted in the states in which both steps are active.
    for (first, second, is_equal) in [("eat0", "eat1", true), ("eat0", "eat2", false)] {
        let mut builder = Builder::resume(logic.clone());
        let active = [first, second].map(flop_of).map(|flop| {
            let value = builder.flop(flop);
            if inverted(flop) { builder.not(value) } else { value }
        });
        let both = builder.and(active);
        let spoiled = flop_of("wait5");
        let next = builder.xor(logic.flops[spoiled].next, both);
        let mut wrong = builder.logic;
        wrong.flops[spoiled].next = next;
        match by_induction(&net, &facts, &wrong, &limits) {
            Verdict::Proved(certificate) => {
                assert!(is_equal, "{certificate}");
                assert_eq!(certificate.proof(), Proof::Directed, "{certificate}");
            }
            other => assert!(!is_equal, "{other:?}"),
        }
    }
}

#[test]
fn the_answer_gives_the_invariant() {
    let net = philosophers(16);
    let verdicts = properties(&net, &Limits::default());
    let [PropertyVerdict { outcome: Outcome::Proved { by, invariant: Some(found), .. }, .. }] =
        verdicts.as_slice()
    else {
        panic!("{verdicts:?}")
    };
    assert_eq!((*by, found.times, found.micro_steps), (Proof::Directed, Times::Counted, 1));
    let property = &net.properties[0];
    assert_eq!(recheck(&net, &Limits::default(), property, found), Ok(()));
    // Without its last clause it is weaker.
    let mut weaker = found.clone();
    weaker.clauses.pop();
    assert!(recheck(&net, &Limits::default(), property, &weaker).is_err());
}

/// The condition that some transition is enabled although one of the steps that it enters is active and stays active.
fn second_token(net: &Net) -> PropertyExpr {
    let active = |step| leaf(Leaf::Active(step));
    let mut ways = Vec::new();
    for transition in net.transitions.values() {
        let entered = entered(transition).filter(|step| !transition.requires.contains(step));
        let required = || transition.requires.iter().map(|step| active(*step));
        ways.extend(entered.map(|step| PropertyExpr::and(required().chain([active(step)]))));
    }
    PropertyExpr::or(ways)
}

#[test]
fn no_step_of_a_ring_gets_a_second_token() {
    let ring = philosophers(if rounds(0, 1) == 0 { 30 } else { 300 });
    let mut net = Net::clone(&ring);
    net.properties[0].never = second_token(&ring);
    let net = validate(net).expect("a valid net");
    let facts = structural_facts(&net);
    for facts in [Some(&facts), None] {
        let found = directed(&net, facts, &Limits::default(), &net.properties[0]);
        assert!(matches!(found, Directed::Proved(_)), "{found:?}");
    }
    // If two philosophers put the same fork back, there is one token too many.
    let mut broken = Net::clone(&net);
    let fork = broken.steps.iter().find(|(_, step)| step.name.text == "fork3").expect("a fork").0;
    let last = broken.transitions.ids().last().expect("a transition");
    broken.transitions[last].enters.push(Enter::Step(fork));
    broken.properties[0].never = second_token(&broken);
    let broken = validate(broken).expect("a valid net");
    match directed(&broken, None, &Limits::default(), &broken.properties[0]) {
        Directed::Refuted { stimulus, is_shortest } => {
            assert!(is_shortest && shows(&broken, &broken.properties[0], &stimulus));
            assert_eq!(stimulus.len(), 2, "the last philosopher takes both forks");
        }
        other => panic!("{other:?}"),
    }
}
