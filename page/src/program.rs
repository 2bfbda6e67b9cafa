//! The reaction program as JSON, for the interpreter in `engine.js`.
//!
//! Booleans are 0 and 1. An integer that may be beyond 2^53 is a BigInt, and the operators that compute or read one are marked: the interval of every
//! expression is known here, so the interpreter needs no checks. Lists begin with a sign: `["+", a, b]`; docs/page.md lists them.

use grafsynth_ir::expr::{ArithOp, CompareOp, ExprKind, Type};
use grafsynth_ir::interval::arith;
use grafsynth_ir::net::Net;
use grafsynth_ir::program::{Expr, Leaf, Mark, Program, Stmt};
use grafsynth_sim::MAX_DT;
use serde_json::{Value, json};

/// The largest integer up to which all integers are exact in a Number.
const LARGEST_NUMBER: i64 = (1 << 53) - 1;

/// The smallest and largest value of an expression.
type Range = (i64, i64);

/// The result of an expression.
struct Written {
    json: Value,
    range: Range,
}

impl Written {
    fn new(json: Value, range: Range) -> Self {
        Written { json, range }
    }

    fn truth(json: Value) -> Self {
        Written { json, range: (0, 1) }
    }

    fn is_wide(&self) -> bool {
        is_wide(self.range)
    }
}

fn is_wide((lo, hi): Range) -> bool {
    lo < -LARGEST_NUMBER || hi > LARGEST_NUMBER
}

fn is_32_bit((lo, hi): Range) -> bool {
    lo >= i64::from(i32::MIN) && hi <= i64::from(i32::MAX)
}

/// Writes programs and expressions over them.
pub(crate) struct ProgramWriter<'a> {
    net: &'a Net,
    program: &'a Program,
}

impl<'a> ProgramWriter<'a> {
    pub(crate) fn new(net: &'a Net, program: &'a Program) -> Self {
        ProgramWriter { net, program }
    }

    /// An expression of the program.
    pub(crate) fn expr(&self, expr: &Expr) -> Value {
        self.written(expr).json
    }

    /// A list of statements.
    pub(crate) fn list(&self, list: &[Stmt]) -> Value {
        Value::Array(list.iter().map(|stmt| self.stmt(stmt)).collect())
    }

    fn stmt(&self, stmt: &Stmt) -> Value {
        match stmt {
            Stmt::Set(temp, value) => json!(["set", temp.index(), self.expr(value)]),
            Stmt::Store(cell, None, value) => json!(["store", cell.index(), self.expr(value)]),
            Stmt::Store(cell, Some(index), value) => {
                json!(["store", cell.index(), self.expr(value), self.expr(index)])
            }
            Stmt::If(condition, then, otherwise) => {
                json!(["if", self.expr(condition), self.list(then), self.list(otherwise)])
            }
            Stmt::Repeat { limit, condition, body } => {
                json!(["repeat", limit, self.expr(condition), self.list(body)])
            }
            Stmt::Output(output, value) => json!(["output", output.index(), self.expr(value)]),
            Stmt::Call(output, arguments) => {
                let arguments: Vec<Value> = arguments.iter().map(|it| self.expr(it)).collect();
                json!(["call", output.index(), arguments])
            }
            // The text itself never gets into a page.
            Stmt::Code(text) => json!(["code", text.language]),
            Stmt::Mark(Mark::MicroStep) => json!(["micro-step"]),
            Stmt::Mark(Mark::Fires(transition)) => json!(["fires", transition.index()]),
            Stmt::Fault(value) => json!(["fault", self.expr(value)]),
        }
    }

    fn written(&self, expr: &Expr) -> Written {
        match &expr.kind {
            ExprKind::Bool(value) => Written::truth(json!(i32::from(*value))),
            ExprKind::Int(value) => {
                let range = (*value, *value);
                let text = if is_wide(range) { json!(value.to_string()) } else { json!(value) };
                Written::new(text, range)
            }
            ExprKind::Leaf(leaf) => self.leaf(*leaf),
            ExprKind::Element(array, index) => {
                let index = self.expr(index);
                let element = self.leaf(*array);
                let place = element.json.get(1).cloned().unwrap_or_default();
                Written::new(json!(["element", place, index]), element.range)
            }
            ExprKind::Not(a) => Written::truth(json!(["not", self.expr(a)])),
            ExprKind::And(all) => self.junction("and", all),
            ExprKind::Or(all) => self.junction("or", all),
            ExprKind::Compare(op, a, b) => {
                let (a, b) = (self.written(a), self.written(b));
                Written::truth(marked(sign(*op), &[&a, &b], a.is_wide() || b.is_wide(), (0, 1)))
            }
            ExprKind::Neg(a) => {
                let a = self.written(a);
                let range = arith(ArithOp::Sub, (0, 0), a.range).unwrap_or(a.range);
                let is_wide = is_wide(range) || a.is_wide();
                Written::new(marked("neg", &[&a], is_wide, range), range)
            }
            ExprKind::Arith(op, a, b) => {
                let (a, b) = (self.written(a), self.written(b));
                let range = arith(*op, a.range, b.range).unwrap_or((i64::MIN, i64::MAX));
                let ranges = [a.range, b.range, range];
                // The bit operators of Numbers have 32 bits; shifts are computed as products and quotients.
                let is_masked = op.is_bitwise() && !op.is_shift();
                let fits = |range: &Range| !is_wide(*range) && (!is_masked || is_32_bit(*range));
                let is_exact = ranges.iter().all(fits);
                Written::new(marked(op.symbol(), &[&a, &b], !is_exact, range), range)
            }
            ExprKind::Select(c, a, b) => {
                let (c, a, b) = (self.written(c), self.written(a), self.written(b));
                let range = (a.range.0.min(b.range.0), a.range.1.max(b.range.1));
                Written::new(marked("select", &[&c, &a, &b], is_wide(range), range), range)
            }
        }
    }

    fn junction(&self, sign: &str, operands: &[Expr]) -> Written {
        let all = std::iter::once(json!(sign)).chain(operands.iter().map(|it| self.expr(it)));
        Written::truth(Value::Array(all.collect()))
    }

    fn leaf(&self, leaf: Leaf) -> Written {
        let (json, ty) = match leaf {
            Leaf::Cell(cell) => {
                (json!(["cell", cell.index()]), self.program.cells.get(cell).map(|it| it.ty))
            }
            Leaf::Temp(temp) => {
                (json!(["temp", temp.index()]), self.program.temps.get(temp).map(|it| it.ty))
            }
            Leaf::Input(input) => {
                (json!(["input", input.index()]), self.net.inputs.get(input).map(|it| it.ty))
            }
            Leaf::Dt => (json!(["dt"]), Some(Type::Int { lo: 0, hi: i64::from(MAX_DT) })),
        };
        Written::new(json, ty.map_or((0, 0), Type::bounds))
    }
}

/// An operator with its operands: `["+", a, b]` for Numbers, `["+", a, b, 1]` if it is computed with BigInts, and `["+", a, b, 2]` if the result is one.
fn marked(sign: &str, operands: &[&Written], with_big: bool, range: Range) -> Value {
    let mut list = vec![json!(sign)];
    list.extend(operands.iter().map(|operand| operand.json.clone()));
    if with_big {
        list.push(json!(if is_wide(range) { 2 } else { 1 }));
    }
    Value::Array(list)
}

/// The sign of a comparison.
pub(crate) fn sign(op: CompareOp) -> &'static str {
    match op {
        CompareOp::Eq => "=",
        CompareOp::Ne => "<>",
        CompareOp::Lt => "<",
        CompareOp::Le => "<=",
        CompareOp::Gt => ">",
        CompareOp::Ge => ">=",
    }
}
