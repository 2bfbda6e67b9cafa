//! Maps a circuit to a device: forms and pins, fuses, test vectors, file; and reads all of it back.
//!
//! ```text
//! place       backend_pld::fuse::place     forms and pins, each function in its macrocell
//! map         backend_pld::fuse::map       fuses
//! vectors     backend_pld::fuse::vectors   what the programmer tests, by the simulator of the fuses
//! write       backend_pld::jedec::write    the file
//! read        backend_pld::jedec::read     the file without knowledge of its origin; both checksums
//! decode      backend_pld::fuse::decode    every product of every macrocell as intended
//! run         backend_pld::fuse::run       the simulator of the fuses, compared with the decoded circuit
//! ```
//! The state encoding before these steps and the proof after them are the same as for every circuit (see the stages).

use crate::circuit::{emit_options, may_be_free, unconditional};
use crate::coding::{self, EncodingChoice};
use crate::output_report::Note;
use grafsynth_backend_pld::device::Device;
use grafsynth_backend_pld::equations::Equations;
use grafsynth_backend_pld::fuse::vectors::{self, Vector};
use grafsynth_backend_pld::fuse::{self, FuseMap, Role};
use grafsynth_backend_pld::jedec::{self, Head};
use grafsynth_backend_pld::placement::Placement;
use grafsynth_backend_pld::{Dialect, EmitOptions, Object, Vectors};
use grafsynth_ir::diag::any_error;
use grafsynth_ir::facts::Facts;
use grafsynth_ir::logic::Logic;
use grafsynth_ir::net::Net;
use grafsynth_ir::{Diagnostic, FileId, Valid, counted};
use std::rc::Rc;

/// The number of clocks for which the device is compared with the decoded circuit, in 64 parallel runs.
const CLOCKS: usize = 64;

/// A device ready to be programmed, and what an independent parser reads from its file.
#[derive(Debug, Clone)]
pub struct Burned {
    /// The file.
    pub text: String,
    /// The fuses of the file.
    pub map: FuseMap,
    /// The intended placement.
    pub placement: Placement,
    /// The role of each pin.
    pub roles: Vec<Role>,
    /// The circuit decoded from the fuses.
    pub logic: Logic,
    /// The test vectors of the file.
    pub vectors: Vec<Vector>,
}

/// The signature of a net: a hash of its text form (64 bits, FNV-1a), so that a programmed device shows which chart it contains.
#[must_use]
pub fn signature(net: &Net) -> [u8; 8] {
    let text = grafsynth_ir::text::print(net);
    let hash = text.bytes().fold(0xCBF2_9CE4_8422_2325_u64, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01B3)
    });
    hash.to_be_bytes()
}

/// A file, and the intended placement.
pub(crate) struct FuseText {
    text: String,
    placement: Placement,
    roles: Vec<Role>,
}

/// Maps a circuit of a net to fuses. The file is made, read back, decoded, compared with the intended placement product by product, and simulated together
/// with the decoded circuit. The caller must prove that this circuit equals the net. `n_vectors`: the number of test vectors; `None` for a sufficient number.
///
/// # Errors
/// The design does not fit the device, or the fuse map of the device is unknown.
pub fn burn(
    net: &Net,
    circuit: &Logic,
    device: Option<&str>,
    stimulus: Option<&Vectors>,
    n_vectors: Option<usize>,
) -> Result<Burned, Vec<Diagnostic>> {
    let options = emit_options(net, device, stimulus.cloned());
    read_back(emit(net, None, circuit, &options, n_vectors)?)
}

/// Maps a circuit to fuses with the state encoding that a build chooses for the device, and with its don't-cares. The circuit that is read back shows the
/// steps in every encoding.
///
/// # Errors
/// Like [`burn`].
pub fn burn_coded(
    net: &Valid<Net>,
    facts: &Facts,
    circuit: &Logic,
    device: Option<&str>,
    n_vectors: Option<usize>,
) -> Result<Burned, Vec<Diagnostic>> {
    let wishes = EmitOptions { dont_cares: may_be_free(net), ..emit_options(net, device, None) };
    let free = unconditional(net, &grafsynth_verify::Limits::default());
    let facts = free.as_ref().unwrap_or(facts);
    let (choice, dialect) = (EncodingChoice::Auto, Dialect::Galasm);
    let coded = coding::code(net, facts, circuit, choice, false, dialect, &wishes);
    let text = emit(net, coded.equations.clone(), &coded.emitted(), &wishes, n_vectors)?;
    let mut burned = read_back(text)?;
    grafsynth_logic::state_assignment::observe(&coded.logic, &mut burned.logic);
    Ok(burned)
}

/// Writes a fuse map. `equations`: those of the circuit for [`Dialect::Galasm`], if they are known.
pub(crate) fn emit(
    net: &Net,
    equations: Option<Rc<Equations>>,
    circuit: &Logic,
    options: &EmitOptions,
    n_vectors: Option<usize>,
) -> Result<FuseText, Vec<Diagnostic>> {
    let (mut placement, roles) = fuse::place_from(equations, circuit, options)?;
    placement.title.clone_from(&net.name.text);
    placement.signature = signature(net).to_vec();
    let stimulus = options.vectors.as_ref();
    let first = stimulus.map(|stimulus| levels(circuit, &roles, stimulus)).unwrap_or_default();
    let text = text(&placement, &options.notes, &first, n_vectors)?;
    Ok(FuseText { text, placement, roles })
}

/// The text of a fuse map with its test vectors; `first` are the input levels of the first vectors.
fn text(
    placement: &Placement,
    notes: &[String],
    first: &[Vec<(u32, bool)>],
    n_vectors: Option<usize>,
) -> Result<String, Vec<Diagnostic>> {
    let map = fuse::map(placement)?;
    let n_vectors = n_vectors.unwrap_or_else(|| vectors::enough(placement));
    let vectors = vectors::vectors(&map, placement, first, n_vectors).map_err(one)?;
    Ok(jedec::write(&map, &head(placement, notes), &vectors))
}

fn one(finding: Box<Diagnostic>) -> Vec<Diagnostic> {
    vec![*finding]
}

/// The fuses, products and vectors of a text, which must have the products of the intended placement.
fn decoded(
    text: &str,
    placement: &Placement,
) -> Result<(FuseMap, Placement, Vec<Vector>), Vec<Diagnostic>> {
    // The text is not a file of the user, so its findings must not refer to one.
    let (file, found) = jedec::read(FileId(u32::MAX), text);
    let Some(file) = file.filter(|_| !any_error(&found)) else { return Err(found) };
    let map = file.fuse_map(Some(placement.device)).map_err(one)?;
    let said = fuse::decode(&map)?;
    let differences = fuse::differences(placement, &said);
    if differences.is_empty() {
        Ok((map, said, file.vectors))
    } else {
        Err(vec![not_as_meant(&differences.join(", "))])
    }
}

/// Reads a fuse map back from its text, and compares it with the intended placement and with its own test vectors.
pub(crate) fn read_back(written: FuseText) -> Result<Burned, Vec<Diagnostic>> {
    let FuseText { text, placement, roles } = written;
    let (map, mut said, vectors) = decoded(&text, &placement)?;
    said.title.clone_from(&placement.title);
    said.pins.clone_from(&placement.pins);
    let logic = fuse::logic(&said, &roles)?;
    if let Some((at, pin, _)) = vectors::failures(&map, &vectors, 1).map_err(one)?.first() {
        return Err(vec![not_as_meant(&format!("pin {pin} in test vector {}", at + 1))]);
    }
    if let Some(difference) = fuse::run::difference(&map, &logic, &roles, CLOCKS).map_err(one)? {
        return Err(vec![not_as_meant(&difference)]);
    }
    Ok(Burned { text, map, placement, roles, logic, vectors })
}

fn not_as_meant(what: &str) -> Diagnostic {
    Diagnostic::error(
        fuse::codes::NOT_AS_MEANT,
        format!("the generated fuse map differs from the placement: {what}"),
    )
    .help("this is a bug in grafsynth: please report it with the chart")
}

fn head(placement: &Placement, notes: &[String]) -> Head {
    let device = placement.device;
    let mut lines = vec![
        format!("{} - fuse map made by grafsynth {}", placement.title, env!("CARGO_PKG_VERSION")),
        // Other tools and people search for this word.
        format!("Device: {}", device.burned_as),
    ];
    if !device.burned_as.eq_ignore_ascii_case(device.name) {
        lines.push(format!("replacing a {}", device.palasm));
    }
    lines.extend(notes.iter().cloned());
    Head { lines, pins: placement.pins.clone() }
}

/// The rows of a stimulus as levels of pins.
fn levels(circuit: &Logic, roles: &[Role], stimulus: &Vectors) -> Vec<Vec<(u32, bool)>> {
    let names: Vec<&str> = circuit.inputs.values().map(|input| input.name.as_str()).collect();
    let row = |inputs: &[bool]| {
        roles
            .iter()
            .filter_map(|role| {
                let Object::Input(input) = &role.object else { return None };
                let at = names.iter().position(|name| *name == input.name)?;
                Some((role.pin, *inputs.get(at)? != role.is_inverted))
            })
            .collect()
    };
    // Row 0 is the state after power-up; a circuit with `busy` needs additional clocks, which the walk provides.
    if stimulus.busy.is_some() {
        return Vec::new();
    }
    stimulus.rows.iter().skip(1).map(|vector| row(&vector.inputs)).collect()
}

/// The command that programs a file, if the programmer supports the device.
#[must_use]
pub fn command(placement: &Placement, file: &str) -> Option<String> {
    command_for(placement.device, placement.part, file)
}

/// [`command`] for a device, or for the exact part.
pub(crate) fn command_for(
    device: &Device,
    part: Option<&'static str>,
    file: &str,
) -> Option<String> {
    let name = part.or(device.programmers.first().copied())?;
    Some(format!("minipro -p {name} -w {file}"))
}

/// The other parts that the same file can program, if the user did not name the exact part.
pub(crate) fn other_parts(device: &Device, part: Option<&'static str>) -> &'static [&'static str] {
    match (part, device.programmers) {
        (None, [_, others @ ..]) => others,
        (Some(_), _) | (None, []) => &[],
    }
}

fn times(n: usize) -> String {
    match n {
        1 => "once".to_owned(),
        n => format!("{n} times"),
    }
}

/// The notes on a fuse map, in addition to its proof.
pub(crate) fn notes(burned: &Burned, file: &str) -> Vec<Note> {
    let device = burned.placement.device;
    let terms: usize = burned.placement.cells.iter().map(|cell| cell.sum.len()).sum();
    let mut parts = vec![format!(
        "{} with {} of a {}, fuses verified, {}",
        counted(burned.placement.cells.len(), "macrocell", "macrocells"),
        counted(terms, "product term", "product terms"),
        device.name,
        counted(burned.vectors.len(), "test vector", "test vectors")
    )];
    parts.push(match command(&burned.placement, file) {
        Some(command) => {
            let others = other_parts(device, burned.placement.part);
            let others = if others.is_empty() {
                String::new()
            } else {
                format!(" (for other chips -p {})", others.join(", "))
            };
            format!("burn it with `{command}`{others}")
        }
        None => "no supported programmer".to_owned(),
    });
    let n_parts = burned.roles.iter().filter(|role| matches!(role.object, Object::Buried)).count();
    if n_parts > 0 {
        parts.push(format!(
            "{} of sums that are too wide, so signals pass through the array up to {} more before the clock",
            counted(n_parts, "macrocell computes a part", "macrocells compute parts"),
            times(burned.placement.n_passes())
        ));
    }
    let remembered: Vec<&str> = device.remembered().map(|figure| figure.what).collect();
    if !remembered.is_empty() {
        parts.push(format!(
            "uses data-sheet values that were not verified: {}",
            remembered.join(", ")
        ));
    }
    parts.into_iter().map(Note::Burned).collect()
}

/// The file of a design as it was written: its own products in its own macrocells, without minimising or moving anything. The file is read back and decoded to
/// the same products before it is returned.
///
/// # Errors
/// The device cannot hold something, or its fuse map is unknown.
pub fn as_written(placement: &Placement) -> Result<String, Vec<Diagnostic>> {
    written(placement).map(|written| written.text)
}

/// A file, and the contents that were read back.
pub(crate) struct Written {
    pub(crate) text: String,
    pub(crate) map: FuseMap,
    pub(crate) n_vectors: usize,
}

/// [`as_written`] with the contents that were read back.
pub(crate) fn written(placement: &Placement) -> Result<Written, Vec<Diagnostic>> {
    let text = text(placement, &[], &[], None)?;
    let (map, _, vectors) = decoded(&text, placement)?;
    Ok(Written { text, map, n_vectors: vectors.len() })
}
