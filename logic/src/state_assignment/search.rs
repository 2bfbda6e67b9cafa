//! Searches for a good assignment of codes to steps.
//!
//! Steps that follow each other, or that occur together in a function, should have codes that differ in few bits: an embedding weights these pairs
//! and is improved by exchanges. Then exchanges are judged by the sums themselves: by the widest sum and the total ([`better`]), or by whether they
//! fit in the macrocells of a device ([`within`]). Every search is a fixed number of judgements in a fixed order, so it ends and is reproducible.

use super::{Plan, apply};
use crate::build::needed;
use crate::minimise::{Budget, sum_between};
use grafsynth_ir::Gather;
use grafsynth_ir::logic::{FlopId, Function, Logic, Node, NodeId};
use std::collections::BTreeMap;

/// The macrocells of a device that are available for the search.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Room {
    /// The product terms of each macrocell that is available for flip-flops and outputs.
    pub terms: Vec<usize>,
    /// True if the initial value of a flip-flop fixes the polarity of its sum, because the device powers up all flip-flops at 0.
    pub is_by_power_up: bool,
}

impl Room {
    /// The number of products of these sums that do not fit, if the widest sum takes the widest macrocell, and so on.
    fn overflow(&self, sums: &mut [usize]) -> usize {
        let mut terms = self.terms.clone();
        terms.sort_unstable_by(|a, b| b.cmp(a));
        sums.sort_unstable_by(|a, b| b.cmp(a));
        let place = |at: usize| terms.get(at).copied().unwrap_or(0);
        sums.iter().enumerate().map(|(at, sum)| sum.saturating_sub(place(at))).sum()
    }
}

/// Deterministic pseudo-random numbers.
struct Prng(u64);

impl Prng {
    fn new() -> Self {
        Prng(0x9E37_79B9_7F4A_7C15)
    }

    fn below(&mut self, n: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % n.max(1) as u64) as usize
    }
}

/// Exchanges the codes of two members, or gives one an unused code. `None` if nothing changes.
fn exchange(plan: &Plan, dice: &mut Prng) -> Option<Plan> {
    let (a, b) = (dice.below(plan.members.len()), dice.below(1 << plan.n_bits) as u64);
    if plan.idle == Some(b) || plan.codes[a] == b {
        return None;
    }
    let mut changed = plan.clone();
    let before = changed.codes[a];
    if let Some(other) = changed.codes.iter().position(|code| *code == b) {
        changed.codes[other] = before;
    }
    changed.codes[a] = b;
    Some(changed)
}

/// The start of a search for a device.
#[derive(Debug, Clone, Copy)]
enum Start {
    /// Similar codes for neighbouring steps.
    Embedded,
    /// The steps sorted by their names, numbers in names by value: the designer may have numbered the states in a good order for coding.
    ByName,
}

/// Searches for codes whose sums fit in a device, within the given number of judgements: from each start and with each number of bits that the device
/// has flip-flops for. The search accepts slightly worse moves, but fewer and fewer of them.
pub(super) fn within(
    logic: &Logic,
    plans: Vec<Plan>,
    room: &Room,
    tries: usize,
    work: &mut usize,
) -> Option<Vec<Plan>> {
    let largest = (0..plans.len()).max_by_key(|at| plans[*at].members.len())?;
    let n_coded: usize = plans.iter().map(|plan| plan.members.len()).sum();
    let n_bits: usize = plans.iter().map(|plan| plan.n_bits as usize).sum();
    let n_cells = logic.flops.len() - n_coded + logic.outputs.len() + n_bits;
    let n_spare = room.terms.len().checked_sub(n_cells)?;
    let mut searches = Vec::new();
    for more in 0..=n_spare.min(3) {
        for start in [Start::Embedded, Start::ByName] {
            let mut plans = plans.clone();
            let plan = &mut plans[largest];
            if plan.n_bits as usize + more >= plan.members.len() {
                continue;
            }
            plan.n_bits += u32::try_from(more).unwrap_or(0);
            plan.keeps.resize(plan.n_bits as usize, None);
            for plan in &mut plans {
                match start {
                    Start::Embedded => embed(logic, plan),
                    Start::ByName => by_name(logic, plan),
                }
            }
            searches.push(plans);
        }
    }
    let n_searches = searches.len().max(1);
    let share = tries / n_searches;
    searches.into_iter().find_map(|plans| settle(logic, plans, room, share, work))
}

/// One search of [`within`], which ends after the given number of judgements, or when the work budget is used up.
fn settle(
    logic: &Logic,
    mut plans: Vec<Plan>,
    room: &Room,
    tries: usize,
    work: &mut usize,
) -> Option<Vec<Plan>> {
    let mut now = misfit(&apply(logic, &plans), room);
    if now.0 * 2 > room.terms.iter().sum() {
        // Exchanges can save something, but not half of the products.
        return None;
    }
    let mut dice = Prng::new();
    for at in 0..tries {
        if now.0 == 0 {
            return Some(plans);
        }
        *work = work.saturating_sub(now.2);
        if *work == 0 {
            break;
        }
        let which = dice.below(plans.len());
        let Some(changed) = exchange(&plans[which], &mut dice) else { continue };
        let kept = std::mem::replace(&mut plans[which], changed);
        let then = misfit(&apply(logic, &plans), room);
        // The loss that a move may cause: a tenth at first, nothing in the last third.
        let slack = (now.1 / 10) * (2 * tries).saturating_sub(3 * at) / (2 * tries);
        if then.0 == 0 || then.1 <= now.1 + slack {
            now = then;
        } else {
            plans[which] = kept;
        }
    }
    (now.0 == 0).then_some(plans)
}

/// The products that do not fit, the cost that guides the search (these products, weighted, plus all products), and an estimate of the work.
fn misfit(logic: &Logic, room: &Room) -> (usize, usize, usize) {
    let mut sums = Vec::new();
    for (id, flop) in logic.flops.iter() {
        let fixed = room.is_by_power_up.then_some(flop.init);
        sums.push(shortest(logic, flop.next, Function::Next(id), fixed));
    }
    for (id, output) in logic.outputs.iter() {
        let fixed = output.registered.filter(|_| room.is_by_power_up);
        sums.push(shortest(logic, output.value, Function::Output(id), fixed));
    }
    // A function without a sum of acceptable size certainly does not fit.
    let of_one =
        |sum: &Option<(usize, usize)>| sum.map_or(TOO_WIDE_WORK, |(products, all)| products * all);
    let work = logic.nodes.len() + sums.iter().map(of_one).sum::<usize>();
    let mut sizes: Vec<usize> =
        sums.into_iter().map(|sum| sum.map_or(MOST, |(products, _)| products)).collect();
    let total: usize = sizes.iter().sum();
    let overflow = room.overflow(&mut sizes);
    (overflow, overflow * 8 + total, work)
}

/// Sums of more products than this are not computed.
const MOST: usize = 64;

/// Products and literals of a function's sum in this polarity, or in the better one. `None` if it is too wide.
fn shortest(
    logic: &Logic,
    node: NodeId,
    function: Function,
    is_complemented: Option<bool>,
) -> Option<(usize, usize)> {
    let budget = Budget { products: MOST, nodes: 1 << 14, exact: None };
    let dont_cares: Vec<NodeId> = (logic.never.iter().chain(&logic.unreachable).copied())
        .chain(logic.open_where(function))
        .collect();
    let sum = |negated: bool| {
        let (sum, _) = sum_between(logic, node, negated, &dont_cares, budget).ok()?;
        Some((sum.len(), sum.iter().map(Vec::len).sum::<usize>()))
    };
    match is_complemented {
        Some(negated) => sum(negated),
        None => [false, true].into_iter().filter_map(sum).min(),
    }
}

/// Codes in the order of the names.
fn by_name(logic: &Logic, plan: &mut Plan) {
    let mut order: Vec<usize> = (0..plan.members.len()).collect();
    order.sort_by_key(|member| natural(&logic.flops[plan.members[*member]].name));
    let mut code = 0;
    for member in order {
        if plan.idle == Some(code) {
            code += 1;
        }
        plan.codes[member] = code;
        code += 1;
    }
}

/// A name as alternating text and numbers.
fn natural(name: &str) -> Vec<(String, u64)> {
    let mut parts: Vec<(String, u64)> = vec![Default::default()];
    let mut is_number = false;
    for letter in name.chars() {
        if let Some(digit) = letter.to_digit(10) {
            if let Some((_, number)) = parts.last_mut() {
                *number = number.saturating_mul(10).saturating_add(digit.into());
            }
            is_number = true;
            continue;
        }
        if std::mem::take(&mut is_number) {
            parts.push(Default::default());
        }
        if let Some((text, _)) = parts.last_mut() {
            text.push(letter);
        }
    }
    parts
}

/// Searches for codes: first similar codes of neighbouring steps, then short sums.
pub(super) fn better(logic: &Logic, mut plans: Vec<Plan>, tries: usize) -> Vec<Plan> {
    for plan in &mut plans {
        embed(logic, plan);
    }
    let tries = if logic.nodes.len() > 4_000 { 0 } else { tries };
    let mut best = (tries > 0).then(|| cost(&apply(logic, &plans)));
    let mut dice = Prng::new();
    let mut work = 0;
    for _ in 1..tries {
        work += best.map_or(0, work_of);
        if work > MOST_WORK {
            break;
        }
        let at = dice.below(plans.len());
        let Some(changed) = exchange(&plans[at], &mut dice) else { continue };
        let kept = std::mem::replace(&mut plans[at], changed);
        let now = Some(cost(&apply(logic, &plans)));
        if now <= best {
            best = now;
        } else {
            plans[at] = kept;
        }
    }
    plans
}

/// The work limit of a search, in units of [`work_of`]: a few seconds, which only circuits with sums far too wide for a device reach.
const MOST_WORK: usize = 6_000_000;

/// An estimate of the work to find sums of this cost: each product is tried without each literal.
fn work_of((too_wide, widest, _, literals): (usize, usize, usize, usize)) -> usize {
    let of_one = |products: usize, literals: usize| products.saturating_mul(literals);
    of_one(widest, literals).saturating_add(of_one(too_wide, TOO_WIDE_WORK))
}

/// The work of a sum that was abandoned.
const TOO_WIDE_WORK: usize = MOST * MOST * 8;

/// The cost of the sums of a circuit: the number of sums that are too wide, the width of the widest, all products, literals.
fn cost(logic: &Logic) -> (usize, usize, usize, usize) {
    let mut total = (0, 0, 0, 0);
    let flops = logic.flops.iter().map(|(id, flop)| (flop.next, Function::Next(id)));
    let outputs = logic.outputs.iter().map(|(id, output)| (output.value, Function::Output(id)));
    for (node, function) in flops.chain(outputs) {
        match shortest(logic, node, function, None) {
            Some((products, literals)) => {
                total.1 = total.1.max(products);
                total.2 += products;
                total.3 += literals;
            }
            None => total.0 += 1,
        }
    }
    total
}

/// Gives neighbouring steps similar codes; the weight of two steps is how often they occur together in a function.
fn embed(logic: &Logic, plan: &mut Plan) {
    let place: BTreeMap<FlopId, usize> =
        plan.members.iter().enumerate().map(|(at, flop)| (*flop, at)).gather();
    let n = plan.members.len();
    let mut weight = vec![vec![0_u64; n]; n];
    let mut together = |nodes: &[NodeId], own: Option<usize>| {
        let cone = needed(logic, nodes.iter().copied());
        let read: Vec<usize> = cone
            .iter()
            .filter(|(_, needed)| **needed)
            .filter_map(|(id, _)| match logic.nodes[id] {
                Node::Flop(flop) => place.get(&flop).copied(),
                _ => None,
            })
            .collect();
        if read.len() > 8 {
            return;
        }
        for (at, &a) in read.iter().enumerate() {
            for &b in read[at + 1..].iter().chain(&own) {
                if a != b {
                    // A step and its predecessor weigh more than two steps that are only read together.
                    let more = if own == Some(a) || own == Some(b) { 3 } else { 1 };
                    weight[a][b] += more;
                    weight[b][a] += more;
                }
            }
        }
    };
    for (at, member) in plan.members.iter().enumerate() {
        together(&[logic.flops[*member].next], Some(at));
    }
    for output in logic.outputs.values() {
        together(&[output.value], None);
    }
    let distance = |codes: &[u64], a: usize, at: u64| -> u64 {
        (0..n)
            .filter(|&b| b != a)
            .map(|b| weight[a][b] * u64::from((codes[b] ^ at).count_ones()))
            .sum()
    };
    for _ in 0..n.min(40) {
        let mut is_better = false;
        for a in 0..n {
            for code in 0..1_u64 << plan.n_bits {
                if plan.codes[a] == code || plan.idle == Some(code) {
                    continue;
                }
                let other = plan.codes.iter().position(|known| *known == code);
                let mut codes = plan.codes.clone();
                codes[a] = code;
                if let Some(other) = other {
                    codes[other] = plan.codes[a];
                }
                let of = |codes: &[u64]| {
                    distance(codes, a, codes[a])
                        + other.map_or(0, |other| distance(codes, other, codes[other]))
                };
                if of(&codes) < of(&plan.codes) {
                    plan.codes = codes;
                    is_better = true;
                }
            }
        }
        if !is_better {
            break;
        }
    }
}
