//! A library of the Arduino IDE (library specification 1.5, revision 2.2): `library.properties`, `src/`, and an example sketch.

use super::board::{self, Signal, pins};
use super::cmake::VERSION;
use super::ticks::Ratio;
use super::{Chart, written, yours};
use crate::File;
use crate::c::print::comment_text;
use crate::harness::arguments;
use crate::io::Structure;
use grafsynth_c::storage;

pub(super) fn files(chart: &Chart<'_>) -> Vec<File> {
    let name = chart.name();
    let mut files = chart.c_files("src/", "src/");
    files.push(written("library.properties", properties(chart)));
    files.push(written("keywords.txt", keywords(chart)));
    files.push(written("README.md", chart.readme(&head(chart))));
    files.push(yours(format!("examples/{name}/{name}.ino"), sketch(chart)));
    files
}

/// The fields that the library manager requires, one line each; a value contains no line break.
fn properties(chart: &Chart<'_>) -> String {
    let (name, about) = (chart.name(), chart.about());
    let home = env!("CARGO_PKG_REPOSITORY");
    // Names that begin with `Arduino` are reserved for official libraries.
    let title = if name.to_ascii_lowercase().starts_with("arduino") {
        format!("chart {name}")
    } else {
        name.to_owned()
    };
    format!(
        "name={title}\nversion={VERSION}\nauthor=grafsynth\nmaintainer=grafsynth\nsentence={about}\nparagraph=A controller made from a chart: {name}_init() once, {name}_step() in each loop. The example has a table of pins.\n\
         category=Device Control\nurl={home}\narchitectures=*\nincludes={}.h\n",
        chart.stem()
    )
}

/// Words that the editor highlights: the type and the functions.
fn keywords(chart: &Chart<'_>) -> String {
    let name = chart.name();
    let mut text = String::new();
    for ty in ["t", "in_t", "out_t"] {
        text += &format!("{name}_{ty}\tKEYWORD1\n");
    }
    for function in ["init", "step", "stop"] {
        text += &format!("{name}_{function}\tKEYWORD2\n");
    }
    text
}

fn head(chart: &Chart<'_>) -> String {
    let name = chart.name();
    format!(
        "A library for Arduino. Put this folder into the `libraries` folder of your sketchbook (or install it as a .zip), then open the example `{name}`: the table of pins is at its top.\n\n\
         With arduino-cli, from this folder:\n\n```text\narduino-cli compile --fqbn arduino:avr:uno --library . examples/{name}\narduino-cli upload --fqbn arduino:avr:uno --port /dev/ttyUSB0 examples/{name}\n```\n"
    )
}

/// The sketch: pins, `setup`, `loop`. It is also the program of the PlatformIO example.
pub(super) fn sketch(chart: &Chart<'_>) -> String {
    let interface = &chart.package.interface;
    let name = chart.name();
    let (inputs, outputs) = (
        board::inputs(chart, Structure::Local("in")),
        board::outputs(chart, Structure::Local("out")),
    );
    let has_events = inputs.iter().any(|it| it.is_event);
    let mut text = format!(
        "/* {}: the chart on an Arduino. This sketch is yours. */\n#include <{}.h>\n",
        comment_text(&chart.net.name.text),
        chart.stem()
    );
    if has_events {
        text += &format!("#include <{}_port.h>\n", chart.stem());
    }
    text += &pin_table(&inputs, &outputs);
    for variable in interface.variables(inputs.iter().any(|it| !it.is_event)) {
        text += &format!("static {variable}\n");
    }
    if has_events {
        text += &format!("static {name}_ring_t ring;\n");
    }
    for signal in inputs.iter().filter(|it| it.is_event) {
        text += &format!("static bool was_{} = false;\n", signal.member);
    }
    // The resolution of `micros` suits any tick, but it overflows after 71 minutes; milliseconds are cheaper.
    let is_coarse = chart.net.settings.tick_ns.is_multiple_of(1_000_000);
    let (clock, unit) = if is_coarse { ("millis", 1_000_000) } else { ("micros", 1_000) };
    if interface.ticks.is_some() {
        text += "static uint32_t last = 0U;\n";
    }
    text.push('\n');
    text += &Ratio::of(chart, unit, "uint32_t").function(chart, "ticks_of");
    if interface.has_out {
        text += "static void write_outputs(void)\n{\n";
        for signal in &outputs {
            text += &format!("    {}\n", write(signal));
        }
        text += "}\n\n";
    }
    text += "void setup()\n{\n";
    for (prefix, signal) in pins(&inputs, &outputs) {
        let mode = if prefix == "OUT" { "OUTPUT" } else { "INPUT" };
        text += &format!("    pinMode({prefix}_{}, {mode});\n", signal.member);
    }
    for signal in outputs.iter().filter(|it| !it.ty.is_bool()) {
        text += &format!("    pinMode(OUT_{}, OUTPUT);\n", signal.member);
    }
    text += &format!("    {name}_init({});\n", arguments(interface, false));
    if interface.has_out {
        text += "    write_outputs();\n";
    }
    if interface.ticks.is_some() {
        text += &format!("    last = (uint32_t){clock}();\n");
    }
    text += "}\n\nvoid loop()\n{\n";
    if let Some(ticks) = interface.ticks {
        text += &format!(
            "    const uint32_t now = (uint32_t){clock}();\n    const {} ticks = ticks_of(now - last);\n    last = now;\n",
            ticks.name()
        );
    }
    for signal in &inputs {
        let level = |pin: &str| format!("digitalRead({pin}) == HIGH");
        text += &board::read(chart, signal, "    ", level, &measured(signal));
    }
    text += &format!("    {}\n", board::step(chart));
    if interface.has_out {
        text += "    write_outputs();\n";
    }
    text += "}\n";
    text
}

fn pin_table(inputs: &[Signal], outputs: &[Signal]) -> String {
    let mut text = String::from(
        "\n/* ---- PINS: the pin of each signal. Change the numbers. ----\n   Numbers come from analog inputs (0 to 1023) and go to pins with PWM (0 to 255), scaled to their ranges. */\n",
    );
    // Pins 0 and 1 are the serial line of most boards.
    let mut pin = 2;
    for (prefix, signal) in pins(inputs, outputs) {
        text += &format!("#define {prefix}_{} {pin} /* {} */\n", signal.member, signal.note);
        pin = 255.min(pin + 1);
    }
    for (index, signal) in inputs.iter().filter(|it| !it.ty.is_bool()).enumerate() {
        let (lo, hi) = signal.ty.bounds();
        text += &format!(
            "#define IN_{} (A0 + {index}) /* {}, {lo}..{hi} */\n",
            signal.member, signal.note
        );
    }
    for signal in outputs.iter().filter(|it| !it.ty.is_bool()) {
        let (lo, hi) = signal.ty.bounds();
        text += &format!("#define OUT_{} {pin} /* {}, {lo}..{hi} */\n", signal.member, signal.note);
        pin = 255.min(pin + 1);
    }
    text += "/* --------------------------------------------------------------- */\n\n";
    text
}

/// 0 to 1023 scaled to the range of an input.
fn measured(signal: &Signal) -> String {
    let (lo, hi) = signal.ty.bounds();
    let (ty, width) = (storage(signal.ty), hi.saturating_sub(lo));
    format!("({ty})(({width}LL * analogRead(IN_{})) / 1023 + ({lo}LL))", signal.member)
}

/// An output's value at its pin; numbers are scaled to 0 to 255.
fn write(signal: &Signal) -> String {
    let value = (signal.access)("");
    if signal.ty.is_bool() {
        return format!("digitalWrite(OUT_{}, {value} ? HIGH : LOW);", signal.member);
    }
    let (lo, hi) = signal.ty.bounds();
    let width = hi.saturating_sub(lo).max(1);
    format!("analogWrite(OUT_{}, (int)((({value} - ({lo}LL)) * 255) / {width}LL));", signal.member)
}
