//! The data for an iCE40 bitstream, and the proof of a finished one.
//!
//! The Verilog is proved equal to the net as for any FPGA. Other tools convert it to the bitstream; the bitstream is read back as Verilog, and this is proved
//! equal to the original Verilog. Together, this proves that the bitstream implements the chart.

use crate::judge::judge_pairs;
use crate::output_report::{OutputFault, OutputProof, OutputReport};
use crate::stem::FileStem;
use grafsynth_backend_pld::ice40::{Package, constraints};
use grafsynth_backend_pld::{Dialect, Emitted, codes, read};
use grafsynth_ir::diag::nearest;
use grafsynth_ir::logic::Logic;
use grafsynth_ir::{Diagnostic, FileId, Name};
use grafsynth_verify::Limits;
use grafsynth_verify::circuits::Pairs;

/// The inputs of the tools.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Job {
    /// The name of the bitstream.
    pub name: String,
    /// The module.
    pub top: String,
    /// The Verilog that was proved equal to the net.
    pub verilog: String,
    /// The pins (`.pcf`).
    pub constraints: String,
    /// The device.
    pub package: &'static Package,
}

/// The job for a text: assigns a pin to each of its signals.
///
/// # Errors
/// An unknown device, and pins that it does not have.
pub fn job(
    stem: &FileStem,
    emitted: &Emitted,
    device: Option<&str>,
    board: &[(Name, u32)],
) -> Result<Job, Vec<Diagnostic>> {
    let Some(package) = Package::find(device) else {
        let device = device.unwrap_or_default();
        let names = grafsynth_backend_pld::ice40::PACKAGES.iter().map(|package| package.name);
        let finding =
            Diagnostic::error(codes::UNKNOWN_DEVICE, format!("unknown iCE40 package `{device}`"));
        let help = match nearest(device, names.clone()) {
            Some(near) => format!("did you mean `{near}`?"),
            None => format!("known packages: {}", names.collect::<Vec<_>>().join(", ")),
        };
        return Err(vec![finding.help(help)]);
    };
    let top = emitted
        .text
        .lines()
        .find_map(|line| line.strip_prefix("module "))
        .and_then(|rest| rest.split([' ', '(', ';']).next())
        .unwrap_or("chart");
    Ok(Job {
        name: format!("{stem}.bin"),
        top: top.to_owned(),
        verilog: emitted.text.clone(),
        constraints: constraints(emitted, package, board)?,
        package,
    })
}

/// Whether a bitstream, given as the Verilog that was read back from it, equals its source circuit.
#[must_use]
pub fn judge(job: &Job, read_back: &str, limits: &Limits) -> OutputReport {
    let circuit = |text: &str| -> Result<Logic, String> {
        let (logic, found) = read(Dialect::Verilog, FileId(u32::MAX), text);
        logic.ok_or_else(|| {
            found.into_iter().next().map_or_else(String::new, |finding| finding.message)
        })
    };
    let (ours, theirs) = match (circuit(&job.verilog), circuit(read_back)) {
        (Ok(ours), Ok(theirs)) => (ours, theirs),
        (Err(why), _) | (_, Err(why)) => {
            let why = format!("the text that was read back does not parse: {why}");
            return OutputReport::open(&job.name, why);
        }
    };
    let inputs = ours.inputs.iter().map(|(id, pin)| {
        let twin = theirs.inputs.iter().find(|(_, other)| other.name == pin.name);
        (Some(id), twin.map(|(id, _)| id))
    });
    let outputs = ours.outputs.iter().filter_map(|(id, pin)| {
        let twin = theirs.outputs.iter().find(|(_, other)| other.name == pin.name)?;
        Some((id, twin.0))
    });
    let pairs = Pairs { inputs: inputs.collect(), outputs: outputs.collect(), flops: Vec::new() };
    if let Some((_, lost)) =
        ours.outputs.iter().find(|(id, _)| !pairs.outputs.iter().any(|(own, _)| own == id))
    {
        return OutputReport::refuted(&job.name, OutputFault::PinLost(lost.name.clone()));
    }
    let judged = judge_pairs(&ours, &theirs, &pairs, limits);
    OutputReport::of_judged(&job.name, judged, OutputProof::Bitstream, OutputFault::Bitstream)
}
