//! Converts and compares values of the net and of the C.

use grafsynth_ir::expr::CompareOp;
use grafsynth_ir::program::Origin;

use super::memory::Scalar;
use super::value::{Int, compare};
use crate::symbolic::aig::{Aig, Lit};
use crate::symbolic::number::Number;
use crate::symbolic::state::{State, Value};

/// A value of the net as the C represents it.
pub(super) fn scalar(value: &Value) -> Scalar {
    Scalar::Int(match value {
        Value::Flag(lit) => Int::Bit(*lit),
        Value::Number(number) => Int::Word(number.clone()),
    })
}

/// The condition that two values differ.
pub(super) fn differs(aig: &mut Aig, value: &Int, wanted: &Value) -> Lit {
    match (value, wanted) {
        (Int::Bit(lit), Value::Flag(wanted)) => aig.xor(*lit, *wanted),
        (value, Value::Flag(wanted)) => compare(aig, CompareOp::Ne, value, &Int::Bit(*wanted)),
        (value, Value::Number(number)) => {
            compare(aig, CompareOp::Ne, value, &Int::Word(number.clone()))
        }
    }
}

/// A piece of the net's state; `None` if the second encoding has none with this name.
pub(super) fn piece(state: &State, origin: Origin, element: u32) -> Option<Value> {
    let flag = |lit: Option<&Lit>| lit.map(|lit| Value::Flag(*lit));
    let number = |number: Option<&Option<Number>>| number?.clone().map(Value::Number);
    match origin {
        Origin::Step(id) => flag(state.active.get(id.index())),
        Origin::Elapsed(id) => number(state.elapsed.get(id.index())),
        Origin::LastElapsed(id) => number(state.last_elapsed.get(id.index())),
        Origin::TaskIndex(id) => number(state.task.get(id.index())),
        Origin::Var(id) => state.vars.get(id.index())?.get(element as usize).cloned(),
        Origin::Edge(id) => flag(state.old.get(id.index())),
        Origin::Timer(id) => number(state.timers.get(id.index())),
        Origin::TimerCondition(id) => flag(state.held.get(id.index())),
        Origin::Older(a, b) => flag(state.older.get(&(a, b))),
        Origin::ActionQ(id) => flag(state.q.get(id.index())),
        Origin::ActionLatch(id, part) => flag(state.latches.get(&(id, part))),
        Origin::ActionTimer(id, part) => {
            state.times.get(&(id, part)).map(|number| Value::Number(number.clone()))
        }
        Origin::Pending(id) => flag(state.raised.get(id.index())),
        _ => None,
    }
}
