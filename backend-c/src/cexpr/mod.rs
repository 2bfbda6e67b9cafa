//! Expressions in C, exact for every value and every width of `int`.
//!
//! Each C expression has the interval of its value and the *class* of C type in which it is computed. There are three integer classes, all signed: `int`
//! (at least 16 bits everywhere), `int32_t` and `int64_t`. An operator is computed in the smallest class that holds its result and both operands; when
//! neither operand has that class yet, the left one is cast, and the usual arithmetic conversions widen the other. So nothing overflows, nothing is
//! ever converted to an unsigned type by accident, and a compiler with a 16-bit `int` gives the same answer as one with 32 bits.
//!
//! MISRA-C:2012 requires both operands of an operator to have one essential type category (rule 10.4), and forbids casts of a composite expression to
//! another category or to a wider type (rule 10.8). So each expression has up to three spellings: the plain one, one that is signed in its class
//! (`(int)n`, for arithmetic), and one that is unsigned (`5U`, `n + 1U`, to compare with bytes and to store into them). A composite is cast to its
//! own type before it is cast to another.
//!
//! Comparisons that the intervals decide become constants. Otherwise compilers would warn about them, and the text would contain dead code.
// A variant that an emitter forgets is a miscompile.
#![warn(clippy::wildcard_enum_match_arm)]

mod arith;
mod bits;

use bits::{Bits, Word};
use grafsynth_c::storage;

pub(crate) use arith::{Helpers, WIDE_FUNCTIONS, saturated};

use grafsynth_ir::expr::{CompareOp, Expr, ExprKind, Type};
use itertools::Itertools as _;

/// The C type in which a value is computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Class {
    /// `bool`.
    Bool,
    /// `int`, used for values within 16 bits.
    Int,
    /// `int32_t`.
    Wide,
    /// `int64_t`.
    Huge,
}

impl Class {
    /// The smallest integer class that contains `lo..hi`.
    pub(crate) fn of(lo: i64, hi: i64) -> Self {
        if lo >= i64::from(i16::MIN) && hi <= i64::from(i16::MAX) {
            Class::Int
        } else if lo >= i64::from(i32::MIN) && hi <= i64::from(i32::MAX) {
            Class::Wide
        } else {
            Class::Huge
        }
    }

    /// The name of the type.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Class::Bool => "bool",
            Class::Int => "int",
            Class::Wide => "int32_t",
            Class::Huge => "int64_t",
        }
    }
}

/// How tightly an expression binds, from `?:` to names and calls.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Prec {
    Choice,
    Or,
    And,
    Compare,
    Sum,
    Product,
    Unary,
    Atom,
}

/// A C expression with the known facts about its value.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct CExpr {
    /// The C text.
    pub(crate) text: String,
    /// Its outermost operator.
    pub(crate) prec: Prec,
    /// Its type in C.
    pub(crate) class: Class,
    /// The smallest value; 0 or 1 for a Boolean.
    pub(crate) lo: i64,
    /// The largest value.
    pub(crate) hi: i64,
    /// True if the essential type of `text` is unsigned: it is a byte.
    pub(crate) is_unsigned: bool,
    /// The spelling whose essential type is that of `class`, if it differs from `text`: bytes are cast.
    signed: Option<(String, Prec)>,
    /// The spelling that is unsigned and at most one byte wide, if it differs from `text`.
    unsigned: Option<(String, Prec)>,
    /// The spelling for bit operators.
    bits: Option<Box<Bits>>,
    /// For a comparison with a constant: the compared expression and the constant. They show if a conjunction or disjunction of two
    /// comparisons is constant.
    pub(crate) asks: Option<Box<Question>>,
}

/// A comparison with a constant.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Question {
    /// The text of the expression that is compared.
    subject: String,
    /// Its interval.
    interval: (i64, i64),
    op: CompareOp,
    constant: i64,
}

impl Question {
    /// The question with the opposite answer.
    fn negated(self) -> Self {
        let op = match self.op {
            CompareOp::Eq => CompareOp::Ne,
            CompareOp::Ne => CompareOp::Eq,
            CompareOp::Lt => CompareOp::Ge,
            CompareOp::Ge => CompareOp::Lt,
            CompareOp::Le => CompareOp::Gt,
            CompareOp::Gt => CompareOp::Le,
        };
        Question { op, ..self }
    }

    /// The constant value of the conjunction (or disjunction) of two questions about the same expression, if it is constant.
    fn together(&self, other: &Question, is_and: bool) -> Option<bool> {
        if self.subject != other.subject {
            return None;
        }
        // Between these values neither answer changes.
        let (lo, hi) = self.interval;
        let near = |c: i64| [c.saturating_sub(1), c, c.saturating_add(1)];
        let mut points =
            [lo, hi].into_iter().chain(near(self.constant)).chain(near(other.constant));
        let differs = points.any(|point| {
            let answers =
                (self.op.apply(point, self.constant), other.op.apply(point, other.constant));
            (lo..=hi).contains(&point)
                && if is_and { answers.0 && answers.1 } else { !(answers.0 || answers.1) }
        });
        (!differs).then_some(!is_and)
    }
}

impl CExpr {
    /// An expression whose other spellings are filled in by the constructors.
    fn plain() -> Self {
        CExpr {
            text: String::new(),
            prec: Prec::Atom,
            class: Class::Int,
            lo: 0,
            hi: 0,
            is_unsigned: false,
            signed: None,
            unsigned: None,
            bits: None,
            asks: None,
        }
    }

    /// A Boolean constant.
    pub(crate) fn bool(value: bool) -> Self {
        let number = i64::from(value);
        CExpr {
            text: value.to_string(),
            prec: Prec::Atom,
            class: Class::Bool,
            lo: number,
            hi: number,
            asks: None,
            ..CExpr::plain()
        }
    }

    /// An integer constant in a spelling that has the right type even if `int` has 16 bits.
    pub(crate) fn int(value: i64) -> Self {
        let class = Class::of(value, value);
        let (text, prec) = literal(value, class);
        let unsigned =
            (class == Class::Int && value >= 0).then(|| (format!("{value}U"), Prec::Atom));
        CExpr { unsigned, text, prec, class, lo: value, hi: value, asks: None, ..CExpr::plain() }
    }

    /// A number with this interval and this type in C.
    pub(crate) fn exact(text: String, prec: Prec, class: Class, (lo, hi): (i64, i64)) -> Self {
        CExpr { text, prec, class, lo, hi, asks: None, ..CExpr::plain() }
    }

    /// A Boolean expression.
    pub(crate) fn condition(text: impl Into<String>, prec: Prec) -> Self {
        CExpr {
            text: text.into(),
            prec,
            class: Class::Bool,
            lo: 0,
            hi: 1,
            asks: None,
            ..CExpr::plain()
        }
    }

    /// A name or member that contains a value of this type, stored as [`storage`] defines.
    pub(crate) fn place(text: impl Into<String>, ty: Type) -> Self {
        match ty {
            Type::Bool => CExpr::condition(text, Prec::Atom),
            Type::Int { lo, hi } => {
                let text = text.into();
                let class = Class::of(lo, hi);
                match storage(ty) {
                    // An unsigned type as wide as the class would convert the other operand too, so it is widened at once.
                    "uint16_t" if class == Class::Wide => CExpr {
                        bits: Some(Box::new(Bits::Word(Word::place(&text, 16)))),
                        ..CExpr::exact(format!("(int32_t){text}"), Prec::Unary, class, (lo, hi))
                    },
                    "uint32_t" => CExpr {
                        bits: Some(Box::new(Bits::Word(Word::place(&text, 32)))),
                        ..CExpr::exact(format!("(int64_t){text}"), Prec::Unary, class, (lo, hi))
                    },
                    // It is narrower than the class, so arithmetic widens it anyway.
                    narrow @ ("uint8_t" | "int8_t" | "int16_t") => CExpr {
                        signed: Some((format!("(int){text}"), Prec::Unary)),
                        is_unsigned: narrow == "uint8_t",
                        ..CExpr::exact(text, Prec::Atom, class, (lo, hi))
                    },
                    _ => CExpr::exact(text, Prec::Atom, class, (lo, hi)),
                }
            }
        }
    }

    /// The value, if this is a constant.
    pub(crate) fn constant(&self) -> Option<i64> {
        (self.lo == self.hi).then_some(self.lo)
    }

    /// True for the constant `true`.
    pub(crate) fn is_true(&self) -> bool {
        self.class == Class::Bool && self.lo == 1
    }

    /// True for the constant `false`.
    pub(crate) fn is_false(&self) -> bool {
        self.class == Class::Bool && self.hi == 0
    }

    /// The text, in brackets if it binds less tightly than `at_least`.
    pub(crate) fn within(&self, at_least: Prec) -> String {
        if self.prec < at_least { format!("({})", self.text) } else { self.text.clone() }
    }

    /// The spelling whose essential type is signed and as wide as the class.
    fn as_signed(&self) -> CExpr {
        match &self.signed {
            Some((text, prec)) => CExpr::exact(text.clone(), *prec, self.class, (self.lo, self.hi)),
            None => self.clone(),
        }
    }

    /// The unsigned spelling, if it exists.
    fn as_unsigned(&self) -> Option<CExpr> {
        if self.is_unsigned {
            return Some(self.clone());
        }
        let (text, prec) = self.unsigned.clone()?;
        let expr = CExpr::exact(text, prec, self.class, (self.lo, self.hi));
        Some(CExpr { is_unsigned: true, signed: Some((self.text.clone(), self.prec)), ..expr })
    }

    /// Two operands in one essential type category: unsigned if one is a byte and the other is a byte or a literal.
    fn paired(a: CExpr, b: CExpr) -> (CExpr, CExpr) {
        if a.is_unsigned == b.is_unsigned {
            return (a, b);
        }
        let is_simple = |it: &CExpr| it.is_unsigned || it.constant().is_some();
        if is_simple(&a)
            && is_simple(&b)
            && let (Some(a), Some(b)) = (a.as_unsigned(), b.as_unsigned())
        {
            return (a, b);
        }
        (a.as_signed(), b.as_signed())
    }

    /// True for the result of an operator on numbers, whose essential type is that of its operands.
    fn is_composite(&self) -> bool {
        match self.prec {
            Prec::Choice | Prec::Sum | Prec::Product => true,
            Prec::Unary => self.text.starts_with('-') && self.constant().is_none(),
            Prec::Or | Prec::And | Prec::Compare | Prec::Atom => false,
        }
    }

    /// The text as an operand, in brackets unless its meaning is clear without knowing precedences (MISRA-C:2012, rule 12.1).
    fn operand(&self, outer: Prec) -> String {
        self.within(if self.prec == outer { outer } else { Prec::Unary })
    }

    /// The negation.
    pub(crate) fn not(self) -> Self {
        match self.constant() {
            Some(value) => CExpr::bool(value == 0),
            None => match self.text.strip_prefix('!') {
                Some(inner) if self.prec == Prec::Unary && !inner.starts_with('(') => {
                    CExpr::condition(inner, Prec::Atom)
                }
                _ => {
                    let text = format!("!{}", self.within(Prec::Unary));
                    let asks = self.asks.map(|question| Box::new(question.negated()));
                    CExpr { asks, ..CExpr::condition(text, Prec::Unary) }
                }
            },
        }
    }

    /// The conjunction; constant operands are simplified away.
    pub(crate) fn and(all: impl IntoIterator<Item = CExpr>) -> Self {
        Self::junction(all, true)
    }

    /// The disjunction; constant operands are simplified away.
    pub(crate) fn or(all: impl IntoIterator<Item = CExpr>) -> Self {
        Self::junction(all, false)
    }

    fn junction(all: impl IntoIterator<Item = CExpr>, is_and: bool) -> Self {
        let mut rest: Vec<CExpr> = Vec::new();
        for operand in all {
            if if is_and { operand.is_true() } else { operand.is_false() } {
                continue;
            }
            if if is_and { operand.is_false() } else { operand.is_true() } {
                return CExpr::bool(!is_and);
            }
            // Comparing pairs is quadratic, so only short lists are compared.
            if rest.len() <= 32 {
                // A repeated condition is dropped.
                if rest.iter().any(|earlier| earlier.text == operand.text) {
                    continue;
                }
                let known = operand.asks.as_ref().and_then(|question| {
                    rest.iter()
                        .filter_map(|earlier| earlier.asks.as_ref())
                        .find_map(|earlier| earlier.together(question, is_and))
                });
                if let Some(value) = known {
                    return CExpr::bool(value);
                }
            }
            rest.push(operand);
        }
        if rest.len() == 1
            && let Some(only) = rest.pop()
        {
            return only;
        }
        if rest.is_empty() {
            return CExpr::bool(is_and);
        }
        let (sign, prec) = if is_and { (" && ", Prec::And) } else { (" || ", Prec::Or) };
        let mut text = String::new();
        for (index, operand) in rest.iter().enumerate() {
            if index > 0 {
                text.push_str(sign);
            }
            // `a || b && c` is legal but causes a warning, so the inner operator gets brackets; a chain of one operator needs none.
            if operand.prec < Prec::Unary && operand.prec != prec {
                text.push('(');
                text.push_str(&operand.text);
                text.push(')');
            } else {
                text.push_str(&operand.text);
            }
        }
        CExpr::condition(text, prec)
    }

    /// A comparison of two numbers or two Booleans; constant if the intervals decide it.
    pub(crate) fn compare(op: CompareOp, a: CExpr, b: CExpr) -> Self {
        if a.class == Class::Bool {
            let wanted = matches!(op, CompareOp::Eq);
            return match (a.constant(), b.constant()) {
                (Some(x), Some(y)) => CExpr::bool((x == y) == wanted),
                (Some(x), None) => {
                    if (x == 1) == wanted {
                        b
                    } else {
                        b.not()
                    }
                }
                (None, Some(y)) => {
                    if (y == 1) == wanted {
                        a
                    } else {
                        a.not()
                    }
                }
                (None, None) if a.text == b.text => CExpr::bool(wanted),
                (None, None) => {
                    // cppcheck treats an operand of a comparison that is itself a comparison as a number, and its negation as a truth value.
                    let [is_a, is_b] = [&a, &b].map(|it| it.prec == Prec::Compare);
                    let (a, b) = (if is_a { a.not() } else { a }, if is_b { b.not() } else { b });
                    let sign = if wanted == (is_a == is_b) { "==" } else { "!=" };
                    let text = format!("{} {sign} {}", a.within(Prec::Atom), b.within(Prec::Atom));
                    CExpr::condition(text, Prec::Compare)
                }
            };
        }
        if let Some(known) = decided(op, &a, &b) {
            return CExpr::bool(known);
        }
        let subjects = (a.text.clone(), b.text.clone());
        let (left, right) = CExpr::compared_as_words(&a, &b).unwrap_or_else(|| {
            let (a, b) = CExpr::paired(a.clone(), b.clone());
            (a.within(Prec::Unary), b.within(Prec::Unary))
        });
        let text = format!("{left} {} {right}", c_sign(op));
        let asks = match (a.constant(), b.constant()) {
            (None, Some(constant)) => {
                Some(Question { interval: (a.lo, a.hi), subject: subjects.0, op, constant })
            }
            (Some(constant), None) => Some(Question {
                interval: (b.lo, b.hi),
                subject: subjects.1,
                op: op.mirrored(),
                constant,
            }),
            (Some(_), Some(_)) | (None, None) => None,
        };
        CExpr { asks: asks.map(Box::new), ..CExpr::condition(text, Prec::Compare) }
    }

    /// The conditional operator `?:`.
    pub(crate) fn select(condition: CExpr, a: CExpr, b: CExpr) -> Self {
        if condition.is_true() {
            return a;
        }
        if condition.is_false() {
            return b;
        }
        if a.class == Class::Bool {
            // Compilers warn about a constant arm if a truth value is expected.
            match (a.constant().map(|value| value == 1), b.constant().map(|value| value == 1)) {
                (Some(x), Some(y)) if x == y => return CExpr::bool(x),
                (Some(true), Some(_)) => return condition,
                (Some(false), Some(_)) => return condition.not(),
                (Some(true), None) => return CExpr::or([condition, b]),
                (Some(false), None) => return CExpr::and([condition.not(), b]),
                (None, Some(true)) => return CExpr::or([condition.not(), a]),
                (None, Some(false)) => return CExpr::and([condition, a]),
                (None, None) => {}
            }
            if a.prec == Prec::Compare || b.prec == Prec::Compare {
                // As in comparisons of truth values.
                return CExpr::select(condition, a.not(), b.not()).not();
            }
        }
        let choice = |a: &CExpr, b: &CExpr| {
            let (a, b) = (a.within(Prec::Unary), b.within(Prec::Unary));
            format!("{} ? {a} : {b}", condition.within(Prec::Atom))
        };
        let signed = (a.signed.is_some() || b.signed.is_some())
            .then(|| (choice(&a.as_signed(), &b.as_signed()), Prec::Choice));
        let (a, b) = if a.class == Class::Bool { (a, b) } else { CExpr::paired(a, b) };
        CExpr {
            text: choice(&a, &b),
            is_unsigned: a.is_unsigned,
            signed,
            prec: Prec::Choice,
            class: a.class.max(b.class),
            lo: a.lo.min(b.lo),
            hi: a.hi.max(b.hi),
            asks: None,
            ..CExpr::plain()
        }
    }

    /// The same value in a wider class.
    pub(crate) fn cast(self, class: Class) -> Self {
        let bounds = (self.lo, self.hi);
        CExpr::exact(self.converted(class.name()), Prec::Unary, class, bounds)
    }

    /// Casts to a C type; a composite is cast to its own type first if the types differ.
    fn converted(&self, name: &str) -> String {
        let own = self.class.name();
        if self.is_composite() && own != name {
            let signed = self.as_signed();
            format!("({name})({own}){}", signed.within(Prec::Unary))
        } else {
            format!("({name}){}", self.within(Prec::Unary))
        }
    }

    /// The value converted to the type that stores `ty`; the value must be within `ty` (see [`saturated`]).
    pub(crate) fn stored_as(&self, ty: Type) -> String {
        let name = storage(ty);
        let is_literal = self.constant().is_some() && self.prec >= Prec::Unary;
        // A value computed in the type that stores it needs no cast; nor does a literal that fits.
        if self.class == Class::Bool || is_literal || name == self.class.name() {
            return self.text.clone();
        }
        if name == "int8_t" && self.is_signed_word(8)
            || name == "int16_t" && self.is_signed_word(16)
        {
            return self.text.clone();
        }
        if let Some(Bits::Word(word) | Bits::Flipped(word, _)) = self.bits.as_deref() {
            let unsigned_bits = match name {
                "uint8_t" => Some(8),
                "uint16_t" => Some(16),
                "uint32_t" => Some(32),
                _ => None,
            };
            return word.converted(name, unsigned_bits);
        }
        if name == "uint8_t"
            && let Some(unsigned) = self.as_unsigned()
        {
            return format!("({name}){}", unsigned.within(Prec::Unary));
        }
        if matches!(name, "int8_t" | "int16_t") {
            return format!("({name}){}", self.as_signed().within(Prec::Unary));
        }
        self.converted(name)
    }
}

/// The result of a comparison of numbers, if the intervals decide it.
fn decided(op: CompareOp, a: &CExpr, b: &CExpr) -> Option<bool> {
    let below = a.hi < b.lo;
    let above = a.lo > b.hi;
    let not_above = a.hi <= b.lo;
    let not_below = a.lo >= b.hi;
    // Reading has no side effects, so equal texts have equal values; compilers warn about such comparisons.
    let same = a.text == b.text;
    match op {
        CompareOp::Eq | CompareOp::Le | CompareOp::Ge if same => Some(true),
        CompareOp::Ne | CompareOp::Lt | CompareOp::Gt if same => Some(false),
        CompareOp::Eq if below || above => Some(false),
        CompareOp::Ne if below || above => Some(true),
        CompareOp::Lt if below => Some(true),
        CompareOp::Lt if not_below => Some(false),
        CompareOp::Le if not_above => Some(true),
        CompareOp::Le if above => Some(false),
        CompareOp::Gt if above => Some(true),
        CompareOp::Gt if not_above => Some(false),
        CompareOp::Ge if not_below => Some(true),
        CompareOp::Ge if below => Some(false),
        CompareOp::Eq
        | CompareOp::Ne
        | CompareOp::Lt
        | CompareOp::Le
        | CompareOp::Gt
        | CompareOp::Ge => None,
    }
}

fn c_sign(op: CompareOp) -> &'static str {
    match op {
        CompareOp::Eq => "==",
        CompareOp::Ne => "!=",
        CompareOp::Lt => "<",
        CompareOp::Le => "<=",
        CompareOp::Gt => ">",
        CompareOp::Ge => ">=",
    }
}

/// A constant in a spelling that has the type of its class on every target.
fn literal(value: i64, class: Class) -> (String, Prec) {
    let magnitude = value.unsigned_abs();
    let wrap = |digits: u64| match class {
        Class::Bool | Class::Int => digits.to_string(),
        Class::Wide => format!("INT32_C({digits})"),
        Class::Huge => format!("INT64_C({digits})"),
    };
    let lowest = match class {
        Class::Bool | Class::Int => i64::from(i16::MIN),
        Class::Wide => i64::from(i32::MIN),
        Class::Huge => i64::MIN,
    };
    if value >= 0 {
        (wrap(magnitude), Prec::Atom)
    } else if value == lowest {
        // C has no literal of this type for the magnitude of the smallest value.
        (format!("(-{} - 1)", wrap(magnitude - 1)), Prec::Atom)
    } else {
        (format!("-{}", wrap(magnitude)), Prec::Unary)
    }
}

/// How the leaves of an expression are read in C.
pub(crate) trait Scope<L> {
    /// The prefix of function names.
    fn prefix(&self) -> &str;
    /// A plain leaf.
    fn leaf(&mut self, leaf: &L) -> CExpr;
    /// One element of an array.
    fn element(&mut self, array: &L, index: &CExpr) -> CExpr;
}

/// `expr` in C. The recursion is as deep as the expression; validation bounds that depth.
pub(crate) fn c_expr<L>(expr: &Expr<L>, scope: &mut impl Scope<L>) -> CExpr {
    match &expr.kind {
        ExprKind::Bool(value) => CExpr::bool(*value),
        ExprKind::Int(value) => CExpr::int(*value),
        ExprKind::Leaf(leaf) => scope.leaf(leaf),
        ExprKind::Element(array, index) => {
            let index = c_expr(index, scope);
            scope.element(array, &index)
        }
        ExprKind::Not(a) => c_expr(a, scope).not(),
        ExprKind::And(all) => CExpr::and(all.iter().map(|a| c_expr(a, scope)).collect::<Vec<_>>()),
        ExprKind::Or(all) => CExpr::or(all.iter().map(|a| c_expr(a, scope)).collect::<Vec<_>>()),
        ExprKind::Compare(op, a, b) => {
            let a = c_expr(a, scope);
            CExpr::compare(*op, a, c_expr(b, scope))
        }
        ExprKind::Neg(a) => c_expr(a, scope).neg(),
        ExprKind::Arith(op, a, b) => {
            let a = c_expr(a, scope);
            let b = c_expr(b, scope);
            CExpr::arith_by(*op, a, b, scope.prefix())
        }
        ExprKind::Select(c, a, b) => {
            let c = c_expr(c, scope);
            let a = c_expr(a, scope);
            CExpr::select(c, a, c_expr(b, scope))
        }
    }
}

/// Joins conditions with one operator (`&&` or `||`); puts brackets around each one that is not a name, a call or already in brackets.
pub(crate) fn joined(conditions: &[String], sign: &str) -> String {
    if let [only] = conditions {
        return only.clone();
    }
    let bracketed = |text: &String| {
        let mut depth = 0_usize;
        let is_open = text.chars().any(|c| {
            match c {
                '(' | '[' => depth += 1,
                ')' | ']' => depth = depth.saturating_sub(1),
                _ => {}
            }
            c == ' ' && depth == 0
        });
        if is_open { format!("({text})") } else { text.clone() }
    };
    conditions.iter().map(bracketed).join(&format!(" {sign} "))
}

/// A constant of a type, as text.
pub(crate) fn constant(value: i64, ty: Type) -> String {
    match ty {
        Type::Bool => (value != 0).to_string(),
        Type::Int { .. } => CExpr::int(value).text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use grafsynth_ir::expr::ArithOp;

    pub(super) fn var(name: &str, lo: i64, hi: i64) -> CExpr {
        CExpr::place(name, Type::Int { lo, hi })
    }

    #[test]
    fn a_choice_with_a_constant_arm_is_a_junction() {
        let c = || CExpr::condition("c", Prec::Atom);
        let x = || CExpr::condition("x", Prec::Atom);
        let text = |a: CExpr, b: CExpr| CExpr::select(c(), a, b).text;
        assert_eq!(text(CExpr::bool(true), x()), "c || x");
        assert_eq!(text(CExpr::bool(false), x()), "!c && x");
        assert_eq!(text(x(), CExpr::bool(true)), "!c || x");
        assert_eq!(text(x(), CExpr::bool(false)), "c && x");
        assert_eq!(text(CExpr::bool(false), CExpr::bool(true)), "!c");
        assert_eq!(text(CExpr::bool(true), CExpr::bool(true)), "true");
        assert_eq!(text(x(), x()), "c ? x : x");
    }

    #[test]
    fn nothing_that_an_int_of_16_bits_does_not_hold_is_read_as_one() {
        for (lo, hi, text) in
            [(0, 255, "n"), (0, 256, "n"), (0, 32767, "n"), (0, 32768, "(int32_t)n")]
        {
            assert_eq!(var("n", lo, hi).text, text);
        }
        assert_eq!(storage(Type::Int { lo: 0, hi: 300 }), "int16_t");
    }

    #[test]
    fn constants_have_their_type_on_every_target() {
        assert_eq!(CExpr::int(-32768).text, "(-32767 - 1)");
        assert_eq!(CExpr::int(40000).text, "INT32_C(40000)");
        assert_eq!(CExpr::int(i64::MIN).text, "(-INT64_C(9223372036854775807) - 1)");
        assert_eq!(CExpr::int(-5).neg().text, "5");
        assert_eq!(CExpr::arith(ArithOp::Sub, var("n", 0, 9), CExpr::int(-5)).text, "(int)n - -5");
    }

    #[test]
    fn decided_comparisons_are_constants() {
        assert!(CExpr::compare(CompareOp::Ge, var("n", 0, 9), CExpr::int(0)).is_true());
        assert!(CExpr::compare(CompareOp::Gt, var("n", 0, 9), CExpr::int(9)).is_false());
        assert_eq!(CExpr::compare(CompareOp::Gt, var("n", 0, 9), CExpr::int(8)).text, "n > 8U");
    }

    #[test]
    fn contradictions_are_constants() {
        let n = || var("n", 0, 99);
        let ask = |op, constant| CExpr::compare(op, n(), CExpr::int(constant));
        assert!(CExpr::and([ask(CompareOp::Lt, 3), ask(CompareOp::Gt, 10)]).is_false());
        assert!(CExpr::or([ask(CompareOp::Ne, 3), ask(CompareOp::Ge, 3)]).is_true());
        assert_eq!(
            CExpr::and([ask(CompareOp::Gt, 3), ask(CompareOp::Lt, 5)]).text,
            "(n > 3U) && (n < 5U)"
        );
    }

    #[test]
    fn brackets_stand_where_a_compiler_wants_them() {
        let atom = |name: &str| CExpr::condition(name, Prec::Atom);
        let both = CExpr::and([atom("a"), atom("b")]);
        let text = CExpr::or([both.clone(), atom("c")]).text;
        assert_eq!(text, "(a && b) || c");
        assert_eq!(both.not().text, "!(a && b)");
        let equal = CExpr::compare(CompareOp::Eq, atom("a").not(), atom("b"));
        assert_eq!(equal.text, "(!a) == b");
    }

    #[test]
    fn negated_questions_are_seen_together() {
        let ask = |value| {
            let place = CExpr::place("x", Type::Int { lo: 0, hi: 9 });
            CExpr::compare(CompareOp::Eq, place, CExpr::int(value)).not()
        };
        assert!(CExpr::or([ask(3), ask(4)]).is_true());
        assert!(CExpr::and([ask(3), ask(3).not()]).is_false());
        assert_eq!(CExpr::or([ask(3), ask(3)]).text, "!(x == 3U)");
    }
}
