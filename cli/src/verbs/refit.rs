//! `grafsynth build OLD --target T`: logic by others, burned as written or fitted anew.

use crate::args::Build;
use crate::exit::Exit;
use crate::files;
use crate::load::{Session, Stop};
use grafsynth_driver::logic::LogicDesign;
use grafsynth_driver::pipeline::Built;
use grafsynth_driver::refit::{self, Wanted};
use grafsynth_driver::report::{self, Outcome};
use grafsynth_driver::target::Target;
use grafsynth_verify::Limits;

pub(super) fn run(
    session: &mut Session,
    arguments: &Build,
    design: &LogicDesign,
) -> Result<Exit, Stop> {
    let limits = Limits { pairs: arguments.limits.proof_limit, ..Limits::default() };
    let file = arguments.input.file.rsplit(['/', '\\']).next().unwrap_or_default();
    let stem = file.rsplit_once('.').map_or(file, |(stem, _)| stem);
    let stem = if stem == "-" { "logic" } else { stem };
    let mut written = Vec::new();
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
                    return Err(Stop::Usage(format!(
                        "{} is logic, which cannot become `{name}`: it can become jedec, palasm, cupl, galasm, verilog or blif",
                        arguments.input.file
                    )));
                }
            },
        };
        if wanted == Wanted::AsWritten && arguments.device.is_some() {
            return Err(Stop::Usage(
                "as written a text stays on its own device: --refit moves it to another".to_owned(),
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
                if !session.quiet || made.line.outcome() == Outcome::Refuted {
                    crate::print(&format!("{}\n", made.line));
                }
                outcome = outcome.max(made.line.outcome());
                built.lines.push(made.line);
                built.chips.extend(made.chip);
                written.push((arguments.output.join(&made.file.name), made.file.text.into_bytes()));
            }
            Err(found) => {
                session.show(&found);
                is_refused = true;
            }
        }
    }
    if is_refused {
        return Err(Stop::Errors);
    }
    if outcome == Outcome::Refuted {
        crate::print_error(
            "grafsynth: nothing was written, because an output is not equal to the text\n",
        );
        return Ok(Exit::Refuted);
    }
    if arguments.report {
        let page = report::page_of_logic(&design.interface, &built, stem);
        let page = page.into_iter();
        written.extend(page.map(|file| (arguments.output.join(file.name), file.text.into_bytes())));
    }
    files::write_all(&written)?;
    Ok(if outcome == Outcome::Open { Exit::Open } else { Exit::Done })
}
