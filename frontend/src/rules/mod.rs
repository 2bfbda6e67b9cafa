//! The rule-based text form of Grafcet (Gentzen sequents with a next operator): parser and writer. Rules and flat charts correspond one to
//! one.
//!
//! ```text
//! Step p1, p2
//! Transition t1, t2
//! Input m, b
//! Output R
//! Marking p1
//! Transitions:
//! t1: p1*m |- @p2
//! t2: p2*b |- @p1
//! Steps:
//! p2: |- R
//! ```
//!
//! A transition rule means: if its preceding steps are active and its receptivity is true, its preceding steps become inactive and its
//! following steps (`@`, *next*) active. An output without `@` on the right side of a transition rule is a sub-rule: the output is true
//! *now*, while the left side is true; such an output is `mealy`. A step rule gives the continuous outputs of a step, with an optional
//! condition on its left side. Expressions have the syntax of the chart language; the writer uses the signs `*`, `+` and `/`.
//!
//! Unless an option sets them, charts read from rules have `conflict priority-age`, `evolution single` and `tick 10 ms`. All other
//! properties of a flat chart are written in lines `# option: …` in the syntax of the chart language. `docs/language.md` has the table.

mod format;
mod read;
mod write;

pub use format::{format, format_within};
pub use read::{parse, parse_within};
pub use write::{write_design, write_net};

#[cfg(test)]
mod tests;
