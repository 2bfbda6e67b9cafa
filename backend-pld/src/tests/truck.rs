//! The truck: golden texts, power-up, test vectors, invalid pin requests.

use super::{difference, there_and_back, truck};
use crate::device::DEVICES;
use crate::vectors::{VectorRow, Vectors};
use crate::{Dialect, EmitOptions, Reset, ResetStyle, codes, emit, read, rebind};
use grafsynth_ir::logic::{Logic, PinRole};
use grafsynth_ir::span::FileId;
use grafsynth_logic::sim::LogicSim;
use itertools::Itertools as _;

fn on(device: &str) -> EmitOptions {
    EmitOptions { device: Some(device.into()), ..EmitOptions::default() }
}

#[test]
fn every_language_on_every_device_comes_back_the_same() {
    for dialect in Dialect::ALL {
        // One of the small PALs has enough flip-flops and gates, as a PAL and as a GAL.
        let has_room = |device: &&crate::device::Device| {
            let is_small = device.name.starts_with("pal") && !device.name.starts_with("pal16r4");
            !is_small && (dialect != Dialect::Galasm || device.layout.is_some())
        };
        for device in DEVICES.iter().filter(has_room) {
            there_and_back(&truck(), dialect, &on(device.name));
        }
    }
}

#[test]
fn golden_texts() {
    let text = |dialect, device: &str| emit(&truck(), dialect, &on(device)).unwrap().text;
    insta::assert_snapshot!("palasm_22v10", text(Dialect::Palasm, "gal22v10"));
    insta::assert_snapshot!("palasm_16v8", text(Dialect::Palasm, "gal16v8"));
    insta::assert_snapshot!("palasm_20ra10", text(Dialect::Palasm, "gal20ra10"));
    insta::assert_snapshot!("cupl_22v10", text(Dialect::Cupl, "gal22v10"));
    insta::assert_snapshot!("galasm_22v10", text(Dialect::Galasm, "gal22v10"));
    insta::assert_snapshot!("galasm_16v8", text(Dialect::Galasm, "gal16v8"));
    insta::assert_snapshot!("verilog", text(Dialect::Verilog, "gal22v10"));
    insta::assert_snapshot!("blif", text(Dialect::Blif, "gal22v10"));
}

/// Rows of a run of the circuit, as in a trace.
fn vectors(logic: &Logic, n_rows: usize) -> Vectors {
    let mut sim = LogicSim::new(logic);
    let row = |sim: &mut LogicSim<'_>, inputs: Vec<bool>| VectorRow {
        inputs,
        outputs: logic.outputs.ids().map(|id| Some(sim.output(id) & 1 == 1)).collect(),
        flops: logic.flops.ids().map(|id| Some(sim.flop(id) & 1 == 1)).collect(),
        clocks: 1,
    };
    let mut rows = vec![row(&mut sim, vec![false; logic.inputs.len()])];
    for k in 0..n_rows {
        let inputs: Vec<bool> =
            logic.inputs.ids().map(|id| (k * 7 + id.index() * 3) % 5 < 2).collect();
        for (id, value) in logic.inputs.ids().zip(&inputs) {
            sim.set_input(id, u64::from(*value));
        }
        sim.clock();
        rows.push(row(&mut sim, inputs));
    }
    Vectors {
        rows,
        mealy: vec![false; logic.outputs.len()],
        pulses: vec![false; logic.inputs.len()],
        ..Vectors::default()
    }
}

#[test]
fn test_vectors_become_a_simulation_section_and_are_skipped_when_read() {
    let logic = truck();
    let options = EmitOptions { vectors: Some(vectors(&logic, 3)), ..EmitOptions::default() };
    let text = there_and_back(&logic, Dialect::Palasm, &options);
    insta::assert_snapshot!("simulation", text.split("SIMULATION").nth(1).unwrap());
}

#[test]
fn vectors_of_another_circuit_are_refused() {
    let mut wrong = vectors(&truck(), 2);
    wrong.rows[1].inputs.pop();
    let options = EmitOptions { vectors: Some(wrong), ..EmitOptions::default() };
    assert_eq!(emit(&truck(), Dialect::Verilog, &options).unwrap_err()[0].code, codes::BAD_VECTORS);
}

/// Runs Icarus Verilog on a design and its bench; `None` if it is not installed.
fn icarus(design: &str, bench: &str, name: &str) -> Option<String> {
    use std::process::Command;
    if Command::new("iverilog").arg("-V").output().is_err() {
        eprintln!("skipped: iverilog is not installed");
        return None;
    }
    let folder = std::env::temp_dir().join(format!("grafsynth-pld-{}-{name}", std::process::id()));
    #[expect(clippy::disallowed_methods, reason = "a test writes temporary files")]
    {
        std::fs::create_dir_all(&folder).unwrap();
        std::fs::write(folder.join("design.v"), design).unwrap();
        std::fs::write(folder.join("bench.v"), bench).unwrap();
    }
    let compile = Command::new("iverilog")
        .args(["-g2001", "-Wall", "-o", "bench.vvp", "design.v", "bench.v"])
        .current_dir(&folder)
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&compile.stderr).into_owned();
    assert!(compile.status.success(), "{said}");
    assert!(!said.contains("error"), "{said}");
    let run = Command::new("vvp").args(["-n", "bench.vvp"]).current_dir(&folder).output().unwrap();
    std::fs::remove_dir_all(&folder).unwrap();
    Some(String::from_utf8_lossy(&run.stdout).into_owned())
}

#[test]
fn the_bench_passes_and_catches_each_wrong_literal() {
    let logic = truck();
    let options = EmitOptions {
        vectors: Some(vectors(&logic, 60)),
        reset: Some(Reset { name: "reset".into(), style: ResetStyle::Synchronous }),
        ..EmitOptions::default()
    };
    let emitted = emit(&logic, Dialect::Verilog, &options).unwrap();
    let bench = emitted.bench.unwrap();
    let Some(said) = icarus(&emitted.text, &bench, "right") else { return };
    assert!(said.contains("PASS 61 rows"), "{said}");
    for (index, (from, to)) in [
        ("p1 & m", "p1 & ~m"),
        ("p4 & a", "p3 & a"),
        ("R = p2", "R = ~p2"),
        ("p1 = 1'b1", "p1 = 1'b0"),
    ]
    .into_iter()
    .enumerate()
    {
        let wrong = emitted.text.replace(from, to);
        assert_ne!(wrong, emitted.text, "{from}");
        let said = icarus(&wrong, &bench, &format!("wrong{index}")).unwrap();
        assert!(said.contains("FAIL"), "{from}: {said}");
    }
}

#[test]
fn a_reset_input_comes_back_as_one_and_is_taken_out() {
    for style in [ResetStyle::Synchronous, ResetStyle::Asynchronous] {
        let logic = truck();
        let reset = Reset { name: "rst".into(), style };
        let options = EmitOptions { reset: Some(reset), ..EmitOptions::default() };
        let emitted = emit(&logic, Dialect::Verilog, &options).unwrap();
        let (back, findings) = read(Dialect::Verilog, FileId(0), &emitted.text);
        // A note reports that an asynchronous reset is read as a synchronous one.
        assert_eq!(findings.len(), usize::from(style == ResetStyle::Asynchronous), "{findings:?}");
        let mut back = back.unwrap();
        assert_eq!(rebind(&mut back, &emitted), []);
        let reset = back
            .inputs
            .iter()
            .find(|(_, input)| input.role == PinRole::Reset)
            .map(|(id, _)| id)
            .unwrap();
        let mut sim = LogicSim::new(&back);
        // The truck is in p2 after m; then the reset follows.
        let m = back.inputs.iter().find(|(_, input)| input.name == "m").map(|(id, _)| id).unwrap();
        sim.set_input(m, !0);
        sim.clock();
        assert_eq!(back.flops.ids().map(|id| sim.flop(id) & 1).collect::<Vec<_>>(), [0, 1, 0, 0]);
        sim.set_input(reset, !0);
        sim.clock();
        assert_eq!(back.flops.ids().map(|id| sim.flop(id) & 1).collect::<Vec<_>>(), [1, 0, 0, 0]);

        let without = crate::reset::strip(back.clone()).unwrap();
        assert_eq!(without.inputs.len(), logic.inputs.len());
        // A register that the reset does not set.
        let first = back.flops.ids().next().unwrap();
        let other = back.flops.values().nth(1).unwrap().next;
        for (id, flop) in back.flops.iter_mut() {
            if id == first {
                flop.next = other;
            }
        }
        let found = crate::reset::strip(back).unwrap_err();
        assert!(found.len() == 1 && found[0].message.contains("p1"), "{found:?}");
    }
}

#[test]
fn the_board_gives_pins_and_wrong_wishes_are_told_all_at_once() {
    let pins = |list: &[(&str, u32)]| EmitOptions {
        pins: list.iter().map(|(name, pin)| ((*name).to_owned(), *pin)).collect(),
        ..EmitOptions::default()
    };
    let good =
        emit(&truck(), Dialect::Galasm, &pins(&[("clock", 1), ("m", 11), ("R", 23), ("p1", 18)]))
            .unwrap();
    let pin =
        |name: &str| good.names.iter().find(|named| named.name == name).and_then(|named| named.pin);
    assert_eq!(
        [pin("clk"), pin("m"), pin("R"), pin("p1")],
        [Some(1), Some(11), Some(23), Some(18)]
    );
    let wrong =
        pins(&[("clock", 2), ("m", 12), ("R", 3), ("Z", 20), ("L", 20), ("n", 5), ("b", 99)]);
    let found = emit(&truck(), Dialect::Galasm, &wrong).unwrap_err();
    let messages = found.iter().map(|finding| finding.message.as_str()).join("\n");
    insta::assert_snapshot!(messages);
    assert!(found.iter().all(|finding| finding.code == codes::BAD_PIN));
}

#[test]
fn the_map_says_where_lines_come_from() {
    let emitted = emit(&truck(), Dialect::Palasm, &on("gal22v10")).unwrap();
    let lines: Vec<&str> = emitted.text.lines().collect();
    let entry = emitted.map.iter().rfind(|entry| entry.name == "R").unwrap();
    assert_eq!(lines[entry.line as usize - 1], "R := p1 * m + R * /b");
    assert_eq!(entry.req, ["R12"]);
}

#[test]
fn a_flipped_literal_is_another_circuit() {
    // For any changed literal of the equations the proof must fail; the change is also visible in a run.
    let logic = truck();
    let emitted = emit(&logic, Dialect::Palasm, &on("gal16v8")).unwrap();
    let at = emitted.text.find("EQUATIONS").unwrap();
    let mut n_flipped = 0;
    for (start, word) in
        words(&emitted.text[at + 10..]).into_iter().map(|(start, word)| (start + at + 10, word))
    {
        let line_start = emitted.text[..start].rfind('\n').unwrap() + 1;
        if !emitted.text[line_start..start].contains('=') {
            continue;
        }
        let mut wrong = emitted.text.clone();
        if wrong[..start].ends_with('/') {
            wrong.replace_range(start - 1..start, "")
        } else {
            wrong.insert(start, '/')
        }
        let (back, findings) = read(Dialect::Palasm, FileId(0), &wrong);
        assert_eq!(findings, []);
        let mut back = back.unwrap();
        assert_eq!(rebind(&mut back, &emitted), []);
        assert!(difference(&logic, &back, 200).is_some(), "{word} at {start}");
        n_flipped += 1;
    }
    assert_eq!(n_flipped, 4 * 4 + 3);
}

/// The names in a text with their places.
fn words(text: &str) -> Vec<(usize, &str)> {
    let mut found = Vec::new();
    let mut at = 0;
    for word in text.split(|c: char| !c.is_ascii_alphanumeric()) {
        if !word.is_empty() {
            found.push((at, word));
        }
        at += word.len() + 1;
    }
    found
}

/// The fuses contain the placed equations, and these equal the circuit of the truck.
#[test]
fn the_macrocells_of_the_truck_are_the_truck() {
    let logic = truck();
    for device in ["gal16v8", "gal20v8", "gal22v10", "gal20ra10"] {
        let options = EmitOptions { device: Some(device.into()), ..EmitOptions::default() };
        let equations =
            crate::equations::Equations::new(&logic, Dialect::Galasm, &options).unwrap();
        let placement = equations.placement().expect("the truck fits");
        let map = crate::fuse::map(&placement).unwrap();
        let said = crate::fuse::decode(&map).unwrap();
        assert_eq!(crate::fuse::differences(&placement, &said), Vec::<String>::new(), "{device}");
        let back = crate::fuse::logic(&placement, &equations.roles(&logic)).unwrap();
        super::same_behaviour(&logic, &back, 200);
    }
}
