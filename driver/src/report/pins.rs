//! The pins: a drawing in characters and a list.

use super::Subject;
use super::chip::{Chip, Kind, Signal};
use super::document::{Block, Rich, Table};
use super::drawing::{Drawing, PinMark, PinRole, Shape};

pub(super) fn write(_: &Subject<'_>, chip: &Chip) -> Vec<Block> {
    let drawing = Drawing::of(chip);
    let mut table = Table::new(["Pin", "Name", "Use", "Label", "In the file"]);
    for pin in drawing.pins.iter().filter(|pin| is_listed(pin, drawing.shape)) {
        let signals: Vec<&Signal> = chip
            .signals
            .iter()
            .filter(|signal| match pin.number {
                Some(number) => signal.pin == Some(number),
                None => signal.on_pin() == pin.name,
            })
            .collect();
        let printed: Vec<&str> =
            signals.iter().filter_map(|signal| signal.printed.as_deref()).collect();
        let mut is = pin.role.word().to_owned();
        if signals.iter().any(|signal| signal.is_inverted) {
            is += ", inverted";
        }
        is += match pin.role {
            PinRole::Enable => "; tie it low",
            PinRole::Control => "; tie it high",
            PinRole::Driven => "; leave it open",
            PinRole::Idle => "; tie it to a level",
            _ => "",
        };
        table.row([
            pin.number.map_or_else(|| "-".to_owned(), |pin| pin.to_string()),
            pin.name.clone(),
            is,
            pin.label.clone(),
            printed.join(", "),
        ]);
    }
    let mut blocks = vec![Block::Text(drawing.text()), Block::Table(table)];
    let hidden = chip.signals.iter().filter(|signal| {
        signal.pin.is_none() && matches!(signal.kind, Kind::Flop(_) | Kind::Buried)
    });
    let hidden = hidden.count();
    if hidden > 0 && chip.device.is_none() {
        let what = super::counted(hidden, "flip-flop is", "flip-flops are");
        blocks.push(Block::Paragraph(Rich::plain(format!("{what} buried, without a pin."))));
    }
    blocks
}

/// True if a pin is listed: all pins of packages with two rows and of symbols, only the used pins of others.
fn is_listed(pin: &PinMark, shape: Shape) -> bool {
    match shape {
        Shape::Dual | Shape::Symbol => true,
        Shape::Quad | Shape::Flat => pin.role != PinRole::Idle,
    }
}
