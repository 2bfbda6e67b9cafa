//! The times of steps that share a timer, as functions of its register.
//!
//! `s.t` is the register while s is active and 0 otherwise. The register counts to the largest cap, so the time of a step with a smaller cap is the minimum of
//! both. These functions are not part of the circuit: a proof reads the state of the net from them ([`Logic::decoded`]).

use super::{Encoder, Value};
use crate::word::{self, Word};
use grafsynth_ir::Gather;
use grafsynth_ir::logic::{Decoded, FlopBit, NodeId, shown_by};
use grafsynth_ir::net::StepId;
use grafsynth_ir::program::Origin;
use std::collections::BTreeMap;

impl Encoder<'_> {
    /// Adds the times of all steps that share a timer.
    pub(super) fn shared_times(&mut self) {
        let program = self.program;
        for timer in &program.shared_timers {
            let origin = Origin::SharedElapsed(timer.steps[0].0);
            let cell = program.cells.iter().find(|(_, cell)| cell.origin == origin);
            let register = cell.map(|(id, _)| self.registers[self.places[id]].clone());
            // A timer that nothing reads has no register.
            let Some(Value::Int(ticks)) = register else { continue };
            for &(step, cap) in &timer.steps {
                self.shared_time(step, cap, &ticks);
            }
        }
    }

    fn shared_time(&mut self, step: StepId, cap: i64, ticks: &Word) {
        let active = self.stored_activity(step);
        let none = Word::constant(0);
        let time = word::select(&mut self.builder, active, ticks, &none);
        let time = time.saturated(&mut self.builder, 0, cap);
        for (bit, node) in time.register_bits(&mut self.builder, 0, cap).into_iter().enumerate() {
            let bit = u32::try_from(bit).unwrap_or(u32::MAX);
            let holds = FlopBit { origin: Origin::Elapsed(step), element: 0, bit, inverted: false };
            let name = format!("{}.t_{bit}", self.net.steps[step].name);
            self.builder.logic.decoded.push(Decoded { name, holds, node });
        }
    }

    /// Whether the step is active, as a function of the flip-flops.
    fn stored_activity(&mut self, step: StepId) -> NodeId {
        let held: BTreeMap<Origin, _> = (self.builder.logic.flops.iter())
            .filter_map(|(id, flop)| Some((flop.holds?.origin, id)))
            .gather();
        let shown = shown_by(self.net, |origin| held.contains_key(&origin));
        let bits: Vec<NodeId> =
            shown[step].iter().map(|origin| self.builder.flop(held[origin])).collect();
        self.builder.and(bits)
    }
}
