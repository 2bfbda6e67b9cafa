//! Emergency inputs that also reach the chips without the CPU (semantics §10.3).
//!
//! The CPU latches the inputs of the emergency condition and passes them on, as all others. A chip whose outputs the emergency forces reads their pins, too: its
//! emergency condition is that of the latched inputs, or that of the pins. So its outputs are safe as soon as the plant demands it, also if the CPU is slow or
//! dead, and stay safe as long as the net says so. Nothing else on the chip reads these pins.

use std::collections::{BTreeMap, BTreeSet};

use grafsynth_ir::Name;
use grafsynth_ir::division::Source;
use grafsynth_ir::net::{Expr, Input, InputId, InputKind, Leaf, Net};

use crate::pieces::unused;

/// Adds an input for the pin of each Boolean input that the emergency condition of a chip reads, and its source.
pub(crate) fn wire(part: &mut Net, sources: &mut Vec<Source>, used: &BTreeSet<String>) {
    let Some(emergency) = &mut part.emergency else { return };
    let read: BTreeSet<InputId> =
        emergency.condition.leaves().filter_map(|leaf| leaf.input()).collect();
    let mut used = used.clone();
    let mut pins: BTreeMap<InputId, InputId> = BTreeMap::new();
    for id in read {
        let input = &part.inputs[id];
        let Some(Source::Input(latched)) = sources.get(id.index()).copied() else { continue };
        if input.kind != InputKind::Pin || !input.ty.is_bool() {
            continue;
        }
        let name = unused(format!("{}_direct", input.name.text), &mut used);
        let pin = Input { name: Name::new(name, input.name.span), ..input.clone() };
        pins.insert(id, part.inputs.push(pin));
        sources.push(Source::Direct(latched));
    }
    if pins.is_empty() {
        return;
    }
    let now = emergency.condition.map_leaves(&|leaf| match *leaf {
        Leaf::Input(id) => Leaf::Input(pins.get(&id).copied().unwrap_or(id)),
        other => other,
    });
    emergency.condition = Expr::or([emergency.condition.clone(), now]);
}
