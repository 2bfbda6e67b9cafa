//! Events and sends that can occur. An event that nothing raises or sends triggers no transition; so the events and sends of the transitions that need it do
//! not occur either, unless something else causes them. A program may leave all of these out. The proof shows at each check that they do not occur.

use std::collections::BTreeSet;

use grafsynth_ir::net::{InputId, InputKind, Net, SendId, Stmt, StmtKind};
use grafsynth_ir::walk::statements;

/// The events and sends of a net that can occur.
#[derive(Debug, Clone, Default)]
pub(super) struct Possible {
    pub(super) events: BTreeSet<InputId>,
    pub(super) slots: BTreeSet<SendId>,
}

impl Possible {
    pub(super) fn of(net: &Net) -> Self {
        let mut all = Possible::default();
        let is_of_row = |kind: InputKind| kind == InputKind::Event;
        all.events.extend(net.inputs.iter().filter(|it| is_of_row(it.1.kind)).map(|it| it.0));
        for step in net.steps.values() {
            all.events.extend(step.done_event);
            for list in [&step.entry, &step.exit, &step.initial_content] {
                all.add(net, list);
            }
            step.tasks.iter().for_each(|task| all.add(net, &task.body));
        }
        net.histories.values().for_each(|history| all.add(net, &history.default_content));
        net.actions.values().for_each(|action| all.add(net, &action.body));
        loop {
            let before = (all.events.len(), all.slots.len());
            for transition in net.transitions.values() {
                let events = &transition.events;
                if events.is_empty() || events.iter().any(|event| all.events.contains(event)) {
                    all.add(net, &transition.actions);
                }
            }
            if before == (all.events.len(), all.slots.len()) {
                return all;
            }
        }
    }

    /// Adds what a list raises and sends.
    fn add(&mut self, net: &Net, list: &[Stmt]) {
        for stmt in statements(list) {
            if let StmtKind::Raise(event) = stmt.kind {
                self.events.insert(event);
            } else if let StmtKind::Send(slot) = stmt.kind {
                self.slots.insert(slot);
                self.events.insert(net.sends[slot].event);
            }
        }
    }
}
