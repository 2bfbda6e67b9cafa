//! The clocks of the registers, the timing requirements of inputs, and the number of clocks of a reaction.

use super::chip::{Chip, Kind, Reads, Signal};
use super::document::{Block, Inline, Rich, Table};
use super::{Subject, counted};
use grafsynth_backend_pld::device::Clock;
use grafsynth_ir::logic::PinRole;

/// The maximum number of names in a list.
const MOST_NAMES: usize = 12;

pub(super) fn write(subject: &Subject<'_>, chip: &Chip) -> Vec<Block> {
    let reads = chip.reads();
    let mut items = Vec::new();
    items.push(clocked(chip, &reads));
    if chip.code.is_some() {
        items.push(clocks(chip));
    }
    items.extend(synchronisers(chip));
    items.extend(paths(chip, &reads));
    items.extend(depth(chip, &reads).map(Rich::plain));
    let mut blocks = vec![Block::List(items.into_iter().map(Into::into).collect())];
    blocks.extend(inputs(subject, chip, &reads));
    blocks
}

fn names<'s>(signals: impl Iterator<Item = &'s Signal>) -> String {
    let all: Vec<&str> = signals.map(|signal| signal.name.as_str()).collect();
    match all.len() {
        0 => "none".to_owned(),
        n if n > MOST_NAMES => {
            format!("{}, and {} more", all[..MOST_NAMES].join(", "), n - MOST_NAMES)
        }
        _ => all.join(", "),
    }
}

/// Registers and their clock.
fn clocked(chip: &Chip, reads: &[Reads]) -> Rich {
    let registers: Vec<&Signal> =
        reads.iter().filter(|one| one.is_registered).map(|one| &chip.signals[one.signal]).collect();
    if registers.is_empty() {
        return Rich::say("There is no clock: every output follows the inputs.", []);
    }
    let clock = chip.signals.iter().find(|signal| signal.kind == Kind::Clock);
    let name = match clock {
        Some(clock) => Inline::Code(clock.name.clone()),
        None => "the clock".into(),
    };
    let (device, pin) = (chip.device.map(|device| device.clock), clock.and_then(|it| it.pin));
    let how = match (device, pin) {
        (Some(Clock::Term), Some(pin)) => {
            format!(" (pin {pin}, through a product term of each macrocell)")
        }
        (Some(Clock::Pin(pin)), _) => format!(" (pin {pin}, the clock of the device)"),
        (_, Some(pin)) => format!(" (pin {pin})"),
        (_, None) => String::new(),
    };
    let many = counted(registers.len(), "register", "registers");
    Rich::say(
        "The rising edge of {}{} clocks {}: {}.",
        [name, how.into(), many.into(), names(registers.into_iter()).into()],
    )
}

/// Clocks of a reaction.
fn clocks(chip: &Chip) -> Rich {
    let is_busy = chip.circuit.outputs.values().any(|output| output.role == PinRole::Busy);
    let how = chip.evolution.as_ref().map_or(String::new(), |how| format!(" ({how})"));
    let words = if is_busy {
        "A reaction takes one clock for each micro-step and one more; meanwhile `busy` is high, and the outputs keep their values{}."
    } else {
        "A reaction takes 1 clock{}: the outputs show its result after the edge, while the inputs are still held."
    };
    Rich::say(words, [how.into()])
}

fn synchronisers(chip: &Chip) -> Option<Rich> {
    let chain = chip.chains.first()?;
    let pins = chip.chains.iter().map(|chain| chip.circuit.inputs[chain.input].name.clone());
    Some(Rich::plain(format!(
        "{} {} in front of each of these inputs: {}. They arrive {} later, and may change at any time.",
        counted(chain.flops.len(), "synchroniser flip-flop", "synchroniser flip-flops"),
        if chain.flops.len() == 1 { "is" } else { "are" },
        pins.collect::<Vec<_>>().join(", "),
        counted(chain.flops.len(), "clock", "clocks"),
    )))
}

/// Combinational paths from an input to an output.
fn paths(chip: &Chip, reads: &[Reads]) -> Option<Rich> {
    let is_input = |signal: &usize| matches!(chip.signals[*signal].kind, Kind::Input(_));
    let paths: Vec<String> = (reads.iter())
        .filter(|one| !one.is_registered)
        .filter(|one| matches!(chip.signals[one.signal].kind, Kind::Output(_)))
        .filter_map(|one| {
            let inputs: Vec<&Signal> =
                one.signals.iter().filter(|at| is_input(at)).map(|at| &chip.signals[*at]).collect();
            let name = &chip.signals[one.signal].name;
            (!inputs.is_empty()).then(|| format!("{name} from {}", names(inputs.into_iter())))
        })
        .collect();
    let outputs = chip.circuit.outputs.len();
    if outputs == 0 {
        return None;
    }
    if paths.is_empty() {
        let none = "There is no combinational path from an input to an output: outputs are stable between clocks.";
        return Some(Rich::say(none, []));
    }
    let advice = if chip.code.is_some() {
        " (declare an output `registered` to keep it stable)"
    } else {
        ""
    };
    let text = Rich::plain("These outputs follow inputs between clocks").and(Rich::say(advice, []));
    Some(text.and(Rich::say(": {}.", [paths.join("; ").into()])))
}

/// The number of passes through the array on the longest path.
fn depth(chip: &Chip, reads: &[Reads]) -> Option<String> {
    chip.device?;
    let depths = depths(chip);
    let of = |is_registered: bool| {
        let all = chip.cells.iter().zip(&depths);
        all.filter(|(cell, _)| cell.is_registered() == is_registered).map(|(_, depth)| *depth).max()
    };
    let passes = |n: usize| match n {
        1 => "once".to_owned(),
        n => format!("{n} times"),
    };
    let mut parts = Vec::new();
    if let Some(depth) = of(true) {
        parts.push(format!(
            "a register's input passes through the array {}: the clock period is at least the clock-to-feedback delay of the data sheet, that many array delays, and the set-up time",
            passes(depth)
        ));
    }
    if let Some(depth) = of(false)
        && reads.iter().any(|one| !one.is_registered)
    {
        parts.push(format!(
            "a combinational output passes through it {} after the clock",
            passes(depth)
        ));
    }
    let text = parts.join("; ");
    let mut letters = text.chars();
    let first = letters.next()?;
    Some(format!("{}{}.", first.to_uppercase(), letters.as_str()))
}

/// For each macrocell, the number of sums on its longest path from a pin or register. Combinational macrocells never form a loop.
fn depths(chip: &Chip) -> Vec<usize> {
    let cell_of = chip.combinational();
    let mut depths = vec![1; chip.cells.len()];
    // As many passes as macrocells are enough for the longest possible chain.
    for _ in 0..chip.cells.len() {
        let before = depths.clone();
        for (at, cell) in chip.cells.iter().enumerate() {
            let literals = cell.sum.iter().chain(&cell.inverter).flatten();
            let through = literals.filter_map(|(signal, _)| cell_of[*signal]);
            depths[at] = 1 + through.map(|other| before[other]).max().unwrap_or(0);
        }
        if depths == before {
            break;
        }
    }
    depths
}

/// A row for each input: its timing requirement, and the registers that read it.
fn inputs(subject: &Subject<'_>, chip: &Chip, reads: &[Reads]) -> Vec<Block> {
    let mut table = Table::new(["Input", "Timing", "Registers that read it"]);
    let mut is_exposed = false;
    for (at, signal) in chip.signals.iter().enumerate() {
        let Kind::Input(input) = signal.kind else { continue };
        let pin = &chip.circuit.inputs[input];
        let readers: Vec<&Signal> = (reads.iter())
            .filter(|one| one.is_registered && one.signals.contains(&at))
            .map(|one| &chip.signals[one.signal])
            .collect();
        let is_declared = match pin.role {
            PinRole::Input(id, _) => subject.net.inputs[id].synchronous,
            _ => false,
        };
        let is_synchronised = chip.chains.iter().any(|chain| chain.input == input);
        let is = if is_synchronised {
            "synchronised on the chip: may change at any time"
        } else if is_declared {
            "declared `synchronous`"
        } else if readers.len() > 1 {
            is_exposed = true;
            "must be synchronous to the clock"
        } else if readers.is_empty() {
            "read by no register"
        } else {
            "read by one register"
        };
        table.row([signal.name.clone(), String::new(), names(readers.into_iter())]);
        table.set_last(1, Rich::say(is, []));
    }
    if table.is_empty() {
        return Vec::new();
    }
    let mut blocks = vec![Block::Table(table)];
    if is_exposed {
        let words = "An input that must be synchronous to the clock must be stable from the set-up time before the edge to the hold time after it. If it changes there, the registers that read it can store different values, and the chip can reach a state that the chart does not have. Make the external circuit change it after the edge, or add synchronisers: `--synchronise 1` or `2`.";
        blocks.push(Block::Paragraph(Rich::say(words, [])));
    }
    blocks
}
