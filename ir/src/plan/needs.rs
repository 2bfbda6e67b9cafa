//! The values that the expressions and lists of a net use, so that a program contains nothing else.

use crate::arena::IdMap;
use crate::expr::{Expr as GenericExpr, ExprKind};
use crate::net::{
    Block, ControlledAction, EdgeOperand, Expr, Input, Leaf, Net, PropertyLeaf, Step, Stmt,
    StmtKind, Timer, Transition,
};
use crate::walk::expressions;

/// The values in use.
#[derive(Debug, Clone)]
pub struct Needs {
    /// One above the largest constant that `s.t` is compared with; `None` if `s.t` is never read.
    pub elapsed: IdMap<Step, Option<i64>>,
    /// One above the largest constant that `s.T` is compared with; `None` if `s.T` is never read.
    pub last_elapsed: IdMap<Step, Option<i64>>,
    /// One above the largest constant that a free timer is compared with; `None` if the timer is never read.
    pub timer: IdMap<Timer, Option<i64>>,
    /// True if some edge of the operand is read.
    pub edge: IdMap<EdgeOperand, bool>,
    /// True if something reads whether the transition is fireable.
    pub fireable: IdMap<Transition, bool>,
    /// True if Q of the last reaction is read.
    pub controlled: IdMap<ControlledAction, bool>,
    /// True if the event is raised somewhere.
    pub raised: IdMap<Input, bool>,
    /// True if some list reads the step's bit, timer or tasks while the situation changes.
    pub watched: IdMap<Step, bool>,
}

impl Needs {
    /// Searches the whole net; its properties only on request, because they are not part of the reaction.
    #[must_use]
    pub fn of(net: &Net, with_properties: bool) -> Self {
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
        reaction_exprs(net).for_each(|expr| needs.read(expr));
        for stmt in net.statements() {
            if let StmtKind::Raise(event) = stmt.kind {
                needs.raised[event] = true;
            }
        }
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
        for expr in moving_lists(net).flat_map(|list| expressions(list)) {
            for step in expr.leaves().filter_map(Leaf::step) {
                needs.watched[step] = true;
            }
        }
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

/// Every expression of the reaction, except for the operands of edges.
fn reaction_exprs(net: &Net) -> impl Iterator<Item = &Expr> {
    (net.transitions.values().map(|transition| &transition.guard))
        .chain(net.outputs.values().flat_map(|output| output.driver.exprs()))
        .chain(net.emergency.iter().map(|emergency| &emergency.condition))
        .chain(net.ending.iter().map(|ending| &ending.waits))
        .chain(net.timers.values().map(|timer| &timer.condition))
        .chain(
            net.actions
                .values()
                .flat_map(|action| action.uses.iter().filter_map(|one| one.condition.as_ref())),
        )
        .chain(net.statements().flat_map(Stmt::exprs))
}

/// Every list that runs while the situation changes.
fn moving_lists(net: &Net) -> impl Iterator<Item = &Block> {
    (net.steps.values())
        .flat_map(|step| [&step.exit, &step.entry, &step.initial_content])
        .chain(net.transitions.values().map(|transition| &transition.actions))
        .chain(net.histories.values().map(|history| &history.default_content))
}
