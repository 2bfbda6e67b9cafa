//! Everything that is proved about a net is true in every run of it, and an independent checker would detect a violation. Large irregular charts are covered by
//! sequential components.

#![allow(clippy::print_stdout, reason = "tests report what they counted")]

use grafsynth_ir::Valid;
use grafsynth_ir::facts::{Facts, Proof};
use grafsynth_ir::net::Net;
use grafsynth_sim::{Random, Stimulus};
use grafsynth_tests::facts_check::refuted;
use grafsynth_tests::random_net::{Features, random_net};
use grafsynth_tests::{chart, in_parallel, readable, rounds, small_limits};
use grafsynth_verify::cover::cover;
use grafsynth_verify::{facts, structural_facts};
use itertools::Itertools as _;
use std::collections::{BTreeMap, BTreeSet};

const ROWS: usize = 80;

/// Facts by structure, by enumeration and by decision diagrams, over all features of nets.
#[test]
fn no_run_speaks_against_what_was_proved() {
    let seeds: Vec<u64> = (0..rounds(150, 10_000)).collect();
    let proofs = in_parallel(&seeds, |seed| {
        let net = random_net(*seed, &Features::everything().some(*seed));
        let found = facts(&net, &small_limits());
        for part in 0..3 {
            let stimulus =
                Stimulus::random(&net, ROWS, seed ^ part << 40, [1, 3, 300][part as usize]);
            if let Some(why) = refuted(&net, &found, &stimulus) {
                panic!("seed {seed}: {why}\n{}", readable(&net));
            }
        }
        found.components.iter().map(|component| component.by).collect::<Vec<Proof>>()
    });
    let mut counted = BTreeMap::new();
    proofs.into_iter().flatten().for_each(|by| *counted.entry(by).or_insert(0) += 1);
    println!("components by proof: {counted:?}");
    for by in [Proof::Structural, Proof::Explicit] {
        assert!(counted.get(&by).is_some_and(|n| *n > 5), "{counted:?}");
    }
}

/// The facts with one error, if the facts have such a part.
fn mutated(mut facts: Facts, net: &Net, kind: usize, random: &mut Random) -> Option<Facts> {
    let n_components = facts.components.len();
    match kind {
        // Two components joined, although each has its own active step.
        0 => {
            let always: Vec<usize> =
                (0..n_components).filter(|at| facts.components[*at].always).collect();
            let [first, .., last] = always[..] else { return None };
            let more = facts.components[last].steps.clone();
            facts.components[first].steps.extend(more);
        }
        // A component without one of its steps, but still always active.
        1 => {
            let at = (0..n_components)
                .find(|at| facts.components[*at].always && facts.components[*at].steps.len() > 1)?;
            let steps = &mut facts.components[at].steps;
            steps.remove(random.below(steps.len()));
        }
        // A component with one additional step.
        2 => {
            let at = (0..n_components).find(|at| facts.components[*at].always)?;
            let inside = facts.components[at].steps.clone();
            let outside: Vec<_> = net.steps.ids().filter(|step| !inside.contains(step)).collect();
            facts.components[at].steps.push(*random.pick(&outside)?);
        }
        // A component that may be empty, marked as always active.
        3 => facts.components.iter_mut().find(|component| !component.always)?.always = true,
        // An invariant with a different count.
        4 => facts.invariants.first_mut()?.count += 1,
        // A step and a transition that are wrongly marked as unreachable.
        5 => {
            let steps: Vec<_> = net.steps.ids().collect();
            let step = *random.pick(&steps)?;
            (!facts.unreachable_steps.contains(&step)).then_some(())?;
            facts.unreachable_steps.push(step);
        }
        6 => {
            let transitions: Vec<_> = net.transitions.ids().collect();
            let transition = *random.pick(&transitions)?;
            (!facts.dead_transitions.contains(&transition)).then_some(())?;
            facts.dead_transitions.push(transition);
        }
        // Depths that are one too small.
        7 => {
            let depth = facts.stable_depth.as_mut().filter(|depth| depth.value > 1)?;
            depth.value -= 1;
        }
        8 => {
            let checks = facts.rounds.as_mut().filter(|checks| checks.value > 1)?;
            checks.value -= 1;
        }
        // A reachable situation that is missing.
        9 => {
            let sets = facts.reach.as_mut()?.sets.as_mut().filter(|sets| sets.len() > 1)?;
            sets.remove(random.below(sets.len()));
        }
        _ => return None,
    }
    Some(facts)
}

/// Wrong facts are refuted by running: the checker that the other tests use works, and facts are precise. (A wrong fact may survive a short run, and an
/// additional step in a component may be harmless, so it is enough that most of them are refuted.)
#[test]
fn wrong_facts_are_refuted() {
    const KINDS: usize = 10;
    let seeds: Vec<u64> = (0..rounds(200, 4_000)).collect();
    let outcomes = in_parallel(&seeds, |seed| {
        let features = Features { max_steps: 6, ..Features::everything().some(*seed) };
        let net = random_net(*seed, &features);
        let found = facts(&net, &small_limits());
        let mut random = Random::new(*seed);
        let mut outcomes = [None; KINDS];
        for (kind, outcome) in outcomes.iter_mut().enumerate() {
            *outcome = mutated(found.clone(), &net, kind, &mut random).map(|wrong| {
                (0..4).any(|part| {
                    let stimulus = Stimulus::random(&net, ROWS, seed ^ part << 40, 3);
                    refuted(&net, &wrong, &stimulus).is_some()
                })
            });
        }
        outcomes
    });
    for kind in 0..KINDS {
        let made: Vec<bool> = outcomes.iter().filter_map(|outcomes| outcomes[kind]).collect();
        let n_refuted = made.iter().filter(|is_refuted| **is_refuted).count();
        println!("kind {kind}: {n_refuted} of {} refuted", made.len());
        assert!(made.len() >= 5, "kind {kind} was made {} times only", made.len());
        assert!(2 * n_refuted > made.len(), "kind {kind}: {n_refuted} of {}", made.len());
    }
}

/// Processes with cycles, branches and internal forks that synchronise with each other: nested blocks do not reduce them.
struct Irregular {
    random: Random,
    steps: Vec<String>,
    /// The first step of each process.
    initial: Vec<String>,
    /// Preceding steps, following steps.
    moves: Vec<(Vec<String>, Vec<String>)>,
    /// Moves with one step on each side, by process.
    simple: Vec<Vec<usize>>,
}

impl Irregular {
    /// About `n_steps` steps in processes of `size` steps, with a synchronisation of two or three of them for every `meetings` steps.
    fn new(seed: u64, n_steps: usize, size: usize, meetings: usize) -> Self {
        let mut it = Irregular {
            random: Random::new(seed),
            steps: Vec::new(),
            initial: Vec::new(),
            moves: Vec::new(),
            simple: Vec::new(),
        };
        while it.steps.len() < n_steps {
            it.process(size);
        }
        let n_processes = it.simple.len();
        let mut is_gone = vec![false; it.moves.len()];
        for _ in 0..n_steps / meetings {
            let n_partners = 2 + usize::from(it.random.one_in(4));
            let first = it.random.below(n_processes);
            let mut partners: Vec<usize> = (0..n_partners)
                .map(|other| (first + other * (1 + it.random.below(5))) % n_processes)
                .collect();
            partners.sort_unstable();
            partners.dedup();
            let chosen: Vec<usize> = partners
                .iter()
                .filter_map(|process| {
                    let at = it.random.below(it.simple[*process].len().max(1));
                    (at < it.simple[*process].len()).then(|| it.simple[*process].swap_remove(at))
                })
                .collect();
            let mut meeting = (Vec::new(), Vec::new());
            for number in chosen {
                is_gone[number] = true;
                meeting.0.extend(it.moves[number].0.clone());
                meeting.1.extend(it.moves[number].1.clone());
            }
            if !meeting.0.is_empty() {
                it.moves.push(meeting);
                is_gone.push(false);
            }
        }
        let mut is_gone = is_gone.into_iter();
        it.moves.retain(|_| !is_gone.next().unwrap_or_default());
        it
    }

    fn step(&mut self) -> String {
        self.steps.push(format!("s{}", self.steps.len()));
        self.steps[self.steps.len() - 1].clone()
    }

    fn process(&mut self, size: usize) {
        let first = self.step();
        self.initial.push(first.clone());
        let (mut line, mut last, mut simple) = (vec![first.clone()], first.clone(), Vec::new());
        let whole = self.steps.len() + 1 + self.random.below(size.max(2));
        while self.steps.len() < whole {
            if self.random.one_in(6) {
                last = self.fork(&last, 0);
            } else {
                let next = self.step();
                simple.push(self.moves.len());
                self.moves.push((vec![last], vec![next.clone()]));
                last = next;
            }
            line.push(last.clone());
        }
        self.moves.push((vec![last], vec![first]));
        // Cross connections, in both directions.
        for _ in 0..line.len() / 3 {
            let (from, to) = (self.random.below(line.len()), self.random.below(line.len()));
            simple.push(self.moves.len());
            self.moves.push((vec![line[from].clone()], vec![line[to].clone()]));
        }
        self.simple.push(simple);
    }

    /// Branches that begin after `from`; returns the step after their join.
    fn fork(&mut self, from: &str, depth: usize) -> String {
        let starts: Vec<String> = (0..2 + self.random.below(2)).map(|_| self.step()).collect();
        self.moves.push((vec![from.to_owned()], starts.clone()));
        let mut ends = Vec::new();
        for start in starts {
            let mut last = start;
            for _ in 0..self.random.below(4) {
                if depth < 3 && self.random.one_in(4) {
                    last = self.fork(&last, depth + 1);
                } else {
                    let next = self.step();
                    self.moves.push((vec![last], vec![next.clone()]));
                    last = next;
                }
            }
            ends.push(last);
        }
        let join = self.step();
        self.moves.push((ends, vec![join.clone()]));
        join
    }

    fn net(&mut self) -> Valid<Net> {
        let mut text =
            "chart irregular {\n    evolution single\n    conflict priority\n    input ".to_owned();
        text += &(0..16).map(|n| format!("x{n}")).join(", ");
        let initial: BTreeSet<&String> = self.initial.iter().collect();
        for step in &self.steps {
            let word = if initial.contains(step) { "initial step" } else { "step" };
            text += &format!("\n    {word} {step}");
        }
        for (from, to) in &self.moves {
            let (a, b) = (self.random.below(16), self.random.below(16));
            let guard =
                if self.random.one_in(2) { format!("x{a}") } else { format!("x{a} or not x{b}") };
            text += &format!("\n    {} -> {} when {guard}", from.join(" & "), to.join(" & "));
        }
        chart("irregular.graf", &(text + "\n}\n"))
    }
}

/// Charts with 1000 steps without nested blocks: every step is in a component, and a long run agrees.
#[test]
fn large_irregular_charts_are_covered() {
    let shapes: Vec<(u64, usize, usize)> = (0..rounds(4, 60))
        .flat_map(|seed| [(seed, 8, 4), (seed, 40, 12), (seed, 150, 8), (seed, 1_000, 50)])
        .collect();
    let _: Vec<()> = in_parallel(&shapes, |(seed, size, meetings)| {
        let net = Irregular::new(*seed, 1_000, *size, *meetings).net();
        let found = structural_facts(&net);
        let n_covered = found.component_of.iter().flat_map(|map| map.values()).flatten().count();
        let always = found.components.iter().filter(|component| component.always).count();
        assert_eq!(n_covered, net.steps.len(), "seed {seed}");
        println!(
            "seed {seed}, processes of {size}, a meeting for every {meetings} steps: {} steps in {} components, {always} of them always active",
            net.steps.len(),
            found.components.len()
        );
        let stimulus = Stimulus::random(&net, 300, *seed, 1);
        assert_eq!(refuted(&net, &found, &stimulus), None, "seed {seed}");
    });
}

/// A block of steps between a first and a last step, with forks in forks, as text. Returns both steps.
fn block(random: &mut Random, depth: usize, n: &mut usize, text: &mut String) -> (usize, usize) {
    let mut step = |text: &mut String| {
        *n += 1;
        text.push_str(&format!("step s{n}\n"));
        *n
    };
    let first = step(text);
    let mut last = first;
    for _ in 0..1 + random.below(3) {
        let input = random.below(4);
        if depth > 0 && random.one_in(2) {
            let mut ends = Vec::new();
            for _ in 0..2 + random.below(2) {
                ends.push(block(random, depth - 1, n, text));
            }
            let firsts = ends.iter().map(|(first, _)| format!("s{first}")).join(" & ");
            let lasts = ends.iter().map(|(_, last)| format!("s{last}")).join(" & ");
            *n += 1;
            text.push_str(&format!(
                "step s{n}\ns{last} -> {firsts} when i{input}\n{lasts} -> s{n}\n"
            ));
        } else {
            *n += 1;
            let again = random.one_in(3);
            text.push_str(&format!("step s{n}\ns{last} -> s{n} when i{input}\n"));
            if again {
                text.push_str(&format!(
                    "s{n} -> s{last} when not i{input} and i{}\n",
                    random.below(4)
                ));
            }
        }
        last = *n;
    }
    (first, last)
}

/// A chart with forks; with `damage`, some transitions from anywhere to anywhere are added, and perhaps another initial step.
fn forked(seed: u64, damage: bool) -> String {
    let mut random = Random::new(seed);
    let policy = ["all", "priority", "priority-age"][random.below(3)];
    let evolution = ["single", "stable"][random.below(2)];
    let (mut n, mut body) = (0, String::new());
    let (first, last) = block(&mut random, 2, &mut n, &mut body);
    let mut text =
        format!("chart forked {{ conflict {policy} evolution {evolution} input i0, i1, i2, i3\n");
    body.push_str(&format!("s{last} -> s{first} when i0 and not i1\n"));
    let mut starts = vec![first];
    if damage {
        for _ in 0..1 + random.below(2) {
            let list = |random: &mut Random| {
                let steps: BTreeSet<usize> =
                    (0..1 + random.below(2)).map(|_| 1 + random.below(n)).collect();
                steps.into_iter().map(|step| format!("s{step}")).join(" & ")
            };
            let (from, to) = (list(&mut random), list(&mut random));
            body.push_str(&format!(
                "{from} -> {to} when i{} and i{}\n",
                random.below(4),
                random.below(4)
            ));
        }
        if random.one_in(4) {
            starts.push(1 + random.below(n));
        }
    }
    for step in starts {
        let plain = format!("step s{step}\n");
        body = body
            .replacen(&plain, &format!("initial {plain}"), 1)
            .replace("initial initial", "initial");
    }
    text.push_str(&body);
    text.push('}');
    text
}

/// The invariants that reach through forks: no run contradicts them, even if transitions were added that break some of them; and without such transitions, each
/// step is in one.
#[test]
fn invariants_of_forks_hold_in_every_run() {
    let (mut n_whole, mut n_kept) = (0, 0);
    for seed in 0..rounds(120, 20_000) {
        let damage = seed % 3 != 0;
        let net = chart("forked.graf", &forked(seed, damage));
        let mut found = structural_facts(&net);
        found.invariants.extend(cover(&net).further);
        for most in [1, 3] {
            let stimulus = Stimulus::random(&net, ROWS, seed, most);
            if let Some(why) = refuted(&net, &found, &stimulus) {
                panic!("seed {seed}: {why}\n{}", readable(&net));
            }
        }
        let is_in = |step| found.invariants.iter().any(|one| one.steps.contains(&step));
        if damage {
            n_kept += usize::from(found.invariants.len() > 1);
        } else {
            n_whole += usize::from(net.steps.ids().all(is_in));
        }
    }
    println!("{n_whole} charts with invariants for all steps, {n_kept} damaged charts with some");
    assert!(n_whole as u64 >= rounds(20, 3_000) && n_kept > 3, "{n_whole}, {n_kept}");
}
