//! How the C of a style represents the net, for the proof.

use crate::header::shown;
use crate::io::INPUT_BITS;
use crate::names::Names;
use crate::style_output::StyleOutput;
use crate::{Options, gate, safe, trace};
use grafsynth_ir::instance::{Callbacks, Extra, Place, Representation};
use grafsynth_ir::net::{InputKind, Net, Var, VarOrigin};

/// How the C of a style represents the net.
pub(crate) fn representation(
    net: &Net,
    names: &Names,
    program: &StyleOutput,
    options: &Options,
) -> Representation {
    let mut extra = options.trace.map(trace::extra).unwrap_or_default();
    if options.safe_state && !program.instance.is_empty() {
        extra.push(safe::extra());
    }
    if program.engine.as_ref().is_some_and(|engine| !engine.image.is_empty()) {
        extra.push((Place::member("image"), Extra::Image));
    }
    let bit = |index: usize, width: usize| Place {
        member: "bits".to_owned(),
        element: u32::try_from(index / width).ok(),
        bit: u32::try_from(index % width).ok(),
    };
    let handed = net.inputs.iter().filter(|(_, input)| input.kind.is_handed());
    let inputs = handed.map(|(id, _)| {
        let index = names.io.input_bit(id);
        let place =
            index.map_or_else(|| Place::member(&names.inputs[id]), |index| bit(index, INPUT_BITS));
        (id, place)
    });
    let outputs = net.outputs.iter().filter(|(_, output)| !output.is_extern()).map(|(id, _)| {
        let index = names.io.output_bit(id);
        let place = index.map_or_else(
            || Place::member(&names.outputs[id]),
            |index| bit(index, names.io.output_bits()),
        );
        (id, place)
    });
    let conditions = net.inputs.iter().filter(|(_, input)| input.kind == InputKind::Extern);
    let actions = net.outputs.iter().filter(|(_, output)| output.is_extern());
    let prefix = &names.prefix;
    let active = |step| (step, format!("{prefix}_active_{}", names.steps[step]));
    let shown = net.steps.iter().filter(|(_, step)| !step.hidden);
    let is_returned = |var: &Var| var.origin == VarOrigin::Declared && var.len.is_none();
    let vars = net.vars.iter().filter(|(_, var)| is_returned(var));
    Representation {
        prefix: prefix.clone(),
        inputs: inputs.collect(),
        outputs: outputs.collect(),
        state: program.holds.clone(),
        active: shown.map(|(step, _)| active(step)).collect(),
        vars: vars.map(|(var, _)| (var, format!("{prefix}_var_{}", names.vars[var]))).collect(),
        fault: program.has_fault.then(|| format!("{prefix}_fault")),
        conditions: conditions.map(|(id, _)| (id, names.inputs[id].clone())).collect(),
        actions: actions.map(|(id, _)| (id, names.outputs[id].clone())).collect(),
        locals: program.locals.clone(),
        extra,
        gate: (options.gate && !program.instance.is_empty()).then(|| gate::hint(net, program)),
        callbacks: (options.callbacks && !program.instance.is_empty())
            .then(|| callbacks(net, names)),
    }
}

/// The functions that the user's library provides for `--callbacks`.
fn callbacks(net: &Net, names: &Names) -> Callbacks {
    let Names { prefix, upper, .. } = names;
    let steps = net.steps.iter().filter(|(_, step)| shown(step.kind, step.hidden));
    let transitions = net.transitions.iter().filter(|(_, it)| !it.requires.is_empty());
    Callbacks {
        activated: format!("{prefix}_activated"),
        steps: steps.map(|(id, _)| (id, format!("{upper}_STEP_{}", names.steps[id]))).collect(),
        enabled: format!("{prefix}_enabled"),
        transitions: transitions
            .map(|(id, _)| (id, format!("{upper}_T_{}", names.transitions[id])))
            .collect(),
    }
}
