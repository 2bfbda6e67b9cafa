//! The data that every engine receives and returns, in the text of a chart: inputs as 32-bit numbers in an array, outputs and variables in their own
//! types.

use crate::Object;
use crate::c::print::Node;
use crate::io::Structure;
use crate::names::Names;
use grafsynth_c::storage;
use grafsynth_ir::expr::Type;
use grafsynth_ir::net::{InputId, InputKind, Net, OutputId};

/// A 32-bit number converted to its type.
pub(super) fn as_type(ty: Type, number: &str) -> String {
    if ty.is_bool() { format!("{number} != 0") } else { format!("({}){number}", storage(ty)) }
}

/// Statements that pass the inputs, each at its position in an array. At reset, and for extern conditions, which are called later, they pass the value nearest
/// to 0.
pub(super) fn hand_in(
    net: &Net,
    names: &Names,
    inputs: &[(InputId, usize)],
    array: &str,
    reset: bool,
) -> Vec<Node> {
    if inputs.is_empty() {
        return vec![Node::line(format!("{array}[0] = 0;"))];
    }
    let line = |(id, at): &(InputId, usize)| {
        let input = &net.inputs[*id];
        let value = if reset || input.kind == InputKind::Extern {
            input.ty.saturate(0).to_string()
        } else {
            let place =
                names.io.read(Structure::Behind("in"), &names.inputs[*id], *id, input.ty).text;
            if input.ty.is_bool() {
                format!("{place} ? 1 : 0")
            } else {
                format!("(int32_t){place}")
            }
        };
        Node::line(format!("{array}[{at}] = {value};")).about(Object::Input(*id))
    };
    inputs.iter().map(line).collect()
}

/// Statements that clear all bits of the output words.
pub(super) fn clear_words(names: &Names) -> Vec<Node> {
    (0..names.io.output_words())
        .map(|word| Node::line(format!("out->bits[{word}] = 0U;")))
        .collect()
}

/// Statements that set the outputs, each from the engine's number for it.
pub(super) fn hand_out(
    net: &Net,
    names: &Names,
    outputs: impl Iterator<Item = (OutputId, String)>,
) -> Vec<Node> {
    outputs
        .map(|(id, number)| {
            let value = as_type(net.outputs[id].ty, &number);
            let line = names.io.write(&names.outputs[id], id, &value);
            Node::line(line).about(Object::Output(id))
        })
        .collect()
}
