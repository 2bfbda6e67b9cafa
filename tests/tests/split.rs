//! Divided nets: the parts, joined by their wires, give the rows of the whole net, and this is proved. Wrong divisions are not proved.
//!
//! `SPLIT_NETS=5000 cargo test -p grafsynth-tests split::` runs more; `SPLIT_SEED=77` runs one net and prints it.

#![allow(clippy::disallowed_methods, reason = "the environment defines how many nets are run")]
#![allow(clippy::print_stdout, reason = "tests report what they did")]

use std::collections::{BTreeMap, BTreeSet};

use grafsynth_ir::arena::IdMap;
use grafsynth_ir::division::{Division, Owners, PartNet, Running, Source, round_of};
use grafsynth_ir::expr::ExprKind;
use grafsynth_ir::net::{
    Driver, Emergency, Enter, Expr, Input, InputId, InputKind, Leaf, Meta, Net, Policy, Property,
    PropertyExpr, PropertyLeaf, PropertyRole, StepId,
};
use grafsynth_ir::plan::following;
use grafsynth_ir::{FileId, Span, Valid, text, validate};
use grafsynth_sim::{Effect, InputRow, Joint, Random, Simulator, Stimulus};
use grafsynth_split::{Groups, Item, divide, together};
use grafsynth_tests::random_net::{Features, random_net, shrink};
use grafsynth_tests::{chart, rounds};
use grafsynth_verify::verdict::Verdict;
use grafsynth_verify::{Apart, Joined, Limits, RoundFacts, joined, structural_facts};

/// The owners if each group is on a random part.
fn owners(net: &Net, groups: &Groups, parts: usize, random: &mut Random) -> Owners {
    let of: Vec<usize> = groups
        .groups
        .iter()
        .enumerate()
        .map(
            |(at, _)| {
                if groups.cpu_only.contains_key(&at) { parts - 1 } else { random.below(parts) }
            },
        )
        .collect();
    let part = |item: Item| of[groups.of[&item]];
    Owners {
        steps: IdMap::build(&net.steps, |id, _| part(Item::Step(id))),
        transitions: IdMap::build(&net.transitions, |id, _| part(Item::Transition(id))),
        vars: IdMap::build(&net.vars, |id, _| part(Item::Var(id))),
        actions: IdMap::build(&net.actions, |id, _| part(Item::Action(id))),
        outputs: IdMap::build(&net.outputs, |id, _| part(Item::Output(id))),
    }
}

fn names(parts: usize) -> Vec<String> {
    let mut names: Vec<String> = (1..parts).map(|at| format!("chip{at}")).collect();
    names.push("cpu".to_owned());
    names
}

/// A random division of a net; `None` if its features do not allow any.
pub(crate) fn division(net: &Valid<Net>, seed: u64) -> Option<Division> {
    let mut random = Random::new(seed ^ 0x5_9117);
    let groups = together(net, Running::Lockstep).ok()?;
    let parts = 2 + random.below(2);
    let owners = owners(net, &groups, parts, &mut random);
    let components = structural_facts(&round_of(net).expect("it was valid")).components;
    Some(divide(net, &groups, owners, &names(parts), &components).unwrap_or_else(|findings| {
        panic!("seed {seed}: {findings:?}\n{}", text::print(net));
    }))
}

/// The steps of a part that stand for the rest of a sequential component.
fn away_steps(part: &PartNet) -> Vec<StepId> {
    let all = part.steps.iter().filter(|(_, original)| original.step().is_none());
    all.map(|(id, _)| id).collect()
}

/// The inputs of a part that show the pins of an emergency at every moment.
fn direct_inputs(part: &PartNet) -> impl Iterator<Item = InputId> + '_ {
    let all = part.inputs.iter();
    all.filter(|(_, source)| matches!(source, Source::Direct(_))).map(|(id, _)| id)
}

/// The calls of extern conditions in a row.
fn conditions(row: &grafsynth_sim::Row) -> impl Iterator<Item = InputId> + '_ {
    row.effects.iter().filter_map(|effect| match effect {
        Effect::Condition(id) => Some(*id),
        Effect::Call(..) | Effect::Code(_) => None,
    })
}

/// The extern conditions that are called in a row.
fn asked(row: &grafsynth_sim::Row) -> BTreeSet<InputId> {
    conditions(row).collect()
}

/// The first row in which the parts and the net differ, up to the first fault: the parts of a chart whose reactions may not end have no meaning after that.
fn difference(net: &Valid<Net>, division: &Division, seed: u64) -> Option<String> {
    let stimulus = Stimulus::random(net, 60, seed, 3);
    let mut whole = Simulator::new(net);
    let mut joint = Joint::new(net, division);
    let zero = InputRow { dt: 0, ..InputRow::zero(net) };
    let compare = |at: usize, wanted: &grafsynth_sim::Row, given: &grafsynth_sim::Row| {
        // The parts may call fewer conditions: an operand of an edge that nobody reads is not copied.
        let effects = |row: &grafsynth_sim::Row| {
            let mut all = row.effects.clone();
            all.retain(|effect| !matches!(effect, Effect::Condition(_)));
            all.sort();
            all
        };
        let same = wanted.steps == given.steps
            && asked(given).is_subset(&asked(wanted))
            && asked(given).len() == conditions(given).count()
            && wanted.outputs == given.outputs
            && wanted.vars == given.vars
            && effects(wanted) == effects(given)
            && wanted.fault == given.fault;
        (!same).then(|| format!("row {at}:\n net   {wanted:?}\n parts {given:?}"))
    };
    let first = compare(0, whole.row(), &joint.row(&zero));
    if first.is_some() {
        return first;
    }
    for (at, row) in stimulus.rows().enumerate() {
        let wanted = whole.step(&row).clone();
        let given = joint.step(&row);
        if wanted.fault && given.fault {
            return None;
        }
        let found = compare(at + 1, &wanted, &given);
        if found.is_some() {
            return found;
        }
    }
    None
}

/// The number of reactions that make several micro-steps, in the rows that [`difference`] compares.
fn reactions_of_several_rounds(net: &Valid<Net>, seed: u64) -> usize {
    let mut whole = Simulator::new(net);
    let stimulus = Stimulus::random(net, 60, seed, 3);
    let rows = stimulus.rows().map(|row| {
        let is_fault = whole.step(&row).fault;
        (is_fault, whole.firings().count() > 1)
    });
    rows.take_while(|(is_fault, _)| !is_fault).filter(|(_, is_long)| *is_long).count()
}

fn count(variable: &str, default: u64) -> u64 {
    std::env::var(variable).ok().and_then(|text| text.parse().ok()).unwrap_or(default)
}

pub(crate) fn features(seed: u64) -> Features {
    let all = Features { stable: false, firings: false, max_steps: 12, ..Features::program() };
    let all = all.without_statecharts();
    if seed.is_multiple_of(3) { all } else { all.some(seed) }
}

/// The features of charts with evolution `stable` that can be divided.
pub(crate) fn stable_features(seed: u64) -> Features {
    Features { single: false, stable: true, mealy: false, ..features(seed) }
}

/// A random net; every third one with an emergency that a pin causes, alone or if a step is active.
pub(crate) fn net_to_divide(seed: u64, features: &Features) -> Valid<Net> {
    let net = random_net(seed, features);
    let is_pin = |input: &Input| input.kind == InputKind::Pin && input.ty.is_bool();
    let pins = net.inputs.iter().filter(|(_, input)| is_pin(input));
    let pins: Vec<InputId> = pins.map(|(id, _)| id).collect();
    let mut random = Random::new(seed ^ 0xe_57_0b);
    let Some(pin) = random.pick(&pins).copied().filter(|_| seed % 3 == 1) else { return net };
    let mut net = net.into_inner();
    let mut condition = Expr::leaf(Leaf::Input(pin), Span::default());
    let steps: Vec<StepId> = net.steps.ids().collect();
    if let Some(step) = random.pick(&steps).filter(|_| seed % 2 == 1) {
        let other = Expr::leaf(Leaf::Active(*step), Span::default());
        condition = match random.below(3) {
            0 => Expr::and([condition, other]),
            1 => Expr::or([condition, other]),
            _ => Expr::or([condition.clone().not(), Expr::and([other, condition])]),
        };
    }
    net.outputs.values_mut().for_each(|output| output.registered = false);
    net.emergency = Some(Emergency { condition, meta: Meta::default() });
    validate(net).expect("an emergency by a pin is valid")
}

/// The verdict about a division, if the reactions of the net end.
fn proof(net: &Valid<Net>, division: &Division) -> Verdict<Joined, Apart> {
    let facts = structural_facts(&round_of(net).expect("a valid net has a round"));
    // Parts that are equal by construction need no solver; hard questions are abandoned early.
    let limits = Limits { conflicts: 2_000, ..Limits::default() };
    joined(net, RoundFacts { facts: &facts, ends: true }, division, false, &limits)
}

#[test]
fn the_parts_of_random_nets_are_the_net() {
    parts_are_the_net(features);
}

#[test]
fn the_parts_of_random_stable_nets_are_the_net() {
    parts_are_the_net(stable_features);
}

fn parts_are_the_net(features: fn(u64) -> Features) {
    let only = std::env::var("SPLIT_SEED").ok().and_then(|text| text.parse().ok());
    let seeds = only.map_or(0..count("SPLIT_NETS", 60), |seed: u64| seed..seed + 1);
    let mut tally: BTreeMap<String, u32> = BTreeMap::new();
    let mut refused: BTreeMap<String, u32> = BTreeMap::new();
    let (mut long, mut away, mut at_once) = (0, 0, 0);
    for seed in seeds {
        let net = net_to_divide(seed, &features(seed));
        let Some(parts) = division(&net, seed) else {
            let found = together(&net, Running::Lockstep).expect_err("it is refused");
            let rule = found.first().map(|it| it.message.clone()).unwrap_or_default();
            *refused.entry(rule).or_default() += 1;
            continue;
        };
        if only.is_some() {
            println!("{}\n{parts:#?}", text::print(&net));
        }
        let wires = parts.wires.len();
        if let Some(found) = difference(&net, &parts, seed) {
            let net = shrink(&net, |net| {
                division(net, seed).is_some_and(|parts| difference(net, &parts, seed).is_some())
            });
            panic!("seed {seed}: {found}\nsmallest:\n{}", text::print(&net));
        }
        let verdict = proof(&net, &parts);
        let class = match &verdict {
            Verdict::Proved(_) => "proved".to_owned(),
            Verdict::Refuted(apart) => panic!("seed {seed}: {apart:?}\n{}", text::print(&net)),
            Verdict::Open(open) => {
                open.reasons.first().map(ToString::to_string).unwrap_or_default()
            }
        };
        if class.contains("hard") {
            println!("seed {seed}: {class}");
        }
        *tally.entry(class).or_default() += 1;
        *tally.entry(format!("{} wires", wires.min(3))).or_default() += 1;
        long += reactions_of_several_rounds(&net, seed);
        away += u32::from(parts.parts.iter().any(|part| !away_steps(part).is_empty()));
        at_once += u32::from(parts.parts.iter().any(|part| direct_inputs(part).next().is_some()));
    }
    println!(
        "{tally:#?}, {away} with a step for the rest of a component, {at_once} with pins of an emergency, {long} reactions of several rounds; refused: {refused:#?}"
    );
    assert!(refused.is_empty(), "{refused:#?}");
    if only.is_none() {
        let refused = tally.keys().filter(|class| class.contains("not supported"));
        assert_eq!(refused.count(), 0, "{tally:#?}");
        let hard =
            tally.iter().filter(|(class, _)| class.contains("hard")).map(|(_, n)| n).sum::<u32>();
        let all: u32 =
            tally.iter().filter(|(class, _)| !class.ends_with("wires")).map(|(_, n)| n).sum();
        assert!(hard * 50 <= all, "{hard} of {all} divisions are too hard to prove");
        assert_eq!(long >= 10, features(0).stable, "{long} reactions of several rounds");
        assert!(away * 40 >= all, "{away} of {all} divisions cut a component");
        assert!(at_once * 10 >= all, "{at_once} of {all} divisions have pins of an emergency");
        assert!(tally.get("3 wires").is_some_and(|n| n * 2 > all), "most divisions have wires");
    }
}

/// The purpose of a chart, its steps and transitions, and its rows: the only input, and the situation after the row.
type RoundCase = (&'static str, &'static str, &'static [(i64, &'static str)]);

/// The charts of semantics §12 on which a simpler rule for the rounds of `stable` fails.
const ROUNDS: [RoundCase; 4] = [
    (
        "C43: a part that does not move in the first round",
        "input i bool
         step p in g initial
         step q in g initial
         step x in g
         step y in g
         transition t1 in g p -> x when i
         transition t2 in g q -> y when x.active",
        &[(0, "p q"), (1, "x y")],
    ),
    (
        "C44: events are those of the first round",
        "input E bool event
         step s in g initial
         step r in g
         transition t1 in g s -> r when E
         transition t2 in g r -> s when E",
        &[(1, "r"), (1, "s"), (0, "s")],
    ),
    (
        "C45: time passes in the first round",
        "input a bool
         step s in g initial
         step r in g
         step u in g
         transition t1 in g s -> r when a
         transition t2 in g r -> u when r.t >= 1",
        &[(1, "r"), (0, "u")],
    ),
    (
        "C46: an assumption about events is not one about rounds",
        "input E bool event
         step s in g initial
         step r in g
         step u in g
         transition t1 in g s -> r when E
         transition t2 in g r -> u when not E
         assume never not E",
        &[(1, "u")],
    ),
];

#[test]
fn rounds_end_when_no_part_moves_and_have_one_time_and_one_event() {
    for (what, items, rows) in ROUNDS {
        let items: Vec<&str> = items.lines().map(str::trim).collect();
        let items = items.join("\n");
        let net = format!(
            "net n\npolicy all\nevolution stable limit 8\nschedule declared\ntick 10000000 ns\npart g level 1\n{items}\n"
        );
        let (parsed, findings) = text::parse(FileId(0), &net);
        let net = parsed.and_then(|net| validate(net).ok());
        let net = net.unwrap_or_else(|| panic!("{what}: {findings:?}"));
        let mut n_wires = 0;
        for seed in 0..12 {
            let parts = division(&net, seed).expect("it can be divided");
            n_wires += parts.wires.len();
            let mut joint = Joint::new(&net, &parts);
            for (at, (value, wanted)) in rows.iter().enumerate() {
                let row = joint.step(&InputRow { dt: 1, values: vec![*value] });
                let names = row.steps.iter().map(|step| net.steps[*step].name.text.as_str());
                let names: Vec<&str> = names.collect();
                assert_eq!(names.join(" "), *wanted, "{what}, division {seed}, row {}", at + 1);
            }
            assert!(matches!(proof(&net, &parts), Verdict::Proved(_)), "{what}, division {seed}");
            // A part that may rely on the assumption would treat the second round as impossible.
            assert!(parts.parts.iter().all(|part| part.net.properties.is_empty()), "{what}");
        }
        assert!(n_wires > 0, "{what}: nothing was divided");
    }
}

/// The charts of semantics §12 with something that happens once in a reaction: what, and the chart.
const ONCE: [(&str, &str); 6] = [
    (
        "C42: a controlled action",
        "actions iec  output Q
         initial step s  step m { Q pulse }  step e  step f
         s -> m when a  m -> e  e -> f when not a  f -> s",
    ),
    (
        "C57: a free timer whose condition is false for a moment, or true",
        "timer T while s.active  timer U while m.active
         initial step s  step m  step e  output R
         initial step p  step q { R if U >= 10 ms }
         s -> m when rise(a)  m -> s  s -> e when T >= 30 ms  e -> s when a
         p -> q when T >= 20 ms  q -> p when not a",
    ),
    (
        "C58: a free timer that the second round reads",
        "timer T while s.active
         initial step s  step m  step e
         s -> m when a  m -> e when T >= 20 ms  e -> s when not a",
    ),
    (
        "C59: a task",
        "var n: int 0..9
         initial step s  step m { task b { n := n + 1 } }  step e
         initial step p  step q
         s -> m when a  m -> e when n = 1  m -> s when n > 1 and not a  e -> s when not a
         p -> q when m.active  q -> p when e.active",
    ),
    (
        "C60: a continuous extern action",
        "extern action f(n: int 0..9)
         initial step s { f(1) }  step m { f(2) }  step e { f(3) }
         initial step p  step q
         s -> m when a  m -> e  e -> s when not a
         p -> q when m.active  q -> p when s.active",
    ),
    (
        "C61: an extern condition",
        "extern condition x
         initial step s  step m  step e
         initial step p  step q
         s -> m when a and x  m -> e when x  e -> s when not a
         p -> q when m.active  q -> p when s.active",
    ),
];

#[test]
fn what_happens_once_in_a_reaction_happens_in_one_of_its_rounds() {
    for (what, items) in ONCE {
        let net =
            chart("once.graf", &format!("chart n {{\nevolution stable\ninput a\n{items}\n}}\n"));
        let (mut wires, mut waiting) = (0, 0);
        for seed in 0..12 {
            let parts = division(&net, seed).expect("it can be divided");
            wires += parts.wires.len();
            for other in 0..5 {
                let found = difference(&net, &parts, seed * 100 + other);
                assert_eq!(found, None, "{what}, division {seed}");
            }
            let verdict = proof(&net, &parts);
            assert!(matches!(verdict, Verdict::Proved(_)), "{what}, {seed}: {verdict:?}");
            for at in 0..parts.parts.len() {
                let mut wrong = parts.clone();
                let mut part = wrong.parts[at].net.clone().into_inner();
                if part.ending.take().is_none() {
                    continue;
                }
                waiting += 1;
                wrong.parts[at].net = validate(part).expect("it is valid");
                let verdict = proof(&net, &wrong);
                let is_proved = matches!(verdict, Verdict::Proved(_));
                assert!(!is_proved, "{what}, {seed}: END does not wait");
            }
        }
        assert!(wires > 0, "{what}: nothing was divided");
        assert_eq!(waiting > 0, !what.starts_with("C61"), "{what}: END waits");
    }
}

#[test]
fn a_division_is_open_if_reactions_may_not_end() {
    let net = random_net(0, &Features { single: false, stable: true, ..Features::plain() });
    let parts = division(&net, 0).expect("plain nets can be divided");
    let facts = structural_facts(&round_of(&net).expect("a valid net has a round"));
    let verdict =
        |ends| joined(&net, RoundFacts { facts: &facts, ends }, &parts, false, &Limits::default());
    assert!(matches!(verdict(true), Verdict::Proved(_)));
    assert!(matches!(verdict(false), Verdict::Open(_)));
}

/// A division with one mistake.
fn spoiled(division: &Division, random: &mut Random) -> Option<(Division, String)> {
    let mut wrong = division.clone();
    let at = random.below(wrong.parts.len());
    let part = &mut wrong.parts[at];
    let mut net = part.net.clone().into_inner();
    let transitions: Vec<_> = net.transitions.ids().collect();
    let steps: Vec<_> = net.steps.ids().collect();
    let what = match random.below(13) {
        0 => {
            let wires: Vec<_> = part
                .inputs
                .iter()
                .filter(|(_, source)| matches!(source, Source::Wire(_)))
                .map(|(id, _)| id)
                .collect();
            let (a, b) = (*random.pick(&wires)?, *random.pick(&wires)?);
            let (old, new) = (part.inputs[a], part.inputs[b]);
            (part.inputs[a], part.inputs[b]) = (new, old);
            "two wires are swapped"
        }
        1 => {
            let shown: Vec<_> = net
                .outputs
                .iter()
                .filter(|(_, output)| matches!(output.driver, Driver::Fires(_)))
                .map(|(id, _)| id)
                .collect();
            let id = *random.pick(&shown)?;
            net.outputs[id].driver = Driver::Fires(vec![*random.pick(&transitions)?]);
            "a wire shows another transition"
        }
        2 => {
            let id = *random.pick(&transitions)?;
            net.transitions[id].guard = net.transitions[id].guard.clone().not();
            "a receptivity is negated"
        }
        3 => {
            let id = *random.pick(&transitions)?;
            let step = *random.pick(&steps)?;
            net.transitions[id].enters = vec![Enter::Step(step)];
            "a transition enters another step"
        }
        4 => {
            let id = *random.pick(&steps)?;
            net.steps[id].is_initial = !net.steps[id].is_initial;
            "another step is initial"
        }
        5 => {
            let id = *random.pick(&transitions)?;
            let actions = std::mem::take(&mut net.transitions[id].actions);
            if actions.is_empty() {
                return None;
            }
            "a list of a transition is lost"
        }
        6 => {
            let actions = net.outputs.values_mut().find_map(|output| match &mut output.driver {
                Driver::Extern { params, calls } => Some((params.first()?.ty, calls.first_mut()?)),
                _ => None,
            });
            let (ty, call) = actions?;
            let argument = call.arguments.first_mut()?;
            *argument =
                if ty.is_bool() { argument.clone().not() } else { Expr::int(ty.bounds().1) };
            "a call is changed"
        }
        7 => {
            net.ending.take()?;
            "END does not wait"
        }
        8 => {
            let ending = net.ending.as_mut()?;
            ending.waits = ending.waits.clone().not();
            "END waits for the wrong rounds"
        }
        9 => {
            let away = away_steps(part);
            let id = *random.pick(&away)?;
            let mut touching = net.transitions.values_mut().filter(|transition| {
                transition.requires.contains(&id) || following(transition).any(|step| step == id)
            });
            let transition = touching.nth(random.below(2))?;
            transition.requires.retain(|step| *step != id);
            transition.clears.retain(|step| *step != id);
            transition.enters.retain(|enter| *enter != Enter::Step(id));
            "the step for the rest of a component is not changed"
        }
        10 => {
            direct_inputs(part).next()?;
            let emergency = net.emergency.as_mut()?;
            let pins: Vec<InputId> = direct_inputs(part).collect();
            let is_pin = |leaf: &Leaf| matches!(leaf, Leaf::Input(id) if pins.contains(id));
            let now = |expr: &Expr| expr.leaves().any(is_pin);
            let ExprKind::Or(all) = &emergency.condition.kind else { return None };
            let kept = all.iter().filter(|one| now(one) && one.leaves().all(is_pin));
            emergency.condition = Expr::or(kept.cloned());
            "an emergency ends before the row in which the latched inputs end it"
        }
        11 => {
            let pin = direct_inputs(part).next()?;
            let id = *random.pick(&transitions)?;
            let guard = net.transitions[id].guard.clone();
            net.transitions[id].guard =
                Expr::and([guard, Expr::leaf(Leaf::Input(pin), Span::default()).not()]);
            "a receptivity reads the pin of an emergency"
        }
        _ => {
            let id = *random.pick(&steps)?;
            if net.steps[id].entry.is_empty() {
                return None;
            }
            net.steps[id].entry.clear();
            "an entry list is lost"
        }
    };
    let is_unchanged = *part.net == net && part.inputs == division.parts[at].inputs;
    if is_unchanged {
        return None;
    }
    part.net = validate(net).ok()?;
    let what = format!("part {}: {what}", part.name);
    Some((wrong, what))
}

#[test]
fn spoiled_divisions_are_not_proved() {
    spoiled_are_not_proved(features);
}

#[test]
fn spoiled_divisions_of_stable_nets_are_not_proved() {
    spoiled_are_not_proved(stable_features);
}

fn spoiled_are_not_proved(features: fn(u64) -> Features) {
    let (mut refused, mut equal) = (0, 0);
    for seed in 0..count("SPOILED_NETS", 60) {
        let net = net_to_divide(seed, &features(seed));
        let Some(parts) = division(&net, seed) else { continue };
        let mut random = Random::new(seed ^ 0x0bad);
        let Some((wrong, what)) = spoiled(&parts, &mut random) else { continue };
        let Verdict::Proved(_) = proof(&net, &wrong) else {
            refused += 1;
            continue;
        };
        equal += 1;
        for other in 0..20 {
            if let Some(found) = difference(&net, &wrong, seed * 100 + other) {
                panic!("seed {seed}: {what}, but it was proved: {found}\n{}", text::print(&net));
            }
        }
    }
    println!("{refused} refused, {equal} equal in spite of the change");
    assert!(refused > equal * 3, "{refused} refused, {equal} proved");
}

/// The features of statecharts that can be divided. A final state at the top of a chart prevents it.
pub(crate) fn statechart_features(seed: u64) -> Features {
    let policies = vec![Policy::InnerFirst, Policy::OuterFirst];
    let all = Features {
        policies,
        firings: false,
        single: false,
        stable: true,
        max_steps: 8,
        ..Features::program()
    };
    let some = if seed.is_multiple_of(3) { all } else { all.some(seed) };
    Features { single: false, stable: true, ..some }
}

#[test]
fn the_parts_of_random_statecharts_are_the_net() {
    let only = std::env::var("SPLIT_SEED").ok().and_then(|text| text.parse().ok());
    let seeds = only.map_or(0..rounds(60, 3000), |seed: u64| seed..seed + 1);
    let mut tally: BTreeMap<String, u32> = BTreeMap::new();
    let (mut all, mut long) = (0, 0);
    for seed in seeds {
        let net = random_net(seed, &statechart_features(seed));
        let Some(parts) = division(&net, seed).filter(|parts| !parts.wires.is_empty()) else {
            continue;
        };
        all += 1;
        if let Some(found) = difference(&net, &parts, seed) {
            panic!("seed {seed}: {found}\n{}", text::print(&net));
        }
        let class = match proof(&net, &parts) {
            Verdict::Proved(_) => "proved".to_owned(),
            Verdict::Refuted(apart) => panic!("seed {seed}: {apart:?}\n{}", text::print(&net)),
            Verdict::Open(open) => {
                open.reasons.first().map(ToString::to_string).unwrap_or_default()
            }
        };
        *tally.entry(class).or_default() += 1;
        long += reactions_of_several_rounds(&net, seed);
    }
    println!("{all} statecharts with wires, {long} reactions of several micro-steps: {tally:#?}");
    if only.is_none() {
        let proved = tally.get("proved").copied().unwrap_or_default();
        assert!(all >= 15 && long >= 5 && proved * 10 >= all * 9, "{proved} of {all}, {long}");
    }
}

/// A chart, its rows (two inputs, in their order), and the outputs after each row, from row 0 on.
type StateCase = (&'static str, &'static str, &'static [[i64; 2]], &'static [&'static [i64]]);

/// The statecharts of semantics §12 on which a simpler rule for wires fails.
const STATES: [StateCase; 3] = [
    (
        "C48: a transient state gives no pulse",
        "conflict inner-first
         event go
         internal event next
         queue 1
         output M, D
         initial state s
         state m { M }
         state d { D }
         s -> m on go do { raise next }
         m -> d on next",
        &[[1, 0]],
        &[&[0, 0], &[0, 1]],
    ),
    (
        "C49: the state after the move with the inputs of the same row",
        "conflict inner-first
         event go
         input a
         output R
         initial state s
         state r { R if a }
         s -> r on go",
        &[[1, 1], [0, 0], [0, 1]],
        &[&[0], &[1], &[0], &[1]],
    ),
    (
        "C50: the states that the reset reaches",
        "conflict inner-first
         input a
         output R
         initial state s
         state r { R if not a }
         s -> r",
        &[[1, 0], [0, 0]],
        &[&[1], &[0], &[1]],
    ),
];

#[test]
fn wires_show_states_at_the_end_of_a_reaction() {
    for (what, items, rows, wanted) in STATES {
        let net = chart("states.graf", &format!("chart n {{\n{items}\n}}\n"));
        let groups = together(&net, Running::Lockstep).expect("it can be divided");
        let names = names(2);
        let on_chip = |item: Item| usize::from(groups.cpu_only.contains_key(&groups.of[&item]));
        let owners = Owners {
            steps: IdMap::build(&net.steps, |id, _| on_chip(Item::Step(id))),
            transitions: IdMap::build(&net.transitions, |id, _| on_chip(Item::Transition(id))),
            vars: IdMap::build(&net.vars, |id, _| on_chip(Item::Var(id))),
            actions: IdMap::build(&net.actions, |id, _| on_chip(Item::Action(id))),
            outputs: IdMap::build(&net.outputs, |id, _| on_chip(Item::Output(id))),
        };
        let parts = divide(&net, &groups, owners, &names, &[]).expect("it can be divided");
        assert!(!parts.wires.is_empty(), "{what}: nothing is on the chip");
        assert!(matches!(proof(&net, &parts), Verdict::Proved(_)), "{what}");
        let mut joint = Joint::new(&net, &parts);
        let outputs: Vec<usize> = (0..net.outputs.len()).collect();
        let of = |row: &grafsynth_sim::Row| -> Vec<i64> {
            outputs.iter().map(|at| row.outputs[*at]).collect()
        };
        let first = joint.row(&InputRow { dt: 0, ..InputRow::zero(&net) });
        assert_eq!(of(&first), wanted[0], "{what}, row 0");
        for (at, (values, wanted)) in rows.iter().zip(&wanted[1..]).enumerate() {
            let mut input = InputRow { dt: 1, ..InputRow::zero(&net) };
            let columns = net.inputs.iter().filter(|(_, it)| it.kind.is_handed());
            for ((id, _), value) in columns.zip(values) {
                input.values[id.index()] = *value;
            }
            assert_eq!(of(&joint.step(&input)), *wanted, "{what}, row {}", at + 1);
        }
    }
}

/// A division of a statechart with one mistake.
fn spoiled_statechart(division: &Division, random: &mut Random) -> Option<(Division, String)> {
    let mut wrong = division.clone();
    let at = random.below(2) * (wrong.parts.len() - 1);
    let part = &mut wrong.parts[at];
    let mut net = part.net.clone().into_inner();
    let steps: Vec<_> = net.steps.ids().collect();
    let emissions = net.outputs.values_mut().find_map(|output| match &mut output.driver {
        Driver::Continuous(all) => all.first_mut(),
        _ => None,
    });
    let what = match random.below(5) {
        0 => {
            let emission = emissions?;
            let condition = emission.condition.clone().unwrap_or(Expr::bool(true));
            emission.condition = Some(condition.not());
            "a condition of an output is negated"
        }
        1 => {
            emissions?.step = *random.pick(&steps)?;
            "an output belongs to another state"
        }
        2 => {
            let transitions: Vec<_> = net.transitions.ids().collect();
            let id = *random.pick(&transitions)?;
            net.transitions[id].guard = net.transitions[id].guard.clone().not();
            "a receptivity is negated"
        }
        3 => {
            let wires: Vec<_> = part
                .inputs
                .iter()
                .filter(|(_, source)| matches!(source, Source::Wire(_)))
                .map(|(id, _)| id)
                .collect();
            let (a, b) = (*random.pick(&wires)?, *random.pick(&wires)?);
            let (old, new) = (part.inputs[a], part.inputs[b]);
            (part.inputs[a], part.inputs[b]) = (new, old);
            "two wires are swapped"
        }
        _ => {
            let pins = net.inputs.iter().filter(|(_, it)| it.kind == InputKind::Pin);
            let pins: Vec<_> = pins.filter(|(_, it)| it.ty.is_bool()).map(|(id, _)| id).collect();
            let never = PropertyLeaf::Net(Leaf::Input(*random.pick(&pins)?));
            net.properties.push(Property {
                name: String::new(),
                role: PropertyRole::Assume,
                never: PropertyExpr::leaf(never, Span::default()),
                meta: Meta::default(),
            });
            "an assumption is added"
        }
    };
    if *part.net == net && part.inputs == division.parts[at].inputs {
        return None;
    }
    part.net = validate(net).ok()?;
    let what = format!("part {}: {what}", part.name);
    Some((wrong, what))
}

#[test]
fn spoiled_divisions_of_statecharts_are_not_proved() {
    let (mut refused, mut equal) = (0, 0);
    for seed in 0..rounds(80, 2000) {
        let net = random_net(seed, &statechart_features(seed));
        let Some(parts) = division(&net, seed).filter(|parts| !parts.wires.is_empty()) else {
            continue;
        };
        let mut random = Random::new(seed ^ 0x0bad);
        let Some((wrong, what)) = spoiled_statechart(&parts, &mut random) else { continue };
        let Verdict::Proved(_) = proof(&net, &wrong) else {
            refused += 1;
            continue;
        };
        equal += 1;
        assert!(!what.contains("assumption"), "seed {seed}: {what}, but it was proved");
        for other in 0..20 {
            if let Some(found) = difference(&net, &wrong, seed * 100 + other) {
                panic!("seed {seed}: {what}, but it was proved: {found}\n{}", text::print(&net));
            }
        }
    }
    println!("{refused} refused, {equal} equal in spite of the change");
    assert!(refused > equal * 3, "{refused} refused, {equal} proved");
}
