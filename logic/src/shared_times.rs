//! Timers that steps share: the states that their registers never have.

use crate::build::{Builder, needed};
use grafsynth_ir::logic::{FlopId, Logic, Node, NodeId};
use grafsynth_ir::program::Origin;
use std::collections::BTreeMap;

/// For each timer that steps share, a node that is true if the register is not 0 although none of its steps is active, so that all their times are 0. The
/// register is cleared when a step is left, so no such state is reachable; a proof must show this for the circuit.
pub fn idle(logic: &mut Logic) -> Vec<NodeId> {
    let mut registers: BTreeMap<Origin, Vec<(FlopId, bool)>> = BTreeMap::new();
    for (id, flop) in logic.flops.iter() {
        if let Some(holds) = flop.holds
            && let Origin::SharedElapsed(_) = holds.origin
        {
            registers.entry(holds.origin).or_default().push((id, holds.inverted));
        }
    }
    if registers.is_empty() {
        return Vec::new();
    }
    let times: Vec<(NodeId, Vec<FlopId>)> = (logic.decoded.iter())
        .filter(|bit| matches!(bit.holds.origin, Origin::Elapsed(_)))
        .map(|bit| (bit.node, reads(logic, bit.node)))
        .collect();
    let mut builder = Builder::resume(std::mem::take(logic));
    let mut found = Vec::new();
    for flops in registers.values() {
        let is_own = |read: &Vec<FlopId>| flops.iter().any(|(flop, _)| read.contains(flop));
        let own = times.iter().filter(|(_, read)| is_own(read)).map(|(node, _)| *node);
        let shown = builder.or(own.collect::<Vec<_>>());
        let none = builder.not(shown);
        let mut bits = Vec::new();
        for &(flop, is_inverted) in flops {
            let value = builder.flop(flop);
            bits.push(if is_inverted { builder.not(value) } else { value });
        }
        let any = builder.or(bits);
        found.push(builder.and([any, none]));
    }
    *logic = builder.logic;
    found
}

/// The flip-flops that a node depends on.
fn reads(logic: &Logic, node: NodeId) -> Vec<FlopId> {
    let cone = needed(logic, [node]);
    let flop = |node: &Node| if let Node::Flop(flop) = node { Some(*flop) } else { None };
    logic.nodes.iter().filter(|(id, _)| cone[*id]).filter_map(|(_, node)| flop(node)).collect()
}
