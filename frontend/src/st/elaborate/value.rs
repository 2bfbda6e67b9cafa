//! Values: expressions of the chart with their known ranges and types.

use std::collections::BTreeSet;

use grafsynth_ir::chart::{Expr, Leaf, Path};
use grafsynth_ir::expr::ExprKind;
use grafsynth_ir::{Name, Span};

use crate::number::Num;

/// An expression of the chart, with the known facts about its value.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Value {
    pub(super) expr: Expr,
    pub(super) kind: Kind,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Kind {
    Bool,
    /// Smallest and largest value.
    Int(i64, i64),
    Time(Time),
}

/// A time. Charts compare times only with constants.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Time {
    /// A constant in nanoseconds.
    Constant(i64),
    /// The expression is a number of milliseconds. If its possible values are known, they are listed in nanoseconds.
    Varying(Values),
    /// The expression is the name of a timer or of the time of a step.
    Running,
    /// ET of an on-delay timer: while the block's input was true, the timer in the expression, limited to PT (`limit`, in nanoseconds); otherwise 0.
    Elapsed { running: Box<Expr>, limit: i64 },
}

/// The possible values of a TIME variable in nanoseconds; `None` if it is computed.
pub(super) type Values = Option<BTreeSet<i64>>;

impl Value {
    pub(super) fn bool(expr: Expr) -> Self {
        Value { expr, kind: Kind::Bool }
    }

    pub(super) fn constant(value: bool, span: Span) -> Self {
        Value::bool(Expr::new(ExprKind::Bool(value), span))
    }

    pub(super) fn int(value: i64, span: Span) -> Self {
        Value { expr: Expr::new(ExprKind::Int(value), span), kind: Kind::Int(value, value) }
    }

    /// The value of an initial value that is a number or a Boolean.
    pub(super) fn literal(expr: Expr) -> Self {
        if let ExprKind::Int(value) = expr.kind {
            Value::int(value, expr.span)
        } else {
            Value::bool(expr)
        }
    }

    pub(super) fn time(ns: i64, span: Span) -> Self {
        let leaf = Leaf::Duration(u64::try_from(ns).unwrap_or(0));
        Value { expr: Expr::leaf(leaf, span), kind: Kind::Time(Time::Constant(ns)) }
    }

    /// The same value, with the location where it is read.
    pub(super) fn seen_at(self, span: Span) -> Self {
        Value { expr: Expr::new(self.expr.kind, span), kind: self.kind }
    }

    /// A number at `span`.
    pub(super) fn of_num(num: Num, span: Span) -> Self {
        Value { expr: Expr::new(num.expr.kind, span), kind: Kind::Int(num.lo, num.hi) }
    }

    /// The value wrapped into the range of an integer type, as two's complement does.
    pub(super) fn wrapped(self, lo: i64, hi: i64) -> Value {
        let n_bits = u64::BITS - hi.abs_diff(lo).leading_zeros();
        match self.num() {
            Some(num) => Value::of_num(num.wrapped(n_bits, lo < 0), self.expr.span),
            None => self,
        }
    }

    /// The number, if it is one.
    pub(super) fn num(&self) -> Option<Num> {
        let Kind::Int(lo, hi) = self.kind else { return None };
        Some(Num { expr: self.expr.clone(), lo, hi })
    }
}

/// The number of nodes of an expression, counted up to `most`.
pub(super) fn nodes(expr: &Expr, most: usize) -> usize {
    let mut count = 1;
    for operand in expr.children() {
        if count >= most {
            return count;
        }
        count += nodes(operand, most - count);
    }
    count
}

/// A leaf that reads a name.
pub(super) fn leaf(path: Path, span: Span) -> Expr {
    Expr::leaf(Leaf::Name(path), span)
}

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

/// A choice between two Booleans; `None` if neither of them is constant.
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

/// Merges nested choices that share an alternative: otherwise each level of nested IFs would duplicate it.
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

/// Whether an expression reads a name that begins with `prefix`.
pub(super) fn mentions(expr: &Expr, prefix: &str) -> bool {
    expr.leaves().any(|leaf| {
        matches!(leaf, Leaf::Name(path)
            if path.names.last().is_some_and(|name| name.text.starts_with(prefix)))
    })
}

/// Whether all names in a value, as paths of the chart, satisfy a condition.
pub(super) fn reads_only(value: &Value, is_allowed: impl Fn(&[Name]) -> bool) -> bool {
    value.expr.leaves().all(|leaf| match leaf {
        Leaf::Name(path) => is_allowed(&path.names),
        _ => true,
    })
}
