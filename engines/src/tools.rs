//! Finds programs and runs them. Outside tests, only this module and `explorer` start processes.

use std::io::{BufReader, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::Mutex;
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread;
use std::time::{Duration, Instant};

/// The output of a program and how it ended.
#[derive(Debug, Clone)]
pub struct Finished {
    /// Standard output.
    pub stdout: Vec<u8>,
    /// Standard error, as text.
    pub stderr: String,
    /// True if its exit code was 0.
    pub is_success: bool,
    /// Its exit code, or the signal that ended it.
    pub ending: String,
}

/// The first of these programs that is on the PATH.
#[must_use]
pub fn find(names: &[&str]) -> Option<PathBuf> {
    let path = std::env::var_os("PATH")?;
    names.iter().find_map(|name| {
        std::env::split_paths(&path).map(|folder| folder.join(name)).find(|file| is_program(file))
    })
}

#[cfg(unix)]
fn is_program(file: &Path) -> bool {
    use std::os::unix::fs::PermissionsExt as _;
    file.metadata().is_ok_and(|data| data.is_file() && data.permissions().mode() & 0o111 != 0)
}

#[cfg(not(unix))]
fn is_program(file: &Path) -> bool {
    file.is_file() || file.with_extension("exe").is_file()
}

/// The host's C compiler: `$CC`, or the first of cc, gcc and clang.
#[must_use]
pub fn c_compiler() -> Option<PathBuf> {
    if let Some(cc) = std::env::var_os("CC").filter(|cc| !cc.is_empty()) {
        let cc = PathBuf::from(cc);
        return if cc.components().count() > 1 {
            cc.is_file().then_some(cc)
        } else {
            find(&[cc.to_str()?])
        };
    }
    find(&["cc", "gcc", "clang"])
}

/// Runs a program in a folder with this standard input, for at most `limit`.
///
/// # Errors
/// In the user's terms: the program cannot be started, or did not end in time.
pub fn run(
    program: &Path,
    arguments: &[&str],
    folder: &Path,
    input: &[u8],
    limit: Duration,
) -> Result<Finished, String> {
    let (shown, mut child) = start(program, arguments, folder)?;
    let (stdin, stdout, stderr) = (child.stdin.take(), child.stdout.take(), child.stderr.take());
    let (ended, stdout, stderr) = thread::scope(|scope| {
        // Three pipes are handled concurrently: a program that fills one of them must not block while we handle another.
        scope.spawn(move || {
            if let Some(mut stdin) = stdin {
                // A program that ends without reading everything breaks the pipe; its exit code shows whether this is an error.
                let _ = stdin.write_all(input);
            }
        });
        let out = scope.spawn(move || read_all(stdout));
        let err = scope.spawn(move || read_all(stderr));
        let ended = wait(&mut child, limit);
        if ended.is_err() {
            // The program is stopped, so the pipes close and the readers end.
            let _ = child.kill();
            let _ = child.wait();
        }
        (ended, out.join().unwrap_or_default(), err.join().unwrap_or_default())
    });
    let status = ended.map_err(|why| format!("{shown}: {why}"))?;
    Ok(Finished {
        stdout,
        stderr: String::from_utf8_lossy(&stderr).into_owned(),
        is_success: status.success(),
        ending: status.to_string(),
    })
}

/// Starts a program in a folder, with pipes to all its streams; returns the name for messages too.
fn start(program: &Path, arguments: &[&str], folder: &Path) -> Result<(String, Child), String> {
    let shown = program.file_name().unwrap_or(program.as_os_str()).to_string_lossy().into_owned();
    let child = Command::new(program)
        .args(arguments)
        .current_dir(folder)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .map_err(|error| format!("{shown} cannot be started: {error}"))?;
    Ok((shown, child))
}

/// A question or report of a program that [`converse`] runs: one byte and two numbers of four bytes, the low byte first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Message {
    pub(crate) kind: u8,
    pub(crate) at: u32,
    pub(crate) value: u32,
}

/// Runs a program that sends messages on its standard output, and sends it the answers: numbers of four bytes.
///
/// # Errors
/// In the user's terms: the program cannot be started, is stopped after `limit`, does not end normally, or `answer` refuses a message.
pub(crate) fn converse(
    program: &Path,
    arguments: &[&str],
    folder: &Path,
    limit: Duration,
    answer: impl FnMut(Message) -> Result<Option<u32>, String>,
) -> Result<(), String> {
    let (shown, mut child) = start(program, arguments, folder)?;
    let (stdin, stdout, stderr) = (child.stdin.take(), child.stdout.take(), child.stderr.take());
    let (Some(stdin), Some(stdout)) = (stdin, stdout) else {
        return Err(format!("cannot connect to {shown}"));
    };
    let child = Mutex::new(child);
    let kill = || {
        if let Ok(mut child) = child.lock() {
            // A program that has ended cannot be stopped, which is no error.
            let _ = child.kill();
        }
    };
    let (outcome, is_late, stderr) = thread::scope(|scope| {
        let errors = scope.spawn(move || read_all(stderr));
        let (finished, watched) = mpsc::channel::<()>();
        let watch = scope.spawn(move || {
            let is_late = watched.recv_timeout(limit) == Err(RecvTimeoutError::Timeout);
            if is_late {
                kill();
            }
            is_late
        });
        let outcome = exchange(stdin, BufReader::new(stdout), answer);
        if outcome.is_err() {
            kill();
        }
        drop(finished);
        (outcome, watch.join().unwrap_or(false), errors.join().unwrap_or_default())
    });
    let status = child.into_inner().map(|mut child| child.wait());
    if is_late {
        return Err(format!("{shown} did not end within {} s", limit.as_secs()));
    }
    outcome?;
    match status {
        Ok(Ok(status)) if status.success() => Ok(()),
        Ok(Ok(status)) => {
            let stderr = String::from_utf8_lossy(&stderr);
            Err(format!("{shown} ended with {status} {}", stderr.trim()))
        }
        Ok(Err(error)) => Err(format!("{shown}: {error}")),
        Err(_) => Err(format!("{shown} was lost")),
    }
}

/// Answers messages until the program closes its output.
fn exchange(
    mut input: impl Write,
    mut output: impl Read,
    mut answer: impl FnMut(Message) -> Result<Option<u32>, String>,
) -> Result<(), String> {
    let mut bytes = [0; 9];
    // The end of the output is the end of the program, and its exit code shows whether it was intended.
    while output.read_exact(&mut bytes).is_ok() {
        let [kind, a, b, c, d, e, f, g, h] = bytes;
        let (at, value) = (u32::from_le_bytes([a, b, c, d]), u32::from_le_bytes([e, f, g, h]));
        if let Some(answer) = answer(Message { kind, at, value })? {
            // A program that has ended does not read its answer.
            let _ = input.write_all(&answer.to_le_bytes()).and_then(|()| input.flush());
        }
    }
    Ok(())
}

fn read_all(pipe: Option<impl Read>) -> Vec<u8> {
    let mut bytes = Vec::new();
    if let Some(mut pipe) = pipe {
        let _ = pipe.read_to_end(&mut bytes);
    }
    bytes
}

#[expect(clippy::disallowed_methods, reason = "a program that hangs must be stopped")]
fn wait(child: &mut Child, limit: Duration) -> Result<ExitStatus, String> {
    let start = Instant::now();
    let mut pause = Duration::from_micros(200);
    loop {
        match child.try_wait() {
            Ok(Some(status)) => return Ok(status),
            Ok(None) if start.elapsed() > limit => {
                return Err(format!("did not end within {} s", limit.as_secs()));
            }
            Ok(None) => thread::sleep(pause),
            Err(error) => return Err(error.to_string()),
        }
        pause = (pause * 2).min(Duration::from_millis(5));
    }
}
