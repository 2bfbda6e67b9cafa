//! The command line of grafsynth: arguments, files, rendering, exit codes. Everything else is in `grafsynth-driver` and `grafsynth-engines`.

mod args;
mod effort;
mod evidence;
mod exit;
mod files;
mod help;
mod interrupt;
mod lists;
mod load;
mod memory;
mod named;
mod numbers;
mod partition;
mod progress;
mod render;
mod report;
mod report_page;
mod step;
mod unused_options;
mod verbs;
mod watch;
mod waves;

use args::{Cli, Verb, When};
use clap::FromArgMatches as _;
use exit::Exit;
use load::{Session, Stop};
use render::{MessageFormat, Style};
use report::Report;
use std::io::{self, IsTerminal as _, Write as _};
use std::process::ExitCode;
use std::sync::OnceLock;
use terminal_size::terminal_size_of;

/// The width in columns that is assumed for files, and for terminals that do not report their width.
const WIDTH: usize = 140;
/// The height in lines that is assumed for terminals that do not report their height.
const HEIGHT: usize = 40;

/// The error that occurred when standard output could not be written completely.
static LOST: OnceLock<String> = OnceLock::new();

fn main() -> ExitCode {
    if let Some(list) = lists::asked() {
        print(&list);
        return end(Exit::Done);
    }
    let parsed = help::command()
        .try_get_matches()
        .and_then(|matches| Ok((Cli::from_arg_matches(&matches)?, matches)));
    let (cli, matches) = match parsed {
        Ok(parsed) => parsed,
        // Help and the version are requested output.
        Err(said) if !said.use_stderr() => {
            note_lost(said.print());
            return end(Exit::Done);
        }
        Err(said) => return misused(&said),
    };
    let style = style(&cli);
    let report = Report::new(style.format, makes_standard_output(&cli.verb), cli.verb.name());
    interrupt::watch(report.clone(), style);
    let watches = watch::is_wanted(&cli);
    let is_driven = matches!(&cli.verb, Verb::Sim(arguments) if arguments.interactive);
    if watch::child::is_one() {
        watch::child::end_with_input();
    }
    if !cli.global.quiet && !report.is_for_machines() && !watches && !is_driven {
        progress::begin();
    }
    let mut session = Session::new(&cli.global, style, report.clone());
    let ended = match unused_options::refusal(&cli, &matches) {
        Some(idle) => Err(Stop::Usage(idle)),
        None if watches => watch::run(&cli, style),
        None => run(&cli, &mut session),
    };
    let exit = match ended {
        Ok(exit) => exit,
        Err(stop) => stopped(&report, stop),
    };
    // If the user interrupts the program at this moment, the signal ends it; after this it is too late.
    std::mem::forget(files::writing());
    progress::end();
    report.sum_up(style, cli.global.quiet);
    report.end(exit);
    end(exit)
}

/// Runs the verb.
fn run(cli: &Cli, session: &mut Session) -> Result<Exit, Stop> {
    match &cli.verb {
        Verb::New(arguments) => verbs::new::run(arguments, cli.global.quiet).map_err(Stop::Usage),
        Verb::Check(arguments) => verbs::check::run(session, arguments),
        Verb::Build(arguments) => verbs::build::run(session, arguments),
        Verb::Split(arguments) => verbs::split::run(session, arguments),
        Verb::Sim(arguments) => verbs::sim::run(session, arguments),
        Verb::Compare(arguments) => verbs::compare::run(session, arguments),
        Verb::Convert(arguments) => verbs::convert::run(session, arguments),
        Verb::Draw(arguments) => verbs::draw::run(session, arguments),
        Verb::Page(arguments) => verbs::page::run(session, arguments),
        Verb::Minimise(arguments) => verbs::minimise::run(session, arguments),
        Verb::Trace(arguments) => verbs::trace::run(session, arguments),
        Verb::Fmt(arguments) => verbs::fmt::run(session, arguments),
        Verb::Diff(arguments) => verbs::diff::run(session, arguments),
        Verb::Explain(arguments) => verbs::explain::run(arguments).map_err(Stop::Usage),
        Verb::Doctor => Ok(verbs::doctor::run()),
        Verb::Completions(arguments) => Ok(verbs::manual::completions(arguments.shell)),
        Verb::Man(arguments) => verbs::manual::man(arguments).map_err(Stop::Usage),
    }
}

/// Reports invalid options: as a report, if one was requested.
#[expect(
    clippy::disallowed_methods,
    reason = "arguments that cannot be parsed are scanned directly"
)]
fn misused(said: &clap::Error) -> ExitCode {
    let words: Vec<String> = std::env::args().collect();
    let asks = |name: &str| {
        words.iter().any(|word| *word == format!("--message-format={name}"))
            || words.windows(2).any(|pair| pair[0] == "--message-format" && pair[1] == name)
    };
    let format = match (asks("json"), asks("sarif")) {
        (true, _) => MessageFormat::Json,
        (_, true) => MessageFormat::Sarif,
        _ => {
            let _ = said.print();
            return end(Exit::Usage);
        }
    };
    let report = Report::new(format, false, words.get(1).map_or("", String::as_str));
    report.error(said.to_string().trim_end());
    report.end(Exit::Usage);
    end(Exit::Usage)
}

/// Reports why a verb could not continue.
fn stopped(report: &Report, stop: Stop) -> Exit {
    let (text, exit) = match stop {
        Stop::Errors => return Exit::Errors,
        Stop::Input(text) => (text, Exit::Errors),
        Stop::Usage(text) => (text, Exit::Usage),
    };
    if report.is_for_machines() {
        report.error(&text);
    } else {
        print_error(&format!("grafsynth: {text}\n"));
    }
    exit
}

/// True if the result of a verb goes to standard output, so a report must not be printed there.
fn makes_standard_output(verb: &Verb) -> bool {
    let is_dash = |path: &std::path::Path| path.as_os_str() == "-";
    match verb {
        Verb::Sim(arguments) => arguments.trace.is_none() || arguments.interactive,
        Verb::Convert(arguments) => is_dash(&arguments.output),
        Verb::Draw(arguments) => match &arguments.output {
            Some(output) => is_dash(output),
            None => arguments.input.file == "-",
        },
        Verb::Page(arguments) => match &arguments.output {
            Some(output) => is_dash(output),
            None => arguments.input.file == "-",
        },
        Verb::Check(arguments) => {
            arguments.dump_after.is_some() || arguments.certify.as_deref().is_some_and(is_dash)
        }
        Verb::Minimise(arguments) => arguments.output.as_deref().is_some_and(is_dash),
        Verb::Fmt(arguments) => arguments.files.iter().any(|file| file == "-"),
        Verb::Trace(_) | Verb::Explain(_) | Verb::Doctor | Verb::Completions(_) | Verb::Man(_) => {
            true
        }
        Verb::New(_) | Verb::Build(_) | Verb::Split(_) | Verb::Compare(_) | Verb::Diff(_) => false,
    }
}

/// The exit code; if standard output was lost, that of a file that cannot be written.
fn end(exit: Exit) -> ExitCode {
    let Some(why) = LOST.get() else { return ExitCode::from(exit as u8) };
    print_error(&format!("grafsynth: cannot write to standard output: {why}\n"));
    ExitCode::from(Exit::Usage as u8)
}

#[expect(clippy::disallowed_methods, reason = "NO_COLOR, COLUMNS and LINES are the user's wishes")]
fn style(cli: &Cli) -> Style {
    let color = match cli.global.color {
        When::Always => true,
        When::Never => false,
        When::Auto => {
            std::io::stderr().is_terminal()
                && std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty())
        }
    };
    let is_terminal = std::io::stderr().is_terminal();
    let size = if is_terminal { terminal_size_of(std::io::stderr()) } else { None };
    let wish = |name| std::env::var(name).ok().and_then(|value| value.parse::<usize>().ok());
    let width = size.map_or(WIDTH, |(width, _)| usize::from(width.0));
    let height = size.map_or(HEIGHT, |(_, height)| usize::from(height.0));
    Style {
        format: cli.global.message_format,
        color,
        max_diagnostics: cli.global.max_diagnostics,
        width: wish("COLUMNS").unwrap_or(width),
        height: is_terminal.then(|| wish("LINES").unwrap_or(height)),
    }
}

/// Prints requested output. Lost output gives exit code 2; a closed pipe (`| head`) is not an error.
pub(crate) fn print(text: &str) {
    progress::aside(|| {
        let mut out = io::stdout().lock();
        note_lost(out.write_all(text.as_bytes()).and_then(|()| out.flush()));
    });
}

fn note_lost(printed: io::Result<()>) {
    if let Err(error) = printed
        && error.kind() != io::ErrorKind::BrokenPipe
    {
        let _ = LOST.set(error.to_string());
    }
}

/// Prints additional messages.
pub(crate) fn print_error(text: &str) {
    progress::aside(|| {
        let _ = std::io::stderr().lock().write_all(text.as_bytes());
    });
}
