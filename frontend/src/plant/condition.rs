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
        let bounds: fn(i64) -> (Option<i64>, Option<i64>) = match sign {
            Kind::Less => |value| (None, Some(value - 1)),
            Kind::LessEqual => |value| (None, Some(value)),
            Kind::Greater => |value| (Some(value + 1), None),
            Kind::GreaterEqual => |value| (Some(value), None),
            Kind::Equal | Kind::NotEqual => |value| (Some(value), Some(value)),
            _ => return Err(self.parser.unexpected("a comparison, such as `>= 1`")),
        };
        self.parser.advance();
        let (largest, scale) = match reading {
            Reading::Quantity(_) => (MAX_UNITS, SCALE),
            Reading::Input(_) | Reading::Output(_) => (i64::from(u32::MAX), 1),
        };
        let value = self.whole(-largest, largest, "the number of a comparison")? * scale;
        let (lo, hi) = bounds(value);
        let within = Condition::Within(reading, lo, hi);
        Ok(if sign == Kind::NotEqual { Condition::Not(Box::new(within)) } else { within })
    }
}

/// One operand is itself.
fn joined(mut all: Vec<Condition>, join: fn(Vec<Condition>) -> Condition) -> Condition {
    match all.len() {
        1 => all.remove(0),
        _ => join(all),
    }
}
