//! Turns comments and statements into labels of a chart.

use super::ast::{Expr, ExprKind};

/// A comment without its delimiters, on one line.
pub(super) fn comment_text(comment: &str) -> String {
    let inner = comment.strip_prefix("/*").map_or_else(
        || comment.trim_start_matches('/'),
        |rest| rest.strip_suffix("*/").unwrap_or(rest),
    );
    let lines = inner.lines().map(|line| line.trim().trim_start_matches('*').trim());
    lines.filter(|line| !line.is_empty()).collect::<Vec<_>>().join(" ")
}

/// A text on one line, at most 200 characters; blanks and comments become single blanks.
pub(super) fn one_line(text: &str) -> String {
    let mut without = String::new();
    let mut rest = text;
    while let Some(at) = rest.find("/*").into_iter().chain(rest.find("//")).min() {
        // Comment signs inside a string count as a comment too; this only shortens the label.
        without.push_str(&rest[..at]);
        without.push(' ');
        let comment = &rest[at..];
        let length = if comment.starts_with("/*") {
            comment.find("*/").map(|end| end + 2)
        } else {
            comment.find('\n')
        };
        rest = &comment[length.unwrap_or(comment.len())..];
    }
    without.push_str(rest);
    let line = without.split_whitespace().collect::<Vec<_>>().join(" ");
    if line.chars().count() > 200 { line.chars().take(199).chain(['…']).collect() } else { line }
}

/// A name for the step of an expression statement, as in the appendix of NBS88: `set_n`, `inc_i`, `do_f`.
pub(super) fn hint(expr: &Expr) -> String {
    let target = |expr: &Expr| {
        let mut expr = expr;
        loop {
            if let ExprKind::Index(inner, _) | ExprKind::Deref(inner) = &expr.kind {
                expr = inner;
            } else if let ExprKind::Name(name) = &expr.kind {
                return name.clone();
            } else {
                return "value".to_owned();
            }
        }
    };
    if let ExprKind::Assign(_, left, _) = &expr.kind {
        format!("set_{}", target(left))
    } else if let ExprKind::Step { operand, by, .. } = &expr.kind {
        format!("{}_{}", if *by > 0 { "inc" } else { "dec" }, target(operand))
    } else if let ExprKind::Call(name, _) = &expr.kind {
        format!("do_{name}")
    } else if let ExprKind::Comma(all) = &expr.kind {
        all.last().map_or_else(|| "eval".to_owned(), hint)
    } else if let ExprKind::Cast(_, inner) = &expr.kind {
        hint(inner)
    } else {
        "eval".to_owned()
    }
}
