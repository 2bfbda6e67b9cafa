//! What is being tried: a line on standard error for whoever waits at a terminal longer than two seconds.

use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal as _;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

/// Nobody is told of what takes less.
const PATIENCE: Duration = Duration::from_secs(2);
const TICK: Duration = Duration::from_millis(120);

/// What is being tried, and the line that says so.
struct Now {
    doing: String,
    line: Option<ProgressBar>,
}

static NOW: Mutex<Now> = Mutex::new(Now { doing: String::new(), line: None });

fn now() -> std::sync::MutexGuard<'static, Now> {
    NOW.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Begins to show what is being tried, if somebody can see it.
pub(crate) fn begin() {
    if !std::io::stderr().is_terminal() {
        return;
    }
    let show = || {
        std::thread::sleep(PATIENCE);
        let line = ProgressBar::new_spinner();
        if let Ok(style) = ProgressStyle::with_template("{spinner} {msg} ({elapsed})") {
            line.set_style(style);
        }
        let mut now = now();
        line.set_message(now.doing.clone());
        line.set_elapsed(PATIENCE);
        line.enable_steady_tick(TICK);
        now.line = Some(line);
    };
    // Without the thread nothing is shown, which is all that is lost.
    let _ = std::thread::Builder::new().name("progress".to_owned()).spawn(show);
}

/// Says what is being tried from now on.
pub(crate) fn doing(what: String) {
    let mut now = now();
    if let Some(line) = &now.line {
        line.set_message(what.clone());
    }
    now.doing = what;
}

/// What is being tried.
pub(crate) fn what() -> String {
    now().doing.clone()
}

/// Prints something without the line in its way.
pub(crate) fn aside(print: impl FnOnce()) {
    let line = now().line.clone();
    match line {
        Some(line) => line.suspend(print),
        None => print(),
    }
}

/// Takes the line away.
pub(crate) fn end() {
    if let Some(line) = now().line.take() {
        line.finish_and_clear();
    }
}
