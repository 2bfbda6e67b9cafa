//! State bits that are always equal, found by induction over one reaction [van Eijk, Sequential equivalence checking based on structural similarities, 2000].
//! Bits that random runs from reset do not distinguish are assumed equal, and classes are split until a reaction preserves the rest. If the compared columns
//! cannot differ between equal bits, the nets are equal for ever.

use std::collections::BTreeMap;

use grafsynth_sim::Random;
use indexmap::IndexMap;

use super::{Chance, Joint, Question, depths, why};
use crate::symbolic::aig::Lit;
use crate::symbolic::reach::Failed;

/// The number of reactions in each random run; 64 runs are made at once.
const ROUNDS: usize = 48;
/// The maximum number of passes over all classes; each pass splits at least one class.
const MAX_PASSES: usize = 400;
/// The maximum number of nodes in the graph, to which each pass adds nodes.
const MAX_NODES: usize = 4_000_000;

/// The limit of solver work for all queries together, as a multiple of the limit for one: if products of numbers are compared, nearly every query is
/// hard.
const EFFORT: u64 = 2;

/// State bits that always equal another bit or a constant: each variable with its replacement.
pub(crate) type Equalities = IndexMap<Lit, Lit>;

/// The result of an attempt.
pub(crate) enum Induction {
    /// The nets are equal.
    Proved {
        /// The number of state bits that equal another one or are constant.
        equal: usize,
        /// The number of queries that the solver answered.
        solved: usize,
    },
    /// Open, with the reason, and the equalities that were proved nevertheless.
    Open(String, Equalities),
}

pub(crate) fn induction(question: &Question<'_>, rows: Chance<'_, '_, '_>) -> Induction {
    let mut last = Induction::Open("no depth was tried".to_owned(), Equalities::new());
    for depth in depths(question) {
        let joint = match Joint::of(question, depth) {
            Ok(joint) => joint,
            Err(failed) => return Induction::Open(why(failed), Equalities::new()),
        };
        let mut search = Search { joint, classes: Vec::new(), solved: 0 };
        match search.run(rows) {
            Ok(settled) => return settled,
            // The equalities found depend on reactions that were cut short.
            Err(failed @ Failed::Deeper) => {
                last = Induction::Open(why(failed), Equalities::new());
            }
            Err(failed) => return Induction::Open(why(failed), Equalities::new()),
        }
    }
    last
}

/// Bits that nothing has distinguished so far, as indices into [`Joint::bits`].
#[derive(Debug, Clone)]
struct Class {
    /// The constant value of the bits; `None` if they have had both values.
    constant: Option<bool>,
    /// The bits of the class. If they are not constant, the first one represents all.
    bits: Vec<usize>,
}

struct Search<'q> {
    joint: Joint<'q>,
    classes: Vec<Class>,
    solved: usize,
}

impl Search<'_> {
    fn run(&mut self, rows: Chance<'_, '_, '_>) -> Result<Induction, Failed> {
        self.guess(rows);
        let mut is_stable = false;
        for _ in 0..MAX_PASSES {
            // A pass adds both reactions to the graph once more.
            if self.joint.aig.len() > MAX_NODES {
                return self.give_up("the graph of both reactions is too large");
            }
            if self.is_spent() {
                return self.give_up("the solver reached its limit");
            }
            is_stable = self.pass()?;
            if is_stable {
                break;
            }
        }
        if !is_stable {
            return self.give_up("the classes of equal bits did not converge");
        }
        let instead = self.equalities();
        let overrun = self.joint.overrun;
        if !self.is_never(overrun, &instead) {
            return Err(Failed::Deeper);
        }
        for at in 0..self.joint.differ.len() {
            let differ = self.joint.differ[at];
            if self.is_spent() {
                return self.give_up("the solver reached its limit");
            }
            if !self.is_never(differ, &instead) {
                let name = &self.joint.question.common.columns[at].name;
                let text = format!("`{name}` may differ in a state that no invariant excludes");
                return Ok(Induction::Open(text, instead));
            }
        }
        Ok(Induction::Proved { equal: instead.len(), solved: self.solved })
    }

    /// True once the solver has used its total limit.
    fn is_spent(&self) -> bool {
        self.joint.aig.spent() > EFFORT * self.joint.question.limits.conflicts
    }

    /// Ends the attempt: classes that were not confirmed are not reported as equal.
    fn give_up(&mut self, text: &str) -> Result<Induction, Failed> {
        self.classes.clear();
        Ok(Induction::Open(text.to_owned(), Equalities::new()))
    }

    /// Runs from reset with random rows, and puts bits that were always equal into one class.
    fn guess(&mut self, rows: Chance<'_, '_, '_>) {
        let joint = &self.joint;
        let mut random = Random::new(1);
        let inputs = &joint.question.common.inputs;
        let zero: Vec<i64> =
            inputs.iter().map(|input| 0.clamp(input.bounds.0, input.bounds.1)).collect();
        let mut lanes: Vec<Vec<i64>> = vec![zero; 64];
        let first: Vec<u64> = joint.bits.iter().map(|bit| if bit.first { !0 } else { 0 }).collect();
        let mut state = first.clone();
        let mut signatures: Vec<Vec<u64>> = state.iter().map(|word| vec![*word]).collect();
        let next: Vec<Lit> = joint.bits.iter().map(|bit| bit.next).collect();
        let place: IndexMap<Lit, usize> =
            joint.bits.iter().enumerate().map(|(at, bit)| (bit.lit, at)).collect();
        for _ in 0..ROUNDS {
            let mut words: IndexMap<Lit, u64> = IndexMap::new();
            for (lane, values) in lanes.iter_mut().enumerate() {
                let Some(row) = rows.by_chance(&mut random, values) else { continue };
                *values = row;
                let mut set = |bits: &[Lit], code: u64| {
                    for (at, bit) in bits.iter().enumerate() {
                        *words.entry(*bit).or_insert(0) |= (code >> at & 1) << lane;
                    }
                };
                for (input, value) in joint.inputs.iter().zip(values.iter()) {
                    set(&input.bits, value.abs_diff(input.lo));
                }
                let dt = match random.below(8) {
                    0 => 0,
                    1..=4 => 1,
                    5 => random.between(0, joint.longest.min(8)),
                    _ => random.between(0, joint.longest),
                };
                set(&joint.time, dt.min(joint.longest).unsigned_abs());
            }
            state = joint.aig.words(&next, |lit| match place.get(&lit) {
                Some(at) => state[*at],
                None => words.get(&lit).copied().unwrap_or(0),
            });
            // Some runs start again.
            let restart = random.bits() & random.bits() & random.bits();
            for (word, first) in state.iter_mut().zip(&first) {
                *word = *word & !restart | first & restart;
            }
            for (signature, word) in signatures.iter_mut().zip(&state) {
                signature.push(*word);
            }
        }
        let mut classes: BTreeMap<Vec<u64>, Vec<usize>> = BTreeMap::new();
        for (at, signature) in signatures.into_iter().enumerate() {
            classes.entry(signature).or_default().push(at);
        }
        self.classes = classes
            .into_iter()
            .map(|(signature, bits)| {
                let constant = [false, true].into_iter().find(|value| {
                    signature.iter().all(|word| *word == if *value { !0 } else { 0 })
                });
                Class { constant, bits }
            })
            .collect();
    }

    fn equalities(&self) -> Equalities {
        let mut instead = Equalities::new();
        for class in &self.classes {
            let Some(first) = class.bits.first() else { continue };
            for bit in &class.bits {
                let stands = match class.constant {
                    Some(value) => Lit::constant(value),
                    None if bit == first => continue,
                    None => self.joint.bits[*first].lit,
                };
                instead.insert(self.joint.bits[*bit].lit, stands);
            }
        }
        instead
    }

    /// Checks whether each class stays together; splits the classes that do not. Returns true if all classes did.
    fn pass(&mut self) -> Result<bool, Failed> {
        let instead = self.equalities();
        let next: Vec<Lit> = self.joint.bits.iter().map(|bit| bit.next).collect();
        let next = self.joint.aig.substitute(&next, &instead);
        let mut is_stable = true;
        let mut at = 0;
        while at < self.classes.len() {
            let Class { constant, bits } = self.classes[at].clone();
            let wanted = match constant {
                Some(value) => Lit::constant(value),
                None => next[bits[0]],
            };
            for bit in bits {
                if self.is_spent() {
                    return Ok(false);
                }
                // An earlier split may have moved it.
                if !self.classes[at].bits.contains(&bit) || next[bit] == wanted {
                    continue;
                }
                let differ = self.joint.aig.xor(next[bit], wanted);
                match self.example(differ, &instead) {
                    Some(None) => self.solved += 1,
                    Some(Some(ones)) => {
                        is_stable = false;
                        self.split(&next, &ones);
                        if self.classes[at].bits.contains(&bit) {
                            self.remove(at, bit);
                        }
                    }
                    None => {
                        is_stable = false;
                        self.remove(at, bit);
                    }
                }
            }
            at += 1;
        }
        self.classes.retain(|class| !class.bits.is_empty());
        Ok(is_stable)
    }

    /// Removes a bit from its class.
    fn remove(&mut self, class: usize, bit: usize) {
        self.classes[class].bits.retain(|one| *one != bit);
        self.classes.push(Class { constant: None, bits: vec![bit] });
    }

    /// Splits every class by the values of its bits in an example. The bits whose value is the constant of the class stay in it; if the class has no
    /// constant, those that equal its first bit.
    fn split(&mut self, next: &[Lit], ones: &[Lit]) {
        let ones: indexmap::IndexSet<Lit> = ones.iter().copied().collect();
        let values = self.joint.aig.words(next, |lit| if ones.contains(&lit) { !0 } else { 0 });
        let mut more = Vec::new();
        for class in &mut self.classes {
            let Some(first) = class.bits.first().copied() else { continue };
            let wanted = class.constant.unwrap_or(values[first] & 1 == 1);
            let (stay, go): (Vec<usize>, Vec<usize>) =
                class.bits.iter().partition(|bit| (values[**bit] & 1 == 1) == wanted);
            class.bits = stay;
            if !go.is_empty() {
                more.push(Class { constant: None, bits: go });
            }
        }
        self.classes.extend(more);
    }

    fn is_never(&mut self, function: Lit, instead: &Equalities) -> bool {
        let Some(function) = self.joint.aig.substitute(&[function], instead).first().copied()
        else {
            return false;
        };
        if function == Lit::FALSE {
            return true;
        }
        let is_never = self.example(function, instead) == Some(None);
        self.solved += usize::from(is_never);
        is_never
    }

    /// The variables that are 1 at a point where the function, over representatives, and all invariants are true. The inner `None` means that there is
    /// none.
    fn example(&mut self, function: Lit, instead: &Equalities) -> Option<Option<Vec<Lit>>> {
        let joint = &mut self.joint;
        let mut support = joint.aig.support(&[function], super::super::CONE)?;
        // An invariant of a representative applies to the bits that it represents.
        let stood: Vec<Lit> = instead
            .iter()
            .filter(|(_, stands)| support.contains(stands))
            .map(|(lit, _)| *lit)
            .collect();
        support.extend(stood);
        let (mut holds, mut clauses) = (vec![function], Vec::new());
        let facts = [joint.question.facts.0, joint.question.facts.1];
        for (model, facts) in joint.models.iter().zip(facts) {
            let own: Vec<Lit> = support
                .iter()
                .copied()
                .filter(|lit| {
                    model.name_of.contains_key(lit)
                        || model.input_bits.values().any(|input| input == lit)
                })
                .collect();
            let (more, also) = model.invariants(facts, &own);
            holds.extend(more);
            clauses.extend(also);
        }
        holds.extend(&joint.legal);
        let holds = joint.aig.substitute(&holds, instead);
        let clauses: Vec<Vec<Lit>> =
            clauses.iter().map(|clause| joint.aig.substitute(clause, instead)).collect();
        let ranks = [&joint.models[0].bit_of, &joint.models[1].bit_of];
        let rank = |lit: Lit| ranks.iter().find_map(|ranks| ranks.get(&lit)).copied().unwrap_or(0);
        joint.aig.settle(&holds, &clauses, &rank, joint.question.limits)
    }
}
