//! Killed builds, concurrent builds, and folders with obstacles: the files always belong to one build.

#![allow(clippy::disallowed_methods, reason = "tests read files and start the program")]

use super::case_files::wrong_hashes;
use grafsynth_ir::random::Random;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

/// Two versions of one chart, which produce files with the same names but different contents.
const VERSIONS: [&str; 2] = [
    "chart lamp {\n extern condition dark\n output lit\n initial step off\n step on { lit }\n off -> on when dark\n on -> off when not dark\n}\n",
    "chart lamp {\n extern condition dark\n output lit\n initial step on { lit }\n step off\n on -> off when not dark\n off -> on when dark\n}\n",
];
/// Files of the user in the output folder.
const MINE: [&str; 4] = ["notes.txt", ".hidden", "lamp-plain/notes.txt", "lamp-plain/lamp_user.c"];

fn many(few: u64, many: u64) -> u64 {
    match std::env::var("GRAFSYNTH_DEEP").ok().and_then(|part| part.parse::<u64>().ok()) {
        None | Some(0) => few,
        Some(part) => many.div_ceil(part).max(few),
    }
}

/// A folder with both versions of the chart and the user's files.
fn project() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (version, text) in VERSIONS.iter().enumerate() {
        let folder = folder.path().join(version.to_string());
        fs::create_dir(&folder).expect("it is made");
        fs::write(folder.join("lamp.graf"), text).expect("it is written");
    }
    fs::create_dir_all(folder.path().join("out/lamp-plain")).expect("it is made");
    for name in MINE {
        fs::write(folder.path().join("out").join(name), "mine\n").expect("it is written");
    }
    folder
}

fn grafsynth(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_grafsynth"));
    command.args(arguments).current_dir(folder).env("NO_COLOR", "1");
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

fn build(folder: &Path, version: usize) -> Command {
    let chart = format!("{version}/lamp.graf");
    let rest = ["--target", "c,json,net", "--package", "plain,cmake", "--emit", "map"];
    let mut arguments = vec!["build", &chart, "--no-proof", "-o", "out"];
    arguments.extend(rest);
    grafsynth(folder, &arguments)
}

fn done(mut command: Command) -> Output {
    command.output().expect("grafsynth starts")
}

fn started(mut command: Command) -> Child {
    command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("grafsynth starts")
}

/// All files below a folder, with their bytes.
fn snapshot(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut all = BTreeMap::new();
    let mut open = vec![folder.to_owned()];
    while let Some(at) = open.pop() {
        for entry in fs::read_dir(at).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                open.push(path);
            } else {
                let name = path.strip_prefix(folder).expect("it is there").to_owned();
                all.insert(name, fs::read(path).expect("it can be read"));
            }
        }
    }
    all
}

/// The temporary entries of grafsynth below a folder, regardless of their contents.
fn entries(folder: &Path) -> Vec<PathBuf> {
    let mut all = Vec::new();
    let mut open = vec![folder.to_owned()];
    while let Some(at) = open.pop() {
        for entry in fs::read_dir(at).expect("a folder") {
            let path = entry.expect("an entry").path();
            let name = path.file_name().expect("a name").to_string_lossy().into_owned();
            if name.starts_with(".grafsynth-") {
                all.push(path);
            } else if path.is_dir() {
                open.push(path);
            }
        }
    }
    all
}

/// The files of each version after an undisturbed build.
fn complete_sets(folder: &Path) -> [BTreeMap<PathBuf, Vec<u8>>; 2] {
    [0, 1].map(|version| {
        let output = done(build(folder, version));
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let out = folder.join("out");
        let list = fs::read(out.join("lamp.outputs.json")).expect("the list of outputs");
        assert_eq!(wrong_hashes(&out, &list), Vec::<String>::new());
        snapshot(&out)
    })
}

#[test]
fn a_killed_build_leaves_the_files_of_one_build() {
    let folder = project();
    let out = folder.path().join("out");
    let sets = complete_sets(folder.path());
    assert_ne!(sets[0], sets[1], "the versions differ");
    for name in MINE {
        assert_eq!(sets[0][Path::new(name)], b"mine\n", "{name}");
    }
    let since = Instant::now();
    assert!(done(build(folder.path(), 1)).status.success());
    let whole = since.elapsed();
    let (mut random, mut n_left, mut counts) = (Random::new(1), 0, [0_u64; 2]);
    let mut version = 1;
    let n_kills = many(24, 1_000);
    for round in 0..n_kills {
        let old = version;
        let mut child = started(build(folder.path(), 1 - old));
        if round % 3 == 0 {
            let share = u32::try_from(random.below(1_200)).expect("below 1200");
            std::thread::sleep(whole * share / 1_000);
        } else {
            // A write is a short part of a build, so most rounds wait until it has begun before they kill.
            while !out.join(".grafsynth-build").exists()
                && child.try_wait().expect("a child").is_none()
            {
                std::thread::yield_now();
            }
            std::thread::sleep(Duration::from_micros(random.between(0, 12_000).unsigned_abs()));
        }
        let _ = child.kill();
        child.wait().expect("a child");
        let left = entries(&out);
        assert!(left.len() <= 1, "round {round}: {left:?}");
        let now = snapshot(&out);
        let is_committed = left.iter().any(|entry| entry.join("journal").exists());
        assert!(
            is_committed
                || sets.iter().any(|set| set.iter().all(|(name, it)| now.get(name) == Some(it))),
            "round {round}: files of two builds, and nothing that completes them"
        );
        n_left += left.len();
        // Any run in that folder completes or removes the interrupted write.
        let run = done(grafsynth(folder.path(), &["check", "out/lamp.net"]));
        assert!(run.status.success(), "round {round}: {}", String::from_utf8_lossy(&run.stderr));
        let now = snapshot(&out);
        let Some(found) = sets.iter().position(|set| *set == now) else {
            let differs = now.iter().filter(|(name, it)| sets[old].get(*name) != Some(it));
            let names: Vec<_> = differs.map(|(name, _)| name).collect();
            panic!("round {round}: {names:?} are not the old ones (and others are)");
        };
        counts[usize::from(found != old)] += 1;
        version = found;
    }
    println!(
        "{n_kills} kills: {} before the write, {} after it; {n_left} left an entry, which the next run completed or removed",
        counts[0], counts[1]
    );
}

#[test]
fn two_builds_at_once_leave_the_files_of_one() {
    let folder = project();
    let out = folder.path().join("out");
    let sets = complete_sets(folder.path());
    let n_pairs = many(8, 200);
    let mut counts = [0_u64; 2];
    for pair in 0..n_pairs {
        let children = [0, 1].map(|version| started(build(folder.path(), version)));
        for mut child in children {
            assert!(child.wait().expect("a child").success(), "pair {pair}");
        }
        let now = snapshot(&out);
        let found = sets.iter().position(|set| *set == now);
        counts[found.unwrap_or_else(|| panic!("pair {pair}: files of two builds"))] += 1;
        assert_eq!(entries(&out), Vec::<PathBuf>::new(), "pair {pair}");
    }
    println!(
        "{n_pairs} pairs: {} times the first version, {} times the second",
        counts[0], counts[1]
    );
}

/// The message of a build with an obstacle; nothing is written.
fn refused(folder: &Path) -> String {
    let before = snapshot(&folder.join("out"));
    let output = done(build(folder, 0));
    assert_eq!(output.status.code(), Some(2));
    assert_eq!(snapshot(&folder.join("out")), before);
    assert_eq!(entries(folder), Vec::<PathBuf>::new());
    let printed = String::from_utf8_lossy(&output.stdout);
    assert!(printed.starts_with("nothing was written: "), "{printed}");
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn a_folder_or_a_read_only_file_in_the_way_refuses_all() {
    let folder = project();
    fs::create_dir(folder.path().join("out/lamp.net")).expect("it is made");
    assert!(refused(folder.path()).contains("out/lamp.net: it is a folder"));
    fs::remove_dir(folder.path().join("out/lamp.net")).expect("it is removed");
    let json = folder.path().join("out/lamp.json");
    fs::write(&json, "mine\n").expect("it is written");
    let mut permissions = fs::metadata(&json).expect("it is there").permissions();
    permissions.set_readonly(true);
    fs::set_permissions(&json, permissions).expect("it is protected");
    assert!(refused(folder.path()).contains("out/lamp.json: it is read-only"));
}

#[cfg(unix)]
#[test]
fn links_in_the_folder_are_refused_and_links_that_the_user_names_are_followed() {
    use std::os::unix::fs::symlink;
    let folder = project();
    let at = |name: &str| folder.path().join(name);
    fs::write(at("elsewhere"), "mine\n").expect("it is written");
    symlink(at("elsewhere"), at("out/lamp.net")).expect("a link");
    assert!(refused(folder.path()).contains("out/lamp.net: it is a symbolic link"));
    fs::remove_file(at("out/lamp.net")).expect("it is removed");
    fs::create_dir(at("away")).expect("it is made");
    symlink(at("away"), at("out/lamp-cmake")).expect("a link");
    assert!(refused(folder.path()).contains("out/lamp-cmake is a symbolic link"));
    fs::remove_file(at("out/lamp-cmake")).expect("it is removed");
    // A link to the folder itself, and one to a file by name.
    fs::rename(at("out"), at("real")).expect("it is moved");
    symlink(at("real"), at("out")).expect("a link");
    assert!(done(build(folder.path(), 0)).status.success());
    assert!(at("real/lamp.net").is_file() && at("out").is_symlink());
    symlink(at("elsewhere"), at("named.net")).expect("a link");
    let arguments = ["convert", "0/lamp.graf", "named.net"];
    assert!(done(grafsynth(folder.path(), &arguments)).status.success());
    assert!(at("named.net").is_symlink());
    assert!(fs::read_to_string(at("elsewhere")).expect("it is there").starts_with("net lamp"));
}

#[test]
fn a_build_does_not_replace_what_it_reads() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    assert!(done(build(project().path(), 0)).status.success());
    let net = "net lamp\n";
    fs::write(folder.path().join("lamp.graf"), VERSIONS[0]).expect("it is written");
    let convert = ["convert", "lamp.graf", "lamp.net"];
    assert!(done(grafsynth(folder.path(), &convert)).status.success());
    let before = fs::read_to_string(folder.path().join("lamp.net")).expect("it is there");
    assert!(before.starts_with(net));
    let output = done(grafsynth(folder.path(), &["build", "lamp.net", "--target", "net"]));
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("the build reads it"));
    assert_eq!(fs::read_to_string(folder.path().join("lamp.net")).expect("it is there"), before);
}

/// A journal of a write in the folder that contains the entry.
fn journal(entry: &Path, files: &str) -> String {
    #[cfg(unix)]
    let (device, inode) = {
        use std::os::unix::fs::MetadataExt as _;
        let data = fs::metadata(entry).expect("it is there");
        (data.dev(), data.ino())
    };
    #[cfg(not(unix))]
    let (device, inode) = (0, 0);
    format!(
        "{{\"place\":{{\"device\":{device},\"inode\":{inode}}},\"folders\":[],\"files\":[{files}]}}"
    )
}

/// A journal that came with somebody's files does not replace any of them: it was begun in another folder.
#[cfg(unix)]
#[test]
fn a_journal_of_another_folder_completes_nothing() {
    let folder = project();
    let entry = folder.path().join("0/.grafsynth-build");
    let file = "{\"name\":\"Makefile\",\"replaces\":true,\"keep_existing\":false}";
    let lamp = fs::read_to_string(folder.path().join("0/lamp.graf")).expect("it is there");
    let without = format!("{{\"folders\":[],\"files\":[{file}]}}");
    for text in [without, journal(folder.path(), file)] {
        fs::create_dir(&entry).expect("it is made");
        fs::write(folder.path().join("0/Makefile"), "mine\n").expect("it is written");
        fs::write(entry.join("0"), "theirs\n").expect("it is written");
        fs::write(entry.join("journal"), &text).expect("it is written");
        let output = done(grafsynth(folder.path(), &["check", "0/lamp.graf"]));
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(said.contains("it was started in another folder"), "{said}");
        let now = fs::read_to_string(folder.path().join("0/Makefile")).expect("it is there");
        assert_eq!((now.as_str(), entry.exists()), ("mine\n", false));
    }
    assert_eq!(fs::read_to_string(folder.path().join("0/lamp.graf")).expect("it is there"), lamp);
}

/// A journal affects only its own folder.
#[test]
fn a_foreign_journal_stays_in_its_folder() {
    let folder = project();
    let entry = folder.path().join("out/.grafsynth-build");
    fs::write(folder.path().join("elsewhere"), "mine\n").expect("it is written");
    for (name, left) in
        [("../elsewhere", "mine\n"), ("a/../../elsewhere", "mine\n"), ("x", "mine\n")]
    {
        fs::create_dir(&entry).expect("it is made");
        fs::write(entry.join("0"), "theirs\n").expect("it is written");
        let file = format!("{{\"name\":\"{name}\",\"replaces\":true,\"keep_existing\":false}}");
        fs::write(entry.join("journal"), journal(&entry, &file)).expect("it is written");
        assert!(done(build(folder.path(), 0)).status.success(), "{name}");
        assert!(!entry.exists(), "{name}");
        let now = fs::read_to_string(folder.path().join("elsewhere")).expect("it is there");
        assert_eq!(now, left, "{name}");
    }
    assert!(folder.path().join("out/x").is_file(), "a sound journal is completed");
}

/// A search for charts in a folder also finds the files of a write that was killed before its renames.
#[test]
fn a_folder_that_is_looked_into_is_completed_first() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = |name: &str| folder.path().join("charts").join(name);
    fs::create_dir_all(at(".grafsynth-build")).expect("it is made");
    let net = "net lamp\npart lamp level 1\nstep s in lamp initial\n";
    fs::write(at(".grafsynth-build/0"), net).expect("it is written");
    let file = "{\"name\":\"lamp.net\",\"replaces\":false,\"keep_existing\":false}";
    let journal = journal(&at(".grafsynth-build"), file);
    fs::write(at(".grafsynth-build/journal"), journal).expect("it is written");
    let output = done(grafsynth(folder.path(), &["check", "charts"]));
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{said}");
    assert_eq!(fs::read_to_string(at("lamp.net")).expect("it is there"), net);
    assert!(!at(".grafsynth-build").exists());
}

/// A write that was killed after some renames and can no longer be completed is undone: the old files are restored.
#[test]
fn a_write_that_cannot_be_completed_is_undone() {
    let folder = project();
    let at = |name: &str| folder.path().join("out").join(name);
    fs::create_dir(at(".grafsynth-build")).expect("it is made");
    // The first was renamed into place, the second is a new file there, the third collides with a folder.
    fs::write(at("a.txt"), "new\n").expect("it is written");
    fs::write(at(".grafsynth-build/old-0"), "old\n").expect("it is written");
    fs::write(at("b.txt"), "new\n").expect("it is written");
    fs::write(at(".grafsynth-build/2"), "new\n").expect("it is written");
    fs::create_dir(at("c.txt")).expect("it is made");
    let file = |name: &str, replaces: bool| {
        format!("{{\"name\":\"{name}\",\"replaces\":{replaces},\"keep_existing\":false}}")
    };
    let files = [file("a.txt", true), file("b.txt", false), file("c.txt", false)].join(",");
    let journal = journal(&at(".grafsynth-build"), &files);
    fs::write(at(".grafsynth-build/journal"), journal).expect("it is written");
    assert!(done(build(folder.path(), 0)).status.success());
    assert_eq!(fs::read_to_string(at("a.txt")).expect("it is there"), "old\n");
    assert!(!at("b.txt").exists() && at("c.txt").is_dir() && at("lamp.net").is_file());
    assert_eq!(entries(folder.path()), Vec::<PathBuf>::new());
}

/// Lost standard output is an error; a closed pipe is not.
#[cfg(target_os = "linux")]
#[test]
fn a_lost_output_is_exit_2() {
    let folder = project();
    for arguments in [&["check", "0/lamp.graf"][..], &["--help"], &["man"], &["explain"]] {
        let full = fs::OpenOptions::new().write(true).open("/dev/full").expect("Linux has it");
        let mut command = grafsynth(folder.path(), arguments);
        let output = command.stdout(full).output().expect("grafsynth starts");
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(said.contains("cannot write to standard output: No space left"), "{said}");
    }
    let mut child = grafsynth(folder.path(), &["explain"]).spawn().expect("grafsynth starts");
    drop(child.stdout.take());
    assert_eq!(child.wait().expect("a child").code(), Some(0));
    let output =
        done(grafsynth(folder.path(), &["convert", "0/lamp.graf", "/dev/full", "--to", "net"]));
    assert_eq!(output.status.code(), Some(2));
    assert!(Path::new("/dev/full").exists());
}

/// `convert` of C writes the functions that stay C once; after that the file belongs to the user.
#[test]
fn converting_c_again_keeps_the_users_functions() {
    let cases = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/cases/c");
    let folder = tempfile::tempdir().unwrap();
    fs::copy(cases.join("library.c"), folder.path().join("library.c")).unwrap();
    let convert = || done(grafsynth(folder.path(), &["convert", "library.c", "made.graf"]));
    convert();
    let path = folder.path().join("made_user.c");
    assert!(path.exists());
    fs::write(&path, "/* mine */\n").unwrap();
    let said = convert();
    assert_eq!(fs::read_to_string(&path).unwrap(), "/* mine */\n");
    assert!(String::from_utf8_lossy(&said.stderr).contains("exists and is kept"), "{said:?}");
}
