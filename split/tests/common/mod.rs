//! Problems for the tests: random ones, and a series with known optima.
#![allow(dead_code, reason = "each test file uses only some of them")]

use grafsynth_split::solve::{Choice, Forbidden, Node, Part, Presence, Problem, Wire};

/// Deterministic pseudo-random numbers (xorshift, 64 bits).
pub(crate) struct Prng(u64);

impl Prng {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1)
    }

    pub(crate) fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    /// A number below `end`.
    pub(crate) fn below(&mut self, end: usize) -> usize {
        ((self.next() >> 11) % end as u64) as usize
    }

    fn chance(&mut self, percent: usize) -> bool {
        self.below(100) < percent
    }

    fn some_of(&mut self, nodes: usize, most: usize) -> Vec<usize> {
        (0..1 + self.below(most)).map(|_| self.below(nodes)).collect()
    }
}

/// A problem of at most 10 nodes and 2 or 3 parts, with all kinds of constraints.
pub(crate) fn random_problem(prng: &mut Prng) -> Problem {
    let parts = 2 + prng.below(2);
    let nodes = 1 + prng.below(if parts == 2 { 10 } else { 7 });
    problem_of(prng, parts, nodes)
}

/// A problem with this number of parts and nodes, with all kinds of constraints.
pub(crate) fn problem_of(prng: &mut Prng, parts: usize, nodes: usize) -> Problem {
    let resources = prng.below(3);
    let mut problem = Problem::default();
    let is_tight = prng.chance(50);
    for _ in 0..parts {
        let room = if is_tight { nodes * 2 } else { nodes * 4 } / parts + 2;
        let capacities = (0..resources)
            .map(|_| prng.chance(60).then(|| (1 + prng.below(room)) as u64))
            .collect();
        problem.parts.push(Part {
            capacities,
            pins: prng.chance(50).then(|| prng.below(if is_tight { 4 } else { 9 }) as u64),
            always: if prng.chance(30) { prng.below(5) as i64 - 2 } else { 0 },
        });
    }
    for _ in 0..nodes {
        let mut choices = Vec::new();
        for _ in 0..parts {
            let uses = (0..resources).map(|_| prng.below(4) as u64).collect();
            let choice = Choice { cost: prng.below(40) as i64 - 10, uses };
            choices.push(prng.chance(88).then_some(choice));
        }
        problem.nodes.push(Node { choices });
    }
    for _ in 0..prng.below(nodes * 2) {
        problem.wires.push(Wire {
            driver: prng.below(nodes),
            readers: prng.some_of(nodes, 4),
            cost: prng.below(12) as u64,
        });
    }
    for _ in 0..prng.below(nodes) {
        let readers = prng.some_of(nodes, 3);
        if prng.chance(50) {
            let pins = prng.below(3) as u64;
            problem.presences.extend(on_each(&readers, parts, pins));
        }
        problem.presences.push(Presence {
            nodes: readers,
            on: (0..parts).filter(|_| prng.chance(50)).collect(),
            cost: prng.below(12) as u64,
            pins: prng.below(3) as u64,
            at: prng.below(parts),
        });
    }
    if prng.chance(30) {
        problem.together.push(prng.some_of(nodes, 3));
    }
    for _ in 0..prng.below(4) {
        let forbidden = match prng.chance(50) {
            true => Forbidden::Decisions(
                (0..1 + prng.below(4)).map(|_| (prng.below(nodes), prng.below(parts))).collect(),
            ),
            false => Forbidden::Together { nodes: prng.some_of(nodes, 4), part: prng.below(parts) },
        };
        problem.forbidden.push(forbidden);
    }
    problem
}

/// An input with pins on each part with a reader.
fn on_each(readers: &[usize], parts: usize, pins: u64) -> impl Iterator<Item = Presence> + '_ {
    (0..parts).map(move |part| Presence::pins(readers.to_vec(), part, pins))
}

/// A problem of the series with known optima: rings of ten steps, with nets between them, on a chip and a CPU.
///
/// Part 0 is the chip; its costs are the cycles that it saves, negated. Capacities are steps and product terms.
pub(crate) fn series(steps: usize) -> Problem {
    let mut prng = Prng(0x9E37_79B9_7F4A_7C15);
    let mut below = |end: usize| (prng.next() % end as u64) as usize;
    let terms: Vec<_> = (0..steps).map(|_| 2 + below(3) as u64).collect();
    let cycles: Vec<_> = (0..steps).map(|_| 5 + below(40) as i64).collect();
    let node = |(&terms, &cycles): (&u64, &i64)| {
        let chip = Choice { cost: -cycles, uses: vec![1, terms] };
        Node { choices: vec![Some(chip), Some(Choice { cost: 0, uses: vec![0, 0] })] }
    };
    let cells = steps as u64 * 3 / 10;
    let chip = Part {
        capacities: vec![Some(cells), Some(3 * cells)],
        pins: Some((steps as u64 * 35 / 100).max(8)),
        always: 0,
    };
    let cpu = Part { capacities: vec![None, None], ..Part::default() };
    let mut problem = Problem {
        parts: vec![chip, cpu],
        nodes: terms.iter().zip(&cycles).map(node).collect(),
        ..Problem::default()
    };
    let wire = |driver, reader| Wire { driver, readers: vec![reader], cost: 4 };
    for step in 0..steps {
        let next = if step % 10 == 9 { step - 9 } else { step + 1 };
        if next < steps {
            problem.wires.push(wire(step, next));
        }
    }
    for _ in 0..steps / 10 {
        let driver = below(steps);
        problem.wires.push(wire(driver, below(steps)));
    }
    for _ in 0..steps / 2 {
        let first = below(steps);
        problem.presences.extend(on_each(&[first, (first + 1 + below(5)) % steps], 2, 1));
    }
    problem
}

/// A random problem of three parts, two resources and nets of two to five nodes.
pub(crate) fn three_parts(prng: &mut Prng, nodes: usize) -> Problem {
    let mut problem = Problem::default();
    for part in 0..3 {
        let capacities =
            (0..2).map(|_| (part < 2).then(|| (nodes * (5 + prng.below(4)) / 10) as u64)).collect();
        problem.parts.push(Part {
            capacities,
            pins: (part < 2).then(|| (4 + nodes / 3 + prng.below(4)) as u64),
            always: 0,
        });
    }
    for _ in 0..nodes {
        let chip = |prng: &mut Prng| Choice {
            cost: prng.below(20) as i64,
            uses: (0..2).map(|_| (1 + prng.below(3)) as u64).collect(),
        };
        let choices = vec![
            Some(chip(prng)),
            prng.chance(90).then(|| chip(prng)),
            Some(Choice { cost: 20 + prng.below(30) as i64, uses: vec![0, 0] }),
        ];
        problem.nodes.push(Node { choices });
    }
    for _ in 0..nodes {
        let near = prng.below(nodes);
        let readers = (0..1 + prng.below(4)).map(|_| (near + prng.below(8)) % nodes).collect();
        problem.wires.push(Wire { driver: near, readers, cost: 2 + prng.below(8) as u64 });
    }
    for _ in 0..nodes / 3 {
        problem.presences.extend(on_each(&prng.some_of(nodes, 3), 3, 1));
    }
    problem
}
