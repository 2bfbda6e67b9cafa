//! The names of wires and of pieces of state in messages.

use grafsynth_ir::division::Signal;
use grafsynth_ir::net::Net;
use grafsynth_ir::program::Origin;
use grafsynth_ir::text::print_expr;

/// The name of a wire: the object whose value it carries.
pub(super) fn wire(net: &Net, signal: Signal) -> String {
    match signal {
        Signal::Fires(id) => format!("the wire of transition `{}`", net.transitions[id].name),
        Signal::Active(id) => format!("the wire of state `{}`", net.steps[id].name),
    }
}

/// A piece of the state of a part. Its objects have the names of the chart.
#[allow(clippy::wildcard_enum_match_arm, reason = "a forgotten piece has a general name")]
pub(super) fn stored(part: &Net, origin: Origin) -> String {
    let step = |id| format!("step `{}`", part.steps[id].name);
    let action = |id| format!("controlled action `{}`", part.actions[id].name);
    let timer = |id| format!("timer `{}`", part.timers[id].name);
    match origin {
        Origin::Step(id) => step(id),
        Origin::Elapsed(id) | Origin::LastElapsed(id) | Origin::SharedElapsed(id) => {
            format!("the time of {}", step(id))
        }
        Origin::Var(id) => format!("variable `{}`", part.vars[id].name),
        Origin::Edge(id) => {
            let operand = print_expr(part, &part.edges[id].expr);
            format!("the last value of `{operand}`, whose edge is used")
        }
        Origin::Timer(id) => timer(id),
        Origin::TimerCondition(id) => format!("the condition of {}", timer(id)),
        Origin::Older(a, b) => format!("whether {} is older than {}", step(a), step(b)),
        Origin::TaskIndex(id) => format!("the next task of {}", step(id)),
        Origin::ActionQ(id) => action(id),
        Origin::ActionLatch(id, _) => format!("a latch of {}", action(id)),
        Origin::ActionTimer(id, _) => format!("a timer of {}", action(id)),
        Origin::Pending(id) => format!("whether event `{}` was raised", part.inputs[id].name),
        _ => "a bit of the state without a name".to_owned(),
    }
}
