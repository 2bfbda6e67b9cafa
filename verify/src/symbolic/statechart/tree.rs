//! The tree of the states of a net.

use std::collections::BTreeMap;

use grafsynth_ir::net::{Net, PartId, Policy, StepId, StepKind, TransitionId};

/// A transition that an atomic state may offer (semantics §4).
#[derive(Debug, Clone)]
pub(crate) struct Offer {
    pub(crate) atom: StepId,
    /// True if this is the first offer of its atomic state.
    pub(crate) is_first: bool,
    pub(crate) transition: TransitionId,
    /// The earlier offers of states that can be active together with this one, if they matter.
    pub(crate) rivals: Vec<(usize, Rival)>,
}

/// How an offer competes with an earlier one.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Rival {
    /// It is the same transition.
    Same,
    /// This offer loses while some state of the set is active: both transitions leave it.
    Loses(usize),
    /// This offer replaces the earlier one while some state of the set is active.
    Replaces(usize),
}

/// The states, their children, and which transitions each atomic state may offer.
#[derive(Debug, Clone, Default)]
pub(crate) struct Tree {
    /// For each part, the top-level chart that contains it.
    pub(crate) chart_of: Vec<PartId>,
    pub(crate) children: Vec<Vec<StepId>>,
    /// The states without children, in document order.
    pub(crate) atoms: Vec<StepId>,
    /// The offers of all atomic states, in the order of selection.
    pub(crate) offers: Vec<Offer>,
    /// The sets of states that two transitions leave.
    pub(crate) sets: Vec<Vec<StepId>>,
}

impl Tree {
    pub(crate) fn of(net: &Net) -> Tree {
        let mut tree = Tree { children: vec![Vec::new(); net.steps.len()], ..Tree::default() };
        let mut chart = PartId::from_index(0);
        for (id, part) in net.parts.iter() {
            // A part of level 1 begins a chart.
            if part.level <= 1 {
                chart = id;
            }
            tree.chart_of.push(chart);
        }
        for (id, step) in net.steps.iter() {
            if let Some(parent) = step.parent {
                tree.children[parent.index()].push(id);
            }
            if matches!(step.kind, StepKind::Leaf | StepKind::Final) {
                tree.atoms.push(id);
            }
        }
        tree.offers(net);
        tree
    }

    fn offers(&mut self, net: &Net) {
        let mut leaving: Vec<Vec<TransitionId>> = vec![Vec::new(); net.steps.len()];
        for (id, transition) in net.transitions.iter() {
            if let Some(source) = transition.requires.first() {
                leaving[source.index()].push(id);
            }
        }
        let mut both_of: BTreeMap<(TransitionId, TransitionId), Option<usize>> = BTreeMap::new();
        let mut number_of: BTreeMap<Vec<StepId>, usize> = BTreeMap::new();
        for atom in self.atoms.clone() {
            let n_before = self.offers.len();
            let meets: Vec<usize> = (0..n_before)
                .filter(|other| self.may_meet(net, atom, self.offers[*other].atom))
                .collect();
            let mut way = Tree::way_up(net, atom);
            if net.settings.policy == Policy::OuterFirst {
                way.reverse();
            }
            for id in way.into_iter().flat_map(|step| leaving[step.index()].clone()) {
                let mut rivals = Vec::new();
                for other in meets.iter().copied() {
                    let theirs = self.offers[other].transition;
                    if theirs == id {
                        rivals.push((other, Rival::Same));
                        continue;
                    }
                    let set = *both_of.entry((id, theirs)).or_insert_with(|| {
                        let both = left_by_both(net, id, theirs);
                        if both.is_empty() {
                            return None;
                        }
                        let next = number_of.len();
                        Some(*number_of.entry(both).or_insert(next))
                    });
                    let Some(set) = set else { continue };
                    let rival = if goes_before(net, id, theirs) {
                        Rival::Replaces(set)
                    } else {
                        Rival::Loses(set)
                    };
                    rivals.push((other, rival));
                }
                let is_first = self.offers.len() == n_before;
                self.offers.push(Offer { atom, is_first, transition: id, rivals });
            }
        }
        self.sets = vec![Vec::new(); number_of.len()];
        for (set, number) in number_of {
            self.sets[number] = set;
        }
    }

    /// The state and its ancestors, from the inside out.
    pub(crate) fn way_up(net: &Net, step: StepId) -> Vec<StepId> {
        let mut way = vec![step];
        while let Some(parent) = way.last().and_then(|last| net.steps[*last].parent) {
            way.push(parent);
        }
        way
    }

    /// True if `inner` is a proper descendant of `outer`.
    pub(crate) fn is_inside(net: &Net, inner: StepId, outer: StepId) -> bool {
        Tree::way_up(net, inner).into_iter().skip(1).any(|step| step == outer)
    }

    /// True if the state is `outer` or inside it.
    pub(crate) fn is_within(net: &Net, step: StepId, outer: StepId) -> bool {
        Tree::way_up(net, step).contains(&outer)
    }

    /// True if the two states can be active together: their least common ancestor is a parallel state, one contains the other, or they belong to different
    /// charts.
    pub(crate) fn may_meet(&self, net: &Net, a: StepId, b: StepId) -> bool {
        let (up_a, up_b) = (Tree::way_up(net, a), Tree::way_up(net, b));
        match up_a.iter().find(|step| up_b.contains(step)) {
            Some(common) => {
                *common == a || *common == b || net.steps[*common].kind == StepKind::Parallel
            }
            None => {
                let chart = |step: StepId| self.chart_of[net.steps[step].part.index()];
                chart(a) != chart(b)
            }
        }
    }
}

/// The states that both transitions leave if they are active.
fn left_by_both(net: &Net, a: TransitionId, b: TransitionId) -> Vec<StepId> {
    let others = &net.transitions[b].clears;
    let mut both: Vec<StepId> =
        net.transitions[a].clears.iter().copied().filter(|step| others.contains(step)).collect();
    both.sort_unstable();
    both
}

/// True if the source of `a` is inside that of `b`; with outer-first, around it.
fn goes_before(net: &Net, a: TransitionId, b: TransitionId) -> bool {
    let source = |id: TransitionId| net.transitions[id].requires.first().copied();
    let (Some(a), Some(b)) = (source(a), source(b)) else { return false };
    match net.settings.policy {
        Policy::OuterFirst => Tree::is_inside(net, b, a),
        Policy::All | Policy::Priority | Policy::PriorityAge | Policy::InnerFirst => {
            Tree::is_inside(net, a, b)
        }
    }
}
