//! Durations: a number and a unit. Also recognises the notations of other languages.

use grafsynth_ir::diag::{Diagnostic, ErrorReported};

use super::numbers::slice;
use super::parser::{Parse, Parser, slice_short, span_of};
use super::token::{Kind, Token};
use crate::codes;
use grafsynth_ir::duration;

impl Parser<'_> {
    /// Reads a duration such as `10 ms` or `1.5 s`, in nanoseconds.
    pub(crate) fn duration(&mut self) -> Parse<u64> {
        let token = self.peek(0);
        if let Some(ns) = self.iec_duration() {
            return Ok(ns);
        }
        if !matches!(token.kind, Kind::Number | Kind::Fraction) {
            return Err(self.unexpected("a duration such as `10 ms`"));
        }
        self.advance();
        let Some(unit) = self.unit(0) else {
            let span = self.span(token);
            let word = self.word(0);
            let next = self.peek(0);
            self.report(|| {
                let text = slice_short(self.text, token);
                let mut finding =
                    Diagnostic::error(codes::DURATION, format!("`{text}` needs a unit of time"))
                        .at(span, "a number without a unit")
                        .help("the units are ns, us, ms, s, min and h");
                if !next.new_line
                    && let Some(near) = nearest_unit(word)
                {
                    finding = finding.fix(span_of(span.file, next.start, next.end), near);
                }
                finding
            });
            return Err(ErrorReported);
        };
        self.advance();
        Ok(self.nanoseconds(token, unit))
    }

    /// Reads a duration in IEC 61131-3 notation, such as `T#1.5s`; the lexer skips its `#1.5s` as a comment. Reports the notation and
    /// returns the duration in nanoseconds. `None` if there is no such duration here, or if the text also contains the word `T` without a
    /// `#`.
    pub(crate) fn iec_duration(&mut self) -> Option<u64> {
        let token = self.peek(0);
        if self.text.as_bytes().get(token.end as usize) != Some(&b'#') {
            return None;
        }
        let word = self.word(0);
        if !["t", "time", "lt", "ltime"].contains(&word.to_ascii_lowercase().as_str()) {
            return None;
        }
        let literal = self.text.get(token.end as usize..)?.strip_prefix('#')?;
        let length = literal
            .find(|c: char| !(c.is_ascii_alphanumeric() || matches!(c, '_' | '.')))
            .unwrap_or(literal.len());
        let literal = literal[..length].trim_end_matches('.');
        let ns = iec_nanoseconds(literal)?;
        if self.has_word(word) {
            return None;
        }
        self.advance();
        let span = span_of(self.file, token.start, token.end + 1).to(span_of(
            self.file,
            token.end,
            token.end + 1 + u32::try_from(literal.len()).ok()?,
        ));
        let written = one_unit(literal).unwrap_or_else(|| duration(ns));
        self.report(|| {
            Diagnostic::error(
                codes::DURATION,
                format!("a duration is written `{written}`, not `{word}#{literal}`"),
            )
            .at(span, "`#` begins a comment")
            .help(format!("write `{written}`"))
            .fix(span, written)
        });
        Some(ns)
    }

    /// Whether the text contains this word without a following `#`.
    fn has_word(&mut self, word: &str) -> bool {
        if let Some(known) = self.has_words.get(word) {
            return *known;
        }
        let is_part = |c: char| c == '_' || c.is_alphanumeric();
        let found = self.text.match_indices(word).any(|(at, _)| {
            let (before, after) = (&self.text[..at], &self.text[at + word.len()..]);
            !before.ends_with(|c| is_part(c) || c == '.')
                && !after.starts_with(|c| is_part(c) || c == '#')
        });
        self.has_words.insert(word.to_owned(), found);
        found
    }

    /// The length in nanoseconds of the unit at this lookahead; `None` if the token is not a unit, or is on another line.
    pub(crate) fn unit(&self, ahead: usize) -> Option<u64> {
        if self.window[ahead].new_line {
            return None;
        }
        match self.word(ahead) {
            "ns" => Some(1),
            "us" | "µs" | "μs" => Some(1_000),
            "ms" => Some(1_000_000),
            "s" => Some(1_000_000_000),
            "min" => Some(60_000_000_000),
            "h" => Some(3_600_000_000_000),
            _ => None,
        }
    }

    /// Converts a number and a unit to nanoseconds. Reports a value that is out of range or has a fraction of a nanosecond.
    pub(crate) fn nanoseconds(&mut self, token: Token, unit: u64) -> u64 {
        let value = self.exact_nanoseconds(token, unit);
        match value {
            Some(value) => value,
            None => {
                let span = self.span_from(token.start);
                self.report(|| {
                    Diagnostic::error(
                        codes::DURATION,
                        "a duration must be a whole number of nanoseconds below 2^63",
                    )
                    .at(span, "too long, or with a fraction of a nanosecond")
                    .help("write a shorter duration, or fewer digits after the point")
                });
                1
            }
        }
    }

    fn exact_nanoseconds(&self, token: Token, unit: u64) -> Option<u64> {
        let text = slice(self.text, token);
        let value = if token.kind == Kind::Fraction {
            let (whole, part) = text.split_once('.')?;
            let digits = |text: &str| {
                text.bytes().filter(|&b| b != b'_').try_fold(0u128, |value, byte| {
                    value.checked_mul(10)?.checked_add(u128::from(byte.wrapping_sub(b'0')))
                })
            };
            // Trailing zeros do not change the value and must not overflow the scale.
            let part = part.trim_end_matches(['0', '_']);
            let n_digits = u32::try_from(part.bytes().filter(|&b| b != b'_').count()).ok()?;
            let scale = 10u128.checked_pow(n_digits)?;
            let value = digits(whole)?
                .checked_mul(scale)?
                .checked_add(digits(part)?)?
                .checked_mul(u128::from(unit))?;
            if value % scale != 0 {
                return None;
            }
            value / scale
        } else {
            u128::from(self.number_at(token)?).checked_mul(u128::from(unit))?
        };
        i64::try_from(value).ok().and_then(|value| u64::try_from(value).ok())
    }
}

/// `1.5 s` for `1.5s`: a number and a single unit of the chart language.
fn one_unit(literal: &str) -> Option<String> {
    let literal = literal.to_ascii_lowercase();
    let (number, unit) = literal.split_at(literal.find(|c: char| c.is_ascii_alphabetic())?);
    let unit = match unit {
        "m" => "min",
        "h" | "s" | "ms" | "us" | "ns" => unit,
        _ => return None,
    };
    Some(format!("{number} {unit}"))
}

/// Nanoseconds of `1.5s`, `1m30s` or `250ms`.
fn iec_nanoseconds(literal: &str) -> Option<u64> {
    const UNITS: [(&str, u64); 7] = [
        ("d", 86_400_000_000_000),
        ("h", 3_600_000_000_000),
        ("ms", 1_000_000),
        ("m", 60_000_000_000),
        ("s", 1_000_000_000),
        ("us", 1_000),
        ("ns", 1),
    ];
    let mut rest = literal.to_ascii_lowercase().replace('_', "");
    let mut total: u64 = 0;
    while !rest.is_empty() {
        let digits = rest.find(|c: char| !(c.is_ascii_digit() || c == '.'))?;
        let (whole, part) = rest[..digits].split_once('.').unwrap_or((&rest[..digits], ""));
        let length =
            rest[digits..].find(|c: char| c.is_ascii_digit()).unwrap_or(rest.len() - digits);
        let (_, unit) = UNITS.iter().find(|(name, _)| *name == &rest[digits..digits + length])?;
        let mut value = whole.parse::<u64>().ok()?.checked_mul(*unit)?;
        if !part.is_empty() {
            let scale = 10u64.checked_pow(u32::try_from(part.len()).ok()?)?;
            value = value.checked_add(part.parse::<u64>().ok()?.checked_mul(*unit)? / scale)?;
        }
        total = total.checked_add(value)?;
        rest.drain(..digits + length);
    }
    (!literal.is_empty()).then_some(total)
}

fn nearest_unit(word: &str) -> Option<&'static str> {
    match word {
        "sec" | "second" | "seconds" | "S" => Some("s"),
        "msec" | "MS" | "millis" | "milliseconds" => Some("ms"),
        "usec" | "US" | "micros" | "microseconds" => Some("us"),
        "nsec" | "NS" => Some("ns"),
        "m" | "mins" | "minute" | "minutes" => Some("min"),
        "hour" | "hours" | "H" => Some("h"),
        _ => None,
    }
}
