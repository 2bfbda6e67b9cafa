//! The time of parts that run on their own: lines that deliver changes late, and the clocks of the chips (semantics §10.7).

use grafsynth_sim::Random;
use grafsynth_split::link::End;
use std::collections::BTreeMap;

/// Clocks are up to this power of 2 slower than the shortest time that the CPU needs for an access of a pin.
const SLOWEST_CLOCK: usize = 8;
/// Accesses of pins take up to this power of 2 of the shortest time.
const SLOWEST_ACCESS: usize = 6;
/// Changes are under way for at most this power of 2 of the shortest time.
const LATEST: usize = 10;

/// What happens next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Next {
    /// A change arrives at a pin.
    Arrival(End, Option<bool>),
    /// The clock of a chip has an edge.
    Edge(usize),
}

/// The changes under way and the clocks.
#[derive(Debug)]
pub(super) struct Lines {
    random: Random,
    now: u64,
    /// The time of an access of a pin by the CPU.
    access: u64,
    /// The longest delay of a change.
    latest: u64,
    /// The changes under way, by their arrival and the order in which they started.
    under_way: BTreeMap<(u64, u64), (End, Option<bool>)>,
    started: u64,
    /// The last arrival at each pin: no line changes the order of its own changes.
    last: BTreeMap<End, u64>,
    clocks: Vec<Clock>,
}

#[derive(Debug, Clone, Copy)]
struct Clock {
    period: u64,
    next: u64,
    /// True if no edge changes anything until a pin of the chip changes.
    is_idle: bool,
}

impl Lines {
    /// No change is under way, and all chips have just started.
    pub(super) fn new(seed: u64, n_chips: usize) -> Self {
        let clock = Clock { period: 1, next: 1, is_idle: false };
        let mut lines = Lines {
            random: Random::new(seed),
            now: 0,
            access: 1,
            latest: 1,
            under_way: BTreeMap::new(),
            started: 0,
            last: BTreeMap::new(),
            clocks: vec![clock; n_chips],
        };
        lines.change_speeds();
        lines
    }

    /// Other speeds and delays from now on.
    pub(super) fn change_speeds(&mut self) {
        let random = &mut self.random;
        let mut up_to = |most: usize| {
            let power = random.below(most + 1);
            1 + random.below(1 << power) as u64
        };
        self.access = up_to(SLOWEST_ACCESS);
        self.latest = up_to(LATEST);
        for clock in &mut self.clocks {
            clock.period = up_to(SLOWEST_CLOCK);
            clock.next = self.now + up_to(SLOWEST_CLOCK).min(clock.period);
        }
    }

    /// The present time.
    pub(super) fn now(&self) -> u64 {
        self.now
    }

    /// The time of an access of a pin by the CPU.
    pub(super) fn access(&self) -> u64 {
        self.access
    }

    /// A random time until a change arrives.
    pub(super) fn delay(&mut self) -> u64 {
        self.random.below(usize::try_from(self.latest).unwrap_or(usize::MAX)) as u64
    }

    /// A change starts on the line that leads to a pin.
    pub(super) fn send(&mut self, end: End, level: Option<bool>) {
        let last = self.last.get(&end).copied().unwrap_or(0);
        let arrival = (self.now + self.delay()).max(last);
        self.last.insert(end, arrival);
        self.started += 1;
        self.under_way.insert((arrival, self.started), (end, level));
    }

    /// True if no change is under way and no clock edge changes anything.
    pub(super) fn are_at_rest(&self) -> bool {
        self.under_way.is_empty() && self.clocks.iter().all(|clock| clock.is_idle)
    }

    /// The next event, if it comes by this time; it is then in the past. Without one, it is this time. Events of the same moment come in a random order.
    pub(super) fn pass(&mut self, until: u64) -> Option<Next> {
        let arrival = self.under_way.first_key_value().map(|(key, _)| *key);
        let edges = self.clocks.iter().enumerate().filter(|(_, clock)| !clock.is_idle);
        let edge = edges.map(|(at, clock)| (clock.next, at)).min();
        let is_arrival = match (arrival, edge) {
            (Some((one, _)), Some((other, _))) if one == other => self.random.one_in(2),
            (Some((one, _)), Some((other, _))) => one < other,
            (one, _) => one.is_some(),
        };
        let due = |time: u64| time <= until;
        if let Some(key) = arrival.filter(|(time, _)| is_arrival && due(*time)) {
            self.now = self.now.max(key.0);
            let (end, level) = self.under_way.remove(&key)?;
            if let Some(clock) = self.clocks.get_mut(end.part) {
                wake(clock, self.now);
            }
            return Some(Next::Arrival(end, level));
        }
        if let Some((time, at)) = edge.filter(|(time, _)| !is_arrival && due(*time)) {
            self.now = self.now.max(time);
            self.clocks[at].next += self.clocks[at].period;
            return Some(Next::Edge(at));
        }
        self.now = self.now.max(until);
        None
    }

    /// The last edge of a chip changed nothing, so the next ones will not, until one of its pins changes.
    pub(super) fn is_idle(&mut self, chip: usize) {
        if let Some(clock) = self.clocks.get_mut(chip) {
            clock.is_idle = true;
        }
    }
}

/// Edges matter again: those that nobody looked at are over.
fn wake(clock: &mut Clock, now: u64) {
    if clock.is_idle && clock.next < now {
        clock.next += (now - clock.next).div_ceil(clock.period) * clock.period;
    }
    clock.is_idle = false;
}
