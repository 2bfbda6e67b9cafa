//! Macros and their expansion (C99 6.10.3), by the algorithm of Dave Prosser that the standard describes in words: each token knows the macros that it must not
//! invoke again.

use super::lexer::{Token, TokenKind};
use crate::codes;
use grafsynth_ir::diag::counted;
use grafsynth_ir::{Diagnostic, Span};
use std::collections::BTreeMap;

/// The maximum number of tokens that all macros of a unit expand to.
const MAX_EXPANDED: usize = 2_000_000;
/// The maximum number of macros that expand within each other.
const MAX_NESTED: usize = 64;

/// A macro.
#[derive(Debug, Clone)]
pub(crate) struct Macro<'a> {
    /// The names of the parameters; `None` for an object-like macro.
    pub(crate) params: Option<Vec<&'a str>>,
    /// The tokens that replace the macro.
    pub(crate) body: Vec<Token<'a>>,
    /// The location of the definition; `None` for a predefined macro.
    pub(crate) span: Option<Span>,
}

impl Macro<'_> {
    /// True if a second definition with this content is allowed (C99 6.10.3p2).
    pub(crate) fn is_same(&self, other: &Macro) -> bool {
        let words = |it: &Macro| {
            let tokens = it.body.iter().map(|token| token.text.to_owned());
            tokens.collect::<Vec<_>>()
        };
        self.params == other.params && words(self) == words(other)
    }
}

/// All macros.
#[derive(Debug, Default)]
pub(crate) struct Macros<'a> {
    by_name: BTreeMap<&'a str, (u32, Macro<'a>)>,
    n_defined: u32,
    sets: HideSets,
    n_expanded: usize,
}

impl<'a> Macros<'a> {
    pub(crate) fn get(&self, name: &str) -> Option<&Macro<'a>> {
        self.by_name.get(name).map(|(_, it)| it)
    }

    pub(crate) fn define(&mut self, name: &'a str, it: Macro<'a>) {
        self.by_name.insert(name, (self.n_defined, it));
        self.n_defined += 1;
    }

    pub(crate) fn undefine(&mut self, name: &str) {
        self.by_name.remove(name);
    }

    /// The tokens after the expansion of all macros. A macro's arguments must be complete within them.
    pub(crate) fn expand(
        &mut self,
        tokens: &[Token<'a>],
        depth: usize,
    ) -> Result<Vec<Token<'a>>, Box<Diagnostic>> {
        let mut left: Vec<Token<'a>> = tokens.iter().rev().copied().collect();
        let mut done = Vec::with_capacity(tokens.len());
        while let Some(token) = left.pop() {
            let is_free = |(id, _): &&(u32, Macro)| {
                token.kind == TokenKind::Word && !self.sets.has(token.hidden, *id)
            };
            let Some((id, it)) = self.by_name.get(token.text).filter(is_free) else {
                done.push(token);
                continue;
            };
            let (id, is_call) = (*id, it.params.is_some());
            if is_call && !left.last().is_some_and(|next| next.is("(")) {
                done.push(token);
                continue;
            }
            let (body, hidden) = if is_call {
                self.call(token, &mut left, depth)?
            } else {
                let here = |one: &Token<'a>| Token { span: token.span, starts_line: false, ..*one };
                (it.body.iter().map(here).collect(), token.hidden)
            };
            self.n_expanded += body.len() + 1;
            let hidden = self.sets.with(hidden, id);
            if self.n_expanded > MAX_EXPANDED {
                let message = format!("macros expand to more than {MAX_EXPANDED} tokens");
                return limit(message, token.span);
            }
            if self.sets.len(hidden) > MAX_NESTED {
                let message = format!("macros are nested more than {MAX_NESTED} deep");
                return limit(message, token.span);
            }
            for (at, mut one) in body.into_iter().enumerate().rev() {
                one.hidden = self.sets.union(one.hidden, hidden);
                one.has_space |= at == 0 && token.has_space;
                left.push(one);
            }
        }
        Ok(done)
    }

    /// The body of a function-like macro with its arguments, and the macros that are hidden from it.
    fn call(
        &mut self,
        name: Token<'a>,
        left: &mut Vec<Token<'a>>,
        depth: usize,
    ) -> Result<(Vec<Token<'a>>, u32), Box<Diagnostic>> {
        if depth > MAX_NESTED {
            let message = format!("macros are nested more than {MAX_NESTED} deep");
            return limit(message, name.span);
        }
        let (arguments, close) = arguments(name, left)?;
        let Some((_, it)) = self.by_name.get(name.text) else { return Ok((Vec::new(), 0)) };
        let it = it.clone();
        let params = it.params.as_deref().unwrap_or_default();
        let is_empty =
            params.is_empty() && matches!(arguments.as_slice(), [only] if only.is_empty());
        if arguments.len() != params.len() && !is_empty {
            let (wanted, got) = (params.len(), arguments.len());
            let message = format!(
                "the macro `{}` takes {}, found {got}",
                name.text,
                counted(wanted, "argument", "arguments")
            );
            return Err(Box::new(
                Diagnostic::error(codes::PREPROCESSOR, message).at(name.span, "used here"),
            ));
        }
        let mut expanded: Vec<Option<Vec<Token<'a>>>> = vec![None; params.len()];
        let mut body = Vec::with_capacity(it.body.len());
        for token in &it.body {
            let Some(param) = params.iter().position(|param| *param == token.text) else {
                body.push(Token { span: name.span, starts_line: false, ..*token });
                continue;
            };
            let value = match &expanded[param] {
                Some(value) => value,
                None => {
                    let value = self.expand(&arguments[param], depth + 1)?;
                    expanded[param].insert(value)
                }
            };
            self.n_expanded += value.len();
            if self.n_expanded > MAX_EXPANDED {
                let message = format!("macros expand to more than {MAX_EXPANDED} tokens");
                return limit(message, name.span);
            }
            body.extend(value);
        }
        Ok((body, self.sets.intersection(name.hidden, close.hidden)))
    }
}

fn limit<T>(message: String, span: Span) -> Result<T, Box<Diagnostic>> {
    Err(Box::new(Diagnostic::error(codes::LIMIT, message).at(span, "by this macro")))
}

/// Takes the arguments of a macro invocation, including the parentheses.
#[allow(clippy::type_complexity, reason = "the arguments, and the closing bracket")]
fn arguments<'a>(
    name: Token<'a>,
    left: &mut Vec<Token<'a>>,
) -> Result<(Vec<Vec<Token<'a>>>, Token<'a>), Box<Diagnostic>> {
    let mut arguments = vec![Vec::new()];
    let mut depth = 0_usize;
    while let Some(token) = left.pop() {
        if token.is("(") {
            depth += 1;
            if depth == 1 {
                continue;
            }
        } else if token.is(")") {
            depth -= 1;
            if depth == 0 {
                return Ok((arguments, token));
            }
        } else if token.is(",") && depth == 1 {
            arguments.push(Vec::new());
            continue;
        }
        if let Some(last) = arguments.last_mut() {
            last.push(token);
        }
    }
    let message = format!("expected `)` after the arguments of the macro `{}`", name.text);
    Err(Box::new(Diagnostic::error(codes::PREPROCESSOR, message).at(name.span, "used here")))
}

/// Hide sets of macros; each set is stored once, and set 0 is empty.
#[derive(Debug, Default)]
struct HideSets {
    sets: Vec<Vec<u32>>,
    ids: BTreeMap<Vec<u32>, u32>,
    unions: BTreeMap<(u32, u32), u32>,
}

impl HideSets {
    fn members(&self, set: u32) -> &[u32] {
        match set {
            0 => &[],
            _ => &self.sets[set as usize - 1],
        }
    }

    fn has(&self, set: u32, id: u32) -> bool {
        self.members(set).binary_search(&id).is_ok()
    }

    fn len(&self, set: u32) -> usize {
        self.members(set).len()
    }

    fn with(&mut self, set: u32, id: u32) -> u32 {
        let mut members = self.members(set).to_vec();
        if let Err(at) = members.binary_search(&id) {
            members.insert(at, id);
        }
        self.intern(members)
    }

    fn union(&mut self, a: u32, b: u32) -> u32 {
        if a == b || b == 0 {
            return a;
        }
        if a == 0 {
            return b;
        }
        if let Some(known) = self.unions.get(&(a, b)) {
            return *known;
        }
        let mut members = [self.members(a), self.members(b)].concat();
        members.sort_unstable();
        members.dedup();
        let set = self.intern(members);
        self.unions.insert((a, b), set);
        set
    }

    fn intersection(&mut self, a: u32, b: u32) -> u32 {
        if a == b {
            return a;
        }
        let members = self.members(a).iter().filter(|id| self.has(b, **id)).copied().collect();
        self.intern(members)
    }

    fn intern(&mut self, members: Vec<u32>) -> u32 {
        if members.is_empty() {
            return 0;
        }
        if let Some(id) = self.ids.get(&members) {
            return *id;
        }
        self.sets.push(members.clone());
        let id = u32::try_from(self.sets.len()).unwrap_or(u32::MAX);
        self.ids.insert(members, id);
        id
    }
}
