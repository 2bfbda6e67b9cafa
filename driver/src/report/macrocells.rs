//! The product terms of each macrocell, and the savings by don't-cares.

use super::chip::{Cell, Chip};
use super::document::{Block, Inline, Rich, Table};
use super::equations::form;
use super::{Subject, counted};

pub(super) fn write(_: &Subject<'_>, chip: &Chip) -> Vec<Block> {
    if chip.cells.is_empty() {
        return Vec::new();
    }
    let mut table =
        Table::new(["Pin", "Function", "Form", "Terms", "Of", "Minimum", "Without don't-cares"])
            .with_bars(3);
    for cell in &chip.cells {
        let pin = cell.pin.map_or_else(|| "-".to_owned(), |pin| pin.to_string());
        let sign = if cell.is_complemented { ", complement" } else { "" };
        table.row([
            pin,
            chip.names(cell).join(" = "),
            format!(
                "{}{sign}{}",
                form(cell),
                if cell.inverter.is_some() { ", inverter" } else { "" }
            ),
            cell.n_terms().to_string(),
            cell.available.map_or_else(|| "-".to_owned(), |terms| terms.to_string()),
            least(cell),
            without(cell),
        ]);
    }
    let spare = chip.device.filter(|device| chip.misfit.is_none() && device.blocks.is_none());
    let spare = spare.map_or(Vec::new(), |device| {
        device
            .macrocells
            .iter()
            .filter(|own| chip.cells.iter().all(|cell| cell.pin != Some(own.pin)))
            .collect()
    });
    for own in &spare {
        let terms = own.registered_terms.max(own.combinational_terms);
        let is_read = chip.signals.iter().find(|signal| signal.pin == Some(own.pin));
        let what =
            is_read.map_or("(spare)".to_owned(), |signal| format!("(input {})", signal.name));
        table.row([
            own.pin.to_string(),
            what,
            "-".to_owned(),
            "0".to_owned(),
            terms.to_string(),
            String::new(),
            String::new(),
        ]);
    }
    let mut blocks =
        vec![Block::Table(table), Block::Paragraph(Rich::plain(summary(chip, spare.len())))];
    blocks.extend(saved(chip).map(Block::Paragraph));
    if let Some(misfit) = &chip.misfit {
        let why = Inline::Message(misfit.to_string());
        let words = "It does not fit one device, so pins are not assigned: {}.";
        blocks.push(Block::Paragraph(Rich::say(words, [why])));
    }
    blocks
}

/// The totals of all macrocells.
fn summary(chip: &Chip, n_spare: usize) -> String {
    let used: usize = chip.cells.iter().map(|cell| cell.n_terms()).sum();
    let available: u32 = chip.cells.iter().filter_map(|cell| cell.available).sum();
    if chip.misfit.is_some() {
        let functions = counted(chip.cells.len(), "function", "functions");
        let terms = counted(used, "product term", "product terms");
        return format!("{terms} in {functions}.");
    }
    let mut text = format!(
        "{used} of {} used in {}",
        counted(available as usize, "product term", "product terms"),
        counted(chip.cells.len(), "macrocell", "macrocells")
    );
    match chip.device.filter(|_| chip.misfit.is_none()) {
        Some(device) if device.blocks.is_some() => {
            let own = device.blocks.map_or(1, |blocks| blocks.own_terms.max(1));
            let taken: u32 = chip.cells.iter().filter_map(|cell| cell.available).sum();
            text += &format!(
                "; including those that wide sums use in addition, {} of {} macrocells",
                taken / own,
                device.n_cells()
            );
        }
        Some(_) => text += &format!(", {n_spare} spare"),
        None => {}
    }
    text + "."
}

/// The savings by don't-cares, of the functions for which they are known.
fn saved(chip: &Chip) -> Option<Rich> {
    let counted_cells: Vec<(&Cell, usize)> =
        (chip.cells.iter()).filter_map(|cell| Some((cell, cell.count.without?.0))).collect();
    if counted_cells.is_empty() {
        return None;
    }
    let with: usize = counted_cells.iter().map(|(cell, _)| cell.n_terms()).sum();
    let without: usize = counted_cells.iter().map(|(_, without)| without).sum();
    let bound: usize =
        counted_cells.iter().filter_map(|(cell, _)| Some(cell.count.without?.1)).sum();
    Some(match without.cmp(&with) {
        std::cmp::Ordering::Greater => {
            let sure = if bound == without {
                "proved to be the minimum without them".to_owned()
            } else {
                format!("the minimum without them is at least {bound}")
            };
            Rich::plain(format!(
                "Don't-cares saved {}: the same functions in the same form need {without} without them ({sure}).",
                counted(without - with, "term", "terms"),
            ))
        }
        std::cmp::Ordering::Equal => Rich::plain(
            "The same functions in the same form need as many terms without don't-cares.",
        ),
        std::cmp::Ordering::Less => {
            let how = if chip.code.is_none() { "; use `--refit` to minimise them" } else { "" };
            let words = "The same functions in the same form need {} of these {} terms";
            let numbers = [without, with].map(|n| n.to_string().into());
            Rich::say(words, numbers).and(Rich::say(how, [])).and(Rich::plain("."))
        }
    })
}

/// Whether fewer products are possible.
fn least(cell: &Cell) -> String {
    match cell.count.least {
        None => "not known".to_owned(),
        Some(_) if cell.is_least() => "proved".to_owned(),
        Some(least) => format!("at least {least}"),
    }
}

/// The number of terms without don't-cares.
fn without(cell: &Cell) -> String {
    match cell.count.without {
        None => "not counted".to_owned(),
        Some((found, least)) if found == least => found.to_string(),
        Some((found, least)) => format!("{found} (at least {least})"),
    }
}
