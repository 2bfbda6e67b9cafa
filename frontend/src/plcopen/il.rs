//! Translates instruction lists to statements: each instruction reads and changes an accumulator.

use super::reader::Unit;
use crate::codes;
use crate::st::ast::{Arg, Expr, ExprKind, Op, Stmt, StmtKind};
use crate::st::lexer::{Kind, LexError, Places, Token, tokens};
use crate::st::parse_expr::{duration, number};
use crate::st::symbol::{Ident, Symbol, spells};
use crate::xml::Mapped;

/// Maximum number of consecutive fields in one operand.
const MAX_FIELDS: u32 = 64;
/// Maximum number of nodes in all copies of the accumulator: each ST instruction copies its value and keeps it.
const MAX_COPIED: usize = 200_000;

struct List<'a> {
    mapped: &'a Mapped<'a>,
    tokens: Vec<Token>,
    at: usize,
}

impl List<'_> {
    fn peek(&self) -> Token {
        let end = self.mapped.text.len();
        self.tokens.get(self.at).copied().unwrap_or(Token { kind: Kind::End, start: end, end })
    }

    fn slice(&self, token: Token) -> &str {
        self.mapped.text.get(token.start..token.end).unwrap_or("")
    }

    fn span(&self, token: Token) -> grafsynth_ir::Span {
        Places::Mapped(self.mapped).span(token.start, token.end)
    }

    /// Whether a token is on the same line as the one before it.
    fn on_line(&self, before: usize, token: Token) -> bool {
        token.kind != Kind::End
            && !self.mapped.text.get(before..token.start).unwrap_or("\n").contains('\n')
    }

    /// Parses a variable, field or literal.
    fn operand(&mut self) -> Option<Expr> {
        let mut token = self.peek();
        // The type prefix is redundant: `INT#5`, `BOOL#TRUE`.
        let mut is_bool = false;
        if token.kind == Kind::Typed {
            is_bool = spells(self.slice(token), "BOOL#");
            self.at += 1;
            token = self.peek();
        }
        let negative = token.kind == Kind::Minus;
        if negative {
            self.at += 1;
            token = self.peek();
        }
        let span = self.span(token);
        let text = self.slice(token).to_owned();
        let kind = match token.kind {
            Kind::Number => {
                let value = number(&text)?;
                match is_bool {
                    true => ExprKind::Bool(value != 0),
                    false => ExprKind::Int(if negative { -value } else { value }),
                }
            }
            Kind::Time => ExprKind::Time(duration(text.split_once('#')?.1)?),
            Kind::Word if spells(&text, "TRUE") => ExprKind::Bool(true),
            Kind::Word if spells(&text, "FALSE") => ExprKind::Bool(false),
            Kind::Word => ExprKind::Name(Ident::new(text, span)),
            Kind::Address => ExprKind::Address(Ident::new(text, span)),
            _ => return None,
        };
        self.at += 1;
        let mut expr = Expr::new(kind, span);
        let mut levels = 0;
        while self.peek().kind == Kind::Dot {
            levels += 1;
            if levels > MAX_FIELDS {
                return None;
            }
            self.at += 1;
            let token = self.peek();
            if token.kind != Kind::Word {
                return None;
            }
            let field = Ident::new(self.slice(token), self.span(token));
            let span = expr.span.to(field.span);
            self.at += 1;
            expr = Expr::new(ExprKind::Field(Box::new(expr), field), span);
        }
        Some(expr)
    }

    /// Skips the rest of the line of a token.
    fn skip_line(&mut self, token: Token) {
        while self.on_line(token.end, self.peek()) {
            self.at += 1;
        }
    }

    /// Parses `(IN := a, Q => b)` after an instance, or nothing.
    fn arguments(&mut self, unit: &mut Unit) -> Vec<Arg> {
        let mut arguments = Vec::new();
        if self.peek().kind != Kind::Open {
            return arguments;
        }
        let open = self.peek();
        self.at += 1;
        loop {
            let name = self.peek();
            match name.kind {
                Kind::Close => {
                    self.at += 1;
                    return arguments;
                }
                Kind::Comma => {
                    self.at += 1;
                    continue;
                }
                Kind::End => {
                    let span = self.span(open);
                    unit.mistake(
                        codes::ST_UNEXPECTED,
                        "unclosed parenthesis",
                        span,
                        "close it with `)`",
                    );
                    return arguments;
                }
                _ => {}
            }
            self.at += 1;
            let sign = self.peek().kind;
            let is_argument = name.kind == Kind::Word && matches!(sign, Kind::Assign | Kind::Arrow);
            if is_argument {
                self.at += 1;
                let named = Some(Ident::new(self.slice(name), self.span(name)));
                if let Some(value) = self.operand() {
                    let is_output = sign == Kind::Arrow;
                    arguments.push(Arg { name: named, value, is_output, is_negated: false });
                    continue;
                }
            }
            let (span, text) = (self.span(name), self.slice(name).to_owned());
            unit.refuse(
                format!("the argument `{text}` of CAL"),
                span,
                "write `NAME := value`, with a variable or a constant",
            );
            while !matches!(self.peek().kind, Kind::Comma | Kind::Close | Kind::End) {
                self.at += 1;
            }
        }
    }
}

/// A value, with the height of its expression tree and the number of nodes in it.
#[derive(Debug, Clone)]
struct Held {
    expr: Expr,
    height: u32,
    size: usize,
}

impl Held {
    /// An operand, which has only a few nodes.
    fn operand(expr: Expr) -> Self {
        Held { expr, height: 1, size: 1 }
    }

    fn not(self, span: grafsynth_ir::Span) -> Self {
        let expr = Expr::new(ExprKind::Not(Box::new(self.expr)), span);
        Held { expr, height: self.height + 1, size: self.size + 1 }
    }
}

/// Applies an operator to the accumulator and its operand. AND and OR extend a list of the same kind, which may have any length.
fn combine(word: &str, left: Held, right: Held) -> Option<Held> {
    let span = left.expr.span.to(right.expr.span);
    let (base, is_negated) = match word {
        "ANDN" | "ORN" | "XORN" => (&word[..word.len() - 1], true),
        "&" => ("AND", false),
        "&N" => ("AND", true),
        other => (other, false),
    };
    let right = if is_negated { right.not(span) } else { right };
    let size = left.size + right.size + 1;
    let (flat, apart) = (left.height.max(right.height + 1), left.height.max(right.height) + 1);
    let (kind, height) = match (base, left.expr.kind) {
        ("AND", ExprKind::And(mut all)) => {
            all.push(right.expr);
            (ExprKind::And(all), flat)
        }
        ("OR", ExprKind::Or(mut all)) => {
            all.push(right.expr);
            (ExprKind::Or(all), flat)
        }
        (base, kind) => {
            let left = Expr::new(kind, left.expr.span);
            let kind = match base {
                "AND" => ExprKind::And(vec![left, right.expr]),
                "OR" => ExprKind::Or(vec![left, right.expr]),
                base => ExprKind::Binary(operator(base)?, Box::new(left), Box::new(right.expr)),
            };
            (kind, apart)
        }
    };
    Some(Held { expr: Expr::new(kind, span), height, size })
}

fn operator(word: &str) -> Option<Op> {
    Some(match word {
        "XOR" => Op::Xor,
        "ADD" => Op::Add,
        "SUB" => Op::Sub,
        "MUL" => Op::Mul,
        "DIV" => Op::Div,
        "MOD" => Op::Mod,
        "GT" => Op::Gt,
        "GE" => Op::Ge,
        "EQ" => Op::Eq,
        "NE" => Op::Ne,
        "LE" => Op::Le,
        "LT" => Op::Lt,
        _ => return None,
    })
}

/// Whether an expression reads a variable, whose name is in capitals.
fn mentions(expr: &Expr, root: &str) -> bool {
    matches!(&expr.kind, ExprKind::Name(name) if name.id == *root)
        || expr.children().into_iter().any(|one| mentions(one, root))
}

/// The statements of an instruction list. Records unsupported parts. No value exceeds `limit` levels.
pub(super) fn statements(mapped: &Mapped<'_>, limit: u32, unit: &mut Unit) -> Vec<Stmt> {
    let read = tokens(&mapped.text);
    for error in &read.errors {
        let (start, end, message, help) = match error {
            LexError::Character(start, end) => {
                let shown = mapped.text.get(*start..*end).unwrap_or("").escape_debug();
                (*start, *end, format!("unexpected character `{shown}`"), "remove it".to_owned())
            }
            LexError::Unclosed(start, end, what) => {
                (*start, *end, format!("unclosed {what}"), "close it".to_owned())
            }
            LexError::Foreign(start, end, instead) => {
                let shown = mapped.text.get(*start..*end).unwrap_or("");
                let message = format!("unknown operator `{shown}`");
                (*start, *end, message, format!("write `{instead}`"))
            }
        };
        let span = Places::Mapped(mapped).span(start, end);
        unit.mistake(codes::ST_UNEXPECTED, message, span, &help);
    }
    let mut list = List { mapped, tokens: read.tokens, at: 0 };
    let mut out = Vec::new();
    let mut accumulator: Option<Held> = None;
    let mut n_copied = 0;
    // Operations that wait for a closing parenthesis: the operator and the value before it.
    let mut waiting: Vec<(Symbol, Option<Held>)> = Vec::new();
    loop {
        let token = list.peek();
        let span = list.span(token);
        if accumulator.as_ref().is_some_and(|held| held.height > limit) {
            accumulator = None;
            unit.refuse(
                format!("an instruction list with a value of more than {limit} levels"),
                span,
                "store parts of it in variables",
            );
        }
        match token.kind {
            Kind::End if waiting.is_empty() => return out,
            Kind::End => {
                unit.mistake(
                    codes::ST_UNEXPECTED,
                    "unclosed parenthesis",
                    span,
                    "close it with `)`",
                );
                return out;
            }
            Kind::Close => {
                list.at += 1;
                let Some((word, before)) = waiting.pop() else {
                    unit.mistake(codes::ST_UNEXPECTED, "unmatched `)`", span, "remove it");
                    continue;
                };
                accumulator = match (before, accumulator.take()) {
                    (Some(before), Some(inside)) => combine(&word, before, inside),
                    (None, inside) if word == "LD" => inside,
                    (None, _) | (Some(_), None) => None,
                };
                if accumulator.is_none() {
                    unit.mistake(
                        codes::ST_UNEXPECTED,
                        format!("the instruction {word} with a parenthesis needs two values"),
                        span,
                        "load a value before and inside the parenthesis",
                    );
                }
                continue;
            }
            Kind::Word | Kind::Ampersand => {}
            _ => {
                let sign = list.slice(token).to_owned();
                unit.refuse(
                    format!("the sign `{sign}` in an instruction list"),
                    span,
                    "write one instruction per line, followed by one operand",
                );
                list.at += 1;
                continue;
            }
        }
        let word = Symbol::of(list.slice(token));
        list.at += 1;
        let next = list.peek();
        if next.kind == Kind::Colon {
            unit.refuse("a label in an instruction list", span, "use structured text with IF");
            list.at += 1;
            continue;
        }
        if list.on_line(token.end, next) && next.kind == Kind::Open && word != "CAL" {
            list.at += 1;
            waiting.push((word, accumulator.take()));
            // `AND( a` begins with a load.
            if list.on_line(next.end, list.peek()) {
                accumulator = list.operand().map(Held::operand);
            }
            continue;
        }
        let operand = |list: &mut List<'_>| {
            let is_here = list.on_line(token.end, list.peek());
            if is_here { list.operand().map(Held::operand) } else { None }
        };
        match word.as_str() {
            "LD" | "LDN" => {
                accumulator = operand(&mut list);
                if accumulator.is_none() {
                    unit.mistake(
                        codes::ST_UNEXPECTED,
                        format!("the instruction {word} needs a variable or a constant"),
                        span,
                        "write the operand after the instruction",
                    );
                    list.skip_line(token);
                }
                if word == "LDN" {
                    accumulator = accumulator.take().map(|value| value.not(span));
                }
            }
            "NOT" if accumulator.is_none() => {
                unit.mistake(
                    codes::ST_UNEXPECTED,
                    "the instruction NOT needs a value",
                    span,
                    "load a value first",
                );
            }
            "NOT" => {
                accumulator = accumulator.take().map(|value| value.not(span));
            }
            "ST" | "STN" | "S" | "R" => {
                let (Some(held), Some(target)) = (accumulator.take(), operand(&mut list)) else {
                    unit.mistake(
                        codes::ST_UNEXPECTED,
                        format!("the instruction {word} needs a value and a variable"),
                        span,
                        "load a value first, and write the variable after the instruction",
                    );
                    list.skip_line(token);
                    continue;
                };
                n_copied += held.size;
                if n_copied > MAX_COPIED {
                    unit.refuse(
                        "an instruction list that stores a long value too often",
                        span,
                        "load the variable that holds the value",
                    );
                    return out;
                }
                let target = target.expr;
                let assign =
                    |value| Stmt { kind: StmtKind::Assign { target: target.clone(), value }, span };
                // The accumulator keeps its value. If the value was computed here, the variable replaces it.
                let is_changed = target.root().is_some_and(|root| mentions(&held.expr, &root.id));
                let value = held.expr.clone();
                accumulator = match word.as_str() {
                    _ if !is_changed => Some(held),
                    "ST" => Some(Held::operand(target.clone())),
                    "STN" => Some(Held::operand(target.clone()).not(span)),
                    _ => None,
                };
                match word.as_str() {
                    "ST" => out.push(assign(value)),
                    "STN" => out.push(assign(Expr::new(ExprKind::Not(Box::new(value)), span))),
                    which => {
                        let set = assign(Expr::new(ExprKind::Bool(which == "S"), span));
                        let kind =
                            StmtKind::If { arms: vec![(value, vec![set])], otherwise: Vec::new() };
                        out.push(Stmt { kind, span });
                    }
                }
            }
            "CAL" => {
                let Some(Held { expr: target, .. }) = operand(&mut list) else {
                    unit.mistake(
                        codes::ST_UNEXPECTED,
                        "the instruction CAL needs an instance",
                        span,
                        "write the instance name after CAL",
                    );
                    list.skip_line(token);
                    continue;
                };
                let arguments = list.arguments(unit);
                out.push(Stmt { kind: StmtKind::Call { target, arguments }, span });
            }
            _ => {
                let right = operand(&mut list);
                accumulator = match (accumulator.take(), right) {
                    (Some(left), Some(right)) => combine(&word, left, right),
                    _ => None,
                };
                if accumulator.is_none() {
                    unit.refuse(format!("the instruction {word}"), span, "use structured text");
                    list.skip_line(token);
                }
            }
        }
    }
}
