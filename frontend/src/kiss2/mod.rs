//! KISS2: the state tables of the finite-state-machine benchmarks (`.kiss2`).
//!
//! ```text
//! text ── read ──► Machine (rows: input cube, present state, next state, outputs) ── net ──► Net (one step for each state, mealy outputs)
//!  ▲                  ▲
//!  └───── write ──────┘ ◄── the reachable states of a chart
//! ```
//! A row `01- st0 st1 1-` means: in `st0`, while the first input is 0 and the second 1, the first output is 1 and the next state is `st1`.
//! A `-` as an output, a `-` or `*` as next state, and inputs that no row of a state covers leave the cell unspecified
//! ([`Unspecified`](grafsynth_ir::net::Unspecified)). A row with `*` as present state applies to every state. The initial state is the
//! state after `.r`, otherwise the first state that is named.
//!
//! The format is that of the SIS and MCNC benchmark sets. The supported directives are `.i .o .p .s .r .ilb .ob .e .end` and the brackets
//! `.start_kiss .end_kiss`.

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
    /// Don't-care: any input value, or an unspecified output.
    Any,
}

/// A state.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct State {
    /// Its name as written.
    pub name: String,
    /// Span of its first use.
    pub span: Span,
}

/// A row of the table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Row {
    /// One value per input.
    pub inputs: Vec<Trit>,
    /// The present state as an index into [`Machine::states`]; `None` means every state.
    pub from: Option<usize>,
    /// The next state; `None` means unspecified.
    pub to: Option<usize>,
    /// One value per output.
    pub outputs: Vec<Trit>,
    /// Span of the row.
    pub span: Span,
}

/// A state table.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Machine {
    /// The name of the machine; empty after reading, because the format has none.
    pub name: String,
    /// Names of the inputs.
    pub inputs: Vec<String>,
    /// Names of the outputs.
    pub outputs: Vec<String>,
    /// The states, in the order of their first use.
    pub states: Vec<State>,
    /// The table.
    pub rows: Vec<Row>,
    /// The state after reset, as an index.
    pub initial: usize,
}

impl Machine {
    /// The rows that apply to each state, in order.
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
    /// Whether some combination of inputs matches both rows.
    #[must_use]
    pub fn meets(&self, other: &Row) -> bool {
        self.inputs
            .iter()
            .zip(&other.inputs)
            .all(|(a, b)| a == b || *a == Trit::Any || *b == Trit::Any)
    }
}
