//! Statements that all styles print in the same way: calls, choices, verbatim text, and the values after reset.

use crate::Object;
use crate::c::print::{Arm, Kind, Node};
use crate::cexpr::{CExpr, Helpers, constant, saturated};
use crate::names::Names;
use crate::queries::is_c;
use grafsynth_ir::expr::Type;
use grafsynth_ir::net::{Driver, Net, OutputId, Verbatim};
use itertools::Itertools as _;

/// A function of the user's library.
pub(crate) struct Callee<'a> {
    pub(crate) net: &'a Net,
    pub(crate) names: &'a Names,
    pub(crate) output: OutputId,
}

impl Callee<'_> {
    /// A call; the arguments saturate to the types of the parameters.
    pub(crate) fn call(&self, arguments: Vec<CExpr>, helpers: &mut Helpers) -> Node {
        let Driver::Extern { params, .. } = &self.net.outputs[self.output].driver else {
            return Node::blank();
        };
        let values = arguments
            .into_iter()
            .zip(params)
            .map(|(value, param)| {
                saturated(value, param.ty, &self.names.prefix, helpers).stored_as(param.ty)
            })
            .join(", ");
        Node::line(format!("{}({});", self.names.outputs[self.output], values))
            .about(Object::Output(self.output))
    }
}

/// `if`/`else`; if the condition is constant, only the branch that is taken.
pub(crate) fn either(condition: CExpr, then: Vec<Node>, otherwise: Vec<Node>) -> Vec<Node> {
    if condition.is_true() {
        return then;
    }
    if condition.is_false() {
        return otherwise;
    }
    match (then.is_empty(), otherwise.is_empty()) {
        (true, true) => Vec::new(),
        (true, false) => vec![Node::when(&condition.not().text, otherwise)],
        (false, true) => vec![Node::when(&condition.text, then)],
        (false, false) => {
            vec![
                Kind::Block(vec![Arm::when(&condition.text, then), Arm::otherwise(otherwise)])
                    .into(),
            ]
        }
    }
}

/// The user's C text; text for other languages is left out (the caller reports it).
pub(crate) fn verbatim(text: &Verbatim) -> Vec<Node> {
    if is_c(&text.language) {
        // A separate block limits the scope of the names that the text declares.
        vec![Node::line("{"), Kind::Verbatim(text.text.clone()).into(), Node::line("}")]
    } else {
        Vec::new()
    }
}

/// Sets a member to its value after reset.
pub(crate) fn initial(name: &str, ty: Type, len: Option<u32>, values: &[i64]) -> Vec<Node> {
    let literal = |value: i64| constant(value, ty);
    let Some(len) = len else {
        return vec![Node::line(format!(
            "{name} = {};",
            literal(values.first().copied().unwrap_or(0))
        ))];
    };
    let first = values.first().copied().unwrap_or(0);
    if len > 4 && values.iter().all(|value| *value == first) {
        let counter = if len <= 0xffff { "uint16_t" } else { "uint32_t" };
        let bound = crate::times::unsigned(i64::from(len));
        return vec![Node::block(
            format!("for ({counter} i = 0; i < {bound}; ++i)"),
            vec![Node::line(format!("{name}[i] = {};", literal(first)))],
        )];
    }
    values
        .iter()
        .enumerate()
        .map(|(index, value)| Node::line(format!("{name}[{index}] = {};", literal(*value))))
        .collect()
}

/// Sets all outputs to their values after reset.
pub(crate) fn initial_outputs(net: &Net, names: &Names, values: &[i64]) -> Vec<Node> {
    names.io.constants(net, &names.outputs, |id| values.get(id.index()).copied().unwrap_or(0))
}
