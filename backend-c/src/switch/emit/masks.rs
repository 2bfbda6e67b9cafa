//! Outputs that are bits: a reaction collects them in a register and writes each word once.
//!
//! The unconditional outputs of a step are a mask. A small variable whose transitions affect no other variable adds the mask in the code of its
//! transitions, so that the mask costs no test; a larger one, or one that forks and joins change, reads it from a table after all variables have moved; for one
//! or two steps a test is cheaper than a table.

use super::Emit;
use crate::Object;
use crate::c::print::Node;
use crate::times::count_type;
use grafsynth_ir::net::{Driver, StepId};
use grafsynth_ir::plan::following;
use std::collections::BTreeMap;

/// The maximum number of values of a variable whose masks are at its transitions: each of these masks is repeated there.
const MAX_IN_CASES: usize = 16;
/// A table is used if at least this many steps have a mask.
const MIN_TABLE: usize = 3;

/// The unconditional outputs of each step: a mask for each word.
pub(super) type Masks = BTreeMap<StepId, Vec<u32>>;

impl Emit<'_> {
    /// The masks of all steps that have one.
    pub(super) fn step_masks(&self) -> Masks {
        let io = &self.names.io;
        let mut masks = Masks::new();
        for (id, output) in self.net.outputs.iter() {
            let (Some(bit), Driver::Continuous(emissions)) = (io.output_bit(id), &output.driver)
            else {
                continue;
            };
            for emission in emissions.iter().filter(|it| it.condition.is_none()) {
                let words =
                    masks.entry(emission.step).or_insert_with(|| vec![0; io.output_words()]);
                words[bit / io.output_bits()] |= 1 << (bit % io.output_bits());
            }
        }
        masks
    }

    /// Whether the masks of a variable are added in the code of its transitions.
    pub(super) fn lit_in_cases(&self, index: usize) -> bool {
        let machine = &self.plan.machines[index];
        self.locals
            && !self.tables.holds(index)
            && !machine.is_entered
            && machine.values() <= MAX_IN_CASES
            && machine.steps.iter().all(|step| {
                self.plan.leaving[*step].iter().all(|id| {
                    let own = |step: StepId| self.plan.place[step].0 == index;
                    !self.plan.is_wide[*id]
                        && following(&self.net.transitions[*id]).all(own)
                        && self.plan.owner[*id] == Some(index)
                })
            })
            && !self.net.transitions.iter().any(|(id, transition)| {
                self.plan.is_wide[id]
                    && following(transition).any(|step| self.plan.place[step].0 == index)
            })
    }

    /// The statements that add the mask of a step.
    pub(super) fn lights(&self, step: Option<StepId>) -> Vec<Node> {
        let Some(step) = step else { return Vec::new() };
        let Some(words) = self.masks.get(&step) else { return Vec::new() };
        let io = &self.names.io;
        words
            .iter()
            .enumerate()
            .filter(|(_, mask)| **mask != 0)
            .map(|(word, mask)| io.light(word, &io.output_mask(*mask)).about(Object::Step(step)))
            .collect()
    }

    /// The masks of all other variables, after they have moved.
    pub(super) fn masks(&mut self) -> Vec<Node> {
        let io = &self.names.io;
        let mut nodes = Vec::new();
        let mut tables = Vec::new();
        if io.n_outputs == 0 {
            return nodes;
        }
        for (index, machine) in self.plan.machines.iter().enumerate() {
            if self.tables.holds(index) || self.lit_in_cases(index) {
                continue;
            }
            for word in 0..io.output_words() {
                let mask_of = |step: StepId| self.masks.get(&step).map_or(0, |words| words[word]);
                let lit: Vec<StepId> =
                    machine.steps.iter().copied().filter(|step| mask_of(*step) != 0).collect();
                if lit.len() < MIN_TABLE {
                    for step in lit {
                        let light = io.light(word, &io.output_mask(mask_of(step)));
                        nodes.push(
                            Node::when(&self.now_active(step).text, vec![light])
                                .about(Object::Step(step)),
                        );
                    }
                    continue;
                }
                let which = if word == 0 { String::new() } else { (word + 1).to_string() };
                let var = self.vars[index].replace(['[', ']'], "_");
                let name = format!("{}_lit{which}_{var}", self.names.prefix);
                let none = machine.has_none.then(|| Node::line(io.output_mask(0)));
                let rows = machine.steps.iter().map(|step| {
                    Node::line(io.output_mask(mask_of(*step)))
                        .note(self.net.steps[*step].name.text.clone())
                        .about(Object::Step(*step))
                });
                let rows: Vec<Node> = none.into_iter().chain(rows).collect();
                let count = rows.len();
                tables.push(Node::comment("The outputs of each step."));
                tables.push(Node::table(&self.names.upper, io.output_type(), &name, rows));
                // Corrupted memory must not read outside the table; if every value of the type is a row, it cannot.
                let light = io.light(word, &format!("{name}[{}]", self.var(index)));
                let all = count == 256 && count_type(255) == Self::state_type(machine);
                nodes.push(if all {
                    light
                } else {
                    Node::when(&format!("{} < {count}U", self.var(index)), vec![light])
                });
            }
        }
        self.mask_tables = tables;
        nodes
    }
}
