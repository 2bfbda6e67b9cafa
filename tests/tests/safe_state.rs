//! `--safe-state` with corrupted memory: members of the instance are overwritten between two reactions, on this machine under the sanitizers and on
//! an AVR. The next reaction detects an impossible value, and the outputs are safe until the next `init`; a possible value raises no alarm, nor does
//! a run without corruption.
//!
//! The range of a member is taken from text that a user can read: the header's enumerators, the declared types, the proved components. Members
//! without such information (histories, queues, ages) must not raise an alarm for values that they had in the run.

#![allow(clippy::disallowed_methods, reason = "tests write files for tools")]
#![allow(clippy::print_stdout, reason = "tests report what they skip and what they counted")]

use grafsynth_backend_c::{Io, Options, Style};
use grafsynth_engines::{Availability, AvrEngine, Engine, c, tools};
use grafsynth_ir::Valid;
use grafsynth_ir::facts::Facts;
use grafsynth_ir::net::Net;
use grafsynth_tests::fleet::{self, Chart, Compiler};
use grafsynth_tests::random_net::random_net;
use grafsynth_tests::{chart, in_parallel, readable, rounds};
use itertools::Itertools as _;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;
use std::time::Duration;

const LIMIT: Duration = Duration::from_secs(120);

/// A line of a structure in a header.
#[derive(Debug, Clone)]
struct Field {
    ty: String,
    name: String,
    len: Option<u32>,
    is_bit: bool,
    note: String,
}

/// The members of `typedef struct { .. } NAME_WHAT;`.
fn fields(header: &str, what: &str) -> Vec<Field> {
    let end = format!("}} {what};");
    let Some(text) = header.split(&end).next().filter(|it| it.len() < header.len()) else {
        return Vec::new();
    };
    let start = text.rfind("typedef struct {").expect("a structure begins");
    let lines = text[start..].lines().skip(1).filter(|line| line.contains(';'));
    lines
        .map(|line| {
            let (code, note) = line.split_once(';').expect("a declaration");
            let (ty, name) = code.trim().split_once(' ').expect("type and name");
            let (name, is_bit) = match name.split_once(" : ") {
                Some((name, _)) => (name, true),
                None => (name, false),
            };
            let (name, len) = match name.split_once('[') {
                Some((name, len)) => (name, len.trim_end_matches(']').parse().ok()),
                None => (name, None),
            };
            let [ty, name, note] = [ty, name, note].map(str::to_owned);
            Field { ty, name, len, is_bit, note }
        })
        .collect()
}

/// For each state variable, the values of its enumerators.
fn states(header: &str) -> BTreeMap<String, (i64, i64)> {
    let mut all = BTreeMap::new();
    for text in header.split("enum { /* values of ").skip(1) {
        let (name, rest) = text.split_once(" */").expect("the comment ends");
        let body = rest.split('}').next().unwrap_or_default();
        let codes = body.lines().filter_map(|line| line.split_once(" = "));
        let last = codes.filter_map(|(_, code)| {
            let digits: String = code.chars().take_while(char::is_ascii_digit).collect();
            digits.parse::<i64>().ok()
        });
        let hi = last.max().unwrap_or(0);
        // A statechart counts from 1.
        let (name, lo) = match name.split_once(';') {
            Some((name, _)) => (name, 0),
            None => (name, i64::from(!body.contains(" = 0") && !header.contains("_NONE = 0"))),
        };
        all.insert(name.to_owned(), (lo, hi));
    }
    all
}

/// The program that runs a chart and corrupts its memory, for `n_rounds` rounds. `print` is its code for reporting numbers.
fn program(chart: &Chart, facts: &Facts, n_rounds: u64, print: &str) -> String {
    let net = &chart.net;
    let name = chart.options.prefix.clone().unwrap_or_else(|| net.name.text.clone());
    let upper = name.to_ascii_uppercase();
    let file = |suffix: &str| {
        let wanted = format!("{name}{suffix}");
        chart.package.files.iter().find(|it| it.name == wanted).map(|it| it.text.as_str())
    };
    let header = file(".h").expect("there is a header");
    let members = fields(header, &format!("{name}_t"));
    let states = states(header);
    let mut text = String::new();
    let put = |text: &mut String, line: &str| writeln!(text, "{line}").expect("a string");
    put(&mut text, "#include <stdint.h>\n#include <string.h>\n#include <stdbool.h>");
    put(&mut text, &format!("static unsigned hooks;\n#define {upper}_BAD_STATE(self) (++hooks)"));
    put(&mut text, &format!("#include \"{name}.c\""));
    if file("_user.c").is_some() {
        put(&mut text, &format!("#include \"{name}_user.c\""));
    }
    put(&mut text, print);
    let has_in = !fields(header, &format!("{name}_in_t")).is_empty();
    let has_out = !fields(header, &format!("{name}_out_t")).is_empty();
    let seed = chart.seed;
    put(
        &mut text,
        &format!(
            "static uint32_t seed = {seed}UL + 1UL;
static uint32_t draw(uint32_t n) {{ seed = seed * 1664525UL + 1013904223UL; return (seed >> 8) % n; }}
static {name}_t self, saved;
static uint32_t n_found, n_quiet, n_wrong, first_wrong, n_flips;
static void wrong(uint32_t what) {{ if (n_wrong == 0U) {{ first_wrong = what; }} ++n_wrong; }}"
        ),
    );
    let mut handed = vec!["&self"];
    let mut give = String::new();
    if has_in {
        put(&mut text, &format!("static {name}_in_t in;"));
        handed.push("&in");
        put(&mut give, "    memset(&in, 0, sizeof in);");
        for field in fields(header, &format!("{name}_in_t")) {
            if field.name == "bits" {
                let all = net.inputs.values().filter(|it| it.kind.is_handed() && it.ty.is_bool());
                for bit in 0..all.count() {
                    let (byte, bit) = (bit / 8, bit % 8);
                    put(
                        &mut give,
                        &format!(
                            "    in.bits[{byte}] = (uint8_t)(in.bits[{byte}] | (draw(2) << {bit}));"
                        ),
                    );
                }
            } else if field.ty == "bool" {
                put(&mut give, &format!("    in.{} = draw(2) != 0U;", field.name));
            } else {
                // "name: label, -5..300"
                let words = field.note.split([' ', ',']).filter_map(|it| it.split_once(".."));
                let found: Vec<(i64, i64)> = words
                    .filter_map(|(lo, hi)| Some((lo.parse().ok()?, hi.parse().ok()?)))
                    .collect();
                let (lo, hi) = *found.last().expect("a range");
                let ty = &field.ty;
                put(
                    &mut give,
                    &format!(
                        "    in.{} = ({ty})({lo}LL + (int64_t)((uint64_t)draw(0xffffffUL) * 251U % {}ULL));",
                        field.name,
                        hi - lo + 1
                    ),
                );
            }
        }
    }
    let step = format!("void {name}_step(");
    let takes_time = header.contains("t dt") && header.contains(&step);
    if takes_time {
        handed.push("(draw(4) == 0U) ? 60000U : (uint16_t)draw(5)");
    }
    let (init, clear, is_safe) = if has_out {
        put(&mut text, &format!("static {name}_out_t out, safe;"));
        handed.push("&out");
        (
            format!("{name}_init(&self, &out);"),
            "memset(&out, 0x55, sizeof out);",
            "(memcmp(&out, &safe, sizeof out) == 0)",
        )
    } else {
        (format!("{name}_init(&self);"), "", "true")
    };
    let arguments = handed.join(", ");
    put(
        &mut text,
        &format!(
            "static void react(void)
{{
{give}    {clear}
    {name}_step({arguments});
}}
/* After damage: is it found, if it is any? Then all is as it was before. */
static void judge(bool is_bad, unsigned calls, uint32_t what)
{{
    hooks = 0U;
    react();
    if (is_bad) {{
        ++n_found;
        if (hooks != calls || !{name}_stopped(&self) || !{is_safe}) {{ wrong(what); }}
        react();
        if (hooks != calls || !{name}_stopped(&self) || !{is_safe}) {{ wrong(what + 1000U); }}
        {init}
        hooks = 0U;
        react();
        if (hooks != 0U || {name}_stopped(&self)) {{ wrong(what + 2000U); }}
    }} else {{
        ++n_quiet;
        if (hooks != 0U || {name}_stopped(&self)) {{ wrong(what + 3000U); }}
    }}
    self = saved;
}}"
        ),
    );
    // The bits of a component: the proved exclusions.
    let mut broken = vec!["false".to_owned()];
    let mut all_visible = true;
    for component in &facts.components {
        let visible = component.steps.iter().all(|step| !net.steps[*step].hidden);
        all_visible &= visible;
        // In a statechart most states are numbers, which have a range instead.
        let is_bit = |step: &grafsynth_ir::net::StepId| {
            let name = &net.steps[*step].name.text;
            members.iter().any(|field| field.is_bit && field.name == *name)
        };
        let bits = component.steps.iter().filter(|step| is_bit(step)).count();
        if visible && bits > 0 {
            let active = |step: &grafsynth_ir::net::StepId| {
                format!("({name}_active_{}(&self) ? 1 : 0)", net.steps[*step].name.text)
            };
            let sum = component.steps.iter().filter(|step| is_bit(step)).map(active).join(" + ");
            let exactly = component.always && bits == component.steps.len();
            let sign = if exactly { "!=" } else { ">" };
            broken.push(format!("({sum} {sign} 1)"));
        }
    }
    put(
        &mut text,
        &format!("static bool broken(void)\n{{\n    return {};\n}}", broken.join(" || ")),
    );
    // The corruption of each member, and the conditions for its impossible values if they are known.
    let mut impossible = vec!["broken()".to_owned(), "self.intact != 0xA5U".to_owned()];
    let mut all_known = all_visible;
    let mut cases = String::new();
    let mut watch = String::new();
    let mut n_cases = 0_u32;
    let mut case = |cases: &mut String, body: String| {
        put(cases, &format!("        case {n_cases}U: {{ {body} break; }}"));
        n_cases += 1;
    };
    for (at, field) in members.iter().enumerate() {
        let Field { ty, name: member, len, is_bit, .. } = field;
        if member == "intact" {
            case(&mut cases, "uint8_t v = (uint8_t)draw(256); self.intact = v; judge(v != 0xA5U, (v != 0x5AU) ? 1U : 0U, 900U);".to_owned());
            continue;
        }
        if *is_bit {
            let must = if all_visible { "" } else { "if (broken()) " };
            case(
                &mut cases,
                format!(
                    "self.{member} = !self.{member}; {must}judge(broken(), 1U, {at}U); self = saved;"
                ),
            );
            continue;
        }
        if ty.ends_with("_t") && !ty.contains("int") {
            all_known = false;
            continue; // the member is the structure of the ring
        }
        for element in 0..len.unwrap_or(1) {
            let place = if len.is_some() { format!("{member}[{element}]") } else { member.clone() };
            let declared = net.vars.values().find(|var| var.name.text == *member);
            let known = if ty == "bool" {
                Some((0, 1))
            } else {
                states.get(&place).copied().or(declared.map(|var| var.ty.bounds()))
            };
            let raw = if ty == "bool" { "uint8_t" } else { ty };
            let inject = |value: &str, judged: &str| {
                format!("{raw} v = ({raw})({value}); memcpy(&self.{place}, &v, sizeof v); {judged}")
            };
            match known {
                Some((lo, hi)) => {
                    let value = match ty.as_str() {
                        "bool" => format!("(int64_t)*(const uint8_t *)&self.{place}"),
                        _ => format!("(int64_t)self.{place}"),
                    };
                    impossible.push(format!("{value} < {lo}LL || {value} > {hi}LL"));
                    for value in [
                        format!("{lo}LL - 1"),
                        format!("{lo}LL"),
                        format!("{hi}LL"),
                        format!("{hi}LL + 1"),
                        "(int64_t)draw(0x1000000UL) * 16411".to_owned(),
                    ] {
                        let judged = format!(
                            "judge((int64_t)v < {lo}LL || (int64_t)v > {hi}LL, 1U, {at}U);"
                        );
                        case(&mut cases, inject(&value, &judged));
                    }
                }
                None => {
                    all_known = false;
                    case(
                        &mut cases,
                        inject(
                            &format!(
                                "lo_{at}_{element} + (int64_t)draw(0x1000000UL) % (hi_{at}_{element} - lo_{at}_{element} + 1)"
                            ),
                            &format!("judge(false, 1U, {at}U);"),
                        ),
                    );
                    put(
                        &mut text,
                        &format!("static int64_t lo_{at}_{element}, hi_{at}_{element};"),
                    );
                    for (end, sign) in [("lo", "<"), ("hi", ">")] {
                        put(
                            &mut watch,
                            &format!(
                                "        if (first || (int64_t)self.{place} {sign} {end}_{at}_{element}) {{ {end}_{at}_{element} = (int64_t)self.{place}; }}"
                            ),
                        );
                    }
                }
            }
        }
    }
    // Any bit of the instance, including padding. If it hits a member without a known range, an alarm is permitted.
    let impossible = impossible.join(" || ");
    let judged = if all_known {
        format!("judge({impossible}, 1U, 904U); ++n_flips;")
    } else {
        format!("if ({impossible}) {{ judge(true, 1U, 904U); ++n_flips; }} self = saved;")
    };
    let flip = format!(
        "((unsigned char *)&self)[draw((uint32_t)sizeof self)] ^= (unsigned char)(1U << draw(8)); {judged}"
    );
    let safe = if has_out {
        format!(
            "    static const {name}_out_t before = {upper}_SAFE_OUT;\n    memset(&safe, 0x55, sizeof safe);\n    {name}_safe(&safe);\n    out = before;\n    (void)out;\n"
        )
    } else {
        String::new()
    };
    let stop =
        if has_out { format!("{name}_stop(&self, &out);") } else { format!("{name}_stop(&self);") };
    put(
        &mut text,
        &format!(
            "int main(void)
{{
    bool first = true;
{safe}    /* Memory that was never written does not run. */
    memset(&self, 0, sizeof self);
    react();
    if (hooks != 1U || !{is_safe} || !{name}_stopped(&self)) {{ wrong(901U); }}
    {init}
    for (uint32_t i = 0U; i < {n_rounds}UL; ++i) {{
        hooks = 0U;
        react();
        if (hooks != 0U || {name}_stopped(&self)) {{ wrong(902U); }}
{watch}        first = false;
        saved = self;
        switch (draw({n_cases}UL)) {{
{cases}        default: break;
        }}
        {flip}
    }}
    (void)first; (void)broken;
    hooks = 0U;
    {stop}
    react();
    if (hooks != 0U || !{is_safe} || !{name}_stopped(&self)) {{ wrong(903U); }}
    report(n_found); report(n_quiet); report(n_wrong); report(first_wrong); report(n_flips);
    return finish();
}}"
        ),
    );
    text
}

const PRINT: &str = "#include <stdio.h>
static void report(uint32_t value) { printf(\"%lu \", (unsigned long)value); }
static int finish(void) { return 0; }";

/// Reports numbers to the host. At the end there are three more, because the host waits for eight; the run ends when the machine sleeps without interrupts.
const PRINT_AVR: &str = "#include <avr/io.h>
#include <avr/sleep.h>
#include <avr/interrupt.h>
static void report(uint32_t value) { for (uint8_t i = 0; i < 4; i++) { GPIOR0 = (uint8_t)(value >> (8 * i)); } }
static int finish(void) { for (uint8_t i = 0; i < 3; i++) { report(0); } cli(); sleep_enable(); sleep_cpu(); return 0; }";

fn write(folder: &Path, chart: &Chart, main: &str) {
    for file in &chart.package.files {
        std::fs::write(folder.join(&file.name), &file.text).expect("it is written");
    }
    std::fs::write(folder.join("main.c"), main).expect("it is written");
}

/// The numbers that a run printed: detected, accepted, wrong, and the first wrong one.
fn on_host(chart: &Chart, compiler: &Compiler, n_rounds: u64) -> Result<Vec<u64>, String> {
    let facts = fleet::small_facts(&chart.net, chart.options.style);
    let folder = tempfile::tempdir().expect("a folder");
    write(folder.path(), chart, &program(chart, &facts, n_rounds, PRINT));
    let mut arguments: Vec<&str> = compiler.flags.clone();
    arguments.extend(["-o", "damage", "main.c"]);
    let made = tools::run(&compiler.path, &arguments, folder.path(), b"", LIMIT).expect("it runs");
    if !made.is_success {
        return Err(made.stderr);
    }
    let damage = folder.path().join("damage");
    let run = tools::run(&damage, &[], folder.path(), b"", LIMIT).expect("it runs");
    if !run.is_success {
        return Err(format!("{} {}", run.ending, run.stderr));
    }
    let out = String::from_utf8_lossy(&run.stdout).into_owned();
    Ok(out.split_whitespace().filter_map(|it| it.parse().ok()).collect())
}

/// The chart with the safe state; without a gate, which would skip the check.
fn watched(seed: u64, net: Valid<Net>, style: Style) -> Option<Chart> {
    let options = Options { safe_state: true, gate: false, ..fleet::options(seed, style) };
    let (package, options) = fleet::emitted(&net, options).ok()?;
    let header = package.files.first()?;
    // A chart without state has nothing to check.
    let has_state = header.text.contains("_stopped(");
    has_state.then_some(Chart { seed, net, package, options })
}

fn survive(style: Style, few: u64, many: u64) {
    let Some(compiler) = Compiler::watchful().or_else(|| {
        assert!(std::env::var_os("CI").is_none(), "sanitizers are missing, and CI must have them");
        println!("skipped: the sanitizers are not here");
        Compiler::plain()
    }) else {
        println!("skipped: a C compiler is not installed");
        return;
    };
    let wanted = rounds(few, many) as usize;
    let charts: Vec<Chart> = (0..)
        .filter_map(|seed| {
            watched(seed, random_net(seed, &fleet::features(seed, style, 12)), style)
        })
        .take(wanted)
        .collect();
    let counts = in_parallel(&charts, |chart| {
        let found = on_host(chart, &compiler, 4_000);
        match found.as_deref() {
            Ok([found, quiet, 0, 0, flips]) => (*found, *quiet, *flips),
            other => panic!(
                "seed {}, {:?}: {other:?}\n{}\n{}",
                chart.seed,
                chart.options,
                chart.package.files.iter().take(2).map(|it| it.text.as_str()).collect::<String>(),
                readable(&chart.net)
            ),
        }
    });
    let found: u64 = counts.iter().map(|it| it.0).sum();
    let quiet: u64 = counts.iter().map(|it| it.1).sum();
    let flips: u64 = counts.iter().map(|it| it.2).sum();
    println!(
        "style {}: {wanted} charts, {found} damaged values found, {quiet} that could be; {flips} of both are bits flipped anywhere",
        style.name()
    );
    assert!(found > 200 * wanted as u64 && quiet > 200 * wanted as u64);
}

#[test]
fn a_switch_finds_damaged_memory() {
    survive(Style::Switch, 4, 24);
}

#[test]
fn tables_find_damaged_memory() {
    survive(Style::Tables, 4, 24);
}

#[test]
fn bits_find_damaged_memory() {
    survive(Style::Bits, 4, 24);
}

#[test]
fn the_best_style_finds_damaged_memory() {
    survive(Style::Auto, 4, 24);
}

/// The same test on an AVR: a chart with a component, a timer, a number, an array and an edge, in both styles.
#[test]
fn an_avr_finds_damaged_memory() {
    let text = "chart mill {
        evolution single
        conflict priority
        tick 10 ms
        input start, stop
        output motor
        output valve safe on
        output level: int 0..200 safe 7
        var n: int 0..9 = 0
        var table: int -3..40[6]
        initial step rest
        step run { motor; entry { n := n + 1; table[n mod 6] := n; level := 100 } }
        step wait_ { valve }
        rest -> run when rise(start)
        run -> wait_ after 3 s
        wait_ -> rest when stop
    }";
    if let Availability::Missing(what) = AvrEngine::default().availability() {
        assert!(std::env::var_os("CI").is_none(), "{what} is missing, and CI must have it");
        println!("skipped: {what} is not installed");
        return;
    }
    for (style, io) in [(Style::Switch, Io::Words), (Style::Bits, Io::Members)] {
        let net = chart("mill.graf", text);
        let facts = fleet::small_facts(&net, style);
        let options = Options { style, io, safe_state: true, ..Options::default() };
        let package = grafsynth_backend_c::emit(&net, &facts, &options).expect("it is emitted");
        let chart = Chart { seed: 5, net, package, options };
        let folder = tempfile::tempdir().expect("a folder");
        write(folder.path(), &chart, &program(&chart, &facts, 2_000, PRINT_AVR));
        let arguments =
            ["-mmcu=atmega1284p", "-std=gnu99", "-Os", "-Wall", "-o", "a.elf", "main.c"];
        let compiler = tools::find(&["avr-gcc"]).expect("it is here");
        let made = tools::run(&compiler, &arguments, folder.path(), b"", LIMIT).expect("it runs");
        assert!(made.is_success && made.stderr.is_empty(), "{}", made.stderr);
        let host = include_str!("../c/avr_stress_host.c");
        let headers = concat!("-I", env!("CARGO_MANIFEST_DIR"), "/c");
        let host = c::compile_with(host, &["-O1", headers], &["-lsimavr", "-lelf"]);
        let host = host.expect("it compiles");
        let arguments = ["a.elf", "1000", "700", "3000"];
        let run = tools::run(&host.path, &arguments, folder.path(), b"", LIMIT).expect("it ends");
        assert!(run.is_success, "{} {}", run.ending, run.stderr);
        let out = String::from_utf8_lossy(&run.stdout).into_owned();
        let numbers: Vec<u64> = out
            .lines()
            .last()
            .unwrap_or_default()
            .split(' ')
            .filter_map(|it| it.parse().ok())
            .collect();
        println!("{}: {numbers:?}", style.name());
        // The host prints the numbers of edges and cycles first.
        let [_, _, found, quiet, wrong, first, ..] = numbers[..] else { panic!("{out}") };
        assert!(found > 300 && quiet > 300, "{out}");
        assert_eq!((wrong, first), (0, 0));
    }
}
