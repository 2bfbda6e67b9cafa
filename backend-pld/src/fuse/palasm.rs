//! Prints a placement as PALASM text: equations from a fuse map, product by product.

use crate::placement::{Cell, CellKind, Placement, Product};
use grafsynth_ir::names::{Namer, PALASM, PALASM_CHIP};
use itertools::Itertools as _;
use std::collections::BTreeMap;
use std::fmt::Write as _;

/// The text of a placement in PALASM 2: every macrocell with its unchanged sum, its enable, clock, set and reset, and those of the whole device.
#[must_use]
pub fn palasm(placement: &Placement) -> String {
    let device = placement.device;
    let mut namer = Namer::new(&PALASM);
    let mut names: BTreeMap<u32, String> = BTreeMap::new();
    let is_used = |pin: u32| {
        placement.name(pin).is_some()
            || placement.cell(pin).is_some()
            || placement.products().any(|product| product.literal(pin).is_some())
            || device.clock == crate::device::Clock::Pin(pin)
    };
    for pin in (1..=device.n_pins).filter(|pin| is_used(*pin)) {
        let kind = if placement.cell(pin).is_some() { "o" } else { "i" };
        let wanted = placement.name(pin).map_or_else(|| format!("{kind}{pin}"), str::to_owned);
        names.insert(pin, namer.name(&wanted));
    }
    let title = Namer::new(&PALASM_CHIP).name(if placement.title.is_empty() {
        device.name
    } else {
        &placement.title
    });
    let mut text = format!(
        "; equations from a fuse map, by grafsynth {}\n\nTITLE     {title}\nPATTERN   1\nREVISION  1\nAUTHOR    grafsynth\nCOMPANY   -\nDATE      -\n\nCHIP  {title}  {}\n\n",
        env!("CARGO_PKG_VERSION"),
        device.palasm
    );
    let has_global = placement.async_reset.is_some() || placement.sync_preset.is_some();
    for (pin, name) in &names {
        let is_registered =
            placement.cell(*pin).is_some_and(|cell| cell.kind == CellKind::Registered);
        let kind = if is_registered { "REGISTERED" } else { "COMBINATORIAL" };
        let _ = writeln!(text, "PIN {pin:<3} {name:<15} {kind}");
    }
    if has_global {
        text.push_str("NODE 1 GLOBAL\n");
    }
    text.push_str("\nEQUATIONS\n\n");
    let product = |product: &Product| -> String {
        if product.0.is_empty() {
            return "VCC".to_owned();
        }
        if product.is_never() {
            return "GND".to_owned();
        }

        product
            .0
            .iter()
            .map(|(pin, value)| {
                let name = names.get(pin).map_or("VCC", String::as_str);
                if *value { name.to_owned() } else { format!("/{name}") }
            })
            .join(" * ")
    };
    for (what, term) in [("RSTF", &placement.async_reset), ("SETF", &placement.sync_preset)] {
        if let Some(term) = term {
            let _ = writeln!(text, "GLOBAL.{what} = {}", product(term));
        }
    }
    for cell in &placement.cells {
        write_cell(&mut text, &names, cell, &product);
    }
    text
}

fn write_cell(
    text: &mut String,
    names: &BTreeMap<u32, String>,
    cell: &Cell,
    product: &dyn Fn(&Product) -> String,
) {
    let Some(name) = names.get(&cell.pin) else { return };
    let not = if cell.is_active_low { "/" } else { "" };
    let sign = if cell.kind == CellKind::Registered { ":=" } else { "=" };
    let products: Vec<String> = cell.sum.iter().map(product).collect();
    let sum = if products.is_empty() { "GND".to_owned() } else { products.join("\n    + ") };
    let _ = writeln!(text, "{not}{name} {sign} {sum}");
    let terms =
        [("TRST", &cell.enable), ("CLKF", &cell.clock), ("SETF", &cell.set), ("RSTF", &cell.reset)];
    for (suffix, term) in terms {
        if let Some(term) = term {
            let _ = writeln!(text, "{name}.{suffix} = {}", product(term));
        }
    }
}
