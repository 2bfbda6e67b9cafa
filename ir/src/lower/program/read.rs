//! Expressions of the net over the cells and temps of the program.

use super::share::{elapsed, resolved};
use super::{Builder, cell};
use crate::expr::{CompareOp, ExprKind};
use crate::net::{self, EdgeOperand, Net, StepId};
use crate::program::{Expr, Leaf};
use crate::span::Span;

impl Builder<'_> {
    /// The expression with every value read at this point of the program. Edges and events have their values from the check.
    pub(super) fn read(&self, expr: &net::Expr) -> Expr {
        self.read_with(expr, &[])
    }

    /// Like [`Builder::read`], at a point where these steps are known to be active.
    pub(super) fn read_with(&self, expr: &net::Expr, active: &[StepId]) -> Expr {
        let mut leaf = |leaf: &net::Leaf, span| {
            let value = match elapsed(*leaf) {
                Some(step) => self.time_of(step, active.contains(&step)),
                None => self.read_leaf(*leaf),
            };
            Expr { span, ..value }
        };
        let read = expr.map(&mut leaf, &mut |leaf, _| self.read_array(*leaf));
        let read = if self.shared.is_empty() { read } else { resolved(read) };
        crate::simplify::simplify(&read)
    }

    /// A condition that may be absent, of a step that is known to be active.
    pub(super) fn read_condition(&self, condition: Option<&net::Expr>, active: StepId) -> Expr {
        condition.map_or_else(|| Expr::bool(true), |it| self.read_with(it, &[active]))
    }

    fn read_leaf(&self, leaf: net::Leaf) -> Expr {
        match leaf {
            net::Leaf::Input(input) if self.net.inputs[input].kind.is_event() => {
                self.now.holds[input].clone().unwrap_or_else(|| Expr::bool(false))
            }
            net::Leaf::Input(input) => Expr::leaf(Leaf::Input(input), Span::default()),
            net::Leaf::Var(var) => cell(self.var[var]),
            net::Leaf::Active(step) => self.is_active(step),
            net::Leaf::Elapsed(step) => self.time_of(step, false),
            net::Leaf::LastElapsed(step) => {
                self.last_elapsed[step].map_or_else(|| Expr::int(0), cell)
            }
            net::Leaf::TasksDone(step) => self.tasks_done(step),
            net::Leaf::Timer(timer) => {
                self.timer[timer].map_or_else(|| Expr::int(0), |(ticks, _)| cell(ticks))
            }
            net::Leaf::Rise(edge) => match (&self.now.edge[edge], self.edge[edge]) {
                (Some(now), Some(old)) => Expr::and([now.clone(), cell(old).not()]),
                (None, _) | (_, None) => Expr::bool(false),
            },
            net::Leaf::Fall(edge) => match (&self.now.edge[edge], self.edge[edge]) {
                (Some(now), Some(old)) => Expr::and([now.clone().not(), cell(old)]),
                (None, _) | (_, None) => Expr::bool(false),
            },
            net::Leaf::Fireable(transition) => {
                self.now.fireable[transition].clone().unwrap_or_else(|| Expr::bool(false))
            }
            net::Leaf::Controlled(action) => {
                self.action_q[action].map_or_else(|| Expr::bool(false), cell)
            }
        }
    }

    fn read_array(&self, leaf: net::Leaf) -> Leaf {
        match leaf {
            net::Leaf::Var(var) => Leaf::Cell(self.var[var]),
            net::Leaf::Input(_)
            | net::Leaf::Active(_)
            | net::Leaf::Elapsed(_)
            | net::Leaf::LastElapsed(_)
            | net::Leaf::TasksDone(_)
            | net::Leaf::Timer(_)
            | net::Leaf::Rise(_)
            | net::Leaf::Fall(_)
            | net::Leaf::Fireable(_)
            | net::Leaf::Controlled(_) => unreachable!("a valid net indexes arrays only"),
        }
    }

    /// `s.done`: a step without tasks is done immediately.
    fn tasks_done(&self, step: StepId) -> Expr {
        let active = self.is_active(step);
        let Some(index) = self.task[step] else { return active };
        let all = i64::try_from(self.net.steps[step].tasks.len()).unwrap_or(i64::MAX);
        Expr::and([active, Expr::compare(CompareOp::Eq, cell(index), Expr::int(all))])
    }
}

/// A name for the memory of an operand: the name of its first leaf.
pub(super) fn name_of_operand(net: &Net, operand: &EdgeOperand) -> String {
    let mut name = None;
    for leaf in operand.expr.leaves() {
        name.get_or_insert_with(|| match *leaf {
            net::Leaf::Input(input) => net.inputs[input].name.text.clone(),
            net::Leaf::Var(var) => net.vars[var].name.text.clone(),
            net::Leaf::Active(step)
            | net::Leaf::Elapsed(step)
            | net::Leaf::LastElapsed(step)
            | net::Leaf::TasksDone(step) => net.steps[step].name.text.clone(),
            net::Leaf::Timer(timer) => net.timers[timer].name.text.clone(),
            net::Leaf::Controlled(action) => net.actions[action].name.text.clone(),
            net::Leaf::Rise(_) | net::Leaf::Fall(_) | net::Leaf::Fireable(_) => "edge".to_owned(),
        });
    }
    let name = name.unwrap_or_else(|| "edge".to_owned());
    if matches!(operand.expr.kind, ExprKind::Leaf(_)) {
        format!("{name}.before")
    } else {
        format!("{name}.condition.before")
    }
}
