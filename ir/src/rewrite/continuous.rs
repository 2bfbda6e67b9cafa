//! Pass `continuous`: an output that only `N` uses drive becomes continuous. Structured text writes every output as an action (`LAMP(N)`), which is
//! evaluated between the evolution and the outputs; if nothing can tell the difference, the output itself is simpler: no action runs for it.
//!
//! ```text
//! output q controlled q                   output q continuous
//! action q  use a N  use b N if x    =>       emit a, b if x
//! ```
//!
//! Q is computed in the first pass of the controlled actions (§3.5), the output after bodies, tasks and free timers (E4 of §3.9). So the pass leaves an
//! action alone if
//! - it has a body, or a use with another qualifier: `set Q` in s, `N` in r;
//! - something reads it: until the actions run, its value is that of the previous row, and a continuous output cannot be read (§3.6);
//! - a condition of a use reads what changes after Q is computed: a variable that a body or a task writes, a free timer, another action, finished tasks.
//!
//! Statecharts are left alone: a statechart that has ended stops its actions but keeps its outputs. So are nets whose END waits (§10.2): their actions keep Q.

use crate::arena::IdMap;
use crate::net::{
    ControlledAction, Driver, Emission, Expr, Leaf, Net, PropertyLeaf, Qualifier, StmtKind, Var,
};
use crate::walk::statements;

/// Makes outputs that only `N` drives continuous, if nothing can tell the difference; returns true if there was such an output.
pub fn continuous(net: &mut Net) -> bool {
    if net.settings.policy.is_statechart() || net.actions.is_empty() || net.ending.is_some() {
        return false;
    }
    let written = written_late(net);
    let read = read(net);
    let mut any = false;
    for id in net.outputs.ids().collect::<Vec<_>>() {
        let Driver::Controlled(action) = net.outputs[id].driver else { continue };
        if read[action] || !is_level(&net.actions[action], &written) {
            continue;
        }
        let uses = std::mem::take(&mut net.actions[action].uses);
        let emissions = uses.into_iter().map(|one| Emission {
            step: one.step,
            condition: one.condition,
            span: one.span,
        });
        net.outputs[id].driver = Driver::Continuous(emissions.collect());
        any = true;
    }
    any
}

/// The variables that bodies of actions, tasks and the release of locks write.
fn written_late(net: &Net) -> IdMap<Var, bool> {
    let mut written = IdMap::filled(&net.vars, false);
    let tasks = net.steps.values().flat_map(|step| step.tasks.iter().map(|task| &task.body));
    let bodies = net.actions.values().map(|action| &action.body);
    for stmt in tasks.chain(bodies).flat_map(|list| statements(list)) {
        if let StmtKind::Assign { var, .. } = stmt.kind {
            written[var] = true;
        }
    }
    // A step with tasks holds its locks until its last task has run.
    for lock in net.steps.values().flat_map(|step| &step.locks) {
        written[*lock] = true;
    }
    written
}

/// The actions that some expression reads, or that drive several outputs.
fn read(net: &Net) -> IdMap<ControlledAction, bool> {
    let mut read = IdMap::filled(&net.actions, false);
    let mut see = |leaf: &Leaf| {
        if let Leaf::Controlled(action) = leaf {
            read[*action] = true;
        }
    };
    net.expressions().flat_map(Expr::leaves).for_each(&mut see);
    for leaf in net.properties.iter().flat_map(|property| property.never.leaves()) {
        if let PropertyLeaf::Net(leaf) = leaf {
            see(leaf);
        }
    }
    // An action that drives several outputs cannot become one of them.
    let mut n_driven: IdMap<ControlledAction, usize> = IdMap::filled(&net.actions, 0);
    for output in net.outputs.values() {
        if let Driver::Controlled(action) = output.driver {
            n_driven[action] += 1;
        }
    }
    for (action, n) in n_driven.iter() {
        read[action] |= *n > 1;
    }
    read
}

/// True if Q is a function of values that are the same when the outputs are computed.
fn is_level(action: &ControlledAction, written: &IdMap<Var, bool>) -> bool {
    let is_late = |leaf: &Leaf| match leaf {
        Leaf::Var(var) => written[*var],
        Leaf::Timer(_) | Leaf::Controlled(_) | Leaf::TasksDone(_) => true,
        // Events and edges cannot occur in such a condition.
        Leaf::Rise(_) | Leaf::Fall(_) | Leaf::Fireable(_) => true,
        Leaf::Input(_) | Leaf::Active(_) | Leaf::Elapsed(_) | Leaf::LastElapsed(_) => false,
    };
    action.body.is_empty()
        && action.uses.iter().all(|one| {
            one.qualifier == Qualifier::N
                && !one.condition.iter().flat_map(Expr::leaves).any(is_late)
        })
}
