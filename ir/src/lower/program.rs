//! One reaction of a net as a bounded sequential program (`docs/semantics.md` §3.9 as straight-line code).
//!
//! ```text
//!            net                                   program (single, policy priority)
//! t1: a -> b when x                      latch     a.t := a.t + dt          if a.t is read at all
//! t2: a -> c when y            ──►       check     fire t1 := a and x;  fire t2 := a and y and not fire t1
//! b entry { n := n + 1 }                 fire      if fire t1 { n := n + 1 };  a := ..;  b := ..;  c := ..
//!                                        end       controlled actions, tasks, timers, outputs
//! ```
//!
//! Stable evolution wraps check and fire in one [`Stmt::Repeat`]; statecharts add their queues to its condition. Where semantics.md requires an order, the
//! program has a sequence; where it requires earlier values, the program reads cells before they are stored, or temporaries set before. Values that are never
//! read are not created: a step whose time is not read has no counter, a policy without competition has no ages, and so on (`needs`).
//!
//! The program of the reset is not part of the result: it is made in the same way and executed once ([`crate::program_run`]), and only its results are kept, as
//! constants.
//!
//! | module | semantics |
//! |---|---|
//! | `needs` | which values are read |
//! | `read` | expressions of the net over the program's cells and temps |
//! | `lists` | action lists (§3.3) |
//! | `choose` | conflict policies outside statecharts (§4) |
//! | `change` | the next situation: enclosing steps, forcing, restart (NEXT and FIRE of §3.9) |
//! | `grafcet` | the evolution outside statecharts |
//! | `statechart` | the evolution of statecharts, with their `tree`, their `queues`, the `order` of their actions, and the states that they leave and `enter` |
//! | `frame` | what surrounds the evolution of a Grafcet chart, for code that organises the evolution itself |
//! | `pieces` | the parts of a statechart's reaction, for code that arranges them differently |
//! | `ending` | the end of a reaction (§3.8) |
//! | `share` | one timer for steps that exclude each other |
//! | `prune` | removes values that are written but never read |

mod change;
mod choose;
pub mod codes;
mod ending;
mod enter;
mod frame;
mod grafcet;
mod lists;
mod order;
mod pieces;
mod prune;
mod queues;
mod read;
mod share;
mod show;
mod statechart;
#[cfg(test)]
mod tests;
mod tree;

use crate::Gather;
use std::collections::{BTreeMap, BTreeSet};

use crate::arena::{Arena, IdMap};
use crate::diag::Diagnostic;
use crate::expr::Type;
use crate::instance::Carried;
use crate::net::{
    ControlledAction, EdgeOperand, Evolution, History, Input, InputKind, Net, Part, SendSlot, Step,
    StepId, Timer, Transition, Var,
};
use crate::plan::{Needs, Ranks};
use crate::program::{
    ActionPart, Cell, CellId, Expr, Leaf, Mark, Origin, Program, SharedTimer, Stmt, Temp, TempId,
    TempRole, statements,
};
use crate::program_run::Machine;
use crate::span::Span;
use crate::validate::Valid;

pub use frame::{Frame, frame};
pub use pieces::{Pieces, StatePieces, TransitionPieces, pieces};
pub use share::shared_timers;
pub use show::show;

use share::Times;

/// Options for the program; all of them give a correct program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ProgramOptions {
    /// Remove cells and temporaries that are written but never read. Steps, variables with a trace column, and cells that outputs need are always kept.
    pub prune: bool,
    /// Keep what only properties read: times of steps and free timers that no expression of the chart reads.
    pub properties: bool,
}

/// The contents of a program in addition to the reaction of the net.
#[derive(Debug, Clone, Copy, Default)]
pub struct Additions<'a> {
    /// Adds a [`Mark`] wherever something fires. Reset has no marks.
    pub marks: bool,
    /// Timers that steps share, from [`shared_timers`].
    pub shared: &'a [SharedTimer],
}

impl Default for ProgramOptions {
    fn default() -> Self {
        ProgramOptions { prune: true, properties: false }
    }
}

/// The program of one reaction, with the state after reset.
///
/// Its size is linear in the size of the net, except for transitions that compete under `priority-age` (one bit for each pair).
///
/// # Errors
/// Constructs that a bounded program cannot express; see [`codes`].
pub fn program(net: &Valid<Net>, options: &ProgramOptions) -> Result<Program, Vec<Diagnostic>> {
    program_with(net, options, Additions::default())
}

/// Like [`program`], with additions.
///
/// # Errors
/// The errors of [`program`].
pub fn program_with(
    net: &Valid<Net>,
    options: &ProgramOptions,
    additions: Additions<'_>,
) -> Result<Program, Vec<Diagnostic>> {
    let mut builder = Builder::new(net, options, additions);
    let statechart = net.settings.policy.is_statechart();
    let body = if statechart { builder.statechart_reaction() } else { builder.grafcet_reaction() };
    if !builder.findings.is_empty() {
        return Err(builder.findings);
    }
    let temps = std::mem::take(&mut builder.temps);
    let evolution = builder.evolution;
    let carried = std::mem::take(&mut builder.carried);
    let shared_timers = additions.shared.to_vec();
    let mut program =
        Program { body, temps, evolution, carried, shared_timers, ..Program::default() };
    with_reset(builder, net, &mut program);
    Ok(if options.prune { prune::prune(program) } else { program })
}

/// Adds the cells with their values after reset, and the visible results of the reset. The reaction is complete, so its temporaries already belong to the
/// program.
fn with_reset(mut builder: Builder<'_>, net: &Net, program: &mut Program) {
    // Reset has its own temporaries, over the same cells.
    builder.reset = true;
    builder.marks = false;
    builder.forget_temps();
    let statechart = net.settings.policy.is_statechart();
    let body = if statechart { builder.statechart_reset() } else { builder.grafcet_reset() };
    let reset = Program {
        cells: builder.cells,
        temps: std::mem::take(&mut builder.temps),
        body,
        ..Program::default()
    };
    let mut machine = Machine::new(&reset);
    let shown = machine.react(&inputs_at_reset(net), 0);
    let after: Vec<Vec<i64>> = reset.cells.ids().map(|cell| machine.cell(cell).to_vec()).collect();
    program.cells = reset.cells;
    for ((_, cell), init) in program.cells.iter_mut().zip(after) {
        cell.init = init;
    }
    program.reset_effects = shown.effects;
    program.reset_outputs = shown.outputs;
    program.reset_outputs.resize(net.outputs.len(), 0);
    program.reset_fault = shown.fault;
}

/// The inputs that the reset reads: all are 0; if the range of an input excludes 0, the value nearest to 0.
fn inputs_at_reset(net: &Net) -> Vec<i64> {
    net.inputs.values().map(|input| input.ty.saturate(0)).collect()
}

/// State that the passes share: the net, the values that it needs, the cells and temporaries made so far, and the expressions that currently give the
/// values within a reaction.
struct Builder<'a> {
    net: &'a Net,
    needs: Needs,
    ranks: Ranks,
    findings: Vec<Diagnostic>,
    cells: Arena<Cell>,
    temps: Arena<Temp>,
    /// The program of the reset is being built: there are no edges and no events.
    reset: bool,
    marks: bool,
    /// Timers that steps share.
    shared: &'a [SharedTimer],
    /// The condition of the evolution loop.
    evolution: Option<TempId>,
    /// For a statechart: the temporaries whose values at the end of a check are read later.
    carried: Vec<(TempId, Carried)>,

    step: IdMap<Step, CellId>,
    times: Times,
    last_elapsed: IdMap<Step, Option<CellId>>,
    task: IdMap<Step, Option<CellId>>,
    var: IdMap<Var, CellId>,
    edge: IdMap<EdgeOperand, Option<CellId>>,
    timer: IdMap<Timer, Option<(CellId, CellId)>>,
    pending: IdMap<Input, Option<CellId>>,
    action_q: IdMap<ControlledAction, Option<CellId>>,
    action_latch: BTreeMap<(crate::net::ActionId, ActionPart), CellId>,
    action_time: BTreeMap<(crate::net::ActionId, ActionPart), CellId>,
    older: BTreeMap<(StepId, StepId), CellId>,
    send: IdMap<SendSlot, Option<CellId>>,
    recorded: BTreeMap<(crate::arena::Id<History>, StepId), CellId>,
    ended: IdMap<Part, Option<CellId>>,
    held: BTreeMap<(crate::net::OutputId, crate::net::PartId), CellId>,
    queues: Option<queues::Queues>,
    now: Now,
    /// Lists read the values at the start of the micro-step.
    simultaneous: bool,
}

/// The values that were set earlier in the program.
struct Now {
    /// Whether each chart had ended before this reaction.
    had_ended: IdMap<Part, Option<Expr>>,
    /// The current value of an edge's operand, at the check.
    edge: IdMap<EdgeOperand, Option<Expr>>,
    /// Whether the event is present in this check.
    holds: IdMap<Input, Option<Expr>>,
    /// Whether a transition is fireable; only for transitions for which this is read or that have passed the check.
    fireable: IdMap<Transition, Option<Expr>>,
    /// With simultaneous assignments: the cells stored so far in this micro-step, the temporaries that keep their old values, and the statements that set
    /// those.
    stored: BTreeSet<CellId>,
    before: BTreeMap<CellId, TempId>,
    hoisted: Vec<Stmt>,
    /// The fault flag of the reaction, if it can be set before the end.
    fault: Option<TempId>,
    /// Whether END waits for a later round (§10.2); `None` if it never does.
    waits: Option<Expr>,
}

impl Now {
    fn new(net: &Net) -> Self {
        Now {
            had_ended: IdMap::filled(&net.parts, None),
            edge: IdMap::filled(&net.edges, None),
            holds: IdMap::filled(&net.inputs, None),
            fireable: IdMap::filled(&net.transitions, None),
            stored: BTreeSet::new(),
            before: BTreeMap::new(),
            hoisted: Vec::new(),
            fault: None,
            waits: None,
        }
    }
}

impl<'a> Builder<'a> {
    fn new(net: &'a Net, options: &ProgramOptions, additions: Additions<'a>) -> Self {
        let needs = Needs::of(net, options.properties);
        let mut cells = Arena::new();
        let tick_type = |cap: i64| Type::Int { lo: 0, hi: cap };
        let step = IdMap::build(&net.steps, |id, step| {
            cells.push(Cell::plain(step.name.text.clone(), Type::Bool, Origin::Step(id)))
        });
        let times = Times::of(net, &needs, additions.shared, &mut cells);
        let last_elapsed = IdMap::build(&net.steps, |id, step| {
            let (name, ty) = (format!("{}.T", step.name), tick_type(needs.last_elapsed[id]?));
            Some(cells.push(Cell::plain(name, ty, Origin::LastElapsed(id))))
        });
        let task = IdMap::build(&net.steps, |id, step| {
            let ty = tick_type(i64::try_from(step.tasks.len()).unwrap_or(i64::MAX));
            let cell = Cell::plain(format!("{}.task", step.name), ty, Origin::TaskIndex(id));
            (!step.tasks.is_empty()).then(|| cells.push(cell))
        });
        let edge = IdMap::build(&net.edges, |id, operand| {
            let name = read::name_of_operand(net, operand);
            needs.edge[id].then(|| cells.push(Cell::plain(name, Type::Bool, Origin::Edge(id))))
        });
        let timer = IdMap::build(&net.timers, |id, timer| {
            let cap = needs.timer[id]?;
            let init = vec![if timer.starts_expired { cap } else { 0 }];
            let time = Cell::plain(timer.name.text.clone(), tick_type(cap), Origin::Timer(id));
            let runs = format!("{}.runs", timer.name);
            let runs = Cell::plain(runs, Type::Bool, Origin::TimerCondition(id));
            Some((cells.push(Cell { init, ..time }), cells.push(runs)))
        });
        let statechart = net.settings.policy.is_statechart();
        let pending = IdMap::build(&net.inputs, |id, input| {
            let cell =
                Cell::plain(format!("{}.pending", input.name), Type::Bool, Origin::Pending(id));
            (needs.raised[id] && !statechart).then(|| cells.push(cell))
        });
        let send = IdMap::build(&net.sends, |id, slot| {
            let (name, ty) = (format!("{}.left", slot.name), tick_type(i64::from(slot.delay)));
            (slot.delay > 0).then(|| cells.push(Cell::plain(name, ty, Origin::SendTimer(id))))
        });
        let var = IdMap::build(&net.vars, |id, var| {
            let plain = Cell::plain(var.name.text.clone(), var.ty, Origin::Var(id));
            cells.push(Cell { len: var.len, init: var.init.clone(), ..plain })
        });
        let mut builder = Builder {
            net,
            ranks: Ranks::of(net),
            findings: Vec::new(),
            cells,
            temps: Arena::new(),
            reset: false,
            marks: additions.marks,
            shared: additions.shared,
            evolution: None,
            carried: Vec::new(),
            step,
            times,
            last_elapsed,
            task,
            var,
            edge,
            timer,
            pending,
            action_q: IdMap::filled(&net.actions, None),
            action_latch: BTreeMap::new(),
            action_time: BTreeMap::new(),
            older: BTreeMap::new(),
            send,
            recorded: BTreeMap::new(),
            ended: IdMap::filled(&net.parts, None),
            held: BTreeMap::new(),
            queues: None,
            now: Now::new(net),
            simultaneous: false,
            needs,
        };
        builder.action_cells();
        if statechart {
            builder.statechart_cells();
        }
        builder
    }

    /// Forgets all values that were set earlier in the program.
    fn forget_temps(&mut self) {
        self.now = Now::new(self.net);
    }

    /// A new plain cell, 0 before reset.
    fn new_cell(&mut self, name: String, ty: Type, origin: Origin) -> CellId {
        self.cells.push(Cell::plain(name, ty, origin))
    }

    fn new_temp(&mut self, name: impl Into<String>, ty: Type, role: TempRole) -> TempId {
        self.temps.push(Temp { name: name.into(), ty, role })
    }

    /// `value` as a named temporary; unchanged if it is a leaf or a constant.
    fn named(
        &mut self,
        name: impl Into<String>,
        role: TempRole,
        value: Expr,
        out: &mut Vec<Stmt>,
    ) -> Expr {
        let value = crate::simplify::simplify(&value);
        if matches!(
            value.kind,
            crate::expr::ExprKind::Bool(_) | crate::expr::ExprKind::Leaf(Leaf::Temp(_))
        ) {
            return value;
        }
        let span = value.span;
        let temp = self.new_temp(name, Type::Bool, role);
        out.push(Stmt::Set(temp, value));
        Expr::leaf(Leaf::Temp(temp), span)
    }

    /// Adds the marks of a micro-step.
    fn mark(&self, fire: &IdMap<Transition, Expr>, out: &mut Vec<Stmt>) {
        if self.marks && self.limit().is_some() {
            out.push(Stmt::Mark(Mark::MicroStep));
        }
        for (id, fires) in fire.iter().filter(|_| self.marks) {
            when(fires.clone(), vec![Stmt::Mark(Mark::Fires(id))], out);
        }
    }

    fn limit(&self) -> Option<u32> {
        match self.net.settings.evolution {
            Evolution::Single => None,
            Evolution::Stable { limit } => Some(limit),
        }
    }

    fn is_active(&self, step: StepId) -> Expr {
        cell(self.step[step])
    }

    /// True for events that the environment may raise.
    fn is_external(&self, event: crate::net::InputId) -> bool {
        self.net.inputs[event].kind != InputKind::InternalEvent
    }
}

fn cell(id: CellId) -> Expr {
    Expr::leaf(Leaf::Cell(id), Span::default())
}

fn temp(id: TempId) -> Expr {
    Expr::leaf(Leaf::Temp(id), Span::default())
}

/// Adds statements under a condition; adds nothing if the condition is false, and the plain statements if it is true.
fn when(condition: Expr, then: Vec<Stmt>, out: &mut Vec<Stmt>) {
    let condition = crate::simplify::simplify(&condition);
    if then.is_empty() || condition.is_false() {
        return;
    }
    if condition.is_true() {
        out.extend(then);
        return;
    }
    if let Some(Stmt::If(last, list, otherwise)) = out.last_mut()
        && otherwise.is_empty()
        && crate::simplify::compare_shapes(last, &condition).is_eq()
        && !stores_any_leaf_of(list, &condition)
    {
        list.extend(then);
        return;
    }
    out.push(Stmt::If(condition, then, Vec::new()));
}

/// True if the list may change the value of the condition.
fn stores_any_leaf_of(list: &[Stmt], condition: &Expr) -> bool {
    let leaves: BTreeSet<&Leaf> = condition.leaves().gather();
    statements(list).any(|stmt| stmt.target().is_some_and(|target| leaves.contains(&target)))
}
