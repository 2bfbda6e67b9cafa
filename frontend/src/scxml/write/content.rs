//! Writes executable content and expressions in ECMAScript syntax.

use std::fmt::Write as _;

use grafsynth_ir::Span;
use grafsynth_ir::chart::{Expr, Leaf, Stmt, StmtKind};
use grafsynth_ir::expr::{ArithOp, CompareOp, ExprKind};
use grafsynth_ir::net::InputKind;

use super::{Writer, time};
use crate::xml;

impl<'c> Writer<'c> {
    pub(super) fn with_content(&mut self, head: &str, block: &'c [Stmt]) {
        if block.is_empty() {
            self.line(&format!("<{head}/>"));
            return;
        }
        self.open(head);
        self.block(block);
        self.close(head.split(' ').next().unwrap_or(head));
    }

    pub(super) fn block(&mut self, block: &'c [Stmt]) {
        for stmt in block {
            self.stmt(stmt);
        }
    }

    fn stmt(&mut self, stmt: &'c Stmt) {
        match &stmt.kind {
            StmtKind::Assign { target, index, value } => {
                let name = target.names.last().map_or("", |name| name.text.as_str());
                if !self.data.contains(name) {
                    self.refuse(format!("an assignment to {target}"), stmt.span);
                }
                let place = match index {
                    Some(index) => format!("{}[{}]", self.id(name), self.expr(index, 0)),
                    None => self.id(name),
                };
                let value = self.expr(value, 0);
                self.line(&format!(
                    "<assign location=\"{}\" expr=\"{}\"/>",
                    xml::attribute(&place),
                    xml::attribute(&value)
                ));
            }
            StmtKind::Raise(event) => {
                let event = xml::attribute(&self.event(event));
                self.line(&format!("<raise event=\"{event}\"/>"));
            }
            StmtKind::Send { event, after, slot } => {
                let mut line = format!("<send event=\"{}\"", xml::attribute(&self.event(event)));
                if let Some(after) = after {
                    let _ = write!(line, " delay=\"{}\"", time::text(*after));
                }
                if let Some(slot) = slot {
                    let _ = write!(line, " id=\"{}\"", xml::attribute(&slot.text));
                }
                line.push_str("/>");
                self.line(&line);
            }
            StmtKind::Cancel(slot) => {
                let slot = xml::attribute(&slot.text);
                self.line(&format!("<cancel sendid=\"{slot}\"/>"));
            }
            StmtKind::If { condition, then, otherwise } => {
                let text = self.expr(condition, 0);
                self.open(&format!("if cond=\"{}\"", xml::attribute(&text)));
                self.block(then);
                let mut rest = otherwise.as_slice();
                while let [Stmt { kind: StmtKind::If { condition, then, otherwise }, .. }] = rest {
                    let text = self.expr(condition, 0);
                    self.depth -= 1;
                    self.line(&format!("<elseif cond=\"{}\"/>", xml::attribute(&text)));
                    self.depth += 1;
                    self.block(then);
                    rest = otherwise;
                }
                if !rest.is_empty() {
                    self.depth -= 1;
                    self.line("<else/>");
                    self.depth += 1;
                    self.block(rest);
                }
                self.close("if");
            }
            StmtKind::Call { .. } => self.refuse("a call", stmt.span),
            StmtKind::Code(_) => self.refuse("code in another language", stmt.span),
        }
    }

    /// Writes an expression. `level` is the depth of nested constants; it is limited because constants may refer to each other.
    pub(super) fn expr(&mut self, expr: &'c Expr, level: usize) -> String {
        match &expr.kind {
            ExprKind::Bool(value) => value.to_string(),
            ExprKind::Int(value) => value.to_string(),
            ExprKind::Leaf(leaf) => self.leaf(leaf, expr.span, level),
            ExprKind::Element(Leaf::Name(path), index) => {
                let index = self.expr(index, level);
                format!("{}[{index}]", self.target(path))
            }
            ExprKind::Element(_, _) => {
                self.refuse("an element of something that is not an array", expr.span);
                String::new()
            }
            ExprKind::Not(inner) => format!("!{}", self.operand(inner, level)),
            ExprKind::Neg(inner) => format!("-{}", self.operand(inner, level)),
            ExprKind::And(all) => self.junction(all, " && ", "true", level),
            ExprKind::Or(all) => self.junction(all, " || ", "false", level),
            ExprKind::Compare(op, a, b) => {
                let sign = match op {
                    CompareOp::Eq => "==",
                    CompareOp::Ne => "!=",
                    CompareOp::Lt => "<",
                    CompareOp::Le => "<=",
                    CompareOp::Gt => ">",
                    CompareOp::Ge => ">=",
                };
                format!("{} {sign} {}", self.operand(a, level), self.operand(b, level))
            }
            ExprKind::Arith(op, a, b) => {
                let (a, b) = (self.operand(a, level), self.operand(b, level));
                match op {
                    ArithOp::Add => format!("{a} + {b}"),
                    ArithOp::Sub => format!("{a} - {b}"),
                    ArithOp::Mul => format!("{a} * {b}"),
                    ArithOp::Mod => format!("{a} % {b}"),
                    ArithOp::Div => format!("Math.trunc({a} / {b})"),
                }
            }
            ExprKind::Select(condition, a, b) => {
                let condition = self.operand(condition, level);
                format!("{condition} ? {} : {}", self.operand(a, level), self.operand(b, level))
            }
        }
    }

    fn junction(&mut self, all: &'c [Expr], sign: &str, empty: &str, level: usize) -> String {
        let texts: Vec<String> = all.iter().map(|one| self.operand(one, level)).collect();
        if texts.is_empty() { empty.to_owned() } else { texts.join(sign) }
    }

    /// Writes an operand, in parentheses unless they are certainly unnecessary.
    fn operand(&mut self, expr: &'c Expr, level: usize) -> String {
        let text = self.expr(expr, level);
        let is_tight = match &expr.kind {
            ExprKind::Bool(_) | ExprKind::Leaf(_) | ExprKind::Element(..) => true,
            ExprKind::Int(value) => *value >= 0,
            ExprKind::Arith(op, ..) => *op == ArithOp::Div,
            _ => false,
        };
        if is_tight { text } else { format!("({text})") }
    }

    fn leaf(&mut self, leaf: &'c Leaf, span: Span, level: usize) -> String {
        let Leaf::Name(path) = leaf else {
            self.refuse("edges, `otherwise` and times in conditions", span);
            return String::new();
        };
        match path.names.as_slice() {
            [.., state, attribute] if attribute.text == "active" => {
                format!("In('{}')", self.id(&state.text))
            }
            [only] => {
                if let Some(value) = self.constants.get(only.text.as_str()).copied() {
                    if level > 64 {
                        self.refuse("constants that refer to each other too often", span);
                        return String::new();
                    }
                    return format!("({})", self.expr(value, level + 1));
                }
                let is_read = self.data.contains(only.text.as_str());
                let is_event = self.net.inputs.values().any(|input| {
                    input.name.text == only.text
                        && matches!(input.kind, InputKind::Event | InputKind::InternalEvent)
                });
                if !is_read || is_event {
                    self.refuse(format!("{only} as a value"), span);
                }
                self.id(&only.text)
            }
            _ => {
                self.refuse(format!("{path} as a value"), span);
                String::new()
            }
        }
    }
}
