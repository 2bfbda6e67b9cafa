//! Restricts memory by conditions: on a path, a cell keeps only the values for which the condition has the truth value of the path.

use std::rc::Rc;

use grafsynth_c::tree::types::IntKind;
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

    /// Excludes all other values of the cell that the expression reads or shifts.
    pub(super) fn assume_one_of(&mut self, on: &'u Expr, values: &[i128], memory: &mut Memory) {
        self.keep(on, memory, |own| values.binary_search(&own).is_ok());
    }

    fn keep(&mut self, expr: &'u Expr, memory: &mut Memory, is_possible: impl Fn(i128) -> bool) {
        let mut links = Vec::new();
        let mut inner = expr;
        loop {
            match &inner.kind {
                ExprKind::Convert(part) | ExprKind::Cast(_, part) => {
                    let Some(kind) = self.unit.integer(&inner.ty) else { return };
                    links.push(Link::Convert(kind));
                    inner = part;
                }
                ExprKind::Binary(op @ (BinaryOp::Shr | BinaryOp::BitAnd), part, by) => {
                    let Some(by) = self.unit.constant(by) else { return };
                    links.push(if *op == BinaryOp::Shr { Link::Shift(by) } else { Link::Mask(by) });
                    inner = part;
                }
                _ => break,
            }
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
        let seen: Option<Vec<(i128, Lit, i128)>> = cases
            .iter()
            .map(|(own, when)| Some((*own, *when, self.through(&links, *own)?)))
            .collect();
        let Some(seen) = seen else { return };
        let kept = seen.into_iter().filter(|(_, _, seen)| is_possible(*seen));
        let kept: Vec<(i128, Lit)> = kept.map(|(own, when, _)| (own, when)).collect();
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

    /// The result of applying the operations to a value, last one first; `None` if a conversion changes the value, or if an operand is negative.
    fn through(&self, links: &[Link], own: i128) -> Option<i128> {
        links.iter().rev().try_fold(own, |value, link| match link {
            Link::Convert(kind) => (self.unit.machine.wrap(value, *kind) == value).then_some(value),
            Link::Shift(by) if value >= 0 && (0..64).contains(by) => Some(value >> by),
            Link::Mask(mask) if value >= 0 && *mask >= 0 => Some(value & mask),
            Link::Shift(_) | Link::Mask(_) => None,
        })
    }
}

/// An operation between a cell and a condition, with a constant.
enum Link {
    Convert(IntKind),
    /// To the right.
    Shift(i128),
    Mask(i128),
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
