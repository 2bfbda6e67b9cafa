//! Writes lists that run at activations and deactivations, and free timers, with features of the standard.
//!
//! ```text
//! step s { entry { n := n + 1 } }     STEP s: s_entry(P1); END_STEP      ACTION s_entry: n := n + 1; END_ACTION
//! timer t while a                     t : TON := (PT := T#..)            ACTION timers: t(IN := a); END_ACTION, stored by an initial step
//! ```
//! Actions run after all transitions of a scan, in the order of their declarations: the lists of steps that are left, the lists of steps
//! that are entered, the other actions of the chart, the timers.
//!
//! This is the order of semantics §3.3, §3.5 and §7, unless a list reads steps or controlled outputs: in the net, steps change one after
//! the other while the lists run, and controlled outputs still have their values of the previous row. A step that is left and entered at
//! once stays active for P0 and P1.

use grafsynth_ir::Gather;
use std::collections::BTreeSet;

use grafsynth_ir::chart::{
    ActionHow, Block, Chart, DeclarationKind, Expr, Item, Leaf, StepItemKind, StmtKind,
};

/// Calls `visit` on every expression of a list.
fn of_block(block: &Block, visit: &mut dyn FnMut(&Expr)) {
    for stmt in block {
        match &stmt.kind {
            StmtKind::Assign { index, value, .. } => {
                index.iter().for_each(&mut *visit);
                visit(value);
            }
            StmtKind::If { condition, then, otherwise } => {
                visit(condition);
                of_block(then, visit);
                of_block(otherwise, visit);
            }
            StmtKind::Call { arguments, .. } => arguments.iter().for_each(&mut *visit),
            _ => {}
        }
    }
}

/// Whether a list reads the activity or the time of a step.
pub(super) fn asks_for_steps(block: &Block) -> bool {
    let mut asks = false;
    of_block(block, &mut |expr| {
        for leaf in expr.leaves() {
            if let Leaf::Name(path) = leaf {
                asks |= path.names.len() > 1
                    && path
                        .names
                        .last()
                        .is_some_and(|last| matches!(last.text.as_str(), "active" | "t" | "T"));
            }
        }
    });
    asks
}

/// The first of these names that a list reads.
pub(super) fn asks_for(block: &Block, names: &BTreeSet<&str>) -> Option<String> {
    let mut found = None;
    of_block(block, &mut |expr| {
        for leaf in expr.leaves() {
            if let Leaf::Name(path) = leaf
                && let [name] = path.names.as_slice()
                && names.contains(name.text.as_str())
            {
                found.get_or_insert_with(|| name.text.clone());
            }
        }
    });
    found
}

/// The outputs and actions that steps use with qualifiers. Their values change before the bodies of actions run.
pub(super) fn controlled(chart: &Chart) -> BTreeSet<&str> {
    let mut found = BTreeSet::new();
    for item in &chart.items {
        let Item::Step(step) = item else { continue };
        for one in &step.body {
            if let StepItemKind::Action { target, how, .. } = &one.kind
                && *how != ActionHow::Bare
            {
                found.insert(target.text.as_str());
            }
        }
    }
    found
}

/// The steps that a transition with `restart` enters and that any transition leaves.
pub(super) fn renewed(chart: &Chart) -> BTreeSet<&str> {
    let transitions = || {
        chart.items.iter().filter_map(|item| {
            if let Item::Transition(transition) = item { Some(transition) } else { None }
        })
    };
    let left: BTreeSet<String> =
        transitions().flat_map(|one| &one.sources).map(ToString::to_string).gather();
    let entered = transitions().filter(|one| one.restart).flat_map(|one| &one.targets);
    let names = entered.filter(|path| left.contains(&path.to_string()));
    names.filter_map(|path| path.names.last()).map(|name| name.text.as_str()).gather()
}

/// The longest time in any comparison of a chart, in nanoseconds.
pub(super) fn longest(chart: &Chart) -> u64 {
    let mut longest = 0;
    let mut visit = |expr: &Expr| {
        for leaf in expr.leaves() {
            if let Leaf::Duration(ns) = leaf {
                longest = longest.max(*ns);
            }
        }
    };
    for item in &chart.items {
        match item {
            Item::Transition(transition) => transition.guard.iter().for_each(&mut visit),
            Item::Action(action) => of_block(&action.body, &mut visit),
            Item::Step(step) => {
                for one in &step.body {
                    if let StepItemKind::Entry(list) | StepItemKind::Exit(list) = &one.kind {
                        of_block(list, &mut visit);
                    }
                }
            }
            Item::Declaration(declaration) => {
                if let DeclarationKind::Timer { condition } = &declaration.kind {
                    visit(condition);
                }
            }
            // These items cannot be written.
            _ => {}
        }
    }
    longest
}
