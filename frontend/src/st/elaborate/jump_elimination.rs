//! Replaces EXIT, CONTINUE and RETURN by flags: charts have no jumps.
//!
//! Statements after a statement that may jump run only if a flag is false:
//!
//! ```text
//! FOR i := 0 TO 9 DO             each time:    IF NOT found THEN
//!     IF a[i] = x THEN EXIT;                       IF a[i] = x THEN found := TRUE; i := 3; END_IF;
//!     END_IF;                                  END_IF;
//!     n := n + a[i];                           IF NOT found THEN n := n + a[3]; END_IF;
//! END_FOR;                       at the end:   IF NOT found THEN i := 10; END_IF; found := FALSE;
//! ```
//! A flag is false between scans, so it needs no register in a circuit. RETURN in a loop first leaves all loops. If every branch except one
//! ends in RETURN, the following statements move into that branch, and no flag is needed.

use grafsynth_ir::Span;

use super::context::{Elaborator, Outcome};
use crate::st::ast::{Expr, ExprKind, Flag, Stmt, StmtKind};
use crate::st::symbol::Ident;

/// Maximum number of consecutive IFs with RETURN that are nested instead of guarded by a flag.
const MAX_NESTED: usize = 8;

/// The statements that leave a list: RETURN, EXIT and CONTINUE.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Leaves {
    /// Leaves the unit.
    Return,
    /// Leaves the innermost loop.
    Exit,
    /// Leaves the current iteration of the innermost loop.
    Continue,
}

/// Whether a list contains such a statement. Searches inside loops only if the statement leaves them too.
pub(super) fn has(list: &[Stmt], what: Leaves) -> bool {
    list.iter().any(|stmt| has_one(stmt, what))
}

fn has_one(stmt: &Stmt, what: Leaves) -> bool {
    match &stmt.kind {
        StmtKind::Return => what == Leaves::Return,
        StmtKind::Exit => what == Leaves::Exit,
        StmtKind::Continue => what == Leaves::Continue,
        kind @ (StmtKind::If { .. } | StmtKind::Case { .. }) => {
            kind.lists().any(|list| has(list, what))
        }
        StmtKind::For { body, .. }
        | StmtKind::While { body, .. }
        | StmtKind::Repeat { body, .. } => what == Leaves::Return && has(body, what),
        StmtKind::Assign { .. } | StmtKind::Call { .. } | StmtKind::Refused(_) => false,
    }
}

fn read(flag: Flag, span: Span) -> Expr {
    Expr::new(ExprKind::Flag(flag), span)
}

fn raise(flag: Flag, span: Span) -> Stmt {
    let value = Expr::new(ExprKind::Bool(true), span);
    Stmt { kind: StmtKind::Assign { target: read(flag, span), value }, span }
}

fn unless(flags: &[Flag], list: Vec<Stmt>, span: Span) -> Stmt {
    let free = |flag: &Flag| Expr::new(ExprKind::Not(Box::new(read(*flag, span))), span);
    let condition = Expr::new(ExprKind::And(flags.iter().map(free).collect()), span);
    Stmt { kind: StmtKind::If { arms: vec![(condition, list)], otherwise: Vec::new() }, span }
}

/// The flags in a condition that [`round`] or [`returned`] made; `None` for other conditions.
pub(super) fn guards(condition: &Expr) -> Option<Vec<Flag>> {
    let ExprKind::And(all) = &condition.kind else { return None };
    let flag = |one: &Expr| {
        if let ExprKind::Not(inner) = &one.kind
            && let ExprKind::Flag(flag) = inner.kind
        {
            return Some(flag);
        }
        None
    };
    all.iter().map(flag).collect()
}

/// Replaces jumps in a list by flags. `replace` returns the replacement of a jump; `flags` are the flags that suppress the statements after
/// it.
fn cut(
    list: &[Stmt],
    leaves: &dyn Fn(&Stmt) -> bool,
    replace: &dyn Fn(&Stmt) -> Option<Vec<Stmt>>,
    flags: &[Flag],
) -> Vec<Stmt> {
    let mut out = Vec::new();
    let mut segment: Vec<Stmt> = Vec::new();
    let mut is_guarded = false;
    for stmt in list {
        if !leaves(stmt) {
            segment.push(stmt.clone());
            continue;
        }
        let inside = |list: &[Stmt]| cut(list, leaves, replace, flags);
        let is_end = match (replace(stmt), &stmt.kind) {
            (Some(instead), _) => {
                segment.extend(instead);
                matches!(stmt.kind, StmtKind::Return | StmtKind::Exit | StmtKind::Continue)
            }
            (None, StmtKind::If { arms, otherwise }) => {
                let arms = arms.iter().map(|(test, list)| (test.clone(), inside(list))).collect();
                let kind = StmtKind::If { arms, otherwise: inside(otherwise) };
                segment.push(Stmt { kind, span: stmt.span });
                false
            }
            (None, StmtKind::Case { selector, arms, otherwise }) => {
                let arms = arms.iter().map(|(test, list)| (test.clone(), inside(list))).collect();
                let (selector, otherwise) = (selector.clone(), inside(otherwise));
                let kind = StmtKind::Case { selector, arms, otherwise };
                segment.push(Stmt { kind, span: stmt.span });
                false
            }
            // Loops without a bound are refused in any case.
            (None, _) => {
                segment.push(stmt.clone());
                false
            }
        };
        flush(&mut out, &mut segment, is_guarded, flags, stmt.span);
        is_guarded = true;
        if is_end {
            return out;
        }
    }
    let span = list.last().map_or(Span::default(), |stmt| stmt.span);
    flush(&mut out, &mut segment, is_guarded, flags, span);
    out
}

fn flush(
    out: &mut Vec<Stmt>,
    segment: &mut Vec<Stmt>,
    is_guarded: bool,
    flags: &[Flag],
    span: Span,
) {
    let list = std::mem::take(segment);
    if list.is_empty() {
        return;
    }
    if is_guarded {
        out.push(unless(flags, list, span));
    } else {
        out.extend(list);
    }
}

/// The body of a loop over `var` without EXIT and CONTINUE. EXIT sets [`Flag::Left`] and CONTINUE sets [`Flag::Skipped`]. EXIT also
/// assigns the current value of the loop variable to [`Flag::Variable`].
pub(super) fn round(body: &[Stmt], var: &Ident) -> Vec<Stmt> {
    let (exits, skips) = (has(body, Leaves::Exit), has(body, Leaves::Continue));
    if !exits && !skips {
        return body.to_vec();
    }
    let mut flags = Vec::new();
    if exits {
        flags.push(Flag::Left);
    }
    if skips {
        flags.push(Flag::Skipped);
    }
    let leaves = |stmt: &Stmt| has_one(stmt, Leaves::Exit) || has_one(stmt, Leaves::Continue);
    let replace = |stmt: &Stmt| {
        let span = stmt.span;
        if stmt.kind == StmtKind::Continue {
            return Some(vec![raise(Flag::Skipped, span)]);
        }
        let (target, value) = (read(Flag::Variable, span), Expr::name(var.clone()));
        let keep = Stmt { kind: StmtKind::Assign { target, value }, span };
        (stmt.kind == StmtKind::Exit).then(|| vec![raise(Flag::Left, span), keep])
    };
    let list = cut(body, &leaves, &replace, &flags);
    if exits { vec![unless(&[Flag::Left], list, var.span)] } else { list }
}

/// A list in which RETURN sets [`Flag::Returned`] and leaves all loops.
pub(super) fn returned(list: &[Stmt]) -> Vec<Stmt> {
    let leaves = |stmt: &Stmt| has_one(stmt, Leaves::Return);
    let replace = |stmt: &Stmt| {
        if stmt.kind == StmtKind::Return {
            return Some(vec![raise(Flag::Returned, stmt.span)]);
        }
        let StmtKind::For { var, from, to, by, body } = &stmt.kind else { return None };
        let body = out_of_loop(body);
        let (var, from, to, by) = (var.clone(), from.clone(), to.clone(), by.clone());
        let kind = StmtKind::For { var, from, to, by, body };
        Some(vec![Stmt { kind, span: stmt.span }])
    };
    cut(list, &leaves, &replace, &[Flag::Returned])
}

/// The body of a loop in which RETURN becomes EXIT with a flag; if RETURN leaves an inner loop, this loop is left too.
fn out_of_loop(body: &[Stmt]) -> Vec<Stmt> {
    let mut out = Vec::new();
    for stmt in body {
        let span = stmt.span;
        let leave = Stmt { kind: StmtKind::Exit, span };
        match &stmt.kind {
            StmtKind::Return => out.extend([raise(Flag::Returned, span), leave]),
            StmtKind::If { arms, otherwise } => {
                let arms =
                    arms.iter().map(|(test, list)| (test.clone(), out_of_loop(list))).collect();
                let kind = StmtKind::If { arms, otherwise: out_of_loop(otherwise) };
                out.push(Stmt { kind, span });
            }
            StmtKind::Case { selector, arms, otherwise } => {
                let arms =
                    arms.iter().map(|(test, list)| (test.clone(), out_of_loop(list))).collect();
                let (selector, otherwise) = (selector.clone(), out_of_loop(otherwise));
                out.push(Stmt { kind: StmtKind::Case { selector, arms, otherwise }, span });
            }
            StmtKind::For { var, from, to, by, body } if has(body, Leaves::Return) => {
                let body = out_of_loop(body);
                let (var, from, to, by) = (var.clone(), from.clone(), to.clone(), by.clone());
                out.push(Stmt { kind: StmtKind::For { var, from, to, by, body }, span });
                let arms = vec![(read(Flag::Returned, span), vec![leave])];
                out.push(Stmt { kind: StmtKind::If { arms, otherwise: Vec::new() }, span });
            }
            _ => out.push(stmt.clone()),
        }
    }
    out
}

/// The same list without RETURN and without a flag; `None` if this would duplicate statements or nest too deeply.
pub(super) fn nested(list: &[Stmt], depth: usize) -> Option<Vec<Stmt>> {
    let Some(at) = list.iter().position(|stmt| has_one(stmt, Leaves::Return)) else {
        return Some(list.to_vec());
    };
    let mut out = list[..at].to_vec();
    let (stmt, rest) = (&list[at], &list[at + 1..]);
    if stmt.kind == StmtKind::Return {
        return Some(out);
    }
    let StmtKind::If { arms, otherwise } = &stmt.kind else { return None };
    if depth >= MAX_NESTED {
        return None;
    }
    let mut n_open = 0;
    let mut made = Vec::new();
    for branch in arms.iter().map(|(_, list)| list).chain([otherwise]) {
        let is_left = branch.last().is_some_and(|last| last.kind == StmtKind::Return);
        let body = if is_left { &branch[..branch.len() - 1] } else { branch };
        if has(body, Leaves::Return) {
            return None;
        }
        let mut body = body.to_vec();
        if !is_left {
            n_open += 1;
            body.extend(nested(rest, depth + 1)?);
        }
        made.push(body);
    }
    if n_open > 1 {
        return None;
    }
    let otherwise = made.pop().unwrap_or_default();
    let arms = arms.iter().map(|(test, _)| test.clone()).zip(made).collect();
    out.push(Stmt { kind: StmtKind::If { arms, otherwise }, span: stmt.span });
    Some(out)
}

impl Elaborator<'_> {
    /// The same list without RETURN, and whether it needs the flag [`Flag::Returned`].
    pub(super) fn without_returns(
        &mut self,
        list: &[Stmt],
        span: Span,
    ) -> Outcome<(Vec<Stmt>, bool)> {
        if !has(list, Leaves::Return) {
            return Ok((list.to_vec(), false));
        }
        if let Some(list) = nested(list, 0) {
            return Ok((list, false));
        }
        self.spend(span, 1)?;
        Ok((returned(list), true))
    }
}
