//! `grafsynth doctor`: lists the external tools found and what they enable.

use crate::exit::Exit;
use grafsynth_engines::{Availability, tools};

/// Programs, with what each of them enables.
const TOOLS: [(&[&str], &str); 12] = [
    (
        &["cc", "gcc", "clang"],
        "engine c; `build` runs the emitted C and compares it with the chart",
    ),
    (&["iverilog"], "engine verilog: the emitted Verilog in an independent simulator"),
    (&["verilator"], "a second simulator and lint for the emitted Verilog (the tests use it)"),
    (&["yosys"], "target ice40: synthesis of the emitted Verilog"),
    (&["nextpnr-ice40"], "target ice40: the bitstream, with icepack"),
    (&["avr-gcc"], "the emitted C for AVR; engine c-avr, with libsimavr-dev"),
    (&["arm-none-eabi-gcc"], "the emitted C for Cortex-M; engine c-arm, with qemu-system-arm"),
    (&["qemu-system-arm"], "engine c-arm: the emitted C on a Cortex-M3"),
    (&["sdcc"], "the emitted C for the 8051; engine c-8051, with s51"),
    (&["s51", "ucsim_51"], "engine c-8051: the emitted C on an 8051"),
    (&["node", "nodejs"], "engine js: the JavaScript of `grafsynth page`"),
    (&["make"], "the Makefile of `grafsynth new`"),
];

pub(crate) fn run() -> Exit {
    let mut text = format!("grafsynth {}\n\nPrograms\n", env!("CARGO_PKG_VERSION"));
    for (names, what) in TOOLS {
        let found = tools::find(names)
            .map_or_else(|| "not found".to_owned(), |path| path.display().to_string());
        text.push_str(&format!("  {:<18} {found:<28} {what}\n", names[0]));
    }
    text.push_str("\nEngines\n");
    for engine in grafsynth_engines::all() {
        let state = match engine.availability() {
            Availability::Here => "ready".to_owned(),
            Availability::Missing(tool) => format!("needs {tool}"),
        };
        text.push_str(&format!("  {:<18} {state:<28} {}\n", engine.name(), engine.about()));
    }
    crate::print(&text);
    Exit::Done
}
