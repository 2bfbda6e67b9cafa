//! The largest constant that each timer is compared with: a timer that stands one above it need not count on (semantics §3.1).

use std::collections::BTreeMap;

use grafsynth_ir::expr::{Expr, ExprKind};
use grafsynth_ir::net::{self, Block, Driver, Leaf, Net, PropertyLeaf, StmtKind};

/// For each `s.t`, `s.T` and free timer that some expression reads: one above the largest constant it is compared with.
pub(crate) fn timer_caps(net: &Net) -> BTreeMap<Leaf, i64> {
    let mut caps = BTreeMap::new();
    for_each_expr(net, &mut |expr| collect(expr, &mut caps, &|leaf| Some(*leaf)));
    for property in &net.properties {
        collect(&property.never, &mut caps, &|leaf| match leaf {
            PropertyLeaf::Net(leaf) => Some(*leaf),
            PropertyLeaf::Output(_) => None,
        });
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
                && let Some(leaf) = net_leaf(leaf).filter(is_timer)
            {
                let cap = value.saturating_add(1).max(0);
                let entry = caps.entry(leaf).or_insert(cap);
                *entry = (*entry).max(cap);
            }
        }
    }
    for operand in expr.operands() {
        collect(operand, caps, net_leaf);
    }
}

fn constant_value<L>(expr: &Expr<L>) -> Option<i64> {
    match &expr.kind {
        ExprKind::Int(value) => Some(*value),
        ExprKind::Neg(inner) => constant_value(inner).map(i64::wrapping_neg),
        ExprKind::Bool(_)
        | ExprKind::Leaf(_)
        | ExprKind::Element(..)
        | ExprKind::Not(_)
        | ExprKind::And(_)
        | ExprKind::Or(_)
        | ExprKind::Compare(..)
        | ExprKind::Arith(..)
        | ExprKind::Select(..) => None,
    }
}

fn is_timer(leaf: &Leaf) -> bool {
    matches!(leaf, Leaf::Elapsed(_) | Leaf::LastElapsed(_) | Leaf::Timer(_))
}

/// Calls `visit` with every expression of the net but those of properties.
pub(crate) fn for_each_expr(net: &Net, visit: &mut impl FnMut(&net::Expr)) {
    for output in net.outputs.values() {
        match &output.driver {
            Driver::Continuous(emissions) | Driver::Mealy(emissions) => {
                emissions
                    .iter()
                    .filter_map(|emission| emission.condition.as_ref())
                    .for_each(&mut *visit);
            }
            Driver::Extern { calls, .. } => {
                for call in calls {
                    call.condition.iter().chain(&call.arguments).for_each(&mut *visit);
                }
            }
            Driver::Stored(_) | Driver::Controlled(_) => {}
        }
    }
    net.timers.values().for_each(|timer| visit(&timer.condition));
    net.edges.values().for_each(|edge| visit(&edge.expr));
    for step in net.steps.values() {
        for block in [&step.entry, &step.exit, &step.initial_content] {
            for_each_in_block(block, visit);
        }
        step.tasks.iter().for_each(|task| for_each_in_block(&task.body, visit));
    }
    for transition in net.transitions.values() {
        visit(&transition.guard);
        for_each_in_block(&transition.actions, visit);
    }
    for action in net.actions.values() {
        action.uses.iter().filter_map(|one| one.condition.as_ref()).for_each(&mut *visit);
        for_each_in_block(&action.body, visit);
    }
    net.histories.values().for_each(|history| for_each_in_block(&history.default_content, visit));
    net.unspecified.iter().for_each(|open| visit(&open.when));
}

fn for_each_in_block(block: &Block, visit: &mut impl FnMut(&net::Expr)) {
    for stmt in block {
        match &stmt.kind {
            StmtKind::Assign { index, value, .. } => {
                index.iter().chain([value]).for_each(&mut *visit)
            }
            StmtKind::Call { arguments, .. } => arguments.iter().for_each(&mut *visit),
            StmtKind::If { condition, then, otherwise } => {
                visit(condition);
                for_each_in_block(then, visit);
                for_each_in_block(otherwise, visit);
            }
            StmtKind::Raise(_) | StmtKind::Send(_) | StmtKind::Cancel(_) | StmtKind::Code(_) => {}
        }
    }
}
