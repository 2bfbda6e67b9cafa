//! Is a circuit the net? The proof that what was emitted, read back, is what was drawn.
//!
//! Two ways, tried in the order that suits the size of the net:
//!
//! - *explicit*: the product of the reference simulator and the circuit is searched from reset, with all inputs. Nothing need be known of how the
//!   circuit codes its state. Exact, and a difference comes with a shortest stimulus.
//! - *symbolic*: the reaction is written down as a circuit a second time, straight from `docs/semantics.md`, and each flip-flop and each output is proved
//!   equal by a solver for any state that meets the invariants; that and the equality after reset make an induction.
//!
//! Where neither ends within its limits the answer is open, and a comparison on random inputs is run so that a wrong circuit is not passed over.

mod binding;
mod explicit;
mod random;

use grafsynth_ir::Valid;
use grafsynth_ir::facts::Facts;
use grafsynth_ir::logic::Logic;
use grafsynth_ir::net::Net;
use grafsynth_sim::{Difference, Stimulus};

use crate::limits::Limits;
use crate::symbolic;
pub(crate) use binding::{Binding, Shown, What};

/// What is known of a circuit and a net.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Verdict {
    /// They agree for every stimulus that meets the assumptions.
    Proved(Certificate),
    /// They do not, and here is where.
    Refuted(Counterexample),
    /// It could not be found out, and why; says how many random reactions were compared without a difference.
    Open(String),
}

/// How an equivalence was proved.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Certificate {
    /// The method.
    pub method: Method,
    /// Bits that were compared: outputs, steps, variables, the fault flag; for the symbolic method the other flip-flops too.
    pub compared: usize,
}

/// The methods of [`equiv`], each with the size of the proof.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// All reachable states of net and circuit together, each with every input that either of them reads there.
    Explicit {
        /// Pairs of a net's and a circuit's state.
        states: u64,
        /// Reactions compared.
        reactions: u64,
    },
    /// Induction over the reaction.
    Symbolic {
        /// Functions equal by construction.
        same: usize,
        /// Functions that the solver proved equal.
        solved: usize,
    },
}

impl std::fmt::Display for Certificate {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.method {
            Method::Explicit { states, reactions } => write!(
                f,
                "proved by enumeration: {states} states, {reactions} reactions, {} bits compared in each",
                self.compared
            ),
            Method::Symbolic { same, solved } => write!(
                f,
                "proved by induction: {} functions, {same} equal by construction, {solved} by the solver",
                self.compared
            ),
        }
    }
}

/// A stimulus under which circuit and net differ in its last row.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Counterexample {
    /// What to feed both.
    pub stimulus: Stimulus,
    /// The cell that differs: left is the net, right the circuit. For a piece of state that no trace shows the column is the name of the flip-flop.
    pub difference: Difference,
}

/// Steps from which on the symbolic proof is tried first.
const LARGE: usize = 24;

/// Proves that the circuit does what the net does, from reset on, for every stimulus with `dt` 0 or 1 that meets the assumptions; or finds a stimulus
/// that tells them apart.
///
/// Pins are found by [`PinRole`](grafsynth_ir::logic::PinRole), steps and variables by [`Flop::holds`](grafsynth_ir::logic::Flop::holds). The
/// explicit method compares what a trace shows; flip-flops without a known meaning may code whatever they like.
#[must_use]
pub fn equiv(net: &Valid<Net>, facts: &Facts, logic: &Logic, limits: &Limits) -> Verdict {
    let mut reasons = Vec::new();
    let induction_first = net.steps.len() >= LARGE;
    for induction in [induction_first, !induction_first] {
        let verdict = if induction {
            // A difference is found soonest by chance, and comes with a stimulus, which the induction does not give.
            if let Some(counterexample) = by_chance(net, logic, limits.random_rows.min(1024)) {
                return Verdict::Refuted(counterexample);
            }
            by_induction(net, facts, logic, limits)
        } else {
            by_enumeration(net, logic, limits)
        };
        match verdict {
            Verdict::Open(why) => reasons.push(why),
            settled @ (Verdict::Proved(_) | Verdict::Refuted(_)) => return settled,
        }
    }
    reasons.dedup();
    match by_chance(net, logic, limits.random_rows) {
        Some(counterexample) => Verdict::Refuted(counterexample),
        None => Verdict::Open(format!(
            "{}; compared on {} random reactions, not proved",
            reasons.join("; "),
            limits.random_rows
        )),
    }
}

/// The explicit proof alone; a counterexample is a shortest one.
#[must_use]
pub fn by_enumeration(net: &Valid<Net>, logic: &Logic, limits: &Limits) -> Verdict {
    match Binding::of(net, logic) {
        Ok(binding) => explicit::equiv(net, logic, &binding, limits),
        Err(why) => Verdict::Open(why),
    }
}

/// The symbolic proof alone. It proves or leaves open; a difference that it meets may lie in a state that is never reached.
#[must_use]
pub fn by_induction(net: &Valid<Net>, facts: &Facts, logic: &Logic, limits: &Limits) -> Verdict {
    match Binding::of(net, logic) {
        Ok(binding) => symbolic::equiv(net, facts, logic, &binding, limits),
        Err(why) => Verdict::Open(why),
    }
}

/// A difference that shows in so many random reactions, if any does.
#[must_use]
pub fn by_chance(net: &Valid<Net>, logic: &Logic, n_rows: usize) -> Option<Counterexample> {
    let binding = Binding::of(net, logic).ok()?;
    random::compare(net, logic, &binding, n_rows)
}

#[cfg(test)]
mod tests;
