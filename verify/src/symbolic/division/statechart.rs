//! The proof that the parts of a divided statechart, joined by their wires, equal the net (semantics §10.8).
//!
//! 1. One part is the net with other outputs: everything else in it is the same, object by object, and so are the outputs of the net that it drives. Nothing in a
//!    reaction reads an output that is not stored or controlled. So in each row this part has the state of the net, whatever the net does in its reactions.
//! 2. The state of each other part is that after reset, for all inputs: it stores nothing, and none of its outputs is registered.
//! 3. For every state of the net and all inputs: if each wire has the value that the first part gives it in that state, the outputs of the other parts are those of
//!    the net (step E4 of semantics §3.9).

use std::collections::BTreeMap;

use grafsynth_ir::division::{Division, PartNet, Shown, Signal, Source};
use grafsynth_ir::facts::Facts;
use grafsynth_ir::net::{Net, OutputId, StepKind, StmtKind};
use grafsynth_ir::walk::change_statements;
use grafsynth_ir::{Id, Name};

use super::super::Model;
use super::super::aig::{Aig, Lit};
use super::super::reaction::{Inputs, Maker};
use super::super::shared::Shared;
use super::super::state::{State, Value};
use super::words::wire;
use super::{Apart, Failed, Joined, Pair, Proof, What, at_once};
use crate::limits::Limits;
use crate::verdict::Scope;

/// Proves that the parts equal the net, for every row and every `dt`.
pub(super) fn prove(
    net: &Net,
    facts: &Facts,
    division: &Division,
    limits: &Limits,
) -> Result<Joined, Failed> {
    let ends = |kind: StepKind, parent: Option<_>| kind == StepKind::Final && parent.is_none();
    if net.steps.values().any(|step| ends(step.kind, step.parent)) {
        let why = "the outputs of a chart that has ended keep their values, which is not covered";
        return Err(Failed::Open(why.to_owned()));
    }
    let (whole, rest): (Vec<&PartNet>, Vec<&PartNet>) =
        division.parts.iter().partition(|part| part.net.settings.policy.is_statechart());
    let [whole] = whole[..] else {
        let when = format!("{} parts have it", whole.len());
        return Err(Failed::Apart(Apart { what: "the statechart".to_owned(), when }));
    };
    same_chart(net, whole)?;
    let model = Model::of(net, None, limits)?;
    let (state, inputs) = (model.state.clone(), model.inputs.clone());
    let mut proof = Proof { model, shared: Shared::new(), facts, limits, compared: 0, same: 0 };
    let wanted = proof.model.maker.outputs_of_state(&state, &inputs);
    let wires = proof.wires(whole, &state, &inputs)?;
    for part in rest {
        for pair in proof.chip(net, part, &inputs, (&wires, &wanted))? {
            proof.show(part, pair)?;
        }
    }
    Ok(Joined { compared: proof.compared, same: proof.same, scope: Scope::EveryStimulus })
}

/// Checks that a part is the net with other outputs, and that the outputs of the net that it drives are the same.
fn same_chart(net: &Net, part: &PartNet) -> Result<(), Failed> {
    let apart = |what: String| {
        let when = format!("that of part `{}` is not that of the chart", part.name);
        Err(Failed::Apart(Apart { what, when }))
    };
    let old = |id: OutputId| match part.outputs[id] {
        Shown::Output(old) => old,
        Shown::Wire(_) | Shown::Moves => Id::from_index(usize::MAX),
    };
    if without_outputs(&part.net, old) != without_outputs(net, |id| id) {
        return apart("a state, transition, variable or list".to_owned());
    }
    for (at, (_, source)) in part.inputs.iter().enumerate() {
        if *source != Source::Input(Id::from_index(at)) {
            return apart(format!("the source of input {}", at + 1));
        }
    }
    for (id, shown) in part.outputs.iter() {
        if let Shown::Output(old) = *shown
            && part.net.outputs[id] != net.outputs[old]
        {
            return apart(format!("output `{}`", net.outputs[old].name));
        }
    }
    Ok(())
}

/// The net without its outputs, and without what has no effect on a reaction. `old` gives the outputs that lists call.
fn without_outputs(net: &Net, old: impl Fn(OutputId) -> OutputId) -> Net {
    let mut rest = net.clone();
    for list in rest.lists_mut() {
        change_statements(list, &mut |stmt| {
            if let StmtKind::Call { output, .. } = &mut stmt.kind {
                *output = old(*output);
            }
        });
    }
    rest.name = Name::default();
    rest.outputs = Default::default();
    rest.properties.clear();
    rest.placements.clear();
    rest.board = Default::default();
    rest
}

impl Proof<'_> {
    /// The value of each wire in a state.
    fn wires(
        &mut self,
        whole: &PartNet,
        state: &State,
        inputs: &Inputs,
    ) -> Result<BTreeMap<Signal, Lit>, Failed> {
        let mut maker = Maker::new(&whole.net, None, self.limits.circuit_nodes)?;
        maker.aig = std::mem::replace(self.model.aig(), Aig::new());
        let outputs = maker.outputs_of_state(state, inputs);
        *self.model.aig() = std::mem::replace(&mut maker.aig, Aig::new());
        let mut wires = BTreeMap::new();
        for ((_, shown), code) in whole.outputs.iter().zip(outputs) {
            match (shown, code.as_deref()) {
                (Shown::Wire(signal), Some([lit])) => _ = wires.insert(*signal, *lit),
                (Shown::Wire(_), _) | (Shown::Moves, _) => {
                    let why = "a wire of a statechart does not follow from its state";
                    return Err(Failed::Open(why.to_owned()));
                }
                (Shown::Output(_), _) => {}
            }
        }
        Ok(wires)
    }

    /// The pairs of functions that must be equal in a part without states: its state before and after a reaction, and its outputs.
    fn chip(
        &mut self,
        net: &Net,
        part: &PartNet,
        inputs: &Inputs,
        (wires, wanted): (&BTreeMap<Signal, Lit>, &[Option<Vec<Lit>>]),
    ) -> Result<Vec<Pair>, Failed> {
        let mut own = Inputs { values: Vec::new(), tick: inputs.tick, dt: inputs.dt.clone() };
        for source in part.inputs.values() {
            own.values.push(match source {
                Source::Input(id) | Source::Direct(id) => inputs.values[id.index()].clone(),
                Source::More => {
                    let reason = "a chip waits for another round, but a statechart has none";
                    return Err(Failed::Open(reason.to_owned()));
                }
                Source::Wire(signal) => match wires.get(signal) {
                    Some(lit) => Value::Flag(*lit),
                    None => {
                        let when = "no output of the statechart shows it".to_owned();
                        return Err(Failed::Apart(Apart { what: wire(net, *signal), when }));
                    }
                },
            });
        }
        let mut maker = Maker::new(&part.net, None, self.limits.circuit_nodes)?;
        maker.aig = std::mem::replace(self.model.aig(), Aig::new());
        let pairs = pairs(&mut maker, part, &own, wanted);
        *self.model.aig() = std::mem::replace(&mut maker.aig, Aig::new());
        pairs
    }
}

fn pairs(
    maker: &mut Maker<'_>,
    part: &PartNet,
    inputs: &Inputs,
    wanted: &[Option<Vec<Lit>>],
) -> Result<Vec<Pair>, Failed> {
    let reset = maker.reset()?;
    let next = maker.reaction(&reset.state, inputs)?;
    let shape = maker.shape.clone();
    let before = shape.bits(&part.net, &mut maker.aig, &reset.state);
    let mut after = shape.bits(&part.net, &mut maker.aig, &next.state);
    let mut pairs = Vec::new();
    // In row 0 no clock edge has loaded a register with the states that the reset of the statechart reaches.
    if let Some(output) = part.net.outputs.values().find(|output| output.registered) {
        let why = format!("output `{}` of part `{}` is registered", output.name, part.name);
        return Err(Failed::Open(why));
    }
    for (key, wanted) in before {
        let Some(given) = after.remove(&key) else { continue };
        pairs.push(Pair { what: What::Bit(key), wanted, given, at_reset: false });
    }
    for (id, shown) in part.outputs.iter() {
        let wanted = match shown {
            Shown::Output(old) => wanted.get(old.index()).and_then(Option::as_ref),
            Shown::Wire(_) | Shown::Moves => None,
        };
        let Some(wanted) = wanted else {
            let name = &part.net.outputs[id].name;
            let why = format!(
                "output `{name}` of part `{}` does not follow from the active states and the inputs",
                part.name
            );
            return Err(Failed::Open(why));
        };
        let codes = wanted.iter().zip(&next.outputs[id.index()]);
        pairs.extend(codes.map(|(wanted, given)| Pair {
            what: What::Output(id.index()),
            wanted: *wanted,
            given: *given,
            at_reset: false,
        }));
    }
    pairs.extend(at_once::pairs(maker, part, (&reset.state, inputs), &next)?);
    Ok(pairs)
}
