//! Warnings about valid text that is probably a mistake: overwritten assignments, and function blocks that are never called.

use grafsynth_ir::Gather;
use std::collections::{BTreeMap, BTreeSet};

use grafsynth_ir::Span;
use grafsynth_ir::diag::Diagnostic;

use super::ast::{Arg, Body, Element, Expr, ExprKind, Library, Part, Pou, Section, Stmt, StmtKind};
use super::elaborate::standard_block;
use super::symbol::{Ident, Symbol};
use crate::codes;

/// All warnings for the units of a library.
pub(super) fn lints(library: &Library) -> Vec<Diagnostic> {
    let mut out = Vec::new();
    for pou in &library.pous {
        let lists = pou.lists();
        // Variables that other names may refer to.
        let aliases: BTreeSet<Symbol> = pou
            .vars
            .iter()
            .filter(|var| {
                var.section == Section::InOut
                    || var.address.as_ref().is_some_and(|it| it.id.starts_with("%M"))
            })
            .map(|var| var.name.id.clone())
            .gather();
        lists.iter().for_each(|list| overwritten(list, &aliases, &mut out));
        not_called(library, pou, &lists, &mut out);
    }
    out
}

/// Reports assignments that a later one in the same list overwrites, if nothing between them can read the value or leave the list.
fn overwritten(list: &[Stmt], aliases: &BTreeSet<Symbol>, out: &mut Vec<Diagnostic>) {
    let mut open: BTreeMap<Symbol, (Span, &Expr)> = BTreeMap::new();
    for stmt in list {
        let mut seen = Mentions::default();
        match &stmt.kind {
            StmtKind::Assign { target, value } => {
                seen.expr(value);
                if let ExprKind::Name(name) = &target.kind {
                    let key = name.id.clone();
                    forget(&mut open, &seen);
                    if aliases.contains(&key) {
                        continue;
                    }
                    if let Some((first, lost)) = open.insert(key, (stmt.span, value)) {
                        let help = match (shown(lost, true), shown(value, true)) {
                            (Some(a), Some(b)) => format!(
                                "combine both, as in `{name} := {a} OR {b};`, or remove the first one"
                            ),
                            _ => "combine both values in one assignment, or remove the first one"
                                .to_owned(),
                        };
                        out.push(
                            Diagnostic::warning(
                                codes::ST_OVERWRITTEN,
                                format!("the first assignment to `{name}` has no effect: nothing reads it before the next one"),
                            )
                            .at(first, "this value is lost")
                            .at(stmt.span, "assigned again here")
                            .help(help),
                        );
                    }
                    continue;
                }
                seen.expr(target);
            }
            kind => {
                kind.lists().for_each(|list| overwritten(list, aliases, out));
                seen.stmt(stmt);
            }
        }
        forget(&mut open, &seen);
    }
}

/// The text of a Boolean expression that contains only names, if it is short; an inner expression gets parentheses.
fn shown(expr: &Expr, is_inner: bool) -> Option<String> {
    let chain = |all: &[Expr], op: &str| {
        let parts: Option<Vec<String>> = all.iter().map(|one| shown(one, true)).collect();
        let text = parts?.join(op);
        Some(if is_inner { format!("({text})") } else { text })
    };
    let text = match &expr.kind {
        ExprKind::Name(name) => name.text.clone(),
        ExprKind::Field(inner, field) => format!("{}.{field}", shown(inner, true)?),
        ExprKind::Not(inner) => format!("NOT {}", shown(inner, true)?),
        ExprKind::And(all) => chain(all, " AND ")?,
        ExprKind::Or(all) => chain(all, " OR ")?,
        _ => return None,
    };
    (text.len() <= 80).then_some(text)
}

/// Removes assignments that are read or may be read: a call can read every variable that its unit can access, and after a jump the value is
/// final.
fn forget<T>(open: &mut BTreeMap<Symbol, T>, seen: &Mentions) {
    if seen.leaves || !seen.called.is_empty() || seen.has_function {
        open.clear();
    } else {
        open.retain(|name, _| !seen.names.contains(name));
    }
}

/// Reports instances of standard blocks whose outputs are read but which no statement calls.
fn not_called(library: &Library, pou: &Pou, lists: &[&[Stmt]], out: &mut Vec<Diagnostic>) {
    let mut seen = Mentions::default();
    lists.iter().flat_map(|list| list.iter()).for_each(|stmt| seen.stmt(stmt));
    let mut used_as_actions: BTreeSet<&Symbol> = BTreeSet::new();
    for element in pou.elements() {
        used_as_actions.extend(element.uses().iter().map(|one| &one.action.id));
        element
            .uses()
            .iter()
            .filter_map(|one| one.duration.as_ref())
            .for_each(|one| seen.expr(one));
        if let Element::Transition(transition) = element {
            seen.expr(&transition.condition);
        }
    }
    for var in &pou.vars {
        let key = var.name.id.clone();
        let Some(ty) = var.ty.name().map(|name| &name.id) else { continue };
        let Some(block) = standard_block(ty) else { continue };
        let names = |section| {
            let vars = block.vars.iter().filter(move |var| var.section == section);
            vars.map(|var| var.name.text.as_str())
        };
        let is_own = library.pous.iter().any(|pou| pou.name.id == *ty)
            || library.types.iter().any(|def| def.name.id == *ty);
        let is_passed = seen.whole.contains(&key) || used_as_actions.contains(&key);
        if is_own
            || is_passed
            || !matches!(var.section, Section::Local | Section::Temp)
            || seen.called.contains(&key)
        {
            continue;
        }
        let read = seen.fields.iter().find(|(name, field, _)| {
            *name == key && names(Section::Output).any(|one| field.id == *one)
        });
        let Some((_, field, span)) = read else { continue };
        let name = &var.name;
        // The reset and load inputs of a counter are optional.
        let is_counter = names(Section::Input).any(|one| one == "PV");
        let needed =
            names(Section::Input).filter(|input| !is_counter || !matches!(*input, "R" | "LD"));
        let call: Vec<String> = needed.map(|input| format!("{input} := ..")).collect();
        let call = format!("{name}({});", call.join(", "));
        let help = if matches!(pou.body, Body::Sfc(_)) {
            format!(
                "call it in an action that each step runs: `ACTION call_{name}: {call} END_ACTION`, and `call_{name}(N);` in the steps"
            )
        } else {
            format!("call it in each scan: write `{call}` in front of the statement that reads it")
        };
        out.push(
            Diagnostic::warning(
                codes::ST_NOT_CALLED,
                format!("`{name}` is never called, so `{name}.{field}` never changes"),
            )
            .at(*span, "read here, but it still has its initial value")
            .at(name.span, format!("no statement calls this {ty}"))
            .help(help),
        );
    }
}

/// The names in statements and expressions.
#[derive(Debug, Default)]
struct Mentions {
    /// All variables, read or assigned.
    names: BTreeSet<Symbol>,
    /// Variables that are used without a field.
    whole: BTreeSet<Symbol>,
    /// Fields with their spans.
    fields: Vec<(Symbol, Ident, Span)>,
    /// Names at the beginning of calls: the called instance, action or function.
    called: BTreeSet<Symbol>,
    /// Whether an expression calls a function.
    has_function: bool,
    /// Whether RETURN, EXIT or CONTINUE is used.
    leaves: bool,
}

impl Mentions {
    fn list(&mut self, list: &[Stmt]) {
        list.iter().for_each(|stmt| self.stmt(stmt));
    }

    fn stmt(&mut self, stmt: &Stmt) {
        match &stmt.kind {
            StmtKind::Assign { target, value } => {
                self.expr(target);
                self.expr(value);
            }
            StmtKind::Call { target, arguments } => {
                if let Some(root) = target.root() {
                    self.called.insert(root.id.clone());
                }
                self.arguments(arguments);
            }
            kind @ (StmtKind::If { .. }
            | StmtKind::Case { .. }
            | StmtKind::For { .. }
            | StmtKind::While { .. }
            | StmtKind::Repeat { .. }) => {
                if let StmtKind::For { var, .. } = kind {
                    self.names.insert(var.id.clone());
                }
                for part in kind.parts() {
                    match part {
                        Part::Expr(expr) => self.expr(expr),
                        Part::List(list) => self.list(list),
                    }
                }
            }
            StmtKind::Exit | StmtKind::Continue | StmtKind::Return | StmtKind::Refused(_) => {
                self.leaves = true;
            }
        }
    }

    fn arguments(&mut self, arguments: &[Arg]) {
        arguments.iter().for_each(|one| self.expr(&one.value));
    }

    fn expr(&mut self, expr: &Expr) {
        match &expr.kind {
            ExprKind::Name(name) => {
                let key = name.id.clone();
                self.whole.insert(key.clone());
                self.names.insert(key);
            }
            ExprKind::Field(inner, field) => {
                if let ExprKind::Name(name) = &inner.kind {
                    self.fields.push((name.id.clone(), field.clone(), expr.span));
                    self.names.insert(name.id.clone());
                    return;
                }
            }
            ExprKind::Call(..) => self.has_function = true,
            _ => {}
        }
        expr.children().into_iter().for_each(|one| self.expr(one));
    }
}
