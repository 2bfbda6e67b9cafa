//! The changes between two charts, one for each part that the designer changed.

use super::matching::{Matching, Renames, is_same, matching};
use super::parts::{Kind, Part, Parts};
use super::{Change, ChangeKind, Place};
use grafsynth_ir::Gather;
use grafsynth_ir::chart::Design;
use std::collections::{BTreeMap, BTreeSet};

/// The changes in the new design, in the order of the old one; added parts come last.
pub(super) fn changes(old: &Design, new: &Design) -> Vec<Change> {
    let (old, new) = (Parts::of(old), Parts::of(new));
    let (matching, renames) = matching(&old.list, &new.list);
    let mut comparison = Comparison { old, new, matching, renames, moves: BTreeMap::new() };
    comparison.moves = comparison.moves();
    let found = comparison.found();
    comparison.gathered(found)
}

struct Comparison<'d> {
    old: Parts<'d>,
    new: Parts<'d>,
    matching: Matching,
    renames: Renames,
    /// The old and the new place of each moved part, by the index of the old part.
    moves: BTreeMap<usize, (Place, Place)>,
}

/// A change with the parts that it affects.
struct Found {
    old: Option<usize>,
    new: Option<usize>,
    change: Change,
}

impl Comparison<'_> {
    /// Each changed part separately. The contents of an added or removed part belong to it.
    fn found(&self) -> Vec<Found> {
        let mut found = Vec::new();
        for (at, part) in self.old.list.iter().enumerate() {
            match self.matching.new_of[at] {
                Some(other) => found.extend(self.pair(at, other)),
                None if part.parent.is_none_or(|up| self.matching.new_of[up].is_some()) => {
                    found.push(Found {
                        old: Some(at),
                        new: None,
                        change: Change {
                            kind: ChangeKind::Removed,
                            name: part.name.clone(),
                            old_name: None,
                            old: vec![self.old.whole(at)],
                            new: Vec::new(),
                            moved: None,
                        },
                    });
                }
                None => {}
            }
        }
        for (at, part) in self.new.list.iter().enumerate() {
            if self.matching.old_of[at].is_none()
                && part.parent.is_none_or(|up| self.matching.old_of[up].is_some())
            {
                found.push(Found {
                    old: None,
                    new: Some(at),
                    change: Change {
                        kind: ChangeKind::Added,
                        name: part.name.clone(),
                        old_name: None,
                        old: Vec::new(),
                        new: vec![self.new.whole(at)],
                        moved: None,
                    },
                });
            }
        }
        found
    }

    /// The change of a part that both designs have.
    fn pair(&self, at: usize, other: usize) -> Option<Found> {
        let (old, new) = (&self.old.list[at], &self.new.list[other]);
        let moved = self.moves.get(&at).cloned();
        let is_renamed = old.key.is_some() && new.key.is_some() && old.key != new.key;
        let mut renames = self.renames.clone();
        if let (Some(from), Some(to)) = (old.key, new.key) {
            renames.insert(from.to_owned(), to.to_owned());
        }
        let is_same = is_same(old, new, if is_renamed { &renames } else { &self.renames });
        let kind = match (is_renamed, is_same, &moved) {
            (true, ..) => ChangeKind::Renamed,
            (false, false, _) => ChangeKind::Changed,
            (false, true, Some(_)) => ChangeKind::Moved,
            (false, true, None) => return None,
        };
        let text = |part: &Part<'_>| if is_same { Vec::new() } else { vec![part.own.clone()] };
        Some(Found {
            old: Some(at),
            new: Some(other),
            change: Change {
                kind,
                name: new.name.clone(),
                old_name: is_renamed.then(|| old.name.clone()),
                old: text(old),
                new: text(new),
                moved,
            },
        })
    }

    /// Makes the transitions of an added or removed step part of its change.
    fn gathered(&self, found: Vec<Found>) -> Vec<Change> {
        let of_steps = |kind: ChangeKind| -> BTreeMap<&str, usize> {
            let steps = found.iter().enumerate().filter_map(|(index, one)| {
                let part = if kind == ChangeKind::Added {
                    one.new.map(|at| &self.new.list[at])
                } else {
                    one.old.map(|at| &self.old.list[at])
                }?;
                (one.change.kind == kind && part.kind == Kind::Step).then_some((part.key?, index))
            });
            steps.gather()
        };
        let (added, removed) = (of_steps(ChangeKind::Added), of_steps(ChangeKind::Removed));
        let mut of: Vec<Option<usize>> = Vec::new();
        for one in &found {
            let step = |parts: &Parts<'_>, at: Option<usize>, steps: &BTreeMap<&str, usize>| {
                let ends = parts.list[at?].ends.as_ref()?;
                let names = ends.sources.iter().chain(&ends.targets).flatten();
                names.filter_map(|name| steps.get(name.as_str()).copied()).next()
            };
            of.push(
                step(&self.new, one.new, &added).or_else(|| step(&self.old, one.old, &removed)),
            );
        }
        let mut changes: Vec<Option<Change>> =
            found.into_iter().map(|one| Some(one.change)).collect();
        for (index, owner) in of.into_iter().enumerate() {
            let Some(owner) = owner else { continue };
            let transition = changes[index].take();
            if let (Some(change), Some(transition)) = (&mut changes[owner], transition) {
                change.old.extend(transition.old);
                change.new.extend(transition.new);
            }
        }
        changes.into_iter().flatten().collect()
    }

    /// The parts whose order among their matched siblings changed: the smallest set of moved parts that explains the new order.
    fn moves(&self) -> BTreeMap<usize, (Place, Place)> {
        type Siblings = (Option<usize>, Kind);
        let mut groups: BTreeMap<Siblings, Vec<(usize, usize)>> = BTreeMap::new();
        for (at, part) in self.old.list.iter().enumerate() {
            if let Some(other) = self.matching.new_of[at]
                && part.kind.is_ordered()
            {
                groups.entry((part.parent, part.kind)).or_default().push((at, other));
            }
        }
        let mut moves = BTreeMap::new();
        for pairs in groups.into_values() {
            let places: Vec<usize> = pairs.iter().map(|(_, other)| *other).collect();
            if places.is_sorted() {
                continue;
            }
            let stays: BTreeSet<usize> = longest_increasing(&places).into_iter().gather();
            let mut sorted = places.clone();
            sorted.sort_unstable();
            let place = |name: Option<&str>| match name {
                Some(name) => Place::After(name.to_owned()),
                None => Place::First,
            };
            for (index, &(at, other)) in pairs.iter().enumerate() {
                if stays.contains(&index) {
                    continue;
                }
                let before = index.checked_sub(1).and_then(|index| pairs.get(index));
                let before = before.map(|(at, _)| self.old.list[*at].name.as_str());
                let now = sorted.partition_point(|&one| one < other);
                let now = now.checked_sub(1).and_then(|index| sorted.get(index));
                let now = now.map(|&at| self.new.list[at].name.as_str());
                moves.insert(at, (place(before), place(now)));
            }
        }
        moves
    }
}

/// The indices of a longest increasing subsequence of different numbers.
fn longest_increasing(numbers: &[usize]) -> Vec<usize> {
    // For each length, the index of the smallest number that ends a sequence of that length.
    let mut ends: Vec<usize> = Vec::new();
    let mut before: Vec<Option<usize>> = Vec::new();
    for (index, number) in numbers.iter().enumerate() {
        let length = ends.partition_point(|&end| numbers[end] < *number);
        before.push(length.checked_sub(1).map(|one| ends[one]));
        if length == ends.len() {
            ends.push(index);
        } else {
            ends[length] = index;
        }
    }
    let mut chain: Vec<usize> =
        std::iter::successors(ends.last().copied(), |&index| before[index]).collect();
    chain.reverse();
    chain
}

#[cfg(test)]
mod tests {
    use super::longest_increasing;

    #[test]
    fn the_longest_sequence_is_increasing() {
        assert_eq!(longest_increasing(&[]), Vec::<usize>::new());
        assert_eq!(longest_increasing(&[3, 1, 2]), [1, 2]);
        assert_eq!(longest_increasing(&[1, 5, 2, 3, 4]), [0, 2, 3, 4]);
    }
}
