//! The distance of a Boolean from a wanted value. This is the branch distance of search-based testing [Korel 1990; McMinn, Search-based software test data
//! generation, 2004], for receptivities as they are read in the first check of a reaction.

use grafsynth_ir::expr::{CompareOp, Expr as GenericExpr, ExprKind};
use grafsynth_ir::net::{EdgeId, Expr, Leaf, Net, StepId, TransitionId};

use crate::evaluate::{compares, eval_by};
use crate::layout::Layout;
use crate::reaction::{Work, value_of};
use crate::row::InputRow;
use crate::simulator::Simulator;
use crate::state::State;
use crate::tables::Tables;

/// The distance of a value that no input of this reaction can change.
const FAR: u64 = 1 << 20;

/// The inputs for which a distance is computed.
#[derive(Debug, Clone, Copy)]
pub(super) enum Given<'r> {
    /// The given inputs and `dt`.
    Row(&'r InputRow),
    /// No inputs: expressions that depend on inputs (and on `dt`, if it is free) count as having the wanted value, so the result is the distance of the state
    /// alone.
    Any { free_dt: bool },
}

/// All values that an expression can read.
pub(super) struct Context<'s> {
    net: &'s Net,
    tables: &'s Tables,
    state: &'s State,
    work: &'s Work,
    given: Given<'s>,
}

impl<'s> Context<'s> {
    pub(super) fn of(simulator: &'s Simulator<'_>, given: Given<'s>) -> Self {
        let (net, tables, state, work) = simulator.parts();
        Context { net, tables, state, work, given }
    }

    fn layout(&self) -> &Layout {
        &self.tables.layout
    }

    /// The distance of an enabled transition from firing: its receptivity and one of its events.
    pub(super) fn to_fire(&self, transition: TransitionId) -> u64 {
        let data = &self.net.transitions[transition];
        let event = match self.given {
            _ if data.events.is_empty() => 0,
            Given::Row(row) => {
                let holds = data.events.iter().any(|event| self.holds(row, *event));
                u64::from(!holds)
            }
            Given::Any { .. } => 0,
        };
        self.to(&data.guard, true, true).saturating_add(event)
    }

    fn holds(&self, row: &InputRow, event: grafsynth_ir::net::InputId) -> bool {
        let raised = self.layout().raised(event).is_some_and(|place| self.state.cells[place] != 0);
        row.value(event) != 0 || raised
    }

    /// The distance of `expr` from `wanted`: 0 if and only if it has this value. The transitions that `otherwise` refers to are followed once (`deep`),
    /// because a long chain of them would take exponential time.
    fn to(&self, expr: &Expr, wanted: bool, deep: bool) -> u64 {
        match &expr.kind {
            ExprKind::Bool(value) if *value == wanted => 0,
            ExprKind::Bool(_) => FAR,
            ExprKind::Not(a) => self.to(a, !wanted, deep),
            ExprKind::And(all) if wanted => self.sum(all, wanted, deep),
            ExprKind::Or(all) if !wanted => self.sum(all, wanted, deep),
            ExprKind::And(all) | ExprKind::Or(all) => {
                all.iter().map(|a| self.to(a, wanted, deep)).min().unwrap_or(FAR)
            }
            ExprKind::Select(condition, then, otherwise) => {
                let branch = |is_taken: bool, value: &Expr| {
                    self.to(condition, is_taken, deep).saturating_add(self.to(value, wanted, deep))
                };
                branch(true, then).min(branch(false, otherwise))
            }
            ExprKind::Compare(..) | ExprKind::Leaf(_) | ExprKind::Element(..)
                if self.is_free(expr) =>
            {
                0
            }
            ExprKind::Compare(op, a, b) => {
                let op = if wanted { *op } else { op.negated() };
                compare(op, self.value(a), self.value(b))
            }
            ExprKind::Leaf(Leaf::Rise(edge)) => self.edge(*edge, true, wanted, deep),
            ExprKind::Leaf(Leaf::Fall(edge)) => self.edge(*edge, false, wanted, deep),
            ExprKind::Leaf(Leaf::Fireable(transition)) if deep => {
                self.fireable(*transition, wanted)
            }
            ExprKind::Leaf(Leaf::Fireable(_)) => 0,
            _ => u64::from((self.value(expr) != 0) != wanted),
        }
    }

    fn sum(&self, all: &[Expr], wanted: bool, deep: bool) -> u64 {
        all.iter().fold(0, |sum, a| sum.saturating_add(self.to(a, wanted, deep)))
    }

    /// The distance of an edge to the value `after` from being present (if `wanted`) or absent. An edge needs the opposite value in the previous check; if the
    /// operand did not have it, the distance is that of a row that produces it.
    fn edge(&self, edge: EdgeId, after: bool, wanted: bool, deep: bool) -> u64 {
        let old = self.state.cells[self.layout().edge(edge)] != 0;
        let operand = &self.net.edges[edge].expr;
        match (wanted, old == after) {
            (true, true) => FAR.saturating_add(self.to(operand, !after, deep)),
            (true, false) => self.to(operand, after, deep),
            (false, true) => 0,
            (false, false) => self.to(operand, !after, deep),
        }
    }

    fn fireable(&self, transition: TransitionId, wanted: bool) -> u64 {
        let data = &self.net.transitions[transition];
        let is_enabled = data.requires.iter().all(|step| self.state.situation.contains(*step));
        let lacks_event = match self.given {
            Given::Row(row) => {
                !data.events.is_empty() && !data.events.iter().any(|it| self.holds(row, *it))
            }
            Given::Any { .. } => !wanted && !data.events.is_empty(),
        };
        match (wanted, is_enabled) {
            (true, true) => {
                self.to(&data.guard, true, false).saturating_add(u64::from(lacks_event))
            }
            (true, false) => FAR,
            (false, true) if lacks_event => 0,
            (false, true) => self.to(&data.guard, false, false),
            (false, false) => 0,
        }
    }

    /// True if the value depends on inputs (or on `dt`) that are not given.
    fn is_free(&self, expr: &Expr) -> bool {
        let Given::Any { free_dt } = self.given else { return false };
        let mut is_free = false;
        for leaf in expr.leaves() {
            is_free |= match leaf {
                Leaf::Input(_) => true,
                Leaf::Elapsed(_) | Leaf::LastElapsed(_) | Leaf::Timer(_) => free_dt,
                _ => false,
            };
        }
        is_free
    }

    fn value(&self, expr: &GenericExpr<Leaf>) -> i64 {
        eval_by(expr, &|leaf, index| self.leaf(*leaf, index))
    }

    fn leaf(&self, leaf: Leaf, index: Option<i64>) -> i64 {
        let (row, dt) = match self.given {
            Given::Row(row) => (Some(row), i64::from(row.dt)),
            Given::Any { .. } => (None, 0),
        };
        let advanced = |step: StepId, place: Option<(usize, i64)>| {
            let Some((place, cap)) = place else { return 0 };
            let value = self.state.cells[place];
            if self.state.situation.contains(step) { (value + dt).min(cap) } else { value }
        };
        match leaf {
            Leaf::Input(input) => match row {
                Some(row) if self.net.inputs[input].kind.is_event() => {
                    i64::from(self.holds(row, input))
                }
                Some(row) => row.value(input),
                None => 0,
            },
            Leaf::Elapsed(step) => advanced(step, self.layout().elapsed(step)),
            Leaf::LastElapsed(step) => advanced(step, self.layout().last_elapsed(step)),
            Leaf::Timer(timer) => {
                let place = self.layout().timer(timer);
                let is_held = self.state.cells[place + 1] != 0;
                let value = self.state.cells[place];
                if is_held { (value + dt).min(self.layout().timer_cap(timer)) } else { value }
            }
            Leaf::Rise(edge) => i64::from(self.edge(edge, true, true, false) == 0),
            Leaf::Fall(edge) => i64::from(self.edge(edge, false, true, false) == 0),
            Leaf::Fireable(transition) => i64::from(self.fireable(transition, true) == 0),
            Leaf::Var(_) | Leaf::Active(_) | Leaf::TasksDone(_) | Leaf::Controlled(_) => {
                value_of(self.net, self.tables, self.state, self.work, leaf, index)
            }
        }
    }
}

/// The smallest change of `a` that makes the comparison true.
fn compare(op: CompareOp, a: i64, b: i64) -> u64 {
    match op {
        _ if compares(op, a, b) => 0,
        CompareOp::Eq | CompareOp::Le | CompareOp::Ge => a.abs_diff(b),
        CompareOp::Ne => 1,
        CompareOp::Lt | CompareOp::Gt => a.abs_diff(b).saturating_add(1),
    }
}
