//! Boolean functions and the encodings net to logic.
pub mod bdd;
pub mod build;
pub mod sim;
pub mod word;
