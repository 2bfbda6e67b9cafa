//! The exits and actions of a micro-step: exit lists with histories (S1, S2 of §3.9), and the actions of transitions (S3).

use super::Emit;
use super::plan::{Memory, Route};
use super::tables::Row;
use super::text::{Case, Function};
use crate::c::print::Node;
use grafsynth_ir::Gather;
use grafsynth_ir::net::{StepId, StepKind, TransitionId};
use std::collections::{BTreeMap, BTreeSet};

/// If at least this many transitions exit to several depths, the depths are in a table.
const TABLE: usize = 8;

/// The function that exits the states of a region that are deeper than a given depth.
#[derive(Debug, Clone)]
pub(super) struct Exit {
    function: Function,
}

impl Emit<'_> {
    /// True if exiting the states deeper than `depth` in a region does more than assign its variable.
    pub(super) fn has_exits(&self, region: usize, depth: u32) -> bool {
        let data = &self.plan.regions[region];
        let is_left_whole = depth == 0 && data.parent.is_some();
        is_left_whole
            || (data.drops && self.variables[region].is_some())
            || data.terminals.iter().chain(&data.composites).any(|step| {
                self.plan.depth[*step] > depth
                    && (!self.pieces.states[*step].exit.is_empty()
                        || self.net.steps[*step].kind == StepKind::Parallel
                        || self.histories_of(*step).next().is_some())
            })
    }

    /// The histories that a state records on exit.
    fn histories_of(&self, owner: StepId) -> impl Iterator<Item = grafsynth_ir::net::HistoryId> {
        self.net.histories.iter().filter(move |(_, it)| it.owner == owner).map(|(id, _)| id)
    }

    /// Defines the exit functions: one for each region in which a transition exits states, and one for each region nested in those states.
    pub(super) fn define_exits(&mut self) {
        let mut depths: BTreeMap<usize, BTreeSet<u32>> = BTreeMap::new();
        for route in self.plan.routes.values().flatten() {
            if let Some((region, depth)) = route.domain
                && self.has_exits(region, depth)
            {
                depths.entry(region).or_default().insert(depth);
            }
        }
        // The regions of a parallel state come after the region that contains it.
        for region in 0..self.plan.regions.len() {
            let Some(lowest) = depths.get(&region).and_then(|all| all.first().copied()) else {
                continue;
            };
            for (parallel, inner) in &self.plan.regions[region].nested {
                if self.plan.depth[*parallel] > lowest {
                    for inner in inner {
                        depths.entry(*inner).or_default().insert(0);
                    }
                }
            }
        }
        for (region, depths) in depths.into_iter().rev() {
            self.define_exit(region, &depths);
        }
    }

    fn define_exit(&mut self, region: usize, depths: &BTreeSet<u32>) {
        let plan = self.plan;
        let data = &plan.regions[region];
        let lowest = depths.first().copied().unwrap_or(0);
        // States deeper than every requested depth are exited in any case.
        let highest = depths.last().copied().unwrap_or(0);
        let mut body = Vec::new();
        let guarded = |at: u32, nodes: Vec<Node>, body: &mut Vec<Node>| {
            if nodes.is_empty() {
            } else if at > highest {
                body.extend(nodes);
            } else {
                body.push(Node::when(&format!("depth < {at}U"), nodes));
            }
        };
        let mut by_depth: BTreeMap<u32, Vec<StepId>> = BTreeMap::new();
        for step in data.composites.iter().filter(|step| plan.depth[**step] > lowest) {
            by_depth.entry(plan.depth[*step]).or_default().push(*step);
        }
        for (depth, steps) in &by_depth {
            let cases = steps
                .iter()
                .map(|step| Case {
                    labels: self.labels(region, *step),
                    body: self.record(*step),
                    returns: false,
                })
                .collect();
            let nodes = self.on_terminals(region, "record", cases);
            guarded(*depth, nodes, &mut body);
        }
        for (parallel, inner) in &data.nested {
            if plan.depth[*parallel] <= lowest {
                continue;
            }
            let mut nodes = self.record(*parallel);
            for inner in inner.iter().rev() {
                if let Some(exit) = self.exits.get(inner) {
                    nodes.push(Node::line(format!("{};", exit.function.call(&[("depth", "0")]))));
                }
            }
            let case = Case { labels: self.labels(region, *parallel), body: nodes, returns: false };
            body.extend(self.on_terminals(region, "leave_inner", vec![case]));
        }
        let mut cases = Vec::new();
        for step in data.terminals.iter().filter(|step| plan.depth[**step] > lowest) {
            let list = self.list(&self.pieces.states[*step].exit);
            cases.push(Case { labels: self.labels(region, *step), body: list, returns: false });
        }
        body.extend(self.on_terminals(region, "leave_atomic", cases));
        for (depth, steps) in by_depth.iter().rev() {
            let mut cases = Vec::new();
            for step in steps {
                let list = self.list(&self.pieces.states[*step].exit);
                cases.push(Case { labels: self.labels(region, *step), body: list, returns: false });
            }
            let nodes = self.on_terminals(region, "leave_outer", cases);
            guarded(*depth, nodes, &mut body);
        }
        if let Some(variable) = &self.variables[region] {
            let clear = vec![Node::line(format!("self->{variable} = 0;"))];
            if data.drops {
                body.extend(clear);
            } else if data.parent.is_some() && lowest == 0 {
                guarded(1, clear, &mut body);
            }
        }
        let wanted = format!("{}_exit", self.region_word(region));
        let function = self.define(&wanted, "void", false, &[("uint32_t", "depth")], body);
        self.exits.insert(region, Exit { function });
    }

    /// The constants of the atomic and parallel states in a state.
    pub(super) fn labels(&self, region: usize, step: StepId) -> Vec<String> {
        let (first, last) = self.plan.range[step];
        (first..=last).map(|number| self.terminal(region, number)).collect()
    }

    /// A `switch` over the variable of an active region; without a variable, the statements of its only situation.
    pub(super) fn on_terminals(
        &mut self,
        region: usize,
        word: &str,
        cases: Vec<Case>,
    ) -> Vec<Node> {
        match self.variables[region].clone() {
            None => cases.into_iter().flat_map(|case| case.body).collect(),
            Some(variable) => {
                let cases = super::text::merged(cases);
                // If all states have the same statements, no test is needed, because the region is active.
                if let [only] = cases.as_slice()
                    && only.labels.len() == self.plan.regions[region].terminals.len()
                {
                    return only.body.clone();
                }
                let wanted = format!("{}_{word}", self.region_word(region));
                let own = [("uint32_t", "depth")];
                self.switch(&wanted, &format!("self->{variable}"), &own, cases)
            }
        }
    }

    /// The values that a state records on exit.
    fn record(&self, owner: StepId) -> Vec<Node> {
        let mut nodes = Vec::new();
        for id in self.histories_of(owner) {
            for (region, name) in self.memories.get(&id).into_iter().flatten() {
                let value = match self.plan.memories.get(&id) {
                    Some(Memory::All(_)) | None => "1".to_owned(),
                    Some(Memory::One(..) | Memory::Deep(_)) => match &self.variables[*region] {
                        Some(variable) => format!("self->{variable}"),
                        None => "1".to_owned(),
                    },
                };
                nodes.push(Node::line(format!("self->{name} = {value};")));
            }
        }
        nodes
    }

    /// The function that performs the exits of the chosen transition of the region; `None` if no transition has any.
    pub(super) fn leave(&mut self, region: usize) -> Option<Function> {
        let data = &self.plan.regions[region];
        let mut groups: BTreeMap<(usize, u32), Vec<String>> = BTreeMap::new();
        for id in &data.transitions {
            if let Some(Route { domain: Some((to, depth)), .. }) = self.plan.routes[*id]
                && self.has_exits(to, depth)
            {
                groups.entry((to, depth)).or_default().push(self.fires[*id].clone());
            }
        }
        if groups.is_empty() {
            return None;
        }
        let n_moving = data.transitions.len() - data.n_still;
        let number = self.number_type(region);
        if let Some(body) = self.leave_by_table(region, &groups) {
            let wanted = format!("{}_leave", self.region_word(region));
            return Some(self.define(&wanted, "void", false, &[(number, "taken")], body));
        }
        let mut cases = Vec::new();
        for ((to, depth), labels) in groups {
            let Some(exit) = self.exits.get(&to) else { continue };
            let call = exit.function.call(&[("depth", &format!("{depth}U"))]);
            cases.push(Case { labels, body: vec![Node::line(format!("{call};"))], returns: false });
        }
        let body = match cases.as_slice() {
            [only] if only.labels.len() == n_moving && n_moving > 1 => {
                let condition = if data.n_still == 0 {
                    "taken != 0U".to_owned()
                } else {
                    format!("taken > {}", self.number(region, data.n_still))
                };
                vec![Node::when(&condition, only.body.clone())]
            }
            _ => super::text::switch("taken", cases),
        };
        let wanted = format!("{}_leave", self.region_word(region));
        let ty = self.number_type(region);
        Some(self.define(&wanted, "void", false, &[(ty, "taken")], body))
    }

    /// The common exit of these transitions, if other transitions of the region exit other states.
    pub(super) fn leave_at_once(&mut self, region: usize, ids: &[TransitionId]) -> Option<Node> {
        let domain = |id: &TransitionId| self.plan.routes[*id].and_then(|route| route.domain);
        let exits = |it: &(usize, u32)| self.has_exits(it.0, it.1);
        let all: BTreeSet<(usize, u32)> =
            self.plan.regions[region].transitions.iter().filter_map(domain).filter(exits).gather();
        let moving: BTreeSet<(usize, u32)> = ids.iter().filter_map(domain).gather();
        let (to, depth) = *moving.first()?;
        if all.len() < 2 || moving.len() > 1 || !self.has_exits(to, depth) {
            return None;
        }
        let call = self.exits.get(&to)?.function.call(&[("depth", &format!("{depth}U"))]);
        Some(Node::line(format!("{call};")))
    }

    /// The exit depths of the transitions of one region from a table, if many have several depths.
    fn leave_by_table(
        &mut self,
        region: usize,
        groups: &BTreeMap<(usize, u32), Vec<String>>,
    ) -> Option<Vec<Node>> {
        let ((to, _), _) = groups.first_key_value()?;
        let n_labels: usize = groups.values().map(Vec::len).sum();
        if groups.len() < 2 || n_labels < TABLE || groups.keys().any(|(other, _)| other != to) {
            return None;
        }
        let exit = self.exits.get(to)?.clone();
        let mut rows = vec![Row::none()];
        let mut highest = 0;
        for id in &self.plan.regions[region].transitions {
            let label = &self.fires[*id];
            let depth = groups.iter().find(|(_, labels)| labels.contains(label));
            let value = depth.map_or(0, |((_, depth), _)| *depth + 1);
            highest = highest.max(value);
            let value = usize::try_from(value).unwrap_or(usize::MAX);
            rows.push(Row { value, text: value.to_string(), about: Some(*id) });
        }
        let ty = crate::times::count_type(i64::from(highest));
        let wanted = format!("{}_depths", self.region_word(region));
        let note = "the exit depth of each transition plus one; 0 if it exits nothing";
        let table = self.table(&wanted, ty, note, &rows);
        let depth = format!("{table}[taken] - 1U");
        let call = Node::line(format!("{};", exit.function.call(&[("depth", &depth)])));
        Some(vec![Node::when(&format!("{table}[taken] != 0U"), vec![call])])
    }

    /// The function that runs the actions of the chosen transition; `None` if there are none.
    pub(super) fn act(&mut self, region: usize) -> Option<Function> {
        let mut cases = Vec::new();
        for id in &self.plan.regions[region].transitions {
            let body = self.list(&self.pieces.transitions[*id].actions);
            cases.push(Case { labels: vec![self.fires[*id].clone()], body, returns: false });
        }
        let wanted = format!("{}_act", self.region_word(region));
        let own = [(self.number_type(region), "taken")];
        let body = self.switch(&wanted, "taken", &own, cases);
        (!body.is_empty()).then(|| self.define(&wanted, "void", false, &own, body))
    }

    /// The C type of the number of a transition.
    pub(super) fn number_type(&self, region: usize) -> &'static str {
        let n = self.plan.regions[region].transitions.len();
        crate::times::count_type(i64::try_from(n).unwrap_or(i64::MAX))
    }

    /// A region in the names of functions.
    pub(super) fn region_word(&self, region: usize) -> String {
        let data = &self.plan.regions[region];
        match data.parent {
            Some(_) => self.names.steps[data.root].clone(),
            None => crate::names::identifier(&self.net.parts[data.part].name.text),
        }
    }
}
