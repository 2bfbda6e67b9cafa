//! The encoder of both machines: expressions of any kind of leaf as postfix code.

use super::image::narrow;
use super::ops::{Machine, Op};
use crate::refusal::Refusal;
use grafsynth_ir::Span;
use grafsynth_ir::expr::{ArithOp, CompareOp, Expr, ExprKind};

/// The result of encoding something.
pub(super) type Coded<T = ()> = Result<T, Refusal>;

/// Code under construction.
#[derive(Debug, Clone, Default)]
pub(super) struct Code {
    bytes: Vec<u8>,
}

/// The place of a length that is not known yet.
#[must_use]
pub(super) struct Open(usize);

impl Code {
    /// Appends an instruction without an operand.
    pub(super) fn op(&mut self, op: Op) {
        self.bytes.push(op as u8);
    }

    /// Appends an instruction with a number.
    pub(super) fn with(&mut self, op: Op, operand: u16) {
        self.op(op);
        self.bytes.extend(operand.to_le_bytes());
    }

    /// Appends a call of an action with this many arguments.
    pub(super) fn call(&mut self, action: u16, many: u8) {
        self.with(Op::Call, action);
        self.bytes.push(many);
    }

    /// Appends an instruction that pushes a constant.
    pub(super) fn constant(&mut self, value: i64) {
        if let Ok(byte) = i8::try_from(value) {
            self.op(Op::Byte);
            self.bytes.extend(byte.to_le_bytes());
        } else if let Ok(long) = i32::try_from(value) {
            self.op(Op::Long);
            self.bytes.extend(long.to_le_bytes());
        } else {
            self.op(Op::Wide);
            self.bytes.extend(value.to_le_bytes());
        }
    }

    /// Begins code that an instruction contains.
    pub(super) fn open(&mut self, op: Op) -> Open {
        self.with(op, 0);
        Open(self.bytes.len())
    }

    /// Begins the body of a loop.
    pub(super) fn open_loop(&mut self, limit: u32) -> Open {
        self.op(Op::Loop);
        self.bytes.extend(limit.to_le_bytes());
        self.bytes.extend([0, 0]);
        Open(self.bytes.len())
    }

    /// Ends the code that an instruction contains. A length of more than 16 bits makes the image too large, and it is rejected as a whole.
    pub(super) fn close(&mut self, Open(start): Open) {
        let length = narrow(self.bytes.len() - start);
        self.bytes[start - 2..start].copy_from_slice(&length.to_le_bytes());
    }

    /// The number of bytes so far.
    pub(super) fn len(&self) -> usize {
        self.bytes.len()
    }

    /// The bytes.
    pub(super) fn finish(self) -> Vec<u8> {
        self.bytes
    }
}

/// Something that encodes expressions with leaves `L`.
pub(super) trait Encode<L> {
    /// The machine that runs the code.
    const MACHINE: Machine;

    /// The code so far.
    fn code(&mut self) -> &mut Code;

    /// Pushes a leaf.
    fn leaf(&mut self, leaf: &L, span: Span) -> Coded;

    /// Replaces the index on top of the stack by an element of an array.
    fn element(&mut self, array: &L, span: Span) -> Coded;

    /// Rejects arithmetic whose value does not fit into the numbers of the machine.
    fn fits(&self, expr: &Expr<L>) -> Coded;

    /// Pushes the value of an expression.
    fn push(&mut self, expr: &Expr<L>) -> Coded {
        match &expr.kind {
            ExprKind::Bool(value) => self.code().constant(i64::from(*value)),
            ExprKind::Int(value) => {
                self.fits(expr)?;
                self.code().constant(*value);
            }
            ExprKind::Leaf(leaf) => self.leaf(leaf, expr.span)?,
            ExprKind::Element(array, index) => {
                self.push(index)?;
                self.element(array, expr.span)?;
            }
            ExprKind::Not(a) => {
                self.push(a)?;
                self.code().op(Op::Not);
            }
            ExprKind::And(all) => self.junction(all, Op::And, Op::AndThen)?,
            ExprKind::Or(all) => self.junction(all, Op::Or, Op::OrElse)?,
            ExprKind::Compare(op, a, b) => self.two(compare(*op), a, b, expr.span)?,
            ExprKind::Neg(a) => {
                self.fits(expr)?;
                self.push(a)?;
                self.code().op(Op::Neg);
            }
            ExprKind::Arith(op, a, b) => {
                self.fits(expr)?;
                self.two(arith(*op), a, b, expr.span)?;
            }
            ExprKind::Select(c, a, b) => {
                self.push(c)?;
                self.choose(|it| it.push(a), Some(|it: &mut Self| it.push(b)))?;
            }
        }
        Ok(())
    }

    /// Pushes two values and combines them.
    fn two(&mut self, op: Op, a: &Expr<L>, b: &Expr<L>, span: Span) -> Coded {
        if Self::MACHINE.instruction(op as u8).is_none() {
            let is_division = matches!(op, Op::Div | Op::Mod);
            let what = if is_division { "a division" } else { "a bit operator" };
            return Err(Refusal { what: what.to_owned(), span });
        }
        self.push(a)?;
        self.push(b)?;
        self.code().op(op);
        Ok(())
    }

    /// Pushes a conjunction or disjunction. If the machine can, operands that consist of several are skipped when the result is already known; none has a
    /// side effect.
    fn junction(&mut self, all: &[Expr<L>], both: Op, then: Op) -> Coded {
        let Some((first, rest)) = all.split_first() else {
            self.code().constant(i64::from(both == Op::And));
            return Ok(());
        };
        self.push(first)?;
        for operand in rest {
            let is_simple = operand.children().next().is_none();
            if is_simple || Self::MACHINE.instruction(then as u8).is_none() {
                self.push(operand)?;
                self.code().op(both);
            } else {
                let held = self.code().open(then);
                self.push(operand)?;
                self.code().close(held);
            }
        }
        Ok(())
    }

    /// Runs one of two parts by the value on top of the stack.
    fn choose(
        &mut self,
        then: impl FnOnce(&mut Self) -> Coded,
        otherwise: Option<impl FnOnce(&mut Self) -> Coded>,
    ) -> Coded {
        let unless = self.code().open(Op::Unless);
        then(self)?;
        let Some(otherwise) = otherwise else {
            self.code().close(unless);
            return Ok(());
        };
        let other = self.code().open(Op::Else);
        self.code().close(unless);
        otherwise(self)?;
        self.code().close(other);
        Ok(())
    }
}

fn compare(op: CompareOp) -> Op {
    match op {
        CompareOp::Eq => Op::Eq,
        CompareOp::Ne => Op::Ne,
        CompareOp::Lt => Op::Lt,
        CompareOp::Le => Op::Le,
        CompareOp::Gt => Op::Gt,
        CompareOp::Ge => Op::Ge,
    }
}

fn arith(op: ArithOp) -> Op {
    match op {
        ArithOp::Add => Op::Add,
        ArithOp::Sub => Op::Sub,
        ArithOp::Mul => Op::Mul,
        ArithOp::Div => Op::Div,
        ArithOp::Mod => Op::Mod,
        ArithOp::BitAnd => Op::BitAnd,
        ArithOp::BitOr => Op::BitOr,
        ArithOp::BitXor => Op::BitXor,
        ArithOp::Shl => Op::Shl,
        ArithOp::Shr => Op::Shr,
    }
}
