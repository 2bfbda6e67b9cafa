//! A reset input, which an output has in addition to its circuit: [`add`] puts it into the functions, [`strip`] removes it from the circuit that was read back.
//!
//! The chart has no reset: it starts in its initial situation. [`strip`] first checks that with the reset high every register gets its initial value
//! regardless of everything else, and returns the circuit in which the reset is always low: that circuit is proved equal to the chart.

use crate::codes;
use grafsynth_ir::arena::{Arena, IdMap};
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::logic::{
    Flop, FlopId, Function, Logic, Node, NodeId, Open, PinInput, PinInputId, PinOutputId, PinRole,
};
use grafsynth_logic::bdd::{Bdd, Ref};
use grafsynth_logic::build::{Builder, map_operands};
use grafsynth_logic::node_bdds::Functions;
use std::collections::BTreeSet;

/// The maximum size of the decision diagrams of a circuit whose reset is checked.
const MOST_NODES: usize = 1 << 20;

/// The circuit with a reset input: while it is high, the clock sets every register to its initial value, whatever the state is. So the don't-cares of a register
/// are only those of the other clocks. A circuit whose registers never change has no such input.
#[must_use]
pub fn add(mut logic: Logic, name: &str) -> Logic {
    let changes = |next: NodeId, init: bool| logic.nodes[next] != Node::Const(init);
    let is_held = |id: FlopId, next: NodeId| logic.nodes[next] == Node::Flop(id);
    let of_outputs = logic.outputs.iter();
    let of_outputs: Vec<(PinOutputId, bool)> = of_outputs
        .filter_map(|(id, output)| Some((id, output.registered?)))
        .filter(|(id, init)| changes(logic.outputs[*id].value, *init))
        .collect();
    let flops = logic.flops.iter();
    let flops =
        flops.filter(|(id, flop)| changes(flop.next, flop.init) && !is_held(*id, flop.next));
    let flops: Vec<FlopId> = flops.map(|(id, _)| id).collect();
    if flops.is_empty() && of_outputs.is_empty() {
        return logic;
    }
    let (name, meta) = (name.to_owned(), Default::default());
    let reset = logic.inputs.push(PinInput { name, role: PinRole::Reset, meta });
    let free: Vec<NodeId> = logic.never.drain(..).chain(logic.unreachable.drain(..)).collect();
    let open = std::mem::take(&mut logic.open);
    let mut builder = Builder::resume(logic);
    let reset = builder.input(reset);
    let runs = builder.not(reset);
    let free = builder.or(free);
    let of_flops = flops.iter().map(|id| Function::Next(*id));
    let registers: BTreeSet<Function> =
        of_flops.chain(of_outputs.iter().map(|(id, _)| Function::Output(*id))).collect();
    let others = builder.logic.outputs.ids().map(Function::Output);
    let others: Vec<Function> = others.filter(|of| !registers.contains(of)).collect();
    let all = registers.iter().copied().chain(others).map(|of| Open { of, when: free });
    let all: Vec<Open> = all.chain(open).collect();
    for Open { of, when } in all {
        let when = if registers.contains(&of) { builder.and([runs, when]) } else { when };
        if builder.as_constant(when) != Some(false) {
            builder.logic.open.push(Open { of, when });
        }
    }
    let held = |builder: &mut Builder, next: NodeId, init: bool| match init {
        true => builder.or([reset, next]),
        false => builder.and([runs, next]),
    };
    for id in flops {
        let Flop { next, init, .. } = builder.logic.flops[id];
        builder.logic.flops[id].next = held(&mut builder, next, init);
    }
    for (id, init) in of_outputs {
        let value = builder.logic.outputs[id].value;
        builder.logic.outputs[id].value = held(&mut builder, value, init);
    }
    builder.finish()
}

/// The circuit without its reset inputs.
///
/// # Errors
/// If there are registers that the reset does not set to their initial value.
pub fn strip(logic: Logic) -> Result<Logic, Vec<Diagnostic>> {
    let is_reset = |id: PinInputId| logic.inputs[id].role == PinRole::Reset;
    let Some(reset) = logic.inputs.ids().find(|&id| is_reset(id)) else { return Ok(logic) };
    let name = &logic.inputs[reset].name;
    let (held, running) = (with_reset(&logic, true), with_reset(&logic, false));
    // Where the text has several levels or T flip-flops, the constant does not show at once.
    let (mut functions, mut diagrams) = (Functions::new(), Bdd::with_limit(MOST_NODES));
    let mut is_kept = |next: NodeId, init: bool| {
        held.nodes[next] != Node::Const(init)
            && functions.build(&mut diagrams, &held, next) != Ok(Ref::constant(init))
    };
    let flops = logic.flops.iter().zip(held.flops.values());
    // A register that keeps its value with and without the reset has its initial value from power-up on.
    let is_fixed = |id: FlopId, next: NodeId| {
        let without = running.flops[id].next;
        held.nodes[next] == Node::Flop(id) && running.nodes[without] == Node::Flop(id)
    };
    let flops =
        flops.filter(|((id, old), new)| !is_fixed(*id, new.next) && is_kept(new.next, old.init));
    let mut names: Vec<&String> = flops.map(|((_, flop), _)| &flop.name).collect();
    let outputs = logic
        .outputs
        .values()
        .zip(held.outputs.values())
        .filter(|(old, new)| old.registered.is_some_and(|init| is_kept(new.value, init)));
    names.extend(outputs.map(|(pin, _)| &pin.name));
    let findings: Vec<Diagnostic> = names
        .into_iter()
        .map(|register| {
            let message =
                format!("`{register}` does not get its initial value while `{name}` is high");
            Diagnostic::error(codes::NOT_READ_BACK, message)
                .help("this is a bug in grafsynth: please report it with the chart")
        })
        .collect();
    if findings.is_empty() { Ok(running) } else { Err(findings) }
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

#[cfg(test)]
mod tests {
    use super::{add, strip};
    use grafsynth_ir::logic::{Logic, PinRole};
    use grafsynth_logic::build::Builder;

    /// A register that follows an input, and one that never changes.
    fn circuit() -> Logic {
        let mut builder = Builder::default();
        let a = builder.input_named("a");
        let (q, _) = builder.flop_named("q", true);
        let (fixed, value) = builder.flop_named("fixed", true);
        builder.logic.flops[q].next = a;
        builder.logic.flops[fixed].next = value;
        builder.finish()
    }

    #[test]
    fn an_added_reset_is_taken_out_again() {
        let with = add(circuit(), "reset");
        assert_eq!(with.inputs.values().filter(|it| it.role == PinRole::Reset).count(), 1);
        let without = strip(with).expect("it resets the register");
        assert_eq!(without, circuit());
    }

    /// Its circuit without the reset is the same, so only this check can find it.
    #[test]
    fn a_register_that_keeps_its_value_during_the_reset_is_refused() {
        let mut builder = Builder::resume(add(circuit(), "reset"));
        let reset = builder.logic.inputs.ids().nth(1).map(|id| builder.input(id));
        let (q, a) = (builder.logic.flops.ids().next(), builder.logic.inputs.ids().next());
        let (q, a) = (q.expect("it is there"), builder.input(a.expect("it is there")));
        let kept = builder.flop(q);
        builder.logic.flops[q].next = builder.mux(reset.expect("it was added"), kept, a);
        let found = strip(builder.finish()).expect_err("the reset does nothing");
        assert!(found.len() == 1 && found[0].message.contains("`q`"), "{found:?}");
    }
}
