//! The flow graph of a function: its nodes, what follows each, and the parts that contain them.

use super::resolve::FunctionId;
use grafsynth_ir::Span;
use grafsynth_ir::chart;
use grafsynth_ir::expr::Type as NetType;

/// Index of a node in [`Graph::nodes`].
pub(super) type NodeId = usize;

/// A node, which becomes a step.
#[derive(Debug)]
pub(super) struct Node {
    /// Proposed name; empty for a join that corresponds to nothing in the text.
    pub(super) hint: String,
    /// Its C text; may be empty.
    pub(super) text: String,
    /// The C text of the condition after it.
    pub(super) test: String,
    pub(super) comments: Vec<String>,
    pub(super) span: Span,
    pub(super) body: chart::Block,
    pub(super) next: Next,
    /// Whether the node must remain a separate step: an empty statement, the first step of a function, or a labelled step.
    pub(super) is_kept: bool,
    /// Whether the node only evaluates a condition and may be merged into the preceding step.
    pub(super) is_test: bool,
    /// The innermost part that contains it, as an index into [`Graph::parts`]; 0 is the function.
    pub(super) group: usize,
}

/// The continuation after a node.
#[derive(Debug, Clone)]
pub(super) enum Next {
    /// No continuation yet, or no continuation at all.
    None,
    Goto(NodeId),
    /// The first way whose guard is true; if no guard is true, this node.
    Branch(Vec<Way>, NodeId),
    /// A call: a macro-step, then this node.
    Call(Box<CallSite>, NodeId),
    /// The end of the function.
    Exit,
}

/// One way out of a branch.
#[derive(Debug, Clone)]
pub(super) struct Way {
    pub(super) guard: chart::Expr,
    pub(super) text: String,
    pub(super) to: NodeId,
}

/// A call of a function of the chart.
#[derive(Debug, Clone)]
pub(super) struct CallSite {
    pub(super) callee: FunctionId,
    /// Name of the macro-step.
    pub(super) step: String,
    /// The step that waits for a shared macro-step.
    pub(super) wait: Option<String>,
    /// The statements that pass the arguments.
    pub(super) latches: chart::Block,
    pub(super) span: Span,
}

/// A part of the function that becomes a macro-step.
#[derive(Debug)]
pub(super) struct Part {
    pub(super) parent: usize,
    pub(super) name: String,
    pub(super) text: String,
}

/// The flow graph of a function.
#[derive(Debug)]
pub(super) struct Graph {
    pub(super) nodes: Vec<Node>,
    pub(super) start: NodeId,
    pub(super) parts: Vec<Part>,
    /// Temporary variables that the translation created.
    pub(super) temps: Vec<(String, NetType)>,
}
