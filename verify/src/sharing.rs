//! Access to the variables of a halted step (semantics §6).
//!
//! The tasks of a step that halts run in chunks, one per reaction; costs and budget determine where the chunks end. The tasks as a whole and the
//! accesses of others in between are serialisable unless the others depend on something done before a halt *and* on something done after it (conflict
//! serialisability). So a finding names three places: a task before the halt, a task after it, and the access in between. All accesses while the step
//! is halted are combined, because one row shows all of them.

use grafsynth_ir::facts::{Facts, is_active};
use grafsynth_ir::net::{
    Driver, Expr, ForcingOrder, Leaf, Net, Output, Qualifier, Sharing, StepId, TransitionId,
    TransitionKind, VarId, VarOrigin,
};
use grafsynth_ir::sharing::{Accesses, changed_steps};
use grafsynth_ir::{Diagnostic, Span, Valid};
use std::collections::BTreeSet;

use crate::codes;

/// Warnings about variables without a sharing setting, and errors about those that must not be shared. `facts` must belong to the same net. A warning is given
/// only if the halted step and the other access were seen together; an error is given unless this is proved impossible.
#[must_use]
pub fn shared(net: &Valid<Net>, facts: &Facts) -> Vec<Diagnostic> {
    let mut out = Vec::new();
    for (id, step) in net.steps.iter() {
        if step.halts() && !facts.unreachable_steps.contains(&id) {
            Look { net, facts, step: id }.report(&mut out);
        }
    }
    out
}

/// The errors of [`shared`] only, which prevent a build.
#[must_use]
pub fn refused(net: &Valid<Net>, facts: &Facts) -> Vec<Diagnostic> {
    let mut found = shared(net, facts);
    found.retain(Diagnostic::is_error);
    found
}

/// Whether two steps can be active together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Together {
    Never,
    Perhaps,
    Seen,
}

/// A task, list or expression that may run between two chunks.
struct Other {
    accesses: Accesses,
    together: Together,
    /// True if the access waits while a protected variable is locked.
    waits: bool,
    span: Span,
    what: String,
}

struct Look<'n> {
    net: &'n Valid<Net>,
    facts: &'n Facts,
    step: StepId,
}

impl Look<'_> {
    fn report(&self, out: &mut Vec<Diagnostic>) {
        let net = self.net;
        let step = &net.steps[self.step];
        let others = self.others();
        let chunks = step.chunks();
        let mut told: BTreeSet<(VarId, VarId)> = BTreeSet::new();
        for pair in chunks.windows(2) {
            let (before, after) = (0..pair[0].end, pair[1].start..step.tasks.len());
            let (first, second) = (self.tasks(before.clone()), self.tasks(after.clone()));
            let mut found: Vec<(VarId, VarId, &Other, &Other)> = Vec::new();
            for one in &others {
                for x in first.clashes(&one.accesses).filter(|it| self.matters(*it, one)) {
                    for other in &others {
                        for y in second.clashes(&other.accesses) {
                            if self.matters(y, other) {
                                found.push((x, y, one, other));
                            }
                        }
                    }
                }
            }
            // The clearest findings have one variable before and after the halt; a finding with two variables is reported only if there is none of these.
            found.sort_by_key(|(x, y, one, other)| (x != y, *x, *y, one.span, other.span));
            let any_alone = found.first().is_some_and(|(x, y, ..)| x == y);
            found.retain(|(x, y, ..)| !any_alone || x == y);
            found.dedup_by_key(|(x, y, ..)| (*x, *y));
            if !any_alone {
                found.truncate(1);
            }
            for (x, y, one, other) in found {
                if told.insert((x, y)) {
                    out.push(self.diagnostic(x, y, one, other, before.clone(), after.clone()));
                }
            }
        }
    }

    fn tasks(&self, range: std::ops::Range<usize>) -> Accesses {
        Accesses::of_tasks(self.net, self.step, range)
    }

    /// False if a sharing setting of the designer covers this access.
    fn matters(&self, var: VarId, other: &Other) -> bool {
        let is_seen = other.together == Together::Seen;
        self.net.vars[var].origin != VarOrigin::Hidden
            && match self.net.sharing.get(&var) {
                None => is_seen,
                Some(Sharing::Refuse) => true,
                Some(Sharing::Protect) => is_seen && !other.waits,
                Some(Sharing::Allow | Sharing::Buffer) => false,
            }
    }

    fn diagnostic(
        &self,
        x: VarId,
        y: VarId,
        one: &Other,
        other: &Other,
        before: std::ops::Range<usize>,
        after: std::ops::Range<usize>,
    ) -> Diagnostic {
        let net = self.net;
        let step = &net.steps[self.step];
        let says = |var: VarId, sharing: Sharing| net.sharing.get(&var) == Some(&sharing);
        let names = if x == y {
            format!("`{}`", net.vars[x].name)
        } else {
            format!("`{}` and `{}`", net.vars[x].name, net.vars[y].name)
        };
        let verb = if x == y { "is" } else { "are" };
        let message =
            format!("{names} {verb} shared with step `{}` while the step is halted", step.name);
        let is_refused = says(x, Sharing::Refuse) || says(y, Sharing::Refuse);
        let mut finding = if is_refused {
            Diagnostic::error(codes::SHARED, message)
        } else {
            Diagnostic::warning(codes::SHARED, message)
        };
        finding = finding.at(one.span, self.saw(one, x));
        if other.span != one.span || x != y {
            finding = finding.at(other.span, self.saw(other, y));
        }
        if let Some((span, text)) = self.task(before, x) {
            finding = finding.at(span, format!("{text} before the halt"));
        }
        if let Some((span, text)) = self.task(after, y) {
            finding = finding.at(span, format!("{text} after the halt"));
        }
        let list = if x == y {
            net.vars[x].name.text.clone()
        } else {
            format!("{}, {}", net.vars[x].name, net.vars[y].name)
        };
        finding.help(if says(x, Sharing::Protect) || says(y, Sharing::Protect) {
            format!("write `shared buffer {list}`, so that the tasks work on a copy; this access cannot wait")
        } else {
            format!(
                "wait for `{}.done`, or write `shared buffer {list}` (the tasks work on a copy), `shared protect {list}` (others wait), or \
                 `shared allow {list}` (accept it)",
                step.name
            )
        })
    }

    fn saw(&self, other: &Other, var: VarId) -> String {
        let verb = if other.accesses.writes.contains(&var) { "writes" } else { "reads" };
        let when = if other.together == Together::Seen {
            "while the step is halted"
        } else {
            "(not proved impossible while the step is halted)"
        };
        format!("{} {verb} `{}` {when}", other.what, self.net.vars[var].name)
    }

    /// The task among these that accesses the variable; a writing task is preferred.
    fn task(&self, range: std::ops::Range<usize>, var: VarId) -> Option<(Span, String)> {
        let net = self.net;
        let step = &net.steps[self.step];
        let mut found = None;
        for at in range {
            let accesses = self.tasks(at..at + 1);
            let name = &step.tasks[at].name;
            if accesses.writes.contains(&var) {
                return Some((name.span, format!("task `{name}` writes it")));
            }
            if accesses.reads.contains(&var) && found.is_none() {
                found = Some((name.span, format!("task `{name}` reads it")));
            }
        }
        found
    }

    /// All accesses that may happen while the step is halted.
    fn others(&self) -> Vec<Other> {
        let net = self.net;
        let mut all = Vec::new();
        all.extend(net.transitions.ids().filter_map(|id| self.transition(id)));
        for (id, step) in net.steps.iter().filter(|(id, _)| *id != self.step) {
            if !step.tasks.is_empty() {
                all.push(Other {
                    accesses: Accesses::of_tasks(net, id, 0..step.tasks.len()),
                    together: self.together(id),
                    waits: true,
                    span: step.tasks[0].name.span,
                    what: format!("a task of step `{}`", step.name),
                });
            }
        }
        let mut rests = |accesses: Accesses, together, span, what: String| {
            all.push(Other { accesses, together, waits: false, span, what });
        };
        for output in net.outputs.values() {
            for (accesses, together, span, what) in self.output(output) {
                rests(accesses, together, span, what);
            }
        }
        for action in net.actions.values() {
            let together = action.uses.iter().map(|one| {
                if one.qualifier == Qualifier::R {
                    Together::Never
                } else if one.qualifier.outlives_step() {
                    Together::Seen
                } else {
                    self.together(one.step)
                }
            });
            let mut accesses = self.of(action.uses.iter().filter_map(|one| one.condition.as_ref()));
            accesses.block(net, &action.body);
            let what = format!("action `{}`", action.name);
            let span = place(action.name.span, action.meta.span);
            rests(accesses, together.max().unwrap_or(Together::Never), span, what);
        }
        for timer in net.timers.values() {
            let accesses = self.of([&timer.condition]);
            rests(accesses, Together::Seen, timer.name.span, format!("timer `{}`", timer.name));
        }
        for forcing in &net.forcings {
            let own = net.steps[self.step].part;
            if forcing.target.contains(&own) && forcing.order != ForcingOrder::Hold {
                continue;
            }
            let mut accesses = Accesses::default();
            for (id, _) in net.steps.iter().filter(|(_, it)| forcing.target.contains(&it.part)) {
                self.exit(id, &mut accesses);
                self.entry(id, &mut accesses);
            }
            let what = "a step that this order forces".to_owned();
            rests(accesses, self.together(forcing.step), forcing.span, what);
        }
        all.retain(|one| one.together != Together::Never);
        all
    }

    /// The accesses of a transition, with the lists of the steps that it changes.
    fn transition(&self, id: TransitionId) -> Option<Other> {
        let net = self.net;
        let transition = &net.transitions[id];
        if self.facts.dead_transitions.contains(&id) || self.is_after(&transition.guard) {
            return None;
        }
        let requires = transition.requires.iter();
        let together = requires.map(|step| self.together(*step)).min();
        let mut accesses = Accesses::default();
        accesses.expr(net, &transition.guard);
        accesses.block(net, &transition.actions);
        let (left, entered) = changed_steps(net, id);
        left.into_iter().for_each(|step| self.exit(step, &mut accesses));
        entered.into_iter().for_each(|step| self.entry(step, &mut accesses));
        let what = match transition.kind {
            TransitionKind::Move => "transition",
            TransitionKind::Reaction => "reaction",
        };
        Some(Other {
            accesses,
            together: together.unwrap_or(Together::Seen),
            waits: true,
            span: place(transition.meta.span, transition.name.span),
            what: format!("{what} `{}`", transition.name),
        })
    }

    /// The accesses of the conditions and arguments of an output, for each step that drives it.
    fn output(&self, output: &Output) -> Vec<(Accesses, Together, Span, String)> {
        let is_read = |condition: &Option<Expr>| {
            !condition.as_ref().is_some_and(|condition| self.is_after(condition))
        };
        match &output.driver {
            Driver::Continuous(emissions) | Driver::Mealy(emissions) => (emissions.iter())
                .filter(|one| is_read(&one.condition))
                .map(|one| {
                    let what = format!("output `{}`", output.name);
                    (self.of(&one.condition), self.together(one.step), one.span, what)
                })
                .collect(),
            Driver::Extern { calls, .. } => (calls.iter())
                .filter(|one| is_read(&one.condition))
                .map(|one| {
                    let accesses = self.of(one.condition.iter().chain(&one.arguments));
                    let what = format!("the call of `{}`", output.name);
                    (accesses, self.together(one.step), one.span, what)
                })
                .collect(),
            Driver::Fires(_) | Driver::Stored(_) | Driver::Controlled(_) => Vec::new(),
        }
    }

    /// The accesses of expressions.
    fn of<'e>(&self, exprs: impl IntoIterator<Item = &'e Expr>) -> Accesses {
        let mut accesses = Accesses::default();
        exprs.into_iter().for_each(|expr| accesses.expr(self.net, expr));
        accesses
    }

    /// Adds the accesses of the exit list of another step.
    fn exit(&self, step: StepId, accesses: &mut Accesses) {
        if step != self.step {
            accesses.block(self.net, &self.net.steps[step].exit);
        }
    }

    /// Adds the accesses of the entry lists of another step.
    fn entry(&self, step: StepId, accesses: &mut Accesses) {
        if step != self.step {
            accesses.block(self.net, &self.net.steps[step].entry);
            accesses.block(self.net, &self.net.steps[step].initial_content);
        }
    }

    /// True if the condition is true only when the tasks are done.
    fn is_after(&self, condition: &Expr) -> bool {
        use grafsynth_ir::expr::ExprKind;
        match &condition.kind {
            ExprKind::And(all) => all.iter().any(|one| self.is_after(one)),
            ExprKind::Leaf(Leaf::TasksDone(step)) => *step == self.step,
            ExprKind::Not(one) => {
                matches!(one.kind, ExprKind::Leaf(Leaf::Active(step)) if step == self.step)
            }
            _ => false,
        }
    }

    /// Whether the other step can be active while the halted step is active.
    fn together(&self, other: StepId) -> Together {
        let (this, facts) = (self.step, self.facts);
        if other == this {
            return Together::Seen;
        }
        if facts.unreachable_steps.contains(&other) {
            return Together::Never;
        }
        if facts.exclude(self.net, this, other) {
            return Together::Never;
        }
        let Some((reach, sets)) = facts.reach.as_ref().and_then(|it| Some((it, it.sets.as_ref()?)))
        else {
            return Together::Perhaps;
        };
        let seen = sets.iter().any(|set| is_active(set, this) && is_active(set, other));
        if seen && reach.exact { Together::Seen } else { Together::Perhaps }
    }
}

fn place(first: Span, second: Span) -> Span {
    if first == Span::default() { second } else { first }
}
