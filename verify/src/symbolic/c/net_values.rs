//! Converts and compares values of the net and of the C.

use grafsynth_ir::expr::CompareOp;
use grafsynth_ir::program::Origin;

use super::memory::Scalar;
use super::value::{Int, compare};
use crate::symbolic::aig::{Aig, Lit};
use crate::symbolic::number::Number;
use crate::symbolic::state::{Queue, State, Value};
use crate::symbolic::statechart::cut::Which;

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

fn length(queue: Option<&Queue>) -> Value {
    Value::Number(queue.map_or_else(|| Number::constant(0), |queue| queue.length.clone()))
}

/// The queue that a piece is an element of.
pub(super) fn queue_of(origin: Origin) -> Option<Which> {
    match origin {
        Origin::InternalQueue => Some(Which::Internal),
        Origin::ExternalQueue => Some(Which::External),
        _ => None,
    }
}

/// The queue that a piece is the length of.
pub(super) fn length_of(origin: Origin) -> Option<Which> {
    match origin {
        Origin::InternalLength => Some(Which::Internal),
        Origin::ExternalLength => Some(Which::External),
        _ => None,
    }
}

/// An element of a queue between reactions, and whether it is used; `None` if the queue is no part of the state, and so empty.
pub(super) fn item(
    aig: &mut Aig,
    state: &State,
    which: Which,
    element: u32,
) -> Option<(Number, Lit)> {
    let queue = match which {
        Which::Internal => state.internal.as_ref(),
        Which::External => state.external.as_ref(),
    }?;
    let item = queue.items.get(element as usize)?.clone();
    let place = Number::constant(i64::from(element));
    Some((item, Number::compare(aig, CompareOp::Gt, &queue.length, &place)))
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
        Origin::SendTimer(id) => number(state.slots.get(id.index())),
        Origin::Recorded(history, step) => flag(state.recorded.get(&(history, step))),
        Origin::Ended(part) => flag(state.ended.get(&part)),
        Origin::HeldOutput(output, part) => flag(state.kept.get(&(output, part))),
        // A queue that is no part of the state is empty between reactions.
        Origin::InternalLength => Some(length(state.internal.as_ref())),
        Origin::ExternalLength => Some(length(state.external.as_ref())),
        _ => None,
    }
}
