//! The reduced problem as a 0/1 program, solved by branch and bound over linear relaxations (`microlp`).
//!
//! A node with two parts has one variable, a node with more has one for each part. For a net and a part, `any` is 1 if a member is there (any ≥ each member)
//! and `all` is 1 if all members are there (all ≤ each member). A wire is cut by 1 − Σ all, and has any − all pins on a part; a presence has `any` for its parts. Only
//! the variables of nodes are binary: the others then take the right value or one that is no better.

use grafsynth_ir::Gather;
use std::collections::BTreeMap;

use microlp::{ComparisonOp, OptimizationDirection, SolveOptions, TerminationReason, Variable};

use super::model::{Kind, Mask, Model, Net, parts_of};
use super::problem::PartIndex;

/// The result of a search.
#[derive(Clone, Debug)]
pub(super) enum Answer {
    /// The best placement of the free nodes.
    Optimal(Vec<PartIndex>),
    /// The work ran out: the best placement found, and a lower bound on the objective without its decided part if there is one.
    Stopped(Option<Vec<PartIndex>>, Option<f64>),
    /// No placement fits.
    Infeasible,
}

/// A linear expression over variables by index.
#[derive(Clone, Debug, Default)]
struct Sum {
    constant: f64,
    terms: BTreeMap<usize, f64>,
}

impl Sum {
    fn constant(constant: f64) -> Self {
        Self { constant, terms: BTreeMap::new() }
    }

    fn add(&mut self, factor: f64, other: &Self) {
        self.constant += factor * other.constant;
        for (&variable, coefficient) in &other.terms {
            *self.terms.entry(variable).or_default() += factor * coefficient;
        }
    }

    fn minus(&self, other: &Self) -> Self {
        let mut sum = self.clone();
        sum.add(-1.0, other);
        sum
    }
}

/// The program while it is built.
struct Program<'a> {
    model: &'a Model,
    /// Whether each variable is binary.
    variables: Vec<bool>,
    /// Each sum is at most 0.
    rows: Vec<Sum>,
    /// Each sum is 0.
    equations: Vec<Sum>,
    /// By node and part: 1 if the node is there.
    on: Vec<Vec<Sum>>,
    cost: Sum,
    pins: Vec<Sum>,
}

/// An estimate of the work of one relaxation: the number of its coefficients.
pub(super) fn size(model: &Model) -> usize {
    let nodes = model.nodes.iter().map(|node| node.allowed.count_ones() as usize);
    nodes.chain(model.nets.iter().map(|net| net.members.len() * model.parts)).sum()
}

/// Minimises the objective with at most `limit` nodes of the search tree.
pub(super) fn solve(model: &Model, limit: u64, warm: Option<&[PartIndex]>) -> Answer {
    if model.nodes.is_empty() {
        return Answer::Optimal(Vec::new());
    }
    Program::new(model).solve(limit, warm)
}

impl<'a> Program<'a> {
    fn new(model: &'a Model) -> Self {
        let pins = vec![Sum::default(); model.parts];
        let (variables, rows, equations) = (Vec::new(), Vec::new(), Vec::new());
        let mut program =
            Self { model, variables, rows, equations, on: Vec::new(), cost: Sum::default(), pins };
        program.add_nodes();
        model.nets.iter().for_each(|net| program.add_net(net));
        program.add_limits();
        program
    }

    fn variable(&mut self, is_binary: bool) -> Sum {
        self.variables.push(is_binary);
        Sum { constant: 0.0, terms: [(self.variables.len() - 1, 1.0)].into_iter().gather() }
    }

    fn add_nodes(&mut self) {
        for node in &self.model.nodes {
            let mut on = vec![Sum::default(); self.model.parts];
            let mut rest = Sum::constant(1.0);
            let last = node.allowed.ilog2() as usize;
            let is_pair = node.allowed.count_ones() == 2;
            for part in parts_of(node.allowed) {
                on[part] = if is_pair && part == last { rest.clone() } else { self.variable(true) };
                rest.add(-1.0, &on[part]);
                self.cost.add(node.cost[part] as f64, &on[part]);
            }
            if !is_pair {
                self.equations.push(rest);
            }
            self.on.push(on);
        }
    }

    fn add_net(&mut self, net: &Net) {
        let parts: Vec<_> =
            (0..self.model.parts).filter(|&part| self.model.pins[part].is_some()).collect();
        if let Kind::Presence { on, at } = net.kind {
            let pins = if self.model.pins[at].is_some() { net.pins } else { 0 };
            if pins > 0 || net.cost > 0 {
                let any = self.any(net, on);
                self.cost.add(net.cost as f64, &any);
                self.pins[at].add(pins as f64, &any);
            }
            return;
        }
        if parts.is_empty() && net.cost == 0 {
            return;
        }
        if self.model.parts == 2 {
            // With two parts, a cut wire has a pin on each.
            let cut = self.cut_of_two(net);
            self.cost.add(net.cost as f64, &cut);
            parts.iter().for_each(|&part| self.pins[part].add(net.pins as f64, &cut));
            return;
        }
        let all: Vec<_> = (0..self.model.parts).map(|part| self.all(net, part)).collect();
        self.cost.constant += net.cost as f64;
        all.iter().for_each(|all| self.cost.add(-net.cost as f64, all));
        for part in parts {
            let pin = self.any(net, 1 << part).minus(&all[part]);
            self.pins[part].add(net.pins as f64, &pin);
        }
    }

    fn cut_of_two(&mut self, net: &Net) -> Sum {
        if let ([a, b], 0) = (&net.members[..], net.placed) {
            let cut = self.variable(false);
            let apart = self.on[*a][0].minus(&self.on[*b][0]);
            self.rows.push(apart.minus(&cut));
            self.rows.push(Sum::default().minus(&apart).minus(&cut));
            return cut;
        }
        let (first, second) = (self.all(net, 0), self.all(net, 1));
        Sum::constant(1.0).minus(&first).minus(&second)
    }

    /// At least 1 if a member is on one of these parts.
    fn any(&mut self, net: &Net, on: Mask) -> Sum {
        if net.placed & on != 0 {
            return Sum::constant(1.0);
        }
        let here = |member: usize| {
            let mut here = Sum::default();
            parts_of(on).for_each(|part| here.add(1.0, &self.on[member][part]));
            here
        };
        let allowed = |member: &usize| self.model.nodes[*member].allowed & on != 0;
        let members: Vec<Sum> = net.members.iter().copied().filter(allowed).map(here).collect();
        match &members[..] {
            [] => Sum::default(),
            [member] => member.clone(),
            _ => {
                let any = self.variable(false);
                members.iter().for_each(|here| self.rows.push(here.minus(&any)));
                any
            }
        }
    }

    fn all(&mut self, net: &Net, part: PartIndex) -> Sum {
        let is_possible = net.placed & !(1 << part) == 0
            && net.members.iter().all(|&member| self.model.nodes[member].allowed >> part & 1 == 1);
        match net.members[..] {
            _ if !is_possible => Sum::default(),
            [member] => self.on[member][part].clone(),
            _ => {
                let all = self.variable(false);
                net.members
                    .iter()
                    .for_each(|&member| self.rows.push(all.minus(&self.on[member][part])));
                all
            }
        }
    }

    fn use_of(&self, part: PartIndex, resource: usize) -> Sum {
        let mut sum = Sum::default();
        for (node, on) in self.model.nodes.iter().zip(&self.on) {
            if node.uses[part][resource] != 0 {
                sum.add(node.uses[part][resource] as f64, &on[part]);
            }
        }
        sum
    }

    fn add_limits(&mut self) {
        for part in 0..self.model.parts {
            for resource in 0..self.model.resources {
                if let Some(capacity) = self.model.capacity[part][resource] {
                    self.rows
                        .push(self.use_of(part, resource).minus(&Sum::constant(capacity as f64)));
                }
            }
            if let Some(pins) = self.model.pins[part] {
                self.rows.push(self.pins[part].minus(&Sum::constant(pins as f64)));
            }
        }
        for set in &self.model.forbidden {
            let mut sum = Sum::constant(1.0 - set.len() as f64);
            set.iter().for_each(|&(node, part)| sum.add(1.0, &self.on[node][part]));
            self.rows.push(sum);
        }
    }

    fn solve(self, limit: u64, warm: Option<&[PartIndex]>) -> Answer {
        let mut program = microlp::Problem::new(OptimizationDirection::Minimize);
        let mut variables: Vec<Variable> = Vec::new();
        for (index, &is_binary) in self.variables.iter().enumerate() {
            let weight = self.cost.terms.get(&index).copied().unwrap_or_default();
            variables.push(if is_binary {
                program.add_binary_var(weight)
            } else {
                program.add_var(weight, (0.0, 1.0))
            });
        }
        let rows = self
            .rows
            .iter()
            .map(|row| (row, ComparisonOp::Le))
            .chain(self.equations.iter().map(|row| (row, ComparisonOp::Eq)));
        for (row, operator) in rows {
            let terms: Vec<_> = row
                .terms
                .iter()
                .filter(|(_, factor)| **factor != 0.0)
                .map(|(&variable, &factor)| (variables[variable], factor))
                .collect();
            program.add_constraint(terms, operator, -row.constant);
        }
        let mut options = SolveOptions::default();
        options.node_limit = Some(limit);
        options.warm_start = warm.map(|warm| self.hint(warm, &variables));
        let outcome = match program.solve_with(options) {
            Ok(outcome) => outcome,
            Err(microlp::Error::Infeasible) => return Answer::Infeasible,
            // Numerical failures: nothing is known.
            Err(_) => return Answer::Stopped(None, None),
        };
        let bound = outcome.stats().best_bound.map(|bound| bound + self.cost.constant);
        let is_proved = outcome.termination_reason() == TerminationReason::ProvenOptimal;
        match outcome.solution() {
            Some(solution) if is_proved => {
                Answer::Optimal(self.placement(|variable| solution.var_value(variables[variable])))
            }
            Some(solution) => Answer::Stopped(
                Some(self.placement(|variable| solution.var_value(variables[variable]))),
                bound,
            ),
            None => Answer::Stopped(None, bound),
        }
    }

    /// The values of the node variables in a placement.
    fn hint(&self, warm: &[PartIndex], variables: &[Variable]) -> Vec<(Variable, f64)> {
        let mut hint = Vec::new();
        for (on, &here) in self.on.iter().zip(warm) {
            for (part, sum) in on.iter().enumerate() {
                if let (Some((&variable, _)), 1, 0.0) =
                    (sum.terms.first_key_value(), sum.terms.len(), sum.constant)
                {
                    hint.push((variables[variable], f64::from(u8::from(part == here))));
                }
            }
        }
        hint
    }

    /// The placement that corresponds to the values of variables: each node is on the part with the largest value.
    fn placement(&self, value: impl Fn(usize) -> f64) -> Vec<PartIndex> {
        let evaluate = |sum: &Sum| {
            sum.terms.iter().map(|(&variable, factor)| factor * value(variable)).sum::<f64>()
                + sum.constant
        };
        let place = |(node, on): (&super::model::FreeNode, &Vec<Sum>)| {
            parts_of(node.allowed)
                .max_by(|&a, &b| evaluate(&on[a]).total_cmp(&evaluate(&on[b])))
                .unwrap_or(0)
        };
        self.model.nodes.iter().zip(&self.on).map(place).collect()
    }
}
