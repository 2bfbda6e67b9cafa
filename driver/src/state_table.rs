//! A state table as the functions of a chip, with one flip-flop for each state or with codes; and a search for codes that need few products.
//!
//! Undefined entries of the machine are don't-cares, and so are codes of the flip-flops without a state.

use grafsynth_backend_pld::pla::{Kind, Pla};
use grafsynth_frontend::kiss2::{Machine, Trit};
use grafsynth_logic::minimise::{
    self, Effort, Function, Minimum, Outcome, Refused, Shape, Terms, per_output, shared,
};
use grafsynth_sim::Random;
use std::collections::BTreeSet;

/// The encoding of the state in flip-flops.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Coding {
    /// One flip-flop for each state.
    OneHot,
    /// A code for each state, in order, and the number of bits of the codes (at most 20).
    Codes(Vec<u32>, usize),
}

impl Coding {
    /// The coding in which the code of each state is its number in binary.
    #[must_use]
    pub fn binary(machine: &Machine) -> Self {
        let n_states = machine.states.len();
        let n_bits = bits_of(n_states);
        Coding::Codes((0..).take(n_states).collect(), n_bits)
    }

    /// The number of flip-flops.
    #[must_use]
    pub fn n_bits(&self, machine: &Machine) -> usize {
        match self {
            Coding::OneHot => machine.states.len(),
            Coding::Codes(_, n_bits) => *n_bits,
        }
    }

    fn bit(&self, state: usize, bit: usize) -> bool {
        match self {
            Coding::OneHot => state == bit,
            Coding::Codes(codes, _) => codes[state] >> bit & 1 == 1,
        }
    }
}

/// The minimum number of bits that distinguish this many states.
fn bits_of(n_states: usize) -> usize {
    (usize::BITS - n_states.saturating_sub(1).leading_zeros()) as usize
}

/// The functions of a machine: its inputs, then the flip-flops, on the left; the next values of the flip-flops, then its outputs, on the right. On-set and
/// off-set are listed, the rest is don't-care.
#[must_use]
pub fn table(machine: &Machine, coding: &Coding) -> Pla {
    let (n_inputs, n_bits) = (machine.inputs.len(), coding.n_bits(machine));
    let shape = Shape::new(n_inputs + n_bits, n_bits + machine.outputs.len());
    let mut table = Pla::new(Kind::Fr, shape);
    let bits = |what: &str| (0..n_bits).map(|bit| format!("{what}{bit}")).collect::<Vec<_>>();
    table.inputs = Some(machine.inputs.iter().cloned().chain(bits("q")).collect());
    table.outputs = Some(bits("d").into_iter().chain(machine.outputs.iter().cloned()).collect());
    for (state, rows) in machine.rows_by_state().iter().enumerate() {
        for row in rows {
            let inputs = row.inputs.iter().enumerate().filter_map(|(input, trit)| match trit {
                Trit::Low => Some((input, false)),
                Trit::High => Some((input, true)),
                Trit::Any => None,
            });
            let present = (0..n_bits).map(|bit| (n_inputs + bit, coding.bit(state, bit)));
            let literals: Vec<(usize, bool)> = inputs.chain(present).collect();
            let (mut on, mut off) = (Vec::new(), Vec::new());
            if let Some(next) = row.to {
                for bit in 0..n_bits {
                    if coding.bit(next, bit) { on.push(bit) } else { off.push(bit) }
                }
            }
            for (output, trit) in row.outputs.iter().enumerate() {
                match trit {
                    Trit::High => on.push(n_bits + output),
                    Trit::Low => off.push(n_bits + output),
                    Trit::Any => {}
                }
            }
            if !on.is_empty() {
                table.on.add(literals.iter().copied(), on);
            }
            if !off.is_empty() {
                table.off.add(literals.iter().copied(), off);
            }
        }
    }
    table
}

/// The functions of a table made by [`table`], ready to be minimised.
///
/// # Errors
/// The diagrams need more than `nodes` nodes.
pub fn function(table: &Pla, nodes: usize) -> Result<Function, Refused> {
    Function::new(&table.on, &Terms::new(table.shape()), Some(&table.off), nodes)
}

/// Minimises a machine with one flip-flop for each state: a small sum for all flip-flops and outputs together. If the ordinary search ends
/// without a proof, the states are also treated as one multi-valued variable, and the shorter sum is used.
///
/// # Errors
/// The diagrams need more than `nodes` nodes, or there is no sum of reasonable length.
pub fn one_hot(machine: &Machine, nodes: usize, effort: &Effort) -> Result<Outcome, Refused> {
    let table = table(machine, &Coding::OneHot);
    let function = function(&table, nodes)?;
    let plain = shared(&function, effort)?;
    shorter(machine, (&table.on, &table.off), &function, plain, effort)
}

/// Like [`one_hot`], each flip-flop and output separately.
///
/// # Errors
/// The diagrams need more than `nodes` nodes.
pub fn one_hot_per_output(
    machine: &Machine,
    nodes: usize,
    effort: &Effort,
) -> Result<Vec<Outcome>, Refused> {
    let table = table(machine, &Coding::OneHot);
    let plain = per_output(&function(&table, nodes)?, false, effort)?;
    let mut outcomes = Vec::new();
    for (output, plain) in plain.into_iter().enumerate() {
        if plain.outcome.minimum == Minimum::Exact {
            outcomes.push(plain.outcome);
            continue;
        }
        let (on, off) = (table.on.of_output(output), table.off.of_output(output));
        let function = Function::new(&on, &Terms::new(on.shape), Some(&off), nodes)?;
        outcomes.push(shorter(machine, (&on, &off), &function, plain.outcome, effort)?);
    }
    Ok(outcomes)
}

/// The shorter one of a sum and one that is found with the states as one variable.
fn shorter(
    machine: &Machine,
    sums: (&Terms, &Terms),
    function: &Function,
    mut plain: Outcome,
    effort: &Effort,
) -> Result<Outcome, Refused> {
    if plain.minimum == Minimum::Exact {
        return Ok(plain);
    }
    let states = machine.inputs.len()..machine.inputs.len() + machine.states.len();
    let found = minimise::one_hot(function, sums, states, Some(&plain.terms), effort)?;
    let Some(mut found) = found else { return Ok(plain) };
    // Both bounds apply to both sums.
    let lower = lower(&plain).max(lower(&found));
    let cost = |outcome: &Outcome| (outcome.terms.len(), outcome.terms.n_literals());
    if cost(&plain) <= cost(&found) {
        std::mem::swap(&mut plain, &mut found);
    }
    let n = found.terms.len();
    found.minimum = if lower >= n { Minimum::Exact } else { Minimum::Between { lower, found: n } };
    Ok(found)
}

fn lower(outcome: &Outcome) -> usize {
    match outcome.minimum {
        Minimum::Exact => outcome.terms.len(),
        Minimum::Between { lower, .. } => lower,
    }
}

/// The limits of a search for codes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Search {
    /// The number of codings that are minimised.
    pub tries: u64,
    /// The seed of the moves.
    pub seed: u64,
}

/// Searches for codes with the minimum number of bits whose shared sum of products is small. In random moves from several initial codings, two states exchange
/// their codes, or one state gets a free code; a move is kept if it needs no more products. Returns the codes and their sum.
///
/// # Errors
/// The diagrams of the initial codes are too large.
pub fn few_products(
    machine: &Machine,
    search: Search,
    effort: &Effort,
) -> Result<(Coding, Outcome), Refused> {
    let quick = Effort { exact: false, ..*effort };
    let n_states = machine.states.len();
    let n_bits = bits_of(n_states);
    let cost = |codes: &[u32]| -> Result<(usize, Outcome), Refused> {
        let table = table(machine, &Coding::Codes(codes.to_vec(), n_bits));
        let outcome = shared(&function(&table, quick.nodes)?, &quick)?;
        Ok((outcome.terms.len(), outcome))
    };
    let mut random = Random::new(search.seed);
    let mut best: Option<(usize, Vec<u32>, Outcome)> = None;
    for start in starts(machine, n_bits) {
        let (mut products, outcome) = cost(&start)?;
        let mut codes = start;
        if best.as_ref().is_none_or(|(least, ..)| products < *least) {
            best = Some((products, codes.clone(), outcome));
        }
        for _ in 0..search.tries / 3 {
            let mut moved = codes.clone();
            let state = random.below(n_states);
            let code = u32::try_from(random.below(1 << n_bits)).unwrap_or(0);
            if let Some(other) = codes.iter().position(|known| *known == code) {
                moved[other] = codes[state];
            }
            moved[state] = code;
            if moved == codes {
                continue;
            }
            let Ok((now, outcome)) = cost(&moved) else { continue };
            if now <= products {
                (products, codes) = (now, moved);
                if best.as_ref().is_none_or(|(least, ..)| now < *least) {
                    best = Some((now, codes.clone(), outcome));
                }
            }
        }
    }
    let Some((_, codes, _)) = best else { unreachable!("there is always a first coding") };
    let coding = Coding::Codes(codes, n_bits);
    let outcome = shared(&function(&table(machine, &coding), effort.nodes)?, effort)?;
    Ok((coding, outcome))
}

/// Three initial codings: by number; by a traversal that gives each state a code close to those of its predecessors; and the second one changed so that the
/// state that most rows lead to has code 0.
fn starts(machine: &Machine, n_bits: usize) -> Vec<Vec<u32>> {
    let n_states = machine.states.len();
    let binary: Vec<u32> = (0..).take(n_states).collect();
    // The affinity of two states grows with their common next states and outputs, and if they are next states of the same state.
    let mut weight = vec![vec![0_u32; n_states]; n_states];
    let mut join = |a: usize, b: usize, by: u32| {
        if a != b {
            weight[a][b] += by;
            weight[b][a] += by;
        }
    };
    let rows = machine.rows_by_state();
    for (a, ours) in rows.iter().enumerate() {
        for (b, theirs) in rows.iter().enumerate().take(a) {
            for row in ours.iter().take(200) {
                for other in theirs.iter().take(200).filter(|other| row.meets(other)) {
                    let same = row
                        .outputs
                        .iter()
                        .zip(&other.outputs)
                        .filter(|(x, y)| x == y && **x == Trit::High);
                    let next = if row.to.is_some() && row.to == other.to { 3 } else { 0 };
                    join(a, b, next + u32::try_from(same.count()).unwrap_or(0));
                }
            }
        }
    }
    for ours in &rows {
        for (at, row) in ours.iter().enumerate().take(100) {
            for other in &ours[..at] {
                if let (Some(a), Some(b)) = (row.to, other.to) {
                    join(a, b, 1);
                }
            }
        }
    }
    let n_codes = 1_u32 << n_bits;
    let mut near: Vec<Option<u32>> = vec![None; n_states];
    let mut taken = BTreeSet::new();
    for _ in 0..n_states {
        let pull = |state: usize| -> u32 {
            (0..n_states)
                .filter(|other| near[*other].is_some())
                .map(|other| weight[state][other])
                .sum()
        };
        let open = (0..n_states).filter(|state| near[*state].is_none());
        let Some(state) = open.max_by_key(|state| (pull(*state), std::cmp::Reverse(*state))) else {
            break;
        };
        let distance = |code: u32| -> u32 {
            (0..n_states)
                .filter_map(|other| Some(weight[state][other] * (near[other]? ^ code).count_ones()))
                .sum()
        };
        let code = (0..n_codes)
            .filter(|code| !taken.contains(code))
            .min_by_key(|code| (distance(*code), *code));
        near[state] = code;
        taken.extend(code);
    }
    let near: Vec<u32> = near.into_iter().map(Option::unwrap_or_default).collect();
    let entries = |state: usize| machine.rows.iter().filter(|row| row.to == Some(state)).count();
    let most =
        (0..n_states).max_by_key(|state| (entries(*state), std::cmp::Reverse(*state))).unwrap_or(0);
    let mut zero = near.clone();
    // The same bits may be inverted in all codes; a state with code 0 needs no products for its bits.
    let mask = near.get(most).copied().unwrap_or(0);
    zero.iter_mut().for_each(|code| *code ^= mask);
    vec![binary, near, zero]
}

#[cfg(test)]
mod tests {
    use super::{Coding, Search, few_products, function, one_hot, one_hot_per_output, table};
    use grafsynth_frontend::kiss2;
    use grafsynth_ir::FileId;
    use grafsynth_logic::minimise::{Effort, shared};

    const RING: &str =
        ".i 1\n.o 1\n1 a b 0\n0 a a 0\n1 b c 0\n0 b b 0\n1 c d 0\n0 c c 0\n1 d a 1\n0 d d 1\n.e\n";

    #[test]
    fn a_ring_needs_two_products_a_state_and_few_with_codes() {
        let machine = kiss2::parse(FileId(0), RING).0.expect("a table");
        let effort = Effort::of_level(1, true);
        let hot = table(&machine, &Coding::OneHot);
        let outcome =
            shared(&function(&hot, effort.nodes).expect("small"), &effort).expect("small");
        assert_eq!(outcome.terms.len(), 8, "each state stays or is entered");
        let (coding, outcome) =
            few_products(&machine, Search { tries: 60, seed: 1 }, &effort).expect("small");
        assert!(matches!(&coding, Coding::Codes(codes, 2) if codes.len() == 4), "{coding:?}");
        assert!(outcome.terms.len() <= 5, "{}", outcome.terms.len());
    }

    #[test]
    fn states_as_one_variable_are_never_worse_and_right() {
        // An up/down counter with an output on every third state, and a row for every state: too many flip-flops to list the codes.
        let n = 60;
        let mut text = String::from(".i 2\n.o 1\n0- * s0 0\n");
        for at in 0..n {
            let output = u8::from(at % 3 == 0);
            text += &format!("10 s{at} s{} {output}\n", (at + 1) % n);
            text += &format!("11 s{at} s{} -\n", (at + n - 1) % n);
        }
        let machine = kiss2::parse(FileId(0), &text).0.expect("a table");
        let effort = Effort::of_level(0, false);
        let hot = table(&machine, &Coding::OneHot);
        let plain = shared(&function(&hot, 1 << 20).expect("small"), &effort).expect("small");
        let found = one_hot(&machine, 1 << 20, &effort).expect("small");
        // Each state is entered from two others, s0 also by don't-care inputs; the rows to s0 do not define the output.
        assert!(found.terms.len() <= plain.terms.len() && found.terms.len() <= 2 * n + 1);
        let wrong = function(&hot, 1 << 20).expect("small").wrong_outputs(&found.terms);
        assert_eq!(wrong, Ok(Vec::new()));
        let single = one_hot_per_output(&machine, 1 << 20, &effort).expect("small");
        assert_eq!(single.len(), n + 1);
        assert!(single.iter().all(|outcome| outcome.terms.shape.outputs() == 1));
        assert!(single.iter().take(n).skip(1).all(|outcome| outcome.terms.len() == 2));
    }
}
