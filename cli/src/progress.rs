//! The current task: a line on standard error for users who wait at a terminal for more than two seconds.

use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal as _;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

/// The time after which a task is shown.
const PATIENCE: Duration = Duration::from_secs(2);
const TICK: Duration = Duration::from_millis(120);

/// The current task, what is known so far, and the line that shows both.
struct Now {
    doing: String,
    known: String,
    line: Option<ProgressBar>,
}

static NOW: Mutex<Now> = Mutex::new(Now { doing: String::new(), known: String::new(), line: None });

fn now() -> std::sync::MutexGuard<'static, Now> {
    NOW.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Starts to show the current task, if there is a terminal.
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
        line.set_message(now.text());
        line.set_elapsed(PATIENCE);
        line.enable_steady_tick(TICK);
        now.line = Some(line);
    };
    // If the thread cannot be created, only the progress line is lost.
    let _ = std::thread::Builder::new().name("progress".to_owned()).spawn(show);
}

/// Sets the current task.
pub(crate) fn doing(what: String) {
    now().set(what, String::new());
}

/// Sets what is known so far about the current task.
pub(crate) fn known(what: String) {
    let mut now = now();
    let doing = now.doing.clone();
    now.set(doing, what);
}

/// The current task, and what is known so far.
pub(crate) fn what() -> String {
    now().text()
}

impl Now {
    fn set(&mut self, doing: String, known: String) {
        (self.doing, self.known) = (doing, known);
        if let Some(line) = &self.line {
            line.set_message(self.text());
        }
    }

    fn text(&self) -> String {
        let Now { doing, known, .. } = self;
        if known.is_empty() { doing.clone() } else { format!("{doing} ({known})") }
    }
}

/// Runs `print` with the progress line removed, so that the two do not mix.
pub(crate) fn aside(print: impl FnOnce()) {
    let line = now().line.clone();
    match line {
        Some(line) => line.suspend(print),
        None => print(),
    }
}

/// Removes the line.
pub(crate) fn end() {
    if let Some(line) = now().line.take() {
        line.finish_and_clear();
    }
}
