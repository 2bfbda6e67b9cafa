//! Converts a placement to one synchronous circuit.

use super::codes;
use crate::Object;
use crate::device::{Clock, PowerUp};
use crate::placement::{Cell, CellKind, Placement, Product};
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::logic::{Flop, FlopId, Logic, NodeId, PinInput, PinInputId, PinOutput, PinRole};
use grafsynth_ir::net::Meta;
use grafsynth_ir::span::{Name, Span};
use grafsynth_logic::build::Builder;

/// The object that a pin represents.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Role {
    /// The pin.
    pub pin: u32,
    /// The bit of the circuit; its function does not matter here.
    pub object: Object,
    /// True if the pin carries the complement.
    pub is_inverted: bool,
}

/// Builds the circuit of a placement. Pins with roles become the objects of the roles, in their order; the others become inputs and
/// flip-flops with the names in the placement, if they are read. For default roles, see [`own_roles`]. The power-up values follow from the
/// device.
///
/// # Errors
/// If the placement is not a circuit with a single clock: several clocks, asynchronous resets and presets, outputs that are not always driven but are read or have
/// a role, combinational loops.
pub fn logic(placement: &Placement, roles: &[Role]) -> Result<Logic, Vec<Diagnostic>> {
    let clock = clock(placement)?;
    let mut maker = Maker {
        placement,
        clock,
        builder: Builder::default(),
        inputs: Vec::new(),
        flops: Vec::new(),
        gates: Vec::new(),
        found: Vec::new(),
    };
    maker.builder.logic.name = Name::new(&placement.title, Span::default());
    maker.refuse_asynchronous(roles);
    maker.declare(roles);
    let outputs = maker.functions(roles);
    if !maker.found.is_empty() {
        return Err(maker.found);
    }
    for output in outputs {
        maker.builder.logic.outputs.push(output);
    }
    Ok(maker.builder.finish())
}

/// The default roles of the pins of a placement, with its names. Every macrocell's pin is an output unless it is permanently disabled, a registered
/// one is also a flip-flop, and every other pin that is read is an input.
#[must_use]
pub fn own_roles(placement: &Placement) -> Vec<Role> {
    let clock = clock(placement).ok().flatten();
    let mut roles: Vec<Role> = Vec::new();
    let mut add = |pin, object| roles.push(Role { pin, object, is_inverted: false });
    let name = |pin| placement.name(pin).map_or_else(|| format!("pin{pin}"), str::to_owned);
    for pin in 1..=placement.device.n_pins {
        let is_read = placement.products().any(|product| product.literal(pin).is_some());
        match placement.cell(pin) {
            None if clock == Some(pin) => add(pin, Object::Clock),
            None if is_read => {
                let input =
                    PinInput { name: name(pin), role: PinRole::Unknown, meta: Meta::default() };
                add(pin, Object::Input(input));
            }
            None => {}
            Some(cell) => {
                if cell.kind == CellKind::Registered {
                    add(pin, Object::Flop(idle_flop(name(pin))));
                }
                // A pin that is permanently disabled shows nothing.
                if cell.enable.as_ref().is_none_or(|enable| !enable.is_never()) {
                    add(pin, Object::Output(idle_output(name(pin))));
                }
            }
        }
    }
    roles
}

/// The pins of a device that is not a circuit with one clock: every pin that is read from outside is an input, clocks too, and every macrocell that
/// can drive its pin is an output. The functions do not matter; the roles map pins to objects.
#[must_use]
pub fn shell(placement: &Placement) -> (Logic, Vec<Role>) {
    let mut builder = Builder::default();
    builder.logic.name = Name::new(&placement.title, Span::default());
    let mut roles = own_roles(placement);
    roles.retain(|role| !matches!(role.object, Object::Flop(_)));
    for role in &mut roles {
        if matches!(role.object, Object::Clock) {
            let name = placement.name(role.pin).map_or_else(|| "clk".to_owned(), str::to_owned);
            let input = PinInput { name, role: PinRole::Unknown, meta: Meta::default() };
            role.object = Object::Input(input);
        }
    }
    if let Clock::Pin(pin) = placement.device.clock
        && placement.cells.iter().any(|cell| cell.kind == CellKind::Registered)
        && roles.iter().all(|role| role.pin != pin)
    {
        let name = placement.name(pin).map_or_else(|| "clk".to_owned(), str::to_owned);
        let input = PinInput { name, role: PinRole::Unknown, meta: Meta::default() };
        roles.insert(0, Role { pin, object: Object::Input(input), is_inverted: false });
    }
    let nothing = builder.constant(false);
    for role in &roles {
        match &role.object {
            Object::Input(input) => {
                builder.logic.inputs.push(input.clone());
            }
            Object::Output(output) => {
                builder.logic.outputs.push(PinOutput { value: nothing, ..output.clone() });
            }
            Object::Clock | Object::Reset | Object::Flop(_) | Object::Buried => {}
        }
    }
    (builder.finish(), roles)
}

fn idle_flop(name: String) -> Flop {
    let next = NodeId::from_index(0);
    Flop { name, init: false, next, holds: None, meta: Meta::default() }
}

fn idle_output(name: String) -> PinOutput {
    PinOutput {
        name,
        role: PinRole::Unknown,
        value: NodeId::from_index(0),
        registered: None,
        mealy: false,
        meta: Meta::default(),
    }
}

/// The pin that clocks all flip-flops; `None` if there is no flip-flop.
fn clock(placement: &Placement) -> Result<Option<u32>, Vec<Diagnostic>> {
    let registered = || placement.cells.iter().filter(|cell| cell.kind == CellKind::Registered);
    match placement.device.clock {
        Clock::Pin(pin) => Ok(registered().next().map(|_| pin)),
        Clock::None => Ok(None),
        Clock::Term => {
            let mut pins: Vec<Option<u32>> = registered()
                .map(|cell| match cell.clock.as_ref().map(|product| product.0.as_slice()) {
                    Some([(pin, true)]) => Some(*pin),
                    Some(_) | None => None,
                })
                .collect();
            pins.dedup();
            match pins[..] {
                [] => Ok(None),
                [Some(pin)] => Ok(Some(pin)),
                _ => {
                    Err(vec![not_synchronous("its flip-flops do not all have the same clock pin")])
                }
            }
        }
    }
}

fn not_synchronous(what: &str) -> Diagnostic {
    Diagnostic::error(
        codes::NOT_SYNCHRONOUS,
        format!("this device is not a single-clock circuit: {what}"),
    )
    .help("simulate the fuse map itself with `grafsynth sim`")
}

struct Maker<'a> {
    placement: &'a Placement,
    clock: Option<u32>,
    builder: Builder,
    inputs: Vec<(u32, PinInputId, bool)>,
    flops: Vec<(u32, FlopId, bool)>,
    /// The functions of combinational pins; `None` while one is being built.
    gates: Vec<(u32, Option<NodeId>)>,
    found: Vec<Diagnostic>,
}

impl Maker<'_> {
    fn name(&self, pin: u32) -> String {
        self.placement.name(pin).map_or_else(|| format!("pin{pin}"), str::to_owned)
    }

    fn is_read(&self, pin: u32) -> bool {
        self.placement.cells.iter().flat_map(|cell| &cell.sum).any(|p| p.literal(pin).is_some())
            || self.placement.sync_preset.iter().any(|p| p.literal(pin).is_some())
    }

    fn refuse_asynchronous(&mut self, roles: &[Role]) {
        let is_used = |product: &Option<Product>| product.as_ref().is_some_and(|p| !p.is_never());
        if is_used(&self.placement.async_reset) {
            self.found.push(not_synchronous("it has an asynchronous reset"));
        }
        for cell in &self.placement.cells {
            if is_used(&cell.set) || is_used(&cell.reset) {
                let what = format!("pin {} has its own reset or preset", cell.pin);
                self.found.push(not_synchronous(&what));
            }
            let is_shown = roles.iter().any(|role| role.pin == cell.pin)
                || cell.kind != CellKind::Registered && self.is_read(cell.pin);
            // A flip-flop whose pin is disabled still works; only its pin must not be read.
            let is_always = cell.enable.as_ref().is_none_or(|product| product.0.is_empty());
            if is_shown && !is_always {
                let what = format!("pin {} is not always driven", cell.pin);
                self.found.push(not_synchronous(&what));
            }
        }
        if let Some(clock) = self.clock
            && self.is_read(clock)
        {
            self.found.push(not_synchronous(&format!("its clock, pin {clock}, is also an input")));
        }
    }

    /// Declares inputs and flip-flops, those with roles first.
    fn declare(&mut self, roles: &[Role]) {
        for role in roles {
            match &role.object {
                Object::Input(input) => {
                    let id = self.builder.logic.inputs.push(input.clone());
                    self.inputs.push((role.pin, id, role.is_inverted));
                }
                Object::Flop(flop) => self.flop(role.pin, flop.clone(), role.is_inverted),
                Object::Clock | Object::Reset | Object::Output(_) | Object::Buried => {}
            }
        }
        for pin in 1..=self.placement.device.n_pins {
            let cell = self.placement.cell(pin);
            match cell.map(|cell| cell.kind) {
                Some(CellKind::Registered) => {
                    // An unread register without a role belongs to an output, or is an idle macrocell that cannot be disabled.
                    let is_needed = self.is_read(pin);
                    if self.flops.iter().all(|(known, _, _)| *known != pin) && is_needed {
                        let flop = idle_flop(self.name(pin));
                        self.flop(pin, flop, false);
                    }
                }
                Some(CellKind::Combinational | CellKind::Tristate) => {}
                None => {
                    let is_known = self.inputs.iter().any(|(known, _, _)| *known == pin);
                    if self.is_read(pin) && !is_known {
                        let name = self.name(pin);
                        let input =
                            PinInput { name, role: PinRole::Unknown, meta: Meta::default() };
                        let id = self.builder.logic.inputs.push(input);
                        self.inputs.push((pin, id, false));
                    }
                }
            }
        }
    }

    fn flop(&mut self, pin: u32, mut flop: Flop, is_inverted: bool) {
        // Its function is set after all flip-flops are known.
        flop.next = self.builder.constant(false);
        let Some(cell) = self.placement.cell(pin) else {
            let message = format!("pin {pin} must store `{}` but has no flip-flop", flop.name);
            self.found.push(Diagnostic::error(codes::NOT_AS_MEANT, message));
            return;
        };
        flop.init = self.first_level(cell) != is_inverted;
        let id = self.builder.logic.flops.push(flop);
        self.flops.push((pin, id, is_inverted));
    }

    /// The power-up level of a registered pin.
    fn first_level(&self, cell: &Cell) -> bool {
        match self.placement.device.power_up {
            PowerUp::PinsHigh => true,
            PowerUp::ByPolarity => cell.is_active_low,
        }
    }

    /// The level of a pin.
    fn level(&mut self, pin: u32) -> NodeId {
        if let Some(&(_, id, is_inverted)) = self.flops.iter().find(|(known, _, _)| *known == pin) {
            let node = self.builder.flop(id);
            return self.inverted(node, is_inverted);
        }
        if let Some(&(_, id, is_inverted)) = self.inputs.iter().find(|(known, _, _)| *known == pin)
        {
            let node = self.builder.input(id);
            return self.inverted(node, is_inverted);
        }
        if let Some((_, made)) = self.gates.iter().find(|(known, _)| *known == pin) {
            if let Some(node) = made {
                return *node;
            }
            let what = format!("pin {pin} depends on itself without a flip-flop in between");
            self.found.push(not_synchronous(&what));
            return self.builder.constant(false);
        }
        let Some(cell) = self.placement.cell(pin).cloned() else {
            return self.builder.constant(true);
        };
        self.gates.push((pin, None));
        let node = self.sum(&cell);
        for gate in &mut self.gates {
            if gate.0 == pin {
                gate.1 = Some(node);
            }
        }
        node
    }

    fn inverted(&mut self, node: NodeId, is_inverted: bool) -> NodeId {
        if is_inverted { self.builder.not(node) } else { node }
    }

    fn product(&mut self, product: &Product) -> NodeId {
        let literals: Vec<NodeId> = product
            .0
            .iter()
            .map(|&(pin, value)| {
                let level = self.level(pin);
                self.inverted(level, !value)
            })
            .collect();
        self.builder.and(literals)
    }

    /// The level that a macrocell's sum defines; for a flip-flop, the next one.
    fn sum(&mut self, cell: &Cell) -> NodeId {
        let mut products: Vec<NodeId> = cell.sum.iter().map(|p| self.product(p)).collect();
        if let (CellKind::Registered, Some(preset)) = (cell.kind, &self.placement.sync_preset) {
            let preset = preset.clone();
            products.push(self.product(&preset));
        }
        let sum = self.builder.or(products);
        self.inverted(sum, cell.is_active_low)
    }

    fn functions(&mut self, roles: &[Role]) -> Vec<PinOutput> {
        for (pin, id, is_inverted) in self.flops.clone() {
            let Some(cell) = self.placement.cell(pin).cloned() else { continue };
            let next = self.sum(&cell);
            self.builder.logic.flops[id].next = self.inverted(next, is_inverted);
        }
        let mut outputs = Vec::new();
        for role in roles {
            let Object::Output(output) = &role.object else { continue };
            let Some(cell) = self.placement.cell(role.pin).cloned() else {
                let message = format!("pin {} must show `{}` but is idle", role.pin, output.name);
                self.found.push(Diagnostic::error(codes::NOT_AS_MEANT, message));
                continue;
            };
            let is_flop = self.flops.iter().any(|(pin, _, _)| *pin == role.pin);
            let is_registered = cell.kind == CellKind::Registered && !is_flop;
            let node = if is_registered { self.sum(&cell) } else { self.level(role.pin) };
            let mut output = output.clone();
            output.value = self.inverted(node, role.is_inverted);
            output.registered = is_registered.then(|| self.first_level(&cell) != role.is_inverted);
            outputs.push(output);
        }
        outputs
    }
}
