//! The action qualifiers of IEC 61131-3 as data: one row for each.
//!
//! A new qualifier is a variant of [`Qualifier`] and a row of `ROWS`, with variants of [`ActionPart`] for what it stores. All readers and writers of charts,
//! the memory of the block in all engines, lints and random tests read the rows. The meaning is implemented once in each of the simulator, the program and
//! the second encoding.

/// Qualifiers of IEC 61131-3.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[expect(missing_docs, reason = "the names are those of the standard")]
pub enum Qualifier {
    N,
    R,
    S,
    L,
    D,
    P,
    P0,
    P1,
    SD,
    DS,
    SL,
}

/// The parts of the ACTION_CONTROL block that keep state. `DSHeld` is the last input of the timer of DS, whose own latch comes after the timer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[expect(missing_docs, reason = "the names are those of the standard's block")]
pub enum ActionPart {
    S,
    L,
    D,
    P,
    P0,
    P1,
    SD,
    DS,
    DSHeld,
    SL,
}

/// What is known about a qualifier.
struct Row {
    qualifier: Qualifier,
    /// The standard's letters.
    letters: &'static str,
    /// Whether it has a duration, and its part of the block has a timer.
    is_timed: bool,
    /// When the action can run because of it.
    runs: Runs,
    /// The bits that the block stores for it, each with its name: its latch, its last input; the first one is also the name of its timer.
    stores: &'static [(ActionPart, &'static str)],
}

/// When an action can run because of a qualifier.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Runs {
    /// Never: it only resets.
    Never,
    /// While its step is active: the condition of an output of the step can express it.
    WithStep,
    /// In single reactions, when its step becomes active.
    AtEntry,
    /// In single reactions, even when its step is no longer active.
    AtExit,
    /// Until a reset.
    Stored,
}

const ROWS: [Row; 11] = {
    use ActionPart as Part;
    use Qualifier::{D, DS, L, N, P, P0, P1, R, S, SD, SL};
    use Runs::{AtEntry, AtExit, Never, Stored, WithStep};
    const fn row(
        qualifier: Qualifier,
        letters: &'static str,
        runs: Runs,
        stores: &'static [(ActionPart, &'static str)],
    ) -> Row {
        Row { qualifier, letters, is_timed: false, runs, stores }
    }
    const fn timed(row: Row) -> Row {
        Row { is_timed: true, ..row }
    }
    // In the order of the standard's table.
    [
        row(N, "N", WithStep, &[]),
        row(R, "R", Never, &[]),
        row(S, "S", Stored, &[(Part::S, "S")]),
        timed(row(L, "L", WithStep, &[(Part::L, "L")])),
        timed(row(D, "D", WithStep, &[(Part::D, "D")])),
        row(P, "P", AtEntry, &[(Part::P, "P")]),
        row(P0, "P0", AtExit, &[(Part::P0, "P0")]),
        row(P1, "P1", AtEntry, &[(Part::P1, "P1")]),
        timed(row(SD, "SD", Stored, &[(Part::SD, "SD")])),
        timed(row(DS, "DS", Stored, &[(Part::DS, "DS"), (Part::DSHeld, "DS-held")])),
        timed(row(SL, "SL", Stored, &[(Part::SL, "SL")])),
    ]
};

impl Qualifier {
    /// All qualifiers, in the order of the standard's table.
    pub const ALL: [Qualifier; ROWS.len()] = {
        let mut all = [Qualifier::N; ROWS.len()];
        let mut at = 0;
        while at < ROWS.len() {
            all[at] = ROWS[at].qualifier;
            at += 1;
        }
        all
    };

    fn row(self) -> &'static Row {
        static TABLE: &[Row] = &ROWS;
        // The rows are in the order of the variants; a test checks this.
        TABLE.get(self as usize).unwrap_or(&TABLE[0])
    }

    /// The letters of all qualifiers, as a list in a message.
    #[must_use]
    pub fn known() -> String {
        let [others @ .., last] = Self::ALL.map(Self::letters);
        format!("{} or {last}", others.join(", "))
    }

    /// The standard's letters.
    #[must_use]
    pub fn letters(self) -> &'static str {
        self.row().letters
    }

    /// True for a qualifier that makes all uses of its action controlled.
    #[must_use]
    pub fn is_controlling(self) -> bool {
        self.row().runs != Runs::WithStep
    }

    /// True for a qualifier with a duration.
    #[must_use]
    pub fn is_timed(self) -> bool {
        self.row().is_timed
    }

    /// True for a qualifier with which the action runs in single reactions.
    #[must_use]
    pub fn is_pulse(self) -> bool {
        matches!(self.row().runs, Runs::AtEntry | Runs::AtExit)
    }

    /// True for a qualifier with which the action runs until a reset.
    #[must_use]
    pub fn is_stored(self) -> bool {
        self.row().runs == Runs::Stored
    }

    /// True for a qualifier with which the action can run when its step is no longer active.
    #[must_use]
    pub fn outlives_step(self) -> bool {
        matches!(self.row().runs, Runs::AtExit | Runs::Stored)
    }

    /// The bits that the block stores for the qualifier. The first one also names its timer, if it has one.
    pub fn stores(self) -> impl Iterator<Item = ActionPart> {
        self.row().stores.iter().map(|(part, _)| *part)
    }
}

impl ActionPart {
    /// The name of the part: the letters of its qualifier, with a suffix for a second bit (`DS`, `DS-held`).
    #[must_use]
    pub fn name(self) -> &'static str {
        let mut all = ROWS.iter().flat_map(|row| row.stores);
        all.find(|(part, _)| *part == self).map_or("", |(_, name)| name)
    }

    /// The part with this name.
    #[must_use]
    pub fn named(name: &str) -> Option<ActionPart> {
        let mut all = ROWS.iter().flat_map(|row| row.stores);
        all.find(|(_, known)| *known == name).map(|(part, _)| *part)
    }
}

#[cfg(test)]
mod tests {
    use super::{ActionPart, Qualifier, ROWS};
    use std::collections::BTreeSet;

    #[test]
    fn rows_are_whole_and_in_order() {
        for (at, row) in ROWS.iter().enumerate() {
            assert_eq!(row.qualifier as usize, at, "{}", row.letters);
            assert_eq!(row.letters, format!("{:?}", row.qualifier));
            assert!(!row.is_timed || !row.stores.is_empty(), "{}", row.letters);
        }
        let parts: Vec<ActionPart> =
            Qualifier::ALL.into_iter().flat_map(Qualifier::stores).collect();
        let different: BTreeSet<ActionPart> = parts.iter().copied().collect();
        assert_eq!(different.len(), parts.len());
        for part in parts {
            assert_eq!(ActionPart::named(part.name()), Some(part));
        }
    }
}
