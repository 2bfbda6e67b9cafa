//! Machine-readable reports: JSON lines follow docs/report.schema.json, SARIF follows the schema of the standard, and both contain what people see.

#![allow(clippy::disallowed_methods, reason = "tests read files and start the program")]
#![allow(clippy::print_stdout, reason = "tests report what they skip")]

use boon::{Compiler, SchemaIndex, Schemas};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

const CHART: &str = "chart lamp {
    # A name with a blank and a percent sign is in the path.
    conflict priority-age
    input a, b
    input n: int 0..100000
    output Q, R
    var x: int 0..200000
    initial step off
    step on { Q }
    step late { R }
    off -> on when a do { x := n + 1 }
    off -> late when a
    on -> off when b
    late -> off when b
    req \"R-1\" assert never (on.active and off.active)
    assert never on.active
    assert never x = 177777
}
";

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let put = |name: &str, text: &str| {
        fs::write(folder.path().join(name), text).expect("it is written");
    };
    put("a lamp 50%.graf", CHART);
    put("other.graf", &CHART.replace("n + 1", "n + 2"));
    put(
        "bad.graf",
        "chart lamp {\n    input a\n    input a\n    initial step s\n    s -> t when b\n}\n",
    );
    put(
        "good.graf",
        "chart good { input a output Q initial step s { Q if a } step t s -> t when a t -> s }\n",
    );
    put(
        "turns.graf",
        "chart turns { conflict priority-age input r output g1, g2 initial step free step c1 { g1 } step c2 { g2 } free -> c1 when r free -> c2 when r c1 -> free c2 -> free }\n",
    );
    put("trace.csv", "scan,a,steps,Q\n0,0,s,0\n1,1,s,0\n");
    folder
}

fn grafsynth(folder: &Path, arguments: &[&str], format: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_grafsynth"))
        .args(arguments)
        .args(["--message-format", format])
        .current_dir(folder)
        .output()
        .expect("grafsynth starts")
}

/// Verbs in situations that produce each kind of line.
const RUNS: [&[&str]; 14] = [
    &["check", "a lamp 50%.graf"],
    &["check", "a lamp 50%.graf", "bad.graf", "missing.graf"],
    &["check", "bad.graf", "--max-diagnostics", "1"],
    &["check", "good.graf", "--proof-limit", "1"],
    &["build", "good.graf", "--target", "verilog,json,jedec", "-o", "out"],
    &["build", "good.graf", "--target", "pascal", "-o", "out"],
    &["compare", "a lamp 50%.graf", "other.graf"],
    &["compare", "a lamp 50%.graf", "other.graf", "--trace", "other.csv"],
    &["compare", "good.graf", "good.graf"],
    &["compare", "good.graf", "--engines", "ir,netlist"],
    &["diff", "a lamp 50%.graf", "other.graf"],
    &["sim", "good.graf", "--stimulus", "trace.csv", "--trace", "out.csv"],
    &["fmt", "good.graf"],
    &["check", "turns.graf"],
];

fn validate(schemas: &Schemas, schema: SchemaIndex, value: &Value, of: &str) {
    if let Err(why) = schemas.validate(value, schema) {
        panic!("{of}: {why}\n{value:#}");
    }
}

#[test]
fn json_lines_keep_to_their_schema() {
    let folder = folder();
    let schema: Value = serde_json::from_str(include_str!("../../docs/report.schema.json"))
        .expect("the schema is JSON");
    let (mut schemas, mut compiler) = (Schemas::new(), Compiler::new());
    compiler.add_resource("report.json", schema).expect("a resource");
    let schema = compiler.compile("report.json", &mut schemas).expect("the schema is one");
    let mut seen = Vec::new();
    for arguments in RUNS {
        let output = grafsynth(folder.path(), arguments, "json");
        let text = String::from_utf8(output.stdout).expect("UTF-8");
        let lines: Vec<Value> = text
            .lines()
            .map(|line| serde_json::from_str(line).unwrap_or_else(|why| panic!("{why}: {line}")))
            .collect();
        for line in &lines {
            validate(&schemas, schema, line, &arguments.join(" "));
            seen.push(format!("{} {} {}", line["kind"], line["about"], line["status"]));
        }
        let last = lines.last().expect("a last line");
        assert_eq!(last["kind"], "end", "{arguments:?}");
        assert_eq!(last["exit"].as_i64(), output.status.code().map(i64::from), "{arguments:?}");
        assert_eq!(lines[0]["kind"], "start", "{arguments:?}");
    }
    for wanted in [
        r#""finding" null null"#,
        r#""hidden" null null"#,
        r#""error" null null"#,
        r#""design" null null"#,
        r#""answer" "assert" "proved""#,
        r#""answer" "assert" "refuted""#,
        r#""answer" "lint" "done""#,
        r#""answer" "lint" "open""#,
        r#""answer" "bound" "proved""#,
        r#""answer" "fact" "done""#,
        r#""answer" "output" "proved""#,
        r#""answer" "output" "not-checked""#,
        r#""answer" "equality" "proved""#,
        r#""answer" "equality" "refuted""#,
        r#""answer" "equality" "done""#,
        r#""answer" "part" "refuted""#,
        r#""answer" "replay" "refuted""#,
    ] {
        assert!(seen.iter().any(|line| line == wanted), "no line is {wanted}: {seen:#?}");
    }
}

#[test]
fn what_people_are_told_stands_in_the_json() {
    let folder = folder();
    let people = grafsynth(folder.path(), &["check", "a lamp 50%.graf"], "human");
    let people = String::from_utf8_lossy(&people.stdout).into_owned();
    let machines = grafsynth(folder.path(), &["check", "a lamp 50%.graf"], "json");
    let machines = String::from_utf8_lossy(&machines.stdout).into_owned();
    for word in ["proved", "refuted"] {
        let told = people.lines().filter(|line| line.starts_with(word)).count();
        let asserts = machines
            .lines()
            .filter_map(|line| serde_json::from_str::<Value>(line).ok())
            .filter(|line| line["about"] == "assert" && line["status"] == word)
            .count();
        assert_eq!(told, asserts, "{word}:\n{people}\n{machines}");
        assert!(told > 0, "{people}");
    }
}

/// The schema of SARIF 2.1.0, from a crate that is not otherwise used.
fn sarif_schema() -> Option<PathBuf> {
    let metadata = Command::new(env!("CARGO"))
        .args(["metadata", "--format-version", "1"])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .ok()?;
    let metadata: Value = serde_json::from_slice(&metadata.stdout).ok()?;
    let package =
        metadata["packages"].as_array()?.iter().find(|package| package["name"] == "serde-sarif")?;
    let folder = Path::new(package["manifest_path"].as_str()?).parent()?.to_path_buf();
    let schema = folder.join("src/schema.json");
    schema.is_file().then_some(schema)
}

#[test]
fn sarif_keeps_to_the_standard() {
    let Some(path) = sarif_schema() else {
        assert!(
            std::env::var_os("CI").is_none(),
            "the schema of SARIF is missing, and CI must have it"
        );
        println!("skipped: the schema of SARIF could not be had");
        return;
    };
    let folder = folder();
    let schema = fs::read_to_string(path).expect("the schema");
    let schema: Value = serde_json::from_str(&schema).expect("the schema is JSON");
    let (mut schemas, mut compiler) = (Schemas::new(), Compiler::new());
    compiler.add_resource("sarif.json", schema).expect("a resource");
    let schema = compiler.compile("sarif.json", &mut schemas).expect("the schema is one");
    let mut kinds = Vec::new();
    for arguments in RUNS {
        let output = grafsynth(folder.path(), arguments, "sarif");
        let document: Value = serde_json::from_slice(&output.stdout).expect("one document");
        validate(&schemas, schema, &document, &arguments.join(" "));
        let run = &document["runs"][0];
        let code = run["invocations"][0]["exitCode"].as_i64();
        assert_eq!(code, output.status.code().map(i64::from), "{arguments:?}");
        for result in run["results"].as_array().expect("results") {
            kinds.push(result["kind"].as_str().unwrap_or("fail").to_owned());
            let uri = &result["locations"][0]["physicalLocation"]["artifactLocation"]["uri"];
            let uri = uri.as_str().unwrap_or_default();
            assert!(!uri.contains(' ') && !uri.contains("50%."), "{uri}");
        }
    }
    for kind in ["pass", "fail", "open", "notApplicable", "informational"] {
        assert!(kinds.iter().any(|seen| seen == kind), "no result is of the kind {kind}");
    }
}
