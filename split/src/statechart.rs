//! The parts of a divided statechart (semantics §10.8).
//!
//! The part on the CPU is the whole net, but with the outputs of the chips replaced by one output for each state that a chip reads: it is 1 while the state is
//! active. A chip stores nothing: its outputs are functions of these wires and of the inputs. In its net they belong to a step that is always active.
//!
//! ```text
//! state s { R if a }          CPU:   state s { active_s }
//!                             chip:  initial step always { R if active_s and a }
//! ```

use grafsynth_ir::Gather;
use std::collections::{BTreeMap, BTreeSet};

use grafsynth_ir::arena::IdMap;
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::division::{
    Division, Original, Owners, PartIndex, PartNet, Running, Shown, Signal, Source,
};
use grafsynth_ir::expr::Type;
use grafsynth_ir::net::{
    Driver, Emission, Evolution, Expr, Input, InputId, Leaf, Meta, Net, Output, OutputId, Part,
    Policy, PropertyRole, Settings, Step, StepId, StmtKind,
};
use grafsynth_ir::validate::{Valid, validate};
use grafsynth_ir::walk::change_statements;
use grafsynth_ir::{Id, Name};

use crate::codes;
use crate::emergency;
use crate::pieces::{assumption, connect, numbered, unused, used_names, wire_input};

/// Divides a statechart. Each object except outputs is on the last part.
///
/// # Errors
/// A statechart on another part; findings of validation, which are a bug in grafsynth.
pub(crate) fn divide(
    net: &Valid<Net>,
    owners: Owners,
    names: &[String],
) -> Result<Division, Vec<Diagnostic>> {
    let cpu = names.len().saturating_sub(1);
    if owners.steps.values().any(|owner| *owner != cpu) {
        let message = "a statechart can only be on the last part, the CPU";
        return Err(vec![Diagnostic::error(codes::APART, message).at(net.name.span, "")]);
    }
    let reads: Vec<Reads> = (0..cpu).map(|part| Reads::of(net, &owners, part)).collect();
    let states: BTreeSet<StepId> = reads.iter().flat_map(|one| one.states.iter().copied()).gather();
    let mut used = used_names(net);
    let name = |id: StepId| format!("active_{}", net.steps[id].name.text.replace('.', "_"));
    let wires: BTreeMap<StepId, String> =
        states.into_iter().map(|id| (id, unused(name(id), &mut used))).gather();
    let always = unused("always".to_owned(), &mut used);
    let mut parts = Vec::new();
    for (part, (name, reads)) in names.iter().zip(&reads).enumerate() {
        parts.push(chip(net, &owners, (part, name), reads, (&wires, &always, &used))?);
    }
    if let Some(name) = names.last() {
        parts.push(on_cpu(net, &owners, (cpu, name), &wires)?);
    }
    let signals = wires.into_iter().map(|(id, name)| (Signal::Active(id), name, cpu));
    let wires = connect(&parts, signals);
    Ok(Division { running: Running::Lockstep, parts, owners, wires })
}

/// What the outputs of a chip read.
struct Reads {
    states: BTreeSet<StepId>,
    inputs: BTreeSet<InputId>,
}

impl Reads {
    fn of(net: &Net, owners: &Owners, part: PartIndex) -> Reads {
        let mut reads = Reads { states: BTreeSet::new(), inputs: BTreeSet::new() };
        for (_, output) in net.outputs.iter().filter(|(id, _)| owners.outputs[*id] == part) {
            if let Driver::Continuous(all) = &output.driver {
                reads.states.extend(all.iter().map(|one| one.step));
            }
            let emergency = net.emergency.iter().map(|it| &it.condition);
            for leaf in output.driver.exprs().chain(emergency).flat_map(|expr| expr.leaves()) {
                match *leaf {
                    Leaf::Active(id) => _ = reads.states.insert(id),
                    Leaf::Input(id) => _ = reads.inputs.insert(id),
                    // Such an output is on the CPU, by the rules of place.
                    _ => {}
                }
            }
        }
        reads
    }
}

/// The part on the CPU: the net with other outputs.
fn on_cpu(
    net: &Valid<Net>,
    owners: &Owners,
    (at, name): (PartIndex, &str),
    wires: &BTreeMap<StepId, String>,
) -> Result<PartNet, Vec<Diagnostic>> {
    let own: Vec<OutputId> = net.outputs.ids().filter(|id| owners.outputs[*id] == at).collect();
    let new = numbered(own.iter().copied());
    let mut part = net.clone().into_inner();
    part.name = Name::new(format!("{}_{name}", net.name), net.name.span);
    part.placements.clear();
    part.board = Default::default();
    part.outputs = own.iter().map(|id| net.outputs[*id].clone()).collect();
    for list in part.lists_mut() {
        change_statements(list, &mut |stmt| {
            if let StmtKind::Call { output, .. } = &mut stmt.kind {
                *output = new.get(output).copied().unwrap_or(Id::from_index(usize::MAX));
            }
        });
    }
    let mut shown: Vec<Shown> = own.into_iter().map(Shown::Output).collect();
    for (id, name) in wires {
        let name = Name::new(name.clone(), net.steps[*id].name.span);
        let emission = Emission { step: *id, condition: None, span: name.span };
        part.outputs.push(Output {
            name,
            ty: Type::Bool,
            driver: Driver::Continuous(vec![emission]),
            safe: None,
            registered: false,
            meta: Meta::default(),
        });
        shown.push(Shown::Wire(Signal::Active(*id)));
    }
    part.properties.retain(|property| property.role == PropertyRole::Assume);
    Ok(PartNet {
        name: name.to_owned(),
        steps: IdMap::build(&part.steps, |id, _| Original::Step(id)),
        transitions: IdMap::build(&part.transitions, |id, _| id),
        vars: IdMap::build(&part.vars, |id, _| id),
        timers: IdMap::build(&part.timers, |id, _| id),
        edges: IdMap::build(&part.edges, |id, _| id),
        actions: IdMap::build(&part.actions, |id, _| id),
        inputs: IdMap::build(&part.inputs, |id, _| Source::Input(id)),
        outputs: IdMap::build(&part.outputs, |id, _| shown[id.index()]),
        net: validate(part)?,
    })
}

/// The part on a chip: its outputs as functions of the wires and of the inputs. `always` is the name of its only step.
fn chip(
    net: &Valid<Net>,
    owners: &Owners,
    (at, name): (PartIndex, &str),
    reads: &Reads,
    (wires, always, used): (&BTreeMap<StepId, String>, &str, &BTreeSet<String>),
) -> Result<PartNet, Vec<Diagnostic>> {
    let inputs = numbered(reads.inputs.iter().copied());
    let of_wire = |(at, id): (usize, &StepId)| (*id, InputId::from_index(inputs.len() + at));
    let of_wire: BTreeMap<StepId, InputId> = reads.states.iter().enumerate().map(of_wire).gather();
    let (mut part, always) = stateless(net, name, always);
    for id in inputs.keys() {
        // The CPU latches all inputs and holds them during the round.
        part.inputs.push(Input { synchronous: true, ..net.inputs[*id].clone() });
    }
    for id in of_wire.keys() {
        let text = wires.get(id).cloned().unwrap_or_default();
        part.inputs.push(wire_input(Name::new(text, net.steps[*id].name.span)));
    }
    let expr = |expr: &Expr| {
        expr.map_leaves(&|leaf| match *leaf {
            Leaf::Active(id) => Leaf::Input(new_id(&of_wire, id)),
            Leaf::Input(id) => Leaf::Input(new_id(&inputs, id)),
            other => other,
        })
    };
    let mut shown = Vec::new();
    for (id, output) in net.outputs.iter().filter(|(id, _)| owners.outputs[*id] == at) {
        let Driver::Continuous(all) = &output.driver else { continue };
        let emission = |one: &Emission| {
            let level = Expr::leaf(Leaf::Input(new_id(&of_wire, one.step)), one.span);
            let condition = Expr::and([level].into_iter().chain(one.condition.as_ref().map(&expr)));
            Emission { step: always, condition: Some(condition), span: one.span }
        };
        let driver = Driver::Continuous(all.iter().map(emission).collect());
        part.outputs.push(Output { driver, ..output.clone() });
        shown.push(Shown::Output(id));
    }
    if !shown.is_empty() {
        part.emergency = net.emergency.clone().map(|mut emergency| {
            emergency.condition = expr(&emergency.condition);
            emergency
        });
    }
    part.properties = net.properties.iter().filter_map(|one| assumption(one, &inputs)).collect();
    let sources = (inputs.keys().map(|id| Source::Input(*id)))
        .chain(of_wire.keys().map(|id| Source::Wire(Signal::Active(*id))));
    let mut sources: Vec<Source> = sources.collect();
    emergency::wire(&mut part, &mut sources, used);
    let first = net.steps.ids().next().unwrap_or(always);
    Ok(PartNet {
        name: name.to_owned(),
        steps: IdMap::build(&part.steps, |_, _| Original::Step(first)),
        transitions: IdMap::default(),
        vars: IdMap::default(),
        timers: IdMap::default(),
        edges: IdMap::default(),
        actions: IdMap::default(),
        inputs: IdMap::build(&part.inputs, |id, _| sources[id.index()]),
        outputs: IdMap::build(&part.outputs, |id, _| shown[id.index()]),
        net: validate(part)?,
    })
}

/// A net with one step, which is always active.
fn stateless(net: &Net, name: &str, always: &str) -> (Net, StepId) {
    let mut part = Net {
        name: Name::new(format!("{}_{name}", net.name), net.name.span),
        settings: Settings {
            policy: Policy::All,
            evolution: Evolution::Single,
            queue: None,
            ..net.settings.clone()
        },
        ..Net::default()
    };
    let chart = part.parts.push(Part {
        name: net.name.clone(),
        level: 1,
        priority: None,
        initial: Vec::new(),
        is_cut: false,
        meta: Meta::default(),
    });
    let mut step = Step::new(Name::new(always, net.name.span), chart);
    (step.is_initial, step.hidden) = (true, true);
    let always = part.steps.push(step);
    (part, always)
}

/// The new id of an object of the part. Validation reports one that does not exist.
fn new_id<T, U>(ids: &BTreeMap<Id<T>, Id<U>>, id: Id<T>) -> Id<U> {
    ids.get(&id).copied().unwrap_or(Id::from_index(usize::MAX))
}
