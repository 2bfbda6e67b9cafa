//! The order of the variables in the decision diagrams of reachable states.
//!
//! Steps that share a token are adjacent, component by component: inside a component few situations are possible, so a diagram that reads one component
//! after the other stays narrow. The values of a step (its time, its task index) come after it, and everything else (variables, edges, latches, inputs)
//! just before the first step that reads it. Next to each bit of the state comes its value after the reaction.
#![allow(
    clippy::wildcard_enum_match_arm,
    reason = "an order of variables changes only the time of a proof"
)]

use grafsynth_ir::Gather;
use grafsynth_ir::ranks::sort_by_rank;
use std::collections::BTreeMap;

use grafsynth_ir::facts::Facts;
use grafsynth_ir::net::{Net, StepId};
use grafsynth_ir::program::Origin;

use super::aig::Lit;
use super::state::Key;

/// A piece of state or an input.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Word {
    State(Origin, u32),
    Input(u32),
    /// The ticks that pass.
    Time,
}

/// A position in the order: the step, and whether before it (0), at it (1) or after it (2).
type Place = (usize, u8);

/// The bits of a model in the order of their diagram, first variable first.
///
/// `reads` gives for each bit of the state the variables that its next value depends on; `time` contains the bits of the number of ticks.
pub(super) fn order(
    net: &Net,
    facts: &Facts,
    state: &BTreeMap<Key, Lit>,
    inputs: &BTreeMap<(u32, u32), Lit>,
    time: &[Lit],
    reads: &BTreeMap<Key, Vec<Lit>>,
) -> Vec<Lit> {
    let mut words: BTreeMap<Word, Vec<Lit>> = BTreeMap::new();
    for ((origin, element, _), lit) in state {
        words.entry(Word::State(*origin, *element)).or_default().push(*lit);
    }
    for ((input, _), lit) in inputs {
        words.entry(Word::Input(*input)).or_default().push(*lit);
    }
    words.insert(Word::Time, time.to_vec());
    let word_of: BTreeMap<Lit, Word> =
        words.iter().flat_map(|(word, bits)| bits.iter().map(|bit| (*bit, *word))).gather();

    let place_of_step = places(net, facts);
    let mut place: BTreeMap<Word, Place> = BTreeMap::new();
    for word in words.keys() {
        if let Word::State(origin, _) = word {
            let own = match origin {
                Origin::Step(step) | Origin::Region(step) => Some((*step, 1)),
                Origin::Elapsed(step) | Origin::LastElapsed(step) | Origin::TaskIndex(step) => {
                    Some((*step, 2))
                }
                Origin::Older(a, b) => {
                    let first = place_of_step[a.index()] < place_of_step[b.index()];
                    Some((if first { *b } else { *a }, 2))
                }
                _ => None,
            };
            if let Some((step, side)) = own {
                place.insert(*word, (place_of_step[step.index()], side));
            }
        }
    }
    // A word that no step reads is placed just before a placed word whose next value depends on it, or at the end.
    loop {
        let mut found: BTreeMap<Word, Place> = BTreeMap::new();
        for ((origin, element, _), lits) in reads {
            let Some((step, _)) = place.get(&Word::State(*origin, *element)) else { continue };
            for word in lits.iter().filter_map(|lit| word_of.get(lit)) {
                if !place.contains_key(word) {
                    let before = found.entry(*word).or_insert((*step, 0));
                    *before = (*before).min((*step, 0));
                }
            }
        }
        if found.is_empty() {
            break;
        }
        place.append(&mut found);
    }
    let mut sorted: Vec<(Place, Word)> = words
        .keys()
        .map(|word| (place.get(word).copied().unwrap_or((usize::MAX, 0)), *word))
        .collect();
    sorted.sort_unstable();
    // Highest bit first, because it decides comparisons.
    sorted.iter().flat_map(|(_, word)| words[word].iter().rev().copied()).collect()
}

/// The position of each step in the order of steps.
fn places(net: &Net, facts: &Facts) -> Vec<usize> {
    let mut steps: Vec<StepId> = net.steps.ids().collect();
    sort_by_rank(&mut steps, |step| {
        let component = facts.component_of.as_ref().and_then(|map| map[*step]);
        let first = component
            .and_then(|component| facts.components[component as usize].steps.first().copied());
        [first.unwrap_or(*step).index() as u64]
    });
    let mut places = vec![0; steps.len()];
    for (place, step) in steps.iter().enumerate() {
        places[step.index()] = place;
    }
    places
}
