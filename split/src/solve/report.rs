//! The cost and resource use of a placement, and the effect of each single move.

use super::model::{Origin, parts_of, whole};
use super::problem::{NodeIndex, PartIndex, Problem, ProblemError};
use super::state::State;

/// One constraint of a problem.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Constraint {
    /// The capacity of a resource of a part.
    Capacity {
        /// The part.
        part: PartIndex,
        /// The resource.
        resource: usize,
    },
    /// The pins of a part.
    Pins {
        /// The part.
        part: PartIndex,
    },
    /// The parts on which a node is allowed, if these are not all parts.
    Allowed {
        /// The node.
        node: NodeIndex,
    },
    /// The set with this index in [`Problem::together`].
    Together {
        /// The index.
        set: usize,
    },
    /// The set with this index in [`Problem::forbidden`].
    Forbidden {
        /// The index.
        set: usize,
    },
}

/// How much of a capacity or of the pins a placement uses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Usage {
    /// [`Constraint::Capacity`] or [`Constraint::Pins`].
    pub constraint: Constraint,
    /// The used amount.
    pub used: u64,
    /// The available amount; `None` is unlimited.
    pub capacity: Option<u64>,
}

impl Usage {
    /// Whether there is enough.
    pub fn fits(&self) -> bool {
        self.capacity.is_none_or(|capacity| self.used <= capacity)
    }
}

/// The cost and resource use of a placement.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Evaluation {
    /// The objective. A node on a part where it is not allowed counts as 0.
    pub value: i64,
    /// The use of all capacities, part by part, and then of the pins of the parts.
    pub usage: Vec<Usage>,
    /// The constraints that the placement violates; empty if it is feasible.
    pub broken: Vec<Constraint>,
}

/// Computes the cost and resource use of a placement, directly from the definition.
///
/// # Errors
/// [`ProblemError`] if the problem or the placement is malformed.
pub fn evaluate(problem: &Problem, assignment: &[PartIndex]) -> Result<Evaluation, ProblemError> {
    problem.check()?;
    problem.check_assignment(assignment)?;
    Ok(evaluate_checked(problem, assignment))
}

pub(super) fn evaluate_checked(problem: &Problem, assignment: &[PartIndex]) -> Evaluation {
    let mut value = 0;
    let mut broken = Vec::new();
    let mut used = vec![vec![0; problem.resources()]; problem.parts.len()];
    let mut pins = vec![0; problem.parts.len()];
    for (index, (node, &part)) in problem.nodes.iter().zip(assignment).enumerate() {
        let Some(choice) = &node.choices[part] else {
            broken.push(Constraint::Allowed { node: index });
            continue;
        };
        value += choice.cost;
        used[part].iter_mut().zip(&choice.uses).for_each(|(sum, amount)| *sum += amount);
    }
    let parts_with = |nodes: &mut dyn Iterator<Item = &NodeIndex>| {
        nodes.fold(0, |mask, &node| mask | 1 << assignment[node])
    };
    for wire in &problem.wires {
        let present: u32 = parts_with(&mut wire.readers.iter().chain([&wire.driver]));
        if present.count_ones() > 1 {
            value += wire.cost.cast_signed();
            parts_of(present).for_each(|part| pins[part] += 1);
        }
    }
    for one in &problem.presences {
        let present: u32 = parts_with(&mut one.nodes.iter());
        if one.on.iter().any(|part| present >> part & 1 == 1) {
            value += one.cost.cast_signed();
            pins[one.at] += one.pins;
        }
    }
    for (pins, part) in pins.iter_mut().zip(&problem.parts) {
        *pins = pins.saturating_add_signed(part.always);
    }
    let usage = usage(problem, &used, &pins);
    broken.extend(usage.iter().filter(|usage| !usage.fits()).map(|usage| usage.constraint));
    for (set, nodes) in problem.together.iter().enumerate() {
        if nodes.windows(2).any(|pair| assignment[pair[0]] != assignment[pair[1]]) {
            broken.push(Constraint::Together { set });
        }
    }
    for (set, forbidden) in problem.forbidden.iter().enumerate() {
        if forbidden.decisions().iter().all(|&(node, part)| assignment[node] == part) {
            broken.push(Constraint::Forbidden { set });
        }
    }
    Evaluation { value, usage, broken }
}

fn usage(problem: &Problem, used: &[Vec<u64>], pins: &[u64]) -> Vec<Usage> {
    let mut usage = Vec::new();
    for (part, (limits, used)) in problem.parts.iter().zip(used).enumerate() {
        for (resource, (&capacity, &used)) in limits.capacities.iter().zip(used).enumerate() {
            usage.push(Usage {
                constraint: Constraint::Capacity { part, resource },
                used,
                capacity,
            });
        }
    }
    for (part, (limits, &used)) in problem.parts.iter().zip(pins).enumerate() {
        usage.push(Usage { constraint: Constraint::Pins { part }, used, capacity: limits.pins });
    }
    usage
}

/// The effect of moving one node, with the nodes that must be together with it, to a part.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Alternative {
    /// It is there already.
    Current,
    /// It, or a node that must be together with it, is not allowed there.
    NotAllowed,
    /// It fits, and this is the new objective.
    Value(i64),
    /// It does not fit: these constraints would be violated.
    DoesNotFit(Vec<Usage>),
    /// It fits, but a forbidden set would be met.
    Forbidden,
}

/// For each node and part, the effect of moving only this node there.
///
/// # Errors
/// [`ProblemError`] if the problem or the placement is malformed.
pub fn alternatives(
    problem: &Problem,
    assignment: &[PartIndex],
) -> Result<Vec<Vec<Alternative>>, ProblemError> {
    problem.check()?;
    problem.check_assignment(assignment)?;
    let model = whole(problem);
    let mut placed = vec![0; model.nodes.len()];
    for (origin, &part) in model.origin.iter().zip(assignment) {
        if let Origin::Free(class) = *origin {
            placed[class] = part;
        }
    }
    let mut state = State::new(&model, placed);
    let usage = evaluate_checked(problem, assignment).usage;
    let always: Vec<i64> = problem.parts.iter().map(|part| part.always).collect();
    let mut classes = Vec::new();
    for (class, node) in model.nodes.iter().enumerate() {
        let from = state.part[class];
        let of_part = |part| match (from == part, node.allowed >> part & 1 == 1) {
            (true, _) => Alternative::Current,
            (false, false) => Alternative::NotAllowed,
            (false, true) => {
                state.apply(class, part, |_| ());
                let alternative = moved(&state, &usage, &always);
                state.apply(class, from, |_| ());
                alternative
            }
        };
        classes.push((0..model.parts).map(of_part).collect::<Vec<_>>());
    }
    let of_node = |origin: &Origin| match *origin {
        Origin::Free(class) => classes[class].clone(),
        Origin::Placed(_) => Vec::new(),
    };
    Ok(model.origin.iter().map(of_node).collect())
}

/// The effect of a move, from the state after it. `always` is [`super::Part::always`], which the state does not count.
fn moved(state: &State, usage: &[Usage], always: &[i64]) -> Alternative {
    let after = state.uses().zip(usage).map(|((_, used), usage)| {
        let more = match usage.constraint {
            Constraint::Pins { part } => always[part],
            _ => 0,
        };
        Usage { used: (used + more).max(0).cast_unsigned(), ..*usage }
    });
    let broken: Vec<_> = after.filter(|usage| !usage.fits()).collect();
    match (broken.is_empty(), state.excess) {
        (false, _) => Alternative::DoesNotFit(broken),
        (true, 0) => Alternative::Value(state.value),
        (true, _) => Alternative::Forbidden,
    }
}
