//! The options of the verbs that show a chart: `draw` and `page`.

use super::Input;
use clap::{Args, ValueEnum, ValueHint};
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(crate) struct Draw {
    #[command(flatten)]
    pub(crate) input: Input,
    /// Draw only the chart with this name (default: all charts and library charts of the file).
    #[arg(long, value_name = "NAME")]
    pub(crate) chart: Option<String>,
    /// Notation of the drawing.
    #[arg(long, value_name = "STYLE", value_enum, default_value_t)]
    pub(crate) style: DrawStyle,
    /// Write conditions with words (`not a and b`) instead of the signs of Grafcet or of structured text.
    #[arg(long)]
    pub(crate) words: bool,
    /// Draw a situation: the names of the active steps or states, separated by commas.
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub(crate) active: Vec<String>,
    /// Show the part of each step and transition: a partition file (STEM.split of `split`).
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub(crate) split: Option<String>,
    /// Show in how many reactions of a stimulus (CSV) each step was active and each transition fired, and which never were.
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub(crate) coverage: Option<String>,
    /// Draw the chart once for each situation of a trace (CSV of `check --trace` or `sim --trace`), with its active steps.
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath, conflicts_with = "active")]
    pub(crate) frames: Option<String>,
    /// Divide the drawing into pages of this size: STEM-1.svg, STEM-2.svg and so on (or .png), or one file with `-o FILE.pdf` (default: A4).
    #[arg(long, value_name = "SIZE", ignore_case = true)]
    pub(crate) page: Option<PaperSize>,
    /// Leave parts blank, for exercises.
    #[arg(long, value_name = "WHAT", value_delimiter = ',')]
    pub(crate) blank: Vec<BlankPart>,
    /// Run again whenever the design, or a file that it uses, is saved; stop with Ctrl-C. If the saved chart has errors, the last good picture stays, with the errors above it (with --page or for a PDF file, the file stays unchanged).
    #[arg(long)]
    pub(crate) watch: bool,
    /// File to write, `.svg`, `.pdf` or `.png`; `-` is standard output (default: STEM.svg, where STEM is the name of the input file without its extension).
    #[arg(long, short, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    /// Pixels of a PNG file for each pixel of the drawing, 1 to 8 (2 are 192 pixels per inch).
    #[arg(long, value_name = "N", default_value_t = 2, value_parser = clap::value_parser!(u8).range(1..=8))]
    pub(crate) scale: u8,
}

/// The sizes of `draw --page`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum PaperSize {
    /// 210 mm x 297 mm
    #[value(name = "A4")]
    A4,
    /// 297 mm x 420 mm
    #[value(name = "A3")]
    A3,
    /// 8.5 in x 11 in
    Letter,
}

/// The notations of `draw --style`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub(crate) enum DrawStyle {
    /// Grafcet (IEC 60848); statecharts in UML
    #[default]
    Grafcet,
    /// Sequential function chart (IEC 61131-3): action blocks, conditions in structured text
    Sfc,
}

/// What `draw --blank` leaves blank.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum BlankPart {
    /// Contents of action boxes, and actions of states
    Actions,
    /// Receptivities, and labels of transitions between states
    Receptivities,
    /// Names of steps, states and transitions
    Names,
}

#[derive(Debug, Args)]
pub(crate) struct Page {
    #[command(flatten)]
    pub(crate) input: Input,
    /// Write conditions in the drawing with words (`not a and b`) instead of the signs of Grafcet.
    #[arg(long)]
    pub(crate) words: bool,
    /// Plant to show and to run with the chart (docs/plant.md); without this option, `NAME.plant` next to the chart is used if it exists.
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub(crate) plant: Option<String>,
    /// Language of the interface when the page is opened; the page has a switch for it. What the author of the chart wrote is never translated.
    #[arg(long, value_enum, default_value = "en")]
    pub(crate) language: PageLanguage,
    /// Run again whenever the design, or a file that it uses, is saved; stop with Ctrl-C. A broken save keeps the last good page.
    #[arg(long)]
    pub(crate) watch: bool,
    /// Leave the source out: the page otherwise shows it beside the drawing.
    #[arg(long)]
    pub(crate) no_source: bool,
    /// File to write; `-` is standard output (default: STEM.html, where STEM is the name of the input file without its extension).
    #[arg(long, short, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
}

/// Values of `page --language`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum PageLanguage {
    /// English
    En,
    /// French
    Fr,
    /// German
    De,
    /// Spanish
    Es,
    /// Portuguese
    Pt,
}
