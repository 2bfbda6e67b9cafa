//! Random expressions and lists of statements.

use grafsynth_ir::Span;
use grafsynth_ir::expr::{ArithOp, CompareOp, Expr as GenericExpr, ExprKind, Type};
use grafsynth_ir::interval::net_type;
use grafsynth_ir::net::{
    Driver, EdgeOperand, Expr, InputId, InputKind, Leaf, OutputId, SendId, StepId, Stmt, StmtKind,
    TransitionId, VarId,
};

use super::{ActionBody, Builder, action_ids};

/// The kinds of operands that an expression may read in its context.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Place {
    edges: bool,
    events: bool,
    /// Step bits, variables and timers, in addition to inputs.
    state: bool,
}

const RECEPTIVITY: Place = Place { edges: true, events: true, state: true };
const QUIET: Place = Place { edges: false, events: false, state: true };
const OPERAND: Place = QUIET;
const INPUTS: Place = Place { edges: false, events: false, state: false };

pub(super) fn leaf(leaf: Leaf) -> Expr {
    GenericExpr::leaf(leaf, Span::default())
}

fn new(kind: ExprKind<Leaf>) -> Expr {
    GenericExpr::new(kind, Span::default())
}

pub(super) fn compare(op: CompareOp, a: Expr, b: Expr) -> Expr {
    GenericExpr::compare(op, a, b)
}

impl Builder<'_> {
    /// The receptivity of a transition, mostly simple.
    pub(super) fn receptivity(&mut self) -> Expr {
        let waits = self.on.waits_for_inputs && !self.random.one_in(10);
        let place = if waits { INPUTS } else { RECEPTIVITY };
        match self.random.below(10) {
            0 if !self.net.settings.policy.is_statechart() => GenericExpr::bool(true),
            1..=5 => self.literal(place),
            _ => self.condition(place, 2),
        }
    }

    /// A condition without edges and events.
    pub(super) fn quiet_condition(&mut self, depth: usize) -> Expr {
        self.condition(QUIET, depth)
    }

    pub(super) fn quiet_value(&mut self, ty: Type) -> Expr {
        if ty.is_bool() { self.condition(QUIET, 1) } else { self.number(QUIET, 2) }
    }

    fn condition(&mut self, place: Place, depth: usize) -> Expr {
        if depth == 0 || self.random.one_in(3) {
            return self.literal(place);
        }
        match self.random.below(8) {
            0..=2 => new(ExprKind::And(
                (0..2 + self.random.below(2)).map(|_| self.condition(place, depth - 1)).collect(),
            )),
            3..=5 => new(ExprKind::Or(
                (0..2 + self.random.below(2)).map(|_| self.condition(place, depth - 1)).collect(),
            )),
            6 => {
                let (a, b) = (self.condition(place, depth - 1), self.condition(place, depth - 1));
                let op = if self.random.one_in(2) { CompareOp::Eq } else { CompareOp::Ne };
                compare(op, a, b)
            }
            _ => {
                let operands = [0; 3].map(|_| Box::new(self.condition(place, depth - 1)));
                let [a, b, c] = operands;
                new(ExprKind::Select(a, b, c))
            }
        }
    }

    /// A Boolean expression of one operand, perhaps negated.
    fn literal(&mut self, place: Place) -> Expr {
        let plain = self.plain_literal(place);
        if self.random.one_in(3) { new(ExprKind::Not(Box::new(plain))) } else { plain }
    }

    fn plain_literal(&mut self, place: Place) -> Expr {
        for _ in 0..8 {
            let found = match self.random.below(12) {
                0..=3 => Some(self.input_leaf()),
                4 | 5 if place.state => Some(self.active_leaf()),
                6 if place.edges && self.on.edges => Some(self.edge()),
                7 if place.events => self.event_leaf(),
                8 if place.state && self.on.timers => self.time(),
                9 | 10 if self.on.integers => self.comparison(place),
                11 if place.state => self.other_bit(),
                _ => None,
            };
            if let Some(found) = found {
                return found;
            }
        }
        self.input_leaf()
    }

    pub(super) fn input_leaf(&mut self) -> Expr {
        let pins: Vec<InputId> = (self.net.inputs.iter())
            .filter(|(_, input)| !input.kind.is_event() && input.ty.is_bool())
            .map(|(id, _)| id)
            .collect();
        self.random
            .pick(&pins)
            .map_or_else(|| GenericExpr::bool(true), |input| leaf(Leaf::Input(*input)))
    }

    pub(super) fn active_leaf(&mut self) -> Expr {
        leaf(Leaf::Active(self.any_step()))
    }

    pub(super) fn any_event(&mut self, only_internal: bool) -> Option<InputId> {
        let events: Vec<InputId> = (self.net.inputs.iter())
            .filter(|(_, input)| {
                input.kind.is_event() && (!only_internal || input.kind == InputKind::InternalEvent)
            })
            .map(|(id, _)| id)
            .collect();
        self.random.pick(&events).copied()
    }

    fn event_leaf(&mut self) -> Option<Expr> {
        if self.net.settings.policy.is_statechart() {
            return None;
        }
        self.any_event(false).map(|event| leaf(Leaf::Input(event)))
    }

    /// Rising or falling edge; operands are sometimes shared.
    fn edge(&mut self) -> Expr {
        let edges: Vec<_> = self.net.edges.ids().collect();
        let shared = if self.random.one_in(3) { self.random.pick(&edges).copied() } else { None };
        let edge = match shared {
            Some(edge) => edge,
            None => {
                let place = if self.random.one_in(3) { OPERAND } else { INPUTS };
                let depth = self.random.below(2);
                let expr = self.condition(place, depth);
                self.net.edges.push(EdgeOperand { expr })
            }
        };
        leaf(if self.random.one_in(3) { Leaf::Fall(edge) } else { Leaf::Rise(edge) })
    }

    fn time(&mut self) -> Option<Expr> {
        let timers: Vec<_> = self.net.timers.ids().collect();
        let time = match self.random.below(4) {
            0 => Leaf::Timer(*self.random.pick(&timers)?),
            1 => Leaf::LastElapsed(self.any_step()),
            _ => Leaf::Elapsed(self.any_step()),
        };
        let ops = [
            CompareOp::Ge,
            CompareOp::Ge,
            CompareOp::Ge,
            CompareOp::Lt,
            CompareOp::Eq,
            CompareOp::Gt,
        ];
        let op = ops[self.random.below(ops.len())];
        let ticks = GenericExpr::int(self.ticks(5));
        Some(compare(op, leaf(time), ticks))
    }

    fn other_bit(&mut self) -> Option<Expr> {
        let bits: Vec<VarId> = self
            .net
            .vars
            .iter()
            .filter(|(_, var)| var.ty.is_bool() && var.len.is_none())
            .map(|(id, _)| id)
            .collect();
        match self.random.below(3) {
            0 if self.on.tasks => Some(leaf(Leaf::TasksDone(self.any_step()))),
            1 => self
                .random
                .pick(&action_ids(&self.net))
                .map(|action| leaf(Leaf::Controlled(*action))),
            _ => self.random.pick(&bits).map(|var| leaf(Leaf::Var(*var))),
        }
    }

    fn comparison(&mut self, place: Place) -> Option<Expr> {
        let ops = [
            CompareOp::Eq,
            CompareOp::Ne,
            CompareOp::Lt,
            CompareOp::Le,
            CompareOp::Gt,
            CompareOp::Ge,
        ];
        let op = ops[self.random.below(ops.len())];
        let a = self.number_leaf(place)?;
        let b = if self.random.one_in(3) { self.number(place, 1) } else { self.constant_near(&a) };
        Some(compare(op, a, b))
    }

    /// A constant at or just beyond the range of an expression.
    fn constant_near(&mut self, expr: &Expr) -> Expr {
        let (lo, hi) = net_type(&self.net, expr).map_or((0, 9), Type::bounds);
        let value = match self.random.below(4) {
            0 => lo,
            1 => hi,
            2 => 0,
            _ => self.random.between(lo.saturating_sub(1), hi.saturating_add(1)),
        };
        GenericExpr::int(value)
    }

    fn number_leaf(&mut self, place: Place) -> Option<Expr> {
        let leaves = self.number_leaves(place);
        let found = *self.random.pick(&leaves)?;
        if let Leaf::Var(var) = found
            && let Some(len) = self.net.vars[var].len
        {
            let index = self.index(place, len);
            return Some(new(ExprKind::Element(found, Box::new(index))));
        }
        Some(leaf(found))
    }

    /// An index within an array: a constant, or some number reduced to its range.
    fn index(&mut self, place: Place, len: u32) -> Expr {
        let len = i64::from(len);
        let some =
            if place.state && self.random.one_in(2) { self.plain_number(place) } else { None };
        match some {
            Some(number) => {
                // (number mod len + len) mod len is in 0..len-1, whatever the sign of the number.
                let arith = |op, a: Expr, b: i64| {
                    new(ExprKind::Arith(op, Box::new(a), Box::new(GenericExpr::int(b))))
                };
                let folded = arith(ArithOp::Mod, number, len);
                arith(ArithOp::Mod, arith(ArithOp::Add, folded, len), len)
            }
            None => GenericExpr::int(self.random.between(0, len - 1)),
        }
    }

    /// A variable or input that is not an array.
    fn plain_number(&mut self, place: Place) -> Option<Expr> {
        let leaves = self.number_leaves(place);
        let is_plain =
            |leaf: &Leaf| !matches!(leaf, Leaf::Var(var) if self.net.vars[*var].len.is_some());
        let plain: Vec<Leaf> = leaves.into_iter().filter(is_plain).collect();
        self.random.pick(&plain).map(|found| leaf(*found))
    }

    fn number_leaves(&self, place: Place) -> Vec<Leaf> {
        let mut leaves: Vec<Leaf> = self
            .net
            .inputs
            .iter()
            .filter(|(_, input)| !input.ty.is_bool())
            .map(|(id, _)| Leaf::Input(id))
            .collect();
        if place.state {
            leaves.extend(
                self.net
                    .vars
                    .iter()
                    .filter(|(_, var)| !var.ty.is_bool())
                    .map(|(id, _)| Leaf::Var(id)),
            );
        }
        leaves
    }

    /// The right operand of a bit operator: a number, its complement, or a constant with few ones or few zeros.
    fn mask(&mut self, place: Place, depth: usize) -> Expr {
        match self.random.below(4) {
            0 => GenericExpr::int([1, 15, 240, 255, 1023, 65_280, 0xffff][self.random.below(7)]),
            1 => GenericExpr::int([-1, -2, -16, -256, -32_768][self.random.below(5)]),
            2 => {
                let number = Box::new(self.number(place, depth - 1));
                new(ExprKind::Arith(ArithOp::BitXor, number, Box::new(GenericExpr::int(-1))))
            }
            _ => self.number(place, depth - 1),
        }
    }

    /// The amount of a shift: a constant, or the low bits of some number.
    fn amount(&mut self, place: Place) -> Expr {
        let some = if self.random.one_in(2) { self.plain_number(place) } else { None };
        match some {
            Some(number) => {
                let limit = [3, 7, 15, 31][self.random.below(4)];
                let limit = Box::new(GenericExpr::int(limit));
                new(ExprKind::Arith(ArithOp::BitAnd, Box::new(number), limit))
            }
            None => GenericExpr::int([0, 1, 2, 4, 7, 8, 15, 16, 31, 63][self.random.below(10)]),
        }
    }

    fn number(&mut self, place: Place, depth: usize) -> Expr {
        let plain = match self.random.below(3) {
            0 => None,
            _ => self.number_leaf(place),
        };
        let plain = plain.unwrap_or_else(|| {
            let value = if self.wants(self.on.wide_integers, 3) {
                [
                    i64::from(i32::MIN),
                    -65_536,
                    -32_769,
                    127,
                    128,
                    256,
                    32_767,
                    32_768,
                    65_535,
                    65_536,
                    i64::from(i32::MAX),
                ][self.random.below(11)]
            } else {
                [0, 1, -1, 2, 7, 100, 255, -32768, 40000][self.random.below(9)]
            };
            GenericExpr::int(value)
        });
        if depth == 0 || self.random.one_in(3) {
            return plain;
        }
        let ops = [
            ArithOp::Add,
            ArithOp::Sub,
            ArithOp::Mul,
            ArithOp::Div,
            ArithOp::Mod,
            ArithOp::Add,
            ArithOp::Sub,
            ArithOp::BitAnd,
            ArithOp::BitOr,
            ArithOp::BitXor,
            ArithOp::Shl,
            ArithOp::Shr,
        ];
        let op = ops[self.random.below(ops.len())];
        let candidate = match self.random.below(9) {
            0 => new(ExprKind::Neg(Box::new(plain.clone()))),
            1 => {
                let (condition, other) = (self.literal(place), self.number(place, depth - 1));
                new(ExprKind::Select(Box::new(condition), Box::new(plain.clone()), Box::new(other)))
            }
            _ => {
                let other = match op {
                    ArithOp::Div | ArithOp::Mod => self.divisor(place),
                    ArithOp::Shl | ArithOp::Shr => self.amount(place),
                    ArithOp::BitAnd | ArithOp::BitOr | ArithOp::BitXor => self.mask(place, depth),
                    ArithOp::Add | ArithOp::Sub | ArithOp::Mul => self.number(place, depth - 1),
                };
                new(ExprKind::Arith(op, Box::new(plain.clone()), Box::new(other)))
            }
        };
        // Products of products may exceed 64 bits.
        if net_type(&self.net, &candidate).is_ok() { candidate } else { plain }
    }

    /// A constant, or a number that is never 0.
    fn divisor(&mut self, place: Place) -> Expr {
        if self.wants(self.on.wide_integers, 2) {
            let never_zero: Vec<Leaf> = (self.number_leaves(place).into_iter())
                .filter(
                    |found| !matches!(found, Leaf::Var(var) if self.net.vars[*var].len.is_some()),
                )
                .filter(|found| {
                    net_type(&self.net, &leaf(*found)).is_ok_and(|ty| {
                        let (lo, hi) = ty.bounds();
                        lo > 0 || hi < 0
                    })
                })
                .collect();
            if let Some(found) = self.random.pick(&never_zero) {
                return leaf(*found);
            }
            return GenericExpr::int([1, -1, 256, -129, 32_768, 65_536][self.random.below(6)]);
        }
        GenericExpr::int([2, 3, -2, 10, 7][self.random.below(5)])
    }

    /// `otherwise`: none of the transitions declared above that leave one of these steps is fireable.
    pub(super) fn otherwise(&mut self, above: &[TransitionId]) -> Expr {
        let any = above.iter().map(|transition| leaf(Leaf::Fireable(*transition))).collect();
        new(ExprKind::Not(Box::new(new(ExprKind::Or(any)))))
    }

    /// A list of a step, transition or history.
    pub(super) fn list(&mut self, max: usize) -> Vec<Stmt> {
        (0..1 + self.random.below(max))
            .filter_map(|_| self.statement(RECEPTIVITY, true, 1))
            .collect()
    }

    /// A list that reads what is entered or left with a state, and records it.
    pub(super) fn list_about(&mut self, state: StepId) -> Vec<Stmt> {
        let near = self.near(state);
        let mut list = Vec::new();
        for _ in 0..1 + self.random.below(2) {
            let Some(mark) = self.mark() else { return list };
            let Some(read) = self.random.pick(&near).copied() else { return list };
            let condition = leaf(Leaf::Active(read));
            let condition = if self.random.one_in(3) { condition.not() } else { condition };
            let otherwise = match self.random.below(5) {
                0 => {
                    list.push(mark);
                    continue;
                }
                1 => self.statement(RECEPTIVITY, true, 0).into_iter().collect(),
                _ => Vec::new(),
            };
            let kind = StmtKind::If { condition, then: vec![mark], otherwise };
            list.push(Stmt { kind, span: Span::default() });
        }
        list
    }

    /// A statement whose effect shows that a list ran.
    pub(super) fn mark(&mut self) -> Option<Stmt> {
        let (var, _) = self.net.vars.iter().find(|(_, var)| var.name.text == "mark")?;
        let value = if self.random.one_in(2) {
            GenericExpr::int(self.random.between(0, 99))
        } else {
            let step = GenericExpr::int([-2, 1, 3, 7][self.random.below(4)]);
            new(ExprKind::Arith(ArithOp::Add, Box::new(leaf(Leaf::Var(var))), Box::new(step)))
        };
        let kind = StmtKind::Assign { var, index: None, value };
        Some(Stmt { kind, span: Span::default() })
    }

    /// The body of an action or task.
    pub(super) fn body(&mut self, kind: ActionBody) -> Vec<Stmt> {
        (0..1 + self.random.below(2))
            .filter_map(|_| self.statement(QUIET, kind == ActionBody::Action, 1))
            .collect()
    }

    fn statement(&mut self, place: Place, may_raise: bool, depth: usize) -> Option<Stmt> {
        let kind = match self.random.below(10) {
            0..=5 => self.assignment(place)?,
            6 if may_raise => self.raise()?,
            9 if may_raise && self.on.delayed_sends => self.raise()?,
            7 => self.call(place)?,
            8 if depth > 0 => StmtKind::If {
                condition: self.condition(place, 1),
                then: self.statement(place, may_raise, depth - 1).into_iter().collect(),
                otherwise: self.statement(place, may_raise, depth - 1).into_iter().collect(),
            },
            _ => self.assignment(place)?,
        };
        Some(Stmt { kind, span: Span::default() })
    }

    fn assignment(&mut self, place: Place) -> Option<StmtKind> {
        let vars: Vec<VarId> = self.net.vars.ids().collect();
        let var = *self.random.pick(&vars)?;
        let (ty, len) = (self.net.vars[var].ty, self.net.vars[var].len);
        let index = len.map(|len| self.index(place, len));
        let value = if ty.is_bool() {
            if self.random.one_in(2) {
                GenericExpr::bool(self.random.one_in(2))
            } else {
                self.condition(place, 1)
            }
        } else if self.random.one_in(3) && len.is_none() {
            // Most variables are used for counting.
            let step = GenericExpr::int([1, 1, 1, -1, 3, 100][self.random.below(6)]);
            new(ExprKind::Arith(ArithOp::Add, Box::new(leaf(Leaf::Var(var))), Box::new(step)))
        } else {
            self.number(place, 2)
        };
        Some(StmtKind::Assign { var, index, value })
    }

    fn raise(&mut self) -> Option<StmtKind> {
        if self.net.settings.policy.is_statechart() && self.on.sends && self.random.one_in(2) {
            let slots: Vec<SendId> = self.net.sends.ids().collect();
            let slot = match self.random.pick(&slots) {
                Some(slot) if self.random.one_in(3) => return Some(StmtKind::Cancel(*slot)),
                Some(slot) if self.random.one_in(3) => *slot,
                _ => {
                    let event = self.any_event(false)?;
                    self.slot(event)
                }
            };
            return Some(StmtKind::Send(slot));
        }
        if !self.on.raise {
            return None;
        }
        let only_internal = !self.random.one_in(4);
        self.any_event(only_internal).map(StmtKind::Raise)
    }

    fn call(&mut self, place: Place) -> Option<StmtKind> {
        let output: OutputId = *self.random.pick(&self.callable)?;
        let Driver::Extern { params, .. } = self.net.outputs[output].driver.clone() else {
            return None;
        };
        let arguments =
            params
                .iter()
                .map(|param| {
                    if param.ty.is_bool() {
                        self.condition(place, 1)
                    } else {
                        self.number(place, 1)
                    }
                })
                .collect();
        Some(StmtKind::Call { output, arguments })
    }
}
