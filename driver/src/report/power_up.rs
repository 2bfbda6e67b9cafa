//! The values of registers after power-up, the source of these data, and whether they are the initial situation.

use super::chip::{Chip, Kind, Language};
use super::document::{Block, Inline, Rich, Table};
use super::{Outcome, Subject, counted};
use grafsynth_backend_pld::Dialect;
use grafsynth_backend_pld::device::Source;
use grafsynth_sim::Simulator;

pub(super) fn write(subject: &Subject<'_>, chip: &Chip) -> Vec<Block> {
    let circuit = &chip.circuit;
    let is_clocked = !circuit.flops.is_empty()
        || circuit.outputs.values().any(|output| output.registered.is_some());
    if !is_clocked {
        let none = "There are no flip-flops, so there is no power-up state.";
        return vec![Block::Paragraph(Rich::say(none, []))];
    }
    let mut blocks = Vec::new();
    match chip.device {
        Some(device) => {
            blocks.extend(registers(chip, device));
            for figure in device.figures.iter().filter(|figure| figure.what.contains("power-up")) {
                let whence = match figure.source {
                    Source::Read(source) => format!("read: {source}"),
                    Source::Memory(source) => format!("data-sheet value, not verified: {source}"),
                };
                let text = format!("Source: {} ({whence}).", figure.what);
                blocks.push(Block::Paragraph(Rich::message(text)));
            }
        }
        None => blocks.push(Block::Paragraph(netlist(chip))),
    }
    if let Some(code) = &chip.code {
        blocks.push(Block::Paragraph(situation(subject, chip, code.is_safe)));
    }
    blocks
}

/// The initial situation of the chart, and whether it is proved that the chip starts in it.
fn situation(subject: &Subject<'_>, chip: &Chip, is_safe: bool) -> Rich {
    let initial = Simulator::new(subject.net).reset().steps.clone();
    let names: Vec<&str> = initial
        .iter()
        .filter(|step| !subject.net.steps[**step].hidden)
        .map(|step| subject.net.steps[*step].name.text.as_str())
        .collect();
    let situation = if names.is_empty() { "no step".to_owned() } else { names.join(", ") };
    let text = Rich::say("The initial situation of the chart is {}. ", [Inline::Strong(situation)]);
    let file = || [Inline::Code(chip.file.clone())];
    let text = text.and(match chip.outcome {
        Outcome::Proved => {
            Rich::say("The proof of {} includes that it powers up in this situation.", file())
        }
        Outcome::NotChecked | Outcome::Open => {
            Rich::say("It was not proved that {} powers up in this situation.", file())
        }
        Outcome::Refuted => Rich::say("{} does not behave like the chart.", file()),
    });
    if !is_safe {
        return text;
    }
    text.and(Rich::say(
        " After a disturbance of a register, it returns to this situation in one clock (`--safe`).",
        [],
    ))
}

/// A row for each register: its value on the device, and its value in the chart.
fn registers(chip: &Chip, device: &grafsynth_backend_pld::device::Device) -> Vec<Block> {
    let circuit = &chip.circuit;
    let mut table = Table::new(["Register", "Pin", "Pin level", "Power-up value", "Required"]);
    let level = |value: bool| if value { "high" } else { "low" };
    for cell in chip.cells.iter().filter(|cell| cell.is_registered()) {
        let Some(first) = cell.signals.first() else { continue };
        let signal = &chip.signals[*first];
        let wanted = match signal.kind {
            Kind::Flop(flop) => Some(circuit.flops[flop].init),
            Kind::Output(output) => circuit.outputs[output].registered,
            Kind::Clock | Kind::Reset | Kind::Input(_) | Kind::Buried => None,
        };
        // The result of the fuse simulator, or the rule of the device if there are no fuses.
        let simulated = chip.wakes.iter().find(|(pin, _)| Some(*pin) == cell.pin);
        let value = match simulated {
            Some((_, Some(level))) => *level != signal.is_inverted,
            Some((_, None)) | None => {
                device.power_up_value(signal.is_inverted, cell.is_complemented)
            }
        };
        table.row([
            signal.name.clone(),
            cell.pin.map_or_else(|| "-".to_owned(), |pin| pin.to_string()),
            level(value != signal.is_inverted).to_owned(),
            u8::from(value).to_string(),
            wanted.map_or_else(|| "-".to_owned(), |wanted| u8::from(wanted).to_string()),
        ]);
    }
    let whence = match chip.language {
        Language::Jedec => "according to the fuse simulator",
        Language::Text(_) => "according to the rule of the device and the form of each equation",
    };
    if table.is_empty() {
        return Vec::new();
    }
    let whence = Rich::plain(format!("Power-up values {whence}."));
    vec![Block::Table(table), Block::Paragraph(whence)]
}

fn netlist(chip: &Chip) -> Rich {
    let ones: Vec<String> = (chip.circuit.flops.values())
        .filter(|flop| flop.init)
        .map(|flop| flop.name.clone())
        .collect();
    let first = match ones.as_slice() {
        [] => "All registers power up at 0".to_owned(),
        ones if ones.len() <= 16 => {
            format!("These registers power up at 1, all others at 0: {}", ones.join(", "))
        }
        ones => {
            format!(
                "{} power up at 1, all others at 0",
                counted(ones.len(), "register", "registers")
            )
        }
    };
    let how = match (chip.language, chip.package) {
        (_, Some(_)) => {
            "All registers of an iCE40 power up at 0, and yosys inverts those that must start at 1; the bitstream, if it is made, is read back and compared."
        }
        (Language::Text(Dialect::Verilog), None) => {
            "The text gives each register its initial value (`reg x = 1'b1;`), which FPGAs support. A target without initial values needs a reset (`--reset NAME`)."
        }
        (Language::Text(Dialect::Blif), None) => "The text gives each latch its initial value.",
        (
            Language::Text(Dialect::Palasm | Dialect::Cupl | Dialect::Galasm) | Language::Jedec,
            None,
        ) => "",
    };
    let reset = chip.signals.iter().find(|signal| signal.kind == Kind::Reset);
    let text = Rich::say("{}. ", [first.into()]).and(Rich::say(how, []));
    match reset {
        None => text,
        Some(reset) => text.and(Rich::say(
            " The input `{}` also sets all of them to these values while it is high.",
            [reset.name.as_str().into()],
        )),
    }
}
