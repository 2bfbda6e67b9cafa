//! Breadth-first search of all reachable states of a net with the reference simulator: the exact answer if the net is small enough.
//!
//! If times are counted, states that differ only in their times are kept together: a node of the search is a state without its times, and the [`Zone`] of
//! possible times of its clocks. A reaction after any `dt` is tried once for each part of the zone in which no comparison changes its truth value, so the cost
//! depends on the number of comparisons and not on the length of the times. Every point of a node is reachable, and the successors of a node are all successors
//! of its points; so questions about reachability are answered exactly, for any `dt`.
//!
//! Most reactions lead to a known state and cost one simulation and one table lookup; only new states are stored.

use std::rc::Rc;

use grafsynth_ir::Valid;
use grafsynth_ir::net::{Net, OutputId, PropertyLeaf, PropertyRole, TransitionId};
use grafsynth_sim::{Clock, InputRow, MAX_DT, Row, Simulator, Situation, State, Stimulus};
use indexmap::{IndexMap, IndexSet};

use crate::alphabet::NoAlphabet;
use crate::classes::Classes;
use crate::guards::receptivity;
use crate::limits::Limits;
use crate::relevance::{Inputs, Relevance};
use crate::verdict::OpenReason;
use crate::zone::{Source, Zone};

/// The values of `dt` that are tried.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) enum Ticks {
    /// Any number: the result applies to every engine.
    Any,
    /// 0 and 1, the only values that a chip sees (semantics §9).
    Chip,
}

/// How a search treats times.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Times {
    /// Any `dt`, with zones; a zone contained in an earlier one is skipped. Finds everything that can happen, with the fewest nodes.
    Zones,
    /// Any `dt`, with zones; no zone is skipped. For questions about paths through the graph of all nodes.
    AllZones,
    /// Each `dt` separately; with [`Ticks::Any`], up to the largest time in a comparison.
    Each(Ticks),
}

/// One reaction of the search.
pub(crate) struct Seen<'a, 'n> {
    /// The number of the previous node.
    pub(crate) from: usize,
    /// The number of the next node, and true if the node is new.
    pub(crate) to: usize,
    /// A state of the previous node, and the row that was tried on it.
    pub(crate) before: &'a State,
    pub(crate) input: &'a InputRow,
    pub(crate) row: &'a Row,
    pub(crate) simulator: &'a Simulator<'n>,
    /// True if the reaction is possible from every state of the previous node, after some `dt`.
    pub(crate) is_sure: bool,
    came: &'a Came,
}

/// How a node was first found.
#[derive(Debug, Clone)]
struct Parent {
    node: u32,
    row: InputRow,
    came: Came,
    /// The source of each clock of the node.
    sources: Vec<Source>,
}

/// A part of a zone in which all points give the same reaction: the times of the clocks after the latch, and the order of due
/// sends.
#[derive(Debug, Clone, Default)]
struct Came {
    times: Vec<(i64, Option<i64>)>,
    /// Bounds on pairs of clocks: the first clock is ahead of the second by at most this much.
    ahead: Vec<(usize, usize, i64)>,
}

#[derive(Debug, Clone)]
struct Node {
    /// The index of the node's state among the states without times.
    state: usize,
    /// The running clocks of the node, by their index among all clocks of the net.
    clocks: Vec<usize>,
    zone: Rc<Zone>,
    parent: Option<Parent>,
}

/// The nodes whose states differ only in their times.
#[derive(Debug, Clone, Default)]
struct SameState {
    all: Vec<u32>,
    /// The node of each zone, and of some zones contained in another.
    by_zone: IndexMap<Rc<Zone>, u32>,
}

/// For each state, this many contained zones are remembered, and one more for each of its nodes.
const REMEMBERED: usize = 16;

/// All nodes of a search, each with the path on which it was first found.
#[derive(Debug, Clone)]
pub(crate) struct States {
    /// States (with [`Times::Each`]), or states without their times, with their nodes.
    states: IndexSet<State>,
    by_state: Vec<SameState>,
    nodes: Vec<Node>,
    clocks: Vec<Clock>,
    /// The number of pairs of a node and a row (with a part of its zone) that were tried.
    pub(crate) pairs: u64,
    /// For each completed node, the value of `pairs` when all its successors had been tried.
    pairs_after: Vec<u64>,
}

impl States {
    /// The number of nodes.
    pub(crate) fn len(&self) -> usize {
        self.nodes.len()
    }

    /// The active steps of a node.
    pub(crate) fn situation(&self, node: usize) -> &Situation {
        self.state(node).situation()
    }

    /// All situations, each at least once.
    pub(crate) fn situations(&self) -> impl Iterator<Item = &Situation> {
        self.states.iter().map(State::situation)
    }

    /// Checks whether a search with this limit of pairs would have been complete. Nothing is searched again.
    ///
    /// # Errors
    /// The search would end early at that limit.
    pub(crate) fn within(&self, limit: u64) -> Result<(), OpenReason> {
        let tried = self.pairs_after.partition_point(|pairs| *pairs <= limit);
        if tried >= self.pairs_after.len() {
            return Ok(());
        }
        Err(self.too_many_pairs(limit, tried))
    }

    /// The answer of a search that ends at this limit, after this many nodes.
    fn too_many_pairs(&self, limit: u64, tried: usize) -> OpenReason {
        // Nodes are numbered in the order of discovery, and they are found from the earlier nodes, in order.
        let is_found =
            |node: &Node| node.parent.as_ref().is_none_or(|it| (it.node as usize) < tried);
        OpenReason::Pairs { limit, states: self.nodes.partition_point(is_found) }
    }

    /// A lower bound on the pairs that a one-by-one search visits, if all states are known here: it visits each state (without its times) with at least one
    /// combination of times.
    fn least_pairs_one_by_one(&self, net: &Net) -> u64 {
        let relevance = Relevance::of(net);
        let largest = |state: &State| relevance.largest_dt(state.situation()).map_or(0, u64::from);
        self.states.iter().map(|state| largest(state) + 1).fold(0, u64::saturating_add)
    }

    /// True if a one-by-one search, up to the longest time, cannot end within the limits.
    pub(crate) fn are_too_many_one_by_one(&self, net: &Net, limits: &Limits) -> bool {
        self.states.len() > limits.states || self.least_pairs_one_by_one(net) > limits.pairs
    }

    /// A state of the node; with zones, without its times.
    pub(crate) fn state(&self, node: usize) -> &State {
        &self.states[self.nodes[node].state]
    }

    /// The rows of a shortest path from reset to the node.
    pub(crate) fn way_to(&self, node: usize) -> Vec<InputRow> {
        self.way(node, None)
    }

    /// The rows of a shortest path from reset to the node before this reaction, followed by the row of the reaction.
    pub(crate) fn way_of(&self, seen: &Seen<'_, '_>) -> Vec<InputRow> {
        self.way(seen.from, Some((seen.input, seen.came)))
    }

    /// A shortest stimulus from reset to the node.
    pub(crate) fn stimulus(&self, net: &Net, node: usize) -> Stimulus {
        Stimulus::of_rows(net, &self.way_to(node))
    }

    fn way(&self, node: usize, last: Option<(&InputRow, &Came)>) -> Vec<InputRow> {
        let mut parents: Vec<(usize, &Parent)> = Vec::new();
        let mut at = node;
        while let Some(parent) = &self.nodes[at].parent {
            parents.push((at, parent));
            at = parent.node as usize;
        }
        parents.reverse();
        let mut rows: Vec<InputRow> =
            parents.iter().map(|(_, parent)| parent.row.clone()).collect();
        rows.extend(last.map(|(row, _)| row.clone()));
        // The instant of row n is at least `least` after that of row m, for entries (m, n, least); the earliest instants that satisfy all of them are
        // used.
        let mut bounds: Vec<(usize, usize, i64)> = (0..rows.len()).map(|n| (n, n + 1, 0)).collect();
        let root = &self.nodes[at];
        // For each clock of the node on the path: the row in which it started, and its time then.
        let mut origins: Vec<(usize, i64)> =
            root.zone.first().into_iter().map(|time| (0, time)).collect();
        let n_known = parents.len();
        let steps = parents.iter().map(|(_, parent)| (&parent.came, Some(&parent.sources)));
        let steps = steps.chain(last.map(|(_, came)| (came, None)));
        for (now, (came, sources)) in (1..).zip(steps) {
            for (clock, (least, most)) in came.times.iter().enumerate() {
                let (start, time) = origins[clock];
                bounds.push((start, now, least - time));
                bounds.extend(most.map(|most| (now, start, time - most)));
            }
            for (first, second, by) in &came.ahead {
                let ((a, time_a), (b, time_b)) = (origins[*first], origins[*second]);
                // By the bound: first - second = (b - a) + (time_a - time_b) <= by
                bounds.push((b, a, time_a - time_b - by));
            }
            if let Some(sources) = sources {
                origins = sources
                    .iter()
                    .map(|source| match source {
                        Source::Kept(clock) => origins[*clock],
                        Source::Started(time) => (now, *time),
                    })
                    .collect();
            }
        }
        let instants = earliest(rows.len() + 1, &bounds);
        let mut clocks_run = parents
            .iter()
            .map(|(_, parent)| parent.node as usize)
            .chain((rows.len() > n_known).then_some(node));
        for (at, row) in rows.iter_mut().enumerate() {
            if clocks_run.next().is_some_and(|node| !self.nodes[node].clocks.is_empty()) {
                row.dt = u32::try_from(instants[at + 1] - instants[at]).unwrap_or(0);
            }
        }
        rows
    }
}

/// The earliest instants, starting with 0, that satisfy all bounds: each second instant is at least the given time after the first.
fn earliest(n: usize, bounds: &[(usize, usize, i64)]) -> Vec<i64> {
    let mut instants = vec![0_i64; n];
    // A path that was found is feasible, so this ends; the counter only protects against an endless loop caused by an internal error.
    for _ in 0..=n {
        let mut is_changed = false;
        for (from, to, least) in bounds {
            let after = instants[*from] + least;
            if instants[*to] < after {
                instants[*to] = after;
                is_changed = true;
            }
        }
        if !is_changed {
            break;
        }
    }
    instants
}

/// The result of a search.
#[derive(Debug, Clone)]
pub(crate) enum Ended<B> {
    /// Every state was visited with every input.
    Complete,
    /// The visitor stopped the search.
    Stopped(B),
    /// The search was abandoned, with the reason.
    Open(OpenReason),
}

impl<B> Ended<B> {
    /// The reason why the search was abandoned, if it was.
    pub(crate) fn open(&self) -> Option<&OpenReason> {
        match self {
            Ended::Complete | Ended::Stopped(_) => None,
            Ended::Open(why) => Some(why),
        }
    }
}

/// Visits every reaction from every reachable state, those nearest to reset first. Of all rows that give the same reaction, one is tried ([`crate::classes`]).
pub(crate) fn explore<'n, B>(
    net: &'n Valid<Net>,
    limits: &Limits,
    times: Times,
    visit: &mut impl FnMut(&States, &Seen<'_, 'n>) -> Option<B>,
) -> (States, Ended<B>) {
    explore_with(net, limits, times, &[], visit)
}

/// Like [`explore`], with rows that also differ in the receptivities of these transitions, which read only inputs and step activity.
pub(crate) fn explore_with<'n, B>(
    net: &'n Valid<Net>,
    limits: &Limits,
    times: Times,
    receptivities: &[TransitionId],
    visit: &mut impl FnMut(&States, &Seen<'_, 'n>) -> Option<B>,
) -> (States, Ended<B>) {
    let mut search = Search::new(net, limits, times, receptivities);
    let ended = search.run(visit).unwrap_or_else(Ended::Open);
    (search.found, ended)
}

/// A finished search and the data collected during it.
pub(crate) struct Searched<T, B> {
    pub(crate) seen: T,
    pub(crate) states: States,
    pub(crate) ended: Ended<B>,
    /// True if nodes represent sets of times.
    pub(crate) by_zones: bool,
}

/// Both methods are first tried with the limit of pairs divided by this number, because one may end early when the other would take long.
const FIRST_PART: u64 = 8;

/// Searches with any `dt`: with zones and, if that search is open because too many nodes differ only in their times, state by state. The data is collected anew
/// for each search. Returns the search that gives the answer, or the last one, and the earlier abandoned one, if there were two.
pub(crate) fn explore_any<'n, T, B>(
    net: &'n Valid<Net>,
    limits: &Limits,
    begin: impl Fn() -> T,
    visit: impl Fn(&mut T, &States, &Seen<'_, 'n>) -> Option<B>,
) -> (Searched<T, B>, Option<Searched<T, B>>) {
    let search = |times: Times, limits: &Limits| {
        let mut seen = begin();
        let (states, ended) =
            explore(net, limits, times, &mut |states, one| visit(&mut seen, states, one));
        Searched { seen, states, ended, by_zones: times == Times::Zones }
    };
    let each = Times::Each(Ticks::Any);
    if !Relevance::of(net).has_time() {
        return (search(each, limits), None);
    }
    let both = |limits: &Limits| {
        let zones = search(Times::Zones, limits);
        let states = &zones.states;
        // If few nodes differ only in their times, a one-by-one search has no fewer nodes.
        let is_worth_it = states.nodes.len() > 4 * states.states.len()
            && !states.are_too_many_one_by_one(net, limits);
        if zones.ended.open().is_none() || !is_worth_it {
            return (zones, None);
        }
        (search(each, limits), Some(zones))
    };
    let soon = both(&Limits { pairs: limits.pairs / FIRST_PART, ..limits.clone() });
    let ran_out = |it: &Searched<T, B>| matches!(it.ended.open(), Some(OpenReason::Pairs { .. }));
    let is_open = soon.0.ended.open().is_some();
    // Only a larger limit of pairs can change this.
    if is_open && (ran_out(&soon.0) || soon.1.as_ref().is_some_and(ran_out)) {
        return both(limits);
    }
    soon
}

/// The outputs that an assertion reads.
fn asserted_outputs(net: &Net) -> Vec<OutputId> {
    let asserts = net.properties.iter().filter(|it| it.role == PropertyRole::Assert);
    let outputs =
        asserts.flat_map(|property| property.never.leaves()).filter_map(|leaf| match leaf {
            PropertyLeaf::Output(output) => Some(*output),
            PropertyLeaf::Net(_) => None,
        });
    outputs.collect()
}

struct Search<'n, 'l> {
    limits: &'l Limits,
    times: Times,
    receptivities: &'l [TransitionId],
    simulator: Simulator<'n>,
    net: &'n Valid<Net>,
    relevance: Relevance<'n>,
    /// For each situation, what the next reaction can read.
    read_later: IndexMap<Situation, Inputs>,
    found: States,
    /// The row being tried, and the resulting state, in reused memory.
    row: InputRow,
    after: State,
}

/// A case of the reactions from a node: a state of the node, `dt`, and a part of the zone in which no comparison of times changes its truth value.
struct Case {
    before: State,
    dt: u32,
    came: Came,
    /// The zone after the latch, and a point of it.
    zone: Zone,
    point: Vec<i64>,
    /// True if the case is possible from every state of the node, after some `dt`.
    is_sure: bool,
}

impl<'n, 'l> Search<'n, 'l> {
    fn new(
        net: &'n Valid<Net>,
        limits: &'l Limits,
        times: Times,
        receptivities: &'l [TransitionId],
    ) -> Self {
        let simulator = Simulator::new(net);
        let clocks = match times {
            Times::Zones | Times::AllZones => simulator.clocks(),
            Times::Each(_) => Vec::new(),
        };
        let found = States {
            states: IndexSet::new(),
            by_state: Vec::new(),
            nodes: Vec::new(),
            clocks,
            pairs: 0,
            pairs_after: Vec::new(),
        };
        let (row, after) = (InputRow::default(), State::default());
        let (relevance, read_later) = (Relevance::of(net), IndexMap::new());
        Search {
            limits,
            times,
            receptivities,
            simulator,
            net,
            relevance,
            read_later,
            found,
            row,
            after,
        }
    }

    fn run<B>(
        &mut self,
        visit: &mut impl FnMut(&States, &Seen<'_, 'n>) -> Option<B>,
    ) -> Result<Ended<B>, OpenReason> {
        let (net, limits) = (self.net, self.limits);
        let longest = self.found.clocks.iter().filter_map(|clock| clock.cuts.last()).max();
        if longest.is_some_and(|longest| *longest > i64::from(MAX_DT)) {
            let why = format!("a time is longer than {MAX_DT} ticks");
            return Err(OpenReason::Method(why));
        }
        let (clocks, sources) = self.leave(None)?;
        let zone = Zone::point(&[]).map(&sources);
        self.node(clocks, zone, None)?;
        let mut classes = match Classes::of(net, limits) {
            Ok(classes) => classes,
            // No stimulus is legal: only the reset exists.
            Err(NoAlphabet::Contradiction) => return Ok(Ended::Complete),
            Err(NoAlphabet::TooMany(why)) => return Err(why),
        };
        self.simulator.record(&asserted_outputs(net));
        let mut at = 0;
        while at < self.found.nodes.len() {
            let room = limits.pairs.saturating_sub(self.found.pairs);
            let too_many = || self.found.too_many_pairs(limits.pairs, at);
            let cases = self.cases(at, room).ok_or_else(too_many)?;
            for case in cases {
                if let Some(answer) = self.rows(at, &case, &mut classes, visit)? {
                    return Ok(Ended::Stopped(answer));
                }
            }
            self.found.pairs_after.push(self.found.pairs);
            at += 1;
        }
        Ok(Ended::Complete)
    }

    /// Visits the reactions of a case, one for each class of rows.
    fn rows<B>(
        &mut self,
        node: usize,
        case: &Case,
        classes: &mut Classes<'n>,
        visit: &mut impl FnMut(&States, &Seen<'_, 'n>) -> Option<B>,
    ) -> Result<Option<B>, OpenReason> {
        let limit = self.limits.rows_per_state;
        let mut rows = classes.all();
        let mut n_rows = 0;
        while classes.first(rows, &mut self.row).is_some() {
            if n_rows == limit {
                return Err(OpenReason::Rows { limit });
            }
            if self.found.pairs == self.limits.pairs {
                return Err(self.found.too_many_pairs(self.limits.pairs, node));
            }
            if let Some(answer) = self.reaction(node, case, visit)? {
                return Ok(Some(answer));
            }
            n_rows += 1;
            let Some(asked) = self.simulator.asked() else { continue };
            if n_rows == 1 && classes.least(asked)? > limit {
                return Err(OpenReason::Rows { limit });
            }
            rows = classes.without(rows, &self.row, asked)?;
            classes.tidy(&mut rows);
        }
        Ok(None)
    }

    /// All possible times before a reaction from the node; `None` if there are more than `room`.
    fn cases(&self, node: usize, room: u64) -> Option<Vec<Case>> {
        let Times::Each(ticks) = self.times else { return self.parts(node, room) };
        let before = self.found.state(node);
        let dts = match (self.relevance.largest_dt(before.situation()), ticks) {
            (None, _) => 1..=1,
            (Some(_), Ticks::Chip) => 0..=1,
            (Some(largest), Ticks::Any) => 0..=largest,
        };
        if u64::from(dts.end() - dts.start()) >= room {
            return None;
        }
        let case = |dt| Case {
            before: before.clone(),
            dt,
            came: Came::default(),
            zone: Zone::point(&[]),
            point: Vec::new(),
            is_sure: true,
        };
        Some(dts.map(case).collect())
    }

    /// The parts of the node's zone, after any time, in which no comparison changes its truth value.
    fn parts(&self, node: usize, room: u64) -> Option<Vec<Case>> {
        let Node { clocks, zone, .. } = &self.found.nodes[node];
        let mut parts = vec![(Came::default(), zone.later())];
        for (place, clock) in clocks.iter().enumerate() {
            let cuts = &self.found.clocks[*clock].cuts;
            let mut finer = Vec::new();
            for (came, part) in parts {
                let starts = std::iter::once(0).chain(cuts.iter().copied());
                let ends = cuts.iter().map(|cut| Some(cut - 1)).chain([None]);
                for (least, most) in starts.zip(ends) {
                    if let Some(part) = part.clone().within(place, least, most) {
                        let mut came = came.clone();
                        came.times.push((least, most));
                        finer.push((came, part));
                    }
                }
            }
            parts = finer;
            if parts.len() as u64 > room {
                return None;
            }
        }
        let sends: Vec<(usize, i64)> = (clocks.iter().enumerate())
            .filter_map(|(place, clock)| Some((place, self.found.clocks[*clock].delay()?)))
            .collect();
        for (at, (second, later)) in sends.iter().enumerate() {
            for (first, delay) in &sends[..at] {
                // Of two due sends, the event of the one that was due earlier enters the queue first; if they were due at the same time, that of `first`.
                let is_due = |came: &Came, place: usize, delay: i64| came.times[place].0 >= delay;
                let by = later - delay;
                let mut finer = Vec::new();
                for (came, part) in parts {
                    if !is_due(&came, *first, *delay) || !is_due(&came, *second, *later) {
                        finer.push((came, part));
                        continue;
                    }
                    for (a, b, by) in [(*second, *first, by), (*first, *second, -by - 1)] {
                        if let Some(part) = part.clone().ahead_at_most(a, b, by) {
                            let mut came = came.clone();
                            came.ahead.push((a, b, by));
                            finer.push((came, part));
                        }
                    }
                }
                parts = finer;
            }
        }
        if parts.len() as u64 > room {
            return None;
        }
        Some(parts.into_iter().map(|(came, part)| self.case(node, came, part)).collect())
    }

    /// The case for a part: a point of the part, and the point of the node from which it is reached.
    fn case(&self, node: usize, came: Came, part: Zone) -> Case {
        let Node { clocks, zone, .. } = &self.found.nodes[node];
        // Each time is greater than 0 if possible, so that a clock that is reset differs from one that continues.
        let mut moved = part.clone();
        for clock in 0..part.len() {
            if let Some(later) = moved.clone().within(clock, 1, None) {
                moved = later;
            }
        }
        let point = moved.first();
        let too_late = |clock: usize| zone.most(clock).map_or(0, |most| point[clock] - most);
        let dt = (0..point.len()).map(too_late).max().unwrap_or(0).max(0);
        let mut before = self.found.state(node).clone();
        for (place, clock) in clocks.iter().enumerate() {
            let clock = &self.found.clocks[*clock];
            self.simulator.set_ticks(&mut before, clock, point[place] - dt);
        }
        // If nothing is counted, each row is one tick.
        let dt = if clocks.is_empty() { 1 } else { u32::try_from(dt).unwrap_or(MAX_DT) };
        let is_sure = part.earlier().includes(zone);
        Case { before, dt, came, zone: part, point, is_sure }
    }

    fn reaction<B>(
        &mut self,
        from: usize,
        case: &Case,
        visit: &mut impl FnMut(&States, &Seen<'_, 'n>) -> Option<B>,
    ) -> Result<Option<B>, OpenReason> {
        self.row.dt = case.dt;
        self.found.pairs += 1;
        self.simulator.set_state(&case.before);
        self.simulator.step(&self.row);
        for property in self.net.properties.iter().filter(|it| it.role == PropertyRole::Assert) {
            self.simulator.ask(property);
        }
        for transition in self.receptivities {
            let transition = &self.net.transitions[*transition];
            self.simulator.ask_function(receptivity(transition, case.before.situation()));
        }
        let (clocks, sources) = self.leave(Some((from, &case.point)))?;
        let mut zone = case.zone.map(&sources);
        let last_cut = |clock: &usize| self.found.clocks[*clock].cuts.last().copied();
        let last: Vec<i64> = clocks.iter().filter_map(last_cut).collect();
        zone.forget_beyond(&last);
        let to = self.node(clocks, zone, Some((from, case, sources)))?;
        let seen = Seen {
            from,
            to,
            before: &case.before,
            input: &self.row,
            row: self.simulator.row(),
            simulator: &self.simulator,
            is_sure: case.is_sure,
            came: &case.came,
        };
        Ok(visit(&self.found, &seen))
    }

    /// Sets `after` to the reached state: the times of running clocks are removed, and those of stopped clocks are rounded to thresholds. Returns the running
    /// clocks and the sources of their times. `ran` is the previous node and the point of its clocks after the latch; `None` at reset.
    fn leave(
        &mut self,
        ran: Option<(usize, &[i64])>,
    ) -> Result<(Vec<usize>, Vec<Source>), OpenReason> {
        self.keep_edges(ran.is_some());
        let (reached, state) = (self.simulator.state(), &mut self.after);
        let (mut clocks, mut sources) = (Vec::new(), Vec::new());
        for (at, clock) in self.found.clocks.iter().enumerate() {
            let time = self.simulator.ticks(reached, clock);
            if clock.cuts.is_empty() {
                self.simulator.set_ticks(state, clock, 0);
            } else if !self.simulator.runs(reached, clock) {
                self.simulator.set_ticks(state, clock, clock.floor(time));
            } else {
                let before = ran.and_then(|(node, point)| {
                    let ran = &self.found.nodes[node].clocks;
                    let place = ran.iter().position(|other| *other == at)?;
                    (time == clock.saturate(point[place])).then_some(place)
                });
                let source = match before {
                    Some(place) => Source::Kept(place),
                    None if time == 0 || ran.is_none() => Source::Started(time),
                    None => {
                        let why = "a time resumes from an earlier value";
                        return Err(OpenReason::Method(why.to_owned()));
                    }
                };
                clocks.push(at);
                sources.push(source);
                self.simulator.set_ticks(state, clock, 0);
            }
        }
        Ok((clocks, sources))
    }

    /// Sets `after` to the reached state, without the values of edge operands that the next reaction will not compare. The others are questions of this
    /// reaction.
    fn keep_edges(&mut self, is_reaction: bool) {
        self.after.clone_from(self.simulator.state());
        let net = self.net;
        if net.edges.is_empty() {
            return;
        }
        let situation = self.after.situation();
        if !self.read_later.contains_key(situation) {
            let read = self.relevance.first_edges(situation);
            self.read_later.insert(situation.clone(), read);
        }
        let read = &self.read_later[situation];
        for edge in net.edges.ids() {
            if !read.has_edge(net, edge) {
                self.simulator.forget_edge(&mut self.after, edge);
            } else if is_reaction {
                self.simulator.ask_edge(edge);
            }
        }
    }

    /// The node of the state `after` with a zone, created if it is new, with its origin.
    fn node(
        &mut self,
        clocks: Vec<usize>,
        zone: Zone,
        from: Option<(usize, &Case, Vec<Source>)>,
    ) -> Result<usize, OpenReason> {
        let at = match self.found.states.get_index_of(&self.after) {
            Some(at) => at,
            None => {
                self.found.by_state.push(SameState::default());
                self.found.states.insert_full(self.after.clone()).0
            }
        };
        let nodes = &mut self.found.by_state[at];
        let has_zones = !matches!(self.times, Times::Each(_));
        // An equal zone is looked up first, because that is fast; its entry is its own node, or a node whose zone includes it.
        let known = if has_zones { nodes.by_zone.get(&zone) } else { nodes.all.first() };
        if let Some(node) = known {
            return Ok(*node as usize);
        }
        if self.times == Times::Zones {
            let includes = |node: &&u32| self.found.nodes[**node as usize].zone.includes(&zone);
            if let Some(node) = nodes.all.iter().find(includes).copied() {
                if nodes.by_zone.len() < 2 * nodes.all.len() + REMEMBERED {
                    nodes.by_zone.insert(Rc::new(zone), node);
                }
                return Ok(node as usize);
            }
        }
        let number = self.found.nodes.len();
        if number >= self.limits.states {
            return Err(OpenReason::States { limit: self.limits.states });
        }
        let zone = Rc::new(zone);
        nodes.all.push(number as u32);
        if has_zones {
            nodes.by_zone.insert(Rc::clone(&zone), number as u32);
        }
        let parent = from.map(|(node, case, sources)| {
            let (node, row, came) = (node as u32, self.row.clone(), case.came.clone());
            Parent { node, row, came, sources }
        });
        self.found.nodes.push(Node { state: at, clocks, zone, parent });
        Ok(number)
    }
}
