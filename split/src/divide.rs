//! The nets of the parts, and the wires between them (semantics §10.2).
//!
//! The net of a part contains the objects that the part owns, and copies of all steps, timers and operands of edges that these read. A copy of a step changes when
//! a transition that enters or leaves it fires. If another part owns that transition, an *image* repeats its effect on the steps of this part: it has the
//! steps of the transition that the part has, and a wire as its receptivity. An image never loses a conflict: the owner of the transition also owns all competing
//! transitions, and has already resolved the conflict.
//!
//! A copy has no lists and no tasks, so each list runs on one part only. The steps after a transition are copied only if the part reads them: a transition into a
//! step of another part is a sink transition in this part, and a source transition in the other.
//!
//! If the parts run on their own (§10.7), they have no copies and no images: a part reads from a wire whether a step of another part is active.

use grafsynth_ir::Gather;
use std::collections::{BTreeMap, BTreeSet};

use grafsynth_ir::arena::{Arena, IdMap};
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::division::{
    Division, Original, Owners, PartIndex, PartNet, Running, Shown, Signal, Source, has_ending,
    round_of, rounds_of,
};
use grafsynth_ir::expr::Type;
use grafsynth_ir::facts::Component;
use grafsynth_ir::net::{
    Block, ControlledAction, Driver, EdgeId, EdgeOperand, Emission, Ending, Enter, Expr,
    ExternCall, Forcing, ForcingOrder, Input, InputId, Leaf, Meta, Net, Output, Part, Policy, Step,
    StepId, Stmt, StmtKind, Timer, TimerId, Transition, TransitionId, TransitionKind, Var,
};
use grafsynth_ir::plan::following;
use grafsynth_ir::validate::{Valid, validate};
use grafsynth_ir::walk::{expressions, statements};
use grafsynth_ir::{Id, Name};

use crate::away;
use crate::codes;
use crate::emergency;
use crate::pieces::{Ids, assumption, connect, numbered, unused, used_names, wire_input};
use crate::statechart;
use crate::together::{Groups, Item};

/// Divides a net: gives each object to its owner, and each part the copies and wires that it needs. `names` are the names of the parts, and `components` the
/// proved sequential components of the net of a round ([`round_of`]).
///
/// # Errors
/// Bonded objects with different owners, each with the rule; findings of validation, which are a bug in grafsynth.
pub fn divide(
    net: &Valid<Net>,
    groups: &Groups,
    owners: Owners,
    names: &[String],
    components: &[Component],
) -> Result<Division, Vec<Diagnostic>> {
    let apart: Vec<Diagnostic> = groups
        .bonds
        .iter()
        .filter(|bond| owner_of(&owners, groups, bond.one) != owner_of(&owners, groups, bond.other))
        .map(|bond| {
            let (one, other) = (bond.one.describe(net), bond.other.describe(net));
            let message = format!(
                "{one} and {other} are placed on different parts, but {one} {} {other}",
                bond.why.text()
            );
            Diagnostic::error(codes::APART, message)
        })
        .collect();
    if !apart.is_empty() {
        return Err(apart);
    }
    if net.settings.policy.is_statechart() {
        return statechart::divide(net, owners, names);
    }
    let running = groups.running;
    // Parts that run on their own make whole reactions.
    let (round, is_stable) = match running {
        Running::Lockstep => (round_of(net)?, rounds_of(net).is_some()),
        Running::Free => (net.clone(), false),
    };
    let net = &round;
    let contents: Vec<Contents> =
        (0..names.len()).map(|part| Contents::of(net, &owners, (part, running))).collect();
    let shown: BTreeSet<Signal> =
        contents.iter().flat_map(|one| one.wires.iter().copied()).gather();
    let mut used = used_names(net);
    let wires: BTreeMap<Signal, String> = shown
        .into_iter()
        .map(|signal| (signal, unused(wire_name(net, signal), &mut used)))
        .gather();
    let more = is_stable.then(|| unused("more".to_owned(), &mut used));
    let mut parts = Vec::new();
    for (part, name) in names.iter().enumerate() {
        let mut copier = Copier::new(net, &owners, part, &contents[part], &wires);
        // The CPU is the last part.
        copier.is_chip = part + 1 < names.len();
        copier.is_clocked = running == Running::Free && copier.is_chip;
        if is_stable && owners.transitions.values().any(|owner| *owner == part) {
            copier.moves = Some(unused(format!("moves_{name}"), &mut used));
        }
        copier.more = more.as_deref();
        let is_cut = !copier.is_chip && running == Running::Lockstep;
        let cut = if is_cut { components } else { &[] };
        parts.push(copier.part(name, cut, &mut used)?);
    }
    let signals = wires.into_iter().map(|(signal, name)| (signal, name, owner(&owners, signal)));
    let wires = connect(&parts, signals);
    Ok(Division { running, parts, owners, wires })
}

/// The part that knows a signal.
fn owner(owners: &Owners, signal: Signal) -> PartIndex {
    match signal {
        Signal::Fires(id) => owners.transitions[id],
        Signal::Active(id) => owners.steps[id],
    }
}

fn wire_name(net: &Net, signal: Signal) -> String {
    let (verb, name) = match signal {
        Signal::Fires(id) => ("fires", &net.transitions[id].name),
        Signal::Active(id) => ("active", &net.steps[id].name),
    };
    format!("{verb}_{}", name.text.replace('.', "_"))
}

/// The owner of an object; the owner of an event is the part that raises it.
fn owner_of(owners: &Owners, groups: &Groups, item: Item) -> Option<PartIndex> {
    Some(match item {
        Item::Step(id) => owners.steps[id],
        Item::Transition(id) => owners.transitions[id],
        Item::Var(id) => owners.vars[id],
        Item::Action(id) => owners.actions[id],
        Item::Output(id) => owners.outputs[id],
        Item::Event(_) => {
            let group = groups.groups.get(*groups.of.get(&item)?)?;
            let other = group.iter().find(|other| !matches!(other, Item::Event(_)))?;
            return owner_of(owners, groups, *other);
        }
    })
}

/// The objects of one part, in the ids of the whole net.
#[derive(Debug, Default)]
struct Contents {
    steps: BTreeSet<StepId>,
    /// What the part must know about other parts: the transitions that change a step that it has or, if the parts run on their own, the steps that it reads.
    wires: BTreeSet<Signal>,
    inputs: BTreeSet<InputId>,
    timers: BTreeSet<TimerId>,
    edges: BTreeSet<EdgeId>,
}

impl Contents {
    fn of(net: &Net, owners: &Owners, (part, running): (PartIndex, Running)) -> Contents {
        let mut all = Contents::default();
        for (id, step) in net.steps.iter().filter(|(id, _)| owners.steps[*id] == part) {
            all.steps.insert(id);
            let tasks = step.tasks.iter().map(|task| &task.body);
            for list in [&step.entry, &step.exit].into_iter().chain(tasks) {
                all.list(net, list);
            }
        }
        for (id, transition) in net.transitions.iter() {
            if owners.transitions[id] != part {
                continue;
            }
            all.steps.extend(&transition.requires);
            // The priorities and ages of the following steps decide between transitions, and order their actions.
            if net.settings.policy == Policy::PriorityAge {
                all.steps.extend(following(transition));
            }
            all.inputs.extend(&transition.events);
            all.expr(net, &transition.guard);
            all.list(net, &transition.actions);
        }
        for (_, action) in net.actions.iter().filter(|(id, _)| owners.actions[*id] == part) {
            for one in &action.uses {
                all.steps.insert(one.step);
                one.condition.iter().for_each(|condition| all.expr(net, condition));
            }
            all.list(net, &action.body);
        }
        let mut forced = false;
        for (_, output) in net.outputs.iter().filter(|(id, _)| owners.outputs[*id] == part) {
            output.driver.exprs().for_each(|expr| all.expr(net, expr));
            match &output.driver {
                Driver::Continuous(emissions) | Driver::Mealy(emissions) => {
                    all.steps.extend(emissions.iter().map(|emission| emission.step));
                }
                Driver::Extern { calls, .. } => {
                    all.steps.extend(calls.iter().map(|call| call.step))
                }
                Driver::Fires(_) | Driver::Stored(_) | Driver::Controlled(_) => {}
            }
            // The emergency stops the calls of a function too.
            forced |= !matches!(output.driver, Driver::Fires(_));
        }
        if forced && let Some(emergency) = &net.emergency {
            all.expr(net, &emergency.condition);
        }
        if running == Running::Free {
            let is_foreign = |step: &StepId| owners.steps[*step] != part;
            let (foreign, own) = all.steps.into_iter().partition(is_foreign);
            let foreign: BTreeSet<StepId> = foreign;
            all.steps = own;
            all.wires = foreign.into_iter().map(Signal::Active).gather();
            return all;
        }
        // The steps around a step are of its own part, by the rules of place.
        for (id, transition) in net.transitions.iter() {
            let mut touched = transition.requires.iter().copied().chain(following(transition));
            if owners.transitions[id] != part
                && transition.kind == TransitionKind::Move
                && touched.any(|step| all.steps.contains(&step))
            {
                all.wires.insert(Signal::Fires(id));
            }
        }
        all
    }

    fn list(&mut self, net: &Net, list: &Block) {
        expressions(list).for_each(|expr| self.expr(net, expr));
        for stmt in statements(list) {
            if let StmtKind::Raise(event) = stmt.kind {
                self.inputs.insert(event);
            }
        }
    }

    fn expr(&mut self, net: &Net, expr: &Expr) {
        for leaf in expr.leaves() {
            match *leaf {
                Leaf::Input(input) => {
                    self.inputs.insert(input);
                }
                Leaf::Active(step)
                | Leaf::Elapsed(step)
                | Leaf::LastElapsed(step)
                | Leaf::TasksDone(step) => {
                    self.steps.insert(step);
                }
                Leaf::Timer(timer) => {
                    self.timers.insert(timer);
                    self.expr(net, &net.timers[timer].condition);
                }
                Leaf::Rise(edge) | Leaf::Fall(edge) => {
                    self.edges.insert(edge);
                    self.expr(net, &net.edges[edge].expr);
                }
                Leaf::Var(_) | Leaf::Fireable(_) | Leaf::Controlled(_) => {}
            }
        }
    }
}

/// The new ids of the objects of a part. An object that the part does not have is not in its map.
struct NewIds {
    steps: Ids<Step>,
    transitions: Ids<Transition>,
    inputs: Ids<Input>,
    wires: BTreeMap<Signal, InputId>,
    vars: Ids<Var>,
    timers: Ids<Timer>,
    edges: Ids<EdgeOperand>,
    actions: Ids<ControlledAction>,
    outputs: Ids<Output>,
}

/// Copies the objects of one part. A reference to an object that the part does not have cannot occur: the contents are closed under what expressions read.
struct Copier<'n> {
    net: &'n Net,
    owners: &'n Owners,
    part: PartIndex,
    wires: &'n BTreeMap<Signal, String>,
    is_chip: bool,
    /// True for a chip with a clock of its own: its inputs change at any time, and a flip-flop drives each wire and each output that depends on an input, so that they
    /// change only with its reactions.
    is_clocked: bool,
    /// The name of the output that shows that a transition of the part fires, if it has one.
    moves: Option<String>,
    /// If a reaction is several rounds: the name of the input that shows whether another one follows.
    more: Option<&'n str>,
    new: NewIds,
}

impl<'n> Copier<'n> {
    fn new(
        net: &'n Net,
        owners: &'n Owners,
        part: PartIndex,
        contents: &'n Contents,
        wires: &'n BTreeMap<Signal, String>,
    ) -> Self {
        let own = |owner: PartIndex| owner == part;
        let inputs = numbered(contents.inputs.iter().copied());
        let wired = contents.wires.iter().enumerate();
        let is_image = |id: TransitionId| contents.wires.contains(&Signal::Fires(id));
        let new = NewIds {
            steps: numbered(contents.steps.iter().copied()),
            transitions: numbered(
                net.transitions.ids().filter(|id| own(owners.transitions[*id]) || is_image(*id)),
            ),
            wires: wired.map(|(at, id)| (*id, Id::from_index(inputs.len() + at))).gather(),
            inputs,
            vars: numbered(net.vars.ids().filter(|id| own(owners.vars[*id]))),
            timers: numbered(contents.timers.iter().copied()),
            edges: numbered(contents.edges.iter().copied()),
            actions: numbered(net.actions.ids().filter(|id| own(owners.actions[*id]))),
            outputs: numbered(net.outputs.ids().filter(|id| own(owners.outputs[*id]))),
        };
        let (is_chip, is_clocked) = (false, false);
        Copier { net, owners, part, wires, is_chip, is_clocked, moves: None, more: None, new }
    }

    /// The part, with a step for the rest of each of the components that it has only some steps of.
    fn part(
        &self,
        name: &str,
        components: &[Component],
        used: &mut BTreeSet<String>,
    ) -> Result<PartNet, Vec<Diagnostic>> {
        let net = self.net;
        let mut part = Net {
            name: Name::new(format!("{}_{name}", net.name), net.name.span),
            settings: net.settings.clone(),
            parts: net.parts.values().map(|part| Part { is_cut: true, ..part.clone() }).collect(),
            ..Net::default()
        };
        for id in self.new.inputs.keys() {
            // The CPU latches all inputs and holds them during the round.
            part.inputs.push(Input { synchronous: !self.is_clocked, ..net.inputs[*id].clone() });
        }
        for signal in self.new.wires.keys() {
            let wire = wire_input(self.wire_name(*signal));
            part.inputs.push(Input { synchronous: !self.is_clocked, ..wire });
        }
        part.vars = self.new.vars.keys().map(|id| net.vars[*id].clone()).collect();
        part.sharing = (net.sharing.iter())
            .filter_map(|(var, sharing)| Some((*self.new.vars.get(var)?, *sharing)))
            .gather();
        part.steps = self.new.steps.keys().map(|id| self.step(*id)).collect();
        part.transitions = self.new.transitions.keys().map(|id| self.transition(*id)).collect();
        for id in self.new.timers.keys() {
            let mut timer = net.timers[*id].clone();
            timer.condition = self.expr(&timer.condition);
            part.timers.push(timer);
        }
        for id in self.new.edges.keys() {
            part.edges.push(EdgeOperand { expr: self.expr(&net.edges[*id].expr) });
        }
        for id in self.new.actions.keys() {
            let mut action = net.actions[*id].clone();
            for one in &mut action.uses {
                one.step = self.at(&self.new.steps, one.step);
                one.condition = one.condition.as_ref().map(|condition| self.expr(condition));
            }
            action.body = self.list(&action.body);
            part.actions.push(action);
        }
        let outputs = self.outputs(&mut part);
        part.forcings = self.forcings();
        if part.outputs.values().any(|output| !matches!(output.driver, Driver::Fires(_))) {
            part.emergency = net.emergency.clone().map(|mut emergency| {
                emergency.condition = self.expr(&emergency.condition);
                emergency
            });
        }
        let images = self.new.transitions.iter();
        let images = images.filter(|(old, _)| self.new.wires.contains_key(&Signal::Fires(**old)));
        let images = images.map(|(old, new)| (*new, &net.transitions[*old])).gather();
        let away = away::add(&mut part, components, (&self.new.steps, &images), used);
        let originals = self.new.steps.keys().map(|id| Original::Step(*id));
        let mut originals = originals.chain(away.into_iter().map(Original::Away));
        let assumptions = net.properties.iter();
        part.properties = assumptions.filter_map(|one| assumption(one, &self.new.inputs)).collect();
        let inputs = self.sources(&mut part, used);
        Ok(PartNet {
            name: name.to_owned(),
            steps: IdMap::build(&part.steps, |id, _| {
                originals.next().unwrap_or(Original::Step(id))
            }),
            transitions: olds(&part.transitions, &self.new.transitions),
            vars: olds(&part.vars, &self.new.vars),
            timers: olds(&part.timers, &self.new.timers),
            edges: olds(&part.edges, &self.new.edges),
            actions: olds(&part.actions, &self.new.actions),
            inputs: IdMap::build(&part.inputs, |id, _| inputs[id.index()]),
            outputs: IdMap::build(&part.outputs, |id, _| outputs[id.index()]),
            net: validate(part)?,
        })
    }

    /// The source of each input; adds the inputs that are neither inputs of the net nor wires.
    fn sources(&self, part: &mut Net, used: &BTreeSet<String>) -> Vec<Source> {
        let inputs = (self.new.inputs.keys().map(|id| Source::Input(*id)))
            .chain(self.new.wires.keys().map(|signal| Source::Wire(*signal)));
        let mut inputs: Vec<Source> = inputs.collect();
        if let Some(name) = self.more
            && has_ending(part)
        {
            let more = part.inputs.push(wire_input(Name::new(name, self.net.name.span)));
            let waits = Expr::leaf(Leaf::Input(more), self.net.name.span);
            part.ending = Some(Ending { waits, is_quiet: !self.is_chip });
            inputs.push(Source::More);
        }
        if self.is_chip {
            emergency::wire(part, &mut inputs, used);
        }
        inputs
    }

    /// Adds the outputs of the part, those of the net before those that are wires; returns what each shows.
    fn outputs(&self, part: &mut Net) -> Vec<Shown> {
        let net = self.net;
        for id in self.new.outputs.keys() {
            let mut output = net.outputs[*id].clone();
            output.driver = self.driver(&output.driver);
            // Between two clocks, a new input must not be shown together with the old situation.
            output.registered |= self.is_clocked
                && matches!(output.driver, Driver::Continuous(_))
                && output.driver.exprs().any(reads_inputs);
            part.outputs.push(output);
        }
        let mut outputs: Vec<Shown> =
            self.new.outputs.keys().map(|id| Shown::Output(*id)).collect();
        for signal in self.wires.keys().filter(|one| owner(self.owners, **one) == self.part) {
            let driver = match *signal {
                Signal::Fires(id) => Driver::Fires(vec![self.at(&self.new.transitions, id)]),
                Signal::Active(id) => {
                    let step = self.at(&self.new.steps, id);
                    let span = net.steps[id].name.span;
                    Driver::Continuous(vec![Emission { step, condition: None, span }])
                }
            };
            outputs.push(Shown::Wire(*signal));
            let registered = self.is_clocked && matches!(signal, Signal::Active(_));
            part.outputs
                .push(Output { registered, ..wire_output(self.wire_name(*signal), driver) });
        }
        if let Some(name) = &self.moves {
            outputs.push(Shown::Moves);
            let own = self.new.transitions.iter();
            let own = own.filter(|(old, _)| self.owners.transitions[**old] == self.part);
            let name = Name::new(name.clone(), net.name.span);
            let driver = Driver::Fires(own.map(|(_, new)| *new).collect());
            part.outputs.push(wire_output(name, driver));
        }
        outputs
    }

    /// The name of a wire, at the place of what it shows.
    fn wire_name(&self, signal: Signal) -> Name {
        let span = match signal {
            Signal::Fires(id) => self.net.transitions[id].name.span,
            Signal::Active(id) => self.net.steps[id].name.span,
        };
        Name::new(self.wires.get(&signal).cloned().unwrap_or_default(), span)
    }

    /// The forcing orders of steps of the part.
    fn forcings(&self) -> Vec<Forcing> {
        let own = |forcing: &Forcing| {
            let mut forcing =
                Forcing { step: *self.new.steps.get(&forcing.step)?, ..forcing.clone() };
            if let ForcingOrder::Situation(steps) = &mut forcing.order {
                steps.iter_mut().for_each(|step| *step = self.at(&self.new.steps, *step));
            }
            Some(forcing)
        };
        self.net.forcings.iter().filter_map(own).collect()
    }

    /// The new id of an object of this part.
    fn at<T>(&self, ids: &Ids<T>, id: Id<T>) -> Id<T> {
        // Validation of the part reports an id that does not exist.
        ids.get(&id).copied().unwrap_or(Id::from_index(usize::MAX))
    }

    fn step(&self, id: StepId) -> Step {
        let old = &self.net.steps[id];
        let parent = old.parent.and_then(|parent| self.new.steps.get(&parent)).copied();
        if self.owners.steps[id] != self.part {
            let mut copy = Step::new(old.name.clone(), old.part);
            copy.is_initial = old.is_initial;
            copy.kind = old.kind;
            copy.parent = parent;
            copy.activation_link = old.activation_link && parent.is_some();
            copy.hidden = old.hidden;
            copy.priority = old.priority;
            return copy;
        }
        let mut step = old.clone();
        step.parent = parent;
        step.activation_link &= parent.is_some();
        step.entry = self.list(&old.entry);
        step.exit = self.list(&old.exit);
        for task in &mut step.tasks {
            task.body = self.list(&task.body);
        }
        step.locks = old.locks.iter().map(|var| self.at(&self.new.vars, *var)).collect();
        step
    }

    fn transition(&self, id: TransitionId) -> Transition {
        let old = &self.net.transitions[id];
        let here = |steps: &[StepId]| -> Vec<StepId> {
            steps.iter().filter_map(|step| self.new.steps.get(step).copied()).collect()
        };
        let enters = old.enters.iter().filter_map(|enter| match enter {
            Enter::Step(step) => Some(Enter::Step(*self.new.steps.get(step)?)),
            // Only statecharts have these.
            Enter::InitialContent(_) | Enter::History(_) => None,
        });
        let mut new = old.clone();
        new.requires = here(&old.requires);
        new.clears = here(&old.clears);
        new.enters = enters.collect();
        if let Some(wire) = self.new.wires.get(&Signal::Fires(id)) {
            new.events.clear();
            new.actions.clear();
            new.guard = Expr::leaf(Leaf::Input(*wire), old.guard.span);
        } else {
            new.events = old.events.iter().map(|event| self.at(&self.new.inputs, *event)).collect();
            new.actions = self.list(&old.actions);
            new.guard = self.expr(&old.guard);
        }
        new
    }

    fn driver(&self, driver: &Driver) -> Driver {
        let emissions = |all: &[Emission]| -> Vec<Emission> {
            let one = |it: &Emission| Emission {
                step: self.at(&self.new.steps, it.step),
                condition: it.condition.as_ref().map(|condition| self.expr(condition)),
                span: it.span,
            };
            all.iter().map(one).collect()
        };
        match driver {
            Driver::Continuous(all) => Driver::Continuous(emissions(all)),
            Driver::Mealy(all) => Driver::Mealy(emissions(all)),
            Driver::Fires(all) => {
                Driver::Fires(all.iter().map(|id| self.at(&self.new.transitions, *id)).collect())
            }
            Driver::Stored(var) => Driver::Stored(self.at(&self.new.vars, *var)),
            Driver::Controlled(action) => Driver::Controlled(self.at(&self.new.actions, *action)),
            Driver::Extern { params, calls } => Driver::Extern {
                params: params.clone(),
                calls: calls
                    .iter()
                    .map(|call| ExternCall {
                        step: self.at(&self.new.steps, call.step),
                        condition: call.condition.as_ref().map(|condition| self.expr(condition)),
                        arguments: call.arguments.iter().map(|one| self.expr(one)).collect(),
                        span: call.span,
                    })
                    .collect(),
            },
        }
    }

    fn list(&self, list: &Block) -> Block {
        list.iter()
            .map(|stmt| {
                let kind = match &stmt.kind {
                    StmtKind::Assign { var, index, value } => StmtKind::Assign {
                        var: self.at(&self.new.vars, *var),
                        index: index.as_ref().map(|index| self.expr(index)),
                        value: self.expr(value),
                    },
                    StmtKind::Raise(event) => StmtKind::Raise(self.at(&self.new.inputs, *event)),
                    StmtKind::Call { output, arguments } => StmtKind::Call {
                        output: self.at(&self.new.outputs, *output),
                        arguments: arguments.iter().map(|one| self.expr(one)).collect(),
                    },
                    StmtKind::If { condition, then, otherwise } => StmtKind::If {
                        condition: self.expr(condition),
                        then: self.list(then),
                        otherwise: self.list(otherwise),
                    },
                    // Only statecharts send.
                    StmtKind::Send(_) | StmtKind::Cancel(_) | StmtKind::Code(_) => {
                        stmt.kind.clone()
                    }
                };
                Stmt { kind, span: stmt.span }
            })
            .collect()
    }

    fn expr(&self, expr: &Expr) -> Expr {
        let new = &self.new;
        expr.map_leaves(&|leaf| match *leaf {
            Leaf::Input(id) => Leaf::Input(self.at(&new.inputs, id)),
            Leaf::Var(id) => Leaf::Var(self.at(&new.vars, id)),
            Leaf::Active(id) => match new.wires.get(&Signal::Active(id)) {
                Some(wire) => Leaf::Input(*wire),
                None => Leaf::Active(self.at(&new.steps, id)),
            },
            Leaf::Elapsed(id) => Leaf::Elapsed(self.at(&new.steps, id)),
            Leaf::LastElapsed(id) => Leaf::LastElapsed(self.at(&new.steps, id)),
            Leaf::TasksDone(id) => Leaf::TasksDone(self.at(&new.steps, id)),
            Leaf::Timer(id) => Leaf::Timer(self.at(&new.timers, id)),
            Leaf::Rise(id) => Leaf::Rise(self.at(&new.edges, id)),
            Leaf::Fall(id) => Leaf::Fall(self.at(&new.edges, id)),
            Leaf::Fireable(id) => Leaf::Fireable(self.at(&new.transitions, id)),
            Leaf::Controlled(id) => Leaf::Controlled(self.at(&new.actions, id)),
        })
    }
}

/// True if an expression reads an input or a wire, also through an edge.
fn reads_inputs(expr: &Expr) -> bool {
    expr.leaves().any(|leaf| matches!(leaf, Leaf::Input(_) | Leaf::Rise(_) | Leaf::Fall(_)))
}

/// An output for other parts.
fn wire_output(name: Name, driver: Driver) -> Output {
    let meta = Meta::default();
    Output { name, ty: Type::Bool, driver, safe: None, registered: false, meta }
}

/// The old id of each new object.
fn olds<T>(arena: &Arena<T>, ids: &Ids<T>) -> IdMap<T, Id<T>> {
    let old: Vec<Id<T>> = ids.keys().copied().collect();
    IdMap::build(arena, |id, _| old.get(id.index()).copied().unwrap_or(id))
}
