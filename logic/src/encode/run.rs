//! Statements and expressions over nodes.

use super::{CallSite, Encoder, Place, Value, is_compound, to_bits, value_of};
use crate::bdd::Bdd;
use crate::codes;
use crate::node_bdds::Functions;
use crate::receptivity;
use crate::word::{self, Word};
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::expr::{Expr, ExprKind, Type};
use grafsynth_ir::facts::Invariant;
use grafsynth_ir::logic::{NodeId, Wire};
use grafsynth_ir::net::Evolution;
use grafsynth_ir::program::{CellId, Leaf, Origin, Stmt, TempId, TempRole};
use std::collections::BTreeMap;

/// Conditions of two call sites are compared with diagrams up to this number of nodes.
const EXCLUSIVE_LIMIT: usize = 200_000;

impl Encoder<'_> {
    pub(super) fn block(&mut self, block: &[Stmt], depth: u32) {
        for stmt in block {
            if depth == 0 {
                self.now += 1;
            }
            if self.overflow.is_none() && self.builder.logic.nodes.len() > self.max_nodes {
                self.overflow = Some(self.too_large());
            }
            if self.overflow.is_some() {
                return;
            }
            self.stmt(stmt, depth);
            if depth == 0 {
                self.note_packed();
            }
        }
    }

    /// Once the registers of regions are packed, records the activity of each state as a function of the new state too.
    fn note_packed(&mut self) {
        let Some(regions) = self.regions.filter(|regions| regions.packed_at == self.now) else {
            return;
        };
        for gated in &regions.gated {
            let Some(parent) = self.leaf(gated.parent, true) else { continue };
            let parent = self.as_bool(parent);
            let register = gated.register.map(|cell| self.registers[self.places[cell]].clone());
            let all = register.map(|own| self.as_bool(own)).into_iter().chain([parent]);
            let active = self.builder.and(all.collect::<Vec<_>>());
            self.after[gated.active.index()] = Some(Value::Bool(active));
        }
    }

    fn too_large(&self) -> Diagnostic {
        let message =
            format!("the circuit of `{}` needs more than {} nodes", self.net.name, self.max_nodes);
        let help = match (self.net.settings.evolution, &self.facts.stable_depth) {
            (Evolution::Stable { .. }, _) if self.stepwise.is_some() => {
                "narrow the ranges of arrays and arithmetic, or build for `c`; each micro-step already has its own clock".to_owned()
            }
            (Evolution::Stable { limit }, None) if self.net.emergency.is_some() => format!(
                "use a smaller `limit`: one clock executes {limit} micro-steps, because no smaller depth is proved, and an emergency does not allow one clock per micro-step"
            ),
            (Evolution::Stable { limit }, None) => format!(
                "use a smaller `limit`: one clock executes {limit} micro-steps, because no smaller depth is proved; a chart without calls in statement lists can use one clock per micro-step"
            ),
            (Evolution::Single | Evolution::Stable { .. }, _) => {
                "narrow the ranges of long arrays and of wide divisions and multiplications, or build for `c`".to_owned()
            }
        };
        Diagnostic::error(codes::TOO_LARGE, message).at(self.net.name.span, "this chart").help(help)
    }

    fn stmt(&mut self, stmt: &Stmt, depth: u32) {
        match stmt {
            Stmt::Set(temp, expr) => self.set(*temp, expr, depth),
            Stmt::Store(cell, index, expr) => {
                let Some(value) = self.eval(expr, false) else { return };
                let index = index.as_ref().and_then(|index| self.eval(index, false));
                self.store(*cell, index, value);
            }
            Stmt::If(condition, then, otherwise) => {
                let after = if depth == 0 || self.path_after.is_some() {
                    self.eval_bool(condition, true)
                } else {
                    None
                };
                let Some(condition) = self.eval_bool(condition, false) else { return };
                self.branch(condition, after, then, otherwise, depth);
            }
            Stmt::Repeat { limit, condition, body } => self.repeat(*limit, condition, body, depth),
            Stmt::Output(output, expr) => {
                let after = if depth == 0 { self.eval(expr, true) } else { None };
                if let Some(before) = self.eval(expr, false) {
                    self.outputs.insert(*output, (before, after));
                }
            }
            Stmt::Call(output, arguments) => {
                if let Some(first) = arguments.first() {
                    self.refuse_arguments(*output, first.span);
                }
                let site = CallSite { before: self.path, after: self.path_after };
                self.calls.entry(*output).or_default().push(site);
            }
            Stmt::Mark(_) => {}
            Stmt::Code(_) => {
                if self.builder.as_constant(self.path) != Some(false) {
                    self.refuse_code();
                }
            }
            Stmt::Fault(expr) => {
                let Some(raised) = self.eval_bool(expr, false) else { return };
                let here = self.builder.and([self.path, raised]);
                let fault = self.fault.unwrap_or(here);
                self.fault = Some(if depth == 0 { here } else { self.builder.or([fault, here]) });
                if self.never_faults() {
                    self.fault = None;
                }
            }
        }
    }

    /// True if no fault is possible: this is proved, or evolution ends within the proved depth and there is no queue that could
    /// overflow.
    fn never_faults(&self) -> bool {
        if self.facts.always_stable.is_some() {
            return true;
        }
        let Evolution::Stable { limit } = self.net.settings.evolution else { return false };
        self.net.settings.queue.is_none()
            && self.facts.stable_depth.as_ref().is_some_and(|depth| depth.value <= limit)
    }

    fn set(&mut self, temp: TempId, expr: &Expr<Leaf>, depth: u32) {
        let simpler = is_compound(expr).then(|| receptivity::simplify(expr)).flatten();
        let expr = simpler.as_ref().unwrap_or(expr);
        self.after[temp.index()] = if depth == 0 { self.eval(expr, true) } else { None };
        let Some(value) = self.eval(expr, false) else { return };
        let ty = self.program.temps[temp].ty;
        let value = match (value, ty) {
            (Value::Int(word), Type::Int { lo, hi }) => {
                Value::Int(word.saturated(&mut self.builder, lo, hi))
            }
            (value @ (Value::Bool(_) | Value::Int(_)), Type::Bool | Type::Int { .. }) => value,
        };
        if let (TempRole::Fire(transition), Value::Bool(node)) =
            (self.program.temps[temp].role, &value)
        {
            let transition = &self.net.transitions[transition];
            self.wire(format!("fire_{}", transition.name.text), *node, &transition.meta);
        }
        self.write(self.first_temp + temp.index(), value);
    }

    /// Records the name of an intermediate function, unless it is a constant or a pin with its own name.
    fn wire(&mut self, name: String, node: NodeId, meta: &grafsynth_ir::net::Meta) {
        use grafsynth_ir::logic::Node;
        match self.builder.logic.nodes[node] {
            Node::Const(_) | Node::Input(_) | Node::Flop(_) => {}
            Node::Not(_) | Node::And(_) | Node::Or(_) | Node::Xor(..) | Node::Mux(..) => {
                self.builder.logic.wires.push(Wire { name, node, meta: meta.clone() });
            }
        }
    }

    fn store(&mut self, cell: CellId, index: Option<Value>, value: Value) {
        let declared = &self.program.cells[cell];
        let first = self.places[cell];
        let bits = to_bits(&mut self.builder, value, declared.ty);
        let value = value_of(&mut self.builder, declared.ty, bits);
        let Some(index) = index else {
            self.write(first, value);
            return;
        };
        let index = self.as_word(index);
        for element in 0..declared.len.unwrap_or(1) {
            let number = Word::constant(element.into());
            let here = word::compare(
                &mut self.builder,
                grafsynth_ir::expr::CompareOp::Eq,
                &index,
                &number,
            );
            let place = first + element as usize;
            let Some(old) = self.values[place].clone() else {
                unreachable!("a cell always has a value")
            };
            let new = self.choose(here, value.clone(), old);
            self.write(place, new);
        }
    }

    fn write(&mut self, place: Place, value: Value) {
        let old = self.values[place].replace(value);
        if let Some(frame) = self.log.last_mut() {
            frame.entry(place).or_insert(old);
        }
    }

    fn branch(
        &mut self,
        condition: NodeId,
        after: Option<NodeId>,
        then: &[Stmt],
        otherwise: &[Stmt],
        depth: u32,
    ) {
        if let Some(value) = self.builder.as_constant(condition) {
            // Even in a branch that always runs, calls and outputs have a form over the new state only if the condition has one.
            let outer = self.path_after;
            self.path_after = self.join_after(after, value);
            self.block(if value { then } else { otherwise }, depth + 1);
            self.path_after = outer;
            return;
        }
        let (outer, outer_after) = (self.path, self.path_after);
        self.path = self.builder.and([outer, condition]);
        self.path_after = self.join_after(after, true);
        let taken = self.framed(then, depth);
        let not = self.builder.not(condition);
        self.path = self.builder.and([outer, not]);
        self.path_after = outer_after;
        self.path_after = self.join_after(after, false);
        let skipped = self.framed(otherwise, depth);
        self.path = outer;
        self.path_after = outer_after;
        self.merge(condition, taken, skipped);
    }

    fn join_after(&mut self, after: Option<NodeId>, value: bool) -> Option<NodeId> {
        let (path, after) = (self.path_after?, after?);
        let after = if value { after } else { self.builder.not(after) };
        Some(self.builder.and([path, after]))
    }

    /// Runs a branch, undoes its writes, and returns them.
    fn framed(&mut self, block: &[Stmt], depth: u32) -> BTreeMap<Place, Option<Value>> {
        self.log.push(BTreeMap::new());
        self.block(block, depth + 1);
        let mut frame = self.log.pop().unwrap_or_default();
        for (&place, value) in &mut frame {
            std::mem::swap(&mut self.values[place], value);
        }
        frame
    }

    fn merge(
        &mut self,
        condition: NodeId,
        mut taken: BTreeMap<Place, Option<Value>>,
        mut skipped: BTreeMap<Place, Option<Value>>,
    ) {
        let mut places: Vec<Place> = taken.keys().chain(skipped.keys()).copied().collect();
        places.sort_unstable();
        places.dedup();
        for place in places {
            let now = self.values[place].clone();
            let then = taken.remove(&place).unwrap_or_else(|| now.clone());
            let otherwise = skipped.remove(&place).unwrap_or(now);
            // A temporary that only one branch sets is read only if that branch ran.
            let merged = match (then, otherwise) {
                (Some(then), Some(otherwise)) => self.choose(condition, then, otherwise),
                (Some(value), None) | (None, Some(value)) => value,
                (None, None) => continue,
            };
            self.write(place, merged);
        }
    }

    fn choose(&mut self, condition: NodeId, then: Value, otherwise: Value) -> Value {
        match (then, otherwise) {
            (Value::Bool(then), Value::Bool(otherwise)) => {
                Value::Bool(self.builder.mux(condition, then, otherwise))
            }
            (then, otherwise) => {
                let (then, otherwise) = (self.as_word(then), self.as_word(otherwise));
                Value::Int(word::select(&mut self.builder, condition, &then, &otherwise))
            }
        }
    }

    /// Encodes micro-steps in one clock: each round runs if its condition is true. A round that does not run changes nothing, so the next condition is false
    /// too and needs no nesting.
    fn repeat(&mut self, limit: u32, condition: &Expr<Leaf>, body: &[Stmt], depth: u32) {
        // The proved bound of rounds applies to the outermost loop that changes the situation. Loops inside it resolve conflicts, and another
        // outermost loop orders due sends; they have their own bounds.
        let is_evolution = depth == 0 && self.moves(body);
        let rounds = match self.facts.most_rounds(self.net).filter(|_| is_evolution) {
            Some(proved) => limit.min(proved.value),
            None => limit,
        };
        for _ in 0..rounds {
            let Some(goes_on) = self.eval_bool(condition, false) else { return };
            if self.builder.as_constant(goes_on) == Some(false) || self.overflow.is_some() {
                return;
            }
            self.branch(goes_on, None, body, &[], depth);
        }
    }

    /// True if the block may change the bit of a step.
    fn moves(&self, block: &[Stmt]) -> bool {
        super::multicycle::moves(self.program, block)
    }

    pub(super) fn eval_bool(&mut self, expr: &Expr<Leaf>, after: bool) -> Option<NodeId> {
        let value = self.eval(expr, after)?;
        Some(self.as_bool(value))
    }

    fn as_bool(&mut self, value: Value) -> NodeId {
        match value {
            Value::Bool(node) => node,
            Value::Int(word) => {
                let zero = Word::constant(0);
                word::compare(&mut self.builder, grafsynth_ir::expr::CompareOp::Ne, &word, &zero)
            }
        }
    }

    fn as_word(&mut self, value: Value) -> Word {
        match value {
            Value::Int(word) => word,
            Value::Bool(node) => match self.builder.as_constant(node) {
                Some(value) => Word::constant(value.into()),
                None => Word::flag(node),
            },
        }
    }

    /// The value of an expression over the current state of the execution, or (`after`) over the state after the clock edge. `None` if a temporary is
    /// not set or, with `after`, if some cell is stored later.
    pub(super) fn eval(&mut self, expr: &Expr<Leaf>, after: bool) -> Option<Value> {
        Some(match &expr.kind {
            ExprKind::Bool(value) => Value::Bool(self.builder.constant(*value)),
            ExprKind::Int(value) => Value::Int(Word::constant(*value)),
            ExprKind::Leaf(leaf) => self.leaf(*leaf, after)?,
            ExprKind::Element(leaf, index) => {
                let index = self.eval(index, after)?;
                let index = self.as_word(index);
                self.element(*leaf, &index, after)?
            }
            ExprKind::Not(a) => {
                let a = self.eval_bool(a, after)?;
                Value::Bool(self.builder.not(a))
            }
            ExprKind::And(all) => {
                let all =
                    all.iter().map(|a| self.eval_bool(a, after)).collect::<Option<Vec<_>>>()?;
                Value::Bool(self.builder.and(all))
            }
            ExprKind::Or(all) => {
                let all =
                    all.iter().map(|a| self.eval_bool(a, after)).collect::<Option<Vec<_>>>()?;
                Value::Bool(self.builder.or(all))
            }
            ExprKind::Compare(op, a, b) => {
                let (a, b) = (self.eval(a, after)?, self.eval(b, after)?);
                let (a, b) = (self.as_word(a), self.as_word(b));
                Value::Bool(word::compare(&mut self.builder, *op, &a, &b))
            }
            ExprKind::Neg(a) => {
                let a = self.eval(a, after)?;
                Value::Int(self.as_word(a).negated(&mut self.builder))
            }
            ExprKind::Arith(op, a, b) => {
                let (a, b) = (self.eval(a, after)?, self.eval(b, after)?);
                let (a, b) = (self.as_word(a), self.as_word(b));
                Value::Int(word::arith(&mut self.builder, *op, a, b))
            }
            ExprKind::Select(condition, then, otherwise) => {
                let condition = self.eval_bool(condition, after)?;
                match self.builder.as_constant(condition) {
                    Some(true) => self.eval(then, after)?,
                    Some(false) => self.eval(otherwise, after)?,
                    None => {
                        let (then, otherwise) =
                            (self.eval(then, after)?, self.eval(otherwise, after)?);
                        self.choose(condition, then, otherwise)
                    }
                }
            }
        })
    }

    fn leaf(&mut self, leaf: Leaf, after: bool) -> Option<Value> {
        match leaf {
            Leaf::Cell(cell) => self.place(self.places[cell], cell, after),
            Leaf::Temp(temp) if after => self.after[temp.index()].clone(),
            Leaf::Temp(temp) => self.values[self.first_temp + temp.index()].clone(),
            Leaf::Input(input) => Some(self.inputs[input].clone()),
            Leaf::Dt => Some(match self.tick {
                Some((_, node)) => Value::Int(Word::flag(node)),
                None => Value::Int(Word::constant(0)),
            }),
        }
    }

    fn place(&self, place: Place, cell: CellId, after: bool) -> Option<Value> {
        if !after {
            return self.values[place].clone();
        }
        (self.last_store[cell] < self.now).then(|| self.registers[place].clone())
    }

    fn element(&mut self, leaf: Leaf, index: &Word, after: bool) -> Option<Value> {
        let Leaf::Cell(cell) = leaf else { return None };
        let first = self.places[cell];
        let count = self.program.cells[cell].len.unwrap_or(1) as usize;
        let mut row = (0..count)
            .map(|element| self.place(first + element, cell, after))
            .collect::<Option<Vec<_>>>()?;
        let bits = index.clone().register_bits(
            &mut self.builder,
            0,
            i64::try_from(count).unwrap_or(i64::MAX).saturating_sub(1).max(0),
        );
        // Each index bit halves the row; elements beyond the end are never read.
        for bit in bits {
            let mut half = Vec::with_capacity(row.len().div_ceil(2));
            let mut pairs = row.into_iter();
            while let Some(even) = pairs.next() {
                half.push(match pairs.next() {
                    Some(odd) => self.choose(bit, odd, even),
                    None => even,
                });
            }
            row = half;
        }
        row.into_iter().next()
    }

    /// True if place invariants and diagrams of bounded size show that no two of these calls happen in one reaction.
    pub(super) fn exclusive(&mut self, sites: &[CallSite]) -> bool {
        if sites.len() < 2 {
            return true;
        }
        let mut bdd = Bdd::with_limit(EXCLUSIVE_LIMIT);
        let mut functions = Functions::new();
        let mut check = || -> Result<bool, crate::bdd::Full> {
            // At most one step of a component with one token is active.
            let mut possible = crate::bdd::Ref::TRUE;
            let step_flop = |step| {
                let holds = |flop: &grafsynth_ir::logic::Flop| {
                    flop.holds.is_some_and(|bit| bit.origin == Origin::Step(step))
                };
                self.builder.logic.flops.iter().find(|(_, flop)| holds(flop)).map(|(id, _)| id)
            };
            // A state that is coded by its region has no flip-flop that represents it alone.
            let is_told = |invariant: &Invariant| {
                invariant.steps.iter().all(|&step| step_flop(step).is_some())
            };
            for invariant in self.facts.invariants.iter().filter(|invariant| invariant.count == 1) {
                if !is_told(invariant) {
                    continue;
                }
                let mut none = crate::bdd::Ref::TRUE;
                let mut one = crate::bdd::Ref::FALSE;
                for flop in invariant.steps.iter().filter_map(|&step| step_flop(step)) {
                    let var = functions.flop(&mut bdd, flop)?;
                    let alone = bdd.and(none, var)?;
                    let kept = bdd.and_not(one, var)?;
                    one = bdd.or(alone, kept)?;
                    none = bdd.and_not(none, var)?;
                }
                possible = bdd.and(possible, one)?;
            }
            let mut seen = crate::bdd::Ref::FALSE;
            for site in sites {
                let call = functions.build(&mut bdd, &self.builder.logic, site.before)?;
                let both = bdd.and(seen, call)?;
                if bdd.and(both, possible)? != crate::bdd::Ref::FALSE {
                    return Ok(false);
                }
                seen = bdd.or(seen, call)?;
            }
            Ok(true)
        };
        check().unwrap_or(false)
    }
}
