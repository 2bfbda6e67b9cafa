//! The entry set and its lists: S4 of semantics §3.9, with histories, `done` events and the end of a chart.

use grafsynth_ir::net::{Enter, HistoryId, StepId, StepKind};

use super::super::aig::Lit;
use super::super::number::Number;
use super::super::reaction::Maker;
use super::super::state::State;

/// The entries of a micro-step, each with its condition.
#[derive(Debug)]
pub(super) struct Entries {
    /// For each step, whether it is entered.
    steps: Vec<Lit>,
    /// For each composite state, whether it is entered by default.
    by_default: Vec<Lit>,
    /// For each history, whether its default is taken.
    default_histories: Vec<Lit>,
}

impl Maker<'_> {
    /// The entry set of these items, with the histories as recorded now.
    pub(super) fn entries(&mut self, state: &State, items: &[(Enter, Lit)]) -> Entries {
        let net = self.net;
        let n = net.histories.len();
        // Histories may enter other histories: the conditions grow until nothing changes. Cycles end because each history is entered at most once.
        let mut wanted: Vec<Lit> = vec![Lit::FALSE; n];
        let mut all: Vec<(Enter, Lit)> = items.to_vec();
        let mut default_histories = vec![Lit::FALSE; n];
        for _ in 0..=n {
            all = items.to_vec();
            for (id, history) in net.histories.iter() {
                let asked = wanted[id.index()];
                if asked == Lit::FALSE {
                    continue;
                }
                let recorded: Vec<Lit> =
                    history.cases.iter().map(|case| self.recorded(state, id, case.step)).collect();
                let any = self.aig.or_all(recorded.iter().copied());
                let default = self.aig.and(asked, !any);
                default_histories[id.index()] = default;
                all.extend(history.default.iter().map(|item| (*item, default)));
                for (case, recorded) in history.cases.iter().zip(recorded) {
                    let chosen = self.aig.and(asked, recorded);
                    all.extend(case.enters.iter().map(|item| (*item, chosen)));
                }
            }
            let mut ways: Vec<Vec<Lit>> = vec![Vec::new(); n];
            for (item, condition) in &all {
                if let Enter::History(id) = item {
                    ways[id.index()].push(*condition);
                }
            }
            let next: Vec<Lit> = ways.into_iter().map(|ways| self.aig.or_all(ways)).collect();
            if next == wanted {
                break;
            }
            wanted = next;
        }
        let mut steps: Vec<Vec<Lit>> = vec![Vec::new(); net.steps.len()];
        let mut by_default: Vec<Vec<Lit>> = vec![Vec::new(); net.steps.len()];
        for (item, condition) in all {
            match item {
                Enter::Step(step) => steps[step.index()].push(condition),
                Enter::InitialContent(step) => by_default[step.index()].push(condition),
                Enter::History(_) => {}
            }
        }
        let mut join = |ways: Vec<Vec<Lit>>| -> Vec<Lit> {
            ways.into_iter().map(|ways| self.aig.or_all(ways)).collect()
        };
        Entries { steps: join(steps), by_default: join(by_default), default_histories }
    }

    fn recorded(&self, state: &State, history: HistoryId, step: StepId) -> Lit {
        state.recorded.get(&(history, step)).copied().unwrap_or(Lit::FALSE)
    }

    /// Enters the states in document order.
    pub(super) fn enter_states(&mut self, state: &mut State, entries: &Entries) {
        let net = self.net;
        for (id, step) in net.steps.iter() {
            let at = id.index();
            let up = entries.steps[at];
            if up == Lit::FALSE {
                continue;
            }
            state.active[at] = self.aig.or(state.active[at], up);
            let counters =
                [&mut state.elapsed[at], &mut state.last_elapsed[at], &mut state.task[at]];
            for number in counters.into_iter().flatten() {
                *number = Number::select(&mut self.aig, up, &Number::constant(0), number);
            }
            self.block(state, up, &step.entry);
            let by_default = self.aig.and(up, entries.by_default[at]);
            self.block(state, by_default, &step.initial_content);
            for (history, data) in net.histories.iter().filter(|(_, data)| data.owner == id) {
                let taken = self.aig.and(up, entries.default_histories[history.index()]);
                self.block(state, taken, &data.default_content);
            }
            if step.kind == StepKind::Final {
                match step.parent {
                    Some(parent) => self.raise_done(state, parent, up),
                    None => self.end_chart(state, id, up),
                }
            }
        }
    }

    /// The `done` event of a state, and then that of the parallel state around it if all its regions are final.
    fn raise_done(&mut self, state: &State, parent: StepId, condition: Lit) {
        let net = self.net;
        if let Some(event) = net.steps[parent].done_event {
            self.raise_internal(event, condition);
        }
        if let Some(above) = net.steps[parent].parent
            && net.steps[above].kind == StepKind::Parallel
            && let Some(event) = net.steps[above].done_event
        {
            let complete = self.is_in_final_state(state, above);
            let raises = self.aig.and(condition, complete);
            self.raise_internal(event, raises);
        }
    }

    fn is_in_final_state(&mut self, state: &State, step: StepId) -> Lit {
        let net = self.net;
        let children = self.chart().tree.children[step.index()].clone();
        match net.steps[step].kind {
            StepKind::Composite => {
                let finals = children
                    .iter()
                    .filter(|child| net.steps[**child].kind == StepKind::Final)
                    .map(|child| state.active[child.index()]);
                let finals: Vec<Lit> = finals.collect();
                self.aig.or_all(finals)
            }
            StepKind::Parallel => {
                let all: Vec<Lit> =
                    children.iter().map(|child| self.is_in_final_state(state, *child)).collect();
                self.aig.and_all(all)
            }
            StepKind::Leaf | StepKind::Enclosing | StepKind::Final => Lit::FALSE,
        }
    }

    /// A top-level final state ends its chart: exit lists run in exit order, and the bits stay set [C20].
    fn end_chart(&mut self, state: &mut State, step: StepId, condition: Lit) {
        let net = self.net;
        let tree = std::rc::Rc::clone(&self.chart().tree);
        let chart = tree.chart_of[net.steps[step].part.index()];
        let own: Vec<StepId> = net
            .steps
            .iter()
            .filter(|(_, other)| tree.chart_of[other.part.index()] == chart)
            .map(|(id, _)| id)
            .collect();
        // The steps that are active when the exit lists begin.
        let active = state.active.clone();
        for other in own.into_iter().rev() {
            let runs = self.aig.and(condition, active[other.index()]);
            self.block(state, runs, &net.steps[other].exit);
        }
        if let Some(ended) = state.ended.get_mut(&chart) {
            *ended = self.aig.or(*ended, condition);
        }
    }
}
