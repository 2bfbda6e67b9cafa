//! Files of invariants (`check --invariants`): a written file is accepted, and a damaged file never proves an assert that is false.

#![allow(clippy::print_stdout, reason = "tests report how much they covered")]

use grafsynth_driver::invariants::{read, recheck, write};
use grafsynth_ir::net::{Leaf, Net, Property, PropertyExpr, PropertyLeaf, PropertyRole};
use grafsynth_ir::{Span, Valid, validate};
use grafsynth_sim::{Random, Simulator, Stimulus};
use grafsynth_tests::random_net::{Features, random_net};
use grafsynth_verify::{Limits, Outcome, properties};

fn limits() -> Limits {
    Limits {
        pairs: 3_000,
        rows_per_state: 256,
        image_work: 0,
        random_rows: 500,
        directed_work: 50_000,
        circuit_nodes: 5_000,
        ..Limits::default()
    }
}

/// A random net whose asserts exclude pairs of steps: some are true, some are not.
fn asserting(seed: u64) -> Option<Valid<Net>> {
    let mut features = Features::everything().without_statecharts();
    (features.unspecified, features.max_steps) = (false, 8);
    let mut net = Net::clone(&random_net(seed, &features));
    net.properties.retain(|property| property.role == PropertyRole::Assume);
    let steps: Vec<_> = net.steps.ids().collect();
    for (at, a) in steps.iter().enumerate().take(4) {
        for b in steps[..at].iter().take(2) {
            let all = [*a, *b].map(|step| {
                PropertyExpr::leaf(PropertyLeaf::Net(Leaf::Active(step)), Span::default())
            });
            net.properties.push(Property {
                name: format!("apart{}", net.properties.len()),
                role: PropertyRole::Assert,
                never: PropertyExpr::and(all),
                meta: Default::default(),
            });
        }
    }
    validate(net).ok()
}

/// The text with one change: a line is deleted, doubled, exchanged or cut, or a word is deleted, negated, replaced or moved to another line.
fn mutated(text: &str, random: &mut Random) -> String {
    let mut lines: Vec<Vec<String>> =
        text.lines().map(|line| line.split(' ').map(str::to_owned).collect()).collect();
    let words: Vec<String> = lines.iter().flatten().cloned().collect();
    let at = random.below(lines.len());
    let word = random.below(lines[at].len());
    match random.below(9) {
        0 => drop(lines.remove(at)),
        1 => {
            let line = lines[at].clone();
            lines.insert(random.below(lines.len()), line);
        }
        2 => {
            let other = random.below(lines.len());
            lines.swap(at, other);
        }
        3 => lines[at].truncate(word),
        4 => drop(lines[at].remove(word)),
        5 => {
            let old = lines[at][word].clone();
            lines[at][word] =
                old.strip_prefix('!').map_or_else(|| format!("!{old}"), str::to_owned);
        }
        6 | 7 => lines[at][word] = words[random.below(words.len())].clone(),
        _ => {
            let moved = lines[at].remove(word);
            let other = random.below(lines.len());
            lines[other].push(moved);
        }
    }
    let lines: Vec<String> = lines.into_iter().map(|line| line.join(" ")).collect();
    lines.join("\n")
}

/// True if random stimuli satisfy all clauses about steps.
fn is_true_of_steps(net: &Valid<Net>, text: &str, seed: u64) -> bool {
    let Ok(sections) = read(net, text) else { return false };
    let mut simulator = Simulator::new(net);
    let holds = |simulator: &Simulator<'_>| {
        sections.iter().flat_map(|section| &section.invariant.clauses).all(|clause| {
            clause.iter().any(|(bit, value)| match bit.origin {
                grafsynth_ir::program::Origin::Step(step) => simulator.is_active(step) == *value,
                _ => true,
            })
        })
    };
    let mut all = holds(&simulator);
    for row in Stimulus::random(net, 60, seed, 3).rows() {
        if grafsynth_sim::breaks_assumption(net, &row) {
            break;
        }
        simulator.step(&row);
        all = all && holds(&simulator);
    }
    all
}

#[test]
fn a_damaged_file_of_invariants_proves_nothing_false() {
    let (mut n_mutants, mut n_refused, mut n_stolen) = (0, 0, 0);
    for seed in 0.. {
        if n_mutants >= 500 {
            break;
        }
        let Some(net) = asserting(seed) else { continue };
        let verdicts = properties(&net, &limits());
        let made = write(&net, &verdicts, &limits());
        if made.asserts == 0 {
            continue;
        }
        let sections = read(&net, &made.text).expect("what is written can be read");
        assert_eq!(sections.len(), made.asserts, "seed {seed}");
        for section in &sections {
            assert_eq!(recheck(&net, section, &limits()), Ok(()), "seed {seed}: {}", made.text);
            assert!(is_true_of_steps(&net, &made.text, seed), "seed {seed}: {}", made.text);
        }
        let mut random = Random::new(seed);
        for _ in 0..20 {
            n_mutants += 1;
            let text = mutated(&made.text, &mut random);
            let Ok(sections) = read(&net, &text) else {
                n_refused += 1;
                continue;
            };
            let mut is_accepted = true;
            for section in &sections {
                if recheck(&net, section, &limits()).is_err() {
                    is_accepted = false;
                    continue;
                }
                let verdict = verdicts.iter().find(|one| one.property == section.property);
                let outcome = verdict.map(|one| &one.outcome);
                assert!(
                    !matches!(outcome, Some(Outcome::Refuted { .. })),
                    "seed {seed} proves a false assert: {text}"
                );
            }
            n_refused += usize::from(!is_accepted);
            if is_accepted {
                assert!(is_true_of_steps(&net, &text, seed + 1), "seed {seed} accepts {text}");
            }
        }
        // An invariant of a true assert is claimed for each false one.
        for (verdict, number) in verdicts.iter().zip(1..) {
            let Outcome::Refuted { .. } = verdict.outcome else { continue };
            for section in &sections {
                let mut claimed = section.clone();
                claimed.property = verdict.property;
                n_stolen += 1;
                assert!(recheck(&net, &claimed, &limits()).is_err(), "seed {seed}, {number}");
            }
        }
    }
    println!("{n_mutants} mutants, {n_refused} refused; {n_stolen} false claims refused");
    assert!(n_refused > n_mutants / 5 && n_stolen > 20, "{n_refused} of {n_mutants}, {n_stolen}");
}
