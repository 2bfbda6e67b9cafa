//! Receptivities whose value depends only on a row of inputs and a situation: they read no variable, time or edge.

use grafsynth_ir::net::{InputId, Leaf, Net, Transition};
use grafsynth_sim::{Function, InputRow, Situation};

/// True if the receptivity reads no event and only input levels and step activity.
pub(crate) fn reads_inputs_only(net: &Net, transition: &Transition) -> bool {
    let mut only = transition.events.is_empty();
    for leaf in transition.guard.leaves() {
        only &= if let Leaf::Input(input) = leaf {
            !net.inputs[*input].kind.is_event()
        } else {
            matches!(leaf, Leaf::Active(_))
        };
    }
    only
}

/// The value of the receptivity of a transition for which [`reads_inputs_only`] is true.
pub(crate) fn holds(transition: &Transition, situation: &Situation, row: &InputRow) -> bool {
    let value = &mut |leaf: &Leaf, _: i64| match leaf {
        Leaf::Input(input) => row.value(*input),
        Leaf::Active(step) => i64::from(situation.contains(*step)),
        _ => 0,
    };
    transition.guard.eval(value) != 0
}

/// The same as a function of the row.
pub(crate) fn receptivity(transition: &Transition, situation: &Situation) -> Function {
    transition.guard.map(
        &mut |leaf: &Leaf, span| match leaf {
            Leaf::Input(input) => Function::leaf(*input, span),
            Leaf::Active(step) => Function::bool(situation.contains(*step)),
            _ => Function::bool(false),
        },
        &mut |_, _| InputId::from_index(0),
    )
}

/// True if all preceding steps of the transition are active.
pub(crate) fn is_enabled(transition: &Transition, situation: &Situation) -> bool {
    transition.requires.iter().all(|step| situation.contains(*step))
}
