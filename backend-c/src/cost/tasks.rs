//! The cost of tasks: the model's estimate if a chart declares none (semantics §6).

use super::{Machine, TaskBound, bound};
use crate::codes::TASK_NOT_COUNTED;
use crate::{Io, Options, emit};
use grafsynth_ir::Valid;
use grafsynth_ir::diag::{Diagnostic, any_error};
use grafsynth_ir::facts::Facts;
use grafsynth_ir::net::{Block, Net, StmtKind, Task};
use std::collections::BTreeMap;

/// The maximum cost of each task of a net on a machine. Each is the larger of two costs, with inputs and outputs as members and as words,
/// so it does not depend on the options of the build. `asked` selects the tasks.
///
/// # Errors
/// If a requested task calls user functions or contains user code, whose cost no model knows, or if the net cannot be emitted.
pub fn tasks(
    net: &Valid<Net>,
    machine: &Machine,
    asked: &dyn Fn(&Task) -> bool,
) -> Result<Vec<TaskBound>, Vec<Diagnostic>> {
    let mut found = Vec::new();
    for step in net.steps.values() {
        for task in step.tasks.iter().filter(|task| asked(task)) {
            if let Some(what) = unknown(net, &task.body) {
                let message =
                    format!("the cost of task {} cannot be determined: it {what}", task.name);
                found.push(
                    Diagnostic::error(TASK_NOT_COUNTED, message)
                        .at(task.name.span, "declares no cost")
                        .help("write `cost N` after its name, with the cost that you measured, in the unit of the machine"),
                );
            }
        }
    }
    if !found.is_empty() {
        return Err(found);
    }
    if !net.steps.values().flat_map(|step| &step.tasks).any(asked) {
        return Ok(Vec::new());
    }
    let mut most: BTreeMap<(usize, usize), TaskBound> = BTreeMap::new();
    for io in [Io::Members, Io::Words] {
        let package = emit(net, &Facts::default(), &Options { io, ..Options::default() })?;
        if any_error(&package.diagnostics) {
            return Err(package.diagnostics);
        }
        let bound = bound(&package, machine).map_err(|why| {
            vec![
                Diagnostic::error(
                    TASK_NOT_COUNTED,
                    format!("the cost of tasks cannot be determined: {why}"),
                )
                .at(net.name.span, "its tasks")
                .help("write `cost N` after the name of each task"),
            ]
        })?;
        for task in bound.tasks {
            let entry = most.entry((task.step.index(), task.task)).or_insert(task);
            entry.time = entry.time.max(task.time);
        }
    }
    Ok(most.into_values().filter(|it| is_asked(net, it, asked)).collect())
}

fn is_asked(net: &Net, it: &TaskBound, asked: &dyn Fn(&Task) -> bool) -> bool {
    net.steps[it.step].tasks.get(it.task).is_some_and(asked)
}

/// True if the cost of everything in a list is known: it has no user function and no user code.
#[must_use]
pub fn is_counted(net: &Net, block: &Block) -> bool {
    unknown(net, block).is_none()
}

/// The first part of a list whose cost no model can determine.
fn unknown(net: &Net, block: &Block) -> Option<String> {
    block.iter().find_map(|stmt| match &stmt.kind {
        StmtKind::Call { output, .. } => {
            Some(format!("calls `{}`, a user function", net.outputs[*output].name))
        }
        StmtKind::Code(_) => Some("contains user code".to_owned()),
        StmtKind::If { then, otherwise, .. } => {
            unknown(net, then).or_else(|| unknown(net, otherwise))
        }
        StmtKind::Assign { .. } | StmtKind::Raise(_) | StmtKind::Send(_) | StmtKind::Cancel(_) => {
            None
        }
    })
}
