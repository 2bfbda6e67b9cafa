//! Converts a table to a circuit without registers, and a circuit to the table of its functions.

use super::{Kind, Pla, clashes, read, undefined};
use crate::codes::{self, NOT_PLACED};
use crate::read::Text;
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::logic::{Logic, NodeId, PinInput, PinOutput, PinRole};
use grafsynth_ir::span::{FileId, Span};
use grafsynth_logic::build::Builder;
use grafsynth_logic::minimise::{Budget, Shape, sum_of_products};
use grafsynth_logic::node_bdds::Var;
use std::collections::BTreeMap;

/// Reads a table as a circuit without pins and macrocells.
#[must_use]
pub fn read_text(file: FileId, text: &str) -> (Option<Text>, Vec<Diagnostic>) {
    let (table, mut found) = read(file, text);
    let text = table.map(|(table, places)| {
        found.extend(clashes(&table, &places));
        let (logic, open) = circuit(&table);
        let no_pins = Diagnostic::error(NOT_PLACED, "a table has no pins and no macrocells")
            .at(Span::new(file, 0, 0), "")
            .help("build it with --refit");
        Text {
            logic: Some(logic),
            beyond: undefined(&table, &places, &open).into_iter().collect(),
            placement: Err(vec![no_pins]),
            findings: Vec::new(),
        }
    });
    (text, found)
}

/// The circuit of a table: each output is true exactly where the table defines it as on, so its don't-cares are false; an inverted output is
/// the complement. Also returns the outputs with don't-cares.
#[must_use]
pub fn circuit(table: &Pla) -> (Logic, Vec<usize>) {
    let shape = table.shape();
    let mut builder = Builder::default();
    let inputs: Vec<NodeId> = (0..shape.inputs())
        .map(|input| {
            let name = table.inputs.as_ref().and_then(|names| names.get(input).cloned());
            let name = name.unwrap_or_else(|| format!("in{input}"));
            let role = PinRole::Unknown;
            let pin = builder.logic.inputs.push(PinInput { name, role, meta: Default::default() });
            builder.input(pin)
        })
        .collect();
    let mut sums: Vec<Vec<NodeId>> = vec![Vec::new(); shape.outputs()];
    for term in table.on.iter() {
        let mut literals = Vec::new();
        for (input, node) in inputs.iter().enumerate() {
            match shape.literal(term, input) {
                Some(true) => literals.push(*node),
                Some(false) => literals.push(builder.not(*node)),
                None => {}
            }
        }
        let product = builder.and(literals);
        for (output, sum) in sums.iter_mut().enumerate() {
            if shape.has_output(term, output) {
                sum.push(product);
            }
        }
    }
    let mut open = Vec::new();
    for (output, sum) in sums.into_iter().enumerate() {
        let mut value = builder.or(sum);
        if table.is_inverted.get(output).copied().unwrap_or(false) {
            value = builder.not(value);
        }
        let is_free = table.free.iter().any(|term| shape.has_output(term, output));
        if is_free || table.kind.says_off() {
            open.push(output);
        }
        builder.logic.outputs.push(PinOutput {
            name: table.output_name(output),
            role: PinRole::Unknown,
            value,
            registered: None,
            mealy: false,
            meta: Default::default(),
        });
    }
    (builder.finish(), open)
}

/// The table of a circuit's functions, each minimised to a sum of products. On the left are its inputs and the present values of its flip-flops; on the right
/// its outputs and, as `NAME.d`, the next values of the flip-flops. Equal products of several outputs are one row.
///
/// # Errors
/// If a function needs too many products.
pub fn table(logic: &Logic, budget: Budget) -> Result<Pla, Vec<Diagnostic>> {
    let (n_inputs, n_flops) = (logic.inputs.len(), logic.flops.len());
    let shape = Shape::new(n_inputs + n_flops, logic.outputs.len() + n_flops);
    let place = |var: &Var| match var {
        Var::Input(input) => input.index(),
        Var::Flop(flop) => n_inputs + flop.index(),
    };
    let outputs = logic.outputs.values().map(|output| (output.name.clone(), output.value));
    let flops = logic.flops.values().map(|flop| (format!("{}.d", flop.name), flop.next));
    let functions: Vec<(String, NodeId)> = outputs.chain(flops).collect();
    let mut found = Vec::new();
    let mut rows: BTreeMap<Vec<(usize, bool)>, Vec<usize>> = BTreeMap::new();
    for (output, (name, node)) in functions.iter().enumerate() {
        match sum_of_products(logic, *node, false, false, budget) {
            Ok(products) => {
                for product in products {
                    let literals =
                        product.iter().map(|(var, value)| (place(var), *value)).collect();
                    rows.entry(literals).or_default().push(output);
                }
            }
            Err(why) => {
                let message = format!("`{name}` has no small sum of products: {why}");
                found.push(Diagnostic::error(codes::TOO_MANY_PRODUCTS, message));
            }
        }
    }
    if !found.is_empty() {
        return Err(found);
    }
    let mut table = Pla::new(Kind::F, shape);
    let inputs = logic.inputs.values().map(|input| input.name.clone());
    table.inputs = Some(inputs.chain(logic.flops.values().map(|flop| flop.name.clone())).collect());
    table.outputs = Some(functions.into_iter().map(|(name, _)| name).collect());
    for (literals, outputs) in rows {
        table.on.add(literals, outputs);
    }
    Ok(table)
}
