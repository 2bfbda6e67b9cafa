//! C text to a typed tree. Written from the grammar of C99, not from the printer.
//!
//! ```text
//! text ──lexer──► tokens ──preprocess, macros──► tokens of a configuration ──declaration, statement, expression──► tree
//! ```
//!
//! A construct outside the supported subset is an error at its location; nothing is skipped. Nesting and expansion are bounded, and the work is proportional to
//! the text.

mod declaration;
mod declarator;
mod expression;
pub(crate) mod headers;
mod initialiser;
mod lexer;
mod literal;
mod macros;
mod preprocess;
mod statement;

use crate::codes;
use crate::config::Config;
use crate::order;
use crate::tree::types::Type;
use crate::tree::typing::TypeError;
use crate::tree::{Header, Loc, SymbolId, Tag, Unit};
use grafsynth_ir::diag::{ErrorReported, nearest};
use grafsynth_ir::{Code, Diagnostic, FileId, Span};
use headers::Source;
use lexer::{Token, TokenKind};
use std::collections::{BTreeMap, BTreeSet};

/// The maximum nesting of brackets, operators, blocks, declarators and structures.
pub const MAX_DEPTH: usize = 256;
/// The maximum height of the tree of one expression.
pub const MAX_HEIGHT: usize = 1000;
/// The number of findings after which the parser stops.
const MAX_FINDINGS: usize = 20;

/// A file that can be read.
#[derive(Debug, Clone, Copy)]
pub struct SourceFile<'a> {
    /// The id of the file in locations.
    pub file: FileId,
    /// The file name, as in `#include "NAME"`.
    pub name: &'a str,
    /// The text of the file.
    pub text: &'a str,
}

/// The files to read, and how to read them.
#[derive(Debug, Clone, Copy)]
pub struct Input<'a> {
    /// The file to read, followed by the files that it may include.
    pub files: &'a [SourceFile<'a>],
    /// Pieces of user code (`code c`): a block that contains exactly one of these texts, on lines of its own, is not read but becomes one
    /// [`StmtKind::Opaque`](crate::tree::StmtKind::Opaque). Indentation does not matter.
    pub verbatim: &'a [&'a str],
    /// Functions that are only declared here but are known to write nothing that the program can see, such as those of an engine. All others may write.
    pub readers: &'a [&'a str],
    /// The compiler that the text is written for.
    pub config: &'a Config,
}

/// Reads a translation unit. Returns a tree if there are no errors; otherwise the findings contain at least one error. At most 20 findings are returned.
#[must_use]
pub fn parse(input: &Input) -> (Option<Unit>, Vec<Diagnostic>) {
    let tokens = match preprocess::preprocess(input) {
        Ok(tokens) => tokens,
        Err(found) => return (None, vec![*found]),
    };
    let is_defined = |name: &str| input.config.macros.iter().any(|(it, _)| it == name);
    let mut parser =
        Parser::new(&tokens, Unit::new(input.config.machine), is_defined("__cplusplus"));
    parser.readers = input.readers;
    if is_defined("__GNUC__") {
        parser.show(Source::Gcc);
    }
    // A failure was reported.
    let _ = parser.unit();
    let Parser { unit, mut found, .. } = parser;
    if found.is_empty() {
        found = order::check(&unit);
    }
    found.truncate(MAX_FINDINGS);
    if found.is_empty() { (Some(unit), found) } else { (None, found) }
}

pub(crate) type Read<T> = Result<T, ErrorReported>;

/// The names that are declared in a block.
#[derive(Debug, Default)]
struct Scope {
    names: BTreeMap<String, SymbolId>,
}

/// The parser: a position in the tokens, and the tree so far.
pub(crate) struct Parser<'a, 't> {
    tokens: &'t [Token<'a>],
    at: usize,
    unit: Unit,
    /// The file's scope, then those of the blocks around the position.
    scopes: Vec<Scope>,
    /// Structures and enumerations are always defined for the whole file.
    tags: BTreeMap<&'a str, Tag>,
    /// The symbols that have a definition: functions with a body, and objects with an initialiser.
    defined: BTreeSet<SymbolId>,
    headers: Vec<Header>,
    /// Functions that are known to write nothing.
    readers: &'t [&'t str],
    is_cpp: bool,
    depth: usize,
    /// The return type of the function that is being read.
    result: Option<Type>,
    n_loops: usize,
    n_switches: usize,
    pub(crate) found: Vec<Diagnostic>,
}

impl<'a, 't> Parser<'a, 't> {
    pub(crate) fn new(tokens: &'t [Token<'a>], unit: Unit, is_cpp: bool) -> Self {
        Parser {
            tokens,
            at: 0,
            unit,
            scopes: vec![Scope::default()],
            tags: BTreeMap::new(),
            defined: BTreeSet::new(),
            headers: Vec::new(),
            readers: &[],
            is_cpp,
            depth: 0,
            result: None,
            n_loops: 0,
            n_switches: 0,
            found: Vec::new(),
        }
    }

    /// Makes the names of a header visible.
    fn show(&mut self, source: Source) {
        if let Source::Header(header) = source {
            self.headers.push(header);
        }
        let sources = headers::sources(&self.unit.machine);
        for (at, from) in sources.into_iter().enumerate() {
            if from == source {
                let id = SymbolId::from_index(at);
                let name = self.unit.symbols[id].name.clone();
                if let Some(scope) = self.scopes.first_mut() {
                    scope.names.insert(name, id);
                }
            }
        }
    }

    fn peek(&self) -> Token<'a> {
        self.peek_at(0)
    }

    /// The token at distance `ahead`, or the last token.
    fn peek_at(&self, ahead: usize) -> Token<'a> {
        let at = (self.at + ahead).min(self.tokens.len().saturating_sub(1));
        self.tokens.get(at).copied().unwrap_or(Token {
            kind: TokenKind::End,
            text: "",
            span: Span::default(),
            hidden: 0,
            starts_line: true,
            has_space: true,
        })
    }

    fn next(&mut self) -> Token<'a> {
        let token = self.peek();
        if token.kind != TokenKind::End {
            self.at += 1;
        }
        token
    }

    fn span(&self) -> Span {
        self.peek().span
    }

    /// The location from `start` to the last token that was read.
    fn since(&self, start: Span) -> Loc {
        let last = self.at.checked_sub(1).and_then(|at| self.tokens.get(at));
        Loc(last.map_or(start, |last| start.to(last.span)))
    }

    fn take(&mut self, sign: &str) -> bool {
        let is_here = self.peek().is(sign);
        if is_here {
            self.at += 1;
        }
        is_here
    }

    fn take_word(&mut self, word: &str) -> bool {
        let is_here = self.peek().is_word(word);
        if is_here {
            self.at += 1;
        }
        is_here
    }

    fn expect(&mut self, sign: &str) -> Read<Span> {
        let span = self.span();
        if self.take(sign) {
            return Ok(span);
        }
        let found = self.describe();
        self.fail(codes::SYNTAX, format!("expected `{sign}`, found {found}"), span, "here")
    }

    /// Describes the current token for a message.
    fn describe(&self) -> String {
        let token = self.peek();
        match token.kind {
            TokenKind::End => "the end of the file".to_owned(),
            TokenKind::Opaque => "a block of user text".to_owned(),
            TokenKind::Header => format!("`#include <{}>`", token.text),
            TokenKind::Stray(stray) => format!("`{}`: {}", token.text, stray.message()),
            TokenKind::Word
            | TokenKind::Number
            | TokenKind::Character
            | TokenKind::String
            | TokenKind::Sign => format!("`{}`", token.text),
        }
    }

    fn fail<T>(
        &mut self,
        code: Code,
        message: impl Into<String>,
        span: Span,
        label: impl Into<String>,
    ) -> Read<T> {
        self.report(code, message.into(), span, label.into());
        Err(ErrorReported)
    }

    /// Reports an error. This is a separate function so that the recursive callers have small stack frames.
    #[cold]
    #[inline(never)]
    fn report(&mut self, code: Code, message: String, span: Span, label: String) {
        self.found.push(Diagnostic::error(code, message).at(span, label));
    }

    /// Reports the current token as unexpected.
    #[cold]
    fn unexpected<T>(&mut self, wanted: &str) -> Read<T> {
        let (found, span) = (self.describe(), self.span());
        self.fail(codes::SYNTAX, format!("expected {wanted}, found {found}"), span, "here")
    }

    /// Reports a violated constraint.
    fn typed<T>(&mut self, result: Result<T, TypeError>, span: Loc) -> Read<T> {
        match result {
            Ok(value) => Ok(value),
            Err(TypeError(message)) => self.fail(codes::TYPE, message, span.0, "here"),
        }
    }

    /// Calls `read` one nesting level deeper.
    fn deeper<T>(&mut self, read: impl FnOnce(&mut Self) -> Read<T>) -> Read<T> {
        if self.depth >= MAX_DEPTH {
            return self.too_deep();
        }
        self.depth += 1;
        let result = read(self);
        self.depth -= 1;
        result
    }

    #[cold]
    fn too_deep<T>(&mut self) -> Read<T> {
        let message = format!("the text is nested more than {MAX_DEPTH} levels deep");
        let span = self.span();
        self.fail(codes::LIMIT, message, span, "here")
    }

    /// Calls `read` in a scope of its own.
    fn scoped<T>(&mut self, read: impl FnOnce(&mut Self) -> Read<T>) -> Read<T> {
        self.scopes.push(Scope::default());
        let result = read(self);
        self.scopes.pop();
        result
    }

    fn lookup(&self, name: &str) -> Option<SymbolId> {
        self.scopes.iter().rev().find_map(|scope| scope.names.get(name)).copied()
    }

    fn has_header(&self, header: Header) -> bool {
        self.headers.contains(&header)
    }

    fn unknown_name<T>(&mut self, name: &str, span: Span) -> Read<T> {
        let visible = self.scopes.iter().flat_map(|scope| scope.names.keys().map(String::as_str));
        let near = (name.len() < 200).then(|| nearest(name, visible)).flatten();
        let message = format!("`{name}` is not declared");
        let found = Diagnostic::error(codes::TYPE, message).at(span, "used here");
        self.found.push(match near {
            Some(near) => found.help(format!("did you mean `{near}`?")),
            None => found,
        });
        Err(ErrorReported)
    }
}
