//! Searches for the worst-case reaction: random and directed runs, then small changes of the rows that led to the worst ones.

use super::{Measured, Prepared};
use crate::EngineError;
use grafsynth_ir::Valid;
use grafsynth_ir::expr::Type;
use grafsynth_ir::net::Net;
use grafsynth_sim::{Directed, InputRow, MAX_DT, Start, Stimulus, breaks_assumption};

/// The effort of the search.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Effort {
    /// Rows of each random run.
    pub rows: usize,
    /// The number of reactions that are directed at transitions that have not fired.
    pub directed: usize,
    /// The number of runs that change a row of one of the worst runs.
    pub changes: usize,
}

impl Default for Effort {
    fn default() -> Self {
        Effort { rows: 1000, directed: 2000, changes: 300 }
    }
}

/// The worst reaction found.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Dearest {
    /// The results over all reactions.
    pub measured: Measured,
    /// The rows from reset to the worst reaction, which is the last.
    pub rows: Vec<InputRow>,
}

/// The number of runs that are kept for changes.
const CHANGED: usize = 4;

/// Searches for the worst reaction on a machine that can separate reactions; on another machine, the runs are measured but not
/// changed.
///
/// # Errors
/// The output of the simulator.
pub fn dearest(
    prepared: &dyn Prepared,
    net: &Valid<Net>,
    effort: Effort,
) -> Result<Dearest, EngineError> {
    let mut all = Measured::default();
    let mut best: Vec<(u64, Vec<InputRow>)> = Vec::new();
    for (seed, max_dt) in [(1, 3), (2, 1), (3, 1000)] {
        let stimulus = Stimulus::random(net, effort.rows, seed, max_dt);
        try_rows(prepared, net, stimulus.rows().collect(), &mut all, &mut best)?;
    }
    for rows in directed(net, effort.directed) {
        try_rows(prepared, net, rows, &mut all, &mut best)?;
    }
    let mut left = effort.changes;
    let mut at = 0;
    while let Some((time, rows)) = best.get(at).cloned() {
        let mut is_better = false;
        // The last row, then the one before it.
        'rows: for back in 1..=2_usize.min(rows.len()) {
            for row in changed(net, &rows[rows.len() - back]) {
                if left == 0 {
                    break 'rows;
                }
                let mut other = rows.clone();
                let place = other.len() - back;
                other[place] = row;
                left -= 1;
                let found = try_rows(prepared, net, other, &mut all, &mut best)?;
                if found > time {
                    is_better = true;
                    break 'rows;
                }
            }
        }
        if left == 0 {
            break;
        }
        at = if is_better { 0 } else { at + 1 };
    }
    Ok(Dearest { measured: all, rows: best.into_iter().next().map(|it| it.1).unwrap_or_default() })
}

/// Runs these rows; returns the time of the worst reaction, and keeps the run if it is among the worst.
fn try_rows(
    prepared: &dyn Prepared,
    net: &Net,
    mut rows: Vec<InputRow>,
    all: &mut Measured,
    best: &mut Vec<(u64, Vec<InputRow>)>,
) -> Result<u64, EngineError> {
    let (measured, times) = prepared.run(net, &Stimulus::of_rows(net, &rows))?;
    *all = Measured {
        init: all.init.max(measured.init),
        step: all.step.max(measured.step),
        stack: all.stack.max(measured.stack),
        reactions: all.reactions + measured.reactions,
        text: measured.text,
    };
    // The first of the worst reactions: it has the shortest path.
    let dearest = times.iter().copied().max().unwrap_or(0);
    let place = times.iter().position(|time| *time == dearest);
    let Some(place) = place.filter(|_| times.len() == rows.len()) else { return Ok(dearest) };
    rows.truncate(place + 1);
    let after = best.partition_point(|(time, kept)| {
        (*time, kept.len()) > (dearest, usize::MAX - kept.len()) || *time > dearest
    });
    if after < CHANGED
        && !best.iter().any(|(time, kept)| *time == dearest && kept.len() <= rows.len())
    {
        best.insert(after, (dearest, rows));
        best.truncate(CHANGED);
    }
    Ok(dearest)
}

/// The runs of a directed search, each from reset.
fn directed(net: &Valid<Net>, reactions: usize) -> Vec<Vec<InputRow>> {
    let mut directed = Directed::new(net, 1, MAX_DT);
    let mut runs = Vec::new();
    let mut last: Vec<InputRow> = Vec::new();
    for _ in 0..reactions {
        let Some(found) = directed.next() else { break };
        if found.from != Start::Here && !last.is_empty() {
            runs.push(std::mem::take(&mut last));
        }
        last = directed.path();
    }
    runs.push(last);
    runs.retain(|rows| !rows.is_empty());
    runs
}

/// A row with one change, in all ways that satisfy the chart's assumptions.
fn changed(net: &Net, row: &InputRow) -> Vec<InputRow> {
    let mut all = Vec::new();
    let mut add = |row: InputRow| {
        if !breaks_assumption(net, &row) {
            all.push(row);
        }
    };
    for dt in [0, 1, 1000, MAX_DT] {
        if dt != row.dt {
            add(InputRow { dt, ..row.clone() });
        }
    }
    for (id, input) in net.inputs.iter().filter(|(_, it)| it.kind.is_handed()) {
        let values = match input.ty {
            Type::Bool => vec![0, 1],
            Type::Int { lo, hi } => vec![lo, lo.midpoint(hi), hi],
        };
        for value in values.into_iter().filter(|value| *value != row.value(id)) {
            let other = row.clone().with(id, value);
            let is_alone = !net.settings.events_exclusive || !input.kind.is_event();
            // Replaces another event if events are exclusive.
            let others = net
                .inputs
                .iter()
                .filter(|(it, other)| *it != id && other.kind.is_event() && !is_alone);
            add(others.fold(other, |row, (it, _)| row.with(it, 0)));
        }
    }
    all
}
