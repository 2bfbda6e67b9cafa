//! Transitions: one `switch` for each variable, whose cases test the transitions of one step and fire them.

use super::read::Place;
use super::{Emit, zero};
use crate::Object;
use crate::c::print::{Arm, Kind, Node};
use crate::cexpr::{CExpr, Prec};
use crate::style_output::{mentions, without_unused};
use crate::switch::plan::{Latch, Machine, Plan, receptivity};
use crate::times::Ticks;
use crate::trace;
use grafsynth_c::storage;
use grafsynth_ir::Gather;
use grafsynth_ir::net::{Expr, InputId, Leaf, Policy, StepId, TransitionId};
use std::collections::{BTreeMap, BTreeSet};

impl Emit<'_> {
    /// The statements that move all variables; in the split form they call the functions that are added to `functions`.
    pub(super) fn moves(&mut self, functions: &mut Vec<Node>) -> Vec<Node> {
        let mut calls = Vec::new();
        let mut group: Vec<Node> = Vec::new();
        let mut group_weight = 0;
        for index in 0..self.plan.machines.len() {
            if self.tables.holds(index) {
                continue;
            }
            let weight = weight(self.plan, &self.plan.machines[index]);
            if !self.locals
                && group_weight > 0
                && group_weight + weight > self.options.max_transitions
            {
                self.close_group(&mut group, &mut calls, functions);
                group_weight = 0;
            }
            if weight > self.options.max_transitions && !self.locals {
                self.close_group(&mut group, &mut calls, functions);
                group_weight = 0;
                calls.push(self.split_machine(index, functions));
            } else {
                let body = self.machine(index, None);
                group.extend(body);
                group_weight += weight;
            }
        }
        if self.locals {
            calls = group;
        } else {
            self.close_group(&mut group, &mut calls, functions);
        }
        // The loop of a stable evolution is a function, which contains these statements.
        self.in_step = !self.stable;
        for (index, machine) in self.plan.machines.iter().enumerate() {
            if machine.is_entered {
                calls.push(self.deferred(index, machine));
            }
        }
        calls.extend(self.tables.moves(self));
        calls
    }

    pub(super) fn close_group(
        &mut self,
        group: &mut Vec<Node>,
        calls: &mut Vec<Node>,
        functions: &mut Vec<Node>,
    ) {
        let body = std::mem::take(group);
        if body.is_empty() {
            self.case_conditions.clear();
            return;
        }
        let name = format!("{}_move_{}", self.names.prefix, functions.len() + 1);
        let call = self.private_function(&name, body, functions);
        calls.push(call);
    }

    /// Adds a static function with the parameters that its body uses, and returns its call.
    pub(super) fn private_function(
        &mut self,
        name: &str,
        mut body: Vec<Node>,
        functions: &mut Vec<Node>,
    ) -> Node {
        let mut declared: Vec<Node> = Vec::new();
        for input in std::mem::take(&mut self.case_conditions) {
            declared.push(self.case_condition(input));
        }
        declared.append(&mut body);
        let body = without_unused(declared);
        let (mut parameters, mut arguments) = self.parameters(&body);
        if mentions(&body, "scan") {
            parameters.push(format!("{}_scan_t *scan", self.names.prefix));
            arguments.push(if self.stable { "scan" } else { "&scan" });
        }
        functions
            .push(Node::function(format!("static void {name}({})", parameters.join(", ")), body));
        functions.push(Node::blank());
        Node::line(format!("{name}({});", arguments.join(", ")))
    }

    /// The parameters that a private function needs for its body, and their arguments: verbatim text may use `out` and `dt` too.
    pub(super) fn parameters(&self, body: &[Node]) -> (Vec<String>, Vec<&'static str>) {
        let prefix = &self.names.prefix;
        let mut parameters = vec![format!("{prefix}_t *self")];
        let mut arguments = vec!["self"];
        let ticks = self.ticks.map_or("uint32_t", Ticks::name);
        for (word, parameter) in [
            ("in", format!("const {prefix}_in_t *in")),
            ("dt", format!("{ticks} dt")),
            ("out", format!("{prefix}_out_t *out")),
        ] {
            if mentions(body, word) {
                parameters.push(parameter);
                arguments.push(word);
            }
        }
        (parameters, arguments)
    }

    /// The local for a condition that is called in one case only.
    pub(super) fn case_condition(&self, input: InputId) -> Node {
        let name = format!("cond_{}", self.names.inputs[input]);
        let ty = storage(self.net.inputs[input].ty);
        Node::line(format!("{ty} {name} = {};", zero(self.net, input))).defining(name)
    }

    /// A variable with too many transitions: one function for each range of its values.
    pub(super) fn split_machine(&mut self, index: usize, functions: &mut Vec<Node>) -> Node {
        let machine = &self.plan.machines[index];
        let cap = self.options.max_transitions.max(1);
        // The largest power of two as the number of values per range for which every range stays within the limit.
        let mut shift = 0;
        while shift < 16
            && ranges(self.plan, machine, shift + 1).iter().all(|(_, weight)| *weight <= cap)
        {
            shift += 1;
        }
        let mut cases = Vec::new();
        for (range, _) in ranges(self.plan, machine, shift) {
            let body = self.machine(index, Some((range, shift)));
            if body.is_empty() {
                continue;
            }
            let name = format!("{}_move_{}", self.names.prefix, functions.len() + 1);
            let call = self.private_function(&name, body, functions);
            cases.push(Node::case(range, vec![call]));
        }
        cases.push(self.default_case());
        Node::block(format!("switch (self->{} >> {shift})", self.vars[index]), cases)
    }

    pub(super) fn default_case(&self) -> Node {
        let bad = Node::line(format!("{}_BAD_STATE(self);", self.names.upper));
        Kind::Case(vec!["default:".to_string()], vec![bad, Node::line("break;")]).into()
    }

    /// The `switch` of one variable (or of a range of its values).
    pub(super) fn machine(&mut self, index: usize, range: Option<(usize, u32)>) -> Vec<Node> {
        let plan = self.plan;
        let machine = &plan.machines[index];
        let mut cases: Vec<Node> = Vec::new();
        let mut idle: Vec<String> = Vec::new();
        let in_range =
            |code: u32| range.is_none_or(|(range, shift)| (code >> shift) as usize == range);
        if machine.has_none && in_range(0) {
            idle.push(format!("case {}:", self.none_code()));
        }
        for step in &machine.steps {
            let (_, code) = plan.place[*step];
            if !in_range(code) {
                continue;
            }
            let mut body = self.case(index, *step);
            if body.is_empty() {
                idle.push(format!("case {}:", self.step_code(*step)));
                continue;
            }
            body.push(Node::line("break;"));
            let mut case: Node =
                Kind::Case(vec![format!("case {}:", self.step_code(*step))], body).into();
            case.note = self.step_note(*step);
            cases.push(case.about(Object::Step(*step)));
        }
        if cases.is_empty() {
            return Vec::new();
        }
        // A variable with one step is tested by an `if`.
        if let ([step], true, None) = (machine.steps.as_slice(), machine.has_none, range) {
            let mut body = self.case(index, *step);
            let note = self.step_note(*step);
            let condition = format!("{} == {}", self.var(index), self.step_code(*step));
            let mut node =
                Node::when(&condition, std::mem::take(&mut body)).about(Object::Step(*step));
            node.note = note;
            return vec![node];
        }
        if !idle.is_empty() {
            cases.push(Kind::Case(idle, vec![Node::line("break;")]).into());
        }
        cases.push(self.default_case());
        vec![Node::block(format!("switch ({})", self.var(index)), cases)]
    }

    /// The statements while `step` is active.
    pub(super) fn case(&mut self, index: usize, step: StepId) -> Vec<Node> {
        let mut nodes = Vec::new();
        let mut arms: Vec<Arm> = Vec::new();
        let mut settled = None;
        let lit = self.lit_in_cases(index);
        let transitions = self.plan.leaving[step].clone();
        let (own, foreign): (Vec<_>, Vec<_>) =
            transitions.iter().copied().partition(|id| self.plan.owner[*id] == Some(index));
        for id in foreign {
            let body = self.effects(index, id, step);
            let fires = self.scan(&self.fire_flag(id));
            arms.push(
                Arm::when(&fires, body).noted(self.transition_note(id), Object::Transition(id)),
            );
        }
        for id in own {
            for node in self.ask(id, step) {
                // Several transitions of the step may call the same condition.
                if !nodes.contains(&node) {
                    nodes.push(node);
                }
            }
            let condition = self.condition(index, id, step);
            if condition.is_false() {
                continue;
            }
            let mut body = self.effects(index, id, step);
            if lit {
                body.extend(self.lights(self.plan.added(self.net, id, index)));
            }
            if condition.is_true() {
                settled = Some(
                    Arm::otherwise(body).noted(self.transition_note(id), Object::Transition(id)),
                );
                break;
            }
            arms.push(
                Arm::when(&condition.text, body)
                    .noted(self.transition_note(id), Object::Transition(id)),
            );
        }
        let stays = if lit { self.lights(Some(step)) } else { Vec::new() };
        if arms.is_empty() {
            if let Some(arm) = settled {
                nodes.push(Node::comment(arm.note.clone()).about_all(arm.objects.clone()));
                nodes.extend(arm.body);
            } else {
                nodes.extend(stays);
            }
            return nodes;
        }
        let settled = settled.or_else(|| (!stays.is_empty()).then(|| Arm::otherwise(stays)));
        arms.extend(settled.filter(|arm| !arm.body.is_empty()));
        nodes.push(Kind::Block(arms).into());
        nodes
    }

    /// Calls the extern conditions that a transition mentions, unless they are called at the start.
    pub(super) fn ask(&mut self, id: TransitionId, step: StepId) -> Vec<Node> {
        let guard = &self.net.transitions[id].guard;
        let mentioned: BTreeSet<InputId> = guard.leaves().filter_map(Leaf::input).gather();
        let owner = self.plan.place[step].0;
        let others = self.other_sources(id, owner);
        let mut nodes = Vec::new();
        for input in mentioned {
            match self.plan.latches.get(&input) {
                Some(Latch::InCase) => {
                    let name = &self.names.inputs[input];
                    self.case_conditions.insert(input);
                    let cond = format!("cond_{name}");
                    nodes.push(
                        Node::line(format!("{cond} = {name}();"))
                            .about(Object::Input(input))
                            .defining_by(cond, format!("(void){name}();")),
                    );
                }
                Some(Latch::OnDemand) => nodes.push(self.demand(input, others.clone())),
                Some(Latch::Always) | None => {}
            }
        }
        nodes
    }

    pub(super) fn demand(&self, input: InputId, when: Vec<CExpr>) -> Node {
        let name = &self.names.inputs[input];
        let asked = self.scan(&format!("asked_{name}"));
        let condition = CExpr::and(
            when.into_iter()
                .chain([CExpr::condition(asked.clone(), Prec::Atom).not()])
                .collect::<Vec<_>>(),
        );
        let value = self.scan(&format!("cond_{name}"));
        let call = Node::line(format!("{value} = {name}();"));
        let call =
            if self.locals { call.defining_by(&value, format!("(void){name}();")) } else { call };
        Node::when(&condition.text, vec![Node::line(format!("{asked} = true;")), call])
            .about(Object::Input(input))
    }

    /// Calls the conditions that a list or an output mentions, unless they were called already.
    pub(super) fn demand_all<'e>(
        &self,
        exprs: impl Iterator<Item = &'e Expr>,
        when: &[CExpr],
    ) -> Vec<Node> {
        let mentioned: BTreeSet<InputId> =
            exprs.flat_map(Expr::leaves).filter_map(Leaf::input).gather();
        mentioned
            .into_iter()
            .filter(|input| self.plan.latches.get(input) == Some(&Latch::OnDemand))
            .map(|input| self.demand(input, when.to_vec()))
            .collect()
    }

    /// The source steps of a transition in other variables, as conditions.
    pub(super) fn other_sources(&self, id: TransitionId, owner: usize) -> Vec<CExpr> {
        let mut seen = BTreeSet::new();
        self.net.transitions[id]
            .requires
            .iter()
            .filter(|step| self.plan.place[**step].0 != owner && seen.insert(**step))
            .map(|step| self.is_active(*step, owner))
            .collect()
    }

    /// The condition that a step of another variable was active at the start of the micro-step, as read in the code of the variable
    /// `reader`.
    pub(super) fn is_active(&self, step: StepId, reader: usize) -> CExpr {
        let (machine, _) = self.plan.place[step];
        let var = if machine < reader
            && self.plan.machines[machine].needs_old
            && !self.tables.holds(machine)
        {
            self.scan(&format!("old_{}", self.vars[machine]))
        } else {
            self.var(machine)
        };
        CExpr::condition(format!("{var} == {}", self.step_code(step)), Prec::Compare)
    }

    /// The condition under which a transition fires, given that `step` is active and the earlier transitions of the case do not fire.
    pub(super) fn condition(&mut self, owner: usize, id: TransitionId, step: StepId) -> CExpr {
        let asked = self.plan.leaving[step].iter().position(|it| *it == id).unwrap_or(0);
        let mut all = self.other_sources(id, owner);
        let net = self.net;
        let guard = receptivity(net, id);
        all.push(self.value(&guard, Place::Guard { step, asked }));
        let policy_competes = net.settings.policy != Policy::All;
        if policy_competes {
            let mut seen: BTreeSet<_> = [id].into_iter().gather();
            for other in net.transitions[id].requires.clone() {
                if self.plan.place[other].0 == owner {
                    continue;
                }
                let rivals: Vec<TransitionId> = self.plan.leaving[other]
                    .iter()
                    .copied()
                    .take_while(|rival| *rival != id)
                    .collect();
                for rival in rivals.into_iter().filter(|rival| seen.insert(*rival)) {
                    match self.plan.owner[rival] {
                        Some(decided) if decided == owner => {}
                        Some(decided) if decided < owner => {
                            all.push(
                                CExpr::condition(self.scan(&self.fire_flag(rival)), Prec::Atom)
                                    .not(),
                            );
                        }
                        Some(_) => {
                            let asked = self.plan.leaving[other]
                                .iter()
                                .position(|it| *it == rival)
                                .unwrap_or(0);
                            // The plan rejects a rival whose condition depends on its own rivals.
                            let place = Place::Guard { step: other, asked };
                            let fires = self.value(&receptivity(net, rival), place);
                            all.push(fires.not());
                        }
                        None => {}
                    }
                }
            }
        }
        CExpr::and(all)
    }

    /// The effect of firing on one variable, in the case of its active `step`. If the variable is the transition's owner, also all other
    /// effects of firing.
    pub(super) fn effects(&mut self, index: usize, id: TransitionId, step: StepId) -> Vec<Node> {
        let plan = self.plan;
        let net = self.net;
        let transition = &net.transitions[id];
        let is_owner = plan.owner[id] == Some(index);
        let target = plan.added(net, id, index);
        let stays = target == Some(step) && !transition.restart;
        let mut nodes = Vec::new();
        if is_owner && self.options.trace.is_some() {
            nodes.push(trace::fired(self.names, id).about(Object::Transition(id)));
        }
        if !stays {
            let place = Place::List { machine: index, active: Some(step), timed: true };
            nodes.extend(self.block(&net.steps[step].exit, place));
        }
        if is_owner {
            let active = stays.then_some(step);
            let place = Place::List { machine: index, active, timed: stays };
            nodes.extend(self.block(&transition.actions, place));
        }
        if !stays {
            if target != Some(step) {
                let code = target.map_or_else(|| self.none_code(), |target| self.step_code(target));
                nodes.push(Node::line(format!("{} = {code};", self.var(index))));
            }
            if let Some(target) = target {
                if plan.timed.contains(&target) {
                    nodes.push(Node::line(format!("self->{} = 0;", self.timers[index])));
                }
                let place = Place::List { machine: index, active: Some(target), timed: false };
                nodes.extend(self.block(&net.steps[target].entry, place));
            }
        }
        if is_owner {
            if self.needs_flag(id) {
                nodes.push(Node::line(format!("{} = true;", self.scan(&self.fire_flag(id)))));
            }
            if plan.is_wide[id] {
                for entered in grafsynth_ir::plan::following(transition) {
                    let (machine, _) = plan.place[entered];
                    if machine != index && plan.taken(net, id, machine).is_none() {
                        let name = self.scan(&format!("enter_{}", self.vars[machine]));
                        nodes.push(Node::line(format!("{name} = {};", self.step_code(entered))));
                    }
                }
            }
            if self.stable {
                nodes.push(Node::line(format!("{} = true;", self.scan("fired"))));
            }
        }
        nodes
    }

    /// Adds the steps that forks deferred for a variable from which they take nothing.
    pub(super) fn deferred(&self, index: usize, machine: &Machine) -> Node {
        let enter = self.scan(&format!("enter_{}", self.vars[index]));
        let var = self.var(index);
        let mut body = Vec::new();
        if machine.timer_cap.is_some() {
            let old = self.scan(&format!("old_{}", self.vars[index]));
            let reset = Node::line(format!("self->{} = 0;", self.timers[index]));
            body.push(Node::when(&format!("{enter} != {old}"), vec![reset]));
        }
        body.push(Node::line(format!("{var} = {enter};")));
        Node::when(&format!("{enter} != {}", self.none_code()), body)
    }
}

/// The number of transitions that a variable decides, at least 1.
pub(super) fn weight(plan: &Plan, machine: &Machine) -> usize {
    machine.steps.iter().map(|step| plan.leaving[*step].len()).sum::<usize>().max(1)
}

/// The number of transitions in each range of `2^shift` values.
fn ranges(plan: &Plan, machine: &Machine, shift: u32) -> Vec<(usize, usize)> {
    let mut ranges: BTreeMap<usize, usize> = BTreeMap::new();
    if machine.has_none {
        ranges.insert(0, 0);
    }
    for step in &machine.steps {
        let (_, code) = plan.place[*step];
        *ranges.entry((code >> shift) as usize).or_default() += plan.leaving[*step].len();
    }
    ranges.into_iter().collect()
}
