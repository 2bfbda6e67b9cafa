//! Variants of a chart: changed in one place, or rewritten with the same meaning.

use crate::random_net::{name, weakened};
use grafsynth_ir::expr::{CompareOp, ExprKind};
use grafsynth_ir::net::{
    Driver, Emission, Enter, Expr, InputId, InputKind, Leaf, Net, Policy, StepId, StepKind,
    Transition, TransitionId, TransitionKind,
};
use grafsynth_ir::{FileId, Span, Valid, text, validate};
use grafsynth_sim::Random;

/// The net with one random change; whether that changes its behaviour is another question.
///
/// # Panics
/// If none of a hundred changes is valid; such a net is not useful for a test.
#[must_use]
pub fn changed(net: &Valid<Net>, random: &mut Random) -> Valid<Net> {
    for _ in 0..100 {
        let other = match random.below(6) {
            0 => negated_guard(net, random),
            1 => other_target(net, random),
            2 => other_start(net, random),
            3 => other_constant(net, random),
            4 => swapped_guards(net, random),
            _ => weakened(net, random),
        };
        if let Some(other) = other.filter(|other| !text::same(other, net)) {
            return other;
        }
    }
    panic!("no change of {} is valid", net.name);
}

fn any_transition(net: &Net, random: &mut Random) -> Option<TransitionId> {
    let n = net.transitions.len();
    (n > 0).then(|| TransitionId::from_index(random.below(n)))
}

fn negated_guard(net: &Net, random: &mut Random) -> Option<Valid<Net>> {
    let mut new = net.clone();
    let id = any_transition(net, random)?;
    new.transitions[id].guard = net.transitions[id].guard.clone().not();
    validate(new).ok()
}

fn other_target(net: &Net, random: &mut Random) -> Option<Valid<Net>> {
    let mut new = net.clone();
    let id = any_transition(net, random)?;
    let step = StepId::from_index(random.below(net.steps.len()));
    let enter = new.transitions[id].enters.first_mut()?;
    *enter = Enter::Step(step);
    validate(new).ok()
}

fn other_start(net: &Net, random: &mut Random) -> Option<Valid<Net>> {
    let mut new = net.clone();
    let at = random.below(net.vars.len());
    let (_, var) = new.vars.iter_mut().nth(at)?;
    let (lo, hi) = var.ty.bounds();
    *var.init.first_mut()? = random.between(lo, hi);
    validate(new).ok()
}

fn swapped_guards(net: &Net, random: &mut Random) -> Option<Valid<Net>> {
    let mut new = net.clone();
    let (a, b) = (any_transition(net, random)?, any_transition(net, random)?);
    new.transitions[a].guard = net.transitions[b].guard.clone();
    new.transitions[b].guard = net.transitions[a].guard.clone();
    validate(new).ok()
}

/// The net with a constant of a receptivity incremented.
fn other_constant(net: &Net, random: &mut Random) -> Option<Valid<Net>> {
    fn bump(expr: &mut Expr, at: &mut usize) {
        if let ExprKind::Int(value) = &mut expr.kind {
            if *at == 0 {
                *value = value.saturating_add(1);
            }
            *at = at.wrapping_sub(1);
        }
        match &mut expr.kind {
            ExprKind::Bool(_) | ExprKind::Int(_) | ExprKind::Leaf(_) => {}
            ExprKind::Element(_, a) | ExprKind::Not(a) | ExprKind::Neg(a) => bump(a, at),
            ExprKind::And(all) | ExprKind::Or(all) => all.iter_mut().for_each(|a| bump(a, at)),
            ExprKind::Compare(_, a, b) | ExprKind::Arith(_, a, b) => {
                bump(a, at);
                bump(b, at);
            }
            ExprKind::Select(a, b, c) => {
                bump(a, at);
                bump(b, at);
                bump(c, at);
            }
        }
    }
    let mut new = net.clone();
    let mut at = random.below(8);
    for (_, transition) in new.transitions.iter_mut() {
        bump(&mut transition.guard, &mut at);
    }
    validate(new).ok()
}

/// Ways to rewrite a chart with the same meaning.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Rewrite {
    /// Inputs, variables, outputs and edges declared in another order.
    Reordered,
    /// Steps with other names.
    Renamed,
    /// Receptivities that are equivalent.
    Guards,
    /// A transition that never fires.
    Idle,
    /// A step in two copies, one for each half of the transitions that lead to it.
    Doubled,
}

/// All rewrites.
pub const REWRITES: [Rewrite; 5] =
    [Rewrite::Reordered, Rewrite::Renamed, Rewrite::Guards, Rewrite::Idle, Rewrite::Doubled];

/// The net rewritten with the same meaning; `None` if this rewrite does not apply.
#[must_use]
pub fn rewritten(net: &Valid<Net>, way: Rewrite, random: &mut Random) -> Option<Valid<Net>> {
    match way {
        Rewrite::Reordered => reordered(net, random),
        Rewrite::Renamed => {
            let mut new = Net::clone(net);
            for (_, step) in new.steps.iter_mut() {
                step.name = name(format!("r_{}", step.name));
            }
            validate(new).ok()
        }
        Rewrite::Guards => {
            let mut new = Net::clone(net);
            for (_, transition) in new.transitions.iter_mut() {
                transition.guard = equivalent(net, &transition.guard, random);
            }
            validate(new).ok()
        }
        Rewrite::Idle => {
            let mut new = Net::clone(net);
            let id = any_transition(net, random)?;
            let mut idle = net.transitions[id].clone();
            let never = never(net, random);
            idle.name = name("idle");
            idle.guard = Expr::and([idle.guard, never]);
            new.transitions.push(idle);
            validate(new).ok()
        }
        Rewrite::Doubled => doubled(net, random),
    }
}

/// The net with the declarations of one kind in another order; only kinds whose order does not matter.
fn reordered(net: &Net, random: &mut Random) -> Option<Valid<Net>> {
    let printed = text::print(net);
    let mut blocks: Vec<String> = Vec::new();
    for line in printed.lines() {
        match blocks.last_mut() {
            Some(block) if line.starts_with([' ', '}']) => {
                block.push('\n');
                block.push_str(line);
            }
            _ => blocks.push(line.to_owned()),
        }
    }
    for kind in ["input ", "var ", "output ", "edge ", "timer "] {
        let places: Vec<usize> =
            (0..blocks.len()).filter(|at| blocks[*at].starts_with(kind)).collect();
        let mut moved: Vec<String> = places.iter().map(|at| blocks[*at].clone()).collect();
        for at in (1..moved.len()).rev() {
            moved.swap(at, random.below(at + 1));
        }
        for (place, block) in places.into_iter().zip(moved) {
            blocks[place] = block;
        }
    }
    let (new, found) = text::parse(FileId(0), &format!("{}\n", blocks.join("\n")));
    assert!(found.is_empty(), "{found:?}");
    validate(new?).ok()
}

fn some_input(net: &Net, random: &mut Random) -> Option<Expr> {
    let pins: Vec<InputId> = net
        .inputs
        .iter()
        .filter(|(_, input)| input.kind == InputKind::Pin && input.ty.is_bool())
        .map(|(id, _)| id)
        .collect();
    let pin = random.pick(&pins)?;
    Some(Expr::leaf(Leaf::Input(*pin), Span::default()))
}

/// A condition that is never true, which simple constant folding does not detect.
fn never(net: &Net, random: &mut Random) -> Expr {
    match some_input(net, random) {
        Some(pin) => Expr::and([pin.clone(), pin.not()]),
        None => Expr::bool(false),
    }
}

/// An equivalent expression.
fn equivalent(net: &Net, expr: &Expr, random: &mut Random) -> Expr {
    let inner = match &expr.kind {
        ExprKind::And(all) => {
            let mut all: Vec<Expr> = all.iter().map(|a| equivalent(net, a, random)).collect();
            all.reverse();
            Expr { kind: ExprKind::And(all), ..expr.clone() }
        }
        ExprKind::Or(all) => {
            // De Morgan.
            let all: Vec<Expr> = all.iter().map(|a| equivalent(net, a, random).not()).collect();
            Expr::and(all).not()
        }
        ExprKind::Compare(CompareOp::Lt, a, b) => {
            let not_less = ExprKind::Compare(CompareOp::Ge, a.clone(), b.clone());
            Expr { kind: not_less, ..expr.clone() }.not()
        }
        _ => expr.clone(),
    };
    match (random.below(4), some_input(net, random)) {
        (0, Some(pin)) => {
            let with = Expr::and([inner.clone(), pin.clone()]);
            Expr::or([with, Expr::and([inner, pin.not()])])
        }
        (1, Some(pin)) => Expr::and([inner, Expr::or([pin.clone(), pin.not()])]),
        (2, _) => Expr::or([inner, never(net, random)]),
        _ => inner,
    }
}

/// The net with one step in two copies. This applies only if at most one step is active at a time and nothing refers to the step.
fn doubled(net: &Net, random: &mut Random) -> Option<Valid<Net>> {
    let is_sequence = net.settings.policy == Policy::Priority
        && net.parts.len() == 1
        && net.steps.values().filter(|step| step.is_initial).count() == 1
        && net.steps.values().all(|step| step.kind == StepKind::Leaf && step.parent.is_none())
        && net.forcings.is_empty()
        && net.macros.is_empty()
        && net.unspecified.is_empty()
        && net.transitions.values().all(is_plain);
    if !is_sequence {
        return None;
    }
    let candidates: Vec<StepId> = net.steps.ids().filter(|step| can_double(net, *step)).collect();
    let step = *random.pick(&candidates)?;
    let mut new = net.clone();
    let mut copy = net.steps[step].clone();
    copy.name = name(format!("{}_too", copy.name));
    copy.is_initial = false;
    let twin = new.steps.push(copy);
    let mut leads: Vec<TransitionId> = Vec::new();
    for (id, transition) in net.transitions.iter() {
        if transition.enters == [Enter::Step(step)] {
            leads.push(id);
        }
        if transition.requires == [step] {
            let mut own: Transition = transition.clone();
            own.name = name(format!("{}_too", own.name));
            own.requires = vec![twin];
            own.clears = vec![twin];
            new.transitions.push(own);
        }
    }
    for id in leads.iter().skip(random.below(leads.len())).step_by(2) {
        new.transitions[*id].enters = vec![Enter::Step(twin)];
    }
    for (_, output) in new.outputs.iter_mut() {
        if let Driver::Continuous(emissions) | Driver::Mealy(emissions) = &mut output.driver {
            let more: Vec<Emission> = emissions
                .iter()
                .filter(|emission| emission.step == step)
                .map(|emission| Emission { step: twin, ..emission.clone() })
                .collect();
            emissions.extend(more);
        }
    }
    for (_, action) in new.actions.iter_mut() {
        let more: Vec<_> = action.uses.iter().filter(|one| one.step == step).cloned().collect();
        action.uses.extend(more.into_iter().map(|mut one| {
            one.step = twin;
            one
        }));
    }
    validate(new).ok()
}

fn is_plain(transition: &Transition) -> bool {
    transition.kind == TransitionKind::Move
        && transition.requires.len() == 1
        && matches!(transition.enters.as_slice(), [Enter::Step(_)])
        && !transition.restart
}

fn can_double(net: &Net, step: StepId) -> bool {
    let mut is_asked = false;
    for expr in net.expressions() {
        for leaf in expr.leaves() {
            is_asked |= match leaf {
                Leaf::Active(one)
                | Leaf::Elapsed(one)
                | Leaf::LastElapsed(one)
                | Leaf::TasksDone(one) => *one == step,
                // Copies of transitions would refer to the wrong ones.
                Leaf::Fireable(_) => true,
                _ => false,
            };
        }
    }
    let has_calls = net.outputs.values().any(|output| match &output.driver {
        Driver::Extern { calls, .. } => calls.iter().any(|call| call.step == step),
        Driver::Continuous(_)
        | Driver::Mealy(_)
        | Driver::Fires(_)
        | Driver::Stored(_)
        | Driver::Controlled(_) => false,
    });
    let loops = net
        .transitions
        .values()
        .any(|one| one.requires == [step] && one.enters == [Enter::Step(step)]);
    let is_entered = net.transitions.values().any(|one| one.enters == [Enter::Step(step)]);
    !is_asked && !has_calls && !loops && is_entered && net.steps[step].tasks.is_empty()
}
