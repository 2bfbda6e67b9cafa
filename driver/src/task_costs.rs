//! Costs of tasks that declare none (semantics §6): the lowering needs numbers, and the cost model of the C back end provides them.
//!
//! The cost of a task is determined from the C code of its net, and that net depends on the costs: they decide where a step halts, and so which of its
//! variables are buffered or locked. The costs start at 0 and only grow, net by net, until they do not change any more.

use grafsynth_backend_c::codes::TASK_NOT_COUNTED;
use grafsynth_backend_c::cost::{self, Machine};
use grafsynth_ir::chart::Design;
use grafsynth_ir::lower::{Lowered, TaskCosts, lower_with};
use grafsynth_ir::net::Net;
use grafsynth_ir::{Diagnostic, Span, Valid};

/// The estimated costs of tasks that declare none, and the model.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Counted {
    /// The machine of the model.
    pub machine: &'static Machine,
    /// The costs, by location.
    pub costs: TaskCosts,
}

/// The maximum number of nets that are tried before the costs count as diverging.
const ROUNDS: usize = 16;

/// The net of a design; tasks without a declared cost get the estimate of the model of the machine, if one was given.
pub(crate) fn lower(
    design: &Design,
    machine: Option<&'static Machine>,
) -> (Option<Valid<Net>>, Vec<Diagnostic>, Option<Counted>) {
    let plain = lower_with(design, &TaskCosts::default());
    let Some(machine) = machine.filter(|_| !plain.undeclared.is_empty()) else {
        return (plain.net, plain.found, None);
    };
    let mut costs = TaskCosts { otherwise: Some(0), ..TaskCosts::default() };
    for _ in 0..ROUNDS {
        let Lowered { net, mut found, undeclared } = lower_with(design, &costs);
        let Some(net) = net else { return (None, found, None) };
        let asked = |task: &grafsynth_ir::net::Task| undeclared.contains(&task.meta.span);
        let counted = match cost::tasks(&net, machine, &asked) {
            Ok(counted) => counted,
            Err(more) => {
                found.extend(more);
                return (None, found, None);
            }
        };
        let mut has_grown = false;
        for it in counted {
            let Some(task) = net.steps[it.step].tasks.get(it.task) else { continue };
            let time = u32::try_from(it.time).unwrap_or(u32::MAX);
            let known = costs.known.entry(task.meta.span).or_insert(0);
            has_grown |= time > *known;
            *known = time.max(*known);
        }
        if !has_grown {
            return (Some(net), found, Some(Counted { machine, costs }));
        }
    }
    let message = format!(
        "the costs of the tasks still grow after {ROUNDS} rounds, because the code of the tasks depends on their costs"
    );
    let found = Diagnostic::error(TASK_NOT_COUNTED, message)
        .at(design.charts.first().map_or_else(Span::default, |chart| chart.name.span), "its tasks")
        .help("write `cost N` after the names of the tasks that share variables");
    (None, vec![found], None)
}

/// The net of a single library chart, with task costs as in [`lower`]; otherwise its first error.
pub(crate) fn alone(
    design: &Design,
    library: usize,
    machine: Option<&'static Machine>,
) -> Result<Valid<Net>, String> {
    let alone = grafsynth_ir::lower::alone(design, library).unwrap_or_default();
    let (net, found, _) = lower(&alone, machine);
    net.ok_or_else(|| {
        let first = found.iter().find(|finding| finding.is_error());
        first.map_or_else(|| "no net".to_owned(), |finding| finding.message.clone())
    })
}
