//! Writes imported logic to files: as a fuse map of the macrocells as written, or minimised and fitted again, also to another device or language.
//!
//! ```text
//! as written   Placement ── map ──► fuses ── write ──► .jed ── read, decode ──► the same products in the same macrocells
//! refit        circuit ── emit ──► equations with pins ── read ──► circuit, proved equal ──► Placement ── as written
//! ```

use crate::built::OutputFile;
use crate::context::Medium;
use crate::jedec::{Written, written};
use crate::judge::{Judged, judge};
use crate::logic::LogicDesign;
use crate::output_report::{Note, OutputFault, OutputProof, OutputReport};
use crate::report::chip::{Chip, Made as About};
use crate::stem::FileStem;
use grafsynth_backend_pld::fuse::{self, Role, own_roles, shell};
use grafsynth_backend_pld::placement::Placement;
use grafsynth_backend_pld::{Dialect, EmitOptions, Emitted, Object, emit, read_text, rebind};
use grafsynth_ir::diag::any_error;
use grafsynth_ir::logic::{Logic, Node};
use grafsynth_ir::{Diagnostic, FileId};
use grafsynth_logic::minimise::Budget;
use grafsynth_verify::Limits;

/// The requested output.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wanted {
    /// Equations or a netlist, minimised.
    Text(Dialect),
    /// A fuse map of the macrocells as written.
    AsWritten,
    /// A fuse map of the circuit, minimised and fitted again.
    Refit,
}

/// A file and its proof.
#[derive(Debug, Clone)]
pub struct Made {
    /// The file.
    pub file: OutputFile,
    /// The result of the proof, or the reason why nothing was proved.
    pub line: OutputReport,
    /// The data of the report page, if requested.
    pub chip: Option<Chip>,
}

/// Makes a file from a design, named `stem` with the extension of its kind, and the data of the report page if `report` is set. `device` is for designs that
/// are fitted again; `None` selects the device that the text names, or the default.
///
/// # Errors
/// The device or the language does not support something, or there is no circuit or no placement.
pub fn make(
    design: &LogicDesign,
    wanted: Wanted,
    device: Option<&str>,
    stem: &FileStem,
    limits: &Limits,
    report: bool,
) -> Result<Made, Vec<Diagnostic>> {
    match wanted {
        Wanted::AsWritten => {
            let placement = design.placement.as_ref().map_err(Clone::clone)?;
            let name = Medium::Fuses.file_name(stem);
            let line = OutputReport::proved(&name, OutputProof::SameProducts);
            burned(name, placement, line, report)
        }
        Wanted::Text(dialect) => {
            let name = Medium::Text(dialect).file_name(stem);
            let fitted = fitted(design, dialect, device, limits)?;
            let line = moved(line(&name, fitted.judged), &fitted.emitted);
            let circuit = design.circuit()?;
            let about = report.then(|| about(&name, &line, circuit));
            let chip = about.map(|about| Chip::of_text(about, &fitted.emitted, 0));
            Ok(Made { file: OutputFile::new(name, fitted.emitted.text), line, chip })
        }
        Wanted::Refit => {
            let name = Medium::Fuses.file_name(stem);
            let fitted = fitted(design, Dialect::Palasm, device, limits)?;
            let line = moved(line(&name, fitted.judged), &fitted.emitted);
            let (circuit, options) = (design.circuit()?, fitted.options);
            // The user did not write the text: its signals have no pins if the circuit does not fit.
            let placement = fitted.placement.map_err(|found| {
                fuse::place_from(None, circuit, &options).err().unwrap_or(found)
            })?;
            burned(name, &placement, line, report)
        }
    }
}

/// The file of an unchanged placement.
fn burned(
    name: String,
    placement: &Placement,
    line: OutputReport,
    report: bool,
) -> Result<Made, Vec<Diagnostic>> {
    let written = written(placement)?;
    let chip = report.then(|| chip(&name, placement, &line, &written));
    Ok(Made { file: OutputFile::new(name, written.text), line, chip })
}

/// The report data of an unchanged placement.
fn chip(name: &str, placement: &Placement, line: &OutputReport, written: &Written) -> Chip {
    let mut roles = own_roles(placement);
    // A device without a single clock has no circuit: the page shows its products but no counts.
    let circuit = fuse::logic(placement, &roles).unwrap_or_else(|_| {
        let (parts, own) = shell(placement);
        roles = own;
        parts
    });
    // A registered pin has one name.
    let is_register = |pin: u32| {
        roles.iter().any(|role| role.pin == pin && matches!(role.object, Object::Flop(_)))
    };
    let is_own = |role: &&Role| matches!(role.object, Object::Flop(_)) || !is_register(role.pin);
    let roles: Vec<Role> = roles.iter().filter(is_own).cloned().collect();
    let made = about(name, line, &circuit);
    Chip::burned(made, &written.map, placement, &roles, written.n_vectors)
}

/// The report data about imported logic.
fn about<'a>(name: &'a str, line: &OutputReport, circuit: &'a Logic) -> About<'a> {
    About {
        file: name,
        outcome: line.outcome(),
        circuit,
        chains: &[],
        code: None,
        evolution: None,
        dont_cares: false,
        budget: Budget::default(),
    }
}

fn line(name: &str, judged: Judged) -> OutputReport {
    OutputReport::of_judged(name, judged, OutputProof::Rebuilt, OutputFault::Rebuilt)
}

/// Adds a note for each pin that differs from the one given by the order of declarations.
fn moved(mut line: OutputReport, emitted: &Emitted) -> OutputReport {
    let moved = emitted.equations.iter().flat_map(|equations| &equations.moved);
    line.notes.extend(moved.cloned().map(Note::PinMoved));
    line
}

/// A circuit that was fitted.
struct Fitted {
    emitted: Emitted,
    /// The macrocells that the text assigns, or the findings if it assigns none.
    placement: Result<Placement, Vec<Diagnostic>>,
    judged: Judged,
    options: EmitOptions,
}

/// The circuit in a language, minimised, with pins; the circuit that is read back from that text; and whether both are equal.
fn fitted(
    design: &LogicDesign,
    dialect: Dialect,
    device: Option<&str>,
    limits: &Limits,
) -> Result<Fitted, Vec<Diagnostic>> {
    let circuit = design.circuit()?;
    let own = design.placement.as_ref().ok();
    // Pins are kept if the device is the same and the design then fits.
    let same =
        own.filter(|own| device.is_none_or(|name| name.eq_ignore_ascii_case(own.device.name)));
    let is_signal = |name: &str| {
        let is_read = |id| circuit.nodes.values().any(|node| *node == Node::Input(id));
        circuit.outputs.values().any(|output| output.name == name)
            || circuit.inputs.iter().any(|(id, input)| input.name == name && is_read(id))
    };
    let kept = same.map(|own| {
        let named = own.pins.iter().filter(|named| is_signal(&named.name));
        named.map(|named| (named.name.clone(), named.pin)).collect()
    });
    let mut options = EmitOptions {
        device: device.map(str::to_owned).or_else(|| own.map(|own| own.device.name.to_owned())),
        pins: kept.unwrap_or_default(),
        ..EmitOptions::default()
    };
    let emitted = match emit(circuit, dialect, &options) {
        Err(_) if !options.pins.is_empty() => {
            options.pins = Vec::new();
            emit(circuit, dialect, &options)?
        }
        emitted => emitted?,
    };
    let said = read_text(dialect, FileId(u32::MAX), &emitted.text);
    let Some(mut back) = said.logic else {
        return Err(said.findings.into_iter().chain(said.beyond).collect());
    };
    let found = rebind(&mut back, &emitted);
    if any_error(&found) {
        return Err(found);
    }
    let judged = judge(circuit, &back, limits);
    Ok(Fitted { emitted, placement: said.placement, judged, options })
}
