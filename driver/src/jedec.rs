//! Maps a circuit to a device: forms and pins, fuses, test vectors, file; and reads all of it back.
//!
//! ```text
//! code        coding::code                 codes of steps, don't-cares
//! place       backend_pld::fuse::place     forms and pins, each function in its macrocell
//! map         backend_pld::fuse::map       fuses
//! vectors     backend_pld::fuse::vectors   what the programmer tests, by the simulator of the fuses
//! write       backend_pld::jedec::write    the file
//! read        backend_pld::jedec::read     the file without knowledge of its origin; both checksums
//! decode      backend_pld::fuse::decode    every product of every macrocell as intended
//! run         backend_pld::fuse::run       the simulator of the fuses, compared with the decoded circuit
//! prove       verify::equiv                the decoded circuit equal to the net, from power-up
//! ```

use crate::built::{BuildOptions, Built, OutputFile};
use crate::circuit::{delayed_vectors, emit_options, may_be_free, synchronised, unconditional};
use crate::circuit_notes::{self, code_of, codes_and_dont_cares, say_emergency, say_safe};
use crate::coding::{self, EncodingChoice};
use crate::output_report::{Note, Outcome, OutputReport};
use crate::report::chip::{Chip, Made};
use grafsynth_backend_pld::device::Device;
use grafsynth_backend_pld::fuse::vectors::{self, Vector};
use grafsynth_backend_pld::fuse::{self, FuseMap, Role};
use grafsynth_backend_pld::jedec::{self, Head};
use grafsynth_backend_pld::placement::Placement;
use grafsynth_backend_pld::{Dialect, EmitOptions, Object, Vectors, synchronise};
use grafsynth_ir::diag::any_error;
use grafsynth_ir::facts::Facts;
use grafsynth_ir::logic::Logic;
use grafsynth_ir::net::Net;
use grafsynth_ir::{Diagnostic, FileId, Valid, counted};
use grafsynth_verify::OpenReason;
use grafsynth_verify::equiv::only_tested;

/// The number of clocks for which the device is compared with the decoded circuit, in 64 parallel runs.
const CLOCKS: usize = 64;

/// A device ready to be programmed, and what an independent reader finds in its file.
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
    burn_as(net, circuit, &emit_options(net, device, None), stimulus, n_vectors)
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
    let choice = EncodingChoice::Auto;
    let free = unconditional(net, &grafsynth_verify::Limits::default());
    let facts = free.as_ref().unwrap_or(facts);
    let coded = coding::code(net, facts, circuit, choice, false, Dialect::Palasm, &wishes);
    let mut burned = burn_as(net, &coding::emitted(&coded, false), &wishes, None, n_vectors)?;
    grafsynth_logic::state_assignment::observe(&coded.logic, &mut burned.logic);
    Ok(burned)
}

/// [`burn`] with options for the equations: the device, and whether don't-cares are used.
fn burn_as(
    net: &Net,
    circuit: &Logic,
    options: &EmitOptions,
    stimulus: Option<&Vectors>,
    n_vectors: Option<usize>,
) -> Result<Burned, Vec<Diagnostic>> {
    let (mut placement, roles) = fuse::place(circuit, options)?;
    placement.title.clone_from(&net.name.text);
    placement.signature = signature(net).to_vec();
    let map = fuse::map(&placement)?;
    let one = |finding: Box<Diagnostic>| vec![*finding];
    let first = stimulus.map(|stimulus| levels(circuit, &roles, stimulus)).unwrap_or_default();
    let n_vectors = n_vectors.unwrap_or_else(|| vectors::enough(&placement));
    let vectors = vectors::vectors(&map, &placement, &first, n_vectors).map_err(one)?;
    let text = jedec::write(&map, &head(&placement, &options.notes), &vectors);
    // From here on only the text counts. It is not a file of the user, so its findings must not refer to one.
    let (file, found) = jedec::read(FileId(u32::MAX), &text);
    let Some(file) = file.filter(|_| !any_error(&found)) else { return Err(found) };
    let read = file.fuse_map(Some(placement.device)).map_err(one)?;
    let mut said = fuse::decode(&read)?;
    let differences = fuse::differences(&placement, &said);
    if !differences.is_empty() {
        return Err(vec![not_as_meant(&differences.join(", "))]);
    }
    said.title.clone_from(&placement.title);
    said.pins.clone_from(&placement.pins);
    let logic = fuse::logic(&said, &roles)?;
    if let Some((at, pin, _)) =
        vectors::failures(&read, &file.vectors, 1).map_err(one)?.into_iter().next()
    {
        return Err(vec![not_as_meant(&format!("pin {pin} in test vector {}", at + 1))]);
    }
    if let Some(difference) = fuse::run::difference(&read, &logic, &roles, CLOCKS).map_err(one)? {
        return Err(vec![not_as_meant(&difference)]);
    }
    Ok(Burned { text, map: read, placement, roles, logic, vectors: file.vectors })
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
        // The word that other tools and people search for.
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

/// Builds the fuse map of a net; it is returned only if it is not refuted.
pub(crate) fn build(
    net: &Valid<Net>,
    facts: &Facts,
    logic: &Logic,
    options: &BuildOptions,
    built: &mut Built,
) {
    let wishes = EmitOptions {
        dont_cares: options.dont_cares,
        keep: options.keep_pins.clone(),
        ..emit_options(net, options.device.as_deref(), None)
    };
    // A device uses the same equations as a text for it.
    let dialect = Dialect::Palasm;
    let coded = coding::code(net, facts, logic, options.encoding, options.safe, dialect, &wishes);
    let code = code_of(net, facts, logic, &coded, options, dialect, &wishes);
    let asked =
        crate::fit_advice::BuildContext { net, facts, logic, options, dialect, is_burned: true };
    let logic = &coding::emitted(&coded, options.safe);
    let (circuit, chains) = synchronised(net, logic.clone(), options.synchronise);
    let stimulus = options
        .stimulus
        .as_ref()
        .map(|stimulus| delayed_vectors(net, logic, &circuit, &chains, stimulus));
    let burned = stimulus.transpose().and_then(|stimulus| {
        let burned = burn_as(net, &circuit, &wishes, stimulus.as_ref(), None)?;
        let mut read_back = synchronise::strip(burned.logic.clone(), &chains)?;
        grafsynth_logic::state_assignment::observe(&coded.logic, &mut read_back);
        Ok((burned, read_back))
    });
    let (burned, read_back) = match burned {
        Ok(burned) => burned,
        Err(mut found) => {
            crate::fit_advice::advise(&asked, &mut found);
            built.found.extend(found);
            return;
        }
    };
    let name = format!("{}.jed", options.stem_for(net));
    let mut line = if options.prove {
        let verdict = grafsynth_verify::equiv(net, facts, &read_back, &options.limits);
        OutputReport::of_verdict(&name, net, &read_back, verdict)
    } else {
        let reasons = vec![OpenReason::NotAsked];
        let verdict = only_tested(net, &read_back, reasons, &options.limits);
        OutputReport::of_verdict(&name, net, &read_back, verdict)
    };
    line.notes.extend(said(&burned, &name));
    line.notes.extend(burned.placement.moved.iter().cloned().map(Note::PinMoved));
    say_emergency(&mut line, net, &read_back, options);
    if let Some(said) = codes_and_dont_cares(&coded, logic, &wishes) {
        line.notes.push(Note::Codes(said));
    }
    if options.safe {
        say_safe(&mut line, logic, &read_back);
    }
    let outcome = line.outcome();
    let is_refuted = outcome == Outcome::Refuted;
    let form = circuit_notes::form(net, facts, logic, options.busy);
    if let Some(form) = &form {
        line.notes.push(Note::Form(form.clone()));
    }
    if let Some(chain) = chains.first() {
        let (pins, stages) = (chains.len(), chain.flops.len());
        line.notes.push(Note::Synchronised { pins, stages });
    }
    built.lines.push(line);
    if let Some(code) = code.filter(|_| !is_refuted) {
        let made = Made {
            file: &name,
            outcome,
            circuit: &circuit,
            chains: &chains,
            code: Some(code),
            evolution: form,
            dont_cares: wishes.dont_cares,
            budget: wishes.budget,
        };
        let n_vectors = burned.vectors.len();
        let (map, placement, roles) = (&burned.map, &burned.placement, &burned.roles);
        built.chips.push(Chip::burned(made, map, placement, roles, n_vectors));
    }
    if !is_refuted {
        built.files.push(OutputFile {
            name,
            text: burned.text,
            keep_existing: false,
            map: Vec::new(),
        });
    }
}

fn times(n: usize) -> String {
    match n {
        1 => "once".to_owned(),
        n => format!("{n} times"),
    }
}

/// The notes on a fuse map, in addition to its proof.
fn said(burned: &Burned, file: &str) -> Vec<Note> {
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
    let one = |finding: Box<Diagnostic>| vec![*finding];
    let map = fuse::map(placement)?;
    let n = vectors::enough(placement);
    let vectors = vectors::vectors(&map, placement, &[], n).map_err(one)?;
    let text = jedec::write(&map, &head(placement, &[]), &vectors);
    let (file, found) = jedec::read(FileId(u32::MAX), &text);
    let Some(file) = file.filter(|_| !any_error(&found)) else { return Err(found) };
    let map = file.fuse_map(Some(placement.device)).map_err(one)?;
    let differences = fuse::differences(placement, &fuse::decode(&map)?);
    if differences.is_empty() {
        Ok(Written { text, map, n_vectors: file.vectors.len() })
    } else {
        Err(vec![not_as_meant(&differences.join(", "))])
    }
}
