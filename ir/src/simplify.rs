//! Simplification that preserves the value: constants, double negation, flat conjunctions and disjunctions without duplicates.
//!
//! The result has the same value as the given expression for all values of its leaves, and its interval is within the interval of the given expression. It
//! may contain fewer leaves, so do not use it if reading a leaf has a side effect (which extern conditions a guard calls is decided on the unsimplified
//! guard). Operands keep their order; of duplicates the first is kept.

use crate::expr::{CompareOp, Expr, ExprKind};
use std::cmp::Ordering;

/// The simplified expression.
///
/// Before: `not (not a) and (b and true) and a or 2 > 3`. After: `a and b`.
#[must_use]
pub fn simplify<L: Clone + Ord>(expr: &Expr<L>) -> Expr<L> {
    let span = expr.span;
    let pair = |a: &Expr<L>, b: &Expr<L>| (Box::new(simplify(a)), Box::new(simplify(b)));
    let kind = match &expr.kind {
        ExprKind::Bool(value) => ExprKind::Bool(*value),
        ExprKind::Int(value) => ExprKind::Int(*value),
        ExprKind::Leaf(leaf) => ExprKind::Leaf(leaf.clone()),
        ExprKind::Element(array, index) => {
            ExprKind::Element(array.clone(), Box::new(simplify(index)))
        }
        ExprKind::Not(a) => return negated(simplify(a), span),
        ExprKind::And(all) => return junction(all, true, span),
        ExprKind::Or(all) => return junction(all, false, span),
        ExprKind::Compare(op, a, b) => {
            let (a, b) = pair(a, b);
            return compared(*op, a, b, span);
        }
        ExprKind::Neg(a) => {
            let a = simplify(a);
            if let ExprKind::Neg(inner) = a.kind {
                inner.kind
            } else {
                let value = a.as_constant().and_then(i64::checked_neg);
                value.map_or_else(|| ExprKind::Neg(Box::new(a)), ExprKind::Int)
            }
        }
        ExprKind::Arith(op, a, b) => {
            let (a, b) = pair(a, b);
            match (a.as_constant(), b.as_constant()) {
                (Some(x), Some(y)) => match op.apply(x, y) {
                    Some(value) => ExprKind::Int(value),
                    None => ExprKind::Arith(*op, a, b),
                },
                _ => ExprKind::Arith(*op, a, b),
            }
        }
        ExprKind::Select(c, a, b) => {
            let c = simplify(c);
            let (a, b) = pair(a, b);
            match (&c.kind, &a.kind, &b.kind) {
                (ExprKind::Bool(true), _, _) => a.kind,
                (ExprKind::Bool(false), _, _) => b.kind,
                (_, ExprKind::Bool(true), ExprKind::Bool(false)) => c.kind,
                (_, ExprKind::Bool(false), ExprKind::Bool(true)) => return negated(c, span),
                _ if compare_shapes(&a, &b).is_eq() => a.kind,
                _ => ExprKind::Select(Box::new(c), a, b),
            }
        }
    };
    Expr::new(kind, span)
}

/// A total order of expressions that ignores source locations: two expressions are equal if and only if they are identical.
pub fn compare_shapes<L: Ord>(a: &Expr<L>, b: &Expr<L>) -> Ordering {
    fn rank<L>(kind: &ExprKind<L>) -> u8 {
        match kind {
            ExprKind::Bool(_) => 0,
            ExprKind::Int(_) => 1,
            ExprKind::Leaf(_) => 2,
            ExprKind::Element(..) => 3,
            ExprKind::Not(_) => 4,
            ExprKind::And(_) => 5,
            ExprKind::Or(_) => 6,
            ExprKind::Compare(..) => 7,
            ExprKind::Neg(_) => 8,
            ExprKind::Arith(..) => 9,
            ExprKind::Select(..) => 10,
        }
    }
    let head = match (&a.kind, &b.kind) {
        (ExprKind::Bool(x), ExprKind::Bool(y)) => x.cmp(y),
        (ExprKind::Int(x), ExprKind::Int(y)) => x.cmp(y),
        (ExprKind::Leaf(x), ExprKind::Leaf(y))
        | (ExprKind::Element(x, _), ExprKind::Element(y, _)) => x.cmp(y),
        (ExprKind::Compare(x, ..), ExprKind::Compare(y, ..)) => x.cmp(y),
        (ExprKind::Arith(x, ..), ExprKind::Arith(y, ..)) => x.cmp(y),
        (x, y) => rank(x).cmp(&rank(y)),
    };
    head.then_with(|| {
        let (mut left, mut right) = (a.children(), b.children());
        loop {
            match (left.next(), right.next()) {
                (None, None) => return Ordering::Equal,
                (None, Some(_)) => return Ordering::Less,
                (Some(_), None) => return Ordering::Greater,
                (Some(x), Some(y)) => match compare_shapes(x, y) {
                    Ordering::Equal => {}
                    unequal @ (Ordering::Less | Ordering::Greater) => return unequal,
                },
            }
        }
    })
}

/// The negation; a comparison of numbers or of Booleans gets the inverse operator (both orders are total).
fn negated<L>(expr: Expr<L>, span: crate::span::Span) -> Expr<L> {
    if let ExprKind::Compare(op, a, b) = expr.kind {
        Expr::new(ExprKind::Compare(op.negated(), a, b), span)
    } else {
        Expr { span, ..expr.not() }
    }
}

fn compared<L: Clone + Ord>(
    op: CompareOp,
    a: Box<Expr<L>>,
    b: Box<Expr<L>>,
    span: crate::span::Span,
) -> Expr<L> {
    if let (Some(x), Some(y)) = (a.as_constant(), b.as_constant()) {
        return Expr::new(ExprKind::Bool(op.apply(x, y)), span);
    }
    // For Booleans, `x = true` is `x`, and `x = false` is `not x`.
    let truth = |side: &Expr<L>| {
        if let ExprKind::Bool(value) = side.kind {
            Some(value == (op == CompareOp::Eq))
        } else {
            None
        }
    };
    match (truth(&a), truth(&b)) {
        (Some(same), _) => return if same { *b } else { negated(*b, span) },
        (_, Some(same)) => return if same { *a } else { negated(*a, span) },
        (None, None) => {}
    }
    if compare_shapes(&a, &b).is_eq() {
        return Expr::new(ExprKind::Bool(op.apply(0, 0)), span);
    }
    Expr::new(ExprKind::Compare(op, a, b), span)
}

/// A flat list without neutral constants and duplicates; a constant if the result is constant, as for `a and not a`.
fn junction<L: Clone + Ord>(all: &[Expr<L>], is_and: bool, span: crate::span::Span) -> Expr<L> {
    let whole = if is_and {
        Expr::and(all.iter().map(simplify))
    } else {
        Expr::or(all.iter().map(simplify))
    };
    let operands = match (whole.kind, is_and) {
        (ExprKind::And(operands), true) | (ExprKind::Or(operands), false) => operands,
        (kind, _) => return Expr::new(kind, span),
    };
    // Sorting positions finds duplicates in n log n and keeps the given order of the rest.
    let mut order: Vec<usize> = (0..operands.len()).collect();
    order.sort_by(|&x, &y| compare_shapes(&operands[x], &operands[y]).then(x.cmp(&y)));
    let mut keep = vec![true; operands.len()];
    for pair in order.windows(2) {
        if compare_shapes(&operands[pair[0]], &operands[pair[1]]).is_eq() {
            keep[pair[1]] = false;
        }
    }
    let has = |wanted: &Expr<L>| {
        order.binary_search_by(|&at| compare_shapes(&operands[at], wanted)).is_ok()
    };
    let contradicts = operands
        .iter()
        .any(|operand| matches!(&operand.kind, ExprKind::Not(inner) if has(inner.as_ref())));
    if contradicts {
        return Expr::new(ExprKind::Bool(!is_and), span);
    }
    let mut kept: Vec<Expr<L>> = operands
        .into_iter()
        .zip(keep)
        .filter_map(|(operand, keep)| keep.then_some(operand))
        .collect();
    if kept.len() == 1
        && let Some(only) = kept.pop()
    {
        return Expr { span, ..only };
    }
    Expr::new(if is_and { ExprKind::And(kept) } else { ExprKind::Or(kept) }, span)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expr::ArithOp;
    use crate::span::Span;
    use proptest::prelude::*;

    type E = Expr<usize>;

    fn node(kind: ExprKind<usize>) -> E {
        Expr::new(kind, Span::default())
    }
    fn leaf(index: usize) -> E {
        Expr::leaf(index, Span::new(crate::span::FileId(0), index, index + 1))
    }

    #[test]
    fn the_example_of_the_page() {
        let double = node(ExprKind::Not(Box::new(node(ExprKind::Not(Box::new(leaf(0)))))));
        let inner = node(ExprKind::And(vec![leaf(1), Expr::bool(true)]));
        let left = node(ExprKind::And(vec![double, inner, leaf(0)]));
        let right = Expr::compare(CompareOp::Gt, Expr::int(2), Expr::int(3));
        let simple = simplify(&node(ExprKind::Or(vec![left, right])));
        assert_eq!(
            compare_shapes(&simple, &node(ExprKind::And(vec![leaf(0), leaf(1)]))),
            Ordering::Equal
        );
    }

    #[test]
    fn contradictions_and_excluded_middles_are_constants() {
        assert!(simplify(&node(ExprKind::And(vec![leaf(0), leaf(1), leaf(0).not()]))).is_false());
        assert!(simplify(&node(ExprKind::Or(vec![leaf(0).not(), leaf(1), leaf(0)]))).is_true());
        let half = ExprKind::Arith(ArithOp::Div, Box::new(Expr::int(1)), Box::new(Expr::int(0)));
        assert_eq!(node(half).as_constant(), None, "no value, no panic");
    }

    fn condition() -> impl Strategy<Value = E> {
        let leaves =
            prop_oneof![4 => (0usize..4).prop_map(leaf), 1 => any::<bool>().prop_map(Expr::bool)];
        leaves.prop_recursive(5, 40, 4, |inner| {
            let number = (inner.clone(), -2i64..3, -2i64..3).prop_map(|(c, a, b)| {
                node(ExprKind::Select(Box::new(c), Box::new(Expr::int(a)), Box::new(Expr::int(b))))
            });
            prop_oneof![
                inner.clone().prop_map(|a| node(ExprKind::Not(Box::new(a)))),
                prop::collection::vec(inner.clone(), 0..4).prop_map(|all| node(ExprKind::And(all))),
                prop::collection::vec(inner.clone(), 0..4).prop_map(|all| node(ExprKind::Or(all))),
                (
                    number.clone(),
                    number,
                    prop_oneof![Just(CompareOp::Lt), Just(CompareOp::Ge), Just(CompareOp::Ne)]
                )
                    .prop_map(|(a, b, op)| Expr::compare(op, a, b)),
                (
                    inner.clone(),
                    inner.clone(),
                    prop_oneof![Just(CompareOp::Eq), Just(CompareOp::Ne)]
                )
                    .prop_map(|(a, b, op)| Expr::compare(op, a, b)),
                (inner.clone(), inner.clone(), inner).prop_map(|(c, a, b)| node(ExprKind::Select(
                    Box::new(c),
                    Box::new(a),
                    Box::new(b)
                ))),
            ]
        })
    }

    fn at(expr: &E, bits: usize) -> i64 {
        let fixed = expr.try_map::<usize, ()>(
            &mut |leaf, _| Ok(Expr::bool(bits >> leaf & 1 == 1)),
            &mut |array, _| Ok(*array),
        );
        fixed.unwrap().as_constant().unwrap()
    }

    proptest! {
        #[test]
        fn values_stay(expr in condition()) {
            let simple = simplify(&expr);
            for bits in 0..16 {
                prop_assert_eq!(at(&simple, bits), at(&expr, bits));
            }
            prop_assert_eq!(compare_shapes(&simplify(&simple), &simple), Ordering::Equal, "once is enough");
        }
    }
}
