//! What the registers wake up as, whence that is known, and that it is the initial situation.

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
        return Some("There are no flip-flops, so nothing has to wake up.".to_owned());
    }
    match chip.device {
        Some(device) => {
            text += &registers(chip, device);
            for figure in device.figures.iter().filter(|figure| figure.what.contains("power-up")) {
                let whence = match figure.source {
                    Source::Read(source) => format!("read: {source}"),
                    Source::Memory(source) => format!("from memory, not read: {source}"),
                };
                text += &format!("\nThis rests on: {} ({whence}).\n", figure.what);
            }
        }
        None => text += &netlist(chip),
    }
    if let Some(code) = &chip.code {
        text += &situation(subject, chip, code.is_safe);
    }
    Some(text)
}

/// The situation that the chart begins in, and whether it is proved that the chip does too.
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
        Outcome::Proved => format!(
            "That `{}` wakes in it is part of its proof, which begins with the registers as they wake.\n",
            chip.file
        ),
        Outcome::NotChecked | Outcome::Open => {
            format!("That `{}` wakes in it was not proved.\n", chip.file)
        }
        Outcome::Refuted => format!("`{}` does not do what the chart does.\n", chip.file),
    };
    if is_safe {
        text += "A disturbed register leads back to it in one clock (`--safe`).\n";
    }
    text
}

/// A row for each register: what the device does, and what the chart wants.
fn registers(chip: &Chip, device: &grafsynth_backend_pld::device::Device) -> String {
    let circuit = &chip.circuit;
    let mut table = Table::new(["Register", "Pin", "Pin wakes", "So it wakes as", "Wanted"]);
    let level = |value: bool| if value { "high" } else { "low" };
    for cell in chip.cells.iter().filter(|cell| cell.is_registered()) {
        let Some(first) = cell.signals.first() else { continue };
        let signal = &chip.signals[*first];
        let wanted = match signal.kind {
            Kind::Flop(flop) => Some(circuit.flops[flop].init),
            Kind::Output(output) => circuit.outputs[output].registered,
            Kind::Clock | Kind::Reset | Kind::Input(_) | Kind::Buried => None,
        };
        // What the simulator of the fuses shows, or the rule of the device where there are none.
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
        Language::Jedec => "as the simulator of the fuses shows it",
        Language::Text(_) => "by the rule of the device, from the form of each equation",
    };
    if table.is_empty() {
        return String::new();
    }
    format!("{}\nEach wakes {whence}.\n", table.text())
}

fn netlist(chip: &Chip) -> String {
    let ones: Vec<String> = (chip.circuit.flops.values())
        .filter(|flop| flop.init)
        .map(|flop| inline(&flop.name))
        .collect();
    let first = match ones.as_slice() {
        [] => "All registers wake at 0".to_owned(),
        ones if ones.len() <= 16 => {
            format!("These registers wake at 1, all others at 0: {}", ones.join(", "))
        }
        ones => {
            format!("{} wake at 1, all others at 0", counted(ones.len(), "register", "registers"))
        }
    };
    let how = match (chip.language, chip.package) {
        (_, Some(_)) => {
            "An iCE40 wakes with all registers at 0, and yosys inverts those that have to wake at 1; the bitstream is read back and compared where it is made."
        }
        (Language::Text(Dialect::Verilog), None) => {
            "The text gives each register its initial value (`reg x = 1'b1;`): FPGAs keep that. A target that does not know initial values needs a reset (`--reset NAME`)."
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
            " The input `{}` brings all of them there too, while it is high.",
            inline(&reset.name)
        )
    });
    format!("{first}. {how}{reset}\n")
}
