//! The layout of seed 002: a table of states, `BSTATE`, with descendant, sibling and ancestor, and a table of transitions, `BTRANS`, with origin, event,
//! destination, guard and action, sorted by event with an index in front.
//!
//! `grafsynth_btrans.c` is one text for all charts. It finds what a transition leaves and enters as the paper's engine does: the nearest common ancestor of
//! origin and destination, all active states in it from the inside out, then the way down to the destination, all regions of concurrent states, and
//! descendants by default until every way ends in an atomic state. Where the paper is silent or its scheme not enough, the rows say more:
//!
//! | gap of the paper | here |
//! |---|---|
//! | every entry of a state with history takes what it remembers | a destination is the state, or one of its histories, shallow or deep |
//! | several transitions may leave the same states | inner or outer first, then the order of the rows (semantics.md §5) |
//! | transitions in several regions on one event | all fire together: exits, actions, entries over all of them |
//! | a transition within its origin, or without a destination | kind 1 stays in the origin, kind 2 acts only |
//! | the search goes through all transitions | only the rows of the event |
//! | no time, no data | timers of states, variables, edges; guards and actions are rules, numbered functions beside the tables |
//!
//! The net says for each transition what it leaves and enters, so the tables are checked: for each row that is found here, the engine's own rule must give just
//! that, or the chart is refused.

use super::handing::{as_type, clear_words, hand_in, hand_out};
use super::{Plan, lit, member};
use crate::cexpr::{CExpr, Class, Helpers, Prec, Scope, c_expr, saturated};
use crate::cprogram::{CProgram, Engine, with_unused};
use crate::ctext::{Arm, Kind, Node, Writer};
use crate::names::Names;
use crate::switch::Refusal;
use crate::times::Ticks;
use crate::{Object, Options};
use grafsynth_ir::expr::Type;
use grafsynth_ir::interval;
use grafsynth_ir::net::{
    Block, Driver, Enter, Evolution, Expr, Leaf, Net, Stmt, StmtKind, Transition, TransitionKind,
};
use grafsynth_ir::{IdMap, Span};
use std::collections::{BTreeMap, BTreeSet};

/// The files that every chart in this layout has alike.
const FILES: [(&str, &str); 2] = [
    ("grafsynth_btrans.h", include_str!("grafsynth_btrans.h")),
    ("grafsynth_btrans.c", include_str!("grafsynth_btrans.c")),
];

type Tabled<T = ()> = Result<T, Refusal>;

fn refuse<T>(what: impl Into<String>, span: Span) -> Tabled<T> {
    Err(Refusal { what: what.into(), span })
}

/// How a transition moves, as its row says it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Move {
    External = 0,
    Internal = 1,
    Stays = 2,
}

/// Where a transition goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Goal {
    kind: Move,
    to: usize,
    history: Option<usize>,
}

/// The states as numbers: children, and who is entered by default.
struct Tree {
    parent: Vec<Option<usize>>,
    children: Vec<Vec<usize>>,
    last: Vec<usize>,
    parallel: Vec<bool>,
    default: Vec<Option<usize>>,
}

impl Tree {
    fn of(plan: &Plan<'_>) -> Self {
        let net = plan.net;
        let parent: Vec<Option<usize>> =
            net.steps.values().map(|step| step.parent.map(|it| it.index())).collect();
        let mut children = vec![Vec::new(); parent.len()];
        for (at, parent) in parent.iter().enumerate() {
            if let Some(parent) = parent {
                children[*parent].push(at);
            }
        }
        let is_parallel = |kind| kind == grafsynth_ir::net::StepKind::Parallel;
        let parallel = net.steps.values().map(|step| is_parallel(step.kind)).collect();
        let default = children.iter().map(|all| all.first().copied()).collect();
        Tree { parent, children, last: plan.last.clone(), parallel, default }
    }

    /// The most frequent child of each state among what is entered, in place of the first one.
    fn vote(&mut self, net: &Net) {
        let mut votes: BTreeMap<(usize, usize), usize> = BTreeMap::new();
        for list in net.transitions.values().map(|it| &it.enters) {
            for step in steps(list) {
                if let Some(parent) = self.parent[step] {
                    *votes.entry((parent, step)).or_default() += 1;
                }
            }
        }
        for (state, default) in self.default.iter_mut().enumerate() {
            let count = |child: &usize| votes.get(&(state, *child)).copied().unwrap_or(0);
            let best = self.children[state].iter().rev().max_by_key(|child| count(child));
            *default = best.copied();
        }
    }

    fn is_in(&self, state: usize, outer: Option<usize>) -> bool {
        outer.is_none_or(|outer| state > outer && state <= self.last[outer])
    }

    /// As `gb_domain`.
    fn domain(&self, from: usize, goal: Goal) -> Option<usize> {
        let mut up = Some(from);
        if goal.kind == Move::External {
            loop {
                up = up.and_then(|state| self.parent[state]);
                if up.is_none_or(|it| !self.parallel[it]) && self.is_in(goal.to, up) {
                    break;
                }
            }
        }
        up
    }

    /// As `gb_path`; none where the way does not lead to the domain.
    fn path(&self, state: usize, domain: Option<usize>) -> Option<Vec<usize>> {
        let mut way = Vec::new();
        let mut up = Some(state);
        while up != domain {
            way.push(up?);
            up = up.and_then(|it| self.parent[it]);
        }
        Some(way)
    }

    /// As `gb_descend`; nothing is entered below `closed` by default.
    fn descend(&self, marked: &mut BTreeSet<usize>, closed: Option<usize>) {
        for state in 0..self.parent.len() {
            if !marked.contains(&state) || closed == Some(state) {
                continue;
            }
            if self.parallel[state] {
                marked.extend(&self.children[state]);
            }
            if !self.children[state].iter().any(|child| marked.contains(child)) {
                marked.extend(self.default[state]);
            }
        }
    }

    /// Whether the engine does with this goal what the net says of the transition.
    fn explains(&self, from: usize, goal: Goal, transition: &Transition) -> bool {
        let domain = self.domain(from, goal);
        let range = match domain {
            Some(domain) => domain + 1..self.last[domain] + 1,
            None => 0..self.parent.len(),
        };
        let clears: BTreeSet<usize> = transition.clears.iter().map(|it| it.index()).collect();
        let Some(way) = self.path(goal.to, domain) else { return false };
        let mut marked: BTreeSet<usize> = way.into_iter().collect();
        let owner = goal.history.map(|_| goal.to);
        self.descend(&mut marked, owner);
        range.eq(clears) && marked == steps(&transition.enters).collect()
    }
}

fn steps(list: &[Enter]) -> impl Iterator<Item = usize> {
    list.iter().filter_map(|enter| match enter {
        Enter::Step(step) => Some(step.index()),
        Enter::InitialContent(_) | Enter::History(_) => None,
    })
}

/// Guards, actions and the like as numbered pieces of C.
struct Rules<'a> {
    plan: &'a Plan<'a>,
    names: &'a Names,
    cases: Vec<Node>,
    /// Those so far by their text; equal ones are one.
    known: BTreeMap<String, u16>,
}

impl Rules<'_> {
    fn add(&mut self, mut body: Vec<Node>) -> u16 {
        let number = self.cases.len() + 1;
        body.push(Node::line("break;"));
        self.cases.push(Kind::Case(vec![format!("case {number}U:")], body).into());
        super::image::narrow(number)
    }

    /// The rule that gives a value; always a new one.
    fn fresh(&mut self, expr: &Expr) -> Tabled<u16> {
        let body = self.giving(expr)?;
        Ok(self.add(body))
    }

    fn giving(&self, expr: &Expr) -> Tabled<Vec<Node>> {
        let value = self.value(expr)?;
        let text = if matches!(value.class, Class::Bool) {
            format!("value = gb_truth({});", value.text)
        } else {
            format!("value = {};", value.cast(Class::Wide).text)
        };
        Ok(vec![Node::line(text)])
    }

    /// The rule of a condition; 0 where it is always true.
    fn guard(&mut self, expr: &Expr) -> Tabled<u16> {
        if expr.is_true() {
            return Ok(0);
        }
        let body = self.giving(expr)?;
        Ok(self.shared(body))
    }

    /// The rule of a list; 0 where it is empty.
    fn list(&mut self, block: &Block) -> Tabled<u16> {
        let body = self.block(block)?;
        Ok(if body.is_empty() { 0 } else { self.shared(body) })
    }

    fn shared(&mut self, body: Vec<Node>) -> u16 {
        let text = Writer::write(&body).0;
        if let Some(known) = self.known.get(&text) {
            return *known;
        }
        let number = self.add(body);
        self.known.insert(text, number);
        number
    }

    fn value(&self, expr: &Expr) -> Tabled<CExpr> {
        self.fits(expr)?;
        Ok(c_expr(expr, &mut Reader { plan: self.plan, names: self.names }))
    }

    /// The tables have no helpers for 64 bits, and read times where they have a timer.
    fn fits(&self, expr: &Expr) -> Tabled {
        use grafsynth_ir::expr::ExprKind;
        match &expr.kind {
            ExprKind::Neg(_) | ExprKind::Arith(..) => {
                let bounds = interval::net_type(self.plan.net, expr).map(Type::bounds);
                if !bounds
                    .is_ok_and(|(lo, hi)| i32::try_from(lo).is_ok() && i32::try_from(hi).is_ok())
                {
                    return refuse("a value of more than 32 bits", expr.span);
                }
            }
            ExprKind::Leaf(leaf) => {
                let what = match *leaf {
                    Leaf::Input(input) => self.plan.net.inputs[input]
                        .kind
                        .is_event()
                        .then_some("an event in a condition"),
                    Leaf::Elapsed(step) => (!self.plan.timers.contains_key(&step))
                        .then_some("a time that is compared with no constant"),
                    Leaf::Var(_) | Leaf::Active(_) | Leaf::Rise(_) | Leaf::Fall(_) => None,
                    Leaf::LastElapsed(_) => Some("the time `T` of a step"),
                    Leaf::TasksDone(_) => Some("tasks"),
                    Leaf::Timer(_) => Some("a free timer"),
                    Leaf::Fireable(_) => Some("`otherwise`"),
                    Leaf::Controlled(_) => Some("a controlled action"),
                };
                if let Some(what) = what {
                    return refuse(what, expr.span);
                }
            }
            ExprKind::Element(..) => return refuse("an array", expr.span),
            ExprKind::Bool(_)
            | ExprKind::Int(_)
            | ExprKind::Not(_)
            | ExprKind::And(_)
            | ExprKind::Or(_)
            | ExprKind::Compare(..)
            | ExprKind::Select(..) => {}
        }
        expr.operands().try_for_each(|operand| self.fits(operand))
    }

    fn block(&self, block: &Block) -> Tabled<Vec<Node>> {
        let mut nodes = Vec::new();
        for stmt in block {
            nodes.extend(self.stmt(stmt)?);
        }
        Ok(nodes)
    }

    fn stmt(&self, stmt: &Stmt) -> Tabled<Vec<Node>> {
        let span = stmt.span;
        match &stmt.kind {
            StmtKind::Assign { var, index: None, value } => {
                let ty = self.plan.net.vars[*var].ty;
                let place = format!("run->values[{}]", var.index());
                let value = self.value(value)?;
                let text = if ty.is_bool() {
                    format!("{place} = gb_truth({});", value.text)
                } else {
                    let (lo, hi) = ty.bounds();
                    let mut helpers = Helpers::default();
                    let inside = saturated(value.clone(), ty, &self.names.prefix, &mut helpers);
                    if helpers == Helpers::default() {
                        format!("{place} = {};", inside.cast(Class::Wide).text)
                    } else {
                        let value = value.cast(Class::Wide).text;
                        let (lo, hi) = (CExpr::int(lo).text, CExpr::int(hi).text);
                        format!("{place} = gb_between({value}, {lo}, {hi});")
                    }
                };
                Ok(vec![Node::line(text).about(Object::Var(*var))])
            }
            StmtKind::Assign { index: Some(_), .. } => refuse("an array", span),
            // What nothing listens to is lost.
            StmtKind::Raise(event) if !self.plan.listened.contains(event) => Ok(Vec::new()),
            StmtKind::Raise(_) => refuse("`raise`", span),
            StmtKind::Send(_) | StmtKind::Cancel(_) => refuse("`send`", span),
            StmtKind::Call { .. } => refuse("an extern action", span),
            StmtKind::Code(_) => refuse("text of another language", span),
            StmtKind::If { condition, then, otherwise } => {
                let condition = self.value(condition)?;
                let (then, otherwise) = (self.block(then)?, self.block(otherwise)?);
                Ok(crate::calls::either(condition, then, otherwise))
            }
        }
    }
}

/// Reads what an engine keeps.
struct Reader<'a> {
    plan: &'a Plan<'a>,
    names: &'a Names,
}

impl Scope<Leaf> for Reader<'_> {
    fn prefix(&self) -> &str {
        &self.names.prefix
    }

    fn leaf(&mut self, leaf: &Leaf) -> CExpr {
        let net = self.plan.net;
        let number = |text: String, ty: Type| {
            if ty.is_bool() {
                CExpr::condition(format!("{text} != 0"), Prec::Compare)
            } else {
                CExpr::exact(text, Prec::Atom, Class::Wide, ty.bounds())
            }
        };
        match *leaf {
            Leaf::Input(input) => {
                let at = self.plan.inputs[input].unwrap_or_default();
                number(format!("run->in[{at}]"), net.inputs[input].ty)
            }
            Leaf::Var(var) => number(format!("run->values[{}]", var.index()), net.vars[var].ty),
            Leaf::Active(step) => {
                CExpr::condition(format!("gb_bit(run->active, {}U)", step.index()), Prec::Atom)
            }
            Leaf::Elapsed(step) => match self.plan.timers.get(&step) {
                Some((at, cap)) => {
                    let ty = Type::Int { lo: 0, hi: i64::from(*cap) };
                    number(format!("run->time[{at}]"), ty)
                }
                None => CExpr::int(0),
            },
            Leaf::Rise(edge) => {
                CExpr::condition(format!("gb_rise(run, {}U)", edge.index()), Prec::Atom)
            }
            Leaf::Fall(edge) => {
                CExpr::condition(format!("gb_fall(run, {}U)", edge.index()), Prec::Atom)
            }
            Leaf::LastElapsed(_)
            | Leaf::TasksDone(_)
            | Leaf::Timer(_)
            | Leaf::Fireable(_)
            | Leaf::Controlled(_) => unreachable!("`fits` refuses it"),
        }
    }

    fn element(&mut self, _: &Leaf, _: &CExpr) -> CExpr {
        unreachable!("`fits` refuses arrays")
    }
}

/// The net in this layout.
///
/// # Errors
/// What it uses that these tables have no columns for.
pub(crate) fn program(net: &Net, names: &Names, options: &Options) -> Tabled<CProgram> {
    let span = net.name.span;
    if !net.settings.policy.is_statechart() {
        return refuse("a chart that is no statechart", span);
    }
    if options.trace.is_some() {
        return refuse("a trace ring", span);
    }
    if net.parts.len() > 1 {
        return refuse("charts side by side", span);
    }
    let plan = Plan::of(net)?;
    let kind = plan.kind()?;
    let order = plan.order(kind)?;
    let Evolution::Stable { limit } = net.settings.evolution else {
        return refuse("`evolution single`", span);
    };
    let Ok(limit) = u16::try_from(limit) else {
        return refuse("more than 65535 micro-steps in a reaction", span);
    };
    if let Some(step) = net.steps.values().find(|step| !step.initial_content.is_empty()) {
        return refuse("content of an initial transition", step.meta.span);
    }
    let (tree, goals) = goals(&plan)?;
    let mut rules = Rules { plan: &plan, names, cases: Vec::new(), known: BTreeMap::new() };
    for edge in net.edges.values() {
        rules.fresh(&edge.expr)?;
    }
    for (id, output) in net.outputs.iter() {
        let value = match &output.driver {
            Driver::Continuous(emissions) => lit(emissions),
            Driver::Stored(var) => Expr::leaf(Leaf::Var(*var), output.meta.span),
            Driver::Mealy(_) => return refuse("a mealy output", output.meta.span),
            Driver::Controlled(_) => return refuse("a controlled action", output.meta.span),
            Driver::Extern { .. } => return refuse("an extern action", output.meta.span),
        };
        rules.fresh(&net.forced(id, value))?;
    }
    let mut tables = Tables::new(names);
    let mut remembered = 0;
    states(&plan, &tree, &mut rules, &mut tables)?;
    transitions(&plan, &order, &goals, &mut rules, &mut tables)?;
    histories(&plan, &tree, &mut rules, &mut tables, &mut remembered)?;
    let caps = plan.timers.values().map(|(_, cap)| cap.to_string());
    tables.add("int32_t", "caps", "where times stop", caps.map(|it| (it, String::new())).collect());
    let values = net
        .vars
        .values()
        .map(|var| (var.init.first().copied().unwrap_or(0).to_string(), var.name.to_string()));
    tables.add("int32_t", "start", "variables at reset", values.collect());
    let mut initial = Vec::new();
    for enter in net.parts.values().flat_map(|part| &part.initial) {
        match enter {
            Enter::Step(step) => {
                initial.push((format!("{}U", step.index()), net.steps[*step].name.to_string()));
            }
            Enter::InitialContent(_) => {}
            Enter::History(_) => return refuse("a history that is entered at reset", span),
        }
    }
    let n_initial = initial.len();
    tables.add("uint16_t", "initial", "entered at reset", initial);
    if tables.most > usize::from(u16::MAX) - 1 || rules.cases.len() > usize::from(u16::MAX) - 1 {
        return refuse("tables of more than 65534 rows", span);
    }
    let cap = plan.timers.values().map(|(_, cap)| i64::from(*cap)).max();
    let ticks = cap.map(Ticks::for_cap);
    let counts = [
        ("states", net.steps.len()),
        ("events", tables.n_events),
        ("histories", net.histories.len()),
        ("timers", plan.timers.len()),
        ("edges", net.edges.len()),
        ("vars", net.vars.len()),
        ("initials", n_initial),
        ("remembered", remembered),
        ("limit", usize::from(limit)),
        ("most", usize::from(plan.most_atomic())),
    ];
    let inner = net.settings.policy == grafsynth_ir::net::Policy::InnerFirst;
    let rule = rule(names, rules.cases);
    Ok(emit(net, names, &plan, ticks, tables.finish(rule, &counts, inner), remembered))
}

/// For each transition where it goes, with defaults that explain all of them.
fn goals<'a>(plan: &Plan<'a>) -> Tabled<(Tree, Vec<Goal>)> {
    let net: &'a Net = plan.net;
    let mut tree = Tree::of(plan);
    let mut found = all_goals(net, &tree);
    if found.is_err() {
        tree.vote(net);
        found = all_goals(net, &tree);
    }
    let goals = found?;
    for history in net.histories.values() {
        let owner = history.owner.index();
        let way = |state: usize| tree.path(state, Some(owner));
        for case in &history.cases {
            let Some(way) = way(case.step.index()) else {
                return refuse("a history of states outside of its owner", history.meta.span);
            };
            let way: BTreeSet<usize> = way.into_iter().collect();
            let mut closed = way.clone();
            tree.descend(&mut closed, None);
            let entered: BTreeSet<usize> = steps(&case.enters).collect();
            if entered != way && entered != closed
                || case.enters.iter().any(|it| matches!(it, Enter::History(_)))
            {
                return refuse("a history that enters more than it remembers", history.meta.span);
            }
        }
    }
    Ok((tree, goals))
}

fn all_goals(net: &Net, tree: &Tree) -> Tabled<Vec<Goal>> {
    net.transitions.values().map(|transition| goal(net, tree, transition)).collect()
}

fn goal(net: &Net, tree: &Tree, transition: &Transition) -> Tabled<Goal> {
    let from = transition.requires.first().map_or(0, |step| step.index());
    if transition.kind == TransitionKind::Reaction {
        return Ok(Goal { kind: Move::Stays, to: from, history: None });
    }
    let histories: Vec<usize> = transition
        .enters
        .iter()
        .filter_map(|enter| match enter {
            Enter::History(history) => Some(history.index()),
            Enter::Step(_) | Enter::InitialContent(_) => None,
        })
        .collect();
    let targets: Vec<(usize, Option<usize>)> = match histories.as_slice() {
        [] => steps(&transition.enters).map(|state| (state, None)).collect(),
        [history] => {
            let owner = net.histories.iter().nth(*history).map(|(_, it)| it.owner.index());
            owner.map(|owner| (owner, Some(*history))).into_iter().collect()
        }
        _ => return refuse("a transition to several histories", transition.meta.span),
    };
    for kind in [Move::External, Move::Internal] {
        for (to, history) in &targets {
            let goal = Goal { kind, to: *to, history: *history };
            if tree.explains(from, goal, transition) {
                return Ok(goal);
            }
        }
    }
    refuse(
        "a transition with several destinations, or one whose way the tables of states do not tell",
        transition.meta.span,
    )
}

/// The tables as text.
struct Tables {
    prefix: String,
    nodes: Vec<Node>,
    most: usize,
    n_events: usize,
}

impl Tables {
    fn new(names: &Names) -> Self {
        Tables { prefix: names.prefix.clone(), nodes: Vec::new(), most: 0, n_events: 0 }
    }

    /// A constant array; one that has nothing gets a row of zeros, since C has no empty ones.
    fn add(&mut self, ty: &str, name: &str, title: &str, rows: Vec<(String, String)>) {
        self.most = self.most.max(rows.len());
        let mut body: Vec<Node> = rows
            .into_iter()
            .map(|(text, note)| Node::line(format!("{text},")).note(note))
            .collect();
        if body.is_empty() {
            let zero = if ty.starts_with("gb_") { "{ 0U }," } else { "0," };
            body.push(Node::line(zero));
        }
        let n = body.len();
        let head = format!("static GB_ROM {ty} {}_{name}[{n}] =", self.prefix);
        self.nodes.push(Node::comment(title));
        self.nodes.push(Kind::Braces(head, body, ";".to_owned()).into());
        self.nodes.push(Node::blank());
    }

    fn finish(self, rule: Vec<Node>, counts: &[(&str, usize)], inner: bool) -> Vec<Node> {
        let prefix = &self.prefix;
        let mut nodes = vec![Node::directive(format!("#include \"{prefix}.h\"")), Node::blank()];
        nodes.extend(rule);
        nodes.extend(self.nodes);
        let mut body = vec![Node::line(format!("{prefix}_rule,"))];
        for table in ["bstate", "btrans", "bevent", "bhistory", "caps", "start", "initial"] {
            body.push(Node::line(format!("{prefix}_{table},")));
        }
        for (name, count) in counts {
            body.push(Node::line(format!("{count}U,")).note(*name));
        }
        body.push(Node::line(format!("{inner},")).note("inner transitions first"));
        nodes.push(
            Kind::Braces(format!("const gb_chart_t {prefix}_chart ="), body, ";".to_owned()).into(),
        );
        nodes
    }
}

fn or_none(number: Option<usize>) -> String {
    number.map_or_else(|| "GB_NONE".to_owned(), |number| format!("{number}U"))
}

fn states(plan: &Plan<'_>, tree: &Tree, rules: &mut Rules<'_>, tables: &mut Tables) -> Tabled {
    let net = plan.net;
    let roots: Vec<usize> =
        (0..tree.parent.len()).filter(|state| tree.parent[*state].is_none()).collect();
    let mut rows = Vec::new();
    for (id, step) in net.steps.iter() {
        let at = id.index();
        let ring = tree.parent[at].map_or(&roots, |parent| &tree.children[parent]);
        let place = ring.iter().position(|it| *it == at).unwrap_or(0);
        let sibling = ring[(place + 1) % ring.len()];
        let mut status = vec![match (tree.children[at].is_empty(), tree.parallel[at]) {
            (true, _) => "GB_ATOMIC",
            (false, true) => "GB_CONCURRENT",
            (false, false) => "GB_HIERARCHICAL",
        }];
        if net.histories.values().any(|it| it.owner == id) {
            status.push("GB_HIST");
        }
        let timer = plan.timers.get(&id).map(|(number, _)| usize::from(*number));
        let text = format!(
            "{{ {}, {sibling}U, {}, {}U, {}, {}, {}U, {}U }}",
            or_none(tree.default[at]),
            or_none(tree.parent[at]),
            tree.last[at],
            status.join(" | "),
            or_none(timer),
            rules.list(&step.entry)?,
            rules.list(&step.exit)?,
        );
        rows.push((text, step.name.to_string()));
    }
    let title =
        "BSTATE: descendant, sibling, ancestor, last descendant, status, timer, entry, exit";
    tables.add("gb_state_t", "bstate", title, rows);
    Ok(())
}

fn transitions(
    plan: &Plan<'_>,
    order: &[grafsynth_ir::net::TransitionId],
    goals: &[Goal],
    rules: &mut Rules<'_>,
    tables: &mut Tables,
) -> Tabled {
    let net = plan.net;
    let outside = net.inputs.iter().filter(|(id, it)| {
        it.kind == grafsynth_ir::net::InputKind::Event && plan.listened.contains(id)
    });
    let events = std::iter::once(None).chain(outside.map(|(id, _)| Some(id)));
    let (mut rows, mut index) = (Vec::new(), Vec::new());
    for event in events {
        let mut on: Vec<_> = order
            .iter()
            .copied()
            .filter(|id| match event {
                None => net.transitions[*id].events.is_empty(),
                Some(event) => net.transitions[*id].events.contains(&event),
            })
            .collect();
        on.sort_by_key(|id| (net.transitions[*id].requires.first().copied(), *id));
        let input = event.and_then(|event| plan.inputs[event]).map(usize::from);
        let name = event.map_or("no event", |event| net.inputs[event].name.text.as_str());
        let text = format!("{{ {}, {}U, {}U }}", or_none(input), rows.len(), on.len());
        index.push((text, name.to_owned()));
        for id in on {
            let (transition, goal) = (&net.transitions[id], goals[id.index()]);
            let from = transition.requires.first().map_or(0, |step| step.index());
            let kind = ["GB_EXTERNAL", "GB_INTERNAL", "GB_STAYS"][goal.kind as usize];
            let text = format!(
                "{{ {from}U, {}U, {kind}, {}, {}U, {}U }}",
                goal.to,
                or_none(goal.history),
                rules.guard(&transition.guard)?,
                rules.list(&transition.actions)?,
            );
            rows.push((text, format!("{} on {name}", transition.name)));
        }
    }
    tables.n_events = index.len();
    let title = "BTRANS: from, to, kind, history, guard, action; sorted by event";
    tables.add("gb_trans_t", "btrans", title, rows);
    tables.add("gb_event_t", "bevent", "The index by event: input, first row, rows", index);
    Ok(())
}

fn histories(
    plan: &Plan<'_>,
    tree: &Tree,
    rules: &mut Rules<'_>,
    tables: &mut Tables,
    remembered: &mut usize,
) -> Tabled {
    let mut rows = Vec::new();
    for history in plan.net.histories.values() {
        let owner = history.owner.index();
        let deep = history.cases.iter().any(|case| tree.parent[case.step.index()] != Some(owner));
        let mut to = None;
        let entered: BTreeSet<usize> = steps(&history.default).collect();
        for state in steps(&history.default) {
            let Some(way) = tree.path(state, Some(owner)) else { continue };
            let mut marked: BTreeSet<usize> = way.into_iter().collect();
            tree.descend(&mut marked, None);
            if marked == entered {
                to = Some(state);
                break;
            }
        }
        let Some(to) = to else {
            return refuse("a history with several defaults", history.meta.span);
        };
        let text = format!(
            "{{ {owner}U, {}U, {remembered}U, {to}U, {}U }}",
            u8::from(deep),
            rules.list(&history.default_content)?
        );
        *remembered += tree.last[owner] - owner;
        rows.push((text, history.name.to_string()));
    }
    let title = "Histories: owner, deep, first bit, default, its rule";
    tables.add("gb_history_t", "bhistory", title, rows);
    Ok(())
}

/// The rules as one function.
fn rule(names: &Names, mut cases: Vec<Node>) -> Vec<Node> {
    cases.push(Kind::Case(vec!["default:".to_owned()], vec![Node::line("break;")]).into());
    let body = vec![
        Node::line("int32_t value = 0;"),
        Kind::Block(vec![Arm::new("switch (run->number)", cases)]).into(),
        Node::line("return value;"),
    ];
    vec![
        Node::comment("Guards, actions, entries, exits, operands of edges, outputs."),
        Node::function(format!("static int32_t {}_rule(gb_run_t *run)", names.prefix), body),
        Node::blank(),
    ]
}

// --- NAME.h and NAME.c -----------------------------------------------------------------------------------------------------------------------------

fn emit(
    net: &Net,
    names: &Names,
    plan: &Plan<'_>,
    ticks: Option<Ticks>,
    tables: Vec<Node>,
    remembered: usize,
) -> CProgram {
    let (prefix, upper) = (&names.prefix, &names.upper);
    let states = net.steps.len();
    let edges = net.edges.len();
    let sizes = [
        ("ACTIVE", (states + remembered + edges).div_ceil(8).max(1)),
        ("TIMES", plan.timers.len().max(1)),
        ("VALUES", net.vars.len().max(1)),
        ("MARKS", (2 * states + net.histories.len() + edges).div_ceil(8).max(1)),
        ("CHOSEN", usize::from(plan.most_atomic()).max(1)),
    ];
    let instance = vec![
        member(&format!("uint8_t active[{upper}_ACTIVE]"), "states, histories, edges"),
        member(&format!("int32_t time[{upper}_TIMES]"), "times of states"),
        member(&format!("int32_t values[{upper}_VALUES]"), "variables"),
        member("bool fault", "the last reaction did not come to rest"),
    ];
    let inputs: Vec<_> =
        plan.inputs.iter().filter_map(|(id, at)| Some((id, usize::from((*at)?)))).collect();
    let run = |reset: bool| {
        let mut body = vec![
            Node::line(format!("int32_t inputs[{}];", inputs.len().max(1))),
            Node::line(format!("uint8_t marks[{upper}_MARKS];")),
            Node::line(format!("uint16_t chosen[{upper}_CHOSEN];")),
            Node::line("gb_run_t run;"),
        ];
        body.extend(hand_in(net, names, &inputs, "inputs", reset));
        for (name, value) in [
            ("chart", format!("&{prefix}_chart")),
            ("active", "self->active".to_owned()),
            ("time", "self->time".to_owned()),
            ("values", "self->values".to_owned()),
            ("in", "inputs".to_owned()),
            ("marks", "marks".to_owned()),
            ("chosen", "chosen".to_owned()),
            ("n_chosen", "0U".to_owned()),
            ("number", "0U".to_owned()),
            ("fresh", "false".to_owned()),
        ] {
            body.push(Node::line(format!("run.{name} = {value};")));
        }
        let clear = format!("for (uint16_t i = 0U; i < {upper}_MARKS; ++i)");
        body.push(Node::block(clear, vec![Node::line("marks[i] = 0U;")]));
        if reset {
            // Bits behind the last one are the same every time.
            body.push(super::clear_array(&format!("{upper}_ACTIVE"), "self->active[i] = 0U;"));
            body.push(super::clear_array(&format!("{upper}_TIMES"), "self->time[i] = 0;"));
            body.push(super::clear_array(&format!("{upper}_VALUES"), "self->values[i] = 0;"));
        }
        let dt = if ticks.is_some() { "dt" } else { "0U" };
        let call = if reset { "gb_init(&run)".to_owned() } else { format!("gb_step(&run, {dt})") };
        body.push(Node::line(format!("self->fault = {call};")));
        body.extend(clear_words(names));
        let outputs = net.outputs.iter().enumerate();
        let outputs = outputs.map(|(at, (id, _))| (id, format!("gb_output(&run, {at}U)")));
        body.extend(hand_out(net, names, outputs));
        body
    };
    let values = net
        .vars
        .iter()
        .map(|(id, var)| (id, as_type(var.ty, &format!("self->values[{}]", id.index()))));
    let mut before = vec![Node::comment("Room of an instance and of a reaction.")];
    for (name, size) in sizes {
        before.push(Node::directive(format!("#define {upper}_{name} {size}U")));
    }
    before.extend([
        Node::blank(),
        Node::comment("The tables."),
        Node::line(format!("extern const gb_chart_t {prefix}_chart;")),
    ]);
    let parameters = ["self"];
    CProgram {
        style: "btrans",
        instance,
        enumerators: Vec::new(),
        active: IdMap::build(&net.steps, |id, _| format!("gb_bit(self->active, {}U)", id.index())),
        fault: Some("self->fault".to_owned()),
        has_fault: true,
        ticks,
        tables: Vec::new(),
        functions: Vec::new(),
        init: with_unused(&parameters, run(true)),
        step: run(false),
        helpers: Helpers::default(),
        ranges: Vec::new(),
        one_bit: std::collections::BTreeSet::new(),
        engine: Some(Engine {
            files: &FILES,
            instructions: None,
            include: "grafsynth_btrans.h",
            before,
            declarations: Vec::new(),
            values: values.collect(),
            image: Vec::new(),
            tables,
        }),
    }
}
