//! Rewrites a statechart with the features of SCXML: delays become events that are sent and cancelled, and conditions give priority to
//! outer states.
//!
//! ```text
//! s -> t after 3 s               s { entry { send s_after after 3 s as s_after } exit { cancel s_after } }   s -> t on s_after
//! s -> t on E after 3 s    =>    the same, in s on s_after do { s_is_over := true }                          s -> t on E when s_is_over
//! conflict outer-first           s -> t on E when c and not d                                                for an outer p -> q on E when d
//! ```

use std::collections::{BTreeMap, BTreeSet};

use grafsynth_ir::chart::{
    Chart, Declaration, DeclarationKind, Expr, Item, Leaf, Length, Path, Setting, SettingKind,
    Step, StepItem, StepItemKind, Stmt, StmtKind, Transition,
};
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::expr::{ExprKind, Type};
use grafsynth_ir::net::{Meta, Policy};
use grafsynth_ir::{Name, Span};

use crate::codes;

/// Maximum number of repeated conditions.
const MAX_COPIES: usize = 20_000;

/// The rewritten chart and notes about the changes; `None` if the chart needs no change.
///
/// # Errors
/// If too many conditions would have to be repeated.
pub(super) fn legalize(chart: &Chart) -> Result<Option<(Chart, Vec<Diagnostic>)>, Box<Diagnostic>> {
    let mut rewritten = chart.clone();
    let mut notes = Vec::new();
    let constants = constants(&chart.items);
    spell_out(&mut rewritten.items, &constants);
    let delays = delays(&rewritten.items);
    if !delays.is_empty() {
        with_events(&mut rewritten, delays, &mut notes);
    }
    let outer = rewritten.items.iter_mut().find_map(|item| {
        let Item::Setting(setting) = item else { return None };
        let is_outer = setting.kind == SettingKind::Conflict(Policy::OuterFirst);
        is_outer.then_some(setting)
    });
    if let Some(setting) = outer {
        setting.kind = SettingKind::Conflict(Policy::InnerFirst);
        let span = setting.span;
        notes.push(
            note("`conflict outer-first` is written as conditions of the inner transitions")
                .at(span, ""),
        );
        let mut outer = Outer { leaving: BTreeMap::new(), around: Vec::new(), n_copies: 0 };
        outer.collect(&rewritten.items);
        outer.items(&mut rewritten.items);
        if outer.n_copies > MAX_COPIES {
            let finding = Diagnostic::error(
                codes::SCXML_CANNOT_WRITE,
                format!("`conflict outer-first` needs more than {MAX_COPIES} conditions in SCXML"),
            )
            .at(span, "in SCXML the inner state has priority");
            return Err(Box::new(finding));
        }
    }
    Ok((!notes.is_empty()).then_some((rewritten, notes)))
}

fn note(message: &str) -> Diagnostic {
    Diagnostic::note(codes::SCXML_CANNOT_WRITE, message.to_owned())
}

/// Collects the transitions of the given items, including those inside states.
fn transitions<'c>(items: &'c [Item], out: &mut Vec<&'c Transition>) {
    for item in items {
        match item {
            Item::Transition(transition) => out.push(transition),
            Item::State(state) => transitions(&state.items, out),
            _ => {}
        }
    }
}

fn source_of(transition: &Transition) -> Option<&Name> {
    match transition.sources.as_slice() {
        [source] => source.names.last(),
        _ => None,
    }
}

// --- delays ----------------------------------------------------------------------------------------------------------------------------------

/// Collects the named durations.
fn constants(items: &[Item]) -> BTreeMap<String, u64> {
    let mut found = BTreeMap::new();
    for item in items {
        if let Item::Declaration(Declaration {
            name, kind: DeclarationKind::Const { value }, ..
        }) = item
            && let ExprKind::Leaf(Leaf::Duration(ns)) = value.kind
        {
            found.insert(name.text.clone(), ns);
        }
    }
    found
}

/// Replaces the names of durations in `after NAME` by their values.
fn spell_out(items: &mut [Item], constants: &BTreeMap<String, u64>) {
    for item in items {
        if let Item::State(state) = item {
            spell_out(&mut state.items, constants);
        } else if let Item::Transition(transition) = item
            && let Some((length, _)) = &mut transition.after
            && let Length::Named(path) = length
            && let [name] = path.names.as_slice()
            && let Some(ns) = constants.get(&name.text)
        {
            *length = Length::Ns(*ns);
        }
    }
}

/// A delay of a state.
struct Delay {
    span: Span,
    /// True if all transitions with this delay wait only for the delay.
    is_alone: bool,
}

/// The delays of each state, in nanoseconds.
fn delays(items: &[Item]) -> BTreeMap<(String, u64), Delay> {
    let mut all = Vec::new();
    transitions(items, &mut all);
    let mut found: BTreeMap<(String, u64), Delay> = BTreeMap::new();
    for transition in all {
        let (Some((Length::Ns(ns), span)), Some(source)) =
            (&transition.after, source_of(transition))
        else {
            continue;
        };
        let (ns, span) = (*ns, *span);
        let is_alone = transition.events.is_empty() && transition.guard.is_none();
        let delay =
            found.entry((source.text.clone(), ns)).or_insert(Delay { span, is_alone: true });
        delay.is_alone &= is_alone;
    }
    found
}

/// The names created for a delay.
struct Made {
    event: Name,
    flag: Option<Name>,
}

fn with_events(
    chart: &mut Chart,
    delays: BTreeMap<(String, u64), Delay>,
    notes: &mut Vec<Diagnostic>,
) {
    let mut taken = BTreeSet::new();
    names(&chart.items, &mut taken);
    let mut fresh = |wanted: String, span: Span| {
        let mut text = wanted.clone();
        let mut number = 2_u32;
        while !taken.insert(text.clone()) {
            text = format!("{wanted}_{number}");
            number += 1;
        }
        Name::new(text, span)
    };
    let mut made: BTreeMap<(String, u64), Made> = BTreeMap::new();
    for ((state, ns), delay) in delays {
        notes.push(
            note("this delay is written as an event that is sent when the state is entered; delays that end in the same row are processed one after the other")
                .at(delay.span, ""),
        );
        let event = fresh(format!("{state}_after"), delay.span);
        let flag = (!delay.is_alone).then(|| fresh(format!("{state}_is_over"), delay.span));
        made.insert((state, ns), Made { event, flag });
    }
    let mut first = Vec::new();
    for one in made.values() {
        let meta = Meta { span: one.event.span, ..Meta::default() };
        let kind = DeclarationKind::Event { internal: true };
        first.push(Item::Declaration(Declaration {
            name: one.event.clone(),
            kind,
            meta: meta.clone(),
        }));
        if let Some(flag) = &one.flag {
            let kind = DeclarationKind::Var { ty: Type::Bool, len: None, init: Vec::new() };
            first.push(Item::Declaration(Declaration { name: flag.clone(), kind, meta }));
        }
    }
    let n_made = u32::try_from(made.len()).unwrap_or(u32::MAX);
    for item in &mut chart.items {
        if let Item::Setting(Setting { kind: SettingKind::Queue(bound), .. }) = item {
            *bound = bound.saturating_add(n_made);
        }
    }
    delayed_items(&mut chart.items, &made);
    for ((state, _), one) in &made {
        let Some(flag) = &one.flag else { continue };
        let span = one.event.span;
        chart.items.push(Item::Transition(Transition {
            sources: vec![Path::from(Name::new(state.clone(), span))],
            events: vec![one.event.clone()],
            is_internal: true,
            actions: vec![set(flag, true)],
            meta: Meta { span, ..Meta::default() },
            ..Transition::default()
        }));
    }
    // Declarations precede their uses.
    chart.items.splice(0..0, first);
}

fn set(flag: &Name, value: bool) -> Stmt {
    let value = Expr::new(ExprKind::Bool(value), flag.span);
    let target = Path::from(flag.clone());
    Stmt { kind: StmtKind::Assign { target, index: None, value }, span: flag.span }
}

fn names(items: &[Item], out: &mut BTreeSet<String>) {
    for item in items {
        match item {
            Item::Declaration(one) => {
                out.insert(one.name.text.clone());
            }
            Item::Step(one) => {
                out.insert(one.name.text.clone());
            }
            Item::State(one) => {
                out.insert(one.step.name.text.clone());
                out.extend(one.histories.iter().map(|it| it.name.text.clone()));
                names(&one.items, out);
            }
            Item::Transition(one) => out.extend(one.name.iter().map(|it| it.text.clone())),
            _ => {}
        }
    }
}

fn delayed_items(items: &mut [Item], made: &BTreeMap<(String, u64), Made>) {
    for item in items {
        match item {
            Item::Transition(transition) => {
                let Some((Length::Ns(ns), span)) = transition.after else { continue };
                let state = source_of(transition).map(|name| name.text.clone());
                let Some(one) = state.and_then(|state| made.get(&(state, ns))) else { continue };
                transition.after = None;
                match &one.flag {
                    None => transition.events = vec![one.event.clone()],
                    Some(flag) => {
                        let over = Expr::leaf(Leaf::Name(Path::from(flag.clone())), span);
                        let guard = transition.guard.take();
                        transition.guard = Some(Expr::and(guard.into_iter().chain([over])));
                    }
                }
            }
            Item::Step(step) => delayed_state(step, made),
            Item::State(state) => {
                delayed_state(&mut state.step, made);
                delayed_items(&mut state.items, made);
            }
            _ => {}
        }
    }
}

/// Adds a send to the entry of a state and a cancel to its exit, for each of its delays.
fn delayed_state(step: &mut Step, made: &BTreeMap<(String, u64), Made>) {
    let first = (step.name.text.clone(), 0);
    let last = (step.name.text.clone(), u64::MAX);
    for ((_, ns), one) in made.range(first..=last) {
        let (span, slot) = (one.event.span, one.event.clone());
        let send =
            StmtKind::Send { event: one.event.clone(), after: Some(*ns), slot: Some(slot.clone()) };
        let mut entry: Vec<Stmt> = one.flag.iter().map(|flag| set(flag, false)).collect();
        entry.push(Stmt { kind: send, span });
        let exit = vec![Stmt { kind: StmtKind::Cancel(slot), span }];
        step.body.push(StepItem { kind: StepItemKind::Entry(entry), span });
        step.body.push(StepItem { kind: StepItemKind::Exit(exit), span });
    }
}

// --- priority of the outer state --------------------------------------------------------------------------------------------------------------

/// The trigger of a transition: its events and its condition.
type Trigger = (Vec<String>, Option<Expr>);

struct Outer {
    /// The triggers by state.
    leaving: BTreeMap<String, Vec<Trigger>>,
    /// The ancestors of the current state, collected on the way down.
    around: Vec<String>,
    n_copies: usize,
}

impl Outer {
    fn collect(&mut self, items: &[Item]) {
        let text = |names: &[Name]| names.iter().map(|name| name.text.clone()).collect();
        for item in items {
            match item {
                Item::Transition(transition) => {
                    if let Some(source) = source_of(transition) {
                        let trigger = (text(&transition.events), transition.guard.clone());
                        self.leaving.entry(source.text.clone()).or_default().push(trigger);
                    }
                }
                Item::Step(step) => self.collect_body(step),
                Item::State(state) => {
                    self.collect_body(&state.step);
                    self.collect(&state.items);
                }
                _ => {}
            }
        }
    }

    fn collect_body(&mut self, step: &Step) {
        for item in &step.body {
            if let StepItemKind::On { events, guard, .. } = &item.kind {
                let events = events.iter().map(|name| name.text.clone()).collect();
                let trigger = (events, guard.clone());
                self.leaving.entry(step.name.text.clone()).or_default().push(trigger);
            }
        }
    }

    /// Rewrites all items. A transition may be written outside its source state, so the nesting of states is determined first.
    fn items(&mut self, items: &mut Vec<Item>) {
        let mut parents: BTreeMap<String, Vec<String>> = BTreeMap::new();
        self.ancestors(items, &mut parents);
        self.guarded(items, &parents);
    }

    fn ancestors(&mut self, items: &[Item], parents: &mut BTreeMap<String, Vec<String>>) {
        for item in items {
            if let Item::Step(step) = item {
                parents.insert(step.name.text.clone(), self.around.clone());
            }
            if let Item::State(state) = item {
                let name = state.step.name.text.clone();
                parents.insert(name.clone(), self.around.clone());
                self.around.push(name);
                self.ancestors(&state.items, parents);
                self.around.pop();
            }
        }
    }

    fn guarded(&mut self, items: &mut Vec<Item>, parents: &BTreeMap<String, Vec<String>>) {
        let mut out = Vec::with_capacity(items.len());
        for item in std::mem::take(items) {
            match item {
                Item::Transition(transition) => {
                    let state = source_of(&transition).map(|name| name.text.clone());
                    let around = state.and_then(|state| parents.get(&state));
                    let parts = self.parts(&transition.events, transition.guard.as_ref(), around);
                    for (at, (events, guard)) in parts.into_iter().enumerate() {
                        let mut copy = transition.clone();
                        (copy.events, copy.guard) = (events, guard);
                        if at > 0 {
                            copy.name = None;
                        }
                        out.push(Item::Transition(copy));
                    }
                }
                Item::Step(mut step) => {
                    self.guarded_body(&mut step, parents);
                    out.push(Item::Step(step));
                }
                Item::State(mut state) => {
                    self.guarded_body(&mut state.step, parents);
                    self.guarded(&mut state.items, parents);
                    out.push(Item::State(state));
                }
                other => out.push(other),
            }
        }
        *items = out;
    }

    fn guarded_body(&mut self, step: &mut Step, parents: &BTreeMap<String, Vec<String>>) {
        let around = parents.get(&step.name.text);
        let mut body = Vec::with_capacity(step.body.len());
        for item in std::mem::take(&mut step.body) {
            let StepItemKind::On { events, guard, actions } = &item.kind else {
                body.push(item);
                continue;
            };
            for (events, guard) in self.parts(events, guard.as_ref(), around) {
                let kind = StepItemKind::On { events, guard, actions: actions.clone() };
                body.push(StepItem { kind, span: item.span });
            }
        }
        step.body = body;
    }

    /// Splits a transition into one for each of its events that also triggers an outer transition, and one for the other events. Omits
    /// parts that an outer transition always overrides.
    fn parts(
        &mut self,
        events: &[Name],
        guard: Option<&Expr>,
        around: Option<&Vec<String>>,
    ) -> Vec<(Vec<Name>, Option<Expr>)> {
        let around = around.map_or(&[][..], Vec::as_slice);
        let mut parts: Vec<(Vec<Name>, Vec<Expr>)> = Vec::new();
        let wanted: Vec<Option<&Name>> =
            if events.is_empty() { vec![None] } else { events.iter().map(Some).collect() };
        for event in wanted {
            let mut blocking = Vec::new();
            let mut is_blocked = false;
            for (others, guard) in
                around.iter().filter_map(|state| self.leaving.get(state)).flatten()
            {
                let meets = match event {
                    Some(event) => others.contains(&event.text),
                    None => others.is_empty(),
                };
                match guard {
                    _ if !meets => {}
                    None => is_blocked = true,
                    Some(guard) => blocking.push(guard.clone()),
                }
            }
            if is_blocked {
                continue;
            }
            self.n_copies += blocking.len();
            if self.n_copies > MAX_COPIES {
                return Vec::new();
            }
            match parts.iter_mut().find(|(_, others)| *others == blocking) {
                Some((events, _)) => events.extend(event.cloned()),
                None => parts.push((event.cloned().into_iter().collect(), blocking)),
            }
        }
        let whole = |(events, blocking): (Vec<Name>, Vec<Expr>)| {
            let nots = blocking.into_iter().map(Expr::not);
            let mut all: Vec<Expr> = guard.cloned().into_iter().chain(nots).collect();
            let guard = match all.len() {
                0 => None,
                1 => all.pop(),
                _ => Some(Expr::and(all)),
            };
            (events, guard)
        };
        parts.into_iter().map(whole).collect()
    }
}
