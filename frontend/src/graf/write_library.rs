//! Library charts and their certificates as text.

use grafsynth_ir::chart::{Certificate, Library};

use super::layout::{Doc, fill, indented, text};
use super::names::{self, Position};
use super::write::Writer;
use super::write_text::{attributes, conditions};

impl Writer<'_> {
    pub(super) fn library(&mut self, library: &Library) {
        self.text.exprs.conditions = conditions(&library.items);
        let name = names::name(&library.name.text, Position::Anywhere);
        let parameters: Vec<String> =
            library.parameters.iter().map(|one| self.text.parameter(one)).collect();
        let attributes = attributes(&library.meta);
        let mut head = text(format!("library chart {name}"));
        if !parameters.is_empty() {
            // Room for the parenthesis, the brace and the text between them.
            let parameters = fill(&parameters, ",", "", 3 + attributes.len());
            head = head.append("(").append(parameters).append(")");
        }
        let (span, from) = (library.span, library.name.span.end);
        self.container(
            head.append(text(attributes)),
            span,
            from,
            library.items.is_empty(),
            |writer| {
                writer.items(&library.items);
            },
        );
    }

    pub(super) fn certificate(&mut self, certificate: &Certificate) {
        self.laid_out(certificate.span, certificate_doc(certificate));
    }
}

/// `certificate belt by "0.1.0" sha256 "…" proves still`
pub(super) fn certificate_doc(certificate: &Certificate) -> Doc {
    let head = text(format!(
        "certificate {} by {} sha256 {}",
        names::name(&certificate.of.text, Position::Anywhere),
        names::quoted(&certificate.version),
        names::quoted(&certificate.hash)
    ));
    let properties: Vec<String> = certificate
        .properties
        .iter()
        .map(|property| names::name(&property.text, Position::Anywhere))
        .collect();
    if properties.is_empty() {
        return head;
    }
    let list = Doc::text("proves ").append(fill(&properties, ",", "", 0));
    head.append(indented(Doc::hardline().append(list)))
}
