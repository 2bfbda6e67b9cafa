//! Compares imported logic with a chart or with other logic: pins are matched by name, then both are run with a stimulus, or compared by a proof.

use crate::circuit;
use crate::codes;
use crate::compare::{self, Outcome, nothing_in_common};
use crate::design::Design;
use crate::logic::{LogicDesign, interface};
use crate::run::{logic_trace, net_trace};
use grafsynth_ir::arena::Arena;
use grafsynth_ir::facts::Proof;
use grafsynth_ir::logic::{FlopId, Logic, Node, PinRole};
use grafsynth_ir::net::{Driver, InputId, Net, OutputId};
use grafsynth_ir::{Diagnostic, Valid, counted, validate};
use grafsynth_logic::chip::{ChipSim, NoRow, most_clocks};
use grafsynth_logic::sim::LogicSim;
use grafsynth_sim::{Clocked, ColumnKind, Difference, InputRow, Stimulus, Trace};
use grafsynth_verify::circuits::{Apart, Equality, Pairs, circuits};
use grafsynth_verify::{Limits, Open, Verdict};
use itertools::Itertools as _;

/// Names of the second design and the corresponding names of the first.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Renames(Vec<(String, String)>);

impl Renames {
    /// Reads `old=new` pairs.
    ///
    /// # Errors
    /// A text that is not such a pair.
    pub fn parse(pairs: &[String]) -> Result<Self, String> {
        let pair = |text: &String| {
            let (old, new) = text.split_once('=').ok_or_else(|| text.clone())?;
            if old.is_empty() || new.is_empty() {
                return Err(text.clone());
            }
            Ok((old.to_owned(), new.to_owned()))
        };
        Ok(Renames(pairs.iter().map(pair).collect::<Result<_, _>>()?))
    }

    /// The name in the first design of a name of the second. The letter case of `old` matters only if two pairs differ in nothing else.
    fn apply<'n>(&'n self, name: &'n str) -> &'n str {
        let pair = |is: &dyn Fn(&str) -> bool| self.0.iter().find(|(old, _)| is(old));
        let exact = pair(&|old| old == name);
        exact.or_else(|| pair(&|old| is_alike(old, name))).map_or(name, |(_, new)| new)
    }
}

/// True if the names are equal except for letter case.
fn is_alike(a: &str, b: &str) -> bool {
    a.to_lowercase() == b.to_lowercase()
}

/// The name of the first design that matches a name of the second. It is the same name, or else the only one that differs in letter case alone, if no other
/// name of the second matches it. `others` are all names of the second.
fn twin<T>(name: &str, known: &[(T, &str)], others: &[&str]) -> Option<T>
where
    T: Copy,
{
    if let Some((id, _)) = known.iter().find(|(_, known)| *known == name) {
        return Some(*id);
    }
    let mut alike = known.iter().filter(|(_, known)| is_alike(known, name));
    let (first, second) = (alike.next(), alike.next());
    let is_only_one = others.iter().filter(|other| is_alike(other, name)).count() == 1;
    first.filter(|_| second.is_none() && is_only_one).map(|(id, _)| *id)
}

/// A circuit whose pins have the roles of a net; outputs that the net does not have are removed.
#[derive(Debug, Clone)]
struct Bound {
    logic: Logic,
    outputs: Vec<OutputId>,
    /// The outputs that only the net or only the circuit has.
    apart: compare::Apart,
}

/// Matches the pins of a circuit with a net by name. If the chart evolves until it is stable, an output `busy` that the chart does not have shows that the
/// reaction is still running (semantics.md §9); an input `tick` is the chart's time.
fn bind(net: &Net, logic: &Logic, renames: &Renames) -> Result<Bound, Vec<Diagnostic>> {
    let mut bound =
        Bound { logic: logic.clone(), outputs: Vec::new(), apart: compare::Apart::default() };
    let mut found = Vec::new();
    let ours: Vec<(InputId, &str)> =
        net.inputs.iter().map(|(id, input)| (id, input.name.text.as_str())).collect();
    let theirs: Vec<&str> = logic.inputs.values().map(|input| renames.apply(&input.name)).collect();
    for id in bound.logic.inputs.ids() {
        let input = &mut bound.logic.inputs[id];
        let name = renames.apply(&logic.inputs[id].name);
        let known = twin(name, &ours, &theirs);
        match known {
            Some(twin) if net.inputs[twin].ty.is_bool() => input.role = PinRole::Input(twin, 0),
            None if input.role == PinRole::Tick || is_alike(name, "tick") => {
                input.role = PinRole::Tick;
            }
            // A pin that no function reads may be anything.
            _ if !logic.nodes.values().any(|node| *node == Node::Input(id)) => {
                input.role = PinRole::Reset;
            }
            Some(_) | None => {
                let why = if known.is_some() {
                    "but in the chart it is not a single bit"
                } else {
                    "but the chart has no such input"
                };
                let message = format!("the logic has an input `{}`, {why}", input.name);
                let finding = Diagnostic::error(codes::LOGIC_DOES_NOT_FIT, message);
                found.push(finding.at(input.meta.span, "").help(format!(
                    "write `--rename {}=NAME`, where NAME is the name of this input in the chart",
                    input.name
                )));
            }
        }
    }
    if !found.is_empty() {
        return Err(found);
    }
    let is_stable = most_clocks(net) > 1;
    let ours: Vec<(OutputId, &str)> =
        net.outputs.iter().map(|(id, output)| (id, output.name.text.as_str())).collect();
    let theirs: Vec<&str> =
        logic.outputs.values().map(|output| renames.apply(&output.name)).collect();
    for id in bound.logic.outputs.ids() {
        let output = &mut bound.logic.outputs[id];
        let name = renames.apply(&logic.outputs[id].name);
        output.role = match twin(name, &ours, &theirs) {
            Some(twin) if net.outputs[twin].ty.is_bool() && !bound.outputs.contains(&twin) => {
                bound.outputs.push(twin);
                output.mealy =
                    matches!(net.outputs[twin].driver, Driver::Mealy(_) | Driver::Fires(_));
                PinRole::Output(twin, 0)
            }
            None if is_alike(name, "busy") && is_stable => PinRole::Busy,
            Some(_) | None => {
                bound.apart.second.push(output.name.clone());
                PinRole::Unknown
            }
        };
    }
    if bound.outputs.is_empty() {
        return Err(nothing_in_common());
    }
    let is_apart = |(id, _): &(OutputId, _)| !bound.outputs.contains(id);
    let only_ours = net.outputs.iter().filter(is_apart).map(|(_, output)| output);
    bound.apart.first = only_ours.map(|output| output.name.text.clone()).collect();
    bound.logic.outputs = std::mem::take(&mut bound.logic.outputs)
        .values()
        .filter(|output| output.role != PinRole::Unknown)
        .cloned()
        .collect();
    for id in bound.logic.flops.ids() {
        bound.logic.flops[id].holds = None;
    }
    Ok(bound)
}

/// Compares a net and imported logic under one stimulus, clock by clock (rows of the difference count clocks). Pins are matched by name, and every Boolean
/// output that both have is compared.
///
/// # Errors
/// An input that the logic reads is not a Boolean input of the net, the two have no common output, or the stimulus takes more clocks than the limit for a chip.
pub fn with_net(
    net: &Valid<Net>,
    logic: &Logic,
    stimulus: &Stimulus,
    renames: &Renames,
) -> Result<Outcome, Vec<Diagnostic>> {
    let bound = bind(net, logic, renames)?;
    let clocked = Clocked::of(net, stimulus).map_err(|finding| vec![*finding])?;
    let theirs = logic_trace(net, &bound.logic, &clocked.stimulus)?;
    let ours = net_trace(net, &clocked.stimulus);
    let difference = first_difference(&ours, &theirs, &bound.outputs);
    Ok(Outcome {
        difference,
        n_columns: bound.outputs.len(),
        n_rows: stimulus.len(),
        apart: bound.apart,
    })
}

fn first_difference(ours: &Trace, theirs: &Trace, outputs: &[OutputId]) -> Option<Difference> {
    let columns: Vec<usize> = ours
        .layout
        .columns
        .iter()
        .enumerate()
        .filter(|(_, column)| match column.kind {
            ColumnKind::Output(id) => outputs.contains(&id),
            _ => false,
        })
        .map(|(at, _)| at)
        .collect();
    for (row, wanted) in ours.rows.iter().enumerate() {
        let Some(shown) = theirs.rows.get(row) else {
            return Some(Difference {
                row,
                column: "busy".to_owned(),
                left: "0".to_owned(),
                right: "1".to_owned(),
            });
        };
        for at in &columns {
            let is_open = wanted.open.get(*at).copied().unwrap_or(false);
            let (a, b) = (wanted.values.get(*at), shown.values.get(*at));
            if let (Some(a), Some(b), false) = (a, b, is_open)
                && a != b
            {
                return Some(Difference {
                    row,
                    column: ours.layout.columns[*at].name.clone(),
                    left: ours.layout.text(a),
                    right: theirs.layout.text(b),
                });
            }
        }
    }
    None
}

/// Proves that imported logic is equivalent to a net, or finds a stimulus that distinguishes them.
///
/// # Errors
/// Like [`with_net`].
pub fn prove_with_net(
    net: &Valid<Net>,
    logic: &Logic,
    renames: &Renames,
    limits: &Limits,
) -> Result<Verdict, Vec<Diagnostic>> {
    let bound = bind(net, logic, renames)?;
    let facts = circuit::facts(net, limits);
    Ok(grafsynth_verify::equiv(net, &facts, &bound.logic, limits))
}

/// Compares two circuits under a stimulus of the first, at the pins that both have.
///
/// # Errors
/// Like [`with_net`].
pub fn with_logic(
    left: &LogicDesign,
    right: &Logic,
    stimulus: &Stimulus,
    renames: &Renames,
) -> Result<Outcome, Vec<Diagnostic>> {
    let ours = logic_trace(&left.interface, left.circuit()?, stimulus)?;
    let bound = bind(&left.interface, right, renames)?;
    let theirs = logic_trace(&left.interface, &bound.logic, stimulus)?;
    let difference = first_difference(&ours, &theirs, &bound.outputs);
    Ok(Outcome {
        difference,
        n_columns: bound.outputs.len(),
        n_rows: stimulus.len(),
        apart: bound.apart,
    })
}

/// The result of a proof about two circuits.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Judged {
    /// They are equal; contains how this was proved.
    Equal(EqualBy),
    /// They differ; contains the location of the difference.
    Different(CircuitsApart),
    /// The result is unknown, with the reason.
    Open(Open),
}

/// How two circuits were proved equal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EqualBy {
    /// Every state of both together was visited with every input.
    Enumerated {
        /// Pairs of states.
        states: usize,
        /// Outputs compared.
        outputs: usize,
    },
    /// Their power-up values are equal, and this many functions are equal.
    Functions(usize),
}

impl EqualBy {
    /// The kind of proof.
    #[must_use]
    pub fn proof(&self) -> Proof {
        match self {
            EqualBy::Enumerated { .. } => Proof::Explicit,
            EqualBy::Functions(_) => Proof::Induction,
        }
    }
}

impl std::fmt::Display for EqualBy {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            EqualBy::Enumerated { states, outputs } => write!(
                f,
                "proved by enumeration: {}, {} compared under every input",
                counted(*states, "state", "states"),
                counted(*outputs, "output", "outputs")
            ),
            EqualBy::Functions(n) => {
                let functions = counted(*n, "function is equal", "functions are equal");
                write!(f, "proved by induction: {functions}")
            }
        }
    }
}

/// Proves two circuits equal from power-up on, in the outputs that both have, or finds a difference.
///
/// # Errors
/// Like [`with_net`].
pub fn prove_with_logic(
    left: &LogicDesign,
    right: &Logic,
    renames: &Renames,
    limits: &Limits,
) -> Result<Judged, Vec<Diagnostic>> {
    let ours = left.circuit()?;
    let bound = bind(&left.interface, right, renames)?;
    Ok(judge_as(ours, &bound.logic, renames, limits))
}

/// Like [`prove_with_logic`], for two circuits whose pins have the roles of one net.
#[must_use]
pub fn judge(left: &Logic, right: &Logic, limits: &Limits) -> Judged {
    judge_as(left, right, &Renames::default(), limits)
}

fn judge_as(ours: &Logic, theirs: &Logic, renames: &Renames, limits: &Limits) -> Judged {
    judge_pairs(ours, theirs, &pairs(ours, theirs, renames), limits)
}

/// Compares two circuits at the pins of these pairs.
pub(crate) fn judge_pairs(ours: &Logic, theirs: &Logic, pairs: &Pairs, limits: &Limits) -> Judged {
    match circuits(ours, theirs, pairs, limits) {
        Equality::Enumerated { states, outputs } => {
            Judged::Equal(EqualBy::Enumerated { states, outputs })
        }
        Equality::ByFunctions(n) => Judged::Equal(EqualBy::Functions(n)),
        Equality::Different(apart) => Judged::Different(named(ours, theirs, pairs, &apart)),
        Equality::Open(why) => Judged::Open(why),
    }
}

fn pairs(left: &Logic, right: &Logic, renames: &Renames) -> Pairs {
    let same = |role: PinRole, other: PinRole| role == other;
    let inputs = left.inputs.iter().map(|(id, input)| {
        let twin = right.inputs.iter().find(|(_, other)| same(input.role, other.role));
        (Some(id), twin.map(|(id, _)| id))
    });
    let outputs = right.outputs.iter().filter_map(|(id, output)| {
        let twin = left.outputs.iter().find(|(_, other)| same(output.role, other.role))?;
        Some((twin.0, id))
    });
    let ours: Vec<(FlopId, &str)> =
        left.flops.iter().map(|(id, flop)| (id, flop.name.as_str())).collect();
    let theirs: Vec<&str> = right.flops.values().map(|flop| renames.apply(&flop.name)).collect();
    let flops = right
        .flops
        .iter()
        .filter_map(|(id, flop)| Some((twin(renames.apply(&flop.name), &ours, &theirs)?, id)));
    Pairs { inputs: inputs.collect(), outputs: outputs.collect(), flops: flops.collect() }
}

/// The difference, with the names of the first circuit.
fn named(left: &Logic, right: &Logic, pairs: &Pairs, apart: &Apart) -> CircuitsApart {
    let inputs = || pairs.inputs.iter().filter_map(|(pin, _)| *pin);
    let values = |row: &Vec<bool>| {
        let values = pairs.inputs.iter().zip(row);
        values.filter(|((pin, _), _)| pin.is_some()).map(|(_, value)| *value).collect()
    };
    let output = pairs.outputs.get(apart.output).map(|(pin, _)| *pin);
    let mut sim = LogicSim::new(left);
    let outputs = apart.rows.iter().map(|row| {
        for ((pin, _), value) in pairs.inputs.iter().zip(row) {
            if let Some(pin) = pin {
                sim.set_input(*pin, u64::from(*value));
            }
        }
        let value = output.is_some_and(|output| sim.output(output) & 1 == 1);
        sim.clock();
        value
    });
    let mut apart = CircuitsApart {
        outputs: outputs.collect(),
        output: output.map_or_else(String::new, |pin| left.outputs[pin].name.clone()),
        left: apart.left,
        inputs: inputs().map(|pin| left.inputs[pin].name.clone()).collect(),
        rows: apart.rows.iter().map(values).collect(),
        traces: None,
    };
    apart.traces = traces(left, right, pairs, &apart).map(Box::new);
    apart
}

/// The traces of two circuits up to their difference, in the inputs and outputs of the first. `None` if these cannot be columns.
fn traces(
    left: &Logic,
    right: &Logic,
    pairs: &Pairs,
    apart: &CircuitsApart,
) -> Option<(Trace, Trace)> {
    let (mut ours, mut theirs) = (left.clone(), right.clone());
    // Flip-flops correspond only in part, so they are not shown.
    let mut net = interface(&mut ours);
    net.vars = Arena::default();
    for circuit in [&mut ours, &mut theirs] {
        circuit.decoded.clear();
        for id in circuit.flops.ids() {
            circuit.flops[id].holds = None;
        }
    }
    let net = validate(net).ok()?;
    for id in theirs.inputs.ids() {
        theirs.inputs[id].role = PinRole::Unknown;
    }
    for id in theirs.outputs.ids() {
        theirs.outputs[id].role = PinRole::Unknown;
    }
    for (own, twin) in &pairs.inputs {
        if let (Some(own), Some(twin)) = (own, twin) {
            theirs.inputs[*twin].role = ours.inputs[*own].role;
        }
    }
    for (own, twin) in &pairs.outputs {
        theirs.outputs[*twin].role = ours.outputs[*own].role;
    }
    let stimulus = apart.stimulus(&net, &ours);
    let ours = logic_trace(&net, &ours, &stimulus).ok()?;
    Some((ours, logic_trace(&net, &theirs, &stimulus).ok()?))
}

/// The difference between two circuits.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CircuitsApart {
    /// The output, as named in the first circuit.
    pub output: String,
    /// Its value in the first circuit; the second has the other value.
    pub left: bool,
    /// Its value in the first circuit at each clock, before the clock edge; the second circuit has the same values except in the last row.
    pub outputs: Vec<bool>,
    /// The inputs, as named in the first circuit.
    pub inputs: Vec<String>,
    /// Their values at each clock; the last row shows the difference without a further clock.
    pub rows: Vec<Vec<bool>>,
    /// The traces of both circuits with these inputs, in the columns of the first: its inputs and outputs, without flip-flops. `None` if its pins cannot be
    /// columns.
    pub traces: Option<Box<(Trace, Trace)>>,
}

impl CircuitsApart {
    /// The number of clocks before the output differs.
    #[must_use]
    pub fn clocks(&self) -> usize {
        self.rows.len().saturating_sub(1)
    }

    /// The inputs as comma-separated values: a line of names, a line for each clock, and a last line with the inputs that show the difference.
    #[must_use]
    pub fn to_csv(&self) -> String {
        let lines = self.rows.iter().map(|row| row.iter().copied().map(bit).join(","));
        [self.inputs.join(",")].into_iter().chain(lines).map(|line| line + "\n").collect()
    }

    /// The inputs as a stimulus of the first circuit, whose inputs have these roles.
    #[must_use]
    pub fn stimulus(&self, net: &Net, left: &Logic) -> Stimulus {
        let mut stimulus = Stimulus::new(net);
        for values in &self.rows {
            let mut row = InputRow { dt: 1, ..InputRow::zero(net) };
            for (name, value) in self.inputs.iter().zip(values) {
                let pin = left.inputs.values().find(|input| input.name == *name);
                if let Some(PinRole::Input(id, 0)) = pin.map(|pin| pin.role) {
                    row = row.with(id, i64::from(*value));
                }
            }
            stimulus.push(&row);
        }
        stimulus
    }

    /// The difference as a sentence, with these names of the two circuits.
    #[must_use]
    pub fn sentence(&self, first: &str, second: &str) -> String {
        let after = match self.clocks() {
            0 => "after power-up".to_owned(),
            1 => "after 1 clock".to_owned(),
            n => format!("after {n} clocks"),
        };
        let (left, right) = (bit(self.left), bit(!self.left));
        let last = self.rows.last().map(Vec::as_slice).unwrap_or_default();
        let values = self.inputs.iter().zip(last);
        let values = values.map(|(name, value)| format!("{name}={}", bit(*value))).join(" ");
        let inputs = if values.is_empty() { String::new() } else { format!(" while {values}") };
        format!(
            "{after}, {} is {left} in the {first} and {right} in the {second}{inputs}",
            self.output
        )
    }
}

fn bit(value: bool) -> &'static str {
    if value { "1" } else { "0" }
}

impl std::fmt::Display for CircuitsApart {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.sentence("first", "second"))
    }
}

/// The runs of two designs with one stimulus of the first; the second is logic.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Runs {
    /// The first design.
    pub first: Trace,
    /// The second design, in the columns of the first.
    pub second: Trace,
    /// The second design in its own columns, with a row for each clock: a stimulus that it can run alone.
    pub own: Trace,
}

/// Runs two designs with a stimulus of the first that has no row of more than one tick.
///
/// # Errors
/// Like [`with_net`].
pub fn runs(
    first: &Design,
    second: &LogicDesign,
    stimulus: &Stimulus,
    renames: &Renames,
) -> Result<Runs, Vec<Diagnostic>> {
    let (net, ours) = match first {
        Design::Net(design) => (&design.net, net_trace(&design.net, stimulus)),
        Design::Logic(design) => {
            (&design.interface, logic_trace(&design.interface, design.circuit()?, stimulus)?)
        }
    };
    let circuit = second.circuit()?;
    let bound = bind(net, circuit, renames)?;
    let theirs = logic_trace(net, &bound.logic, stimulus)?;
    let own = own_stimulus(net, &bound.logic, (&second.interface, circuit), stimulus);
    let own = logic_trace(&second.interface, circuit, &own)?;
    Ok(Runs { first: ours, second: theirs, own })
}

/// The stimulus of a net as the pins of a circuit see it, with the names of the circuit's own interface: one row for each clock. `bound` has the roles of the net,
/// and the same pins.
fn own_stimulus(
    net: &Net,
    bound: &Logic,
    (interface, circuit): (&Net, &Logic),
    stimulus: &Stimulus,
) -> Stimulus {
    let mut own = Stimulus::new(interface);
    let mut chip = ChipSim::new(net, bound);
    for row in stimulus.rows() {
        let (clocks, has_ended) = match chip.react(&row.values, u64::from(row.dt)) {
            Ok(clocks) => (clocks, true),
            Err(NoRow::StillBusy { clocks }) => (clocks, false),
            Err(NoRow::TooManyTicks { .. }) => break,
        };
        for clock in 0..clocks {
            let mut pins = InputRow { dt: 1, ..InputRow::zero(interface) };
            for (pin, input) in bound.inputs.iter() {
                // Events and the tick last one clock.
                let value = match input.role {
                    PinRole::Input(id, _) if clock > 0 && net.inputs[id].kind.is_event() => 0,
                    PinRole::Input(id, _) => row.value(id),
                    PinRole::Tick => i64::from(clock == 0 && row.dt > 0),
                    PinRole::Reset
                    | PinRole::Output(..)
                    | PinRole::Busy
                    | PinRole::Fault
                    | PinRole::Unknown => 0,
                };
                if let PinRole::Input(column, _) = circuit.inputs[pin].role {
                    pins = pins.with(column, value);
                }
            }
            own.push(&pins);
        }
        if !has_ended {
            break;
        }
    }
    own
}
