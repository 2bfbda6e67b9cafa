//! The values that the expressions and lists of a net use, so that a program contains nothing else.

use crate::arena::{Id, IdMap};
use crate::expr::{Expr as GenericExpr, ExprKind};
use crate::net::{
    Block, ControlledAction, EdgeOperand, Expr, Input, Leaf, Net, PropertyLeaf, Step, StmtKind,
    Timer, Transition,
};
use crate::walk::{for_each_in_block, for_each_in_driver};

/// The values in use.
#[derive(Debug, Clone)]
pub(super) struct Needs {
    /// One above the largest constant that `s.t` is compared with; `None` if it is never read.
    pub(super) elapsed: IdMap<Step, Option<i64>>,
    /// One above the largest constant that `s.T` is compared with; `None` if it is never read.
    pub(super) last_elapsed: IdMap<Step, Option<i64>>,
    /// One above the largest constant that a free timer is compared with; `None` if it is never read.
    pub(super) timer: IdMap<Timer, Option<i64>>,
    /// Some edge of the operand is read.
    pub(super) edge: IdMap<EdgeOperand, bool>,
    /// Something reads whether the transition is fireable.
    pub(super) fireable: IdMap<Transition, bool>,
    /// Q of the last reaction is read.
    pub(super) controlled: IdMap<ControlledAction, bool>,
    /// The event is raised somewhere.
    pub(super) raised: IdMap<Input, bool>,
    /// Some list reads the step's bit, timer or tasks while the situation changes.
    pub(super) watched: IdMap<Step, bool>,
}

impl Needs {
    /// Searches the whole net; its properties only on request, because they are not part of the reaction.
    pub(super) fn of(net: &Net, with_properties: bool) -> Self {
        let mut needs = Needs {
            elapsed: IdMap::filled(&net.steps, None),
            last_elapsed: IdMap::filled(&net.steps, None),
            timer: IdMap::filled(&net.timers, None),
            edge: IdMap::filled(&net.edges, false),
            fireable: IdMap::filled(&net.transitions, false),
            controlled: IdMap::filled(&net.actions, false),
            raised: IdMap::filled(&net.inputs, false),
            watched: IdMap::filled(&net.steps, false),
        };
        for_each_expr(net, &mut |expr| needs.read(expr));
        for_each_list(net, &mut |list| {
            for_each_raise(list, &mut |event| needs.raised[event] = true);
        });
        for step in net.steps.values() {
            if let Some(event) = step.done_event {
                needs.raised[event] = true;
            }
        }
        // The operands of edges count only if an edge is read.
        let used: Vec<&Expr> = net
            .edges
            .iter()
            .filter(|(edge, _)| needs.edge[*edge])
            .map(|(_, operand)| &operand.expr)
            .collect();
        for expr in used {
            needs.read(expr);
        }
        if with_properties {
            for property in &net.properties {
                if let Ok(expr) = property.never.try_map(
                    &mut |leaf, span| match leaf {
                        PropertyLeaf::Net(leaf) => Ok(GenericExpr::leaf(*leaf, span)),
                        PropertyLeaf::Output(_) => Ok::<_, ()>(GenericExpr::bool(false)),
                    },
                    &mut |leaf, _| match leaf {
                        PropertyLeaf::Net(leaf) => Ok(*leaf),
                        PropertyLeaf::Output(_) => Err(()),
                    },
                ) {
                    needs.read(&expr);
                }
            }
        }
        for_each_moving_list(net, &mut |list| {
            for_each_in_block(list, &mut |expr| {
                expr.for_each_leaf(&mut |leaf| match leaf {
                    Leaf::Active(step)
                    | Leaf::Elapsed(step)
                    | Leaf::LastElapsed(step)
                    | Leaf::TasksDone(step) => {
                        needs.watched[*step] = true;
                    }
                    Leaf::Input(_)
                    | Leaf::Var(_)
                    | Leaf::Timer(_)
                    | Leaf::Rise(_)
                    | Leaf::Fall(_)
                    | Leaf::Fireable(_)
                    | Leaf::Controlled(_) => {}
                });
            });
        });
        needs
    }

    fn read(&mut self, expr: &Expr) {
        if let ExprKind::Compare(_, a, b) = &expr.kind {
            for (side, other) in [(a, b), (b, a)] {
                if let (ExprKind::Leaf(leaf), ExprKind::Int(constant)) = (&side.kind, &other.kind) {
                    self.ticks(*leaf, *constant);
                }
            }
        }
        if let ExprKind::Leaf(leaf) = &expr.kind {
            match *leaf {
                Leaf::Rise(edge) | Leaf::Fall(edge) => self.edge[edge] = true,
                Leaf::Fireable(transition) => self.fireable[transition] = true,
                Leaf::Controlled(action) => self.controlled[action] = true,
                Leaf::Elapsed(_) | Leaf::LastElapsed(_) | Leaf::Timer(_) => self.ticks(*leaf, 0),
                Leaf::Input(_) | Leaf::Var(_) | Leaf::Active(_) | Leaf::TasksDone(_) => {}
            }
        }
        for operand in expr.children() {
            self.read(operand);
        }
    }

    fn ticks(&mut self, leaf: Leaf, constant: i64) {
        let slot = match leaf {
            Leaf::Elapsed(step) => &mut self.elapsed[step],
            Leaf::LastElapsed(step) => &mut self.last_elapsed[step],
            Leaf::Timer(timer) => &mut self.timer[timer],
            Leaf::Input(_)
            | Leaf::Var(_)
            | Leaf::Active(_)
            | Leaf::TasksDone(_)
            | Leaf::Rise(_)
            | Leaf::Fall(_)
            | Leaf::Fireable(_)
            | Leaf::Controlled(_) => return,
        };
        let cap = constant.max(0).saturating_add(1);
        *slot = Some(slot.map_or(cap, |old| old.max(cap)));
    }
}

/// Visits every expression of the reaction, except for the operands of edges.
fn for_each_expr(net: &Net, visit: &mut impl FnMut(&Expr)) {
    for transition in net.transitions.values() {
        visit(&transition.guard);
    }
    net.outputs.values().for_each(|output| for_each_in_driver(&output.driver, visit));
    net.emergency.iter().for_each(|emergency| visit(&emergency.condition));
    net.timers.values().for_each(|timer| visit(&timer.condition));
    for action in net.actions.values() {
        action.uses.iter().filter_map(|one| one.condition.as_ref()).for_each(&mut *visit);
    }
    for_each_list(net, &mut |list| for_each_in_block(list, visit));
}

/// Visits every list that runs while the situation changes.
fn for_each_moving_list(net: &Net, visit: &mut impl FnMut(&Block)) {
    for step in net.steps.values() {
        [&step.exit, &step.entry, &step.initial_content].into_iter().for_each(&mut *visit);
    }
    net.transitions.values().for_each(|transition| visit(&transition.actions));
    net.histories.values().for_each(|history| visit(&history.default_content));
}

fn for_each_list(net: &Net, visit: &mut impl FnMut(&Block)) {
    for_each_moving_list(net, visit);
    net.steps.values().flat_map(|step| &step.tasks).for_each(|task| visit(&task.body));
    net.actions.values().for_each(|action| visit(&action.body));
}

fn for_each_raise(block: &Block, visit: &mut impl FnMut(Id<Input>)) {
    for statement in block {
        match &statement.kind {
            StmtKind::Raise(event) => visit(*event),
            StmtKind::If { then, otherwise, .. } => {
                for_each_raise(then, visit);
                for_each_raise(otherwise, visit);
            }
            StmtKind::Assign { .. }
            | StmtKind::Send(_)
            | StmtKind::Cancel(_)
            | StmtKind::Call { .. }
            | StmtKind::Code(_) => {}
        }
    }
}
