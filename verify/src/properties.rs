//! Decides the assertions of a chart, and whether its assumptions can be satisfied.

use grafsynth_ir::expr::{CompareOp, Type};
use grafsynth_ir::facts::Proof;
use grafsynth_ir::net::{Driver, Leaf, Net, Property, PropertyExpr, PropertyLeaf, PropertyRole};
use grafsynth_ir::{Diagnostic, Valid, validate};
use grafsynth_sim::{Simulator, Stimulus, breaks_assumption};

use crate::alphabet::NoAlphabet;
use crate::classes::Classes;
use crate::codes;
use crate::explore::{Ended, Searched, Seen, States, Ticks, Times, explore, explore_any};
use crate::facts::structural_facts;
use crate::limits::Limits;
use crate::relevance::Relevance;
use crate::symbolic::{self, Directed, Invariant};
use crate::verdict::{Open, OpenReason, Scope, Tested};

/// The answer for one `assert`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PropertyVerdict {
    /// The index of the property in [`Net::properties`].
    pub property: usize,
    /// The answer for the property.
    pub outcome: Outcome,
}

/// The result for one property.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Outcome {
    /// No stimulus that satisfies the assumptions violates the property, for any `dt`. A result for some `dt` only is [`Open`](Outcome::Open).
    Proved {
        /// The method that proved the property.
        by: Proof,
        /// The number of states that were enumerated (those that differ only in their times may count as one) or that the decision diagram contains;
        /// 0 if the proof needed none.
        states: u64,
        /// The inductive invariant, if property-directed reachability found one.
        invariant: Option<Invariant>,
    },
    /// The last row of this stimulus violates the property; if `is_shortest`, no shorter stimulus does.
    Refuted {
        /// A stimulus of the chart.
        stimulus: Stimulus,
        /// The row of the trace: 0 is the reset.
        row: usize,
        /// True if no stimulus with fewer rows violates the property.
        is_shortest: bool,
    },
    /// Open, with the reason.
    Open(Open),
}

/// The net with one more `assert` at the end: during the emergency, every output is safe. The net itself if it has no emergency, or if none of its
/// outputs can be checked.
///
/// The condition forces mealy outputs with its value before the micro-step, so the property covers them only if the condition reads nothing but inputs.
///
/// # Errors
/// The errors of validation; none is expected, because a property may read everything that the condition of an emergency may read.
pub fn with_emergency(net: &Valid<Net>) -> Result<Valid<Net>, Vec<Diagnostic>> {
    let Some(emergency) = &net.emergency else { return Ok(net.clone()) };
    let over_inputs = emergency.condition.leaves().all(|leaf| matches!(leaf, Leaf::Input(_)));
    let span = emergency.meta.span;
    let is_unsafe = net.outputs.iter().filter_map(|(id, output)| {
        let value = PropertyExpr::leaf(PropertyLeaf::Output(id), span);
        let safe = output.safe_value();
        match &output.driver {
            Driver::Mealy(_) if !over_inputs => None,
            _ if !output.is_forced() => None,
            _ => Some(match output.ty {
                Type::Bool if safe == 0 => value,
                Type::Bool => value.not(),
                Type::Int { .. } => {
                    PropertyExpr::compare(CompareOp::Ne, value, PropertyExpr::int(safe))
                }
            }),
        }
    });
    let is_unsafe: Vec<PropertyExpr> = is_unsafe.collect();
    if is_unsafe.is_empty() {
        // The property would be "never false", which proves nothing.
        return Ok(net.clone());
    }
    let leaf = |leaf: &Leaf| PropertyLeaf::Net(*leaf);
    let holds = emergency.condition.map_leaves(&leaf);
    let mut more = Net::clone(net);
    more.properties.push(Property {
        name: "emergency".to_owned(),
        role: PropertyRole::Assert,
        never: PropertyExpr::and([holds, PropertyExpr::or(is_unsafe)]),
        meta: emergency.meta.clone(),
    });
    validate(more)
}

/// Decides every `assert` of the net, in order.
#[must_use]
pub fn properties(net: &Valid<Net>, limits: &Limits) -> Vec<PropertyVerdict> {
    let asserts = asserts(net);
    if asserts.is_empty() {
        return Vec::new();
    }
    let note = |outcomes: &mut Vec<Option<Outcome>>, states: &States, seen: &Seen<'_, '_>| {
        note_violations(net, &asserts, outcomes, states, seen, true)
    };
    let (Searched { seen, states, ended, .. }, given_up) =
        explore_any(net, limits, || at_reset(net, &asserts), note);
    let outcomes = either(seen, given_up.map(|it| it.seen));
    decide(net, limits, &asserts, outcomes, &states, &ended)
}

/// Every `assert` with its index.
pub(crate) fn asserts(net: &Net) -> Vec<(usize, &Property)> {
    let all = net.properties.iter().enumerate();
    all.filter(|(_, property)| property.role == PropertyRole::Assert).collect()
}

/// The assertions that the row of the reset violates.
pub(crate) fn at_reset(net: &Valid<Net>, asserts: &[(usize, &Property)]) -> Vec<Option<Outcome>> {
    let reset = Simulator::new(net);
    let broken = || Outcome::Refuted { stimulus: Stimulus::new(net), row: 0, is_shortest: true };
    asserts.iter().map(|(_, property)| reset.is_violated(property).then(broken)).collect()
}

/// The results of a search, completed by those of an earlier abandoned one.
pub(crate) fn either(
    outcomes: Vec<Option<Outcome>>,
    given_up: Option<Vec<Option<Outcome>>>,
) -> Vec<Option<Outcome>> {
    match given_up {
        None => outcomes,
        Some(given_up) => {
            outcomes.into_iter().zip(given_up).map(|(one, other)| one.or(other)).collect()
        }
    }
}

/// Decides the asserts that the search of all states (with any `dt`) did not decide.
pub(crate) fn decide(
    net: &Valid<Net>,
    limits: &Limits,
    asserts: &[(usize, &Property)],
    mut outcomes: Vec<Option<Outcome>>,
    states: &States,
    ended: &Ended<()>,
) -> Vec<PropertyVerdict> {
    let mut why_open = Vec::new();
    match ended {
        Ended::Complete => {
            for outcome in outcomes.iter_mut().filter(|outcome| outcome.is_none()) {
                let by = Proof::Explicit;
                *outcome = Some(proved(by, states.len() as u64));
            }
        }
        Ended::Stopped(()) => {}
        Ended::Open(why) => why_open.push(why.clone()),
    }
    if outcomes.iter().any(Option::is_none) {
        let facts = structural_facts(net);
        for ((_, property), outcome) in asserts.iter().zip(&mut outcomes) {
            if outcome.is_none() {
                let by = symbolic::never(net, &facts, limits, &property.never);
                *outcome = by.map(|by| proved(by, 0));
            }
        }
    }
    if outcomes.iter().any(Option::is_none) {
        by_direction(net, limits, asserts, &mut outcomes);
    }
    let mut is_broken = vec![false; asserts.len()];
    if outcomes.iter().any(Option::is_none) {
        by_diagram(net, limits, asserts, &mut outcomes, &mut is_broken);
    }
    let mut holds_for_chips = false;
    if outcomes.iter().any(Option::is_none) && Relevance::of(net).has_time() {
        holds_for_chips = for_chips(net, limits, asserts, &mut outcomes);
    }
    if outcomes.iter().any(Option::is_none) {
        at_random(net, limits, asserts, &mut outcomes);
    }
    asserts
        .iter()
        .zip(outcomes)
        .zip(is_broken)
        .map(|(((index, _), outcome), is_broken)| PropertyVerdict {
            property: *index,
            outcome: outcome.unwrap_or_else(|| {
                let reactions = limits.random_rows as u64;
                let mut reasons =
                    if is_broken { vec![OpenReason::Unfound] } else { why_open.clone() };
                if holds_for_chips && !is_broken {
                    reasons.insert(0, OpenReason::OnlyFor(Scope::OneTick));
                }
                Outcome::Open(Open {
                    reasons,
                    tested: Some(Tested { reactions, ..Tested::default() }),
                })
            }),
        })
        .collect()
}

/// Decides the asserts without a search: those that are refuted already, and those that the structure or induction proves. `None` if some remain.
pub(crate) fn decide_soon(
    net: &Valid<Net>,
    limits: &Limits,
    asserts: &[(usize, &Property)],
    outcomes: &[Option<Outcome>],
) -> Option<Vec<PropertyVerdict>> {
    let facts = structural_facts(net);
    let verdict = |((property, data), outcome): (&(usize, &Property), &Option<Outcome>)| {
        let by_induction = || symbolic::never(net, &facts, limits, &data.never);
        let outcome = outcome.clone().or_else(|| Some(proved(by_induction()?, 0)))?;
        Some(PropertyVerdict { property: *property, outcome })
    };
    asserts.iter().zip(outcomes).map(verdict).collect()
}

/// Enumerates the reactions of at most one tick, and notes the properties that they violate. Returns true if the enumeration is complete: then no such reaction
/// violates the remaining properties.
fn for_chips(
    net: &Valid<Net>,
    limits: &Limits,
    asserts: &[(usize, &Property)],
    outcomes: &mut [Option<Outcome>],
) -> bool {
    let (_, ended) = explore(net, limits, Times::Each(Ticks::Chip), &mut |states, seen| {
        note_violations(net, asserts, outcomes, states, seen, false)
    });
    matches!(ended, Ended::Complete)
}

/// Notes which properties the reaction is the first to violate; stops when all have an answer.
pub(crate) fn note_violations(
    net: &Net,
    asserts: &[(usize, &Property)],
    outcomes: &mut [Option<Outcome>],
    states: &States,
    seen: &Seen<'_, '_>,
    is_shortest: bool,
) -> Option<()> {
    for ((_, property), outcome) in asserts.iter().zip(outcomes.iter_mut()) {
        if outcome.is_none() && !seen.row.open.any() && seen.simulator.is_violated(property) {
            let stimulus = Stimulus::of_rows(net, &states.way_of(seen));
            let row = stimulus.len();
            *outcome = Some(Outcome::Refuted { stimulus, row, is_shortest });
        }
    }
    outcomes.iter().all(Option::is_some).then_some(())
}

/// A proof without an invariant of its own.
fn proved(by: Proof, states: u64) -> Outcome {
    Outcome::Proved { by, states, invariant: None }
}

/// Searches for an invariant or a stimulus for each assert that has no answer yet.
fn by_direction(
    net: &Valid<Net>,
    limits: &Limits,
    asserts: &[(usize, &Property)],
    outcomes: &mut [Option<Outcome>],
) {
    let facts = structural_facts(net);
    let n_open = outcomes.iter().filter(|outcome| outcome.is_none()).count() as u64;
    let work = limits.directed_work / n_open.clamp(1, 8);
    let limits = Limits { directed_work: work, ..limits.clone() };
    for ((_, property), outcome) in asserts.iter().zip(outcomes) {
        if outcome.is_none() {
            *outcome = match symbolic::directed(net, Some(&facts), &limits, property) {
                Directed::Proved(invariant) => {
                    let (by, invariant) = (Proof::Directed, Some(invariant));
                    Some(Outcome::Proved { by, states: 0, invariant })
                }
                Directed::Refuted { stimulus, is_shortest } => {
                    let row = stimulus.len();
                    Some(Outcome::Refuted { stimulus, row, is_shortest })
                }
                Directed::Open(_) | Directed::Unconfirmed => None,
            };
        }
    }
}

/// Uses the decision diagram of all reachable states if they could not be enumerated. It proves properties and detects violations, but gives no
/// stimulus.
fn by_diagram(
    net: &Valid<Net>,
    limits: &Limits,
    asserts: &[(usize, &Property)],
    outcomes: &mut [Option<Outcome>],
    is_broken: &mut [bool],
) {
    let open: Vec<usize> = (0..asserts.len()).filter(|at| outcomes[*at].is_none()).collect();
    let never: Vec<_> = open.iter().map(|at| &asserts[*at].1.never).collect();
    let Ok(reached) = symbolic::reach(net, &structural_facts(net), limits, &never, &[]) else {
        return;
    };
    for (at, breaks) in open.into_iter().zip(&reached.breaks) {
        match breaks {
            Some(false) => {
                let (by, states) = (Proof::Symbolic, reached.states);
                outcomes[at] = Some(proved(by, states));
            }
            Some(true) => is_broken[at] = reached.exact,
            None => {}
        }
    }
}

/// Tries random stimuli if not all states could be enumerated.
fn at_random(
    net: &Valid<Net>,
    limits: &Limits,
    asserts: &[(usize, &Property)],
    outcomes: &mut [Option<Outcome>],
) {
    const ROWS: usize = 500;
    let mut simulator = Simulator::new(net);
    for seed in 0..limits.random_rows.div_ceil(ROWS) as u64 {
        let stimulus = Stimulus::random(net, ROWS, seed + 1, 3);
        simulator.reset();
        for (number, input) in stimulus.rows().enumerate() {
            if breaks_assumption(net, &input) {
                break;
            }
            simulator.step(&input);
            for ((_, property), outcome) in asserts.iter().zip(outcomes.iter_mut()) {
                if outcome.is_none()
                    && !simulator.row().open.any()
                    && simulator.is_violated(property)
                {
                    let mut stimulus = stimulus.clone();
                    stimulus.truncate(number + 1);
                    *outcome =
                        Some(Outcome::Refuted { stimulus, row: number + 1, is_shortest: false });
                }
            }
            if outcomes.iter().all(Option::is_some) {
                return;
            }
        }
    }
}

/// Returns an error if no row of inputs satisfies all assumptions, because then proofs have no meaning.
#[must_use]
pub fn check_assumption(net: &Valid<Net>) -> Option<Diagnostic> {
    let Err(NoAlphabet::Contradiction) = Classes::of(net, &Limits::default()) else {
        return None;
    };
    let mut error = Diagnostic::error(
        codes::ASSUMPTION_EMPTY,
        "no row of inputs satisfies all assumptions, so every proof is meaningless",
    );
    for property in net.properties.iter().filter(|property| property.role == PropertyRole::Assume) {
        error = error.at(property.meta.span, "excludes rows");
    }
    Some(error.help("weaken one of them; `assume never e` excludes the rows in which e is true"))
}

#[cfg(test)]
mod tests {
    use grafsynth_ir::Span;
    use grafsynth_ir::expr::Expr;
    use grafsynth_ir::net::{Leaf, PropertyExpr, PropertyLeaf};

    use super::*;
    use crate::testing::{chart, find, input, valid};

    fn never(net: &mut Net, role: PropertyRole, leaves: &[Leaf]) {
        let all = leaves.iter().map(|leaf| Expr::leaf(PropertyLeaf::Net(*leaf), Span::default()));
        let never: PropertyExpr = Expr::and(all);
        net.properties.push(Property {
            name: String::new(),
            role,
            never,
            meta: Default::default(),
        });
    }

    fn fig5(role: Option<PropertyRole>) -> Valid<Net> {
        let mut net = chart("s* a b | s>a:x s>b:y a>s:nx b>s:ny");
        let (a, b) = (find(&net, "a"), find(&net, "b"));
        let (x, y) = (input(&mut net, "x"), input(&mut net, "y"));
        never(&mut net, PropertyRole::Assert, &[Leaf::Active(a), Leaf::Active(b)]);
        if let Some(role) = role {
            never(&mut net, role, &[Leaf::Input(x), Leaf::Input(y)]);
        }
        valid(net)
    }

    #[test]
    fn a_broken_property_has_a_shortest_stimulus() {
        let verdicts = properties(&fig5(None), &Limits::default());
        let Outcome::Refuted { stimulus, row, is_shortest } = &verdicts[0].outcome else {
            panic!("{verdicts:?}")
        };
        assert_eq!((stimulus.len(), *row, *is_shortest), (1, 1, true));
    }

    #[test]
    fn an_assumption_is_not_enough_where_tokens_part_later() {
        // Under `never (x and y)` the two transitions never fire together, so one token cannot be in two steps.
        let verdicts = properties(&fig5(Some(PropertyRole::Assume)), &Limits::default());
        assert!(matches!(verdicts[0].outcome, Outcome::Proved { states: 3, .. }), "{verdicts:?}");
    }

    #[test]
    fn what_components_exclude_needs_no_enumeration() {
        let mut net = chart("s* a b | s>a:x s>b:nx a>s:y b>s:y");
        let (a, b) = (find(&net, "a"), find(&net, "b"));
        never(&mut net, PropertyRole::Assert, &[Leaf::Active(a), Leaf::Active(b)]);
        let verdicts = properties(&valid(net), &Limits { pairs: 1, ..Limits::default() });
        let proved = proved(Proof::Structural, 0);
        assert_eq!(verdicts[0].outcome, proved);
    }

    #[test]
    fn assumptions_that_exclude_everything_are_reported() {
        let mut net = chart("a* b | a>b:x");
        let x = input(&mut net, "x");
        never(&mut net, PropertyRole::Assume, &[Leaf::Input(x)]);
        assert!(check_assumption(&valid(net.clone())).is_none());
        net.properties.push(Property {
            name: String::new(),
            role: PropertyRole::Assume,
            never: Expr::leaf(PropertyLeaf::Net(Leaf::Input(x)), Span::default()).not(),
            meta: Default::default(),
        });
        assert_eq!(
            check_assumption(&valid(net)).map(|error| error.code),
            Some(codes::ASSUMPTION_EMPTY)
        );
    }
}
