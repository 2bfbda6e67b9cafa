//! The check of code, like that of the C machine, and the maximum number of instructions that one reaction runs.
//!
//! The code is its own proof: parts are contained in the instruction before them and nested, and loops state their rounds, so one pass checks that it
//! stays within its bytes and its stack, and finds the worst-case path. The time of an instruction does not depend on the code: the engine interprets it.

#![allow(clippy::wildcard_enum_match_arm, reason = "only few instructions contain code")]

use super::ops::{Class, Instruction, Kind, LOOPS, Machine, NEST, Op, STACK};
use std::fmt;
use std::ops::Range;

/// Why an image is refused: the results of `NAME_load`, in the order of their numbers from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Damage {
    /// Fewer bytes than the header or the length requires.
    Short = 1,
    /// Not an image.
    Magic = 2,
    /// An image for another engine, or for another version of it.
    Version = 3,
    /// The checksum is wrong.
    Checksum = 4,
    /// Made for other inputs or outputs.
    Interface = 5,
    /// Larger than the instance.
    Room = 6,
    /// Refers to something that it does not contain.
    Range = 7,
}

/// The first flaw of an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Flaw {
    /// The result of `NAME_load`.
    pub damage: Damage,
    /// The byte of the image where it is found.
    pub at: usize,
    /// A description.
    pub reason: &'static str,
}

impl fmt::Display for Flaw {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "byte {}: {}", self.at, self.reason)
    }
}

impl std::error::Error for Flaw {}

/// The number of objects of each kind that operands can refer to, and the maximum rounds of a loop together with those of the loops around it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Bounds {
    /// The number of objects of each [`Kind`].
    pub(super) many: [u32; Kind::Fired as usize + 1],
    /// The maximum rounds of a loop, multiplied by those of the loops around it.
    pub(super) rounds: u32,
}

impl Bounds {
    /// No bounds: to check only the stack and the nesting.
    pub(super) const ANY: Bounds =
        Bounds { many: [u32::MAX; Kind::Fired as usize + 1], rounds: u32::MAX };
}

/// The loop of the evolution, and its proved maximum number of rounds.
#[derive(Debug, Clone, Copy)]
pub(super) struct Evolution {
    /// The position of its instruction.
    pub(super) at: usize,
    /// The maximum number of rounds.
    pub(super) rounds: u64,
}

/// An instruction in the code.
#[derive(Debug, Clone, Copy)]
struct Decoded<'a> {
    row: &'static Instruction,
    /// Where it begins.
    at: usize,
    operand: &'a [u8],
}

impl Decoded<'_> {
    /// A number of the operand, from its byte `from` on.
    fn number(&self, from: usize, bytes: usize) -> u32 {
        let bytes = self.operand.iter().skip(from).take(bytes);
        bytes.rev().fold(0, |all, byte| all << 8 | u32::from(*byte))
    }

    /// The number of bytes that it contains.
    fn length(&self) -> usize {
        self.number(if self.row.op == Op::Loop { 4 } else { 0 }, 2) as usize
    }

    fn end(&self) -> usize {
        self.at + 1 + self.operand.len()
    }
}

/// The instruction at a place of the code, which ends at `end`.
fn decode(
    machine: Machine,
    image: &[u8],
    at: usize,
    end: usize,
) -> Result<Decoded<'_>, &'static str> {
    let code = image.get(..end).unwrap_or(image);
    let first = code.get(at).ok_or("the code ends within an instruction")?;
    let row = machine.instruction(*first).ok_or("the byte is not an instruction")?;
    let operand = code.get(at + 1..at + 1 + row.operand.size());
    Ok(Decoded { row, at, operand: operand.ok_or("the code ends within an operand")? })
}

/// A part of the code that an instruction contains.
struct Region {
    /// The instruction that contains it; `None` for the code itself.
    op: Option<Op>,
    end: usize,
    /// The stack depth at its end; for `UNLESS` that at its start.
    depth: usize,
    /// The maximum rounds, multiplied by those of all enclosing loops.
    rounds: u32,
}

/// Checks a part of an image as code that leaves the wanted number of values.
///
/// # Errors
/// The first reason why the machine must not run it.
pub(super) fn check_code(
    machine: Machine,
    image: &[u8],
    range: Range<usize>,
    bounds: &Bounds,
    wanted: usize,
) -> Result<(), Flaw> {
    let mut checker = Checker {
        bounds,
        open: vec![Region { op: None, end: range.end, depth: 0, rounds: 1 }],
        depth: 0,
        loops: 0,
        is_too_long: false,
    };
    let mut at = range.start;
    while at < range.end {
        let end = checker.open.last().map_or(range.end, |region| region.end);
        let range = |reason| Flaw { damage: Damage::Range, at, reason };
        let found = decode(machine, image, at, end).map_err(range)?;
        checker.instruction(&found)?;
        at = found.end();
    }
    if checker.open.len() == 1 && checker.depth == wanted {
        return Ok(());
    }
    let reason = "the code ends with another number of values than expected";
    Err(Flaw { damage: Damage::Range, at, reason })
}

struct Checker<'a> {
    bounds: &'a Bounds,
    open: Vec<Region>,
    depth: usize,
    loops: usize,
    /// True if the last instruction is a loop with too many rounds.
    is_too_long: bool,
}

impl Checker<'_> {
    fn instruction(&mut self, found: &Decoded<'_>) -> Result<(), Flaw> {
        let row = found.row;
        let fail = |reason| Flaw { damage: Damage::Range, at: found.at, reason };
        let good = |good: bool, reason| if good { Ok(()) } else { Err(fail(reason)) };
        good(row.takes <= self.depth, "the stack has too few values")?;
        self.depth = self.depth - row.takes + row.gives;
        good(self.depth <= STACK, "the stack has too many values")?;
        if let Some(kind) = row.operand.kind() {
            let many = self.bounds.many[kind as usize];
            good(found.number(0, 2) < many, "the operand refers to an object that does not exist")?;
        }
        if row.class == Class::Service {
            // A call pops all values; the others need an empty stack.
            let many = if row.op == Op::Call { found.number(2, 1) as usize } else { 0 };
            good(self.depth == many, "a request with another number of values")?;
            self.depth = 0;
        }
        if row.class == Class::Control {
            self.control(found)?;
        }
        self.close(found)?;
        if self.is_too_long {
            let reason = "more rounds than the instance allows";
            return Err(Flaw { damage: Damage::Room, at: found.at, reason });
        }
        Ok(())
    }

    /// Opens the part that an instruction contains.
    fn control(&mut self, found: &Decoded<'_>) -> Result<(), Flaw> {
        let fail = |reason| Flaw { damage: Damage::Range, at: found.at, reason };
        let good = |good: bool, reason| if good { Ok(()) } else { Err(fail(reason)) };
        let op = found.row.op;
        let after = found.end();
        let Some(inner) = self.open.last() else { return Ok(()) };
        let (inner_op, inner_end) = (inner.op, inner.end);
        let mut next = Region {
            op: Some(op),
            end: after + found.length(),
            depth: self.depth,
            rounds: inner.rounds,
        };
        match op {
            Op::Again => {
                return good(
                    inner_op == Some(Op::Loop) && after == inner_end,
                    "AGAIN is not the end of a loop",
                );
            }
            Op::While => {
                return good(
                    inner_op == Some(Op::Loop) && self.depth == 0,
                    "WHILE is not directly in a loop",
                );
            }
            Op::Else => {
                let is_end = inner_op == Some(Op::Unless) && after == inner_end;
                good(is_end, "ELSE is not the end of UNLESS")?;
                self.depth = inner.depth;
                self.open.pop();
            }
            Op::Loop => {
                let limit = found.number(0, 4);
                let is_first = self.depth == 0 && self.loops < LOOPS && found.length() > 0;
                good(is_first, "a loop that is empty, nested too deeply, or within an expression")?;
                self.is_too_long = limit > self.bounds.rounds / next.rounds;
                next.rounds = next.rounds.saturating_mul(limit.max(1));
                self.loops += 1;
            }
            // The deciding value stays on the stack if the rest is skipped.
            Op::AndThen | Op::OrElse => next.depth += 1,
            _ => {}
        }
        good(self.open.len() < NEST, "parts are nested too deeply")?;
        let end = self.open.last().map_or(0, |around| around.end);
        good(next.end <= end, "a part ends after the part that contains it")?;
        self.open.push(next);
        Ok(())
    }

    /// Closes the parts that end after an instruction.
    fn close(&mut self, found: &Decoded<'_>) -> Result<(), Flaw> {
        let mut is_again = found.row.op == Op::Again;
        while self.open.len() > 1 {
            let Some(region) = self.open.pop_if(|region| region.end == found.end()) else { break };
            let is_good = if region.op == Some(Op::Loop) {
                self.loops -= 1;
                std::mem::take(&mut is_again) && self.depth == 0
            } else {
                region.depth == self.depth
            };
            if !is_good {
                let reason = "a part ends with another number of values than if it is skipped";
                return Err(Flaw { damage: Damage::Range, at: found.at, reason });
            }
        }
        Ok(())
    }
}

/// The maximum number of instructions that one run of the code executes; `None` if it is not valid code.
pub(super) fn most_instructions(code: &[u8], evolution: Option<Evolution>) -> Option<u64> {
    part(code, 0..code.len(), evolution).map(|(n, _)| n)
}

/// A part, and the length that its last instruction skips if that is an `ELSE`. The nesting depth is below [`NEST`], as the check has found.
fn part(
    code: &[u8],
    range: Range<usize>,
    evolution: Option<Evolution>,
) -> Option<(u64, Option<usize>)> {
    let mut sum = 0_u64;
    let mut at = range.start;
    while at < range.end {
        let found = decode(Machine::Wide, code, at, range.end).ok()?;
        let next = found.end();
        sum = sum.saturating_add(1);
        at = next;
        let end = next + found.length();
        match found.row.op {
            Op::Else => return (next == range.end).then(|| (sum, Some(found.length()))),
            Op::Unless => {
                let (then, otherwise) = part(code, next..end, evolution)?;
                let (most, behind) = match otherwise {
                    Some(length) => {
                        let (other, _) = part(code, end..end + length, evolution)?;
                        (then.max(other), end + length)
                    }
                    None => (then, end),
                };
                sum = sum.saturating_add(most);
                at = behind;
            }
            Op::AndThen | Op::OrElse => {
                sum = sum.saturating_add(part(code, next..end, evolution)?.0);
                at = end;
            }
            Op::Loop => {
                let limit = u64::from(found.number(0, 4));
                let proved = evolution.filter(|it| it.at == found.at).map_or(limit, |it| it.rounds);
                let round = part(code, next..end, evolution)?.0;
                // A loop that ends because its condition is false evaluates the condition once more.
                let rounds = limit.min(proved.saturating_add(1));
                sum = sum.saturating_add(round.saturating_mul(rounds));
                at = end;
            }
            _ => {}
        }
    }
    (at == range.end).then_some((sum, None))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_dearer_way_counts_and_loops_go_their_rounds() {
        let (byte, unless, otherwise) = (Op::Byte as u8, Op::Unless as u8, Op::Else as u8);
        let not = Op::Not as u8;
        // BYTE 1; UNLESS { NOT; ELSE } { NOT; NOT; NOT }
        let code = [byte, 1, unless, 4, 0, not, otherwise, 3, 0, not, not, not];
        assert_eq!(most_instructions(&code, None), Some(2 + 3));
        // LOOP 5 times { NOT; AGAIN }
        let code = [Op::Loop as u8, 5, 0, 0, 0, 2, 0, not, Op::Again as u8];
        assert_eq!(most_instructions(&code, None), Some(1 + 5 * 2));
        let evolution = Evolution { at: 0, rounds: 2 };
        assert_eq!(most_instructions(&code, Some(evolution)), Some(1 + 3 * 2));
        assert_eq!(most_instructions(&code[..6], None), None);
    }

    #[test]
    fn code_that_the_machine_must_not_run_is_refused_with_its_place() {
        let bounds = Bounds { many: [2; Kind::Fired as usize + 1], rounds: 6 };
        let (byte, unless, otherwise) = (Op::Byte as u8, Op::Unless as u8, Op::Else as u8);
        let (not, and, input) = (Op::Not as u8, Op::And as u8, Op::Input as u8);
        let (repeat, again, call) = (Op::Loop as u8, Op::Again as u8, Op::Call as u8);
        let deep = [[byte, 1]; STACK + 1].concat();
        type Case<'a> = (&'a [u8], usize, Result<(), (Damage, usize)>);
        let cases: &[Case<'_>] = &[
            (&[byte, 1], 1, Ok(())),
            (&[byte, 1], 0, Err((Damage::Range, 2))),
            (&[byte], 1, Err((Damage::Range, 0))),
            (&[255], 0, Err((Damage::Range, 0))),
            (&[not], 0, Err((Damage::Range, 0))),
            (&[byte, 1, and], 1, Err((Damage::Range, 2))),
            (&[input, 1, 0], 1, Ok(())),
            (&[input, 2, 0], 1, Err((Damage::Range, 0))),
            (&deep, STACK + 1, Err((Damage::Range, 2 * STACK))),
            // Both ways leave a value, or only one does.
            (&[byte, 1, unless, 5, 0, byte, 2, otherwise, 2, 0, byte, 3], 1, Ok(())),
            (&[byte, 1, unless, 2, 0, byte, 2], 1, Err((Damage::Range, 5))),
            (&[byte, 1, unless, 9, 0, byte, 2], 1, Err((Damage::Range, 2))),
            (&[byte, 1, otherwise, 0, 0], 1, Err((Damage::Range, 2))),
            (&[repeat, 6, 0, 0, 0, 1, 0, again], 0, Ok(())),
            (&[repeat, 7, 0, 0, 0, 1, 0, again], 0, Err((Damage::Room, 0))),
            (&[repeat, 6, 0, 0, 0, 0, 0, again], 0, Err((Damage::Range, 0))),
            (&[again], 0, Err((Damage::Range, 0))),
            (&[byte, 1, call, 0, 0, 1], 0, Ok(())),
            (&[byte, 1, call, 0, 0, 2], 0, Err((Damage::Range, 2))),
        ];
        for (code, wanted, expected) in cases {
            let found = check_code(Machine::Wide, code, 0..code.len(), &bounds, *wanted);
            assert_eq!(found.map_err(|it| (it.damage, it.at)), *expected, "{code:?}");
        }
        // The narrow machine has fewer instructions.
        let wide = [Op::Dt as u8];
        assert!(check_code(Machine::Wide, &wide, 0..1, &bounds, 1).is_ok());
        assert!(check_code(Machine::Narrow, &wide, 0..1, &bounds, 1).is_err());
    }
}
