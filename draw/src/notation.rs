//! Expressions and statements as text: with the signs of Grafcet, with those of structured text (ST), or with the words of the chart language.

use crate::text::Rich;
use grafsynth_ir::chart::{Expr, Leaf, Path, Stmt, StmtKind};
use grafsynth_ir::expr::{ArithOp, CompareOp, ExprKind};
use std::collections::BTreeSet;
use std::rc::Rc;

/// Precedence of the context, lowest first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Level {
    Open,
    Or,
    And,
    Not,
    Compare,
    Add,
    Mul,
    Prefix,
}

/// The words that are not names in the chart language.
const RESERVED: [&str; 16] = [
    "and",
    "or",
    "not",
    "mod",
    "band",
    "bor",
    "bxor",
    "bnot",
    "shl",
    "shr",
    "true",
    "false",
    "otherwise",
    "if",
    "rise",
    "fall",
];

/// The words of structured text that are not names in it; letter case is ignored.
const ST_RESERVED: [&str; 14] = [
    "AND", "OR", "XOR", "NOT", "MOD", "TRUE", "FALSE", "IF", "THEN", "ELSE", "END_IF", "SEL",
    "R_TRIG", "F_TRIG",
];

/// The signs and words of conditions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum Signs {
    /// The signs of Grafcet: `a · b`, a line over a complement.
    #[default]
    Grafcet,
    /// The words of the chart language: `a and not b`.
    Words,
    /// Structured text: `a AND NOT b`; what it lacks has the words of the chart language.
    St,
}

/// How the expressions of one design are written.
#[derive(Debug, Clone, Default)]
pub(crate) struct Notation {
    pub(crate) signs: Signs,
    /// All names that the design declares: `Xp` is the activity of step `p` only if nothing else is called `Xp`, and the name `a.b` is plain only if nothing is
    /// called `a`.
    pub(crate) declared: Rc<BTreeSet<String>>,
}

impl Notation {
    /// The same with the words of the chart language.
    pub(crate) fn spelled(&self) -> Notation {
        Notation { signs: Signs::Words, declared: Rc::clone(&self.declared) }
    }

    pub(crate) fn expr(&self, expr: &Expr) -> Rich {
        let mut out = Rich::default();
        self.write(&mut out, expr, Level::Open);
        out
    }

    /// The conjunction of conditions that are already text; each must be an operand of AND.
    pub(crate) fn all(&self, conditions: &[Rich]) -> Rich {
        let mut out = Rich::default();
        for (index, condition) in conditions.iter().enumerate() {
            if index > 0 {
                out.push(self.and());
            }
            out.append(condition);
        }
        out
    }

    /// An expression as an operand of AND.
    pub(crate) fn operand(&self, expr: &Expr) -> Rich {
        let mut out = Rich::default();
        let level = if self.is_spelled() { Level::Not } else { Level::And };
        self.write(&mut out, expr, level);
        out
    }

    /// One of several events as an operand of AND.
    pub(crate) fn any_of(&self, names: &[String]) -> Rich {
        let names: Vec<String> = names.iter().map(|name| self.word(name)).collect();
        match names.as_slice() {
            [only] => Rich::plain(only),
            several => Rich::plain(format!("({})", several.join(self.or()))),
        }
    }

    /// True once the step has been active for `ns`, as an operand of AND.
    pub(crate) fn elapsed(&self, step: &Path, ns: u64) -> Rich {
        match self.activity(step) {
            Some(activity) => Rich::plain(format!("{}/{activity}", self.duration(ns))),
            None => self.compared(&self.time(step), ">=", &self.duration(ns)),
        }
    }

    /// A comparison as an operand of AND.
    pub(crate) fn compared(&self, left: &str, symbol: &str, right: &str) -> Rich {
        Rich::plain(match (self.is_spelled(), symbol) {
            (true, _) => format!("{left} {symbol} {right}"),
            (false, ">=") => format!("[{left} ≥ {right}]"),
            (false, _) => format!("[{left} {symbol} {right}]"),
        })
    }

    /// The time of a step as an operand of a comparison.
    pub(crate) fn time(&self, step: &Path) -> String {
        format!("{}.{}", self.around(step), if self.signs == Signs::St { "T" } else { "t" })
    }

    /// A duration; in structured text a literal.
    pub(crate) fn duration(&self, ns: u64) -> String {
        if self.signs == Signs::St { literal(ns) } else { duration(ns) }
    }

    /// A name by itself; one that is not plain is in backquotes. Plain are words that are not of the notation, and such words with dots between them if this
    /// cannot be a member of something else.
    pub(crate) fn word(&self, name: &str) -> String {
        if self.is_dotted(name) { name.to_owned() } else { self.name_in_path(name) }
    }

    fn is_dotted(&self, name: &str) -> bool {
        let mut words = name.split('.');
        let first = words.next().unwrap_or_default();
        // The activity and the time of a step, in the chart language and in structured text.
        let is_of_step =
            ["active", "t", "X", "T"].iter().any(|it| words.clone().next_back() == Some(it));
        let is_plain = |word: &str| self.name_in_path(word) == word;
        name.contains('.')
            && is_plain(first)
            && words.all(is_plain)
            && !is_of_step
            && !self.declared.contains(first)
    }

    fn name_in_path(&self, name: &str) -> String {
        let is_taken = |word: &str| word.eq_ignore_ascii_case(name);
        if self.signs == Signs::St && ST_RESERVED.iter().any(|word| is_taken(word)) {
            format!("`{name}`")
        } else {
            word(name)
        }
    }

    /// A path; names that are not plain words are in backquotes.
    pub(crate) fn path(&self, path: &Path) -> String {
        if let [only] = path.names.as_slice() {
            return self.word(&only.text);
        }
        self.around(path)
    }

    /// A path before the name of a member.
    fn around(&self, path: &Path) -> String {
        let names: Vec<String> =
            path.names.iter().map(|name| self.name_in_path(&name.text)).collect();
        names.join(".")
    }

    /// True for words, false for signs with overlines and brackets.
    fn is_spelled(&self) -> bool {
        self.signs != Signs::Grafcet
    }

    fn and(&self) -> &'static str {
        self.choose(" · ", " and ", " AND ")
    }

    fn or(&self) -> &'static str {
        self.choose(" + ", " or ", " OR ")
    }

    fn choose(&self, grafcet: &'static str, words: &'static str, st: &'static str) -> &'static str {
        match self.signs {
            Signs::Grafcet => grafcet,
            Signs::Words => words,
            Signs::St => st,
        }
    }

    /// `Xp` for the activity of step `p`, if this is unambiguous.
    fn activity(&self, step: &Path) -> Option<String> {
        let text = self.path(step);
        let first = step.names.first().filter(|_| !self.is_spelled())?;
        let is_own = is_word(&first.text) && !self.declared.contains(&format!("X{}", first.text));
        is_own.then(|| format!("X{text}"))
    }

    fn write(&self, out: &mut Rich, expr: &Expr, within: Level) {
        let own = match &expr.kind {
            ExprKind::Select(..) => Level::Open,
            ExprKind::Or(all) | ExprKind::And(all) if all.len() < 2 => {
                match all.first() {
                    Some(only) => self.write(out, only, within),
                    None => out.push(self.truth(matches!(expr.kind, ExprKind::And(_)))),
                }
                return;
            }
            ExprKind::Or(_) => Level::Or,
            ExprKind::And(_) => Level::And,
            ExprKind::Not(_) if self.is_spelled() => Level::Not,
            ExprKind::Compare(..) if self.is_spelled() => Level::Compare,
            ExprKind::Arith(op, _, b) if is_complement(*op, b) => Level::Prefix,
            ExprKind::Arith(op, ..) if op.is_sum() => Level::Add,
            ExprKind::Arith(..) => Level::Mul,
            // A duration before a slash would be read as a delay.
            ExprKind::Leaf(Leaf::Duration(_) | Leaf::Delay(..)) => Level::Add,
            _ => Level::Prefix,
        };
        // Signs have brackets around comparisons, so only an operand of a prefix needs parentheses around a delay.
        let is_delay = matches!(expr.kind, ExprKind::Leaf(Leaf::Delay(..)));
        if own < within && !(is_delay && within <= Level::Compare) {
            out.push("(");
            self.write_bare(out, expr);
            out.push(")");
        } else {
            self.write_bare(out, expr);
        }
    }

    pub(crate) fn truth(&self, value: bool) -> &'static str {
        if value { self.choose("1", "true", "TRUE") } else { self.choose("0", "false", "FALSE") }
    }

    fn write_bare(&self, out: &mut Rich, expr: &Expr) {
        match &expr.kind {
            ExprKind::Bool(value) => out.push(self.truth(*value)),
            ExprKind::Int(value) => out.push(&value.to_string()),
            ExprKind::Leaf(leaf) => self.leaf(out, leaf),
            ExprKind::Element(array, index) => {
                self.leaf(out, array);
                out.push("[");
                self.write(out, index, Level::Open);
                out.push("]");
            }
            ExprKind::Not(inner) if self.is_spelled() => {
                out.push(self.choose("", "not ", "NOT "));
                let is_not = matches!(inner.kind, ExprKind::Not(_));
                self.write(out, inner, if is_not { Level::Not } else { Level::Prefix });
            }
            ExprKind::Not(inner) => {
                let start = out.text.len();
                self.write(out, inner, Level::Open);
                out.overline(start);
            }
            ExprKind::And(all) => self.list(
                out,
                all,
                self.and(),
                if self.is_spelled() { Level::Not } else { Level::And },
            ),
            ExprKind::Or(all) => self.list(out, all, self.or(), Level::And),
            ExprKind::Compare(op, a, b) => self.compare(out, *op, a, b),
            ExprKind::Neg(inner) => {
                out.push("-");
                if matches!(inner.kind, ExprKind::Int(_) | ExprKind::Neg(_)) {
                    out.push("(");
                    self.write(out, inner, Level::Open);
                    out.push(")");
                } else {
                    self.write(out, inner, Level::Prefix);
                }
            }
            ExprKind::Arith(op, a, b) => self.arith(out, *op, a, b),
            ExprKind::Select(condition, a, b) if self.signs == Signs::St => {
                // SEL has the value for FALSE first.
                out.push("SEL(");
                for (index, operand) in [condition, b, a].into_iter().enumerate() {
                    out.push(if index > 0 { ", " } else { "" });
                    self.write(out, operand, Level::Open);
                }
                out.push(")");
            }
            ExprKind::Select(condition, a, b) => {
                out.push("if ");
                self.write(out, condition, Level::Or);
                out.push(" then ");
                self.write(out, a, Level::Or);
                out.push(" else ");
                self.write(out, b, Level::Or);
            }
        }
    }

    fn compare(&self, out: &mut Rich, op: CompareOp, a: &Expr, b: &Expr) {
        if let (false, CompareOp::Ge, Some(step), ExprKind::Leaf(Leaf::Duration(ns))) =
            (self.is_spelled(), op, timed_step(a), &b.kind)
            && self.activity(&step).is_some()
        {
            return out.append(&self.elapsed(&step, *ns));
        }
        // A junction inside a comparison gets parentheses.
        let level = |side: &Expr| {
            let is_junction = matches!(side.kind, ExprKind::And(_) | ExprKind::Or(_));
            if is_junction { Level::Prefix } else { Level::Add }
        };
        if !self.is_spelled() {
            out.push("[");
        }
        self.write(out, a, level(a));
        out.push(match op {
            CompareOp::Ne if !self.is_spelled() => " ≠ ",
            CompareOp::Le if !self.is_spelled() => " ≤ ",
            CompareOp::Ge if !self.is_spelled() => " ≥ ",
            CompareOp::Eq => " = ",
            CompareOp::Ne => " <> ",
            CompareOp::Lt => " < ",
            CompareOp::Le => " <= ",
            CompareOp::Gt => " > ",
            CompareOp::Ge => " >= ",
        });
        self.write(out, b, level(b));
        if !self.is_spelled() {
            out.push("]");
        }
    }

    fn arith(&self, out: &mut Rich, op: ArithOp, a: &Expr, b: &Expr) {
        if is_complement(op, b) {
            out.push("bnot ");
            return self.write(out, a, Level::Prefix);
        }
        let (left, right) =
            if op.is_sum() { (Level::Add, Level::Mul) } else { (Level::Mul, Level::Prefix) };
        let level = |side: &Expr, level| match &side.kind {
            ExprKind::Arith(inner, ..)
                if *inner != op && (inner.is_bitwise() || op.is_bitwise()) =>
            {
                Level::Prefix
            }
            _ => level,
        };
        self.write(out, a, level(a, left));
        out.push(" ");
        out.push(if op == ArithOp::Mod { self.choose("mod", "mod", "MOD") } else { op.symbol() });
        out.push(" ");
        self.write(out, b, level(b, right));
    }

    fn list(&self, out: &mut Rich, all: &[Expr], between: &str, level: Level) {
        for (index, operand) in all.iter().enumerate() {
            if index > 0 {
                out.push(between);
            }
            self.write(out, operand, level);
        }
    }

    fn leaf(&self, out: &mut Rich, leaf: &Leaf) {
        match leaf {
            Leaf::Name(name) => out.push(&self.name(name)),
            Leaf::Rise(inner) | Leaf::Fall(inner) if self.is_spelled() => {
                out.push(if matches!(leaf, Leaf::Rise(_)) {
                    self.choose("", "rise(", "R_TRIG(")
                } else {
                    self.choose("", "fall(", "F_TRIG(")
                });
                self.write(out, inner, Level::Open);
                out.push(")");
            }
            Leaf::Rise(inner) | Leaf::Fall(inner) => {
                out.push(if matches!(leaf, Leaf::Rise(_)) { "↑" } else { "↓" });
                // A complement is drawn over its operand only, not over the arrow.
                self.write(out, inner, Level::Prefix);
            }
            Leaf::Otherwise => out.push("otherwise"),
            Leaf::Duration(ns) => out.push(&self.duration(*ns)),
            Leaf::Delay(on, inner, off) => {
                out.push(&self.duration(*on));
                out.push("/");
                match &inner.kind {
                    // `3s/Xp` is the time of a step, so the delay of its activity is written in full.
                    ExprKind::Leaf(Leaf::Name(name)) if !self.is_spelled() => {
                        out.push(&self.path(name));
                    }
                    _ => self.write(out, inner, Level::Prefix),
                }
                if *off > 0 {
                    out.push("/");
                    out.push(&self.duration(*off));
                }
            }
        }
    }

    /// A name in an expression, with the notation's own form for the activity and the time of a step.
    fn name(&self, name: &Path) -> String {
        let step = step_of(name, "active");
        match (self.signs, step, step_of(name, "t")) {
            (Signs::St, Some(step), _) => format!("{}.X", self.around(&step)),
            (Signs::St, None, Some(step)) => self.time(&step),
            (_, step, _) => {
                step.and_then(|it| self.activity(&it)).unwrap_or_else(|| self.path(name))
            }
        }
    }

    /// A list of statements: in structured text, or else with the words of the chart language.
    pub(crate) fn block(&self, block: &[Stmt]) -> String {
        let signs = if self.signs == Signs::St { Signs::St } else { Signs::Words };
        let spelled = Notation { signs, declared: Rc::clone(&self.declared) };
        let all: Vec<String> = block.iter().map(|stmt| spelled.stmt(stmt)).collect();
        all.join("; ")
    }

    fn stmt(&self, stmt: &Stmt) -> String {
        let say = |expr: &Expr| self.expr(expr).text;
        match &stmt.kind {
            StmtKind::Assign { target, index, value } => {
                let index = index.as_ref().map(|index| format!("[{}]", say(index)));
                format!("{}{} := {}", self.path(target), index.unwrap_or_default(), say(value))
            }
            StmtKind::Raise(event) => format!("raise {}", self.word(&event.text)),
            StmtKind::Send { event, after, slot } => {
                let mut text = format!("send {}", self.word(&event.text));
                if let Some(ns) = after {
                    text.push_str(&format!(" after {}", self.duration(*ns)));
                }
                if let Some(slot) = slot {
                    text.push_str(&format!(" as {}", self.word(&slot.text)));
                }
                text
            }
            StmtKind::Cancel(slot) => format!("cancel {}", self.word(&slot.text)),
            StmtKind::Call { function, arguments } => {
                let arguments: Vec<String> = arguments.iter().map(say).collect();
                format!("call {}({})", self.word(&function.text), arguments.join(", "))
            }
            StmtKind::If { condition, then, otherwise } if self.signs == Signs::St => {
                let mut text = format!("IF {} THEN {};", say(condition), self.block(then));
                if !otherwise.is_empty() {
                    text.push_str(&format!(" ELSE {};", self.block(otherwise)));
                }
                text.push_str(" END_IF");
                text
            }
            StmtKind::If { condition, then, otherwise } => {
                let mut text = format!("if {} {{ {} }}", say(condition), self.block(then));
                if !otherwise.is_empty() {
                    text.push_str(&format!(" else {{ {} }}", self.block(otherwise)));
                }
                text
            }
            StmtKind::Code(code) => {
                format!("code {} {}", self.word(&code.language), quoted(&code.text))
            }
        }
    }
}

fn is_complement(op: ArithOp, right: &Expr) -> bool {
    op == ArithOp::BitXor && right.kind == ExprKind::Int(-1)
}

/// The step of a path such as `p.active`, if the path ends in `member`.
fn step_of(path: &Path, member: &str) -> Option<Path> {
    let (last, step) = path.names.split_last()?;
    (last.text == member && !step.is_empty()).then(|| Path { names: step.to_vec() })
}

/// The step whose time `p.t` an expression is.
fn timed_step(expr: &Expr) -> Option<Path> {
    match &expr.kind {
        ExprKind::Leaf(Leaf::Name(name)) => step_of(name, "t"),
        _ => None,
    }
}

fn is_word(text: &str) -> bool {
    let mut chars = text.chars();
    chars.next().is_some_and(|c| c.is_ascii_alphabetic() || c == '_')
        && chars.all(|c| c.is_ascii_alphanumeric() || c == '_')
        && !RESERVED.contains(&text)
}

/// A name; one that is not a plain word is in backquotes.
fn word(name: &str) -> String {
    // Letters of other scripts make plain names, too, but here only ASCII and letters are surely plain.
    let is_plain = is_word(name)
        || !RESERVED.contains(&name)
            && name.chars().next().is_some_and(|c| c.is_alphabetic() || c == '_')
            && name.chars().all(|c| c.is_alphanumeric() || c == '_');
    if is_plain { name.to_owned() } else { format!("`{name}`") }
}

/// A text in quotes.
pub(crate) fn quoted(text: &str) -> String {
    let mut out = String::from("\"");
    for c in text.chars() {
        match c {
            '"' => out.push_str("\\\""),
            '\\' => out.push_str("\\\\"),
            '\n' => out.push_str("\\n"),
            '\r' => out.push_str("\\r"),
            '\t' => out.push_str("\\t"),
            c => out.push(c),
        }
    }
    out.push('"');
    out
}

/// A duration in the largest unit that needs no fraction, without the space of the chart language.
pub(crate) fn duration(ns: u64) -> String {
    grafsynth_ir::duration(ns).replace(' ', "")
}

/// A duration as a literal of IEC 61131-3: `T#1500ms`.
pub(crate) fn literal(ns: u64) -> String {
    let text = grafsynth_ir::duration(ns);
    let (number, unit) = text.split_once(' ').unwrap_or((&text, ""));
    format!("T#{number}{}", if unit == "min" { "m" } else { unit })
}
