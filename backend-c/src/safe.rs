//! Safe values of outputs in C: at a stop, and while the emergency of the chart holds (semantics §3.8).
//!
//! A reaction computes its outputs as if there were no emergency, and gives the safe values over them at its end: nothing comes behind that could undo it.

use crate::Object;
use crate::calls::constant;
use crate::cexpr::CExpr;
use crate::ctext::Node;
use crate::names::{Names, is_extern};
use grafsynth_ir::net::{Net, OutputId};

/// Gives the outputs that `which` names their safe values: members, and bits of the words that a reaction collects in locals.
pub(crate) fn force(
    net: &Net,
    names: &Names,
    holds: &CExpr,
    which: impl Fn(OutputId) -> bool,
) -> Vec<Node> {
    let io = &names.io;
    // Masks of one word: the bits that are forced, those of them that are on, those of all outputs.
    let mut words = vec![(0u32, 0u32, 0u32); io.output_words()];
    let mut objects: Vec<Vec<Object>> = vec![Vec::new(); words.len()];
    let mut members = Vec::new();
    for (id, output) in net.outputs.iter().filter(|(_, output)| !is_extern(output)) {
        match io.output_bit(id) {
            Some(bit) => {
                let (word, bit) = (bit / io.output_bits(), bit % io.output_bits());
                words[word].2 |= 1 << bit;
                if which(id) {
                    words[word].0 |= 1 << bit;
                    words[word].1 |= u32::from(output.safe_value() != 0) << bit;
                    objects[word].push(Object::Output(id));
                }
            }
            None if which(id) => members.push(
                Node::line(format!(
                    "out->{} = {};",
                    names.outputs[id],
                    constant(output.safe_value(), output.ty)
                ))
                .about(Object::Output(id)),
            ),
            None => {}
        }
    }
    let mut body = Vec::new();
    for (word, (mask, on, all)) in words.into_iter().enumerate() {
        if mask == 0 {
            continue;
        }
        let (ty, lit) = (io.output_type(), io.lit(word));
        let on = io.output_mask(on);
        let text = if mask == all {
            format!("{lit} = {on};")
        } else {
            format!("{lit} = ({ty})(({lit} & {}) | {on});", io.output_mask(all & !mask))
        };
        body.push(Node::line(text).about_all(objects[word].iter().copied()));
    }
    body.extend(members);
    if body.is_empty() {
        return Vec::new();
    }
    crate::calls::either(holds.clone(), body, Vec::new())
}
