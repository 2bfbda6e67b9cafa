//! Boolean functions and the encodings net to logic.
pub mod bdd;
pub mod build;
pub mod chip;
pub mod codes;
pub mod cover;
pub mod encode;
pub mod minimise;
pub mod receptivity;
pub mod sim;
pub mod support;
pub mod word;

pub use encode::{EncodeOptions, encode};
