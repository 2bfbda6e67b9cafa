//! What surrounds the evolution in a reaction of a Grafcet chart, for code that organises the evolution itself.
//!
//! [`super::program`] writes the whole reaction as straight-line code with one bit per step. A back end with one state variable for each sequential
//! component makes the evolution itself; the timers before it and the controlled actions and free timers after it (§3.5, E1 and E3 of §3.9) are taken
//! from here, made by the same builder, so that they are not decided twice.
//!
//! ```text
//! before      free timers and the timers of actions advance       L2
//!             (the caller: step times, evolution)                 L4
//! after       controlled actions with their bodies, free timers   E1 E3
//!             (the caller: outputs; those of actions have the values of `outputs`)
//! ```

use super::{Builder, ProgramOptions};
use crate::arena::IdMap;
use crate::diag::Diagnostic;
use crate::net::{ControlledAction, Driver, Net, OutputId, Step, Timer};
use crate::program::{CellId, Expr, Program, Stmt};
use crate::validate::Valid;

/// The frame of a reaction. Cells and temporaries belong to `program`, whose body is empty.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Frame {
    /// Cells with their values after reset, temporaries, and the visible results of the reset.
    pub program: Program,
    /// Statements before the evolution.
    pub before: Vec<Stmt>,
    /// Statements after the evolution. They read step bits and step times, and store neither.
    pub after: Vec<Stmt>,
    /// The value of each output that an action drives, after `after`, without the emergency.
    pub outputs: Vec<(OutputId, Expr)>,
    /// The cell of each step's bit; the caller stores these values.
    pub bits: IdMap<Step, CellId>,
    /// The cell of each step's time, if `after` reads it; the caller stores these values.
    pub elapsed: IdMap<Step, Option<CellId>>,
    /// The counter of each free timer that something reads.
    pub timers: IdMap<Timer, Option<CellId>>,
    /// Q of each action, if something reads it.
    pub actions: IdMap<ControlledAction, Option<CellId>>,
}

/// The frame of a Grafcet chart without tasks.
///
/// # Errors
/// Constructs that a bounded program cannot express ([`super::codes`]).
pub fn frame(net: &Valid<Net>) -> Result<Frame, Vec<Diagnostic>> {
    let mut builder = Builder::new(net, &ProgramOptions::default());
    let mut before = Vec::new();
    builder.advance_timers(&mut before);
    let mut after = Vec::new();
    let q = builder.controlled_actions(&mut after);
    builder.free_timers(&mut after);
    if !builder.findings.is_empty() {
        return Err(builder.findings);
    }
    let driven = net.outputs.iter().filter_map(|(id, output)| match output.driver {
        Driver::Controlled(action) => Some((id, q[action].clone())),
        Driver::Continuous(_) | Driver::Mealy(_) | Driver::Stored(_) | Driver::Extern { .. } => {
            None
        }
    });
    let mut frame = Frame {
        program: Program { temps: std::mem::take(&mut builder.temps), ..Program::default() },
        before,
        after,
        outputs: driven.collect(),
        bits: builder.step.clone(),
        elapsed: builder.elapsed.clone(),
        timers: IdMap::build(&net.timers, |id, _| builder.timer[id].map(|(ticks, _)| ticks)),
        actions: builder.action_q.clone(),
    };
    super::with_reset(builder, net, &mut frame.program);
    Ok(frame.pruned())
}

impl Frame {
    /// The frame without cells and temporaries that are never read.
    fn pruned(mut self) -> Self {
        let kept: Vec<CellId> =
            self.timers.values().chain(self.actions.values()).flatten().copied().collect();
        let mut exprs: Vec<&mut Expr> = self.outputs.iter_mut().map(|(_, value)| value).collect();
        let mut lists = [&mut self.before, &mut self.after];
        let renamed =
            super::prune::prune_pieces(&mut self.program, &mut lists, &mut exprs, None, &kept);
        for id in self.bits.values_mut() {
            *id = renamed.cell(*id).unwrap_or(*id);
        }
        let optional = (self.elapsed.values_mut())
            .chain(self.timers.values_mut())
            .chain(self.actions.values_mut());
        for id in optional {
            *id = id.and_then(|id| renamed.cell(id));
        }
        self
    }
}
