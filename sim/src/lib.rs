//! The reference simulator: a literal implementation of `docs/semantics.md`, with the stimuli that drive it and the traces that are compared.
//!
//! ```text
//! let (stimulus, problems) = Stimulus::parse_csv(&net, file, text);
//! let trace = run(&net, &stimulus);                       // row 0 is the reset
//! let other = Trace::parse_csv(&TraceLayout::of(&net), file, &printed_by_another_engine)?;
//! assert_eq!(compare(&trace, &other), None);
//! ```
//!
//! [`Simulator`] runs a net reaction by reaction; its [`State`] is small, ordered and hashable, so that explorers can keep millions of them, and it can be
//! saved and restored by name into a changed net. The reaction is the program of semantics §3.9, one function for each of its lines (module `reaction`);
//! it shares no code with the lowering of nets to programs, which it checks.
// If the simulator forgot a variant, the reference would be wrong.
#![warn(clippy::wildcard_enum_match_arm)]

mod asked;
mod clocked;
mod clocks;
pub mod codes;
mod commands;
mod conflict;
mod constants;
mod control;
mod csv;
mod directed;
mod ending;
mod evaluate;
mod event_questions;
mod events;
mod expected;
mod free;
mod generate;
mod hierarchy;
mod joint;
mod layout;
mod lists;
mod notes;
mod plant;
mod ranks;
mod reaction;
mod row;
mod rows;
mod saved;
mod simulator;
mod situation;
mod state;
mod statechart;
mod stepper;
mod stimulus;
mod tables;
mod trace;
mod trace_text;
mod waits;

#[cfg(test)]
mod tests;

pub use asked::{Asked, Function, Question, value};
pub use clocked::{ClockPlace, Clocked, MAX_CLOCKS};
pub use clocks::Clock;
pub use commands::{COMMANDS, Command};
pub use directed::ahead::{Ahead, MICRO_STEPS, Made};
pub use directed::ticks::{Counter, Running, Thresholds, turns};
pub use directed::{Coverage, Directed, Move, Start};
pub use events::{Events, Sequences, measures_time, seen};
pub use expected::Expected;
pub use free::{FreeParts, Moment};
pub use grafsynth_ir::random::Random;
pub use joint::{Joint, joined_row};
pub use notes::{Notes, Noticed, Occurrence, Writer};
pub use plant::{RunningPlant, with_plant};
pub use row::{Effect, InputRow, Open, Row};
pub use saved::Restored;
pub use simulator::{Simulator, run, run_observed, run_with};
pub use situation::Situation;
pub use state::State;
pub use stepper::{Frame, Stepper};
pub use stimulus::{MAX_DT, Stimulus, breaks_assumption};
pub use trace::{
    Column, ColumnKind, Difference, Trace, TraceLayout, TraceOptions, TraceRow, Value, compare,
};
pub use waits::{Reason, Wait, WaitState};
