//! Large charts: size, speed and emission time.
#![allow(
    clippy::disallowed_methods,
    reason = "these tests try the text on real compilers and measure"
)]
#![allow(clippy::print_stdout, reason = "tests report what they measured")]

use std::time::Instant;

use grafsynth_backend_c::{Options, Package, Style, emit};

use crate::support::*;

/// A program that measures a reaction with all inputs set to 1.
fn bench(folder: &Folder, package: &Package, name: &str) -> f64 {
    let text = format!(
        r#"#define _POSIX_C_SOURCE 199309L
#include "{name}.h"
#include <stdio.h>
#include <string.h>
#include <time.h>
int main(void)
{{
    static {name}_t self;
    {name}_in_t in;
    {name}_out_t out;
    double best = 1e18;
    memset(&in, 1, sizeof in);
    {name}_init(&self, &out);
    for (int round = 0; round < 9; ++round) {{
        struct timespec a, b;
        clock_gettime(CLOCK_MONOTONIC, &a);
        for (int i = 0; i < 20000; ++i) {{
            {name}_step(&self, &in, &out);
            __asm__ volatile("" : : "r"(&in), "r"(&out) : "memory");
        }}
        clock_gettime(CLOCK_MONOTONIC, &b);
        const double ns = ((double)(b.tv_sec - a.tv_sec) * 1e9 + (double)(b.tv_nsec - a.tv_nsec)) / 20000.0;
        best = ns < best ? ns : best;
    }}
    printf("%.1f\n", best);
    return 0;
}}
"#
    );
    folder.write(package);
    std::fs::write(folder.0.join("bench.c"), text).expect("the file can be written");
    let source = format!("{name}.c");
    run(&folder.0, "gcc", &["-O2", "bench.c", &source, "-o", "bench"]);
    run(&folder.0, "./bench", &[]).trim().parse().expect("a number")
}

#[test]
fn a_thousand_steps_are_fast_and_small() {
    if !have("gcc") {
        return;
    }
    for (name, ring, most_ns) in [("lin_1000", 1000, 50.0), ("par_1000", 10, 200.0)] {
        let (net, facts) = rings(name, 1000, ring);
        let package = emit(&net, &facts, &Options::default()).expect("rings can be emitted");
        let folder = Folder::new(name);
        let ns = bench(&folder, &package, name);
        let size = text_size(&folder, &format!("{name}.c"), "gcc", &[]);
        println!(
            "{name}: {ns} ns of {most_ns}, {} bytes per step (at most 40), {}",
            size as f64 / 1000.0,
            package.style
        );
        assert!(size <= 40_000, "{size} bytes");
        // The limit is for an idle machine; on a busy one this test must not fail.
        assert!(ns <= most_ns * 5.0, "{ns} ns");
    }
}

#[test]
fn the_switch_alone_stays_small_too() {
    if !have("gcc") {
        return;
    }
    for (name, ring) in [("lin_1000", 1000), ("par_1000", 10)] {
        let (net, facts) = rings(name, 1000, ring);
        let options = Options { style: Style::Switch, ..Options::default() };
        let package = emit(&net, &facts, &options).expect("rings can be emitted");
        let folder = Folder::new(&format!("{name}-switch"));
        let ns = bench(&folder, &package, name);
        let size = text_size(&folder, &format!("{name}.c"), "gcc", &[]);
        println!("{name} as switch: {ns} ns, {} bytes per step (at most 40)", size as f64 / 1000.0);
        assert!(size <= 40_000, "{size} bytes");
    }
}

#[test]
fn ten_thousand_steps_are_emitted_at_once() {
    for (name, ring, style) in [
        ("lin_10000", 10_000, Style::Auto),
        ("par_10000", 10, Style::Auto),
        ("lin_10000", 10_000, Style::Switch),
        ("par_10000", 10, Style::Switch),
    ] {
        let (net, facts) = rings(name, 10_000, ring);
        let start = Instant::now();
        let options = Options { style, ..Options::default() };
        let package = emit(&net, &facts, &options).expect("rings can be emitted");
        let seconds = start.elapsed().as_secs_f64();
        let bytes: usize = package.files.iter().map(|file| file.text.len()).sum();
        println!("{name} {}: {seconds:.3} s, {bytes} bytes", package.style);
        assert!(seconds < 15.0, "{seconds} s even without optimisation, and beside other tests");
    }
}
