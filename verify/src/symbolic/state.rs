//! The state of a net (semantics §2), as functions.

use grafsynth_ir::Gather;
use std::collections::BTreeMap;

use grafsynth_ir::expr::{Expr, ExprKind, Type};
use grafsynth_ir::net::{
    ActionId, ControlledAction, HistoryId, Leaf, Net, OutputId, PartId, Qualifier, StepId,
    StmtKind, TransitionKind,
};
use grafsynth_ir::program::{ActionPart, Origin};

use super::aig::{Aig, Lit};
use super::number::Number;

/// Identifies one bit of the state: its object, the element of an array, the bit of the code.
pub(crate) type Key = (Origin, u32, u32);

/// Pieces of several bits, each with the condition that the bits are a valid code.
pub(crate) type Codes = Vec<(Vec<Lit>, Lit)>;

/// A truth value or a number.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Value {
    Flag(Lit),
    Number(Number),
}

impl Value {
    pub(crate) fn flag(&self) -> Lit {
        match self {
            Value::Flag(lit) => *lit,
            // Validation ensures a Boolean here.
            Value::Number(_) => Lit::FALSE,
        }
    }

    pub(crate) fn number(&self) -> Number {
        match self {
            Value::Number(number) => number.clone(),
            Value::Flag(_) => Number::constant(0),
        }
    }
}

/// The pieces of state of a net and their types; fixed before any function is made.
#[derive(Debug, Clone, Default)]
pub(crate) struct Shape {
    /// The cap of `s.t` for each step; `None` if `s.t` is not read.
    pub(crate) elapsed: Vec<Option<i64>>,
    pub(crate) last_elapsed: Vec<Option<i64>>,
    pub(crate) timers: Vec<Option<i64>>,
    /// The pairs of steps whose relative age matters, the lower one first.
    pub(crate) older: Vec<(StepId, StepId)>,
    /// The latches and timers of ACTION_CONTROL for the qualifiers in use.
    pub(crate) latches: Vec<(ActionId, ActionPart)>,
    pub(crate) times: Vec<(ActionId, ActionPart)>,
    /// For each event, true if some list raises it.
    pub(crate) raised: Vec<bool>,
    /// The pieces that only statecharts have.
    pub(crate) chart: ChartShape,
}

/// The pieces of state that only statecharts have.
#[derive(Debug, Clone, Default)]
pub(crate) struct ChartShape {
    /// The delay of each send slot; `None` for a slot that sends at once.
    pub(crate) slots: Vec<Option<i64>>,
    /// The steps that each history may record.
    pub(crate) recorded: Vec<(HistoryId, StepId)>,
    /// The charts that can end.
    pub(crate) ended: Vec<PartId>,
    /// The outputs of charts that can end.
    pub(crate) kept: Vec<(OutputId, PartId)>,
    /// The largest event number, and the bound of each queue that may contain events between reactions.
    pub(crate) n_events: i64,
    pub(crate) internal: Option<u32>,
    pub(crate) external: Option<u32>,
}

/// A queue: an array of event numbers whose first element is taken next, and its length. Elements at and after the length have no meaning.
#[derive(Debug, Clone)]
pub(crate) struct Queue {
    pub(crate) items: Vec<Number>,
    pub(crate) length: Number,
}

/// The state itself.
#[derive(Debug, Clone)]
pub(crate) struct State {
    pub(crate) active: Vec<Lit>,
    pub(crate) elapsed: Vec<Option<Number>>,
    pub(crate) last_elapsed: Vec<Option<Number>>,
    pub(crate) task: Vec<Option<Number>>,
    pub(crate) vars: Vec<Vec<Value>>,
    pub(crate) timers: Vec<Option<Number>>,
    pub(crate) held: Vec<Lit>,
    pub(crate) old: Vec<Lit>,
    pub(crate) older: BTreeMap<(StepId, StepId), Lit>,
    pub(crate) q: Vec<Lit>,
    pub(crate) latches: BTreeMap<(ActionId, ActionPart), Lit>,
    pub(crate) times: BTreeMap<(ActionId, ActionPart), Number>,
    pub(crate) raised: Vec<Lit>,
    /// Ticks until each delayed send is due; 0 while the slot is not running.
    pub(crate) slots: Vec<Option<Number>>,
    pub(crate) recorded: BTreeMap<(HistoryId, StepId), Lit>,
    pub(crate) ended: BTreeMap<PartId, Lit>,
    pub(crate) kept: BTreeMap<(OutputId, PartId), Lit>,
    pub(crate) internal: Option<Queue>,
    pub(crate) external: Option<Queue>,
}

/// Makes the pieces of a state.
struct Pieces<'a, M> {
    make: &'a mut M,
}

impl<M: FnMut(Origin, u32, Type) -> Value> Pieces<'_, M> {
    fn flag(&mut self, origin: Origin) -> Lit {
        (self.make)(origin, 0, Type::Bool).flag()
    }

    /// A queue for at most `bound` of `n_events` events.
    fn queue(
        &mut self,
        bound: Option<u32>,
        n_events: i64,
        items: Origin,
        length: Origin,
    ) -> Option<Queue> {
        let bound = bound?;
        let ty = Type::Int { lo: 0, hi: n_events };
        let items = (0..bound).map(|at| (self.make)(items, at, ty).number()).collect();
        Some(Queue { items, length: self.ticks(length, i64::from(bound)) })
    }

    /// A number of ticks, or another number from 0.
    fn ticks(&mut self, origin: Origin, hi: i64) -> Number {
        (self.make)(origin, 0, Type::Int { lo: 0, hi }).number()
    }
}

impl Shape {
    pub(crate) fn of(net: &Net) -> Shape {
        let mut shape = Shape {
            elapsed: vec![None; net.steps.len()],
            last_elapsed: vec![None; net.steps.len()],
            timers: vec![None; net.timers.len()],
            raised: vec![false; net.inputs.len()],
            ..Shape::default()
        };
        for stmt in net.statements() {
            if let StmtKind::Raise(event) = &stmt.kind {
                shape.raised[event.index()] = true;
            }
        }
        for expr in net.expressions() {
            shape.caps(expr);
        }
        for (id, action) in net.actions.iter() {
            shape.action(id, action);
        }
        shape
    }

    /// Sets the cap of each counter to one above the largest constant that it is compared with (semantics §3.1).
    fn caps(&mut self, expr: &Expr<Leaf>) {
        if let ExprKind::Compare(_, a, b) = &expr.kind {
            for (timer, constant) in [(a, b), (b, a)] {
                if let (ExprKind::Leaf(leaf), ExprKind::Int(value)) = (&timer.kind, &constant.kind)
                {
                    let slot = match leaf {
                        Leaf::Elapsed(step) => &mut self.elapsed[step.index()],
                        Leaf::LastElapsed(step) => &mut self.last_elapsed[step.index()],
                        Leaf::Timer(timer) => &mut self.timers[timer.index()],
                        Leaf::Input(_)
                        | Leaf::Var(_)
                        | Leaf::Active(_)
                        | Leaf::TasksDone(_)
                        | Leaf::Rise(_)
                        | Leaf::Fall(_)
                        | Leaf::Fireable(_)
                        | Leaf::Controlled(_) => continue,
                    };
                    let cap = value.saturating_add(1).max(1);
                    *slot = Some(slot.map_or(cap, |old| old.max(cap)));
                }
            }
        }
        expr.children().for_each(|operand| self.caps(operand));
    }

    fn action(&mut self, id: ActionId, action: &ControlledAction) {
        let has = |it: &Qualifier| action.uses.iter().any(|one| one.qualifier == *it);
        for qualifier in Qualifier::ALL.into_iter().filter(has) {
            self.latches.extend(qualifier.stores().map(|part| (id, part)));
            let timer = qualifier.stores().next().filter(|_| qualifier.is_timed());
            self.times.extend(timer.map(|part| (id, part)));
        }
    }

    /// Calls `make` for each piece of the state with its name and type, and builds a state from the results.
    fn build(&self, net: &Net, make: &mut impl FnMut(Origin, u32, Type) -> Value) -> State {
        let mut pieces = Pieces { make };
        let active = net.steps.ids().map(|step| pieces.flag(Origin::Step(step))).collect();
        let mut counters = |caps: &[Option<i64>], origin: fn(StepId) -> Origin| {
            let steps = net.steps.ids();
            steps.map(|step| Some(pieces.ticks(origin(step), caps[step.index()]?))).collect()
        };
        let elapsed = counters(&self.elapsed, Origin::Elapsed);
        let last_elapsed = counters(&self.last_elapsed, Origin::LastElapsed);
        let task = (net.steps.iter())
            .map(|(step, data)| {
                let n = data.tasks.len() as i64;
                (n > 0).then(|| pieces.ticks(Origin::TaskIndex(step), n))
            })
            .collect();
        let vars = (net.vars.iter())
            .map(|(id, var)| {
                let elements = 0..var.len.unwrap_or(1);
                elements.map(|element| (pieces.make)(Origin::Var(id), element, var.ty)).collect()
            })
            .collect();
        let timers = net.timers.ids();
        let timers =
            timers.map(|id| Some(pieces.ticks(Origin::Timer(id), self.timers[id.index()]?)));
        let timers = timers.collect();
        let held = net.timers.ids().map(|id| pieces.flag(Origin::TimerCondition(id))).collect();
        let old = net.edges.ids().map(|id| pieces.flag(Origin::Edge(id))).collect();
        let older = self.older.iter();
        let older = older.map(|it| (*it, pieces.flag(Origin::Older(it.0, it.1)))).gather();
        let q = net.actions.ids().map(|id| pieces.flag(Origin::ActionQ(id))).collect();
        let latches = self.latches.iter();
        let latches =
            latches.map(|it| (*it, pieces.flag(Origin::ActionLatch(it.0, it.1)))).gather();
        let times = (self.times.iter())
            .map(|it| {
                let cap = i64::from(net.actions[it.0].duration);
                (*it, pieces.ticks(Origin::ActionTimer(it.0, it.1), cap))
            })
            .gather();
        let raised = net.inputs.ids().map(|id| match self.raised[id.index()] {
            true => pieces.flag(Origin::Pending(id)),
            false => Lit::FALSE,
        });
        let raised = raised.collect();
        let chart = &self.chart;
        let slots = (net.sends.ids())
            .map(|id| {
                let delay = chart.slots.get(id.index()).copied().flatten()?;
                Some(pieces.ticks(Origin::SendTimer(id), delay))
            })
            .collect();
        let recorded = chart.recorded.iter();
        let recorded = recorded.map(|it| (*it, pieces.flag(Origin::Recorded(it.0, it.1)))).gather();
        let ended = chart.ended.iter();
        let ended = ended.map(|part| (*part, pieces.flag(Origin::Ended(*part)))).gather();
        let kept = chart.kept.iter();
        let kept = kept.map(|it| (*it, pieces.flag(Origin::HeldOutput(it.0, it.1)))).gather();
        let (items, length) = (Origin::InternalQueue, Origin::InternalLength);
        let internal = pieces.queue(chart.internal, chart.n_events, items, length);
        let (items, length) = (Origin::ExternalQueue, Origin::ExternalLength);
        let external = pieces.queue(chart.external, chart.n_events, items, length);
        State {
            active,
            elapsed,
            last_elapsed,
            task,
            vars,
            timers,
            held,
            old,
            older,
            q,
            latches,
            times,
            raised,
            slots,
            recorded,
            ended,
            kept,
            internal,
            external,
        }
    }

    /// A state in which every bit is a variable. Also returns, for each piece of several bits, its bits and the condition that they are a valid code.
    pub(crate) fn free(&self, net: &Net, aig: &mut Aig) -> (State, BTreeMap<Key, Lit>, Codes) {
        let mut bits = BTreeMap::new();
        let mut valid = Vec::new();
        let state = self.build(net, &mut |origin, element, ty| {
            let own: Vec<Lit> = (0..ty.bits()).map(|_| aig.variable()).collect();
            for (bit, lit) in own.iter().enumerate() {
                bits.insert((origin, element, bit as u32), *lit);
            }
            match ty {
                Type::Bool => Value::Flag(own[0]),
                Type::Int { lo, hi } => {
                    let number = Number::from_code(aig, &own, lo);
                    if hi.abs_diff(lo).checked_add(1).is_some_and(|n| !n.is_power_of_two()) {
                        let fits = Number::compare(
                            aig,
                            grafsynth_ir::expr::CompareOp::Le,
                            &number,
                            &Number::constant(hi),
                        );
                        valid.push((own, fits));
                    }
                    Value::Number(number)
                }
            }
        });
        (state, bits, valid)
    }

    /// A state whose bits are given by a function of their names. The bits of each step come before those of its children.
    pub(crate) fn read(
        &self,
        net: &Net,
        aig: &mut Aig,
        bit: &mut impl FnMut(Key, &mut Aig) -> Lit,
    ) -> State {
        self.build(net, &mut |origin, element, ty| {
            let code: Vec<Lit> = (0..ty.bits()).map(|at| bit((origin, element, at), aig)).collect();
            match ty {
                Type::Bool => Value::Flag(code.first().copied().unwrap_or(Lit::FALSE)),
                Type::Int { lo, .. } => Value::Number(Number::from_code(aig, &code, lo)),
            }
        })
    }

    /// The conditions that the numbers of a state are within their ranges. The elements of queues are not included, because they have a meaning only below the
    /// length.
    pub(crate) fn valid(&self, net: &Net, aig: &mut Aig, state: &State) -> Vec<Lit> {
        let mut ranges: BTreeMap<Key, (Vec<Lit>, i64, i64)> = BTreeMap::new();
        let bits = self.bits(net, aig, state);
        self.build(net, &mut |origin, element, ty| {
            if let Type::Int { lo, hi } = ty
                && !matches!(origin, Origin::InternalQueue | Origin::ExternalQueue)
            {
                let code = (0..ty.bits()).map(|bit| bits[&(origin, element, bit)]).collect();
                ranges.insert((origin, element, 0), (code, lo, hi));
            }
            match ty {
                Type::Bool => Value::Flag(Lit::FALSE),
                Type::Int { .. } => Value::Number(Number::constant(0)),
            }
        });
        ranges
            .into_values()
            .map(|(code, lo, hi)| {
                let number = Number::from_code(aig, &code, lo);
                let largest = Number::constant(hi);
                Number::compare(aig, grafsynth_ir::expr::CompareOp::Le, &number, &largest)
            })
            .filter(|holds| *holds != Lit::TRUE)
            .collect()
    }

    /// The state before reset (semantics §3.9, R1).
    pub(crate) fn before_reset(&self, net: &Net) -> State {
        self.build(net, &mut |origin, element, ty| {
            // Everything else is 0.
            let value = if let Origin::Var(var) = origin {
                let init = &net.vars[var].init;
                let own = init.get(element as usize).or(init.first()).copied();
                own.unwrap_or_else(|| ty.saturate(0))
            } else if let Origin::Timer(timer) = origin
                && net.timers[timer].starts_expired
            {
                ty.bounds().1
            } else {
                0
            };
            match ty {
                Type::Bool => Value::Flag(Lit::constant(value != 0)),
                Type::Int { .. } => Value::Number(Number::constant(value)),
            }
        })
    }

    /// The bits of a state, by name.
    pub(crate) fn bits(&self, net: &Net, aig: &mut Aig, state: &State) -> BTreeMap<Key, Lit> {
        let mut values: Vec<Value> = Vec::new();
        values.extend(state.active.iter().map(|lit| Value::Flag(*lit)));
        for list in [&state.elapsed, &state.last_elapsed, &state.task] {
            values.extend(list.iter().flatten().map(|number| Value::Number(number.clone())));
        }
        values.extend(state.vars.iter().flatten().cloned());
        values.extend(state.timers.iter().flatten().map(|number| Value::Number(number.clone())));
        values.extend(state.held.iter().chain(&state.old).map(|lit| Value::Flag(*lit)));
        values.extend(self.older.iter().map(|pair| Value::Flag(state.older[pair])));
        values.extend(state.q.iter().map(|lit| Value::Flag(*lit)));
        values.extend(self.latches.iter().map(|key| Value::Flag(state.latches[key])));
        values.extend(self.times.iter().map(|key| Value::Number(state.times[key].clone())));
        let raised = state.raised.iter().zip(&self.raised).filter(|(_, is_raised)| **is_raised);
        values.extend(raised.map(|(lit, _)| Value::Flag(*lit)));
        values.extend(state.slots.iter().flatten().map(|number| Value::Number(number.clone())));
        let chart = &self.chart;
        values.extend(chart.recorded.iter().map(|key| Value::Flag(state.recorded[key])));
        values.extend(chart.ended.iter().map(|key| Value::Flag(state.ended[key])));
        values.extend(chart.kept.iter().map(|key| Value::Flag(state.kept[key])));
        for queue in [&state.internal, &state.external].into_iter().flatten() {
            let numbers = queue.items.iter().chain([&queue.length]);
            values.extend(numbers.map(|number| Value::Number(number.clone())));
        }
        let mut values = values.into_iter();
        let mut bits = BTreeMap::new();
        // The pieces come in the order of `build`, which gives their names and types.
        self.build(net, &mut |origin, element, ty| {
            let value = values.next().unwrap_or(Value::Flag(Lit::FALSE));
            match (&value, ty) {
                (Value::Flag(lit), _) => {
                    bits.insert((origin, element, 0), *lit);
                }
                (Value::Number(number), _) => {
                    for (bit, lit) in
                        number.code(aig, ty.bounds().0, ty.bits()).into_iter().enumerate()
                    {
                        bits.insert((origin, element, bit as u32), lit);
                    }
                }
            }
            value
        });
        bits
    }
}

impl State {
    /// Undoes what a micro-step outside statecharts has changed since an earlier state, unless the condition is true.
    pub(crate) fn keep_unless(&mut self, aig: &mut Aig, condition: Lit, before: &State) {
        let mut flag = |new: &mut Lit, old: &Lit| *new = aig.ite(condition, *new, *old);
        let flags = [(&mut self.active, &before.active), (&mut self.raised, &before.raised)];
        for (new, old) in flags {
            new.iter_mut().zip(old).for_each(|(new, old)| flag(new, old));
        }
        self.older.iter_mut().zip(before.older.values()).for_each(|((_, new), old)| flag(new, old));
        let numbers = [
            (&mut self.elapsed, &before.elapsed),
            (&mut self.last_elapsed, &before.last_elapsed),
            (&mut self.task, &before.task),
        ];
        for (new, old) in numbers.into_iter().flat_map(|(new, old)| new.iter_mut().zip(old)) {
            if let (Some(new), Some(old)) = (new, old) {
                *new = Number::select(aig, condition, new, old);
            }
        }
        for (new, old) in self.vars.iter_mut().zip(&before.vars) {
            for (new, old) in new.iter_mut().zip(old) {
                *new = match (&*new, old) {
                    (Value::Number(new), Value::Number(old)) => {
                        Value::Number(Number::select(aig, condition, new, old))
                    }
                    (new, old) => Value::Flag(aig.ite(condition, new.flag(), old.flag())),
                };
            }
        }
    }
}

/// True for transitions that can compete (semantics §3.2: reactions never do).
pub(crate) fn is_move(net: &Net, transition: grafsynth_ir::net::TransitionId) -> bool {
    net.transitions[transition].kind == TransitionKind::Move
}

/// The cell with the last input of a part's timer: for SD and SL it is the latch.
pub(super) fn held_of(part: ActionPart) -> ActionPart {
    if part == ActionPart::DS { ActionPart::DSHeld } else { part }
}
