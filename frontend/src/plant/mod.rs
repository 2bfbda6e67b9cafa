//! Plant files (docs/plant.md): a picture of what a chart controls, which moves by the outputs and drives inputs.
//!
//! ```text
//! view 160, 70
//! quantity pos "position in dm": 0..100 = 0
//! move pos by 20 when R
//! input b = pos >= 100
//! rect 10 + pos, 30, 40, 20 fill grey
//! ```
//!
//! The lexical elements are those of the chart language. Names refer to the net for which the plant is read, and are resolved here; a quantity is declared
//! before it is used. The meaning is in the crate `sim`.

mod condition;
mod shape;
#[cfg(test)]
mod tests;

use grafsynth_ir::diag::{Diagnostic, ErrorReported, any_error, nearest};
use grafsynth_ir::expr::Type;
use grafsynth_ir::net::{InputId, InputKind, Net, OutputId};
use grafsynth_ir::plant::{
    MAX_ITEMS, MAX_RATE, MAX_UNITS, Move, Plant, Quantity, QuantityId, Sensor, Set, ShapeKind,
};
use grafsynth_ir::{FileId, Gather, Span};
use std::collections::BTreeMap;

use crate::codes;
use crate::graf::parser::{Parse, Parser, short};
use crate::graf::settings::one_of;
use crate::graf::token::Kind;
use crate::graf::{Limits, sorted, too_large};

/// The largest width and height of a picture.
const MAX_VIEW: i64 = 10_000;

/// The words with which an item begins.
const ITEMS: [&str; 5] = ["view", "quantity", "move", "set", "input"];

/// Reads the plant of a net. With errors there is no plant.
#[must_use]
pub fn parse(
    net: &Net,
    file: FileId,
    text: &str,
    limits: &Limits,
) -> (Option<Plant>, Vec<Diagnostic>) {
    if let Some(finding) = too_large(file, text, limits) {
        return (None, vec![finding]);
    }
    let mut reader = Reader {
        parser: Parser::new(file, text, None, *limits, false),
        net,
        plant: Plant::default(),
        names: names(net),
        driven: BTreeMap::new(),
        view: None,
        is_full: false,
    };
    reader.items();
    let findings = sorted(reader.parser.findings.finish());
    let plant = (!any_error(&findings)).then_some(reader.plant);
    (plant, findings)
}

/// Something that a name of a plant file means.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Meaning {
    Quantity(QuantityId),
    Input(InputId),
    Output(OutputId),
    /// Something of the chart that a plant cannot read, with what it is.
    Other(&'static str),
}

/// The names of the chart. If an input and an output have the same name, an output is meant: a plant reads outputs.
fn names(net: &Net) -> BTreeMap<String, Meaning> {
    let inputs = net.inputs.iter().map(|(id, input)| {
        let meaning = match input.kind {
            InputKind::Pin | InputKind::Extern => Meaning::Input(id),
            InputKind::Event | InputKind::InternalEvent => Meaning::Other("an event"),
        };
        (input.name.text.clone(), meaning)
    });
    let outputs = net.outputs.iter().map(|(id, output)| {
        let meaning =
            if output.is_extern() { Meaning::Other("a call") } else { Meaning::Output(id) };
        (output.name.text.clone(), meaning)
    });
    inputs.chain(outputs).gather()
}

struct Reader<'a> {
    parser: Parser<'a>,
    net: &'a Net,
    plant: Plant,
    names: BTreeMap<String, Meaning>,
    /// The inputs that are driven, each with its location.
    driven: BTreeMap<InputId, Span>,
    /// The location of the view.
    view: Option<Span>,
    /// True if the maximum number of items was reported.
    is_full: bool,
}

impl Reader<'_> {
    fn items(&mut self) {
        while self.parser.kind(0) != Kind::End {
            let before = self.parser.peek(0).start;
            if self.item().is_err() {
                self.parser.skip_to_line(before);
            }
            self.parser.depth = 0;
        }
        if self.view.is_none() {
            self.parser.missing(
                "the plant has no `view`",
                "write the size of the picture, such as `view 160, 90`",
            );
        }
    }

    fn item(&mut self) -> Parse<()> {
        let word = self.parser.word(0);
        if let Some(kind) = ShapeKind::ALL.into_iter().find(|kind| kind.word() == word) {
            self.parser.advance();
            let shape = self.shape(kind)?;
            return self.kept(|plant| &mut plant.shapes, shape);
        }
        match word {
            "view" => self.view(),
            "quantity" => self.quantity(),
            "move" => {
                let it = self.movement()?;
                self.kept(|plant| &mut plant.moves, it)
            }
            "set" => {
                let it = self.set()?;
                self.kept(|plant| &mut plant.sets, it)
            }
            "input" => self.sensor(),
            _ => Err(self.unknown_item(word)),
        }
    }

    fn unknown_item(&mut self, word: &str) -> ErrorReported {
        let all = || ITEMS.into_iter().chain(ShapeKind::ALL.into_iter().map(ShapeKind::word));
        let expected = one_of(all());
        if word.is_empty() {
            return self.parser.unexpected(&expected);
        }
        let (span, near) = (self.parser.here(), nearest(word, all()));
        self.parser.report(|| {
            let finding = Diagnostic::error(
                codes::UNKNOWN_WORD,
                format!("unknown item of a plant: `{}`", short(word)),
            );
            match near {
                Some(near) => finding.at(span, format!("did you mean `{near}`?")).fix(span, near),
                None => finding.at(span, "unknown here").help(format!("write {expected}")),
            }
        });
        ErrorReported
    }

    /// Adds an item to its list, up to the maximum number.
    fn kept<T>(&mut self, list: fn(&mut Plant) -> &mut Vec<T>, item: T) -> Parse<()> {
        if list(&mut self.plant).len() >= MAX_ITEMS {
            return Err(self.full());
        }
        list(&mut self.plant).push(item);
        Ok(())
    }

    fn full(&mut self) -> ErrorReported {
        if !std::mem::replace(&mut self.is_full, true) {
            let here = self.parser.span_from(self.parser.previous_end);
            let message = format!("more than {MAX_ITEMS} items of one kind");
            self.binding(here, &message, "too many", "describe the plant with fewer parts");
        }
        ErrorReported
    }

    fn binding(&mut self, span: Span, message: &str, label: &str, help: &str) -> ErrorReported {
        self.parser
            .report(|| Diagnostic::error(codes::PLANT_BINDING, message).at(span, label).help(help));
        ErrorReported
    }

    /// `view 160, 70`
    fn view(&mut self) -> Parse<()> {
        let start = self.parser.advance().start;
        let width = self.whole(1, MAX_VIEW, "the width of the picture")?;
        self.parser.expect(Kind::Comma, "`,` and the height of the picture")?;
        let height = self.whole(1, MAX_VIEW, "the height of the picture")?;
        let span = self.parser.span_from(start);
        if let Some(first) = self.view.replace(span) {
            self.parser.report(|| {
                Diagnostic::error(codes::TWICE, "a second `view`")
                    .at(span, "the second one")
                    .at(first, "the first one")
                    .help("remove one of them")
            });
        }
        self.plant.view = (width, height);
        Ok(())
    }

    /// `quantity pos "position": 0..100 = 0`
    fn quantity(&mut self) -> Parse<()> {
        self.parser.advance();
        let name = self.parser.name("the name of the quantity")?;
        let label = match self.parser.kind(0) {
            Kind::Text | Kind::RawText => Some(self.parser.text("a label")?),
            _ => None,
        };
        self.parser.expect(Kind::Colon, "`:` and the range of the quantity")?;
        let start = self.parser.peek(0).start;
        let lo = self.whole(-MAX_UNITS, MAX_UNITS, "the lowest value")?;
        self.parser.expect(Kind::Range, "`..` and the highest value")?;
        let hi = self.whole(-MAX_UNITS, MAX_UNITS, "the highest value")?;
        let span = self.parser.span_from(start);
        if lo >= hi {
            self.parser.report(|| {
                Diagnostic::error(codes::RANGE, format!("the range {lo}..{hi} is empty"))
                    .at(span, "the highest value must be larger than the lowest")
            });
            return Err(ErrorReported);
        }
        let init = if self.parser.eat(Kind::Equal) {
            self.whole(lo, hi, "the first value")?
        } else {
            0.clamp(lo, hi)
        };
        if let Some(other) = self.names.get(&name.text) {
            let what = match other {
                Meaning::Quantity(_) => "a quantity",
                Meaning::Input(_) => "an input of the chart",
                Meaning::Output(_) => "an output of the chart",
                Meaning::Other(what) => what,
            };
            let message = format!("`{}` is already {what}", short(&name.text));
            let help = "give the quantity another name";
            return Err(self.binding(name.span, &message, "this name is taken", help));
        }
        if self.plant.quantities.len() >= MAX_ITEMS {
            return Err(self.full());
        }
        let quantity = Quantity { name: name.text.clone(), label, lo, hi, init };
        let id = self.plant.quantities.push(quantity);
        self.names.insert(name.text, Meaning::Quantity(id));
        Ok(())
    }

    /// `move pos by 20 * v when R`
    fn movement(&mut self) -> Parse<Move> {
        self.parser.advance();
        let quantity = self.quantity_name()?;
        self.parser.expect_word("by")?;
        let rate = self.whole(-MAX_RATE, MAX_RATE, "the rate in units per second")?;
        let speed = if self.parser.eat(Kind::Star) { Some(self.speed()?) } else { None };
        let when = self.optional_when()?;
        Ok(Move { quantity, rate, speed, when })
    }

    /// The output that is a factor of a rate.
    fn speed(&mut self) -> Parse<OutputId> {
        let (name, span) = self.path("the name of an integer output")?;
        match self.meaning(&name, span)? {
            Meaning::Output(id) if self.net.outputs[id].ty != Type::Bool => Ok(id),
            Meaning::Output(_) => Err(self.binding(
                span,
                &format!("`{}` is a Boolean output, not a factor", short(&name)),
                "a rate needs a number",
                &format!("write `when {}` after the rate", short(&name)),
            )),
            Meaning::Quantity(_) | Meaning::Input(_) | Meaning::Other(_) => Err(self.binding(
                span,
                &format!("`{}` is not an output", short(&name)),
                "a rate needs an integer output",
                "write the rate as a number, or name an integer output of the chart",
            )),
        }
    }

    /// `set load := 0 when pos = 0`
    fn set(&mut self) -> Parse<Set> {
        self.parser.advance();
        let quantity = self.quantity_name()?;
        self.parser.expect(Kind::Assign, "`:=` and a value")?;
        let Quantity { lo, hi, .. } = self.plant.quantities[quantity];
        let value = self.whole(lo, hi, "the value")?;
        self.parser.expect_word("when")?;
        let when = self.condition()?;
        Ok(Set { quantity, value, when })
    }

    /// `input b = pos >= 100`, `input level = height`
    fn sensor(&mut self) -> Parse<()> {
        self.parser.advance();
        let (name, span) = self.path("the name of an input")?;
        let input = match self.meaning(&name, span)? {
            Meaning::Input(id) => id,
            // An input may have the name of an output.
            Meaning::Output(_) | Meaning::Quantity(_) | Meaning::Other(_) => {
                let found = self.net.inputs.iter().find(|(_, one)| {
                    one.name.text == name && matches!(one.kind, InputKind::Pin | InputKind::Extern)
                });
                match found {
                    Some((id, _)) => id,
                    None => {
                        let message = format!("`{}` is not an input", short(&name));
                        let help =
                            "name an input of the chart; what the chart sets is read with `when`";
                        return Err(self.binding(span, &message, "cannot be driven", help));
                    }
                }
            }
        };
        self.parser.expect(Kind::Equal, "`=` and what drives the input")?;
        let sensor = if self.net.inputs[input].ty == Type::Bool {
            Sensor::Is(self.condition()?)
        } else {
            Sensor::Measures(self.quantity_name()?)
        };
        if let Some(first) = self.driven.insert(input, span) {
            self.parser.report(|| {
                Diagnostic::error(codes::TWICE, format!("`{}` is driven twice", short(&name)))
                    .at(span, "the second time")
                    .at(first, "the first time")
                    .help("write one condition, with `or` if necessary")
            });
            return Err(ErrorReported);
        }
        self.kept(|plant| &mut plant.sensors, (input, sensor))
    }

    // Names and numbers

    /// A dotted name.
    fn path(&mut self, what: &str) -> Parse<(String, Span)> {
        let path = self.parser.path(what)?;
        Ok((path.to_string(), path.span()))
    }

    /// What a name means; an unknown one is reported.
    fn meaning(&mut self, name: &str, span: Span) -> Parse<Meaning> {
        if let Some(meaning) = self.names.get(name) {
            return Ok(*meaning);
        }
        let near = nearest(name, self.names.keys().map(String::as_str)).map(str::to_owned);
        self.parser.report(|| {
            let message = format!("no quantity, input or output is called `{}`", short(name));
            let finding = Diagnostic::error(codes::PLANT_NAME, message);
            match near {
                Some(near) => finding.at(span, format!("did you mean `{near}`?")).fix(span, near),
                None => finding
                    .at(span, "unknown here")
                    .help("quantities are declared above their use; the chart declares the others"),
            }
        });
        Err(ErrorReported)
    }

    /// The name of a quantity.
    fn quantity_name(&mut self) -> Parse<QuantityId> {
        let (name, span) = self.path("the name of a quantity")?;
        match self.meaning(&name, span)? {
            Meaning::Quantity(id) => Ok(id),
            Meaning::Input(_) | Meaning::Output(_) | Meaning::Other(_) => {
                let message = format!("`{}` is not a quantity", short(&name));
                let help = "declare it above, such as `quantity level: 0..100`";
                Err(self.binding(span, &message, "expected a quantity of the plant", help))
            }
        }
    }

    /// A whole number within bounds, with a sign.
    fn whole(&mut self, lo: i64, hi: i64, what: &str) -> Parse<i64> {
        let start = self.parser.peek(0).start;
        let is_negative = self.parser.eat(Kind::Minus);
        let token = self.parser.expect(Kind::Number, what)?;
        let span = self.parser.span_from(start);
        let size = self.parser.number_at(token).and_then(|size| i64::try_from(size).ok());
        let value = size.map(|size| if is_negative { -size } else { size });
        match value.filter(|value| (lo..=hi).contains(value)) {
            Some(value) => Ok(value),
            None => {
                self.parser.report(|| {
                    Diagnostic::error(codes::NUMBER, format!("{what} must be in {lo}..{hi}"))
                        .at(span, "outside this range")
                });
                Err(ErrorReported)
            }
        }
    }
}
