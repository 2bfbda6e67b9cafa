//! Equivalence of a circuit and a net: proves that the emitted circuit, read back, behaves like the chart.
//!
//! Two methods, in the order that suits the size of the net:
//!
//! - *explicit*: searches the product of the reference simulator and the circuit from reset, with all inputs.
//!   The state coding of the circuit need not be known. The method is exact, and a difference comes with a shortest stimulus.
//! - *symbolic*: builds the reaction as a second circuit, directly from `docs/semantics.md`; a solver proves each
//!   flip-flop and each output equal in every state that satisfies the invariants. Together with equality after reset this is an induction.
//!
//! If neither ends within its limits, the answer is open, and a comparison with random inputs runs, so that a wrong circuit is likely to be found.

pub(crate) mod binding;
mod explicit;
mod random;
pub(crate) mod verdict;

use grafsynth_ir::Valid;
use grafsynth_ir::facts::Facts;
use grafsynth_ir::logic::Logic;
use grafsynth_ir::net::Net;

use crate::limits::Limits;
use crate::symbolic;
use crate::verdict::{Open, OpenReason};
use binding::Binding;
pub use verdict::{Certificate, Counterexample, Method, Verdict};

/// From this number of steps on, the symbolic proof is tried first.
const LARGE: usize = 24;
/// The maximum number of pairs of a state and an input row that are enumerated before the symbolic proof is tried. Most small charts need fewer; one that
/// counts to a large number needs so many that the symbolic proof is faster.
const FEW_PAIRS: u64 = 50_000;

/// Proves that the circuit behaves like the net from reset on, for every stimulus with `dt` 0 or 1 that satisfies the assumptions. Otherwise finds a stimulus
/// that shows a difference.
///
/// Pins are found by [`PinRole`](grafsynth_ir::logic::PinRole), steps and variables by [`Flop::holds`](grafsynth_ir::logic::Flop::holds). The explicit
/// method compares the values of a trace; flip-flops without a known meaning may store anything.
#[must_use]
pub fn equiv(net: &Valid<Net>, facts: &Facts, logic: &Logic, limits: &Limits) -> Verdict {
    let few = Limits { pairs: FEW_PAIRS, ..limits.clone() };
    let is_small = net.steps.len() < LARGE;
    let is_cut = limits.pairs > FEW_PAIRS;
    let mut reasons = Vec::new();
    if is_small {
        match by_enumeration(net, logic, if is_cut { &few } else { limits }) {
            Verdict::Open(_) if is_cut => {}
            Verdict::Open(open) => reasons.extend(open.reasons),
            settled @ (Verdict::Proved(_) | Verdict::Refuted(_)) => return settled,
        }
    }
    // Random runs find a difference fastest, and with a stimulus, which the induction does not provide.
    if let Some(counterexample) = by_chance(net, logic, limits.random_rows.min(1024)) {
        let shortest = if is_small && is_cut {
            by_enumeration(net, logic, limits)
        } else {
            Verdict::Refuted(counterexample.clone())
        };
        return if let Verdict::Refuted(_) = shortest {
            shortest
        } else {
            Verdict::Refuted(counterexample)
        };
    }
    match by_induction(net, facts, logic, limits) {
        Verdict::Open(open) => reasons.extend(open.reasons),
        settled @ (Verdict::Proved(_) | Verdict::Refuted(_)) => return settled,
    }
    if is_cut || !is_small {
        match by_enumeration(net, logic, limits) {
            Verdict::Open(open) => reasons.extend(open.reasons),
            settled @ (Verdict::Proved(_) | Verdict::Refuted(_)) => return settled,
        }
    }
    reasons.dedup();
    only_tested(net, logic, reasons, limits)
}

/// The verdict if there is no proof, for these `reasons`: refuted if directed random reactions show a difference, otherwise open, with the coverage of these
/// reactions.
#[must_use]
pub fn only_tested(
    net: &Valid<Net>,
    logic: &Logic,
    reasons: Vec<OpenReason>,
    limits: &Limits,
) -> Verdict {
    let Ok(binding) = Binding::of(net, logic) else {
        return Verdict::Open(Open { reasons, tested: None });
    };
    match random::compare(net, logic, &binding, limits.random_rows) {
        (Some(counterexample), _) => Verdict::Refuted(counterexample),
        (None, tested) => Verdict::Open(Open { reasons, tested: Some(tested) }),
    }
}

/// The explicit proof only; a counterexample is a shortest one.
#[must_use]
pub fn by_enumeration(net: &Valid<Net>, logic: &Logic, limits: &Limits) -> Verdict {
    match Binding::of(net, logic) {
        Ok(binding) => explicit::equiv(net, logic, &binding, limits),
        Err(why) => Verdict::Open(Open::because(why)),
    }
}

/// The symbolic proof only. The result is proved or open; a difference that it finds may be in an unreachable state.
#[must_use]
pub fn by_induction(net: &Valid<Net>, facts: &Facts, logic: &Logic, limits: &Limits) -> Verdict {
    match Binding::of(net, logic) {
        Ok(binding) => symbolic::equiv(net, facts, logic, &binding, limits),
        Err(why) => Verdict::Open(Open::because(why)),
    }
}

/// Compares net and circuit in `n_rows` random reactions; returns a difference, if they show one.
#[must_use]
pub fn by_chance(net: &Valid<Net>, logic: &Logic, n_rows: usize) -> Option<Counterexample> {
    let binding = Binding::of(net, logic).ok()?;
    random::compare(net, logic, &binding, n_rows).0
}

#[cfg(test)]
mod tests;
