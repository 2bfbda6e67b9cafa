//! Expressions and lists of statements as functions of a state: semantics §6, for charts of every kind.

use grafsynth_ir::expr::{CompareOp, ExprKind, Type};
use grafsynth_ir::net::{Block, Driver, Expr, Leaf, OutputId, Param, StmtKind};

use super::aig::Lit;
use super::calls::Call;
use super::number::Number;
use super::reaction::Maker;
use super::state::{State, Value};

impl Maker<'_> {
    fn read(&mut self, state: &State, expr: &Expr) -> Value {
        match &expr.kind {
            ExprKind::Bool(value) => Value::Flag(Lit::constant(*value)),
            ExprKind::Int(value) => Value::Number(Number::constant(*value)),
            ExprKind::Leaf(leaf) => self.leaf(state, *leaf),
            ExprKind::Element(leaf, index) => {
                let index = self.read(state, index).number();
                let Leaf::Var(var) = leaf else { return Value::Flag(Lit::FALSE) };
                self.element(&state.vars[var.index()], &index)
            }
            ExprKind::Not(a) => Value::Flag(!self.flag(state, a)),
            ExprKind::And(all) => {
                let all: Vec<Lit> = all.iter().map(|one| self.flag(state, one)).collect();
                Value::Flag(self.aig.and_all(all))
            }
            ExprKind::Or(all) => {
                let all: Vec<Lit> = all.iter().map(|one| self.flag(state, one)).collect();
                Value::Flag(self.aig.or_all(all))
            }
            ExprKind::Compare(op, a, b) => {
                let (a, b) = (self.read(state, a), self.read(state, b));
                Value::Flag(match (a, b) {
                    (Value::Flag(a), Value::Flag(b)) => {
                        self.aig.xor(a, b).negate_if(*op == CompareOp::Eq)
                    }
                    (a, b) => Number::compare(&mut self.aig, *op, &a.number(), &b.number()),
                })
            }
            ExprKind::Neg(a) => {
                let a = self.read(state, a).number();
                Value::Number(a.negate(&mut self.aig))
            }
            ExprKind::Arith(op, a, b) => {
                let (a, b) = (self.read(state, a).number(), self.read(state, b).number());
                Value::Number(Number::arith(&mut self.aig, *op, &a, &b))
            }
            ExprKind::Select(c, a, b) => {
                let c = self.flag(state, c);
                let (a, b) = (self.read(state, a), self.read(state, b));
                self.choose(c, &a, &b)
            }
        }
    }

    pub(super) fn flag(&mut self, state: &State, expr: &Expr) -> Lit {
        self.read(state, expr).flag()
    }

    pub(super) fn choose(&mut self, condition: Lit, then: &Value, otherwise: &Value) -> Value {
        match (then, otherwise) {
            (Value::Flag(a), Value::Flag(b)) => Value::Flag(self.aig.ite(condition, *a, *b)),
            (a, b) => {
                Value::Number(Number::select(&mut self.aig, condition, &a.number(), &b.number()))
            }
        }
    }

    pub(super) fn equals(&mut self, number: &Number, value: usize) -> Lit {
        Number::compare(&mut self.aig, CompareOp::Eq, number, &Number::constant(value as i64))
    }

    fn element(&mut self, elements: &[Value], index: &Number) -> Value {
        let mut result = elements.first().cloned().unwrap_or(Value::Flag(Lit::FALSE));
        for (at, element) in elements.iter().enumerate().skip(1) {
            let here = self.equals(index, at);
            result = self.choose(here, element, &result);
        }
        result
    }

    fn leaf(&mut self, state: &State, leaf: Leaf) -> Value {
        let number = |number: &Option<Number>| {
            Value::Number(number.clone().unwrap_or_else(|| Number::constant(0)))
        };
        match leaf {
            Leaf::Input(input) if self.net.inputs[input].kind.is_event() => {
                Value::Flag(self.events[input.index()])
            }
            Leaf::Input(input) => self.inputs.values[input.index()].clone(),
            Leaf::Var(var) => {
                state.vars[var.index()].first().cloned().unwrap_or(Value::Flag(Lit::FALSE))
            }
            Leaf::Active(step) => Value::Flag(state.active[step.index()]),
            Leaf::Elapsed(step) => number(&state.elapsed[step.index()]),
            Leaf::LastElapsed(step) => number(&state.last_elapsed[step.index()]),
            Leaf::TasksDone(step) => {
                let active = state.active[step.index()];
                Value::Flag(match &state.task[step.index()] {
                    None => active,
                    Some(index) => {
                        let index = index.clone();
                        let end = self.equals(&index, self.net.steps[step].tasks.len());
                        self.aig.and(active, end)
                    }
                })
            }
            Leaf::Timer(timer) => number(&state.timers[timer.index()]),
            Leaf::Rise(edge) => Value::Flag(self.rise[edge.index()]),
            Leaf::Fall(edge) => Value::Flag(self.fall[edge.index()]),
            Leaf::Fireable(transition) => Value::Flag(self.fireable[transition.index()]),
            Leaf::Controlled(action) => Value::Flag(state.q[action.index()]),
        }
    }

    pub(super) fn block(&mut self, state: &mut State, condition: Lit, block: &Block) {
        if condition == Lit::FALSE {
            return;
        }
        let net = self.net;
        for stmt in block {
            let frozen = self.frozen.take();
            let reads: &State = frozen.as_deref().unwrap_or(state);
            match &stmt.kind {
                StmtKind::Assign { var, index, value } => {
                    let value = self.read(reads, value);
                    let index = index.as_ref().map(|index| self.read(reads, index).number());
                    let value = match (value, net.vars[*var].ty) {
                        (Value::Number(number), Type::Int { lo, hi }) => {
                            Value::Number(self.saturate(condition, &number, lo, hi))
                        }
                        (value, _) => value,
                    };
                    for element in 0..state.vars[var.index()].len() {
                        let here = match &index {
                            Some(index) => {
                                let here = self.equals(index, element);
                                self.aig.and(condition, here)
                            }
                            None => condition,
                        };
                        let old = state.vars[var.index()][element].clone();
                        state.vars[var.index()][element] = self.choose(here, &value, &old);
                    }
                }
                StmtKind::Raise(event) if self.statechart.is_some() => {
                    self.raise_internal(*event, condition);
                }
                StmtKind::Raise(event) => {
                    state.raised[event.index()] =
                        self.aig.or(state.raised[event.index()], condition);
                }
                StmtKind::Call { output, arguments } => {
                    let call = self.call(reads, condition, *output, arguments);
                    self.calls.push(call);
                }
                StmtKind::If { condition: asked, then, otherwise } => {
                    let asked = self.read(reads, asked).flag();
                    let yes = self.aig.and(condition, asked);
                    let no = self.aig.and(condition, !asked);
                    self.frozen = frozen;
                    self.block(state, yes, then);
                    self.block(state, no, otherwise);
                    continue;
                }
                StmtKind::Send(slot) => self.send(state, *slot, condition),
                StmtKind::Cancel(slot) => self.cancel(state, *slot, condition),
                // Target-language text is ignored.
                StmtKind::Code(_) => {}
            }
            self.frozen = frozen;
        }
    }

    /// A call of an extern action; an argument is assigned to its parameter, so it is saturated.
    pub(super) fn call(
        &mut self,
        state: &State,
        when: Lit,
        output: OutputId,
        arguments: &[Expr],
    ) -> Call {
        let net = self.net;
        let params: &[Param] = match &net.outputs[output].driver {
            Driver::Extern { params, .. } => params,
            Driver::Continuous(_)
            | Driver::Mealy(_)
            | Driver::Fires(_)
            | Driver::Stored(_)
            | Driver::Controlled(_) => &[],
        };
        let mut all = Vec::new();
        for (argument, param) in arguments.iter().zip(params) {
            all.push(match (self.read(state, argument), param.ty) {
                (Value::Number(number), Type::Int { lo, hi }) => {
                    self.saturate(when, &number, lo, hi)
                }
                (Value::Number(number), Type::Bool) => number,
                (Value::Flag(lit), _) => Number::from_code(&mut self.aig, &[lit], 0),
            });
        }
        Call { output, when, arguments: all }
    }
}
