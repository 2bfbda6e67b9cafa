//! The preprocessor (C99 6.10): directives, inclusion and macros. The result is the tokens that a compiler of the configuration sees.

use super::headers;
use super::lexer::{Token, TokenKind, Verbatim, lex};
use super::macros::{Macro, Macros};
use super::{Input, Parser};
use crate::codes;
use crate::tree::Unit;
use crate::tree::types::Machine;
use grafsynth_ir::{Diagnostic, FileId, Span};
use std::collections::BTreeMap;
use std::rc::Rc;

/// The maximum nesting of inclusions and of conditions.
const MAX_NESTED: usize = 100;
/// The maximum number of tokens in all files; a file that is included several times counts each time.
const MAX_TOKENS: usize = 20_000_000;
/// The maximum number of parameters of a macro (C99 5.2.4.1 requires 127).
const MAX_PARAMS: usize = 127;

type Outcome<T> = Result<T, Box<Diagnostic>>;

/// The tokens of a unit, ending with [`TokenKind::End`].
pub(crate) fn preprocess<'a>(input: &Input<'a>) -> Outcome<Vec<Token<'a>>> {
    let verbatim = Verbatim::new(input.verbatim);
    let mut preprocessor = Preprocessor {
        input: *input,
        texts: input
            .files
            .iter()
            .map(|file| Rc::new(lex(file.file, file.text, &verbatim)))
            .collect(),
        macros: Macros::default(),
        constants: BTreeMap::new(),
        included: Vec::new(),
        n_tokens: 0,
        out: Vec::new(),
    };
    for (name, value) in &input.config.macros {
        // Predefined values have no location.
        let mut body = lex(FileId::default(), value, &Verbatim::default());
        body.pop();
        let (name, params) = match name.split_once('(') {
            Some((name, params)) => {
                let params = params.trim_end_matches(')').split(',').map(str::trim);
                (name, Some(params.filter(|param| !param.is_empty()).collect()))
            }
            None => (name.as_str(), None),
        };
        preprocessor.macros.define(name, Macro { params, body, span: None });
    }
    preprocessor.file(0, 0)?;
    let end = preprocessor.texts.first().and_then(|tokens| tokens.last().copied());
    preprocessor.out.extend(end);
    Ok(preprocessor.out)
}

struct Preprocessor<'a> {
    input: Input<'a>,
    /// The tokens of each file.
    texts: Vec<Rc<Vec<Token<'a>>>>,
    macros: Macros<'a>,
    /// The constants of the standard headers that are included, for `#if`.
    constants: BTreeMap<String, i128>,
    included: Vec<crate::tree::Header>,
    n_tokens: usize,
    out: Vec<Token<'a>>,
}

/// An `#if` whose `#endif` is still to come.
struct Condition {
    /// True if the current group is read.
    is_active: bool,
    /// True if this group or an earlier one is read.
    is_decided: bool,
    /// True after `#else`.
    is_last: bool,
    span: Span,
}

fn error<T>(message: impl Into<String>, span: Span, label: &str) -> Outcome<T> {
    Err(Box::new(Diagnostic::error(codes::PREPROCESSOR, message).at(span, label)))
}

impl<'a> Preprocessor<'a> {
    fn file(&mut self, at: usize, depth: usize) -> Outcome<()> {
        let Some(tokens) = self.texts.get(at).map(Rc::clone) else { return Ok(()) };
        self.lines(&tokens, depth)
    }

    fn lines(&mut self, tokens: &[Token<'a>], depth: usize) -> Outcome<()> {
        self.n_tokens += tokens.len();
        if self.n_tokens > MAX_TOKENS {
            let message = format!("the included files have more than {MAX_TOKENS} tokens");
            let span = tokens.first().map(|token| token.span).unwrap_or_default();
            return Err(Box::new(
                Diagnostic::error(codes::LIMIT, message).at(span, "in this file"),
            ));
        }
        let mut conditions: Vec<Condition> = Vec::new();
        let mut at = 0;
        while let Some(token) = tokens.get(at).filter(|token| token.kind != TokenKind::End) {
            let is_directive = token.starts_line && token.is("#");
            let length = if is_directive {
                1 + tokens[at + 1..].iter().take_while(|token| !token.starts_line).count()
            } else {
                let is_text = |token: &&Token| !(token.starts_line && token.is("#"));
                tokens[at..].iter().take_while(is_text).count()
            };
            let part = &tokens[at..at + length];
            at += length;
            let is_active = conditions.iter().all(|one| one.is_active);
            if is_directive {
                let words: Vec<Token<'a>> =
                    part[1..].iter().filter(|it| it.kind != TokenKind::End).copied().collect();
                self.directive(token.span, &words, is_active, &mut conditions, depth)?;
            } else if is_active {
                let part: Vec<Token<'a>> =
                    part.iter().filter(|it| it.kind != TokenKind::End).copied().collect();
                let expanded = self.macros.expand(&part, 0)?;
                self.out.extend(expanded);
            }
        }
        match conditions.first() {
            Some(open) => error("this condition has no `#endif`", open.span, "begins here"),
            None => Ok(()),
        }
    }

    fn directive(
        &mut self,
        span: Span,
        words: &[Token<'a>],
        is_active: bool,
        conditions: &mut Vec<Condition>,
        depth: usize,
    ) -> Outcome<()> {
        let Some((name, rest)) = words.split_first() else { return Ok(()) };
        match name.text {
            "if" | "ifdef" | "ifndef" => {
                if conditions.len() + depth > MAX_NESTED {
                    return error("conditions are nested too deeply", span, "here");
                }
                let holds = is_active && self.condition(*name, rest)?;
                // Inside a skipped group, all groups are skipped.
                let is_decided = holds || !is_active;
                conditions.push(Condition { is_active: holds, is_decided, is_last: false, span });
                Ok(())
            }
            "elif" | "else" | "endif" => self.next_group(*name, rest, conditions),
            _ if !is_active => Ok(()),
            "define" => self.define(span, rest),
            "undef" => match rest {
                [one] if one.kind == TokenKind::Word => {
                    self.macros.undefine(one.text);
                    Ok(())
                }
                _ => error("`#undef` needs a name", span, "here"),
            },
            "include" => self.include(span, rest, depth),
            "error" => {
                let words: Vec<&str> = rest.iter().map(|token| token.text).collect();
                error(format!("#error {}", words.join(" ")), span, "reached with these macros")
            }
            other => error(format!("the directive `#{other}` is not supported"), span, "here"),
        }
    }

    fn next_group(
        &mut self,
        name: Token<'a>,
        rest: &[Token<'a>],
        conditions: &mut Vec<Condition>,
    ) -> Outcome<()> {
        let is_elif = name.text == "elif";
        let Some(open) = conditions.last() else {
            return error(format!("`#{}` without `#if`", name.text), name.span, "here");
        };
        if name.text != "endif" && open.is_last {
            return error(format!("`#{}` after `#else`", name.text), name.span, "here");
        }
        if let (false, Some(extra)) = (is_elif, rest.first()) {
            return error("nothing may follow on this line", extra.span, "here");
        }
        if name.text == "endif" {
            conditions.pop();
            return Ok(());
        }
        let is_open = !open.is_decided;
        let holds = is_open && (!is_elif || self.condition(name, rest)?);
        if let Some(open) = conditions.last_mut() {
            open.is_active = holds;
            open.is_decided |= holds;
            open.is_last = !is_elif;
        }
        Ok(())
    }

    /// True if the macro is defined; the names of standard headers count.
    fn is_defined(&self, name: &str) -> bool {
        use crate::tree::Header;
        let has = |header: Header| self.included.contains(&header);
        self.macros.get(name).is_some()
            || self.constants.contains_key(name)
            || matches!(name, "bool" | "true" | "false") && has(Header::StdBool)
            || name == "NULL" && has(Header::StdDef)
            || headers::sized_constant(name).is_some() && has(Header::StdInt)
    }

    fn condition(&mut self, name: Token<'a>, rest: &[Token<'a>]) -> Outcome<bool> {
        if name.text != "if" && name.text != "elif" {
            return match rest {
                [one] if one.kind == TokenKind::Word => {
                    Ok(self.is_defined(one.text) == (name.text == "ifdef"))
                }
                _ => error(format!("`#{}` needs one name", name.text), name.span, "here"),
            };
        }
        let answered = self.answer_defined(rest)?;
        let expanded = self.macros.expand(&answered, 0)?;
        let mut numbers = Vec::new();
        let known: Vec<(Span, Option<i128>)> = expanded
            .iter()
            .map(|token| (token.span, self.constants.get(token.text).copied()))
            .collect();
        let texts: Vec<String> =
            known.iter().map(|(_, value)| value.map(number_text).unwrap_or_default()).collect();
        for (token, text) in expanded.iter().zip(&texts) {
            if token.kind != TokenKind::Word {
                numbers.push(*token);
            } else if text.is_empty() {
                // The remaining names are 0 (C99 6.10.1p4).
                numbers.push(Token { kind: TokenKind::Number, text: "0", ..*token });
            } else {
                let mut inner = lex(token.span.file, text, &Verbatim::default());
                inner.pop();
                numbers.extend(inner.into_iter().map(|it| Token { span: token.span, ..it }));
            }
        }
        evaluate(&numbers, name.span)
    }

    /// Replaces `defined X` by 1 or 0.
    fn answer_defined(&self, rest: &[Token<'a>]) -> Outcome<Vec<Token<'a>>> {
        let mut answered = Vec::new();
        let mut at = 0;
        while let Some(token) = rest.get(at) {
            if !token.is_word("defined") {
                answered.push(*token);
                at += 1;
                continue;
            }
            let after = &rest[at + 1..];
            let (name, length) = match after {
                [open, name, close, ..] if open.is("(") && close.is(")") => (name, 4),
                [name, ..] => (name, 2),
                [] => return error("`defined` needs a name", token.span, "here"),
            };
            if name.kind != TokenKind::Word {
                return error("`defined` needs a name", token.span, "here");
            }
            let text = if self.is_defined(name.text) { "1" } else { "0" };
            answered.push(Token { kind: TokenKind::Number, text, ..*token });
            at += length;
        }
        Ok(answered)
    }

    fn define(&mut self, span: Span, rest: &[Token<'a>]) -> Outcome<()> {
        let Some((name, rest)) = rest.split_first().filter(|(it, _)| it.kind == TokenKind::Word)
        else {
            return error("`#define` needs a name", span, "here");
        };
        let (params, body) = match rest.split_first() {
            Some((open, after)) if open.is("(") && !open.has_space => {
                let (params, body) = parameters(name.span, after)?;
                (Some(params), body)
            }
            _ => (None, rest),
        };
        let unsupported = body.iter().find(|it| it.is("##") || it.is("#") && params.is_some());
        if let Some(sign) = unsupported {
            let message = format!("the operator `{}` is not supported", sign.text);
            return error(message, sign.span, "here");
        }
        let new = Macro { params, body: body.to_vec(), span: Some(name.span) };
        if name.text == "defined" || self.is_defined(name.text) {
            return match self.macros.get(name.text) {
                Some(old) if old.is_same(&new) => Ok(()),
                old => {
                    let message = format!("the macro `{}` is already defined", name.text);
                    let found = Diagnostic::error(codes::PREPROCESSOR, message)
                        .at(name.span, "defined again here");
                    let first = old.and_then(|old| old.span);
                    Err(Box::new(match first {
                        Some(first) => found.at(first, "first defined here"),
                        None => found,
                    }))
                }
            };
        }
        self.macros.define(name.text, new);
        Ok(())
    }

    fn include(&mut self, span: Span, rest: &[Token<'a>], depth: usize) -> Outcome<()> {
        if depth > MAX_NESTED {
            return error("files are included too deeply", span, "here");
        }
        let (name, is_standard) = match rest {
            [one] if one.kind == TokenKind::String => {
                (one.text.trim_matches('"').to_owned(), false)
            }
            [open, inner @ .., close] if open.is("<") && close.is(">") => {
                (inner.iter().map(|token| token.text).collect::<String>(), true)
            }
            _ => return error("`#include` needs the name of a file", span, "here"),
        };
        if let (true, Some(header)) = (is_standard, headers::header(&name)) {
            if !self.included.contains(&header) {
                self.included.push(header);
                self.constants.extend(headers::constants(&self.input.config.machine, header));
                let text = header.name();
                let token = rest.first().copied();
                self.out.extend(token.map(|it| Token {
                    kind: TokenKind::Header,
                    text,
                    span,
                    ..it
                }));
            }
            return Ok(());
        }
        if is_standard {
            let message = format!("the standard header `<{name}>` is not known");
            let found = Diagnostic::error(codes::PREPROCESSOR, message).at(span, "included here");
            let help = format!("write `#include \"{name}\"` for a file in the same folder");
            return Err(Box::new(found.help(help)));
        }
        match self.input.files.iter().position(|file| file.name == name) {
            Some(at) => self.file(at, depth + 1),
            None => error(format!("the file `{name}` is not known"), span, "included here"),
        }
    }
}

/// The parameter names of a macro, and the tokens that follow the closing parenthesis.
fn parameters<'a, 'b>(
    name: Span,
    after: &'b [Token<'a>],
) -> Outcome<(Vec<&'a str>, &'b [Token<'a>])> {
    let Some(close) = after.iter().position(|token| token.is(")")) else {
        return error("the parameter list of this macro is not closed", name, "here");
    };
    let (list, body) = (&after[..close], &after[close + 1..]);
    if list.len() > 2 * MAX_PARAMS {
        return error(format!("more than {MAX_PARAMS} parameters"), name, "of this macro");
    }
    let mut params = Vec::new();
    for (at, token) in list.iter().enumerate() {
        let is_name = at % 2 == 0;
        let is_good = if is_name { token.kind == TokenKind::Word } else { token.is(",") };
        if !is_good || params.contains(&token.text) {
            return error(
                "the parameters of a macro must be different names, with commas between them",
                token.span,
                "here",
            );
        }
        if is_name {
            params.push(token.text);
        }
    }
    if !list.is_empty() && list.len() % 2 == 0 {
        return error("a name is missing in this list", name, "here");
    }
    Ok((params, body))
}

/// A value as an expression of the preprocessor, whose integers have 64 bits (C99 6.10.1p4).
fn number_text(value: i128) -> String {
    match u64::try_from(value) {
        Ok(value) if i64::try_from(value).is_err() => format!("{value}U"),
        Ok(value) => value.to_string(),
        Err(_) => format!("(-{} - 1)", -(value + 1)),
    }
}

fn evaluate(numbers: &[Token], span: Span) -> Outcome<bool> {
    let machine = Machine {
        int_bits: 64,
        long_bits: 64,
        pointer_bytes: 8,
        code_pointer_bytes: 8,
        max_align: 8,
        has_signed_char: true,
        has_short_enums: false,
    };
    let mut tokens = numbers.to_vec();
    let kind = TokenKind::End;
    tokens.push(Token { kind, text: "", span, hidden: 0, starts_line: true, has_space: true });
    let mut parser = Parser::new(&tokens, Unit::new(machine), false);
    match parser.whole_constant() {
        Ok(value) => Ok(value != 0),
        Err(_) => {
            let why = parser.found.into_iter().next();
            let message = "this is not a constant condition";
            let found = Diagnostic::error(codes::PREPROCESSOR, message).at(span, "here");
            Err(Box::new(match why {
                Some(why) => found.help(why.message),
                None => found,
            }))
        }
    }
}
