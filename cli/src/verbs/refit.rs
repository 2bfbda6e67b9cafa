//! `grafsynth build OLD --target T`: imported logic, programmed as written or fitted again.

use super::build::{Made, judged, say, write};
use crate::args::{Build, Input};
use crate::exit::Exit;
use crate::files::Output;
use crate::load::{Session, Stop};
use grafsynth_driver::logic::LogicDesign;
use grafsynth_driver::pipeline::{Built, OutputFile};
use grafsynth_driver::refit::{self, Wanted};
use grafsynth_driver::report::{self, Outcome};
use grafsynth_driver::stem::FileStem;
use grafsynth_driver::target::Target;
use grafsynth_verify::Limits;

pub(super) fn run(
    session: &mut Session,
    arguments: &Build,
    input: &Input,
    stem: &FileStem,
    design: &LogicDesign,
) -> Result<Exit, Stop> {
    let limits = Limits { pairs: arguments.limits.proof_limit, ..Limits::default() };
    let made_of = session.made_of();
    let output = |file: OutputFile| Output {
        name: file.name,
        bytes: file.text.into_bytes(),
        keep_existing: file.keep_existing,
    };
    let mut outputs = Vec::new();
    let mut built = Built::default();
    let mut outcome = Outcome::Proved;
    let mut is_refused = false;
    for name in &arguments.target {
        let wanted = match name.as_str() {
            "jedec" if arguments.refit => Wanted::Refit,
            "jedec" => Wanted::AsWritten,
            other => match Target::named(other).and_then(Target::dialect) {
                Some(dialect) => Wanted::Text(dialect),
                None => {
                    return Err(Stop::Input(format!(
                        "{} is logic, which cannot become `{name}`: it can become jedec, palasm, cupl, galasm, verilog or blif",
                        input.file
                    )));
                }
            },
        };
        if wanted == Wanted::AsWritten && arguments.device.is_some() {
            return Err(Stop::Usage(
                "a text that is used as written stays on its own device: use --refit to move it to another".to_owned(),
            ));
        }
        if wanted != Wanted::AsWritten {
            session.show(&design.beyond);
            if design.logic.is_none() {
                return Err(Stop::Errors);
            }
        }
        match refit::make(
            design,
            wanted,
            arguments.device.as_deref(),
            stem,
            &limits,
            arguments.report,
        ) {
            Ok(made) => {
                outcome = outcome.max(made.line.outcome());
                built.lines.push(made.line);
                built.chips.extend(made.chip);
                outputs.push(output(made.file));
            }
            Err(found) => {
                session.show(&found);
                is_refused = true;
            }
        }
    }
    if is_refused {
        say(session, &design.interface, &built.lines, Some("an output cannot be made"));
        return Err(Stop::Errors);
    }
    if outcome == Outcome::Refuted {
        say(session, &design.interface, &built.lines, Some("an output is not equal to the text"));
        return Ok(Exit::Refuted);
    }
    if arguments.report {
        let page = report::page_of_logic(&design.interface, &built, stem);
        outputs.extend(page.into_iter().map(output));
    }
    let net = &design.interface;
    let made = Made { stem, net, made_of, outputs, lines: &built.lines };
    write(session, arguments, made, Vec::new())?;
    Ok(judged(session, arguments, &built.lines))
}
