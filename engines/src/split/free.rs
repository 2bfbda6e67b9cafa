//! Parts that run on their own, in one run (semantics §10.7): the part on the CPU compiled, the chips with clocks of their own.
//!
//! Time passes when the program accesses a pin. Each change of a pin arrives late, at a time of its own at each reader; the clocks of the chips are faster or slower than
//! the program; all of this is random, and is chosen anew for each event, from a seed that is a function of the stimulus. An event comes when the parts are at rest.
//!
//! What follows an event is compared with the chart as sequences of values, one for each output and each step ([`Sequences`]).

use super::board::Happened;
use super::{Demand, OnCpu, Program};
use crate::{EngineError, Job, tools};
use grafsynth_ir::net::Net;
use grafsynth_sim::{
    Events, InputRow, Row, Sequences, Simulator, Stimulus, Trace, TraceLayout, joined_row,
};

/// The CPU is at rest after this number of rounds without a change, because edges and latches may change in the first one.
const QUIET_ROUNDS: usize = 2;
/// The largest number of rounds of the CPU, and of events at chips while it is at rest, after one event.
const MOST_ROUNDS: usize = 1 << 14;

/// Runs the events of a job.
///
/// # Errors
/// A stimulus that cannot be divided into events, parts that do not come to rest, and failures of the program.
pub(super) fn run(cpu: OnCpu<'_>, job: &Job<'_>, program: &Program) -> Result<Trace, EngineError> {
    let events =
        Events::of(job.net, job.stimulus).map_err(|found| EngineError::Refused(vec![*found]))?;
    let mut whole = Simulator::new(job.net);
    let first = whole.reset();
    let mut run = FreeRun {
        rows: Vec::new(),
        early: Vec::new(),
        sequences: Sequences::new(job.net, &first),
        before: first,
        whole,
        event: 0,
        input: InputRow { dt: 0, ..InputRow::zero(job.net) },
        latched: InputRow { dt: 0, ..InputRow::zero(job.net) },
        late: 0,
        is_disturbed: true,
        quiet: 0,
        rounds: 0,
        trace: Trace::new(TraceLayout::of(job.net)),
        events: &events,
        cpu,
    };
    let nets: Vec<&Net> = run.cpu.division.parts.iter().map(|part| &*part.net).collect();
    run.rows = run.cpu.board.rows(&nets, &run.input);
    run.early.push(run.rows.clone());
    run.cpu.board.run_free(seed(job.stimulus));
    program.converse(|message| run.answer(message))?;
    Ok(run.trace)
}

/// The seed of all speeds and delays of a run (FNV-1a).
fn seed(stimulus: &Stimulus) -> u64 {
    let mut seed = 0xcbf2_9ce4_8422_2325_u64;
    for row in stimulus.rows() {
        for value in row.values.iter().copied().chain([i64::from(row.dt)]) {
            seed = (seed ^ value.cast_unsigned()).wrapping_mul(0x0100_0000_01b3);
        }
    }
    seed
}

/// A run between two messages of the program.
struct FreeRun<'a> {
    cpu: OnCpu<'a>,
    events: &'a Events,
    /// The chart after the events before the current one, with its row.
    whole: Simulator<'a>,
    before: Row,
    /// The rows of the parts, that of the CPU last.
    rows: Vec<Row>,
    /// The rows of the chips from their start until the CPU shows its first one.
    early: Vec<Vec<Row>>,
    sequences: Sequences,
    /// The number of the current event; 0 is the time after reset.
    event: usize,
    /// The inputs of the plant.
    input: InputRow,
    /// The inputs as the CPU has latched them, and the time at which it sees the latest change.
    latched: InputRow,
    late: u64,
    /// True if something arrived at the CPU since its last round began.
    is_disturbed: bool,
    /// The number of rounds of the CPU without a change.
    quiet: usize,
    /// The number of rounds since the event.
    rounds: usize,
    trace: Trace,
}

impl FreeRun<'_> {
    fn answer(&mut self, message: tools::Message) -> Result<Option<u32>, String> {
        let answer = match self.cpu.demand(message)? {
            Demand::Answer(answer) => {
                // Only an access of a pin takes time.
                if matches!(message.kind, super::programs::READ | super::programs::WRITE) {
                    self.pass();
                }
                answer
            }
            Demand::Round => self.end_of_round()?,
        };
        match self.cpu.board.trouble() {
            Some(why) => Err(format!("event {}: {why}", self.event)),
            None => Ok(answer),
        }
    }

    /// The time of one access passes.
    fn pass(&mut self) {
        let until = self.cpu.board.lines().map_or(0, |lines| lines.now() + lines.access());
        while let Some(happened) = self.cpu.board.pass(until) {
            self.happened(happened);
        }
    }

    fn happened(&mut self, happened: Happened) {
        match happened {
            Happened::AtCpu => self.is_disturbed = true,
            Happened::AtChip => {}
            Happened::Edge(chip) => {
                let of_chip = self.cpu.division.parts.get(chip);
                let row = of_chip.and_then(|part| self.cpu.board.row(chip, &part.net, &self.input));
                if let (Some(row), Some(known)) = (row, self.rows.get_mut(chip)) {
                    *known = row;
                    if self.rows.len() == self.cpu.division.parts.len() {
                        self.see();
                    } else {
                        self.early.push(self.rows.clone());
                    }
                }
            }
        }
    }

    /// What all parts show now is seen.
    fn see(&mut self) {
        let row = self.row();
        self.sequences.see(self.cpu.net, &row);
    }

    fn row(&self) -> Row {
        joined_row(self.cpu.net, self.cpu.division, &self.rows, &self.input)
    }

    /// The CPU has made a round. Its next one.
    fn end_of_round(&mut self) -> Result<Option<u32>, String> {
        let Some(own) = self.cpu.row() else {
            return Err(format!("event {}: the response is malformed", self.event));
        };
        let cpu = self.cpu.division.parts.len() - 1;
        let is_same = self.rows.get(cpu) == Some(&own);
        match self.rows.get_mut(cpu) {
            Some(row) => *row = own,
            // Row 0 of the parts; the chips may have moved since then.
            None => {
                for (at, mut rows) in std::mem::take(&mut self.early).into_iter().enumerate() {
                    rows.push(own.clone());
                    self.rows = rows;
                    if at == 0 {
                        let cells = self.trace.layout.row(&self.row());
                        self.trace.push(cells);
                        self.sequences = Sequences::new(self.cpu.net, &self.row());
                    }
                    self.see();
                }
            }
        }
        self.see();
        self.quiet = if is_same && !self.is_disturbed { self.quiet + 1 } else { 0 };
        self.rounds += 1;
        if self.rounds > MOST_ROUNDS {
            return Err(self.no_rest());
        }
        let mut dt = 0;
        if self.quiet >= QUIET_ROUNDS && self.is_rest()? {
            self.end_of_event();
            let Some(next) = self.next_event() else { return Ok(self.cpu.ask(None)) };
            dt = next;
        }
        self.is_disturbed = false;
        if self.now() >= self.late && self.latched.values != self.input.values {
            self.latched.values.clone_from(&self.input.values);
            self.is_disturbed = true;
        }
        self.latched.dt = dt;
        self.is_disturbed |= dt > 0;
        Ok(self.cpu.ask(Some(&self.latched)))
    }

    fn now(&mut self) -> u64 {
        self.cpu.board.lines().map_or(0, |lines| lines.now())
    }

    fn no_rest(&self) -> String {
        format!("event {}: the parts do not come to rest", self.event)
    }

    /// The CPU is at rest: time passes until something arrives there. True if nothing will.
    fn is_rest(&mut self) -> Result<bool, String> {
        for _ in 0..MOST_ROUNDS {
            let is_late = self.latched.values != self.input.values;
            let at_rest = self.cpu.board.lines().is_none_or(|lines| lines.are_at_rest());
            if at_rest && !is_late {
                return Ok(true);
            }
            let until = if is_late { self.late } else { u64::MAX };
            match self.cpu.board.pass(until) {
                Some(happened) => self.happened(happened),
                // The change of the input is there.
                None => return Ok(false),
            }
            if self.is_disturbed {
                return Ok(false);
            }
        }
        Err(self.no_rest())
    }

    /// The rows of the event that has ended.
    fn end_of_event(&mut self) {
        let rows = self.events.rows_of(self.event).unwrap_or_default();
        let of_net: Vec<Row> =
            rows.map(|at| self.whole.step(&self.events.stimulus.row(at)).clone()).collect();
        let end = self.row();
        for row in self.sequences.end(self.cpu.net, &self.before, &of_net, &end) {
            let cells = self.trace.layout.row(&row);
            self.trace.push(cells);
        }
        if let Some(last) = of_net.into_iter().next_back() {
            self.before = last;
        }
    }

    /// Starts the next event; returns its ticks, or `None` if there is none.
    fn next_event(&mut self) -> Option<u32> {
        self.event += 1;
        let first = self.events.rows_of(self.event)?.start;
        let row = self.events.stimulus.row(first);
        (self.quiet, self.rounds) = (0, 0);
        let delay = self.cpu.board.lines().map_or(0, |lines| {
            lines.change_speeds();
            lines.now() + lines.delay()
        });
        if row.values != self.input.values {
            self.late = delay;
            self.input.values.clone_from(&row.values);
            self.cpu.board.supply(self.cpu.net, &self.input, false);
        }
        Some(row.dt)
    }
}
