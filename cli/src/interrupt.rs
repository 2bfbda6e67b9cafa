//! Ctrl-C: known results are printed, nothing is written, and the program ends by the signal, as its caller expects.
//!
//! Files that are being written at that moment are completed: all of a build or none. A program that has finished by then ends normally.

use crate::render::Style;
use crate::report::Report;

/// Starts to wait for Ctrl-C. On systems without signals, the system ends the program.
#[cfg(not(unix))]
pub(crate) fn watch(_report: Report, _style: Style) {}

/// Starts to wait for Ctrl-C.
#[cfg(unix)]
pub(crate) fn watch(report: Report, style: Style) {
    use signal_hook::consts::SIGINT;
    let Ok(mut signals) = signal_hook::iterator::Signals::new([SIGINT]) else { return };
    let wait = move || {
        if signals.forever().next().is_none() {
            return;
        }
        crate::step::terminal::restore();
        if crate::watch::is_watching() {
            crate::watch::child::stop();
            crate::print_error("\ngrafsynth: no longer watching\n");
            let _written = crate::files::writing();
            let _ = signal_hook::low_level::emulate_default_handler(SIGINT);
            return;
        }
        // Locked to the end, so that no new write begins.
        let written = crate::files::writing();
        stopped(&report, style, *written);
        grafsynth_engines::scratch::remove_all();
        let _ = signal_hook::low_level::emulate_default_handler(SIGINT);
    };
    let _ = std::thread::Builder::new().name("interrupt".to_owned()).spawn(wait);
}

/// Reports what is known, and what was not completed.
#[cfg(unix)]
fn stopped(report: &Report, style: Style, is_written: bool) {
    let doing = crate::progress::what();
    crate::progress::end();
    report.print_known(style);
    let doing = if doing.is_empty() { String::new() } else { format!(" while {doing}") };
    let written = if is_written { "" } else { "; nothing was written" };
    let text = format!("stopped{doing}{written}");
    if report.is_for_machines() {
        report.error(&text);
    } else {
        crate::print_error(&format!("grafsynth: {text}\n"));
    }
    report.end(crate::exit::Exit::Interrupted);
}
