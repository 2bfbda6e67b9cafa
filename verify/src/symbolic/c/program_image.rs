//! The image of a reaction program: its numbers and its code, as docs/c.md describes them, from bytes to a tree.
//!
//! Everything that can be wrong about an image is found here, so that its execution only follows the tree: parts that are not nested, a wrong depth of the stack,
//! operands that select nothing. The checksum is not read: `NAME_init` does not read it either.

use grafsynth_ir::expr::{ArithOp, CompareOp};

/// The number of values on the stack of the machine, and the maximum nesting of parts and of loops.
const STACK: usize = 16;
const NEST: usize = 31;
const LOOPS: usize = 3;
/// The instructions that contain code, and those at the end of such parts and of rounds.
const UNLESS: u8 = 21;
const ELSE: u8 = 22;
const ANDTHEN: u8 = 46;
const ORELSE: u8 = 47;
const LOOP: u8 = 48;
const WHILE: u8 = 49;
const AGAIN: u8 = 50;
/// The size of the header, and of the row of a cell.
pub(super) const HEADER: usize = 32;
const ROW: usize = 12;

/// An image.
#[derive(Clone)]
pub(super) struct Image {
    pub(super) n_bits: usize,
    pub(super) n_values: usize,
    pub(super) n_flags: usize,
    pub(super) n_numbers: usize,
    pub(super) cells: Vec<CellRow>,
    /// The places of the first byte of the reset, of the first byte of the reaction, and of the end.
    pub(super) places: [usize; 3],
    pub(super) reset: Code,
    pub(super) reaction: Code,
}

/// Consecutive values with a range.
#[derive(Clone)]
pub(super) struct CellRow {
    pub(super) first: usize,
    pub(super) n: usize,
    pub(super) lo: i64,
    pub(super) hi: i64,
}

pub(super) type Code = Vec<Instruction>;

/// An instruction with the code that it contains.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Instruction {
    /// Pushes a constant.
    Constant(i64),
    /// Pushes a scalar.
    Push(Source, usize),
    /// Replaces the top by its negation: as a condition, or as a number.
    Not,
    Neg,
    /// Replaces the index on top by the element of a cell.
    Element(usize),
    /// Replaces the two values on top by one.
    Two(Two),
    /// Pops a value and stores it.
    Store(Target, usize),
    /// Returns to the caller with a request: its number, its operand, and the number of arguments, which it pops.
    Request(u8, usize, usize),
    /// Pops a value and executes one of two parts.
    If(Code, Code),
    /// If the truth of the top is this one, keeps it; else drops it and executes a part.
    Keep(bool, Code),
    /// Repeats its parts at most as many times; between two of them, leaves the loop unless the value that it pops is true.
    Loop(u32, Vec<Code>),
}

/// A scalar that can be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Source {
    Input,
    Bit,
    Value,
    Flag,
    Number,
    Ticks,
}

/// A scalar that can be written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Target {
    Bit,
    /// The first value of a cell.
    Cell,
    /// The value of a cell whose index is below the top.
    Element,
    Flag,
    Number,
    Output,
    Fault,
}

/// An operator with two operands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Two {
    And,
    Or,
    Compare(CompareOp),
    Arith(ArithOp),
}

/// Why bytes are not an image.
pub(super) type Damage = String;

/// The sizes of what the caller of the machine passes in.
#[derive(Clone, Copy)]
pub(super) struct Sizes {
    pub(super) inputs: usize,
    pub(super) outputs: usize,
    pub(super) bytes_of_bits: usize,
    pub(super) values: usize,
    pub(super) bytes_of_flags: usize,
    pub(super) numbers: usize,
}

impl Image {
    /// Reads an image for a caller with these sizes.
    pub(super) fn read(bytes: &[u8], sizes: &Sizes) -> Result<Image, Damage> {
        let reader = Reader { bytes };
        if bytes.get(..4) != Some(b"GSTB") || bytes.get(4..6) != Some(&[2, 4]) {
            return Err("the tables are not a program of this version".to_owned());
        }
        let [n_bits, n_values, n_flags, n_numbers, n_cells, reset, reaction] =
            [16, 18, 20, 22, 24, 26, 28].map(|at| reader.number(at).unwrap_or(0));
        let first = HEADER + ROW * n_cells;
        let places = [first, first + reset, first + reset + reaction];
        if reader.number(6)? != places[2] || places[2] > bytes.len() {
            return Err("the length of the image is not that of its parts".to_owned());
        }
        let fits = n_bits.div_ceil(8) <= sizes.bytes_of_bits
            && n_values <= sizes.values
            && n_flags.div_ceil(8) <= sizes.bytes_of_flags
            && n_numbers <= sizes.numbers;
        if !fits {
            return Err("the image needs more memory than there is".to_owned());
        }
        let cells = (0..n_cells).map(|cell| reader.cell(HEADER + ROW * cell, n_values));
        let cells = cells.collect::<Result<Vec<_>, _>>()?;
        let mut image = Image {
            n_bits,
            n_values,
            n_flags,
            n_numbers,
            cells,
            places,
            reset: Code::new(),
            reaction: Code::new(),
        };
        let code = |image: &Image, from: usize, to: usize| {
            let mut parser = Parser { reader, image, sizes, depth: 0, nest: 0, loops: 0 };
            let code = parser.part(from, to, Around::Other)?.code();
            parser.must_be_empty().map(|()| code)
        };
        image.reset = code(&image, places[0], places[1])?;
        image.reaction = code(&image, places[1], places[2])?;
        Ok(image)
    }
}

/// Reads little-endian numbers.
#[derive(Clone, Copy)]
struct Reader<'b> {
    bytes: &'b [u8],
}

impl Reader<'_> {
    fn array<const N: usize>(self, at: usize) -> Result<[u8; N], Damage> {
        let bytes = self.bytes.get(at..at + N).and_then(|bytes| bytes.try_into().ok());
        bytes.ok_or_else(|| "the image ends within a number".to_owned())
    }

    fn number(self, at: usize) -> Result<usize, Damage> {
        Ok(usize::from(u16::from_le_bytes(self.array(at)?)))
    }

    fn long(self, at: usize) -> Result<i64, Damage> {
        Ok(i64::from(i32::from_le_bytes(self.array(at)?)))
    }

    fn cell(self, at: usize, n_values: usize) -> Result<CellRow, Damage> {
        let (first, n) = (self.number(at)?, self.number(at + 2)?);
        let (lo, hi) = (self.long(at + 4)?, self.long(at + 8)?);
        if n == 0 || first + n > n_values || lo > hi {
            return Err("a cell of the image has no values or no range".to_owned());
        }
        Ok(CellRow { first, n, lo, hi })
    }
}

/// What contains a part of the code.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Around {
    /// A part that may end with ELSE.
    Unless,
    /// A loop, which must end with AGAIN.
    Loop,
    /// Another part, or nothing.
    Other,
}

/// A part of the code.
struct Part {
    /// In a loop, the code between the instructions that leave it; elsewhere a single list.
    pieces: Vec<Code>,
    /// The number of bytes after the part that ELSE skips, if the part ends with ELSE.
    otherwise: Option<usize>,
    is_again: bool,
}

impl Part {
    fn push(&mut self, instruction: Instruction) {
        if let Some(last) = self.pieces.last_mut() {
            last.push(instruction);
        }
    }

    /// The code of a part that is no loop.
    fn code(self) -> Code {
        self.pieces.into_iter().flatten().collect()
    }
}

struct Parser<'b> {
    reader: Reader<'b>,
    image: &'b Image,
    sizes: &'b Sizes,
    /// The number of values on the stack.
    depth: usize,
    /// The number of parts, and of loops, around the current place.
    nest: usize,
    loops: usize,
}

impl Parser<'_> {
    /// The instructions from one place to another, where the part ends.
    fn part(&mut self, from: usize, to: usize, around: Around) -> Result<Part, Damage> {
        let mut part = Part { pieces: vec![Code::new()], otherwise: None, is_again: false };
        let mut at = from;
        while at < to {
            if part.otherwise.is_some() || part.is_again {
                return Err("code behind the end of its part".to_owned());
            }
            let [op] = self.reader.array::<1>(at)?;
            let operand = at + 1;
            at = operand + size(op).ok_or_else(|| format!("{op} is not an instruction"))?;
            if at > to {
                return Err("an instruction is longer than its part".to_owned());
            }
            match op {
                ELSE if around == Around::Unless => {
                    part.otherwise = Some(self.reader.number(operand)?);
                }
                WHILE if around == Around::Loop => {
                    self.pop(1)?;
                    self.must_be_empty()?;
                    part.pieces.push(Code::new());
                }
                AGAIN if around == Around::Loop => {
                    self.must_be_empty()?;
                    part.is_again = true;
                }
                ELSE | WHILE | AGAIN => return Err("an instruction outside of its part".to_owned()),
                UNLESS | ANDTHEN | ORELSE | LOOP => {
                    self.nest += 1;
                    if self.nest > NEST {
                        return Err("parts are nested too deeply".to_owned());
                    }
                    let (instruction, end) = self.containing(op, operand, at, to)?;
                    self.nest -= 1;
                    at = end;
                    part.push(instruction);
                }
                _ => {
                    let instruction = self.simple(op, operand)?;
                    part.push(instruction);
                }
            }
        }
        Ok(part)
    }

    /// An instruction with the code that it contains, which begins at `at`, and the place after that.
    fn containing(
        &mut self,
        op: u8,
        operand: usize,
        at: usize,
        to: usize,
    ) -> Result<(Instruction, usize), Damage> {
        let length = self.reader.number(if op == LOOP { operand + 4 } else { operand })?;
        let end = within(at + length, to)?;
        if op == LOOP {
            let rounds = u32::from_le_bytes(self.reader.array(operand)?);
            self.must_be_empty()?;
            self.loops += 1;
            let body = self.part(at, end, Around::Loop)?;
            if self.loops > LOOPS || !body.is_again {
                return Err("a loop has no end, or is nested too deeply".to_owned());
            }
            self.loops -= 1;
            return Ok((Instruction::Loop(rounds, body.pieces), end));
        }
        self.pop(1)?;
        let before = self.depth;
        if op != UNLESS {
            let rest = self.part(at, end, Around::Other)?.code();
            self.must_be(before + 1)?;
            return Ok((Instruction::Keep(op == ORELSE, rest), end));
        }
        let then = self.part(at, end, Around::Unless)?;
        let Some(length) = then.otherwise else {
            self.must_be(before)?;
            return Ok((Instruction::If(then.code(), Code::new()), end));
        };
        let after = std::mem::replace(&mut self.depth, before);
        let last = within(end + length, to)?;
        let otherwise = self.part(end, last, Around::Other)?.code();
        self.must_be(after)?;
        Ok((Instruction::If(then.code(), otherwise), last))
    }

    /// An instruction that contains no code.
    fn simple(&mut self, op: u8, operand: usize) -> Result<Instruction, Damage> {
        use Instruction::{Constant, Element, Neg, Not, Push, Request, Store};
        let (image, sizes) = (self.image, self.sizes);
        let read = |this: &mut Self, source, n| {
            this.push()?;
            Ok(Push(source, this.select(operand, n)?))
        };
        let write = |this: &mut Self, target, n| {
            this.pop(if target == Target::Element { 2 } else { 1 })?;
            Ok(Store(target, this.select(operand, n)?))
        };
        let constant = |this: &mut Self, value| {
            this.push()?;
            Ok(Constant(value))
        };
        match op {
            0 => {
                let value = i8::from_le_bytes(self.reader.array(operand)?);
                constant(self, value.into())
            }
            1 => {
                let value = self.reader.long(operand)?;
                constant(self, value)
            }
            23 => {
                let value = i64::from_le_bytes(self.reader.array(operand)?);
                constant(self, value)
            }
            2 => read(self, Source::Input, sizes.inputs),
            3 => read(self, Source::Bit, image.n_bits),
            4 => read(self, Source::Value, image.n_values),
            24 => {
                self.push()?;
                Ok(Push(Source::Ticks, 0))
            }
            25 => read(self, Source::Flag, image.n_flags),
            26 => read(self, Source::Number, image.n_numbers),
            7 | 8 | 27 => {
                self.pop(1)?;
                self.push()?;
                Ok(match op {
                    7 => Not,
                    8 => Neg,
                    _ => Element(self.select(operand, image.cells.len())?),
                })
            }
            20 => write(self, Target::Cell, image.cells.len()),
            35 => write(self, Target::Bit, image.n_bits),
            36 => write(self, Target::Flag, image.n_flags),
            37 => write(self, Target::Number, image.n_numbers),
            38 => write(self, Target::Element, image.cells.len()),
            39 => write(self, Target::Output, sizes.outputs),
            40 => {
                self.pop(1)?;
                Ok(Store(Target::Fault, 0))
            }
            41..=45 => {
                let n = if op == 42 { self.reader.array::<1>(operand + 2)?[0] } else { 0 };
                self.pop(n.into())?;
                self.must_be_empty()?;
                let number = if op == 45 { 0 } else { self.reader.number(operand)? };
                Ok(Request(op - 40, number, n.into()))
            }
            _ => {
                let two = two(op).ok_or_else(|| format!("{op} is not an instruction"))?;
                self.pop(2)?;
                self.push()?;
                Ok(Instruction::Two(two))
            }
        }
    }

    /// The operand that selects one of `n` objects.
    fn select(&self, operand: usize, n: usize) -> Result<usize, Damage> {
        let number = self.reader.number(operand)?;
        if number < n { Ok(number) } else { Err("an operand selects nothing".to_owned()) }
    }

    fn push(&mut self) -> Result<(), Damage> {
        self.depth += 1;
        if self.depth > STACK {
            Err("the stack of the code is too deep".to_owned())
        } else {
            Ok(())
        }
    }

    fn pop(&mut self, n: usize) -> Result<(), Damage> {
        let left = self.depth.checked_sub(n);
        self.depth = left.ok_or_else(|| "the code pops from an empty stack".to_owned())?;
        Ok(())
    }

    fn must_be(&self, depth: usize) -> Result<(), Damage> {
        match self.depth == depth {
            true => Ok(()),
            false => Err("the depth of the stack depends on the path".to_owned()),
        }
    }

    fn must_be_empty(&self) -> Result<(), Damage> {
        self.must_be(0)
    }
}

/// A place that must be at most another.
fn within(at: usize, end: usize) -> Result<usize, Damage> {
    if at <= end { Ok(at) } else { Err("a part is longer than the part around it".to_owned()) }
}

/// The number of bytes of the operand of an instruction; `None` for codes of other machines.
fn size(op: u8) -> Option<usize> {
    Some(match op {
        0 => 1,
        1 => 4,
        23 => 8,
        2..=4 | 20..=22 | 25..=27 | 35..=39 | 41 | 43 | 44 | ANDTHEN | ORELSE => 2,
        42 => 3,
        LOOP => 6,
        7..=19 | 24 | 28..=34 | 40 | 45 | WHILE | AGAIN => 0,
        _ => return None,
    })
}

/// The operator of an instruction with two operands.
fn two(op: u8) -> Option<Two> {
    Some(match op {
        9 => Two::And,
        10 => Two::Or,
        11 => Two::Compare(CompareOp::Eq),
        12 => Two::Compare(CompareOp::Ne),
        13 => Two::Compare(CompareOp::Lt),
        14 => Two::Compare(CompareOp::Le),
        15 => Two::Compare(CompareOp::Gt),
        16 => Two::Compare(CompareOp::Ge),
        17 => Two::Arith(ArithOp::Add),
        18 => Two::Arith(ArithOp::Sub),
        19 => Two::Arith(ArithOp::Mul),
        28 => Two::Arith(ArithOp::Div),
        29 => Two::Arith(ArithOp::Mod),
        30 => Two::Arith(ArithOp::BitAnd),
        31 => Two::Arith(ArithOp::BitOr),
        32 => Two::Arith(ArithOp::BitXor),
        33 => Two::Arith(ArithOp::Shl),
        34 => Two::Arith(ArithOp::Shr),
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZES: Sizes =
        Sizes { inputs: 2, outputs: 1, bytes_of_bits: 1, values: 2, bytes_of_flags: 1, numbers: 1 };

    /// An image with a cell of two values, without a reset.
    fn image(code: &[u8]) -> Vec<u8> {
        let mut bytes = b"GSTB\x02\x04".to_vec();
        bytes.extend(u16::try_from(HEADER + ROW + code.len()).expect("it is short").to_le_bytes());
        bytes.extend([0; 8]);
        for number in [3_u16, 2, 8, 1, 1, 0, u16::try_from(code.len()).expect("it is short"), 0] {
            bytes.extend(number.to_le_bytes());
        }
        bytes.extend([0, 0, 2, 0, 0xFE, 0xFF, 0xFF, 0xFF, 9, 0, 0, 0]);
        bytes.extend(code);
        bytes
    }

    fn reaction(code: &[u8]) -> Result<Code, Damage> {
        Image::read(&image(code), &SIZES).map(|image| image.reaction)
    }

    #[test]
    fn code_becomes_a_tree() {
        use Instruction::{Constant, If, Keep, Loop, Push, Store};
        // A choice between two values is stored.
        let code = reaction(&[3, 2, 0, UNLESS, 5, 0, 0, 0xFF, ELSE, 2, 0, 0, 7, 20, 0, 0]);
        let choice = If(vec![Constant(-1)], vec![Constant(7)]);
        let wanted = vec![Push(Source::Bit, 2), choice, Store(Target::Cell, 0)];
        assert_eq!(code, Ok(wanted));
        let code = reaction(&[2, 1, 0, ORELSE, 3, 0, 2, 0, 0, 35, 0, 0]);
        let rest = Keep(true, vec![Push(Source::Input, 0)]);
        assert_eq!(code, Ok(vec![Push(Source::Input, 1), rest, Store(Target::Bit, 0)]));
        let code = reaction(&[LOOP, 5, 0, 0, 0, 5, 0, 25, 7, 0, WHILE, AGAIN]);
        assert_eq!(code, Ok(vec![Loop(5, vec![vec![Push(Source::Flag, 7)], vec![]])]));
        let cells = Image::read(&image(&[]), &SIZES).expect("it is an image").cells;
        assert_eq!((cells[0].first, cells[0].n, cells[0].lo, cells[0].hi), (0, 2, -2, 9));
    }

    #[test]
    fn damaged_code_is_refused() {
        for (code, why) in [
            (&[5, 0, 0][..], "5 is not an instruction"),
            (&[51], "51 is not an instruction"),
            (&[0], "longer than its part"),
            (&[0, 1], "the depth of the stack"),
            (&[35, 0, 0], "pops from an empty stack"),
            (&[3, 3, 0, 35, 0, 0], "selects nothing"),
            (&[0, 1, UNLESS, 9, 0], "a part is longer"),
            (&[0, 1, UNLESS, 2, 0, 0, 1], "the depth of the stack"),
            (&[ELSE, 0, 0], "outside of its part"),
            (&[LOOP, 1, 0, 0, 0, 0, 0], "a loop has no end"),
            (&[LOOP, 1, 0, 0, 0, 3, 0, AGAIN, 0, 1], "behind the end"),
            (&[0, 1, UNLESS, 1, 0, AGAIN], "outside of its part"),
        ] {
            let found = reaction(code).expect_err("it is damaged");
            assert!(found.contains(why), "{code:?}: {found}");
        }
        let deep = [[0, 1, UNLESS, 0, 0]; 1].concat();
        assert!(reaction(&deep).is_ok());
        let mut nested = Vec::new();
        for _ in 0..=NEST {
            let length = u16::try_from(nested.len()).expect("it is short").to_le_bytes();
            nested = [&[0, 1, UNLESS], &length[..], &nested].concat();
        }
        assert!(reaction(&nested).expect_err("it is too deep").contains("nested too deeply"));
        assert!(reaction(&[0, 1].repeat(STACK + 1)).expect_err("too many").contains("too deep"));
    }

    /// Each byte of an image, changed to each value, is read or refused.
    #[test]
    fn no_byte_makes_the_reader_fail() {
        let good = image(&[3, 2, 0, UNLESS, 5, 0, 0, 0xFF, ELSE, 2, 0, 0, 7, 20, 0, 0]);
        let mut n_refused = 0;
        for at in 0..good.len() {
            for value in 0..=u8::MAX {
                let mut bytes = good.clone();
                bytes[at] = value;
                n_refused += usize::from(Image::read(&bytes, &SIZES).is_err());
            }
            n_refused += usize::from(Image::read(&good[..at], &SIZES).is_err());
        }
        assert!(n_refused > good.len() * 100, "{n_refused}");
    }
}
