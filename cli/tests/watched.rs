//! `--watch` with real processes: what appears after a save, what stays after a broken one, and how it ends.

#![cfg(unix)]
#![allow(clippy::disallowed_methods, reason = "tests read files and start programs")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// The time in which something that is expected must happen, on a busy machine.
const PATIENCE: Duration = Duration::from_secs(30);

fn chart(output: &str) -> String {
    format!(
        "chart lamp {{\n    input on\n    output {output}\n    initial step dark\n    step lit {{ {output} }}\n    dark -> lit when on\n    lit -> dark when not on\n}}\n"
    )
}

/// A process started with `--watch`, and its output so far.
struct Watcher {
    child: Child,
    said: Arc<Mutex<String>>,
    folder: tempfile::TempDir,
    /// The place up to which its words were compared.
    read: usize,
}

impl Watcher {
    fn start(arguments: &[&str], files: &[(&str, &str)]) -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        for (name, text) in files {
            fs::write(folder.path().join(name), text).expect("it is written");
        }
        let mut child = Command::new(env!("CARGO_BIN_EXE_grafsynth"))
            .args(arguments)
            .arg("--watch")
            .current_dir(folder.path())
            .env("NO_COLOR", "1")
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("grafsynth starts");
        let said = Arc::<Mutex<String>>::default();
        let (out, err) =
            (child.stdout.take().expect("a pipe"), child.stderr.take().expect("a pipe"));
        listen(out, Arc::clone(&said));
        listen(err, Arc::clone(&said));
        Watcher { child, said, folder, read: 0 }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn save(&self, name: &str, text: &str) {
        fs::write(self.path(name), text).expect("it is written");
    }

    /// Waits until the output contains this text after the text of the last call.
    fn until(&mut self, text: &str) {
        let since = Instant::now();
        loop {
            let said = self.said.lock().expect("no panic").clone();
            if let Some(place) = said[self.read..].find(text) {
                self.read += place + text.len();
                return;
            }
            assert!(
                since.elapsed() < PATIENCE,
                "no `{text}` in:\n{}\nof:\n{said}",
                &said[self.read..]
            );
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    fn has_said(&self, text: &str) -> usize {
        self.said.lock().expect("no panic").matches(text).count()
    }

    /// Waits until a file contains a text.
    fn until_in(&self, name: &str, text: &str) {
        let since = Instant::now();
        while !fs::read_to_string(self.path(name)).is_ok_and(|content| content.contains(text)) {
            assert!(
                since.elapsed() < PATIENCE,
                "no `{text}` in {name}; {}",
                self.said.lock().expect("no panic")
            );
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    fn signal(&self, signal: &str) {
        let id = self.child.id().to_string();
        assert!(Command::new("kill").args([signal, &id]).status().expect("kill starts").success());
    }
}

impl Drop for Watcher {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn listen(mut pipe: impl std::io::Read + Send + 'static, said: Arc<Mutex<String>>) {
    std::thread::spawn(move || {
        let mut some = [0; 4096];
        while let Ok(n @ 1..) = pipe.read(&mut some) {
            said.lock().expect("no panic").push_str(&String::from_utf8_lossy(&some[..n]));
        }
    });
}

#[test]
fn a_drawing_follows_each_save_and_keeps_the_last_good_picture() {
    let mut watcher = Watcher::start(&["draw", "lamp.graf"], &[("lamp.graf", &chart("R"))]);
    watcher.until("wrote lamp.svg");
    watcher.save("lamp.graf", &chart("GREEN"));
    watcher.until("lamp.graf changed");
    watcher.until("wrote lamp.svg");
    watcher.until_in("lamp.svg", "GREEN");
    // A broken save: the last good picture, with the error above it.
    watcher.save("lamp.graf", &chart("BLUE").replace("when on", "when off"));
    watcher.until("error[");
    watcher.until_in("lamp.svg", "lamp.graf has errors; this is the last good drawing");
    watcher.until_in("lamp.svg", "unknown");
    let broken = fs::read_to_string(watcher.path("lamp.svg")).expect("it is there");
    assert!(broken.contains("GREEN") && !broken.contains("BLUE"), "{broken}");
    // Saved by renaming, as many editors do.
    watcher.save("new", &chart("AMBER"));
    fs::rename(watcher.path("new"), watcher.path("lamp.graf")).expect("it is renamed");
    watcher.until_in("lamp.svg", "AMBER");
    assert!(!fs::read_to_string(watcher.path("lamp.svg")).expect("it is there").contains("errors"));
    // Deleted, and made again.
    fs::remove_file(watcher.path("lamp.graf")).expect("it is removed");
    watcher.until("cannot read lamp.graf");
    watcher.save("lamp.graf", &chart("WHITE"));
    watcher.until_in("lamp.svg", "WHITE");
    // Truncated, and written a little later: the empty file is not drawn.
    let before = watcher.has_said("error") + watcher.has_said("is empty");
    watcher.save("lamp.graf", "");
    std::thread::sleep(Duration::from_millis(150));
    watcher.save("lamp.graf", &chart("BLACK"));
    watcher.until_in("lamp.svg", "BLACK");
    assert_eq!(watcher.has_said("error") + watcher.has_said("is empty"), before);
    // Touched without a change.
    let n_changes = watcher.has_said("changed");
    watcher.save("lamp.graf", &chart("BLACK"));
    std::thread::sleep(Duration::from_millis(300));
    assert_eq!(watcher.has_said("changed"), n_changes);
    watcher.signal("-INT");
    let status = watcher.child.wait().expect("it ends");
    assert_eq!(std::os::unix::process::ExitStatusExt::signal(&status), Some(2));
    watcher.until("no longer watching");
}

#[test]
fn a_build_follows_the_files_that_it_depends_on() {
    let chart = chart("R").replace("chart lamp {", "use \"more.graf\"\nchart lamp {");
    let library = "library chart blink {\n    input go\n    output x\n    initial step a\n    step b { x }\n    a -> b when go\n    b -> a when not go\n}\n";
    let files = [("lamp.graf", chart.as_str()), ("more.graf", library)];
    let mut watcher = Watcher::start(&["build", "lamp.graf", "--target", "c", "-o", "out"], &files);
    watcher.until("no errors; running checks and proofs");
    watcher.until("finished with exit code");
    let first = fs::read_to_string(watcher.path("out/lamp.c")).expect("it was written");
    // A library that is broken: nothing is written.
    watcher.save("more.graf", &library.replace("when go", "when stop"));
    watcher.until("more.graf changed");
    watcher.until("error[");
    assert_eq!(fs::read_to_string(watcher.path("out/lamp.c")).expect("it is there"), first);
    watcher.save("more.graf", library);
    watcher.until("finished with exit code");
    // A file that did not exist before: properties beside the chart.
    watcher.save("lamp.props", "assume never on\n");
    watcher.until("lamp.props changed");
    watcher.until("finished with exit code");
    watcher.save("lamp.graf", &chart.replace('R', "MOTOR"));
    watcher.until("finished with exit code");
    let last = fs::read_to_string(watcher.path("out/lamp.c")).expect("it is there");
    assert!(last.contains("MOTOR") && !first.contains("MOTOR"));
}

/// A chart whose proofs take long: ten lamps that count on their own.
fn slow() -> String {
    let mut text = String::from("chart slow {\n    tick 1 ms\n    output o\n");
    for at in 0..10 {
        let next = (at + 1) % 10;
        text += &format!(
            "    input a{at}, b{at}\n    var n{at}: int 0..1000000 = {at}\n    initial step p{at}\n    step q{at}\n    p{at} -> q{at} when a{at} and n{at} < 999983 do {{ n{at} := n{at} + n{next} mod 7 }}\n    q{at} -> p{at} when b{at} or q{at}.t >= 50 s\n    assert never (n{at} = {} and n{next} = 12345)\n",
            777_777 + at
        );
    }
    text + "}\n"
}

#[test]
fn a_save_drops_the_proofs_that_run() {
    let slow = slow();
    let mut watcher =
        Watcher::start(&["check", "lamp.graf", "--effort", "3"], &[("lamp.graf", &slow)]);
    watcher.until("no errors; running checks and proofs");
    std::thread::sleep(Duration::from_millis(300));
    let since = Instant::now();
    watcher.save("lamp.graf", &chart("R"));
    watcher.until("run cancelled: a file was saved");
    watcher.until("lamp.graf changed");
    watcher.until("finished with exit code 0");
    assert!(since.elapsed() < Duration::from_secs(20));
    // Ctrl-C in the middle of a proof ends the second process, too; and so does the death of the process that watches.
    watcher.save("lamp.graf", &slow);
    watcher.until("no errors; running checks and proofs");
    let second = children(watcher.child.id());
    assert_eq!(second.len(), 1);
    watcher.signal("-INT");
    watcher.until("no longer watching");
    let _ = watcher.child.wait();
    gone(second[0]);
    let mut watcher =
        Watcher::start(&["check", "lamp.graf", "--effort", "3"], &[("lamp.graf", &slow)]);
    watcher.until("no errors; running checks and proofs");
    let second = children(watcher.child.id());
    watcher.signal("-KILL");
    gone(second[0]);
}

/// The processes that a process has started.
fn children(parent: u32) -> Vec<u32> {
    let list = Command::new("ps").args(["-o", "pid=", "--ppid", &parent.to_string()]).output();
    let list = String::from_utf8(list.expect("ps starts").stdout).expect("numbers");
    list.split_whitespace().filter_map(|id| id.parse().ok()).collect()
}

/// Waits until a process has ended.
fn gone(id: u32) {
    let since = Instant::now();
    while Path::new(&format!("/proc/{id}")).exists()
        && !fs::read_to_string(format!("/proc/{id}/stat")).unwrap_or_default().contains(") Z ")
    {
        assert!(since.elapsed() < PATIENCE, "process {id} still runs");
        std::thread::sleep(Duration::from_millis(10));
    }
}

#[test]
fn a_page_and_a_folder_are_watched_too() {
    let mut watcher = Watcher::start(&["page", "lamp.graf"], &[("lamp.graf", &chart("R"))]);
    watcher.until("wrote lamp.html");
    watcher.save("lamp.graf", "chart broken {");
    watcher.until("error[");
    assert!(fs::read_to_string(watcher.path("lamp.html")).is_ok());
    watcher.save("lamp.graf", &chart("MOTOR"));
    watcher.until_in("lamp.html", "MOTOR");
    let mut watcher = Watcher::start(&["check", "."], &[("lamp.graf", &chart("R"))]);
    watcher.until("finished with exit code 0");
    watcher.save("other.graf", &chart("L").replace("when on", "when off"));
    watcher.until("other.graf changed");
    watcher.until("other.graf:6:22");
}

#[test]
fn impossible_requests_are_refused() {
    for arguments in [
        &["check", "absent.graf"][..],
        &["check", "-"],
        &["draw", "lamp.graf", "-o", "-"],
        &["check", "lamp.graf", "--message-format", "json"],
    ] {
        let mut watcher = Watcher::start(arguments, &[("lamp.graf", &chart("R"))]);
        let status = watcher.child.wait().expect("it ends");
        assert_eq!(status.code(), Some(2), "{arguments:?}");
    }
}
