//! Translates instruction lists to statements: each instruction reads and changes an accumulator.
//!
//! Operands and the arguments of `CAL` are expressions of structured text on the line of the instruction, and the same parser reads them.

use grafsynth_ir::Span;

use crate::codes;
use crate::st::ast::{Expr, ExprKind, Op, Refusal, Stmt, StmtKind};
use crate::st::lexer::{Kind, Token};
use crate::st::parse::{Parse, Parser};
use crate::st::parse_expr::{Infix, joined};
use crate::st::symbol::{Symbol, spells};

/// Maximum number of nodes in all copies of the accumulator: each ST instruction copies its value and keeps it.
const MAX_COPIED: usize = 200_000;

/// A value, with the height of its expression tree and the number of nodes in it.
#[derive(Debug, Clone)]
struct Held {
    expr: Expr,
    height: u32,
    size: usize,
}

impl Held {
    fn not(self, span: Span) -> Self {
        let expr = Expr::new(ExprKind::Not(Box::new(self.expr)), span);
        Held { expr, height: self.height + 1, size: self.size + 1 }
    }

    /// Applies an operator to the accumulator and its operand. AND and OR extend a list of the same kind, which may have any length.
    fn combined(self, op: Infix, right: Held) -> Self {
        let is_flat = matches!(
            (op, &self.expr.kind),
            (Infix::And, ExprKind::And(_)) | (Infix::Or, ExprKind::Or(_))
        );
        let above = u32::from(!is_flat);
        let height = (self.height + above).max(right.height + 1);
        let size = self.size + right.size + 1;
        Held { expr: joined(op, self.expr, right.expr, is_flat), height, size }
    }
}

/// The operator of an instruction, and whether the instruction negates its operand.
fn operator(word: &str) -> Option<(Infix, bool)> {
    let (base, is_negated) = match word {
        "ANDN" | "ORN" | "XORN" => (&word[..word.len() - 1], true),
        _ => (word, false),
    };
    let op = match base {
        "AND" | "&" => Infix::And,
        "OR" => Infix::Or,
        _ => Infix::Op(Op::named(base).filter(|op| *op != Op::Power)?),
    };
    Some((op, is_negated))
}

struct List<'l, 'p> {
    parser: &'l mut Parser<'p>,
    out: Vec<Stmt>,
    accumulator: Option<Held>,
    /// Operations that wait for a closing parenthesis: the instruction and the value before it.
    waiting: Vec<(Symbol, Option<Held>)>,
    n_copied: usize,
}

/// The statements of an instruction list. Records unsupported parts. No value exceeds the nesting limit of the parser.
pub(super) fn statements(parser: &mut Parser<'_>) -> Vec<Stmt> {
    let (out, waiting) = (Vec::new(), Vec::new());
    let mut list = List { parser, out, accumulator: None, waiting, n_copied: 0 };
    while list.parser.kind(0) != Kind::End && list.n_copied <= MAX_COPIED {
        let token = list.parser.advance();
        list.limit(token);
        match token.kind {
            Kind::Close => list.close(token),
            Kind::Word | Kind::Ampersand => list.instruction(token),
            _ => {
                let sign = list.parser.slice(token);
                let what = format!("the sign `{sign}` in an instruction list");
                let help = "write one instruction per line, followed by one operand";
                list.parser.refuse(what, list.parser.span(token), help);
            }
        }
    }
    if !list.waiting.is_empty() {
        list.mistake("unclosed parenthesis", list.parser.here(), "close it with `)`");
    }
    list.out
}

impl List<'_, '_> {
    fn mistake(&mut self, message: impl Into<String>, span: Span, help: &str) {
        if self.parser.refused.len() < 10_000 {
            let refusal = Refusal::mistake(codes::ST_UNEXPECTED, message, span, help);
            self.parser.refused.push(refusal);
        }
    }

    /// Drops a value whose expression tree is too deep for the recursion of later passes.
    fn limit(&mut self, token: Token) {
        let limit = self.parser.limit;
        if self.accumulator.take_if(|held| held.height > limit).is_some() {
            let what = format!("an instruction list with a value of more than {limit} levels");
            self.parser.refuse(what, self.parser.span(token), "store parts of it in variables");
        }
    }

    /// Ends an operation that began with an opening parenthesis, such as `AND( .. )`.
    fn close(&mut self, token: Token) {
        let span = self.parser.span(token);
        let Some((word, before)) = self.waiting.pop() else {
            return self.mistake("unmatched `)`", span, "remove it");
        };
        self.accumulator = match (before, self.accumulator.take()) {
            (Some(before), Some(inside)) => operator(&word).map(|(op, is_negated)| {
                before.combined(op, if is_negated { inside.not(span) } else { inside })
            }),
            (None, inside) if word == "LD" => inside,
            (None, _) | (Some(_), None) => None,
        };
        if self.accumulator.is_none() {
            let message = format!("the instruction {word} with a parenthesis needs two values");
            self.mistake(message, span, "load a value before and inside the parenthesis");
        }
    }

    /// Whether two tokens are on the same line.
    fn on_line(&self, first: Token, second: Token) -> bool {
        let between = self.parser.text.get(first.end..second.start).unwrap_or("\n");
        second.kind != Kind::End && !between.contains('\n')
    }

    fn skip_line(&mut self, mut token: Token) {
        while self.on_line(token, self.parser.peek(0)) {
            token = self.parser.advance();
        }
    }

    /// Parses the operand of the instruction at `token`, if there is one.
    fn operand(&mut self, token: Token) -> Parse<Option<Held>> {
        let is_sign = |one: &Token| {
            matches!(one.kind, Kind::Plus | Kind::Minus | Kind::Exclamation)
                || spells(self.parser.slice(*one), "NOT")
        };
        let first = (0..).map(|ahead| self.parser.peek(ahead)).find(|one| !is_sign(one));
        if !first.is_some_and(|first| self.on_line(token, first)) {
            return Ok(None);
        }
        let before = self.parser.at;
        let expr = self.parser.prefix().inspect_err(|_| self.skip_line(token))?;
        Ok(Some(Held { expr, height: self.parser.height, size: self.parser.at - before }))
    }

    fn instruction(&mut self, token: Token) {
        let word = Symbol::of(self.parser.slice(token));
        let (next, span) = (self.parser.peek(0), self.parser.span(token));
        if next.kind == Kind::Colon {
            let help = "use structured text with IF";
            self.parser.refuse("a label in an instruction list", span, help);
            self.parser.advance();
            return;
        }
        if self.on_line(token, next) && next.kind == Kind::Open && word != "CAL" {
            self.parser.advance();
            self.waiting.push((word, self.accumulator.take()));
            // `AND( a` begins with a load.
            self.accumulator = self.operand(next).ok().flatten();
            return;
        }
        let missing = match word.as_str() {
            "NOT" => {
                self.accumulator = self.accumulator.take().map(|value| value.not(span));
                self.accumulator.is_none().then_some(("a value", "load a value first"))
            }
            "LD" | "LDN" => self.load(token, word == "LDN"),
            "ST" | "STN" | "S" | "R" => self.store(token, &word),
            "CAL" => self.call(token),
            _ => self.operate(token, &word),
        };
        if let Some((what, help)) = missing {
            self.mistake(format!("the instruction {word} needs {what}"), span, help);
            self.skip_line(token);
        }
    }

    // Each instruction method returns the missing part and the help text.

    fn load(&mut self, token: Token, is_negated: bool) -> Option<(&'static str, &'static str)> {
        self.accumulator = self.operand(token).ok()?;
        let Some(value) = self.accumulator.take() else {
            return Some(("a variable or a constant", "write the operand after the instruction"));
        };
        let span = self.parser.span(token);
        self.accumulator = Some(if is_negated { value.not(span) } else { value });
        None
    }

    fn operate(&mut self, token: Token, word: &Symbol) -> Option<(&'static str, &'static str)> {
        let left = self.accumulator.take();
        let Some((op, is_negated)) = operator(word) else {
            let what = format!("the instruction {word}");
            self.parser.refuse(what, self.parser.span(token), "use structured text");
            self.skip_line(token);
            return None;
        };
        let (Some(left), Some(right)) = (left, self.operand(token).ok()?) else {
            let help = "load a value first, and write the operand after the instruction";
            return Some(("two values", help));
        };
        let right = if is_negated { right.not(self.parser.span(token)) } else { right };
        self.accumulator = Some(left.combined(op, right));
        None
    }

    fn store(&mut self, token: Token, word: &str) -> Option<(&'static str, &'static str)> {
        let span = self.parser.span(token);
        let held = self.accumulator.take();
        let (Some(held), Some(target)) = (held, self.operand(token).ok()?) else {
            let help = "load a value first, and write the variable after the instruction";
            return Some(("a value and a variable", help));
        };
        self.n_copied += held.size;
        if self.n_copied > MAX_COPIED {
            let what = "an instruction list that stores a long value too often";
            self.parser.refuse(what, span, "load the variable that holds the value");
            return None;
        }
        let assign = |value| StmtKind::Assign { target: target.expr.clone(), value };
        let value = held.expr.clone();
        let kind = match word {
            "ST" => assign(value),
            "STN" => assign(Expr::new(ExprKind::Not(Box::new(value)), span)),
            _ => {
                let set = assign(Expr::new(ExprKind::Bool(word == "S"), span));
                let arms = vec![(value, vec![Stmt { kind: set, span }])];
                StmtKind::If { arms, otherwise: Vec::new() }
            }
        };
        self.out.push(Stmt { kind, span });
        // The accumulator keeps its value. If the value is computed from the assigned variable, it can only be read from that variable now.
        let is_changed = target.expr.root().is_some_and(|root| held.expr.reads(&root.id));
        self.accumulator = match word {
            _ if !is_changed => Some(held),
            "ST" => Some(target),
            "STN" => Some(target.not(span)),
            _ => None,
        };
        None
    }

    fn call(&mut self, token: Token) -> Option<(&'static str, &'static str)> {
        let span = self.parser.span(token);
        let Some(target) = self.operand(token).ok()? else {
            return Some(("an instance", "write the instance name after CAL"));
        };
        let (target, arguments) = match target.expr {
            Expr { kind: ExprKind::Call(name, arguments), .. } => (Expr::name(name), arguments),
            target if self.parser.kind(0) == Kind::Open => (target, self.parser.arguments().ok()?),
            target => (target, Vec::new()),
        };
        self.out.push(Stmt { kind: StmtKind::Call { target, arguments }, span });
        None
    }
}
