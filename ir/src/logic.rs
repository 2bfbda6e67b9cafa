//! Logic: the content of a chip. It has one next-state function for each flip-flop and one function for each output pin.
//!
//! Functions are nodes of one shared graph; a node refers only to earlier nodes, so there is no combinational loop. The encodings produce this data, the
//! equation writers and the minimiser read it, and all readers of equations return it.

use crate::arena::{Arena, Id, IdMap};
use crate::net::{Meta, Net, Step, StepKind};
use crate::program::Origin;
use crate::span::Name;

/// Identifies a node.
pub type NodeId = Id<Node>;
/// Identifies a flip-flop.
pub type FlopId = Id<Flop>;
/// Identifies an input pin.
pub type PinInputId = Id<PinInput>;
/// Identifies an output pin.
pub type PinOutputId = Id<PinOutput>;

/// One synchronous circuit with a single clock.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Logic {
    /// The name of the design.
    pub name: Name,
    /// Input bits other than the clock.
    pub inputs: Arena<PinInput>,
    /// D flip-flops.
    pub flops: Arena<Flop>,
    /// Output bits.
    pub outputs: Arena<PinOutput>,
    /// The functions.
    pub nodes: Arena<Node>,
    /// Intermediate functions with a name in the source, such as the firing of a transition. Writers of multi-level languages print them as wires; the
    /// functions above do not depend on this list.
    pub wires: Vec<Wire>,
    /// Input constraints that the environment guarantees: each node is never true. The minimiser uses them as don't-cares.
    pub never: Vec<NodeId>,
    /// State constraints: each node is false in every state that is reachable from power-up. The minimiser uses them as don't-cares too, and the proof of the
    /// circuit shows that it never reaches them.
    pub unreachable: Vec<NodeId>,
    /// Bits of the net's state that are not stored in a flip-flop of their own, as functions of the flip-flops: steps that share a code.
    pub decoded: Vec<Decoded>,
    /// Conditions under which individual functions may have any value, because the designer left it open (semantics.md §3.6). They are don't-cares of these
    /// functions only.
    pub open: Vec<Open>,
}

impl Logic {
    /// The conditions under which this function may have any value.
    pub fn open_where(&self, function: Function) -> impl Iterator<Item = NodeId> + '_ {
        self.open.iter().filter(move |open| open.of == function).map(|open| open.when)
    }
}

/// One function of a circuit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Function {
    /// The D function of a flip-flop.
    Next(FlopId),
    /// The value of an output, combinational (`mealy` too) or registered.
    Output(PinOutputId),
}

/// A condition under which the value of a function is open.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Open {
    /// The function.
    pub of: Function,
    /// A condition over the inputs and the flip-flops before the clock edge: if it is true, the function may have any value.
    pub when: NodeId,
}

/// A state bit as a function of the flip-flops.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Decoded {
    /// The name of the bit in the source.
    pub name: String,
    /// The state bit; never inverted.
    pub holds: FlopBit,
    /// The function that gives the value of the bit.
    pub node: NodeId,
}

/// An input bit.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PinInput {
    /// The name of the input bit in the source; each writer adapts it to its language.
    pub name: String,
    /// The meaning of the bit.
    pub role: PinRole,
    /// Source location, comment and tags.
    pub meta: Meta,
}

/// The meaning of an input or output bit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum PinRole {
    /// Bit `bit` (0 is the least significant) of the net's input; offset binary from its lower bound.
    Input(crate::net::InputId, u32),
    /// `dt`: a pulse of one clock period that marks a tick.
    Tick,
    /// Synchronous reset, if the target has one.
    Reset,
    /// Bit `bit` of the net's output.
    Output(crate::net::OutputId, u32),
    /// The `busy` output: the reaction is still running (semantics.md §9).
    Busy,
    /// The fault flag.
    Fault,
    /// Unknown: the text from which the circuit was read does not specify the meaning.
    Unknown,
}

/// A D flip-flop.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Flop {
    /// The name of the flip-flop in the source: that of a step, or of a variable with the number of the bit.
    pub name: String,
    /// Value after power-up or reset.
    pub init: bool,
    /// The D function of the flip-flop.
    pub next: NodeId,
    /// The bit of the net's state that the flip-flop stores, if known.
    pub holds: Option<FlopBit>,
    /// Source location, comment and tags of the object that the bit belongs to.
    pub meta: Meta,
}

/// The bit of state that a [`Flop`] stores.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct FlopBit {
    /// The object of the net.
    pub origin: Origin,
    /// The element of an array; 0 for a plain value.
    pub element: u32,
    /// The bit of the offset binary code, 0 the least significant.
    pub bit: u32,
    /// True if the flip-flop stores the complement.
    pub inverted: bool,
}

/// How a circuit represents active steps. For each step, these are the bits that are all set while the step is active, as [`Origin::Step`] or
/// [`Origin::Region`]; `None` if no bits represent it. `is_held` returns whether the circuit has a bit.
///
/// A step has its own bit; or it has a bit in the register of its region and is active if its parent is also active; or it is a region of a parallel state
/// and has no bit, because it is active whenever its parent is.
#[must_use]
pub fn shown_by(net: &Net, is_held: impl Fn(Origin) -> bool) -> IdMap<Step, Vec<Origin>> {
    let mut shown: IdMap<Step, Vec<Origin>> = IdMap::filled(&net.steps, Vec::new());
    // Parents are declared before children.
    for (id, step) in net.steps.iter() {
        if is_held(Origin::Step(id)) {
            shown[id] = vec![Origin::Step(id)];
            continue;
        }
        let Some(parent) = step.parent.filter(|parent| parent.index() < id.index()) else {
            continue;
        };
        let own = is_held(Origin::Region(id)).then_some(Origin::Region(id));
        let follows = net.steps[parent].kind == StepKind::Parallel;
        if !shown[parent].is_empty() && (own.is_some() || follows) {
            shown[id] = own.into_iter().chain(shown[parent].iter().copied()).collect();
        }
    }
    shown
}

/// An output bit.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PinOutput {
    /// The name of the output bit in the source.
    pub name: String,
    /// The meaning of the bit.
    pub role: PinRole,
    /// The function of the output, over the inputs and flip-flops. For a registered output this is the D function of its flip-flop.
    pub value: NodeId,
    /// For an output that is driven by a flip-flop of its own, with `value` as D: the value of that flip-flop after power-up or reset.
    pub registered: Option<bool>,
    /// True if the output is a function of the situation before the clock edge: the pin is sampled just before the edge (`mealy`, semantics.md §3.6).
    pub mealy: bool,
    /// Source location, comment and tags.
    pub meta: Meta,
}

/// An intermediate function with a name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Wire {
    /// The name of the wire in the source.
    pub name: String,
    /// The function.
    pub node: NodeId,
    /// Source location, comment and tags of the object that the wire represents.
    pub meta: Meta,
}

/// A Boolean function.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Node {
    /// A constant.
    Const(bool),
    /// An input bit.
    Input(PinInputId),
    /// The present value of a flip-flop.
    Flop(FlopId),
    /// Negation.
    Not(NodeId),
    /// Conjunction; no operands: true.
    And(Vec<NodeId>),
    /// Disjunction; no operands: false.
    Or(Vec<NodeId>),
    /// Exclusive or.
    Xor(NodeId, NodeId),
    /// The second operand if the first is true, otherwise the third.
    Mux(NodeId, NodeId, NodeId),
}
