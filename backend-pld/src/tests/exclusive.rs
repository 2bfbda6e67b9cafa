//! T flip-flops, inverted sums and devices with logic blocks: choice, writing, reading back, rejection.

use super::{same_behaviour, there_and_back, truck};
use crate::codes;
use crate::device::FlipFlop;
use crate::equations::Equations;
use crate::{Dialect, EmitOptions, emit, read};
use grafsynth_ir::arena::Id;
use grafsynth_ir::logic::{Logic, NodeId, PinOutput, PinRole};
use grafsynth_ir::span::FileId;
use grafsynth_logic::build::Builder;

fn on(device: &str) -> EmitOptions {
    EmitOptions { device: Some(device.into()), ..EmitOptions::default() }
}

fn output(builder: &mut Builder, name: &str, value: NodeId) {
    let role = PinRole::Output(Id::from_index(builder.logic.outputs.len()), 0);
    let meta = Default::default();
    let registered = None;
    let name = name.into();
    builder.logic.outputs.push(PinOutput { name, role, value, registered, mealy: false, meta });
}

/// A counter of `n` bits that counts while `go` is true.
fn counter(n: usize) -> Logic {
    let mut builder = Builder::default();
    let bits: Vec<_> = (0..n).map(|k| builder.flop_named(&format!("c{k}"), false)).collect();
    let mut carry = vec![builder.input_named("go")];
    for (flop, bit) in bits {
        let change = builder.and(carry.clone());
        builder.logic.flops[flop].next = builder.xor(bit, change);
        carry.push(bit);
    }
    builder.finish()
}

/// The parity of `n` inputs.
fn parity(n: usize) -> Logic {
    let mut builder = Builder::default();
    let mut value = builder.constant(false);
    for k in 0..n {
        let input = builder.input_named(&format!("i{k}"));
        value = builder.xor(value, input);
    }
    output(&mut builder, "odd", value);
    builder.finish()
}

#[test]
fn a_counter_takes_t_flip_flops_where_there_are_any() {
    let logic = counter(6);
    for (device, wanted) in [("atf1502", 6), ("atf750c", 6), ("gal22v10", 21 + 6)] {
        let made = Equations::new(&logic, Dialect::Cupl, &on(device)).unwrap();
        // With a D flip-flop, a bit needs one product per condition for a change to keep its value, and one more to change.
        assert_eq!(
            made.equations.iter().map(|own| own.n_terms()).sum::<usize>(),
            wanted,
            "{device}"
        );
        let is_t = made.equations.iter().skip(1).all(|own| own.flip_flop == FlipFlop::T);
        assert_eq!(is_t, device != "gal22v10");
    }
    let text = there_and_back(&logic, Dialect::Cupl, &on("atf1502"));
    assert!(text.contains("c2.t = c0 & c1 & go ;"), "{text}");
    assert!(text.contains("PINNODE     = c2 ;"), "{text}");
    assert!(text.contains("Device    f1502ispplcc44 ;"), "{text}");
    let text = there_and_back(&logic, Dialect::Palasm, &on("atf750c"));
    assert!(text.contains("c2 := c0 * c1 * go :+: c2"), "{text}");
}

#[test]
fn a_wide_parity_takes_an_inverter() {
    let logic = parity(5);
    let made = Equations::new(&logic, Dialect::Cupl, &on("atf1502")).unwrap();
    let [own] = &made.equations[..] else { panic!("one output") };
    assert_eq!((own.products.len(), own.n_terms()), (8, 9));
    let text = there_and_back(&logic, Dialect::Cupl, &on("atf1502"));
    assert!(text.contains("$ i"), "{text}");
    there_and_back(&logic, Dialect::Palasm, &on("atf1502"));
    // If no macrocell supports it, nothing is written.
    assert!(!there_and_back(&logic, Dialect::Cupl, &on("gal22v10")).contains('$'));
}

#[test]
fn steps_that_no_pin_shows_are_nodes() {
    for device in ["atf1502-plcc44", "atf1502-tqfp44", "atf1504", "atf1504-plcc84", "atf1508"] {
        let logic = truck();
        let made = Equations::new(&logic, Dialect::Cupl, &on(device)).unwrap();
        assert!(made.has_pins, "{device}");
        for signal in &made.signals {
            let is_step = signal.name.starts_with('p') && signal.name.len() == 2;
            assert_eq!(signal.pin.is_none(), is_step, "{device} {}", signal.name);
            assert!(signal.pin.is_none_or(|pin| !made.device.jtag_pins.contains(&pin)));
        }
        let text = there_and_back(&logic, Dialect::Cupl, &on(device));
        assert!(text.contains("!p1.d = "), "the initial step starts at 1: {text}");
        there_and_back(&logic, Dialect::Verilog, &on(device));
    }
}

#[test]
fn no_fuse_map_is_promised_for_them() {
    let found = emit(&truck(), Dialect::Galasm, &on("atf1504")).unwrap_err();
    assert_eq!(found[0].code, crate::fuse::codes::NO_FUSE_MAP, "{found:?}");
    let found = crate::fuse::place(&truck(), &on("atf1504")).unwrap_err();
    assert_eq!(found[0].code, crate::fuse::codes::NO_FUSE_MAP, "{found:?}");
}

#[test]
fn pins_of_jtag_and_supplies_are_refused_by_name() {
    for (pin, reason) in [(7, "JTAG"), (15, "supply"), (43, "the clock"), (44, "no output")] {
        let options = EmitOptions { pins: vec![("R".into(), pin)], ..on("atf1502") };
        let found = emit(&truck(), Dialect::Cupl, &options).unwrap_err();
        assert_eq!(found[0].code, codes::BAD_PIN);
        let is_named = found[0].message.contains(reason) || pin == 43;
        assert!(is_named, "{}", found[0].message);
    }
    let options = EmitOptions { pins: vec![("R".into(), 41), ("p2".into(), 4)], ..on("atf1502") };
    let made = Equations::new(&truck(), Dialect::Cupl, &options).unwrap();
    let pin = |name: &str| made.signals.iter().find(|own| own.name == name).unwrap().pin;
    assert_eq!((pin("R"), pin("p2"), made.has_pins), (Some(41), Some(4), true));
}

/// Each block of an ATF1502 has 16 macrocells and reads 40 signals: signals beyond that are not placed, and the reason is
/// reported.
#[test]
fn blocks_hold_so_many_functions_and_read_so_many_signals() {
    let ring = |n: usize| {
        let mut builder = Builder::default();
        let all: Vec<_> = (0..n).map(|k| builder.flop_named(&format!("s{k}"), k == 0)).collect();
        let go = builder.input_named("go");
        for k in 0..n {
            let (before, own) = (all[(k + n - 1) % n].1, all[k].1);
            builder.logic.flops[all[k].0].next = builder.mux(go, before, own);
        }
        builder.finish()
    };
    let has_pins = |logic: &Logic, device: &str| {
        Equations::new(logic, Dialect::Cupl, &on(device)).unwrap().has_pins
    };
    assert!(has_pins(&ring(32), "atf1502"));
    assert!(!has_pins(&ring(33), "atf1502"));
    assert!(has_pins(&ring(64), "atf1504"));
    assert!(has_pins(&ring(128), "atf1508"));
    let made = Equations::new(&ring(33), Dialect::Cupl, &on("atf1502")).unwrap();
    let open = made.head.iter().find(|line| line.contains("does not fit")).unwrap();
    assert!(open.contains("logic block of 16 macrocells that reads 40 signals"), "{open}");
    // One function of 41 signals on a device with enough pins.
    let mut builder = Builder::default();
    let inputs: Vec<_> = (0..41).map(|k| builder.input_named(&format!("i{k}"))).collect();
    let all = builder.and(inputs);
    output(&mut builder, "all", all);
    assert!(!has_pins(&builder.finish(), "atf1508"));
}

#[test]
fn t_flip_flops_of_others_are_read() {
    let text = "Name x; Device f1504ispplcc84;\nPIN 83 = clk; PIN 4 = q; PIN 5 = !n; PIN 6 = a;\n\
        PINNODE = b;\nq.t = a & !b # !a & q; n.d = b $ a; !b.t = a;\n";
    // `n` is the complement of its pin, and the circuit uses levels at pins.
    let (logic, findings) = read(Dialect::Cupl, FileId(0), text);
    assert_eq!(findings, []);
    let logic = logic.unwrap();
    let mut builder = Builder::default();
    let a = builder.input_named("a");
    let [(fq, q), (fn_, _), (fb, b)] =
        [("q", false), ("n", true), ("b", true)].map(|(name, init)| builder.flop_named(name, init));
    let (not_a, not_b) = (builder.not(a), builder.not(b));
    let (up, down) = (builder.and([a, not_b]), builder.and([not_a, q]));
    let change = builder.or([up, down]);
    builder.logic.flops[fq].next = builder.xor(q, change);
    let n = builder.xor(b, a);
    builder.logic.flops[fn_].next = builder.not(n);
    builder.logic.flops[fb].next = builder.xor(b, not_a);
    let wanted = builder.finish();
    let named = |logic: &Logic| {
        logic.flops.values().map(|flop| (flop.name.clone(), flop.init)).collect::<Vec<_>>()
    };
    assert_eq!(named(&logic), named(&wanted));
    let mut bare = logic.clone();
    bare.outputs = Default::default();
    for (a, b) in bare.inputs.ids().zip(wanted.inputs.ids()) {
        bare.inputs[a] = wanted.inputs[b].clone();
    }
    for (a, b) in bare.flops.ids().zip(wanted.flops.ids()) {
        bare.flops[a].holds = wanted.flops[b].holds;
    }
    same_behaviour(&bare, &wanted, 100);
}
