//! The runs of a net in an episode (semantics §10.7), made without the search of the proof.

use grafsynth_ir::Valid;
use grafsynth_ir::net::{InputId, Net};
use grafsynth_sim::{InputRow, Simulator, State, seen};

/// What starts an episode.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Episode {
    /// An input that changes.
    pub change: Option<(InputId, i64)>,
    /// Whether a tick passes.
    pub has_tick: bool,
}

/// The values that each output and step takes in an episode, and the state at its end.
pub(crate) type Run = (Vec<Vec<i64>>, State);

impl Episode {
    /// All runs of the net from a state at rest; `rest` has the inputs and what is shown there. `None` if a run does not come to rest.
    pub(crate) fn runs(
        &self,
        net: &Valid<Net>,
        state: &State,
        rest: (&InputRow, &[i64]),
    ) -> Option<Vec<Run>> {
        const LATEST: usize = 20;
        let orders: Vec<(usize, usize)> = match (self.change, self.has_tick) {
            (Some(_), true) => (1..LATEST).flat_map(|at| [(1, at), (at, 1)]).collect(),
            (_, tick) => vec![(1, usize::from(tick))],
        };
        orders.into_iter().map(|order| self.run(net, state, rest, order)).collect()
    }

    fn run(
        &self,
        net: &Valid<Net>,
        state: &State,
        (inputs, start): (&InputRow, &[i64]),
        (change, tick): (usize, usize),
    ) -> Option<Run> {
        let mut simulator = Simulator::new(net);
        simulator.set_state(state);
        let mut row = inputs.clone();
        let mut last = start.to_vec();
        let mut changes = vec![Vec::new(); last.len()];
        for reaction in 1..1000 {
            if let Some((input, value)) = self.change.filter(|_| reaction == change) {
                row = row.with(input, value);
            }
            row.dt = u32::from(reaction == tick);
            let before = simulator.state().clone();
            let after = seen(simulator.step(&row), net.steps.len());
            let is_same = after == last && *simulator.state() == before;
            for ((all, old), new) in changes.iter_mut().zip(&last).zip(&after) {
                if old != new {
                    all.push(*new);
                }
            }
            last = after;
            if is_same && reaction > change.max(tick) {
                return Some((changes, before));
            }
        }
        None
    }
}
