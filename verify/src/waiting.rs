//! How long a competing transition waits for its turn: a bound that is attained, or a cycle on which it never fires.
//!
//! A *turn of others* is a reaction in which the transition is fireable but does not fire. All states and rows form one graph; without the reactions in
//! which the transition fires, it splits into strongly connected parts. A turn of others within a part can repeat for ever: the transition starves.
//! Otherwise the longest path through the parts, counted in turns, is the bound, and the path itself shows that it is attained. In the same way the
//! analysis counts the consecutive reactions in which the receptivity of the transition is true while none of its following steps is active, from the
//! first until it fires; here the path is also endless if nothing ever deactivates the following step.
//!
//! Under `priority-age` (semantics §4) the bound exists if the priorities P are equal and only the competitors enter each following
//! step.

use grafsynth_ir::net::{Evolution, Net, Policy, Step, StepKind, TransitionId, TransitionKind};
use grafsynth_ir::{Valid, counted};
use grafsynth_sim::{InputRow, Stimulus};
use indexmap::IndexSet;
use petgraph::algo::kosaraju_scc;
use petgraph::graph::{DiGraph, NodeIndex};
use std::collections::{BTreeMap, BTreeSet, VecDeque};

use crate::explore::{Ended, States, Ticks, Times, explore_with};
use crate::guards::{holds, is_enabled, reads_inputs_only};
use crate::limits::Limits;
use crate::verdict::OpenReason;

/// The maximum number of reactions that are kept; with more the question is open.
const MOST_EDGES: usize = 1 << 20;
/// The maximum number of transitions that are analysed.
const MOST_RIVALS: usize = 32;

/// The answer for one transition.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Waiting {
    /// The transition, which shares its preceding step with others.
    pub transition: TransitionId,
    /// The waiting time of the transition.
    pub wait: Wait,
}

/// The waiting time of a transition.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Wait {
    /// The transition eventually fires.
    Bounded {
        /// The maximum number of times that others fire while the transition is fireable, until it fires itself. Its receptivity may change in between.
        turns: u32,
        /// A stimulus from reset; in it the transition is fireable `turns` times without firing, and does not fire from the first of these times on.
        worst: Stimulus,
        /// The maximum number of consecutive reactions in which the receptivity of the transition is true with no following step active,
        /// including the reaction in which it fires; `None` if others may keep the step for ever.
        reactions: Option<u32>,
        /// A stimulus from reset; in its last `reactions` - 1 rows the receptivity is true and the transition does not fire.
        slowest: Option<Stimulus>,
    },
    /// The transition may wait for ever: after the stimulus `way` from reset, the rows of `cycle` lead back to the same state and contain a turn of others.
    Starves {
        /// The stimulus from reset to the cycle.
        way: Stimulus,
        /// The stimulus of the cycle, which can repeat for ever.
        cycle: Stimulus,
    },
}

/// One reaction, as an edge between two states. Each bit of its sets belongs to one rival.
struct Edge {
    from: usize,
    to: usize,
    row: usize,
    lost: u32,
    won: u32,
    held: u32,
}

/// The waiting time of each transition that shares its only preceding step with another and reads only inputs and step activity (at most 32 transitions). Empty
/// if nothing competes: under `all`, in statecharts, and with evolution `stable`, whose micro-steps are not turns.
///
/// # Errors
/// The waiting time is unknown, because there are too many states or rows.
pub fn waiting(net: &Valid<Net>, limits: &Limits) -> Result<Vec<Waiting>, OpenReason> {
    let rivals = rivals(net);
    if rivals.is_empty() {
        return Ok(Vec::new());
    }
    let search = Search::of(net, limits, &rivals)?;
    let answer = |(bit, transition): (usize, &TransitionId)| Waiting {
        transition: *transition,
        wait: search.wait(bit),
    };
    Ok(rivals.iter().enumerate().map(answer).collect())
}

/// True if a transition that [`waiting`] analyses may be fireable and not fire. Under `priority`, the first transition of a step always gets its turn, unless something
/// stops its step or its chart.
#[must_use]
pub fn may_lose(net: &Net) -> bool {
    may_be_stopped(net) || rivals(net).into_iter().any(|rival| has_more_urgent(net, rival))
}

/// The same for one of these transitions.
pub(crate) fn may_lose_to_others(net: &Net, rival: TransitionId) -> bool {
    may_be_stopped(net) || has_more_urgent(net, rival)
}

/// True if a transition may be prevented from firing by something other than a more urgent transition.
fn may_be_stopped(net: &Net) -> bool {
    let stops = |step: &Step| step.parent.is_some() || step.kind == StepKind::Final || step.halts();
    net.settings.policy != Policy::Priority
        || net.settings.fire_one
        || !net.forcings.is_empty()
        || net.steps.values().any(stops)
}

/// True if a transition that leaves a common step is more urgent, or belongs to another chart.
fn has_more_urgent(net: &Net, rival: TransitionId) -> bool {
    let urgency = |id: TransitionId| (net.transitions[id].priority.unwrap_or(u32::MAX), id);
    let data = &net.transitions[rival];
    let mut others = net.transitions.iter().filter(|(id, other)| {
        *id != rival && data.requires.iter().any(|step| other.requires.contains(step))
    });
    others.any(|(id, other)| urgency(id) < urgency(rival) || other.part != data.part)
}

/// Transitions that compete for one step, and whose receptivities depend only on a row and a situation.
pub(crate) fn rivals(net: &Net) -> Vec<TransitionId> {
    let competes = matches!(net.settings.policy, Policy::Priority | Policy::PriorityAge);
    if !competes || net.settings.evolution != Evolution::Single {
        return Vec::new();
    }
    let mut of_step: BTreeMap<_, Vec<TransitionId>> = BTreeMap::new();
    for (id, transition) in net.transitions.iter() {
        if let ([step], TransitionKind::Move) = (&transition.requires[..], transition.kind) {
            of_step.entry(*step).or_default().push(id);
        }
    }
    let mut found: Vec<TransitionId> = of_step
        .into_values()
        .filter(|together| together.len() > 1)
        .flatten()
        .filter(|id| reads_inputs_only(net, &net.transitions[*id]))
        .collect();
    found.sort_unstable();
    found.truncate(MOST_RIVALS);
    found
}

/// All reactions of a net.
struct Search<'n> {
    net: &'n Net,
    states: States,
    rows: IndexSet<InputRow>,
    edges: Vec<Edge>,
}

impl<'n> Search<'n> {
    fn of(
        net: &'n Valid<Net>,
        limits: &Limits,
        rivals: &[TransitionId],
    ) -> Result<Self, OpenReason> {
        let (mut edges, mut rows) = (Vec::new(), IndexSet::new());
        let each = Times::Each(Ticks::Any);
        let (states, ended) = explore_with(net, limits, each, rivals, &mut |states, seen| {
            let row = rows.insert_full(seen.input.clone()).0;
            let mut edge = Edge { from: seen.from, to: seen.to, row, lost: 0, won: 0, held: 0 };
            let situation = states.situation(seen.from);
            for (bit, rival) in rivals.iter().enumerate() {
                let data = &net.transitions[*rival];
                let holds = holds(data, situation, seen.input);
                let fires = seen.simulator.fired().contains(rival);
                let enabled = is_enabled(data, situation);
                edge.won |= u32::from(fires) << bit;
                let is_served = crate::exclusive::entered(data).any(|it| situation.contains(it));
                edge.held |= u32::from(holds && !is_served) << bit;
                edge.lost |= u32::from(holds && enabled && !fires) << bit;
            }
            edges.push(edge);
            (edges.len() > MOST_EDGES).then_some(())
        });
        match ended {
            Ended::Open(why) => Err(why),
            Ended::Stopped(()) => Err(OpenReason::Method(format!(
                "more than {MOST_EDGES} reactions from {}",
                counted(states.len(), "state", "states")
            ))),
            Ended::Complete => Ok(Search { net, states, rows, edges }),
        }
    }

    fn wait(&self, bit: usize) -> Wait {
        let is = move |set: u32| set >> bit & 1 == 1;
        let without = self.walk(|edge| !is(edge.won), |edge| is(edge.lost));
        let held = self.walk(|edge| is(edge.held) && !is(edge.won), |_| true);
        let turns = match without {
            Ok(longest) => longest,
            Err(cycle) => {
                // A cycle on which the transition is always fireable is reported in preference to one on which its receptivity
                // changes.
                let without_pause = self
                    .walk(|edge| is(edge.held) && !is(edge.won), |edge| is(edge.lost))
                    .err()
                    .unwrap_or(cycle);
                let from = without_pause.first().map_or(0, |edge| self.edges[*edge].from);
                return Wait::Starves {
                    way: self.stimulus(from, &[]),
                    cycle: Stimulus::of_rows(
                        self.net,
                        without_pause.iter().map(|edge| &self.rows[self.edges[*edge].row]),
                    ),
                };
            }
        };
        let stimulus = |way: &[usize]| {
            self.stimulus(way.first().map_or(0, |edge| self.edges[*edge].from), way)
        };
        Wait::Bounded {
            turns: turns.iter().filter(|edge| is(self.edges[**edge].lost)).count() as u32,
            worst: stimulus(&turns),
            reactions: held.as_ref().ok().map(|way| way.len() as u32 + 1),
            slowest: held.as_ref().ok().map(|way| stimulus(way)),
        }
    }

    /// The stimulus from reset to a state, continued along the path.
    fn stimulus(&self, from: usize, way: &[usize]) -> Stimulus {
        let mut rows = self.states.way_to(from);
        rows.extend(way.iter().map(|edge| self.rows[self.edges[*edge].row].clone()));
        Stimulus::of_rows(self.net, &rows)
    }

    /// Of all paths over `kept` edges, one with the most edges that count. The error is a cycle with such an edge.
    fn walk(
        &self,
        kept: impl Fn(&Edge) -> bool,
        counts: impl Fn(&Edge) -> bool,
    ) -> Result<Vec<usize>, Vec<usize>> {
        let n_states = self.states.len();
        let mut out: Vec<Vec<usize>> = vec![Vec::new(); n_states];
        let mut graph: DiGraph<(), ()> = DiGraph::new();
        (0..n_states).for_each(|_| {
            graph.add_node(());
        });
        let mut known: BTreeSet<(usize, usize, bool)> = BTreeSet::new();
        for (at, edge) in self.edges.iter().enumerate().filter(|(_, edge)| kept(edge)) {
            // For each pair of states, one edge that counts and one that does not are enough.
            if known.insert((edge.from, edge.to, counts(edge))) {
                out[edge.from].push(at);
                graph.update_edge(NodeIndex::new(edge.from), NodeIndex::new(edge.to), ());
            }
        }
        let parts = kosaraju_scc(&graph);
        let mut part_of = vec![0; n_states];
        for (number, members) in parts.iter().enumerate() {
            members.iter().for_each(|member| part_of[member.index()] = number);
        }
        // Parts without outgoing edges come first. For each part: the count from here on, and the edge on which to leave it.
        let mut best: Vec<(u32, Option<usize>)> = Vec::with_capacity(parts.len());
        for (number, members) in parts.iter().enumerate() {
            let mut most = (0, None);
            for at in members.iter().flat_map(|member| &out[member.index()]) {
                let edge = &self.edges[*at];
                let weight = u32::from(counts(edge));
                if part_of[edge.to] != number {
                    let further = best[part_of[edge.to]].0 + weight;
                    if further > most.0 {
                        most = (further, Some(*at));
                    }
                } else if weight == 1 {
                    let mut cycle = vec![*at];
                    cycle.extend(self.way(&out, &part_of, edge.to, edge.from));
                    return Err(cycle);
                }
            }
            best.push(most);
        }
        let start = (0..n_states).max_by_key(|state| (best[part_of[*state]].0, n_states - state));
        let mut way = Vec::new();
        let mut at = start.unwrap_or(0);
        // The path begins where it leaves the first part.
        if let Some(first) = best[part_of[at]].1 {
            at = self.edges[first].from;
        }
        while let Some(leaving) = best[part_of[at]].1 {
            way.extend(self.way(&out, &part_of, at, self.edges[leaving].from));
            way.push(leaving);
            at = self.edges[leaving].to;
        }
        Ok(way)
    }

    /// A shortest path within one part.
    fn way(&self, out: &[Vec<usize>], part_of: &[usize], from: usize, to: usize) -> Vec<usize> {
        let mut by: BTreeMap<usize, usize> = BTreeMap::new();
        let mut todo = VecDeque::from([from]);
        while let Some(state) = todo.pop_front() {
            if state == to {
                break;
            }
            for at in &out[state] {
                let next = self.edges[*at].to;
                if part_of[next] == part_of[from] && next != from && !by.contains_key(&next) {
                    by.insert(next, *at);
                    todo.push_back(next);
                }
            }
        }
        let mut way = Vec::new();
        let mut at = to;
        while at != from {
            let Some(edge) = by.get(&at) else { break };
            way.push(*edge);
            at = self.edges[*edge].from;
        }
        way.reverse();
        way
    }
}
