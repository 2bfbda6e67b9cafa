//! Tables for variables whose steps only wait for inputs.
//!
//! A variable is *plain* if each of its transitions leads from one of its steps to another on a condition over Boolean inputs, and its steps only
//! drive continuous outputs. Such variables need no separate code: one loop moves all of them, with a row of constants for each transition, and
//! costs the same few instructions for each variable, however many steps it has. The inputs are first packed into one word, and the outputs of the
//! active steps are collected in another.
//!
//! Variables share a *bank* if the inputs and outputs they use fit in one word each. This module assigns variables to banks; `text` writes the
//! tables and their loops.

mod text;

use super::plan::{Plan, receptivity};
use crate::cexpr::{CExpr, Prec};
use crate::names::Names;
use crate::range::Range;
use crate::style_output::Member;
use crate::times::count_type;
use crate::{Object, Options, Style};
use grafsynth_ir::Gather;
use grafsynth_ir::expr::{Expr as GenericExpr, ExprKind};
use grafsynth_ir::net::{
    Driver, Evolution, Expr, InputId, Leaf, Net, OutputId, StepId, TransitionId,
};
use grafsynth_ir::plan::following;
use std::collections::{BTreeMap, BTreeSet};

/// The maximum number of inputs or outputs that the variables of one bank share; a single variable may use twice as many.
const SHARED_BITS: usize = 32;
/// The maximum number of terms of one receptivity.
const MAX_TERMS: usize = 4;
/// Below this many rows the loop costs more than the code it replaces.
const MIN_ROWS: usize = 32;

/// A conjunction of inputs: each with its required value.
type Term = BTreeMap<InputId, bool>;

/// A conjunction for which a step of a plain variable waits, the step that follows, and the transition.
type Row = (Term, StepId, TransitionId);

/// Variables that the same loop moves.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
struct Bank {
    machines: Vec<usize>,
    inputs: Vec<InputId>,
    outputs: Vec<OutputId>,
    /// The member that contains the variables.
    member: String,
    /// The suffix of the bank's names: empty for the first bank.
    suffix: String,
}

/// All tables of a chart.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(super) struct Tables {
    banks: Vec<Bank>,
    /// Bank and position of each variable.
    of: Vec<Option<(usize, usize)>>,
    waiting: BTreeMap<StepId, Vec<Row>>,
    drives: BTreeMap<StepId, Vec<OutputId>>,
}

impl Tables {
    /// Finds the plain variables and assigns them to banks.
    pub(super) fn choose(net: &Net, names: &Names, plan: &Plan, options: &Options) -> Self {
        let mut tables = Tables { of: vec![None; plan.machines.len()], ..Tables::default() };
        let wanted = matches!(options.style, Style::Auto | Style::Tables);
        if !wanted || net.settings.evolution != Evolution::Single {
            return tables;
        }
        let busy = busy_machines(net, plan);
        let mut drives: BTreeMap<StepId, Vec<OutputId>> = BTreeMap::new();
        for (id, output) in net.outputs.iter() {
            if let Driver::Continuous(emissions) = &output.driver {
                for emission in emissions {
                    drives.entry(emission.step).or_default().push(id);
                }
            }
        }
        for (index, machine) in plan.machines.iter().enumerate() {
            if busy.contains(&index)
                || machine.has_lists
                || machine.is_entered
                || machine.timer_cap.is_some()
            {
                continue;
            }
            let Some(waiting) = plain(net, plan, index) else { continue };
            let inputs: BTreeSet<InputId> = waiting
                .iter()
                .flat_map(|(_, rows)| rows)
                .flat_map(|(term, ..)| term.keys().copied())
                .gather();
            let outputs: BTreeSet<OutputId> = machine
                .steps
                .iter()
                .filter_map(|step| drives.get(step))
                .flatten()
                .copied()
                .gather();
            if inputs.len() > 2 * SHARED_BITS || outputs.len() > 2 * SHARED_BITS {
                continue;
            }
            tables.deal(index, &inputs, &outputs);
            tables.waiting.extend(waiting);
            for step in &machine.steps {
                tables.drives.insert(*step, drives.get(step).cloned().unwrap_or_default());
            }
        }
        if options.style == Style::Auto {
            tables.drop_small(plan);
        }
        let mut members = names.member_namer();
        for (index, bank) in tables.banks.iter_mut().enumerate() {
            bank.member = members.name("states");
            bank.suffix = if index == 0 { String::new() } else { format!("_{}", index + 1) };
            if bank.words_are_inputs(names) {
                bank.inputs = net
                    .inputs
                    .iter()
                    .filter(|(id, _)| names.io.input_bit(*id).is_some())
                    .map(|(id, _)| id)
                    .collect();
            }
            if bank.lamps_are_outputs(names) {
                bank.outputs = net
                    .outputs
                    .iter()
                    .filter(|(id, _)| names.io.output_bit(*id).is_some())
                    .map(|(id, _)| id)
                    .collect();
            }
            bank.inputs.sort_unstable();
            bank.outputs.sort_unstable();
            for (position, machine) in bank.machines.iter().enumerate() {
                tables.of[*machine] = Some((index, position));
            }
        }
        tables
    }

    /// Adds a variable to the first bank whose words have room for its inputs and outputs.
    fn deal(&mut self, machine: usize, inputs: &BTreeSet<InputId>, outputs: &BTreeSet<OutputId>) {
        let missing = |have: &[InputId]| inputs.iter().filter(|it| !have.contains(it)).count();
        let missing_out =
            |have: &[OutputId]| outputs.iter().filter(|it| !have.contains(it)).count();
        let fits = |bank: &Bank| {
            bank.inputs.len() + missing(&bank.inputs) <= SHARED_BITS
                && bank.outputs.len() + missing_out(&bank.outputs) <= SHARED_BITS
        };
        // Only the last few banks are tried, so the cost stays linear in the number of variables.
        let start = self.banks.len().saturating_sub(8);
        let found = self.banks[start..].iter().position(fits).map(|at| start + at);
        let at = found.unwrap_or_else(|| {
            self.banks.push(Bank::default());
            self.banks.len() - 1
        });
        let bank = &mut self.banks[at];
        bank.machines.push(machine);
        for input in inputs {
            if !bank.inputs.contains(input) {
                bank.inputs.push(*input);
            }
        }
        for output in outputs {
            if !bank.outputs.contains(output) {
                bank.outputs.push(*output);
            }
        }
    }

    /// The rows of a step.
    fn rows(&self, step: StepId) -> &[Row] {
        self.waiting.get(&step).map_or(&[], Vec::as_slice)
    }

    fn drop_small(&mut self, plan: &Plan) {
        let waiting = &self.waiting;
        let mut dropped = Vec::new();
        self.banks.retain(|bank| {
            let rows: usize = bank
                .machines
                .iter()
                .flat_map(|machine| &plan.machines[*machine].steps)
                .map(|step| waiting.get(step).map_or(0, Vec::len))
                .sum();
            if rows < MIN_ROWS {
                dropped.extend(bank.machines.iter().copied());
            }
            rows >= MIN_ROWS
        });
        for machine in dropped {
            for step in &plan.machines[machine].steps {
                self.waiting.remove(step);
                self.drives.remove(step);
            }
        }
    }

    /// True when no variable is in a table.
    pub(super) fn is_empty(&self) -> bool {
        self.banks.is_empty()
    }

    /// True for a variable in a table.
    pub(super) fn holds(&self, machine: usize) -> bool {
        self.of.get(machine).is_some_and(Option::is_some)
    }

    /// The member and the index of the element that stores the variable.
    pub(super) fn place(&self, machine: usize) -> Option<(&str, u32)> {
        let (bank, position) = (*self.of.get(machine)?)?;
        Some((&self.banks[bank].member, u32::try_from(position).ok()?))
    }

    /// The element that stores the variable.
    pub(super) fn element(&self, machine: usize) -> Option<String> {
        let (bank, position) = (*self.of.get(machine)?)?;
        Some(format!("{}[{position}]", self.banks[bank].member))
    }

    /// True for a step whose outputs the tables drive.
    pub(super) fn emits(&self, step: StepId) -> bool {
        self.drives.contains_key(&step)
    }

    /// The members of the instance.
    pub(super) fn members(&self, plan: &Plan) -> Vec<Member> {
        self.banks
            .iter()
            .map(|bank| {
                let objects = bank
                    .machines
                    .iter()
                    .flat_map(|it| &plan.machines[*it].steps)
                    .map(|step| Object::Step(*step))
                    .collect();
                Member {
                    declaration: format!(
                        "{} {}[{}]",
                        bank.state_type(plan),
                        bank.member,
                        bank.machines.len()
                    ),
                    note: "the active step of each sequence".to_string(),
                    objects,
                }
            })
            .collect()
    }

    /// The ranges of the members: adjacent variables with equal numbers of steps share a range.
    pub(super) fn ranges(&self, plan: &Plan) -> Vec<Range> {
        let mut ranges = Vec::new();
        for bank in &self.banks {
            let ty = bank.state_type(plan);
            let last = |machine: &usize| len(plan.machines[*machine].values()) - 1;
            let mut first = 0_u32;
            for alike in bank.machines.chunk_by(|a, b| last(a) == last(b)) {
                let behind = first + u32::try_from(alike.len()).unwrap_or(u32::MAX);
                let hi = alike.first().map_or(0, last);
                let whole = Range::of(bank.member.clone(), ty, 0, hi);
                ranges.push(Range { elements: Some((first, behind)), ..whole });
                first = behind;
            }
        }
        ranges
    }

    /// How the tables drive an output.
    pub(super) fn output_bit(&self, names: &Names, output: OutputId, mealy: bool) -> Option<CExpr> {
        if mealy {
            return None;
        }
        let terms: Vec<CExpr> = self
            .banks
            .iter()
            .filter(|bank| !bank.lamps_are_outputs(names))
            .filter_map(|bank| {
                let bit = bank.outputs.iter().position(|it| *it == output)?;
                let mask = mask(1 << bit, bank.outputs.len());
                Some(CExpr::condition(
                    format!("(lamps{} & {mask}) != 0U", bank.suffix),
                    Prec::Compare,
                ))
            })
            .collect();
        if terms.is_empty() { None } else { Some(CExpr::or(terms)) }
    }
}

impl Bank {
    /// True if all inputs that are bits fit in one word, which is then the bank's word.
    fn words_are_inputs(&self, names: &Names) -> bool {
        !self.inputs.is_empty() && (1..=SHARED_BITS).contains(&names.io.n_inputs)
    }

    /// True if all outputs that are bits fit in one word; then each row contains the bits to add to it.
    fn lamps_are_outputs(&self, names: &Names) -> bool {
        !self.outputs.is_empty() && (1..=SHARED_BITS).contains(&names.io.n_outputs)
    }

    fn state_type(&self, plan: &Plan) -> &'static str {
        let most = self.machines.iter().map(|it| plan.machines[*it].values()).max().unwrap_or(1);
        count_type(len(most) - 1)
    }

    /// True if every step waits for at most one term.
    fn single(&self, tables: &Tables, plan: &Plan) -> bool {
        self.steps(plan).all(|step| tables.rows(step).len() <= 1)
    }

    fn steps<'p>(&'p self, plan: &'p Plan) -> impl Iterator<Item = StepId> + 'p {
        self.machines.iter().flat_map(|it| plan.machines[*it].steps.iter().copied())
    }

    /// The number of values of all its variables together: each value has a row.
    fn values(&self, plan: &Plan) -> usize {
        self.machines.iter().map(|it| plan.machines[*it].values()).sum()
    }
}

/// Variables that depend on or affect something besides inputs and outputs.
fn busy_machines(net: &Net, plan: &Plan) -> BTreeSet<usize> {
    let mut busy = BTreeSet::new();
    for (id, transition) in net.transitions.iter() {
        if plan.is_wide[id] || plan.is_shown[id] || !transition.actions.is_empty() {
            busy.extend(transition.requires.iter().map(|step| plan.place[*step].0));
            busy.extend(following(transition).map(|step| plan.place[step].0));
        }
    }
    for output in net.outputs.values() {
        match &output.driver {
            Driver::Continuous(emissions) => {
                busy.extend(
                    emissions
                        .iter()
                        .filter(|it| it.condition.is_some())
                        .map(|it| plan.place[it.step].0),
                );
            }
            Driver::Mealy(emissions) => {
                busy.extend(emissions.iter().map(|it| plan.place[it.step].0))
            }
            Driver::Extern { calls, .. } => {
                busy.extend(calls.iter().map(|it| plan.place[it.step].0))
            }
            Driver::Fires(_) | Driver::Stored(_) | Driver::Controlled(_) => {}
        }
    }
    for emergency in net.emergency.iter() {
        for leaf in emergency.condition.leaves() {
            if let Leaf::Active(step) | Leaf::Elapsed(step) | Leaf::TasksDone(step) = leaf {
                busy.insert(plan.place[*step].0);
            }
        }
    }
    for (id, step) in net.steps.iter() {
        if !step.code.is_empty() {
            busy.insert(plan.place[id].0);
        }
    }
    busy
}

/// The conditions for which each step of a variable waits, if the variable is plain.
fn plain(net: &Net, plan: &Plan, index: usize) -> Option<Vec<(StepId, Vec<Row>)>> {
    let mut all = Vec::new();
    for step in &plan.machines[index].steps {
        let mut rows = Vec::new();
        for id in &plan.leaving[*step] {
            let target = plan.added(net, *id, index)?;
            for term in terms(net, &receptivity(net, *id), true)? {
                rows.push((term, target, *id));
            }
        }
        all.push((*step, rows));
    }
    Some(all)
}

/// A condition (or its negation) over Boolean inputs as a few conjunctions.
fn terms(net: &Net, expr: &Expr, wanted: bool) -> Option<Vec<Term>> {
    match &expr.kind {
        ExprKind::Bool(value) if *value == wanted => Some(vec![Term::new()]),
        ExprKind::Bool(_) => Some(Vec::new()),
        ExprKind::Leaf(Leaf::Input(input)) => {
            let it = &net.inputs[*input];
            let readable = it.ty.is_bool() && it.kind.is_handed();
            readable.then(|| vec![Term::from([(*input, wanted)])])
        }
        ExprKind::Not(inner) => terms(net, inner, !wanted),
        ExprKind::And(all) if wanted => product(net, all, true),
        ExprKind::Or(all) if !wanted => product(net, all, false),
        ExprKind::And(all) | ExprKind::Or(all) => {
            let mut sum = Vec::new();
            for operand in all {
                sum.extend(terms(net, operand, wanted)?);
                if sum.len() > MAX_TERMS {
                    return None;
                }
            }
            Some(sum)
        }
        ExprKind::Int(_)
        | ExprKind::Leaf(_)
        | ExprKind::Element(..)
        | ExprKind::Compare(..)
        | ExprKind::Neg(_)
        | ExprKind::Arith(..)
        | ExprKind::Select(..) => None,
    }
}

/// A conjunction of conditions (or of their negations) as a few conjunctions of inputs.
fn product(net: &Net, all: &[GenericExpr<Leaf>], wanted: bool) -> Option<Vec<Term>> {
    let mut result = vec![Term::new()];
    for operand in all {
        let mut next = Vec::new();
        for term in terms(net, operand, wanted)? {
            for earlier in &result {
                let mut joined = earlier.clone();
                // A conjunction that requires a signal and its negation is never true.
                if term
                    .iter()
                    .all(|(input, value)| *joined.entry(*input).or_insert(*value) == *value)
                {
                    next.push(joined);
                }
            }
        }
        if next.len() > MAX_TERMS {
            return None;
        }
        result = next;
    }
    Some(result)
}

fn mask(value: u64, bits: usize) -> String {
    match bits {
        0..=8 => format!("0x{value:02x}U"),
        9..=16 => format!("0x{value:04x}U"),
        17..=32 => format!("0x{value:08x}UL"),
        _ => format!("0x{value:016x}ULL"),
    }
}

fn len(count: usize) -> i64 {
    i64::try_from(count).unwrap_or(i64::MAX)
}
