//! Exit, content, entry: the sequence of a micro-step of a statechart (§3.3, S1 to S4 of §3.9).

use std::collections::BTreeMap;

use super::order::Act;
use super::tree::Tree;
use super::{Builder, cell, when};
use crate::arena::IdMap;
use crate::net::{Enter, History, HistoryId, PartId, Step, StepId, StepKind, Transition};
use crate::program::{Expr, Stmt, TempRole};
use crate::simplify::simplify;

/// The entries of a micro-step.
pub(super) struct Entries {
    states: IdMap<Step, Vec<Expr>>,
    by_default: IdMap<Step, Vec<Expr>>,
    histories: IdMap<History, Vec<Expr>>,
    /// True if the default content of the history runs.
    default_content: IdMap<History, Expr>,
}

impl Builder<'_> {
    /// The states that are left: those in the domain of a transition that fires.
    pub(super) fn exits(
        &mut self,
        tree: &Tree,
        fire: &IdMap<Transition, Expr>,
        out: &mut Vec<Stmt>,
    ) -> IdMap<Step, Expr> {
        let net = self.net;
        let mut of_domain: BTreeMap<(PartId, Option<StepId>), Vec<Expr>> = BTreeMap::new();
        for (id, transition) in net.transitions.iter() {
            if !transition.clears.is_empty() {
                of_domain
                    .entry((transition.part, tree.domain[id]))
                    .or_default()
                    .push(fire[id].clone());
            }
        }
        let mut left = IdMap::filled(&net.steps, Expr::bool(false));
        let mut whole = BTreeMap::new();
        for (part, data) in net.parts.iter() {
            let fires = of_domain.remove(&(part, None)).unwrap_or_default();
            whole.insert(
                part,
                self.named(format!("{}.left", data.name), TempRole::Helper, Expr::or(fires), out),
            );
        }
        // For each state: whether its descendants are left.
        let mut inside = IdMap::filled(&net.steps, Expr::bool(false));
        for (step, data) in net.steps.iter() {
            let around = match data.parent {
                Some(parent) => inside[parent].clone(),
                None => whole.get(&data.part).cloned().unwrap_or_else(|| Expr::bool(false)),
            };
            let fires = of_domain.remove(&(data.part, Some(step))).unwrap_or_default();
            let any = Expr::or([around.clone()].into_iter().chain(fires));
            inside[step] =
                self.named(format!("{}.inside_left", data.name), TempRole::Helper, any, out);
            left[step] = Expr::and([self.is_active(step), around]);
        }
        left
    }

    pub(super) fn no_entries(&self) -> Entries {
        Entries {
            states: IdMap::filled(&self.net.steps, Vec::new()),
            by_default: IdMap::filled(&self.net.steps, Vec::new()),
            histories: IdMap::filled(&self.net.histories, Vec::new()),
            default_content: IdMap::filled(&self.net.histories, Expr::bool(false)),
        }
    }

    pub(super) fn entries(&self, fire: &IdMap<Transition, Expr>) -> Entries {
        let mut entries = self.no_entries();
        for (id, transition) in self.net.transitions.iter() {
            for enter in &transition.enters {
                add(&mut entries, *enter, &fire[id]);
            }
        }
        entries
    }

    /// Records the histories from the situation at the start of the micro-step, before anything runs.
    pub(super) fn record_histories(&self, exits: &IdMap<Step, Expr>, out: &mut Vec<Stmt>) {
        for (id, history) in self.net.histories.iter() {
            let mut list = Vec::new();
            for case in &history.cases {
                if let Some(recorded) = self.recorded.get(&(id, case.step)) {
                    list.push(Stmt::Store(*recorded, None, self.is_active(case.step)));
                }
            }
            when(exits[history.owner].clone(), list, out);
        }
    }

    /// Replaces each history by its recorded states, or by its default. A history that another one refers to belongs to a state inside the other's state,
    /// so outer histories come first.
    pub(super) fn resolve_histories(&mut self, entries: &mut Entries, out: &mut Vec<Stmt>) {
        let net = self.net;
        let mut order: Vec<HistoryId> = net.histories.ids().collect();
        let depth = |id: &HistoryId| {
            std::iter::successors(Some(net.histories[*id].owner), |step| net.steps[*step].parent)
                .take(net.steps.len())
                .count()
        };
        order.sort_by_key(depth);
        for id in order {
            let history = &net.histories[id];
            let entered = Expr::or(std::mem::take(&mut entries.histories[id]));
            let entered =
                self.named(format!("{}.entered", history.name), TempRole::Helper, entered, out);
            if entered.is_false() {
                continue;
            }
            let recorded = |builder: &Self, step: StepId| {
                builder.recorded.get(&(id, step)).map_or_else(|| Expr::bool(false), |id| cell(*id))
            };
            for case in &history.cases {
                let condition = Expr::and([entered.clone(), recorded(self, case.step)]);
                for enter in &case.enters {
                    add(entries, *enter, &condition);
                }
            }
            let any = Expr::or(history.cases.iter().map(|case| recorded(self, case.step)));
            let by_default = Expr::and([entered, any.not()]);
            let by_default =
                self.named(format!("{}.default", history.name), TempRole::Helper, by_default, out);
            for enter in &history.default {
                add(entries, *enter, &by_default);
            }
            entries.default_content[id] = by_default;
        }
    }

    /// Emits exits, contents and entries: the sequence of a micro-step.
    pub(super) fn fire_states(
        &mut self,
        tree: &Tree,
        exits: &IdMap<Step, Expr>,
        fire: &IdMap<Transition, Expr>,
        order: &[Act],
        entries: &Entries,
        out: &mut Vec<Stmt>,
    ) {
        let net = self.net;
        self.begin_sequence();
        let watched =
            IdMap::build(&net.steps, |step, _| self.needs.watched[step] && !self.simultaneous);
        // Entry conditions are read several times, even after step bits have changed.
        let mut enters = IdMap::filled(&net.steps, Expr::bool(false));
        for (step, data) in net.steps.iter() {
            let any = Expr::or(entries.states[step].iter().cloned());
            enters[step] =
                self.named(format!("{}.activated", data.name), TempRole::Activated(step), any, out);
        }
        let mut exits = exits.clone();
        if self.simultaneous {
            for (step, data) in net.steps.iter() {
                let exit = exits[step].clone();
                exits[step] = self.named(
                    format!("{}.deactivated", data.name),
                    TempRole::Deactivated(step),
                    exit,
                    out,
                );
            }
        }
        let mut sequence = Vec::new();
        let mut late = Vec::new();
        self.mark(fire, &mut sequence);
        let doc_order: Vec<StepId> = net.steps.ids().collect();
        for step in doc_order.iter().rev().copied() {
            if self.simultaneous {
                let list = self.list(&net.steps[step].exit);
                when(exits[step].clone(), self.drop_counters(step), &mut late);
                when(exits[step].clone(), list, &mut sequence);
            } else {
                let list = self.exit_list(step, watched[step]);
                when(exits[step].clone(), list, &mut sequence);
            }
        }
        self.run_actions(order, fire, &mut sequence);
        for step in doc_order {
            if self.simultaneous {
                when(enters[step].clone(), self.start_counter(step), &mut late);
            }
            let mut list = self.entry_list(step, watched[step]);
            let content = self.list(&net.steps[step].initial_content);
            when(Expr::or(entries.by_default[step].iter().cloned()), content, &mut list);
            for (id, history) in net.histories.iter() {
                if history.owner == step {
                    let content = self.list(&history.default_content);
                    when(entries.default_content[id].clone(), content, &mut list);
                }
            }
            if net.steps[step].kind == StepKind::Final {
                // The bits of states further down in document order are not set yet.
                let is_final = &mut |builder: &Builder<'_>, child: StepId| {
                    if watched[child] {
                        builder.is_active(child)
                    } else if child <= step {
                        Expr::or([builder.stays(child, &exits), enters[child].clone()])
                    } else {
                        builder.stays(child, &exits)
                    }
                };
                self.finish(tree, step, is_final, &mut list);
            }
            when(enters[step].clone(), list, &mut sequence);
        }
        sequence.extend(late);
        for step in net.steps.ids() {
            let is_constant = exits[step].is_false() && enters[step].is_false();
            if !watched[step] && !is_constant {
                let stays = self.stays(step, &exits);
                let next = simplify(&Expr::or([stays, enters[step].clone()]));
                sequence.push(Stmt::Store(self.step[step], None, next));
            }
        }
        out.extend(self.end_sequence(sequence));
    }

    /// The statements that run when a state is left: its list, then its bit (if lists read it) and its counters are cleared.
    pub(super) fn exit_list(&mut self, step: StepId, is_watched: bool) -> Vec<Stmt> {
        let mut list = self.list(&self.net.steps[step].exit);
        if is_watched {
            list.push(Stmt::Store(self.step[step], None, Expr::bool(false)));
        }
        list.extend(self.drop_counters(step));
        list
    }

    fn drop_counters(&self, step: StepId) -> Vec<Stmt> {
        let counters = [self.times.cell[step], self.task[step]].into_iter().flatten();
        counters.map(|id| Stmt::Store(id, None, Expr::int(0))).collect()
    }

    /// The statements that run when a state is entered: its bit (if lists read it) and its counter are set, then its list runs.
    pub(super) fn entry_list(&mut self, step: StepId, is_watched: bool) -> Vec<Stmt> {
        let mut list = Vec::new();
        if is_watched {
            list.push(Stmt::Store(self.step[step], None, Expr::bool(true)));
        }
        if !self.simultaneous {
            list.extend(self.start_counter(step));
        }
        list.extend(self.list(&self.net.steps[step].entry));
        list
    }

    fn start_counter(&self, step: StepId) -> Vec<Stmt> {
        let counter = self.last_elapsed[step].into_iter();
        counter.map(|id| Stmt::Store(id, None, Expr::int(0))).collect()
    }

    /// True if the state is active and not left.
    fn stays(&self, step: StepId, exits: &IdMap<Step, Expr>) -> Expr {
        Expr::and([self.is_active(step), exits[step].clone().not()])
    }

    /// Raises `done.state.P`, and the completion event of a parallel state whose regions are all final, directly after the entry list of the final state.
    /// A final state without a parent ends its chart: it is the only active state, so its exit list runs, and its bit stays set [C20].
    pub(super) fn finish(
        &mut self,
        tree: &Tree,
        step: StepId,
        is_final: &mut impl FnMut(&Self, StepId) -> Expr,
        out: &mut Vec<Stmt>,
    ) {
        let net = self.net;
        let Some(parent) = net.steps[step].parent else {
            out.extend(self.list(&net.steps[step].exit));
            if let Some(ended) = self.ended[self.ranks.chart_of(net.steps[step].part)] {
                out.push(Stmt::Store(ended, None, Expr::bool(true)));
            }
            return;
        };
        if let Some(event) = net.steps[parent].done_event {
            self.raise(event, out);
        }
        let Some(above) = net.steps[parent].parent else { return };
        if net.steps[above].kind == StepKind::Parallel
            && let Some(event) = net.steps[above].done_event
        {
            let all =
                simplify(&is_in_final_state(net, tree, above, &mut |child| is_final(self, child)));
            let mut raise = Vec::new();
            self.raise(event, &mut raise);
            when(all, raise, out);
        }
    }
}

pub(super) fn add(entries: &mut Entries, enter: Enter, condition: &Expr) {
    match enter {
        Enter::Step(step) => entries.states[step].push(condition.clone()),
        Enter::InitialContent(step) => entries.by_default[step].push(condition.clone()),
        Enter::History(history) => entries.histories[history].push(condition.clone()),
    }
}

fn is_in_final_state(
    net: &crate::net::Net,
    tree: &Tree,
    step: StepId,
    is_final: &mut dyn FnMut(StepId) -> Expr,
) -> Expr {
    let children = &tree.children[step];
    match net.steps[step].kind {
        StepKind::Composite => Expr::or(
            children
                .iter()
                .filter(|child| net.steps[**child].kind == StepKind::Final)
                .map(|child| is_final(*child)),
        ),
        StepKind::Parallel => {
            Expr::and(children.iter().map(|child| is_in_final_state(net, tree, *child, is_final)))
        }
        StepKind::Leaf | StepKind::Enclosing | StepKind::Final => Expr::bool(false),
    }
}
