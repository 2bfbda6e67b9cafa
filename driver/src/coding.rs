//! How the steps of a circuit are coded, and what its equations may take for granted: from the proved facts of a net.
//!
//! Groups are the sequential components of [`Facts`]; where the reachable situations themselves are known and few, they are don't-cares too. All of that
//! is said of states between clocks, so a circuit that makes one micro-step a clock is left as it is. Whatever is assumed here, the text that comes out
//! is read back and proved equal to the net from power-up on.

use grafsynth_backend_pld::equations::Equations;
use grafsynth_backend_pld::{Dialect, EmitOptions};
use grafsynth_ir::facts::Facts;
use grafsynth_ir::logic::{FlopId, Logic, PinRole};
use grafsynth_ir::net::{Net, StepId};
use grafsynth_ir::program::Origin;
pub use grafsynth_logic::recode::Encoding;
use grafsynth_logic::recode::{self, Group, TRIES};
use std::collections::BTreeMap;

/// What the user asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub enum EncodingChoice {
    /// One-hot if that fits the device, else zero-hot, else compact, if one of them does.
    #[default]
    Auto,
    /// This one.
    This(Encoding),
}

/// More situations than these are no don't-cares: the diagram of all of them would be part of each function's.
const SITUATIONS: usize = 256;

/// A circuit with the codes and the don't-cares that were chosen.
#[derive(Debug, Clone)]
pub struct Coded {
    /// The circuit.
    pub logic: Logic,
    /// The code of its groups.
    pub encoding: Encoding,
    /// Steps that lost their flip-flop.
    pub n_coded: usize,
}

/// The groups of steps that exclude each other, by their flip-flops.
#[must_use]
pub fn groups(net: &Net, facts: &Facts, logic: &Logic) -> Vec<Group> {
    let flops = flops_of_steps(logic);
    let groups = facts.components.iter().filter_map(|component| {
        let steps: Option<Vec<FlopId>> =
            component.steps.iter().map(|step| flops.get(step).copied()).collect();
        let first = &net.steps[*component.steps.first()?];
        // A part of the chart that is one group gives it its name, and so its bits.
        let part = &net.parts[first.part];
        let of_part = net.steps.values().filter(|step| step.part == first.part).count();
        let name = if of_part == component.steps.len() { &part.name } else { &first.name };
        Some(Group { name: name.text.clone(), steps: steps?, is_always: component.always })
    });
    groups.filter(|group| group.steps.len() > 1).collect()
}

fn flops_of_steps(logic: &Logic) -> BTreeMap<StepId, FlopId> {
    let mut held = BTreeMap::new();
    for (id, flop) in logic.flops.iter() {
        if let Some(holds) = flop.holds
            && let Origin::Step(step) = holds.origin
            && !holds.inverted
        {
            held.insert(step, id);
        }
    }
    held
}

/// Codes the steps for a language and a device.
#[must_use]
pub fn code(
    net: &Net,
    facts: &Facts,
    logic: &Logic,
    choice: EncodingChoice,
    safe: bool,
    dialect: Dialect,
    options: &EmitOptions,
) -> Coded {
    let is_busy = logic.outputs.values().any(|output| output.role == PinRole::Busy);
    let plain = Coded { logic: logic.clone(), encoding: Encoding::OneHot, n_coded: 0 };
    let groups = groups(net, facts, logic);
    if is_busy {
        return plain;
    }
    let mut known = logic.clone();
    let situations = situations(net, facts, logic);
    if let Some((steps, situations)) = &situations {
        recode::only(&mut known, steps, situations);
    }
    let made = |encoding: Encoding, tries: usize| {
        let mut logic = recode::recode(&known, &groups, encoding, tries);
        if let (Encoding::Compact, Some((steps, situations))) = (encoding, &situations)
            && let Some(flat) = recode::flatten(&known, &net.name.text, steps, situations, tries)
            && flat.flops.len() < logic.flops.len()
        {
            logic = flat;
        }
        let n_coded = logic.decoded.len();
        let logic = if safe { recode::safe(logic) } else { logic };
        Coded { logic, encoding, n_coded }
    };
    let choice = match choice {
        EncodingChoice::This(encoding) => return made(encoding, TRIES),
        EncodingChoice::Auto => made(Encoding::OneHot, 0),
    };
    let needs_pins = match dialect {
        Dialect::Palasm | Dialect::Cupl | Dialect::Galasm => true,
        Dialect::Verilog | Dialect::Blif => false,
    };
    if !needs_pins || groups.is_empty() || fits(&choice, options) {
        return choice;
    }
    [Encoding::ZeroHot, Encoding::Compact]
        .into_iter()
        .filter(|encoding| {
            situations.is_some() && *encoding == Encoding::Compact
                || may_fit(logic, &groups, *encoding, options)
        })
        .map(|encoding| made(encoding, TRIES))
        .find(|coded| fits(coded, options))
        .unwrap_or(choice)
}

/// What is emitted for it: a circuit that returns from every illegal state must not have its sums cut short by them.
#[must_use]
pub fn emitted(coded: &Coded, safe: bool) -> Logic {
    let mut logic = coded.logic.clone();
    if safe {
        logic.unreachable.clear();
    }
    logic
}

fn fits(coded: &Coded, options: &EmitOptions) -> bool {
    Equations::new(&coded.logic, Dialect::Palasm, options).is_ok_and(|made| made.has_pins)
}

/// Whether pins and flip-flops are few enough, so that it is worth finding sums.
fn may_fit(logic: &Logic, groups: &[Group], encoding: Encoding, options: &EmitOptions) -> bool {
    use grafsynth_backend_pld::device::Device;
    let device = options.device.as_deref().map_or(Some(Device::default_device()), Device::find);
    let Some(device) = device else { return false };
    let saved: usize = groups
        .iter()
        .map(|group| match encoding {
            Encoding::OneHot => 0,
            Encoding::ZeroHot => usize::from(group.is_always),
            Encoding::Compact => {
                let n_codes = group.steps.len() + usize::from(!group.is_always);
                group.steps.len() - n_codes.next_power_of_two().trailing_zeros() as usize
            }
        })
        .sum();
    let n_cells = logic.flops.len() + logic.outputs.len() - saved;
    n_cells <= device.macrocells.len() && n_cells + logic.inputs.len() < device.n_pins as usize
}

/// The flip-flops of all steps, and the reachable situations as values of them, where they are known and few and every step has a flip-flop.
fn situations(net: &Net, facts: &Facts, logic: &Logic) -> Option<(Vec<FlopId>, Vec<Vec<bool>>)> {
    let reach = facts.reach.as_ref().filter(|reach| reach.exact)?;
    let sets = reach.sets.as_ref().filter(|sets| sets.len() <= SITUATIONS)?;
    let flops = flops_of_steps(logic);
    let steps: Vec<(StepId, FlopId)> =
        net.steps.ids().filter_map(|step| Some((step, *flops.get(&step)?))).collect();
    if steps.len() != net.steps.len() || steps.len() > 64 {
        return None;
    }
    let is_active = |set: &[u64], step: StepId| {
        set.get(step.index() / 64).is_some_and(|word| word >> (step.index() % 64) & 1 == 1)
    };
    let situations = sets
        .iter()
        .map(|set| steps.iter().map(|(step, _)| is_active(set, *step)).collect())
        .collect();
    Some((steps.into_iter().map(|(_, flop)| flop).collect(), situations))
}
