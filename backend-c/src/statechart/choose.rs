//! CHECK and the selection of §4, event by event.
//!
//! Each region that has transitions on the event determines the first fireable one from the active state outwards (inner-first) or from the outside inwards
//! (outer-first). If there is only one region, the selection is complete. If there are several, a transition whose source contains a parallel state is offered
//! only by regions that have no fireable transition themselves (they *rest*), and if the exit sets of two transitions intersect, the inner one (if neither is,
//! the earlier one) wins: flags record whether something *moved* in a parallel state, and whether something *left* it. Such flags exist only if a transition on
//! this event leaves a parallel state or has a source that contains one.

use super::Emit;
use super::tables::Row;
use super::text::{Case, Function, merged, switch};
use crate::Object;
use crate::c::print::Node;
use crate::cexpr::{CExpr, Prec, joined};
use crate::names::namer;
use grafsynth_ir::net::{Policy, StepId, TransitionId};
use std::collections::{BTreeMap, BTreeSet};

/// If at least this many states offer one transition each on an event, they share a table.
const TABLE: usize = 8;

/// The transitions of a region on one event that may be fireable, by source.
pub(super) type Candidates = BTreeMap<StepId, Vec<TransitionId>>;

/// One check for one event.
struct Check {
    candidates: BTreeMap<usize, Candidates>,
    /// The regions that have candidates in them or in nested regions.
    concerned: BTreeSet<usize>,
    /// The locals of each region: the number of its transition, or whether it rests.
    taken: BTreeMap<usize, String>,
    rests: BTreeMap<usize, String>,
    /// Flags of parallel states, if they are needed.
    moved: BTreeMap<StepId, String>,
    left: BTreeMap<StepId, String>,
}

/// The actions of the regions in a micro-step, in its three phases.
#[derive(Default)]
struct Phases {
    leave: BTreeMap<usize, Option<Function>>,
    act: BTreeMap<usize, Option<Function>>,
    enter: BTreeMap<usize, Option<Function>>,
}

impl Emit<'_> {
    /// Defines the functions of the evolution, and returns the last one: it runs a micro-step for an event and returns whether one was due. `None` if no
    /// transition can ever fire.
    pub(super) fn moves(&mut self) -> Option<Function> {
        self.shared = self.shared_entries();
        self.define_exits();
        let mut phases = Phases::default();
        let mut cases = Vec::new();
        for number in 0..=self.pieces.events.len() {
            let Some(function) = self.on_event(number, &mut phases) else { continue };
            let body = vec![Node::line(format!("return {};", function.call(&[])))];
            let event = self.event_name(number);
            let label = vec![number.to_string()];
            let mut case = Case { labels: label, body, returns: true };
            if let (Some(event), [line]) = (event, case.body.as_mut_slice()) {
                *line = line.clone().about(Object::Input(event));
            }
            cases.push(case);
        }
        if cases.is_empty() {
            return None;
        }
        let mut body = switch("event", cases);
        body.push(Node::line("return false;"));
        let own = [("uint32_t", "event"), ("bool", "may_fire")];
        Some(self.define("move", "bool", false, &own, body))
    }

    pub(super) fn candidates(&self, region: usize, event: usize) -> Candidates {
        let wanted = self.event_name(event);
        let mut found = Candidates::new();
        let mut all = self.plan.regions[region].transitions.clone();
        all.sort_unstable();
        for id in all {
            let transition = &self.net.transitions[id];
            let is_on = match wanted {
                Some(event) => transition.events.contains(&event),
                None => transition.events.is_empty(),
            };
            if let (true, Some(source)) = (is_on, transition.requires.first())
                && !self.pieces.transitions[id].guard.is_false()
            {
                found.entry(*source).or_default().push(id);
            }
        }
        found
    }

    /// The first fireable transition of a region as a number; 0 if there is none.
    fn select(&mut self, region: usize, event: usize, candidates: &Candidates) -> Function {
        let plan = self.plan;
        // Sources by depth; atomic and parallel states are always the innermost.
        let mut passes: BTreeMap<u32, Vec<StepId>> = BTreeMap::new();
        for source in candidates.keys() {
            let is_terminal = plan.regions[region].terminals.contains(source);
            passes
                .entry(if is_terminal { u32::MAX } else { plan.depth[*source] })
                .or_default()
                .push(*source);
        }
        let inner_first = self.net.settings.policy == Policy::InnerFirst;
        let mut order: Vec<Vec<StepId>> = passes.into_values().collect();
        if inner_first {
            order.reverse();
        }
        let mut body = Vec::new();
        let mut is_done = false;
        let n_passes = order.len();
        for (pass, sources) in order.into_iter().enumerate() {
            let mut cases = Vec::new();
            let table = self.table_of_firsts(region, event, &sources, candidates);
            if let (Some(table), Some(variable), true) =
                (&table, self.variables[region].clone(), pass + 1 == n_passes)
            {
                // The cases that are left for the last pass fall through to the table, where all other states have the entry 0.
                let number = format!("{table}[self->{variable}]");
                for source in sources {
                    let ids = &candidates[&source];
                    let labels = self.labels(region, source);
                    let body = match ids.as_slice() {
                        [only] => self.unless(*only),
                        _ => self.first_of(ids).0,
                    };
                    cases.push(Case { labels, body, returns: false });
                }
                body.extend(switch(&format!("self->{variable}"), merged(cases)));
                body.push(Node::line(format!("return {number};")));
                is_done = true;
                break;
            }
            for source in sources {
                let (nodes, returns) = match (&table, &self.variables[region]) {
                    (Some(table), Some(variable)) if candidates[&source].len() == 1 => {
                        let number = format!("{table}[self->{variable}]");
                        self.first_by(&candidates[&source], |_| number.clone())
                    }
                    _ => self.first_of(&candidates[&source]),
                };
                let labels = self.labels(region, source);
                cases.push(Case { labels, body: nodes, returns });
            }
            let n = plan.regions[region].terminals.len();
            match (cases.as_slice(), &self.variables[region]) {
                ([only], None) => {
                    is_done = only.returns;
                    body.extend(only.body.clone());
                }
                ([only], Some(_)) if only.labels.len() == n && plan.regions[region].is_always => {
                    is_done = only.returns;
                    body.extend(only.body.clone());
                }
                (_, Some(variable)) => {
                    let cases = if table.is_some() { merged(cases) } else { cases };
                    body.extend(switch(&format!("self->{variable}"), cases));
                }
                (_, None) => {}
            }
            if is_done {
                break;
            }
        }
        if !is_done {
            body.push(Node::line("return 0;"));
        }
        let wanted = format!("{}_{}", self.region_word(region), self.event_word(event));
        self.define(&wanted, self.number_type(region), true, &[], body)
    }

    /// A table of the single transition that each of these states offers on an event, indexed by the active state; `None` if there are few such states.
    fn table_of_firsts(
        &mut self,
        region: usize,
        event: usize,
        sources: &[StepId],
        candidates: &Candidates,
    ) -> Option<String> {
        let data = &self.plan.regions[region];
        let mut rows = vec![Row::none(); data.terminals.len() + 1];
        let mut n_sources = 0;
        for source in sources {
            let [only] = candidates[source].as_slice() else { continue };
            let value = data.transitions.iter().position(|id| id == only)? + 1;
            n_sources += 1;
            let (first, last) = self.plan.range[*source];
            for row in rows.iter_mut().take(last + 1).skip(first) {
                *row = Row { value, text: self.fires[*only].clone(), about: Some(*only) };
            }
        }
        if n_sources < TABLE || self.variables[region].is_none() {
            return None;
        }
        let wanted = format!("{}_first_{}", self.region_word(region), self.event_word(event));
        let note = "the transition that each state offers";
        Some(self.table(&wanted, self.number_type(region), note, &rows))
    }

    /// Statements that return early if the guard of a transition is false.
    fn unless(&mut self, id: TransitionId) -> Vec<Node> {
        let guard: CExpr = self.statements.expr(&self.pieces.transitions[id].guard);
        if guard.is_true() {
            return Vec::new();
        }
        vec![Node::when(&guard.not().text, vec![Node::line("return 0;")])]
    }

    /// The number of the first fireable transition of a list, and whether one of them is always fireable.
    fn first_of(&mut self, ids: &[TransitionId]) -> (Vec<Node>, bool) {
        let names: Vec<(TransitionId, String)> =
            ids.iter().map(|id| (*id, self.fires[*id].clone())).collect();
        self.first_by(ids, |id| {
            names.iter().find(|(it, _)| *it == id).map_or_else(String::new, |it| it.1.clone())
        })
    }

    /// Like [`Emit::first_of`], with another way to write the numbers.
    fn first_by(
        &mut self,
        ids: &[TransitionId],
        number: impl Fn(TransitionId) -> String,
    ) -> (Vec<Node>, bool) {
        let mut nodes = Vec::new();
        for id in ids {
            let guard: CExpr = self.statements.expr(&self.pieces.transitions[*id].guard);
            let take =
                Node::line(format!("return {};", number(*id))).about(Object::Transition(*id));
            if guard.is_true() {
                nodes.push(take);
                return (nodes, true);
            }
            if !guard.is_false() {
                nodes.push(Node::when(&guard.text, vec![take]));
            }
        }
        (nodes, false)
    }

    fn event_word(&self, event: usize) -> String {
        match self.event_name(event) {
            Some(event) => {
                format!("on_{}", crate::names::identifier(&self.net.inputs[event].name.text))
            }
            None => "eventless".to_owned(),
        }
    }

    fn on_event(&mut self, event: usize, phases: &mut Phases) -> Option<Function> {
        let plan = self.plan;
        let inner_first = self.net.settings.policy == Policy::InnerFirst;
        let mut check = self.prepare(event);
        if check.candidates.is_empty() {
            return None;
        }
        let order: Vec<usize> =
            if inner_first { plan.post_order.clone() } else { (0..plan.regions.len()).collect() };
        let mut body = Vec::new();
        let mut known = BTreeSet::new();
        for region in order.iter().copied().filter(|it| check.concerned.contains(it)) {
            let selected = match check.candidates.remove(&region) {
                Some(candidates) => {
                    let function = self.select(region, event, &candidates);
                    let offered = self.drops(region, &candidates, &check, &known, inner_first);
                    check.candidates.insert(region, candidates);
                    Some((function, offered))
                }
                None => None,
            };
            self.choose(region, selected, &check, &mut known, inner_first, &mut body);
        }
        let taken: Vec<usize> = check.candidates.keys().copied().collect();
        let none: Vec<String> =
            taken.iter().map(|region| format!("{} == 0U", check.taken[region])).collect();
        body.push(Node::when(&joined(&none, "&&"), vec![Node::line("return false;")]));
        body.push(Node::when("!may_fire", vec![Node::line("return true;")]));
        if self.options.trace.is_some() {
            self.trace(&taken, &check, &mut body);
        }
        self.fire(&taken, &check, phases, &mut body);
        body.push(Node::line("return true;"));
        let own = [("bool", "may_fire")];
        Some(self.define(&self.event_word(event), "bool", false, &own, body))
    }

    /// The regions concerned, and the locals and flags needed.
    fn prepare(&self, event: usize) -> Check {
        let plan = self.plan;
        let mut check = Check {
            candidates: BTreeMap::new(),
            concerned: BTreeSet::new(),
            taken: BTreeMap::new(),
            rests: BTreeMap::new(),
            moved: BTreeMap::new(),
            left: BTreeMap::new(),
        };
        let mut locals = namer();
        crate::names::library(self.net, self.names).iter().for_each(|it| locals.reserve(it));
        locals.reserve("may_fire");
        let inner_first = self.net.settings.policy == Policy::InnerFirst;
        for region in 0..plan.regions.len() {
            let candidates = self.candidates(region, event);
            if candidates.is_empty() {
                continue;
            }
            check.taken.insert(region, locals.name(&format!("{}_taken", self.region_word(region))));
            check.concerned.insert(region);
            for parallel in plan.around(region) {
                check.concerned.insert(plan.region_of[parallel]);
            }
            let data = &plan.regions[region];
            let numbers: Vec<usize> = candidates
                .values()
                .flatten()
                .filter_map(|id| plan.routes[*id])
                .map(|route| route.number)
                .collect();
            let highest = numbers.iter().copied().max().unwrap_or(0);
            for (parallel, first) in &data.leavers {
                if highest >= *first {
                    let name = self.names.steps[*parallel].clone();
                    if !check.left.contains_key(parallel) {
                        check.left.insert(*parallel, locals.name(&format!("{name}_left")));
                    }
                    if !check.moved.contains_key(parallel) {
                        check.moved.insert(*parallel, locals.name(&format!("{name}_moved")));
                    }
                }
            }
            if inner_first && highest > data.n_still {
                for (parallel, _) in &data.nested {
                    if !check.moved.contains_key(parallel) {
                        let name = format!("{}_moved", self.names.steps[*parallel]);
                        check.moved.insert(*parallel, locals.name(&name));
                    }
                }
            }
            check.candidates.insert(region, candidates);
        }
        // Inner-first, the surrounding regions ask a region whether it rests; outer-first, the nested ones do.
        for region in check.concerned.clone() {
            let around = plan.around(region);
            let is_asked = if inner_first {
                around.iter().any(|it| check.candidates.contains_key(&plan.region_of[*it]))
            } else {
                let nested = plan.regions[region].nested.iter().map(|(parallel, _)| *parallel);
                let mut inner = nested.flat_map(|parallel| plan.all_regions_in(parallel));
                check.candidates.contains_key(&region)
                    && inner.any(|it| check.candidates.contains_key(&it))
            };
            if is_asked {
                let name = locals.name(&format!("{}_rests", self.region_word(region)));
                check.rests.insert(region, name);
            }
        }
        check
    }

    /// `variable == P`, perhaps negated; `None` if it is always true.
    fn stands_on(&self, parallel: StepId, sign: &str) -> Option<CExpr> {
        let region = self.plan.region_of[parallel];
        let variable = self.variables[region].as_ref()?;
        let name = self.terminal(region, self.plan.range[parallel].0);
        Some(CExpr::condition(format!("self->{variable} {sign} {name}"), Prec::Compare))
    }

    /// The condition that some region of a parallel state rests; `None` if one always does.
    fn some_rests(&self, parallel: StepId, check: &Check) -> Option<CExpr> {
        let mut all = Vec::new();
        for region in self.plan.regions_in(parallel) {
            let rests = check.rests.get(region).filter(|_| check.concerned.contains(region))?;
            all.push(CExpr::condition(rests.clone(), Prec::Atom));
        }
        Some(CExpr::or(all))
    }

    /// The conditions under which the transition that a region has found does not fire.
    fn drops(
        &self,
        region: usize,
        candidates: &Candidates,
        check: &Check,
        known: &BTreeSet<String>,
        inner_first: bool,
    ) -> Vec<CExpr> {
        let data = &self.plan.regions[region];
        let taken = &check.taken[&region];
        let highest = candidates
            .values()
            .flatten()
            .filter_map(|id| self.plan.routes[*id])
            .map(|route| route.number)
            .max()
            .unwrap_or(0);
        let moves = self.moves_condition(region, taken);
        let mut all = Vec::new();
        if inner_first {
            for (parallel, _) in &data.nested {
                if let Some(rests) = self.some_rests(*parallel, check) {
                    let stands = self.stands_on(*parallel, "==");
                    all.push(CExpr::and(stands.into_iter().chain([rests.not()])));
                }
                if let Some(moved) = check.moved.get(parallel).filter(|it| known.contains(*it))
                    && highest > data.n_still
                {
                    all.push(both(&moves, moved));
                }
            }
        }
        for (parallel, first) in &data.leavers {
            if let Some(left) = check.left.get(parallel).filter(|it| known.contains(*it))
                && highest > data.n_still
            {
                all.push(both(&moves, left));
            }
            if let Some(moved) = check.moved.get(parallel).filter(|it| known.contains(*it))
                && highest >= *first
            {
                let reaches = format!("{taken} >= {}", self.number(region, *first));
                all.push(both(&reaches, moved));
            }
        }
        all
    }

    /// The condition that the chosen transition leaves a state.
    fn moves_condition(&self, region: usize, taken: &str) -> String {
        match self.plan.regions[region].n_still {
            0 => format!("{taken} != 0U"),
            n => format!("{taken} > {}", self.number(region, n)),
        }
    }

    /// Writes the lines that choose a transition in one region.
    fn choose(
        &self,
        region: usize,
        selected: Option<(Function, Vec<CExpr>)>,
        check: &Check,
        known: &mut BTreeSet<String>,
        inner_first: bool,
        body: &mut Vec<Node>,
    ) {
        let plan = self.plan;
        let data = &plan.regions[region];
        // Outer-first, a region is asked only if no surrounding region has a fireable transition.
        let around: Vec<usize> =
            plan.around(region).iter().map(|parallel| plan.region_of[*parallel]).collect();
        let outer_rests: Vec<&str> = around
            .iter()
            .filter(|_| !inner_first)
            .filter(|it| check.candidates.contains_key(it))
            .filter_map(|it| check.rests.get(it).map(String::as_str))
            .collect();
        if let Some((function, drops)) = &selected {
            let taken = &check.taken[&region];
            let ty = self.number_type(region);
            let call = function.call(&[]);
            if outer_rests.is_empty() {
                let constant = if drops.is_empty() { "const " } else { "" };
                body.push(Node::line(format!("{constant}{ty} {taken} = {call};")));
            } else {
                body.push(Node::line(format!("{ty} {taken} = 0;")));
                let set = Node::line(format!("{taken} = {call};"));
                body.push(Node::when(&outer_rests.join(" && "), vec![set]));
            }
        }
        if let Some(rests) = check.rests.get(&region) {
            let none = selected.as_ref().map(|_| format!("{} == 0U", check.taken[&region]));
            let none = none.map(|none| CExpr::condition(none, Prec::Compare));
            let outer = outer_rests.iter().map(|it| CExpr::condition(*it, Prec::Atom));
            let nested = data.nested.iter().filter(|_| inner_first).filter_map(|(parallel, _)| {
                let inner = self.some_rests(*parallel, check)?;
                Some(CExpr::or(self.stands_on(*parallel, "!=").into_iter().chain([inner])))
            });
            let value = CExpr::and(none.into_iter().chain(nested).chain(outer)).text;
            body.push(Node::line(format!("const bool {rests} = {value};")).defining(rests));
        }
        let Some((_, drops)) = selected else { return };
        let taken = &check.taken[&region];
        if !drops.is_empty() {
            let drop = vec![Node::line(format!("{taken} = 0;"))];
            body.push(Node::when(&CExpr::or(drops).text, drop));
        }
        for (parallel, first) in &data.leavers {
            let highest = check.candidates[&region]
                .values()
                .flatten()
                .filter_map(|id| plan.routes[*id])
                .map(|route| route.number)
                .max()
                .unwrap_or(0);
            let mut note = |flag: Option<&String>, condition: String| {
                let Some(flag) = flag else { return };
                let line = if known.insert(flag.clone()) {
                    format!("bool {flag} = {condition};")
                } else {
                    format!("{flag} = {flag} || ({condition});")
                };
                body.push(Node::line(line).defining(flag));
            };
            if highest > data.n_still {
                note(check.moved.get(parallel), self.moves_condition(region, taken));
            }
            if highest >= *first {
                let condition = format!("{taken} >= {}", self.number(region, *first));
                note(check.left.get(parallel), condition);
            }
        }
    }

    /// Records the transitions that fire, in the order of selection.
    fn trace(&mut self, taken: &[usize], check: &Check, body: &mut Vec<Node>) {
        body.push(crate::trace::micro_step());
        for region in self.plan.post_order.clone() {
            if !taken.contains(&region) {
                continue;
            }
            let mut rows = vec![Row::none()];
            rows.extend(self.plan.regions[region].transitions.iter().map(|id| Row {
                value: id.index(),
                text: id.index().to_string(),
                about: Some(*id),
            }));
            let wanted = format!("{}_numbers", self.region_word(region));
            let table = self.table(&wanted, "uint16_t", "transitions, for the trace", &rows);
            let local = &check.taken[&region];
            let line = format!("{}_fired(self, {table}[{local}]);", self.names.prefix);
            body.push(Node::when(&format!("{local} != 0U"), vec![Node::line(line)]));
        }
    }

    /// Exits in reverse document order, actions in the order of selection, entries in document order.
    fn fire(&mut self, taken: &[usize], check: &Check, phases: &mut Phases, body: &mut Vec<Node>) {
        let of = |emit: &Self, region: usize, wanted: &dyn Fn(&Self, TransitionId) -> bool| {
            check.candidates[&region].values().flatten().any(|id| wanted(emit, *id))
        };
        for region in taken.iter().rev().copied() {
            let leaves = of(self, region, &|emit, id| {
                let domain = emit.plan.routes[id].and_then(|route| route.domain);
                domain.is_some_and(|(to, depth)| emit.has_exits(to, depth))
            });
            if !leaves {
                continue;
            }
            let (local, ids) = (&check.taken[&region], ids_of(check, region));
            if let Some(leave) = self.leave_at_once(region, &ids) {
                body.push(Node::when(&self.moves_condition(region, local), vec![leave]));
            } else {
                let function = phases.leave.entry(region).or_insert_with(|| self.leave(region));
                call(function.as_ref(), &check.taken[&region], body);
            }
        }
        for region in self.plan.post_order.clone() {
            if !taken.contains(&region) {
                continue;
            }
            let acts =
                of(self, region, &|emit, id| !emit.pieces.transitions[id].actions.is_empty());
            if acts {
                let function = phases.act.entry(region).or_insert_with(|| self.act(region));
                call(function.as_ref(), &check.taken[&region], body);
            }
        }
        for region in taken.iter().copied() {
            let enters = of(self, region, &|emit, id| !emit.net.transitions[id].enters.is_empty());
            if !enters {
                continue;
            }
            let (local, ids) = (&check.taken[&region], ids_of(check, region));
            if let Some(enter) = self.enter_at_once(region, &ids, local) {
                body.push(Node::when(&self.moves_condition(region, local), enter));
            } else {
                let function = phases.enter.entry(region).or_insert_with(|| self.enter(region));
                call(function.as_ref(), &check.taken[&region], body);
            }
        }
    }
}

/// The condition that a comparison (of the number of a transition) is true and a flag is set.
fn both(comparison: &str, flag: &str) -> CExpr {
    let comparison = CExpr::condition(comparison, Prec::Compare);
    CExpr::and([comparison, CExpr::condition(flag, Prec::Atom)])
}

/// The transitions of a region that one check may take.
fn ids_of(check: &Check, region: usize) -> Vec<TransitionId> {
    check.candidates[&region].values().flatten().copied().collect()
}

fn call(function: Option<&Function>, taken: &str, body: &mut Vec<Node>) {
    if let Some(function) = function {
        body.push(Node::line(format!("{};", function.call(&[("taken", taken)]))));
    }
}
