//! Forcing orders (semantics §8) as functions: K3, K5 and N3 of §3.9.

use grafsynth_ir::net::StepId;

use super::aig::Lit;
use super::reaction::Maker;
use super::state::State;
use crate::cover;

impl Maker<'_> {
    /// Step K3: transitions of a chart that an active step forces do not fire.
    pub(super) fn hold_forced(&mut self, state: &State) {
        self.free = self.fireable.clone();
        for chart in self.forced.clone() {
            let forces: Vec<Lit> =
                chart.orders.iter().map(|(step, _)| state.active[step.index()]).collect();
            let forces = self.aig.or_all(forces);
            for transition in chart.transitions {
                self.free[transition.index()] =
                    self.aig.and(self.free[transition.index()], !forces);
            }
        }
    }

    /// Step K5: transitions of a chart that becomes forced in this micro-step do not fire either.
    pub(super) fn stop_forced(&mut self, state: &State, chosen: &mut [Lit]) {
        for chart in self.forced.clone() {
            let (next, _) = self.next(state, chosen);
            let forces: Vec<Lit> =
                chart.orders.iter().map(|(step, _)| next[step.index()]).collect();
            let forces = self.aig.or_all(forces);
            for transition in chart.transitions {
                chosen[transition.index()] = self.aig.and(chosen[transition.index()], !forces);
            }
        }
    }

    /// Step N3: gives every chart that is forced now the requested situation.
    pub(super) fn force(&mut self, before: &[Lit], next: &mut [Lit], restarted: &mut [Lit]) {
        let net = self.net;
        for chart in self.forced.clone() {
            // The first declared order whose step is active.
            let mut applies = Vec::new();
            let mut earlier = Lit::FALSE;
            for (step, _) in &chart.orders {
                let active = next[step.index()];
                applies.push(self.aig.and(active, !earlier));
                earlier = self.aig.or(earlier, active);
            }
            for step in &chart.steps {
                let at = step.index();
                let mut ways = Vec::new();
                for ((_, wanted), applies) in chart.orders.iter().zip(&applies) {
                    let asked = match wanted {
                        None => before[at],
                        Some(wanted) => Lit::constant(wanted.contains(step)),
                    };
                    ways.push(self.aig.and(*applies, asked));
                }
                let mut asked = self.aig.or_all(ways);
                // Parents are declared before their children, so their value is known.
                if let Some(parent) = net.steps[*step].parent {
                    asked = self.aig.and(asked, next[parent.index()]);
                }
                next[at] = self.aig.ite(earlier, asked, next[at]);
                restarted[at] = self.aig.and(restarted[at], !earlier);
            }
        }
    }

    /// Conditions that are true in every situation: its own forcing orders would not change it.
    pub(super) fn stays_forced(&mut self, state: &State) -> Vec<Lit> {
        let mut next = state.active.clone();
        let mut restarted = vec![Lit::FALSE; next.len()];
        self.force(&state.active, &mut next, &mut restarted);
        let all = next.into_iter().zip(&state.active).filter(|(next, now)| next != *now);
        all.map(|(next, now)| !self.aig.xor(next, *now)).collect()
    }

    /// Step R2: the steps that are active after reset.
    pub(super) fn initial_situation(&mut self) -> Vec<StepId> {
        let net = self.net;
        let initial = cover::initial_situation(net);
        let mut next = vec![Lit::FALSE; net.steps.len()];
        initial.iter().for_each(|step| next[step.index()] = Lit::TRUE);
        // A chart forced with `hold` keeps its initial situation.
        let before = next.clone();
        let mut restarted = vec![Lit::FALSE; next.len()];
        self.force(&before, &mut next, &mut restarted);
        net.steps.ids().filter(|step| next[step.index()] == Lit::TRUE).collect()
    }
}
