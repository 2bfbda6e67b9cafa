//! The inputs and results of a build: the data that all paths from a net to an output share.

use crate::coding::EncodingChoice;
use crate::output_report::{Outcome, OutputReport};
use crate::report::chip::Chip;
use crate::stem::FileStem;
use grafsynth_backend_c::package::Ecosystem;
use grafsynth_backend_c::{Package, Style};
use grafsynth_backend_pld::Reset;
use grafsynth_ir::diag::Severity;
use grafsynth_ir::net::Net;
use grafsynth_ir::{Diagnostic, FileId};
use grafsynth_logic::BusyMode;
use grafsynth_sim::Stimulus;
use grafsynth_verify::Limits;
use itertools::Itertools as _;

/// The options of a build.
#[derive(Debug, Clone, Default)]
pub struct BuildOptions {
    /// The beginning of the names of the files; by default the chart's name.
    pub stem: Option<FileStem>,
    /// The device family of equations; `None` selects the default.
    pub device: Option<String>,
    /// C: style, callbacks and more.
    pub c: grafsynth_backend_c::Options,
    /// C: folders for ecosystems instead of separate files.
    pub packages: Vec<Ecosystem>,
    /// The user's templates, for [`crate::target::Target::Template`].
    pub templates: Vec<TemplateFile>,
    /// Whether a reaction of a circuit may take several clocks.
    pub busy: BusyMode,
    /// The number of synchronising flip-flops before each input that is not declared `synchronous`.
    pub synchronise: u32,
    /// Verilog: a reset input.
    pub reset: Option<Reset>,
    /// Equations and fuse maps: an input with this name that sets every register to its initial value at the next clock.
    pub reset_wire: Option<String>,
    /// Pins of an earlier build, by the names in its file: signals keep their pins if that is still possible.
    pub keep_pins: Vec<(String, u32)>,
    /// The state encoding.
    pub encoding: EncodingChoice,
    /// Use unreachable situations, and inputs that violate the chart's assumptions, as don't-cares.
    pub dont_cares: bool,
    /// Make every unreachable situation return to the initial one in one clock, and prove this.
    pub safe: bool,
    /// Test vectors for the SIMULATION section and the test bench.
    pub stimulus: Option<Stimulus>,
    /// Prove that each output equals the net.
    pub prove: bool,
    /// Include the C code of the chart's author in [`Built::packages`].
    pub trusts_code: bool,
    /// Collect the data of each chip for the report page: [`Built::chips`].
    pub report: bool,
    /// Limits of proofs.
    pub limits: Limits,
}

/// A file to be written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OutputFile {
    /// Its name; in a package with its folders, separated by `/`.
    pub name: String,
    /// Its text.
    pub text: String,
    /// The file belongs to the user: it is written only if no file with that name exists.
    pub keep_existing: bool,
    /// The origin of each line.
    pub map: Vec<MapEntry>,
}

impl OutputFile {
    /// A file that does not belong to the user, without origins.
    pub(crate) fn new(name: String, text: String) -> Self {
        OutputFile { name, text, keep_existing: false, map: Vec::new() }
    }
}

/// One line of an output and its origin.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MapEntry {
    /// The line, from 1.
    pub line: u32,
    /// The name of its origin.
    pub name: String,
    /// Where the origin is declared.
    pub span: grafsynth_ir::Span,
    /// Its requirement tags.
    pub req: Vec<String>,
}

/// The result of a build.
#[derive(Debug, Clone, Default)]
pub struct Built {
    /// The files, in the order of the targets.
    pub files: Vec<OutputFile>,
    /// The result for each output: what was proved, and how.
    pub lines: Vec<OutputReport>,
    /// Findings of the back ends.
    pub found: Vec<Diagnostic>,
    /// The targets that could not be made. One finding may refuse several targets; it is in `found` only once.
    pub refused: Vec<Refusal>,
    /// C packages, which the caller may run and compare with the net: without the C code of the chart's author, unless it is trusted.
    pub packages: Vec<Package>,
    /// Bitstream jobs, which the caller may run if the tools are available.
    pub bitstreams: Vec<crate::ice40::Job>,
    /// The data of each chip for the report page, if requested.
    pub chips: Vec<Chip>,
    /// Measurements of the first C package for the report page, if requested.
    pub measured: Vec<Measured>,
}

impl BuildOptions {
    /// The beginning of the names of the files of a net.
    #[must_use]
    pub fn stem_for(&self, net: &Net) -> FileStem {
        self.stem.clone().unwrap_or_else(|| FileStem::of_name(&net.name.text))
    }

    /// The options for C output, with this style if one is given.
    #[must_use]
    pub fn c_for(&self, net: &Net, style: Option<Style>) -> grafsynth_backend_c::Options {
        grafsynth_backend_c::Options {
            stem: Some(self.stem_for(net).as_str().to_owned()),
            style: style.unwrap_or(self.c.style),
            ..self.c.clone()
        }
    }
}

impl Built {
    /// The worst outcome of all lines.
    #[must_use]
    pub fn outcome(&self) -> Outcome {
        self.lines.iter().map(OutputReport::outcome).max().unwrap_or(Outcome::Proved)
    }
}

/// A target that could not be made.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Refusal {
    /// Its name on the command line.
    pub target: &'static str,
    /// The codes of the errors that refuse it, each once.
    pub codes: Vec<&'static str>,
}

impl Refusal {
    /// The refusal of a target by the errors among these findings; `None` if there is no error.
    #[must_use]
    pub fn of(target: &'static str, found: &[Diagnostic]) -> Option<Self> {
        let errors = found.iter().filter(|one| one.severity == Severity::Error);
        let codes: Vec<&str> = errors.map(|one| one.code.id).unique().collect();
        (!codes.is_empty()).then_some(Refusal { target, codes })
    }
}

/// A template as read from its file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TemplateFile {
    /// The number of the file, for the locations of findings.
    pub file: FileId,
    /// Its path.
    pub path: String,
    /// Its text.
    pub text: String,
}

impl TemplateFile {
    /// The name of the file that it generates for a chart: `STEM.py` for `my.py.j2`, `STEM.txt` for `my.j2`.
    #[must_use]
    pub fn output(&self, stem: &FileStem) -> String {
        let name = self.path.rsplit(['/', '\\']).next().unwrap_or(&self.path);
        let bare = [".j2", ".jinja", ".jinja2"].iter().find_map(|end| name.strip_suffix(end));
        let extension = bare.unwrap_or(name).rsplit_once('.').map_or("txt", |(_, it)| it);
        let is_plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '+');
        let plain: String = extension.chars().filter(|c| is_plain(*c)).collect();
        format!("{stem}.{}", if plain.is_empty() { "txt" } else { &plain })
    }
}

/// The measured costs of a package, shown beside the computed bound.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Measured {
    /// The machine, as named by [`grafsynth_backend_c::cost::machine`].
    pub machine: &'static str,
    /// The number of measured reactions.
    pub reactions: u64,
    /// The cost of the most expensive reaction, in the unit of the machine.
    pub step: u64,
    /// The cost of `NAME_init`.
    pub init: u64,
    /// Bytes of stack; `None` if not measured.
    pub stack: Option<u64>,
    /// Bytes of code and constant tables.
    pub text: u64,
}
