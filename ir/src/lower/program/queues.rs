//! The event queues of statecharts (§5).

use super::Builder;
use crate::net::{InputId, SendId};
use crate::program::{CellId, Stmt};

/// The cells of both queues.
#[derive(Debug, Clone, Copy)]
pub(super) struct Queues {
    pub(super) internal: Option<(CellId, CellId)>,
    pub(super) external: Option<(CellId, CellId)>,
}

impl Builder<'_> {
    pub(super) fn raise(&mut self, event: InputId, out: &mut Vec<Stmt>) {
        if let Some(pending) = self.pending[event] {
            out.push(Stmt::Store(pending, None, crate::program::Expr::bool(true)));
        }
    }
    pub(super) fn send(&mut self, _slot: SendId, _out: &mut Vec<Stmt>) {}
}
