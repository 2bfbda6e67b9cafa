//! What changed between two charts: their parts, and what they do.

use crate::{compare, rows};
use grafsynth_ir::net::{InputKind, Net};
use grafsynth_ir::{Valid, text};
use grafsynth_sim::{Difference, InputRow, Simulator, State, Stimulus};
use std::collections::{BTreeMap, BTreeSet, VecDeque};

/// What changed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Diff {
    /// Parts that only one has, or that read otherwise, in the order of the old chart and then of the new one.
    pub parts: Vec<Part>,
    /// What they do.
    pub behaviour: Behaviour,
}

/// A part of a net that changed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Part {
    /// Kind and name, such as `step p1`.
    pub name: String,
    /// Its text in the old net; none if it is new.
    pub old: Option<String>,
    /// Its text in the new net; none if it is gone.
    pub new: Option<String>,
}

/// Whether two charts do the same.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Behaviour {
    /// Every reachable pair of states gives the same rows for every input.
    Same {
        /// How many pairs of states.
        states: usize,
    },
    /// Nothing different was seen in so many random reactions; more is not known.
    SameAsFarAsSeen {
        /// How many.
        reactions: usize,
    },
    /// The first difference.
    Different {
        /// The stimulus that shows it, for the old chart.
        stimulus: Box<Stimulus>,
        /// Where.
        difference: Difference,
        /// No shorter stimulus shows a difference.
        is_shortest: bool,
    },
    /// They share no output, variable or set of steps.
    NothingInCommon,
}

/// Pairs of states that are looked at before the search is given up.
const MAX_PAIRS: usize = 20_000;
/// Input rows that are tried in one pair of states.
const MAX_ROWS: usize = 1 << 10;

/// Compares two nets; `random` reactions with this seed decide where the search is too large.
#[must_use]
pub fn diff(old: &Valid<Net>, new: &Valid<Net>, random: usize, seed: u64) -> Diff {
    Diff { parts: parts(old, new), behaviour: behaviour(old, new, random, seed) }
}

/// The blocks of a net's text: a line that is not indented begins one; its first two words are its name.
fn blocks(net: &Net) -> Vec<(String, String)> {
    let mut blocks: Vec<(String, String)> = Vec::new();
    let mut seen: BTreeMap<String, usize> = BTreeMap::new();
    for line in text::print(net).lines().filter(|line| !line.trim().is_empty()) {
        match blocks.last_mut() {
            Some((_, text)) if line.starts_with([' ', '\t', '}']) => {
                text.push('\n');
                text.push_str(line);
            }
            _ => {
                let mut name: String =
                    line.split_whitespace().take(2).collect::<Vec<_>>().join(" ");
                let count = seen.entry(name.clone()).or_insert(0);
                *count += 1;
                if *count > 1 {
                    name = format!("{name} ({count})");
                }
                blocks.push((name, line.to_owned()));
            }
        }
    }
    blocks
}

fn parts(old: &Net, new: &Net) -> Vec<Part> {
    let (before, after) = (blocks(old), blocks(new));
    let later: BTreeMap<&str, &str> =
        after.iter().map(|(name, text)| (name.as_str(), text.as_str())).collect();
    let earlier: BTreeSet<&str> = before.iter().map(|(name, _)| name.as_str()).collect();
    let gone_or_changed = before.iter().filter_map(|(name, text)| match later.get(name.as_str()) {
        Some(now) if now == text => None,
        now => Some(Part {
            name: name.clone(),
            old: Some(text.clone()),
            new: now.map(|now| (*now).to_owned()),
        }),
    });
    let added = after
        .iter()
        .filter(|(name, _)| !earlier.contains(name.as_str()))
        .map(|(name, text)| Part { name: name.clone(), old: None, new: Some(text.clone()) });
    gone_or_changed.chain(added).collect()
}

fn behaviour(old: &Valid<Net>, new: &Valid<Net>, random: usize, seed: u64) -> Behaviour {
    if let Some(found) = search(old, new) {
        return found;
    }
    let stimulus = Stimulus::random(old, random, seed, 1);
    match compare::nets(old, new, &stimulus) {
        Err(_) => Behaviour::NothingInCommon,
        Ok(outcome) => match outcome.difference {
            None => Behaviour::SameAsFarAsSeen { reactions: stimulus.len() },
            Some(difference) => {
                let mut stimulus = stimulus;
                stimulus.truncate(difference.row);
                Behaviour::Different {
                    stimulus: Box::new(stimulus),
                    difference,
                    is_shortest: false,
                }
            }
        },
    }
}

/// Breadth first over pairs of states, so that the first difference is a shortest one; none if a bound is met.
fn search(old: &Valid<Net>, new: &Valid<Net>) -> Option<Behaviour> {
    let rows = rows::all(old, &[0, 1], MAX_ROWS)?;
    let takes_the_same =
        new.inputs.values().filter(|input| input.kind != InputKind::InternalEvent).all(|input| {
            old.inputs
                .values()
                .any(|known| known.name.text == input.name.text && known.ty == input.ty)
        });
    if !takes_the_same {
        return None;
    }
    let translate = |row: &InputRow| {
        let mut taken = InputRow { dt: row.dt, ..InputRow::zero(new) };
        for (id, input) in new.inputs.iter() {
            if let Some((from, _)) =
                old.inputs.iter().find(|(_, known)| known.name.text == input.name.text)
            {
                taken = taken.with(id, row.value(from));
            }
        }
        taken
    };
    let pairs: Vec<(InputRow, InputRow)> =
        rows.into_iter().map(|row| (row.clone(), translate(&row))).collect();
    let (mut left, mut right) = (Simulator::new(old), Simulator::new(new));
    left.reset();
    right.reset();
    // What the rows show is compared once the path is known; here states are paired and single rows compared by trace cells.
    let start = (left.state().clone(), right.state().clone());
    let mut seen: BTreeMap<(State, State), Option<(usize, usize)>> = BTreeMap::new();
    let mut order = vec![start.clone()];
    let mut came_from: Vec<Option<(usize, usize)>> = vec![None];
    seen.insert(start, None);
    let mut queue = VecDeque::from([0]);
    let empty = Stimulus::new(old);
    match compare::nets(old, new, &empty) {
        Err(_) => return Some(Behaviour::NothingInCommon),
        Ok(compare::Outcome { difference: Some(difference), .. }) => {
            return Some(Behaviour::Different {
                stimulus: Box::new(empty),
                difference,
                is_shortest: true,
            });
        }
        Ok(_) => {}
    }
    let rows_differ = compare::RowComparison::new(old, new);
    while let Some(at) = queue.pop_front() {
        for (index, (ours, theirs)) in pairs.iter().enumerate() {
            left.set_state(&order[at].0);
            right.set_state(&order[at].1);
            left.step(ours);
            right.step(theirs);
            if rows_differ.differ(left.row(), right.row()) {
                let mut path = vec![index];
                let mut back = at;
                while let Some((before, by)) = came_from[back] {
                    path.push(by);
                    back = before;
                }
                let stimulus =
                    Stimulus::of_rows(old, path.iter().rev().map(|index| &pairs[*index].0));
                let difference = compare::nets(old, new, &stimulus).ok()?.difference?;
                return Some(Behaviour::Different {
                    stimulus: Box::new(stimulus),
                    difference,
                    is_shortest: true,
                });
            }
            let next = (left.state().clone(), right.state().clone());
            if !seen.contains_key(&next) {
                if order.len() >= MAX_PAIRS {
                    return None;
                }
                seen.insert(next.clone(), None);
                queue.push_back(order.len());
                order.push(next);
                came_from.push(Some((at, index)));
            }
        }
    }
    Some(Behaviour::Same { states: order.len() })
}
