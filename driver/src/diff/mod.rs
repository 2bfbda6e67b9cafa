//! The changes between two charts: what the designer changed, and whether the behaviour is still the same.

mod changes;
mod matching;
mod net_text;
mod parts;

use crate::design::NetDesign;
use grafsynth_verify::Limits;
use grafsynth_verify::pair::{Answer, Common, Incomparable, charts_equal};

/// The changes between two designs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Diff {
    /// One entry for each changed object, in the order of the old chart, followed by those of the new one.
    pub changes: Vec<Change>,
    /// The change of behaviour.
    pub behaviour: Behaviour,
}

/// One changed object. An added or removed step or state includes its contents and its transitions.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Change {
    /// The kind of change.
    pub kind: ChangeKind,
    /// Kind and name in the new chart (in the old one if it was removed), such as `step p1`.
    pub name: String,
    /// Its old name, if it was renamed.
    pub old_name: Option<String>,
    /// The text that only the old chart has; empty if there is none.
    pub old: Vec<String>,
    /// The text that only the new chart has.
    pub new: Vec<String>,
    /// Its old and new place, if its order among objects of its kind changed.
    pub moved: Option<(Place, Place)>,
}

/// The kind of a change.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ChangeKind {
    /// Only the new chart has it.
    Added,
    /// Only the old chart has it.
    Removed,
    /// Its contents changed.
    Changed,
    /// It has another name; all references to it follow.
    Renamed,
    /// It has another place among objects of its kind.
    Moved,
}

impl ChangeKind {
    /// The kind as a word.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            ChangeKind::Added => "added",
            ChangeKind::Removed => "removed",
            ChangeKind::Changed => "changed",
            ChangeKind::Renamed => "renamed",
            ChangeKind::Moved => "moved",
        }
    }
}

/// A place among the objects of one kind that both charts have.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Place {
    /// Before all others.
    First,
    /// Directly after this one.
    After(String),
}

impl std::fmt::Display for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Place::First => f.write_str("first"),
            Place::After(name) => write!(f, "after {name}"),
        }
    }
}

/// Whether two charts behave equally.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Behaviour {
    /// The result of the comparison of the columns that both charts have.
    Compared(Box<Common>, Answer),
    /// They cannot be compared.
    Incomparable(Incomparable),
}

/// Compares two designs; if nothing can be proved, with `random` random reactions.
///
/// Charts are compared as drawn. If one of the designs has no chart (`.net`, `.kiss2`), or if the charts are equal but the nets are not (properties
/// of another file, costs of another machine), the texts of the nets are compared.
#[must_use]
pub fn diff(old: &NetDesign, new: &NetDesign, random: usize, seed: u64) -> Diff {
    let limits = Limits { random_rows: random, ..Limits::default() };
    let behaviour = match Common::of(&old.net, &new.net) {
        Ok(common) => {
            let answer = charts_equal(&old.net, &new.net, &common, &limits, seed);
            Behaviour::Compared(Box::new(common), answer)
        }
        Err(why) => Behaviour::Incomparable(why),
    };
    let mut changes = match (&old.chart, &new.chart) {
        (Some(old), Some(new)) => changes::changes(old, new),
        _ => Vec::new(),
    };
    if changes.is_empty() {
        changes = net_text::changes(&old.net, &new.net);
    }
    Diff { changes, behaviour }
}
