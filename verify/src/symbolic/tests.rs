//! Compares the functions of this module with the reference simulator, by way of a running circuit.

use grafsynth_ir::lower::program::{ProgramOptions, program};
use grafsynth_logic::sim::LogicSim;
use grafsynth_logic::{EncodeOptions, encode};
use grafsynth_sim::Stimulus;

use super::*;
use crate::structural_facts;

#[path = "../../../tests/src/random_net/mod.rs"]
#[allow(
    dead_code,
    unused_imports,
    unreachable_pub,
    unfulfilled_lint_expectations,
    reason = "shared with the differential tests; not all of it is used here"
)]
mod random_net;

/// The first bit of state or output in which the functions differ from the running circuit.
fn difference(net: &Valid<Net>, n_rows: usize, seed: u64) -> Option<String> {
    let program = program(net, &ProgramOptions::default()).ok()?;
    let facts = structural_facts(net);
    let logic = encode(net, &program, &Facts::default(), &EncodeOptions::default()).ok()?;
    let binding = Binding::of(net, &logic).ok()?;
    let mut model = Model::of(net, known_depth(&facts), &Limits::default()).ok()?;
    let reset = model.maker.reset().ok()?;
    let shape = model.maker.shape.clone();
    let reset_bits = shape.bits(net, model.aig(), &reset.state);
    for flop in logic.flops.values() {
        if let Some(holds) = flop.holds
            && let Some(lit) = reset_bits.get(&(holds.origin, holds.element, holds.bit))
            && lit.as_constant() != Some(flop.init != holds.inverted)
        {
            return Some(format!("reset of {}", flop.name));
        }
    }
    let (state, inputs) = (model.state.clone(), model.inputs.clone());
    let next = model.maker.reaction(&state, &inputs).ok()?;
    let next_bits = shape.bits(net, model.aig(), &next.state);
    let mut sim = LogicSim::new(&logic);
    for (number, row) in Stimulus::random(net, n_rows, seed, 1).rows().enumerate() {
        let mut values: BTreeMap<Lit, bool> = BTreeMap::new();
        for (pin, value) in binding.pin_bits(net, &row) {
            sim.set_input(pin, if value { !0 } else { 0 });
        }
        for (pin, input, bit) in &binding.inputs {
            let value = binding
                .pin_bits(net, &row)
                .find(|(own, _)| own == pin)
                .is_some_and(|(_, value)| value);
            values.insert(model.input_bits[&(input.index() as u32, *bit)], value);
        }
        values.insert(inputs.tick, row.dt > 0);
        for (id, flop) in logic.flops.iter() {
            let Some(holds) = flop.holds else { continue };
            if let Some(lit) = model.state_bits.get(&(holds.origin, holds.element, holds.bit)) {
                values.insert(*lit, (sim.flop(id) & 1 == 1) != holds.inverted);
            }
        }
        sim.clock();
        let wanted: Vec<(String, Lit, bool)> = logic
            .flops
            .iter()
            .filter_map(|(id, flop)| {
                let holds = flop.holds?;
                let lit = next_bits.get(&(holds.origin, holds.element, holds.bit))?;
                Some((flop.name.clone(), *lit, (sim.flop(id) & 1 == 1) != holds.inverted))
            })
            .collect();
        let roots: Vec<Lit> = wanted.iter().map(|(_, lit, _)| *lit).collect();
        let got = model.maker.aig.eval(&roots, |lit| values.get(&lit).copied().unwrap_or(false));
        for ((name, _, circuit), got) in wanted.iter().zip(got) {
            if *circuit != got {
                return Some(format!(
                    "row {}: {name} is {circuit} in the circuit, {got} by the functions",
                    number + 1
                ));
            }
        }
    }
    None
}

#[test]
fn the_functions_do_what_the_circuit_does() {
    let features = random_net::Features::chip().without_statecharts();
    let mut wrong = Vec::new();
    for seed in 0..40 {
        let net = random_net::random_net(seed, &features);
        if let Some(difference) = difference(&net, 60, seed) {
            wrong.push(format!("seed {seed}: {difference}"));
        }
    }
    assert!(wrong.is_empty(), "{}\n{wrong:#?}", wrong.len());
}
