//! The invariants of every statechart: which states can be active together, and what a history can have recorded. They are proved for each net, by
//! induction over one micro-step in which any fireable transitions may be selected.

use grafsynth_ir::net::{HistoryId, StepId, StepKind};

use super::super::Model;
use super::super::aig::Lit;
use super::super::reaction::{Maker, Unsupported};
use super::super::state::State;
use super::tree::Tree;
use crate::limits::Limits;

impl Maker<'_> {
    /// The invariants of a state, each a condition:
    /// - an active composite state has exactly one active child, an active parallel state has only active children, and an inactive state none;
    /// - exactly one top-level state of each chart is active;
    /// - time and task index of an inactive state are 0;
    /// - the states that a history has recorded could have been active together.
    pub(in crate::symbolic) fn structure(&mut self, state: &State) -> Vec<Lit> {
        let net = self.net;
        let children = self.chart().tree.children.clone();
        let mut all = Vec::new();
        for (id, step) in net.steps.iter() {
            let own = state.active[id.index()];
            let inside: Vec<Lit> =
                children[id.index()].iter().map(|child| state.active[child.index()]).collect();
            if step.kind == StepKind::Composite && !inside.is_empty() {
                let one = self.exactly_one(&inside);
                let none = !self.aig.or_all(inside);
                all.push(self.aig.ite(own, one, none));
            } else if step.kind == StepKind::Parallel {
                for child in inside {
                    all.push(!self.aig.xor(own, child));
                }
            }
            let counters = [&state.elapsed[id.index()], &state.task[id.index()]];
            for bit in counters.into_iter().flatten().flat_map(|number| number.bits().to_vec()) {
                all.push(self.aig.or(!bit, own));
            }
        }
        let charts = self.chart().tree.chart_of.clone();
        for chart in net.parts.ids() {
            let top: Vec<Lit> = net
                .steps
                .iter()
                .filter(|(_, step)| step.parent.is_none() && charts[step.part.index()] == chart)
                .map(|(id, _)| state.active[id.index()])
                .collect();
            if !top.is_empty() {
                all.push(self.exactly_one(&top));
            }
        }
        for (id, history) in net.histories.iter() {
            all.extend(self.recorded_structure(state, id, history.owner));
        }
        all.retain(|lit| *lit != Lit::TRUE);
        all
    }

    fn exactly_one(&mut self, lits: &[Lit]) -> Lit {
        let (mut one, mut more) = (Lit::FALSE, Lit::FALSE);
        for lit in lits {
            let both = self.aig.and(one, *lit);
            more = self.aig.or(more, both);
            one = self.aig.or(one, *lit);
        }
        self.aig.and(one, !more)
    }

    /// The invariants of what a history recorded in a state and its descendants.
    fn recorded_structure(&mut self, state: &State, history: HistoryId, owner: StepId) -> Vec<Lit> {
        let net = self.net;
        let children = self.chart().tree.children.clone();
        // For each state, whether anything in it was recorded.
        let mut any = vec![Lit::FALSE; net.steps.len()];
        let mut all = Vec::new();
        for id in net.steps.ids().rev() {
            if let Some(recorded) = state.recorded.get(&(history, id)) {
                any[id.index()] = *recorded;
                continue;
            }
            let inside: Vec<Lit> =
                children[id.index()].iter().map(|child| any[child.index()]).collect();
            any[id.index()] = self.aig.or_all(inside.iter().copied());
            if any[id.index()] == Lit::FALSE || !Tree::is_within(net, id, owner) {
                continue;
            }
            match net.steps[id].kind {
                StepKind::Composite => {
                    let one = self.exactly_one(&inside);
                    all.push(self.aig.or(!any[id.index()], one));
                }
                StepKind::Parallel => {
                    // A shallow history of a parallel state records its regions, a deep one something in each.
                    for child in inside {
                        all.push(self.aig.or(!any[id.index()], child));
                    }
                }
                StepKind::Leaf | StepKind::Enclosing | StepKind::Final => {}
            }
        }
        all
    }
}

impl Model<'_> {
    /// Proves the invariants of the net by induction over one micro-step, and after reset.
    ///
    /// # Errors
    /// Returns a message if they are not proved.
    pub(in crate::symbolic) fn prove_structure(
        &mut self,
        limits: &Limits,
    ) -> Result<(), Unsupported> {
        let net = self.maker.net;
        let open = || "the structure of the states is not proved to be invariant".to_owned();
        let reset = self.maker.reset()?;
        if self.maker.structure(&reset.state).into_iter().any(|holds| holds != Lit::TRUE) {
            return Err(open());
        }
        let state = self.state.clone();
        let inputs = self.inputs.clone();
        let mut assumed: Vec<Lit> = self.maker.structure(&state);
        assumed.extend(self.valid.iter().map(|(_, holds)| *holds));
        self.maker.inputs = inputs;
        let mut after = state.clone();
        self.maker.latch(&mut after);
        let mut wanted = self.maker.structure(&after);
        // One micro-step: any transitions whose sources are active may be fireable.
        let mut after = state.clone();
        self.maker.begin_evolution(&mut after, true);
        let mut fireable = Vec::with_capacity(net.transitions.len());
        for transition in net.transitions.values() {
            let mut parts = vec![self.aig().variable()];
            parts.extend(transition.requires.iter().map(|step| state.active[step.index()]));
            parts.push(!self.maker.part_has_ended(&state, transition.part));
            fireable.push(self.aig().and_all(parts));
        }
        let selected = self.maker.select_in_statechart(&after, &fireable);
        self.maker.fire_in_statechart(&mut after, &selected, Lit::TRUE)?;
        wanted.extend(self.maker.structure(&after));
        for holds in wanted {
            let mut query = assumed.clone();
            query.push(!holds);
            if self.maker.aig.settle(&query, &[], &|_| 0, limits) != Some(None) {
                return Err(open());
            }
        }
        Ok(())
    }
}
