//! The equations of a chip, with the chart's names; for a fuse map, the equations decoded from its fuses.

use super::chip::{Cell, Chip, Kind, Language, plain};
use super::document::{Block, Rich};
use super::{Subject, counted};
use grafsynth_backend_pld::Dialect;
use grafsynth_backend_pld::device::FlipFlop;
use grafsynth_backend_pld::placement::CellKind;
use grafsynth_ir::logic::Node;

pub(super) fn write(_: &Subject<'_>, chip: &Chip) -> Vec<Block> {
    if chip.cells.is_empty() {
        return netlist(chip).into_iter().collect();
    }
    let whence = match chip.language {
        Language::Jedec => "Decoded from the fuses of the file",
        Language::Text(_) => "As in the file",
    };
    let source = if chip.code.is_some() { "chart" } else { "text" };
    let mut signs = "`*` and, `+` or, `/` not, `:=` at the clock".to_owned();
    if chip.cells.iter().any(|cell| cell.is_registered() && cell.flip_flop == FlipFlop::T) {
        signs += ", `.T` toggles if the sum is true";
    }
    if chip.cells.iter().any(|cell| cell.inverter.is_some()) {
        signs += ", `:+: x` inverts the whole sum while x is true";
    }
    let about = format!("{whence}, with the names of the {source}. {signs}.");
    let mut text = String::new();
    for (at, cell) in chip.cells.iter().enumerate() {
        if at > 0 {
            text.push('\n');
        }
        text += &format!("; {}\n{}", heading(chip, cell), equation(chip, cell));
    }
    vec![Block::Paragraph(Rich::say(&about, [])), Block::Text(text)]
}

/// The pin, the form, and the chart's label of the signal.
fn heading(chip: &Chip, cell: &Cell) -> String {
    let mut parts = Vec::new();
    parts.push(match cell.pin {
        Some(pin) => format!("pin {pin}"),
        None if chip.misfit.is_some() => "no pin yet".to_owned(),
        None => "buried, without a pin".to_owned(),
    });
    parts.push(form(cell).to_owned());
    parts.push(if cell.is_complemented {
        "the sum is the complement".to_owned()
    } else {
        "the sum is the signal".to_owned()
    });
    let first = cell.signals.first().map(|signal| &chip.signals[*signal]);
    if first.is_some_and(|signal| signal.is_inverted) {
        parts.push("inverted on its pin".to_owned());
    }
    if first.is_some_and(|signal| signal.kind == Kind::Buried) {
        parts.push("part of a function too wide for one sum".to_owned());
    }
    let mut text = parts.join(", ");
    for signal in &cell.signals {
        let meta = &chip.signals[*signal].meta;
        if !meta.label.is_empty() {
            text += &format!(": {}", plain(&meta.label));
        }
        if !meta.req.is_empty() {
            text += &format!(" [{}]", plain(&meta.req.join(", ")));
        }
    }
    text
}

/// The configuration of the macrocell.
pub(super) fn form(cell: &Cell) -> &'static str {
    match cell.kind {
        CellKind::Registered => match cell.flip_flop {
            FlipFlop::D => "D flip-flop",
            FlipFlop::T => "T flip-flop",
        },
        CellKind::Combinational => "combinational",
        CellKind::Tristate => "combinational with enable",
    }
}

/// The equation, one product per line.
fn equation(chip: &Chip, cell: &Cell) -> String {
    let names = chip.names(cell);
    let Some((first, rest)) = names.split_first() else { return String::new() };
    let sign = if cell.is_registered() { ":=" } else { "=" };
    let suffix = match cell.flip_flop {
        FlipFlop::T if cell.is_registered() => ".T",
        FlipFlop::D | FlipFlop::T => "",
    };
    let head = format!("{}{first}{suffix} {sign}", if cell.is_complemented { "/" } else { "" });
    let mut text = head.clone();
    match cell.sum.as_slice() {
        [] => text += " 0\n",
        sum => {
            // The operators of the sum are aligned with the equals sign.
            let indent = " ".repeat(super::table::width(&head).saturating_sub(1));
            for (at, product) in sum.iter().enumerate() {
                let lead = if at == 0 { " ".to_owned() } else { format!("{indent}+ ") };
                text += &format!("{lead}{}\n", chip.product(product));
            }
        }
    }
    if let Some(inverter) = &cell.inverter {
        text += &format!(
            "{}:+: {}\n",
            " ".repeat(super::table::width(&head).saturating_sub(1)),
            chip.product(inverter)
        );
    }
    for (name, term) in &cell.terms {
        text += &format!("{first}.{name} = {}\n", chip.product(term));
    }
    for other in rest {
        text += &format!("; its pin is also {other}\n");
    }
    text
}

fn netlist(chip: &Chip) -> Option<Block> {
    let language = match chip.language {
        Language::Text(Dialect::Verilog) => "Verilog",
        Language::Text(Dialect::Blif) => "BLIF",
        Language::Text(Dialect::Palasm | Dialect::Cupl | Dialect::Galasm) | Language::Jedec => {
            return None;
        }
    };
    let circuit = &chip.circuit;
    let roots = circuit.flops.values().map(|flop| flop.next);
    let roots = roots.chain(circuit.outputs.values().map(|output| output.value));
    let is_needed = grafsynth_logic::build::needed(circuit, roots);
    let is_operation = |node: &Node| match node {
        Node::Not(_) | Node::And(_) | Node::Or(_) | Node::Xor(..) | Node::Mux(..) => true,
        Node::Const(_) | Node::Input(_) | Node::Flop(_) => false,
    };
    let nodes = circuit.nodes.iter().filter(|(id, node)| is_needed[*id] && is_operation(node));
    let gates = nodes.count();
    Some(Block::Paragraph(Rich::plain(format!(
        "The {language} text contains the functions in several levels, as in the source: {} and {}, made of {} over {} and {}. The synthesis tool maps them to cells or lookup tables, so no product terms are counted here.",
        counted(circuit.flops.len(), "next state", "next states"),
        counted(circuit.outputs.len(), "output", "outputs"),
        counted(gates, "operation", "operations"),
        counted(circuit.inputs.len(), "input bit", "input bits"),
        counted(circuit.flops.len(), "flip-flop", "flip-flops"),
    ))))
}
