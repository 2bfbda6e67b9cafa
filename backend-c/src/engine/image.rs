//! A chart as an image: the tables that the engine runs, as the bytes that it reads. `docs/c.md` describes them; `grafsynth_engine.c` reads and
//! checks them.

use crate::Object;
use grafsynth_ir::expr::Type;
use std::collections::BTreeMap;

/// The version of the format of both kinds of images.
pub(super) const VERSION: u8 = 2;
/// Bytes of a program before the rows of cells.
pub(super) const PROGRAM_HEADER: usize = 32;
/// The kind number of a program, which distinguishes it from the images of tables.
pub(super) const PROGRAM_KIND: u8 = 4;
/// Bytes before the first section.
pub(super) const HEADER: usize = 84;
/// The position of the checksum, which covers all bytes; its own bytes count as 0.
const CHECKSUM: std::ops::Range<usize> = 8..12;
/// The number for "none" in a row that can refer to another row.
pub(super) const NONE: u16 = 0xffff;

/// The flag of an item that is the initial content of a state, not a state.
pub(super) const CONTENT: u16 = 0x4000;
/// The flag of an item that is a history; see also [`CONTENT`].
pub(super) const HISTORY: u16 = 0x8000;
/// The maximum number of states that an item can encode.
pub(super) const MOST_STATES: usize = 0x3fff;

/// The kinds of charts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ImageKind {
    /// A net whose fireable transitions all fire.
    All = 0,
    /// A net whose transitions compete for steps.
    Priority = 1,
    /// A statechart, inner transitions first.
    InnerFirst = 2,
    /// A statechart, outer transitions first.
    OuterFirst = 3,
}

/// The sections, in the order of the header.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Section {
    States,
    Transitions,
    Events,
    Index,
    Lists,
    Items,
    Histories,
    Cases,
    Vars,
    Timers,
    Edges,
    Outputs,
    Blocks,
    Code,
}

impl Section {
    /// All sections, in the order of the header.
    pub(super) const ALL: [Section; 14] = [
        Section::States,
        Section::Transitions,
        Section::Events,
        Section::Index,
        Section::Lists,
        Section::Items,
        Section::Histories,
        Section::Cases,
        Section::Vars,
        Section::Timers,
        Section::Edges,
        Section::Outputs,
        Section::Blocks,
        Section::Code,
    ];

    /// The bytes of a row.
    pub(super) fn row(self) -> usize {
        match self {
            Section::States | Section::Transitions | Section::Vars => 12,
            Section::Histories => 10,
            Section::Events | Section::Timers => 6,
            Section::Lists | Section::Cases | Section::Blocks => 4,
            Section::Index | Section::Items | Section::Edges | Section::Outputs => 2,
            Section::Code => 1,
        }
    }
}

/// The names of the sections in the comments of `NAME_tables.c`.
const TITLES: [&str; 14] = [
    "states: ancestor, last descendant, entry, exit, initial content, timer",
    "transitions: from, clears first to last, to, guard, action",
    "events: input, first and number of its transitions",
    "transitions by event",
    "lists: first, number",
    "items of lists: a state; from 0x4000 on, the initial content of a state; from 0x8000 on, a history",
    "histories: owner, first case, number of cases, default list, block of its content",
    "cases: state, entered states",
    "variables: first value, number of values, minimum, maximum",
    "timers: state, value at which it stops",
    "edges: operand",
    "outputs: value",
    "blocks: first byte, number of bytes",
    "code",
];

/// One row of a section.
#[derive(Debug, Clone, Default)]
struct Row {
    bytes: Vec<u8>,
    note: String,
    object: Option<Object>,
}

/// An image under construction.
#[derive(Debug, Clone, Default)]
pub(super) struct Image {
    sections: [Vec<Row>; 14],
    blocks: BTreeMap<Vec<u8>, u16>,
    lists: BTreeMap<Vec<u16>, u16>,
    n_code: usize,
    n_items: usize,
}

/// The contents of the header except the sections.
#[derive(Debug, Clone, Copy)]
pub(super) struct Head {
    pub(super) kind: ImageKind,
    pub(super) interface: u32,
    pub(super) limit: u16,
    pub(super) chosen: u16,
    pub(super) initial: u16,
    pub(super) inputs: u16,
    /// The block that runs at reset.
    pub(super) reset: u16,
}

/// Bytes with a description.
pub(super) struct Line {
    pub(super) bytes: Vec<u8>,
    pub(super) title: Option<&'static str>,
    pub(super) note: String,
    pub(super) object: Option<Object>,
}

/// The row of a cell: its first value, how many it has, and its range; `None` if that needs more than 32 bits.
pub(super) fn cell(first: usize, many: usize, ty: Type) -> Option<Vec<u8>> {
    let mut bytes = [narrow(first).to_le_bytes(), narrow(many).to_le_bytes()].concat();
    let (lo, hi) = ty.bounds();
    for bound in [lo, hi] {
        bytes.extend(i32::try_from(bound).ok()?.to_le_bytes());
    }
    Some(bytes)
}

/// A number that fits into a column. A larger one occurs only in an image of more than 65535 bytes, which is rejected as a whole.
pub(super) fn narrow(value: usize) -> u16 {
    u16::try_from(value).unwrap_or(NONE)
}

impl Image {
    /// An image whose list 0 and block 0 are empty.
    pub(super) fn new() -> Self {
        let mut image = Image::default();
        image.list(&[]);
        image.block(&[]);
        image
    }

    /// Appends a row of numbers.
    pub(super) fn row(
        &mut self,
        section: Section,
        cells: &[u16],
        note: impl Into<String>,
        object: Option<Object>,
    ) {
        let bytes = cells.iter().flat_map(|cell| cell.to_le_bytes()).collect();
        self.sections[section as usize].push(Row { bytes, note: note.into(), object });
    }

    /// Appends a row unchanged.
    pub(super) fn raw(
        &mut self,
        section: Section,
        bytes: Vec<u8>,
        note: impl Into<String>,
        object: Option<Object>,
    ) {
        self.sections[section as usize].push(Row { bytes, note: note.into(), object });
    }

    /// The number of rows of a section so far.
    pub(super) fn count(&self, section: Section) -> usize {
        if section == Section::Code { self.n_code } else { self.sections[section as usize].len() }
    }

    /// The number of a block of code; equal blocks share a number.
    pub(super) fn block(&mut self, code: &[u8]) -> u16 {
        if let Some(known) = self.blocks.get(code) {
            return *known;
        }
        let number = narrow(self.count(Section::Blocks));
        self.row(Section::Blocks, &[narrow(self.n_code), narrow(code.len())], "", None);
        if !code.is_empty() {
            self.raw(Section::Code, code.to_vec(), format!("block {number}"), None);
        }
        self.n_code += code.len();
        self.blocks.insert(code.to_vec(), number);
        number
    }

    /// The number of a list; equal lists share a number.
    pub(super) fn list(&mut self, items: &[u16]) -> u16 {
        if let Some(known) = self.lists.get(items) {
            return *known;
        }
        let number = narrow(self.count(Section::Lists));
        self.row(Section::Lists, &[narrow(self.n_items), narrow(items.len())], "", None);
        for item in items {
            self.row(Section::Items, &[*item], "", None);
        }
        self.n_items += items.len();
        self.lists.insert(items.to_vec(), number);
        number
    }

    /// The complete image as lines of bytes, header first, and its length. The length may exceed the maximum size of an image; the caller
    /// checks it.
    pub(super) fn finish(self, head: Head) -> (Vec<Line>, usize) {
        let mut places = Vec::new();
        let mut at = HEADER;
        for (section, rows) in self.sections.iter().enumerate() {
            let n_rows = if section == Section::Code as usize { self.n_code } else { rows.len() };
            places.extend([narrow(at), narrow(n_rows)]);
            at += rows.iter().map(|row| row.bytes.len()).sum::<usize>();
        }
        let length = at;
        let mut header = b"GSTB".to_vec();
        header.extend([VERSION, head.kind as u8]);
        header.extend(narrow(length).to_le_bytes());
        header.extend([0; 4]);
        header.extend(head.interface.to_le_bytes());
        for value in [head.limit, head.chosen, head.initial, head.inputs] {
            header.extend(value.to_le_bytes());
        }
        header.extend(places.iter().flat_map(|place| place.to_le_bytes()));
        header.extend(head.reset.to_le_bytes());
        header.resize(HEADER, 0);
        let mut lines = vec![Line {
            bytes: header,
            title: Some(
                "header: magic, version, kind, length, checksum, interface, limits, sections, reset",
            ),
            note: String::new(),
            object: None,
        }];
        for (rows, title) in self.sections.into_iter().zip(TITLES) {
            let mut title = Some(title);
            for Row { bytes, note, object } in rows {
                lines.push(Line { bytes, title: title.take(), note, object });
            }
        }
        seal(&mut lines);
        (lines, length)
    }
}

/// Inserts the checksum; its bytes must still be 0.
pub(super) fn seal(lines: &mut [Line]) {
    let all: Vec<u8> = lines.iter().flat_map(|line| line.bytes.iter().copied()).collect();
    let crc = crc32_of_image(&all);
    if let Some(first) = lines.first_mut() {
        first.bytes[CHECKSUM].copy_from_slice(&crc.to_le_bytes());
    }
}

/// The checksum of an image: its own bytes count as 0.
pub(super) fn crc32_of_image(image: &[u8]) -> u32 {
    let mut image = image.to_vec();
    if let Some(own) = image.get_mut(CHECKSUM) {
        own.fill(0);
    }
    crc32(&image)
}

/// The CRC-32 of IEEE 802.3 (reflected, polynomial 0xEDB88320), as used in zip files.
pub(crate) fn crc32(bytes: &[u8]) -> u32 {
    let mut crc = u32::MAX;
    for byte in bytes {
        crc ^= u32::from(*byte);
        for _ in 0..8 {
            crc = if crc & 1 == 1 { (crc >> 1) ^ 0xedb8_8320 } else { crc >> 1 };
        }
    }
    !crc
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_checksum_is_the_usual_one() {
        assert_eq!(crc32(b"123456789"), 0xcbf4_3926);
    }

    #[test]
    fn sections_are_in_order() {
        assert!(Section::ALL.iter().enumerate().all(|(at, section)| *section as usize == at));
    }

    #[test]
    fn equal_blocks_and_lists_are_one() {
        let mut image = Image::new();
        assert_eq!((image.block(&[]), image.list(&[])), (0, 0));
        let block = image.block(&[0, 1]);
        assert_eq!((block, image.block(&[0, 1]), image.block(&[0, 2])), (1, 1, 2));
        assert_eq!((image.list(&[7]), image.list(&[7])), (1, 1));
    }
}
