//! Preprocessor directives: names of constants, and conditional text (C99 6.10.1, 6.10.3).
//!
//! Conditions are evaluated with the constants of the file and those given by `-D`. Excluded text is removed before parsing, together with
//! its tokens, its comments and the lexer's findings in it.

use grafsynth_ir::Name;
use grafsynth_ir::Span;
use grafsynth_ir::diag::{Diagnostic, ErrorReported};
use std::collections::{BTreeMap, BTreeSet};

use super::ast::{Expr, ExprKind};
use super::constant;
use super::lexer::{self, Kind, Line, Token};
use super::parser::{Parser, Read};
use crate::codes;

/// An `#if` that is not closed yet.
struct Open {
    span: Span,
    /// Whether the surrounding text is included.
    is_outer_active: bool,
    /// Whether the text of the current branch is included.
    is_active: bool,
    /// Whether a branch was already taken, or no further branch may be taken.
    was_taken: bool,
    has_else: bool,
}

/// Headers whose declarations the parser knows.
const KNOWN_HEADERS: [&str; 4] = ["<stdbool.h>", "<stdint.h>", "<limits.h>", "<stddef.h>"];

impl Parser<'_> {
    /// Processes all directives and removes the excluded text.
    pub(super) fn directives(&mut self, lines: &[Line], defines: &[(String, i64)]) {
        for (name, value) in defines {
            self.constants.insert(name.clone(), *value);
            self.defined.insert(name.clone());
            self.source.constants.push((Name::new(name.clone(), Span::default()), *value));
            self.source.given.push((name.clone(), *value));
        }
        let mut open: Vec<Open> = Vec::new();
        // Excluded ranges in source order.
        let mut absent: Vec<(u32, u32)> = Vec::new();
        let mut absent_from: Option<u32> = None;
        for line in lines {
            let was_active = open.last().is_none_or(|one| one.is_active);
            self.line(*line, was_active, &mut open);
            let is_active = open.last().is_none_or(|one| one.is_active);
            if was_active && !is_active {
                absent_from = Some(line.span.end);
            } else if !was_active
                && is_active
                && let Some(from) = absent_from.take()
            {
                absent.push((from, line.span.start));
            }
        }
        if let Some(from) = absent_from {
            absent.push((from, u32::MAX));
        }
        for one in open {
            self.findings.report(|| {
                Diagnostic::error(codes::C_DIRECTIVE, "this conditional has no `#endif`")
                    .at(one.span, "begins here")
                    .help("write `#endif` at its end")
            });
        }
        if absent.is_empty() {
            return;
        }
        let is_absent = |place: u32| {
            let next = absent.partition_point(|(_, end)| *end <= place);
            absent.get(next).is_some_and(|(start, _)| *start <= place)
        };
        self.tokens.retain(|token| token.kind == Kind::End || !is_absent(token.span.start));
        self.source.comments.retain(|comment| !is_absent(comment.start));
        self.findings.kept.retain(|finding| {
            let place = finding.labels.first().map(|label| label.span.start);
            finding.code.id != codes::C_CHARACTERS.id || !place.is_some_and(is_absent)
        });
    }

    fn line(&mut self, line: Line, is_active: bool, open: &mut Vec<Open>) {
        let text = self.text.get(line.span.range()).unwrap_or("");
        let body = text.trim_start_matches('#').trim_start();
        let offset = line.span.start as usize + (text.len() - body.len());
        let word: String = body.chars().take_while(char::is_ascii_alphanumeric).collect();
        let rest = offset + word.len();
        match word.as_str() {
            "if" | "ifdef" | "ifndef" => {
                if open.len() >= self.nesting as usize {
                    if open.len() == self.nesting as usize {
                        let nesting = self.nesting;
                        self.findings.report(|| {
                            Diagnostic::error(
                                codes::NESTING,
                                format!("conditionals are nested deeper than {nesting} levels"),
                            )
                            .at(line.span, "")
                        });
                    }
                    // A conditional in excluded text still counts, so that each `#endif` closes its own conditional.
                    let (is_outer_active, was_taken) = (false, true);
                    let (span, is_active, has_else) = (line.span, false, false);
                    open.push(Open { span, is_outer_active, is_active, was_taken, has_else });
                    return;
                }
                let holds = is_active
                    && match word.as_str() {
                        "if" => self.decides(line, rest),
                        _ => self.is_defined(line, rest) == (word == "ifdef"),
                    };
                open.push(Open {
                    span: line.span,
                    is_outer_active: is_active,
                    is_active: holds,
                    was_taken: holds || !is_active,
                    has_else: false,
                });
            }
            "elif" | "else" => {
                let Some(one) = open.last_mut() else {
                    return self.without_if(&word, line);
                };
                if one.has_else {
                    let first = one.span;
                    self.findings.report(|| {
                        Diagnostic::error(
                            codes::C_DIRECTIVE,
                            format!("`#{word}` after the `#else` of its conditional"),
                        )
                        .at(line.span, "never reached")
                        .at(first, "the conditional")
                        .help(if word == "else" {
                            "remove one of the two `#else` lines"
                        } else {
                            "move it, with its lines, before the `#else`"
                        })
                    });
                    return;
                }
                one.has_else = word == "else";
                let is_open = one.is_outer_active && !one.was_taken;
                let holds = is_open && (word == "else" || self.decides(line, rest));
                if let Some(one) = open.last_mut() {
                    one.is_active = holds;
                    one.was_taken |= holds;
                }
            }
            "endif" => {
                let closed = open.pop();
                if closed.is_none() {
                    self.without_if(&word, line);
                }
            }
            _ if is_active => self.active_line(line, &word, body, rest),
            _ => {}
        }
    }

    /// Processes a directive that is not a conditional, in included text.
    fn active_line(&mut self, line: Line, word: &str, body: &str, rest: usize) {
        match word {
            "include" => {
                self.source.lines.push(line.span);
                let name = body["include".len()..].trim().to_owned();
                if !KNOWN_HEADERS.contains(&name.as_str()) {
                    self.findings.report(|| {
                        Diagnostic::note(codes::C_INCLUDE, format!("{name} is not read"))
                            .at(line.span, "its declarations are unknown here")
                            .help(if name.starts_with('<') {
                                "declare in this file what the source uses from the header, or preprocess the source as shown by `explain G0484`"
                            } else {
                                "declare in this file what the source uses from the header, or pass the output of `cc -E`"
                            })
                    });
                }
            }
            "define" => self.define(line, rest),
            "undef" => {
                let name = self.text.get(rest..line.span.end as usize).unwrap_or("").trim();
                self.defined.remove(name);
            }
            "error" => {
                let text = body["error".len()..].trim().to_owned();
                self.findings.report(|| {
                    Diagnostic::error(codes::C_DIRECTIVE, format!("#error: {text}"))
                        .at(line.span, "this directive is active")
                        .help("the conditions around it are evaluated with the constants of the file and those given by -D NAME=VALUE")
                });
            }
            // Line markers in the output of a preprocessor, an empty directive, and directives that only affect a compiler.
            "" | "pragma" | "line" | "ident" | "warning" => {}
            _ if word.bytes().all(|byte| byte.is_ascii_digit()) => {}
            _ => self.findings.report(|| {
                Diagnostic::error(codes::C_DIRECTIVE, format!("`#{word}` is not supported"))
                    .at(line.span, "")
                    .help("remove it, or pass the output of `cc -E` if your compiler knows such lines")
            }),
        }
    }

    fn without_if(&mut self, word: &str, line: Line) {
        self.findings.report(|| {
            Diagnostic::error(codes::C_DIRECTIVE, format!("`#{word}` without an `#if` before it"))
                .at(line.span, "no conditional is open here")
                .help("write `#if` before it, or remove this line; there may be an extra `#endif` before it")
        });
    }

    /// Parses a directive after its first word, with its own tokens.
    fn on_line<T>(&mut self, line: Line, from: usize, read: impl FnOnce(&mut Self) -> T) -> T {
        let lexed = lexer::lex(
            self.file,
            self.text,
            from..line.span.end as usize,
            self.is_unsigned_char,
            &mut self.findings,
        );
        let tokens = std::mem::replace(&mut self.tokens, lexed.tokens);
        let at = std::mem::take(&mut self.at);
        let result = read(self);
        self.tokens = tokens;
        self.at = at;
        result
    }

    /// Whether the name after `#ifdef` is defined.
    fn is_defined(&mut self, line: Line, from: usize) -> bool {
        self.on_line(line, from, |parser| {
            let name = parser.here();
            if parser.is_name(name) {
                return parser.defined.contains(parser.word_of(name));
            }
            let _: Read<()> = parser.unexpected("a macro name");
            false
        })
    }

    /// Whether the condition of `#if` or `#elif` is not 0.
    fn decides(&mut self, line: Line, from: usize) -> bool {
        self.on_line(line, from, |parser| {
            let asked = parser.replace_defined();
            if parser.here().kind == Kind::End {
                parser.findings.report(|| {
                    Diagnostic::error(codes::C_DIRECTIVE, "missing condition")
                        .at(line.span, "nothing follows")
                        .help("write a condition, as in `#if FAST > 0`")
                });
                return false;
            }
            let Ok(expr) = parser.expression() else { return false };
            if parser.here().kind != Kind::End {
                let _: Read<()> = parser.unexpected("the end of the line");
                return false;
            }
            let mut names = parser.constants.clone();
            names.retain(|name, _| parser.defined.contains(name));
            parser.unknown_are_zero(&expr, &asked, &mut names);
            match constant::value(&expr, &names) {
                Ok(value) => value != 0,
                Err(span) => {
                    parser.findings.report(|| {
                        Diagnostic::error(
                            codes::C_DIRECTIVE,
                            "the condition is not a constant expression",
                        )
                        .at(span, "not a constant")
                        .help("define it with -D NAME=VALUE, or pass the output of `cc -E`")
                    });
                    false
                }
            }
        })
    }

    /// Replaces `defined NAME` and `defined(NAME)` by 1 or 0, and returns the names after `defined`.
    fn replace_defined(&mut self) -> BTreeSet<String> {
        let mut asked = BTreeSet::new();
        let mut all: Vec<Token> = Vec::with_capacity(self.tokens.len());
        let mut at = 0;
        while let Some(token) = self.tokens.get(at).copied() {
            at += 1;
            let next = |ahead: usize| self.tokens.get(at + ahead).map(|it| self.word_of(*it));
            let length = match (self.word_of(token), next(0), next(1), next(2)) {
                ("defined", Some("("), Some(_), Some(")")) => 3,
                ("defined", Some(_), _, _) => 1,
                _ => 0,
            };
            if length == 0 {
                all.push(token);
                continue;
            }
            let name = self.tokens[at + length / 2];
            at += length;
            asked.insert(self.word_of(name).to_owned());
            let value = u64::from(self.defined.contains(self.word_of(name)));
            let kind = Kind::Number { value, is_unsigned: false, n_long: 0, is_decimal: true };
            all.push(Token { kind, span: token.span.to(name.span) });
        }
        self.tokens = all;
        asked
    }

    /// Replaces undefined names in a condition by 0 (C99 6.10.1) and reports them.
    fn unknown_are_zero(
        &mut self,
        expr: &Expr,
        asked: &BTreeSet<String>,
        names: &mut BTreeMap<String, i64>,
    ) {
        let mut unknown: Vec<(String, Span)> = Vec::new();
        expr.each(&mut |one| {
            if let ExprKind::Name(name) = &one.kind
                && !names.contains_key(name)
                && !matches!(name.as_str(), "true" | "false")
            {
                unknown.push((name.clone(), one.span));
            }
        });
        for (name, span) in unknown {
            if self.source.opaque_macros.contains(&name) {
                continue;
            }
            if names.insert(name.clone(), 0).is_none() && !asked.contains(&name) {
                self.findings.report(|| {
                    Diagnostic::warning(
                        codes::C_UNDECLARED,
                        format!("`{name}` is not defined, so it is 0 in this condition"),
                    )
                    .at(span, "")
                    .help(format!("write `#define {name} VALUE`, or pass `-D {name}=VALUE`"))
                });
            }
        }
    }

    /// Processes `#define NAME constant`. Any other define is kept as text for the library, and its uses are opaque.
    fn define(&mut self, line: Line, from: usize) {
        self.on_line(line, from, |parser| parser.define_name(line.span));
    }

    fn define_name(&mut self, line: Span) {
        let name = self.here();
        if self.is_name(name) {
            self.take();
            let text = self.word_of(name).to_owned();
            // The parenthesis of a parameter list follows the name without a blank.
            let is_function = self.is("(") && self.here().span.start == name.span.end;
            let is_empty = self.here().kind == Kind::End;
            let value = (!is_function && !is_empty && self.here().kind != Kind::Text)
                .then(|| {
                    self.quietly(|p| {
                        let value = p.expression()?;
                        if p.here().kind == Kind::End { Ok(value) } else { Err(ErrorReported) }
                    })
                })
                .flatten();
            self.defined.insert(text.clone());
            match value.and_then(|value| constant::value(&value, &self.constants).ok()) {
                // A name has one value in the whole file.
                Some(value) if self.constants.get(&text).is_some_and(|old| *old != value) => {
                    let old = self.constants[&text];
                    self.findings.report(|| {
                        Diagnostic::error(
                            codes::C_DIRECTIVE,
                            format!("`{text}` is redefined as {value}; it was {old}"),
                        )
                        .at(name.span, "")
                        .help("use a different name for the second value, or pass the output of `cc -E`")
                    });
                }
                Some(value) => {
                    self.constants.insert(text.clone(), value);
                    self.source.constants.push((Name::new(text, name.span), value));
                }
                None => {
                    if !is_empty {
                        self.source.opaque_macros.push(text);
                    }
                    self.source.lines.push(line);
                }
            }
        } else {
            let _: Read<()> = self.unexpected("the name to define");
        }
    }

    /// Runs `read` and discards its findings.
    fn quietly<T>(&mut self, read: impl FnOnce(&mut Self) -> Read<T>) -> Option<T> {
        let (kept, rest) = (self.findings.kept.len(), self.findings.rest);
        let result = read(self).ok();
        self.findings.kept.truncate(kept);
        self.findings.rest = rest;
        result
    }
}
