//! All pairs of states that two nets reach together, as decision diagrams, ring by ring from reset. The result is exact for any number of ticks, and a
//! difference comes with a shortest stimulus.

use grafsynth_ir::Gather;
use grafsynth_ir::ranks::sort_by_rank;
use std::collections::{BTreeMap, BTreeSet};

use grafsynth_logic::bdd::{Bdd, Full, LimitExceeded, Ref};
use indexmap::IndexMap;

use super::induction::Equalities;
use super::{Bit, Joint, Question, depths, why};
use crate::pair::RowPair;
use crate::symbolic::aig::Lit;
use crate::symbolic::image::{Machine, Part, after};
use crate::symbolic::order::order;
use crate::symbolic::reach::Failed;
use crate::symbolic::state::Key;

/// The result of a search.
pub(crate) enum Diagram {
    /// The nets are equal in all pairs of states that they reach together.
    Proved {
        /// The number of pairs; those that differ only in bits without effect on the compared columns count as one. `u64::MAX` means at least that many.
        states: u64,
    },
    /// The last of these rows shows a difference, and no shorter stimulus does.
    Apart(Vec<RowPair>),
    /// The search was abandoned, with the reason.
    Open(String),
}

/// The search, without state bits that are known to be equal or constant.
pub(crate) fn diagram(question: &Question<'_>, equal: &Equalities) -> Diagram {
    let mut work = question.limits.image_work;
    for depth in depths(question) {
        let joint = match Joint::of(question, depth) {
            Ok(joint) => joint,
            Err(failed) => return Diagram::Open(why(failed)),
        };
        match attempt(joint, equal, &mut work) {
            Ok(settled) => return settled,
            Err(Failed::Deeper) => {}
            // Earlier attempts used their part of the work.
            Err(Failed::Full(Full { of: LimitExceeded::Work, .. })) => {
                let limit = question.limits.image_work;
                return Diagram::Open(format!(
                    "the decision diagram of both designs needs more than {limit} steps of work"
                ));
            }
            Err(failed) => return Diagram::Open(why(failed)),
        }
    }
    Diagram::Open(why(Failed::Deeper))
}

/// Indices into [`Machine::kept`].
const POSSIBLE: usize = 0;
const OVERRUN: usize = 1;
const DIFFER: usize = 2;
const FIRST_NEXT: usize = 3;

fn attempt(joint: Joint<'_>, equal: &Equalities, work: &mut u64) -> Result<Diagram, Failed> {
    let mut joint = joint;
    let limits = joint.question.limits;
    let graph_nodes = limits.circuit_nodes.min(limits.bdd_nodes);
    let too_large = || Failed::Open(format!("both reactions have more than {graph_nodes} nodes"));
    if joint.bits.len() > limits.image_bits {
        let (n_bits, limit) = (joint.bits.len(), limits.image_bits);
        return Err(Failed::Open(format!(
            "both states have {n_bits} bits, but the limit for a diagram is {limit}"
        )));
    }
    // Only representatives remain.
    let kept: Vec<Bit> =
        joint.bits.iter().copied().filter(|bit| !equal.contains_key(&bit.lit)).collect();
    let differ = joint.differ.clone();
    let differ = joint.aig.or_all(differ);
    let mut roots: Vec<Lit> = vec![joint.overrun, differ];
    let n_legal = joint.legal.len();
    roots.extend(&joint.legal);
    roots.extend(kept.iter().map(|bit| bit.next));
    let roots = joint.aig.substitute(&roots, equal);
    let supports = joint.aig.supports(&roots, graph_nodes * 16).ok_or_else(too_large)?;
    let (legal, next) = roots[2..].split_at(n_legal);
    let (legal_supports, next_supports) = supports[2..].split_at(n_legal);
    let legal_supports = legal_supports.to_vec();
    // Bits that no query depends on, directly or through others, are omitted.
    let place: BTreeMap<Lit, usize> =
        kept.iter().enumerate().map(|(at, bit)| (bit.lit, at)).gather();
    let mut matters: BTreeSet<usize> = BTreeSet::new();
    let mut todo: Vec<usize> =
        supports[..2].iter().flatten().filter_map(|lit| place.get(lit).copied()).collect();
    while let Some(at) = todo.pop() {
        if matters.insert(at) {
            todo.extend(next_supports[at].iter().filter_map(|lit| place.get(lit)));
        }
    }
    let kept: Vec<(Bit, Lit, Vec<Lit>)> =
        matters.into_iter().map(|at| (kept[at], next[at], next_supports[at].clone())).collect();

    let sequence = sequence(&joint, equal);
    let level: IndexMap<Lit, u32> =
        sequence.into_iter().zip((0..).map(|place: u32| 2 * place)).collect();
    let mut functions: Vec<Lit> = vec![roots[0], roots[1]];
    functions.extend(legal);
    functions.extend(kept.iter().map(|(_, next, _)| *next));
    let mut bdd = Bdd::with_limit(limits.bdd_nodes);
    bdd.limit_work(*work);
    let functions = joint
        .aig
        .diagrams(&functions, graph_nodes, |lit| level[&lit], &mut bdd)?
        .ok_or_else(too_large)?;
    let (asked, rest) = functions.split_at(2);
    let (legal, next) = rest.split_at(n_legal);
    let levels_of = |lits: &[Lit]| lits.iter().map(|lit| level[lit]).collect::<Vec<u32>>();
    let mut parts = Vec::new();
    for (function, (bit, _, reads)) in next.iter().zip(&kept) {
        let own = level[&bit.lit];
        let then = bdd.var(after(own))?;
        parts.push((own, Part { relation: bdd.iff(then, *function)?, reads: levels_of(reads) }));
    }
    for (condition, reads) in legal.iter().zip(&legal_supports) {
        let reads = levels_of(reads);
        let first = reads.iter().min().copied().unwrap_or(0);
        parts.push((first, Part { relation: *condition, reads }));
    }
    sort_by_rank(&mut parts, |(first, _)| [u64::from(*first)]);
    let possible = bdd.and_all(legal.iter().copied())?;
    let mut first_state: Vec<(u32, bool)> =
        kept.iter().map(|(bit, _, _)| (level[&bit.lit], bit.first)).collect();
    first_state.sort_unstable();
    let start = cube(&mut bdd, &first_state)?;
    let mut functions = vec![possible, asked[0], asked[1]];
    functions.extend(next);
    functions.push(start);
    let state_levels: Vec<u32> = kept.iter().map(|(bit, _, _)| level[&bit.lit]).collect();
    let mut input_lits: Vec<Lit> =
        joint.inputs.iter().flat_map(|input| input.bits.iter().copied()).collect();
    input_lits.extend(&joint.time);
    let input_levels: Vec<u32> =
        input_lits.iter().filter_map(|lit| level.get(lit).copied()).collect();
    let parts = parts.into_iter().map(|(_, part)| part).collect();
    let machine = Machine::new(bdd, parts, &state_levels, &input_levels, functions)?;
    let mut search = Search { machine, state_levels, rings: FIRST_NEXT + kept.len() };
    let found = search.run();
    *work = work.saturating_sub(search.machine.bdd.work());
    match found? {
        Some(rows) => {
            let rows = rows.into_iter().map(|ones| {
                joint.row(|lit| level.get(&lit).is_some_and(|level| ones.contains(level)))
            });
            Ok(Diagram::Apart(rows.collect()))
        }
        None => Ok(Diagram::Proved { states: search.count() }),
    }
}

/// The conjunction of literals, by ascending levels.
fn cube(bdd: &mut Bdd, literals: &[(u32, bool)]) -> Result<Ref, Full> {
    let mut cube = Ref::TRUE;
    for (level, value) in literals.iter().rev() {
        let (low, high) = if *value { (Ref::FALSE, cube) } else { (cube, Ref::FALSE) };
        cube = bdd.node(*level, low, high)?;
    }
    Ok(cube)
}

/// The levels that are 1 in a row of inputs.
type Ones = BTreeSet<u32>;

struct Search {
    machine: Machine,
    state_levels: Vec<u32>,
    /// The index of the first ring in [`Machine::kept`]. Ring n contains the states at a distance of n rows from reset.
    rings: usize,
}

impl Search {
    /// The inputs of a shortest stimulus that shows a difference; `None` if there is none.
    fn run(&mut self) -> Result<Option<Vec<Ones>>, Failed> {
        let mut all = self.machine.kept[self.rings];
        let mut frontier = all;
        loop {
            [all, frontier] = self.machine.tidy([all, frontier]);
            let [possible, overrun] = [self.machine.kept[POSSIBLE], self.machine.kept[OVERRUN]];
            let too_long = self.machine.bdd.and(possible, overrun)?;
            if self.machine.meet(frontier, too_long)? {
                return Err(Failed::Deeper);
            }
            let differ = self.machine.kept[DIFFER];
            let apart = self.machine.bdd.and(possible, differ)?;
            let ring = self.machine.kept[self.machine.kept.len() - 1];
            let here = self.machine.bdd.and(ring, apart)?;
            if here != Ref::FALSE {
                return Ok(Some(self.way(here)?));
            }
            let image = self.machine.image(frontier)?;
            let fresh = self.machine.bdd.and_not(image, all)?;
            if fresh == Ref::FALSE {
                self.machine.kept.truncate(self.rings);
                self.machine.kept.push(all);
                return Ok(None);
            }
            self.machine.kept.push(fresh);
            all = self.machine.bdd.or(all, image)?;
            let is_smaller = self.machine.bdd.size(all) < self.machine.bdd.size(fresh);
            frontier = if is_smaller { all } else { fresh };
        }
    }

    /// A path from reset to a state and inputs of the last ring.
    fn way(&mut self, last: Ref) -> Result<Vec<Ones>, Failed> {
        let mut rows = Vec::new();
        let mut here = last;
        let mut ring = self.machine.kept.len() - 1;
        loop {
            let Some(choice) = self.machine.bdd.any_sat(here) else {
                return Err(Failed::Open(
                    "internal error: no path back to reset was found".to_owned(),
                ));
            };
            let ones: Ones =
                choice.into_iter().filter(|(_, value)| *value).map(|(level, _)| level).gather();
            rows.push(ones.clone());
            if ring == self.rings {
                rows.reverse();
                return Ok(rows);
            }
            ring -= 1;
            // The states of the previous ring from which one row leads here.
            let possible = self.machine.kept[POSSIBLE];
            let mut before = self.machine.bdd.and(self.machine.kept[ring], possible)?;
            for (at, level) in self.state_levels.iter().enumerate() {
                let next = self.machine.kept[FIRST_NEXT + at];
                before = if ones.contains(level) {
                    self.machine.bdd.and(before, next)?
                } else {
                    self.machine.bdd.and_not(before, next)?
                };
            }
            here = before;
        }
    }

    fn count(&self) -> u64 {
        let mut levels = self.state_levels.clone();
        levels.sort_unstable();
        let all = self.machine.kept[self.rings];
        u64::try_from(self.machine.bdd.sat_count(all, &levels)).unwrap_or(u64::MAX)
    }
}

/// The order of variables: that of the first net, with each of its bits followed by the bit of the second net with the same name. A bit without a
/// counterpart comes after its predecessor in its own net's order.
fn sequence(joint: &Joint<'_>, equal: &Equalities) -> Vec<Lit> {
    let own = |side: usize| -> Vec<Lit> {
        let model = &joint.models[side];
        let mut reads: BTreeMap<Key, Vec<Lit>> = BTreeMap::new();
        for (key, next) in &joint.next[side] {
            let support = joint.aig.support(&[*next], usize::MAX).unwrap_or_default();
            reads.insert(*key, support);
        }
        let facts = [joint.question.facts.0, joint.question.facts.1][side];
        order(model.maker.net, facts, &model.state_bits, &model.input_bits, &joint.time, &reads)
    };
    let (left, right) = (own(0), own(1));
    let twins = twins(joint);
    // By literal: its position among those of the first net, with a gap of one, so that a twin fits after it.
    let mut place: IndexMap<Lit, (usize, usize)> =
        left.iter().enumerate().map(|(at, lit)| (*lit, (at, 0))).collect();
    let mut behind = (0, 0);
    for (n, lit) in right.iter().enumerate() {
        if let Some(known) = place.get(lit) {
            behind = *known;
            continue;
        }
        let twin = equal.get(lit).or_else(|| twins.get(lit)).and_then(|twin| place.get(twin));
        let base = twin.copied().unwrap_or(behind);
        behind = (base.0, n + 1);
        place.insert(*lit, behind);
    }
    // Inputs that neither order contains: normally none, but they must be in the diagram.
    let mut lits: Vec<Lit> = place.keys().copied().collect();
    sort_by_rank(&mut lits, |lit| [place[lit].0 as u64, place[lit].1 as u64]);
    let missing: Vec<Lit> = joint
        .inputs
        .iter()
        .flat_map(|input| input.bits.iter().copied())
        .chain(joint.time.iter().copied())
        .filter(|lit| !place.contains_key(lit))
        .collect();
    lits.extend(missing);
    lits
}

/// For each bit of the second net, the bit of the first that has the same name.
fn twins(joint: &Joint<'_>) -> IndexMap<Lit, Lit> {
    let mut twins = IndexMap::new();
    let [left, right] = &joint.models;
    let mut names: BTreeMap<(String, u32, u32), Lit> = BTreeMap::new();
    for (key, lit) in &left.state_bits {
        names.insert((name(left.maker.net, key), key.1, key.2), *lit);
    }
    for (key, lit) in &right.state_bits {
        if let Some(twin) = names.get(&(name(right.maker.net, key), key.1, key.2)) {
            twins.insert(*lit, *twin);
        }
    }
    twins
}

/// The object that a bit belongs to, by name if it has one.
#[allow(
    clippy::wildcard_enum_match_arm,
    reason = "names only pair the variables of two nets; the result is proved"
)]
fn name(net: &grafsynth_ir::net::Net, key: &Key) -> String {
    use grafsynth_ir::program::Origin;
    let step = |step: &grafsynth_ir::net::StepId| net.steps[*step].name.text.as_str();
    match &key.0 {
        Origin::Step(id) => format!("step {}", step(id)),
        Origin::Elapsed(id) => format!("elapsed {}", step(id)),
        Origin::LastElapsed(id) => format!("last {}", step(id)),
        Origin::TaskIndex(id) => format!("task {}", step(id)),
        Origin::Older(a, b) => format!("older {} {}", step(a), step(b)),
        Origin::Var(id) => format!("var {}", net.vars[*id].name),
        Origin::Pending(id) => format!("pending {}", net.inputs[*id].name),
        _ => format!("{:?}", key.0),
    }
}
