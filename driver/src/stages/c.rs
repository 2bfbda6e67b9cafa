//! The stages of C: emit, then check. The check also runs the C, so the caller passes an engine that can compile it.

use crate::built::{BuildOptions, Built, MapEntry, OutputFile};
use crate::c_map::CMap;
use crate::c_proof::prove_c;
use crate::output_report::{Note, Outcome, OutputReport};
use crate::trust::runnable;
use grafsynth_backend_c::{File, Object, Package, Style};
use grafsynth_ir::facts::Facts;
use grafsynth_ir::net::Net;
use grafsynth_ir::{Diagnostic, Valid};
use grafsynth_verify::OpenReason;
use grafsynth_verify::c_code::Induction;
use std::borrow::Cow;

/// Emits C, adds its files and the package to run to a build, and returns the findings.
pub(crate) fn emit(
    net: &Valid<Net>,
    facts: &Facts,
    style: Option<Style>,
    options: &BuildOptions,
    built: &mut Built,
) -> Vec<Diagnostic> {
    let c = options.c_for(net, style);
    let package = match grafsynth_backend_c::emit(net, facts, &c) {
        Ok(package) => package,
        Err(found) => return found,
    };
    let mut all = package.diagnostics.clone();
    let map = CMap::of(net, &package, &c).map(|map| map.to_text());
    if options.packages.is_empty() {
        built.files.extend(files(net, &package.files));
        built.files.extend(beside(&package, &package.files, map.as_deref()));
    }
    for ecosystem in &options.packages {
        match grafsynth_backend_c::package::files(net, &package, *ecosystem) {
            Ok(of_package) => {
                built.files.extend(files(net, &of_package));
                built.files.extend(beside(&package, &of_package, map.as_deref()));
            }
            Err(found) => all.extend(found),
        }
    }
    // The text that runs may differ from the text that is written: it lacks the C code of the chart's author.
    let to_run = match runnable(net, options.trusts_code) {
        Cow::Borrowed(_) => Ok(package),
        Cow::Owned(bare) => grafsynth_backend_c::emit(&bare, facts, &c),
    };
    match to_run {
        Ok(package) => built.packages.push(package),
        Err(found) => all.extend(found),
    }
    all
}

/// The map of a package, in the folder of its C file.
fn beside(package: &Package, files: &[File], map: Option<&str>) -> Option<OutputFile> {
    let main = format!("{}.c", package.stem());
    let folder = |file: &File| {
        let folder = file.name.strip_suffix(main.as_str())?;
        (folder.is_empty() || folder.ends_with('/')).then(|| folder.to_owned())
    };
    let folder = files.iter().find_map(folder)?;
    Some(OutputFile::new(format!("{folder}{}.map.json", package.stem()), map?.to_owned()))
}

fn files(net: &Net, files: &[File]) -> Vec<OutputFile> {
    let req = |object: &Object| match *object {
        Object::Step(id) => net.steps[id].meta.req.clone(),
        Object::Transition(id) => net.transitions[id].meta.req.clone(),
        Object::Input(id) => net.inputs[id].meta.req.clone(),
        Object::Output(id) => net.outputs[id].meta.req.clone(),
        Object::Var(id) => net.vars[id].meta.req.clone(),
        Object::Timer(id) => net.timers[id].meta.req.clone(),
        Object::Action(id) => net.actions[id].meta.req.clone(),
    };
    let entry = |line: u32, object: &Object| MapEntry {
        line,
        name: object.name(net).to_owned(),
        span: object.span(net),
        req: req(object),
    };
    let map = |file: &File| {
        let lines = file.map.iter();
        lines.flat_map(|(line, all)| all.iter().map(|object| entry(*line, object))).collect()
    };
    files
        .iter()
        .map(|file| OutputFile {
            keep_existing: file.keep_existing,
            map: map(file),
            ..OutputFile::new(file.name.clone(), file.text.clone())
        })
        .collect()
}

/// An engine that compiles and runs C.
pub trait CEngine {
    /// Compares a package with the net of the build; the report has this name. `read` is the result of the proof of its text.
    ///
    /// # Errors
    /// The compiler's message, if it rejects the text.
    fn check(
        &self,
        name: &str,
        package: &Package,
        read: Result<Induction, OpenReason>,
    ) -> Result<OutputReport, String>;

    /// Called before a package is checked, with the results so far.
    fn begins(&self, name: &str, lines: &[OutputReport]);
}

/// Compares each C package of a build with the net: proved if requested and possible, and tested. Files that were refuted are removed.
///
/// # Errors
/// The name of a text that the compiler rejects, and the compiler's message.
pub fn check(
    net: &Valid<Net>,
    facts: &Facts,
    options: &BuildOptions,
    built: &mut Built,
    engine: &dyn CEngine,
) -> Result<(), (String, String)> {
    for package in &built.packages {
        let texts = package.files.iter().map(|file| file.name.as_str());
        let name = texts.into_iter().find(|name| name.ends_with(".c")).unwrap_or("c");
        engine.begins(name, &built.lines);
        let checked = engine.check(name, package, read(net, facts, options, package));
        let mut line = checked.map_err(|words| (name.to_owned(), words))?;
        if !options.trusts_code && !net.c_texts().is_empty() {
            line.notes.push(Note::WithoutForeignCode);
        }
        if line.outcome() == Outcome::Refuted {
            // The author's own C may have effects that the chart does not know, in every style.
            line.notes.push(if options.trusts_code && !net.c_texts().is_empty() {
                Note::TrustedCode
            } else {
                right_style(net, facts, options, package, engine)
            });
            let map = format!("{}.map.json", package.stem());
            let is_own = |file: &OutputFile| {
                is_file(file, &map) || package.files.iter().any(|own| is_file(file, &own.name))
            };
            built.files.retain(|file| !is_own(file));
        }
        built.lines.push(line);
    }
    Ok(())
}

/// Reads the text of a package back and proves it, if that is requested.
fn read(
    net: &Valid<Net>,
    facts: &Facts,
    options: &BuildOptions,
    package: &Package,
) -> Result<Induction, OpenReason> {
    if !options.prove {
        return Err(OpenReason::NotAsked);
    }
    prove_c(net, facts, package, &options.limits)
        .map_err(|why| OpenReason::Method(format!("no induction: {why}")))
}

/// True if an output is this file of a C package, in any folder.
fn is_file(output: &OutputFile, file: &str) -> bool {
    output.name.rsplit('/').next() == Some(file)
}

/// Finds a style that agrees with the chart, to replace the style of a package that does not agree with it.
fn right_style(
    net: &Valid<Net>,
    facts: &Facts,
    options: &BuildOptions,
    wrong: &Package,
    engine: &dyn CEngine,
) -> Note {
    for style in [Style::Switch, Style::Bits, Style::Engine] {
        let c = options.c_for(net, Some(style));
        let Ok(package) = grafsynth_backend_c::emit(net, facts, &c) else { continue };
        if package.files == wrong.files {
            continue;
        }
        let checked = engine.check("", &package, read(net, facts, options, &package));
        let outcome = checked.map_or(Outcome::Refuted, |line| line.outcome());
        if outcome != Outcome::Refuted {
            return Note::OtherStyle { style: style.name(), outcome };
        }
    }
    Note::NoStyle
}

/// The tables of charts that an engine interprets, by file name, except those that were refuted.
#[must_use]
pub fn images(built: &Built) -> Vec<(String, Vec<u8>)> {
    let is_kept = |name: &str| built.files.iter().any(|file| is_file(file, name));
    let images = built.packages.iter().filter(|package| !package.image.is_empty());
    let kept = images.filter(|package| is_kept(&format!("{}.h", package.stem())));
    kept.map(|package| (format!("{}.bin", package.stem()), package.image.clone())).collect()
}
