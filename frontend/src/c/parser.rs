//! Parser for declarations and statements: hand-written recursive descent. After an error it continues after the next `;` or at the next
//! `}`.

use grafsynth_ir::diag::{Diagnostic, ErrorReported};
use grafsynth_ir::{FileId, Name, Span};
use std::collections::{BTreeMap, BTreeSet};

use super::ast::{Base, Declaration, ExprKind, External, Function, Param, Source, Stmt, StmtKind};
use super::lexer::{self, Kind, Token};
use crate::codes;
use crate::findings::Findings;
use crate::graf::Limits;

/// The keywords of C99.
pub(super) const KEYWORDS: [&str; 37] = [
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

/// Result of parsing a part.
pub(super) type Read<T> = Result<T, ErrorReported>;

/// Parser of one source.
pub(super) struct Parser<'t> {
    pub(super) file: FileId,
    pub(super) text: &'t str,
    pub(super) tokens: Vec<Token>,
    pub(super) at: usize,
    pub(super) findings: Findings,
    pub(super) depth: u32,
    /// Depth of the deepest node in the tree of the current expression. An operator moves the operands before it one level down.
    pub(super) reach: u32,
    pub(super) nesting: u32,
    pub(super) is_unsigned_char: bool,
    /// The constants of `#define` and `enum`. The parser needs them to tell expressions from declarations.
    pub(super) constants: BTreeMap<String, i64>,
    /// Names that count as defined for `#ifdef`.
    pub(super) defined: BTreeSet<String>,
    pub(super) typedefs: BTreeMap<String, Base>,
    pub(super) source: Source,
}

/// Parses a source into its tree. Reports and omits parts that cannot be parsed.
pub(super) fn parse(
    file: FileId,
    text: &str,
    limits: &Limits,
    is_unsigned_char: bool,
    defines: &[(String, i64)],
) -> (Source, Findings) {
    let mut findings = Findings { kept: Vec::new(), limit: limits.diagnostics, rest: 0 };
    let lexed = lexer::lex(file, text, 0..text.len(), is_unsigned_char, &mut findings);
    let mut parser = Parser {
        file,
        text,
        tokens: lexed.tokens,
        at: 0,
        findings,
        depth: 0,
        reach: 0,
        nesting: limits.nesting,
        is_unsigned_char,
        constants: BTreeMap::new(),
        defined: BTreeSet::new(),
        typedefs: BTreeMap::new(),
        source: Source { comments: lexed.comments, ..Source::default() },
    };
    parser.directives(&lexed.lines, defines);
    parser.file();
    (parser.source, parser.findings)
}

impl<'t> Parser<'t> {
    // Tokens

    pub(super) fn here(&self) -> Token {
        self.tokens[self.at.min(self.tokens.len() - 1)]
    }

    pub(super) fn ahead(&self, n: usize) -> Token {
        self.tokens[(self.at + n).min(self.tokens.len() - 1)]
    }

    pub(super) fn word_of(&self, token: Token) -> &'t str {
        self.text.get(token.span.range()).unwrap_or("")
    }

    pub(super) fn take(&mut self) -> Token {
        let token = self.here();
        if token.kind != Kind::End {
            self.at += 1;
        }
        token
    }

    /// Whether this sign or word is next.
    pub(super) fn is(&self, sign: &str) -> bool {
        let token = self.here();
        matches!(token.kind, Kind::Sign | Kind::Word) && self.word_of(token) == sign
    }

    pub(super) fn accept(&mut self, sign: &str) -> bool {
        let is = self.is(sign);
        if is {
            self.take();
        }
        is
    }

    pub(super) fn is_name(&self, token: Token) -> bool {
        token.kind == Kind::Word && !KEYWORDS.contains(&self.word_of(token))
    }

    /// The span from `start` to the last consumed token.
    pub(super) fn since(&self, start: Span) -> Span {
        let last = self.tokens[self.at.saturating_sub(1)];
        if last.span.end >= start.end { start.to(last.span) } else { start }
    }

    pub(super) fn unexpected<T>(&mut self, wanted: &str) -> Read<T> {
        let token = self.here();
        let found = match token.kind {
            Kind::End => "the end of the file".to_owned(),
            _ => {
                format!("`{}`", self.word_of(token))
            }
        };
        let before = self.at.checked_sub(1).map(|at| self.tokens[at]);
        let message = format!("expected {wanted}, found {found}");
        let finding = Diagnostic::error(codes::C_SYNTAX, message);
        let finding = match before {
            Some(before) if wanted == "an expression" && before.kind == Kind::Sign => {
                let sign = self.word_of(before).to_owned();
                let label = format!("nothing follows `{sign}`");
                finding.at(token.span, label).help(match sign.as_str() {
                    "(" => "write an expression between the parentheses".to_owned(),
                    ";" | "{" | "}" => format!("write an expression before {found}"),
                    _ => format!("write an expression after `{sign}`, or remove `{sign}`"),
                })
            }
            // The end of a statement is missing at the end of its line, not at the beginning of the next one.
            Some(before)
                if wanted == "`;`" && self.is_on_another_line(before.span, token.span) =>
            {
                let end = Span { start: before.span.end, ..before.span };
                finding
                    .at(before.span, "expected `;` after this")
                    .help("write `;`")
                    .fix(end, ";")
            }
            _ if token.kind == Kind::End => finding
                .at(token.span, format!("expected {wanted}"))
                .help(format!("write {wanted} at the end, or remove the incomplete part")),
            _ if wanted == "a type" => finding.at(token.span, "expected a type").help(
                "write a type such as `int` before it; a type from a header that is not read needs its `typedef` in this file",
            ),
            _ if wanted == "a name" => finding
                .at(token.span, "expected a name")
                .help("write a name that begins with a letter and is not a C keyword"),
            _ => finding
                .at(token.span, format!("expected {wanted}"))
                .help(format!("write {wanted} before {found}, or remove {found}")),
        };
        self.findings.report(|| finding);
        Err(ErrorReported)
    }

    fn is_on_another_line(&self, before: Span, after: Span) -> bool {
        let between = before.end as usize..after.start as usize;
        self.text.get(between).is_some_and(|text| text.contains('\n'))
    }

    pub(super) fn expect(&mut self, sign: &str) -> Read<Span> {
        if self.is(sign) { Ok(self.take().span) } else { self.unexpected(&format!("`{sign}`")) }
    }

    pub(super) fn name(&mut self, wanted: &str) -> Read<Name> {
        let token = self.here();
        if self.is_name(token) {
            self.take();
            Ok(Name::new(self.word_of(token), token.span))
        } else {
            self.unexpected(wanted)
        }
    }

    /// Runs `read` one nesting level deeper.
    pub(super) fn deeper<T>(&mut self, read: impl FnOnce(&mut Self) -> Read<T>) -> Read<T> {
        if self.depth >= self.nesting {
            let (span, most) = (self.here().span, self.nesting);
            self.findings.report(|| {
                Diagnostic::error(
                    codes::NESTING,
                    format!("more than {most} levels of nested statements and expressions"),
                )
                .at(span, "too deep here")
                .help("move a part into a function, or raise the limit with --nesting-limit")
            });
            return Err(ErrorReported);
        }
        self.depth += 1;
        self.reach = self.reach.max(self.depth);
        let result = read(self);
        self.depth -= 1;
        result
    }

    /// Records that an operator moves the subtree before it one level down; false if the nesting limit is reached.
    pub(super) fn pushed_down(&mut self) -> bool {
        let has_room = self.reach < self.nesting;
        self.reach += u32::from(has_room);
        has_room
    }

    /// Skips past the next `;` or block of this level, or to the `}` that ends the level.
    fn recover(&mut self) {
        let mut open = 0_usize;
        loop {
            let token = self.here();
            if token.kind == Kind::End {
                return;
            }
            match self.word_of(token) {
                "{" => open += 1,
                "}" if open == 0 => return,
                "}" => {
                    open -= 1;
                    if open == 0 {
                        self.take();
                        return;
                    }
                }
                ";" if open == 0 => {
                    self.take();
                    return;
                }
                _ => {}
            }
            self.take();
        }
    }

    // The file

    fn file(&mut self) {
        while self.here().kind != Kind::End {
            let before = self.at;
            if self.accept(";") {
                continue;
            }
            if self.external().is_err() {
                self.recover();
                if self.at == before || self.is("}") {
                    self.take();
                }
            }
        }
    }

    fn external(&mut self) -> Read<()> {
        let start = self.here().span;
        let specifiers = self.specifiers(true)?;
        if self.is(";") {
            self.take();
            let span = self.since(start);
            self.source.items.push(External::Declaration(Declaration {
                specifiers,
                declared: Vec::new(),
                span,
            }));
            return Ok(());
        }
        let (declarator, names) = self.declarator(true)?;
        if declarator.is_function
            && !declarator.is_opaque
            && !self.is(";")
            && !self.is(",")
            && !self.is("=")
        {
            let params = self.old_style(names)?;
            if !self.is("{") {
                return self.unexpected("`{` of the function's body, or `;`");
            }
            let body = self.statement()?;
            let span = self.since(start);
            let name = declarator.name.clone();
            self.source.items.push(External::Function(Box::new(Function {
                name,
                specifiers,
                declarator,
                params,
                body,
                span,
            })));
            return Ok(());
        }
        let declaration = self.declaration_from(start, specifiers, Some(declarator))?;
        self.source.items.push(External::Declaration(declaration));
        Ok(())
    }

    /// Parses the declarations between the head and the body of a K&R definition. Parameters without a declaration are `int`.
    fn old_style(&mut self, mut params: Vec<Param>) -> Read<Vec<Param>> {
        while !self.is("{") && self.here().kind != Kind::End {
            let start = self.here().span;
            let specifiers = self.specifiers(false)?;
            let declaration = self.declaration_from(start, specifiers.clone(), None)?;
            for (declarator, _) in declaration.declared {
                match params.iter_mut().find(|param| param.name.text == declarator.name.text) {
                    Some(param) => {
                        *param = Param {
                            name: param.name.clone(),
                            specifiers: specifiers.clone(),
                            declarator,
                        }
                    }
                    None => {
                        let name = declarator.name.clone();
                        self.findings.report(|| {
                            Diagnostic::error(
                                codes::C_SYNTAX,
                                format!(
                                    "`{name}` is declared between the head and the body but is not a parameter"
                                ),
                            )
                            .at(name.span, "not in the list of parameters")
                            .help(format!("add `{name}` to the parameters in the parentheses, or move its declaration into the body"))
                        });
                    }
                }
            }
        }
        Ok(params)
    }

    // Statements

    fn statement(&mut self) -> Read<Stmt> {
        self.deeper(Self::statement_inner)
    }

    fn condition(&mut self) -> Read<super::ast::Expr> {
        self.expect("(")?;
        // As in C compilers, a second pair of parentheses marks an intended assignment.
        let is_meant = self.is("(");
        let condition = self.expression()?;
        if let (ExprKind::Assign(None, target, value), false) = (&condition.kind, is_meant) {
            self.assigns(condition.span, target.span, value.span);
        }
        self.expect(")")?;
        Ok(condition)
    }

    /// Warns about `if (a = b)`.
    fn assigns(&mut self, whole: Span, target: Span, value: Span) {
        let (from, to) = (target.end as usize, value.start as usize);
        let sign = self.text.get(from..to).and_then(|between| between.find('='));
        let name = self.text.get(target.start as usize..from).unwrap_or("").to_owned();
        self.findings.report(|| {
            let finding = Diagnostic::warning(
                codes::C_CONDITION_ASSIGNS,
                format!("this condition assigns `{name}` instead of comparing it"),
            )
            .at(whole, "`=` assigns, `==` compares")
            .help("write `==` to compare, or a second pair of parentheses if the assignment is intended");
            match sign {
                Some(sign) => {
                    let sign = Span::new(whole.file, from + sign, from + sign + 1);
                    finding.fix(sign, "==")
                }
                None => finding,
            }
        });
    }

    /// Warns about a semicolon that is the whole body of a statement with this keyword.
    fn empty_body(&mut self, word: &str) {
        let semicolon = self.here().span;
        self.findings.report(|| {
            Diagnostic::warning(codes::C_EMPTY_BODY, format!("the body of this `{word}` is empty"))
                .at(semicolon, format!("this `;` is the whole body of the `{word}`"))
                .help("remove the `;`, or write `{}` if the empty body is intended")
                .fix(semicolon, "")
        });
    }

    /// Whether a `;` directly after `)` is followed by a block, which looks like the body but is not.
    fn is_cut_off(&self) -> bool {
        let semicolon = self.here().span.start as usize;
        self.is(";")
            && self.word_of(self.ahead(1)) == "{"
            && self.text.get(..semicolon).is_some_and(|before| before.ends_with(')'))
    }

    fn block(&mut self) -> Read<StmtKind> {
        let open = self.expect("{")?;
        let mut all = Vec::new();
        loop {
            if self.accept("}") {
                return Ok(StmtKind::Block(all));
            }
            if self.here().kind == Kind::End {
                self.findings.report(|| {
                    Diagnostic::error(codes::C_SYNTAX, "this `{` is not closed")
                        .at(open, "opened here")
                        .help("write `}` at the end of this block")
                });
                return Err(ErrorReported);
            }
            let before = self.at;
            match self.statement() {
                Ok(statement) => all.push(statement),
                Err(ErrorReported) => {
                    self.recover();
                    if self.at == before && !self.is("}") {
                        self.take();
                    }
                }
            }
        }
    }

    /// Parses a statement. Each form has a small function of its own, because deep nesting uses one stack frame per level.
    fn statement_inner(&mut self) -> Read<Stmt> {
        let start = self.here().span;
        let token = self.here();
        let is_sign = matches!(token.kind, Kind::Word | Kind::Sign);
        let word = if is_sign { self.word_of(token) } else { "" };
        let kind = match word {
            "{" => self.block(),
            "if" => self.if_statement(),
            "while" => self.while_statement(),
            "do" => self.do_statement(),
            "for" => self.for_statement(),
            "switch" => self.switch_statement(),
            "case" => self.case_statement(),
            "default" => self.default_statement(),
            "else" => {
                self.findings.report(|| {
                    Diagnostic::error(codes::C_SYNTAX, "`else` without an `if`")
                        .at(start, "no `if` ends before it")
                        .help("put the statements between the `if` and the `else` into `{` and `}`, or remove a `;` after them")
                });
                Err(ErrorReported)
            }
            _ if self.is_name(token) && self.word_of(self.ahead(1)) == ":" => {
                self.label_statement()
            }
            _ => self.simple_statement(word),
        }?;
        Ok(Stmt { kind, span: self.since(start) })
    }

    fn if_statement(&mut self) -> Read<StmtKind> {
        self.take();
        let condition = self.condition()?;
        if self.is(";") && self.word_of(self.ahead(1)) != "else" {
            self.empty_body("if");
        }
        let then = Box::new(self.statement()?);
        let otherwise = if self.accept("else") { Some(Box::new(self.statement()?)) } else { None };
        Ok(StmtKind::If(condition, then, otherwise))
    }

    fn while_statement(&mut self) -> Read<StmtKind> {
        self.take();
        let condition = self.condition()?;
        if self.is_cut_off() {
            self.empty_body("while");
        }
        Ok(StmtKind::While(condition, Box::new(self.statement()?)))
    }

    fn do_statement(&mut self) -> Read<StmtKind> {
        self.take();
        let body = Box::new(self.statement()?);
        self.expect("while")?;
        let condition = self.condition()?;
        self.expect(";")?;
        Ok(StmtKind::Do(body, condition))
    }

    fn for_statement(&mut self) -> Read<StmtKind> {
        self.take();
        self.expect("(")?;
        let first = if self.accept(";") { None } else { Some(Box::new(self.for_first()?)) };
        let condition = if self.is(";") { None } else { Some(self.expression()?) };
        self.expect(";")?;
        let last = if self.is(")") { None } else { Some(self.expression()?) };
        self.expect(")")?;
        if self.is_cut_off() {
            self.empty_body("for");
        }
        Ok(StmtKind::For { first, condition, last, body: Box::new(self.statement()?) })
    }

    fn for_first(&mut self) -> Read<Stmt> {
        let start = self.here().span;
        if self.begins_declaration() {
            let specifiers = self.specifiers(false)?;
            let declaration = self.declaration_from(start, specifiers, None)?;
            let span = declaration.span;
            return Ok(Stmt { kind: StmtKind::Declaration(declaration), span });
        }
        let value = self.expression()?;
        self.expect(";")?;
        let span = value.span;
        Ok(Stmt { kind: StmtKind::Expr(value), span })
    }

    fn switch_statement(&mut self) -> Read<StmtKind> {
        self.take();
        let value = self.condition()?;
        Ok(StmtKind::Switch(value, Box::new(self.statement()?)))
    }

    fn case_statement(&mut self) -> Read<StmtKind> {
        self.take();
        let value = self.expression()?;
        self.expect(":")?;
        Ok(StmtKind::Case(value, Box::new(self.labelled()?)))
    }

    fn default_statement(&mut self) -> Read<StmtKind> {
        self.take();
        self.expect(":")?;
        Ok(StmtKind::Default(Box::new(self.labelled()?)))
    }

    fn label_statement(&mut self) -> Read<StmtKind> {
        let label = self.name("a label")?;
        self.take();
        Ok(StmtKind::Label(label, Box::new(self.labelled()?)))
    }

    fn simple_statement(&mut self, word: &str) -> Read<StmtKind> {
        let start = self.here().span;
        let kind = match word {
            "goto" => {
                self.take();
                StmtKind::Goto(self.name("a label")?)
            }
            "return" => {
                self.take();
                StmtKind::Return(if self.is(";") { None } else { Some(self.expression()?) })
            }
            ";" => StmtKind::Null,
            "break" => {
                self.take();
                StmtKind::Break
            }
            "continue" => {
                self.take();
                StmtKind::Continue
            }
            _ if self.begins_declaration() => {
                let specifiers = self.specifiers(false)?;
                return Ok(StmtKind::Declaration(self.declaration_from(start, specifiers, None)?));
            }
            _ => StmtKind::Expr(self.expression()?),
        };
        self.expect(";")?;
        Ok(kind)
    }

    /// Parses a labelled statement. A label at the end of a block may have no statement (C23 and most compilers allow it).
    fn labelled(&mut self) -> Read<Stmt> {
        if self.is("}") {
            let at = self.here().span;
            return Ok(Stmt {
                kind: StmtKind::Null,
                span: Span::new(self.file, at.start as usize, at.start as usize),
            });
        }
        self.statement()
    }

    /// Whether a cast or a compound literal begins here; `(` is next.
    pub(super) fn begins_cast(&self) -> bool {
        let next = self.ahead(1);
        if next.kind != Kind::Word {
            return false;
        }
        let word = self.word_of(next);
        self.is_type_word(word)
            || (self.is_name(next)
                && self.word_of(self.ahead(2)) == "*"
                && self.word_of(self.ahead(3)) == ")")
    }
}
