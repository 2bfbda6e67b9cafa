//! Unsequenced side effects: `i = i++` and `v[i] = i++` are undefined (C99 6.5), so no chart can have the same behaviour.

use super::ast::{Expr, ExprKind};
use crate::codes;
use crate::findings::Findings;
use grafsynth_ir::Span;
use grafsynth_ir::diag::Diagnostic;
use std::collections::BTreeMap;

/// Variables that a part of an expression reads, and those that its side effects write, with a span.
#[derive(Default)]
struct Effects {
    reads: BTreeMap<String, Span>,
    writes: BTreeMap<String, Span>,
}

impl Effects {
    fn add(&mut self, other: Effects) {
        self.reads.extend(other.reads);
        self.writes.extend(other.writes);
    }
}

/// Reports two accesses of an expression to one variable if C defines no order between them.
pub(super) fn check(expr: &Expr, findings: &mut Findings) {
    effects(expr, findings);
}

/// The effects of operands without a defined order; reports conflicting accesses.
fn unordered(operands: &[&Expr], findings: &mut Findings) -> Effects {
    let mut all = Effects::default();
    for operand in operands {
        let next = effects(operand, findings);
        let clash = next
            .writes
            .iter()
            .find_map(|(name, span)| {
                all.reads
                    .get(name)
                    .or_else(|| all.writes.get(name))
                    .map(|earlier| (name, *earlier, *span))
            })
            .or_else(|| {
                next.reads.iter().find_map(|(name, span)| {
                    all.writes.get(name).map(|earlier| (name, *span, *earlier))
                })
            });
        if let Some((name, other, written)) = clash {
            report(name, written, other, findings);
        }
        all.add(next);
    }
    all
}

fn report(name: &str, written: Span, other: Span, findings: &mut Findings) {
    findings.report(|| {
        Diagnostic::error(
            codes::C_UNSEQUENCED,
            format!("one expression changes `{name}` and uses it again, in an undefined order"),
        )
        .at(written, "changed here")
        .at(other, "used here")
        .help("split the expression into two statements")
    });
}

/// The name of an assignment target that is a plain variable.
fn target(expr: &Expr) -> Option<&str> {
    if let ExprKind::Name(name) = &expr.kind { Some(name) } else { None }
}

fn effects(expr: &Expr, findings: &mut Findings) -> Effects {
    let mut found = Effects::default();
    match &expr.kind {
        ExprKind::Name(name) => {
            found.reads.insert(name.clone(), expr.span);
        }
        ExprKind::Sizeof(_) => {}
        ExprKind::Index(..) | ExprKind::Binary(..) | ExprKind::Call(..) | ExprKind::Opaque(_) => {
            found = unordered(&expr.operands(), findings);
        }
        ExprKind::Step { operand, .. } => match target(operand) {
            Some(name) => {
                found.writes.insert(name.to_owned(), expr.span);
            }
            None => found = effects(operand, findings),
        },
        ExprKind::Assign(op, left, right) => match target(left) {
            Some(name) => {
                found = effects(right, findings);
                // `n = n + 1` reads before it writes. A side effect on n inside the right side has no defined order relative to this write.
                if let Some(written) = found.writes.get(name) {
                    report(name, *written, expr.span, findings);
                }
                found.reads.remove(name);
                if op.is_some() {
                    found.reads.remove(name);
                }
                found.writes.insert(name.to_owned(), left.span);
            }
            None => found = unordered(&[left, right], findings),
        },
        // These have an order, or at most one operand.
        _ => {
            for operand in expr.operands() {
                found.add(effects(operand, findings));
            }
        }
    }
    found
}
