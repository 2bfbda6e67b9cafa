//! Net and circuit side by side under directed random runs: restarted often, and headed for transitions that have not fired yet.

use std::collections::BTreeMap;

use grafsynth_ir::Valid;
use grafsynth_ir::logic::Logic;
use grafsynth_ir::net::Net;
use grafsynth_sim::{Directed, Move, Simulator, Start, Stimulus};

use super::Counterexample;
use super::binding::Binding;
use super::explicit::Lanes;
use crate::verdict::Tested;

/// Compares some reactions: a difference if one is found, and how much was seen.
pub(super) fn compare(
    net: &Valid<Net>,
    logic: &Logic,
    binding: &Binding,
    n_rows: usize,
) -> (Option<Counterexample>, Tested) {
    // One clock of a chip is at most one tick.
    let mut directed = Directed::new(net, 1, 1);
    let found = difference(net, logic, binding, n_rows, &mut directed);
    (found, Tested::of(net, &directed.coverage()))
}

fn difference(
    net: &Valid<Net>,
    logic: &Logic,
    binding: &Binding,
    n_rows: usize,
    directed: &mut Directed<'_>,
) -> Option<Counterexample> {
    let mut lanes = Lanes::new(net, logic, binding);
    lanes.reset(net);
    let after_reset = Simulator::new(net);
    if let Some(differs) = lanes.difference(net, after_reset.row(), 0) {
        let difference = lanes.report(net, after_reset.row(), 0, 0, differs);
        return Some(Counterexample { stimulus: Stimulus::new(net), difference });
    }
    let every_flop = vec![!0; logic.flops.len().div_ceil(64)];
    let woken = lanes.code(0, &every_flop);
    // What the circuit holds where the net stood when its state was saved.
    let mut saved: BTreeMap<usize, Vec<u64>> = BTreeMap::new();
    for _ in 0..n_rows {
        let Some(Move { from, row, save }) = directed.next() else { continue };
        match from {
            Start::Here => {}
            Start::Reset => lanes.set_code(&woken),
            Start::Saved(number) => lanes.set_code(saved.get(&number).unwrap_or(&woken)),
        }
        if lanes.react(net, std::slice::from_ref(&row)).is_err() {
            let path = directed.path();
            let difference = Lanes::still_busy(path.len());
            return Some(Counterexample { stimulus: Stimulus::of_rows(net, &path), difference });
        }
        if let Some(differs) = lanes.difference(net, directed.row(), 0) {
            let path = directed.path();
            let difference = lanes.report(net, directed.row(), 0, path.len(), differs);
            return Some(Counterexample { stimulus: Stimulus::of_rows(net, &path), difference });
        }
        if let Some(number) = save {
            saved.insert(number, lanes.code(0, &every_flop));
        }
    }
    None
}
