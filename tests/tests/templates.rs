//! The templates of `examples/templates`, rendered for random nets and run in their languages: the trace equals the simulator's.
//!
//! JavaScript runs in node, Python in micropython or else python3. A missing tool is skipped with a message; if `CI` is set in the environment, it is a
//! failure.

#![allow(clippy::disallowed_methods, reason = "tests write files for tools")]
#![allow(clippy::print_stdout, reason = "tests report what they skip")]

use grafsynth_backend_template::{Template, json, render, text};
use grafsynth_driver::run::net_trace;
use grafsynth_engines::tools;
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::net::{Driver, InputKind, Net, VarOrigin};
use grafsynth_ir::{FileId, Valid};
use grafsynth_sim::{Stimulus, Trace};
use grafsynth_tests::random_net::{Features, random_net};
use grafsynth_tests::{chart, readable, rounds};
use serde_json::{Value, json as object};
use std::fmt::Write as _;
use std::path::PathBuf;
use std::time::Duration;

const PYTHON: &str = include_str!("../../examples/templates/micropython.py.j2");
const JAVASCRIPT: &str = include_str!("../../examples/templates/javascript.mjs.j2");
const LIMIT: Duration = Duration::from_secs(120);
const ROWS: usize = 60;

/// A language: its template, its interpreter, and a program that runs charts on rows and prints traces.
struct Language {
    template: &'static str,
    path: &'static str,
    program: PathBuf,
    main: &'static str,
    bench: &'static str,
}

/// The available Python, if any. The template is made for Micropython.
fn python() -> Option<Language> {
    let program = tools::find(&["micropython", "python3"]);
    if program.is_none() {
        assert!(std::env::var_os("CI").is_none(), "python3 is missing, and CI must have it");
        println!("skipped: neither micropython nor python3 is here");
    }
    Some(Language {
        template: PYTHON,
        path: "micropython.py.j2",
        program: program?,
        main: "bench.py",
        bench: BENCH_PYTHON,
    })
}

fn javascript() -> Option<Language> {
    let program = tools::find(&["node"]);
    if program.is_none() {
        assert!(std::env::var_os("CI").is_none(), "node is missing, and CI must have it");
        println!("skipped: node is not here");
    }
    Some(Language {
        template: JAVASCRIPT,
        path: "javascript.mjs.j2",
        program: program?,
        main: "bench.mjs",
        bench: BENCH_JAVASCRIPT,
    })
}

/// Runs the jobs in `jobs.json`, each a module and its rows, and prints a trace for each after a line with its number.
const BENCH_PYTHON: &str = r##"
import json
class Library:
    pass
def wrap(library, job):
    def condition(name):
        return lambda: library.row[name]
    def action(name):
        return lambda *args: library.calls[name].append(args)
    for at, name in job["conditions"]:
        setattr(library, at, condition(name))
    for at, name in job["actions"]:
        setattr(library, at, action(name))
def cell(value):
    return str(int(value))
def row(chart, library, job, scan, dt, inputs):
    cells = [str(scan), str(dt)] + [cell(inputs.get(name, zero)) for name, zero in job["inputs"]]
    cells.append(" ".join(chart.steps()))
    for name, kind in job["outputs"]:
        if kind == "value":
            cells.append(cell(chart.outputs[name]))
        elif kind == "count":
            cells.append(str(len(library.calls[name])))
        else:
            cells.append(";".join([":".join([cell(v) for v in call]) for call in library.calls[name]]))
    held = chart.vars()
    for name in job["vars"]:
        value = held[name]
        cells += [cell(v) for v in value] if isinstance(value, list) else [cell(value)]
    if job["fault"]:
        cells.append(cell(chart.fault))
    print(",".join(cells))
for job in json.load(open("jobs.json")):
    print("# " + str(job["number"]))
    library = Library()
    library.row = dict([(name, zero) for name, zero in job["inputs"]])
    library.calls = dict([(name, []) for _, name in job["actions"]])
    wrap(library, job)
    module = __import__(job["module"])
    chart = getattr(module, job["class"])(library)
    row(chart, library, job, 0, 0, library.row)
    scan = 0
    for line in job["rows"]:
        scan += 1
        library.row = line["inputs"]
        for calls in library.calls.values():
            calls[:] = []
        chart.step(line["inputs"], line["dt"])
        row(chart, library, job, scan, line["dt"], line["inputs"])
"##;

const BENCH_JAVASCRIPT: &str = r##"
import { readFileSync } from "node:fs";
const lines = [];
for (const job of JSON.parse(readFileSync("jobs.json", "utf8"))) {
  lines.push("# " + job.number);
  const library = {};
  let now = Object.fromEntries(job.inputs);
  const calls = Object.fromEntries(job.actions.map(([, name]) => [name, []]));
  for (const [at, name] of job.conditions) library[at] = () => now[name];
  for (const [at, name] of job.actions) library[at] = (...args) => { calls[name].push(args); };
  const module = await import("./" + job.module + ".mjs");
  const chart = new module[job.class](library);
  const cell = (value) => String(Number(value));
  const row = (scan, dt, inputs) => {
    const cells = [scan, dt, ...job.inputs.map(([name, zero]) => cell(inputs[name] ?? zero)), chart.steps().join(" ")];
    for (const [name, kind] of job.outputs) {
      if (kind === "value") cells.push(cell(chart.outputs[name]));
      else if (kind === "count") cells.push(calls[name].length);
      else cells.push(calls[name].map((call) => call.map(cell).join(":")).join(";"));
    }
    const held = chart.vars();
    for (const name of job.vars) cells.push(...[held[name]].flat().map(cell));
    if (job.fault) cells.push(cell(chart.fault));
    lines.push(cells.join(","));
  };
  row(0, 0, now);
  job.rows.forEach((line, index) => {
    now = line.inputs;
    for (const name in calls) calls[name].length = 0;
    chart.step(line.inputs, line.dt);
    row(index + 1, line.dt, line.inputs);
  });
}
console.log(lines.join("\n"));
"##;

/// The data about a net and its stimulus that a bench needs.
fn job(number: usize, net: &Valid<Net>, tree: &Value, stimulus: &Stimulus) -> Value {
    let is_given = |kind: InputKind| kind != InputKind::InternalEvent;
    let inputs: Vec<_> = net.inputs.iter().filter(|(_, it)| is_given(it.kind)).collect();
    let rows: Vec<Value> = stimulus
        .rows()
        .map(|row| {
            let values =
                inputs.iter().map(|(id, it)| (it.name.text.clone(), object!(row.value(*id))));
            object!({ "dt": row.dt, "inputs": Value::Object(values.collect()) })
        })
        .collect();
    let ident = |list: &str, index: usize| tree[list][index]["ident"].clone();
    let outputs: Vec<Value> = net
        .outputs
        .values()
        .map(|output| {
            let kind = match &output.driver {
                Driver::Extern { params, .. } if params.is_empty() => "count",
                Driver::Extern { .. } => "calls",
                _ => "value",
            };
            object!([output.name.text, kind])
        })
        .collect();
    let class = tree["ident"].as_str().expect("an identifier");
    let (first, rest) = class.split_at(1);
    object!({
        "number": number,
        "module": format!("chart{number}"),
        "class": format!("{}{rest}Chart", first.to_uppercase()),
        "inputs": inputs.iter().map(|(_, it)| object!([it.name.text, it.ty.saturate(0)])).collect::<Vec<_>>(),
        "conditions": inputs.iter().filter(|(_, it)| it.kind == InputKind::Extern).map(|(id, it)| object!([ident("inputs", id.index()), it.name.text])).collect::<Vec<_>>(),
        "actions": net.outputs.iter().filter(|(_, it)| it.is_extern()).map(|(id, it)| object!([ident("outputs", id.index()), it.name.text])).collect::<Vec<_>>(),
        "outputs": outputs,
        "vars": net.vars.values().filter(|it| it.origin == VarOrigin::Declared).map(|it| it.name.text.clone()).collect::<Vec<_>>(),
        "fault": net.settings.evolution != grafsynth_ir::net::Evolution::Single,
        "rows": rows,
    })
}

fn rendered(language: &Language, tree: &Value) -> Result<String, Vec<Diagnostic>> {
    render(tree, &Template { file: FileId(0), path: language.path, text: language.template })
}

/// The trace of a net as a bench prints it: without the heading, and with undefined cells unchanged.
fn body(trace: &Trace) -> String {
    trace.to_csv().split_once('\n').map_or_else(String::new, |(_, rows)| rows.to_owned())
}

/// Runs all nets in one process, because starting a process takes longer than running a net.
fn check(language: &Language, nets: &[(u64, Valid<Net>)]) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let write = |name: &str, text: &str| {
        std::fs::write(folder.path().join(name), text).expect("it is written")
    };
    let extension = language.main.rsplit_once('.').expect("an extension").1;
    let (mut jobs, mut expected) = (Vec::new(), String::new());
    for (number, (seed, net)) in nets.iter().enumerate() {
        // Nets without a bounded program are rejected with a code, as in the C back end.
        let Ok(tree) = json(net) else { continue };
        let stimulus = Stimulus::random(net, ROWS, *seed, 3);
        let text = rendered(language, &tree)
            .unwrap_or_else(|found| panic!("seed {seed}: {found:#?}\n{}", readable(net)));
        write(&format!("chart{number}.{extension}"), &text);
        jobs.push(job(number, net, &tree, &stimulus));
        let _ = write!(expected, "# {number}\n{}", body(&net_trace(net, &stimulus)));
    }
    write("jobs.json", &object!(jobs).to_string());
    write(language.main, language.bench);
    let run = tools::run(&language.program, &[language.main], folder.path(), b"", LIMIT)
        .expect("it runs");
    let printed = String::from_utf8_lossy(&run.stdout);
    let differ = expected.lines().zip(printed.lines()).position(|(a, b)| a != b);
    if let Some(line) = differ {
        let number = expected.lines().take(line + 1).filter_map(|it| it.strip_prefix("# ")).last();
        let number: usize = number.and_then(|it| it.parse().ok()).expect("a number");
        let (seed, net) = &nets[number];
        panic!(
            "seed {seed}\nexpected {}\nprinted  {}\n{}",
            expected.lines().nth(line).unwrap_or_default(),
            printed.lines().nth(line).unwrap_or_default(),
            readable(net)
        );
    }
    assert!(run.is_success, "{}: {}", run.ending, run.stderr);
    assert_eq!(expected.lines().count(), printed.lines().count(), "{}", run.stderr);
}

fn nets(count: u64) -> Vec<(u64, Valid<Net>)> {
    let everything = Features { unspecified: false, assumptions: false, ..Features::everything() };
    (0..count).map(|seed| (seed, random_net(seed, &everything))).collect()
}

/// Extreme charts: wide numbers, signs of quotients, names that are keywords of the languages.
fn special() -> Vec<(u64, Valid<Net>)> {
    let wide = "chart wide {\n input a: int -2147483648..2147483647, b: int -2147483648..2147483647\n var p: int -2147483648..2147483647\n var q: int -2147483648..2147483647\n \
        initial step s\n s -> s when a <> b restart do { p := a * b / 65536; q := a * b mod 1000003 }\n}\n";
    let signs = "chart `class` {\n input a: int -9..9, b: int 1..4, `None`, `this`\n var q: int -20..20\n var r: int -20..20\n var n: int -20..20\n output `lambda`: int -3..3\n output `é.let`\n \
        initial step `if`\n step `await` { `é.let` }\n `if` -> `await` when `None` do { q := a / b; r := a mod b; n := -a; `lambda` := a * 3 }\n `await` -> `if` when `this` do { q := a / -b; r := a mod -b }\n}\n";
    let truck = include_str!("../../examples/truck/truck.graf");
    let oven = include_str!("../../examples/microwave/oven.graf");
    let filler = include_str!("../../examples/bottle-filler/filler.graf");
    [wide, signs, truck, oven, filler]
        .into_iter()
        .zip(1000..)
        .map(|(text, seed)| (seed, chart("chart.graf", text)))
        .collect()
}

#[test]
fn python_computes_what_the_chart_means() {
    let Some(language) = python() else { return };
    check(&language, &special());
    check(&language, &nets(rounds(60, 1000)));
}

#[test]
fn javascript_computes_what_the_chart_means() {
    let Some(language) = javascript() else { return };
    check(&language, &special());
    check(&language, &nets(rounds(60, 1000)));
}

/// JavaScript uses numbers if they are exact, and BigInt otherwise.
#[test]
fn javascript_takes_big_integers_only_where_it_must() {
    let render_one = |net: &Valid<Net>| {
        let tree = json(net).expect("it has a program");
        render(&tree, &Template { file: FileId(0), path: "javascript.mjs.j2", text: JAVASCRIPT })
            .expect("it is rendered")
    };
    let charts = special();
    assert!(render_one(&charts[0].1).contains("BigInt("));
    assert!(!render_one(&charts[1].1).contains("BigInt("));
}

#[test]
fn expressions_as_deep_as_a_chart_can_have_them_are_rendered() {
    let deep = format!("{}a{}", "if b then c else (".repeat(60), ")".repeat(60));
    let text = format!(
        "chart deep {{\n input a, b, c\n output x\n initial step s\n step t {{ x }}\n s -> t when {deep}\n t -> s when not a\n}}\n"
    );
    let net = chart("deep.graf", &text);
    for language in [python(), javascript()].into_iter().flatten() {
        check(&language, &[(1, net.clone())]);
    }
}

fn error_of(text: &str) -> Diagnostic {
    let net = chart("truck.graf", include_str!("../../examples/truck/truck.graf"));
    let tree = json(&net).expect("it has a program");
    render(&tree, &Template { file: FileId(3), path: "my.txt.j2", text })
        .expect_err("it has an error")
        .remove(0)
}

#[test]
fn errors_of_templates_have_a_place_and_a_reason() {
    let found = error_of("first\n{{ nothing.here }}\n");
    assert_eq!(found.code.id, "G0611");
    assert_eq!(found.labels[0].span.file, FileId(3));
    assert!(found.labels[0].span.start >= 6, "{found:?}");
    assert!(found.help.is_some());
    let found = error_of("{% for step in steps %}\nno end\n");
    assert_eq!(found.code.id, "G0611");
    let found = error_of("a\nb {{ refuse('no timers') }}\n");
    assert_eq!(
        (found.code.id, found.message.as_str()),
        ("G0612", "the template does not support this chart: no timers")
    );
    // Inside a macro, the innermost location counts.
    let found = error_of("{% macro m() %}\n{{ refuse('x') }}\n{% endmacro %}\n{{ m() }}\n");
    assert_eq!(found.code.id, "G0612");
    assert!((16..34).contains(&found.labels[0].span.start), "{found:?}");
}

#[test]
fn a_template_without_end_ends() {
    let found = error_of("{% macro m() %}{{ m() }}{% endmacro %}{{ m() }}");
    assert_eq!(found.code.id, "G0611", "{found:?}");
    let nested = "{% for a in range(9999) %}{% for b in range(9999) %}{% for c in range(9999) %}{% endfor %}{% endfor %}{% endfor %}";
    assert_eq!(error_of(nested).code.id, "G0613");
    let large = "{% for a in range(99999) %}{{ 'x' * 99999 }}{% endfor %}";
    assert_eq!(error_of(large).code.id, "G0613");
}

/// The JSON of a net follows the schema and always has the same bytes.
#[test]
fn the_json_keeps_to_its_schema() {
    let schema: Value =
        serde_json::from_str(include_str!("../../docs/net-json.schema.json")).expect("it is JSON");
    for (seed, net) in nets(rounds(12, 60)).into_iter().chain(special()) {
        let Ok(tree) = json(&net) else { continue };
        assert_eq!(text(&tree), text(&json(&net).expect("again")));
        let mut wrong = Vec::new();
        validate(&schema, &schema, &tree, "", &mut wrong);
        assert!(wrong.is_empty(), "seed {seed}: {wrong:#?}");
    }
}

/// Checks a value against the subset of JSON Schema that the schema uses: `type`, `const`, `enum`, `required`, `properties`, `additionalProperties`, `items`,
/// `oneOf`, `anyOf`, `$ref`.
fn validate(root: &Value, schema: &Value, value: &Value, path: &str, wrong: &mut Vec<String>) {
    let Some(rules) = schema.as_object() else { return };
    for (rule, wanted) in rules {
        match rule.as_str() {
            "$ref" => {
                let place = wanted
                    .as_str()
                    .and_then(|it| it.strip_prefix('#'))
                    .expect("a place in the schema");
                let target =
                    root.pointer(place).unwrap_or_else(|| panic!("{place} is not in the schema"));
                validate(root, target, value, path, wrong);
            }
            "type" => {
                let is = |name: &str| match name {
                    "object" => value.is_object(),
                    "array" => value.is_array(),
                    "string" => value.is_string(),
                    "boolean" => value.is_boolean(),
                    "integer" => value.is_i64() || value.is_u64(),
                    "null" => value.is_null(),
                    other => panic!("the schema has the type {other}"),
                };
                let names = wanted.as_array().cloned().unwrap_or_else(|| vec![wanted.clone()]);
                let holds = names.iter().any(|name| is(name.as_str().unwrap_or_default()));
                if !holds {
                    wrong.push(format!("{path}: {value} is not {wanted}"));
                }
            }
            "const" if wanted != value => wrong.push(format!("{path}: {value} is not {wanted}")),
            "enum" if !wanted.as_array().is_some_and(|all| all.contains(value)) => {
                wrong.push(format!("{path}: {value} is none of {wanted}"))
            }
            "required" => {
                for name in wanted.as_array().into_iter().flatten().filter_map(Value::as_str) {
                    if value.is_object() && value.get(name).is_none() {
                        wrong.push(format!("{path}: no {name}"));
                    }
                }
            }
            "properties" => {
                for (name, member) in value.as_object().into_iter().flatten() {
                    match wanted.get(name) {
                        Some(schema) => {
                            validate(root, schema, member, &format!("{path}/{name}"), wrong)
                        }
                        None if rules.get("additionalProperties") == Some(&Value::Bool(false)) => {
                            wrong.push(format!("{path}: {name} is not in the schema"))
                        }
                        None => {}
                    }
                }
            }
            "items" => {
                for (at, item) in value.as_array().into_iter().flatten().enumerate() {
                    validate(root, wanted, item, &format!("{path}/{at}"), wrong);
                }
            }
            "oneOf" | "anyOf" => {
                let matching = wanted.as_array().into_iter().flatten().filter(|schema| {
                    let mut found = Vec::new();
                    validate(root, schema, value, path, &mut found);
                    found.is_empty()
                });
                let count = matching.count();
                if count == 0 || (rule == "oneOf" && count > 1) {
                    wrong.push(format!("{path}: {value} matches {count} of {rule}"));
                }
            }
            "const"
            | "enum"
            | "additionalProperties"
            | "$schema"
            | "$id"
            | "$defs"
            | "title"
            | "description" => {}
            other => panic!("the schema uses {other}, which this test does not support"),
        }
    }
}
