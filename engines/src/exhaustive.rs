//! Emitted C compared with the net over every state that either of them can reach and every input.
//!
//! The compiled chart is asked for one reaction after another: from a numbered state of its instance, with given inputs. It answers with the row of the
//! trace and the number of the state it is in then; equal instances have equal numbers. The pairs of a net's state and an instance are
//! explored breadth first until no new one turns up, so that rows that agree everywhere are a proof for stimuli of any length (for this compiler and
//! the ticks that were tried).

use crate::c;
use crate::tools;
use grafsynth_backend_c::Package;
use grafsynth_driver::report::{OutputFault, OutputProof, OutputReport, OutputVerdict};
use grafsynth_driver::rows;
use grafsynth_ir::Valid;
use grafsynth_ir::facts::Facts;
use grafsynth_ir::net::Net;
use grafsynth_sim::{InputRow, Row, Simulator, State, Stimulus, TraceLayout};
use grafsynth_verify::{Limits, Open, OpenReason, Scope, Tested};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::{BufRead, BufReader, Write as _};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

/// The most input rows that are tried in a state.
const MAX_ROWS: usize = 1 << 12;
/// The most reactions of a check; a compiled chart answers about a million a second.
const MAX_REACTIONS: u64 = 200_000;

/// Compares a package with its net; the line says what was proved, or why nothing was.
#[must_use]
pub fn check(
    name: &str,
    net: &Valid<Net>,
    _facts: &Facts,
    package: &Package,
    limits: &Limits,
) -> OutputReport {
    if tools::c_compiler().is_none() {
        return OutputReport::open(name, OpenReason::ToolMissing(vec!["a C compiler".to_owned()]));
    }
    let dts: &[u32] = if rows::uses_time(net) { &[0, 1, 1000] } else { &[1] };
    let Some(rows) = rows::all(net, dts, MAX_ROWS) else {
        return OutputReport::open(name, OpenReason::Rows { limit: MAX_ROWS as u64 });
    };
    let bound = limits.pairs.min(MAX_REACTIONS);
    if rows.len() as u64 > bound {
        return OutputReport::open(name, OpenReason::Rows { limit: bound });
    }
    let main = grafsynth_backend_c::explorer(net, package);
    // The text is compared as it is written; optimising would only cost time here.
    let program = match c::compile(package, &main, &["-std=c99", "-O0"]) {
        Ok(program) => program,
        Err(why) => return OutputReport::open(name, OpenReason::ToolFailed(why)),
    };
    let explored = Explorer::start(&program)
        .and_then(|mut explorer| explore(net, &mut explorer, &rows, bound));
    match explored {
        Ok(Explored::Equal { states, reactions }) => {
            let scope = Scope::Ticks(dts.to_vec());
            let states = states as u64;
            OutputReport::proved(name, OutputProof::Run { states, reactions, scope })
        }
        Ok(Explored::TooMany { states, reactions }) => {
            let open = Open::because(OpenReason::Pairs { limit: bound, states });
            let tested = Tested { reactions, ..Tested::default() };
            OutputReport::new(name, OutputVerdict::Open(open.tested(tested)))
        }
        Ok(Explored::Different { path, column, expected, got }) => {
            let stimulus = Stimulus::of_rows(net, &path);
            let (chart, output) = (expected, got);
            OutputReport::refuted(
                name,
                OutputFault::Row { stimulus, column, chart, output, of: "C" },
            )
        }
        Err(why) => OutputReport::open(name, OpenReason::ToolFailed(why)),
    }
}

/// What an exploration ended with.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Explored {
    /// No pair is left, and all rows agreed.
    Equal { states: usize, reactions: u64 },
    /// A bound was met before; all rows so far agreed.
    TooMany { states: usize, reactions: u64 },
    /// A shortest way to a row that differs.
    Different { path: Vec<InputRow>, column: String, expected: String, got: String },
}

/// The compiled chart with its pipes.
struct Explorer {
    child: Child,
    input: Option<ChildStdin>,
    output: BufReader<ChildStdout>,
}

impl Drop for Explorer {
    fn drop(&mut self) {
        // It ends when its input does; if not, it is stopped.
        self.input = None;
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Explorer {
    fn start(program: &c::Program) -> Result<Self, String> {
        let mut child = Command::new(&program.path)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .map_err(|error| format!("the compiled chart cannot be started: {error}"))?;
        let (Some(input), Some(output)) = (child.stdin.take(), child.stdout.take()) else {
            return Err("the compiled chart has no pipes".to_owned());
        };
        Ok(Explorer { child, input: Some(input), output: BufReader::new(output) })
    }

    fn answer(&mut self) -> Result<(String, usize), String> {
        let mut line = |text: &mut String| match self.output.read_line(text) {
            Ok(n) if n > 0 => Ok(()),
            Ok(_) => Err("the compiled chart ended early".to_owned()),
            Err(error) => Err(format!("the compiled chart cannot be read: {error}")),
        };
        let (mut row, mut state) = (String::new(), String::new());
        line(&mut row)?;
        line(&mut state)?;
        let state = state
            .trim()
            .parse()
            .map_err(|_| format!("the compiled chart printed `{}`", state.trim()))?;
        row.truncate(row.trim_end().len());
        Ok((row, state))
    }

    /// Asks for all of these reactions and takes the answers as they come.
    fn ask(
        &mut self,
        questions: &str,
        n_answers: usize,
        mut take: impl FnMut(usize, &str, usize) -> bool,
    ) -> Result<(), String> {
        let Some(mut input) = self.input.take() else {
            return Err("the compiled chart has ended".to_owned());
        };
        std::thread::scope(|scope| {
            // Questions and answers are served at once: a full pipe on one side must not stop the other.
            let writer = scope.spawn(move || {
                let sent = input.write_all(questions.as_bytes()).and_then(|()| input.flush());
                (input, sent)
            });
            let mut outcome = Ok(());
            for at in 0..n_answers {
                match self.answer() {
                    // A difference was found: the rest is read, so that the writer ends.
                    Ok((row, state)) => {
                        if !take(at, &row, state) {
                            let _ = self.child.kill();
                            break;
                        }
                    }
                    Err(why) => {
                        outcome = Err(why);
                        let _ = self.child.kill();
                        break;
                    }
                }
            }
            match writer.join() {
                Ok((input, _)) => {
                    self.input = Some(input);
                    outcome
                }
                Err(_) => Err("the compiled chart cannot be asked".to_owned()),
            }
        })
    }
}

fn explore(
    net: &Valid<Net>,
    explorer: &mut Explorer,
    rows: &[InputRow],
    bound: u64,
) -> Result<Explored, String> {
    let layout = TraceLayout::of(net);
    let mut simulator = Simulator::new(net);
    let first = simulator.reset();
    let (row, start) = {
        let mut header = String::new();
        explorer
            .output
            .read_line(&mut header)
            .map_err(|error| format!("the compiled chart cannot be read: {error}"))?;
        explorer.answer()?
    };
    if let Some((column, expected, got)) = differs(&layout, &first, &row) {
        return Ok(Explored::Different { path: Vec::new(), column, expected, got });
    }
    let mut pairs: BTreeMap<(State, usize), usize> = BTreeMap::new();
    let mut order = vec![(simulator.state().clone(), start)];
    let mut came_from: Vec<Option<(usize, usize)>> = vec![None];
    pairs.insert(order[0].clone(), 0);
    let (mut from, mut reactions) = (0, 0_u64);
    while from < order.len() {
        // One level at a time, but not more than a pipe's worth of text.
        let to = order.len().min(from + 4096 / rows.len().max(1) + 1);
        if reactions + ((to - from) * rows.len()) as u64 > bound {
            return Ok(Explored::TooMany { states: order.len(), reactions });
        }
        let mut questions = String::new();
        for (_, instance) in &order[from..to] {
            for row in rows {
                let _ = write!(questions, "{instance} ");
                c::line(net, row, &mut questions);
            }
        }
        let mut found = None;
        let batch: Vec<State> = order[from..to].iter().map(|(state, _)| state.clone()).collect();
        explorer.ask(&questions, batch.len() * rows.len(), |at, answer, instance| {
            let (pair, row) = (at / rows.len(), at % rows.len());
            simulator.set_state(&batch[pair]);
            let expected = simulator.step(&rows[row]);
            if let Some(difference) = differs(&layout, expected, answer) {
                found = Some((from + pair, row, difference));
                return false;
            }
            let next = (simulator.state().clone(), instance);
            if !pairs.contains_key(&next) {
                pairs.insert(next.clone(), order.len());
                order.push(next);
                came_from.push(Some((from + pair, row)));
            }
            true
        })?;
        reactions += (batch.len() * rows.len()) as u64;
        if let Some((pair, row, (column, expected, got))) = found {
            let mut path = vec![rows[row].clone()];
            let mut back = pair;
            while let Some((before, by)) = came_from[back] {
                path.push(rows[by].clone());
                back = before;
            }
            path.reverse();
            return Ok(Explored::Different { path, column, expected, got });
        }
        from = to;
    }
    Ok(Explored::Equal { states: order.len(), reactions })
}

/// The first cell of a printed row that differs from the simulator's: its column and both texts. The number of the scan is not compared.
fn differs(
    layout: &TraceLayout,
    expected: &Row,
    printed: &str,
) -> Option<(String, String, String)> {
    let wanted = layout.row(expected);
    let mut cells = printed.split(',');
    for (at, column) in layout.columns.iter().enumerate() {
        let got = cells.next().unwrap_or("(missing)");
        let is_open = wanted.open.get(at).copied().unwrap_or(false);
        let expected = wanted.values.get(at).map(|value| layout.text(value)).unwrap_or_default();
        if at > 0 && !is_open && got != expected {
            return Some((column.name.clone(), expected, got.to_owned()));
        }
    }
    None
}
