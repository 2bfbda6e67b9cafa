//! Walks over a net: every list, statement and expression of it, for analyses and for passes that change all of them.

use crate::net::{Block, Driver, Expr, Net, OutputId, Param, Stmt, StmtKind};
use crate::span::Span;
use std::collections::BTreeMap;

impl Stmt {
    /// The expressions that the statement itself evaluates, in this order; those of its lists are not included.
    pub fn exprs(&self) -> impl Iterator<Item = &Expr> {
        let (few, many): ([Option<&Expr>; 2], &[Expr]) = match &self.kind {
            StmtKind::Assign { index, value, .. } => ([index.as_ref(), Some(value)], &[]),
            StmtKind::Call { arguments, .. } => ([None; 2], arguments),
            StmtKind::If { condition, .. } => ([Some(condition), None], &[]),
            StmtKind::Raise(_) | StmtKind::Send(_) | StmtKind::Cancel(_) | StmtKind::Code(_) => {
                ([None; 2], &[])
            }
        };
        few.into_iter().flatten().chain(many)
    }

    /// Like [`Stmt::exprs`], to change them.
    pub fn exprs_mut(&mut self) -> impl Iterator<Item = &mut Expr> {
        let (few, many): ([Option<&mut Expr>; 2], &mut [Expr]) = match &mut self.kind {
            StmtKind::Assign { index, value, .. } => ([index.as_mut(), Some(value)], &mut []),
            StmtKind::Call { arguments, .. } => ([None, None], arguments),
            StmtKind::If { condition, .. } => ([Some(condition), None], &mut []),
            StmtKind::Raise(_) | StmtKind::Send(_) | StmtKind::Cancel(_) | StmtKind::Code(_) => {
                ([None, None], &mut [])
            }
        };
        few.into_iter().flatten().chain(many)
    }

    /// Both branches of a choice; empty for any other statement.
    #[must_use]
    pub fn lists(&self) -> [&[Stmt]; 2] {
        if let StmtKind::If { then, otherwise, .. } = &self.kind {
            [then, otherwise]
        } else {
            [&[]; 2]
        }
    }
}

/// All statements of a list in the order of the text, each before those inside it.
pub fn statements(list: &[Stmt]) -> impl Iterator<Item = &Stmt> {
    nested(list, Stmt::lists)
}

/// All expressions of a list and of the lists inside, without their operands.
pub fn expressions(list: &[Stmt]) -> impl Iterator<Item = &Expr> {
    statements(list).flat_map(Stmt::exprs)
}

/// Calls `change` with every statement of a list, each before those inside it.
pub fn change_statements(list: &mut [Stmt], change: &mut impl FnMut(&mut Stmt)) {
    for stmt in list {
        change(stmt);
        if let StmtKind::If { then, otherwise, .. } = &mut stmt.kind {
            change_statements(then, change);
            change_statements(otherwise, change);
        }
    }
}

/// The statements of a list and of all lists inside, in the order of the text; `lists` returns the lists of a statement.
pub(crate) fn nested<'a, S>(
    list: &'a [S],
    lists: impl Fn(&'a S) -> [&'a [S]; 2],
) -> impl Iterator<Item = &'a S> {
    let mut open = vec![list.iter()];
    std::iter::from_fn(move || {
        while let Some(rest) = open.last_mut() {
            if let Some(stmt) = rest.next() {
                let [first, second] = lists(stmt);
                open.extend([second.iter(), first.iter()]);
                return Some(stmt);
            }
            open.pop();
        }
        None
    })
}

impl Driver {
    /// The parameters of an extern action; empty for any other output.
    #[must_use]
    pub fn params(&self) -> &[Param] {
        if let Driver::Extern { params, .. } = self { params } else { &[] }
    }

    /// The conditions of an output, and the arguments of its calls.
    pub fn exprs(&self) -> impl Iterator<Item = &Expr> {
        let emissions = match self {
            Driver::Continuous(emissions) | Driver::Mealy(emissions) => emissions.as_slice(),
            Driver::Fires(_)
            | Driver::Stored(_)
            | Driver::Controlled(_)
            | Driver::Extern { .. } => &[],
        };
        let calls = if let Driver::Extern { calls, .. } = self { calls.as_slice() } else { &[] };
        let conditions = emissions.iter().filter_map(|emission| emission.condition.as_ref());
        conditions.chain(calls.iter().flat_map(|call| call.condition.iter().chain(&call.arguments)))
    }
}

impl Net {
    /// Every statement list: of steps, tasks, transitions, actions and histories.
    pub fn lists(&self) -> impl Iterator<Item = &Block> {
        let steps = self.steps.values().flat_map(|step| {
            let tasks = step.tasks.iter().map(|task| &task.body);
            [&step.entry, &step.exit, &step.initial_content].into_iter().chain(tasks)
        });
        steps
            .chain(self.transitions.values().map(|transition| &transition.actions))
            .chain(self.actions.values().map(|action| &action.body))
            .chain(self.histories.values().map(|history| &history.default_content))
    }

    /// Like [`Net::lists`], to change them.
    pub fn lists_mut(&mut self) -> impl Iterator<Item = &mut Block> {
        let steps = self.steps.values_mut().flat_map(|step| {
            let tasks = step.tasks.iter_mut().map(|task| &mut task.body);
            [&mut step.entry, &mut step.exit, &mut step.initial_content].into_iter().chain(tasks)
        });
        steps
            .chain(self.transitions.values_mut().map(|transition| &mut transition.actions))
            .chain(self.actions.values_mut().map(|action| &mut action.body))
            .chain(self.histories.values_mut().map(|history| &mut history.default_content))
    }

    /// Every statement, including those inside `if`.
    pub fn statements(&self) -> impl Iterator<Item = &Stmt> {
        self.lists().flat_map(|list| statements(list))
    }

    /// Every expression except those of properties.
    pub fn expressions(&self) -> impl Iterator<Item = &Expr> {
        (self.outputs.values().flat_map(|output| output.driver.exprs()))
            .chain(self.emergency.iter().map(|emergency| &emergency.condition))
            .chain(self.ending.iter().map(|ending| &ending.waits))
            .chain(self.timers.values().map(|timer| &timer.condition))
            .chain(self.edges.values().map(|edge| &edge.expr))
            .chain(self.transitions.values().map(|transition| &transition.guard))
            .chain(
                self.actions
                    .values()
                    .flat_map(|action| action.uses.iter().filter_map(|one| one.condition.as_ref())),
            )
            .chain(self.statements().flat_map(Stmt::exprs))
            .chain(self.unspecified.iter().map(|open| &open.when))
    }
}

/// The extern actions that statement lists, bodies and tasks call, each with the location of its first call. Such a call is instantaneous, so the action
/// has no lasting value like an output.
#[must_use]
pub fn called_in_lists(net: &Net) -> BTreeMap<OutputId, Span> {
    let mut called: BTreeMap<OutputId, Span> = BTreeMap::new();
    for stmt in net.statements() {
        if let StmtKind::Call { output, .. } = stmt.kind {
            called.entry(output).and_modify(|at| *at = (*at).min(stmt.span)).or_insert(stmt.span);
        }
    }
    called
}
