//! The examples of the pages for this crate's codes.

use super::truck;
use crate::vectors::{TraceRow, Vectors};
use crate::{Dialect, EmitOptions, codes, emit, read, rebind};
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::facts::Facts;
use grafsynth_ir::lower::program::{ProgramOptions, program};
use grafsynth_ir::{FileId, text, validate};
use grafsynth_logic::minimise::Budget;
use grafsynth_logic::{EncodeOptions, encode};

/// Builds a net's example with the options of its fence.
fn build(source: &str, words: &[&str]) -> Vec<Diagnostic> {
    let (net, findings) = text::parse(FileId(0), source);
    assert_eq!(findings, []);
    let net = validate(net.unwrap()).unwrap();
    let program = program(&net, &ProgramOptions::default()).unwrap();
    let logic = encode(&net, &program, &Facts::default(), &EncodeOptions::default()).unwrap();
    if words.first() == Some(&"convert") {
        let mut found = crate::pla::table(&logic, Budget::default()).unwrap_err();
        found.dedup_by_key(|finding| finding.code);
        return found;
    }
    let after =
        |option: &str| words.iter().position(|word| *word == option).map(|at| words[at + 1]);
    let dialect =
        Dialect::ALL.into_iter().find(|dialect| after("--target") == Some(dialect.name())).unwrap();
    if words.contains(&"--stimulus") {
        let rows = [TraceRow { dt: 5, inputs: vec![1], ..TraceRow::default() }];
        return Vectors::of(&net, &logic, &rows).unwrap_err();
    }
    let options = EmitOptions {
        device: after("--device").map(str::to_owned),
        pins: net.board.pins.iter().map(|(name, pin)| (name.text.clone(), *pin)).collect(),
        ..EmitOptions::default()
    };
    emit(&logic, dialect, &options).unwrap_err()
}

#[test]
fn each_page_has_an_example_that_shows_its_code() {
    for code in codes::ALL {
        let path = format!("{}/../docs/codes/{}.md", env!("CARGO_MANIFEST_DIR"), code.id);
        #[expect(clippy::disallowed_methods, reason = "a test reads the book")]
        let page = std::fs::read_to_string(&path).unwrap();
        assert!(page.starts_with(&format!("# {}: {}\n", code.id, code.title)), "{path}");
        let example = page.split("```").nth(1).unwrap();
        let (info, source) = example.split_once('\n').unwrap();
        let words: Vec<&str> = info.split_whitespace().collect();
        let dialect = Dialect::ALL.into_iter().find(|dialect| dialect.name() == words[0]);
        let found = match (dialect, &words[1..]) {
            (None, options) => build(source, options),
            (Some(dialect), ["read", "back"]) => {
                let mut logic = truck();
                logic.outputs = Default::default();
                let emitted = emit(&logic, dialect, &EmitOptions::default()).unwrap();
                let mut other = read(dialect, FileId(0), source).0.unwrap();
                let mut found = rebind(&mut other, &emitted);
                found.dedup_by_key(|finding| finding.code);
                found
            }
            (Some(dialect), ["65", "MiB"]) => {
                read(dialect, FileId(0), &source.repeat((65 << 20) / source.len())).1
            }
            (Some(dialect), ["build", ..]) => {
                let said = crate::read_text(dialect, FileId(0), source);
                assert_eq!(said.findings, [], "{path}");
                said.placement.err().unwrap_or_default()
            }
            (Some(dialect), ["convert", ..]) => {
                let logic = read(dialect, FileId(0), source).0.unwrap();
                emit(&logic, Dialect::Palasm, &EmitOptions::default()).unwrap_err()
            }
            (Some(dialect), _) => read(dialect, FileId(0), source).1,
        };
        let found: Vec<_> = found.iter().map(|finding| finding.code.id).collect();
        assert_eq!(found, [code.id], "{path}");
    }
}
