//! Pass `roles`: determines what drives each output (semantics §3.5, §3.6). An output is exactly one of continuous, stored or controlled; an extern action
//! is exactly one of continuous, controlled or called. Expressions depend on this, so the pass runs before any expression is lowered.

use super::codes;
use super::context::{Lowering, Role, ScopeId, Slot, Symbol, Use, Work};
use super::names::Resolved;
use crate::chart::{self, ActionHow, Block, DeclarationKind, StepItemKind, StmtKind};
use crate::diag::{Diagnostic, Notation};
use crate::expr::Type;
use crate::net::{ActionId, ControlledAction, Driver, Meta, OutputId, Qualifier, Var, VarOrigin};
use crate::span::{Name, Span};

/// True for a qualifier that makes all uses of its action controlled.
pub(super) fn is_controlling(how: ActionHow) -> bool {
    matches!(how, ActionHow::Qualified(qualifier, _) if qualifier.is_controlling())
}

/// Determines the role of each output. Runs after `expand`, when all steps that may use an output are known.
pub(super) fn roles(lowering: &mut Lowering<'_>) {
    let n_outputs = lowering.net.outputs.len();
    let mut collected = Collected {
        uses: vec![Vec::new(); n_outputs],
        assigned: vec![None; n_outputs],
        called: vec![None; n_outputs],
    };
    for index in 0..lowering.work.len() {
        collected.collect(lowering, lowering.work[index]);
    }
    let Collected { uses, assigned, called } = collected;
    lowering.uses = uses;
    lowering.roles = vec![Role::Broken; n_outputs];
    for index in 0..lowering.work.len() {
        if let Work::Action { action, source, .. } = lowering.work[index] {
            drawn_action(lowering, action, source);
            continue;
        }
        let Work::Declaration { scope, source, symbol: Symbol::Output(id) } = lowering.work[index]
        else {
            continue;
        };
        let places = (assigned[id.index()], called[id.index()]);
        lowering.roles[id.index()] = role(lowering, scope, source, id, places);
    }
}

/// Declares a controlled action without an output; later passes lower its uses and its list.
fn drawn_action(lowering: &mut Lowering<'_>, action: usize, source: &chart::Action) {
    let drawn = &lowering.drawn_actions[action];
    let (name, is_used) = (drawn.name.clone(), !drawn.uses.is_empty());
    let uses = drawn.uses.clone();
    let timers = more_timers(lowering, &name, &source.meta, &uses);
    let id = lowering.net.actions.push(ControlledAction {
        name,
        uses: Vec::new(),
        duration: 0,
        body: Vec::new(),
        meta: source.meta.clone(),
    });
    lowering.more_timers.insert(id, timers);
    lowering.drawn_actions[action].id = Some(id);
    if !is_used {
        lowering.report(
            Diagnostic::warning(
                codes::OUTPUT_UNDRIVEN,
                format!("no step uses action `{}`", source.name),
            )
            .plural(format!("`{}`", source.name), "no step uses actions", "")
            .at(source.name.span, "it never runs")
            .help("use it in the body of a step, or remove it"),
        );
    }
}

/// Creates the additional actions for further durations of an action. One action has one timer of each kind. If L or D is used with several durations,
/// each additional duration gets an action of its own, which is placed before the main one and has no column; its Q is then combined with the inputs of the
/// main action, as by qualifier N (semantics §3.5). Other qualifiers with several durations are reported where they are lowered.
pub(super) fn more_timers(
    lowering: &mut Lowering<'_>,
    name: &Name,
    meta: &Meta,
    uses: &[Use<'_>],
) -> Vec<(u64, ActionId)> {
    let Some(first) = main_duration(uses) else { return Vec::new() };
    let mut made: Vec<(u64, ActionId)> = Vec::new();
    for one in uses {
        let Some((Qualifier::L | Qualifier::D, ns)) = timed(one.how) else { continue };
        if ns == first || made.iter().any(|(other, _)| *other == ns) {
            continue;
        }
        let text = lowering.fresh_name(&format!("{name}_timed"));
        let id = lowering.net.actions.push(ControlledAction {
            name: Name::new(text, name.span),
            uses: Vec::new(),
            duration: 0,
            body: Vec::new(),
            meta: Meta { span: meta.span, ..Meta::default() },
        });
        made.push((ns, id));
    }
    made
}

/// The duration of the main action: that of a storing qualifier, or else the first duration.
pub(super) fn main_duration(uses: &[Use<'_>]) -> Option<u64> {
    let all = || uses.iter().filter_map(|one| timed(one.how));
    let stored = all().find(|(qualifier, _)| !matches!(qualifier, Qualifier::L | Qualifier::D));
    stored.or_else(|| all().next()).map(|(_, ns)| ns)
}

/// The qualifier and duration of a timed use.
pub(super) fn timed(how: ActionHow) -> Option<(Qualifier, u64)> {
    match how {
        ActionHow::After(ns) => Some((Qualifier::D, ns)),
        ActionHow::For(ns) => Some((Qualifier::L, ns)),
        ActionHow::Qualified(qualifier, Some(ns)) => Some((qualifier, ns)),
        ActionHow::Bare | ActionHow::Qualified(_, None) => None,
    }
}

/// The target of an action in a step body.
#[derive(Debug, Clone, Copy)]
enum UseOf {
    Output(usize),
    Action(usize),
}

struct Collected<'a> {
    uses: Vec<Vec<Use<'a>>>,
    assigned: Vec<Option<Span>>,
    called: Vec<Option<Span>>,
}

impl<'a> Collected<'a> {
    fn collect(&mut self, lowering: &mut Lowering<'a>, work: Work<'a>) {
        match work {
            Work::Step { scope, id, source } => {
                for item in &source.body {
                    if let Some(block) = item.kind.list() {
                        self.block(lowering, scope, block);
                    }
                    let StepItemKind::Action { target, arguments, how, condition } = &item.kind
                    else {
                        continue;
                    };
                    let wanted = if arguments.is_some() { "extern action" } else { "output" };
                    let found = match lowering
                        .wanting(wanted, |lowering| lowering.symbol_of(scope, target))
                    {
                        Ok(Symbol::Output(output)) => UseOf::Output(output.index()),
                        Ok(Symbol::Action(action)) => UseOf::Action(action),
                        Ok(other) => {
                            not_an_output(lowering, target, other);
                            continue;
                        }
                        Err(_) => continue,
                    };
                    let one = Use {
                        step: id,
                        scope,
                        how: *how,
                        condition: condition.as_ref(),
                        arguments: arguments.as_deref(),
                        span: item.span,
                    };
                    match found {
                        UseOf::Output(output) => self.uses[output].push(one),
                        UseOf::Action(action) => {
                            lowering.drawn_actions[action].uses.push(one);
                        }
                    }
                }
            }
            Work::Transition { scope, source, .. } => self.block(lowering, scope, &source.actions),
            Work::Action { scope, source, .. } => self.block(lowering, scope, &source.body),
            Work::State { scope, source, .. } => {
                if let Some((_, content)) = &source.initial {
                    self.block(lowering, scope, content);
                }
                for history in &source.histories {
                    self.block(lowering, scope, &history.content);
                }
            }
            Work::Declaration { .. }
            | Work::Reaction { .. }
            | Work::Emergency { .. }
            | Work::Property { .. }
            | Work::Place { .. }
            | Work::Board { .. }
            | Work::Shared { .. } => {}
        }
    }

    fn block(&mut self, lowering: &mut Lowering<'a>, scope: ScopeId, block: &'a Block) {
        for stmt in chart::statements(block) {
            match &stmt.kind {
                StmtKind::Assign { target, .. } => {
                    if let Some(Resolved::Symbol(Symbol::Output(output))) =
                        lowering.peek(scope, target)
                    {
                        self.assigned[output.index()].get_or_insert(stmt.span);
                    }
                }
                StmtKind::Call { function, .. } => {
                    if let Some(Symbol::Output(output)) = lowering.find(scope, &function.text) {
                        self.called[output.index()].get_or_insert(stmt.span);
                    }
                }
                StmtKind::Send { event, after, slot: Some(slot) } => {
                    let Some(Symbol::Input(event)) = lowering.find(scope, &event.text) else {
                        continue;
                    };
                    let Ok(delay) = lowering.ticks(after.unwrap_or(0), stmt.span) else { continue };
                    let made = Slot { event, delay, span: stmt.span, id: None };
                    let next = lowering.slot_list.len();
                    let index = *lowering
                        .slots
                        .entry((lowering.scopes[scope].home, &slot.text))
                        .or_insert(next);
                    if index == next {
                        lowering.slot_list.push(made);
                    }
                    let first = lowering.slot_list[index];
                    if (first.event, first.delay) != (event, delay) {
                        lowering.report(
                            Diagnostic::error(
                                codes::SEND_SLOT,
                                format!("two different sends have the name `{slot}`"),
                            )
                            .at(slot.span, "different event or delay")
                            .at(first.span, "first used here")
                            .help("give this one another name: each name is one timer"),
                        );
                    }
                }
                StmtKind::If { .. }
                | StmtKind::Send { slot: None, .. }
                | StmtKind::Raise(_)
                | StmtKind::Cancel(_)
                | StmtKind::Code(_) => {}
            }
        }
    }
}

fn not_an_output(lowering: &mut Lowering<'_>, target: &crate::span::Name, symbol: Symbol) {
    if symbol == Symbol::Broken {
        return;
    }
    let kind = lowering.kind(symbol);
    let mut finding =
        Diagnostic::error(codes::WRONG_KIND, format!("`{target}` is {kind}, not an output"))
            .at(target.span, "a step can only drive outputs and call extern actions");
    if let Symbol::Var(id) = symbol {
        let value = if lowering.net.vars[id].ty == Type::Bool { "true" } else { "1" };
        finding = finding.help(format!(
            "assign it in a statement list, as in `entry {{ {target} := {value} }}`"
        ));
    }
    lowering.report(finding);
}

fn role(
    lowering: &mut Lowering<'_>,
    scope: ScopeId,
    source: &chart::Declaration,
    id: OutputId,
    (assigned, called): (Option<Span>, Option<Span>),
) -> Role {
    let name = &source.name;
    let uses = &lowering.uses[id.index()];
    let first_use = uses.first().map(|one| one.span);
    let controlling = uses.iter().find(|one| is_controlling(one.how)).map(|one| one.span);
    let iec = lowering.iec.get(lowering.scopes[scope].chart).copied().unwrap_or(false);
    let is_controlled = controlling.is_some() || (iec && first_use.is_some());
    let (ty, mealy) = match source.kind {
        DeclarationKind::Output { mealy, .. } => (lowering.net.outputs[id].ty, mealy),
        DeclarationKind::ExternAction { .. } => {
            return extern_role(lowering, source, (first_use, called));
        }
        DeclarationKind::Input { .. }
        | DeclarationKind::Var { .. }
        | DeclarationKind::Event { .. }
        | DeclarationKind::Timer { .. }
        | DeclarationKind::ExternCondition { .. }
        | DeclarationKind::Const { .. } => return Role::Broken,
    };
    let uses = Uses { ty, mealy, is_controlled, assigned, controlling, first: first_use };
    if let Some(finding) = uses.conflict(name) {
        lowering.report(finding);
        return Role::Broken;
    }
    if assigned.is_none() && first_use.is_none() {
        lowering.report(undriven(name, ty));
    }
    let output = &lowering.net.outputs[id];
    let (full, meta) = (output.name.clone(), output.meta.clone());
    if assigned.is_some() || (first_use.is_none() && !ty.is_bool()) {
        let origin = VarOrigin::StoredOutput;
        let init = vec![ty.saturate(0)];
        let var = lowering.net.vars.push(Var { name: full, ty, len: None, init, origin, meta });
        return Role::Stored(var);
    }
    if is_controlled {
        let uses = lowering.uses[id.index()].clone();
        let timers = more_timers(lowering, &full, &meta, &uses);
        let action = lowering.net.actions.push(ControlledAction {
            name: full,
            uses: Vec::new(),
            duration: 0,
            body: Vec::new(),
            meta,
        });
        lowering.more_timers.insert(action, timers);
        return Role::Controlled(action);
    }
    if mealy { Role::Mealy } else { Role::Continuous }
}

/// How a chart uses an output, with the places.
struct Uses {
    ty: Type,
    mealy: bool,
    is_controlled: bool,
    assigned: Option<Span>,
    controlling: Option<Span>,
    first: Option<Span>,
}

impl Uses {
    /// Why these uses exclude each other.
    fn conflict(&self, name: &Name) -> Option<Diagnostic> {
        let roles = |message: String| Diagnostic::error(codes::OUTPUT_ROLES, message);
        if let (Some(assigned), Some(first)) = (self.assigned, self.first) {
            let way = if self.is_controlled { "by qualifiers" } else { "while a step is active" };
            let message = format!("output `{name}` is driven {way} and assigned in lists");
            let finding = roles(message)
                .at(assigned, "assigned here, so it keeps its value")
                .at(first, format!("driven {way} here"))
                .help("use one way only: `set` and `reset` it in steps, or assign it everywhere");
            return Some(finding);
        }
        if self.mealy && (self.assigned.is_some() || self.is_controlled) {
            let place = self.assigned.or(self.controlling).or(self.first).unwrap_or(name.span);
            let finding = roles(format!("the mealy output `{name}` cannot have memory"))
                .at(place, "this needs memory")
                .at(name.span, "declared `mealy` here")
                .help("a mealy output is a function of the situation and the inputs: drive it in step bodies, without qualifiers");
            return Some(finding);
        }
        let (Type::Int { lo, hi }, Some(place)) = (self.ty, self.first) else { return None };
        let message = format!("output `{name}` is a number ({lo}..{hi}) but is used as a Boolean");
        let finding = Diagnostic::error(codes::TYPE, message)
            .at(place, "switched on and off here")
            .at(name.span, "declared here")
            .help(format!("assign it instead, as in `entry {{ {name} := {hi} }}`"));
        Some(finding)
    }
}

/// A warning about an output that nothing drives.
fn undriven(name: &Name, ty: Type) -> Diagnostic {
    let in_graf = match ty {
        Type::Bool => "use it in the body of a step, or remove it".to_owned(),
        Type::Int { hi, .. } => {
            format!("assign it in a list, as in `entry {{ {name} := {hi} }}`, or remove it")
        }
    };
    let value = if ty.is_bool() { "it is always off" } else { "it keeps its initial value" };
    Diagnostic::warning(codes::OUTPUT_UNDRIVEN, format!("nothing drives output `{name}`"))
        .plural(format!("`{name}`"), "nothing drives outputs", "")
        .help_in(Notation::Graf, in_graf)
        .help_in(Notation::Iec, "assign it, or remove it")
        .help_in(Notation::Scxml, "assign it in an <onentry>, or remove it")
        .at(name.span, value)
        .help("use it in the body of a step, or remove it")
        .help_in(
            Notation::Rules,
            format!("write it in the rule of a step, as in `step: |- {name}`, or remove it"),
        )
}

fn extern_role(
    lowering: &mut Lowering<'_>,
    source: &chart::Declaration,
    (used, called): (Option<Span>, Option<Span>),
) -> Role {
    let name = &source.name;
    match (used, called) {
        (Some(used), Some(called)) => {
            lowering.report(
                Diagnostic::error(
                    codes::OUTPUT_ROLES,
                    format!("extern action `{name}` is called in lists and while a step is active"),
                )
                .at(called, "called here, once")
                .at(used, "called here, in every reaction")
                .help("use it in one of the two ways, or declare a second extern action"),
            );
            Role::Broken
        }
        (None, None) => {
            lowering.report(
                Diagnostic::warning(
                    codes::OUTPUT_UNDRIVEN,
                    format!("nothing calls extern action `{name}`"),
                )
                .plural(format!("`{name}`"), "nothing calls extern actions", "")
                .at(name.span, "")
                .help("use it in the body of a step, `call` it in a list, or remove it"),
            );
            Role::Extern
        }
        (Some(_), None) | (None, Some(_)) => Role::Extern,
    }
}

/// The driver of an output with this role, without uses so far.
pub(super) fn empty_driver(role: Role, present: &Driver) -> Driver {
    match role {
        Role::Continuous => Driver::Continuous(Vec::new()),
        Role::Mealy => Driver::Mealy(Vec::new()),
        Role::Stored(var) => Driver::Stored(var),
        Role::Controlled(action) => Driver::Controlled(action),
        Role::Extern | Role::Broken => present.clone(),
    }
}
