//! The entries of a micro-step (S4 of §3.9): new values of state variables, entry lists, initial transitions, histories, done events.

use super::Emit;
use super::plan::Memory;
use super::tables::Row;
use super::text::{Case, Function, lines, merged, replace};
use crate::Object;
use crate::c::print::{Kind, Node};
use crate::times::count_type;
use grafsynth_ir::Gather;
use grafsynth_ir::net::{Enter, HistoryId, StepId, StepKind, TransitionId};
use std::collections::{BTreeMap, BTreeSet};

/// An entry list with this many lines becomes a function.
const LONG_LIST: usize = 4;

/// From this many states on, states that are entered together in more than one place become a function.
const MANY_STATES: usize = 3;

/// A placeholder for the target state of a transition until its table has a name; it is not a C name.
const TO: &str = "@to";

/// If at least this many transitions only assign the variable, they share a table.
const TABLE: usize = 4;

/// The entry code of the transitions of a region.
#[derive(Debug, Clone)]
pub(super) struct Entries {
    /// The cases of the transitions, in the order of the transitions.
    cases: Vec<Case>,
    /// The statements that assign the variable after the transitions whose case is empty.
    plain: Vec<Node>,
    ids: Vec<TransitionId>,
}

impl Entries {
    /// The common entry code of these transitions, if all of them that enter anything have the same short code.
    fn alike(&self, ids: &[TransitionId]) -> Option<&[Node]> {
        let of = |id: &TransitionId| self.ids.iter().position(|it| it == id);
        let cases: Vec<Case> = ids
            .iter()
            .filter_map(|id| self.cases.get(of(id)?))
            .filter(|case| !case.body.is_empty())
            .cloned()
            .collect();
        let index =
            ids.iter().find_map(|id| of(id).filter(|at| !self.cases[*at].body.is_empty()))?;
        let body = &self.cases[index].body;
        (merged(cases).len() == 1 && lines(body) <= LONG_LIST).then_some(body)
    }
}

impl Emit<'_> {
    /// The states that are entered together in more than one place.
    pub(super) fn shared_entries(&self) -> BTreeSet<(StepId, Vec<Enter>)> {
        let mut seen: BTreeMap<(StepId, Vec<Enter>), u32> = BTreeMap::new();
        let mut look = |list: &[Enter]| {
            for (at, enter) in list.iter().enumerate() {
                if let Enter::Step(step) = enter {
                    let inside = self.inside(*step, &list[at + 1..]);
                    if inside >= MANY_STATES {
                        let key = (*step, list[at + 1..=at + inside].to_vec());
                        *seen.entry(key).or_default() += 1;
                    }
                }
            }
        };
        self.net.transitions.values().for_each(|transition| look(&transition.enters));
        for memory in self.plan.memories.values() {
            match memory {
                Memory::One(_, cases) => cases.iter().for_each(|(_, list)| look(list)),
                Memory::All(list) => look(list),
                Memory::Deep(_) => {}
            }
        }
        self.net.histories.values().for_each(|history| look(&history.default));
        seen.into_iter().filter(|(_, count)| *count > 1).map(|(key, _)| key).gather()
    }

    /// The number of the next items that are inside a state.
    fn inside(&self, step: StepId, next: &[Enter]) -> usize {
        let lies_in = |other: StepId| {
            let mut up = Some(other);
            while let Some(state) = up.filter(|state| *state >= step) {
                if state == step {
                    return true;
                }
                up = self.net.steps[state].parent;
            }
            false
        };
        next.iter()
            .take_while(|enter| match **enter {
                Enter::Step(other) => lies_in(other),
                Enter::InitialContent(other) => lies_in(other),
                Enter::History(history) => lies_in(self.net.histories[history].owner),
            })
            .count()
    }

    /// Enters items in order.
    pub(super) fn enter_all(&mut self, list: &[Enter]) -> Vec<Node> {
        let mut nodes = Vec::new();
        let mut entered = BTreeSet::new();
        let mut at = 0;
        while let Some(enter) = list.get(at).copied() {
            let first = at;
            at += 1;
            match enter {
                Enter::Step(step) => {
                    let inside = self.inside(step, &list[at..]);
                    let key = (step, list[at..at + inside].to_vec());
                    if self.shared.contains(&key) {
                        let function = self.enter_together(key);
                        nodes.push(Node::line(format!("{};", function.call(&[]))));
                        at += inside;
                    } else if let Some((length, call)) = self.enter_path(&list[at - 1..]) {
                        nodes.push(call);
                        at += length - 1;
                    } else {
                        nodes.extend(self.enter_state(step));
                    }
                    // Initial contents run for the states that were entered, including those entered by a function for several
                    // states.
                    entered.extend(list[first..at].iter().filter_map(|enter| match enter {
                        Enter::Step(step) => Some(*step),
                        Enter::InitialContent(_) | Enter::History(_) => None,
                    }));
                }
                Enter::InitialContent(step) => {
                    if entered.contains(&step) {
                        let content = &self.pieces.states[step].initial_content;
                        nodes.extend(self.list(content));
                    }
                }
                Enter::History(history) => {
                    let owner = self.net.histories[history].owner;
                    let is_entered = if entered.contains(&owner) { "true" } else { "false" };
                    let function = self.restore(history);
                    let call = function.call(&[("is_entered", is_entered)]);
                    nodes.push(Node::line(format!("{call};")));
                }
            }
        }
        nodes
    }

    /// The function that enters a state with the states inside it.
    fn enter_together(&mut self, key: (StepId, Vec<Enter>)) -> Function {
        if let Some(function) = self.enters.get(&key) {
            return function.clone();
        }
        // The states that a separate function enters do not depend on the calling transition.
        let target = self.target.take();
        let mut body = self.enter_state(key.0);
        let mut list = vec![Enter::Step(key.0)];
        list.extend(&key.1);
        // The state itself is removed, otherwise this would not terminate.
        self.shared.remove(&key);
        let mut whole = self.enter_all(&list);
        self.shared.insert(key.clone());
        self.target = target;
        body.clear();
        body.append(&mut whole);
        let wanted = format!("enter_{}", self.names.steps[key.0]);
        let function = self.define(&wanted, "void", false, &[], body);
        self.enters.insert(key, function.clone());
        function
    }

    /// Enters the next items by one call, if they are a path down through composite states with lists to an atomic state. The called function of the region
    /// contains each entry list once. Returns the number of items entered and the call; `None` if the next items are not such a path.
    fn enter_path(&mut self, list: &[Enter]) -> Option<(usize, Node)> {
        let Some(Enter::Step(first)) = list.first().copied() else { return None };
        let region = self.plan.region_of[first];
        let mut last = first;
        let mut length = 1;
        let mut n_lists = usize::from(!self.pieces.states[first].entry.is_empty());
        while self.net.steps[last].kind == StepKind::Composite {
            let Some(Enter::Step(next)) = list.get(length).copied() else { return None };
            if self.net.steps[next].parent != Some(last) {
                return None;
            }
            n_lists += usize::from(!self.pieces.states[next].entry.is_empty());
            last = next;
            length += 1;
        }
        if n_lists < 2 || length < 2 || self.variables[region].is_none() {
            return None;
        }
        let function = match self.paths.get(&region) {
            Some(function) => function.clone(),
            None => {
                let target = self.target.take();
                let function = self.define_path(region);
                self.target = target;
                self.paths.insert(region, function.clone());
                function
            }
        };
        let to = self.entered(region, self.plan.range[last].0);
        let depth = format!("{}U", self.plan.depth[first] - 1);
        let call = function.call(&[("to", &to), ("depth", &depth)]);
        Some((length, Node::line(format!("{call};")).about(Object::Step(last))))
    }

    /// The function that enters an atomic state of a region and those of its ancestors that are deeper than a given depth.
    fn define_path(&mut self, region: usize) -> Function {
        let data = &self.plan.regions[region];
        let mut by_depth: BTreeMap<u32, Vec<StepId>> = BTreeMap::new();
        for step in &data.composites {
            by_depth.entry(self.plan.depth[*step]).or_default().push(*step);
        }
        let word = self.region_word(region);
        let n = data.terminals.len();
        let mut body = Vec::new();
        for (depth, steps) in by_depth {
            let mut cases = Vec::new();
            for step in steps {
                let list = self.list(&self.pieces.states[step].entry);
                cases.push(Case { labels: self.labels(region, step), body: list, returns: false });
            }
            let nodes = self.on_value(&format!("{word}_enter_outer"), "to", n, cases);
            if !nodes.is_empty() {
                body.push(Node::when(&format!("depth < {depth}U"), nodes));
            }
        }
        if let Some(variable) = &self.variables[region] {
            body.push(Node::line(format!("self->{variable} = to;")));
        }
        let mut cases = Vec::new();
        for step in data.terminals.iter().copied() {
            let state = &self.pieces.states[step];
            let mut list = self.list(&state.entry);
            list.extend(self.list(&state.finish));
            cases.push(Case { labels: self.labels(region, step), body: list, returns: false });
        }
        body.extend(self.on_value(&format!("{word}_enter_atomic"), "to", n, cases));
        let ty = count_type(i64::try_from(n).unwrap_or(i64::MAX));
        let own = [(ty, "to"), ("uint32_t", "depth")];
        self.define(&format!("{word}_enter_to"), "void", false, &own, body)
    }

    /// The expression for the atomic state of a region that is entered.
    fn entered(&self, region: usize, number: usize) -> String {
        match &self.target {
            Some((here, text)) if *here == region => text.clone(),
            Some(_) | None => self.terminal(region, number),
        }
    }

    /// A `switch` over the number of a state; if all `n` states have the same statements, only these.
    fn on_value(&mut self, word: &str, subject: &str, n: usize, cases: Vec<Case>) -> Vec<Node> {
        let cases = merged(cases);
        match cases.as_slice() {
            [only] if only.labels.len() == n => only.body.clone(),
            _ => {
                let ty = count_type(i64::try_from(n).unwrap_or(i64::MAX));
                self.switch(word, subject, &[(ty, subject)], cases)
            }
        }
    }

    /// Enters one state: assigns its value to the variable, and runs its entry list and the effect of a final state.
    fn enter_state(&mut self, step: StepId) -> Vec<Node> {
        let region = self.plan.region_of[step];
        let mut nodes = Vec::new();
        if self.net.steps[step].kind != StepKind::Composite
            && let Some(variable) = &self.variables[region]
        {
            let value = self.entered(region, self.plan.range[step].0);
            nodes
                .push(Node::line(format!("self->{variable} = {value};")).about(Object::Step(step)));
        }
        let state = &self.pieces.states[step];
        let mut list = self.list(&state.entry);
        list.extend(self.list(&state.finish));
        if lines(&list) >= LONG_LIST {
            let function = match self.entry_lists.get(&step) {
                Some(function) => function.clone(),
                None => {
                    let wanted = format!("entry_{}", self.names.steps[step]);
                    let function = self.define(&wanted, "void", false, &[], list);
                    self.entry_lists.insert(step, function.clone());
                    function
                }
            };
            nodes.push(Node::line(format!("{};", function.call(&[]))));
        } else {
            nodes.extend(list);
        }
        nodes
    }

    /// The entry of each transition of a region: one case for each, and a table for those that only assign the variable, if there is one.
    fn entries(&mut self, region: usize) -> Entries {
        if let Some(entries) = self.entries.get(&region) {
            return entries.clone();
        }
        let data = &self.plan.regions[region];
        let mut cases = Vec::new();
        let mut targets = vec![Row::none()];
        for id in data.transitions.iter().copied() {
            let body = self.enter_all(&self.net.transitions[id].enters);
            let plain = self.variables[region].as_ref().is_some_and(|variable| {
                let [Node { kind: Kind::Line(text), .. }] = body.as_slice() else { return false };
                text.starts_with(&format!("self->{variable} = "))
            });
            let value = self.target_of(region, id).filter(|_| plain);
            targets.push(match value {
                Some(value) => {
                    let text = self.terminal(region, value);
                    Row { value, text, about: Some(id) }
                }
                None => Row { about: Some(id), ..Row::none() },
            });
            cases.push(Case { labels: vec![self.fires[id].clone()], body, returns: false });
        }
        let n_plain = targets.iter().filter(|target| target.value != 0).count();
        let mut entries = Entries { cases, plain: Vec::new(), ids: data.transitions.clone() };
        if n_plain >= TABLE
            && let Some(variable) = self.variables[region].clone()
        {
            let note = "the targets of transitions that only change the state";
            let table = self.table_of_targets(region, "targets", note, &targets);
            for (case, target) in entries.cases.iter_mut().zip(&targets[1..]) {
                if target.value != 0 {
                    case.body.clear();
                }
            }
            let set = Node::line(format!("self->{variable} = {table}[taken];"));
            let is_all = entries.cases.iter().all(|case| case.body.is_empty())
                && n_plain + 1 == targets.len();
            let condition =
                if is_all { "taken != 0U".to_owned() } else { format!("{table}[taken] != 0U") };
            entries.plain.push(Node::when(&condition, vec![set]));
        } else {
            entries.cases = self.with_table(region, entries.cases);
        }
        self.entries.insert(region, entries.clone());
        entries
    }

    /// The function that enters the target of the chosen transition of a region.
    pub(super) fn enter(&mut self, region: usize) -> Option<Function> {
        let entries = self.entries(region);
        let wanted = format!("{}_enter", self.region_word(region));
        let own = [(self.number_type(region), "taken")];
        let mut body = entries.plain;
        body.extend(self.switch(&wanted, "taken", &own, entries.cases));
        (!body.is_empty()).then(|| self.define(&wanted, "void", false, &own, body))
    }

    /// The common entry of these transitions, for the chosen one; `None` if they differ, or if a call of [`Emit::enter`] is as short.
    pub(super) fn enter_at_once(
        &mut self,
        region: usize,
        ids: &[TransitionId],
        taken: &str,
    ) -> Option<Vec<Node>> {
        let entries = self.entries(region);
        if !entries.plain.is_empty() || merged(entries.cases.clone()).len() < 2 {
            return None;
        }
        // Transitions with an entry are distinguished from the others by their numbers.
        let is_empty = |id: &TransitionId| {
            entries
                .ids
                .iter()
                .zip(&entries.cases)
                .any(|(it, case)| it == id && case.body.is_empty())
        };
        if ids.iter().any(|id| is_empty(id) && !self.net.transitions[*id].enters.is_empty()) {
            return None;
        }
        let mut body = entries.alike(ids)?.to_vec();
        // For the other transitions, the code must be equal too, or absent: a function without callers is not emitted.
        let mut is_whole = true;
        let mut reached = BTreeSet::new();
        for event in 0..=self.pieces.events.len() {
            let others: Vec<TransitionId> =
                self.candidates(region, event).into_values().flatten().collect();
            is_whole &= others.is_empty() || entries.alike(&others).is_some();
            reached.extend(others);
        }
        let is_reached =
            |(id, case): (&TransitionId, &Case)| case.body.is_empty() || reached.contains(id);
        if is_whole && !entries.ids.iter().zip(&entries.cases).all(is_reached) {
            return None;
        }
        replace(&mut body, "[taken]", &format!("[{taken}]"));
        Some(body)
    }

    /// The same cases, one for each transition of the region, with the entered state read from a table if that at least halves the number of
    /// different cases.
    fn with_table(&mut self, region: usize, cases: Vec<Case>) -> Vec<Case> {
        let ids = &self.plan.regions[region].transitions;
        let mut rows = vec![Row::none()];
        rows.extend(ids.iter().map(|id| match self.target_of(region, *id) {
            Some(value) => Row { value, text: self.terminal(region, value), about: Some(*id) },
            None => Row { about: Some(*id), ..Row::none() },
        }));
        let n_rows = rows.iter().filter(|row| row.value != 0).count();
        if n_rows < TABLE || self.variables[region].is_none() {
            return cases;
        }
        // The code printed first decides whether there is a table: until then, a placeholder replaces its name.
        let mut others = Vec::new();
        for (id, case) in ids.iter().copied().zip(&cases) {
            if self.target_of(region, id).is_none() {
                others.push(case.clone());
                continue;
            }
            self.target = Some((region, TO.to_owned()));
            let body = self.enter_all(&self.net.transitions[id].enters);
            self.target = None;
            others.push(Case { body, ..case.clone() });
        }
        let (before, after) = (merged(cases.clone()).len(), merged(others.clone()).len());
        if after * 2 > before {
            return cases;
        }
        let note = "the state that each transition leads to";
        let table = self.table_of_targets(region, "to", note, &rows);
        let word = format!("{table}[taken]");
        others.iter_mut().for_each(|case| replace(&mut case.body, TO, &word));
        others
    }

    /// The table of the target states of the transitions of a region, indexed by the transitions' numbers.
    fn table_of_targets(&mut self, region: usize, word: &str, note: &str, rows: &[Row]) -> String {
        let n = self.plan.regions[region].terminals.len();
        let ty = count_type(i64::try_from(n).unwrap_or(i64::MAX));
        let wanted = format!("{}_{word}", self.region_word(region));
        self.table(&wanted, ty, note, rows)
    }

    /// The number of the single atomic or parallel state of its region that a transition enters; `None` for several, or if a history decides.
    fn target_of(&self, region: usize, id: TransitionId) -> Option<usize> {
        let mut found = None;
        for enter in &self.net.transitions[id].enters {
            match *enter {
                Enter::Step(step)
                    if self.plan.region_of[step] == region
                        && self.net.steps[step].kind != StepKind::Composite =>
                {
                    if found.replace(self.plan.range[step].0).is_some() {
                        return None;
                    }
                }
                Enter::Step(_) | Enter::InitialContent(_) => {}
                Enter::History(history) => {
                    if self.plan.region_of[self.net.histories[history].owner] == region {
                        return None;
                    }
                }
            }
        }
        found
    }

    // --- histories -------------------------------------------------------------------------------------------------------------------------

    /// The function that enters the states that a history has recorded.
    fn restore(&mut self, id: HistoryId) -> Function {
        if let Some(function) = self.restores.get(&id) {
            return function.clone();
        }
        let target = self.target.take();
        let history = &self.net.histories[id];
        let word = crate::names::identifier(&history.name.text);
        let content = self.list(&self.pieces.default_content[id]);
        let mut default = Vec::new();
        if !content.is_empty() {
            default.push(Node::when("is_entered", content));
        }
        default.extend(self.enter_all(&history.default));
        let kept = self.memories.get(&id).cloned().unwrap_or_default();
        let body = match self.plan.memories.get(&id).cloned() {
            None => default,
            Some(Memory::All(list)) => {
                let all = self.enter_all(&list);
                let name = kept.first().map_or("", |(_, name)| name.as_str());
                crate::calls::either(
                    crate::cexpr::CExpr::condition(
                        format!("self->{name} != 0U"),
                        crate::cexpr::Prec::Compare,
                    ),
                    all,
                    default,
                )
            }
            Some(Memory::One(region, cases)) => {
                let mut all = Vec::new();
                for (step, list) in &cases {
                    let body = self.enter_all(list);
                    all.push(Case { labels: self.labels(region, *step), body, returns: false });
                }
                let name = kept.first().map_or("", |(_, name)| name.as_str());
                with_default(&format!("self->{name}"), all, default)
            }
            Some(Memory::Deep(_)) => {
                let owner = history.owner;
                let (region, parents) = if self.net.steps[owner].kind == StepKind::Parallel {
                    let inner = self.plan.regions_in(owner).to_vec();
                    (inner.first().copied().unwrap_or(0), inner)
                } else {
                    let region = self.plan.region_of[owner];
                    (region, vec![region])
                };
                let mut recorded = Vec::new();
                for region in parents {
                    let function = self.restore_region(id, region);
                    recorded.push(Node::line(format!("{};", function.call(&[]))));
                }
                let name = kept.iter().find(|(it, _)| *it == region).map_or("", |(_, name)| name);
                crate::calls::either(
                    crate::cexpr::CExpr::condition(
                        format!("self->{name} != 0U"),
                        crate::cexpr::Prec::Compare,
                    ),
                    recorded,
                    default,
                )
            }
        };
        let own = [("bool", "is_entered")];
        let function = self.define(&format!("restore_{word}"), "void", false, &own, body);
        self.target = target;
        self.restores.insert(id, function.clone());
        function
    }

    /// The function that enters the states that a deep history has recorded in one region.
    fn restore_region(&mut self, id: HistoryId, region: usize) -> Function {
        let owner = self.net.histories[id].owner;
        let (first, last) = if self.plan.region_of[owner] == region {
            self.plan.range[owner]
        } else {
            (1, self.plan.regions[region].terminals.len())
        };
        let mut cases = Vec::new();
        for number in first..=last {
            let terminal = self.plan.regions[region].terminals[number - 1];
            let mut way = Vec::new();
            let mut next = Some(terminal);
            while let Some(state) =
                next.filter(|state| *state != owner && self.plan.region_of[*state] == region)
            {
                way.push(Enter::Step(state));
                next = self.net.steps[state].parent;
            }
            way.reverse();
            let mut body = self.enter_all(&way);
            for inner in self.plan.regions_in(terminal).to_vec() {
                let function = self.restore_region(id, inner);
                body.push(Node::line(format!("{};", function.call(&[]))));
            }
            cases.push(Case { labels: vec![self.terminal(region, number)], body, returns: false });
        }
        let kept =
            self.memories.get(&id).and_then(|kept| kept.iter().find(|(it, _)| *it == region));
        let subject = format!("self->{}", kept.map_or("", |(_, name)| name));
        let wanted = format!(
            "restore_{}_{}",
            crate::names::identifier(&self.net.histories[id].name.text),
            self.region_word(region)
        );
        let body = self.switch(&wanted, &subject, &[], cases);
        self.define(&wanted, "void", false, &[], body)
    }
}

/// A `switch` with a `default`.
fn with_default(subject: &str, cases: Vec<Case>, default: Vec<Node>) -> Vec<Node> {
    let mut all: Vec<Node> = cases
        .into_iter()
        .filter(|case| !case.labels.is_empty())
        .map(|case| Node::cases(&case.labels, case.body))
        .collect();
    let mut body = default;
    body.push(Node::line("break;"));
    all.push(Kind::Case(vec!["default:".to_owned()], body).into());
    vec![Kind::Block(vec![crate::c::print::Arm::new(format!("switch ({subject})"), all)]).into()]
}
