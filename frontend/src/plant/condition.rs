//! Conditions of plants: comparisons with numbers, joined by `and`, `or` and `not`.

use grafsynth_ir::expr::Type;
use grafsynth_ir::plant::{Condition, MAX_UNITS, Reading, SCALE};

use super::{Meaning, Reader};
use crate::graf::parser::{Parse, short};
use crate::graf::token::Kind;

impl Reader<'_> {
    /// `when` and a condition; without it, always.
    pub(super) fn optional_when(&mut self) -> Parse<Condition> {
        if self.parser.eat_word("when") { self.condition() } else { Ok(Condition::All(Vec::new())) }
    }

    /// A condition: alternatives with `or`.
    pub(super) fn condition(&mut self) -> Parse<Condition> {
        self.parser.enter()?;
        let mut any = vec![self.conjunction()?];
        while self.parser.eat_word("or") {
            any.push(self.conjunction()?);
        }
        self.parser.leave();
        Ok(joined(any, Condition::Any))
    }

    fn conjunction(&mut self) -> Parse<Condition> {
        let mut all = vec![self.negation()?];
        while self.parser.eat_word("and") {
            all.push(self.negation()?);
        }
        Ok(joined(all, Condition::All))
    }

    fn negation(&mut self) -> Parse<Condition> {
        if self.parser.eat_word("not") {
            self.parser.enter()?;
            let inner = self.negation()?;
            self.parser.leave();
            return Ok(Condition::Not(Box::new(inner)));
        }
        if self.parser.eat(Kind::Open) {
            let inner = self.condition()?;
            self.parser.expect(Kind::Close, "`)`")?;
            return Ok(inner);
        }
        self.comparison()
    }

    /// `R`, `pos <= 5`
    fn comparison(&mut self) -> Parse<Condition> {
        let (name, span) = self.path("a condition")?;
        let (reading, is_bool) = match self.meaning(&name, span)? {
            Meaning::Quantity(id) => (Reading::Quantity(id), false),
            Meaning::Input(id) => (Reading::Input(id), self.net.inputs[id].ty == Type::Bool),
            Meaning::Output(id) => (Reading::Output(id), self.net.outputs[id].ty == Type::Bool),
            Meaning::Other(what) => {
                let message = format!("`{}` is {what}, which a plant cannot read", short(&name));
                let help = "read a quantity, an output, or an input that keeps its value";
                return Err(self.binding(span, &message, "not readable here", help));
            }
        };
        if is_bool {
            return Ok(Condition::Within(reading, Some(1), Some(1)));
        }
        let sign = self.parser.kind(0);
        let is_sign = matches!(
            sign,
            Kind::Equal
                | Kind::NotEqual
                | Kind::Less
                | Kind::LessEqual
                | Kind::Greater
                | Kind::GreaterEqual
        );
        if !is_sign {
            return Err(self.parser.unexpected("a comparison, such as `>= 1`"));
        }
        self.parser.advance();
        let is_quantity = matches!(reading, Reading::Quantity(_));
        let (bound, scale) =
            if is_quantity { (MAX_UNITS, SCALE) } else { (i64::from(u32::MAX), 1) };
        let value = self.whole(-bound, bound, "the number of a comparison")? * scale;
        Ok(match sign {
            Kind::Less => Condition::Within(reading, None, Some(value - 1)),
            Kind::LessEqual => Condition::Within(reading, None, Some(value)),
            Kind::Greater => Condition::Within(reading, Some(value + 1), None),
            Kind::GreaterEqual => Condition::Within(reading, Some(value), None),
            Kind::NotEqual => {
                Condition::Not(Box::new(Condition::Within(reading, Some(value), Some(value))))
            }
            _ => Condition::Within(reading, Some(value), Some(value)),
        })
    }
}

/// One operand is itself.
fn joined(mut all: Vec<Condition>, join: fn(Vec<Condition>) -> Condition) -> Condition {
    match all.len() {
        1 => all.remove(0),
        _ => join(all),
    }
}
