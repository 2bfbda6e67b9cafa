//! What is clocked by what, what inputs have to keep to, and how many clocks a reaction takes.

use super::chip::{Chip, Kind, Reads, Signal};
use super::{Subject, counted, table::Table, table::inline};
use grafsynth_backend_pld::device::Clock;
use grafsynth_ir::logic::PinRole;

/// Lists of names are cut after so many.
const MOST_NAMES: usize = 12;

pub(super) fn write(subject: &Subject<'_>, chip: &Chip) -> Option<String> {
    let reads = chip.reads();
    let mut items = Vec::new();
    items.push(clocked(chip, &reads));
    if chip.code.is_some() {
        items.push(clocks(chip));
    }
    items.extend(synchronisers(chip));
    items.extend(paths(chip, &reads));
    items.extend(depth(chip, &reads));
    let list: String = items.iter().map(|item| format!("- {item}\n")).collect();
    let inputs = inputs(subject, chip, &reads);
    Some(format!("{list}{inputs}"))
}

fn names<'s>(signals: impl Iterator<Item = &'s Signal>) -> String {
    let all: Vec<String> = signals.map(|signal| inline(&signal.name)).collect();
    match all.len() {
        0 => "none".to_owned(),
        n if n > MOST_NAMES => {
            format!("{}, and {} more", all[..MOST_NAMES].join(", "), n - MOST_NAMES)
        }
        _ => all.join(", "),
    }
}

/// Registers and their clock.
fn clocked(chip: &Chip, reads: &[Reads]) -> String {
    let registers: Vec<&Signal> =
        reads.iter().filter(|one| one.is_registered).map(|one| &chip.signals[one.signal]).collect();
    if registers.is_empty() {
        return "There is no clock: every output follows the inputs.".to_owned();
    }
    let clock = chip.signals.iter().find(|signal| signal.kind == Kind::Clock);
    let name = clock.map_or("the clock".to_owned(), |clock| format!("`{}`", inline(&clock.name)));
    let how = match (chip.device.map(|device| device.clock), clock.and_then(|clock| clock.pin)) {
        (Some(Clock::Term), Some(pin)) => {
            format!("{name} (pin {pin}, through a product term of each macrocell)")
        }
        (Some(Clock::Pin(pin)), _) => format!("{name} (pin {pin}, the clock of the device)"),
        (_, Some(pin)) => format!("{name} (pin {pin})"),
        (_, None) => name,
    };
    format!(
        "The rising edge of {how} clocks {}: {}.",
        counted(registers.len(), "register", "registers"),
        names(registers.into_iter())
    )
}

/// Clocks of a reaction.
fn clocks(chip: &Chip) -> String {
    let is_busy = chip.circuit.outputs.values().any(|output| output.role == PinRole::Busy);
    let how = chip.evolution.as_ref().map_or(String::new(), |how| format!(" ({})", inline(how)));
    if is_busy {
        format!(
            "A reaction takes one clock for each micro-step and one more; `busy` is high meanwhile, and outputs hold{how}."
        )
    } else {
        format!(
            "A reaction takes 1 clock{how}: after the edge, with the inputs still held, outputs show it."
        )
    }
}

fn synchronisers(chip: &Chip) -> Option<String> {
    let chain = chip.chains.first()?;
    let pins = chip.chains.iter().map(|chain| inline(&chip.circuit.inputs[chain.input].name));
    Some(format!(
        "{} {} in front of {}: what they carry arrives {} later, and may change at any time.",
        counted(chain.flops.len(), "synchroniser flip-flop", "synchroniser flip-flops"),
        if chain.flops.len() == 1 { "stands" } else { "stand" },
        pins.collect::<Vec<_>>().join(", "),
        counted(chain.flops.len(), "clock", "clocks"),
    ))
}

/// Ways from an input to an output that no register lies on.
fn paths(chip: &Chip, reads: &[Reads]) -> Option<String> {
    let is_input = |signal: &usize| matches!(chip.signals[*signal].kind, Kind::Input(_));
    let paths: Vec<String> = (reads.iter())
        .filter(|one| !one.is_registered)
        .filter(|one| matches!(chip.signals[one.signal].kind, Kind::Output(_)))
        .filter_map(|one| {
            let inputs: Vec<&Signal> =
                one.signals.iter().filter(|at| is_input(at)).map(|at| &chip.signals[*at]).collect();
            let name = inline(&chip.signals[one.signal].name);
            (!inputs.is_empty()).then(|| format!("{name} from {}", names(inputs.into_iter())))
        })
        .collect();
    let outputs = chip.circuit.outputs.len();
    if outputs == 0 {
        return None;
    }
    Some(match paths.as_slice() {
        [] => "No way leads from an input to an output without a register: between clocks outputs hold.".to_owned(),
        paths => format!(
            "Between clocks outputs follow inputs here{}: {}.",
            if chip.code.is_some() { " (declare the output `registered` to hold it)" } else { "" },
            paths.join("; ")
        ),
    })
}

/// How often the longest way passes through the array.
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
            "a register's input passes the array {}: the clock period is at least the data sheet's clock-to-feedback, so many delays of the array, and the set-up time",
            passes(depth)
        ));
    }
    if let Some(depth) = of(false)
        && reads.iter().any(|one| !one.is_registered)
    {
        parts.push(format!("a combinational output passes it {} after the clock", passes(depth)));
    }
    let text = parts.join("; ");
    let mut letters = text.chars();
    let first = letters.next()?;
    Some(format!("{}{}.", first.to_uppercase(), letters.as_str()))
}

/// Of each macrocell how many sums lie on its longest way from a pin or register. Combinational macrocells never form a loop.
fn depths(chip: &Chip) -> Vec<usize> {
    let cell_of = chip.combinational();
    let mut depths = vec![1; chip.cells.len()];
    // A pass for each macrocell is enough for the longest chain that there can be.
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

/// A row for each input: what it has to keep to, and who would see it differently.
fn inputs(subject: &Subject<'_>, chip: &Chip, reads: &[Reads]) -> String {
    let mut table = Table::new(["Input", "It is", "Registers that read it"]);
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
            PinRole::Tick
            | PinRole::Reset
            | PinRole::Output(..)
            | PinRole::Busy
            | PinRole::Fault
            | PinRole::Unknown => false,
        };
        let is_synchronised = chip.chains.iter().any(|chain| chain.input == input);
        let is = if is_synchronised {
            "synchronised on the chip: free"
        } else if is_declared {
            "declared `synchronous`"
        } else if readers.len() > 1 {
            is_exposed = true;
            "must keep to the clock"
        } else if readers.is_empty() {
            "read by no register"
        } else {
            "read by one register"
        };
        table.row([signal.name.clone(), String::new(), names_plain(&readers)]);
        table.set_last(1, is);
    }
    if table.is_empty() {
        return String::new();
    }
    let mut text = format!("\n{}", table.text());
    if is_exposed {
        text += "\nAn input that must keep to the clock has to be still from the set-up time before the edge to the hold time after it. If it changes there, the registers that read it can take different values, and the chip can go where the chart never goes. Let the circuit around it change it after the edge, or put flip-flops in front of it: `--synchronise 1` or `2`.\n";
    }
    text
}

fn names_plain(signals: &[&Signal]) -> String {
    let names: Vec<&str> = signals.iter().map(|signal| signal.name.as_str()).collect();
    match names.len() {
        0 => "none".to_owned(),
        n if n > MOST_NAMES => {
            format!("{}, and {} more", names[..MOST_NAMES].join(", "), n - MOST_NAMES)
        }
        _ => names.join(", "),
    }
}
