//! Tests of the lowering, on charts built by hand; whole files are lowered in the `tests` package.

mod build;
mod checks;
mod hierarchy;
mod large;
mod laws;
mod structure;
mod values;
