//! Turns a net into a chart that lowers to the same net, if the chart language can express it. Shrinkers and `convert` print this chart.
//!
//! Macro-steps are folded back (one macro for each, named after it), enclosing steps and states are restored, full names become local ones,
//! ticks become durations, and `otherwise` is recognised. Lowering the result gives the same net, except for names that lowering generates,
//! spans, and the order in which a step lists its outputs.

mod bodies;
mod expr;
mod items;
mod states;
mod timers;

use grafsynth_ir::Gather;
use std::collections::{BTreeMap, BTreeSet};

use grafsynth_ir::chart::{
    Action, Board, Chart, Declaration, DeclarationKind, Design, Emergency, Expr, Item, Path, Place,
    Property, Setting, SettingKind, StepItem,
};
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::expr::{ExprKind, Type};
use grafsynth_ir::net::{
    ActionId, Driver, Evolution, InputId, InputKind, Net, PlacedItem, PropertyRole, SHARINGS,
    StepId, StepKind, StmtKind, TransitionId, TransitionKind, VarId, VarOrigin,
};
use grafsynth_ir::{Name, Span};

use crate::codes;
use crate::graf::names::is_writable;
use bodies::{Bodies, BodyId};
use states::States;

/// The design that lowers to `net`.
///
/// # Errors
/// Returns a finding, with its location, for everything in the net that a chart cannot express.
pub(crate) fn design(net: &Net) -> Result<Design, Vec<Diagnostic>> {
    let mut findings = Vec::new();
    refuse(net, &mut findings);
    let bodies = Bodies::of(net, &mut findings);
    for name in declared(net).filter(|name| !bodies.has_home(name)) {
        let finding = format!("`{name}`, whose name does not begin with the name of a chart");
        findings.push(cannot(finding, name.span));
    }
    let is_statechart = net.settings.policy.is_statechart();
    let states = if is_statechart { States::of(net, &mut findings) } else { States::default() };
    let completed = states::completed(net, &mut findings);
    if !findings.is_empty() {
        return Err(findings);
    }
    let mut writer = Writer {
        net,
        bodies,
        findings,
        step_items: BTreeMap::new(),
        is_iec: needs_iec(net),
        drawn: Vec::new(),
        timers: timers::of(net),
        states,
        completed,
    };
    writer.actions();
    let design = writer.design();
    if writer.findings.is_empty() { Ok(design) } else { Err(writer.findings) }
}

struct Writer<'a> {
    net: &'a Net,
    bodies: Bodies,
    findings: Vec<Diagnostic>,
    /// The items that outputs and reactions add to the bodies of steps, by step index.
    step_items: BTreeMap<usize, Vec<StepItem>>,
    is_iec: bool,
    /// Controlled actions that are written as actions of the chart.
    drawn: Vec<ActionId>,
    /// Maps each action that is a further duration of another action to that other action.
    timers: BTreeMap<ActionId, ActionId>,
    /// The states of a statechart.
    states: States,
    /// Completion events and their states.
    completed: BTreeMap<InputId, StepId>,
}

fn cannot(message: impl std::fmt::Display, span: Span) -> Diagnostic {
    Diagnostic::error(codes::CANNOT_WRITE, format!("a chart cannot express {message}"))
        .at(span, "this")
        .help("write the net itself (`.net`), which can express everything")
}

/// Reports parts of the net that no chart can express.
fn refuse(net: &Net, findings: &mut Vec<Diagnostic>) {
    let is_statechart = net.settings.policy.is_statechart();
    for step in net.steps.values() {
        let (what, belongs) = match step.kind {
            StepKind::Leaf => ("step", true),
            StepKind::Enclosing => ("enclosing step", !is_statechart),
            StepKind::Composite => ("composite state", is_statechart),
            StepKind::Parallel => ("parallel state", is_statechart),
            StepKind::Final => ("final state", is_statechart),
        };
        if !belongs {
            let kind = if is_statechart { "a statechart" } else { "a Grafcet" };
            let finding = format!("the {what} {} in {kind}", step.name);
            findings.push(cannot(finding, step.name.span));
        }
        if step.hidden {
            findings.push(cannot(format!("the hidden step `{}`", step.name), step.name.span));
        }
    }
    // Parents precede their contents, so one pass is enough.
    let mut active = vec![false; net.steps.len()];
    for (id, step) in net.steps.iter().filter(|_| !is_statechart) {
        let around = step.parent.map(|parent| active[parent.index()]);
        active[id.index()] = step.is_initial || (step.activation_link && around == Some(true));
        if step.is_initial && around == Some(false) {
            findings.push(cannot(
                format!("step `{}`, which is initial in an inactive step", step.name),
                step.name.span,
            ));
        }
    }
    for timer in net.timers.values().filter(|timer| timer.starts_expired) {
        findings.push(cannot(
            format!("timer `{}`, which starts at its largest value", timer.name),
            timer.name.span,
        ));
    }
    let written = written(net);
    for output in net.outputs.values() {
        let Driver::Stored(var) = output.driver else { continue };
        // Lowering stores only the outputs that a list assigns. Any other output has no memory, so it cannot be read or have an initial value.
        if !written.contains(&var) {
            findings.push(cannot(
                format!("the stored output `{}`, which is never assigned", output.name),
                output.name.span,
            ));
        }
    }
    if !net.unspecified.is_empty() {
        findings.push(cannot("unspecified cells", Span::default()));
    }
    let names = net
        .steps
        .values()
        .map(|step| &step.name)
        .chain(net.transitions.values().map(|transition| &transition.name))
        .chain(net.inputs.values().map(|input| &input.name))
        .chain(net.outputs.values().map(|output| &output.name))
        .chain(net.vars.values().map(|var| &var.name))
        .chain(net.timers.values().map(|timer| &timer.name))
        .chain(net.sends.values().map(|slot| &slot.name))
        .chain(net.parts.values().map(|part| &part.name))
        .chain(std::iter::once(&net.name));
    for name in names.filter(|name| !is_writable(&name.text)) {
        findings.push(cannot(
            format!("a name that is empty or contains a backquote or line break: {:?}", name.text),
            name.span,
        ));
    }
}

/// The variables that lists assign.
fn written(net: &Net) -> BTreeSet<VarId> {
    let assigned = net.statements().filter_map(|stmt| {
        if let StmtKind::Assign { var, .. } = stmt.kind { Some(var) } else { None }
    });
    assigned.gather()
}

/// The names of all objects that a chart declares.
fn declared(net: &Net) -> impl Iterator<Item = &Name> {
    let values = net.inputs.values().map(|it| &it.name);
    let values = values.chain(net.outputs.values().map(|it| &it.name));
    let values = values.chain(net.vars.values().map(|it| &it.name));
    let values = values.chain(net.timers.values().map(|it| &it.name));
    values.chain(net.actions.values().map(|it| &it.name))
}

/// Whether an action is controlled only because of the setting `actions iec`.
fn needs_iec(net: &Net) -> bool {
    let drives =
        |id: ActionId| net.outputs.values().any(|output| output.driver == Driver::Controlled(id));
    net.actions.iter().any(|(id, action)| {
        // An action that is declared with `action` is always controlled.
        let is_output = drives(id) || items::called_by_qualifiers(net, action).is_some();
        is_output
            && !action.uses.is_empty()
            && action.uses.iter().all(|one| !one.qualifier.is_controlling())
    })
}

impl Writer<'_> {
    fn design(&mut self) -> Design {
        let roots = self.bodies.roots();
        let several = roots.len() > 1;
        let mut charts = Vec::new();
        for (index, root) in roots.into_iter().enumerate() {
            let part = &self.net.parts[self.bodies.part(root)];
            let name = if several { part.name.clone() } else { self.net.name.clone() };
            let mut items = self.settings(index == 0, root);
            let mut initial = Vec::new();
            if self.net.settings.policy.is_statechart() {
                let drawn = self.statechart(root);
                initial = drawn.0;
                items.extend(drawn.1);
            } else {
                items.extend(self.body(root));
            }
            self.properties(&mut items, root, index == 0);
            if index == 0 {
                // Objects that belong to no part are written in the first chart.
                self.emergency(&mut items, root);
                self.placements(&mut items, root);
                self.board(&mut items);
            }
            charts.push(Chart {
                is_unnamed: false,
                name,
                span: part.meta.span,
                initial,
                items,
                meta: part.meta.clone(),
            });
        }
        Design { charts, ..Design::default() }
    }

    fn settings(&self, is_first: bool, root: BodyId) -> Vec<Item> {
        let settings = &self.net.settings;
        let mut kinds = Vec::new();
        if is_first {
            kinds.push(SettingKind::Tick(settings.tick_ns));
        }
        kinds.push(SettingKind::Conflict(settings.policy));
        if is_first {
            kinds.push(match settings.evolution {
                Evolution::Single => SettingKind::EvolutionSingle,
                Evolution::Stable { limit } => SettingKind::EvolutionStable(Some(limit)),
            });
            if settings.schedule != grafsynth_ir::net::Schedule::Declared {
                kinds.push(SettingKind::Schedule(settings.schedule));
            }
            if settings.fire_one {
                kinds.push(SettingKind::FireOne(true));
            }
            if settings.assign_simultaneous {
                kinds.push(SettingKind::AssignSimultaneous(true));
            }
            kinds.extend(settings.queue.map(SettingKind::Queue));
            if settings.events_exclusive {
                kinds.push(SettingKind::EventsExclusive);
            }
        }
        if self.is_iec {
            kinds.push(SettingKind::ActionsIec);
        }
        if settings.final_scan {
            kinds.push(SettingKind::FinalScan);
        }
        kinds.extend(self.net.parts[self.bodies.part(root)].priority.map(SettingKind::Priority));
        kinds
            .into_iter()
            .map(|kind| Item::Setting(Setting { kind, span: Span::default() }))
            .collect()
    }

    /// The declarations, macros, steps and transitions of a chart or macro, in an order from which lowering restores the order of the net.
    fn body(&mut self, body: BodyId) -> Vec<Item> {
        let mut items = self.declarations(body);
        let inner = self.bodies.inner(body);
        for macro_body in &inner {
            items.push(self.macro_body(*macro_body));
        }
        // Two orders must be restored: that of steps (macro-steps represent their steps) and that of transitions.
        let moves: Vec<(TransitionId, Option<bodies::Unit>)> = self
            .bodies
            .transitions_within(self.net, body)
            .into_iter()
            .map(|id| (id, self.bodies.unit_of(self.net, body, id)))
            .collect();
        let mut of_unit: BTreeMap<bodies::Unit, usize> = BTreeMap::new();
        for unit in moves.iter().filter_map(|(_, unit)| *unit) {
            *of_unit.entry(unit).or_default() += 1;
        }
        let mut next = 0;
        for unit in self.bodies.units(self.net, body) {
            if let Some(n_own) = of_unit.get(&unit) {
                // Transitions of this body that precede those of the unit.
                while let Some((id, None)) = moves.get(next) {
                    items.push(self.transition(*id, body));
                    next += 1;
                }
                let own = moves.get(next..next + n_own);
                // Reactions of an enclosing step precede the items that it encloses.
                let is_own =
                    |id: &TransitionId| self.bodies.home(self.net.transitions[*id].part) == body;
                let is_mixed = own.is_none_or(|own| {
                    own.iter().any(|(_, other)| *other != Some(unit))
                        || !own.is_sorted_by_key(|(id, _)| !is_own(id))
                });
                if is_mixed {
                    let span = moves
                        .get(next)
                        .map_or(Span::default(), |(id, _)| self.net.transitions[*id].meta.span);
                    self.findings.push(cannot("this order of transitions", span));
                    return items;
                }
                next += n_own;
            }
            items.push(match unit {
                bodies::Unit::Step(step) => Item::Step(self.step(step, body)),
                bodies::Unit::Inner(inner) => self.inner(inner),
            });
        }
        for (id, _) in &moves[next..] {
            items.push(self.transition(*id, body));
        }
        items
    }

    fn declarations(&mut self, body: BodyId) -> Vec<Item> {
        let net = self.net;
        let mut declarations = Vec::new();
        // The completion event of a state is declared by the state.
        for (_, input) in net.inputs.iter().filter(|(id, _)| !self.completed.contains_key(id)) {
            let Some(name) = self.bodies.local(body, &input.name) else { continue };
            let kind = match input.kind {
                InputKind::Pin => {
                    DeclarationKind::Input { ty: input.ty, synchronous: input.synchronous }
                }
                InputKind::Extern => DeclarationKind::ExternCondition { ty: input.ty },
                InputKind::Event => DeclarationKind::Event { internal: false },
                InputKind::InternalEvent => DeclarationKind::Event { internal: true },
            };
            declarations.push(Declaration { name, kind, meta: input.meta.clone() });
        }
        for output in net.outputs.values() {
            let Some(name) = self.bodies.local(body, &output.name) else { continue };
            let (mealy, mut init) = (matches!(output.driver, Driver::Mealy(_)), None);
            let kind = match &output.driver {
                Driver::Extern { params, .. } => DeclarationKind::ExternAction {
                    params: params.iter().map(|param| (param.name.clone(), param.ty)).collect(),
                },
                _ => {
                    if let Driver::Stored(var) = output.driver {
                        let var = &net.vars[var];
                        let value = var.init.first().copied().unwrap_or(0);
                        init = (value != var.ty.saturate(0)).then(|| constant(var.ty, value));
                    }
                    DeclarationKind::Output {
                        ty: output.ty,
                        init,
                        registered: output.registered,
                        mealy,
                        safe: output.safe.map(|value| constant(output.ty, value)),
                    }
                }
            };
            declarations.push(Declaration { name, kind, meta: output.meta.clone() });
        }
        for var in net.vars.values().filter(|var| var.origin != VarOrigin::StoredOutput) {
            let Some(name) = self.bodies.local(body, &var.name) else { continue };
            if var.origin == VarOrigin::Hidden {
                self.findings
                    .push(cannot(format!("the hidden variable `{}`", var.name), var.name.span));
            }
            let is_same = var.init.windows(2).all(|pair| pair[0] == pair[1]);
            let init = match var.init.first() {
                Some(first) if is_same && *first == var.ty.saturate(0) => Vec::new(),
                Some(first) if is_same => vec![constant(var.ty, *first)],
                _ => var.init.iter().map(|value| constant(var.ty, *value)).collect(),
            };
            let kind = DeclarationKind::Var { ty: var.ty, len: var.len, init };
            declarations.push(Declaration { name, kind, meta: var.meta.clone() });
        }
        for timer in net.timers.values() {
            let Some(name) = self.bodies.local(body, &timer.name) else { continue };
            let condition = self.expr(&timer.condition, body, None);
            declarations.push(Declaration {
                name,
                kind: DeclarationKind::Timer { condition },
                meta: timer.meta.clone(),
            });
        }
        let mut items: Vec<Item> = declarations.into_iter().map(Item::Declaration).collect();
        for (_, sharing) in SHARINGS {
            let said = net.sharing.iter().filter(|(_, said)| **said == sharing);
            let names = said.filter_map(|(var, _)| {
                let name = self.bodies.local(body, &net.vars[*var].name)?;
                Some(Path { names: vec![name] })
            });
            let names: Vec<Path> = names.collect();
            if !names.is_empty() {
                let kind = SettingKind::Shared(sharing, names);
                items.push(Item::Setting(Setting { kind, span: Span::default() }));
            }
        }
        self.drawn_actions(body, &mut items);
        items
    }

    /// Adds the controlled actions with lists, each before the output whose action is next in the net, so that lowering restores the same order.
    fn drawn_actions(&mut self, body: BodyId, items: &mut Vec<Item>) {
        let net = self.net;
        for id in self.drawn.clone() {
            let action = &net.actions[id];
            let Some(name) = self.bodies.local(body, &action.name) else { continue };
            let list = self.block(&action.body, body);
            let next = net
                .outputs
                .values()
                .filter_map(|output| match output.driver {
                    Driver::Controlled(other) if other > id => Some((other, &output.name)),
                    _ => None,
                })
                .min_by_key(|(other, _)| *other)
                .and_then(|(_, name)| self.bodies.local(body, name));
            let at = items.iter().position(|item| {
                matches!((item, &next), (Item::Declaration(one), Some(next)) if one.name.text == next.text)
            });
            let item = Item::Action(Action { name, body: list, meta: action.meta.clone() });
            items.insert(at.unwrap_or(items.len()), item);
        }
    }

    /// Adds the properties whose names begin with the name of this chart. Properties whose names begin with no chart name are written in
    /// the first chart.
    fn properties(&mut self, items: &mut Vec<Item>, root: BodyId, is_first: bool) {
        for property in &self.net.properties {
            let home = self.bodies.root_called_in(&property.name);
            if home.map_or(!is_first, |home| home != root) {
                continue;
            }
            let expr = self.property_expr(&property.never, root);
            let name = Name::new(property.name.clone(), property.meta.span);
            let name = (!name.text.is_empty()).then(|| self.bodies.own(root, &name));
            let is_assumption = property.role == PropertyRole::Assume;
            items.push(Item::Property(Property {
                name,
                is_assumption,
                is_never: true,
                expr,
                meta: property.meta.clone(),
            }));
        }
    }

    fn emergency(&mut self, items: &mut Vec<Item>, root: BodyId) {
        let net = self.net;
        if let Some(ending) = &net.ending {
            let what = "an end of a reaction that waits for other parts";
            self.findings.push(cannot(what, ending.waits.span));
        }
        let Some(emergency) = &net.emergency else { return };
        let condition = self.expr(&emergency.condition, root, None);
        items.push(Item::Emergency(Emergency { condition, meta: emergency.meta.clone() }));
    }

    fn placements(&mut self, items: &mut Vec<Item>, root: BodyId) {
        for placement in &self.net.placements {
            let net = self.net;
            let name = match placement.item {
                PlacedItem::Step(id) => &net.steps[id].name,
                PlacedItem::Var(id) => &net.vars[id].name,
                PlacedItem::Transition(id) => &net.transitions[id].name,
                PlacedItem::Output(id) => &net.outputs[id].name,
            };
            if let PlacedItem::Transition(id) = placement.item
                && net.transitions[id].kind == TransitionKind::Reaction
            {
                self.findings.push(cannot("the placement of a reaction", placement.span));
            }
            let path = self.bodies.path(name, root);
            items.push(Item::Place(Place {
                items: vec![path],
                part: placement.part.clone(),
                span: placement.span,
            }));
        }
    }

    fn board(&self, items: &mut Vec<Item>) {
        if let Some(device) = &self.net.board.device {
            let board = Board {
                device: device.clone(),
                pins: self.net.board.pins.clone(),
                span: device.span,
            };
            items.push(Item::Board(board));
        }
    }
}

/// A constant of a type as an expression.
fn constant(ty: Type, value: i64) -> Expr {
    let kind = if ty.is_bool() { ExprKind::Bool(value != 0) } else { ExprKind::Int(value) };
    Expr::new(kind, Span::default())
}

#[cfg(test)]
mod tests;
