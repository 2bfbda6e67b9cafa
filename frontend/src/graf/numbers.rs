//! Finds the names that a file declares as integers, before the file is parsed.
//!
//! `*` and `+` are `and` and `or` between Booleans, as in Grafcet, and arithmetic if an operand is a number. A declaration may follow its
//! use, so a quick first pass over the tokens collects these names. It also collects the outputs and looks for a step named `sink`; it
//! reports nothing.

use super::lexer::Lexer;
use super::token::{INFIX, Kind, SINK, Token};

/// The data about a source that the parser needs in advance: the names that the source declares as integers, and its outputs.
#[derive(Debug, Clone, Default)]
pub(crate) struct Numbers<'a> {
    /// The names of integer inputs, outputs, variables, extern conditions and constants, of timers, and of counted steps, sorted.
    names: Vec<&'a str>,
    /// The names in output lists, sorted.
    outputs: Vec<&'a str>,
    /// Whether a step named `sink` is declared without backquotes.
    pub(crate) has_sink: bool,
}

/// A constant whose value is being examined.
struct Const<'a> {
    name: &'a str,
    has_number: bool,
    has_truth: bool,
}

/// Reads the lists of constants in a text: `const N = 5, M = N + 1`.
#[derive(Default)]
struct Constants<'a> {
    in_list: bool,
    current: Option<Const<'a>>,
}

impl<'a> Constants<'a> {
    /// Reads the token `f` after `e`. The result is the constant that ends before it, if that is a number.
    fn read(&mut self, text: &'a str, e: Token, f: Token, names: &[&'a str]) -> Option<&'a str> {
        let word = if f.kind == Kind::Word { slice(text, f) } else { "" };
        let ends = match f.kind {
            Kind::Comma | Kind::End | Kind::CloseBrace | Kind::Text | Kind::RawText => true,
            Kind::Word | Kind::Quoted => f.new_line && !INFIX.contains(&word),
            _ => false,
        };
        let done = if ends { self.current.take() } else { None };
        if done.is_some() {
            self.in_list = f.kind == Kind::Comma;
        }
        let number = done.filter(|it| it.has_number && !it.has_truth).map(|it| it.name);
        if word == "const" {
            self.in_list = true;
        } else if self.in_list
            && f.kind == Kind::Equal
            && matches!(e.kind, Kind::Word | Kind::Quoted)
            && self.current.is_none()
        {
            let name = name_of(text, e);
            self.current = Some(Const { name, has_number: false, has_truth: false });
        } else if let Some(constant) = &mut self.current {
            match f.kind {
                Kind::Number => constant.has_number = true,
                Kind::Word | Kind::Quoted => {
                    constant.has_truth |= matches!(word, "true" | "false" | "not" | "and" | "or");
                    // A constant may be computed from earlier constants. Only the last 64 names are searched, because such constants are
                    // usually close together.
                    let name = name_of(text, f);
                    constant.has_number |= names.iter().rev().take(64).any(|it| *it == name);
                }
                Kind::Equal
                | Kind::NotEqual
                | Kind::Less
                | Kind::LessEqual
                | Kind::Greater
                | Kind::GreaterEqual => constant.has_truth = true,
                _ => {}
            }
        }
        number
    }
}

impl<'a> Numbers<'a> {
    /// Creates the set from names in any order.
    pub(crate) fn of(names: impl IntoIterator<Item = &'a str>) -> Self {
        let mut names: Vec<&str> = names.into_iter().collect();
        names.sort_unstable();
        names.dedup();
        Numbers { names, ..Numbers::default() }
    }

    /// Collects the integer names that `text` declares.
    pub(crate) fn declared_in(text: &'a str) -> Self {
        let mut names = Vec::new();
        let mut outputs = Vec::new();
        let mut in_outputs = false;
        let mut has_sink = false;
        let mut lexer = Lexer::new(text);
        let none = Token { kind: Kind::End, new_line: true, start: 0, end: 0 };
        let mut last = [none; 6];
        let mut constants = Constants::default();
        let mut was_while = false;
        loop {
            let token = lexer.next(&mut |_, _| {}, &mut |_| {});
            last.rotate_left(1);
            last[5] = token;
            let [_, _, c, d, e, f] = last;
            let word =
                |token: Token| if token.kind == Kind::Word { slice(text, token) } else { "" };
            let is_name = |token: Token| matches!(token.kind, Kind::Word | Kind::Quoted);

            // `n: int 0`, `f(): int 0`
            if matches!(f.kind, Kind::Number | Kind::Minus)
                && word(e) == "int"
                && d.kind == Kind::Colon
            {
                if is_name(c) {
                    names.push(name_of(text, c));
                } else if c.kind == Kind::Close && last[1].kind == Kind::Open && is_name(last[0]) {
                    names.push(name_of(text, last[0]));
                }
            }
            // `n: INT`; the parser reports it.
            if d.kind == Kind::Colon
                && is_name(c)
                && is_foreign_integer(word(e))
                && !matches!(f.kind, Kind::Arrow | Kind::Ampersand | Kind::Dot)
            {
                names.push(name_of(text, c));
            }
            // `output Q, R`
            if word(f) == "output" {
                in_outputs = true;
            } else if in_outputs && is_name(f) {
                if e.kind == Kind::Comma
                    || matches!(word(e), "output" | "registered" | "mealy") && !f.new_line
                {
                    outputs.push(name_of(text, f));
                } else if f.new_line {
                    in_outputs = false;
                }
            }
            // `step p count 0`
            if f.kind == Kind::Number && word(e) == "count" && is_name(d) {
                names.push(name_of(text, d));
            }
            has_sink |=
                word(f) == SINK && matches!(word(e), "step" | "state" | "parallel" | "region");
            // `timer T while`, `, U while`. The condition after `while` may itself be a name spelled `while`.
            let declares = word(d) == "timer" || d.kind == Kind::Comma;
            was_while = word(f) == "while" && is_name(e) && declares && !was_while;
            if was_while {
                names.push(name_of(text, e));
            }
            names.extend(constants.read(text, e, f, &names));
            if f.kind == Kind::End {
                outputs.sort_unstable();
                outputs.dedup();
                return Numbers { has_sink, outputs, ..Self::of(names) };
            }
        }
    }

    /// Whether `name` is in a list of outputs.
    pub(crate) fn is_output(&self, name: &str) -> bool {
        self.outputs.binary_search(&name).is_ok()
    }

    /// Whether `name` is declared as an integer.
    pub(crate) fn contains(&self, name: &str) -> bool {
        self.names.binary_search(&name).is_ok()
    }
}

/// Whether `word` is an integer type of another language.
pub(crate) fn is_foreign_integer(word: &str) -> bool {
    word != "int"
        && [
            "int", "sint", "dint", "lint", "uint", "usint", "udint", "ulint", "byte", "word",
            "integer",
        ]
        .iter()
        .any(|known| word.eq_ignore_ascii_case(known))
}

/// The text of a token.
pub(crate) fn slice(text: &str, token: Token) -> &str {
    text.get(token.start as usize..token.end as usize).unwrap_or("")
}

/// The name that a token denotes, without backquotes.
pub(crate) fn name_of(text: &str, token: Token) -> &str {
    let text = slice(text, token);
    if token.kind == Kind::Quoted { text.trim_matches('`') } else { text }
}

#[cfg(test)]
mod tests {
    use super::Numbers;

    #[test]
    fn integers_of_all_kinds_are_found() {
        let text = "input n: int 0..9, b, `odd one`: int -3..3 extern condition f(): int 0..1, g()
            timer T while b, U while n > 3
            const N = 5, M = N + 1, B = N > 3, C = true
            var v: int 0..9[4] = 0  const K = -(3)
            t1: int -> x";
        let numbers = Numbers::declared_in(text);
        for name in ["n", "odd one", "f", "T", "U", "N", "M", "v", "K"] {
            assert!(numbers.contains(name), "{name}");
        }
        for name in ["b", "g", "B", "C", "t1", "x", "int"] {
            assert!(!numbers.contains(name), "{name}");
        }
    }
}
