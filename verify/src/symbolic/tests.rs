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

/// The first cell in which the functions of a statechart, executed from reset, differ from the reference simulator; and the number of rows compared.
fn trace_difference(net: &Valid<Net>, n_rows: usize, seed: u64) -> Result<usize, String> {
    let limits = Limits { circuit_nodes: 200_000, ..Limits::default() };
    let Ok(mut model) = Model::of(net, Some(12), &limits) else { return Ok(0) };
    model.prove_structure(&limits)?;
    let Ok(reset) = model.maker.reset() else { return Ok(0) };
    let shape = model.maker.shape.clone();
    let mut values: BTreeMap<Lit, bool> = BTreeMap::new();
    for (key, lit) in shape.bits(net, model.aig(), &reset.state) {
        let value = lit.as_constant().ok_or("the reset is no constant")?;
        values.insert(model.state_bits[&key], value);
    }
    let first: Vec<Vec<Lit>> = reset.outputs.clone();
    let reset_fault = reset.fault;
    super::reach::any_time(&mut model);
    let (state, inputs) = (model.state.clone(), model.inputs.clone());
    let Ok(next) = model.maker.reaction(&state, &inputs) else { return Ok(0) };
    let overruns = model.maker.overruns();
    let next_bits = shape.bits(net, model.aig(), &next.state);
    let mut roots: Vec<Lit> = next_bits.values().copied().collect();
    let n_state = roots.len();
    roots.extend([next.fault, overruns]);
    roots.extend(next.outputs.iter().flatten());
    let dt: Vec<Lit> = inputs.dt.iter().flat_map(|dt| dt.bits().to_vec()).collect();
    let longest = super::reach::longest_time(net, &shape);

    let mut simulator = grafsynth_sim::Simulator::new(net);
    let code_of = |values: &BTreeMap<Lit, bool>, model: &Model<'_>, origin, element, bits: u32| {
        (0..bits).fold(0_u64, |code, bit| {
            let lit = model.state_bits[&(origin, element, bit)];
            code | u64::from(values[&lit]) << bit
        })
    };
    let compare = |simulator: &grafsynth_sim::Simulator<'_>,
                   values: &BTreeMap<Lit, bool>,
                   model: &Model<'_>,
                   outputs: &[Vec<bool>],
                   fault: bool| {
        let row = simulator.row();
        for step in net.steps.ids() {
            let wanted = row.steps.contains(&step);
            if values[&model.state_bits[&(Origin::Step(step), 0, 0)]] != wanted {
                return Err(format!("{} should be {wanted}", net.steps[step].name));
            }
        }
        let mut place = 0;
        for (id, var) in net.vars.iter() {
            for element in 0..var.len.unwrap_or(1) {
                let code = code_of(values, model, Origin::Var(id), element, var.ty.bits());
                if code != row.vars[place].abs_diff(var.ty.bounds().0) {
                    return Err(format!("{}[{element}] should be {}", var.name, row.vars[place]));
                }
                place += 1;
            }
        }
        for (id, output) in net.outputs.iter() {
            let code = outputs[id.index()]
                .iter()
                .enumerate()
                .fold(0_u64, |code, (bit, value)| code | u64::from(*value) << bit);
            let wanted = row.outputs[id.index()];
            let wanted = if output.is_extern() {
                u64::from(wanted > 0)
            } else {
                wanted.abs_diff(output.ty.bounds().0)
            };
            if code != wanted {
                return Err(format!("{} should be {wanted}", output.name));
            }
        }
        if row.fault != fault { Err(format!("fault should be {}", row.fault)) } else { Ok(()) }
    };
    let constants = |code: &[Lit]| -> Vec<bool> {
        code.iter().map(|lit| lit.as_constant().unwrap_or(false)).collect()
    };
    let outputs: Vec<Vec<bool>> = first.iter().map(|code| constants(code)).collect();
    compare(&simulator, &values, &model, &outputs, reset_fault == Lit::TRUE)
        .map_err(|why| format!("reset: {why}"))?;
    let mut n_compared = 1;
    for (number, row) in Stimulus::random(net, n_rows, seed, 3).rows().enumerate() {
        simulator.step(&row);
        for (id, input) in net.inputs.iter() {
            let code = input.ty.saturate(row.value(id)).abs_diff(input.ty.bounds().0);
            for bit in 0..input.ty.bits() {
                let lit = model.input_bits[&(id.index() as u32, bit)];
                values.insert(lit, code >> bit & 1 == 1);
            }
        }
        let ticks = i64::from(row.dt).min(longest);
        for (bit, lit) in dt.iter().enumerate().filter(|(_, lit)| lit.as_constant().is_none()) {
            values.insert(*lit, ticks >> bit & 1 == 1);
        }
        let got = model.maker.aig.eval(&roots, |lit| values.get(&lit).copied().unwrap_or(false));
        if got[n_state + 1] {
            break;
        }
        for (key, value) in next_bits.keys().zip(&got) {
            values.insert(model.state_bits[key], *value);
        }
        let mut rest = got[n_state + 2..].iter().copied();
        let outputs: Vec<Vec<bool>> =
            next.outputs.iter().map(|code| rest.by_ref().take(code.len()).collect()).collect();
        compare(&simulator, &values, &model, &outputs, got[n_state])
            .map_err(|why| format!("row {}: {why}", number + 1))?;
        n_compared += 1;
    }
    Ok(n_compared)
}

#[test]
fn statecharts_do_what_the_simulator_does() {
    let everything = random_net::Features::everything();
    let policies =
        vec![grafsynth_ir::net::Policy::InnerFirst, grafsynth_ir::net::Policy::OuterFirst];
    let statecharts = random_net::Features { policies, single: false, ..everything };
    let kinds = [
        random_net::Features::entering(),
        random_net::Features::tabular_statecharts(),
        statecharts,
    ];
    let n: u64 = std::option_env!("VERIFY_NETS").and_then(|n| n.parse().ok()).unwrap_or(8);
    let mut wrong = Vec::new();
    let (mut n_rows, mut n_nets) = (0, 0);
    for seed in 0..n {
        for features in &kinds {
            let net = random_net::random_net(seed, features);
            match trace_difference(&net, 20, seed) {
                Ok(rows) => {
                    n_rows += rows;
                    n_nets += usize::from(rows > 10);
                }
                Err(difference) => wrong.push(format!("seed {seed}: {difference}")),
            }
        }
    }
    println!("{n_rows} rows, {n_nets} nets");
    assert!(wrong.is_empty(), "{}\n{wrong:#?}", wrong.len());
    assert!(n_nets * 2 > n as usize * kinds.len(), "{n_nets} nets were compared");
}
