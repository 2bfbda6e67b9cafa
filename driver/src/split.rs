//! From a net to its parts on chips and a CPU: partition, divide, fit, prove (semantics §10).
//!
//! ```text
//! together   split::together     objects that lie on one part
//! partition  split::partition    the part of each group, by estimates
//! divide     split::divide       one net for each part, and the wires
//! fit        crate::pipeline     each part is built as any net is; a chip that cannot hold its part excludes the partition, and the next one is tried
//! joined     verify::joined      the parts with their wires are the net
//! ```

mod file;
mod link;

pub use file::{Written, read, write};
pub use link::link;

use crate::codes;
use crate::pipeline::{self, BuildOptions, Built};
use crate::stem::FileStem;
use crate::target::Target;
use grafsynth_backend_pld::codes::DOES_NOT_FIT;
use grafsynth_backend_pld::device::Device;
use grafsynth_ir::diag::{any_error, nearest};
use grafsynth_ir::division::{Division, round_of};
use grafsynth_ir::facts::Facts;
use grafsynth_ir::net::{Evolution, Leaf, Net, PlacedItem};
use grafsynth_ir::{Diagnostic, Span, Valid, counted};
use grafsynth_split::codes::APART;
pub use grafsynth_split::cpu::CPUS;
pub use grafsynth_split::partition::Place;
use grafsynth_split::partition::Unplaced;
use grafsynth_split::solve::{Conflict, Constraint, Forbidden};
use grafsynth_split::{Groups, PartSpec, Partition, divide, partition, together};
pub use grafsynth_split::{Item, Objective};
use grafsynth_verify::verdict::Verdict;
use grafsynth_verify::{Apart, Joined, RoundFacts, joined};

/// The number of partitions that are really fitted before the search ends.
const MOST_FITS: usize = 40;

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

    /// The known name that is nearest to a wrong one.
    #[must_use]
    pub fn near(name: &str) -> Option<&'static str> {
        nearest(name, Device::names().chain(CPUS.iter().map(|cpu| cpu.name)))
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

/// What a split is made from.
#[derive(Debug)]
pub struct Request<'a> {
    /// The parts: chips first, the CPU last.
    pub parts: &'a [RequestedPart],
    /// The objects that the designer places.
    pub places: &'a [Place],
    /// What is minimised.
    pub objective: Objective,
    /// The beginning of the names of all files.
    pub stem: &'a FileStem,
    /// The options of the builds of the parts.
    pub options: &'a BuildOptions,
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

/// A split.
#[derive(Debug)]
pub struct Split {
    /// The groups of objects that lie on one part.
    pub groups: Groups,
    /// The part of each group.
    pub partition: Partition,
    /// The nets of the parts, and the wires.
    pub division: Division,
    /// The outputs of each part.
    pub parts: Vec<BuiltPart>,
    /// Whether the parts, joined by their wires, are the net.
    pub joined: Verdict<Joined, Apart>,
    /// The number of partitions that a chip could not hold before this one.
    pub unfit: usize,
}

/// Finds the best partition that fits, builds its parts and proves that they are the net.
///
/// # Errors
/// Features that cannot be split; places that cannot be kept; constraints that exclude each other; errors of a part other than a lack of room.
pub fn split(net: &Valid<Net>, request: &Request<'_>) -> Result<Split, Vec<Diagnostic>> {
    let groups = together(net)?;
    let mut specs: Vec<PartSpec> = request.parts.iter().map(spec).collect();
    let names: Vec<String> = specs.iter().map(|spec| spec.name.clone()).collect();
    let mut excluded: Vec<Forbidden> = Vec::new();
    let mut last: Vec<Diagnostic> = Vec::new();
    while excluded.len() < MOST_FITS {
        let found = partition(net, &groups, &specs, request.places, request.objective, &excluded);
        let partition = match found {
            Ok(partition) => partition,
            Err(why) => {
                let mut findings = unplaced(net, &groups, request, &why, excluded.len());
                findings.append(&mut last);
                return Err(findings);
            }
        };
        let division = divide(net, &groups, partition.owners.clone(), &names)?;
        let mut parts = Vec::new();
        let mut unfit = None;
        for (at, requested) in request.parts.iter().enumerate() {
            let part = build_part(&division.parts[at].net, requested, request);
            if any_error(&part.built.found) {
                if part.built.found.iter().any(|one| one.code == DOES_NOT_FIT) {
                    last = part.built.found;
                    unfit = Some(at);
                    break;
                }
                return Err(part.built.found);
            }
            parts.push(part);
        }
        if let Some(part) = unfit {
            let own = partition.part.iter().enumerate().filter(|(_, own)| **own == part);
            let nodes: Vec<usize> = own.map(|(group, _)| group).collect();
            excluded.push(Forbidden::Together { nodes, part });
            offer_less(&mut specs[part], part, &partition);
            continue;
        }
        let limits = &request.options.limits;
        let facts = pipeline::facts(&round_of(net)?, limits);
        let ends = net.settings.evolution == Evolution::Single
            || pipeline::facts(net, limits).always_stable.is_some();
        let one_tick = division.parts.iter().zip(request.parts).any(|(part, requested)| {
            matches!(requested.device, PartDevice::Chip(_)) && has_time(&part.net)
        });
        let known = RoundFacts { facts: &facts, ends };
        let joined = joined(net, known, &division, one_tick, limits);
        let unfit = excluded.len();
        return Ok(Split { groups, partition, division, parts, joined, unfit });
    }
    let message = format!(
        "no partition found: {MOST_FITS} partitions were tried, and a chip could not hold its part in any of them"
    );
    last.insert(0, Diagnostic::error(codes::NO_PARTITION, message));
    Err(last)
}

/// True if the net measures time.
#[must_use]
pub fn has_time(net: &Net) -> bool {
    net.expressions().any(|expr| expr.leaves().any(Leaf::is_time))
        || net.actions.values().any(|action| action.uses.iter().any(|one| one.qualifier.is_timed()))
}

/// After a fit failed, the chip is offered an eighth less than the estimates of that partition used, so that the search ends soon.
fn offer_less(spec: &mut PartSpec, part: usize, failed: &Partition) {
    for usage in &failed.evaluation.usage {
        let less = usage.used.saturating_sub((usage.used / 8).max(1));
        match usage.constraint {
            Constraint::Capacity { part: at, .. } if at == part => spec.cells = Some(less),
            Constraint::Pins { part: at } if at == part => spec.pins = Some(less),
            _ => {}
        }
    }
}

fn spec(part: &RequestedPart) -> PartSpec {
    let name = part.name.clone();
    match part.device {
        PartDevice::Cpu(_) => PartSpec { name, is_chip: false, cells: None, pins: None },
        PartDevice::Chip(device) => {
            let pins = device.inputs.len() + device.macrocells.len();
            PartSpec {
                name,
                is_chip: true,
                cells: Some(device.n_cells() as u64),
                pins: device.blocks.is_none().then_some(pins as u64),
            }
        }
    }
}

fn build_part(net: &Valid<Net>, part: &RequestedPart, request: &Request<'_>) -> BuiltPart {
    let mut options = request.options.clone();
    options.stem = Some(FileStem::of_name(&format!("{}_{}", request.stem, part.name)));
    let target = match part.device {
        PartDevice::Chip(device) => {
            options.device = Some(device.name.to_owned());
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
    let built = pipeline::build(net, &facts, &[target], &options);
    BuiltPart { facts, options, built }
}

/// The findings when there is no partition.
fn unplaced(
    net: &Net,
    groups: &Groups,
    request: &Request<'_>,
    why: &Unplaced,
    excluded: usize,
) -> Vec<Diagnostic> {
    let part = |at: usize| request.parts.get(at).map_or("", |part| part.name.as_str());
    let one = match why {
        Unplaced::Places(one, other) => {
            let (a, b) = (one.item.describe(net), other.item.describe(net));
            let chain: Vec<String> = groups
                .chain(one.item, other.item)
                .iter()
                .map(|bond| {
                    let (one, other) = (bond.one.describe(net), bond.other.describe(net));
                    format!("{one} {} {other}", bond.why.text())
                })
                .collect();
            let message = format!(
                "{a} is placed on `{}` and {b} on `{}`, but they cannot be separated: {}",
                part(one.part),
                part(other.part),
                chain.join(", ")
            );
            let found = Diagnostic::error(APART, message).help("remove one of the places");
            written_at(written_at(found, one.span), other.span)
        }
        Unplaced::NeedsCpu(place, reason) => {
            let message = format!(
                "{} is placed on `{}`, but only a CPU can have it: {reason}",
                place.item.describe(net),
                part(place.part)
            );
            written_at(Diagnostic::error(codes::NO_PARTITION, message), place.span)
        }
        Unplaced::Conflict(conflict) => {
            let mut message = "no partition fits: ".to_owned();
            message += &fights(net, groups, request, conflict).join("; ");
            if excluded > 0 {
                message += &format!(
                    " ({} did not fit when really built)",
                    counted(excluded, "partition", "partitions")
                );
            }
            Diagnostic::error(codes::NO_PARTITION, message)
                .help("use a larger chip, place less on it, or add a part")
        }
        Unplaced::Unknown => Diagnostic::error(
            codes::NO_PARTITION,
            "no partition was found within the limit of the search",
        )
        .help("place some objects with `--place`"),
        Unplaced::Malformed(error) => {
            Diagnostic::error(codes::NO_PARTITION, format!("no partition: {error}"))
        }
    };
    vec![one]
}

/// The finding with the location of a place, if that is in the chart.
fn written_at(found: Diagnostic, span: Span) -> Diagnostic {
    if span == Span::default() { found } else { found.at(span, "placed here") }
}

/// The constraints that exclude each other, with their numbers.
fn fights(net: &Net, groups: &Groups, request: &Request<'_>, conflict: &Conflict) -> Vec<String> {
    let part = |at: usize| request.parts.get(at).map_or("", |part| part.name.as_str());
    let amount = |fight: &grafsynth_split::solve::Fight| match fight.amount {
        Some(amount) => {
            let need = amount.need.map_or("more".to_owned(), |need| need.to_string());
            format!("needs {need}, has {}", amount.have)
        }
        None => String::new(),
    };
    let first = |group: usize| {
        groups
            .groups
            .get(group)
            .and_then(|items| items.first())
            .map_or(String::new(), |item| item.describe(net))
    };
    conflict
        .fights
        .iter()
        .map(|fight| match fight.constraint {
            Constraint::Capacity { part: at, .. } => {
                format!("macrocells of `{}`: {}", part(at), amount(fight))
            }
            Constraint::Pins { part: at } => format!("pins of `{}`: {}", part(at), amount(fight)),
            Constraint::Allowed { node } => match groups.cpu_only.get(&node) {
                Some((item, why)) => format!("{} needs the CPU: {why}", item.describe(net)),
                None => format!("{} is placed", first(node)),
            },
            Constraint::Together { .. } => "objects that lie together".to_owned(),
            Constraint::Forbidden { .. } => {
                "a set of objects that the chip could not hold".to_owned()
            }
        })
        .collect()
}

/// The object with a name: a step, transition, variable, action or output. A word before the name selects the kind: `step p1`.
#[must_use]
pub fn item(net: &Net, text: &str) -> Option<Item> {
    let (kind, name) = text.split_once(' ').map_or(("", text), |(kind, name)| (kind, name.trim()));
    let is = |word: &str| kind.is_empty() || kind == word;
    let mut all: Vec<(&str, Item)> = Vec::new();
    let named = |it: &grafsynth_ir::Name| it.text == name;
    all.extend(
        net.steps.iter().filter(|(_, it)| named(&it.name)).map(|(id, _)| ("step", Item::Step(id))),
    );
    all.extend(
        net.transitions
            .iter()
            .filter(|(_, it)| named(&it.name))
            .map(|(id, _)| ("transition", Item::Transition(id))),
    );
    all.extend(
        net.vars
            .iter()
            .filter(|(_, it)| named(&it.name))
            .map(|(id, _)| ("variable", Item::Var(id))),
    );
    all.extend(
        net.outputs
            .iter()
            .filter(|(_, it)| named(&it.name))
            .map(|(id, _)| ("output", Item::Output(id))),
    );
    all.extend(
        net.actions
            .iter()
            .filter(|(_, it)| named(&it.name))
            .map(|(id, _)| ("action", Item::Action(id))),
    );
    all.into_iter().find(|(word, _)| is(word)).map(|(_, item)| item)
}

/// The object of a placement of the chart.
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
    let steps = net.steps.values().map(|it| it.name.text.as_str());
    let transitions = net.transitions.values().map(|it| it.name.text.as_str());
    let vars = net.vars.values().map(|it| it.name.text.as_str());
    let outputs = net.outputs.values().map(|it| it.name.text.as_str());
    steps.chain(transitions).chain(vars).chain(outputs)
}
