//! `grafsynth minimise FILE`.

use crate::args::Minimise;
use crate::exit::Exit;
use crate::load::{Session, Stop};
use grafsynth_driver::minimise::{Options, minimise};
use grafsynth_ir::diag::any_error;

pub(crate) fn run(session: &mut Session, arguments: &Minimise) -> Result<Exit, Stop> {
    let file = session.text(&arguments.file)?;
    let options = Options {
        per_output: arguments.per_output,
        free_polarity: arguments.phase,
        exact: !arguments.heuristic,
        budget: arguments.budget,
    };
    #[expect(clippy::disallowed_methods, reason = "the time is shown to people, on stderr")]
    let start = std::time::Instant::now();
    let text = session.sources.get(file).map(|source| source.text.as_str()).unwrap_or_default();
    let (small, found) = minimise(file, text, &options);
    session.show(&found);
    let Some(small) = small else {
        return Err(if any_error(&found) {
            Stop::Errors
        } else {
            Stop::Input(format!("{} is empty", arguments.file))
        });
    };
    let is_piped = arguments.output.as_ref().is_some_and(|output| output.as_os_str() == "-");
    match &arguments.output {
        _ if is_piped => {
            crate::print(&small.text);
            crate::print_error(&small.report);
        }
        Some(output) => {
            session.write_named(vec![(output.clone(), small.text.into_bytes())])?;
            session.tell(&small.report);
        }
        None => session.tell(&small.report),
    }
    if !session.quiet {
        crate::print_error(&format!("minimised in {:.2} s\n", start.elapsed().as_secs_f64()));
    }
    Ok(Exit::Done)
}
