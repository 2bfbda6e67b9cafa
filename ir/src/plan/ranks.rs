//! The static orders of a net: ranks of partial charts, urgency of transitions (§3.3, §4).

use crate::arena::IdMap;
use crate::net::{
    Enter, Net, Part, PartId, Policy, Schedule, StepId, Transition, TransitionId, TransitionKind,
};
use crate::ranks::sort_by_rank;

/// The sort key of an object without a number; it comes last.
pub const LAST: u64 = u64::MAX;

/// Sorted lists of all objects that have a static order in a micro-step.
#[derive(Debug, Clone)]
pub struct Ranks {
    rank: IdMap<Part, u64>,
    chart: IdMap<Part, PartId>,
    /// Steps in the order of their lists: rank, declaration.
    pub steps: Vec<StepId>,
    /// Transitions and reactions in the order of actions: rank, static urgency, declaration.
    pub transitions: Vec<TransitionId>,
}

impl Ranks {
    /// The orders of a net.
    #[must_use]
    pub fn of(net: &Net) -> Self {
        let mut chart = IdMap::build(&net.parts, |id, _| id);
        // Parts are in depth-first order, so the chart that contains a part is the last one before it with a lower level.
        let mut way = Vec::new();
        let rank = IdMap::build(&net.parts, |id, part| {
            while way.last().is_some_and(|above| net.parts[*above].level >= part.level) {
                way.pop();
            }
            way.push(id);
            chart[id] = way.first().copied().unwrap_or(id);
            match net.settings.schedule {
                Schedule::Declared => way.first().map_or(LAST, |top| top.index() as u64),
                Schedule::Level => u64::from(part.level),
                Schedule::Priority => way
                    .iter()
                    .rev()
                    .find_map(|part| net.parts[*part].priority)
                    .map_or(LAST, u64::from),
            }
        });
        let mut steps: Vec<StepId> = net.steps.ids().collect();
        sort_by_rank(&mut steps, |step| [rank[net.steps[*step].part]]);
        let mut transitions: Vec<TransitionId> = net.transitions.ids().collect();
        sort_by_rank(&mut transitions, |id| [rank[net.transitions[*id].part], urgency(net, *id)]);
        Ranks { rank, chart, steps, transitions }
    }

    /// The top-level chart that a part belongs to.
    #[must_use]
    pub fn chart_of(&self, part: PartId) -> PartId {
        self.chart[part]
    }

    /// The rank of a transition: the lower one goes first.
    #[must_use]
    pub fn of_transition(&self, net: &Net, transition: TransitionId) -> u64 {
        self.rank[net.transitions[transition].part]
    }
}

/// The static urgency of a transition (§3.3): lower goes first. A reaction has none.
#[must_use]
pub fn urgency(net: &Net, id: TransitionId) -> u64 {
    let transition = &net.transitions[id];
    match (net.settings.policy, transition.kind) {
        (Policy::Priority, TransitionKind::Move) => transition.priority.map_or(LAST, u64::from),
        (Policy::PriorityAge, TransitionKind::Move) => following(transition)
            .filter_map(|step| net.steps[step].priority)
            .min()
            .map_or(LAST, u64::from),
        (Policy::All | Policy::InnerFirst | Policy::OuterFirst, TransitionKind::Move)
        | (_, TransitionKind::Reaction) => LAST,
    }
}

/// The steps that follow a transition, without those that a composite state or a history chooses.
pub fn following(transition: &Transition) -> impl Iterator<Item = StepId> + '_ {
    transition.enters.iter().filter_map(|enter| match enter {
        Enter::Step(step) => Some(*step),
        Enter::InitialContent(_) | Enter::History(_) => None,
    })
}
