//! The truck example: the golden text, no warning from any compiler, and the documented sizes.

#![allow(clippy::print_stdout, reason = "tests report what they measured")]

use grafsynth_backend_c::{Io, Options, emit};

use crate::support::*;

#[test]
fn the_text_of_the_truck() {
    let (net, facts) = truck();
    let options = Options { source: "truck.graf".to_string(), ..Options::default() };
    let package = emit(&net, &facts, &options).expect("the truck can be emitted");
    assert_eq!(package.style, "switch");
    for file in &package.files {
        insta::assert_snapshot!(file.name.replace('.', "_"), file.text);
    }
}

#[test]
fn the_truck_compiles_everywhere_and_is_small() {
    let (net, facts) = truck();
    let package = emit(&net, &facts, &Options::default()).expect("the truck can be emitted");
    let folder = Folder::new("truck");
    folder.write(&package);
    compiles_everywhere(&folder, &package);
    for (compiler, flags, most) in [
        ("gcc", &[][..], 200),
        ("arm-none-eabi-gcc", &["-mcpu=cortex-m3", "-mthumb"][..], 120),
        ("avr-gcc", &["-mmcu=atmega328p"][..], 120),
    ] {
        if have(compiler) {
            let size = text_size(&folder, "truck.c", compiler, flags);
            println!("truck: {compiler} -Os: {size} bytes (at most {most})");
            assert!(size <= most, "{compiler}: {size} bytes");
        }
    }
}

#[test]
fn odd_charts_compile_everywhere_too() {
    use crate::support::random_net::{Flavour, random_net};
    use grafsynth_backend_c::Style;
    use grafsynth_ir::net::Policy;
    let flavour =
        Flavour { policy: Policy::Priority, stable: true, lists: true, forks: true, times: true };
    for (seed, style, io) in
        [(3, Style::Auto, Io::Members), (4, Style::Bits, Io::Words), (11, Style::Auto, Io::Words)]
    {
        let (net, facts) = random_net("int", seed, flavour);
        // With functions of one transition each and with callbacks, the text has the most parameters that could be wrong.
        let options =
            Options { style, io, callbacks: true, max_transitions: 1, ..Options::default() };
        let package = emit(&net, &facts, &options).expect("it can be emitted");
        let folder = Folder::new(&format!("odd-{seed}"));
        folder.write(&package);
        compiles_everywhere(&folder, &package);
    }
    let (net, facts) = rings("tables", 64, 8);
    let options = Options { callbacks: true, io: Io::Words, gate: true, ..Options::default() };
    let package = emit(&net, &facts, &options).expect("it can be emitted");
    assert_eq!(package.style, "switch with tables");
    let folder = Folder::new("odd-tables");
    folder.write(&package);
    compiles_everywhere(&folder, &package);
}

#[test]
fn a_chart_that_is_called_like_an_engine_is_printed_once() {
    let (net, facts) = truck();
    let options = Options { prefix: Some("grafsynth_truck".to_owned()), ..Options::default() };
    let package = emit(&net, &facts, &options).expect("the truck can be emitted");
    let text = grafsynth_backend_c::multi_harness(&[(&net, &package)]);
    // Once in the header, once in the source.
    assert_eq!(text.matches("\nvoid grafsynth_truck_step(").count(), 2);
}
