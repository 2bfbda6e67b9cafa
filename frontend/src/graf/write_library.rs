//! Library charts and their certificates as text.

use grafsynth_ir::chart::{Certificate, Library};

use super::names::{self, Position};
use super::token::Kind;
use super::write::{WIDTH, Writer, fill};
use super::write_text::{attributes, conditions};

impl Writer<'_> {
    pub(super) fn library(&mut self, library: &Library) {
        self.text.exprs.conditions = conditions(&library.items);
        let (start, end) = (library.name.span.end, library.span.end);
        let (open, _) = self.find(Kind::OpenBrace, start, end);
        self.before(library.span.start, open);
        let name = names::name(&library.name.text, Position::Anywhere);
        let parameters: Vec<String> =
            library.parameters.iter().map(|one| self.text.parameter(one)).collect();
        let mut head = format!("library chart {name}");
        if !parameters.is_empty() {
            // Room for the parenthesis, the brace and the text between them.
            let room = self.room().saturating_sub(3 + attributes(&library.meta).len());
            head = fill(&format!("{head}("), &parameters, ",", "", room).join("\n    ");
            head.push(')');
        }
        head.push_str(&attributes(&library.meta));
        if library.items.is_empty() && !self.has_comment(open, end) {
            self.line(&format!("{head} {{}}"));
        } else {
            self.block(&head, start, end, &mut |writer| writer.items(&library.items));
        }
        self.after(end);
    }

    pub(super) fn certificate(&mut self, certificate: &Certificate) {
        let text = certificate_text(certificate);
        self.simple(certificate.span, &text);
    }
}

/// `certificate belt by "0.1.0" sha256 "…" proves still`
pub(super) fn certificate_text(certificate: &Certificate) -> String {
    let mut text = format!(
        "certificate {} by {} sha256 {}",
        names::name(&certificate.of.text, Position::Anywhere),
        names::quoted(&certificate.version),
        names::quoted(&certificate.hash)
    );
    let properties: Vec<String> = certificate
        .properties
        .iter()
        .map(|property| names::name(&property.text, Position::Anywhere))
        .collect();
    if !properties.is_empty() {
        text.push_str("\n    ");
        let lines = fill("proves ", &properties, ",", "", WIDTH - 4);
        text.push_str(&lines.join("\n        "));
    }
    text
}
