//! The state encoding, and the reason for it.

use super::document::{Block, Inline, Rich, Table};
use super::{Chip, Subject, counted};
use crate::coding::{Encoding, EncodingChoice, encoding_name};
use grafsynth_ir::logic::{Decoded, PinRole};
use grafsynth_ir::program::Origin;
use grafsynth_logic::minimise::{Budget, sum_between};
use grafsynth_logic::node_bdds::Var;

pub(super) fn write(_: &Subject<'_>, chip: &Chip) -> Vec<Block> {
    let circuit = &chip.circuit;
    let Some(code) = &chip.code else { return Vec::new() };
    if circuit.flops.is_empty() {
        let none = "There are no flip-flops: the circuit has no memory.";
        return vec![Block::Paragraph(Rich::say(none, []))];
    }
    let name = encoding_name(code.encoding);
    let is_busy = circuit.outputs.values().any(|output| output.role == PinRole::Busy);
    let why = match (code.choice, &code.why_not_one_hot) {
        _ if is_busy => {
            "a circuit with one micro-step per clock uses a flip-flop for each step".to_owned()
        }
        (EncodingChoice::This(_), _) => "as asked".to_owned(),
        (EncodingChoice::Auto, Some(why)) if code.encoding == Encoding::OneHot => {
            format!("no encoding makes it fit: {why}")
        }
        (EncodingChoice::Auto, Some(why)) => format!("one-hot does not fit: {why}"),
        (EncodingChoice::Auto, None) if code.n_groups == 0 => {
            "no steps are known to exclude each other".to_owned()
        }
        (EncodingChoice::Auto, None) if chip.device.is_none() => {
            "a netlist has no limit of flip-flops".to_owned()
        }
        (EncodingChoice::Auto, None) => "the first choice, and it fits".to_owned(),
    };
    let flops = counted(circuit.flops.len(), "flip-flop", "flip-flops");
    let name = Inline::Strong(name.to_owned());
    let mut text = Rich::say("{}, {}: {}.", [name, flops.into(), Inline::Message(why)]);
    if code.is_safe {
        let safe = " Every unreachable situation returns to the initial one (`--safe`).";
        text = text.and(Rich::say(safe, []));
    }
    let is_step = |bit: &&Decoded| matches!(bit.holds.origin, Origin::Step(_) | Origin::Region(_));
    let steps: Vec<&Decoded> = circuit.decoded.iter().filter(is_step).collect();
    if steps.is_empty() {
        return vec![Block::Paragraph(text)];
    }
    let mut table = Table::new(["Active", "while"]);
    for decoded in steps {
        let sum =
            sum_between(circuit, decoded.node, false, &circuit.unreachable, Budget::default());
        let product = |product: &Vec<(Var, bool)>| {
            let literal = |&(var, value): &(Var, bool)| {
                let name = match var {
                    Var::Flop(flop) => circuit.flops[flop].name.as_str(),
                    Var::Input(input) => circuit.inputs[input].name.as_str(),
                };
                format!("{}{name}", if value { "" } else { "/" })
            };
            product.iter().map(literal).collect::<Vec<_>>().join(" * ")
        };
        let code = match sum {
            Ok((products, _)) if products.is_empty() => "never".to_owned(),
            Ok((products, _)) if products.iter().any(Vec::is_empty) => "always".to_owned(),
            Ok((products, _)) => products.iter().map(product).collect::<Vec<_>>().join(" + "),
            Err(refused) => format!("({refused})"),
        };
        table.row([decoded.name.clone(), code]);
    }
    vec![Block::Paragraph(text), Block::Table(table)]
}
