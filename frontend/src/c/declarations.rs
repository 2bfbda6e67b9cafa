//! Declarations: specifiers, declarators, initial values, and the constants of `enum`.

use super::ast::{Base, Declaration, Declarator, Init, Param, Specifiers, TypeName};
use super::constant;
use super::lexer::Kind;
use super::parser::{Parser, Read};
use crate::codes;
use grafsynth_ir::Span;
use grafsynth_ir::diag::{Diagnostic, ErrorReported};

/// The type that a standard header defines with this name. Types that are not integers are opaque.
fn known_type(name: &str) -> Option<Base> {
    let fixed = |bits, is_signed| Some(Base::Fixed { bits, is_signed });
    match name {
        "bool" => Some(Base::Bool),
        "int8_t" | "int_least8_t" => fixed(8, true),
        "uint8_t" | "uint_least8_t" => fixed(8, false),
        "int16_t" | "int_least16_t" => fixed(16, true),
        "uint16_t" | "uint_least16_t" => fixed(16, false),
        "int32_t" | "int_least32_t" => fixed(32, true),
        "uint32_t" | "uint_least32_t" => fixed(32, false),
        "int64_t" | "uint64_t" | "size_t" | "ptrdiff_t" | "intptr_t" | "uintptr_t" | "intmax_t"
        | "uintmax_t" => Some(Base::LongLong),
        "FILE" | "time_t" | "clock_t" | "va_list" | "wchar_t" => Some(Base::Opaque),
        _ => None,
    }
}

/// The type of these words (C99 6.7.2).
fn base_of(word: Option<Base>, sign: Option<bool>, n_long: u8) -> Base {
    let is_signed = sign.unwrap_or(true);
    match (word, n_long) {
        (Some(Base::Opaque), _) => Base::Opaque,
        (Some(Base::Char(_)), _) => Base::Char(sign),
        (Some(Base::Short { .. }), _) => Base::Short { is_signed },
        (Some(Base::Int { .. }) | None, 0) => Base::Int { is_signed },
        (Some(Base::Int { .. }) | None, 1) => Base::Long { is_signed },
        (Some(Base::Int { .. }) | None, _) => Base::LongLong,
        (Some(base), _) => base,
    }
}

impl Parser<'_> {
    /// Whether a declaration begins here.
    pub(super) fn begins_declaration(&self) -> bool {
        let token = self.here();
        if token.kind != Kind::Word {
            return false;
        }
        let word = self.word_of(token);
        if self.is_type_word(word) {
            return true;
        }
        if !self.is_name(token) {
            return false;
        }
        // A name before another name is an unknown type.
        self.is_name(self.ahead(1))
    }

    pub(super) fn is_type_word(&self, word: &str) -> bool {
        matches!(
            word,
            "void"
                | "char"
                | "short"
                | "int"
                | "long"
                | "signed"
                | "unsigned"
                | "float"
                | "double"
                | "_Bool"
                | "_Complex"
                | "struct"
                | "union"
                | "enum"
                | "const"
                | "volatile"
                | "register"
                | "static"
                | "extern"
                | "auto"
                | "typedef"
                | "inline"
                | "restrict"
        ) || self.typedefs.contains_key(word)
            || (known_type(word).is_some() && !self.constants.contains_key(word))
    }

    /// Parses the specifiers before declarators. With `implicit`, there may be none (`int` is implied, as in K&R definitions).
    pub(super) fn specifiers(&mut self, implicit: bool) -> Read<Specifiers> {
        let start = self.here().span;
        let mut found = Specifiers {
            base: Base::Int { is_signed: true },
            is_static: false,
            is_extern: false,
            is_typedef: false,
            is_const: false,
            is_volatile: false,
            span: Span::new(self.file, start.start as usize, start.start as usize),
        };
        let (mut sign, mut n_long, mut word_base): (Option<bool>, u8, Option<Base>) =
            (None, 0, None);
        let mut type_span: Option<Span> = None;
        let mut is_any = false;
        loop {
            let token = self.here();
            if token.kind != Kind::Word {
                break;
            }
            let word = self.word_of(token);
            let mut is_of_type = true;
            match word {
                "const" => found.is_const = true,
                "volatile" => found.is_volatile = true,
                "static" => (found.is_static, is_of_type) = (true, false),
                "extern" => (found.is_extern, is_of_type) = (true, false),
                "typedef" => (found.is_typedef, is_of_type) = (true, false),
                "register" | "auto" | "inline" | "restrict" => is_of_type = false,
                "signed" => sign = Some(true),
                "unsigned" => sign = Some(false),
                "long" => n_long = n_long.saturating_add(1),
                "void" => word_base = Some(Base::Void),
                "_Bool" => word_base = Some(Base::Bool),
                "char" => word_base = Some(Base::Char(None)),
                "short" => word_base = Some(Base::Short { is_signed: true }),
                "int" => word_base = word_base.or(Some(Base::Int { is_signed: true })),
                "float" | "double" | "_Complex" | "_Imaginary" => word_base = Some(Base::Opaque),
                "struct" | "union" | "enum" => {
                    self.take();
                    let base = self.tagged(word == "enum")?;
                    word_base = Some(base);
                    type_span = Some(self.since(type_span.unwrap_or(token.span)));
                    is_any = true;
                    continue;
                }
                _ if word_base.is_none()
                    && sign.is_none()
                    && n_long == 0
                    && self.is_name(token) =>
                {
                    let known = self.typedefs.get(word).cloned().or_else(|| known_type(word));
                    let next = self.ahead(1);
                    match known {
                        Some(base) => word_base = Some(base),
                        None if self.is_name(next)
                            || (!implicit && !is_any && self.word_of(next) == "*") =>
                        {
                            word_base = Some(Base::Opaque)
                        }
                        None => break,
                    }
                }
                _ => break,
            }
            self.take();
            is_any = true;
            if is_of_type {
                type_span = Some(type_span.map_or(token.span, |span| span.to(token.span)));
            }
        }
        if !is_any && !implicit {
            return self.unexpected("a type");
        }
        found.span = type_span.unwrap_or(found.span);
        found.base = base_of(word_base, sign, n_long);
        Ok(found)
    }

    /// Parses the tag and the body after `struct`, `union` or `enum`. The constants of an `enum` are known from here on.
    fn tagged(&mut self, is_enum: bool) -> Read<Base> {
        if self.is_name(self.here()) {
            self.take();
        } else if !self.is("{") {
            return self.unexpected("a tag or `{`");
        }
        if !self.is("{") {
            return Ok(if is_enum { Base::Enum } else { Base::Opaque });
        }
        if !is_enum {
            let open = self.take().span;
            let mut depth = 1_usize;
            while depth > 0 {
                let token = self.take();
                match self.word_of(token) {
                    "{" => depth += 1,
                    "}" => depth -= 1,
                    _ if token.kind == Kind::End => {
                        self.findings.report(|| {
                            Diagnostic::error(codes::C_SYNTAX, "this `{` is not closed")
                                .at(open, "opened here")
                                .help("write `};` at its end")
                        });
                        return Err(ErrorReported);
                    }
                    _ => {}
                }
            }
            return Ok(Base::Opaque);
        }
        self.expect("{")?;
        let mut next: i64 = 0;
        while !self.is("}") {
            let name = self.name("the name of a constant")?;
            if self.accept("=") {
                let expr = self.deeper(Self::assignment)?;
                match constant::value(&expr, &self.constants) {
                    Ok(value) => next = value,
                    Err(span) => self.not_constant(span, "the value of an enumeration constant"),
                }
            }
            self.constants.insert(name.text.clone(), next);
            self.source.constants.push((name, next));
            next = next.saturating_add(1);
            if !self.accept(",") {
                break;
            }
        }
        self.expect("}")?;
        Ok(Base::Enum)
    }

    pub(super) fn not_constant(&mut self, span: Span, what: &str) {
        self.findings.report(|| {
            Diagnostic::error(codes::C_CONSTANT, format!("{what} is not a constant"))
                .at(span, "not a constant expression")
                .help("use numbers, characters, and names from `#define` and `enum`")
        });
    }

    /// Parses a declarator, with its parameters if it is a function. `named` requires a name.
    pub(super) fn declarator(&mut self, named: bool) -> Read<(Declarator, Vec<Param>)> {
        self.deeper(|p| p.declarator_inner(named))
    }

    fn declarator_inner(&mut self, named: bool) -> Read<(Declarator, Vec<Param>)> {
        let start = self.here().span;
        let mut found = Declarator { span: start, ..Declarator::default() };
        let mut params = Vec::new();
        while self.accept("*") {
            found.n_pointers += 1;
            while self.is("const") || self.is("volatile") || self.is("restrict") {
                self.take();
            }
        }
        if self.is("(")
            && (self.word_of(self.ahead(1)) == "*" || self.word_of(self.ahead(1)) == "(")
        {
            self.take();
            let (inner, _) = self.declarator(named)?;
            self.expect(")")?;
            found.name = inner.name;
            found.is_opaque = true;
        } else if self.is_name(self.here())
            && (named || !self.is_type_word(self.word_of(self.here())))
        {
            found.name = self.name("a name")?;
        } else if named {
            return self.unexpected("a name");
        }
        loop {
            if self.accept("[") {
                found.lengths.push(if self.is("]") {
                    None
                } else {
                    Some(self.deeper(Self::expression)?)
                });
                self.expect("]")?;
            } else if self.is("(") && !found.is_function {
                self.take();
                params = self.parameters()?;
                found.is_function = true;
            } else {
                break;
            }
        }
        found.is_opaque |= found.is_function && !found.lengths.is_empty();
        found.span = self.since(start);
        Ok((found, params))
    }

    /// Parses the parameters of a prototype or the names of a K&R head, after `(`.
    fn parameters(&mut self) -> Read<Vec<Param>> {
        let mut params = Vec::new();
        if self.accept(")") {
            return Ok(params);
        }
        if self.is("void") && self.word_of(self.ahead(1)) == ")" {
            self.take();
            self.take();
            return Ok(params);
        }
        loop {
            if self.accept("...") {
                break;
            }
            let token = self.here();
            let is_old = self.is_name(token)
                && !self.is_type_word(self.word_of(token))
                && matches!(self.word_of(self.ahead(1)), "," | ")");
            if is_old {
                let name = self.name("a parameter")?;
                let specifiers = Specifiers {
                    base: Base::Int { is_signed: true },
                    is_static: false,
                    is_extern: false,
                    is_typedef: false,
                    is_const: false,
                    is_volatile: false,
                    span: Span::new(self.file, name.span.start as usize, name.span.start as usize),
                };
                let declarator =
                    Declarator { name: name.clone(), span: name.span, ..Declarator::default() };
                params.push(Param { name, specifiers, declarator });
            } else {
                let specifiers = self.specifiers(false)?;
                let (declarator, _) = self.declarator(false)?;
                params.push(Param { name: declarator.name.clone(), specifiers, declarator });
            }
            if !self.accept(",") {
                break;
            }
        }
        self.expect(")")?;
        Ok(params)
    }

    pub(super) fn declaration_from(
        &mut self,
        start: Span,
        specifiers: Specifiers,
        first: Option<Declarator>,
    ) -> Read<Declaration> {
        let mut declared = Vec::new();
        let mut next = first;
        if !self.is(";") || next.is_some() {
            loop {
                let declarator = match next.take() {
                    Some(declarator) => declarator,
                    None => self.declarator(true)?.0,
                };
                if specifiers.is_typedef {
                    let is_plain = declarator.n_pointers == 0
                        && declarator.lengths.is_empty()
                        && !declarator.is_function
                        && !declarator.is_opaque;
                    let base = if is_plain { specifiers.base.clone() } else { Base::Opaque };
                    self.typedefs.insert(declarator.name.text.clone(), base);
                }
                let init = if self.accept("=") { Some(self.initial(0)?) } else { None };
                declared.push((declarator, init));
                if !self.accept(",") {
                    break;
                }
            }
        }
        self.expect(";")?;
        Ok(Declaration { specifiers, declared, span: self.since(start) })
    }

    fn initial(&mut self, level: u32) -> Read<Init> {
        if level > 8 || !self.is("{") {
            return Ok(Init::One(self.deeper(Self::assignment)?));
        }
        let open = self.take().span;
        let mut values = Vec::new();
        while !self.is("}") {
            if self.is(".") || self.is("[") {
                return self.unexpected("a value (designators are not supported)");
            }
            values.push(self.initial(level + 1)?);
            if !self.accept(",") {
                break;
            }
        }
        let close = self.expect("}")?;
        Ok(Init::List(values, open.to(close)))
    }

    pub(super) fn type_name(&mut self) -> Read<TypeName> {
        let specifiers = self.specifiers(false)?;
        let (declarator, _) = self.declarator(false)?;
        Ok(TypeName { specifiers, declarator })
    }
}
