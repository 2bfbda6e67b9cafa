//! Net and circuit side by side under random stimuli.

use grafsynth_ir::Valid;
use grafsynth_ir::logic::Logic;
use grafsynth_ir::net::Net;
use grafsynth_sim::{InputRow, Simulator, State, Stimulus, breaks_assumption};

use super::Counterexample;
use super::binding::Binding;
use super::explicit::Lanes;

/// Runs in parallel.
const LANES: usize = 16;

/// Compares some reactions; a difference if one is found.
pub(super) fn compare(
    net: &Valid<Net>,
    logic: &Logic,
    binding: &Binding,
    n_rows: usize,
) -> Option<Counterexample> {
    let per_lane = n_rows.div_ceil(LANES).max(1);
    let stimuli: Vec<Stimulus> =
        (0..LANES).map(|lane| Stimulus::random(net, per_lane, lane as u64 + 1, 1)).collect();
    let mut simulator = Simulator::new(net);
    let mut states: Vec<State> = vec![simulator.state().clone(); LANES];
    let mut is_over = [false; LANES];
    let mut lanes = Lanes::new(net, logic, binding);
    lanes.reset(net);
    if let Some(differs) = lanes.difference(net, simulator.row(), 0) {
        let difference = lanes.report(net, simulator.row(), 0, 0, differs);
        return Some(Counterexample { stimulus: Stimulus::new(net), difference });
    }
    for number in 0..per_lane {
        let rows: Vec<InputRow> = stimuli.iter().map(|stimulus| stimulus.row(number)).collect();
        if let Err(lane) = lanes.react(net, &rows) {
            // What an assumption excludes, or what leaves the net open, excuses a circuit that does not end; the other lanes are not compared any more.
            is_over[lane] |= breaks_assumption(net, &rows[lane]);
            if is_over[lane] {
                return None;
            }
            let mut stimulus = stimuli[lane].clone();
            stimulus.truncate(number + 1);
            return Some(Counterexample { stimulus, difference: Lanes::still_busy(number + 1) });
        }
        for (lane, input) in rows.iter().enumerate() {
            is_over[lane] |= breaks_assumption(net, input);
            if is_over[lane] {
                continue;
            }
            simulator.set_state(&states[lane]);
            let row = simulator.step(input);
            if let Some(differs) = lanes.difference(net, row, lane) {
                let mut stimulus = stimuli[lane].clone();
                stimulus.truncate(number + 1);
                let difference = lanes.report(net, row, lane, number + 1, differs);
                return Some(Counterexample { stimulus, difference });
            }
            is_over[lane] |= row.open.next || row.open.row;
            states[lane] = simulator.state().clone();
        }
    }
    None
}
