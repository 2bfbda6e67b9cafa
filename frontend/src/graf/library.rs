//! Parser of library charts, their instances and certificates, and imports.

use grafsynth_ir::chart::{
    Argument, ArgumentValue, Certificate, Declaration, DeclarationKind, Expr, Import, Library,
    Parameter, Use,
};
use grafsynth_ir::diag::{Diagnostic, ErrorReported};
use grafsynth_ir::net::Meta;

use super::parser::{Parse, Parser, Separators};
use super::token::Kind;
use crate::codes;

/// The keywords of parameters.
const PARAMETERS: &[&str] = &["input", "output", "var", "event", "const"];

impl Parser<'_> {
    /// Parses `use "conveyors.graf"`, at `use`.
    pub(crate) fn import(&mut self) -> Parse<Import> {
        let start = self.advance().start;
        let file = self.text("the name of a file in quotes")?;
        Ok(Import { file, span: self.span_from(start) })
    }

    /// Parses `library chart conveyor(input start, output run) { … }`, at `library`.
    pub(crate) fn library(&mut self) -> Parse<Library> {
        let start = self.advance().start;
        self.advance();
        let name = self.name("the name of the library chart")?;
        let mut parameters = Vec::new();
        if self.kind(0) == Kind::Open && !self.peek(0).new_line {
            self.parameters_of_library(&mut parameters)?;
        }
        let mut meta = Meta::default();
        self.attributes(&mut meta)?;
        let mut items = Vec::new();
        self.braced("the library chart", Separators::None, &mut |parser| parser.item(&mut items))?;
        let span = self.span_from(start);
        meta.span = span;
        Ok(Library { name, parameters, items, certificate: None, span, meta })
    }

    /// Parses `(input start, n: int 0..9 = 3, output run, const limit = 5)`. A keyword also applies to the parameters after it, up to the
    /// next keyword.
    fn parameters_of_library(&mut self, parameters: &mut Vec<Parameter>) -> Parse<()> {
        self.advance();
        let mut keyword = "";
        while self.kind(0) != Kind::Close {
            let start = self.peek(0).start;
            let word = self.word(0);
            if PARAMETERS.contains(&word) && self.is_name(1) {
                keyword = word;
                self.advance();
            }
            if keyword.is_empty() {
                return Err(self.unexpected("`input`, `output`, `var`, `event` or `const`"));
            }
            let name = self.name("the name of a parameter")?;
            let mut meta = Meta::default();
            self.attributes(&mut meta)?;
            let (kind, default) = self.parameter(keyword)?;
            self.attributes(&mut meta)?;
            meta.span = self.span_from(start);
            let declaration = Declaration { name, kind, meta };
            self.keep(parameters, Parameter { declaration, default });
            if !self.eat(Kind::Comma) {
                break;
            }
        }
        self.expect(Kind::Close, "`,` or `)`")?;
        Ok(())
    }

    fn parameter(&mut self, keyword: &str) -> Parse<(DeclarationKind, Option<Expr>)> {
        let ty = if matches!(keyword, "input" | "output" | "var") {
            self.optional_type()?
        } else {
            grafsynth_ir::expr::Type::Bool
        };
        let takes_default = matches!(keyword, "input" | "const");
        let default = if self.kind(0) == Kind::Equal {
            let span = self.here();
            self.advance();
            let value = self.expr()?;
            if !takes_default {
                self.report(|| {
                    Diagnostic::error(codes::MISPLACED, "only inputs and constants have a default")
                        .at(span, "not allowed here")
                        .help("remove the default; without an argument, each instance gets its own")
                });
            }
            Some(value).filter(|_| takes_default)
        } else {
            None
        };
        let kind = match keyword {
            "input" => DeclarationKind::Input { ty, synchronous: false },
            "output" => DeclarationKind::Output {
                ty,
                init: None,
                registered: false,
                mealy: false,
                safe: None,
            },
            "var" => DeclarationKind::Var { ty, len: None, init: Vec::new() },
            "event" => DeclarationKind::Event { internal: false },
            _ => {
                let value = default.clone();
                if value.is_none() && !self.dry {
                    return Err(self.missing(
                        "a constant parameter needs its value",
                        "write `const limit = 5`; an instance may override it",
                    ));
                }
                DeclarationKind::Const { value: value.unwrap_or_else(|| Expr::int(0)) }
            }
        };
        Ok((kind, default))
    }

    /// Parses `certificate conveyor by "0.1.0" sha256 "…" proves a, b`, at `certificate`.
    pub(crate) fn certificate(&mut self) -> Parse<Certificate> {
        let start = self.advance().start;
        let of = self.name("the name of a library chart")?;
        self.expect_word("by")?;
        let version = self.text("the version of the tool in quotes")?;
        self.expect_word("sha256")?;
        let hash = self.text("the hash in quotes")?;
        let mut properties = Vec::new();
        if self.eat_word("proves") {
            loop {
                let property = self.name("the name of a property")?;
                self.keep(&mut properties, property);
                if !self.eat(Kind::Comma) {
                    break;
                }
            }
        }
        Ok(Certificate { of, version, hash, properties, span: self.span_from(start) })
    }

    /// Parses `use conveyor as c1(start = m, done -> x)`, at `use`.
    pub(crate) fn instance(&mut self) -> Parse<Use> {
        let start = self.advance().start;
        if matches!(self.kind(0), Kind::Text | Kind::RawText) {
            return Err(self.misplaced(
                "a file must be imported before the first chart",
                "write `use \"FILE\"` at the top of the file, and `use CHART as NAME` here",
            ));
        }
        let library = self.name("the name of a library chart")?;
        self.expect_word("as")?;
        let name = self.name("the name of the instance")?;
        let mut arguments = Vec::new();
        if self.kind(0) == Kind::Open && !self.peek(0).new_line {
            self.advance();
            while self.kind(0) != Kind::Close {
                let argument = self.argument()?;
                self.keep(&mut arguments, argument);
                if !self.eat(Kind::Comma) {
                    break;
                }
            }
            self.expect(Kind::Close, "`,` or `)`")?;
        }
        let mut meta = Meta::default();
        self.attributes(&mut meta)?;
        meta.span = self.span_from(start);
        Ok(Use { library, name, arguments, meta })
    }

    fn argument(&mut self) -> Parse<Argument> {
        let start = self.peek(0).start;
        let parameter = self.name("the name of a parameter")?;
        let value = match self.kind(0) {
            Kind::Equal => {
                self.advance();
                ArgumentValue::Reads(self.expr()?)
            }
            Kind::Arrow => {
                self.advance();
                ArgumentValue::Drives(self.path("an output, variable or event")?)
            }
            Kind::Assign => {
                let span = self.here();
                self.report(|| {
                    Diagnostic::error(codes::UNEXPECTED, "expected `=` or `->`, found `:=`")
                        .at(span, "an argument is given with `=`")
                        .fix(span, "=")
                });
                return Err(ErrorReported);
            }
            _ => {
                return Err(
                    self.unexpected("`=` and a value, or `->` and the signal that it drives")
                );
            }
        };
        Ok(Argument { parameter, value, span: self.span_from(start) })
    }
}
