//! Boolean functions and the encodings net to logic.
pub mod bdd;
