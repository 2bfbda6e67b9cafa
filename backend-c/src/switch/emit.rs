//! A plan as C.
//!
//! Small charts are one function whose state variables are locals; larger ones are several static functions, each with at most
//! [`Options::max_transitions`] transitions, that share what lives within a reaction in a structure on the stack. A variable with more transitions than
//! that is itself split: its values are dealt to functions by their upper bits.

use super::plan::{Latch, Machine, Plan, receptivity, used_edges};
use super::table::Tables;
use crate::calls::{self, Callee};
use crate::cexpr::{CExpr, Helpers, Prec, Scope, c_expr, saturated, storage};
use crate::consts::{self, Effect};
use crate::cprogram::{CProgram, Member, mentions, with_unused, without_unused};
use crate::ctext::{Arm, Kind, Node, comment_text};
use crate::names::Names;
use crate::times::{Ticks, timer_place, timer_type, unsigned};
use crate::{Object, Options};
use grafsynth_ir::IdMap;
use grafsynth_ir::expr::Type;
use grafsynth_ir::facts::Facts;
use grafsynth_ir::net::{
    Block, Driver, EdgeId, Evolution, Expr, ExternCall, InputId, InputKind, Leaf, Net, OutputId,
    StepId, StmtKind, TransitionId,
};
use std::collections::{BTreeMap, BTreeSet};

/// Everything that is needed to print.
pub(super) struct Emit<'a> {
    pub(super) net: &'a Net,
    pub(super) names: &'a Names,
    pub(super) plan: &'a Plan,
    pub(super) tables: &'a Tables,
    options: &'a Options,
    /// Member (and local) that holds each variable; for a table the element.
    vars: Vec<String>,
    timers: Vec<String>,
    edges: BTreeSet<EdgeId>,
    ticks: Option<Ticks>,
    /// State variables are locals of the one function.
    locals: bool,
    /// `Evolution::Stable`.
    stable: bool,
    helpers: Helpers,
    /// What lives within a reaction: type, name, value at its start or at the start of each micro-step, and a comment.
    scratch: Vec<Scratch>,
    /// Locals of one function: conditions that are asked in one case only.
    case_conditions: BTreeSet<InputId>,
}

/// A value that lives within a reaction.
struct Scratch {
    ty: &'static str,
    name: String,
    init: String,
    /// Set anew in each micro-step.
    each_step: bool,
    note: String,
}

/// Where an expression stands.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Place {
    /// In a receptivity that the variable decides while this step is active; `asked` transitions of the step are known to be not fireable.
    Guard { step: StepId, asked: usize },
    /// In a list of a variable: its active step, if any, and whether its time still counts.
    List { machine: usize, active: Option<StepId>, timed: bool },
    /// In an output, after all variables have moved; the step that carries it is active.
    Output { step: StepId },
    /// In an output, where nothing is known.
    Free,
}

pub(super) fn emit(
    net: &Net,
    facts: &Facts,
    names: &Names,
    plan: &Plan,
    tables: &Tables,
    options: &Options,
) -> CProgram {
    let mut emit = Emit::new(net, names, plan, tables, options);
    emit.program(facts)
}

impl<'a> Emit<'a> {
    fn new(
        net: &'a Net,
        names: &'a Names,
        plan: &'a Plan,
        tables: &'a Tables,
        options: &'a Options,
    ) -> Self {
        let mut members = names.member_namer();
        let coded = (0..plan.machines.len()).filter(|index| !tables.holds(*index)).count();
        let mut vars = Vec::with_capacity(plan.machines.len());
        for (index, machine) in plan.machines.iter().enumerate() {
            vars.push(match tables.element(index) {
                Some(element) => element,
                None if coded == 1 => "state".to_string(),
                None => {
                    let initial = machine.steps.iter().find(|step| net.steps[**step].is_initial);
                    let named = initial.or(machine.steps.first());
                    let word = named.map_or("none", |step| names.steps[*step].as_str());
                    members.name(&format!("state_{word}"))
                }
            });
        }
        let timers = vars
            .iter()
            .map(|var| {
                if var == "state" {
                    members.name("time")
                } else {
                    members.name(&var.replacen("state", "time", 1))
                }
            })
            .collect();
        let cap = plan.machines.iter().filter_map(|machine| machine.timer_cap).max();
        let stable = net.settings.evolution != Evolution::Single;
        let weight: usize = (0..plan.machines.len())
            .filter(|index| !tables.holds(*index))
            .map(|index| weight(plan, &plan.machines[index]))
            .sum();
        let locals = !stable && weight <= options.max_transitions;
        Emit {
            net,
            names,
            plan,
            tables,
            options,
            vars,
            timers,
            edges: used_edges(net),
            ticks: cap.map(Ticks::for_cap),
            locals,
            stable,
            helpers: Helpers::default(),
            scratch: Vec::new(),
            case_conditions: BTreeSet::new(),
        }
    }

    fn program(&mut self, facts: &Facts) -> CProgram {
        self.plan_scratch();
        let mut functions = Vec::new();
        let moves = self.moves(&mut functions);
        let step = self.step_body(facts, moves, &mut functions);
        let init = self.init_body(self.fault_possible(facts));
        let mut tables = self.tables.definitions(self);
        if !self.locals && !self.scratch.is_empty() {
            tables.push(self.scratch_type());
        }
        let fault_possible = self.fault_possible(facts);
        CProgram {
            style: if self.tables.is_empty() { "switch" } else { "switch with tables" },
            instance: self.instance(fault_possible),
            enumerators: self.enumerators(),
            active: IdMap::build(&self.net.steps, |id, _| {
                let (machine, _) = self.plan.place[id];
                format!("self->{} == {}", self.vars[machine], self.step_code(id))
            }),
            fault: fault_possible.then(|| "self->fault".to_string()),
            has_fault: self.stable,
            ticks: self.ticks,
            tables,
            functions,
            init,
            step,
            helpers: self.helpers.clone(),
        }
    }

    // --- names and types -------------------------------------------------------------------------------------------------------------------

    /// The enumerator of a step.
    pub(super) fn step_code(&self, step: StepId) -> String {
        format!("{}_{}", self.names.upper, self.names.steps[step])
    }

    fn none_code(&self) -> String {
        format!("{}_NONE", self.names.upper)
    }

    fn state_type(machine: &Machine) -> &'static str {
        let last = i64::try_from(machine.values().saturating_sub(1)).unwrap_or(i64::MAX);
        storage(Type::Int { lo: 0, hi: last })
    }

    /// How the state variable is read and written where the transitions stand.
    fn var(&self, machine: usize) -> String {
        let name = &self.vars[machine];
        if self.locals && !self.tables.holds(machine) {
            name.clone()
        } else {
            format!("self->{name}")
        }
    }

    fn scan(&self, name: &str) -> String {
        if self.locals { name.to_string() } else { format!("scan->{name}") }
    }

    fn fire_flag(&self, transition: TransitionId) -> String {
        format!("fire_{}", self.names.transitions[transition])
    }

    fn transition_note(&self, transition: TransitionId) -> String {
        let it = &self.net.transitions[transition];
        let mut note = it.name.text.clone();
        if !it.meta.label.is_empty() {
            note.push_str(": ");
            note.push_str(&it.meta.label);
        }
        for req in &it.meta.req {
            note.push_str(" [");
            note.push_str(req);
            note.push(']');
        }
        note
    }

    pub(super) fn step_note(&self, step: StepId) -> String {
        let it = &self.net.steps[step];
        let mut note = String::new();
        if it.name.text != self.names.steps[step] {
            note.push_str(&it.name.text);
        }
        if !it.meta.label.is_empty() {
            note.push_str(if note.is_empty() { "" } else { ": " });
            note.push_str(&it.meta.label);
        }
        for req in &it.meta.req {
            note.push_str(if note.is_empty() { "[" } else { " [" });
            note.push_str(req);
            note.push(']');
        }
        note
    }

    // --- declarations ----------------------------------------------------------------------------------------------------------------------

    fn instance(&self, fault: bool) -> Vec<Member> {
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
                let ty = timer_type(cap);
                members.push(member(
                    format!("{ty} {}", self.timers[index]),
                    "ticks in that step, where they are asked for".to_string(),
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
                "the last reaction did not settle".to_string(),
                Vec::new(),
            ));
        }
        members
    }

    fn enumerators(&self) -> Vec<Node> {
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
            nodes.push(
                Kind::Braces("enum".to_string(), body, ";".to_string())
                    .into_note(&format!("values of {member}")),
            );
        }
        if self.plan.machines.iter().any(|machine| machine.has_none) {
            nodes.push(
                Kind::Braces(
                    "enum".to_string(),
                    vec![Node::line(format!("{} = 0", self.none_code()))],
                    ";".to_string(),
                )
                .into_note("no step of that variable is active"),
            );
        }
        nodes
    }

    /// What lives within a reaction.
    fn plan_scratch(&mut self) {
        let mut scratch = Vec::new();
        let mut add = |ty, name: String, init: &str, each_step, note: &str| {
            scratch.push(Scratch {
                ty,
                name,
                init: init.to_string(),
                each_step,
                note: note.to_string(),
            });
        };
        let conditions: Vec<(InputId, Latch)> =
            self.plan.latches.iter().map(|(id, latch)| (*id, *latch)).collect();
        for (id, latch) in conditions {
            let name = &self.names.inputs[id];
            let ty = storage(self.net.inputs[id].ty);
            let call = format!("{name}()");
            match latch {
                Latch::Always => {
                    add(ty, format!("cond_{name}"), &call, false, "asked once, at the start")
                }
                Latch::OnDemand => {
                    add("bool", format!("asked_{name}"), "false", false, "");
                    add(
                        ty,
                        format!("cond_{name}"),
                        &zero(self.net, id),
                        false,
                        "asked at the first need",
                    );
                }
                Latch::InCase => {}
            }
        }
        let edges: Vec<EdgeId> = self.edges.iter().copied().collect();
        for edge in edges {
            let now =
                c_expr(&self.net.edges[edge].expr, &mut Reader { emit: self, place: Place::Free });
            let was = format!("self->{}", self.names.edges[edge]);
            let name = self.names.edges[edge].trim_start_matches("was_").to_string();
            let (rises, falls) = self.edge_uses(edge);
            if rises {
                let rise =
                    CExpr::and([now.clone(), CExpr::condition(was.clone(), Prec::Atom).not()]);
                add("bool", format!("rise_{name}"), &rise.text, false, "");
            }
            if falls {
                let fall = CExpr::and([now.not(), CExpr::condition(was, Prec::Atom)]);
                add("bool", format!("fall_{name}"), &fall.text, false, "");
            }
        }
        if self.stable {
            if self.net.inputs.values().any(|input| input.kind == InputKind::Event) {
                add(
                    "bool",
                    "first".to_string(),
                    "true",
                    false,
                    "events hold in the first micro-step",
                );
            }
            add("bool", "fired".to_string(), "false", true, "something fired in this micro-step");
        }
        for (id, _) in self.net.transitions.iter() {
            if self.plan.is_wide[id] && self.needs_flag(id) {
                add("bool", self.fire_flag(id), "false", true, &self.transition_note(id));
            }
        }
        for (index, machine) in self.plan.machines.iter().enumerate() {
            let var = &self.vars[index];
            if machine.is_entered {
                add(
                    Self::state_type(machine),
                    format!("enter_{var}"),
                    &self.none_code(),
                    true,
                    "the step that a fork adds",
                );
            }
            if machine.needs_old || (machine.is_entered && machine.timer_cap.is_some()) {
                let value = format!("self->{var}");
                add(
                    Self::state_type(machine),
                    format!("old_{var}"),
                    &value,
                    true,
                    "as it was at the start",
                );
            }
        }
        self.scratch = scratch;
    }

    /// True where another variable than the owner loses a step to the transition.
    fn needs_flag(&self, transition: TransitionId) -> bool {
        let owner = self.plan.owner[transition];
        let others = self.net.transitions[transition]
            .requires
            .iter()
            .any(|step| Some(self.plan.place[*step].0) != owner);
        owner.is_some() && others
    }

    fn edge_uses(&self, wanted: EdgeId) -> (bool, bool) {
        let mut uses = (false, false);
        let mut expressions: Vec<&Expr> =
            self.net.transitions.values().map(|it| &it.guard).collect();
        for step in self.net.steps.values() {
            super::plan::block_expressions(&step.entry, &mut expressions);
            super::plan::block_expressions(&step.exit, &mut expressions);
        }
        for transition in self.net.transitions.values() {
            super::plan::block_expressions(&transition.actions, &mut expressions);
        }
        for expr in expressions {
            expr.for_each_leaf(&mut |leaf| match *leaf {
                Leaf::Rise(edge) => uses.0 |= edge == wanted,
                Leaf::Fall(edge) => uses.1 |= edge == wanted,
                Leaf::Input(_)
                | Leaf::Var(_)
                | Leaf::Active(_)
                | Leaf::Elapsed(_)
                | Leaf::LastElapsed(_)
                | Leaf::TasksDone(_)
                | Leaf::Timer(_)
                | Leaf::Fireable(_)
                | Leaf::Controlled(_) => {}
            });
        }
        uses
    }

    fn scratch_type(&self) -> Node {
        let body = self
            .scratch
            .iter()
            .map(|it| Node::line(format!("{} {};", it.ty, it.name)).note(it.note.clone()))
            .collect();
        let name = format!("{}_scan_t", self.names.prefix);
        Kind::Braces("typedef struct".to_string(), body, format!(" {name};"))
            .into_note("what lives within one reaction")
    }

    /// Sets what lives within a reaction, or within a micro-step.
    fn scratch_values(&self, each_step: bool, in_step: bool) -> Vec<Node> {
        self.scratch
            .iter()
            .filter(|it| it.each_step == each_step)
            .map(|it| {
                let init = if in_step { self.in_step(&it.init) } else { it.init.clone() };
                if self.locals {
                    let is_const =
                        !it.each_step && !it.name.starts_with("asked_") && !it.init.eq("false");
                    let qualifier =
                        if is_const || it.name.starts_with("old_") { "const " } else { "" };
                    let node = Node::line(format!("{qualifier}{} {} = {init};", it.ty, it.name))
                        .note(it.note.clone());
                    if init.ends_with("()") {
                        node.defining_by(&it.name, format!("(void){init};"))
                    } else {
                        node.defining(&it.name)
                    }
                } else {
                    let access = if in_step { "scan." } else { "scan->" };
                    Node::line(format!("{access}{} = {init};", it.name))
                }
            })
            .collect()
    }

    // --- transitions -----------------------------------------------------------------------------------------------------------------------

    /// The statements that move all variables; in the split form they call the functions that are added to `functions`.
    fn moves(&mut self, functions: &mut Vec<Node>) -> Vec<Node> {
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
        for (index, machine) in self.plan.machines.iter().enumerate() {
            if machine.is_entered {
                calls.push(self.deferred(index, machine));
            }
        }
        calls.extend(self.tables.moves(self, functions));
        calls
    }

    fn close_group(
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

    /// Adds a static function with the parameters that its body uses, and returns the call of it.
    fn private_function(
        &mut self,
        name: &str,
        mut body: Vec<Node>,
        functions: &mut Vec<Node>,
    ) -> Node {
        let prefix = &self.names.prefix;
        let mut declared: Vec<Node> = Vec::new();
        for input in std::mem::take(&mut self.case_conditions) {
            declared.push(self.case_condition(input));
        }
        declared.append(&mut body);
        let body = without_unused(declared);
        let mut parameters = vec![format!("{prefix}_t *self")];
        let mut arguments = vec!["self"];
        if mentions(&body, "in") {
            parameters.push(format!("const {prefix}_in_t *in"));
            arguments.push("in");
        }
        if mentions(&body, "scan") {
            parameters.push(format!("{prefix}_scan_t *scan"));
            arguments.push(if self.stable { "scan" } else { "&scan" });
        }
        functions
            .push(Node::function(format!("static void {name}({})", parameters.join(", ")), body));
        functions.push(Node::blank());
        Node::line(format!("{name}({});", arguments.join(", ")))
    }

    /// The local for a condition that is asked in one case only.
    fn case_condition(&self, input: InputId) -> Node {
        let name = format!("cond_{}", self.names.inputs[input]);
        let ty = storage(self.net.inputs[input].ty);
        Node::line(format!("{ty} {name} = {};", zero(self.net, input))).defining(name)
    }

    /// A variable with too many transitions: one function for each range of its values.
    fn split_machine(&mut self, index: usize, functions: &mut Vec<Node>) -> Node {
        let machine = &self.plan.machines[index];
        let cap = self.options.max_transitions.max(1);
        // The widest power of two of values that keeps every range below the bound.
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
            cases.push(
                Kind::Case(vec![format!("case {range}:")], vec![call, Node::line("break;")]).into(),
            );
        }
        cases.push(self.default_case(machine));
        Node::block(format!("switch (self->{} >> {shift})", self.vars[index]), cases)
    }

    fn default_case(&self, machine: &Machine) -> Node {
        let mut heads = Vec::new();
        let mut body = Vec::new();
        let _ = machine;
        heads.push("default:".to_string());
        body.push(Node::line(format!("{}_BAD_STATE(self);", self.names.upper)));
        body.push(Node::line("break;"));
        Kind::Case(heads, body).into()
    }

    /// The `switch` of one variable (or of a range of its values).
    fn machine(&mut self, index: usize, range: Option<(usize, u32)>) -> Vec<Node> {
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
        // A variable of one step is a question, not a choice.
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
        cases.push(self.default_case(machine));
        vec![Node::block(format!("switch ({})", self.var(index)), cases)]
    }

    /// What happens while `step` is active.
    fn case(&mut self, index: usize, step: StepId) -> Vec<Node> {
        let mut nodes = Vec::new();
        let mut arms: Vec<Arm> = Vec::new();
        let mut settled = None;
        let transitions = self.plan.leaving[step].clone();
        let (own, foreign): (Vec<_>, Vec<_>) =
            transitions.iter().copied().partition(|id| self.plan.owner[*id] == Some(index));
        for id in foreign {
            let body = self.effects(index, id, step);
            let head = format!("if ({})", self.scan(&self.fire_flag(id)));
            arms.push(Arm::new(head, body).noted(self.transition_note(id), Object::Transition(id)));
        }
        for id in own {
            for node in self.ask(id, step) {
                // Several transitions of the step may ask for the same.
                if !nodes.contains(&node) {
                    nodes.push(node);
                }
            }
            let condition = self.condition(index, id, step);
            if condition.is_false() {
                continue;
            }
            let body = self.effects(index, id, step);
            if condition.is_true() {
                settled = Some(
                    Arm::new("else", body).noted(self.transition_note(id), Object::Transition(id)),
                );
                break;
            }
            let head = format!("if ({})", condition.text);
            arms.push(Arm::new(head, body).noted(self.transition_note(id), Object::Transition(id)));
        }
        if arms.is_empty() {
            if let Some(arm) = settled {
                nodes.push(Node::comment(arm.note.clone()).about_all(arm.objects.clone()));
                nodes.extend(arm.body);
            }
            return nodes;
        }
        for arm in arms.iter_mut().skip(1) {
            arm.head = format!("else {}", arm.head);
        }
        arms.extend(settled.filter(|arm| !arm.body.is_empty()));
        nodes.push(Kind::Block(arms).into());
        nodes
    }

    /// Calls the extern conditions that a transition mentions, where they are not called at the start.
    fn ask(&mut self, id: TransitionId, step: StepId) -> Vec<Node> {
        let mut mentioned = BTreeSet::new();
        self.net.transitions[id].guard.for_each_leaf(&mut |leaf| {
            if let Leaf::Input(input) = leaf {
                mentioned.insert(*input);
            }
        });
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

    fn demand(&self, input: InputId, when: Vec<CExpr>) -> Node {
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

    /// Calls, where they are not called yet, the conditions that a list or an output mentions.
    fn demand_all(&self, expressions: &[&Expr], when: &[CExpr]) -> Vec<Node> {
        let mut mentioned = BTreeSet::new();
        for expr in expressions {
            expr.for_each_leaf(&mut |leaf| {
                if let Leaf::Input(input) = leaf {
                    mentioned.insert(*input);
                }
            });
        }
        mentioned
            .into_iter()
            .filter(|input| self.plan.latches.get(input) == Some(&Latch::OnDemand))
            .map(|input| self.demand(input, when.to_vec()))
            .collect()
    }

    /// The steps of other variables that a transition takes, as conditions.
    fn other_sources(&self, id: TransitionId, owner: usize) -> Vec<CExpr> {
        let mut seen = BTreeSet::new();
        self.net.transitions[id]
            .requires
            .iter()
            .filter(|step| self.plan.place[**step].0 != owner && seen.insert(**step))
            .map(|step| self.is_active(*step, owner))
            .collect()
    }

    /// The condition that a step of another variable was active at the start of the micro-step, seen from `reader`.
    fn is_active(&self, step: StepId, reader: usize) -> CExpr {
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

    /// When a transition fires, given that `step` is active and those before it in the case do not fire.
    fn condition(&mut self, owner: usize, id: TransitionId, step: StepId) -> CExpr {
        let asked = self.plan.leaving[step].iter().position(|it| *it == id).unwrap_or(0);
        let mut all = self.other_sources(id, owner);
        let net = self.net;
        let guard = receptivity(net, id);
        all.push(c_expr(&guard, &mut Reader { emit: self, place: Place::Guard { step, asked } }));
        let policy_competes = net.settings.policy != grafsynth_ir::net::Policy::All;
        if policy_competes {
            let mut seen = BTreeSet::from([id]);
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
                            // The plan lets no rival through that looks at its own rivals.
                            let place = Place::Guard { step: other, asked };
                            let fires =
                                c_expr(&receptivity(net, rival), &mut Reader { emit: self, place });
                            all.push(fires.not());
                        }
                        None => {}
                    }
                }
            }
        }
        CExpr::and(all)
    }

    /// What firing does to one variable whose `step` is active, and, at the owner, everything else that it does.
    fn effects(&mut self, index: usize, id: TransitionId, step: StepId) -> Vec<Node> {
        let plan = self.plan;
        let net = self.net;
        let transition = &net.transitions[id];
        let is_owner = plan.owner[id] == Some(index);
        let target = plan.added(net, id, index);
        let stays = target == Some(step) && !transition.restart;
        let mut nodes = Vec::new();
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
            if plan.is_wide[id] {
                if self.needs_flag(id) {
                    nodes.push(Node::line(format!("{} = true;", self.scan(&self.fire_flag(id)))));
                }
                for entered in super::plan::entered(transition) {
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

    /// Adds what forks left for a variable that they take nothing from.
    fn deferred(&self, index: usize, machine: &Machine) -> Node {
        let entry = if self.stable {
            "scan->"
        } else if self.locals {
            ""
        } else {
            "scan."
        };
        let enter = format!("{entry}enter_{}", self.vars[index]);
        let var = self.var(index);
        let mut body = Vec::new();
        if machine.timer_cap.is_some() {
            let old = format!("{entry}old_{}", self.vars[index]);
            let reset = Node::line(format!("self->{} = 0;", self.timers[index]));
            body.push(Node::when(&format!("{enter} != {old}"), vec![reset]));
        }
        body.push(Node::line(format!("{var} = {enter};")));
        Node::when(&format!("{enter} != {}", self.none_code()), body)
    }

    // --- lists -----------------------------------------------------------------------------------------------------------------------------

    fn block(&mut self, block: &Block, place: Place) -> Vec<Node> {
        let mut expressions = Vec::new();
        super::plan::block_expressions(block, &mut expressions);
        let mut nodes = self.demand_all(&expressions, &[]);
        nodes.extend(self.statements(block, place));
        nodes
    }

    fn statements(&mut self, block: &Block, place: Place) -> Vec<Node> {
        let net = self.net;
        let mut nodes = Vec::new();
        for stmt in block {
            match &stmt.kind {
                StmtKind::Assign { var, index, value } => {
                    let ty = net.vars[*var].ty;
                    let value = c_expr(value, &mut Reader { emit: self, place });
                    let value = saturated(value, ty, &self.names.prefix, &mut self.helpers);
                    let name = &self.names.vars[*var];
                    let target = match index {
                        None => format!("self->{name}"),
                        Some(index) => {
                            let index = c_expr(index, &mut Reader { emit: self, place });
                            format!("self->{}[{}]", self.names.vars[*var], index.text)
                        }
                    };
                    nodes.push(
                        Node::line(format!("{target} = {};", value.stored_as(ty)))
                            .about(Object::Var(*var)),
                    );
                }
                StmtKind::Call { output, arguments } => {
                    let values = arguments
                        .iter()
                        .map(|argument| c_expr(argument, &mut Reader { emit: self, place }))
                        .collect();
                    nodes.push(self.call(*output, values));
                }
                StmtKind::If { condition, then, otherwise } => {
                    let condition = c_expr(condition, &mut Reader { emit: self, place });
                    let then = self.statements(then, place);
                    let otherwise = self.statements(otherwise, place);
                    nodes.extend(calls::either(condition, then, otherwise));
                }
                StmtKind::Code(text) => nodes.extend(calls::verbatim(text)),
                // The plan refuses nets that raise or send.
                StmtKind::Raise(_) | StmtKind::Send(_) | StmtKind::Cancel(_) => {}
            }
        }
        nodes
    }

    fn call(&mut self, output: OutputId, arguments: Vec<CExpr>) -> Node {
        let callee = Callee { net: self.net, names: self.names, output };
        callee.call(arguments, &mut self.helpers)
    }

    // --- the whole step --------------------------------------------------------------------------------------------------------------------

    fn step_body(
        &mut self,
        facts: &Facts,
        moves: Vec<Node>,
        functions: &mut Vec<Node>,
    ) -> Vec<Node> {
        let mut body = Vec::new();
        if !self.locals && !self.scratch.is_empty() {
            body.push(Node::line(format!("{}_scan_t scan;", self.names.prefix)));
        }
        for (index, machine) in self.plan.machines.iter().enumerate() {
            if self.locals && !self.tables.holds(index) {
                body.push(Node::line(format!(
                    "{} {1} = self->{1};",
                    Self::state_type(machine),
                    self.vars[index]
                )));
            }
        }
        for input in std::mem::take(&mut self.case_conditions) {
            body.push(self.case_condition(input));
        }
        body.extend(self.tables.words(self));
        body.extend(self.scratch_values(false, true));
        if !self.stable && self.locals {
            body.extend(self.scratch_values(true, true));
        }
        body.extend(self.timer_updates());
        if !self.stable && !self.locals {
            body.extend(self.scratch_values(true, true));
        }
        body.extend(self.outputs(true));
        if self.stable {
            body.extend(self.settle(facts, moves, functions));
        } else {
            body.extend(moves);
        }
        if self.locals {
            for index in 0..self.plan.machines.len() {
                if !self.tables.holds(index) {
                    body.push(Node::line(format!("self->{0} = {0};", self.vars[index])));
                }
            }
        }
        body.extend(self.outputs(false));
        for (id, step) in self.net.steps.iter() {
            let texts: Vec<Node> = step.code.iter().flat_map(calls::verbatim).collect();
            if !texts.is_empty() {
                let active =
                    format!("{} == {}", self.var(self.plan.place[id].0), self.step_code(id));
                body.push(
                    Node::when(&active, texts).note(self.step_note(id)).about(Object::Step(id)),
                );
            }
        }
        for edge in self.edges.clone() {
            let now =
                c_expr(&self.net.edges[edge].expr, &mut Reader { emit: self, place: Place::Free });
            body.push(Node::line(format!(
                "self->{} = {};",
                self.names.edges[edge],
                self.in_step(&now.text)
            )));
        }
        let mut body = without_unused(body);
        if !self.locals && !self.scratch.is_empty() && !mentions(&body, "&scan") {
            body.push(Node::line("(void)scan;"));
        }
        body
    }

    /// In the function `NAME_step` the shared structure is a local, everywhere else a parameter.
    fn in_step(&self, text: &str) -> String {
        if self.locals { text.to_string() } else { text.replace("scan->", "scan.") }
    }

    /// Time passes for the active steps.
    fn timer_updates(&mut self) -> Vec<Node> {
        let mut nodes = Vec::new();
        for (index, machine) in self.plan.machines.iter().enumerate() {
            let Some(cap) = machine.timer_cap else { continue };
            self.helpers.later = true;
            let timer = &self.timers[index];
            let ticks = self.ticks.map_or("", Ticks::name);
            let cast = if timer_type(cap) == ticks {
                String::new()
            } else {
                format!("({})", timer_type(cap))
            };
            let prefix = &self.names.prefix;
            let cap = unsigned(cap);
            nodes.push(Node::line(format!(
                "self->{timer} = {cast}{prefix}_later(self->{timer}, dt, {cap});"
            )));
        }
        nodes
    }

    /// The loop of a stable evolution.
    fn settle(&mut self, facts: &Facts, moves: Vec<Node>, functions: &mut Vec<Node>) -> Vec<Node> {
        let prefix = &self.names.prefix;
        let Evolution::Stable { limit } = self.net.settings.evolution else { return moves };
        let mut micro = self.scratch_values(true, false);
        micro.extend(moves);
        let mut micro = with_unused(&["self", "scan"], without_unused(micro));
        micro.push(Node::line("return scan->fired;"));
        let mut parameters = vec![format!("{prefix}_t *self")];
        let mut arguments = vec!["self"];
        if mentions(&micro, "in") {
            parameters.push(format!("const {prefix}_in_t *in"));
            arguments.push("in");
        }
        parameters.push(format!("{prefix}_scan_t *scan"));
        arguments.push("&scan");
        let call = format!("{prefix}_fire({})", arguments.join(", "));
        functions.push(Node::comment("One micro-step; false when nothing fires."));
        functions.push(Node::function(
            format!("static bool {prefix}_fire({})", parameters.join(", ")),
            micro,
        ));
        functions.push(Node::blank());
        let counter = storage(Type::Int { lo: 0, hi: i64::from(limit) });
        let bound = unsigned(i64::from(limit));
        let mut round = vec![Node::line("++rounds;")];
        for it in &self.scratch {
            let ends =
                it.name == "first" || it.name.starts_with("rise_") || it.name.starts_with("fall_");
            if !it.each_step && ends {
                round.push(Node::line(format!("scan.{} = false;", it.name)));
            }
        }
        let mut nodes = vec![
            Node::line(format!("{counter} rounds = 0;")),
            Node::block(format!("while (rounds < {bound} && {call})"), round),
        ];
        if self.fault_possible(facts) {
            nodes.push(Node::line("self->fault = false;"));
            let trial = call.replacen("self", "&trial", 1);
            nodes.push(Node::when(
                &format!("rounds == {bound}"),
                vec![
                    Node::comment("The limit: what would fire next is only asked, on a copy."),
                    Node::line(format!("{prefix}_t trial = *self;")),
                    Node::line(format!("self->fault = {trial};")),
                ],
            ));
        }
        nodes
    }

    /// Whether a reaction may reach the limit with something left to fire.
    fn fault_possible(&self, facts: &Facts) -> bool {
        match self.net.settings.evolution {
            Evolution::Single => false,
            Evolution::Stable { limit } => {
                facts.stable_depth.as_ref().is_none_or(|depth| depth.value > limit)
            }
        }
    }

    // --- outputs ---------------------------------------------------------------------------------------------------------------------------

    /// The assignments of the outputs: those before the micro-step (`mealy`), or all others.
    fn outputs(&mut self, mealy: bool) -> Vec<Node> {
        let net = self.net;
        let mut nodes = Vec::new();
        let mut by_step: BTreeMap<StepId, Vec<Node>> = BTreeMap::new();
        for (id, output) in net.outputs.iter() {
            let name = format!("out->{}", self.names.outputs[id]);
            match &output.driver {
                Driver::Continuous(emissions) | Driver::Mealy(emissions) => {
                    if matches!(output.driver, Driver::Mealy(_)) != mealy {
                        continue;
                    }
                    let mut terms: Vec<CExpr> =
                        self.tables.output_bit(id, mealy).into_iter().collect();
                    for emission in emissions {
                        if self.tables.emits(emission.step) && !mealy {
                            continue;
                        }
                        let expressions: Vec<&Expr> = emission.condition.iter().collect();
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
                            let set =
                                Node::line(format!("{name} = true;")).about(Object::Output(id));
                            let demands = self.demand_all(&expressions, &[]);
                            let list = by_step.entry(emission.step).or_default();
                            list.extend(demands.into_iter().map(|it| self.node_in_step(it)));
                            let text = self.in_step(&condition.text);
                            list.push(if condition.is_true() {
                                set
                            } else {
                                Node::when(&text, vec![set])
                            });
                        } else {
                            let demands =
                                self.demand_all(&expressions, std::slice::from_ref(&active));
                            nodes.extend(demands.into_iter().map(|it| self.node_in_step(it)));
                            terms.push(CExpr::and([active, condition]));
                        }
                    }
                    let value = CExpr::or(terms);
                    nodes.push(
                        Node::line(format!("{name} = {};", self.in_step(&value.text)))
                            .about(Object::Output(id)),
                    );
                }
                Driver::Stored(var) if !mealy => {
                    nodes.push(
                        Node::line(format!("{name} = self->{};", self.names.vars[*var]))
                            .about(Object::Output(id)),
                    );
                }
                Driver::Extern { calls, .. } if !mealy && !calls.is_empty() => {
                    let mut arms = Vec::new();
                    // Where one variable asks for all calls, at most one step does at a time.
                    let machines: BTreeSet<usize> =
                        calls.iter().map(|it| self.plan.place[it.step].0).collect();
                    let mut calls: Vec<&ExternCall> = calls.iter().collect();
                    // The first active step in declaration order gives the arguments.
                    calls.sort_by_key(|call| call.step);
                    let by_case = machines.len() == 1
                        && machines.iter().all(|it| self.by_case(*it))
                        && calls.windows(2).all(|pair| pair[0].step != pair[1].step);
                    for call in calls {
                        let place = Place::Output { step: call.step };
                        let active = self.now_active(call.step);
                        let expressions: Vec<&Expr> =
                            call.condition.iter().chain(&call.arguments).collect();
                        if by_case {
                            let demands = self.demand_all(&expressions, &[]);
                            let list = by_step.entry(call.step).or_default();
                            list.extend(demands.into_iter().map(|it| self.node_in_step(it)));
                        } else {
                            let demands =
                                self.demand_all(&expressions, std::slice::from_ref(&active));
                            nodes.extend(demands.into_iter().map(|it| self.node_in_step(it)));
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
                        let statement = self.node_in_step(statement);
                        if by_case {
                            let text = self.in_step(&condition.text);
                            let list = by_step.entry(call.step).or_default();
                            if condition.is_true() {
                                list.push(statement);
                            } else if !condition.is_false() {
                                list.push(Node::when(&text, vec![statement]));
                            }
                            continue;
                        }
                        let head = CExpr::and([active, condition]);
                        arms.push((head, statement, call.step));
                    }
                    nodes.extend(self.call_chain(id, arms));
                }
                Driver::Stored(_) | Driver::Extern { .. } | Driver::Controlled(_) => {}
            }
        }
        nodes.extend(self.output_cases(by_step));
        nodes
    }

    /// A continuous call: once, with the arguments of the first step that asks for it.
    fn call_chain(&self, output: OutputId, arms: Vec<(CExpr, Node, StepId)>) -> Vec<Node> {
        let mut chain: Vec<Arm> = Vec::new();
        let plain = arms.iter().all(|(_, statement, _)| statement.kind == arms[0].1.kind);
        if plain && let Some((_, statement, _)) = arms.first() {
            let objects: Vec<Object> =
                arms.iter().map(|(_, _, step)| Object::Step(*step)).collect();
            let any = CExpr::or(arms.iter().map(|(head, _, _)| head.clone()).collect::<Vec<_>>());
            if any.is_false() {
                return Vec::new();
            }
            let mut node = Node::when(&self.in_step(&any.text), vec![statement.clone()])
                .about(Object::Output(output));
            node.objects.extend(objects);
            return vec![node];
        }
        for (head, statement, step) in arms {
            if head.is_false() {
                continue;
            }
            let word = if chain.is_empty() { "if" } else { "else if" };
            let mut arm =
                Arm::new(format!("{word} ({})", self.in_step(&head.text)), vec![statement]);
            arm.objects = vec![Object::Output(output), Object::Step(step)];
            chain.push(arm);
        }
        if chain.is_empty() { Vec::new() } else { vec![Kind::Block(chain).into()] }
    }

    /// Whether a variable's outputs are set in a `switch` of their own: its cost is that of one step, not of all.
    fn by_case(&self, machine: usize) -> bool {
        !self.tables.holds(machine) && self.plan.machines[machine].values() > 8
    }

    fn output_cases(&self, by_step: BTreeMap<StepId, Vec<Node>>) -> Vec<Node> {
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

    /// The condition that a step is active now, in `NAME_step`.
    fn now_active(&self, step: StepId) -> CExpr {
        let (machine, _) = self.plan.place[step];
        CExpr::condition(
            format!("{} == {}", self.var(machine), self.step_code(step)),
            Prec::Compare,
        )
    }

    fn node_in_step(&self, mut node: Node) -> Node {
        if self.locals {
            return node;
        }
        match &mut node.kind {
            Kind::Line(text) => *text = text.replace("scan->", "scan."),
            Kind::Block(arms) => {
                for arm in arms {
                    arm.head = arm.head.replace("scan->", "scan.");
                    let body = std::mem::take(&mut arm.body);
                    arm.body = body.into_iter().map(|it| self.node_in_step(it)).collect();
                }
            }
            Kind::Blank
            | Kind::Comment(_)
            | Kind::Verbatim(_)
            | Kind::Directive(_)
            | Kind::Case(..)
            | Kind::Nested(_)
            | Kind::Function(..)
            | Kind::Braces(..) => {}
        }
        node
    }

    // --- reset -----------------------------------------------------------------------------------------------------------------------------

    fn init_body(&mut self, fault: bool) -> Vec<Node> {
        let net = self.net;
        let reset = consts::reset(net);
        let mut nodes = self.tables.init(self);
        for (index, machine) in self.plan.machines.iter().enumerate() {
            if self.tables.holds(index) {
                continue;
            }
            let initial = machine.steps.iter().copied().find(|step| net.steps[*step].is_initial);
            let code = match (initial, machine.has_none) {
                (Some(step), _) => self.step_code(step),
                (None, true) => self.none_code(),
                (None, false) => "0".to_string(),
            };
            nodes.push(
                Node::line(format!("self->{} = {code};", self.vars[index]))
                    .about_all(initial.map(Object::Step)),
            );
        }
        for (index, machine) in self.plan.machines.iter().enumerate() {
            if machine.timer_cap.is_some() {
                nodes.push(Node::line(format!("self->{} = 0;", self.timers[index])));
            }
        }
        for (id, var) in net.vars.iter() {
            let name = format!("self->{}", self.names.vars[id]);
            nodes.extend(calls::initial(&name, var.ty, var.len, &reset.vars[id.index()]));
        }
        for edge in &self.edges {
            nodes.push(Node::line(format!("self->{} = false;", self.names.edges[*edge])));
        }
        if fault {
            nodes.push(Node::line("self->fault = false;"));
        }
        nodes.extend(calls::initial_outputs(net, self.names, &reset.outputs));
        for effect in reset.effects {
            match effect {
                Effect::Call(output, values) => {
                    nodes.push(self.call(output, values.into_iter().map(CExpr::int).collect()));
                }
                Effect::Code(text) => nodes.extend(calls::verbatim(&text)),
            }
        }
        nodes
    }
}

impl Kind {
    /// As a node with a comment.
    pub(super) fn into_note(self, note: &str) -> Node {
        let mut node: Node = self.into();
        node.note = comment_text(note);
        node
    }
}

/// The number of transitions that are decided at a variable, at least 1.
fn weight(plan: &Plan, machine: &Machine) -> usize {
    machine.steps.iter().map(|step| plan.leaving[*step].len()).sum::<usize>().max(1)
}

/// The transitions in each range of `2^shift` values.
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

/// Looking for equal cases is quadratic, so it is done for small variables only.
fn shared_cases(plan: &Plan, machine: usize) -> bool {
    plan.machines[machine].steps.len() <= 256
}

/// What an input has before it is read.
fn zero(net: &Net, input: InputId) -> String {
    let ty = net.inputs[input].ty;
    calls::constant(ty.saturate(0), ty)
}

/// Reads leaves at a place.
struct Reader<'e, 'a> {
    emit: &'e mut Emit<'a>,
    place: Place,
}

impl Reader<'_, '_> {
    fn active(&self, step: StepId) -> CExpr {
        let emit = &self.emit;
        let (machine, _) = emit.plan.place[step];
        match self.place {
            Place::Guard { step: own, .. } if emit.plan.place[own].0 == machine => {
                CExpr::bool(own == step)
            }
            Place::Guard { step: own, .. } => emit.is_active(step, emit.plan.place[own].0),
            Place::List { machine: own, active, .. } if own == machine => {
                CExpr::bool(active == Some(step))
            }
            Place::List { .. } | Place::Free => emit.now_active(step),
            Place::Output { step: own } if emit.plan.place[own].0 == machine => {
                CExpr::bool(own == step)
            }
            Place::Output { .. } => emit.now_active(step),
        }
    }

    fn elapsed(&self, step: StepId) -> CExpr {
        let emit = &self.emit;
        let (machine, _) = emit.plan.place[step];
        let cap = emit.plan.machines[machine].timer_cap.unwrap_or(0);
        let time = timer_place(&format!("self->{}", emit.timers[machine]), cap);
        match self.place {
            Place::List { machine: own, timed: false, .. } if own == machine => CExpr::int(0),
            Place::Guard { .. } | Place::List { .. } | Place::Output { .. } | Place::Free => {
                CExpr::select(self.active(step), time, CExpr::int(0))
            }
        }
    }
}

impl Scope<Leaf> for Reader<'_, '_> {
    fn leaf(&mut self, leaf: &Leaf) -> CExpr {
        let net = self.emit.net;
        match *leaf {
            Leaf::Input(input) => {
                let name = &self.emit.names.inputs[input];
                match net.inputs[input].kind {
                    InputKind::Pin => CExpr::place(format!("in->{name}"), net.inputs[input].ty),
                    InputKind::Extern => match self.emit.plan.latches.get(&input) {
                        Some(Latch::InCase) => {
                            CExpr::place(format!("cond_{name}"), net.inputs[input].ty)
                        }
                        Some(Latch::Always | Latch::OnDemand) | None => CExpr::place(
                            self.emit.scan(&format!("cond_{name}")),
                            net.inputs[input].ty,
                        ),
                    },
                    InputKind::Event => {
                        let event = CExpr::condition(format!("in->{name}"), Prec::Atom);
                        if self.emit.stable {
                            CExpr::and([
                                CExpr::condition(self.emit.scan("first"), Prec::Atom),
                                event,
                            ])
                        } else {
                            event
                        }
                    }
                    // Nothing raises it: the plan refuses nets that do.
                    InputKind::InternalEvent => CExpr::bool(false),
                }
            }
            Leaf::Var(var) => {
                CExpr::place(format!("self->{}", self.emit.names.vars[var]), net.vars[var].ty)
            }
            Leaf::Active(step) => self.active(step),
            // There are no tasks in this style, so they are done at once.
            Leaf::TasksDone(step) => self.active(step),
            Leaf::Elapsed(step) => self.elapsed(step),
            Leaf::Rise(edge) => self.edge("rise", edge),
            Leaf::Fall(edge) => self.edge("fall", edge),
            Leaf::Fireable(rival) => {
                let Place::Guard { step, asked } = self.place else { return CExpr::bool(false) };
                let position = self.emit.plan.leaving[step].iter().position(|it| *it == rival);
                match position {
                    // It was asked before and did not fire, or it leaves another step of the same variable.
                    None => CExpr::bool(false),
                    Some(position) if position < asked => CExpr::bool(false),
                    Some(position) => {
                        let place = Place::Guard { step, asked: position };
                        let guard = receptivity(net, rival);
                        c_expr(&guard, &mut Reader { emit: self.emit, place })
                    }
                }
            }
            // The plan refuses these.
            Leaf::LastElapsed(_) | Leaf::Timer(_) => CExpr::int(0),
            Leaf::Controlled(_) => CExpr::bool(false),
        }
    }

    fn element(&mut self, array: &Leaf, index: &CExpr) -> CExpr {
        let Leaf::Var(var) = *array else { return CExpr::int(0) };
        CExpr::place(
            format!("self->{}[{}]", self.emit.names.vars[var], index.text),
            self.emit.net.vars[var].ty,
        )
    }
}

impl Reader<'_, '_> {
    fn edge(&self, word: &str, edge: EdgeId) -> CExpr {
        let name = self.emit.names.edges[edge].trim_start_matches("was_");
        CExpr::condition(self.emit.scan(&format!("{word}_{name}")), Prec::Atom)
    }
}
