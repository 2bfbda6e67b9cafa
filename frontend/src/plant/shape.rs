//! Shapes of plants, and places that move with quantities.

use grafsynth_ir::diag::{Diagnostic, ErrorReported, nearest};
use grafsynth_ir::plant::{Colour, Place, Shape, ShapeKind};

use super::{MAX_VIEW, Reader};
use crate::codes;
use crate::graf::parser::{Parse, short};
use crate::graf::settings::one_of;
use crate::graf::token::Kind;

/// The largest factor and divisor of a quantity in a place.
const MAX_FACTOR: i64 = 1_000_000;
/// The maximum number of quantities in a place.
const MAX_TERMS: usize = 8;

impl Reader<'_> {
    /// `rect 10 + pos, 30, 40, 20 fill grey when R`, after its first word.
    pub(super) fn shape(&mut self, kind: ShapeKind) -> Parse<Shape> {
        let mut places = vec![self.place()?];
        while places.len() < kind.places() {
            self.parser.expect(Kind::Comma, "`,` and the next number")?;
            places.push(self.place()?);
        }
        let text = if kind == ShapeKind::Text {
            self.parser.expect(Kind::Comma, "`,` and the text in quotes")?;
            self.parser.text("the text in quotes")?
        } else {
            String::new()
        };
        let fill = if self.parser.eat_word("fill") { Some(self.colour()?) } else { None };
        let when = self.optional_when()?;
        Ok(Shape { kind, places, text, fill, when })
    }

    /// `10 + pos - load * 3 / 4`
    fn place(&mut self) -> Parse<Place> {
        let mut place = Place::default();
        let mut sign = if self.parser.eat(Kind::Minus) { -1 } else { 1 };
        loop {
            if self.parser.kind(0) == Kind::Number {
                let value = self.whole(0, MAX_VIEW, "a number of the picture")?;
                place.base += sign * value;
            } else {
                let quantity = self.quantity_name()?;
                let mut factor = sign;
                if self.parser.eat(Kind::Star) {
                    factor *= self.whole(1, MAX_FACTOR, "the factor of a quantity")?;
                }
                let divisor = if self.parser.eat(Kind::Slash) {
                    self.whole(1, MAX_FACTOR, "the divisor of a quantity")?
                } else {
                    1
                };
                if place.terms.len() >= MAX_TERMS {
                    let here = self.parser.span_from(self.parser.previous_end);
                    let message = format!("more than {MAX_TERMS} quantities in one place");
                    let help = "leave out what changes the place least";
                    return Err(self.binding(here, &message, "too many", help));
                }
                place.terms.push((quantity, factor, divisor));
            }
            sign = match self.parser.kind(0) {
                Kind::Plus => 1,
                Kind::Minus => -1,
                _ => return Ok(place),
            };
            self.parser.advance();
            if place.base.abs() > MAX_FACTOR {
                let here = self.parser.span_from(self.parser.previous_end);
                let message = "a place far outside of the picture";
                return Err(self.binding(here, message, "too large", "use smaller numbers"));
            }
        }
    }

    fn colour(&mut self) -> Parse<Colour> {
        let word = self.parser.word(0);
        if let Some(colour) = Colour::ALL.into_iter().find(|one| one.word() == word) {
            self.parser.advance();
            return Ok(colour);
        }
        let words = || Colour::ALL.into_iter().map(Colour::word);
        let expected = one_of(words());
        if word.is_empty() {
            return Err(self.parser.unexpected(&expected));
        }
        let (span, near) = (self.parser.here(), nearest(word, words()));
        self.parser.report(|| {
            let message = format!("unknown colour `{}`", short(word));
            let finding = Diagnostic::error(codes::UNKNOWN_WORD, message);
            match near {
                Some(near) => finding.at(span, format!("did you mean `{near}`?")).fix(span, near),
                None => finding.at(span, "unknown here").help(format!("write {expected}")),
            }
        });
        Err(ErrorReported)
    }
}
