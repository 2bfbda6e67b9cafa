//! The proof of emitted C by induction: the text of a package is read for each kind of machine, and one reaction of it is compared with the net.

use grafsynth_backend_c::Package;
use grafsynth_c::tree::Unit;
use grafsynth_c::{Config, Input, SourceFile, parse};
use grafsynth_ir::facts::Facts;
use grafsynth_ir::net::Net;
use grafsynth_ir::{FileId, Valid};
use grafsynth_verify::Limits;
use grafsynth_verify::c_code::{Induction, prove};

/// The end of the name of the file with the image of a chart.
pub(crate) const TABLES: &str = "_tables.c";

/// The name of the file with the image of a chart that is written with this stem.
#[must_use]
pub fn tables_of(stem: &str) -> String {
    format!("{stem}{TABLES}")
}

/// The machines: a 64-bit host, an AVR, whose `int` has 16 bits, and a 32-bit ARM, whose `long` has 32 bits and whose `char` is unsigned.
pub(crate) fn machines() -> [Config; 3] {
    let mut arm = Config::host().define("__arm__", "1");
    arm.name = "arm";
    arm.machine.long_bits = 32;
    arm.machine.pointer_bytes = 4;
    arm.machine.code_pointer_bytes = 4;
    arm.machine.has_signed_char = false;
    arm.machine.has_short_enums = true;
    [Config::host(), Config::avr(), arm]
}

/// Proves that the text of a package behaves like the net, for every stimulus, on machines whose `int` has 16 or 32 bits.
///
/// # Errors
/// The reason why there is no proof. The C may still be correct.
pub fn prove_c(
    net: &Valid<Net>,
    facts: &Facts,
    package: &Package,
    limits: &Limits,
) -> Result<Induction, String> {
    let mut proved = Induction::default();
    for config in machines() {
        let unit = unit_of(package, &config)?;
        proved = prove_unit(net, facts, package, &unit, limits)?;
    }
    Ok(proved)
}

/// Proves one tree of a package.
pub(crate) fn prove_unit(
    net: &Valid<Net>,
    facts: &Facts,
    package: &Package,
    unit: &Unit,
    limits: &Limits,
) -> Result<Induction, String> {
    let Some(hint) = &package.representation else {
        return Err(format!("the style `{}` is not covered by the induction", package.style));
    };
    prove(net, facts, unit, hint, limits)
}

/// A text that includes the file with the tables of a chart, and then its C.
pub(crate) fn both(tables: &str, chart: &str) -> String {
    format!("#include \"{tables}\"\n#include \"{chart}\"\n")
}

/// The tree of a package for a machine.
pub(crate) fn unit_of(package: &Package, config: &Config) -> Result<Unit, String> {
    let mut files = package.sources();
    // The tables of an engine are a text of their own. They are read first, so that their size is known.
    let all = both(&tables_of(package.stem()), &format!("{}.c", package.stem()));
    if !package.image.is_empty() {
        let file = FileId(u32::try_from(files.len()).unwrap_or(u32::MAX));
        files.insert(0, SourceFile { file, name: "", text: &all });
    }
    let (unit, found) = parse(&Input { files: &files, verbatim: &[], readers: &[], config });
    unit.ok_or_else(|| {
        let why = found.into_iter().next().map_or_else(String::new, |it| it.message);
        format!("the text cannot be read as C: {why}")
    })
}
