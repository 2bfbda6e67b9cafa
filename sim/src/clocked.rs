//! A stimulus as a chip runs it: one clock for each tick (semantics §9).

use grafsynth_ir::Diagnostic;
use grafsynth_ir::net::{Driver, Net};

use crate::codes;
use crate::row::InputRow;
use crate::stimulus::Stimulus;
use crate::trace::{ColumnKind, Trace, TraceRow, Value};

/// The maximum number of clocks for the rows of a stimulus on a chip.
pub const MAX_CLOCKS: usize = 1_000_000;

/// A stimulus in which no row has more than one tick, and the rows that it was made from. A row with `dt` k becomes k rows of one tick with the same
/// inputs; its events occur in the first of them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Clocked {
    /// One row for each clock.
    pub stimulus: Stimulus,
    /// For each original row, its `dt` and the index of its last clock, counted from 1 as in traces.
    rows: Vec<(u32, usize)>,
}

/// The original row to which a clock of a [`Clocked`] stimulus belongs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ClockPlace {
    /// The row of the original trace; 0 is the reset.
    pub row: usize,
    /// The index of the clock within the row, from 1.
    pub clock: usize,
    /// The number of clocks of that row.
    pub clocks: usize,
}

impl Clocked {
    /// Writes each row with a long `dt` as rows of one tick.
    ///
    /// # Errors
    /// The rows take more than [`MAX_CLOCKS`] clocks.
    pub fn of(net: &Net, stimulus: &Stimulus) -> Result<Self, Box<Diagnostic>> {
        let mut clocked = Clocked { stimulus: Stimulus::new(net), rows: Vec::new() };
        for row in stimulus.rows() {
            let clocks = row.dt.max(1) as usize;
            if clocked.stimulus.len() + clocks > MAX_CLOCKS {
                return Err(too_long(clocked.rows.len() + 1, &row));
            }
            let first = InputRow { dt: row.dt.min(1), values: row.values };
            clocked.stimulus.push(&first);
            let mut held = first;
            for (id, input) in net.inputs.iter().filter(|(_, input)| input.kind.is_event()) {
                held = held.with(id, input.ty.saturate(0));
            }
            (1..clocks).for_each(|_| clocked.stimulus.push(&held));
            clocked.rows.push((row.dt, clocked.stimulus.len()));
        }
        Ok(clocked)
    }

    /// The original row to which a row of the trace of [`Clocked::stimulus`] belongs.
    #[must_use]
    pub fn place(&self, clock: usize) -> ClockPlace {
        let row = self.rows.partition_point(|(_, end)| *end < clock);
        let before = row.checked_sub(1).map_or(0, |row| self.rows[row].1);
        match self.rows.get(row) {
            Some((_, end)) if clock > 0 => {
                ClockPlace { row: row + 1, clock: clock - before, clocks: end - before }
            }
            Some(_) | None => ClockPlace { row: 0, clock: 1, clocks: 1 },
        }
    }

    /// The trace of [`Clocked::stimulus`] with one row for each row of the original. It shows the values after the last clock, the calls of all its clocks,
    /// and a fault in any of them. A row is missing if the trace ends before its last clock.
    #[must_use]
    pub fn by_rows(&self, net: &Net, trace: &Trace) -> Trace {
        let mut all = Trace::new(trace.layout.clone());
        all.rows.extend(trace.rows.first().cloned());
        let mut from = 1;
        for (dt, end) in &self.rows {
            let Some(clocks) = trace.rows.get(from..=*end) else { break };
            from = end + 1;
            if let [one] = clocks {
                all.push(one.clone());
                continue;
            }
            let Some(last) = clocks.last() else { break };
            let mut row = last.clone();
            for (at, column) in trace.layout.columns.iter().enumerate() {
                match column.kind {
                    ColumnKind::Dt => row.values[at] = Value::Number(i64::from(*dt)),
                    ColumnKind::Input(_) => row.values[at].clone_from(&clocks[0].values[at]),
                    ColumnKind::Calls(_) => gather(&mut row, clocks, at),
                    ColumnKind::Output(id)
                        if matches!(net.outputs[id].driver, Driver::Extern { .. }) =>
                    {
                        gather(&mut row, clocks, at);
                    }
                    ColumnKind::Fault => gather(&mut row, clocks, at),
                    ColumnKind::Scan
                    | ColumnKind::Steps
                    | ColumnKind::Output(_)
                    | ColumnKind::Var(_)
                    | ColumnKind::Element(..) => {}
                }
                if column.kind == ColumnKind::Fault && row.values[at] != Value::Number(0) {
                    row.values[at] = Value::Number(1);
                }
            }
            all.push(row);
        }
        all
    }
}

/// Combines a cell over all clocks of a row: numbers are added, lists are joined. The cell is open if it is open in one of the clocks.
fn gather(row: &mut TraceRow, clocks: &[TraceRow], at: usize) {
    let mut number = 0_i64;
    let mut calls = Vec::new();
    let mut is_open = false;
    for clock in clocks {
        is_open |= clock.open.get(at).copied().unwrap_or(false);
        match &clock.values[at] {
            Value::Number(one) => number = number.saturating_add(*one),
            Value::Calls(all) => calls.extend(all.iter().cloned()),
            Value::Steps(_) => {}
        }
    }
    match &mut row.values[at] {
        Value::Number(cell) => *cell = number,
        Value::Calls(cell) => *cell = calls,
        Value::Steps(_) => {}
    }
    if is_open {
        row.open.resize(row.values.len(), false);
        row.open[at] = true;
    }
}

fn too_long(row: usize, input: &InputRow) -> Box<Diagnostic> {
    let error = Diagnostic::error(
        codes::DT_ON_CHIP,
        format!(
            "with row {row} (dt {}) the stimulus needs more than {MAX_CLOCKS} clocks on a chip, one for each tick",
            input.dt
        ),
    );
    Box::new(error.help("use a smaller `dt`, or run the stimulus on an engine that runs each row as one reaction (`ir`, `c`)"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ClockPlace, run};
    use grafsynth_ir::{FileId, Valid, text, validate};

    fn net() -> Valid<Net> {
        let source = "net demo\npart demo level 1\ninput go bool\ninput beep bool event\noutput count bool extern\n\
                      step a in demo initial\nstep b in demo\n\
                      transition t1 in demo a -> b when beep\n    do { call count() }\n\
                      transition t2 in demo b -> a when go\n    do { call count() }\n";
        let (net, found) = text::parse(FileId(0), source);
        assert!(found.is_empty(), "{found:#?}");
        validate(net.unwrap()).unwrap_or_else(|found| panic!("{found:#?}"))
    }

    #[test]
    fn inputs_hold_and_events_occur_once() {
        let net = net();
        let (stimulus, _) = Stimulus::parse_csv(&net, FileId(0), "dt,go,beep\n0,0,1\n3,1,1\n");
        let stimulus = stimulus.unwrap();
        let clocked = Clocked::of(&net, &stimulus).unwrap();
        assert_eq!(clocked.stimulus.to_csv(&net), "dt,go,beep\n0,0,1\n1,1,1\n1,1,0\n1,1,0\n");
        assert_eq!(clocked.place(0), ClockPlace { row: 0, clock: 1, clocks: 1 });
        assert_eq!(clocked.place(1), ClockPlace { row: 1, clock: 1, clocks: 1 });
        assert_eq!(clocked.place(3), ClockPlace { row: 2, clock: 2, clocks: 3 });
    }

    #[test]
    fn a_row_shows_the_end_and_counts_all_calls() {
        let net = net();
        let (stimulus, _) = Stimulus::parse_csv(&net, FileId(0), "dt,go,beep\n2,1,1\n2,1,1\n");
        let clocked = Clocked::of(&net, &stimulus.unwrap()).unwrap();
        let trace = clocked.by_rows(&net, &run(&net, &clocked.stimulus));
        let cells = "scan,dt,go,beep,steps,count\n0,0,0,0,a,0\n1,2,1,1,a,2\n2,2,1,1,a,2\n";
        assert_eq!(trace.to_csv(), cells);
    }

    #[test]
    fn there_is_a_limit() {
        let net = net();
        let (stimulus, _) = Stimulus::parse_csv(&net, FileId(0), "dt\n999999\n1\n1\n");
        let found = Clocked::of(&net, &stimulus.unwrap()).unwrap_err();
        assert!(found.message.contains("row 3 (dt 1)"), "{}", found.message);
    }
}
