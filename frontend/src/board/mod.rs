//! Board files: the device and its pins, separate from the chart, so that one chart can be used with several boards. `place` is parsed here
//! and rejected during lowering.
//!
//! ```text
//! device gal22v10 {
//!     clock 1
//!     m 2
//!     R 23
//! }
//! ```
//!
//! The items are those of the chart language and are allowed in a chart as well.

use grafsynth_ir::FileId;
use grafsynth_ir::chart::{Board, Place};
use grafsynth_ir::diag::{Diagnostic, ErrorReported, nearest};

use crate::codes;
use crate::graf::parser::{Parse, Parser, short};
use crate::graf::token::Kind;
use crate::graf::{Limits, sorted, too_large};

/// The contents of a board file.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct BoardFile {
    /// The `device … { … }` items in order. If there is more than one, the caller reports an error.
    pub boards: Vec<Board>,
    /// The `place … on …` items in order.
    pub places: Vec<Place>,
}

/// Reads a board file.
#[must_use]
pub fn parse(file: FileId, text: &str) -> (BoardFile, Vec<Diagnostic>) {
    parse_within(file, text, &Limits::default())
}

/// Reads a board file with the given limits.
#[must_use]
pub fn parse_within(file: FileId, text: &str, limits: &Limits) -> (BoardFile, Vec<Diagnostic>) {
    let mut found = BoardFile::default();
    if let Some(finding) = too_large(file, text, limits) {
        return (found, vec![finding]);
    }
    let mut parser = Parser::new(file, text, None, *limits, false);
    while parser.kind(0) != Kind::End {
        let before = parser.peek(0).start;
        if item(&mut parser, &mut found).is_err() {
            parser.skip_to_line(before);
        }
        parser.depth = 0;
    }
    (found, sorted(parser.findings.finish()))
}

fn item(parser: &mut Parser<'_>, found: &mut BoardFile) -> Parse<()> {
    match parser.word(0) {
        "device" => found.boards.push(parser.board()?),
        "place" => found.places.push(parser.place()?),
        "" => return Err(parser.unexpected("`device` or `place`")),
        word => {
            let (span, near) = (parser.here(), nearest(word, ["device", "place"]));
            parser.report(|| {
                let finding = Diagnostic::error(
                    codes::UNKNOWN_WORD,
                    format!("unknown board item `{}`", short(word)),
                );
                finding.unknown_word(span, near, "a board file contains `device NAME { … }`")
            });
            return Err(ErrorReported);
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn devices_and_places() {
        let text = "# the board\ndevice gal22v10 { clock 1  m 2, R 23 \n n[0] 3 }\nplace p2, p3 on chip\nplace n on cpu\n";
        let (found, findings) = parse(FileId(0), text);
        assert_eq!(findings, []);
        assert_eq!((found.boards.len(), found.boards[0].pins.len(), found.places.len()), (1, 4, 2));
    }

    #[test]
    fn names_of_devices_with_hyphens_need_no_backquotes() {
        let device = |text: &str| {
            let (found, findings) = parse(FileId(0), &format!("device {text} {{ a 1 }}"));
            findings.is_empty().then(|| found.boards[0].device.text.clone())
        };
        for name in ["atf1504-plcc44", "pal16l8-as-gal16v8", "gal16v8d-15lp", "gal-16-v8"] {
            assert_eq!(device(name).as_deref(), Some(name));
            assert_eq!(device(&format!("`{name}`")).as_deref(), Some(name));
        }
        for text in ["gal - 15", "gal -15", "gal-", "gal--15", "`gal`-15", "gal->15"] {
            assert_eq!(device(text), None, "{text}");
        }
    }

    #[test]
    fn every_mistake_is_reported() {
        let (found, findings) = parse(
            FileId(0),
            "devise gal { a 1 }\ndevice gal { a b 2 }\nplace p on 7\nplace q on cpu\n}",
        );
        let codes: Vec<&str> = findings.iter().map(|f| f.code.id).collect();
        assert_eq!(codes, ["G0104", "G0101", "G0101", "G0101"]);
        assert_eq!((found.boards.len(), found.places.len()), (1, 2));
    }
}
