//! Turns steps, macro-steps, transitions and statements of a net into items of a chart.

use std::collections::BTreeMap;

use grafsynth_ir::chart::{
    ActionHow, Block, Enclosing, ForceOrder, Item, Macro, MacroStep, Setting, SettingKind, Step,
    StepItem, StepItemKind, StepRole, Stmt, StmtKind, Transition,
};
use grafsynth_ir::expr::ExprKind;
use grafsynth_ir::net::{self, Driver, Enter, ForcingOrder, StepId, TransitionId, TransitionKind};
use grafsynth_ir::{Name, Span};

use super::bodies::BodyId;
use super::{Writer, cannot, timers};

/// The output and the arguments of an extern action that steps use with qualifiers. Lowering turns such an action into a controlled action
/// with one call and the same name; `None` if `action` has another form.
pub(super) fn called_by_qualifiers<'n>(
    net: &'n net::Net,
    action: &'n net::ControlledAction,
) -> Option<(net::OutputId, &'n [net::Expr])> {
    let [net::Stmt { kind: net::StmtKind::Call { output, arguments }, .. }] =
        action.body.as_slice()
    else {
        return None;
    };
    let rest = action.name.text.strip_prefix(net.outputs[*output].name.text.as_str())?;
    let is_made = match rest.strip_prefix('_') {
        Some(number) => !number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit()),
        None => rest.is_empty(),
    };
    is_made.then_some((*output, arguments.as_slice()))
}

impl Writer<'_> {
    /// Adds outputs, controlled actions, forcings and reactions to the bodies of steps.
    pub(super) fn actions(&mut self) {
        let net = self.net;
        let mut driven: BTreeMap<usize, ()> = BTreeMap::new();
        for output in net.outputs.values() {
            match &output.driver {
                Driver::Continuous(emissions) | Driver::Mealy(emissions) => {
                    if self.is_iec && !emissions.is_empty() {
                        self.findings.push(cannot(
                            format!("the continuous output `{}` together with actions that need `actions iec`", output.name),
                            output.name.span,
                        ));
                    }
                    for emission in emissions {
                        let net::Emission { step, condition, span } = emission;
                        self.bare(*step, &output.name, None, condition, *span);
                    }
                }
                Driver::Fires(_) => self.findings.push(cannot(
                    format!("the output `{}`, which shows that a transition fires", output.name),
                    output.name.span,
                )),
                Driver::Stored(_) => {}
                Driver::Controlled(id) => {
                    driven.insert(id.index(), ());
                    let action = &net.actions[*id];
                    if !action.body.is_empty() {
                        self.findings.push(cannot(
                            format!("the list of action `{}`", action.name),
                            action.name.span,
                        ));
                    }
                    self.controlled(*id, &output.name, None);
                }
                Driver::Extern { calls, .. } => {
                    for call in calls {
                        let net::ExternCall { step, condition, arguments, span } = call;
                        self.bare(*step, &output.name, Some(arguments), condition, *span);
                    }
                }
            }
        }
        for (id, action) in net.actions.iter() {
            if driven.contains_key(&id.index()) || self.timers.contains_key(&id) {
                continue;
            }
            match called_by_qualifiers(net, action) {
                Some((output, arguments)) => {
                    self.controlled(id, &net.outputs[output].name, Some(arguments));
                }
                None => {
                    if net.settings.policy.is_statechart() {
                        let finding =
                            format!("the controlled action `{}` in a statechart", action.name);
                        self.findings.push(cannot(finding, action.name.span));
                    }
                    self.drawn.push(id);
                    self.controlled(id, &action.name, None);
                }
            }
        }
        for forcing in &net.forcings {
            self.forcing(forcing);
        }
        // In a statechart, reactions compete with the other transitions of their state, so they are written in order among these
        // transitions.
        for (_, transition) in net.transitions.iter().filter(|(_, one)| {
            one.kind == TransitionKind::Reaction && !net.settings.policy.is_statechart()
        }) {
            self.reaction(transition);
        }
    }

    fn push(&mut self, step: StepId, kind: StepItemKind, span: Span) {
        self.step_items.entry(step.index()).or_default().push(StepItem { kind, span });
    }

    fn body_of(&self, step: StepId) -> BodyId {
        self.bodies.home(self.net.steps[step].part)
    }

    /// Adds an action without a qualifier.
    fn bare(
        &mut self,
        step: StepId,
        target: &Name,
        arguments: Option<&[net::Expr]>,
        condition: &Option<net::Expr>,
        span: Span,
    ) {
        self.action(step, target, arguments, ActionHow::Bare, condition.as_ref(), span);
    }

    fn action(
        &mut self,
        step: StepId,
        target: &Name,
        arguments: Option<&[net::Expr]>,
        how: ActionHow,
        condition: Option<&net::Expr>,
        span: Span,
    ) {
        let from = self.body_of(step);
        let target = self.one_name(target, from);
        let arguments =
            arguments.map(|all| all.iter().map(|one| self.expr(one, from, None)).collect());
        let condition = condition.map(|condition| self.expr(condition, from, None));
        self.push(step, StepItemKind::Action { target, arguments, how, condition }, span);
    }

    /// An event that a list raises or sends; an error if it is the completion of a state.
    fn joining(&mut self, event: net::InputId, from: BodyId) -> Name {
        let name = &self.net.inputs[event].name;
        if self.completed.contains_key(&event) {
            let finding = format!("a list that raises `{name}`, the completion of a state");
            self.findings.push(cannot(finding, name.span));
        }
        self.one_name(name, from)
    }

    /// The name of an object where the language allows no path: surrounding objects are visible, but objects of other charts are not.
    pub(super) fn one_name(&mut self, full: &Name, from: BodyId) -> Name {
        let mut path = self.bodies.path(full, from);
        if path.names.len() != 1 {
            self.findings.push(cannot(
                format!("`{full}`, which belongs to another chart, in an action or event"),
                full.span,
            ));
        }
        path.names.pop().unwrap_or_default()
    }

    fn controlled(&mut self, id: net::ActionId, target: &Name, arguments: Option<&[net::Expr]>) {
        let net = self.net;
        let action = &net.actions[id];
        let mut of_timers: BTreeMap<net::ActionId, std::slice::Iter<'_, net::ActionUse>> =
            BTreeMap::new();
        for one in &action.uses {
            // A use with a further duration is written where its timer is used.
            let timer = timers::asked(one).filter(|timer| self.timers.get(timer) == Some(&id));
            let (of, one) = match timer {
                Some(timer) => {
                    let own = of_timers.entry(timer);
                    let own = own.or_insert_with(|| net.actions[timer].uses.iter());
                    (&net.actions[timer], own.next().unwrap_or(one))
                }
                None => (action, one),
            };
            let duration = self.nanoseconds(of.duration, of.name.span);
            let how =
                ActionHow::Qualified(one.qualifier, one.qualifier.is_timed().then_some(duration));
            self.action(one.step, target, arguments, how, one.condition.as_ref(), one.span);
        }
    }

    fn forcing(&mut self, forcing: &net::Forcing) {
        let Some(first) = forcing.target.first() else {
            self.findings.push(cannot("a forcing order without a target", forcing.span));
            return;
        };
        let target_body = self.bodies.home(*first);
        let order = match &forcing.order {
            ForcingOrder::Hold => ForceOrder::Hold,
            ForcingOrder::Situation(steps) => ForceOrder::Situation(
                steps
                    .iter()
                    .map(|step| self.bodies.path(&self.net.steps[*step].name, target_body))
                    .collect(),
            ),
        };
        // Names of charts are the same everywhere.
        let target = Name::new(self.net.parts[*first].name.text.clone(), forcing.span).into();
        self.push(forcing.step, StepItemKind::Force { target, order }, forcing.span);
    }

    fn reaction(&mut self, transition: &net::Transition) {
        let [step] = transition.requires.as_slice() else {
            self.findings.push(cannot(
                format!(
                    "the reaction `{}`, which does not belong to a single step",
                    transition.name
                ),
                transition.meta.span,
            ));
            return;
        };
        if transition.priority.is_some()
            || transition.deadline_ns.is_some()
            || !transition.enters.is_empty()
        {
            self.findings.push(cannot(
                format!("the reaction `{}` with more than a condition and a list", transition.name),
                transition.meta.span,
            ));
        }
        let from = self.body_of(*step);
        let events: Vec<Name> = transition
            .events
            .iter()
            .map(|event| self.one_name(&self.net.inputs[*event].name, from))
            .collect();
        let guard = (!transition.guard.is_true() || events.is_empty())
            .then(|| self.expr(&transition.guard, from, None));
        let actions = self.block(&transition.actions, from);
        self.push(*step, StepItemKind::On { events, guard, actions }, transition.meta.span);
    }

    pub(super) fn step(&mut self, id: StepId, body: BodyId) -> Step {
        let step = &self.net.steps[id];
        let is_initial = step.is_initial || self.states.marked.contains(&id);
        let role = match self.bodies.macro_step(body).map(|index| &self.net.macros[index]) {
            Some(one) if one.entry == id && one.exit == id => StepRole::MacroEntryExit,
            Some(one) if one.entry == id => StepRole::MacroEntry,
            Some(one) if one.exit == id => StepRole::MacroExit,
            Some(_) | None if is_initial => StepRole::Initial,
            Some(_) | None => StepRole::Plain,
        };
        let span = step.meta.span;
        let mut items = Vec::new();
        let mut push = |kind| items.push(StepItem { kind, span });
        if let Some(priority) = step.priority {
            push(StepItemKind::Priority(priority));
        }
        if !step.tasks.is_empty() && step.budget != u32::MAX {
            push(StepItemKind::Budget(step.budget));
        }
        let rest = self.step_items.remove(&id.index()).unwrap_or_default();
        let (reactions, actions): (Vec<StepItem>, Vec<StepItem>) =
            rest.into_iter().partition(|item| matches!(item.kind, StepItemKind::On { .. }));
        items.extend(actions);
        if !step.entry.is_empty() {
            items.push(StepItem { kind: StepItemKind::Entry(self.block(&step.entry, body)), span });
        }
        if !step.exit.is_empty() {
            items.push(StepItem { kind: StepItemKind::Exit(self.block(&step.exit, body)), span });
        }
        items.extend(reactions);
        for task in &step.tasks {
            let list = self.block(&task.body, body);
            let kind =
                StepItemKind::Task { name: task.name.clone(), cost: Some(task.cost), body: list };
            items.push(StepItem { kind, span: task.meta.span });
        }
        items.extend(
            step.code.iter().map(|code| StepItem { kind: StepItemKind::Code(code.clone()), span }),
        );
        let name = self.bodies.own(body, &step.name);
        let activation_link = step.activation_link;
        let meta = step.meta.clone();
        Step { name, role, activation_link, body: items, meta, ..Step::default() }
    }

    /// A macro-step, or an enclosing step with its contents.
    pub(super) fn inner(&mut self, inner: BodyId) -> Item {
        let around = self.bodies.parent(inner);
        let (Some(id), Some(around)) = (self.bodies.enclosing(inner), around) else {
            return self.macro_step(inner, around);
        };
        let step = self.step(id, around);
        let part = &self.net.parts[self.bodies.part(inner)];
        let mut items = Vec::new();
        // A part without its own priority has the priority of the surrounding chart.
        let outer = self.net.parts[self.bodies.part(around)].priority;
        if let Some(priority) = part.priority.filter(|own| Some(*own) != outer) {
            let kind = SettingKind::Priority(priority);
            items.push(Item::Setting(Setting { kind, span: part.name.span }));
        }
        items.extend(self.body(inner));
        Item::Enclosing(Enclosing { step, items })
    }

    /// The macro of a macro-step, under a generated name.
    pub(super) fn macro_body(&mut self, body: BodyId) -> Item {
        let part = &self.net.parts[self.bodies.part(body)];
        let (span, meta) = (part.name.span, part.meta.clone());
        let mut items = Vec::new();
        if let Some(priority) = part.priority {
            items.push(Item::Setting(Setting { kind: SettingKind::Priority(priority), span }));
        }
        items.extend(self.body(body));
        Item::Macro(Macro {
            name: Name::new(self.bodies.macro_name(body), Span::default()),
            items,
            meta,
        })
    }

    fn macro_step(&mut self, inner: BodyId, outer: Option<BodyId>) -> Item {
        let name = Name::new(self.bodies.macro_name(inner), Span::default());
        let local = self.bodies.local_name(inner).to_owned();
        let drawn = |body| self.bodies.macro_step(body).map(|index| &self.net.macros[index]);
        let (meta, role) = match (drawn(inner), outer.and_then(drawn)) {
            // A macro may begin or end with another macro.
            (Some(one), Some(around)) if one.entry == around.entry && one.exit == around.exit => {
                (one.meta.clone(), StepRole::MacroEntryExit)
            }
            (Some(one), Some(around)) if one.entry == around.entry => {
                (one.meta.clone(), StepRole::MacroEntry)
            }
            (Some(one), Some(around)) if one.exit == around.exit => {
                (one.meta.clone(), StepRole::MacroExit)
            }
            (Some(one), _) if self.net.steps[one.entry].is_initial => {
                (one.meta.clone(), StepRole::Initial)
            }
            (Some(one), _) => (one.meta.clone(), StepRole::Plain),
            (None, _) => (net::Meta::default(), StepRole::Plain),
        };
        let span = meta.span;
        // The priority of the entry step is written in its body.
        Item::MacroStep(MacroStep {
            name: Name::new(local, span),
            body: name,
            role,
            priority: None,
            meta,
        })
    }

    pub(super) fn transition(&mut self, id: TransitionId, body: BodyId) -> Item {
        let transition = &self.net.transitions[id];
        let mut targets = Vec::new();
        for enter in &transition.enters {
            match enter {
                Enter::Step(step) => targets.push(self.end(*step, body, false)),
                Enter::InitialContent(_) | Enter::History(_) => {
                    self.findings.push(cannot(
                        format!("the steps that `{}` enters", transition.name),
                        transition.meta.span,
                    ));
                }
            }
        }
        if transition.clears != transition.requires {
            self.findings.push(cannot(
                format!("the steps that `{}` clears", transition.name),
                transition.meta.span,
            ));
        }
        let guard = self.drawn_guard(transition, body);
        let guard = (!guard.is_true()).then(|| self.expr(&guard, body, Some(id)));
        let item = Transition {
            name: Some(self.bodies.own(body, &transition.name)),
            sources: transition.requires.iter().map(|step| self.end(*step, body, true)).collect(),
            targets,
            events: transition
                .events
                .iter()
                .map(|event| self.one_name(&self.net.inputs[*event].name, body))
                .collect(),
            guard,
            after: None,
            is_sink: transition.enters.is_empty() && !transition.requires.is_empty(),
            priority: transition.priority,
            restart: transition.restart,
            is_internal: false,
            deadline_ns: transition.deadline_ns,
            actions: self.block(&transition.actions, body),
            meta: transition.meta.clone(),
        };
        Item::Transition(item)
    }

    /// The receptivity, without the condition that lowering adds to a source transition of an enclosed chart: that the enclosing step is
    /// active (C4).
    fn drawn_guard(&self, transition: &net::Transition, body: BodyId) -> net::Expr {
        let guard = transition.guard.clone();
        let Some(around) = self.bodies.enclosing(body).filter(|_| transition.requires.is_empty())
        else {
            return guard;
        };
        let is_added = |one: &net::Expr| one.kind == ExprKind::Leaf(net::Leaf::Active(around));
        if is_added(&guard) {
            return net::Expr::bool(true);
        }
        if let ExprKind::And(all) = &guard.kind
            && let Some((first, rest)) = all.split_first()
            && is_added(first)
        {
            return net::Expr::and(rest.iter().cloned());
        }
        guard
    }

    /// A source or target step of a transition. Outside a macro-step, its entry and exit steps are written as the macro-step itself.
    fn end(&self, step: StepId, body: BodyId, is_source: bool) -> grafsynth_ir::chart::Path {
        let data = &self.net.steps[step];
        let home = self.bodies.home(data.part);
        if self.bodies.share_names(home, body) {
            return self.bodies.own(home, &data.name).into();
        }
        let whole = self.bodies.macro_step(home).map(|index| &self.net.macros[index]);
        match whole.filter(|one| step == if is_source { one.exit } else { one.entry }) {
            Some(one) => self.bodies.path(&one.name, body),
            None => self.bodies.path(&data.name, body),
        }
    }

    pub(super) fn block(&mut self, block: &net::Block, from: BodyId) -> Block {
        block.iter().map(|stmt| self.stmt(stmt, from)).collect()
    }

    fn stmt(&mut self, stmt: &net::Stmt, from: BodyId) -> Stmt {
        let net = self.net;
        let kind = match &stmt.kind {
            net::StmtKind::Assign { var, index, value } => StmtKind::Assign {
                target: self.bodies.path(&net.vars[*var].name, from),
                index: index.as_ref().map(|index| self.expr(index, from, None)),
                value: self.expr(value, from, None),
            },
            net::StmtKind::Raise(event) => StmtKind::Raise(self.joining(*event, from)),
            net::StmtKind::Send(slot) => {
                let slot = &net.sends[*slot];
                let after = (slot.delay > 0).then(|| self.nanoseconds(slot.delay, slot.name.span));
                StmtKind::Send {
                    event: self.joining(slot.event, from),
                    after,
                    slot: Some(self.one_name(&slot.name, from)),
                }
            }
            net::StmtKind::Cancel(slot) => {
                StmtKind::Cancel(self.one_name(&net.sends[*slot].name, from))
            }
            net::StmtKind::Call { output, arguments } => StmtKind::Call {
                function: self.one_name(&net.outputs[*output].name, from),
                arguments: arguments.iter().map(|one| self.expr(one, from, None)).collect(),
            },
            net::StmtKind::If { condition, then, otherwise } => StmtKind::If {
                condition: self.expr(condition, from, None),
                then: self.block(then, from),
                otherwise: self.block(otherwise, from),
            },
            net::StmtKind::Code(verbatim) => StmtKind::Code(verbatim.clone()),
        };
        Stmt { kind, span: stmt.span }
    }
}
