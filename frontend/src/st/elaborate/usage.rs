//! How a unit uses its names. It is determined before the declarations, because it decides what each variable becomes in the chart.

use grafsynth_ir::Gather;
use std::collections::{BTreeMap, BTreeSet};

use crate::st::ast::{Arg, Element, Expr, ExprKind, Part, Pou, Section, Stmt, StmtKind};
use crate::st::symbol::Symbol;

/// The uses of names.
#[derive(Debug, Clone, Default)]
pub(super) struct Usage {
    /// Variables that statements change.
    pub(super) assigned: BTreeSet<Symbol>,
    /// Names that steps use as actions.
    pub(super) actions: BTreeSet<Symbol>,
    /// Fields of instances that are read or assigned outside of calls.
    pub(super) fields: BTreeSet<(Symbol, Symbol)>,
    /// For each instance, the inputs for which each call has an argument.
    pub(super) calls: BTreeMap<Symbol, Vec<BTreeSet<Symbol>>>,
    /// All names that are read.
    pub(super) read: BTreeSet<Symbol>,
    /// For each variable, the assigned values that are constants, names or choices between them; `None` for any other value.
    pub(super) times: BTreeMap<Symbol, Vec<Option<Expr>>>,
}

/// A parameter of a function block: an input, output or in-out parameter.
#[derive(Debug, Clone)]
pub(super) struct Parameter {
    pub(super) id: Symbol,
    /// The second name of an input of a standard block.
    pub(super) second: Option<&'static str>,
    pub(super) section: Section,
}

impl Parameter {
    pub(super) fn is(&self, name: &str) -> bool {
        self.id == *name || self.second == Some(name)
    }
}

/// The parameters of a block in the order of a positional call.
pub(super) type Params = Vec<Parameter>;

/// Collects the uses in a unit. `params` returns the parameters of an instance by its name.
pub(super) fn of(pou: &Pou, params: &dyn Fn(&Symbol) -> Params) -> Usage {
    let mut walk = Walk { usage: Usage::default(), params };
    for element in pou.elements() {
        for one in element.uses() {
            walk.usage.actions.insert(one.action.id.clone());
            one.duration.iter().for_each(|duration| walk.expr(duration));
        }
        if let Element::Transition(transition) = element {
            walk.expr(&transition.condition);
        }
    }
    pou.lists().into_iter().for_each(|list| walk.list(list));
    for var in &pou.vars {
        if var.section == Section::External {
            walk.usage.read.insert(var.name.id.clone());
        }
    }
    walk.usage
}

/// The parameter to which an argument at this position in a call belongs.
fn parameter<'p>(params: &'p Params, place: usize, argument: &Arg) -> Option<&'p Parameter> {
    match &argument.name {
        Some(name) => params.iter().find(|one| one.is(&name.id)),
        None => params.get(place),
    }
}

struct Walk<'w> {
    usage: Usage,
    params: &'w dyn Fn(&Symbol) -> Params,
}

impl Walk<'_> {
    fn list(&mut self, list: &[Stmt]) {
        for stmt in list {
            self.stmt(stmt);
        }
    }

    fn target(&mut self, target: &Expr) {
        if let Some(root) = target.root() {
            self.usage.assigned.insert(root.id.clone());
        }
        if let ExprKind::Index(inner, indices) = &target.kind {
            indices.iter().for_each(|index| self.expr(index));
            if !matches!(inner.kind, ExprKind::Name(_)) {
                self.expr(inner);
            }
        } else if !matches!(target.kind, ExprKind::Name(_)) {
            self.expr(target);
        }
    }

    fn stmt(&mut self, stmt: &Stmt) {
        match &stmt.kind {
            StmtKind::Assign { target, value } => {
                self.target(target);
                if let (Some(root), ExprKind::Name(_)) = (target.root(), &target.kind) {
                    let value = is_listed(value).then(|| value.clone());
                    self.usage.times.entry(root.id.clone()).or_default().push(value);
                }
                self.expr(value);
            }
            StmtKind::Call { target, arguments } => {
                let root = target.root().map(|root| root.id.clone());
                let params = root.as_ref().map(self.params).unwrap_or_default();
                let inputs = arguments.iter().enumerate().filter(|(_, one)| !one.is_output);
                let names = inputs.filter_map(|(place, one)| parameter(&params, place, one));
                let names = names.map(|one| one.id.clone()).gather();
                self.arguments(arguments, &params);
                if let ExprKind::Name(instance) = &target.kind {
                    self.usage.read.insert(instance.id.clone());
                    self.usage.calls.entry(instance.id.clone()).or_default().push(names);
                } else {
                    // An action of an instance reads the inputs that a call of the instance would set.
                    if let ExprKind::Field(inner, _) = &target.kind
                        && let ExprKind::Name(instance) = &inner.kind
                    {
                        let calls = self.usage.calls.entry(instance.id.clone());
                        calls.or_default().push(BTreeSet::new());
                    }
                    self.expr(target);
                }
            }
            kind @ (StmtKind::If { .. }
            | StmtKind::Case { .. }
            | StmtKind::For { .. }
            | StmtKind::While { .. }
            | StmtKind::Repeat { .. }) => {
                if let StmtKind::For { var, .. } = kind {
                    self.usage.assigned.insert(var.id.clone());
                }
                for part in kind.parts() {
                    match part {
                        Part::Expr(expr) => self.expr(expr),
                        Part::List(list) => self.list(list),
                    }
                }
            }
            StmtKind::Exit | StmtKind::Continue | StmtKind::Return | StmtKind::Refused(_) => {}
        }
    }

    fn arguments(&mut self, arguments: &[Arg], params: &Params) {
        for (place, one) in arguments.iter().enumerate() {
            let is_changed =
                parameter(params, place, one).is_some_and(|one| one.section != Section::Input);
            if one.is_output || is_changed {
                self.target(&one.value);
                if let Some(root) = one.value.root() {
                    self.usage.times.entry(root.id.clone()).or_default().push(None);
                }
            }
            if !one.is_output {
                self.expr(&one.value);
            }
        }
    }

    fn expr(&mut self, expr: &Expr) {
        match &expr.kind {
            ExprKind::Name(name) => {
                self.usage.read.insert(name.id.clone());
            }
            ExprKind::Field(inner, field) => {
                if let ExprKind::Name(name) = &inner.kind {
                    self.usage.fields.insert((name.id.clone(), field.id.clone()));
                }
            }
            ExprKind::Call(_, arguments) => return self.arguments(arguments, &Params::new()),
            _ => {}
        }
        expr.children().into_iter().for_each(|one| self.expr(one));
    }
}

/// Whether the possible values of an expression can be listed: it is a literal, a name or a choice between such values.
pub(super) fn is_listed(value: &Expr) -> bool {
    if let ExprKind::Call(name, arguments) = &value.kind {
        return matches!(name.id.as_str(), "SEL" | "MUX")
            && arguments.iter().skip(1).all(|one| is_listed(&one.value));
    }
    matches!(value.kind, ExprKind::Time(_) | ExprKind::Name(_))
}
