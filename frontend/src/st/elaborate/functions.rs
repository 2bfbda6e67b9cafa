//! Functions: standard functions become operators; user-defined functions are evaluated by running their bodies on expressions.

use std::collections::BTreeMap;

use grafsynth_ir::chart::Expr;
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::expr::ExprKind;
use grafsynth_ir::{Name, Span};

use super::leave::{self, LEFT, RETURNED, SKIPPED, VARIABLE};
use super::types::{Ty, integer};
use super::usage::upper;
use super::value::{Kind, Value, nodes};
use super::{Binding, Elaborator, Frame, FrameId, ObjectKind, Outcome, Told};
use crate::codes;
use crate::st::ast::{self, Arg, Body, Op, PouKind, Section, StmtKind};

/// Maximum number of nodes in the value of a variable in a function.
pub(super) const MAX_NODES: usize = 4_000;
/// Maximum depth of nested function calls.
const MAX_CALLS: usize = 32;

/// A choice between two values of the same kind, except times.
pub(super) fn select(condition: Expr, then: Value, otherwise: Value, span: Span) -> Value {
    if then == otherwise || condition.is_true() {
        return then;
    }
    if condition.is_false() {
        return otherwise;
    }
    let kind = match (&then.kind, &otherwise.kind) {
        (Kind::Int(al, ah), Kind::Int(bl, bh)) => Kind::Int(*al.min(bl), *ah.max(bh)),
        (kind, _) => kind.clone(),
    };
    if let (Kind::Bool, Some(expr)) = (&kind, either(&condition, &then.expr, &otherwise.expr)) {
        return Value { expr: Expr::new(expr.kind, span), kind };
    }
    let (condition, then, otherwise) = flatter(condition, then.expr, otherwise.expr);
    let expr = ExprKind::Select(Box::new(condition), Box::new(then), Box::new(otherwise));
    Value { expr: Expr::new(expr, span), kind }
}

/// A choice between two Booleans, one of which is constant.
fn either(condition: &Expr, then: &Expr, otherwise: &Expr) -> Option<Expr> {
    let (yes, no) = (|| condition.clone(), || condition.clone().not());
    if then.is_true() {
        Some(Expr::or([yes(), otherwise.clone()]))
    } else if then.is_false() {
        Some(Expr::and([no(), otherwise.clone()]))
    } else if otherwise.is_true() {
        Some(Expr::or([no(), then.clone()]))
    } else if otherwise.is_false() {
        Some(Expr::and([yes(), then.clone()]))
    } else {
        None
    }
}

/// Merges nested choices that leave the same value: nested IFs would otherwise double that value with each level.
fn flatter(condition: Expr, then: Expr, otherwise: Expr) -> (Expr, Expr, Expr) {
    if let ExprKind::Select(inner, first, second) = &then.kind {
        if second.kind == otherwise.kind {
            return (Expr::and([condition, (**inner).clone()]), (**first).clone(), otherwise);
        }
        if first.kind == otherwise.kind {
            let inner = (**inner).clone().not();
            return (Expr::and([condition, inner]), (**second).clone(), otherwise);
        }
    }
    (condition, then, otherwise)
}

/// Whether this is the name of a parameter of a standard function, in capitals.
fn is_parameter(name: &str) -> bool {
    let number = name.strip_prefix("IN");
    number.is_some_and(|rest| rest.bytes().all(|byte| byte.is_ascii_digit()))
        || matches!(name, "EN" | "G" | "K" | "L" | "N" | "P" | "MN" | "MX")
}

impl Elaborator<'_> {
    /// Elaborates a call in an expression.
    pub(super) fn call_function(
        &mut self,
        frame: FrameId,
        name: &Name,
        arguments: &[Arg],
        span: Span,
    ) -> Outcome<Value> {
        let key = upper(&name.text);
        if let Some(index) = self.functions.get(&key).copied() {
            return self.run_function(frame, index, arguments, span);
        }
        if let Some(Binding::Object(object)) = self.lookup(frame, &name.text) {
            return Err(self.instance_in_expression(object, name, arguments, span));
        }
        let named = arguments.iter().filter_map(|one| one.name.as_ref());
        if let Some(unknown) = named.clone().find(|name| !is_parameter(&upper(&name.text))) {
            let unknown = unknown.clone();
            return Err(self.no_parameter(name, &unknown));
        }
        let mut values = self.values(frame, arguments.iter().map(|one| &one.value))?;
        // `SEL(G := c, IN0 := a, IN1 := b)` in any order.
        if arguments.iter().all(|one| one.name.is_some()) && arguments.len() > 1 {
            // Inputs in numerical order: IN2 comes before IN10.
            let rank = |argument: &Arg| {
                let text = argument.name.as_ref().map(|name| upper(&name.text)).unwrap_or_default();
                let first = ["EN", "G", "K", "MN"].iter().position(|known| *known == text);
                let (place, number) = match (first, text.strip_prefix("IN")) {
                    (Some(place), _) => (place, None),
                    (None, Some(digits)) => (4, digits.parse::<u64>().ok()),
                    (None, None) => (5, None),
                };
                (place, number, text)
            };
            let mut order: Vec<usize> = (0..arguments.len()).collect();
            order.sort_by_key(|index| rank(&arguments[*index]));
            values = order.into_iter().map(|index| values[index].clone()).collect();
        }
        let value = self.standard(&key, name, values, span)?;
        // ABS and similar functions duplicate their operand, so nested calls would grow exponentially.
        if nodes(&value.expr, MAX_NODES) >= MAX_NODES {
            return Err(self.too_much(span));
        }
        Ok(value)
    }

    /// Reports an instance that is called in an expression: it must be called by a separate statement, and an expression may read its
    /// outputs.
    fn instance_in_expression(
        &mut self,
        object: usize,
        name: &Name,
        arguments: &[Arg],
        span: Span,
    ) -> Told {
        let (ty, output) = match self.objects[object].kind {
            ObjectKind::Standard(block) => (block.name(), block.output()),
            ObjectKind::User(pou) => (self.library.pous[pou].name.text.clone(), "an output".into()),
            ObjectKind::Struct => ("a structure".into(), "a field".into()),
        };
        let finding = Diagnostic::error(
            codes::ST_CALL,
            format!("`{name}` is an instance of {ty}, which an expression cannot call"),
        )
        .at(span, "called in an expression");
        let is_timer = matches!(
            self.objects[object].kind,
            ObjectKind::Standard(block) if block.name() == "TON"
        );
        let given = |wanted: &str| {
            let one = arguments
                .iter()
                .find(|one| one.name.as_ref().is_some_and(|name| upper(&name.text) == wanted));
            one.map(|one| &one.value.kind)
        };
        let step = match given("IN") {
            Some(ast::ExprKind::Field(inner, field)) if upper(&field.text) == "X" => inner.root(),
            _ => None,
        };
        let limit = match given("PT") {
            Some(ast::ExprKind::Time(ns)) if ns % 1_000_000_000 == 0 => {
                format!("T#{}s", ns / 1_000_000_000)
            }
            Some(ast::ExprKind::Time(ns)) => format!("T#{}ms", ns / 1_000_000),
            Some(ast::ExprKind::Name(name)) => name.text.clone(),
            _ => "T#3s".to_owned(),
        };
        let help = match (self.objects[object].kind, is_timer.then_some(step).flatten()) {
            (ObjectKind::Struct, _) => format!("read a field, as in `{name}.field`"),
            (_, Some(step)) => format!(
                "call `{name}(..)` in a statement and read `{name}.{output}` here, or compare the time of the step, as in `{step}.T >= {limit}`"
            ),
            (ObjectKind::Standard(_), None) => {
                format!("call `{name}(..)` in a statement and read `{name}.{output}` here")
            }
            (ObjectKind::User(_), None) => {
                format!("call `{name}(..)` in a statement and read one of its outputs here")
            }
        };
        self.report(finding.help(help))
    }

    fn no_parameter(&mut self, function: &Name, unknown: &Name) -> Told {
        self.report(
            Diagnostic::error(
                codes::ST_CALL,
                format!("{function} has no parameter {}", unknown.text),
            )
            .at(unknown.span, "")
            .help("standard functions have the parameters IN, IN0, IN1 and so on, G, K, N, MN and MX; your own functions have those of their VAR_INPUT"),
        )
    }

    fn standard(
        &mut self,
        key: &str,
        name: &Name,
        values: Vec<Value>,
        span: Span,
    ) -> Outcome<Value> {
        let n = values.len();
        let chain = match key {
            "ADD" => Some(Op::Add),
            "MUL" => Some(Op::Mul),
            "XOR" => Some(Op::Xor),
            _ => None,
        };
        if let (Some(op), true) = (chain, n >= 2) {
            return self.fold(values, span, |this, a, b| this.binary(op, a, b, span));
        }
        let pair = match key {
            "SUB" => Some(Op::Sub),
            "DIV" => Some(Op::Div),
            "MOD" => Some(Op::Mod),
            "EXPT" => Some(Op::Power),
            "NE" => Some(Op::Ne),
            _ => None,
        };
        let mut values = values.into_iter();
        let mut next = || values.next();
        if let (Some(op), 2) = (pair, n)
            && let (Some(a), Some(b)) = (next(), next())
        {
            return self.binary(op, a, b, span);
        }
        let comparison = match key {
            "GT" => Some(Op::Gt),
            "GE" => Some(Op::Ge),
            "EQ" => Some(Op::Eq),
            "LE" => Some(Op::Le),
            "LT" => Some(Op::Lt),
            _ => None,
        };
        if let (Some(op), true) = (comparison, n >= 2) {
            // GT(a, b, c) is a > b and b > c.
            let all: Vec<Value> = values.collect();
            let mut parts = Vec::new();
            for two in all.windows(2) {
                parts.push(self.binary(op, two[0].clone(), two[1].clone(), span)?);
            }
            return self.join(parts, true, span);
        }
        match (key, n) {
            ("AND" | "OR", 2..) => {
                let all = values.collect();
                return self.join(all, key == "AND", span);
            }
            ("MOVE", 1) => {
                if let Some(value) = next() {
                    return Ok(value);
                }
            }
            ("NOT", 1) => {
                if let Some(value) = next() {
                    return self.not_of(value, span);
                }
            }
            ("ABS", 1) => {
                if let Some(value) = next() {
                    let zero = Value::int(0, span);
                    let negative = self.binary(Op::Sub, zero.clone(), value.clone(), span)?;
                    let below = self.binary(Op::Lt, value.clone(), zero, span)?;
                    let chosen = select(below.expr, negative, value, span);
                    return Ok(match chosen.kind {
                        Kind::Int(lo, hi) => {
                            Value { kind: Kind::Int(lo.max(0), hi.max(0)), ..chosen }
                        }
                        Kind::Bool | Kind::Time(_) => chosen,
                    });
                }
            }
            ("MIN" | "MAX", 2..) => {
                let op = if key == "MIN" { Op::Le } else { Op::Ge };
                let all = values.collect();
                return self.fold(all, span, |this, a, b| this.extreme(op, a, b, span));
            }
            ("LIMIT", 3) => {
                if let (Some(low), Some(value), Some(high)) = (next(), next(), next()) {
                    let above = self.extreme(Op::Ge, low, value, span)?;
                    return self.extreme(Op::Le, above, high, span);
                }
            }
            ("SEL", 3) => {
                if let (Some(which), Some(first), Some(second)) = (next(), next(), next()) {
                    let which = self.fit(which, &Ty::Bool, "G of SEL")?;
                    if std::mem::discriminant(&first.kind) != std::mem::discriminant(&second.kind) {
                        return Err(
                            self.type_error("the two values of SEL have different types", span)
                        );
                    }
                    return self.choice(which.expr, second, first, span);
                }
            }
            ("MUX", 2..) => {
                if let Some(which) = next() {
                    let all: Vec<Value> = values.collect();
                    let mut chosen: Option<Value> = None;
                    for (index, value) in all.into_iter().enumerate().rev() {
                        chosen = Some(match chosen {
                            None => value,
                            Some(rest) => {
                                let index = Value::int(i64::try_from(index).unwrap_or(0), span);
                                let is_this = self.binary(Op::Eq, which.clone(), index, span)?;
                                self.choice(is_this.expr, value, rest, span)?
                            }
                        });
                    }
                    return chosen.ok_or(Told);
                }
            }
            ("SHL" | "SHR" | "ROL" | "ROR", 2) => {
                if let (Some(value), Some(by)) = (next(), next()) {
                    return self.shifted(key, value, by, span);
                }
            }
            (_, 1) => {
                if let Some(value) = next()
                    && let Some(converted) = self.convert(key, value, span)
                {
                    return converted;
                }
            }
            _ => {}
        }
        Err(self.no_function(key, name, n))
    }

    fn no_function(&mut self, key: &str, name: &Name, n: usize) -> Told {
        const KNOWN: [&str; 28] = [
            "ADD",
            "SUB",
            "MUL",
            "DIV",
            "MOD",
            "MOVE",
            "AND",
            "OR",
            "XOR",
            "NOT",
            "GT",
            "GE",
            "EQ",
            "LE",
            "LT",
            "NE",
            "ABS",
            "MIN",
            "MAX",
            "LIMIT",
            "SEL",
            "MUX",
            "SHL",
            "SHR",
            "ROL",
            "ROR",
            "BOOL_TO_INT",
            "INT_TO_BCD",
        ];
        const REFUSED: [&str; 23] = [
            "SQRT", "LN", "LOG", "EXP", "SIN", "COS", "TAN", "ASIN", "ACOS", "ATAN", "LEN", "LEFT",
            "RIGHT", "MID", "CONCAT", "INSERT", "DELETE", "REPLACE", "FIND", "TRUNC", "ADR",
            "SIZEOF", "ROUND",
        ];
        if KNOWN.contains(&key) {
            return self.report(
                Diagnostic::error(codes::ST_CALL, format!("{key} does not take {n} arguments"))
                    .at(name.span, ""),
            );
        }
        if REFUSED.contains(&key) || key.contains("_TO_") {
            return self.refused(
                &format!("the function {key}"),
                name.span,
                "write its calculation with integers and Booleans",
            );
        }
        let candidates: Vec<String> = KNOWN
            .iter()
            .map(|name| (*name).to_owned())
            .chain(self.functions.keys().cloned())
            .collect();
        self.unknown(
            "function",
            &name.text,
            name.span,
            &candidates,
            "the file declares no function of this name",
        )
    }

    fn fold(
        &mut self,
        values: Vec<Value>,
        _span: Span,
        mut op: impl FnMut(&mut Self, Value, Value) -> Outcome<Value>,
    ) -> Outcome<Value> {
        let mut values = values.into_iter();
        let mut result = values.next().ok_or(Told)?;
        for value in values {
            result = op(self, result, value)?;
        }
        Ok(result)
    }

    /// The value that comes first in the order `op`.
    fn extreme(&mut self, op: Op, a: Value, b: Value, span: Span) -> Outcome<Value> {
        let first = self.binary(op, a.clone(), b.clone(), span)?;
        let chosen = match (&a.kind, &b.kind) {
            (Kind::Int(al, ah), Kind::Int(bl, bh)) if op == Op::Le => {
                Kind::Int(*al.min(bl), *ah.min(bh))
            }
            (Kind::Int(al, ah), Kind::Int(bl, bh)) => Kind::Int(*al.max(bl), *ah.max(bh)),
            (kind, _) => kind.clone(),
        };
        let made = self.choice(first.expr, a, b, span)?;
        Ok(match chosen {
            Kind::Int(..) => Value { kind: chosen, ..made },
            Kind::Bool | Kind::Time(_) => made,
        })
    }

    /// Elaborates `INT_TO_DINT`, `TO_INT`, `BOOL_TO_INT`, `BCD_TO_INT` …
    fn convert(&mut self, key: &str, value: Value, span: Span) -> Option<Outcome<Value>> {
        let (from, to) = match key.split_once("_TO_") {
            Some((from, to)) => (from, to),
            None => ("", key.strip_prefix("TO_")?),
        };
        let is_known = |name: &str| {
            matches!(name, "" | "BOOL" | "BCD" | "TIME" | "LTIME")
                || integer(name).is_some()
                || name.ends_with("_BCD")
        };
        if !is_known(from) || !is_known(to) {
            return None;
        }
        if let Some(converted) = self.convert_time(&value, to, span) {
            return Some(match integer(to) {
                Some((lo, hi)) => {
                    converted.and_then(|value| self.fit(value, &wrapping(lo, hi), to))
                }
                None => converted,
            });
        }
        if from == "BCD" || from.ends_with("_BCD") {
            let decimal = self.bcd(value, 16, 10, span);
            return Some(match integer(to) {
                Some((lo, hi)) => decimal.and_then(|value| self.fit(value, &wrapping(lo, hi), to)),
                None => decimal,
            });
        }
        if to == "BCD" || to.starts_with("BCD_") || to.ends_with("_BCD") {
            return Some(self.bcd(value, 10, 16, span));
        }
        if to == "BOOL" {
            return Some(match value.kind {
                Kind::Bool => Ok(value),
                Kind::Int(..) => self.binary(Op::Ne, value, Value::int(0, span), span),
                Kind::Time(_) => Err(self.type_error("expected a number", span)),
            });
        }
        let (lo, hi) = integer(to)?;
        let number = match value.kind {
            Kind::Bool => select(value.expr, Value::int(1, span), Value::int(0, span), span),
            Kind::Int(..) => value,
            Kind::Time(_) => {
                return Some(Err(self.refused(
                    "times as numbers",
                    span,
                    "compare the time with a constant",
                )));
            }
        };
        Some(self.fit(number, &wrapping(lo, hi), to))
    }

    /// Reads the digits of a number in one base as digits in another base.
    fn bcd(&mut self, value: Value, from: i64, to: i64, span: Span) -> Outcome<Value> {
        let Kind::Int(lo, hi) = value.kind else {
            return Err(self.type_error("expected a number", span));
        };
        if lo < 0 && lo != hi && from == 16 {
            return Err(
                self.type_error("a BCD number must be a BYTE, WORD or unsigned integer", span)
            );
        }
        let (mut scale, mut weight) = (1_i64, 1_i64);
        let mut sum: Option<Value> = None;
        let mut most = 0_i64;
        while scale <= hi.min(super::types::WIDEST.1) && weight <= super::types::WIDEST.1 / to {
            let digit = {
                let shifted = self.binary(Op::Div, value.clone(), Value::int(scale, span), span)?;
                self.binary(Op::Mod, shifted, Value::int(from, span), span)?
            };
            let part = self.binary(Op::Mul, digit, Value::int(weight, span), span)?;
            most = most.saturating_add((from - 1).saturating_mul(weight));
            sum = Some(match sum {
                None => part,
                Some(sum) => self.binary(Op::Add, part, sum, span)?,
            });
            scale = scale.saturating_mul(from);
            weight = weight.saturating_mul(to);
        }
        Ok(sum.unwrap_or_else(|| Value::int(0, span)))
    }

    // User-defined functions

    /// The value of a function call. Runs the body on expressions: both branches of an IF are run, and a choice combines the results.
    fn run_function(
        &mut self,
        frame: FrameId,
        index: usize,
        arguments: &[Arg],
        span: Span,
    ) -> Outcome<Value> {
        if self.calls.contains(&index) || self.calls.len() >= MAX_CALLS {
            let name = self.library.pous[index].name.clone();
            return Err(self.report(
                Diagnostic::error(codes::ST_CALL, format!("{name} calls itself"))
                    .at(span, "in this call"),
            ));
        }
        let library = self.library;
        let pou = &library.pous[index];
        let PouKind::Function(Some(result)) = &pou.kind else {
            return Err(self.report(
                Diagnostic::error(codes::ST_CALL, format!("{} returns no value", pou.name))
                    .at(span, "expected a value"),
            ));
        };
        for refusal in &pou.refused {
            self.refused(&refusal.what, refusal.span, &refusal.help);
        }
        let is_input = |name: &Name| {
            let mut inputs = pou.vars.iter().filter(|var| var.section == Section::Input);
            inputs.any(|var| upper(&var.name.text) == upper(&name.text))
        };
        let mut named = arguments.iter().filter_map(|one| one.name.as_ref());
        if let Some(unknown) = named.find(|name| !is_input(name)) {
            return Err(self.no_parameter(&pou.name, unknown));
        }
        let inside = self.new_frame(Some(self.globals));
        let result_type = self.ty(inside, result);
        let mut types: BTreeMap<String, Ty> = BTreeMap::new();
        types.insert(upper(&pou.name.text), result_type.clone());
        let start = self.zero_value(&result_type, span)?;
        self.frames[inside].names.insert(upper(&pou.name.text), Binding::Value(start));
        let mut position = 0;
        for var in &pou.vars {
            let ty = self.ty(inside, &var.ty);
            let key = upper(&var.name.text);
            let mut value = match &var.init {
                Some(init) if ty == Ty::Time => match init {
                    ast::Init::Value(init) => self.value(inside, init)?,
                    ast::Init::List(_, span) | ast::Init::Fields(_, span) => {
                        return Err(self.type_error("expected a time", *span));
                    }
                },
                Some(init) => {
                    let expr = self.initial(inside, &ty, init)?.pop().ok_or(Told)?;
                    Value::literal(expr)
                }
                None => self.zero_value(&ty, var.name.span)?,
            };
            if matches!(var.section, Section::InOut | Section::Output) {
                return Err(self.refused(
                    "functions that change their arguments",
                    var.name.span,
                    "make it a function block",
                ));
            }
            if var.section == Section::Input {
                let given = arguments
                    .iter()
                    .find(|one| one.name.as_ref().is_some_and(|name| upper(&name.text) == key))
                    .or_else(|| arguments.get(position).filter(|one| one.name.is_none()));
                position += 1;
                if let Some(argument) = given {
                    let argument = self.value(frame, &argument.value)?;
                    value = self.fit(argument, &ty, &var.name.text)?;
                }
            }
            types.insert(key.clone(), ty);
            self.frames[inside].names.insert(key, Binding::Value(value));
        }
        if arguments.len() > position {
            return Err(self.report(
                Diagnostic::error(
                    codes::ST_CALL,
                    format!("{} takes {position} arguments, found {}", pou.name, arguments.len()),
                )
                .at(span, ""),
            ));
        }
        let Body::Statements(body) = &pou.body else {
            return Err(self.refused(
                "a function with a chart",
                pou.name.span,
                "make it a function block",
            ));
        };
        self.calls.push(index);
        for key in [LEFT, SKIPPED, RETURNED] {
            types.insert(key.to_owned(), Ty::Bool);
            let value = Value::constant(false, span);
            self.frames[inside].names.insert(key.to_owned(), Binding::Value(value));
        }
        let (lo, hi) = super::types::WIDEST;
        types.insert(VARIABLE.to_owned(), Ty::Int { lo, hi, wraps: false });
        let start = Binding::Value(Value::int(0, span));
        self.frames[inside].names.insert(VARIABLE.to_owned(), start);
        let list = self.without_returns(body, pou.name.span);
        let done = list.and_then(|(list, _)| self.run(inside, &types, &list));
        self.calls.pop();
        done?;
        match self.frames[inside].names.get(&upper(&pou.name.text)) {
            Some(Binding::Value(value)) => Ok(value.clone()),
            _ => Err(Told),
        }
    }

    fn zero_value(&mut self, ty: &Ty, span: Span) -> Outcome<Value> {
        match ty {
            Ty::Bool => Ok(Value::constant(false, span)),
            Ty::Int { lo, hi, .. } => Ok(Value::int(0.clamp(*lo, *hi), span)),
            Ty::Time => Ok(Value::time(0, span)),
            Ty::Broken => Err(Told),
            Ty::Array(..) | Ty::Block(_) | Ty::User(_) | Ty::Struct(_) => Err(self.refused(
                "arrays, structures and blocks in functions",
                span,
                "use simple variables, or make it a function block",
            )),
        }
    }

    fn run(
        &mut self,
        frame: FrameId,
        types: &BTreeMap<String, Ty>,
        list: &[ast::Stmt],
    ) -> Outcome<()> {
        for stmt in list {
            self.run_one(frame, types, stmt)?;
        }
        Ok(())
    }

    fn run_one(
        &mut self,
        frame: FrameId,
        types: &BTreeMap<String, Ty>,
        stmt: &ast::Stmt,
    ) -> Outcome<()> {
        self.spend(stmt.span, 1)?;
        match &stmt.kind {
            StmtKind::Assign { target, value } => {
                let value = self.value(frame, value)?;
                let ast::ExprKind::Name(name) = &target.kind else {
                    return Err(self.refused(
                        "assignments to parts of variables in functions",
                        target.span,
                        "use simple variables",
                    ));
                };
                let key = upper(&name.text);
                let Some(ty) = types.get(&key) else {
                    return Err(self.report(
                        Diagnostic::error(
                            codes::ST_CALL,
                            format!("a function cannot change {name}, which it does not declare"),
                        )
                        .at(target.span, "")
                        .help("make it a function block"),
                    ));
                };
                let value = self.fit(value, ty, &name.text)?;
                if nodes(&value.expr, MAX_NODES) >= MAX_NODES {
                    return Err(self.too_much(stmt.span));
                }
                self.frames[frame].names.insert(key, Binding::Value(value));
                Ok(())
            }
            StmtKind::If { arms, otherwise } => {
                self.run_arms(frame, types, arms, otherwise, stmt.span)
            }
            StmtKind::Case { selector, arms, otherwise } => {
                let selector = self.value(frame, selector)?;
                let (mut tested, mut taken) = (Vec::new(), Vec::new());
                for (labels, list) in arms {
                    let condition = self.label_test(frame, &selector, labels, &mut taken)?;
                    tested.push((condition, list.as_slice()));
                }
                self.run_tested(frame, types, &tested, otherwise, stmt.span)
            }
            StmtKind::For { var, from, to, by, body } => {
                let key = upper(&var.text);
                if !types.contains_key(&key) {
                    let candidates: Vec<String> = types.keys().cloned().collect();
                    return Err(self.unknown(
                        "variable",
                        &var.text,
                        var.span,
                        &candidates,
                        "declare it in the function",
                    ));
                }
                let values = self.loop_values(frame, from, to, by.as_ref(), stmt.span)?;
                self.count_rounds(frame, &values, body, stmt.span)?;
                self.run_loop(frame, types, (var, &key), &values, body, stmt.span)
            }
            StmtKind::While { .. } | StmtKind::Repeat { .. } => Err(self.unbounded(stmt.span)),
            StmtKind::Call { target, .. } => Err(self.refused(
                "calls of blocks in functions",
                target.span,
                "make it a function block",
            )),
            StmtKind::Exit | StmtKind::Continue | StmtKind::Return => Err(self.leaves(stmt.span)),
            StmtKind::Refused(_) => Err(Told),
        }
    }

    /// Runs the iterations of a loop. If EXIT leaves the loop, its variable keeps its current value.
    fn run_loop(
        &mut self,
        frame: FrameId,
        types: &BTreeMap<String, Ty>,
        (var, key): (&Name, &str),
        rounds: &super::statements::Rounds,
        body: &[ast::Stmt],
        span: Span,
    ) -> Outcome<()> {
        let body = leave::round(body, var);
        let no = || Binding::Value(Value::constant(false, span));
        let outer = [LEFT, SKIPPED, VARIABLE]
            .map(|name| (name, self.frames[frame].names.insert(name.to_owned(), no())));
        self.frames[frame].names.insert(VARIABLE.to_owned(), Binding::Value(Value::int(0, span)));
        for value in &rounds.each {
            self.spend(span, 1)?;
            let value = Value::int(*value, var.span);
            self.frames[frame].names.insert(key.to_owned(), Binding::Value(value));
            self.frames[frame].names.insert(SKIPPED.to_owned(), no());
            self.run(frame, types, &body)?;
        }
        let mut last = Value::int(rounds.after, var.span);
        if let (Some(Binding::Value(left)), Some(Binding::Value(kept))) =
            (self.frames[frame].names.get(LEFT), self.frames[frame].names.get(VARIABLE))
        {
            last = select(left.expr.clone(), kept.clone(), last, span);
        }
        for (name, binding) in outer {
            if let Some(binding) = binding {
                self.frames[frame].names.insert(name.to_owned(), binding);
            }
        }
        self.frames[frame].names.insert(key.to_owned(), Binding::Value(last));
        Ok(())
    }

    fn run_arms(
        &mut self,
        frame: FrameId,
        types: &BTreeMap<String, Ty>,
        arms: &[(ast::Expr, Vec<ast::Stmt>)],
        otherwise: &[ast::Stmt],
        span: Span,
    ) -> Outcome<()> {
        if let [(condition, list)] = arms
            && let Some(flags) = leave::guards(condition)
        {
            return self.run_guarded(frame, types, &flags, list, span);
        }
        let mut tested = Vec::new();
        for (condition, list) in arms {
            tested.push((self.condition(frame, condition)?, list.as_slice()));
        }
        self.run_tested(frame, types, &tested, otherwise, span)
    }

    /// Runs a list under the condition that no flag is set. Inside the list the flags are false; afterwards each flag is its previous value
    /// or its new one. So the expressions of flags grow linearly with the number of places that set them, not exponentially.
    fn run_guarded(
        &mut self,
        frame: FrameId,
        types: &BTreeMap<String, Ty>,
        flags: &[String],
        list: &[ast::Stmt],
        span: Span,
    ) -> Outcome<()> {
        let before: Frame = self.frames[frame].clone();
        let value_of = |frame: &Frame, key: &str| match frame.names.get(key) {
            Some(Binding::Value(value)) => value.expr.clone(),
            _ => Expr::bool(false),
        };
        let free = |key: &String| value_of(&before, key).not();
        let condition = Expr::and(flags.iter().map(free));
        if condition.is_false() {
            return Ok(());
        }
        for key in flags {
            let no = Binding::Value(Value::constant(false, span));
            self.frames[frame].names.insert(key.clone(), no);
        }
        self.run(frame, types, list)?;
        let after = std::mem::replace(&mut self.frames[frame], before.clone());
        for key in types.keys() {
            let (Some(Binding::Value(then)), Some(Binding::Value(other))) =
                (after.names.get(key), before.names.get(key))
            else {
                continue;
            };
            let chosen = if flags.contains(key) {
                let others = flags.iter().filter(|one| *one != key).map(free);
                let raised = Expr::and(others.chain([then.expr.clone()]));
                Value::bool(Expr::or([other.expr.clone(), raised]))
            } else {
                self.choice(condition.clone(), then.clone(), other.clone(), span)?
            };
            if nodes(&chosen.expr, MAX_NODES) >= MAX_NODES {
                return Err(self.too_much(span));
            }
            self.frames[frame].names.insert(key.clone(), Binding::Value(chosen));
        }
        Ok(())
    }

    /// Runs each list on a copy of the variables, and chooses between the results.
    fn run_tested(
        &mut self,
        frame: FrameId,
        types: &BTreeMap<String, Ty>,
        arms: &[(Expr, &[ast::Stmt])],
        otherwise: &[ast::Stmt],
        span: Span,
    ) -> Outcome<()> {
        let before: Frame = self.frames[frame].clone();
        let mut results = Vec::new();
        for (condition, list) in arms {
            self.frames[frame] = before.clone();
            self.run(frame, types, list)?;
            results.push((condition.clone(), self.frames[frame].clone()));
        }
        self.frames[frame] = before;
        self.run(frame, types, otherwise)?;
        for (condition, result) in results.into_iter().rev() {
            for key in types.keys() {
                let (Some(Binding::Value(then)), Some(Binding::Value(other))) =
                    (result.names.get(key), self.frames[frame].names.get(key))
                else {
                    continue;
                };
                let (then, other) = (then.clone(), other.clone());
                let chosen = self.choice(condition.clone(), then, other, span)?;
                if nodes(&chosen.expr, MAX_NODES) >= MAX_NODES {
                    return Err(self.too_much(span));
                }
                self.frames[frame].names.insert(key.clone(), Binding::Value(chosen));
            }
        }
        Ok(())
    }
}

fn wrapping(lo: i64, hi: i64) -> Ty {
    let fits = lo >= super::types::WIDEST.0 && hi <= super::types::WIDEST.1;
    Ty::Int { lo, hi, wraps: fits }
}
