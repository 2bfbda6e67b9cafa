//! Emitted C beside its net in directed random reactions: what is done for every output that no proof was found for.

use crate::exhaustive::Difference;
use crate::explorer::{Explorer, Instance, differs};
use grafsynth_ir::Valid;
use grafsynth_ir::net::Net;
use grafsynth_sim::{Coverage, Directed, MAX_DT, Start, TraceLayout};

/// The reactions of a test.
pub const REACTIONS: u64 = 10_000;

/// What a test saw.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Tested {
    /// No difference.
    Equal(Coverage),
    /// A way from reset to a row that differs.
    Different(Difference),
}

/// Runs [`REACTIONS`] directed random reactions; `first` is what the program printed after `init`.
///
/// # Errors
/// The program does not answer.
pub(crate) fn run(
    net: &Valid<Net>,
    (explorer, first, start): (&mut Explorer, &str, Instance),
    seed: u64,
) -> Result<Tested, String> {
    let layout = TraceLayout::of(net);
    let mut directed = Directed::new(net, seed, MAX_DT);
    let different = |path, cell| Ok(Tested::Different(Difference { path, cell }));
    if let Some(cell) = differs(&layout, directed.row(), first) {
        return different(Vec::new(), cell);
    }
    let mut here = start;
    let mut kept: Vec<Instance> = Vec::new();
    while directed.coverage().reactions < REACTIONS {
        let Some(next) = directed.next() else { break };
        here = match next.from {
            Start::Here => here,
            Start::Reset => start,
            Start::Saved(number) => kept.get(number).copied().unwrap_or(start),
        };
        let (row, instance) = explorer.one(net, here, &next.row)?;
        if let Some(cell) = differs(&layout, directed.row(), &row) {
            return different(directed.path(), cell);
        }
        here = instance;
        if let Some(number) = next.save {
            match kept.get_mut(number) {
                Some(place) => *place = here,
                None => kept.push(here),
            }
        }
    }
    Ok(Tested::Equal(directed.coverage()))
}
