//! Why there is no partition, in the words of the chart: the constraints that contradict each other, with the numbers.

use super::free::Late;
use super::{Request, spec};
use crate::codes;
use grafsynth_ir::division::{PartIndex, Running};
use grafsynth_ir::net::Net;
use grafsynth_ir::{Diagnostic, Span, counted};
use grafsynth_split::codes::{APART, PINS};
use grafsynth_split::partition::{Place, Unplaced};
use grafsynth_split::solve::{Amount, Conflict, Constraint, Fight, Forbidden};
use grafsynth_split::{Groups, Item};
use itertools::Itertools as _;
use std::collections::BTreeMap;

/// The largest number of objects that a message names of a set.
const MOST_NAMED: usize = 3;

/// Decisions that the search excludes, of which one must be different, and why.
#[derive(Debug, Clone)]
pub(super) struct Exclusion {
    pub(super) forbidden: Forbidden,
    pub(super) why: Excluded,
}

/// Why decisions are excluded.
#[derive(Debug, Clone)]
pub(super) enum Excluded {
    /// A deadline is missed.
    Late(Late),
    /// A part was built and did not fit its device, or its link could not be wired.
    Built,
}

/// No partition, and the exclusions of the search that found none; a conflict names them by their indices.
pub(super) struct NoPartition {
    pub(super) why: Unplaced,
    pub(super) exclusions: Vec<Exclusion>,
}

impl Exclusion {
    /// A transition on a CPU that is too slow for its deadline.
    pub(super) fn late(late: Late) -> Exclusion {
        let forbidden = Forbidden::Decisions(vec![(late.group, late.part)]);
        Exclusion { forbidden, why: Excluded::Late(late) }
    }

    /// The transition, if its deadline is the reason.
    fn late_transition(&self) -> Option<&Late> {
        match &self.why {
            Excluded::Late(late) => Some(late),
            Excluded::Built => None,
        }
    }

    /// What was built and did not fit.
    pub(super) fn built(forbidden: Forbidden) -> Exclusion {
        Exclusion { forbidden, why: Excluded::Built }
    }
}

impl NoPartition {
    /// Constraints contradict each other.
    pub(super) fn is_conflict(&self) -> bool {
        matches!(self.why, Unplaced::Conflict(_))
    }

    /// A search that counts less than estimates may still find a partition.
    pub(super) fn may_be_of_estimates(&self) -> bool {
        matches!(self.why, Unplaced::Conflict(_) | Unplaced::Unknown)
    }
}

/// The findings when there is no partition.
pub(super) fn unplaced(
    net: &Net,
    groups: &Groups,
    request: &Request<'_>,
    none: &NoPartition,
    excluded: usize,
) -> Vec<Diagnostic> {
    let part = |at: usize| request.parts.get(at).map_or("", |part| part.name.as_str());
    let one = match &none.why {
        Unplaced::Places(one, other) => {
            let (a, b) = (one.item.describe(net), other.item.describe(net));
            let (first, second) = (part(one.part), part(other.part));
            let chain: Vec<String> = groups
                .chain(one.item, other.item)
                .iter()
                .map(|bond| {
                    let (one, other) = (bond.one.describe(net), bond.other.describe(net));
                    format!("{one} {} {other}", bond.why.text())
                })
                .collect();
            let message = if one.item == other.item {
                format!("{a} is placed on `{first}` and on `{second}`")
            } else {
                let why = chain.join(", ");
                format!(
                    "{a} is placed on `{first}` and {b} on `{second}`, but they cannot be separated: {why}"
                )
            };
            let found = Diagnostic::error(APART, message).help("remove one of the placements");
            written_at(written_at(found, one.span), other.span)
        }
        Unplaced::NeedsCpu(place, reason) => {
            let message = format!(
                "{} is placed on `{}`, but only a CPU can have it: {reason}",
                place.item.describe(net),
                part(place.part)
            );
            let found = Diagnostic::error(codes::NO_PARTITION, message)
                .help("place it on the CPU, or remove the placement");
            written_at(found, place.span)
        }
        Unplaced::Conflict(conflict) => {
            contradiction(net, groups, request, (conflict, &none.exclusions), excluded)
        }
        Unplaced::Unknown => {
            Diagnostic::error(codes::NO_PARTITION, "the search for a partition reached its limit")
                .help("place some objects with `--place`: fewer choices are then left")
        }
        Unplaced::Malformed(error) => {
            Diagnostic::error(codes::NO_PARTITION, format!("no partition: {error}"))
        }
    };
    vec![one]
}

/// The finding if constraints contradict each other.
fn contradiction(
    net: &Net,
    groups: &Groups,
    request: &Request<'_>,
    (conflict, exclusions): (&Conflict, &[Exclusion]),
    excluded: usize,
) -> Diagnostic {
    let mut message = "no partition fits: ".to_owned();
    message += &fights(net, groups, request, (conflict, exclusions)).join("; ");
    if excluded > 0 {
        message += &format!(
            " ({} built, and none fits)",
            counted(excluded, "partition was", "partitions were")
        );
    }
    let is_pins = lacks_pins_of_cpu(request, conflict);
    let code = if is_pins { PINS } else { codes::NO_PARTITION };
    let reset = if request.reset && saves_reset(request, conflict) {
        "; or save the wire that resets the chips (`--no-reset`)"
    } else {
        ""
    };
    let late: Vec<&Late> = conflict
        .fights
        .iter()
        .filter_map(|fight| match fight.constraint {
            Constraint::Forbidden { set } => exclusions.get(set)?.late_transition(),
            _ => None,
        })
        .collect();
    let longer = if late.is_empty() { "" } else { ", make the deadline longer" };
    let help = "use larger devices, place fewer objects on the one that is too small";
    let found =
        Diagnostic::error(code, message).help(format!("{help}{longer}, or add a part{reset}"));
    let spans = late.iter().map(|late| net.transitions[late.transition].meta.span);
    let found = spans.fold(found, |found, span| found.at(span, "has a deadline"));
    let placed = conflict.fights.iter().filter_map(|fight| match fight.constraint {
        Constraint::Allowed { node } => place_of(groups, request, node),
        _ => None,
    });
    placed.fold(found, |found, place| written_at(found, place.span))
}

/// Whether the reset uses something that is among the constraints that contradict each other: a pin of each part, and macrocells of chips that run on their own.
fn saves_reset(request: &Request<'_>, conflict: &Conflict) -> bool {
    conflict.fights.iter().any(|fight| match fight.constraint {
        Constraint::Pins { .. } => true,
        Constraint::Capacity { resource: 0, .. } => request.running == Running::Free,
        _ => false,
    })
}

/// Whether the pins of the CPU are among the constraints that contradict each other.
pub(super) fn lacks_pins_of_cpu(request: &Request<'_>, conflict: &Conflict) -> bool {
    let cpu = request.parts.len().saturating_sub(1);
    conflict.fights.iter().any(|fight| fight.constraint == Constraint::Pins { part: cpu })
}

/// Adds the location of a place, if it is in the chart.
fn written_at(found: Diagnostic, span: Span) -> Diagnostic {
    if span == Span::default() { found } else { found.at(span, "placed here") }
}

/// The place of an object of a group, if the designer placed one.
pub(super) fn place_of<'r>(
    groups: &Groups,
    request: &Request<'r>,
    group: usize,
) -> Option<&'r Place> {
    request.places.iter().find(|place| groups.of.get(&place.item) == Some(&group))
}

/// What the device of a part has of a resource.
fn room(request: &Request<'_>, part: usize, constraint: Constraint) -> Option<u64> {
    let spec = spec(request.parts.get(part)?, request.reset);
    match constraint {
        Constraint::Capacity { resource: 0, .. } => spec.cells,
        Constraint::Pins { .. } => spec.pins,
        _ => None,
    }
}

/// The constraints that contradict each other, with the required and the available amounts.
fn fights(
    net: &Net,
    groups: &Groups,
    request: &Request<'_>,
    (conflict, exclusions): (&Conflict, &[Exclusion]),
) -> Vec<String> {
    let part = |at: usize| request.parts.get(at).map_or("", |part| part.name.as_str());
    let amount = |at: usize, what: &str, fight: &Fight| match fight.amount {
        Some(Amount { need: Some(need), have }) => match room(request, at, fight.constraint) {
            // After a build that did not fit, the search offers less than the chip has.
            Some(room) if have < room => format!(
                "`{}` needs at least {need} {what} by estimate, but no build that used more than {have} of its {room} fitted",
                part(at)
            ),
            _ => format!("`{}` needs at least {need} {what}, but has {have}", part(at)),
        },
        Some(Amount { need: None, have }) => format!("`{}` has only {have} {what}", part(at)),
        None => format!("the {what} of `{}`", part(at)),
    };
    conflict
        .fights
        .iter()
        .map(|fight| match fight.constraint {
            Constraint::Capacity { part: at, resource: 0 } => amount(at, "macrocells", fight),
            // What is left after a build, by estimate; the finding of that build has the numbers.
            Constraint::Capacity { part: at, .. } => format!("the memory of `{}`", part(at)),
            Constraint::Pins { part: at } => amount(at, "pins", fight),
            Constraint::Allowed { node } => match groups.cpu_only.get(&node) {
                Some((item, why)) => format!("{} needs the CPU: {why}", item.describe(net)),
                None => place_of(groups, request, node).map_or_else(
                    || "an object is placed".to_owned(),
                    |place| {
                        format!("{} is placed on `{}`", place.item.describe(net), part(place.part))
                    },
                ),
            },
            Constraint::Together { .. } => "objects that must be on the same part".to_owned(),
            Constraint::Forbidden { set } => exclusions.get(set).map_or_else(
                || "an excluded set of objects".to_owned(),
                |exclusion| excluded(net, groups, request, exclusion),
            ),
        })
        .unique()
        .collect()
}

/// Why decisions are excluded, in words.
fn excluded(net: &Net, groups: &Groups, request: &Request<'_>, one: &Exclusion) -> String {
    let part = |at: usize| request.parts.get(at).map_or("", |part| part.name.as_str());
    if let Excluded::Late(late) = &one.why {
        return late.said(net, part(late.part));
    }
    let decisions = one.forbidden.decisions();
    if decisions.len() == groups.groups.len() {
        return "the partitions that were built".to_owned();
    }
    let mut on: BTreeMap<PartIndex, Vec<usize>> = BTreeMap::new();
    decisions.iter().for_each(|&(group, at)| on.entry(at).or_default().push(group));
    let sets =
        on.iter().map(|(at, own)| format!("{} on `{}`", objects(net, groups, own), part(*at)));
    format!("{} did not fit when built", sets.format(" with "))
}

/// The objects of some groups; of many, the first ones and a number.
fn objects(net: &Net, groups: &Groups, own: &[usize]) -> String {
    let all: Vec<Item> =
        own.iter().filter_map(|at| groups.groups.get(*at)).flatten().copied().collect();
    let (named, rest) = all.split_at(all.len().min(MOST_NAMED));
    let named: Vec<String> = named.iter().map(|item| item.describe(net)).collect();
    match (rest.len(), &named[..]) {
        (0, [first @ .., last]) if !first.is_empty() => {
            format!("{} and {last}", first.join(", "))
        }
        (0, _) => named.concat(),
        (n, _) => format!("{} and {}", named.join(", "), counted(n, "more object", "more objects")),
    }
}
