//! Compares imported logic by pin number: a fuse map rarely contains the names of its pins.

use crate::logic::LogicDesign;
use grafsynth_backend_pld::Object;
use grafsynth_ir::Gather;
use grafsynth_ir::logic::Logic;
use std::collections::BTreeMap;

/// The circuit of the second design with the names that the first one gives to the same pin numbers. `None` if the pins must be compared by name: neither
/// design is a fuse map, or each fuse map names all its pins, or a design does not define its pins, or the packages differ, or the second design has no
/// circuit.
#[must_use]
pub fn by_number(first: &LogicDesign, second: &LogicDesign) -> Option<Logic> {
    let (Ok(ours), Ok(theirs)) = (&first.placement, &second.placement) else { return None };
    let is_nameless = |design: &LogicDesign| {
        let Some((fuses, placement)) = design.fuses.as_ref().zip(design.placement.as_ref().ok())
        else {
            return false;
        };
        fuses.roles.iter().any(|role| placement.name(role.pin).is_none())
    };
    if ours.device.n_pins != theirs.device.n_pins || !is_nameless(first) && !is_nameless(second) {
        return None;
    }
    let (wanted, known) = (names(first), names(second));
    let mut circuit = second.logic.clone()?;
    // No name contains a blank, so a pin that the first design does not use cannot be mistaken for another.
    let rename = |name: &mut String| {
        let pin = known.iter().find(|(_, known)| *known == name).map(|(pin, _)| *pin);
        if let Some(pin) = pin {
            *name = wanted.get(&pin).cloned().unwrap_or_else(|| format!("pin {pin}"));
        }
    };
    for id in circuit.inputs.ids() {
        rename(&mut circuit.inputs[id].name);
    }
    for id in circuit.outputs.ids() {
        rename(&mut circuit.outputs[id].name);
    }
    for id in circuit.flops.ids() {
        rename(&mut circuit.flops[id].name);
    }
    Some(circuit)
}

/// The name of each pin in the circuit of a design.
fn names(design: &LogicDesign) -> BTreeMap<u32, String> {
    if let Some(fuses) = &design.fuses {
        let named = fuses.roles.iter().filter_map(|role| match &role.object {
            Object::Input(input) => Some((role.pin, input.name.clone())),
            Object::Output(output) => Some((role.pin, output.name.clone())),
            Object::Flop(flop) => Some((role.pin, flop.name.clone())),
            Object::Clock | Object::Reset | Object::Buried => None,
        });
        return named.gather();
    }
    let pins = design.placement.iter().flat_map(|placement| &placement.pins);
    pins.map(|named| (named.pin, named.name.clone())).gather()
}
