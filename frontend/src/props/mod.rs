//! Properties in a separate file (`NAME.props`) or on the command line (`--assert`), for formats without properties.
//!
//! Each line is a property in the syntax of the chart language: `assert never (R and L)`, `assume never (a and b)`, with an optional name,
//! label and tags. A line that begins with `never` or `always` is an assertion, as on the command line: `--assert 'never (R and L)'`. `#`
//! begins a comment. Names refer to the design; they are resolved when the properties are added to its net.
//!
//! ```
//! use grafsynth_frontend::props;
//! use grafsynth_ir::FileId;
//!
//! let (properties, findings) = props::parse(FileId(0), "assume never (a and b)\nnever (R and L)  # both motors\n");
//! assert!(findings.is_empty());
//! assert_eq!(properties.len(), 2);
//! assert!(properties[0].is_assumption && !properties[1].is_assumption);
//! ```

use grafsynth_ir::FileId;
use grafsynth_ir::chart::Property;
use grafsynth_ir::diag::{Diagnostic, any_error};

use crate::graf::numbers::Numbers;
use crate::graf::parser::{Parse, Parser};
use crate::graf::token::Kind;
use crate::graf::{CHECK_FIRST, Limits, sorted, too_large};

/// Reads properties. The types of names are unknown here, so `+` and `*` are arithmetic only next to a number; see [`parse_for`].
#[must_use]
pub fn parse(file: FileId, text: &str) -> (Vec<Property>, Vec<Diagnostic>) {
    read(file, text, None, &Limits::default())
}

/// Reads properties for a design in which the given names are integers.
#[must_use]
pub fn parse_for<'a>(
    file: FileId,
    text: &str,
    integers: impl IntoIterator<Item = &'a str>,
    limits: &Limits,
) -> (Vec<Property>, Vec<Diagnostic>) {
    let numbers = Numbers::of(integers);
    read(file, text, Some(&numbers), limits)
}

fn read(
    file: FileId,
    text: &str,
    numbers: Option<&Numbers<'_>>,
    limits: &Limits,
) -> (Vec<Property>, Vec<Diagnostic>) {
    if let Some(finding) = too_large(file, text, limits) {
        return (Vec::new(), vec![finding]);
    }
    if text.len() > CHECK_FIRST {
        // For a large text with errors, no tree is built.
        let mut parser = Parser::new(file, text, numbers, *limits, true);
        all(&mut parser);
        let findings = parser.findings.finish();
        if any_error(&findings) {
            return (Vec::new(), sorted(findings));
        }
    }
    let mut parser = Parser::new(file, text, numbers, *limits, false);
    let properties = all(&mut parser);
    (properties, sorted(parser.findings.finish()))
}

fn all(parser: &mut Parser<'_>) -> Vec<Property> {
    let mut properties = Vec::new();
    while parser.kind(0) != Kind::End {
        let before = parser.peek(0).start;
        match property(parser) {
            Ok(property) => parser.keep(&mut properties, property),
            Err(_) => parser.skip_to_line(before),
        }
        parser.depth = 0;
    }
    properties
}

fn property(parser: &mut Parser<'_>) -> Parse<Property> {
    match parser.word(0) {
        "assume" | "assert" => parser.property(),
        _ if matches!(parser.word(0), "never" | "always")
            || parser.is_name(0) && parser.kind(1) == Kind::Colon =>
        {
            let start = parser.peek(0).start;
            parser.property_from(start, false)
        }
        _ => Err(parser.unexpected("`assert` or `assume`, then `never` or `always`")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_line_is_a_property() {
        let text = "# both\nassume a1: never (a and b) \"label\" req \"R1\"\nsafe: always not (R and L)\n\nassert never n + k > 3\n";
        let (properties, findings) = parse_for(FileId(0), text, ["n", "k"], &Limits::default());
        assert_eq!(findings, []);
        assert_eq!(
            properties.iter().map(|p| (p.is_assumption, p.is_never)).collect::<Vec<_>>(),
            [(true, true), (false, false), (false, true)]
        );
        assert_eq!(properties[1].name.as_ref().map(|name| name.text.as_str()), Some("safe"));
    }

    #[test]
    fn every_bad_line_is_reported() {
        let text = "never (a\nR and L\nassert sometimes a\nnever b } )\nnever c";
        let (properties, findings) = parse(FileId(0), text);
        assert_eq!(findings.iter().map(|f| f.code.id).collect::<Vec<_>>(), ["G0101"; 4]);
        assert_eq!(properties.len(), 2);
    }
}
