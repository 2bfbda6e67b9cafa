//! The questions that a statechart asks about the events of its row (semantics §5), while a simulator records them.
//!
//! An event that fires nothing is dropped, so whether it occurs changes only how many events fit into the queue behind it. Therefore the question is not whether
//! an event occurs but whether it is in the queue, and it is asked only when the event would fire something; an absent event is tried for that purpose.

use grafsynth_ir::net::{InputId, InputKind, Leaf, PropertyLeaf, PropertyRole};

use crate::asked::Question;
use crate::notes::Noticed;
use crate::reaction::{Reaction, Trigger};

impl Reaction<'_> {
    /// Prepares the questions about the events of the row, after the due sends have joined the external queue.
    pub(crate) fn record_events(&mut self, inputs: &[i64]) {
        if self.work.recorder.is_none() {
            return;
        }
        let is_row_event = |event: &InputId| {
            self.net.inputs[*event].kind == InputKind::Event && self.tables.listened[event.index()]
        };
        let events: Vec<InputId> =
            self.tables.events.iter().copied().filter(is_row_event).collect();
        let n_due = self.state.external.len();
        let room = self.queue_bound().saturating_sub(n_due).min(events.len());
        let is_present: Vec<bool> = (events.iter())
            .map(|event| inputs.get(event.index()).is_some_and(|value| *value != 0))
            .collect();
        // The notes name each event that is lost. For an event that the notes already contain, it does not matter whether it is lost again.
        let is_named: Vec<bool> =
            (events.iter()).map(|event| self.notes.contains(Noticed::QueueFull(*event))).collect();
        let n_present = is_present.iter().filter(|it| **it).count();
        let is_lazy = self.is_absence_without_effect(&events);
        self.record(|_, recorder| {
            let len = events.len();
            let list = recorder.asked.lists.insert_full(events).0;
            let mut before = 0;
            for (place, is_present) in is_present.iter().enumerate() {
                if !is_lazy {
                    let is_queued = *is_present && before < room;
                    recorder.ask(Question::Queued { list, place, room }, i64::from(is_queued));
                }
                before += usize::from(*is_present);
            }
            before = 0;
            for (place, (is_present, is_named)) in is_present.iter().zip(is_named).enumerate() {
                let is_lost = *is_present && before >= room;
                if place >= room && !is_named {
                    recorder.ask(Question::Lost { list, place, room }, i64::from(is_lost));
                    if is_lost {
                        break;
                    }
                }
                before += usize::from(*is_present);
            }
            if room < len {
                recorder.ask(Question::Overflow { list, room }, i64::from(n_present > room));
            }
            let next = if is_lazy { 0 } else { len };
            let queued = n_present.min(room);
            recorder.events =
                crate::asked::Events { list, len, next, room, n_due, queued, skipped: 0 };
        });
    }

    /// True if an event that fires nothing has no effect except that it occupies a place in the queue, and if it can be added to any row. (Such an event also
    /// restarts the count of micro-steps; this matters if events that are sent without delay follow.)
    fn is_absence_without_effect(&self, events: &[InputId]) -> bool {
        let net = self.net;
        let reads = |leaf: &PropertyLeaf| matches!(leaf, PropertyLeaf::Net(Leaf::Input(input)) if events.contains(input));
        let is_assumed = |property: &grafsynth_ir::net::Property| {
            property.role == PropertyRole::Assume && property.never.leaves().any(reads)
        };
        !net.settings.events_exclusive
            && !net.sends.values().any(|send| send.delay == 0)
            && !net.properties.iter().any(is_assumed)
    }

    /// Before an event is taken from the external queue: asks about the events that would have been in front of it and would have fired something.
    pub(crate) fn record_absent_events(&mut self) {
        let Some(recorder) = &self.work.recorder else { return };
        let events = &recorder.events;
        if events.n_due > 0 || events.next >= events.len {
            return;
        }
        let list = recorder.asked.lists[events.list].clone();
        let front = self.state.external.front().filter(|_| self.work.n_latched > 0);
        let end = front.and_then(|event| list.iter().position(|one| one == event));
        for place in events.next..end.unwrap_or(list.len()) {
            self.check(Trigger::Event(list[place]));
            self.select_in_statechart();
            self.work.rounds -= 1;
            let would_fire = !self.work.chosen.is_empty();
            self.record(|_, recorder| {
                recorder.events.next = place + 1;
                if would_fire {
                    let (list, room) = (recorder.events.list, recorder.events.room);
                    recorder.ask(Question::Queued { list, place, room }, 0);
                } else {
                    recorder.events.skipped += 1;
                }
            });
        }
    }

    /// After an event has been taken from the external queue: if it fires something, records the question whether it is in the queue.
    pub(crate) fn record_taken_event(&mut self) {
        let fires = !self.work.chosen.is_empty();
        self.record(|_, recorder| {
            let events = &mut recorder.events;
            if events.n_due > 0 {
                events.n_due -= 1;
            } else if events.next < events.len {
                let (list, place, room) = (events.list, events.next, events.room);
                events.next += 1;
                if fires {
                    recorder.ask(Question::Queued { list, place, room }, 1);
                }
            }
        });
    }

    /// The number of checks that events without effect can add to this reaction: one for the event, and one without an event after it.
    pub(crate) fn record_more_rounds(&mut self) {
        self.record(|_, recorder| {
            let events = &recorder.events;
            let more = events.skipped.min(events.room - events.queued);
            recorder.asked.more_rounds = u32::try_from(2 * more).unwrap_or(u32::MAX);
        });
    }
}
