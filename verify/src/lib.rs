//! What is proved of a net, and the equivalence of logic with a net.

pub mod codes;
pub mod cover;
mod alphabet;
pub mod exclusive;
mod explore;
mod limits;
mod relevance;
mod walk;

pub use explore::Ticks;
pub use limits::Limits;

#[cfg(test)]
mod testing;
