//! What a drawing contains beyond the standard of its style, for the legend.

use crate::Style;
use grafsynth_ir::chart::{Expr, Leaf, Stmt, StmtKind, statements};
use grafsynth_ir::expr::ExprKind;
use std::collections::BTreeSet;

/// Notation that is not part of the standard.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Foreign {
    Qualifier,
    Otherwise,
    Priority,
    Reaction,
    Task,
    Code,
    Count,
    Restart,
    Deadline,
    Library,
    Words,
    Timer,
    NamedList,
    Emergency,
    Macro,
    Enclosing,
    Forcing,
    Open,
    OnFiring,
    Condition,
    StepTime,
    Edge,
    Delay,
    Bits,
    Statement,
}

impl Foreign {
    pub(crate) fn meaning(self) -> &'static str {
        match self {
            Foreign::Qualifier => "N, R, S, P, L, D, SD, DS, SL: action block of IEC 61131-3",
            Foreign::Otherwise => "otherwise: no earlier transition from the same step is fireable",
            Foreign::Priority => "priority n: rank in conflicts, 1 first",
            Foreign::Reaction => "on: runs while the step is active and the condition is true",
            Foreign::Task => {
                "task: work of the step that is not interrupted; budget: work per reaction"
            }
            Foreign::Code => "code: code in a target language",
            Foreign::Count => "count: counted step, which contains the number of its activations",
            Foreign::Restart => {
                "restart: a step that is left and entered at once is activated anew"
            }
            Foreign::Deadline => {
                "deadline: the longest time from a change of the inputs to the outputs"
            }
            Foreign::Library => "a named box with `name : chart`: an instance of a library chart",
            Foreign::Words => "and, or, not, …: the words of the chart language",
            Foreign::Timer => "timer: the time for which a condition has been true",
            Foreign::NamedList => "action: a named list of statements that steps use",
            Foreign::Emergency => "emergency: while true, all outputs have their safe values",
            Foreign::Macro => "M: macro-step of IEC 60848, with entry step E and exit step S",
            Foreign::Enclosing => {
                "cut corners: enclosing step of IEC 60848; *: a step that it activates"
            }
            Foreign::Forcing => "force: the chart has this situation while the step is active",
            Foreign::Open => {
                "a transition without a step above or below it; a step of another chart"
            }
            Foreign::OnFiring => "box at a transition: runs when the transition fires",
            Foreign::Condition => "IF in an action: performed only while the condition is true",
            Foreign::StepTime => "D, L: here the time since the activation of the step",
            Foreign::Edge => "R_TRIG(a), F_TRIG(a): a becomes true, false",
            Foreign::Delay => {
                "T#3s/a/T#2s: a, delayed when it becomes true / when it becomes false"
            }
            Foreign::Bits => "band, bor, bxor, bnot, shl, shr: operators on bits of integers",
            Foreign::Statement => "raise, send, cancel, call: statements of the chart language",
        }
    }

    /// True for what is only found in structured text.
    pub(crate) fn is_in_text(self) -> bool {
        self >= Foreign::Edge
    }

    /// True if the standard of the style does not have this notation.
    pub(crate) fn is_missing_in(self, style: Style) -> bool {
        match style {
            Style::Grafcet => self < Foreign::Macro,
            Style::Sfc => !matches!(self, Foreign::Qualifier | Foreign::NamedList),
        }
    }
}

/// Adds what structured text lacks in an expression.
pub(crate) fn note_expr(found: &mut BTreeSet<Foreign>, expr: &Expr) {
    for part in expr.subexpressions() {
        match &part.kind {
            ExprKind::Arith(op, ..) if op.is_bitwise() || op.is_shift() => {
                found.insert(Foreign::Bits);
            }
            ExprKind::Leaf(Leaf::Rise(inner) | Leaf::Fall(inner)) => {
                found.insert(Foreign::Edge);
                note_expr(found, inner);
            }
            ExprKind::Leaf(Leaf::Delay(_, inner, _)) => {
                found.insert(Foreign::Delay);
                note_expr(found, inner);
            }
            _ => {}
        }
    }
}

/// Adds what structured text lacks in a list of statements.
pub(crate) fn note_list(found: &mut BTreeSet<Foreign>, list: &[Stmt]) {
    for stmt in statements(list) {
        stmt.exprs().for_each(|expr| note_expr(found, expr));
        match &stmt.kind {
            StmtKind::Assign { .. } | StmtKind::If { .. } => {}
            StmtKind::Code(_) => drop(found.insert(Foreign::Code)),
            _ => drop(found.insert(Foreign::Statement)),
        }
    }
}
