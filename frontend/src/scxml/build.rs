//! Turns a document into a chart: combines names, events and data, and unrolls loops.

use std::collections::{BTreeMap, BTreeSet};

use grafsynth_ir::chart::{
    self, Chart, Declaration, DeclarationKind, Design, Expr, Item, Leaf, Path, Setting,
    SettingKind, Step, StepItem, StepItemKind, StepRole, Stmt, StmtKind,
};
use grafsynth_ir::diag::{Diagnostic, nearest};
use grafsynth_ir::expr::ExprKind;
use grafsynth_ir::net::{Meta, Policy};
use grafsynth_ir::{Name, Span};

use super::events::Alphabet;
use super::expr::{Ast, AstKind, Language};
use super::names::Names;
use super::tree::{Act, ActKind, Child, Machine, Role, State, StateKind};
use super::values::{Data, Kind, Value};
use crate::codes;
use crate::findings::Findings;

/// Maximum number of statements after unrolling all loops of a document.
const MAX_UNROLLED: usize = 100_000;
/// The default tick of a chart in nanoseconds (docs/semantics.md, §7).
const TICK: u64 = 10_000_000;
/// The default queue length grows with the number of raised events up to this limit.
const MAX_QUEUE: u32 = 8;

/// Builds the chart of a document.
pub(super) fn design(
    machine: &Machine,
    language: Language,
    nesting: u32,
    found: &mut Findings,
) -> Design {
    let nesting = nesting as usize;
    let mut names = Names::of_states(machine, found);
    let data = Data::of(machine, language, &mut names, found);
    let alphabet = Alphabet::of(machine, &mut names, found);
    let order: Vec<String> = names.in_order().cloned().collect();
    let mut builder = Builder {
        machine,
        names,
        data,
        alphabet,
        found,
        order: order.into_iter(),
        slots: BTreeMap::new(),
        unrolled: 0,
        nesting,
        depth: 0,
        n_raises: 0,
        n_sends: 0,
        delays: Vec::new(),
        copies: Vec::new(),
        read: BTreeSet::new(),
    };
    builder.slots();
    builder.design()
}

/// A send: its event and delay.
type Sent = (String, u64);

struct Builder<'m, 'f> {
    machine: &'m Machine,
    names: Names,
    data: Data,
    alphabet: Alphabet,
    found: &'f mut Findings,
    /// Names of states and histories in the order of their occurrence.
    order: std::vec::IntoIter<String>,
    /// For each identifier of a send: the sends with this identifier and their slots.
    slots: BTreeMap<&'m str, Vec<(Sent, String)>>,
    unrolled: usize,
    /// The limit and the current depth of nested choices: each `elseif` is nested in the one before it.
    nesting: usize,
    depth: usize,
    n_raises: u32,
    n_sends: u32,
    delays: Vec<u64>,
    /// Arrays that a loop iterates over while their elements change: the array, and the name of the copy.
    copies: Vec<(String, String, Span)>,
    /// Arrays that an expression reads.
    read: BTreeSet<String>,
}

impl<'m> Builder<'m, '_> {
    /// Assigns timer slots to sends. In SCXML one identifier may refer to several sends; in a chart each timer has one name.
    fn slots(&mut self) {
        let mut sends: Vec<(&'m Name, Sent)> = Vec::new();
        // Content of an omitted transition sends nothing, and a cancel of such a send has no effect.
        let never = |one: &super::tree::Transition| {
            one.has_event && !self.alphabet.matches_any(&one.events)
        };
        self.machine.each_act_but(&never, &mut |act| {
            if let ActKind::Send { event, after_ns, slot: Some(slot) } = &act.kind {
                sends.push((slot, (event.text.clone(), after_ns.unwrap_or(0))));
            }
        });
        for (slot, sent) in sends {
            let list = self.slots.entry(&slot.text).or_default();
            if !list.iter().any(|(known, _)| *known == sent) {
                let name = self.names.fresh(&slot.text, "_send");
                list.push((sent, name));
            }
        }
    }

    fn design(mut self) -> Design {
        let machine = self.machine;
        let mut states = Vec::new();
        for state in &machine.states {
            states.push(self.state(state));
        }
        let initial: Vec<Path> =
            machine.initial.iter().filter_map(|id| self.names.path(id, self.found)).collect();
        let initial = match initial.as_slice() {
            // The usual case: a single outermost state.
            [only]
                if machine
                    .initial
                    .iter()
                    .filter_map(|id| self.names.states.get(&id.text))
                    .all(|known| known.is_outermost) =>
            {
                let name = &only.names[0].text;
                for state in &mut states {
                    if let Item::State(chart::State { step, .. }) = state
                        && step.name.text == *name
                    {
                        step.role = StepRole::Initial;
                    }
                }
                let is_final = states
                    .iter()
                    .any(|state| matches!(state, Item::Step(step) if step.name.text == *name));
                if is_final { initial } else { Vec::new() }
            }
            _ => initial,
        };
        if machine.states.is_empty() {
            self.found.report(|| {
                Diagnostic::error(codes::SCXML_ELEMENT, "the document has no state")
                    .at(machine.span, "no <state>, <parallel> or <final> in it")
                    .help("add a state, as in <state id=\"idle\"/>")
            });
        }
        let mut items = self.settings();
        items.extend(self.events());
        items.extend(self.variables(&states));
        items.extend(states);
        let name = match &machine.name {
            Some(name) => Name::new(self.names.fresh(&name.text, "_chart"), name.span),
            None => Name::new(self.names.fresh("chart", "_chart"), machine.span),
        };
        let meta = Meta { span: machine.span, ..Meta::default() };
        let is_unnamed = machine.name.is_none();
        let chart = Chart { name, is_unnamed, span: machine.span, items, initial, meta };
        Design { charts: vec![chart], ..Design::default() }
    }

    fn settings(&mut self) -> Vec<Item> {
        let span = self.machine.span;
        let settings = &self.machine.settings;
        let mut kinds = vec![(SettingKind::Conflict(Policy::InnerFirst), span)];
        if let Some((limit, span)) = settings.limit {
            kinds.push((SettingKind::EvolutionStable(Some(limit)), span));
        }
        match settings.tick_ns {
            Some((ns, span)) => kinds.push((SettingKind::Tick(ns), span)),
            None => {
                let tick = self.delays.iter().fold(TICK, |tick, delay| gcd(tick, *delay));
                if tick != TICK {
                    kinds.push((SettingKind::Tick(tick), span));
                }
            }
        }
        if let Some(span) = settings.exclusive {
            kinds.push((SettingKind::EventsExclusive, span));
        }
        let n_done = self.alphabet.events.iter().filter(|event| event.is_done).count();
        let n_raised = self.n_raises.saturating_add(u32::try_from(n_done).unwrap_or(u32::MAX));
        if let Some((bound, span)) = settings.queue {
            kinds.push((SettingKind::Queue(bound), span));
        } else if n_raised > 0 {
            // The external queue needs space for the events of one row and one event of each send; the internal queue for the
            // events that a few steps raise.
            let outside = self.alphabet.events.iter().filter(|event| !event.is_internal).count();
            let outside = if settings.exclusive.is_some() { outside.min(1) } else { outside };
            let outside = u32::try_from(outside).unwrap_or(u32::MAX).saturating_add(self.n_sends);
            let bound = n_raised.clamp(2, MAX_QUEUE).max(outside.min(65_535));
            kinds.push((SettingKind::Queue(bound), span));
        }
        kinds.into_iter().map(|(kind, span)| Item::Setting(Setting { kind, span })).collect()
    }

    fn events(&self) -> impl Iterator<Item = Item> + use<> {
        let declarations: Vec<Item> = self
            .alphabet
            .events
            .iter()
            .filter(|event| !event.is_done)
            .map(|event| {
                Item::Declaration(Declaration {
                    name: Name::new(event.name.as_str(), event.span),
                    kind: DeclarationKind::Event { internal: event.is_internal },
                    meta: Meta { span: event.span, ..Meta::default() },
                })
            })
            .collect();
        declarations.into_iter()
    }

    fn variables(&mut self, states: &[Item]) -> Vec<Item> {
        let mut blocks: Vec<&[Stmt]> = Vec::new();
        for state in states {
            blocks_of(state, &mut blocks);
        }
        let copies = std::mem::take(&mut self.copies);
        let types = self.data.types(blocks, &copies);
        let mut items = Vec::new();
        for (var, ty) in self.data.vars.iter().zip(&types) {
            // An array that is only used by loops disappears when they are unrolled.
            if var.is_array && !var.is_assigned && !self.read.contains(&var.name) {
                continue;
            }
            let span = var.span;
            let init: Vec<Expr> = var.init.iter().map(|value| value.expr(span)).collect();
            let kind = match var.role {
                Role::Input => DeclarationKind::Input { ty: *ty, synchronous: false },
                Role::Output => DeclarationKind::Output {
                    ty: *ty,
                    init: init.into_iter().next(),
                    registered: false,
                    mealy: false,
                    safe: None,
                },
                Role::Variable => {
                    let len =
                        var.is_array.then(|| u32::try_from(var.init.len()).unwrap_or(u32::MAX));
                    DeclarationKind::Var { ty: *ty, len, init }
                }
            };
            let meta = Meta { span, label: var.label.clone(), ..Meta::default() };
            items.push(Item::Declaration(Declaration {
                name: Name::new(var.name.as_str(), span),
                kind,
                meta,
            }));
            for (_, copy, span) in copies.iter().filter(|(array, ..)| *array == var.name) {
                let len = Some(u32::try_from(var.init.len()).unwrap_or(u32::MAX));
                items.push(Item::Declaration(Declaration {
                    name: Name::new(copy.as_str(), *span),
                    kind: DeclarationKind::Var { ty: *ty, len, init: Vec::new() },
                    meta: Meta { span: *span, ..Meta::default() },
                }));
            }
        }
        items
    }

    /// Builds a state and its contents recursively. The depth of the document is bounded.
    fn state(&mut self, state: &'m State) -> Item {
        let text = self.order.next().unwrap_or_default();
        let span = state.id.as_ref().map_or(state.span, |id| id.span);
        let mut body = Vec::new();
        for (handlers, is_entry) in [(&state.entry, true), (&state.exit, false)] {
            for handler in handlers {
                let block = self.block(&handler.acts);
                if block.is_empty() {
                    continue;
                }
                let kind =
                    if is_entry { StepItemKind::Entry(block) } else { StepItemKind::Exit(block) };
                body.push(StepItem { kind, span: handler.span });
            }
        }
        let role = if state.kind == StateKind::Final { StepRole::Final } else { StepRole::Plain };
        let meta = Meta { span: state.span, label: state.label.clone(), ..Meta::default() };
        let step =
            Step { name: Name::new(text.as_str(), span), role, body, meta, ..Step::default() };
        if state.kind == StateKind::Final {
            return Item::Step(step);
        }
        let initial = state.initial.as_ref().map(|(targets, content)| {
            let targets = self.targets(targets);
            (targets, self.block(content))
        });
        let mut histories = Vec::new();
        for history in &state.histories {
            let text = self.order.next().unwrap_or_default();
            let span = history.id.as_ref().map_or(history.span, |id| id.span);
            let default = self.targets(&history.targets);
            let content = self.block(&history.content);
            histories.push(chart::History {
                name: Name::new(text, span),
                is_deep: history.is_deep,
                default,
                content,
                meta: Meta { span: history.span, ..Meta::default() },
            });
        }
        let path = self.own_path(&text, state);
        let mut items = Vec::new();
        for child in &state.children {
            match child {
                Child::State(inner) => items.push(self.state(inner)),
                Child::Transition(transition) => {
                    items.extend(self.transition(transition, &path).map(Item::Transition));
                }
            }
        }
        let is_parallel = state.kind == StateKind::Parallel;
        Item::State(chart::State { step, is_parallel, initial, histories, items })
    }

    /// The path of a state, as seen from its own body: its name, because no object inside it has the same name.
    fn own_path(&self, text: &str, state: &State) -> Path {
        Path::from(Name::new(text, state.span))
    }

    fn targets(&mut self, ids: &[Name]) -> Vec<Path> {
        ids.iter().filter_map(|id| self.names.path(id, self.found)).collect()
    }

    fn transition(
        &mut self,
        transition: &'m super::tree::Transition,
        source: &Path,
    ) -> Option<chart::Transition> {
        let targets = self.targets(&transition.targets);
        let events = self.alphabet.matched(&transition.events, &self.names, self.found);
        let guard = transition.condition.as_ref().and_then(|ast| self.condition(ast));
        let actions = self.block(&transition.content);
        // A transition that waits only for events that never occur would otherwise become eventless.
        if transition.has_event && events.is_empty() {
            return None;
        }
        Some(chart::Transition {
            sources: vec![source.clone()],
            is_internal: transition.is_internal || targets.is_empty(),
            targets,
            events,
            guard: guard.filter(|guard| !guard.is_true()),
            actions,
            meta: Meta { span: transition.span, ..Meta::default() },
            ..chart::Transition::default()
        })
    }

    fn condition(&mut self, ast: &Ast) -> Option<Expr> {
        let expr = self.data.condition(ast, &self.names);
        self.kept(expr)
    }

    fn kept(&mut self, expr: Result<Expr, Box<Diagnostic>>) -> Option<Expr> {
        match expr {
            Ok(expr) => {
                let read = &mut self.read;
                note_arrays(&expr, read);
                Some(expr)
            }
            Err(finding) => {
                self.found.report(|| *finding);
                None
            }
        }
    }

    fn block(&mut self, acts: &'m [Act]) -> Vec<Stmt> {
        let mut out = Vec::new();
        for act in acts {
            self.act(act, &mut out);
        }
        out
    }

    fn act(&mut self, act: &'m Act, out: &mut Vec<Stmt>) {
        let span = act.span;
        let mut push = |kind| out.push(Stmt { kind, span });
        match &act.kind {
            ActKind::Raise(event) => {
                self.n_raises = self.n_raises.saturating_add(1);
                if let Some(event) = self.alphabet.named(event) {
                    push(StmtKind::Raise(event));
                }
            }
            ActKind::Send { event, after_ns, slot } => {
                self.n_sends = self.n_sends.saturating_add(1);
                if after_ns.unwrap_or(0) == 0 {
                    self.n_raises = self.n_raises.saturating_add(1);
                }
                self.delays.extend(after_ns);
                let sent = (event.text.clone(), after_ns.unwrap_or(0));
                let slot = slot.as_ref().and_then(|slot| {
                    let list = self.slots.get(slot.text.as_str())?;
                    let (_, name) = list.iter().find(|(known, _)| *known == sent)?;
                    Some(Name::new(name.as_str(), slot.span))
                });
                if let Some(event) = self.alphabet.named(event) {
                    push(StmtKind::Send { event, after: *after_ns, slot });
                }
            }
            ActKind::Cancel(id) => match self.slots.get(id.text.as_str()) {
                Some(list) => {
                    for (_, name) in list {
                        push(StmtKind::Cancel(Name::new(name.as_str(), id.span)));
                    }
                }
                None => {
                    let mut dead = None;
                    self.machine.each_act(&mut |act| {
                        if let ActKind::Send { slot: Some(slot), .. } = &act.kind
                            && slot.text == id.text
                        {
                            dead.get_or_insert(act.span);
                        }
                    });
                    let near = nearest(&id.text, self.slots.keys().copied()).map(str::to_owned);
                    self.found.report(|| never_sent(id, dead, near));
                }
            },
            ActKind::Assign { target, target_span, index, value } => {
                if let Some(kind) = self.assign(target, *target_span, index.as_ref(), value) {
                    push(kind);
                }
            }
            ActKind::If { arms, otherwise } => {
                self.choices(span, arms, otherwise, out);
            }
            ActKind::Foreach { array, item, index, body } => {
                self.foreach(span, array, item, index.as_ref(), body, out);
            }
        }
    }

    /// An `<if>` with its `<elseif>` and `<else>`.
    fn choices(
        &mut self,
        span: Span,
        arms: &'m [(Ast, Vec<Act>)],
        otherwise: &'m [Act],
        out: &mut Vec<Stmt>,
    ) {
        if self.depth + arms.len() > self.nesting {
            let most = self.nesting;
            self.found.report(|| {
                Diagnostic::error(
                    codes::NESTING,
                    format!(
                        "choices are nested deeper than {most} levels; each <elseif> counts as one"
                    ),
                )
                .at(span, "")
                .help("split it into several <if> elements")
            });
            return;
        }
        self.depth += arms.len();
        let mut rest = self.block(otherwise);
        self.depth -= arms.len();
        let mut lowered = Vec::with_capacity(arms.len());
        for (index, (condition, acts)) in arms.iter().enumerate() {
            self.depth += index + 1;
            lowered.push((self.condition(condition), self.block(acts)));
            self.depth -= index + 1;
        }
        // The arms are processed from the last to the first: each arm becomes the `else` of the one before it.
        for (index, (condition, then)) in lowered.into_iter().enumerate().rev() {
            let Some(condition) = condition else { continue };
            let kind = StmtKind::If { condition, then, otherwise: rest };
            rest = vec![Stmt { kind, span: arms[index].0.span }];
        }
        out.append(&mut rest);
    }

    fn assign(
        &mut self,
        target: &str,
        target_span: Span,
        index: Option<&Ast>,
        value: &Ast,
    ) -> Option<StmtKind> {
        let Some(var) = self.data.get(target) else {
            let finding = self.data.unknown(target, target_span, &self.names);
            self.found.report(|| *finding);
            return None;
        };
        let (kind, is_array, role, len) = (var.kind(), var.is_array, var.role, var.init.len());
        let name = var.name.clone();
        if role == Role::Input {
            self.found.report(|| {
                Diagnostic::error(
                    codes::SCXML_LOCATION,
                    format!("`{target}` is an input and cannot be assigned"),
                )
                .at(target_span, "")
                .help(format!("assign another data element, or remove g:role=\"input\" from the <data> of `{target}`"))
            });
            return None;
        }
        let value = self.data.of_kind(value, kind, target, &self.names);
        let value = self.kept(value);
        let index = match (index, is_array) {
            (None, false) => None,
            (Some(index), true) => {
                let index = self.data.of_kind(index, Kind::Int, "an index", &self.names);
                let index = self.kept(index)?;
                if let ExprKind::Int(at) = grafsynth_ir::simplify::simplify(&index).kind
                    && !(0..i64::try_from(len).unwrap_or(i64::MAX)).contains(&at)
                {
                    self.found.report(|| {
                        Diagnostic::error(
                            codes::SCXML_LOCATION,
                            format!(
                                "index {at} is out of range: `{target}` has the elements 0..{}",
                                len.saturating_sub(1)
                            ),
                        )
                        .at(target_span, "")
                        .help("write an index in this range, or add elements to the array")
                    });
                    return None;
                }
                Some(index)
            }
            (None, true) | (Some(_), false) => {
                let what = if is_array { "an array" } else { "not an array" };
                self.found.report(|| {
                    Diagnostic::error(codes::SCXML_LOCATION, format!("`{target}` is {what}"))
                        .at(target_span, "")
                        .help(format!("assign one of its elements, as in `{target}[0]`, or a data element that is not an array"))
                });
                return None;
            }
        };
        let target = Path::from(Name::new(name, target_span));
        Some(StmtKind::Assign { target, index, value: value? })
    }

    /// Unrolls a loop over an array of known length.
    fn foreach(
        &mut self,
        span: Span,
        array: &'m Ast,
        item: &'m Name,
        index: Option<&'m Name>,
        body: &'m [Act],
        out: &mut Vec<Stmt>,
    ) {
        let Some(elements) = self.elements(array, body, out) else { return };
        let Some(item_var) = self.data.get(&item.text) else { return };
        let item_path = Path::from(Name::new(item_var.name.as_str(), item.span));
        let (item_kind, is_array) = (item_var.kind(), item_var.is_array);
        if is_array || item_var.role == Role::Input {
            self.found.report(|| {
                Diagnostic::error(
                    codes::SCXML_LOCATION,
                    format!("the loop variable `{item}` must be a number or a Boolean that can be assigned"),
                )
                .at(item.span, "")
                .help("write a new name, or the name of a data element that is neither an array nor an input")
            });
            return;
        }
        let index_path = index.and_then(|index| {
            let var = self.data.get(&index.text)?;
            Some(Path::from(Name::new(var.name.as_str(), index.span)))
        });
        for (at, (element, kind)) in elements.into_iter().enumerate() {
            if kind != item_kind {
                self.found.report(|| {
                    Diagnostic::error(
                        codes::SCXML_KIND,
                        format!("`{item}` gets numbers from one array and Booleans from another"),
                    )
                    .at(array.span, "")
                    .help("write another name for the item of this loop")
                });
                return;
            }
            let before = out.len();
            let target = item_path.clone();
            out.push(Stmt { kind: StmtKind::Assign { target, index: None, value: element }, span });
            if let Some(target) = index_path.clone() {
                let value = Expr::new(ExprKind::Int(i64::try_from(at).unwrap_or(i64::MAX)), span);
                out.push(Stmt { kind: StmtKind::Assign { target, index: None, value }, span });
            }
            // Checks the count before unrolling the body: nested loops multiply.
            self.unrolled += out.len() - before + count(body);
            if self.unrolled > MAX_UNROLLED {
                if self.unrolled < usize::MAX / 2 {
                    self.found.report(|| {
                        Diagnostic::error(
                            codes::SCXML_SIZE,
                            format!("the loops of the chart expand to more than {MAX_UNROLLED} statements"),
                        )
                        .at(span, "the limit is exceeded here")
                        .help("loops are unrolled: iterate over fewer elements")
                    });
                }
                // Reported only once.
                self.unrolled = usize::MAX / 2;
                return;
            }
            for act in body {
                self.act(act, out);
            }
        }
    }

    /// The elements that a loop iterates over, with their kind.
    fn elements(
        &mut self,
        array: &'m Ast,
        body: &'m [Act],
        out: &mut Vec<Stmt>,
    ) -> Option<Vec<(Expr, Kind)>> {
        let span = array.span;
        let constant = |value: Value| match value {
            Value::Bool(value) => (Expr::new(ExprKind::Bool(value), span), Kind::Bool),
            Value::Int(value) => (Expr::new(ExprKind::Int(value), span), Kind::Int),
        };
        let not_iterable = |message: String| {
            Diagnostic::error(codes::SCXML_LOOP, message)
                .at(span, "")
                .help("a loop iterates over a constant array: <data id=\"list\">[1, 2, 3]</data>")
        };
        if let Some(all) = array.elements() {
            let mut values = Vec::with_capacity(all.len());
            for one in all {
                match self.data.fixed(one, &self.names) {
                    Ok(value) => values.push(constant(value)),
                    Err(finding) => {
                        self.found.report(|| *finding);
                        return None;
                    }
                }
            }
            return Some(values);
        }
        let AstKind::Name(name) = &array.kind else {
            self.found.report(|| not_iterable("expected an array".to_owned()));
            return None;
        };
        let Some(var) = self.data.get(name) else {
            let finding = self.data.unknown(name, span, &self.names);
            self.found.report(|| *finding);
            return None;
        };
        if !var.is_array {
            self.found.report(|| not_iterable(format!("`{name}` is not an array")));
            return None;
        }
        if !var.is_assigned {
            return Some(var.init.iter().copied().map(constant).collect());
        }
        let (kind, len, chart_name) = (var.kind(), var.init.len(), var.name.clone());
        let element = |array: &str, at: usize| {
            let at = i64::try_from(at).unwrap_or(i64::MAX);
            let leaf = Leaf::Name(Path::from(Name::new(array, span)));
            let index = Box::new(Expr::new(ExprKind::Int(at), span));
            Expr::new(ExprKind::Element(leaf, index), span)
        };
        let mut from = chart_name.clone();
        if assigns(body, name) {
            // Changes of the array do not affect the running loop (W3C test assertion 525).
            let copy = self.names.fresh(&format!("{chart_name}_copy"), "");
            self.copies.push((chart_name.clone(), copy.clone(), span));
            for at in 0..len {
                let target = Path::from(Name::new(copy.as_str(), span));
                let index = i64::try_from(at).unwrap_or(i64::MAX);
                let index = Some(Expr::new(ExprKind::Int(index), span));
                let value = element(&chart_name, at);
                out.push(Stmt { kind: StmtKind::Assign { target, index, value }, span });
            }
            from = copy;
        }
        Some((0..len).map(|at| (element(&from, at), kind)).collect())
    }
}

fn gcd(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { gcd(b, a % b) }
}

/// The number of statements in a list, including nested ones.
fn count(acts: &[Act]) -> usize {
    let inside = |act: &Act| match &act.kind {
        ActKind::If { arms, otherwise } => {
            arms.iter().map(|(_, arm)| count(arm)).sum::<usize>() + count(otherwise)
        }
        ActKind::Foreach { body, .. } => count(body),
        ActKind::Assign { .. } | ActKind::Raise(_) | ActKind::Send { .. } | ActKind::Cancel(_) => 0,
    };
    acts.iter().map(|act| 1 + inside(act)).sum()
}

/// Whether a statement of the list assigns an element of the array.
fn assigns(acts: &[Act], array: &str) -> bool {
    acts.iter().any(|act| match &act.kind {
        ActKind::Assign { target, index, .. } => index.is_some() && target == array,
        ActKind::If { arms, otherwise } => {
            arms.iter().any(|(_, arm)| assigns(arm, array)) || assigns(otherwise, array)
        }
        ActKind::Foreach { body, .. } => assigns(body, array),
        ActKind::Raise(_) | ActKind::Send { .. } | ActKind::Cancel(_) => false,
    })
}

/// Collects the arrays whose elements an expression reads.
fn note_arrays(expr: &Expr, out: &mut BTreeSet<String>) {
    if let ExprKind::Element(Leaf::Name(path), _) = &expr.kind
        && let Some(name) = path.names.first()
    {
        out.insert(name.text.clone());
    }
    for operand in expr.children() {
        note_arrays(operand, out);
    }
}

/// Collects all lists of statements of a state and its contents.
fn blocks_of<'s>(item: &'s Item, out: &mut Vec<&'s [Stmt]>) {
    fn step<'s>(step: &'s Step, out: &mut Vec<&'s [Stmt]>) {
        for item in &step.body {
            if let StepItemKind::Entry(block) | StepItemKind::Exit(block) = &item.kind {
                out.push(block);
            }
        }
    }
    match item {
        Item::Step(inner) => step(inner, out),
        Item::Transition(transition) => out.push(&transition.actions),
        Item::State(state) => {
            step(&state.step, out);
            if let Some((_, content)) = &state.initial {
                out.push(content);
            }
            for history in &state.histories {
                out.push(&history.content);
            }
            for item in &state.items {
                blocks_of(item, out);
            }
        }
        _ => {}
    }
}

/// The finding about a `<cancel>` of a send that is never pending. `dead` is a <send> with this identifier that is never executed.
fn never_sent(id: &Name, dead: Option<Span>, near: Option<String>) -> Diagnostic {
    let finding = |message: String| {
        Diagnostic::warning(codes::SCXML_NEVER, message).at(id.span, "has no effect")
    };
    match (dead, near) {
        (Some(send), _) => {
            finding(format!("the <send> with the identifier `{id}` is never executed"))
                .at(send, "its transition waits for an event that never occurs")
                .help("correct the event of that transition, or remove this <cancel>")
        }
        (None, Some(near)) => finding(format!("no <send> has the identifier `{id}`"))
            .help(format!("did you mean `{near}`?"))
            .fix(id.span, near),
        (None, None) => finding(format!("no <send> has the identifier `{id}`")).help(format!(
            "give the <send> that it cancels the attribute id=\"{id}\", or remove this <cancel>"
        )),
    }
}
