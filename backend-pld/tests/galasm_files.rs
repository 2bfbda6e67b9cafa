//! `GALasm` texts by others: every valid one gives its macrocells, every invalid one its errors with their locations.

#![allow(clippy::print_stdout, reason = "tests report what they skip")]
#![allow(clippy::disallowed_methods, reason = "tests read files")]

use grafsynth_backend_pld::placement::{CellKind, Placement, Product};
use grafsynth_backend_pld::{Dialect, read_text};
use grafsynth_ir::span::FileId;
use itertools::Itertools as _;
use std::path::{Path, PathBuf};

/// The folder with files by others, from an environment variable or next to the checkout.
fn corpus(folder: &str) -> Vec<(String, String)> {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/corpus");
    let root = std::env::var_os("GRAFSYNTH_CORPUS").map_or(beside, PathBuf::from);
    let Ok(entries) = std::fs::read_dir(root.join(folder)) else {
        println!("skipped: no corpus (GRAFSYNTH_CORPUS names its folder)");
        return Vec::new();
    };
    let mut files: Vec<(String, String)> = entries
        .flatten()
        .map(|entry| entry.path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "pld"))
        .map(|path| {
            let name = path.file_name().expect("a name").to_string_lossy().into_owned();
            (name, std::fs::read_to_string(&path).expect("a text"))
        })
        .collect();
    files.sort();
    files
}

/// A placement as text in a canonical form: the values of pins as functions of the levels of pins.
fn shown(placement: &Placement) -> String {
    let product = |product: &Product| {
        let literal =
            |(pin, level): &(u32, bool)| format!("{}{pin}", if *level { "" } else { "/" });
        if product.0.is_empty() { "1".to_owned() } else { product.0.iter().map(literal).join("*") }
    };
    let mut lines: Vec<String> = Vec::new();
    for cell in &placement.cells {
        let kind = match cell.kind {
            CellKind::Combinational => "=",
            CellKind::Registered => ":=",
            CellKind::Tristate => "~",
        };
        let sum = cell.sum.iter().map(product).join(" + ");
        let mut line =
            format!("{}{} {kind} {}", if cell.is_active_low { "/" } else { "" }, cell.pin, sum);
        let more = [(&cell.enable, "e"), (&cell.clock, "c"), (&cell.set, "s"), (&cell.reset, "r")];
        for (control, name) in more {
            if let Some(control) = control {
                line += &format!(" {name}({})", product(control));
            }
        }
        lines.push(line);
    }
    for (control, name) in [(&placement.async_reset, "ar"), (&placement.sync_preset, "sp")] {
        if let Some(control) = control {
            lines.push(format!("{name} {}", product(control)));
        }
    }
    lines.join("\n")
}

fn placed(text: &str) -> String {
    let said = read_text(Dialect::Galasm, FileId(0), text);
    assert_eq!(said.findings, [], "{text}");
    shown(&said.placement.expect("macrocells"))
}

#[test]
fn macrocells_are_taken_as_written() {
    let v10 = "GAL22V10\nSig ; x\nclk a b NC NC NC NC NC NC NC NC GND\n/oe q r /s t NC NC NC NC NC NC VCC\n";
    let text = format!(
        "{v10}q.R = a * /b + q\n/r.R = s\ns = /a\n  + b * r\nt.T = VCC\nt.E = a\nAR = b\nSP = GND\n"
    );
    assert_eq!(placed(&text), "14 := 2*/3 + 14\n/15 := /16\n/16 = /2 + 3*15\n17 ~ 1 e(2)\nar 3");
    let said = read_text(Dialect::Galasm, FileId(0), &text);
    let placement = said.placement.expect("macrocells");
    assert_eq!(placement.signature, *b"Sig");
    let names: Vec<&str> = placement.pins.iter().map(|pin| pin.name.as_str()).collect();
    assert_eq!(names, ["clk", "a", "b", "oe", "q", "r", "s", "t"]);
    let ra =
        "GAL20RA10\nSig\n/pl a b NC NC NC NC NC NC NC c GND\n/oe q r NC NC NC NC NC NC NC NC VCC\n";
    assert_eq!(
        placed(&format!("{ra}q.R = GND\nq.CLK = c * a\nq.ARST = a\nq.APRST = /b\nr = a\n")),
        "14 :=  c(11*2) s(/3) r(2)\n15 = 2"
    );
    let said = read_text(Dialect::Galasm, FileId(0), &format!("{ra}q.R = a\nq.CLK = /c\n"));
    assert!(said.logic.is_none() && said.beyond.len() == 1, "its clock falls");
}

#[test]
fn sound_files_by_others_give_macrocells() {
    for (name, text) in corpus("gal/success") {
        let said = read_text(Dialect::Galasm, FileId(0), &text);
        assert_eq!(said.findings, [], "{name}");
        let placement = said.placement.expect("macrocells");
        assert!(!placement.cells.is_empty(), "{name}");
        println!("{name}\n{}", shown(&placement));
    }
}

#[test]
fn broken_files_by_others_are_refused_at_their_place() {
    for (name, text) in corpus("gal/failure") {
        let said = read_text(Dialect::Galasm, FileId(0), &text);
        assert!(said.findings.iter().any(|finding| finding.is_error()), "{name} is accepted");
        assert!(said.logic.is_none() && said.placement.is_err(), "{name}");
        for finding in &said.findings {
            let span = finding.labels.first().expect("a place").span;
            assert!(span.end as usize <= text.len(), "{name}: {finding:?}");
            let line = text[..span.start as usize].matches('\n').count() + 1;
            println!("{name}:{line}: {} {}", finding.code.id, finding.message);
        }
    }
}
