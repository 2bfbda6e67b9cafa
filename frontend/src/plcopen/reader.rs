//! Shared functions for all parts of a project: elements, names, and embedded structured text.

use grafsynth_ir::diag::{Code, Diagnostic};
use grafsynth_ir::{FileId, Span};
use roxmltree::Node;

use crate::findings::Findings;
use crate::st::ast::{Expr, ExprKind, Refusal, Section, Stmt, TypeRef, Var};
use crate::st::lexer::{Kind, Places};
use crate::st::parse::Parser;
use crate::st::symbol::Ident;
use crate::xml::{self, Mapped};

pub(super) struct Reader<'r, 't> {
    pub(super) file: FileId,
    pub(super) text: &'t str,
    pub(super) findings: &'r mut Findings,
    pub(super) nesting: u32,
}

/// The unit that is being read, with the declarations that its bodies add.
#[derive(Debug, Default)]
pub(super) struct Unit {
    pub(super) refused: Vec<Refusal>,
    /// Undeclared instances that diagrams need: edge detectors.
    pub(super) vars: Vec<Var>,
}

impl Unit {
    pub(super) fn refuse(&mut self, what: impl Into<String>, span: Span, help: &str) {
        // Further findings would not be shown; they are usually consequences of earlier ones.
        if self.refused.len() < 10_000 {
            let what: String = what.into();
            self.refused.push(Refusal::unsupported(&what, span, help));
        }
    }

    pub(super) fn mistake(
        &mut self,
        code: Code,
        message: impl Into<String>,
        span: Span,
        help: &str,
    ) {
        if self.refused.len() < 10_000 {
            self.refused.push(Refusal::mistake(code, message, span, help));
        }
    }

    /// Declares a new instance of R_TRIG or F_TRIG.
    pub(super) fn edge(&mut self, base: &str, is_rising: bool, span: Span) -> Ident {
        let word = if is_rising { "rise" } else { "fall" };
        let mut n = 1;
        let name = loop {
            let number = if n > 1 { n.to_string() } else { String::new() };
            let name = Ident::new(format!("{base}_{word}{number}"), span);
            if self.vars.iter().all(|var| var.name.id != name.id) {
                break name;
            }
            n += 1;
        };
        let ty = if is_rising { "R_TRIG" } else { "F_TRIG" };
        self.vars.push(Var {
            name: name.clone(),
            section: Section::Local,
            is_constant: false,
            ty: TypeRef::named(ty, span),
            init: None,
            address: None,
            label: String::new(),
        });
        name
    }
}

/// The local name of an element.
pub(super) fn tag<'a>(node: Node<'a, '_>) -> &'a str {
    node.tag_name().name()
}

/// Whether a Boolean attribute is true, in either notation of XML.
pub(super) fn is_set(node: Node<'_, '_>, attribute: &str) -> bool {
    node.attribute(attribute).is_some_and(|value| matches!(value.trim(), "true" | "1"))
}

/// The first child element with this name.
pub(super) fn child<'a, 'd>(node: Node<'a, 'd>, name: &str) -> Option<Node<'a, 'd>> {
    node.children().find(|child| child.is_element() && child.tag_name().name() == name)
}

/// All child elements with this name.
pub(super) fn children<'a, 'd: 'a>(
    node: Node<'a, 'd>,
    name: &'static str,
) -> impl Iterator<Item = Node<'a, 'd>> {
    node.children().filter(move |child| child.is_element() && child.tag_name().name() == name)
}

impl<'t> Reader<'_, 't> {
    pub(super) fn span(&self, node: Node<'_, '_>) -> Span {
        xml::tag_span(self.file, node)
    }

    /// The trimmed name in an attribute.
    pub(super) fn name(&self, node: Node<'_, '_>, attribute: &str) -> Option<Ident> {
        let found = node.attributes().find(|one| one.name() == attribute)?;
        let mapped = Mapped::value(self.file, self.text, found).trimmed();
        let span = mapped.whole();
        (!mapped.text.is_empty()).then(|| Ident::new(mapped.text.clone(), span))
    }

    pub(super) fn report(&mut self, make: impl FnOnce() -> Diagnostic) {
        self.findings.report(make);
    }

    /// The text of an element, formatted or not.
    pub(super) fn content(&self, node: Node<'_, '_>) -> Mapped<'t> {
        Mapped::formatted(self.file, self.text, node)
    }

    /// Parses a body or a part of one, and records in the unit what is not supported.
    pub(super) fn parsed<T>(
        &mut self,
        mapped: &Mapped<'_>,
        unit: &mut Unit,
        read: impl FnOnce(&mut Parser<'_>) -> T,
    ) -> T {
        let places = Places::Mapped(mapped);
        let mut parser = Parser::new(&mapped.text, places, self.findings, self.nesting);
        parser.is_body = true;
        let found = read(&mut parser);
        unit.refused.append(&mut parser.refused);
        found
    }

    /// Parses structured text in an element.
    pub(super) fn statements(&mut self, node: Node<'_, '_>, unit: &mut Unit) -> Vec<Stmt> {
        let mapped = self.content(node);
        self.parsed(&mapped, unit, |parser| {
            let mut list = parser.statements();
            while parser.kind(0) != Kind::End {
                parser.expected("a statement");
                parser.advance();
                list.extend(parser.statements());
            }
            list
        })
    }

    /// Parses an expression in an element. As in a condition, `:=` before it and `;` after it are allowed.
    pub(super) fn expression(&mut self, mapped: &Mapped<'_>, unit: &mut Unit) -> Option<Expr> {
        self.parsed(mapped, unit, |parser| {
            // `name := condition;`
            if parser.kind(0) == Kind::Word && parser.kind(1) == Kind::Assign {
                parser.advance();
            }
            parser.take(Kind::Assign);
            let expr = parser.expression().ok();
            parser.take(Kind::Semicolon);
            if expr.is_some() && parser.kind(0) != Kind::End {
                parser.expected("the end of the expression");
            }
            expr
        })
    }

    pub(super) fn expression_in(&mut self, node: Node<'_, '_>, unit: &mut Unit) -> Option<Expr> {
        let mapped = self.content(node);
        self.expression(&mapped, unit)
    }

    pub(super) fn expression_of(
        &mut self,
        node: Node<'_, '_>,
        attribute: &str,
        unit: &mut Unit,
    ) -> Option<Expr> {
        let found = node.attributes().find(|one| one.name() == attribute)?;
        let mapped = Mapped::value(self.file, self.text, found).trimmed();
        if mapped.text.is_empty() {
            return None;
        }
        self.expression(&mapped, unit)
    }
}

/// The constant `true` or `false` at a location.
pub(super) fn constant(value: bool, span: Span) -> Expr {
    Expr::new(ExprKind::Bool(value), span)
}
