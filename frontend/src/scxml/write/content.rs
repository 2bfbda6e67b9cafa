//! Writes executable content and expressions in ECMAScript syntax.

use std::fmt::Write as _;

use grafsynth_ir::Span;
use grafsynth_ir::chart::{Expr, Leaf, Stmt, StmtKind};
use grafsynth_ir::expr::{ArithOp, CompareOp, ExprKind, Type};
use grafsynth_ir::interval::{self, Leaves, TypeError, TypeErrorKind};
use grafsynth_ir::net::InputKind;

use super::{Writer, time};
use crate::xml;

/// The types of data; `level` is the depth of nested constants.
struct Declared<'w, 'c> {
    writer: &'w Writer<'c>,
    level: usize,
}

impl Declared<'_, '_> {
    fn named(&mut self, leaf: &Leaf, span: Span) -> Result<Type, TypeError> {
        let unknown = TypeError { span, kind: TypeErrorKind::Dangling };
        let Leaf::Name(path) = leaf else { return Err(unknown) };
        let [name] = path.names.as_slice() else { return Ok(Type::Bool) };
        if let Some(value) = self.writer.constants.get(name.text.as_str()) {
            let level = self.level + 1;
            return if level > 64 {
                Err(unknown)
            } else {
                interval::check(value, &mut Declared { writer: self.writer, level })
            };
        }
        let net = self.writer.net;
        let inputs = net.inputs.values().map(|input| (&input.name, input.ty));
        let vars = net.vars.values().map(|var| (&var.name, var.ty));
        let found = inputs.chain(vars).find(|(known, _)| known.text == name.text);
        found.map(|(_, ty)| ty).ok_or(unknown)
    }
}

impl Leaves<Leaf> for Declared<'_, '_> {
    fn leaf(&mut self, leaf: &Leaf, span: Span) -> Result<Type, TypeError> {
        self.named(leaf, span)
    }

    fn array(&mut self, leaf: &Leaf, span: Span) -> Result<(Type, Option<u32>), TypeError> {
        self.named(leaf, span).map(|ty| (ty, None))
    }
}

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
                if let (ArithOp::Shl, ExprKind::Int(by @ 0..=62)) = (op, &b.kind) {
                    return format!("{} * {}", self.operand(a, level), 1_i64 << by);
                }
                if op.is_bitwise() && ![a, b, expr].iter().all(|one| self.fits_32_bits(one)) {
                    self.refuse("a bit operator on numbers of more than 32 bits", expr.span);
                } else if op.is_shift() && !self.is_within(b, 0, 31) {
                    self.refuse("a shift by more than 31", expr.span);
                }
                let (a, b) = (self.operand(a, level), self.operand(b, level));
                match op {
                    ArithOp::Add => format!("{a} + {b}"),
                    ArithOp::Sub => format!("{a} - {b}"),
                    ArithOp::Mul => format!("{a} * {b}"),
                    ArithOp::Mod => format!("{a} % {b}"),
                    ArithOp::Div => format!("Math.trunc({a} / {b})"),
                    ArithOp::BitAnd => format!("{a} & {b}"),
                    ArithOp::BitOr => format!("{a} | {b}"),
                    ArithOp::BitXor => format!("{a} ^ {b}"),
                    ArithOp::Shl => format!("{a} << {b}"),
                    ArithOp::Shr => format!("{a} >> {b}"),
                }
            }
            ExprKind::Select(condition, a, b) => {
                let condition = self.operand(condition, level);
                format!("{condition} ? {} : {}", self.operand(a, level), self.operand(b, level))
            }
        }
    }

    /// Whether the bit operators of ECMAScript, which work on 32 bits, are exact for a number.
    fn fits_32_bits(&self, expr: &Expr) -> bool {
        self.is_within(expr, i32::MIN.into(), i32::MAX.into())
    }

    fn is_within(&self, expr: &Expr, least: i64, most: i64) -> bool {
        let ty = interval::check(expr, &mut Declared { writer: self, level: 0 });
        matches!(ty, Ok(Type::Int { lo, hi }) if least <= lo && hi <= most)
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
