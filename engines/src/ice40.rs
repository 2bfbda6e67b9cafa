//! From Verilog to an iCE40 bitstream, and back: yosys, nextpnr-ice40 and icepack make it, `icebox_vlog` says what its bits mean.

use crate::scratch::Scratch;
use crate::tools;
use grafsynth_driver::ice40::Job;
use std::fs;
use std::path::Path;
use std::time::Duration;

/// Longer than a design that fits takes.
const LIMIT: Duration = Duration::from_secs(300);

/// What the tools made.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Bitstream {
    /// The bytes to load.
    pub bytes: Vec<u8>,
    /// What the bits mean: Verilog that was made from the bitstream alone.
    pub read_back: String,
    /// What placement said: logic cells and the highest clock.
    pub remark: String,
}

/// The programs that are missing, with the Debian package that brings them.
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

/// Makes the bitstream and reads it back.
///
/// # Errors
/// What a program said when it failed.
#[expect(clippy::disallowed_methods, reason = "engines work in temporary folders")]
pub fn bitstream(job: &Job) -> Result<Bitstream, String> {
    let folder = Scratch::new().map_err(|why| format!("no temporary folder: {why}"))?;
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
    // What will be loaded is what is read back, not what it was packed from.
    run("iceunpack", &["design.bin", "back.asc"], folder)?;
    let arguments = ["-s", "-p", "design.pcf", "-d", job.package.package, "-n", "back", "back.asc"];
    let read_back = run("icebox_vlog", &arguments, folder)?;
    let bytes = fs::read(folder.join("design.bin")).map_err(io)?;
    Ok(Bitstream { bytes, read_back, remark: remark(&said) })
}

/// Runs a program; what it printed.
fn run(name: &str, arguments: &[&str], folder: &Path) -> Result<String, String> {
    let program = tools::find(&[name]).ok_or_else(|| format!("{name} is not here"))?;
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

/// Logic cells and clock, from the report of nextpnr.
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
        Some(format!("{} MHz as nextpnr estimates", rest.split(" MHz").next()?.trim()))
    });
    [cells, clock].into_iter().flatten().collect::<Vec<_>>().join(", ")
}
