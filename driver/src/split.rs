//! From a net to its parts on chips and a CPU: partition, divide, fit, prove (semantics §10).
//!
//! ```text
//! together   split::together     objects that must be on the same part
//! search     split::search       the best partition in which each part fits its chip; the parts are built like any net:
//!   partition  split::partition    the part of each group, by estimates or by lower bounds
//!   divide     split::divide       one net for each part, and the wires
//! joined     verify::joined      proves that the parts with their wires are the net
//! ```

mod conflict;
mod explore;
mod file;
mod free;
mod link;
mod memory;
mod report;
mod search;
mod table;

pub use explore::{Costs, costs};
pub use file::{Written, read, write};
pub use free::{assumed, too_fast};
pub use link::{Linked, Round, link, link_on_host, rounded};
pub use memory::{Compile, Memory, Program, Sizes};
pub use report::report;
pub use table::{crowded, table};

use crate::pipeline::{self, BuildOptions, Built};
use crate::stem::FileStem;
use crate::target::Target;
use grafsynth_backend_pld::device::Device;
use grafsynth_ir::diag::{any_error, nearest_type};
use grafsynth_ir::division::{Division, Running, round_of, rounds_of};
use grafsynth_ir::facts::Facts;
use grafsynth_ir::net::{Net, PlacedItem};
use grafsynth_ir::{Diagnostic, Valid, counted};
use grafsynth_sim::measures_time;
pub use grafsynth_split::cpu::{CPUS, Cpu};
use grafsynth_split::link::SYNCHRONISERS;
pub use grafsynth_split::partition::Place;
use grafsynth_split::solve::Alternative;
use grafsynth_split::{Groups, PartSpec, Partition, together, unused_name};
pub use grafsynth_split::{Item, Objective};
use grafsynth_verify::verdict::Verdict;
use grafsynth_verify::{
    Apart, Joined, Open, OpenReason, Race, RoundFacts, Settled, joined, settles,
};
use search::Fitted;

/// The device of a part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PartDevice {
    /// A programmable chip.
    Chip(&'static Device),
    /// A microcontroller, by its name.
    Cpu(&'static str),
}

impl PartDevice {
    /// The device with this name.
    #[must_use]
    pub fn named(name: &str) -> Option<PartDevice> {
        let cpu = CPUS.iter().find(|cpu| cpu.name.eq_ignore_ascii_case(name));
        cpu.map(|cpu| PartDevice::Cpu(cpu.name)).or(Device::find(name).map(PartDevice::Chip))
    }

    /// The name of the device.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            PartDevice::Chip(device) => device.name,
            PartDevice::Cpu(name) => name,
        }
    }

    /// The known device name that is most similar to an unknown one.
    #[must_use]
    pub fn near(name: &str) -> Option<&'static str> {
        nearest_type(name, Device::names().chain(CPUS.iter().map(|cpu| cpu.name)))
    }
}

/// A part as requested: `--part NAME=DEVICE`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RequestedPart {
    /// The name of the part.
    pub name: String,
    /// Its device.
    pub device: PartDevice,
}

/// The parts, places and options of a split.
#[derive(Debug, Clone, Copy)]
pub struct Request<'a> {
    /// The parts: chips first, the CPU last.
    pub parts: &'a [RequestedPart],
    /// The objects that the designer places.
    pub places: &'a [Place],
    /// How the parts run together.
    pub running: Running,
    /// Whether the CPU gets a wire that resets the chips, in lockstep.
    pub reset: bool,
    /// What is minimised.
    pub objective: Objective,
    /// After the first partition that fits, the number of partitions that may be built to find a better one, or to show that there is none.
    pub fits: usize,
    /// The prefix of all file names.
    pub stem: &'a FileStem,
    /// The options of the builds of the parts.
    pub options: &'a BuildOptions,
    /// How the part on the CPU is compiled, to know how much memory it needs; `None` for estimates.
    pub compile: Option<Compile>,
    /// Called whenever the search knows more.
    pub told: fn(SoFar),
}

/// What the search for the best partition knows before it ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SoFar {
    /// What is minimised.
    pub objective: Objective,
    /// The objective of the best partition so far whose devices hold their parts.
    pub value: Option<i64>,
    /// No partition that fits has a smaller objective, as far as is known.
    pub bound: Option<i64>,
    /// The number of partitions that were built.
    pub builds: usize,
}

impl std::fmt::Display for SoFar {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let built = counted(self.builds, "partition", "partitions");
        let unit = self.objective.unit();
        match self.value {
            Some(value) => write!(f, "best so far: {value} {unit}")?,
            None => write!(f, "none fits so far")?,
        }
        if let Some(bound) = self.bound {
            write!(f, "; every partition that fits has at least {}", bound.max(0))?;
        }
        write!(f, "; {built} built")
    }
}

/// One part with its outputs.
#[derive(Debug)]
pub struct BuiltPart {
    /// The facts of the part's net.
    pub facts: Facts,
    /// The options of its build.
    pub options: BuildOptions,
    /// Its files and their verdicts. That of C is completed by [`pipeline::check_c`].
    pub built: Built,
}

/// Whether the parts together are the net.
#[derive(Debug)]
pub enum Whole {
    /// In lockstep: row by row.
    Rounds(Verdict<Joined, Apart>),
    /// If the parts run on their own: each output and each step takes the same sequence of values.
    Sequences(Verdict<Settled, Race>),
}

/// A split.
#[derive(Debug)]
pub struct Split {
    /// The groups of objects that must be on the same part.
    pub groups: Groups,
    /// The part of each group.
    pub partition: Partition,
    /// The objective of the partition: for [`Objective::Cells`], the macrocells of the fitted chips.
    pub value: i64,
    /// No partition that the chips can hold has a smaller objective; the value itself if this one is the best.
    pub bound: i64,
    /// The nets of the parts, and the wires.
    pub division: Division,
    /// The outputs of each part.
    pub parts: Vec<BuiltPart>,
    /// Whether the parts, joined by their wires, are the net.
    pub joined: Whole,
    /// The number of partitions that were built and in which a part did not fit its device.
    pub unfit: usize,
    /// The number of partitions that were built.
    pub builds: usize,
    /// The number of sets of decisions that were left out at first, because they probably need more macrocells than a chip has.
    pub cuts: usize,
    /// The memories that the part on the CPU needs, or the reason why they are not known.
    pub memory: Result<Memory, String>,
}

impl Split {
    /// Whether no object can be on another part.
    fn is_given(&self) -> bool {
        let mut others = self.partition.alternatives.iter().flatten();
        others.all(|one| matches!(one, Alternative::Current | Alternative::NotAllowed))
    }

    /// The objective, and how good the partition is.
    #[must_use]
    pub fn said(&self, objective: Objective) -> String {
        let (what, value) = (objective.unit(), self.value);
        let known = if self.is_given() {
            "the places leave no choice".to_owned()
        } else if self.bound >= value {
            "the minimum over all partitions that fit".to_owned()
        } else {
            format!("every partition that fits has at least {}", self.bound.max(0))
        };
        let unfit = match self.unfit {
            0 => String::new(),
            n => format!(
                "; {} built without success",
                counted(n, "partition was", "partitions were")
            ),
        };
        format!("{value} {what}: {known}{unfit}")
    }
}

/// Finds the best partition that fits, builds its parts and proves that they are the net.
///
/// # Errors
/// Unsupported features; contradictory places or constraints; errors in the build of a part, except that it does not fit.
pub fn split(net: &Valid<Net>, request: &Request<'_>) -> Result<Split, Vec<Diagnostic>> {
    let groups = together(net, request.running)?;
    let facts = round_facts(net, request)?;
    let Fitted { partition, value, bound, division, chips, unfit, builds, cuts, memory } =
        search::search(net, (&groups, &facts.components), request)?;
    let mut parts = chips;
    if let (Some(part), Some(requested)) = (division.parts.last(), request.parts.last()) {
        let cpu = build_cpu(net, &part.net, requested, request);
        if any_error(&cpu.built.found) {
            return Err(cpu.built.found);
        }
        parts.push(cpu);
    }
    let joined = whole(net, &facts, &division, request);
    Ok(Split {
        groups,
        partition,
        value,
        bound,
        division,
        parts,
        joined,
        unfit,
        builds,
        cuts,
        memory,
    })
}

/// The facts of a round; none if the parts run on their own, because they have no rounds.
fn round_facts(net: &Valid<Net>, request: &Request<'_>) -> Result<Facts, Vec<Diagnostic>> {
    Ok(match request.running {
        Running::Lockstep => pipeline::facts(&round_of(net)?, &request.options.limits),
        Running::Free => Facts::default(),
    })
}

/// The proof about the parts together.
fn whole(net: &Valid<Net>, facts: &Facts, division: &Division, request: &Request<'_>) -> Whole {
    let limits = &request.options.limits;
    if division.running == Running::Free {
        return Whole::Sequences(match request.options.prove {
            true => settles(net, division, limits),
            false => Verdict::Open(Open::because(OpenReason::NotAsked)),
        });
    }
    let ends = rounds_of(net).is_none() || pipeline::facts(net, limits).always_stable.is_some();
    let one_tick = division.parts.iter().zip(request.parts).any(|(part, requested)| {
        matches!(requested.device, PartDevice::Chip(_)) && measures_time(&part.net)
    });
    let known = RoundFacts { facts, ends };
    Whole::Rounds(joined(net, known, division, one_tick, limits))
}

/// Why the pins of a chip are not assigned. Its equations are written then, but nothing can be wired.
fn misfit(part: &BuiltPart) -> Option<&str> {
    part.built.chips.first()?.misfit.as_deref()
}

fn spec(part: &RequestedPart, has_reset: bool) -> PartSpec {
    let all = PartSpec {
        name: part.name.clone(),
        is_chip: false,
        cells: None,
        pins: None,
        has_plant: true,
        has_reset,
        act_cycles: 0,
        memory: [None; 2],
    };
    match part.device {
        PartDevice::Cpu(name) => {
            let cpu = CPUS.iter().find(|cpu| cpu.name == name);
            // Of an 8051, no time is known: that of an AVR compares partitions.
            let act_cycles = cpu.and_then(|cpu| cpu.link_cycles).map_or(14, |it| it.act);
            PartSpec { pins: cpu.map(|cpu| cpu.pins.len() as u64), act_cycles, ..all }
        }
        PartDevice::Chip(device) => {
            let pins = device.inputs.len() + device.macrocells.len();
            PartSpec {
                is_chip: true,
                cells: Some(device.n_cells() as u64),
                pins: device.blocks.is_none().then_some(pins as u64),
                ..all
            }
        }
    }
}

/// Whether nothing of a part ever changes, and nothing of it is seen.
fn is_still(part: &Net) -> bool {
    part.outputs.is_empty() && part.transitions.is_empty()
}

/// Builds the part of a net on the CPU. If a reaction is several rounds, the link calls each extern condition once.
fn build_cpu(
    net: &Net,
    part: &Valid<Net>,
    requested: &RequestedPart,
    request: &Request<'_>,
) -> BuiltPart {
    let mut options = request.options.clone();
    options.c.once = rounds_of(net).is_some();
    build_part(part, requested, &Request { options: &options, ..*request })
}

fn build_part(net: &Valid<Net>, part: &RequestedPart, request: &Request<'_>) -> BuiltPart {
    let mut options = request.options.clone();
    options.stem = Some(FileStem::of_name(&format!("{}_{}", request.stem, part.name)));
    let target = match part.device {
        PartDevice::Chip(device) => {
            options.device = Some(device.name.to_owned());
            if request.running == Running::Free {
                options.synchronise = SYNCHRONISERS as u32;
                // A reaction of several clocks would take longer than its stated time.
                options.busy = pipeline::BusyMode::Never;
            }
            options.reset_wire = request.reset.then(|| unused_name(net, "reset"));
            // The link needs the pins, which the data of the report contain.
            options.report = true;
            if device.layout.is_some() {
                Target::Jedec
            } else {
                Target::Logic(grafsynth_backend_pld::Dialect::Cupl)
            }
        }
        PartDevice::Cpu(_) => {
            options.device = None;
            Target::C(None)
        }
    };
    let facts = pipeline::facts(net, &options.limits);
    // Without outputs and transitions there are no equations; only a fuse map can be written for such a chip.
    let is_empty = matches!(target, Target::Logic(_)) && is_still(net);
    let targets = if is_empty { &[][..] } else { &[target] };
    let built = pipeline::build(net, &facts, targets, &options);
    BuiltPart { facts, options, built }
}

/// The step, transition, variable, output or action with this name. A word before the name selects the kind: `step p1`.
#[must_use]
pub fn item(net: &Net, text: &str) -> Option<Item> {
    let (kind, name) = text.split_once(' ').map_or(("", text), |(kind, name)| (kind, name.trim()));
    let mut all = named_items(net);
    let is_it = |one: &(&str, &str, Item)| one.1 == name && (kind.is_empty() || kind == one.0);
    all.find(is_it).map(|(_, _, item)| item)
}

/// The objects that a place can name, with kind and name.
fn named_items(net: &Net) -> impl Iterator<Item = (&'static str, &str, Item)> {
    let steps = net.steps.iter().map(|(id, it)| ("step", &it.name, Item::Step(id)));
    let transitions =
        net.transitions.iter().map(|(id, it)| ("transition", &it.name, Item::Transition(id)));
    let vars = net.vars.iter().map(|(id, it)| ("variable", &it.name, Item::Var(id)));
    let outputs = net.outputs.iter().map(|(id, it)| ("output", &it.name, Item::Output(id)));
    let actions = net.actions.iter().map(|(id, it)| ("action", &it.name, Item::Action(id)));
    let all = steps.chain(transitions).chain(vars).chain(outputs).chain(actions);
    all.map(|(kind, name, item)| (kind, name.text.as_str(), item))
}

/// The object that a `place` in the chart names.
#[must_use]
pub fn placed_item(item: PlacedItem) -> Item {
    match item {
        PlacedItem::Step(id) => Item::Step(id),
        PlacedItem::Var(id) => Item::Var(id),
        PlacedItem::Transition(id) => Item::Transition(id),
        PlacedItem::Output(id) => Item::Output(id),
    }
}

/// The names that [`item`] knows, for a suggestion.
pub fn item_names(net: &Net) -> impl Iterator<Item = &str> {
    named_items(net).map(|(_, name, _)| name)
}
