//! Which objects of a net must be on the same part: the rules of place (semantics §10.1).
//!
//! Two objects are *bonded* if a part that has one of them needs the other in the same reaction: a list and the variables that it writes, two transitions of which
//! only one may fire. A part can have copies of steps and timers, because a step changes only when a transition fires, and that is what wires show. It cannot have
//! a copy of a variable. So steps and timers bond nothing; variables, latches and conflicts do.
//!
//! If the parts run on their own (§10.7), a part has no copy of a step either, only a wire that shows whether it is active. So a transition is on the part of its
//! steps, and times, actions and outputs are on the part of the steps that they belong to.

use grafsynth_ir::Gather;
use std::collections::{BTreeMap, BTreeSet};

use grafsynth_ir::Span;
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::division::Running;
use grafsynth_ir::net::{
    ActionId, Block, Driver, Evolution, Expr, InputId, InputKind, Leaf, Net, OutputId, Policy,
    Step, StepId, StepKind, StmtKind, TransitionId, TransitionKind, VarId,
};
use grafsynth_ir::plan::following;
use grafsynth_ir::walk::statements;

use crate::codes;

/// An object that is on exactly one part.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[expect(missing_docs, reason = "each variant names the object")]
pub enum Item {
    Step(StepId),
    Transition(TransitionId),
    Var(VarId),
    Action(ActionId),
    Output(OutputId),
    /// An event that a list raises.
    Event(InputId),
}

impl Item {
    /// The kind and name of the object, for messages.
    #[must_use]
    pub fn describe(self, net: &Net) -> String {
        match self {
            Item::Step(id) => format!("step `{}`", net.steps[id].name),
            Item::Transition(id) => format!("transition `{}`", net.transitions[id].name),
            Item::Var(id) => format!("variable `{}`", net.vars[id].name),
            Item::Action(id) => format!("action `{}`", net.actions[id].name),
            Item::Output(id) => format!("output `{}`", net.outputs[id].name),
            Item::Event(id) => format!("event `{}`", net.inputs[id].name),
        }
    }
}

/// Two objects that must be on the same part, and the rule that requires this.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Bond {
    /// The first object.
    pub one: Item,
    /// The second object.
    pub other: Item,
    /// The rule.
    pub why: Why,
}

/// A rule of place.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Why {
    /// An expression or a list of the first object reads or writes the second one.
    Uses,
    /// The transitions share a preceding step and compete for it.
    Competes,
    /// The receptivity of the first one depends on whether the second one is fireable (`otherwise`).
    Otherwise,
    /// A source transition and the first step that it enters.
    Source,
    /// `fire one`: at most one transition of the whole net fires.
    FireOne,
    /// An enclosing or forcing step changes other steps without a transition that enters or leaves them.
    Hierarchy,
    /// An output, and the variable or action that drives it.
    Drives,
    /// A statechart is on one part: its charts share their queues, and a micro-step may leave and enter states anywhere.
    Statechart,
    /// An output of a statechart that depends on more than active states and inputs, or is registered.
    Depends,
    /// A transition and a step that it enters or leaves, if parts run on their own.
    Moves,
    /// Something that belongs to a step, or reads its time, if parts run on their own.
    Belongs,
}

impl Why {
    /// The rule in words, for the objects `one` and `other`.
    #[must_use]
    pub fn text(self) -> &'static str {
        match self {
            Why::Uses => "uses",
            Why::Competes => "competes with",
            Why::Otherwise => "depends (`otherwise`) on",
            Why::Source => "is a source transition into",
            Why::FireOne => "cannot (`fire one`) fire together with",
            Why::Hierarchy => "shares enclosed or forced steps with",
            Why::Drives => "is driven by",
            Why::Statechart => "is in the same statechart as",
            Why::Depends => {
                "is registered or depends on more than active states and inputs, so it stays with"
            }
            Why::Moves => "enters or leaves",
            Why::Belongs => "belongs to, or reads the time of,",
        }
    }
}

/// The objects of a net in groups: all objects of a group must be on the same part.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Groups {
    /// How the parts will run, which decides about the rules.
    pub running: Running,
    /// The objects of each group, in order; the groups in the order of their first objects.
    pub groups: Vec<Vec<Item>>,
    /// The group of each object.
    pub of: BTreeMap<Item, usize>,
    /// The bonds that made the groups.
    pub bonds: Vec<Bond>,
    /// The groups that only a CPU can have, each with an object and the reason.
    pub cpu_only: BTreeMap<usize, (Item, &'static str)>,
}

impl Groups {
    /// A shortest chain of bonds from one object to another of the same group; empty if there is none.
    #[must_use]
    pub fn chain(&self, from: Item, to: Item) -> Vec<&Bond> {
        let mut before: BTreeMap<Item, &Bond> = BTreeMap::new();
        let mut seen: BTreeSet<_> = [from].into_iter().gather();
        let mut layer = vec![from];
        while !layer.is_empty() && !seen.contains(&to) {
            let mut next = Vec::new();
            for bond in &self.bonds {
                for (near, far) in [(bond.one, bond.other), (bond.other, bond.one)] {
                    if layer.contains(&near) && seen.insert(far) {
                        before.insert(far, bond);
                        next.push(far);
                    }
                }
            }
            layer = next;
        }
        let mut chain = Vec::new();
        let mut at = to;
        while let Some(bond) = before.get(&at) {
            chain.push(*bond);
            at = if bond.one == at { bond.other } else { bond.one };
        }
        chain.reverse();
        chain
    }
}

/// The groups of a net.
///
/// # Errors
/// Features that a split does not support, each with its source location.
pub fn together(net: &Net, running: Running) -> Result<Groups, Vec<Diagnostic>> {
    let hierarchy = hierarchy(net);
    let mut finder = Finder { net, running, hierarchy, bonds: Vec::new(), cpu: BTreeMap::new() };
    finder.unsupported()?;
    if net.settings.policy.is_statechart() {
        finder.statechart();
    } else {
        finder.all();
    }
    Ok(finder.groups())
}

/// What an expression reads. A part can have copies of the steps; it needs the other objects themselves.
#[derive(Debug, Default)]
pub(crate) struct Reads {
    pub(crate) items: BTreeSet<Item>,
    pub(crate) inputs: BTreeSet<InputId>,
    pub(crate) fireable: BTreeSet<TransitionId>,
    /// The steps whose bits are read.
    pub(crate) steps: BTreeSet<StepId>,
    /// The steps whose times are read; `None` if no time is read.
    pub(crate) times: Option<BTreeSet<StepId>>,
    pub(crate) has_extern: bool,
}

impl Reads {
    /// Adds what an expression reads, through edges and timers too.
    pub(crate) fn add(&mut self, net: &Net, expr: &Expr) {
        for leaf in expr.leaves() {
            match *leaf {
                Leaf::Input(input) => {
                    self.inputs.insert(input);
                    match net.inputs[input].kind {
                        InputKind::Extern => self.has_extern = true,
                        InputKind::Event | InputKind::InternalEvent => {
                            self.items.insert(Item::Event(input));
                        }
                        InputKind::Pin => {}
                    }
                }
                Leaf::Var(var) => {
                    self.items.insert(Item::Var(var));
                }
                Leaf::TasksDone(step) => {
                    self.items.insert(Item::Step(step));
                }
                Leaf::Timer(timer) => {
                    self.times.get_or_insert_default();
                    self.add(net, &net.timers[timer].condition);
                }
                Leaf::Rise(edge) | Leaf::Fall(edge) => self.add(net, &net.edges[edge].expr),
                Leaf::Fireable(transition) => {
                    self.fireable.insert(transition);
                }
                Leaf::Controlled(action) => {
                    self.items.insert(Item::Action(action));
                }
                Leaf::Active(step) => _ = self.steps.insert(step),
                Leaf::Elapsed(step) | Leaf::LastElapsed(step) => {
                    self.times.get_or_insert_default().insert(step);
                }
            }
        }
    }
}

struct Finder<'n> {
    net: &'n Net,
    running: Running,
    /// Forced and enclosed steps, which can change without a transition that enters or leaves them, and the steps that force or enclose them.
    hierarchy: BTreeSet<StepId>,
    bonds: Vec<Bond>,
    cpu: BTreeMap<Item, &'static str>,
}

impl Finder<'_> {
    fn unsupported(&self) -> Result<(), Vec<Diagnostic>> {
        let net = self.net;
        if self.running == Running::Free {
            let findings = not_on_their_own(net);
            return if findings.is_empty() { Ok(()) } else { Err(findings) };
        }
        let mut findings = Vec::new();
        let mut refuse = |what: &str, help: &str, span| {
            findings.push(
                Diagnostic::error(codes::UNSUPPORTED, format!("{what} cannot be split yet"))
                    .at(span, "")
                    .help(help),
            );
        };
        if net.settings.policy.is_statechart() {
            let is_last =
                |step: &Step| matches!(step.kind, StepKind::Final) && step.parent.is_none();
            for step in net.steps.values().filter(|step| is_last(step)) {
                let help = "use a state that is not final: the outputs of a chart that has ended keep their values, and a chip stores nothing";
                refuse("a statechart that ends", help, step.meta.span);
            }
        } else if net.settings.evolution != Evolution::Single {
            // The texts of a step run after its reaction, not after each round.
            for step in net.steps.values().filter(|step| !step.code.is_empty()) {
                let what =
                    "a step with text in the target language in a chart with `evolution stable`";
                let help = "write `evolution single`, or call an extern action";
                refuse(what, help, step.meta.span);
            }
        }
        if let Some(open) = net.unspecified.first() {
            refuse(
                "a state table with don't-care entries",
                "replace each `-` and `*` with a value",
                open.when.span,
            );
        }
        if findings.is_empty() { Ok(()) } else { Err(findings) }
    }

    fn bond(&mut self, one: Item, other: Item, why: Why) {
        if one != other {
            self.bonds.push(Bond { one, other, why });
        }
    }

    fn all(&mut self) {
        let net = self.net;
        for (id, step) in net.steps.iter() {
            let item = Item::Step(id);
            let tasks = step.tasks.iter().map(|task| &task.body);
            for list in [&step.entry, &step.exit, &step.initial_content].into_iter().chain(tasks) {
                self.list(item, list);
            }
            for lock in &step.locks {
                self.bond(item, Item::Var(*lock), Why::Uses);
            }
            if !step.code.is_empty() {
                self.cpu.insert(item, "it contains code in the target language");
            }
        }
        for (id, transition) in net.transitions.iter() {
            let item = Item::Transition(id);
            self.expr(item, &transition.guard);
            for event in &transition.events {
                self.event(item, *event);
            }
            self.list(item, &transition.actions);
            if self.running == Running::Free {
                for step in transition.requires.iter().copied().chain(following(transition)) {
                    self.bond(item, Item::Step(step), Why::Moves);
                }
            }
            // The owner must have one of the steps; otherwise the transition would have no step there.
            if transition.requires.is_empty()
                && let Some(step) = following(transition).next()
            {
                self.bond(item, Item::Step(step), Why::Source);
            }
            if transition.kind == TransitionKind::Reaction {
                for step in &transition.requires {
                    self.bond(item, Item::Step(*step), Why::Uses);
                }
            }
        }
        for (id, action) in net.actions.iter() {
            let item = Item::Action(id);
            action.uses.iter().filter_map(|one| one.condition.as_ref()).for_each(|condition| {
                self.expr(item, condition);
            });
            action.uses.iter().for_each(|one| self.copy(item, one.step));
            if self.running == Running::Free
                && action.uses.iter().any(|one| one.qualifier.is_timed())
            {
                self.cpu.insert(item, NO_TICK);
            }
            self.list(item, &action.body);
        }
        for (id, output) in net.outputs.iter() {
            self.output(id, &output.driver);
        }
        self.conflicts();
        self.hierarchy();
    }

    /// A statechart is on the CPU. Only its outputs can be elsewhere: those that are functions of active states and inputs.
    fn statechart(&mut self) {
        let net = self.net;
        let Some(first) = net.steps.ids().next().map(Item::Step) else { return };
        let rest = (net.steps.ids().map(Item::Step))
            .chain(net.transitions.ids().map(Item::Transition))
            .chain(net.vars.ids().map(Item::Var))
            .chain(net.actions.ids().map(Item::Action))
            .chain(self.raised().into_iter().map(Item::Event));
        for item in rest.collect::<Vec<_>>() {
            self.bond(item, first, Why::Statechart);
        }
        self.cpu.insert(first, "it is in a statechart");
        let is_pin = |id: InputId| net.inputs[id].kind == InputKind::Pin;
        let of_inputs = |leaf: &Leaf| matches!(leaf, Leaf::Input(id) if is_pin(*id));
        let of_states = |leaf: &Leaf| of_inputs(leaf) || matches!(leaf, Leaf::Active(_));
        // The states that a chip sees are outputs of the CPU, which an emergency forces too. So they cannot decide about it.
        let is_clear = net.emergency.iter().all(|it| it.condition.leaves().all(of_inputs));
        for (id, output) in net.outputs.iter() {
            // The flip-flop of a registered output has no clock before row 0.
            let is_moore = matches!(&output.driver, Driver::Continuous(_))
                && !output.registered
                && output.driver.exprs().all(|expr| expr.leaves().all(of_states));
            if !(is_moore && is_clear) {
                self.bond(Item::Output(id), first, Why::Depends);
            }
        }
    }

    /// The events that lists raise.
    fn raised(&self) -> BTreeSet<InputId> {
        let raised = self.net.statements().filter_map(|stmt| match stmt.kind {
            StmtKind::Raise(event) => Some(event),
            _ => None,
        });
        raised.gather()
    }

    /// Records that the item needs a copy of the step, which is enough, unless wires cannot show how the step changes.
    fn copy(&mut self, item: Item, step: StepId) {
        if self.running == Running::Free {
            self.bond(item, Item::Step(step), Why::Belongs);
        } else if self.hierarchy.contains(&step) {
            self.bond(item, Item::Step(step), Why::Hierarchy);
        }
    }

    fn output(&mut self, id: OutputId, driver: &Driver) {
        let net = self.net;
        let item = Item::Output(id);
        if self.running == Running::Free {
            let conditions =
                |id: ActionId| net.actions[id].uses.iter().filter_map(|one| one.condition.as_ref());
            let why = match driver {
                Driver::Mealy(_) => Some(
                    "it is a mealy output, which a free-running chip shows before its reaction",
                ),
                Driver::Controlled(action) if conditions(*action).any(|it| !it.is_true()) => Some(
                    "it is controlled with a condition, which a free-running chip shows between its reactions",
                ),
                _ => None,
            };
            if let Some(why) = why {
                self.cpu.insert(item, why);
            }
        }
        driver.exprs().for_each(|expr| self.expr(item, expr));
        match driver {
            Driver::Stored(var) => self.bond(item, Item::Var(*var), Why::Drives),
            Driver::Controlled(action) => self.bond(item, Item::Action(*action), Why::Drives),
            Driver::Fires(transitions) => {
                for transition in transitions {
                    self.bond(item, Item::Transition(*transition), Why::Drives);
                }
            }
            Driver::Extern { calls, .. } => {
                self.cpu.insert(item, "it is a function");
                calls.iter().for_each(|call| self.copy(item, call.step));
            }
            Driver::Continuous(emissions) | Driver::Mealy(emissions) => {
                emissions.iter().for_each(|emission| self.copy(item, emission.step));
            }
        }
        if let Some(emergency) = &net.emergency {
            self.expr(item, &emergency.condition);
        }
    }

    fn event(&mut self, item: Item, event: InputId) {
        // An event that no list raises is only an input.
        let raised = |it: &grafsynth_ir::net::Stmt| it.kind == StmtKind::Raise(event);
        if self.net.lists().any(|list| statements(list).any(raised)) {
            self.bond(item, Item::Event(event), Why::Uses);
        }
    }

    fn expr(&mut self, item: Item, expr: &Expr) {
        let mut reads = Reads::default();
        reads.add(self.net, expr);
        for other in reads.items {
            match other {
                Item::Event(event) => self.event(item, event),
                other => self.bond(item, other, Why::Uses),
            }
        }
        if self.running == Running::Free {
            if reads.times.is_some() {
                self.cpu.insert(item, NO_TICK);
            }
            if reads.inputs.iter().any(|id| !self.net.inputs[*id].ty.is_bool()) {
                let why = "it reads an integer input, whose bits do not change at the same moment";
                self.cpu.insert(item, why);
            }
        } else {
            reads.steps.into_iter().for_each(|step| self.copy(item, step));
        }
        reads.times.into_iter().flatten().for_each(|step| self.copy(item, step));
        for transition in reads.fireable {
            self.bond(item, Item::Transition(transition), Why::Otherwise);
        }
        if reads.has_extern {
            self.cpu.insert(item, "it calls a function");
        }
    }

    fn list(&mut self, item: Item, list: &Block) {
        for stmt in statements(list) {
            stmt.exprs().for_each(|expr| self.expr(item, expr));
            match &stmt.kind {
                StmtKind::Assign { var, .. } => self.bond(item, Item::Var(*var), Why::Uses),
                StmtKind::Raise(event) => self.event(item, *event),
                StmtKind::Call { output, .. } => {
                    self.bond(item, Item::Output(*output), Why::Uses);
                    self.cpu.insert(item, "it calls a function");
                }
                StmtKind::Code(_) => {
                    self.cpu.insert(item, "it contains code in the target language");
                }
                StmtKind::Send(_) | StmtKind::Cancel(_) | StmtKind::If { .. } => {}
            }
        }
    }

    fn conflicts(&mut self) {
        let net = self.net;
        let transitions: Vec<TransitionId> = net.transitions.ids().collect();
        if net.settings.fire_one {
            for pair in transitions.windows(2) {
                self.bond(Item::Transition(pair[0]), Item::Transition(pair[1]), Why::FireOne);
            }
        }
        if net.settings.policy == Policy::All {
            return;
        }
        let mut last: BTreeMap<StepId, TransitionId> = BTreeMap::new();
        for id in transitions {
            let transition = &net.transitions[id];
            if transition.kind == TransitionKind::Reaction {
                continue;
            }
            for step in &transition.requires {
                if let Some(before) = last.insert(*step, id) {
                    self.bond(Item::Transition(before), Item::Transition(id), Why::Competes);
                }
            }
        }
    }

    fn hierarchy(&mut self) {
        let net = self.net;
        let steps = self.hierarchy.clone();
        let parts: BTreeSet<_> = steps.iter().map(|step| net.steps[*step].part).gather();
        let all: Vec<StepId> = steps.iter().copied().collect();
        for pair in all.windows(2) {
            self.bond(Item::Step(pair[0]), Item::Step(pair[1]), Why::Hierarchy);
        }
        if let Some(first) = steps.first().copied() {
            for (id, transition) in net.transitions.iter() {
                let touches = transition.requires.iter().copied().chain(following(transition));
                // A source transition of an enclosed chart depends on its enclosing step.
                if parts.contains(&transition.part) && transition.requires.is_empty()
                    || touches.into_iter().any(|step| steps.contains(&step))
                {
                    self.bond(Item::Transition(id), Item::Step(first), Why::Hierarchy);
                }
            }
        }
    }

    fn groups(self) -> Groups {
        let net = self.net;
        let raised = self.raised();
        let items: Vec<Item> = (net.steps.ids().map(Item::Step))
            .chain(net.transitions.ids().map(Item::Transition))
            .chain(net.vars.ids().map(Item::Var))
            .chain(net.actions.ids().map(Item::Action))
            .chain(net.outputs.ids().map(Item::Output))
            .chain(raised.into_iter().map(Item::Event))
            .collect();
        let place: BTreeMap<Item, usize> =
            items.iter().enumerate().map(|(at, item)| (*item, at)).gather();
        let mut root: Vec<usize> = (0..items.len()).collect();
        for bond in &self.bonds {
            let (Some(one), Some(other)) = (place.get(&bond.one), place.get(&bond.other)) else {
                continue;
            };
            let (one, other) = (find(&mut root, *one), find(&mut root, *other));
            root[one.max(other)] = one.min(other);
        }
        let mut groups: Vec<Vec<Item>> = Vec::new();
        let mut of = BTreeMap::new();
        let mut number: BTreeMap<usize, usize> = BTreeMap::new();
        for (at, item) in items.iter().enumerate() {
            let first = find(&mut root, at);
            let group = *number.entry(first).or_insert_with(|| {
                groups.push(Vec::new());
                groups.len() - 1
            });
            groups[group].push(*item);
            of.insert(*item, group);
        }
        let mut cpu_only = BTreeMap::new();
        for (item, reason) in self.cpu {
            if let Some(group) = of.get(&item) {
                cpu_only.entry(*group).or_insert((item, reason));
            }
        }
        Groups { running: self.running, groups, of, bonds: self.bonds, cpu_only }
    }
}

/// Why a free-running chip cannot have something.
const NO_TICK: &str = "it measures time, and a free-running chip has no tick";

/// What has no meaning if each part makes reactions of its own: what depends on the number of reactions, or happens in one reaction of the whole.
fn not_on_their_own(net: &Net) -> Vec<Diagnostic> {
    let mut found: Vec<(String, Span)> = Vec::new();
    if net.settings.policy.is_statechart() {
        found.push(("a statechart".to_owned(), net.name.span));
    }
    if let Some(emergency) = &net.emergency {
        found.push(("a chart with `emergency`".to_owned(), emergency.condition.span));
    }
    for input in net.inputs.values() {
        let kind = match input.kind {
            InputKind::Pin | InputKind::InternalEvent => continue,
            InputKind::Event => "event",
            InputKind::Extern => "extern condition",
        };
        found.push((format!("a chart with the {kind} `{}`", input.name), input.meta.span));
    }
    for output in net.outputs.values().filter(|output| output.is_extern()) {
        let what = format!("a chart with the extern action `{}`", output.name);
        found.push((what, output.meta.span));
    }
    let of_steps = net.steps.values().filter(|step| !step.code.is_empty());
    let of_lists = net.statements().filter(|stmt| matches!(stmt.kind, StmtKind::Code(_)));
    let mut code = of_steps.map(|step| step.meta.span).chain(of_lists.map(|stmt| stmt.span));
    found.extend(code.next().map(|span| ("text in the target language".to_owned(), span)));
    let refuse = |(what, span): (String, Span)| {
        let message = format!("{what} cannot be split into parts that run on their own");
        Diagnostic::error(codes::UNSUPPORTED, message)
            .at(span, "")
            .help("leave `--link free-running` out: in lockstep, the CPU clocks the chips")
    };
    found.into_iter().map(refuse).collect()
}

/// All enclosing, enclosed, forcing and forced steps.
fn hierarchy(net: &Net) -> BTreeSet<StepId> {
    let mut steps = BTreeSet::new();
    for (id, step) in net.steps.iter() {
        if let Some(parent) = step.parent {
            steps.extend([id, parent]);
        }
    }
    for forcing in &net.forcings {
        steps.insert(forcing.step);
        let forced = net.steps.iter().filter(|(_, step)| forcing.target.contains(&step.part));
        steps.extend(forced.map(|(id, _)| id));
    }
    steps
}

/// The representative of a set (union-find with path halving).
fn find(root: &mut [usize], mut at: usize) -> usize {
    while root[at] != at {
        root[at] = root[root[at]];
        at = root[at];
    }
    at
}
