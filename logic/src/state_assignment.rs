//! State assignment: replaces one flip-flop per step by fewer flip-flops for steps that exclude each other.
//!
//! ```text
//! one-hot    p1 p2 p3 p4    one flip-flop per step
//! zero-hot      p2 p3 p4    the first step is active if none of the others is
//! compact       c1 c0       steps are numbers: 00 01 11 10
//! ```
//! A group is a set of steps, at most one of which is active in every reachable situation (a sequential component that the verifier has proved). A function
//! that read the flip-flop of a step reads a function of the new flip-flops instead; the D function of a new flip-flop is the sum of the D functions of the
//! steps whose code has a 1 there. A step without its own flip-flop is listed in [`Logic::decoded`], so that proofs and traces can see it. Unused codes, and
//! situations that contradict a group, are listed in [`Logic::unreachable`]: the minimiser uses them as don't-cares.
//!
//! The choice of codes decides how wide the sums are. Steps that follow each other, or that occur together in a function, should have codes that
//! differ in few bits. So the first assignment is an embedding that weights these pairs, improved by exchanging codes; then exchanges are judged by
//! the sums themselves, minimised without proofs. The number of judgements is fixed, so the search ends and is reproducible.

mod search;

use grafsynth_ir::Gather;
pub use search::Room;

use crate::bdd::{Bdd, Ref};
use crate::build::{Builder, map_operands, needed, prune};
use crate::node_bdds::Functions;
use grafsynth_ir::logic::{
    Decoded, Flop, FlopBit, FlopId, Function, Logic, Node, NodeId, Open, PinOutput, Wire,
};
use grafsynth_ir::net::Meta;
use std::collections::{BTreeMap, BTreeSet};

/// Steps that are never active together.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Group {
    /// The base name of the new flip-flops.
    pub name: String,
    /// The flip-flops of the steps.
    pub steps: Vec<FlopId>,
    /// True if one of the steps is always active.
    pub is_always: bool,
}

/// The encoding of groups.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub enum Encoding {
    /// One flip-flop per step.
    #[default]
    OneHot,
    /// The step that is initially active has no flip-flop: it is active if no other step is. Groups that may be empty are unchanged.
    ZeroHot,
    /// As few flip-flops as can number the steps.
    Compact,
}

/// The number of code assignments that are judged by their sums, for a circuit of ordinary size.
pub const TRIES: usize = 60;

/// The circuit with these groups encoded. `tries` is the number of code assignments to judge. Groups must be disjoint; a step in two of them keeps its
/// flip-flop.
///
/// Known unreachable situations are kept, in the new code; situations that contradict the groups are added.
#[must_use]
pub fn recode(logic: &Logic, groups: &[Group], encoding: Encoding, tries: usize) -> Logic {
    let mut logic = logic.clone();
    exclude(&mut logic, groups);
    let plans: Vec<Plan> = match encoding {
        Encoding::OneHot => Vec::new(),
        Encoding::ZeroHot => groups.iter().filter_map(|group| zero_hot(&logic, group)).collect(),
        Encoding::Compact => groups.iter().filter_map(|group| compact(&logic, group)).collect(),
    };
    let plans = disjoint(plans);
    if plans.is_empty() {
        return logic;
    }
    let plans =
        if encoding == Encoding::Compact { search::better(&logic, plans, tries) } else { plans };
    apply(&logic, &plans)
}

/// Like [`recode`] with [`Encoding::Compact`], for a device whose macrocells are narrower than the resulting sums. Searches for codes whose sums fit, and uses
/// more than the minimum number of flip-flops if spare macrocells are available. `None` if no such codes were found in the given number of judgements.
///
/// The groups are coded together, so this is a long search: each judgement minimises every sum of the circuit. `work` is the remaining budget, about 6
/// million per second; the work of the search is subtracted from it.
#[must_use]
pub fn recode_within(
    logic: &Logic,
    groups: &[Group],
    room: &Room,
    tries: usize,
    work: &mut usize,
) -> Option<Logic> {
    let mut logic = logic.clone();
    exclude(&mut logic, groups);
    let plans = disjoint(groups.iter().filter_map(|group| compact(&logic, group)).collect());
    let plans = search::within(&logic, plans, room, tries, work)?;
    Some(apply(&logic, &plans))
}

/// The code of one group.
#[derive(Debug, Clone)]
struct Plan {
    name: String,
    members: Vec<FlopId>,
    /// The code of each member; bit k belongs to flip-flop k.
    codes: Vec<u64>,
    /// The code while no member is active, for a group that may be empty.
    idle: Option<u64>,
    n_bits: u32,
    /// For each bit that belongs to one member alone, the flip-flop of that member, which is kept unchanged.
    keeps: Vec<Option<FlopId>>,
}

impl Plan {
    fn is_used(&self, code: u64) -> bool {
        self.codes.contains(&code) || self.idle == Some(code)
    }
}

fn zero_hot(logic: &Logic, group: &Group) -> Option<Plan> {
    let first = group.steps.iter().position(|&step| logic.flops[step].init)?;
    if !group.is_always || group.steps.len() < 2 || group.steps.len() > 64 {
        return None;
    }
    let mut codes = Vec::new();
    let mut keeps = Vec::new();
    for (at, &step) in group.steps.iter().enumerate() {
        if at == first {
            codes.push(0);
        } else {
            codes.push(1 << keeps.len());
            keeps.push(Some(step));
        }
    }
    let n_bits = u32::try_from(keeps.len()).ok()?;
    Some(Plan {
        name: group.name.clone(),
        members: group.steps.clone(),
        codes,
        idle: None,
        n_bits,
        keeps,
    })
}

/// Larger groups are unchanged, because their unused codes could not be listed.
const LARGEST: usize = 256;

fn compact(logic: &Logic, group: &Group) -> Option<Plan> {
    let n_codes = group.steps.len() + usize::from(!group.is_always);
    let n_bits = n_codes.next_power_of_two().trailing_zeros();
    if group.steps.len() > LARGEST || (n_bits as usize) >= group.steps.len() {
        return None;
    }
    let starts_idle = !group.steps.iter().any(|&step| logic.flops[step].init);
    if starts_idle && group.is_always {
        return None;
    }
    // The steps in order along a Gray code, which is optimal for a ring whose length is a power of two; `better` continues from there.
    let gray = |at: usize| (at ^ (at >> 1)) as u64;
    let shift = usize::from(!group.is_always);
    Some(Plan {
        name: group.name.clone(),
        members: group.steps.clone(),
        codes: (0..group.steps.len()).map(|at| gray(at + shift)).collect(),
        idle: (!group.is_always).then_some(0),
        n_bits,
        keeps: vec![None; n_bits as usize],
    })
}

fn disjoint(plans: Vec<Plan>) -> Vec<Plan> {
    let mut seen = BTreeSet::new();
    plans
        .into_iter()
        .filter(|plan| {
            let is_free = plan.members.iter().all(|member| !seen.contains(member));
            if is_free {
                seen.extend(plan.members.iter().copied());
            }
            is_free
        })
        .collect()
}

impl Plan {
    /// The flip-flop of a bit: that of a step, or a new one. [`Plan::drive`] sets its D function; `start` is the code after power-up.
    fn flop(&self, logic: &Logic, bit: u32, start: u64) -> Flop {
        if let Some(own) = self.keeps[bit as usize] {
            return logic.flops[own].clone();
        }
        let first = &logic.flops[self.members[0]];
        Flop {
            name: format!("{}_c{bit}", self.name),
            init: start >> bit & 1 == 1,
            next: first.next,
            holds: None,
            meta: Meta {
                label: format!("bit {bit} of the code of {}", self.name),
                ..first.meta.clone()
            },
        }
    }

    /// Sets the D functions of the bits from those of the steps, and declares unused codes as unreachable.
    fn drive(&self, builder: &mut Builder, bits: &[FlopId], next: impl Fn(FlopId) -> NodeId) {
        for (at, bit) in bits.iter().enumerate() {
            let ones: Vec<NodeId> = (self.members.iter().zip(&self.codes))
                .filter(|(_, code)| *code >> at & 1 == 1)
                .map(|(member, _)| next(*member))
                .collect();
            // If no member becomes active, all bits are 0, which is the idle code.
            builder.logic.flops[*bit].next = builder.or(ones);
        }
        // Steps with flip-flops of their own already exclude each other pair by pair.
        if self.keeps.iter().all(Option::is_none) {
            for code in (0..1_u64 << self.n_bits).filter(|code| !self.is_used(*code)) {
                let node = minterm(builder, bits, code);
                builder.logic.unreachable.push(node);
            }
        }
    }
}

/// The function that is true for one code.
fn minterm(builder: &mut Builder, bits: &[FlopId], code: u64) -> NodeId {
    let literals: Vec<NodeId> = bits
        .iter()
        .enumerate()
        .map(|(bit, &flop)| {
            let value = builder.flop(flop);
            if code >> bit & 1 == 1 { value } else { builder.not(value) }
        })
        .collect();
    builder.and(literals)
}

/// Adds the situations in which two steps of a group are active, or none of a group that is never empty.
fn exclude(logic: &mut Logic, groups: &[Group]) {
    let mut builder = Builder::resume(std::mem::take(logic));
    let mut unreachable = Vec::new();
    for group in groups.iter().filter(|group| group.steps.len() <= 64) {
        let values: Vec<NodeId> = group.steps.iter().map(|&step| builder.flop(step)).collect();
        for (at, &a) in values.iter().enumerate() {
            for &b in &values[at + 1..] {
                unreachable.push(builder.and([a, b]));
            }
        }
        if group.is_always {
            let any = builder.or(values);
            unreachable.push(builder.not(any));
        }
    }
    *logic = builder.logic;
    logic.unreachable.extend(unreachable);
}

/// The circuit with these codes.
fn apply(logic: &Logic, plans: &[Plan]) -> Logic {
    let mut builder = Builder::default();
    builder.logic.name = logic.name.clone();
    builder.logic.inputs = logic.inputs.clone();
    let mut plan_of: BTreeMap<FlopId, (usize, usize)> = BTreeMap::new();
    for (plan, data) in plans.iter().enumerate() {
        for (member, &flop) in data.members.iter().enumerate() {
            plan_of.insert(flop, (plan, member));
        }
    }
    // Flip-flops in the order of the circuit; the bits of a group are at the position of its first step.
    let mut bits: Vec<Vec<FlopId>> = vec![Vec::new(); plans.len()];
    let mut kept: BTreeMap<FlopId, FlopId> = BTreeMap::new();
    let nothing = builder.constant(false);
    for (id, flop) in logic.flops.iter() {
        match plan_of.get(&id) {
            None => {
                kept.insert(id, builder.logic.flops.push(Flop { next: nothing, ..flop.clone() }));
            }
            Some(&(plan, _)) if bits[plan].is_empty() => {
                let data = &plans[plan];
                let start = data
                    .members
                    .iter()
                    .position(|&member| logic.flops[member].init)
                    .map_or(data.idle.unwrap_or(0), |at| data.codes[at]);
                for bit in 0..data.n_bits {
                    let flop = data.flop(logic, bit, start);
                    bits[plan].push(builder.logic.flops.push(Flop { next: nothing, ..flop }));
                }
            }
            Some(_) => {}
        }
    }
    // The functions that represent a step, and those of unused codes.
    let mut active: BTreeMap<FlopId, NodeId> = BTreeMap::new();
    for (plan, data) in plans.iter().enumerate() {
        for (&member, &code) in data.members.iter().zip(&data.codes) {
            let own = data.keeps.iter().position(|keeps| *keeps == Some(member));
            let node = match own {
                Some(bit) => builder.flop(bits[plan][bit]),
                None => minterm(&mut builder, &bits[plan], code),
            };
            active.insert(member, node);
            let flop = &logic.flops[member];
            if let (None, Some(holds)) = (own, flop.holds) {
                let node = if holds.inverted { builder.not(node) } else { node };
                builder.logic.decoded.push(Decoded {
                    name: flop.name.clone(),
                    holds: FlopBit { inverted: false, ..holds },
                    node,
                });
            }
        }
    }
    let (images, mut open) = carry_over(&mut builder, logic, &kept, &active);
    for (data, bits) in plans.iter().zip(&bits) {
        // A bit may have any value if all steps of the group may have any value.
        let free = common(&mut builder, logic, &data.members, &images);
        open.extend(bits.iter().map(|bit| (Function::Next(*bit), free)));
        data.drive(&mut builder, bits, |member| images[&logic.flops[member].next]);
    }
    carry_outputs(&mut builder, logic, &images, open);
    for wire in &logic.wires {
        builder.logic.wires.push(Wire { node: images[&wire.node], ..wire.clone() });
    }
    builder.logic.never = logic.never.iter().map(|node| images[node]).collect();
    for bit in &logic.decoded {
        builder.logic.decoded.push(Decoded { node: images[&bit.node], ..bit.clone() });
    }
    for node in &logic.unreachable {
        let image = images[node];
        if builder.as_constant(image) != Some(false) {
            builder.logic.unreachable.push(image);
        }
    }
    builder.logic.unreachable.sort_unstable();
    builder.logic.unreachable.dedup();
    prune(builder.logic)
}

/// Copies the outputs, and sets all conditions under which functions are open.
fn carry_outputs(
    builder: &mut Builder,
    logic: &Logic,
    images: &BTreeMap<NodeId, NodeId>,
    mut open: Vec<(Function, NodeId)>,
) {
    for (id, output) in logic.outputs.iter() {
        let value = images[&output.value];
        let new = builder.logic.outputs.push(PinOutput { value, ..output.clone() });
        let when = logic.open_where(Function::Output(id));
        open.extend(when.map(|when| (Function::Output(new), images[&when])));
    }
    keep_open(builder, open);
}

/// Copies the nodes of the old circuit into the new one, with the conditions under which the flip-flops in `kept` are open, and sets their D functions.
/// Every other flip-flop is read as its node in `active`.
fn carry_over(
    builder: &mut Builder,
    logic: &Logic,
    kept: &BTreeMap<FlopId, FlopId>,
    active: &BTreeMap<FlopId, NodeId>,
) -> (BTreeMap<NodeId, NodeId>, Vec<(Function, NodeId)>) {
    let mut images: BTreeMap<NodeId, NodeId> = BTreeMap::new();
    for (id, node) in logic.nodes.iter() {
        let image = match node {
            Node::Flop(flop) => match (kept.get(flop), active.get(flop)) {
                (Some(&flop), _) => builder.flop(flop),
                (None, Some(&node)) => node,
                (None, None) => unreachable!("a flip-flop is kept or coded"),
            },
            _ => builder.put(map_operands(node, |operand| images[&operand])),
        };
        images.insert(id, image);
    }
    let mut open = Vec::new();
    for (id, flop) in logic.flops.iter() {
        if let Some(&new) = kept.get(&id) {
            builder.logic.flops[new].next = images[&flop.next];
            let own = logic.open_where(Function::Next(id));
            open.extend(own.map(|when| (Function::Next(new), images[&when])));
        }
    }
    (images, open)
}

/// The condition under which all of these flip-flops may have any value.
fn common(
    builder: &mut Builder,
    logic: &Logic,
    flops: &[FlopId],
    images: &BTreeMap<NodeId, NodeId>,
) -> NodeId {
    let mut all = Vec::new();
    for &flop in flops {
        let own = logic.open_where(Function::Next(flop)).map(|when| images[&when]);
        all.push(builder.or(own.collect::<Vec<_>>()));
    }
    builder.and(all)
}

/// Adds the open functions to the new circuit, except those that are never open.
fn keep_open(builder: &mut Builder, open: Vec<(Function, NodeId)>) {
    let open = open.into_iter().filter(|(_, when)| builder.as_constant(*when) != Some(false));
    builder.logic.open = open.map(|(of, when)| Open { of, when }).collect();
}

/// Encodes all steps together as one number, with a code for each reachable situation, if all reachable situations are known. For a chart with hierarchy, such a number
/// has fewer bits than separate codes of the groups. `name` is the base name of the bits. `None` if this saves nothing over the flip-flops of the steps.
///
/// A bit's D function is the sum, over the situations whose code sets the bit, of "the steps change to exactly this situation".
#[must_use]
pub fn flatten(
    logic: &Logic,
    name: &str,
    steps: &[FlopId],
    situations: &[Vec<bool>],
    tries: usize,
) -> Option<Logic> {
    let n_bits = situations.len().next_power_of_two().trailing_zeros();
    if situations.is_empty() || situations.len() > LARGEST || n_bits as usize >= steps.len() {
        return None;
    }
    // First a circuit with one flip-flop per situation; these form a group that is then coded like any other.
    let mut builder = Builder::default();
    builder.logic.name = logic.name.clone();
    builder.logic.inputs = logic.inputs.clone();
    let nothing = builder.constant(false);
    let coded: BTreeSet<FlopId> = steps.iter().copied().gather();
    let starts = |situation: &Vec<bool>| {
        steps.iter().zip(situation).all(|(&step, &is_active)| logic.flops[step].init == is_active)
    };
    let mut of_situations = Vec::new();
    let mut kept: BTreeMap<FlopId, FlopId> = BTreeMap::new();
    for (id, flop) in logic.flops.iter() {
        if !coded.contains(&id) {
            kept.insert(id, builder.logic.flops.push(Flop { next: nothing, ..flop.clone() }));
        } else if of_situations.is_empty() {
            for (at, situation) in situations.iter().enumerate() {
                of_situations.push(builder.logic.flops.push(Flop {
                    name: format!("{name}_{at}"),
                    init: starts(situation),
                    next: nothing,
                    holds: None,
                    meta: flop.meta.clone(),
                }));
            }
        }
    }
    if of_situations.iter().filter(|&&flop| builder.logic.flops[flop].init).count() != 1 {
        return None;
    }
    let mut active: BTreeMap<FlopId, NodeId> = BTreeMap::new();
    for (at, &step) in steps.iter().enumerate() {
        let where_active: Vec<NodeId> = (of_situations.iter().zip(situations))
            .filter(|(_, situation)| situation[at])
            .map(|(&flop, _)| builder.flop(flop))
            .collect();
        active.insert(step, builder.or(where_active));
    }
    let (images, mut open) = carry_over(&mut builder, logic, &kept, &active);
    let free = common(&mut builder, logic, steps, &images);
    open.extend(of_situations.iter().map(|flop| (Function::Next(*flop), free)));
    for (&flop, situation) in of_situations.iter().zip(situations) {
        let literals: Vec<NodeId> = (steps.iter().zip(situation))
            .map(|(&step, &is_active)| {
                let next = images[&logic.flops[step].next];
                if is_active { next } else { builder.not(next) }
            })
            .collect();
        let next = builder.and(literals);
        builder.logic.flops[flop].next = next;
    }
    for &step in steps {
        if let Some(holds) = logic.flops[step].holds {
            builder.logic.decoded.push(Decoded {
                name: logic.flops[step].name.clone(),
                holds,
                node: active[&step],
            });
        }
    }
    carry_outputs(&mut builder, logic, &images, open);
    builder.logic.never = logic.never.iter().map(|node| images[node]).collect();
    builder.logic.unreachable = logic.unreachable.iter().map(|node| images[node]).collect();
    let group = Group { name: name.to_owned(), steps: of_situations, is_always: true };
    let coded = recode(&builder.finish(), &[group], Encoding::Compact, tries);
    // A circuit with one or two situations may be unchanged.
    (coded.flops.len() < logic.flops.len()).then_some(coded)
}

/// Declares all situations of the steps except these as unreachable. Each situation has a value for each step, or `None` if the step may be active or inactive.
pub fn only(logic: &mut Logic, steps: &[FlopId], situations: &[Vec<Option<bool>>]) {
    let mut builder = Builder::resume(std::mem::take(logic));
    let mut products = Vec::new();
    for situation in situations {
        let literals: Vec<NodeId> = (steps.iter().zip(situation))
            .filter_map(|(&step, is_active)| Some((step, (*is_active)?)))
            .map(|(step, is_active)| {
                let value = builder.flop(step);
                let is_inverted =
                    builder.logic.flops[step].holds.is_some_and(|holds| holds.inverted);
                if is_active != is_inverted { value } else { builder.not(value) }
            })
            .collect();
        products.push(builder.and(literals));
    }
    let any = builder.or(products);
    let none = builder.not(any);
    *logic = builder.logic;
    logic.unreachable.push(none);
}

/// The circuit with every known unreachable state leading back to the power-up state, in one clock.
#[must_use]
pub fn safe(logic: Logic) -> Logic {
    let mut builder = Builder::resume(logic);
    let illegal = builder.or(builder.logic.unreachable.clone());
    let flops: Vec<FlopId> = builder.logic.flops.ids().collect();
    for flop in flops {
        let Flop { init, next, .. } = builder.logic.flops[flop];
        let start = builder.constant(init);
        builder.logic.flops[flop].next = builder.mux(illegal, start, next);
    }
    // Don't-cares of a legal state must not affect the way back from an illegal one.
    let legal = builder.not(illegal);
    for at in 0..builder.logic.open.len() {
        let when = builder.logic.open[at].when;
        builder.logic.open[at].when = builder.and([legal, when]);
    }
    prune(builder.logic)
}

/// The size of the code space that [`is_safe`] checked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Codes {
    /// The number of flip-flops that the unreachable states depend on.
    pub n_flops: usize,
    /// The number of codes of these flip-flops that are never reached.
    pub illegal: u128,
}

/// Proves that a circuit that was read back leads each state in [`Logic::unreachable`] to the power-up state in one clock, for all inputs: over all
/// codes, as decision diagrams.
///
/// # Errors
/// Returns a sentence that names a flip-flop that does not return, or reports that the diagrams are too large.
pub fn is_safe(logic: &Logic) -> Result<Codes, String> {
    let mut bdd = Bdd::with_limit(1 << 22);
    let mut functions = Functions::new();
    for flop in logic.flops.ids() {
        functions.flop_level(flop);
    }
    let full = |_| {
        "cannot prove that every illegal situation leads to the initial one: the decision diagrams are too large"
            .to_owned()
    };
    let mut illegal = Ref::FALSE;
    for &node in &logic.unreachable {
        let node = functions.build(&mut bdd, logic, node).map_err(full)?;
        illegal = bdd.or(illegal, node).map_err(full)?;
    }
    for flop in logic.flops.values() {
        let next = functions.build(&mut bdd, logic, flop.next).map_err(full)?;
        let wrong = if flop.init { bdd.not(next).map_err(full)? } else { next };
        if bdd.and(illegal, wrong).map_err(full)? != Ref::FALSE {
            return Err(format!(
                "`{}` does not return to its initial value from every illegal situation",
                flop.name
            ));
        }
    }
    let levels = bdd.support(illegal);
    Ok(Codes { n_flops: levels.len(), illegal: bdd.sat_count(illegal, &levels) })
}

/// Copies the decoded bits and unreachable states of the written circuit to one that was read back. The flip-flops of both circuits are in the same order.
pub fn observe(written: &Logic, read_back: &mut Logic) {
    let mut builder = Builder::resume(std::mem::take(read_back));
    let wanted =
        written.decoded.iter().map(|bit| bit.node).chain(written.unreachable.iter().copied());
    let cone = needed(written, wanted);
    let mut images: BTreeMap<NodeId, NodeId> = BTreeMap::new();
    for (id, node) in written.nodes.iter().filter(|(id, _)| cone[*id]) {
        let image = builder.put(map_operands(node, |operand| images[&operand]));
        images.insert(id, image);
    }
    *read_back = builder.logic;
    read_back.decoded = written
        .decoded
        .iter()
        .map(|bit| Decoded { node: images[&bit.node], ..bit.clone() })
        .collect();
    read_back.unreachable = written.unreachable.iter().map(|node| images[node]).collect();
}

#[cfg(test)]
mod tests {
    use super::{Encoding, Group, Room, TRIES, is_safe, observe, recode, recode_within, safe};
    use crate::build::Builder;
    use crate::minimise::{Budget, Minimum, sum_between};
    use crate::sim::LogicSim;
    use grafsynth_ir::arena::Id;
    use grafsynth_ir::logic::{FlopBit, Logic, NodeId, PinOutput, PinRole};
    use grafsynth_ir::program::Origin;
    use grafsynth_ir::random::Random;

    /// A ring of steps, each left by its own input, as the encoding makes it; each step except the first has an output.
    fn ring(n: usize) -> (Logic, Group) {
        let mut builder = Builder::default();
        let steps: Vec<_> =
            (0..n).map(|k| builder.flop_named(&format!("p{}", k + 1), k == 0)).collect();
        let inputs: Vec<NodeId> =
            (0..n).map(|k| builder.input_named(&format!("i{}", k + 1))).collect();
        let fires: Vec<NodeId> = (0..n).map(|k| builder.and([steps[k].1, inputs[k]])).collect();
        for k in 0..n {
            let stays = builder.not(fires[k]);
            let hold = builder.and([steps[k].1, stays]);
            let flop = &mut builder.logic.flops[steps[k].0];
            flop.holds = Some(FlopBit {
                origin: Origin::Step(Id::from_index(k)),
                element: 0,
                bit: 0,
                inverted: false,
            });
            let next = builder.or([fires[(k + n - 1) % n], hold]);
            builder.logic.flops[steps[k].0].next = next;
        }
        for (k, step) in steps.iter().enumerate().skip(1) {
            builder.logic.outputs.push(PinOutput {
                name: format!("o{}", k + 1),
                role: PinRole::Unknown,
                value: step.1,
                registered: None,
                mealy: false,
                meta: Default::default(),
            });
        }
        let group = Group {
            name: "truck".into(),
            steps: steps.iter().map(|step| step.0).collect(),
            is_always: true,
        };
        (builder.finish(), group)
    }

    /// Checks that both show the same pins and steps in a long random walk.
    fn walks_alike(one_hot: &Logic, coded: &Logic) {
        let (mut a, mut b) = (LogicSim::new(one_hot), LogicSim::new(coded));
        let mut random = Random::new(1);
        for _ in 0..300 {
            for pin in one_hot.inputs.ids() {
                let state = random.bits();
                a.set_input(pin, state);
                b.set_input(pin, state);
            }
            for output in one_hot.outputs.ids() {
                assert_eq!(a.output(output), b.output(output));
            }
            for (id, flop) in one_hot.flops.iter() {
                let held = coded.flops.iter().find(|(_, other)| other.holds == flop.holds);
                let seen = match held {
                    Some((own, _)) => b.flop(own),
                    None => {
                        let bit = coded.decoded.iter().find(|bit| Some(bit.holds) == flop.holds);
                        b.node(bit.expect("a step is held or decoded").node)
                    }
                };
                assert_eq!(a.flop(id), seen, "{}", flop.name);
            }
            a.clock();
            b.clock();
        }
    }

    fn least(logic: &Logic, node: NodeId, negated: bool) -> usize {
        let (sum, minimum) =
            sum_between(logic, node, negated, &logic.unreachable, Budget::default()).unwrap();
        assert_eq!(minimum, Minimum::Exact);
        sum.len()
    }

    #[test]
    fn the_truck_in_every_code() {
        let (logic, group) = ring(4);
        let one_hot = recode(&logic, std::slice::from_ref(&group), Encoding::OneHot, TRIES);
        let forms: Vec<(usize, usize)> = one_hot
            .flops
            .values()
            .map(|flop| (least(&one_hot, flop.next, false), least(&one_hot, flop.next, true)))
            .collect();
        // Two products each without inversion; with the first one inverted, as a 22V10 needs it, three.
        assert!(forms.iter().all(|form| form.0 == 2), "{forms:?}");
        assert_eq!(forms[0].1, 3);
        let zero_hot = recode(&logic, std::slice::from_ref(&group), Encoding::ZeroHot, TRIES);
        assert_eq!((zero_hot.flops.len(), zero_hot.decoded.len()), (3, 1));
        assert!(zero_hot.flops.values().all(|flop| least(&zero_hot, flop.next, false) <= 2));
        walks_alike(&logic, &zero_hot);
        let compact = recode(&logic, std::slice::from_ref(&group), Encoding::Compact, TRIES);
        assert_eq!((compact.flops.len(), compact.decoded.len()), (2, 4));
        walks_alike(&logic, &compact);
    }

    /// Two rings that move together have as many situations as one ring, so they need no more bits than one.
    #[test]
    fn situations_of_all_steps_are_one_number() {
        let (one, _) = ring(4);
        let mut builder = Builder::resume(one);
        for k in 0..4 {
            let twin = &builder.logic.flops[Id::from_index(k)];
            let mut twin = twin.clone();
            twin.name = format!("q{}", k + 1);
            twin.holds = twin
                .holds
                .map(|holds| FlopBit { origin: Origin::Step(Id::from_index(k + 4)), ..holds });
            builder.logic.flops.push(twin);
        }
        let logic = builder.finish();
        let steps: Vec<_> = logic.flops.ids().collect();
        let situations: Vec<Vec<bool>> =
            (0..4).map(|at| (0..8).map(|step| step % 4 == at).collect()).collect();
        let coded = super::flatten(&logic, "all", &steps, &situations, 8).unwrap();
        assert_eq!((coded.flops.len(), coded.decoded.len()), (2, 8));
        walks_alike(&logic, &coded);
    }

    #[test]
    fn groups_of_all_sizes_walk_alike() {
        for n in 2..14 {
            let (logic, mut group) = ring(n);
            for encoding in [Encoding::ZeroHot, Encoding::Compact] {
                let coded = recode(&logic, std::slice::from_ref(&group), encoding, 8);
                walks_alike(&logic, &coded);
                assert!(coded.flops.len() < n);
            }
            // If only mutual exclusion is known of a group, it has a code for no active step.
            group.is_always = false;
            walks_alike(
                &logic,
                &recode(&logic, std::slice::from_ref(&group), Encoding::Compact, 8),
            );
        }
    }

    /// A search for a device finds codes whose sums have a macrocell each, with more flip-flops if there is room; or it finds nothing.
    #[test]
    fn codes_are_sought_for_the_macrocells_there_are() {
        let (logic, group) = ring(13);
        let groups = std::slice::from_ref(&group);
        let widths = |logic: &Logic| -> Vec<usize> {
            let flops = logic.flops.values().map(|flop| least(logic, flop.next, flop.init));
            let outputs = logic.outputs.values().map(|output| {
                least(logic, output.value, false).min(least(logic, output.value, true))
            });
            flops.chain(outputs).collect()
        };
        // Twelve outputs of one product each, and four to seven flip-flops.
        let mut found = Vec::new();
        for most in [3, 6, 12] {
            let mut terms = vec![1; 12];
            terms.extend([most; 4]);
            let room = Room { terms: terms.clone(), is_by_power_up: true };
            let Some(coded) = recode_within(&logic, groups, &room, 100, &mut { usize::MAX }) else {
                continue;
            };
            walks_alike(&logic, &coded);
            let mut sums = widths(&coded);
            sums.sort_unstable_by(|a, b| b.cmp(a));
            terms.sort_unstable_by(|a, b| b.cmp(a));
            assert!(sums.iter().zip(&terms).all(|(sum, terms)| sum <= terms), "{sums:?}");
            found.push(most);
        }
        assert!(!found.contains(&3) && found.contains(&12), "{found:?}");
        let room = Room { terms: vec![64; 15], is_by_power_up: true };
        assert_eq!(
            recode_within(&logic, groups, &room, 300, &mut { usize::MAX }),
            None,
            "a macrocell too few"
        );
    }

    #[test]
    fn every_illegal_code_returns_if_asked_and_not_otherwise() {
        let (logic, group) = ring(5);
        for encoding in [Encoding::OneHot, Encoding::ZeroHot, Encoding::Compact] {
            let coded = recode(&logic, std::slice::from_ref(&group), encoding, 8);
            let made = safe(coded.clone());
            walks_alike(&logic, &made);
            let codes = is_safe(&made).unwrap();
            assert_eq!(codes.illegal, (1 << coded.flops.len()) - 5);
            assert!(is_safe(&coded).is_err(), "{encoding:?}");
            // A circuit read back from a text has no such information; once `observe` has added it, the circuit is judged in the
            // same way.
            let mut stranger = made.clone();
            (stranger.decoded, stranger.unreachable) = (Vec::new(), Vec::new());
            observe(&made, &mut stranger);
            assert_eq!(is_safe(&stranger), Ok(codes));
        }
    }
}
