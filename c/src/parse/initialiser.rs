//! Initialisers (C99 6.7.8): all braces and positions become explicit.

use super::lexer::TokenKind;
use super::{Parser, Read};
use crate::codes;
use crate::tree::types::Type;
use crate::tree::{Expr, Init, Loc, Part};
use grafsynth_ir::Span;
use std::collections::BTreeSet;
use std::iter::Peekable;
use std::sync::Arc;
use std::vec::IntoIter;

/// An initialiser as it is written.
#[derive(Debug)]
enum Written {
    Value(Expr),
    List(Vec<Entry>, Span),
}

#[derive(Debug)]
struct Entry {
    designator: Option<Designator>,
    written: Written,
}

#[derive(Debug)]
enum Designator {
    Member(String, Span),
    Index(i128, Span),
}

impl Parser<'_, '_> {
    /// Reads the initialiser of an object of this canonical type. Returns it with the completed type, because an initialiser can determine the length of an
    /// array.
    pub(super) fn initialiser(&mut self, ty: &Type) -> Read<(Init, Type)> {
        let written = self.deeper(Self::written)?;
        let init = self.elaborate(ty, written)?;
        let ty = match (ty, &init) {
            (Type::Array(element, None), Init::Parts(parts)) => {
                let len = parts.iter().map(|part| part.at + 1).max();
                Type::Array(Arc::clone(element), len)
            }
            _ => ty.clone(),
        };
        Ok((init, ty))
    }

    fn written(&mut self) -> Read<Written> {
        let start = self.span();
        if !self.take("{") {
            return Ok(Written::Value(self.assignment_value()?));
        }
        let mut entries = Vec::new();
        while !self.take("}") {
            let designator = self.designator()?;
            let written = self.deeper(Self::written)?;
            entries.push(Entry { designator, written });
            if !self.take(",") {
                self.expect("}")?;
                break;
            }
        }
        let span = self.since(start).0;
        if entries.is_empty() {
            return self.fail(codes::SYNTAX, "an initialiser cannot be empty", span, "here");
        }
        Ok(Written::List(entries, span))
    }

    fn designator(&mut self) -> Read<Option<Designator>> {
        let start = self.span();
        let found = if self.take(".") {
            let name = self.next();
            if name.kind != TokenKind::Word {
                return self.fail(
                    codes::SYNTAX,
                    "expected the name of a member",
                    name.span,
                    "here",
                );
            }
            Designator::Member(name.text.to_owned(), name.span)
        } else if self.take("[") {
            let (_, value) = self.deeper(Self::constant)?;
            self.expect("]")?;
            Designator::Index(value, start)
        } else {
            return Ok(None);
        };
        if self.peek().is(".") || self.peek().is("[") {
            let message = "only one member or element can be designated; use braces";
            let span = self.span();
            return self.fail(codes::SYNTAX, message, span, "here");
        }
        self.expect("=")?;
        Ok(Some(found))
    }

    fn elaborate(&mut self, ty: &Type, written: Written) -> Read<Init> {
        match (ty, written) {
            (Type::Array(..) | Type::Struct(_), Written::List(entries, span)) => {
                let mut entries = entries.into_iter().peekable();
                let init = self.parts(ty, &mut entries, true)?;
                match entries.next() {
                    Some(_) => self.fail(codes::TYPE, "there are too many values", span, "here"),
                    None => Ok(init),
                }
            }
            (Type::Array(..), Written::Value(value)) => self.fail(
                codes::TYPE,
                "the initial values of an array must be in braces",
                value.span.0,
                "here",
            ),
            (_, Written::Value(value)) => {
                let span = value.span;
                Ok(Init::Value(self.typed(self.unit.convert_to(value, ty), span)?))
            }
            (_, Written::List(entries, span)) => {
                // A scalar may have braces (C99 6.7.8p11).
                let mut entries = entries.into_iter();
                match (entries.next(), entries.next()) {
                    (Some(Entry { designator: None, written: only @ Written::Value(_) }), None) => {
                        self.elaborate(ty, only)
                    }
                    _ => self.fail(codes::TYPE, "this object takes a single value", span, "here"),
                }
            }
        }
    }

    /// The parts of an array or a structure. Without braces of its own, it takes as many entries as it has parts (C99 6.7.8p20).
    fn parts(
        &mut self,
        ty: &Type,
        entries: &mut Peekable<IntoIter<Entry>>,
        has_braces: bool,
    ) -> Read<Init> {
        let (mut parts, mut seen, mut next) = (Vec::new(), BTreeSet::new(), 0_u64);
        while let Some(entry) = entries.peek() {
            if let Some(designator) = &entry.designator {
                if !has_braces {
                    break;
                }
                next = self.designated(ty, designator)?;
            }
            let Some(part) = self.part(ty, next) else { break };
            let span = span_of(&entry.written);
            if !seen.insert(next) {
                return self.fail(codes::TYPE, "this part already has a value", span, "again here");
            }
            let is_value_of_it = match (&entry.written, &part) {
                (Written::List(..), _) => true,
                (Written::Value(value), Type::Struct(_)) => value.ty == part,
                (Written::Value(_), part) => !matches!(part, Type::Array(..)),
            };
            let init = if is_value_of_it {
                match entries.next() {
                    Some(entry) => self.elaborate(&part, entry.written)?,
                    None => break,
                }
            } else {
                // The designator belongs to the outer list.
                if let Some(entry) = entries.peek_mut() {
                    entry.designator = None;
                }
                self.deeper(|parser| parser.parts(&part, entries, false))?
            };
            parts.push(Part { at: next, init });
            next += 1;
        }
        Ok(Init::Parts(parts))
    }

    /// The type of a part, if there is such a part.
    fn part(&self, ty: &Type, at: u64) -> Option<Type> {
        match ty {
            Type::Array(element, len) => len.is_none_or(|len| at < len).then(|| element.ty.clone()),
            Type::Struct(id) => {
                let at = usize::try_from(at).ok()?;
                Some(self.unit.structs[*id].members.get(at)?.canonical.ty.clone())
            }
            Type::Void
            | Type::Int(_)
            | Type::Enum(_)
            | Type::Pointer(_)
            | Type::Function(_)
            | Type::Named(_) => None,
        }
    }

    fn designated(&mut self, ty: &Type, designator: &Designator) -> Read<u64> {
        let (found, span) = match (designator, ty) {
            (Designator::Member(name, span), Type::Struct(id)) => {
                let members = &self.unit.structs[*id].members;
                (members.iter().position(|one| one.name == *name).map(|at| at as u64), *span)
            }
            (Designator::Index(value, span), Type::Array(_, len)) => {
                let at = u64::try_from(*value).ok().filter(|at| *at < len.unwrap_or(1 << 40));
                (at, *span)
            }
            (Designator::Member(_, span) | Designator::Index(_, span), _) => (None, *span),
        };
        match found {
            Some(at) => Ok(at),
            None => self.fail(codes::TYPE, "the object has no such part", span, "here"),
        }
    }
}

fn span_of(written: &Written) -> Span {
    match written {
        Written::Value(Expr { span: Loc(span), .. }) | Written::List(_, span) => *span,
    }
}
