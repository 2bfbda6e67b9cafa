//! `board.c`: the chart on a microcontroller without an operating system. The pins are at the top, then the machine, and the loop at the end.

use super::Chart;
use super::ticks::Ratio;
use crate::c::print::comment_text;
use crate::harness::arguments;
use crate::io::Structure;
use grafsynth_c::storage;
use grafsynth_ir::expr::Type;
use grafsynth_ir::net::InputKind;

/// The clock and pins of an AVR, a Cortex-M and an 8051.
const MACHINE: &str = include_str!("text/board.c");

/// An input or output in the examples.
pub(super) struct Signal {
    /// Its member of the structure.
    pub(super) member: String,
    /// A description of the signal, for a comment.
    pub(super) note: String,
    pub(super) ty: Type,
    pub(super) is_event: bool,
    /// `in.x = VALUE;`, or a macro that does the same; for outputs, the expression that reads it.
    pub(super) access: Box<dyn Fn(&str) -> String>,
}

/// The inputs in a structure: pins, then events.
pub(super) fn inputs(chart: &Chart<'_>, place: Structure) -> Vec<Signal> {
    let names = &chart.package.interface.names;
    let inputs = chart.net.inputs.iter();
    inputs
        .filter(|(_, it)| it.kind.is_handed())
        .map(|(id, it)| {
            let member = names.inputs[id].clone();
            let (io, name) = (names.io.clone(), member.clone());
            Signal {
                note: comment_text(&described(&it.name.text, &it.meta.label)),
                member,
                ty: it.ty,
                is_event: it.kind == InputKind::Event,
                access: Box::new(move |value| io.put(place, &name, id, value)),
            }
        })
        .collect()
}

/// The outputs that are not functions.
pub(super) fn outputs(chart: &Chart<'_>, place: Structure) -> Vec<Signal> {
    let names = &chart.package.interface.names;
    let outputs = chart.net.outputs.iter().filter(|(_, it)| !it.is_extern());
    outputs
        .map(|(id, it)| {
            let member = names.outputs[id].clone();
            let (io, name) = (names.io.clone(), member.clone());
            Signal {
                note: comment_text(&described(&it.name.text, &it.meta.label)),
                member,
                ty: it.ty,
                is_event: false,
                access: Box::new(move |_| io.lamp(place, &name, id)),
            }
        })
        .collect()
}

fn described(name: &str, label: &str) -> String {
    if label.is_empty() { name.to_owned() } else { format!("{name}: {label}") }
}

/// The text; `folder` is the path from it to the headers.
pub(super) fn text(chart: &Chart<'_>, folder: &str) -> String {
    let (inputs, outputs) =
        (inputs(chart, Structure::Local("in")), outputs(chart, Structure::Local("out")));
    let mut text = format!(
        "/* {}: the chart on a microcontroller. This file is yours. */\n#include \"{folder}{}.h\"\n",
        comment_text(&chart.net.name.text),
        chart.stem()
    );
    if inputs.iter().any(|it| it.is_event) {
        text += &format!("#include \"{folder}{}_port.h\"\n", chart.stem());
    }
    text += "#include <stddef.h>\n\n";
    text += "/* ---- PINS: the pin of each signal. Change the numbers. ------------------------------------------------ */\n";
    let mut pin = 2;
    for (prefix, signal) in pins(&inputs, &outputs) {
        text += &format!("#define {prefix}_{} {pin}U /* {} */\n", signal.member, signal.note);
        // No machine has a pin 255, so this is the maximum.
        pin = 255.min(pin + 1);
    }
    text += "/* ---------------------------------------------------------------------------------------------------------- */\n\n";
    text += MACHINE;
    text.push('\n');
    let numbers = |signals: &[Signal], function: &dyn Fn(&Signal, &str) -> String| -> String {
        let numeric = signals.iter().filter(|it| !it.ty.is_bool());
        let stub = |signal: &Signal| {
            let ((lo, hi), function) = (signal.ty.bounds(), function(signal, storage(signal.ty)));
            format!("/* FILL IN: a number from {lo} to {hi}. {} */\n{function}\n\n", signal.note)
        };
        numeric.map(stub).collect()
    };
    text += &numbers(&inputs, &|Signal { member, ty, .. }, name| {
        format!("static {name} read_{member}(void)\n{{\n    return {};\n}}", ty.saturate(0))
    });
    text += &numbers(&outputs, &|Signal { member, .. }, name| {
        format!("static void write_{member}({name} value)\n{{\n    (void)value;\n}}")
    });
    text += &Ratio::of(chart, 1_000_000, "uint16_t").function(chart, "ticks_of_ms");
    text += &main(chart, &inputs, &outputs);
    text
}

/// The loop that reads the pins, calls the chart and writes the pins.
fn main(chart: &Chart<'_>, inputs: &[Signal], outputs: &[Signal]) -> String {
    let (name, interface) = (chart.name(), &chart.package.interface);
    let mut text = String::from("int main(void)\n{\n");
    for variable in interface.variables(inputs.iter().any(|it| !it.is_event)) {
        text += &format!("    static {variable}\n");
    }
    if inputs.iter().any(|it| it.is_event) {
        text += &format!("    static {name}_ring_t ring;\n");
    }
    for signal in inputs.iter().filter(|it| it.is_event) {
        text += &format!("    bool was_{} = false;\n", signal.member);
    }
    if interface.ticks.is_some() {
        text += "    uint16_t last;\n";
    }
    text += "\n    board_init();\n";
    if interface.ticks.is_some() {
        text += "    last = board_ms();\n";
    }
    text += &format!("    {name}_init({});\n", arguments(interface, false));
    text += "    for (;;) {\n";
    if let Some(ticks) = interface.ticks {
        text += "        const uint16_t now = board_ms();\n";
        text += &format!(
            "        const {} ticks = ticks_of_ms((uint16_t)(now - last));\n        last = now;\n",
            ticks.name()
        );
    } else {
        text += "        (void)board_ms;\n";
    }
    for signal in inputs {
        let number = format!("read_{}()", signal.member);
        text += &read(chart, signal, "        ", |pin| format!("pin_read({pin})"), &number);
    }
    text += &format!("        {}\n", step(chart));
    for signal in outputs {
        let value = (signal.access)("");
        if signal.ty.is_bool() {
            text += &format!("        pin_write(OUT_{}, {value});\n", signal.member);
        } else {
            text += &format!("        write_{}({value});\n", signal.member);
        }
    }
    if !inputs.iter().any(|it| it.ty.is_bool()) {
        text += "        (void)pin_read;\n";
    }
    if !outputs.iter().any(|it| it.ty.is_bool()) {
        text += "        (void)pin_write;\n";
    }
    text += "    }\n}\n";
    text
}

/// The statements that read an input: `level` is the level of a pin, `number` the value of a numeric input.
pub(super) fn read(
    chart: &Chart<'_>,
    signal: &Signal,
    indent: &str,
    level: impl Fn(&str) -> String,
    number: &str,
) -> String {
    let (name, upper, member) = (chart.name(), chart.upper(), &signal.member);
    if signal.is_event {
        let level = level(&format!("EVENT_{member}"));
        format!(
            "{indent}/* An event is a rising edge here; an interrupt service routine may post it instead. */\n\
             {indent}const bool is_{member} = {level};\n{indent}if (is_{member} && !was_{member}) {{\n\
             {indent}    (void){name}_post(&ring, {upper}_EVENT_{member});\n{indent}}}\n{indent}was_{member} = is_{member};\n"
        )
    } else if signal.ty.is_bool() {
        let level = level(&format!("IN_{member}"));
        let access = (signal.access)(&format!("level_{member}"));
        format!("{indent}const bool level_{member} = {level};\n{indent}{access}\n")
    } else {
        format!("{indent}{}\n", (signal.access)(number))
    }
}

/// The Boolean signals, with the prefix of their pin names: inputs, events, outputs.
pub(super) fn pins<'a>(
    inputs: &'a [Signal],
    outputs: &'a [Signal],
) -> impl Iterator<Item = (&'static str, &'a Signal)> {
    let inputs = inputs.iter().filter(|it| it.ty.is_bool());
    let inputs = inputs.map(|it| (if it.is_event { "EVENT" } else { "IN" }, it));
    inputs.chain(outputs.iter().filter(|it| it.ty.is_bool()).map(|it| ("OUT", it)))
}

/// One scan, with the names of the examples: `self`, `in`, `ticks`, `out`, and `ring` for a chart with events.
pub(super) fn step(chart: &Chart<'_>) -> String {
    let (name, interface) = (chart.name(), &chart.package.interface);
    let has = |kind: InputKind| chart.net.inputs.values().any(|it| it.kind == kind);
    if !has(InputKind::Event) {
        return format!("{name}_step({});", arguments(interface, true));
    }
    let mut all = Vec::new();
    all.extend(interface.has_instance.then_some("&self"));
    all.push("&ring");
    all.extend(has(InputKind::Pin).then_some("&in"));
    all.extend(interface.ticks.map(|_| "ticks"));
    all.extend(interface.has_out.then_some("&out"));
    format!("{name}_scan({});", all.join(", "))
}
