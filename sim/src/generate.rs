//! Random stimuli that make charts move.

use std::collections::BTreeSet;

use grafsynth_ir::expr::{Expr, ExprKind, Type};
use grafsynth_ir::net::{InputId, InputKind, Leaf, Net};

use crate::constants;
use crate::random::Random;
use crate::row::InputRow;
use crate::simulator::Simulator;
use crate::stimulus::{MAX_DT, Stimulus, breaks_assumption};

/// How the rows of a stretch are made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Manner {
    /// Every input anew in each row.
    Noise,
    /// Most rows as the one before; now and then one input changes.
    Held,
    /// Mostly 0, now and then a pulse.
    Pulses,
    /// Of a few candidates the one that fires what has fired least so far.
    Seeking,
}

/// Tries for one row to keep the assumptions of the chart.
const MAX_TRIES: usize = 64;
/// Candidates that a seeking row is picked from.
const CANDIDATES: usize = 6;

impl Stimulus {
    /// Random rows for the net, the same for the same seed: stretches of noise, of held inputs, of pulses, and of rows chosen to fire what has not
    /// fired yet. `dt` lies in `0..=max_dt`. Rows keep what the chart assumes and `events exclusive`; where no such row is found in 64 tries, the
    /// last one is held with its events gone (and if even that breaks an assumption, [`breaks_assumption`] says so).
    #[must_use]
    pub fn random(net: &Net, rows: usize, seed: u64, max_dt: u32) -> Stimulus {
        let mut generator = Generator::new(net, seed, max_dt.min(MAX_DT));
        let mut stimulus = Stimulus::new(net);
        let mut left_in_stretch = 0;
        let mut manner = Manner::Noise;
        for _ in 0..rows {
            if left_in_stretch == 0 {
                left_in_stretch = 4 + generator.random.below(60);
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
    net: &'n Net,
    random: Random,
    max_dt: u32,
    /// Inputs and external events.
    given: Vec<InputId>,
    /// By input: values around the constants that it is compared with.
    interesting: Vec<Vec<i64>>,
    /// Ticks around the constants that timers are compared with.
    spans: Vec<u32>,
    last: InputRow,
    simulator: Simulator<'n>,
    times_fired: Vec<u32>,
}

impl<'n> Generator<'n> {
    fn new(net: &'n Net, seed: u64, max_dt: u32) -> Self {
        let mut interesting: Vec<BTreeSet<i64>> = vec![BTreeSet::new(); net.inputs.len()];
        grafsynth_ir::walk::for_each_expr(net, &mut |expr| collect(expr, &mut interesting));
        let clip = |(id, values): (usize, BTreeSet<i64>)| {
            let (lo, hi) = net.inputs[InputId::from_index(id)].ty.bounds();
            values.into_iter().filter(|value| (lo..=hi).contains(value)).collect()
        };
        let spans: BTreeSet<u32> = constants::timer_caps(net)
            .into_values()
            .flat_map(|cap| [cap - 2, cap - 1, cap])
            .filter_map(|ticks| u32::try_from(ticks).ok())
            .filter(|ticks| (1..=max_dt).contains(ticks))
            .collect();
        Generator {
            net,
            random: Random::new(seed),
            max_dt,
            given: net
                .inputs
                .iter()
                .filter(|(_, input)| input.kind != InputKind::InternalEvent)
                .map(|(id, _)| id)
                .collect(),
            interesting: interesting.into_iter().enumerate().map(clip).collect(),
            spans: spans.into_iter().collect(),
            last: InputRow::zero(net),
            simulator: Simulator::of_net(net),
            times_fired: vec![0; net.transitions.len()],
        }
    }

    fn manner(&mut self) -> Manner {
        let manners =
            [Manner::Noise, Manner::Held, Manner::Pulses, Manner::Seeking, Manner::Seeking];
        manners[self.random.below(manners.len())]
    }

    fn row(&mut self, manner: Manner) -> InputRow {
        let row = if manner == Manner::Seeking {
            self.seek()
        } else {
            let row = self.lawful_row(manner);
            self.simulator.step(&row);
            row
        };
        for transition in self.simulator.fired() {
            self.times_fired[transition.index()] =
                self.times_fired[transition.index()].saturating_add(1);
        }
        self.last = row.clone();
        row
    }

    /// Tries a few rows from the present state and takes the one that fires the transition that has fired least.
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
        let row = best.map_or_else(|| InputRow::zero(self.net), |(_, row)| row);
        self.simulator.set_state(&start);
        self.simulator.step(&row);
        row
    }

    /// A row that keeps the assumptions, if one is found.
    fn lawful_row(&mut self, manner: Manner) -> InputRow {
        for _ in 0..MAX_TRIES {
            let row = self.any_row(manner);
            if !breaks_assumption(self.net, &row) {
                return row;
            }
        }
        let mut row = self.last.clone();
        for input in &self.given {
            if self.net.inputs[*input].kind == InputKind::Event {
                row.values[input.index()] = 0;
            }
        }
        row
    }

    fn any_row(&mut self, manner: Manner) -> InputRow {
        let mut row = InputRow { dt: self.dt(), values: self.last.values.clone() };
        match manner {
            Manner::Noise => {
                for at in 0..self.given.len() {
                    row.values[self.given[at].index()] = self.any_value(self.given[at], 2);
                }
            }
            Manner::Held | Manner::Seeking => {
                for at in 0..self.given.len() {
                    let input = self.given[at];
                    if self.net.inputs[input].kind == InputKind::Event {
                        row.values[input.index()] = self.any_value(input, 6);
                    }
                }
                let n_changes = [0, 1, 1, 1, 2, 3][self.random.below(6)];
                for _ in 0..n_changes {
                    if let Some(input) = self.random.pick(&self.given).copied() {
                        row.values[input.index()] = match self.net.inputs[input].ty {
                            Type::Bool => 1 - row.values[input.index()],
                            Type::Int { .. } => self.any_value(input, 2),
                        };
                    }
                }
            }
            Manner::Pulses => {
                for at in 0..self.given.len() {
                    row.values[self.given[at].index()] = self.any_value(self.given[at], 5);
                }
            }
        }
        if self.net.settings.events_exclusive {
            self.keep_one_event(&mut row);
        }
        row
    }

    fn keep_one_event(&mut self, row: &mut InputRow) {
        let events: Vec<InputId> = self
            .given
            .iter()
            .copied()
            .filter(|input| {
                self.net.inputs[*input].kind == InputKind::Event && row.value(*input) != 0
            })
            .collect();
        let kept = self.random.pick(&events).copied();
        for event in events {
            row.values[event.index()] = i64::from(Some(event) == kept);
        }
    }

    /// A Boolean is 1 once in `rarity` times.
    fn any_value(&mut self, input: InputId, rarity: usize) -> i64 {
        match self.net.inputs[input].ty {
            Type::Bool => i64::from(self.random.one_in(rarity)),
            ty @ Type::Int { lo, hi } => match self.random.below(8) {
                0 => lo,
                1 => hi,
                2 => ty.saturate(0),
                3..=5 if !self.interesting[input.index()].is_empty() => {
                    let values = &self.interesting[input.index()];
                    values[self.random.below(values.len())]
                }
                _ => self.random.between(lo, hi),
            },
        }
    }

    fn dt(&mut self) -> u32 {
        if self.max_dt == 0 {
            return 0;
        }
        match self.random.below(16) {
            0 | 1 => 0,
            2 | 3 => self.random.below(self.max_dt as usize + 1) as u32,
            4 | 5 if !self.spans.is_empty() => self.spans[self.random.below(self.spans.len())],
            _ => 1,
        }
    }
}

/// Values at and around the constants that inputs are compared with.
fn collect(expr: &Expr<Leaf>, interesting: &mut [BTreeSet<i64>]) {
    if let ExprKind::Compare(_, a, b) = &expr.kind {
        for (input, constant) in [(a, b), (b, a)] {
            if let (ExprKind::Leaf(Leaf::Input(input)), ExprKind::Int(value)) =
                (&input.kind, &constant.kind)
            {
                interesting[input.index()].extend([
                    value.saturating_sub(1),
                    *value,
                    value.saturating_add(1),
                ]);
            }
        }
    }
    expr.operands().for_each(|operand| collect(operand, interesting));
}
