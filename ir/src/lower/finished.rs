//! Properties and boards that come from separate files and refer to a finished net.

use super::context::{DrawnAction, Entry, FlatNames, Instance, Lowering, Role, Scope, Symbol};
use super::{placement, properties as pass};
use crate::Gather;
use crate::chart::{self, Design};
use crate::diag::{Diagnostic, any_error};
use crate::net::{Board, Driver, Net, PartId, Property, VarOrigin};
use std::collections::BTreeMap;

/// Lowers properties from a separate file or from the command line, in terms of the net: full names, `m1.active` of macro-steps, durations.
///
/// # Errors
/// Every error in the properties.
pub fn properties(
    net: &Net,
    properties: &[chart::Property],
) -> Result<Vec<Property>, Vec<Diagnostic>> {
    let design = Design::default();
    let mut lowering = of_net(&design, net);
    let lowered: Vec<Property> = properties
        .iter()
        .filter_map(|property| pass::property(&mut lowering, 0, property).ok())
        .collect();
    if any_error(&lowering.found.list) { Err(lowering.found.list) } else { Ok(lowered) }
}

/// Lowers a board from a separate file and checks it against the signals of the net.
///
/// # Errors
/// Every error in the board.
pub fn board(net: &Net, board: &chart::Board) -> Result<Board, Vec<Diagnostic>> {
    let design = Design::default();
    let mut lowering = of_net(&design, net);
    let lowered = placement::board(&mut lowering, 0, board);
    if any_error(&lowering.found.list) { Err(lowering.found.list) } else { Ok(lowered) }
}

/// A lowering whose names are those of a finished net.
fn of_net<'a>(design: &'a Design, net: &Net) -> Lowering<'a> {
    let mut lowering = Lowering::new(design);
    let mut names = FlatNames::default();
    let hidden = |origin| origin == VarOrigin::StoredOutput;
    for (id, var) in net.vars.iter().filter(|(_, var)| !hidden(var.origin)) {
        names.others.insert(var.name.text.clone(), Symbol::Var(id));
    }
    for (id, timer) in net.timers.iter() {
        names.others.insert(timer.name.text.clone(), Symbol::Timer(id));
    }
    let driving: std::collections::BTreeSet<_> = net
        .outputs
        .values()
        .filter_map(|output| {
            if let Driver::Controlled(action) = output.driver { Some(action) } else { None }
        })
        .gather();
    for (id, action) in net.actions.iter().filter(|(id, _)| !driving.contains(id)) {
        let name = action.name.clone();
        let index = lowering.drawn_actions.len();
        names.others.insert(name.text.clone(), Symbol::Action(index));
        lowering.drawn_actions.push(DrawnAction { name, id: Some(id), uses: Vec::new() });
    }
    for (id, transition) in net.transitions.iter() {
        names.others.insert(transition.name.text.clone(), Symbol::Transition(id));
    }
    for (id, input) in net.inputs.iter() {
        names.others.insert(input.name.text.clone(), Symbol::Input(id));
    }
    for (id, output) in net.outputs.iter() {
        names.others.insert(output.name.text.clone(), Symbol::Output(id));
        lowering.roles.push(match output.driver {
            Driver::Continuous(_) => Role::Continuous,
            Driver::Mealy(_) | Driver::Fires(_) => Role::Mealy,
            Driver::Stored(var) => Role::Stored(var),
            Driver::Controlled(action) => Role::Controlled(action),
            Driver::Extern { .. } => Role::Extern,
        });
    }
    for one in &net.macros {
        // The steps of an expansion are consecutive.
        let (Some(first), Some(last)) = (one.steps.first(), one.steps.last()) else { continue };
        names.steps.insert(one.name.text.clone(), Symbol::MacroStep(lowering.instances.len()));
        lowering.instances.push(Instance {
            scope: 0,
            entry: Some(one.entry),
            exit: Some(one.exit),
            steps: first.index()..last.index() + 1,
            timer: None,
        });
    }
    for (id, step) in net.steps.iter().filter(|(_, step)| !step.hidden) {
        names.steps.insert(step.name.text.clone(), Symbol::Step(id));
    }
    lowering.flat = Some(names);
    lowering.scopes.push(Scope {
        parent: None,
        prefix: String::new(),
        names: BTreeMap::<&str, Entry>::new(),
        part: PartId::from_index(0),
        home: 0,
        inside: None,
        chart: 0,
        is_instance: false,
    });
    lowering.net = net.clone();
    lowering
}
