//! Prints a plan as C.
//!
//! Small charts are one function whose state variables are locals; larger ones are several static functions, each with at most
//! [`Options::max_transitions`] transitions, that share the data of one reaction in a structure on the stack. A variable with more transitions than
//! that is itself split: its values are distributed to functions by their upper bits.

mod declare;
mod frame;
mod masks;
mod moves;
mod outputs;
mod read;

use super::plan::{self, Latch, Machine, Plan};
use super::table::Tables;
use crate::c::print::{Arm, Kind, Node};
use crate::calls;
use crate::cexpr::{CExpr, Helpers, Prec};
use crate::names::Names;
use crate::style_output::{StyleOutput, mentions, with_unused, without_unused};
use crate::times::{Ticks, count_type, unsigned};
use crate::{Object, Options, trace};
use frame::Framed;
pub(super) use frame::Surroundings;
use grafsynth_c::storage;
use grafsynth_ir::Gather;
use grafsynth_ir::IdMap;
use grafsynth_ir::facts::Facts;
use grafsynth_ir::net::{
    EdgeId, Evolution, Expr, InputId, InputKind, Leaf, Net, StepId, TransitionId,
};
use grafsynth_ir::plan::Needs;
use moves::weight;
use read::Place;
use std::collections::BTreeSet;

/// All data needed to print the C code.
pub(super) struct Emit<'a> {
    pub(super) net: &'a Net,
    pub(super) names: &'a Names,
    pub(super) plan: &'a Plan,
    pub(super) tables: &'a Tables,
    pub(super) options: &'a Options,
    /// The member (and local) of each variable; for a table, the element.
    vars: Vec<String>,
    timers: Vec<String>,
    edges: BTreeSet<EdgeId>,
    ticks: Option<Ticks>,
    /// True if state variables are locals of the one function.
    locals: bool,
    /// True for `Evolution::Stable`.
    stable: bool,
    /// True while code of `NAME_step` is written, where the shared structure is a local; it is a parameter of all other functions.
    in_step: bool,
    helpers: Helpers,
    /// The data of one reaction: type, name, value at its start or at the start of each micro-step, and a comment.
    scratch: Vec<Scratch>,
    /// The outputs of each step, for outputs that are bits.
    masks: masks::Masks,
    /// The tables of these masks.
    mask_tables: Vec<Node>,
    /// The conditions that are called in one case only, which are locals of one function.
    case_conditions: BTreeSet<InputId>,
    /// Controlled actions, free timers and the values after reset; `None` only while they are printed.
    framed: Option<Framed<'a>>,
}

/// A value within one reaction.
struct Scratch {
    ty: &'static str,
    name: String,
    init: Init,
    note: String,
}

impl Scratch {
    fn new(ty: &'static str, name: String, init: Init, note: &str) -> Self {
        Scratch { ty, name, init, note: note.to_string() }
    }
}

/// The value that a [`Scratch`] has at first.
enum Init {
    /// A condition that is called at the start of the reaction: its call.
    Call(String),
    /// A condition that is called when it is first needed: the value before that.
    Later(String),
    /// Whether such a condition was called: not yet.
    NotAsked,
    /// An edge of an expression, or the first micro-step: it ends with the first micro-step.
    FirstOnly(CExpr),
    /// Nothing has fired yet.
    NotFired,
    /// No step has been entered by a fork yet: the code of no step.
    None(String),
    /// The value of a variable at the start.
    Old(String),
}

impl Init {
    fn text(&self) -> &str {
        match self {
            Init::Call(text) | Init::Later(text) | Init::None(text) | Init::Old(text) => text,
            Init::NotAsked | Init::NotFired => "false",
            Init::FirstOnly(value) => &value.text,
        }
    }

    /// True if it is set again in each micro-step.
    fn is_of_each_step(&self) -> bool {
        matches!(self, Init::NotFired | Init::None(_) | Init::Old(_))
    }

    /// True if nothing assigns the value later, so that it can be a constant local.
    fn is_const(&self) -> bool {
        match self {
            Init::Call(_) | Init::Old(_) => true,
            Init::FirstOnly(value) => !value.is_false(),
            Init::Later(_) | Init::NotAsked | Init::NotFired | Init::None(_) => false,
        }
    }
}

pub(super) fn emit(
    net: &Net,
    facts: &Facts,
    names: &Names,
    plan: &Plan,
    tables: &Tables,
    options: &Options,
    surroundings: &Surroundings,
) -> StyleOutput {
    let mut emit = Emit::new(net, names, plan, tables, options, surroundings);
    emit.program(facts)
}

impl<'a> Emit<'a> {
    fn new(
        net: &'a Net,
        names: &'a Names,
        plan: &'a Plan,
        tables: &'a Tables,
        options: &'a Options,
        surroundings: &'a Surroundings,
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
        let mut emit = Emit {
            net,
            names,
            plan,
            tables,
            options,
            vars,
            timers,
            edges: Needs::of(net, false)
                .edge
                .iter()
                .filter(|(_, used)| **used)
                .map(|(edge, _)| edge)
                .gather(),
            ticks: cap.map(Ticks::for_cap),
            locals,
            stable,
            in_step: true,
            helpers: Helpers::default(),
            scratch: Vec::new(),
            masks: masks::Masks::new(),
            mask_tables: Vec::new(),
            case_conditions: BTreeSet::new(),
            framed: None,
        };
        emit.masks = emit.step_masks();
        let framed = Framed::new(&emit, surroundings, members);
        let longest = [emit.ticks, framed.statements.ticks].into_iter().flatten();
        emit.ticks = longest.reduce(|a, b| Ticks { short: a.short && b.short });
        emit.framed = Some(framed);
        emit
    }

    fn program(&mut self, facts: &Facts) -> StyleOutput {
        self.print_frame();
        self.plan_scratch();
        let mut functions =
            self.framed.as_mut().map(|it| std::mem::take(&mut it.functions)).unwrap_or_default();
        self.in_step = false;
        let moves = self.moves(&mut functions);
        self.in_step = true;
        let step = self.step_body(facts, moves, &mut functions);
        let init = self.init_body(self.fault_possible(facts));
        let mut tables = self.tables.definitions(self);
        tables.append(&mut self.mask_tables);
        if self.has_scan() {
            tables.push(self.scratch_type());
        }
        if let Some(framed) = &self.framed {
            self.helpers.add(&framed.statements.helpers);
        }
        let fault_possible = self.fault_possible(facts);
        StyleOutput {
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
            engine: None,
            ranges: self.ranges(fault_possible),
            holds: self.holds(fault_possible),
            locals: Vec::new(),
            one_bit: BTreeSet::new(),
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
        count_type(last)
    }

    /// How the state variable is read and written in the code of the transitions.
    fn var(&self, machine: usize) -> String {
        let name = &self.vars[machine];
        if self.locals && !self.tables.holds(machine) {
            name.clone()
        } else {
            format!("self->{name}")
        }
    }

    /// How a value within one reaction is read and written in the function that is being written.
    fn scan(&self, name: &str) -> String {
        match (self.locals, self.in_step) {
            (true, _) => name.to_string(),
            (false, true) => format!("scan.{name}"),
            (false, false) => format!("scan->{name}"),
        }
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

    /// The names that locals of the reaction may have.
    fn local_names(&self) -> Vec<String> {
        let mut all: Vec<String> = Vec::new();
        all.extend(["first", "fired", "rounds", "trial", "scan"].map(str::to_owned));
        all.extend((0..self.names.io.output_words()).map(|word| self.names.io.lit(word)));
        for var in &self.vars {
            all.extend([var.clone(), format!("enter_{var}"), format!("old_{var}")]);
        }
        for (input, _) in self.net.inputs.iter() {
            let name = &self.names.inputs[input];
            all.extend([format!("cond_{name}"), format!("asked_{name}")]);
        }
        for (edge, _) in self.net.edges.iter() {
            let name = self.names.edges[edge].trim_start_matches("was_");
            all.extend([format!("rise_{name}"), format!("fall_{name}")]);
        }
        all.extend(self.net.transitions.ids().map(|id| self.fire_flag(id)));
        all
    }

    /// Collects the data of one reaction.
    fn plan_scratch(&mut self) {
        let mut scratch = Vec::new();
        for (id, latch) in self.plan.latches.clone() {
            let name = &self.names.inputs[id];
            let ty = storage(self.net.inputs[id].ty);
            let (init, note) = match latch {
                Latch::Always => (Init::Call(format!("{name}()")), "called once, at the start"),
                Latch::OnDemand => {
                    scratch.push(Scratch::new("bool", format!("asked_{name}"), Init::NotAsked, ""));
                    (Init::Later(zero(self.net, id)), "called when first needed")
                }
                Latch::InCase => continue,
            };
            scratch.push(Scratch::new(ty, format!("cond_{name}"), init, note));
        }
        for edge in self.edges.clone() {
            let now = self.value(&self.net.edges[edge].expr, Place::Free);
            let was = CExpr::condition(format!("self->{}", self.names.edges[edge]), Prec::Atom);
            let name = self.names.edges[edge].trim_start_matches("was_");
            let (rises, falls) = self.edge_uses(edge);
            let rise = rises.then(|| ("rise", CExpr::and([now.clone(), was.clone().not()])));
            let fall = falls.then(|| ("fall", CExpr::and([now.not(), was])));
            for (which, value) in rise.into_iter().chain(fall) {
                let init = Init::FirstOnly(value);
                scratch.push(Scratch::new("bool", format!("{which}_{name}"), init, ""));
            }
        }
        if self.stable {
            if self.net.inputs.values().any(|input| input.kind == InputKind::Event) {
                let note = "events are present in the first micro-step";
                let init = Init::FirstOnly(CExpr::bool(true));
                scratch.push(Scratch::new("bool", "first".to_string(), init, note));
            }
            let note = "something fired in this micro-step";
            scratch.push(Scratch::new("bool", "fired".to_string(), Init::NotFired, note));
        }
        for id in self.net.transitions.ids().filter(|id| self.needs_flag(*id)) {
            let note = self.transition_note(id);
            scratch.push(Scratch::new("bool", self.fire_flag(id), Init::NotFired, &note));
        }
        for (index, machine) in self.plan.machines.iter().enumerate() {
            let (ty, var) = (Self::state_type(machine), &self.vars[index]);
            if machine.is_entered {
                let init = Init::None(self.none_code());
                let note = "the step that a fork adds";
                scratch.push(Scratch::new(ty, format!("enter_{var}"), init, note));
            }
            // Tables move their variables after all others have read them.
            let is_read_later = machine.needs_old && !self.tables.holds(index);
            if is_read_later || (machine.is_entered && machine.timer_cap.is_some()) {
                let init = Init::Old(format!("self->{var}"));
                let note = "as it was at the start";
                scratch.push(Scratch::new(ty, format!("old_{var}"), init, note));
            }
        }
        self.scratch = scratch;
    }

    /// True if the reaction records that the transition fires: a variable other than the owner loses a step to it, or an output shows it.
    fn needs_flag(&self, transition: TransitionId) -> bool {
        let owner = self.plan.owner[transition];
        let others = self.net.transitions[transition]
            .requires
            .iter()
            .any(|step| Some(self.plan.place[*step].0) != owner);
        owner.is_some() && (others || self.plan.is_shown[transition])
    }

    fn edge_uses(&self, wanted: EdgeId) -> (bool, bool) {
        let guards = self.net.transitions.values().map(|transition| &transition.guard);
        let mut uses = (false, false);
        for leaf in guards.chain(plan::list_exprs(self.net)).flat_map(Expr::leaves) {
            uses.0 |= *leaf == Leaf::Rise(wanted);
            uses.1 |= *leaf == Leaf::Fall(wanted);
        }
        uses
    }

    /// True if functions share data of one reaction.
    fn has_scan(&self) -> bool {
        (!self.locals && !self.scratch.is_empty())
            || self.framed.as_ref().is_some_and(|it| !it.shared.is_empty())
    }

    fn scratch_type(&self) -> Node {
        let own = self.scratch.iter().filter(|_| !self.locals);
        let body = own
            .map(|it| Node::line(format!("{} {};", it.ty, it.name)).note(it.note.clone()))
            .chain(self.framed.iter().flat_map(|it| it.shared.iter().cloned()))
            .collect();
        let name = format!("{}_scan_t", self.names.prefix);
        Node::typedef("struct", body, name).note("data of one reaction")
    }

    /// Sets the data of one reaction, or of one micro-step.
    fn scratch_values(&self, each_step: bool) -> Vec<Node> {
        self.scratch
            .iter()
            .filter(|it| it.init.is_of_each_step() == each_step)
            .map(|it| {
                let init = it.init.text();
                if self.locals {
                    let qualifier = if it.init.is_const() { "const " } else { "" };
                    let node = Node::line(format!("{qualifier}{} {} = {init};", it.ty, it.name))
                        .note(it.note.clone());
                    if let Init::Call(call) = &it.init {
                        node.defining_by(&it.name, format!("(void){call};"))
                    } else {
                        node.defining(&it.name)
                    }
                } else {
                    Node::line(format!("{} = {init};", self.scan(&it.name)))
                }
            })
            .collect()
    }

    // --- the whole step --------------------------------------------------------------------------------------------------------------------

    fn step_body(
        &mut self,
        facts: &Facts,
        moves: Vec<Node>,
        functions: &mut Vec<Node>,
    ) -> Vec<Node> {
        let mut body = Vec::new();
        if self.has_scan() {
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
        for word in 0..self.names.io.output_words() {
            let (ty, lit) = (self.names.io.output_type(), self.names.io.lit(word));
            body.push(Node::line(format!("{ty} {lit} = 0;")).note("the outputs, one bit each"));
        }
        body.extend(self.tables.words(self));
        body.extend(self.scratch_values(false));
        if !self.stable && self.locals {
            body.extend(self.scratch_values(true));
        }
        body.extend(self.timer_updates());
        if let Some(framed) = &mut self.framed {
            body.append(&mut framed.locals);
            body.append(&mut framed.before);
        }
        if !self.stable && !self.locals {
            body.extend(self.scratch_values(true));
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
        if let Some(framed) = &mut self.framed {
            body.append(&mut framed.after);
        }
        body.extend(self.outputs(false));
        body.extend(self.step_texts());
        body.extend(self.renewed_edges());
        let mut body = without_unused(body);
        if self.has_scan() && !mentions(&body, "&scan") {
            body.push(Node::line("(void)scan;"));
        }
        body
    }

    /// The user's C texts of the active steps.
    fn step_texts(&self) -> Vec<Node> {
        let mut nodes = Vec::new();
        for (id, step) in self.net.steps.iter() {
            let texts: Vec<Node> = step.code.iter().flat_map(calls::verbatim).collect();
            if !texts.is_empty() {
                let active =
                    format!("{} == {}", self.var(self.plan.place[id].0), self.step_code(id));
                nodes.push(
                    Node::when(&active, texts).note(self.step_note(id)).about(Object::Step(id)),
                );
            }
        }
        nodes
    }

    /// Stores the operands of edges for the next reaction.
    fn renewed_edges(&mut self) -> Vec<Node> {
        let mut nodes = Vec::new();
        for edge in self.edges.clone() {
            let now = self.value(&self.net.edges[edge].expr, Place::Free);
            nodes.push(Node::line(format!("self->{} = {};", self.names.edges[edge], now.text)));
        }
        nodes
    }

    /// Advances the time of the active steps.
    fn timer_updates(&mut self) -> Vec<Node> {
        let mut nodes = Vec::new();
        for (index, machine) in self.plan.machines.iter().enumerate() {
            let Some(cap) = machine.timer_cap else { continue };
            self.helpers.later = true;
            let timer = &self.timers[index];
            let ticks = self.ticks.map_or("", Ticks::name);
            let cast = if count_type(cap) == ticks {
                String::new()
            } else {
                format!("({})", count_type(cap))
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
        self.in_step = false;
        let mut micro = self.scratch_values(true);
        self.in_step = true;
        if self.options.trace.is_some() {
            micro.push(trace::micro_step());
        }
        micro.extend(moves);
        let mut micro = with_unused(&["self", "scan"], without_unused(micro));
        micro.push(Node::line("return scan->fired;"));
        let (mut parameters, mut arguments) = self.parameters(&micro);
        parameters.push(format!("{prefix}_scan_t *scan"));
        arguments.push("&scan");
        let call = format!("{prefix}_fire({})", arguments.join(", "));
        functions.push(Node::comment("One micro-step; false when nothing fires."));
        functions.push(Node::function(
            format!("static bool {prefix}_fire({})", parameters.join(", ")),
            micro,
        ));
        functions.push(Node::blank());
        let counter = count_type(i64::from(limit));
        let bound = unsigned(i64::from(limit));
        let mut round = vec![Node::line("++rounds;")];
        for it in &self.scratch {
            if matches!(it.init, Init::FirstOnly(_)) {
                round.push(Node::line(format!("scan.{} = false;", it.name)));
            }
        }
        let mut nodes = vec![
            Node::line(format!("{counter} rounds = 0;")),
            Kind::Block(vec![Arm {
                at_most: facts.stable_depth.as_ref().map(|depth| depth.value.into()),
                ..Arm::new(format!("while ((rounds < {bound}) && {call})"), round)
            }])
            .into(),
        ];
        if self.fault_possible(facts) {
            nodes.push(Node::line("self->fault = false;"));
            let trial = call.replacen("self", "&trial", 1);
            nodes.push(Node::when(
                &format!("rounds == {bound}"),
                vec![
                    Node::comment("At the limit, a copy is used to test whether another transition would fire."),
                    Node::line(format!("{prefix}_t trial;")),
                    Node::line("trial = *self;"),
                    Node::line(format!("self->fault = {trial};")),
                ],
            ));
        }
        nodes
    }

    /// Whether a reaction may reach the limit while a transition can still fire.
    fn fault_possible(&self, facts: &Facts) -> bool {
        match self.net.settings.evolution {
            Evolution::Single => false,
            Evolution::Stable { limit } => {
                facts.stable_depth.as_ref().is_none_or(|depth| depth.value > limit)
            }
        }
    }

    // --- reset -----------------------------------------------------------------------------------------------------------------------------

    fn init_body(&mut self, fault: bool) -> Vec<Node> {
        let net = self.net;
        let vars = self.framed.as_ref().map(Framed::variables_after_reset).unwrap_or_default();
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
            nodes.extend(calls::initial(&name, var.ty, var.len, &vars[id.index()]));
        }
        for edge in &self.edges {
            nodes.push(Node::line(format!("self->{} = false;", self.names.edges[*edge])));
        }
        if fault {
            nodes.push(Node::line("self->fault = false;"));
        }
        if let Some(framed) = &mut self.framed {
            nodes.extend(framed.statements.init(false));
        }
        nodes
    }
}

/// The value of an input before it is read.
fn zero(net: &Net, input: InputId) -> String {
    let ty = net.inputs[input].ty;
    crate::cexpr::constant(ty.saturate(0), ty)
}
