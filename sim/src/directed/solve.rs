//! Finds inputs and ticks that make a receptivity true: the alternating variable method [Korel 1990], one input after another, with growing steps.

use grafsynth_ir::expr::Type;
use grafsynth_ir::net::{Expr, InputId, InputKind, Leaf, TransitionId};

use super::Directed;
use super::distance::{Context, Given};
use crate::row::InputRow;
use crate::rows::Manner;
use crate::stimulus::breaks_assumption;

/// The number of starting points of one search.
const STARTS: usize = 3;
/// The number of rounds over all inputs from each starting point.
const ROUNDS: usize = 3;
/// Inputs with at most this many values are searched completely if no step improves the distance (for a remainder or a product).
const SCANNED: u64 = 1 << 16;
/// The penalty of a violated assumption, larger than any distance.
const UNLAWFUL: u64 = 1 << 40;

/// A value that a search may change.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Knob {
    Input(InputId),
    Dt,
}

impl Directed<'_> {
    /// The row nearest to firing this transition that a short search finds from the current state.
    pub(super) fn solve(&mut self, transition: TransitionId) -> InputRow {
        let knobs = self.knobs(transition);
        let mut best: Option<(u64, InputRow)> = None;
        for start in 0..STARTS {
            let dt = self.dt();
            let manner = if start == 0 { Manner::Held } else { Manner::Noise };
            let mut row = self.rows.any(manner, dt);
            self.only_event(transition, &mut row);
            let mut cost = self.cost(transition, &row);
            for _ in 0..ROUNDS {
                if cost == 0 {
                    return row;
                }
                let before = cost;
                for knob in &knobs {
                    self.turn(transition, *knob, &mut row, &mut cost);
                    if cost == 0 {
                        return row;
                    }
                }
                if cost == before {
                    break;
                }
            }
            if best.as_ref().is_none_or(|(least, _)| cost < *least) {
                best = Some((cost, row));
            }
        }
        let (mut cost, mut row) = match best {
            Some(best) => best,
            None => return self.rows.held(),
        };
        if let Some(knob) = self.rows.random.pick(&knobs).copied()
            && self.rows.random.one_in(4)
        {
            self.scan(transition, knob, &mut row, &mut cost);
        }
        row
    }

    fn cost(&self, transition: TransitionId, row: &InputRow) -> u64 {
        let lack = Context::of(&self.simulator, Given::Row(row)).to_fire(transition);
        lack.saturating_add(if breaks_assumption(self.net, row) { UNLAWFUL } else { 0 })
    }

    /// Sets one of the events that the transition waits for, usually alone, because another one could lead elsewhere.
    fn only_event(&mut self, transition: TransitionId, row: &mut InputRow) {
        let net = self.net;
        let external: Vec<InputId> = net.transitions[transition]
            .events
            .iter()
            .copied()
            .filter(|event| net.inputs[*event].kind == InputKind::Event)
            .collect();
        if !net.settings.events_exclusive && self.rows.random.one_in(4) {
            if let Some(event) = self.rows.random.pick(&external) {
                row.values[event.index()] = 1;
            }
            return;
        }
        for (id, _) in net.inputs.iter().filter(|(_, input)| input.kind == InputKind::Event) {
            row.values[id.index()] = 0;
        }
        if let Some(event) = self.rows.random.pick(&external) {
            row.values[event.index()] = 1;
        }
    }

    /// The inputs that the transition's receptivity reads, including those of its edges and of transitions that `otherwise` refers to; `dt` if it reads a time.
    fn knobs(&mut self, transition: TransitionId) -> Vec<Knob> {
        let net = self.net;
        let mut knobs = Vec::new();
        let mut todo: Vec<&Expr> = vec![&net.transitions[transition].guard];
        let mut seen = vec![transition];
        while let Some(expr) = todo.pop() {
            let mut more: Vec<&Expr> = Vec::new();
            for leaf in expr.leaves() {
                match *leaf {
                    Leaf::Input(input) if net.inputs[input].kind != InputKind::InternalEvent => {
                        knobs.push(Knob::Input(input));
                    }
                    Leaf::Rise(edge) | Leaf::Fall(edge) => more.push(&net.edges[edge].expr),
                    Leaf::Fireable(other) if !seen.contains(&other) => {
                        seen.push(other);
                        more.push(&net.transitions[other].guard);
                    }
                    Leaf::Elapsed(_) | Leaf::LastElapsed(_) | Leaf::Timer(_) => {
                        knobs.push(Knob::Dt)
                    }
                    _ => {}
                }
            }
            todo.extend(more);
        }
        let mut unique: Vec<Knob> = Vec::new();
        for knob in knobs {
            if !unique.contains(&knob) {
                let at = self.rows.random.below(unique.len() + 1);
                unique.insert(at, knob);
            }
        }
        unique
    }

    fn read(row: &InputRow, knob: Knob) -> i64 {
        match knob {
            Knob::Input(input) => row.value(input),
            Knob::Dt => i64::from(row.dt),
        }
    }

    /// Sets a knob if the value is within its range.
    fn set(&self, row: &mut InputRow, knob: Knob, value: i64) -> bool {
        match knob {
            Knob::Input(input) => {
                let (lo, hi) = self.net.inputs[input].ty.bounds();
                if !(lo..=hi).contains(&value) {
                    return false;
                }
                if self.net.settings.events_exclusive
                    && value != 0
                    && self.net.inputs[input].kind.is_event()
                {
                    for (id, other) in self.net.inputs.iter() {
                        if other.kind.is_event() {
                            row.values[id.index()] = 0;
                        }
                    }
                }
                row.values[input.index()] = value;
            }
            Knob::Dt => match u32::try_from(value) {
                Ok(dt) if dt <= self.max_dt => row.dt = dt,
                Ok(_) | Err(_) => return false,
            },
        }
        true
    }

    /// Keeps the value if it reduces the distance.
    fn attempt(
        &self,
        transition: TransitionId,
        knob: Knob,
        value: i64,
        row: &mut InputRow,
        cost: &mut u64,
    ) -> bool {
        let mut other = row.clone();
        if !self.set(&mut other, knob, value) {
            return false;
        }
        let there = self.cost(transition, &other);
        let is_nearer = there < *cost;
        if is_nearer {
            *row = other;
            *cost = there;
        }
        is_nearer
    }

    /// Finds the best value of one knob while the others are fixed.
    fn turn(&mut self, transition: TransitionId, knob: Knob, row: &mut InputRow, cost: &mut u64) {
        let values = match knob {
            Knob::Input(input) => match self.net.inputs[input].ty {
                Type::Bool => vec![1 - row.value(input)],
                ty @ Type::Int { lo, hi } => {
                    let mut values = vec![lo, hi, ty.saturate(0)];
                    values.extend(&self.rows.interesting[input.index()]);
                    values
                }
            },
            Knob::Dt => {
                let ahead = self.thresholds.ahead(&self.simulator, self.max_dt);
                ahead.into_iter().map(i64::from).chain([0, 1]).collect()
            }
        };
        for value in values {
            self.attempt(transition, knob, value, row, cost);
            if *cost == 0 {
                return;
            }
        }
        // Step sizes double while the distance decreases.
        let mut is_moving = true;
        while is_moving && *cost != 0 {
            is_moving = false;
            for sign in [1, -1] {
                let mut stride = sign;
                loop {
                    let value = Self::read(row, knob).saturating_add(stride);
                    if !self.attempt(transition, knob, value, row, cost) {
                        break;
                    }
                    is_moving = true;
                    stride = stride.saturating_mul(2);
                }
            }
        }
    }

    /// Tries all values of a knob, if they are not too many.
    fn scan(&self, transition: TransitionId, knob: Knob, row: &mut InputRow, cost: &mut u64) {
        let Knob::Input(input) = knob else { return };
        let (lo, hi) = self.net.inputs[input].ty.bounds();
        if hi.abs_diff(lo) >= SCANNED {
            return;
        }
        for value in lo..=hi {
            self.attempt(transition, knob, value, row, cost);
            if *cost == 0 {
                return;
            }
        }
    }
}
