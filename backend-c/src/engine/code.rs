//! Expressions and statement lists of tables as code of the narrow machine.

use super::Plan;
use super::assemble::{Code, Coded, Encode};
use super::check::{Bounds, Flaw, check_code};
use super::image::narrow;
use super::ops::{Machine, Op};
use crate::refusal::Refusal;
use grafsynth_ir::Span;
use grafsynth_ir::expr::ExprKind;
use grafsynth_ir::interval;
use grafsynth_ir::net::{Block, Expr, Leaf, Stmt, StmtKind};

/// Encodes a block.
struct Assembler<'a> {
    plan: &'a Plan<'a>,
    code: Code,
}

/// An expression as a block that leaves its value on the stack.
pub(super) fn value(plan: &Plan<'_>, expr: &Expr) -> Coded<Vec<u8>> {
    let mut assembler = Assembler { plan, code: Code::default() };
    assembler.push(expr)?;
    assembler.finish(1, expr.span)
}

/// A statement list as a block that leaves nothing on the stack.
pub(super) fn list(plan: &Plan<'_>, block: &Block) -> Coded<Vec<u8>> {
    let mut assembler = Assembler { plan, code: Code::default() };
    assembler.block(block)?;
    assembler.finish(0, block.first().map_or_else(Span::default, |stmt| stmt.span))
}

/// The variables that are not 0 after reset, as a block.
pub(super) fn reset(plan: &Plan<'_>) -> Vec<u8> {
    let mut code = Code::default();
    for (id, var) in plan.net.vars.iter() {
        let init = var.init.first().copied().unwrap_or(0);
        if init != 0 {
            code.constant(init);
            code.with(Op::SetValue, narrow(id.index()));
        }
    }
    code.finish()
}

fn refuse<T>(what: &str, span: Span) -> Coded<T> {
    Err(Refusal { what: what.to_owned(), span })
}

impl Encode<Leaf> for Assembler<'_> {
    const MACHINE: Machine = Machine::Narrow;

    fn code(&mut self) -> &mut Code {
        &mut self.code
    }

    /// Rejects an expression whose value may not fit in 32 bits, with which the engine computes.
    fn fits(&self, expr: &Expr) -> Coded {
        if let ExprKind::Int(value) = expr.kind {
            let fits = i32::try_from(value).is_ok();
            return if fits { Ok(()) } else { refuse("a number of more than 32 bits", expr.span) };
        }
        let bounds = interval::net_type(self.plan.net, expr).map(|ty| ty.bounds());
        match bounds {
            Ok((lo, hi)) if i32::try_from(lo).is_ok() && i32::try_from(hi).is_ok() => Ok(()),
            Ok(_) | Err(_) => refuse("a value of more than 32 bits", expr.span),
        }
    }

    fn leaf(&mut self, leaf: &Leaf, span: Span) -> Coded {
        let plan = self.plan;
        let (op, at) = match *leaf {
            Leaf::Input(input) => match plan.inputs[input] {
                Some(number) if !plan.net.inputs[input].kind.is_event() => (Op::Input, number),
                Some(_) | None => return refuse("an event in a condition", span),
            },
            Leaf::Var(var) => (Op::Value, narrow(var.index())),
            Leaf::Active(step) => (Op::Bit, narrow(step.index())),
            Leaf::Elapsed(step) => match plan.timers.get(&step) {
                Some((number, _)) => {
                    (Op::Value, narrow(plan.net.vars.len() + usize::from(*number)))
                }
                None => return refuse("a time that is not compared with a constant", span),
            },
            Leaf::Rise(edge) => (Op::Rise, plan.edge_bit(edge.index())),
            Leaf::Fall(edge) => (Op::Fall, plan.edge_bit(edge.index())),
            Leaf::LastElapsed(_) => return refuse("the time `T` of a step", span),
            Leaf::TasksDone(_) => return refuse("tasks", span),
            Leaf::Timer(_) => return refuse("a free timer", span),
            Leaf::Fireable(_) => return refuse("`otherwise`", span),
            Leaf::Controlled(_) => return refuse("a controlled action", span),
        };
        self.code.with(op, at);
        Ok(())
    }

    fn element(&mut self, _: &Leaf, span: Span) -> Coded {
        refuse("an array", span)
    }
}

impl Assembler<'_> {
    /// The code, if the machine can run it: it must not need more stack or deeper parts than there are.
    fn finish(self, wanted: usize, span: Span) -> Coded<Vec<u8>> {
        let code = self.code.finish();
        let bounds = Bounds::ANY;
        match check_code(Machine::Narrow, &code, 0..code.len(), &bounds, wanted) {
            Ok(()) => Ok(code),
            Err(Flaw { reason, .. }) => {
                refuse(&format!("a list or condition in whose code {reason}"), span)
            }
        }
    }

    fn block(&mut self, block: &Block) -> Coded {
        block.iter().try_for_each(|stmt| self.stmt(stmt))
    }

    fn stmt(&mut self, stmt: &Stmt) -> Coded {
        let span = stmt.span;
        match &stmt.kind {
            StmtKind::Assign { var, index: None, value } => {
                self.push(value)?;
                self.code.with(Op::SetValue, narrow(var.index()));
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
                self.push(condition)?;
                let other = |it: &mut Self| it.block(otherwise);
                self.choose(|it| it.block(then), (!otherwise.is_empty()).then_some(other))
            }
        }
    }
}
