//! The link of a split: from the pins of the fitted chips and the interface of the emitted C to driver C and wiring.

use super::{PartDevice, RequestedPart, Split};
use crate::built::OutputFile;
use crate::codes;
use crate::report::chip::{Chip, Kind};
use crate::stem::FileStem;
use grafsynth_backend_c::Package;
use grafsynth_ir::Diagnostic;
use grafsynth_ir::logic::PinRole;
use grafsynth_ir::net::Net;
use grafsynth_split::cpu::{Cpu, HOST};
use grafsynth_split::link::{
    self, Calls, ChipPins, ChipSignal, CpuNames, Link, Object, Timing, calls, check, files,
    wiring_md, wiring_svg,
};
use std::collections::BTreeMap;

/// A link with the data from which its files are printed.
#[derive(Debug, Clone)]
pub struct Linked {
    /// The connections, and the acts of a round.
    pub link: Link,
    /// The pins of each chip.
    pub chips: Vec<ChipPins>,
    /// The microcontroller.
    pub cpu: &'static Cpu,
    /// The time of one wait for the chips, in nanoseconds.
    pub settle_ns: u64,
    /// The prefix of its functions: NAME in `NAME_link_round`.
    pub name: String,
    /// How a program calls its functions.
    pub calls: Calls,
    /// Driver C, the table of wires and its drawing.
    pub files: Vec<OutputFile>,
}

/// The link of a split for its CPU: driver C, the table of wires and its drawing. The acts of a round are checked before they are printed.
///
/// # Errors
/// Too few pins of the CPU; signals that cannot be wired; a chip whose pins are not assigned. A breach of the check would be a bug.
pub fn link(
    net: &Net,
    split: &Split,
    parts: &[RequestedPart],
    stem: &FileStem,
) -> Result<Linked, Vec<Diagnostic>> {
    let cpu = parts.last().and_then(|part| grafsynth_split::cpu::cpu(part.device.name()));
    link_on(net, split, parts, stem, cpu)
}

/// Like [`link`], with pins that are functions of a program on this computer.
///
/// # Errors
/// Like [`link`].
pub fn link_on_host(
    net: &Net,
    split: &Split,
    parts: &[RequestedPart],
    stem: &FileStem,
) -> Result<Linked, Vec<Diagnostic>> {
    link_on(net, split, parts, stem, Some(&HOST))
}

fn link_on(
    net: &Net,
    split: &Split,
    parts: &[RequestedPart],
    stem: &FileStem,
    cpu: Option<&'static Cpu>,
) -> Result<Linked, Vec<Diagnostic>> {
    let refuse = |why: String| vec![Diagnostic::error(codes::NO_PARTITION, why)];
    let mut chips = Vec::new();
    for (part, requested) in split.parts.iter().zip(parts) {
        if let PartDevice::Chip(device) = requested.device {
            let chip = part.built.chips.first().filter(|chip| chip.misfit.is_none());
            let Some(chip) = chip else {
                return Err(refuse(format!("the pins of `{}` are not assigned", requested.name)));
            };
            chips.push(pins(chip, device.name).map_err(refuse)?);
        }
    }
    let package = split.parts.last().and_then(|part| part.built.packages.first());
    let (Some(cpu), Some(package)) = (cpu, package) else {
        return Err(refuse("the part on the CPU was not built".to_owned()));
    };
    let of_cpu = split.division.parts.last();
    let request = link::Request {
        net,
        division: &split.division,
        chips: &chips,
        cpu,
        names: of_cpu.map(|part| names(package, &part.net)).unwrap_or_default(),
        name: stem.identifier(),
        wanted: BTreeMap::new(),
        timing: Timing::default(),
    };
    let link = link::link(&request)?;
    check(&link.acts, &link.connections, &split.division, &chips)
        .map_err(|breach| refuse(format!("the link does not make one round: {breach:?}")))?;
    let driver = files(&request, &link).into_iter();
    let mut all: Vec<OutputFile> =
        driver.map(|file| OutputFile::new(file.name, file.text)).collect();
    let name = request.name.clone();
    all.push(OutputFile::new(format!("{name}_wiring.md"), wiring_md(&request, &link)));
    all.push(OutputFile::new(format!("{name}_wiring.svg"), wiring_svg(&request, &link)));
    let calls = calls(&request, &link);
    let settle_ns = u64::from(request.timing.settle_ns);
    Ok(Linked { link, chips, cpu, settle_ns, name, calls, files: all })
}

/// The pins of a fitted chip by the meaning of its signals.
fn pins(chip: &Chip, device: &str) -> Result<ChipPins, String> {
    let pin_of = |name: &str| {
        let signal = chip.signals.iter().find(|signal| signal.name == name);
        let signal = signal.ok_or_else(|| format!("signal `{name}` of {device} is not known"))?;
        signal.pin.ok_or_else(|| format!("signal `{name}` of {device} has no pin"))
    };
    let mut pins = ChipPins {
        device: device.to_owned(),
        grounded: chip.enables.clone(),
        ..ChipPins::default()
    };
    for input in chip.circuit.inputs.values() {
        match input.role {
            PinRole::Input(id, bit) => {
                let (name, pin) = (input.name.clone(), pin_of(&input.name)?);
                pins.signals.push(ChipSignal { name, pin, object: Object::Input(id), bit });
            }
            PinRole::Tick => pins.tick = Some(pin_of(&input.name)?),
            _ => return Err(format!("signal `{}` of {device} has no meaning", input.name)),
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
