//! The pipelines: sources to a design, a design to outputs with proofs, two designs compared. Everything here is a pure function.
//!
//! ```text
//! let (design, findings) = read::read(&sources, &texts, limits);     // texts, board and properties to a net
//! let facts = pipeline::facts(&net, &limits);
//! let built = pipeline::build(&net, &facts, &targets, &options);     // outputs, and what was proved about each
//! ```
//!
//! The files of the pipeline, in reading order; each needs only those above it and the data that it names:
//!
//! 1. [`languages`]: one row per language; [`read`]: texts to a [`read::Design`], with its libraries, board and properties
//! 2. `built`: the data of a build: options, files, results; `output_report`: the result for one output
//! 3. `circuit`, [`coding`]: the circuit of a net, and the codes of its steps for a device
//! 4. `context`: the data that all stages of one output share
//! 5. `stages/encode`, `emit`, `read_back`, `prove`, `describe`: the stages of a circuit, each with its own artefact; `stages/c`: the stage of C, whose text
//!    [`c_proof`] proves and an engine of the caller runs
//! 6. [`pipeline`]: all targets of a build
//! 7. [`report`]: the page of a build

pub mod automaton;
mod built;
mod c_map;
pub mod c_proof;
pub mod certify;
mod circuit;
mod circuit_notes;
pub mod codes;
pub mod coding;
pub mod compare;
mod context;
pub mod convert;
mod design;
pub mod diff;
mod edit_scope;
pub mod edited_c;
pub mod evidence;
mod fit_advice;
pub mod forms;
pub mod fuse_design;
pub mod ice40;
pub mod invariants;
pub mod jedec;
pub mod judge;
pub mod languages;
pub mod libraries;
pub mod logic;
pub mod minimise;
mod output_report;
pub mod pages;
pub mod pin_numbers;
pub mod pipeline;
pub mod read;
mod recognise;
pub mod refit;
pub mod report;
pub mod ring;
pub mod rows;
pub mod run;
pub mod source;
pub mod split;
mod stages;
pub mod state_table;
pub mod stem;
pub mod target;
pub mod task_costs;
pub mod template;
mod texts;
pub mod trust;
