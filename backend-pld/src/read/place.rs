//! Converts a text with a device and pins to the macrocells that it defines: nothing is minimised and no pin changes.
//!
//! A function that is a plain sum of products is used product by product. One with parentheses, exclusive-ors or intermediate names is multiplied out;
//! then products that can never be true and repeated products are dropped, and nothing else.

use super::ast::{Definition, Expr, ExprId, PldAst, Role, Signal, SignalId};
use crate::codes;
use crate::device::{Clock, Device, PowerUp};
use crate::placement::{Cell, CellKind, PinName, Placement, Product};
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::span::Span;

/// The maximum depth of intermediate names and parentheses together.
const MAX_DEPTH: u32 = 400;
/// The maximum number of intermediate products while a function is multiplied out.
const MAX_PRODUCTS: usize = 2048;
/// The maximum number of steps (expressions visited and products made) for multiplying out all functions of a text.
const MAX_WORK: usize = 1 << 20;

/// The macrocells that a text defines.
///
/// # Errors
/// Returns why the text does not define fuses: no device, a signal without a pin, or something that the device does not have.
pub(crate) fn place(draft: &PldAst) -> Result<Placement, Vec<Diagnostic>> {
    let Some(device) = draft.device else {
        let message = "the text names no known device, so it does not define fuses";
        return Err(vec![
            Diagnostic::error(codes::NOT_PLACED, message)
                .at(draft.name.span, "")
                .help("name a known device in the text"),
        ]);
    };
    let mut placer = Placer { draft, device, found: Vec::new(), work: 0 };
    let mut placement = Placement::new(device);
    placement.title = draft.name.text.clone();
    placement.signature.clone_from(&draft.signature);
    for (id, signal) in (0..SignalId::MAX).zip(&draft.signals) {
        if let Some(pin) = signal.pin {
            let (name, is_inverted) = (signal.name.clone(), signal.is_pin_inverted);
            placement.pins.push(PinName { pin, name, is_inverted });
        }
        let Some(definition) = signal.definition else { continue };
        match (signal.role, signal.pin) {
            (Role::Internal, _) if !definition.is_registered => {}
            (_, None) => {
                let message = format!("`{}` has no pin, so it has no macrocell", signal.name);
                placer.refuse(message, definition.span);
                let own = placer.found.pop().map(|finding| {
                    finding.plural(
                        format!("`{}`", signal.name),
                        "",
                        "have no pins and no macrocells",
                    )
                });
                placer.found.extend(own);
            }
            (_, Some(pin)) => {
                if let Some(cell) = placer.cell(id, signal, pin, &definition) {
                    placement.cells.push(cell);
                }
            }
        }
    }
    placement.pins.sort_by_key(|named| named.pin);
    placer.global(&mut placement);
    if placer.found.is_empty() { Ok(placement) } else { Err(placer.found) }
}

struct Placer<'d> {
    draft: &'d PldAst,
    device: &'static Device,
    found: Vec<Diagnostic>,
    work: usize,
}

/// Products as sets of literals.
type Sum = Vec<Vec<(u32, bool)>>;

impl Placer<'_> {
    fn refuse(&mut self, message: String, span: Span) {
        let finding = Diagnostic::error(codes::NOT_PLACED, message).at(span, "");
        self.found.push(finding.help(
            "correct the text, or build with --refit, which assigns pins and macrocells anew",
        ));
    }

    fn cell(
        &mut self,
        id: SignalId,
        signal: &Signal,
        pin: u32,
        definition: &Definition,
    ) -> Option<Cell> {
        let device = self.device;
        if device.macrocell(pin).is_none() {
            let message = format!(
                "`{}` is pin {pin} of a {}, which is not an output",
                signal.name, device.name
            );
            self.refuse(message, definition.span);
            return None;
        }
        let sum = self.sum(&signal.name, definition)?;
        let kind = if definition.is_registered {
            CellKind::Registered
        } else if self.draft.tristate.contains(&id) {
            CellKind::Tristate
        } else {
            CellKind::Combinational
        };
        let is_active_low = definition.is_complemented != signal.is_pin_inverted;
        let mut cell = Cell::new(pin, kind, is_active_low, sum);
        if let Some(enable) = self.draft.enables.get(&id) {
            cell.enable = self.control(&signal.name, enable);
            let is_always = cell.enable.as_ref().is_some_and(|product| product.0.is_empty());
            if is_always && kind != CellKind::Tristate {
                cell.enable = None;
            } else if kind == CellKind::Combinational {
                cell.kind = CellKind::Tristate;
            } else if kind == CellKind::Registered && device.power_up == PowerUp::PinsHigh {
                let own = device.control_pins.iter().any(|pin| {
                    cell.enable.as_ref().is_some_and(|product| product.0 == [(*pin, false)])
                });
                if !own {
                    let message = format!(
                        "the registers of a {} are enabled by a pin, so `{}` cannot have its own condition",
                        device.name, signal.name
                    );
                    self.refuse(message, enable.span);
                }
                cell.enable = None;
            }
        }
        if let Some(clock) = self.draft.clocks.get(&id).filter(|_| definition.is_registered) {
            let product = self.control(&signal.name, clock);
            match device.clock {
                Clock::Term => cell.clock = product,
                Clock::None => {
                    let message =
                        format!("a {} has no flip-flop for `{}`", device.name, signal.name);
                    self.refuse(message, clock.span);
                }
                Clock::Pin(pin) => {
                    if product.is_some_and(|product| product.0 != [(pin, true)]) {
                        let message = format!(
                            "the registers of a {} are clocked by pin {pin}, so `{}` cannot have another clock",
                            device.name, signal.name
                        );
                        self.refuse(message, clock.span);
                    }
                }
            }
        }
        if device.clock == Clock::Term {
            for (to, place) in [(true, &mut cell.set), (false, &mut cell.reset)] {
                if let Some(condition) = self.draft.controls.get(&(Some(id), to)) {
                    *place = self.control(&signal.name, condition);
                }
            }
        }
        Some(cell)
    }

    /// Finds set and reset of all registers together, if the device has them: written once, or the same for each register.
    fn global(&mut self, placement: &mut Placement) {
        let device = self.device;
        for to in [true, false] {
            let what = if to { "set" } else { "reset" };
            let mut wanted: Option<Product> = None;
            let mut is_one = true;
            if let Some(condition) = self.draft.controls.get(&(None, to)) {
                wanted = self.control(what, condition);
                if !device.has_global_reset {
                    let message =
                        format!("a {} has no {what} for all registers together", device.name);
                    self.refuse(message, condition.span);
                }
            }
            if device.clock == Clock::Term {
                continue;
            }
            let registers: Vec<(SignalId, Definition, String)> = (0..SignalId::MAX)
                .zip(&self.draft.signals)
                .filter_map(|(id, signal)| {
                    let definition = signal.definition.filter(|own| own.is_registered)?;
                    Some((id, definition, signal.name.clone()))
                })
                .collect();
            let own = |id: SignalId| self.draft.controls.get(&(Some(id), to)).copied();
            let Some(first) = registers.iter().find_map(|(id, _, _)| own(*id)) else {
                placement_control(placement, to, wanted);
                continue;
            };
            if !device.has_global_reset {
                let message = format!("the registers of a {} have no {what}", device.name);
                self.refuse(message, first.span);
                continue;
            }
            for (id, definition, name) in &registers {
                let Some(condition) = own(*id) else {
                    let message = format!(
                        "`{name}` has no {what}, but a {} has only one for all registers",
                        device.name
                    );
                    self.refuse(message, definition.span);
                    continue;
                };
                let product = self.control(name, &condition);
                is_one &= wanted.is_none() || product == wanted;
                wanted = wanted.or(product);
            }
            if !is_one {
                let message = format!(
                    "the registers have different {what} conditions, but a {} has only one for all",
                    device.name
                );
                self.refuse(message, first.span);
            }
            placement_control(placement, to, wanted);
        }
    }

    /// The one product of a control.
    fn control(&mut self, name: &str, definition: &Definition) -> Option<Product> {
        let mut products = self.sum(name, definition)?;
        match (products.pop(), products.len()) {
            (None, _) => Some(never(self.device)),
            (only, 0) => only,
            (Some(_), more) => {
                let message = format!(
                    "this control of `{name}` has {} product terms; the device supports one",
                    more + 1
                );
                self.refuse(message, definition.span);
                None
            }
        }
    }

    fn sum(&mut self, name: &str, definition: &Definition) -> Option<Vec<Product>> {
        let before = self.found.len();
        if let Some(plain) = self.plain(definition.sum) {
            return Some(plain);
        }
        match self.multiply(definition.sum, true, 0) {
            Some(sum) => Some(sum.into_iter().map(Product).collect()),
            None => {
                if self.found.len() == before {
                    let message = format!(
                        "`{name}` has more than {MAX_PRODUCTS} products when it is multiplied out"
                    );
                    self.refuse(message, definition.span);
                }
                None
            }
        }
    }

    /// The level at the pin for which a literal is true; `None` for an intermediate name or a signal without a pin.
    fn level(&self, signal: SignalId, is_positive: bool) -> Option<(u32, bool)> {
        let signal = &self.draft.signals[signal as usize];
        Some((signal.pin?, is_positive != signal.is_pin_inverted))
    }

    /// A plain sum of products over pins, exactly as written.
    fn plain(&self, sum: ExprId) -> Option<Vec<Product>> {
        let terms = match self.draft.kind(sum) {
            Expr::Const(false) => return Some(Vec::new()),
            Expr::Const(true) => return Some(vec![Product::default()]),
            Expr::Or(start, count) => self.draft.operands(start, count),
            Expr::Signal(_) | Expr::Not(_) | Expr::And(..) => std::slice::from_ref(&sum),
            Expr::Xor(..) | Expr::Mux(..) => return None,
        };
        terms.iter().map(|term| self.plain_product(*term)).collect()
    }

    fn plain_product(&self, term: ExprId) -> Option<Product> {
        let literals = match self.draft.kind(term) {
            Expr::And(start, count) => self.draft.operands(start, count),
            Expr::Signal(_) | Expr::Not(_) => std::slice::from_ref(&term),
            Expr::Const(_) | Expr::Or(..) | Expr::Xor(..) | Expr::Mux(..) => return None,
        };
        let literal = |expr: &ExprId| match self.draft.kind(*expr) {
            Expr::Signal(signal) => self.level(signal, true),
            Expr::Not(inner) => match self.draft.kind(inner) {
                Expr::Signal(signal) => self.level(signal, false),
                _ => None,
            },
            Expr::Const(_) | Expr::And(..) | Expr::Or(..) | Expr::Xor(..) | Expr::Mux(..) => None,
        };
        Some(Product(literals.iter().map(literal).collect::<Option<_>>()?))
    }

    /// The function or its complement multiplied out; `None` if it is too large or too deep, or reads a signal without a pin (which is reported).
    fn multiply(&mut self, expr: ExprId, is_positive: bool, depth: u32) -> Option<Sum> {
        self.work += 1;
        if depth > MAX_DEPTH || self.work > MAX_WORK {
            return None;
        }
        let depth = depth + 1;
        match self.draft.kind(expr) {
            Expr::Const(value) => {
                Some(if value == is_positive { vec![Vec::new()] } else { Vec::new() })
            }
            Expr::Not(inner) => self.multiply(inner, !is_positive, depth),
            Expr::Signal(signal) => {
                if let Some(level) = self.level(signal, is_positive) {
                    return Some(vec![vec![level]]);
                }
                let signal = &self.draft.signals[signal as usize];
                match signal.definition {
                    Some(inner) if signal.role == Role::Internal && !inner.is_registered => {
                        self.multiply(inner.value, is_positive, depth)
                    }
                    Some(_) | None => {
                        let message = format!("`{}` is read but has no pin", signal.name);
                        let span = signal.span;
                        self.refuse(message, span);
                        None
                    }
                }
            }
            Expr::And(start, count) | Expr::Or(start, count) => {
                let is_and = matches!(self.draft.kind(expr), Expr::And(..)) == is_positive;
                let operands: Vec<ExprId> = self.draft.operands(start, count).to_vec();
                let mut sum: Sum = if is_and { vec![Vec::new()] } else { Vec::new() };
                for operand in operands {
                    let other = self.multiply(operand, is_positive, depth)?;
                    sum = if is_and { self.and(&sum, &other)? } else { self.or(sum, other)? };
                }
                Some(sum)
            }
            Expr::Xor(a, b) => {
                let (both, neither) = (is_positive, !is_positive);
                let first = (self.multiply(a, true, depth)?, self.multiply(b, neither, depth)?);
                let second = (self.multiply(a, false, depth)?, self.multiply(b, both, depth)?);
                let first = self.and(&first.0, &first.1)?;
                let second = self.and(&second.0, &second.1)?;
                self.or(first, second)
            }
            Expr::Mux(condition, then, otherwise) => {
                let on = self.multiply(condition, true, depth)?;
                let off = self.multiply(condition, false, depth)?;
                let then = self.multiply(then, is_positive, depth)?;
                let otherwise = self.multiply(otherwise, is_positive, depth)?;
                let (on, off) = (self.and(&on, &then)?, self.and(&off, &otherwise)?);
                self.or(on, off)
            }
        }
    }

    fn and(&mut self, left: &Sum, right: &Sum) -> Option<Sum> {
        let mut sum = Vec::new();
        for a in left {
            for b in right {
                self.work += 1;
                if self.work > MAX_WORK {
                    return None;
                }
                let clash = b.iter().any(|(pin, level)| a.contains(&(*pin, !level)));
                if clash {
                    continue;
                }
                let mut product = a.clone();
                product.extend(b.iter().filter(|literal| !a.contains(literal)));
                sum.push(product);
                if sum.len() > MAX_PRODUCTS {
                    return None;
                }
            }
        }
        Some(sum)
    }

    fn or(&mut self, mut left: Sum, right: Sum) -> Option<Sum> {
        let is_same = |a: &[(u32, bool)], b: &[(u32, bool)]| {
            a.len() == b.len() && a.iter().all(|literal| b.contains(literal))
        };
        for product in right {
            self.work += left.len();
            if !left.iter().any(|known| is_same(known, &product)) {
                left.push(product);
            }
        }
        (left.len() <= MAX_PRODUCTS && self.work <= MAX_WORK).then_some(left)
    }
}

fn placement_control(placement: &mut Placement, to: bool, product: Option<Product>) {
    let place = if to { &mut placement.sync_preset } else { &mut placement.async_reset };
    *place = product;
}

/// A product that is never true.
fn never(device: &Device) -> Product {
    Product(device.inputs.first().map(|pin| vec![(*pin, true), (*pin, false)]).unwrap_or_default())
}
