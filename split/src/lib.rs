//! Splits a net between chips and a CPU (semantics §10).
//!
//! ```text
//! net ─ together ─► groups of objects that lie on one part
//!     ─ divide ───► one net for each part, and the wires between them
//! ```
//!
//! Everything here is a pure function. `grafsynth-verify` proves that the parts, joined by their wires, are the net; it shares no code with this crate.

pub mod codes;
pub mod cpu;
pub mod divide;
pub mod link;
pub mod together;

pub use divide::divide;
pub use together::{Bond, Groups, Item, Why, together};
