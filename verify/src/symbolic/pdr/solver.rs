//! The solver of one frame: states that are reachable within some number of reactions, and one reaction from them. Functions are loaded when a question
//! first needs them.

use batsat::{
    Callbacks, ClauseKind, Lit as SatLit, Solver, SolverInterface, SolverOpts, Var, lbool,
};

use super::system::{Bit, Cube, System};
use crate::symbolic::aig::Lit;

/// After this many temporary clauses a solver is replaced by a new one, which loads only what the next questions need.
const TEMPORARY: usize = 400;

/// The answer to one question.
pub(super) enum Answer {
    /// No state of the frame gives the result; contains the part of the cube that was needed.
    Blocked(Cube),
    /// Some state does; [`FrameSolver::is_one`] shows it.
    Reached,
    /// The solver reached its limit.
    Unknown,
}

/// Stops the solver after a number of learnt clauses.
struct Budget {
    learnt: u64,
    limit: u64,
}

impl Callbacks for Budget {
    fn on_new_clause(&mut self, _: &[SatLit], kind: ClauseKind) {
        self.learnt += u64::from(kind == ClauseKind::Learnt);
    }

    fn stop(&self) -> bool {
        self.learnt > self.limit
    }
}

/// The solver of one frame.
pub(super) struct FrameSolver<'s> {
    system: &'s System,
    solver: Solver<Budget>,
    vars: Vec<Option<Var>>,
    /// For each lemma, the number of its bits that are not loaded.
    missing: Vec<u32>,
    /// True if the frame is the state after reset.
    is_first: bool,
    n_temporary: usize,
    clause: Vec<SatLit>,
    /// The propagations of solvers that were replaced.
    spent: u64,
}

impl<'s> FrameSolver<'s> {
    pub(super) fn new(system: &'s System, is_first: bool) -> Self {
        let mut solver = FrameSolver {
            system,
            solver: Solver::new(SolverOpts::default(), Budget { learnt: 0, limit: 0 }),
            vars: vec![None; system.aig.len()],
            missing: system.lemmas.iter().map(|cube| cube.len() as u32).collect(),
            is_first,
            n_temporary: 0,
            clause: Vec::new(),
            spent: 0,
        };
        for legal in &system.legal {
            solver.require(*legal);
        }
        solver
    }

    /// True if the solver is full of old temporary clauses.
    pub(super) fn is_worn(&self) -> bool {
        self.n_temporary > TEMPORARY
    }

    /// An empty solver for the same frame.
    pub(super) fn renewed(&self) -> Self {
        FrameSolver { spent: self.work(), ..FrameSolver::new(self.system, self.is_first) }
    }

    /// The number of propagations so far.
    pub(super) fn work(&self) -> u64 {
        self.spent + self.solver.num_propagations()
    }

    fn add(&mut self, lits: &[SatLit]) {
        self.clause.clear();
        self.clause.extend_from_slice(lits);
        self.solver.add_clause_reuse(&mut self.clause);
    }

    /// The solver's literal of a function; loads what is missing.
    fn load(&mut self, lit: Lit) -> SatLit {
        let mut todo = vec![lit.node()];
        while let Some(&node) = todo.last() {
            if self.vars[node].is_some() {
                todo.pop();
                continue;
            }
            let Some((a, b)) = self.system.aig.operands(node) else {
                todo.pop();
                self.load_variable(node);
                continue;
            };
            let missing =
                [a, b].into_iter().map(Lit::node).filter(|below| self.vars[*below].is_none());
            let before = todo.len();
            todo.extend(missing);
            if todo.len() == before {
                todo.pop();
                // The variables decide; everything else follows from them.
                let own = SatLit::new(self.solver.new_var(lbool::UNDEF, false), true);
                self.vars[node] = Some(own.var());
                let (a, b) = (self.loaded(a), self.loaded(b));
                self.add(&[!own, a]);
                self.add(&[!own, b]);
                self.add(&[own, !a, !b]);
            }
        }
        self.loaded(lit)
    }

    fn loaded(&self, lit: Lit) -> SatLit {
        match self.vars[lit.node()] {
            Some(var) => SatLit::new(var, !lit.is_negated()),
            None => unreachable!("operands are loaded before the functions of them"),
        }
    }

    fn load_variable(&mut self, node: usize) {
        let own = SatLit::new(self.solver.new_var_default(), true);
        self.vars[node] = Some(own.var());
        if node == 0 {
            self.add(&[!own]);
        }
        let Some(at) = self.system.bit_of(node) else { return };
        if self.is_first {
            self.add(&[if self.system.first[at] { own } else { !own }]);
            return;
        }
        for lemma in &self.system.lemmas_of[at] {
            let missing = &mut self.missing[*lemma as usize];
            *missing -= 1;
            if *missing == 0 {
                let cube = &self.system.lemmas[*lemma as usize];
                let clause: Vec<SatLit> =
                    cube.iter().map(|bit| !self.loaded(System::now(*bit))).collect();
                self.add(&clause);
            }
        }
    }

    /// From now on, the function is true.
    pub(super) fn require(&mut self, lit: Lit) {
        let lit = self.load(lit);
        self.add(&[lit]);
    }

    /// From now on, the frame contains no state of the cube.
    pub(super) fn exclude(&mut self, cube: &[Bit]) {
        let clause: Vec<SatLit> = cube.iter().map(|bit| !self.load(System::now(*bit))).collect();
        self.add(&clause);
    }

    /// Whether some state of the frame, with some inputs, makes the function true.
    pub(super) fn reaches(&mut self, lit: Lit, conflicts: u64) -> Answer {
        let lit = self.load(lit);
        self.solve(&[lit], conflicts, &[])
    }

    /// Whether some state of the frame that is not in the cube leads into the cube, with a reaction that makes all of `also` true.
    pub(super) fn enters(&mut self, cube: &[Bit], also: &[Lit], conflicts: u64) -> Answer {
        let mut assumed: Vec<SatLit> = Vec::with_capacity(cube.len() + 2);
        let mut clause: Vec<SatLit> =
            cube.iter().map(|bit| !self.load(System::now(*bit))).collect();
        let outside = SatLit::new(self.solver.new_var_default(), true);
        clause.push(!outside);
        self.add(&clause);
        assumed.push(outside);
        assumed.extend(also.iter().map(|also| self.load(*also)));
        let n_before = assumed.len();
        for bit in cube {
            let then = self.load(self.system.then(*bit));
            assumed.push(then);
        }
        let n_named = assumed.split_off(n_before);
        let named: Vec<(Bit, SatLit)> = cube.iter().copied().zip(n_named).collect();
        assumed.extend(named.iter().map(|(_, lit)| *lit));
        let answer = self.solve(&assumed, conflicts, &named);
        self.add(&[!outside]);
        self.n_temporary += 1;
        answer
    }

    fn solve(&mut self, assumed: &[SatLit], conflicts: u64, named: &[(Bit, SatLit)]) -> Answer {
        let budget = self.solver.cb_mut();
        budget.limit = budget.learnt + conflicts;
        let answer = self.solver.solve_limited(assumed);
        if answer == lbool::TRUE {
            Answer::Reached
        } else if answer == lbool::FALSE {
            let is_needed =
                |(_, lit): &&(Bit, SatLit)| self.solver.unsat_core_contains_var(lit.var());
            Answer::Blocked(named.iter().filter(is_needed).map(|(bit, _)| *bit).collect())
        } else {
            Answer::Unknown
        }
    }

    /// The value of a variable in the state that the last answer found; 0 if it does not matter.
    pub(super) fn is_one(&self, node: usize) -> bool {
        self.vars[node].is_some_and(|var| self.solver.value_var(var) == lbool::TRUE)
    }
}
