//! Assigns each object of a net to its chart or macro, and gives it its local name.

use grafsynth_ir::Gather;
use std::collections::{BTreeMap, BTreeSet};

use grafsynth_ir::Name;
use grafsynth_ir::chart::Path;
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::net::{Net, PartId, StepId, StepKind, TransitionId, TransitionKind};

use super::cannot;

/// Index of a body of a net.
pub(super) type BodyId = usize;

/// A step, macro-step or enclosing step, with the transitions that belong to it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Unit {
    /// A step and its reactions.
    Step(StepId),
    /// A macro-step with its contents, or an enclosing step with the chart that it encloses.
    Inner(BodyId),
}

/// A chart, the expansion of a macro-step, or the contents of an enclosing step.
#[derive(Debug)]
struct Body {
    part: PartId,
    parent: Option<BodyId>,
    /// The body whose namespace it uses: itself, except for the body of an enclosing step (semantics C25).
    names: BodyId,
    /// The enclosing step, if this is its body.
    enclosing: Option<StepId>,
    /// The prefix that full names have before the local name, with its dot.
    prefix: String,
    /// The name in the body that contains it; for a chart, its full name.
    local: String,
    /// Index into the net's list of macro-steps.
    macro_step: Option<usize>,
}

#[derive(Debug)]
pub(super) struct Bodies {
    bodies: Vec<Body>,
    of_part: BTreeMap<PartId, BodyId>,
    /// Bodies by prefix.
    by_prefix: BTreeMap<String, BodyId>,
    /// Bodies of enclosing steps.
    of_step: BTreeMap<StepId, BodyId>,
    /// The last parts of all names, which names of macros must avoid.
    taken: BTreeSet<String>,
}

impl Bodies {
    /// Finds the charts, macro-steps and enclosing steps of a net. Reports other parts.
    pub(super) fn of(net: &Net, findings: &mut Vec<Diagnostic>) -> Self {
        let macros: BTreeMap<&str, usize> = net
            .macros
            .iter()
            .enumerate()
            .map(|(index, one)| (one.name.text.as_str(), index))
            .gather();
        let is_root = |id: PartId| {
            net.parts[id].level <= 1 && !macros.contains_key(net.parts[id].name.text.as_str())
        };
        let several = net.parts.ids().filter(|id| is_root(*id)).count() > 1;
        let mut found = Bodies {
            bodies: Vec::new(),
            of_part: BTreeMap::new(),
            by_prefix: BTreeMap::new(),
            of_step: BTreeMap::new(),
            taken: taken(net),
        };
        let enclosing = enclosing(net);
        for (part, data) in net.parts.iter() {
            let name = &data.name.text;
            let id = found.bodies.len();
            let body = if is_root(part) {
                let prefix = if several { format!("{name}.") } else { String::new() };
                let local = name.clone();
                let (parent, enclosing, macro_step) = (None, None, None);
                Body { part, parent, names: id, enclosing, prefix, local, macro_step }
            } else if let Some(index) = macros.get(name.as_str()) {
                // The innermost surrounding body, by name and by enclosing step. Parents come first.
                let by_name = found.nearest(name).or((!several && id > 0).then_some(0));
                let around = net.steps[net.macros[*index].entry].parent;
                let parent = match (by_name, around.and_then(|step| found.of_step.get(&step))) {
                    (Some(named), Some(body)) if found.bodies[*body].names == named => Some(*body),
                    (named, _) => named,
                };
                let Some(parent) = parent else {
                    findings.push(cannot(
                        format!("the macro-step `{name}` outside of all charts"),
                        data.name.span,
                    ));
                    continue;
                };
                let around = found.bodies[parent].prefix.as_str();
                let local = name.strip_prefix(around).unwrap_or(name).to_owned();
                let (enclosing, prefix, macro_step) = (None, format!("{name}."), Some(*index));
                Body { part, parent: Some(parent), names: id, enclosing, prefix, local, macro_step }
            } else if let Some((step, parent)) = enclosing
                .get(&part)
                .and_then(|step| Some((*step, *found.of_part.get(&net.steps[*step].part)?)))
            {
                let around = &found.bodies[parent];
                let (names, prefix) = (around.names, around.prefix.clone());
                found.of_step.insert(step, id);
                let local = name.strip_prefix(prefix.as_str()).unwrap_or(name).to_owned();
                let (parent, enclosing, macro_step) = (Some(parent), Some(step), None);
                Body { part, parent, names, enclosing, prefix, local, macro_step }
            } else {
                findings.push(cannot(
                    format!(
                        "the partial chart `{name}`, which is neither a macro-step nor enclosed"
                    ),
                    data.name.span,
                ));
                continue;
            };
            if body.names == id {
                found.by_prefix.insert(body.prefix.clone(), id);
            }
            found.of_part.insert(part, id);
            found.bodies.push(body);
        }
        found
    }

    /// The innermost body that contains a full name, by its prefixes.
    fn nearest(&self, full: &str) -> Option<BodyId> {
        let mut end = full.len();
        while let Some(dot) = full[..end].rfind('.') {
            if dot + 1 < full.len()
                && let Some(body) = self.by_prefix.get(&full[..=dot])
            {
                return Some(*body);
            }
            end = dot;
        }
        self.by_prefix.get("").copied()
    }

    pub(super) fn roots(&self) -> Vec<BodyId> {
        (0..self.bodies.len()).filter(|body| self.bodies[*body].parent.is_none()).collect()
    }

    /// The macro-steps directly inside a body.
    pub(super) fn inner(&self, body: BodyId) -> Vec<BodyId> {
        let is_inner = |inner: &BodyId| {
            let inner = &self.bodies[*inner];
            inner.parent == Some(body) && inner.macro_step.is_some()
        };
        (0..self.bodies.len()).filter(is_inner).collect()
    }

    /// The enclosing step of this body.
    pub(super) fn enclosing(&self, body: BodyId) -> Option<StepId> {
        self.bodies[body].enclosing
    }

    /// The parent of a body.
    pub(super) fn parent(&self, body: BodyId) -> Option<BodyId> {
        self.bodies[body].parent
    }

    /// Whether two bodies use each other's names without a path.
    pub(super) fn share_names(&self, one: BodyId, other: BodyId) -> bool {
        self.bodies[one].names == self.bodies[other].names
    }

    pub(super) fn part(&self, body: BodyId) -> PartId {
        self.bodies[body].part
    }

    /// Index into the net's list of macro-steps.
    pub(super) fn macro_step(&self, body: BodyId) -> Option<usize> {
        self.bodies[body].macro_step
    }

    /// The name of a macro-step in the body that contains it.
    pub(super) fn local_name(&self, body: BodyId) -> &str {
        &self.bodies[body].local
    }

    /// A name for the macro of a macro-step. Macros and steps share one namespace, so `_body` is appended.
    pub(super) fn macro_name(&self, body: BodyId) -> String {
        let mut text = format!("{}_body", self.bodies[body].local);
        while self.taken.contains(&text) {
            text.push_str("_body");
        }
        text
    }

    /// The local name of an object, if it is declared in this body.
    pub(super) fn local(&self, body: BodyId, full: &Name) -> Option<Name> {
        // The names of enclosed objects are declared in the surrounding body.
        if self.nearest(&full.text)? != body {
            return None;
        }
        full.text
            .strip_prefix(self.bodies[body].prefix.as_str())
            .map(|text| Name::new(text, full.span))
    }

    /// The local name of an object that certainly belongs to this body.
    pub(super) fn own(&self, body: BodyId, full: &Name) -> Name {
        let text = full.text.strip_prefix(self.bodies[body].prefix.as_str()).unwrap_or(&full.text);
        Name::new(text, full.span)
    }

    /// The path of the object with this full name, as seen from a body.
    pub(super) fn path(&self, full: &Name, from: BodyId) -> Path {
        let Some(home) = self.nearest(&full.text) else { return Path::from(full.clone()) };
        let own = self.own(home, full);
        if self.share_names(home, from) {
            return Path::from(own);
        }
        let mut names = vec![own];
        let mut body = home;
        while let Some(parent) = self.bodies[body].parent {
            if self.bodies[body].enclosing.is_none() {
                names.push(Name::new(self.bodies[body].local.clone(), full.span));
            }
            body = parent;
        }
        if body != self.root_of(from) {
            names.push(Name::new(self.bodies[body].local.clone(), full.span));
        }
        names.reverse();
        Path { names }
    }

    /// Whether some body declares the object with this name.
    pub(super) fn has_home(&self, full: &Name) -> bool {
        self.nearest(&full.text).is_some()
    }

    /// The chart whose name is the prefix of this name, if there are several charts.
    pub(super) fn root_called_in(&self, full: &str) -> Option<BodyId> {
        self.roots().into_iter().find(|root| {
            let prefix = self.bodies[*root].prefix.as_str();
            !prefix.is_empty() && full.starts_with(prefix)
        })
    }

    fn root_of(&self, mut body: BodyId) -> BodyId {
        while let Some(parent) = self.bodies[body].parent {
            body = parent;
        }
        body
    }

    /// The body directly inside `outer` that contains `part`, or `outer` itself; `None` if `part` is elsewhere.
    fn child_with(&self, outer: BodyId, part: PartId) -> Option<BodyId> {
        let mut body = *self.of_part.get(&part)?;
        if body == outer {
            return Some(outer);
        }
        loop {
            let parent = self.bodies[body].parent?;
            if parent == outer {
                return Some(body);
            }
            body = parent;
        }
    }

    /// The steps and macro-steps of a body, in the order of their steps.
    pub(super) fn units(&self, net: &Net, body: BodyId) -> Vec<Unit> {
        let mut units: Vec<Unit> = Vec::new();
        for (id, step) in net.steps.iter() {
            let unit = match self.child_with(body, step.part) {
                Some(child) if child == body => self.unit_of_step(id),
                Some(child) => Unit::Inner(child),
                None => continue,
            };
            if units.last() != Some(&unit) {
                units.push(unit);
            }
        }
        units
    }

    /// A step directly inside a body, with the chart that it encloses.
    fn unit_of_step(&self, step: StepId) -> Unit {
        self.of_step.get(&step).map_or(Unit::Step(step), |inner| Unit::Inner(*inner))
    }

    /// All transitions of a body and its contents, in order.
    pub(super) fn transitions_within(&self, net: &Net, body: BodyId) -> Vec<TransitionId> {
        net.transitions
            .iter()
            .filter(|(_, one)| self.child_with(body, one.part).is_some())
            .map(|(id, _)| id)
            .collect()
    }

    /// The unit that contains a transition; `None` if the transition is an item of the body itself.
    pub(super) fn unit_of(&self, net: &Net, body: BodyId, id: TransitionId) -> Option<Unit> {
        let transition = &net.transitions[id];
        match self.child_with(body, transition.part) {
            Some(child) if child != body => Some(Unit::Inner(child)),
            Some(_) | None => match transition.kind {
                TransitionKind::Reaction => {
                    transition.requires.first().map(|step| self.unit_of_step(*step))
                }
                TransitionKind::Move => None,
            },
        }
    }

    /// The body of a part.
    pub(super) fn home(&self, part: PartId) -> BodyId {
        self.of_part.get(&part).copied().unwrap_or(0)
    }
}

/// The enclosing step of each part: that of its steps or, for an empty part, the enclosing step of the same name.
fn enclosing(net: &Net) -> BTreeMap<PartId, StepId> {
    let mut found = BTreeMap::new();
    for step in net.steps.values() {
        if let Some(parent) = step.parent
            && net.steps[parent].kind == StepKind::Enclosing
            && net.steps[parent].part < step.part
        {
            found.entry(step.part).or_insert(parent);
        }
    }
    for (id, step) in net.steps.iter().filter(|(_, step)| step.kind == StepKind::Enclosing) {
        if let Some((part, _)) = net.parts.iter().find(|(_, part)| part.name.text == step.name.text)
            && part > step.part
            && !found.values().any(|known| *known == id)
        {
            found.entry(part).or_insert(id);
        }
    }
    found
}

fn taken(net: &Net) -> BTreeSet<String> {
    let names = net.steps.values().map(|one| &one.name);
    let names = names.chain(net.transitions.values().map(|one| &one.name));
    let names = names
        .chain(net.inputs.values().map(|one| &one.name))
        .chain(net.outputs.values().map(|one| &one.name));
    let names = names
        .chain(net.vars.values().map(|one| &one.name))
        .chain(net.timers.values().map(|one| &one.name));
    let names = names
        .chain(net.macros.iter().map(|one| &one.name))
        .chain(net.parts.values().map(|one| &one.name));
    names.map(|name| name.text.rsplit('.').next().unwrap_or_default().to_owned()).gather()
}
