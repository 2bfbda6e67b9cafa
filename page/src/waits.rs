//! What each transition waits for: the factors of its receptivity, as they will be in the next check, and the timers that run.

use crate::program::ProgramWriter;
use grafsynth_ir::Gather;
use grafsynth_ir::Span;
use grafsynth_ir::expr::{CompareOp, Expr as GenericExpr, ExprKind};
use grafsynth_ir::net::{self, EdgeId, InputKind, Net, Transition};
use grafsynth_ir::program::{ActionPart, CellId, Expr, Leaf, Origin, Program};
use grafsynth_ir::text::print_condition;
use grafsynth_sim::turns;
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};

/// The depth at which the operands of edges and the receptivities of earlier transitions are no longer followed.
pub(crate) const DEEPEST: usize = 8;

/// Reads a net in terms of its program.
pub(crate) struct Waits<'a> {
    net: &'a Net,
    writer: &'a ProgramWriter<'a>,
    cells: BTreeMap<Origin, CellId>,
    /// The constants that each cell is compared with.
    constants: BTreeMap<CellId, BTreeSet<i64>>,
}

impl<'a> Waits<'a> {
    pub(crate) fn new(net: &'a Net, program: &'a Program, writer: &'a ProgramWriter<'a>) -> Self {
        let mut constants: BTreeMap<CellId, BTreeSet<i64>> = BTreeMap::new();
        for expr in grafsynth_ir::program::expressions(&program.body) {
            for one in expr.subexpressions() {
                let ExprKind::Compare(op, a, b) = &one.kind else { continue };
                let (leaf, op, constant) = match (&a.kind, &b.kind) {
                    (ExprKind::Leaf(leaf), ExprKind::Int(constant)) => (leaf, *op, *constant),
                    (ExprKind::Int(constant), ExprKind::Leaf(leaf)) => {
                        (leaf, op.mirrored(), *constant)
                    }
                    _ => continue,
                };
                if let Leaf::Cell(cell) = leaf {
                    constants.entry(*cell).or_default().extend(turns(op, constant));
                }
            }
        }
        let cells = program.cells.iter().map(|(id, cell)| (cell.origin, id)).gather();
        Waits { net, writer, cells, constants }
    }

    pub(crate) fn cell(&self, origin: Origin) -> Option<usize> {
        self.cells.get(&origin).map(|cell| cell.index())
    }

    /// The factors of a receptivity: each with its text, and with its value in the next check if the program stores what it reads.
    pub(crate) fn factors(&self, transition: &Transition) -> Vec<Value> {
        let mut all = Vec::new();
        if !transition.events.is_empty() {
            let names =
                transition.events.iter().map(|event| self.net.inputs[*event].name.text.clone());
            let present = transition.events.iter().map(|event| self.input(*event));
            let value = Expr::or(present.collect::<Vec<_>>());
            let text = names.collect::<Vec<_>>().join(" or ");
            all.push(json!({ "text": text, "value": self.writer.expr(&value) }));
        }
        for factor in transition.guard.factors().iter().filter(|factor| !factor.is_true()) {
            let value = self.expr(factor, DEEPEST).map(|value| self.writer.expr(&value));
            let text = print_condition(self.net, factor);
            all.push(json!({ "text": text, "value": value, "time": self.time(factor) }));
        }
        all
    }

    /// For a comparison of a step's time with a constant: the step, the operator, and the ticks.
    fn time(&self, factor: &net::Expr) -> Option<Value> {
        let ExprKind::Compare(op, a, b) = &factor.kind else { return None };
        let (ExprKind::Leaf(net::Leaf::Elapsed(step)), ExprKind::Int(ticks)) = (&a.kind, &b.kind)
        else {
            return None;
        };
        Some(json!([step.index(), crate::program::sign(*op), ticks]))
    }

    /// The timers that a reaction may depend on: the cell, whether it runs, and the values at which something changes.
    pub(crate) fn timers(&self) -> Vec<Value> {
        let mut all = Vec::new();
        for (origin, cell) in &self.cells {
            let constants = self.constants.get(cell).cloned().unwrap_or_default();
            let (runs, at) = match *origin {
                Origin::Elapsed(step) | Origin::LastElapsed(step) => {
                    (self.origin(Origin::Step(step)), constants)
                }
                Origin::Timer(timer) => (self.origin(Origin::TimerCondition(timer)), constants),
                Origin::ActionTimer(action, part) => {
                    let held = if part == ActionPart::DS { ActionPart::DSHeld } else { part };
                    let duration = i64::from(self.net.actions[action].duration);
                    (
                        self.origin(Origin::ActionLatch(action, held)),
                        [duration].into_iter().gather(),
                    )
                }
                Origin::SendTimer(_) => {
                    let runs = Expr::compare(CompareOp::Gt, cell_expr(*cell), Expr::int(0));
                    (Some(runs), BTreeSet::new())
                }
                _ => continue,
            };
            if let Some(runs) = runs {
                let runs = self.writer.expr(&runs);
                let is_down = matches!(origin, Origin::SendTimer(_));
                all.push(json!({ "cell": cell.index(), "runs": runs, "at": at, "down": is_down }));
            }
        }
        all
    }

    /// A value of the net at the next check; `None` if the program does not store it.
    pub(crate) fn expr(&self, expr: &net::Expr, depth: usize) -> Option<Expr> {
        let depth = depth.checked_sub(1)?;
        let map = &mut |leaf: &net::Leaf, _: Span| self.leaf(*leaf, depth).ok_or(());
        let array = &mut |leaf: &net::Leaf, _: Span| match leaf {
            net::Leaf::Var(var) => {
                self.cells.get(&Origin::Var(*var)).copied().map(Leaf::Cell).ok_or(())
            }
            _ => Err(()),
        };
        expr.try_map(map, array).ok()
    }

    fn leaf(&self, leaf: net::Leaf, depth: usize) -> Option<Expr> {
        match leaf {
            net::Leaf::Input(input) => Some(self.input(input)),
            net::Leaf::Var(var) => self.origin(Origin::Var(var)),
            net::Leaf::Active(step) => self.origin(Origin::Step(step)),
            net::Leaf::Elapsed(step) => {
                let time = self.running(Origin::Elapsed(step), Origin::Step(step))?;
                Some(select(self.origin(Origin::Step(step))?, time, Expr::int(0)))
            }
            net::Leaf::LastElapsed(step) => {
                self.running(Origin::LastElapsed(step), Origin::Step(step))
            }
            net::Leaf::Timer(timer) => {
                self.running(Origin::Timer(timer), Origin::TimerCondition(timer))
            }
            net::Leaf::TasksDone(step) => {
                let index = self.origin(Origin::TaskIndex(step))?;
                let n_tasks = i64::try_from(self.net.steps[step].tasks.len()).ok()?;
                let all = Expr::compare(CompareOp::Ge, index, Expr::int(n_tasks));
                Some(Expr::and([self.origin(Origin::Step(step))?, all]))
            }
            net::Leaf::Rise(edge) => Some(Expr::and([
                self.operand(edge, depth)?,
                self.origin(Origin::Edge(edge))?.not(),
            ])),
            net::Leaf::Fall(edge) => Some(Expr::and([
                self.operand(edge, depth)?.not(),
                self.origin(Origin::Edge(edge))?,
            ])),
            net::Leaf::Fireable(transition) => {
                let transition = &self.net.transitions[transition];
                let mut all = Vec::new();
                for step in &transition.requires {
                    all.push(self.origin(Origin::Step(*step))?);
                }
                if !transition.events.is_empty() {
                    all.push(Expr::or(
                        transition
                            .events
                            .iter()
                            .map(|event| self.input(*event))
                            .collect::<Vec<_>>(),
                    ));
                }
                all.push(self.expr(&transition.guard, depth)?);
                Some(Expr::and(all))
            }
            net::Leaf::Controlled(action) => self.origin(Origin::ActionQ(action)),
        }
    }

    fn operand(&self, edge: EdgeId, depth: usize) -> Option<Expr> {
        self.expr(&self.net.edges[edge].expr, depth)
    }

    /// An input as it is now on the panel; an event that only the chart raises is present if it is pending.
    fn input(&self, input: net::InputId) -> Expr {
        if self.net.inputs[input].kind == InputKind::InternalEvent {
            return self.origin(Origin::Pending(input)).unwrap_or_else(|| Expr::bool(false));
        }
        Expr::leaf(Leaf::Input(input), Span::default())
    }

    fn origin(&self, origin: Origin) -> Option<Expr> {
        self.cells.get(&origin).map(|cell| cell_expr(*cell))
    }

    /// A time after the next Latch: it advances while its condition is true.
    fn running(&self, time: Origin, runs: Origin) -> Option<Expr> {
        let now = self.origin(time)?;
        let dt = Expr::leaf(Leaf::Dt, Span::default());
        let later = GenericExpr::new(
            ExprKind::Arith(grafsynth_ir::expr::ArithOp::Add, Box::new(now.clone()), Box::new(dt)),
            Span::default(),
        );
        Some(select(self.origin(runs)?, later, now))
    }
}

fn cell_expr(cell: CellId) -> Expr {
    Expr::leaf(Leaf::Cell(cell), Span::default())
}

fn select(condition: Expr, then: Expr, otherwise: Expr) -> Expr {
    let kind = ExprKind::Select(Box::new(condition), Box::new(then), Box::new(otherwise));
    GenericExpr::new(kind, Span::default())
}
