//! Parts that run on their own (semantics §10.7): the times that their proof assumes, and the deadlines that they keep.

use super::Request;
use super::link::{Linked, Round, rounded};
use grafsynth_ir::division::{PartIndex, Running};
use grafsynth_ir::net::{Net, Transition};
use grafsynth_split::cpu::cpu;
use grafsynth_split::link::{Timing, chip_ns, least_cycles};
use grafsynth_split::solve::Forbidden;
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

/// The decisions that no deadline allows: a transition on a CPU that needs longer for the shortest program than the deadline of the transition.
pub(super) fn late_on_cpu(net: &Net, groups: &Groups, request: &Request<'_>) -> Vec<Forbidden> {
    let at: PartIndex = request.parts.len().saturating_sub(1);
    let device = request.parts.last().and_then(|part| cpu(part.device.name()));
    let Some(cpu) = device.filter(|_| request.running == Running::Free) else { return Vec::new() };
    let Some(cycles) = least_cycles(cpu) else { return Vec::new() };
    let clocks = 2 * cycles * u64::from(cpu.clocks_per_cycle);
    let ns = clocks.saturating_mul(1_000_000_000) / u64::from(cpu.clock_hz).max(1);
    let late = |transition: &Transition| transition.deadline_ns.is_some_and(|limit| limit < ns);
    let all = net.transitions.iter().filter(|(_, transition)| late(transition));
    let groups = all.filter_map(|(id, _)| groups.of.get(&Item::Transition(id)));
    groups.map(|group| Forbidden::Decisions(vec![(*group, at)])).collect()
}
