//! Tests of the reader and the printer of C, in one program.

mod hostile;
mod orders;
mod pages;
mod round_trip;
mod trees;
mod typing;

use grafsynth_c::tree::Unit;
use grafsynth_c::{Config, Input, SourceFile, parse};
use grafsynth_ir::{Diagnostic, FileId};

/// Reads one file.
fn read(text: &str, config: &Config) -> (Option<Unit>, Vec<Diagnostic>) {
    let files = [SourceFile { file: FileId(0), name: "test.c", text }];
    parse(&Input { files: &files, verbatim: &[], readers: &[], config })
}

/// The tree of a text that must be correct.
fn good(text: &str, config: &Config) -> Unit {
    match read(text, config) {
        (Some(unit), _) => unit,
        (None, found) => panic!("{text}\n{found:#?}"),
    }
}

/// The code of the first finding in a text that must be wrong.
fn code(text: &str, config: &Config) -> &'static str {
    let (unit, found) = read(text, config);
    assert!(unit.is_none(), "this is read: {text}");
    found.first().expect("a finding").code.id
}
