//! Random charts: random nets drawn as charts, with features that only charts have, and with odd names. Such features are several durations of one action, uses
//! that are delayed or limited, delays in receptivities, and macro-steps.
//!
//! Features that are impossible in a chart are left out of it, so that every resulting text is a chart without errors.

use grafsynth_ir::chart::{
    ActionHow, Chart, Design, Expr, Item, Leaf, Length, Macro, MacroStep, Setting, SettingKind,
    Step, StepCount, StepItem, StepItemKind, StepRole, Transition,
};
use grafsynth_ir::diag::any_error;
use grafsynth_ir::expr::ExprKind;
use grafsynth_ir::net::{Driver, InputKind, Meta, Net, Policy, Qualifier, VarOrigin};
use grafsynth_ir::{FileId, Name, Span, Valid, lower, validate};
use grafsynth_sim::Random;

use crate::random_net::{Features, name, random_net};

/// Names that are keywords of some language, differ in letter case only, or look like names that a writer generates.
const ODD_NAMES: [&str; 92] = [
    "STEP",
    "step",
    "Step",
    "IF",
    "if",
    "T",
    "t",
    "X",
    "x",
    "active",
    "end_step",
    "TON",
    "R",
    "S",
    "N",
    "P0",
    "L",
    "D",
    "in",
    "In",
    "TRUE",
    "true",
    "and",
    "AND",
    "not",
    "Not",
    "a b",
    "é",
    "1a",
    "clk",
    "CLK",
    "clock",
    "Input",
    "Output",
    "Transitions",
    "Steps",
    "Marking",
    "_event",
    "event",
    "final",
    "state",
    "parallel",
    "history",
    "bool",
    "BOOL",
    "initial_step",
    "a__b",
    "a_",
    "_a",
    "timers",
    "s1_entry",
    "s1_exit",
    "S1_EXIT",
    "c1_timed",
    "SINT",
    "INT",
    "mod",
    "MOD",
    "ET",
    "Q",
    "q",
    "PT",
    "IN",
    "var",
    "VAR",
    "VAR_INPUT",
    "end_var",
    "PROGRAM",
    "Program",
    "ACTION",
    "action",
    "TRANSITION",
    "from",
    "FROM",
    "to",
    "TO",
    "for",
    "FOR",
    "while",
    "var_",
    "scan",
    "dt",
    "steps",
    "fault",
    "otherwise",
    "rise",
    "sink",
    "x-y",
    "Math",
    "null",
    "function",
    "_x",
];

/// The features that IEC 61131-3 can express.
#[must_use]
pub fn standard_features() -> Features {
    Features {
        controlled_actions: true,
        integers: true,
        max_steps: 5,
        timers: true,
        restart: true,
        ..Features::plain()
    }
}

/// A net without the features that the standard cannot express, so that most random nets can be written; `lists` keeps the lists of steps.
#[must_use]
pub fn expressible(net: Valid<Net>, lists: bool) -> Option<Valid<Net>> {
    let mut net = net.into_inner();
    let steps: Vec<_> = net.steps.ids().collect();
    for id in steps {
        let step = &mut net.steps[id];
        step.priority = None;
        if !lists {
            (step.entry, step.exit) = (Vec::new(), Vec::new());
        }
    }
    let transitions: Vec<_> = net.transitions.ids().collect();
    for id in transitions {
        net.transitions[id].actions.clear();
    }
    let outputs: Vec<_> = net.outputs.ids().collect();
    let mut driving = Vec::new();
    for id in outputs {
        match &mut net.outputs[id].driver {
            Driver::Continuous(emissions) => {
                emissions.iter_mut().for_each(|one| one.condition = None);
            }
            Driver::Controlled(action) => driving.push(*action),
            Driver::Mealy(_) | Driver::Fires(_) | Driver::Stored(_) | Driver::Extern { .. } => {}
        }
    }
    let actions: Vec<_> = net.actions.ids().collect();
    for id in actions {
        let action = &mut net.actions[id];
        action.uses.iter_mut().for_each(|one| one.condition = None);
        if driving.contains(&id) {
            action.body.clear();
        }
    }
    validate(net).ok()
}

/// Replaces some of the names by odd ones, all different.
fn renamed(net: Valid<Net>, random: &mut Random) -> Valid<Net> {
    let before = net.clone();
    let mut net = net.into_inner();
    let mut free: Vec<&str> = ODD_NAMES.to_vec();
    let mut odd = |random: &mut Random, old: &Name| -> Name {
        if old.text.contains('.') || random.one_in(2) {
            return old.clone();
        }
        name(free.swap_remove(random.below(free.len())))
    };
    let inputs: Vec<_> = net.inputs.ids().collect();
    for id in inputs {
        // The completion event of a state is named after the state.
        if net.inputs[id].kind != InputKind::InternalEvent {
            net.inputs[id].name = odd(random, &net.inputs[id].name);
        }
    }
    let outputs: Vec<_> = net.outputs.ids().collect();
    for id in outputs {
        let new = odd(random, &net.outputs[id].name);
        match net.outputs[id].driver {
            Driver::Stored(var) => net.vars[var].name = new.clone(),
            Driver::Controlled(action) => net.actions[action].name = new.clone(),
            Driver::Extern { .. } => continue,
            Driver::Continuous(_) | Driver::Mealy(_) | Driver::Fires(_) => {}
        }
        net.outputs[id].name = new;
    }
    let vars: Vec<_> = net.vars.ids().collect();
    for id in vars {
        if net.vars[id].origin == VarOrigin::Declared {
            net.vars[id].name = odd(random, &net.vars[id].name);
        }
    }
    let timers: Vec<_> = net.timers.ids().collect();
    for id in timers {
        net.timers[id].name = odd(random, &net.timers[id].name);
    }
    let transitions: Vec<_> = net.transitions.ids().collect();
    for id in transitions {
        net.transitions[id].name = odd(random, &net.transitions[id].name);
    }
    if random.one_in(2) && net.parts.len() == 1 {
        net.name = odd(random, &net.name);
    }
    if net.macros.is_empty() && net.parts.len() == 1 {
        let steps: Vec<_> = net.steps.ids().collect();
        for id in steps {
            net.steps[id].name = odd(random, &net.steps[id].name);
        }
    }
    validate(net).unwrap_or(before)
}

/// Comments that look like the end of a comment, or like another construct.
const ODD_LABELS: [&str; 14] = [
    "it runs",
    "*)",
    "(* open",
    "-->",
    "<b>&amp;</b>",
    "%IX0.1",
    "%QX1.0 valve",
    "%",
    "%abc",
    "%MW3",
    "say 'so'",
    "{grafsynth restart}",
    "// no",
    "# option: conflict all",
];

/// Gives odd comments to some of the objects.
fn labelled(net: Valid<Net>, random: &mut Random) -> Valid<Net> {
    let before = net.clone();
    let mut net = net.into_inner();
    let mut label = |meta: &mut Meta| {
        if random.one_in(2) {
            ODD_LABELS[random.below(ODD_LABELS.len())].clone_into(&mut meta.label);
        }
    };
    macro_rules! all {
        ($($arena:ident),*) => {$(
            let ids: Vec<_> = net.$arena.ids().collect();
            for id in ids {
                label(&mut net.$arena[id].meta);
            }
        )*};
    }
    all!(inputs, outputs, vars, steps, transitions, timers, actions);
    validate(net).unwrap_or(before)
}

/// A random chart as a text, the same for the same seed; `None` if its net cannot be drawn. The seed also decides which language must be able to express it.
#[must_use]
pub fn random_chart(seed: u64) -> Option<String> {
    let (features, say) = features_of(seed);
    let mut random = Random::new(seed ^ 0xc4a7);
    let mut net = drawable(random_net(seed, &features))?;
    match say {
        Say::Everything => {}
        Say::Standard => net = expressible(net, !random.one_in(3))?,
        Say::Documents => net = without_conditions(net)?,
    }
    if random.one_in(3) {
        net = renamed(net, &mut random);
    }
    if random.one_in(4) {
        net = labelled(net, &mut random);
    }
    let text = grafsynth_frontend::graf::write_net(&net).ok()?;
    let mut design = parsed(&text)?;
    let changes: &[Change] = if say == Say::Documents { &[waits] } else { &CHANGES };
    for change in changes {
        if random.one_in(4) {
            let mut changed = design.clone();
            let Some(chart) = changed.charts.first_mut() else { continue };
            change(chart, &mut random);
            let text = grafsynth_frontend::graf::write_design(&changed);
            if let Some(again) = parsed(&text) {
                design = again;
            }
        }
    }
    Some(grafsynth_frontend::graf::write_design(&design))
}

/// The chart of a text that has no errors.
fn parsed(text: &str) -> Option<Design> {
    let parsed = grafsynth_frontend::graf::parse(FileId(0), text);
    let design = parsed.design.filter(|_| !any_error(&parsed.diagnostics))?;
    let (net, found) = lower::lower(&design);
    (net.is_some() && !any_error(&found)).then_some(design)
}

/// Adds to a chart a feature that a net does not preserve.
type Change = fn(&mut Chart, &mut Random);

const CHANGES: [Change; 9] = [
    durations,
    delayed_uses,
    delays,
    macro_step,
    restarts,
    iec,
    reading_lists,
    waits,
    counting_step,
];

fn steps(chart: &mut Chart) -> impl Iterator<Item = &mut Step> {
    chart
        .items
        .iter_mut()
        .filter_map(|item| if let Item::Step(step) = item { Some(step) } else { None })
}

fn transitions(chart: &mut Chart) -> impl Iterator<Item = &mut Transition> {
    chart
        .items
        .iter_mut()
        .filter_map(|item| if let Item::Transition(one) = item { Some(one) } else { None })
}

fn some_time(random: &mut Random) -> u64 {
    random.below(5) as u64 * 10_000_000
}

/// Adds more uses of qualified actions, with their own durations.
fn durations(chart: &mut Chart, random: &mut Random) {
    let mut targets = Vec::new();
    for step in steps(chart) {
        for item in &step.body {
            if let StepItemKind::Action {
                target,
                how: ActionHow::Qualified(..),
                arguments: None,
                ..
            } = &item.kind
            {
                targets.push(target.clone());
            }
        }
    }
    for step in steps(chart) {
        for _ in 0..random.below(3) {
            let Some(target) = random.pick(&targets).cloned() else { return };
            let qualifier = if random.one_in(2) { Qualifier::D } else { Qualifier::L };
            let how = ActionHow::Qualified(qualifier, Some(some_time(random)));
            let kind = StepItemKind::Action { target, arguments: None, how, condition: None };
            let at = random.below(step.body.len() + 1);
            step.body.insert(at, StepItem { kind, span: Span::default() });
        }
    }
}

/// Makes continuous uses delayed or limited.
fn delayed_uses(chart: &mut Chart, random: &mut Random) {
    for step in steps(chart) {
        for item in &mut step.body {
            if let StepItemKind::Action { how, .. } = &mut item.kind
                && *how == ActionHow::Bare
                && random.one_in(2)
            {
                let time = some_time(random);
                *how = if random.one_in(2) { ActionHow::After(time) } else { ActionHow::For(time) };
            }
        }
    }
}

/// An input of the chart as an expression.
fn input(chart: &Chart, random: &mut Random) -> Option<Expr> {
    let inputs: Vec<Name> = chart
        .items
        .iter()
        .filter_map(Item::as_declaration)
        .filter(|one| {
            matches!(one.kind, grafsynth_ir::chart::DeclarationKind::Input { ty, .. } if ty.is_bool())
        })
        .map(|one| one.name.clone())
        .collect();
    let name = random.pick(&inputs)?.clone();
    Some(Expr::leaf(Leaf::Name(name.into()), Span::default()))
}

/// Makes receptivities wait for an input that has been true for some time.
fn delays(chart: &mut Chart, random: &mut Random) {
    let Some(input) = input(chart, random) else { return };
    for transition in transitions(chart) {
        if random.one_in(3) {
            let (on, mut off) = (some_time(random), some_time(random));
            if random.one_in(2) {
                off = 0;
            }
            let delayed =
                Expr::leaf(Leaf::Delay(on, Box::new(input.clone()), off), Span::default());
            let kind = match transition.guard.take() {
                Some(guard) => ExprKind::And(vec![guard, delayed]),
                None => delayed.kind,
            };
            transition.guard = Some(Expr::new(kind, Span::default()));
        }
    }
}

/// Turns a step into a macro-step that begins with it.
fn macro_step(chart: &mut Chart, random: &mut Random) {
    let Some(guard) = input(chart, random) else { return };
    let places: Vec<usize> = (0..chart.items.len())
        .filter(|at| matches!(&chart.items[*at], Item::Step(step) if !step.name.text.contains('.')))
        .collect();
    let Some(at) = random.pick(&places).copied() else { return };
    let Item::Step(step) = &chart.items[at] else { return };
    let mut entry = step.clone();
    let (own, role) = (step.name.clone(), step.role);
    (entry.name, entry.role) = (name("begin"), StepRole::MacroEntry);
    let mut exit = Step { name: name("end"), role: StepRole::MacroExit, ..Step::default() };
    let n_items = entry.body.len();
    if n_items > 1 && random.one_in(2) {
        exit.body = entry.body.split_off(n_items / 2);
    }
    let transition = Transition {
        sources: vec![entry.name.clone().into()],
        targets: vec![exit.name.clone().into()],
        guard: Some(guard),
        ..Transition::default()
    };
    let body = name("part");
    let items = vec![Item::Step(entry), Item::Step(exit), Item::Transition(transition)];
    chart.items[at] =
        Item::MacroStep(MacroStep { name: own, body: body.clone(), role, ..MacroStep::default() });
    chart.items.insert(at, Item::Macro(Macro { name: body, items, ..Macro::default() }));
}

/// Makes transitions wait for some time.
fn waits(chart: &mut Chart, random: &mut Random) {
    fn of(items: &mut [Item], random: &mut Random) {
        for item in items {
            match item {
                Item::Transition(one) if one.after.is_none() && random.one_in(3) => {
                    let time = Length::Ns(10_000_000 + some_time(random));
                    one.after = Some((time, Span::default()));
                }
                Item::State(state) => of(&mut state.items, random),
                Item::Enclosing(one) => of(&mut one.items, random),
                _ => {}
            }
        }
    }
    of(&mut chart.items, random);
}

/// Makes some steps count their activations.
fn counting_step(chart: &mut Chart, random: &mut Random) {
    let max = 1 + random.below(3) as u32;
    for step in steps(chart) {
        if random.one_in(3) {
            step.count = Some(StepCount { max, initial: None, span: Span::default() });
        }
    }
}

/// Makes transitions to steps restart them.
fn restarts(chart: &mut Chart, random: &mut Random) {
    for transition in transitions(chart) {
        transition.restart |= random.one_in(2);
        if transition.restart && random.one_in(2) {
            transition.targets = transition.sources.clone();
        }
    }
}

/// Makes all uses of actions controlled, and selects the conflict policy `priority`.
fn iec(chart: &mut Chart, _: &mut Random) {
    chart.items.retain(|item| {
        !item.as_setting().is_some_and(|one| matches!(one.kind, SettingKind::Conflict(_)))
    });
    for kind in [SettingKind::ActionsIec, SettingKind::Conflict(Policy::Priority)] {
        chart.items.insert(0, Item::Setting(Setting { kind, span: Span::default() }));
    }
}

/// Makes lists of steps copy the values of controlled outputs.
fn reading_lists(chart: &mut Chart, random: &mut Random) {
    use grafsynth_ir::chart::{DeclarationKind, Stmt, StmtKind};
    let (mut vars, mut outputs) = (Vec::new(), Vec::new());
    for one in chart.items.iter().filter_map(Item::as_declaration) {
        match one.kind {
            DeclarationKind::Var { ty, len: None, .. } if ty.is_bool() => {
                vars.push(one.name.clone())
            }
            DeclarationKind::Output { ty, mealy: false, .. } if ty.is_bool() => {
                outputs.push(one.name.clone());
            }
            _ => {}
        }
    }
    let (Some(var), Some(output)) = (random.pick(&vars), random.pick(&outputs)) else { return };
    for step in steps(chart) {
        if random.one_in(2) {
            let value = Expr::leaf(Leaf::Name(output.clone().into()), Span::default());
            let kind = StmtKind::Assign { target: var.clone().into(), index: None, value };
            let list = vec![Stmt { kind, span: Span::default() }];
            let kind =
                if random.one_in(2) { StepItemKind::Entry(list) } else { StepItemKind::Exit(list) };
            step.body.push(StepItem { kind, span: Span::default() });
        }
    }
}

/// The smallest chart found by removing parts of `text` such that `is_wanted` stays true for it.
#[must_use]
pub fn shrunk(text: &str, is_wanted: impl Fn(&str) -> bool) -> String {
    let mut best = text.to_owned();
    let mut at = 0;
    let mut is_smaller = false;
    while let Some(mut design) = parsed(&best) {
        let mut left = at;
        let changed = design.charts.iter_mut().any(|chart| leave_out(&mut chart.items, &mut left));
        if !changed {
            if !is_smaller {
                break;
            }
            (at, is_smaller) = (0, false);
            continue;
        }
        let text = grafsynth_frontend::graf::write_design(&design);
        if text != best && parsed(&text).is_some() && is_wanted(&text) {
            (best, is_smaller) = (text, true);
        } else {
            at += 1;
        }
    }
    best
}

/// Removes the item after the first `left` items; false if there are no more.
fn leave_out(items: &mut Vec<Item>, left: &mut usize) -> bool {
    fn counts(left: &mut usize) -> bool {
        let is_it = *left == 0;
        *left = left.wrapping_sub(1);
        is_it
    }
    for at in 0..items.len() {
        if counts(left) {
            items.remove(at);
            return true;
        }
    }
    for item in items {
        let (step, inner) = match item {
            Item::Step(step) => (Some(step), None),
            Item::State(state) => (Some(&mut state.step), Some(&mut state.items)),
            Item::Enclosing(one) => (Some(&mut one.step), Some(&mut one.items)),
            Item::Macro(one) => (None, Some(&mut one.items)),
            Item::Transition(one) => {
                if one.guard.is_some() && counts(left) {
                    one.guard = None;
                    return true;
                }
                if one.after.is_some() && counts(left) {
                    one.after = None;
                    return true;
                }
                if one.priority.is_some() && counts(left) {
                    one.priority = None;
                    return true;
                }
                if one.restart && counts(left) {
                    one.restart = false;
                    return true;
                }
                for at in 0..one.actions.len() {
                    if counts(left) {
                        one.actions.remove(at);
                        return true;
                    }
                }
                if let Some(guard) = &mut one.guard
                    && let ExprKind::And(factors) | ExprKind::Or(factors) = &mut guard.kind
                {
                    for at in 0..factors.len() {
                        if counts(left) {
                            *guard = factors.swap_remove(at);
                            return true;
                        }
                    }
                }
                continue;
            }
            Item::Action(one) => {
                for at in 0..one.body.len() {
                    if counts(left) {
                        one.body.remove(at);
                        return true;
                    }
                }
                continue;
            }
            _ => continue,
        };
        if let Some(step) = step {
            for at in 0..step.body.len() {
                if counts(left) {
                    step.body.remove(at);
                    return true;
                }
                match &mut step.body[at].kind {
                    StepItemKind::Entry(list)
                    | StepItemKind::Exit(list)
                    | StepItemKind::On { actions: list, .. } => {
                        for stmt in 0..list.len() {
                            if counts(left) {
                                list.remove(stmt);
                                return true;
                            }
                        }
                    }
                    StepItemKind::Action { condition, .. }
                        if condition.is_some() && counts(left) =>
                    {
                        *condition = None;
                        return true;
                    }
                    _ => {}
                }
            }
        }
        if let Some(inner) = inner
            && leave_out(inner, left)
        {
            return true;
        }
    }
    false
}

/// The language in which a chart must be expressible.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Say {
    Everything,
    /// IEC 61131-3.
    Standard,
    /// SCXML.
    Documents,
}

/// The features of the random chart of a seed, and the language that must be able to express it.
fn features_of(seed: u64) -> (Features, Say) {
    let statechart = Features {
        policies: vec![Policy::InnerFirst, Policy::OuterFirst],
        externs: false,
        edges: false,
        tasks: false,
        timers: false,
        controlled_actions: false,
        emergency: false,
        otherwise: false,
        sharing: false,
        several_parts: false,
        arrays: false,
        max_steps: 8,
        history: true,
        entries: true,
        delayed_sends: true,
        ..Features::everything()
    };
    match seed % 6 {
        0 | 1 => (standard_features(), Say::Standard),
        2 => (
            Features { max_steps: 6, several_parts: false, ..Features::everything() }
                .without_statecharts()
                .some(seed),
            Say::Everything,
        ),
        3 => (
            Features { mealy: true, edges: true, events: true, ..standard_features() },
            Say::Everything,
        ),
        4 => (statechart.some(seed), Say::Documents),
        _ => (
            Features { finals: false, stored_outputs: false, raise: false, ..statechart },
            Say::Documents,
        ),
    }
}

/// A net without features that charts do not have: timers that start at their end, lists of actions that drive outputs.
fn drawable(net: Valid<Net>) -> Option<Valid<Net>> {
    let mut net = net.into_inner();
    let timers: Vec<_> = net.timers.ids().collect();
    for id in timers {
        net.timers[id].starts_expired = false;
    }
    for output in net.outputs.values() {
        if let Driver::Controlled(action) = output.driver {
            net.actions[action].body.clear();
        }
    }
    validate(net).ok()
}

/// A net whose outputs have no conditions.
fn without_conditions(net: Valid<Net>) -> Option<Valid<Net>> {
    let mut net = net.into_inner();
    let outputs: Vec<_> = net.outputs.ids().collect();
    for id in outputs {
        if let Driver::Continuous(emissions) = &mut net.outputs[id].driver {
            emissions.iter_mut().for_each(|one| one.condition = None);
        }
    }
    validate(net).ok()
}
