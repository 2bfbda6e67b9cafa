//! The functions of a [`Logic`] as decision diagrams.

use crate::bdd::{Bdd, Full, Ref};
use crate::build::for_each_operand;
use grafsynth_ir::logic::{FlopId, Logic, Node, NodeId, PinInputId};
use std::collections::{BTreeMap, BTreeSet};

/// A variable of a circuit's functions: an input bit or the current value of a flip-flop.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Var {
    /// The current value of a flip-flop.
    Flop(FlopId),
    /// An input bit.
    Input(PinInputId),
}

/// The nodes of one circuit in one [`Bdd`]: the level of each variable, and the functions built so far.
///
/// Variables get levels in the order in which functions first need them, which keeps variables used together close to each other. A client that wants
/// another order requests the variables in that order first.
#[derive(Debug, Clone, Default)]
pub struct Functions {
    vars: Vec<Var>,
    /// The level of each variable; a map, because most functions of a large circuit need few of its variables.
    levels: BTreeMap<Var, u32>,
    built: BTreeMap<NodeId, Ref>,
}

impl Functions {
    /// An empty cache.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// The variables, in the order of their levels.
    #[must_use]
    pub fn vars(&self) -> &[Var] {
        &self.vars
    }

    /// The level of a variable; a variable without a level gets the next one.
    pub fn level(&mut self, var: Var) -> u32 {
        let next = u32::try_from(self.vars.len()).unwrap_or(u32::MAX);
        *self.levels.entry(var).or_insert_with(|| {
            self.vars.push(var);
            next
        })
    }

    /// The level of a flip-flop's variable; a variable without a level gets the next one.
    pub fn flop_level(&mut self, flop: FlopId) -> u32 {
        self.level(Var::Flop(flop))
    }

    /// The level of an input's variable; a variable without a level gets the next one.
    pub fn input_level(&mut self, input: PinInputId) -> u32 {
        self.level(Var::Input(input))
    }

    /// The variable of a flip-flop.
    ///
    /// # Errors
    /// If the manager is full.
    pub fn flop(&mut self, bdd: &mut Bdd, flop: FlopId) -> Result<Ref, Full> {
        let level = self.flop_level(flop);
        bdd.var(level)
    }

    /// The variable of an input.
    ///
    /// # Errors
    /// If the manager is full.
    pub fn input(&mut self, bdd: &mut Bdd, input: PinInputId) -> Result<Ref, Full> {
        let level = self.input_level(input);
        bdd.var(level)
    }

    /// The function of a node. The cost depends on the cone of the node, not on the size of the circuit.
    ///
    /// # Errors
    /// If the manager is full.
    pub fn build(&mut self, bdd: &mut Bdd, logic: &Logic, node: NodeId) -> Result<Ref, Full> {
        let mut open = vec![node];
        let mut cone = BTreeSet::new();
        while let Some(next) = open.pop() {
            if !self.built.contains_key(&next) && cone.insert(next) {
                for_each_operand(&logic.nodes[next], |operand| open.push(operand));
            }
        }
        // An operand has a smaller id than its node.
        for id in cone {
            let built = |operand: &NodeId| self.built.get(operand).copied().unwrap_or(Ref::FALSE);
            let function = match &logic.nodes[id] {
                Node::Const(value) => Ref::constant(*value),
                Node::Input(input) => self.input(bdd, *input)?,
                Node::Flop(flop) => self.flop(bdd, *flop)?,
                Node::Not(a) => bdd.not(built(a))?,
                Node::And(all) => {
                    let all: Vec<Ref> = all.iter().map(built).collect();
                    bdd.and_all(all)?
                }
                Node::Or(all) => {
                    let all: Vec<Ref> = all.iter().map(built).collect();
                    bdd.or_all(all)?
                }
                Node::Xor(a, b) => {
                    let (a, b) = (built(a), built(b));
                    bdd.xor(a, b)?
                }
                Node::Mux(a, b, c) => {
                    let (a, b, c) = (built(a), built(b), built(c));
                    bdd.ite(a, b, c)?
                }
            };
            self.built.insert(id, function);
        }
        Ok(self.built.get(&node).copied().unwrap_or(Ref::FALSE))
    }
}
