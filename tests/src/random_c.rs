//! Random C functions in the subset that becomes a chart, as trees that can be shrunk.
//!
//! Every program terminates: each round of a loop and each label uses one unit of fuel, and a program without fuel returns. Undefined
//! behaviour may occur; the compiler's sanitizer detects it, and such runs are ignored.

use grafsynth_sim::Random;
use std::fmt::Write;

/// A statement.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum S {
    /// Text with its semicolon.
    Plain(String),
    /// `if`, with or without `else`.
    If(String, Vec<S>, Option<Vec<S>>),
    /// `while`.
    While(String, Vec<S>),
    /// `do`.
    Do(Vec<S>, String),
    /// `for`; each part may be empty.
    For(String, String, String, Vec<S>),
    /// `switch`: its selector and, for each section, the label (`None` is `default`), the statements, and whether `break` follows.
    Switch(String, Vec<(Option<i64>, Vec<S>, bool)>),
    /// Duff's device: a `switch` with labels inside a loop.
    Duff(String, Vec<Vec<S>>, String),
    /// A label.
    Label(usize),
}

/// A program: one function with three parameters, and its callees.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Program {
    /// The statements of the function.
    pub body: Vec<S>,
    /// The statements of the called function.
    pub helper: Vec<S>,
}

/// The number of loop rounds in one run.
const FUEL: u32 = 12;

struct Maker<'r> {
    random: &'r mut Random,
    n_labels: usize,
    in_loop: bool,
    in_helper: bool,
    /// The variable that the current expression may change, and that it reads nowhere else.
    changed: Option<&'static str>,
}

const VARS: [&str; 9] = ["a", "b", "c", "s", "u8", "u", "ch", "w", "q"];
const HELPER_VARS: [&str; 3] = ["x", "y", "z"];

/// A random program.
#[must_use]
pub fn random_program(seed: u64) -> Program {
    let mut random = Random::new(seed);
    let mut maker =
        Maker { random: &mut random, n_labels: 0, in_loop: false, in_helper: false, changed: None };
    let n_statements = 2 + maker.random.below(6);
    let body = maker.statements(n_statements, 3);
    maker.in_helper = true;
    maker.n_labels = 0;
    let n_helper = 1 + maker.random.below(3);
    let helper = maker.statements(n_helper, 2);
    Program { body, helper }
}

impl Maker<'_> {
    fn statements(&mut self, n: usize, depth: usize) -> Vec<S> {
        (0..n).map(|_| self.statement(depth)).collect()
    }

    fn block(&mut self, depth: usize) -> Vec<S> {
        let n = self.random.below(4);
        self.statements(n, depth)
    }

    fn body(&mut self, depth: usize) -> Vec<S> {
        let was = std::mem::replace(&mut self.in_loop, true);
        let body = self.block(depth);
        self.in_loop = was;
        body
    }

    fn statement(&mut self, depth: usize) -> S {
        let choice = self.random.below(if depth == 0 { 9 } else { 20 });
        match choice {
            0..=4 => S::Plain(self.assignment()),
            5 if self.in_loop => {
                S::Plain(if self.random.one_in(2) { "break;" } else { "continue;" }.to_owned())
            }
            5 => S::Plain(";".to_owned()),
            6 if self.n_labels > 0 => {
                S::Plain(format!("goto L{};", self.random.below(self.n_labels)))
            }
            7 if self.n_labels < 3 => {
                self.n_labels += 1;
                S::Label(self.n_labels - 1)
            }
            8 if self.random.one_in(3) => S::Plain(format!("return {};", self.full(2))),
            6..=8 => S::Plain(self.effect()),
            9..=12 => {
                let condition = self.full(3);
                let then = self.block(depth - 1);
                let otherwise =
                    if self.random.one_in(2) { Some(self.block(depth - 1)) } else { None };
                S::If(condition, then, otherwise)
            }
            13 => S::While(self.full(2), self.body(depth - 1)),
            14 => {
                let body = self.body(depth - 1);
                S::Do(body, self.full(2))
            }
            15 | 16 => {
                let first = if self.random.one_in(4) {
                    String::new()
                } else {
                    self.effect().trim_end_matches(';').to_owned()
                };
                let condition = if self.random.one_in(4) { String::new() } else { self.full(2) };
                let last = if self.random.one_in(4) {
                    String::new()
                } else {
                    self.effect().trim_end_matches(';').to_owned()
                };
                S::For(first, condition, last, self.body(depth - 1))
            }
            17 | 18 => {
                let value = self.full(2);
                let n = 1 + self.random.below(4);
                let mut cases: Vec<(Option<i64>, Vec<S>, bool)> = Vec::new();
                let default = self.random.below(6);
                for case in 0..n {
                    let label = if case == default {
                        None
                    } else {
                        Some(i64::try_from(case).unwrap_or(0) * 3 - 2)
                    };
                    cases.push((label, self.block(depth - 1), self.random.one_in(2)));
                }
                S::Switch(format!("({value}) % 8"), cases)
            }
            _ => {
                let n = 2 + self.random.below(3);
                let parts = (0..n).map(|_| vec![S::Plain(self.assignment())]).collect();
                S::Duff(format!("({}) & 3", self.full(2)), parts, self.full(2))
            }
        }
    }

    fn var(&mut self) -> &'static str {
        let all: &[&'static str] = if self.in_helper { &HELPER_VARS } else { &VARS };
        loop {
            let var = all[self.random.below(all.len())];
            if self.changed != Some(var) {
                return var;
            }
        }
    }

    fn assignment(&mut self) -> String {
        let target = self.var();
        let op = ["=", "=", "=", "+=", "-=", "*=", "/=", "%=", "&=", "|=", "^=", "<<=", ">>="]
            [self.random.below(13)];
        if !self.in_helper && self.random.one_in(5) {
            let (index, value) = (self.index(), self.pure(3));
            return format!("v[{index}] {op} {value};");
        }
        let value = if op == "=" { self.full_without(target) } else { self.pure(2) };
        format!("{target} {op} {value};")
    }

    fn effect(&mut self) -> String {
        let target = self.var();
        match self.random.below(6) {
            0 => format!("{target}++;"),
            1 => format!("--{target};"),
            2 => format!("{target} = {}, {target}++;", self.pure(2)),
            3 if !self.in_helper => format!("v[{}]--;", self.index()),
            4 if !self.in_helper => {
                format!("{target} = helper({}, {});", self.pure(2), self.pure(2))
            }
            5 if !self.in_helper => {
                format!("fill(v, &{});", if self.random.one_in(2) { "a" } else { "b" })
            }
            _ => self.assignment(),
        }
    }

    fn index(&mut self) -> String {
        let inner = self.pure(1);
        format!("(unsigned)({inner}) % 5")
    }

    /// A full expression, in which one variable may change.
    fn full(&mut self, depth: usize) -> String {
        if self.in_helper || !self.random.one_in(3) {
            return self.pure(depth);
        }
        let target = self.var();
        self.changing(target, depth)
    }

    fn full_without(&mut self, target: &'static str) -> String {
        if self.in_helper || !self.random.one_in(4) {
            return self.pure(3);
        }
        self.changed = Some(target);
        let other = self.var();
        self.changed = None;
        // The right side of an assignment must not change the target: a read there would be sequenced before the assignment, but a change would not.
        self.changing(other, 2)
    }

    fn changing(&mut self, target: &'static str, depth: usize) -> String {
        self.changed = Some(target);
        let (left, right) = (self.pure(depth), self.pure(1));
        let effect = match self.random.below(4) {
            0 => format!("{target}++"),
            1 => format!("--{target}"),
            2 => format!("({target} = {right})"),
            _ => format!("helper({right}, {left})"),
        };
        let other = self.pure(1);
        self.changed = None;
        match self.random.below(6) {
            0 => format!("({left}) && {effect}"),
            1 => format!("({left}) || {effect}"),
            2 => format!("({left}) ? {effect} : ({other})"),
            3 => format!("({effect}, {target})"),
            4 => format!("({effect}) + ({other})"),
            _ => format!("!({left} && ({effect} || {other}))"),
        }
    }

    fn constant(&mut self) -> String {
        match self.random.below(8) {
            0 => "0".to_owned(),
            1 => "1".to_owned(),
            2 => format!("{}", self.random.below(300)),
            3 => format!("0x{:x}", self.random.bits() & 0xffff),
            4 => format!("{}u", self.random.bits() & 0xffff_ffff),
            5 => "'a'".to_owned(),
            6 => "'\\n'".to_owned(),
            _ => format!("{}", 1 + self.random.below(9)),
        }
    }

    fn pure(&mut self, depth: usize) -> String {
        if depth == 0 || self.random.one_in(4) {
            return match self.random.below(5) {
                0 | 1 => self.constant(),
                2 if !self.in_helper => format!("v[{}]", self.random.below(5)),
                _ => self.var().to_owned(),
            };
        }
        let (a, b) = (self.pure(depth - 1), self.pure(depth - 1));
        match self.random.below(24) {
            0..=3 => format!("({a} + {b})"),
            4 | 5 => format!("({a} - {b})"),
            6 => format!("({a} * {b})"),
            7 => format!("({a} / {b})"),
            8 => format!("({a} % {b})"),
            9 => format!("({a} & {b})"),
            10 => format!("({a} | {b})"),
            11 => format!("({a} ^ {b})"),
            12 => format!("({a} << ({b} & 7))"),
            13 => format!("({a} >> ({b} & 15))"),
            14 => format!("({a} < {b})"),
            15 => format!("({a} >= {b})"),
            16 => format!("({a} == {b})"),
            17 => format!("(-{a})"),
            18 => format!("(~{a})"),
            19 => format!("(!{a})"),
            20 => format!("({a} && {b})"),
            21 => format!("({a} ? {b} : {})", self.pure(depth - 1)),
            22 => {
                let ty = [
                    "signed char",
                    "unsigned char",
                    "short",
                    "unsigned short",
                    "int",
                    "unsigned",
                    "_Bool",
                ][self.random.below(7)];
                format!("({ty}){a}")
            }
            _ => format!("({a} || {b})"),
        }
    }
}

impl Program {
    /// The C text, with `suffix` at the end of its function names.
    #[must_use]
    pub fn text(&self, suffix: &str) -> String {
        let mut text = format!(
            "int helper{suffix}(int x, unsigned char y)\n{{\n    short z = 3;\n    int fuel = 5;\n"
        );
        self.list(&self.helper, 1, &mut text, suffix);
        text.push_str("    return (int)((unsigned)x * 3u + (unsigned)y * 5u + (unsigned)z);\n}\n");
        let _ = write!(
            text,
            "void fill{suffix}(short v[5], int *p)\n{{\n    int i;\n    for (i = 0; i < 5; i++)\n        v[i] ^= (*p >> i) & 15;\n    *p = v[2] - 1;\n}}\n"
        );
        let _ = write!(
            text,
            "int f{suffix}(int a, int b, int c)\n{{\n    short s = 1;\n    unsigned char u8 = 200;\n    unsigned u = 7u;\n    signed char ch = 'x';\n    unsigned short w = 9;\n    _Bool q = 1;\n    short v[5] = {{ 1, -2, 3 }};\n    int fuel = {FUEL};\n"
        );
        self.list(&self.body, 1, &mut text, suffix);
        text.push_str("    return (int)((unsigned)a * 31u + (unsigned)b * 17u + (unsigned)c * 7u + (unsigned)s + u8 + u + (unsigned)ch * 3u + w + q + (unsigned)v[0] * 5u + (unsigned)v[1] + (unsigned)v[2] + (unsigned)v[3] + (unsigned)v[4]);\n}\n");
        text
    }

    fn list(&self, all: &[S], level: usize, text: &mut String, suffix: &str) {
        let pad = "    ".repeat(level);
        let burn = format!("{pad}    if (fuel-- < 1) return 99;\n");
        let named = |text: &str| {
            text.replace("helper(", &format!("helper{suffix}("))
                .replace("fill(", &format!("fill{suffix}("))
        };
        for one in all {
            match one {
                S::Plain(plain) => {
                    let _ = writeln!(text, "{pad}{}", named(plain));
                }
                S::Label(label) => {
                    let _ = writeln!(text, "{pad}L{label}: if (fuel-- < 1) return 98;");
                }
                S::If(condition, then, otherwise) => {
                    let _ = writeln!(text, "{pad}if ({}) {{", named(condition));
                    self.list(then, level + 1, text, suffix);
                    let _ = writeln!(text, "{pad}}}");
                    if let Some(otherwise) = otherwise {
                        let _ = writeln!(text, "{pad}else {{");
                        self.list(otherwise, level + 1, text, suffix);
                        let _ = writeln!(text, "{pad}}}");
                    }
                }
                S::While(condition, body) => {
                    let _ = writeln!(text, "{pad}while ({}) {{", named(condition));
                    text.push_str(&burn);
                    self.list(body, level + 1, text, suffix);
                    let _ = writeln!(text, "{pad}}}");
                }
                S::Do(body, condition) => {
                    let _ = writeln!(text, "{pad}do {{");
                    text.push_str(&burn);
                    self.list(body, level + 1, text, suffix);
                    let _ = writeln!(text, "{pad}}} while ({});", named(condition));
                }
                S::For(first, condition, last, body) => {
                    let _ = writeln!(
                        text,
                        "{pad}for ({}; {}; {}) {{",
                        named(first),
                        named(condition),
                        named(last)
                    );
                    text.push_str(&burn);
                    self.list(body, level + 1, text, suffix);
                    let _ = writeln!(text, "{pad}}}");
                }
                S::Switch(value, cases) => {
                    let _ = writeln!(text, "{pad}switch ({}) {{", named(value));
                    for (label, body, breaks) in cases {
                        match label {
                            Some(label) => {
                                let _ = writeln!(text, "{pad}case {label}:");
                            }
                            None => {
                                let _ = writeln!(text, "{pad}default:");
                            }
                        }
                        let _ = writeln!(text, "{pad}    ;");
                        self.list(body, level + 1, text, suffix);
                        if *breaks {
                            let _ = writeln!(text, "{pad}    break;");
                        }
                    }
                    let _ = writeln!(text, "{pad}}}");
                }
                S::Duff(value, parts, condition) => {
                    let _ = writeln!(text, "{pad}switch ({}) {{\n{pad}case 0: do {{", named(value));
                    text.push_str(&burn);
                    for (index, part) in parts.iter().enumerate() {
                        if index > 0 {
                            let _ = writeln!(text, "{pad}case {index}:");
                        }
                        let _ = writeln!(text, "{pad}    ;");
                        self.list(part, level + 1, text, suffix);
                    }
                    let _ = writeln!(text, "{pad}    }} while ({});\n{pad}}}", named(condition));
                }
            }
        }
    }

    /// Variants of the program with one part removed or simplified.
    #[must_use]
    pub fn smaller(&self) -> Vec<Program> {
        let mut all: Vec<Program> =
            shorter(&self.body).into_iter().map(|body| Program { body, ..self.clone() }).collect();
        all.extend(
            shorter(&self.helper).into_iter().map(|helper| Program { helper, ..self.clone() }),
        );
        all
    }
}

/// Lists with one statement removed or simplified.
fn shorter(all: &[S]) -> Vec<Vec<S>> {
    let mut found = Vec::new();
    for at in 0..all.len() {
        let with = |new: &[S]| {
            let mut list = all[..at].to_vec();
            list.extend_from_slice(new);
            list.extend_from_slice(&all[at + 1..]);
            list
        };
        found.push(with(&[]));
        match &all[at] {
            S::Plain(_) | S::Label(_) => {}
            S::If(condition, then, otherwise) => {
                found.push(with(then));
                found.extend(otherwise.iter().map(|otherwise| with(otherwise)));
                found.extend(
                    shorter(then)
                        .into_iter()
                        .map(|then| with(&[S::If(condition.clone(), then, otherwise.clone())])),
                );
                if let Some(other) = otherwise {
                    found.push(with(&[S::If(condition.clone(), then.clone(), None)]));
                    found.extend(
                        shorter(other).into_iter().map(|other| {
                            with(&[S::If(condition.clone(), then.clone(), Some(other))])
                        }),
                    );
                }
            }
            S::While(condition, body) => {
                found.extend(
                    shorter(body)
                        .into_iter()
                        .map(|body| with(&[S::While(condition.clone(), body)])),
                );
            }
            S::Do(body, condition) => {
                found.extend(
                    shorter(body).into_iter().map(|body| with(&[S::Do(body, condition.clone())])),
                );
            }
            S::For(first, condition, last, body) => {
                found.extend(shorter(body).into_iter().map(|body| {
                    with(&[S::For(first.clone(), condition.clone(), last.clone(), body)])
                }));
            }
            S::Switch(value, cases) => {
                for case in 0..cases.len() {
                    let mut fewer = cases.clone();
                    fewer.remove(case);
                    found.push(with(&[S::Switch(value.clone(), fewer)]));
                    found.extend(shorter(&cases[case].1).into_iter().map(|body| {
                        let mut simpler = cases.clone();
                        simpler[case].1 = body;
                        with(&[S::Switch(value.clone(), simpler)])
                    }));
                }
            }
            S::Duff(value, parts, condition) => {
                for part in 0..parts.len() {
                    let mut fewer = parts.clone();
                    fewer.remove(part);
                    found.push(with(&[S::Duff(value.clone(), fewer, condition.clone())]));
                }
            }
        }
    }
    found
}
