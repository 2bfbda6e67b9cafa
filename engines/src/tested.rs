//! Emitted C beside its net in directed random reactions: what is done for every output that no proof was found for.

use crate::exhaustive::Difference;
use crate::explorer::{Explorer, Start as From, Trouble, differs, push};
use grafsynth_backend_c::Package;
use grafsynth_ir::Valid;
use grafsynth_ir::net::Net;
use grafsynth_sim::{Directed, InputRow, MAX_DT, Row, Start, TraceLayout};
use grafsynth_verify::Tested;

/// The reactions of a test.
pub const REACTIONS: u64 = 10_000;
/// Reactions that are asked for at once.
const BATCH: usize = 500;

/// What a test saw.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Answer {
    /// No difference.
    Equal(Tested),
    /// A way from reset to a row that differs.
    Different(Difference),
}

/// A reaction that the net has made.
struct Made {
    /// The answer of C that it goes on from.
    from: usize,
    row: InputRow,
    expected: Row,
}

/// Runs [`REACTIONS`] directed random reactions.
///
/// # Errors
/// The program cannot be made, or does not answer.
pub(crate) fn run(net: &Valid<Net>, package: &Package, seed: u64) -> Result<Answer, Trouble> {
    let mut started = Explorer::start(net, package)?;
    let layout = TraceLayout::of(net);
    let mut directed = Directed::new(net, seed, MAX_DT);
    if let Some(cell) = differs(&layout, directed.row(), &started.row) {
        return Ok(Answer::Different(Difference { path: Vec::new(), cell }));
    }
    // Which reactions are made depends on the net alone, so that many can be asked for at once. Answer 0 is that after `init`, the others are these.
    let mut made: Vec<Made> = Vec::new();
    let mut saved: Vec<usize> = Vec::new();
    // Where no inputs keep what the chart assumes, a run ends; there may be no others.
    let mut tries = 2 * REACTIONS;
    while (made.len() as u64) < REACTIONS && tries > 0 {
        let first = made.len();
        let mut questions = String::new();
        while made.len() < first + BATCH && (made.len() as u64) < REACTIONS && tries > 0 {
            tries -= 1;
            let Some(next) = directed.next() else { continue };
            let from = match next.from {
                Start::Here => made.len(),
                Start::Reset => 0,
                Start::Saved(number) => saved.get(number).copied().unwrap_or(0),
            };
            push(net, From::Answer(from), &next.row, &mut questions);
            made.push(Made { from, row: next.row, expected: directed.row().clone() });
            if let Some(number) = next.save {
                if saved.len() <= number {
                    saved.resize(number + 1, 0);
                }
                saved[number] = made.len();
            }
        }
        let mut found = None;
        started.explorer.ask(&questions, made.len() - first, |at, answer, _| {
            found = differs(&layout, &made[first + at].expected, answer).map(|it| (first + at, it));
            found.is_none()
        })?;
        if let Some((at, cell)) = found {
            return Ok(Answer::Different(Difference { path: path(&made, at), cell }));
        }
    }
    Ok(Answer::Equal(Tested::of(net, &directed.coverage())))
}

/// The rows from reset to a reaction.
fn path(made: &[Made], last: usize) -> Vec<InputRow> {
    let mut rows = Vec::new();
    let mut next = Some(last);
    while let Some(reaction) = next.and_then(|at| made.get(at)) {
        rows.push(reaction.row.clone());
        next = reaction.from.checked_sub(1);
    }
    rows.reverse();
    rows
}
