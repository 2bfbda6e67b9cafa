//! Property-directed reachability against enumeration, on random nets: the same verdicts, and invariants that the checker accepts.

use grafsynth_ir::expr::{CompareOp, Type};
use grafsynth_ir::facts::Proof;
use grafsynth_ir::net::{Leaf, Net, Property, PropertyExpr, PropertyLeaf, PropertyRole};
use grafsynth_ir::{Span, Valid, validate};
use grafsynth_sim::{Random, Simulator, breaks_assumption};
use grafsynth_verify::{
    Directed, Invariant, Limits, Outcome, Refused, directed, properties, recheck, structural_facts,
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

/// A random net with some more asserts.
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
    let t0 = std::time::Instant::now();
    let mut score = Score::default();
    let Some(net) = asserting(seed, &features()) else { return score };
    // Nothing but the enumeration.
    let only = Limits {
        pairs: 5_000,
        rows_per_state: 256,
        image_work: 0,
        directed_work: 0,
        random_rows: 0,
        ..Limits::default()
    };
    let limits =
        Limits { directed_work: 300_000, conflicts: 500, circuit_nodes: 20_000, ..Limits::default() };
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
            let t1 = std::time::Instant::now();
            let d = directed(&net, facts, &limits, property);
            eprintln!("seed {seed} {} {:?} {:?} at {:?}", property.name, t1.elapsed(), match &d { Directed::Open(w) => w.clone(), Directed::Proved(i) => format!("proved {}", i.clauses.len()), Directed::Refuted{stimulus,..} => format!("refuted {}", stimulus.len())}, t0.elapsed());
            match (d, rows) {
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
                (Directed::Open(why), _) => {
                    score.open += 1;
                    if why.contains("confirm") {
                        fault(why);
                    }
                }
                (Directed::Proved(_), Some(rows)) => fault(format!("violated in row {rows}")),
                (Directed::Refuted { .. }, None) => fault("nothing violates it".to_owned()),
            }
        }
    }
    score
}

#[test]
fn the_verdicts_are_those_of_the_enumeration() {
    let scores = in_parallel(rounds(100, 20_000), compare);
    let faults: Vec<&String> = scores.iter().flat_map(|score| &score.faults).collect();
    let count = |of: fn(&Score) -> usize| scores.iter().map(of).sum::<usize>();
    let (proved, refuted, open) =
        (count(|one| one.proved), count(|one| one.refuted), count(|one| one.open));
    println!("{proved} proved, {refuted} refuted, {open} open");
    assert!(faults.is_empty(), "{} faults: {:#?}", faults.len(), &faults[..faults.len().min(20)]);
    assert!(proved > 100 && refuted > 100 && open * 5 < proved + refuted, "{proved} {refuted} {open}");
}
