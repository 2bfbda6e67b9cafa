//! Expressions of CUPL: of single signals, and of lists and fields of signals.
//!
//! An operator between two lists works bit by bit; one between a list and a signal applies to every bit. `field:'h'3` is true if the bits equal that number,
//! `field:[2..5]` if they are in that range; `field:&`, `field:#` and `field:$` combine all bits. Numbers without a base are hexadecimal; an `X`
//! digit is any digit.
//!
//! # Bit numbers
//! The bit number of a signal in a field is the index at the end of its name: `A0` is bit 0 wherever it is listed, and bits without a signal are
//! not compared. So `[A15..A12]:[8000..FFFF]` tests for the upper half, and `[A15..A12]:[8..F]` for zeros in all four bits. Names without an index
//! are numbered by position, the last one bit 0. CUPL's manual warns about fields that mix both, or that contain two signals with the same index;
//! they are rejected here.

use super::MAX_NESTING;
use super::ast::{Expr, ExprId, PldAst, SignalId};
use super::lexer::{Kind, Lexer};
use super::number::{self, Number};
use super::range::within;
use crate::codes;
use grafsynth_ir::Gather;
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::span::Span;
use itertools::Itertools as _;
use std::collections::BTreeMap;

/// The maximum number of bits of a list.
pub(crate) const MAX_BITS: usize = 64;
/// The maximum number of numbers in a list of numbers.
const MAX_NUMBERS: usize = 256;
/// The largest index that CUPL accepts as a bit number.
const MAX_INDEX: u32 = 31;

/// Named lists and numbers.
#[derive(Debug, Default)]
pub(crate) struct Names {
    pub(crate) fields: BTreeMap<String, Field>,
    pub(crate) numbers: number::Defined,
    /// The expressions of `$DEFINE`, with the lowest precedence of an operator in each: CUPL substitutes the text without parentheses.
    pub(crate) defined: BTreeMap<SignalId, Binding>,
}

/// The precedence of the operators next to an operand.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub(crate) enum Binding {
    /// There is no operator next to it.
    #[default]
    Free,
    /// `$`.
    Exclusive,
    /// `#`.
    Or,
    /// `&`.
    And,
    /// `!` before it or `:` after it; or, for an expression, the fact that it is a single operand.
    Operand,
}

impl Binding {
    fn of(sign: &str) -> Self {
        match sign {
            "$" => Binding::Exclusive,
            "#" => Binding::Or,
            "&" => Binding::And,
            ":" => Binding::Operand,
            _ => Binding::Free,
        }
    }
}

/// A named list, the most significant bit first.
#[derive(Debug, Clone)]
pub(crate) struct Field {
    pub(crate) signals: Vec<SignalId>,
    numbering: Numbering,
}

/// The bit number of each value of a list.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Numbering {
    /// By position: the last is bit 0.
    Place,
    /// The bit number of each value.
    Index(Vec<u32>),
    /// Why the list cannot be compared with a number.
    None(&'static str),
}

/// The value of an expression: a single one, or one for each bit of a list.
#[derive(Debug, Clone)]
pub(crate) struct Value {
    pub(crate) bits: Vec<ExprId>,
    numbering: Numbering,
    /// True if the list is a field, or consists of fields only.
    pub(crate) is_field: bool,
}

impl Value {
    fn one(bit: ExprId) -> Self {
        Value { bits: vec![bit], numbering: Numbering::Place, is_field: false }
    }
}

impl Field {
    /// A field of these signals, as listed.
    ///
    /// # Errors
    /// Returns why the bits have no numbers.
    pub(crate) fn new(draft: &PldAst, listed: &[SignalId]) -> Result<Self, &'static str> {
        let mut signals = listed.to_vec();
        let numbering = match numbering(draft, listed) {
            Numbering::Index(_) => {
                signals.sort_by_key(|signal| std::cmp::Reverse(index_of(draft, *signal)));
                numbering(draft, &signals)
            }
            Numbering::Place => Numbering::Place,
            Numbering::None(why) => return Err(why),
        };
        Ok(Field { signals, numbering })
    }

    /// The signals of a list in brackets, by position.
    pub(crate) fn as_listed(draft: &PldAst, listed: &[SignalId]) -> Self {
        Field { signals: listed.to_vec(), numbering: numbering(draft, listed) }
    }

    /// Checks whether the values of a right side match this field or list bit by bit.
    pub(crate) fn takes(&self, value: &Value) -> Result<(), &'static str> {
        pair(&self.numbering, true, &value.numbering, value.is_field)
    }
}

/// The index at the end of a name.
fn index_of(draft: &PldAst, signal: SignalId) -> Option<u32> {
    let name = &draft.signals[signal as usize].name;
    let stem = name.trim_end_matches(|c: char| c.is_ascii_digit());
    name[stem.len()..].parse().ok()
}

fn numbering(draft: &PldAst, signals: &[SignalId]) -> Numbering {
    let indices: Vec<Option<u32>> = signals.iter().map(|one| index_of(draft, *one)).collect();
    if indices.iter().all(Option::is_none) {
        return Numbering::Place;
    }
    let Some(indices) = indices.into_iter().collect::<Option<Vec<u32>>>() else {
        return Numbering::None(
            "some of its names end with an index, which is the bit number, and some do not",
        );
    };
    if indices.iter().any(|index| *index > MAX_INDEX) {
        return Numbering::None("an index above 31 is not a bit number");
    }
    let mut sorted = indices.clone();
    sorted.sort_unstable();
    sorted.dedup();
    if sorted.len() < indices.len() {
        return Numbering::None(
            "two of its names end with the same index, which is the bit number",
        );
    }
    Numbering::Index(indices)
}

/// Checks whether two lists of equal length match bit by bit in their stored order; the error says why not.
fn pair(
    a: &Numbering,
    is_field_a: bool,
    b: &Numbering,
    is_field_b: bool,
) -> Result<(), &'static str> {
    match (a, b) {
        (Numbering::Index(a), Numbering::Index(b)) if (is_field_a || is_field_b) && a != b => Err(
            "the bits of a field are matched by the indices of their names, and these two lists have different indices at these positions",
        ),
        _ => Ok(()),
    }
}

/// Reads an expression. `None` after an error, which is reported.
pub(crate) fn expression(
    lexer: &mut Lexer<'_>,
    draft: &mut PldAst,
    names: &Names,
) -> Option<Value> {
    Parser::new(lexer, draft, names).exclusive()
}

/// Reads the expression of a `$DEFINE`, which ends with its line; returns its value and the lowest precedence of its operators.
pub(crate) fn definition(
    lexer: &mut Lexer<'_>,
    draft: &mut PldAst,
    names: &Names,
) -> Option<(Value, Binding)> {
    let mut parser = Parser { is_one_line: true, ..Parser::new(lexer, draft, names) };
    let value = parser.exclusive()?;
    Some((value, parser.weakest))
}

struct Parser<'p, 'a> {
    lexer: &'p mut Lexer<'a>,
    draft: &'p mut PldAst,
    names: &'p Names,
    depth: u32,
    /// True if the expression ends with its line.
    is_one_line: bool,
    /// The operator before the operand that is read.
    before: Binding,
    /// The lowest precedence of an operator outside parentheses so far.
    weakest: Binding,
}

/// The words that begin a new line after `$`.
const DIRECTIVES: [&str; 12] = [
    "define", "undef", "ifdef", "ifndef", "else", "endif", "include", "repeat", "repend", "macro",
    "mend", "set",
];

impl<'p, 'a> Parser<'p, 'a> {
    fn new(lexer: &'p mut Lexer<'a>, draft: &'p mut PldAst, names: &'p Names) -> Self {
        Parser {
            lexer,
            draft,
            names,
            depth: 0,
            is_one_line: false,
            before: Binding::Free,
            weakest: Binding::Operand,
        }
    }
}

impl Parser<'_, '_> {
    fn error<T>(&mut self, span: Span, message: impl Into<String>) -> Option<T> {
        self.draft.error(codes::SYNTAX, span, message);
        None
    }

    fn error_with<T>(
        &mut self,
        span: Span,
        message: impl Into<String>,
        help: impl Into<String>,
    ) -> Option<T> {
        self.draft.error_with(codes::SYNTAX, span, message, help);
        None
    }

    fn exclusive(&mut self) -> Option<Value> {
        let mut value = self.or()?;
        loop {
            let span = self.lexer.span();
            if !self.operator("$") {
                return Some(value);
            }
            let other = self.or()?;
            let exclusive = |draft: &mut PldAst, bits: &[ExprId]| match bits {
                [a, b] => draft.expr(Expr::Xor(*a, *b)),
                _ => draft.list(bits, true),
            };
            value = self.bitwise(&[value, other], span, exclusive)?;
        }
    }

    /// Consumes the operator between two operands, if it is next.
    fn operator(&mut self, sign: &str) -> bool {
        if !self.is_operator() || !self.lexer.eat(sign) {
            return false;
        }
        self.before = Binding::of(sign);
        if self.depth == 0 {
            self.weakest = self.weakest.min(self.before);
        }
        true
    }

    /// True if the next token belongs to this expression.
    fn is_operator(&self) -> bool {
        let token = self.lexer.token;
        if !token.is_first {
            return true;
        }
        let is_directive = || {
            let mut ahead = self.lexer.clone();
            ahead.advance();
            token.is("$") && DIRECTIVES.iter().any(|word| ahead.token.is_word(word))
        };
        !self.is_one_line && !is_directive()
    }

    /// Checks a use of a named expression. CUPL substitutes its text, which must have the same meaning as its value.
    fn check_defined(&mut self, signal: SignalId, is_negated: bool, span: Span) -> Option<()> {
        let Some(weakest) = self.names.defined.get(&signal).copied() else { return Some(()) };
        let before = if is_negated { Binding::Operand } else { self.before };
        let after =
            if self.is_operator() { Binding::of(self.lexer.token.text) } else { Binding::Free };
        if self.depth == 0 {
            self.weakest = self.weakest.min(weakest);
        }
        if weakest >= before.max(after) {
            return Some(());
        }
        let name = &self.draft.signals[signal as usize].name;
        let message = format!(
            "CUPL puts the text of `{name}` here without parentheses, so the operator next to it would apply to only a part of it"
        );
        let of = self.draft.signals[signal as usize].span;
        let finding = Diagnostic::error(codes::UNSUPPORTED, message)
            .at(span, "")
            .at(of, "defined here, without parentheses around the text")
            .help("put parentheses around the text of the `$DEFINE`");
        self.draft.report(finding);
        None
    }

    fn or(&mut self) -> Option<Value> {
        self.junction("#", false)
    }

    fn junction(&mut self, sign: &str, is_and: bool) -> Option<Value> {
        let operand =
            |parser: &mut Self| if is_and { parser.literal() } else { parser.junction("&", true) };
        let span = self.lexer.span();
        let mut all = vec![operand(self)?];
        while self.operator(sign) {
            all.push(operand(self)?);
        }
        self.bitwise(&all, span, |draft, bits| draft.list(bits, is_and))
    }

    /// One operator on lists of the same length, or on lists and single signals.
    fn bitwise(
        &mut self,
        all: &[Value],
        span: Span,
        make: impl Fn(&mut PldAst, &[ExprId]) -> ExprId,
    ) -> Option<Value> {
        let width = all.iter().map(|value| value.bits.len()).max().unwrap_or(1);
        if all.iter().any(|value| value.bits.len() != width && value.bits.len() != 1) {
            let sizes = all.iter().map(|value| value.bits.len().to_string()).join(" and ");
            return self.error_with(
                span,
                format!("lists of {sizes} bits cannot be combined"),
                "use lists of the same length, or a single signal for all bits",
            );
        }
        let mut wide = all.iter().filter(|value| width > 1 && value.bits.len() == width);
        let (mut numbering, mut is_field) = (Numbering::Place, false);
        if let Some(first) = wide.next() {
            (numbering, is_field) = (first.numbering.clone(), first.is_field);
            for other in wide {
                if let Err(why) = pair(&numbering, is_field, &other.numbering, other.is_field) {
                    self.draft.report(
                        Diagnostic::error(codes::UNSUPPORTED, why)
                            .at(span, "")
                            .help("write one equation for each bit, or lists in brackets"),
                    );
                    return None;
                }
                if numbering != other.numbering {
                    numbering = Numbering::None("its bits combine signals with different indices");
                }
                is_field &= other.is_field;
            }
        }
        let bit = |at: usize| -> Vec<ExprId> {
            let of = |value: &Value| value.bits.get(at).or(value.bits.first()).copied();
            all.iter().filter_map(of).collect()
        };
        let bits = (0..width).map(|at| make(self.draft, &bit(at))).collect();
        Some(Value { bits, numbering, is_field })
    }

    fn literal(&mut self) -> Option<Value> {
        let mut is_negated = false;
        while self.lexer.eat("!") {
            is_negated = !is_negated;
        }
        let span = self.lexer.span();
        let token = self.lexer.token;
        let mut value = if token.is("(") {
            if self.depth >= MAX_NESTING {
                return self
                    .error(span, format!("parentheses are nested more than {MAX_NESTING} deep"));
            }
            self.lexer.advance();
            self.depth += 1;
            self.before = Binding::Free;
            let value = self.exclusive()?;
            self.depth -= 1;
            if !self.lexer.eat(")") {
                let message = format!("expected `)`, found {}", self.lexer.token.shown());
                let help = "write `)` here, or remove the `(` that is open";
                return self.error_with(self.lexer.span(), message, help);
            }
            value
        } else if token.is("[") {
            let listed = list(self.lexer, self.draft)?;
            let signals: Vec<SignalId> = listed.iter().map(|(signal, _)| *signal).collect();
            let bits = listed.into_iter().map(|(signal, at)| self.read(signal, at)).collect();
            Value { bits, numbering: numbering(self.draft, &signals), is_field: false }
        } else if token.kind == Kind::Quoted {
            let number = number::read(self.lexer, self.draft, &self.names.numbers)?;
            self.constant(number, span)?
        } else if token.kind == Kind::Word {
            self.lexer.advance();
            if let Some(field) = self.names.fields.get(token.text) {
                let read = |signal: &SignalId| self.read(*signal, span);
                let bits = field.signals.iter().map(read).collect();
                Value { bits, numbering: field.numbering.clone(), is_field: true }
            } else if let Some(digits) = self.names.numbers.get(token.text) {
                let Some(number) = digits.number(None) else {
                    let message = format!("`{}` is not a valid number here", token.text);
                    let help = "a number alone in an equation is one bit: write 'b'0 or 'b'1";
                    return self.error_with(span, message, help);
                };
                self.constant(number, span)?
            } else {
                let signal = self.draft.signal(token.text, span);
                self.feedback()?;
                self.check_defined(signal, is_negated, span)?;
                let mut value = Value::one(self.read(signal, span));
                if index_of(self.draft, signal).is_some_and(|index| index > 0) {
                    value.numbering =
                        Numbering::None("it is a single signal, which is itself true or false");
                }
                value
            }
        } else {
            let message = format!("expected a signal, found {}", token.shown());
            let help = if self.is_operator() {
                format!("write a signal before {}, or remove the operator before it", token.shown())
            } else {
                "write a signal here, or remove the operator before it; operators are `!`, `&`, `#` and `$`"
                    .to_owned()
            };
            return self.error_with(span, message, help);
        };
        if self.is_operator() && self.lexer.eat(":") {
            value = Value::one(self.test(&value, span)?);
        }
        if is_negated {
            value.bits = value.bits.into_iter().map(|bit| self.draft.not(bit)).collect();
        }
        Some(value)
    }

    /// Reads a number as a constant of one bit, because no list gives its width.
    fn constant(&mut self, number: Number, span: Span) -> Option<Value> {
        if number.mask & 1 == 0 || number.value > 1 {
            return self.error_with(
                span,
                "a constant in an equation is one bit",
                "write 'b'0 or 'b'1; to compare a field with a number, write `FIELD:NUMBER`",
            );
        }
        Some(Value::one(self.draft.expr(Expr::Const(number.value == 1))))
    }

    fn read(&mut self, signal: SignalId, span: Span) -> ExprId {
        self.draft.at(signal).read_at.get_or_insert(span);
        self.draft.read(signal)
    }

    /// Reads and ignores `.io`, `.dfb` and similar extensions on a right side: they select the feedback source, but the known devices have only one.
    fn feedback(&mut self) -> Option<()> {
        if !self.lexer.token.is(".") || self.lexer.token.is_first {
            return Some(());
        }
        self.lexer.advance();
        let (span, token) = (self.lexer.span(), self.lexer.advance());
        let known = ["io", "dfb", "dq", "ioad", "int"];
        if known.iter().any(|word| token.is_word(word)) {
            return Some(());
        }
        let message = format!(
            "extension `.{}` is not supported on a right side",
            token.text.chars().take(20).collect::<String>()
        );
        let help = "write the name alone, or with .io (the pin) or .dfb (the register)";
        self.draft.error_with(codes::UNSUPPORTED, span, message, help);
        None
    }

    /// Reads the test after `list:`.
    fn test(&mut self, value: &Value, span: Span) -> Option<ExprId> {
        let bits = &value.bits;
        let token = self.lexer.token;
        if token.is("&") || token.is("#") {
            self.lexer.advance();
            return Some(self.draft.list(bits, token.is("&")));
        }
        if token.is("$") {
            self.lexer.advance();
            let mut bits = bits.iter().copied();
            let first = bits.next()?;
            return Some(bits.fold(first, |value, bit| self.draft.expr(Expr::Xor(value, bit))));
        }
        let numbers = self.numbered(value, span)?;
        let base = number::base(self.lexer, self.draft)?;
        if !self.lexer.eat("[") {
            let start = self.lexer.token.start;
            let number = number::digits(self.lexer, self.draft, &self.names.numbers, base)?;
            self.check_width(&numbers, number, 0, self.lexer.span_from(start))?;
            return Some(self.equals(&numbers, number));
        }
        // `[lo..hi]` or a list of numbers.
        let mut terms = Vec::new();
        loop {
            let start = self.lexer.token.start;
            if terms.len() >= MAX_NUMBERS {
                return self.error_with(
                    span,
                    format!("a list has at most {MAX_NUMBERS} numbers"),
                    "write ranges, as in `[10..1F]`, or several comparisons joined by `#`",
                );
            }
            let first = number::digits(self.lexer, self.draft, &self.names.numbers, base)?;
            if self.lexer.eat(".") {
                self.lexer.eat(".");
                let last = number::digits(self.lexer, self.draft, &self.names.numbers, base)?;
                // Below its lowest bit, a field represents whole blocks of addresses.
                let lowest = numbers.bits.keys().next().map_or(0, |at| (1_u64 << at) - 1);
                let free = if numbers.is_open { lowest } else { 0 };
                let at = self.lexer.span_from(start);
                self.check_width(&numbers, first, free, at)?;
                self.check_width(&numbers, last, free, at)?;
                terms.push(self.range(&numbers, first, last, at)?);
            } else {
                self.check_width(&numbers, first, 0, self.lexer.span_from(start))?;
                terms.push(self.equals(&numbers, first));
            }
            if self.lexer.eat("]") {
                break;
            }
            if !self.lexer.eat(",") {
                let message = format!("expected `,` or `]`, found {}", self.lexer.token.shown());
                let help = "separate the numbers by `,`, and close the list with `]`";
                return self.error_with(self.lexer.span(), message, help);
            }
        }
        Some(self.draft.list(&terms, false))
    }

    /// Each value of a list with its bit number.
    fn numbered(&mut self, value: &Value, span: Span) -> Option<Numbered> {
        let by_place = || (0..).zip(value.bits.iter().rev()).map(|(at, bit)| (at, *bit)).gather();
        let (bits, is_open): (BTreeMap<u32, ExprId>, bool) = match &value.numbering {
            Numbering::Place => (by_place(), false),
            Numbering::Index(indices) => {
                let by_index: BTreeMap<_, _> =
                    indices.iter().copied().zip(value.bits.iter().copied()).gather();
                if !value.is_field && by_index != by_place() {
                    self.draft.report(
                        Diagnostic::error(
                            codes::UNSUPPORTED,
                            "the order of this list and the indices of its names imply different bit numbers",
                        )
                        .at(span, "")
                        .help("declare it as a FIELD, in which the index is the bit number"),
                    );
                    return None;
                }
                (by_index, true)
            }
            Numbering::None(why) => {
                let message = format!("this list cannot be compared with a number: {why}");
                let help = "write the comparison as a product of its signals, as in `A3 & !A2`";
                self.draft.error_with(codes::UNSUPPORTED, span, message, help);
                return None;
            }
        };
        Some(Numbered { bits, is_open })
    }

    /// Checks a number's bits outside the list: an error, or a warning if numbers are addresses. `free` bits are don't-cares.
    fn check_width(
        &mut self,
        list: &Numbered,
        number: Number,
        free: u64,
        span: Span,
    ) -> Option<()> {
        let known = list.bits.keys().fold(0_u64, |known, at| known | 1 << at);
        let beyond = number.value & number.mask & !known & !free;
        if beyond == 0 {
            return Some(());
        }
        if list.is_open {
            let bits: Vec<String> = (0..u64::BITS)
                .filter(|at| beyond >> at & 1 == 1)
                .map(|at| at.to_string())
                .collect();
            let message = format!(
                "the number {:X} (hexadecimal) has ones in bits that are not in the field: {}",
                number.value,
                bits.join(", ")
            );
            self.draft.report(
                Diagnostic::warning(codes::TAKEN_AS, message)
                    .at(span, "these bits are not compared")
                    .help("the bit number of a signal is the index in its name: `A0` is bit 0 wherever it is listed"),
            );
            return Some(());
        }
        let n_bits = list.bits.len();
        let message = format!("{:X} (hexadecimal) does not fit {n_bits} bits", number.value);
        let largest = if n_bits < 64 { (1_u64 << n_bits) - 1 } else { u64::MAX };
        self.error_with(span, message, format!("write a number up to {largest:X} (hexadecimal)"))
    }

    fn equals(&mut self, list: &Numbered, number: Number) -> ExprId {
        let mut literals = Vec::new();
        for (at, bit) in &list.bits {
            if number.mask >> at & 1 == 1 {
                let is_one = number.value >> at & 1 == 1;
                literals.push(if is_one { *bit } else { self.draft.not(*bit) });
            }
        }
        if literals.is_empty() {
            return self.draft.expr(Expr::Const(true));
        }
        self.draft.list(&literals, true)
    }

    /// True if some number of the range has these bits.
    fn range(&mut self, list: &Numbered, first: Number, last: Number, at: Span) -> Option<ExprId> {
        if first.mask != !0 || last.mask != !0 || first.value > last.value {
            return self.error_with(
                at,
                "expected a range of numbers such as `[2..5]`",
                "write the smaller number first, without X digits",
            );
        }
        let lowest = list.bits.keys().next().map_or(0, |at| (1_u64 << at) - 1);
        let is_whole = first.value & lowest == 0 && last.value & lowest == lowest;
        if list.is_open && !is_whole {
            let (from, to) = (first.value & !lowest, last.value | lowest);
            let n_below = lowest.count_ones();
            let message = format!(
                "the field begins with bit {n_below}, so [{:X}..{:X}] is read as [{from:X}..{to:X}]",
                first.value, last.value
            );
            let highest = list.bits.keys().next_back().copied().unwrap_or(0);
            let shifted = |value: u64| value.checked_shl(n_below).filter(|it| it >> highest <= 1);
            let help = match (shifted(first.value), shifted(last.value)) {
                (Some(low), Some(high)) => {
                    format!("write whole addresses, as in `[{low:X}..{:X}]`", high | lowest)
                }
                _ => format!("write `[{from:X}..{to:X}]`: numbers are whole addresses"),
            };
            let finding = Diagnostic::warning(codes::TAKEN_AS, message);
            self.draft.report(
                finding
                    .at(at, format!("the lowest bit has the value {:X} (hexadecimal)", lowest + 1))
                    .help(help),
            );
        }
        Some(within(self.draft, &list.bits, first.value, last.value))
    }
}

/// The values of a list by bit number.
struct Numbered {
    bits: BTreeMap<u32, ExprId>,
    /// True if bits that are not in the list are still part of the number.
    is_open: bool,
}

/// Reads `[A, B, C]`, `[A7..A0]` or `[A7..0]`: the signals with their spans, the most significant first. `None` after an error, which is reported.
pub(crate) fn list(lexer: &mut Lexer<'_>, draft: &mut PldAst) -> Option<Vec<(SignalId, Span)>> {
    let names = names(lexer, draft)?;
    Some(names.into_iter().map(|(name, span)| (draft.signal(&name, span), span)).collect())
}

/// Reads the names of a list in brackets, with their spans.
pub(crate) fn names(lexer: &mut Lexer<'_>, draft: &mut PldAst) -> Option<Vec<(String, Span)>> {
    lexer.advance();
    let mut found = Vec::new();
    loop {
        let (span, token) = (lexer.span(), lexer.token);
        if token.kind != Kind::Word {
            let message = format!("expected a name, found {}", token.shown());
            let help = "write the names of signals, as in `[A2, A1, A0]` or `[A2..A0]`";
            draft.error_with(codes::SYNTAX, span, message, help);
            return None;
        }
        lexer.advance();
        if lexer.token.is(".") {
            lexer.advance();
            lexer.eat(".");
            let (end, last) = (lexer.span(), lexer.advance());
            let split = |text: &str| -> Option<(String, u32)> {
                let digits = text.len() - text.trim_end_matches(|c: char| c.is_ascii_digit()).len();
                let (stem, number) = text.split_at(text.len() - digits);
                Some((stem.to_owned(), number.parse().ok()?))
            };
            let ends = split(token.text)
                .zip(split(last.text))
                .filter(|((a, _), (b, _))| b.is_empty() || a.eq_ignore_ascii_case(b));
            let Some(((stem, from), (_, to))) = ends.filter(|((_, a), (_, b))| a.abs_diff(*b) < 64)
            else {
                draft.error_with(
                    codes::SYNTAX,
                    end,
                    "expected a range of names such as `A7..A0` or `A7..0`",
                    "write the same letters before both numbers, at most 63 apart, or list the names: `[A2, A1, A0]`",
                );
                return None;
            };
            let numbers: Vec<u32> =
                if from >= to { (to..=from).rev().collect() } else { (from..=to).collect() };
            // `[A00..A15]`: with as many digits as the names at the ends.
            let width = if token.text[stem.len()..].starts_with('0') {
                token.text.len() - stem.len()
            } else {
                0
            };
            let named = |number: u32| (format!("{stem}{number:0width$}"), span);
            found.extend(numbers.into_iter().map(named));
        } else {
            found.push((token.text.to_owned(), span));
        }
        if found.len() > MAX_BITS {
            let message = format!("a list has at most {MAX_BITS} names");
            draft.error_with(codes::SYNTAX, span, message, "write several lists");
            return None;
        }
        if lexer.eat("]") {
            return Some(found);
        }
        if !lexer.eat(",") {
            let message = format!("expected `,` or `]`, found {}", lexer.token.shown());
            let help = "separate the names by `,`, and close the list with `]`";
            draft.error_with(codes::SYNTAX, lexer.span(), message, help);
            return None;
        }
    }
}
