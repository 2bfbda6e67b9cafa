//! Loops of rows that add a constant to a variable, for all of its values in a range; and values that never leave the ranges of their variables.

use grafsynth_ir::Valid;
use grafsynth_ir::expr::{ArithOp, CompareOp, Type};
use grafsynth_ir::facts::Facts;
use grafsynth_ir::net::{Evolution, Net, TransitionId, VarId};
use grafsynth_sim::InputRow;

use super::aig::{Aig, Lit};
use super::number::Number;
use super::reaction::{Inputs, Maker};
use super::shared::Shared;
use super::state::{State, Value};
use super::{Model, known_depth, reach};
use crate::limits::Limits;

/// A claim: `way` leads from reset to a state, and `cycle` leads from this state to one that differs only by `stride` in `var`, for each value of `var` that a
/// repetition from `first` to `last` passes.
pub(crate) struct Repeat<'r> {
    pub(crate) way: &'r [InputRow],
    pub(crate) cycle: &'r [InputRow],
    pub(crate) var: VarId,
    pub(crate) stride: i64,
    pub(crate) first: i64,
    pub(crate) last: i64,
}

/// True if the claim is proved; `None` if the net is not covered or a limit is reached.
pub(crate) fn repeats(net: &Valid<Net>, limits: &Limits, claim: &Repeat<'_>) -> Option<bool> {
    super::reaction::refuse_open_cells(net).ok()?;
    let mut maker = Maker::new(net, None, limits.circuit_nodes).ok()?;
    let mut state = maker.reset().ok()?.state;
    for row in claim.way {
        state = maker.reaction(&state, &inputs(net, row)).ok()?.state;
    }
    let Type::Int { lo, .. } = net.vars[claim.var].ty else { return None };
    let bits: Vec<Lit> = (0..net.vars[claim.var].ty.bits()).map(|_| maker.aig.variable()).collect();
    let value = Number::from_code(&mut maker.aig, &bits, lo);
    let slot = state.vars.get_mut(claim.var.index())?.first_mut()?;
    if slot.number().as_constant() != Some(i128::from(claim.first)) {
        return None;
    }
    *slot = Value::Number(value.clone());
    let mut after: State = state.clone();
    for row in claim.cycle {
        after = maker.reaction(&after, &inputs(net, row)).ok()?.state;
    }
    let sum = Number::arith(&mut maker.aig, ArithOp::Add, &value, &Number::constant(claim.stride));
    *state.vars.get_mut(claim.var.index())?.first_mut()? = Value::Number(sum);
    let shape = maker.shape.clone();
    let wanted = shape.bits(net, &mut maker.aig, &state);
    let given = shape.bits(net, &mut maker.aig, &after);
    let aig = &mut maker.aig;
    let mut apart = Vec::new();
    for (key, wanted) in wanted {
        apart.push(aig.xor(wanted, *given.get(&key)?));
    }
    let apart = aig.or_all(apart);
    // The last repetition starts one stride before the end.
    let end = claim.last.checked_sub(claim.stride)?;
    let (least, most) = (claim.first.min(end), claim.first.max(end));
    let in_range = [(CompareOp::Ge, least), (CompareOp::Le, most)]
        .map(|(op, bound)| Number::compare(aig, op, &value, &Number::constant(bound)));
    let all = [apart, in_range[0], in_range[1]];
    let rank =
        |lit: Lit| (0..).zip(bits.iter()).find(|(_, bit)| **bit == lit).map_or(0, |(at, _)| at + 1);
    holds(aig, &all, &rank, limits)
}

/// True if no assignment makes all of these literals true.
fn holds(aig: &Aig, all: &[Lit], rank: &dyn Fn(Lit) -> u32, limits: &Limits) -> Option<bool> {
    Some(aig.settle(all, &[], rank, limits)?.is_none())
}

fn inputs(net: &Net, row: &InputRow) -> Inputs {
    let values = net.inputs.iter().map(|(id, input)| {
        let value = row.values.get(id.index()).copied().unwrap_or(0);
        match input.ty {
            Type::Bool => Value::Flag(Lit::constant(value != 0)),
            Type::Int { .. } => Value::Number(Number::constant(value)),
        }
    });
    let dt = Some(Number::constant(i64::from(row.dt)));
    Inputs { values: values.collect(), tick: Lit::TRUE, dt }
}

/// Proves by induction that no assignment ever computes a value outside the range of its variable, for any `dt`.
pub(crate) fn never_saturates(net: &Valid<Net>, facts: &Facts, limits: &Limits) -> bool {
    let proved = || {
        super::reaction::refuse_open_cells(net).ok()?;
        if net.settings.policy.is_statechart() {
            return None;
        }
        let mut model = Model::of(net, known_depth(facts), limits).ok()?;
        model.maker.out_of_range = Some(Lit::FALSE);
        model.maker.reset().ok()?;
        reach::any_time(&mut model);
        let (state, inputs) = (model.state.clone(), model.inputs.clone());
        model.maker.reaction(&state, &inputs).ok()?;
        let wrong = model.maker.out_of_range?;
        let known = (facts, limits);
        Some(model.difference(&mut Shared::new(), known, wrong, Lit::FALSE)?.is_none())
    };
    proved() == Some(true)
}

/// For each pair of transitions, whether it is proved that they are never fireable in one reaction, for any `dt`: either in no state that satisfies the
/// invariants, or neither after a reaction from such a state nor after reset.
pub(crate) fn never_both(
    net: &Valid<Net>,
    facts: &Facts,
    limits: &Limits,
    pairs: &[(TransitionId, TransitionId)],
) -> Vec<bool> {
    let proved = || -> Option<Vec<bool>> {
        super::reaction::refuse_open_cells(net).ok()?;
        if net.settings.policy.is_statechart() || net.settings.evolution != Evolution::Single {
            return None;
        }
        let mut model = Model::of(net, known_depth(facts), limits).ok()?;
        let time = reach::any_time(&mut model);
        let (state, inputs) = (model.state.clone(), model.inputs.clone());
        let reset = model.maker.reset().ok()?.state;
        let next = model.maker.reaction(&state, &inputs).ok()?.state;
        let now = model.maker.fireable.clone();
        // The reaction after it, and the one after reset, have inputs of their own; leaving these free only weakens the proof.
        let then = another(&mut model, &inputs, time.len());
        model.maker.reaction(&next, &then).ok()?;
        let later = model.maker.fireable.clone();
        model.maker.reaction(&reset, &then).ok()?;
        let first = model.maker.fireable.clone();
        let mut shared = Shared::new();
        let mut is_never = |fireable: &[Lit], (a, b): (TransitionId, TransitionId)| {
            let (a, b) = (fireable.get(a.index())?, fireable.get(b.index())?);
            let both = model.aig().and(*a, *b);
            let known = (facts, limits);
            Some(model.difference(&mut shared, known, both, Lit::FALSE)?.is_none())
        };
        let each = pairs.iter().map(|pair| {
            let mut is_none = |fireable: &[Lit]| is_never(fireable, *pair) == Some(true);
            is_none(&now) || is_none(&later) && is_none(&first)
        });
        Some(each.collect())
    };
    proved().unwrap_or_else(|| vec![false; pairs.len()])
}

/// Free inputs like these, with a time of this many bits.
fn another(model: &mut Model<'_>, inputs: &Inputs, n_time: usize) -> Inputs {
    let net = model.maker.net;
    let aig = model.aig();
    let values = inputs.values.iter().zip(net.inputs.values()).map(|(value, input)| match value {
        Value::Flag(_) => Value::Flag(aig.variable()),
        Value::Number(_) => {
            let bits: Vec<Lit> = (0..input.ty.bits()).map(|_| aig.variable()).collect();
            Value::Number(Number::from_code(aig, &bits, input.ty.bounds().0))
        }
    });
    let values = values.collect();
    let time: Vec<Lit> = (0..n_time).map(|_| aig.variable()).collect();
    let dt = Some(Number::from_code(aig, &time, 0));
    Inputs { values, dt, ..inputs.clone() }
}

impl Maker<'_> {
    pub(super) fn set(&mut self, condition: Lit, number: &mut Number, value: &Number) {
        *number = Number::select(&mut self.aig, condition, value, number);
    }

    /// An assigned value within the range of its variable; notes whether it was out of range.
    pub(super) fn saturate(&mut self, condition: Lit, value: &Number, lo: i64, hi: i64) -> Number {
        let saturated = value.saturate(&mut self.aig, lo, hi);
        if let Some(before) = self.out_of_range {
            let differs = Number::compare(&mut self.aig, CompareOp::Ne, value, &saturated);
            let here = self.aig.and(condition, differs);
            self.out_of_range = Some(self.aig.or(before, here));
        }
        saturated
    }
}
