//! The levels of the wires into the chips while the CPU is in reset (semantics §10.3).

use std::collections::{BTreeMap, BTreeSet};

use grafsynth_ir::division::{Running, Signal};
use grafsynth_ir::net::{Expr, InputId, Leaf, Net, PropertyLeaf, PropertyRole};

use super::{Carries, Request};

/// The number of partial assignments that are tried.
const MOST: usize = 20_000;

/// The largest range of an integer of which all values are tried.
const MOST_VALUES: i64 = 16;

/// The level of a connection while the CPU is in reset: no clock, no tick, and nothing fires; a clock would reset the chips. The inputs have levels that cause the
/// emergency, if there are any, so that the outputs of the chips are safe. A chip that runs on its own sees the steps that are active at first.
pub(super) fn level(
    request: &Request<'_>,
    safe: &BTreeMap<InputId, i64>,
    carries: Carries,
) -> bool {
    let net = request.net;
    match carries {
        Carries::Reset => true,
        Carries::Wire(Signal::Active(step)) => {
            request.division.running == Running::Free && net.steps[step].is_initial
        }
        Carries::Input { input, bit } => {
            let ty = net.inputs[input].ty;
            // Without an emergency, the input has its value in row 0, as after the start.
            let value = safe.get(&input).copied().unwrap_or(ty.saturate(0));
            let code = value.abs_diff(ty.bounds().0);
            code.checked_shr(bit).unwrap_or(0) & 1 == 1
        }
        _ => false,
    }
}

/// Values of inputs with which the emergency condition is true in every state, and no assumption is violated if all other inputs are 0, or next to it. `None` if
/// none were found: the condition also depends on something that is no input, is never true, or has too many inputs.
pub(super) fn safe(net: &Net) -> Option<BTreeMap<InputId, i64>> {
    let condition = &net.emergency.as_ref()?.condition;
    let read: BTreeSet<InputId> = condition.leaves().filter_map(|leaf| leaf.input()).collect();
    let handed = |id: &InputId| net.inputs[*id].kind.is_handed();
    let open: Vec<(InputId, Vec<i64>)> =
        read.into_iter().filter(handed).map(|id| (id, values(net, condition, id))).collect();
    // An input that can cause it on its own does so, whatever the others do: so a wire that breaks does not end it.
    let alone = |(id, values): &(InputId, Vec<i64>)| {
        let causes = |value: i64| holds(condition, &BTreeMap::from([(*id, value)])) == Some(true);
        let value = values.iter().copied().find(|value| causes(*value))?;
        Some((*id, value))
    };
    let alone: BTreeMap<InputId, i64> = open.iter().filter_map(alone).collect();
    if !alone.is_empty() && is_admissible(net, &alone) {
        return Some(alone);
    }
    let mut left = MOST;
    search(net, condition, &open, &mut BTreeMap::new(), &mut left)
}

/// Extends values to some that make the condition true.
fn search(
    net: &Net,
    condition: &Expr,
    open: &[(InputId, Vec<i64>)],
    chosen: &mut BTreeMap<InputId, i64>,
    left: &mut usize,
) -> Option<BTreeMap<InputId, i64>> {
    *left = left.checked_sub(1)?;
    match holds(condition, chosen) {
        Some(true) if is_admissible(net, chosen) => return Some(chosen.clone()),
        Some(false) => return None,
        Some(true) | None => {}
    }
    let ((input, values), rest) = open.split_first()?;
    for value in values {
        chosen.insert(*input, *value);
        if let Some(found) = search(net, condition, rest, chosen, left) {
            return Some(found);
        }
        chosen.remove(input);
    }
    None
}

/// The values of an input that are tried in a condition: all of a small range, else its bounds and the constants that it is compared with, with their neighbours.
fn values(net: &Net, condition: &Expr, input: InputId) -> Vec<i64> {
    let (least, most) = net.inputs[input].ty.bounds();
    if most.saturating_sub(least) < MOST_VALUES {
        return (least..=most).collect();
    }
    let compared = condition.compared().filter(|(leaf, _)| leaf.input() == Some(input));
    let near =
        compared.flat_map(|(_, value)| [value.saturating_sub(1), value, value.saturating_add(1)]);
    let all: BTreeSet<i64> =
        near.chain([least, most]).filter(|value| (least..=most).contains(value)).collect();
    all.into_iter().collect()
}

/// Whether a condition is true if the other leaves may have any value; `None` if that depends on them.
fn holds(condition: &Expr, chosen: &BTreeMap<InputId, i64>) -> Option<bool> {
    let leaf = |leaf: &Leaf| match leaf {
        Leaf::Input(id) => chosen.get(id).copied(),
        _ => None,
    };
    condition.known(&leaf).map(|value| value != 0)
}

/// Whether every assumption holds if all other inputs are 0, or next to it. Where an assumption is violated, a chip may do anything.
fn is_admissible(net: &Net, chosen: &BTreeMap<InputId, i64>) -> bool {
    let leaf = |leaf: &PropertyLeaf| match leaf {
        PropertyLeaf::Net(Leaf::Input(id)) => {
            Some(chosen.get(id).copied().unwrap_or(net.inputs[*id].ty.saturate(0)))
        }
        _ => None,
    };
    let mut assumed = net.properties.iter().filter(|one| one.role == PropertyRole::Assume);
    assumed.all(|one| one.never.known(&leaf) != Some(1))
}
