//! Functions that are too wide for one sum, through the equation languages.

use super::there_and_back;
use crate::{Dialect, EmitOptions, Object, emit};
use grafsynth_ir::logic::{Logic, NodeId, PinOutput, PinRole};
use grafsynth_logic::build::Builder;

/// `n := n + k` if `go`: the upper bits have no sum of a reasonable size.
fn accumulator(bits: usize) -> Logic {
    let mut builder = Builder::default();
    let go = builder.input_named("go");
    let word: Vec<NodeId> = (0..bits).map(|bit| builder.input_named(&format!("k{bit}"))).collect();
    let flops: Vec<_> =
        (0..bits).map(|bit| builder.flop_named(&format!("n{bit}"), bit == 3)).collect();
    let mut carry = builder.constant(false);
    for (&(flop, value), &k) in flops.iter().zip(&word) {
        let half = builder.xor(value, k);
        let sum = builder.xor(half, carry);
        carry = builder.mux(half, carry, k);
        builder.logic.flops[flop].next = builder.mux(go, sum, value);
    }
    builder.logic.outputs.push(PinOutput {
        name: "over".into(),
        role: PinRole::Unknown,
        value: carry,
        registered: None,
        mealy: false,
        meta: Default::default(),
    });
    builder.finish()
}

#[test]
fn parts_of_wide_functions_are_nodes_that_read_back() {
    let logic = accumulator(16);
    let palasm = there_and_back(&logic, Dialect::Palasm, &EmitOptions::default());
    assert!(palasm.contains("\nNODE ?   n15_w1"), "{palasm}");
    let cupl = there_and_back(&logic, Dialect::Cupl, &EmitOptions::default());
    assert!(cupl.contains("\nPINNODE     = n15_w1"), "{cupl}");
    let found = emit(&logic, Dialect::Galasm, &EmitOptions::default()).unwrap_err();
    assert_eq!(found.iter().map(|one| one.code.id).collect::<Vec<_>>(), ["G0711"]);
}

/// If there is room, a part gets a pin, but never one that the circuit needs.
#[test]
fn a_part_takes_a_spare_macrocell() {
    let mut builder = Builder::default();
    let inputs: Vec<NodeId> = (0..11).map(|k| builder.input_named(&format!("i{k}"))).collect();
    let parity = inputs.iter().copied().reduce(|a, b| builder.xor(a, b)).unwrap();
    builder.logic.outputs.push(PinOutput {
        name: "odd".into(),
        role: PinRole::Unknown,
        value: parity,
        registered: None,
        mealy: false,
        meta: Default::default(),
    });
    let logic = builder.finish();
    for dialect in [Dialect::Palasm, Dialect::Cupl, Dialect::Galasm] {
        let emitted = emit(&logic, dialect, &EmitOptions::default()).unwrap();
        let parts: Vec<_> =
            emitted.names.iter().filter(|named| named.object == Object::Buried).collect();
        assert!(
            !parts.is_empty() && parts.iter().all(|part| part.pin.is_some()),
            "{}",
            emitted.text
        );
        there_and_back(&logic, dialect, &EmitOptions::default());
    }
}
