//! The command line of grafsynth: arguments, files, rendering, exit codes. Everything else is in `grafsynth-driver` and `grafsynth-engines`.

mod args;
mod exit;
mod files;
mod load;
mod render;
mod verbs;

use args::{Cli, Verb, When};
use clap::Parser as _;
use exit::Exit;
use load::{Session, Stop};
use render::Style;
use std::io::{IsTerminal as _, Write as _};
use std::process::ExitCode;

fn main() -> ExitCode {
    let cli = Cli::parse();
    let style = style(&cli);
    let mut session = Session::new(&cli.global, style);
    let ended = match &cli.verb {
        Verb::New(arguments) => verbs::new::run(arguments, cli.global.quiet).map_err(Stop::Usage),
        Verb::Check(arguments) => verbs::check::run(&mut session, arguments),
        Verb::Build(arguments) => verbs::build::run(&mut session, arguments),
        Verb::Sim(arguments) => verbs::sim::run(&mut session, arguments),
        Verb::Compare(arguments) => verbs::compare::run(&mut session, arguments),
        Verb::Convert(arguments) => verbs::convert::run(&mut session, arguments),
        Verb::Minimise(arguments) => verbs::minimise::run(&mut session, arguments),
        Verb::Trace(arguments) => verbs::trace::run(&mut session, arguments),
        Verb::Fmt(arguments) => verbs::fmt::run(&mut session, arguments),
        Verb::Diff(arguments) => verbs::diff::run(&mut session, arguments),
        Verb::Explain(arguments) => verbs::explain::run(arguments).map_err(Stop::Usage),
        Verb::Doctor => Ok(verbs::doctor::run()),
        Verb::Completions(arguments) => Ok(verbs::manual::completions(arguments.shell)),
        Verb::Man => verbs::manual::man().map_err(Stop::Usage),
    };
    let exit = match ended {
        Ok(exit) => exit,
        Err(Stop::Errors) => Exit::Errors,
        Err(Stop::Usage(text)) => {
            print_error(&format!("grafsynth: {text}\n"));
            Exit::Usage
        }
    };
    ExitCode::from(exit as u8)
}

#[expect(clippy::disallowed_methods, reason = "NO_COLOR and COLUMNS are the user's wishes")]
fn style(cli: &Cli) -> Style {
    let color = match cli.global.color {
        When::Always => true,
        When::Never => false,
        When::Auto => {
            std::io::stderr().is_terminal()
                && std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty())
        }
    };
    let width = std::env::var("COLUMNS").ok().and_then(|value| value.parse().ok()).unwrap_or(140);
    Style {
        format: cli.global.message_format,
        color,
        max_diagnostics: cli.global.max_diagnostics,
        width,
    }
}

/// Prints what was asked for. A reader that went away (`| head`) is no error.
pub(crate) fn print(text: &str) {
    let mut out = std::io::stdout().lock();
    let _ = out.write_all(text.as_bytes()).and_then(|()| out.flush());
}

/// Prints what is said beside it.
pub(crate) fn print_error(text: &str) {
    let _ = std::io::stderr().lock().write_all(text.as_bytes());
}
