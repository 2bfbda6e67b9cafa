//! The style `statechart`: one small state variable for each region, and a `switch` on it for each event.
//!
//! ```text
//! NAME_step            timers, events of the row; while an event waits: NAME_move; outputs
//! NAME_move            switch (event): NAME_on_EVENT
//! NAME_on_EVENT        the transition that each region offers, the selection (§4); then exits, actions, entries (§3.9, S1 to S4)
//! NAME_REGION_on_EVENT the number of the region's first fireable transition: switch (state variable)
//! NAME_REGION_leave    exit lists, histories
//! NAME_REGION_act      actions of the transition
//! NAME_REGION_enter    entry lists, and the new value of the state variable
//! ```
//!
//! Outer transitions are found at compile time: each is listed once, in a `switch` whose labels are all atomic states below its source. Everything
//! outside the evolution (timers, queues, the end of a reaction) comes from the reaction program, in pieces ([`grafsynth_ir::lower::program::pieces`]).
// A variant that an emitter forgets is a miscompile.
#![warn(clippy::wildcard_enum_match_arm)]

mod choose;
mod enter;
mod fire;
mod plan;
mod tables;
mod text;

use crate::bits::Emit as Statements;
use crate::bits::outline::{Piece, cut, homes};
use crate::bits::{NODES_PER_TRANSITION, gives_fault};
use crate::c::print::{Arm, Kind, Node};
use crate::calls;
use crate::cexpr::{CExpr, Prec};
use crate::names::Names;
use crate::range::Range;
use crate::refusal::Failure;
use crate::style_output::{Member, StyleOutput, mentions, without_unused};
use crate::times::{count_type, unsigned};
use crate::{Object, Options};
use grafsynth_ir::expr::{CompareOp, Type};
use grafsynth_ir::facts::Facts;
use grafsynth_ir::instance::{Holds, Place};
use grafsynth_ir::lower::program::{Pieces, pieces};
use grafsynth_ir::names::Namer;
use grafsynth_ir::net::{Enter, Evolution, HistoryId, InputId, Net, StepId, Transition};
use grafsynth_ir::program::{Expr, Program, Stmt};
use grafsynth_ir::{IdMap, Valid};
use plan::{Memory, Plan};
use std::collections::{BTreeMap, BTreeSet};

/// The net in this style.
///
/// # Errors
/// If the style does not support something in the net, or the net has no reaction program.
pub(crate) fn program(
    net: &Valid<Net>,
    facts: &Facts,
    names: &Names,
    options: &Options,
) -> Result<StyleOutput, Failure> {
    let mut plan = plan::plan(net).map_err(Failure::Refused)?;
    let pieces = pieces(net).map_err(Failure::Errors)?;
    for (step, state) in pieces.states.iter() {
        if state.completes && !state.is_watched {
            plan.regions[plan.region_of[step]].drops = true;
        }
    }
    // Everything that is read or set, in one list for the analyses.
    let mut analysed = pieces.program.clone();
    analysed.body = everything(&pieces);
    let limit = options.max_transitions.saturating_mul(NODES_PER_TRANSITION).max(1);
    let mut bodies = vec![of_evolution(&pieces)];
    let before = cut(&pieces.before, limit, &mut bodies);
    let after = cut(&pieces.after, limit, &mut bodies);
    let mut round: Vec<Piece<'_>> = pieces.check.iter().map(Piece::Whole).collect();
    for list in [&pieces.idle, &pieces.too_long, &pieces.fired, &pieces.renew] {
        let inner = list.iter().map(Piece::Whole).collect();
        round.push(Piece::If(&pieces.is_full, inner, Vec::new()));
    }
    let mut main: Vec<Piece<'_>> = before;
    let n_before = main.len();
    main.push(Piece::Repeat(pieces.rounds, &pieces.again, round));
    main.extend(after);
    let homes = homes(&analysed, &main, &bodies);

    let mut members = names.member_namer();
    let variables = variables(net, &plan, names, &mut members);
    let memories = memories(net, &plan, &mut members);
    let mut statements = Statements::new(net, names, &analysed, homes, members, &[]);
    statements.is_split = true;
    statements.proved_rounds = facts.most_rounds(net).map(|rounds| rounds.value.into());
    statements.sets_fault = net.settings.evolution != Evolution::Single
        && (pieces.program.reset_fault || analysed.body.iter().any(gives_fault));
    let mut emit = Emit {
        net,
        names,
        plan: &plan,
        pieces: &pieces,
        options,
        variables,
        memories,
        fires: fires(net, names),
        statements,
        functions: Vec::new(),
        taken: function_namer(net, names),
        exits: BTreeMap::new(),
        shared: BTreeSet::new(),
        enters: BTreeMap::new(),
        paths: BTreeMap::new(),
        entry_lists: BTreeMap::new(),
        restores: BTreeMap::new(),
        tables: BTreeMap::new(),
        target: None,
        entries: BTreeMap::new(),
    };
    emit.keep_elsewhere();
    let after = main.split_off(n_before + 1);
    main.truncate(n_before);
    Ok(emit.program(&main, &after, &bodies))
}

/// Everything that a reaction may run, including its conditions.
fn everything(pieces: &Pieces) -> Vec<Stmt> {
    let mut all = Vec::new();
    for list in [
        &pieces.before,
        &pieces.check,
        &pieces.idle,
        &pieces.too_long,
        &pieces.fired,
        &pieces.renew,
        &pieces.after,
    ] {
        all.extend(list.iter().cloned());
    }
    for state in pieces.states.values() {
        for list in [&state.exit, &state.entry, &state.initial_content, &state.finish] {
            all.extend(list.iter().cloned());
        }
    }
    for transition in pieces.transitions.values() {
        all.extend(transition.actions.iter().cloned());
        all.push(Stmt::If(transition.guard.clone(), Vec::new(), Vec::new()));
    }
    all.extend(pieces.default_content.values().flatten().cloned());
    all
}

/// The code that runs while a statechart evolves: guards, transition actions, and the lists of the states. When temps are assigned to functions, all of it
/// counts as one function.
fn of_evolution(pieces: &Pieces) -> Vec<Piece<'_>> {
    let mut lists: Vec<&Vec<Stmt>> = Vec::new();
    for state in pieces.states.values() {
        lists.extend([&state.exit, &state.entry, &state.initial_content, &state.finish]);
    }
    lists.extend(pieces.transitions.values().map(|transition| &transition.actions));
    lists.extend(pieces.default_content.values());
    let asked = pieces.transitions.values().map(|it| Piece::If(&it.guard, Vec::new(), Vec::new()));
    let always: &Expr = &pieces.is_full;
    let lists = lists
        .into_iter()
        .filter(|list| !list.is_empty())
        .map(|list| Piece::If(always, list.iter().map(Piece::Whole).collect(), Vec::new()));
    asked.chain(lists).collect()
}

/// The member that stores each region's state; `None` for a region that has only one.
fn variables(net: &Net, plan: &Plan, names: &Names, members: &mut Namer) -> Vec<Option<String>> {
    let n_variables = plan.regions.iter().filter(|region| region.has_variable()).count();
    let mut all = Vec::new();
    for region in &plan.regions {
        all.push(region.has_variable().then(|| {
            if n_variables == 1 {
                return "state".to_owned();
            }
            match region.parent {
                Some(_) => members.name(&names.steps[region.root]),
                None => members.name(&net.parts[region.part].name.text),
            }
        }));
    }
    all
}

/// The members of each history.
fn memories(
    net: &Net,
    plan: &Plan,
    members: &mut Namer,
) -> BTreeMap<HistoryId, Vec<(usize, String)>> {
    let mut all = BTreeMap::new();
    for (id, memory) in &plan.memories {
        let name = &net.histories[*id].name.text;
        let kept = match memory {
            Memory::One(region, _) => vec![(*region, members.name(name))],
            Memory::All(_) => vec![(usize::MAX, members.name(name))],
            Memory::Deep(regions) => regions
                .iter()
                .map(|region| {
                    let root = &net.steps[plan.regions[*region].root].name.text;
                    (*region, members.name(&format!("{name}_{root}")))
                })
                .collect(),
        };
        all.insert(*id, kept);
    }
    all
}

/// Enumerators of the transitions; names that are already used with the prefix are avoided.
fn fires(net: &Net, names: &Names) -> IdMap<Transition, String> {
    let mut namer = names.suffix_namer();
    let mut all = IdMap::filled(&net.transitions, String::new());
    for (id, name) in names.transitions.iter() {
        all[id] = format!("{}_{}", names.upper, namer.name(&format!("FIRE_{name}")));
    }
    all
}

/// Names of functions after the prefix.
fn function_namer(net: &Net, names: &Names) -> Namer {
    let mut namer = names.suffix_namer();
    for word in [
        "init", "step", "stop", "fault", "move", "t", "in_t", "out_t", "scan_t", "notify", "safe",
        "stopped", "intact",
    ] {
        namer.reserve(word);
    }
    for (id, _) in net.steps.iter() {
        namer.reserve(&format!("active_{}", names.steps[id]));
    }
    for (id, _) in net.vars.iter() {
        namer.reserve(&format!("var_{}", names.vars[id]));
    }
    namer
}

/// All data needed to print a statechart.
pub(super) struct Emit<'a> {
    net: &'a Net,
    names: &'a Names,
    plan: &'a Plan,
    pieces: &'a Pieces,
    options: &'a Options,
    variables: Vec<Option<String>>,
    memories: BTreeMap<HistoryId, Vec<(usize, String)>>,
    fires: IdMap<Transition, String>,
    statements: Statements<'a>,
    /// Functions so far, callees first.
    functions: Vec<Node>,
    taken: Namer,
    /// The call that exits each region.
    exits: BTreeMap<usize, fire::Exit>,
    /// States that are entered together with the same other states in more than one place.
    shared: BTreeSet<(StepId, Vec<Enter>)>,
    /// The functions that enter these states.
    enters: BTreeMap<(StepId, Vec<Enter>), text::Function>,
    /// The function of each region that enters an atomic state with its ancestors.
    paths: BTreeMap<usize, text::Function>,
    /// Functions for long entry lists.
    entry_lists: BTreeMap<StepId, text::Function>,
    /// Functions that enter the states that a history has recorded.
    restores: BTreeMap<HistoryId, text::Function>,
    /// Constant tables by type and contents.
    tables: BTreeMap<(&'static str, Vec<usize>), tables::Table>,
    /// While the entry of a transition is printed: the expression that replaces the constant of the atomic state in its region.
    target: Option<(usize, String)>,
    /// The entries of the transitions of each region.
    entries: BTreeMap<usize, enter::Entries>,
}

impl Emit<'_> {
    /// Makes step bits and recorded states expressions over the state variables.
    fn keep_elsewhere(&mut self) {
        for (step, _) in self.net.steps.iter() {
            if !self.pieces.states[step].is_watched {
                let active = self.is_active(step);
                self.statements.elsewhere.insert(self.pieces.bits[step], active);
            }
        }
        for cell in self.pieces.recorded.values().flatten() {
            self.statements.elsewhere.insert(*cell, CExpr::bool(false));
        }
    }

    /// The condition that a state is active, read from the state variables.
    fn is_active(&self, step: StepId) -> CExpr {
        let index = self.plan.region_of[step];
        let region = &self.plan.regions[index];
        let Some(variable) = &self.variables[index] else { return CExpr::bool(true) };
        let (first, last) = self.plan.range[step];
        let n = region.terminals.len();
        // Compared as numbers, to detect contradictions; printed with names.
        let number = |it: usize| i64::try_from(it).unwrap_or(i64::MAX);
        let lowest = i64::from(region.is_always);
        let ask = |op: CompareOp, at: usize| {
            let ty = Type::Int { lo: lowest, hi: number(n) };
            let place = CExpr::place(format!("self->{variable}"), ty);
            let mut asked = CExpr::compare(op, place, CExpr::int(number(at)));
            if asked.constant().is_none() && at > 0 {
                let sign = match op {
                    CompareOp::Eq => "==",
                    CompareOp::Ge => ">=",
                    CompareOp::Le => "<=",
                    CompareOp::Ne | CompareOp::Lt | CompareOp::Gt => return asked,
                };
                asked.text = format!("self->{variable} {sign} {}", self.terminal(index, at));
            }
            asked
        };
        if first == last {
            return ask(CompareOp::Eq, first);
        }
        let from_below = if first > 1 { ask(CompareOp::Ge, first) } else { ask(CompareOp::Ne, 0) };
        let from_above = if last < n { ask(CompareOp::Le, last) } else { CExpr::bool(true) };
        CExpr::and([from_below, from_above])
    }

    /// The enumerator of a terminal; the number itself if the region needs no variable.
    fn terminal(&self, region: usize, number: usize) -> String {
        if self.variables[region].is_none() {
            return number.to_string();
        }
        let step = self.plan.regions[region].terminals[number - 1];
        format!("{}_{}", self.names.upper, self.names.steps[step])
    }

    fn program(
        &mut self,
        before: &[Piece<'_>],
        after: &[Piece<'_>],
        bodies: &[Vec<Piece<'_>>],
    ) -> StyleOutput {
        let prefix = self.names.prefix.clone();
        self.statements.function = 1;
        let moves = self.moves();
        let (parts, calls) = self.statements.parts(bodies, 1);
        self.functions.extend(parts);
        self.statements.function = 0;
        let mut step = Vec::new();
        let mut tables = self.enumerators_of_transitions();
        let shared = self.statements.shared_members();
        let has_scan = !shared.is_empty();
        if has_scan {
            step.push(Node::line(format!("{prefix}_scan_t scan;")));
            let mut node: Node = Node::typedef("struct", shared, format!("{prefix}_scan_t"));
            node.note = "data of one reaction".to_string();
            tables.push(node);
        }
        step.extend(self.statements.locals());
        step.extend(self.statements.conditions());
        step.extend(self.statements.pieces(before, &calls));
        step.extend(self.evolution(moves));
        step.extend(self.statements.pieces(after, &calls));
        let mut step = without_unused(step);
        if has_scan && !mentions(&step, "&scan") {
            step.push(Node::line("(void)scan;"));
        }
        let sets_fault = self.statements.sets_fault;
        let mut instance = self.members();
        instance.extend(self.statements.instance(sets_fault));
        let mut init = self.initial();
        init.extend(self.statements.init(sets_fault));
        StyleOutput {
            style: "statechart",
            instance,
            enumerators: self.enumerators(),
            active: IdMap::build(&self.net.steps, |id, _| {
                self.statements.active(id).map_or_else(|| "false".to_string(), |value| value.text)
            }),
            fault: sets_fault.then(|| "self->fault".to_string()),
            has_fault: self.net.settings.evolution != Evolution::Single,
            ticks: self.statements.ticks,
            tables,
            functions: std::mem::take(&mut self.functions),
            init,
            step,
            helpers: self.statements.helpers.clone(),
            engine: None,
            ranges: self.ranges(),
            holds: self.holds(sets_fault),
            locals: self.statements.carried(&self.pieces.carried),
            one_bit: self.statements.one_bit(),
        }
    }

    /// The loop of checks.
    fn evolution(&mut self, moves: Option<text::Function>) -> Vec<Node> {
        let pieces = self.pieces;
        let most = self.statements.proved_rounds;
        let again = self.statements.expr(&pieces.again);
        let mut body = self.statements.statements(&pieces.check);
        let idle = self.statements.statements(&pieces.idle);
        let renew = self.statements.statements(&pieces.renew);
        let Some(moves) = moves else {
            body.extend(idle);
            body.extend(calls::either(again.clone().not(), renew, Vec::new()));
            return self.statements.repeat(pieces.rounds, &again, body, most);
        };
        let is_full = self.statements.expr(&pieces.is_full);
        body.push(Node::line(format!("const bool is_full = {};", is_full.text)));
        let event = match pieces.event {
            Some(event) => {
                let event =
                    Expr::leaf(grafsynth_ir::program::Leaf::Temp(event), Default::default());
                self.statements.expr(&event).text
            }
            None => "0".to_owned(),
        };
        let call = moves.call_with("&scan", &[("event", &event), ("may_fire", "!is_full")]);
        body.push(Node::line(format!("const bool fires = {call};")));
        let too_long = self.statements.statements(&pieces.too_long);
        let fired = self.statements.statements(&pieces.fired);
        body.push(
            Kind::Block(vec![
                Arm::when("!fires", idle),
                Arm::when("is_full", too_long),
                Arm::otherwise(fired),
            ])
            .into(),
        );
        let renewed = CExpr::or([CExpr::condition("fires", Prec::Atom), again.clone().not()]);
        body.extend(calls::either(renewed, renew, Vec::new()));
        self.statements.repeat(pieces.rounds, &again, body, most)
    }

    // --- declarations ----------------------------------------------------------------------------------------------------------------------

    fn members(&self) -> Vec<Member> {
        let mut wide = Vec::new();
        let mut narrow = Vec::new();
        let mut add = |count: usize, name: &str, note: String, objects: Vec<Object>| {
            let ty = count_type(i64::try_from(count).unwrap_or(i64::MAX));
            let declaration = format!("{ty} {name}");
            let list = if ty == "uint8_t" { &mut narrow } else { &mut wide };
            list.push(Member { declaration, note, objects });
        };
        for (region, variable) in self.plan.regions.iter().zip(&self.variables) {
            let Some(variable) = variable else { continue };
            let note = match region.parent {
                Some(_) => format!("the active state in {}", self.net.steps[region.root].name),
                None => "the active state".to_owned(),
            };
            let objects = region.terminals.iter().map(|step| Object::Step(*step)).collect();
            add(region.terminals.len(), variable, note, objects);
        }
        for (id, kept) in &self.memories {
            let history = &self.net.histories[*id];
            for (region, name) in kept {
                let count = self.plan.regions.get(*region).map_or(1, |it| it.terminals.len());
                let note = format!(
                    "history {} of {}: the states that were active at its last exit",
                    history.name, self.net.steps[history.owner].name
                );
                add(count, name, note, vec![Object::Step(history.owner)]);
            }
        }
        wide.extend(narrow);
        wide
    }

    /// The ranges of the members.
    fn ranges(&self) -> Vec<Range> {
        let range = |lo: i64, count: usize, name: &String| {
            let hi = i64::try_from(count).unwrap_or(i64::MAX);
            Range::of(name.clone(), count_type(hi), lo, hi)
        };
        let mut ranges = Vec::new();
        for (region, variable) in self.plan.regions.iter().zip(&self.variables) {
            if let Some(variable) = variable {
                let least = i64::from(region.is_always);
                ranges.push(range(least, region.terminals.len(), variable));
            }
        }
        for (region, name) in self.memories.values().flatten() {
            let count = self.plan.regions.get(*region).map_or(1, |it| it.terminals.len());
            ranges.push(range(0, count, name));
        }
        ranges.extend(self.statements.ranges());
        ranges
    }

    /// The contents of the scalars of the instance.
    fn holds(&self, fault: bool) -> Vec<(Place, Holds)> {
        let number = |at: usize| i64::try_from(at).unwrap_or(i64::MAX);
        let mut all = Vec::new();
        for (region, variable) in self.plan.regions.iter().zip(&self.variables) {
            let Some(variable) = variable else { continue };
            let steps = region.terminals.iter().enumerate();
            let steps = steps.map(|(at, step)| (*step, number(at + 1))).collect();
            let none = (!region.is_always).then_some(0);
            all.push((Place::member(variable), Holds::ActiveOf { steps, none }));
        }
        for (id, kept) in &self.memories {
            let owner = self.net.histories[*id].owner;
            for (region, name) in kept {
                let states: Vec<(StepId, i64)> = match self.plan.regions.get(*region) {
                    // Only the fact is stored, as 1.
                    None => vec![(owner, 1)],
                    Some(data) => {
                        let terminals = data.terminals.iter().enumerate();
                        let own = terminals.filter(|(_, step)| self.is_inside(**step, owner));
                        own.map(|(at, step)| (*step, number(at + 1))).collect()
                    }
                };
                all.push((Place::member(name), Holds::Recorded { history: *id, states }));
            }
        }
        all.extend(self.statements.holds(fault));
        all
    }

    /// True if a state is a proper descendant of another one.
    fn is_inside(&self, step: StepId, outer: StepId) -> bool {
        let mut around = self.net.steps[step].parent;
        while let Some(state) = around.filter(|state| *state != outer) {
            around = self.net.steps[state].parent;
        }
        around.is_some()
    }

    /// The values of the state variables.
    fn enumerators(&self) -> Vec<Node> {
        let mut nodes = Vec::new();
        for (index, region) in self.plan.regions.iter().enumerate() {
            let Some(variable) = &self.variables[index] else { continue };
            let n = region.terminals.len();
            let body = region
                .terminals
                .iter()
                .enumerate()
                .map(|(at, step)| {
                    let comma = if at + 1 == n { "" } else { "," };
                    let data = &self.net.steps[*step];
                    let mut note = String::new();
                    if data.name.text != self.names.steps[*step] {
                        note.push_str(&data.name.text);
                    }
                    if !data.meta.label.is_empty() {
                        note.push_str(if note.is_empty() { "" } else { ": " });
                        note.push_str(&data.meta.label);
                    }
                    Node::line(format!("{} = {}{comma}", self.terminal(index, at + 1), at + 1))
                        .note(note)
                        .about(Object::Step(*step))
                })
                .collect();
            let zero = if region.is_always { "" } else { "; 0 while it is not active" };
            let node = Node::braced("enum", body);
            nodes.push(node.note(format!("values of {variable}{zero}")));
        }
        nodes
    }

    /// The numbers of the transitions of each region, from 1.
    fn enumerators_of_transitions(&self) -> Vec<Node> {
        let mut nodes = Vec::new();
        for region in &self.plan.regions {
            let n = region.transitions.len();
            if n == 0 {
                continue;
            }
            let body = region
                .transitions
                .iter()
                .enumerate()
                .map(|(at, id)| {
                    let comma = if at + 1 == n { "" } else { "," };
                    Node::line(format!("{} = {}{comma}", self.fires[*id], at + 1))
                        .note(self.transition_note(*id))
                        .about(Object::Transition(*id))
                })
                .collect();
            let node = Node::braced("enum", body);
            nodes.push(node.note(format!(
                "the transitions out of the states of {}, 0 for none",
                self.region_name(region)
            )));
            nodes.push(Node::blank());
        }
        nodes
    }

    fn region_name(&self, region: &plan::Region) -> &str {
        match region.parent {
            Some(_) => &self.net.steps[region.root].name.text,
            None => &self.net.parts[region.part].name.text,
        }
    }

    /// A transition as written in the chart.
    fn transition_note(&self, id: grafsynth_ir::net::TransitionId) -> String {
        let it = &self.net.transitions[id];
        let events: Vec<&str> =
            it.events.iter().map(|event| self.net.inputs[*event].name.text.as_str()).collect();
        let mut note = it
            .requires
            .first()
            .map_or_else(String::new, |source| self.net.steps[*source].name.text.clone());
        if !events.is_empty() {
            note.push_str(" on ");
            note.push_str(&events.join(", "));
        }
        if !it.meta.label.is_empty() {
            note.push_str(": ");
            note.push_str(&it.meta.label);
        }
        for req in &it.meta.req {
            note.push_str(&format!(" [{req}]"));
        }
        note
    }

    // --- reset -----------------------------------------------------------------------------------------------------------------------------

    fn initial(&self) -> Vec<Node> {
        let program: &Program = &self.pieces.program;
        let is_set = |cell| program.cells[cell].init.first() == Some(&1);
        let mut nodes = Vec::new();
        for (index, region) in self.plan.regions.iter().enumerate() {
            let Some(variable) = &self.variables[index] else { continue };
            let active = region.terminals.iter().position(|step| is_set(self.pieces.bits[*step]));
            let value = active.map_or_else(|| "0".to_owned(), |at| self.terminal(index, at + 1));
            nodes.push(Node::line(format!("self->{variable} = {value};")));
        }
        for (id, kept) in &self.memories {
            let cases = &self.net.histories[*id].cases;
            let recorded: Vec<StepId> = cases
                .iter()
                .zip(&self.pieces.recorded[*id])
                .filter(|(_, cell)| is_set(**cell))
                .map(|(case, _)| case.step)
                .collect();
            for (region, name) in kept {
                // For a recorded state, its number in the region: its own, or that of the enclosing parallel state.
                let number = recorded.iter().find_map(|step| {
                    let mut next = Some(*step);
                    while let Some(state) = next {
                        if self.plan.region_of[state] == *region {
                            return Some(self.plan.range[state].0);
                        }
                        next = self.net.steps[state].parent;
                    }
                    None
                });
                let value = match number {
                    Some(number) => self.terminal(*region, number),
                    None if *region == usize::MAX && !recorded.is_empty() => "1".to_owned(),
                    None => "0".to_owned(),
                };
                nodes.push(Node::line(format!("self->{name} = {value};")));
            }
        }
        nodes
    }

    /// The events by number: 0 for none.
    fn event_name(&self, number: usize) -> Option<InputId> {
        number.checked_sub(1).and_then(|at| self.pieces.events.get(at)).copied()
    }

    /// The number of a transition, as a constant.
    fn number(&self, region: usize, number: usize) -> String {
        match self.plan.regions[region].transitions.get(number.wrapping_sub(1)) {
            Some(id) => self.fires[*id].clone(),
            None => unsigned(i64::try_from(number).unwrap_or(i64::MAX)),
        }
    }
}
