//! The proof of C by induction.

#![allow(clippy::print_stdout, reason = "tests report what they counted")]

use grafsynth_backend_c::{Options, Style, emit};
use grafsynth_driver::c_proof::prove_c;
use grafsynth_tests::fleet::draw;
use grafsynth_tests::rounds;
use grafsynth_verify::{Limits, facts};

#[test]
fn scratch() {
    let Ok(files) = std::env::var("SCRATCH") else { return };
    for file in files.split_whitespace() {
        let text = std::fs::read_to_string(file).unwrap_or_default();
        let Ok(design) = grafsynth_tests::conversions::design_of(file, &text) else { println!("{file}: no design"); continue };
        let net = &design.net;
        let facts = facts(net, &Limits::default());
        for style in [Style::Auto, Style::Bits] {
            let options = Options { style, ..Options::default() };
            let Ok(package) = emit(net, &facts, &options) else { continue };
            let start = std::time::Instant::now();
            let proved = prove_c(net, &facts, &package, &Limits::default());
            println!("{file} {} {:?} {:?}", package.style, proved, start.elapsed());
        }
    }
}

#[test]
fn fleet() {
    if std::env::var("FLEET").is_err() { return }
    for style in [Style::Switch, Style::Tables, Style::Bits] {
        let drawn = draw(style, rounds(50, 1000));
        let mut why = std::collections::BTreeMap::new();
        let mut n = 0;
        for chart in &drawn.charts {
            let facts = facts(&chart.net, &Limits::default());
            let options = Options { style, ..Options::default() };
            let Ok(package) = emit(&chart.net, &facts, &options) else { continue };
            n += 1;
            if let Err(e) = prove_c(&chart.net, &facts, &package, &Limits::default()) {
                *why.entry(e).or_insert(0) += 1;
            }
        }
        println!("{}: {n} {why:#?}", style.name());
    }
}
