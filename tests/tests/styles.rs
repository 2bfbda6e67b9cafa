//! Random charts in every style of C, with all options, compared with the reference simulator: under the sanitizers, and as C++.
//!
//! A chart that a style rejects is counted separately, not as run. A chart that shows a difference is shrunk and printed; put it under
//! `tests/cases/mismatch` after the bug is fixed.

#![allow(clippy::print_stdout, reason = "tests report what they skip and what they counted")]

use grafsynth_backend_c::Style;
use grafsynth_tests::fleet::{Compiler, PROPERTIES, check, draw, draw_of};
use grafsynth_tests::random_net::Features;
use grafsynth_tests::rounds;

/// The number of charts in a program: a compiler starts once for all of them.
const UNIT: usize = 20;

/// Generates and runs charts, and reports them.
fn agree(style: Style, few: u64, many: u64) {
    let Some(compiler) = Compiler::watchful().or_else(|| {
        assert!(std::env::var_os("CI").is_none(), "sanitizers are missing, and CI must have them");
        println!("skipped: the sanitizers are not here");
        Compiler::plain()
    }) else {
        println!("skipped: a C compiler is not installed");
        return;
    };
    let drawn = draw(style, rounds(few, many));
    println!("style {}: {drawn}", style.name());
    // With a style that supports every chart, every feature of charts must have occurred.
    if drawn.charts.len() >= 1000 && matches!(style, Style::Auto | Style::Bits | Style::Program) {
        for (property, _) in PROPERTIES {
            // No engine checks the state of its instance (G0630).
            let is_refused = style == Style::Program && *property == "safe state";
            assert_eq!(drawn.with(property) == 0, is_refused, "charts with {property}");
        }
    }
    check(&drawn, UNIT, &compiler);
}

/// No implicit conversion changes a number, in any style.
#[test]
fn numbers_stay_what_they_are() {
    let Some(compiler) = Compiler::exact() else {
        assert!(std::env::var_os("CI").is_none(), "clang is missing, and CI must have it");
        println!("skipped: clang with its check of integers is not here");
        return;
    };
    for style in Style::ALL {
        check(&draw(style, rounds(2, 20)), UNIT, &compiler);
    }
}

/// Statecharts whose lists read states that are entered or left at the same time, with lists of histories and with delayed sends.
#[test]
fn entering_and_leaving_is_what_the_net_does() {
    let Some(compiler) = Compiler::plain() else {
        println!("skipped: a C compiler is not installed");
        return;
    };
    for style in Style::ALL {
        // For most of these charts, `auto` chooses the style of states and transitions.
        let few = if style == Style::Auto { 60 } else { 10 };
        let drawn = draw_of(style, rounds(few, 2_000), &Features::entering());
        println!("style {}: {} of the charts", style.name(), drawn.charts.len());
        check(&drawn, UNIT, &compiler);
    }
}

#[test]
fn the_best_style_does_what_the_net_does() {
    agree(Style::Auto, 5, 1000);
}

#[test]
fn a_switch_does_what_the_net_does() {
    agree(Style::Switch, 5, 1000);
}

#[test]
fn tables_do_what_the_net_does() {
    agree(Style::Tables, 5, 1000);
}

#[test]
fn bits_do_what_the_net_does() {
    agree(Style::Bits, 5, 1000);
}

#[test]
fn the_table_engine_does_what_the_net_does() {
    agree(Style::Engine, 5, 1000);
}

#[test]
fn states_and_transitions_as_tables_do_what_the_net_does() {
    agree(Style::Btrans, 5, 1000);
}

#[test]
fn byte_code_does_what_the_net_does() {
    agree(Style::Program, 5, 1000);
}
