//! Bit operations on numbers: AND, OR, XOR, NOT, shifts, rotations and assignments to single bits.
//!
//! ```text
//! x AND 16#F0      x band 240
//! SHL(x, 3)        (x band 31) shl 3                        in a BYTE
//! x.3 := b         x band 247 bor (if b then 8 else 0)
//! ```
//! AND, OR and XOR are exact, like all operators in an expression; an assignment wraps the result around. NOT, SHL and rotations need the width of a type.

use grafsynth_ir::Span;
use grafsynth_ir::diag::ErrorReported;
use grafsynth_ir::expr::ArithOp;

use super::context::{Binding, Elaborator, FrameId, MAX_NODES, Outcome};
use super::types::Ty;
use super::value::{Kind, Value, nodes};
use crate::number::{self, Num};
use crate::st::ast;

/// The number of bits that the value `most` needs.
fn bits(most: i64) -> u32 {
    64 - most.max(0).leading_zeros()
}

/// The largest number with `n_bits` bits, at most 62.
fn full(n_bits: u32) -> i64 {
    number::range(n_bits.min(62), false).1
}

/// The number of bits of the unsigned type (BYTE, WORD or a similar type) that has the range of this number.
fn type_bits(num: &Num) -> Option<u32> {
    match (num.lo, num.hi) {
        (0, 255) => Some(8),
        (0, 65_535) => Some(16),
        _ => None,
    }
}

impl Elaborator<'_> {
    /// Combines a chain of numbers bit by bit.
    pub(super) fn bitwise(
        &mut self,
        op: ArithOp,
        values: Vec<Value>,
        span: Span,
    ) -> Outcome<Value> {
        let mut all = values.into_iter();
        let mut result = all.next().ok_or(ErrorReported)?;
        for value in all {
            result = self.bit_pair(op, &result, &value, span)?;
            if nodes(&result.expr, MAX_NODES) >= MAX_NODES {
                return Err(self.too_much(span));
            }
        }
        Ok(result)
    }

    fn bit_pair(&mut self, op: ArithOp, a: &Value, b: &Value, span: Span) -> Outcome<Value> {
        let (Some(a), Some(b)) = (a.num(), b.num()) else {
            return Err(self.type_error(
                "a bit operator cannot mix numbers and Booleans; write `x <> 0` for the number",
                span,
            ));
        };
        Ok(Value::of_num(a.op(op, &b).unwrap_or_else(|| a.exact(op, &b)), span))
    }

    /// NOT of a number: inverts all bits of its type.
    pub(super) fn complement(&mut self, value: &Value, span: Span) -> Outcome<Value> {
        let num = value.num().ok_or(ErrorReported)?;
        // The result is in two's complement; AND and similar operators use as many of its bits as they need.
        let ones = if num.lo < 0 || num.lo == num.hi {
            -1
        } else if type_bits(&num).is_some() {
            num.hi
        } else {
            return Err(self.refused(
                "NOT of a number that is neither BYTE nor WORD nor signed",
                span,
                "write the mask: `x XOR 16#FF`",
            ));
        };
        Ok(Value::of_num(num.exact(ArithOp::BitXor, &Num::constant(ones, span)), span))
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
        let Kind::Int(lo, hi) = value.kind else {
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
        let num = Num { expr: value.expr, lo, hi };
        let by = u32::try_from(n).unwrap_or(u32::MAX);
        let is_lost = |n_bits: u32| by >= n_bits;
        let done = |num: Option<Num>| num.map(|num| Value::of_num(num, span)).ok_or(ErrorReported);
        if key == "SHR" {
            let gone = Num::constant(0, span);
            return done(if is_lost(bits(hi)) { Some(gone) } else { num.by(ArithOp::Shr, n) });
        }
        let Some(width) = type_bits(&num) else {
            // A left shift keeps all bits if no type limits their number.
            if key == "SHL" && bits(hi).saturating_add(by) <= 62 {
                return done(num.by(ArithOp::Shl, n));
            }
            return Err(self.refused(
                &format!("{key} of a number that is neither BYTE nor WORD"),
                span,
                "first assign it to a BYTE or WORD",
            ));
        };
        if key == "SHL" && is_lost(width) {
            return Ok(Value::int(0, span));
        }
        // A rotation to the right by n bits is a rotation to the left by the width minus n.
        let by = if key == "ROR" { width - by % width } else { by } % width;
        if by == 0 {
            return done(Some(num));
        }
        let left = num.low_bits(width - by).by(ArithOp::Shl, by.into());
        if key == "SHL" {
            return done(left);
        }
        let right = num.by(ArithOp::Shr, (width - by).into());
        done(left.zip(right).and_then(|(left, right)| left.op(ArithOp::BitOr, &right)))
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
        let present = present
            .num()
            .filter(|num| num.lo == 0 && bit < bits(num.hi) && num.hi == full(bits(num.hi)));
        let Some(present) = present else {
            return Err(self.type_error(
                "a single bit can only be assigned in a BYTE, WORD or unsigned integer that has this bit",
                span,
            ));
        };
        let (one, zero) = (Num::constant(1 << bit, span), Num::constant(0, span));
        let new = present
            .by(ArithOp::BitAnd, present.hi & !(1 << bit))
            .and_then(|kept| kept.op(ArithOp::BitOr, &Num::select(set, &one, &zero)))
            .ok_or(ErrorReported)?;
        self.assign(&place, Value::of_num(new, span), span, out)
    }
}
