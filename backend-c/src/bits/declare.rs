//! Declarations: the members of the instance, the data that functions share, and the locals of each function.

use super::Emit;
use super::outline::Home;
use crate::Object;
use crate::c::print::Node;
use crate::cexpr::constant;
use crate::range::Range;
use crate::style_output::Member;
use grafsynth_c::storage;
use grafsynth_ir::Gather;
use grafsynth_ir::instance::{Carried, Holds, Local, LocalPart, Place};
use grafsynth_ir::net::StepId;
use grafsynth_ir::program::{Cell, Origin, SharedTimer, TempId, TempRole};
use std::collections::BTreeSet;

impl Emit<'_> {
    /// The value range of each member; Booleans are single bits, except in arrays.
    pub(crate) fn ranges(&self) -> Vec<Range> {
        let here = self.program.cells.iter().filter(|(id, _)| !self.elsewhere.contains_key(id));
        here.filter(|(_, cell)| !cell.ty.is_bool() || cell.len.is_some())
            .map(|(id, cell)| {
                let (lo, hi) = cell.ty.bounds();
                let whole = Range::of(self.cells[id].clone(), storage(cell.ty), lo, hi);
                let is_count =
                    matches!(cell.origin, Origin::InternalLength | Origin::ExternalLength);
                Range { elements: cell.len.map(|len| (0, len)), is_count, ..whole }
            })
            .collect()
    }

    /// The contents of each scalar of the instance.
    pub(crate) fn holds(&self, fault: bool) -> Vec<(Place, Holds)> {
        let here = self.program.cells.iter().filter(|(id, _)| !self.elsewhere.contains_key(id));
        let mut all = Vec::new();
        for (id, cell) in here {
            let name = &self.cells[id];
            if let Origin::SharedElapsed(first) = cell.origin {
                let is_own = |timer: &&SharedTimer| timer.steps.iter().any(|it| it.0 == first);
                if let Some(timer) = self.program.shared_timers.iter().find(is_own) {
                    let steps = timer.steps.iter().map(|(step, _)| *step).collect();
                    let holds = Holds::TimeOf { steps, cap: timer.cap, is_zero_between: true };
                    all.push((Place::member(name), holds));
                }
                continue;
            }
            match cell.len {
                None => all.push((Place::member(name), Holds::Piece(cell.origin, 0))),
                Some(len) => all.extend(
                    (0..len).map(|at| (Place::element(name, at), Holds::Piece(cell.origin, at))),
                ),
            }
        }
        all.extend(fault.then(|| (Place::member("fault"), Holds::Piece(Origin::Fault, 0))));
        all
    }

    /// The local of `NAME_step` that stores a temp, as the proof finds it.
    fn local(&self, temp: TempId) -> Option<Local> {
        let name = self.temps[temp].clone();
        match self.homes[temp] {
            // Its value is written instead.
            _ if self.constants.contains_key(&temp) => None,
            Home::Here | Home::Local(0) => Some(Local { name, part: LocalPart::Whole }),
            Home::Shared => Some(Local { name: "scan".to_owned(), part: LocalPart::Member(name) }),
            Home::Local(_) | Home::Nowhere => None,
        }
    }

    /// The locals of `NAME_step` that carry something from check to check of a statechart.
    pub(crate) fn carried(&self, carried: &[(TempId, Carried)]) -> Vec<(Local, Carried)> {
        let temps = carried.iter();
        let mut all: Vec<(Local, Carried)> =
            temps.filter_map(|(id, what)| Some((self.local(*id)?, what.clone()))).collect();
        for input in &self.lazy {
            let condition = &self.names.inputs[*input];
            for (word, what) in
                [("asked", Carried::Asked(*input)), ("cond", Carried::Answer(*input))]
            {
                let name = format!("{word}_{condition}");
                let local = match self.is_split {
                    true => Local { name: "scan".to_owned(), part: LocalPart::Member(name) },
                    false => Local { name, part: LocalPart::Whole },
                };
                all.push((local, what));
            }
        }
        all
    }

    /// Steps that are stored as single bits of the instance.
    pub(crate) fn one_bit(&self) -> BTreeSet<StepId> {
        let here = self.step_cells.iter().filter(|(_, cell)| !self.elsewhere.contains_key(cell));
        here.map(|(step, _)| *step).gather()
    }

    pub(crate) fn instance(&self, fault: bool) -> Vec<Member> {
        let mut members: Vec<(usize, Member)> = Vec::new();
        for (id, cell) in self.program.cells.iter() {
            if self.elsewhere.contains_key(&id) {
                continue;
            }
            let name = &self.cells[id];
            let ty = storage(cell.ty);
            let declaration = match cell.len {
                Some(len) => format!("{ty} {name}[{len}]"),
                None if cell.ty.is_bool() => format!("bool {name} : 1"),
                None => format!("{ty} {name}"),
            };
            let note = if cell.name == *name { String::new() } else { cell.name.clone() };
            members.push((
                width(cell),
                Member { declaration, note, objects: objects_of(cell.origin) },
            ));
        }
        // Wide members first, so that none of them needs padding.
        members.sort_by_key(|(width, _)| std::cmp::Reverse(*width));
        let mut members: Vec<Member> = members.into_iter().map(|(_, member)| member).collect();
        if fault {
            members.push(Member {
                declaration: "bool fault : 1".to_string(),
                note: "the last reaction did not become stable, or a queue was full".to_string(),
                objects: Vec::new(),
            });
        }
        members
    }

    /// Data that functions share: temps that several of them use, and extern conditions if there are several functions.
    pub(crate) fn shared_members(&self) -> Vec<Node> {
        let mut nodes = Vec::new();
        for (id, temp) in self.program.temps.iter() {
            if self.homes[id] == Home::Shared {
                // On the stack of a small machine, one bit each is worth the extra cycles.
                let bits = if temp.ty.is_bool() { " : 1" } else { "" };
                let declaration = format!("{} {}{bits};", storage(temp.ty), self.temps[id]);
                nodes.push(Node::line(declaration).about_all(objects_of_role(temp.role)));
            }
        }
        if self.is_split {
            for input in self.eager.iter().chain(&self.lazy) {
                let name = &self.names.inputs[*input];
                nodes.push(Node::line(format!(
                    "{} cond_{name};",
                    storage(self.net.inputs[*input].ty)
                )));
                if self.lazy.contains(input) {
                    nodes.push(Node::line(format!("bool asked_{name};")));
                }
            }
        }
        nodes
    }

    /// Temps that are local to the current function but must be declared at its start.
    pub(crate) fn locals(&self) -> Vec<Node> {
        self.program
            .temps
            .iter()
            .filter(|(id, _)| self.homes[*id] == Home::Local(self.function))
            .map(|(id, temp)| {
                let zero = constant(temp.ty.saturate(0), temp.ty);
                Node::line(format!("{} {} = {zero};", storage(temp.ty), self.temps[id]))
                    .defining(&self.temps[id])
            })
            .collect()
    }

    /// Statements at the start of a reaction for the extern conditions: a call or, for one that is called when first needed, a variable and a cleared flag.
    pub(crate) fn conditions(&self) -> Vec<Node> {
        let mut nodes = Vec::new();
        for input in self.eager.iter().chain(&self.lazy) {
            let name = &self.names.inputs[*input];
            let ty = self.net.inputs[*input].ty;
            let (declare, cond) = match self.is_split {
                true => (String::new(), self.shared(&format!("cond_{name}"))),
                false => (format!("{} ", storage(ty)), format!("cond_{name}")),
            };
            if self.eager.contains(input) {
                let call =
                    Node::line(format!("{declare}{cond} = {name}();")).about(Object::Input(*input));
                nodes.push(call.defining_by(&cond, format!("(void){name}();")));
            } else {
                let declare_asked = if self.is_split { "" } else { "bool " };
                let asked = if self.is_split {
                    self.shared(&format!("asked_{name}"))
                } else {
                    format!("asked_{name}")
                };
                let zero = constant(ty.saturate(0), ty);
                nodes.push(Node::line(format!("{declare}{cond} = {zero};")).defining(&cond));
                nodes.push(Node::line(format!("{declare_asked}{asked} = false;")).defining(&asked));
            }
        }
        nodes
    }
}

/// Bytes of one element; 0 for a bit.
fn width(cell: &Cell) -> usize {
    match storage(cell.ty) {
        "int64_t" => 8,
        "int32_t" | "uint32_t" => 4,
        "int16_t" | "uint16_t" => 2,
        "bool" if cell.len.is_none() => 0,
        _ => 1,
    }
}

#[allow(clippy::wildcard_enum_match_arm, reason = "only the map of the emitted text shows them")]
pub(super) fn objects_of(origin: Origin) -> Vec<Object> {
    match origin {
        Origin::Step(step)
        | Origin::Region(step)
        | Origin::Elapsed(step)
        | Origin::SharedElapsed(step)
        | Origin::LastElapsed(step)
        | Origin::TaskIndex(step)
        | Origin::Recorded(_, step) => vec![Object::Step(step)],
        Origin::Older(a, b) => vec![Object::Step(a), Object::Step(b)],
        Origin::Var(var) => vec![Object::Var(var)],
        Origin::Timer(timer) | Origin::TimerCondition(timer) => vec![Object::Timer(timer)],
        Origin::ActionQ(action)
        | Origin::ActionLatch(action, _)
        | Origin::ActionTimer(action, _) => {
            vec![Object::Action(action)]
        }
        Origin::Pending(input) => vec![Object::Input(input)],
        Origin::HeldOutput(output, _) => vec![Object::Output(output)],
        _ => Vec::new(),
    }
}

pub(super) fn objects_of_role(role: TempRole) -> Vec<Object> {
    match role {
        TempRole::Fireable(transition) | TempRole::Fire(transition) => {
            vec![Object::Transition(transition)]
        }
        TempRole::NextActive(step) | TempRole::Activated(step) | TempRole::Deactivated(step) => {
            vec![Object::Step(step)]
        }
        TempRole::Holds(input) => vec![Object::Input(input)],
        TempRole::Before(var) => vec![Object::Var(var)],
        TempRole::EdgeNow(_) | TempRole::Helper => Vec::new(),
    }
}
