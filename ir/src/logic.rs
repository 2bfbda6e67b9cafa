//! Logic: what a chip is. One next-state function for each flip-flop and one function for each output pin.
//!
//! Functions are nodes of one shared graph; a node names only earlier nodes, so there is no combinational loop. The encodings produce it, the
//! equation writers and the minimiser read it, and every reader of equations gives it back.

use crate::arena::{Arena, Id, IdMap};
use crate::net::{Meta, Net, Step, StepKind};
use crate::program::Origin;
use crate::span::Name;

/// Names a node.
pub type NodeId = Id<Node>;
/// Names a flip-flop.
pub type FlopId = Id<Flop>;
/// Names an input pin.
pub type PinInputId = Id<PinInput>;
/// Names an output pin.
pub type PinOutputId = Id<PinOutput>;

/// One synchronous circuit with a single clock.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Logic {
    /// The design's name.
    pub name: Name,
    /// Input bits other than the clock.
    pub inputs: Arena<PinInput>,
    /// D flip-flops.
    pub flops: Arena<Flop>,
    /// Output bits.
    pub outputs: Arena<PinOutput>,
    /// The functions.
    pub nodes: Arena<Node>,
    /// Functions in between that have a name in the source, such as the firing of a transition. Writers of multi-level languages print them
    /// as wires; the functions above do not depend on this list.
    pub wires: Vec<Wire>,
    /// Constraints on the inputs that the environment guarantees: each node is never true. Don't-cares for the minimiser.
    pub never: Vec<NodeId>,
    /// Constraints on the flip-flops: each node is never true in a state that is reached from power-up. Don't-cares too, of the circuit itself.
    pub unreachable: Vec<NodeId>,
    /// Bits of the net's state that no flip-flop holds by itself, as functions of the flip-flops: steps that share a code.
    pub decoded: Vec<Decoded>,
    /// Where single functions may be anything, because the designer left their value open (semantics.md §3.6). Don't-cares of these functions alone.
    pub open: Vec<Open>,
}

impl Logic {
    /// The conditions under which this function may be anything.
    pub fn open_where(&self, function: Function) -> impl Iterator<Item = NodeId> + '_ {
        self.open.iter().filter(move |open| open.of == function).map(|open| open.when)
    }
}

/// One of the functions that a circuit must give.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Function {
    /// The D function of a flip-flop.
    Next(FlopId),
    /// The value of an output: of a `mealy` one, or of one that is clocked.
    Output(PinOutputId),
}

/// A function whose value was left open somewhere.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Open {
    /// The function.
    pub of: Function,
    /// Over the inputs and the flip-flops before the clock: where it may be anything.
    pub when: NodeId,
}

/// A bit of state as a function of the flip-flops.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Decoded {
    /// Its name in the source.
    pub name: String,
    /// The bit; never inverted.
    pub holds: FlopBit,
    /// The function.
    pub node: NodeId,
}

/// An input bit.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PinInput {
    /// Its name in the source; writers make it fit their language.
    pub name: String,
    /// What it carries.
    pub role: PinRole,
    /// Place, comment and tags.
    pub meta: Meta,
}

/// What an input or output bit carries.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum PinRole {
    /// Bit `bit` (0 is the least significant) of the net's input; offset binary from its lower bound.
    Input(crate::net::InputId, u32),
    /// `dt`: one clock wide, a tick has passed.
    Tick,
    /// Synchronous reset where the target wants one.
    Reset,
    /// Bit of a net's output.
    Output(crate::net::OutputId, u32),
    /// The reaction still runs (semantics.md §9).
    Busy,
    /// The fault flag.
    Fault,
    /// Read from a text that does not say.
    Unknown,
}

/// A D flip-flop.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Flop {
    /// Its name in the source: a step's name, or a variable's with the bit.
    pub name: String,
    /// Value after power-up or reset.
    pub init: bool,
    /// Its D function.
    pub next: NodeId,
    /// What of the net's state it holds, if it is known.
    pub holds: Option<FlopBit>,
    /// Place, comment and tags of what it holds.
    pub meta: Meta,
}

/// The bit of state that a [`Flop`] holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct FlopBit {
    /// What of the net.
    pub origin: Origin,
    /// The element of an array; 0 for a plain value.
    pub element: u32,
    /// The bit of the offset binary code, 0 the least significant.
    pub bit: u32,
    /// The flip-flop holds the complement.
    pub inverted: bool,
}

/// How a circuit shows which steps are active: of each step the bits that are all set while it is, as [`Origin::Step`] or [`Origin::Region`]; none where
/// nothing shows it. `is_held` says which bits the circuit has.
///
/// A step has a bit of its own; or a bit in the register of its region, and is active where its parent is too; or, if it is a region of a parallel state,
/// no bit at all, for it is active when its parent is.
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
    /// Its name in the source.
    pub name: String,
    /// What it carries.
    pub role: PinRole,
    /// Its function of inputs and flip-flops. For a registered output this is the function that is clocked, and `init` its first value.
    pub value: NodeId,
    /// Driven by a flip-flop of its own that has `value` as D.
    pub registered: Option<bool>,
    /// A function of the situation before the clock: the pin is sampled just before it (`mealy`, semantics.md §3.6).
    pub mealy: bool,
    /// Place, comment and tags.
    pub meta: Meta,
}

/// A function in between that has a name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Wire {
    /// Its name in the source.
    pub name: String,
    /// The function.
    pub node: NodeId,
    /// Place, comment and tags of what it stands for.
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
    /// The second if the first, else the third.
    Mux(NodeId, NodeId, NodeId),
}
