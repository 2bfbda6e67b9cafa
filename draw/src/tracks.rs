//! The horizontal parts of links between two layers: each on a track of its own height, so that no two links share a line.

use grafsynth_ir::Gather;
use std::collections::BTreeSet;

/// A link between two layers. Links may end at the same x only from above and from below.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Wire {
    /// The ends at the upper layer.
    pub(crate) ups: Vec<i64>,
    /// The ends at the lower layer.
    pub(crate) downs: Vec<i64>,
    /// The column that this half of a divided link shares with the other half.
    pub(crate) joint: Option<Joint>,
    /// What the link belongs to.
    pub(crate) owner: usize,
}

/// A column between two tracks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Joint {
    /// The column leads down from this half.
    Below(i64),
    /// The column leads up from this half.
    Above(i64),
}

impl Joint {
    pub(crate) fn x(self) -> i64 {
        match self {
            Joint::Below(x) | Joint::Above(x) => x,
        }
    }
}

impl Wire {
    fn span(&self) -> (i64, i64) {
        let joint = self.joint.map(Joint::x);
        let all = || self.ups.iter().chain(&self.downs).copied().chain(joint);
        (all().min().unwrap_or(0), all().max().unwrap_or(0))
    }

    /// The order in which wires without other constraints get their tracks: links to the right from the right, then links to the left from the left.
    fn rank(&self) -> (bool, i64) {
        let up = self.ups.first().copied().unwrap_or(0);
        let leads_left = self.downs.first().is_some_and(|down| *down < up);
        (leads_left, if leads_left { up } else { -up })
    }

    /// True if the other wire must be below this one: it continues down where this one comes from above.
    fn is_above(&self, other: &Wire) -> bool {
        let is_lower_half = |x| other.joint == Some(Joint::Above(x));
        self.ups.iter().any(|x| other.downs.contains(x))
            || matches!(self.joint, Some(Joint::Below(x)) if is_lower_half(x))
    }
}

/// Gives each wire a track, counted from above. Wires in a circle of constraints are divided in two, which share a free column.
pub(crate) fn assign(mut wires: Vec<Wire>, pitch: i64) -> Vec<(Wire, i64)> {
    wires.sort_by_key(|wire| (wire.rank(), wire.owner));
    let mut columns: BTreeSet<i64> =
        wires.iter().flat_map(|wire| wire.ups.iter().chain(&wire.downs)).copied().gather();
    let mut placed: Vec<(Wire, i64)> = Vec::new();
    while !wires.is_empty() {
        let is_free = |index: &usize| {
            let others = wires.iter().enumerate().filter(|(other, _)| other != index);
            { others }.all(|(_, other)| !other.is_above(&wires[*index]))
        };
        if let Some(index) = (0..wires.len()).find(is_free) {
            let wire = wires.remove(index);
            let track = below(&placed, &wire, pitch);
            placed.push((wire, track));
            continue;
        }
        // Some wires are above each other in a circle; a half is never in it.
        let is_whole =
            |wire: &Wire| !wire.ups.is_empty() && !wire.downs.is_empty() && wire.joint.is_none();
        let index = wires.iter().position(is_whole).unwrap_or(0);
        let Wire { ups, downs, owner, .. } = wires.remove(index);
        let (low, high) = (ups[0].min(downs[0]), ups[0].max(downs[0]));
        let inside = (low / pitch + 1..).map(|n| n * pitch).take_while(|x| *x < high);
        let beyond = columns.last().copied().unwrap_or(0) + pitch;
        let column = { inside }.find(|x| !columns.contains(x)).unwrap_or(beyond);
        columns.insert(column);
        let (above, below) = (Some(Joint::Above(column)), Some(Joint::Below(column)));
        wires.insert(0, Wire { ups: Vec::new(), downs, joint: above, owner });
        wires.insert(0, Wire { ups, downs: Vec::new(), joint: below, owner });
    }
    placed
}

/// The first track below all wires that are in the way.
fn below(placed: &[(Wire, i64)], wire: &Wire, pitch: i64) -> i64 {
    let (low, high) = wire.span();
    let tracks = placed.iter().filter_map(|(other, track)| {
        let (from, to) = other.span();
        (from < high + pitch && low < to + pitch).then_some(track + 1)
    });
    tracks.max().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wires_that_change_places_are_divided() {
        let wire = |up, down, owner| Wire { ups: vec![up], downs: vec![down], joint: None, owner };
        let placed = assign(vec![wire(0, 32, 0), wire(32, 0, 1)], 8);
        assert_eq!(placed.len(), 3);
        let at = |is_wanted: &dyn Fn(&Wire) -> bool| {
            placed.iter().find(|(wire, _)| is_wanted(wire)).expect("it is there").1
        };
        // At each of both columns, what comes from above ends before the other continues down.
        assert!(at(&|wire| wire.ups == [0]) < at(&|wire| wire.downs == [0]));
        assert!(at(&|wire| wire.ups == [32]) < at(&|wire| wire.downs == [32]));
    }
}
