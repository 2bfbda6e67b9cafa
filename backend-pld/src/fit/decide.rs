//! All decisions for a circuit on a device: names, forms of the sums, parts of wide ones, shared macrocells, pins. The order is that of [`Equations::new`].

use crate::codes;
use crate::device::{Device, FlipFlop, PowerUp};
use crate::equations::{
    CLOCK_NAMES, Equation, Equations, Signal, SignalIndex, Source, busy_note, one_line,
    register_name,
};
use crate::fit::count;
use crate::fit::exclusive::Exclusive;
use crate::fit::form::{Form, FormChoice};
use crate::fit::misfit::{self, Misfit};
use crate::fit::need::widest;
use crate::{Dialect, EmitOptions};
use grafsynth_ir::Gather;
use grafsynth_ir::diag::{Diagnostic, nearest_type};
use grafsynth_ir::logic::{Logic, NodeId, PinInputId, PinOutput};
use grafsynth_ir::names::{CUPL, GALASM, Namer, PALASM, PALASM_CHIP};
use grafsynth_ir::net::Meta;
use grafsynth_logic::minimise::{Budget, Refused};
use grafsynth_logic::node_bdds::Var;
use grafsynth_logic::split::{Split, Wide, split};
use std::collections::BTreeMap;

/// In a design that cannot fit, the number of functions whose decision diagrams may reach the full node limit before the functions are cut. For the later ones,
/// the limit is [`NODES_IF_REFUSED`]: a design with hundreds of them would otherwise take minutes for sums that no device holds.
const MOST_REFUSED: usize = 4;
/// The maximum number of nodes for the diagrams of those later functions.
const NODES_IF_REFUSED: usize = 1 << 10;

impl Equations {
    /// Makes all decisions.
    ///
    /// # Errors
    /// Returns findings about sums over budget, power-up values that the device cannot provide, pins that do not exist, and, if the language needs pin numbers,
    /// a design that does not fit.
    pub fn new(
        logic: &Logic,
        dialect: Dialect,
        options: &EmitOptions,
    ) -> Result<Self, Vec<Diagnostic>> {
        Self::decide(logic, dialect, options, dialect == Dialect::Galasm)
    }

    /// Like [`Equations::new`], but a design that does not fit keeps its equations, without pins, in every language: [`Equations::lacks`] says why.
    ///
    /// # Errors
    /// Like [`Equations::new`], except that a design that does not fit is not an error.
    pub fn open(
        logic: &Logic,
        dialect: Dialect,
        options: &EmitOptions,
    ) -> Result<Self, Vec<Diagnostic>> {
        Self::decide(logic, dialect, options, false)
    }

    /// True if [`Equations::new`] makes the same equations for this language, which may need a pin for each signal.
    pub(crate) fn is_enough_for(&self, dialect: Dialect) -> bool {
        dialect != Dialect::Galasm || self.has_pins && self.device.layout.is_some()
    }

    fn decide(
        logic: &Logic,
        dialect: Dialect,
        options: &EmitOptions,
        needs_pins: bool,
    ) -> Result<Self, Vec<Diagnostic>> {
        let mut findings = Vec::new();
        let device = find_device(options, &mut findings);
        if needs_pins && device.layout.is_none() {
            // A text in this language only serves to make a fuse map, so a device without a known fuse map is refused.
            findings.push(crate::fuse::no_map(device));
        }
        let mut signals = Signals::of(logic, dialect);
        let functions = functions(logic, device, &mut findings);
        if !findings.is_empty() {
            return Err(findings);
        }
        // A design that cannot fit is rejected before it is minimised; a text that leaves pins open still gets sums, but without proofs of their minimality.
        let lack = count::lacks(logic, device, options);
        let is_refused = lack.is_some() && needs_pins;
        if let Some(lack) = lack.as_ref().filter(|_| is_refused && device.blocks.is_some()) {
            return Err(vec![misfit::by_count(logic, device, lack)]);
        }
        let has_changes = device.has_flip_flop(FlipFlop::T) || device.has_xor();
        let exclusive = has_changes.then(|| Exclusive::new(logic));
        let design = Design { logic, device, functions, exclusive, lacks: lack.is_some() };
        let (sums, is_hopeless) = design.minimised(&mut signals, options, is_refused);
        let (equations, depth) = design.whole(&mut signals, sums);
        let Signals { mut namer, all, .. } = signals;
        let mut result = Equations {
            title: Namer::new(&PALASM_CHIP).name(&logic.name.text),
            device,
            head: Vec::new(),
            signals: all,
            equations,
            has_pins: false,
            depth,
            lacks: Vec::new(),
            moved: Vec::new(),
        };
        result.share_pins(logic, options);
        // If macrocells or pins are lacking even without the parts of wide functions, the parts get no pins.
        let by_count = lack.as_ref().filter(|_| result.depth > 0);
        let mut misfit = result.assign_pins(logic, options, by_count.is_none(), &mut findings);
        if !is_hopeless && misfit.as_ref().is_some_and(Misfit::is_about_width) {
            let n_before = result.signals.len();
            result.divide(logic, options, &mut |owner, count| {
                namer.name_with_suffix(owner, &format!("_w{count}"))
            });
            if result.signals.len() > n_before {
                misfit = result.assign_pins(logic, options, true, &mut findings);
            }
        }
        if let Some(misfit) = misfit.as_ref().filter(|_| needs_pins) {
            findings.push(misfit.diagnostic(logic, device));
        } else if let Some(lack) = lack.as_ref().filter(|_| is_refused && findings.is_empty()) {
            findings.push(misfit::by_count(logic, device, lack));
        }
        if !findings.is_empty() {
            return Err(findings);
        }
        result.lacks = match (by_count, misfit) {
            (Some(lack), _) => vec![lack.clone()],
            (None, Some(misfit)) => misfit.parts(device),
            (None, None) => Vec::new(),
        };
        if is_hopeless {
            let quick = "its sums were minimised quickly, without a proof of the minimum";
            result.lacks.push(quick.to_owned());
        }
        result.head = head(&result, logic, dialect, options);
        Ok(result)
    }
}

/// A circuit and its device: what the sums are made from.
struct Design<'a> {
    logic: &'a Logic,
    device: &'static Device,
    functions: Vec<Function<'a>>,
    /// Views of the flip-flops as toggles, if the device has such flip-flops or an exclusive or.
    exclusive: Option<Exclusive>,
    /// True if the device has too few pins or macrocells.
    lacks: bool,
}

/// The equations of the functions that have a sum, and the indices of those that are too wide for one.
struct Sums<'a> {
    forms: FormChoice<'a>,
    equations: Vec<Equation>,
    wide: Vec<usize>,
}

impl<'a> Design<'a> {
    /// Minimises all functions, first quickly. If the result is hopeless (the second value), it stays; otherwise the full budget is spent.
    fn minimised(
        &'a self,
        signals: &mut Signals,
        options: &EmitOptions,
        is_refused: bool,
    ) -> (Sums<'a>, bool) {
        let (logic, device, dont_cares) = (self.logic, self.device, options.dont_cares);
        let budget = Budget { exact: None, ..options.budget };
        let forms = FormChoice { logic, device, budget, dont_cares, open: &[] };
        let sums = if is_refused {
            // The sums are not needed to count the signals that get no pin.
            let unsaid =
                |it: &Function<'_>| signals.equation(it, forms.unsaid(it.node, it.init), logic);
            let equations = self.functions.iter().map(unsaid).collect();
            Sums { forms, equations, wide: Vec::new() }
        } else {
            self.sums(forms, signals)
        };
        let is_hopeless = self.lacks || count::is_far_too_wide(&sums.equations, device);
        if is_hopeless || options.budget.exact.is_none() {
            return (sums, is_hopeless);
        }
        (self.sums(FormChoice { budget: options.budget, ..forms }, signals), false)
    }

    /// Minimises all functions with this budget.
    fn sums(&self, forms: FormChoice<'a>, signals: &mut Signals) -> Sums<'a> {
        let mut sums = Sums { forms, equations: Vec::new(), wide: Vec::new() };
        let mut n_refused = 0;
        for (at, function) in self.functions.iter().enumerate() {
            let Function { node, init, .. } = *function;
            let mut forms = FormChoice { open: &function.open, ..forms };
            if self.lacks && n_refused >= MOST_REFUSED {
                forms.budget.nodes = forms.budget.nodes.min(NODES_IF_REFUSED);
            }
            let flop = if let Source::Flop(id) = function.source { Some(id) } else { None };
            let form = match &self.exclusive {
                Some(exclusive) => exclusive.best(&forms, node, init, flop),
                None => forms.of(node, init),
            };
            match form {
                Ok(form) => sums.equations.push(signals.equation(function, form, self.logic)),
                Err(refused) => {
                    n_refused += usize::from(matches!(refused, Refused::Nodes(_)));
                    sums.wide.push(at);
                }
            }
        }
        sums
    }

    /// All equations: functions that are too wide are split into parts, which become buried signals. Also gives the longest chain of parts.
    fn whole(&self, signals: &mut Signals, sums: Sums<'_>) -> (Vec<Equation>, usize) {
        let Sums { forms, mut equations, wide } = sums;
        if wide.is_empty() {
            return (equations, 0);
        }
        let wide: Vec<&Function<'_>> = wide.into_iter().map(|at| &self.functions[at]).collect();
        let asked: Vec<Wide> = wide.iter().map(|function| function.wide(&forms)).collect();
        let split = split(self.logic, &asked, widest(self.device));
        let forms = FormChoice { logic: &split.logic, ..forms };
        signals.add_parts(&split);
        let parts = split.nodes.iter().enumerate().map(|(index, node)| {
            let function = Function {
                source: Source::Buried(index),
                node: node.value,
                open: Vec::new(),
                init: None,
                name: &node.name,
                meta: &node.meta,
            };
            (function, &node.sum)
        });
        let wholes = wide
            .iter()
            .zip(&split.wide)
            .map(|(function, (node, sum))| (Function { node: *node, ..(*function).clone() }, sum));
        // Minimising thousands of parts again is slow and saves little.
        let is_small = split.nodes.len() <= 128;
        for (function, sum) in parts.chain(wholes) {
            let minimised = is_small.then(|| {
                let forms = FormChoice { open: &function.open, ..forms };
                forms.of(function.node, function.init)
            });
            let form = match minimised.transpose().ok().flatten() {
                Some(form) if form.products.len() <= sum.products.len() => form,
                Some(_) | None => forms.of_sum(sum, function.init),
            };
            equations.push(signals.equation(&function, form, self.logic));
        }
        equations.sort_by_key(|equation| match signals.all[equation.signal].source {
            Source::Buried(index) => (2, index),
            Source::Flop(id) => (0, id.index()),
            Source::Output(id) => (1, id.index()),
            Source::Clock | Source::Input(_) => (3, 0),
        });
        (equations, split.depth)
    }
}

/// The signals with their names, sorted by kind.
struct Signals {
    namer: Namer,
    all: Vec<Signal>,
    /// The first index of each kind.
    input: SignalIndex,
    output: SignalIndex,
    flop: SignalIndex,
    buried: SignalIndex,
    /// The signals of buried nodes, by the input that represents them.
    places: BTreeMap<PinInputId, SignalIndex>,
}

impl Signals {
    /// Pins are named before flip-flops (they appear in the board's schematic), and the clock is last (its name is generated).
    fn of(logic: &Logic, dialect: Dialect) -> Self {
        let mut namer = Namer::new(match dialect {
            Dialect::Palasm => &PALASM,
            Dialect::Cupl => &CUPL,
            Dialect::Galasm | Dialect::Verilog | Dialect::Blif => &GALASM,
        });
        let inputs = logic.inputs.iter();
        let inputs = inputs.map(|(id, it)| (it.name.as_str(), Source::Input(id), &it.meta));
        let outputs = logic.outputs.iter();
        let outputs = outputs.map(|(id, it)| (it.name.as_str(), Source::Output(id), &it.meta));
        let pins: Vec<_> = inputs.chain(outputs).collect();
        let names = namer.assign(pins.iter().map(|pin| pin.0)).into_iter();
        let named =
            names.zip(pins).map(|(name, (_, source, meta))| Signal::new(name, source, meta));
        let mut all: Vec<Signal> = named.collect();
        for (id, flop) in logic.flops.iter() {
            let name = register_name(&mut namer, &flop.name);
            all.push(Signal::new(name, Source::Flop(id), &flop.meta));
        }
        if !logic.flops.is_empty() || logic.outputs.values().any(|it| it.registered.is_some()) {
            let [usual, ..] = CLOCK_NAMES;
            let name = CLOCK_NAMES.into_iter().find(|name| !namer.is_taken(name)).unwrap_or(usual);
            all.insert(0, Signal::new(namer.name(name), Source::Clock, &Meta::default()));
        }
        let first = |is_kind: fn(&Source) -> bool| {
            all.iter().position(|signal| is_kind(&signal.source)).unwrap_or(0)
        };
        Signals {
            input: first(|source| matches!(source, Source::Input(_))),
            output: first(|source| matches!(source, Source::Output(_))),
            flop: first(|source| matches!(source, Source::Flop(_))),
            buried: all.len(),
            places: BTreeMap::new(),
            namer,
            all,
        }
    }

    /// Adds a buried signal for each node of a split. A part is named after its function.
    fn add_parts(&mut self, split: &Split) {
        let mut parts_of = BTreeMap::new();
        for (index, node) in split.nodes.iter().enumerate() {
            let name = if node.is_whole {
                self.namer.name(&node.name)
            } else {
                let count = parts_of.entry(node.name.as_str()).or_insert(0_usize);
                *count += 1;
                self.namer.name_with_suffix(&node.name, &format!("_w{count}"))
            };
            self.all.push(Signal::new(name, Source::Buried(index), &node.meta));
        }
        let places = split.nodes.iter().enumerate();
        self.places = places.map(|(index, node)| (node.input, self.buried + index)).gather();
    }

    /// The equation of a function whose sum has this form.
    fn equation(&mut self, function: &Function<'_>, form: Form, logic: &Logic) -> Equation {
        let signal = match function.source {
            Source::Flop(id) => self.flop + id.index(),
            Source::Output(id) => self.output + id.index(),
            Source::Buried(index) => self.buried + index,
            Source::Clock | Source::Input(_) => unreachable!("they have no function"),
        };
        self.all[signal].is_pin_inverted = form.is_pin_inverted;
        let index = |var: Var| match var {
            Var::Input(id) if id.index() < logic.inputs.len() => self.input + id.index(),
            Var::Input(id) => self.places[&id],
            Var::Flop(id) => self.flop + id.index(),
        };
        let literals = |product: Vec<(Var, bool)>| {
            product.into_iter().map(|(var, value)| (index(var), value)).collect::<Vec<_>>()
        };
        Equation {
            signal,
            is_complemented: form.is_complemented,
            is_registered: function.init.is_some(),
            products: form.products.into_iter().map(literals).collect(),
            flip_flop: form.flip_flop,
            inverter: form.inverter.map(literals),
        }
    }
}

fn find_device(options: &EmitOptions, findings: &mut Vec<Diagnostic>) -> &'static Device {
    let Some(name) = &options.device else { return Device::default_device() };
    Device::find(name).unwrap_or_else(|| {
        let mut finding =
            Diagnostic::error(codes::UNKNOWN_DEVICE, format!("unknown device `{name}`"));
        if let Some(span) = options.device_span {
            finding = finding.at(span, "");
        }
        let known: Vec<&str> = crate::device::DEVICES.iter().map(|device| device.name).collect();
        let near = nearest_type(name, Device::names()).or_else(|| marked(name));
        finding = finding.help(match near {
            Some(near) => {
                format!("did you mean `{near}`? `build --device list` shows all devices")
            }
            None => format!("known devices: {}", known.join(", ")),
        });
        findings.push(finding);
        Device::default_device()
    })
}

/// The device for the marking of a chip, such as `GAL16V8D-15LP`: the one with the longest name that is a prefix of the marking.
fn marked(marking: &str) -> Option<&'static str> {
    let marking = marking.to_ascii_lowercase();
    Device::names().filter(|name| marking.starts_with(*name)).max_by_key(|name| name.len())
}

/// A function that needs an equation.
#[derive(Debug, Clone)]
struct Function<'a> {
    source: Source,
    node: NodeId,
    /// The don't-cares of the function.
    open: Vec<NodeId>,
    /// The power-up value, if it is clocked.
    init: Option<bool>,
    name: &'a str,
    meta: &'a Meta,
}

impl Function<'_> {
    fn wide(&self, forms: &FormChoice<'_>) -> Wide {
        Wide {
            node: self.node,
            polarity: forms.polarity(self.init),
            name: self.name.to_owned(),
            meta: self.meta.clone(),
        }
    }
}

/// All functions of a circuit, flip-flops first; a registered output whose power-up value the device cannot provide is a finding.
fn functions<'a>(
    logic: &'a Logic,
    device: &'static Device,
    findings: &mut Vec<Diagnostic>,
) -> Vec<Function<'a>> {
    let mut functions: Vec<Function<'a>> = logic
        .flops
        .iter()
        .map(|(id, flop)| Function {
            source: Source::Flop(id),
            node: flop.next,
            open: logic.open_where(grafsynth_ir::logic::Function::Next(id)).collect(),
            init: Some(flop.init),
            name: &flop.name,
            meta: &flop.meta,
        })
        .collect();
    for (id, output) in logic.outputs.iter() {
        if device.power_up == PowerUp::PinsHigh && output.registered == Some(false) {
            findings.push(wakes_high(device, output));
        }
        functions.push(Function {
            source: Source::Output(id),
            node: output.value,
            open: logic.open_where(grafsynth_ir::logic::Function::Output(id)).collect(),
            init: output.registered,
            name: &output.name,
            meta: &output.meta,
        });
    }
    functions
}

/// The line of a text whose equations use the assumptions of the chart as don't-cares.
pub const RELIES: &str = "the equations rely on the assumptions of the chart about its inputs";

fn wakes_high(device: &Device, output: &PinOutput) -> Diagnostic {
    let message = format!(
        "output `{}` must be 0 after power-up, but every registered pin of a {} is then high, whatever its polarity",
        output.name, device.name
    );
    Diagnostic::error(codes::POWER_UP, message)
        .at(output.meta.span, "registered output")
        .help("make the output combinational, or use a gal22v10, whose power-up values depend on the polarity")
}

/// The comment in the header.
fn head(
    equations: &Equations,
    logic: &Logic,
    dialect: Dialect,
    options: &EmitOptions,
) -> Vec<String> {
    let device = equations.device;
    let mut head = vec![
        format!(
            "{} - equations made by grafsynth {}",
            one_line(&logic.name.text),
            env!("CARGO_PKG_VERSION")
        ),
        match &options.device {
            Some(_) => format!("device {}", device.name),
            None => format!("device {} (default)", device.name),
        },
    ];
    head.push(match device.power_up {
        PowerUp::ByPolarity => "power-up: a register written as /x := .. starts with x true, one written as x := .. with x false".to_owned(),
        PowerUp::PinsHigh => "power-up: every registered pin starts high, so a signal that starts false is inverted on its pin".to_owned(),
    });
    let remembered: Vec<&str> = device.remembered().map(|figure| figure.what).collect();
    if options.device.is_some() && device.layout.is_none() && !remembered.is_empty() {
        head.push(format!(
            "uses data-sheet values that were not verified: {}",
            remembered.join("; ")
        ));
    }
    if !equations.lacks.is_empty() {
        head.push(format!(
            "does not fit one {}, so pins are not assigned: {}",
            device.name,
            equations.lacks.join("; ")
        ));
    }
    if equations.depth > 0 {
        let is_buried = |signal: &&Signal| matches!(signal.source, Source::Buried(_));
        head.push(format!(
            "buried signals for parts of functions that are too wide for one sum: {}; additional passes through the array: up to {}",
            equations.signals.iter().filter(is_buried).count(),
            equations.depth
        ));
    }
    if logic.outputs.values().any(|output| output.mealy) {
        head.push("mealy outputs are valid just before the clock".to_owned());
    }
    head.extend(busy_note(logic));
    if options.dont_cares && !logic.never.is_empty() {
        head.push(RELIES.to_owned());
    }
    if dialect == Dialect::Galasm {
        head.push("the pins are numbered left to right, first row then second".to_owned());
    }
    head.extend(options.notes.iter().map(|note| one_line(note)));
    head
}
