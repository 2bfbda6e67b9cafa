//! Constructors for charts that are built by hand, one line for each item.

use crate::chart::*;
use crate::diag::Diagnostic;
use crate::expr::{ArithOp, CompareOp, ExprKind, Type};
use crate::lower::lower;
use crate::net::{self, Meta};
use crate::span::{FileId, Name, Span};
use std::sync::atomic::{AtomicUsize, Ordering};

/// Each call returns a different location, as a real source does.
pub(super) fn span() -> Span {
    static NEXT: AtomicUsize = AtomicUsize::new(0);
    let start = NEXT.fetch_add(1, Ordering::Relaxed);
    Span::new(FileId(0), start, start + 1)
}

pub(super) fn name(text: &str) -> Name {
    Name::new(text, span())
}

pub(super) fn path(text: &str) -> Path {
    Path { names: text.split('.').map(name).collect() }
}

pub(super) fn meta() -> Meta {
    Meta { span: span(), ..Meta::default() }
}

pub(super) fn e(kind: ExprKind<Leaf>) -> Expr {
    Expr::new(kind, span())
}

/// A name, `true`, `false`, a number, or a duration such as `3s` or `25ms`.
pub(super) fn v(text: &str) -> Expr {
    let duration = |suffix: &str, unit: u64| {
        text.strip_suffix(suffix).and_then(|n| n.parse::<u64>().ok()).map(|n| n * unit)
    };
    if let Ok(number) = text.parse::<i64>() {
        return e(ExprKind::Int(number));
    }
    if let Some(ns) = duration("ms", 1_000_000).or_else(|| duration("s", 1_000_000_000)) {
        return e(ExprKind::Leaf(Leaf::Duration(ns)));
    }
    match text {
        "true" => e(ExprKind::Bool(true)),
        "false" => e(ExprKind::Bool(false)),
        "otherwise" => e(ExprKind::Leaf(Leaf::Otherwise)),
        _ => e(ExprKind::Leaf(Leaf::Name(path(text)))),
    }
}

pub(super) fn not(a: Expr) -> Expr {
    e(ExprKind::Not(Box::new(a)))
}
pub(super) fn and(all: Vec<Expr>) -> Expr {
    e(ExprKind::And(all))
}
pub(super) fn or(all: Vec<Expr>) -> Expr {
    e(ExprKind::Or(all))
}
pub(super) fn ge(a: &str, b: &str) -> Expr {
    e(ExprKind::Compare(CompareOp::Ge, Box::new(v(a)), Box::new(v(b))))
}
pub(super) fn lt(a: &str, b: &str) -> Expr {
    e(ExprKind::Compare(CompareOp::Lt, Box::new(v(a)), Box::new(v(b))))
}
pub(super) fn plus(a: Expr, b: Expr) -> Expr {
    e(ExprKind::Arith(ArithOp::Add, Box::new(a), Box::new(b)))
}
pub(super) fn rise(a: Expr) -> Expr {
    e(ExprKind::Leaf(Leaf::Rise(Box::new(a))))
}
pub(super) fn element(array: &str, index: Expr) -> Expr {
    e(ExprKind::Element(Leaf::Name(path(array)), Box::new(index)))
}
pub(super) fn delay(on_ms: u64, a: Expr, off_ms: u64) -> Expr {
    e(ExprKind::Leaf(Leaf::Delay(on_ms * 1_000_000, Box::new(a), off_ms * 1_000_000)))
}

pub(super) fn declare(text: &str, kind: DeclarationKind) -> Item {
    Item::Declaration(Declaration { name: name(text), kind, meta: meta() })
}
pub(super) fn inputs(names: &str) -> Vec<Item> {
    let input = |text| declare(text, DeclarationKind::Input { ty: Type::Bool, synchronous: false });
    names.split_whitespace().map(input).collect()
}
pub(super) fn output(text: &str) -> Item {
    output_of(text, Type::Bool, false)
}
pub(super) fn output_of(text: &str, ty: Type, mealy: bool) -> Item {
    declare(text, DeclarationKind::Output { ty, init: None, registered: false, mealy, safe: None })
}
pub(super) fn int(lo: i64, hi: i64) -> Type {
    Type::Int { lo, hi }
}
pub(super) fn var(text: &str, ty: Type) -> Item {
    declare(text, DeclarationKind::Var { ty, len: None, init: vec![] })
}
pub(super) fn event(text: &str) -> Item {
    declare(text, DeclarationKind::Event { internal: false })
}
pub(super) fn constant(text: &str, value: Expr) -> Item {
    declare(text, DeclarationKind::Const { value })
}
pub(super) fn setting(kind: SettingKind) -> Item {
    Item::Setting(Setting { kind, span: span() })
}
pub(super) fn single() -> Item {
    setting(SettingKind::EvolutionSingle)
}
pub(super) fn conflict(policy: net::Policy) -> Item {
    setting(SettingKind::Conflict(policy))
}

pub(super) fn item(kind: StepItemKind) -> StepItem {
    StepItem { kind, span: span() }
}
pub(super) fn action(target: &str) -> StepItem {
    act(target, ActionHow::Bare, None)
}
pub(super) fn act(target: &str, how: ActionHow, condition: Option<Expr>) -> StepItem {
    item(StepItemKind::Action { target: name(target), arguments: None, how, condition })
}
pub(super) fn call_of(target: &str, arguments: Vec<Expr>) -> StepItem {
    let arguments = Some(arguments);
    item(StepItemKind::Action {
        target: name(target),
        arguments,
        how: ActionHow::Bare,
        condition: None,
    })
}
pub(super) fn step_of(text: &str, role: StepRole, body: Vec<StepItem>) -> Item {
    Item::Step(Step { name: name(text), role, body, meta: meta(), ..Step::default() })
}
pub(super) fn step(text: &str, body: Vec<StepItem>) -> Item {
    step_of(text, StepRole::Plain, body)
}
pub(super) fn initial(text: &str, body: Vec<StepItem>) -> Item {
    step_of(text, StepRole::Initial, body)
}
pub(super) fn stmt(kind: StmtKind) -> Stmt {
    Stmt { kind, span: span() }
}
pub(super) fn assign(target: &str, value: Expr) -> Stmt {
    stmt(StmtKind::Assign { target: path(target), index: None, value })
}

/// `a & b -> c` with a condition.
pub(super) fn arrow(text: &str, guard: Option<Expr>) -> Transition {
    let (from, to) = text.split_once("->").expect("an arrow");
    let side = |text: &str| {
        text.split('&').map(str::trim).filter(|text| !text.is_empty()).map(path).collect()
    };
    Transition {
        sources: side(from),
        targets: side(to),
        guard,
        meta: meta(),
        ..Transition::default()
    }
}
pub(super) fn go(text: &str, guard: Expr) -> Item {
    Item::Transition(arrow(text, Some(guard)))
}
pub(super) fn named(text: &str, arrow_text: &str, guard: Expr) -> Item {
    Item::Transition(Transition { name: Some(name(text)), ..arrow(arrow_text, Some(guard)) })
}
pub(super) fn macro_of(text: &str, items: Vec<Item>) -> Item {
    Item::Macro(Macro { name: name(text), items, meta: meta() })
}
pub(super) fn macro_step(text: &str, body: &str) -> Item {
    Item::MacroStep(MacroStep {
        name: name(text),
        body: name(body),
        meta: meta(),
        ..MacroStep::default()
    })
}
pub(super) fn assert_never(expr: Expr) -> Property {
    Property { name: None, is_assumption: false, is_never: true, expr, meta: meta() }
}

pub(super) fn chart(text: &str, items: Vec<Vec<Item>>) -> Chart {
    Chart {
        name: name(text),
        span: span(),
        items: items.into_iter().flatten().collect(),
        meta: meta(),
        ..Chart::default()
    }
}
pub(super) fn design(charts: Vec<Chart>) -> Design {
    Design { charts, ..Design::default() }
}

/// Code and message of each finding.
pub(super) fn told(findings: &[Diagnostic]) -> Vec<String> {
    findings.iter().map(|one| format!("{} {}", one.code.id, one.message)).collect()
}

/// The net of one chart without any findings.
pub(super) fn clean(items: Vec<Vec<Item>>) -> net::Net {
    let (net, findings) = lower(&design(vec![chart("c", items)]));
    assert_eq!(told(&findings), Vec::<String>::new());
    net.expect("no finding is an error").into_inner()
}

/// All findings for one chart.
pub(super) fn findings(items: Vec<Vec<Item>>) -> Vec<String> {
    told(&lower(&design(vec![chart("c", items)])).1)
}
