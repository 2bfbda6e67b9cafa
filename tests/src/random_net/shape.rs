//! Random Grafcet charts: sequences, choices and parallel branches, closed to a loop; with odd additions.

use grafsynth_ir::Span;
use grafsynth_ir::net::{
    Enter, Expr, Forcing, ForcingOrder, Meta, Part, PartId, Policy, StepId, StepKind, Transition,
    TransitionId, TransitionKind,
};

use super::{Builder, name, step};

/// A transition whose receptivity is not generated yet: only its source and target steps are known.
struct Ends {
    part: PartId,
    from: Vec<StepId>,
    to: Vec<StepId>,
}

impl Builder<'_> {
    /// Generates steps and, for each part, the ends of its transitions; receptivities are generated later, when all steps are known.
    pub(super) fn steps(&mut self) {
        let n_steps = 1 + self.random.below(self.on.max_steps.max(1));
        let n_parts = if self.on.several_parts && self.random.one_in(3) {
            2 + self.random.below(2)
        } else {
            1
        };
        for index in 1..=n_parts {
            let part = self.part(format!("g{index}"), 1);
            let share = (n_steps / n_parts).max(1);
            for at in 0..share {
                let id = self.net.steps.len() + 1;
                let is_initial = at == 0 || (self.on.odd_shapes && self.random.one_in(8));
                self.net.steps.push(step(format!("s{id}"), part, is_initial));
            }
        }
        let is_age = self.net.settings.policy == Policy::PriorityAge;
        for id in self.net.steps.ids() {
            if is_age && self.random.one_in(2) {
                self.net.steps[id].priority = Some(1 + self.random.below(3) as u32);
            }
        }
        if self.wants(self.on.enclosing, 3) {
            self.enclose();
        }
    }

    fn part(&mut self, text: String, level: u32) -> PartId {
        let priority =
            if self.random.one_in(2) { Some(1 + self.random.below(3) as u32) } else { None };
        self.net.parts.push(Part { name: name(text), level, priority, ..Part::default() })
    }

    /// Makes one or two steps enclosing steps, with a few steps inside.
    fn enclose(&mut self) {
        let mut outer = self.any_step();
        for depth in 0..1 + self.random.below(2) {
            let level = self.net.parts[self.net.steps[outer].part].level + 1;
            let part = self.part(format!("inside{}", depth + 1), level);
            self.net.steps[outer].kind = StepKind::Enclosing;
            let mut last = outer;
            for _ in 0..1 + self.random.below(3) {
                let id = self.net.steps.len() + 1;
                let mut inner = step(format!("s{id}"), part, self.random.one_in(12));
                inner.parent = Some(outer);
                inner.activation_link = self.random.one_in(2);
                if self.net.settings.policy == Policy::PriorityAge && self.random.one_in(2) {
                    inner.priority = Some(1 + self.random.below(3) as u32);
                }
                last = self.net.steps.push(inner);
            }
            outer = last;
        }
    }

    pub(super) fn transitions(&mut self) {
        let mut all: Vec<Ends> = Vec::new();
        for part in self.net.parts.ids() {
            let steps: Vec<StepId> = self
                .net
                .steps
                .iter()
                .filter(|(_, step)| step.part == part)
                .map(|(id, _)| id)
                .collect();
            let Some(first) = steps.first().copied() else { continue };
            self.path(part, &steps[1..], &[first], &[first], &mut all);
            if self.on.odd_shapes {
                self.odd_ends(part, &steps, &mut all);
            }
        }
        // Transitions and reactions are mixed, as a designer would write them.
        for ends in all {
            self.transition(ends, None);
            if self.wants(self.on.reactions, 6) {
                self.reaction();
            }
        }
        if self.wants(self.on.conflict_chains, 4) {
            self.conflict_chain();
        }
    }

    /// Adds a chain of steps in which each transition competes with its neighbours: the winner is determined link by link, so a policy takes as many
    /// rounds as the chain is long. All links share one receptivity, because long chains would otherwise rarely compete at once; the transitions back
    /// often wait until it is false, so that the evolution of a stable chart ends.
    fn conflict_chain(&mut self) {
        let part = PartId::from_index(0);
        let links = 3 + self.random.below(5);
        let is_age = self.net.settings.policy == Policy::PriorityAge;
        let more = |builder: &mut Self, is_initial: bool| {
            let id = builder.net.steps.len() + 1;
            let mut step = step(format!("s{id}"), part, is_initial);
            if is_age && builder.random.one_in(4) {
                step.priority = Some(1 + builder.random.below(3) as u32);
            }
            builder.net.steps.push(step)
        };
        let shared: Vec<StepId> = (0..=links).map(|_| more(self, true)).collect();
        let won: Vec<StepId> = (0..links).map(|_| more(self, false)).collect();
        let rests = self.random.one_in(2);
        let (go, back) = if rests {
            let go = self.input_leaf();
            (go.clone(), Some(go.not()))
        } else {
            (self.receptivity(), None)
        };
        let mut pairs: Vec<(Vec<StepId>, StepId)> =
            shared.windows(2).map(<[StepId]>::to_vec).zip(won).collect();
        for at in (1..pairs.len()).rev() {
            pairs.swap(at, self.random.below(at + 1));
        }
        for (from, to) in pairs {
            self.transition(Ends { part, from: from.clone(), to: vec![to] }, Some(&go));
            self.transition(Ends { part, from: vec![to], to: from }, back.as_ref());
        }
    }

    /// Transitions that lead from `from` through all of `steps` to `to`: a sequence, a choice or parallel branches.
    fn path(
        &mut self,
        part: PartId,
        steps: &[StepId],
        from: &[StepId],
        to: &[StepId],
        all: &mut Vec<Ends>,
    ) {
        let ends =
            |from: &[StepId], to: &[StepId]| Ends { part, from: from.to_vec(), to: to.to_vec() };
        if steps.is_empty() {
            all.push(ends(from, to));
            return;
        }
        if steps.len() == 1 || self.random.one_in(2) {
            let cut = 1;
            all.push(ends(from, &steps[..cut]));
            self.path(part, &steps[cut..], &steps[..cut], to, all);
            return;
        }
        let cut = 1 + self.random.below(steps.len() - 1);
        let (left, right) = steps.split_at(cut);
        if self.random.one_in(2) {
            // Choice: both branches lead from the same steps to the same steps.
            for branch in [left, right] {
                self.path(part, branch, from, to, all);
            }
        } else {
            // Parallel: one transition opens both branches, one closes them.
            let (first_left, rest_left) = (left[0], &left[1..]);
            let (first_right, rest_right) = (right[0], &right[1..]);
            all.push(ends(from, &[first_left, first_right]));
            let last_left = self.branch(part, first_left, rest_left, all);
            let last_right = self.branch(part, first_right, rest_right, all);
            all.push(ends(&[last_left, last_right], to));
        }
    }

    /// A sequence within a parallel branch; returns its last step.
    fn branch(
        &mut self,
        part: PartId,
        first: StepId,
        rest: &[StepId],
        all: &mut Vec<Ends>,
    ) -> StepId {
        let Some((last, before)) = rest.split_last() else { return first };
        self.path(part, before, &[first], &[*last], all);
        *last
    }

    /// Transitions that a careful designer would not draw.
    fn odd_ends(&mut self, part: PartId, steps: &[StepId], all: &mut Vec<Ends>) {
        for _ in 0..self.random.below(4) {
            let from = self.some(steps);
            let to = self.some(steps);
            if !(from.is_empty() && to.is_empty()) {
                all.push(Ends { part, from, to });
            }
        }
    }

    /// None to three of the steps, in declaration order.
    fn some(&mut self, steps: &[StepId]) -> Vec<StepId> {
        let count = [0, 1, 1, 1, 1, 2, 2, 3][self.random.below(8)];
        let mut some: Vec<StepId> =
            (0..count).filter_map(|_| self.random.pick(steps).copied()).collect();
        some.sort_unstable();
        some.dedup();
        some
    }

    /// Adds the transition with this receptivity, or with a random one.
    fn transition(&mut self, ends: Ends, receptivity: Option<&Expr>) {
        let above: Vec<TransitionId> = (self.net.transitions.iter())
            .filter(|(_, other)| other.kind == TransitionKind::Move)
            .filter(|(_, other)| other.requires.iter().any(|step| ends.from.contains(step)))
            .map(|(id, _)| id)
            .collect();
        let mut guard = receptivity.cloned().unwrap_or_else(|| self.receptivity());
        if receptivity.is_none() && !above.is_empty() && self.wants(self.on.otherwise, 3) {
            let otherwise = self.otherwise(&above);
            guard = if self.random.one_in(2) { otherwise } else { Expr::and([otherwise, guard]) };
        }
        let mut events = Vec::new();
        if receptivity.is_none() && self.random.one_in(6) {
            events.extend(self.any_event(false));
        }
        let restart = self.wants(self.on.restart, 8);
        let priority = match self.net.settings.policy {
            Policy::Priority if !self.random.one_in(3) => Some(1 + self.random.below(3) as u32),
            _ => None,
        };
        let actions = if self.random.one_in(4) { self.list(2) } else { Vec::new() };
        let id = self.net.transitions.len() + 1;
        self.net.transitions.push(Transition {
            name: name(format!("t{id}")),
            part: ends.part,
            kind: TransitionKind::Move,
            clears: ends.from.clone(),
            requires: ends.from,
            enters: ends.to.into_iter().map(Enter::Step).collect(),
            events,
            guard,
            priority,
            restart,
            actions,
            deadline_ns: None,
            meta: Meta::default(),
        });
    }

    /// Adds a reaction of a step: mostly with an event, because one that only has a level as its condition would be a livelock in `stable`.
    pub(super) fn reaction(&mut self) {
        let step = self.any_step();
        if self.net.steps[step].kind == StepKind::Final {
            return;
        }
        let mut events: Vec<_> = self.any_event(false).into_iter().collect();
        let guard = if events.is_empty() || self.random.one_in(3) {
            self.receptivity()
        } else {
            Expr::bool(true)
        };
        if self.random.one_in(6) {
            events.clear();
        }
        let actions = self.list(2);
        let id = self.net.transitions.len() + 1;
        self.net.transitions.push(Transition {
            name: name(format!("t{id}")),
            part: self.net.steps[step].part,
            kind: TransitionKind::Reaction,
            requires: vec![step],
            clears: Vec::new(),
            enters: Vec::new(),
            events,
            guard,
            priority: None,
            restart: false,
            actions,
            deadline_ns: None,
            meta: Meta::default(),
        });
    }

    /// Generates forcing orders from earlier root charts to later ones, so that there is no cycle.
    pub(super) fn forcing(&mut self) {
        let roots: Vec<PartId> =
            self.net.parts.iter().filter(|(_, part)| part.level == 1).map(|(id, _)| id).collect();
        if roots.len() < 2 || !self.wants(self.on.forcing, 2) {
            return;
        }
        for _ in 0..1 + self.random.below(3) {
            let above = self.random.below(roots.len() - 1);
            let below = above + 1 + self.random.below(roots.len() - above - 1);
            let target = self.whole_chart(roots[below]);
            let forcing_parts = self.whole_chart(roots[above]);
            let of = |parts: &[PartId]| -> Vec<StepId> {
                self.net
                    .steps
                    .iter()
                    .filter(|(_, step)| parts.contains(&step.part))
                    .map(|(id, _)| id)
                    .collect()
            };
            let (forcing_steps, forced_steps) = (of(&forcing_parts), of(&target));
            let Some(step) = self.random.pick(&forcing_steps).copied() else { continue };
            let order = match self.random.below(4) {
                0 => ForcingOrder::Hold,
                1 => ForcingOrder::Situation(Vec::new()),
                2 => {
                    let is_initial = |step: &StepId| self.net.steps[*step].is_initial;
                    let initial = forced_steps.iter().copied().filter(is_initial).collect();
                    ForcingOrder::Situation(self.closed(initial))
                }
                _ => {
                    let some = self.some(&forced_steps);
                    ForcingOrder::Situation(self.closed(some))
                }
            };
            self.net.forcings.push(Forcing { step, target, order, span: Span::default() });
        }
    }

    /// A root part with the parts of its enclosing steps.
    fn whole_chart(&self, root: PartId) -> Vec<PartId> {
        let mut parts = vec![root];
        for step in self.net.steps.values() {
            if let Some(parent) = step.parent
                && parts.contains(&self.net.steps[parent].part)
                && !parts.contains(&step.part)
            {
                parts.push(step.part);
            }
        }
        parts
    }

    /// The steps with all steps that they activate along activation links.
    fn closed(&self, mut steps: Vec<StepId>) -> Vec<StepId> {
        for (id, step) in self.net.steps.iter() {
            if step.activation_link
                && step.parent.is_some_and(|parent| steps.contains(&parent))
                && !steps.contains(&id)
            {
                steps.push(id);
            }
        }
        steps.sort_unstable();
        steps
    }
}
