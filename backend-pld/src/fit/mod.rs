//! The decisions between a circuit and its equations: the form of each function, the pin of each signal, and what to say where that does not fit.
//!
//! ```text
//! Logic ─ form    polarity of each sum; exclusive  T flip-flops, inverters ─┐
//!   └──── logic::split  where a sum is too wide: buried nodes ─ pins  matched to macrocells; blocks  to logic blocks ─ Equations
//!                                          │                       └─ misfit  what is missing, why, and what would help
//!                                          └─ place  the macrocells of the device, for the fuse mapper
//! ```

pub(crate) mod blocks;
pub(crate) mod exclusive;
pub(crate) mod form;
pub(crate) mod misfit;
pub(crate) mod pins;
mod place;
