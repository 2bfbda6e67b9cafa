//! Settings, declarations, and the structure of nets that are not statecharts (invariants 4 to 6 and 20 to 25).

use super::Checker;
use super::expressions::Place;
use super::statements::ListKind;
use crate::arena::IdMap;
use crate::codes;
use crate::diag::counted;
use crate::expr::Type;
use crate::net::{
    Enter, Evolution, ForcingOrder, InputKind, Leaf, MAX_LIMIT, OpenCell, Part, PartId, PlacedItem,
    Step, StepId, StepKind, Transition, TransitionKind,
};
use crate::span::Span;
use petgraph::algo::kosaraju_scc;
use petgraph::graph::DiGraph;
use std::collections::BTreeSet;

impl Checker<'_> {
    pub(super) fn settings(&mut self) {
        let settings = &self.net.settings;
        let span = self.net.name.span;
        self.at_least_one(Some(settings.tick_ns), span, "the tick in nanoseconds");
        self.at_least_one(settings.queue.map(u64::from), span, "the bound of the queue");
        if let Evolution::Stable { limit } = settings.evolution {
            self.at_least_one(Some(u64::from(limit)), span, "the limit of micro-steps");
            if limit > MAX_LIMIT {
                let message = format!("the limit of micro-steps is above {MAX_LIMIT}");
                self.report(codes::BAD_TYPE, span, message);
            }
        }
    }

    pub(super) fn parts(&mut self) {
        let net = self.net;
        if net.parts.is_empty() {
            self.report(codes::HIERARCHY, net.name.span, "the net has no partial chart");
        }
        for part in net.parts.values() {
            let (name, span) = (&part.name, part.name.span);
            self.at_least_one(
                Some(u64::from(part.level)),
                span,
                &format!("the level of the partial chart `{name}`"),
            );
            self.at_least_one(
                part.priority.map(u64::from),
                span,
                &format!("the priority of the partial chart `{name}`"),
            );
        }
    }

    pub(super) fn declarations(&mut self) {
        let net = self.net;
        for input in net.inputs.values() {
            let (name, span) = (&input.name, input.name.span);
            self.range(input.ty, span, name);
            if input.kind.is_event() && !input.ty.is_bool() {
                self.report(
                    codes::BAD_TYPE,
                    span,
                    format!("the event `{name}` has a range, but an event must be Boolean"),
                );
            }
        }
        for output in net.outputs.values() {
            self.range(output.ty, output.name.span, &output.name);
        }
        for var in net.vars.values() {
            let (name, span) = (&var.name, var.name.span);
            self.range(var.ty, span, name);
            if var.len == Some(0) {
                self.report(codes::BAD_TYPE, span, format!("the array `{name}` has no elements"));
            }
            let wanted = var.len.unwrap_or(1) as usize;
            if var.init.len() != 1 && var.init.len() != wanted {
                let given = var.init.len();
                let given = counted(given, "value", "values");
                let wanted = counted(wanted, "element", "elements");
                let message = format!("`{name}` has {given} at reset, but {wanted}");
                self.report_with_help(
                    codes::BAD_INIT,
                    span,
                    message,
                    "give one value for all elements, or one for each",
                );
            }
            let (lo, hi) = var.ty.bounds();
            if let Some(value) = var.init.iter().find(|value| **value < lo || **value > hi) {
                self.report(
                    codes::BAD_INIT,
                    span,
                    format!("`{name}` is {value} at reset, but its range is {lo}..{hi}"),
                );
            }
        }
    }

    pub(super) fn range(&mut self, ty: Type, span: Span, what: impl std::fmt::Display) {
        let Type::Int { lo, hi } = ty else { return };
        let fits = |value| i32::try_from(value).is_ok();
        if lo > hi {
            let message = format!("the range {lo}..{hi} of `{what}` is empty");
            self.report_with_help(codes::BAD_TYPE, span, message, format!("write {hi}..{lo}"));
        } else if !fits(lo) || !fits(hi) {
            self.report(
                codes::BAD_TYPE,
                span,
                format!("the range {lo}..{hi} of `{what}` exceeds 32 bits"),
            );
        }
    }

    /// Runs the checks that apply to transitions of all kinds; further checks depend on the kind of chart.
    pub(super) fn transitions(&mut self) {
        let net = self.net;
        for (id, transition) in net.transitions.iter() {
            let span = transition.name.span;
            let step_name = |id: StepId| net.steps.get(id).map(|step| step.name.text.clone());
            self.has(&net.parts, transition.part, span, "partial chart");
            for step in transition.requires.iter().chain(&transition.clears) {
                self.has(&net.steps, *step, span, "step");
            }
            self.entered(&transition.enters, span);
            self.twice(&transition.requires, span, "the preceding steps", step_name);
            self.twice(&transition.clears, span, "the steps that are left", step_name);
            self.twice(&entered_steps(&transition.enters), span, "the following steps", step_name);
            let event_name = |id| net.inputs.get(id).map(|event| event.name.text.clone());
            self.twice(&transition.events, span, "the events", event_name);
            for event in &transition.events {
                if self.has(&net.inputs, *event, span, "event")
                    && !net.inputs[*event].kind.is_event()
                {
                    let name = &net.inputs[*event].name;
                    let message =
                        format!("`{name}` is used after `on`, but it is an input, not an event");
                    self.report_with_help(
                        codes::TRANSITION,
                        span,
                        message,
                        format!("write `when {name}`"),
                    );
                }
            }
            self.condition(&transition.guard, Place::Guard(id));
            let what = format!("the priority of the transition `{}`", transition.name);
            self.at_least_one(transition.priority.map(u64::from), span, &what);
            self.list(&transition.actions, Place::List, ListKind::Free, 0);
            if transition.kind == TransitionKind::Reaction {
                self.reaction(transition);
            }
        }
    }

    /// Checks the ids in a list of entries.
    pub(super) fn entered(&mut self, enters: &[Enter], span: Span) {
        for enter in enters {
            match *enter {
                Enter::Step(step) | Enter::InitialContent(step) => {
                    self.has(&self.net.steps, step, span, "step")
                }
                Enter::History(history) => self.has(&self.net.histories, history, span, "history"),
            };
        }
    }

    fn reaction(&mut self, reaction: &Transition) {
        let (name, span) = (&reaction.name, reaction.name.span);
        if reaction.requires.len() != 1
            || !reaction.clears.is_empty()
            || !reaction.enters.is_empty()
        {
            let message = format!(
                "the reaction `{name}` must belong to exactly one step and must not enter or leave steps"
            );
            self.report(codes::TRANSITION, span, message);
        }
        if reaction.priority.is_some() {
            let message = format!("the reaction `{name}` has a priority, but it never competes");
            self.report(codes::TRANSITION, span, message);
        }
    }

    pub(super) fn grafcet_structure(&mut self) {
        self.no_statechart_parts();
        self.enclosures();
        for transition in self.net.transitions.values() {
            self.grafcet_transition(transition);
        }
        self.forcing();
        self.beginnings();
    }

    fn no_statechart_parts(&mut self) {
        let net = self.net;
        let code = codes::WRONG_WORLD;
        if net.settings.queue.is_some() {
            self.report(
                code,
                net.name.span,
                "a queue bound is set, but only statecharts have queues",
            );
        }
        for slot in net.sends.values() {
            self.report(
                code,
                slot.name.span,
                format!("`{}` sends events, but only statecharts do", slot.name),
            );
        }
        for history in net.histories.values() {
            self.report(
                code,
                history.name.span,
                format!("`{}` is a history, but only statecharts have them", history.name),
            );
        }
        for part in net.parts.values().filter(|part| !part.initial.is_empty()) {
            let message = format!(
                "the partial chart `{}` enters states at reset, but only statecharts do",
                part.name
            );
            self.report_with_help(code, part.name.span, message, "mark initial steps instead");
        }
        for step in net.steps.values() {
            let what = match step.kind {
                StepKind::Composite | StepKind::Parallel | StepKind::Final => {
                    "is a state of a statechart"
                }
                StepKind::Leaf | StepKind::Enclosing if step.done_event.is_some() => {
                    "raises an event when complete"
                }
                StepKind::Leaf | StepKind::Enclosing if !step.initial_content.is_empty() => {
                    "has an initial transition"
                }
                StepKind::Leaf | StepKind::Enclosing => continue,
            };
            let message =
                format!("`{}` {what}, but the conflict policy is not for a statechart", step.name);
            self.report_with_help(
                code,
                step.name.span,
                message,
                "use `conflict inner-first` or `conflict outer-first`",
            );
        }
    }

    /// Checks the parents of steps, and that no transition crosses the border of an enclosure.
    fn enclosures(&mut self) {
        let net = self.net;
        let mut parent_of: IdMap<Part, Option<Option<StepId>>> = IdMap::filled(&net.parts, None);
        for (id, step) in net.steps.iter() {
            let (name, span) = (&step.name, step.name.span);
            self.at_least_one(
                step.priority.map(u64::from),
                span,
                &format!("the priority of the step `{name}`"),
            );
            if step.activation_link && step.parent.is_none() {
                let message =
                    format!("the step `{name}` has an activation link, but no step encloses it");
                self.report(codes::HIERARCHY, span, message);
            }
            let part_ok = self.has(&net.parts, step.part, span, "partial chart");
            if part_ok {
                match parent_of[step.part] {
                    None => parent_of[step.part] = Some(step.parent),
                    Some(parent) if parent == step.parent => {}
                    Some(_) => {
                        let part = &net.parts[step.part].name;
                        let message = format!(
                            "steps of the partial chart `{part}` are in different enclosing steps"
                        );
                        self.report(codes::HIERARCHY, span, message);
                    }
                }
            }
            let Some(parent_id) = step.parent else { continue };
            if !self.has(&net.steps, parent_id, span, "step") {
                continue;
            }
            let parent = &net.steps[parent_id];
            if parent_id >= id {
                let message =
                    format!("`{}` encloses `{name}`, but is declared after it", parent.name);
                self.report(codes::HIERARCHY, span, message);
            } else if parent.kind != StepKind::Enclosing {
                let message = format!(
                    "the parent of `{name}` is `{}`, which is not an enclosing step",
                    parent.name
                );
                self.report(codes::HIERARCHY, span, message);
            } else if let (Some(inner), Some(outer)) =
                (net.parts.get(step.part), net.parts.get(parent.part))
                && inner.level <= outer.level
            {
                let (inner_level, outer_level) = (inner.level, outer.level);
                let message = format!(
                    "`{name}` has level {inner_level}, but the step `{}` that encloses it has level {outer_level}",
                    parent.name
                );
                self.report(codes::HIERARCHY, span, message);
            }
        }
    }

    fn grafcet_transition(&mut self, transition: &Transition) {
        let net = self.net;
        let (name, span) = (&transition.name, transition.name.span);
        if transition.enters.iter().any(|enter| !matches!(enter, Enter::Step(_))) {
            let message =
                format!("the transition `{name}` enters a history or runs initial content");
            self.report(codes::WRONG_WORLD, span, message);
        }
        if transition.kind == TransitionKind::Reaction {
            return;
        }
        if transition.clears != transition.requires {
            let message = format!(
                "the transition `{name}` leaves steps that differ from those that enable it"
            );
            self.report(codes::TRANSITION, span, message);
        }
        if transition.requires.is_empty() && transition.enters.is_empty() {
            let message =
                format!("the transition `{name}` has neither a preceding nor a following step");
            self.report(codes::TRANSITION, span, message);
        }
        let parents = transition.requires.iter().copied().chain(entered_steps(&transition.enters));
        let mut parents = parents.filter_map(|step| net.steps.get(step)).map(|step| step.parent);
        if let Some(first) = parents.next()
            && parents.any(|other| other != first)
        {
            let message = format!("the transition `{name}` crosses the border of an enclosure");
            self.report(codes::TRANSITION, span, message);
        }
    }

    fn forcing(&mut self) {
        let net = self.net;
        let mut graph: DiGraph<PartId, ()> = DiGraph::new();
        let nodes = IdMap::build(&net.parts, |id, _| graph.add_node(id));
        let mut stamp = IdMap::filled(&net.parts, usize::MAX);
        let mut links: Option<IdMap<_, Vec<StepId>>> = None;
        for (index, forcing) in net.forcings.iter().enumerate() {
            let span = forcing.span;
            let mut ok = self.has(&net.steps, forcing.step, span, "step");
            for part in &forcing.target {
                ok &= self.has(&net.parts, *part, span, "partial chart");
            }
            if !ok {
                continue;
            }
            if forcing.target.is_empty() {
                self.report(codes::FORCING, span, "the forcing order has no target chart");
            }
            let part_name = |id| net.parts.get(id).map(|part: &Part| part.name.text.clone());
            self.twice(&forcing.target, span, "the forced charts", part_name);
            let Some(from) =
                net.parts.get(net.steps[forcing.step].part).map(|_| net.steps[forcing.step].part)
            else {
                continue;
            };
            for part in &forcing.target {
                stamp[*part] = index;
                graph.add_edge(nodes[from], nodes[*part], ());
            }
            let ForcingOrder::Situation(steps) = &forcing.order else { continue };
            let is_forced =
                |part: PartId| net.parts.get(part).is_some_and(|_| stamp[part] == index);
            self.situation(steps, span, is_forced, &mut links);
        }
        self.forcing_cycles(&graph);
    }

    /// A situation that is forced: its steps are in the forced charts, and contain what their enclosing steps activate.
    fn situation(
        &mut self,
        steps: &[StepId],
        span: Span,
        is_forced: impl Fn(PartId) -> bool,
        links: &mut Option<IdMap<Step, Vec<StepId>>>,
    ) {
        let net = self.net;
        let mut listed = BTreeSet::new();
        for step in steps {
            if !self.has(&net.steps, *step, span, "step") {
                continue;
            }
            listed.insert(*step);
            let step = &net.steps[*step];
            if !is_forced(step.part) {
                self.report(
                    codes::FORCING,
                    span,
                    format!("the step `{}` is not in the chart that is forced", step.name),
                );
            }
        }
        self.twice(steps, span, "the forced situation", |id| {
            net.steps.get(id).map(|step| step.name.text.clone())
        });
        let is_enclosing = |step: &StepId| {
            net.steps.get(*step).is_some_and(|step| step.kind == StepKind::Enclosing)
        };
        if !steps.iter().any(is_enclosing) {
            return;
        }
        let links = links.get_or_insert_with(|| {
            let mut links = IdMap::filled(&net.steps, Vec::new());
            for (id, step) in net.steps.iter().filter(|(_, step)| step.activation_link) {
                if let Some(parent) = step.parent.filter(|parent| net.steps.get(*parent).is_some())
                {
                    links[parent].push(id);
                }
            }
            links
        });
        for step in
            listed.iter().flat_map(|step| &links[*step]).filter(|step| !listed.contains(step))
        {
            let name = &net.steps[*step].name;
            let message = format!(
                "the forced situation does not contain `{name}`, which its enclosing step activates"
            );
            self.report(codes::FORCING, span, message);
        }
    }

    /// Reports partial charts that force themselves.
    fn forcing_cycles(&mut self, graph: &DiGraph<PartId, ()>) {
        let net = self.net;
        for cycle in kosaraju_scc(graph) {
            let first = cycle.iter().min().copied();
            if let Some(first) = first
                && (cycle.len() > 1 || graph.contains_edge(first, first))
            {
                let part = graph[first];
                let order = net.forcings.iter().find(|forcing| forcing.target.contains(&part));
                let span = order.map_or(net.name.span, |order| order.span);
                let name = &net.parts[part].name;
                let message =
                    format!("the partial chart `{name}` forces itself, directly or through others");
                self.report_with_help(
                    codes::FORCING,
                    span,
                    message,
                    "move the forcing orders to a chart of a higher level",
                );
            }
        }
    }

    fn beginnings(&mut self) {
        let net = self.net;
        let mut has_steps = IdMap::filled(&net.parts, false);
        let mut begins = IdMap::filled(&net.parts, false);
        // An initial macro-step also starts a chart: initial steps of its parts count for the root part before them.
        let mut root = PartId::from_index(0);
        let root_of = IdMap::build(&net.parts, |id, part| {
            if part.level <= 1 {
                root = id;
            }
            root
        });
        for step in net.steps.values().filter(|step| net.parts.get(step.part).is_some()) {
            has_steps[step.part] = true;
            begins[step.part] |= step.is_initial || step.parent.is_some();
            begins[root_of[step.part]] |= step.is_initial;
        }
        for transition in net.transitions.values() {
            if transition.requires.is_empty() && net.parts.get(transition.part).is_some() {
                begins[transition.part] = true;
                begins[root_of[transition.part]] = true;
            }
        }
        for part in net
            .forcings
            .iter()
            .flat_map(|forcing| &forcing.target)
            .filter(|part| net.parts.get(**part).is_some())
        {
            begins[*part] = true;
        }
        for (id, part) in net.parts.iter() {
            if part.level == 1 && has_steps[id] && !begins[id] && !part.is_cut {
                let message = format!(
                    "the chart `{}` has no initial step, so it can never become active",
                    part.name
                );
                self.report_with_help(
                    codes::NO_BEGINNING,
                    part.name.span,
                    message,
                    "mark the step in which it starts as initial",
                );
            }
        }
    }

    /// Checks that a net in which END waits makes rounds, and that its condition cannot change between the check and END.
    fn ending(&mut self) {
        let net = self.net;
        let Some(ending) = &net.ending else { return };
        let span = ending.waits.span;
        if net.settings.evolution != Evolution::Single {
            let message = "`ending` is only allowed with `evolution single`";
            self.report(codes::SETTINGS, span, message.to_owned());
        }
        let is_pin = |leaf: &Leaf| {
            let input = leaf.input().and_then(|id| net.inputs.get(id));
            input.is_some_and(|input| input.kind == InputKind::Pin)
        };
        if !ending.waits.leaves().all(is_pin) {
            let message = "the condition of `ending` reads something other than an input pin";
            self.report(codes::NOT_READABLE, span, message.to_owned());
        }
    }

    /// Checks open cells, macro-steps and placements.
    pub(super) fn rest(&mut self) {
        let net = self.net;
        for open in &net.unspecified {
            if let OpenCell::Output(output) = open.what {
                self.has(&net.outputs, output, open.when.span, "output");
            }
        }
        self.emergency();
        self.ending();
        for drawn in &net.macros {
            let (name, span) = (&drawn.name, drawn.name.span);
            for step in &drawn.steps {
                self.has(&net.steps, *step, span, "step");
            }
            let step_name = |id: StepId| net.steps.get(id).map(|step| step.name.text.clone());
            self.twice(&drawn.steps, span, "the steps of the macro-step", step_name);
            for (step, what) in [(drawn.entry, "entry"), (drawn.exit, "exit")] {
                if self.has(&net.steps, step, span, "step") && !drawn.steps.contains(&step) {
                    let message = format!(
                        "the {what} step of the macro-step `{name}` is not one of its steps"
                    );
                    self.report(codes::MACRO, span, message);
                }
            }
        }
        for placement in &net.placements {
            let span = placement.span;
            match placement.item {
                PlacedItem::Step(id) => self.has(&net.steps, id, span, "step"),
                PlacedItem::Var(id) => self.has(&net.vars, id, span, "variable"),
                PlacedItem::Transition(id) => self.has(&net.transitions, id, span, "transition"),
                PlacedItem::Output(id) => self.has(&net.outputs, id, span, "output"),
            };
        }
    }

    /// True if this input is an event, external or internal.
    pub(super) fn is_event(&self, id: crate::net::InputId) -> bool {
        self.net
            .inputs
            .get(id)
            .is_some_and(|input| matches!(input.kind, InputKind::Event | InputKind::InternalEvent))
    }
}

/// The steps among the entries.
pub(super) fn entered_steps(enters: &[Enter]) -> Vec<StepId> {
    enters
        .iter()
        .filter_map(|enter| match enter {
            Enter::Step(step) => Some(*step),
            Enter::InitialContent(_) | Enter::History(_) => None,
        })
        .collect()
}
