//! Specifiers and declarators (C99 6.7.2..6.7.6): the types of declared names.

use super::lexer::TokenKind;
use super::{MAX_DEPTH, Parser, Read};
use crate::codes;
use crate::tree::types::{
    FunctionType, IntKind, MAX_TYPE_DEPTH, Qualified, Qualifiers, Space, Type,
};
use crate::tree::{Enum, Header, Loc, Member, Note, Struct, Symbol, SymbolKind, Tag};
use grafsynth_ir::Span;
use std::collections::BTreeSet;
use std::sync::Arc;

/// The specifiers that precede the declarators of a declaration.
#[derive(Debug)]
pub(super) struct Specifiers {
    pub(super) storage: Option<Storage>,
    pub(super) is_inline: bool,
    pub(super) base: Qualified,
    /// The structure or enumeration that these specifiers define.
    pub(super) defines: Option<Tag>,
    /// True if the specifiers only mention a structure: `struct t;` declares it.
    pub(super) mentions: bool,
    pub(super) span: Span,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Storage {
    Typedef,
    Extern,
    Static,
}

/// A declared name with its type.
#[derive(Debug)]
pub(super) struct Declared {
    /// The name; `None` for an abstract declarator.
    pub(super) name: Option<(String, Span)>,
    pub(super) ty: Qualified,
    /// The parameters, if the name itself is a function.
    pub(super) params: Option<Vec<Declared>>,
    /// True if the declarator is followed by `__reentrant`.
    pub(super) is_on_stack: bool,
}

/// A step from a name to the base of its type.
#[derive(Debug)]
enum Derivation {
    Pointer(Qualifiers),
    Array(Option<u64>, Span),
    Function(Vec<Declared>),
}

#[derive(Debug, Default)]
struct Declarator {
    name: Option<(String, Span)>,
    /// The derivations, from the name outwards.
    steps: Vec<Derivation>,
    is_on_stack: bool,
}

/// The keywords of an integer type, counted.
#[derive(Debug, Default)]
struct Words {
    base: Option<Type>,
    int: u8,
    long: u8,
    short: u8,
    signed: u8,
    unsigned: u8,
}

impl Words {
    fn is_empty(&self) -> bool {
        self.base.is_none() && self.int + self.long + self.short + self.signed + self.unsigned == 0
    }

    /// The type that the keywords name (C99 6.7.2p2).
    fn ty(self) -> Option<Type> {
        let Words { base, int, long, short, signed, unsigned } = self;
        if int > 1 || short > 1 || signed + unsigned > 1 || long > 2 || short + long > 2 {
            return None;
        }
        let is_unsigned = unsigned == 1;
        let kind = match (base, int + long + short) {
            (Some(Type::Int(IntKind::Char)), 0) => match (signed, unsigned) {
                (0, 0) => IntKind::Char,
                (1, _) => IntKind::SChar,
                _ => IntKind::UChar,
            },
            (Some(other), 0) if signed + unsigned == 0 => return Some(other),
            (Some(_), _) => return None,
            (None, _) => match (short, long) {
                (0, 0) => IntKind::Int,
                (1, 0) => IntKind::Short,
                (0, 1) => IntKind::Long,
                (0, 2) => IntKind::LLong,
                _ => return None,
            },
        };
        Some(Type::Int(if is_unsigned { kind.unsigned() } else { kind }))
    }
}

impl<'a> Parser<'a, '_> {
    /// True if the token at distance `ahead` begins a type name.
    pub(super) fn begins_type(&self, ahead: usize) -> bool {
        let token = self.peek_at(ahead);
        if token.kind != TokenKind::Word {
            return false;
        }
        let is_typedef = || {
            let id = self.lookup(token.text);
            id.is_some_and(|id| self.unit.symbols[id].kind == SymbolKind::Typedef)
        };
        matches!(
            token.text,
            "void"
                | "char"
                | "short"
                | "int"
                | "long"
                | "signed"
                | "unsigned"
                | "_Bool"
                | "struct"
                | "enum"
                | "const"
                | "volatile"
                | "restrict"
                | "__flash"
                | "__code"
                | "float"
                | "double"
                | "union"
        ) || token.text == "bool" && self.has_bool()
            || is_typedef()
    }

    /// True if the current token begins a declaration.
    pub(super) fn begins_declaration(&self) -> bool {
        let word = self.peek();
        self.begins_type(0)
            || word.kind == TokenKind::Word
                && matches!(
                    word.text,
                    "typedef" | "extern" | "static" | "inline" | "auto" | "register"
                )
    }

    fn has_bool(&self) -> bool {
        self.is_cpp || self.has_header(Header::StdBool)
    }

    fn qualifier(&mut self, into: &mut Qualifiers) -> bool {
        let token = self.peek();
        if token.kind != TokenKind::Word {
            return false;
        }
        match token.text {
            "const" => into.is_const = true,
            "volatile" => into.is_volatile = true,
            "restrict" => into.is_restrict = true,
            "__flash" => into.space = Space::Flash,
            "__code" => into.space = Space::Code,
            _ => return false,
        }
        self.next();
        true
    }

    pub(super) fn specifiers(&mut self) -> Read<Specifiers> {
        let span = self.span();
        let mut found = Specifiers {
            storage: None,
            is_inline: false,
            base: Type::INT.into(),
            defines: None,
            mentions: false,
            span,
        };
        let (mut words, mut qualifiers) = (Words::default(), Qualifiers::default());
        while self.peek().kind == TokenKind::Word {
            if self.qualifier(&mut qualifiers) || self.type_word(&mut words)? {
                continue;
            }
            let token = self.peek();
            match token.text {
                "typedef" | "extern" | "static" if found.storage.is_none() => {
                    self.next();
                    found.storage = Some(match token.text {
                        "typedef" => Storage::Typedef,
                        "extern" => Storage::Extern,
                        _ => Storage::Static,
                    });
                }
                "inline" => {
                    self.next();
                    found.is_inline = true;
                }
                "struct" if words.is_empty() => self.structure(&mut words, &mut found)?,
                "enum" if words.is_empty() => self.enumeration(&mut words, &mut found)?,
                "float" | "double" | "union" | "auto" | "register" | "goto" => {
                    let message = format!("`{}` is not supported", token.text);
                    return self.fail(codes::SYNTAX, message, token.span, "here");
                }
                _ => break,
            }
        }
        if words.is_empty() {
            return self.no_type();
        }
        let ty = match words.ty() {
            Some(ty) => ty,
            None => {
                let span = self.since(span).0;
                return self.fail(codes::SYNTAX, "these words do not name a type", span, "here");
            }
        };
        found.base = Qualified { qualifiers, ty };
        Ok(found)
    }

    fn no_type<T>(&mut self) -> Read<T> {
        let token = self.peek();
        let is_name = token.kind == TokenKind::Word && self.lookup(token.text).is_none();
        if is_name { self.unknown_name(token.text, token.span) } else { self.unexpected("a type") }
    }

    /// Reads a word of a type, if there is one.
    fn type_word(&mut self, words: &mut Words) -> Read<bool> {
        let token = self.peek();
        let simple = match token.text {
            "void" => Some(Type::Void),
            "char" => Some(Type::Int(IntKind::Char)),
            "_Bool" => Some(Type::Int(IntKind::Bool)),
            "bool" if self.has_bool() => Some(Type::Int(IntKind::Bool)),
            _ => None,
        };
        if let Some(ty) = simple {
            if words.base.replace(ty).is_some() {
                return self.unexpected("one type");
            }
            self.next();
            return Ok(true);
        }
        let count = match token.text {
            "int" => &mut words.int,
            "long" => &mut words.long,
            "short" => &mut words.short,
            "signed" => &mut words.signed,
            "unsigned" => &mut words.unsigned,
            _ => {
                let id = self.lookup(token.text).filter(|_| words.is_empty());
                let id = id.filter(|id| self.unit.symbols[*id].kind == SymbolKind::Typedef);
                if let Some(id) = id {
                    self.next();
                    words.base = Some(Type::Named(id));
                }
                return Ok(id.is_some());
            }
        };
        if *count >= 3 {
            return self.fail(
                codes::SYNTAX,
                "this type specifier is repeated too often",
                token.span,
                "here",
            );
        }
        *count += 1;
        self.next();
        Ok(true)
    }

    /// Reads `struct TAG`, with or without members (C99 6.7.2.1).
    fn structure(&mut self, words: &mut Words, found: &mut Specifiers) -> Read<()> {
        let start = self.next().span;
        let tag = self.tag();
        let has_body = self.peek().is("{");
        let known = match tag {
            Some((tag, span)) => match self.tags.get(tag) {
                Some(Tag::Struct(id)) => Some(*id),
                Some(Tag::Enum(_)) => {
                    let message = format!("`{tag}` is an enumeration");
                    return self.fail(codes::TYPE, message, span, "here");
                }
                None => None,
            },
            None if has_body => None,
            None => return self.unexpected("a tag or members"),
        };
        if has_body {
            self.check_tag_scope(start)?;
        }
        let id = match known {
            Some(id) => id,
            None => {
                let is_nested = self.scopes.len() > 1 || self.depth > 0;
                if let Some((tag, span)) = tag
                    && is_nested
                {
                    let message = format!("the structure `{tag}` is not declared");
                    return self.fail(codes::TYPE, message, span, "here");
                }
                let tag = tag.map(|(tag, _)| tag.to_owned());
                let new = Struct {
                    tag,
                    members: Vec::new(),
                    layout: None,
                    has_const: false,
                    is_const: false,
                    n_scalars: 0,
                    nesting: 0,
                    span: Loc(start),
                };
                self.unit.structs.push(new)
            }
        };
        if let Some((tag, _)) = tag {
            self.tags.insert(tag, Tag::Struct(id));
        }
        if has_body {
            if self.unit.structs[id].layout.is_some() {
                return self.fail(codes::TYPE, "this structure is already defined", start, "here");
            }
            let members = self.deeper(Self::members)?;
            let layout = self.unit.layout_of(&members);
            if layout.is_none() {
                return self.fail(codes::TYPE, "the structure is too large", start, "here");
            }
            let types = || members.iter().map(|member| &member.canonical);
            let nesting = 1 + types().map(|it| self.unit.struct_nesting(&it.ty)).max().unwrap_or(0);
            if nesting > MAX_DEPTH {
                let message = format!("structures are nested more than {MAX_DEPTH} levels deep");
                return self.fail(codes::LIMIT, message, start, "here");
            }
            let scalars = types().map(|it| self.unit.n_scalars(&it.ty).unwrap_or(0));
            let n_scalars = scalars.fold(0, u64::saturating_add);
            let has_const = types().any(|it| self.unit.has_const(it));
            let is_const = types().all(|it| self.unit.is_const(it));
            let tag = self.unit.structs[id].tag.take();
            let span = self.unit.structs[id].span;
            self.unit.structs[id] =
                Struct { tag, members, layout, has_const, is_const, n_scalars, nesting, span };
            found.defines = Some(Tag::Struct(id));
        }
        found.mentions = true;
        words.base = Some(Type::Struct(id));
        Ok(())
    }

    fn tag(&mut self) -> Option<(&'a str, Span)> {
        let token = self.peek();
        if token.kind != TokenKind::Word {
            return None;
        }
        self.next();
        Some((token.text, token.span))
    }

    /// Checks that a structure or enumeration is defined at file scope, not within a function, a parameter or another structure.
    fn check_tag_scope(&mut self, span: Span) -> Read<()> {
        if self.scopes.len() > 1 || self.depth > 0 {
            let message = "structures and enumerations can only be defined at file level";
            return self.fail(codes::SYNTAX, message, span, "here");
        }
        Ok(())
    }

    fn members(&mut self) -> Read<Vec<Member>> {
        self.expect("{")?;
        let (mut members, mut names) = (Vec::new(), BTreeSet::new());
        while !self.take("}") {
            let specifiers = self.specifiers()?;
            if specifiers.storage.is_some() || specifiers.is_inline {
                let span = specifiers.span;
                return self.fail(
                    codes::SYNTAX,
                    "a member cannot have a storage class or be `inline`",
                    span,
                    "here",
                );
            }
            loop {
                let declared = self.declare(&specifiers.base)?;
                let Some((name, span)) = declared.name else { return self.unexpected("a name") };
                let canonical = self.unit.canonical(&declared.ty);
                if self.unit.layout(&canonical.ty).is_none() {
                    return self.fail(codes::TYPE, "the member has no known size", span, "here");
                }
                if !names.insert(name.clone()) {
                    let message = format!("two members are called `{name}`");
                    return self.fail(codes::TYPE, message, span, "the second one");
                }
                let is_bit = self.bit(&canonical.ty)?;
                let ty = declared.ty;
                members.push(Member { name, ty, canonical, is_bit, note: Note::new() });
                if !self.take(",") {
                    break;
                }
            }
            self.expect(";")?;
        }
        if members.is_empty() { self.unexpected("at least one member") } else { Ok(members) }
    }

    /// Reads `: 1` after a Boolean member.
    fn bit(&mut self, ty: &Type) -> Read<bool> {
        let span = self.span();
        if !self.take(":") {
            return Ok(false);
        }
        let (_, width) = self.deeper(Self::constant)?;
        if width != 1 || *ty != Type::Int(IntKind::Bool) {
            let message = "bit-fields other than `bool` with one bit are not supported";
            return self.fail(codes::SYNTAX, message, span, "here");
        }
        Ok(true)
    }

    /// Reads `enum TAG`, with or without enumerators (C99 6.7.2.2).
    fn enumeration(&mut self, words: &mut Words, found: &mut Specifiers) -> Read<()> {
        let start = self.next().span;
        let tag = self.tag();
        if !self.peek().is("{") {
            let known = tag.and_then(|(tag, _)| self.tags.get(tag));
            let Some(Tag::Enum(id)) = known else {
                return self.fail(codes::TYPE, "this enumeration is not defined", start, "here");
            };
            words.base = Some(Type::Enum(*id));
            return Ok(());
        }
        self.check_tag_scope(start)?;
        if let Some((tag, span)) = tag
            && self.tags.contains_key(tag)
        {
            let message = format!("`{tag}` is already declared");
            return self.fail(codes::TYPE, message, span, "again here");
        }
        self.expect("{")?;
        let (mut constants, mut next) = (Vec::new(), 0);
        let mut bounds = (0_i128, 0_i128);
        while !self.take("}") {
            let name = self.next();
            if name.kind != TokenKind::Word {
                self.at -= 1;
                return self.unexpected("the name of an enumerator");
            }
            let value = if self.take("=") { self.deeper(Self::constant)?.1 } else { next };
            let (lo, hi) = self.unit.machine.range(IntKind::Int);
            if !(lo..=hi).contains(&value) {
                let message = format!("{value} is not a value of `int`");
                return self.fail(codes::TYPE, message, name.span, "this enumerator");
            }
            bounds = (bounds.0.min(value), bounds.1.max(value));
            let kind = SymbolKind::Constant(value);
            constants.push(self.declare_symbol(name.text, name.span, kind, Type::INT.into())?);
            next = value + 1;
            if !self.take(",") {
                self.expect("}")?;
                break;
            }
        }
        if constants.is_empty() {
            return self.fail(codes::SYNTAX, "an enumeration without enumerators", start, "here");
        }
        let kind = self.enum_kind(bounds);
        let text = tag.map(|(tag, _)| tag.to_owned());
        let id = self.unit.enums.push(Enum { tag: text, constants, kind, notes: Vec::new() });
        if let Some((tag, _)) = tag {
            self.tags.insert(tag, Tag::Enum(id));
        }
        found.defines = Some(Tag::Enum(id));
        words.base = Some(Type::Enum(id));
        Ok(())
    }

    fn enum_kind(&self, (lo, hi): (i128, i128)) -> IntKind {
        let machine = &self.unit.machine;
        let all: &[IntKind] = if machine.has_short_enums {
            &[IntKind::UChar, IntKind::SChar, IntKind::UShort, IntKind::Short]
        } else {
            &[IntKind::UInt]
        };
        let fits = |kind: &&IntKind| {
            let range = machine.range(**kind);
            range.0 <= lo && hi <= range.1
        };
        all.iter().find(fits).copied().unwrap_or(IntKind::Int)
    }

    /// Adds a symbol to the innermost scope.
    pub(super) fn declare_symbol(
        &mut self,
        name: &str,
        span: Span,
        kind: SymbolKind,
        ty: Qualified,
    ) -> Read<crate::tree::SymbolId> {
        if self.scopes.last().is_some_and(|scope| scope.names.contains_key(name)) {
            let message = format!("`{name}` is already declared");
            return self.fail(codes::TYPE, message, span, "again here");
        }
        if is_keyword(name) {
            return self.fail(codes::SYNTAX, format!("`{name}` is a keyword"), span, "here");
        }
        let canonical = self.unit.canonical(&ty);
        if canonical.ty.depth() > MAX_TYPE_DEPTH {
            let message = format!("the type is nested more than {MAX_TYPE_DEPTH} levels deep");
            return self.fail(codes::LIMIT, message, span, "here");
        }
        let symbol = Symbol { name: name.to_owned(), kind, ty, canonical, span: Loc(span) };
        let id = self.unit.symbols.push(symbol);
        if let Some(scope) = self.scopes.last_mut() {
            scope.names.insert(name.to_owned(), id);
        }
        Ok(id)
    }

    /// A type without a name (C99 6.7.6).
    pub(super) fn type_name(&mut self) -> Read<Qualified> {
        let specifiers = self.deeper(Self::specifiers)?;
        if specifiers.storage.is_some() || specifiers.is_inline {
            return self.fail(codes::SYNTAX, "expected only a type", specifiers.span, "here");
        }
        let declared = self.declare(&specifiers.base)?;
        match declared.name {
            Some((_, span)) => {
                self.fail(codes::SYNTAX, "expected a type without a name", span, "here")
            }
            None => Ok(declared.ty),
        }
    }

    /// A declarator, applied to the type in front of it.
    pub(super) fn declare(&mut self, base: &Qualified) -> Read<Declared> {
        let start = self.span();
        let mut declarator = self.deeper(Self::declarator)?;
        if declarator.steps.len() > MAX_TYPE_DEPTH {
            let message = format!("the type is nested more than {MAX_TYPE_DEPTH} levels deep");
            return self.fail(codes::LIMIT, message, start, "here");
        }
        let (mut ty, mut params) = (base.clone(), None);
        while let Some(step) = declarator.steps.pop() {
            ty = match step {
                Derivation::Pointer(qualifiers) => Qualified { qualifiers, ty: Type::pointer(ty) },
                Derivation::Array(len, span) => {
                    let canonical = self.unit.canonical(&ty).ty;
                    if self.unit.layout(&canonical).is_none() {
                        let message = "the elements have no known size";
                        return self.fail(codes::TYPE, message, span, "of this array");
                    }
                    Type::Array(Arc::new(ty), len).into()
                }
                Derivation::Function(list) => {
                    let result = self.unit.canonical(&ty).ty;
                    if matches!(result, Type::Array(..) | Type::Function(_)) {
                        let message = "a function cannot return an array or a function";
                        return self.fail(codes::TYPE, message, start, "here");
                    }
                    let types = list.iter().map(|param| param.ty.clone()).collect();
                    if declarator.steps.is_empty() {
                        params = Some(list);
                    }
                    Type::Function(Arc::new(FunctionType { result: ty, params: types })).into()
                }
            };
            if self.unit.canonical(&ty).ty.depth() > MAX_TYPE_DEPTH {
                let message = format!("the type is nested more than {MAX_TYPE_DEPTH} levels deep");
                return self.fail(codes::LIMIT, message, start, "here");
            }
        }
        let Declarator { name, is_on_stack, .. } = declarator;
        Ok(Declared { name, ty, params, is_on_stack })
    }

    fn declarator(&mut self) -> Read<Declarator> {
        let mut pointers = Vec::new();
        while self.take("*") {
            let mut qualifiers = Qualifiers::default();
            while self.qualifier(&mut qualifiers) {}
            pointers.push(Derivation::Pointer(qualifiers));
        }
        let mut found = self.direct()?;
        found.steps.extend(pointers.into_iter().rev());
        Ok(found)
    }

    fn direct(&mut self) -> Read<Declarator> {
        let token = self.peek();
        let mut found = if token.kind == TokenKind::Word && !is_keyword(token.text) {
            self.next();
            Declarator { name: Some((token.text.to_owned(), token.span)), ..Declarator::default() }
        } else if token.is("(") && !self.peek_at(1).is(")") && !self.begins_type(1) {
            self.next();
            let inner = self.deeper(Self::declarator)?;
            self.expect(")")?;
            inner
        } else {
            Declarator::default()
        };
        loop {
            let span = self.span();
            if self.take("[") {
                let len = if self.peek().is("]") { None } else { Some(self.length()?) };
                self.expect("]")?;
                found.steps.push(Derivation::Array(len, span));
            } else if self.take("(") {
                let params = self.deeper(Self::parameters)?;
                found.steps.push(Derivation::Function(params));
                found.is_on_stack |= self.take_word("__reentrant");
            } else {
                return Ok(found);
            }
            if found.steps.len() > MAX_TYPE_DEPTH {
                let message = format!("the type is nested more than {MAX_TYPE_DEPTH} levels deep");
                return self.fail(codes::LIMIT, message, span, "here");
            }
        }
    }

    /// The length of an array: a constant greater than 0 (C99 6.7.5.2p1).
    fn length(&mut self) -> Read<u64> {
        let start = self.span();
        let (_, value) = self.deeper(Self::constant)?;
        match u64::try_from(value).ok().filter(|value| *value > 0 && *value < 1 << 40) {
            Some(value) => Ok(value),
            None => self.fail(
                codes::TYPE,
                format!("{value} is not a valid array length"),
                start,
                "here",
            ),
        }
    }

    /// Parameters up to the closing parenthesis; the type of each is adjusted (C99 6.7.5.3p7, p8).
    fn parameters(&mut self) -> Read<Vec<Declared>> {
        let span = self.span();
        if self.peek().is(")") {
            if !self.is_cpp {
                let message = "expected `(void)` for a function without parameters";
                return self.fail(codes::SYNTAX, message, span, "here");
            }
            self.next();
            return Ok(Vec::new());
        }
        if self.peek().is_word("void") && self.peek_at(1).is(")") {
            self.next();
            self.next();
            return Ok(Vec::new());
        }
        let mut params = Vec::new();
        loop {
            let specifiers = self.specifiers()?;
            if specifiers.storage.is_some() || specifiers.is_inline {
                let span = specifiers.span;
                return self.fail(
                    codes::SYNTAX,
                    "a parameter cannot have a storage class or be `inline`",
                    span,
                    "here",
                );
            }
            let mut declared = self.declare(&specifiers.base)?;
            if let Type::Array(element, _) = &declared.ty.ty {
                declared.ty = Type::Pointer(Arc::clone(element)).into();
            } else if declared.ty.ty.as_function().is_some() {
                declared.ty = Type::pointer(declared.ty).into();
            }
            let canonical = self.unit.canonical(&declared.ty).ty;
            if matches!(canonical, Type::Void | Type::Array(..) | Type::Function(_)) {
                let span = specifiers.span;
                return self.fail(codes::TYPE, "a parameter cannot have this type", span, "here");
            }
            params.push(declared);
            if !self.take(",") {
                self.expect(")")?;
                return Ok(params);
            }
        }
    }
}

/// True for the keywords of C99 (6.4.1).
pub(super) fn is_keyword(word: &str) -> bool {
    const KEYWORDS: [&str; 37] = [
        "auto",
        "break",
        "case",
        "char",
        "const",
        "continue",
        "default",
        "do",
        "double",
        "else",
        "enum",
        "extern",
        "float",
        "for",
        "goto",
        "if",
        "inline",
        "int",
        "long",
        "register",
        "restrict",
        "return",
        "short",
        "signed",
        "sizeof",
        "static",
        "struct",
        "switch",
        "typedef",
        "union",
        "unsigned",
        "void",
        "volatile",
        "while",
        "_Bool",
        "_Complex",
        "_Imaginary",
    ];
    KEYWORDS.contains(&word)
}
