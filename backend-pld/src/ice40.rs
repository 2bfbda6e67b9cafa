//! iCE40: the pins of each package, and the constraints that assign them to signals.
//!
//! Synthesis, placement and the bitstream are done by yosys, nextpnr and icepack; the result is read back and proved like any other text. The
//! pins are from the tables of Project `IceStorm`; registers are 0 after power-up, and yosys inverts those that must start at 1.

use crate::codes;
use crate::{Emitted, Object};
use grafsynth_ir::Name;
use grafsynth_ir::diag::{Diagnostic, nearest};
use itertools::Itertools as _;
use std::collections::BTreeSet;

/// A device in its package.
#[derive(Debug, PartialEq, Eq)]
pub struct Package {
    /// Its name here.
    pub name: &'static str,
    /// The device, as an option of nextpnr-ice40.
    pub device: &'static str,
    /// The package name for the tools.
    pub package: &'static str,
    /// Pins that signals can use; the others are for supply or configuration, or not bonded.
    pub pins: &'static [u32],
}

/// All packages, the default first.
pub const PACKAGES: &[Package] = &[
    Package {
        name: "ice40hx1k-tq144",
        device: "--hx1k",
        package: "tq144",
        pins: &[
            1, 2, 3, 4, 7, 8, 9, 10, 11, 12, 19, 20, 21, 22, 23, 24, 25, 26, 28, 29, 31, 32, 33,
            34, 37, 38, 39, 41, 42, 43, 44, 45, 47, 48, 49, 50, 52, 56, 58, 60, 61, 62, 63, 64, 67,
            68, 70, 71, 73, 74, 75, 76, 78, 79, 80, 81, 87, 88, 90, 91, 93, 94, 95, 96, 97, 98, 99,
            101, 102, 104, 105, 106, 107, 112, 113, 114, 115, 116, 117, 118, 119, 120, 121, 122,
            128, 129, 134, 135, 136, 137, 138, 139, 141, 142, 143, 144,
        ],
    },
    Package {
        name: "ice40hx1k-vq100",
        device: "--hx1k",
        package: "vq100",
        pins: &[
            1, 2, 3, 4, 7, 8, 9, 10, 12, 13, 15, 16, 18, 19, 20, 21, 24, 25, 26, 27, 28, 29, 30,
            33, 34, 36, 37, 40, 41, 42, 45, 46, 48, 49, 51, 52, 53, 54, 56, 57, 59, 60, 62, 63, 64,
            65, 66, 68, 69, 71, 72, 73, 74, 78, 79, 80, 81, 82, 83, 85, 86, 87, 89, 90, 91, 93, 94,
            95, 96, 97, 99, 100,
        ],
    },
    Package {
        name: "ice40up5k-sg48",
        device: "--up5k",
        package: "sg48",
        pins: &[
            2, 3, 4, 6, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20, 21, 23, 25, 26, 27, 28, 31,
            32, 34, 35, 36, 37, 38, 39, 40, 41, 42, 43, 44, 45, 46, 47, 48,
        ],
    },
];

impl Package {
    /// The package with this name; not case-sensitive. `None` selects the default.
    #[must_use]
    pub fn find(name: Option<&str>) -> Option<&'static Package> {
        match name {
            None => PACKAGES.first(),
            Some(name) => PACKAGES.iter().find(|package| package.name.eq_ignore_ascii_case(name)),
        }
    }
}

/// The constraints (`.pcf`): a pin for each signal, as requested, or else the first free one.
///
/// # Errors
/// Returns findings about pins that the package does not have or that two signals request, signals that do not exist, and more signals than pins.
pub fn constraints(
    emitted: &Emitted,
    package: &Package,
    board: &[(Name, u32)],
) -> Result<String, Vec<Diagnostic>> {
    let signals: Vec<(&str, String)> = emitted
        .names
        .iter()
        .filter_map(|named| {
            let source = match &named.object {
                Object::Clock => "clock".to_owned(),
                Object::Reset => named.name.clone(),
                Object::Input(pin) => pin.name.clone(),
                Object::Output(pin) => pin.name.clone(),
                Object::Flop(_) | Object::Buried => return None,
            };
            Some((named.name.as_str(), source))
        })
        .collect();
    let mut findings = Vec::new();
    let mut taken = BTreeSet::new();
    let mut pins: Vec<Option<u32>> = vec![None; signals.len()];
    for (name, pin) in board {
        let is_named = |(text, source): &(&str, String)| {
            source.eq_ignore_ascii_case(&name.text) || text.eq_ignore_ascii_case(&name.text)
        };
        let Some(at) = signals.iter().position(is_named) else {
            let message =
                format!("pin {pin} is assigned to `{name}`, but the circuit has no such signal");
            let near = nearest(&name.text, signals.iter().map(|(_, source)| source.as_str()));
            let finding = Diagnostic::error(codes::BAD_PIN, message).at(name.span, "");
            findings.push(match near {
                Some(near) => finding.help(format!("did you mean `{near}`?")),
                None => finding.help("remove the line, or write the name of an input or output"),
            });
            continue;
        };
        if !package.pins.contains(pin) {
            let message = format!("{} has no pin {pin} for `{name}`", package.name);
            let help = format!("pins for signals: {}", package.pins.iter().join(", "));
            let finding = Diagnostic::error(codes::BAD_PIN, message).at(name.span, "");
            findings.push(finding.help(help));
        } else if !taken.insert(*pin) {
            let message = format!("pin {pin} is assigned to `{name}` and to another signal");
            findings.push(
                Diagnostic::error(codes::BAD_PIN, message)
                    .at(name.span, "")
                    .help("assign a separate pin to each signal"),
            );
        } else {
            pins[at] = Some(*pin);
        }
    }
    let mut free = package.pins.iter().copied().filter(|pin| !taken.contains(pin));
    for pin in &mut pins {
        if pin.is_none() {
            *pin = free.next();
        }
    }
    if pins.iter().any(Option::is_none) && findings.is_empty() {
        let message = format!(
            "{} signals need pins, but {} has only {}",
            pins.len(),
            package.name,
            package.pins.len()
        );
        findings.push(
            Diagnostic::error(codes::DOES_NOT_FIT, message)
                .help("select a larger package with `--device`, or build `verilog` for any FPGA"),
        );
    }
    if !findings.is_empty() {
        return Err(findings);
    }
    let mut text = format!("# pins of an {}\n", package.name);
    for ((name, _), pin) in signals.iter().zip(pins) {
        text.push_str(&format!("set_io {name} {}\n", pin.unwrap_or_default()));
    }
    Ok(text)
}
