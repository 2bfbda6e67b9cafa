//! The command line as the user writes it.

use crate::exit::Demands;
use crate::render::MessageFormat;
use clap::{Args, Parser, Subcommand, ValueEnum};
use grafsynth_backend_c::cost::{self, Machine};
use std::path::PathBuf;

/// Charts to C and programmable logic, with every output proved against the chart.
#[derive(Debug, Parser)]
#[command(name = "grafsynth", version, max_term_width = 100, arg_required_else_help = true)]
#[command(
    after_help = "Exit codes: 0 done and true; 1 the input is wrong or cannot be done as asked; 2 an option is wrong, or a file cannot be read or written; 3 refuted, or a difference was found; 4 a question stayed open; 130 stopped by Ctrl-C."
)]
pub(crate) struct Cli {
    #[command(flatten)]
    pub(crate) global: Global,
    #[command(subcommand)]
    pub(crate) verb: Verb,
}

/// Options that every verb takes.
#[derive(Debug, Args)]
pub(crate) struct Global {
    /// How findings are shown.
    #[arg(long, global = true, value_name = "FORMAT", default_value = "human")]
    pub(crate) message_format: MessageFormat,
    /// Colours; `NO_COLOR` in the environment turns them off.
    #[arg(long, global = true, value_name = "WHEN", default_value = "auto")]
    pub(crate) color: When,
    /// Say nothing but findings and what was asked for.
    #[arg(long, short, global = true)]
    pub(crate) quiet: bool,
    /// Be strict: with `open` a check that was not carried out is an open question (exit code 4); with `warnings` a warning is an error (1).
    #[arg(long, global = true, value_name = "WHAT", value_enum, value_delimiter = ',')]
    pub(crate) deny: Vec<Deny>,
    /// Be lenient: with `tested` an open question whose answer was tested counts as answered (exit code 0 instead of 4).
    #[arg(long, global = true, value_name = "WHAT", value_enum, value_delimiter = ',')]
    pub(crate) allow: Vec<Allow>,
    /// Show at most so many findings of a file; the rest is counted.
    #[arg(long, global = true, value_name = "N", default_value_t = 100)]
    pub(crate) max_diagnostics: usize,
    /// The deepest nesting of brackets and blocks that is read.
    #[arg(long, global = true, value_name = "N", default_value_t = 256)]
    pub(crate) nesting_limit: u32,
    /// The longest source that is read, in bytes.
    #[arg(long, global = true, value_name = "BYTES", default_value_t = crate::files::SOURCE_LIMIT)]
    pub(crate) source_limit: u64,
}

impl Global {
    /// What the user wants to be strict or lenient about.
    pub(crate) fn demands(&self) -> Demands {
        Demands {
            deny_open: self.deny.contains(&Deny::Open),
            deny_warnings: self.deny.contains(&Deny::Warnings),
            allow_tested: self.allow.contains(&Allow::Tested),
        }
    }
}

/// What to be strict about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Deny {
    Open,
    Warnings,
}

/// What to be lenient about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Allow {
    Tested,
}

/// Whether to use colours.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum When {
    Auto,
    Always,
    Never,
}

/// When a reaction of a circuit takes several clocks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Busy {
    /// Never: one clock is one reaction, or the chart is refused.
    Never,
    /// Where the micro-steps are too large in one clock.
    TooLarge,
    /// There, and where it is not proved that the evolution ends within its limit.
    Unproved,
    /// Wherever the chart evolves.
    Always,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Verb {
    /// Make a small project: chart, board, stimulus, and a Makefile that builds it.
    New(New),
    /// Read, validate, lint, and prove the asserts: every finding at once.
    Check(Check),
    /// Write C, equations or Verilog; each output is read back and proved equal to the chart before it is written.
    Build(Box<Build>),
    /// Run a design on a stimulus and print the trace.
    Sim(Sim),
    /// Run all engines on the same stimulus and print the first difference.
    Compare(Compare),
    /// Read one format and write another.
    Convert(Convert),
    /// Make a table of two-level logic (.pla) small: products, literals, and whether the number is proved to be the least.
    Minimise(Minimise),
    /// Decode the trace ring of a chart in the field (`build --trace`): which transitions fired, and the situations that they led to.
    Trace(Trace),
    /// Bring charts into the canonical form.
    Fmt(Fmt),
    /// What changed between two charts: steps, conditions, behaviour.
    Diff(Diff),
    /// Print the page of a finding's code: cause, example, way out.
    Explain(Explain),
    /// Say which tools are here and what that makes possible.
    Doctor,
    /// Print a completion script for a shell.
    Completions(Completions),
    /// Print the manual page.
    Man,
}

impl Verb {
    /// Its name on the command line.
    pub(crate) fn name(&self) -> &'static str {
        match self {
            Verb::New(_) => "new",
            Verb::Check(_) => "check",
            Verb::Build(_) => "build",
            Verb::Sim(_) => "sim",
            Verb::Compare(_) => "compare",
            Verb::Convert(_) => "convert",
            Verb::Minimise(_) => "minimise",
            Verb::Trace(_) => "trace",
            Verb::Fmt(_) => "fmt",
            Verb::Diff(_) => "diff",
            Verb::Explain(_) => "explain",
            Verb::Doctor => "doctor",
            Verb::Completions(_) => "completions",
            Verb::Man => "man",
        }
    }
}

/// The design that a verb works on.
#[derive(Debug, Args)]
pub(crate) struct Input {
    /// A chart (.graf .rules .scxml .st .c .kiss2 .net) or logic (.pds .pld .v .blif .pla); `-` is standard input.
    pub(crate) file: String,
    #[command(flatten)]
    pub(crate) reading: Reading,
}

/// The designs that a verb works on.
#[derive(Debug, Args)]
pub(crate) struct Inputs {
    /// Charts (.graf .rules .scxml .st .c .kiss2 .net) or logic (.pds .pld .v .blif .pla); `-` is standard input. Of a folder the charts in it and below; hidden folders and links to folders are left out.
    #[arg(required = true, value_name = "FILE")]
    pub(crate) files: Vec<String>,
    #[command(flatten)]
    pub(crate) reading: Reading,
}

impl Input {
    /// A file by its path alone.
    pub(crate) fn plain(path: &str) -> Self {
        Input { file: path.to_owned(), reading: Reading::default() }
    }
}

/// What beside its text says which design a file is: what a chart was built with it is traced with.
#[derive(Debug, Clone, Args, Default)]
pub(crate) struct Reading {
    /// The format, where the file's name does not say it.
    #[arg(long, value_name = "FORMAT")]
    pub(crate) from: Option<String>,
    /// A property to prove, such as `never (R and L)`; may be given several times.
    #[arg(long, value_name = "PROPERTY")]
    pub(crate) assert: Vec<String>,
    /// Library files (`use "FILE"`) are read below this folder, instead of the folder of the chart.
    #[arg(long, value_name = "DIR")]
    pub(crate) root: Option<PathBuf>,
    /// A board file: device, pins and places. `NAME.board` beside the chart is read by itself.
    #[arg(long, value_name = "FILE")]
    pub(crate) board: Option<String>,
    /// The machine that C is for, `avr`, `cortex-m3`, `8051` or `host`: tasks that declare no cost have the one that its cost model counts; `build` takes of the styles that
    /// carry the chart the one with the cheapest worst case there.
    #[arg(long = "for", value_name = "MACHINE", value_parser = machine)]
    pub(crate) machine: Option<&'static Machine>,
    #[command(flatten)]
    pub(crate) c: COptions,
}

/// How a C source becomes a chart.
#[derive(Debug, Clone, Args, Default)]
#[command(next_help_heading = "C sources")]
pub(crate) struct COptions {
    /// The function that the chart runs; `main`, or the last one that no other calls.
    #[arg(long, value_name = "FUNCTION")]
    pub(crate) entry: Option<String>,
    /// Make one step of straight-line code.
    #[arg(long)]
    pub(crate) fuse: bool,
    /// Leave a function in C; may be given several times.
    #[arg(long, value_name = "FUNCTION")]
    pub(crate) keep: Vec<String>,
    /// Make macro-steps of the statements behind each comment, or of blocks.
    #[arg(long, value_name = "WHAT", value_parser = ["comments", "blocks"])]
    pub(crate) group: Option<String>,
    /// A macro-step for each call, or one for all calls of a function.
    #[arg(long, value_name = "HOW", value_parser = ["copy", "share"])]
    pub(crate) calls: Option<String>,
    /// Bits of `int`.
    #[arg(long, value_name = "BITS", value_parser = ["16", "32"])]
    pub(crate) int: Option<String>,
    /// Plain `char` is unsigned.
    #[arg(long)]
    pub(crate) unsigned_char: bool,
    /// Elements of an array parameter whose length is not written.
    #[arg(long, value_name = "N")]
    pub(crate) array_length: Option<u32>,
    /// A name that stands for a number, 1 without `=VALUE`; may be given several times.
    #[arg(short = 'D', value_name = "NAME[=VALUE]", value_parser = constant)]
    pub(crate) define: Vec<(String, i64)>,
}

/// The machine that C is for.
fn machine(name: &str) -> Result<&'static Machine, String> {
    cost::machine(name).ok_or_else(|| {
        let known = || cost::MACHINES.iter().map(|machine| machine.name);
        let near = grafsynth_ir::diag::nearest(name, known())
            .map(|near| format!(", did you mean `{near}`?"))
            .unwrap_or_default();
        let known: Vec<&str> = known().collect();
        format!("no machine is called `{name}`{near} (there are {})", known.join(", "))
    })
}

/// `NAME`, `NAME=5`, `NAME=-0x10`.
fn constant(text: &str) -> Result<(String, i64), String> {
    let (name, value) = text.split_once('=').unwrap_or((text, "1"));
    let is_name = name.starts_with(|first: char| first.is_ascii_alphabetic() || first == '_')
        && name.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'_');
    if !is_name {
        return Err(format!("`{name}` is no name of C"));
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
        Err(_) => Err(format!(
            "`{value}` is no number; a name stands for a decimal number or one in 0x.."
        )),
    }
}

impl COptions {
    /// As the reader takes them.
    pub(crate) fn options(&self) -> grafsynth_driver::read::COptions {
        use grafsynth_driver::read::{CCalls, CGroup, COptions};
        let default = COptions::default();
        COptions {
            int_bits: if self.int.as_deref() == Some("16") { 16 } else { default.int_bits },
            is_unsigned_char: self.unsigned_char,
            fuse: self.fuse,
            keep: self.keep.clone(),
            group: match self.group.as_deref() {
                Some("comments") => CGroup::Comments,
                Some("blocks") => CGroup::Blocks,
                _ => CGroup::Nothing,
            },
            calls: if self.calls.as_deref() == Some("share") {
                CCalls::Share
            } else {
                CCalls::Copy
            },
            entry: self.entry.clone(),
            array_length: self.array_length.unwrap_or(default.array_length),
            defines: self.define.clone(),
        }
    }
}

#[derive(Debug, Args)]
pub(crate) struct New {
    /// The project's name and folder.
    pub(crate) name: String,
}

#[derive(Debug, Args)]
pub(crate) struct Check {
    #[command(flatten)]
    pub(crate) inputs: Inputs,
    /// Print the intermediate form after this pass (`list` names the passes).
    #[arg(long, value_name = "PASS")]
    pub(crate) dump_after: Option<String>,
    /// Write the text with a certificate behind each library chart in it: which of its properties are proved, by which version, of which text. `-` is standard output.
    #[arg(long, value_name = "OUTPUT")]
    pub(crate) certify: Option<PathBuf>,
    /// Show notes on what is right as it is: `conflicts`, which the conflict policy decides, and who wins.
    #[arg(long, value_name = "WHAT", value_parser = ["conflicts"], value_delimiter = ',')]
    pub(crate) notes: Vec<String>,
    #[command(flatten)]
    pub(crate) limits: Limits,
}

/// How far proofs may go.
#[derive(Debug, Args)]
pub(crate) struct Limits {
    /// Enumerate at most so many pairs of state and input.
    #[arg(long, value_name = "N", default_value_t = 2_000_000)]
    pub(crate) proof_limit: u64,
}

/// Whose C may run on this machine. Only the command line says so: no chart and no board can.
#[derive(Debug, Clone, Copy, Args)]
pub(crate) struct Trust {
    /// Run the C that the chart contains (`code c`) when its C is compiled and tested; without it, that text is left out.
    #[arg(long)]
    pub(crate) trust_code: bool,
}

#[derive(Debug, Args)]
pub(crate) struct Build {
    #[command(flatten)]
    pub(crate) input: Input,
    /// What to write; may be given several times. `list` names the targets.
    #[arg(long, short, value_name = "TARGET", required = true)]
    pub(crate) target: Vec<String>,
    /// The folder for the outputs.
    #[arg(long, short, value_name = "DIR", default_value = ".")]
    pub(crate) output: PathBuf,
    /// The device family that equations are for.
    #[arg(long, value_name = "DEVICE")]
    pub(crate) device: Option<String>,
    /// Equations and fuse maps: signals keep the pins that they have in this earlier output (`.jed`, `.pld` or `.pds`), as far as their functions still fit there.
    #[arg(long, value_name = "FILE")]
    pub(crate) keep_pins: Option<String>,
    /// Logic by others: make its functions small and give it pins anew, on another device too, instead of burning it as written.
    #[arg(long)]
    pub(crate) refit: bool,
    /// C: a folder NAME-WHAT in place of the bare files: `plain` (a Makefile), `arduino`, `platformio`, `cmake`; separated by commas or given several times.
    #[arg(long, value_name = "WHAT", value_delimiter = ',')]
    pub(crate) package: Vec<String>,
    /// `template`: a text with Jinja's placeholders that is rendered over the net's JSON; `my.py.j2` gives NAME.py. May be given several times.
    #[arg(long, value_name = "FILE")]
    pub(crate) template: Vec<String>,
    /// `c-engine`, `c-program`: write the tables as a binary image too (`NAME.bin`), which the engine loads from a flash or an EEPROM.
    #[arg(long)]
    pub(crate) blob: bool,
    /// C: `auto`, `switch`, `tables`, `bits` or `engine`.
    #[arg(long, value_name = "STYLE", default_value = "auto")]
    pub(crate) style: String,
    /// C, with `--for`: what is to be small, the time of the dearest reaction (among equals the text) or the text.
    #[arg(long, value_name = "WHAT", value_parser = ["speed", "size"], default_value = "speed", requires = "machine")]
    pub(crate) optimise: String,
    /// C: Boolean inputs and outputs as `bool` members, or as bits of words.
    #[arg(long, value_name = "FORM", value_parser = ["members", "words"], default_value = "members")]
    pub(crate) io: String,
    /// C: return at once from a reaction that would change nothing: same inputs and `dt` as the last, which changed nothing.
    #[arg(long)]
    pub(crate) gate: bool,
    /// C: look at the state variables before each reaction; where one holds what it never does, the outputs are safe until the next `init`.
    #[arg(long)]
    pub(crate) safe_state: bool,
    /// C: keep the last N transitions that fired, with the number of their reaction, in the instance; `grafsynth trace` reads them.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=8192))]
    pub(crate) trace: Option<u16>,
    /// C: call the user's `activated` and `enabled` functions.
    #[arg(long)]
    pub(crate) callbacks: bool,
    /// Circuits of a chart that evolves until it is stable: one micro-step a clock, with a `busy` pin, instead of all of them in one clock.
    #[arg(long, value_name = "WHEN", value_enum, default_value = "unproved")]
    pub(crate) busy: Busy,
    /// How steps that exclude each other are coded: a flip-flop each, all but the first, or numbers. `auto` takes the first of these that fits the device.
    #[arg(long, value_name = "CODE", value_parser = ["auto", "one-hot", "zero-hot", "compact"], default_value = "auto")]
    pub(crate) encoding: String,
    /// Equations without don't-cares: the circuit does what the chart says in situations too that are never reached.
    #[arg(long)]
    pub(crate) no_dc: bool,
    /// Every situation that is never reached leads back to the initial one in one clock, which is proved over all codes.
    #[arg(long)]
    pub(crate) safe: bool,
    /// Flip-flops in front of each input that is not declared `synchronous`: 0, 1 or 2.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u32).range(0..=2))]
    pub(crate) synchronise: u32,
    /// Verilog: a reset input of this name, active high, beside the values at power-up.
    #[arg(long, value_name = "NAME")]
    pub(crate) reset: Option<String>,
    /// When the reset acts: `sync`, at the next clock, or `async`, at once.
    #[arg(long, value_name = "STYLE", value_parser = ["sync", "async"], default_value = "sync", requires = "reset")]
    pub(crate) reset_style: String,
    /// A stimulus for the SIMULATION section and the test bench.
    #[arg(long, value_name = "FILE")]
    pub(crate) stimulus: Option<String>,
    /// Beside each output, NAME.map.json says which line came from which place of the chart.
    #[arg(long, value_name = "WHAT", value_parser = ["map"])]
    pub(crate) emit: Option<String>,
    /// A page beside the outputs, NAME.report.md, and a drawing of each chip, FILE.svg: codes, equations, product terms, pins, power-up, clock, requirements, what was proved.
    #[arg(long)]
    pub(crate) report: bool,
    /// C, with `--report`: measure reactions on simulated machines too, where avr-gcc and simavr, arm-none-eabi-gcc and qemu are here.
    #[arg(long, requires = "report")]
    pub(crate) measure: bool,
    #[command(flatten)]
    pub(crate) trust: Trust,
    /// Do not prove the outputs equal (they are still read back).
    #[arg(long)]
    pub(crate) no_proof: bool,
    #[command(flatten)]
    pub(crate) limits: Limits,
}

#[derive(Debug, Args)]
pub(crate) struct Sim {
    #[command(flatten)]
    pub(crate) input: Input,
    #[command(flatten)]
    pub(crate) trust: Trust,
    /// The stimulus, CSV. A trace is one too: `sim` tells the first cell that is not as it was.
    #[arg(long, short, value_name = "FILE")]
    pub(crate) stimulus: Option<String>,
    /// So many random reactions instead.
    #[arg(long, value_name = "N", conflicts_with = "stimulus")]
    pub(crate) random: Option<usize>,
    /// The seed of the random reactions.
    #[arg(long, value_name = "K", default_value_t = 1)]
    pub(crate) seed: u64,
    /// The engine; `list` names them.
    #[arg(long, short, value_name = "ENGINE", default_value = "ir")]
    pub(crate) engine: String,
    /// Where the trace goes: `.csv`, `.vcd` or `.jsonl`; standard output (CSV) if not given.
    #[arg(long, short, value_name = "FILE")]
    pub(crate) trace: Option<PathBuf>,
    /// Start from a state that `--save` wrote, by name, even of a changed chart.
    #[arg(long, value_name = "FILE")]
    pub(crate) restore: Option<String>,
    /// Write the state after the last reaction.
    #[arg(long, value_name = "FILE")]
    pub(crate) save: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct Trace {
    /// The dump: the bytes of `NAME_trace_byte`, or the same as hexadecimal text.
    pub(crate) dump: String,
    /// The chart that the code was built from; the options that say how it is read are given as they were to `build`.
    #[arg(long, value_name = "FILE")]
    pub(crate) chart: String,
    #[command(flatten)]
    pub(crate) reading: Reading,
}

#[derive(Debug, Args)]
pub(crate) struct Compare {
    /// One design: all engines run it. Two or more: the first against each of the others, by the columns that both have. Two folders: files of one name
    /// against each other. `-` is standard input. `--board` and `--assert` are of the first design, the other options of reading of each.
    #[command(flatten)]
    pub(crate) inputs: Inputs,
    #[command(flatten)]
    pub(crate) trust: Trust,
    /// The stimulus, CSV.
    #[arg(long, short, value_name = "FILE")]
    pub(crate) stimulus: Option<String>,
    /// Run N random reactions; with a second design, instead of a proof.
    #[arg(long, value_name = "N", conflicts_with = "stimulus")]
    pub(crate) random: Option<usize>,
    /// The seed of the random reactions.
    #[arg(long, value_name = "K", default_value_t = 1)]
    pub(crate) seed: u64,
    /// A name of the second design and what it is called in the first, where that is not the same but for letter case; may be given several times.
    #[arg(long, value_name = "OTHER=NAME")]
    pub(crate) rename: Vec<String>,
    /// Test two designs on random reactions only, without a proof.
    #[arg(long)]
    pub(crate) no_proof: bool,
    /// Only these engines, separated by commas; without it all but those on microcontrollers (`sim --engine list` names them).
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    pub(crate) engines: Vec<String>,
}

#[derive(Debug, Args)]
pub(crate) struct Convert {
    #[command(flatten)]
    pub(crate) input: Input,
    /// The file to write; `-` is standard output (then say `--to`).
    pub(crate) output: PathBuf,
    /// The format to write, where the file's name does not say it.
    #[arg(long, value_name = "FORMAT")]
    pub(crate) to: Option<String>,
}

#[derive(Debug, Args)]
pub(crate) struct Minimise {
    /// The table, in the format of espresso; `-` is standard input.
    pub(crate) file: String,
    /// Products shared between outputs, as a PLA has them (the default).
    #[arg(long, conflicts_with = "per_output")]
    pub(crate) shared: bool,
    /// Each output by itself, as a PAL has it.
    #[arg(long)]
    pub(crate) per_output: bool,
    /// Outputs may be inverted where that takes fewer products.
    #[arg(long)]
    pub(crate) phase: bool,
    /// Look for the proved minimum (the default); falls back to a bound when the budget is spent.
    #[arg(long, conflicts_with = "heuristic")]
    pub(crate) exact: bool,
    /// Only look for a small sum.
    #[arg(long)]
    pub(crate) heuristic: bool,
    /// How much work it may be, 0 to 9; each unit allows ten times more. Counted in steps, so the result is the same on every machine.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(0..=9))]
    pub(crate) budget: u32,
    /// Where the small table goes; `-` is standard output (the report then goes to standard error).
    #[arg(long, short, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct Fmt {
    /// Charts (.graf, .rules); `-` reads standard input and prints.
    #[arg(required = true)]
    pub(crate) files: Vec<String>,
    /// Change nothing; exit code 1 if a file is not in canonical form.
    #[arg(long)]
    pub(crate) check: bool,
}

#[derive(Debug, Args)]
pub(crate) struct Diff {
    /// The old chart.
    pub(crate) old: String,
    /// The new chart.
    pub(crate) new: String,
    /// The machine that both are for: tasks that declare no cost have the one that its cost model counts.
    #[arg(long = "for", value_name = "MACHINE", value_parser = machine)]
    pub(crate) machine: Option<&'static Machine>,
    /// How many random reactions to look for a difference in behaviour with, where the charts are too large to enumerate.
    #[arg(long, value_name = "N", default_value_t = 10_000)]
    pub(crate) random: usize,
    /// The seed of the random reactions.
    #[arg(long, value_name = "K", default_value_t = 1)]
    pub(crate) seed: u64,
}

#[derive(Debug, Args)]
pub(crate) struct Explain {
    /// A code such as G0101; without one, all codes are listed.
    pub(crate) code: Option<String>,
}

#[derive(Debug, Args)]
pub(crate) struct Completions {
    /// The shell.
    pub(crate) shell: clap_complete::Shell,
}
