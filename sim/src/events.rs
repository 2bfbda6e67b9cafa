//! A stimulus as parts that run on their own get it (semantics §10.7): one event at a time, and rest before the next one.
//!
//! ```text
//! a row with dt 2 in which a and b change   becomes   tick, rest, tick, rest, a, rest, b, rest
//! ```

use std::collections::BTreeSet;

use grafsynth_ir::net::{InputId, InputKind, Leaf, Net};
use grafsynth_ir::{Diagnostic, Valid};

use crate::clocked::MAX_CLOCKS;
use crate::codes;
use crate::row::{InputRow, Row};
use crate::simulator::Simulator;
use crate::stimulus::{Stimulus, breaks_assumption};
use crate::trace::{ColumnKind, Trace, Value};

/// The largest number of reactions of a net after one event.
const MOST_REACTIONS: usize = 1 << 12;
/// The largest number of combinations of inputs that are tried to change several inputs one after another.
const MOST_TRIES: usize = 1 << 12;

/// The events of a stimulus, each with the reactions of the net until it is at rest.
///
/// The rows of a stimulus in which nothing happens are left out, so the events of [`Events::stimulus`] are these events again.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Events {
    /// For each event, a row in which it happens, and then the rows in which the net comes to rest. The first rows have no event: the parts come to rest after reset.
    pub stimulus: Stimulus,
    /// For each event, the number of rows up to its end; first that of the rows without an event.
    ends: Vec<usize>,
    /// For each row of the original, its `dt` and the number of rows up to the end of its last event.
    rows: Vec<(u32, usize)>,
}

impl Events {
    /// Divides the rows of a stimulus into events: first the ticks of a row, if the net measures time, then its inputs, in the order of their declarations as far as
    /// the assumptions of the net allow that.
    ///
    /// # Errors
    /// The net does not come to rest after an event; inputs that cannot change one after another under the assumptions; more than [`MAX_CLOCKS`] rows.
    pub fn of(net: &Valid<Net>, stimulus: &Stimulus) -> Result<Self, Box<Diagnostic>> {
        let mut simulator = Simulator::new(net);
        simulator.reset();
        let mut now = InputRow { dt: 0, ..InputRow::zero(net) };
        let mut events =
            Events { stimulus: Stimulus::new(net), ends: Vec::new(), rows: Vec::new() };
        let has_time = measures_time(net);
        events.event(&mut simulator, now.clone(), 0)?;
        for (at, row) in (1..).zip(stimulus.rows()) {
            let ticks = if has_time { row.dt } else { 0 };
            for _ in 0..ticks {
                events.event(&mut simulator, InputRow { dt: 1, ..now.clone() }, at)?;
            }
            for (input, value) in one_by_one(net, &now, &row).ok_or_else(|| together(at))? {
                now = now.with(input, value);
                events.event(&mut simulator, now.clone(), at)?;
            }
            events.rows.push((row.dt, events.stimulus.len()));
        }
        Ok(events)
    }

    /// Adds the rows of one event.
    fn event(
        &mut self,
        simulator: &mut Simulator<'_>,
        mut row: InputRow,
        at: usize,
    ) -> Result<(), Box<Diagnostic>> {
        for reaction in 0..MOST_REACTIONS {
            let (state, shown) = (simulator.state().clone(), simulator.row().clone());
            let after = simulator.step(&row);
            let is_same = after.outputs == shown.outputs && after.fault == shown.fault;
            if reaction > 0 && is_same && *simulator.state() == state {
                self.ends.push(self.stimulus.len());
                return Ok(());
            }
            if self.stimulus.len() >= MAX_CLOCKS {
                return Err(too_long(at));
            }
            self.stimulus.push(&row);
            row.dt = 0;
        }
        Err(no_rest(at))
    }

    /// The number of events.
    #[must_use]
    pub fn len(&self) -> usize {
        self.ends.len() - 1
    }

    /// True if there are no events.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The rows of an event, counted from 1; 0 is the time before the first one. `None` if there is no such event.
    #[must_use]
    pub fn rows_of(&self, event: usize) -> Option<std::ops::Range<usize>> {
        let from =
            event.checked_sub(1).map_or(0, |before| self.ends.get(before).copied().unwrap_or(0));
        Some(from..*self.ends.get(event)?)
    }

    /// A trace of [`Events::stimulus`] with one row for each row of the original: it shows the rest after the last event of that row.
    #[must_use]
    pub fn by_rows(&self, trace: &Trace) -> Trace {
        let mut all = Trace::new(trace.layout.clone());
        all.rows.extend(trace.rows.first().cloned());
        for (dt, end) in &self.rows {
            let Some(mut row) = trace.rows.get(*end).cloned() else { break };
            for (cell, column) in row.values.iter_mut().zip(&trace.layout.columns) {
                if column.kind == ColumnKind::Dt {
                    *cell = Value::Number(i64::from(*dt));
                }
            }
            all.push(row);
        }
        all
    }
}

/// True if a condition, an output or an action of the net depends on time.
#[must_use]
pub fn measures_time(net: &Net) -> bool {
    net.expressions().any(|expr| expr.leaves().any(Leaf::is_time))
        || net.actions.values().any(|one| one.uses.iter().any(|it| it.qualifier.is_timed()))
}

/// The inputs that differ between two rows, in an order in which no assumption is violated in between.
fn one_by_one(net: &Net, from: &InputRow, to: &InputRow) -> Option<Vec<(InputId, i64)>> {
    let pins = net.inputs.iter().filter(|(_, input)| input.kind == InputKind::Pin);
    let changes: Vec<(InputId, i64)> = pins
        .map(|(id, _)| (id, to.value(id)))
        .filter(|(id, value)| from.value(*id) != *value)
        .collect();
    // Depth first: the changes so far, in order, and the one that was tried last at each place.
    let (mut order, mut tried): (Vec<usize>, BTreeSet<Vec<usize>>) = Default::default();
    let mut next = 0;
    loop {
        if order.len() == changes.len() {
            return Some(order.iter().map(|at| changes[*at]).collect());
        }
        let free = (next..changes.len()).find(|at| {
            if order.contains(at) {
                return false;
            }
            let all = order.iter().chain([at]);
            let row =
                all.clone().fold(from.clone(), |row, at| row.with(changes[*at].0, changes[*at].1));
            let mut set: Vec<usize> = all.copied().collect();
            set.sort_unstable();
            !breaks_assumption(net, &row) && tried.insert(set)
        });
        match free {
            Some(at) => {
                order.push(at);
                next = 0;
            }
            None => next = order.pop()? + 1,
        }
        if tried.len() > MOST_TRIES {
            return None;
        }
    }
}

fn together(row: usize) -> Box<Diagnostic> {
    refused(
        format!(
            "row {row} changes inputs together, but an assumption does not allow that they change one at a time"
        ),
        "free-running parts do not see changes at the same moment: change the inputs in several rows, or weaken the assumption",
    )
}

fn no_rest(row: usize) -> Box<Diagnostic> {
    let after = if row == 0 { "after reset".to_owned() } else { format!("after row {row}") };
    refused(
        format!("the chart is still not at rest {MOST_REACTIONS} reactions {after}"),
        "free-running parts are compared with the chart when it is at rest: a chart that moves without an event cannot be compared",
    )
}

fn too_long(row: usize) -> Box<Diagnostic> {
    refused(
        format!(
            "up to row {row} the stimulus has more than {MAX_CLOCKS} reactions, because ticks and changes of inputs come one at a time"
        ),
        "use fewer rows, or a smaller `dt`",
    )
}

fn refused(message: String, help: &str) -> Box<Diagnostic> {
    Box::new(Diagnostic::error(codes::NO_EVENTS, message).help(help))
}

/// What parts that run on their own have shown since the last event, value by value.
#[derive(Debug, Clone)]
pub struct Sequences {
    start: Vec<i64>,
    taken: Vec<Vec<i64>>,
}

impl Sequences {
    /// At the start, they show this.
    #[must_use]
    pub fn new(net: &Net, row: &Row) -> Self {
        let start = seen(row, net.steps.len());
        Sequences { taken: vec![Vec::new(); start.len()], start }
    }

    /// They show this now.
    pub fn see(&mut self, net: &Net, row: &Row) {
        let objects = self.start.iter().zip(&mut self.taken);
        for ((start, taken), value) in objects.zip(seen(row, net.steps.len())) {
            if *taken.last().unwrap_or(start) != value {
                taken.push(value);
            }
        }
    }

    /// Ends an event: the rows of the net, with the values of the parts. Each value is in the row in which the net takes the value with the same place in its
    /// sequence, and what the parts show beyond that in the last row; so the rows are equal to those of the net if and only if all sequences are. Variables count
    /// only at the end. `before` is the row of the net before the event, `rows` are those of the event, `end` is what the parts show at its end.
    pub fn end(&mut self, net: &Net, before: &Row, rows: &[Row], end: &Row) -> Vec<Row> {
        let n_steps = net.steps.len();
        let mut last = seen(before, n_steps);
        let mut changes = vec![0_usize; last.len()];
        let mut all = Vec::new();
        for (at, row) in (1..).zip(rows) {
            let is_end = at == rows.len();
            let of_net = seen(row, n_steps);
            for ((n, old), new) in changes.iter_mut().zip(&last).zip(&of_net) {
                *n += usize::from(old != new);
            }
            let objects = self.start.iter().zip(&self.taken).zip(&changes);
            let values = objects.map(|((start, taken), n)| {
                let n = if is_end { n + 1 } else { *n }.min(taken.len());
                n.checked_sub(1).and_then(|place| taken.get(place)).unwrap_or(start)
            });
            let values: Vec<i64> = values.copied().collect();
            let vars = if is_end { end.vars.clone() } else { row.vars.clone() };
            all.push(shown(net, row, &values, vars));
            last = of_net;
        }
        for (start, taken) in self.start.iter_mut().zip(&mut self.taken) {
            *start = taken.drain(..).next_back().unwrap_or(*start);
        }
        all
    }
}

/// Outputs, steps and fault of a row of a net with this number of steps, in the order of [`FreeParts::seen`](crate::FreeParts::seen).
#[must_use]
pub fn seen(row: &Row, n_steps: usize) -> Vec<i64> {
    let mut steps = vec![0; n_steps];
    for step in &row.steps {
        if let Some(bit) = steps.get_mut(step.index()) {
            *bit = 1;
        }
    }
    row.outputs.iter().copied().chain(steps).chain([i64::from(row.fault)]).collect()
}

/// A row of the net with other values.
fn shown(net: &Net, of_net: &Row, values: &[i64], vars: Vec<i64>) -> Row {
    let value = |at: usize| values.get(at).copied().unwrap_or(0);
    let n_outputs = net.outputs.len();
    let steps = net.steps.ids().filter(|step| value(n_outputs + step.index()) != 0);
    Row {
        outputs: (0..n_outputs).map(value).collect(),
        steps: steps.collect(),
        vars,
        fault: value(n_outputs + net.steps.len()) != 0,
        ..of_net.clone()
    }
}
