//! Which transitions that leave the same step can be fireable together. Components under the policy `all` (semantics §4) depend on this, because there each
//! fireable transition fires, even if it shares a preceding step with others.
//!
//! The answer is computed with a small decision diagram over *atoms*: Boolean leaves, thresholds of integer expressions, and other comparisons. The
//! diagram does not know the meaning of an opaque atom; this can only make it answer "together" too often, never too rarely.

use std::collections::{BTreeMap, BTreeSet};

use grafsynth_ir::arena::IdMap;
use grafsynth_ir::expr::{CompareOp, ExprKind, Type};
use grafsynth_ir::interval::{TICKS, net_type};
use grafsynth_ir::net::{
    Enter, Expr, Leaf, Net, Policy, PropertyLeaf, PropertyRole, Step, StepId, Transition,
    TransitionId, TransitionKind,
};
use grafsynth_logic::bdd::{Bdd, Full, Ref};

/// The maximum size of the diagram for the transitions of one step; beyond it they count as not exclusive.
const NODE_LIMIT: usize = 1 << 14;
/// The maximum number of transitions of one step; if there are more, they count as not exclusive.
const TRANSITION_LIMIT: usize = 512;

/// Two transitions that share a preceding step and may fire in one micro-step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Overlap {
    /// The preceding step that both transitions share.
    pub step: StepId,
    /// The transition that is declared first.
    pub first: TransitionId,
    /// The other transition.
    pub second: TransitionId,
    /// True if the comparison of the receptivities was completed. If it was abandoned, the two transitions count as compatible.
    pub is_certain: bool,
}

/// The moves that leave each step, in declaration order.
#[must_use]
pub fn leaving(net: &Net) -> IdMap<Step, Vec<TransitionId>> {
    let mut leaving = IdMap::filled(&net.steps, Vec::new());
    for (id, transition) in net.transitions.iter() {
        if transition.kind == TransitionKind::Move {
            for step in &transition.requires {
                leaving[*step].push(id);
            }
        }
    }
    leaving
}

/// The steps that a move names as entered, in order. In a statechart, it may also enter initial contents and histories, which are omitted here.
pub fn entered(transition: &Transition) -> impl Iterator<Item = StepId> + '_ {
    transition.enters.iter().filter_map(|enter| match enter {
        Enter::Step(step) => Some(*step),
        Enter::InitialContent(_) | Enter::History(_) => None,
    })
}

/// For each step with several leaving moves, the first pair whose receptivities can be true together, whatever the policy does. Pairs that enter the
/// same steps are skipped: for the situation, firing both is the same as firing one.
#[must_use]
pub fn compatible_pairs(net: &Net) -> Vec<Overlap> {
    let leaving = leaving(net);
    let mut overlaps = Vec::new();
    for (step, all) in leaving.iter() {
        if all.len() > 1
            && let Some(overlap) = first_overlap(net, step, all)
        {
            overlaps.push(overlap);
        }
    }
    overlaps
}

/// All pairs of moves that share a preceding step and whose receptivities can be true together, or for which this is unknown; the one declared first
/// comes first.
pub(crate) fn all_compatible_pairs(net: &Net) -> Vec<(TransitionId, TransitionId)> {
    let mut pairs = BTreeSet::new();
    for all in leaving(net).values() {
        let mut guards = Guards::new(net);
        for (at, second) in all.iter().enumerate() {
            for first in &all[..at] {
                if !pairs.contains(&(*first, *second))
                    && guards.together(*first, *second).unwrap_or(true)
                {
                    pairs.insert((*first, *second));
                }
            }
        }
    }
    pairs.into_iter().collect()
}

/// The pairs of [`compatible_pairs`] that the policy lets fire together; none if transitions compete under the policy.
#[must_use]
pub fn firing_together(net: &Net) -> Vec<Overlap> {
    match net.settings.policy {
        Policy::All if !net.settings.fire_one => compatible_pairs(net),
        _ => Vec::new(),
    }
}

fn first_overlap(net: &Net, step: StepId, all: &[TransitionId]) -> Option<Overlap> {
    let targets: Vec<Vec<StepId>> = all
        .iter()
        .map(|t| {
            let mut steps: Vec<StepId> = entered(&net.transitions[*t]).collect();
            steps.sort_unstable();
            steps
        })
        .collect();
    if targets.iter().all(|t| *t == targets[0]) {
        return None;
    }
    let uncertain =
        |second: usize| Overlap { step, first: all[0], second: all[second], is_certain: false };
    if all.len() > TRANSITION_LIMIT {
        return Some(uncertain(1));
    }
    if pairwise_contradictory(net, all, &targets) {
        return None;
    }
    let mut guards = Guards::new(net);
    for second in 1..all.len() {
        for first in 0..second {
            if targets[first] == targets[second] {
                continue;
            }
            match guards.together(all[first], all[second]) {
                Ok(false) => {}
                Ok(true) => {
                    return Some(Overlap {
                        step,
                        first: all[first],
                        second: all[second],
                        is_certain: true,
                    });
                }
                Err(Full { .. }) => return Some(uncertain(second)),
            }
        }
    }
    None
}

/// True if every two transitions contain contradictory literals: a quick test that settles most charts.
fn pairwise_contradictory(net: &Net, all: &[TransitionId], targets: &[Vec<StepId>]) -> bool {
    if all.len() > 16 {
        return false;
    }
    let literals: Vec<Vec<(Leaf, bool)>> = all
        .iter()
        .map(|t| {
            let mut out = vec![(Leaf::Fireable(*t), true)];
            conjuncts(&net.transitions[*t].guard, &mut out);
            out
        })
        .collect();
    (0..all.len()).all(|b| {
        (0..b).all(|a| {
            targets[a] == targets[b]
                || literals[a].iter().any(|(leaf, value)| literals[b].contains(&(*leaf, !*value)))
        })
    })
}

fn conjuncts(expr: &Expr, out: &mut Vec<(Leaf, bool)>) {
    match &expr.kind {
        ExprKind::Leaf(leaf) => out.push((*leaf, true)),
        ExprKind::Not(inner) => {
            if let ExprKind::Leaf(leaf) = inner.kind {
                out.push((leaf, false));
            }
        }
        ExprKind::And(all) => all.iter().for_each(|one| conjuncts(one, out)),
        _ => {}
    }
}

/// The condition that a variable of the diagram represents.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
enum Atom {
    /// A Boolean value.
    Leaf(Leaf),
    /// The integer expression is at least this value.
    AtLeast(Expr, i64),
    /// Any other condition, without spans.
    Opaque(Expr),
}

/// Receptivities as decision diagrams.
pub(crate) struct Guards<'a> {
    net: &'a Net,
    bdd: Bdd,
    atoms: BTreeMap<Atom, u32>,
    by_level: Vec<Atom>,
}

impl<'a> Guards<'a> {
    pub(crate) fn new(net: &'a Net) -> Self {
        Guards {
            net,
            bdd: Bdd::with_limit(NODE_LIMIT),
            atoms: BTreeMap::new(),
            by_level: Vec::new(),
        }
    }

    /// True if both transitions may be fireable in one check.
    pub(crate) fn together(
        &mut self,
        first: TransitionId,
        second: TransitionId,
    ) -> Result<bool, Full> {
        let a = self.fireable(first)?;
        let b = self.fireable(second)?;
        let both = self.bdd.and(a, b)?;
        self.satisfiable(both)
    }

    fn fireable(&mut self, id: TransitionId) -> Result<Ref, Full> {
        let net = self.net;
        let transition = &net.transitions[id];
        let mut parts = vec![self.atom(Atom::Leaf(Leaf::Fireable(id)))?];
        for step in &transition.requires {
            parts.push(self.atom(Atom::Leaf(Leaf::Active(*step)))?);
        }
        if !transition.events.is_empty() {
            let mut events = Vec::new();
            for event in &transition.events {
                events.push(self.atom(Atom::Leaf(Leaf::Input(*event)))?);
            }
            parts.push(self.bdd.or_all(events)?);
        }
        parts.push(self.function(&transition.guard)?);
        self.bdd.and_all(parts)
    }

    fn satisfiable(&mut self, candidate: Ref) -> Result<bool, Full> {
        let mut rest = candidate;
        // Constraints may add new atoms (operands of edges); two rounds are enough for those of their operands.
        for _ in 0..2 {
            if rest == Ref::FALSE {
                return Ok(false);
            }
            let levels = self.bdd.support(rest);
            let constraint = self.constraints(&levels)?;
            rest = self.bdd.and(rest, constraint)?;
        }
        Ok(rest != Ref::FALSE)
    }

    /// Conditions on these atoms that are always true.
    fn constraints(&mut self, levels: &[u32]) -> Result<Ref, Full> {
        let mut parts = Vec::new();
        let atoms: Vec<Atom> =
            levels.iter().filter_map(|level| self.by_level.get(*level as usize).cloned()).collect();
        let mut thresholds: Vec<(Expr, i64)> = Vec::new();
        for atom in &atoms {
            match atom {
                Atom::AtLeast(expr, value) => thresholds.push((expr.clone(), *value)),
                Atom::Leaf(Leaf::Rise(edge)) => {
                    let edge_atom = self.atom(atom.clone())?;
                    let now = self.function(&self.net.edges[*edge].expr)?;
                    let broken = self.bdd.and_not(edge_atom, now)?;
                    parts.push(self.bdd.not(broken)?);
                }
                Atom::Leaf(Leaf::Fall(edge)) => {
                    let edge_atom = self.atom(atom.clone())?;
                    let now = self.function(&self.net.edges[*edge].expr)?;
                    let broken = self.bdd.and(edge_atom, now)?;
                    parts.push(self.bdd.not(broken)?);
                }
                _ => {}
            }
        }
        thresholds.sort_unstable();
        for pair in thresholds.windows(2) {
            if pair[0].0 == pair[1].0 {
                let low = self.atom(Atom::AtLeast(pair[0].0.clone(), pair[0].1))?;
                let high = self.atom(Atom::AtLeast(pair[1].0.clone(), pair[1].1))?;
                let broken = self.bdd.and_not(high, low)?;
                parts.push(self.bdd.not(broken)?);
            }
        }
        for property in
            self.net.properties.iter().filter(|property| property.role == PropertyRole::Assume)
        {
            // Only assumptions whose inputs all occur here can exclude anything, and only small ones are worth the effort.
            let mut known = true;
            for leaf in property.never.leaves() {
                match leaf {
                    // The chart itself may have raised an event of a receptivity; the assumption applies only to the row.
                    PropertyLeaf::Net(Leaf::Input(input))
                        if self.net.inputs[*input].kind.is_event() =>
                    {
                        known = false
                    }
                    PropertyLeaf::Net(leaf) => known &= self.mentions(leaf, &atoms),
                    PropertyLeaf::Output(_) => known = false,
                }
            }
            if known && let Some(never) = net_expr(&property.never) {
                let never = self.function(&never)?;
                parts.push(self.bdd.not(never)?);
            }
        }
        self.bdd.and_all(parts)
    }

    fn mentions(&self, leaf: &Leaf, atoms: &[Atom]) -> bool {
        atoms.iter().any(|atom| match atom {
            Atom::Leaf(own) => own == leaf,
            Atom::AtLeast(expr, _) | Atom::Opaque(expr) => expr.leaves().any(|own| own == leaf),
        })
    }

    fn atom(&mut self, atom: Atom) -> Result<Ref, Full> {
        let level = match self.atoms.get(&atom) {
            Some(level) => *level,
            None => {
                let level = self.by_level.len() as u32;
                self.by_level.push(atom.clone());
                self.atoms.insert(atom, level);
                level
            }
        };
        self.bdd.var(level)
    }

    fn function(&mut self, expr: &Expr) -> Result<Ref, Full> {
        match &expr.kind {
            ExprKind::Bool(value) => Ok(Ref::constant(*value)),
            ExprKind::Leaf(leaf) => self.atom(Atom::Leaf(*leaf)),
            ExprKind::Not(inner) => {
                let inner = self.function(inner)?;
                self.bdd.not(inner)
            }
            ExprKind::And(all) => {
                let all =
                    all.iter().map(|one| self.function(one)).collect::<Result<Vec<_>, _>>()?;
                self.bdd.and_all(all)
            }
            ExprKind::Or(all) => {
                let all =
                    all.iter().map(|one| self.function(one)).collect::<Result<Vec<_>, _>>()?;
                self.bdd.or_all(all)
            }
            ExprKind::Select(condition, then, otherwise) => {
                let condition = self.function(condition)?;
                let then = self.function(then)?;
                let otherwise = self.function(otherwise)?;
                self.bdd.ite(condition, then, otherwise)
            }
            ExprKind::Compare(op, a, b) => self.compare(*op, a, b),
            // Elements of Boolean arrays; the others are numbers, which occur only below a comparison.
            ExprKind::Element(..) | ExprKind::Int(_) | ExprKind::Neg(_) | ExprKind::Arith(..) => {
                self.atom(Atom::Opaque(expr.without_spans()))
            }
        }
    }

    /// The range of one side of a comparison. Ticks have no type of their own, because they occur only in comparisons; nothing else in a valid net
    /// lacks a type.
    fn type_of(&self, side: &Expr) -> Type {
        match &side.kind {
            ExprKind::Leaf(leaf) if leaf.is_time() => TICKS,
            _ => net_type(self.net, side).unwrap_or(Type::Int { lo: i64::MIN, hi: i64::MAX }),
        }
    }

    fn compare(&mut self, op: CompareOp, a: &Expr, b: &Expr) -> Result<Ref, Full> {
        let (type_a, type_b) = (self.type_of(a), self.type_of(b));
        if type_a.is_bool() && type_b.is_bool() && matches!(op, CompareOp::Eq | CompareOp::Ne) {
            let a = self.function(a)?;
            let b = self.function(b)?;
            return if op == CompareOp::Eq { self.bdd.iff(a, b) } else { self.bdd.xor(a, b) };
        }
        let (value, constant, op) = match (type_a.bounds(), type_b.bounds()) {
            (_, (lo, hi)) if lo == hi => (a, lo, op),
            ((lo, hi), _) if lo == hi => (b, lo, op.mirrored()),
            _ => {
                // Two numbers that vary: one atom for `<` and one for `>`; `=` is the remaining case.
                let (a, b) = (a.without_spans(), b.without_spans());
                let less =
                    self.atom(Atom::Opaque(Expr::compare(CompareOp::Lt, a.clone(), b.clone())))?;
                let more = self.atom(Atom::Opaque(Expr::compare(CompareOp::Lt, b, a)))?;
                return match op {
                    CompareOp::Lt => Ok(less),
                    CompareOp::Gt => Ok(more),
                    CompareOp::Ge => self.bdd.not(less),
                    CompareOp::Le => self.bdd.not(more),
                    CompareOp::Ne => self.bdd.or(less, more),
                    CompareOp::Eq => {
                        let differ = self.bdd.or(less, more)?;
                        self.bdd.not(differ)
                    }
                };
            }
        };
        let bounds = if std::ptr::eq(value, a) { type_a.bounds() } else { type_b.bounds() };
        let value = value.without_spans();
        let at_least = |this: &mut Self, limit: Option<i64>| match limit {
            None => Ok(Ref::FALSE),
            Some(limit) if limit <= bounds.0 => Ok(Ref::TRUE),
            Some(limit) if limit > bounds.1 => Ok(Ref::FALSE),
            Some(limit) => this.atom(Atom::AtLeast(value.clone(), limit)),
        };
        let reached = at_least(self, Some(constant))?;
        let passed = at_least(self, constant.checked_add(1))?;
        match op {
            CompareOp::Ge => Ok(reached),
            CompareOp::Lt => self.bdd.not(reached),
            CompareOp::Gt => Ok(passed),
            CompareOp::Le => self.bdd.not(passed),
            CompareOp::Eq => self.bdd.and_not(reached, passed),
            CompareOp::Ne => {
                let equal = self.bdd.and_not(reached, passed)?;
                self.bdd.not(equal)
            }
        }
    }
}

/// A property that reads no output, as an expression of the net.
pub(crate) fn net_expr(expr: &grafsynth_ir::net::PropertyExpr) -> Option<Expr> {
    let leaf = |leaf: &PropertyLeaf| leaf.net().copied().ok_or(());
    expr.try_map(&mut |one, span| Ok(Expr::leaf(leaf(one)?, span)), &mut |one, _| leaf(one)).ok()
}
