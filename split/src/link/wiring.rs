//! `NAME_wiring.md` and `NAME_wiring.svg`: the connections from pin to pin.

use grafsynth_ir::division::{Running, Shown};
use grafsynth_ir::markup::escape;
use std::fmt::Write;

use super::{Carries, Connection, End, Link, OSCILLATOR_HZ, Request, in_reset};

/// The wiring as a table: each connection with its pins, and the resistors.
#[must_use]
pub fn wiring_md(request: &Request<'_>, link: &Link) -> String {
    let (name, cpu) = (&request.stem, request.cpu);
    let mut text = format!(
        "# Wiring of {name}\n\nCPU: `{}` in {}, supply {}. Sources of these figures: {}. Compare all figures that are \"not verified\" with the data sheet before you wire the CPU.\n\n",
        cpu.name, cpu.package, cpu.supply, cpu.source
    );
    for (part, chip) in request.chips.iter().enumerate() {
        _ = writeln!(
            text,
            "Chip {}: `{}`, `{}`.\n",
            part + 1,
            part_name(request, part),
            chip.device
        );
    }
    text += "| connection | carries | from | to | resistor |\n|---|---|---|---|---|\n";
    for [name, carried, from, to, resistor] in wiring_rows(request, link) {
        _ = writeln!(text, "| {name} | {carried} | {from} | {to} | {resistor} |");
    }
    let used: Vec<u32> = link
        .connections
        .iter()
        .flat_map(ends)
        .filter(|end| end.part == request.chips.len())
        .map(|end| end.pin)
        .collect();
    let free: Vec<String> = cpu
        .pins
        .iter()
        .filter(|pin| !used.contains(&pin.number))
        .map(|pin| format!("{} ({})", cpu.pin_name(*pin), pin.number))
        .collect();
    let free = if free.is_empty() { "none".to_owned() } else { free.join(", ") };
    _ = writeln!(
        text,
        "\nFree pins of the CPU, for the inputs and outputs of the plant: {free}.\n"
    );
    if request.division.running == Running::Free {
        text += &on_their_own(link);
        return text;
    }
    text += "The resistors define the inputs of the chips while the CPU is in reset, so no chip receives a clock edge or changes its state then.\n";
    let has = |carries: Carries| link.connections.iter().any(|one| one.carries == carries);
    if has(Carries::Reset) {
        text += "The initialisation of the link resets the chips, so the CPU alone can be reset at any time.\n";
    } else if request.net.settings.policy.is_statechart() {
        text += "The chips store nothing, so the CPU alone can be reset at any time.\n";
    } else if has(Carries::Clock) {
        text += "The chips start in their initial states at power-up. A reset of the CPU alone does not reset them: turn the power of all parts off and on together.\n";
    }
    text += safety(request);
    let (emergency, direct): (Vec<_>, Vec<_>) =
        link.direct.iter().partition(|one| one.is_emergency);
    if !emergency.is_empty() {
        text += "Connect the inputs that the table marks \"for the emergency\" to the CPU, too: these chips make their outputs safe without the CPU.\n";
    }
    let is_all = emergency.is_empty() && direct.is_empty();
    _ = writeln!(
        text,
        "Connect the {}inputs of the plant only to the CPU. It latches them, so all parts see the same values.",
        if is_all { "" } else { "other " }
    );
    if !direct.is_empty() {
        let which = if emergency.is_empty() { "The" } else { "The other" };
        _ = writeln!(
            text,
            "{which} inputs that the table connects from the plant to chips are not connected to the CPU, which does not read them. Only outputs of these chips depend on them, and\n\
             follow them at any time, also between two rounds and before the first one. Such an input has the value of the moment in which a round ends."
        );
    }
    text
}

/// Whether the outputs of the chips are safe while the CPU is in reset.
fn safety(request: &Request<'_>) -> &'static str {
    let chips = request.division.parts.iter().take(request.chips.len());
    let mut shown = chips.filter(|part| part.net.emergency.is_some());
    if !shown.any(|part| part.outputs.values().any(|it| matches!(it, Shown::Output(_)))) {
        return "";
    }
    match in_reset::safe(request.net) {
        Some(_) => {
            "They also cause the emergency: while the CPU is in reset, the outputs of the chips have their safe values.\n"
        }
        None => {
            "They do not cause the emergency: no values of its inputs were found with which it is true in every state. So the outputs of the chips may be unsafe while the CPU is in reset.\n"
        }
    }
}

/// The instructions for parts that run on their own.
fn on_their_own(link: &Link) -> String {
    let mut text = format!(
        "Each chip has a clock of its own: connect an oscillator of {} MHz to the clock pins in the table. With another one, which the chip must allow, its reactions take other times.\n",
        OSCILLATOR_HZ / 1_000_000
    );
    if !link.direct.is_empty() {
        text += "Connect each input of the plant to the chips in the table and, if the part on the CPU reads it, also to a pin of the CPU, which your program reads.\n";
    }
    if link.connections.iter().any(|one| one.pull.is_some()) {
        text += "The resistors give the wires from the CPU their first levels while the CPU is in reset.\n";
    }
    text += match link.connections.iter().any(|one| one.carries == Carries::Reset) {
        true => {
            "The wire `reset` holds the chips in their initial states until the initialisation of the link has ended, so the CPU alone can be reset, if all inputs are 0 then.\n"
        }
        false => {
            "The parts start in their initial states at power-up. A reset of the CPU alone does not reset the chips: turn the power of all parts off and on together.\n"
        }
    };
    text += "All inputs must be 0 until all parts have started. Later, one input at a time may change (docs/split.md, Free-running chips).\n";
    text
}

/// The rows of the wiring table: the name of a connection, what it carries, its pins, and its resistor.
#[must_use]
pub fn wiring_rows(request: &Request<'_>, link: &Link) -> Vec<[String; 5]> {
    let cpu = request.cpu;
    let ends = |all: &[End]| -> String {
        let all: Vec<String> = all.iter().map(|end| pin_text(request, *end)).collect();
        if all.is_empty() { "the plant".to_owned() } else { all.join(", ") }
    };
    let none = || "none".to_owned();
    let mut rows = Vec::new();
    for one in &link.connections {
        let resistor = match one.pull {
            Some(true) => format!("{} Ω to the supply", cpu.pull_ohms),
            Some(false) => format!("{} Ω to ground", cpu.pull_ohms),
            None => none(),
        };
        let carried = carried(request, one.carries);
        rows.push([one.name.clone(), carried, ends(&[one.from]), ends(&one.to), resistor]);
    }
    if !link.oscillator.is_empty() {
        let carried = carried(request, Carries::Clock);
        let clock = "oscillator".to_owned();
        rows.push([clock.clone(), carried, clock, ends(&link.oscillator), none()]);
    }
    for one in &link.direct {
        let carries = Carries::Input { input: one.input, bit: one.bit };
        let mut carried = carried(request, carries);
        if one.is_emergency {
            carried += ", for the emergency";
        }
        rows.push([one.name.clone(), carried, ends(&[]), ends(&one.to), none()]);
    }
    for (part, pin) in grounded(request) {
        let chip = format!("{} {pin}", part_name(request, part));
        let carried = "enables outputs while it is low".to_owned();
        rows.push(["ground".to_owned(), carried, "ground".to_owned(), chip, none()]);
    }
    rows
}

/// The pins of chips that are connected to ground.
fn grounded<'r>(request: &'r Request<'_>) -> impl Iterator<Item = (usize, u32)> + 'r {
    let chips = request.chips.iter().enumerate();
    chips.flat_map(|(part, chip)| chip.grounded.iter().map(move |pin| (part, *pin)))
}

fn ends(one: &Connection) -> impl Iterator<Item = End> + '_ {
    [one.from].into_iter().chain(one.to.iter().copied())
}

fn part_name<'r>(request: &'r Request<'_>, part: usize) -> &'r str {
    request.division.parts.get(part).map_or("", |part| part.name.as_str())
}

/// A pin as people call it: `cpu PB0 (14)`, `chip1 5`.
fn pin_text(request: &Request<'_>, end: End) -> String {
    let name = part_name(request, end.part);
    match request.cpu.pin_number(end.pin) {
        Some(pin) if end.part == request.chips.len() => {
            format!("{name} {} ({})", request.cpu.pin_name(pin), end.pin)
        }
        _ => format!("{name} {}", end.pin),
    }
}

fn carried(request: &Request<'_>, carries: Carries) -> String {
    let net = request.net;
    match carries {
        Carries::Clock => "clock of all chips".to_owned(),
        Carries::Tick => "1 if a tick passes".to_owned(),
        Carries::Reset => "resets the chips at the clock".to_owned(),
        Carries::Input { input, bit } if net.inputs[input].ty.is_bool() => {
            format!("input `{}`, bit {bit}", net.inputs[input].name.text).replace(", bit 0", "")
        }
        Carries::Input { input, bit } => {
            format!("input `{}`, bit {bit}", net.inputs[input].name.text)
        }
        Carries::Wire(signal) => signal.describe(net),
        Carries::More => "1 if another round of the reaction follows".to_owned(),
        Carries::Moves(_) => "1 if a transition of the chip fires in this round".to_owned(),
        Carries::Plant { output, bit } => {
            let declared = &net.outputs[output];
            let bit = if declared.ty.is_bool() { String::new() } else { format!(", bit {bit}") };
            format!("output `{}`{bit}", declared.name.text)
        }
    }
}

/// The colours: those of paper, or of a dark screen if the viewer prefers it.
const STYLE: &str = "<style>svg{background:#fff}line,rect{stroke:#111;fill:none}text{fill:#111}\
    @media (prefers-color-scheme:dark){svg{background:#16181d}line,rect{stroke:#e8e8e8}text{fill:#e8e8e8}}</style>\n";

/// The height of a row of the drawing; the following constants are the positions of its columns.
const ROW: usize = 22;
const CPU_LEFT: usize = 20;
const CPU_RIGHT: usize = 190;
const CHIP_LEFT: usize = 430;
const CHIP_RIGHT: usize = 600;
/// The width of the drawing, if its labels do not need more.
const LEAST_WIDTH: usize = 780;
/// The width of a letter, generously.
const LETTER: usize = 8;

/// The wiring as a drawing: the CPU on the left, the chips on the right, and one horizontal line per pin, so that no lines cross.
#[must_use]
pub fn wiring_svg(request: &Request<'_>, link: &Link) -> String {
    let cpu = request.chips.len();
    let mut body = String::new();
    let mut y = 40;
    for part in 0..cpu {
        let top = y;
        y += 2 * ROW;
        for one in &link.connections {
            for end in ends(one).filter(|end| end.part == part) {
                row(&mut body, request, one, end, y);
                y += ROW;
            }
        }
        for one in &link.direct {
            for end in one.to.iter().filter(|end| end.part == part) {
                outside(&mut body, end.pin, &format!("← {}: the plant", escape(&one.name)), y);
                y += ROW;
            }
        }
        for end in link.oscillator.iter().filter(|end| end.part == part) {
            outside(&mut body, end.pin, "← oscillator", y);
            y += ROW;
        }
        for (_, pin) in grounded(request).filter(|(at, _)| *at == part) {
            outside(&mut body, pin, "← ground", y);
            y += ROW;
        }
        let title = format!("{} {}", part_name(request, part), request.chips[part].device);
        package(&mut body, CHIP_LEFT, CHIP_RIGHT, (top, y), &title);
        y += ROW;
    }
    package(
        &mut body,
        CPU_LEFT,
        CPU_RIGHT,
        (40, y.max(80) - ROW),
        &format!("{} {}", part_name(request, cpu), request.cpu.name),
    );
    let plant = link.connections.iter().filter(|one| matches!(one.carries, Carries::Plant { .. }));
    let labels = plant.map(|one| one.name.chars().count() + "→ ".chars().count());
    let direct = link.direct.iter();
    let direct = direct.map(|one| one.name.chars().count() + "← : the plant".chars().count());
    let width = LEAST_WIDTH.max(CHIP_RIGHT + 36 + LETTER * labels.chain(direct).max().unwrap_or(0));
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{}\" viewBox=\"0 0 {width} {0}\" font-family=\"sans-serif\" font-size=\"12\">\n{STYLE}{body}</svg>\n",
        y + 20
    )
}

fn package(
    body: &mut String,
    left: usize,
    right: usize,
    (top, bottom): (usize, usize),
    title: &str,
) {
    let (width, height) = (right - left, bottom.saturating_sub(top));
    _ = writeln!(body, "<rect x=\"{left}\" y=\"{top}\" width=\"{width}\" height=\"{height}\"/>");
    _ = writeln!(
        body,
        "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\" font-weight=\"bold\">{}</text>",
        (left + right) / 2,
        top + 16,
        escape(title)
    );
}

/// A pin of a chip: a line to the CPU on its left, or to the plant or another chip on its right.
fn row(body: &mut String, request: &Request<'_>, one: &Connection, end: End, y: usize) {
    let cpu = request.chips.len();
    let is_driven = one.from == end;
    let text_y = y + 4;
    let name = escape(&one.name);
    let at_cpu = ends(one).find(|other| other.part == cpu);
    let line =
        |from: usize, to: usize| format!("<line x1=\"{from}\" y1=\"{y}\" x2=\"{to}\" y2=\"{y}\"/>");
    if let Some(at_cpu) = at_cpu.filter(|at_cpu| is_driven || one.from == *at_cpu) {
        _ = writeln!(body, "{}", line(CPU_RIGHT, CHIP_LEFT));
        let pin = request
            .cpu
            .pin_number(at_cpu.pin)
            .map(|pin| request.cpu.pin_name(pin))
            .unwrap_or_default();
        let arrow = if is_driven { format!("← {name}") } else { format!("{name} →") };
        let middle = (CPU_RIGHT + CHIP_LEFT) / 2;
        _ = writeln!(
            body,
            "<text x=\"{}\" y=\"{text_y}\" text-anchor=\"end\">{pin} ({})</text>",
            CPU_RIGHT - 6,
            at_cpu.pin
        );
        _ = writeln!(
            body,
            "<text x=\"{middle}\" y=\"{}\" text-anchor=\"middle\">{arrow}</text>",
            y - 3
        );
        _ = writeln!(body, "<text x=\"{}\" y=\"{text_y}\">{}</text>", CHIP_LEFT + 6, end.pin);
    }
    let others: Vec<String> = if is_driven {
        one.to
            .iter()
            .filter(|other| other.part != cpu)
            .map(|other| pin_text(request, *other))
            .collect()
    } else if one.from.part != cpu {
        vec![pin_text(request, one.from)]
    } else {
        Vec::new()
    };
    if at_cpu.is_none() || !others.is_empty() {
        let label = if others.is_empty() {
            name
        } else {
            format!("{name}: {}", escape(&others.join(", ")))
        };
        let arrow = if is_driven { "→" } else { "←" };
        outside(body, end.pin, &format!("{arrow} {label}"), y);
    }
}

/// A pin at the right side of a chip, with a line to a label.
fn outside(body: &mut String, pin: u32, label: &str, y: usize) {
    let text_y = y + 4;
    _ = writeln!(
        body,
        "<line x1=\"{CHIP_RIGHT}\" y1=\"{y}\" x2=\"{}\" y2=\"{y}\"/>",
        CHIP_RIGHT + 30
    );
    _ = writeln!(
        body,
        "<text x=\"{}\" y=\"{text_y}\" text-anchor=\"end\">{pin}</text>",
        CHIP_RIGHT - 6
    );
    _ = writeln!(body, "<text x=\"{}\" y=\"{text_y}\">{label}</text>", CHIP_RIGHT + 36);
}
