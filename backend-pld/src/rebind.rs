//! Restores the roles of a circuit that was read.

use crate::codes;
use crate::{Dialect, Emitted, Named, Object};
use grafsynth_ir::Gather;
use grafsynth_ir::arena::{Arena, Id, IdMap};
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::logic::{Flop, FlopId, Logic, Node, NodeId, PinInput, PinOutput, PinRole};
use grafsynth_logic::build::{Builder, map_operands, needed, prune};
use std::collections::{BTreeMap, BTreeSet};

/// Gives a circuit that was read back the roles of the circuit that was written. By name, each input, flip-flop and output becomes the original object, in the
/// original order, with label, tags and location. The functions and power-up values of the text are kept. A pin of the text that was not written keeps an
/// unknown role.
///
/// Returns a finding for each signal that is missing; the circuit is then incomplete and proves nothing.
#[must_use]
pub fn rebind(logic: &mut Logic, emitted: &Emitted) -> Vec<Diagnostic> {
    let read = std::mem::take(logic);
    let mut images = Images::new(&read, emitted.dialect);
    let missing: Vec<&Named> = emitted.names.iter().filter(|named| !images.claim(named)).collect();
    images.add_outputs();
    images.add_unwritten(emitted);
    let Images { mut new, inputs, flops, complements, .. } = images;
    new.nodes = renumbered(&read, &inputs, &flops);
    new.name = read.name;
    new.wires = read.wires;
    *logic = prune(if complements.is_empty() { new } else { complemented(new, &complements) });
    let finding = |Named { name, .. }: &Named| {
        let message = format!("`{name}` was written but is missing in the text that was read back");
        Diagnostic::error(codes::NOT_READ_BACK, message)
            .help("this is a bug in grafsynth: please report it with the chart")
    };
    missing.into_iter().map(finding).collect()
}

/// Objects of a circuit by name.
type ByName<T> = BTreeMap<String, Id<T>>;

/// The circuit that was read, the new circuit, and what became of each object.
struct Images<'a> {
    read: &'a Logic,
    folds_case: bool,
    by_name: (ByName<PinInput>, ByName<Flop>, ByName<PinOutput>),
    new: Logic,
    inputs: IdMap<PinInput, Option<Id<PinInput>>>,
    flops: IdMap<Flop, Option<FlopId>>,
    /// The written outputs, each with the flip-flop of the same name, which may be its register.
    outputs: Vec<(PinOutput, Option<FlopId>)>,
    /// The new flip-flops that the text shows complemented.
    complements: Vec<FlopId>,
    /// The outputs that were written.
    is_claimed: IdMap<PinOutput, bool>,
    /// The flip-flops that a flip-flop reads.
    is_read: IdMap<Flop, bool>,
}

impl<'a> Images<'a> {
    fn new(read: &'a Logic, dialect: Dialect) -> Self {
        let folds_case = match dialect {
            Dialect::Palasm => true,
            Dialect::Cupl | Dialect::Galasm | Dialect::Verilog | Dialect::Blif => false,
        };
        let mut is_read = IdMap::filled(&read.flops, false);
        let in_use = needed(read, read.flops.values().map(|flop| flop.next));
        for (id, node) in read.nodes.iter() {
            if let (true, Node::Flop(flop)) = (in_use[id], node) {
                is_read[*flop] = true;
            }
        }
        Images {
            read,
            folds_case,
            by_name: (
                by_name(&read.inputs, folds_case, |it| &it.name),
                by_name(&read.flops, folds_case, |it| &it.name),
                by_name(&read.outputs, folds_case, |it| &it.name),
            ),
            new: Logic::default(),
            inputs: IdMap::filled(&read.inputs, None),
            flops: IdMap::filled(&read.flops, None),
            outputs: Vec::new(),
            complements: Vec::new(),
            is_claimed: IdMap::filled(&read.outputs, false),
            is_read,
        }
    }

    /// Adds the object that was written under a name; false if the text does not contain it.
    fn claim(&mut self, named: &Named) -> bool {
        let name = key(&named.name, self.folds_case);
        let (inputs, flops, outputs) = &self.by_name;
        let (input, flop, output) = (inputs.get(&name), flops.get(&name), outputs.get(&name));
        match (&named.object, input, flop, output) {
            (Object::Clock, ..) => {}
            // If the buried node or the flip-flop has a pin, the text shows it there; the circuit has no such output.
            (Object::Buried, ..) => {
                output.into_iter().for_each(|pin| self.is_claimed[*pin] = true);
            }
            (Object::Reset, Some(&id), ..) => {
                let (name, meta) = (named.name.clone(), Default::default());
                let input = PinInput { name, role: PinRole::Reset, meta };
                self.inputs[id] = Some(self.new.inputs.push(input));
            }
            (Object::Input(input), Some(&id), ..) => {
                self.inputs[id] = Some(self.new.inputs.push(input.clone()));
            }
            (Object::Flop(flop), _, Some(&id), _) => {
                let Flop { init, next, .. } = self.read.flops[id];
                let image = self.new.flops.push(Flop { init, next, ..flop.clone() });
                self.flops[id] = Some(image);
                self.complements.extend(named.is_complement.then_some(image));
                output.into_iter().for_each(|pin| self.is_claimed[*pin] = true);
            }
            (Object::Output(output), _, register, Some(&id)) => {
                self.is_claimed[id] = true;
                let value = self.read.outputs[id].value;
                self.outputs.push((PinOutput { value, ..output.clone() }, register.copied()));
            }
            (Object::Reset | Object::Input(_) | Object::Flop(_) | Object::Output(_), ..) => {
                return false;
            }
        }
        true
    }

    /// Adds the written outputs. The register of an output has no state flip-flop, unless something reads it.
    fn add_outputs(&mut self) {
        for (mut output, register) in std::mem::take(&mut self.outputs) {
            output.registered = None;
            if let Some(id) = register.filter(|&id| self.flops[id].is_none() && !self.is_read[id]) {
                let flop = &self.read.flops[id];
                output.registered = Some(flop.init);
                output.value = flop.next;
            }
            self.new.outputs.push(output);
        }
    }

    /// Adds the objects that were not written: they stay as they are.
    fn add_unwritten(&mut self, emitted: &Emitted) {
        for (id, input) in self.read.inputs.iter() {
            self.inputs[id].get_or_insert_with(|| self.new.inputs.push(input.clone()));
        }
        let is_register = |named: &&Named| matches!(&named.object, Object::Output(output) if output.registered.is_some());
        let registers: BTreeSet<String> = (emitted.names.iter().filter(is_register))
            .map(|named| key(&named.name, self.folds_case))
            .gather();
        for (id, flop) in self.read.flops.iter() {
            if self.is_read[id] || !registers.contains(&key(&flop.name, self.folds_case)) {
                self.flops[id].get_or_insert_with(|| self.new.flops.push(flop.clone()));
            }
        }
        for (id, output) in self.read.outputs.iter() {
            if !self.is_claimed[id] {
                self.new.outputs.push(output.clone());
            }
        }
    }
}

/// The form of a name in which names are compared.
fn key(name: &str, folds_case: bool) -> String {
    if folds_case { name.to_ascii_lowercase() } else { name.to_owned() }
}

fn by_name<T>(arena: &Arena<T>, folds_case: bool, name: impl Fn(&T) -> &str) -> ByName<T> {
    arena.iter().map(|(id, it)| (key(name(it), folds_case), id)).gather()
}

/// The same circuit with these flip-flops replaced by their complements.
fn complemented(logic: Logic, flops: &[FlopId]) -> Logic {
    let mut builder = Builder::default();
    let mut images: IdMap<Node, Option<NodeId>> = IdMap::filled(&logic.nodes, None);
    for (id, node) in logic.nodes.iter() {
        // A node refers only to earlier nodes.
        let of = |operand: NodeId| images[operand].unwrap_or(operand);
        let image = builder.put(map_operands(node, of));
        let is_complement = matches!(node, Node::Flop(flop) if flops.contains(flop));
        let image = if is_complement { builder.not(image) } else { image };
        images[id] = Some(image);
    }
    let image = |node: NodeId| images[node].unwrap_or(node);
    let mut new = Logic { nodes: Arena::default(), ..logic };
    for (id, flop) in new.flops.iter_mut() {
        flop.next = image(flop.next);
        if flops.contains(&id) {
            flop.next = builder.not(flop.next);
            flop.init = !flop.init;
        }
    }
    for (_, output) in new.outputs.iter_mut() {
        output.value = image(output.value);
    }
    for wire in &mut new.wires {
        wire.node = image(wire.node);
    }
    new.nodes = builder.logic.nodes;
    new
}

/// The nodes over the new inputs and flip-flops; nothing reads a removed flip-flop.
fn renumbered(
    read: &Logic,
    inputs: &IdMap<PinInput, Option<Id<PinInput>>>,
    flops: &IdMap<Flop, Option<FlopId>>,
) -> Arena<Node> {
    let image = |node: &Node| match node {
        Node::Input(input) => inputs[*input].map_or(Node::Const(false), Node::Input),
        Node::Flop(flop) => flops[*flop].map_or(Node::Const(false), Node::Flop),
        _ => map_operands(node, |operand: NodeId| operand),
    };
    read.nodes.values().map(image).collect()
}
