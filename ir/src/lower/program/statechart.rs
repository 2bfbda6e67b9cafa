//! The evolution of statecharts.

use super::Builder;
use crate::program::Stmt;

impl Builder<'_> {
    pub(super) fn statechart_cells(&mut self) {}
    pub(super) fn statechart_reaction(&mut self) -> Vec<Stmt> { Vec::new() }
    pub(super) fn statechart_reset(&mut self) -> Vec<Stmt> { Vec::new() }
}
