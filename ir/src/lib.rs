//! The data that every part of grafsynth shares, and the lowering from chart to net.
//!
//! ```text
//! chart   what was drawn      chart.rs
//!   │  lower/ (small named passes)
//! net     what runs           net.rs        text form: text/
//!   │  lower::program
//! program one reaction        program.rs
//!   ⋮  (grafsynth-logic)
//! logic   what a chip is      logic.rs
//! ```
//!
//! This crate knows no language, no target and no engine. Nothing in it reads a file, a clock or the environment.

pub mod arena;
pub mod chart;
pub mod codes;
pub mod diag;
pub mod expr;
pub mod facts;
pub mod interval;
pub mod logic;
pub mod lower;
pub mod names;
pub mod net;
pub mod program;
pub mod program_run;
pub mod sharing;
pub mod simplify;
pub mod span;
pub mod text;
pub mod validate;
pub mod walk;

pub use arena::{Arena, Id, IdMap};
pub use diag::{Code, Diagnostic, Severity};
pub use span::{FileId, Name, Span};
pub use validate::{Valid, validate};
