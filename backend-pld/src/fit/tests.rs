//! Properties of the fit: pins compared with brute force, divided sums with the original circuits, pins after small edits.

use super::matching::{Matching, PinRequest, Rank, in_order};
use super::need::{Need, View};
use crate::device::{DEVICES, Device};
use crate::equations::{Equations, Source};
use crate::tests::{same_behaviour, there_and_back, truck};
use crate::{Dialect, EmitOptions, emit};
use grafsynth_ir::logic::{FlopId, Logic, NodeId, PinOutput, PinRole};
use grafsynth_ir::random::Random;
use grafsynth_logic::build::Builder;

fn on(device: &str) -> EmitOptions {
    EmitOptions { device: Some(device.to_owned()), ..EmitOptions::default() }
}

fn output(builder: &mut Builder, name: &str, value: NodeId) {
    builder.logic.outputs.push(PinOutput {
        name: name.to_owned(),
        role: PinRole::Output(grafsynth_ir::arena::Id::from_index(builder.logic.outputs.len()), 0),
        value,
        registered: None,
        mealy: false,
        meta: Default::default(),
    });
}

/// The maximum number of requests that can have pins together, by exhaustive search.
fn most_by_force(view: &View, wishes: &[PinRequest], free: &[u32]) -> usize {
    let Some((first, rest)) = wishes.split_first() else { return 0 };
    let without = most_by_force(view, rest, free);
    free.iter()
        .filter(|pin| view.refuses(first.need, **pin).is_none())
        .map(|pin| {
            let left: Vec<u32> = free.iter().copied().filter(|other| other != pin).collect();
            1 + most_by_force(view, rest, &left)
        })
        .chain([without])
        .max()
        .unwrap_or(0)
}

#[test]
fn what_is_refused_a_pin_has_none_in_any_assignment() {
    let mut dice = Random::new(0x1357_9BDF_0246_8ACE);
    let (mut n_full, mut n_short) = (0, 0);
    for round in 0..300 {
        let device: &'static Device = &DEVICES[round % DEVICES.len()];
        let has_registers = dice.below(3) > 0;
        for view in View::all(device, has_registers) {
            let mut free: Vec<u32> = view.pins().collect();
            while free.len() > 6 {
                let at = dice.below(free.len());
                free.remove(at);
            }
            let wishes: Vec<PinRequest> = (0..1 + dice.below(5))
                .map(|index| PinRequest {
                    index,
                    need: match dice.below(4) {
                        0 => Need::Input,
                        kind => Need::Macrocell {
                            terms: 1 + dice.below(9),
                            is_registered: has_registers && kind == 1,
                            is_read: dice.below(2) == 0,
                        },
                    },
                    key: dice.below(usize::MAX) as u64,
                    kept: Some(free[dice.below(free.len())]).filter(|_| dice.below(4) == 0),
                    rank: [Rank::Input(index), Rank::Output(index), Rank::Inner][dice.below(3)],
                    natural: None,
                })
                .collect();
            let mut wishes = wishes;
            in_order(view, &free, &mut wishes);
            let mut matching = Matching::new(view, free.clone());
            let left = matching.place_all(&wishes);
            let placed: Vec<(u32, usize)> = matching.pins().collect();
            assert_eq!(placed.len() + left.len(), wishes.len());
            for (pin, index) in &placed {
                assert_eq!(view.refuses(wishes[*index].need, *pin), None);
            }
            assert_eq!(placed.len(), most_by_force(&view, &wishes, &free), "{view:?} {wishes:?}");
            if left.is_empty() { n_full += 1 } else { n_short += 1 }
        }
    }
    assert!(n_full > 100 && n_short > 100, "{n_full} and {n_short}");
}

/// An output that is a random sum of this many products over these nodes.
fn random_sum(dice: &mut Random, builder: &mut Builder, over: &[NodeId], n: usize) -> NodeId {
    let products: Vec<NodeId> = (0..n)
        .map(|_| {
            let literals: Vec<NodeId> = (0..4 + dice.below(3))
                .map(|_| {
                    let node = over[dice.below(over.len())];
                    if dice.below(2) == 0 { builder.not(node) } else { node }
                })
                .collect();
            builder.and(literals)
        })
        .collect();
    builder.or(products)
}

#[test]
fn divided_sums_fit_and_are_what_they_were() {
    let mut dice = Random::new(0x0F1E_2D3C_4B5A_6978);
    let mut n_divided = 0;
    for (device, widest) in [("gal16v8", 8), ("gal22v10", 16), ("gal20ra10", 4), ("pal16l8", 7)] {
        for _ in 0..8 {
            let mut builder = Builder::default();
            let mut over: Vec<NodeId> =
                (0..8).map(|k| builder.input_named(&format!("i{k}"))).collect();
            let flops: Vec<FlopId> = (0..if device == "pal16l8" { 0 } else { 2 })
                .map(|k| {
                    let (flop, value) = builder.flop_named(&format!("q{k}"), k == 1);
                    over.push(value);
                    flop
                })
                .collect();
            for (k, flop) in flops.into_iter().enumerate() {
                let n = if k == 0 { widest + 2 } else { 2 };
                let next = random_sum(&mut dice, &mut builder, &over, n);
                builder.logic.flops[flop].next = next;
            }
            let n = widest + 1 + dice.below(3);
            let wide = random_sum(&mut dice, &mut builder, &over, n);
            output(&mut builder, "y", wide);
            let logic = builder.finish();
            let Ok(equations) = Equations::new(&logic, Dialect::Galasm, &on(device)) else {
                // It needs more macrocells than there are; the message contains the numbers.
                continue;
            };
            let parts = equations.signals.iter();
            let n_parts = parts.filter(|s| matches!(s.source, Source::Buried(_))).count();
            assert_eq!(equations.depth > 0, n_parts > 0);
            n_divided += usize::from(n_parts > 0);
            for dialect in [Dialect::Galasm, Dialect::Palasm, Dialect::Cupl] {
                there_and_back(&logic, dialect, &on(device));
            }
            if equations.device.layout.is_some() {
                let (placement, roles) = crate::fuse::place(&logic, &on(device)).unwrap();
                crate::fuse::map(&placement).unwrap();
                let back = crate::fuse::logic(&placement, &roles).unwrap();
                same_behaviour(&logic, &back, 100);
            }
        }
    }
    assert!(n_divided >= 6, "{n_divided}");
}

#[test]
fn a_factor_needs_one_macrocell_where_parts_need_two() {
    // (a + b + c + d + e) * (f + g + h + i + j): 25 products; a factor reduces them to 5; parts of 16 would reduce them to 10.
    let mut builder = Builder::default();
    let inputs: Vec<NodeId> = (0..10).map(|k| builder.input_named(&format!("i{k}"))).collect();
    let (left, right) = (builder.or(inputs[..5].to_vec()), builder.or(inputs[5..].to_vec()));
    let first = builder.and([left, right]);
    // Its complement is short; for an exclusive-or, neither form is.
    let (flop, value) = builder.flop_named("q", false);
    builder.logic.flops[flop].next = first;
    output(&mut builder, "y", value);
    let equations = Equations::new(&builder.finish(), Dialect::Galasm, &on("gal22v10")).unwrap();
    let terms: Vec<usize> = equations.equations.iter().map(|e| e.products.len()).collect();
    assert_eq!(terms, [5, 5]);
    assert_eq!(equations.depth, 1);
}

/// Parity of three bits in pairs of macrocells of a 20RA10 with four terms: no room for a divisor if all ten are in use.
#[test]
fn without_a_spare_macrocell_nothing_is_divided_and_each_wide_function_is_named() {
    let mut builder = Builder::default();
    let inputs: Vec<NodeId> = (0..6).map(|k| builder.input_named(&format!("i{k}"))).collect();
    let parity = inputs[..4].iter().copied().reduce(|a, b| builder.xor(a, b)).unwrap();
    for k in 0..10 {
        let value = if k < 2 { builder.xor(parity, inputs[4 + k]) } else { inputs[k % 6] };
        output(&mut builder, &format!("y{k}"), value);
    }
    let found = emit(&builder.finish(), Dialect::Galasm, &on("gal20ra10")).unwrap_err();
    assert_eq!(found.len(), 1);
    let message = &found[0].message;
    assert!(message.contains("`y0` needs 16 product terms"), "{message}");
    assert!(message.contains("`y1` needs 16 product terms"), "{message}");
}

/// A 16V8 without registers has three modes, and the message reports what each lacks.
#[test]
fn the_obstacles_of_each_mode_are_named() {
    let mut builder = Builder::default();
    let inputs: Vec<NodeId> = (0..13).map(|k| builder.input_named(&format!("i{k}"))).collect();
    for k in 0..6 {
        let value = builder.and([inputs[2 * k], inputs[2 * k + 1], inputs[12]]);
        output(&mut builder, &format!("y{k}"), value);
    }
    let found = emit(&builder.finish(), Dialect::Galasm, &on("gal16v8")).unwrap_err();
    assert_eq!(found.len(), 1);
    let message = &found[0].message;
    assert!(message.contains("in its simple mode, 1 of its 13 inputs gets no pin"), "{message}");
    assert!(message.contains("in its registered mode, 3 of its 13 inputs get no pin"), "{message}");
}

/// Ten outputs whose sums have eight products: the simplest mode allows eight, the others seven.
#[test]
fn the_plainest_mode_holds_a_product_more() {
    let mut builder = Builder::default();
    let inputs: Vec<NodeId> = (0..4).map(|k| builder.input_named(&format!("i{k}"))).collect();
    let parity = inputs.iter().copied().reduce(|a, b| builder.xor(a, b)).unwrap();
    for k in 0..8 {
        output(&mut builder, &format!("y{k}"), parity);
    }
    let logic = builder.finish();
    let (placement, roles) = crate::fuse::place(&logic, &on("gal16v8")).unwrap();
    assert!(placement.cells.iter().all(|cell| cell.sum.len() == 8));
    crate::fuse::map(&placement).unwrap();
    same_behaviour(&logic, &crate::fuse::logic(&placement, &roles).unwrap(), 50);
}

#[test]
fn outputs_that_are_a_flip_flop_share_its_macrocell() {
    let shared = |logic: &Logic, device: &str| {
        let equations = Equations::new(logic, Dialect::Galasm, &on(device)).unwrap();
        equations.signals.iter().filter(|signal| signal.shared.is_some()).count()
    };
    // R, Z and L are steps that are false at first: pins of a 16V8 start high.
    assert_eq!(shared(&truck(), "gal22v10"), 3);
    assert_eq!(shared(&truck(), "gal16v8"), 0);
    // If the complements are true at first, the result is the opposite.
    let mut builder = Builder::resume(truck());
    let flops: Vec<NodeId> = truck().flops.ids().map(|id| builder.flop(id)).collect();
    let ids: Vec<_> = builder.logic.outputs.ids().collect();
    for (id, flop) in ids.into_iter().zip(&flops[1..]) {
        builder.logic.outputs[id].value = builder.not(*flop);
    }
    let first = flops[0];
    output(&mut builder, "idle", first);
    let logic = builder.finish();
    for device in ["gal22v10", "gal16v8", "gal20v8", "gal20ra10"] {
        assert_eq!(shared(&logic, device), 4, "{device}");
        for dialect in [Dialect::Galasm, Dialect::Palasm, Dialect::Cupl] {
            there_and_back(&logic, dialect, &on(device));
        }
        let (placement, roles) = crate::fuse::place(&logic, &on(device)).unwrap();
        assert_eq!(placement.cells.len(), 4);
        crate::fuse::map(&placement).unwrap();
        same_behaviour(&logic, &crate::fuse::logic(&placement, &roles).unwrap(), 100);
    }
    // The user may request a step and its output on separate pins, or two outputs on one.
    let apart =
        EmitOptions { pins: vec![("R".to_owned(), 20), ("p2".to_owned(), 21)], ..on("gal22v10") };
    let text = there_and_back(&truck(), Dialect::Palasm, &apart);
    assert!(text.contains("PIN 21  p2") && text.contains("\nR = p2\n"), "{text}");
    let mut builder = Builder::resume(truck());
    let second = builder.flop(truck().flops.ids().nth(1).unwrap());
    output(&mut builder, "R2", second);
    let logic = builder.finish();
    assert_eq!(shared(&logic, "gal22v10"), 3);
    let together =
        EmitOptions { pins: vec![("R".to_owned(), 20), ("R2".to_owned(), 20)], ..on("gal22v10") };
    let text = there_and_back(&logic, Dialect::Palasm, &together);
    assert!(!text.contains("R2"), "{text}");
}

/// A circuit with a sequence of steps that advance on inputs, plus moves between arbitrary steps; each output combines two steps.
fn sequence(n: usize, n_outputs: usize, moves: &[(usize, usize, usize)]) -> Logic {
    let mut builder = Builder::default();
    let inputs: Vec<NodeId> = (0..6).map(|k| builder.input_named(&format!("in{k}"))).collect();
    let steps: Vec<_> = (0..n).map(|k| builder.flop_named(&format!("s{k}"), k == 0)).collect();
    let row: Vec<(usize, usize, usize)> =
        (0..n).map(|k| (k, (k + 1) % n, k % 6)).chain(moves.iter().copied()).collect();
    let fires: Vec<NodeId> =
        row.iter().map(|(from, _, by)| builder.and([steps[*from].1, inputs[*by]])).collect();
    for (k, (flop, value)) in steps.iter().copied().enumerate() {
        let sets: Vec<NodeId> =
            row.iter().zip(&fires).filter(|(m, _)| m.1 == k).map(|(_, f)| *f).collect();
        let ends: Vec<NodeId> =
            row.iter().zip(&fires).filter(|(m, _)| m.0 == k).map(|(_, f)| *f).collect();
        let (set, end) = (builder.or(sets), builder.or(ends));
        let stays = builder.not(end);
        let stays = builder.and([value, stays]);
        builder.logic.flops[flop].next = builder.or([set, stays]);
    }
    for k in 0..n_outputs {
        let value = builder.or([steps[k % n].1, steps[(k + 1) % n].1]);
        output(&mut builder, &format!("out{k}"), value);
    }
    builder.finish()
}

fn pins(logic: &Logic, device: &str) -> Option<Vec<(String, u32)>> {
    let emitted = emit(logic, Dialect::Galasm, &on(device)).ok()?;
    Some(emitted.names.into_iter().filter_map(|named| Some((named.name, named.pin?))).collect())
}

/// The number of common signals whose pins differ.
fn n_moved(before: &[(String, u32)], after: &[(String, u32)]) -> usize {
    let is_moved =
        |(name, pin): &&(String, u32)| after.iter().any(|(other, at)| other == name && at != pin);
    before.iter().filter(is_moved).count()
}

/// An edit after which each sum still fits at its pin moves nothing; a new step moves few pins.
#[test]
fn pins_stay_under_small_edits() {
    let mut dice = Random::new(0x2468_ACE0_1357_9BDF);
    let mut n_edits = 0;
    for _ in 0..40 {
        let device = ["gal16v8", "gal22v10", "gal20v8"][dice.below(3)];
        let (n, n_outputs) = (3 + dice.below(3), 1 + dice.below(2));
        let mut moves = vec![(dice.below(n), dice.below(n), dice.below(6))];
        let before = sequence(n, n_outputs, &moves);
        moves.push((dice.below(n), dice.below(n), dice.below(6)));
        let after = sequence(n, n_outputs, &moves);
        let widest = |logic: &Logic| {
            let made = Equations::new(logic, Dialect::Galasm, &on(device)).ok()?;
            made.equations.iter().map(|equation| equation.products.len()).max()
        };
        let (Some(one), Some(other)) = (widest(&before), widest(&after)) else { continue };
        // No macrocell of these devices has fewer than eight product terms, or seven without a flip-flop.
        if one.max(other) > 7 {
            continue;
        }
        n_edits += 1;
        let (before, after) = (pins(&before, device).unwrap(), pins(&after, device).unwrap());
        assert_eq!(before, after, "{device} {moves:?}");
    }
    assert!(n_edits >= 25, "{n_edits}");
    let (mut n_signals, mut moved, mut n_added) = (0, 0, 0);
    for (device, most) in [("gal16v8", 7), ("gal22v10", 9)] {
        for n in 3..most {
            for at in 0..n {
                let before = sequence(n, 1, &[]);
                // A step with another name between two of the others: the sequence continues through it.
                let mut after = sequence(n + 1, 1, &[]);
                let names: Vec<FlopId> = after.flops.ids().collect();
                for (k, id) in names.into_iter().enumerate() {
                    after.flops[id].name = match k.cmp(&at) {
                        std::cmp::Ordering::Less => format!("s{k}"),
                        std::cmp::Ordering::Equal => format!("new{n}_{at}"),
                        std::cmp::Ordering::Greater => format!("s{}", k - 1),
                    };
                }
                let (before, after) =
                    (pins(&before, device).unwrap(), pins(&after, device).unwrap());
                n_signals += before.len();
                moved += n_moved(&before, &after);
                n_added += 1;
            }
        }
    }
    eprintln!("{n_added} added steps moved {moved} of {n_signals} pins");
    // Less than one pin for each added step; docs/forms.md has the figure.
    assert!(moved < n_added, "{n_added} added steps moved {moved} of {n_signals} pins");
}

#[test]
fn pins_of_an_earlier_build_are_kept() {
    let before = pins(&sequence(5, 2, &[]), "gal22v10").unwrap();
    // Every pin differs from the default: the order of macrocells reversed.
    let turned: Vec<(String, u32)> = before
        .iter()
        .map(|(name, pin)| (name.clone(), if *pin > 13 { 37 - pin } else { *pin }))
        .collect();
    let options = EmitOptions { keep: turned.clone(), ..on("gal22v10") };
    let emitted = emit(&sequence(6, 2, &[(1, 4, 2)]), Dialect::Palasm, &options).unwrap();
    let after: Vec<(String, u32)> =
        emitted.names.into_iter().filter_map(|named| Some((named.name, named.pin?))).collect();
    assert_eq!(n_moved(&turned, &after), 0);
}
