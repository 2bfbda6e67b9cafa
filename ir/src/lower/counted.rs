//! Counted steps: `step p count 0..n`, the activation counters of the paper on the Graphical FSM Editor. Transitions decrement and increment a number
//! (semantics §8, C27).
//!
//! ```text
//! step p count 0..3          var p: int 0..3     a hidden step p, always active, so that the transitions after p still compete for it
//! t: p -> q when c      =>   t: p -> p & q when p > 0 and c do { p := p - 1 }
//! u: q -> p                  u: q -> p     do { p := p + 1 }
//! ```

use super::codes;
use super::context::{Lowering, ScopeId};
use crate::chart::{self, StepItemKind, StepRole};
use crate::diag::Diagnostic;
use crate::expr::{ArithOp, CompareOp, Expr, ExprKind, Type};
use crate::net::{Leaf, Policy, StepId, Stmt, StmtKind, Var, VarId, VarOrigin};
use crate::span::Span;

/// Makes a step that was just declared a counted step. Afterwards the net's step of this name is hidden and always active.
pub(super) fn declare(
    lowering: &mut Lowering<'_>,
    scope: ScopeId,
    id: StepId,
    source: &chart::Step,
) {
    let Some(count) = source.count else { return };
    let name = &source.name;
    let most = count.max.clamp(1, i32::MAX as u32);
    let at_reset = count.initial.unwrap_or(u32::from(source.role == StepRole::Initial)).min(most);
    if count.initial.is_some_and(|initial| initial > count.max) {
        refuse(
            lowering,
            count.span,
            format!("step `{name}` has an initial number above its maximum of {at_reset}"),
            "write a smaller number after `=`, or a larger bound",
        );
    }
    let policy = lowering.net.settings.policy;
    let place = if policy.is_statechart() {
        Some("a statechart")
    } else if lowering.scopes[scope].inside.is_some() {
        Some("an enclosing step")
    } else if lowering.scopes[scope].parent.is_some() {
        Some("a macro")
    } else {
        None
    };
    if let Some(place) = place {
        let help = "declare the counted step at the top level of the chart, or store the number in a variable";
        refuse(
            lowering,
            count.span,
            format!("the counted step `{name}` is not allowed in {place}"),
            help,
        );
    }
    if policy == Policy::PriorityAge || lowering.net.settings.assign_simultaneous {
        let setting = if policy == Policy::PriorityAge {
            "conflict priority-age"
        } else {
            "assign simultaneous"
        };
        refuse(
            lowering,
            count.span,
            format!("the counted step `{name}` is not allowed with `{setting}`"),
            "choose another setting: a number has no age, and several transitions change it one after the other",
        );
    }
    check_body(lowering, source);
    let step = &mut lowering.net.steps[id];
    step.hidden = true;
    step.is_initial = true;
    let (full, meta) = (step.name.clone(), step.meta.clone());
    let var = lowering.net.vars.push(Var {
        name: full,
        ty: Type::Int { lo: 0, hi: i64::from(most) },
        len: None,
        init: vec![i64::from(at_reset)],
        origin: VarOrigin::Declared,
        meta,
    });
    lowering.counted.insert(id, var);
}

/// A counted step can only drive outputs.
fn check_body(lowering: &mut Lowering<'_>, source: &chart::Step) {
    let name = &source.name;
    for item in &source.body {
        let what = match &item.kind {
            StepItemKind::Action { how, .. } => match how {
                chart::ActionHow::After(_) | chart::ActionHow::For(_) => Some("a time"),
                chart::ActionHow::Bare | chart::ActionHow::Qualified(..) => None,
            },
            StepItemKind::Entry(_) => Some("an entry list"),
            StepItemKind::Exit(_) => Some("an exit list"),
            StepItemKind::On { .. } => Some("a reaction"),
            StepItemKind::Priority(_) => Some("a priority"),
            StepItemKind::Budget(_) | StepItemKind::Task { .. } => Some("tasks"),
            StepItemKind::Code(_) => Some("verbatim text"),
            StepItemKind::Force { .. } => Some("a forcing order"),
        };
        if let Some(what) = what {
            refuse(
                lowering,
                item.span,
                format!("{what} is not allowed in the counted step `{name}`"),
                "a counted step can only drive outputs; move the rest to a plain step",
            );
        }
    }
}

fn refuse(lowering: &mut Lowering<'_>, span: Span, message: String, help: &str) {
    lowering.report(Diagnostic::error(codes::COUNTED, message).at(span, "").help(help));
}

/// The condition `p > 0`: the counted step is active.
pub(super) fn is_active<L: Copy>(var: VarId, span: Span, leaf: impl Fn(Leaf) -> L) -> Expr<L> {
    let zero = Expr::new(ExprKind::Int(0), span);
    Expr::compare(CompareOp::Gt, Expr::leaf(leaf(Leaf::Var(var)), span), zero)
}

/// The conditions for the counted steps among the sources of a transition.
pub(super) fn conditions(
    lowering: &Lowering<'_>,
    requires: &[StepId],
    span: Span,
) -> Vec<Expr<Leaf>> {
    let vars = requires.iter().filter_map(|step| lowering.counted.get(step));
    vars.map(|var| is_active(*var, span, |leaf| leaf)).collect()
}

/// The changes of a transition to the numbers of its counted steps, before its own actions: decrements come first.
pub(super) fn changes(
    lowering: &Lowering<'_>,
    requires: &[StepId],
    enters: &[StepId],
    span: Span,
) -> Vec<Stmt> {
    let change = |op: ArithOp| {
        move |var: &VarId| {
            let now = Expr::leaf(Leaf::Var(*var), span);
            let one = Expr::new(ExprKind::Int(1), span);
            let value = Expr::new(ExprKind::Arith(op, Box::new(now), Box::new(one)), span);
            Stmt { kind: StmtKind::Assign { var: *var, index: None, value }, span }
        }
    };
    let taken = requires.iter().filter_map(|step| lowering.counted.get(step));
    let added = enters.iter().filter_map(|step| lowering.counted.get(step));
    taken.map(change(ArithOp::Sub)).chain(added.map(change(ArithOp::Add))).collect()
}

/// Reports the use of the time of a counted step, which has none.
pub(super) fn no_time(lowering: &mut Lowering<'_>, step: StepId, span: Span) {
    let name = lowering.net.steps[step].name.text.clone();
    refuse(
        lowering,
        span,
        format!("the counted step `{name}` has no time of activation"),
        "write `timer T while NAME.active` to measure the time since its number became positive",
    );
}
