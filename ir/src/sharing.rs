//! Variables that tasks share with others while their step is halted (semantics §6).
//!
//! A step whose tasks need more than its budget *halts*: it runs some of them, waits for the next reaction, and continues. Meanwhile others can see
//! intermediate values of its tasks, and values that its tasks have read can change (section IV.B of the paper on Grafcet, C and PALASM).
//! [`Accesses`] lists what reads and writes which variables; [`separate`] rewrites the net so that the requested variables are separated, and no
//! engine has to handle it:
//!
//! ```text
//! shared buffer x     step s { task a { x := x + 1 }  task b { y := x } }
//!                 =>  step s { task a { s.x := x; s.x := s.x + 1 }  task b { y := s.x; x := s.x } }
//!
//! shared protect x    step s { task a { x := x + 1 }  task b { y := x } }            p -> q when x > 3
//!                 =>  step s { task a { s.held := true; .. }  task b { ..; s.held := false }  exit { s.held := false } }
//!                     p -> q when not s.held and x > 3       other steps whose tasks touch x:  locks (s.held)
//! ```

use crate::Gather;
use crate::expr::{Expr as GenericExpr, Type};
use crate::net::{
    Block, Enter, Expr, Leaf, Net, Sharing, StepId, StepKind, Stmt, StmtKind, TransitionId, Var,
    VarId, VarOrigin,
};
use crate::span::{Name, Span};
use crate::walk::{change_statements, expressions, statements};
use std::collections::{BTreeMap, BTreeSet};

/// The variables that an object reads and writes.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Accesses {
    /// Variables read, including those in operands of edges.
    pub reads: BTreeSet<VarId>,
    /// Variables assigned.
    pub writes: BTreeSet<VarId>,
}

impl Accesses {
    /// Adds the accesses of an expression. An `otherwise` reads what the earlier transitions read.
    pub fn expr(&mut self, net: &Net, expr: &Expr) {
        self.expr_at(net, expr, &mut BTreeSet::new());
    }

    fn expr_at(&mut self, net: &Net, expr: &Expr, seen: &mut BTreeSet<TransitionId>) {
        for leaf in expr.leaves() {
            match *leaf {
                Leaf::Var(var) => {
                    self.reads.insert(var);
                }
                Leaf::Rise(edge) | Leaf::Fall(edge) => {
                    self.expr_at(net, &net.edges[edge].expr, seen);
                }
                // Only earlier transitions can be named, so there is no cycle; each is visited once, so the time is linear.
                Leaf::Fireable(transition) if seen.insert(transition) => {
                    self.expr_at(net, &net.transitions[transition].guard, seen);
                }
                _ => {}
            }
        }
    }

    /// Adds the accesses of a statement list.
    pub fn block(&mut self, net: &Net, list: &Block) {
        expressions(list).for_each(|expr| self.expr(net, expr));
        for stmt in statements(list) {
            if let StmtKind::Assign { var, .. } = stmt.kind {
                self.writes.insert(var);
            }
        }
    }

    /// The accesses of those tasks of a step that are in `range`.
    #[must_use]
    pub fn of_tasks(net: &Net, step: StepId, range: std::ops::Range<usize>) -> Self {
        let mut accesses = Accesses::default();
        for task in &net.steps[step].tasks[range] {
            accesses.block(net, &task.body);
        }
        accesses
    }

    /// Adds all accesses of `other`.
    pub fn add(&mut self, other: &Accesses) {
        self.reads.extend(&other.reads);
        self.writes.extend(&other.writes);
    }

    /// Variables that both access and that at least one of them writes, in declaration order.
    pub fn clashes<'a>(&'a self, other: &'a Accesses) -> impl Iterator<Item = VarId> + 'a {
        let mine = self.reads.union(&self.writes).copied();
        mine.filter(|var| {
            other.writes.contains(var) || (self.writes.contains(var) && other.reads.contains(var))
        })
    }

    fn retain(&mut self, keep: impl Fn(VarId) -> bool) {
        self.reads.retain(|var| keep(*var));
        self.writes.retain(|var| keep(*var));
    }
}

/// The steps whose exit and entry lists run when a transition fires. The sets may be too large if forcing, history or `restart` decides what really
/// changes.
#[must_use]
pub fn changed_steps(net: &Net, transition: TransitionId) -> (Vec<StepId>, Vec<StepId>) {
    let transition = &net.transitions[transition];
    let mut left: BTreeSet<StepId> = transition.clears.iter().copied().gather();
    let mut entered: BTreeSet<StepId> = BTreeSet::new();
    let mut todo: Vec<Enter> = transition.enters.clone();
    let mut histories = BTreeSet::new();
    while let Some(enter) = todo.pop() {
        match enter {
            Enter::Step(step) | Enter::InitialContent(step) => {
                entered.insert(step);
            }
            Enter::History(history) => {
                if histories.insert(history) {
                    let data = &net.histories[history];
                    todo.extend(data.default.iter().copied());
                    todo.extend(data.cases.iter().flat_map(|case| case.enters.iter().copied()));
                }
            }
        }
    }
    // Parents are declared before the steps that they enclose, so one pass handles all levels.
    for (id, step) in net.steps.iter() {
        let Some(parent) = step.parent.filter(|it| net.steps[*it].kind == StepKind::Enclosing)
        else {
            continue;
        };
        if left.contains(&parent) {
            left.insert(id);
        }
        if entered.contains(&parent) && step.activation_link {
            entered.insert(id);
        }
    }
    (left.into_iter().collect(), entered.into_iter().collect())
}

/// Carries out `shared buffer` and `shared protect` (see the module documentation). A second call changes nothing.
pub fn separate(net: &mut Net) {
    if net.sharing.values().any(|it| matches!(it, Sharing::Buffer | Sharing::Protect)) {
        let mut names = Fresh::of(net);
        buffer(net, &mut names);
        protect(net, &mut names);
    }
}

/// A generator of names that no signal uses.
struct Fresh(BTreeSet<String>);

impl Fresh {
    fn of(net: &Net) -> Self {
        let signals = net.inputs.values().map(|it| &it.name);
        let signals = signals.chain(net.outputs.values().map(|it| &it.name));
        let signals = signals.chain(net.vars.values().map(|it| &it.name));
        let signals = signals.chain(net.timers.values().map(|it| &it.name));
        let mut taken: BTreeSet<String> = signals.map(|it| it.text.clone()).gather();
        // `s.active`, `s.t`, `s.T` and `s.done` of a step have names of this form.
        for step in net.steps.values() {
            taken.extend(["active", "t", "T", "done"].map(|of| format!("{}.{of}", step.name)));
        }
        for one in &net.macros {
            taken.extend(["active", "t", "T", "done"].map(|of| format!("{}.{of}", one.name)));
        }
        Fresh(taken)
    }

    fn name(&mut self, base: &str, span: Span) -> Name {
        let mut text = base.to_owned();
        let mut n = 1_u32;
        while !self.0.insert(text.clone()) {
            n += 1;
            text = format!("{base}_{n}");
        }
        Name::new(text, span)
    }
}

/// Carries out `shared buffer`: tasks of halting steps work on copies.
fn buffer(net: &mut Net, names: &mut Fresh) {
    let halting: Vec<StepId> =
        net.steps.iter().filter(|(_, step)| step.halts()).map(|(id, _)| id).collect();
    for id in halting {
        let n_tasks = net.steps[id].tasks.len();
        let mut accesses = Accesses::of_tasks(net, id, 0..n_tasks);
        let sharing = net.sharing.clone();
        accesses.retain(|var| sharing.get(&var) == Some(&Sharing::Buffer));
        let mut copies: BTreeMap<VarId, VarId> = BTreeMap::new();
        for var in accesses.reads.union(&accesses.writes) {
            let data = net.vars[*var].clone();
            let base = format!("{}.{}", net.steps[id].name, data.name);
            let name = names.name(&base, data.name.span);
            let copy = net.vars.push(Var { name, origin: VarOrigin::Hidden, ..data });
            copies.insert(*var, copy);
        }
        if copies.is_empty() {
            continue;
        }
        let mut first = Block::new();
        let mut last = Block::new();
        for (var, copy) in &copies {
            copied(net, *copy, *var, &mut first);
            if accesses.writes.contains(var) {
                copied(net, *var, *copy, &mut last);
            }
        }
        let tasks = &mut net.steps[id].tasks;
        for task in tasks.iter_mut() {
            task.body = on_copies(&task.body, &copies);
        }
        if let Some(task) = tasks.first_mut() {
            first.append(&mut task.body);
            task.body = first;
        }
        if let Some(task) = tasks.last_mut() {
            task.body.append(&mut last);
        }
    }
}

/// Adds `to := from`, element by element.
fn copied(net: &Net, to: VarId, from: VarId, out: &mut Block) {
    let assign = |index: Option<Expr>, value: Expr| Stmt {
        kind: StmtKind::Assign { var: to, index, value },
        span: net.vars[from].name.span,
    };
    match net.vars[from].len {
        None => out.push(assign(None, GenericExpr::leaf(Leaf::Var(from), Span::default()))),
        Some(len) => out.extend((0..len).map(|at| {
            let index = || Expr::int(i64::from(at));
            let element = crate::expr::ExprKind::Element(Leaf::Var(from), Box::new(index()));
            assign(Some(index()), GenericExpr::new(element, Span::default()))
        })),
    }
}

fn on_copies(list: &Block, copies: &BTreeMap<VarId, VarId>) -> Block {
    let copy = |var: VarId| copies.get(&var).copied().unwrap_or(var);
    let mut list = list.clone();
    change_statements(&mut list, &mut |stmt| {
        if let StmtKind::Assign { var, .. } = &mut stmt.kind {
            *var = copy(*var);
        }
        for expr in stmt.exprs_mut() {
            *expr = expr.map_leaves(&|leaf| match *leaf {
                Leaf::Var(var) => Leaf::Var(copy(var)),
                other => other,
            });
        }
    });
    list
}

/// Carries out `shared protect`: halting steps lock the variables that their tasks access, and transitions and tasks of others wait.
fn protect(net: &mut Net, names: &mut Fresh) {
    let sharing = net.sharing.clone();
    let tasks_of = |net: &Net, id: StepId| {
        let mut accesses = Accesses::of_tasks(net, id, 0..net.steps[id].tasks.len());
        accesses.retain(|var| sharing.get(&var) == Some(&Sharing::Protect));
        accesses
    };
    let holders: Vec<(StepId, Accesses)> = (net.steps.iter())
        .filter(|(_, step)| step.halts())
        .map(|(id, _)| (id, tasks_of(net, id)))
        .filter(|(_, accesses)| *accesses != Accesses::default())
        .collect();
    if holders.is_empty() {
        return;
    }
    let tasked: Vec<(StepId, Accesses)> = (net.steps.iter())
        .filter(|(_, step)| !step.tasks.is_empty())
        .map(|(id, _)| (id, tasks_of(net, id)))
        .collect();
    // For each transition: its own accesses, and those of the step lists that it may run.
    let of_lists = |lists: &[&Block]| {
        let mut accesses = Accesses::default();
        lists.iter().for_each(|list| accesses.block(net, list));
        accesses
    };
    let exits: Vec<Accesses> = net.steps.values().map(|step| of_lists(&[&step.exit])).collect();
    let entries: Vec<Accesses> =
        (net.steps.values()).map(|step| of_lists(&[&step.entry, &step.initial_content])).collect();
    let contents: Vec<Accesses> = (net.transitions.values())
        .map(|transition| {
            let mut accesses = Accesses::default();
            accesses.expr(net, &transition.guard);
            accesses.block(net, &transition.actions);
            for enter in &transition.enters {
                if let Enter::History(history) = enter {
                    accesses.block(net, &net.histories[*history].default_content);
                }
            }
            accesses
        })
        .collect();
    let changed: Vec<(Vec<StepId>, Vec<StepId>)> =
        net.transitions.ids().map(|id| changed_steps(net, id)).collect();
    let mut waits: Vec<Vec<VarId>> = vec![Vec::new(); net.transitions.len()];
    for (holder, accesses) in holders {
        let step = &net.steps[holder];
        let name = names.name(&format!("{}.held", step.name), step.name.span);
        let meta = step.meta.clone();
        let held = net.vars.push(Var {
            name,
            ty: Type::Bool,
            len: None,
            init: vec![0],
            origin: VarOrigin::Hidden,
            meta,
        });
        let set = |value: bool| Stmt {
            kind: StmtKind::Assign { var: held, index: None, value: Expr::bool(value) },
            span: Span::default(),
        };
        for (other, touched) in &tasked {
            if *other != holder && accesses.clashes(touched).next().is_some() {
                net.steps[*other].locks.push(held);
            }
        }
        for (at, content) in contents.iter().enumerate() {
            // The holder may run its own lists: it can finish what it began.
            let (left, entered) = &changed[at];
            let left = left.iter().map(|step| (*step, &exits[step.index()]));
            let entered = entered.iter().map(|step| (*step, &entries[step.index()]));
            let touches = accesses.clashes(content).next().is_some()
                || (left.chain(entered).filter(|(step, _)| *step != holder))
                    .any(|(_, lists)| accesses.clashes(lists).next().is_some());
            if touches {
                waits[at].push(held);
            }
        }
        let step = &mut net.steps[holder];
        step.exit.push(set(false));
        if let Some(first) = step.tasks.first_mut() {
            first.body.insert(0, set(true));
        }
        if let Some(last) = step.tasks.last_mut() {
            last.body.push(set(false));
        }
    }
    for ((_, transition), waits) in net.transitions.iter_mut().zip(waits) {
        if waits.is_empty() {
            continue;
        }
        let free = waits.into_iter().map(|held| Expr::leaf(Leaf::Var(held), Span::default()).not());
        let guard = std::mem::replace(&mut transition.guard, Expr::bool(true));
        transition.guard = Expr::and(free.chain([guard]));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::FileId;
    use crate::text::{parse, print};

    /// The net after the pass, with the given sharing setting for x.
    fn separated(sharing: &str) -> String {
        let text = format!(
            "net t
policy all
evolution single
schedule declared
tick 10000000 ns
part t level 1
input i bool
var x int 0..9 {sharing} = 1
var y int 0..9 = 0
step s in t initial budget 3
    task a cost 2 {{ x := x + 1 }}
    task b cost 1 {{ y := y + 1 }}
    task c cost 2 {{ y := x }}
step u in t initial budget 3
    task d cost 1 {{ x := 0 }}
step p in t initial
step q in t
    entry {{ y := x }}
transition t1 in t p -> q when i
transition t2 in t q -> p when y > 3
transition t3 in t s -> q when s.done
"
        );
        let (net, found) = parse(FileId(0), &text);
        let mut net = net.unwrap_or_else(|| panic!("{found:?}"));
        let step = net.steps.values().next().expect("there is one");
        assert_eq!(step.chunks(), [0..2, 2..3]);
        separate(&mut net);
        crate::validate(net.clone()).expect("it stays valid");
        print(&net)
    }

    #[test]
    fn copies_are_taken_first_and_published_last() {
        let text = separated("buffer");
        assert!(text.contains("task a cost 2 { s.x := x; s.x := s.x + 1 }"), "{text}");
        assert!(text.contains("task c cost 2 { y := s.x; x := s.x }"), "{text}");
        assert!(text.contains("task d cost 1 { x := 0 }"), "{text}");
        assert!(text.contains("when i\n"), "{text}");
    }

    #[test]
    fn who_touches_what_is_held_waits() {
        let text = separated("protect");
        assert!(text.contains("task a cost 2 { s.held := true; x := x + 1 }"), "{text}");
        assert!(text.contains("task c cost 2 { y := x; s.held := false }"), "{text}");
        assert!(text.contains("exit { s.held := false }"), "{text}");
        assert!(text.contains("step u in t initial budget 3 locks (s.held)"), "{text}");
        // The transition waits because of the lists that run on activation, not because of its receptivity; y is not shared.
        assert!(text.contains("p -> q when not s.held and i"), "{text}");
        assert!(text.contains("q -> p when y > 3"), "{text}");
    }

    #[test]
    fn what_is_allowed_stays_as_it_is() {
        let text = separated("allow");
        assert!(!text.contains("s.held") && !text.contains("s.x"), "{text}");
    }
}
