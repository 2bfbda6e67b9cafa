//! Which inputs can be relevant in a situation.
//!
//! An exploration need not vary an input that is not read. The sets are computed from the text of the net and may be too large, but never too small:
//! they include every expression that a reaction from the situation can evaluate.

use grafsynth_ir::arena::IdMap;
use grafsynth_ir::expr::Expr as GenericExpr;
use std::collections::BTreeSet;

use grafsynth_ir::net::{
    Block, Driver, EdgeId, Enter, Evolution, Expr, HistoryId, InputId, Leaf, Net, PropertyLeaf,
    PropertyRole, Qualifier, Step, StepId, StepKind, Transition, TransitionId,
};
use grafsynth_ir::walk::expressions;
use grafsynth_sim::Situation;

/// A set of inputs, and of edge operands of which an edge is read.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Default)]
pub(crate) struct Inputs(Vec<u64>);

impl Inputs {
    pub(crate) fn none(net: &Net) -> Self {
        Inputs(vec![0; (net.inputs.len() + net.edges.len()).div_ceil(64)])
    }

    pub(crate) fn insert(&mut self, input: InputId) {
        self.put(input.index());
    }

    pub(crate) fn contains(&self, input: InputId) -> bool {
        self.has(input.index())
    }

    /// True if an edge of this operand is read.
    pub(crate) fn has_edge(&self, net: &Net, edge: EdgeId) -> bool {
        self.has(net.inputs.len() + edge.index())
    }

    fn put(&mut self, at: usize) {
        self.0[at / 64] |= 1 << (at % 64);
    }

    fn has(&self, at: usize) -> bool {
        self.0[at / 64] >> (at % 64) & 1 == 1
    }

    pub(crate) fn add(&mut self, other: &Inputs) {
        self.0.iter_mut().zip(&other.0).for_each(|(mine, theirs)| *mine |= theirs);
    }

    pub(crate) fn meets(&self, other: &Inputs) -> bool {
        self.0.iter().zip(&other.0).any(|(mine, theirs)| mine & theirs != 0)
    }
}

/// The inputs that are read, and the times that are compared, by step and transition.
#[derive(Debug, Clone)]
pub(crate) struct Relevance<'n> {
    net: &'n Net,
    /// Inputs that are read in every reaction.
    always: Inputs,
    /// For each step, the inputs that are read if the step is active at the end of a micro-step or of the reaction: by lists, outputs, actions,
    /// tasks.
    by_step: IdMap<Step, Inputs>,
    by_transition: IdMap<Transition, Inputs>,
    leaving: IdMap<Step, Vec<TransitionId>>,
    sources: Vec<TransitionId>,
    /// The steps that an enclosing step activates.
    links: IdMap<Step, Vec<StepId>>,
    /// For each step, the largest constant that its `s.t` is compared with.
    elapsed: IdMap<Step, i64>,
    /// The largest constant that any other tick count is compared with.
    other_time: i64,
    is_stable: bool,
}

impl<'n> Relevance<'n> {
    pub(crate) fn of(net: &'n Net) -> Self {
        let mut relevance = Relevance {
            net,
            always: Inputs::none(net),
            by_step: IdMap::filled(&net.steps, Inputs::none(net)),
            by_transition: IdMap::filled(&net.transitions, Inputs::none(net)),
            leaving: IdMap::filled(&net.steps, Vec::new()),
            sources: Vec::new(),
            links: IdMap::filled(&net.steps, Vec::new()),
            elapsed: IdMap::filled(&net.steps, -1),
            other_time: -1,
            is_stable: net.settings.evolution != Evolution::Single,
        };
        relevance.read();
        relevance
    }

    fn read(&mut self) {
        let net = self.net;
        let mut always = Inputs::none(net);
        for edge in net.edges.values() {
            self.expr(&edge.expr, &mut always);
        }
        for timer in net.timers.values() {
            self.expr(&timer.condition, &mut always);
        }
        for open in &net.unspecified {
            self.expr(&open.when, &mut always);
        }
        for emergency in net.emergency.iter() {
            self.expr(&emergency.condition, &mut always);
        }
        for ending in net.ending.iter() {
            self.expr(&ending.waits, &mut always);
        }
        for property in
            net.properties.iter().filter(|property| property.role == PropertyRole::Assert)
        {
            self.property(&property.never, &mut always);
        }
        for action in net.actions.values() {
            self.block(&action.body, &mut always);
            for one in &action.uses {
                let mut set = Inputs::none(net);
                one.condition.iter().for_each(|condition| self.expr(condition, &mut set));
                self.by_step[one.step].add(&set);
                if !matches!(
                    one.qualifier,
                    Qualifier::N
                        | Qualifier::R
                        | Qualifier::S
                        | Qualifier::P
                        | Qualifier::P0
                        | Qualifier::P1
                ) {
                    self.other_time = self.other_time.max(i64::from(action.duration));
                }
            }
        }
        for send in net.sends.values() {
            self.other_time = self.other_time.max(i64::from(send.delay));
        }
        for (id, step) in net.steps.iter() {
            if let Some(parent) = step.parent.filter(|parent| {
                step.activation_link && net.steps[*parent].kind == StepKind::Enclosing
            }) {
                self.links[parent].push(id);
            }
            let mut set = Inputs::none(net);
            [&step.entry, &step.exit, &step.initial_content]
                .into_iter()
                .for_each(|block| self.block(block, &mut set));
            step.tasks.iter().for_each(|task| self.block(&task.body, &mut set));
            self.by_step[id].add(&set);
        }
        for history in net.histories.values() {
            self.block(&history.default_content, &mut always);
        }
        for output in net.outputs.values() {
            match &output.driver {
                Driver::Continuous(emissions) | Driver::Mealy(emissions) => {
                    for emission in emissions {
                        let mut set = Inputs::none(net);
                        emission
                            .condition
                            .iter()
                            .for_each(|condition| self.expr(condition, &mut set));
                        self.by_step[emission.step].add(&set);
                    }
                }
                Driver::Extern { calls, .. } => {
                    for call in calls {
                        let mut set = Inputs::none(net);
                        call.condition
                            .iter()
                            .chain(&call.arguments)
                            .for_each(|one| self.expr(one, &mut set));
                        self.by_step[call.step].add(&set);
                    }
                }
                Driver::Fires(_) | Driver::Stored(_) | Driver::Controlled(_) => {}
            }
        }
        for (id, transition) in net.transitions.iter() {
            let mut set = Inputs::none(net);
            self.expr(&transition.guard, &mut set);
            transition.events.iter().for_each(|event| set.insert(*event));
            self.block(&transition.actions, &mut set);
            self.by_transition[id] = set;
            match transition.requires.first() {
                Some(step) => self.leaving[*step].push(id),
                None => self.sources.push(id),
            }
        }
        self.always.add(&always);
    }

    fn expr(&mut self, expr: &Expr, set: &mut Inputs) {
        for leaf in expr.leaves() {
            match leaf {
                Leaf::Input(input) => set.insert(*input),
                Leaf::Rise(edge) | Leaf::Fall(edge) => {
                    set.put(self.net.inputs.len() + edge.index());
                }
                _ => {}
            }
        }
        self.time(expr, &|leaf| Some(*leaf));
    }

    fn property(&mut self, expr: &grafsynth_ir::net::PropertyExpr, set: &mut Inputs) {
        for leaf in expr.leaves() {
            if let Some(Leaf::Input(input)) = leaf.net() {
                set.insert(*input);
            }
        }
        self.time(expr, &|leaf: &PropertyLeaf| leaf.net().copied());
    }

    fn time<L>(&mut self, expr: &GenericExpr<L>, net_leaf: &impl Fn(&L) -> Option<Leaf>) {
        if let grafsynth_ir::expr::ExprKind::Compare(_, a, b) = &expr.kind {
            for (timer, constant) in [(a, b), (b, a)] {
                if let grafsynth_ir::expr::ExprKind::Leaf(leaf) = &timer.kind
                    && let grafsynth_ir::expr::ExprKind::Int(value) = &constant.kind
                {
                    match net_leaf(leaf) {
                        Some(Leaf::Elapsed(step)) => {
                            self.elapsed[step] = self.elapsed[step].max(*value)
                        }
                        Some(leaf) if leaf.is_time() => {
                            self.other_time = self.other_time.max(*value)
                        }
                        _ => {}
                    }
                }
            }
        }
        expr.children().for_each(|operand| self.time(operand, net_leaf));
    }

    fn block(&mut self, block: &Block, set: &mut Inputs) {
        expressions(block).for_each(|expr| self.expr(expr, set));
    }

    /// The largest relevant `dt`: more ticks have the same effect. `None` if no tick matters in the situation.
    pub(crate) fn largest_dt(&self, situation: &Situation) -> Option<u32> {
        let steps = situation.iter().map(|step| self.elapsed[step]).max().unwrap_or(-1);
        // A timer stops one above its constant, starting from 0 or more.
        let largest = steps.max(self.other_time);
        (largest >= 0).then(|| u32::try_from(largest + 1).unwrap_or(u32::MAX))
    }

    /// True if a time is compared in any situation.
    pub(crate) fn has_time(&self) -> bool {
        self.other_time >= 0 || self.elapsed.values().any(|largest| *largest >= 0)
    }

    /// The inputs and the edges that a reaction from the situation can read.
    pub(crate) fn inputs(&self, situation: &Situation) -> Inputs {
        self.reads(situation, self.is_stable)
    }

    /// The edges that compare with a value from before the reaction. Only those of the first micro-step do: when it fires, each operand that is not over inputs
    /// alone gets a new value to compare with, and the edges of inputs end (semantics §3.7).
    pub(crate) fn first_edges(&self, situation: &Situation) -> Inputs {
        self.reads(situation, false)
    }

    fn reads(&self, situation: &Situation, is_stable: bool) -> Inputs {
        let mut set = self.always.clone();
        if !self.net.forcings.is_empty() {
            self.by_step.values().chain(self.by_transition.values()).for_each(|one| set.add(one));
            return set;
        }
        let mut active = situation.clone();
        let mut todo: Vec<StepId> = situation.iter().collect();
        for source in &self.sources {
            self.fires(*source, &mut set, &mut active, &mut todo);
        }
        // In `single` only enabled transitions can fire; in `stable` also those that earlier micro-steps enable.
        let mut at = 0;
        while at < todo.len() {
            let step = todo[at];
            at += 1;
            set.add(&self.by_step[step]);
            if !is_stable && !situation.contains(step) {
                continue;
            }
            for transition in &self.leaving[step] {
                // In `stable` a step found later may enable it, so it counts even if not all its steps are active now.
                let requires = &self.net.transitions[*transition].requires;
                if is_stable || requires.iter().all(|step| situation.contains(*step)) {
                    self.fires(*transition, &mut set, &mut active, &mut todo);
                }
            }
        }
        set
    }

    fn fires(
        &self,
        transition: TransitionId,
        set: &mut Inputs,
        active: &mut Situation,
        todo: &mut Vec<StepId>,
    ) {
        set.add(&self.by_transition[transition]);
        let mut seen: BTreeSet<HistoryId> = BTreeSet::new();
        let mut lists: Vec<&[Enter]> = vec![&self.net.transitions[transition].enters];
        while let Some(list) = lists.pop() {
            for enter in list {
                match enter {
                    Enter::Step(step) => self.activate(*step, active, todo),
                    // The list of the initial transition belongs to its state.
                    Enter::InitialContent(_) => {}
                    Enter::History(history) => {
                        if seen.insert(*history) {
                            let history = &self.net.histories[*history];
                            lists.push(&history.default);
                            lists.extend(history.cases.iter().map(|case| &case.enters[..]));
                        }
                    }
                }
            }
        }
    }

    fn activate(&self, step: StepId, active: &mut Situation, todo: &mut Vec<StepId>) {
        let mut waiting = vec![step];
        while let Some(step) = waiting.pop() {
            if !active.contains(step) {
                active.insert(step);
                todo.push(step);
            }
            // An enclosing step that is already active may restart, so its links count too.
            waiting
                .extend(self.links[step].iter().copied().filter(|child| !active.contains(*child)));
        }
    }
}
