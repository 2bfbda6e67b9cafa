//! The standard function blocks: structured text (`prelude.st`) that is read once and expanded like the function blocks of a user.
//!
//! ```text
//! t(IN := e, PT := T#3s)      t.IN := e;  t.Q := t.IN and t.ET >= 3 s      timer t.ET while t.IN
//! ```
//! The free timer starts in the scan in which `t.IN` becomes true. In each later scan, the time of the scan is added at the beginning
//! (semantics §7), so the timer equals a clock that is read at each call.

use std::sync::LazyLock;

use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::{FileId, Span};

use super::types::{INTEGERS, WIDEST};
use crate::findings::Findings;
use crate::graf::Limits;
use crate::st::ast::{Expr, ExprKind, Init, Pou, TypeKind, Var};
use crate::st::lexer::Places;
use crate::st::parse::Parser;
use crate::st::symbol::Ident;

/// The inputs of standard blocks that have two names: pairs of the second name and the main name.
const SECOND_NAMES: [(&str, &str); 5] =
    [("RESET", "R"), ("LOAD", "LD"), ("SET1", "S1"), ("SET", "S"), ("RESET1", "R1")];

static BLOCKS: LazyLock<Vec<Pou>> = LazyLock::new(|| read().0.iter().flat_map(named).collect());

/// All standard blocks.
pub(super) fn blocks() -> &'static [Pou] {
    &BLOCKS
}

/// The standard block with this name, which is in capitals.
pub(crate) fn block(name: &str) -> Option<&'static Pou> {
    blocks().iter().find(|pou| pou.name.id == *name)
}

/// The second name of an input of a standard block, if it has one. Both are in capitals.
pub(super) fn second_name(input: &str) -> Option<&'static str> {
    SECOND_NAMES.iter().find(|(_, main)| *main == input).map(|(second, _)| *second)
}

/// The operands of a declaration with ELAPSED: the variable that must be true, and the upper limit.
pub(super) fn clock(var: &Var) -> Option<(&Ident, Option<&Ident>)> {
    let Some(Init::Value(Expr { kind: ExprKind::Call(name, arguments), .. })) = &var.init else {
        return None;
    };
    let mut operands = arguments.iter().map(|one| one.value.root());
    let running = operands.next()??;
    (name.text == "ELAPSED").then_some((running, operands.next().flatten()))
}

fn read() -> (Vec<Pou>, Vec<Diagnostic>) {
    let limits = Limits::default();
    let mut findings = Findings { kept: Vec::new(), limit: limits.diagnostics, rest: 0 };
    let places = Places::Direct(FileId(0));
    let text = include_str!("prelude.st");
    let library = Parser::new(text, places, &mut findings, limits.nesting).library();
    (library.pous, findings.kept)
}

/// Copies of a block, one for each of its names: a counter has one for each integer type.
fn named(pou: &Pou) -> Vec<Pou> {
    let typed = |suffix: &str| {
        let name = Ident::new(format!("{}{suffix}", pou.name), pou.name.span);
        Pou { name, ..pou.clone() }
    };
    if pou.vars.iter().any(|var| clock(var).is_some()) {
        return vec![pou.clone(), typed("_TIME")];
    }
    if !pou.vars.iter().any(is_count) {
        return vec![pou.clone()];
    }
    let counters = INTEGERS.iter().flat_map(|(ty, lo, hi)| {
        let (lo, hi) = ((*lo).max(WIDEST.0), (*hi).min(WIDEST.1));
        let plain = (*ty == "INT").then(|| counter(pou.clone(), lo, hi));
        plain.into_iter().chain([counter(typed(&format!("_{ty}")), lo, hi)])
    });
    counters.collect()
}

fn is_count(var: &Var) -> bool {
    var.ty.is_named("COUNT")
}

fn counter(mut pou: Pou, lo: i64, hi: i64) -> Pou {
    let int = |value| Expr::new(ExprKind::Int(value), Span::default());
    for var in pou.vars.iter_mut().filter(|var| is_count(var)) {
        var.ty.kind =
            TypeKind::Subrange(Ident::new("LINT", var.ty.span), Box::new((int(lo), int(hi))));
        if var.is_constant {
            var.init = Some(Init::Value(int(if var.name.text == "LEAST" { lo } else { hi })));
        }
    }
    pou
}

#[cfg(test)]
mod tests {
    use super::{block, read};

    #[test]
    fn the_prelude_has_no_findings() {
        assert_eq!(read().1, Vec::new());
        for name in ["TON", "TP_TIME", "CTU", "CTUD_ULINT", "R_TRIG", "RS"] {
            assert!(block(name).is_some_and(|pou| pou.refused.is_empty()), "{name}");
        }
    }
}
