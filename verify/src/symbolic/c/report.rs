//! What is known of the calls of callbacks while C is executed.

use std::rc::Rc;

use super::memory::{Cell, Memory};
use crate::symbolic::aig::Lit;
use crate::symbolic::number::Number;

/// One of the two functions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Callback {
    /// A step was activated or deactivated.
    Activated,
    /// A transition became enabled.
    Enabled,
}

/// A call of one of them.
#[derive(Debug, Clone)]
pub(super) struct Report {
    pub(super) of: Callback,
    /// The condition under which the call is made.
    pub(super) when: Lit,
    pub(super) arguments: Vec<Number>,
}

/// The instance before a reaction that is cut, with any values.
pub(super) struct Earlier {
    /// The cells of the instance at the start of the reaction, as far as the C may have copied them.
    pub(super) copied: Vec<Rc<Cell>>,
    /// The cell in place of each of them.
    pub(super) cells: Vec<Rc<Cell>>,
    pub(super) memory: Memory,
}
