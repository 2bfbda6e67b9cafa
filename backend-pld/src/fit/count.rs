//! Finds, by counting and before anything is minimised, the resources that a device lacks for a circuit whatever its sums are.

use crate::EmitOptions;
use crate::device::{Clock, Device};
use crate::equations::Equation;
use grafsynth_ir::counted;
use grafsynth_ir::logic::Logic;
use std::collections::BTreeSet;

/// Sums with this many times the product terms of a device cannot fit, however they are divided.
const FAR_TOO_MANY: usize = 2;

/// The resources that the device lacks; `None` if counting finds nothing. The numbers are lower bounds: a
/// flip-flop and an output may share a macrocell.
pub(crate) fn lacks(logic: &Logic, device: &Device, options: &EmitOptions) -> Option<String> {
    let (n_inputs, n_flops) = (logic.inputs.len(), logic.flops.len());
    // Outputs that are assigned to one pin count as one.
    let mut pins = BTreeSet::new();
    let is_own = |name: &str| {
        let wish = options.pins.iter().find(|(known, _)| known == name);
        wish.is_none_or(|(_, pin)| pins.insert(*pin))
    };
    let names = logic.outputs.values().map(|output| output.name.as_str());
    let n_outputs = names.filter(|name| !name.is_empty()).map(is_own).filter(|own| *own).count();
    let n_cells = n_flops.max(n_outputs);
    let n_device = device.n_cells();
    if n_cells > n_device {
        return Some(format!(
            "{} and {} need at least {n_cells} macrocells, but the device has only {n_device}",
            counted(n_flops, "register", "registers"),
            counted(n_outputs, "output", "outputs")
        ));
    }
    let is_registered =
        n_flops > 0 || logic.outputs.values().any(|output| output.registered.is_some());
    let n_clocks = usize::from(is_registered && device.clock != Clock::None);
    // If not every macrocell has a pin, a register needs no pin.
    let n_shown = if device.blocks.is_some() { n_outputs } else { n_cells };
    let n_fixed = device.grounds.len() + device.supplies.len() + device.jtag_pins.len();
    let n_pins = (device.n_pins as usize).saturating_sub(n_fixed);
    let n_signals = n_inputs + n_shown + n_clocks;
    if n_signals <= n_pins {
        return None;
    }
    let clock = if n_clocks > 0 { ", the clock" } else { "" };
    let shown = if device.blocks.is_some() { "outputs" } else { "registers and outputs" };
    Some(format!(
        "{}{clock} and {n_shown} {shown} need at least {n_signals} pins, but the device has only {n_pins}",
        counted(n_inputs, "input", "inputs")
    ))
}

/// True if the sums are so wide that minimising or dividing them is useless.
pub(crate) fn is_far_too_wide(equations: &[Equation], device: &Device) -> bool {
    let n_terms: usize = equations.iter().map(Equation::n_terms).sum();
    let of_blocks = device.blocks.map(|own| own.n_blocks * own.n_cells * own.own_terms);
    let of_cells = || {
        let terms = device.macrocells.iter();
        terms.map(|cell| cell.registered_terms.max(cell.combinational_terms)).sum::<u32>()
    };
    n_terms > FAR_TOO_MANY * of_blocks.unwrap_or_else(of_cells) as usize
}
