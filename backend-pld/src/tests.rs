//! Whole circuits through every language.

mod buried;
mod exclusive;
mod foreign;
mod pages;
mod random;
mod truck;

use crate::{Dialect, EmitOptions, emit, read, rebind};
use grafsynth_ir::arena::Id;
use grafsynth_ir::logic::{FlopBit, Logic, NodeId, PinInput, PinOutput, PinRole, Wire};
use grafsynth_ir::net::Meta;
use grafsynth_ir::program::Origin;
use grafsynth_ir::random::Random;
use grafsynth_ir::span::{FileId, Name, Span};
use grafsynth_logic::build::Builder;
use grafsynth_logic::sim::LogicSim;

fn meta(label: &str) -> Meta {
    Meta { label: label.into(), ..Meta::default() }
}

/// The circuit of the truck example, as the encoding produces it.
pub(crate) fn truck() -> Logic {
    let mut builder = Builder::default();
    builder.logic.name = Name::new("truck", Span::default());
    let steps: Vec<_> = (1..=4).map(|k| builder.flop_named(&format!("p{k}"), k == 1)).collect();
    for (k, label) in ["waiting", "", "", ""].iter().enumerate() {
        let flop = &mut builder.logic.flops[steps[k].0];
        flop.meta = meta(label);
        flop.holds = Some(FlopBit {
            origin: Origin::Step(Id::from_index(k)),
            element: 0,
            bit: 0,
            inverted: false,
        });
    }
    let pins =
        [("m", "loading request"), ("b", "right limit"), ("p", "loaded"), ("a", "left limit")];
    let inputs: Vec<NodeId> = pins
        .iter()
        .enumerate()
        .map(|(k, (name, label))| {
            let role = PinRole::Input(Id::from_index(k), 0);
            let pin = builder.logic.inputs.push(PinInput {
                name: (*name).into(),
                role,
                meta: meta(label),
            });
            builder.input(pin)
        })
        .collect();
    let fires: Vec<NodeId> = (0..4).map(|k| builder.and([steps[k].1, inputs[k]])).collect();
    for (k, &node) in fires.iter().enumerate() {
        builder.logic.wires.push(Wire { name: format!("fire_t{}", k + 1), node, meta: meta("") });
    }
    for k in 0..4 {
        let not = builder.not(fires[k]);
        let hold = builder.and([steps[k].1, not]);
        builder.logic.flops[steps[k].0].next = builder.or([fires[(k + 3) % 4], hold]);
    }
    for (k, (name, label)) in
        [("R", "move right"), ("Z", "load"), ("L", "move left")].iter().enumerate()
    {
        let role = PinRole::Output(Id::from_index(k), 0);
        builder.logic.outputs.push(PinOutput {
            name: (*name).into(),
            role,
            value: steps[k + 1].1,
            registered: None,
            mealy: false,
            meta: Meta { req: vec!["R12".into()], ..meta(label) },
        });
    }
    let both = builder.and([inputs[1], inputs[3]]);
    builder.logic.never.push(both);
    builder.finish()
}

/// Checks that both circuits have the same pin and flip-flop values for pseudo-random inputs, in 64 parallel runs.
pub(crate) fn same_behaviour(a: &Logic, b: &Logic, clocks: usize) {
    assert_eq!(a.inputs, b.inputs);
    let named = |logic: &Logic| {
        logic
            .outputs
            .values()
            .map(|o| (o.name.clone(), o.role, o.registered, o.mealy))
            .collect::<Vec<_>>()
    };
    assert_eq!(named(a), named(b));
    let held = |logic: &Logic| {
        logic.flops.values().map(|f| (f.name.clone(), f.holds, f.init)).collect::<Vec<_>>()
    };
    assert_eq!(held(a), held(b));
    assert_eq!(difference(a, b, clocks), None);
}

/// The first signal in which two circuits with the same pins and flip-flops differ.
pub(crate) fn difference(a: &Logic, b: &Logic, clocks: usize) -> Option<String> {
    let (mut x, mut y) = (LogicSim::new(a), LogicSim::new(b));
    let mut random = Random::new(1);
    for _ in 0..clocks {
        for pin in a.inputs.ids() {
            let state = random.bits();
            x.set_input(pin, state);
            y.set_input(pin, state);
        }
        if let Some(output) = a.outputs.ids().find(|&output| x.output(output) != y.output(output)) {
            return Some(a.outputs[output].name.clone());
        }
        x.clock();
        y.clock();
        if let Some(flop) = a.flops.ids().find(|&flop| x.flop(flop) != y.flop(flop)) {
            return Some(a.flops[flop].name.clone());
        }
    }
    None
}

pub(crate) fn there_and_back(logic: &Logic, dialect: Dialect, options: &EmitOptions) -> String {
    let emitted = emit(logic, dialect, options).unwrap();
    let (back, findings) = read(dialect, FileId(0), &emitted.text);
    assert_eq!(findings, [], "{}", emitted.text);
    let mut back = back.unwrap();
    assert_eq!(rebind(&mut back, &emitted), []);
    same_behaviour(logic, &back, 200);
    emitted.text
}
