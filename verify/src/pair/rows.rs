//! The input rows that two nets get together: values that are relevant for either, and only rows that satisfy the assumptions of both.

use grafsynth_ir::Valid;
use grafsynth_ir::net::{InputId, Net, PropertyRole};
use grafsynth_sim::{InputRow, Random, State, breaks_assumption};
use indexmap::IndexMap;

use super::common::{Common, Side};
use crate::alphabet::cuts;
use crate::exclusive::net_expr;
use crate::relevance::{Inputs, Relevance};
use crate::verdict::OpenReason;

/// The number of attempts to find a row that satisfies the assumptions.
const MAX_TRIES: usize = 64;

/// One reaction of both nets.
pub(crate) type RowPair = (InputRow, InputRow);

/// A set of [`Common::inputs`], one flag per input.
type Set = Vec<bool>;

/// The input rows of two nets.
pub(crate) struct Rows<'p, 'n> {
    left: &'n Valid<Net>,
    right: &'n Valid<Net>,
    common: &'p Common,
    relevance: (Relevance<'n>, Relevance<'n>),
    /// The relevant values of each input; `None` for an input that has too many.
    values: Vec<Option<Vec<i64>>>,
    /// For each assumption of either net, the inputs that the assumption reads.
    assumed: Vec<Set>,
    /// A row that satisfies all assumptions; `None` if none was found.
    base: Option<Vec<i64>>,
    limit: u64,
    cache: IndexMap<Set, Vec<RowPair>>,
}

impl<'p, 'n> Rows<'p, 'n> {
    /// Makes at most `limit` rows for one pair of states.
    pub(crate) fn of(
        left: &'n Valid<Net>,
        right: &'n Valid<Net>,
        common: &'p Common,
        limit: u64,
    ) -> Self {
        let cuts_of = |net: &Net, id: Option<InputId>, (lo, hi): (i64, i64)| match id {
            Some(id) => cuts(net, id, lo, hi),
            None => Some(Vec::new()),
        };
        let values = common.inputs.iter().map(|input| {
            let (lo, hi) = input.bounds;
            let sides =
                (cuts_of(left, input.left, (lo, hi)), cuts_of(right, input.right, (lo, hi)));
            match sides {
                (Some(mut cuts), Some(more)) if hi.abs_diff(lo) > 1 => {
                    cuts.extend(more);
                    cuts.sort_unstable();
                    cuts.dedup();
                    Some(cuts)
                }
                _ => (hi.abs_diff(lo) < limit.min(4096)).then(|| (lo..=hi).collect()),
            }
        });
        let values = values.collect();
        let mut rows = Rows {
            left,
            right,
            common,
            relevance: (Relevance::of(left), Relevance::of(right)),
            values,
            assumed: Vec::new(),
            base: None,
            limit,
            cache: IndexMap::new(),
        };
        rows.assumed = assumed(left, Side::Left, common);
        rows.assumed.extend(assumed(right, Side::Right, common));
        rows.base = rows.find_base();
        rows
    }

    /// True for a row that is not legal in one of the nets.
    pub(crate) fn excludes(&self, (left, right): &RowPair) -> bool {
        let breaks = |net: &Net, row: &InputRow| {
            let n_events = || {
                let events = net.inputs.iter().filter(|(_, input)| input.kind.is_event());
                events.filter(|(id, _)| row.value(*id) != 0).count()
            };
            net.settings.events_exclusive && n_events() > 1 || breaks_assumption(net, row)
        };
        breaks(self.left, left) || breaks(self.right, right)
    }

    fn pair(&self, dt: u32, values: &[i64]) -> RowPair {
        self.common.rows(self.left, self.right, dt, values)
    }

    /// A row of zeros if it is legal, otherwise the first legal row over the inputs of assumptions.
    fn find_base(&self) -> Option<Vec<i64>> {
        let zero: Vec<i64> = self
            .common
            .inputs
            .iter()
            .map(|input| 0.clamp(input.bounds.0, input.bounds.1))
            .collect();
        if !self.excludes(&self.pair(1, &zero)) {
            return Some(zero);
        }
        let mut tied = vec![false; zero.len()];
        for set in &self.assumed {
            tied.iter_mut().zip(set).for_each(|(tied, is_in)| *tied |= is_in);
        }
        let mut found = None;
        self.for_each(&zero, &tied, self.limit.saturating_mul(16), &mut |values| {
            if found.is_none() && !self.excludes(&self.pair(1, values)) {
                found = Some(values.to_vec());
            }
        });
        found
    }

    /// Calls `visit` with every combination of values for the inputs of the set. Returns false if there are more than `limit`, or if an input has too many
    /// values.
    fn for_each(
        &self,
        base: &[i64],
        set: &Set,
        limit: u64,
        visit: &mut impl FnMut(&[i64]),
    ) -> bool {
        let mut chosen = Vec::new();
        let mut count: u64 = 1;
        for (at, _) in set.iter().enumerate().filter(|(_, is_in)| **is_in) {
            let Some(values) = &self.values[at] else { return false };
            count = count.saturating_mul(values.len() as u64);
            chosen.push((at, values));
        }
        if count > limit {
            return false;
        }
        let mut row = base.to_vec();
        let mut digits = vec![0; chosen.len()];
        chosen.iter().for_each(|(at, values)| row[*at] = values[0]);
        loop {
            visit(&row);
            let Some(next) = (0..chosen.len()).find(|at| digits[*at] + 1 < chosen[*at].1.len())
            else {
                return true;
            };
            for lower in 0..next {
                digits[lower] = 0;
                row[chosen[lower].0] = chosen[lower].1[0];
            }
            digits[next] += 1;
            row[chosen[next].0] = chosen[next].1[digits[next]];
        }
    }

    /// The largest relevant `dt` in this pair of states; `None` if no time is running.
    pub(crate) fn largest_dt(&self, left: &State, right: &State) -> Option<u32> {
        let ours = self.relevance.0.largest_dt(left.situation());
        ours.max(self.relevance.1.largest_dt(right.situation()))
    }

    /// All relevant rows with dt 1 in this pair of states; irrelevant inputs have one value.
    pub(crate) fn of_states(
        &mut self,
        left: &State,
        right: &State,
    ) -> Result<&[RowPair], OpenReason> {
        let ours = self.relevance.0.inputs(left.situation());
        let theirs = self.relevance.1.inputs(right.situation());
        let reads = |inputs: &Inputs, id: Option<InputId>| id.is_some_and(|id| inputs.contains(id));
        let mut set: Set = self
            .common
            .inputs
            .iter()
            .map(|input| reads(&ours, input.left) || reads(&theirs, input.right))
            .collect();
        self.close(&mut set);
        if !self.cache.contains_key(&set) {
            let rows = self.make(&set)?;
            self.cache.insert(set.clone(), rows);
        }
        Ok(self.cache.get(&set).map_or(&[], Vec::as_slice))
    }

    /// Adds all inputs that assumptions connect with the set.
    fn close(&self, set: &mut Set) {
        loop {
            let before = set.clone();
            for tied in &self.assumed {
                if tied.iter().zip(&before).any(|(a, b)| *a && *b) {
                    set.iter_mut().zip(tied).for_each(|(is_in, tied)| *is_in |= tied);
                }
            }
            if *set == before {
                return;
            }
        }
    }

    fn make(&self, set: &Set) -> Result<Vec<RowPair>, OpenReason> {
        // No stimulus is legal in both: only the reset exists.
        let Some(base) = &self.base else { return Ok(Vec::new()) };
        if let Some(at) = (0..set.len()).find(|at| set[*at] && self.values[*at].is_none()) {
            let (lo, hi) = self.common.inputs[at].bounds;
            return Err(OpenReason::InputValues {
                input: self.common.inputs[at].name.clone(),
                values: hi.abs_diff(lo).saturating_add(1),
            });
        }
        let mut rows = Vec::new();
        let is_whole = self.for_each(base, set, self.limit, &mut |values| {
            let pair = self.pair(1, values);
            if !self.excludes(&pair) {
                rows.push(pair);
            }
        });
        if is_whole { Ok(rows) } else { Err(OpenReason::Rows { limit: self.limit }) }
    }

    /// Random values of [`Common::inputs`], similar to the last ones or new; `None` if no row was found that both nets allow.
    pub(crate) fn by_chance(&self, random: &mut Random, last: &[i64]) -> Option<Vec<i64>> {
        for _ in 0..MAX_TRIES {
            let is_held = random.one_in(2);
            let mut values = last.to_vec();
            for ((value, input), known) in
                values.iter_mut().zip(&self.common.inputs).zip(&self.values)
            {
                if is_held && !random.one_in(4) {
                    continue;
                }
                *value = match known {
                    Some(known) if random.below(4) > 0 => {
                        random.pick(known).copied().unwrap_or(*value)
                    }
                    _ => random.between(input.bounds.0, input.bounds.1),
                };
            }
            if !self.excludes(&self.pair(1, &values)) {
                return Some(values);
            }
        }
        self.base.clone()
    }
}

/// For each assumption of a net, the inputs that it reads; exclusive events form one assumption.
fn assumed(net: &Net, side: Side, common: &Common) -> Vec<Set> {
    let place = |id: InputId| {
        common.inputs.iter().position(|input| match side {
            Side::Left => input.left == Some(id),
            Side::Right => input.right == Some(id),
        })
    };
    let mut sets = Vec::new();
    for property in net.properties.iter().filter(|one| one.role == PropertyRole::Assume) {
        let mut set = vec![false; common.inputs.len()];
        match net_expr(&property.never) {
            Some(never) => {
                let read = never.leaves().filter_map(grafsynth_ir::net::Leaf::input);
                read.filter_map(place).for_each(|at| set[at] = true);
            }
            None => set.fill(true),
        }
        sets.push(set);
    }
    sets
}
