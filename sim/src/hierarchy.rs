//! NEXT of semantics §3.9, and forcing: semantics §3.2, §8.

use grafsynth_ir::net::{Enter, StepId, StepKind, TransitionId};

use crate::notes::Noticed;
use crate::reaction::Reaction;
use crate::tables::{self, ForcedChart};

impl Reaction<'_> {
    /// R2: activates the initial steps, closed downwards, then applies forcing; also initialises the order of last activation.
    pub(crate) fn r2_initial_situation(&mut self) {
        let initial = self.net.steps.iter().filter(|(_, step)| step.is_initial).map(|(id, _)| id);
        let closed = tables::closure(self.net, &self.tables.children, initial);
        self.work.next.clear();
        self.work.restarted.clear();
        closed.iter().for_each(|step| self.work.next.insert(*step));
        // `hold` keeps the situation at the start, which at reset is the initial situation [C3].
        self.state.situation.copy_from(&self.work.next);
        self.n3_force();
        self.state.situation.clear();
        for order in &self.tables.layout.ages {
            let (active, rest): (Vec<StepId>, Vec<StepId>) =
                order.steps.iter().partition(|step| self.work.next.contains(**step));
            for (place, step) in rest.into_iter().chain(active).enumerate() {
                self.state.cells[order.base + place] = step.index() as i64;
            }
        }
    }

    /// NEXT(X, F') of §3.9: computes Y in `next` and RS in `restarted`.
    pub(crate) fn next(&mut self) {
        self.n1_move();
        if !self.tables.enclosing.is_empty() {
            self.n2_enclose();
        }
        if !self.tables.forced.is_empty() {
            self.n3_force();
        }
    }

    fn n1_move(&mut self) {
        let net = self.net;
        let situation = &self.state.situation;
        let work = &mut *self.work;
        let moves = || work.chosen.iter().map(|transition| &net.transitions[*transition]);
        let steps_after = |enters: &'_ [Enter]| -> Vec<StepId> {
            enters
                .iter()
                .filter_map(|enter| if let Enter::Step(step) = enter { Some(*step) } else { None })
                .collect()
        };
        work.next.copy_from(situation);
        work.restarted.clear();
        for transition in moves() {
            transition.clears.iter().for_each(|step| work.next.remove(*step));
        }
        for transition in moves().filter(|transition| transition.restart) {
            for step in steps_after(&transition.enters) {
                // Such a step is removed now and added again below: RS := X ∩ pre(F') ∩ post(restart).
                if situation.contains(step) && !work.next.contains(step) {
                    work.restarted.insert(step);
                }
            }
        }
        for transition in moves() {
            for enter in &transition.enters {
                if let Enter::Step(step) = enter {
                    work.next.insert(*step);
                }
            }
        }
    }

    /// N2: a deactivated step deactivates all steps inside it; an activated step activates those that it has an activation link to.
    fn n2_enclose(&mut self) {
        let tables = self.tables;
        let net = self.net;
        let situation = &self.state.situation;
        let work = &mut *self.work;
        for enclosing in &tables.enclosing {
            let was_active = situation.contains(*enclosing);
            let restarts = work.restarted.contains(*enclosing);
            let leaves = was_active && (!work.next.contains(*enclosing) || restarts);
            let cleared = &mut work.some_steps;
            cleared.clear();
            if leaves {
                let mut inside: Vec<StepId> = tables.children[enclosing.index()].clone();
                while let Some(step) = inside.pop() {
                    inside.extend(&tables.children[step.index()]);
                    cleared.set(step, situation.contains(step));
                    work.next.remove(step);
                    work.restarted.remove(step);
                }
            }
            if work.next.contains(*enclosing) && (!was_active || restarts) {
                for child in &tables.children[enclosing.index()] {
                    if net.steps[*child].activation_link {
                        work.next.insert(*child);
                        if cleared.contains(*child) {
                            work.restarted.insert(*child);
                        }
                    }
                }
            }
        }
    }

    /// N3: each forced chart gets the situation of the first declared order whose forcing step is active.
    fn n3_force(&mut self) {
        let tables = self.tables;
        for chart in &tables.forced {
            let mut active = chart.orders.iter().filter(|(step, _)| self.work.next.contains(*step));
            let Some((_, asked)) = active.next() else { continue };
            if active.any(|(_, other)| other != asked) {
                self.notes.add(Noticed::ForcingRace(chart.part));
            }
            for step in &chart.steps {
                let is_wanted = match asked {
                    Some(situation) => situation.binary_search(step).is_ok(),
                    None => self.state.situation.contains(*step),
                };
                self.work.next.set(*step, is_wanted);
                self.work.restarted.remove(*step);
            }
            // Parents come before the steps that they enclose, so one pass handles all levels.
            for step in &chart.steps {
                let parent = self.net.steps[*step].parent;
                let is_shut = parent.is_some_and(|parent| {
                    self.net.steps[parent].kind == StepKind::Enclosing
                        && !self.work.next.contains(parent)
                });
                if is_shut {
                    self.work.next.remove(*step);
                }
            }
        }
    }

    /// K3: transitions of a chart that some active step forces are removed from the selection.
    pub(crate) fn k3_remove_forced_now(&mut self) {
        let tables = self.tables;
        for chart in &tables.forced {
            if chart.orders.iter().any(|(step, _)| self.state.situation.contains(*step)) {
                self.remove_transitions_of(chart);
            }
        }
    }

    /// K5: transitions of a chart that becomes forced in this micro-step do not fire either.
    pub(crate) fn k5_remove_newly_forced(&mut self) {
        let tables = self.tables;
        for chart in &tables.forced {
            self.next();
            if chart.orders.iter().any(|(step, _)| self.work.next.contains(*step)) {
                self.remove_transitions_of(chart);
            }
        }
    }

    fn remove_transitions_of(&mut self, chart: &ForcedChart) {
        let mut chosen = std::mem::take(&mut self.work.chosen);
        let is_free = |transition: &TransitionId| {
            self.is_reaction(*transition)
                || !chart.has_part[self.net.transitions[*transition].part.index()]
        };
        chosen.retain(is_free);
        self.work.chosen = chosen;
    }
}
