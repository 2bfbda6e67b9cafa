//! Boolean functions, and the encodings from net to logic.
//!
//! ```text
//! net ─ ir::lower::program ─► program ─ encode (word, receptivity) ─► Logic
//!                                                                      │ build   nodes shared and simplified
//!                                                                      │ sim     clock by clock; chip: as the net it was made from
//!                                                                      │ node_bdds  the functions as diagrams (bdd)
//!                                                                      ▼ minimise  small sums of products (cover)
//! ```
//! [`encode()`] makes a circuit from a net; [`chip::ChipSim`] runs it as that net; [`minimise::sum_of_products`] writes one of its functions in the form
//! that a PAL needs. The verifier encodes the reaction independently: it uses the diagrams and the simulator of this crate, but not the encoding.

pub mod bdd;
pub mod build;
pub mod chip;
pub mod codes;
pub mod cover;
pub mod encode;
pub mod minimise;
pub mod node_bdds;
pub mod receptivity;
pub mod shared_times;
pub mod sim;
pub mod split;
pub mod state_assignment;
pub mod word;

pub use encode::{BusyMode, EncodeOptions, encode, is_depth_proved, kept_apart};
