//! Charts: steps with their actions, transitions, and the handling of Booleans that are actions.

use grafsynth_ir::Gather;
use std::collections::{BTreeMap, BTreeSet};

use grafsynth_ir::chart::{
    Action, ActionHow, Item, Macro, MacroStep, Path, Step, StepItem, StepItemKind, StepRole, Stmt,
    StmtKind, Transition,
};
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::net::{Meta, Qualifier};
use grafsynth_ir::{Name, Span};

use super::context::{Binding, Elaborator, FrameId, Place, bodies_of};
use super::types::Ty;
use super::value::{Kind, Time, leaf};
use crate::codes;
use crate::st::ast::{self, Element, Role, Sfc};
use crate::st::symbol::{Ident, Symbol};

/// The meaning of an action that a step uses.
#[derive(Debug, Clone)]
enum Target {
    /// An action or Boolean with this name in the chart.
    Named(String),
    /// A Boolean that statements also assign. S and R write it directly; other qualifiers write it through a separate action.
    Mixed {
        set: String,
        reset: String,
        /// `None` if the steps use it with S and R only.
        control: Option<String>,
    },
    Broken,
}

/// The chart of one unit under construction.
struct Build {
    frame: FrameId,
    /// Names of actions in the chart.
    actions: BTreeMap<Symbol, String>,
    targets: BTreeMap<Symbol, Target>,
    steps: BTreeMap<Symbol, Name>,
    /// The action that runs in every scan.
    always: Option<String>,
    /// The first assignment to each variable.
    assigned: BTreeMap<Symbol, Span>,
}

/// The help text about the possible actions of a step.
const OTHER_ACTION: &str =
    "write the name of a BOOL variable, or of an `ACTION name: .. END_ACTION` that assigns it";

/// Adds the first assignment in these statements to each variable.
fn assignments(list: &[ast::Stmt], found: &mut BTreeMap<Symbol, Span>) {
    for stmt in list {
        if let ast::StmtKind::Assign { target, .. } = &stmt.kind
            && let ast::ExprKind::Name(name) = &target.kind
        {
            found.entry(name.id.clone()).or_insert(stmt.span);
        }
        stmt.kind.lists().for_each(|list| assignments(list, found));
    }
}

fn at(kind: StmtKind, span: Span) -> Stmt {
    Stmt { kind, span }
}

impl<'a> Elaborator<'a> {
    /// The items of a chart after its declarations.
    pub(super) fn sfc(&mut self, frame: FrameId, sfc: &'a Sfc) -> Vec<Item> {
        let mut build = Build {
            frame,
            actions: BTreeMap::new(),
            targets: BTreeMap::new(),
            steps: BTreeMap::new(),
            always: None,
            assigned: BTreeMap::new(),
        };
        assignments(&sfc.always, &mut build.assigned);
        for action in &sfc.actions {
            assignments(&action.body, &mut build.assigned);
        }
        self.declare_steps(&mut build, sfc);
        for action in &sfc.actions {
            let full = self.full(&action.name).text;
            if build.actions.insert(action.name.id.clone(), full).is_some() {
                self.twice("action", &action.name);
            }
        }
        self.bodies = bodies_of(&sfc.actions);
        // As in the standard, writes of Booleans that are actions come first, then the bodies.
        let mut first = Vec::new();
        let mut always = Vec::new();
        self.mixed_actions(&mut build, sfc, &mut first, &mut always);
        let mut actions = Vec::new();
        for action in &sfc.actions {
            let mut body = Vec::new();
            self.open_bodies.push((frame, Some(action.name.id.clone())));
            self.body(frame, &action.body, action.name.span, &mut body);
            self.open_bodies.pop();
            let meta = Meta { span: action.span, label: action.label.clone(), ..Meta::default() };
            actions.push(Item::Action(Action { name: self.full(&action.name), body, meta }));
        }
        self.list(frame, &sfc.always, &mut always);
        let mut items = first;
        if !always.is_empty() {
            let name = self.free_name("every_scan");
            build.always = Some(name.clone());
            let name = Name::new(name, Span::default());
            items.push(Item::Action(Action { name, body: always, meta: Meta::default() }));
        }
        items.extend(actions);
        self.elements(&build, &sfc.elements, &mut items);
        items
    }

    /// The name of a step, action or transition in the chart.
    fn full(&self, name: &Ident) -> Name {
        Name::new(format!("{}{name}", self.prefix), name.span)
    }

    fn twice(&mut self, what: &str, name: &Ident) {
        self.report(
            Diagnostic::error(codes::ST_DUPLICATE, format!("{what} `{name}` is declared twice"))
                .at(name.span, "again here")
                .help("rename one of them; names that differ only in letter case are the same"),
        );
    }

    fn declare_steps(&mut self, build: &mut Build, sfc: &Sfc) {
        for element in sfc.all_elements() {
            let name = match element {
                Element::Step(step) => &step.name,
                Element::Macro(step) => &step.name,
                Element::Transition(_) => continue,
            };
            let full = self.full(name);
            let is_new = build.steps.insert(name.id.clone(), full.clone()).is_none();
            if is_new && self.own(build.frame, &name.id).is_none() {
                self.bind(build.frame, &name.id, Binding::Step(full));
            } else {
                self.twice("step", name);
            }
        }
    }

    /// Determines what each used action is, and creates the assignments to Booleans that are actions but that statements also assign.
    fn mixed_actions(
        &mut self,
        build: &mut Build,
        sfc: &Sfc,
        items: &mut Vec<Item>,
        always: &mut Vec<Stmt>,
    ) {
        let mut uses: BTreeMap<&Symbol, BTreeSet<Qualifier>> = BTreeMap::new();
        for one in sfc.uses() {
            uses.entry(&one.action.id).or_default().insert(one.qualifier);
        }
        for one in sfc.uses() {
            let Some(qualifiers) = uses.remove(&one.action.id) else { continue };
            let target = match build.actions.get(&one.action.id) {
                Some(action) => Target::Named(action.clone()),
                None => self.boolean_action(build, &one.action, &qualifiers, items, always),
            };
            build.targets.insert(one.action.id.clone(), target);
        }
    }

    fn boolean_action(
        &mut self,
        build: &Build,
        name: &Ident,
        qualifiers: &BTreeSet<Qualifier>,
        items: &mut Vec<Item>,
        always: &mut Vec<Stmt>,
    ) -> Target {
        if let Some(flag) = self.flags.get(&name.id) {
            return Target::Named(flag.clone());
        }
        let Some(place) = self.boolean(build, name) else { return Target::Broken };
        let span = name.span;
        // A variable of an instance never becomes an action itself.
        if self.prefix.is_empty() {
            let mut finding = Diagnostic::warning(
                codes::ST_MIXED,
                format!("`{name}` is used as a step action and also assigned by statements"),
            )
            .at(span, "used as an action");
            if let Some(assigned) = build.assigned.get(&name.id) {
                finding = finding.at(*assigned, "assigned here");
            }
            self.report(finding.help(format!(
                "remove the assignment and write `{name}(S)` and `{name}(R)` in the steps, or remove the step action; as written, S and R set it first in each scan, and the statements overwrite it"
            )));
        }
        let base = &place.name.text;
        let set = self.free_name(&format!("{base}.set"));
        let reset = self.free_name(&format!("{base}.reset"));
        let action = |name: &str, body| {
            let meta = Meta { span, ..Meta::default() };
            Item::Action(Action { name: Name::new(name, span), body, meta })
        };
        let mut control = None;
        if qualifiers.iter().any(|one| !matches!(one, Qualifier::S | Qualifier::R)) {
            let name = self.free_name(&format!("{base}.control"));
            items.push(action(&name, Vec::new()));
            self.controlled(&place, &name, span, always);
            control = Some(name);
        }
        if qualifiers.contains(&Qualifier::S) {
            items.push(action(&set, vec![self.write(&place, true, span)]));
        }
        if qualifiers.contains(&Qualifier::R) {
            items.push(action(&reset, vec![self.write(&place, false, span)]));
        }
        Target::Mixed { set, reset, control }
    }

    fn write(&self, place: &Place, value: bool, span: Span) -> Stmt {
        let value = grafsynth_ir::chart::Expr::bool(value);
        let target = self.path(place, span);
        at(StmtKind::Assign { target, index: place.index.clone(), value }, span)
    }

    /// Sets a Boolean while the action `control` runs, and resets it when the action ends.
    fn controlled(&mut self, place: &Place, control: &str, span: Span, always: &mut Vec<Stmt>) {
        let was = self.free_name(&format!("{}.was", place.name));
        let was = Name::new(was, span);
        self.new_var(was.clone(), &Ty::Bool, Vec::new(), Meta::default());
        let choose = |condition, then, otherwise| {
            at(StmtKind::If { condition, then: vec![then], otherwise }, span)
        };
        let fall =
            choose(leaf(was.clone().into(), span), self.write(place, false, span), Vec::new());
        let control = leaf(Name::new(control, span).into(), span);
        always.push(choose(control.clone(), self.write(place, true, span), vec![fall]));
        always.push(at(StmtKind::Assign { target: was.into(), index: None, value: control }, span));
    }

    /// The Boolean variable that a step uses as an action.
    fn boolean(&mut self, build: &Build, name: &Ident) -> Option<Place> {
        let message = match self.lookup(build.frame, &name.id) {
            Some(Binding::Place(place)) if place.ty == Ty::Bool => return Some(place),
            Some(Binding::Place(_) | Binding::Value(_)) => {
                format!("`{name}` is not a Boolean variable, so an action cannot set it")
            }
            Some(Binding::Step(_) | Binding::Object(_)) => {
                format!("`{name}` is neither an action nor a Boolean variable")
            }
            Some(Binding::Broken) => return None,
            None => {
                let mut candidates: Vec<String> = build.actions.values().cloned().collect();
                candidates.extend(self.candidates(build.frame));
                let help = "write `ACTION name: .. END_ACTION`, or declare a BOOL variable";
                self.unknown("action", name, &candidates, help);
                return None;
            }
        };
        let finding = Diagnostic::error(codes::ST_TYPE, message);
        self.report(finding.at(name.span, "used as an action").help(OTHER_ACTION));
        None
    }

    fn elements(&mut self, build: &Build, elements: &[Element], items: &mut Vec<Item>) {
        for element in elements {
            match element {
                Element::Step(step) => {
                    let item = self.step(build, step);
                    items.push(Item::Step(item));
                }
                Element::Transition(transition) => {
                    if let Some(item) = self.transition(build, transition) {
                        items.push(Item::Transition(item));
                    }
                }
                Element::Macro(step) => {
                    let body = self.free_name(&format!("{}{}_body", self.prefix, step.name));
                    let body = Name::new(body, step.name.span);
                    let meta = Meta { span: step.span, ..Meta::default() };
                    let mut inner = Vec::new();
                    self.elements(build, &step.body, &mut inner);
                    items.push(Item::Macro(Macro {
                        name: body.clone(),
                        items: inner,
                        meta: meta.clone(),
                    }));
                    items.push(Item::MacroStep(MacroStep {
                        name: self.full(&step.name),
                        body,
                        role: role(step.role, false),
                        priority: None,
                        meta,
                    }));
                }
            }
        }
    }

    fn step(&mut self, build: &Build, step: &ast::Step) -> Step {
        let mut body = Vec::new();
        for one in &step.uses {
            self.action_use(build, one, &mut body);
        }
        if step.is_initial
            && let Some(always) = &build.always
        {
            // Stored from the first scan on.
            body.push(item(always, ActionHow::Qualified(Qualifier::S, None), step.span));
        }
        let role = role(step.role, step.is_initial);
        let meta = Meta { span: step.span, label: step.label.clone(), ..Meta::default() };
        Step { name: self.full(&step.name), role, body, meta, ..Step::default() }
    }

    fn action_use(&mut self, build: &Build, one: &ast::Use, body: &mut Vec<StepItem>) {
        let Some(duration) = self.duration(build, one) else { return };
        let how = match (one.qualifier, duration) {
            (Qualifier::N, _) => ActionHow::Bare,
            (Qualifier::D, Some(ns)) => ActionHow::After(ns),
            (Qualifier::L, Some(ns)) => ActionHow::For(ns),
            (qualifier, duration) => {
                ActionHow::Qualified(qualifier, duration.filter(|_| qualifier.is_timed()))
            }
        };
        match build.targets.get(&one.action.id) {
            Some(Target::Named(name)) => {
                let mut made = item(name, how, one.span);
                if let StepItemKind::Action { target, .. } = &mut made.kind {
                    target.span = one.action.span;
                }
                body.push(made);
            }
            Some(Target::Mixed { set, reset, control }) => match one.qualifier {
                Qualifier::S => body.push(item(set, ActionHow::Bare, one.span)),
                Qualifier::R => {
                    body.push(item(reset, ActionHow::Bare, one.span));
                    body.extend(control.iter().map(|control| item(control, how, one.span)));
                }
                _ => {
                    body.extend(control.iter().map(|control| item(control, how, one.span)));
                }
            },
            Some(Target::Broken) | None => {}
        }
    }

    /// The duration of a use in nanoseconds: `Some(None)` if it has none, and `None` if it is invalid.
    fn duration(&mut self, build: &Build, one: &ast::Use) -> Option<Option<u64>> {
        let duration = match &one.duration {
            Some(duration) => {
                let Ok(value) = self.value(build.frame, duration) else { return None };
                match value.kind {
                    Kind::Time(Time::Constant(ns)) => Some(u64::try_from(ns).unwrap_or(0)),
                    Kind::Time(_) | Kind::Bool | Kind::Int(..) => {
                        self.report(
                            Diagnostic::error(
                                codes::ST_TIMER,
                                "the duration of an action must be a constant time",
                            )
                            .at(duration.span, "")
                            .help(
                                "write a duration such as T#3s, or a TIME variable that is never assigned",
                            ),
                        );
                        return None;
                    }
                }
            }
            None => None,
        };
        if !one.qualifier.is_timed()
            && let Some(written) = &one.duration
        {
            self.report(
                Diagnostic::warning(
                    codes::ST_LEFT_OUT,
                    format!("qualifier {:?} has no duration; this one is ignored", one.qualifier),
                )
                .at(written.span, "has no effect")
                .help(format!(
                    "remove it, or write `{}(L, ..)` for an action that ends after that time",
                    one.action
                )),
            );
        }
        if one.qualifier.is_timed() && duration.is_none() {
            self.report(
                Diagnostic::error(
                    codes::ST_TIMER,
                    format!("qualifier {:?} needs a duration", one.qualifier),
                )
                .at(one.span, "")
                .help(format!(
                    "write `{}({:?}, T#3s)` in structured text, `duration=\"T#3s\"` on the <action> in PLCopen XML",
                    one.action, one.qualifier
                )),
            );
            return None;
        }
        Some(duration)
    }

    fn transition(&mut self, build: &Build, transition: &ast::Transition) -> Option<Transition> {
        let side = |this: &mut Self, names: &[Ident]| {
            let mut paths = Vec::new();
            for name in names {
                match build.steps.get(&name.id) {
                    Some(step) => {
                        paths.push(Path::from(Name::new(step.text.clone(), name.span)));
                    }
                    None => {
                        let known: Vec<String> =
                            build.steps.values().map(|step| step.text.clone()).collect();
                        let help = format!(
                            "add it: `STEP {name}: END_STEP`, or write the name of another step"
                        );
                        this.unknown("step", name, &known, &help);
                    }
                }
            }
            paths
        };
        let (sources, targets) = (side(self, &transition.from), side(self, &transition.to));
        let left = sources.iter().flat_map(|path| &path.names);
        self.leaving = left.map(|name| name.text.clone()).gather();
        let condition = self.condition(build.frame, &transition.condition);
        self.leaving.clear();
        if sources.len() != transition.from.len() || targets.len() != transition.to.len() {
            return None;
        }
        let condition = condition.ok()?;
        let meta =
            Meta { span: transition.span, label: transition.label.clone(), ..Meta::default() };
        Some(Transition {
            name: transition.name.as_ref().map(|name| self.full(name)),
            sources,
            targets,
            guard: (!condition.is_true()).then_some(condition),
            priority: transition.priority,
            restart: transition.restart,
            meta,
            ..Transition::default()
        })
    }
}

fn role(role: Role, is_initial: bool) -> StepRole {
    match role {
        Role::Plain if is_initial => StepRole::Initial,
        Role::Plain => StepRole::Plain,
        Role::Entry => StepRole::MacroEntry,
        Role::Exit => StepRole::MacroExit,
        Role::EntryExit => StepRole::MacroEntryExit,
    }
}

fn item(target: &str, how: ActionHow, span: Span) -> StepItem {
    let target = Name::new(target, span);
    StepItem { kind: StepItemKind::Action { target, arguments: None, how, condition: None }, span }
}
