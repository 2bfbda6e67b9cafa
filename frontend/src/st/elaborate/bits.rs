//! Bit operations on numbers: AND, OR, XOR, NOT, shifts, rotations and assignments to single bits, expressed by the arithmetic of nets.
//!
//! ```text
//! x AND 16#F0      x / 16 MOD 16 * 16                       a run of ones is one quotient and one remainder
//! x OR 16#0F       (x AND 16#F0) + 15
//! x AND y          the sum of 2^k for each bit k that is set in both
//! SHL(x, 3)        x MOD 32 * 8                             in a BYTE
//! ```
//! A signed number is treated as two's complement with 8, 16 or 32 bits: the smallest size that fits both operands.

use grafsynth_ir::Span;
use grafsynth_ir::chart::Expr;
use grafsynth_ir::diag::ErrorReported;
use grafsynth_ir::expr::{CompareOp, ExprKind};

use super::context::{Binding, Elaborator, FrameId, MAX_NODES, Outcome};
use super::types::Ty;
use super::value::{Kind, Value, nodes};
use crate::st::ast::{self, Op};

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum BitOp {
    And,
    Or,
    Xor,
}

impl BitOp {
    fn apply(self, a: i64, b: i64) -> i64 {
        match self {
            BitOp::And => a & b,
            BitOp::Or => a | b,
            BitOp::Xor => a ^ b,
        }
    }
}

/// The number of bits that the value `most` needs.
fn bits(most: i64) -> u32 {
    64 - most.max(0).leading_zeros()
}

/// The largest number with `n_bits` bits, at most 62.
fn full(n_bits: u32) -> i64 {
    (1 << n_bits.min(62)) - 1
}

fn range(value: &Value) -> Option<(i64, i64)> {
    match value.kind {
        Kind::Int(lo, hi) => Some((lo, hi)),
        Kind::Bool | Kind::Time(_) => None,
    }
}

/// The number of bits of the unsigned type (BYTE, WORD or a similar type) that has the range of this value.
fn type_bits(value: &Value) -> Option<u32> {
    match range(value)? {
        (0, 255) => Some(8),
        (0, 65_535) => Some(16),
        _ => None,
    }
}

impl Elaborator<'_> {
    /// Combines a chain of numbers bit by bit.
    pub(super) fn bitwise(&mut self, op: BitOp, values: Vec<Value>, span: Span) -> Outcome<Value> {
        let mut all = values.into_iter();
        let mut result = all.next().ok_or(ErrorReported)?;
        for value in all {
            result = self.bit_pair(op, result, value, span)?;
            if nodes(&result.expr, MAX_NODES) >= MAX_NODES {
                return Err(self.too_much(span));
            }
        }
        Ok(result)
    }

    fn bit_pair(&mut self, op: BitOp, a: Value, b: Value, span: Span) -> Outcome<Value> {
        let (Some((al, ah)), Some((bl, bh))) = (range(&a), range(&b)) else {
            return Err(self.type_error(
                "a bit operator cannot mix numbers and Booleans; write `x <> 0` for the number",
                span,
            ));
        };
        if al == ah && bl == bh {
            return Ok(Value::int(op.apply(al, bl), span));
        }
        let (least, most) = (al.min(bl), ah.max(bh));
        if least >= 0 {
            if bits(most) > 32 {
                return Err(self.wide(span));
            }
            return self.unsigned_pair(op, a, b, span);
        }
        let Some(n_bits) =
            [8, 16, 32].into_iter().find(|n| -(1_i64 << (n - 1)) <= least && most <= full(*n))
        else {
            return Err(self.wide(span));
        };
        // An unsigned number stays unsigned with a mask such as -16.
        let is_signed = (al < 0 && al != ah) || (bl < 0 && bl != bh);
        let (a, b) = (a.wrapped(0, full(n_bits)), b.wrapped(0, full(n_bits)));
        let value = self.unsigned_pair(op, a, b, span)?;
        let half = 1_i64 << (n_bits - 1);
        Ok(if is_signed { value.wrapped(-half, half - 1) } else { value })
    }

    fn wide(&mut self, span: Span) -> ErrorReported {
        self.refused("bit operators on numbers of more than 32 bits", span, "use DINT or WORD")
    }

    /// Combines two unsigned numbers.
    fn unsigned_pair(&mut self, op: BitOp, a: Value, b: Value, span: Span) -> Outcome<Value> {
        let (Some((al, ah)), Some((bl, bh))) = (range(&a), range(&b)) else {
            return Err(ErrorReported);
        };
        if al == ah && bl == bh {
            return Ok(Value::int(op.apply(al, bl), span));
        }
        if al == ah {
            return self.with_mask(op, b, al, span);
        }
        if bl == bh {
            return self.with_mask(op, a, bl, span);
        }
        let n_bits = match op {
            BitOp::And => bits(ah).min(bits(bh)),
            BitOp::Or | BitOp::Xor => bits(ah).max(bits(bh)),
        };
        let mut parts = Vec::new();
        for bit in 0..n_bits {
            let (one, other) = (self.one_bit(&a, bit, span)?, self.one_bit(&b, bit, span)?);
            let both = match op {
                BitOp::And => Expr::and([one, other]),
                BitOp::Or => Expr::or([one, other]),
                BitOp::Xor => Expr::compare(CompareOp::Ne, one, other),
            };
            parts.push(weight(both, bit, span));
            // The expression of each bit contains a copy of both operands.
            self.spend(span, 2)?;
            let size = nodes(&a.expr, MAX_NODES) + nodes(&b.expr, MAX_NODES);
            if size.saturating_mul(n_bits as usize) >= MAX_NODES {
                return Err(self.too_much(span));
            }
        }
        self.sum(parts, span)
    }

    /// Whether a bit of an unsigned number is set.
    fn one_bit(&mut self, value: &Value, bit: u32, span: Span) -> Outcome<Expr> {
        if range(value).is_none_or(|(_, most)| bits(most) <= bit) {
            return Ok(Expr::bool(false));
        }
        let low = self.piece(value, bit, 1, span)?;
        Ok(self.binary(Op::Eq, low, Value::int(1, span), span)?.expr)
    }

    /// `len` bits from bit `from` on, shifted right to bit 0.
    fn piece(&mut self, value: &Value, from: u32, len: u32, span: Span) -> Outcome<Value> {
        let mut part = value.clone();
        if from > 0 {
            part = self.binary(Op::Div, part, Value::int(1 << from.min(62), span), span)?;
        }
        if range(value).is_some_and(|(_, most)| bits(most) > from + len) {
            part = self.binary(Op::Mod, part, Value::int(1 << len.min(62), span), span)?;
            part.kind = Kind::Int(0, full(len));
        }
        Ok(part)
    }

    fn with_mask(&mut self, op: BitOp, value: Value, mask: i64, span: Span) -> Outcome<Value> {
        let Some((_, most)) = range(&value) else { return Err(ErrorReported) };
        let all = full(bits(most).max(bits(mask)));
        match op {
            BitOp::And => self.masked(&value, mask, span),
            BitOp::Or => {
                let rest = self.masked(&value, all & !mask, span)?;
                let sum = self.binary(Op::Add, rest, Value::int(mask, span), span)?;
                Ok(within(sum, mask, all))
            }
            BitOp::Xor => {
                let kept = self.masked(&value, all & !mask, span)?;
                let turned = self.masked(&value, mask, span)?;
                let turned = self.binary(Op::Sub, Value::int(mask, span), turned, span)?;
                let sum = self.binary(Op::Add, kept, turned, span)?;
                Ok(within(sum, 0, all))
            }
        }
    }

    /// The bits of an unsigned number that a mask selects: one quotient and remainder for each run of ones.
    fn masked(&mut self, value: &Value, mask: i64, span: Span) -> Outcome<Value> {
        let Some((_, most)) = range(value) else { return Err(ErrorReported) };
        let mask = mask & full(bits(most));
        if mask == full(bits(most)) {
            return Ok(value.clone());
        }
        let mut parts = Vec::new();
        let mut rest = mask;
        while rest != 0 {
            let from = rest.trailing_zeros();
            let len = (rest >> from).trailing_ones();
            let part = self.piece(value, from, len, span)?;
            let factor = Value::int(1 << from, span);
            parts.push(if from == 0 { part } else { self.binary(Op::Mul, part, factor, span)? });
            rest &= !(full(len) << from);
            self.spend(span, 2)?;
        }
        let sum = self.sum(parts, span)?;
        Ok(within(sum, 0, mask))
    }

    /// The sum of all values, as a tree of minimum height.
    fn sum(&mut self, mut parts: Vec<Value>, span: Span) -> Outcome<Value> {
        while parts.len() > 1 {
            let mut next = Vec::with_capacity(parts.len().div_ceil(2));
            let mut all = parts.into_iter();
            while let Some(one) = all.next() {
                next.push(match all.next() {
                    Some(other) => self.binary(Op::Add, one, other, span)?,
                    None => one,
                });
            }
            parts = next;
        }
        Ok(parts.pop().unwrap_or_else(|| Value::int(0, span)))
    }

    /// NOT of a number: inverts all bits of its type.
    pub(super) fn complement(&mut self, value: Value, span: Span) -> Outcome<Value> {
        let Some((lo, hi)) = range(&value) else { return Err(ErrorReported) };
        // The result is in two's complement; AND and similar operators use as many of its bits as they need.
        let top = if lo < 0 || lo == hi {
            -1
        } else if type_bits(&value).is_some() {
            hi
        } else {
            return Err(self.refused(
                "NOT of a number that is neither BYTE nor WORD nor signed",
                span,
                "write the mask: `x XOR 16#FF`",
            ));
        };
        self.binary(Op::Sub, Value::int(top, span), value, span)
    }

    /// SHL, SHR, ROL and ROR by a constant.
    pub(super) fn shifted(
        &mut self,
        key: &str,
        value: Value,
        by: Value,
        span: Span,
    ) -> Outcome<Value> {
        let Kind::Int(n, most) = by.kind else {
            return Err(self.type_error("the shift count must be a number", by.expr.span));
        };
        let Some((lo, hi)) = range(&value) else {
            return Err(self.type_error("only numbers can be shifted", value.expr.span));
        };
        if n != most {
            return Err(self.refused(
                &format!("{key} with a variable bit count"),
                by.expr.span,
                "use CASE to choose between constant bit counts",
            ));
        }
        if lo < 0 || n < 0 {
            return Err(self.refused(
                &format!("{key} with a signed number or a negative bit count"),
                span,
                "use BYTE, WORD or another unsigned type",
            ));
        }
        let by = u32::try_from(n).unwrap_or(u32::MAX);
        let is_left = key.ends_with('L');
        if key == "SHR" {
            return if by >= bits(hi) {
                Ok(Value::int(0, span))
            } else {
                self.binary(Op::Div, value, Value::int(1 << by, span), span)
            };
        }
        let Some(width) = type_bits(&value) else {
            // A left shift keeps all bits if no type limits their number.
            if key == "SHL" && bits(hi).saturating_add(by) <= 62 {
                return self.binary(Op::Mul, value, Value::int(1 << by, span), span);
            }
            return Err(self.refused(
                &format!("{key} of a number that is neither BYTE nor WORD"),
                span,
                "first assign it to a BYTE or WORD",
            ));
        };
        if key == "SHL" {
            return if by >= width {
                Ok(Value::int(0, span))
            } else {
                let kept = self.piece(&value, 0, width - by, span)?;
                self.binary(Op::Mul, kept, Value::int(1 << by, span), span)
            };
        }
        let by = by % width;
        let by = if is_left || by == 0 { by } else { width - by };
        if by == 0 {
            return Ok(value);
        }
        let low = self.piece(&value, 0, width - by, span)?;
        let low = self.binary(Op::Mul, low, Value::int(1 << by, span), span)?;
        let high = self.piece(&value, width - by, by, span)?;
        let sum = self.binary(Op::Add, low, high, span)?;
        Ok(within(sum, 0, hi))
    }

    /// Assigns `x.3 := value`.
    pub(super) fn assign_bit(
        &mut self,
        frame: FrameId,
        (inner, bit): (&ast::Expr, u32),
        value: Value,
        span: Span,
        out: &mut grafsynth_ir::chart::Block,
    ) -> Outcome<()> {
        let place = self.place(frame, inner)?;
        let present = self.read(Binding::Place(place.clone()), inner.span)?;
        let set = self.fit(value, &Ty::Bool, "a bit")?.expr;
        let most = match range(&present) {
            Some((0, most)) if bit < bits(most) && most == full(bits(most)) => most,
            Some(_) | None => {
                return Err(self.type_error(
                    "a single bit can only be assigned in a BYTE, WORD or unsigned integer that has this bit",
                    span,
                ));
            }
        };
        let kept = self.masked(&present, most & !(1 << bit), span)?;
        let new = self.binary(Op::Add, kept, weight(set, bit, span), span)?;
        self.assign(&place, within(new, 0, most), span, out)
    }
}

/// `2^bit` if a condition is true, otherwise 0.
fn weight(condition: Expr, bit: u32, span: Span) -> Value {
    let int = |value| Box::new(Expr::new(ExprKind::Int(value), span));
    let most = 1_i64 << bit.min(62);
    let kind = ExprKind::Select(Box::new(condition), int(most), int(0));
    Value { expr: Expr::new(kind, span), kind: Kind::Int(0, most) }
}

/// Gives a value bounds that are narrower than those of its parts.
fn within(value: Value, lo: i64, hi: i64) -> Value {
    match value.kind {
        Kind::Int(least, most) if least != most => {
            Value { kind: Kind::Int(least.max(lo), most.min(hi)), ..value }
        }
        Kind::Int(..) | Kind::Bool | Kind::Time(_) => value,
    }
}
