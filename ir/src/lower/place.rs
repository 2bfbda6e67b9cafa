//! The place of an expression in a chart, which determines what the expression may read.

use super::context::ScopeId;
use crate::net::{Leaf, OutputId, PropertyLeaf, StepId};

/// The context of an expression, which determines what it may contain.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place<'p> {
    pub(super) scope: ScopeId,
    /// The context in the user's words, with an article.
    pub(super) what: &'static str,
    /// True if `rise` and `fall` are allowed.
    pub(super) edges: bool,
    /// True if events are allowed.
    pub(super) events: bool,
    /// For the receptivity of a transition: its source steps.
    pub(super) otherwise: Option<&'p [StepId]>,
    /// True if the value must be a constant.
    pub(super) constant: bool,
}

impl Place<'_> {
    /// A context without edges and events.
    pub(super) fn level(scope: ScopeId, what: &'static str) -> Self {
        Place { scope, what, edges: false, events: false, otherwise: None, constant: false }
    }

    /// A statement list of a step, transition or reaction: edges and events have their values at the check (semantics §3.3).
    pub(super) fn list(scope: ScopeId) -> Self {
        Place { edges: true, events: true, ..Place::level(scope, "a list") }
    }
}

/// The leaves of lowered expressions: those of the net, or those of a property, which can also read outputs.
pub(super) trait Target: Copy + Ord {
    fn of_net(leaf: Leaf) -> Self;
    /// The leaf that reads an output of the row; `None` if only the net's values can be read.
    fn of_output(output: OutputId) -> Option<Self>;
}

impl Target for Leaf {
    fn of_net(leaf: Leaf) -> Self {
        leaf
    }
    fn of_output(_: OutputId) -> Option<Self> {
        None
    }
}

impl Target for PropertyLeaf {
    fn of_net(leaf: Leaf) -> Self {
        PropertyLeaf::Net(leaf)
    }
    fn of_output(output: OutputId) -> Option<Self> {
        Some(PropertyLeaf::Output(output))
    }
}
