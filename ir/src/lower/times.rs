//! Times: converts durations to ticks, checks comparisons of times with constants, and converts `t1/E/t2` and `m.t` to hidden free timers (semantics §7).

use super::codes;
use super::context::{Lowering, Outcome, ScopeId, Symbol, Value};
use super::names::{Attribute, Resolved, StepLike};
use super::place::{Place, Target};
use crate::chart::{Expr as Syntax, Leaf as SyntaxLeaf, Length};
use crate::diag::Diagnostic;
use crate::duration;
use crate::expr::{CompareOp, Expr, ExprKind};
use crate::interval::{self, TypeError, TypeErrorKind};
use crate::net::{Evolution, Leaf, Meta, StepId, Timer, TimerId};
use crate::span::{Name, Span};

/// The largest number of ticks in a comparison: a timer that saturates one above it still fits in 31 bits.
const MAX_TICKS: u64 = interval::LONGEST as u64;

/// A time that an expression compares.
#[derive(Debug, Clone, Copy)]
enum Time {
    Step(StepId, Attribute),
    /// The macro-step and its timer.
    MacroStep(usize, TimerId),
    Timer(TimerId),
}

impl Lowering<'_> {
    /// Nanoseconds, for a duration as written or a constant that names one.
    pub(super) fn duration_constant(&self, scope: ScopeId, syntax: &Syntax) -> Option<u64> {
        match syntax.as_leaf()? {
            SyntaxLeaf::Duration(ns) => Some(*ns),
            SyntaxLeaf::Name(path) => match self.peek(scope, path) {
                Some(Resolved::Symbol(Symbol::Const(Value::Duration(ns)))) => Some(ns),
                _ => None,
            },
            SyntaxLeaf::Rise(_)
            | SyntaxLeaf::Fall(_)
            | SyntaxLeaf::Otherwise
            | SyntaxLeaf::Delay(..) => None,
        }
    }

    /// Ticks of a duration, rounded up with a warning.
    pub(super) fn ticks(&mut self, ns: u64, span: Span) -> Outcome<u32> {
        let tick = self.net.settings.tick_ns.max(1);
        let ticks = ns.div_ceil(tick);
        if ticks > MAX_TICKS {
            return Err(self.report(
                Diagnostic::error(
                    codes::DURATION_TOO_LONG,
                    format!(
                        "{} is {ticks} ticks of {}, but a timer counts at most {MAX_TICKS}",
                        duration(ns),
                        duration(tick)
                    ),
                )
                .at(span, "")
                .help("declare a longer `tick`, or count with a variable"),
            ));
        }
        if !ns.is_multiple_of(tick) {
            // The product cannot exceed 64 bits: it is less than one tick above `ns`, and there are at most 2^31 ticks.
            let rounded = ticks.saturating_mul(tick);
            self.report(
                Diagnostic::warning(
                    codes::DURATION_ROUNDED,
                    format!("{} is rounded up to {}", duration(ns), duration(rounded)),
                )
                .plural(duration(ns), "the durations", "are rounded up to whole ticks")
                .at(span, format!("not a multiple of the tick, {}", duration(tick)))
                .help("declare a shorter `tick` if the difference matters"),
            );
        }
        u32::try_from(ticks).map_err(|_| self.already_told())
    }

    /// `s.t >= 3 s` and other comparisons.
    pub(super) fn comparison<L: Target>(
        &mut self,
        op: CompareOp,
        a: &Syntax,
        b: &Syntax,
        span: Span,
        place: &Place<'_>,
    ) -> Outcome<Expr<L>> {
        for (time, other, op) in [(a, b, op), (b, a, op.mirrored())] {
            if let Some(found) = self.time(time, place)? {
                let ticks = self.time_constant(other, place)?;
                return Ok(self.time_comparison(op, found, ticks, time.span, other.span, span));
            }
        }
        // A duration alone is a separate error only if the other side is not a time.
        let (a, b) = if self.duration_constant(place.scope, b).is_some() {
            let a = self.expression(a, place)?;
            (Ok(a), self.expression(b, place))
        } else if self.duration_constant(place.scope, a).is_some() {
            let b = self.expression(b, place)?;
            (self.expression(a, place), Ok(b))
        } else {
            (self.expression(a, place), self.expression(b, place))
        };
        Ok(Expr::new(ExprKind::Compare(op, Box::new(a?), Box::new(b?)), span))
    }

    /// The time that an operand of a comparison reads, if it reads one.
    fn time(&mut self, syntax: &Syntax, place: &Place<'_>) -> Outcome<Option<Time>> {
        let ExprKind::Leaf(SyntaxLeaf::Name(path)) = &syntax.kind else { return Ok(None) };
        let time = match self.peek(place.scope, path) {
            Some(Resolved::Attribute(
                StepLike::Step(step),
                attribute @ (Attribute::Elapsed | Attribute::LastElapsed),
            )) => {
                if self.counted.contains_key(&step) {
                    super::counted::no_time(self, step, path.span());
                    return Err(self.already_told());
                }
                Time::Step(step, attribute)
            }
            Some(Resolved::Attribute(StepLike::MacroStep(instance), Attribute::Elapsed)) => {
                let timer = self.macro_timer(instance, path.span())?;
                Time::MacroStep(instance, timer)
            }
            Some(Resolved::Attribute(StepLike::MacroStep(_), Attribute::LastElapsed)) => {
                return Err(self.report(
                    Diagnostic::error(
                        codes::WRONG_KIND,
                        format!("a macro-step has no `T`, so `{path}` does not exist"),
                    )
                    .at(path.span(), "")
                    .help("use `t`, or the time of one of its steps"),
                ));
            }
            Some(Resolved::Symbol(Symbol::Timer(timer))) => Time::Timer(timer),
            Some(Resolved::Symbol(_) | Resolved::Attribute(..)) | None => return Ok(None),
        };
        if place.constant {
            return Err(self.report(
                Diagnostic::error(codes::CONSTANT_NEEDED, format!("`{path}` is not a constant"))
                    .at(path.span(), "its value is not known before the chart runs")
                    .help("write a value, or the name of a `const`"),
            ));
        }
        Ok(Some(time))
    }

    /// The duration of `after`, in ticks.
    pub(super) fn length(&mut self, scope: ScopeId, length: &Length, span: Span) -> Outcome<u32> {
        match length {
            Length::Ns(ns) => self.ticks(*ns, span),
            Length::Named(path) => {
                let syntax = Syntax::leaf(SyntaxLeaf::Name(path.clone()), path.span());
                self.time_constant(&syntax, &Place::level(scope, "a duration"))
            }
        }
    }

    /// The constant side of a comparison of times, in ticks.
    fn time_constant(&mut self, syntax: &Syntax, place: &Place<'_>) -> Outcome<u32> {
        if let Some(ns) = self.duration_constant(place.scope, syntax) {
            return self.ticks(ns, syntax.span);
        }
        match self.constant_value(place.scope, syntax)? {
            Value::Int(ticks) if ticks < 0 => {
                let kind = TypeErrorKind::DurationNegative { constant: ticks };
                Err(self.report_type(&TypeError { span: syntax.span, kind }))
            }
            Value::Int(ticks) => match u32::try_from(ticks) {
                Ok(ticks) if u64::from(ticks) <= MAX_TICKS => Ok(ticks),
                Ok(_) | Err(_) => Err(self.report(
                    Diagnostic::error(
                        codes::DURATION_TOO_LONG,
                        format!("{ticks} ticks, but a timer counts at most {MAX_TICKS}"),
                    )
                    .at(syntax.span, "")
                    .help("write a shorter time, or a longer `tick`"),
                )),
            },
            Value::Bool(_) => Err(self
                .report_type(&TypeError { span: syntax.span, kind: TypeErrorKind::IntExpected })),
            Value::Duration(ns) => self.ticks(ns, syntax.span),
        }
    }

    fn time_comparison<L: Target>(
        &self,
        op: CompareOp,
        time: Time,
        ticks: u32,
        time_span: Span,
        constant_span: Span,
        span: Span,
    ) -> Expr<L> {
        let leaf = match time {
            Time::Step(step, Attribute::LastElapsed) => Leaf::LastElapsed(step),
            Time::Step(
                step,
                Attribute::Elapsed | Attribute::Active | Attribute::Done | Attribute::Complete,
            ) => Leaf::Elapsed(step),
            Time::MacroStep(_, timer) | Time::Timer(timer) => Leaf::Timer(timer),
        };
        let left = Expr::leaf(L::of_net(leaf), time_span);
        let right = Expr::new(ExprKind::Int(i64::from(ticks)), constant_span);
        let compared = Expr::new(ExprKind::Compare(op, Box::new(left), Box::new(right)), span);
        let Time::MacroStep(instance, _) = time else { return compared };
        // The free timer becomes 0 only at the end of the reaction. While the macro-step is inactive its time is 0, regardless of the value of the timer.
        let active = self.macro_active::<L>(instance, time_span);
        if op.apply(0, i64::from(ticks)) {
            Expr::new(
                ExprKind::Or(vec![Expr::new(ExprKind::Not(Box::new(active)), time_span), compared]),
                span,
            )
        } else {
            Expr::new(ExprKind::And(vec![active, compared]), span)
        }
    }

    /// The hidden free timer of `m.t`: it runs while `m.active`.
    fn macro_timer(&mut self, instance: usize, span: Span) -> Outcome<TimerId> {
        if let Some(timer) = self.instances[instance].timer {
            return Ok(timer);
        }
        self.not_in_finished_net(span, "the time of a macro-step")?;
        let name =
            self.net.parts[self.scopes[self.instances[instance].scope].part].name.text.clone();
        if self.net.settings.evolution != Evolution::Single {
            self.report(
                Diagnostic::warning(
                    codes::MACRO_TIME,
                    format!("`{name}.t` is not reset when `{name}` is left and entered again within one reaction"),
                )
                .at(span, "")
                .help("use the time of one of its steps if that can happen, or write `evolution single`"),
            );
        }
        let condition = self.macro_active(instance, span);
        let timer = self.hidden_timer(&format!("{name}_time"), condition, false, span);
        self.instances[instance].timer = Some(timer);
        Ok(timer)
    }

    /// Reports an expression that needs a new timer, which cannot be added to a finished net.
    fn not_in_finished_net(&mut self, span: Span, what: &str) -> Outcome<()> {
        if self.flat.is_none() {
            return Ok(());
        }
        Err(self.report(
            Diagnostic::error(
                codes::TIME_ALONE,
                format!("{what} is not allowed outside the chart"),
            )
            .at(span, "needs a timer in the chart")
            .help("declare `timer T while ..` in the chart and compare T here"),
        ))
    }

    fn hidden_timer(
        &mut self,
        base: &str,
        condition: Expr<Leaf>,
        starts_expired: bool,
        span: Span,
    ) -> TimerId {
        let name = Name::new(self.fresh_name(base), span);
        let meta = Meta { span, ..Meta::default() };
        self.net.timers.push(Timer { name, condition, starts_expired, meta })
    }

    /// `t1/E/t2` = TOF(TON(E, t1), t2) with up to two hidden free timers (semantics §7).
    pub(super) fn delay<L: Target>(
        &mut self,
        on: u64,
        operand: &Syntax,
        off: u64,
        span: Span,
        place: &Place<'_>,
    ) -> Outcome<Expr<L>> {
        let inner = Place::level(place.scope, "a delayed condition");
        let inner = Place { constant: place.constant, ..inner };
        self.not_in_finished_net(span, "a delayed condition")?;
        let operand_expr = self.condition::<Leaf>(operand, &inner);
        let (on, off) = (self.ticks(on, span), self.ticks(off, span));
        let (expr, on, off) = (operand_expr?, on?, off?);
        let key = (on, expr.without_spans(), off);
        let delayed = match self.delays.get(&key) {
            Some(delayed) => delayed.clone(),
            None => {
                let delayed = self.delayed(expr, on, off, span);
                self.delays.insert(key, delayed.clone());
                delayed
            }
        };
        Ok(Expr { span, ..delayed.map_leaves(&|leaf| L::of_net(*leaf)) })
    }

    fn delayed(&mut self, expr: Expr<Leaf>, on: u32, off: u32, span: Span) -> Expr<Leaf> {
        let base = self.operand_name(&expr);
        let at_least = |timer, ticks: u32, op| {
            Expr::new(
                ExprKind::Compare(
                    op,
                    Box::new(Expr::leaf(Leaf::Timer(timer), span)),
                    Box::new(Expr::new(ExprKind::Int(i64::from(ticks)), span)),
                ),
                span,
            )
        };
        let ton = if on == 0 {
            expr
        } else {
            let timer = self.hidden_timer(&format!("{base}_on_delay"), expr.clone(), false, span);
            Expr::and([expr, at_least(timer, on, CompareOp::Ge)])
        };
        if off == 0 {
            return ton;
        }
        let timer = self.hidden_timer(&format!("{base}_off_delay"), ton.clone().not(), true, span);
        Expr::or([ton, at_least(timer, off, CompareOp::Lt)])
    }

    /// A name for something derived from an expression: the name of its first leaf.
    fn operand_name(&self, expr: &Expr<Leaf>) -> String {
        let net = &self.net;
        match expr.leaves().next().copied() {
            Some(Leaf::Input(id)) => net.inputs[id].name.text.clone(),
            Some(Leaf::Var(id)) => net.vars[id].name.text.clone(),
            Some(
                Leaf::Active(id) | Leaf::Elapsed(id) | Leaf::LastElapsed(id) | Leaf::TasksDone(id),
            ) => net.steps[id].name.text.clone(),
            Some(Leaf::Timer(id)) => net.timers[id].name.text.clone(),
            Some(Leaf::Controlled(id)) => net.actions[id].name.text.clone(),
            Some(Leaf::Rise(_) | Leaf::Fall(_) | Leaf::Fireable(_)) | None => "delay".to_owned(),
        }
    }
}
