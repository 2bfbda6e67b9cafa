//! Random rows of a stimulus: how the inputs of a row are derived from the previous row.

use std::collections::BTreeSet;

use grafsynth_ir::expr::{Expr, ExprKind, Type};
use grafsynth_ir::net::{InputId, InputKind, Leaf, Net};

use crate::Random;
use crate::row::{InputRow, has_column};

/// How the rows of a stretch are generated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Manner {
    /// Every input is new in each row.
    Noise,
    /// Most rows equal the previous one; occasionally one input changes.
    Held,
    /// Mostly 0, with occasional pulses.
    Pulses,
}

/// Generates rows.
pub(crate) struct Rows<'n> {
    pub(crate) net: &'n Net,
    pub(crate) random: Random,
    /// Inputs and external events.
    pub(crate) given: Vec<InputId>,
    /// For each input, values around the constants in its comparisons.
    pub(crate) interesting: Vec<Vec<i64>>,
    pub(crate) last: InputRow,
}

impl<'n> Rows<'n> {
    pub(crate) fn new(net: &'n Net, seed: u64) -> Self {
        let mut interesting: Vec<BTreeSet<i64>> = vec![BTreeSet::new(); net.inputs.len()];
        for expr in net.expressions() {
            collect(expr, &mut interesting);
        }
        let clip = |(id, values): (usize, BTreeSet<i64>)| {
            let (lo, hi) = net.inputs[InputId::from_index(id)].ty.bounds();
            values.into_iter().filter(|value| (lo..=hi).contains(value)).collect()
        };
        Rows {
            net,
            random: Random::new(seed),
            given: net
                .inputs
                .iter()
                .filter(|(_, input)| has_column(input.kind))
                .map(|(id, _)| id)
                .collect(),
            interesting: interesting.into_iter().enumerate().map(clip).collect(),
            last: InputRow::zero(net),
        }
    }

    /// A row generated in this manner; it satisfies `events exclusive`, but assumptions only by chance.
    pub(crate) fn any(&mut self, manner: Manner, dt: u32) -> InputRow {
        let mut row = InputRow { dt, values: self.last.values.clone() };
        match manner {
            Manner::Noise => {
                for at in 0..self.given.len() {
                    row.values[self.given[at].index()] = self.any_value(self.given[at], 2);
                }
            }
            Manner::Held => {
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

    /// The last row again, without events.
    pub(crate) fn held(&self) -> InputRow {
        let mut row = self.last.clone();
        for input in &self.given {
            if self.net.inputs[*input].kind == InputKind::Event {
                row.values[input.index()] = 0;
            }
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

    /// A random value of an input; a Boolean is 1 with probability 1/`rarity`.
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
}

/// Collects, for each input, the values at and around the constants that it is compared with.
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
    expr.children().for_each(|operand| collect(operand, interesting));
}
