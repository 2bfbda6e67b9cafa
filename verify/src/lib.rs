//! Proofs about nets, and the equivalence of logic and of C with a net.
//!
//! ```text
//! let facts = verify::facts(&net, &Limits::default());           // components, situations, depth, dead parts
//! let verdict = verify::equiv(&net, &facts, &read_back, &limits); // Proved | Refuted(stimulus, difference) | Open(why)
//! let answers = verify::properties(&net, &limits);                // one per `assert`
//! let waits = verify::waiting(&net, &limits);                    // waiting time of each competing transition
//! let findings = verify::lints(&net, &facts);                     // probable mistakes
//! let all = verify::Explored::of(&net, &Limits::default()); // facts, properties, waits, findings in one search
//! ```
//!
//! Five engines answer these questions: the structure of the net ([`cover`], with the decision diagrams of [`exclusive`]), an exhaustive search with the
//! reference simulator, the same search over net and circuit together, a second encoding of the reaction as functions with a solver, and on that
//! encoding the search for inductive invariants ([`directed`]). Each gives an exact answer or none; [`Limits`] count work, so the same question has the
//! same answer on every machine.
//!
//! `docs/verify.md` describes the coverage for users.

mod alphabet;
pub mod circuits;
mod classes;
pub mod codes;
pub mod cover;
pub mod equiv;
pub mod exclusive;
mod explore;
mod explored;
mod facts;
mod far;
mod free;
mod guards;
mod limits;
mod lints;
pub mod pair;
mod properties;
mod relevance;
pub mod sharing;
mod symbolic;
pub mod verdict;
mod waiting;
mod zone;

pub use equiv::{Certificate, Counterexample, Method, Verdict, equiv};
pub use explored::{Explored, findings, lints};
pub use facts::{facts, structural_facts};
pub use free::{Event, Race, Settled, Unlike, settles};
pub use limits::{DEFAULT_EFFORT, Limits, MAX_EFFORT};
pub use lints::{Check, Checked, Conflict, Decided, Findings};
pub use properties::{Outcome, PropertyVerdict, check_assumption, properties, with_emergency};
pub use symbolic::c as c_code;
pub use symbolic::{
    Apart, Directed, Dominance, Invariant, Joined, Refused, RoundFacts, StateBit, Times, directed,
    dominates, joined, recheck, state_bits,
};
pub use verdict::{Open, OpenReason, Scope, Tested};
pub use waiting::{Wait, Waiting, may_lose, waiting};

#[cfg(test)]
mod testing;
