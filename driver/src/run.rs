//! Runs designs in this process: the reference simulator, and circuits with the columns of the net they were made from.

use crate::logic::LogicDesign;
use grafsynth_backend_pld::fuse::run::Burned;
use grafsynth_backend_pld::fuse::{FuseMap, Role};
use grafsynth_ir::logic::Logic;
use grafsynth_ir::net::{Driver, Net};
use grafsynth_ir::{Diagnostic, Valid};
use grafsynth_logic::chip::{ChipSim, NoRow, Parts};
use grafsynth_sim::{Clocked, Effect, InputRow, Row, Stimulus, Trace, TraceLayout};

/// The trace of the reference simulator.
#[must_use]
pub fn net_trace(net: &Valid<Net>, stimulus: &Stimulus) -> Trace {
    grafsynth_sim::run(net, stimulus)
}

/// The trace of a circuit whose pins and flip-flops have roles. A circuit with a `busy` pin is clocked in each row until `busy` is 0. If
/// `busy` never becomes 0, the trace ends there; a comparison then finds the missing rows. A row with several ticks becomes that many
/// clocks, each with its own row of the trace ([`Clocked`]).
///
/// # Errors
/// The stimulus takes more clocks than the limit for a chip.
pub fn logic_trace(
    net: &Net,
    logic: &Logic,
    stimulus: &Stimulus,
) -> Result<Trace, Vec<Diagnostic>> {
    let clocked = Clocked::of(net, stimulus).map_err(|finding| vec![*finding])?;
    let mut chip = ChipSim::new(net, logic);
    Ok(chip_trace(net, &mut chip, &clocked.stimulus))
}

/// The trace of a programmed device that implements a circuit, simulated fuse by fuse, with a row for each clock.
///
/// # Errors
/// The stimulus takes more clocks than the limit for a chip, or the simulator does not support the device.
pub fn device_trace(
    net: &Net,
    map: &FuseMap,
    logic: &Logic,
    roles: &[Role],
    stimulus: &Stimulus,
) -> Result<Trace, Vec<Diagnostic>> {
    let clocked = Clocked::of(net, stimulus).map_err(|finding| vec![*finding])?;
    let device = Burned::new(map, logic, roles).map_err(|finding| vec![*finding])?;
    let mut chip = ChipSim::over(net, logic, device);
    let trace = chip_trace(net, &mut chip, &clocked.stimulus);
    match chip.sim().trouble() {
        Some(trouble) => Err(vec![trouble.clone()]),
        None => Ok(trace),
    }
}

/// The trace of imported logic, with a row for each clock: simulated fuse by fuse if it was read from fuses, otherwise as a circuit.
///
/// # Errors
/// The stimulus takes more clocks than the limit for a chip, the simulator does not support the device, or the text is not a circuit with one clock.
pub fn design_trace(design: &LogicDesign, stimulus: &Stimulus) -> Result<Trace, Vec<Diagnostic>> {
    match &design.fuses {
        Some(fuses) => {
            device_trace(&design.interface, &fuses.map, &fuses.parts, &fuses.roles, stimulus)
        }
        None => logic_trace(&design.interface, design.circuit()?, stimulus),
    }
}

fn chip_trace<S: Parts>(net: &Net, chip: &mut ChipSim<'_, S>, stimulus: &Stimulus) -> Trace {
    let mut trace = Trace::new(TraceLayout::of(net));
    let first = chip_row(net, chip, InputRow { dt: 0, ..InputRow::zero(net) });
    trace.push(trace.layout.row(&first));
    for input in stimulus.rows() {
        match chip.react(&input.values, u64::from(input.dt)) {
            Ok(_) => {}
            Err(NoRow::StillBusy { .. }) => break,
            Err(NoRow::TooManyTicks { .. }) => {
                unreachable!("the stimulus was checked for ticks")
            }
        }
        let row = chip_row(net, chip, input);
        trace.push(trace.layout.row(&row));
    }
    trace
}

/// The row that a simulated chip shows, for these inputs.
pub fn chip_row<S: Parts>(net: &Net, chip: &mut ChipSim<'_, S>, input: InputRow) -> Row {
    let mut row = Row::zero(net);
    row.dt = input.dt;
    row.inputs = input.values;
    row.steps = net.steps.ids().filter(|step| chip.is_active(*step) == Some(true)).collect();
    for (id, output) in net.outputs.iter() {
        // A circuit without the pin of a stored output still has its memory; if the pin exists, its value counts, whether wrong or forced.
        let memory = || match output.driver {
            Driver::Stored(var) => chip.var(var, 0),
            _ => None,
        };
        let value = chip.output(id).or_else(memory).unwrap_or(0);
        row.outputs[id.index()] = match &output.driver {
            Driver::Extern { .. } => {
                // A strobe of an extern action: the column counts its calls, and the row lists them.
                row.effects.extend((0..value).map(|_| Effect::Call(id, Vec::new())));
                value
            }
            _ => value,
        };
    }
    let mut place = 0;
    for (id, var) in net.vars.iter() {
        for element in 0..var.len.unwrap_or(1) {
            row.vars[place] = chip.var(id, element).unwrap_or(0);
            place += 1;
        }
    }
    row.fault = chip.fault();
    row
}
