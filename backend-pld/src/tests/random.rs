//! Properties of random circuits, and readers with damaged texts.

use super::{there_and_back, truck};
use crate::{Dialect, EmitOptions, emit, read};
use grafsynth_ir::arena::Id;
use grafsynth_ir::logic::{FlopBit, Logic, NodeId, PinInput, PinOutput, PinRole};
use grafsynth_ir::program::Origin;
use grafsynth_ir::span::{FileId, Name, Span};
use grafsynth_logic::build::Builder;
use proptest::prelude::*;

/// A circuit generated from numbers: names that collide if letter case is ignored or after sanitising, and with keywords.
fn circuit(
    flops: &[bool],
    n_inputs: usize,
    gates: &[(u8, usize, usize, usize)],
    outputs: &[(usize, Option<bool>, bool)],
) -> Logic {
    let names = [
        "x",
        "X",
        "wire",
        "end",
        "a.b",
        "a_b",
        "clk",
        "GND",
        "très long nom",
        "p1",
        "module",
        "sp",
    ];
    let name = |k: usize| if k < names.len() { names[k].to_owned() } else { format!("s{k}") };
    let mut builder = Builder::default();
    builder.logic.name = Name::new("random chart", Span::default());
    let mut nodes: Vec<NodeId> = vec![builder.constant(false)];
    let mut ids = Vec::new();
    for (k, &init) in flops.iter().enumerate() {
        let (id, value) = builder.flop_named(&name(k), init);
        let holds = FlopBit {
            origin: Origin::Step(Id::from_index(k)),
            element: 0,
            bit: 0,
            inverted: false,
        };
        builder.logic.flops[id].holds = Some(holds);
        ids.push(id);
        nodes.push(value);
    }
    for k in 0..n_inputs {
        let role = PinRole::Input(Id::from_index(k), 0);
        let pin = PinInput { name: name(k + flops.len()), role, meta: Default::default() };
        let pin = builder.logic.inputs.push(pin);
        nodes.push(builder.input(pin));
    }
    for &(kind, a, b, c) in gates {
        let at = |index: usize| nodes[index % nodes.len()];
        let (a, b, c) = (at(a), at(b), at(c));
        nodes.push(match kind % 6 {
            0 => builder.and([a, b, c]),
            1 => builder.or([a, b, c]),
            2 => builder.xor(a, b),
            3 => builder.mux(a, b, c),
            4 => builder.not(a),
            _ => builder.and([a, b]),
        });
    }
    for (k, &id) in ids.iter().enumerate() {
        builder.logic.flops[id].next = nodes[nodes.len() - 1 - k % nodes.len()];
    }
    for (k, &(node, registered, mealy)) in outputs.iter().enumerate() {
        builder.logic.outputs.push(PinOutput {
            name: name(k + flops.len() + n_inputs),
            role: PinRole::Output(Id::from_index(k), 0),
            value: nodes[node % nodes.len()],
            registered,
            mealy: mealy && registered.is_none(),
            meta: Default::default(),
        });
    }
    builder.finish()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn what_is_written_reads_back_the_same(
        flops in proptest::collection::vec(any::<bool>(), 0..5),
        n_inputs in 0usize..4,
        gates in proptest::collection::vec((any::<u8>(), 0usize..40, 0usize..40, 0usize..40), 0..25),
        outputs in proptest::collection::vec((0usize..40, proptest::option::of(any::<bool>()), any::<bool>()), 0..4),
    ) {
        let logic = circuit(&flops, n_inputs, &gates, &outputs);
        for dialect in Dialect::ALL {
            for device in ["gal22v10", "gal20ra10", "gal16v8"] {
                let is_high = |output: &PinOutput| output.registered != Some(false);
                if device == "gal16v8" && !logic.outputs.values().all(is_high) {
                    continue;
                }
                let options = EmitOptions { device: Some(device.into()), ..EmitOptions::default() };
                let has_text = !logic.outputs.is_empty() || !logic.flops.is_empty();
                if !has_text && !matches!(dialect, Dialect::Verilog | Dialect::Blif) {
                    // No equation can be written, and no reader accepts a text without an equation.
                    let refused = emit(&logic, dialect, &options).unwrap_err();
                    prop_assert_eq!(refused[0].code.id, "G0730");
                    continue;
                }
                // GALasm needs a design that fits; four terms of a 20RA10 are not many.
                if dialect == Dialect::Galasm && emit(&logic, dialect, &options).is_err() {
                    continue;
                }
                there_and_back(&logic, dialect, &options);
            }
        }
    }

    #[test]
    fn damaged_texts_give_findings_and_no_panic(
        dialect in 0usize..5,
        cuts in proptest::collection::vec((0usize..4000, 0usize..60, any::<u8>(), 0u8..4), 1..5),
    ) {
        let dialect = Dialect::ALL[dialect];
        let mut bytes = emit(&truck(), dialect, &EmitOptions::default()).unwrap().text.into_bytes();
        for (at, length, byte, kind) in cuts {
            let at = at % bytes.len();
            let end = (at + length).min(bytes.len());
            match kind {
                0 => bytes[at] = byte,
                1 => drop(bytes.drain(at..end)),
                2 => {
                    let piece = bytes[at..end].to_vec();
                    bytes.splice(at..at, piece);
                }
                _ => bytes.insert(at, byte),
            }
            if bytes.is_empty() {
                bytes.push(b' ');
            }
        }
        let text = String::from_utf8_lossy(&bytes);
        let (logic, findings) = read(dialect, FileId(0), &text);
        prop_assert!(logic.is_some() || !findings.is_empty());
        for finding in &findings {
            prop_assert!(!finding.labels.is_empty(), "{}", finding.message);
            for label in &finding.labels {
                prop_assert!(label.span.end as usize <= text.len());
            }
        }
    }
}

#[test]
fn hostile_texts_end_soon() {
    let heads = [
        (Dialect::Palasm, "CHIP x PAL22V10\nPIN 1 c\nPIN 14 a\nEQUATIONS\na = "),
        (Dialect::Cupl, "Device g22v10;\nPIN 14 = a;\na = "),
        (
            Dialect::Galasm,
            "GAL22V10\nx\nc b NC NC NC NC NC NC NC NC NC GND\nNC a NC NC NC NC NC NC NC NC NC VCC\na = ",
        ),
        (Dialect::Verilog, "module x(input wire b, output wire a);\nassign a = "),
        (Dialect::Blif, ".model x\n.names a\n"),
    ];
    for (dialect, head) in heads {
        for body in [
            "(",
            "!",
            "~",
            "/",
            "a*",
            "a+",
            "a|",
            "b ? b : ",
            "b ? (",
            "if (b) begin ",
            "\n.names a b\n",
            "'",
            "\"",
            "/*",
            "\\\n",
        ] {
            let text = format!("{head}{}", body.repeat(50_000));
            let (_, findings) = read(dialect, FileId(0), &text);
            assert!(findings.len() <= 1002, "{dialect:?} {body}");
        }
        // Repetitions of one character.
        for sign in ["(", "a", ";", "\n", ".", "\u{0}", "é"] {
            let (_, findings) = read(dialect, FileId(0), &sign.repeat(100_000));
            assert!(findings.len() <= 1002, "{dialect:?} {sign}");
        }
    }
}

#[test]
fn large_circuits_cost_little() {
    // A ring of 2 000 steps.
    let mut builder = Builder::default();
    let count = 2_000;
    let steps: Vec<_> = (0..count).map(|k| builder.flop_named(&format!("st{k}"), k == 0)).collect();
    let inputs: Vec<NodeId> = (0..16).map(|k| builder.input_named(&format!("i{k}"))).collect();
    let fires: Vec<NodeId> =
        (0..count).map(|k| builder.and([steps[k].1, inputs[k % 16]])).collect();
    for k in 0..count {
        let not = builder.not(fires[k]);
        let hold = builder.and([steps[k].1, not]);
        builder.logic.flops[steps[k].0].next = builder.or([fires[(k + count - 1) % count], hold]);
    }
    let logic = builder.finish();
    for dialect in [Dialect::Verilog, Dialect::Blif, Dialect::Palasm] {
        there_and_back(&logic, dialect, &EmitOptions::default());
    }
}
