//! From Verilog to an iCE40 bitstream, and back: yosys, nextpnr-ice40 and icepack create it, `icebox_vlog` decodes its bits.

use crate::scratch::Scratch;
use crate::tools;
use grafsynth_driver::ice40::Job;
use std::fs;
use std::path::Path;
use std::time::Duration;

/// The time limit of the tools: longer than they need for a design that fits.
const LIMIT: Duration = Duration::from_secs(300);

/// The results of the tools.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Bitstream {
    /// The bytes to load.
    pub bytes: Vec<u8>,
    /// The meaning of the bits: Verilog made from the bitstream alone.
    pub read_back: String,
    /// The result of placement: logic cells and the maximum clock frequency.
    pub remark: String,
}

/// The programs that are missing, with the Debian package that contains them.
#[must_use]
pub fn missing() -> Vec<&'static str> {
    [
        ("yosys", "yosys"),
        ("nextpnr-ice40", "nextpnr-ice40"),
        ("icepack", "fpga-icestorm"),
        ("iceunpack", "fpga-icestorm"),
        ("icebox_vlog", "fpga-icestorm"),
    ]
    .into_iter()
    .filter(|(program, _)| tools::find(&[program]).is_none())
    .map(|(_, package)| package)
    .collect()
}

/// Creates the bitstream and reads it back.
///
/// # Errors
/// The output of the program that failed.
#[expect(clippy::disallowed_methods, reason = "engines work in temporary folders")]
pub fn bitstream(job: &Job) -> Result<Bitstream, String> {
    let folder =
        Scratch::new().map_err(|why| format!("cannot create a temporary folder: {why}"))?;
    let folder = folder.path();
    let io = |why: std::io::Error| format!("a temporary file: {why}");
    fs::write(folder.join("design.v"), &job.verilog).map_err(io)?;
    fs::write(folder.join("design.pcf"), &job.constraints).map_err(io)?;
    let synthesis =
        format!("read_verilog design.v; synth_ice40 -top {} -json design.json", job.top);
    run("yosys", &["-q", "-p", &synthesis], folder)?;
    let placement = [
        job.package.device,
        "--package",
        job.package.package,
        "--json",
        "design.json",
        "--pcf",
        "design.pcf",
        "--asc",
        "design.asc",
    ];
    let said = run("nextpnr-ice40", &placement, folder)?;
    run("icepack", &["design.asc", "design.bin"], folder)?;
    // The loaded bitstream itself is read back, not the text it was packed from.
    run("iceunpack", &["design.bin", "back.asc"], folder)?;
    let arguments = ["-s", "-p", "design.pcf", "-d", job.package.package, "-n", "back", "back.asc"];
    let read_back = run("icebox_vlog", &arguments, folder)?;
    let bytes = fs::read(folder.join("design.bin")).map_err(io)?;
    Ok(Bitstream { bytes, read_back, remark: remark(&said) })
}

/// Runs a program; returns its output.
fn run(name: &str, arguments: &[&str], folder: &Path) -> Result<String, String> {
    let program = tools::find(&[name]).ok_or_else(|| format!("{name} is not installed"))?;
    let done = tools::run(&program, arguments, folder, b"", LIMIT)?;
    if done.is_success {
        let said = String::from_utf8_lossy(&done.stdout).into_owned();
        // nextpnr writes its report to standard error.
        return Ok(if said.is_empty() { done.stderr } else { said });
    }
    let said = done.stderr.lines().rev().take(4).collect::<Vec<_>>();
    let said: Vec<&str> = said.into_iter().rev().collect();
    Err(format!("{name} {}: {}", done.ending, said.join(" ")))
}

/// Logic cells and clock frequency, from the report of nextpnr.
fn remark(said: &str) -> String {
    let cells = said.lines().find_map(|line| {
        let (_, rest) = line.split_once("ICESTORM_LC:")?;
        let (used, rest) = rest.split_once('/')?;
        let all = rest.split_whitespace().next()?;
        Some(format!("{} of {all} logic cells", used.trim()))
    });
    let clock = said.lines().rev().find_map(|line| {
        let (_, rest) = line.split_once("Max frequency for clock")?;
        let (_, rest) = rest.split_once(": ")?;
        Some(format!("{} MHz (nextpnr estimate)", rest.split(" MHz").next()?.trim()))
    });
    [cells, clock].into_iter().flatten().collect::<Vec<_>>().join(", ")
}
