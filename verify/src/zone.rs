//! Sets of times: all possible times of a number of clocks that run in parallel. They are described by bounds on each clock and on the difference of each pair
//! (difference bound matrices; Dill 1989, Bengtsson and Yi 2004). Times are whole numbers here, and each operation is exact for them.

/// The value for "no bound". Sums of two bounds do not overflow.
const NONE: i64 = i64::MAX / 4;

/// A set of points with a coordinate of at least 0 for each clock. It is never empty, and its bounds are as tight as possible.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct Zone {
    /// The number of clocks plus one: the first entry is the constant 0.
    size: usize,
    /// The entry of row i and column j is the maximum of clock i minus clock j.
    bounds: Vec<i64>,
}

fn sum(a: i64, b: i64) -> i64 {
    if a >= NONE || b >= NONE { NONE } else { a + b }
}

impl Zone {
    /// The zone of a single point.
    pub(crate) fn point(times: &[i64]) -> Zone {
        let at = |clock: usize| if clock == 0 { 0 } else { times[clock - 1] };
        let size = times.len() + 1;
        let bounds = (0..size * size).map(|cell| at(cell / size) - at(cell % size)).collect();
        Zone { size, bounds }
    }

    fn get(&self, a: usize, b: usize) -> i64 {
        self.bounds[a * self.size + b]
    }

    fn put(&mut self, a: usize, b: usize, bound: i64) {
        self.bounds[a * self.size + b] = bound;
    }

    /// The number of clocks.
    pub(crate) fn len(&self) -> usize {
        self.size - 1
    }

    /// The earliest time of a clock.
    pub(crate) fn least(&self, clock: usize) -> i64 {
        -self.get(0, clock + 1)
    }

    /// The latest time of a clock; `None` if there is no bound.
    pub(crate) fn most(&self, clock: usize) -> Option<i64> {
        let bound = self.get(clock + 1, 0);
        (bound < NONE).then_some(bound)
    }

    /// The point at which each clock has its earliest time. It exists, because the coordinate-wise minimum of two points satisfies all difference
    /// bounds.
    pub(crate) fn first(&self) -> Vec<i64> {
        (0..self.len()).map(|clock| self.least(clock)).collect()
    }

    /// The points that can be reached when any time passes.
    pub(crate) fn later(&self) -> Zone {
        let mut zone = self.clone();
        for clock in 1..self.size {
            zone.put(clock, 0, NONE);
        }
        zone
    }

    /// The points from which the passing of some time leads to a point of this zone.
    pub(crate) fn earlier(&self) -> Zone {
        let mut zone = self.clone();
        for clock in 1..self.size {
            let least = (1..self.size).map(|other| self.get(other, clock)).min().unwrap_or(0);
            zone.put(0, clock, least.min(0));
        }
        zone
    }

    /// True if every point of the other zone, which has the same clocks, is in this one.
    pub(crate) fn includes(&self, other: &Zone) -> bool {
        self.bounds.iter().zip(&other.bounds).all(|(mine, theirs)| theirs <= mine)
    }

    /// The points at which a clock is in `least..=most`; `most` is `None` if there is no bound.
    pub(crate) fn within(mut self, clock: usize, least: i64, most: Option<i64>) -> Option<Zone> {
        let clock = clock + 1;
        let is_not_empty =
            self.tighten(0, clock, -least) && most.is_none_or(|most| self.tighten(clock, 0, most));
        is_not_empty.then_some(self)
    }

    /// The points at which the first clock is ahead of the second by at most `by` (which may be negative).
    pub(crate) fn ahead_at_most(mut self, first: usize, second: usize, by: i64) -> Option<Zone> {
        self.tighten(first + 1, second + 1, by).then_some(self)
    }

    /// Tightens one bound and all bounds that follow from it. Returns false, with meaningless bounds, if the zone becomes empty.
    fn tighten(&mut self, a: usize, b: usize, bound: i64) -> bool {
        if bound >= self.get(a, b) {
            return true;
        }
        if sum(bound, self.get(b, a)) < 0 {
            return false;
        }
        for i in 0..self.size {
            let to_a = sum(self.get(i, a), bound);
            for j in 0..self.size {
                let way = sum(to_a, self.get(b, j));
                if way < self.get(i, j) {
                    self.put(i, j, way);
                }
            }
        }
        true
    }

    /// The zone of other clocks: each new clock has the time of a clock of this zone, or a fixed time.
    pub(crate) fn map(&self, clocks: &[Source]) -> Zone {
        // A fixed time is the time of the constant 0, plus that value.
        let place = |at: usize| match at.checked_sub(1).map(|clock| clocks[clock]) {
            None => (0, 0),
            Some(Source::Kept(clock)) => (clock + 1, 0),
            Some(Source::Started(time)) => (0, time),
        };
        let size = clocks.len() + 1;
        let mut bounds = Vec::with_capacity(size * size);
        for (row, by_row) in (0..size).map(place) {
            for (column, by_column) in (0..size).map(place) {
                let bound = self.get(row, column);
                bounds.push(if bound >= NONE { NONE } else { bound + by_row - by_column });
            }
        }
        Zone { size, bounds }
    }

    /// Forgets by how much each clock exceeds its last threshold, beyond which no comparison distinguishes times; so there are finitely many zones.
    /// Every added point reacts like one that was in the zone (Behrmann, Bouyer, Larsen and Pelánek 2006, Extra_M).
    pub(crate) fn forget_beyond(&mut self, last: &[i64]) {
        let mut is_changed = false;
        for a in 0..self.size {
            for b in 0..self.size {
                if a == b {
                    continue;
                }
                let bound = self.get(a, b);
                let wider = if a > 0 && bound < NONE && bound >= last[a - 1] {
                    NONE
                } else if b > 0 && bound < -last[b - 1] {
                    -last[b - 1]
                } else {
                    continue;
                };
                self.put(a, b, wider);
                is_changed = true;
            }
        }
        if is_changed {
            self.close();
        }
    }

    fn close(&mut self) {
        for k in 0..self.size {
            for i in 0..self.size {
                for j in 0..self.size {
                    let way = sum(self.get(i, k), self.get(k, j));
                    if way < self.get(i, j) {
                        self.put(i, j, way);
                    }
                }
            }
        }
    }
}

/// The source of the time of a clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Source {
    /// A clock of the previous zone, by its index there.
    Kept(usize),
    /// A clock that starts with this time.
    Started(i64),
}
