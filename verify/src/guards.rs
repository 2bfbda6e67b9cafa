//! Receptivities whose truth is known from a row of inputs and a situation alone: no variable, time or edge is asked for.

use grafsynth_ir::net::{Leaf, Net, Transition};
use grafsynth_ir::program_run::evaluate;
use grafsynth_sim::{InputRow, Situation};

/// The receptivity asks for no event, and for nothing but inputs that are levels and whether steps are active.
pub(crate) fn reads_inputs_only(net: &Net, transition: &Transition) -> bool {
    let mut only = transition.events.is_empty();
    transition.guard.for_each_leaf(&mut |leaf| {
        only &= if let Leaf::Input(input) = leaf {
            !net.inputs[*input].kind.is_event()
        } else {
            matches!(leaf, Leaf::Active(_))
        };
    });
    only
}

/// Whether a receptivity holds that [`reads_inputs_only`].
pub(crate) fn holds(transition: &Transition, situation: &Situation, row: &InputRow) -> bool {
    let value = &mut |leaf: &Leaf, _: i64| match leaf {
        Leaf::Input(input) => row.value(*input),
        Leaf::Active(step) => i64::from(situation.contains(*step)),
        Leaf::Var(_)
        | Leaf::Elapsed(_)
        | Leaf::LastElapsed(_)
        | Leaf::TasksDone(_)
        | Leaf::Timer(_)
        | Leaf::Rise(_)
        | Leaf::Fall(_)
        | Leaf::Fireable(_)
        | Leaf::Controlled(_) => 0,
    };
    evaluate(&transition.guard, value) != 0
}

/// All preceding steps of the transition are active.
pub(crate) fn is_enabled(transition: &Transition, situation: &Situation) -> bool {
    transition.requires.iter().all(|step| situation.contains(*step))
}
