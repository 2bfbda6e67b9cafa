//! Visits every expression and every statement of a net, for analyses.

use crate::net::{Block, Driver, Expr, Net, OutputId, Stmt, StmtKind};
use crate::span::Span;
use std::collections::BTreeMap;

/// Calls `visit` with every expression of the net except those of properties.
pub fn for_each_expr(net: &Net, visit: &mut impl FnMut(&Expr)) {
    net.outputs.values().for_each(|output| for_each_in_driver(&output.driver, visit));
    net.emergency.iter().for_each(|emergency| visit(&emergency.condition));
    net.timers.values().for_each(|timer| visit(&timer.condition));
    net.edges.values().for_each(|edge| visit(&edge.expr));
    for step in net.steps.values() {
        for list in [&step.entry, &step.exit, &step.initial_content] {
            for_each_in_block(list, visit);
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

/// Calls `visit` with the conditions of an output, and with the arguments of its calls.
pub fn for_each_in_driver(driver: &Driver, visit: &mut impl FnMut(&Expr)) {
    match driver {
        Driver::Continuous(emissions) | Driver::Mealy(emissions) => {
            let conditions = emissions.iter().filter_map(|emission| emission.condition.as_ref());
            conditions.for_each(visit);
        }
        Driver::Extern { calls, .. } => {
            for call in calls {
                call.condition.iter().chain(&call.arguments).for_each(&mut *visit);
            }
        }
        Driver::Stored(_) | Driver::Controlled(_) => {}
    }
}

/// Calls `visit` with every expression of a statement list, including those in both branches of an `if`.
pub fn for_each_in_block(list: &Block, visit: &mut impl FnMut(&Expr)) {
    for stmt in list {
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

/// Calls `visit` with every statement of the net, including those inside `if`.
pub fn for_each_stmt<'a>(net: &'a Net, visit: &mut impl FnMut(&'a Stmt)) {
    let mut todo: Vec<&'a Stmt> = Vec::new();
    for step in net.steps.values() {
        todo.extend(step.entry.iter().chain(&step.exit).chain(&step.initial_content));
        step.tasks.iter().for_each(|task| todo.extend(&task.body));
    }
    net.transitions.values().for_each(|transition| todo.extend(&transition.actions));
    net.actions.values().for_each(|action| todo.extend(&action.body));
    net.histories.values().for_each(|history| todo.extend(&history.default_content));
    while let Some(stmt) = todo.pop() {
        visit(stmt);
        if let StmtKind::If { then, otherwise, .. } = &stmt.kind {
            todo.extend(then.iter().chain(otherwise));
        }
    }
}

/// The extern actions that statement lists, bodies and tasks call, each with the location of its first call. Such a call is instantaneous, so the action
/// has no lasting value like an output.
#[must_use]
pub fn called_in_lists(net: &Net) -> BTreeMap<OutputId, Span> {
    let mut called: BTreeMap<OutputId, Span> = BTreeMap::new();
    for_each_stmt(net, &mut |stmt| {
        if let StmtKind::Call { output, .. } = stmt.kind {
            called.entry(output).and_modify(|at| *at = (*at).min(stmt.span)).or_insert(stmt.span);
        }
    });
    called
}
