//! Outputs: tests of the variables if there are few steps, or a separate `switch` if there are many.

use super::Emit;
use super::read::Place;
use crate::Object;
use crate::c::print::{Arm, Kind, Node};
use crate::cexpr::{CExpr, Class, Prec};
use crate::safe;
use crate::switch::plan::Plan;
use grafsynth_ir::Gather;
use grafsynth_ir::net::{Driver, Emission, ExternCall, OutputId, StepId};
use std::collections::{BTreeMap, BTreeSet};

/// An output, and the statements that set it.
struct Lamp {
    output: OutputId,
    /// The statement that sets its bit, if it is a bit: all bits are clear before.
    bit: Option<Node>,
    /// The member that is assigned otherwise.
    member: String,
}

impl Lamp {
    /// Sets the output to a value; a clear bit needs no statement.
    fn set(self, value: &CExpr) -> Option<Node> {
        match self.bit {
            Some(_) if value.is_false() => None,
            Some(bit) => Some(under(value, bit)),
            None => Some(
                Node::line(format!("{} = {};", self.member, value.text))
                    .about(Object::Output(self.output)),
            ),
        }
    }

    /// The statement that switches the output on.
    fn on(&self) -> Node {
        let assign = || Node::line(format!("{} = true;", self.member));
        self.bit.clone().unwrap_or_else(|| assign().about(Object::Output(self.output)))
    }
}

/// A statement under a condition that is not constantly false.
fn under(condition: &CExpr, statement: Node) -> Node {
    if condition.is_true() { statement } else { Node::when(&condition.text, vec![statement]) }
}

/// The statements of all outputs.
struct Lists {
    nodes: Vec<Node>,
    /// Statements in the cases of a separate `switch`.
    by_step: BTreeMap<StepId, Vec<Node>>,
}

impl Emit<'_> {
    /// The assignments of the outputs: those before the micro-step (`mealy`), or all others.
    pub(super) fn outputs(&mut self, mealy: bool) -> Vec<Node> {
        let net = self.net;
        let nodes = if mealy { Vec::new() } else { self.masks() };
        let mut lists = Lists { nodes, by_step: BTreeMap::new() };
        let emergency = self.emergency();
        let is_mealy = |id: OutputId| matches!(net.outputs[id].driver, Driver::Mealy(_));
        for (id, output) in net.outputs.iter().filter(|(id, _)| is_mealy(*id) == mealy) {
            let lamp = self.lamp(id);
            let value = match &output.driver {
                Driver::Mealy(emissions) | Driver::Continuous(emissions) => {
                    self.emitted(mealy, emissions, &lamp, &mut lists)
                }
                // The variable has the type of the output, so nothing is converted.
                Driver::Stored(var) => {
                    let (text, (lo, hi)) =
                        (format!("self->{}", self.names.vars[*var]), output.ty.bounds());
                    CExpr::exact(text, Prec::Atom, Class::of(lo, hi), (lo, hi))
                }
                Driver::Controlled(_) => {
                    let value = self.framed.as_ref().and_then(|it| it.outputs.get(&id));
                    value.cloned().unwrap_or_else(|| CExpr::bool(false))
                }
                // A transition without an owner requires two steps that exclude each other.
                Driver::Fires(transitions) => CExpr::or(
                    (transitions.iter().filter(|id| self.needs_flag(**id)))
                        .map(|id| CExpr::condition(self.scan(&self.fire_flag(*id)), Prec::Atom)),
                ),
                Driver::Extern { calls, .. } => {
                    self.called(id, calls, emergency.as_ref(), &mut lists);
                    continue;
                }
            };
            lists.nodes.extend(lamp.set(&value));
        }
        let Lists { mut nodes, by_step } = lists;
        nodes.extend(self.output_cases(by_step));
        if let Some(holds) = &emergency {
            nodes.extend(safe::force(net, self.names, holds, |id| is_mealy(id) == mealy));
        }
        if !mealy {
            for word in 0..self.names.io.output_words() {
                let lit = self.names.io.lit(word);
                nodes.push(Node::line(format!("out->bits[{word}] = {lit};")));
            }
        }
        nodes
    }

    fn lamp(&self, output: OutputId) -> Lamp {
        let io = &self.names.io;
        let bit = io.output_bit(output).map(|bit| {
            let (word, bit) = (bit / io.output_bits(), bit % io.output_bits());
            io.light(word, &io.output_mask(1 << bit)).about(Object::Output(output))
        });
        Lamp { output, bit, member: format!("out->{}", self.names.outputs[output]) }
    }

    /// The value of an output that steps drive while they are active. Steps of variables with a separate `switch` switch it on there.
    fn emitted(
        &mut self,
        mealy: bool,
        emissions: &[Emission],
        lamp: &Lamp,
        lists: &mut Lists,
    ) -> CExpr {
        let tables = self.tables.output_bit(self.names, lamp.output, mealy);
        let mut terms: Vec<CExpr> = tables.into_iter().collect();
        for Emission { step, condition, .. } in emissions {
            // The tables, or the masks of the steps, come first.
            let masked = lamp.bit.is_some() && condition.is_none();
            if !mealy && (masked || self.tables.emits(*step)) {
                continue;
            }
            let value = self.given(condition.as_ref(), Place::Output { step: *step });
            if value.is_false() {
                continue;
            }
            if self.by_case(self.plan.place[*step].0) {
                let list = lists.by_step.entry(*step).or_default();
                list.extend(self.demand_all(condition.iter(), &[]));
                list.push(under(&value, lamp.on()));
            } else {
                let active = self.now_active(*step);
                let when = std::slice::from_ref(&active);
                lists.nodes.extend(self.demand_all(condition.iter(), when));
                terms.push(CExpr::and([active, value]));
            }
        }
        CExpr::or(terms)
    }

    /// The calls of an extern action while steps that request it are active.
    fn called(
        &mut self,
        output: OutputId,
        calls: &[ExternCall],
        emergency: Option<&CExpr>,
        lists: &mut Lists,
    ) {
        let mut arms = Vec::new();
        // If one variable requests all calls, at most one step does so at a time.
        let machines: BTreeSet<usize> = calls.iter().map(|it| self.plan.place[it.step].0).gather();
        let mut calls: Vec<&ExternCall> = calls.iter().collect();
        // The first active step in declaration order gives the arguments.
        calls.sort_by_key(|call| call.step);
        let by_case = machines.len() == 1
            && machines.iter().all(|it| self.by_case(*it))
            && calls.windows(2).all(|pair| pair[0].step != pair[1].step);
        for call in calls {
            let place = Place::Output { step: call.step };
            let active = self.now_active(call.step);
            let when = if by_case { &[][..] } else { std::slice::from_ref(&active) };
            let demands = self.demand_all(call.condition.iter().chain(&call.arguments), when);
            let condition = self.given(call.condition.as_ref(), place);
            let values = call.arguments.iter().map(|it| self.value(it, place)).collect();
            let statement = self.call(output, values);
            let condition = match emergency {
                Some(holds) => CExpr::and([holds.clone().not(), condition]),
                None => condition,
            };
            if by_case {
                let list = lists.by_step.entry(call.step).or_default();
                list.extend(demands);
                list.extend((!condition.is_false()).then(|| under(&condition, statement)));
            } else {
                lists.nodes.extend(demands);
                arms.push((CExpr::and([active, condition]), statement, call.step));
            }
        }
        lists.nodes.extend(self.call_chain(output, arms));
    }

    /// The condition of the emergency, read where outputs are computed.
    fn emergency(&mut self) -> Option<CExpr> {
        let emergency = self.net.emergency.as_ref()?;
        Some(self.value(&emergency.condition, Place::Free))
    }

    /// A continuous call: once, with the arguments of the first step that requests it.
    pub(super) fn call_chain(
        &self,
        output: OutputId,
        arms: Vec<(CExpr, Node, StepId)>,
    ) -> Vec<Node> {
        let mut chain: Vec<Arm> = Vec::new();
        let plain = arms.iter().all(|(_, statement, _)| statement.kind == arms[0].1.kind);
        if plain && let Some((_, statement, _)) = arms.first() {
            let objects: Vec<Object> =
                arms.iter().map(|(_, _, step)| Object::Step(*step)).collect();
            let any = CExpr::or(arms.iter().map(|(head, _, _)| head.clone()).collect::<Vec<_>>());
            if any.is_false() {
                return Vec::new();
            }
            let mut node =
                Node::when(&any.text, vec![statement.clone()]).about(Object::Output(output));
            node.objects.extend(objects);
            return vec![node];
        }
        for (head, statement, step) in arms {
            if head.is_false() {
                continue;
            }
            let mut arm = Arm::when(&head.text, vec![statement]);
            arm.objects = vec![Object::Output(output), Object::Step(step)];
            chain.push(arm);
        }
        if chain.is_empty() { Vec::new() } else { vec![Kind::Block(chain).into()] }
    }

    /// Whether a variable's outputs are set in a separate `switch`: it costs the time of one step, not of all.
    pub(super) fn by_case(&self, machine: usize) -> bool {
        !self.tables.holds(machine) && self.plan.machines[machine].values() > 8
    }

    pub(super) fn output_cases(&self, by_step: BTreeMap<StepId, Vec<Node>>) -> Vec<Node> {
        let mut by_machine: BTreeMap<usize, Vec<(StepId, Vec<Node>)>> = BTreeMap::new();
        for (step, list) in by_step {
            by_machine.entry(self.plan.place[step].0).or_default().push((step, list));
        }
        let mut nodes = Vec::new();
        for (machine, lists) in by_machine {
            // Steps with the same outputs share their statements.
            let mut shared: Vec<(Vec<StepId>, Vec<Node>)> = Vec::new();
            for (step, list) in lists {
                match shared.iter_mut().find(|(_, other)| *other == list) {
                    Some((steps, _)) if shared_cases(self.plan, machine) => steps.push(step),
                    Some(_) | None => shared.push((vec![step], list)),
                }
            }
            let cases = shared.into_iter().map(|(steps, list)| {
                Node::cases(steps.iter().map(|step| self.step_code(*step)), list)
                    .about_all(steps.iter().map(|step| Object::Step(*step)))
            });
            nodes.push(Node::switch(self.var(machine), cases.collect()));
        }
        nodes
    }

    /// The condition that a step is active, read from the instance.
    pub(super) fn stored_active(&self, step: StepId) -> CExpr {
        let (machine, _) = self.plan.place[step];
        CExpr::condition(
            format!("self->{} == {}", self.vars[machine], self.step_code(step)),
            Prec::Compare,
        )
    }

    /// The condition that a step is active now, in `NAME_step`.
    pub(super) fn now_active(&self, step: StepId) -> CExpr {
        let (machine, _) = self.plan.place[step];
        CExpr::condition(
            format!("{} == {}", self.var(machine), self.step_code(step)),
            Prec::Compare,
        )
    }
}

/// True if equal cases of a variable are merged: the search for them is quadratic, so it is done for small variables only.
fn shared_cases(plan: &Plan, machine: usize) -> bool {
    plan.machines[machine].steps.len() <= 256
}
