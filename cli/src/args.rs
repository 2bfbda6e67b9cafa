//! The command line as the user writes it.

use crate::effort::{Effort, Limits};
use crate::exit::Demands;
use crate::lists::did_you_mean;
use crate::named::{
    CALLS, ENCODINGS, Emit, FORMS, GOALS, GROUPS, INTS, LINKS, Notes, OBJECTIVES, RESETS,
};
use crate::numbers::whole;
use crate::render::MessageFormat;
use clap::{Args, Parser, Subcommand, ValueEnum, ValueHint};
use grafsynth_backend_c::Io;
use grafsynth_backend_c::cost::{self, Goal, Machine};
use grafsynth_driver::coding::EncodingChoice;
use grafsynth_driver::pipeline::ResetStyle;
use grafsynth_driver::read::{CCalls, CGroup};
use grafsynth_driver::split::Objective;
use grafsynth_ir::division::Running;
pub(crate) use pictures::{BlankPart, Draw, DrawStyle, Page, PageLanguage, PaperSize};
use std::path::{Path, PathBuf};

mod pictures;

/// Compile charts to C and programmable logic, and check the results against the chart.
#[derive(Debug, Parser)]
#[command(name = "grafsynth", version, max_term_width = 100, arg_required_else_help = true)]
#[command(
    after_help = "Exit codes: 0 success; 1 invalid input, or an impossible request; 2 invalid option, or a file that cannot be read or written; 3 refuted, or a difference found; 4 a question is still open; 130 stopped by Ctrl-C.",
    after_long_help = "Exit codes: 0 success; 1 invalid input, or an impossible request; 2 invalid option, or a file that cannot be read or written; 3 refuted, or a difference found; 4 a question is still open; 130 stopped by Ctrl-C.\n\nStart with:\n  grafsynth new lamp\n  grafsynth build lamp/lamp.graf --target c --target jedec --device gal22v10 -o lamp/out"
)]
pub(crate) struct Cli {
    #[command(flatten)]
    pub(crate) global: Global,
    #[command(subcommand)]
    pub(crate) verb: Verb,
}

/// Options that every verb accepts.
#[derive(Debug, Args)]
pub(crate) struct Global {
    /// Format of findings and answers.
    #[arg(long, global = true, value_name = "FORMAT", default_value = "human")]
    pub(crate) message_format: MessageFormat,
    /// When to use colour (`NO_COLOR` disables it).
    #[arg(long, global = true, value_name = "WHEN", default_value = "auto")]
    pub(crate) color: When,
    /// Print only findings and requested output.
    #[arg(long, short, global = true)]
    pub(crate) quiet: bool,
    /// Be strict: `open` exits with 4 if any check was not carried out; `warnings` exits with 1 on any warning.
    #[arg(long, global = true, value_name = "WHAT", value_enum, value_delimiter = ',')]
    pub(crate) deny: Vec<Deny>,
    /// Be lenient: `tested` exits with 0 instead of 4 if something was tested but not proved.
    #[arg(long, global = true, value_name = "WHAT", value_enum, value_delimiter = ',')]
    pub(crate) allow: Vec<Allow>,
    /// Show at most N findings per file; the rest are counted.
    #[arg(long, global = true, value_name = "N", default_value_t = 100, value_parser = whole(0..=usize::MAX))]
    pub(crate) max_diagnostics: usize,
    /// Maximum nesting depth of brackets and blocks in a source.
    #[arg(long, global = true, value_name = "N", default_value_t = 256, value_parser = whole(0..=u32::MAX))]
    pub(crate) nesting_limit: u32,
    /// Maximum size of a source file, in bytes.
    #[arg(long, global = true, value_name = "BYTES", default_value_t = crate::files::SOURCE_LIMIT, value_parser = whole(0..=u64::MAX))]
    pub(crate) source_limit: u64,
}

impl Global {
    /// The requested strictness.
    pub(crate) fn demands(&self) -> Demands {
        Demands {
            deny_open: self.deny.contains(&Deny::Open),
            deny_warnings: self.deny.contains(&Deny::Warnings),
            allow_tested: self.allow.contains(&Allow::Tested),
        }
    }
}

/// Values of `--deny`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Deny {
    Open,
    Warnings,
}

/// Values of `--allow`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Allow {
    Tested,
}

/// Values of `new --kind`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Kind {
    /// A Grafcet with a board: C, and a fuse map for a GAL22V10.
    Grafcet,
    /// A statechart with history: C and Verilog.
    Statechart,
    /// Rules: C and PALASM.
    Rules,
    /// A sequential function chart in structured text: C and Verilog.
    Sfc,
    /// A Grafcet for a GAL16V8: the fuse map, and how to program it.
    Gal,
    /// A Grafcet with a main program for an ATmega328P (Arduino Uno).
    Avr,
}

/// When to use colours.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum When {
    Auto,
    Always,
    Never,
}

/// When a circuit spreads one reaction over several clocks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Busy {
    /// Never: one clock per reaction; the build fails if that is not possible.
    Never,
    /// If the micro-steps do not fit into one clock.
    TooLarge,
    /// If the micro-steps do not fit into one clock, or if it is not proved that the limit is always enough.
    Unproved,
    /// In every chart with `evolution stable`.
    Always,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Verb {
    /// Create a project: a chart, a stimulus and a Makefile.
    New(New),
    /// Validate and lint charts, and prove or refute their asserts.
    Check(Check),
    /// Write C, equations, fuse maps or Verilog, each checked against the chart.
    Build(Box<Build>),
    /// Split a chart between chips and a CPU, and prove the parts equal to the chart.
    Split(Box<Split>),
    /// Simulate a design and print the trace.
    Sim(Sim),
    /// Compare designs with each other, or one design on several engines.
    Compare(Compare),
    /// Convert a design to another format.
    Convert(Convert),
    /// Draw a chart as a picture (.svg, .pdf, .png).
    Draw(Draw),
    /// Write a page that shows the chart and runs it (.html).
    Page(Page),
    /// Minimise a two-level logic table (.pla).
    Minimise(Minimise),
    /// Decode the trace ring of a running chart (`build --trace-ring`).
    Trace(Trace),
    /// Format charts.
    Fmt(Fmt),
    /// List the changes between two charts: structure and behaviour.
    Diff(Diff),
    /// Explain a finding's code: cause, example, fix.
    Explain(Explain),
    /// List the external tools found and what they enable.
    Doctor,
    /// Print a completion script for a shell.
    Completions(Completions),
    /// Print the manual page of grafsynth, or of one verb.
    Man(Manual),
}

impl Verb {
    /// Its name on the command line.
    pub(crate) fn name(&self) -> &'static str {
        match self {
            Verb::New(_) => "new",
            Verb::Check(_) => "check",
            Verb::Build(_) => "build",
            Verb::Split(_) => "split",
            Verb::Sim(_) => "sim",
            Verb::Compare(_) => "compare",
            Verb::Convert(_) => "convert",
            Verb::Draw(_) => "draw",
            Verb::Page(_) => "page",
            Verb::Minimise(_) => "minimise",
            Verb::Trace(_) => "trace",
            Verb::Fmt(_) => "fmt",
            Verb::Diff(_) => "diff",
            Verb::Explain(_) => "explain",
            Verb::Doctor => "doctor",
            Verb::Completions(_) => "completions",
            Verb::Man(_) => "man",
        }
    }
}

/// The design that a verb reads, with the options for reading it.
#[derive(Debug, Args)]
pub(crate) struct Input {
    /// A chart (.graf .rules .scxml .st .xml .c .kiss2 .net) or logic (.pds .pld .v .blif .pla .jed); `-` is standard input.
    pub(crate) file: String,
    #[command(flatten)]
    pub(crate) reading: Reading,
}

/// The designs that a verb reads, with the options for reading them.
#[derive(Debug, Args)]
pub(crate) struct Inputs {
    /// Charts (.graf .rules .scxml .st .xml .c .kiss2 .net) or logic (.pds .pld .v .blif .pla .jed); `-` is standard input. For a folder, all charts in it and in
    /// its subfolders are used; hidden folders and links to folders are skipped.
    #[arg(required = true, value_name = "FILE")]
    pub(crate) files: Vec<String>,
    #[command(flatten)]
    pub(crate) reading: Reading,
}

impl Input {
    /// The input with this path and default options.
    pub(crate) fn plain(path: &str) -> Self {
        Input { file: path.to_owned(), reading: Reading::default() }
    }
}

/// Heading of the options that define how a file is read.
const READING: &str = "Input options";

/// Heading of the options for charts in C.
const C_SOURCES: &str = "Options for C sources";

/// Heading of the options for emitted C.
const C_OUTPUT: &str = "Options for C output";

/// Heading of the options for equations, fuse maps and Verilog.
const CIRCUITS: &str = "Options for circuits";

/// Options that select and complete the design in a file. `trace` needs the same ones as the build.
#[derive(Debug, Clone, Args, Default)]
pub(crate) struct Reading {
    /// Format of the input, if its name does not show it.
    #[arg(long, value_name = "FORMAT", help_heading = READING)]
    pub(crate) from: Option<String>,
    /// Add this assert to the chart, for example `never (R and L)`; repeatable. Only `check` and `build --report` try to prove it.
    #[arg(long, value_name = "PROPERTY", help_heading = READING)]
    pub(crate) assert: Vec<String>,
    /// Allow library files (`use "FILE"`) anywhere below this folder instead of only below the chart's folder.
    #[arg(long, value_name = "DIR", help_heading = READING)]
    pub(crate) root: Option<PathBuf>,
    /// Board file with device and pins; without this option, `NAME.board` next to the chart is used if it exists.
    #[arg(long, value_name = "FILE", help_heading = READING)]
    pub(crate) board: Option<String>,
    /// Target machine of the C: `avr`, `cortex-m3`, `8051` or `host`. Its cost model gives the cost of each task that declares none, and `build`
    /// chooses the style with the lowest worst-case time on this machine.
    #[arg(long = "for", value_name = "MACHINE", value_parser = machine, help_heading = READING)]
    pub(crate) machine: Option<&'static Machine>,
    #[command(flatten)]
    pub(crate) c: COptions,
}

/// How a C source is translated into a chart.
#[derive(Debug, Clone, Args, Default)]
pub(crate) struct COptions {
    /// Function that becomes the chart (default: `main`, or the last function that no other function calls).
    #[arg(long, value_name = "FUNCTION", help_heading = C_SOURCES)]
    pub(crate) entry: Option<String>,
    /// Combine straight-line code into one step.
    #[arg(long, help_heading = C_SOURCES)]
    pub(crate) fuse: bool,
    /// Keep a function as C instead of translating it; repeatable.
    #[arg(long, value_name = "FUNCTION", help_heading = C_SOURCES)]
    pub(crate) keep: Vec<String>,
    /// Make a macro-step of the statements after each comment, or of each block.
    #[arg(long, value_name = "WHAT", value_parser = GROUPS, help_heading = C_SOURCES)]
    pub(crate) group: Option<CGroup>,
    /// Make one macro-step per call, or share one among all calls of a function.
    #[arg(long, value_name = "HOW", value_parser = CALLS, help_heading = C_SOURCES)]
    pub(crate) calls: Option<CCalls>,
    /// Width of `int` in bits.
    #[arg(long, value_name = "BITS", value_parser = INTS, help_heading = C_SOURCES)]
    pub(crate) int: Option<u32>,
    /// Treat plain `char` as unsigned.
    #[arg(long, help_heading = C_SOURCES)]
    pub(crate) unsigned_char: bool,
    /// Number of elements of an array parameter without a length.
    #[arg(long, value_name = "N", value_parser = whole(0..=u32::MAX), help_heading = C_SOURCES)]
    pub(crate) array_length: Option<u32>,
    /// Define a macro as a number (1 without `=VALUE`); repeatable.
    #[arg(short = 'D', value_name = "NAME[=VALUE]", value_parser = constant, help_heading = C_SOURCES)]
    pub(crate) define: Vec<(String, i64)>,
}

/// Parses `--for`.
fn machine(name: &str) -> Result<&'static Machine, String> {
    cost::machine(name).ok_or_else(|| {
        let known = || cost::MACHINES.iter().map(|machine| machine.name);
        // Parts are named after their family: `atmega328p` is an AVR.
        let is_avr = ["atmega", "attiny", "atxmega"].iter().any(|one| name.starts_with(one));
        let near =
            if is_avr { ", did you mean `avr`?".to_owned() } else { did_you_mean(name, known()) };
        let known: Vec<&str> = known().collect();
        format!("unknown machine `{name}`{near} (known: {})", known.join(", "))
    })
}

/// Parses `-D`: `NAME`, `NAME=5`, `NAME=-0x10`.
fn constant(text: &str) -> Result<(String, i64), String> {
    let (name, value) = text.split_once('=').unwrap_or((text, "1"));
    let is_name = name.starts_with(|first: char| first.is_ascii_alphabetic() || first == '_')
        && name.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'_');
    if !is_name {
        return Err(format!("`{name}` is not a C identifier"));
    }
    let (sign, digits) = match value.trim().strip_prefix('-') {
        Some(digits) => (-1, digits),
        None => (1, value.trim()),
    };
    let number = match digits.strip_prefix("0x").or_else(|| digits.strip_prefix("0X")) {
        Some(digits) => i64::from_str_radix(digits, 16),
        None => digits.parse(),
    };
    match number {
        Ok(number) => Ok((name.to_owned(), sign * number)),
        Err(_) => Err(format!("`{value}` is not a decimal or 0x number")),
    }
}

impl COptions {
    /// These options in the form that the driver accepts.
    pub(crate) fn options(&self) -> grafsynth_driver::read::COptions {
        use grafsynth_driver::read::COptions;
        let default = COptions::default();
        COptions {
            int_bits: self.int.unwrap_or(default.int_bits),
            is_unsigned_char: self.unsigned_char,
            fuse: self.fuse,
            keep: self.keep.clone(),
            group: self.group.unwrap_or(default.group),
            calls: self.calls.unwrap_or(default.calls),
            entry: self.entry.clone(),
            array_length: self.array_length.unwrap_or(default.array_length),
            defines: self.define.clone(),
        }
    }
}

#[derive(Debug, Args)]
pub(crate) struct New {
    /// Name of the project and of its folder.
    pub(crate) name: String,
    /// Language of the project (`grafcet`, `statechart`, `rules`, `sfc`), or its chip (`gal`, `avr`).
    #[arg(long, value_enum, default_value = "grafcet")]
    pub(crate) kind: Kind,
}

#[derive(Debug, Args)]
pub(crate) struct Check {
    #[command(flatten)]
    pub(crate) inputs: Inputs,
    /// Print the intermediate form after this pass (`list` lists the passes).
    #[arg(long, value_name = "PASS")]
    pub(crate) dump_after: Option<String>,
    /// Write a copy of the file with a certificate after each library chart: the proved properties, the version of the tool and the hash of the text. `-` is
    /// standard output.
    #[arg(long, value_name = "OUTPUT")]
    pub(crate) certify: Option<PathBuf>,
    /// Write an inductive invariant for each proved assert, as text that `--recheck` proves again without a search. `-` is standard output.
    #[arg(long, value_name = "OUTPUT", conflicts_with_all = ["certify", "recheck"])]
    pub(crate) invariants: Option<PathBuf>,
    /// Prove the asserts only by the invariants in this file, which `--invariants` wrote.
    #[arg(long, value_name = "INVARIANTS", conflicts_with = "certify")]
    pub(crate) recheck: Option<String>,
    /// Show notes on correct code: `conflicts` lists the conflicts that the policy decides, and which transition wins.
    #[arg(long, value_name = "WHAT", value_enum, value_delimiter = ',')]
    pub(crate) notes: Vec<Notes>,
    /// Write the trace of the first counterexample to this file, as `.csv`, `.vcd`, `.jsonl` or `.svg`, and those of the others to FILE-2, FILE-3 and so on. `sim --stimulus FILE` replays a `.csv`.
    #[arg(long, value_name = "FILE")]
    pub(crate) trace: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) limits: Limits,
    /// Run again whenever the design, or a file that it uses, is saved; stop with Ctrl-C. Errors appear at once; checks and proofs follow, and are dropped at the next save.
    #[arg(long)]
    pub(crate) watch: bool,
}

/// Values of `build --report`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum ReportForm {
    /// One self-contained HTML page
    Html,
    /// A Markdown page, with the drawings in separate files
    Md,
    /// For programs
    Json,
}

/// Values of `build --trace`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum BuildTrace {
    /// The file for the traces of a refuted output.
    File(PathBuf),
    /// A number: the former form of `--trace-ring N`.
    Ring(u16),
}

/// Parses `build --trace`: a number is the former form of `--trace-ring`.
fn build_trace(text: &str) -> Result<BuildTrace, String> {
    if text.is_empty() || !text.bytes().all(|byte| byte.is_ascii_digit()) {
        return Ok(BuildTrace::File(PathBuf::from(text)));
    }
    match text.parse() {
        Ok(entries @ 1..=8192) => Ok(BuildTrace::Ring(entries)),
        Ok(_) | Err(_) => Err(format!(
            "`{text}` is neither a file name nor a number of entries for `--trace-ring` (1 to 8192)"
        )),
    }
}

impl Build {
    /// The number of entries of the trace ring.
    pub(crate) fn ring(&self) -> Option<u16> {
        match self.trace {
            Some(BuildTrace::Ring(entries)) => Some(entries),
            Some(BuildTrace::File(_)) | None => self.trace_ring,
        }
    }

    /// The file for the traces of refuted outputs.
    pub(crate) fn trace_file(&self) -> Option<&Path> {
        match &self.trace {
            Some(BuildTrace::File(path)) => Some(path),
            Some(BuildTrace::Ring(_)) | None => None,
        }
    }
}

/// Permission to run C code on this machine. Only the command line can give it, never a chart or a board.
#[derive(Debug, Clone, Copy, Args)]
pub(crate) struct Trust {
    /// Run C text from the chart (`code c`) when its C is compiled and tested; by default that text is left out.
    #[arg(long)]
    pub(crate) trust_code: bool,
}

#[derive(Debug, Args)]
pub(crate) struct Split {
    #[command(flatten)]
    pub(crate) input: Input,
    /// A part and its device, for example `chip=gal22v10` or `cpu=atmega328p` (`list` lists the devices); repeatable; one CPU and at least one chip.
    #[arg(long, value_name = "NAME=DEVICE")]
    pub(crate) part: Vec<String>,
    /// Place steps, transitions, variables or outputs on a part, for example `p1,p2=chip`; repeatable. `place p1 on chip` in the chart or the partition file does the same.
    #[arg(long, value_name = "NAMES=PART")]
    pub(crate) place: Vec<String>,
    /// Read parts and places from the partition file (STEM.split) of an earlier split.
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub(crate) with: Option<String>,
    /// Minimise the estimated cycles of the part on the CPU (`cycles`), the pins of the CPU (`pins`), the macrocells of all chips (`cells`), or the estimated cycles
    /// of a round with those of the link (`latency`).
    #[arg(long, value_name = "WHAT", value_parser = OBJECTIVES, default_value = "cycles")]
    pub(crate) minimise: Objective,
    /// How the parts run together. `lockstep` (the default): the CPU clocks the chips, and every row is that of the chart. `free-running`: each chip has a clock of
    /// its own, which must be proved to change nothing.
    #[arg(long, value_name = "HOW", value_parser = LINKS)]
    pub(crate) link: Option<Running>,
    /// No wire from the CPU resets the chips, which saves a pin of each, and two macrocells with `--link free-running`. The power of all parts must then be turned off and on together.
    #[arg(long)]
    pub(crate) no_reset: bool,
    /// Folder for the outputs. Their names begin with STEM, the name of the input file without its extension. With `--explore`: the file of the drawing (`.svg`).
    #[arg(long, short, value_name = "DIR", default_value = ".")]
    pub(crate) output: PathBuf,
    /// Write the outputs even if a proof is open; the header of each file then says so, and the exit code is 4.
    #[arg(long)]
    pub(crate) unproved: bool,
    /// Also print what the chart costs on each chip alone, on the CPU alone, and as the split.
    #[arg(long)]
    pub(crate) table: bool,
    /// Also write a report: the drawing with the colours of the parts, what is where and why, wires, wiring, costs, proofs. `html` (default): STEM.report.html, one file;
    /// `md`: STEM.report.md; `json`: STEM.report.json, for programs.
    #[arg(long, value_name = "FORM", value_enum, num_args = 0..=1, require_equals = true, default_missing_value = "html")]
    pub(crate) report: Option<ReportForm>,
    /// Write no parts, but compare the costs of the best splits on several devices: `--part chip=gal16v8,gal22v10 --part cpu=attiny85,atmega328p --explore`. `-o
    /// front.svg` also draws them.
    #[arg(long, conflicts_with_all = ["with", "table", "unproved", "report", "minimise"])]
    pub(crate) explore: bool,
    #[command(flatten)]
    pub(crate) limits: Limits,
    #[command(flatten)]
    pub(crate) trust: Trust,
}

#[derive(Debug, Args)]
pub(crate) struct Build {
    #[command(flatten)]
    pub(crate) inputs: Inputs,
    /// Output to write; repeatable (`list` lists the targets).
    #[arg(long, short, value_name = "TARGET", required = true)]
    pub(crate) target: Vec<String>,
    /// Folder for the outputs. Their names begin with STEM, the name of the input file without its extension; only the files of an engine are called `grafsynth_*`.
    #[arg(long, short, value_name = "DIR", default_value = ".")]
    pub(crate) output: PathBuf,
    /// Run again whenever the design, or a file that it uses, is saved; stop with Ctrl-C. Errors appear at once; proofs follow, and the next save cancels them. If the saved design has errors, the last good outputs are kept.
    #[arg(long)]
    pub(crate) watch: bool,
    /// Stimulus for test vectors, the SIMULATION section and the test bench.
    #[arg(long, value_name = "FILE")]
    pub(crate) stimulus: Option<String>,
    /// Also write a report about all outputs: encoding, equations, pins, timing, requirements, proofs. `html` (default): STEM.report.html, one file with all
    /// drawings; `md`: STEM.report.md and a drawing of each chip (for example `STEM.jed.svg`); `json`: STEM.report.json, for programs.
    #[arg(long, value_name = "FORM", value_enum, num_args = 0..=1, require_equals = true, default_missing_value = "html")]
    pub(crate) report: Option<ReportForm>,
    /// Measure reactions on simulated machines for the report (needs avr-gcc and simavr, or arm-none-eabi-gcc and qemu).
    #[arg(long, requires = "report")]
    pub(crate) measure: bool,
    /// For each output FILE in C, equations, Verilog or BLIF, also write FILE.map.json, which maps its lines to the chart.
    #[arg(long, value_name = "WHAT", value_enum)]
    pub(crate) emit: Option<Emit>,
    /// Jinja template for `--target template`, rendered with the JSON of the net; `my.py.j2` writes STEM.py; repeatable.
    #[arg(long, value_name = "FILE")]
    pub(crate) template: Vec<String>,
    /// Skip the proofs; C and circuits are still tested on random reactions.
    #[arg(long)]
    pub(crate) no_proof: bool,
    /// If an output differs from the chart, write two traces that show the difference: that of the chart to this file, as `.csv`, `.vcd`, `.jsonl` or `.svg`, and that of
    /// the output to FILE-2; further differences to FILE-3 and so on. `sim --stimulus FILE` replays a `.csv`.
    #[arg(long, value_name = "FILE", value_parser = build_trace, value_hint = ValueHint::FilePath)]
    pub(crate) trace: Option<BuildTrace>,
    #[command(flatten)]
    pub(crate) limits: Limits,
    #[command(flatten)]
    pub(crate) trust: Trust,
    /// Style of the C: `auto`, `switch`, `tables`, `bits`, `engine`, `program` or `btrans` (`list` describes them).
    #[arg(long, value_name = "STYLE", default_value = "auto", help_heading = C_OUTPUT)]
    pub(crate) style: String,
    /// Optimise for worst-case time (`speed`; ties by size) or for code size (`size`); requires `--for`.
    #[arg(long, value_name = "WHAT", value_parser = GOALS, default_value = "speed", requires = "machine", help_heading = C_OUTPUT)]
    pub(crate) optimise: Goal,
    /// Write the C as a package in the folder STEM-WHAT: `plain` (with a Makefile), `arduino`, `platformio`, `cmake`; comma-separated or repeated.
    #[arg(long, value_name = "WHAT", value_delimiter = ',', help_heading = C_OUTPUT)]
    pub(crate) package: Vec<String>,
    /// Pass Boolean inputs and outputs as `bool` members or as bits of words.
    #[arg(long, value_name = "FORM", value_parser = FORMS, default_value = "members", help_heading = C_OUTPUT)]
    pub(crate) io: Io,
    /// Return early from a reaction that cannot change anything (same inputs and `dt` as the last reaction, which changed nothing).
    #[arg(long, help_heading = C_OUTPUT)]
    pub(crate) gate: bool,
    /// Check state variables before each reaction; on corruption, hold the safe outputs until `init`.
    #[arg(long, help_heading = C_OUTPUT)]
    pub(crate) safe_state: bool,
    /// Keep the last N fired transitions with their reaction numbers in the instance, for `grafsynth trace`.
    #[arg(long, value_name = "N", value_parser = whole(1..=8192_u16), help_heading = C_OUTPUT)]
    pub(crate) trace_ring: Option<u16>,
    /// Call functions of your own when a step becomes active or inactive (`NAME_activated`) and when a transition becomes enabled (`NAME_enabled`).
    #[arg(long, help_heading = C_OUTPUT)]
    pub(crate) callbacks: bool,
    /// Also write the image of `c-engine` or `c-program` (tables or byte code) as `STEM.bin`, which the engine can load from flash or EEPROM.
    #[arg(long, help_heading = C_OUTPUT)]
    pub(crate) blob: bool,
    /// Device for equations, fuse maps and bitstreams (`list` lists the devices).
    #[arg(long, value_name = "DEVICE", help_heading = CIRCUITS)]
    pub(crate) device: Option<String>,
    /// State encoding of mutually exclusive steps: `one-hot` (a flip-flop per step), `zero-hot` (a flip-flop per step except the first), `compact`
    /// (binary); `auto` uses the first that fits the device.
    #[arg(long, value_name = "CODE", value_parser = ENCODINGS, default_value = "auto", help_heading = CIRCUITS)]
    pub(crate) encoding: EncodingChoice,
    /// When a chart with `evolution stable` takes one clock per micro-step, with a `busy` pin, instead of one clock per reaction.
    #[arg(long, value_name = "WHEN", value_enum, default_value = "unproved", help_heading = CIRCUITS)]
    pub(crate) busy: Busy,
    /// Use no don't-cares, such as unreachable states and inputs that an `assume` excludes.
    #[arg(long, help_heading = CIRCUITS)]
    pub(crate) no_dc: bool,
    /// Return from every illegal state to the initial one within one clock (proved for all codes).
    #[arg(long, help_heading = CIRCUITS)]
    pub(crate) safe: bool,
    /// Synchroniser flip-flops for each input not declared `synchronous`: 0, 1 or 2.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = whole(0..=2_u32), help_heading = CIRCUITS)]
    pub(crate) synchronise: u32,
    /// Add an active-high reset input with this name to the Verilog.
    #[arg(long, value_name = "NAME", help_heading = CIRCUITS)]
    pub(crate) reset: Option<String>,
    /// Reset at the next clock (`sync`) or at once (`async`).
    #[arg(long, value_name = "STYLE", value_parser = RESETS, default_value = "sync", requires = "reset", help_heading = CIRCUITS)]
    pub(crate) reset_style: ResetStyle,
    /// Keep the pins of an earlier output (`.jed`, `.pld`, `.pds`) if the functions still fit there.
    #[arg(long, value_name = "FILE", help_heading = CIRCUITS)]
    pub(crate) keep_pins: Option<String>,
    /// Minimise and fit imported logic again, also on another device, instead of programming it as written.
    #[arg(long, help_heading = CIRCUITS)]
    pub(crate) refit: bool,
}

#[derive(Debug, Args)]
pub(crate) struct Sim {
    #[command(flatten)]
    pub(crate) input: Input,
    #[command(flatten)]
    pub(crate) trust: Trust,
    /// Stimulus (CSV). A trace is accepted too: `sim` then reports the first cell that differs.
    #[arg(long, short, value_name = "FILE")]
    pub(crate) stimulus: Option<String>,
    /// Run N random reactions instead of a stimulus.
    #[arg(long, value_name = "N", conflicts_with = "stimulus", value_parser = whole(0..=usize::MAX))]
    pub(crate) random: Option<usize>,
    /// Drive the chart by hand: one reaction at a time, with keys, or with commands on standard input.
    ///
    /// After each reaction, the session shows the active steps, inputs, outputs and variables (`*`: changed), the transitions that fired, the running timers, and what each transition waits for. On a terminal, each key is a command; the last line lists them, and each input shows its key. If standard input or output is not a terminal,
    /// each line contains commands with `;` between them: `NAME` (change a Boolean input, or let an event occur), `NAME=VALUE`, `react [N]`, `micro` (one
    /// micro-step), `next` (a reaction at the next threshold of a timer), `dt TICKS`, `undo [N]`, `restart`, `show`, `help`, `quit`. `#` begins a comment. A wrong
    /// line of a script ends the run with exit code 1, and nothing is written.
    #[arg(long, short, conflicts_with_all = ["stimulus", "random"])]
    pub(crate) interactive: bool,
    /// Write the inputs of the session as a stimulus (CSV), which `--stimulus` replays to the same trace.
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub(crate) record: Option<PathBuf>,
    /// Run the chart with this plant (docs/plant.md), which sets the inputs that the stimulus does not contain.
    ///
    /// A row of the stimulus with `dt` k then is k reactions of one tick, because a sensor can change at each tick. The trace contains the inputs as they were set.
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath, conflicts_with_all = ["random", "interactive", "restore"])]
    pub(crate) plant: Option<String>,
    /// Seed of the random reactions.
    #[arg(long, value_name = "K", default_value_t = 1, value_parser = whole(0..=u64::MAX))]
    pub(crate) seed: u64,
    /// Engine (`list` lists the engines).
    #[arg(long, short, value_name = "ENGINE", default_value = "ir")]
    pub(crate) engine: String,
    /// Partition file (STEM.split of `split`), for the engines `split` and `split-mcu`.
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub(crate) with: Option<String>,
    /// Write the trace to this file, as `.csv`, `.vcd`, `.jsonl` or `.svg` with waveforms (default: CSV on standard output).
    #[arg(long, short, value_name = "FILE")]
    pub(crate) trace: Option<PathBuf>,
    /// Leave the waveforms of everything but inputs empty, for exercises.
    #[arg(long, requires = "trace")]
    pub(crate) blank: bool,
    /// Start from a state written by `--save`. Steps and variables are matched by name, so the chart may have changed since.
    #[arg(long, value_name = "FILE")]
    pub(crate) restore: Option<String>,
    /// Write the state after the last reaction.
    #[arg(long, value_name = "FILE")]
    pub(crate) save: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct Trace {
    /// Dump of the ring: the bytes that `NAME_trace_byte` returns, or the same in hexadecimal.
    pub(crate) dump: String,
    /// Chart from which the code was built; give the same input options as in the build.
    #[arg(long, value_name = "FILE")]
    pub(crate) chart: String,
    #[command(flatten)]
    pub(crate) reading: Reading,
}

#[derive(Debug, Args)]
pub(crate) struct Compare {
    #[command(flatten)]
    pub(crate) inputs: Inputs,
    #[command(flatten)]
    pub(crate) trust: Trust,
    /// Stimulus (CSV).
    #[arg(long, short, value_name = "FILE")]
    pub(crate) stimulus: Option<String>,
    /// Run N random reactions. Two designs are then tested, not proved equal.
    #[arg(long, value_name = "N", conflicts_with = "stimulus", value_parser = whole(0..=usize::MAX))]
    pub(crate) random: Option<usize>,
    /// Seed of the random reactions.
    #[arg(long, value_name = "K", default_value_t = 1, value_parser = whole(0..=u64::MAX))]
    pub(crate) seed: u64,
    /// Compare the signal LOGIC of a logic file with the signal NAME of the other design (of two logic files, LOGIC is in the second); repeatable.
    #[arg(long, value_name = "LOGIC=NAME")]
    pub(crate) rename: Vec<String>,
    /// Test two designs on random reactions only.
    #[arg(long)]
    pub(crate) no_proof: bool,
    /// Map of C that `build` emitted and somebody edited (default: STEM.map.json beside STEM.c).
    #[arg(long, value_name = "FILE")]
    pub(crate) map: Option<String>,
    #[command(flatten)]
    pub(crate) effort: Effort,
    /// Run only these engines, comma-separated (default: all but the microcontrollers and `js`; `list` lists them).
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    pub(crate) engines: Vec<String>,
    /// Partition file (STEM.split of `split`), for the engines `split` and `split-mcu`.
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub(crate) with: Option<String>,
    /// Write the traces that show a difference, up to the row of the difference, as `.csv`, `.vcd`, `.jsonl` or `.svg`: that of the chart or of the first design to this file,
    /// that of the engine or of the second design to FILE-2; further differences to FILE-3 and so on. `sim --stimulus FILE` replays a `.csv`.
    #[arg(long, value_name = "FILE")]
    pub(crate) trace: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct Convert {
    #[command(flatten)]
    pub(crate) input: Input,
    /// File to write; `-` is standard output (requires `--to`).
    pub(crate) output: PathBuf,
    /// Format to write, if the file's name does not show it.
    #[arg(long, value_name = "FORMAT")]
    pub(crate) to: Option<String>,
}

#[derive(Debug, Args)]
pub(crate) struct Minimise {
    /// Table in espresso format; `-` is standard input.
    pub(crate) file: String,
    /// Share product terms between outputs, as in a PLA (default).
    #[arg(long, conflicts_with = "per_output")]
    pub(crate) shared: bool,
    /// Minimise each output on its own, as in a PAL.
    #[arg(long)]
    pub(crate) per_output: bool,
    /// Invert outputs if that saves product terms.
    #[arg(long)]
    pub(crate) phase: bool,
    /// Search for a proved minimum (default); report a bound if the budget runs out.
    #[arg(long, conflicts_with = "heuristic")]
    pub(crate) exact: bool,
    /// Search for a small result only, without a proof that it is the minimum.
    #[arg(long)]
    pub(crate) heuristic: bool,
    /// Effort, 0 to 9; each step allows ten times the work. Work is counted in operations, so the result is the same on every machine.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = whole(0..=9_u32))]
    pub(crate) budget: u32,
    /// Write the minimised table to this file; `-` is standard output (the report then goes to standard error).
    #[arg(long, short, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct Fmt {
    /// Charts (.graf, .rules); `-` formats standard input to standard output.
    #[arg(required = true)]
    pub(crate) files: Vec<String>,
    /// Change nothing; exit with 1 if a file is not formatted.
    #[arg(long)]
    pub(crate) check: bool,
}

#[derive(Debug, Args)]
pub(crate) struct Diff {
    /// Old chart.
    pub(crate) old: String,
    /// New chart.
    pub(crate) new: String,
    /// Machine whose cost model gives the cost of each task that declares none.
    #[arg(long = "for", value_name = "MACHINE", value_parser = machine)]
    pub(crate) machine: Option<&'static Machine>,
    /// Number of random reactions to run if the charts are too large to enumerate.
    #[arg(long, value_name = "N", default_value_t = 10_000, value_parser = whole(0..=usize::MAX))]
    pub(crate) random: usize,
    /// Seed of the random reactions.
    #[arg(long, value_name = "K", default_value_t = 1, value_parser = whole(0..=u64::MAX))]
    pub(crate) seed: u64,
    /// If the behaviour differs, write two traces that show the difference: that of the old chart to this file, as `.csv`, `.vcd`, `.jsonl` or `.svg`, and that of the new
    /// chart to FILE-2.
    /// `sim --stimulus FILE` replays a `.csv`.
    #[arg(long, value_name = "FILE")]
    pub(crate) trace: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct Explain {
    /// Code such as G0101; without a code, list all of them.
    pub(crate) code: Option<String>,
}

#[derive(Debug, Args)]
pub(crate) struct Completions {
    /// Shell.
    pub(crate) shell: clap_complete::Shell,
}

#[derive(Debug, Args)]
pub(crate) struct Manual {
    /// Verb, such as `build`.
    pub(crate) verb: Option<String>,
}
