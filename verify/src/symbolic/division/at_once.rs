//! The pins of an emergency, which a chip reads at every moment (semantics §10.3).
//!
//! In a row, such a pin has the level that the CPU latched, and the chip equals the net. At any other moment it may have any level. The chip must then still move
//! as the net does, and each of its outputs must have the value of the net or its safe value: an emergency may come early, and nothing else may change.

use grafsynth_ir::division::{PartNet, Shown, Source};
use grafsynth_ir::net::Output;

use super::super::aig::Lit;
use super::super::reaction::{Inputs, Maker, Reaction};
use super::super::state::{State, Value};
use super::{Failed, Pair, What};

/// The pairs of functions that must be equal if these pins have any levels; `own` is the reaction of the part in which they have those of the row.
pub(super) fn pairs(
    maker: &mut Maker<'_>,
    part: &PartNet,
    (state, inputs): (&State, &Inputs),
    own: &Reaction,
) -> Result<Vec<Pair>, Failed> {
    if !part.inputs.values().any(|source| matches!(source, Source::Direct(_))) {
        return Ok(Vec::new());
    }
    let decided = maker.decided.clone();
    let mut loose =
        Inputs { values: inputs.values.clone(), tick: inputs.tick, dt: inputs.dt.clone() };
    for (value, source) in loose.values.iter_mut().zip(part.inputs.values()) {
        if let Source::Direct(_) = source {
            *value = Value::Flag(maker.aig.variable());
        }
    }
    let other = maker.reaction(state, &loose)?;
    let pair = |what: What, wanted: Lit, given: Lit| Pair { what, wanted, given, at_reset: false };
    let mut pairs = Vec::new();
    for ((id, wanted), given) in part.net.transitions.ids().zip(decided).zip(maker.decided.clone())
    {
        pairs.push(pair(What::Decision(id.index()), wanted, given));
    }
    let shape = maker.shape.clone();
    let wanted = shape.bits(&part.net, &mut maker.aig, &own.state);
    let given = shape.bits(&part.net, &mut maker.aig, &other.state);
    for ((key, wanted), given) in wanted.into_iter().zip(given.into_values()) {
        pairs.push(pair(What::Bit(key), wanted, given));
    }
    for (id, shown) in part.outputs.iter() {
        let codes = own.outputs[id.index()].iter().zip(&other.outputs[id.index()]);
        let Shown::Output(_) = shown else {
            pairs.extend(codes.map(|(own, given)| pair(What::Output(id.index()), *own, *given)));
            continue;
        };
        let output = &part.net.outputs[id];
        let differ: Vec<Lit> = codes.map(|(own, given)| maker.aig.xor(*own, *given)).collect();
        let differs = maker.aig.or_all(differ);
        let unsafe_bits = other.outputs[id.index()].iter().enumerate();
        let unsafe_bits: Vec<Lit> =
            unsafe_bits.map(|(bit, lit)| lit.negate_if(safe_bit(output, bit))).collect();
        let is_unsafe = maker.aig.or_all(unsafe_bits);
        let wrong = maker.aig.and(differs, is_unsafe);
        pairs.push(pair(What::Output(id.index()), Lit::FALSE, wrong));
    }
    Ok(pairs)
}

/// A bit of the code of the safe value: the distance from the lower bound of the type.
fn safe_bit(output: &Output, bit: usize) -> bool {
    let distance = output.safe_value().abs_diff(output.ty.bounds().0);
    u32::try_from(bit).ok().and_then(|bit| distance.checked_shr(bit)).unwrap_or(0) & 1 == 1
}
