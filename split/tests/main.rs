//! The tests of the partition solver, in one program that is linked once.

mod common;
mod highs;
mod limits;
mod random;
mod series;
