//! Compares the callbacks of a chart with its instance: part of the bench that runs emitted C.
//!
//! A reaction must report each step that it changed, once and with its new state, and each transition that it enabled, and nothing else. Otherwise the
//! bench ends with a special exit code.

use crate::c::print::{Kind, Node};
use crate::header::shown;
use crate::interface::Interface;
use grafsynth_ir::net::{Net, StepId, TransitionId};

/// Steps that have a callback and a query function.
fn steps<'n>(net: &'n Net) -> impl Iterator<Item = StepId> + 'n {
    net.steps.iter().filter(|(_, it)| shown(it.kind, it.hidden)).map(|(id, _)| id)
}

/// Transitions with a callback whose steps can all be queried.
fn transitions<'n>(net: &'n Net) -> impl Iterator<Item = TransitionId> + 'n {
    let is_shown = |step: &StepId| shown(net.steps[*step].kind, net.steps[*step].hidden);
    net.transitions
        .iter()
        .filter(move |(_, it)| !it.requires.is_empty() && it.requires.iter().all(is_shown))
        .map(|(id, _)| id)
}

/// True if there are no callbacks, so that nothing can be compared.
fn is_silent(interface: &Interface) -> bool {
    !interface.callbacks || !interface.has_instance
}

/// The functions of the library, which record their calls.
pub(crate) fn functions(net: &Net, interface: &Interface) -> Vec<Node> {
    if is_silent(interface) {
        return Vec::new();
    }
    let (prefix, upper) = (&interface.names.prefix, &interface.names.upper);
    let mut nodes = Vec::new();
    let mut of_steps = Vec::new();
    for id in steps(net) {
        let name = &interface.names.steps[id];
        nodes.push(Node::line(format!("static bool {prefix}_told_{name};")));
        nodes.push(Node::line(format!("static bool {prefix}_was_{name};")));
        let told = format!("{prefix}_told_{name}");
        of_steps.push(Node::when(
            &format!("step == {upper}_STEP_{name}"),
            vec![
                Node::when(
                    &format!("{told} == active"),
                    vec![Node::line("bench_wrong(\"a step is reported twice\");")],
                ),
                Node::line(format!("{told} = active;")),
            ],
        ));
    }
    let mut of_transitions = Vec::new();
    for id in transitions(net) {
        let name = &interface.names.transitions[id];
        nodes.push(Node::line(format!("static int {prefix}_count_{name};")));
        of_transitions.push(Node::when(
            &format!("transition == {upper}_T_{name}"),
            vec![Node::line(format!("++{prefix}_count_{name};"))],
        ));
    }
    of_steps.push(Node::line("(void)step;"));
    of_steps.push(Node::line("(void)active;"));
    of_transitions.push(Node::line("(void)transition;"));
    nodes.push(Node::function(
        format!("void {prefix}_activated({prefix}_step_t step, bool active)"),
        of_steps,
    ));
    nodes.push(Node::function(
        format!("void {prefix}_enabled({prefix}_transition_t transition)"),
        of_transitions,
    ));
    nodes
}

/// The statements before a reaction, which record the state.
pub(crate) fn before(net: &Net, interface: &Interface) -> Vec<Node> {
    if is_silent(interface) {
        return Vec::new();
    }
    let prefix = &interface.names.prefix;
    let mut nodes = Vec::new();
    for id in steps(net) {
        let name = &interface.names.steps[id];
        nodes.push(Node::line(format!("{prefix}_was_{name} = {prefix}_active_{name}(&self);")));
        nodes.push(Node::line(format!("{prefix}_told_{name} = {prefix}_was_{name};")));
    }
    for id in transitions(net) {
        nodes.push(Node::line(format!("{prefix}_count_{} = 0;", interface.names.transitions[id])));
    }
    nodes
}

/// The statements after a reaction, which check that the reports match the changes.
pub(crate) fn after(net: &Net, interface: &Interface) -> Vec<Node> {
    if is_silent(interface) {
        return Vec::new();
    }
    let prefix = &interface.names.prefix;
    let wrong = |condition: String, what: &str| {
        Node::when(&condition, vec![Node::line(format!("bench_wrong(\"{what}\");"))])
    };
    let mut nodes = vec![Node::line("{")];
    let mut body = Vec::new();
    for id in steps(net) {
        let name = &interface.names.steps[id];
        let is_other = format!("{prefix}_told_{name} != {prefix}_active_{name}(&self)");
        body.push(wrong(is_other, "a step is reported wrongly"));
    }
    for id in transitions(net) {
        let names = &interface.names;
        let all = |kind: &str, end: &str| {
            let asked = net.transitions[id].requires.iter();
            let asked = asked.map(|step| format!("{prefix}_{kind}_{}{end}", names.steps[*step]));
            asked.collect::<Vec<_>>().join(" && ")
        };
        let became = format!("(({}) && !({}))", all("active", "(&self)"), all("was", ""));
        let count = format!("{prefix}_count_{}", names.transitions[id]);
        body.push(wrong(
            format!("{count} != ({became} ? 1 : 0)"),
            "a transition is reported wrongly",
        ));
    }
    nodes.push(Kind::Nested(body).into());
    nodes.push(Node::line("}"));
    nodes
}
