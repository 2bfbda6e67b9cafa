//! The data of a chip for the report page: its signals and macrocells, collected while it is built.
//!
//! For a fuse map, everything comes from the fuses, decoded again: only names and the meaning of pins are taken from the design. For equations, it comes
//! from the printed equations. A netlist has signals and no macrocells.

use crate::coding::{Encoding, EncodingChoice};
use crate::output_report::Outcome;
use grafsynth_backend_pld::device::{Device, FlipFlop};
use grafsynth_backend_pld::equations::{self, Equations};
use grafsynth_backend_pld::fuse::{self, FuseMap, Role};
use grafsynth_backend_pld::ice40::Package;
use grafsynth_backend_pld::placement::{CellKind, Placement, Product};
use grafsynth_backend_pld::synchronise::Chain;
use grafsynth_backend_pld::{Dialect, Emitted, Object};
use grafsynth_ir::Gather;
use grafsynth_ir::logic::{
    FlopBit, FlopId, Function, Logic, Node, NodeId, PinInputId, PinOutputId, PinRole,
};
use grafsynth_ir::names::is_unseen;
use grafsynth_ir::net::Meta;
use grafsynth_logic::minimise::{Budget, Minimum, sum_between};
use std::collections::{BTreeMap, BTreeSet};

/// An output of a build that is a chip.
#[derive(Debug, Clone)]
pub struct Chip {
    /// The name of its file.
    pub file: String,
    /// Its language.
    pub language: Language,
    /// The result of its proof.
    pub outcome: Outcome,
    /// The circuit that it was made from, with its encoding and synchronisers.
    pub circuit: Logic,
    /// The circuit that was read back from its text or fuses.
    pub read_back: Logic,
    /// The pin of each object of that circuit, for a fuse map.
    pub roles: Vec<Role>,
    /// Its synchronisers.
    pub chains: Vec<Chain>,
    /// Its state encoding; `None` for imported logic, because the meaning of its registers is unknown.
    pub code: Option<Code>,
    /// How the circuit evolves until it is stable, if the chart has a stable evolution.
    pub evolution: Option<String>,
    /// The device; `None` for a netlist.
    pub device: Option<&'static Device>,
    /// The exact part, if the user named one.
    pub part: Option<&'static str>,
    /// The package to which its pins belong, for an FPGA.
    pub package: Option<&'static Package>,
    /// All named signals, in no particular order.
    pub signals: Vec<Signal>,
    /// The macrocells in use, those with a pin first, by pin.
    pub cells: Vec<Cell>,
    /// Why pins are not assigned, if so.
    pub misfit: Option<String>,
    /// The number of test vectors, or of rows of its simulation.
    pub n_vectors: usize,
    /// The fuses.
    pub fuses: Option<FuseMap>,
    /// The level of each pin after power-up, according to the fuse simulator; `None` if the device does not drive the pin.
    pub wakes: Vec<(u32, Option<bool>)>,
    /// Active-low output-enable pins, as programmed or as fixed by the device.
    pub enables: Vec<u32>,
}

/// The language of a chip's text.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Language {
    /// A fuse map.
    Jedec,
    /// A text.
    Text(Dialect),
}

/// The state encoding of a chip, and the reason for it.
#[derive(Debug, Clone)]
pub struct Code {
    /// The encoding.
    pub encoding: Encoding,
    /// The requested encoding.
    pub choice: EncodingChoice,
    /// The number of steps without their own flip-flop.
    pub n_coded: usize,
    /// The number of groups of mutually exclusive steps.
    pub n_groups: usize,
    /// Why one flip-flop for each step does not fit, if that is known.
    pub why_not_one_hot: Option<String>,
    /// True if every illegal situation returns to the initial one.
    pub is_safe: bool,
}

/// A signal of a chip.
#[derive(Debug, Clone)]
pub struct Signal {
    /// Its name in the chart; an internal signal has the name in the text. Unique on its chip.
    pub name: String,
    /// Its name in the text, if it differs.
    pub printed: Option<String>,
    /// Its pin.
    pub pin: Option<u32>,
    /// Its kind.
    pub kind: Kind,
    /// True if the pin carries the complement.
    pub is_inverted: bool,
    /// Label, tags and location.
    pub meta: Meta,
}

/// The kind of a signal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// The clock.
    Clock,
    /// A reset that the text has in addition to the circuit.
    Reset,
    /// An input bit.
    Input(PinInputId),
    /// A flip-flop.
    Flop(FlopId),
    /// An output bit.
    Output(PinOutputId),
    /// A part of a function that is too wide for one sum.
    Buried,
}

/// A conjunction of signals and their complements.
pub type Literals = Vec<(usize, bool)>;

/// A macrocell in use, or a function that has no pin yet.
#[derive(Debug, Clone)]
pub struct Cell {
    /// The signals that it shows: one, or several that share it.
    pub signals: Vec<usize>,
    /// Its pin.
    pub pin: Option<u32>,
    /// How the macrocell uses its sum.
    pub kind: CellKind,
    /// The sum gives the complement of the first signal.
    pub is_complemented: bool,
    /// The sum.
    pub sum: Vec<Literals>,
    /// The kind of its flip-flop, if it has one.
    pub flip_flop: FlipFlop,
    /// A product that inverts the sum while it is true.
    pub inverter: Option<Literals>,
    /// Other terms, by name: enable, clock, set, reset.
    pub terms: Vec<(&'static str, Literals)>,
    /// The maximum number of products of its sum; `None` if it has no pin.
    pub available: Option<u32>,
    /// The known bounds on the number of its products.
    pub count: Count,
}

/// The known bounds on the number of products of a function in its form and polarity; an inverter also counts as a product.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Count {
    /// The lower bound, with the don't-cares that were used.
    pub least: Option<usize>,
    /// The number of products found without don't-cares, and its lower bound.
    pub without: Option<(usize, usize)>,
}

impl Cell {
    /// The number of product terms of the device that it uses.
    #[must_use]
    pub fn n_terms(&self) -> usize {
        self.sum.len() + self.inverter.iter().count()
    }

    /// True if it is proved that no sum has fewer products.
    #[must_use]
    pub fn is_least(&self) -> bool {
        self.count.least == Some(self.n_terms())
    }

    /// True if it is clocked.
    #[must_use]
    pub fn is_registered(&self) -> bool {
        match self.kind {
            CellKind::Registered => true,
            CellKind::Combinational | CellKind::Tristate => false,
        }
    }
}

/// The data that all kinds of chips have in addition to their texts.
#[derive(Debug, Clone)]
pub(crate) struct Made<'a> {
    pub(crate) file: &'a str,
    pub(crate) outcome: Outcome,
    pub(crate) circuit: &'a Logic,
    pub(crate) chains: &'a [Chain],
    pub(crate) code: Option<Code>,
    pub(crate) evolution: Option<String>,
    pub(crate) dont_cares: bool,
    pub(crate) budget: Budget,
}

impl Chip {
    fn new(made: Made<'_>, language: Language) -> Self {
        Chip {
            file: made.file.to_owned(),
            language,
            outcome: made.outcome,
            circuit: made.circuit.clone(),
            read_back: Logic::default(),
            roles: Vec::new(),
            chains: made.chains.to_vec(),
            code: made.code,
            evolution: made.evolution,
            device: None,
            part: None,
            package: None,
            signals: Vec::new(),
            cells: Vec::new(),
            misfit: None,
            n_vectors: 0,
            fuses: None,
            wakes: Vec::new(),
            enables: Vec::new(),
        }
    }

    /// The chip of a fuse map: its macrocells are decoded from the fuses again. Only names are taken from the intended `placement`.
    pub(crate) fn burned(
        made: Made<'_>,
        map: &FuseMap,
        placement: &Placement,
        roles: &[Role],
        n_vectors: usize,
    ) -> Self {
        let (circuit, dont_cares, budget) = (made.circuit, made.dont_cares, made.budget);
        let mut chip = Chip::new(made, Language::Jedec);
        let device = map.device;
        chip.device = Some(device);
        chip.part = placement.part;
        chip.n_vectors = n_vectors;
        chip.fuses = Some(map.clone());
        let mut known = Known::of(circuit);
        for role in roles {
            let printed = placement.name(role.pin).unwrap_or_default();
            let signal = known.signal(&role.object, Some(role.pin), printed, role.is_inverted);
            chip.signals.push(signal);
        }
        // The fuses were decoded before they were written, so decoding succeeds.
        let cells = fuse::decode(map).map(|placement| placement.cells).unwrap_or_default();
        let literals = |product: &Product| -> Literals {
            let literal = |&(pin, value): &(u32, bool)| {
                let at = chip.at_pin(pin).first().copied()?;
                Some((at, value != chip.signals[at].is_inverted))
            };
            let mut literals: Literals = product.0.iter().filter_map(literal).collect();
            literals.sort_by_key(|(signal, _)| chip.rank(*signal));
            literals
        };
        let of_cell = |cell: &grafsynth_backend_pld::placement::Cell| -> Option<Cell> {
            let signals = chip.at_pin(cell.pin);
            let is_inverted = chip.signals[*signals.first()?].is_inverted;
            let terms = [
                ("enable", &cell.enable),
                ("clock", &cell.clock),
                ("set", &cell.set),
                ("reset", &cell.reset),
            ];
            let mut sum: Vec<Literals> = cell.sum.iter().map(literals).collect();
            sum.sort_by_cached_key(|product| chip.order(product));
            Some(Cell {
                signals,
                pin: Some(cell.pin),
                kind: cell.kind,
                is_complemented: cell.is_active_low != is_inverted,
                sum,
                // The devices with known fuse maps have only D flip-flops and no inverters.
                flip_flop: FlipFlop::D,
                inverter: None,
                terms: terms
                    .into_iter()
                    .filter_map(|(name, term)| Some((name, literals(term.as_ref()?))))
                    .collect(),
                available: available(device, Some(cell.pin), cell.kind, cell.sum.len()),
                count: Count::default(),
            })
        };
        let mut cells: Vec<Cell> = cells.iter().filter_map(of_cell).collect();
        cells.sort_by_key(|cell| cell.pin);
        chip.cells = cells;
        chip.count(circuit, dont_cares, budget);
        if let Ok(mut at_work) = fuse::sim::Chip::new(map) {
            chip.enables = at_work.enable_pins();
            // Outputs must be enabled to show their values; their levels were simulated before the file was written.
            let low: Vec<(u32, u64)> = chip.enables.iter().map(|pin| (*pin, 0)).collect();
            let is_shown = at_work.put(&low).and_then(|()| at_work.power_up()).is_ok();
            let macrocells = if is_shown { device.macrocells } else { &[] };
            chip.wakes = macrocells
                .iter()
                .map(|cell| {
                    let is_driven = at_work.drives(cell.pin) == u64::MAX;
                    (cell.pin, is_driven.then(|| at_work.level(cell.pin) == u64::MAX))
                })
                .collect();
        }
        chip
    }

    /// The signals at a pin: the flip-flop in the macrocell first, then the outputs that share it.
    fn at_pin(&self, pin: u32) -> Vec<usize> {
        let mut all: Vec<usize> =
            (0..self.signals.len()).filter(|at| self.signals[*at].pin == Some(pin)).collect();
        all.sort_by_key(|at| !matches!(self.signals[*at].kind, Kind::Flop(_)));
        all
    }

    /// The chip of a text.
    pub(crate) fn of_text(made: Made<'_>, emitted: &Emitted, n_vectors: usize) -> Self {
        match &emitted.equations {
            Some(equations) => Chip::of_equations(made, emitted.dialect, equations, n_vectors),
            None => Chip::of_netlist(made, emitted, n_vectors),
        }
    }

    /// The chip of equations, as they were printed.
    fn of_equations(
        made: Made<'_>,
        dialect: Dialect,
        equations: &Equations,
        n_vectors: usize,
    ) -> Self {
        let (circuit, dont_cares, budget) = (made.circuit, made.dont_cares, made.budget);
        let mut chip = Chip::new(made, Language::Text(dialect));
        let device = equations.device;
        chip.device = Some(device);
        chip.n_vectors = n_vectors;
        chip.misfit = equations.misfit();
        let mut known = Known::of(circuit);
        for (named, signal) in equations.named(circuit).iter().zip(&equations.signals) {
            // A flip-flop whose complement is printed is shown uncomplemented here.
            let is_inverted = signal.is_pin_inverted != signal.is_complement;
            let mut own = known.signal(&named.object, signal.pin, &signal.name, is_inverted);
            if let equations::Source::Buried(_) = signal.source {
                own.meta = signal.meta.clone();
            }
            chip.signals.push(own);
        }
        let literals = |product: &Literals| -> Literals {
            let own = |signal: usize| equations.signals[signal].is_complement;
            product.iter().map(|&(signal, value)| (signal, value != own(signal))).collect()
        };
        let mut cells: Vec<Cell> = (equations.equations.iter())
            .map(|equation| {
                let sharing = (0..equations.signals.len())
                    .filter(|at| equations.signals[*at].shared == Some(equation.signal));
                let is_complement = equations.signals[equation.signal].is_complement;
                let pin = equations.signals[equation.signal].pin;
                let kind = if equation.is_registered {
                    CellKind::Registered
                } else {
                    CellKind::Combinational
                };
                Cell {
                    signals: std::iter::once(equation.signal).chain(sharing).collect(),
                    pin,
                    kind,
                    is_complemented: equation.is_complemented != is_complement,
                    sum: equation.products.iter().map(literals).collect(),
                    flip_flop: equation.flip_flop,
                    inverter: equation.inverter.as_ref().map(literals),
                    terms: Vec::new(),
                    available: available(device, pin, kind, equation.n_terms()),
                    count: Count::default(),
                }
            })
            .collect();
        cells.sort_by_key(|cell| (cell.pin.is_none(), cell.pin));
        chip.cells = cells;
        chip.count(circuit, dont_cares, budget);
        if chip.cells.iter().any(Cell::is_registered) {
            chip.enables = enable_pins(device);
        }
        chip
    }

    /// The chip of a netlist: it has only signals, because other tools choose how their functions are built.
    fn of_netlist(made: Made<'_>, emitted: &Emitted, n_vectors: usize) -> Self {
        let mut chip = Chip::new(made, Language::Text(emitted.dialect));
        chip.n_vectors = n_vectors;
        let mut known = Known::of(&chip.circuit);
        let signals = emitted.names.iter();
        let signals =
            signals.map(|named| known.signal(&named.object, named.pin, &named.name, false));
        chip.signals = signals.collect();
        chip
    }

    /// Assigns the pins of a package to a netlist, from its constraints (`.pcf`).
    pub(crate) fn place_on(&mut self, package: &'static Package, constraints: &str) {
        self.package = Some(package);
        for line in constraints.lines() {
            let mut words = line.split_whitespace();
            if let (Some("set_io"), Some(name), Some(pin)) =
                (words.next(), words.next(), words.next())
                && let Some(signal) =
                    self.signals.iter_mut().find(|signal| signal.printed() == name)
            {
                signal.pin = pin.parse().ok();
            }
        }
    }

    /// The order of a signal within a product: flip-flops come before inputs, as is usual.
    fn rank(&self, signal: usize) -> (u32, usize) {
        let kind = match self.signals[signal].kind {
            Kind::Flop(_) => 0,
            Kind::Input(_) => 1,
            Kind::Buried | Kind::Output(_) => 2,
            Kind::Clock | Kind::Reset => 3,
        };
        (kind, signal)
    }

    fn order(&self, product: &Literals) -> Vec<((u32, usize), bool)> {
        product.iter().map(|&(signal, value)| (self.rank(signal), !value)).collect()
    }

    /// Determines with the minimiser how many products each function needs, with and without don't-cares.
    fn count(&mut self, circuit: &Logic, dont_cares: bool, budget: Budget) {
        let open: Vec<NodeId> = if dont_cares {
            circuit.never.iter().chain(&circuit.unreachable).copied().collect()
        } else {
            Vec::new()
        };
        let mut with_forms = circuit.clone();
        for cell in &mut self.cells {
            let Some(node) = question(&mut with_forms, &self.signals, cell) else { continue };
            let inverters = cell.inverter.iter().count();
            let function = match self.signals[cell.signals[0]].kind {
                Kind::Flop(id) => Some(Function::Next(id)),
                Kind::Output(id) => Some(Function::Output(id)),
                Kind::Clock | Kind::Reset | Kind::Input(_) | Kind::Buried => None,
            };
            let own = function.filter(|_| dont_cares).into_iter();
            let own = own.flat_map(|function| circuit.open_where(function));
            let open: Vec<NodeId> = open.iter().copied().chain(own).collect();
            let ask = |open: &[NodeId]| {
                let (sum, minimum) =
                    sum_between(&with_forms, node, cell.is_complemented, open, budget).ok()?;
                let least = match minimum {
                    Minimum::Exact => sum.len(),
                    Minimum::Between { lower, .. } => lower,
                };
                Some((sum.len() + inverters, least + inverters))
            };
            cell.count.without = ask(&[]);
            cell.count.least = match open.as_slice() {
                [] => cell.count.without,
                open => ask(open),
            }
            .map(|(_, least)| least);
        }
    }

    /// A literal in the usual notation.
    #[must_use]
    pub fn literal(&self, (signal, value): (usize, bool)) -> String {
        format!("{}{}", if value { "" } else { "/" }, self.signals[signal].name)
    }

    /// A product in the usual notation.
    #[must_use]
    pub fn product(&self, product: &Literals) -> String {
        if product.is_empty() {
            return "1".to_owned();
        }
        // A term that is never true contains a signal and its complement.
        if product.iter().any(|&(signal, value)| product.contains(&(signal, !value))) {
            return "0".to_owned();
        }
        product.iter().map(|literal| self.literal(*literal)).collect::<Vec<_>>().join(" * ")
    }

    /// The names that a macrocell shows; the first one belongs to its sum.
    #[must_use]
    pub fn names(&self, cell: &Cell) -> Vec<&str> {
        cell.signals.iter().map(|signal| self.signals[*signal].name.as_str()).collect()
    }

    /// For each register and output, the signals that it reads, through combinational logic. For a netlist, the inputs that its functions read.
    #[must_use]
    pub fn reads(&self) -> Vec<Reads> {
        if self.cells.is_empty() { self.reads_of_circuit() } else { self.reads_of_cells() }
    }

    fn reads_of_cells(&self) -> Vec<Reads> {
        let through = self.combinational();
        let of_cell = |cell: &Cell| {
            let literals = |cell: &Cell| -> Vec<usize> {
                let terms = cell.terms.iter().filter(|(name, _)| *name != "clock");
                let all = cell.sum.iter().chain(&cell.inverter).chain(terms.map(|(_, term)| term));
                all.flatten().map(|(signal, _)| *signal).collect()
            };
            let mut seen = BTreeSet::new();
            let mut open = literals(cell);
            while let Some(signal) = open.pop() {
                if seen.insert(signal)
                    && let Some(cell) = through[signal]
                {
                    open.extend(literals(&self.cells[cell]));
                }
            }
            Reads {
                signal: cell.signals.first().copied().unwrap_or(0),
                is_registered: cell.is_registered(),
                signals: seen,
            }
        };
        self.cells.iter().map(of_cell).collect()
    }

    /// For each signal, the combinational macrocell that shows it, if there is one.
    #[must_use]
    pub fn combinational(&self) -> Vec<Option<usize>> {
        let mut cells = vec![None; self.signals.len()];
        for (at, cell) in self.cells.iter().enumerate().filter(|(_, cell)| !cell.is_registered()) {
            for signal in &cell.signals {
                cells[*signal] = Some(at);
            }
        }
        cells
    }

    fn reads_of_circuit(&self) -> Vec<Reads> {
        let circuit = &self.circuit;
        // Nodes refer only to earlier nodes, so one pass is enough. One bit for each input.
        let n_words = circuit.inputs.len().div_ceil(64);
        let mut sets: Vec<Vec<u64>> = Vec::with_capacity(circuit.nodes.len());
        for (_, node) in circuit.nodes.iter() {
            let mut set = vec![0_u64; n_words];
            if let Node::Input(input) = node {
                set[input.index() / 64] |= 1 << (input.index() % 64);
            }
            grafsynth_logic::build::for_each_operand(node, |operand| {
                if let Some(other) = sets.get(operand.index()) {
                    set.iter_mut().zip(other).for_each(|(word, other)| *word |= other);
                }
            });
            sets.push(set);
        }
        let signal_of: Vec<(usize, PinInputId)> = (self.signals.iter().enumerate())
            .filter_map(|(at, signal)| match signal.kind {
                Kind::Input(input) => Some((at, input)),
                Kind::Clock | Kind::Reset | Kind::Flop(_) | Kind::Output(_) | Kind::Buried => None,
            })
            .collect();
        let signals = |node: NodeId| -> BTreeSet<usize> {
            let set = &sets[node.index()];
            let is_read = |input: PinInputId| set[input.index() / 64] >> (input.index() % 64) & 1;
            let read = signal_of.iter().filter(|(_, input)| is_read(*input) == 1);
            read.map(|(at, _)| *at).gather()
        };
        let root = |(at, signal): (usize, &Signal)| match signal.kind {
            Kind::Flop(flop) => Some(Reads {
                signal: at,
                is_registered: true,
                signals: signals(circuit.flops[flop].next),
            }),
            Kind::Output(output) => Some(Reads {
                signal: at,
                is_registered: circuit.outputs[output].registered.is_some(),
                signals: signals(circuit.outputs[output].value),
            }),
            Kind::Clock | Kind::Reset | Kind::Input(_) | Kind::Buried => None,
        };
        self.signals.iter().enumerate().filter_map(root).collect()
    }
}

/// The objects of a circuit by name, and the names used on its page.
struct Known<'a> {
    circuit: &'a Logic,
    inputs: BTreeMap<(&'a str, PinRole), PinInputId>,
    outputs: BTreeMap<(&'a str, PinRole), PinOutputId>,
    flops: BTreeMap<(&'a str, Option<FlopBit>), FlopId>,
    taken: BTreeSet<String>,
}

impl<'a> Known<'a> {
    fn of(circuit: &'a Logic) -> Self {
        let inputs = circuit.inputs.iter().map(|(id, own)| ((own.name.as_str(), own.role), id));
        let outputs = circuit.outputs.iter().map(|(id, own)| ((own.name.as_str(), own.role), id));
        let flops = circuit.flops.iter().map(|(id, own)| ((own.name.as_str(), own.holds), id));
        Known {
            circuit,
            inputs: inputs.gather(),
            outputs: outputs.gather(),
            flops: flops.gather(),
            taken: BTreeSet::new(),
        }
    }

    /// A signal of the page, with a unique name.
    fn signal(
        &mut self,
        object: &Object,
        pin: Option<u32>,
        printed: &str,
        is_inverted: bool,
    ) -> Signal {
        let circuit = self.circuit;
        let none = Meta::default();
        let found = match object {
            Object::Clock => Some((Kind::Clock, printed, &none)),
            Object::Reset => Some((Kind::Reset, printed, &none)),
            Object::Buried => Some((Kind::Buried, printed, &none)),
            Object::Input(input) => self.inputs.get(&(input.name.as_str(), input.role)).map(|id| {
                let own = &circuit.inputs[*id];
                (Kind::Input(*id), own.name.as_str(), &own.meta)
            }),
            Object::Flop(flop) => self.flops.get(&(flop.name.as_str(), flop.holds)).map(|id| {
                let own = &circuit.flops[*id];
                (Kind::Flop(*id), own.name.as_str(), &own.meta)
            }),
            Object::Output(output) => {
                self.outputs.get(&(output.name.as_str(), output.role)).map(|id| {
                    let own = &circuit.outputs[*id];
                    (Kind::Output(*id), own.name.as_str(), &own.meta)
                })
            }
        };
        // Signals keep their indices, which the functions use.
        let (kind, source, meta) = found.unwrap_or((Kind::Buried, printed, &none));
        // A stored output and its memory have one name in the chart; the name in the text distinguishes them, or else a suffix.
        let mut name = plain(source);
        if self.taken.contains(&name) {
            let is_useless = printed.is_empty() || self.taken.contains(printed);
            name = if is_useless { format!("{name}_q") } else { printed.to_owned() };
        }
        while !self.taken.insert(name.clone()) {
            name.push('\'');
        }
        let printed = (printed != name && !printed.is_empty()).then(|| printed.to_owned());
        Signal { name, printed, pin, kind, is_inverted, meta: meta.clone() }
    }
}

impl Signal {
    /// Its name in the text.
    #[must_use]
    pub fn printed(&self) -> &str {
        self.printed.as_deref().unwrap_or(&self.name)
    }

    /// The signal on its pin.
    #[must_use]
    pub fn on_pin(&self) -> String {
        format!("{}{}", if self.is_inverted { "/" } else { "" }, self.name)
    }
}

/// A name on one line, without the characters that end a Markdown block.
pub(super) fn plain(name: &str) -> String {
    let plain = |c: char| match c {
        '`' => '\'',
        c if is_unseen(c) => ' ',
        c => c,
    };
    name.chars().map(plain).collect()
}

/// The signals that a function reads.
#[derive(Debug, Clone)]
pub struct Reads {
    /// The register or output.
    pub signal: usize,
    /// True if it is clocked.
    pub is_registered: bool,
    /// The signals that it reads.
    pub signals: BTreeSet<usize>,
}

/// The function of a macrocell's sum, in its form: for a T flip-flop, when it toggles; for a sum with an inverter, the difference from the inverter.
/// `None` if that is not a function of the circuit: parts of a function that was too wide, and sums over such parts.
fn question(circuit: &mut Logic, signals: &[Signal], cell: &Cell) -> Option<NodeId> {
    let leaf = |kind: Kind| match kind {
        Kind::Flop(flop) => Some(Node::Flop(flop)),
        Kind::Input(input) => Some(Node::Input(input)),
        Kind::Clock | Kind::Reset | Kind::Output(_) | Kind::Buried => None,
    };
    let is_whole = |&(signal, _): &(usize, bool)| leaf(signals[signal].kind).is_some();
    if !cell.sum.iter().flatten().all(is_whole) {
        return None;
    }
    let mut node = match signals[*cell.signals.first()?].kind {
        Kind::Flop(flop) => {
            let next = circuit.flops[flop].next;
            match cell.flip_flop {
                FlipFlop::D => next,
                FlipFlop::T => {
                    let present = circuit.nodes.push(Node::Flop(flop));
                    circuit.nodes.push(Node::Xor(next, present))
                }
            }
        }
        Kind::Output(output) => circuit.outputs[output].value,
        Kind::Clock | Kind::Reset | Kind::Input(_) | Kind::Buried => return None,
    };
    if let Some(inverter) = &cell.inverter {
        // Inverters are single signals.
        let [(signal, true)] = inverter.as_slice() else { return None };
        let signal = circuit.nodes.push(leaf(signals[*signal].kind)?);
        node = circuit.nodes.push(Node::Xor(node, signal));
    }
    Some(node)
}

/// The number of products that a macrocell of this kind has; on devices with logic blocks, where wide sums use adjacent macrocells, the total of all macrocells
/// that the sum uses. On other devices, `None` for a function that has no pin yet.
fn available(device: &Device, pin: Option<u32>, kind: CellKind, n_terms: usize) -> Option<u32> {
    if let Some(blocks) = device.blocks {
        let n_terms = u32::try_from(n_terms).unwrap_or(u32::MAX);
        return Some(n_terms.div_ceil(blocks.own_terms).max(1).saturating_mul(blocks.own_terms));
    }
    let cell = device.macrocell(pin?)?;
    Some(match kind {
        CellKind::Registered => cell.registered_terms,
        CellKind::Combinational | CellKind::Tristate => cell.combinational_terms,
    })
}

/// The control pins of a device that enable outputs: those that a shape of its fuse map names. The other control pins load the registers of the device.
fn enable_pins(device: &Device) -> Vec<u32> {
    use grafsynth_backend_pld::device::layout::Enable;
    let shapes = device.layout.iter().flat_map(|layout| layout.modes).flat_map(|mode| mode.shapes);
    let pins: BTreeSet<u32> = shapes
        .filter_map(|shape| match shape.enable {
            Enable::PinLow(pin) | Enable::PinLowAndRow(pin, _) => Some(pin),
            Enable::Always | Enable::Never | Enable::Row(_) => None,
        })
        .gather();
    device.control_pins.iter().copied().filter(|pin| pins.contains(pin)).collect()
}
