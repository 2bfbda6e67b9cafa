//! The reachable situations of a net with too many states to enumerate: a decision diagram of the reachable states, computed by images of the
//! reaction as [`super`] encodes it.
//!
//! The encoded reaction covers at most one tick. Here any number of ticks may pass: `dt` is one more input, as wide as the longest time that the net
//! compares or waits for (beyond its cap no counter distinguishes one `dt` from the next).

use grafsynth_ir::Gather;
use grafsynth_ir::ranks::sort_by_rank;
use std::collections::{BTreeMap, BTreeSet};

use grafsynth_ir::facts::Facts;
use grafsynth_ir::net::{
    Evolution, Expr, InputKind, Leaf, Net, PropertyExpr, StepId, TransitionId,
};
use grafsynth_ir::program::Origin;
use grafsynth_logic::bdd::{Bdd, Full, LimitExceeded, Ref};

use super::aig::Lit;
use super::image::{Machine, Part, after};
use super::number::Number;
use super::order::order;
use super::state::{Key, Shape};
use super::{Model, over_state};
use crate::limits::Limits;

/// The maximum number of micro-steps that are unrolled.
const DEPTH: u32 = 64;

/// The results of the diagram.
#[derive(Debug)]
pub(crate) struct Reached {
    machine: Machine,
    /// The reachable situations, as a function of the bits of the steps.
    situations: Ref,
    level_of: Vec<u32>,
    /// True if every counted situation is reachable.
    pub(crate) exact: bool,
    /// For each transition, true if it ever fires.
    pub(crate) fires: Vec<bool>,
    /// For each queried property, true if some row after the first violates it; `None` if the property cannot be expressed over state and inputs.
    pub(crate) breaks: Vec<Option<bool>>,
    /// For each queried pair, true if both transitions ever fire in one micro-step (of a reaction after the reset).
    pub(crate) pairs: Vec<bool>,
    /// The number of states; those that differ only in bits without effect on the queries count as one. `u64::MAX` means at least that many.
    pub(crate) states: u64,
    /// The largest number of micro-steps in a reaction, if none exceeds the limit of the net.
    pub(crate) depth: Option<u32>,
}

impl Reached {
    /// The number of situations; `u128::MAX` means at least that many.
    pub(crate) fn count(&self) -> u128 {
        let mut levels = self.level_of.clone();
        levels.sort_unstable();
        self.machine.bdd.sat_count(self.situations, &levels)
    }

    /// True if some situation contains all of these steps.
    pub(crate) fn together(&mut self, steps: &[StepId]) -> Result<bool, String> {
        let levels = steps.iter().map(|step| self.level_of[step.index()]);
        let cube = self.machine.bdd.cube(levels).map_err(full)?;
        self.machine.meet(self.situations, cube).map_err(full)
    }

    /// True if every situation contains one of these steps.
    pub(crate) fn always_one(&mut self, steps: &[StepId]) -> Result<bool, String> {
        let mut none = self.situations;
        for step in steps {
            let level = self.level_of[step.index()];
            let active = self.machine.bdd.var(level).map_err(full)?;
            none = self.machine.bdd.and_not(none, active).map_err(full)?;
        }
        Ok(none == Ref::FALSE)
    }
}

fn full(full: Full) -> String {
    full.to_string()
}

/// The reason why an attempt ended without an answer.
pub(super) enum Failed {
    /// A reaction takes more micro-steps than were unrolled.
    Deeper,
    Full(Full),
    Open(String),
}

impl From<Full> for Failed {
    fn from(full: Full) -> Self {
        Failed::Full(full)
    }
}

impl From<String> for Failed {
    fn from(why: String) -> Self {
        Failed::Open(why)
    }
}

/// All reachable situations of the net, for any `dt`. The error is the reason why they could not be computed.
///
/// `facts` gives the components, only for the order of variables. `never` contains the queried properties, and `pairs` the queried transitions.
pub(crate) fn reach(
    net: &Net,
    facts: &Facts,
    limits: &Limits,
    never: &[&PropertyExpr],
    pairs: &[(TransitionId, TransitionId)],
) -> Result<Reached, String> {
    let is_statechart = net.settings.policy.is_statechart();
    // The events of a row are over when the last check of a statechart is made.
    let reads_event = |expr: &Expr| {
        expr.leaves().filter_map(Leaf::input).any(|input| net.inputs[input].kind.is_event())
    };
    let never: Vec<Option<Expr>> = never
        .iter()
        .map(|one| over_state(net, one).filter(|expr| !is_statechart || !reads_event(expr)))
        .collect();
    let asked = Asked { never: &never, pairs };
    let limit = match net.settings.evolution {
        Evolution::Single => 1,
        Evolution::Stable { limit } => limit,
    };
    // Long evolutions are rare and unrolling is expensive, so few micro-steps are tried first.
    let mut work = limits.image_work;
    let mut depth = limit.min(4);
    loop {
        match attempt(net, facts, limits, &asked, depth, &mut work) {
            Ok(reached) => return Ok(reached),
            Err(Failed::Open(why)) => return Err(why),
            // Earlier attempts used their part of the work.
            Err(Failed::Full(Full { of: LimitExceeded::Work, .. })) => {
                let limit = limits.image_work;
                return Err(format!("the decision diagram needs more than {limit} steps of work"));
            }
            Err(Failed::Full(nodes)) => return Err(nodes.to_string()),
            Err(Failed::Deeper) if depth < limit.min(DEPTH) => {
                depth = (depth * 4).min(limit).min(DEPTH);
            }
            Err(Failed::Deeper) => {
                return Err(format!("a reaction may take more than {depth} micro-steps"));
            }
        }
    }
}

/// Queries in addition to reachability.
struct Asked<'a> {
    never: &'a [Option<Expr>],
    pairs: &'a [(TransitionId, TransitionId)],
}

/// Tries with `depth` micro-steps per reaction. Subtracts its work from `work`.
fn attempt(
    net: &Net,
    facts: &Facts,
    limits: &Limits,
    questions: &Asked<'_>,
    depth: u32,
    work: &mut u64,
) -> Result<Reached, Failed> {
    // Functions with more nodes as a graph are expected to need more as diagrams too.
    let graph_nodes = limits.circuit_nodes.min(limits.bdd_nodes);
    let limits = &Limits { circuit_nodes: graph_nodes, ..limits.clone() };
    let n_bits = net.steps.len() + net.inputs.len();
    if n_bits > limits.image_bits {
        return Err(too_many_bits(n_bits, limits));
    }
    super::reaction::refuse_open_cells(net)?;
    let mut model = Model::of(net, Some(depth), limits)?;
    let n_bits = model.state_bits.len() + model.input_bits.len();
    if n_bits > limits.image_bits {
        return Err(too_many_bits(n_bits, limits));
    }
    let time = any_time(&mut model);
    let Transition { initial, next, legal, overrun, more, fired, broken, is_row } =
        match net.settings.policy.is_statechart() {
            true => checks(&mut model, questions, limits)?,
            false => reactions(&mut model, questions)?,
        };
    let n_bits = model.state_bits.len() + model.input_bits.len();
    if n_bits > limits.image_bits {
        return Err(too_many_bits(n_bits, limits));
    }
    let too_large = || {
        let text = format!("the reaction has more than {graph_nodes} nodes");
        Failed::Open(text)
    };
    // The functions that give the length of a reaction, and those that give the transitions that fire in it.
    let mut asked = vec![is_row, overrun];
    asked.extend(&more);
    let n_more = asked.len();
    asked.extend(fired.iter().flatten());
    let n_fired = asked.len();
    asked.extend(broken);
    for (first, second) in questions.pairs {
        let mut together = Vec::new();
        for fired in &fired {
            together.push(model.aig().and(fired[first.index()], fired[second.index()]));
        }
        asked.push(model.aig().or_all(together));
    }
    // All functions in one list: next bits, conditions on inputs, queries.
    let mut roots: Vec<Lit> = next.values().copied().collect();
    roots.extend(&legal);
    roots.extend(&asked);
    let mut supports = model.maker.aig.supports(&roots, graph_nodes * 16).ok_or_else(too_large)?;
    let asked_supports = supports.split_off(next.len() + legal.len());
    let legal_supports = supports.split_off(next.len());
    let mut reads: BTreeMap<Key, Vec<Lit>> = next.keys().copied().zip(supports).gather();
    keep_what_matters(&model, &mut reads, asked_supports.iter().flatten());
    let mut input_lits: Vec<Lit> = model.input_bits.values().copied().collect();
    input_lits.extend(&time);
    let sequence = order(net, facts, &model.state_bits, &model.input_bits, &time, &reads);
    let level: BTreeMap<Lit, u32> =
        sequence.into_iter().zip((0..).map(|place: u32| 2 * place)).gather();
    roots.clear();
    roots.extend(reads.keys().map(|key| next[key]));
    let n_next = roots.len();
    roots.extend(&legal);
    let n_asked = roots.len();
    roots.extend(&asked);

    let mut bdd = Bdd::with_limit(limits.bdd_nodes);
    bdd.limit_work(*work);
    let functions = model
        .maker
        .aig
        .diagrams(&roots, graph_nodes, |lit| level[&lit], &mut bdd)?
        .ok_or_else(too_large)?;
    let mut parts = Vec::new();
    let levels_of = |lits: &Vec<Lit>| lits.iter().map(|lit| level[lit]).collect::<Vec<u32>>();
    let mut state_levels = Vec::new();
    for ((key, reads), function) in reads.iter().zip(&functions) {
        let own = level[&model.state_bits[key]];
        state_levels.push(own);
        let then = bdd.var(after(own))?;
        parts.push((own, Part { relation: bdd.iff(then, *function)?, reads: levels_of(reads) }));
    }
    for (condition, reads) in functions[n_next..n_asked].iter().zip(&legal_supports) {
        let reads = levels_of(reads);
        let first = reads.iter().min().copied().unwrap_or(0);
        parts.push((first, Part { relation: *condition, reads }));
    }
    sort_by_rank(&mut parts, |(first, _)| [u64::from(*first)]);
    let input_levels: Vec<u32> = input_lits.iter().map(|lit| level[lit]).collect();
    let possible = bdd.and_all(functions[n_next..n_asked].iter().copied())?;
    let mut kept = vec![possible];
    kept.extend(&functions[n_asked..]);
    let mut start = Ref::TRUE;
    let mut first_state: Vec<(u32, bool)> =
        reads.keys().map(|key| (level[&model.state_bits[key]], initial[key])).collect();
    first_state.sort_unstable();
    for (level, value) in first_state.into_iter().rev() {
        let (low, high) = if value { (Ref::FALSE, start) } else { (start, Ref::FALSE) };
        start = bdd.node(level, low, high)?;
    }
    let n_start = kept.len();
    kept.push(start);
    let parts = parts.into_iter().map(|(_, part)| part).collect();
    let mut machine = Machine::new(bdd, parts, &state_levels, &input_levels, kept)?;
    let start = machine.kept[n_start];
    machine.kept.truncate(n_start);

    let all = fixpoint(&mut machine, start);
    *work = work.saturating_sub(machine.bdd.work());
    let all = all?;

    let level_of: Vec<u32> =
        net.steps.ids().map(|step| level[&model.state_bits[&(Origin::Step(step), 0, 0)]]).collect();
    let others = state_levels.iter().copied().filter(|level| !level_of.contains(level));
    let others = machine.bdd.cube(others)?;
    // A state between two checks of a reaction is not a situation.
    let is_row = machine.kept[1];
    let rows = machine.bdd.and(all, is_row)?;
    let situations = machine.bdd.exists(rows, others)?;
    let mut happens = Vec::new();
    for at in 3..machine.kept.len() {
        let [possible, function] = [machine.kept[0], machine.kept[at]];
        let case = machine.bdd.and(possible, function)?;
        happens.push(machine.meet(all, case)?);
    }
    let broken = happens.split_off(n_fired - 2);
    let (more, fired) = happens.split_at(n_more - 2);
    let mut broken = broken.into_iter();
    let breaks =
        questions.never.iter().map(|one| one.as_ref().and_then(|_| broken.next())).collect();
    let pairs = broken.collect();
    state_levels.sort_unstable();
    let states = machine.bdd.sat_count(rows, &state_levels);
    let states = u64::try_from(states).unwrap_or(u64::MAX);
    let n_transitions = net.transitions.len();
    let fires = (0..n_transitions)
        .map(|transition| fired.iter().skip(transition).step_by(n_transitions).any(|ever| *ever))
        .collect();
    let depth = more.iter().position(|more| !more).map(|depth| depth as u32);
    let exact = model.n_passed_over == 0;
    Ok(Reached { machine, situations, level_of, exact, fires, breaks, pairs, states, depth })
}

/// The functions of one step of the machine whose states are computed: a whole reaction, or one check of a statechart.
struct Transition {
    /// The first state.
    initial: BTreeMap<Key, bool>,
    next: BTreeMap<Key, Lit>,
    /// The conditions on the inputs.
    legal: Vec<Lit>,
    /// True if the reaction is longer than unrolled.
    overrun: Lit,
    more: Vec<Lit>,
    fired: Vec<Vec<Lit>>,
    /// For each queried property that can be expressed, whether the step violates it.
    broken: Vec<Lit>,
    /// True if the state is that of a row.
    is_row: Lit,
}

/// One reaction in each step, of at most as many micro-steps as the model has.
fn reactions(model: &mut Model<'_>, questions: &Asked<'_>) -> Result<Transition, Failed> {
    let net = model.maker.net;
    let initial = initial(model)?;
    let (state, inputs) = (model.state.clone(), model.inputs.clone());
    let reaction = model.maker.reaction(&state, &inputs)?;
    let shape = model.maker.shape.clone();
    let next = shape.bits(net, model.aig(), &reaction.state);
    let legal = legal_inputs(model);
    let overrun = model.maker.overrun();
    let mut broken = Vec::new();
    for never in questions.never.iter().flatten() {
        broken.push(model.maker.forbidden(&reaction.state, &inputs, never));
    }
    let (more, fired) = (model.maker.more.clone(), model.maker.fired.clone());
    let is_row = Lit::TRUE;
    Ok(Transition { initial, next, legal, overrun, more, fired, broken, is_row })
}

/// One check of a statechart in each step.
fn checks(
    model: &mut Model<'_>,
    questions: &Asked<'_>,
    limits: &Limits,
) -> Result<Transition, Failed> {
    model.prove_structure(limits)?;
    let mut initial = initial(model)?;
    let never: Vec<&Expr> = questions.never.iter().flatten().collect();
    let step = model.step(&never)?;
    initial.extend(step.helpers.iter().map(|key| (*key, false)));
    // The inputs of a row matter in its first check only.
    let legal =
        legal_inputs(model).into_iter().map(|holds| model.aig().or(holds, !step.is_row)).collect();
    Ok(Transition {
        initial,
        next: step.next,
        legal,
        overrun: Lit::FALSE,
        more: Vec::new(),
        fired: vec![step.fired],
        broken: step.broken,
        is_row: step.is_row,
    })
}

/// Removes the state bits that no step depends on, directly or through other bits: values that are only counted, stored or output. `asked` contains the
/// variables of all other queries.
fn keep_what_matters<'l>(
    model: &Model<'_>,
    reads: &mut BTreeMap<Key, Vec<Lit>>,
    asked: impl Iterator<Item = &'l Lit>,
) {
    let mut matters: BTreeSet<Key> = BTreeSet::new();
    let mut todo: Vec<Key> =
        reads.keys().filter(|(origin, _, _)| matches!(origin, Origin::Step(_))).copied().collect();
    todo.extend(asked.filter_map(|lit| model.name_of.get(lit)));
    while let Some(key) = todo.pop() {
        if matters.insert(key)
            && let Some(lits) = reads.get(&key)
        {
            todo.extend(lits.iter().filter_map(|lit| model.name_of.get(lit)));
        }
    }
    reads.retain(|key, _| matters.contains(key));
}

fn too_many_bits(n_bits: usize, limits: &Limits) -> Failed {
    let limit = limits.image_bits;
    Failed::Open(format!(
        "state and inputs have {n_bits} bits, but the limit for a diagram is {limit}"
    ))
}

/// The smallest set that contains `start` and all successors of its members. `kept` contains the possible inputs, the condition that the
/// state is between reactions, and the condition that a reaction is longer than unrolled.
fn fixpoint(machine: &mut Machine, start: Ref) -> Result<Ref, Failed> {
    let mut all = start;
    let mut frontier = start;
    loop {
        [all, frontier] = machine.tidy([all, frontier]);
        let [possible, overrun] = [machine.kept[0], machine.kept[2]];
        let too_long = machine.bdd.and(possible, overrun)?;
        if machine.meet(frontier, too_long)? {
            return Err(Failed::Deeper);
        }
        let image = machine.image(frontier)?;
        let fresh = machine.bdd.and_not(image, all)?;
        if fresh == Ref::FALSE {
            return Ok(all);
        }
        all = machine.bdd.or(all, image)?;
        // Any set between the new states and all states is correct; the smaller diagram is cheaper.
        frontier = if machine.bdd.size(all) < machine.bdd.size(fresh) { all } else { fresh };
    }
}

/// Lets any number of ticks pass, if the net counts them. Returns the bits of that number.
pub(super) fn any_time(model: &mut Model<'_>) -> Vec<Lit> {
    let n_bits = 64 - longest_time(model.maker.net, &model.maker.shape).leading_zeros();
    let bits: Vec<Lit> = (0..n_bits).map(|_| model.aig().variable()).collect();
    model.inputs.tick = Lit::TRUE;
    model.inputs.dt = Some(Number::from_code(model.aig(), &bits, 0));
    bits
}

/// Beyond this many ticks all counters are at their caps; 0 if there are none.
pub(super) fn longest_time(net: &Net, shape: &Shape) -> i64 {
    let caps = [&shape.elapsed, &shape.last_elapsed, &shape.timers];
    let durations = shape.times.iter().map(|(id, _)| i64::from(net.actions[*id].duration));
    let delays = shape.chart.slots.iter().filter_map(|delay| *delay);
    let caps = caps.into_iter().flatten().filter_map(|cap| *cap);
    caps.chain(durations).chain(delays).max().unwrap_or(0)
}

/// The state after reset.
pub(super) fn initial(model: &mut Model<'_>) -> Result<BTreeMap<Key, bool>, Failed> {
    let reset = model.maker.reset()?;
    let shape = model.maker.shape.clone();
    let net = model.maker.net;
    let bits = shape.bits(net, model.aig(), &reset.state);
    bits.into_iter()
        .map(|(key, lit)| {
            let value = lit
                .as_constant()
                .ok_or_else(|| "the reset does not lead to a single state".to_owned())?;
            Ok((key, value))
        })
        .collect()
}

/// The conditions on the inputs in every row: valid codes, assumptions, exclusive events.
pub(super) fn legal_inputs(model: &mut Model<'_>) -> Vec<Lit> {
    let net = model.maker.net;
    let is_input: BTreeSet<Lit> = model.input_bits.values().copied().gather();
    let mut legal: Vec<Lit> = model
        .valid
        .iter()
        .filter(|(bits, _)| bits.iter().all(|bit| is_input.contains(bit)))
        .map(|(_, holds)| *holds)
        .collect();
    legal.extend(model.forbidden.iter().map(|(_, never)| !*never));
    for (id, input) in net.inputs.iter() {
        if input.kind == InputKind::InternalEvent {
            // No row contains it.
            legal.extend(model.input_bits.get(&(id.index() as u32, 0)).map(|bit| !*bit));
        }
    }
    let (mut seen, mut two) = (Lit::FALSE, Lit::FALSE);
    for event in model.events.clone() {
        let again = model.aig().and(seen, event);
        two = model.aig().or(two, again);
        seen = model.aig().or(seen, event);
    }
    if two != Lit::FALSE {
        legal.push(!two);
    }
    legal
}
