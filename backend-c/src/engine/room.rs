//! Checks whole images as the C engines do: an image that they reject is rejected here for the same reason, with the location and a description.

use super::check::{Bounds, Damage, Flaw, check_code};
use super::image::{
    CONTENT, HEADER, HISTORY, MOST_STATES, NONE, PROGRAM_HEADER, PROGRAM_KIND, Section, VERSION,
    crc32_of_image,
};
use super::ops::{Kind, Machine};

/// The engine and the instance that an image is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Room {
    /// True for the program engine, false for the table engine.
    pub is_program: bool,
    /// Identifies inputs and outputs: names, types, order.
    pub interface: u32,
    /// The number of inputs and of answers of extern conditions.
    pub inputs: u32,
    /// The number of outputs.
    pub outputs: u32,
    /// The number of bytes for the bits of the instance.
    pub bits: u32,
    /// The number of numbers of the instance.
    pub values: u32,
    /// Tables: the number of bytes that are used only during a reaction.
    pub work: u32,
    /// Programs: the number of bytes for the bits that exist only during a reaction.
    pub flags: u32,
    /// Programs: the number of numbers that exist only during a reaction.
    pub numbers: u32,
    /// Programs: the extern actions.
    pub calls: u32,
    /// Programs: the texts.
    pub texts: u32,
    /// Programs: the transitions that a trace ring records.
    pub fired: u32,
    /// Programs: the maximum for a loop, multiplied by the rounds of the loops around it.
    pub rounds: u32,
}

/// Checks an image as the engine does: an accepted one cannot make the engine read or write outside the image and the instance, or run forever.
///
/// # Errors
/// The first flaw.
pub fn check_image(image: &[u8], room: &Room) -> Result<(), Flaw> {
    let reader = Reader(image);
    let header = if room.is_program { PROGRAM_HEADER } else { HEADER };
    let fail = |damage, at, reason| Err(Flaw { damage, at, reason });
    if image.len() < header {
        return fail(Damage::Short, image.len(), "the header is not complete");
    }
    if image.get(..4) != Some(b"GSTB") {
        return fail(Damage::Magic, 0, "the first bytes are not `GSTB`");
    }
    if reader.byte(4) != VERSION {
        return fail(Damage::Version, 4, "made for another version of the engine");
    }
    let kind = reader.byte(5);
    if room.is_program && kind != PROGRAM_KIND {
        return fail(Damage::Version, 5, "made for the table engine");
    }
    let length = reader.u16(6) as usize;
    if length > image.len() || length < header {
        return fail(
            Damage::Short,
            6,
            "the length in the header is shorter than the header or longer than the image",
        );
    }
    if crc32_of_image(&image[..length]) != reader.u32(8) {
        return fail(Damage::Checksum, 8, "the checksum is wrong");
    }
    if reader.u32(12) != room.interface {
        return fail(Damage::Interface, 12, "made for other inputs or outputs");
    }
    let reader = Reader(&image[..length]);
    if room.is_program { reader.program(room) } else { reader.tables(room, kind) }
}

/// Reads little-endian numbers. Bytes outside of the image are 0; the checks read none.
#[derive(Clone, Copy)]
struct Reader<'a>(&'a [u8]);

/// The result of a check at a place.
fn good(is_good: bool, at: usize, reason: &'static str) -> Result<(), Flaw> {
    if is_good { Ok(()) } else { Err(Flaw { damage: Damage::Range, at, reason }) }
}

fn fits(is_good: bool, at: usize, reason: &'static str) -> Result<(), Flaw> {
    if is_good { Ok(()) } else { Err(Flaw { damage: Damage::Room, at, reason }) }
}

impl Reader<'_> {
    fn byte(self, at: usize) -> u8 {
        self.0.get(at).copied().unwrap_or(0)
    }

    fn u16(self, at: usize) -> u32 {
        u32::from(self.byte(at)) | u32::from(self.byte(at + 1)) << 8
    }

    fn u32(self, at: usize) -> u32 {
        self.u16(at) | self.u16(at + 2) << 16
    }

    fn i32(self, at: usize) -> i32 {
        self.u32(at).cast_signed()
    }

    // --- programs --------------------------------------------------------------------------------------------------------------------------

    fn program(self, room: &Room) -> Result<(), Flaw> {
        let [bits, values, flags, numbers] = [16, 18, 20, 22].map(|at| self.u16(at));
        let [cells, reset, reaction] = [24, 26, 28].map(|at| self.u16(at) as usize);
        let first = PROGRAM_HEADER + CELL * cells;
        let middle = first + reset;
        good(
            middle + reaction == self.0.len(),
            24,
            "the lengths of the parts do not add up to the length of the image",
        )?;
        (0..cells).try_for_each(|cell| self.cell(PROGRAM_HEADER + CELL * cell, values))?;
        fits(bits.div_ceil(8) <= room.bits, 16, "too many bits")?;
        fits(values <= room.values, 18, "too many numbers")?;
        fits(flags.div_ceil(8) <= room.flags, 20, "too many flags")?;
        fits(numbers <= room.numbers, 22, "too many numbers in a reaction")?;
        let many = [
            (Kind::Input, room.inputs),
            (Kind::Bit, bits),
            (Kind::Value, values),
            (Kind::Cell, self.u16(24)),
            (Kind::Flag, flags),
            (Kind::Number, numbers),
            (Kind::Output, room.outputs),
            (Kind::Call, room.calls),
            (Kind::Text, room.texts),
            (Kind::Fired, room.fired),
        ];
        let bounds = Bounds::of(&many, room.rounds);
        check_code(Machine::Wide, self.0, first..middle, &bounds, 0)?;
        check_code(Machine::Wide, self.0, middle..self.0.len(), &bounds, 0)
    }

    /// The row of a cell: its numbers are among all.
    fn cell(self, row: usize, values: u32) -> Result<(), Flaw> {
        let (first, many) = (self.u16(row), self.u16(row + 2));
        good(many > 0 && first + many <= values, row, "a cell has no numbers, or too many")
    }

    // --- tables ----------------------------------------------------------------------------------------------------------------------------

    fn tables(self, room: &Room, kind: u8) -> Result<(), Flaw> {
        let interface = |is_good, at, reason| {
            if is_good { Ok(()) } else { Err(Flaw { damage: Damage::Interface, at, reason }) }
        };
        interface(self.u16(22) == room.inputs, 22, "made for another number of inputs")?;
        let outputs = self.count(Section::Outputs) as u32;
        interface(outputs == room.outputs, place(Section::Outputs), "another number of outputs")?;
        good(kind <= 3, 5, "unknown kind of chart")?;
        for section in Section::ALL {
            let (from, bytes) = (self.base(section), self.count(section) * section.row());
            let is_inside = from >= HEADER && from + bytes <= self.0.len();
            good(is_inside, place(section), "a section is not within the image")?;
        }
        let [states, cases, edges, vars, timers] =
            [Section::States, Section::Cases, Section::Edges, Section::Vars, Section::Timers]
                .map(|section| self.count(section) as u32);
        let bits = states + cases + 2 * edges;
        fits(bits.div_ceil(8) <= room.bits, place(Section::States), "too many bits")?;
        fits(vars + timers <= room.values, place(Section::Vars), "too many numbers")?;
        let marks = self.count(Section::Transitions) as u32
            + 3 * states
            + 3 * self.count(Section::Histories) as u32;
        let work = marks.div_ceil(8) + 2 * self.u16(18);
        fits(
            work <= room.work,
            place(Section::Transitions),
            "a reaction needs too many bytes of working memory",
        )?;
        let blocks = self.count(Section::Blocks);
        good(blocks > 0, place(Section::Blocks), "there is no block 0")?;
        let many = [
            (Kind::Input, room.inputs),
            (Kind::Bit, bits),
            (Kind::Pair, bits.saturating_sub(1)),
            (Kind::Value, vars + timers),
            (Kind::Cell, vars),
        ];
        let many = many.map(|(kind, many)| (kind, many.min(u32::from(NONE))));
        let tables = Tables { image: self, bounds: Bounds::of(&many, 1), is_chart: kind >= 2 };
        tables.states()?;
        tables.transitions()?;
        tables.events()?;
        tables.lists()?;
        tables.histories()?;
        tables.rest()
    }

    fn base(self, section: Section) -> usize {
        self.u16(place(section)) as usize
    }

    fn count(self, section: Section) -> usize {
        self.u16(place(section) + 2) as usize
    }
}

/// The bytes of the row of a cell.
const CELL: usize = 12;

/// Where the header has the offset of a section; its number of rows follows.
fn place(section: Section) -> usize {
    24 + 4 * section as usize
}

impl Bounds {
    /// Kinds that are not mentioned have no objects.
    fn of(kinds: &[(Kind, u32)], rounds: u32) -> Self {
        let mut bounds = Bounds { many: Default::default(), rounds };
        for (kind, many) in kinds {
            bounds.many[*kind as usize] = *many;
        }
        bounds
    }
}

/// The sections of an image of tables, which are within the image.
struct Tables<'a> {
    image: Reader<'a>,
    bounds: Bounds,
    is_chart: bool,
}

impl Tables<'_> {
    fn count(&self, section: Section) -> usize {
        self.image.count(section)
    }

    /// Where the rows of a section begin.
    fn rows(&self, section: Section) -> impl Iterator<Item = usize> + use<> {
        let (base, size) = (self.image.base(section), section.row());
        (0..self.count(section)).map(move |row| base + size * row)
    }

    /// The column of a row, two bytes for each.
    fn at(&self, row: usize, column: usize) -> usize {
        self.image.u16(row + 2 * column) as usize
    }

    fn below(&self, row: usize, column: usize, section: Section) -> Result<(), Flaw> {
        let is_good = self.at(row, column) < self.count(section);
        good(is_good, row + 2 * column, "the number of a row that does not exist")
    }

    /// Two columns are the first row and the number of rows of a section.
    fn within(&self, row: usize, column: usize, section: Section) -> Result<(), Flaw> {
        let (first, many) = (self.at(row, column), self.at(row, column + 1));
        let is_good = first + many <= self.count(section);
        good(is_good, row + 2 * column, "rows that do not exist")
    }

    /// A column is the block of code that leaves the wanted number of values.
    fn block(&self, row: usize, column: usize, wanted: usize) -> Result<(), Flaw> {
        self.below(row, column, Section::Blocks)?;
        let block = self.image.base(Section::Blocks) + 4 * self.at(row, column);
        self.within(block, 0, Section::Code)?;
        let first = self.image.base(Section::Code) + self.at(block, 0);
        let code = first..first + self.at(block, 1);
        check_code(Machine::Narrow, self.image.0, code, &self.bounds, wanted)
    }

    fn states(&self) -> Result<(), Flaw> {
        let states = self.count(Section::States);
        good(states <= MOST_STATES, place(Section::States), "too many states")?;
        for (state, row) in self.rows(Section::States).enumerate() {
            let (above, last) = (self.at(row, 0), self.at(row, 1));
            good(
                above < state || above == usize::from(NONE),
                row,
                "an ancestor does not precede its descendant",
            )?;
            good(last >= state && last < states, row + 2, "a last descendant does not exist")?;
            (2..5).try_for_each(|column| self.block(row, column, 0))?;
            if self.at(row, 5) != usize::from(NONE) {
                self.below(row, 5, Section::Timers)?;
            }
        }
        Ok(())
    }

    fn transitions(&self) -> Result<(), Flaw> {
        let from = if self.is_chart { Section::States } else { Section::Lists };
        for row in self.rows(Section::Transitions) {
            self.below(row, 0, from)?;
            self.below(row, 3, Section::Lists)?;
            if self.at(row, 1) <= self.at(row, 2) {
                self.below(row, 2, Section::States)?;
            }
            if self.at(row, 4) != 0 {
                self.block(row, 4, 1)?;
            }
            self.block(row, 5, 0)?;
        }
        Ok(())
    }

    fn events(&self) -> Result<(), Flaw> {
        let is_any = self.count(Section::Events) > 0;
        good(is_any, place(Section::Events), "there is no row for \"no event\"")?;
        for (event, row) in self.rows(Section::Events).enumerate() {
            let is_good = event == 0 || self.image.u16(row) < self.image.u16(22);
            good(is_good, row, "an input that does not exist")?;
            self.within(row, 1, Section::Index)?;
        }
        self.rows(Section::Index).try_for_each(|row| self.below(row, 0, Section::Transitions))
    }

    fn lists(&self) -> Result<(), Flaw> {
        self.below(20, 0, Section::Lists)?;
        self.rows(Section::Lists).try_for_each(|row| self.within(row, 0, Section::Items))?;
        for row in self.rows(Section::Items) {
            let item = self.at(row, 0) as u16;
            let section = match item & (CONTENT | HISTORY) {
                0 => Some(Section::States),
                CONTENT => self.is_chart.then_some(Section::States),
                HISTORY => self.is_chart.then_some(Section::Histories),
                _ => None,
            };
            let number = usize::from(item & !(CONTENT | HISTORY));
            let is_good = section.is_some_and(|section| number < self.count(section));
            good(is_good, row, "a list enters something that does not exist")?;
        }
        Ok(())
    }

    fn histories(&self) -> Result<(), Flaw> {
        let is_few = self.count(Section::Histories) <= MOST_STATES;
        good(is_few, place(Section::Histories), "too many histories")?;
        for row in self.rows(Section::Histories) {
            self.below(row, 0, Section::States)?;
            self.within(row, 1, Section::Cases)?;
            self.below(row, 3, Section::Lists)?;
            self.block(row, 4, 0)?;
        }
        for row in self.rows(Section::Cases) {
            self.below(row, 0, Section::States)?;
            self.below(row, 1, Section::Lists)?;
        }
        Ok(())
    }

    fn rest(&self) -> Result<(), Flaw> {
        self.block(80, 0, 0)?;
        for row in self.rows(Section::Vars) {
            self.image.cell(row, self.bounds.many[Kind::Value as usize])?;
            let is_range = self.image.i32(row + 4) <= self.image.i32(row + 8);
            good(is_range, row + 4, "the minimum is above the maximum")?;
        }
        for row in self.rows(Section::Timers) {
            self.below(row, 0, Section::States)?;
            good(self.image.i32(row + 2) >= 0, row + 2, "a time is negative")?;
        }
        self.rows(Section::Edges).try_for_each(|row| self.block(row, 0, 1))?;
        self.rows(Section::Outputs).try_for_each(|row| self.block(row, 0, 1))
    }
}
