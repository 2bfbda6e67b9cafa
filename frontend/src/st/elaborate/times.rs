//! TIME variables that change, as numbers of milliseconds.
//!
//! Charts compare the time of a step or timer only with constants. A variable that is assigned only constants has few values, so one
//! comparison is made for each of them:
//!
//! ```text
//! IF slow THEN wait := T#5s; ELSE wait := T#2s; END_IF;
//! fill.T >= wait             wait = 5000 AND fill.T >= 5 s  OR  wait = 2000 AND fill.T >= 2 s
//! ```
//! Timers with a variable preset work in the same way. A variable with computed values can be compared with other TIME values, but not with
//! a running time.

use grafsynth_ir::Gather;
use grafsynth_ir::diag::ErrorReported;
use std::collections::BTreeSet;

use grafsynth_ir::chart::{Declaration, DeclarationKind, Expr, Item};
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::expr::{ArithOp, CompareOp, ExprKind, Type};
use grafsynth_ir::net::Meta;
use grafsynth_ir::{Name, Span};

use super::context::{Binding, Elaborator, FrameId, Outcome, Place};
use super::types::{Ty, WIDEST};
use super::usage::Usage;
use super::value::{Kind, Time, Value, Values, select};
use crate::codes;
use crate::st::ast::{self, Op, Section, Var};

/// The unit of TIME variables, in nanoseconds.
const UNIT: i64 = 1_000_000;
/// Maximum number of values of a variable that is compared with a running time.
const MAX_VALUES: usize = 32;

fn joined(a: &Values, b: &Values, op: impl Fn(i64, i64) -> i64) -> Values {
    let (Some(a), Some(b)) = (a, b) else { return None };
    if a.len().saturating_mul(b.len()) > MAX_VALUES * MAX_VALUES {
        return None;
    }
    let all: BTreeSet<i64> = a.iter().flat_map(|x| b.iter().map(|y| op(*x, *y))).gather();
    (all.len() <= MAX_VALUES).then_some(all)
}

impl Elaborator<'_> {
    /// A time as a number of milliseconds, with its possible values.
    pub(super) fn milliseconds(&mut self, value: Value) -> Outcome<(Expr, Values)> {
        let span = value.expr.span;
        match value.kind {
            Kind::Time(Time::Constant(ns)) => {
                let (number, rest) = (ns / UNIT, ns % UNIT);
                if rest != 0 || !(WIDEST.0..=WIDEST.1).contains(&number) {
                    return Err(self.report(
                        Diagnostic::error(
                            codes::ST_TIMER,
                            "the value of a TIME variable must be a whole number of milliseconds, at most 24 days",
                        )
                        .at(span, "not in whole milliseconds, or too long")
                        .help("use a time in whole milliseconds, or a constant"),
                    ));
                }
                Ok((Expr::new(ExprKind::Int(number), span), Some([ns].into_iter().gather())))
            }
            Kind::Time(Time::Varying(values)) => Ok((value.expr, values)),
            Kind::Time(Time::Running | Time::Elapsed { .. }) => Err(self.report(
                Diagnostic::error(codes::ST_TIMER, "the time of a step or timer can only be compared, not stored or computed with")
                    .at(span, "a running time")
                    .help("charts compare running times: write the comparison itself, as in `fill.T >= T#3s`"),
            )),
            Kind::Bool | Kind::Int(..) => Err(self.type_error("expected a time", span)),
        }
    }

    /// A choice between two values. Two times become numbers of milliseconds unless they are the same constant.
    pub(super) fn choice(
        &mut self,
        condition: Expr,
        then: Value,
        otherwise: Value,
        span: Span,
    ) -> Outcome<Value> {
        let is_time = matches!((&then.kind, &otherwise.kind), (Kind::Time(_), Kind::Time(_)));
        if !is_time
            || then.kind == otherwise.kind && then.expr.kind == otherwise.expr.kind
            || condition.is_true()
            || condition.is_false()
        {
            return Ok(select(condition, then, otherwise, span));
        }
        let ((a, mut values), (b, others)) =
            (self.milliseconds(then)?, self.milliseconds(otherwise)?);
        match (&mut values, others) {
            (Some(values), Some(others)) => values.extend(others),
            (values, _) => *values = None,
        }
        let kind = ExprKind::Select(Box::new(condition), Box::new(a), Box::new(b));
        Ok(Value { expr: Expr::new(kind, span), kind: Kind::Time(Time::Varying(values)) })
    }

    /// `a + b` or `a - b` of times, if at least one of them changes.
    pub(super) fn add_times(&mut self, op: Op, a: Value, b: Value, span: Span) -> Outcome<Value> {
        let (arith, apply): (_, fn(i64, i64) -> i64) = match op {
            Op::Add => (ArithOp::Add, i64::saturating_add),
            Op::Sub => (ArithOp::Sub, i64::saturating_sub),
            _ => {
                return Err(self.type_error("times can only be added and subtracted", span));
            }
        };
        let ((a, first), (b, second)) = (self.milliseconds(a)?, self.milliseconds(b)?);
        let values = joined(&first, &second, apply);
        let expr = Expr::new(ExprKind::Arith(arith, Box::new(a), Box::new(b)), span);
        Ok(Value { expr, kind: Kind::Time(Time::Varying(values)) })
    }

    /// Scales a time, if the time or the factor changes: `wait * 2`, `T#1s * n`, `wait / 3`.
    pub(super) fn scale_time(
        &mut self,
        op: Op,
        time: Value,
        number: Value,
        span: Span,
    ) -> Outcome<Value> {
        let arith = match op {
            Op::Mul => ArithOp::Mul,
            Op::Div => ArithOp::Div,
            _ => {
                let message = "a time can only be multiplied or divided by a number";
                return Err(self.type_error(message, span));
            }
        };
        let (time, values) = self.milliseconds(time)?;
        let values = match number.kind {
            Kind::Int(n, m) if n == m => values.and_then(|all| {
                // The scaled number of milliseconds.
                let scaled =
                    all.iter().map(|ns| Some(arith.apply(ns / UNIT, n)?.saturating_mul(UNIT)));
                scaled.collect::<Option<BTreeSet<i64>>>()
            }),
            Kind::Int(..) | Kind::Bool | Kind::Time(_) => None,
        };
        let expr = ExprKind::Arith(arith, Box::new(time), Box::new(number.expr));
        Ok(Value { expr: Expr::new(expr, span), kind: Kind::Time(Time::Varying(values)) })
    }

    /// A comparison in which at least one side is a time that changes and neither is a running time.
    pub(super) fn compare_varying(
        &mut self,
        op: CompareOp,
        a: Value,
        b: Value,
        span: Span,
    ) -> Outcome<Value> {
        let ((a, _), (b, _)) = (self.milliseconds(a)?, self.milliseconds(b)?);
        Ok(Value::bool(Expr::new(Expr::compare(op, a, b).kind, span)))
    }

    /// Compares a running time with a time that changes: one comparison for each value.
    pub(super) fn compare_clock(
        &mut self,
        op: CompareOp,
        clock: &Value,
        limit: &Value,
        span: Span,
    ) -> Outcome<Value> {
        let mut tests = Vec::new();
        for (ns, is_this) in self.each_value(limit, span)? {
            let bound = Value::time(ns, limit.expr.span);
            let holds = self.compare_times(op, clock.clone(), bound, span)?;
            tests.push(Expr::and([is_this, holds.expr]));
        }
        Ok(Value::bool(Expr::new(Expr::or(tests).kind, span)))
    }

    /// The possible values of a time that changes, each with the condition that the time has this value.
    pub(super) fn each_value(&mut self, time: &Value, span: Span) -> Outcome<Vec<(i64, Expr)>> {
        let values = match &time.kind {
            Kind::Time(Time::Varying(Some(values))) if values.len() <= MAX_VALUES => values.clone(),
            Kind::Time(_) | Kind::Bool | Kind::Int(..) => {
                return Err(self.report(
                    Diagnostic::error(codes::ST_TIMER, "the time of a step or timer cannot be compared with a computed time")
                        .at(span, "here")
                        .help(format!("charts compare running times only with constants: \
                         assign only constants to the variable (at most {MAX_VALUES}), and declare them first")),
                ));
            }
        };
        self.spend(span, values.len())?;
        let mut all = Vec::new();
        for ns in values {
            let number = Expr::new(ExprKind::Int(ns / UNIT), span);
            all.push((ns, Expr::compare(CompareOp::Eq, time.expr.clone(), number)));
        }
        Ok(all)
    }

    /// `TIME_TO_DINT` and `DINT_TO_TIME`, in milliseconds. `None` for other conversions.
    pub(super) fn convert_time(
        &mut self,
        value: &Value,
        to: &str,
        span: Span,
    ) -> Option<Outcome<Value>> {
        match (&value.kind, to) {
            (Kind::Time(_), "TIME" | "LTIME") => Some(Ok(value.clone())),
            (Kind::Int(n, m), "TIME" | "LTIME") if n == m => {
                Some(Ok(Value::time(n.saturating_mul(UNIT), span)))
            }
            (Kind::Int(..), "TIME" | "LTIME") => {
                let kind = Kind::Time(Time::Varying(None));
                Some(Ok(Value { expr: value.expr.clone(), kind }))
            }
            (Kind::Time(_), _) => {
                super::types::integer(to)?;
                Some(self.milliseconds(value.clone()).map(|(expr, values)| {
                    let ends = values.and_then(|all| Some((*all.first()?, *all.last()?)));
                    let (lo, hi) = ends.map_or(WIDEST, |(lo, hi)| (lo / UNIT, hi / UNIT));
                    Value { expr, kind: Kind::Int(lo, hi) }
                }))
            }
            (Kind::Int(..) | Kind::Bool, _) => None,
        }
    }

    // Declarations

    /// Declares a TIME variable: as a name for its value if it never changes, otherwise as a number of milliseconds. `is_top` is true if it
    /// belongs to the chart itself.
    pub(super) fn declare_time(
        &mut self,
        frame: FrameId,
        var: &Var,
        name: &Name,
        usage: &Usage,
        is_top: bool,
    ) -> Binding {
        let key = &var.name.id;
        let is_assigned = usage.assigned.contains(key);
        let is_input =
            is_top && matches!(var.section, Section::Input | Section::InOut | Section::External);
        let start = match &self.init_of(var) {
            Some(ast::Init::Value(init)) => match self.value(frame, init) {
                Ok(Value { kind: Kind::Time(Time::Constant(ns)), .. }) => ns,
                Ok(_) => {
                    self.type_error("expected a constant time", init.span);
                    return Binding::Broken;
                }
                Err(ErrorReported) => return Binding::Broken,
            },
            Some(_) | None => 0,
        };
        if var.is_constant || !is_assigned && !is_input {
            return Binding::Value(Value::time(start, var.name.span));
        }
        let meta = Meta { span: var.name.span, label: var.label.clone(), ..Meta::default() };
        let name = name.clone();
        let place = Place { name: name.clone(), chart: self.chart, index: None, ty: Ty::Time };
        if is_input && !is_assigned {
            self.inputs.insert(name.text.clone());
            let ty = Type::Int { lo: 0, hi: WIDEST.1 };
            let kind = DeclarationKind::Input { ty, synchronous: false };
            self.items.push(Item::Declaration(Declaration { name, kind, meta }));
            return Binding::Place(place);
        }
        if is_input && var.section == Section::Input {
            self.assigned_input(var);
            return Binding::Broken;
        }
        let values =
            self.assigned_times(frame, start, usage.times.get(key).map_or(&[], Vec::as_slice));
        let ends = values.as_ref().and_then(|all| Some((all.first()? / UNIT, all.last()? / UNIT)));
        let (lo, hi) = ends.filter(|(lo, hi)| WIDEST.0 <= *lo && *hi <= WIDEST.1).unwrap_or(WIDEST);
        let ty = Type::Int { lo, hi };
        let Ok((init, _)) = self.milliseconds(Value::time(start, var.name.span)) else {
            return Binding::Broken;
        };
        let kind = if is_top && var.section == Section::Output {
            DeclarationKind::Output {
                ty,
                init: Some(init),
                registered: false,
                mealy: false,
                safe: None,
            }
        } else {
            DeclarationKind::Var { ty, len: None, init: vec![init] }
        };
        if let Some(values) = values {
            self.time_values.insert((self.chart, name.text.clone()), values);
        }
        self.items.push(Item::Declaration(Declaration { name, kind, meta }));
        Binding::Place(place)
    }

    /// The values of a TIME variable with these assignments, if they are known and few.
    fn assigned_times(&self, frame: FrameId, start: i64, given: &[Option<ast::Expr>]) -> Values {
        // If there are none, the variable is assigned in a way that the search for its values did not find.
        if given.is_empty() {
            return None;
        }
        let mut values: BTreeSet<_> = [start].into_iter().gather();
        for one in given {
            values.extend(self.listed(frame, one.as_ref()?)?);
        }
        let are_few = values.len() <= MAX_VALUES && values.iter().all(|ns| ns % UNIT == 0);
        are_few.then_some(values)
    }

    /// The values of an expression for which [`is_listed`](super::usage::is_listed) is true.
    fn listed(&self, frame: FrameId, value: &ast::Expr) -> Values {
        if let ast::ExprKind::Call(_, arguments) = &value.kind {
            let mut all = BTreeSet::new();
            for argument in arguments.iter().skip(1) {
                all.extend(self.listed(frame, &argument.value)?);
            }
            return Some(all);
        }
        if let ast::ExprKind::Time(ns) = value.kind {
            return Some([ns].into_iter().gather());
        }
        let ast::ExprKind::Name(name) = &value.kind else { return None };
        match self.lookup(frame, &name.id)? {
            Binding::Value(Value { kind: Kind::Time(Time::Constant(ns)), .. }) => {
                Some([ns].into_iter().gather())
            }
            Binding::Place(place) => self.values_of(&place),
            Binding::Value(_) | Binding::Object(_) | Binding::Step(_) | Binding::Broken => None,
        }
    }

    /// The possible values of a TIME variable, if they are known.
    pub(super) fn values_of(&self, place: &Place) -> Values {
        self.time_values.get(&(place.chart, place.name.text.clone())).cloned()
    }

    /// Checks a time stored in a TIME variable: it must be one of the values found at its declaration.
    pub(super) fn stored_time(&mut self, place: &Place, value: Value) -> Outcome<Expr> {
        let span = value.expr.span;
        let (expr, given) = self.milliseconds(value)?;
        if let Some(known) = self.values_of(place)
            && !given.is_some_and(|given| given.is_subset(&known))
        {
            return Err(self.report(
                Diagnostic::error(
                    codes::ST_TIMER,
                    format!(
                        "`{}` is assigned a time that is never assigned to it in the unit that declares it",
                        place.name
                    ),
                )
                .at(span, "assigned outside that unit")
                .help("assign all values of a TIME variable in the unit that declares it"),
            ));
        }
        Ok(expr)
    }
}
