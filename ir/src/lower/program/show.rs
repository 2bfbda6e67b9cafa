//! A program as text, for dumps and tests. Only people read it: names may not be unique.

use itertools::Itertools as _;
use std::fmt::Write;

use crate::expr::{ArithOp, ExprKind};
use crate::net::Net;
use crate::program::{Expr, Leaf, Program, Stmt};

/// The program as text: cells with their values after reset, then the statements, indented by their nesting.
///
/// ```text
/// cell p1 = 1
/// cell n 0..99 = 0
///
/// fire t1 := p1 and m
/// if fire t1:
///     n := n + 1
/// p1 := p1 and not fire t1
/// ```
#[must_use]
pub fn show(net: &Net, program: &Program) -> String {
    let mut writer = Writer { net, program, text: String::new() };
    for cell in program.cells.values() {
        let len = cell.len.map_or(String::new(), |len| format!("[{len}]"));
        let range = if cell.ty.is_bool() {
            String::new()
        } else {
            let (lo, hi) = cell.ty.bounds();
            format!(" {lo}..{hi}")
        };
        let init = cell.init.iter().map(i64::to_string).join(", ");
        writer.line(0, &format!("cell {}{len}{range} = {}", cell.name, init));
    }
    writer.text.push('\n');
    writer.list(&program.body, 0);
    writer.text
}

struct Writer<'a> {
    net: &'a Net,
    program: &'a Program,
    text: String,
}

impl Writer<'_> {
    fn line(&mut self, depth: usize, text: &str) {
        let indent = depth * 4;
        // Writing to a string cannot fail.
        let _ = writeln!(self.text, "{:indent$}{text}", "");
    }

    fn list(&mut self, body: &[Stmt], depth: usize) {
        for statement in body {
            match statement {
                Stmt::Set(temp, value) => {
                    let text = format!("{} := {}", self.leaf(Leaf::Temp(*temp)), self.expr(value));
                    self.line(depth, &text);
                }
                Stmt::Store(cell, index, value) => {
                    let index = index
                        .as_ref()
                        .map_or(String::new(), |index| format!("[{}]", self.expr(index)));
                    let text =
                        format!("{}{index} := {}", self.leaf(Leaf::Cell(*cell)), self.expr(value));
                    self.line(depth, &text);
                }
                Stmt::If(condition, then, otherwise) => {
                    let text = format!("if {}:", self.expr(condition));
                    self.line(depth, &text);
                    self.list(then, depth + 1);
                    if !otherwise.is_empty() {
                        self.line(depth, "else:");
                        self.list(otherwise, depth + 1);
                    }
                }
                Stmt::Repeat { limit, condition, body } => {
                    let text = format!("repeat at most {limit} while {}:", self.expr(condition));
                    self.line(depth, &text);
                    self.list(body, depth + 1);
                }
                Stmt::Output(output, value) => {
                    let text =
                        format!("output {} = {}", self.net.outputs[*output].name, self.expr(value));
                    self.line(depth, &text);
                }
                Stmt::Call(output, arguments) => {
                    let arguments = arguments.iter().map(|argument| self.expr(argument)).join(", ");
                    let text = format!("call {}({})", self.net.outputs[*output].name, arguments);
                    self.line(depth, &text);
                }
                Stmt::Code(text) => self.line(depth, &format!("code {}", text.language)),
                Stmt::Mark(mark) => self.line(depth, &format!("mark {mark:?}")),
                Stmt::Fault(value) => {
                    let text = format!("fault = {}", self.expr(value));
                    self.line(depth, &text);
                }
            }
        }
    }

    fn leaf(&self, leaf: Leaf) -> String {
        match leaf {
            Leaf::Cell(cell) => self.program.cells[cell].name.clone(),
            Leaf::Temp(temp) => format!("%{}", self.program.temps[temp].name),
            Leaf::Input(input) => self.net.inputs[input].name.text.clone(),
            Leaf::Dt => "dt".to_owned(),
        }
    }

    fn expr(&self, expr: &Expr) -> String {
        let many = |all: &[Expr], word: &str, none: &str| {
            if all.is_empty() {
                none.to_owned()
            } else {
                all.iter().map(|one| self.operand(one)).join(word)
            }
        };
        match &expr.kind {
            ExprKind::Bool(value) => value.to_string(),
            ExprKind::Int(value) => value.to_string(),
            ExprKind::Leaf(leaf) => self.leaf(*leaf),
            ExprKind::Element(leaf, index) => format!("{}[{}]", self.leaf(*leaf), self.expr(index)),
            ExprKind::Not(a) => format!("not {}", self.operand(a)),
            ExprKind::And(all) => many(all, " and ", "true"),
            ExprKind::Or(all) => many(all, " or ", "false"),
            ExprKind::Compare(op, a, b) => {
                format!("{} {} {}", self.operand(a), op.symbol(), self.operand(b))
            }
            ExprKind::Neg(a) => format!("-{}", self.operand(a)),
            ExprKind::Arith(op, a, b) => self.arith(*op, a, b),
            ExprKind::Select(c, a, b) => {
                format!("select({}, {}, {})", self.expr(c), self.expr(a), self.expr(b))
            }
        }
    }

    fn arith(&self, op: ArithOp, a: &Expr, b: &Expr) -> String {
        format!("{} {} {}", self.operand(a), op.symbol(), self.operand(b))
    }

    fn operand(&self, expr: &Expr) -> String {
        let text = self.expr(expr);
        if matches!(
            expr.kind,
            ExprKind::And(_)
                | ExprKind::Or(_)
                | ExprKind::Compare(..)
                | ExprKind::Neg(_)
                | ExprKind::Arith(..)
        ) {
            format!("({text})")
        } else {
            text
        }
    }
}
