//! Restores the roles of a circuit that was read.

use crate::codes;
use crate::{Dialect, Emitted, Object};
use grafsynth_ir::Gather;
use grafsynth_ir::arena::{Arena, Id, IdMap};
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::logic::{FlopId, Logic, Node, NodeId, PinInput, PinOutput, PinRole};
use grafsynth_logic::build::{Builder, map_operands, prune};
use std::collections::BTreeMap;

/// Gives a circuit that was read back the roles of the circuit that was written. By name, each input, flip-flop and output becomes the original object, in the
/// original order, with label, tags and location. The functions and power-up values of the text are kept. A pin of the text that was not written keeps an
/// unknown role.
///
/// Returns a finding for each signal that is missing; the circuit is then incomplete and proves nothing.
#[must_use]
pub fn rebind(logic: &mut Logic, emitted: &Emitted) -> Vec<Diagnostic> {
    let mut findings = Vec::new();
    let read = std::mem::take(logic);
    let folds_case = match emitted.dialect {
        Dialect::Palasm => true,
        Dialect::Cupl | Dialect::Galasm | Dialect::Verilog | Dialect::Blif => false,
    };
    let key = |name: &str| if folds_case { name.to_ascii_lowercase() } else { name.to_owned() };
    let find_inputs: BTreeMap<String, _> =
        read.inputs.iter().map(|(id, input)| (key(&input.name), id)).gather();
    let find_flops: BTreeMap<String, FlopId> =
        read.flops.iter().map(|(id, flop)| (key(&flop.name), id)).gather();
    let find_outputs: BTreeMap<String, _> =
        read.outputs.iter().map(|(id, output)| (key(&output.name), id)).gather();
    let mut missing = |name: &str| {
        let message = format!("`{name}` was written but is missing in the text that was read back");
        findings.push(
            Diagnostic::error(codes::NOT_READ_BACK, message)
                .help("this is a bug in grafsynth: please report it with the chart"),
        );
    };

    let mut new = Logic { name: read.name.clone(), ..Logic::default() };
    let mut input_image: IdMap<PinInput, Option<Id<PinInput>>> = IdMap::filled(&read.inputs, None);
    let mut flop_image: IdMap<_, Option<FlopId>> = IdMap::filled(&read.flops, None);
    let mut outputs: Vec<(PinOutput, Option<FlopId>)> = Vec::new();
    let mut complements: Vec<FlopId> = Vec::new();
    let mut is_claimed: IdMap<PinOutput, bool> = IdMap::filled(&read.outputs, false);
    for named in &emitted.names {
        let name = key(&named.name);
        match &named.object {
            Object::Clock => {}
            // If the buried node has a pin, the text shows it there; the circuit has no such output.
            Object::Buried => {
                if let Some(&pin) = find_outputs.get(&name) {
                    is_claimed[pin] = true;
                }
            }
            Object::Reset | Object::Input(_) => match find_inputs.get(&name) {
                Some(&id) => {
                    let input = match &named.object {
                        Object::Input(input) => input.clone(),
                        _ => PinInput {
                            name: named.name.clone(),
                            role: PinRole::Reset,
                            meta: Default::default(),
                        },
                    };
                    input_image[id] = Some(new.inputs.push(input));
                }
                None => missing(&named.name),
            },
            Object::Flop(flop) => match find_flops.get(&name) {
                Some(&id) => {
                    let own = &read.flops[id];
                    let mut flop = flop.clone();
                    flop.init = own.init;
                    flop.next = own.next;
                    let image = new.flops.push(flop);
                    flop_image[id] = Some(image);
                    complements.extend(named.is_complement.then_some(image));
                    // The text shows the flip-flop on a pin; the circuit has no such output.
                    if let Some(&pin) = find_outputs.get(&name) {
                        is_claimed[pin] = true;
                    }
                }
                None => missing(&named.name),
            },
            Object::Output(output) => match find_outputs.get(&name) {
                Some(&id) => {
                    is_claimed[id] = true;
                    let mut output = output.clone();
                    output.value = read.outputs[id].value;
                    outputs.push((output, find_flops.get(&name).copied()));
                }
                None => missing(&named.name),
            },
        }
    }
    // Registers of outputs have no state flip-flop, unless something reads them.
    let mut is_read: IdMap<_, bool> = IdMap::filled(&read.flops, false);
    let nodes_in_use =
        grafsynth_logic::build::needed(&read, read.flops.values().map(|flop| flop.next));
    for (id, node) in read.nodes.iter() {
        if let (true, Node::Flop(flop)) = (nodes_in_use[id], node) {
            is_read[*flop] = true;
        }
    }
    for (mut output, register) in outputs {
        output.registered = None;
        if let Some(id) = register.filter(|&id| flop_image[id].is_none() && !is_read[id]) {
            let flop = &read.flops[id];
            output.registered = Some(flop.init);
            output.value = flop.next;
        }
        new.outputs.push(output);
    }
    // Objects that were not written stay.
    for (id, input) in read.inputs.iter() {
        if input_image[id].is_none() {
            input_image[id] = Some(new.inputs.push(input.clone()));
        }
    }
    let registers_of_outputs: std::collections::BTreeSet<String> = emitted
        .names
        .iter()
        .filter(
            |named| matches!(&named.object, Object::Output(output) if output.registered.is_some()),
        )
        .map(|named| key(&named.name))
        .gather();
    for (id, flop) in read.flops.iter() {
        let is_output = registers_of_outputs.contains(&key(&flop.name)) && !is_read[id];
        if flop_image[id].is_none() && !is_output {
            flop_image[id] = Some(new.flops.push(flop.clone()));
        }
    }
    for (id, output) in read.outputs.iter() {
        if !is_claimed[id] {
            new.outputs.push(output.clone());
        }
    }
    new.nodes = renumbered(&read, &input_image, &flop_image);
    new.wires = read.wires;
    *logic = prune(if complements.is_empty() { new } else { complemented(new, &complements) });
    findings
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
    flops: &IdMap<grafsynth_ir::logic::Flop, Option<FlopId>>,
) -> Arena<Node> {
    let image = |node: &Node| match node {
        Node::Input(input) => inputs[*input].map_or(Node::Const(false), Node::Input),
        Node::Flop(flop) => flops[*flop].map_or(Node::Const(false), Node::Flop),
        _ => map_operands(node, |operand: NodeId| operand),
    };
    read.nodes.values().map(image).collect()
}
