//! The decisions between a circuit and its equations: the form of each function, the pin of each signal, and the messages if something does not fit.
//!
//! ```text
//! decide  all decisions in order; count first, because a design that cannot fit needs no sums
//!
//! Logic ─ form    polarity of each sum; exclusive  T flip-flops, inverters ─┐
//!   └──── logic::split  if a sum is too wide:    buried nodes ─ pins  matched to macrocells; blocks  to logic blocks ─ Equations
//!                                          │                       └─ misfit  the missing resources, the causes, and possible remedies
//!                                          │                       └─ share  outputs that use the pin of a flip-flop
//!                                          │                       └─ divide  sums over spare macrocells, if they are too wide for those of the device
//!                                          └─ place  the macrocells of the device, for the fuse mapper
//! ```

mod attempt;
mod blocks;
mod count;
mod decide;
mod divide;
mod exclusive;
mod form;
mod matching;
mod misfit;
mod need;
mod pins;
mod place;
mod share;

pub(crate) use count::lacks;
pub use decide::RELIES;
pub use need::{MovedBecause, MovedPin, Refusal};

#[cfg(test)]
mod tests;
