//! The table layout of the paper on statechart engines for CNC controllers. It has a table of states, `BSTATE`, with descendant, sibling and ancestor, and a
//! table of transitions, `BTRANS`, with origin, event, destination, guard and action, sorted by event and preceded by an index.
//!
//! `grafsynth_btrans.c` is the same text for all charts. It determines the states that a transition exits and enters as the paper's engine does: the nearest
//! common ancestor of origin and destination, all active states in it from the innermost outwards, then the path down to the destination, all regions of
//! concurrent states, and default descendants until every path ends in an atomic state. Where the paper is silent or insufficient, the rows contain more:
//!
//! | gap of the paper | here |
//! |---|---|
//! | every entry of a state with history restores the history | a destination is the state, or one of its histories, shallow or deep |
//! | several transitions may leave the same states | inner or outer first, then the order of the rows (semantics.md §5) |
//! | transitions in several regions on one event | all fire together: exits, actions, entries over all of them |
//! | a transition within its origin, or without a destination | kind 1 stays in the origin, kind 2 only runs its action |
//! | the search reads all transitions | only the rows of the event |
//! | no time, no data | timers of states, variables, edges; guards and actions are rules, numbered functions outside the tables |
//!
//! The net defines for each transition which states it exits and enters, so the tables are checked: for each row, the engine's own rule must give exactly
//! these states; otherwise the chart is rejected.

mod rules;
mod tree;

use super::handing::{as_type, clear_words, hand_in, hand_out};
use super::{Plan, member, shown};
use crate::c::print::Node;
use crate::names::Names;
use crate::refusal::Refusal;
use crate::style_output::{Engine, EngineFile, StyleOutput, with_unused};
use crate::times::Ticks;
use crate::{FileKind, Options};
use grafsynth_ir::Gather;
use grafsynth_ir::net::{Enter, Evolution, Net};
use grafsynth_ir::{IdMap, Span};
use rules::Rules;
use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use tree::{Goal, Tree, goals, steps};

/// The files that are the same for every chart in this layout.
pub(super) const FILES: [EngineFile; 2] = [
    (
        FileKind::EngineHeader,
        "grafsynth_btrans.h",
        Cow::Borrowed(include_str!("../grafsynth_btrans.h")),
    ),
    (
        FileKind::EngineSource,
        "grafsynth_btrans.c",
        Cow::Borrowed(include_str!("../grafsynth_btrans.c")),
    ),
];

/// The C type of the rows of a table.
#[derive(Clone, Copy)]
enum Row {
    Number(&'static str),
    Structure(&'static str),
}

type Tabled<T = ()> = Result<T, Refusal>;

fn refuse<T>(what: impl Into<String>, span: Span) -> Tabled<T> {
    Err(Refusal { what: what.into(), span })
}

/// Emits the net in this layout.
///
/// # Errors
/// If the net uses something that these tables have no columns for.
pub(crate) fn program(net: &Net, names: &Names, options: &Options) -> Tabled<StyleOutput> {
    let span = net.name.span;
    if !net.settings.policy.is_statechart() {
        return refuse("a chart that is not a statechart", span);
    }
    if options.trace.is_some() {
        return refuse("a trace ring", span);
    }
    if net.parts.len() > 1 {
        return refuse("several charts in one file", span);
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
        rules.fresh(&net.forced(id, shown(output)?))?;
    }
    let mut tables = Tables::new(names);
    let mut remembered = 0;
    states(&plan, &tree, &mut rules, &mut tables)?;
    transitions(&plan, &order, &goals, &mut rules, &mut tables)?;
    histories(&plan, &tree, &mut rules, &mut tables, &mut remembered)?;
    let caps = plan.timers.values().map(|(_, cap)| cap.to_string());
    tables.add(
        Row::Number("int32_t"),
        "caps",
        "maximum values of times",
        caps.map(|it| (it, String::new())).collect(),
    );
    let values = net
        .vars
        .values()
        .map(|var| (var.init.first().copied().unwrap_or(0).to_string(), var.name.to_string()));
    tables.add(Row::Number("int32_t"), "start", "variables at reset", values.collect());
    let n_initial = initial(net, &mut tables)?;
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

/// The states entered at reset; the result is their number.
fn initial(net: &Net, tables: &mut Tables) -> Tabled<usize> {
    let mut initial = Vec::new();
    for enter in net.parts.values().flat_map(|part| &part.initial) {
        match enter {
            Enter::Step(step) => {
                initial.push((format!("{}U", step.index()), net.steps[*step].name.to_string()));
            }
            Enter::InitialContent(_) => {}
            Enter::History(_) => {
                return refuse("a history that is entered at reset", net.name.span);
            }
        }
    }
    let n_initial = initial.len();
    tables.add(Row::Number("uint16_t"), "initial", "entered at reset", initial);
    Ok(n_initial)
}

/// The tables as text.
struct Tables {
    stem: String,
    prefix: String,
    nodes: Vec<Node>,
    most: usize,
    n_events: usize,
}

impl Tables {
    fn new(names: &Names) -> Self {
        Tables {
            stem: names.stem.clone(),
            prefix: names.prefix.clone(),
            nodes: Vec::new(),
            most: 0,
            n_events: 0,
        }
    }

    /// Adds a constant array; an empty one gets a row of zeros, because C has no empty arrays.
    fn add(&mut self, ty: Row, name: &str, title: &str, rows: Vec<(String, String)>) {
        self.most = self.most.max(rows.len());
        let mut body: Vec<Node> = rows
            .into_iter()
            .map(|(text, note)| Node::line(format!("{text},")).note(note))
            .collect();
        if body.is_empty() {
            let zero = match ty {
                Row::Number(_) => "0,",
                Row::Structure(_) => "{ 0U },",
            };
            body.push(Node::line(zero));
        }
        let n = body.len();
        let (Row::Number(ty) | Row::Structure(ty)) = ty;
        let head = format!("static GB_ROM {ty} {}_{name}[{n}] =", self.prefix);
        self.nodes.push(Node::comment(title));
        self.nodes.push(Node::braced(head, body));
        self.nodes.push(Node::blank());
    }

    fn finish(self, rule: Vec<Node>, counts: &[(&str, usize)], inner: bool) -> Vec<Node> {
        let prefix = &self.prefix;
        let mut nodes =
            vec![Node::directive(format!("#include \"{}.h\"", self.stem)), Node::blank()];
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
        nodes.push(Node::braced(format!("const gb_chart_t {prefix}_chart ="), body));
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
    tables.add(Row::Structure("gb_state_t"), "bstate", title, rows);
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
        on.sort_unstable_by_key(|id| (net.transitions[*id].requires.first().copied(), *id));
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
    tables.add(Row::Structure("gb_trans_t"), "btrans", title, rows);
    tables.add(
        Row::Structure("gb_event_t"),
        "bevent",
        "The index by event: input, first row, rows",
        index,
    );
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
        let entered: BTreeSet<usize> = steps(&history.default).gather();
        for state in steps(&history.default) {
            let Some(way) = tree.path(state, Some(owner)) else { continue };
            let mut marked: BTreeSet<usize> = way.into_iter().gather();
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
    tables.add(Row::Structure("gb_history_t"), "bhistory", title, rows);
    Ok(())
}

/// The rules as one function.
fn rule(names: &Names, cases: Vec<Node>) -> Vec<Node> {
    let body = vec![
        Node::line("int32_t value = 0;"),
        Node::switch("run->number", cases),
        Node::line("return value;"),
    ];
    Node::documented(
        "Guards, actions, entries, exits, operands of edges, outputs.",
        format!("static int32_t {}_rule(gb_run_t *run)", names.prefix),
        body,
    )
    .into()
}

// --- NAME.h and NAME.c -----------------------------------------------------------------------------------------------------------------------------

/// The body of `NAME_init` (`reset`) or `NAME_step`.
fn reaction(
    net: &Net,
    names: &Names,
    plan: &Plan<'_>,
    ticks: Option<Ticks>,
    reset: bool,
) -> Vec<Node> {
    let (prefix, upper) = (&names.prefix, &names.upper);
    let inputs: Vec<_> =
        plan.inputs.iter().filter_map(|(id, at)| Some((id, usize::from((*at)?)))).collect();
    let mut body = vec![
        Node::line(format!("int32_t inputs[{}];", inputs.len().max(1))),
        Node::line(format!("uint8_t marks[{upper}_MARKS];")),
        Node::line(format!("uint16_t chosen[{upper}_CHOSEN];")),
        Node::line("gb_run_t run;"),
    ];
    body.extend(hand_in(net, names, &inputs, "inputs", reset));
    body.extend(super::set_run(&[
        ("chart", &format!("&{prefix}_chart")),
        ("active", "self->active"),
        ("time", "self->time"),
        ("values", "self->values"),
        ("in", "inputs"),
        ("marks", "marks"),
        ("chosen", "chosen"),
        ("n_chosen", "0U"),
        ("number", "0U"),
        ("fresh", "false"),
    ]));
    let clear = format!("for (uint16_t i = 0U; i < {upper}_MARKS; ++i)");
    body.push(Node::block(clear, vec![Node::line("marks[i] = 0U;")]));
    if reset {
        // Unused bits are cleared too, because instances are compared byte by byte.
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
}

fn emit(
    net: &Net,
    names: &Names,
    plan: &Plan<'_>,
    ticks: Option<Ticks>,
    tables: Vec<Node>,
    remembered: usize,
) -> StyleOutput {
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
        member("bool fault", "the last reaction did not become stable"),
    ];
    let values = net
        .vars
        .iter()
        .map(|(id, var)| (id, as_type(var.ty, &format!("self->values[{}]", id.index()))));
    let mut before = vec![Node::comment("Sizes of an instance and of a reaction.")];
    for (name, size) in sizes {
        before.push(Node::directive(format!("#define {upper}_{name} {size}U")));
    }
    before.extend([
        Node::blank(),
        Node::comment("The tables."),
        Node::line(format!("extern const gb_chart_t {prefix}_chart;")),
    ]);
    StyleOutput {
        style: "btrans",
        instance,
        active: IdMap::build(&net.steps, |id, _| format!("gb_bit(self->active, {}U)", id.index())),
        fault: Some("self->fault".to_owned()),
        has_fault: true,
        ticks,
        init: with_unused(&["self"], reaction(net, names, plan, ticks, true)),
        step: reaction(net, names, plan, ticks, false),
        engine: Some(Engine {
            files: FILES.to_vec(),
            room: None,
            instructions: None,
            include: "grafsynth_btrans.h",
            before,
            declarations: Vec::new(),
            values: values.gather(),
            image: Vec::new(),
            tables,
        }),
        ..StyleOutput::default()
    }
}
