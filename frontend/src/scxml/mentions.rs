//! Information about a chart for writers: the transitions that leave each state, and the first mention of each event.

use std::collections::{BTreeMap, BTreeSet};

use grafsynth_ir::chart::{
    Expr, Item, State, Step, StepItemKind, StepRole, Stmt, StmtKind, Transition, statements,
};
use grafsynth_ir::{Name, Span};

/// A transition of a state: written next to the state, or as a reaction inside it.
pub(super) enum Leaving<'c> {
    Transition(&'c Transition),
    Reaction { events: &'c [Name], guard: Option<&'c Expr>, actions: &'c [Stmt], span: Span },
}

/// The state or step of an item.
pub(super) fn state_of(item: &Item) -> Option<(&Step, Option<&State>)> {
    if let Item::State(state) = item {
        Some((&state.step, Some(state)))
    } else if let Item::Step(step) = item {
        Some((step, None))
    } else {
        None
    }
}

/// The state of a list that is marked as initial.
pub(super) fn marked(items: &[Item]) -> Option<&str> {
    let mut steps = items.iter().filter_map(state_of).map(|(step, _)| step);
    steps.find(|step| step.role == StepRole::Initial).map(|step| step.name.text.as_str())
}

/// The first mentions of events, in document order.
pub(super) struct Mentions<'m, 'c> {
    pub(super) place: u32,
    pub(super) mentioned: &'m mut BTreeMap<&'c str, u32>,
    pub(super) raised: &'m mut BTreeSet<&'c str>,
}

impl<'c> Mentions<'_, 'c> {
    fn name(&mut self, name: &'c Name) {
        self.place += 1;
        self.mentioned.entry(&name.text).or_insert(self.place);
    }

    fn block(&mut self, block: &'c [Stmt]) {
        for stmt in statements(block) {
            if let StmtKind::Raise(event) | StmtKind::Send { event, .. } = &stmt.kind {
                self.name(event);
                self.raised.insert(&event.text);
            }
        }
    }

    pub(super) fn item(&mut self, item: &'c Item, leaving: &BTreeMap<&'c str, Vec<Leaving<'c>>>) {
        let Some((step, state)) = state_of(item) else { return };
        if let Some((_, content)) = state.and_then(|state| state.initial.as_ref()) {
            self.block(content);
        }
        for wanted_entry in [true, false] {
            for item in &step.body {
                let block = if let StepItemKind::Entry(block) = &item.kind {
                    wanted_entry.then_some(block)
                } else if let StepItemKind::Exit(block) = &item.kind {
                    (!wanted_entry).then_some(block)
                } else {
                    None
                };
                block.into_iter().for_each(|block| self.block(block));
            }
        }
        for one in leaving.get(step.name.text.as_str()).into_iter().flatten() {
            let (events, actions) = match one {
                Leaving::Transition(one) => (one.events.as_slice(), one.actions.as_slice()),
                Leaving::Reaction { events, actions, .. } => (*events, *actions),
            };
            for event in events {
                self.name(event);
            }
            self.block(actions);
        }
        if let Some(state) = state {
            for history in &state.histories {
                self.block(&history.content);
            }
            for item in &state.items {
                self.item(item, leaving);
            }
        }
    }
}
