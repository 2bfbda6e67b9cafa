//! Notes on a circuit, in addition to its proof: its encoding and don't-cares, its form, whether it is safe and whether the emergency
//! dominates.

use crate::codes;
use crate::coding::EncodedLogic;
use crate::output_report::Note;
use grafsynth_backend_pld::EmitOptions;
use grafsynth_ir::Gather;
use grafsynth_ir::diag::joined;
use grafsynth_ir::facts::Facts;
use grafsynth_ir::logic::{Flop, Logic, PinRole};
use grafsynth_ir::net::{Driver, Evolution, Net, StepId};
use grafsynth_ir::program::Origin;
use grafsynth_ir::{Diagnostic, counted};
use grafsynth_logic::BusyMode;
use grafsynth_logic::state_assignment::Encoding;
use std::collections::BTreeSet;

/// Whether a circuit that was requested as safe is proved safe after it was read back; if not, the result is open. A circuit with `busy` is never made safe;
/// the note reports this.
pub(crate) fn safe(logic: &Logic, read_back: &Logic) -> Note {
    if logic.outputs.values().any(|output| output.role == PinRole::Busy) {
        return Note::Safe("not made safe: it runs one micro-step per clock".to_owned());
    }
    match grafsynth_logic::state_assignment::is_safe(read_back) {
        Ok(codes) if codes.illegal == 0 => Note::Safe("safe: no code is illegal".to_owned()),
        Ok(codes) => {
            let flops = counted(codes.n_flops, "flip-flop", "flip-flops");
            Note::Safe(match codes.illegal {
                1 => format!(
                    "safe: the one illegal code of {flops} leads to the initial situation in one clock, proved over all codes"
                ),
                n => format!(
                    "safe: all {n} illegal codes of {flops} lead to the initial situation in one clock, proved over all codes"
                ),
            })
        }
        Err(why) => Note::NotSafe(why),
    }
}

/// The note on the encoding, on unread inputs without a pin, and on don't-cares; `None` if there are none of these and each step has its own flip-flop.
pub(crate) fn codes_and_dont_cares(
    coded: &EncodedLogic,
    emitted: &Logic,
    options: &EmitOptions,
) -> Option<String> {
    let mut parts = Vec::new();
    if coded.n_coded > 0 {
        parts.push(format!(
            "{}, {} coded {}",
            counted(coded.logic.flops.len(), "flip-flop", "flip-flops"),
            counted(coded.n_coded, "step", "steps"),
            match coded.encoding {
                Encoding::OneHot => "one-hot",
                Encoding::ZeroHot => "zero-hot",
                Encoding::Compact => "compactly",
            }
        ));
        parts.extend(coded.why.as_ref().map(|why| format!("chosen because {why}")));
    }
    parts.extend(timers(coded));
    if coded.n_unread > 0 {
        let (inputs, have) =
            if coded.n_unread == 1 { ("input", "has") } else { ("inputs", "have") };
        parts.push(format!("{} {inputs} that nothing reads {have} no pin", coded.n_unread));
    }
    if options.dont_cares {
        let kinds = [
            (emitted.unreachable.is_empty(), "unreachable situations"),
            (emitted.never.is_empty(), "violated assumptions"),
            (emitted.open.is_empty(), "cells that the chart leaves undefined"),
        ];
        let kinds: Vec<&str> =
            kinds.into_iter().filter(|(is_none, _)| !is_none).map(|(_, kind)| kind).collect();
        if !kinds.is_empty() {
            parts.push(format!("don't-cares: {}", joined(&kinds, "and")));
        }
    }
    (!parts.is_empty()).then(|| parts.join("; "))
}

/// The flip-flops of timers that steps share, or why they do not share any.
fn timers(coded: &EncodedLogic) -> Option<String> {
    if coded.has_own_timers {
        return Some(
            "each timed step has its own timer, which is better for this device than sharing"
                .to_owned(),
        );
    }
    let is_shared =
        |flop: &&Flop| flop.holds.is_some_and(|bit| matches!(bit.origin, Origin::SharedElapsed(_)));
    let n_flops = coded.logic.flops.values().filter(is_shared).count();
    let steps: BTreeSet<StepId> = (coded.logic.decoded.iter())
        .filter_map(|bit| match bit.holds.origin {
            Origin::Elapsed(step) => Some(step),
            _ => None,
        })
        .gather();
    (n_flops > 0).then(|| {
        format!(
            "the times of {} share {}",
            counted(steps.len(), "step", "steps"),
            counted(n_flops, "flip-flop", "flip-flops")
        )
    })
}

/// How a circuit evolves until it is stable, with the reason; `None` for a chart with one micro-step per reaction.
#[must_use]
pub fn form(net: &Net, facts: &Facts, logic: &Logic, busy: BusyMode) -> Option<String> {
    let Evolution::Stable { limit } = net.settings.evolution else { return None };
    let is_proved = grafsynth_logic::is_depth_proved(net, facts);
    if logic.outputs.values().any(|output| output.role == PinRole::Busy) {
        let why = match busy {
            BusyMode::Always | BusyMode::Never => "as asked".to_owned(),
            BusyMode::WhenUnproved if !is_proved => {
                let micro_steps = counted(limit, "micro-step is", "micro-steps are");
                format!("because it is not proved that {micro_steps} always enough")
            }
            BusyMode::WhenUnproved | BusyMode::WhenTooLarge => {
                "because a circuit that runs all of them in one clock would be too large".to_owned()
            }
        };
        return Some(format!("one micro-step per clock with `busy`, {why}"));
    }
    let why = match &facts.stable_depth {
        Some(depth) => format!("at most {}, as proved", depth.value),
        None if is_proved => match &facts.rounds {
            Some(rounds) => {
                format!("at most {}, as proved", counted(rounds.value, "check", "checks"))
            }
            None => format!("{limit} are always enough, as proved"),
        },
        None => match busy {
            BusyMode::Never | BusyMode::WhenTooLarge => "as asked".to_owned(),
            BusyMode::WhenUnproved | BusyMode::Always => {
                format!("because they cannot run in separate clocks: {}", why_one_clock(net))
            }
        },
    };
    Some(format!("micro-steps composed into one clock, {why}"))
}

/// Why one clock per micro-step is not possible for a chart.
fn why_one_clock(net: &Net) -> &'static str {
    if net.emergency.is_some() {
        "with an emergency, no output may be delayed until the end of a reaction"
    } else if !net.outputs.values().any(|output| matches!(output.driver, Driver::Extern { .. })) {
        "no transition can fire"
    } else {
        "actions are called between micro-steps"
    }
}

/// Warns if one clock per micro-step was requested but is not possible.
pub(crate) fn one_clock_all_the_same(
    net: &Net,
    logic: &Logic,
    busy: BusyMode,
) -> Option<Diagnostic> {
    let is_stable = matches!(net.settings.evolution, Evolution::Stable { .. });
    let has_busy = logic.outputs.values().any(|output| output.role == PinRole::Busy);
    if busy != BusyMode::Always || !is_stable || has_busy {
        return None;
    }
    let message = format!("`--busy always` is ignored: {}", why_one_clock(net));
    let help = if net.emergency.is_some() {
        "leave out `--busy always`; without the emergency, each micro-step can take a clock"
    } else {
        "leave out `--busy always`: a reaction takes one clock"
    };
    let place = net.emergency.as_ref().map_or(net.name.span, |emergency| emergency.meta.span);
    let finding = Diagnostic::warning(codes::ONE_CLOCK, message).at(place, "");
    Some(finding.help(help))
}
