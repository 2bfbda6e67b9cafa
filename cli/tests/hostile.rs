//! Runs every verb on damaged files of every kind that it reads. Each run must end within 10 s of CPU time (60 s without optimisation) and 2 GB, without a
//! panic or an abort.
//!
//! Seeds are the cases and examples of this project and, if `GRAFSYNTH_CORPUS` names a folder with files by others, those too.

#![cfg(unix)]
#![allow(clippy::disallowed_methods, reason = "tests read files and start the program")]
#![allow(clippy::print_stdout, reason = "tests report what they skip")]

use grafsynth_ir::random::Random;
use std::collections::BTreeMap;
use std::fs;
use std::os::unix::process::ExitStatusExt as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

/// The limit of the address space in kibibytes.
const MEMORY: u64 = 2 << 20;
/// The limit of CPU time in seconds. An unoptimised program gets more time.
const TIME: u64 = if cfg!(debug_assertions) { 60 } else { 10 };
/// The maximum size of a seed in bytes.
const SEED: u64 = 64 << 10;

/// The commands that read charts. `{}` is the damaged file, `{seed}` another one of its kind, `{out}` a folder.
const CHART: [&str; 9] = [
    "check {}",
    "check {} --certify -",
    "sim {} --random 50",
    "build {} -t c,json,net -o {out}",
    "build {} -t verilog,palasm,cupl,galasm,blif --no-proof -o {out}",
    "build {} -t jedec --report -o {out}",
    "convert {} - --to net",
    "convert {} - --to graf",
    "diff {} {seed} --random 50",
];
const LOGIC: [&str; 7] = [
    "check {}",
    "sim {} --random 50",
    "build {} -t jedec -o {out}",
    "build {} -t jedec --refit --device gal22v10 -o {out}",
    "build {} -t verilog,palasm -o {out}",
    "convert {} - --to blif",
    "compare {} {seed} --random 50",
];

/// The kinds of files: the extensions of seeds, and the commands that read them.
fn kinds() -> Vec<(&'static str, Vec<&'static str>, Vec<String>)> {
    let texts = |all: &[&str]| all.iter().map(|text| (*text).to_owned()).collect::<Vec<String>>();
    let with = |more: &[&str]| {
        CHART.iter().chain(more).map(|text| (*text).to_owned()).collect::<Vec<String>>()
    };
    vec![
        (
            "graf",
            vec!["graf"],
            with(&[
                "fmt --check {}",
                "compare {} --random 20 --engines equations,palasm,netlist,jedec",
            ]),
        ),
        ("rules", vec!["rules"], with(&["fmt --check {}", "convert {} - --to rules"])),
        ("scxml", vec!["scxml"], with(&["convert {} - --to scxml"])),
        ("st", vec!["st"], with(&["convert {} - --to st"])),
        ("xml", vec!["xml"], with(&["convert {} - --to st"])),
        ("c", vec!["c"], with(&["check {} --fuse --group comments"])),
        ("kiss2", vec!["kiss2"], with(&["convert {} - --to kiss2"])),
        ("net", vec!["net"], with(&["compare {} --random 20 --engines equations,blif"])),
        ("pld", vec!["pld"], texts(&LOGIC)),
        ("pds", vec!["pds"], texts(&LOGIC)),
        ("v", vec!["v"], texts(&LOGIC)),
        ("blif", vec!["blif"], texts(&LOGIC)),
        ("jed", vec!["jed"], texts(&LOGIC)),
        ("pla", vec!["pla"], {
            let mut all = texts(&LOGIC);
            all.extend(texts(&["minimise {} -o -", "minimise {} --per-output --phase --budget 2"]));
            all
        }),
        (
            "csv",
            vec!["csv"],
            texts(&[
                "sim {truck} --stimulus {}",
                "compare {truck} --stimulus {} --engines equations",
                "build {truck} -t verilog --stimulus {} -o {out}",
            ]),
        ),
        (
            "board",
            vec!["board"],
            texts(&["check {truck} --board {}", "build {truck} -t jedec --board {} -o {out}"]),
        ),
        ("j2", vec!["j2"], texts(&["build {truck} -t template --template {} -o {out}"])),
        ("state", vec!["state"], texts(&["sim {truck} --random 20 --restore {}"])),
        ("ring", vec!["ring"], texts(&["trace {} --chart {truck}"])),
    ]
}

/// A seed with one to four edits: bits, cuts, repetitions, pieces of other files, brackets, huge and odd numbers, words swapped.
fn damaged(seeds: &[Vec<u8>], random: &mut Random) -> Vec<u8> {
    let mut bytes = seeds[random.below(seeds.len())].clone();
    // Most files stay similar to valid ones, so that the parser accepts many of them.
    let n_edits = if random.below(3) == 0 { 1 + random.below(4) } else { 1 };
    for _ in 0..n_edits {
        let from = random.below(bytes.len() + 1);
        let to = (from + random.below(40)).min(bytes.len());
        match random.below(10) {
            0 => {
                if let Some(byte) = bytes.get_mut(from) {
                    *byte ^= 1 << random.below(8);
                }
            }
            1 => drop(bytes.drain(from..to)),
            2 => {
                let many = if random.below(8) == 0 { 200 } else { 3 };
                let piece = bytes[from..to].repeat(1 + random.below(many));
                bytes.splice(to..to, piece);
            }
            3 => {
                let other = &seeds[random.below(seeds.len())];
                let at = random.below(other.len() + 1);
                let end = (at + random.below(400)).min(other.len());
                bytes.splice(from..to, other[at..end].iter().copied());
            }
            4 => {
                let sign = b"(){}[]/*;:\"'#`-<>&|=,.\n\0"[random.below(24)];
                let many = if random.below(4) == 0 { random.below(3_000) } else { 1 };
                bytes.splice(from..from, vec![sign; many]);
            }
            5 => bytes.truncate(from),
            _ => {
                // Replaces the next number by another one.
                let digits = |byte: &u8| byte.is_ascii_digit();
                let Some(start) = bytes[from..].iter().position(digits).map(|at| from + at) else {
                    continue;
                };
                let end = bytes[start..].iter().position(|byte| !digits(byte));
                let end = end.map_or(bytes.len(), |at| start + at);
                let numbers = [
                    "0",
                    "1",
                    "-1",
                    "31",
                    "32",
                    "63",
                    "64",
                    "65",
                    "255",
                    "256",
                    "65535",
                    "65536",
                    "99999",
                    "2147483647",
                    "2147483648",
                    "4294967295",
                    "4294967296",
                    "9223372036854775807",
                    "18446744073709551616",
                    "340282366920938463463374607431768211456",
                    "1e400",
                    "0.1",
                ];
                let number = numbers[random.below(numbers.len())];
                bytes.splice(start..end, number.bytes());
            }
        }
    }
    bytes.truncate(1 << 20);
    bytes
}

fn collect(folder: &Path, all: &mut BTreeMap<String, Vec<Vec<u8>>>) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    let mut paths: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    paths.sort();
    for path in paths {
        if path.is_dir() {
            collect(&path, all);
        } else if let Some(extension) = path.extension().and_then(|it| it.to_str())
            && path.metadata().is_ok_and(|data| data.len() <= SEED)
        {
            let bytes = fs::read(&path).expect("a seed can be read");
            all.entry(extension.to_owned()).or_default().push(bytes);
        }
    }
}

/// Valid files of each kind. If a kind has no files, the program itself makes some.
fn seeds(root: &Path, work: &Path) -> BTreeMap<String, Vec<Vec<u8>>> {
    let mut all = BTreeMap::new();
    for folder in ["tests/cases", "tests/scxml", "tests/c", "examples", "cli/templates"] {
        collect(&root.join(folder), &mut all);
    }
    match std::env::var_os("GRAFSYNTH_CORPUS") {
        Some(corpus) => collect(Path::new(&corpus), &mut all),
        None => println!("skipped: files of other people (GRAFSYNTH_CORPUS names no folder)"),
    }
    let truck = root.join("examples/truck/truck.graf").display().to_string();
    let made = [
        ["build", &truck, "-t", "net,palasm,verilog,blif,jedec,cupl", "-o", "made"].to_vec(),
        ["sim", &truck, "--random", "20", "--save", "made/truck.state"].to_vec(),
    ];
    for arguments in made {
        let output = Command::new(env!("CARGO_BIN_EXE_grafsynth"))
            .args(&arguments)
            .current_dir(work)
            .output()
            .expect("grafsynth starts");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
    collect(&work.join("made"), &mut all);
    all.insert("ring".to_owned(), vec![(0..64).collect(), b"00 01 02 03 ff 10 00 00\n".to_vec()]);
    all
}

#[test]
fn damaged_files_are_answered() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").canonicalize().expect("the root");
    let work = tempfile::tempdir().expect("a temporary folder");
    let seeds = seeds(&root, work.path());
    let kinds = kinds();
    let few = 4;
    let each = match std::env::var("GRAFSYNTH_DEEP").ok().and_then(|part| part.parse::<u64>().ok())
    {
        None | Some(0) => few,
        Some(part) => (6_000_u64.div_ceil(kinds.len() as u64)).div_ceil(part).max(few),
    };
    let jobs: Vec<(usize, u64)> =
        (0..kinds.len()).flat_map(|kind| (0..each).map(move |round| (kind, round))).collect();
    let (next, fallen) = (AtomicU64::new(0), Mutex::new(Vec::new()));
    let counts = Mutex::new(BTreeMap::<(&str, i32), u64>::new());
    std::thread::scope(|scope| {
        for _ in 0..std::thread::available_parallelism().map_or(1, usize::from) {
            scope.spawn(|| {
                loop {
                    let at =
                        usize::try_from(next.fetch_add(1, Ordering::Relaxed)).unwrap_or(usize::MAX);
                    let Some((kind, round)) = jobs.get(at) else { return };
                    let (name, extensions, verbs) = &kinds[*kind];
                    let texts: Vec<Vec<u8>> = extensions
                        .iter()
                        .filter_map(|it| seeds.get(*it))
                        .flatten()
                        .cloned()
                        .collect();
                    assert!(!texts.is_empty(), "no seed for {name}");
                    let mut random = Random::new(round * 1_000 + *kind as u64 + 1);
                    let case = Case { root: &root, name, texts: &texts, verbs };
                    match case.run(&mut random) {
                        Ok(code) => {
                            *counts.lock().expect("a count").entry((name, code)).or_default() += 1
                        }
                        Err(why) => {
                            fallen.lock().expect("a list").push(format!("{name} {round}: {why}"))
                        }
                    }
                }
            });
        }
    });
    println!("{} damaged files; exit codes: {:?}", jobs.len(), counts.lock().expect("counts"));
    let fallen = fallen.into_inner().expect("a list");
    assert!(fallen.is_empty(), "{} of {}:\n{}", fallen.len(), jobs.len(), fallen.join("\n"));
}

struct Case<'a> {
    root: &'a Path,
    name: &'a str,
    texts: &'a [Vec<u8>],
    verbs: &'a [String],
}

impl Case<'_> {
    /// The exit code, or the error, after which the file is kept.
    fn run(&self, random: &mut Random) -> Result<i32, String> {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let at = |name: &str| folder.path().join(name).display().to_string();
        let text = damaged(self.texts, random);
        let (file, seed) = (format!("damaged.{}", self.name), format!("seed.{}", self.name));
        fs::write(at(&file), &text).expect("it is written");
        fs::write(at(&seed), &self.texts[random.below(self.texts.len())]).expect("it is written");
        let verb = &self.verbs[random.below(self.verbs.len())];
        let truck = self.root.join("examples/truck/truck.graf").display().to_string();
        let arguments: Vec<String> = verb
            .split(' ')
            .map(|word| match word {
                "{}" => at(&file),
                "{seed}" => at(&seed),
                "{out}" => at("out"),
                "{truck}" => truck.clone(),
                other => other.to_owned(),
            })
            .collect();
        let limited = format!("ulimit -v {MEMORY} && ulimit -t {TIME} && exec \"$0\" \"$@\"");
        let output = Command::new("sh")
            .args(["-c", &limited, env!("CARGO_BIN_EXE_grafsynth")])
            .args(&arguments)
            .current_dir(folder.path())
            .stdin(Stdio::null())
            .env("NO_COLOR", "1")
            .output()
            .expect("a shell starts");
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        let code = output.status.code();
        let is_answered = code.is_some_and(|code| (0..=4).contains(&code));
        let what = if said.contains("panicked at") || said.contains("tool itself") {
            "a panic"
        } else if !is_answered {
            "no answer"
        } else {
            return Ok(code.unwrap_or_default());
        };
        let kept =
            std::env::temp_dir().join(format!("grafsynth-{}-{:016x}", self.name, random.bits()));
        let kept = kept.with_extension(self.name);
        fs::write(&kept, &text).expect("it is kept");
        let signal = output.status.signal();
        let line: Vec<&str> = said
            .lines()
            .filter(|line| line.contains("panicked") || line.contains("alloc"))
            .collect();
        Err(format!(
            "{what}, {code:?} {signal:?}: {verb} of {}: {}",
            kept.display(),
            line.join(" | ")
        ))
    }
}
