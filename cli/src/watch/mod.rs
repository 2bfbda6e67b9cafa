//! `--watch`: runs a verb again whenever a file that it read is saved.
//!
//! The design is read in this process, so that its errors and its picture appear at once. `check` and `build` continue in a second process ([`child`]), because
//! nothing else can stop a proof: it ends when the files are saved again. A save that leaves the design broken writes nothing, so the last good outputs stay;
//! the drawing of `draw` then has the errors above the last good picture.

pub(crate) mod child;
mod seen;

use crate::args::{Cli, Input, Verb};
use crate::exit::Exit;
use crate::files;
use crate::load::{Session, Stop};
use crate::render::Style;
use crate::report::Report;
use crate::verbs;
use grafsynth_draw::Picture;
use grafsynth_ir::diag::any_error;
use seen::Seen;
use std::collections::BTreeSet;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// The time between two looks at the files.
const GLANCE: Duration = Duration::from_millis(40);
/// The number of looks after which folders are listed again: new charts may be in them.
const LISTED: u32 = 25;

/// True if the command line asks for `--watch` and this process is the one that watches.
pub(crate) fn is_wanted(cli: &Cli) -> bool {
    let is_given = match &cli.verb {
        Verb::Check(arguments) => arguments.watch,
        Verb::Build(arguments) => arguments.watch,
        Verb::Draw(arguments) => arguments.watch,
        Verb::Page(arguments) => arguments.watch,
        _ => false,
    };
    is_given && !child::is_one()
}

/// True once this process watches files.
static WATCHES: AtomicBool = AtomicBool::new(false);

/// True if this process watches files.
#[cfg(unix)]
pub(crate) fn is_watching() -> bool {
    WATCHES.load(Ordering::Relaxed)
}

/// What one run needs from the last ones.
#[derive(Default)]
struct Last {
    /// The last good drawing.
    picture: Option<Picture>,
}

/// Runs the verb, and again after each save, until Ctrl-C.
///
/// # Errors
/// An impossible request: a result for programs, a design from standard input, or a file that does not exist at the start.
pub(crate) fn run(cli: &Cli, style: Style) -> Result<Exit, Stop> {
    refuse(cli)?;
    WATCHES.store(true, Ordering::Relaxed);
    let mut last = Last::default();
    let mut seen = Seen::new(cli.global.source_limit);
    note(cli, "watching; press Ctrl-C to stop\n");
    loop {
        let listed = listed(cli)?;
        files::touched();
        let is_running = round(cli, style, &mut last);
        seen.also(files::touched().into_iter().chain(named_files(cli)));
        wait(cli, &mut seen, &listed, is_running)?;
    }
}

fn note(cli: &Cli, text: &str) {
    if !cli.global.quiet {
        crate::print_error(text);
    }
}

fn refuse(cli: &Cli) -> Result<(), Stop> {
    let wrong = |text: String| Err(Stop::Usage(text));
    if !matches!(
        cli.global.message_format,
        crate::render::MessageFormat::Human | crate::render::MessageFormat::Short
    ) {
        return wrong(
            "--watch supports only the message formats human and short; omit --message-format"
                .to_owned(),
        );
    }
    let to_stdout = |path: &Option<std::path::PathBuf>| {
        path.as_deref().is_some_and(|path| path.as_os_str() == "-")
    };
    let is_printed = match &cli.verb {
        Verb::Draw(arguments) => to_stdout(&arguments.output),
        Verb::Page(arguments) => to_stdout(&arguments.output),
        _ => false,
    };
    if is_printed {
        return wrong("--watch cannot write to standard output; use -o FILE".to_owned());
    }
    for file in designs(cli) {
        if file == "-" {
            return wrong("--watch cannot watch standard input".to_owned());
        }
        if !std::path::Path::new(&file).exists() {
            return wrong(format!("cannot read {file}: there is no such file"));
        }
    }
    Ok(())
}

/// The designs as they were named.
fn designs(cli: &Cli) -> Vec<String> {
    match &cli.verb {
        Verb::Check(arguments) => arguments.inputs.files.clone(),
        Verb::Build(arguments) => arguments.inputs.files.clone(),
        Verb::Draw(arguments) => vec![arguments.input.file.clone()],
        Verb::Page(arguments) => vec![arguments.input.file.clone()],
        _ => Vec::new(),
    }
}

/// The files that the options name, which the second process reads.
fn named_files(cli: &Cli) -> Vec<String> {
    let mut all: Vec<String> =
        designs(cli).into_iter().filter(|file| !files::is_folder(file)).collect();
    match &cli.verb {
        Verb::Check(arguments) => all.extend(arguments.recheck.clone()),
        Verb::Build(arguments) => {
            all.extend(arguments.stimulus.clone());
            all.extend(arguments.template.clone());
            all.extend(arguments.keep_pins.clone());
        }
        _ => {}
    }
    all
}

/// The charts in the named folders; empty if no folder is named.
fn listed(cli: &Cli) -> Result<BTreeSet<String>, Stop> {
    let mut all = BTreeSet::new();
    for folder in designs(cli).iter().filter(|file| files::is_folder(file)) {
        all.extend(files::below(folder)?);
    }
    Ok(all)
}

/// One run. True if a second process works on it.
fn round(cli: &Cli, style: Style, last: &mut Last) -> bool {
    let report = Report::new(style.format, false, cli.verb.name());
    let mut session = Session::new(&cli.global, style, report.clone());
    let ended = match &cli.verb {
        Verb::Draw(arguments) => {
            let ended = verbs::draw::again(&mut session, arguments, &mut last.picture);
            Some(ended)
        }
        Verb::Page(arguments) => Some(verbs::page::run(&mut session, arguments)),
        _ => readable(cli, &mut session).map(|()| None).unwrap_or_else(|stop| Some(Err(stop))),
    };
    let Some(ended) = ended else {
        note(cli, "no errors; running checks and proofs\n");
        return child::start()
            .map_err(|why| crate::print_error(&format!("grafsynth: {why}\n")))
            .is_ok();
    };
    if let Err(stop) = ended {
        session.stopped(stop);
    }
    report.sum_up(style, cli.global.quiet);
    false
}

/// Reads all designs, and shows their findings if one has errors: otherwise the second process shows them.
fn readable(cli: &Cli, session: &mut Session) -> Result<(), Stop> {
    let inputs = match &cli.verb {
        Verb::Check(arguments) => &arguments.inputs,
        Verb::Build(arguments) => &arguments.inputs,
        _ => return Ok(()),
    };
    let inputs: Vec<Input> = session.inputs(inputs)?;
    let mut broken = None;
    for input in &inputs {
        let mut own = session.another();
        own.quiet = true;
        match own.design(input) {
            Ok((_, found)) if any_error(&found) => {
                own.show(&found);
                broken = Some(Stop::Errors);
            }
            Ok(_) => {}
            Err(stop) => {
                session.stopped(stop);
                broken = Some(Stop::Errors);
            }
        }
    }
    broken.map_or(Ok(()), Err)
}

/// Waits until a file changes; ends the second process then, and says meanwhile how it ended.
fn wait(
    cli: &Cli,
    seen: &mut Seen,
    listed_before: &BTreeSet<String>,
    mut is_running: bool,
) -> Result<(), Stop> {
    let mut n_looks = 0_u32;
    loop {
        std::thread::sleep(GLANCE);
        if is_running && let Some(code) = child::ended() {
            is_running = false;
            note(cli, &format!("finished with exit code {code}; waiting for a save\n"));
        }
        n_looks = n_looks.wrapping_add(1);
        let changed = match seen.changed() {
            Some(file) => Some(file),
            None if !listed_before.is_empty() && n_looks.is_multiple_of(LISTED) => {
                let now = listed(cli).unwrap_or_default();
                now.symmetric_difference(listed_before).next().cloned()
            }
            None => None,
        };
        let Some(file) = changed else { continue };
        if is_running && child::stop() {
            note(cli, "run cancelled: a file was saved\n");
        }
        note(cli, &format!("\n{file} changed\n"));
        return Ok(());
    }
}
