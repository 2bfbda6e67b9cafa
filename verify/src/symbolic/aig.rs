//! Functions as and-inverter graphs, hashed so that equal structures are one node, and an equivalence check.

use grafsynth_ir::Gather;
use grafsynth_ir::ranks::sort_by_rank;
use std::cell::{Cell, RefCell};
use std::collections::{BTreeMap, BTreeSet};
use std::hash::{BuildHasherDefault, Hasher};

use batsat::{Callbacks, ClauseKind, Lit as SatLit, Solver, SolverInterface, SolverOpts, lbool};
use grafsynth_logic::bdd::{Bdd, Full, Ref};
use indexmap::IndexMap;

use crate::limits::Limits;

/// The number of conflicts in the solver's first attempt. Nearly all queries need fewer, and one that needs more is often easy for a decision diagram.
const FEW_CONFLICTS: u64 = 200;
/// One query may use [`Limits::bdd_nodes`] divided by this number: a proof has one query per function, and after each the solver may still make its full
/// attempt.
const PART_OF_DIAGRAM: usize = 4;

/// A node of the graph or its negation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct Lit(u32);

impl Lit {
    pub(crate) const FALSE: Lit = Lit(0);
    pub(crate) const TRUE: Lit = Lit(1);

    pub(crate) fn constant(value: bool) -> Lit {
        if value { Lit::TRUE } else { Lit::FALSE }
    }

    /// The place of its node in the graph; operands have lower places, and 0 is the constant.
    pub(super) fn node(self) -> usize {
        (self.0 >> 1) as usize
    }

    /// The positive literal of a node.
    pub(super) fn of_node(node: usize) -> Lit {
        Lit((node as u32) << 1)
    }

    pub(super) fn is_negated(self) -> bool {
        self.0 & 1 == 1
    }

    pub(crate) fn as_constant(self) -> Option<bool> {
        (self.node() == 0).then_some(self.is_negated())
    }

    pub(crate) fn negate_if(self, condition: bool) -> Lit {
        Lit(self.0 ^ u32::from(condition))
    }
}

impl std::ops::Not for Lit {
    type Output = Lit;
    fn not(self) -> Lit {
        Lit(self.0 ^ 1)
    }
}

#[derive(Debug, Clone, Copy)]
enum Node {
    /// Node 0 is the constant false.
    Constant,
    /// A free variable.
    Variable,
    And(Lit, Lit),
}

/// A hash of two literals: fast, and the same in each run.
#[derive(Default)]
struct PairHash(u64);

impl Hasher for PairHash {
    fn finish(&self) -> u64 {
        self.0 ^ self.0 >> 29
    }

    fn write(&mut self, bytes: &[u8]) {
        bytes.iter().for_each(|byte| self.write_u32(u32::from(*byte)));
    }

    fn write_u32(&mut self, value: u32) {
        self.0 = (self.0.rotate_left(23) ^ u64::from(value)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    }
}

/// Values of nodes of a graph; those of all others are undefined.
pub(super) struct OfNodes<T> {
    place: Vec<u32>,
    values: Vec<T>,
}

impl<T: Copy> OfNodes<T> {
    pub(super) fn new(aig: &Aig) -> Self {
        OfNodes { place: vec![0; aig.len()], values: Vec::new() }
    }

    pub(super) fn insert(&mut self, node: usize, value: T) {
        self.place[node] = self.values.len() as u32;
        self.values.push(value);
    }

    pub(super) fn get(&self, node: usize) -> T {
        self.values[self.place[node] as usize]
    }
}

/// The values of 6 variables for all their 64 combinations.
const TRUTH_TABLE: [u64; 6] = [
    0xAAAA_AAAA_AAAA_AAAA,
    0xCCCC_CCCC_CCCC_CCCC,
    0xF0F0_F0F0_F0F0_F0F0,
    0xFF00_FF00_FF00_FF00,
    0xFFFF_0000_FFFF_0000,
    0xFFFF_FFFF_0000_0000,
];

/// The graph.
#[derive(Debug, Clone)]
pub(crate) struct Aig {
    nodes: Vec<Node>,
    table: IndexMap<(Lit, Lit), Lit, BuildHasherDefault<PairHash>>,
    spent: Cell<u64>,
    marks: RefCell<Marks>,
}

/// The marks of nodes in walks over the graph: a small cone in a large graph must not cost a mark for each node.
#[derive(Debug, Clone, Default)]
struct Marks {
    /// For each node, `last - 1` if its operands come first in the last walk, `last` if it is done; it was not seen if less.
    of: Vec<u32>,
    last: u32,
}

impl Aig {
    pub(crate) fn new() -> Self {
        Aig {
            nodes: vec![Node::Constant],
            table: IndexMap::default(),
            spent: Cell::new(0),
            marks: RefCell::default(),
        }
    }

    /// The number of clauses that all solver queries so far have learnt.
    pub(crate) fn spent(&self) -> u64 {
        self.spent.get()
    }

    pub(crate) fn len(&self) -> usize {
        self.nodes.len()
    }

    pub(crate) fn variable(&mut self) -> Lit {
        let node = self.nodes.len() as u32;
        self.nodes.push(Node::Variable);
        Lit(node << 1)
    }

    pub(crate) fn and(&mut self, a: Lit, b: Lit) -> Lit {
        let (a, b) = (a.min(b), a.max(b));
        if a == Lit::FALSE || a == !b {
            return Lit::FALSE;
        }
        if a == Lit::TRUE || a == b {
            return b;
        }
        // Contradiction and absorption one level down.
        for (small, big) in [(a, b), (b, a)] {
            if let Node::And(c, d) = self.nodes[big.node()] {
                if !big.is_negated() {
                    if c == small || d == small {
                        return big;
                    }
                    if c == !small || d == !small {
                        return Lit::FALSE;
                    }
                } else {
                    if c == !small || d == !small {
                        return small;
                    }
                    if c == small {
                        return self.and(small, !d);
                    }
                    if d == small {
                        return self.and(small, !c);
                    }
                    // `(s and x or y) and not s`, as where something begins: only y is left.
                    if self.excludes(!c, small) {
                        return self.and(small, !d);
                    }
                    if self.excludes(!d, small) {
                        return self.and(small, !c);
                    }
                }
            }
        }
        if let Some(known) = self.table.get(&(a, b)) {
            return *known;
        }
        let lit = Lit((self.nodes.len() as u32) << 1);
        self.nodes.push(Node::And(a, b));
        self.table.insert((a, b), lit);
        lit
    }

    /// True if a conjunction has the negation of another function as an operand.
    fn excludes(&self, conjunction: Lit, other: Lit) -> bool {
        match self.nodes[conjunction.node()] {
            Node::And(p, q) => !conjunction.is_negated() && (p == !other || q == !other),
            Node::Constant | Node::Variable => false,
        }
    }

    pub(crate) fn or(&mut self, a: Lit, b: Lit) -> Lit {
        !self.and(!a, !b)
    }

    pub(crate) fn xor(&mut self, a: Lit, b: Lit) -> Lit {
        let both = self.and(a, b);
        let none = self.and(!a, !b);
        self.and(!both, !none)
    }

    pub(crate) fn ite(&mut self, c: Lit, a: Lit, b: Lit) -> Lit {
        if a == b {
            return a;
        }
        if a == !b {
            return !self.xor(c, a);
        }
        let yes = self.and(c, a);
        let no = self.and(!c, b);
        self.or(yes, no)
    }

    /// The conjunction; the same set of operands gives the same node.
    pub(crate) fn and_all(&mut self, all: impl IntoIterator<Item = Lit>) -> Lit {
        let mut layer: Vec<Lit> = all.into_iter().collect();
        layer.sort_unstable();
        layer.dedup();
        while layer.len() > 1 {
            layer = layer
                .chunks(2)
                .map(|pair| if let [a, b] = *pair { self.and(a, b) } else { pair[0] })
                .collect();
        }
        layer.first().copied().unwrap_or(Lit::TRUE)
    }

    pub(crate) fn or_all(&mut self, all: impl IntoIterator<Item = Lit>) -> Lit {
        let negated: Vec<Lit> = all.into_iter().map(|lit| !lit).collect();
        !self.and_all(negated)
    }

    /// The operands of a function that is structurally a disjunction of at most `limit` functions; for any other function, the function itself.
    pub(crate) fn disjuncts(&self, root: Lit, limit: usize) -> BTreeSet<Lit> {
        let mut all = BTreeSet::new();
        let mut todo = vec![!root];
        while let Some(lit) = todo.pop() {
            match self.operands(lit.node()) {
                Some((a, b)) if !lit.is_negated() => todo.extend([a, b]),
                Some(_) | None => {
                    all.insert(!lit);
                }
            }
            if all.len() + todo.len() > limit {
                return [root].into_iter().gather();
            }
        }
        all
    }

    /// True if the structure shows that a function implies one of these functions. Each visited node reduces `budget` by 1.
    pub(crate) fn implies_one(
        &self,
        lit: Lit,
        of: &BTreeSet<Lit>,
        depth: u32,
        budget: &mut usize,
    ) -> bool {
        if of.contains(&lit) {
            return true;
        }
        let (Some((a, b)), Some(depth)) = (self.operands(lit.node()), depth.checked_sub(1)) else {
            return false;
        };
        let Some(left) = budget.checked_sub(1) else { return false };
        *budget = left;
        if lit.is_negated() {
            self.implies_one(!a, of, depth, budget) && self.implies_one(!b, of, depth, budget)
        } else {
            self.implies_one(a, of, depth, budget) || self.implies_one(b, of, depth, budget)
        }
    }

    /// The operands of a node; `None` for a variable and for the constant.
    pub(super) fn operands(&self, node: usize) -> Option<(Lit, Lit)> {
        match self.nodes[node] {
            Node::Constant | Node::Variable => None,
            Node::And(a, b) => Some((a, b)),
        }
    }

    /// The nodes below the literals, operands first, including variables; `None` if there are more than `limit`.
    pub(super) fn cone(&self, roots: &[Lit], limit: usize) -> Option<Vec<usize>> {
        let mut order = Vec::new();
        let Marks { of: mark, last } = &mut *self.marks.borrow_mut();
        mark.resize(self.nodes.len(), 0);
        if *last > u32::MAX - 2 {
            mark.fill(0);
            *last = 0;
        }
        // Smaller marks are of earlier calls.
        let (is_open, is_done) = (*last + 1, *last + 2);
        *last = is_done;
        let mut n_marked = 0;
        let mut todo: Vec<usize> = roots.iter().map(|root| root.node()).collect();
        while let Some(&node) = todo.last() {
            if mark[node] < is_open {
                mark[node] = is_open;
                n_marked += 1;
                if n_marked > limit {
                    return None;
                }
                if let Node::And(a, b) = self.nodes[node] {
                    todo.extend([a.node(), b.node()].iter().filter(|it| mark[**it] < is_open));
                }
                continue;
            }
            todo.pop();
            if mark[node] == is_open {
                mark[node] = is_done;
                order.push(node);
            }
        }
        Some(order)
    }

    /// True if a small function, of at most 6 variables, is false for all their values. That is faster than to set up a solver.
    pub(crate) fn is_never_true(&self, root: Lit) -> bool {
        const MOST_NODES: usize = 500;
        let mut values: BTreeMap<usize, u64> = BTreeMap::new();
        let mut columns = TRUTH_TABLE.into_iter();
        let mut todo = vec![root.node()];
        while let Some(&node) = todo.last() {
            let value = match self.nodes[node] {
                _ if values.contains_key(&node) => None,
                Node::Constant => Some(0),
                Node::Variable => match columns.next() {
                    Some(column) => Some(column),
                    None => return false,
                },
                Node::And(a, b) => {
                    let of = |lit: Lit| {
                        let value = values.get(&lit.node())?;
                        Some(if lit.is_negated() { !value } else { *value })
                    };
                    if let (Some(a), Some(b)) = (of(a), of(b)) {
                        Some(a & b)
                    } else {
                        todo.extend([a.node(), b.node()]);
                        if todo.len() + values.len() > MOST_NODES {
                            return false;
                        }
                        continue;
                    }
                }
            };
            todo.pop();
            values.extend(value.map(|value| (node, value)));
        }
        values.get(&root.node()) == Some(&if root.is_negated() { !0 } else { 0 })
    }

    /// The number of nodes of a function, if it is at most `limit`.
    pub(crate) fn size(&self, root: Lit, limit: usize) -> Option<usize> {
        self.cone(&[root], limit).map(|cone| cone.len())
    }

    /// The variables that a function structurally depends on.
    pub(crate) fn support(&self, roots: &[Lit], limit: usize) -> Option<Vec<Lit>> {
        let cone = self.cone(roots, limit)?;
        Some(
            cone.into_iter()
                .filter(|node| matches!(self.nodes[*node], Node::Variable))
                .map(|node| Lit((node as u32) << 1))
                .collect(),
        )
    }

    /// The value of a function.
    #[cfg(test)]
    pub(crate) fn eval(&self, roots: &[Lit], value: impl Fn(Lit) -> bool) -> Vec<bool> {
        let mut values = vec![false; self.nodes.len()];
        let read = |values: &Vec<bool>, lit: Lit| values[lit.node()] != lit.is_negated();
        for (at, node) in self.nodes.iter().enumerate() {
            values[at] = match node {
                Node::Constant => false,
                Node::Variable => value(Lit((at as u32) << 1)),
                Node::And(a, b) => read(&values, *a) && read(&values, *b),
            };
        }
        roots.iter().map(|root| read(&values, *root)).collect()
    }

    /// The values of the functions for 64 assignments of the variables at once: one word per root.
    pub(crate) fn words(&self, roots: &[Lit], value: impl Fn(Lit) -> u64) -> Vec<u64> {
        let words = self.all_words(value);
        roots.iter().map(|root| word_of(&words, *root)).collect()
    }

    /// The values of all nodes for 64 assignments of the variables at once.
    pub(super) fn all_words(&self, value: impl Fn(Lit) -> u64) -> Vec<u64> {
        let mut words = vec![0; self.nodes.len()];
        for at in 0..self.nodes.len() {
            words[at] = match self.nodes[at] {
                Node::Constant => 0,
                Node::Variable => value(Lit::of_node(at)),
                Node::And(a, b) => word_of(&words, a) & word_of(&words, b),
            };
        }
        words
    }

    /// The values of all nodes for 64 assignments that satisfy what is assumed: an assignment that does not is replaced by one that does. `None` if none does.
    pub(super) fn legal_words(
        &self,
        pattern: &mut BTreeMap<Lit, u64>,
        assumed: &[Lit],
    ) -> Option<Vec<u64>> {
        let words = |pattern: &BTreeMap<Lit, u64>| {
            self.all_words(|lit| pattern.get(&lit).copied().unwrap_or(0))
        };
        let found = words(pattern);
        let legal = assumed.iter().fold(!0, |all, lit| all & word_of(&found, *lit));
        if legal == 0 {
            return None;
        }
        if legal == !0 {
            return Some(found);
        }
        let from = legal.trailing_zeros();
        for word in pattern.values_mut() {
            let copy = if *word >> from & 1 == 1 { !0 } else { 0 };
            *word = *word & legal | copy & !legal;
        }
        Some(words(pattern))
    }

    /// The functions with other functions substituted for variables.
    pub(crate) fn substitute(&mut self, roots: &[Lit], instead: &IndexMap<Lit, Lit>) -> Vec<Lit> {
        // A cone is never larger than the graph.
        let Some(cone) = self.cone(roots, usize::MAX) else { return roots.to_vec() };
        let mut made: OfNodes<Lit> = OfNodes::new(self);
        let read = |made: &OfNodes<Lit>, lit: Lit| made.get(lit.node()).negate_if(lit.is_negated());
        for node in cone {
            let own = Lit((node as u32) << 1);
            let lit = match self.nodes[node] {
                Node::Constant => Lit::FALSE,
                Node::Variable => instead.get(&own).copied().unwrap_or(own),
                Node::And(a, b) => {
                    let (a, b) = (read(&made, a), read(&made, b));
                    self.and(a, b)
                }
            };
            made.insert(node, lit);
        }
        roots.iter().map(|root| read(&made, *root)).collect()
    }

    /// The functions as decision diagrams, with the variables at the given levels. The inner `None` means that they need more than `limit` nodes of the
    /// graph.
    ///
    /// # Errors
    /// If the manager is full.
    pub(crate) fn diagrams(
        &self,
        roots: &[Lit],
        limit: usize,
        level: impl Fn(Lit) -> u32,
        bdd: &mut Bdd,
    ) -> Result<Option<Vec<Ref>>, Full> {
        let Some(cone) = self.cone(roots, limit) else { return Ok(None) };
        let made = self.cone_diagrams(&cone, level, bdd)?;
        roots.iter().map(|root| read_diagram(bdd, &made, *root)).collect::<Result<_, _>>().map(Some)
    }

    fn cone_diagrams(
        &self,
        cone: &[usize],
        level: impl Fn(Lit) -> u32,
        bdd: &mut Bdd,
    ) -> Result<OfNodes<Ref>, Full> {
        let mut made: OfNodes<Ref> = OfNodes::new(self);
        for node in cone {
            let function = match self.nodes[*node] {
                Node::Constant => Ref::FALSE,
                Node::Variable => bdd.var(level(Lit((*node as u32) << 1)))?,
                Node::And(a, b) => {
                    let a = read_diagram(bdd, &made, a)?;
                    let b = read_diagram(bdd, &made, b)?;
                    bdd.and(a, b)?
                }
            };
            made.insert(*node, function);
        }
        Ok(made)
    }

    /// The variables that each of the functions structurally depends on. `None` if the sets need more than `limit` words of 64 bits.
    pub(crate) fn supports(&self, roots: &[Lit], limit: usize) -> Option<Vec<Vec<Lit>>> {
        let cone = self.cone(roots, limit)?;
        let mut place: OfNodes<usize> = OfNodes::new(self);
        cone.iter().zip(0..).for_each(|(node, at)| place.insert(*node, at));
        let variables: Vec<usize> = cone
            .iter()
            .copied()
            .filter(|node| matches!(self.nodes[*node], Node::Variable))
            .collect();
        let width = variables.len().div_ceil(64);
        if cone.len().checked_mul(width)? > limit {
            return None;
        }
        let mut words = vec![0u64; cone.len() * width];
        let mut n_seen = 0;
        for (at, node) in cone.iter().enumerate() {
            match self.nodes[*node] {
                Node::Constant => {}
                Node::Variable => {
                    words[at * width + n_seen / 64] |= 1 << (n_seen % 64);
                    n_seen += 1;
                }
                Node::And(a, b) => {
                    for below in [place.get(a.node()), place.get(b.node())] {
                        for word in 0..width {
                            words[at * width + word] |= words[below * width + word];
                        }
                    }
                }
            }
        }
        let of = |root: &Lit| {
            let at = place.get(root.node()) * width;
            (0..variables.len())
                .filter(|bit| words[at + bit / 64] >> (bit % 64) & 1 == 1)
                .map(|bit| Lit((variables[bit] as u32) << 1))
                .collect()
        };
        Some(roots.iter().map(of).collect())
    }

    /// An assignment that makes all literals and clauses true, as the variables that are 1. The inner `None` means that there is none, the outer one that
    /// the limits were reached.
    ///
    /// The solver settles most queries with [`FEW_CONFLICTS`]. Arithmetic often needs more, but has small diagrams if `rank` orders its variables well, so
    /// diagrams come before the solver's full effort.
    pub(crate) fn settle(
        &self,
        all: &[Lit],
        clauses: &[Vec<Lit>],
        rank: &dyn Fn(Lit) -> u32,
        limits: &Limits,
    ) -> Option<Option<Vec<Lit>>> {
        let first = self.satisfy(all, clauses, limits.conflicts.min(FEW_CONFLICTS));
        if first.is_some() {
            return first;
        }
        let node_limit = limits.bdd_nodes / PART_OF_DIAGRAM;
        match self.satisfiable_by_diagram(all, clauses, rank, node_limit) {
            Some(false) => Some(None),
            Some(true) | None => self.satisfy(all, clauses, limits.conflicts),
        }
    }

    /// Whether some assignment makes all literals and clauses true, by decision diagrams; `rank` orders the variables. `None` if the diagrams exceed the limit.
    fn satisfiable_by_diagram(
        &self,
        all: &[Lit],
        clauses: &[Vec<Lit>],
        rank: &dyn Fn(Lit) -> u32,
        node_limit: usize,
    ) -> Option<bool> {
        let mut roots: Vec<Lit> = all.to_vec();
        roots.extend(clauses.iter().flatten());
        let cone = self.cone(&roots, 50_000)?;
        let mut variables: Vec<usize> = cone
            .iter()
            .copied()
            .filter(|node| matches!(self.nodes[*node], Node::Variable))
            .collect();
        sort_by_rank(&mut variables, |node| {
            [u64::from(rank(Lit((*node as u32) << 1))), *node as u64]
        });
        let mut level: OfNodes<u32> = OfNodes::new(self);
        variables.into_iter().zip(0..).for_each(|(node, at)| level.insert(node, at));
        let mut bdd = Bdd::with_limit(node_limit);
        let made = self.cone_diagrams(&cone, |lit| level.get(lit.node()), &mut bdd).ok()?;
        let read = |bdd: &mut Bdd, lit: Lit| read_diagram(bdd, &made, lit);
        // The query itself comes first: often the assumptions are not needed.
        let mut rest = Ref::TRUE;
        for lit in all.iter().rev() {
            let function = read(&mut bdd, *lit).ok()?;
            rest = bdd.and(rest, function).ok()?;
        }
        for clause in clauses {
            if rest == Ref::FALSE {
                break;
            }
            let lits = clause
                .iter()
                .map(|lit| read(&mut bdd, *lit))
                .collect::<Result<Vec<_>, _>>()
                .ok()?;
            let function = bdd.or_all(lits).ok()?;
            rest = bdd.and(rest, function).ok()?;
        }
        Some(rest != Ref::FALSE)
    }

    /// An assignment that makes all literals and clauses true, as the variables that are 1. The inner `None` means that there is none, the outer one that the
    /// cone or the search is too large.
    pub(crate) fn satisfy(
        &self,
        all: &[Lit],
        clauses: &[Vec<Lit>],
        conflicts: u64,
    ) -> Option<Option<Vec<Lit>>> {
        if all.contains(&Lit::FALSE) {
            return Some(None);
        }
        let mut roots: Vec<Lit> = all.to_vec();
        roots.extend(clauses.iter().flatten());
        let cone = self.cone(&roots, 200_000)?;
        let mut solver: Solver<Budget> =
            Solver::new(SolverOpts::default(), Budget { learnt: 0, limit: conflicts });
        let mut vars: OfNodes<batsat::Var> = OfNodes::new(self);
        for node in &cone {
            vars.insert(*node, solver.new_var_default());
        }
        let sat = |lit: Lit| SatLit::new(vars.get(lit.node()), !lit.is_negated());
        let mut clause = Vec::new();
        let mut add = |solver: &mut Solver<Budget>, lits: &[SatLit]| {
            clause.clear();
            clause.extend_from_slice(lits);
            solver.add_clause_reuse(&mut clause)
        };
        for node in &cone {
            let own = SatLit::new(vars.get(*node), true);
            match self.nodes[*node] {
                Node::Constant => {
                    add(&mut solver, &[!own]);
                }
                Node::Variable => {}
                Node::And(a, b) => {
                    add(&mut solver, &[!own, sat(a)]);
                    add(&mut solver, &[!own, sat(b)]);
                    add(&mut solver, &[own, !sat(a), !sat(b)]);
                }
            }
        }
        for lit in all {
            if !add(&mut solver, &[sat(*lit)]) {
                return Some(None);
            }
        }
        for one in clauses {
            let lits: Vec<SatLit> = one.iter().map(|lit| sat(*lit)).collect();
            if !add(&mut solver, &lits) {
                return Some(None);
            }
        }
        let answer = solver.solve_limited(&[]);
        self.spent.set(self.spent.get() + solver.cb().learnt);
        if answer == lbool::TRUE {
            let is_true = |node: &usize| {
                matches!(self.nodes[*node], Node::Variable)
                    && solver.value_var(vars.get(*node)) == lbool::TRUE
            };
            Some(Some(
                cone.iter()
                    .filter(|node| is_true(node))
                    .map(|node| Lit((*node as u32) << 1))
                    .collect(),
            ))
        } else if answer == lbool::FALSE {
            Some(None)
        } else {
            None
        }
    }
}

/// The value of a literal, given those of all nodes below.
pub(super) fn word_of(words: &[u64], lit: Lit) -> u64 {
    let word = words[lit.node()];
    if lit.is_negated() { !word } else { word }
}

/// The function of a literal whose node was built.
fn read_diagram(bdd: &mut Bdd, made: &OfNodes<Ref>, lit: Lit) -> Result<Ref, Full> {
    let node = made.get(lit.node());
    if lit.is_negated() { bdd.not(node) } else { Ok(node) }
}

/// Stops the solver after this many learnt clauses.
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
