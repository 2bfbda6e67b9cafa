//! Emitted C compared with the net over every state that either of them can reach, every input and every number of ticks that makes a difference.
//!
//! The compiled chart is asked for one reaction after another: from a numbered state of its instance, with given inputs. It answers with the row of the
//! trace and the number of the state it is in then; equal instances have equal numbers. The pairs of a net's state and an instance are
//! explored breadth first until no new one turns up, so that rows that agree everywhere are a proof for stimuli of any length (for this compiler).
//!
//! # Ticks
//! What a reaction of the net does depends on `dt` only up to the *horizon* of the state: the ticks after which all that counts has arrived at its last
//! threshold. C could do otherwise, so the proof tries every `dt` from 0 to one beyond the horizon, and what 8, 16 and 31 bits would lose. Where
//! that is too much, it tries those at, before and after each threshold, and says that it is no proof for every `dt`.

use crate::explorer::{Cell, Explorer, Instance, Trouble, differs, push};
use crate::tested::{self as directed, Tested};
use crate::tools;
use grafsynth_backend_c::{Carried, Package};
use grafsynth_driver::report::Line;
use grafsynth_driver::rows;
use grafsynth_driver::said::tested;
use grafsynth_ir::Valid;
use grafsynth_ir::net::Net;
use grafsynth_sim::{Coverage, InputRow, MAX_DT, Simulator, State, Thresholds, TraceLayout};
use grafsynth_verify::Limits;
use std::collections::BTreeMap;

/// The most combinations of inputs that are tried in a state.
const MAX_ROWS: usize = 1 << 12;
/// The most reactions at and around thresholds; a compiled chart answers some hundred thousand a second.
const MAX_REACTIONS: u64 = 200_000;
/// The most reactions that every `dt` may take besides.
const MAX_TICKS: u64 = 400_000;
/// Ticks that counters of 8 and 16 bits and a signed one of 32 would lose.
const WIDE: [u32; 3] = [1 << 8, 1 << 16, MAX_DT];

/// A shortest way, if it was enumerated, to a row that differs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Difference {
    pub(crate) path: Vec<InputRow>,
    pub(crate) cell: Cell,
}

/// What is known of emitted C.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Answer {
    /// Every reaction from every state agrees.
    Proved {
        /// Pairs of states.
        states: usize,
        /// Reactions that were compared.
        reactions: u64,
        /// The chart keeps a time, and every number of ticks was tried that makes a difference to it.
        every_dt: bool,
        /// What came on top, where something is not part of the enumeration.
        tested: Option<Coverage>,
    },
    /// It does something else than the net.
    Refuted {
        /// The rows from reset to the difference.
        path: Vec<InputRow>,
        /// The first column that differs.
        column: String,
        /// What the net has there.
        expected: String,
        /// What C has there.
        got: String,
    },
    /// Nothing differs in what was tried, but that is not all.
    Tested {
        /// Why it is no proof.
        why: Unproved,
        /// What was seen.
        coverage: Coverage,
    },
    /// The C compiler refuses the text: its words.
    Uncompiled(String),
    /// It could not be run.
    Unchecked(String),
}

/// Why emitted C was tested and not proved.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unproved {
    /// No proof was asked for.
    NotAsked,
    /// There are more combinations of inputs.
    Inputs(usize),
    /// There are more states.
    States {
        /// Reactions that agreed.
        reactions: u64,
        /// The states that they started from.
        states: usize,
    },
    /// All states and inputs, but not every `dt`.
    Ticks {
        /// Reactions that agreed.
        reactions: u64,
        /// The states that they started from.
        states: usize,
    },
}

/// Compares a package with its net: by enumeration if `prove`, and by [`directed::REACTIONS`] directed random reactions where that is no whole proof.
#[must_use]
pub fn answer(net: &Valid<Net>, package: &Package, limits: &Limits, prove: bool) -> Answer {
    if tools::c_compiler().is_none() {
        return Answer::Unchecked("no C compiler is here".to_owned());
    }
    let answer = if prove { proof(net, package, limits) } else { Ok(Err(Unproved::NotAsked)) };
    let answer = answer.and_then(|proof| match proof {
        Ok(Answer::Proved { states, reactions, every_dt, .. }) if package.has_gate() => {
            // The enumeration lets no reaction be skipped; what is skipped is tested.
            test(net, package).map(|tested| match tested {
                Tested::Equal(coverage) => {
                    Answer::Proved { states, reactions, every_dt, tested: Some(coverage) }
                }
                Tested::Different(found) => refuted(found),
            })
        }
        Ok(settled) => Ok(settled),
        Err(why) => test(net, package).map(|tested| match tested {
            Tested::Equal(coverage) => Answer::Tested { why, coverage },
            Tested::Different(found) => refuted(found),
        }),
    });
    answer.unwrap_or_else(|trouble| match trouble {
        Trouble::Compiler(words) => Answer::Uncompiled(words),
        Trouble::Program(why) => Answer::Unchecked(why),
    })
}

fn refuted(Difference { path, cell }: Difference) -> Answer {
    Answer::Refuted { path, column: cell.column, expected: cell.expected, got: cell.got }
}

fn test(net: &Valid<Net>, package: &Package) -> Result<Tested, Trouble> {
    let (mut explorer, first, start) = Explorer::start(net, package, Carried::All)?;
    directed::run(net, (&mut explorer, &first, start), 1).map_err(Trouble::Program)
}

/// The line of a report for an answer.
#[must_use]
pub fn line(name: &str, net: &Net, package: &Package, answer: &Answer) -> Line {
    let unseen = unseen(net, package);
    match answer {
        Answer::Proved { states, reactions, every_dt, tested: skipped } => {
            let ticks = if *every_dt { ", every dt" } else { "" };
            let gate = skipped.as_ref().map_or(String::new(), |coverage| {
                format!("; reactions that the gate skips: {}", tested(net, coverage))
            });
            Line::proved(
                name,
                format!(
                    "compiled and proved by enumeration: {states} states, {reactions} reactions{ticks}{gate}{unseen}"
                ),
            )
        }
        Answer::Refuted { path, column, expected, got } => Line::refuted(
            name,
            format!(
                "differs from the chart after {} reactions: {column} is `{expected}` in the chart and `{got}` in C",
                path.len()
            ),
        ),
        Answer::Tested { why, coverage } => {
            let why = match why {
                Unproved::NotAsked => "compiled; not proved, as asked".to_owned(),
                Unproved::Inputs(most) => {
                    format!("compiled; not proved: more than {most} inputs in each state")
                }
                Unproved::States { reactions, states } => format!(
                    "compiled; not proved to the end: equal in {reactions} reactions from {states} states, and there are more"
                ),
                Unproved::Ticks { reactions, states } => format!(
                    "compiled; not proved for every dt: equal in {reactions} reactions from all {states} states, with the dt at and around each threshold"
                ),
            };
            Line::open(name, format!("{why}; {}{unseen}", tested(net, coverage)))
        }
        Answer::Uncompiled(words) => Line::refuted(name, format!("does not compile: {words}")),
        Answer::Unchecked(why) => Line::open(name, format!("not checked: {why}{unseen}")),
    }
}

/// What the answer does not see, for the end of a line.
fn unseen(net: &Net, package: &Package) -> String {
    let Some(name) = package.critical_section(net) else { return String::new() };
    format!("; {name} is yours to define where an interrupt shares numbers with the chart")
}

/// What an exploration ended with.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Explored {
    /// No pair is left, and all rows agreed.
    Equal { states: usize, reactions: u64, is_every_dt: bool },
    /// A bound was met before; all rows so far agreed.
    TooMany { states: usize, reactions: u64 },
    /// A way to a row that differs.
    Different(Difference),
}

/// The proof by enumeration; why there is none.
fn proof(
    net: &Valid<Net>,
    package: &Package,
    limits: &Limits,
) -> Result<Result<Answer, Unproved>, Trouble> {
    let Some(inputs) = rows::all(net, &[1], MAX_ROWS) else {
        return Ok(Err(Unproved::Inputs(MAX_ROWS)));
    };
    let is_timed = rows::uses_time(net);
    let bound = limits.pairs.min(MAX_REACTIONS);
    let (explorer, first, start) = Explorer::start(net, package, Carried::State)?;
    let mut search = Search {
        net,
        layout: TraceLayout::of(net),
        thresholds: Thresholds::of(net),
        simulator: Simulator::new(net),
        explorer,
        inputs,
        is_timed,
        pairs: BTreeMap::new(),
        order: Vec::new(),
        came_from: Vec::new(),
        reactions: 0,
    };
    let explored = search.explore((&first, start), bound, limits.pairs.min(MAX_TICKS));
    Ok(match explored.map_err(Trouble::Program)? {
        Explored::Equal { states, reactions, is_every_dt: true } => {
            Ok(Answer::Proved { states, reactions, every_dt: is_timed, tested: None })
        }
        Explored::Equal { states, reactions, is_every_dt: false } => {
            Err(Unproved::Ticks { reactions, states })
        }
        Explored::TooMany { states, reactions } => Err(Unproved::States { reactions, states }),
        Explored::Different(found) => Ok(refuted(found)),
    })
}

/// Ticks of a state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Ticks {
    /// At and around thresholds, and what counters would lose.
    Around,
    /// All others up to the horizon.
    Others,
    /// Both.
    All,
}

struct Search<'n> {
    net: &'n Valid<Net>,
    layout: TraceLayout,
    thresholds: Thresholds,
    simulator: Simulator<'n>,
    explorer: Explorer,
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
    ) -> Result<Explored, String> {
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
        // Every pair is known now, so it can be told what every `dt` will cost.
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
        Explored::Equal { states: self.order.len(), reactions: self.reactions, is_every_dt }
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

    /// Visits every pair with the ticks around thresholds, or those visited so with all others, and each new one; what ended it before.
    fn all_pairs(&mut self, bound: u64, others: bool) -> Result<Option<Explored>, String> {
        let mut from = 0;
        let n_visited = if others { self.order.len() } else { 0 };
        while from < self.order.len() {
            // Some pairs at a time, but not more than a pipe's worth of text.
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
                    return Ok(Some(Explored::TooMany {
                        states: self.order.len(),
                        reactions: self.reactions,
                    }));
                }
                let instance = self.order[from].1;
                for dt in ticks {
                    for row in &self.inputs {
                        let row = InputRow { dt, ..row.clone() };
                        push(self.net, instance, &row, &mut questions);
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
    ) -> Result<Option<Explored>, String> {
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
