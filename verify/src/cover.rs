//! A cover by sequential components: sets of steps that contain one token.
//!
//! # Why a set of steps keeps its token
//! Let S be a set of steps with exactly one active at reset. It stays so if
//!
//! 1. every move removes as many steps from S as it adds to S, and this number is 0 or 1 (`|pre ∩ S| = |post ∩ S| ≤ 1`), and
//! 2. no two transitions that remove the same step of S and add different ones fire in one micro-step.
//!
//! If one step s of S is active, all transitions that affect S remove s; by 2 they agree on the step that they add; so X' (semantics §3.2) again
//! contains exactly one step of S. The *stays active* rule matters only for a step that is added while active, which here is s itself. Condition 2
//! depends on the conflict policy: if transitions compete for a step, only one of them fires; under `all`, their receptivities must exclude each other
//! ([`crate::exclusive`]). If 1 is weakened to `|post ∩ S| ≤ |pre ∩ S| ≤ 1`, at most one step remains active.
//!
//! Forcing and enclosing steps (semantics §8) set the situation of S directly; they keep the token if and only if each order, or the activation links, contain
//! exactly one step of S. Enclosed steps lose the token together with the enclosing step, so such a component is not always active.
//!
//! # How the sets are found
//! By reduction, in nearly linear time. At first each step is a separate *place*.
//! - *Series*: a transition with one place on each side merges the two places: every set that contains one must contain the other.
//! - *Parallel*: two places that the same transitions fill and empty always contain the same number of tokens; one of them is set aside.
//!   It is an equally good component.
//!
//! Nested forks, joins and choices reduce completely. In the rest, a search with a bounded amount of backtracking looks for the sets. Every returned
//! component satisfies the conditions above by construction. The branches that were set aside also give invariants that reach through forks and joins.

use grafsynth_ir::Gather;
use std::collections::{BTreeMap, BTreeSet, VecDeque};

use grafsynth_ir::arena::IdMap;
use grafsynth_ir::facts::{Component, Invariant, Proof};
use grafsynth_ir::net::{ForcingOrder, Net, Step, StepId, StepKind, TransitionKind};

use crate::exclusive;
use invariants::{Branch, derived};

mod invariants;

/// The maximum number of places of a set during the search, and the maximum number of backtracking steps.
const SEARCH_PLACES: usize = 4096;
const SEARCH_TURNS: usize = 256;

/// The result of [`cover`].
#[derive(Debug, Clone, Default)]
pub struct Cover {
    /// Disjoint components, ordered by their first step.
    pub components: Vec<Component>,
    /// Sets of which exactly one step is active: the components that are always active.
    pub invariants: Vec<Invariant>,
    /// More such sets: they share steps with components and reach through forks and joins.
    pub further: Vec<Invariant>,
    /// The component of each step.
    pub component_of: IdMap<Step, Option<u32>>,
}

/// Finds disjoint sequential components of any net from its structure alone.
#[must_use]
pub fn cover(net: &Net) -> Cover {
    if net.settings.policy.is_statechart() {
        return finish(net, regions(net), Vec::new());
    }
    let (found, more) = Reduction::of(net).run();
    finish(net, found, more)
}

/// Sets of steps that contain at most one token; true if the set always contains one.
type Found = Vec<(Vec<StepId>, bool)>;

fn finish(net: &Net, mut found: Found, more: Vec<Vec<StepId>>) -> Cover {
    for (steps, _) in &mut found {
        steps.sort_unstable();
    }
    found.retain(|(steps, _)| !steps.is_empty());
    found.sort_unstable();
    let mut component_of = IdMap::filled(&net.steps, None);
    let mut components = Vec::new();
    let mut invariants = Vec::new();
    for (steps, always) in found {
        let index = components.len() as u32;
        steps.iter().for_each(|step| component_of[*step] = Some(index));
        if always {
            invariants.push(Invariant { steps: steps.clone(), count: 1, by: Proof::Structural });
        }
        components.push(Component { steps, always, by: Proof::Structural });
    }
    let mut seen: BTreeSet<Vec<StepId>> = invariants.iter().map(|it| it.steps.clone()).gather();
    let fresh = more.into_iter().filter(|steps| seen.insert(steps.clone()));
    let further = fresh.map(|steps| Invariant { steps, count: 1, by: Proof::Structural });
    let further = further.collect();
    Cover { components, invariants, further, component_of }
}

/// For a statechart: the top-level states of a chart, and the children of each composite state. A transition replaces one by another (validation
/// ensures that every transition and initial content enters a complete configuration).
fn regions(net: &Net) -> Found {
    let mut always_active = IdMap::filled(&net.steps, false);
    let mut top: Vec<Vec<StepId>> = vec![Vec::new(); net.parts.len()];
    let mut children: IdMap<Step, Vec<StepId>> = IdMap::filled(&net.steps, Vec::new());
    for (id, step) in net.steps.iter() {
        match step.parent {
            Some(parent) => children[parent].push(id),
            None => top[step.part.index()].push(id),
        }
    }
    let mut found = Found::new();
    for states in top {
        if let [only] = states[..] {
            always_active[only] = true;
        }
        found.push((states, true));
    }
    // Parents are declared before their children.
    for (id, step) in net.steps.iter() {
        let inside = std::mem::take(&mut children[id]);
        match step.kind {
            StepKind::Parallel => {
                inside.iter().for_each(|child| always_active[*child] = always_active[id])
            }
            StepKind::Composite => {
                if let [only] = inside[..] {
                    always_active[only] = always_active[id];
                }
                found.push((inside, always_active[id]));
            }
            StepKind::Leaf | StepKind::Enclosing | StepKind::Final => {}
        }
    }
    // A region of a parallel state is active together with others, so it is a separate component: active exactly while its parent is.
    let covered: BTreeSet<StepId> =
        found.iter().flat_map(|(steps, _)| steps.iter().copied()).gather();
    for id in net.steps.ids().filter(|id| !covered.contains(id)) {
        found.push((vec![id], always_active[id]));
    }
    found
}

/// A set of steps that belong to the same component, if they belong to any.
#[derive(Debug, Clone, Default)]
struct Place {
    steps: Vec<StepId>,
    /// The enclosing step of all steps of the place.
    parent: Option<StepId>,
    /// True if the step with the same number as this place is active at reset.
    starts: bool,
    /// The number of steps of the place that are active at reset.
    n_initial: u32,
    /// The number of steps of the place that the enclosing step activates.
    n_links: u32,
    /// For each forcing order for the chart that contains these steps: the number of the order, and the number of these steps that it activates (`None` for
    /// `hold`).
    forced: Vec<(u32, Option<u32>)>,
    /// True if a token may get lost.
    is_lossy: bool,
    /// True if the place is excluded from all components.
    is_out: bool,
    /// Nontrivial transitions connected to the place; the list may include some that have become trivial.
    touching: Vec<u32>,
    /// The key of the place in the table for the parallel rule.
    signature: Option<Signature>,
}

/// The key of the parallel rule: places with equal keys always contain equally many tokens.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
struct Signature {
    moves: Vec<(u32, bool)>,
    parent: Option<StepId>,
    n_initial: u32,
    n_links: u32,
    forced: Vec<(u32, Option<u32>)>,
}

struct Reduction<'a> {
    net: &'a Net,
    places: Vec<Place>,
    /// Union-find over places.
    leader: Vec<u32>,
    /// For a place set aside by the parallel rule: the place that was kept.
    twin: Vec<Option<u32>>,
    /// The steps of both places when the parallel rule set one aside, by its number.
    branches: BTreeMap<u32, Branch>,
    moves: Vec<Move>,
    queue: VecDeque<u32>,
    /// Places whose signature may have changed.
    dirty: BTreeSet<u32>,
}

/// A transition between places.
#[derive(Debug, Clone, Default)]
struct Move {
    pre: Vec<u32>,
    post: Vec<u32>,
    is_trivial: bool,
}

impl<'a> Reduction<'a> {
    fn of(net: &'a Net) -> Self {
        let mut places: Vec<Place> = net
            .steps
            .iter()
            .map(|(id, step)| Place {
                steps: vec![id],
                parent: step.parent,
                n_links: u32::from(step.activation_link),
                ..Place::default()
            })
            .collect();
        for step in initial_situation(net) {
            places[step.index()].n_initial = 1;
            places[step.index()].starts = true;
        }
        // If two transitions that share a step both fire, they double the token.
        for overlap in exclusive::firing_together(net) {
            places[overlap.step.index()].is_out = true;
        }
        for (number, forcing) in net.forcings.iter().enumerate() {
            let mut is_target = vec![false; net.parts.len()];
            forcing.target.iter().for_each(|part| is_target[part.index()] = true);
            let named: Option<BTreeSet<StepId>> = match &forcing.order {
                ForcingOrder::Hold => None,
                ForcingOrder::Situation(steps) => {
                    Some(closure(net, steps.iter().copied()).into_iter().gather())
                }
            };
            for (id, _) in net.steps.iter().filter(|(_, step)| is_target[step.part.index()]) {
                let count = named.as_ref().map(|named| u32::from(named.contains(&id)));
                places[id.index()].forced.push((number as u32, count));
            }
        }
        let mut moves = Vec::new();
        for transition in
            net.transitions.values().filter(|transition| transition.kind == TransitionKind::Move)
        {
            let number = moves.len() as u32;
            let pre: Vec<u32> =
                transition.requires.iter().map(|step| step.index() as u32).collect();
            let post: Vec<u32> =
                exclusive::entered(transition).map(|step| step.index() as u32).collect();
            for place in pre.iter().chain(&post) {
                places[*place as usize].touching.push(number);
            }
            moves.push(Move { pre, post, is_trivial: false });
        }
        let n_places = places.len() as u32;
        Reduction {
            net,
            leader: (0..n_places).collect(),
            twin: vec![None; places.len()],
            branches: BTreeMap::new(),
            queue: (0..moves.len() as u32).collect(),
            dirty: (0..n_places).gather(),
            places,
            moves,
        }
    }

    fn find(&mut self, mut place: u32) -> u32 {
        while self.leader[place as usize] != place {
            let above = self.leader[place as usize];
            self.leader[place as usize] = self.leader[above as usize];
            place = self.leader[place as usize];
        }
        place
    }

    /// The components, and the sets with one token that are no components.
    fn run(mut self) -> (Found, Vec<Vec<StepId>>) {
        for place in 0..self.places.len() as u32 {
            if self.places[place as usize].is_out {
                self.exclude(place);
            }
        }
        loop {
            while let Some(number) = self.queue.pop_front() {
                self.reduce(number);
            }
            if !self.set_twins_aside() {
                break;
            }
        }
        self.components()
    }

    /// Processes one transition again: removes places that no longer exist, and applies the series rule.
    fn reduce(&mut self, number: u32) {
        let at = number as usize;
        if self.moves[at].is_trivial {
            return;
        }
        for side in 0..2 {
            let list = std::mem::take(if side == 0 {
                &mut self.moves[at].pre
            } else {
                &mut self.moves[at].post
            });
            let mut kept: Vec<u32> = list.into_iter().map(|place| self.find(place)).collect();
            kept.retain(|place| {
                !self.places[*place as usize].is_out && self.twin[*place as usize].is_none()
            });
            kept.sort_unstable();
            for pair in 1..kept.len() {
                // The transition takes two tokens from one place, or puts two into it.
                if kept[pair] == kept[pair - 1] {
                    self.exclude(kept[pair]);
                }
            }
            kept.dedup();
            *(if side == 0 { &mut self.moves[at].pre } else { &mut self.moves[at].post }) = kept;
        }
        // A place that was excluded on one side must also leave the opposite side.
        let places = &self.places;
        let Move { pre, post, .. } = &mut self.moves[at];
        pre.retain(|place| !places[*place as usize].is_out);
        post.retain(|place| !places[*place as usize].is_out);
        let Move { pre, post, .. } = self.moves[at].clone();
        match (&pre[..], &post[..]) {
            ([], []) => self.moves[at].is_trivial = true,
            // A token is created, so the number of tokens is unbounded.
            ([], _) => post.iter().for_each(|place| self.exclude(*place)),
            // A token is removed, so a set with this place may lose its token.
            (_, []) => pre.iter().for_each(|place| self.places[*place as usize].is_lossy = true),
            ([one], [other]) if one == other => {
                self.moves[at].is_trivial = true;
                self.dirty.insert(*one);
            }
            ([one], [other]) => {
                self.moves[at].is_trivial = true;
                self.join(*one, *other);
            }
            (_, _) => {}
        }
    }

    /// Excludes a place from all components, and removes it from all its transitions.
    fn exclude(&mut self, place: u32) {
        self.places[place as usize].is_out = true;
        let touching = std::mem::take(&mut self.places[place as usize].touching);
        self.queue.extend(touching);
    }

    fn join(&mut self, one: u32, other: u32) {
        let size = |place: u32| {
            self.places[place as usize].touching.len() + self.places[place as usize].steps.len()
        };
        let (into, from) = if size(one) >= size(other) { (one, other) } else { (other, one) };
        let starts = self.places[from as usize].starts;
        let small = std::mem::replace(
            &mut self.places[from as usize],
            Place { starts, ..Place::default() },
        );
        self.leader[from as usize] = into;
        self.dirty.insert(into);
        let big = &mut self.places[into as usize];
        let fits = big.parent == small.parent
            && big.forced.len() == small.forced.len()
            && big.forced.iter().zip(&small.forced).all(|(a, b)| a.0 == b.0);
        big.steps.extend(small.steps);
        big.n_initial += small.n_initial;
        big.n_links += small.n_links;
        big.is_lossy |= small.is_lossy;
        for (mine, theirs) in big.forced.iter_mut().zip(&small.forced) {
            mine.1 = mine.1.zip(theirs.1).map(|(a, b)| a + b);
        }
        // Only transitions of the smaller place can now be connected to both.
        self.queue.extend(small.touching.iter().copied());
        big.touching.extend(small.touching);
        if !fits {
            self.exclude(into);
        }
    }

    /// Applies the parallel rule to all places at once. Returns true if it applied somewhere.
    fn set_twins_aside(&mut self) -> bool {
        let mut noted: BTreeMap<Signature, u32> = BTreeMap::new();
        for place in 0..self.places.len() as u32 {
            if let Some(signature) = self.places[place as usize].signature.clone()
                && self.leader[place as usize] == place
                && self.twin[place as usize].is_none()
                && !self.dirty.contains(&place)
            {
                noted.insert(signature, place);
            }
        }
        let mut applied = false;
        for place in std::mem::take(&mut self.dirty) {
            let data = &self.places[place as usize];
            if self.leader[place as usize] != place
                || self.twin[place as usize].is_some()
                || data.is_out
            {
                continue;
            }
            let mut moves: Vec<(u32, bool)> = Vec::new();
            for number in &data.touching {
                let a_move = &self.moves[*number as usize];
                if a_move.is_trivial {
                    continue;
                }
                moves.extend(a_move.pre.contains(&place).then_some((*number, false)));
                moves.extend(a_move.post.contains(&place).then_some((*number, true)));
            }
            moves.sort_unstable();
            moves.dedup();
            // A place that every transition both empties and fills is a component by itself; setting it aside would hide that.
            if moves.chunk_by(|a, b| a.0 == b.0).all(|sides| sides.len() == 2) {
                continue;
            }
            let data = &mut self.places[place as usize];
            data.touching = moves.iter().map(|(number, _)| *number).collect();
            data.touching.dedup();
            let signature = Signature {
                moves,
                parent: data.parent,
                n_initial: data.n_initial,
                n_links: data.n_links,
                forced: data.forced.clone(),
            };
            data.signature = Some(signature.clone());
            match noted.get(&signature) {
                Some(stays) => {
                    self.twin[place as usize] = Some(*stays);
                    let steps = self.places[place as usize].steps.clone();
                    let like = self.places[*stays as usize].steps.clone();
                    self.branches.insert(place, Branch { steps, like });
                    applied = true;
                    let touching = self.places[place as usize].touching.clone();
                    self.queue.extend(touching);
                }
                None => {
                    noted.insert(signature, place);
                }
            }
        }
        applied
    }

    fn components(mut self) -> (Found, Vec<Vec<StepId>>) {
        let mut found = Found::new();
        // For each place in a set that always contains one token, the first such set.
        let mut always_one: BTreeMap<u32, Vec<StepId>> = BTreeMap::new();
        // Sets that share steps with an earlier component.
        let mut shared: Vec<Vec<StepId>> = Vec::new();
        // Places in a component: their twins are components too.
        let mut is_proved = vec![false; self.places.len()];
        let mut is_taken = vec![false; self.places.len()];
        let live: Vec<u32> = (0..self.places.len() as u32)
            .filter(|place| {
                let at = *place as usize;
                self.leader[at] == *place && self.twin[at].is_none() && !self.places[at].is_out
            })
            .collect();
        let mut turns = self.places.len() * 8 + 4096;
        for place in live {
            if is_taken[place as usize] {
                continue;
            }
            let Some((set, is_lossy)) = self.grow(place, &is_taken, &mut turns) else { continue };
            let Some(always) = self.token(&set, is_lossy) else { continue };
            let n_set = set.len();
            let all: Vec<StepId> = set
                .iter()
                .flat_map(|member| self.places[*member as usize].steps.iter().copied())
                .collect();
            if always {
                for member in &set {
                    always_one.entry(*member).or_insert_with(|| all.clone());
                }
            }
            let fresh: Vec<u32> =
                set.into_iter().filter(|member| !is_taken[*member as usize]).collect();
            let is_whole = fresh.len() == n_set;
            if always && !is_whole {
                shared.push(all);
            }
            let mut steps = Vec::new();
            for member in fresh {
                is_taken[member as usize] = true;
                is_proved[member as usize] = true;
                steps.extend(self.places[member as usize].steps.iter().copied());
            }
            found.push((steps, always && is_whole));
        }
        for place in 0..self.places.len() as u32 {
            if self.twin[place as usize].is_none() || self.places[place as usize].is_out {
                continue;
            }
            let mut stays = place;
            while let Some(other) = self.twin[stays as usize] {
                stays = self.find(other);
            }
            if is_proved[stays as usize] {
                found.push((self.places[place as usize].steps.clone(), false));
            }
        }
        let branches = std::mem::take(&mut self.branches);
        let branches = branches.into_iter().filter_map(|(place, branch)| {
            let stays = self.twin[place as usize]?;
            Some((place, (self.find(stays), branch)))
        });
        let branches = branches.gather();
        (found, derived(self.net, shared, &always_one, &branches))
    }

    /// `None` if the set may contain several tokens; otherwise, true if it always contains one.
    fn token(&self, set: &[u32], is_lossy: bool) -> Option<bool> {
        let places = || set.iter().map(|place| &self.places[*place as usize]);
        let parent = places().next()?.parent;
        if places().any(|place| place.parent != parent) {
            return None;
        }
        let n_initial: u32 = places().map(|place| place.n_initial).sum();
        let n_links: u32 = places().map(|place| place.n_links).sum();
        let mut always = n_initial == 1 && !is_lossy && !places().any(|place| place.is_lossy);
        if n_initial > 1 {
            return None;
        }
        if parent.is_some() {
            // The set contains at most one token, and only while the enclosing step is active.
            always = false;
            let parent_starts = parent.is_some_and(|parent| self.places[parent.index()].starts);
            if n_links > 1 || n_initial > 0 && !parent_starts {
                return None;
            }
        }
        let first = &places().next()?.forced;
        for (index, order) in first.iter().enumerate() {
            let mut sum = order.1.map(|_| 0);
            for place in places() {
                if place.forced.len() != first.len() || place.forced[index].0 != order.0 {
                    return None;
                }
                sum = sum.zip(place.forced[index].1).map(|(a, b)| a + b);
            }
            match sum {
                None | Some(1) => {}
                Some(0) => always = false,
                Some(_) => return None,
            }
        }
        if places().any(|place| place.forced.len() != first.len()) {
            return None;
        }
        // An enclosing step outside the set can clear only the steps that it encloses; `closure` has already closed forced situations downwards.
        Some(always)
    }

    /// Searches for a set, small ones first: adds places until every transition takes as many tokens from the set as it puts into it, or gives up. Also returns
    /// whether a token may be lost.
    fn grow(&self, start: u32, is_taken: &[bool], turns: &mut usize) -> Option<(Vec<u32>, bool)> {
        let mut set: Vec<u32> = vec![start];
        let mut inside: BTreeSet<u32> = [start].into_iter().gather();
        // For each decision: the size of the set before it, and the remaining alternatives.
        let mut decisions: Vec<(usize, usize, Vec<u32>)> = Vec::new();
        let mut n_turns = 0;
        let mut checked = 0;
        let mut is_lossy = false;
        let budget = (*turns).min(SEARCH_TURNS);
        'grow: loop {
            let mut dead_end = set.len() > SEARCH_PLACES;
            while checked < set.len() && !dead_end {
                let place = set[checked];
                let mut choice: Option<Vec<u32>> = None;
                for number in &self.places[place as usize].touching {
                    let a_move = &self.moves[*number as usize];
                    if a_move.is_trivial {
                        continue;
                    }
                    let taken = a_move.pre.iter().filter(|place| inside.contains(place)).count();
                    let put = a_move.post.iter().filter(|place| inside.contains(place)).count();
                    match (taken, put) {
                        (0, 0) | (1, 1) => {}
                        (1, 0) if a_move.post.is_empty() => is_lossy = true,
                        (1, 0) => choice = Some(self.ranked(place, &a_move.post, is_taken)),
                        (0, 1) => choice = Some(self.ranked(place, &a_move.pre, is_taken)),
                        (_, _) => dead_end = true,
                    }
                    if choice.is_some() || dead_end {
                        break;
                    }
                }
                match choice {
                    Some(mut options) if !dead_end => match options.pop() {
                        Some(next) => {
                            decisions.push((set.len(), checked, options));
                            set.push(next);
                            inside.insert(next);
                            // This place is processed again; the new place checks the earlier ones itself.
                        }
                        None => dead_end = true,
                    },
                    Some(_) | None if !dead_end => checked += 1,
                    Some(_) | None => {}
                }
                dead_end |= set.len() > SEARCH_PLACES;
            }
            if !dead_end {
                return Some((set, is_lossy));
            }
            loop {
                let (size, at, mut options) = decisions.pop()?;
                n_turns += 1;
                *turns = turns.saturating_sub(1);
                if n_turns > budget {
                    return None;
                }
                for gone in set.drain(size..) {
                    inside.remove(&gone);
                }
                checked = at.min(set.len());
                if let Some(next) = options.pop() {
                    decisions.push((size, at, options));
                    set.push(next);
                    inside.insert(next);
                    continue 'grow;
                }
            }
        }
    }

    /// Candidates, the best one last: not in another component, in the same part, close in declaration order.
    fn ranked(&self, from: u32, candidates: &[u32], is_taken: &[bool]) -> Vec<u32> {
        let first_step = |place: u32| self.places[place as usize].steps.first().copied();
        let part = |place: u32| first_step(place).map(|step| self.net.steps[step].part);
        let distance = |place: u32| {
            first_step(place)
                .zip(first_step(from))
                .map_or(0, |(a, b)| a.index().abs_diff(b.index()))
        };
        let mut options: Vec<u32> = candidates.to_vec();
        options.sort_by_key(|place| {
            std::cmp::Reverse((
                is_taken[*place as usize],
                part(*place) != part(from),
                distance(*place),
                *place,
            ))
        });
        options
    }
}

/// The steps that reset activates, before forcing.
#[must_use]
pub fn initial_situation(net: &Net) -> Vec<StepId> {
    closure(net, net.steps.iter().filter(|(_, step)| step.is_initial).map(|(id, _)| id))
}

/// Adds steps along activation links (semantics §2); the result is in declaration order.
#[must_use]
pub fn closure(net: &Net, steps: impl IntoIterator<Item = StepId>) -> Vec<StepId> {
    let mut is_in = IdMap::filled(&net.steps, false);
    for step in steps {
        is_in[step] = true;
    }
    // Parents are declared before their children, so one pass in order is enough.
    for (id, step) in net.steps.iter() {
        if let Some(parent) = step.parent
            && step.activation_link
            && is_in[parent]
            && net.steps[parent].kind == StepKind::Enclosing
        {
            is_in[id] = true;
        }
    }
    is_in.iter().filter(|(_, is_in)| **is_in).map(|(id, _)| id).collect()
}

#[cfg(test)]
mod tests;
