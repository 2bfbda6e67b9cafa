//! Declarations: variables, types, initial values.

use grafsynth_ir::diag::Diagnostic;

use super::ast::{Expr, Init, Section, TypeDef, TypeKind, TypeRef, Var};
use super::lexer::Kind;
use super::parse::{Parse, Parser};
use super::symbol::Ident;
use crate::codes;

impl Parser<'_> {
    /// Parses `VAR_INPUT a, b : BOOL; END_VAR`.
    pub(crate) fn var_block(&mut self, vars: &mut Vec<Var>) -> Parse<()> {
        let word = self.word(0);
        let Some(section) = section(&word) else {
            let span = self.here();
            self.advance();
            return Err(self.report(|| {
                Diagnostic::error(codes::ST_UNEXPECTED, format!("unknown variable section `{word}`"))
                    .at(span, "")
                    .help("write VAR, VAR_INPUT, VAR_OUTPUT, VAR_IN_OUT, VAR_GLOBAL, VAR_EXTERNAL or VAR_TEMP")
            }));
        };
        self.advance();
        let mut is_constant = false;
        loop {
            match self.word(0).as_str() {
                "CONSTANT" => is_constant = true,
                "RETAIN" | "PERSISTENT" => {
                    let (span, word) = (self.here(), self.word(0));
                    self.findings.report(|| {
                        Diagnostic::warning(
                            codes::ST_LEFT_OUT,
                            format!(
                                "{word} is ignored: these variables start with their initial values"
                            ),
                        )
                        .at(span, "")
                        .help("remove the word, or keep it for other tools")
                    });
                }
                "NON_RETAIN" | "PUBLIC" | "PRIVATE" | "PROTECTED" | "INTERNAL" => {}
                _ => break,
            }
            self.advance();
        }
        loop {
            if self.take_word("END_VAR") {
                self.take(Kind::Semicolon);
                return Ok(());
            }
            if self.kind(0) == Kind::End || self.at_end_of_list() {
                return Err(self.expected("a variable or `END_VAR`"));
            }
            let before = self.at;
            if self.declaration(section, is_constant, vars).is_err() {
                // The names come first.
                let mut at = before;
                while at < self.at
                    && self.list.tokens.get(at).is_some_and(|token| token.kind != Kind::Colon)
                {
                    self.lose(at);
                    at += 1;
                }
                if self.at == before {
                    self.advance();
                }
                self.skip_declaration();
            }
        }
    }

    /// Skips past the next semicolon, or up to `END_VAR`.
    fn skip_declaration(&mut self) {
        loop {
            match self.kind(0) {
                Kind::End => return,
                Kind::Semicolon => {
                    self.advance();
                    return;
                }
                Kind::Word if self.at_end_of_list() => return,
                _ => {
                    self.advance();
                }
            }
        }
    }

    fn declaration(
        &mut self,
        section: Section,
        is_constant: bool,
        vars: &mut Vec<Var>,
    ) -> Parse<()> {
        let mut names = Vec::new();
        let mut address = None;
        loop {
            if self.kind(0) == Kind::Word {
                names.push(self.name("a variable")?);
            }
            if self.take_word("AT") {
                let token = self.expect(Kind::Address, "an address such as %IX0.0")?;
                address = Some(self.name_of(token));
            } else if names.is_empty() {
                return Err(self.expected("a variable"));
            }
            if !self.take(Kind::Comma) {
                break;
            }
        }
        self.expect(Kind::Colon, "`:` and a type")?;
        let ty = self.type_ref()?;
        // The edge detection of an input needs a variable of its own.
        if matches!(self.word(0).as_str(), "R_EDGE" | "F_EDGE") {
            let span = self.here();
            let what = format!("an input with {}", self.word(0));
            self.refuse(what, span, "use an instance of R_TRIG or F_TRIG in the body");
            self.advance();
        }
        let init = if self.take(Kind::Assign) { Some(self.init()?) } else { None };
        let goes_on = self.is("END_VAR")
            || self.kind(0) == Kind::Word && matches!(self.kind(1), Kind::Colon | Kind::Comma);
        if !self.take(Kind::Semicolon) {
            // The declaration itself is complete, so the uses of the variable are valid.
            let error = self.expected("`;`");
            if !goes_on {
                return Err(error);
            }
        }
        let label = self.label();
        // `VAR AT %IX0.0 : BOOL` has no name.
        if names.is_empty()
            && let Some(address) = &address
        {
            names.push(address.clone());
        }
        for name in names {
            vars.push(Var {
                name,
                section,
                is_constant,
                ty: ty.clone(),
                init: init.clone(),
                address: address.clone(),
                label: label.clone(),
            });
        }
        Ok(())
    }

    pub(crate) fn type_ref(&mut self) -> Parse<TypeRef> {
        self.deeper(Self::type_inside)
    }

    fn type_inside(&mut self) -> Parse<TypeRef> {
        let start = self.peek(0).start;
        let word = self.word(0);
        let kind = match word.as_str() {
            "ARRAY" => self.array()?,
            "STRUCT" => {
                self.advance();
                let mut fields = Vec::new();
                while !self.take_word("END_STRUCT") {
                    if self.kind(0) == Kind::End {
                        return Err(self.expected("`END_STRUCT`"));
                    }
                    self.declaration(Section::Local, false, &mut fields)?;
                }
                TypeKind::Struct(fields)
            }
            "STRING" | "WSTRING" => {
                self.advance();
                let (open, close) = match self.kind(0) {
                    Kind::Open => (Kind::Open, Kind::Close),
                    _ => (Kind::OpenBracket, Kind::CloseBracket),
                };
                if self.take(open) {
                    self.expression()?;
                    self.expect(close, "the closing bracket")?;
                }
                TypeKind::Refused(word.to_string())
            }
            "POINTER" | "REFERENCE" | "REF_TO" => {
                self.advance();
                self.take_word("TO");
                self.type_ref()?;
                TypeKind::Refused(format!("{word} types"))
            }
            _ if self.kind(0) == Kind::Open => self.enumeration()?,
            _ => {
                let mut name = self.name("a type")?;
                // `lib.TON`: a type of a library is known by its last name.
                while self.take(Kind::Dot) {
                    name = self.name("a type")?;
                }
                if self.take(Kind::Open) {
                    let range = self.range()?;
                    self.expect(Kind::Close, "`)`")?;
                    TypeKind::Subrange(name, Box::new(range))
                } else {
                    TypeKind::Named(name)
                }
            }
        };
        Ok(TypeRef { kind, span: self.span_from(start) })
    }

    /// `0..9`
    fn range(&mut self) -> Parse<(Expr, Expr)> {
        let low = self.expression()?;
        self.expect(Kind::Range, "`..`")?;
        Ok((low, self.expression()?))
    }

    fn array(&mut self) -> Parse<TypeKind> {
        self.advance();
        self.expect(Kind::OpenBracket, "`[`")?;
        let mut ranges = vec![self.range()?];
        while self.take(Kind::Comma) {
            ranges.push(self.range()?);
        }
        self.expect(Kind::CloseBracket, "`]`")?;
        self.expect_word("OF")?;
        Ok(TypeKind::Array(ranges, Box::new(self.type_ref()?)))
    }

    fn enumeration(&mut self) -> Parse<TypeKind> {
        self.advance();
        let mut values = Vec::new();
        loop {
            let name = self.name("a value of the enumeration")?;
            let value = if self.take(Kind::Assign) { Some(self.expression()?) } else { None };
            values.push((name, value));
            if !self.take(Kind::Comma) {
                break;
            }
        }
        self.expect(Kind::Close, "`)`")?;
        Ok(TypeKind::Enum(values))
    }

    pub(crate) fn init(&mut self) -> Parse<Init> {
        self.deeper(Self::init_inside)
    }

    fn init_inside(&mut self) -> Parse<Init> {
        let start = self.peek(0).start;
        if self.take(Kind::OpenBracket) {
            let mut values = Vec::new();
            while self.kind(0) != Kind::CloseBracket {
                let repeated = self.kind(0) == Kind::Number && self.kind(1) == Kind::Open;
                if repeated {
                    let count = self.expression_before_parenthesis()?;
                    self.expect(Kind::Open, "`(`")?;
                    let value = self.init()?;
                    self.expect(Kind::Close, "`)`")?;
                    values.push((Some(count), value));
                } else {
                    let value = self.init()?;
                    values.push((None, value));
                }
                if !self.take(Kind::Comma) {
                    break;
                }
            }
            self.expect(Kind::CloseBracket, "`]`")?;
            return Ok(Init::List(values, self.span_from(start)));
        }
        if self.kind(0) == Kind::Open && self.kind(1) == Kind::Word && self.kind(2) == Kind::Assign
        {
            self.advance();
            let mut fields: Vec<(Ident, Init)> = Vec::new();
            loop {
                let name = self.name("a field")?;
                self.expect(Kind::Assign, "`:=`")?;
                fields.push((name, self.init()?));
                if !self.take(Kind::Comma) {
                    break;
                }
            }
            self.expect(Kind::Close, "`)`")?;
            return Ok(Init::Fields(fields, self.span_from(start)));
        }
        Ok(Init::Value(self.expression()?))
    }

    /// Parses `TYPE color : (red, green); END_TYPE`.
    pub(crate) fn types(&mut self, types: &mut Vec<TypeDef>) -> Parse<()> {
        self.advance();
        while !self.take_word("END_TYPE") {
            let name = self.name("the name of a type or `END_TYPE`")?;
            self.expect(Kind::Colon, "`:`")?;
            let ty = self.type_ref()?;
            let init = if self.take(Kind::Assign) { Some(self.init()?) } else { None };
            if !matches!(ty.kind, TypeKind::Struct(_)) || self.kind(0) == Kind::Semicolon {
                self.expect(Kind::Semicolon, "`;`")?;
            }
            types.push(TypeDef { name, ty, init });
        }
        Ok(())
    }
}

/// The variable section that a word begins.
fn section(word: &str) -> Option<Section> {
    Some(match word {
        "VAR" => Section::Local,
        "VAR_INPUT" => Section::Input,
        "VAR_OUTPUT" => Section::Output,
        "VAR_IN_OUT" => Section::InOut,
        "VAR_GLOBAL" => Section::Global,
        "VAR_EXTERNAL" => Section::External,
        "VAR_TEMP" => Section::Temp,
        _ => return None,
    })
}
