//! Expressions and statement lists as the engine's code: postfix, on a stack of [`STACK`] 32-bit numbers.

use super::Plan;
use crate::refusal::Refusal;
use grafsynth_ir::Span;
use grafsynth_ir::expr::{ArithOp, CompareOp, ExprKind};
use grafsynth_ir::interval;
use grafsynth_ir::net::{Block, Expr, Leaf, Stmt, StmtKind};

/// The depth of the engine's stack.
const STACK: usize = 16;

/// The instructions, in the order of their codes.
#[derive(Debug, Clone, Copy)]
enum Op {
    Byte = 0,
    Long = 1,
    Input = 2,
    Var = 3,
    Active = 4,
    Timer = 5,
    Rise = 6,
    Fall = 7,
    Not = 8,
    And = 9,
    Or = 10,
    Eq = 11,
    Ne = 12,
    Lt = 13,
    Le = 14,
    Gt = 15,
    Ge = 16,
    Add = 17,
    Sub = 18,
    Mul = 19,
    Neg = 20,
    Select = 21,
    Store = 22,
    Unless = 23,
    Skip = 24,
}

/// A block under construction.
pub(super) struct Assembler<'a> {
    plan: &'a Plan<'a>,
    code: Vec<u8>,
    depth: usize,
}

/// An expression as a block that leaves its value on the stack.
pub(super) fn value(plan: &Plan<'_>, expr: &Expr) -> Result<Vec<u8>, Refusal> {
    let mut assembler = Assembler { plan, code: Vec::new(), depth: 0 };
    assembler.expr(expr)?;
    Ok(assembler.code)
}

/// A statement list as a block that leaves nothing on the stack.
pub(super) fn list(plan: &Plan<'_>, block: &Block) -> Result<Vec<u8>, Refusal> {
    let mut assembler = Assembler { plan, code: Vec::new(), depth: 0 };
    assembler.block(block)?;
    Ok(assembler.code)
}

fn refuse<T>(what: &str, span: Span) -> Result<T, Refusal> {
    Err(Refusal { what: what.to_owned(), span })
}

impl Assembler<'_> {
    fn op(&mut self, op: Op) {
        self.code.push(op as u8);
    }

    fn with(&mut self, op: Op, operand: u16) {
        self.op(op);
        self.code.extend(operand.to_le_bytes());
    }

    fn push(&mut self, span: Span) -> Result<(), Refusal> {
        self.depth += 1;
        if self.depth > STACK {
            return refuse("an expression that needs more than 16 values at once", span);
        }
        Ok(())
    }

    fn constant(&mut self, value: i64, span: Span) -> Result<(), Refusal> {
        if let Ok(small) = i8::try_from(value) {
            self.op(Op::Byte);
            self.code.extend(small.to_le_bytes());
        } else if let Ok(long) = i32::try_from(value) {
            self.op(Op::Long);
            self.code.extend(long.to_le_bytes());
        } else {
            return refuse("a number of more than 32 bits", span);
        }
        self.push(span)
    }

    fn expr(&mut self, expr: &Expr) -> Result<(), Refusal> {
        let span = expr.span;
        match &expr.kind {
            ExprKind::Bool(value) => self.constant(i64::from(*value), span),
            ExprKind::Int(value) => self.constant(*value, span),
            ExprKind::Leaf(leaf) => self.leaf(*leaf, span),
            ExprKind::Element(..) => refuse("an array", span),
            ExprKind::Not(a) => {
                self.expr(a)?;
                self.op(Op::Not);
                Ok(())
            }
            ExprKind::And(all) => self.all(all, Op::And, true, span),
            ExprKind::Or(all) => self.all(all, Op::Or, false, span),
            ExprKind::Compare(op, a, b) => {
                self.expr(a)?;
                self.expr(b)?;
                self.two(match op {
                    CompareOp::Eq => Op::Eq,
                    CompareOp::Ne => Op::Ne,
                    CompareOp::Lt => Op::Lt,
                    CompareOp::Le => Op::Le,
                    CompareOp::Gt => Op::Gt,
                    CompareOp::Ge => Op::Ge,
                });
                Ok(())
            }
            ExprKind::Neg(a) => {
                self.fits(expr)?;
                self.expr(a)?;
                self.op(Op::Neg);
                Ok(())
            }
            ExprKind::Arith(op, a, b) => {
                self.fits(expr)?;
                self.expr(a)?;
                self.expr(b)?;
                self.two(match op {
                    ArithOp::Add => Op::Add,
                    ArithOp::Sub => Op::Sub,
                    ArithOp::Mul => Op::Mul,
                    ArithOp::Div | ArithOp::Mod => return refuse("a division", span),
                    ArithOp::BitAnd
                    | ArithOp::BitOr
                    | ArithOp::BitXor
                    | ArithOp::Shl
                    | ArithOp::Shr => return refuse("a bit operator", span),
                });
                Ok(())
            }
            ExprKind::Select(c, a, b) => {
                self.expr(c)?;
                self.expr(a)?;
                self.expr(b)?;
                self.op(Op::Select);
                self.depth -= 2;
                Ok(())
            }
        }
    }

    /// Rejects an expression whose value might exceed the 32 bits with which the engine computes.
    fn fits(&self, expr: &Expr) -> Result<(), Refusal> {
        let bounds = interval::net_type(self.plan.net, expr).map(|ty| ty.bounds());
        match bounds {
            Ok((lo, hi)) if i32::try_from(lo).is_ok() && i32::try_from(hi).is_ok() => Ok(()),
            Ok(_) | Err(_) => refuse("a value of more than 32 bits", expr.span),
        }
    }

    fn two(&mut self, op: Op) {
        self.op(op);
        self.depth -= 1;
    }

    fn all(&mut self, all: &[Expr], op: Op, none: bool, span: Span) -> Result<(), Refusal> {
        let Some((first, rest)) = all.split_first() else {
            return self.constant(i64::from(none), span);
        };
        self.expr(first)?;
        for operand in rest {
            self.expr(operand)?;
            self.two(op);
        }
        Ok(())
    }

    fn leaf(&mut self, leaf: Leaf, span: Span) -> Result<(), Refusal> {
        match leaf {
            Leaf::Input(input) => match self.plan.inputs[input] {
                Some(number) if !self.plan.net.inputs[input].kind.is_event() => {
                    self.with(Op::Input, number);
                }
                Some(_) | None => return refuse("an event in a condition", span),
            },
            Leaf::Var(var) => self.with(Op::Var, super::image::narrow(var.index())),
            Leaf::Active(step) => self.with(Op::Active, super::image::narrow(step.index())),
            Leaf::Elapsed(step) => match self.plan.timers.get(&step) {
                Some((number, _)) => self.with(Op::Timer, *number),
                None => return refuse("a time that is not compared with a constant", span),
            },
            Leaf::Rise(edge) => self.with(Op::Rise, super::image::narrow(edge.index())),
            Leaf::Fall(edge) => self.with(Op::Fall, super::image::narrow(edge.index())),
            Leaf::LastElapsed(_) => return refuse("the time `T` of a step", span),
            Leaf::TasksDone(_) => return refuse("tasks", span),
            Leaf::Timer(_) => return refuse("a free timer", span),
            Leaf::Fireable(_) => return refuse("`otherwise`", span),
            Leaf::Controlled(_) => return refuse("a controlled action", span),
        }
        self.push(span)
    }

    fn block(&mut self, block: &Block) -> Result<(), Refusal> {
        block.iter().try_for_each(|stmt| self.stmt(stmt))
    }

    fn stmt(&mut self, stmt: &Stmt) -> Result<(), Refusal> {
        let span = stmt.span;
        match &stmt.kind {
            StmtKind::Assign { var, index: None, value } => {
                self.expr(value)?;
                self.with(Op::Store, super::image::narrow(var.index()));
                self.depth -= 1;
                Ok(())
            }
            StmtKind::Assign { index: Some(_), .. } => refuse("an array", span),
            // An event without a listener is dropped.
            StmtKind::Raise(event) if !self.plan.listened.contains(event) => Ok(()),
            StmtKind::Raise(_) => refuse("`raise`", span),
            StmtKind::Send(_) | StmtKind::Cancel(_) => refuse("`send`", span),
            StmtKind::Call { .. } => refuse("an extern action", span),
            StmtKind::Code(_) => refuse("text of another language", span),
            StmtKind::If { condition, then, otherwise } => {
                self.expr(condition)?;
                self.depth -= 1;
                let unless = self.jump(Op::Unless);
                self.block(then)?;
                if otherwise.is_empty() {
                    self.land(unless);
                } else {
                    let skip = self.jump(Op::Skip);
                    self.land(unless);
                    self.block(otherwise)?;
                    self.land(skip);
                }
                Ok(())
            }
        }
    }

    /// Emits a forward jump whose length is not known yet; returns the position of its operand.
    fn jump(&mut self, op: Op) -> usize {
        self.with(op, 0);
        self.code.len() - 2
    }

    fn land(&mut self, operand: usize) {
        let length = super::image::narrow(self.code.len() - operand - 2);
        self.code[operand..operand + 2].copy_from_slice(&length.to_le_bytes());
    }
}
