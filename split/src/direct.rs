//! Inputs of the plant that may be wired to chips alone, without the CPU (semantics §10.3).
//!
//! A chip follows such a pin at every moment, also between the latch of the CPU and the clock edge. So it must not matter when in a round the pin changes: no
//! flip-flop and no wire may depend on it, and the CPU must not read it. What remains are outputs that follow the pin, and the row has the level of the pin at its end.

use grafsynth_ir::Gather;
use std::collections::{BTreeMap, BTreeSet};

use grafsynth_ir::division::{Division, Source};
use grafsynth_ir::net::{
    Driver, Expr, InputId, InputKind, Leaf, Net, Output, PropertyLeaf, PropertyRole,
};

use crate::link::ChipPins;
use crate::pieces::reads;

/// For each input that may be wired to chips alone, the inputs that must then be wired in the same way: an assumption is about levels at the same moment.
pub(crate) fn candidates(net: &Net) -> BTreeMap<InputId, BTreeSet<InputId>> {
    // An input that is read nowhere else has all its places in these conditions.
    let count = |exprs: &mut dyn Iterator<Item = &Expr>| {
        let mut places: BTreeMap<InputId, usize> = BTreeMap::new();
        for leaf in exprs.flat_map(|expr| expr.leaves()) {
            if let Leaf::Input(id) = *leaf {
                *places.entry(id).or_default() += 1;
            }
        }
        places
    };
    let everywhere = count(&mut net.expressions());
    let followed = net.outputs.values().filter(|output| follows(output));
    let followed = count(&mut followed.flat_map(|output| output.driver.exprs()));
    let mut free: BTreeSet<InputId> = followed
        .into_iter()
        .filter(|(id, places)| {
            net.inputs[*id].kind == InputKind::Pin && everywhere.get(id) == Some(places)
        })
        .map(|(id, _)| id)
        .gather();
    let assumed: Vec<BTreeSet<InputId>> = assumptions(net).collect();
    let mut with: BTreeMap<InputId, BTreeSet<InputId>> = BTreeMap::new();
    loop {
        with.clear();
        for id in &free {
            let mut class: BTreeSet<InputId> = [*id].into_iter().gather();
            while let Some(more) =
                assumed.iter().find(|one| !one.is_disjoint(&class) && !one.is_subset(&class))
            {
                class.extend(more);
            }
            with.insert(*id, class);
        }
        let before = free.len();
        free.retain(|id| {
            with.get(id).is_some_and(|class| class.iter().all(|one| with.contains_key(one)))
        });
        if free.len() == before {
            return with;
        }
    }
}

/// True if the value of an output is a function of the situation and of the inputs at every moment, not only at the clock edge or before it.
fn follows(output: &Output) -> bool {
    matches!(output.driver, Driver::Continuous(_)) && !output.registered
}

/// The inputs of each assumption.
fn assumptions(net: &Net) -> impl Iterator<Item = BTreeSet<InputId>> + '_ {
    let assumed = net.properties.iter().filter(|one| one.role == PropertyRole::Assume);
    assumed.map(|one| {
        let inputs = one.never.leaves().filter_map(|leaf| match leaf {
            PropertyLeaf::Net(Leaf::Input(id)) => Some(*id),
            _ => None,
        });
        inputs.gather()
    })
}

/// The inputs that are wired to the chips alone: the candidates that no part on the CPU reads, and on which no flip-flop and no wire of the fitted chips depends.
pub(crate) fn direct(net: &Net, division: &Division, chips: &[ChipPins]) -> BTreeSet<InputId> {
    let mut latched: BTreeSet<InputId> = BTreeSet::new();
    for (at, part) in division.parts.iter().enumerate() {
        let held = chips.get(at).map(|chip| &chip.held);
        for (id, source) in part.inputs.iter() {
            if let Source::Input(input) = *source
                && held.map_or_else(|| reads(&part.net, id), |held| held.contains(&id))
            {
                latched.insert(input);
            }
        }
    }
    let candidates = candidates(net);
    let is_direct = |class: &BTreeSet<InputId>| class.is_disjoint(&latched);
    candidates.into_iter().filter(|(_, class)| is_direct(class)).map(|(id, _)| id).gather()
}
