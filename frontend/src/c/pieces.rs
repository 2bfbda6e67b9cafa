//! Constructors for parts of a chart with a span in a C text.

use grafsynth_ir::chart::{Declaration, DeclarationKind, Item};
use grafsynth_ir::net::Meta;
use grafsynth_ir::{Name, Span};

pub(super) fn meta(span: Span, label: String) -> Meta {
    Meta { span, label, req: Vec::new() }
}

pub(super) fn declaration(name: &str, span: Span, kind: DeclarationKind, label: String) -> Item {
    Item::Declaration(Declaration { name: Name::new(name, span), kind, meta: meta(span, label) })
}
