//! Equal nodes of a graph, found by simulation and proved by a solver, from the variables up [Kuehlmann, Krohm 1997; Mishchenko, Chatterjee, Brayton, Een
//! 2006]. If two circuits compute the same in similar steps, each query is small, because the nodes below it have already been merged.

use std::collections::BTreeMap;

use batsat::{
    Callbacks, ClauseKind, Lit as SatLit, Solver, SolverInterface, SolverOpts, Var, lbool,
};

use super::aig::{Aig, Lit};
use crate::limits::Limits;

/// The maximum number of conflicts of a query about two inner nodes: a missed merge costs less than a long search.
const INNER_CONFLICTS: u64 = 400;
/// The total effort, as a multiple of the limit of conflicts for one query. A conflict counts as 1, a query as 1, plus 1 for each thousand nodes of its solver.
const EFFORT: u64 = 20;
/// The number of encoded nodes from which a new solver is begun.
const ENCODED: usize = 20_000;
/// The number of counterexamples after which the graph is simulated again.
const FRESH: u32 = 16;

/// An assignment of the variables, by the literals that are true.
pub(super) type Example = Vec<Lit>;

/// The merged form of a graph.
pub(super) struct Sweep<'a> {
    from: &'a Aig,
    to: Aig,
    /// For each node of the graph that was visited, its merged literal.
    made: BTreeMap<usize, Lit>,
    /// For each variable of the merged graph, the one of the original.
    original: BTreeMap<Lit, Lit>,
    /// For each node, a code of its values under all patterns so far, and the value under the first.
    codes: Vec<(u64, bool)>,
    /// For each code, the first merged literal with this code, in positive phase.
    classes: BTreeMap<u64, Lit>,
    pending: Vec<(BTreeMap<Lit, u64>, u32)>,
    solver: Query,
    assumed: Vec<Lit>,
    conflicts: u64,
    spent: u64,
    effort: u64,
}

/// A solver with the nodes that it knows.
pub(super) struct Query {
    solver: Solver<Budget>,
    vars: BTreeMap<usize, Var>,
}

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

/// The answer to a query.
pub(super) enum Answer {
    Equal,
    Different(Example),
    Unknown,
}

impl<'a> Sweep<'a> {
    /// A sweep of a graph in which these literals are assumed to be true. `patterns` are assignments that satisfy the assumptions, 64 in each.
    pub(super) fn new(
        from: &'a Aig,
        assumed: &[Lit],
        patterns: &[BTreeMap<Lit, u64>],
        limits: &Limits,
    ) -> Option<Self> {
        let mut sweep = Sweep {
            from,
            to: Aig::new(),
            made: BTreeMap::new(),
            original: BTreeMap::new(),
            codes: vec![(0, false); from.len()],
            classes: BTreeMap::new(),
            pending: Vec::new(),
            solver: Query::new(),
            assumed: Vec::new(),
            conflicts: limits.conflicts,
            spent: 0,
            effort: limits.conflicts.saturating_mul(EFFORT),
        };
        for (at, pattern) in patterns.iter().enumerate() {
            sweep.simulate(pattern, !0, at == 0);
        }
        sweep.classes.insert(sweep.codes[0].0, Lit::FALSE);
        for lit in assumed {
            let merged = sweep.merged(*lit)?;
            sweep.assumed.push(merged);
        }
        sweep.begin();
        Some(sweep)
    }

    /// Extends the codes by 64 patterns, of which `used` count.
    fn simulate(&mut self, pattern: &BTreeMap<Lit, u64>, used: u64, is_first: bool) {
        let words = self.from.all_words(|lit| pattern.get(&lit).copied().unwrap_or(0));
        for ((code, phase), word) in self.codes.iter_mut().zip(words) {
            if is_first {
                *phase = word & 1 == 1;
            }
            let word = if *phase { !word } else { word } & used;
            // A multiplicative hash of the sequence of words; equal codes only suggest equal nodes.
            *code = (code.rotate_left(7) ^ word).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        }
    }

    fn begin(&mut self) {
        self.solver = Query::new();
        for lit in self.assumed.clone() {
            self.solver.assert(&self.to, &[lit]);
        }
    }

    /// Merges all nodes below these literals; `None` if the effort is spent.
    pub(super) fn prepare(&mut self, roots: &[Lit]) -> Option<()> {
        for node in self.from.cone(roots, usize::MAX)? {
            if !self.made.contains_key(&node) {
                let merged = self.visit(node)?;
                self.made.insert(node, merged);
            }
        }
        Some(())
    }

    /// The merged form of a literal; `None` if the effort is spent.
    fn merged(&mut self, lit: Lit) -> Option<Lit> {
        if !self.made.contains_key(&lit.node()) {
            self.prepare(&[lit])?;
        }
        Some(self.read(lit))
    }

    fn read(&self, lit: Lit) -> Lit {
        self.made[&lit.node()].negate_if(lit.is_negated())
    }

    fn visit(&mut self, node: usize) -> Option<Lit> {
        let Some((a, b)) = self.from.operands(node) else {
            if node == 0 {
                return Some(Lit::FALSE);
            }
            let own = self.to.variable();
            self.original.insert(own, Lit::of_node(node));
            let (code, phase) = self.codes[node];
            self.classes.entry(code).or_insert(own.negate_if(phase));
            return Some(own);
        };
        let (a, b) = (self.read(a), self.read(b));
        let n_before = self.to.len();
        let own = self.to.and(a, b);
        if self.to.len() == n_before {
            return Some(own);
        }
        let (code, phase) = self.codes[node];
        let Some(first) = self.classes.get(&code).copied() else {
            self.classes.insert(code, own.negate_if(phase));
            return Some(own);
        };
        let first = first.negate_if(phase);
        if self.spent > self.effort {
            return None;
        }
        match self.compare(own, first, INNER_CONFLICTS) {
            Answer::Equal => Some(first),
            Answer::Different(example) => {
                self.learn(&example);
                Some(own)
            }
            Answer::Unknown => Some(own),
        }
    }

    /// Adds a counterexample to the patterns.
    fn learn(&mut self, example: &[Lit]) {
        if self.pending.is_empty() {
            self.pending.push((BTreeMap::new(), 0));
        }
        let Some((pattern, n)) = self.pending.last_mut() else { return };
        for lit in example {
            *pattern.entry(*lit).or_insert(0) |= 1 << *n;
        }
        *n += 1;
        if *n < FRESH {
            return;
        }
        let used = (1_u64 << *n) - 1;
        let Some((pattern, _)) = self.pending.pop() else { return };
        self.simulate(&pattern, used, false);
        self.classes.clear();
        self.classes.insert(self.codes[0].0, Lit::FALSE);
        for (node, merged) in &self.made {
            let (code, phase) = self.codes[*node];
            self.classes.entry(code).or_insert(merged.negate_if(phase));
        }
    }

    /// Proves that two literals of the graph are equal in all states that satisfy the assumptions.
    pub(super) fn equal(&mut self, a: Lit, b: Lit) -> Answer {
        let (Some(a), Some(b)) = (self.merged(a), self.merged(b)) else { return Answer::Unknown };
        self.compare(a, b, self.conflicts)
    }

    fn compare(&mut self, a: Lit, b: Lit, conflicts: u64) -> Answer {
        if a == b {
            return Answer::Equal;
        }
        if self.solver.vars.len() > ENCODED {
            self.begin();
        }
        for (a, b) in [(a, !b), (!a, b)] {
            let answer = self.solver.solve(&self.to, &[a, b], conflicts);
            let n_nodes = self.solver.vars.len() as u64;
            self.spent += 1 + n_nodes / 1_000 + self.solver.solver.cb().learnt;
            if answer == lbool::TRUE {
                let original = self.original.iter().filter(|(own, _)| self.solver.is_true(**own));
                return Answer::Different(original.map(|(_, lit)| *lit).collect());
            }
            if answer != lbool::FALSE {
                return Answer::Unknown;
            }
        }
        self.solver.assert(&self.to, &[a, !b]);
        self.solver.assert(&self.to, &[!a, b]);
        Answer::Equal
    }
}

impl Query {
    pub(super) fn new() -> Self {
        let budget = Budget { learnt: 0, limit: u64::MAX };
        Query { solver: Solver::new(SolverOpts::default(), budget), vars: BTreeMap::new() }
    }

    /// The number of nodes that it knows.
    pub(super) fn len(&self) -> usize {
        self.vars.len()
    }

    fn encode(&mut self, aig: &Aig, lit: Lit) -> SatLit {
        let mut todo = vec![lit.node()];
        while let Some(node) = todo.last().copied() {
            if self.vars.contains_key(&node) {
                todo.pop();
                continue;
            }
            let Some((a, b)) = aig.operands(node) else {
                let own = self.solver.new_var_default();
                self.vars.insert(node, own);
                if node == 0 {
                    self.add(&[SatLit::new(own, false)]);
                }
                todo.pop();
                continue;
            };
            let missing: Vec<usize> = [a.node(), b.node()]
                .into_iter()
                .filter(|below| !self.vars.contains_key(below))
                .collect();
            if !missing.is_empty() {
                todo.extend(missing);
                continue;
            }
            let own = self.solver.new_var_default();
            self.vars.insert(node, own);
            let own = SatLit::new(own, true);
            let (a, b) = (self.known(a), self.known(b));
            self.add(&[!own, a]);
            self.add(&[!own, b]);
            self.add(&[own, !a, !b]);
            todo.pop();
        }
        self.known(lit)
    }

    fn known(&self, lit: Lit) -> SatLit {
        SatLit::new(self.vars[&lit.node()], !lit.is_negated())
    }

    fn add(&mut self, lits: &[SatLit]) {
        let mut clause = lits.to_vec();
        self.solver.add_clause_reuse(&mut clause);
    }

    /// Adds a clause for all questions that follow.
    pub(super) fn assert(&mut self, aig: &Aig, clause: &[Lit]) {
        let lits: Vec<SatLit> = clause.iter().map(|lit| self.encode(aig, *lit)).collect();
        self.add(&lits);
    }

    /// Searches for an assignment that makes all clauses and these literals true, with at most this many conflicts.
    pub(super) fn solve(&mut self, aig: &Aig, all: &[Lit], conflicts: u64) -> lbool {
        let lits: Vec<SatLit> = all.iter().map(|lit| self.encode(aig, *lit)).collect();
        let budget = self.solver.cb_mut();
        budget.learnt = 0;
        budget.limit = conflicts;
        self.solver.solve_limited(&lits)
    }

    /// The conflicts of the last question.
    pub(super) fn spent(&self) -> u64 {
        self.solver.cb().learnt
    }

    /// The value of a variable in the assignment that was found.
    pub(super) fn is_true(&self, variable: Lit) -> bool {
        self.vars
            .get(&variable.node())
            .is_some_and(|own| self.solver.value_var(*own) == lbool::TRUE)
    }
}
