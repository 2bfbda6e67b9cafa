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
            Verdict::Open(open) => reasons.extend(open.reasons),
            settled @ (Verdict::Proved(_) | Verdict::Refuted(_)) => return settled,
        }
    }
    reasons.dedup();
    only_tested(net, logic, reasons, limits)
}

/// What is left where there is no proof, for these reasons: directed random reactions.
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

/// The explicit proof alone; a counterexample is a shortest one.
#[must_use]
pub fn by_enumeration(net: &Valid<Net>, logic: &Logic, limits: &Limits) -> Verdict {
    match Binding::of(net, logic) {
        Ok(binding) => explicit::equiv(net, logic, &binding, limits),
        Err(why) => Verdict::Open(Open::because(why)),
    }
}

/// The symbolic proof alone. It proves or leaves open; a difference that it meets may lie in a state that is never reached.
#[must_use]
pub fn by_induction(net: &Valid<Net>, facts: &Facts, logic: &Logic, limits: &Limits) -> Verdict {
    match Binding::of(net, logic) {
        Ok(binding) => symbolic::equiv(net, facts, logic, &binding, limits),
        Err(why) => Verdict::Open(Open::because(why)),
    }
}

/// A difference that shows in so many random reactions, if any does.
#[must_use]
pub fn by_chance(net: &Valid<Net>, logic: &Logic, n_rows: usize) -> Option<Counterexample> {
    let binding = Binding::of(net, logic).ok()?;
    random::compare(net, logic, &binding, n_rows).0
}

#[cfg(test)]
mod tests;
