//! The values of registers after power-up, the source of these data, and whether they are the initial situation.

use super::chip::{Chip, Kind, Language};
use super::{Outcome, Subject, counted, table::Table, table::inline};
use grafsynth_backend_pld::Dialect;
use grafsynth_backend_pld::device::Source;
use grafsynth_sim::Simulator;

pub(super) fn write(subject: &Subject<'_>, chip: &Chip) -> Option<String> {
    let circuit = &chip.circuit;
    let mut text = String::new();
    let is_clocked = !circuit.flops.is_empty()
        || circuit.outputs.values().any(|output| output.registered.is_some());
    if !is_clocked {
        return Some("There are no flip-flops, so there is no power-up state.".to_owned());
    }
    match chip.device {
        Some(device) => {
            text += &registers(chip, device);
            for figure in device.figures.iter().filter(|figure| figure.what.contains("power-up")) {
                let whence = match figure.source {
                    Source::Read(source) => format!("read: {source}"),
                    Source::Memory(source) => format!("data-sheet value, not verified: {source}"),
                };
                text += &format!("\nSource: {} ({whence}).\n", figure.what);
            }
        }
        None => text += &netlist(chip),
    }
    if let Some(code) = &chip.code {
        text += &situation(subject, chip, code.is_safe);
    }
    Some(text)
}

/// The initial situation of the chart, and whether it is proved that the chip starts in it.
fn situation(subject: &Subject<'_>, chip: &Chip, is_safe: bool) -> String {
    let initial = Simulator::new(subject.net).reset().steps.clone();
    let names: Vec<&str> = initial
        .iter()
        .filter(|step| !subject.net.steps[**step].hidden)
        .map(|step| subject.net.steps[*step].name.text.as_str())
        .collect();
    let situation = if names.is_empty() { "no step".to_owned() } else { names.join(", ") };
    let mut text = format!("\nThe initial situation of the chart is **{}**. ", inline(&situation));
    text += &match chip.outcome {
        Outcome::Proved => {
            format!("The proof of `{}` includes that it powers up in this situation.\n", chip.file)
        }
        Outcome::NotChecked | Outcome::Open => {
            format!("It was not proved that `{}` powers up in this situation.\n", chip.file)
        }
        Outcome::Refuted => format!("`{}` does not behave like the chart.\n", chip.file),
    };
    if is_safe {
        text += "After a disturbance of a register, it returns to this situation in one clock (`--safe`).\n";
    }
    text
}

/// A row for each register: its value on the device, and its value in the chart.
fn registers(chip: &Chip, device: &grafsynth_backend_pld::device::Device) -> String {
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
        return String::new();
    }
    format!("{}\nPower-up values {whence}.\n", table.text())
}

fn netlist(chip: &Chip) -> String {
    let ones: Vec<String> = (chip.circuit.flops.values())
        .filter(|flop| flop.init)
        .map(|flop| inline(&flop.name))
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
    let reset = reset.map_or(String::new(), |reset| {
        format!(
            " The input `{}` also sets all of them to these values while it is high.",
            inline(&reset.name)
        )
    });
    format!("{first}. {how}{reset}\n")
}
