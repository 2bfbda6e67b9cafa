//! The link of a split: its C and wiring, from the pins of the fitted chips and the interface of the emitted C.

use super::{PartDevice, Request, Split};
use crate::built::OutputFile;
use crate::codes;
use crate::report::chip::{Chip, Kind};
use grafsynth_backend_c::Package;
use grafsynth_ir::Diagnostic;
use grafsynth_ir::logic::PinRole;
use grafsynth_ir::net::Net;
use grafsynth_split::link::{
    self, ChipPins, ChipSignal, CpuNames, Object, Timing, check, files, wiring_md, wiring_svg,
};
use std::collections::BTreeMap;

/// The files of the link: its C, the wiring table and the wiring diagram. The acts of a round are checked before they are printed.
///
/// # Errors
/// Too few pins on the CPU; signals that cannot be wired; a chip whose pins are not assigned. A failed check is a bug in grafsynth.
pub fn link(
    net: &Net,
    split: &Split,
    request: &Request<'_>,
) -> Result<Vec<OutputFile>, Vec<Diagnostic>> {
    let bug = |why: String| {
        let found = Diagnostic::error(codes::NO_PARTITION, why);
        vec![found.help("this is a bug in grafsynth: please report it with the chart")]
    };
    let mut chips = Vec::new();
    for (part, requested) in split.parts.iter().zip(request.parts) {
        if let PartDevice::Chip(device) = requested.device {
            let chip = part.built.chips.first().filter(|chip| chip.misfit.is_none());
            let Some(chip) = chip else {
                // Equations that do not fit are written without pins, so this is no error of the build.
                let message = format!(
                    "part `{}` does not fit the {}: its pins are not assigned",
                    requested.name, device.name
                );
                let found = Diagnostic::error(codes::NO_PARTITION, message);
                return Err(vec![found.help("use a larger chip, or place fewer objects on it")]);
            };
            chips.push(pins(chip, device.name).map_err(bug)?);
        }
    }
    let (Some(cpu), Some(package)) = (
        request.parts.last().and_then(|part| grafsynth_split::cpu::cpu(part.device.name())),
        split.parts.last().and_then(|part| part.built.packages.first()),
    ) else {
        return Err(bug("the part on the CPU was not built".to_owned()));
    };
    let request = link::Request {
        net,
        division: &split.division,
        chips: &chips,
        cpu,
        names: names(
            package,
            &split.division.parts.last().map_or_else(Net::default, |part| (*part.net).clone()),
        ),
        name: request.stem.identifier(),
        wanted: BTreeMap::new(),
        timing: Timing::default(),
    };
    let link = link::link(&request)?;
    check(&link.acts, &link.connections, &split.division, &chips)
        .map_err(|breach| bug(format!("the link does not perform exactly one round: {breach}")))?;
    let mut all: Vec<OutputFile> = files(&request, &link)
        .into_iter()
        .map(|file| OutputFile::new(file.name, file.text))
        .collect();
    let name = &request.name;
    all.push(OutputFile::new(format!("{name}_wiring.md"), wiring_md(&request, &link)));
    all.push(OutputFile::new(format!("{name}_wiring.svg"), wiring_svg(&request, &link)));
    Ok(all)
}

/// The pins of a fitted chip, with the meanings of their signals.
fn pins(chip: &Chip, device: &str) -> Result<ChipPins, String> {
    let pin_of = |name: &str| {
        let signal = chip.signals.iter().find(|signal| signal.name == name);
        let signal = signal.ok_or_else(|| format!("the {device} has no signal `{name}`"))?;
        signal.pin.ok_or_else(|| format!("signal `{name}` of {device} has no pin"))
    };
    let mut pins = ChipPins { device: device.to_owned(), ..ChipPins::default() };
    for input in chip.circuit.inputs.values() {
        match input.role {
            PinRole::Input(id, bit) => {
                let (name, pin) = (input.name.clone(), pin_of(&input.name)?);
                pins.signals.push(ChipSignal { name, pin, object: Object::Input(id), bit });
            }
            PinRole::Tick => pins.tick = Some(pin_of(&input.name)?),
            _ => {
                return Err(format!(
                    "signal `{}` of {device} is not an input of the part",
                    input.name
                ));
            }
        }
    }
    for output in chip.circuit.outputs.values() {
        if let PinRole::Output(id, bit) = output.role {
            let (name, pin) = (output.name.clone(), pin_of(&output.name)?);
            pins.signals.push(ChipSignal { name, pin, object: Object::Output(id), bit });
        }
    }
    let clock = chip.signals.iter().find(|signal| signal.kind == Kind::Clock);
    pins.clock = clock.and_then(|signal| signal.pin);
    Ok(pins)
}

/// The interface of the C of the last part.
fn names(package: &Package, net: &Net) -> CpuNames {
    let interface = package.reaction_interface();
    let handed = net.inputs.iter().filter(|(_, input)| input.kind.is_handed());
    let shown = net.outputs.iter().filter(|(_, output)| !output.is_extern());
    CpuNames {
        prefix: interface.prefix.to_owned(),
        header: format!("{}.h", package.stem()),
        inputs: handed.map(|(id, _)| (id, interface.inputs[id].clone())).collect(),
        outputs: shown.map(|(id, _)| (id, interface.outputs[id].clone())).collect(),
        has_instance: interface.has_instance,
        dt: interface.dt.map(str::to_owned),
    }
}
