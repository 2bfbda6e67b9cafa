//! Ctrl-C: what is known is printed, nothing is written, and the program ends by the signal, as its caller expects.
//!
//! Files that are being written in that moment are written to the end: all of a build or none. A program that has come to its end by then ends as it would have.

use crate::render::Style;
use crate::report::Report;

/// Begins to wait for Ctrl-C. Where there are no signals, the system just ends the program.
#[cfg(not(unix))]
pub(crate) fn watch(_report: Report, _style: Style) {}

/// Begins to wait for Ctrl-C.
#[cfg(unix)]
pub(crate) fn watch(report: Report, style: Style) {
    use signal_hook::consts::SIGINT;
    let Ok(mut signals) = signal_hook::iterator::Signals::new([SIGINT]) else { return };
    let wait = move || {
        if signals.forever().next().is_none() {
            return;
        }
        // Held to the end, so that nothing is begun to be written any more.
        let written = crate::files::writing();
        stopped(&report, style, *written);
        grafsynth_engines::scratch::remove_all();
        let _ = signal_hook::low_level::emulate_default_handler(SIGINT);
    };
    let _ = std::thread::Builder::new().name("interrupt".to_owned()).spawn(wait);
}

/// Says what is known, and what is not any more found out.
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
