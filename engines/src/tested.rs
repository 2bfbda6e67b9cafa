//! Compares emitted C with its net in directed random reactions, if the C is not proved.

use crate::executed::Trouble;
use crate::explorer::{Difference, Explorer, Runner, Start as From, differs, push};
use grafsynth_backend_c::Package;
use grafsynth_ir::Valid;
use grafsynth_ir::net::Net;
use grafsynth_sim::{Ahead, MAX_DT, TraceLayout};
use grafsynth_verify::Tested;

/// The number of reactions of a test.
pub const REACTIONS: usize = 10_000;
/// The number of reactions that are requested at once.
const BATCH: usize = 500;

/// The result of a test.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Answer {
    /// No difference.
    Equal(Tested),
    /// A path from reset to a row that differs.
    Different(Difference),
}

/// Runs directed random reactions, normally [`REACTIONS`].
///
/// # Errors
/// The program cannot be created, or does not answer.
pub(crate) fn run(
    net: &Valid<Net>,
    package: &Package,
    runner: Runner<'_>,
    seed: u64,
    reactions: usize,
) -> Result<Answer, Trouble> {
    let mut started = Explorer::start(net, package, runner)?;
    let layout = TraceLayout::of(net);
    let mut ahead = Ahead::new(net, seed, MAX_DT, reactions);
    if let Some(cell) = differs(&layout, ahead.row(), &started.row) {
        return Ok(Answer::Different(Difference { path: Vec::new(), cell }));
    }
    loop {
        let (numbers, expected) = ahead.batch(BATCH);
        if numbers.is_empty() {
            return Ok(Answer::Equal(Tested::of(net, &ahead.coverage())));
        }
        let first = numbers.start;
        let mut questions = String::new();
        for reaction in &ahead.made()[numbers] {
            push(net, From::Answer(reaction.from), &reaction.row, &mut questions);
        }
        let mut found = None;
        started.explorer.ask(&questions, expected.len(), |at, answer, _| {
            found = differs(&layout, &expected[at], answer).map(|cell| (first + at, cell));
            found.is_none()
        })?;
        if let Some((at, cell)) = found {
            return Ok(Answer::Different(Difference { path: ahead.path(at), cell }));
        }
    }
}
