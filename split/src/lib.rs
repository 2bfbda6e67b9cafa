//! Splits a net between chips and a CPU (semantics §10).
//!
//! ```text
//! net ─ together ──► groups of objects that must be on the same part
//!     ─ partition ─► the part of each group, by the solver in `solve`
//!     ─ divide ────► one net for each part, and the wires between them; for a statechart, in `statechart`
//! ```
//!
//! Everything here is a pure function. `grafsynth-verify` proves that the parts, joined by their wires, are the net; it shares no code with this crate.
//!
//! The solver knows nothing of charts: its input is a table of costs.
//!
//! ```
//! use grafsynth_split::solve::{Choice, Limits, Node, Outcome, Part, Problem, Wire, solve};
//!
//! // Two steps with a wire between them. The chip has one macrocell; the CPU has no limit.
//! let step = |cycles| Node { choices: vec![Some(Choice { cost: 0, uses: vec![1] }), Some(Choice { cost: cycles, uses: vec![0] })] };
//! let problem = Problem {
//!     parts: vec![Part { capacities: vec![Some(1)], pins: Some(8), always: 0 }, Part { capacities: vec![None], pins: None, always: 0 }],
//!     nodes: vec![step(30), step(50)],
//!     wires: vec![Wire { driver: 0, readers: vec![1], cost: 4 }],
//!     ..Problem::default()
//! };
//! let Ok(Outcome::Optimal { assignment, value }) = solve(&problem, &Limits::default(), None) else { panic!("not solved") };
//! assert_eq!((assignment, value), (vec![1, 0], 34));
//! ```

mod away;
pub mod cells;
pub mod codes;
pub mod cpu;
mod direct;
pub mod divide;
mod emergency;
pub mod link;
pub mod partition;
mod pieces;
pub mod solve;
mod statechart;
pub mod together;

pub use cells::Cells;
pub use divide::divide;
pub use partition::{Count, Objective, PartSpec, Partition, given, neighbour, partition};
pub use pieces::unused_name;
pub use together::{Bond, Groups, Item, Why, together};

#[cfg(test)]
extern crate self as grafsynth_split;
