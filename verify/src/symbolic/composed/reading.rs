//! How the state of the net is read from the flip-flops of a circuit.

use std::collections::{BTreeMap, BTreeSet};

use grafsynth_ir::logic::{FlopBit, FlopId, Logic};
use grafsynth_ir::net::{Enter, HistoryId, Net, StepId, StepKind};
use grafsynth_ir::program::Origin;

use crate::equiv::binding::Binding;
use crate::symbolic::Model;
use crate::symbolic::aig::{Aig, Lit};
use crate::symbolic::state::{Key, State};
use crate::symbolic::statechart::Tree;

/// How the state of the net is read from the flip-flops of a circuit.
pub(super) struct Reading<'a> {
    pub(super) net: &'a Net,
    pub(super) logic: &'a Logic,
    pub(super) flops: BTreeMap<Key, (FlopId, bool)>,
    /// Pieces that the circuit does not store: their value after reset if they are constant, else a variable of their own.
    pub(super) others: BTreeMap<Key, Lit>,
}

impl<'a> Reading<'a> {
    /// The flip-flops that store a piece of the net's state.
    pub(super) fn known(
        net: &Net,
        logic: &Logic,
        binding: &Binding,
        pieces: &BTreeSet<Key>,
    ) -> Result<BTreeSet<FlopId>, String> {
        let mut keys: BTreeSet<Key> = BTreeSet::new();
        let mut known = BTreeSet::new();
        for (id, flop) in logic.flops.iter() {
            let Some(holds) = flop.holds else { continue };
            if is_own((holds.origin, holds.element, holds.bit), pieces, binding) {
                if !keys.insert((holds.origin, holds.element, holds.bit)) {
                    return Err(format!(
                        "flip-flop `{}` stores a bit that another one already stores",
                        flop.name
                    ));
                }
                known.insert(id);
            }
        }
        for (id, history) in net.histories.iter() {
            let is_stored = |case: &grafsynth_ir::net::HistoryCase| {
                keys.contains(&(Origin::Recorded(id, case.step), 0, 0))
            };
            let in_region = net.steps.iter().any(|(step, _)| {
                keys.contains(&(Origin::Region(step), 0, 0))
                    && Tree::is_inside(net, step, history.owner)
            });
            if in_region && !history.cases.iter().all(is_stored) && !is_left_before_entry(net, id) {
                return Err(format!(
                    "history `{}` is entered without leaving its state",
                    history.name
                ));
            }
        }
        // A decoded step may be any function of flip-flops without a meaning of their own, and times are functions of shared timers.
        let is_coded = logic.decoded.iter().any(crate::symbolic::is_step);
        for (id, flop) in logic.flops.iter() {
            match flop.holds {
                None if is_coded => known.insert(id),
                Some(FlopBit { origin: Origin::SharedElapsed(_), .. }) => known.insert(id),
                _ => false,
            };
        }
        Ok(known)
    }

    /// The value of a piece of state, given those of all flip-flops, of all nodes, and of the steps declared earlier.
    fn bit(&self, key: Key, flops: &[Lit], nodes: &[Lit], active: &[Lit], aig: &mut Aig) -> Lit {
        let stored = |key: &Key| {
            self.flops.get(key).map(|(flop, inverted)| flops[flop.index()].negate_if(*inverted))
        };
        if let Some(lit) = stored(&key) {
            return lit;
        }
        let decoded = self
            .logic
            .decoded
            .iter()
            .find(|bit| (bit.holds.origin, bit.holds.element, bit.holds.bit) == key);
        if let Some(decoded) = decoded {
            return nodes[decoded.node.index()];
        }
        match key.0 {
            Origin::Step(step) => {
                if let Some(parent) = self.net.steps[step].parent {
                    let around = active[parent.index()];
                    if let Some(own) = stored(&(Origin::Region(step), 0, 0)) {
                        return aig.and(own, around);
                    }
                    if self.net.steps[parent].kind == StepKind::Parallel {
                        return around;
                    }
                }
            }
            Origin::Recorded(history, step) => {
                if let Some(all) = self.by_region(history, step, flops) {
                    return aig.and_all(all);
                }
            }
            _ => {}
        }
        self.others.get(&key).copied().unwrap_or(Lit::FALSE)
    }

    /// True if the circuit stores the piece, or its value follows from what is stored.
    pub(super) fn is_stored(&self, key: Key) -> bool {
        let has = |key: &Key| self.flops.contains_key(key);
        let is_decoded = self
            .logic
            .decoded
            .iter()
            .any(|bit| (bit.holds.origin, bit.holds.element, bit.holds.bit) == key);
        has(&key)
            || is_decoded
            || match key.0 {
                Origin::Step(step) => self.net.steps[step].parent.is_some_and(|parent| {
                    has(&(Origin::Region(step), 0, 0))
                        || self.net.steps[parent].kind == StepKind::Parallel
                }),
                Origin::Recorded(history, step) => {
                    let flops = vec![Lit::FALSE; self.logic.flops.len()];
                    self.by_region(history, step, &flops).is_some()
                }
                _ => false,
            }
    }

    /// The registers of the regions from a recorded state up to the owner of the history; `None` if the circuit has none there.
    pub(super) fn by_region(
        &self,
        history: HistoryId,
        step: StepId,
        flops: &[Lit],
    ) -> Option<Vec<Lit>> {
        let owner = self.net.histories[history].owner;
        let mut all = Vec::new();
        let mut at = step;
        while at != owner {
            if let Some((flop, inverted)) = self.flops.get(&(Origin::Region(at), 0, 0)) {
                all.push(flops[flop.index()].negate_if(*inverted));
            }
            at = self.net.steps[at].parent?;
        }
        (!all.is_empty()).then_some(all)
    }

    pub(super) fn state(
        &self,
        model: &mut Model<'_>,
        flops: &[Lit],
        nodes: &[Lit],
    ) -> (State, BTreeMap<Key, Lit>) {
        let shape = model.maker.shape.clone();
        let mut active = vec![Lit::FALSE; self.net.steps.len()];
        let mut bits = BTreeMap::new();
        let state = shape.read(self.net, model.aig(), &mut |key, aig| {
            let lit = self.bit(key, flops, nodes, &active, aig);
            if let (Origin::Step(step), _, _) = key {
                active[step.index()] = lit;
            }
            bits.insert(key, lit);
            lit
        });
        (state, bits)
    }
}

/// True if a flip-flop stores this piece between reactions. While a chip is busy, its pins show registers that are not read; and a queue that is empty after
/// each reaction is no piece of the state.
pub(super) fn is_own(key: Key, pieces: &BTreeSet<Key>, binding: &Binding) -> bool {
    match key.0 {
        Origin::HeldOutput(..) => binding.busy.is_none() && pieces.contains(&key),
        Origin::Region(_) => true,
        _ => pieces.contains(&key),
    }
}

/// True if every transition that enters the history leaves the state of the history, so that what was recorded earlier is never read while the state is
/// active.
fn is_left_before_entry(net: &Net, wanted: HistoryId) -> bool {
    net.transitions.values().all(|transition| {
        let mut lists = vec![transition.enters.as_slice()];
        let mut seen: BTreeSet<HistoryId> = BTreeSet::new();
        while let Some(list) = lists.pop() {
            for enter in list {
                if let Enter::History(id) = enter
                    && seen.insert(*id)
                {
                    let history = &net.histories[*id];
                    lists.push(&history.default);
                    lists.extend(history.cases.iter().map(|case| case.enters.as_slice()));
                }
            }
        }
        !seen.contains(&wanted) || transition.clears.contains(&net.histories[wanted].owner)
    })
}
