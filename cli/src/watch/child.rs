//! The second process of `--watch`: the same command, which can be stopped in the middle of a proof.
//!
//! It ends when its standard input ends. So it also ends if the process that watches is killed. Files that it is writing at that moment are completed: all of a
//! build or none.

#![expect(
    clippy::disallowed_methods,
    reason = "the command line starts and ends the second process here"
)]

use std::process::{Child, Command, Stdio};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

/// The environment variable that marks the second process.
const MARK: &str = "GRAFSYNTH_WATCHED";
/// How long the second process may take to end.
const PATIENCE: Duration = Duration::from_secs(5);
const GLANCE: Duration = Duration::from_millis(10);

static CHILD: Mutex<Option<Child>> = Mutex::new(None);

/// True in the second process.
pub(crate) fn is_one() -> bool {
    std::env::var_os(MARK).is_some()
}

/// In the second process: ends it when its standard input ends.
#[expect(clippy::exit, reason = "nothing else can stop a proof in another thread")]
pub(crate) fn end_with_input() {
    let wait = || {
        let _ = std::io::copy(&mut std::io::stdin().lock(), &mut std::io::sink());
        // Locked to the end, so that no new write begins.
        let _written = crate::files::writing();
        crate::progress::end();
        grafsynth_engines::scratch::remove_all();
        std::process::exit(crate::exit::Exit::Interrupted as i32);
    };
    let _ = std::thread::Builder::new().name("watched".to_owned()).spawn(wait);
}

/// Starts the second process with the command line of this one.
///
/// # Errors
/// The error of the system, in the user's terms.
pub(super) fn start() -> Result<(), String> {
    let cannot = |why: std::io::Error| format!("cannot start the second process of --watch: {why}");
    let program = std::env::current_exe().map_err(cannot)?;
    let mut command = Command::new(program);
    command.args(std::env::args_os().skip(1)).env(MARK, "1").stdin(Stdio::piped());
    // Ctrl-C goes to the process that watches, which then ends this one.
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(&mut command, 0);
    let child = command.spawn().map_err(cannot)?;
    *CHILD.lock().unwrap_or_else(PoisonError::into_inner) = Some(child);
    Ok(())
}

/// The exit code of the second process, if it has just ended: 130 if a signal ended it.
pub(super) fn ended() -> Option<i32> {
    let mut child = CHILD.lock().unwrap_or_else(PoisonError::into_inner);
    let status = child.as_mut()?.try_wait().ok()??;
    *child = None;
    Some(status.code().unwrap_or(crate::exit::Exit::Interrupted as i32))
}

/// Ends the second process and waits until it has ended; true if there was one.
pub(crate) fn stop() -> bool {
    let Some(mut child) = CHILD.lock().unwrap_or_else(PoisonError::into_inner).take() else {
        return false;
    };
    drop(child.stdin.take());
    let mut left = PATIENCE;
    while matches!(child.try_wait(), Ok(None)) && !left.is_zero() {
        std::thread::sleep(GLANCE);
        left = left.saturating_sub(GLANCE);
    }
    let _ = child.kill();
    let _ = child.wait();
    true
}
