//! The tokens of emitted C: a lexer with as much of the preprocessor as the emitted text uses.
//!
//! It supports macros without `#` and `##`, conditions over `defined`, names and numbers. Files are read one after the other, in the order in which they
//! include each other; the includes themselves are skipped. Lines that the user wrote (`code c "..."`) are not read: one [`Word::UserCode`] represents them.

use super::NotUnderstood;
use std::collections::BTreeMap;
use std::rc::Rc;

/// A token with its line in `NAME.c`; 0 for the other files.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Token {
    pub(super) word: Word,
    pub(super) line: u32,
}

/// The kind of a token.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Word {
    Name(Rc<str>),
    /// A number, and the minimum number of bits that its suffix requires (16, 32 or 64).
    Number(i128, u8),
    /// A punctuator.
    Sign(&'static str),
    /// A string literal; its text does not matter.
    Text,
    /// User code.
    UserCode,
}

/// The operators and punctuators, longest first.
const SIGNS: [&str; 45] = [
    "...", "<<=", ">>=", "->", "++", "--", "<<", ">>", "<=", ">=", "==", "!=", "&&", "||", "+=",
    "-=", "*=", "/=", "%=", "&=", "|=", "^=", "{", "}", "(", ")", "[", "]", ";", ",", ":", "?",
    ".", "=", "<", ">", "+", "-", "*", "/", "%", "&", "|", "^", "!",
];

#[derive(Debug, Clone)]
struct Macro {
    parameters: Option<Vec<Rc<str>>>,
    body: Vec<Token>,
}

/// Converts files to tokens.
#[derive(Debug, Default)]
pub(super) struct Preprocessor {
    macros: BTreeMap<Rc<str>, Macro>,
    words: Vec<Token>,
    /// For each open `#if`: whether a branch was taken, and whether the current one is read.
    conditions: Vec<(bool, bool)>,
}

impl Preprocessor {
    /// A preprocessor with the macros that a compiler predefines.
    pub(super) fn new(defines: &[&str]) -> Self {
        let mut all = Preprocessor::default();
        for name in defines {
            all.macros.insert(Rc::from(*name), Macro { parameters: None, body: Vec::new() });
        }
        all
    }

    pub(super) fn finish(self) -> Vec<Token> {
        self.words
    }

    /// Reads one more file. `numbered`: tokens carry line numbers of this file; `user` are the ranges of user-written lines.
    pub(super) fn read(
        &mut self,
        text: &str,
        numbered: bool,
        user: &[(u32, u32)],
    ) -> Result<(), NotUnderstood> {
        let mut pending: Vec<Token> = Vec::new();
        let mut in_comment = false;
        let mut ranges = user.iter().peekable();
        for (index, line) in text.lines().enumerate() {
            let number = u32::try_from(index + 1).unwrap_or(u32::MAX);
            let at = if numbered { number } else { 0 };
            while ranges.peek().is_some_and(|(_, last)| *last < number) {
                ranges.next();
            }
            if let Some((first, _)) = ranges.peek()
                && *first <= number
            {
                if *first == number && self.is_read() {
                    pending.push(Token { word: Word::UserCode, line: at });
                }
                continue;
            }
            if !in_comment && let Some(directive) = line.trim_start().strip_prefix('#') {
                let before = std::mem::take(&mut pending);
                self.expand(before)?;
                let directive = directive.split("/*").next().unwrap_or_default().trim();
                self.directive(directive, at)?;
                continue;
            }
            if self.is_read() {
                in_comment = lex(line, at, in_comment, &mut pending)?;
            } else {
                in_comment = lex(line, at, in_comment, &mut Vec::new())?;
            }
        }
        self.expand(pending)
    }

    fn is_read(&self) -> bool {
        self.conditions.iter().all(|(_, read)| *read)
    }

    fn directive(&mut self, text: &str, line: u32) -> Result<(), NotUnderstood> {
        let (word, rest) = text.split_once(char::is_whitespace).unwrap_or((text, ""));
        let rest = rest.trim();
        match word {
            "ifdef" => self.open(self.macros.contains_key(rest)),
            "ifndef" => self.open(!self.macros.contains_key(rest)),
            "if" => {
                let holds = self.condition(rest, line)?;
                self.open(holds);
            }
            "elif" => {
                let holds = self.condition(rest, line)?;
                if let Some((taken, read)) = self.conditions.last_mut() {
                    *read = !*taken && holds;
                    *taken |= holds;
                }
            }
            "else" => {
                if let Some((taken, read)) = self.conditions.last_mut() {
                    *read = !*taken;
                    *taken = true;
                }
            }
            "endif" => {
                self.conditions.pop();
            }
            "define" if self.is_read() => self.define(rest, line)?,
            "undef" if self.is_read() => {
                self.macros.remove(rest);
            }
            "define" | "undef" | "include" | "error" | "pragma" => {}
            other => return Err(NotUnderstood::new(line, format!("the directive `#{other}`"))),
        }
        Ok(())
    }

    fn open(&mut self, holds: bool) {
        self.conditions.push((holds, holds));
    }

    fn define(&mut self, text: &str, line: u32) -> Result<(), NotUnderstood> {
        let end =
            text.find(|c: char| !(c.is_ascii_alphanumeric() || c == '_')).unwrap_or(text.len());
        let (name, rest) = text.split_at(end);
        let (parameters, body) = match rest.strip_prefix('(') {
            Some(inner) => {
                let (list, body) = inner
                    .split_once(')')
                    .ok_or_else(|| NotUnderstood::new(line, format!("the macro `{name}`")))?;
                let list = list.split(',').map(str::trim).filter(|it| !it.is_empty());
                (Some(list.map(Rc::from).collect()), body)
            }
            None => (None, rest),
        };
        let mut words = Vec::new();
        lex(body, line, false, &mut words)?;
        self.macros.insert(Rc::from(name), Macro { parameters, body: words });
        Ok(())
    }

    /// Evaluates a condition of `defined(X)`, `!`, `&&`, `||`, brackets and numbers.
    fn condition(&self, text: &str, line: u32) -> Result<bool, NotUnderstood> {
        let mut words = Vec::new();
        lex(text, line, false, &mut words)?;
        let mut reader = Condition { words: &words, at: 0, macros: &self.macros };
        let value = reader.or();
        if reader.at == words.len() {
            Ok(value)
        } else {
            Err(NotUnderstood::new(line, format!("the condition `{text}`")))
        }
    }

    fn expand(&mut self, words: Vec<Token>) -> Result<(), NotUnderstood> {
        let mut done = Vec::new();
        expand(&self.macros, &words, &mut Vec::new(), &mut done, 0)?;
        self.words.append(&mut done);
        Ok(())
    }
}

struct Condition<'a> {
    words: &'a [Token],
    at: usize,
    macros: &'a BTreeMap<Rc<str>, Macro>,
}

impl Condition<'_> {
    fn eat(&mut self, sign: &str) -> bool {
        let found = matches!(self.words.get(self.at), Some(Token { word: Word::Sign(it), .. }) if *it == sign);
        self.at += usize::from(found);
        found
    }

    fn or(&mut self) -> bool {
        let mut value = self.and();
        while self.eat("||") {
            value |= self.and();
        }
        value
    }

    fn and(&mut self) -> bool {
        let mut value = self.one();
        while self.eat("&&") {
            value &= self.one();
        }
        value
    }

    fn one(&mut self) -> bool {
        if self.eat("!") {
            return !self.one();
        }
        if self.eat("(") {
            let value = self.or();
            self.eat(")");
            return value;
        }
        match self.words.get(self.at).map(|it| it.word.clone()) {
            Some(Word::Name(name)) => {
                self.at += 1;
                if &*name != "defined" {
                    return self.macros.contains_key(&name);
                }
                let bracket = self.eat("(");
                let known = match self.words.get(self.at).map(|it| &it.word) {
                    Some(Word::Name(name)) => self.macros.contains_key(name),
                    _ => false,
                };
                self.at += 1;
                if bracket {
                    self.eat(")");
                }
                known
            }
            Some(Word::Number(value, _)) => {
                self.at += 1;
                value != 0
            }
            Some(Word::Sign(_) | Word::Text | Word::UserCode) | None => false,
        }
    }
}

/// The maximum nesting depth of macro expansions.
const DEPTH: usize = 16;

fn expand(
    macros: &BTreeMap<Rc<str>, Macro>,
    words: &[Token],
    hidden: &mut Vec<Rc<str>>,
    done: &mut Vec<Token>,
    depth: usize,
) -> Result<(), NotUnderstood> {
    let mut at = 0;
    while let Some(token) = words.get(at) {
        at += 1;
        let found = match &token.word {
            Word::Name(name) if !hidden.contains(name) => {
                macros.get(name).map(|it| (name.clone(), it))
            }
            Word::Name(_) | Word::Number(..) | Word::Sign(_) | Word::Text | Word::UserCode => None,
        };
        let Some((name, it)) = found else {
            done.push(token.clone());
            continue;
        };
        if depth >= DEPTH {
            return Err(NotUnderstood::new(token.line, format!("the macro `{name}`")));
        }
        let mut arguments: Vec<Vec<Token>> = Vec::new();
        if let Some(parameters) = &it.parameters {
            if !matches!(words.get(at), Some(Token { word: Word::Sign("("), .. })) {
                done.push(token.clone());
                continue;
            }
            at += 1;
            let mut level = 0_usize;
            arguments.push(Vec::new());
            loop {
                let Some(next) = words.get(at) else {
                    return Err(NotUnderstood::new(token.line, format!("the macro `{name}`")));
                };
                at += 1;
                match &next.word {
                    Word::Sign(")") if level == 0 => break,
                    Word::Sign(",") if level == 0 => {
                        arguments.push(Vec::new());
                        continue;
                    }
                    Word::Sign("(") => level += 1,
                    Word::Sign(")") => level -= 1,
                    _ => {}
                }
                if let Some(last) = arguments.last_mut() {
                    last.push(next.clone());
                }
            }
            if parameters.is_empty() {
                arguments.clear();
            }
        }
        let mut body = Vec::new();
        for part in &it.body {
            let place = match (&part.word, &it.parameters) {
                (Word::Name(word), Some(all)) => all.iter().position(|other| other == word),
                _ => None,
            };
            match place.and_then(|place| arguments.get(place)) {
                Some(argument) => body.extend(argument.iter().cloned()),
                None => body.push(Token { line: token.line, ..part.clone() }),
            }
        }
        hidden.push(name);
        expand(macros, &body, hidden, done, depth + 1)?;
        hidden.pop();
    }
    Ok(())
}

/// The tokens of a line; true if a comment continues on the next line.
fn lex(
    text: &str,
    line: u32,
    mut in_comment: bool,
    out: &mut Vec<Token>,
) -> Result<bool, NotUnderstood> {
    let mut rest = text;
    loop {
        if in_comment {
            match rest.find("*/") {
                Some(end) => {
                    rest = &rest[end + 2..];
                    in_comment = false;
                }
                None => return Ok(true),
            }
        }
        rest = rest.trim_start();
        if rest.is_empty() || rest.starts_with("//") {
            return Ok(false);
        }
        if let Some(after) = rest.strip_prefix("/*") {
            in_comment = true;
            rest = after;
            continue;
        }
        let word_end =
            rest.find(|c: char| !(c.is_ascii_alphanumeric() || c == '_')).unwrap_or(rest.len());
        if word_end > 0 {
            let (word, after) = rest.split_at(word_end);
            rest = after;
            let token = if word.starts_with(|c: char| c.is_ascii_digit()) {
                number(word)
                    .ok_or_else(|| NotUnderstood::new(line, format!("the number `{word}`")))?
            } else {
                Word::Name(Rc::from(word))
            };
            out.push(Token { word: token, line });
            continue;
        }
        if let Some(after) = rest.strip_prefix('"') {
            let end = after.find('"').unwrap_or(after.len());
            rest = after.get(end + 1..).unwrap_or_default();
            out.push(Token { word: Word::Text, line });
            continue;
        }
        if let Some(after) = rest.strip_prefix('~') {
            rest = after;
            out.push(Token { word: Word::Sign("~"), line });
            continue;
        }
        let sign = SIGNS.iter().find(|sign| rest.starts_with(**sign));
        let Some(sign) = sign else {
            return Err(NotUnderstood::new(line, format!("`{rest}`")));
        };
        rest = &rest[sign.len()..];
        out.push(Token { word: Word::Sign(sign), line });
    }
}

fn number(word: &str) -> Option<Word> {
    let digits = word.trim_end_matches(['u', 'U', 'l', 'L']);
    let suffix = word[digits.len()..].to_ascii_lowercase();
    let value = match digits.strip_prefix("0x").or_else(|| digits.strip_prefix("0X")) {
        Some(hex) => i128::from_str_radix(hex, 16).ok()?,
        None => digits.parse().ok()?,
    };
    let bits = match suffix.matches('l').count() {
        0 => 16,
        1 => 32,
        _ => 64,
    };
    Some(Word::Number(value, bits))
}
