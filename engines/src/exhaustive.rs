//! Compares emitted C with the net over every state that either of them can reach, every input and every relevant number of ticks.
//!
//! The compiled chart executes one reaction after another: from a numbered state of its instance, with given inputs. It answers with the row of the trace
//! and the number of the state after it; equal instances have equal numbers. The pairs of a net's state and an instance are explored breadth-first until
//! no new pair appears, so that rows that agree everywhere are a proof for stimuli of any length (with this compiler).
//!
//! # Ticks
//! A reaction of the net depends on `dt` only up to the *horizon* of the state: the number of ticks after which every counter is beyond its last
//! threshold. C code could behave differently, so the proof tries every `dt` from 0 to one beyond the horizon, the first values beyond counters of 8 and 16
//! bits, and the largest `dt`. If this is too much work, it tries those at, before and after each threshold, and reports that it is not a proof for every `dt`.

use crate::executed::{Instance, Trouble};
use crate::explorer::{Build, Difference, Explorer, Runner, Start, differs, push};
pub use crate::interpreted::Text;
use crate::unread_inputs::unread_inputs;
use crate::{c, tested, tools};
use grafsynth_backend_c::Package;
use grafsynth_driver::report::{
    Note, OutputFault, OutputProof, OutputReport, OutputVerdict, Ran, RowFault,
};
use grafsynth_driver::rows;
use grafsynth_ir::instance::Representation;
use grafsynth_ir::net::{InputId, InputKind, Net};
use grafsynth_ir::{FileId, Valid};
use grafsynth_sim::{
    Column, InputRow, MAX_DT, Simulator, State, Stimulus, Thresholds, Trace, TraceLayout, Value,
};
use grafsynth_verify::c_code::Induction;
use grafsynth_verify::{Limits, Open, OpenReason, Scope};
use std::collections::BTreeMap;

/// The maximum number of input combinations that are tried in a state.
const MAX_ROWS: usize = 1 << 12;
/// The maximum number of reactions with ticks at and around thresholds; several hundred thousand reactions are compared per second.
const MAX_REACTIONS: u64 = 400_000;
/// The same for a text that is proved, where the run is only a test of the proof and of the compiler.
const FEW_REACTIONS: u64 = 20_000;
/// The numbers of reactions of a text that is executed from its tree: from reset on, random ones, and random ones of a proved text, which are a test of the proof.
const FEW_EXECUTED: u64 = 2_000;
const EXECUTED: usize = 4_000;
const EXECUTED_PROVED: usize = 200;
/// The maximum number of additional reactions for a proof that covers every `dt`.
const MAX_TICKS: u64 = 1_000_000;
/// Tick counts that do not fit in counters of 8 and 16 bits, and the maximum for a signed counter of 32 bits.
const WIDE: [u32; 3] = [1 << 8, 1 << 16, MAX_DT];

/// The output of the host's compiler if it rejects emitted C.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Refused(pub String);

/// Compares a package with its net. `read` is the result of the proof of its text. The text is compiled and run as well: in every state if these are few or nothing
/// else proves it, otherwise in directed random reactions. If a proof was not requested, it runs only in directed random reactions.
///
/// # Errors
/// The compiler rejects the text.
pub fn check(
    name: &str,
    net: &Valid<Net>,
    package: &Package,
    limits: &Limits,
    read: Result<Induction, OpenReason>,
) -> Result<OutputReport, Refused> {
    let verdict = match verdict(net, package, limits, read.clone()) {
        Ok(verdict) => verdict,
        Err(Trouble::Compiler(words)) => return Err(Refused(words)),
        Err(Trouble::Machine(why)) => not_run(read, OpenReason::ToolFailed(why)),
        Err(Trouble::Chart(why)) => OutputVerdict::Refuted(OutputFault::NoAnswer(why)),
    };
    let mut report = OutputReport::new(name, verdict);
    report.notes.extend(package.has_gate().then_some(Note::Gate));
    report.notes.extend(package.critical_section(net).map(Note::CriticalSection));
    Ok(report)
}

/// Compares edited C with its net without compiling it: its tree is executed, in few states from reset on and in directed random reactions. This can refute the text,
/// also against a proof, but not prove it.
#[must_use]
pub fn check_text(
    name: &str,
    net: &Valid<Net>,
    package: &Package,
    text: &Text<'_>,
    read: Result<Induction, OpenReason>,
) -> OutputReport {
    let interface = Representation { state: Vec::new(), ..text.hint.clone() };
    let runner = Runner::Tree(text, &interface);
    let verdict = match executed(net, package, text.limits, runner, read.clone()) {
        Ok(verdict) => verdict,
        Err(Trouble::Chart(why)) => OutputVerdict::Refuted(OutputFault::NoAnswer(why)),
        Err(Trouble::Machine(why) | Trouble::Compiler(why)) => match read {
            Ok(induction) => {
                let ran = Err(OpenReason::ToolFailed(why));
                OutputVerdict::Proved(OutputProof::Edited { induction, ran })
            }
            Err(reason) => {
                let reasons = vec![reason, OpenReason::ToolFailed(why)];
                OutputVerdict::Open(Open { reasons, tested: None })
            }
        },
    };
    OutputReport::new(name, verdict)
}

fn executed(
    net: &Valid<Net>,
    package: &Package,
    limits: &Limits,
    runner: Runner<'_>,
    read: Result<Induction, OpenReason>,
) -> Result<OutputVerdict, Trouble> {
    if read.is_err()
        && let Proof::Verdict(OutputVerdict::Refuted(fault)) =
            proof(net, package, limits, runner, FEW_EXECUTED)?
    {
        return Ok(OutputVerdict::Refuted(fault));
    }
    let reactions = if read.is_ok() { EXECUTED_PROVED } else { EXECUTED };
    Ok(match (tested::run(net, package, runner, 1, reactions)?, read) {
        (tested::Answer::Different(found), _) => refuted(net, package, runner, found),
        (tested::Answer::Equal(tested), Ok(induction)) => {
            OutputVerdict::Proved(OutputProof::Edited { induction, ran: Ok(tested) })
        }
        (tested::Answer::Equal(tested), Err(why)) => {
            OutputVerdict::Open(Open { reasons: vec![why], tested: Some(tested) })
        }
    })
}

/// The verdict on a text that cannot be compiled and run here.
fn not_run(read: Result<Induction, OpenReason>, why: OpenReason) -> OutputVerdict {
    match read {
        Ok(induction) => OutputVerdict::Proved(OutputProof::Text { induction, ran: Err(why) }),
        Err(_) => OutputVerdict::Open(Open::because(why)),
    }
}

fn verdict(
    net: &Valid<Net>,
    package: &Package,
    limits: &Limits,
    read: Result<Induction, OpenReason>,
) -> Result<OutputVerdict, Trouble> {
    if tools::c_compiler().is_none() {
        return Ok(not_run(read, OpenReason::ToolMissing(vec!["a C compiler".to_owned()])));
    }
    let is_whole = read.as_ref().is_ok_and(|induction| !induction.is_of_image);
    let reactions = if is_whole { FEW_REACTIONS } else { MAX_REACTIONS };
    let mut reasons = Vec::new();
    // A run is no evidence if it depends on undefined behaviour; the proof of the text excludes that, but not in an engine.
    let is_plain = is_whole || read == Err(OpenReason::NotAsked);
    let runner = Runner::Compiled(if is_plain { Build::Plain } else { Build::Sanitized });
    if read != Err(OpenReason::NotAsked) {
        match proof(net, package, limits, runner, reactions)? {
            Proof::Verdict(verdict) => return Ok(verdict),
            Proof::None(reason) => reasons.push(reason),
        }
    }
    Ok(match (tested::run(net, package, runner, 1, tested::REACTIONS)?, read) {
        (tested::Answer::Different(found), _) => refuted(net, package, runner, found),
        (tested::Answer::Equal(tested), Ok(induction)) => {
            OutputVerdict::Proved(OutputProof::Text { induction, ran: Ok(tested) })
        }
        (tested::Answer::Equal(tested), Err(why)) => {
            reasons.push(why);
            OutputVerdict::Open(Open { reasons, tested: Some(tested) })
        }
    })
}

fn refuted(
    net: &Valid<Net>,
    package: &Package,
    runner: Runner<'_>,
    found: Difference,
) -> OutputVerdict {
    let trace = trace(net, package, runner, &found);
    let Difference { path, cell } = found;
    OutputVerdict::Refuted(OutputFault::Row(Box::new(RowFault {
        stimulus: Stimulus::of_rows(net, &path),
        column: cell.column,
        chart: cell.expected,
        output: cell.got,
        of: Ran::C,
        trace,
    })))
}

/// The trace of the compiled chart on the path to a difference, run from reset. `None` if it cannot be run again, or does not show the same difference then.
fn trace(
    net: &Valid<Net>,
    package: &Package,
    runner: Runner<'_>,
    found: &Difference,
) -> Option<Trace> {
    let mut started = Explorer::start(net, package, runner).ok()?;
    let layout = TraceLayout::of(net);
    let mut csv = format!("{}{}\n", Trace::new(layout.clone()).to_csv(), started.row);
    let mut questions = String::new();
    for (at, row) in found.path.iter().enumerate() {
        push(net, Start::Answer(at), row, &mut questions);
    }
    let add = |_, answer: &str, _| {
        csv.push_str(answer);
        csv.push('\n');
        true
    };
    started.explorer.ask(&questions, found.path.len(), add).ok()?;
    let trace = Trace::parse_csv(&layout, FileId(u32::MAX), &csv).ok()?;
    let is_same = |column: &Column, value: &Value| {
        column.name == found.cell.column && layout.text(value) == found.cell.got
    };
    let last = trace.rows.get(found.path.len())?;
    layout
        .columns
        .iter()
        .zip(&last.values)
        .any(|(column, value)| is_same(column, value))
        .then_some(trace)
}

/// The result of a proof attempt.
enum Proof {
    /// The proof attempt gives a verdict.
    Verdict(OutputVerdict),
    /// There is no proof, with the reason.
    None(OpenReason),
}

/// The result of an exploration.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Explored {
    /// No pair is left, and all rows agreed.
    Equal { states: usize, reactions: u64, scope: Scope },
    /// A bound was reached; all rows so far agreed.
    TooMany { states: usize, limit: u64 },
    /// A path to a row that differs.
    Different(Difference),
}

/// The proof by enumeration.
fn proof(
    net: &Valid<Net>,
    package: &Package,
    limits: &Limits,
    runner: Runner<'_>,
    reactions: u64,
) -> Result<Proof, Trouble> {
    let unread = unread_inputs(net, package);
    let in_net = rows::read_pins(net);
    let varies = |id: InputId| {
        let input = &net.inputs[id];
        input.kind != InputKind::Pin
            || in_net.contains(&id)
            || !unread.contains(package.input_name(id))
    };
    let Some(inputs) = rows::all(net, &[1], MAX_ROWS, varies) else {
        return Ok(Proof::None(OpenReason::Rows { limit: MAX_ROWS as u64 }));
    };
    let bound = limits.pairs.min(reactions);
    let ticks = if reactions < MAX_REACTIONS { reactions } else { MAX_TICKS };
    let started = Explorer::start(net, package, runner)?;
    let mut search = Search {
        net,
        layout: TraceLayout::of(net),
        thresholds: Thresholds::of(net),
        simulator: Simulator::new(net),
        explorer: started.explorer,
        inputs,
        is_timed: rows::uses_time(net),
        pairs: BTreeMap::new(),
        order: Vec::new(),
        came_from: Vec::new(),
        reactions: 0,
    };
    let explored =
        search.explore((&started.row, started.instance), bound, limits.pairs.min(ticks))?;
    Ok(match explored {
        Explored::Equal { states, reactions, scope: Scope::EveryStimulus } => {
            Proof::Verdict(OutputVerdict::Proved(OutputProof::Run {
                states: states as u64,
                reactions,
                scope: Scope::EveryStimulus,
                // A plain build is only used for a text that is proved.
                is_defined: !matches!(runner, Runner::Compiled(Build::Sanitized))
                    || !c::sanitizers().is_empty(),
            }))
        }
        Explored::Equal { states, reactions, scope } => {
            Proof::None(OpenReason::RunOnlyFor { scope, states: states as u64, reactions })
        }
        Explored::TooMany { states, limit } => Proof::None(OpenReason::Pairs { limit, states }),
        Explored::Different(found) => Proof::Verdict(refuted(net, package, runner, found)),
    })
}

/// The ticks to try in a state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Ticks {
    /// The ticks 0 and 1, those at and around thresholds, and [`WIDE`].
    Around,
    /// All other ticks up to the horizon.
    Others,
    /// All ticks of both kinds.
    All,
}

struct Search<'n> {
    net: &'n Valid<Net>,
    layout: TraceLayout,
    thresholds: Thresholds,
    simulator: Simulator<'n>,
    explorer: Explorer<'n>,
    /// All combinations of inputs.
    inputs: Vec<InputRow>,
    is_timed: bool,
    pairs: BTreeMap<(State, Instance), usize>,
    order: Vec<(State, Instance)>,
    came_from: Vec<Option<(usize, InputRow)>>,
    reactions: u64,
}

impl Search<'_> {
    fn explore(
        &mut self,
        (first, start): (&str, Instance),
        bound: u64,
        bound_of_ticks: u64,
    ) -> Result<Explored, Trouble> {
        let row = self.simulator.reset();
        if let Some(cell) = differs(&self.layout, &row, first) {
            return Ok(Explored::Different(Difference { path: Vec::new(), cell }));
        }
        let pair = (self.simulator.state().clone(), start);
        self.pairs.insert(pair.clone(), 0);
        self.order.push(pair);
        self.came_from.push(None);
        if let Some(ended) = self.all_pairs(bound, false)? {
            return Ok(ended);
        }
        // Every pair is known now, so the cost of every `dt` can be computed.
        let mut cost = self.reactions;
        for at in 0..self.order.len() {
            cost = cost.saturating_add(
                self.ticks(at, Ticks::Others).len() as u64 * self.inputs.len() as u64,
            );
            if cost > bound_of_ticks {
                return Ok(self.equal(false));
            }
        }
        if cost > self.reactions
            && let Some(ended) = self.all_pairs(bound_of_ticks, true)?
        {
            return Ok(match ended {
                Explored::TooMany { .. } => self.equal(false),
                Explored::Equal { .. } | Explored::Different(_) => ended,
            });
        }
        Ok(self.equal(true))
    }

    fn equal(&self, is_every_dt: bool) -> Explored {
        let scope = if is_every_dt { Scope::EveryStimulus } else { Scope::Thresholds };
        Explored::Equal { states: self.order.len(), reactions: self.reactions, scope }
    }

    /// The ticks to try in the state of a pair.
    fn ticks(&mut self, pair: usize, which: Ticks) -> Vec<u32> {
        if !self.is_timed {
            return if which == Ticks::Others { Vec::new() } else { vec![1] };
        }
        self.simulator.set_state(&self.order[pair].0);
        let horizon = self.thresholds.horizon(&self.simulator);
        let mut around = vec![0, 1, horizon, horizon + 1];
        around.extend(self.thresholds.ahead(&self.simulator, MAX_DT));
        around.extend(WIDE);
        around.sort_unstable();
        around.dedup();
        let others = || (0..=horizon).filter(|dt| around.binary_search(dt).is_err());
        match which {
            Ticks::Around => around,
            Ticks::Others => others().collect(),
            Ticks::All => others().chain(around.iter().copied()).collect(),
        }
    }

    /// Visits every pair with the ticks around thresholds; with `others`, the pairs visited so far with all other ticks, and new pairs with all ticks. Returns
    /// why it stopped early.
    fn all_pairs(&mut self, bound: u64, others: bool) -> Result<Option<Explored>, Trouble> {
        let mut from = 0;
        let n_visited = if others { self.order.len() } else { 0 };
        while from < self.order.len() {
            // Several pairs at a time, but no more text than a pipe can hold.
            let mut asked: Vec<(usize, InputRow)> = Vec::new();
            let mut questions = String::new();
            while from < self.order.len() && asked.len() < 4096 {
                let which = match others {
                    false => Ticks::Around,
                    true if from < n_visited => Ticks::Others,
                    true => Ticks::All,
                };
                let ticks = self.ticks(from, which);
                let cost = ticks.len() as u64 * self.inputs.len() as u64;
                if self.reactions + asked.len() as u64 + cost > bound {
                    // What was requested so far may already show a difference.
                    let found = self.batch(&asked, &questions)?;
                    let states = self.order.len();
                    return Ok(found.or(Some(Explored::TooMany { states, limit: bound })));
                }
                let instance = self.order[from].1;
                for dt in ticks {
                    for row in &self.inputs {
                        let row = InputRow { dt, ..row.clone() };
                        push(self.net, Start::State(instance), &row, &mut questions);
                        asked.push((from, row));
                    }
                }
                from += 1;
            }
            if let Some(found) = self.batch(&asked, &questions)? {
                return Ok(Some(found));
            }
        }
        Ok(None)
    }

    fn batch(
        &mut self,
        asked: &[(usize, InputRow)],
        questions: &str,
    ) -> Result<Option<Explored>, Trouble> {
        let Search { explorer, simulator, layout, pairs, order, came_from, .. } = self;
        let mut found = None;
        explorer.ask(questions, asked.len(), |at, answer, instance| {
            let (pair, row) = &asked[at];
            simulator.set_state(&order[*pair].0);
            let expected = simulator.step(row);
            if let Some(cell) = differs(layout, expected, answer) {
                found = Some((at, cell));
                return false;
            }
            let next = (simulator.state().clone(), instance);
            if !pairs.contains_key(&next) {
                pairs.insert(next.clone(), order.len());
                order.push(next);
                came_from.push(Some((*pair, row.clone())));
            }
            true
        })?;
        self.reactions += asked.len() as u64;
        Ok(found.map(|(at, cell)| {
            let (pair, row) = &asked[at];
            let mut path = vec![row.clone()];
            let mut back = *pair;
            while let Some((before, by)) = &self.came_from[back] {
                path.push(by.clone());
                back = *before;
            }
            path.reverse();
            Explored::Different(Difference { path, cell })
        }))
    }
}
