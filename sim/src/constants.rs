//! The largest constant that each timer is compared with: a timer that is one above it need not count further (semantics §3.1).

use std::collections::BTreeMap;

use grafsynth_ir::expr::{Expr, ExprKind};
use grafsynth_ir::net::{Leaf, Net, PropertyLeaf};

/// For each `s.t`, `s.T` and free timer that some expression reads: one above the largest constant it is compared with.
pub(crate) fn timer_caps(net: &Net) -> BTreeMap<Leaf, i64> {
    let mut caps = BTreeMap::new();
    for expr in net.expressions() {
        collect(expr, &mut caps, &|leaf| Some(*leaf));
    }
    for property in &net.properties {
        collect(&property.never, &mut caps, &|leaf: &PropertyLeaf| leaf.net().copied());
    }
    caps
}

fn collect<L>(
    expr: &Expr<L>,
    caps: &mut BTreeMap<Leaf, i64>,
    net_leaf: &impl Fn(&L) -> Option<Leaf>,
) {
    if let ExprKind::Compare(_, a, b) = &expr.kind {
        for (timer, constant) in [(a, b), (b, a)] {
            if let (ExprKind::Leaf(leaf), Some(value)) = (&timer.kind, constant_value(constant))
                && let Some(leaf) = net_leaf(leaf).filter(Leaf::is_time)
            {
                let cap = value.saturating_add(1).max(0);
                let entry = caps.entry(leaf).or_insert(cap);
                *entry = (*entry).max(cap);
            }
        }
    }
    for operand in expr.children() {
        collect(operand, caps, net_leaf);
    }
}

pub(crate) fn constant_value<L>(expr: &Expr<L>) -> Option<i64> {
    if let ExprKind::Neg(inner) = &expr.kind {
        return constant_value(inner)?.checked_neg();
    }
    if let ExprKind::Int(value) = expr.kind { Some(value) } else { None }
}
