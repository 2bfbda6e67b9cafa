//! Parts that run on their own (semantics §10.7): the times that their proof assumes, and the deadlines that they keep.

use super::Request;
use super::link::{Linked, Round, rounded};
use grafsynth_ir::division::{PartIndex, Running};
use grafsynth_ir::net::{Net, Transition, TransitionId};
use grafsynth_split::cpu::cpu;
use grafsynth_split::link::{Timing, chip_ns, least_cycles};
use grafsynth_split::{Groups, Item};
use grafsynth_verify::Settled;

/// The longest time from a change to the outputs of a part that follow from it: its program or its clock makes one reaction after another.
fn part_ns(round: &Round) -> u64 {
    chip_ns(&Timing::default()).max(2 * round.ns)
}

/// What the proof assumes of the plant and of the program, in words.
#[must_use]
pub fn assumed(net: &Net, settled: &Settled, linked: &Linked) -> String {
    let reactions = settled.longest as u64;
    let gap = match &linked.round {
        Ok(round) => format!("at least {} apart", rounded(2 * reactions * part_ns(round))),
        Err(_) => format!("further apart than {} reactions of the slowest part", 2 * reactions),
    };
    let tick = match settled.has_time {
        true => format!(
            ", and a tick ({}) is longer than that",
            grafsynth_ir::duration(net.settings.tick_ns)
        ),
        false => String::new(),
    };
    format!(
        "assumed: all inputs are 0 until all parts have started; then one input at a time changes, {gap}{tick}; the program calls the part on the CPU again and again without a pause"
    )
}

/// Why the times that the proof assumes are not those of the parts.
#[must_use]
pub fn too_fast(net: &Net, settled: &Settled, linked: &Linked) -> Option<String> {
    let round = linked.round.as_ref().ok().filter(|_| settled.has_time)?;
    let needed = 2 * settled.longest as u64 * part_ns(round);
    (needed > net.settings.tick_ns).then(|| {
        format!(
            "the parts may need {} until they are at rest, twice, but a tick is {}",
            rounded(needed / 2),
            grafsynth_ir::duration(net.settings.tick_ns)
        )
    })
}

/// A transition that cannot be on a CPU, because even the shortest program takes longer than its deadline.
#[derive(Debug, Clone, Copy)]
pub(super) struct Late {
    pub(super) transition: TransitionId,
    /// Its group.
    pub(super) group: usize,
    /// The CPU.
    pub(super) part: PartIndex,
    /// The time from pin to pin with the shortest program.
    least_ns: u64,
}

impl Late {
    /// The deadline, and what the CPU needs at least.
    pub(super) fn said(&self, net: &Net, part: &str) -> String {
        let transition = &net.transitions[self.transition];
        format!(
            "`{}` has a deadline of {}, but on `{part}` at least {} pass from pin to pin",
            transition.name,
            grafsynth_ir::duration(transition.deadline_ns.unwrap_or_default()),
            rounded(self.least_ns)
        )
    }
}

/// The transitions that no CPU can have in time, if the parts run on their own.
pub(super) fn late_on_cpu(net: &Net, groups: &Groups, request: &Request<'_>) -> Vec<Late> {
    let part: PartIndex = request.parts.len().saturating_sub(1);
    let device = request.parts.last().and_then(|part| cpu(part.device.name()));
    let Some(cpu) = device.filter(|_| request.running == Running::Free) else { return Vec::new() };
    let Some(cycles) = least_cycles(cpu) else { return Vec::new() };
    let clocks = 2 * cycles * u64::from(cpu.clocks_per_cycle);
    let least_ns = clocks.saturating_mul(1_000_000_000) / u64::from(cpu.clock_hz).max(1);
    let is_late = |limit: u64| limit < least_ns;
    let late = |(transition, it): (TransitionId, &Transition)| {
        it.deadline_ns.filter(|limit| is_late(*limit))?;
        let group = *groups.of.get(&Item::Transition(transition))?;
        Some(Late { transition, group, part, least_ns })
    };
    net.transitions.iter().filter_map(late).collect()
}
