//! Starvation without a search of all states: some transitions win whenever they are fireable, and runs show that the others can wait for ever.
//!
//! A run shows it with rows that lead from a situation back to the same one, during which the transition is fireable and does not fire. These rows are
//! repeated. If a state returns at the end of them and the transition did not fire since, they can be repeated for ever.

use grafsynth_ir::Valid;
use grafsynth_ir::net::{Net, TransitionId};
use grafsynth_sim::{Directed, InputRow, MAX_DT, Simulator, Situation, Start, State};

use crate::guards::{holds, is_enabled};
use crate::limits::Limits;
use crate::waiting::may_lose_to_others;

/// The maximum number of rows that are repeated.
const LONGEST: usize = 40;
/// The number of times that they are repeated.
const REPETITIONS: usize = 16;
/// The maximum number of cycles that are tried for one transition.
const TRIES: usize = 64;

/// The competing transitions that can starve: a bit for each. `None` if the answer for one of them is unknown.
pub(super) fn starving(net: &Valid<Net>, rivals: &[TransitionId], limits: &Limits) -> Option<u32> {
    if !net.unspecified.is_empty() {
        return None;
    }
    let mut waiting: Vec<Rival> = (rivals.iter().zip(0..))
        .filter(|(transition, _)| may_lose_to_others(net, **transition))
        .map(|(transition, bit)| Rival { transition: *transition, bit, lost: None, tries: 0 })
        .collect();
    let mut starving = 0;
    let mut runs = Directed::new(net, 1, MAX_DT);
    let mut before = runs.simulator().state().situation().clone();
    let mut recent: Vec<Passed> = Vec::new();
    let mut repeated = Simulator::new(net);
    for _ in 0..limits.random_rows {
        if waiting.is_empty() || waiting.iter().any(|rival| rival.tries >= TRIES) {
            break;
        }
        let next = runs.next()?;
        let after = runs.simulator().state();
        if next.from == Start::Here {
            recent.push(Passed { from: before.clone(), row: next.row });
            let excess = recent.len().saturating_sub(LONGEST);
            recent.drain(..excess);
        } else {
            // This reaction did not start in the state after the last one.
            recent.clear();
        }
        let fired = runs.simulator().fired();
        waiting.retain_mut(|rival| {
            rival.note(net, &recent, fired.contains(&rival.transition));
            let starves = rival.starves(net, &mut repeated, &recent, after);
            starving |= u32::from(starves) << rival.bit;
            !starves
        });
        before.copy_from(after.situation());
    }
    waiting.is_empty().then_some(starving)
}

/// A reaction of a run: the situation before it, and its row.
struct Passed {
    from: Situation,
    row: InputRow,
}

/// A transition that may lose to others.
struct Rival {
    transition: TransitionId,
    bit: u32,
    /// The number of reactions after the last one in which the transition was fireable and did not fire; `None` if it fired since.
    lost: Option<usize>,
    tries: usize,
}

impl Rival {
    /// True if the transition is enabled and its receptivity is true in this situation and row.
    fn is_fireable(&self, net: &Net, situation: &Situation, row: &InputRow) -> bool {
        let data = &net.transitions[self.transition];
        is_enabled(data, situation) && holds(data, situation, row)
    }

    /// Notes the last reaction of a run.
    fn note(&mut self, net: &Net, recent: &[Passed], has_fired: bool) {
        self.lost = self.lost.map(|ago| ago + 1).filter(|_| !has_fired);
        if let Some(Passed { from, row }) = recent.last().filter(|_| !has_fired)
            && self.is_fireable(net, from, row)
        {
            self.lost = Some(0);
        }
    }

    /// True if the last rows of a run, repeated from the state after it, show that the transition can wait for ever.
    fn starves(
        &mut self,
        net: &Net,
        simulator: &mut Simulator<'_>,
        recent: &[Passed],
        after: &State,
    ) -> bool {
        let Some(lost) = self.lost.and_then(|ago| recent.len().checked_sub(ago + 1)) else {
            return false;
        };
        let returns = |passed: &Passed| passed.from == *after.situation();
        let Some(first) = recent[..=lost].iter().rposition(returns) else { return false };
        let cycle = &recent[first..];
        self.tries += 1;
        simulator.set_state(after);
        let mut at_ends = vec![after.clone()];
        for _ in 0..REPETITIONS {
            let mut loses = false;
            for Passed { row, .. } in cycle {
                let is_fireable = self.is_fireable(net, simulator.state().situation(), row);
                simulator.step(row);
                if simulator.fired().contains(&self.transition) {
                    return false;
                }
                // Something else must have fired.
                loses |= is_fireable && !simulator.fired().is_empty();
            }
            if !loses {
                return false;
            }
            if at_ends.contains(simulator.state()) {
                return true;
            }
            at_ends.push(simulator.state().clone());
        }
        false
    }
}

#[cfg(test)]
mod tests {
    use grafsynth_ir::net::Policy;
    use grafsynth_sim::Random;

    use crate::limits::Limits;
    use crate::lints::Check;
    use crate::testing::{chart, valid};
    use crate::{facts, findings};

    /// Random charts: the transitions that starve without a search are those of the search of all states.
    #[test]
    fn runs_find_the_transitions_that_a_search_finds() {
        let few = Limits { pairs: 1, image_work: 0, ..Limits::default() };
        let mut random = Random::new(3);
        let (mut n_answers, mut n_starving) = (0, 0);
        for _ in 0..200 {
            let mut text = "a* b c d |".to_owned();
            for from in ["a", "a", "b", "b", "c", "d"] {
                let to = random.pick(&["a", "b", "c", "d"]).expect("there are some");
                let guard = random.pick(&["x", "y", "z", "nx", "ny"]).expect("there are some");
                text += &format!(" {from}>{to}:{guard}");
            }
            let mut net = chart(&text);
            net.settings.policy = Policy::Priority;
            let net = valid(net);
            let starving = |limits: &Limits| {
                let found = findings(&net, &facts(&net, limits), limits);
                let is_open =
                    |it: &crate::Checked| it.check == Check::Starvation && it.open.is_some();
                let is_known = !found.checked.iter().any(is_open);
                let notes = found.found.into_iter().filter(|it| it.code.id == "G0808");
                is_known.then(|| notes.map(|it| it.message).collect::<Vec<_>>())
            };
            let Some(by_runs) = starving(&few) else { continue };
            n_answers += 1;
            n_starving += usize::from(!by_runs.is_empty());
            assert_eq!(Some(by_runs), starving(&Limits::default()), "{text}");
        }
        assert!(n_answers > 100 && n_starving > 20, "{n_answers} answers, {n_starving} starve");
    }
}
