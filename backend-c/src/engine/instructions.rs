//! The maximum number of instructions of a program that one reaction runs.
//!
//! The code is its own proof: parts are contained in the instruction before them and nested, and loops state their rounds, so one pass finds the
//! worst-case path. The time of each instruction is a property of the engine, not of the code.

use super::bytes::{OPERANDS, Op};

/// The loop of the evolution, and its proved maximum number of rounds.
#[derive(Debug, Clone, Copy)]
pub(super) struct Evolution {
    /// The position of its instruction.
    pub(super) at: usize,
    /// The maximum number of rounds.
    pub(super) rounds: u64,
}

/// The maximum number of instructions that one run of the code executes; `None` if it is not valid code.
pub(super) fn most_instructions(code: &[u8], evolution: Option<Evolution>) -> Option<u64> {
    part(code, 0..code.len(), evolution).map(|(n, _)| n)
}

/// A part, and the length that its last instruction skips if that is an `ELSE`. The nesting depth is at most 31, as the engine checks.
fn part(
    code: &[u8],
    range: std::ops::Range<usize>,
    evolution: Option<Evolution>,
) -> Option<(u64, Option<usize>)> {
    let mut sum = 0_u64;
    let mut at = range.start;
    while at < range.end {
        let op = *code.get(at)?;
        let operand = at + 1;
        let next = operand + usize::from(*OPERANDS.get(usize::from(op))?);
        sum = sum.saturating_add(1);
        let is = |other: Op| op == other as u8;
        let length = |from: usize| {
            let bytes = code.get(from..from + 2)?;
            Some(usize::from(bytes[0]) | usize::from(bytes[1]) << 8)
        };
        if is(Op::Else) {
            return (next == range.end).then_some((sum, Some(length(operand)?)));
        }
        if is(Op::Unless) {
            let end = next + length(operand)?;
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
        } else if is(Op::AndThen) || is(Op::OrElse) {
            let end = next + length(operand)?;
            sum = sum.saturating_add(part(code, next..end, evolution)?.0);
            at = end;
        } else if is(Op::Loop) {
            let bytes = code.get(operand..operand + 4)?;
            let limit = bytes.iter().rev().fold(0_u64, |all, byte| all << 8 | u64::from(*byte));
            let end = next + length(operand + 4)?;
            let proved = evolution.filter(|it| it.at == at).map_or(limit, |it| it.rounds);
            let round = part(code, next..end, evolution)?.0;
            // A loop that ends because its condition is false evaluates the condition once more.
            let rounds = limit.min(proved.saturating_add(1));
            sum = sum.saturating_add(round.saturating_mul(rounds));
            at = end;
        } else {
            at = next;
        }
    }
    (at == range.end).then_some((sum, None))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The operands that the engine reads are the ones counted here.
    #[test]
    fn operands_are_those_of_the_engine() {
        let engine = include_str!("grafsynth_program.c");
        let table = engine.split_once("gp_operand[GP_N_OPS] = {").expect("the table").1;
        let table = table.split_once('}').expect("its end").0;
        let sizes: Vec<u8> = table
            .split(',')
            .map(|it| it.trim().trim_end_matches('U').parse().expect("a number"))
            .collect();
        assert_eq!(sizes, OPERANDS);
    }

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
}
