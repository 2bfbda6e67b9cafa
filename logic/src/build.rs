//! Construction of [`Logic`]: nodes are simplified and shared when they are made, and the finished circuit contains no unused nodes.

use grafsynth_ir::arena::{Arena, Id, IdMap};
use grafsynth_ir::logic::{Flop, FlopId, Logic, Node, NodeId, PinInput, PinInputId};

/// Builds the nodes of one [`Logic`].
///
/// Each function is made once: equal nodes get equal ids, and constants, double negations, repeated and contradictory operands are removed. Operands of `And`
/// and `Or` are in ascending order, so their order in the source does not matter.
///
/// ```
/// use grafsynth_logic::build::Builder;
/// let mut builder = Builder::default();
/// let a = builder.input_named("a");
/// let b = builder.input_named("b");
/// let not_a = builder.not(a);
/// assert_eq!(builder.and([a, b, not_a]), builder.constant(false));
/// ```
#[derive(Debug, Clone, Default)]
pub struct Builder {
    /// The circuit so far. Clients add inputs, flip-flops, outputs, wires and constraints themselves; only the methods of this type add nodes.
    pub logic: Logic,
    /// Open addressing over the nodes: index plus 1, or 0 for an empty entry.
    table: Vec<u32>,
    /// The number of nodes of the circuit that are in the table.
    known: usize,
}

impl Builder {
    /// Continues with a circuit whose nodes were not made by this builder.
    #[must_use]
    pub fn resume(logic: Logic) -> Self {
        let mut builder = Builder { logic, table: Vec::new(), known: 0 };
        builder.grow();
        builder
    }

    fn make(&mut self, node: Node) -> NodeId {
        if self.known * 2 >= self.table.len() {
            self.grow();
        }
        let place = match self.find(&node) {
            Ok(id) => return id,
            Err(place) => place,
        };
        let id = self.logic.nodes.push(node);
        self.table[place] = u32::try_from(id.index() + 1).unwrap_or(0);
        self.known += 1;
        id
    }

    /// The node, or the empty entry where it belongs.
    fn find(&self, node: &Node) -> Result<NodeId, usize> {
        let mask = self.table.len() - 1;
        let mut place = hash(node) as usize & mask;
        loop {
            let Some(index) = (self.table[place] as usize).checked_sub(1) else {
                return Err(place);
            };
            let id = NodeId::from_index(index);
            if self.logic.nodes[id] == *node {
                return Ok(id);
            }
            place = (place + 1) & mask;
        }
    }

    /// Makes the table twice as large as the nodes need, and enters them all again.
    fn grow(&mut self) {
        let size = (self.logic.nodes.len() * 4).next_power_of_two().max(64);
        self.table.clear();
        self.table.resize(size, 0);
        self.known = 0;
        for id in self.logic.nodes.ids() {
            if let Err(place) = self.find(&self.logic.nodes[id]) {
                self.table[place] = u32::try_from(id.index() + 1).unwrap_or(0);
                self.known += 1;
            }
        }
    }

    /// `false` or `true`.
    pub fn constant(&mut self, value: bool) -> NodeId {
        self.make(Node::Const(value))
    }

    /// The value of an input bit.
    pub fn input(&mut self, input: PinInputId) -> NodeId {
        self.make(Node::Input(input))
    }

    /// Adds an input bit with this name and unknown role; returns its value.
    pub fn input_named(&mut self, name: &str) -> NodeId {
        let role = grafsynth_ir::logic::PinRole::Unknown;
        let input = self.logic.inputs.push(PinInput {
            name: name.to_owned(),
            role,
            meta: Default::default(),
        });
        self.input(input)
    }

    /// The current value of a flip-flop.
    pub fn flop(&mut self, flop: FlopId) -> NodeId {
        self.make(Node::Flop(flop))
    }

    /// Adds a flip-flop and returns it with its current value. The D function is set later; until then the flip-flop keeps its value.
    pub fn flop_named(&mut self, name: &str, init: bool) -> (FlopId, NodeId) {
        let id = Id::from_index(self.logic.flops.len());
        let value = self.flop(id);
        self.logic.flops.push(Flop {
            name: name.to_owned(),
            init,
            next: value,
            holds: None,
            meta: Default::default(),
        });
        (id, value)
    }

    /// The value of a node that is a constant.
    #[must_use]
    pub fn as_constant(&self, node: NodeId) -> Option<bool> {
        match self.logic.nodes[node] {
            Node::Const(value) => Some(value),
            _ => None,
        }
    }

    /// Negation.
    pub fn not(&mut self, a: NodeId) -> NodeId {
        match self.logic.nodes[a] {
            Node::Const(value) => self.constant(!value),
            Node::Not(inner) => inner,
            _ => self.make(Node::Not(a)),
        }
    }

    /// Conjunction of any number of operands.
    pub fn and(&mut self, operands: impl IntoIterator<Item = NodeId>) -> NodeId {
        self.junction(operands.into_iter().collect(), true)
    }

    /// Disjunction of any number of operands.
    pub fn or(&mut self, operands: impl IntoIterator<Item = NodeId>) -> NodeId {
        self.junction(operands.into_iter().collect(), false)
    }

    fn junction(&mut self, mut operands: Vec<NodeId>, is_and: bool) -> NodeId {
        operands.sort_unstable();
        operands.dedup();
        let mut kept = Vec::with_capacity(operands.len());
        for &operand in &operands {
            match self.logic.nodes[operand] {
                Node::Const(value) if value == is_and => {}
                Node::Const(_) => return operand,
                Node::Not(inner) if operands.binary_search(&inner).is_ok() => {
                    return self.constant(!is_and);
                }
                _ => {
                    kept.push(operand);
                }
            }
        }
        match kept[..] {
            [] => self.constant(is_and),
            [only] => only,
            _ if is_and => self.make(Node::And(kept)),
            _ => self.make(Node::Or(kept)),
        }
    }

    /// Exclusive disjunction.
    pub fn xor(&mut self, a: NodeId, b: NodeId) -> NodeId {
        if a == b {
            return self.constant(false);
        }
        match (self.as_constant(a), self.as_constant(b)) {
            (Some(value), _) => return if value { self.not(b) } else { b },
            (_, Some(value)) => return if value { self.not(a) } else { a },
            (None, None) => {}
        }
        let (bare_a, flip_a) = self.strip(a);
        let (bare_b, flip_b) = self.strip(b);
        if bare_a == bare_b {
            return self.constant(flip_a != flip_b);
        }
        let node = self.make(Node::Xor(bare_a.min(bare_b), bare_a.max(bare_b)));
        if flip_a == flip_b { node } else { self.not(node) }
    }

    /// Equivalence: true if both operands are equal.
    pub fn iff(&mut self, a: NodeId, b: NodeId) -> NodeId {
        let differ = self.xor(a, b);
        self.not(differ)
    }

    /// A node whose operands are nodes of this circuit, simplified.
    pub fn put(&mut self, node: Node) -> NodeId {
        match node {
            Node::Const(value) => self.constant(value),
            Node::Input(input) => self.input(input),
            Node::Flop(flop) => self.flop(flop),
            Node::Not(a) => self.not(a),
            Node::And(all) => self.and(all),
            Node::Or(all) => self.or(all),
            Node::Xor(a, b) => self.xor(a, b),
            Node::Mux(condition, then, otherwise) => self.mux(condition, then, otherwise),
        }
    }

    /// `then` if `condition` is true, else `otherwise`.
    pub fn mux(&mut self, condition: NodeId, then: NodeId, otherwise: NodeId) -> NodeId {
        if then == otherwise {
            return then;
        }
        let (bare, flipped) = self.strip(condition);
        if flipped {
            return self.mux(bare, otherwise, then);
        }
        if let Some(value) = self.as_constant(condition) {
            return if value { then } else { otherwise };
        }
        match (self.as_constant(then), self.as_constant(otherwise)) {
            (Some(true), _) => return self.or([condition, otherwise]),
            (Some(false), _) => {
                let not = self.not(condition);
                return self.and([not, otherwise]);
            }
            (_, Some(true)) => {
                let not = self.not(condition);
                return self.or([not, then]);
            }
            (_, Some(false)) => return self.and([condition, then]),
            (None, None) => {}
        }
        let (bare_then, flip_then) = self.strip(then);
        let (bare_otherwise, flip_otherwise) = self.strip(otherwise);
        if bare_then == bare_otherwise && flip_then != flip_otherwise {
            return self.xor(condition, otherwise);
        }
        if then == condition {
            return self.or([condition, otherwise]);
        }
        if otherwise == condition {
            return self.and([condition, then]);
        }
        self.make(Node::Mux(condition, then, otherwise))
    }

    /// The node without a negation on top, and true if a negation was removed.
    #[must_use]
    pub fn strip(&self, node: NodeId) -> (NodeId, bool) {
        match self.logic.nodes[node] {
            Node::Not(inner) => (inner, true),
            _ => (node, false),
        }
    }

    /// The circuit without unused nodes. A wire is kept only if something else uses its node.
    #[must_use]
    pub fn finish(self) -> Logic {
        prune(self.logic)
    }
}

/// A hash of a node that is the same on all machines (FNV-1a over the node's kind and operands, followed by a multiplication).
fn hash(node: &Node) -> u32 {
    let mut hash = 0xcbf2_9ce4_8422_2325u64;
    let mut add = |value: usize| hash = (hash ^ value as u64).wrapping_mul(0x0000_0100_0000_01b3);
    match node {
        Node::Const(value) => add(usize::from(*value)),
        Node::Input(input) => [2, input.index()].into_iter().for_each(add),
        Node::Flop(flop) => [3, flop.index()].into_iter().for_each(add),
        Node::Not(a) => [4, a.index()].into_iter().for_each(add),
        Node::And(all) => std::iter::once(5).chain(all.iter().map(|a| a.index())).for_each(add),
        Node::Or(all) => std::iter::once(6).chain(all.iter().map(|a| a.index())).for_each(add),
        Node::Xor(a, b) => [7, a.index(), b.index()].into_iter().for_each(add),
        Node::Mux(a, b, c) => [8, a.index(), b.index(), c.index()].into_iter().for_each(add),
    }
    (hash.wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 32) as u32
}

/// Calls `visit` on each operand of a node.
pub fn for_each_operand(node: &Node, mut visit: impl FnMut(NodeId)) {
    match node {
        Node::Const(_) | Node::Input(_) | Node::Flop(_) => {}
        Node::Not(a) => visit(*a),
        Node::And(all) | Node::Or(all) => all.iter().copied().for_each(visit),
        Node::Xor(a, b) => [*a, *b].into_iter().for_each(visit),
        Node::Mux(a, b, c) => [*a, *b, *c].into_iter().for_each(visit),
    }
}

/// The node with each operand replaced.
#[must_use]
pub fn map_operands(node: &Node, map: impl Fn(NodeId) -> NodeId) -> Node {
    match node {
        Node::Const(_) | Node::Input(_) | Node::Flop(_) => node.clone(),
        Node::Not(a) => Node::Not(map(*a)),
        Node::And(all) => Node::And(all.iter().map(|&a| map(a)).collect()),
        Node::Or(all) => Node::Or(all.iter().map(|&a| map(a)).collect()),
        Node::Xor(a, b) => Node::Xor(map(*a), map(*b)),
        Node::Mux(a, b, c) => Node::Mux(map(*a), map(*b), map(*c)),
    }
}

/// The roots of a circuit: the D functions, the outputs, the constraints, the decoded bits, and the conditions of open functions.
pub fn roots(logic: &Logic) -> impl Iterator<Item = NodeId> + '_ {
    let flops = logic.flops.values().map(|flop| flop.next);
    let outputs = logic.outputs.values().map(|output| output.value);
    let decoded = logic.decoded.iter().map(|bit| bit.node);
    let constraints = logic.never.iter().chain(&logic.unreachable).copied();
    let open = logic.open.iter().map(|open| open.when);
    flops.chain(outputs).chain(constraints).chain(decoded).chain(open)
}

/// Marks the nodes that some root needs.
#[must_use]
pub fn needed(logic: &Logic, roots: impl IntoIterator<Item = NodeId>) -> IdMap<Node, bool> {
    let mut needed = IdMap::filled(&logic.nodes, false);
    for root in roots {
        needed[root] = true;
    }
    // An operand comes before its node, so one backward pass marks all.
    for (id, node) in logic.nodes.iter().rev() {
        if needed[id] {
            for_each_operand(node, |operand| needed[operand] = true);
        }
    }
    needed
}

/// The circuit without unused nodes and wires.
#[must_use]
pub fn prune(mut logic: Logic) -> Logic {
    let keep = needed(&logic, roots(&logic));
    let mut moved: IdMap<Node, Option<NodeId>> = IdMap::filled(&logic.nodes, None);
    let mut nodes = Arena::new();
    let image = |moved: &IdMap<Node, Option<NodeId>>, id: NodeId| match moved[id] {
        Some(new) => new,
        None => unreachable!("what a kept node needs is kept"),
    };
    for (id, node) in logic.nodes.iter() {
        if keep[id] {
            let node = map_operands(node, |operand| image(&moved, operand));
            moved[id] = Some(nodes.push(node));
        }
    }
    for (_, flop) in logic.flops.iter_mut() {
        flop.next = image(&moved, flop.next);
    }
    for (_, output) in logic.outputs.iter_mut() {
        output.value = image(&moved, output.value);
    }
    for never in logic.never.iter_mut().chain(&mut logic.unreachable) {
        *never = image(&moved, *never);
    }
    for bit in &mut logic.decoded {
        bit.node = image(&moved, bit.node);
    }
    for open in &mut logic.open {
        open.when = image(&moved, open.when);
    }
    logic.wires.retain_mut(|wire| match moved[wire.node] {
        Some(new) => {
            wire.node = new;
            true
        }
        None => false,
    });
    logic.nodes = nodes;
    logic
}

/// The circuit without the inputs that are never read.
#[must_use]
pub fn without_unread_inputs(logic: Logic) -> Logic {
    let mut logic = prune(logic);
    let mut is_read: IdMap<PinInput, bool> = IdMap::filled(&logic.inputs, false);
    for node in logic.nodes.values() {
        if let Node::Input(input) = node {
            is_read[*input] = true;
        }
    }
    let mut inputs = Arena::new();
    let mut moved: IdMap<PinInput, Option<PinInputId>> = IdMap::filled(&logic.inputs, None);
    for (id, input) in logic.inputs.iter().filter(|(id, _)| is_read[*id]) {
        moved[id] = Some(inputs.push(input.clone()));
    }
    for (_, node) in logic.nodes.iter_mut() {
        if let Node::Input(input) = node
            && let Some(new) = moved[*input]
        {
            *input = new;
        }
    }
    logic.inputs = inputs;
    logic
}

#[cfg(test)]
mod tests {
    use super::Builder;
    use grafsynth_ir::logic::Node;

    #[test]
    fn equal_functions_are_one_node_and_trivial_ones_vanish() {
        let mut builder = Builder::default();
        let (a, b) = (builder.input_named("a"), builder.input_named("b"));
        let (yes, no) = (builder.constant(true), builder.constant(false));
        assert_eq!(builder.and([a, b, a]), builder.and([b, a, yes]));
        assert_eq!(builder.or([a, no]), a);
        let not_a = builder.not(a);
        assert_eq!(builder.not(not_a), a);
        assert_eq!(builder.or([b, a, not_a]), yes);
        assert_eq!(builder.xor(a, not_a), yes);
        let not_b = builder.not(b);
        assert_eq!(builder.xor(not_a, not_b), builder.xor(b, a));
        assert_eq!(builder.mux(a, yes, no), a);
        assert_eq!(builder.mux(a, not_b, b), builder.xor(a, b));
        assert_eq!(builder.mux(not_a, a, b), builder.and([a, b]));
    }

    #[test]
    fn inputs_that_nothing_reads_go() {
        let mut builder = Builder::default();
        let (_, b) = (builder.input_named("a"), builder.input_named("b"));
        let (flop, _) = builder.flop_named("q", false);
        builder.logic.flops[flop].next = b;
        let logic = super::without_unread_inputs(builder.finish());
        let names: Vec<&str> = logic.inputs.values().map(|input| input.name.as_str()).collect();
        assert_eq!(names, ["b"]);
        let only = logic.inputs.ids().next().expect("an input");
        assert_eq!(logic.nodes[logic.flops[flop].next], Node::Input(only));
    }

    #[test]
    fn finishing_drops_what_nothing_needs() {
        let mut builder = Builder::default();
        let (a, b) = (builder.input_named("a"), builder.input_named("b"));
        let unused = builder.or([a, b]);
        let product = builder.and([a, b]);
        let (flop, _) = builder.flop_named("q", false);
        builder.logic.flops[flop].next = product;
        let wire = |name: &str, node| grafsynth_ir::logic::Wire {
            name: name.into(),
            node,
            meta: Default::default(),
        };
        builder.logic.wires = vec![wire("kept", product), wire("gone", unused)];
        let logic = builder.finish();
        assert_eq!(logic.wires.len(), 1);
        assert_eq!(logic.nodes.len(), 3);
        assert!(
            matches!(&logic.nodes[logic.flops[flop].next], Node::And(operands) if operands.len() == 2)
        );
    }
}
