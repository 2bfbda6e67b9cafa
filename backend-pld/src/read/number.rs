//! Numbers of CUPL: `'b'10X`, `'o'17`, `'d'12`, `'h'1F`, or hexadecimal digits; or a name defined as a number by `$DEFINE`.

use super::ast::PldAst;
use super::lexer::{Kind, Lexer};
use crate::codes;
use std::collections::BTreeMap;

/// The names that `$DEFINE` defines as numbers.
pub(crate) type Defined = BTreeMap<String, Digits>;

/// The base of numbers without an explicit base.
const DEFAULT_BASE: u32 = 16;

/// A number whose digits may be don't-cares: the value, and the mask of the bits that matter.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Number {
    pub(crate) value: u64,
    pub(crate) mask: u64,
}

/// The text of a number in a `$DEFINE`: CUPL substitutes the text, so digits without a base have the base of the place where the name is used.
#[derive(Debug, Clone)]
pub(crate) struct Digits {
    text: String,
    /// The base, if it is explicit.
    base: Option<u32>,
}

impl Digits {
    /// The number with the base written before it, if any. `None` if the combination is invalid.
    pub(crate) fn number(&self, outer: Option<u32>) -> Option<Number> {
        of(&self.text, self.base.or(outer).unwrap_or(DEFAULT_BASE))
    }
}

/// Reads the number of a `$DEFINE`. `None` after an error, which is reported.
pub(crate) fn definition(
    lexer: &mut Lexer<'_>,
    draft: &mut PldAst,
    defined: &Defined,
) -> Option<Digits> {
    let base = base(lexer, draft)?;
    let text = lexer.token.text;
    let text = defined.get(text).map_or(text, |one| &one.text).to_owned();
    digits(lexer, draft, defined, base)?;
    Some(Digits { text, base })
}

/// Reads a number. `None` after an error, which is reported.
pub(crate) fn read(lexer: &mut Lexer<'_>, draft: &mut PldAst, defined: &Defined) -> Option<Number> {
    let base = base(lexer, draft)?;
    digits(lexer, draft, defined, base)
}

/// The base, if it is explicit.
#[expect(clippy::option_option, reason = "an error, no base, or one")]
pub(crate) fn base(lexer: &mut Lexer<'_>, draft: &mut PldAst) -> Option<Option<u32>> {
    if lexer.token.kind != Kind::Quoted {
        return Some(None);
    }
    let span = lexer.span();
    let base = match lexer.token.text.to_ascii_lowercase().as_str() {
        "'b'" => 2,
        "'o'" => 8,
        "'d'" => 10,
        "'h'" => 16,
        other => {
            let message = format!("expected a base such as 'b' or 'h', found `{other}`");
            let help = "write 'b' (2), 'o' (8), 'd' (10) or 'h' (16) before the digits";
            draft.error_with(codes::SYNTAX, span, message, help);
            return None;
        }
    };
    lexer.advance();
    Some(Some(base))
}

/// The digits of a number; `outer` is the base written before them, or before the list that contains them.
pub(crate) fn digits(
    lexer: &mut Lexer<'_>,
    draft: &mut PldAst,
    defined: &Defined,
    outer: Option<u32>,
) -> Option<Number> {
    let own = base(lexer, draft)?;
    let base = own.or(outer);
    let (span, token) = (lexer.span(), lexer.token);
    let defined = defined.get(token.text).filter(|_| token.kind == Kind::Word);
    let number = match defined {
        // Two consecutive bases are invalid.
        Some(defined) if own.is_some() && defined.base.is_some() => None,
        Some(defined) => defined.number(base),
        None => of(token.text, base.unwrap_or(DEFAULT_BASE))
            .filter(|_| matches!(token.kind, Kind::Number | Kind::Word)),
    };
    let Some(number) = number else {
        let base = base.unwrap_or(DEFAULT_BASE);
        let message = format!("expected a number in base {base}, found {}", token.shown());
        let help = match base {
            16 => {
                "numbers without a base are hexadecimal; write 'd' before decimal digits, 'b' before binary ones"
            }
            2 => "write digits 0, 1 or X, or another base: 'o' (8), 'd' (10) or 'h' (16)",
            _ => {
                "write digits of this base, or another base: 'b' (2), 'o' (8), 'd' (10) or 'h' (16)"
            }
        };
        draft.error_with(codes::SYNTAX, span, message, help);
        return None;
    };
    lexer.advance();
    Some(number)
}

/// The value of digits; `None` if one of them is not a digit of the base, or if the number has more than 60 bits.
fn of(text: &str, base: u32) -> Option<Number> {
    let (mut value, mut mask) = (0_u64, !0_u64);
    for c in text.chars() {
        let (digit, known) = match (c, c.to_digit(base)) {
            ('x' | 'X', _) if base != 10 => (0, 0),
            (_, Some(digit)) => (u64::from(digit), u64::from(base) - 1),
            (_, None) => return None,
        };
        value = value.checked_mul(u64::from(base)).filter(|value| value >> 60 == 0)? + digit;
        if base != 10 {
            mask = mask << base.trailing_zeros() | known;
        }
    }
    (!text.is_empty()).then_some(Number { value, mask })
}
