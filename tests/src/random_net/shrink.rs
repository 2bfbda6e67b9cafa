//! Shrinks a net while a condition stays true for it.

use grafsynth_ir::expr::{Expr as GenericExpr, ExprKind};
use grafsynth_ir::net::{
    Block, Driver, Enter, Evolution, Expr, ForcingOrder, Leaf, Net, OpenCell, Policy, PropertyLeaf,
    Schedule, Step, StmtKind, TransitionKind,
};
use grafsynth_ir::{Arena, Id, Valid, validate};
use grafsynth_sim::Random;

/// The smallest net found by removing parts of `net` such that `is_wanted` stays true for it. Every net that is tried is valid. It ends when no
/// single change is possible any more.
///
/// `is_wanted` should be true for `net` itself; otherwise `net` is returned.
#[must_use]
pub fn shrink(net: &Valid<Net>, is_wanted: impl Fn(&Valid<Net>) -> bool) -> Valid<Net> {
    let mut best = net.clone();
    loop {
        let mut progressed = false;
        for pass in PASSES {
            let mut at = 0;
            while let Some(candidate) = pass(&best, at) {
                match candidate
                    .and_then(|net| validate(net).ok())
                    .filter(|net| **net != *best)
                    .filter(&is_wanted)
                {
                    Some(smaller) => {
                        best = smaller;
                        progressed = true;
                    }
                    None => at += 1,
                }
            }
        }
        if !progressed {
            return best;
        }
    }
}

/// The net with one random part removed or simplified; `None` if that is invalid or changes nothing.
#[must_use]
pub fn weakened(net: &Net, random: &mut Random) -> Option<Valid<Net>> {
    let pass = PASSES[random.below(PASSES.len())];
    let n_ways = (0..).take_while(|at| pass(net, *at).is_some()).count();
    let changed = pass(net, random.below(n_ways))??;
    validate(changed).ok().filter(|changed| **changed != *net)
}

/// The n-th way to shrink the net: `None` if there are no more, or an inner `None` if this one does not apply.
type Pass = fn(&Net, usize) -> Option<Option<Net>>;

/// All passes; those that remove most come first.
const PASSES: &[Pass] = &[
    drop_transition,
    drop_step,
    drop_part,
    drop_action,
    drop_output,
    drop_various,
    drop_variable,
    drop_input,
    drop_list,
    drop_statement,
    simplify_condition,
    simplify_transition,
    simplify_settings,
    drop_unused_edges,
];

/// The items to keep. The id of a removed item is removed from lists, and read as 0 in expressions.
struct Keep {
    parts: Vec<bool>,
    inputs: Vec<bool>,
    outputs: Vec<bool>,
    vars: Vec<bool>,
    timers: Vec<bool>,
    edges: Vec<bool>,
    steps: Vec<bool>,
    transitions: Vec<bool>,
    actions: Vec<bool>,
    sends: Vec<bool>,
    histories: Vec<bool>,
}

impl Keep {
    fn all(net: &Net) -> Keep {
        Keep {
            parts: vec![true; net.parts.len()],
            inputs: vec![true; net.inputs.len()],
            outputs: vec![true; net.outputs.len()],
            vars: vec![true; net.vars.len()],
            timers: vec![true; net.timers.len()],
            edges: vec![true; net.edges.len()],
            steps: vec![true; net.steps.len()],
            transitions: vec![true; net.transitions.len()],
            actions: vec![true; net.actions.len()],
            sends: vec![true; net.sends.len()],
            histories: vec![true; net.histories.len()],
        }
    }
}

/// The new id of a kept item.
fn renumber<T>(keep: &[bool], id: Id<T>) -> Option<Id<T>> {
    let is_kept = keep.get(id.index()).copied().unwrap_or(false);
    is_kept.then(|| Id::from_index(keep[..id.index()].iter().filter(|kept| **kept).count()))
}

fn sift<T: Clone>(arena: &Arena<T>, keep: &[bool]) -> Arena<T> {
    arena.iter().filter(|(id, _)| keep[id.index()]).map(|(_, item)| item.clone()).collect()
}

/// The net without the items that `keep` removes.
fn rebuild(net: &Net, keep: &Keep) -> Net {
    let mut new = net.clone();
    new.parts = sift(&net.parts, &keep.parts);
    new.inputs = sift(&net.inputs, &keep.inputs);
    new.outputs = sift(&net.outputs, &keep.outputs);
    new.vars = sift(&net.vars, &keep.vars);
    new.timers = sift(&net.timers, &keep.timers);
    new.edges = sift(&net.edges, &keep.edges);
    new.steps = sift(&net.steps, &keep.steps);
    new.transitions = sift(&net.transitions, &keep.transitions);
    new.actions = sift(&net.actions, &keep.actions);
    new.sends = sift(&net.sends, &keep.sends);
    new.histories = sift(&net.histories, &keep.histories);
    new.sharing = (net.sharing.iter())
        .filter_map(|(var, said)| Some((renumber(&keep.vars, *var)?, *said)))
        .collect();
    let step = |id: &Id<Step>| renumber(&keep.steps, *id);
    let expr = |old: &Expr| -> Expr { map_expr(keep, old) };
    let condition = |old: &Option<Expr>| old.as_ref().map(&expr);
    let enters = |old: &[Enter]| -> Vec<Enter> {
        old.iter().filter_map(|enter| map_enter(keep, enter)).collect()
    };
    for (_, part) in new.parts.iter_mut() {
        part.initial = enters(&part.initial);
    }
    for (_, output) in new.outputs.iter_mut() {
        output.driver = match &output.driver {
            Driver::Continuous(emissions) | Driver::Mealy(emissions) => {
                let kept = emissions
                    .iter()
                    .filter_map(|emission| {
                        let mut emission = emission.clone();
                        emission.step = step(&emission.step)?;
                        emission.condition = condition(&emission.condition);
                        Some(emission)
                    })
                    .collect();
                if matches!(output.driver, Driver::Mealy(_)) {
                    Driver::Mealy(kept)
                } else {
                    Driver::Continuous(kept)
                }
            }
            Driver::Fires(transitions) => {
                let kept = transitions.iter().filter_map(|id| renumber(&keep.transitions, *id));
                Driver::Fires(kept.collect())
            }
            Driver::Stored(var) => {
                renumber(&keep.vars, *var).map_or(Driver::Continuous(Vec::new()), Driver::Stored)
            }
            Driver::Controlled(action) => renumber(&keep.actions, *action)
                .map_or(Driver::Continuous(Vec::new()), Driver::Controlled),
            Driver::Extern { params, calls } => Driver::Extern {
                params: params.clone(),
                calls: calls
                    .iter()
                    .filter_map(|call| {
                        let mut call = call.clone();
                        call.step = step(&call.step)?;
                        call.condition = condition(&call.condition);
                        call.arguments = call.arguments.iter().map(&expr).collect();
                        Some(call)
                    })
                    .collect(),
            },
        };
    }
    new.timers.iter_mut().for_each(|(_, timer)| timer.condition = expr(&timer.condition));
    new.edges.iter_mut().for_each(|(_, edge)| edge.expr = expr(&edge.expr));
    for (_, data) in new.steps.iter_mut() {
        data.part = renumber(&keep.parts, data.part).unwrap_or(data.part);
        data.parent = data.parent.as_ref().and_then(step);
        data.activation_link &= data.parent.is_some();
        data.done_event = data.done_event.and_then(|event| renumber(&keep.inputs, event));
        for block in [&mut data.entry, &mut data.exit, &mut data.initial_content] {
            *block = map_block(keep, block);
        }
        data.tasks.iter_mut().for_each(|task| task.body = map_block(keep, &task.body));
        data.locks = data.locks.iter().filter_map(|lock| renumber(&keep.vars, *lock)).collect();
    }
    for (_, transition) in new.transitions.iter_mut() {
        transition.part = renumber(&keep.parts, transition.part).unwrap_or(transition.part);
        transition.requires = transition.requires.iter().filter_map(step).collect();
        transition.clears = transition.clears.iter().filter_map(step).collect();
        transition.enters = enters(&transition.enters);
        transition.events =
            transition.events.iter().filter_map(|event| renumber(&keep.inputs, *event)).collect();
        transition.guard = expr(&transition.guard);
        transition.actions = map_block(keep, &transition.actions);
    }
    for (_, action) in new.actions.iter_mut() {
        let uses = std::mem::take(&mut action.uses);
        action.uses = uses
            .into_iter()
            .filter_map(|mut one| {
                one.step = step(&one.step)?;
                one.condition = condition(&one.condition);
                Some(one)
            })
            .collect();
        action.body = map_block(keep, &action.body);
    }
    for (_, slot) in new.sends.iter_mut() {
        slot.event = renumber(&keep.inputs, slot.event).unwrap_or(slot.event);
    }
    for (_, history) in new.histories.iter_mut() {
        history.owner = step(&history.owner).unwrap_or(history.owner);
        history.default = enters(&history.default);
        history.default_content = map_block(keep, &history.default_content);
        let cases = std::mem::take(&mut history.cases);
        history.cases = cases
            .into_iter()
            .filter_map(|mut case| {
                case.step = step(&case.step)?;
                case.enters = enters(&case.enters);
                Some(case)
            })
            .collect();
    }
    let forcings = std::mem::take(&mut new.forcings);
    new.forcings = forcings
        .into_iter()
        .filter_map(|mut forcing| {
            forcing.step = step(&forcing.step)?;
            forcing.target =
                forcing.target.iter().filter_map(|part| renumber(&keep.parts, *part)).collect();
            if let ForcingOrder::Situation(steps) = &forcing.order {
                forcing.order = ForcingOrder::Situation(steps.iter().filter_map(step).collect());
            }
            Some(forcing)
        })
        .collect();
    let properties = std::mem::take(&mut new.properties);
    new.properties = properties
        .into_iter()
        .filter_map(|mut property| {
            property.never = map_property(keep, &property.never)?;
            Some(property)
        })
        .collect();
    if let Some(emergency) = &mut new.emergency {
        emergency.condition = expr(&emergency.condition);
    }
    if let Some(ending) = &mut new.ending {
        ending.waits = expr(&ending.waits);
    }
    let unspecified = std::mem::take(&mut new.unspecified);
    new.unspecified = unspecified
        .into_iter()
        .filter_map(|mut open| {
            open.when = expr(&open.when);
            if let OpenCell::Output(output) = open.what {
                open.what = OpenCell::Output(renumber(&keep.outputs, output)?);
            }
            Some(open)
        })
        .collect();
    new
}

fn map_enter(keep: &Keep, enter: &Enter) -> Option<Enter> {
    Some(match *enter {
        Enter::Step(step) => Enter::Step(renumber(&keep.steps, step)?),
        Enter::InitialContent(step) => Enter::InitialContent(renumber(&keep.steps, step)?),
        Enter::History(history) => Enter::History(renumber(&keep.histories, history)?),
    })
}

fn map_leaf(keep: &Keep, leaf: &Leaf) -> Option<Leaf> {
    Some(match *leaf {
        Leaf::Input(id) => Leaf::Input(renumber(&keep.inputs, id)?),
        Leaf::Var(id) => Leaf::Var(renumber(&keep.vars, id)?),
        Leaf::Active(id) => Leaf::Active(renumber(&keep.steps, id)?),
        Leaf::Elapsed(id) => Leaf::Elapsed(renumber(&keep.steps, id)?),
        Leaf::LastElapsed(id) => Leaf::LastElapsed(renumber(&keep.steps, id)?),
        Leaf::TasksDone(id) => Leaf::TasksDone(renumber(&keep.steps, id)?),
        Leaf::Timer(id) => Leaf::Timer(renumber(&keep.timers, id)?),
        Leaf::Rise(id) => Leaf::Rise(renumber(&keep.edges, id)?),
        Leaf::Fall(id) => Leaf::Fall(renumber(&keep.edges, id)?),
        Leaf::Fireable(id) => Leaf::Fireable(renumber(&keep.transitions, id)?),
        Leaf::Controlled(id) => Leaf::Controlled(renumber(&keep.actions, id)?),
    })
}

/// The expression over the remaining items. A removed item reads as 0 or false; validation rejects the one of the wrong type.
fn map_expr(keep: &Keep, expr: &Expr) -> Expr {
    let leaf = |old: &Leaf| map_leaf(keep, old);
    let mapped = expr.try_map(
        &mut |old, span| {
            Ok::<Expr, ()>(match leaf(old) {
                Some(new) => GenericExpr::leaf(new, span),
                None if old.is_time() => GenericExpr::int(0),
                None => GenericExpr::bool(false),
            })
        },
        &mut |old, _| leaf(old).ok_or(()),
    );
    // Only an element of a removed array cannot be mapped; the variable pass then finds no smaller net here.
    mapped.unwrap_or_else(|()| GenericExpr::int(0))
}

fn map_property(
    keep: &Keep,
    expr: &GenericExpr<PropertyLeaf>,
) -> Option<GenericExpr<PropertyLeaf>> {
    let leaf = |old: &PropertyLeaf| match old {
        PropertyLeaf::Net(leaf) => map_leaf(keep, leaf).map(PropertyLeaf::Net),
        PropertyLeaf::Output(output) => renumber(&keep.outputs, *output).map(PropertyLeaf::Output),
    };
    expr.try_map(
        &mut |old, span| leaf(old).map(|new| GenericExpr::leaf(new, span)).ok_or(()),
        &mut |old, _| leaf(old).ok_or(()),
    )
    .ok()
}

/// The block without the statements whose target is removed.
fn map_block(keep: &Keep, block: &Block) -> Block {
    let expr = |old: &Expr| map_expr(keep, old);
    block
        .iter()
        .filter_map(|stmt| {
            let mut stmt = stmt.clone();
            stmt.kind = match &stmt.kind {
                StmtKind::Assign { var, index, value } => StmtKind::Assign {
                    var: renumber(&keep.vars, *var)?,
                    index: index.as_ref().map(&expr),
                    value: expr(value),
                },
                StmtKind::Raise(event) => StmtKind::Raise(renumber(&keep.inputs, *event)?),
                StmtKind::Send(slot) => StmtKind::Send(renumber(&keep.sends, *slot)?),
                StmtKind::Cancel(slot) => StmtKind::Cancel(renumber(&keep.sends, *slot)?),
                StmtKind::Call { output, arguments } => StmtKind::Call {
                    output: renumber(&keep.outputs, *output)?,
                    arguments: arguments.iter().map(&expr).collect(),
                },
                StmtKind::If { condition, then, otherwise } => StmtKind::If {
                    condition: expr(condition),
                    then: map_block(keep, then),
                    otherwise: map_block(keep, otherwise),
                },
                StmtKind::Code(text) => StmtKind::Code(text.clone()),
            };
            Some(stmt)
        })
        .collect()
}

fn drop_transition(net: &Net, at: usize) -> Option<Option<Net>> {
    (at < net.transitions.len()).then(|| {
        let mut keep = Keep::all(net);
        keep.transitions[at] = false;
        Some(rebuild(net, &keep))
    })
}

/// Removes a step with the transitions that would lose their last source or target.
fn drop_step(net: &Net, at: usize) -> Option<Option<Net>> {
    (at < net.steps.len()).then(|| {
        let gone = Id::<Step>::from_index(at);
        let mut keep = Keep::all(net);
        keep.steps[at] = false;
        for (id, step) in net.steps.iter() {
            keep.steps[id.index()] &= step.parent.is_none_or(|parent| keep.steps[parent.index()]);
        }
        for (id, transition) in net.transitions.iter() {
            let is_gone = |step: &Id<Step>| !keep.steps[step.index()];
            let enters_gone = transition
                .enters
                .iter()
                .any(|enter| matches!(enter, Enter::Step(step) if is_gone(step)));
            let only = transition.requires.len() + transition.enters.len() <= 2
                || transition.kind == TransitionKind::Reaction
                || net.settings.policy.is_statechart();
            keep.transitions[id.index()] =
                !(only && (transition.requires.iter().any(is_gone) || enters_gone));
        }
        for (id, history) in net.histories.iter() {
            keep.histories[id.index()] = history.owner != gone && keep.steps[history.owner.index()];
        }
        Some(rebuild(net, &keep))
    })
}

/// Removes a whole partial chart with everything in it.
fn drop_part(net: &Net, at: usize) -> Option<Option<Net>> {
    (at < net.parts.len()).then(|| {
        let gone = Id::from_index(at);
        let mut keep = Keep::all(net);
        keep.parts[at] = false;
        for (id, step) in net.steps.iter() {
            keep.steps[id.index()] = step.part != gone;
        }
        for (id, transition) in net.transitions.iter() {
            keep.transitions[id.index()] = transition.part != gone;
        }
        for (id, history) in net.histories.iter() {
            keep.histories[id.index()] = keep.steps[history.owner.index()];
        }
        Some(rebuild(net, &keep))
    })
}

fn drop_action(net: &Net, at: usize) -> Option<Option<Net>> {
    (at < net.actions.len()).then(|| {
        let mut keep = Keep::all(net);
        keep.actions[at] = false;
        for (id, output) in net.outputs.iter() {
            keep.outputs[id.index()] = output.driver != Driver::Controlled(Id::from_index(at));
        }
        Some(rebuild(net, &keep))
    })
}

/// Removes an output, with the variable of a stored output.
fn drop_output(net: &Net, at: usize) -> Option<Option<Net>> {
    let output = net.outputs.get(Id::from_index(at))?;
    let mut keep = Keep::all(net);
    keep.outputs[at] = false;
    if let Driver::Stored(var) = output.driver {
        keep.vars[var.index()] = false;
    }
    Some(Some(rebuild(net, &keep)))
}

fn drop_variable(net: &Net, at: usize) -> Option<Option<Net>> {
    (at < net.vars.len()).then(|| {
        let mut keep = Keep::all(net);
        keep.vars[at] = false;
        for (id, output) in net.outputs.iter() {
            keep.outputs[id.index()] = output.driver != Driver::Stored(Id::from_index(at));
        }
        Some(rebuild(net, &keep))
    })
}

fn drop_input(net: &Net, at: usize) -> Option<Option<Net>> {
    (at < net.inputs.len()).then(|| {
        let mut keep = Keep::all(net);
        keep.inputs[at] = false;
        Some(rebuild(net, &keep))
    })
}

/// Removes a timer, send or history, or an entry of another list ([`drop_entry`]).
fn drop_various(net: &Net, at: usize) -> Option<Option<Net>> {
    let mut at = at;
    for list in 0..3 {
        let mut keep = Keep::all(net);
        let kept = match list {
            0 => &mut keep.timers,
            1 => &mut keep.sends,
            _ => &mut keep.histories,
        };
        if at < kept.len() {
            kept[at] = false;
            return Some(Some(rebuild(net, &keep)));
        }
        at -= kept.len();
    }
    let mut new = net.clone();
    drop_entry(&mut new, at).then_some(Some(new))
}

/// Removes entry `at`, counted over the emergency, `ending`, forcing orders, properties, open cells, emissions, calls, uses of actions and tasks.
fn drop_entry(net: &mut Net, mut at: usize) -> bool {
    fn drop_from<T>(list: &mut Vec<T>, at: &mut usize) -> bool {
        if *at < list.len() {
            list.remove(*at);
            return true;
        }
        *at -= list.len();
        false
    }
    let one = usize::from(net.emergency.is_some());
    if at < one {
        net.emergency = None;
        return true;
    }
    at -= one;
    let one = usize::from(net.ending.is_some());
    if at < one {
        net.ending = None;
        return true;
    }
    at -= one;
    drop_from(&mut net.forcings, &mut at)
        || drop_from(&mut net.properties, &mut at)
        || drop_from(&mut net.unspecified, &mut at)
        || net.outputs.iter_mut().any(|(_, output)| match &mut output.driver {
            Driver::Continuous(emissions) | Driver::Mealy(emissions) => {
                drop_from(emissions, &mut at)
            }
            Driver::Extern { calls, .. } => drop_from(calls, &mut at),
            Driver::Fires(_) | Driver::Stored(_) | Driver::Controlled(_) => false,
        })
        || net.actions.iter_mut().any(|(_, action)| drop_from(&mut action.uses, &mut at))
        || net.steps.iter_mut().any(|(_, step)| drop_from(&mut step.tasks, &mut at))
}

/// Every list of the net, in a fixed order.
fn blocks(net: &mut Net) -> Vec<&mut Block> {
    let mut blocks: Vec<&mut Block> = Vec::new();
    for (_, step) in net.steps.iter_mut() {
        blocks.extend([&mut step.entry, &mut step.exit, &mut step.initial_content]);
        blocks.extend(step.tasks.iter_mut().map(|task| &mut task.body));
    }
    blocks.extend(net.transitions.iter_mut().map(|(_, transition)| &mut transition.actions));
    blocks.extend(net.actions.iter_mut().map(|(_, action)| &mut action.body));
    blocks.extend(net.histories.iter_mut().map(|(_, history)| &mut history.default_content));
    blocks
}

fn drop_list(net: &Net, at: usize) -> Option<Option<Net>> {
    let mut new = net.clone();
    let mut all = blocks(&mut new);
    let block = all.get_mut(at)?;
    if block.is_empty() {
        return Some(None);
    }
    block.clear();
    Some(Some(new))
}

/// Drops one statement, or replaces an `if` by one of its branches.
fn drop_statement(net: &Net, at: usize) -> Option<Option<Net>> {
    let mut at = at;
    let mut new = net.clone();
    for block in blocks(&mut new) {
        if change_statement(block, &mut at) {
            return Some(Some(new));
        }
    }
    None
}

fn change_statement(block: &mut Block, at: &mut usize) -> bool {
    for place in 0..block.len() {
        if *at == 0 {
            block.remove(place);
            return true;
        }
        *at -= 1;
        if let StmtKind::If { then, otherwise, .. } = &mut block[place].kind {
            if *at < 2 {
                let branch = std::mem::take(if *at == 0 { then } else { otherwise });
                block.splice(place..=place, branch);
                return true;
            }
            *at -= 2;
            if change_statement(then, at) || change_statement(otherwise, at) {
                return true;
            }
        }
    }
    false
}

/// The expressions of the net outside lists: conditions, and the arguments of calls.
fn conditions(net: &mut Net) -> Vec<&mut Expr> {
    let mut all: Vec<&mut Expr> = Vec::new();
    all.extend(net.transitions.iter_mut().map(|(_, transition)| &mut transition.guard));
    all.extend(net.edges.iter_mut().map(|(_, edge)| &mut edge.expr));
    all.extend(net.timers.iter_mut().map(|(_, timer)| &mut timer.condition));
    all.extend(net.emergency.iter_mut().map(|emergency| &mut emergency.condition));
    for (_, output) in net.outputs.iter_mut() {
        match &mut output.driver {
            Driver::Continuous(emissions) | Driver::Mealy(emissions) => {
                all.extend(emissions.iter_mut().filter_map(|emission| emission.condition.as_mut()));
            }
            Driver::Extern { calls, .. } => {
                for call in calls {
                    all.extend(call.condition.as_mut());
                    all.extend(&mut call.arguments);
                }
            }
            Driver::Fires(_) | Driver::Stored(_) | Driver::Controlled(_) => {}
        }
    }
    for (_, action) in net.actions.iter_mut() {
        all.extend(action.uses.iter_mut().filter_map(|one| one.condition.as_mut()));
    }
    all
}

/// Replaces one node of one expression, in lists too, by something simpler: a constant or one of its operands.
fn simplify_condition(net: &Net, at: usize) -> Option<Option<Net>> {
    let mut at = at;
    let mut new = net.clone();
    for condition in conditions(&mut new) {
        if simplify_expr(condition, &mut at) {
            return Some(Some(new));
        }
    }
    for block in blocks(&mut new) {
        if simplify_in_block(block, &mut at) {
            return Some(Some(new));
        }
    }
    None
}

fn simplify_in_block(block: &mut Block, at: &mut usize) -> bool {
    block.iter_mut().any(|stmt| match &mut stmt.kind {
        StmtKind::Assign { index, value, .. } => {
            index.as_mut().is_some_and(|index| simplify_expr(index, at)) || simplify_expr(value, at)
        }
        StmtKind::Call { arguments, .. } => {
            arguments.iter_mut().any(|argument| simplify_expr(argument, at))
        }
        StmtKind::If { condition, then, otherwise } => {
            simplify_expr(condition, at)
                || simplify_in_block(then, at)
                || simplify_in_block(otherwise, at)
        }
        StmtKind::Raise(_) | StmtKind::Send(_) | StmtKind::Cancel(_) | StmtKind::Code(_) => false,
    })
}

fn simplify_expr(expr: &mut Expr, at: &mut usize) -> bool {
    let ways = simpler(expr);
    if *at < ways.len() {
        *expr = ways[*at].clone();
        return true;
    }
    *at -= ways.len();
    match &mut expr.kind {
        ExprKind::Bool(_) | ExprKind::Int(_) | ExprKind::Leaf(_) => false,
        ExprKind::Element(_, a) | ExprKind::Not(a) | ExprKind::Neg(a) => simplify_expr(a, at),
        ExprKind::And(all) | ExprKind::Or(all) => all.iter_mut().any(|a| simplify_expr(a, at)),
        ExprKind::Compare(_, a, b) | ExprKind::Arith(_, a, b) => {
            simplify_expr(a, at) || simplify_expr(b, at)
        }
        ExprKind::Select(a, b, c) => {
            simplify_expr(a, at) || simplify_expr(b, at) || simplify_expr(c, at)
        }
    }
}

/// Simpler expressions: always with fewer nodes, or a constant for a leaf, so that shrinking terminates.
fn simpler(expr: &Expr) -> Vec<Expr> {
    let constants = || vec![GenericExpr::bool(true), GenericExpr::bool(false), GenericExpr::int(0)];
    match &expr.kind {
        ExprKind::Bool(_) => Vec::new(),
        ExprKind::Int(value) if *value == 0 => Vec::new(),
        ExprKind::Int(value) => vec![GenericExpr::int(0), GenericExpr::int(value / 2)],
        ExprKind::Leaf(_) => constants(),
        _ => {
            let mut ways = constants();
            ways.extend(expr.children().cloned());
            ways
        }
    }
}

/// Removes the events, restart or priority of one transition; the priority, done event or activation link of one step; the priority of one
/// part; or one condition.
fn simplify_transition(net: &Net, at: usize) -> Option<Option<Net>> {
    let mut new = net.clone();
    let n_transitions = net.transitions.len();
    if at < n_transitions * 3 {
        let transition = &mut new.transitions[Id::from_index(at / 3)];
        match at % 3 {
            0 => transition.events.clear(),
            1 => transition.restart = false,
            _ => transition.priority = None,
        }
        return Some(Some(new));
    }
    let at = at - n_transitions * 3;
    if at < net.steps.len() * 3 {
        let step = &mut new.steps[Id::from_index(at / 3)];
        match at % 3 {
            0 => step.priority = None,
            1 => step.done_event = None,
            _ => step.activation_link = false,
        }
        return Some(Some(new));
    }
    let at = at - net.steps.len() * 3;
    if at < net.parts.len() {
        new.parts[Id::from_index(at)].priority = None;
        return Some(Some(new));
    }
    drop_condition(&mut new, at - net.parts.len()).then_some(Some(new))
}

/// Makes one emission or use of an action unconditional.
fn drop_condition(net: &mut Net, mut at: usize) -> bool {
    let mut drop_it = |condition: &mut Option<Expr>| {
        if at == 0 {
            *condition = None;
            return true;
        }
        at -= 1;
        false
    };
    net.outputs.iter_mut().any(|(_, output)| match &mut output.driver {
        Driver::Continuous(emissions) | Driver::Mealy(emissions) => {
            emissions.iter_mut().any(|emission| drop_it(&mut emission.condition))
        }
        Driver::Extern { calls, .. } => calls.iter_mut().any(|call| drop_it(&mut call.condition)),
        Driver::Fires(_) | Driver::Stored(_) | Driver::Controlled(_) => false,
    }) || net
        .actions
        .iter_mut()
        .any(|(_, action)| action.uses.iter_mut().any(|one| drop_it(&mut one.condition)))
}

fn simplify_settings(net: &Net, at: usize) -> Option<Option<Net>> {
    let mut new = net.clone();
    let settings = &mut new.settings;
    match at {
        0 => settings.fire_one = false,
        1 => settings.assign_simultaneous = false,
        2 => settings.final_scan = false,
        3 => settings.events_exclusive = false,
        4 => settings.schedule = Schedule::Declared,
        5 if !settings.policy.is_statechart() => settings.policy = Policy::All,
        6 if !settings.policy.is_statechart() => settings.evolution = Evolution::Single,
        7 => new.outputs.iter_mut().for_each(|(_, output)| output.registered = false),
        5 | 6 => return Some(None),
        _ => return None,
    }
    Some(Some(new))
}

/// Removes edge operands that are no longer used.
fn drop_unused_edges(net: &Net, at: usize) -> Option<Option<Net>> {
    (at < net.edges.len()).then(|| {
        let mut keep = Keep::all(net);
        keep.edges[at] = false;
        Some(rebuild(net, &keep))
    })
}
