//! Expressions of SCXML over integers and Booleans: the common subset of ECMAScript and C89. Unsupported parts are reported with their
//! location.
//!
//! The expressions are parsed here without types. [`super::values`] infers numbers and Booleans and turns the tree into chart
//! expressions.

use grafsynth_ir::Span;
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::expr::{ArithOp, CompareOp};

use super::refuse;
use crate::codes;
use crate::xml::Mapped;

/// The help text for a number that does not fit.
const TOO_LARGE: &str = "write a number from -2147483648 to 2147483647";

/// The data model of a document, which decides the expression syntax.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Language {
    /// `null`: only `In('s')`.
    Null,
    /// `ecmascript`, also the default.
    Ecmascript,
    /// `c89`.
    C89,
}

/// A parsed expression.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Ast {
    pub(super) kind: AstKind,
    pub(super) span: Span,
    /// Height of the tree.
    depth: u32,
}

/// The kinds of expressions.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum AstKind {
    Bool(bool),
    Int(i64),
    /// A data element, or the variable of a loop.
    Name(String),
    /// `list[i]`.
    Element(String, Box<Ast>),
    /// `In('s')`: the identifier of a state and its span.
    In(String, Span),
    /// `[1, 2, 3]`: only in the declaration of an array or in a loop.
    Array(Vec<Ast>),
    Not(Box<Ast>),
    Neg(Box<Ast>),
    And(Vec<Ast>),
    Or(Vec<Ast>),
    Compare(CompareOp, Box<Ast>, Box<Ast>),
    Arith(ArithOp, Box<Ast>, Box<Ast>),
    /// Bit operators, which have 32 bits; `~a` is `a ^ -1`.
    Bitwise(BitOp, Box<Ast>, Box<Ast>),
    /// `c ? a : b`.
    Choice(Box<Ast>, Box<Ast>, Box<Ast>),
}

/// Parses the whole text as one expression.
///
/// # Errors
/// Returns a finding for the first part that is not an expression of integers and Booleans.
pub(super) fn parse(
    text: &Mapped<'_>,
    language: Language,
    nesting: u32,
) -> Result<Ast, Box<Diagnostic>> {
    let mut parser = Parser { text, language, nesting, at: 0, depth: 0, divisions: None };
    parser.blanks();
    if parser.is_end() {
        return Err(parser.error(parser.here(), "missing expression", None));
    }
    let ast = parser.choice()?;
    parser.blanks();
    if parser.is_end() {
        return Ok(ast);
    }
    Err(parser.unexpected())
}

/// Parses the target of an assignment: a name or an array element.
///
/// # Errors
/// If the text is neither of these.
pub(super) fn location(
    text: &Mapped<'_>,
    language: Language,
    nesting: u32,
) -> Result<(String, Option<Ast>), Box<Diagnostic>> {
    let refused = |span: Span| {
        Box::new(
            Diagnostic::error(codes::SCXML_LOCATION, format!("`{}` cannot be assigned", text.text))
                .at(span, "")
                .help("write the name of a data element, or an array element such as `list[0]`"),
        )
    };
    let mut parser = Parser { text, language, nesting, at: 0, depth: 0, divisions: None };
    parser.blanks();
    if !parser.peek().is_some_and(is_start) {
        return Err(refused(text.whole()));
    }
    match parser.choice() {
        Ok(Ast { kind: AstKind::Name(name), .. }) if parser.ends() => Ok((name, None)),
        Ok(Ast { kind: AstKind::Element(name, index), .. }) if parser.ends() => {
            Ok((name, Some(*index)))
        }
        Ok(_) => Err(refused(text.whole())),
        Err(finding) if finding.code == codes::SCXML_EXPRESSION => Err(refused(text.whole())),
        Err(finding) => Err(finding),
    }
}

fn is_start(c: char) -> bool {
    unicode_ident::is_xid_start(c) || c == '_' || c == '$'
}

fn is_continue(c: char) -> bool {
    unicode_ident::is_xid_continue(c) || c == '$'
}

struct Parser<'a, 't> {
    text: &'a Mapped<'t>,
    language: Language,
    nesting: u32,
    at: usize,
    /// The current nesting depth.
    depth: u32,
    /// Directly inside `Math.trunc(..)`: the number of divisions so far; `None` elsewhere, where a division could give a fraction.
    divisions: Option<u32>,
}

/// The bit operators `& | ^ << >> >>>`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum BitOp {
    And,
    Or,
    Xor,
    Shl,
    Shr,
    UnsignedShr,
}

/// Binary operators.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Operator {
    Or,
    And,
    Compare(CompareOp),
    Arith(ArithOp),
    Bitwise(BitOp),
}

type Parse<T = Ast> = Result<T, Box<Diagnostic>>;

impl Parser<'_, '_> {
    fn rest(&self) -> &str {
        self.text.text.get(self.at..).unwrap_or_default()
    }

    fn peek(&self) -> Option<char> {
        self.rest().chars().next()
    }

    fn is_end(&self) -> bool {
        self.rest().is_empty()
    }

    fn ends(&mut self) -> bool {
        self.blanks();
        self.is_end()
    }

    fn blanks(&mut self) {
        let rest = self.rest();
        self.at += rest.len() - rest.trim_start().len();
    }

    fn here(&self) -> Span {
        let length = self.peek().map_or(0, char::len_utf8);
        if length == 0 {
            return self.text.whole();
        }
        self.text.span(self.at..self.at + length)
    }

    fn error(&self, span: Span, message: &str, help: Option<&str>) -> Box<Diagnostic> {
        let finding = Diagnostic::error(codes::SCXML_EXPRESSION, message).at(span, "");
        Box::new(match help {
            Some(help) => finding.help(help),
            None => finding,
        })
    }

    /// The finding for an unexpected text at this position.
    fn unexpected(&mut self) -> Box<Diagnostic> {
        let start = self.at;
        let span = self.here();
        let Some(first) = self.peek() else {
            return self.error(
                span,
                "the expression ends too early",
                Some("write the operand after its last operator, or remove that operator"),
            );
        };
        match first {
            '"' | '\'' => refuse(span, "a string", "only integers and Booleans are supported"),
            '{' => refuse(span, "an object", "use one data element for each value"),
            '.' => refuse(span, "a member of an object", "use one data element for each value"),
            '=' => self.error(
                span,
                "`=` is an assignment, which is not allowed in an expression",
                Some("compare with `==`; assign with <assign>"),
            ),
            '+' | '-' if self.rest().starts_with("++") || self.rest().starts_with("--") => self
                .error(
                    span,
                    "an expression cannot have side effects",
                    Some("assign with <assign>"),
                ),
            c if is_start(c) => {
                let word = self.word();
                let span = self.text.span(start..self.at);
                self.error(span, &format!("unexpected `{word}`"), Some("write an operator such as `&&` or `+` before it, or remove it"))
            }
            c => self.error(span, &format!("unexpected `{c}`"), Some("remove it; an expression has data elements, numbers, `In('state')`, operators and parentheses")),
        }
    }

    /// Consumes a sign, unless a longer sign begins here.
    fn eat(&mut self, sign: &str, not: &[&str]) -> bool {
        self.blanks();
        let rest = self.rest();
        if rest.starts_with(sign) && !not.iter().any(|longer| rest.starts_with(longer)) {
            self.at += sign.len();
            return true;
        }
        false
    }

    fn word(&mut self) -> String {
        let rest = self.rest();
        let end = rest.find(|c| !is_continue(c)).unwrap_or(rest.len());
        let word = rest[..end].to_owned();
        self.at += end;
        word
    }

    fn enter(&mut self) -> Parse<()> {
        if self.depth >= self.nesting {
            return Err(self.too_deep(self.here()));
        }
        self.depth += 1;
        Ok(())
    }

    fn too_deep(&self, span: Span) -> Box<Diagnostic> {
        Box::new(
            Diagnostic::error(
                codes::NESTING,
                format!("the expression has more than {} levels", self.nesting),
            )
            .at(span, "")
            .help("split it into several data elements"),
        )
    }

    /// Creates an inner node; an error if the tree becomes too deep.
    fn node(&self, kind: AstKind, span: Span, below: u32) -> Parse {
        let depth = below + 1;
        if depth > self.nesting { Err(self.too_deep(span)) } else { Ok(Ast { kind, span, depth }) }
    }

    fn choice(&mut self) -> Parse {
        self.enter()?;
        let around = self.divisions.take();
        let condition = self.binary(0)?;
        let ast = if self.eat("?", &["?.", "??"]) {
            let then = self.choice()?;
            if !self.eat(":", &[]) {
                return Err(self.unexpected());
            }
            let otherwise = self.choice()?;
            let span = condition.span.to(otherwise.span);
            let below = condition.depth.max(then.depth).max(otherwise.depth);
            let kind = AstKind::Choice(Box::new(condition), Box::new(then), Box::new(otherwise));
            self.node(kind, span, below)?
        } else {
            condition
        };
        self.divisions = around;
        self.depth -= 1;
        Ok(ast)
    }

    /// The operator that begins here, its precedence and its length.
    fn operator(&mut self) -> Parse<Option<(Operator, u8, usize)>> {
        self.blanks();
        let rest = self.rest();
        let begins = |sign: &str| rest.starts_with(sign);
        let found = if begins("||") {
            (Operator::Or, 1, 2)
        } else if begins("&&") {
            (Operator::And, 2, 2)
        } else if begins("===") {
            (Operator::Compare(CompareOp::Eq), 6, 3)
        } else if begins("!==") {
            (Operator::Compare(CompareOp::Ne), 6, 3)
        } else if begins("==") {
            (Operator::Compare(CompareOp::Eq), 6, 2)
        } else if begins("!=") {
            (Operator::Compare(CompareOp::Ne), 6, 2)
        } else if ["**", "++", "--", "&=", "|=", "^=", "<<=", ">>=", ">>>="].into_iter().any(begins)
        {
            return Ok(None);
        } else if begins("|") {
            (Operator::Bitwise(BitOp::Or), 3, 1)
        } else if begins("^") {
            (Operator::Bitwise(BitOp::Xor), 4, 1)
        } else if begins("&") {
            (Operator::Bitwise(BitOp::And), 5, 1)
        } else if begins("<<") {
            (Operator::Bitwise(BitOp::Shl), 8, 2)
        } else if begins(">>>") && self.language == Language::Ecmascript {
            (Operator::Bitwise(BitOp::UnsignedShr), 8, 3)
        } else if begins(">>") {
            (Operator::Bitwise(BitOp::Shr), 8, 2)
        } else if begins("<=") {
            (Operator::Compare(CompareOp::Le), 7, 2)
        } else if begins(">=") {
            (Operator::Compare(CompareOp::Ge), 7, 2)
        } else if begins("<") {
            (Operator::Compare(CompareOp::Lt), 7, 1)
        } else if begins(">") {
            (Operator::Compare(CompareOp::Gt), 7, 1)
        } else if begins("+") {
            (Operator::Arith(ArithOp::Add), 9, 1)
        } else if begins("-") {
            (Operator::Arith(ArithOp::Sub), 9, 1)
        } else if begins("*") {
            (Operator::Arith(ArithOp::Mul), 10, 1)
        } else if begins("%") {
            (Operator::Arith(ArithOp::Mod), 10, 1)
        } else if begins("/") && !begins("//") && !begins("/*") {
            match (&mut self.divisions, self.language) {
                (_, Language::C89) => {}
                (Some(count), _) => *count += 1,
                (None, Language::Ecmascript | Language::Null) => {
                    return Err(refuse(
                        self.here(),
                        "a division that gives fractions",
                        "write `Math.trunc(a / b)`, which gives an integer",
                    ));
                }
            }
            (Operator::Arith(ArithOp::Div), 10, 1)
        } else {
            return Ok(None);
        };
        Ok(Some(found))
    }

    /// Parses operands and operators with at least the precedence `least`. A single function for all operators saves stack space.
    fn binary(&mut self, least: u8) -> Parse {
        let mut left = self.unary()?;
        // `a && b && c` is one conjunction of three operands; `(a && b) && c` is not.
        let mut joined = None;
        loop {
            let (before, divisions) = (self.at, self.divisions);
            let Some((operator, strength, length)) = self.operator()? else { return Ok(left) };
            if strength < least {
                (self.at, self.divisions) = (before, divisions);
                return Ok(left);
            }
            self.at += length;
            self.enter()?;
            let right = self.binary(strength + 1)?;
            self.depth -= 1;
            left = self.combined(operator, left, right, joined == Some(operator))?;
            joined = Some(operator);
        }
    }

    fn combined(&self, operator: Operator, left: Ast, right: Ast, is_same: bool) -> Parse {
        let (left_span, depth) = (left.span, left.depth);
        let span = left_span.to(right.span);
        let below = depth.max(right.depth);
        let kind = match (operator, left.kind) {
            (Operator::Or, AstKind::Or(mut all)) if is_same => {
                all.push(right);
                return Ok(Ast { kind: AstKind::Or(all), span, depth: depth.max(below) });
            }
            (Operator::And, AstKind::And(mut all)) if is_same => {
                all.push(right);
                return Ok(Ast { kind: AstKind::And(all), span, depth: depth.max(below) });
            }
            (operator, kind) => {
                let left = Ast { kind, span: left_span, depth };
                self.pair(operator, left, right)
            }
        };
        self.node(kind, span, below)
    }

    fn pair(&self, operator: Operator, left: Ast, right: Ast) -> AstKind {
        match operator {
            Operator::Or => AstKind::Or(vec![left, right]),
            Operator::And => AstKind::And(vec![left, right]),
            Operator::Compare(op) => AstKind::Compare(op, Box::new(left), Box::new(right)),
            Operator::Arith(op) => AstKind::Arith(op, Box::new(left), Box::new(right)),
            Operator::Bitwise(op) => AstKind::Bitwise(op, Box::new(left), Box::new(right)),
        }
    }

    fn unary(&mut self) -> Parse {
        self.blanks();
        match self.peek() {
            Some('!') if !self.rest().starts_with("!=") => self.sign(),
            Some('-') if !self.rest().starts_with("--") => self.sign(),
            Some('+') if !self.rest().starts_with("++") => self.sign(),
            Some('~') => self.sign(),
            Some('(') => self.parentheses(),
            Some('[') => self.array(),
            Some(c) if c.is_ascii_digit() => self.number(),
            Some(c) if is_start(c) => self.named(),
            Some(_) | None => Err(self.unexpected()),
        }
    }

    fn sign(&mut self) -> Parse {
        let place = self.text.span(self.at..self.at + 1);
        let sign = self.peek();
        self.at += 1;
        self.enter()?;
        let inner = self.unary()?;
        self.depth -= 1;
        let (span, below) = (place.to(inner.span), inner.depth);
        match (sign, &inner.kind) {
            (Some('!'), _) => self.node(AstKind::Not(Box::new(inner)), span, below),
            (Some('~'), _) => {
                let ones = Box::new(Ast::of(AstKind::Int(-1), place));
                self.node(AstKind::Bitwise(BitOp::Xor, Box::new(inner), ones), span, below)
            }
            (Some('-'), AstKind::Int(value)) => self.node(AstKind::Int(-value), span, 0),
            (Some('-'), _) => self.node(AstKind::Neg(Box::new(inner)), span, below),
            _ => Ok(inner),
        }
    }

    fn parentheses(&mut self) -> Parse {
        self.at += 1;
        let inner = self.choice()?;
        if self.eat(")", &[]) { Ok(inner) } else { Err(self.unexpected()) }
    }

    fn array(&mut self) -> Parse {
        let start = self.at;
        self.at += 1;
        let mut all = Vec::new();
        while !self.eat("]", &[]) {
            if !all.is_empty() && !self.eat(",", &[]) {
                return Err(self.unexpected());
            }
            if !all.is_empty() && self.eat("]", &[]) {
                break;
            }
            all.push(self.choice()?);
        }
        let below = all.iter().map(|one| one.depth).max().unwrap_or(0);
        self.node(AstKind::Array(all), self.text.span(start..self.at), below)
    }

    fn number(&mut self) -> Parse {
        let start = self.at;
        let rest = self.rest();
        let end = rest.find(|c: char| !(c.is_ascii_alphanumeric() || c == '.' || c == '_'));
        let word = rest[..end.unwrap_or(rest.len())].to_owned();
        self.at += word.len();
        let span = self.text.span(start..self.at);
        let hex = word.strip_prefix("0x").or(word.strip_prefix("0X"));
        let digits = match self.language {
            // The suffixes of C define the width of a number; our numbers need no width.
            Language::C89 => word.trim_end_matches(['u', 'U', 'l', 'L']),
            Language::Ecmascript | Language::Null => word.as_str(),
        };
        let value = match hex {
            Some(hex) => i64::from_str_radix(hex, 16).ok(),
            None if digits.len() > 1
                && digits.starts_with('0')
                && digits.bytes().all(|byte| byte.is_ascii_digit()) =>
            {
                return Err(self.error(
                    span,
                    &format!("`{word}` would be an octal number"),
                    Some("remove the leading 0"),
                ));
            }
            None => digits.parse().ok(),
        };
        match value {
            Some(value) if value <= i64::from(u32::MAX) => self.node(AstKind::Int(value), span, 0),
            Some(_) => Err(self.error(span, &format!("`{word}` exceeds 32 bits"), Some(TOO_LARGE))),
            None if word.bytes().all(|byte| byte.is_ascii_digit()) => {
                Err(self.error(span, &format!("`{word}` exceeds 32 bits"), Some(TOO_LARGE)))
            }
            None if word.contains(['.', 'e', 'E']) && hex.is_none() => Err(refuse(
                span,
                &format!("the fraction `{word}`"),
                "use an integer in a smaller unit, such as tenths",
            )),
            None => Err(self.error(
                span,
                &format!("invalid number `{word}`"),
                Some("write digits only, as in 15 or 0x0F"),
            )),
        }
    }

    /// Parses an expression that begins with a word.
    fn named(&mut self) -> Parse {
        let start = self.at;
        let word = self.word();
        let span = self.text.span(start..self.at);
        match word.as_str() {
            "true" => return self.node(AstKind::Bool(true), span, 0),
            "false" => return self.node(AstKind::Bool(false), span, 0),
            "In" => return self.in_predicate(span),
            "Math" => return self.math(span),
            _ => {}
        }
        if let Some(finding) = self.no_datum(&word, span) {
            return Err(finding);
        }
        self.blanks();
        if self.eat("[", &[]) {
            return self.element(word, span);
        }
        if self.rest().starts_with('(') {
            let what = format!("a call of `{word}`");
            return Err(refuse(span, &what, "the only supported function is In('state')"));
        }
        self.node(AstKind::Name(word), span, 0)
    }

    fn element(&mut self, word: String, span: Span) -> Parse {
        let index = self.choice()?;
        if !self.eat("]", &[]) {
            return Err(self.unexpected());
        }
        let (span, below) = (span.to(self.text.span(self.at - 1..self.at)), index.depth);
        self.node(AstKind::Element(word, Box::new(index)), span, below)
    }

    /// The finding for a reserved word that is not supported here.
    fn no_datum(&self, word: &str, span: Span) -> Option<Box<Diagnostic>> {
        const ONLY: &str = "only integers and Booleans are supported";
        Some(match word {
            "_event" => refuse(
                span,
                "the data of an event",
                "events carry no data: use one event for each value, or an input",
            ),
            "_sessionid" | "_name" | "_ioprocessors" | "_x" => refuse(
                span,
                &format!("the system variable `{word}`"),
                "a controller has no sessions",
            ),
            "undefined" | "null" | "NaN" | "Infinity" | "NULL" => refuse(
                span,
                &format!("the value `{word}`"),
                "a data element is always a number or a Boolean",
            ),
            "new" | "function" | "typeof" | "void" | "delete" | "sizeof" | "instanceof"
            | "this" => refuse(span, &format!("`{word}`"), ONLY),
            "return" | "var" | "let" | "const" | "if" | "else" | "for" | "while" | "do"
            | "break" | "continue" | "switch" | "case" | "throw" | "try" => self.error(
                span,
                &format!("expected an expression, found the statement `{word}`"),
                Some("write statements as elements: <assign>, <if>, <foreach>"),
            ),
            _ => return None,
        })
    }

    fn in_predicate(&mut self, span: Span) -> Parse {
        if !self.eat("(", &[]) {
            return Err(self.error(span, "`In` needs a state", Some("write In('state')")));
        }
        self.blanks();
        let start = self.at;
        let quote = self.peek().filter(|c| matches!(c, '\'' | '"'));
        let (id, place) = match quote {
            Some(quote) => {
                let inside = &self.rest()[1..];
                let Some(end) = inside.find(quote) else {
                    return Err(self.error(
                        self.here(),
                        "missing closing quote",
                        Some("write In('state')"),
                    ));
                };
                let id = inside[..end].to_owned();
                self.at += end + 2;
                (id, self.text.span(start + 1..self.at - 1))
            }
            // The null data model has no strings, so some documents write the identifier without quotes.
            None if self.language == Language::Null => {
                let rest = self.rest();
                let end = rest.find([')', ' ']).unwrap_or(rest.len());
                let id = rest[..end].to_owned();
                self.at += end;
                (id, self.text.span(start..self.at))
            }
            None => {
                let span = self.here();
                return Err(self.error(
                    span,
                    "`In` needs the identifier of a state in quotes",
                    Some("write In('state')"),
                ));
            }
        };
        if !self.eat(")", &[]) {
            return Err(self.unexpected());
        }
        let span = span.to(self.text.span(self.at - 1..self.at));
        self.node(AstKind::In(id, place), span, 0)
    }

    /// Parses `Math.trunc(a / b)`, the integer division of ECMAScript.
    fn math(&mut self, span: Span) -> Parse {
        let refused = |span| {
            refuse(
                span,
                "a function of Math",
                "the only supported one is `Math.trunc(a / b)`, the integer division",
            )
        };
        if !self.eat(".", &[]) {
            return Err(refused(span));
        }
        let start = self.at;
        let word = self.word();
        let span = span.to(self.text.span(start..self.at.max(start + 1).min(self.text.text.len())));
        if word != "trunc" || !self.eat("(", &[]) {
            return Err(refused(span));
        }
        self.enter()?;
        let around = self.divisions.replace(0);
        let inner = self.binary(10)?;
        let count = std::mem::replace(&mut self.divisions, around);
        self.depth -= 1;
        // `Math.trunc` must contain one quotient and nothing else: in `Math.trunc(a / b * c)`, the quotient would keep its fraction.
        if !matches!(inner.kind, AstKind::Arith(ArithOp::Div, ..)) || count > Some(1) {
            return Err(refused(span.to(inner.span)));
        }
        if !self.eat(")", &[]) {
            return Err(self.unexpected());
        }
        Ok(Ast { span: span.to(inner.span), ..inner })
    }
}

impl Ast {
    /// A leaf that is not in the source.
    pub(super) fn of(kind: AstKind, span: Span) -> Ast {
        Ast { kind, span, depth: 1 }
    }

    /// The elements of an array literal.
    pub(super) fn elements(&self) -> Option<&[Ast]> {
        if let AstKind::Array(all) = &self.kind { Some(all) } else { None }
    }
}
