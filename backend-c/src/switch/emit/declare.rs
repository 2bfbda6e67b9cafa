//! Declarations: the members of the instance with their ranges, and the enumerators of the steps.

use super::Emit;
use crate::Object;
use crate::c::print::Node;
use crate::range::Range;
use crate::style_output::Member;
use crate::times::count_type;
use grafsynth_c::storage;
use grafsynth_ir::instance::{Holds, Place};
use grafsynth_ir::net::StepId;
use grafsynth_ir::program::Origin;

impl Emit<'_> {
    pub(super) fn instance(&self, fault: bool) -> Vec<Member> {
        let mut members = Vec::new();
        let member = |declaration: String, note: String, objects: Vec<Object>| Member {
            declaration,
            note,
            objects,
        };
        members.extend(self.tables.members(self.plan));
        for (index, machine) in self.plan.machines.iter().enumerate() {
            if self.tables.holds(index) {
                continue;
            }
            let note = match machine.steps.as_slice() {
                [only] => format!("whether {} is active", self.net.steps[*only].name),
                [first, .., last] => format!(
                    "the active step of {} .. {}",
                    self.net.steps[*first].name, self.net.steps[*last].name
                ),
                [] => String::new(),
            };
            let objects = machine.steps.iter().map(|step| Object::Step(*step)).collect();
            members.push(member(
                format!("{} {}", Self::state_type(machine), self.vars[index]),
                note,
                objects,
            ));
        }
        for (index, machine) in self.plan.machines.iter().enumerate() {
            if let Some(cap) = machine.timer_cap {
                let ty = count_type(cap);
                members.push(member(
                    format!("{ty} {}", self.timers[index]),
                    "ticks in that step, if they are used".to_string(),
                    Vec::new(),
                ));
            }
        }
        for (id, var) in self.net.vars.iter() {
            let len = var.len.map(|len| format!("[{len}]")).unwrap_or_default();
            let note = if var.meta.label.is_empty() {
                var.name.text.clone()
            } else {
                var.meta.label.clone()
            };
            members.push(member(
                format!("{} {}{len}", storage(var.ty), self.names.vars[id]),
                note,
                vec![Object::Var(id)],
            ));
        }
        members.extend(self.framed.iter().flat_map(|it| it.statements.instance(false)));
        for edge in &self.edges {
            members.push(member(
                format!("bool {}", self.names.edges[*edge]),
                "its value in the previous reaction".to_string(),
                Vec::new(),
            ));
        }
        if fault {
            members.push(member(
                "bool fault".to_string(),
                "the last reaction did not become stable".to_string(),
                Vec::new(),
            ));
        }
        members
    }

    /// The ranges of the members.
    pub(super) fn ranges(&self, fault: bool) -> Vec<Range> {
        let mut ranges = self.tables.ranges(self.plan);
        for (index, machine) in self.plan.machines.iter().enumerate() {
            if !self.tables.holds(index) {
                let last = i64::try_from(machine.values()).unwrap_or(i64::MAX) - 1;
                let name = self.vars[index].clone();
                ranges.push(Range::of(name, Self::state_type(machine), 0, last));
            }
            if let Some(cap) = machine.timer_cap {
                ranges.push(Range::of(self.timers[index].clone(), count_type(cap), 0, cap));
            }
        }
        for (id, var) in self.net.vars.iter() {
            let (lo, hi) = var.ty.bounds();
            let whole = Range::of(self.names.vars[id].clone(), storage(var.ty), lo, hi);
            ranges.push(Range { elements: var.len.map(|len| (0, len)), ..whole });
        }
        ranges.extend(self.framed.iter().flat_map(|it| it.statements.ranges()));
        for edge in &self.edges {
            ranges.push(Range::of(self.names.edges[*edge].clone(), "bool", 0, 1));
        }
        if fault {
            ranges.push(Range::of("fault".to_owned(), "bool", 0, 1));
        }
        ranges
    }

    /// The contents of each scalar of the instance.
    pub(super) fn holds(&self, fault: bool) -> Vec<(Place, Holds)> {
        let mut all = Vec::new();
        for (index, machine) in self.plan.machines.iter().enumerate() {
            let place = match self.tables.place(index) {
                Some((member, element)) => Place::element(member, element),
                None => Place::member(&self.vars[index]),
            };
            let code = |step: &StepId| (*step, i64::from(self.plan.place[*step].1));
            let steps = machine.steps.iter().map(code).collect();
            all.push((place, Holds::ActiveOf { steps, none: machine.has_none.then_some(0) }));
            if let Some(cap) = machine.timer_cap {
                let steps = machine.steps.clone();
                all.push((
                    Place::member(&self.timers[index]),
                    Holds::TimeOf { steps, cap, is_zero_between: false },
                ));
            }
        }
        for (id, var) in self.net.vars.iter() {
            let name = &self.names.vars[id];
            match var.len {
                None => all.push((Place::member(name), Holds::Piece(Origin::Var(id), 0))),
                Some(len) => all.extend(
                    (0..len)
                        .map(|at| (Place::element(name, at), Holds::Piece(Origin::Var(id), at))),
                ),
            }
        }
        all.extend(self.framed.iter().flat_map(|it| it.statements.holds(false)));
        for edge in &self.edges {
            let place = Place::member(&self.names.edges[*edge]);
            all.push((place, Holds::Piece(Origin::Edge(*edge), 0)));
        }
        all.extend(fault.then(|| (Place::member("fault"), Holds::Piece(Origin::Fault, 0))));
        all
    }

    pub(super) fn enumerators(&self) -> Vec<Node> {
        let mut nodes = Vec::new();
        for (index, machine) in self.plan.machines.iter().enumerate() {
            let mut body = Vec::new();
            for (position, step) in machine.steps.iter().enumerate() {
                let (_, code) = self.plan.place[*step];
                let comma = if position + 1 == machine.steps.len() { "" } else { "," };
                body.push(
                    Node::line(format!("{} = {code}{comma}", self.step_code(*step)))
                        .note(self.step_note(*step))
                        .about(Object::Step(*step)),
                );
            }
            let member = self.vars[index].clone();
            nodes.push(Node::braced("enum", body).note(format!("values of {member}")));
        }
        if self.plan.machines.iter().any(|machine| machine.has_none) {
            nodes.push(
                Node::braced("enum", vec![Node::line(format!("{} = 0", self.none_code()))])
                    .note("no step of that variable is active"),
            );
        }
        nodes
    }
}
