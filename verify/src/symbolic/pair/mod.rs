//! Two nets in one graph: the functions of both reactions over shared inputs, and the differences of their columns. Any number of ticks may pass.

mod diagram;
mod induction;

use grafsynth_ir::Gather;
use std::collections::BTreeMap;

use grafsynth_ir::Valid;
use grafsynth_ir::expr::{ArithOp, CompareOp};
use grafsynth_ir::facts::Facts;
use grafsynth_ir::net::{Evolution, Net, OutputId};
use grafsynth_sim::ColumnKind;

use super::aig::{Aig, Lit};
use super::calls::{self, Call};
use super::number::Number;
use super::reach::{Failed, initial, legal_inputs, longest_time};
use super::reaction::Reaction;
use super::state::{Key, Shape, Value};
use super::{Model, SharedInput};
use crate::limits::Limits;
use crate::pair::{Common, RowPair, Rows, Side};

pub(crate) use diagram::{Diagram, diagram};
pub(crate) use induction::{Equalities, Induction, induction};

/// The numbers of micro-steps that are unrolled in successive attempts: few at first, because the cost grows with the number.
const DEPTHS: [u32; 3] = [4, 16, 64];

/// A comparison of two nets.
pub(crate) struct Question<'q> {
    pub(crate) left: &'q Valid<Net>,
    pub(crate) right: &'q Valid<Net>,
    pub(crate) common: &'q Common,
    /// The components of each net, from its structure.
    pub(crate) facts: (&'q Facts, &'q Facts),
    pub(crate) limits: &'q Limits,
}

/// A bit of the state of one of the nets.
#[derive(Debug, Clone, Copy)]
struct Bit {
    /// Its variable.
    lit: Lit,
    /// Its value after the reaction.
    next: Lit,
    /// Its value after reset.
    first: bool,
}

/// Both nets in one graph.
pub(crate) struct Joint<'q> {
    question: &'q Question<'q>,
    aig: Aig,
    /// The models; their graphs are merged into `aig`.
    models: [Model<'q>; 2],
    /// Bits of the first net, then of the second.
    bits: Vec<Bit>,
    /// The next functions by name, for the order of variables.
    next: [BTreeMap<Key, Lit>; 2],
    /// The shared inputs, in the order of [`Common::inputs`].
    inputs: Vec<SharedInput>,
    /// The number of ticks that pass, as bits.
    time: Vec<Lit>,
    /// Beyond this many ticks all counters are at their caps.
    longest: i64,
    /// Conditions that every row of inputs satisfies.
    legal: Vec<Lit>,
    /// The condition that a reaction of either net takes more micro-steps than were unrolled.
    overrun: Lit,
    /// For each compared column, whether it differs after the reaction.
    differ: Vec<Lit>,
}

/// The maximum number of micro-steps in a reaction.
fn limit_of(net: &Net) -> u32 {
    match net.settings.evolution {
        Evolution::Single => 1,
        Evolution::Stable { limit } => limit,
    }
}

impl<'q> Joint<'q> {
    /// Builds both nets with `depth` micro-steps per reaction.
    fn of(question: &'q Question<'q>, depth: u32) -> Result<Self, Failed> {
        let Question { left, right, common, limits, .. } = question;
        let nets: [&'q Net; 2] = [left, right];
        for net in nets {
            super::reaction::refuse_open_cells(net)?;
        }
        if nets.iter().any(|net| net.settings.policy.is_statechart()) {
            return Err(Failed::Open(crate::symbolic::reaction::STATECHART.to_owned()));
        }
        // All variables come first, so that they are the same for every depth.
        let mut aig = Aig::new();
        let mut legal = Vec::new();
        let inputs: Vec<SharedInput> = common
            .inputs
            .iter()
            .map(|input| {
                let (lo, hi) = input.bounds;
                let width = 64 - hi.abs_diff(lo).leading_zeros();
                let bits: Vec<Lit> = (0..width).map(|_| aig.variable()).collect();
                if !hi.abs_diff(lo).wrapping_add(1).is_power_of_two() {
                    let number = Number::from_code(&mut aig, &bits, lo);
                    let largest = Number::constant(hi);
                    legal.push(Number::compare(&mut aig, CompareOp::Le, &number, &largest));
                }
                SharedInput { bits, lo }
            })
            .collect();
        let longest = nets.iter().map(|net| longest_time(net, &Shape::of(net))).max().unwrap_or(0);
        let n_time = 64 - longest.leading_zeros();
        let time: Vec<Lit> = (0..n_time).map(|_| aig.variable()).collect();
        let dt = Number::from_code(&mut aig, &time, 0);
        let mut models = Vec::new();
        for (net, side) in nets.into_iter().zip([Side::Left, Side::Right]) {
            let shared = common.inputs.iter().zip(&inputs).filter_map(|(input, shared)| {
                let own = match side {
                    Side::Left => input.left,
                    Side::Right => input.right,
                };
                Some((own?, shared.clone()))
            });
            let own_depth = depth.min(limit_of(net));
            let mut model = Model::within(aig, net, Some(own_depth), limits, &shared.gather())?;
            model.maker.node_limit = limits.circuit_nodes;
            model.inputs.tick = Lit::TRUE;
            model.inputs.dt = Some(dt.clone());
            aig = std::mem::replace(&mut model.maker.aig, Aig::new());
            models.push(model);
        }
        let mut bits = Vec::new();
        let mut reactions = Vec::new();
        let mut next = Vec::new();
        let mut overrun = Lit::FALSE;
        for model in &mut models {
            model.maker.aig = std::mem::replace(&mut aig, Aig::new());
            let first = initial(model)?;
            let (state, inputs) = (model.state.clone(), model.inputs.clone());
            let reaction = model.maker.reaction(&state, &inputs)?;
            let shape = model.maker.shape.clone();
            let after = shape.bits(model.maker.net, model.aig(), &reaction.state);
            bits.extend(after.iter().map(|(key, lit)| Bit {
                lit: model.state_bits[key],
                next: *lit,
                first: first[key],
            }));
            let own_depth = depth.min(limit_of(model.maker.net));
            if own_depth < limit_of(model.maker.net)
                && let Some(more) = model.maker.more.get(own_depth as usize).copied()
            {
                overrun = model.aig().or(overrun, more);
            }
            legal.extend(legal_inputs(model));
            next.push(after);
            reactions.push((reaction, model.maker.called.clone()));
            aig = std::mem::replace(&mut model.maker.aig, Aig::new());
        }
        let differ = differences(&mut aig, question, &reactions)?;
        let (Ok(models), Ok(next)) = (models.try_into(), next.try_into()) else {
            unreachable!("internal error: expected the reactions of two nets");
        };
        Ok(Joint {
            question,
            aig,
            models,
            bits,
            next,
            inputs,
            time,
            longest,
            legal,
            overrun,
            differ,
        })
    }

    /// The rows of both nets for an assignment of the variables; a free variable is 0.
    fn row(&self, is_true: impl Fn(Lit) -> bool) -> RowPair {
        let number = |bits: &[Lit]| {
            bits.iter().rev().fold(0_u64, |code, bit| code << 1 | u64::from(is_true(*bit)))
        };
        let dt = u32::try_from(number(&self.time).min(self.longest.unsigned_abs()));
        let values: Vec<i64> = self
            .inputs
            .iter()
            .map(|input| input.lo.saturating_add_unsigned(number(&input.bits)))
            .collect();
        let Question { left, right, common, .. } = self.question;
        common.rows(left, right, dt.unwrap_or(u32::MAX), &values)
    }
}

/// For each compared column, whether it differs.
fn differences(
    aig: &mut Aig,
    question: &Question<'_>,
    reactions: &[(Reaction, Vec<Call>)],
) -> Result<Vec<Lit>, String> {
    let [left, right] = reactions else {
        return Err("internal error: expected the reactions of two nets".to_owned());
    };
    let Common { columns, layouts, steps, .. } = question.common;
    let mut differ = Vec::new();
    for column in columns {
        let (ours, theirs) =
            (layouts.0.columns[column.left].kind, layouts.1.columns[column.right].kind);
        if ours == ColumnKind::Steps {
            let apart: Vec<Lit> = steps
                .iter()
                .map(|(a, b)| {
                    let (a, b) = (left.0.state.active[a.index()], right.0.state.active[b.index()]);
                    aig.xor(a, b)
                })
                .collect();
            differ.push(aig.or_all(apart));
            continue;
        }
        if let (ColumnKind::Calls(a), ColumnKind::Calls(b)) = (ours, theirs) {
            let [a, b] = [(left, a), (right, b)].map(|((_, calls), output)| {
                let own = calls.iter().filter(|call| call.output == output);
                // The same function may be another output in the other net.
                own.map(|call| Call { output: OutputId::from_index(0), ..call.clone() }).collect()
            });
            let (a, b): (Vec<Call>, Vec<Call>) = (a, b);
            let apart = calls::differ(aig, &a, &b)?;
            differ.push(aig.or_all(apart));
            continue;
        }
        let a = shown(aig, question.left, left, ours);
        let b = shown(aig, question.right, right, theirs);
        differ.push(Number::compare(aig, CompareOp::Ne, &a, &b));
    }
    Ok(differ)
}

/// The number in a column after a reaction.
fn shown(
    aig: &mut Aig,
    net: &Net,
    (reaction, calls): &(Reaction, Vec<Call>),
    kind: ColumnKind,
) -> Number {
    let of_value = |aig: &mut Aig, value: Option<&Value>| match value {
        Some(Value::Number(number)) => number.clone(),
        Some(Value::Flag(lit)) => Number::from_code(aig, &[*lit], 0),
        None => Number::constant(0),
    };
    match kind {
        ColumnKind::Output(id) if net.outputs[id].is_extern() => {
            let mut count = Number::constant(0);
            for call in calls.iter().filter(|call| call.output == id) {
                let one = Number::from_code(aig, &[call.when], 0);
                count = Number::arith(aig, ArithOp::Add, &count, &one);
            }
            count
        }
        ColumnKind::Output(id) => {
            Number::from_code(aig, &reaction.outputs[id.index()], net.outputs[id].ty.bounds().0)
        }
        ColumnKind::Var(var) => of_value(aig, reaction.state.vars[var.index()].first()),
        ColumnKind::Element(var, at) => {
            of_value(aig, reaction.state.vars[var.index()].get(at as usize))
        }
        ColumnKind::Fault => Number::from_code(aig, &[reaction.fault], 0),
        ColumnKind::Scan
        | ColumnKind::Dt
        | ColumnKind::Input(_)
        | ColumnKind::Steps
        | ColumnKind::Calls(_) => Number::constant(0),
    }
}

/// Why an attempt gave no answer, as a sentence.
fn why(failed: Failed) -> String {
    match failed {
        Failed::Deeper => "a reaction may need more micro-steps than were unrolled".to_owned(),
        Failed::Full(full) => full.to_string(),
        Failed::Open(why) => why,
    }
}

/// The useful depths for these nets, smallest first.
fn depths(question: &Question<'_>) -> Vec<u32> {
    let most = limit_of(question.left).max(limit_of(question.right));
    let mut depths: Vec<u32> = DEPTHS.iter().map(|depth| (*depth).min(most)).collect();
    depths.dedup();
    depths
}

/// Random rows, for the first guess of equal bits.
pub(crate) type Chance<'r, 'p, 'n> = &'r Rows<'p, 'n>;
