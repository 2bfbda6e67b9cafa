//! Places a circuit in the macrocells of a device, with the names of its source.

use super::{Role, codes};
use crate::equations::Equations;
use crate::placement::Placement;
use crate::{Dialect, EmitOptions, Object};
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::logic::Logic;
use grafsynth_ir::ranks::sort_by_rank;
use std::rc::Rc;

/// Chooses forms and pins for a circuit and puts each function into its macrocell; also returns the role of each pin.
///
/// # Errors
/// If the device cannot hold the circuit, or has no fuse map.
pub fn place(
    logic: &Logic,
    options: &EmitOptions,
) -> Result<(Placement, Vec<Role>), Vec<Diagnostic>> {
    place_from(None, logic, options)
}

/// Like [`place`], with the equations of this circuit for [`Dialect::Galasm`] if they were made before with these options.
///
/// # Errors
/// Like [`place`].
pub fn place_from(
    known: Option<Rc<Equations>>,
    logic: &Logic,
    options: &EmitOptions,
) -> Result<(Placement, Vec<Role>), Vec<Diagnostic>> {
    // This language needs all pins, so a design that does not fit is rejected.
    let equations = match known.filter(|known| known.is_enough_for(Dialect::Galasm)) {
        Some(known) => known,
        None => Rc::new(Equations::new(logic, Dialect::Galasm, options)?),
    };
    if equations.device.layout.is_none() {
        return Err(vec![super::no_map(equations.device)]);
    }
    let Some(mut placement) = equations.placement() else {
        let message = format!("not every signal has a pin of the {}", equations.device.name);
        let help = "use a larger device, or build `palasm` or `cupl`, which leave pins unassigned";
        return Err(vec![Diagnostic::error(codes::CANNOT_HOLD, message).help(help)]);
    };
    placement.part = options.device.as_deref().and_then(|name| equations.device.part(name));
    let roles = equations.roles(logic);
    // Equation languages use short names; a file for a programmer uses those of the source.
    for named in &mut placement.pins {
        let role = roles.iter().find(|role| role.pin == named.pin);
        match role.map(|role| &role.object) {
            Some(Object::Input(input)) => named.name.clone_from(&input.name),
            Some(Object::Flop(flop)) => named.name.clone_from(&flop.name),
            Some(Object::Output(output)) => named.name.clone_from(&output.name),
            Some(Object::Clock | Object::Reset | Object::Buried) | None => {}
        }
    }
    sort_by_rank(&mut placement.cells, |cell| [u64::from(cell.pin)]);
    Ok((placement, roles))
}
