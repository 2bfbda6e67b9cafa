//! Reachable situations as a decision diagram: the same answers as enumeration if both are possible, and answers that only the diagram can give.

use itertools::Itertools as _;
use std::collections::BTreeMap;

use grafsynth_frontend::graf;
use grafsynth_ir::expr::Type;
use grafsynth_ir::facts::{Facts, Proof};
use grafsynth_ir::lower::lower;
use grafsynth_ir::net::{Evolution, Leaf, Net, Property, PropertyExpr, PropertyLeaf, PropertyRole};
use grafsynth_ir::{FileId, Span, Valid, validate};
use grafsynth_verify::{Limits, OpenReason, Outcome, facts, properties};

use crate::oracle::rounds;
use crate::random_net::{Features, random_net};

fn enumerated(net: &Valid<Net>) -> Option<Facts> {
    // Most searches that do not end within a few thousand pairs do not end at all.
    let pairs = rounds(6_000, 30_000);
    let limits = Limits { pairs, rows_per_state: 1024, image_work: 0, ..Limits::default() };
    Some(facts(net, &limits)).filter(|facts| facts.reach.is_some())
}

fn as_diagram(net: &Valid<Net>) -> Facts {
    facts(net, &Limits { pairs: 0, image_work: 2_000_000, ..Limits::default() })
}

#[test]
fn the_diagram_says_what_the_enumeration_says() {
    let n_nets: u64 =
        std::option_env!("VERIFY_NETS").and_then(|n| n.parse().ok()).unwrap_or(rounds(36, 60));
    let mut features = Features::everything().without_statecharts();
    (features.unspecified, features.max_steps) = (false, 9);
    let mut n_same = 0;
    let mut kinds: BTreeMap<String, u32> = BTreeMap::new();
    let mut open: BTreeMap<String, Vec<u64>> = BTreeMap::new();
    for seed in 0..n_nets {
        let net = random_net(seed, &features);
        let Some(explicit) = enumerated(&net) else { continue };
        let symbolic = as_diagram(&net);
        let Some(reach) = &symbolic.reach else {
            open.entry(symbolic.open.join("; ")).or_default().push(seed);
            continue;
        };
        assert_eq!(reach.by, Proof::Symbolic, "seed {seed}");
        assert!(reach.exact && reach.sets.is_none(), "seed {seed}");
        assert_eq!(
            Some(reach.situations),
            explicit.reach.as_ref().map(|reach| reach.situations),
            "seed {seed}"
        );
        assert_eq!(symbolic.unreachable_steps, explicit.unreachable_steps, "seed {seed}");
        assert_eq!(symbolic.dead_transitions, explicit.dead_transitions, "seed {seed}");
        let depth = |facts: &Facts| facts.stable_depth.as_ref().map(|proved| proved.value);
        assert_eq!(depth(&symbolic), depth(&explicit), "seed {seed}");
        assert_eq!(symbolic.component_of, explicit.component_of, "seed {seed}");
        let sets = |facts: &Facts| -> Vec<_> {
            facts.components.iter().map(|one| (one.steps.clone(), one.always)).collect()
        };
        assert_eq!(sets(&symbolic), sets(&explicit), "seed {seed}");
        n_same += 1;
        let is_stable = net.settings.evolution != Evolution::Single;
        *kinds.entry(format!("{:?} stable {is_stable}", net.settings.policy)).or_default() += 1;
    }
    for (why, seeds) in &open {
        println!("{} x {why}: {:?}", seeds.len(), &seeds[..seeds.len().min(6)]);
    }
    println!("{n_same} {kinds:?}");
    assert!(n_same * 4 > n_nets, "{n_same}");
}

fn net(text: &str) -> Valid<Net> {
    let parsed = graf::parse(FileId(0), text);
    assert!(parsed.diagnostics.iter().all(|one| !one.is_error()), "{:#?}", parsed.diagnostics);
    let (net, findings) = lower(&parsed.design.expect("a design"));
    net.unwrap_or_else(|| panic!("{findings:#?}"))
}

/// Rings of four steps, each advanced by its own input. The first steps of all rings are declared first, then the second ones, and so on, so the
/// declaration order is a bad order for a diagram.
fn rings(n: usize, settings: &str) -> String {
    let list = |word: &str| (0..n).map(|ring| format!("{word}{ring}")).join(", ");
    let mut text = format!("chart rings {{ {settings}\n input {}\n", list("x"));
    for (at, kind) in ["initial step", "step", "step", "step"].into_iter().enumerate() {
        text.extend((0..n).map(|ring| format!(" {kind} s{at}_{ring}\n")));
    }
    for ring in 0..n {
        for (at, not) in ["", "not ", "", "not "].into_iter().enumerate() {
            let next = (at + 1) % 4;
            text += &format!(" s{at}_{ring} -> s{next}_{ring} when {not}x{ring}\n");
        }
    }
    text + "}\n"
}

fn few_pairs() -> Limits {
    Limits { pairs: 1_000, ..Limits::default() }
}

#[test]
fn independent_rings_multiply() {
    for settings in ["conflict priority", "conflict all"] {
        let facts = facts(&net(&rings(20, settings)), &few_pairs());
        let reach = facts.reach.expect("a diagram");
        assert_eq!((reach.situations, reach.exact, reach.by), (1 << 40, true, Proof::Symbolic));
        assert_eq!((facts.open, facts.dead_transitions), (Vec::<String>::new(), Vec::new()));
    }
}

#[test]
fn a_count_beyond_any_word_says_so() {
    let facts = facts(&net(&rings(80, "conflict priority")), &few_pairs());
    let reach = facts.reach.expect("a diagram");
    assert_eq!((reach.situations, reach.exact), (u128::MAX, false));
    assert_eq!(facts.open.len(), 1, "{:?}", facts.open);
}

#[test]
fn limits_end_the_attempt_and_say_so() {
    let net = net(&rings(20, "conflict priority"));
    for (limits, why) in [
        (Limits { image_bits: 90, ..few_pairs() }, "state and inputs have 100 bits"),
        (Limits { bdd_nodes: 500, ..few_pairs() }, "500 nodes"),
        (Limits { image_work: 500, ..few_pairs() }, "500 steps of work"),
    ] {
        let facts = facts(&net, &limits);
        assert_eq!(facts.reach, None);
        assert!(facts.open.len() == 1 && facts.open[0].contains(why), "{:?}", facts.open);
        assert!(facts.unreachable_steps.is_empty() && facts.dead_transitions.is_empty());
    }
}

/// The facts from the diagram, after a comparison with the enumeration.
fn both(text: &str) -> Facts {
    let net = net(text);
    let symbolic = as_diagram(&net);
    let explicit = enumerated(&net).expect("few states");
    let reach = symbolic.reach.as_ref().expect("a diagram");
    assert_eq!(Some(reach.situations), explicit.reach.map(|reach| reach.situations), "{text}");
    assert_eq!(symbolic.dead_transitions, explicit.dead_transitions, "{text}");
    assert_eq!(symbolic.unreachable_steps, explicit.unreachable_steps, "{text}");
    symbolic
}

fn situations(facts: &Facts) -> u128 {
    facts.reach.as_ref().map_or(0, |reach| reach.situations)
}

#[test]
fn an_assumption_cuts_situations() {
    let fork = |assume: &str| {
        format!(
            "chart c {{ input a, b, k: int 0..5\n {assume}\n initial step s step x step y step z\n \
             s -> x when a  s -> y when b  x -> s when not a  y -> s when not b  s -> z when k > 3 }}"
        )
    };
    // Both at once; then each token moves independently.
    let free = both(&fork(""));
    let one = both(&fork("assume never (a and b)"));
    let small = both(&fork("assume never (a and b) assume never k > 3"));
    assert!(situations(&free) > situations(&one) && situations(&one) > situations(&small));
    assert_eq!((small.unreachable_steps.len(), small.dead_transitions.len()), (1, 1));
    // No input is possible, so nothing ever happens.
    let none = both(&fork("assume never a assume never not a"));
    assert_eq!((situations(&none), none.dead_transitions.len()), (1, 5));
}

#[test]
fn events_exclude_each_other_where_the_chart_says_so() {
    let fork = |settings: &str| {
        format!(
            "chart c {{ {settings}\n event a, b\n initial step s step x step y\n \
             s -> x when a  s -> y when b  x -> s when b  y -> s when a }}"
        )
    };
    let (free, exclusive) = (both(&fork("")), both(&fork("events exclusive")));
    assert!(situations(&free) > 3);
    assert_eq!(situations(&exclusive), 3);
    // Only the situations show that no two of the steps are ever active together.
    assert_eq!(exclusive.components.len(), 1);
    assert!(exclusive.components[0].always && exclusive.components[0].by == Proof::Symbolic);
}

#[test]
fn any_time_may_pass_at_once() {
    // With one tick per reaction x is always left for z; with many, y is reached too.
    let text = "chart c { tick 10 ms\n initial step s step x step y step z\n input i\n \
                s -> x when i  x -> y when x.t >= 30 ms  x -> z when x.t >= 10 ms and x.t < 30 ms }";
    let facts = both(text);
    assert_eq!(situations(&facts), 4);
    assert_eq!(facts.dead_transitions.len(), 0);
}

#[test]
fn properties_are_proved_beyond_enumeration() {
    // Twenty rings, and a pair of tokens that move in step because they read the same input: no component and no single reaction shows that.
    let mut text = rings(20, "conflict priority");
    text.truncate(text.len() - "}\n".len());
    text += " input go\n initial step a0 step a1 step a2 step a3 initial step b0 step b1 step b2 step b3\n \
             a0 -> a1 when go  a1 -> a2 when go  a2 -> a3 when go  a3 -> a0 when go\n \
             b0 -> b1 when go  b1 -> b2 when go  b2 -> b3 when go  b3 -> b0 when go\n \
             assert never (a3.active and b1.active)\n assert never (s0_0.active and s1_0.active)\n \
             assert never (s3_0.active and s3_1.active and s3_2.active and s3_3.active and s3_4.active and s3_5.active and s3_6.active and s3_7.active and s3_8.active and s3_9.active and s3_10.active and s3_11.active and s3_12.active)\n}\n";
    let net = net(&text);
    let verdicts = properties(&net, &Limits { random_rows: 500, directed_work: 0, ..few_pairs() });
    let outcomes: Vec<&Outcome> = verdicts.iter().map(|verdict| &verdict.outcome).collect();
    let [Outcome::Proved { by: Proof::Symbolic, states, .. }, second, third] = outcomes[..] else {
        panic!("{outcomes:?}")
    };
    assert_eq!(*states, 4 << 40);
    assert!(matches!(second, Outcome::Proved { by: Proof::Structural, .. }), "{second:?}");
    // Random inputs do not reach it in so few rows, but the diagram does.
    assert!(
        matches!(third, Outcome::Open(why) if why.reasons == [OpenReason::Unfound]),
        "{third:?}"
    );
}

#[test]
fn properties_have_the_same_answers_from_the_diagram() {
    let mut features = Features::everything().without_statecharts();
    (features.unspecified, features.max_steps, features.integers) = (false, 7, false);
    let (mut n_proved, mut n_broken) = (0, 0);
    for seed in 0..rounds(24, 400) {
        let mut plain = (*random_net(seed, &features)).clone();
        plain.properties.retain(|property| property.role == PropertyRole::Assume);
        let mut leaves: Vec<PropertyLeaf> =
            plain.steps.ids().take(3).map(|step| PropertyLeaf::Net(Leaf::Active(step))).collect();
        let flags = plain.inputs.iter().filter(|(_, input)| input.ty == Type::Bool);
        leaves.extend(flags.take(2).map(|(id, _)| PropertyLeaf::Net(Leaf::Input(id))));
        let outputs = plain.outputs.iter().filter(|(_, output)| output.ty == Type::Bool);
        leaves.extend(outputs.take(2).map(|(id, _)| PropertyLeaf::Output(id)));
        for (at, a) in leaves.iter().enumerate() {
            for b in &leaves[..at] {
                let all = [a, b].map(|leaf| PropertyExpr::leaf(*leaf, Span::default()));
                plain.properties.push(Property {
                    name: String::new(),
                    role: PropertyRole::Assert,
                    never: PropertyExpr::and(all),
                    meta: Default::default(),
                });
            }
        }
        let Ok(net) = validate(plain) else { continue };
        let small = Limits {
            pairs: 20_000,
            rows_per_state: 1024,
            image_work: 0,
            circuit_nodes: 20_000,
            conflicts: 100,
            directed_work: 0,
            ..Limits::default()
        };
        let none = Limits { pairs: 0, random_rows: 0, image_work: 2_000_000, ..small.clone() };
        for (a, b) in properties(&net, &small).into_iter().zip(properties(&net, &none)) {
            match (&a.outcome, &b.outcome) {
                (
                    Outcome::Proved { by: Proof::Explicit, .. },
                    Outcome::Proved { by: Proof::Symbolic, .. },
                ) => n_proved += 1,
                (Outcome::Refuted { .. }, Outcome::Open(why))
                    if why.reasons.contains(&OpenReason::Unfound) =>
                {
                    n_broken += 1;
                }
                (Outcome::Refuted { row, .. }, Outcome::Proved { .. }) => {
                    panic!("seed {seed}: {:?} in row {row}", net.properties[a.property])
                }
                (Outcome::Proved { .. }, Outcome::Open(why)) => {
                    assert!(
                        !why.reasons.contains(&OpenReason::Unfound),
                        "seed {seed}: {:?}",
                        net.properties[a.property]
                    );
                }
                _ => {}
            }
        }
    }
    println!("{n_proved} proved, {n_broken} broken");
    assert!(n_proved > 30 && n_broken > 30, "{n_proved} {n_broken}");
}
