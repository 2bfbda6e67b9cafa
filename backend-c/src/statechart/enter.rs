//! What a micro-step enters (S4 of §3.9): new values of state variables, entry lists, initial transitions, histories, done events.

use super::Emit;
use super::plan::Memory;
use super::text::{Case, Function, lines};
use crate::Object;
use crate::ctext::{Kind, Node};
use crate::times::count_type;
use grafsynth_ir::net::{Enter, HistoryId, StepId, StepKind};
use std::collections::{BTreeMap, BTreeSet};

/// An entry list of so many lines becomes a function.
const LONG_LIST: usize = 4;

/// So many states that are entered together, in more than one place, become a function.
const MANY_STATES: usize = 3;

/// So many transitions that only give the variable a new value share a table.
const TABLE: usize = 4;

impl Emit<'_> {
    /// What is entered together with a state in more than one place.
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
        seen.into_iter().filter(|(_, count)| *count > 1).map(|(key, _)| key).collect()
    }

    /// How many of the next things lie in a state.
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

    /// Enters things in order.
    pub(super) fn enter_all(&mut self, list: &[Enter]) -> Vec<Node> {
        let mut nodes = Vec::new();
        let mut entered = BTreeSet::new();
        let mut at = 0;
        while let Some(enter) = list.get(at).copied() {
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
                        entered.insert(step);
                    }
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

    /// The function that enters a state with what lies in it.
    fn enter_together(&mut self, key: (StepId, Vec<Enter>)) -> Function {
        if let Some(function) = self.enters.get(&key) {
            return function.clone();
        }
        let mut body = self.enter_state(key.0);
        let mut list = vec![Enter::Step(key.0)];
        list.extend(&key.1);
        // The state itself is no longer asked for, or this would not end.
        self.shared.remove(&key);
        let mut whole = self.enter_all(&list);
        self.shared.insert(key.clone());
        body.clear();
        body.append(&mut whole);
        let wanted = format!("enter_{}", self.names.steps[key.0]);
        let function = self.define(&wanted, "void", false, &[], body);
        self.enters.insert(key, function.clone());
        function
    }

    /// The way down through composite states with lists to an atomic one, by the function of the region that has each entry list once. Gives how many
    /// things it takes; none where the next things are no such way.
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
                let function = self.define_path(region);
                self.paths.insert(region, function.clone());
                function
            }
        };
        let to = self.terminal(region, self.plan.range[last].0);
        let depth = format!("{}U", self.plan.depth[first] - 1);
        let call = function.call(&[("to", &to), ("depth", &depth)]);
        Some((length, Node::line(format!("{call};")).about(Object::Step(last))))
    }

    /// The function that enters an atomic state of a region and what lies around it, as far as it is deeper than some depth.
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

    /// A `switch` over the number of a state; without one what all states do.
    fn on_value(&mut self, word: &str, subject: &str, n: usize, cases: Vec<Case>) -> Vec<Node> {
        let cases = super::text::merged(cases);
        match cases.as_slice() {
            [only] if only.labels.len() == n => only.body.clone(),
            _ => {
                let ty = count_type(i64::try_from(n).unwrap_or(i64::MAX));
                self.switch(word, subject, &[(ty, subject)], cases)
            }
        }
    }

    /// One state: its place in the variable, its entry list, and what a final state does.
    fn enter_state(&mut self, step: StepId) -> Vec<Node> {
        let region = self.plan.region_of[step];
        let mut nodes = Vec::new();
        if self.net.steps[step].kind != StepKind::Composite
            && let Some(variable) = &self.variables[region]
        {
            let value = self.terminal(region, self.plan.range[step].0);
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

    /// The function that enters what the transition of a region leads to.
    pub(super) fn enter(&mut self, region: usize) -> Option<Function> {
        let data = &self.plan.regions[region];
        let mut cases = Vec::new();
        let mut targets = vec![String::new(); data.transitions.len() + 1];
        for (at, id) in data.transitions.iter().enumerate() {
            let body = self.enter_all(&self.net.transitions[*id].enters);
            let plain = self.variables[region].as_ref().and_then(|variable| {
                let [Node { kind: Kind::Line(text), .. }] = body.as_slice() else { return None };
                let value = text.strip_prefix(&format!("self->{variable} = "))?;
                value.strip_suffix(';').map(str::to_owned)
            });
            targets[at + 1] = plain.unwrap_or_default();
            cases.push(Case { labels: vec![self.fires[*id].clone()], body, returns: false });
        }
        let word = self.region_word(region);
        let n_plain = targets.iter().filter(|target| !target.is_empty()).count();
        let mut body = Vec::new();
        if n_plain >= TABLE
            && let Some(variable) = self.variables[region].clone()
        {
            let table = self.table_of_targets(region, &targets);
            let mut kept = targets.iter().skip(1);
            cases.retain(|_| kept.next().is_some_and(String::is_empty));
            let set = Node::line(format!("self->{variable} = {table}[taken];"));
            if cases.iter().all(|case| case.body.is_empty()) && n_plain + 1 == targets.len() {
                body.push(Node::when("taken != 0", vec![set]));
            } else {
                body.push(Node::when(&format!("{table}[taken] != 0"), vec![set]));
            }
        }
        let wanted = format!("{word}_enter");
        let own = [(self.number_type(region), "taken")];
        body.extend(self.switch(&wanted, "taken", &own, cases));
        (!body.is_empty()).then(|| self.define(&wanted, "void", false, &own, body))
    }

    /// For each transition of a region that does nothing but lead to another of its states, that state.
    fn table_of_targets(&mut self, region: usize, targets: &[String]) -> String {
        let data = &self.plan.regions[region];
        let name = format!(
            "{}_{}",
            self.names.prefix,
            self.taken.name(&format!("{}_targets", self.region_word(region)))
        );
        let ty = count_type(i64::try_from(data.terminals.len()).unwrap_or(i64::MAX));
        let mut rows = Vec::new();
        for (at, target) in targets.iter().enumerate() {
            let comma = if at + 1 == targets.len() { "" } else { "," };
            let value = if target.is_empty() { "0" } else { target };
            let row = Node::line(format!("{value}{comma}"));
            rows.push(match at.checked_sub(1).and_then(|at| data.transitions.get(at)) {
                Some(id) => row.note(self.transition_note(*id)).about(Object::Transition(*id)),
                None => row,
            });
        }
        let head = format!("static {}_ROM {ty} {name}[{}] =", self.names.upper, targets.len());
        let node: Node = Kind::Braces(head, rows, ";".to_owned()).into();
        self.functions.push(node.note("where each transition leads that does no more than that"));
        self.functions.push(Node::blank());
        name
    }

    // --- histories -------------------------------------------------------------------------------------------------------------------------

    /// The function that enters what a history stands for.
    fn restore(&mut self, id: HistoryId) -> Function {
        if let Some(function) = self.restores.get(&id) {
            return function.clone();
        }
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
                        format!("self->{name} != 0"),
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
                        format!("self->{name} != 0"),
                        crate::cexpr::Prec::Compare,
                    ),
                    recorded,
                    default,
                )
            }
        };
        let own = [("bool", "is_entered")];
        let function = self.define(&format!("restore_{word}"), "void", false, &own, body);
        self.restores.insert(id, function.clone());
        function
    }

    /// The function that enters what a deep history recorded in one region.
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

/// A `switch` whose `default` does something.
fn with_default(subject: &str, cases: Vec<Case>, default: Vec<Node>) -> Vec<Node> {
    let mut all: Vec<Node> = cases
        .into_iter()
        .filter(|case| !case.labels.is_empty())
        .map(|case| {
            let heads = case.labels.iter().map(|label| format!("case {label}:")).collect();
            let mut body = case.body;
            body.push(Node::line("break;"));
            Kind::Case(heads, body).into()
        })
        .collect();
    let mut body = default;
    body.push(Node::line("break;"));
    all.push(Kind::Case(vec!["default:".to_owned()], body).into());
    vec![Kind::Block(vec![crate::ctext::Arm::new(format!("switch ({subject})"), all)]).into()]
}
