//! Integer and character constants (C99 6.4.4).

use super::lexer::TokenKind;
use super::{Parser, Read, headers};
use crate::codes;
use crate::tree::types::IntKind;
use crate::tree::typing::Suffix;
use crate::tree::{Expr, Loc, Spelling};
use grafsynth_ir::Span;

impl Parser<'_, '_> {
    /// Reads a number.
    pub(super) fn number(&mut self) -> Read<Expr> {
        let token = self.next();
        let span = token.span;
        let Some((value, is_decimal, is_hex, suffix)) = split(token.text) else {
            return self.fail(codes::SYNTAX, why_not(token.text), span, "here");
        };
        let spelling = if is_hex { Spelling::Hex } else { Spelling::Decimal };
        match self.unit.literal_kind(value, is_decimal, suffix) {
            Some(kind) => Ok(self.unit.literal(value, spelling, kind, Loc(span))),
            None => self.fail(codes::TYPE, "no integer type contains this number", span, "here"),
        }
    }

    /// Reads `INT32_C(5)` and so on (C99 7.18.4), whose argument is a number without a suffix.
    pub(super) fn sized_constant(&mut self) -> Read<Expr> {
        let start = self.span();
        let (bits, is_signed) = headers::sized_constant(self.next().text).unwrap_or((8, true));
        self.expect("(")?;
        let token = self.next();
        let inner = (token.kind == TokenKind::Number).then(|| split(token.text)).flatten();
        let Some((value, .., Suffix { is_unsigned: false, longs: 0 })) = inner else {
            let message = "the argument must be a number without a suffix";
            return self.fail(codes::SYNTAX, message, token.span, "here");
        };
        self.expect(")")?;
        let kind = self.unit.machine.exact(u32::from(bits), is_signed);
        if i128::from(value) > self.unit.machine.range(kind).1 {
            let message = format!("{value} does not fit into {bits} bits");
            return self.fail(codes::TYPE, message, token.span, "here");
        }
        let kind = self.unit.machine.promoted(kind);
        Ok(self.unit.literal(value, Spelling::Sized { bits, is_signed }, kind, self.since(start)))
    }

    /// Reads a character constant: an ASCII character, with the type `int`.
    pub(super) fn character(&mut self) -> Read<Expr> {
        let token = self.next();
        match character(token.text) {
            Some(value) => Ok(self.unit.literal(
                u64::from(value),
                Spelling::Character,
                IntKind::Int,
                Loc(token.span),
            )),
            None => self.bad_character(token.span),
        }
    }

    fn bad_character<T>(&mut self, span: Span) -> Read<T> {
        let message = "this is not a constant with one ASCII character";
        self.fail(codes::SYNTAX, message, span, "here")
    }
}

/// The value of a number, true if it is decimal, true if it is hexadecimal, and the suffix.
fn split(text: &str) -> Option<(u64, bool, bool, Suffix)> {
    let body = text.trim_end_matches(['u', 'U', 'l', 'L']);
    let suffix = match text[body.len()..].to_ascii_lowercase().as_str() {
        "" => (false, 0),
        "u" => (true, 0),
        "l" => (false, 1),
        "ul" | "lu" => (true, 1),
        "ll" => (false, 2),
        "ull" | "llu" => (true, 2),
        _ => return None,
    };
    if text.contains("lL") || text.contains("Ll") {
        return None;
    }
    let suffix = Suffix { is_unsigned: suffix.0, longs: suffix.1 };
    let is_digits = |it: &str, radix| !it.is_empty() && it.chars().all(|c| c.is_digit(radix));
    if let Some(hex) = body.strip_prefix("0x").or(body.strip_prefix("0X")) {
        let value = is_digits(hex, 16).then(|| u64::from_str_radix(hex, 16).ok())??;
        return Some((value, false, true, suffix));
    }
    if body.len() > 1 && body.starts_with('0') {
        let value = is_digits(body, 8).then(|| u64::from_str_radix(body, 8).ok())??;
        return Some((value, false, false, suffix));
    }
    let value = is_digits(body, 10).then(|| body.parse().ok())??;
    Some((value, true, false, suffix))
}

fn why_not(text: &str) -> &'static str {
    let is_hex = text.starts_with("0x") || text.starts_with("0X");
    if text.contains('.') || !is_hex && text.contains(['e', 'E']) {
        "floating-point numbers are not supported"
    } else {
        "this is not an integer with at most 64 bits"
    }
}

/// The value of a character constant with its quotes.
fn character(text: &str) -> Option<u8> {
    let inner = text.strip_prefix('\'')?.strip_suffix('\'')?;
    let value = match inner.strip_prefix('\\') {
        None => {
            let mut all = inner.chars();
            let only = all.next().filter(|_| all.next().is_none())?;
            u8::try_from(only).ok()?
        }
        Some("n") => b'\n',
        Some("t") => b'\t',
        Some("r") => b'\r',
        Some("a") => 7,
        Some("b") => 8,
        Some("f") => 12,
        Some("v") => 11,
        Some("\\") => b'\\',
        Some("'") => b'\'',
        Some("\"") => b'"',
        Some("?") => b'?',
        Some(code) => match code.strip_prefix('x') {
            Some(hex) if hex.chars().all(|c| c.is_ascii_hexdigit()) => {
                u8::from_str_radix(hex, 16).ok()?
            }
            None if code.len() <= 3 && code.chars().all(|c| c.is_digit(8)) => {
                u8::from_str_radix(code, 8).ok()?
            }
            _ => return None,
        },
    };
    value.is_ascii().then_some(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn constants_have_their_values() {
        let value = |text| split(text).map(|(value, ..)| value);
        assert_eq!(value("0"), Some(0));
        assert_eq!(value("0777u"), Some(0o777));
        assert_eq!(value("0XfFuLL"), Some(255));
        assert_eq!(value("18446744073709551615"), Some(u64::MAX));
        for bad in ["08", "0x", "1lL", "1uu", "18446744073709551616", "1.0", "1e3", "0b1", "+1"] {
            assert_eq!(value(bad), None, "{bad}");
        }
        assert_eq!(character("'\\x41'"), Some(b'A'));
        assert_eq!(character("'\\0'"), Some(0));
        assert_eq!(character("'ab'"), None);
        assert_eq!(character("'\\377'"), None);
        assert_eq!(character("'é'"), None);
    }
}
