//! The static orders of a net: ranks of partial charts, urgency of transitions (semantics §3.3, §4).

use grafsynth_ir::net::{
    Enter, Net, PartId, Policy, Schedule, StepId, TransitionId, TransitionKind,
};
use grafsynth_ir::ranks::sort_by_rank;

/// The sort key of an object without a number; it comes last.
const LAST: u64 = u64::MAX;

/// Ranks of parts, and the order of actions that follows from them.
#[derive(Debug, Clone, Default)]
pub(crate) struct Ranks {
    chart_of: Vec<PartId>,
    rank_of: Vec<u64>,
    /// The position of each step in the order of lists: rank, then declaration.
    pub(crate) step_place: Vec<u32>,
    /// The position of each transition and reaction in the order of actions: rank, static urgency, declaration.
    pub(crate) transition_place: Vec<u32>,
}

impl Ranks {
    pub(crate) fn of(net: &Net) -> Ranks {
        let mut ranks = Ranks::default();
        // The parts are in depth-first order, so the chart that contains a part is the last one before it with a lower level.
        let mut way: Vec<PartId> = Vec::new();
        for (id, part) in net.parts.iter() {
            while way.last().is_some_and(|above| net.parts[*above].level >= part.level) {
                way.pop();
            }
            way.push(id);
            let chart = way.first().copied().unwrap_or(id);
            ranks.chart_of.push(chart);
            ranks.rank_of.push(match net.settings.schedule {
                Schedule::Declared => chart.index() as u64,
                Schedule::Level => u64::from(part.level),
                Schedule::Priority => way
                    .iter()
                    .rev()
                    .find_map(|part| net.parts[*part].priority)
                    .map_or(LAST, u64::from),
            });
        }
        ranks.step_place = places(net.steps.len(), &|step| {
            [ranks.of_part(net.steps[StepId::from_index(step)].part), 0]
        });
        ranks.transition_place = places(net.transitions.len(), &|transition| {
            let id = TransitionId::from_index(transition);
            [ranks.of_part(net.transitions[id].part), ranks.urgency(net, id)]
        });
        ranks
    }

    /// The top-level chart that a part belongs to.
    pub(crate) fn chart_of(&self, part: PartId) -> PartId {
        self.chart_of[part.index()]
    }

    /// The rank of a part (semantics §4, *Ranks* [C17]); lower goes first.
    pub(crate) fn of_part(&self, part: PartId) -> u64 {
        self.rank_of[part.index()]
    }

    /// The static urgency that orders actions (semantics §3.3): the lower value goes first. A reaction has no urgency.
    pub(crate) fn urgency(&self, net: &Net, transition: TransitionId) -> u64 {
        let data = &net.transitions[transition];
        match (net.settings.policy, data.kind) {
            (Policy::Priority, TransitionKind::Move) => data.priority.map_or(LAST, u64::from),
            (Policy::PriorityAge, TransitionKind::Move) => self.following_priority(net, transition),
            (Policy::All | Policy::InnerFirst | Policy::OuterFirst, _)
            | (_, TransitionKind::Reaction) => LAST,
        }
    }

    /// P(t) of the paper on Grafcet, C and PALASM: the most urgent priority among the steps that follow the transition.
    #[expect(clippy::unused_self, reason = "it is one of the orders that this type represents")]
    pub(crate) fn following_priority(&self, net: &Net, transition: TransitionId) -> u64 {
        let following = net.transitions[transition].enters.iter().filter_map(|enter| match enter {
            Enter::Step(step) => net.steps[*step].priority,
            Enter::InitialContent(_) | Enter::History(_) => None,
        });
        following.min().map_or(LAST, u64::from)
    }
}

/// For each index, its position after sorting by `key`; equal keys are sorted by index.
fn places(n: usize, key: &dyn Fn(usize) -> [u64; 2]) -> Vec<u32> {
    let mut order: Vec<usize> = (0..n).collect();
    sort_by_rank(&mut order, |index| key(*index));
    let mut places = vec![0; n];
    for (place, index) in order.into_iter().enumerate() {
        places[index] = place as u32;
    }
    places
}
