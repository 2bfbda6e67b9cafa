//! A transition system: the part of a model that can affect one question, in a graph of its own.

use crate::symbolic::aig::{Aig, Lit};

/// A bit of the state with a value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) struct Bit {
    /// The index of the bit in [`System::next`].
    pub(super) at: u32,
    pub(super) value: bool,
}

impl Bit {
    pub(super) fn index(self) -> usize {
        self.at as usize
    }
}

/// A set of states: those in which all these bits have these values. Sorted by bit.
pub(super) type Cube = Vec<Bit>;

/// A bit of the state as the source of a system gives it.
#[derive(Debug, Clone, Copy)]
pub(in crate::symbolic) struct Register {
    /// Its variable.
    pub(in crate::symbolic) lit: Lit,
    /// Its value after the reaction.
    pub(in crate::symbolic) next: Lit,
    /// Its value after reset.
    pub(in crate::symbolic) first: bool,
}

/// The question whether a reaction from some reachable state can be bad, given by functions in a graph. Variables that are not registers are inputs.
#[derive(Debug, Clone)]
pub(in crate::symbolic) struct Source {
    pub(in crate::symbolic) registers: Vec<Register>,
    /// Conditions on the inputs that are true in every reaction.
    pub(in crate::symbolic) legal: Vec<Lit>,
    /// True if the reaction is bad.
    pub(in crate::symbolic) bad: Lit,
    /// Clauses over registers that are true in every reachable state.
    pub(in crate::symbolic) lemmas: Vec<Vec<Lit>>,
}

/// The registers that can affect whether a reaction is bad, with their functions.
pub(super) struct System {
    pub(super) aig: Aig,
    /// The variable of bit `n` has the node `n + 1`; variables with higher nodes are inputs.
    pub(super) next: Vec<Lit>,
    pub(super) first: Vec<bool>,
    pub(super) legal: Vec<Lit>,
    /// The reaction is bad if one of these is true.
    pub(super) bad: Vec<Lit>,
    /// Sets of states that are known to be unreachable.
    pub(super) lemmas: Vec<Cube>,
    /// For each bit, the lemmas that contain it.
    pub(super) lemmas_of: Vec<Vec<u32>>,
    /// For each bit, its index in [`Source::registers`].
    pub(super) source: Vec<usize>,
    /// For each node, the input of the source that it represents.
    pub(super) inputs: Vec<Option<Lit>>,
}

impl System {
    /// The part of `source` that matters.
    pub(super) fn of(aig: &Aig, source: &Source) -> System {
        let mut register_of: Vec<Option<usize>> = vec![None; aig.len()];
        for (at, register) in source.registers.iter().enumerate() {
            register_of[register.lit.node()] = Some(at);
        }
        let marked = relevant(aig, source, &register_of);
        let mut system = System {
            aig: Aig::new(),
            next: Vec::new(),
            first: Vec::new(),
            legal: Vec::new(),
            bad: Vec::new(),
            lemmas: Vec::new(),
            lemmas_of: Vec::new(),
            source: Vec::new(),
            inputs: Vec::new(),
        };
        let mut made: Vec<Lit> = vec![Lit::FALSE; aig.len()];
        for (node, register) in register_of.iter().enumerate() {
            if let (true, Some(at)) = (marked[node], register) {
                made[node] = system.aig.variable();
                system.source.push(*at);
            }
        }
        system.inputs.resize(system.source.len() + 1, None);
        let is_input = |node: usize| {
            marked[node] && node > 0 && aig.operands(node).is_none() && register_of[node].is_none()
        };
        for (node, made) in made.iter_mut().enumerate().filter(|(node, _)| is_input(*node)) {
            *made = system.aig.variable();
            system.inputs.push(Some(Lit::of_node(node)));
        }
        let read = |made: &[Lit], lit: Lit| made[lit.node()].negate_if(lit.is_negated());
        for node in (0..aig.len()).filter(|node| marked[*node]) {
            if let Some((a, b)) = aig.operands(node) {
                let (a, b) = (read(&made, a), read(&made, b));
                made[node] = system.aig.and(a, b);
            }
        }
        let registers = system.source.iter().map(|at| source.registers[*at]);
        system.next = registers.clone().map(|register| read(&made, register.next)).collect();
        system.first = registers.map(|register| register.first).collect();
        system.legal = source.legal.iter().map(|lit| read(&made, *lit)).collect();
        system.bad = terms(&system.aig, read(&made, source.bad));
        system.inputs.resize(system.aig.len(), None);
        system.lemmas_of = vec![Vec::new(); system.next.len()];
        for clause in &source.lemmas {
            if clause.iter().all(|lit| marked[lit.node()] && register_of[lit.node()].is_some()) {
                system.learn(clause.iter().map(|lit| read(&made, *lit)));
            }
        }
        system
    }

    /// Continues without knowledge about the reachable states.
    pub(super) fn forget_lemmas(&mut self) {
        self.lemmas.clear();
        self.lemmas_of.iter_mut().for_each(Vec::clear);
    }

    fn learn(&mut self, clause: impl Iterator<Item = Lit>) {
        let excluded = |lit: Lit| Bit { at: lit.node() as u32 - 1, value: lit.is_negated() };
        let mut cube: Cube = clause.map(excluded).collect();
        cube.sort_unstable();
        cube.dedup();
        for bit in &cube {
            self.lemmas_of[bit.index()].push(self.lemmas.len() as u32);
        }
        self.lemmas.push(cube);
    }

    /// The bit of a node, if it is the variable of one.
    pub(super) fn bit_of(&self, node: usize) -> Option<usize> {
        (1..=self.next.len()).contains(&node).then(|| node - 1)
    }

    /// The variable of a bit, negated if the bit is 0.
    pub(super) fn now(bit: Bit) -> Lit {
        Lit::of_node(bit.index() + 1).negate_if(!bit.value)
    }

    /// The condition that the bit has this value after the reaction.
    pub(super) fn then(&self, bit: Bit) -> Lit {
        self.next[bit.index()].negate_if(!bit.value)
    }

    /// True if the state after reset is in the cube.
    pub(super) fn starts_in(&self, cube: &[Bit]) -> bool {
        cube.iter().all(|bit| self.first[bit.index()] == bit.value)
    }
}

/// The terms of a disjunction.
fn terms(aig: &Aig, function: Lit) -> Vec<Lit> {
    let mut terms = Vec::new();
    let mut todo = vec![!function];
    while let Some(factor) = todo.pop() {
        match aig.operands(factor.node()) {
            Some((a, b)) if !factor.is_negated() => todo.extend([a, b]),
            Some(_) | None => terms.push(!factor),
        }
    }
    terms.sort_unstable();
    terms.dedup();
    terms
}

/// The nodes that the question depends on, directly or through earlier reactions.
fn relevant(aig: &Aig, source: &Source, register_of: &[Option<usize>]) -> Vec<bool> {
    let mut marked = vec![false; aig.len()];
    let mut todo: Vec<usize> = source.legal.iter().map(|lit| lit.node()).collect();
    todo.push(source.bad.node());
    while let Some(node) = todo.pop() {
        if std::mem::replace(&mut marked[node], true) {
            continue;
        }
        if let Some((a, b)) = aig.operands(node) {
            todo.extend([a.node(), b.node()]);
        }
        todo.extend(register_of[node].map(|at| source.registers[at].next.node()));
    }
    marked
}
