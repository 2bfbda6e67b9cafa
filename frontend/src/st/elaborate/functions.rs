//! Functions: standard functions become operators; user-defined functions are evaluated by running their bodies on expressions.

use grafsynth_ir::Span;
use grafsynth_ir::diag::{Diagnostic, ErrorReported, counted};

use super::context::{Elaborator, FrameId, MAX_NODES, ObjectKind, Outcome};
use super::types::{Ty, integer, wrapping};
use super::value::{Kind, Value, nodes, select};
use crate::codes;
use crate::st::ast::{self, Arg, Op};
use crate::st::symbol::{Ident, Symbol};

/// Whether this name, in capitals, is a parameter of a standard function.
fn is_parameter(name: &str) -> bool {
    let number = name.strip_prefix("IN");
    number.is_some_and(|rest| rest.bytes().all(|byte| byte.is_ascii_digit()))
        || matches!(name, "EN" | "G" | "K" | "L" | "N" | "P" | "MN" | "MX")
}

/// The parameters of the standard functions, for messages.
const STANDARD_PARAMETERS: &str = "IN, or IN1 and IN2; G, IN0 and IN1 of SEL; K and IN0 of MUX; MN, IN and MX of LIMIT; IN and N of shifts";

/// Whether a standard function, in capitals, has only numbered inputs.
fn is_like_and(name: &str) -> bool {
    matches!(
        name,
        "AND"
            | "OR"
            | "XOR"
            | "ADD"
            | "SUB"
            | "MUL"
            | "DIV"
            | "MOD"
            | "MIN"
            | "MAX"
            | "GT"
            | "GE"
            | "EQ"
            | "LE"
            | "LT"
            | "NE"
    )
}

impl Elaborator<'_> {
    /// Elaborates a call in an expression.
    pub(super) fn call_function(
        &mut self,
        frame: FrameId,
        name: &Ident,
        arguments: &[Arg],
        span: Span,
    ) -> Outcome<Value> {
        let key = &name.id;
        if let Some(index) = self.functions.get(key).copied() {
            return self.run_function(frame, index, arguments, span);
        }
        if let Some(object) = self.object(frame, &name.id) {
            return Err(self.instance_in_expression(object, name, arguments, span));
        }
        let named = arguments.iter().filter_map(|one| one.name.as_ref());
        if let Some(unknown) = named.clone().find(|name| !is_parameter(&name.id)) {
            let unknown = unknown.clone();
            let known = if is_like_and(key) {
                "IN1, IN2 and so on".to_owned()
            } else {
                STANDARD_PARAMETERS.to_owned()
            };
            return Err(self.no_parameter(name, &unknown, &known));
        }
        let mut values = self.values(frame, arguments.iter().map(|one| &one.value))?;
        // `SEL(G := c, IN0 := a, IN1 := b)` in any order.
        if arguments.iter().all(|one| one.name.is_some()) && arguments.len() > 1 {
            // Inputs in numerical order: IN2 comes before IN10.
            let rank = |index: &usize| {
                let text = arguments[*index].name.as_ref().map_or("", |name| name.id.as_str());
                let first = ["EN", "G", "K", "MN"].iter().position(|known| *known == text);
                let (place, number) = match (first, text.strip_prefix("IN")) {
                    (Some(place), _) => (place, None),
                    (None, Some(digits)) => (4, digits.parse::<u64>().ok()),
                    (None, None) => (5, None),
                };
                (place, number, text)
            };
            let mut order: Vec<usize> = (0..arguments.len()).collect();
            order.sort_by_key(rank);
            values = order.into_iter().map(|index| values[index].clone()).collect();
        }
        let value = self.standard(key, name, values, span)?;
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
        name: &Ident,
        arguments: &[Arg],
        span: Span,
    ) -> ErrorReported {
        let ObjectKind::Block(index) = self.objects[object].kind else {
            return self.report(
                Diagnostic::error(
                    codes::ST_CALL,
                    format!("`{name}` is a structure, which an expression cannot call"),
                )
                .at(span, "called in an expression")
                .help(format!("read a field, as in `{name}.field`")),
            );
        };
        let pou = self.unit(index);
        let mut outputs = pou.vars.iter().filter(|var| var.section == ast::Section::Output);
        let output = outputs.next().map_or("output", |var| var.name.text.as_str());
        let ty = &pou.name;
        let finding = Diagnostic::error(
            codes::ST_CALL,
            format!("`{name}` is an instance of {ty}, which an expression cannot call"),
        )
        .at(span, "called in an expression");
        let given = |wanted: &str| {
            arguments.iter().find(|one| one.is_for(wanted)).map(|one| &one.value.kind)
        };
        let step = match given("IN") {
            Some(ast::ExprKind::Field(inner, field)) if field.id == "X" => inner.root(),
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
        let is_delay = self.is_standard(index) && matches!(ty.id.as_str(), "TON" | "TON_TIME");
        let call = format!("call `{name}(..)` in a statement and read `{name}.{output}` here");
        let help = match step.filter(|_| is_delay) {
            Some(step) => {
                format!("{call}, or compare the time of the step, as in `{step}.T >= {limit}`")
            }
            None => call,
        };
        self.report(finding.help(help))
    }

    /// Reports an unknown parameter of a function; `known` lists its parameters.
    pub(super) fn no_parameter(
        &mut self,
        function: &Ident,
        unknown: &Ident,
        known: &str,
    ) -> ErrorReported {
        self.report(
            Diagnostic::error(
                codes::ST_CALL,
                format!("`{function}` has no parameter `{}`", unknown.text),
            )
            .at(unknown.span, "unknown parameter")
            .help(if known.is_empty() {
                format!("write no arguments: `{function}` has no VAR_INPUT")
            } else {
                format!("write one of its inputs: {known}")
            }),
        )
    }

    fn standard(
        &mut self,
        key: &str,
        name: &Ident,
        values: Vec<Value>,
        span: Span,
    ) -> Outcome<Value> {
        let n = values.len();
        let values = match self.operator(key, values, span) {
            Ok(done) => return done,
            Err(values) => values,
        };
        let mut values = values.into_iter();
        let mut next = || values.next();
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
                    return self.absolute(value, span);
                }
            }
            ("MIN" | "MAX", 2..) => {
                let op = if key == "MIN" { Op::Le } else { Op::Ge };
                let all = values.collect();
                return self.fold(all, |this, a, b| this.extreme(op, a, b, span));
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
                    return self.multiplexed(&which, values.collect(), span);
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

    /// Elaborates a function that is an operator; returns the values unchanged if it is not one.
    fn operator(
        &mut self,
        key: &str,
        values: Vec<Value>,
        span: Span,
    ) -> Result<Outcome<Value>, Vec<Value>> {
        let n = values.len();
        let Some(op) = Op::named(key) else { return Err(values) };
        let is_chain = matches!(op, Op::Add | Op::Mul | Op::Xor);
        let is_ordered = matches!(op, Op::Gt | Op::Ge | Op::Eq | Op::Le | Op::Lt);
        if n < 2 || n > 2 && !is_chain && !is_ordered {
            return Err(values);
        }
        if is_ordered {
            // GT(a, b, c) is a > b and b > c.
            let pairs = values.windows(2);
            let parts = pairs.map(|two| self.binary(op, two[0].clone(), two[1].clone(), span));
            let parts = parts.collect::<Outcome<Vec<_>>>();
            return Ok(parts.and_then(|parts| self.join(parts, true, span)));
        }
        Ok(self.fold(values, |this, a, b| this.binary(op, a, b, span)))
    }

    fn absolute(&mut self, value: Value, span: Span) -> Outcome<Value> {
        let zero = Value::int(0, span);
        let negative = self.binary(Op::Sub, zero.clone(), value.clone(), span)?;
        let below = self.binary(Op::Lt, value.clone(), zero, span)?;
        let chosen = select(below.expr, negative, value, span);
        Ok(match chosen.kind {
            Kind::Int(lo, hi) => Value { kind: Kind::Int(lo.max(0), hi.max(0)), ..chosen },
            Kind::Bool | Kind::Time(_) => chosen,
        })
    }

    fn multiplexed(&mut self, which: &Value, all: Vec<Value>, span: Span) -> Outcome<Value> {
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
        chosen.ok_or(ErrorReported)
    }

    fn no_function(&mut self, key: &str, name: &Ident, n: usize) -> ErrorReported {
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
                Diagnostic::error(
                    codes::ST_CALL,
                    format!("`{key}` does not take {}", counted(n, "argument", "arguments")),
                )
                .at(name.span, "")
                .help(if n < 2 {
                    "add the missing arguments"
                } else {
                    "write one argument for each input of the function"
                }),
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
            .chain(self.functions.keys().map(Symbol::to_string))
            .collect();
        let help = "the file declares no function of this name";
        self.unknown("function", name, &candidates, help)
    }

    fn fold(
        &mut self,
        values: Vec<Value>,
        mut op: impl FnMut(&mut Self, Value, Value) -> Outcome<Value>,
    ) -> Outcome<Value> {
        let mut values = values.into_iter();
        let mut result = values.next().ok_or(ErrorReported)?;
        for value in values {
            result = op(self, result, value)?;
        }
        Ok(result)
    }

    /// The smaller or larger of two values: the one that comes first in the order `op`.
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
}
