//! Which of the fireable transitions fire: §4 for statecharts.

use std::rc::Rc;

use super::super::aig::Lit;
use super::super::reaction::Maker;
use super::super::state::State;
use super::Selected;
use super::tree::Rival;

impl Maker<'_> {
    /// F' in the order of selection. Of two atomic states that exclude each other, at most one is active in the states for which the functions are used.
    pub(super) fn select_in_statechart(
        &mut self,
        state: &State,
        fireable: &[Lit],
    ) -> Vec<Selected> {
        let tree = Rc::clone(&self.chart().tree);
        let is_left: Vec<Lit> = tree
            .sets
            .iter()
            .map(|set| self.aig.or_all(set.iter().map(|step| state.active[step.index()])))
            .collect();
        let mut selected: Vec<Selected> = Vec::with_capacity(tree.offers.len());
        // True while the atomic state has not found a fireable transition on its path.
        let mut waits = Lit::FALSE;
        for offer in &tree.offers {
            if offer.is_first {
                waits = state.active[offer.atom.index()];
            }
            let fires = fireable[offer.transition.index()];
            let mut parts = vec![self.aig.and(waits, fires)];
            waits = self.aig.and(waits, !fires);
            for (other, rival) in &offer.rivals {
                let theirs = selected[*other].taken;
                match rival {
                    Rival::Same => parts.push(!theirs),
                    Rival::Loses(set) => {
                        let conflict = self.aig.and(theirs, is_left[*set]);
                        parts.push(!conflict);
                    }
                    Rival::Replaces(_) => {}
                }
            }
            let taken = self.aig.and_all(parts);
            for (other, rival) in &offer.rivals {
                if let Rival::Replaces(set) = rival {
                    let loses = self.aig.and(taken, is_left[*set]);
                    selected[*other].taken = self.aig.and(selected[*other].taken, !loses);
                }
            }
            selected.push(Selected { transition: offer.transition, taken });
        }
        selected
    }
}
