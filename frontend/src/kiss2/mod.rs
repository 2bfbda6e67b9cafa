//! KISS2: the state tables of the finite-state-machine benchmarks (`.kiss2`).
//!
//! ```text
//! text ── read ──► Machine (rows: input cube, present state, next state, outputs) ── net ──► Net (one step for each state, mealy outputs)
//!  ▲                  ▲
//!  └───── write ──────┘ ◄── the reachable product automaton of a chart
//! ```
//! A row `01- st0 st1 1-` says: in `st0`, when the first input is 0 and the second 1, the first output is 1 while that is so and `st1` is next. `-` as an
//! output, `-` or `*` as next state, and inputs that no row of a state covers leave the cell open ([`Unspecified`](grafsynth_ir::net::Unspecified)).
//! `*` as present state speaks of every state. The machine begins in the state after `.r`, else in the first state that is named.
//!
//! The format is that of the SIS and MCNC benchmark sets; read are `.i .o .p .s .r .ilb .ob .e .end` and the brackets `.start_kiss .end_kiss`.

mod cover;
mod net;
mod read;
#[cfg(test)]
mod tests;
mod write;

use grafsynth_ir::span::Span;

pub use cover::covers_all;
pub use net::net;
pub use read::{parse, parse_within};
pub use write::write;

/// A value of a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Trit {
    /// 0.
    Low,
    /// 1.
    High,
    /// Either: any input, an open output.
    Any,
}

/// A state.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct State {
    /// Its name as written.
    pub name: String,
    /// Where it is named first.
    pub span: Span,
}

/// A row of the table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Row {
    /// One for each input.
    pub inputs: Vec<Trit>,
    /// The present state, by its place in [`Machine::states`]; none is every state.
    pub from: Option<usize>,
    /// The next state; none is open.
    pub to: Option<usize>,
    /// One for each output.
    pub outputs: Vec<Trit>,
    /// Where it stands.
    pub span: Span,
}

/// A state table.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Machine {
    /// Its name; a text has none.
    pub name: String,
    /// Names of the inputs.
    pub inputs: Vec<String>,
    /// Names of the outputs.
    pub outputs: Vec<String>,
    /// The states, in the order in which they are named.
    pub states: Vec<State>,
    /// The table.
    pub rows: Vec<Row>,
    /// The state after reset, by its place.
    pub initial: usize,
}

impl Machine {
    /// The rows that speak of each state, in order.
    #[must_use]
    pub fn rows_by_state(&self) -> Vec<Vec<&Row>> {
        let mut rows = vec![Vec::new(); self.states.len()];
        for row in &self.rows {
            match row.from {
                Some(state) => rows[state].push(row),
                None => rows.iter_mut().for_each(|rows: &mut Vec<&Row>| rows.push(row)),
            }
        }
        rows
    }
}

impl Row {
    /// True if both rows speak of some input.
    #[must_use]
    pub fn meets(&self, other: &Row) -> bool {
        self.inputs
            .iter()
            .zip(&other.inputs)
            .all(|(a, b)| a == b || *a == Trit::Any || *b == Trit::Any)
    }
}
