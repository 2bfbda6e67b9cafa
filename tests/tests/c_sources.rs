//! C functions and their charts in one program: the original and the C of its chart get the same arguments and must give the same results.
//!
//! Static variables are compared too: the original and the chart run through all calls without a reset.

#![allow(clippy::print_stdout, reason = "tests report what they skip")]

use grafsynth_backend_c::{File, FileKind, emit};
use grafsynth_driver::pipeline;
use grafsynth_engines::{c, tools};
use grafsynth_frontend::c::{Calls, Group, Options, Parsed, parse_within};
use grafsynth_frontend::graf::{self, Limits};
use grafsynth_ir::net::Net;
use grafsynth_ir::{FileId, Valid, lower};
use grafsynth_sim::{InputRow, Simulator};
use grafsynth_tests::rounds;
use std::time::Duration;

/// A function and its calls.
struct Case {
    name: &'static str,
    source: &'static str,
    /// Declarations of the driver: the original's arguments.
    arguments: &'static str,
    /// Chooses arguments with `rnd(n)` and calls the original.
    original: &'static str,
    /// Passes the same arguments to the chart: members of `in`, or setters of the library.
    chart: &'static str,
    /// True if both results are equal.
    same: &'static str,
    keep: &'static [&'static str],
}

const ATOI: Case = Case {
    name: "atoi",
    source: include_str!("../cases/c/atoi.c"),
    arguments: "static char text[16]; static int wanted;",
    // The number has at most nine digits, because more do not fit in an `int`.
    original: "{
        int k = 0, n;
        memset(text, 0, sizeof text);
        for (n = rnd(3); n > 0; n--) text[k++] = \" \\n\\t\"[rnd(3)];
        if (rnd(2)) text[k++] = \"+-\"[rnd(2)];
        for (n = rnd(10); n > 0; n--) text[k++] = '0' + rnd(10);
        if (k < 15 && rnd(2)) text[k++] = 33 + rnd(90);
        while (k < 15 && rnd(2)) text[k++] = rnd(256);
        /* what follows a digit by accident must not make the number longer */
        text[15] = 0;
        for (k = 0, n = 0; k < 16; k++) { n = text[k] >= '0' && text[k] <= '9' ? n + 1 : 0; if (n > 9) text[k] = 'x'; }
        wanted = 0;
        atoi(text, &wanted);
    }",
    chart: "in.s_0 = text[0]; in.s_1 = text[1]; in.s_2 = text[2]; in.s_3 = text[3]; in.s_4 = text[4]; in.s_5 = text[5]; in.s_6 = text[6];
        in.s_7 = text[7]; in.s_8 = text[8]; in.s_9 = text[9]; in.s_10 = text[10]; in.s_11 = text[11]; in.s_12 = text[12];
        in.s_13 = text[13]; in.s_14 = text[14]; in.s_15 = text[15];",
    same: "out.return_int_out == wanted",
    keep: &[],
};

const DUFF: Case = Case {
    name: "duff",
    source: include_str!("../cases/c/duff.c"),
    arguments: "static char from_here[32]; static int count, wanted;",
    original: "{
        int k;
        for (k = 0; k < 32; k++) from_here[k] = rnd(256);
        count = rnd(36) - 2;
        wanted = duff(from_here, count);
    }",
    chart: "in.count = count;
        in.from_0 = from_here[0]; in.from_1 = from_here[1]; in.from_2 = from_here[2]; in.from_3 = from_here[3];
        in.from_4 = from_here[4]; in.from_5 = from_here[5]; in.from_6 = from_here[6]; in.from_7 = from_here[7];
        in.from_8 = from_here[8]; in.from_9 = from_here[9]; in.from_10 = from_here[10]; in.from_11 = from_here[11];
        in.from_12 = from_here[12]; in.from_13 = from_here[13]; in.from_14 = from_here[14]; in.from_15 = from_here[15];
        in.from_16 = from_here[16]; in.from_17 = from_here[17]; in.from_18 = from_here[18]; in.from_19 = from_here[19];
        in.from_20 = from_here[20]; in.from_21 = from_here[21]; in.from_22 = from_here[22]; in.from_23 = from_here[23];
        in.from_24 = from_here[24]; in.from_25 = from_here[25]; in.from_26 = from_here[26]; in.from_27 = from_here[27];
        in.from_28 = from_here[28]; in.from_29 = from_here[29]; in.from_30 = from_here[30]; in.from_31 = from_here[31];",
    same: "out.result == wanted",
    keep: &[],
};

const STATEMENTS: Case = Case {
    name: "statements",
    source: include_str!("../cases/c/statements.c"),
    arguments: "static int a, b, wanted;",
    original: "a = rnd(20) - 2; b = rnd(12) - 2; wanted = statements(a, b);",
    chart: "in.a = a; in.b = b;",
    same: "out.result == wanted",
    keep: &[],
};

const CELL: Case = Case {
    name: "cell",
    source: include_str!("../../examples/cell-controller/cell.c"),
    arguments: "static unsigned char telegram[12], sensor[16]; static unsigned status; static int wanted;",
    original: "{
        static unsigned char number;
        int k, calm = rnd(3);
        for (k = 0; k < 12; k++) telegram[k] = rnd(256);
        for (k = 0; k < 16; k++) sensor[k] = calm ? rnd(calm == 1 ? 64 : 192) & ~0x40 : rnd(256);
        telegram[0] = rnd(50) ? 0xA5 : rnd(256);
        telegram[1] = rnd(20) ? rnd(7) : rnd(2) ? 0x7f : rnd(256);
        telegram[2] = rnd(2) ? rnd(130) : rnd(5);
        telegram[3] = rnd(130);
        telegram[10] = rnd(20) ? ++number : number;
        telegram[11] = crc8(telegram, 11);
        if (!rnd(30)) telegram[11] ^= 1 << rnd(8);
        wanted = cell(telegram, sensor, &status);
    }",
    chart: "in.telegram_0 = telegram[0]; in.telegram_1 = telegram[1]; in.telegram_2 = telegram[2]; in.telegram_3 = telegram[3];
        in.telegram_4 = telegram[4]; in.telegram_5 = telegram[5]; in.telegram_6 = telegram[6]; in.telegram_7 = telegram[7];
        in.telegram_8 = telegram[8]; in.telegram_9 = telegram[9]; in.telegram_10 = telegram[10]; in.telegram_11 = telegram[11];
        in.sensor_0 = sensor[0]; in.sensor_1 = sensor[1]; in.sensor_2 = sensor[2]; in.sensor_3 = sensor[3];
        in.sensor_4 = sensor[4]; in.sensor_5 = sensor[5]; in.sensor_6 = sensor[6]; in.sensor_7 = sensor[7];
        in.sensor_8 = sensor[8]; in.sensor_9 = sensor[9]; in.sensor_10 = sensor[10]; in.sensor_11 = sensor[11];
        in.sensor_12 = sensor[12]; in.sensor_13 = sensor[13]; in.sensor_14 = sensor[14]; in.sensor_15 = sensor[15];",
    same: "out.result == wanted && (unsigned)out.status_out == status",
    keep: &[],
};

const MEAN: Case = Case {
    name: "mean",
    source: include_str!("../c/mean.c"),
    arguments: "static double base, wanted; static int n; void mean_chart_set_base(double); void mean_chart_set_n(int); double mean_chart_get_result(void);",
    original: "base = rnd(4000) / 100.0 - 5; n = rnd(12); wanted = mean(base, n);",
    chart: "mean_chart_set_base(base); mean_chart_set_n(n);",
    same: "memcmp(&(double){ mean_chart_get_result() }, &wanted, sizeof wanted) == 0",
    keep: &["scale"],
};

fn has_compiler() -> bool {
    let found = tools::c_compiler().is_some();
    if !found {
        assert!(std::env::var_os("CI").is_none(), "a C compiler is missing, and CI must have it");
        println!("skipped: a C compiler is not installed");
    }
    found
}

fn read(case: &Case, options: &Options) -> (Parsed, Valid<Net>) {
    let options = Options {
        keep: case.keep.iter().map(|name| (*name).to_owned()).collect(),
        ..options.clone()
    };
    let parsed = parse_within(FileId(0), case.source, &Limits::default(), &options);
    let design = parsed.design.as_ref().unwrap_or_else(|| panic!("{:#?}", parsed.diagnostics));
    // The chart is read from its text, as a user would read it.
    let written = graf::write_design(design);
    let again = graf::parse(FileId(1), &written);
    assert!(again.diagnostics.is_empty(), "{:#?}\n{written}", again.diagnostics);
    let (net, found) = lower::lower(&again.design.expect("a chart"));
    (parsed, net.unwrap_or_else(|| panic!("{found:#?}\n{written}")))
}

fn compare(case: &Case, options: &Options, n_calls: u64) {
    let (parsed, net) = read(case, options);
    let facts = pipeline::facts(&net, &grafsynth_verify::Limits::default());
    let mut package = emit(&net, &facts, &grafsynth_backend_c::Options::default()).expect("C");
    let name = case.name;
    if let Some(library) = parsed.library {
        let file =
            package.files.iter().find(|file| file.keep_existing).map(|file| file.name.clone());
        assert_eq!(
            file.as_deref(),
            Some(format!("{name}_chart_user.c").as_str()),
            "the stub that the library replaces"
        );
        package.files.push(File {
            name: "library.c".to_owned(),
            text: library,
            keep_existing: false,
            map: Vec::new(),
            kind: FileKind::Source,
        });
    }
    let Case { source, arguments, original, chart, same, .. } = case;
    let main = format!(
        "#include <stdio.h>\n#include <stdint.h>\n#include <string.h>\n{source}\n#include \"{name}_chart.h\"
static uint32_t seed = 1u;
static int rnd(int n) {{ seed ^= seed << 13; seed ^= seed >> 17; seed ^= seed << 5; return (int)(seed % (uint32_t)n); }}
{arguments}
int main(void)
{{
    static {name}_chart_t chart;
    static {name}_chart_in_t in;
    static {name}_chart_out_t out;
    long call, scan, all = 0;
    {name}_chart_init(&chart, &out);
    for (call = 0; call < {n_calls}L; call++) {{
        {original}
        {chart}
        in.start = 1;
        for (scan = 0; !out.done; scan++) {{
            if (scan > 100000) {{ printf(\"call %ld: the chart does not end\\n\", call); return 1; }}
            {name}_chart_step(&chart, &in, &out);
        }}
        all += scan;
        if (!({same})) {{ printf(\"call %ld: the chart gives another result\\n\", call); return 1; }}
        in.start = 0;
        while (out.done) {name}_chart_step(&chart, &in, &out);
    }}
    printf(\"%ld reactions for %ld calls\\n\", all, call);
    return 0;
}}
"
    );
    let program = c::compile(&package, &main, &["-std=gnu99", "-O1", "-w"])
        .unwrap_or_else(|why| panic!("{name}: {why}"));
    let limit = Duration::from_secs(600);
    let ran = tools::run(&program.path, &[], program.folder.path(), b"", limit).expect("it runs");
    let output = String::from_utf8_lossy(&ran.stdout);
    assert!(ran.is_success, "{name}, {options:?}: {output}{}", ran.ending);
    println!("{name}: {}", output.trim());
}

/// The default options, and all options together; with `GRAFSYNTH_DEEP` also the combinations in between.
fn variants() -> Vec<Options> {
    let default = Options::default();
    let mut all = vec![
        default.clone(),
        Options { fuse: true, group: Group::Blocks, calls: Calls::Share, ..default.clone() },
        Options { fuse: true, ..default.clone() },
        Options { calls: Calls::Share, group: Group::Comments, ..default },
    ];
    all.truncate(usize::try_from(rounds(2, 4)).unwrap_or(4));
    all
}

#[test]
fn atoi_as_printed_in_1988() {
    if has_compiler() {
        variants().iter().for_each(|options| compare(&ATOI, options, rounds(2_000, 100_000)));
    }
}

#[test]
fn duffs_device() {
    if has_compiler() {
        variants().iter().for_each(|options| compare(&DUFF, options, rounds(1_000, 100_000)));
    }
}

#[test]
fn every_statement_of_the_paper() {
    if has_compiler() {
        variants().iter().for_each(|options| compare(&STATEMENTS, options, rounds(2_000, 100_000)));
    }
}

#[test]
fn a_cell_controller() {
    if has_compiler() {
        variants().iter().for_each(|options| compare(&CELL, options, rounds(500, 100_000)));
    }
}

#[test]
fn what_stays_c() {
    if has_compiler() {
        variants().iter().for_each(|options| compare(&MEAN, options, rounds(2_000, 100_000)));
    }
}

/// The number of reactions until the function has returned, and its result.
fn simulate(net: &Valid<Net>, inputs: &[(&str, i64)], output: &str) -> (usize, i64) {
    let mut simulator = Simulator::new(net);
    simulator.reset();
    let mut row = InputRow::zero(net);
    row.dt = 1;
    for (name, value) in inputs.iter().chain(&[("start", 1)]) {
        let id = net.inputs.iter().find(|(_, input)| input.name.text == *name).map(|(id, _)| id);
        row = row.with(id.unwrap_or_else(|| panic!("no input {name}")), *value);
    }
    let find = |name: &str| {
        net.outputs
            .iter()
            .find(|(_, one)| one.name.text == name)
            .map(|(id, _)| id)
            .expect("an output")
    };
    let (done, result) = (find("done"), find(output));
    for n in 1..10_000 {
        let row = simulator.step(&row);
        if row.outputs[done.index()] == 1 {
            return (n, row.outputs[result.index()]);
        }
    }
    panic!("the chart does not end");
}

#[test]
fn fused_charts_take_fewer_reactions_in_the_simulator() {
    let text: Vec<(String, i64)> = "  4711x"
        .bytes()
        .enumerate()
        .map(|(at, byte)| (format!("s_{at}"), i64::from(byte)))
        .collect();
    let inputs: Vec<(&str, i64)> =
        text.iter().map(|(name, value)| (name.as_str(), *value)).collect();
    let (_, plain) = read(&ATOI, &Options::default());
    let (_, fused) = read(&ATOI, &Options { fuse: true, ..Options::default() });
    let (n_plain, value) = simulate(&plain, &inputs, "return_int_out");
    assert_eq!(value, 4711);
    let (n_fused, value) = simulate(&fused, &inputs, "return_int_out");
    assert_eq!(value, 4711);
    assert!(n_fused * 3 < n_plain * 2, "{n_fused} and {n_plain} reactions");
}
