//! What is asked of a build, and what it gives: the data that all ways from a net to an output share.

use crate::coding::EncodingChoice;
use crate::output_report::{Outcome, OutputReport};
use crate::report::chip::Chip;
use crate::stem::FileStem;
use grafsynth_backend_c::package::Ecosystem;
use grafsynth_backend_c::{Package, Style};
use grafsynth_backend_pld::Reset;
use grafsynth_ir::net::Net;
use grafsynth_ir::{Diagnostic, FileId};
use grafsynth_logic::BusyMode;
use grafsynth_sim::Stimulus;
use grafsynth_verify::Limits;

/// What the user chose.
#[derive(Debug, Clone, Default)]
pub struct BuildOptions {
    /// What the names of the files begin with; none: the chart's name.
    pub stem: Option<FileStem>,
    /// The device family of equations; none takes the default.
    pub device: Option<String>,
    /// C: style, callbacks.
    pub c: grafsynth_backend_c::Options,
    /// C: folders for ecosystems in place of the bare files.
    pub packages: Vec<Ecosystem>,
    /// Templates of the user's, for [`crate::target::Target::Template`].
    pub templates: Vec<TemplateFile>,
    /// When a reaction of a circuit may take several clocks.
    pub busy: BusyMode,
    /// Flip-flops in front of each input that is not declared `synchronous`.
    pub synchronise: u32,
    /// Verilog: a reset input.
    pub reset: Option<Reset>,
    /// Pins of an earlier build, by the names in its file: signals stay there as far as that is still possible.
    pub keep_pins: Vec<(String, u32)>,
    /// How the steps are coded.
    pub encoding: EncodingChoice,
    /// Equations may do what they like in situations that are not reached, and where the chart's assumptions are broken.
    pub dont_cares: bool,
    /// Every situation that is not reached leads back to the initial one in one clock, and that is proved.
    pub safe: bool,
    /// Test vectors for the SIMULATION section and the test bench.
    pub stimulus: Option<Stimulus>,
    /// Prove the outputs equal.
    pub prove: bool,
    /// [`Built::packages`] hold the C that the author of the chart wrote.
    pub trusts_code: bool,
    /// Gather what a page says of each chip: [`Built::chips`].
    pub report: bool,
    /// How far proofs may go.
    pub limits: Limits,
}

/// A file to be written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OutputFile {
    /// Its name; in a package with the folders that it lies in, parted by `/`.
    pub name: String,
    /// Its text.
    pub text: String,
    /// It is the user's: written only where no file of that name is.
    pub keep_existing: bool,
    /// Which line comes from which place.
    pub map: Vec<MapEntry>,
}

/// One line of an output and where it comes from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MapEntry {
    /// The line, from 1.
    pub line: u32,
    /// What it comes from.
    pub name: String,
    /// Where that was declared.
    pub span: grafsynth_ir::Span,
    /// Its requirement tags.
    pub req: Vec<String>,
}

/// What a build gave.
#[derive(Debug, Clone, Default)]
pub struct Built {
    /// The files, in the order of the targets.
    pub files: Vec<OutputFile>,
    /// What was proved and how, a line for each output.
    pub lines: Vec<OutputReport>,
    /// Findings of the back ends.
    pub found: Vec<Diagnostic>,
    /// C packages, which the caller may compare with the net by running them: without the C of the chart's author, unless that is trusted.
    pub packages: Vec<Package>,
    /// Bitstreams, which the caller may have made where the tools are.
    pub bitstreams: Vec<crate::ice40::Job>,
    /// What a page says of each chip, where one was asked for.
    pub chips: Vec<Chip>,
    /// What was measured of the first C package, where the caller had it measured for the page.
    pub measured: Vec<Measured>,
}

impl BuildOptions {
    /// What the names of the files of a net begin with.
    #[must_use]
    pub fn stem_for(&self, net: &Net) -> FileStem {
        self.stem.clone().unwrap_or_else(|| FileStem::of_name(&net.name.text))
    }

    /// How C is emitted: in a style of its own, or in that of the options.
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
    /// The worst of all lines.
    #[must_use]
    pub fn outcome(&self) -> Outcome {
        self.lines.iter().map(OutputReport::outcome).max().unwrap_or(Outcome::Proved)
    }
}

/// A template as it was read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TemplateFile {
    /// The file that findings point into.
    pub file: FileId,
    /// Its path.
    pub path: String,
    /// Its text.
    pub text: String,
}

impl TemplateFile {
    /// The file that it makes for a chart: `my.py.j2` makes `STEM.py`, a template without a language `STEM.txt`.
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

/// What was measured of a package beside its bound.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Measured {
    /// The machine, as [`grafsynth_backend_c::cost::machine`] calls it.
    pub machine: &'static str,
    /// Reactions that were looked at.
    pub reactions: u64,
    /// The dearest of them, in the unit of the machine.
    pub step: u64,
    /// `NAME_init`.
    pub init: u64,
    /// Bytes of stack; none where it was not looked at.
    pub stack: Option<u64>,
    /// Bytes of text and constant tables.
    pub text: u64,
}
