//! Reactions that do not end within their limit of micro-steps: either a larger limit is enough, or the chart never becomes stable.

use grafsynth_ir::diag::Notation;
use grafsynth_ir::net::{Evolution, Net, TransitionId};
use grafsynth_ir::{Diagnostic, Valid};
use grafsynth_sim::{InputRow, Simulator, State};

use crate::codes;

/// The smallest limit, above `least` and at most `most`, within which the reaction ends. The caller knows that it ends within `most`.
fn least_limit(net: &Valid<Net>, state: &State, way: &[InputRow], least: u32, most: u32) -> u32 {
    let ends = |limit: u32| {
        let mut patient = (**net).clone();
        patient.settings.evolution = Evolution::Stable { limit };
        let (Ok(patient), Some(last)) = (grafsynth_ir::validate(patient), way.last()) else {
            return false;
        };
        let mut simulator = Simulator::new(&patient);
        simulator.set_state(state);
        !simulator.step(last).fault
    };
    let (mut low, mut high) = (least, most);
    while low + 1 < high {
        let middle = low + (high - low) / 2;
        if ends(middle) {
            high = middle;
        } else {
            low = middle;
        }
    }
    high
}

/// Reports a reaction that exceeds its limit. A limit that is too small is not a livelock: with a larger limit the reaction may
/// end.
pub(super) fn livelock(
    net: &Valid<Net>,
    way: &[InputRow],
    state: &State,
    shown: &str,
) -> Diagnostic {
    let Evolution::Stable { limit } = net.settings.evolution else {
        return Diagnostic::error(codes::LIVELOCK, format!("a reaction does not end{shown}"));
    };
    let more = limit.saturating_mul(8).saturating_add(64).min(4096).max(limit);
    let mut patient = (**net).clone();
    patient.settings.evolution = Evolution::Stable { limit: more };
    let mut turning: Vec<TransitionId> = Vec::new();
    let mut ends = false;
    if let (Ok(patient), Some(last)) = (grafsynth_ir::validate(patient), way.last()) {
        let mut simulator = Simulator::new(&patient);
        simulator.set_state(state);
        ends = !simulator.step(last).fault;
        let fired = simulator.fired();
        turning = fired[fired.len().saturating_sub(8)..].to_vec();
    }
    if ends {
        let more = least_limit(net, state, way, limit, more);
        return Diagnostic::warning(
            codes::LIVELOCK,
            format!("a reaction needs more micro-steps than the limit of {limit}{shown}"),
        )
        .at(net.name.span, "fault is 1 in that row")
        .help(format!("write `evolution stable limit {more}`, which is enough for this reaction"))
        .help_in(
            Notation::Scxml,
            format!("write g:limit=\"{more}\" on <scxml>, which is enough for this reaction"),
        )
        .help_in(
            Notation::Iec,
            format!("write {{grafsynth evolution stable limit {more}}}, which is enough for this reaction"),
        );
    }
    let mut error =
        Diagnostic::error(codes::LIVELOCK, format!("the chart never becomes stable{shown}"));
    turning.sort_unstable();
    turning.dedup();
    for transition in turning {
        error = error.at(net.transitions[transition].meta.span, "fires again and again");
    }
    error.help("let one of these transitions wait for an edge, an event or a time, or use `evolution single` for one micro-step per reaction")
}
