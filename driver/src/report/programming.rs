//! How to program the chip, and how to identify it afterwards.

use super::chip::{Chip, Language};
use super::document::{Block, Rich, Table};
use super::{Subject, counted};
use grafsynth_backend_pld::Dialect;

pub(super) fn write(_: &Subject<'_>, chip: &Chip) -> Vec<Block> {
    match chip.language {
        Language::Jedec => fuses(chip).unwrap_or_default(),
        Language::Text(dialect) => text(chip, dialect),
    }
}

fn fuses(chip: &Chip) -> Option<Vec<Block>> {
    let (map, device) = (chip.fuses.as_ref()?, chip.device?);
    let mut table = Table::new(["Property", "Value"]);
    let mut say = |what: &str, is: String| table.row([what.to_owned(), is]);
    say("device", device.burned_as.to_owned());
    if !device.burned_as.eq_ignore_ascii_case(device.name) {
        say("replaces", device.palasm.to_owned());
    }
    if let Some(layout) = device.layout {
        let is_chosen = |mode: &&grafsynth_backend_pld::device::layout::Mode| {
            mode.fuses.iter().all(|(fuse, value)| map.get(*fuse) == *value)
        };
        if let Some(mode) = layout.modes.iter().find(is_chosen).filter(|mode| !mode.name.is_empty())
        {
            say("mode", mode.name.to_owned());
        }
    }
    say("fuses, their checksum", format!("{}, {:04X}", map.fuses.len(), map.checksum()));
    if let Some(signature) = map.signature() {
        let bytes: Vec<String> = signature.iter().map(|byte| format!("{byte:02X}")).collect();
        say("signature in the device", bytes.join(" "));
    }
    let secured = if map.is_secured {
        "set: it cannot be read out"
    } else {
        "not set: it can be read out and compared"
    };
    say("security fuse", secured.to_owned());
    say("test vectors", format!("{}; the first is the power-up state", chip.n_vectors));
    let mut blocks = vec![Block::Table(table)];
    let Some(command) = crate::jedec::command_for(device, chip.part, &chip.file) else {
        let none = "There is no supported programmer for this device.";
        blocks.push(Block::Paragraph(Rich::say(none, [])));
        return Some(blocks);
    };
    blocks.push(Block::Text(format!("{command}\n")));
    let others = crate::jedec::other_parts(device, chip.part);
    if !others.is_empty() {
        let words = "The file fits these chips too: {} (`-p`).";
        blocks.push(Block::Paragraph(Rich::say(words, [others.join(", ").into()])));
    }
    Some(blocks)
}

fn text(chip: &Chip, dialect: Dialect) -> Vec<Block> {
    let file = &chip.file;
    let made = |assembler: &str| {
        let words = " makes the fuse map; `grafsynth build --target jedec` makes and proves one for the GALs.";
        Block::Paragraph(Rich::plain(assembler).and(Rich::say(words, [])))
    };
    let mut blocks = match (dialect, chip.package) {
        (Dialect::Galasm, _) => {
            vec![Block::Text(format!("galette {file}      makes the fuse map\n"))]
        }
        (Dialect::Palasm, _) => vec![made("An assembler for PALASM")],
        (Dialect::Cupl, _) => vec![made("WinCUPL")],
        (Dialect::Verilog, Some(package)) => {
            let stem = file.rsplit_once('.').map_or(file.as_str(), |(stem, _)| stem);
            vec![Block::Text(format!(
                "yosys -p 'synth_ice40 -json {stem}.json' {file}\nnextpnr-ice40 {} --package {} --json {stem}.json --pcf {stem}.pcf --asc {stem}.asc\nicepack {stem}.asc {stem}.bin\niceprog {stem}.bin\n",
                package.device, package.package
            ))]
        }
        (Dialect::Verilog | Dialect::Blif, _) => Vec::new(),
    };
    if chip.n_vectors > 0 {
        let rows = counted(chip.n_vectors, "row", "rows");
        blocks.push(Block::Paragraph(Rich::plain(format!(
            "Test vectors: {rows} of the stimulus, with the outputs of the chart."
        ))));
    }
    blocks
}
