//! The parts of a reaction of a Grafcet chart before and after the evolution, for code that organises the evolution itself.
//!
//! [`super::program`] writes the whole reaction as straight-line code with one bit per step. A back end with one state variable for each sequential component
//! generates the evolution itself; the timers before it and the controlled actions and free timers after it (§3.5, E1 and E3 of §3.9) are taken from here, made
//! by the same builder, so that their meaning is defined only once.
//!
//! ```text
//! before      free timers and the timers of actions advance       L2
//!             (the caller: step times, evolution)                 L4
//! control     latches, timers and Q of controlled actions         E1, pass 1
//! bodies      their bodies                                        E1, passes 2 and 3
//! end         free timers                                         E3
//!             (the caller: outputs; `outputs` contains the values of those that actions drive)
//! ```

use super::ending::Controlled;
use super::{Additions, Builder, ProgramOptions, when};
use crate::arena::IdMap;
use crate::diag::Diagnostic;
use crate::net::{
    ActionId, ControlledAction, Driver, Net, OutputId, Qualifier, Step, StepId, Timer,
};
use crate::program::{CellId, Expr, Program, Stmt};
use crate::validate::Valid;

/// The frame of a reaction. Cells and temporaries belong to `program`, whose body is empty.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Frame {
    /// Cells with their values after reset, temporaries, and the visible results of the reset.
    pub program: Program,
    /// Statements before the evolution.
    pub before: Vec<Stmt>,
    /// Statements after the evolution, before the bodies. Like the bodies and `end`, they read step bits and step times, and store neither.
    pub control: Vec<Stmt>,
    /// The bodies of the actions, in order.
    pub bodies: Vec<ActionBody>,
    /// Statements after the bodies.
    pub end: Vec<Stmt>,
    /// The value that each output driven by an action has after `control`, without the emergency.
    pub outputs: Vec<(OutputId, Expr)>,
    /// The cell of each step's bit; the caller stores these values.
    pub bits: IdMap<Step, CellId>,
    /// The cell of each step's time, if these statements read it; the caller stores these values.
    pub elapsed: IdMap<Step, Option<CellId>>,
    /// The counter of each free timer that something reads.
    pub timers: IdMap<Timer, Option<CellId>>,
    /// Q of each action, if something reads it.
    pub actions: IdMap<ControlledAction, Option<CellId>>,
}

/// The body of a controlled action, or its final scan.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ActionBody {
    /// The body runs while one of these steps is active; `None` if the condition is in `list`.
    pub steps: Option<Vec<StepId>>,
    /// The statements; if `steps` is `None`, they include the condition under which the body runs.
    pub list: Vec<Stmt>,
}

/// The frame of a Grafcet chart without tasks.
///
/// # Errors
/// Constructs that a bounded program cannot express ([`super::codes`]).
pub fn frame(net: &Valid<Net>) -> Result<Frame, Vec<Diagnostic>> {
    let mut builder = Builder::new(net, &ProgramOptions::default(), Additions::default());
    let mut before = Vec::new();
    builder.advance_timers(&mut before);
    let mut control = Vec::new();
    let plain = IdMap::build(&net.actions, |id, _| is_plain(net, &builder, id));
    let Controlled { q, runs } = builder.action_controls(|id| plain[id], &mut control);
    let mut bodies = Vec::new();
    for (id, condition) in runs {
        let action = &net.actions[id];
        let body = builder.list(&action.body);
        if plain[id] {
            let mut steps: Vec<StepId> = action.uses.iter().map(|one| one.step).collect();
            steps.sort_unstable();
            steps.dedup();
            bodies.push(ActionBody { steps: Some(steps), list: body });
        } else {
            let mut list = Vec::new();
            when(condition, body, &mut list);
            bodies.push(ActionBody { steps: None, list });
        }
    }
    let mut end = Vec::new();
    builder.free_timers(&mut end);
    if !builder.findings.is_empty() {
        return Err(builder.findings);
    }
    let driven = net.outputs.iter().filter_map(|(id, output)| match output.driver {
        Driver::Controlled(action) => Some((id, q[action].clone())),
        Driver::Continuous(_)
        | Driver::Mealy(_)
        | Driver::Fires(_)
        | Driver::Stored(_)
        | Driver::Extern { .. } => None,
    });
    let mut frame = Frame {
        program: Program { temps: std::mem::take(&mut builder.temps), ..Program::default() },
        before,
        control,
        bodies,
        end,
        outputs: driven.collect(),
        bits: builder.step.clone(),
        elapsed: builder.times.cell.clone(),
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
        let mut lists = vec![&mut self.before, &mut self.control, &mut self.end];
        lists.extend(self.bodies.iter_mut().map(|body| &mut body.list));
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
        self.bodies.retain(|body| !body.list.is_empty());
        self
    }
}

/// True if only step bits decide when the body runs, and nothing reads Q.
fn is_plain(net: &Net, builder: &Builder<'_>, id: ActionId) -> bool {
    let action = &net.actions[id];
    builder.action_q[id].is_none()
        && !net.outputs.values().any(|output| output.driver == Driver::Controlled(id))
        && action.uses.iter().all(|one| one.qualifier == Qualifier::N && one.condition.is_none())
}
