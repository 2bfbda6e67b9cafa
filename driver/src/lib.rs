//! The pipelines: sources to a design, a design to outputs with proofs, two designs compared. Everything here is a pure function.
//!
//! ```text
//! let (design, findings) = read::read(&sources, &texts, limits);     // texts, board and properties to a net
//! let facts = pipeline::facts(&net, &limits);
//! let built = pipeline::build(&net, &facts, &targets, &options);     // texts, each read back and proved
//! ```

pub mod automaton;
mod built;
pub mod certify;
mod circuit;
mod circuit_notes;
pub mod codes;
pub mod coding;
pub mod compare;
mod context;
pub mod convert;
pub mod diff;
pub mod evidence;
mod fit_advice;
pub mod format;
pub mod forms;
pub mod fuse_design;
pub mod ice40;
pub mod jedec;
pub mod judge;
pub mod libraries;
pub mod logic;
pub mod minimise;
mod output_report;
pub mod pages;
pub mod pin_numbers;
pub mod pipeline;
pub mod read;
pub mod refit;
pub mod report;
pub mod ring;
pub mod rows;
pub mod run;
pub mod source;
mod stages;
pub mod state_table;
pub mod stem;
pub mod target;
pub mod task_costs;
pub mod template;
mod texts;
pub mod trust;
