//! Equivalence of two nets. Every row of both is compared, in the columns that both have, for every stimulus that both allow: any values of inputs with the
//! same names, any number of ticks.
//!
//! Three methods, one after the other: a breadth-first search of the product of two reference simulators, which finds a difference with a shortest stimulus
//! (`product`); induction over state bits that are always equal; and the decision diagram of all pairs of states. The last two use the reaction as `symbolic`
//! encodes it. Between the methods, directed random runs look for a difference, so that two large nets that differ do not wait for a proof.

mod chance;
mod common;
mod product;
mod rows;

use grafsynth_ir::facts::Proof;
use grafsynth_ir::net::Net;
use grafsynth_ir::{Valid, counted};
use grafsynth_sim::{Difference, MAX_DT, Simulator, Stimulus};

pub use common::{Common, CommonColumn, CommonInput, Incomparable, Omitted, Side};
pub(crate) use rows::{RowPair, Rows};

use crate::facts::structural_facts;
use crate::limits::Limits;
use crate::symbolic::{self, Diagram, Equalities, Induction, Question};
use crate::verdict::{Open, OpenReason, Tested, Verdict};
use product::{Budget, Found};

/// The number of reactions of the product that are tried first.
const FIRST_REACTIONS: u64 = 100_000;
/// The number of random reactions before the proofs that cannot show a difference.
const FIRST_CHANCE: usize = 2_000;

/// The proof that two nets are equal, for every stimulus that both allow.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SameBy {
    /// An enumeration of all pairs of states that both nets reach together, each with every row that is relevant for either net.
    Product {
        /// The number of pairs of states.
        states: u64,
        /// The number of reactions compared.
        reactions: u64,
    },
    /// Induction over one reaction.
    Induction {
        /// The number of state bits that equal another one or are constant.
        equal: usize,
        /// The number of queries that needed the solver.
        solved: usize,
    },
    /// The decision diagram of all pairs of states.
    Diagram {
        /// The number of pairs of states; pairs that differ only in bits without effect on the compared columns count as one. `u64::MAX` means at least that
        /// many.
        states: u64,
    },
}

impl SameBy {
    /// The kind of proof.
    #[must_use]
    pub fn proof(&self) -> Proof {
        match self {
            SameBy::Product { .. } => Proof::Explicit,
            SameBy::Induction { .. } => Proof::Induction,
            SameBy::Diagram { .. } => Proof::Symbolic,
        }
    }
}

impl std::fmt::Display for SameBy {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            SameBy::Product { states, reactions } => write!(
                f,
                "by enumeration: {}, {}",
                counted(*states, "pair of states", "pairs of states"),
                counted(*reactions, "reaction", "reactions")
            ),
            SameBy::Induction { equal, solved } => write!(
                f,
                "by induction: {}, {}",
                counted(*equal, "equal state bit", "equal state bits"),
                counted(*solved, "solver query", "solver queries")
            ),
            SameBy::Diagram { states: u64::MAX } => {
                write!(f, "by a decision diagram of more than {} pairs of states", u64::MAX)
            }
            SameBy::Diagram { states } => {
                let pairs = counted(*states, "pair of states", "pairs of states");
                write!(f, "by a decision diagram of {pairs}")
            }
        }
    }
}

/// A pair of stimuli whose last row shows a difference.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Apart {
    /// The stimulus of the first net.
    pub left: Stimulus,
    /// The stimulus of the second net.
    pub right: Stimulus,
    /// The difference.
    pub difference: Difference,
    /// True if no stimulus with fewer rows shows a difference.
    pub is_shortest: bool,
}

/// The answer about two nets.
pub type Answer = Verdict<SameBy, Box<Apart>>;

/// Proves that two nets behave the same for every stimulus that both allow, or finds a stimulus that shows a difference. An open answer reports how many
/// random reactions showed no difference; another `seed` gives other reactions.
#[must_use]
pub fn charts_equal(
    left: &Valid<Net>,
    right: &Valid<Net>,
    common: &Common,
    limits: &Limits,
    seed: u64,
) -> Answer {
    let mut rows = Rows::of(left, right, common, limits.rows_per_state);
    let mut reasons = Vec::new();
    let first = Budget {
        reactions: limits.pairs.min(FIRST_REACTIONS),
        states: limits.states,
        rows: usize::MAX,
    };
    match product::search(left, right, common, &mut rows, first) {
        Found::Complete { states, reactions } => {
            return Verdict::Proved(SameBy::Product { states, reactions });
        }
        Found::Apart(found) => return apart(left, right, common, &found, true),
        Found::Deep | Found::Open(_) => {}
    }
    let n_first = limits.random_rows.min(FIRST_CHANCE);
    let tried = chance::compare(left, right, common, &rows, n_first, seed, MAX_DT);
    if let Some(found) = tried.apart {
        return shortened(left, right, common, &mut rows, limits, &found);
    }
    let facts = (structural_facts(left), structural_facts(right));
    let question = Question { left, right, common, facts: (&facts.0, &facts.1), limits };
    let equal = match symbolic::induction(&question, &rows) {
        Induction::Proved { equal, solved } => {
            return Verdict::Proved(SameBy::Induction { equal, solved });
        }
        Induction::Open(why, equal) => {
            reasons.push(OpenReason::Method(why));
            equal
        }
    };
    let whole = Budget { reactions: limits.pairs, states: limits.states, rows: usize::MAX };
    if let Some(settled) = by_diagram(&question, &equal, &mut reasons) {
        return settled;
    }
    if whole.reactions > first.reactions {
        match product::search(left, right, common, &mut rows, whole) {
            Found::Complete { states, reactions } => {
                return Verdict::Proved(SameBy::Product { states, reactions });
            }
            Found::Apart(found) => return apart(left, right, common, &found, true),
            Found::Deep => {}
            Found::Open(why) => reasons.push(why),
        }
    }
    let tried = chance::compare(
        left,
        right,
        common,
        &rows,
        limits.random_rows,
        seed.wrapping_add(1),
        MAX_DT,
    );
    if let Some(found) = tried.apart {
        return shortened(left, right, common, &mut rows, limits, &found);
    }
    reasons.dedup();
    Verdict::Open(Open { reasons, tested: Some(tried.tested) })
}

fn by_diagram(
    question: &Question<'_>,
    equal: &Equalities,
    reasons: &mut Vec<OpenReason>,
) -> Option<Answer> {
    match symbolic::diagram(question, equal) {
        Diagram::Proved { states } => Some(Verdict::Proved(SameBy::Diagram { states })),
        Diagram::Apart(found) => {
            let Question { left, right, common, .. } = question;
            match apart(left, right, common, &found, true) {
                refuted @ Verdict::Refuted(_) => Some(refuted),
                // The two encodings of the reaction contradict each other, so neither is trusted.
                Verdict::Proved(_) | Verdict::Open(_) => {
                    reasons.push(OpenReason::Unfound);
                    None
                }
            }
        }
        Diagram::Open(why) => {
            reasons.push(OpenReason::Method(why));
            None
        }
    }
}

/// Compares two nets in this many directed random reactions with `dt` in `0..=max_dt`; the result is the same for the same seed.
///
/// # Errors
/// A stimulus that shows a difference. It may not be a shortest one.
pub fn charts_by_chance(
    left: &Valid<Net>,
    right: &Valid<Net>,
    common: &Common,
    reactions: usize,
    seed: u64,
    max_dt: u32,
) -> Result<Tested, Box<Apart>> {
    let limits = Limits::default();
    let rows = Rows::of(left, right, common, limits.rows_per_state);
    let tried = chance::compare(left, right, common, &rows, reactions, seed, max_dt);
    let found = tried.apart.and_then(|found| match apart(left, right, common, &found, false) {
        Verdict::Refuted(apart) => Some(apart),
        Verdict::Proved(_) | Verdict::Open(_) => None,
    });
    found.map_or(Ok(tried.tested), Err)
}

/// A difference with a shortest stimulus, if the search of the product gets that far; otherwise the one that was found.
fn shortened(
    left: &Valid<Net>,
    right: &Valid<Net>,
    common: &Common,
    rows: &mut Rows<'_, '_>,
    limits: &Limits,
    found: &[RowPair],
) -> Answer {
    let budget = Budget {
        reactions: limits.pairs,
        states: limits.states,
        rows: found.len().saturating_sub(1),
    };
    match product::search(left, right, common, rows, budget) {
        Found::Apart(shorter) => apart(left, right, common, &shorter, true),
        Found::Deep | Found::Complete { .. } => apart(left, right, common, found, true),
        Found::Open(_) => apart(left, right, common, found, false),
    }
}

/// Replays a stimulus; the result is open if it shows no difference.
fn apart(
    left: &Valid<Net>,
    right: &Valid<Net>,
    common: &Common,
    rows: &[RowPair],
    is_shortest: bool,
) -> Answer {
    let (mut ours, mut theirs) = (Simulator::new(left), Simulator::new(right));
    let mut column = common.differs(ours.row(), theirs.row());
    let mut n_rows = 0;
    for (a, b) in rows {
        if column.is_some() {
            break;
        }
        ours.step(a);
        theirs.step(b);
        n_rows += 1;
        column = common.differs(ours.row(), theirs.row());
    }
    let Some(column) = column else {
        return Verdict::Open(Open::because(OpenReason::Unfound));
    };
    Verdict::Refuted(Box::new(Apart {
        left: Stimulus::of_rows(left, rows[..n_rows].iter().map(|(row, _)| row)),
        right: Stimulus::of_rows(right, rows[..n_rows].iter().map(|(_, row)| row)),
        difference: common.difference(column, n_rows, ours.row(), theirs.row()),
        is_shortest,
    }))
}

/// Runs two nets with one stimulus of the first, up to the first difference or the first row that one of the nets does not allow.
#[must_use]
pub fn charts_on(
    left: &Valid<Net>,
    right: &Valid<Net>,
    common: &Common,
    stimulus: &Stimulus,
) -> OnStimulus {
    let rows = Rows::of(left, right, common, 1);
    let (mut ours, mut theirs) = (Simulator::new(left), Simulator::new(right));
    let mut stimuli = (Stimulus::new(left), Stimulus::new(right));
    let mut compared = 0;
    let mut column = common.differs(ours.row(), theirs.row());
    let zero = grafsynth_sim::InputRow::zero(right);
    for row in stimulus.rows() {
        if column.is_some() {
            break;
        }
        let mut values = Vec::new();
        let mut is_outside = false;
        for input in &common.inputs {
            let (lo, hi) = input.bounds;
            let value = match (input.left, input.right) {
                (Some(id), _) => row.value(id),
                (None, Some(id)) => zero.value(id),
                (None, None) => 0,
            };
            is_outside |= !(lo..=hi).contains(&value);
            values.push(value);
        }
        let pair = common.rows(left, right, row.dt, &values);
        let open = (&ours.row().open, &theirs.row().open);
        if is_outside
            || rows.excludes(&pair)
            || open.0.next
            || open.1.next
            || open.0.row
            || open.1.row
        {
            break;
        }
        ours.step(&pair.0);
        theirs.step(&pair.1);
        stimuli.0.push(&pair.0);
        stimuli.1.push(&pair.1);
        compared += 1;
        column = common.differs(ours.row(), theirs.row());
    }
    let apart = column.map(|column| {
        let difference = common.difference(column, compared, ours.row(), theirs.row());
        let (left, right) = stimuli;
        Box::new(Apart { left, right, difference, is_shortest: false })
    });
    OnStimulus { apart, compared }
}

/// The result of running two nets with one stimulus.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OnStimulus {
    /// The first difference, and the rows up to it.
    pub apart: Option<Box<Apart>>,
    /// The number of rows compared, without that of the reset. It is smaller than the number of rows in the stimulus after a difference, at a row that one of
    /// the nets does not allow, and after a row that leaves everything that follows open.
    pub compared: usize,
}

#[cfg(test)]
mod tests;
