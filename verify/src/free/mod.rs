//! The proof that parts that run on their own behave like the net (semantics §10.7).
//!
//! The parts with their lines ([`FreeParts`]) are searched exhaustively, *episode* by episode. An episode starts at rest; the plant changes one input, or a tick passes, or
//! both in any order; then the parts react and the lines deliver, in every order, until nothing changes any more. The net makes the same episode: it reacts with the new
//! input, and with the tick, until it is at rest. If both happen, its tick comes before, with or in any reaction after the change, or the change in any reaction after
//! the tick: each of these is one *run* of the net. Every way of the parts must be one run of the net: each output and each step takes the same sequence of values, and
//! at rest all variables are equal. Asserts hold at every moment.
//!
//! The search ends because it visits each moment of an episode once, and every episode from each pair of a state of the net and a moment at rest. A cycle of moments is a
//! way that may never come to rest, and is refused. The longest way of all episodes, in reactions, bounds the time until rest.

use std::collections::BTreeSet;

use grafsynth_ir::Valid;
use grafsynth_ir::division::Division;
use grafsynth_ir::net::{
    InputId, InputKind, Leaf, Net, Property, PropertyLeaf, PropertyRole, VarId,
};
use grafsynth_sim::{
    FreeParts, InputRow, Moment, Simulator, State, breaks_assumption, measures_time, seen,
};
use indexmap::IndexSet;

use crate::alphabet::{NoAlphabet, values};
use crate::limits::Limits;
use crate::verdict::{Open, OpenReason, Verdict};

mod race;
mod ways;

pub use race::{Event, Race, Unlike};
use ways::Ways;

/// The proof that free-running parts behave like the net.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Settled {
    /// The number of situations at rest from which all episodes were tried.
    pub rests: usize,
    /// The number of moments that were compared.
    pub moments: u64,
    /// The largest number of reactions, of all parts, in one episode.
    pub longest: usize,
    /// True if a tick may pass during an episode.
    pub has_time: bool,
}

/// Proves or refutes that the parts of a division that run on their own behave like the net.
#[must_use]
pub fn settles(net: &Valid<Net>, division: &Division, limits: &Limits) -> Verdict<Settled, Race> {
    let mut search = match Search::new(net, division, limits) {
        Ok(search) => search,
        Err(open) => return Verdict::Open(open),
    };
    match search.run() {
        Ok(settled) => Verdict::Proved(settled),
        Err(Stop::Race(race)) => Verdict::Refuted(race),
        Err(Stop::Open(open)) => Verdict::Open(open),
    }
}

/// Why a search ends early.
enum Stop {
    Race(Race),
    Open(Open),
}

/// What starts an episode.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct Episode {
    change: Option<(InputId, i64)>,
    tick: bool,
}

impl Episode {
    /// The inputs of the plant before or after the change.
    fn inputs(self, rest: &Rest, is_changed: bool) -> Vec<i64> {
        let row = InputRow { dt: 0, values: rest.inputs.clone() };
        match self.change {
            Some((id, value)) if is_changed => row.with(id, value).values,
            _ => row.values,
        }
    }
}

/// The parts and the net at rest.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
struct Rest {
    whole: State,
    moment: Moment,
    /// The inputs of the plant.
    inputs: Vec<i64>,
}

/// A run of the net in an episode.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Run {
    /// The values that each output and step takes, without the one at the start.
    changes: Vec<Vec<i64>>,
    end: State,
}

/// A moment of an episode, with what is left to happen and what was seen.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
struct Point {
    moment: Moment,
    change_left: bool,
    tick_left: bool,
    /// How many values each output and step has taken.
    taken: Vec<u32>,
    /// The runs of the net that have taken the same values so far.
    runs: Vec<u32>,
}

/// The largest number of runs of the net that an episode may have.
const MOST_RUNS: usize = 256;

/// The largest number of reactions of the net until it is at rest.
const MOST_REACTIONS: usize = 1 << 14;

struct Search<'n> {
    net: &'n Valid<Net>,
    division: &'n Division,
    parts: FreeParts<'n>,
    whole: Simulator<'n>,
    values: Vec<Vec<i64>>,
    /// The asserts, with their places among the properties.
    asserts: Vec<(usize, &'n Property)>,
    has_time: bool,
    limits: Limits,
    moments: u64,
    longest: usize,
    rests: IndexSet<Rest>,
    /// The rest from which each rest was first reached, unless that was reset, and the events in between.
    from: Vec<(Option<usize>, Vec<Event>)>,
}

impl<'n> Search<'n> {
    fn new(net: &'n Valid<Net>, division: &'n Division, limits: &Limits) -> Result<Self, Open> {
        let all = net.properties.iter().enumerate();
        let asserts: Vec<(usize, &Property)> =
            all.filter(|(_, one)| one.role == PropertyRole::Assert).collect();
        let is_seen = |leaf: &PropertyLeaf| match leaf {
            PropertyLeaf::Output(_) => true,
            PropertyLeaf::Net(leaf) => {
                matches!(leaf, Leaf::Input(_) | Leaf::Active(_) | Leaf::Var(_))
            }
        };
        if let Some((_, one)) = asserts.iter().find(|(_, one)| !one.never.leaves().all(is_seen)) {
            let name = if one.name.is_empty() { "an assert" } else { one.name.as_str() };
            let why = format!(
                "{name} reads a time or an edge, which parts that run on their own do not share"
            );
            return Err(Open::because(why));
        }
        let values = match values(net, false, limits.rows_per_state) {
            Ok(values) => values,
            Err(NoAlphabet::TooMany(why)) => return Err(Open::because(why)),
            Err(NoAlphabet::Contradiction) => return Err(Open::because(OpenReason::Assumptions)),
        };
        Ok(Search {
            net,
            division,
            parts: FreeParts::new(net, division),
            whole: Simulator::new(net),
            values,
            asserts,
            has_time: measures_time(net),
            limits: limits.clone(),
            moments: 0,
            longest: 0,
            rests: IndexSet::new(),
            from: Vec::new(),
        })
    }

    fn run(&mut self) -> Result<Settled, Stop> {
        let net = self.net;
        let zero = InputRow { dt: 0, ..InputRow::zero(net) };
        if breaks_assumption(net, &zero) {
            let why = "an assumption excludes that all inputs are 0, as they are until the parts have started";
            return Err(Stop::Open(Open::because(why.to_owned())));
        }
        let inputs = zero.values;
        self.whole.reset();
        let first = Rest { whole: self.whole.state().clone(), moment: self.parts.reset(), inputs };
        let start = self.parts.seen(&first.moment);
        if seen(self.whole.row(), net.steps.len()) != start {
            return Err(self.race(Unlike::Reset, None, Vec::new()));
        }
        self.episode(&first, None, Episode::default())?;
        let mut changed: BTreeSet<InputId> = BTreeSet::new();
        let mut at = 0;
        while at < self.rests.len() {
            let Some(rest) = self.rests.get_index(at).cloned() else { break };
            let mut episodes = Vec::new();
            if self.has_time {
                episodes.push(Episode { change: None, tick: true });
            }
            for (id, _) in net.inputs.iter().filter(|(_, it)| it.kind == InputKind::Pin) {
                let before = rest.inputs.get(id.index()).copied().unwrap_or(0);
                let others = self.values.get(id.index()).into_iter().flatten();
                for value in others.copied().filter(|value| *value != before) {
                    let row = InputRow { dt: 0, values: rest.inputs.clone() }.with(id, value);
                    if breaks_assumption(net, &row) {
                        continue;
                    }
                    changed.insert(id);
                    let change = Some((id, value));
                    episodes.push(Episode { change, tick: false });
                    if self.has_time {
                        episodes.push(Episode { change, tick: true });
                    }
                }
            }
            for episode in episodes {
                self.episode(&rest, Some(at), episode)?;
            }
            at += 1;
        }
        let pins = net.inputs.iter().filter(|(_, input)| input.kind == InputKind::Pin);
        if let Some((_, stuck)) = pins.into_iter().find(|(id, _)| !changed.contains(id)) {
            let why = format!(
                "input `{}` can never change alone under the assumptions, but inputs of free-running chips change one at a time",
                stuck.name
            );
            return Err(Stop::Open(Open::because(why)));
        }
        let Search { moments, longest, has_time, .. } = *self;
        Ok(Settled { rests: self.rests.len(), moments, longest, has_time })
    }

    /// All ways of one episode.
    fn episode(&mut self, rest: &Rest, from: Option<usize>, episode: Episode) -> Result<(), Stop> {
        let start = self.parts.seen(&rest.moment);
        let runs = match self.runs(rest, &start, episode) {
            Ok(runs) => runs,
            Err(NoRest::Never) => {
                let change = episode.change.map(|(input, value)| Event::Change(input, value));
                let part = self.division.parts.len().saturating_sub(1);
                let takes = vec![0; self.parts.under_way(&rest.moment, part).count()];
                let tick = episode.tick.then_some(Event::React { part, takes, tick: true });
                return Err(self.race(
                    Unlike::NetMoves,
                    from,
                    change.into_iter().chain(tick).collect(),
                ));
            }
            Err(NoRest::TooMany) => {
                let why = "an episode has too many orders of tick and change".to_owned();
                return Err(Stop::Open(Open::because(why)));
            }
        };
        let mut ways = Ways::new(Point {
            moment: rest.moment.clone(),
            change_left: episode.change.is_some(),
            tick_left: episode.tick,
            taken: vec![0; start.len()],
            runs: (0..runs.len() as u32).collect(),
        });
        let mut at = 0;
        while let Some(point) = ways.point(at) {
            self.count()?;
            let inputs = episode.inputs(rest, !point.change_left);
            let mut stop = Ok(());
            if let Some(one) = self.broken(&point.moment, &inputs) {
                stop = Err((Unlike::Assert(one), None));
            }
            let mut next = Vec::new();
            if stop.is_ok() {
                stop = self.follow(&point, episode, &runs, &mut next);
            }
            if let Err((what, last)) = stop {
                return Err(self.race(what, from, ways.trace(at, last)));
            }
            if next.is_empty() {
                self.rest(&point, &runs, (from, inputs), ways.trace(at, None))?;
            }
            ways.add(at, next);
            at += 1;
        }
        match ways.longest() {
            Ok(n) => self.longest = self.longest.max(n),
            Err(at) => return Err(self.race(Unlike::PartsMove, from, ways.trace(at, None))),
        }
        Ok(())
    }

    /// Counts a moment.
    fn count(&mut self) -> Result<(), Stop> {
        self.moments += 1;
        if self.moments <= self.limits.pairs {
            return Ok(());
        }
        let reason = OpenReason::Pairs { limit: self.limits.pairs, states: self.rests.len() };
        Err(Stop::Open(Open::because(reason)))
    }

    /// The points that can follow a point, with what happens before each.
    ///
    /// # Errors
    /// What no run of the net has, and the event that shows it.
    fn follow(
        &mut self,
        point: &Point,
        episode: Episode,
        runs: &[Run],
        next: &mut Vec<(Event, Point)>,
    ) -> Result<(), (Unlike, Option<Event>)> {
        let before = self.parts.seen(&point.moment);
        for (event, mut follower) in self.events(point, episode) {
            let after = self.parts.seen(&follower.moment);
            if let Err(object) = advance(&mut follower, runs, &before, &after) {
                let value = after.get(object).copied().unwrap_or(0);
                return Err((Unlike::Becomes(object, value), Some(event)));
            }
            if follower != *point {
                next.push((event, follower));
            }
        }
        Ok(())
    }

    /// The end of a way: a run of the net must end here too.
    fn rest(
        &mut self,
        point: &Point,
        runs: &[Run],
        (from, inputs): (Option<usize>, Vec<i64>),
        events: Vec<Event>,
    ) -> Result<(), Stop> {
        let is_complete = |run: &Run| {
            run.changes.iter().zip(&point.taken).all(|(all, taken)| all.len() == *taken as usize)
        };
        let of_point = point.runs.iter().filter_map(|run| runs.get(*run as usize));
        let complete: Vec<&Run> = of_point.clone().filter(|run| is_complete(run)).collect();
        if complete.is_empty() {
            let open = of_point.flat_map(|run| {
                let mut all = run.changes.iter().zip(&point.taken).enumerate();
                all.find_map(|(object, (all, taken))| Some((object, *all.get(*taken as usize)?)))
            });
            let what = match open.into_iter().next() {
                Some((object, value)) => Unlike::Missing(object, value),
                None => Unlike::Rest,
            };
            return Err(self.race(what, from, events));
        }
        // Any of these runs is a witness; the one whose stored values are those of the parts is also one for the next episodes.
        let mut best: Option<(usize, &Run)> = None;
        let mut wrong = None;
        for run in complete {
            self.whole.set_state(&run.end);
            if let Some(var) = self.other_variable(&point.moment) {
                wrong = Some(var);
                continue;
            }
            let n = self.parts.differences(&point.moment, &self.whole);
            if best.is_none_or(|(least, _)| n < least) {
                best = Some((n, run));
            }
        }
        let Some((_, run)) = best else {
            return Err(self.race(wrong.map_or(Unlike::Rest, Unlike::Variable), from, events));
        };
        let rest = Rest { whole: run.end.clone(), moment: point.moment.clone(), inputs };
        if self.rests.insert(rest) {
            self.from.push((from, events));
            if self.rests.len() > self.limits.states {
                let reason = OpenReason::States { limit: self.limits.states };
                return Err(Stop::Open(Open::because(reason)));
            }
        }
        Ok(())
    }

    /// A variable whose value differs from that of the net, whose simulator has the state to compare with.
    fn other_variable(&mut self, moment: &Moment) -> Option<VarId> {
        let net = self.net;
        let mut all = net
            .vars
            .iter()
            .flat_map(|(id, var)| (0..var.len.unwrap_or(1)).map(move |index| (id, index)));
        let differs = |(id, index): &(VarId, u32)| {
            self.parts.var(moment, *id, *index) != self.whole.var(*id, *index)
        };
        all.find(differs).map(|(id, _)| id)
    }

    /// The place of an assert that does not hold.
    fn broken(&mut self, moment: &Moment, inputs: &[i64]) -> Option<usize> {
        if self.asserts.is_empty() {
            return None;
        }
        let all = self.parts.seen(moment);
        let n_outputs = self.net.outputs.len();
        let parts = &mut self.parts;
        let mut value = |leaf: &PropertyLeaf, index: i64| match leaf {
            PropertyLeaf::Output(id) => all.get(id.index()).copied().unwrap_or(0),
            PropertyLeaf::Net(Leaf::Active(id)) => {
                all.get(n_outputs + id.index()).copied().unwrap_or(0)
            }
            PropertyLeaf::Net(Leaf::Input(id)) => inputs.get(id.index()).copied().unwrap_or(0),
            PropertyLeaf::Net(Leaf::Var(id)) => {
                parts.var(moment, *id, u32::try_from(index).unwrap_or(0))
            }
            // `new` accepts no other ones.
            PropertyLeaf::Net(_) => 0,
        };
        let mut broken = self.asserts.iter().filter(|(_, one)| one.never.eval(&mut value) != 0);
        broken.next().map(|(at, _)| *at)
    }

    /// Everything that can happen at a point, before what is seen then is compared.
    fn events(&mut self, point: &Point, episode: Episode) -> Vec<(Event, Point)> {
        let mut all = Vec::new();
        if let (true, Some((input, value))) = (point.change_left, episode.change) {
            let mut next = Point { change_left: false, ..point.clone() };
            self.parts.change(&mut next.moment, input, value);
            all.push((Event::Change(input, value), next));
        }
        let cpu = self.division.parts.len().saturating_sub(1);
        for part in 0..self.division.parts.len() {
            let under_way: Vec<usize> = self.parts.under_way(&point.moment, part).collect();
            for takes in choices(&under_way) {
                let ticks = [false, true];
                for tick in ticks.into_iter().filter(|tick| !tick || point.tick_left && part == cpu)
                {
                    let moment = self.parts.react(&point.moment, part, &takes, u32::from(tick));
                    let tick_left = point.tick_left && !tick;
                    let next = Point { moment, tick_left, ..point.clone() };
                    all.push((Event::React { part, takes: takes.clone(), tick }, next));
                }
            }
        }
        all
    }

    /// The runs of the net in an episode.
    fn runs(&mut self, rest: &Rest, start: &[i64], episode: Episode) -> Result<Vec<Run>, NoRest> {
        let mut runs: Vec<Run> = Vec::new();
        let mut add = |run: Run| {
            if !runs.contains(&run) {
                runs.push(run);
            }
        };
        match (episode.change, episode.tick) {
            (Some(_), true) => {
                // The first of the two comes in the first reaction, and the second in each reaction until the net would have been at rest again.
                for change_first in [true, false] {
                    for second in 1.. {
                        if second > MOST_RUNS {
                            return Err(NoRest::TooMany);
                        }
                        let (change, tick) = if change_first { (1, second) } else { (second, 1) };
                        let (run, rested) = self.whole_run(rest, start, episode, (change, tick))?;
                        add(run);
                        if rested < second {
                            break;
                        }
                    }
                }
            }
            (_, tick) => add(self.whole_run(rest, start, episode, (1, usize::from(tick)))?.0),
        }
        Ok(runs)
    }

    /// The run of the net in which the input changes in one reaction, counted from 1, and the tick passes in another one (0 is never). Also the number of the reaction after
    /// which the net would have been at rest without the second event.
    fn whole_run(
        &mut self,
        rest: &Rest,
        start: &[i64],
        episode: Episode,
        (change, tick): (usize, usize),
    ) -> Result<(Run, usize), NoRest> {
        self.whole.set_state(&rest.whole);
        let mut changes = vec![Vec::new(); start.len()];
        let (mut last, mut rested) = (start.to_vec(), usize::MAX);
        let mut row = InputRow { dt: 0, values: rest.inputs.clone() };
        let mut been: IndexSet<State> = IndexSet::new();
        for reaction in 1..MOST_REACTIONS {
            if reaction == change
                && let Some((input, value)) = episode.change
            {
                row = row.with(input, value);
            }
            row.dt = u32::from(reaction == tick);
            let before = self.whole.state().clone();
            let after = seen(self.whole.step(&row), self.net.steps.len());
            let mut is_same = *self.whole.state() == before;
            for ((all, last), value) in changes.iter_mut().zip(&mut last).zip(after) {
                if *last != value {
                    (*last, is_same) = (value, false);
                    all.push(value);
                }
            }
            if is_same && reaction > 1 && row.dt == 0 {
                rested = rested.min(reaction);
            }
            if reaction > change.max(tick) {
                if is_same {
                    let end = self.whole.state().clone();
                    return Ok((Run { changes, end }, rested));
                }
                if !been.insert(before) {
                    return Err(NoRest::Never);
                }
            }
        }
        Err(NoRest::Never)
    }

    /// A race, with the way from the start to the rest, and then these events.
    fn race(&self, what: Unlike, from: Option<usize>, events: Vec<Event>) -> Stop {
        let mut episodes = vec![events];
        let mut at = from;
        while let Some((before, events)) = at.and_then(|at| self.from.get(at)) {
            episodes.push(events.clone());
            at = *before;
        }
        episodes.reverse();
        Stop::Race(Race { what, episodes })
    }
}

/// Why an episode of the net has no end.
enum NoRest {
    Never,
    TooMany,
}

/// Each number of changes that can be taken from each line.
fn choices(under_way: &[usize]) -> Vec<Vec<usize>> {
    let mut all = vec![Vec::new()];
    for most in under_way {
        all = all
            .iter()
            .flat_map(|one: &Vec<usize>| {
                (0..=*most).map(move |n| one.iter().copied().chain([n]).collect())
            })
            .collect();
    }
    all
}

/// Adds what was seen to a point, and keeps the runs that have the same; otherwise returns the index of the output or step that no run has.
fn advance(point: &mut Point, runs: &[Run], before: &[i64], after: &[i64]) -> Result<(), usize> {
    for (object, (old, new)) in before.iter().zip(after).enumerate() {
        let Some(taken) = point.taken.get_mut(object).filter(|_| old != new) else { continue };
        let at = *taken as usize;
        let has = |run: &u32| {
            let changes = runs.get(*run as usize).and_then(|run| run.changes.get(object));
            changes.and_then(|all| all.get(at)) == Some(new)
        };
        point.runs.retain(has);
        if point.runs.is_empty() {
            return Err(object);
        }
        *taken += 1;
    }
    Ok(())
}
