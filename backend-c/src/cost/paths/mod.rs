//! The worst-case reaction among those that can happen: every path through `NAME_step` from every instance that the chart can reach, with the costs
//! of the text.
//!
//! # How it is found
//! - [`Way::Each`]: starts at the instance after `NAME_init`, and runs reactions with all inputs until no new instance appears: all paths that values
//!   allow, one by one. Numbers that do not select a path are intervals, and an input is unknown until a condition reads it.
//! - [`Way::Joined`]: if that is too much work, all instances are joined into one that records the possible values of each member. Within a reaction,
//!   states are kept apart by the flags and counters of the loop over micro-steps (which event is taken, how many are pending) and joined otherwise;
//!   so each event of a row counts once, with the worst case of the regions.
//!
//! Both ways count every path that a processor can take. If something cannot be followed (user code, copied structures), the bound of the text applies.

pub(in crate::cost) mod code;
mod contract;
pub(in crate::cost) mod run;
pub(in crate::cost) mod values;

use super::tree::{Type, Unit};
use super::walk::compile::{NOWHERE, cells, numbers};
use code::{Price, Routine};
pub(crate) use contract::Contract;
use run::{Run, State, Stopped};
use std::collections::{BTreeMap, BTreeSet};
use values::{Kind, Values};

/// How the paths were explored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Way {
    /// Path by path from every reachable instance; the payload is the number of instances.
    Each(usize),
    /// From all instances joined.
    Joined,
    /// From the text alone: the most expensive branch of each `if` and `switch`, each loop with its maximum number of rounds.
    Text,
}

/// The worst-case reaction.
#[derive(Debug, Clone)]
pub(in crate::cost) struct Found {
    pub(in crate::cost) price: Price,
    /// The worst-case reaction for rows with at most one event.
    pub(in crate::cost) of_one_event: Price,
    /// The maximum of a reaction that ends without a fault; `None` if each path was explored separately, because a fault is then real.
    pub(in crate::cost) settled: Option<Price>,
    /// Lines with their cost, in the order of the path.
    pub(in crate::cost) path: Vec<(u32, u64)>,
    pub(in crate::cost) way: Way,
}

/// The data about a chart that path exploration needs.
pub(in crate::cost) struct Chart<'a> {
    pub(in crate::cost) unit: &'a Unit,
    pub(in crate::cost) routines: &'a [Routine],
    pub(in crate::cost) int_bits: u8,
    pub(in crate::cost) step: usize,
    pub(in crate::cost) init: usize,
    pub(in crate::cost) prefix: &'a str,
    pub(in crate::cost) contract: &'a Contract,
}

/// The maximum work of all searches of a chart together. The unit is one statement executed on one state; creating and joining states
/// counts as work too. This much work takes at most about ten seconds in an unoptimised build.
const WORK: u64 = 10_000_000;
/// The maximum work of one search from instance to instance.
const WORK_OF_EACH: u64 = 3_000_000;
/// The maximum number of instances that are examined one by one.
const INSTANCES: usize = 4000;
/// The maximum number of simultaneous states.
const STATES: usize = 300;

/// A cell of a structure.
struct Cell {
    /// The member that contains it.
    member: usize,
    kind: Option<Kind>,
}

fn layout(unit: &Unit, ty: &Type, member: usize, all: &mut Vec<Cell>) {
    match ty {
        Type::Void => {}
        Type::Number { .. } | Type::Pointer(..) => {
            all.push(Cell { member, kind: numbers(ty) });
        }
        Type::Array(element, _) => {
            let n = cells(unit, ty) / cells(unit, element).max(1);
            (0..n).for_each(|_| layout(unit, element, member, all));
        }
        Type::Struct(index) => {
            for part in unit.structs.get(*index).map(Vec::as_slice).unwrap_or_default() {
                layout(unit, &part.ty, member, all);
            }
        }
    }
}

/// Numbers with at most this many values are tracked exactly from one reaction to the next in every search.
const FEW: i64 = 16;

fn is_number(cell: &Cell) -> bool {
    cell.kind.is_some_and(|kind| !kind.is_bool)
}

/// The search.
struct Search<'a> {
    chart: &'a Chart<'a>,
    /// The cells of the instance and of the inputs.
    own: Vec<Cell>,
    inputs: Vec<Values>,
    /// The values that replace inputs, for each kind of row: cells with their values.
    rows: Vec<Vec<(usize, Values)>>,
    /// The possible values of the instance members.
    ranges: Vec<Values>,
    /// The cell of the fault flag.
    fault: Option<usize>,
    /// The remaining work for all searches, and for the current one.
    left: u64,
    work: u64,
    keys: Option<Vec<usize>>,
    is_traced: bool,
}

/// The worst-case reaction, or why it was not found.
pub(in crate::cost) fn worst(chart: &Chart<'_>) -> Result<Found, Stopped> {
    let mut search = Search::new(chart);
    // Rows with one event are a subset of all rows, and if that is the contract, there are no others.
    let all_rows = vec![Vec::new()];
    let single_rows = search.rows_of_one_event();
    let of = |search: &mut Search<'_>, rows: &[Vec<(usize, Values)>]| {
        search.rows = rows.to_vec();
        let of_instance = search.keys(true);
        // Each search runs only if it joins something that the previous one did not.
        let (has_numbers, has_arrays) = search.has();
        let kinds =
            [(true, false, None), (has_numbers, true, None), (has_arrays, true, Some(of_instance))];
        for (is_tried, is_wide, keys) in kinds {
            if !is_tried {
                continue;
            }
            match search.within(WORK_OF_EACH, keys, |it| it.each(is_wide)) {
                Err(Stopped::TooMuch) => {}
                found => return found,
            }
        }
        let keys = search.keys(false);
        search.within(WORK, Some(keys), Search::joined)
    };
    let is_exclusive = chart.contract.is_exclusive && single_rows.len() > 1;
    let mut found = of(&mut search, if is_exclusive { &single_rows } else { &all_rows })?;
    found.of_one_event = found.price;
    if !is_exclusive && single_rows.len() > 1 {
        match of(&mut search, &single_rows) {
            Ok(single) => found.of_one_event = single.price,
            // The bound for all rows also applies to these rows.
            Err(Stopped::TooMuch) => {}
            Err(why) => return Err(why),
        }
    }
    Ok(found)
}

impl<'a> Search<'a> {
    fn new(chart: &'a Chart<'a>) -> Self {
        let unit = chart.unit;
        let of = |end: &str| unit.types.get(&*format!("{}_{end}", chart.prefix));
        let members = |end: &str| of(end).and_then(|ty| unit.members(ty)).unwrap_or_default();
        let mut own = Vec::new();
        for (at, member) in members("t").iter().enumerate() {
            layout(unit, &member.ty, at, &mut own);
        }
        let mut of_inputs = Vec::new();
        for (at, member) in members("in_t").iter().enumerate() {
            layout(unit, &member.ty, at, &mut of_inputs);
        }
        let any = Values::range(i64::MIN, i64::MAX);
        let within = |cell: &Cell, end: &str, ranges: &[(String, i64, i64)]| {
            let all = cell.kind.map_or(any, Kind::all);
            let name = members(end).get(cell.member).map(|it| it.name.clone());
            let range = ranges.iter().find(|(it, ..)| name.as_deref() == Some(it));
            let narrow = range.map_or(all, |(_, lo, hi)| all.within(*lo, *hi));
            if narrow.is_none() { all } else { narrow }
        };
        let inputs =
            of_inputs.iter().map(|it| within(it, "in_t", &chart.contract.inputs)).collect();
        let ranges = own.iter().map(|it| within(it, "t", &chart.contract.members)).collect();
        let fault = members("t").iter().position(|it| &*it.name == "fault");
        let fault = fault.and_then(|fault| own.iter().position(|it| it.member == fault));
        Search {
            chart,
            own,
            inputs,
            rows: Vec::new(),
            ranges,
            fault,
            left: WORK,
            work: 0,
            keys: None,
            is_traced: false,
        }
    }

    /// Runs a search with at most this much work, or the rest of the total if that is less. If there are too many states, only those that
    /// differ in these cells are kept apart.
    fn within(
        &mut self,
        most: u64,
        keys: Option<Vec<usize>>,
        search: impl FnOnce(&mut Self) -> Result<Found, Stopped>,
    ) -> Result<Found, Stopped> {
        let given = most.min(self.left);
        (self.work, self.keys) = (given, keys);
        let found = search(self);
        self.left -= given - self.work.min(given);
        found
    }

    /// Two flags: whether the instance has numbers with many values, and whether it has arrays.
    fn has(&self) -> (bool, bool) {
        let is_wide = |(cell, range): (&Cell, &Values)| {
            is_number(cell) && range.hi().saturating_sub(range.lo()) > FEW
        };
        let has_numbers = self.own.iter().zip(&self.ranges).any(is_wide);
        let ty = self.chart.unit.types.get(&*format!("{}_t", self.chart.prefix));
        let members = ty.and_then(|ty| self.chart.unit.members(ty)).unwrap_or_default();
        (has_numbers, members.iter().any(|it| matches!(it.ty, Type::Array(..))))
    }

    /// Rows with one event and with none: for each, the values that replace the inputs.
    fn rows_of_one_event(&self) -> Vec<Vec<(usize, Values)>> {
        let chart = self.chart;
        let ty = chart.unit.types.get(&*format!("{}_in_t", chart.prefix));
        let members = ty.and_then(|ty| chart.unit.members(ty)).unwrap_or_default();
        let mut places = Vec::new();
        let mut first = 0;
        for member in members {
            for event in chart.contract.events.iter().filter(|it| *it.member == *member.name) {
                places.push((first + event.element, event.mask));
            }
            first += cells(chart.unit, &member.ty);
        }
        let row = |wanted: Option<usize>| {
            let mut row: BTreeMap<usize, Values> = BTreeMap::new();
            for (at, (cell, mask)) in places.iter().enumerate() {
                let all = self.inputs.get(*cell).copied().unwrap_or(Values::NONE);
                let values = row.entry(*cell).or_insert(all);
                let is_set = |it: &i64| (it & mask != 0) == (wanted == Some(at));
                *values =
                    Values::of(values.listed().unwrap_or_default().into_iter().filter(is_set));
            }
            row.into_iter().collect()
        };
        std::iter::once(None).chain((0..places.len()).map(Some)).map(row).collect()
    }

    /// The final states of one function, started from these instances.
    fn run(
        &mut self,
        routine: usize,
        own: &[Values],
        row: &[(usize, Values)],
    ) -> Result<Vec<State>, Stopped> {
        let chart = self.chart;
        // The instance, then the inputs, then the cells of the functions.
        let first_input = own.len();
        let mut memory = own.to_vec();
        memory.extend_from_slice(&self.inputs);
        let depth = chart.routines.get(routine).map_or(0, |it| it.depth);
        memory.resize(memory.len() + depth, Values::one(0));
        for (at, values) in row {
            if let Some(place) = memory.get_mut(first_input + at) {
                *place = *values;
            }
        }
        let place = |at: usize| Values::one(i64::try_from(at).unwrap_or(NOWHERE));
        let name = if routine == chart.step { "step" } else { "init" };
        let name = format!("{}_{name}", chart.prefix);
        let function = chart.unit.functions.iter().find(|it| *it.name == *name);
        let parameters = function.map(|it| it.parameters.as_slice()).unwrap_or_default();
        let given: Vec<Values> = parameters
            .iter()
            .map(|(name, ty)| match (&**name, numbers(ty)) {
                ("self", None) => place(0),
                ("in", None) => place(first_input),
                (_, None) => Values::one(NOWHERE),
                (_, Some(kind)) => kind.all(),
            })
            .collect();
        let mut run = Run {
            routines: chart.routines,
            int_bits: chart.int_bits,
            work: self.work,
            most_states: STATES,
            keys: self.keys.clone(),
            is_traced: self.is_traced,
            line: 0,
            frame: own.len() + self.inputs.len(),
            size: 0,
            depth: 0,
        };
        let state = State { memory, price: Price::default(), way: None };
        let ends = run.call(routine, &given, state);
        self.work = run.work;
        Ok(ends?.into_iter().map(|(state, _)| state).collect())
    }

    fn own_of(&self, state: &State) -> Vec<Values> {
        state.memory.get(..self.own.len()).map(<[_]>::to_vec).unwrap_or_default()
    }

    fn may_fault(&self, state: &State) -> bool {
        let cell = self.fault.and_then(|at| state.memory.get(at));
        cell.is_some_and(|it| it.contains(1))
    }

    /// The instances after `NAME_init`.
    fn first(&mut self) -> Result<Vec<Vec<Values>>, Stopped> {
        let any: Vec<Values> = self
            .own
            .iter()
            .map(|it| it.kind.map_or(Values::range(i64::MIN, i64::MAX), Kind::all))
            .collect();
        let init = self.chart.init;
        let ends = self.run(init, &any, &[])?;
        Ok(ends.iter().map(|it| self.own_of(it)).collect())
    }

    /// Records the most expensive of these final states in `best`, with its start.
    fn note(&self, ends: &[State], from: &[Values], row: usize, best: &mut Best) {
        for end in ends {
            best.price = best.price.or(end.price);
            if !self.may_fault(end) {
                best.settled = best.settled.or(end.price);
            }
            if best.from.as_ref().is_none_or(|(time, ..)| end.price.time > *time) {
                best.from = Some((end.price.time, from.to_vec(), row));
            }
        }
    }

    /// Searches from every instance separately. `is_wide`: numbers with many values are unknown at the start of each reaction.
    fn each(&mut self, is_wide: bool) -> Result<Found, Stopped> {
        let mut best = Best::default();
        let mut met: BTreeSet<Vec<Values>> = BTreeSet::new();
        let mut open: Vec<Vec<Values>> = Vec::new();
        let widened = |it: &Self, mut own: Vec<Values>| {
            for ((values, cell), range) in own.iter_mut().zip(&it.own).zip(&it.ranges) {
                let span = range.hi().saturating_sub(range.lo());
                if values.listed().is_none() || (is_wide && is_number(cell) && span > FEW) {
                    *values = values.or(*range);
                }
            }
            own
        };
        for own in self.first()? {
            let own = widened(self, own);
            if met.insert(own.clone()) {
                open.push(own);
            }
        }
        while let Some(own) = open.pop() {
            for row in 0..self.rows.len() {
                let replaced = self.rows.get(row).cloned().unwrap_or_default();
                let ends = self.run(self.chart.step, &own, &replaced)?;
                self.note(&ends, &own, row, &mut best);
                for end in &ends {
                    let next = widened(self, self.own_of(end));
                    if !met.contains(&next) {
                        met.insert(next.clone());
                        open.push(next);
                    }
                }
            }
            if met.len() > INSTANCES {
                return Err(Stopped::TooMuch);
            }
        }
        self.found(best, Way::Each(met.len()))
    }

    /// Searches from all instances joined.
    fn joined(&mut self) -> Result<Found, Stopped> {
        let join = |all: Vec<Vec<Values>>| {
            all.into_iter().reduce(|a, b| a.iter().zip(&b).map(|(a, b)| a.or(*b)).collect())
        };
        let lost = || Stopped::Lost("a function that does not return".to_owned());
        let mut own = join(self.first()?).ok_or_else(lost)?;
        for round in 0.. {
            let mut best = Best::default();
            let mut all = vec![own.clone()];
            for row in 0..self.rows.len() {
                let replaced = self.rows.get(row).cloned().unwrap_or_default();
                let ends = self.run(self.chart.step, &own, &replaced)?;
                self.note(&ends, &own, row, &mut best);
                all.extend(ends.iter().map(|it| self.own_of(it)));
            }
            let mut next = join(all).ok_or_else(lost)?;
            if next == own {
                return self.found(best, Way::Joined);
            }
            // Cells that still grow after some rounds are widened to their full range.
            if round >= 3 {
                for ((next, own), range) in next.iter_mut().zip(&own).zip(&self.ranges) {
                    if next != own {
                        *next = next.or(*range);
                    }
                }
            }
            own = next;
        }
        Err(Stopped::TooMuch)
    }

    /// The cells that keep states apart in a reaction: the variables of `NAME_step`, and members of the instance that count pending items. With `all`, these
    /// are all members except arrays.
    fn keys(&self, all: bool) -> Vec<usize> {
        let chart = self.chart;
        let first = self.own.len() + self.inputs.len();
        let n = chart.routines.get(chart.step).map_or(0, |it| it.cells);
        let ty = chart.unit.types.get(&*format!("{}_t", chart.prefix));
        let members = ty.and_then(|ty| chart.unit.members(ty)).unwrap_or_default();
        let is_count = |cell: &Cell| {
            let Some(member) = members.get(cell.member) else { return false };
            if all {
                return !matches!(member.ty, Type::Array(..));
            }
            let name = Some(&*member.name);
            chart.contract.counts.iter().any(|it| Some(it.as_str()) == name)
        };
        let counts = self.own.iter().enumerate().filter(|(_, cell)| is_count(cell));
        counts.map(|(at, _)| at).chain(first..first + n).collect()
    }

    fn found(&mut self, best: Best, way: Way) -> Result<Found, Stopped> {
        let mut path = Vec::new();
        if let Some((_, own, row)) = &best.from {
            let row = self.rows.get(*row).cloned().unwrap_or_default();
            // This path was explored before, so the run ends without a limit.
            let left = std::mem::replace(&mut self.work, u64::MAX);
            self.is_traced = true;
            let ends = self.run(self.chart.step, own, &row);
            self.is_traced = false;
            self.work = left;
            let dearest = ends?.into_iter().max_by_key(|it| it.price.time);
            let mut way = dearest.and_then(|it| it.way);
            while let Some(step) = way {
                path.push((step.line, step.time));
                way = step.before.clone();
            }
            path.reverse();
        }
        let settled = (way == Way::Joined && self.fault.is_some()).then_some(best.settled);
        Ok(Found { price: best.price, of_one_event: best.price, settled, path, way })
    }
}

/// The most expensive reaction so far.
#[derive(Default)]
struct Best {
    price: Price,
    settled: Price,
    /// Its time, its initial instance, and the kind of row.
    from: Option<(u64, Vec<Values>, usize)>,
}
