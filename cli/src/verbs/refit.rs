//! `grafsynth build OLD --target T`: imported logic, programmed as written or fitted again.

use super::build_outputs::{Made, judged, write};
use super::build_results::{refusal, say};
use crate::args::{Build, Input};
use crate::exit::Exit;
use crate::files::Output;
use crate::load::{Session, Stop};
use grafsynth_driver::logic::LogicDesign;
use grafsynth_driver::pipeline::{Built, OutputFile, Refusal};
use grafsynth_driver::refit::{self, Wanted};
use grafsynth_driver::report::{self, Outcome};
use grafsynth_driver::stem::FileStem;
use grafsynth_driver::target::Target;
use grafsynth_ir::Diagnostic;

pub(super) fn run(
    session: &mut Session,
    arguments: &Build,
    input: &Input,
    stem: &FileStem,
    design: &LogicDesign,
) -> Result<Exit, Stop> {
    let limits = arguments.limits.limits();
    let made_of = session.made_of();
    let output = |file: OutputFile| Output {
        name: file.name,
        bytes: file.text.into_bytes(),
        keep_existing: file.keep_existing,
    };
    let mut outputs = Vec::new();
    let mut built = Built::default();
    let mut outcome = Outcome::Proved;
    let (mut is_circuit_needed, mut is_refused) = (false, false);
    for name in arguments.target.iter().flat_map(|names| names.split(',')) {
        let wanted = wanted(arguments, &input.file, name)?;
        if wanted != Wanted::AsWritten {
            if !std::mem::replace(&mut is_circuit_needed, true) {
                session.show(&design.beyond);
            }
            if design.logic.is_none() {
                return Err(Stop::Errors);
            }
        }
        let device = arguments.device.as_deref();
        match refit::make(design, wanted, device, stem, &limits, arguments.report.is_some()) {
            Ok(made) => {
                outcome = outcome.max(made.line.outcome());
                built.lines.push(made.line);
                built.chips.extend(made.chip);
                outputs.push(output(made.file));
            }
            Err(found) => {
                is_refused = true;
                let target = Target::named(name).map_or("", Target::name);
                built.refused.extend(Refusal::of(target, &found));
                // Several targets may be refused for the same reason, which is reported once.
                let new = found.into_iter().filter(|one| !built.found.contains(one));
                let new: Vec<Diagnostic> = new.collect();
                session.show(&new);
                built.found.extend(new);
            }
        }
    }
    let (interface, trace) = (&design.interface, arguments.trace_file());
    if is_refused {
        let is_one = built.refused.len() + built.lines.len() < 2;
        let why = refusal(if is_one { &[] } else { &built.refused });
        if built.lines.is_empty() && !is_one {
            session.tell(&format!("nothing was written: {why}\n"));
        }
        say(session, interface, trace, &built.lines, Some(&why))?;
        return Err(Stop::Errors);
    }
    if outcome == Outcome::Refuted {
        let why = "an output is not equal to the text";
        say(session, interface, trace, &built.lines, Some(why))?;
        return Ok(Exit::Refuted);
    }
    if let Some(form) = arguments.report {
        let document = report::document_of_logic(&design.interface, &built);
        let files = super::build_outputs::report_files(form, &document, None, stem);
        outputs.extend(files.into_iter().map(output));
    }
    let net = &design.interface;
    let made = Made { stem, net, made_of, outputs, lines: &built.lines };
    write(session, arguments, made, Vec::new())?;
    Ok(judged(session, arguments, &built.lines))
}

/// The form in which a target writes imported logic.
fn wanted(arguments: &Build, file: &str, name: &str) -> Result<Wanted, Stop> {
    let target = Target::named(name);
    if target == Some(Target::Jedec) && !arguments.refit {
        return match &arguments.device {
            None => Ok(Wanted::AsWritten),
            Some(_) => Err(Stop::Usage(
                "a text that is used as written stays on its own device: use --refit to move it to another".to_owned(),
            )),
        };
    }
    if target == Some(Target::Jedec) {
        return Ok(Wanted::Refit);
    }
    target.and_then(Target::dialect).map(Wanted::Text).ok_or_else(|| {
        Stop::Input(format!(
            "{file} is logic, which cannot become `{name}`: it can become jedec, palasm, cupl, galasm, verilog or blif"
        ))
    })
}
