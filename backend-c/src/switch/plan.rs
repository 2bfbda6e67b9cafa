//! The plan of the `switch` style: the state variables, the variable that decides each transition, and whether this style supports the net at all.
//!
//! # State variables
//! Every proved sequential component becomes one state variable; a step in no component becomes a variable of its own with the values *none* and
//! *active*. A micro-step handles the variables in order. A transition is decided at its *owner*: the first variable from which it takes a step.
//! Its effect on later variables is stored in a flag, and a step that it adds to a variable from which it takes nothing is added after all variables are
//! handled. So every receptivity is read before anything it depends on changes, without a second copy of the state. If that is impossible, the net is
//! rejected with the reason, and the caller uses the style `bits`.

mod competition;

use crate::refusal::{Refusal, refuse};
use competition::competition;
use grafsynth_ir::Gather;
use grafsynth_ir::facts::Facts;
use grafsynth_ir::net::{
    Block, Driver, Evolution, Expr, InputId, InputKind, Leaf, Net, Step, StepId, StepKind,
    StmtKind, Transition, TransitionId, TransitionKind, Var, VarId,
};
use grafsynth_ir::plan::{Needs, following, is_over_inputs, urgency};
use grafsynth_ir::walk::{expressions, statements};
use grafsynth_ir::{IdMap, Span};
use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};

/// One state variable.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Machine {
    /// Its steps; the index is the step's code, plus one if there is a value *none*.
    pub(crate) steps: Vec<StepId>,
    /// True if in some situations none of its steps is active; the code 0 represents them.
    pub(crate) has_none: bool,
    /// One above the largest constant that the time of a step of this variable is compared with; `None` if no time is read.
    pub(crate) timer_cap: Option<i64>,
    /// True if a transition that takes nothing from this variable adds a step to it.
    pub(crate) is_entered: bool,
    /// True if a receptivity reads a step bit of this variable after the variable was handled.
    pub(crate) needs_old: bool,
    /// True if it has an entry or exit list, or owns a transition with actions.
    pub(crate) has_lists: bool,
}

impl Machine {
    /// The number of values.
    pub(crate) fn values(&self) -> usize {
        self.steps.len() + usize::from(self.has_none)
    }
}

/// The time at which an extern condition is called.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Latch {
    /// At the start of every reaction.
    Always,
    /// At the start of the case that mentions it, if only one case does.
    InCase,
    /// At the first mention; the value is kept for the reaction.
    OnDemand,
}

/// All decisions about the C code before it is printed.
#[derive(Debug, Clone)]
pub(crate) struct Plan {
    /// The state variables, in the order in which they are handled.
    pub(crate) machines: Vec<Machine>,
    /// Variable and code of each step.
    pub(crate) place: IdMap<Step, (usize, u32)>,
    /// For each step, the transitions that leave it, in the order in which they are tested.
    pub(crate) leaving: IdMap<Step, Vec<TransitionId>>,
    /// The variable that decides each transition; `None` for one that can never be enabled.
    pub(crate) owner: IdMap<Transition, Option<usize>>,
    /// True for a transition that changes a variable besides its owner.
    pub(crate) is_wide: IdMap<Transition, bool>,
    /// The transitions with an output that shows that they fire.
    pub(crate) is_shown: IdMap<Transition, bool>,
    /// When each extern condition is called.
    pub(crate) latches: BTreeMap<InputId, Latch>,
    /// Steps whose time is read.
    pub(crate) timed: BTreeSet<StepId>,
}

impl Plan {
    /// The steps that a transition takes from variable `machine`.
    pub(crate) fn taken(
        &self,
        net: &Net,
        transition: TransitionId,
        machine: usize,
    ) -> Option<StepId> {
        net.transitions[transition]
            .requires
            .iter()
            .copied()
            .find(|step| self.place[*step].0 == machine)
    }

    /// The step that a transition adds to variable `machine`.
    pub(crate) fn added(
        &self,
        net: &Net,
        transition: TransitionId,
        machine: usize,
    ) -> Option<StepId> {
        following(&net.transitions[transition]).find(|step| self.place[*step].0 == machine)
    }
}

/// The plan, or the reason why there is none.
pub(crate) fn plan(net: &Net, facts: &Facts) -> Result<Plan, Refusal> {
    refuse_features(net)?;
    let (mut machines, place) = state_variables(net, facts);
    let mut leaving: IdMap<Step, Vec<TransitionId>> = IdMap::filled(&net.steps, Vec::new());
    let mut owner = IdMap::filled(&net.transitions, None);
    let mut is_wide = IdMap::filled(&net.transitions, false);
    let mut is_shown = IdMap::filled(&net.transitions, false);
    for output in net.outputs.values() {
        if let Driver::Fires(transitions) = &output.driver {
            transitions.iter().for_each(|transition| is_shown[*transition] = true);
        }
    }
    for (id, transition) in net.transitions.iter() {
        let mut taken = BTreeMap::new();
        let mut possible = true;
        for step in &transition.requires {
            // Two steps of one component are never active together, so such a transition is never enabled.
            possible &= taken.insert(place[*step].0, *step).is_none_or(|earlier| earlier == *step);
        }
        if !possible {
            continue;
        }
        let mut added = BTreeMap::new();
        for step in following(transition) {
            if added.insert(place[step].0, step).is_some_and(|earlier| earlier != step) {
                return refuse(
                    "a transition into two steps that are never active together",
                    transition.meta.span,
                );
            }
        }
        let Some(first) = taken.keys().next().copied() else {
            return refuse("a source transition", transition.meta.span);
        };
        owner[id] = Some(first);
        is_wide[id] = taken.len() > 1 || added.keys().any(|machine| *machine != first);
        for machine in added.keys().filter(|machine| !taken.contains_key(machine)) {
            machines[*machine].is_entered = true;
        }
        for step in taken.values() {
            leaving[*step].push(id);
        }
    }
    let mut place = place;
    for machine in &mut machines {
        // A deferred step needs a value that means "none".
        if machine.is_entered && !machine.has_none {
            machine.has_none = true;
            for step in &machine.steps {
                place[*step].1 += 1;
            }
        }
    }
    for step in net.steps.ids() {
        leaving[step].sort_unstable_by_key(|transition| (urgency(net, *transition), *transition));
        leaving[step].dedup();
    }
    let mut plan = Plan {
        machines,
        place,
        leaving,
        owner,
        is_wide,
        is_shown,
        latches: BTreeMap::new(),
        timed: BTreeSet::new(),
    };
    competition(net, &plan)?;
    timers(net, &mut plan);
    lists(net, facts, &mut plan)?;
    reads(net, &mut plan)?;
    latches(net, &mut plan);
    Ok(plan)
}

/// Rejects features that need the whole reaction as a program.
fn refuse_features(net: &Net) -> Result<(), Refusal> {
    let name = net.name.span;
    if net.settings.policy.is_statechart() {
        return refuse("a statechart", name);
    }
    if net.settings.fire_one {
        return refuse("`fire one`", name);
    }
    if let Some(forcing) = net.forcings.first() {
        return refuse("a forcing order", forcing.span);
    }
    if let Some(ending) = &net.ending {
        return refuse("an end of a reaction that waits for other parts", ending.waits.span);
    }
    if let Some(send) = net.sends.values().next() {
        return refuse("a delayed event", send.meta.span);
    }
    for step in net.steps.values() {
        if step.kind != StepKind::Leaf || step.parent.is_some() {
            return refuse(
                format!("the enclosing or enclosed step `{}`", step.name),
                step.meta.span,
            );
        }
        if !step.tasks.is_empty() {
            return refuse(format!("tasks of step `{}`", step.name), step.meta.span);
        }
    }
    for expr in frame_exprs(net) {
        for leaf in expr.leaves() {
            if let Leaf::LastElapsed(_) = leaf {
                return refuse("the time `T` of a step", expr.span);
            }
            if leaf.input().is_some_and(|input| net.inputs[input].kind == InputKind::Extern) {
                return refuse("an extern condition that an action or a timer reads", expr.span);
            }
        }
    }
    for action in net.actions.values() {
        let mut effects = Effects::default();
        effects.of(&action.body);
        if effects.raises {
            return refuse("an event that the chart raises", action.meta.span);
        }
    }
    for transition in net.transitions.values() {
        if transition.kind == TransitionKind::Reaction {
            return refuse("a reaction of a step", transition.meta.span);
        }
    }
    Ok(())
}

/// One variable for each proved component, in the order of its first step, and one for each remaining step.
fn state_variables(net: &Net, facts: &Facts) -> (Vec<Machine>, IdMap<Step, (usize, u32)>) {
    let mut of: IdMap<Step, Option<usize>> = IdMap::filled(&net.steps, None);
    let mut groups: Vec<(Vec<StepId>, bool)> = Vec::new();
    for component in &facts.components {
        let steps: Vec<StepId> = component
            .steps
            .iter()
            .copied()
            .filter(|step| step.index() < net.steps.len() && of[*step].is_none())
            .collect();
        if steps.is_empty() {
            continue;
        }
        // A component that lost a step to an earlier one may have no active step.
        let always = component.always && steps.len() == component.steps.len();
        for step in &steps {
            of[*step] = Some(groups.len());
        }
        groups.push((steps, always));
    }
    for step in net.steps.ids() {
        if of[step].is_none() {
            of[step] = Some(groups.len());
            groups.push((vec![step], false));
        }
    }
    groups.sort_by_key(|(steps, _)| steps.iter().min().copied());
    let mut place = IdMap::filled(&net.steps, (0, 0));
    let mut machines = Vec::with_capacity(groups.len());
    for (index, (mut steps, always)) in groups.into_iter().enumerate() {
        steps.sort_unstable();
        for (code, step) in steps.iter().enumerate() {
            let code = u32::try_from(code).unwrap_or(u32::MAX);
            place[*step] = (index, code + u32::from(!always));
        }
        machines.push(Machine {
            steps,
            has_none: !always,
            timer_cap: None,
            is_entered: false,
            needs_old: false,
            has_lists: false,
        });
    }
    (machines, place)
}

/// The whole receptivity: one of its events, if it has any, and its condition.
pub(crate) fn receptivity(net: &Net, id: TransitionId) -> Cow<'_, Expr> {
    let transition = &net.transitions[id];
    if transition.events.is_empty() {
        return Cow::Borrowed(&transition.guard);
    }
    let span = transition.meta.span;
    let event =
        Expr::or(transition.events.iter().map(|event| Expr::leaf(Leaf::Input(*event), span)));
    Cow::Owned(Expr::and([event, transition.guard.clone()]))
}

/// Every guard of a net, with its transition.
pub(crate) fn each_guard(net: &Net) -> impl Iterator<Item = (TransitionId, &Expr)> {
    net.transitions.iter().map(|(id, transition)| (id, &transition.guard))
}

/// Conditions and arguments of outputs.
fn output_exprs(net: &Net) -> impl Iterator<Item = &Expr> {
    net.outputs.values().flat_map(|output| output.driver.exprs())
}

/// The expressions that are evaluated after the evolution, except those of outputs: controlled actions and free timers.
fn frame_exprs(net: &Net) -> impl Iterator<Item = &Expr> {
    (net.timers.values().map(|timer| &timer.condition)).chain(net.actions.values().flat_map(
        |action| {
            let conditions = action.uses.iter().filter_map(|one| one.condition.as_ref());
            conditions.chain(expressions(&action.body))
        },
    ))
}

/// The expressions of the lists of steps and transitions.
pub(crate) fn list_exprs(net: &Net) -> impl Iterator<Item = &Expr> {
    (net.steps.values())
        .flat_map(|step| [&step.entry, &step.exit])
        .chain(net.transitions.values().map(|transition| &transition.actions))
        .flat_map(|list| expressions(list))
}

/// Finds the steps whose times are read, and the maximum of each variable's timer.
fn timers(net: &Net, plan: &mut Plan) {
    for (step, cap) in Needs::of(net, false).elapsed.iter() {
        let Some(cap) = *cap else { continue };
        let machine = &mut plan.machines[plan.place[step].0];
        machine.timer_cap = Some(machine.timer_cap.unwrap_or(0).max(cap));
        plan.timed.insert(step);
    }
}

/// Decides which variable runs each list, and checks that the lists of two variables do not interfere.
fn lists(net: &Net, facts: &Facts, plan: &mut Plan) -> Result<(), Refusal> {
    let mut writer: IdMap<Var, Option<usize>> = IdMap::filled(&net.vars, None);
    let mut all: Vec<(usize, &Block, Span)> = Vec::new();
    for (id, step) in net.steps.iter() {
        let machine = plan.place[id].0;
        all.push((machine, &step.entry, step.meta.span));
        all.push((machine, &step.exit, step.meta.span));
    }
    for (id, transition) in net.transitions.iter() {
        if let Some(owner) = plan.owner[id] {
            all.push((owner, &transition.actions, transition.meta.span));
        }
    }
    all.retain(|(_, block, _)| !block.is_empty());
    let mut caller = None;
    for (machine, block, span) in &all {
        plan.machines[*machine].has_lists = true;
        let mut effects = Effects::default();
        effects.of(block);
        if effects.raises {
            return refuse("an event that the chart raises", *span);
        }
        if effects.calls && caller.replace(*machine).is_some_and(|other| other != *machine) {
            return refuse("calls in lists of parallel branches", *span);
        }
        for var in effects.writes {
            if writer[var].replace(*machine).is_some_and(|other| other != *machine) {
                return refuse("a variable that parallel branches write", *span);
            }
        }
    }
    if let (true, Evolution::Stable { limit }) = (caller.is_some(), net.settings.evolution)
        && facts.stable_depth.as_ref().is_none_or(|depth| depth.value > limit)
    {
        // To find out whether the limit was too small, a copy of the chart runs one more micro-step; a call cannot be run on
        // trial.
        return refuse("calls in a stable evolution that may reach its limit", net.name.span);
    }
    if net.settings.assign_simultaneous
        && let Some((_, _, span)) = all.first()
    {
        return refuse("simultaneous assignments", *span);
    }
    for machine in &plan.machines {
        // A step that is removed and added in the same micro-step stays active: its lists must not run, which only the whole micro-step can decide.
        if machine.has_lists && machine.is_entered {
            let span =
                machine.steps.first().map_or_else(Span::default, |step| net.steps[*step].meta.span);
            return refuse(
                "lists in a parallel branch that a transition enters from outside",
                span,
            );
        }
    }
    // Of the variables that lists write, a list or receptivity may read only those that the lists of its own state variable write.
    let foreign = |expr: &Expr, machine: usize| {
        expr.leaves().any(|leaf| {
            matches!(leaf, Leaf::Var(var) if writer[*var].is_some_and(|owner| owner != machine))
        })
    };
    for (machine, block, span) in &all {
        if expressions(block).any(|expr| foreign(expr, *machine)) {
            return refuse("a variable that a parallel branch writes", *span);
        }
        let outside = expressions(block).flat_map(Expr::leaves).any(|leaf| {
            matches!(leaf, Leaf::Active(step) | Leaf::Elapsed(step) if plan.place[*step].0 != *machine)
        });
        if outside {
            return refuse("a list that reads the steps of a parallel branch", *span);
        }
    }
    for (id, guard) in each_guard(net) {
        let Some(owner) = plan.owner[id] else { continue };
        if foreign(guard, owner) {
            return refuse("a receptivity that reads what a parallel branch writes", guard.span);
        }
    }
    Ok(())
}

/// The effects of a block besides assignments.
#[derive(Default)]
struct Effects {
    raises: bool,
    calls: bool,
    writes: BTreeSet<VarId>,
}

impl Effects {
    fn of(&mut self, block: &Block) {
        for stmt in statements(block) {
            match &stmt.kind {
                StmtKind::Assign { var, .. } => {
                    self.writes.insert(*var);
                }
                StmtKind::Raise(_) | StmtKind::Send(_) | StmtKind::Cancel(_) => self.raises = true,
                StmtKind::Call { .. } | StmtKind::Code(_) => self.calls = true,
                StmtKind::If { .. } => {}
            }
        }
    }
}

/// Checks that nothing but a receptivity, which is checked elsewhere, reads the time that a step keeps while it is inactive.
fn no_last_times(net: &Net) -> Result<(), Refusal> {
    let mut all = output_exprs(net)
        .chain(list_exprs(net))
        .chain(net.emergency.iter().map(|one| &one.condition));
    let is_last = |leaf: &Leaf| matches!(leaf, Leaf::LastElapsed(_));
    match all.find(|expr| expr.leaves().any(is_last)) {
        Some(expr) => refuse("the time `T` of a step", expr.span),
        None => Ok(()),
    }
}

/// Checks that everything that receptivities, lists and outputs read is available in their context.
fn reads(net: &Net, plan: &mut Plan) -> Result<(), Refusal> {
    for edge in net.edges.values() {
        if !is_over_inputs(edge) {
            return refuse("an edge of something that is not an input", edge.expr.span);
        }
    }
    let mut old: BTreeSet<usize> = BTreeSet::new();
    for (id, guard) in each_guard(net) {
        let Some(owner) = plan.owner[id] else { continue };
        let mut refused = None;
        let mut rivals = 0;
        for leaf in guard.leaves() {
            match *leaf {
                Leaf::Active(step) if plan.place[step].0 < owner => {
                    old.insert(plan.place[step].0);
                }
                Leaf::Elapsed(step) if plan.place[step].0 < owner => {
                    refused = Some("a receptivity that reads the time of a parallel branch");
                }
                Leaf::LastElapsed(_) => refused = Some("the time `T` of a step"),
                Leaf::Fireable(rival) => {
                    rivals += 1;
                    let here =
                        net.transitions[rival].requires.iter().all(|it| plan.place[*it].0 == owner);
                    if !here {
                        refused = Some("`otherwise` together with a join");
                    }
                }
                Leaf::Input(_)
                | Leaf::Var(_)
                | Leaf::Active(_)
                | Leaf::Elapsed(_)
                | Leaf::TasksDone(_)
                | Leaf::Timer(_)
                | Leaf::Rise(_)
                | Leaf::Fall(_)
                | Leaf::Controlled(_) => {}
            }
        }
        if let Some(what) = refused {
            return refuse(what, guard.span);
        }
        // Under `priority` numbers an earlier transition may be tested later; its receptivity is then repeated, which must not grow without bound.
        if rivals > 0 {
            let nested = guard.leaves().any(|leaf| {
                let Leaf::Fireable(rival) = leaf else { return false };
                let rival_data = &net.transitions[*rival];
                let before = rival_data.requires.iter().all(|step| {
                    let asked = &plan.leaving[*step];
                    asked.iter().position(|it| it == rival) < asked.iter().position(|it| *it == id)
                });
                !before && rival_data.guard.leaves().any(|inner| matches!(inner, Leaf::Fireable(_)))
            });
            if nested {
                return refuse("`otherwise` that depends on another `otherwise`", guard.span);
            }
        }
    }
    no_last_times(net)?;
    for machine in old {
        plan.machines[machine].needs_old = true;
    }
    for (id, transition) in net.transitions.iter() {
        let adds_outside = following(transition).any(|step| {
            transition.requires.iter().all(|taken| plan.place[*taken].0 != plan.place[step].0)
        });
        if transition.restart && adds_outside && plan.owner[id].is_some() {
            return refuse(
                "`restart` in a transition that enters a step of another branch",
                transition.meta.span,
            );
        }
    }
    Ok(())
}

/// Decides when each extern condition is called (§6).
fn latches(net: &Net, plan: &mut Plan) {
    let in_edges: BTreeSet<InputId> =
        net.edges.values().flat_map(|edge| edge.expr.leaves()).filter_map(Leaf::input).gather();
    let mut places: BTreeMap<InputId, BTreeSet<Option<usize>>> = BTreeMap::new();
    for (id, guard) in each_guard(net) {
        for input in guard.leaves().filter_map(Leaf::input) {
            // A receptivity that is tested as a rival is mentioned at the other variable too.
            let place = if plan.is_wide[id] { None } else { plan.owner[id] };
            places.entry(input).or_default().insert(place);
        }
    }
    for expr in output_exprs(net).chain(list_exprs(net)) {
        for input in expr.leaves().filter_map(Leaf::input) {
            places.entry(input).or_default().insert(None);
        }
    }
    let single = net.settings.evolution == Evolution::Single;
    for (id, input) in net.inputs.iter() {
        if input.kind != InputKind::Extern {
            continue;
        }
        let places = places.get(&id);
        let latch = if in_edges.contains(&id) {
            Latch::Always
        } else if single && places.is_some_and(|it| it.len() == 1 && !it.contains(&None)) {
            Latch::InCase
        } else {
            Latch::OnDemand
        };
        plan.latches.insert(id, latch);
    }
}
