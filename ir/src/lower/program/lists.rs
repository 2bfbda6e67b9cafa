//! Statement lists (§3.3): assignments, events, sends, calls.
//!
//! A list is sequential code and reads current values. With simultaneous assignments it reads the values at the start of the micro-step: a plain variable
//! that an earlier statement may have stored is read from a copy, and an expression over a stored array is evaluated in advance.

use std::collections::BTreeSet;

use super::{Builder, cell, temp};
use crate::expr::{CompareOp, ExprKind, Type};
use crate::interval::{TICKS, type_of};
use crate::net::{self, Block, Driver, OutputId, StmtKind};
use crate::program::{CellId, Expr, Leaf, Origin, Stmt, TempRole};

impl Builder<'_> {
    /// The statements of a list at this point of the sequence.
    pub(super) fn list(&mut self, block: &Block) -> Vec<Stmt> {
        let mut out = Vec::new();
        for statement in block {
            match &statement.kind {
                StmtKind::Assign { var, index, value } => {
                    let index = index.as_ref().map(|index| self.read_in_list(index));
                    let value = self.read_in_list(value);
                    let target = self.var[*var];
                    out.push(Stmt::Store(target, index, value));
                    self.now.stored.insert(target);
                }
                StmtKind::Raise(event) => self.raise(*event, &mut out),
                StmtKind::Send(slot) => self.send(*slot, &mut out),
                StmtKind::Cancel(slot) => {
                    if let Some(left) = self.send[*slot] {
                        out.push(Stmt::Store(left, None, Expr::int(0)));
                    }
                }
                StmtKind::Call { output, arguments } => {
                    let arguments =
                        arguments.iter().map(|argument| self.read_in_list(argument)).collect();
                    self.call(*output, arguments, &mut out);
                }
                StmtKind::If { condition, then, otherwise } => {
                    let condition = self.read_in_list(condition);
                    let then = self.list(then);
                    let otherwise = self.list(otherwise);
                    if !then.is_empty() || !otherwise.is_empty() {
                        out.push(Stmt::If(condition, then, otherwise));
                    }
                }
                StmtKind::Code(text) => out.push(Stmt::Code(text.clone())),
            }
        }
        out
    }

    /// Calls an extern action; an argument is assigned to the parameter, so it saturates.
    pub(super) fn call(&mut self, output: OutputId, arguments: Vec<Expr>, out: &mut Vec<Stmt>) {
        let Driver::Extern { params, .. } = &self.net.outputs[output].driver else { return };
        let mut saturated = Vec::new();
        for (argument, param) in arguments.into_iter().zip(params) {
            saturated.push(self.saturated(argument, param.ty, &param.name, out));
        }
        out.push(Stmt::Call(output, saturated));
    }

    fn saturated(&mut self, value: Expr, to: Type, name: &str, out: &mut Vec<Stmt>) -> Expr {
        let ty = self.type_of(&value);
        let ((from_lo, from_hi), (lo, hi)) = (ty.bounds(), to.bounds());
        if lo <= from_lo && from_hi <= hi {
            return value;
        }
        let name = if name.is_empty() { "argument" } else { name };
        let span = value.span;
        let value = if matches!(value.kind, ExprKind::Leaf(_)) {
            value
        } else {
            let id = self.new_temp(name, ty, TempRole::Helper);
            out.push(Stmt::Set(id, value));
            Expr { span, ..temp(id) }
        };
        let mut fitted = value.clone();
        if from_hi > hi {
            let above = Expr::compare(CompareOp::Gt, value.clone(), Expr::int(hi));
            fitted = select(above, Expr::int(hi), fitted);
        }
        if from_lo < lo {
            let below = Expr::compare(CompareOp::Lt, value, Expr::int(lo));
            fitted = select(below, Expr::int(lo), fitted);
        }
        fitted
    }

    /// The interval of an expression of the program.
    pub(super) fn type_of(&self, value: &Expr) -> Type {
        let found = type_of(value, &mut |leaf| match leaf {
            Leaf::Cell(id) => self.cells[*id].ty,
            Leaf::Temp(id) => self.temps[*id].ty,
            Leaf::Input(id) => self.net.inputs[*id].ty,
            Leaf::Dt => TICKS,
        });
        // Times may exceed the range that the validated comparison needs; such an expression is never an argument.
        found.unwrap_or(Type::Int { lo: i64::MIN, hi: i64::MAX })
    }

    /// An expression of a list at this point of the sequence.
    pub(super) fn read_in_list(&mut self, expr: &net::Expr) -> Expr {
        let now = self.read(expr);
        if !self.simultaneous {
            return now;
        }
        let mut changed: BTreeSet<CellId> = BTreeSet::new();
        let mut in_array = false;
        for leaf in now.leaves() {
            if let Leaf::Cell(id) = leaf
                && self.now.stored.contains(id)
            {
                in_array |= self.cells[*id].len.is_some();
                changed.insert(*id);
            }
        }
        if changed.is_empty() {
            return now;
        }
        if in_array {
            let ty = self.type_of(&now);
            let id = self.new_temp("value", ty, TempRole::Helper);
            let span = now.span;
            self.now.hoisted.push(Stmt::Set(id, now));
            return Expr { span, ..temp(id) };
        }
        for id in changed {
            if !self.now.before.contains_key(&id) {
                let (name, ty) = (format!("{}.before", self.cells[id].name), self.cells[id].ty);
                let role = if let Origin::Var(var) = self.cells[id].origin {
                    TempRole::Before(var)
                } else {
                    TempRole::Helper
                };
                let copy = self.new_temp(name, ty, role);
                self.now.hoisted.push(Stmt::Set(copy, cell(id)));
                self.now.before.insert(id, copy);
            }
        }
        let before = &self.now.before;
        now.map(
            &mut |leaf, span| {
                let leaf = match leaf {
                    Leaf::Cell(id) => before.get(id).map_or(*leaf, |copy| Leaf::Temp(*copy)),
                    Leaf::Temp(_) | Leaf::Input(_) | Leaf::Dt => *leaf,
                };
                Expr::leaf(leaf, span)
            },
            &mut |array, _| *array,
        )
    }

    /// Starts the sequence of a micro-step: nothing is stored yet.
    pub(super) fn begin_sequence(&mut self) {
        self.simultaneous = self.net.settings.assign_simultaneous;
        self.now.stored.clear();
        self.now.before.clear();
        self.now.hoisted.clear();
    }

    /// Ends the sequence: places the copies that must be made before it in front of it.
    pub(super) fn end_sequence(&mut self, sequence: Vec<Stmt>) -> Vec<Stmt> {
        let mut all = std::mem::take(&mut self.now.hoisted);
        all.extend(sequence);
        self.simultaneous = false;
        all
    }
}

pub(super) fn select(condition: Expr, then: Expr, otherwise: Expr) -> Expr {
    let span = condition.span.to(otherwise.span);
    Expr::new(ExprKind::Select(Box::new(condition), Box::new(then), Box::new(otherwise)), span)
}
