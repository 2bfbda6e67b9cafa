//! Random stimuli that exercise charts.

use grafsynth_ir::Gather;
use std::collections::BTreeSet;

use grafsynth_ir::net::Net;

use crate::constants;
use crate::row::InputRow;
use crate::rows::{Manner, Rows};
use crate::simulator::Simulator;
use crate::stimulus::{MAX_DT, Stimulus, breaks_assumption};

/// The number of attempts to find a row that satisfies the chart's assumptions.
pub(crate) const MAX_TRIES: usize = 64;
/// The number of candidates from which `seek` chooses a row.
const CANDIDATES: usize = 6;

impl Stimulus {
    /// Random rows for the net, the same for the same seed: stretches of noise, of held inputs, of pulses, and of rows chosen to fire transitions that
    /// have not fired yet. `dt` is in `0..=max_dt`. Rows satisfy the chart's assumptions and `events exclusive`; if no such row is found in 64 attempts,
    /// the last row is repeated without its events (and if even that violates an assumption, [`breaks_assumption`] reports it).
    ///
    /// It is one run from reset. For comparisons that do not need a single run, use [`Directed`](crate::Directed), which restarts often and aims at
    /// transitions that have not fired.
    #[must_use]
    pub fn random(net: &Net, rows: usize, seed: u64, max_dt: u32) -> Stimulus {
        let mut generator = Generator::new(net, seed, max_dt.min(MAX_DT));
        let mut stimulus = Stimulus::new(net);
        let mut left_in_stretch = 0;
        let mut manner = Some(Manner::Noise);
        for _ in 0..rows {
            if left_in_stretch == 0 {
                left_in_stretch = 4 + generator.rows.random.below(60);
                manner = generator.manner();
            }
            left_in_stretch -= 1;
            let row = generator.row(manner);
            stimulus.push(&row);
        }
        stimulus
    }
}

struct Generator<'n> {
    rows: Rows<'n>,
    max_dt: u32,
    /// Ticks around the constants that timers are compared with.
    spans: Vec<u32>,
    simulator: Simulator<'n>,
    times_fired: Vec<u32>,
}

impl<'n> Generator<'n> {
    fn new(net: &'n Net, seed: u64, max_dt: u32) -> Self {
        let spans: BTreeSet<u32> = constants::timer_caps(net)
            .into_values()
            .flat_map(|cap| [cap - 2, cap - 1, cap])
            .filter_map(|ticks| u32::try_from(ticks).ok())
            .filter(|ticks| (1..=max_dt).contains(ticks))
            .gather();
        Generator {
            rows: Rows::new(net, seed),
            max_dt,
            spans: spans.into_iter().collect(),
            simulator: Simulator::of_net(net),
            times_fired: vec![0; net.transitions.len()],
        }
    }

    /// Chooses how to generate the next rows; `None`: of a few candidates, the row that fires the transition that has fired least often.
    fn manner(&mut self) -> Option<Manner> {
        let manners = [Some(Manner::Noise), Some(Manner::Held), Some(Manner::Pulses), None, None];
        manners[self.rows.random.below(manners.len())]
    }

    fn row(&mut self, manner: Option<Manner>) -> InputRow {
        let row = match manner {
            None => self.seek(),
            Some(manner) => {
                let row = self.lawful_row(manner);
                self.simulator.step(&row);
                row
            }
        };
        for transition in self.simulator.fired() {
            self.times_fired[transition.index()] =
                self.times_fired[transition.index()].saturating_add(1);
        }
        self.rows.last = row.clone();
        row
    }

    /// Tries a few rows from the current state and selects the one that fires the transition that has fired least often.
    fn seek(&mut self) -> InputRow {
        let start = self.simulator.state().clone();
        let mut best: Option<(u32, InputRow)> = None;
        for candidate in 0..CANDIDATES {
            let manner = if candidate % 2 == 0 { Manner::Held } else { Manner::Noise };
            let row = self.lawful_row(manner);
            self.simulator.set_state(&start);
            self.simulator.step(&row);
            let least = self
                .simulator
                .fired()
                .iter()
                .map(|t| self.times_fired[t.index()])
                .min()
                .unwrap_or(u32::MAX);
            if best.as_ref().is_none_or(|(count, _)| least < *count) {
                best = Some((least, row));
            }
        }
        let row = best.map_or_else(|| InputRow::zero(self.rows.net), |(_, row)| row);
        self.simulator.set_state(&start);
        self.simulator.step(&row);
        row
    }

    /// A row that satisfies the assumptions, if one is found.
    fn lawful_row(&mut self, manner: Manner) -> InputRow {
        for _ in 0..MAX_TRIES {
            let dt = self.dt();
            let row = self.rows.any(manner, dt);
            if !breaks_assumption(self.rows.net, &row) {
                return row;
            }
        }
        self.rows.held()
    }

    fn dt(&mut self) -> u32 {
        if self.max_dt == 0 {
            return 0;
        }
        match self.rows.random.below(16) {
            0 | 1 => 0,
            2 | 3 => self.rows.random.below(self.max_dt as usize + 1) as u32,
            4 | 5 if !self.spans.is_empty() => self.spans[self.rows.random.below(self.spans.len())],
            _ => 1,
        }
    }
}
