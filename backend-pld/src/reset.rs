//! Removes a reset input, which a text has in addition to its circuit, from the circuit that was read back.
//!
//! The chart has no reset: it starts in its initial situation. [`strip`] first checks that with the reset high every register gets its initial value
//! regardless of everything else, and returns the circuit in which the reset is always low: that circuit is proved equal to the chart.

use crate::codes;
use grafsynth_ir::arena::{Arena, IdMap};
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::logic::{Logic, Node, NodeId, PinInput, PinInputId, PinRole};
use grafsynth_logic::build::{Builder, map_operands};

/// The circuit without its reset inputs.
///
/// # Errors
/// If there are registers that the reset does not set to their initial value.
pub fn strip(logic: Logic) -> Result<Logic, Vec<Diagnostic>> {
    let is_reset = |id: PinInputId| logic.inputs[id].role == PinRole::Reset;
    let Some(reset) = logic.inputs.ids().find(|&id| is_reset(id)) else { return Ok(logic) };
    let name = &logic.inputs[reset].name;
    let held = with_reset(&logic, true);
    let is_kept = |next: NodeId, init: bool| held.nodes[next] != Node::Const(init);
    let flops = logic.flops.iter().zip(held.flops.values());
    let flops = flops.filter(|((_, old), new)| is_kept(new.next, old.init));
    let outputs = logic
        .outputs
        .values()
        .zip(held.outputs.values())
        .filter(|(old, new)| old.registered.is_some_and(|init| is_kept(new.value, init)));
    let names = flops.map(|((_, flop), _)| &flop.name).chain(outputs.map(|(pin, _)| &pin.name));
    let findings: Vec<Diagnostic> = names
        .map(|register| {
            let message =
                format!("`{register}` does not get its initial value while `{name}` is high");
            Diagnostic::error(codes::NOT_READ_BACK, message)
                .help("this is a bug in grafsynth: please report it with the chart")
        })
        .collect();
    if findings.is_empty() { Ok(with_reset(&logic, false)) } else { Err(findings) }
}

/// The circuit with every reset set to a constant.
fn with_reset(logic: &Logic, value: bool) -> Logic {
    let mut inputs = Arena::new();
    let mut moved: IdMap<PinInput, Option<PinInputId>> = IdMap::filled(&logic.inputs, None);
    for (id, input) in logic.inputs.iter() {
        if input.role != PinRole::Reset {
            moved[id] = Some(inputs.push(input.clone()));
        }
    }
    let mut builder = Builder::default();
    builder.logic.name = logic.name.clone();
    builder.logic.inputs = inputs;
    let mut image: IdMap<Node, Option<NodeId>> = IdMap::filled(&logic.nodes, None);
    for (id, node) in logic.nodes.iter() {
        let of = |id: NodeId| match image[id] {
            Some(new) => new,
            None => unreachable!("an operand precedes its node"),
        };
        let made = match node {
            Node::Input(input) => match moved[*input] {
                Some(input) => builder.input(input),
                None => builder.constant(value),
            },
            _ => builder.put(map_operands(node, of)),
        };
        image[id] = Some(made);
    }
    let of = |id: NodeId| match image[id] {
        Some(new) => new,
        None => unreachable!("every node has an image"),
    };
    for flop in logic.flops.values() {
        let next = of(flop.next);
        builder.logic.flops.push(grafsynth_ir::logic::Flop { next, ..flop.clone() });
    }
    for output in logic.outputs.values() {
        let value = of(output.value);
        builder.logic.outputs.push(grafsynth_ir::logic::PinOutput { value, ..output.clone() });
    }
    let wires = logic.wires.iter();
    builder.logic.wires = wires
        .map(|wire| grafsynth_ir::logic::Wire { node: of(wire.node), ..wire.clone() })
        .collect();
    builder.logic.never = logic.never.iter().map(|&node| of(node)).collect();
    builder.finish()
}
