//! Names for emitted text: this module makes every identifier of C, equations, netlists and charts.
//!
//! A [`Target`] describes the identifiers of a language; a [`Namer`] assigns identifiers in one scope of one target. An identifier depends only on the
//! name in the source, never on an index:
//!
//! 1. A name that the target accepts is unchanged, regardless of other names (if all names are known together: [`Namer::assign`]).
//! 2. Otherwise Latin letters lose their marks (`é` → `e`, `ß` → `ss`), a dot, blank or sign becomes `_`, any other letter becomes its code (`Ω` →
//!    `u3a9`), and a name with an invalid first character gets the prefix `x`. If the target does not allow `_`, it is omitted.
//! 3. A name that is too long keeps its beginning and gets three characters computed from the whole name, so that long names with the same beginning are
//!    different and do not depend on each other.
//! 4. A name that is reserved or already used gets `_2`, `_3`, … in the order of requests (only `_` after a reserved word).
//!
//! ```
//! use grafsynth_ir::names::{Namer, PALASM};
//! let mut namer = Namer::new(&PALASM);
//! assert_eq!(namer.name("fill.ready"), "fill_ready");
//! assert_eq!(namer.name("FILL_READY"), "FILL_READY_2");   // PALASM is not case-sensitive
//! assert_eq!(namer.name("chip"), "chip_");
//! ```

mod words;

use std::collections::BTreeSet;

/// True for invisible characters that end a line or change the text direction: in a comment of emitted text they could make the text look different from
/// what is compiled.
#[must_use]
pub fn is_unseen(c: char) -> bool {
    c.is_control()
        || matches!(c, '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

/// The identifiers that a language accepts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Target {
    /// The language's name.
    pub name: &'static str,
    /// The largest number of characters.
    pub max_length: usize,
    /// False if `A` and `a` are the same name.
    pub case_matters: bool,
    /// Whether a name may contain `_`.
    pub underscore: bool,
    /// Whether a name may begin with `_`.
    pub leading_underscore: bool,
    /// Whether a name may contain `__`.
    pub double_underscore: bool,
    /// Whether a name may contain letters beyond ASCII.
    pub unicode: bool,
    /// Other characters that are allowed after the first.
    pub also: &'static str,
    /// Reserved words, in lists; in lower case if the language is not case-sensitive.
    pub reserved: &'static [&'static [&'static str]],
}

/// An identifier of ASCII letters, digits and `_`, of any length.
const PLAIN: Target = Target {
    name: "",
    max_length: 200,
    case_matters: true,
    underscore: true,
    leading_underscore: true,
    double_underscore: true,
    unicode: false,
    also: "",
    reserved: &[],
};

/// C99 that C++ compilers also accept. The words of both languages, the macros of the standard headers and of common microcontroller headers, and
/// functions that every program has are reserved. A leading `_` and `__` are reserved for the compiler. C99 5.2.4.1 guarantees 63 significant characters
/// within a file and 31 between files; we use 31.
pub const C: Target = Target {
    name: "C",
    max_length: 31,
    leading_underscore: false,
    double_underscore: false,
    reserved: &[words::C, words::CPP, words::C_HEADERS],
    ..PLAIN
};

/// Verilog-2001. The words of SystemVerilog (tools read `.v` files as either) and words that only one tool reserves are avoided; the words of VHDL, for
/// mixed projects, are not. IEEE 1364-2001 2.7: case-sensitive, at least 1024 characters; we keep names short enough to read.
pub const VERILOG: Target = Target {
    name: "Verilog",
    max_length: 128,
    reserved: &[words::VERILOG, words::SYSTEM_VERILOG, words::VERILOG_TOOLS],
    ..PLAIN
};

/// PALASM 2 and 4: at most 14 characters (13 for the name after `CHIP`), not case-sensitive, starting with a letter.
pub const PALASM: Target = Target {
    name: "PALASM",
    max_length: 14,
    case_matters: false,
    leading_underscore: false,
    reserved: &[words::PALASM],
    ..PLAIN
};

/// The name after `CHIP` in PALASM, one character shorter.
pub const PALASM_CHIP: Target = Target { name: "PALASM chip", max_length: 13, ..PALASM };

/// CUPL: at most 31 characters, starting with a letter. Treated as not case-sensitive, because its preprocessor and its reserved words are not. CUPL treats a
/// name that ends in digits as an indexed variable that can be part of a field; it is still usable as a name.
pub const CUPL: Target = Target {
    name: "CUPL",
    max_length: 31,
    case_matters: false,
    leading_underscore: false,
    reserved: &[words::CUPL],
    ..PLAIN
};

/// GALasm: `[A-Za-z][A-Za-z0-9]*`, at most 8 characters. It is case-sensitive, but our names differ in more than case, so that people do not confuse them.
pub const GALASM: Target = Target {
    name: "GALasm",
    max_length: 8,
    case_matters: false,
    underscore: false,
    leading_underscore: false,
    reserved: &[words::GALASM],
    ..PLAIN
};

/// BLIF: a signal is any run of characters except blanks, `#`, `=` and `\`; we use only characters that other tools of the flow (abc, yosys) print without
/// escapes.
pub const BLIF: Target = Target { name: "BLIF", also: ".[]", ..PLAIN };

/// The chart language, for names without back quotes.
pub const GRAF: Target =
    Target { name: "graf", unicode: true, also: ".", reserved: &[words::GRAF], ..PLAIN };

/// Rules text: one scope for steps, transitions, inputs and outputs.
pub const RULES: Target =
    Target { name: "rules", unicode: true, also: ".", reserved: &[words::RULES], ..PLAIN };

/// All targets, for tests and lists.
pub const TARGETS: [&Target; 9] =
    [&C, &VERILOG, &PALASM, &PALASM_CHIP, &CUPL, &GALASM, &BLIF, &GRAF, &RULES];

impl Target {
    /// True if `text` is an identifier of this target and not reserved.
    #[must_use]
    pub fn accepts(&self, text: &str) -> bool {
        let mut chars = text.chars();
        let begins =
            chars.next().is_some_and(|c| self.is_letter(c) || (c == '_' && self.may_lead()));
        begins
            && chars.all(|c| self.is_inner(c))
            && text.chars().count() <= self.max_length
            && (self.double_underscore || !text.contains("__"))
            && !text.ends_with('.')
            && !text.contains("..")
            && !self.is_reserved(text)
    }

    /// True for a reserved word.
    #[must_use]
    pub fn is_reserved(&self, text: &str) -> bool {
        let key = self.key(text);
        self.reserved.iter().any(|list| list.binary_search(&key.as_str()).is_ok())
    }

    fn may_lead(&self) -> bool {
        self.underscore && self.leading_underscore
    }

    fn is_letter(&self, c: char) -> bool {
        c.is_ascii_alphabetic() || (self.unicode && c.is_alphabetic())
    }

    fn is_inner(&self, c: char) -> bool {
        self.is_letter(c)
            || c.is_ascii_digit()
            || (c == '_' && self.underscore)
            || self.also.contains(c)
    }

    /// The part of a name that must be unique.
    fn key(&self, text: &str) -> String {
        if self.case_matters { text.to_owned() } else { text.to_ascii_lowercase() }
    }

    /// A legal spelling of `text`; it may be reserved or too long.
    fn spell(&self, text: &str) -> String {
        let mut out = String::with_capacity(text.len());
        for c in text.chars() {
            match c {
                c if self.is_inner(c) => out.push(c),
                '_' | '.' | '[' | ']' => self.joint(&mut out),
                c if c.is_alphanumeric() => match transliterated(c) {
                    Some(latin) => out.push_str(latin),
                    None => out.push_str(&format!("u{:x}", u32::from(c))),
                },
                _ => self.joint(&mut out),
            }
        }
        let mut out = self.tidy(out);
        let ends = |c: char| c == '_' || self.also.contains(c);
        if !self.accepts_start(&out) {
            // `_tmp` becomes `tmp`, `2nd` becomes `x2nd`, and an empty name becomes `x`.
            let rest = if self.may_lead() { out } else { out.trim_start_matches(ends).to_owned() };
            out = if self.accepts_start(&rest) { rest } else { format!("x{rest}") };
        }
        out
    }

    fn accepts_start(&self, text: &str) -> bool {
        text.starts_with(|c| self.is_letter(c) || (c == '_' && self.may_lead()))
    }

    /// Adds the replacement for a character that the target does not allow.
    fn joint(&self, out: &mut String) {
        if self.underscore && !out.ends_with('_') {
            out.push('_');
        }
    }

    fn tidy(&self, mut text: String) -> String {
        while !self.double_underscore && text.contains("__") {
            text = text.replace("__", "_");
        }
        while self.also.contains('.') && text.contains("..") {
            text = text.replace("..", ".");
        }
        if text.ends_with('.') {
            text.pop();
        }
        text
    }

    /// `text` cut to `room` characters; the last three are computed from the whole `source`.
    fn cut(&self, text: &str, source: &str, room: usize) -> String {
        if text.chars().count() <= room {
            return text.to_owned();
        }
        let mut out: String = text.chars().take(room.saturating_sub(3)).collect();
        out.push_str(&digest(source));
        out
    }
}

/// Three characters, starting with a letter, that depend on every character of `text` (FNV-1a, 64 bits).
fn digest(text: &str) -> String {
    const SIGNS: &[u8; 36] = b"abcdefghijklmnopqrstuvwxyz0123456789";
    let hash = text.bytes().fold(0xcbf2_9ce4_8422_2325u64, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
    });
    let hash = hash ^ (hash >> 32);
    [(hash % 26) as usize, (hash / 26 % 36) as usize, (hash / 936 % 36) as usize]
        .map(|at| char::from(SIGNS[at]))
        .iter()
        .collect()
}

/// A Latin letter without its marks; a ligature becomes two letters.
fn transliterated(c: char) -> Option<&'static str> {
    words::LATIN.iter().find(|(letters, _)| letters.contains(c)).map(|(_, plain)| *plain)
}

/// Assigns the identifiers of one scope.
#[derive(Debug, Clone)]
pub struct Namer {
    target: &'static Target,
    /// Keys of the identifiers in use.
    taken: BTreeSet<String>,
}

impl Namer {
    /// A scope that contains only the reserved words of the target.
    #[must_use]
    pub fn new(target: &'static Target) -> Self {
        Namer { target, taken: BTreeSet::new() }
    }

    /// Reserves an identifier that the emitted text itself uses, so that no source name is mapped to it.
    pub fn reserve(&mut self, identifier: &str) {
        self.taken.insert(self.target.key(identifier));
    }

    /// True if `identifier` is in use or reserved.
    #[must_use]
    pub fn is_taken(&self, identifier: &str) -> bool {
        self.target.is_reserved(identifier) || self.taken.contains(&self.target.key(identifier))
    }

    /// A new identifier for the name `source`; it differs from all earlier ones of this namer.
    pub fn name(&mut self, source: &str) -> String {
        self.name_with_suffix(source, "")
    }

    /// A new identifier that ends in `suffix`; if the name is cut, the suffix is kept (`n` and `_b0` for bit 0 of n).
    pub fn name_with_suffix(&mut self, source: &str, suffix: &str) -> String {
        let target = self.target;
        let whole = format!("{source}{suffix}");
        if target.accepts(&whole) && !self.is_taken(&whole) {
            self.reserve(&whole);
            return whole;
        }
        let suffix: String = suffix.chars().filter(|c| target.is_inner(*c)).collect();
        let stem = target.spell(source);
        let fit = |tail: &str| {
            let tail = format!("{suffix}{tail}");
            let room = target.max_length.saturating_sub(tail.chars().count());
            target.tidy(format!("{}{tail}", target.cut(&stem, source, room)))
        };
        let first = fit("");
        let mut candidate = first.clone();
        if target.underscore && target.is_reserved(&candidate) {
            candidate = fit("_");
        }
        let mut number = 1u64;
        while self.is_taken(&candidate) || !target.accepts(&candidate) {
            number += 1;
            let joint = if target.underscore && !first.ends_with('_') { "_" } else { "" };
            // Without `_`, a final digit and a number would merge: `a1` and 2 must not become `a12`, the 12th variant of `a`.
            let joint = if !target.underscore && first.ends_with(|c: char| c.is_ascii_digit()) {
                "x"
            } else {
                joint
            };
            candidate = fit(&format!("{joint}{number}"));
        }
        self.reserve(&candidate);
        candidate
    }

    /// Identifiers for all of `sources`, in their order. Names that the target accepts are assigned first, so they are unchanged even if an earlier name
    /// would map to the same identifier.
    pub fn assign<'a>(&mut self, sources: impl IntoIterator<Item = &'a str>) -> Vec<String> {
        let sources: Vec<&str> = sources.into_iter().collect();
        let mut out: Vec<Option<String>> = vec![None; sources.len()];
        for (slot, source) in out.iter_mut().zip(&sources) {
            if self.target.accepts(source) && !self.is_taken(source) {
                *slot = Some(self.name(source));
            }
        }
        out.into_iter()
            .zip(sources)
            .map(|(slot, source)| slot.unwrap_or_else(|| self.name(source)))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn names(target: &'static Target, sources: &[&str]) -> Vec<String> {
        Namer::new(target).assign(sources.iter().copied())
    }

    #[test]
    fn lists_of_words_are_sorted_and_in_the_right_case() {
        for target in TARGETS {
            for list in target.reserved {
                let wrong = list.windows(2).find(|pair| pair[0] >= pair[1]);
                assert_eq!(wrong, None, "{}", target.name);
                assert!(list.iter().all(|word| target.key(word) == **word), "{}", target.name);
            }
        }
    }

    #[test]
    fn odd_names_in_c() {
        let odd = [
            "X", "int", "reg", "é", "main", "PORTB", "m1.s3", "m1_s3", "_x", "2nd", "straße", "Ω",
            "a__b", "",
        ];
        let given = [
            "X", "int_", "reg", "e", "main_", "PORTB_", "m1_s3_2", "m1_s3", "x", "x2nd", "strasse",
            "u3a9", "a_b", "x_2",
        ];
        assert_eq!(names(&C, &odd), given);
    }

    #[test]
    fn odd_names_on_chips() {
        assert_eq!(
            names(&VERILOG, &["reg", "X", "é", "logic", "a$b"]),
            ["reg_", "X", "e", "logic_", "a_b"]
        );
        assert_eq!(
            names(&PALASM, &["Ready", "ready", "vcc", "a.b"]),
            ["Ready", "ready_2", "vcc_", "a_b"]
        );
        assert_eq!(names(&CUPL, &["pin", "D", "x_1"]), ["pin_", "D_", "x_1"]);
        assert_eq!(
            names(&GALASM, &["m1.s3", "VCC", "a1", "A1", "a_1"]),
            ["m1s3", "VCC2", "a1", "A1x2", "a1x3"]
        );
        assert_eq!(names(&BLIF, &["m1.s3", "v[0]", "a b"]), ["m1.s3", "v[0]", "a_b"]);
    }

    #[test]
    fn long_names_with_one_beginning_stay_apart_and_do_not_depend_on_each_other() {
        let (first, second) =
            ("conveyor_of_the_left_hall_starts", "conveyor_of_the_left_hall_stops");
        for target in [&PALASM, &GALASM] {
            let both = names(target, &[first, second]);
            assert_ne!(both[0], both[1]);
            assert!(
                both.iter()
                    .all(|name| name.starts_with("conve") && name.len() == target.max_length),
                "{both:?}"
            );
            assert_eq!(names(target, &[second]), both[1..]);
        }
    }

    #[test]
    fn a_suffix_survives_cutting() {
        let mut namer = Namer::new(&GALASM);
        let bits: Vec<String> = (0..3)
            .map(|bit| namer.name_with_suffix("position_of_the_arm", &bit.to_string()))
            .collect();
        assert!(
            bits.iter()
                .enumerate()
                .all(|(bit, name)| name.ends_with(&bit.to_string()) && name.len() == 8)
        );
    }

    #[test]
    fn an_unrelated_name_changes_nothing() {
        let before = names(&C, &["a.b", "a_b", "int", "long.name"]);
        let after = names(&C, &["new one", "a.b", "a_b", "int", "long.name"]);
        assert_eq!(after[1..], before[..]);
    }

    proptest! {
        #[test]
        fn every_identifier_is_accepted_and_new(sources in prop::collection::vec(".{0,12}|[aA_.1é]{0,5}|[a-c]{6,40}", 0..30)) {
            for target in TARGETS {
                let given = Namer::new(target).assign(sources.iter().map(String::as_str));
                let mut keys = BTreeSet::new();
                for (name, source) in given.iter().zip(&sources) {
                    prop_assert!(target.accepts(name), "{}: {name:?} of {source:?}", target.name);
                    prop_assert!(keys.insert(target.key(name)), "{}: {name:?} twice", target.name);
                }
            }
        }
    }
}
