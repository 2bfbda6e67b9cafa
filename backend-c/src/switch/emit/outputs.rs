//! Outputs: tests of the variables if there are few steps, or a separate `switch` if there are many.

use super::Emit;
use super::read::{Place, Reader};
use crate::Object;
use crate::c::print::{Arm, Kind, Node};
use crate::cexpr::{CExpr, Prec, c_expr};
use crate::safe;
use crate::switch::plan::Plan;
use grafsynth_ir::Gather;
use grafsynth_ir::net::{Driver, ExternCall, OutputId, StepId};
use std::collections::{BTreeMap, BTreeSet};

impl Emit<'_> {
    /// The assignments of the outputs: those before the micro-step (`mealy`), or all others.
    pub(super) fn outputs(&mut self, mealy: bool) -> Vec<Node> {
        let net = self.net;
        let io = &self.names.io;
        let mut nodes = if mealy { Vec::new() } else { self.masks() };
        let mut by_step: BTreeMap<StepId, Vec<Node>> = BTreeMap::new();
        let emergency = self.emergency();
        for (id, output) in net.outputs.iter() {
            let name = format!("out->{}", self.names.outputs[id]);
            let bit = io.output_bit(id).map(|bit| {
                let (word, bit) = (bit / io.output_bits(), bit % io.output_bits());
                io.light(word, &io.output_mask(1 << bit)).about(Object::Output(id))
            });
            match &output.driver {
                Driver::Continuous(emissions) | Driver::Mealy(emissions) => {
                    if matches!(output.driver, Driver::Mealy(_)) != mealy {
                        continue;
                    }
                    let mut terms: Vec<CExpr> =
                        self.tables.output_bit(self.names, id, mealy).into_iter().collect();
                    for emission in emissions {
                        if self.tables.emits(emission.step) && !mealy {
                            continue;
                        }
                        // The masks of the steps come first.
                        if bit.is_some() && !mealy && emission.condition.is_none() {
                            continue;
                        }
                        let expressions = emission.condition.iter();
                        let active = self.now_active(emission.step);
                        let place = Place::Output { step: emission.step };
                        let condition = emission.condition.as_ref().map_or_else(
                            || CExpr::bool(true),
                            |it| c_expr(it, &mut Reader { emit: self, place }),
                        );
                        if condition.is_false() {
                            continue;
                        }
                        let (machine, _) = self.plan.place[emission.step];
                        if self.by_case(machine) {
                            let set = bit.clone().unwrap_or_else(|| {
                                Node::line(format!("{name} = true;")).about(Object::Output(id))
                            });
                            let demands = self.demand_all(expressions, &[]);
                            let list = by_step.entry(emission.step).or_default();
                            list.extend(demands);
                            list.push(if condition.is_true() {
                                set
                            } else {
                                Node::when(&condition.text, vec![set])
                            });
                        } else {
                            let demands =
                                self.demand_all(expressions, std::slice::from_ref(&active));
                            nodes.extend(demands);
                            terms.push(CExpr::and([active, condition]));
                        }
                    }
                    let value = CExpr::or(terms);
                    if let Some(light) = bit {
                        if value.is_true() {
                            nodes.push(light);
                        } else if !value.is_false() {
                            nodes.push(Node::when(&value.text, vec![light]));
                        }
                        continue;
                    }
                    nodes.push(
                        Node::line(format!("{name} = {};", value.text)).about(Object::Output(id)),
                    );
                }
                Driver::Stored(var) if !mealy => {
                    if let Some(light) = bit {
                        let head = format!("self->{}", self.names.vars[*var]);
                        nodes.push(Node::when(&head, vec![light]));
                        continue;
                    }
                    nodes.push(
                        Node::line(format!("{name} = self->{};", self.names.vars[*var]))
                            .about(Object::Output(id)),
                    );
                }
                Driver::Extern { calls, .. } if !mealy && !calls.is_empty() => {
                    let mut arms = Vec::new();
                    // If one variable requests all calls, at most one step does so at a time.
                    let machines: BTreeSet<usize> =
                        calls.iter().map(|it| self.plan.place[it.step].0).gather();
                    let mut calls: Vec<&ExternCall> = calls.iter().collect();
                    // The first active step in declaration order gives the arguments.
                    calls.sort_by_key(|call| call.step);
                    let by_case = machines.len() == 1
                        && machines.iter().all(|it| self.by_case(*it))
                        && calls.windows(2).all(|pair| pair[0].step != pair[1].step);
                    for call in calls {
                        let place = Place::Output { step: call.step };
                        let active = self.now_active(call.step);
                        let expressions = call.condition.iter().chain(&call.arguments);
                        if by_case {
                            let demands = self.demand_all(expressions, &[]);
                            let list = by_step.entry(call.step).or_default();
                            list.extend(demands);
                        } else {
                            let demands =
                                self.demand_all(expressions, std::slice::from_ref(&active));
                            nodes.extend(demands);
                        }
                        let condition = call.condition.as_ref().map_or_else(
                            || CExpr::bool(true),
                            |it| c_expr(it, &mut Reader { emit: self, place }),
                        );
                        let values = call
                            .arguments
                            .iter()
                            .map(|it| c_expr(it, &mut Reader { emit: self, place }))
                            .collect();
                        let statement = self.call(id, values);
                        let condition = match &emergency {
                            Some(holds) => CExpr::and([holds.clone().not(), condition]),
                            None => condition,
                        };
                        if by_case {
                            let list = by_step.entry(call.step).or_default();
                            if condition.is_true() {
                                list.push(statement);
                            } else if !condition.is_false() {
                                list.push(Node::when(&condition.text, vec![statement]));
                            }
                            continue;
                        }
                        let head = CExpr::and([active, condition]);
                        arms.push((head, statement, call.step));
                    }
                    nodes.extend(self.call_chain(id, arms));
                }
                Driver::Controlled(_) if !mealy => {
                    let value = self.framed.as_ref().and_then(|it| it.outputs.get(&id));
                    let value = value.cloned().unwrap_or_else(|| CExpr::bool(false));
                    match bit {
                        Some(_) if value.is_false() => {}
                        Some(light) if value.is_true() => nodes.push(light),
                        Some(light) => nodes.push(Node::when(&value.text, vec![light])),
                        None => nodes.push(
                            Node::line(format!("{name} = {};", value.text))
                                .about(Object::Output(id)),
                        ),
                    }
                }
                Driver::Fires(transitions) if !mealy => {
                    // A transition without an owner requires two steps that exclude each other.
                    let flags = transitions
                        .iter()
                        .filter(|id| self.needs_flag(**id))
                        .map(|id| CExpr::condition(self.scan(&self.fire_flag(*id)), Prec::Atom));
                    let value = CExpr::or(flags);
                    match bit {
                        Some(_) if value.is_false() => {}
                        Some(light) => nodes.push(Node::when(&value.text, vec![light])),
                        None => nodes.push(
                            Node::line(format!("{name} = {};", value.text))
                                .about(Object::Output(id)),
                        ),
                    }
                }
                Driver::Fires(_)
                | Driver::Stored(_)
                | Driver::Extern { .. }
                | Driver::Controlled(_) => {}
            }
        }
        nodes.extend(self.output_cases(by_step));
        if let Some(holds) = &emergency {
            let is_mealy = |id| matches!(net.outputs[id].driver, Driver::Mealy(_));
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

    /// The condition of the emergency, read where outputs are computed.
    fn emergency(&mut self) -> Option<CExpr> {
        let emergency = self.net.emergency.as_ref()?;
        let mut reader = Reader { emit: self, place: Place::Free };
        Some(c_expr(&emergency.condition, &mut reader))
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
            let mut cases: Vec<Node> = Vec::new();
            for (steps, mut list) in shared {
                list.push(Node::line("break;"));
                let heads =
                    steps.iter().map(|step| format!("case {}:", self.step_code(*step))).collect();
                let case: Node = Kind::Case(heads, list).into();
                cases.push(case.about_all(steps.iter().map(|step| Object::Step(*step))));
            }
            cases.push(Kind::Case(vec!["default:".to_string()], vec![Node::line("break;")]).into());
            nodes.push(Node::block(format!("switch ({})", self.var(machine)), cases));
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
