//! The search itself [Bradley, SAT-based model checking without unrolling, VMCAI 2011; Eén, Mishchenko, Brayton, Efficient implementation of property
//! directed reachability, FMCAD 2011].
//!
//! Frame `k` contains every state that is reachable within `k` reactions, none of them bad. A frame is stored as the cubes that it excludes; a cube at
//! level `l` is excluded from the frames 1 to `l`. A state of the last frame from which a reaction is bad is an obligation: either the state is excluded
//! because no state of the previous frame leads to it, or a state that leads to it becomes an obligation for the previous frame. When two frames are equal,
//! they are an invariant.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::lift::{Lift, Lifted};
use super::solver::{Answer, FrameSolver};
use super::system::{Bit, Cube, System};
use crate::symbolic::aig::Lit;

/// If the functions for bad reactions have at most this number of nodes, every question contains them.
const SMALL: usize = 1_000;

/// Bounds on the work of one search.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bounds {
    /// The maximum number of conflicts in one question.
    pub(super) conflicts: u64,
    /// The maximum number of propagations and visited nodes.
    pub(super) work: u64,
}

/// The result of a search.
pub(super) enum Ended {
    /// No reachable state is in any of these cubes, and from the other states no reaction is bad.
    Proved(Vec<Cube>),
    /// A bad reaction is reachable.
    Refuted {
        /// The inputs that are 1, as nodes, of reactions from reset; the last one is bad.
        rows: Vec<Vec<usize>>,
        /// A lower bound on the number of reactions in any list that ends with a bad reaction.
        at_least: usize,
    },
    /// The bounds were reached.
    Spent,
}

/// The search reached its bounds.
struct Spent;

/// A set of states from which a reaction with these inputs leads into the set of the next obligation, or is bad.
struct Obligation {
    cube: Cube,
    inputs: Vec<usize>,
    then: Option<usize>,
}

/// An excluded cube, with its bits as a set of hashes for quick comparisons.
#[derive(Debug, Clone)]
struct Excluded {
    cube: Cube,
    hashes: u64,
}

impl Excluded {
    fn new(cube: Cube) -> Self {
        let hashes = hashes(&cube);
        Excluded { cube, hashes }
    }

    /// True if every state of the other cube is in this one.
    fn contains(&self, cube: &[Bit], hashes: u64) -> bool {
        self.hashes & !hashes == 0
            && self.cube.len() <= cube.len()
            && self.cube.iter().all(|bit| cube.binary_search(bit).is_ok())
    }
}

fn hashes(cube: &[Bit]) -> u64 {
    cube.iter().fold(0, |all, bit| all | 1 << ((bit.at * 2 + u32::from(bit.value)) % 64))
}

pub(super) struct Search<'s> {
    system: &'s System,
    bounds: Bounds,
    solvers: Vec<FrameSolver<'s>>,
    /// For each level, the cubes that are excluded up to it.
    excluded: Vec<Vec<Excluded>>,
    obligations: Vec<Obligation>,
    lift: Lift<'s>,
    /// For each bit and value, the number of excluded cubes that contained it.
    uses: Vec<[u32; 2]>,
    /// The frame of which no bad state is known yet.
    last: usize,
    /// True while states of the last frame may be bad.
    is_last_open: bool,
    /// The number of terms of the bad reactions that are excluded from the last frame.
    n_excluded: usize,
    /// The negated terms, if they are small: then reactions from all frames are restricted to those that are not bad, which settles properties that are
    /// inductive on their own.
    good: Vec<Lit>,
}

impl<'s> Search<'s> {
    pub(super) fn new(system: &'s System, bounds: Bounds) -> Self {
        let solvers = vec![FrameSolver::new(system, true), FrameSolver::new(system, false)];
        let is_small = system.aig.support(&system.bad, SMALL).is_some();
        let good = system.bad.iter().filter(|_| is_small).map(|bad| !*bad).collect();
        Search {
            system,
            bounds,
            solvers,
            excluded: vec![Vec::new(), Vec::new()],
            obligations: Vec::new(),
            lift: Lift::new(system),
            uses: vec![[0; 2]; system.next.len()],
            last: 0,
            is_last_open: true,
            n_excluded: 0,
            good,
        }
    }

    pub(super) fn run(mut self) -> Ended {
        match self.frames() {
            Ok(ended) => ended,
            Err(Spent) => Ended::Spent,
        }
    }

    /// The propagations and visited nodes so far.
    fn work(&self) -> u64 {
        self.solvers.iter().map(FrameSolver::work).sum::<u64>() + self.lift.work
    }

    fn check(&self) -> Result<(), Spent> {
        if self.work() >= self.bounds.work { Err(Spent) } else { Ok(()) }
    }

    fn frames(&mut self) -> Result<Ended, Spent> {
        loop {
            while let Some(bad) = self.bad_state()? {
                let first = self.oblige(bad, None);
                if let Some(found) = self.block(first)? {
                    let (rows, at_least) = (self.trace(found), self.last + 1);
                    return Ok(Ended::Refuted { rows, at_least });
                }
            }
            self.is_last_open = false;
            for good in self.good.clone() {
                self.solvers[self.last].require(good);
            }
            if let Some(fixed) = self.propagate()? {
                let cubes = self.excluded[fixed + 1..].iter().flatten();
                return Ok(Ended::Proved(cubes.map(|one| one.cube.clone()).collect()));
            }
            self.last += 1;
            self.is_last_open = true;
            self.n_excluded = 0;
            self.obligations.clear();
            self.excluded.push(Vec::new());
            self.solvers.push(FrameSolver::new(self.system, false));
        }
    }

    /// States of the last frame from which a reaction is bad.
    fn bad_state(&mut self) -> Result<Option<Lifted>, Spent> {
        let system = self.system;
        // Terms that were excluded before are still excluded: frames only lose states.
        while let Some(bad) = system.bad.get(self.n_excluded) {
            self.check()?;
            let conflicts = self.bounds.conflicts;
            match self.solver(self.last).reaches(*bad, conflicts) {
                Answer::Blocked(_) => self.n_excluded += 1,
                Answer::Unknown => return Err(Spent),
                Answer::Reached => return Ok(Some(self.lifted(self.last, &[*bad]))),
            }
        }
        Ok(None)
    }

    fn lifted(&mut self, frame: usize, results: &[Lit]) -> Lifted {
        let solver = &self.solvers[frame];
        self.lift.lift(results, |node| solver.is_one(node))
    }

    /// The solver of a frame, replaced if it is worn.
    fn solver(&mut self, frame: usize) -> &mut FrameSolver<'s> {
        if self.solvers[frame].is_worn() {
            let mut renewed = self.solvers[frame].renewed();
            if frame > 0 {
                for one in self.excluded[frame..].iter().flatten() {
                    renewed.exclude(&one.cube);
                }
            }
            if frame < self.last || frame == self.last && !self.is_last_open {
                self.good.iter().for_each(|good| renewed.require(*good));
            }
            self.solvers[frame] = renewed;
        }
        &mut self.solvers[frame]
    }

    fn oblige(&mut self, lifted: Lifted, then: Option<usize>) -> usize {
        self.obligations.push(Obligation { cube: lifted.cube, inputs: lifted.inputs, then });
        self.obligations.len() - 1
    }

    /// Excludes the states of an obligation from the last frame. Returns an obligation that contains the reset state, if there is one.
    fn block(&mut self, first: usize) -> Result<Option<usize>, Spent> {
        if self.system.starts_in(&self.obligations[first].cube) {
            return Ok(Some(first));
        }
        let mut queue = BinaryHeap::from([Reverse((self.last, first))]);
        while let Some(Reverse((frame, at))) = queue.pop() {
            let cube = self.obligations[at].cube.clone();
            if self.is_excluded(frame, &cube) {
                if frame < self.last {
                    queue.push(Reverse((frame + 1, at)));
                }
                continue;
            }
            match self.entered(frame - 1, &cube)? {
                Answer::Blocked(core) => {
                    let core = self.without_first(core, &cube);
                    let level = self.exclude_far(frame, core)?;
                    if level <= self.last {
                        queue.push(Reverse((level, at)));
                    }
                }
                Answer::Reached => {
                    let results: Vec<_> = cube.iter().map(|bit| self.system.then(*bit)).collect();
                    let before = self.lifted(frame - 1, &results);
                    let before = self.oblige(before, Some(at));
                    if self.system.starts_in(&self.obligations[before].cube) {
                        return Ok(Some(before));
                    }
                    queue.push(Reverse((frame - 1, before)));
                    queue.push(Reverse((frame, at)));
                }
                Answer::Unknown => return Err(Spent),
            }
        }
        Ok(None)
    }

    /// Whether a state of the frame outside the cube leads into it.
    fn entered(&mut self, frame: usize, cube: &[Bit]) -> Result<Answer, Spent> {
        self.check()?;
        let is_open = frame == self.last && self.is_last_open;
        let good = if is_open { self.good.clone() } else { Vec::new() };
        let conflicts = self.bounds.conflicts;
        Ok(self.solver(frame).enters(cube, &good, conflicts))
    }

    fn is_excluded(&self, frame: usize, cube: &[Bit]) -> bool {
        let hashes = hashes(cube);
        self.excluded[frame.max(1)..].iter().flatten().any(|one| one.contains(cube, hashes))
    }

    /// Extends a part of a cube so that it does not contain the reset state. The whole cube does not contain that state.
    fn without_first(&self, mut part: Cube, cube: &[Bit]) -> Cube {
        if self.system.starts_in(&part) {
            let differs = |bit: &&Bit| self.system.first[bit.index()] != bit.value;
            part.extend(cube.iter().find(differs));
            part.sort_unstable();
        }
        part
    }

    /// Excludes a cube that nothing in the frame before `level` leads to, from as many frames as possible and with as few bits as possible. Returns the level.
    fn exclude_far(&mut self, mut level: usize, mut cube: Cube) -> Result<usize, Spent> {
        // Finds the highest level first; bits are then removed only as far as this level allows.
        while level <= self.last {
            match self.entered(level, &cube)? {
                Answer::Blocked(core) => cube = self.without_first(core, &cube),
                Answer::Reached => break,
                Answer::Unknown => break,
            }
            level += 1;
        }
        let mut order = cube.clone();
        order.sort_unstable_by_key(|bit| (self.uses[bit.index()][usize::from(bit.value)], *bit));
        for bit in order {
            if cube.len() == 1 || cube.binary_search(&bit).is_err() {
                continue;
            }
            let smaller: Cube = cube.iter().copied().filter(|one| *one != bit).collect();
            if self.system.starts_in(&smaller) {
                continue;
            }
            if let Answer::Blocked(core) = self.entered(level - 1, &smaller)? {
                cube = self.without_first(core, &smaller);
            }
        }
        while level <= self.last {
            match self.entered(level, &cube)? {
                Answer::Blocked(_) => level += 1,
                Answer::Reached | Answer::Unknown => break,
            }
        }
        self.exclude(level, cube);
        Ok(level)
    }

    fn exclude(&mut self, level: usize, cube: Cube) {
        for bit in &cube {
            self.uses[bit.index()][usize::from(bit.value)] += 1;
        }
        let new = Excluded::new(cube);
        for known in &mut self.excluded[1..=level] {
            known.retain(|old| !new.contains(&old.cube, old.hashes));
        }
        for solver in &mut self.solvers[1..=level] {
            solver.exclude(&new.cube);
        }
        self.excluded[level].push(new);
    }

    /// Moves cubes to higher levels. Returns the level that is equal to the next one, if there is one.
    fn propagate(&mut self) -> Result<Option<usize>, Spent> {
        for level in 1..=self.last {
            for one in self.excluded[level].clone() {
                if !self.excluded[level].iter().any(|known| known.cube == one.cube) {
                    continue;
                }
                if let Answer::Blocked(core) = self.entered(level, &one.cube)? {
                    let cube = self.without_first(core, &one.cube);
                    self.exclude(level + 1, cube);
                }
            }
            if self.excluded[level].is_empty() {
                return Ok(Some(level));
            }
        }
        Ok(None)
    }

    /// The inputs of the reactions from an obligation that contains the reset state.
    fn trace(&self, from: usize) -> Vec<Vec<usize>> {
        let mut rows = Vec::new();
        let mut at = Some(from);
        while let Some(obligation) = at.map(|at| &self.obligations[at]) {
            rows.push(obligation.inputs.clone());
            at = obligation.then;
        }
        rows
    }
}
