//! One reaction of a net as a bounded sequential program (`docs/semantics.md` §3.9, made straight).
//!
//! ```text
//!            net                                   program (single, policy priority)
//! t1: a -> b when x                      latch     a.t := a.t + dt          if a.t is read at all
//! t2: a -> c when y            ──►       check     fire t1 := a and x;  fire t2 := a and y and not fire t1
//! b entry { n := n + 1 }                 fire      if fire t1 { n := n + 1 };  a := ..;  b := ..;  c := ..
//!                                        end       controlled actions, tasks, timers, outputs
//! ```
//!
//! Stable evolution wraps check and fire into one [`Stmt::Repeat`]; statecharts add their queues to its condition. Where the page says "in order" the
//! program has a sequence; where it says "as it stood" the program reads cells before they are stored or temps set before. What nobody reads does not
//! exist: a step without reader of its time has no counter, a policy without competition no ages, and so on (`needs`).
//!
//! Reset is not a program of its own: it is made the same way, executed once ([`crate::program_run`]) and leaves constants behind.
//!
//! | module | semantics |
//! |---|---|
//! | `needs` | what is read at all |
//! | `read` | expressions of the net over the program's cells and temps |
//! | `lists` | action lists (§3.3) |
//! | `choose` | conflict policies outside statecharts (§4) |
//! | `change` | the next situation: enclosing steps, forcing, restart (NEXT and FIRE of §3.9) |
//! | `grafcet` | the evolution outside statecharts |
//! | `statechart` | the evolution of statecharts, with their `tree`, their `queues`, the `order` of their actions, and what they leave and `enter` |
//! | `pieces` | the same in pieces, for code of another shape |
//! | `ending` | the end of a reaction (§3.8) |
//! | `prune` | drops what is written and never read |

mod change;
mod choose;
pub mod codes;
mod ending;
mod enter;
mod grafcet;
mod lists;
mod needs;
mod order;
mod pieces;
mod prune;
mod queues;
mod ranks;
mod read;
mod show;
mod statechart;
#[cfg(test)]
mod tests;
mod tree;

use std::collections::{BTreeMap, BTreeSet};

use crate::arena::{Arena, IdMap};
use crate::diag::Diagnostic;
use crate::expr::Type;
use crate::net::{
    ControlledAction, EdgeOperand, Evolution, History, Input, InputKind, Net, Part, SendSlot, Step,
    StepId, Timer, Transition, Var, Verbatim,
};
use crate::program::{
    ActionPart, Cell, CellId, Expr, Leaf, Origin, Program, Stmt, Temp, TempId, TempRole,
};
use crate::program_run::Machine;
use crate::span::Span;
use crate::validate::Valid;

pub use pieces::{Pieces, StatePieces, TransitionPieces, pieces};
pub use show::show;

use needs::Needs;
use ranks::Ranks;

/// What is wanted of a program besides being right.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ProgramOptions {
    /// Drop cells and temps that are written and never read. Steps, variables that a trace shows, and the cells that outputs need always stay.
    pub prune: bool,
    /// Keep what only properties read: times of steps and free timers that no expression of the chart asks for.
    pub properties: bool,
}

/// Text of a target language that a program carries where something fires, so that a back end can watch a reaction without asking again what it does.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Marks {
    /// At the start of each micro-step of an evolution until stable; a single check needs no such mark.
    pub micro_step: Verbatim,
    /// Where each transition or reaction fires, before any list of its micro-step runs.
    pub fires: IdMap<Transition, Verbatim>,
}

impl Default for ProgramOptions {
    fn default() -> Self {
        ProgramOptions { prune: true, properties: false }
    }
}

/// The program of one reaction, with the state after reset.
///
/// Its size is linear in that of the net, but for transitions that truly compete under `priority-age` (one bit for each pair).
///
/// # Errors
/// What no bounded program can say; see [`codes`].
pub fn program(net: &Valid<Net>, options: &ProgramOptions) -> Result<Program, Vec<Diagnostic>> {
    program_with(net, options, None)
}

/// As [`program`], with a mark wherever something fires. Reset makes none.
///
/// # Errors
/// As [`program`].
pub fn marked_program(
    net: &Valid<Net>,
    options: &ProgramOptions,
    marks: &Marks,
) -> Result<Program, Vec<Diagnostic>> {
    program_with(net, options, Some(marks))
}

fn program_with(
    net: &Valid<Net>,
    options: &ProgramOptions,
    marks: Option<&Marks>,
) -> Result<Program, Vec<Diagnostic>> {
    let mut builder = Builder::new(net, options);
    builder.marks = marks;
    let statechart = net.settings.policy.is_statechart();
    let body = if statechart { builder.statechart_reaction() } else { builder.grafcet_reaction() };
    if !builder.findings.is_empty() {
        return Err(builder.findings);
    }
    let temps = std::mem::take(&mut builder.temps);
    let evolution = builder.evolution;
    let mut program = Program { body, temps, evolution, ..Program::default() };
    with_reset(builder, net, &mut program);
    Ok(if options.prune { prune::prune(program) } else { program })
}

/// Adds the cells with their values after reset, and what reset shows. The builder has made the reaction, and its temps are the program's by now.
fn with_reset(mut builder: Builder<'_>, net: &Net, program: &mut Program) {
    // Reset has temps of its own, over the same cells.
    builder.reset = true;
    builder.marks = None;
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

/// Reset reads all inputs as 0; one that cannot be 0 as the value nearest to it.
fn inputs_at_reset(net: &Net) -> Vec<i64> {
    net.inputs.values().map(|input| input.ty.saturate(0)).collect()
}

/// What the passes share: the net, what it needs, the cells and temps made so far, and how the values that only exist within a reaction are read
/// at the moment.
struct Builder<'a> {
    net: &'a Net,
    needs: Needs,
    ranks: Ranks,
    findings: Vec<Diagnostic>,
    cells: Arena<Cell>,
    temps: Arena<Temp>,
    /// Reset is being made: no edges, no events.
    reset: bool,
    marks: Option<&'a Marks>,
    /// What the loop of the evolution asks.
    evolution: Option<TempId>,

    step: IdMap<Step, CellId>,
    elapsed: IdMap<Step, Option<CellId>>,
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
    /// Charts that had ended before this reaction.
    had_ended: IdMap<Part, Option<Expr>>,
    queues: Option<queues::Queues>,

    /// The present value of an edge's operand, at the check.
    edge_now: IdMap<EdgeOperand, Option<Expr>>,
    /// Whether the event holds in this check.
    holds: IdMap<Input, Option<Expr>>,
    /// Fireable, of transitions that are asked for it or that have passed the check.
    fireable: IdMap<Transition, Option<Expr>>,
    /// With simultaneous assignments: cells stored so far in this micro-step, the temps that keep what they were, and what sets those.
    stored: BTreeSet<CellId>,
    before: BTreeMap<CellId, TempId>,
    hoisted: Vec<Stmt>,
    /// Lists read the values at the start of the micro-step.
    simultaneous: bool,
    /// The fault flag of the reaction, where it can be set on the way.
    fault: Option<TempId>,
}

impl<'a> Builder<'a> {
    fn new(net: &'a Net, options: &ProgramOptions) -> Self {
        let needs = Needs::of(net, options.properties);
        let mut cells = Arena::new();
        let tick_type = |cap: i64| Type::Int { lo: 0, hi: cap };
        let mut plain = |name: String, ty: Type, init: i64, origin: Origin| {
            cells.push(Cell { name, ty, len: None, init: vec![init], origin })
        };
        let step = IdMap::build(&net.steps, |id, step| {
            plain(step.name.text.clone(), Type::Bool, 0, Origin::Step(id))
        });
        let elapsed = IdMap::build(&net.steps, |id, step| {
            needs.elapsed[id].map(|cap| {
                plain(format!("{}.t", step.name), tick_type(cap), 0, Origin::Elapsed(id))
            })
        });
        let last_elapsed = IdMap::build(&net.steps, |id, step| {
            let name = || format!("{}.T", step.name);
            needs.last_elapsed[id]
                .map(|cap| plain(name(), tick_type(cap), 0, Origin::LastElapsed(id)))
        });
        let task = IdMap::build(&net.steps, |id, step| {
            (!step.tasks.is_empty()).then(|| {
                let hi = i64::try_from(step.tasks.len()).unwrap_or(i64::MAX);
                plain(
                    format!("{}.task", step.name),
                    Type::Int { lo: 0, hi },
                    0,
                    Origin::TaskIndex(id),
                )
            })
        });
        let edge = IdMap::build(&net.edges, |id, operand| {
            needs.edge[id].then(|| {
                plain(read::name_of_operand(net, operand), Type::Bool, 0, Origin::Edge(id))
            })
        });
        let timer = IdMap::build(&net.timers, |id, timer| {
            needs.timer[id].map(|cap| {
                let init = if timer.starts_expired { cap } else { 0 };
                (
                    plain(timer.name.text.clone(), tick_type(cap), init, Origin::Timer(id)),
                    plain(
                        format!("{}.runs", timer.name),
                        Type::Bool,
                        0,
                        Origin::TimerCondition(id),
                    ),
                )
            })
        });
        let statechart = net.settings.policy.is_statechart();
        let pending = IdMap::build(&net.inputs, |id, input| {
            (needs.raised[id] && !statechart).then(|| {
                plain(format!("{}.pending", input.name), Type::Bool, 0, Origin::Pending(id))
            })
        });
        let send = IdMap::build(&net.sends, |id, slot| {
            let ty = tick_type(i64::from(slot.delay));
            (slot.delay > 0)
                .then(|| plain(format!("{}.left", slot.name), ty, 0, Origin::SendTimer(id)))
        });
        let var = IdMap::build(&net.vars, |id, var| {
            cells.push(Cell {
                name: var.name.text.clone(),
                ty: var.ty,
                len: var.len,
                init: var.init.clone(),
                origin: Origin::Var(id),
            })
        });
        let mut builder = Builder {
            net,
            ranks: Ranks::of(net),
            findings: Vec::new(),
            cells,
            temps: Arena::new(),
            reset: false,
            marks: None,
            evolution: None,
            step,
            elapsed,
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
            had_ended: IdMap::filled(&net.parts, None),
            queues: None,
            edge_now: IdMap::filled(&net.edges, None),
            holds: IdMap::filled(&net.inputs, None),
            fireable: IdMap::filled(&net.transitions, None),
            stored: BTreeSet::new(),
            before: BTreeMap::new(),
            hoisted: Vec::new(),
            simultaneous: false,
            fault: None,
            needs,
        };
        builder.action_cells();
        if statechart {
            builder.statechart_cells();
        }
        builder
    }

    /// Nothing that was set in the program before is known any more.
    fn forget_temps(&mut self) {
        self.edge_now = IdMap::filled(&self.net.edges, None);
        self.holds = IdMap::filled(&self.net.inputs, None);
        self.fireable = IdMap::filled(&self.net.transitions, None);
        self.stored.clear();
        self.before.clear();
        self.hoisted.clear();
        self.fault = None;
        self.had_ended = IdMap::filled(&self.net.parts, None);
    }

    /// A new plain cell, 0 before reset.
    fn new_cell(&mut self, name: String, ty: Type, origin: Origin) -> CellId {
        self.cells.push(Cell { name, ty, len: None, init: vec![ty.saturate(0)], origin })
    }

    fn new_temp(&mut self, name: impl Into<String>, ty: Type, role: TempRole) -> TempId {
        self.temps.push(Temp { name: name.into(), ty, role })
    }

    /// `value` under a name: itself where it is a leaf or a constant already.
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

    /// What a micro-step carries for those who watch it.
    fn mark(&self, fire: &IdMap<Transition, Expr>, out: &mut Vec<Stmt>) {
        let Some(marks) = self.marks else { return };
        if self.limit().is_some() {
            out.push(Stmt::Code(marks.micro_step.clone()));
        }
        for (id, text) in marks.fires.iter() {
            when(fire[id].clone(), vec![Stmt::Code(text.clone())], out);
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

/// A statement that runs only under a condition; nothing where that is never, the bare statements where it is always.
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

/// The list may change the value of the condition.
fn stores_any_leaf_of(list: &[Stmt], condition: &Expr) -> bool {
    let mut leaves = BTreeSet::new();
    condition.for_each_leaf(&mut |leaf| {
        leaves.insert(*leaf);
    });
    // Temps that name conditions are set outside of what they guard, so only cells matter.
    writes(list, &mut |leaf| leaves.contains(&leaf))
}

fn writes(list: &[Stmt], meets: &mut impl FnMut(Leaf) -> bool) -> bool {
    list.iter().any(|statement| match statement {
        Stmt::Set(temp, _) => meets(Leaf::Temp(*temp)),
        Stmt::Store(cell, _, _) => meets(Leaf::Cell(*cell)),
        Stmt::If(_, then, otherwise) => writes(then, meets) || writes(otherwise, meets),
        Stmt::Repeat { body, .. } => writes(body, meets),
        Stmt::Output(..) | Stmt::Call(..) | Stmt::Code(_) | Stmt::Fault(_) => false,
    })
}
