//! Random nets: every construct of nets, in shapes that are mostly sensible and sometimes odd.
//!
//! The same seed and features give the same net. A net that shows a difference between two engines is shrunk by [`shrink()`], which removes
//! everything that the difference does not need.
//!
//! ```text
//! for seed in 0..2000 {
//!     let net = random_net(seed, &Features::everything());
//!     let stimulus = Stimulus::random(&net, 200, seed, 3);
//!     ...
//! }
//! ```

mod features;
mod shape;
mod shrink;
mod states;
mod words;

use grafsynth_ir::expr::Type;
use grafsynth_ir::net::{
    ActionId, ActionUse, ControlledAction, Driver, Emergency, Emission, Ending, Evolution, Expr,
    ExternCall, Input, InputId, InputKind, Leaf, Meta, Net, OpenCell, Output, OutputId, Param,
    Part, PartId, Policy, Property, PropertyLeaf, PropertyRole, Qualifier, SHARINGS, Schedule,
    SendSlot, Sharing, Step, StepId, StepKind, Task, Timer, TransitionId, Unspecified, Var, VarId,
    VarOrigin,
};
use grafsynth_ir::sharing::{Accesses, separate};
use grafsynth_ir::{Name, Span, Valid, validate};
use grafsynth_sim::Random;

pub use features::Features;
pub use shrink::{shrink, weakened};

/// The number of attempts to make a valid net before a net of one step is returned.
const ATTEMPTS: u64 = 20;

/// A valid net, the same for the same seed and features.
#[must_use]
pub fn random_net(seed: u64, features: &Features) -> Valid<Net> {
    for attempt in 0..ATTEMPTS {
        let random = Random::new(seed.wrapping_mul(ATTEMPTS).wrapping_add(attempt));
        if let Ok(net) = validate(Builder::new(random, features).build(seed)) {
            return net;
        }
    }
    // One initial step is always valid; if even that is rejected, validation itself is broken and this loop never ends.
    loop {
        if let Ok(net) = validate(tiny()) {
            return net;
        }
    }
}

/// The first attempt for a seed, valid or not: for a test that reports how often it is valid.
#[must_use]
pub fn first_attempt(seed: u64, features: &Features) -> Net {
    Builder::new(Random::new(seed.wrapping_mul(ATTEMPTS)), features).build(seed)
}

fn tiny() -> Net {
    let mut net = Net { name: name("tiny"), ..Net::default() };
    let part = net.parts.push(Part { name: name("tiny"), level: 1, ..Part::default() });
    net.steps.push(step("s1", part, true));
    net
}

/// A name without a location.
#[must_use]
pub fn name(text: impl Into<String>) -> Name {
    Name::new(text, Span::default())
}

/// A plain step with nothing in it.
#[must_use]
pub fn step(text: impl Into<String>, part: PartId, is_initial: bool) -> Step {
    Step { is_initial, ..Step::new(name(text), part) }
}

struct Builder<'f> {
    random: Random,
    on: &'f Features,
    net: Net,
    /// Extern actions that lists may call.
    callable: Vec<OutputId>,
    n_tasks: usize,
}

impl<'f> Builder<'f> {
    fn new(random: Random, on: &'f Features) -> Self {
        Builder { random, on, net: Net::default(), callable: Vec::new(), n_tasks: 0 }
    }

    /// True once in `rarity` times, if the feature is on.
    fn wants(&mut self, is_on: bool, rarity: usize) -> bool {
        is_on && self.random.one_in(rarity)
    }

    fn build(mut self, seed: u64) -> Net {
        self.net.name = name(format!("random{seed}"));
        self.settings();
        self.inputs();
        self.variables();
        if self.net.settings.policy.is_statechart() {
            self.states();
        } else {
            self.steps();
        }
        self.timers();
        self.externs();
        self.actions();
        if self.net.settings.policy.is_statechart() {
            self.statechart_transitions();
        } else {
            self.transitions();
            self.forcing();
        }
        self.lists();
        self.outputs();
        self.rest();
        if self.on.firings {
            self.firings(seed);
            self.ending(seed);
        }
        if self.on.sharing {
            self.sharing(seed);
        }
        self.net
    }

    /// Adds outputs that show that a transition fires, in half of the nets that can have them.
    fn firings(&mut self, seed: u64) {
        let mut random = Random::new(seed ^ 0xf1_4e5);
        let transitions: Vec<TransitionId> = self.net.transitions.ids().collect();
        if self.net.settings.evolution != Evolution::Single || random.one_in(2) {
            return;
        }
        for index in 1..=1 + random.below(2) {
            if let Some(transition) = random.pick(&transitions) {
                self.output(format!("fires{index}"), Type::Bool, Driver::Fires(vec![*transition]));
            }
        }
    }

    /// Lets END wait for a later round, as in a part of a split, in a third of the nets that can have it.
    fn ending(&mut self, seed: u64) {
        let mut random = Random::new(seed ^ 0xe_4d);
        if self.net.settings.evolution != Evolution::Single || !random.one_in(3) {
            return;
        }
        let more = self.net.inputs.push(Input {
            name: name("more"),
            ty: Type::Bool,
            kind: InputKind::Pin,
            synchronous: false,
            meta: Meta::default(),
        });
        let waits = Expr::leaf(Leaf::Input(more), Span::default());
        self.net.ending = Some(Ending { waits, is_quiet: random.one_in(2) });
    }

    /// Makes variables that tasks of halting steps use buffered or protected, in half of the nets that have such variables. It uses its own random
    /// numbers, so that other nets do not change.
    fn sharing(&mut self, seed: u64) {
        let mut random = Random::new(seed ^ 0x5ca1_ab1e);
        if random.one_in(2) {
            return;
        }
        let halting: Vec<StepId> =
            self.net.steps.iter().filter(|(_, step)| step.halts()).map(|(id, _)| id).collect();
        for step in halting {
            let tasks = 0..self.net.steps[step].tasks.len();
            let accesses = Accesses::of_tasks(&self.net, step, tasks);
            for var in accesses.reads.union(&accesses.writes) {
                let sharing = SHARINGS[random.below(SHARINGS.len())].1;
                if sharing != Sharing::Refuse {
                    self.net.sharing.insert(*var, sharing);
                }
            }
        }
        separate(&mut self.net);
    }

    fn settings(&mut self) {
        let policy = self.random.pick(&self.on.policies).copied().unwrap_or(Policy::All);
        let is_stable =
            policy.is_statechart() || !self.on.single || (self.on.stable && self.random.one_in(2));
        let limit = [1, 2, 3, 5, 8, 20][self.random.below(6)];
        let schedules =
            [Schedule::Declared, Schedule::Declared, Schedule::Level, Schedule::Priority];
        let settings = &mut self.net.settings;
        settings.policy = policy;
        settings.evolution =
            if is_stable { Evolution::Stable { limit } } else { Evolution::Single };
        settings.schedule = schedules[self.random.below(schedules.len())];
        let is_grafcet = !policy.is_statechart();
        self.net.settings.fire_one = is_grafcet && self.wants(self.on.fire_one, 8);
        self.net.settings.assign_simultaneous = self.wants(self.on.simultaneous, 4);
        self.net.settings.final_scan = self.wants(self.on.controlled_actions, 3);
        self.net.settings.events_exclusive = self.wants(self.on.events, 5);
        if !is_grafcet {
            self.net.settings.queue = Some([1, 2, 4, 8][self.random.below(4)]);
        }
    }

    fn int_type(&mut self) -> Type {
        if self.wants(self.on.wide_integers, 2) {
            return self.edge_type();
        }
        let (lo, hi) =
            [(0, 3), (0, 9), (-5, 5), (-128, 127), (0, 255), (-40, 32800), (0, 70_000), (-2, 1)]
                [self.random.below(8)];
        Type::Int { lo, hi }
    }

    /// A range that ends at a limit of a C type, or one beyond; some ranges exclude 0, so that they can be used for divisors.
    fn edge_type(&mut self) -> Type {
        let (lo, hi) = [
            (-128, 128),
            (-129, 127),
            (0, 256),
            (1, 255),
            (-32_768, 32_767),
            (-32_769, 32_767),
            (0, 65_535),
            (0, 65_536),
            (1, 32_768),
            (-9, -1),
            (i64::from(i32::MIN), i64::from(i32::MAX)),
            (0, i64::from(i32::MAX)),
            (i64::from(i32::MIN), -1),
            (1, i64::from(i32::MAX)),
        ][self.random.below(14)];
        Type::Int { lo, hi }
    }

    /// A time in ticks: small, or near the maximum of one or two bytes.
    fn ticks(&mut self, below: usize) -> i64 {
        if self.wants(self.on.long_times, 3) {
            [254, 255, 256, 257, 1000, 65_534, 65_535, 65_536][self.random.below(8)]
        } else {
            self.random.below(below) as i64
        }
    }

    fn inputs(&mut self) {
        let add = |net: &mut Net, text: String, ty: Type, kind: InputKind| {
            net.inputs.push(Input {
                name: name(text),
                ty,
                kind,
                synchronous: false,
                meta: Meta::default(),
            });
        };
        let many = self.wants(self.on.many_inputs, 3);
        let n_pins = if many { 12 + self.random.below(9) } else { 1 + self.random.below(4) };
        for index in 1..=n_pins {
            add(&mut self.net, format!("i{index}"), Type::Bool, InputKind::Pin);
        }
        if self.wants(self.on.integers, 2) {
            let ty = self.int_type();
            add(&mut self.net, "n".to_owned(), ty, InputKind::Pin);
        }
        if self.wants(self.on.externs, 4) {
            add(&mut self.net, "seen".to_owned(), Type::Bool, InputKind::Extern);
        }
        let is_statechart = self.net.settings.policy.is_statechart();
        if self.on.events && (is_statechart || self.random.one_in(2)) {
            for index in 1..=1 + self.random.below(3) {
                add(&mut self.net, format!("e{index}"), Type::Bool, InputKind::Event);
            }
        }
        if self.on.raise && (is_statechart || self.random.one_in(3)) {
            for index in 1..=1 + self.random.below(2) {
                add(&mut self.net, format!("r{index}"), Type::Bool, InputKind::InternalEvent);
            }
        }
    }

    fn variables(&mut self) {
        let mut n_vars = 0;
        if self.on.integers {
            n_vars = self.random.below(3);
        }
        for index in 1..=n_vars {
            let ty = if self.random.one_in(4) { Type::Bool } else { self.int_type() };
            self.variable(format!("v{index}"), ty, None, VarOrigin::Declared);
        }
        if self.on.entries && self.net.settings.policy.is_statechart() {
            // A variable that lists can modify.
            self.variable(
                "mark".to_owned(),
                Type::Int { lo: 0, hi: 99 },
                None,
                VarOrigin::Declared,
            );
        }
        if self.wants(self.on.arrays, 4) {
            let ty = self.int_type();
            let len = 2 + self.random.below(3) as u32;
            self.variable("a".to_owned(), ty, Some(len), VarOrigin::Declared);
        }
        if self.wants(self.on.stored_outputs, 2) {
            for index in 1..=1 + self.random.below(2) {
                let is_bool = !self.on.integers || self.random.one_in(2);
                let ty = if is_bool { Type::Bool } else { self.int_type() };
                let var = self.variable(format!("q{index}"), ty, None, VarOrigin::StoredOutput);
                self.output(format!("q{index}"), ty, Driver::Stored(var));
            }
        }
    }

    fn variable(&mut self, text: String, ty: Type, len: Option<u32>, origin: VarOrigin) -> VarId {
        let (lo, hi) = ty.bounds();
        let init =
            (0..len.unwrap_or(1))
                .map(|_| {
                    if self.random.one_in(3) { self.random.between(lo, hi) } else { ty.saturate(0) }
                })
                .collect();
        self.net.vars.push(Var { name: name(text), ty, len, init, origin, meta: Meta::default() })
    }

    fn output(&mut self, text: String, ty: Type, driver: Driver) -> OutputId {
        let registered = self.random.one_in(6);
        self.net.outputs.push(Output {
            safe: None,
            name: name(text),
            ty,
            driver,
            registered,
            meta: Meta::default(),
        })
    }

    fn timers(&mut self) {
        if self.wants(self.on.timers, 4) {
            for index in 1..=1 + self.random.below(2) {
                let condition = self.quiet_condition(2);
                let starts_expired = self.random.one_in(4);
                self.net.timers.push(Timer {
                    name: name(format!("T{index}")),
                    condition,
                    starts_expired,
                    meta: Meta::default(),
                });
            }
        }
    }

    fn externs(&mut self) {
        if !self.on.externs {
            return;
        }
        if self.random.one_in(3) {
            let params = Vec::new();
            let output = self.output(
                "beep".to_owned(),
                Type::Bool,
                Driver::Extern { params, calls: Vec::new() },
            );
            self.callable.push(output);
        }
        if self.random.one_in(3) {
            let params = (0..1 + self.random.below(2)).map(|_| self.param()).collect();
            let output = self.output(
                "tell".to_owned(),
                Type::Bool,
                Driver::Extern { params, calls: Vec::new() },
            );
            self.callable.push(output);
        }
    }

    fn param(&mut self) -> Param {
        let ty = if self.random.one_in(3) { Type::Bool } else { Type::Int { lo: -3, hi: 100 } };
        Param { name: String::new(), ty }
    }

    fn any_step(&mut self) -> StepId {
        StepId::from_index(self.random.below(self.net.steps.len().max(1)))
    }

    /// Declares controlled actions, before transitions and lists, which read them; their bodies are generated with the lists.
    fn actions(&mut self) {
        if self.on.step_actions {
            self.step_actions();
        }
        if !self.wants(self.on.controlled_actions, 2) {
            return;
        }
        for index in 1..=1 + self.random.below(2) {
            let qualifiers = Qualifier::ALL;
            let mut uses = Vec::new();
            for _ in 0..1 + self.random.below(4) {
                let step = self.any_step();
                let qualifier = qualifiers[self.random.below(qualifiers.len())];
                let condition =
                    if self.random.one_in(4) { Some(self.quiet_condition(2)) } else { None };
                uses.push(ActionUse { step, qualifier, condition, span: Span::default() });
            }
            let is_timed = |one: &ActionUse| one.qualifier.is_timed();
            let duration = if uses.iter().any(is_timed) { self.ticks(4) as u32 } else { 0 };
            let action = ControlledAction {
                name: name(format!("c{index}")),
                uses,
                duration,
                body: Vec::new(),
                meta: Meta::default(),
            };
            let action = self.net.actions.push(action);
            if !self.random.one_in(3) {
                self.output(format!("c{index}"), Type::Bool, Driver::Controlled(action));
            }
        }
    }

    /// Actions with `N` alone: bodies of single steps, sometimes shared, and outputs of several steps.
    fn step_actions(&mut self) {
        let level = |step: StepId, condition: Option<Expr>| ActionUse {
            step,
            qualifier: Qualifier::N,
            condition,
            span: Span::default(),
        };
        for step in self.net.steps.ids() {
            for at in 0..self.random.below(3) {
                let mut uses = vec![level(step, None)];
                if self.random.one_in(4) {
                    uses.push(level(self.any_step(), None));
                }
                let name = name(format!("b{}_{at}", step.index()));
                let (body, meta) = (Vec::new(), Meta::default());
                self.net.actions.push(ControlledAction { name, uses, duration: 0, body, meta });
            }
        }
        for index in 0..self.random.below(4) {
            let mut uses = Vec::new();
            for _ in 0..1 + self.random.below(4) {
                let condition =
                    if self.random.one_in(4) { Some(self.quiet_condition(2)) } else { None };
                uses.push(level(self.any_step(), condition));
            }
            let name = name(format!("light{index}"));
            let text = name.text.clone();
            let (body, meta) = (Vec::new(), Meta::default());
            let action =
                self.net.actions.push(ControlledAction { name, uses, duration: 0, body, meta });
            self.output(text, Type::Bool, Driver::Controlled(action));
        }
    }

    /// Generates entry lists, exit lists, tasks, and bodies of actions.
    fn lists(&mut self) {
        for step in self.net.steps.ids() {
            if self.random.one_in(3) {
                self.net.steps[step].entry = self.list(2);
            }
            if self.random.one_in(4) {
                self.net.steps[step].exit = self.list(2);
            }
            if self.on.entries && self.net.settings.policy.is_statechart() {
                let is_nest =
                    matches!(self.net.steps[step].kind, StepKind::Composite | StepKind::Parallel);
                if self.random.one_in(if is_nest { 1 } else { 3 }) {
                    self.net.steps[step].entry = self.list_about(step);
                }
                if self.random.one_in(4) {
                    self.net.steps[step].exit = self.list_about(step);
                }
                if !self.net.steps[step].initial_content.is_empty() && self.random.one_in(2) {
                    self.net.steps[step].initial_content = self.list_about(step);
                }
            }
            if self.wants(self.on.tasks, 5) && self.net.steps[step].kind == StepKind::Leaf {
                self.tasks(step);
            }
        }
        for action in self.net.actions.ids() {
            let drives = |output: &Output| output.driver == Driver::Controlled(action);
            let has_output = self.net.outputs.values().any(drives);
            if !has_output || self.random.one_in(3) {
                self.net.actions[action].body = self.body(ActionBody::Action);
            }
        }
    }

    fn tasks(&mut self, step: StepId) {
        let budget = 1 + self.random.below(5) as u32;
        self.net.steps[step].budget = budget;
        for _ in 0..1 + self.random.below(3) {
            self.n_tasks += 1;
            let cost = self.random.below(budget as usize + 1) as u32;
            let body = self.body(ActionBody::Task);
            let task = Task {
                name: name(format!("k{}", self.n_tasks)),
                cost,
                body,
                meta: Meta::default(),
            };
            self.net.steps[step].tasks.push(task);
        }
    }

    fn outputs(&mut self) {
        for index in 1..=1 + self.random.below(4) {
            let emissions: Vec<Emission> = (0..1 + self.random.below(3))
                .map(|_| {
                    let step = self.any_step();
                    let condition =
                        if self.random.one_in(3) { Some(self.quiet_condition(2)) } else { None };
                    Emission { step, condition, span: Span::default() }
                })
                .collect();
            let is_mealy =
                self.net.settings.evolution == Evolution::Single && self.wants(self.on.mealy, 4);
            let driver =
                if is_mealy { Driver::Mealy(emissions) } else { Driver::Continuous(emissions) };
            self.output(format!("o{index}"), Type::Bool, driver);
        }
        if self.wants(self.on.externs, 4) {
            let params: Vec<Param> = (0..self.random.below(3)).map(|_| self.param()).collect();
            let calls = (0..1 + self.random.below(3))
                .map(|_| {
                    let step = self.any_step();
                    let condition =
                        if self.random.one_in(3) { Some(self.quiet_condition(2)) } else { None };
                    let arguments = params.iter().map(|param| self.quiet_value(param.ty)).collect();
                    ExternCall { step, condition, arguments, span: Span::default() }
                })
                .collect();
            self.output("work".to_owned(), Type::Bool, Driver::Extern { params, calls });
        }
    }

    fn rest(&mut self) {
        if self.wants(self.on.assumptions, 6) {
            let pins: Vec<InputId> = (self.net.inputs.iter())
                .filter(|(_, input)| input.kind == InputKind::Pin && input.ty.is_bool())
                .map(|(id, _)| id)
                .collect();
            if let [first, .., last] = pins.as_slice() {
                let read = |input: InputId| {
                    grafsynth_ir::expr::Expr::leaf(
                        PropertyLeaf::Net(Leaf::Input(input)),
                        Span::default(),
                    )
                };
                let never = grafsynth_ir::expr::Expr::and([read(*first), read(*last)]);
                let role = PropertyRole::Assume;
                self.net.properties.push(Property {
                    name: String::new(),
                    role,
                    never,
                    meta: Meta::default(),
                });
            }
        }
        if self.wants(self.on.unspecified, 3) && self.net.settings.evolution == Evolution::Single {
            let bits = [self.active_leaf(), self.input_leaf()];
            let when = Expr::and(bits);
            let what = match self.random.below(3) {
                0 => OpenCell::Next,
                _ => OpenCell::Output(OutputId::from_index(
                    self.random.below(self.net.outputs.len()),
                )),
            };
            self.net.unspecified.push(Unspecified { when, what });
        }
        self.emergency();
    }

    fn emergency(&mut self) {
        if !self.on.emergency || !self.net.unspecified.is_empty() {
            return;
        }
        let apart = Random::new(self.random.clone().bits() ^ 0x5AFE);
        let own = std::mem::replace(&mut self.random, apart);
        if self.random.one_in(3) {
            let ids: Vec<OutputId> = self.net.outputs.ids().collect();
            for id in ids {
                let output = &mut self.net.outputs[id];
                output.registered = false;
                let (lo, hi) = output.ty.bounds();
                if !output.is_extern() && self.random.one_in(2) {
                    output.safe = Some(self.random.between(lo, hi));
                }
            }
            // Safe values are also used by a stop, so some nets have them without an emergency.
            if !self.random.one_in(4) {
                let mut condition = self.quiet_condition(2);
                if self.asks_extern(&condition) {
                    condition = self.active_leaf();
                }
                self.net.emergency = Some(Emergency { condition, meta: Meta::default() });
            }
        }
        self.random = own;
    }

    fn asks_extern(&self, condition: &Expr) -> bool {
        let mut asks = false;
        for leaf in condition.leaves() {
            if let Leaf::Input(input) = leaf {
                asks |= self.net.inputs[*input].kind == InputKind::Extern;
            }
        }
        asks
    }

    fn slot(&mut self, event: InputId) -> grafsynth_ir::net::SendId {
        let text = format!("send{}", self.net.sends.len() + 1);
        let delay = self.ticks(4) as u32;
        self.net.sends.push(SendSlot { name: name(text), event, delay, meta: Meta::default() })
    }
}

/// The kind of a list that runs at the end of a reaction: it reads neither edges nor events.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ActionBody {
    Action,
    Task,
}

/// The actions that expressions may read.
fn action_ids(net: &Net) -> Vec<ActionId> {
    net.actions.ids().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use grafsynth_sim::{Simulator, Stimulus};

    #[test]
    fn nearly_every_first_attempt_is_valid() {
        let everything = Features::everything();
        let broken: Vec<(u64, String)> = (0..3000)
            .filter_map(|seed| {
                let findings = validate(first_attempt(seed, &everything)).err()?;
                Some((
                    seed,
                    findings.first().map_or(String::new(), |finding| finding.message.clone()),
                ))
            })
            .collect();
        assert!(
            broken.len() <= 30,
            "{} of 3000, such as {:?}",
            broken.len(),
            broken.iter().take(20).collect::<Vec<_>>()
        );
    }

    #[test]
    fn the_same_seed_gives_the_same_net_and_others_differ() {
        let everything = Features::everything();
        assert_eq!(random_net(7, &everything), random_net(7, &everything));
        assert_ne!(random_net(7, &everything), random_net(8, &everything));
    }

    #[test]
    fn most_nets_move() {
        let everything = Features::everything();
        let moving = (0..300)
            .filter(|seed| {
                let net = random_net(*seed, &everything);
                let stimulus = Stimulus::random(&net, 100, *seed, 3);
                let mut simulator = Simulator::new(&net);
                stimulus.rows().any(|row| {
                    simulator.step(&row);
                    !simulator.fired().is_empty()
                })
            })
            .count();
        assert!(moving > 255, "{moving} of 300");
    }

    #[test]
    fn every_feature_occurs() {
        let everything = Features::everything();
        let nets: Vec<Valid<Net>> = (0..600).map(|seed| random_net(seed, &everything)).collect();
        let count = |has: &dyn Fn(&Net) -> bool| nets.iter().filter(|net| has(net)).count();
        type Has<'h> = &'h dyn Fn(&Net) -> bool;
        let expected: [(&str, Has<'_>); 17] = [
            ("edges", &|net| !net.edges.is_empty()),
            ("timers", &|net| !net.timers.is_empty()),
            ("arrays", &|net| net.vars.values().any(|var| var.len.is_some())),
            ("actions", &|net| !net.actions.is_empty()),
            ("tasks", &|net| net.steps.values().any(|step| !step.tasks.is_empty())),
            ("locks", &|net| net.steps.values().any(|step| !step.locks.is_empty())),
            ("copies", &|net| net.sharing.values().any(|said| *said == Sharing::Buffer)),
            ("forcing", &|net| !net.forcings.is_empty()),
            ("enclosing", &|net| net.steps.values().any(|step| step.kind == StepKind::Enclosing)),
            ("history", &|net| !net.histories.is_empty()),
            ("sends", &|net| !net.sends.is_empty()),
            ("finals", &|net| net.steps.values().any(|step| step.kind == StepKind::Final)),
            ("parallel", &|net| net.steps.values().any(|step| step.kind == StepKind::Parallel)),
            ("mealy", &|net| {
                net.outputs.values().any(|output| matches!(output.driver, Driver::Mealy(_)))
            }),
            ("restart", &|net| net.transitions.values().any(|transition| transition.restart)),
            ("several parts", &|net| net.parts.len() > 1),
            ("emergency", &|net| net.emergency.is_some()),
        ];
        for (what, has) in expected {
            assert!(count(has) >= 10, "{what}: {}", count(has));
        }
    }

    #[test]
    fn programs_have_what_enters_and_what_waits() {
        let nets: Vec<Valid<Net>> =
            (0..600).map(|seed| random_net(seed, &Features::program())).collect();
        let firings = nets.iter().filter(|net| {
            net.outputs.values().any(|output| matches!(output.driver, Driver::Fires(_)))
        });
        assert!(firings.count() >= 50);
        let many = nets.iter().filter(|net| (12..=26).contains(&net.inputs.len())).count();
        assert!(many >= 100, "{many}");
        let with_content = |net: &Valid<Net>| {
            net.histories.iter().any(|(id, history)| {
                let leads = |transition: &grafsynth_ir::net::Transition| {
                    transition.enters.contains(&grafsynth_ir::net::Enter::History(id))
                };
                !history.default_content.is_empty() && net.transitions.values().any(leads)
            })
        };
        let histories = nets.iter().filter(|net| with_content(net)).count();
        assert!(histories >= 50, "{histories}");
        let sends = nets.iter().filter(|net| net.sends.values().any(|send| send.delay > 0)).count();
        assert!(sends >= 50, "{sends}");
    }

    #[test]
    fn shrinking_keeps_what_is_asked_for_and_little_else() {
        let everything = Features::everything();
        let net = (0..1000)
            .map(|seed| random_net(seed, &everything))
            .find(|net| net.transitions.len() > 8 && net.actions.len() == 2)
            .unwrap();
        let small = shrink(&net, |net| !net.actions.is_empty());
        assert!(!small.actions.is_empty());
        assert!(small.steps.len() <= 2 && small.transitions.is_empty(), "{small:#?}");
        assert!(validate(small.clone().into_inner()).is_ok());
    }
}
