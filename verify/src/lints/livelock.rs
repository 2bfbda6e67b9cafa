//! Reactions that do not end within their limit of micro-steps: whether more would do, or the chart turns for ever.

use grafsynth_ir::diag::Notation;
use grafsynth_ir::net::{Evolution, Net, TransitionId};
use grafsynth_ir::{Diagnostic, Valid};
use grafsynth_sim::{InputRow, Simulator, State};

use crate::codes;

/// The least limit, above `least` and not above `most`, within which the reaction ends. It does within `most`.
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

/// A limit that is too small is not yet a livelock: with much more of it the reaction may end.
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
            format!("a reaction needs more than the {limit} micro-steps of the limit{shown}"),
        )
        .at(net.name.span, "fault is 1 in that row")
        .help(format!("with `evolution stable limit {more}` it ends"))
        .help_in(Notation::Scxml, format!("with g:limit=\"{more}\" at <scxml> it ends"))
        .help_in(
            Notation::Iec,
            format!("with {{grafsynth evolution stable limit {more}}} it ends"),
        );
    }
    let mut error = Diagnostic::error(codes::LIVELOCK, format!("the chart turns for ever{shown}"));
    turning.sort_unstable();
    turning.dedup();
    for transition in turning {
        error = error.at(net.transitions[transition].meta.span, "fires again and again");
    }
    error.help("let one of these wait for an edge, an event or a time; `evolution single` makes one micro-step a reaction")
}
