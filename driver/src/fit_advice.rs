//! Finds changes that would make a design fit: other encodings, other settings or other devices.
//!
//! These changes are suggested only if the design was really fitted with them: with new encodings, sums and pins and, for a fuse map, down to the fuses.
//! [`MOST_FITS`] bounds the search; devices that are too small in any case are skipped. A longer tick is tried too (`slower`). If nothing fits, an encoder for events
//! or a second chip is suggested without a trial.

mod slower;

use crate::circuit::{emit_options, may_be_free, synchronised};
use crate::coding::{self, Encoding, EncodingCache, EncodingChoice, encoding_name};
use crate::context::{BuildContext, Medium};
use grafsynth_backend_pld::codes::DOES_NOT_FIT;
use grafsynth_backend_pld::device::{Clock, DEVICES, Device, Polarity};
use grafsynth_backend_pld::equations::Equations;
use grafsynth_backend_pld::fuse;
use grafsynth_backend_pld::{Dialect, EmitOptions};
use grafsynth_ir::diag::Label;
use grafsynth_ir::expr::{Expr, ExprKind};
use grafsynth_ir::logic::{Logic, Node, PinRole};
use grafsynth_ir::net::{InputKind, Leaf, Net, StepId};
use grafsynth_ir::program::Origin;
use grafsynth_ir::{Diagnostic, Name, Span, counted};
use grafsynth_logic::build::needed;
use std::collections::BTreeMap;
use std::rc::Rc;

/// The maximum number of fits that are tried.
const MOST_FITS: usize = 16;
/// The maximum number of suggestions.
const MOST_NAMED: usize = 3;

/// The settings of a trial.
#[derive(Clone, Copy)]
struct Trial {
    device: &'static Device,
    encoding: EncodingChoice,
    dont_cares: bool,
    safe: bool,
}

/// Adds suggestions to the findings of a failed fit.
pub(crate) fn advise(asked: &BuildContext<'_>, found: &mut [Diagnostic]) {
    let is_misfit =
        |finding: &Diagnostic| [DOES_NOT_FIT, fuse::codes::CANNOT_HOLD].contains(&finding.code);
    if found.is_empty() || !found.iter().all(is_misfit) {
        return;
    }
    if let Some(first) = found.first_mut() {
        first.help = Some(advice_for(asked));
        // If a time uses most of the device, it is what the user should change.
        if let Some(time) = long_time(asked).filter(|time| time.span != Span::default()) {
            let text = format!(
                "counts {}, in {}",
                counted(time.ticks, "tick", "ticks"),
                counted(time.n, "register", "registers")
            );
            first.labels.insert(0, Label { span: time.span, text });
        }
    }
}

/// The suggestions, as a sentence.
pub(crate) fn advice_for(asked: &BuildContext<'_>) -> String {
    asked.device().map_or_else(String::new, |device| advice(asked, device))
}

fn advice(asked: &BuildContext<'_>, device: &'static Device) -> String {
    let trials = trials(asked, device);
    let mut fits: Vec<String> = Vec::new();
    let mut named: Vec<&str> = Vec::new();
    let mut n_tried = 0;
    let mut known = EncodingCache::default();
    for trial in &trials {
        if n_tried == MOST_FITS || fits.len() == MOST_NAMED {
            break;
        }
        // A device that was already suggested is not suggested with another encoding.
        if trial.device != device && named.contains(&trial.device.name) {
            continue;
        }
        n_tried += 1;
        if let Some((coded, n_cells, n_terms)) = fit(asked, trial, &mut known) {
            let mut options: Vec<String> = Vec::new();
            named.push(trial.device.name);
            if trial.device != device {
                options.push(format!("--device {}", trial.device.name));
            }
            if trial.encoding != asked.options.encoding {
                options.push(format!("--encoding {}", encoding_name(coded)));
            }
            if trial.dont_cares != asked.options.dont_cares {
                options.push("with don't-cares (omit --no-dc)".to_owned());
            }
            if trial.safe != asked.options.safe {
                options.push("without the return from illegal situations (omit --safe)".to_owned());
            }
            let code = match trial.encoding {
                EncodingChoice::Auto => format!(", {}", encoding_name(coded)),
                EncodingChoice::This(_) => String::new(),
            };
            fits.push(format!(
                "{} ({}, {}{code})",
                options.join(" and "),
                counted(n_cells, "macrocell", "macrocells"),
                counted(n_terms, "product term", "product terms")
            ));
        }
    }
    let longer = slower::tick(asked, &as_asked(asked, device));
    if !fits.is_empty() {
        fits.extend(longer);
        return format!("these were tried and fit: {}", fits.join("; "));
    }
    let mut tried = match n_tried {
        0 => "no other device or setting is large enough".to_owned(),
        1 => "it does not fit the only other device or setting either".to_owned(),
        n if n < trials.len() => format!(
            "{n} of {} other devices and settings were tried, and it does not fit any of them either (--device NAME tries another one)",
            trials.len()
        ),
        n => format!("it does not fit any of the {n} other devices and settings either"),
    };
    if known.is_spent() {
        tried.push_str(" (the search for codes reached its limit)");
    }
    match longer
        .or_else(|| times(asked))
        .or_else(|| encoder(asked.net))
        .or_else(|| by_hand(asked.logic))
    {
        Some(by_hand) => format!("{tried}; {by_hand}"),
        None => format!(
            "{tried}; split the chart, or build for `palasm` or `cupl`, which leave pins unassigned"
        ),
    }
}

/// The settings of the build itself.
fn as_asked(asked: &BuildContext<'_>, device: &'static Device) -> Trial {
    let options = asked.options;
    Trial { device, encoding: options.encoding, dont_cares: options.dont_cares, safe: options.safe }
}

/// The trials, the smallest change first: encodings and settings on the same device, then devices, the smallest first, then both.
fn trials(asked: &BuildContext<'_>, device: &'static Device) -> Vec<Trial> {
    let options = asked.options;
    let same = as_asked(asked, device);
    let codes: Vec<EncodingChoice> = match options.encoding {
        EncodingChoice::Auto => Vec::new(),
        EncodingChoice::This(own) => [Encoding::OneHot, Encoding::ZeroHot, Encoding::Compact]
            .into_iter()
            .filter(|encoding| *encoding != own)
            .map(EncodingChoice::This)
            .collect(),
    };
    let mut trials: Vec<Trial> = Vec::new();
    if may_hold(asked, device) {
        trials.extend(codes.iter().map(|&encoding| Trial { encoding, ..same }));
        if !options.dont_cares && may_be_free(asked.net) && !options.safe {
            trials.push(Trial { dont_cares: true, ..same });
        }
        if options.safe {
            trials.push(Trial { safe: false, ..same });
        }
    }
    let mut others: Vec<&'static Device> = DEVICES
        .iter()
        .filter(|other| {
            // A GAL that replaces a PAL (`-as-`) is not suggested, because the GAL itself can implement the same designs.
            **other != *device && !other.name.contains("-as-") && may_hold(asked, other)
        })
        .collect();
    // The old PALs come last: they can be programmed only once, and their polarities are fixed.
    others.sort_by_key(|device| {
        let is_fixed = device.polarity != Polarity::Programmable;
        (is_fixed, device.n_pins, device.macrocells.len())
    });
    trials.extend(others.iter().map(|&device| Trial { device, ..same }));
    for &device in &others {
        trials.extend(codes.iter().map(|&encoding| Trial { device, encoding, ..same }));
    }
    trials
}

/// True if the device has pins for the inputs and macrocells for the outputs; whether everything else fits is not checked.
fn may_hold(asked: &BuildContext<'_>, device: &Device) -> bool {
    let (n_inputs, n_outputs) = (asked.logic.inputs.len(), asked.logic.outputs.len());
    let has_flops = !asked.logic.flops.is_empty();
    let n_flops = usize::from(has_flops && n_outputs == 0);
    device.macrocells.len() >= n_outputs + n_flops
        && n_inputs + n_outputs + usize::from(has_flops) <= device.n_pins as usize - 2
        && (!has_flops || device.clock != Clock::None)
        && (device.layout.is_some() || asked.medium.dialect() != Dialect::Galasm)
}

/// Fits the design with the settings of a trial; returns the encoding, macrocells and product terms.
fn fit(
    asked: &BuildContext<'_>,
    trial: &Trial,
    known: &mut EncodingCache,
) -> Option<(Encoding, usize, usize)> {
    let own = asked.device()?;
    let mut wishes = EmitOptions {
        dont_cares: trial.dont_cares,
        ..emit_options(asked.net, Some(trial.device.name), None)
    };
    if trial.device != own {
        // The pin numbers are for another package.
        wishes.pins.clear();
    }
    let BuildContext { net, facts, logic, own_timers, .. } = *asked;
    let (choice, dialect) = ((trial.encoding, trial.safe), asked.medium.dialect());
    let timed = coding::Timed { logic, own_timers };
    let coded = coding::code_timed(known, net, facts, timed, choice, dialect, &wishes);
    let (circuit, chains) = synchronised(net, coded.emitted(), asked.options.synchronise);
    let equations = coded.equations.filter(|_| chains.is_empty());
    if asked.medium == Medium::Fuses {
        let (placement, _) = fuse::place_from(equations, &circuit, &wishes).ok()?;
        fuse::map(&placement).ok()?;
        let n_terms = placement.cells.iter().map(|cell| cell.sum.len()).sum();
        return Some((coded.encoding, placement.cells.len(), n_terms));
    }
    let made = match equations {
        Some(made) => made,
        None => Rc::new(Equations::new(&circuit, dialect, &wishes).ok()?),
    };
    if !made.has_pins {
        return None;
    }
    let n_terms = made.equations.iter().map(|equation| equation.products.len()).sum();
    Some((coded.encoding, made.equations.len(), n_terms))
}

/// A time that uses at least half of the registers.
struct LongTime<'a> {
    name: &'a Name,
    /// The number of its registers.
    n: u32,
    /// The largest number of ticks that it is compared with.
    ticks: u64,
    /// The location of that comparison.
    span: Span,
}

/// The time that uses the most registers, if these are at least five and at least half of all.
fn long_time<'a>(asked: &BuildContext<'a>) -> Option<LongTime<'a>> {
    const WORTH_A_WORD: u32 = 5;
    let net = asked.net;
    let mut registers: BTreeMap<Origin, u32> = BTreeMap::new();
    for bit in asked.logic.flops.values().filter_map(|flop| flop.holds) {
        *registers.entry(bit.origin).or_default() += 1;
    }
    let (time, n, name) = registers
        .into_iter()
        .filter_map(|(origin, n)| {
            if let Origin::Elapsed(step) = origin {
                return Some((Leaf::Elapsed(step), n, &net.steps[step].name));
            }
            if let Origin::SharedElapsed(_) = origin {
                let step = longest_of_shared(asked, n)?;
                return Some((Leaf::Elapsed(step), n, &net.steps[step].name));
            }
            let Origin::Timer(timer) = origin else { return None };
            Some((Leaf::Timer(timer), n, &net.timers[timer].name))
        })
        .max_by_key(|(_, n, _)| *n)?;
    let n_flops = asked.logic.flops.len();
    if n < WORTH_A_WORD || (n as usize) * 2 < n_flops {
        return None;
    }
    // A time stops counting one above the largest number of ticks that it is compared with.
    let guards = net.transitions.values().map(|one| longest(&one.guard, time));
    let (ticks, span) = guards.max_by_key(|(ticks, _)| *ticks)?;
    (bits(ticks) == n).then_some(LongTime { name, n, ticks, span })
}

/// The step with the longest of the times that share a timer of `n` registers.
fn longest_of_shared(asked: &BuildContext<'_>, n: u32) -> Option<StepId> {
    let guards = || asked.net.transitions.values().map(|one| &one.guard);
    let ticks =
        |step| guards().map(|guard| longest(guard, Leaf::Elapsed(step)).0).max().unwrap_or(0);
    let sharing = asked.logic.decoded.iter().filter_map(|bit| match bit.holds.origin {
        Origin::Elapsed(step) => Some(step),
        _ => None,
    });
    sharing.filter(|step| bits(ticks(*step)) == n).max_by_key(|step| ticks(*step))
}

/// The number of registers of a time that is compared with this number of ticks.
fn bits(ticks: u64) -> u32 {
    u64::BITS - (ticks + 1).leading_zeros()
}

/// Suggests a longer tick for a time that uses at least half of the registers, with the number of registers that the time would then use.
fn times(asked: &BuildContext<'_>) -> Option<String> {
    const LONGER: [u64; 3] = [10, 100, 1000];
    let LongTime { name, n, ticks, .. } = long_time(asked)?;
    let (n_flops, tick) = (asked.logic.flops.len(), asked.net.settings.tick_ns);
    let longer: Vec<String> = LONGER
        .iter()
        .filter(|factor| ticks.is_multiple_of(**factor))
        .map(|factor| {
            format!("{} with a tick of {}", bits(ticks / factor), duration(tick * factor))
        })
        .collect();
    if longer.is_empty() {
        return None;
    }
    let said = format!(
        "the time of `{name}` takes {n} of {n_flops} registers, because it counts {ticks} ticks of {}; it would take {}",
        duration(tick),
        longer.join(", ")
    );
    // The shortest tick with which the macrocells are enough.
    let n_outputs = asked.logic.outputs.values().filter(|one| one.registered.is_none()).count();
    let n_cells = asked.device()?.macrocells.len();
    let left = |factor: u64| n_flops - n as usize + bits(ticks / factor) as usize;
    let enough = LONGER
        .into_iter()
        .filter(|factor| ticks.is_multiple_of(*factor))
        .find(|factor| left(*factor) + n_outputs <= n_cells);
    Some(match enough {
        Some(factor) => {
            let tick = duration(tick * factor);
            format!(
                "{said}; with `tick {tick}` (in rules `# option: tick {tick}`), there are enough macrocells for its {} and {}, but its times are only accurate to {tick}",
                counted(left(factor), "register", "registers"),
                counted(n_outputs, "output", "outputs")
            )
        }
        None => said,
    })
}

/// The largest constant that a time is compared with, and its location; 0 if there is none.
fn longest(expr: &Expr<Leaf>, time: Leaf) -> (u64, Span) {
    let mut here = (0, expr.span);
    if let ExprKind::Compare(_, a, b) = &expr.kind
        && let (ExprKind::Leaf(leaf), ExprKind::Int(n)) | (ExprKind::Int(n), ExprKind::Leaf(leaf)) =
            (&a.kind, &b.kind)
        && *leaf == time
    {
        here.0 = u64::try_from(*n).unwrap_or(0);
    }
    let inner = expr.children().map(|operand| longest(operand, time));
    inner.chain([here]).max_by_key(|(ticks, _)| *ticks).unwrap_or(here)
}

/// A duration in the largest unit that divides it.
fn duration(ns: u64) -> String {
    const UNITS: [(u64, &str); 5] = [
        (60_000_000_000, "min"),
        (1_000_000_000, "s"),
        (1_000_000, "ms"),
        (1_000, "us"),
        (1, "ns"),
    ];
    let (unit, name) =
        UNITS.into_iter().find(|(unit, _)| ns.is_multiple_of(*unit)).unwrap_or((1, "ns"));
    format!("{} {name}", ns / unit)
}

/// Suggests an encoder for events that never occur together: they need a number and a strobe, not a pin each.
fn encoder(net: &Net) -> Option<String> {
    let n = net.inputs.values().filter(|input| input.kind == InputKind::Event).count();
    let n_bits = usize::BITS - n.saturating_sub(1).leading_zeros();
    let is_fewer = n_bits as usize + 1 < n;
    (net.settings.events_exclusive && is_fewer).then(|| {
        format!(
            "its {n} events never occur together, so an encoder outside the chip can reduce them to a strobe and {n_bits} pins: declare `event strobe` and `input code: int 0..{}`, and write `strobe when code = 0` and so on in place of the events", n - 1
        )
    })
}

/// Suggests two chips: describes what a second chip for the outputs would contain.
fn by_hand(logic: &Logic) -> Option<String> {
    let moved: Vec<_> = (logic.outputs.values())
        .filter(|output| output.registered.is_none() && output.role != PinRole::Busy)
        .collect();
    if moved.len() < 2 || logic.flops.is_empty() {
        return None;
    }
    let cone = needed(logic, moved.iter().map(|output| output.value));
    let reads = |is_kind: fn(&Node) -> bool| {
        logic.nodes.iter().filter(|(id, node)| cone[*id] && is_kind(node)).count()
    };
    let n_flops = reads(|node| matches!(node, Node::Flop(_)));
    let n_inputs = reads(|node| matches!(node, Node::Input(_)));
    Some(format!(
        "divided by hand, it may fit two chips: a second one for the {} outputs reads {} and {}, and the first keeps {} and {}",
        moved.len(),
        counted(n_flops, "flip-flop", "flip-flops"),
        counted(n_inputs, "input", "inputs"),
        counted(logic.flops.len(), "flip-flop", "flip-flops"),
        counted(logic.inputs.len(), "input", "inputs")
    ))
}
