//! What is proved of a net, and the equivalence of logic with a net.

mod alphabet;
pub mod codes;
pub mod cover;
pub mod equiv;
pub mod exclusive;
mod explore;
mod facts;
mod limits;
mod lints;
mod properties;
mod relevance;
mod symbolic;
mod walk;

pub use equiv::{Certificate, Counterexample, Method, Verdict, equiv};
pub use explore::Ticks;
pub use facts::{facts, structural_facts};
pub use limits::Limits;
pub use lints::{lints, lints_with};
pub use properties::{Outcome, PropertyVerdict, check_assumption, properties};

#[cfg(test)]
mod testing;
