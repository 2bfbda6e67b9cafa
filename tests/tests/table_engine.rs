//! Charts as tables for the engine that is the same for all: equal to the net, and never out of bounds, whatever bytes are loaded.

#![allow(clippy::print_stdout, reason = "tests report what they skip and what they counted")]
#![allow(clippy::disallowed_methods, reason = "tests compile and read files")]

use grafsynth_backend_c::{Io, Options, Package, Style, check_image, emit, multi_harness};
use grafsynth_driver::run::net_trace;
use grafsynth_engines::{Availability, CEngine, Engine, EngineError, Job, c, tools};
use grafsynth_ir::Valid;
use grafsynth_ir::net::{Net, Policy};
use grafsynth_sim::{Random, Stimulus, Trace, compare};
use grafsynth_tests::random_net::{Features, random_net};
use grafsynth_tests::{chart, readable, rounds, small_limits};
use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

const ROWS: usize = 150;

fn supervisor() -> String {
    let path =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/supervisor/supervisor.scxml");
    std::fs::read_to_string(path).expect("the example is here")
}

fn package(net: &Valid<Net>, prefix: Option<String>) -> Result<Package, String> {
    packed(net, Options { style: Style::Engine, prefix, ..Options::default() })
}

fn packed(net: &Valid<Net>, options: Options) -> Result<Package, String> {
    let facts = grafsynth_verify::structural_facts(net);
    emit(net, &facts, &options).map_err(|found| {
        assert!(found.iter().all(|it| ["G0606", "G0620"].contains(&it.code.id)), "{found:#?}");
        found.iter().map(|it| it.message.clone()).collect()
    })
}

/// Runs random nets that can be tables, all in one program.
fn agree(features: &Features, wanted: u64, most: u64) {
    agree_as(features, Style::Engine, "engine", wanted, most);
}

/// Runs random nets of this style, all in one program; those that get another style are counted, with the reason.
fn agree_as(features: &Features, style: Style, shape: &str, wanted: u64, most: u64) {
    if tools::c_compiler().is_none() {
        println!("skipped: no C compiler is installed");
        return;
    }
    let mut refused: BTreeMap<String, u64> = BTreeMap::new();
    let mut nets: Vec<(u64, Valid<Net>, Package)> = Vec::new();
    for seed in 0..most {
        if nets.len() as u64 == wanted {
            break;
        }
        let net = random_net(seed, features);
        let io = if seed % 3 == 1 { Io::Words } else { Io::Members };
        let options = Options { style, io, prefix: Some(format!("n{seed}")), ..Options::default() };
        match packed(&net, options) {
            Ok(package) if package.style == shape => nets.push((seed, net, package)),
            Ok(package) => *refused.entry(package.reason).or_default() += 1,
            Err(why) => *refused.entry(why).or_default() += 1,
        }
    }
    println!("{} nets; refused: {refused:?}", nets.len());
    assert_eq!(nets.len() as u64, wanted, "{refused:?}");
    for part in nets.chunks(40) {
        let all: Vec<(&Valid<Net>, &Package)> =
            part.iter().map(|(_, net, package)| (net, package)).collect();
        let flags = ["-O0", "-fsanitize=undefined", "-fno-sanitize-recover"];
        let program =
            c::compile_text(&multi_harness(&all), &flags).unwrap_or_else(|why| panic!("{why}"));
        for (at, (seed, net, _)) in part.iter().enumerate() {
            let stimulus = Stimulus::random(net, ROWS, *seed, 3);
            let input = c::lines(net, &stimulus);
            let run = tools::run(
                &program.path,
                &[&at.to_string()],
                program.folder.path(),
                input.as_bytes(),
                Duration::from_secs(60),
            )
            .unwrap_or_else(|why| panic!("{why:?}"));
            assert!(run.is_success, "seed {seed}: {}\n{}", run.stderr, readable(net));
            let got = c::parse(net, &run.stdout).unwrap_or_else(|why| panic!("{why:?}"));
            if let Some(found) = compare(&net_trace(net, &stimulus), &got) {
                panic!("seed {seed}: {found:?}\n{}", readable(net));
            }
        }
    }
}

/// Grafcet charts: shared steps, forks, several micro-steps, edges, times, numbers.
#[test]
fn grafcet_charts_as_tables_do_what_the_net_does() {
    agree(&Features::tabular(), rounds(20, 240), rounds(400, 10_000));
}

/// Statecharts: regions, histories, inner and outer transitions, events.
#[test]
fn statecharts_as_tables_do_what_the_net_does() {
    let features = Features { several_parts: true, ..Features::tabular_statecharts() };
    agree(&features, rounds(20, 240), rounds(400, 10_000));
}

/// Statecharts in the table layout `btrans`: the engine's own rule gives the result of the net, or the chart is rejected with a code.
#[test]
fn statecharts_as_bstate_and_btrans_do_what_the_net_does() {
    let features = Features::tabular_statecharts();
    agree_as(&features, Style::Btrans, "btrans", rounds(20, 240), rounds(1000, 20_000));
}

/// An emergency over steps, a time and a number, and outputs with the safe value on, off or a number: in each layout of tables.
#[test]
fn an_emergency_forces_the_outputs_of_tables() {
    if tools::c_compiler().is_none() {
        println!("skipped: no C compiler is installed");
        return;
    }
    let text = "chart press {
    conflict outer-first
    evolution stable
    tick 1 ms
    input stop, go
    output close
    output brake safe on
    output level: int 0..5 = 0 safe 3
    emergency stop or down.t >= 3 ms or level = 5
    initial state up { brake; entry { level := 1 } }
    state down { close; entry { level := level + 4 } }
    up -> down when go
    down -> up when not go
}
";
    let net = chart("press.graf", text);
    assert!(net.emergency.is_some());
    for (style, shape) in [
        (Style::Engine, "engine"),
        (Style::Program, "engine with a program"),
        (Style::Btrans, "btrans"),
    ] {
        let package = packed(&net, Options { style, ..Options::default() });
        let package = package.unwrap_or_else(|why| panic!("{shape}: {why}"));
        assert_eq!(package.style, shape);
        let program = c::compile_text(&multi_harness(&[(&net, &package)]), &["-O1"])
            .unwrap_or_else(|why| panic!("{shape}: {why}"));
        for seed in 0..5 {
            let stimulus = Stimulus::random(&net, ROWS, seed, 3);
            let input = c::lines(&net, &stimulus);
            let folder = program.folder.path();
            let run = tools::run(
                &program.path,
                &["0"],
                folder,
                input.as_bytes(),
                Duration::from_secs(60),
            )
            .unwrap_or_else(|why| panic!("{shape}: {why:?}"));
            assert!(run.is_success, "{shape}: {}", run.stderr);
            let got = c::parse(&net, &run.stdout).unwrap_or_else(|why| panic!("{shape}: {why:?}"));
            let found = compare(&net_trace(&net, &stimulus), &got);
            assert!(found.is_none(), "{shape}, seed {seed}: {found:?}");
        }
    }
}

/// The same test on small machines, with the real object files: tables and byte code. Charts that do not fit are not counted.
#[test]
fn engines_on_microcontrollers_do_what_the_net_does() {
    let tables = Features {
        policies: vec![Policy::Priority, Policy::InnerFirst],
        stable: true,
        timers: true,
        integers: true,
        events: true,
        edges: true,
        ..Features::plain()
    };
    let states = Features {
        policies: vec![Policy::InnerFirst, Policy::OuterFirst],
        single: false,
        history: true,
        reactions: true,
        ..tables.clone()
    };
    for machine in ["c-avr", "c-arm", "c-8051"] {
        for (style, features) in
            [("engine", &tables), ("program", &Features::everything()), ("btrans", &states)]
        {
            let name = format!("{machine}:{style}");
            let engine = grafsynth_engines::named(&name).expect("there is an engine of that name");
            if let Availability::Missing(tool) = engine.availability() {
                println!("skipped: {name} needs {tool}");
                continue;
            }
            let (mut n_ran, mut n_large, mut seed) = (0, 0, 0);
            // An 8051 has 256 bytes of internal RAM for temporaries and the stack: not every chart leaves enough.
            while n_ran < rounds(1, 10) && n_large < rounds(1, 10) {
                let net = random_net(seed, features);
                let facts = grafsynth_verify::structural_facts(&net);
                // An 8051 takes seconds of simulated time for a reaction with long numbers.
                let rows = if machine == "c-8051" { 10 } else { 60 };
                let stimulus = Stimulus::random(&net, rows, seed, 3);
                match engine.run(&Job { net: &net, facts: &facts, stimulus: &stimulus }) {
                    Ok(got) => {
                        let found = compare(&net_trace(&net, &stimulus), &got);
                        assert!(found.is_none(), "{name}, seed {seed}: {found:?}");
                        n_ran += 1;
                    }
                    Err(EngineError::Refused(found)) => {
                        let codes = ["G0604", "G0620"];
                        assert!(found.iter().all(|it| codes.contains(&it.code.id)), "{found:#?}");
                        // Charts that a layout does not support need no compiler time.
                        n_large += u64::from(found.iter().any(|it| it.code.id == "G0604"));
                    }
                    Err(EngineError::Failed(why)) => panic!("{name}, seed {seed}: {why}"),
                }
                seed += 1;
            }
            println!("{name}: {n_ran} charts agree, {n_large} do not fit");
            assert!(n_ran > n_large, "{name}: {n_ran} charts agree, {n_large} do not fit");
        }
    }
}

/// All features of charts, as byte code: nothing is rejected.
#[test]
fn every_chart_as_a_program_does_what_the_net_does() {
    let (wanted, shape) = (rounds(20, 400), "engine with a program");
    agree_as(&Features::everything(), Style::Program, shape, wanted, wanted);
}

/// The number of instructions of a reaction is computed beforehand: an instrumented engine never runs more, and exactly as many for straight-line code.
#[test]
fn a_program_runs_no_more_instructions_than_counted() {
    if tools::c_compiler().is_none() {
        println!("skipped: no C compiler is installed");
        return;
    }
    let (fetch, go, begin) = (
        "        const uint8_t op = run->image[run->at];\n",
        "uint8_t gp_go(gp_run_t *run)\n{\n",
        "void gp_begin(gp_run_t *run, bool reset)\n{\n",
    );
    let (mut nearest, mut ran) = (0.0_f64, 0);
    for seed in 0..rounds(12, 300) {
        let net = random_net(seed, &Features::everything());
        let facts = grafsynth_verify::facts(&net, &small_limits());
        let options = Options { style: Style::Program, ..Options::default() };
        let package = emit(&net, &facts, &options).expect("every chart is a program");
        let most = package.instructions.expect("it is code");
        let text = multi_harness(&[(&net, &package)]);
        assert!([fetch, go, begin].iter().all(|it| text.contains(it)));
        let count = "static unsigned long gp_counted, gp_most;\nstatic bool gp_was_reset = true;\n";
        let note = "    if (!gp_was_reset && (gp_counted > gp_most)) { gp_most = gp_counted; }\n    gp_counted = 0; gp_was_reset = reset;\n";
        let say = "#include <stdio.h>\n__attribute__((destructor)) static void gp_say(void)\n{\n    if (gp_counted > gp_most && !gp_was_reset) { gp_most = gp_counted; }\n    fprintf(stderr, \"%lu\\n\", gp_most);\n}\n";
        let text = text
            .replace(fetch, &format!("        ++gp_counted;\n{fetch}"))
            .replace(go, &format!("{count}{say}{go}"))
            .replace(begin, &format!("{begin}{note}"));
        let program = c::compile_text(&text, &["-O1"]).unwrap_or_else(|why| panic!("{why}"));
        let stimulus = Stimulus::random(&net, ROWS, seed, 3);
        let input = c::lines(&net, &stimulus);
        let folder = program.folder.path();
        let limit = Duration::from_secs(60);
        let run = tools::run(&program.path, &["0"], folder, input.as_bytes(), limit)
            .unwrap_or_else(|why| panic!("{why:?}"));
        assert!(run.is_success, "seed {seed}: {}", run.stderr);
        let counted: u64 = run.stderr.trim().parse().expect("a number");
        assert!(counted <= most, "seed {seed}: {counted} of {most}\n{}", readable(&net));
        assert!(counted > 0, "seed {seed}");
        nearest = nearest.max(counted as f64 / most as f64);
        ran += 1;
    }
    println!("{ran} programs; at most {nearest:.2} of the counted instructions are run");
    assert!(nearest > 0.5);
}

/// The trace of a chart in one style.
fn trace(net: &Valid<Net>, stimulus: &Stimulus, style: Style) -> Trace {
    let facts = grafsynth_verify::structural_facts(net);
    let engine = CEngine { options: Options { style, ..Options::default() } };
    engine
        .run(&Job { net, facts: &facts, stimulus })
        .unwrap_or_else(|why| panic!("{}: {why:?}", style.name()))
}

/// The supervisor as code and as tables: after a change to the chart only the tables differ, and the engine compiles to the same bytes.
#[test]
fn a_changed_supervisor_is_other_tables_and_the_same_engine() {
    let Some(compiler) = tools::c_compiler() else {
        println!("skipped: no C compiler is installed");
        return;
    };
    let text = supervisor();
    let net = chart("supervisor.scxml", &text);
    let stimulus = Stimulus::random(&net, 2000, 2, 1);
    let wanted = net_trace(&net, &stimulus);
    let styles =
        [Style::Switch, Style::Tables, Style::Bits, Style::Engine, Style::Program, Style::Btrans];
    for style in styles {
        assert_eq!(compare(&wanted, &trace(&net, &stimulus, style)), None, "{}", style.name());
    }
    // The emergency stop no longer requires a reset, and the pendant resumes its previous mode.
    let changed = text
        .replace(r#"cond="Error == 0" target="Off""#, r#"target="On""#)
        .replace(r#"type="shallow""#, r#"type="deep""#);
    assert_ne!(text, changed);
    let other = chart("supervisor.scxml", &changed);
    assert!(compare(&wanted, &net_trace(&other, &stimulus)).is_some(), "the change shows");
    for (style, engine) in [
        (Style::Engine, "grafsynth_engine.c"),
        (Style::Program, "grafsynth_program.c"),
        (Style::Btrans, "grafsynth_btrans.c"),
    ] {
        let found = compare(&net_trace(&other, &stimulus), &trace(&other, &stimulus, style));
        assert_eq!(found, None, "{}", style.name());
        let options = Options { style, ..Options::default() };
        let before = packed(&net, options.clone()).expect("carried");
        let after = packed(&other, options).expect("carried");
        for (a, b) in before.files.iter().zip(&after.files) {
            assert_eq!(a.name, b.name);
            // The header and source of a program may also differ: they contain the sizes of its memory.
            let may = a.name == "supervisor_tables.c"
                || (style != Style::Engine && a.name.starts_with("supervisor."));
            assert!(a.text == b.text || may, "{}", a.name);
            assert!(a.text != b.text || a.name != "supervisor_tables.c");
        }
        for (compiler, flags) in [
            (Some(compiler.clone()), &["-std=c99"][..]),
            (tools::find(&["avr-gcc"]), &["-std=gnu99", "-mmcu=atmega328p"]),
            (tools::find(&["arm-none-eabi-gcc"]), &["-std=c99", "-mcpu=cortex-m3", "-mthumb"]),
        ] {
            let Some(compiler) = compiler else { continue };
            let object = |package: &Package| object_of(&compiler, flags, engine, package);
            assert_eq!(object(&before), object(&after), "{engine}");
        }
    }
    let before = package(&net, None).expect("carried");
    // The loaded table equals the compiled one.
    let table = before.files.iter().find(|it| it.name.ends_with("_tables.c")).expect("tables");
    let bytes: Vec<u8> = table
        .text
        .split("0x")
        .skip(1)
        .filter_map(|word| word.get(..3)?.strip_suffix(','))
        .filter_map(|word| u8::from_str_radix(word, 16).ok())
        .collect();
    assert_eq!(bytes, before.image);
}

/// The bytes of an engine's object file, compiled with a chart.
fn object_of(compiler: &Path, flags: &[&str], engine: &str, package: &Package) -> Vec<u8> {
    let folder = tempfile::tempdir().expect("a folder");
    for file in &package.files {
        std::fs::write(folder.path().join(&file.name), &file.text).expect("written");
    }
    let status = Command::new(compiler)
        .args(flags)
        .args(["-Os", "-c", engine, "-o", "engine.o"])
        .current_dir(folder.path())
        .status();
    assert!(status.expect("the compiler runs").success());
    std::fs::read(folder.path().join("engine.o")).expect("an object")
}

/// A program that reads images (a length of two bytes, then the bytes), loads each in memory of exactly its size, runs those that are accepted, and
/// prints a digit for each: the result of the load.
fn damages(prefix: &str, net: &Net, package: &Package) -> String {
    let out = if net.outputs.is_empty() { "" } else { ", &out" };
    let header = package.files.iter().find(|it| it.name == format!("{prefix}.h"));
    let step = header.and_then(|it| it.text.lines().find(|line| line.contains("_step(")));
    let dt = if step.is_some_and(|line| line.contains(" dt")) { ", 1" } else { "" };
    let library = if package.files.iter().any(|it| it.name.ends_with("_user.h")) {
        format!(
            "#include \"{prefix}_user.h\"\nbool door(void) {{ return (next() & 1) != 0; }}\n\
             void speed(int16_t n) {{ if (n < -3 || n > 400) abort(); }}\n"
        )
    } else {
        String::new()
    };
    format!(
        r#"#include "{prefix}.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
static uint32_t seed = 1;
static uint32_t next(void) {{ seed = seed * 1664525u + 1013904223u; return seed >> 8; }}
{library}static unsigned try(uint8_t *copy, unsigned n)
{{
    {prefix}_t *self = malloc(sizeof *self);
    {prefix}_out_t out;
    memset(self, 0x55, sizeof *self);
    unsigned found = {prefix}_load(self, copy, (uint16_t)n{out});
    if (found == GS_OK) {{
        for (int scan = 0; scan < 30; ++scan) {{
            {prefix}_in_t in;
            for (unsigned i = 0; i < sizeof in; ++i) ((uint8_t *)&in)[i] = next() & 1;
            {prefix}_step(self, &in{dt}{out});
        }}
    }}
    free(self);
    return found;
}}
int main(void)
{{
    int low, high;
    while ((low = getchar()) != EOF && (high = getchar()) != EOF) {{
        const unsigned n = (unsigned)low | (unsigned)high << 8;
        uint8_t *copy = malloc(n ? n : 1);
        if (n != 0 && fread(copy, 1, n, stdin) != n) return 2;
        putchar((int)('0' + try(copy, n)));
        free(copy);
    }}
    return 0;
}}
"#
    )
}

/// The image with its checksum.
fn mended(mut image: Vec<u8>) -> Vec<u8> {
    let length = usize::from(u16::from_le_bytes([image[6], image[7]]));
    if (12..=image.len()).contains(&length) {
        image[8..12].fill(0);
        let crc = crc32(&image[..length]);
        image[8..12].copy_from_slice(&crc.to_le_bytes());
    }
    image
}

fn crc32(bytes: &[u8]) -> u32 {
    let step = |crc: u32| if crc & 1 == 1 { (crc >> 1) ^ 0xedb8_8320 } else { crc >> 1 };
    let table: Vec<u32> = (0..256).map(|byte| (0..8).fold(byte, |crc, _| step(crc))).collect();
    let add = |crc: u32, byte: &u8| table[(crc as u8 ^ byte) as usize] ^ (crc >> 8);
    !bytes.iter().fold(u32::MAX, add)
}

/// Damaged copies of an image: those that the checksum must reveal, and those with a new checksum.
fn damaged(image: &[u8]) -> (Vec<Vec<u8>>, Vec<Vec<u8>>) {
    let flipped = |at: usize, flip: u8| {
        let mut copy = image.to_vec();
        copy[at] ^= flip;
        copy
    };
    let mut plain: Vec<Vec<u8>> = (0..image.len()).map(|n| image[..n].to_vec()).collect();
    plain.extend((0..image.len()).map(|at| flipped(at, 1 << (at % 8))));
    let flips: &[u8] =
        if rounds(0, 1) == 1 { &[1, 2, 4, 8, 16, 32, 64, 128, 255] } else { &[1, 255] };
    let all = (0..image.len()).flat_map(|at| flips.iter().map(move |flip| (at, *flip)));
    let mut new: Vec<Vec<u8>> = all.map(|(at, flip)| mended(flipped(at, flip))).collect();
    let mut random = Random::new(7);
    for _ in 0..rounds(400, 40_000) {
        let mut copy = image.to_vec();
        for _ in 0..=random.below(4) {
            let at = 16 + random.below(image.len() - 16);
            let near = copy[at].wrapping_add(random.below(3) as u8).wrapping_sub(1);
            copy[at] = if random.one_in(3) { near } else { random.below(256) as u8 };
        }
        new.push(mended(copy));
    }
    (plain, new)
}

/// Images with any changed byte are rejected by their checksum; with a new checksum they are rejected or run, and never access memory outside their
/// own. The check in Rust gives the same result for each.
#[test]
fn damaged_images_are_refused_or_harmless() {
    if tools::c_compiler().is_none() {
        println!("skipped: no C compiler is installed");
        return;
    }
    let rich = "chart rich {
        conflict priority
        evolution stable
        input a, b
        input n: int -5..300
        output R
        output level: int 0..9 = 2
        var v: int -100..100 = 7
        initial step s { entry { if a { v := v + 1 } else { v := v * 2 - 3 } } R if b and s.t > 3 }
        step r { exit { level := level + 1 } }
        step u
        initial step w
        s -> r & u when rise(a) or v > 3 and s.t >= 2
        r & u -> s when fall(b) and n > 4 do { if b { v := n; if a { level := 3 } } }
        w -> w when a and not b do { v := -v }
    }";
    let history = "chart deep {
        conflict inner-first
        event E, F, G
        input a
        output R
        var v: int 0..9 = 0
        parallel P {
            state A { initial state x { R } state y { entry { v := v + 1 } } history H
                x -> y on E  y -> x on F when a }
            state B { initial state p state q  p -> q on E  q -> p after 20 ms }
        }
        state Z { exit { v := 0 } }
        P -> Z on G
        Z -> P on E
    }";
    let calls = "chart calls {
        evolution stable limit 9
        input a
        input n: int -5..300
        extern condition door()
        extern action speed(int -3..400)
        output R
        var v: int 0..90[4]
        var w: int -2000000000..2000000000 = 1
        initial step s { R if door() or a }
        step r { entry { v[n mod 4 * 0 + 1] := n / 7; w := w * 5 / 3 + n; call speed(n * n) } set R }
        s -> r when door() and rise(a) do { if n > 3 { v[0] := v[1] mod 5 } else { call speed(w) } }
        r -> s when w * w > 4 or r.t > 5
    }";
    for (name, text, style) in [
        ("supervisor.scxml", supervisor(), Style::Engine),
        ("rich.graf", rich.to_owned(), Style::Engine),
        ("deep.graf", history.to_owned(), Style::Engine),
        ("calls.graf", calls.to_owned(), Style::Engine),
        ("deep.graf", history.to_owned(), Style::Program),
    ] {
        let net = chart(name, &text);
        let options = Options { style, prefix: Some("c".to_owned()), ..Options::default() };
        let package = packed(&net, options).expect("carried");
        let main = damages("c", &net, &package);
        let flags =
            ["-std=c99", "-O1", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"];
        let program = match c::compile(&package, &main, &flags) {
            Ok(program) => program,
            Err(why) if ["asan", "ubsan"].iter().any(|it| why.to_string().contains(it)) => {
                println!("skipped: no sanitizer is here: {why}");
                return;
            }
            Err(why) => panic!("{name}: {why}"),
        };
        let room = package.room.expect("it has an image");
        assert_eq!(check_image(&package.image, &room), Ok(()), "{name}");
        let (plain, new) = damaged(&package.image);
        let mut stdin = Vec::new();
        for image in plain.iter().chain(&new) {
            stdin.extend((image.len() as u16).to_le_bytes());
            stdin.extend(image);
        }
        let limit = Duration::from_secs(300);
        let run = tools::run(&program.path, &[], program.folder.path(), &stdin, limit)
            .unwrap_or_else(|why| panic!("{name}: {why:?}"));
        assert!(run.is_success, "{name}: {} {}", run.ending, run.stderr);
        assert_eq!(run.stdout.len(), plain.len() + new.len());
        let mut counts = [0; 8];
        for (at, (image, found)) in plain.iter().chain(&new).zip(&run.stdout).enumerate() {
            let flaw = check_image(image, &room);
            let expected = flaw.err().map_or(0, |flaw| flaw.damage as u8);
            assert_eq!(found - b'0', expected, "{name}, image {at}: {flaw:?}");
            assert!(at >= plain.len() || expected != 0, "{name}, image {at}");
            assert!(flaw.err().is_none_or(|flaw| flaw.at <= image.len()));
            counts[usize::from(expected)] += 1;
        }
        println!("{name}: accepted, then each reason: {counts:?}");
        assert!(counts[0] > 0 && counts[7] > 0, "{name}: {counts:?}");
    }
}
