//! Turns graphs into a chart: each function becomes a macro, each call a macro-step, each node a step.
//!
//! ```text
//! int twice(int n) { return 2 * n; }   =>   macro twice { var n, result  entry step enter  step return_ {..}  exit step end }
//!                                           ready -> run when start do { run.n := n }     run -> finished do { result := run.result }
//! ```
//!
//! Parameters are latched when the macro-step is entered. Every `return` leads to the single exit step of the macro.

use super::flow::{self, Context, Externs, Names, Question};
use super::frame::{comment_at, frame, globals};
use super::graph::{CallSite, Graph, Next, NodeId};
use super::pieces::{declaration, meta};
use super::resolve::{FunctionId, Home, Program, VarId};
use super::shorten::{self, successors};
use super::texts::{comment_text, one_line};
use super::{Calls, library};
use crate::findings::Findings;
use grafsynth_ir::Gather;
use grafsynth_ir::chart::{
    Block, Chart, DeclarationKind, Design, Expr, Item, Leaf, Macro, MacroStep, Path, Setting,
    SettingKind, Step, StepItem, StepItemKind, StepRole, StmtKind, Transition,
};
use grafsynth_ir::expr::Type as NetType;
use grafsynth_ir::net::{Meta, Policy};
use grafsynth_ir::{Name, Span};
use std::collections::{BTreeMap, BTreeSet};

/// Builds the chart of a source, and the text of its library if it needs one.
pub(super) fn draw(
    program: &Program<'_>,
    findings: &mut Findings,
) -> Option<(Design, Option<String>)> {
    let used = used_functions(program);
    let mut top = Names::default();
    let mut var_names = BTreeMap::new();
    // Globals keep their names if possible, because other files and functions use them.
    for (id, var) in program.vars.iter().enumerate() {
        if var.home == Home::Global && !var.in_library && is_current(program, id) {
            var_names.insert(id, top.plain(&var.name.text));
        }
    }
    let macros: BTreeMap<FunctionId, String> =
        used.iter().map(|id| (*id, top.fresh(&program.functions[*id].def.name.text))).gather();
    let shared = shared_steps(program, &used, &mut top);
    let mut externs = Externs::default();
    // No extern function gets the name of a function of the source.
    for id in &used {
        externs.names.fresh(&program.functions[*id].def.name.text);
    }
    let mut function_names: Vec<Names> =
        used.iter().map(|id| local_names(program, *id, &top, &mut var_names)).collect();
    let context = Context { program, var_names: &var_names, shared: &shared };
    let graphs: Vec<_> = (used.iter().zip(&mut function_names))
        .map(|(id, names)| flow::graph(&context, *id, names, &mut externs, findings))
        .collect();
    let lasting: BTreeSet<String> = program
        .vars
        .iter()
        .enumerate()
        .filter(|(_, var)| var.home == Home::Global && (var.is_volatile || var.is_extern))
        .filter_map(|(id, _)| var_names.get(&id).cloned())
        .gather();
    let settings = [SettingKind::Conflict(Policy::Priority), SettingKind::EvolutionSingle];
    let setting = |kind| Item::Setting(Setting { kind, span: Span::default() });
    let mut items: Vec<Item> = settings.map(setting).into();
    items.extend(globals(program, &var_names, findings));
    items.extend(extern_items(&externs));
    let mut bodies = Vec::new();
    for ((id, mut graph), mut names) in used.iter().zip(graphs).zip(function_names) {
        attach_comments(program, *id, &mut graph);
        shorten::shorten(&mut graph, program.options.fuse, &lasting);
        let mut drawing = Drawing {
            program,
            graph,
            names: &mut names,
            macros: &macros,
            steps: BTreeMap::new(),
            part_names: BTreeMap::new(),
            members: BTreeMap::new(),
            ends: (String::new(), String::new()),
        };
        let items = drawing.function(*id, &var_names);
        let def = program.functions[*id].def;
        let head = def.span.start as usize..def.body.span.start as usize;
        let label = one_line(program.text.get(head).unwrap_or(""));
        let meta = Meta { span: def.span, label, req: Vec::new() };
        bodies.push(Item::Macro(Macro {
            name: Name::new(macros[id].clone(), def.name.span),
            items,
            meta,
        }));
    }
    items.extend(frame(program, &var_names, &macros, &shared, top, bodies));
    // The chart needs a different name from the function: `build --target c` writes NAME.c, which must not overwrite the source file.
    let function = &program.functions[program.entry].def.name;
    let name = Name::new(format!("{function}_chart"), function.span);
    let chart = Chart {
        name: name.clone(),
        span: program.functions[program.entry].def.span,
        items,
        ..Chart::default()
    };
    let library = library::write(program, &chart.name.text, &externs, &used);
    Some((Design { charts: vec![chart], ..Design::default() }, library))
}

/// Names the variables of a function in its own namespace, which begins with the names of the `top`.
fn local_names(
    program: &Program<'_>,
    id: FunctionId,
    top: &Names,
    var_names: &mut BTreeMap<VarId, String>,
) -> Names {
    let mut names = top.clone();
    for (var_id, var) in program.vars.iter().enumerate().filter(|(_, var)| !var.in_library) {
        if matches!(var.home, Home::Local(f) | Home::Param(f, _) | Home::Result(f) if f == id) {
            var_names.insert(var_id, names.fresh(&var.name.text));
        }
    }
    names
}

/// Whether the name of a variable still refers to it: a definition may have replaced an `extern` declaration.
fn is_current(program: &Program<'_>, id: VarId) -> bool {
    program.uses.values().any(|used| *used == id)
        || program.vars[id].is_extern && program.vars[id].is_volatile
}

/// The functions that the chart needs, in source order.
fn used_functions(program: &Program<'_>) -> Vec<FunctionId> {
    let mut seen: BTreeSet<_> = [program.entry].into_iter().gather();
    let mut open = vec![program.entry];
    while let Some(id) = open.pop() {
        for (callee, _) in &program.functions[id].calls {
            if !program.functions[*callee].is_kept && seen.insert(*callee) {
                open.push(*callee);
            }
        }
    }
    seen.into_iter().collect()
}

/// With `--calls share`: one macro-step for each function with several calls.
fn shared_steps(
    program: &Program<'_>,
    used: &[FunctionId],
    names: &mut Names,
) -> BTreeMap<FunctionId, String> {
    if program.options.calls != Calls::Share {
        return BTreeMap::new();
    }
    let mut n_calls: BTreeMap<FunctionId, usize> = BTreeMap::new();
    for id in used {
        for (callee, _) in &program.functions[*id].calls {
            *n_calls.entry(*callee).or_default() += 1;
        }
    }
    let is_shared = |id: &&FunctionId| {
        n_calls.get(id).is_some_and(|n| *n > 1) && !program.functions[**id].is_kept
    };
    used.iter()
        .filter(is_shared)
        .map(|id| (*id, names.fresh(&format!("run_{}", program.functions[*id].def.name))))
        .gather()
}

fn extern_items(externs: &Externs) -> Vec<Item> {
    let mut items = Vec::new();
    for Question { name, text, range, span } in &externs.conditions {
        let ty = range.map_or(NetType::Bool, |(lo, hi)| NetType::Int { lo, hi });
        items.push(declaration(
            name,
            *span,
            DeclarationKind::ExternCondition { ty },
            one_line(text),
        ));
    }
    for (name, text, span) in &externs.actions {
        items.push(declaration(
            name,
            *span,
            DeclarationKind::ExternAction { params: Vec::new() },
            one_line(text),
        ));
    }
    items
}

/// Attaches each comment to the statement that contains it or ends on its line, otherwise to the following statement.
fn attach_comments(program: &Program<'_>, id: FunctionId, graph: &mut Graph) {
    let body = program.functions[id].def.body.span;
    let inside = program
        .source
        .comments
        .iter()
        .filter(|comment| comment.start >= body.start && comment.end <= body.end);
    // Simple statements and conditions in source order; they do not overlap.
    let mut places: Vec<(u32, u32, NodeId)> = Vec::new();
    for (id, node) in graph.nodes.iter().enumerate() {
        if node.span.end > node.span.start && (!node.text.is_empty() || node.is_test) {
            places.push((node.span.start, node.span.end, id));
        }
    }
    places.sort_unstable();
    for comment in inside {
        let next = places.partition_point(|(start, ..)| *start < comment.start);
        let behind = places.get(next).map(|(_, _, id)| *id);
        let before = next.checked_sub(1).map(|at| places[at]);
        // A statement that continues after the comment contains the comment. Otherwise the comment belongs to the statement that ends on its line.
        let is_before = |(_, end, _): &(u32, u32, NodeId)| {
            let gap = program.text.get(*end as usize..comment.start as usize);
            *end >= comment.end || gap.is_some_and(|gap| !gap.contains('\n'))
        };
        let held = before.filter(is_before).map(|(_, _, id)| id);
        let last = before.map(|(_, _, id)| id);
        let node = held.or(behind).or(last).unwrap_or(graph.start);
        graph.nodes[node].comments.push(comment_text(program.text_of(*comment)));
    }
}

/// State of the translation of one function into items.
struct Drawing<'p, 's> {
    program: &'p Program<'s>,
    graph: Graph,
    names: &'p mut Names,
    macros: &'p BTreeMap<FunctionId, String>,
    /// The step of each node.
    steps: BTreeMap<NodeId, String>,
    /// For each part that becomes a macro-step: the names of the macro-step and of its macro.
    part_names: BTreeMap<usize, (String, String)>,
    /// Nodes of each part, including those of its inner parts.
    members: BTreeMap<usize, BTreeSet<NodeId>>,
    /// The names that the first and the last step have on every level.
    ends: (String, String),
}

impl Drawing<'_, '_> {
    fn function(&mut self, id: FunctionId, var_names: &BTreeMap<VarId, String>) -> Vec<Item> {
        let mut items = Vec::new();
        for (var_id, var) in self.program.vars.iter().enumerate() {
            let is_mine =
                matches!(var.home, Home::Local(f) | Home::Param(f, _) | Home::Result(f) if f == id);
            let (true, Some(name), Some(scalar)) = (is_mine, var_names.get(&var_id), var.scalar())
            else {
                continue;
            };
            // The result of the entry function is omitted if it is never used, as in a function that never returns.
            let is_result = matches!(var.home, Home::Result(_));
            if is_result && id == self.program.entry && !self.is_used(name) {
                continue;
            }
            let kind =
                DeclarationKind::Var { ty: scalar.stored(), len: var.length(), init: Vec::new() };
            let comment = var
                .declared
                .and_then(|_| comment_at(self.program, var.name.span))
                .unwrap_or_default();
            items.push(declaration(name, var.name.span, kind, comment));
        }
        for (name, ty) in self.graph.temps.clone() {
            if self.is_used(&name) {
                items.push(declaration(
                    &name,
                    self.program.functions[id].def.name.span,
                    DeclarationKind::Var { ty, len: None, init: Vec::new() },
                    String::new(),
                ));
            }
        }
        self.parts();
        let order = self.order();
        // Every level begins with `enter` and ends with `end`, so no other step gets these names.
        let (enter, end) = (self.names.fresh("enter"), self.names.fresh("end"));
        for part in 1..self.graph.parts.len() {
            if self.members.contains_key(&part) {
                let wanted = self.graph.parts[part].name.clone();
                let step = self.names.fresh(&wanted);
                let body = self.names.fresh(&format!("{step}_body"));
                self.part_names.insert(part, (step, body));
            }
        }
        for node in &order {
            let hint = self.graph.nodes[*node].hint.clone();
            let name = if matches!(self.graph.nodes[*node].next, Next::Exit) {
                end.clone()
            } else if *node == self.graph.start {
                enter.clone()
            } else {
                self.names.fresh(if hint.is_empty() { "step" } else { &hint })
            };
            self.steps.insert(*node, name);
        }
        self.ends = (enter, end);
        items.extend(self.level(0, &order));
        items
    }

    fn is_used(&self, name: &str) -> bool {
        let is_it = |path: &Path| path.names.len() == 1 && path.names[0].text == name;
        let in_expr =
            |expr: &Expr| expr.leaves().any(|leaf| matches!(leaf, Leaf::Name(path) if is_it(path)));
        let in_block = |block: &Block| {
            block.iter().any(|stmt| {
                matches!(&stmt.kind, StmtKind::Assign { target, index, value }
                    if is_it(target) || index.iter().any(in_expr) || in_expr(value))
            })
        };
        self.graph.nodes.iter().any(|node| {
            in_block(&node.body)
                || match &node.next {
                    Next::Branch(ways, _) => ways.iter().any(|way| in_expr(&way.guard)),
                    Next::Call(site, _) => in_block(&site.latches),
                    Next::None | Next::Goto(_) | Next::Exit => false,
                }
        })
    }

    /// The nodes in source order, with the start node first and the exit node last.
    fn order(&self) -> Vec<NodeId> {
        let mut all: Vec<NodeId> = (0..self.graph.nodes.len()).collect();
        all.sort_by_key(|id| {
            let node = &self.graph.nodes[*id];
            (*id != self.graph.start, matches!(node.next, Next::Exit), node.span.start, *id)
        });
        all
    }

    /// Decides which parts become macro-steps: those with at least two nodes, one entry and one exit, and without the start and the end of
    /// the function. The nodes of other parts belong to the enclosing part.
    fn parts(&mut self) {
        for part in (1..self.graph.parts.len()).rev() {
            let members: BTreeSet<NodeId> = (0..self.graph.nodes.len())
                .filter(|id| self.is_inside(self.graph.nodes[*id].group, part))
                .gather();
            let has_end = members.iter().any(|id| {
                *id == self.graph.start || matches!(self.graph.nodes[*id].next, Next::Exit)
            });
            let (entries, exits) = self.border(&members);
            if members.len() >= 2 && entries.len() == 1 && exits.len() == 1 && !has_end {
                self.members.insert(part, members);
                continue;
            }
            let parent = self.graph.parts[part].parent;
            if let (1, Some(only), false) =
                (members.len(), members.first().copied(), self.graph.parts[part].text.is_empty())
            {
                self.graph.nodes[only].hint.clone_from(&self.graph.parts[part].name);
            }
            for node in &mut self.graph.nodes {
                if node.group == part {
                    node.group = parent;
                }
            }
            for inner in &mut self.graph.parts {
                if inner.parent == part {
                    inner.parent = parent;
                }
            }
        }
    }

    fn is_inside(&self, group: usize, part: usize) -> bool {
        let mut at = group;
        loop {
            if at == part {
                return true;
            }
            if at == 0 {
                return false;
            }
            at = self.graph.parts[at].parent;
        }
    }

    /// The entry nodes of a set of nodes, and the nodes outside the set to which its nodes lead.
    fn border(&self, members: &BTreeSet<NodeId>) -> (BTreeSet<NodeId>, BTreeSet<NodeId>) {
        let (mut entries, mut exits) = (BTreeSet::new(), BTreeSet::new());
        for (id, node) in self.graph.nodes.iter().enumerate() {
            for to in successors(&node.next) {
                match (members.contains(&id), members.contains(&to)) {
                    (false, true) => {
                        entries.insert(to);
                    }
                    (true, false) => {
                        exits.insert(to);
                    }
                    (true, true) | (false, false) => {}
                }
            }
        }
        (entries, exits)
    }

    /// The items of one level: the function or a part of it.
    fn level(&mut self, part: usize, order: &[NodeId]) -> Vec<Item> {
        let mut macros = Vec::new();
        let mut steps = Vec::new();
        let mut transitions = Vec::new();
        let span = self.graph.nodes[self.graph.start].span;
        let (begin, end) = self.ends.clone();
        if part != 0 {
            let members = self.members[&part].clone();
            let entry = self.border(&members).0.first().copied().unwrap_or(self.graph.start);
            steps.push(plain_step(&begin, StepRole::MacroEntry, span));
            let target = self.target(entry, part, &end);
            transitions.push(self.transition(&begin, target, None, "", span));
        }
        let mut drawn_parts = BTreeSet::new();
        for node in order {
            let group = self.graph.nodes[*node].group;
            if group == part {
                self.node(*node, part, &end, &mut steps, &mut transitions);
            } else if let Some(child) = self.child_of(group, part)
                && drawn_parts.insert(child)
            {
                let (step, body) = self.part_names[&child].clone();
                let label = self.graph.parts[child].text.clone();
                let items = self.level(child, order);
                let at = self.graph.nodes[*node].span;
                macros.push(Item::Macro(Macro {
                    name: Name::new(body.clone(), at),
                    items,
                    meta: meta(at, label.clone()),
                }));
                steps.push(Item::MacroStep(MacroStep {
                    name: Name::new(step.clone(), at),
                    body: Name::new(body, at),
                    meta: meta(at, label),
                    ..MacroStep::default()
                }));
                let members = self.members[&child].clone();
                if let Some(exit) = self.border(&members).1.first().copied() {
                    let target = self.target(exit, part, &end);
                    transitions.push(self.transition(&step, target, None, "", at));
                }
            }
        }
        if part != 0 {
            steps.push(plain_step(&end, StepRole::MacroExit, span));
        }
        macros.extend(steps);
        macros.extend(transitions);
        macros
    }

    /// The part directly inside `part` that contains a group.
    fn child_of(&self, group: usize, part: usize) -> Option<usize> {
        let mut at = group;
        while at != 0 {
            let parent = self.graph.parts[at].parent;
            if parent == part {
                return Some(at);
            }
            at = parent;
        }
        None
    }

    /// The step or macro-step that represents a node on a level; the end of the level if the node is outside.
    fn target(&self, node: NodeId, part: usize, end: &str) -> String {
        let group = self.graph.nodes[node].group;
        if group == part {
            return self.steps[&node].clone();
        }
        match self.child_of(group, part) {
            Some(child) if self.is_inside(group, part) => self.part_names[&child].0.clone(),
            _ => end.to_owned(),
        }
    }

    fn transition(
        &self,
        from: &str,
        to: String,
        guard: Option<Expr>,
        label: &str,
        span: Span,
    ) -> Item {
        let path = |name: &str| Path::from(Name::new(name, span));
        // A step that is entered from itself must run its statements again.
        let restart = from == to;
        Item::Transition(Transition {
            sources: vec![path(from)],
            targets: vec![path(&to)],
            guard,
            restart,
            meta: meta(span, label.to_owned()),
            ..Transition::default()
        })
    }

    fn node(
        &mut self,
        id: NodeId,
        part: usize,
        end: &str,
        steps: &mut Vec<Item>,
        transitions: &mut Vec<Item>,
    ) {
        let node = &self.graph.nodes[id];
        let (span, name) = (node.span, self.steps[&id].clone());
        let role = if id == self.graph.start {
            StepRole::MacroEntry
        } else if matches!(node.next, Next::Exit) {
            StepRole::MacroExit
        } else {
            StepRole::Plain
        };
        let body = if node.body.is_empty() {
            Vec::new()
        } else {
            vec![StepItem { kind: StepItemKind::Entry(node.body.clone()), span }]
        };
        let mut label = node.text.clone();
        for comment in &node.comments {
            if !label.is_empty() {
                label.push(' ');
            }
            label.push_str("/* ");
            label.push_str(comment);
            label.push_str(" */");
        }
        steps.push(Item::Step(Step {
            name: Name::new(name.clone(), span),
            role,
            body,
            meta: meta(span, label),
            ..Step::default()
        }));
        match node.next.clone() {
            Next::None | Next::Exit => {}
            Next::Goto(to) => {
                let target = self.target(to, part, end);
                transitions.push(self.transition(&name, target, None, "", span));
            }
            Next::Branch(ways, otherwise) => {
                let rest = Expr::leaf(Leaf::Otherwise, span);
                let ways = ways.into_iter().map(|way| (way.to, way.guard, way.text));
                for (to, guard, text) in ways.chain([(otherwise, rest, String::new())]) {
                    let target = self.target(to, part, end);
                    transitions.push(self.transition(&name, target, Some(guard), &text, span));
                }
            }
            Next::Call(site, then) => {
                let target = self.target(then, part, end);
                self.call(&name, &site, &target, steps, transitions);
            }
        }
    }

    /// A call: the macro-step of the function, or the shared one with a step that waits for it.
    fn call(
        &self,
        name: &str,
        site: &CallSite,
        target: &str,
        steps: &mut Vec<Item>,
        transitions: &mut Vec<Item>,
    ) {
        let path = |name: &str| Path::from(Name::new(name, site.span));
        let text = one_line(self.program.text_of(site.span));
        let mut into = Transition {
            sources: vec![path(name)],
            targets: vec![path(&site.step)],
            actions: site.latches.clone(),
            meta: meta(site.span, text.clone()),
            ..Transition::default()
        };
        let mut out = Transition {
            sources: vec![path(&site.step)],
            targets: vec![path(target)],
            meta: meta(site.span, String::new()),
            ..Transition::default()
        };
        match &site.wait {
            Some(wait) => {
                steps.push(Item::Step(Step {
                    name: Name::new(wait.clone(), site.span),
                    meta: meta(site.span, text),
                    ..Step::default()
                }));
                into.targets.push(path(wait));
                out.sources.push(path(wait));
            }
            None => {
                let body = Name::new(self.macros[&site.callee].clone(), site.span);
                steps.push(Item::MacroStep(MacroStep {
                    name: Name::new(site.step.clone(), site.span),
                    body,
                    meta: meta(site.span, text),
                    ..MacroStep::default()
                }));
            }
        }
        transitions.push(Item::Transition(into));
        transitions.push(Item::Transition(out));
    }
}

fn plain_step(name: &str, role: StepRole, span: Span) -> Item {
    Item::Step(Step {
        name: Name::new(name, span),
        role,
        meta: meta(span, String::new()),
        ..Step::default()
    })
}
