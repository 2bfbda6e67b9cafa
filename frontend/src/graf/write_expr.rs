//! Writes expressions, with words or with the signs of Grafcet, and with parentheses only where they are needed.

use grafsynth_ir::duration;
use std::collections::BTreeSet;

use grafsynth_ir::chart::{Expr, Leaf};
use grafsynth_ir::expr::{ArithOp, ExprKind};

use super::names::{self, Position};

/// Precedence of the context, lowest first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Level {
    Open,
    Or,
    And,
    Not,
    Compare,
    Add,
    Mul,
    Prefix,
}

/// Writes the expressions of one design.
#[derive(Debug, Clone, Default)]
pub(crate) struct ExprWriter {
    /// Names of extern conditions, which are written with parentheses: `f()`.
    pub(crate) conditions: BTreeSet<String>,
    /// True to write AND, OR and NOT with the signs of Grafcet: `a*/b + c`.
    pub(crate) signs: bool,
}

/// Whether an operator with this right operand is `bnot`.
fn is_complement(op: ArithOp, right: &Expr) -> bool {
    op == ArithOp::BitXor && right.kind == ExprKind::Int(-1)
}

impl ExprWriter {
    /// The expression as text.
    pub(crate) fn text(&self, expr: &Expr) -> String {
        let mut out = String::new();
        self.write(&mut out, expr, Level::Open);
        out
    }

    /// The expression as a factor of a product.
    pub(crate) fn factor(&self, expr: &Expr) -> String {
        let mut out = String::new();
        self.write(&mut out, expr, Level::Prefix);
        out
    }

    /// The operands of the outermost AND or OR and the word that joins them, for breaking long lines; `None` for other expressions.
    pub(crate) fn junction(&self, expr: &Expr) -> Option<(&'static str, Vec<String>)> {
        let (word, operands, level) = match &expr.kind {
            ExprKind::And(operands) => ("and ", operands, Level::Not),
            ExprKind::Or(operands) => ("or ", operands, Level::And),
            _ => return None,
        };
        let pieces = operands.iter().map(|operand| {
            let mut out = String::new();
            self.write(&mut out, operand, level);
            out
        });
        (operands.len() > 1).then(|| (word, pieces.collect()))
    }

    fn write(&self, out: &mut String, expr: &Expr, within: Level) {
        let own = match &expr.kind {
            ExprKind::Select(..) => Level::Open,
            ExprKind::Or(all) if all.len() > 1 => {
                if self.signs {
                    Level::Add
                } else {
                    Level::Or
                }
            }
            ExprKind::And(all) if all.len() > 1 => {
                if self.signs {
                    Level::Mul
                } else {
                    Level::And
                }
            }
            // A junction of one operand is that operand.
            ExprKind::Or(all) | ExprKind::And(all) => {
                match all.first() {
                    Some(only) => self.write(out, only, within),
                    None => out.push_str(if matches!(expr.kind, ExprKind::And(_)) {
                        "true"
                    } else {
                        "false"
                    }),
                }
                return;
            }
            ExprKind::Not(_) => {
                if self.signs {
                    Level::Prefix
                } else {
                    Level::Not
                }
            }
            ExprKind::Compare(..) => Level::Compare,
            ExprKind::Arith(op, _, b) if is_complement(*op, b) => Level::Prefix,
            ExprKind::Arith(op, ..) => {
                if op.is_sum() {
                    Level::Add
                } else {
                    Level::Mul
                }
            }
            // A duration before a slash would be read as a delay.
            ExprKind::Leaf(Leaf::Duration(_) | Leaf::Delay(..)) => Level::Add,
            _ => Level::Prefix,
        };
        if own < within {
            out.push('(');
            self.write_bare(out, expr);
            out.push(')');
        } else {
            self.write_bare(out, expr);
        }
    }

    fn write_bare(&self, out: &mut String, expr: &Expr) {
        match &expr.kind {
            ExprKind::Bool(value) => out.push_str(if *value { "true" } else { "false" }),
            ExprKind::Int(value) => out.push_str(&value.to_string()),
            ExprKind::Leaf(leaf) => self.leaf(out, leaf),
            ExprKind::Element(array, index) => {
                match array {
                    Leaf::Name(path) => out.push_str(&names::path(path, Position::Anywhere)),
                    _ => self.leaf(out, array),
                }
                out.push('[');
                self.write(out, index, Level::Open);
                out.push(']');
            }
            ExprKind::Not(inner) if self.signs => {
                out.push('/');
                self.write(out, inner, Level::Prefix);
            }
            ExprKind::Not(inner) => {
                out.push_str("not ");
                let is_not = matches!(inner.kind, ExprKind::Not(_));
                self.write(out, inner, if is_not { Level::Not } else { Level::Prefix });
            }
            ExprKind::And(all) if self.signs => self.list(out, all, "*", Level::Prefix),
            ExprKind::Or(all) if self.signs => self.list(out, all, " + ", Level::Mul),
            ExprKind::And(all) => self.list(out, all, " and ", Level::Not),
            ExprKind::Or(all) => self.list(out, all, " or ", Level::And),
            ExprKind::Compare(op, a, b) => {
                // A junction of signs inside a comparison is ambiguous, so it gets parentheses.
                let level = |side: &Expr| {
                    let is_junction = matches!(side.kind, ExprKind::And(_) | ExprKind::Or(_));
                    if is_junction { Level::Prefix } else { Level::Add }
                };
                self.write(out, a, level(a));
                out.push(' ');
                out.push_str(op.symbol());
                out.push(' ');
                self.write(out, b, level(b));
            }
            ExprKind::Neg(inner) => {
                out.push('-');
                if matches!(inner.kind, ExprKind::Int(_) | ExprKind::Neg(_)) {
                    out.push('(');
                    self.write(out, inner, Level::Open);
                    out.push(')');
                } else {
                    self.write(out, inner, Level::Prefix);
                }
            }
            ExprKind::Arith(op, a, b) => self.arith(out, *op, a, b),
            ExprKind::Select(condition, a, b) => {
                out.push_str("if ");
                self.write(out, condition, Level::Or);
                out.push_str(" then ");
                self.write(out, a, Level::Or);
                out.push_str(" else ");
                self.write(out, b, Level::Or);
            }
        }
    }

    fn arith(&self, out: &mut String, op: ArithOp, a: &Expr, b: &Expr) {
        if is_complement(op, b) {
            out.push_str("bnot ");
            return self.write(out, a, Level::Prefix);
        }
        let (left, right) =
            if op.is_sum() { (Level::Add, Level::Mul) } else { (Level::Mul, Level::Prefix) };
        // Few readers know how bit operators bind.
        let level = |side: &Expr, level| match &side.kind {
            ExprKind::Arith(inner, ..)
                if *inner != op && (inner.is_bitwise() || op.is_bitwise()) =>
            {
                Level::Prefix
            }
            _ => level,
        };
        self.write(out, a, level(a, left));
        out.push(' ');
        out.push_str(op.symbol());
        out.push(' ');
        self.write(out, b, level(b, right));
    }

    fn list(&self, out: &mut String, all: &[Expr], between: &str, level: Level) {
        for (index, operand) in all.iter().enumerate() {
            if index > 0 {
                out.push_str(between);
            }
            self.write(out, operand, level);
        }
    }

    fn leaf(&self, out: &mut String, leaf: &Leaf) {
        match leaf {
            Leaf::Name(path) => {
                out.push_str(&names::path(path, Position::Anywhere));
                if let [only] = path.names.as_slice()
                    && self.conditions.contains(&only.text)
                {
                    out.push_str("()");
                }
            }
            Leaf::Rise(inner) | Leaf::Fall(inner) => {
                out.push_str(if matches!(leaf, Leaf::Rise(_)) { "rise(" } else { "fall(" });
                self.write(out, inner, Level::Open);
                out.push(')');
            }
            Leaf::Otherwise => out.push_str("otherwise"),
            Leaf::Duration(ns) => out.push_str(&duration(*ns)),
            Leaf::Delay(on, inner, off) => {
                out.push_str(&duration(*on));
                out.push('/');
                self.write(out, inner, Level::Prefix);
                if *off > 0 {
                    out.push('/');
                    out.push_str(&duration(*off));
                }
            }
        }
    }
}
