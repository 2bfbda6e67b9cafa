//! The writer.

use super::{ETX, STX, transmission_checksum};
use crate::equations::one_line;
use crate::fuse::FuseMap;
use crate::fuse::vectors::{Level, Vector};
use crate::placement::PinName;
use std::fmt::Write as _;

/// The contents of a file besides the fuses.
#[derive(Debug, Clone, Default)]
pub struct Head {
    /// Lines before the first field; characters that would end a field are removed.
    pub lines: Vec<String>,
    /// The names of the pins, for a note that our reader and others understand.
    pub pins: Vec<PinName>,
}

/// The text of a fuse map: fuses row by row, except rows of zeros, which use the default; vectors; both checksums.
#[must_use]
pub fn write(map: &FuseMap, head: &Head, vectors: &[Vector]) -> String {
    let mut text = String::from(char::from(STX));
    for line in &head.lines {
        text.push_str(&plain(line));
        text.push('\n');
    }
    text.push_str("*\n");
    if !head.pins.is_empty() {
        // A pin has one name, even if a design gives it several.
        let mut named: Vec<u32> = Vec::new();
        let mut pins = Vec::new();
        for pin in &head.pins {
            if named.contains(&pin.pin) {
                continue;
            }
            named.push(pin.pin);
            let not = if pin.is_inverted { "/" } else { "" };
            pins.push(format!("{not}{}:{}", plain(&pin.name).replace(' ', "_"), pin.pin));
        }
        let _ = writeln!(text, "N PINS {}*", pins.join(" "));
    }
    let _ = writeln!(text, "QP{}*\nQF{}*", map.device.n_pins, map.fuses.len());
    if !vectors.is_empty() {
        let _ = writeln!(text, "QV{}*", vectors.len());
    }
    let _ = writeln!(text, "G{}*\nF0*", u8::from(map.is_secured));
    let n_columns = map.device.layout.map_or(32, |layout| layout.n_columns as usize);
    let n_array =
        map.device.layout.map_or(0, |layout| (layout.n_rows() * layout.n_columns) as usize);
    let (array, rest) = map.fuses.split_at(n_array.min(map.fuses.len()));
    let digits = |fuses: &[bool]| -> String {
        fuses.iter().map(|fuse| if *fuse { '1' } else { '0' }).collect()
    };
    for (row, fuses) in array.chunks(n_columns).enumerate() {
        if fuses.contains(&true) {
            let _ = writeln!(text, "L{:04} {}*", row * n_columns, digits(fuses));
        }
    }
    // After the array come polarities, kinds and the signature: printed in full, each on a separate line.
    let mut starts: Vec<usize> = vec![n_array];
    if let Some(layout) = map.device.layout {
        starts.extend(
            layout.signature.iter().flat_map(|first| [*first, *first + 64]).map(|at| at as usize),
        );
        starts.extend(layout.row_switches.map(|first| first as usize));
        starts.extend(layout.modes[0].fuses.iter().map(|(fuse, _)| *fuse as usize));
    }
    starts.retain(|start| *start < map.fuses.len());
    starts.sort_unstable();
    starts.dedup();
    for (index, start) in starts.iter().enumerate() {
        let end = starts.get(index + 1).copied().unwrap_or(map.fuses.len());
        let _ = writeln!(text, "L{start:04} {}*", digits(&rest[start - n_array..end - n_array]));
    }
    let _ = writeln!(text, "C{:04X}*", map.checksum());
    if !vectors.is_empty() {
        text.push_str("X0*\n");
    }
    for (index, vector) in vectors.iter().enumerate() {
        let letters: String = vector.iter().map(|level| Level::letter(*level)).collect();
        let _ = writeln!(text, "V{:04} {letters}*", index + 1);
    }
    text.push(char::from(ETX));
    let sum = transmission_checksum(text.as_bytes());
    let _ = writeln!(text, "{sum:04X}");
    text
}

/// Text that is safe in a field: without asterisks, which would end it, and without non-ASCII bytes, which a transmission cannot contain.
fn plain(text: &str) -> String {
    one_line(text)
        .chars()
        .map(|c| if c.is_ascii_graphic() && c != '*' || c == ' ' { c } else { '_' })
        .collect()
}
