//! A bound on memory and time for work that cannot be bounded by counting steps: in a template, one step can double a string.
//!
//! The memory of the process is measured every few milliseconds while the work runs, if the system supports it (Linux). Otherwise only the time is
//! bounded.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// The maximum amount of additional memory for the work, in bytes.
const LIMIT: u64 = 1 << 30;
/// The maximum time for the work.
const TIME: Duration = Duration::from_secs(60);
const GLANCE: Duration = Duration::from_millis(2);

/// Ends the program with the exit code of an invalid input if [`LIMIT`] or [`TIME`] is exceeded while this value lives.
pub(crate) struct Bound {
    is_done: Arc<AtomicBool>,
    watcher: Option<JoinHandle<()>>,
}

impl Bound {
    /// Starts to measure `work`; `code` is the code of the finding if a bound is exceeded.
    pub(crate) fn start(code: &'static str, work: &'static str) -> Self {
        let is_done = Arc::new(AtomicBool::new(false));
        let seen = Arc::clone(&is_done);
        let before = resident().unwrap_or(0);
        #[expect(clippy::disallowed_methods, reason = "the bound is on time")]
        let since = Instant::now();
        let watch = move || {
            while !seen.load(Ordering::Relaxed) {
                if resident().is_some_and(|now| now.saturating_sub(before) > LIMIT) {
                    let gib = LIMIT >> 30;
                    stop(&format!("error[{code}]: {work} needs more than {gib} GiB of memory\n"));
                }
                if since.elapsed() > TIME {
                    stop(&format!("error[{code}]: {work} takes more than {} s\n", TIME.as_secs()));
                }
                std::thread::sleep(GLANCE);
            }
        };
        let watcher = std::thread::Builder::new().name("bound".to_owned()).spawn(watch).ok();
        Bound { is_done, watcher }
    }
}

impl Drop for Bound {
    fn drop(&mut self) {
        self.is_done.store(true, Ordering::Relaxed);
        if let Some(watcher) = self.watcher.take() {
            let _ = watcher.join();
        }
    }
}

#[expect(
    clippy::exit,
    clippy::disallowed_methods,
    reason = "the work is in another thread, which nothing else can stop; nothing has been written yet"
)]
fn stop(said: &str) -> ! {
    crate::print_error(said);
    std::process::exit(crate::exit::Exit::Errors as i32)
}

/// The memory of the process in bytes; `None` if the system does not report it.
#[expect(clippy::disallowed_methods, reason = "this reads a system value, not a source")]
fn resident() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
    line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok().map(|kilobytes| kilobytes * 1024)
}
