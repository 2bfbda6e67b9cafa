//! The time of a round: an upper estimate, from the acts and the constants of the CPU.

use super::{Act, Link, OSCILLATOR_HZ, SYNCHRONISERS, Timing};
use crate::cpu::{Cpu, Family};

/// A wait of more than this many instructions is written as a loop; a shorter one as single instructions.
const MOST_NOPS: u64 = 16;
/// The minimum number of cycles of an iteration of [`Wait::Loop`]: the counter is loaded, tested, decremented and stored.
const LEAST_OF_ITERATION: u64 = 4;

/// How the CPU waits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Wait {
    /// This many instructions that do nothing.
    Nops(u64),
    /// This many iterations of a loop.
    Loop(u64),
}

/// The wait for the outputs of the chips.
pub(super) fn settle(cpu: &Cpu, timing: &Timing) -> Wait {
    let hz = u64::from(cpu.clock_hz / cpu.clocks_per_cycle);
    // An AVR and an STM32 read a pin through a synchroniser of two flip-flops.
    let cycles = (hz * u64::from(timing.settle_ns)).div_ceil(1_000_000_000) + 2;
    // An STM32 may drop a `nop` before it executes.
    if matches!(cpu.family, Family::Avr | Family::Mcs51) && cycles <= MOST_NOPS {
        Wait::Nops(cycles)
    } else {
        loop_of(cycles)
    }
}

/// A loop of at least that many cycles.
pub(super) fn loop_of(cycles: u64) -> Wait {
    Wait::Loop(cycles.div_ceil(LEAST_OF_ITERATION))
}

/// The maximum number of cycles of one round, without the reaction of the part on the CPU; `None` if no time can be stated for this CPU.
#[must_use]
pub fn round_cycles(link: &Link, cpu: &Cpu, timing: &Timing) -> Option<u64> {
    let cycles = cpu.link_cycles?;
    let wait = match settle(cpu, timing) {
        Wait::Nops(n) => n,
        // The iteration that ends the loop counts too.
        Wait::Loop(n) => (n + 1) * u64::from(cycles.wait),
    };
    let acts = link.acts.iter().map(|act| match act {
        Act::Settle => wait,
        Act::React => 0,
        Act::Latch
        | Act::Hand { .. }
        | Act::Put { .. }
        | Act::Get { .. }
        | Act::AskChip { .. }
        | Act::AskCpu { .. }
        | Act::HandMore { .. }
        | Act::Clock { .. } => u64::from(cycles.act),
    });
    Some(u64::from(cycles.call) + acts.sum::<u64>())
}

/// A lower bound on the cycles of a reaction of any part on this CPU: the call of the function, with one pin. `None` if no time can be stated.
#[must_use]
pub fn least_cycles(cpu: &Cpu) -> Option<u64> {
    let cycles = cpu.link_cycles?;
    Some(u64::from(cycles.call) + u64::from(cycles.act))
}

/// The longest time from a change of a pin of a chip that runs on its own to the outputs that follow from it, in nanoseconds: the change just misses a clock edge, passes
/// through the synchronisers, and then is stored.
#[must_use]
pub fn chip_ns(timing: &Timing) -> u64 {
    let clocks = SYNCHRONISERS as u64 + 1;
    let period = 1_000_000_000_u64.div_ceil(u64::from(OSCILLATOR_HZ));
    clocks * period + u64::from(timing.settle_ns)
}
