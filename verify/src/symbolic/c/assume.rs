//! Restricts memory by conditions: on a path, a cell keeps only the values for which the condition has the truth value of the path.

use std::rc::Rc;

use grafsynth_c::tree::{BinaryOp, Expr, ExprKind, LogicalOp, Place, PlaceKind, UnaryOp};
use grafsynth_c::walk::{Node, expr_parts, place_parts};
use grafsynth_ir::expr::CompareOp;

use super::exec::Program;
use super::memory::{Cell, Memory, Object, Scalar};
use super::value::{Int, apply};
use crate::symbolic::aig::Lit;

impl<'u> Program<'u> {
    /// Excludes the values of a cell for which the condition has the other truth value.
    pub(super) fn assume(&mut self, condition: &'u Expr, holds: bool, memory: &mut Memory) {
        // An effect could have changed what an earlier operand read.
        if !has_effects(condition) {
            self.assume_pure(condition, holds, memory);
        }
    }

    fn assume_pure(&mut self, condition: &'u Expr, holds: bool, memory: &mut Memory) {
        match &condition.kind {
            ExprKind::Unary(UnaryOp::Not, inner) => self.assume_pure(inner, !holds, memory),
            ExprKind::Logical(op, all) if (*op == LogicalOp::And) == holds => {
                all.iter().for_each(|one| self.assume_pure(one, holds, memory));
            }
            ExprKind::Convert(inner)
                if self.unit.integer(&inner.ty).is_some()
                    && self.unit.integer(&condition.ty).is_some() =>
            {
                self.assume_pure(inner, holds, memory);
            }
            ExprKind::Binary(op, a, b) => {
                let op = match op {
                    BinaryOp::Eq => CompareOp::Eq,
                    BinaryOp::Ne => CompareOp::Ne,
                    BinaryOp::Lt => CompareOp::Lt,
                    BinaryOp::Le => CompareOp::Le,
                    BinaryOp::Gt => CompareOp::Gt,
                    BinaryOp::Ge => CompareOp::Ge,
                    _ => return,
                };
                if let Some(value) = self.unit.constant(b) {
                    self.keep(a, memory, |own| apply(op, own, value) == holds);
                } else if let Some(value) = self.unit.constant(a) {
                    self.keep(b, memory, |own| apply(op, value, own) == holds);
                }
            }
            ExprKind::Read(_) => self.keep(condition, memory, |own| (own != 0) == holds),
            _ => {}
        }
    }

    /// Excludes all other values of the cell that the expression reads.
    pub(super) fn assume_one_of(&mut self, on: &'u Expr, values: &[i128], memory: &mut Memory) {
        self.keep(on, memory, |own| values.binary_search(&own).is_ok());
    }

    fn keep(&mut self, expr: &'u Expr, memory: &mut Memory, is_possible: impl Fn(i128) -> bool) {
        let machine = self.unit.machine;
        let mut kinds = Vec::new();
        let mut inner = expr;
        while let ExprKind::Convert(part) | ExprKind::Cast(_, part) = &inner.kind {
            let Some(kind) = self.unit.integer(&inner.ty) else { return };
            kinds.push(kind);
            inner = part;
        }
        let ExprKind::Read(place) = &inner.kind else { return };
        if !is_plain(place) {
            return;
        }
        let Ok(all) = self.addresses(place, memory) else { return };
        let [(address, _)] = all.as_slice() else { return };
        let Object::Changing(object) = address.object else { return };
        let Ok(cell) = self.at(*address, memory) else { return };
        let Some(Scalar::Int(value)) = &cell.value else { return };
        let (Some(cases), None) = (value.cases(), value.as_constant()) else { return };
        // The conversions around the cell must not change its values.
        if cases.iter().any(|(own, _)| kinds.iter().any(|kind| machine.wrap(*own, *kind) != *own)) {
            return;
        }
        let kept: Vec<(i128, Lit)> =
            cases.iter().filter(|(own, _)| is_possible(*own)).copied().collect();
        if kept.is_empty() || kept.len() == cases.len() {
            return;
        }
        let value = match (value, kept.as_slice()) {
            (Int::Bit(_), [(own, _)]) => Int::Bit(Lit::constant(*own != 0)),
            _ => Int::choice(&mut self.aig, kept),
        };
        let value = Some(Scalar::Int(value));
        let part = Cell { value, unset: cell.unset, whole: Some(cell.clone()) };
        memory.put(object, address.cell, Rc::new(part));
    }
}

/// True if evaluating the expression may change memory.
fn has_effects(expr: &Expr) -> bool {
    let own = matches!(
        &expr.kind,
        ExprKind::Assign(..) | ExprKind::Update(..) | ExprKind::Step { .. } | ExprKind::Call(..)
    );
    let mut any = own;
    expr_parts(expr, &mut |part| any |= part_has_effects(part));
    any
}

fn part_has_effects(part: Node<'_>) -> bool {
    match part {
        Node::Expr(expr) => has_effects(expr),
        Node::Place(place) => {
            let mut any = false;
            place_parts(place, &mut |part| any |= part_has_effects(part));
            any
        }
    }
}

/// True if finding the place has no effect.
fn is_plain(place: &Place) -> bool {
    let reads = |expr: &Expr| match &expr.kind {
        ExprKind::Read(place) | ExprKind::Decay(place) => is_plain(place),
        ExprKind::Literal(..) | ExprKind::Constant(_) => true,
        _ => false,
    };
    match &place.kind {
        PlaceKind::Symbol(_) => true,
        PlaceKind::Member(base, _) => is_plain(base),
        PlaceKind::Element(base, index) => is_plain(base) && reads(index),
        PlaceKind::At(pointer, index) => reads(pointer) && reads(index),
        PlaceKind::Deref(pointer) => reads(pointer),
    }
}
