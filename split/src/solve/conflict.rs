//! Why no placement fits: constraints that exclude each other, found by deletion filtering.
//!
//! J. W. Chinneck, E. W. Dravnieks: Locating minimal infeasible constraint sets in linear programs, 1991. Constraints are removed as long as the rest stays
//! infeasible, here in halves first, because most are not needed.

use grafsynth_ir::Gather;
use std::collections::BTreeSet;

use super::problem::{Choice, PartIndex, Problem};
use super::report::Constraint;
use super::{Found, Limits, search};

/// Constraints that exclude each other.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Conflict {
    /// The constraints. No placement satisfies all of them.
    pub fights: Vec<Fight>,
    /// True if each of them is proved to be necessary: if any one is removed, a placement exists.
    pub is_minimal: bool,
}

/// One constraint of a conflict.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fight {
    /// The constraint.
    pub constraint: Constraint,
    /// For a capacity or pins: the minimum amount that the other constraints of the conflict need, and the available amount. `need` is `None` if it is open.
    pub amount: Option<Amount>,
}

/// The needed and the available amount.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Amount {
    /// The smallest amount with which the other constraints of the conflict can be satisfied; `None` if the work ran out.
    pub need: Option<u64>,
    /// The available amount.
    pub have: u64,
}

/// The conflict of a problem that is infeasible.
pub(super) fn find(problem: &Problem, limits: &Limits) -> Conflict {
    let mut filter = Filter { problem, limits, is_minimal: true };
    let mut all = constraints(problem);
    // A reader learns least from what an earlier fit excluded, and more from macrocells or memory than from pins.
    for is_vague in [
        |one: &Constraint| matches!(one, Constraint::Forbidden { .. }),
        |one: &Constraint| matches!(one, Constraint::Pins { .. }),
    ] {
        filter.drop_all(&mut all, is_vague);
    }
    let kept = filter.filter(all);
    let fights = kept
        .iter()
        .map(|&constraint| Fight { constraint, amount: filter.amount(&kept, constraint) })
        .collect();
    Conflict { fights, is_minimal: filter.is_minimal }
}

fn constraints(problem: &Problem) -> Vec<Constraint> {
    let allowed = problem
        .nodes
        .iter()
        .enumerate()
        .filter(|(_, node)| node.choices.iter().any(Option::is_none));
    let mut all: Vec<_> = allowed.map(|(node, _)| Constraint::Allowed { node }).collect();
    all.extend((0..problem.together.len()).map(|set| Constraint::Together { set }));
    all.extend((0..problem.forbidden.len()).map(|set| Constraint::Forbidden { set }));
    for (part, limits) in problem.parts.iter().enumerate() {
        all.extend(limits.pins.map(|_| Constraint::Pins { part }));
        let limited =
            limits.capacities.iter().enumerate().filter(|(_, capacity)| capacity.is_some());
        all.extend(limited.map(|(resource, _)| Constraint::Capacity { part, resource }));
    }
    all
}

struct Filter<'a> {
    problem: &'a Problem,
    limits: &'a Limits,
    is_minimal: bool,
}

impl Filter<'_> {
    /// Removes all constraints of a kind, if the others exclude each other without them.
    fn drop_all(&self, kept: &mut Vec<Constraint>, is_of_kind: fn(&Constraint) -> bool) {
        let rest: Vec<_> = kept.iter().copied().filter(|one| !is_of_kind(one)).collect();
        let is_shorter = rest.len() < kept.len();
        if is_shorter
            && matches!(
                search(&relaxed(self.problem, &rest, None), self.limits, None),
                Found::Infeasible
            )
        {
            *kept = rest;
        }
    }

    /// Removes unnecessary constraints, in chunks of half the size each time.
    fn filter(&mut self, mut kept: Vec<Constraint>) -> Vec<Constraint> {
        let mut chunk = kept.len().max(1).next_power_of_two();
        while chunk > 0 {
            let mut start = 0;
            while start < kept.len() {
                let end = (start + chunk).min(kept.len());
                let rest: Vec<_> = kept[..start].iter().chain(&kept[end..]).copied().collect();
                match search(&relaxed(self.problem, &rest, None), self.limits, None) {
                    Found::Infeasible => kept = rest,
                    Found::Stopped { best: None, .. } => {
                        self.is_minimal &= chunk > 1;
                        start = end;
                    }
                    Found::Stopped { .. } | Found::Optimal { .. } => start = end,
                }
            }
            chunk /= 2;
        }
        kept
    }

    fn amount(&self, kept: &[Constraint], constraint: Constraint) -> Option<Amount> {
        let others: Vec<_> = kept.iter().copied().filter(|&other| other != constraint).collect();
        match constraint {
            Constraint::Capacity { part, resource } => {
                let have = self.problem.parts[part].capacities[resource]?;
                let problem = relaxed(self.problem, &others, Some((part, resource)));
                let need = match search(&problem, self.limits, None) {
                    Found::Optimal { value, .. } => Some(value.unsigned_abs()),
                    Found::Stopped { .. } | Found::Infeasible => None,
                };
                Some(Amount { need, have })
            }
            Constraint::Pins { part } => {
                let have = self.problem.parts[part].pins?;
                Some(Amount {
                    need: self.pins_needed(relaxed(self.problem, &others, None), part, have),
                    have,
                })
            }
            Constraint::Allowed { .. }
            | Constraint::Together { .. }
            | Constraint::Forbidden { .. } => None,
        }
    }

    /// The minimum number of pins with which a problem is feasible, by bisection.
    fn pins_needed(&self, mut problem: Problem, part: PartIndex, have: u64) -> Option<u64> {
        let of_nets =
            problem.presences.iter().map(|one| one.pins).sum::<u64>() + problem.wires.len() as u64;
        let always = problem.parts[part].always.max(0).cast_unsigned();
        let (mut too_few, mut enough) = (have, of_nets + always);
        while too_few + 1 < enough {
            let middle = too_few + (enough - too_few) / 2;
            problem.parts[part].pins = Some(middle);
            match search(&problem, self.limits, None) {
                Found::Infeasible => too_few = middle,
                Found::Optimal { .. } | Found::Stopped { best: Some(_), .. } => enough = middle,
                Found::Stopped { best: None, .. } => return None,
            }
        }
        Some(enough)
    }
}

/// The problem with only some of its constraints, and as objective nothing or the use of a resource of a part.
///
/// A node without its constraint costs and uses nothing on a part where it was not allowed.
fn relaxed(problem: &Problem, kept: &[Constraint], goal: Option<(PartIndex, usize)>) -> Problem {
    let kept: BTreeSet<_> = kept.iter().copied().gather();
    let mut relaxed = problem.clone();
    let nothing = Choice { cost: 0, uses: vec![0; problem.resources()] };
    for (index, node) in relaxed.nodes.iter_mut().enumerate() {
        if !kept.contains(&Constraint::Allowed { node: index }) {
            node.choices
                .iter_mut()
                .filter(|choice| choice.is_none())
                .for_each(|choice| *choice = Some(nothing.clone()));
        }
        for (part, choice) in node.choices.iter_mut().enumerate() {
            if let Some(choice) = choice {
                choice.cost = goal
                    .filter(|&(goal, _)| goal == part)
                    .map_or(0, |(_, resource)| choice.uses[resource].cast_signed());
            }
        }
    }
    relaxed.wires.iter_mut().for_each(|wire| wire.cost = 0);
    relaxed.presences.iter_mut().for_each(|one| one.cost = 0);
    keep_indexed(&mut relaxed.together, |set| kept.contains(&Constraint::Together { set }));
    keep_indexed(&mut relaxed.forbidden, |set| kept.contains(&Constraint::Forbidden { set }));
    for (part, limits) in relaxed.parts.iter_mut().enumerate() {
        limits.pins = limits.pins.filter(|_| kept.contains(&Constraint::Pins { part }));
        for (resource, capacity) in limits.capacities.iter_mut().enumerate() {
            *capacity =
                capacity.filter(|_| kept.contains(&Constraint::Capacity { part, resource }));
        }
    }
    relaxed
}

fn keep_indexed<T>(list: &mut Vec<T>, mut is_kept: impl FnMut(usize) -> bool) {
    let mut index = 0;
    list.retain(|_| {
        index += 1;
        is_kept(index - 1)
    });
}
