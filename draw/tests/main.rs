//! Drawings are read back from their geometry and compared with their charts.

#![allow(clippy::disallowed_methods, reason = "tests read the examples")]

mod assembled;
mod expected;
mod gallery;
mod measures;
mod pages;
mod png;
mod random;
mod read_back;
mod reader;
mod states;
mod waves;
