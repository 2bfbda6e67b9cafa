//! Random C functions: the results of the compiled program, compared with the chart in the simulator.
//!
//! A function that shows a difference is shrunk and printed; put it under `tests/cases/c` after the bug is fixed.

#![allow(clippy::print_stdout, reason = "tests report what they skip")]
#![allow(clippy::disallowed_methods, reason = "the environment says where the seeds begin")]

use grafsynth_engines::{c, tools};
use grafsynth_frontend::c::{Calls, Group, Options, parse_within};
use grafsynth_frontend::graf;
use grafsynth_ir::net::Net;
use grafsynth_ir::{FileId, Valid, lower};
use grafsynth_sim::{InputRow, Random, Simulator};
use grafsynth_tests::random_c::{Program, random_program};
use grafsynth_tests::rounds;
use std::fmt::Write;
use std::time::Duration;

/// The number of programs in one translation unit.
const UNIT: u64 = 25;
/// The number of runs of each program.
const RUNS: usize = 6;
/// The number of reactions after which a chart must have ended: every loop runs out of fuel long before.
const LONGEST: usize = 20_000;

type Arguments = [i32; 3];

fn options(seed: u64) -> Options {
    Options {
        fuse: seed.is_multiple_of(2),
        calls: if seed % 3 == 1 { Calls::Share } else { Calls::Copy },
        group: if seed % 5 == 4 { Group::Blocks } else { Group::Nothing },
        entry: Some("f".to_owned()),
        ..Options::default()
    }
}

/// The net of a program, through the text of its chart.
fn net(program: &Program, options: &Options) -> Result<Valid<Net>, String> {
    let text = program.text("");
    let parsed = parse_within(FileId(0), &text, &graf::Limits::default(), options);
    let design = parsed.design.ok_or_else(|| format!("{:#?}", parsed.diagnostics))?;
    let written = graf::write_design(&design);
    let read = graf::parse(FileId(1), &written);
    let design = read
        .design
        .filter(|_| read.diagnostics.is_empty())
        .ok_or_else(|| format!("{:#?}\n{written}", read.diagnostics))?;
    let (net, found) = lower::lower(&design);
    net.ok_or_else(|| format!("{found:#?}\n{written}"))
}

fn run_chart(net: &Valid<Net>, arguments: Arguments) -> Option<i64> {
    let mut simulator = Simulator::new(net);
    simulator.reset();
    let mut row = InputRow::zero(net);
    row.dt = 1;
    for (id, input) in net.inputs.iter() {
        let value = match input.name.text.as_str() {
            "a" => i64::from(arguments[0]),
            "b" => i64::from(arguments[1]),
            "c" => i64::from(arguments[2]),
            _ => 1,
        };
        row = row.with(id, value);
    }
    let output = |name: &str| {
        net.outputs.iter().find(|(_, output)| output.name.text == name).map(|(id, _)| id)
    };
    let (done, result) = (output("done")?, output("result")?);
    for _ in 0..LONGEST {
        let row = simulator.step(&row);
        if row.outputs[done.index()] == 1 {
            return Some(row.outputs[result.index()]);
        }
    }
    None
}

fn arguments(random: &mut Random) -> Arguments {
    [0; 3].map(|_: i32| {
        let value = match random.below(4) {
            0 => random.between(-3, 3),
            1 => random.between(-300, 300),
            2 => random.between(-70_000, 70_000),
            _ => random.between(i64::from(i32::MIN), i64::from(i32::MAX)),
        };
        i32::try_from(value).expect("in range")
    })
}

/// The results of the compiled programs; `None` if C leaves them undefined.
fn run_compiled(programs: &[&Program], runs: &[Arguments]) -> Vec<Vec<Option<i64>>> {
    let mut text = String::from(
        "#include <stdio.h>\n#include <stdlib.h>\n#include <signal.h>\n#include <setjmp.h>\n",
    );
    for (at, program) in programs.iter().enumerate() {
        text.push_str(&program.text(&format!("_{at}")));
    }
    text.push_str("static sigjmp_buf before;\nstatic void trapped(int signal) { siglongjmp(before, signal); }\nint main(void)\n{\n    int k, a, b, c;\n    signal(SIGILL, trapped); signal(SIGTRAP, trapped); signal(SIGFPE, trapped);\n    while (scanf(\"%d %d %d %d\", &k, &a, &b, &c) == 4) {\n        int r = 0;\n        if (sigsetjmp(before, 1)) { puts(\"u\"); continue; }\n        switch (k) {\n");
    for at in 0..programs.len() {
        let _ = writeln!(text, "        case {at}: r = f_{at}(a, b, c); break;");
    }
    text.push_str("        }\n        printf(\"%d\\n\", r);\n    }\n    return 0;\n}\n");
    let flags =
        ["-std=gnu99", "-O1", "-w", "-fsanitize=undefined", "-fsanitize-undefined-trap-on-error"];
    let program = c::compile_text(&text, &flags).unwrap_or_else(|why| panic!("{why}\n{text}"));
    let mut input = String::new();
    for at in 0..programs.len() {
        for [a, b, c] in runs {
            let _ = writeln!(input, "{at} {a} {b} {c}");
        }
    }
    let ran = tools::run(
        &program.path,
        &[],
        program.folder.path(),
        input.as_bytes(),
        Duration::from_secs(60),
    )
    .expect("it runs");
    assert!(ran.is_success, "{}", ran.ending);
    let output = String::from_utf8(ran.stdout).expect("numbers");
    let mut values = output.lines().map(|line| line.parse::<i64>().ok());
    (0..programs.len()).map(|_| values.by_ref().take(runs.len()).collect()).collect()
}

/// The first run in which chart and compiler differ.
fn difference(
    program: &Program,
    options: &Options,
    runs: &[Arguments],
    expected: &[Option<i64>],
) -> Option<String> {
    let net = match net(program, options) {
        Ok(net) => net,
        Err(why) => return Some(why),
    };
    runs.iter().zip(expected).find_map(|(arguments, expected)| {
        let expected = (*expected)?;
        let got = run_chart(&net, *arguments);
        (got != Some(expected)).then(|| {
            format!("{arguments:?}: expected {expected} (compiler), found {got:?} (chart)")
        })
    })
}

#[test]
fn charts_of_random_functions_compute_what_the_compiler_computes() {
    if tools::c_compiler().is_none() {
        assert!(std::env::var_os("CI").is_none(), "a C compiler is missing, and CI must have it");
        println!("skipped: a C compiler is not installed");
        return;
    }
    let total = rounds(25, 10_000);
    let first =
        std::env::var("GRAFSYNTH_SEED").ok().and_then(|seed| seed.parse().ok()).unwrap_or(0);
    let (mut n_defined, mut n_all) = (0, 0);
    for unit in (first..first + total).step_by(UNIT as usize) {
        let programs: Vec<Program> = (unit..unit + UNIT).map(random_program).collect();
        let mut random = Random::new(unit ^ 0x5eed);
        let runs: Vec<Arguments> = (0..RUNS).map(|_| arguments(&mut random)).collect();
        let expected = run_compiled(&programs.iter().collect::<Vec<_>>(), &runs);
        for ((program, expected), seed) in programs.iter().zip(&expected).zip(unit..) {
            n_all += expected.len();
            n_defined += expected.iter().flatten().count();
            let options = options(seed);
            if let Some(why) = difference(program, &options, &runs, expected) {
                let (small, why) = shrink(program, &options, &runs, why);
                panic!("seed {seed}, {options:?}\n{why}\n{}", small.text(""));
            }
        }
    }
    println!("{n_defined} of {n_all} runs are defined");
    assert!(n_defined * 4 > n_all, "too few runs are defined: {n_defined} of {n_all}");
}

fn shrink(
    program: &Program,
    options: &Options,
    runs: &[Arguments],
    why: String,
) -> (Program, String) {
    let (mut best, mut why) = (program.clone(), why);
    'again: for _ in 0..60 {
        // A program that no longer compiles (a goto without its label) is not a smaller case.
        let candidates: Vec<Program> =
            best.smaller().into_iter().filter(|one| net(one, options).is_ok()).collect();
        if candidates.is_empty() {
            break;
        }
        let expected = run_compiled(&candidates.iter().collect::<Vec<_>>(), runs);
        for (candidate, expected) in candidates.into_iter().zip(expected) {
            if let Some(found) = difference(&candidate, options, runs, &expected) {
                (best, why) = (candidate, found);
                continue 'again;
            }
        }
        break;
    }
    (best, why)
}
