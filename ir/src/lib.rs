//! The data that all parts of grafsynth share, and the lowering from chart to net.
//!
//! ```text
//! chart   the source as data  chart.rs
//!   │  lower/ (small named passes)
//! net     the flat form       net.rs        text form: text/    rewrite/ (net to net)
//!   │  lower::program
//! program one reaction        program.rs
//!   ⋮  (grafsynth-logic)
//! logic   one circuit         logic.rs
//! ```
//!
//! This crate knows no language, target or engine. Nothing in it reads a file, the clock or the environment.

pub mod arena;
pub mod chart;
pub mod codes;
pub mod diag;
pub mod division;
pub mod expr;
pub mod facts;
pub mod gather;
pub mod instance;
pub mod interval;
pub mod logic;
pub mod lower;
pub mod markup;
pub mod names;
pub mod net;
pub mod plan;
pub mod plant;
pub mod program;
pub mod program_run;
pub mod random;
pub mod ranks;
pub mod rewrite;
pub mod sharing;
pub mod simplify;
pub mod span;
pub mod text;
pub mod validate;
pub mod walk;

pub use arena::{Arena, Id, IdMap};
pub use diag::{Code, Diagnostic, Severity, counted, duration};
pub use gather::Gather;
pub use span::{FileId, Name, Span};
pub use validate::{Valid, validate};
