//! Equations: a circuit with all decisions taken that a PAL needs, ready to be printed in any of the equation languages.
//!
//! # Power-up
//! All internal flip-flops of these devices wake at 0. What the *signal* is then depends on the device ([`crate::device::PowerUp`]), so the form of
//! each registered equation follows from the signal's first value:
//!
//! ```text
//!                      first value 0          first value 1
//! gal22v10, gal20ra10  P2 := ..               /P1 := ..               the equation's polarity decides
//! gal16v8, gal20v8     pin carries /P2        pin carries P1          the pin's polarity decides, the equation takes the shorter form
//! ```

use crate::codes;
use crate::device::{Clock, Device, Polarity, PowerUp};
use crate::{Dialect, EmitOptions, Named, Object};
use grafsynth_ir::arena::IdMap;
use grafsynth_ir::diag::{Diagnostic, nearest};
use grafsynth_ir::logic::{
    Flop, FlopId, Logic, NodeId, PinInput, PinInputId, PinOutput, PinOutputId, PinRole,
};
use grafsynth_ir::names::{CUPL, GALASM, Namer, PALASM, PALASM_CHIP};
use grafsynth_ir::net::Meta;
use grafsynth_logic::minimise::{Budget, Product, Refused, sum_of_products};
use grafsynth_logic::support::Var;

/// Names a signal of [`Equations`].
pub type SignalIndex = usize;

/// A whole design.
#[derive(Debug)]
pub struct Equations {
    /// The chart's name, fit for the language.
    pub title: String,
    /// The device.
    pub device: &'static Device,
    /// Comment lines for the head.
    pub head: Vec<String>,
    /// All signals: the clock, inputs, flip-flops, outputs.
    pub signals: Vec<Signal>,
    /// One for each flip-flop and output.
    pub equations: Vec<Equation>,
    /// Pins are numbered.
    pub has_pins: bool,
}

/// Something with a name, and with a pin where the design fits.
#[derive(Debug)]
pub struct Signal {
    /// Its name in the text.
    pub name: String,
    /// What it stands for.
    pub source: Source,
    /// Its pin.
    pub pin: Option<u32>,
    /// The pin carries the complement.
    pub is_pin_inverted: bool,
    /// Label, tags and place.
    pub meta: Meta,
}

/// What a [`Signal`] stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// The clock.
    Clock,
    /// An input bit.
    Input(PinInputId),
    /// A flip-flop.
    Flop(FlopId),
    /// An output.
    Output(PinOutputId),
}

/// The function of a signal.
#[derive(Debug)]
pub struct Equation {
    /// The signal.
    pub signal: SignalIndex,
    /// The sum gives the signal's complement.
    pub is_complemented: bool,
    /// Clocked.
    pub is_registered: bool,
    /// Sum of products; a product without literals is always true.
    pub products: Vec<Vec<(SignalIndex, bool)>>,
}

/// A sum in the polarity it is printed in.
struct Form {
    is_complemented: bool,
    is_pin_inverted: bool,
    products: Vec<Product>,
}

impl Equations {
    /// Takes all decisions.
    ///
    /// # Errors
    /// Sums over budget, power-up values that the device cannot give, pins that do not exist, and, where the language needs pin numbers, a design that
    /// does not fit.
    pub fn new(
        logic: &Logic,
        dialect: Dialect,
        options: &EmitOptions,
    ) -> Result<Self, Vec<Diagnostic>> {
        let mut findings = Vec::new();
        let device = find_device(options, &mut findings);
        let target = match dialect {
            Dialect::Palasm => &PALASM,
            Dialect::Cupl => &CUPL,
            Dialect::Galasm | Dialect::Verilog | Dialect::Blif => &GALASM,
        };
        let mut signals = name_signals(logic, &mut Namer::new(target));
        let place =
            |source: Source| signals.iter().position(|signal| signal.source == source).unwrap_or(0);
        // Signals lie in the order of their kinds, so the first of a kind gives the place of all.
        let first_input = logic.inputs.ids().next().map_or(0, |id| place(Source::Input(id)));
        let first_output = logic.outputs.ids().next().map_or(0, |id| place(Source::Output(id)));
        let first_flop = logic.flops.ids().next().map_or(0, |id| place(Source::Flop(id)));
        let inputs = IdMap::build(&logic.inputs, |id, _| first_input + id.index());
        let outputs = IdMap::build(&logic.outputs, |id, _| first_output + id.index());
        let flops = IdMap::build(&logic.flops, |id, _| first_flop + id.index());

        let mut equations = Vec::new();
        let mut large = Vec::new();
        let budget = options.budget;
        let forms = FormChoice { logic, device, budget, dont_cares: options.dont_cares };
        for (id, flop) in logic.flops.iter() {
            match forms.registered(flop.next, flop.init) {
                Ok(form) => {
                    equations.push(equation(&mut signals, flops[id], true, form, &inputs, &flops))
                }
                Err(why) => large.push(TooLarge {
                    kind: "flip-flop",
                    name: &flop.name,
                    meta: &flop.meta,
                    why,
                }),
            }
        }
        for (id, output) in logic.outputs.iter() {
            let form = match output.registered {
                Some(init) => {
                    if device.power_up == PowerUp::PinsHigh && !init {
                        findings.push(wakes_high(device, output));
                        continue;
                    }
                    forms.registered(output.value, init)
                }
                None => forms.combinational(output.value),
            };
            let is_clocked = output.registered.is_some();
            match form {
                Ok(form) => equations.push(equation(
                    &mut signals,
                    outputs[id],
                    is_clocked,
                    form,
                    &inputs,
                    &flops,
                )),
                Err(why) => large.push(TooLarge {
                    kind: "output",
                    name: &output.name,
                    meta: &output.meta,
                    why,
                }),
            }
        }
        if !large.is_empty() {
            findings.push(too_large(&large));
        }
        if !findings.is_empty() {
            return Err(findings);
        }
        let mut result = Equations {
            title: Namer::new(&PALASM_CHIP).name(&logic.name.text),
            device,
            head: Vec::new(),
            signals,
            equations,
            has_pins: false,
        };
        let misfit = result.assign_pins(logic, options, &mut findings);
        if let (Some(misfit), Dialect::Galasm) = (&misfit, dialect) {
            findings.push(misfit.diagnostic(logic, device));
        }
        if !findings.is_empty() {
            return Err(findings);
        }
        result.head = head(logic, dialect, options, device, misfit.as_ref());
        Ok(result)
    }

    /// The names for [`crate::Emitted`].
    #[must_use]
    pub fn named(&self, logic: &Logic) -> Vec<Named> {
        self.signals
            .iter()
            .map(|signal| {
                let object = match signal.source {
                    Source::Clock => Object::Clock,
                    Source::Input(id) => Object::Input(logic.inputs[id].clone()),
                    Source::Flop(id) => Object::Flop(logic.flops[id].clone()),
                    Source::Output(id) => Object::Output(logic.outputs[id].clone()),
                };
                Named { name: signal.name.clone(), pin: signal.pin, object }
            })
            .collect()
    }

    /// The clock's signal.
    #[must_use]
    pub fn clock(&self) -> Option<&Signal> {
        self.signals.iter().find(|signal| signal.source == Source::Clock)
    }

    /// Numbers the pins; gives the reason where the design does not fit. Impossible wishes of the board are findings.
    fn assign_pins(
        &mut self,
        logic: &Logic,
        options: &EmitOptions,
        findings: &mut Vec<Diagnostic>,
    ) -> Option<Misfit> {
        let device = self.device;
        let mut free: Vec<u32> = (1..=device.n_pins)
            .filter(|pin| *pin != device.gnd() && *pin != device.n_pins)
            .collect();
        let mut needs: Vec<(SignalIndex, Need)> = Vec::new();
        let mut equation_of: Vec<Option<&Equation>> = vec![None; self.signals.len()];
        for equation in &self.equations {
            equation_of[equation.signal] = Some(equation);
        }
        for (index, signal) in self.signals.iter().enumerate() {
            needs.push((
                index,
                match (signal.source, equation_of[index]) {
                    (Source::Clock, _) => Need::Clock,
                    (_, Some(equation)) => Need::Macrocell {
                        terms: equation.products.len(),
                        is_registered: equation.is_registered,
                    },
                    (Source::Input(_) | Source::Flop(_) | Source::Output(_), None) => Need::Input,
                },
            ));
        }
        let has_registers = self.equations.iter().any(|equation| equation.is_registered);
        let before = findings.len();
        for (name, pin) in &options.pins {
            let Some(index) = self.find_source(logic, name) else {
                let known = self.signals.iter().map(|signal| source_name(logic, signal.source));
                let mut finding = Diagnostic::error(
                    codes::BAD_PIN,
                    format!(
                        "the board gives pin {pin} to `{name}`, and the circuit has no such signal"
                    ),
                );
                if let Some(near) = nearest(name, known) {
                    finding = finding.help(format!("did you mean `{near}`?"));
                }
                findings.push(finding);
                continue;
            };
            let need = needs[index].1;
            if let Some(other) = self.signals.iter().find(|signal| signal.pin == Some(*pin)) {
                let message = format!(
                    "pin {pin} is given to `{}` and to `{name}`",
                    source_name(logic, other.source)
                );
                findings.push(
                    Diagnostic::error(codes::BAD_PIN, message)
                        .help("give each signal a pin of its own"),
                );
            } else if let Some(reason) = need.refuses(device, has_registers, *pin) {
                let message =
                    format!("pin {pin} of a {} cannot be `{name}`: {reason}", device.name);
                findings.push(
                    Diagnostic::error(codes::BAD_PIN, message)
                        .help(format!("possible pins: {}", need.possible(device, has_registers))),
                );
            } else {
                free.retain(|other| other != pin);
                self.signals[index].pin = Some(*pin);
            }
        }
        if findings.len() > before {
            return None;
        }
        // The widest sums choose first and take the narrowest macrocell that holds them; inputs take what only inputs can use.
        needs.retain(|(index, _)| self.signals[*index].pin.is_none());
        needs.sort_by_key(|(index, need)| match need {
            Need::Clock => (0, 0, *index),
            Need::Macrocell { terms, .. } => (1, usize::MAX - terms, *index),
            Need::Input => (2, 0, *index),
        });
        let mut misfit = Misfit::default();
        for (index, need) in needs {
            let best = free
                .iter()
                .copied()
                .filter(|pin| need.refuses(device, has_registers, *pin).is_none());
            let rank = |pin: &u32| match (need, device.macrocell(*pin)) {
                (Need::Macrocell { .. }, Some(cell)) => {
                    (cell.registered_terms.max(cell.combinational_terms), *pin)
                }
                (Need::Macrocell { .. } | Need::Input | Need::Clock, None) => (0, *pin),
                (Need::Input | Need::Clock, Some(_)) => {
                    (u32::from(device.deaf_pins.contains(pin)) + 1, *pin)
                }
            };
            match best.min_by_key(rank) {
                Some(pin) => {
                    free.retain(|other| *other != pin);
                    self.signals[index].pin = Some(pin);
                }
                None => misfit.note(need, &self.signals[index], device),
            }
        }
        if misfit.is_none() {
            self.has_pins = true;
            return None;
        }
        for signal in &mut self.signals {
            signal.pin = options
                .pins
                .iter()
                .find(|(name, _)| source_matches(logic, signal.source, name))
                .map(|(_, pin)| *pin);
        }
        Some(misfit)
    }

    fn find_source(&self, logic: &Logic, name: &str) -> Option<SignalIndex> {
        self.signals.iter().position(|signal| source_matches(logic, signal.source, name))
    }
}

/// All signals with their names. Pins are named before flip-flops (a board's drawing shows them), the clock last (nobody chose its name).
fn name_signals(logic: &Logic, namer: &mut Namer) -> Vec<Signal> {
    let inputs = logic
        .inputs
        .iter()
        .map(|(id, input)| (input.name.as_str(), Source::Input(id), &input.meta));
    let outputs = logic
        .outputs
        .iter()
        .map(|(id, output)| (output.name.as_str(), Source::Output(id), &output.meta));
    let pins: Vec<_> = inputs.chain(outputs).collect();
    let signal = |name, source, meta: &Meta| Signal {
        name,
        source,
        pin: None,
        is_pin_inverted: false,
        meta: meta.clone(),
    };
    let names = namer.assign(pins.iter().map(|pin| pin.0));
    let mut signals: Vec<Signal> = names
        .into_iter()
        .zip(pins)
        .map(|(name, (_, source, meta))| signal(name, source, meta))
        .collect();
    for (id, flop) in logic.flops.iter() {
        signals.push(signal(register_name(namer, &flop.name), Source::Flop(id), &flop.meta));
    }
    if !logic.flops.is_empty() || logic.outputs.values().any(|output| output.registered.is_some()) {
        signals.insert(0, signal(namer.name("clk"), Source::Clock, &Meta::default()));
    }
    signals
}

/// A stored output and its memory have one name in the chart; the memory then ends in `q`.
pub(crate) fn register_name(namer: &mut Namer, name: &str) -> String {
    if namer.is_taken(name) { namer.name_with_suffix(name, "_q") } else { namer.name(name) }
}

fn source_name(logic: &Logic, source: Source) -> &str {
    match source {
        Source::Clock => "clock",
        Source::Input(id) => &logic.inputs[id].name,
        Source::Flop(id) => &logic.flops[id].name,
        Source::Output(id) => &logic.outputs[id].name,
    }
}

fn source_matches(logic: &Logic, source: Source, name: &str) -> bool {
    (source == Source::Clock && name == "clk") || source_name(logic, source) == name
}

fn find_device(options: &EmitOptions, findings: &mut Vec<Diagnostic>) -> &'static Device {
    let Some(name) = &options.device else { return Device::default_device() };
    Device::find(name).unwrap_or_else(|| {
        let mut finding =
            Diagnostic::error(codes::UNKNOWN_DEVICE, format!("the device `{name}` is not known"));
        let known: Vec<&str> = crate::device::DEVICES.iter().map(|device| device.name).collect();
        finding = finding.help(match nearest(name, Device::names()) {
            Some(near) => format!("did you mean `{near}`? known are {}", known.join(", ")),
            None => format!("known are {}", known.join(", ")),
        });
        findings.push(finding);
        Device::default_device()
    })
}

/// Which polarity a sum is printed in.
struct FormChoice<'a> {
    logic: &'a Logic,
    device: &'static Device,
    budget: Budget,
    dont_cares: bool,
}

impl FormChoice<'_> {
    fn sum(&self, node: NodeId, is_complemented: bool) -> Result<Vec<Product>, Refused> {
        sum_of_products(self.logic, node, is_complemented, self.dont_cares, self.budget)
    }

    fn registered(&self, node: NodeId, init: bool) -> Result<Form, Refused> {
        match self.device.power_up {
            PowerUp::ByPolarity => Ok(Form {
                is_complemented: init,
                is_pin_inverted: false,
                products: self.sum(node, init)?,
            }),
            // The pin is high at first; where its polarity is fixed, that of the sum is too.
            PowerUp::PinsHigh => match self.device.polarity {
                Polarity::Programmable => {
                    Ok(Form { is_pin_inverted: !init, ..self.combinational(node)? })
                }
                Polarity::ActiveLow => Ok(Form {
                    is_complemented: init,
                    is_pin_inverted: !init,
                    products: self.sum(node, init)?,
                }),
                Polarity::ActiveHigh => Ok(Form {
                    is_complemented: !init,
                    is_pin_inverted: !init,
                    products: self.sum(node, !init)?,
                }),
            },
        }
    }

    /// The shorter of both; the signal itself where they are equal.
    fn combinational(&self, node: NodeId) -> Result<Form, Refused> {
        let fixed = match self.device.polarity {
            Polarity::Programmable => None,
            Polarity::ActiveLow => Some(true),
            Polarity::ActiveHigh => Some(false),
        };
        if let Some(is_complemented) = fixed {
            let products = self.sum(node, is_complemented)?;
            return Ok(Form { is_complemented, is_pin_inverted: false, products });
        }
        let cost =
            |products: &[Product]| (products.len(), products.iter().map(Vec::len).sum::<usize>());
        let plain = self.sum(node, false);
        if let Ok(products) = &plain
            && products.len() <= 1
        {
            return plain.map(|products| Form {
                is_complemented: false,
                is_pin_inverted: false,
                products,
            });
        }
        match (plain, self.sum(node, true)) {
            (Ok(plain), Ok(complement)) if cost(&complement) >= cost(&plain) => {
                Ok(Form { is_complemented: false, is_pin_inverted: false, products: plain })
            }
            (Ok(_) | Err(_), Ok(complement)) => {
                Ok(Form { is_complemented: true, is_pin_inverted: false, products: complement })
            }
            (Ok(plain), Err(_)) => {
                Ok(Form { is_complemented: false, is_pin_inverted: false, products: plain })
            }
            (Err(refused), Err(_)) => Err(refused),
        }
    }
}

fn equation(
    signals: &mut [Signal],
    signal: SignalIndex,
    is_registered: bool,
    form: Form,
    inputs: &IdMap<PinInput, SignalIndex>,
    flops: &IdMap<Flop, SignalIndex>,
) -> Equation {
    signals[signal].is_pin_inverted = form.is_pin_inverted;
    let index = |var: Var| match var {
        Var::Input(id) => inputs[id],
        Var::Flop(id) => flops[id],
    };
    let products = form
        .products
        .into_iter()
        .map(|product| product.into_iter().map(|(var, value)| (index(var), value)).collect());
    Equation {
        signal,
        is_complemented: form.is_complemented,
        is_registered,
        products: products.collect(),
    }
}

/// A function without a sum of products.
struct TooLarge<'a> {
    kind: &'static str,
    name: &'a str,
    meta: &'a Meta,
    why: Refused,
}

/// All functions that are too large, in one finding: they mostly have one cause.
fn too_large(all: &[TooLarge<'_>]) -> Diagnostic {
    const SHOWN: usize = 6;
    let mut names: Vec<String> = all
        .iter()
        .take(SHOWN)
        .map(|one| format!("{} `{}` ({})", one.kind, one.name, one.why))
        .collect();
    if all.len() > SHOWN {
        names.push(format!("and {} more", all.len() - SHOWN));
    }
    let functions = if all.len() == 1 {
        "1 function is".to_owned()
    } else {
        format!("{} functions are", all.len())
    };
    let mut finding = Diagnostic::error(
        codes::TOO_MANY_PRODUCTS,
        format!("{functions} too large for a sum of products: {}", names.join(", ")),
    );
    let mut spans: Vec<grafsynth_ir::Span> = Vec::new();
    for one in all {
        if !spans.contains(&one.meta.span) && spans.len() < SHOWN {
            spans.push(one.meta.span);
            finding = finding.at(one.meta.span, "declared here");
        }
    }
    finding.help("build for `verilog` or `blif`, which keep functions factored, or narrow the ranges these functions are computed from")
}

fn wakes_high(device: &Device, output: &PinOutput) -> Diagnostic {
    let message = format!(
        "output `{}` must be 0 after power-up, and every registered pin of a {} is high then, whatever its polarity",
        output.name, device.name
    );
    Diagnostic::error(codes::POWER_UP, message)
        .at(output.meta.span, "registered output")
        .help("make the output combinational, or take a gal22v10, whose pins wake by polarity")
}

/// What a signal needs of a pin.
#[derive(Debug, Clone, Copy)]
enum Need {
    Clock,
    Input,
    Macrocell { terms: usize, is_registered: bool },
}

impl Need {
    /// Why this pin will not do.
    fn refuses(self, device: &Device, has_registers: bool, pin: u32) -> Option<String> {
        if pin == 0 || pin > device.n_pins {
            return Some(format!("it has {} pins", device.n_pins));
        }
        if pin == device.gnd() || pin == device.n_pins {
            return Some("it is a supply pin".to_owned());
        }
        let is_clock_pin = device.clock == Clock::Pin(pin);
        let is_reserved = device.control_pins.contains(&pin)
            && (has_registers || !device.free_when_combinational);
        match self {
            Need::Clock => match device.clock {
                Clock::Pin(own) => (own != pin).then(|| format!("its clock is pin {own}")),
                Clock::Term => is_reserved.then(|| "it controls all outputs".to_owned()),
                Clock::None => Some("the device has no flip-flops".to_owned()),
            },
            Need::Input if is_reserved => Some("it controls all registered outputs".to_owned()),
            Need::Input => (is_clock_pin && has_registers).then(|| "it is the clock".to_owned()),
            Need::Macrocell { terms, is_registered } => match device.macrocell(pin) {
                None => Some("it has no output macrocell".to_owned()),
                Some(cell) => {
                    let limit = if is_registered {
                        cell.registered_terms
                    } else {
                        cell.combinational_terms
                    };
                    if limit == 0 {
                        let has = if is_registered { "no flip-flop" } else { "always a flip-flop" };
                        return Some(format!("its macrocell has {has}"));
                    }
                    (terms > limit as usize).then(|| {
                        format!("the function has {terms} product terms, the macrocell {limit}")
                    })
                }
            },
        }
    }

    fn possible(self, device: &Device, has_registers: bool) -> String {
        let pins: Vec<String> = (1..=device.n_pins)
            .filter(|pin| self.refuses(device, has_registers, *pin).is_none())
            .map(|pin| pin.to_string())
            .collect();
        if pins.is_empty() { "none".to_owned() } else { pins.join(", ") }
    }
}

/// What a device lacks.
#[derive(Debug, Default)]
struct Misfit {
    inputs: usize,
    macrocells: usize,
    /// Signals whose sums are wider than any macrocell: name, terms, place.
    wide: Vec<(String, usize, Meta)>,
}

impl Misfit {
    fn is_none(&self) -> bool {
        self.inputs + self.macrocells == 0 && self.wide.is_empty()
    }

    fn note(&mut self, need: Need, signal: &Signal, device: &Device) {
        match need {
            Need::Clock | Need::Input => self.inputs += 1,
            Need::Macrocell { terms, .. } if terms > widest(device) => {
                self.wide.push((signal.name.clone(), terms, signal.meta.clone()));
            }
            Need::Macrocell { .. } => self.macrocells += 1,
        }
    }

    fn parts(&self, device: &Device) -> Vec<String> {
        let mut parts = Vec::new();
        if self.macrocells > 0 {
            parts.push(format!(
                "{} of its registers and outputs find no macrocell",
                self.macrocells
            ));
        }
        if self.inputs > 0 {
            parts.push(format!("{} of its inputs find no pin", self.inputs));
        }
        for (name, terms, _) in &self.wide {
            parts.push(format!(
                "`{name}` needs {terms} product terms and the largest macrocell has {}",
                widest(device)
            ));
        }
        parts
    }

    fn diagnostic(&self, logic: &Logic, device: &Device) -> Diagnostic {
        let message = format!(
            "`{}` does not fit one {}: {}",
            logic.name,
            device.name,
            self.parts(device).join("; ")
        );
        let mut finding =
            Diagnostic::error(codes::DOES_NOT_FIT, message).at(logic.name.span, "this chart");
        for (_, _, meta) in &self.wide {
            finding = finding.at(meta.span, "too wide");
        }
        finding.help("take a larger device, split the chart, or build for `palasm` or `cupl`, which leave pins open")
    }
}

fn widest(device: &Device) -> usize {
    let terms =
        |cell: &crate::device::Macrocell| cell.registered_terms.max(cell.combinational_terms);
    device.macrocells.iter().map(terms).max().unwrap_or(0) as usize
}

/// The comment at the head.
/// A line for the head of a circuit whose reactions may take several clocks.
pub(crate) fn busy_note(logic: &Logic) -> Option<String> {
    let busy = logic.outputs.values().find(|output| output.role == PinRole::Busy)?;
    Some(format!(
        "one micro-step a clock: inputs are taken on a clock with {0} low, outputs hold until {0} is low again",
        busy.name
    ))
}

fn head(
    logic: &Logic,
    dialect: Dialect,
    options: &EmitOptions,
    device: &Device,
    misfit: Option<&Misfit>,
) -> Vec<String> {
    let mut head = vec![
        format!(
            "{} - equations made by grafsynth {}",
            one_line(&logic.name.text),
            env!("CARGO_PKG_VERSION")
        ),
        match &options.device {
            Some(_) => format!("device {}", device.name),
            None => format!("device {} (none was named)", device.name),
        },
    ];
    head.push(match device.power_up {
        PowerUp::ByPolarity => "power-up: a register written as /x := .. wakes with x true, one written as x := .. with x false".to_owned(),
        PowerUp::PinsHigh => "power-up: every registered pin wakes high, so what is false at the start lies on its pin inverted".to_owned(),
    });
    if let Some(misfit) = misfit {
        head.push(format!(
            "does not fit one {}, so pins are left open: {}",
            device.name,
            misfit.parts(device).join("; ")
        ));
    }
    if logic.outputs.values().any(|output| output.mealy) {
        head.push("mealy outputs are valid just before the clock".to_owned());
    }
    head.extend(busy_note(logic));
    if options.dont_cares && !logic.never.is_empty() {
        head.push("the equations rely on what the chart assumes of its inputs".to_owned());
    }
    if dialect == Dialect::Galasm {
        head.push("the pins are numbered left to right, first row then second".to_owned());
    }
    head.extend(options.notes.iter().map(|note| one_line(note)));
    head
}

/// A text fit for a comment of one line in every language here.
pub(crate) fn one_line(text: &str) -> String {
    let text: String = text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    text.replace("*/", "* /")
}

/// Label and tags of something, as a comment; empty if there are none.
pub(crate) fn remark(meta: &Meta) -> String {
    let mut parts = Vec::new();
    if !meta.label.is_empty() {
        parts.push(one_line(&meta.label));
    }
    if !meta.req.is_empty() {
        parts.push(format!("[{}]", one_line(&meta.req.join(", "))));
    }
    parts.join(" ")
}
