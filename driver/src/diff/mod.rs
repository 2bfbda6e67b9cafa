//! What changed between two charts: what the designer changed, and whether the behaviour is still the same.

mod changes;
mod matching;
mod net_text;
mod parts;

use crate::read::NetDesign;
use grafsynth_verify::Limits;
use grafsynth_verify::pair::{Answer, Common, Incomparable, charts_equal};

/// What changed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Diff {
    /// One entry for each thing that was changed, in the order of the old chart and then of the new one.
    pub changes: Vec<Change>,
    /// What they do.
    pub behaviour: Behaviour,
}

/// One thing that was changed. A step or state that was added or removed includes what is in it and its transitions.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Change {
    /// What happened to it.
    pub kind: ChangeKind,
    /// Kind and name in the new chart (in the old one if it was removed), such as `step p1`.
    pub name: String,
    /// Its old name, if it was renamed.
    pub old_name: Option<String>,
    /// What the old chart has of it and the new one does not; empty if nothing.
    pub old: Vec<String>,
    /// What the new chart has of it and the old one does not.
    pub new: Vec<String>,
    /// Its old and new place, if its order among things of its kind changed.
    pub moved: Option<(Place, Place)>,
}

/// What happened to a thing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ChangeKind {
    /// Only the new chart has it.
    Added,
    /// Only the old chart has it.
    Removed,
    /// It has another content.
    Changed,
    /// It has another name; all that names it follows.
    Renamed,
    /// It has another place among things of its kind.
    Moved,
}

impl ChangeKind {
    /// The word for it.
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

/// A place among things of one kind that both charts have.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Place {
    /// Before all others.
    First,
    /// Directly behind this one.
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

/// Whether two charts do the same.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Behaviour {
    /// The answer, in the columns that both have.
    Compared(Box<Common>, Answer),
    /// They cannot be compared.
    Incomparable(Incomparable),
}

/// Compares two designs; where nothing can be proved, with `random` random reactions.
///
/// Charts are compared as they are drawn. If one of the designs has no chart (`.net`, `.kiss2`), or if the charts read the same and the nets do not (properties
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
