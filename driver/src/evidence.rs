//! The relevant part of a run: the inputs that change or are read, the situation, the fired transitions, and the values that the question is about.
//!
//! This is data: [`Evidence`] is a table of cells, and [`Evidence::excerpt`] combines equal rows and shortens a table that is too long for people. Only the
//! command line converts it to text. The trace of the stimulus has every column of every row.

use crate::judge::CircuitsApart;
use grafsynth_ir::Span;
use grafsynth_ir::Valid;
use grafsynth_ir::expr::{Expr as AnyExpr, ExprKind};
use grafsynth_ir::net::{InputId, InputKind, Leaf, Net, Property, PropertyExpr, PropertyLeaf};
use grafsynth_sim::{ColumnKind, InputRow, Simulator, Stimulus, Trace, TraceLayout};
use std::collections::BTreeSet;

/// The maximum number of rows that an excerpt shows to people.
pub const MOST_ROWS: usize = 20;
/// The number of these rows that are taken from the beginning; the others are the last rows, which show what goes wrong.
const FIRST_ROWS: usize = 4;

/// A run as a table.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Evidence {
    /// The headers; the first is `row`, the number of the row in the trace.
    pub columns: Vec<String>,
    /// One list of cells for each row of the trace; the first is the row's number.
    pub rows: Vec<Vec<String>>,
    /// The term of the property that is violated in the last row.
    pub broken: Option<Broken>,
}

/// The violated term of a property, with its parts.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Broken {
    /// The location of the term; for a disjunction, that of the first operand that is true.
    pub span: Span,
    /// Each part with its value in the last row, in the order of the text.
    pub parts: Vec<Part>,
}

/// A part of a term.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Part {
    /// Its name.
    pub name: String,
    /// Its value: Booleans are 0 and 1, times are in ticks.
    pub value: i64,
    /// It is a time.
    pub is_time: bool,
}

/// Rows that are equal except for their numbers, or a gap.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Piece {
    /// Equal rows: the index of the first in [`Evidence::rows`], and their number.
    Rows(usize, usize),
    /// This number of rows is left out.
    Gap(usize),
}

impl Evidence {
    /// The evidence that the last row of a stimulus violates a property.
    #[must_use]
    pub fn of_assert(net: &Valid<Net>, property: &Property, stimulus: &Stimulus) -> Self {
        let mut terms: Vec<PropertyExpr> = Vec::new();
        leaves(&property.never, &mut terms);
        let mut run = Run::of(net, stimulus, &terms);
        let mut read = BTreeSet::new();
        for leaf in property.never.leaves() {
            if let PropertyLeaf::Net(leaf) = leaf {
                inputs_of(net, *leaf, &mut read);
            }
        }
        run.keep_inputs(net, &read);
        let mut all = run.columns("active", "fired");
        for (at, term) in terms.iter().enumerate() {
            // Inputs and steps are shown already.
            let is_shown = matches!(
                term.kind,
                ExprKind::Leaf(PropertyLeaf::Net(Leaf::Input(_) | Leaf::Active(_)))
            );
            if !is_shown {
                all.push((name_of(net, term), std::mem::take(&mut run.terms[at])));
            }
        }
        Evidence { broken: Some(broken(&run.simulator, net, &property.never)), ..table(all) }
    }

    /// The evidence of a run of a net, with the column of its trace that the run is about, if there is one.
    #[must_use]
    pub fn of_run(net: &Valid<Net>, stimulus: &Stimulus, column: Option<&str>) -> Self {
        let mut run = Run::of(net, stimulus, &[]);
        run.keep_inputs(net, &BTreeSet::new());
        let mut all = run.columns("active", "fired");
        if let Some((name, cells)) = column.and_then(|name| run.column(name)) {
            all.push((name, cells));
        }
        table(all)
    }

    /// The evidence of two runs of one net up to a row: the column contains the difference, and `left` and `right` name the two runs in the headers. The runs
    /// may come from other engines.
    #[must_use]
    pub fn of_traces(
        net: &Valid<Net>,
        stimulus: &Stimulus,
        column: &str,
        (left, ours): (&str, &Trace),
        (right, theirs): (&str, &Trace),
    ) -> Self {
        let mut run = Run::of(net, stimulus, &[]);
        run.keep_inputs(net, &BTreeSet::new());
        let mut all = run.columns("active", "fired");
        for (title, trace) in [(left, ours), (right, theirs)] {
            all.push((format!("{column} ({title})"), cells(trace, column)));
        }
        table(all)
    }

    /// The evidence of two nets, each under its own stimulus, with the column in which they differ.
    #[must_use]
    pub fn of_pair(
        (left, ours, first): (&Valid<Net>, &Stimulus, &str),
        (right, theirs, second): (&Valid<Net>, &Stimulus, &str),
        column: &str,
    ) -> Self {
        let (mut a, mut b) = (Run::of(left, ours, &[]), Run::of(right, theirs, &[]));
        a.keep_inputs(left, &BTreeSet::new());
        b.keep_inputs(right, &BTreeSet::new());
        b.inputs.retain(|(name, _)| !a.inputs.iter().any(|(other, _)| other == name));
        a.inputs.append(&mut b.inputs);
        // A column that is equal in both is shown once.
        let mut all = if a.active == b.active && a.fired == b.fired {
            a.columns("active", "fired")
        } else {
            let mut all = a.columns(&format!("active ({first})"), &format!("fired ({first})"));
            all.push((format!("active ({second})"), b.active.clone()));
            all.push((format!("fired ({second})"), b.fired.clone()));
            all
        };
        if column != "steps" {
            for (run, title) in [(&mut a, first), (&mut b, second)] {
                let cells = run.column(column).map(|(_, cells)| cells).unwrap_or_default();
                all.push((format!("{column} ({title})"), cells));
            }
        }
        table(all)
    }

    /// The evidence that two circuits differ: the inputs at each clock up to the difference.
    #[must_use]
    pub fn of_circuits(apart: &CircuitsApart) -> Self {
        let numbers = (0..apart.rows.len()).map(|at| (at + 1).to_string()).collect();
        let mut all = vec![("clock".to_owned(), numbers)];
        for (at, name) in apart.inputs.iter().enumerate() {
            let bit = |row: &Vec<bool>| u8::from(row.get(at) == Some(&true)).to_string();
            all.push((name.clone(), apart.rows.iter().map(bit).collect()));
        }
        table(all)
    }

    /// Combines consecutive equal rows, and keeps at most `most` lines: the first and the last, with a gap between them.
    #[must_use]
    pub fn excerpt(&self, most: usize) -> Vec<Piece> {
        let mut folded: Vec<(usize, usize)> = Vec::new();
        for at in 0..self.rows.len() {
            match folded.last_mut() {
                Some((first, times))
                    if self.rows[*first].iter().skip(1).eq(self.rows[at].iter().skip(1)) =>
                {
                    *times += 1;
                }
                Some(_) | None => folded.push((at, 1)),
            }
        }
        let rows = |part: &[(usize, usize)]| -> Vec<Piece> {
            part.iter().map(|(first, times)| Piece::Rows(*first, *times)).collect()
        };
        if folded.len() <= most {
            return rows(&folded);
        }
        let first = FIRST_ROWS.min(most / 2);
        let last = folded.len() - (most - first);
        let left_out = folded[first..last].iter().map(|(_, times)| times).sum();
        let mut pieces = rows(&folded[..first]);
        pieces.push(Piece::Gap(left_out));
        pieces.extend(rows(&folded[last..]));
        pieces
    }
}

/// A column: its header and its cells.
type Cells = (String, Vec<String>);

/// The table of these columns; one that is empty in every row is left out.
fn table(mut all: Vec<Cells>) -> Evidence {
    all.retain(|(_, cells)| cells.iter().any(|cell| !cell.is_empty()));
    let n_rows = all.first().map_or(0, |(_, cells)| cells.len());
    let rows = (0..n_rows)
        .map(|row| {
            all.iter().map(|(_, cells)| cells.get(row).cloned().unwrap_or_default()).collect()
        })
        .collect();
    Evidence { columns: all.into_iter().map(|(name, _)| name).collect(), rows, broken: None }
}

/// A run of the reference simulator, column by column.
struct Run<'n> {
    simulator: Simulator<'n>,
    dts: Vec<String>,
    /// The inputs, in the order of declaration.
    inputs: Vec<Cells>,
    ids: Vec<InputId>,
    active: Vec<String>,
    fired: Vec<String>,
    /// For each term, its value in each row.
    terms: Vec<Vec<String>>,
    trace: Trace,
    /// Inputs that a fired transition reads.
    read: BTreeSet<InputId>,
}

impl<'n> Run<'n> {
    fn of(net: &'n Valid<Net>, stimulus: &Stimulus, terms: &[PropertyExpr]) -> Self {
        let given = net.inputs.iter().filter(|(_, it)| it.kind != InputKind::InternalEvent);
        let ids: Vec<InputId> = given.map(|(id, _)| id).collect();
        let inputs = ids.iter().map(|id| (net.inputs[*id].name.text.clone(), Vec::new())).collect();
        let mut run = Run {
            simulator: Simulator::new(net),
            dts: Vec::new(),
            inputs,
            ids,
            active: Vec::new(),
            fired: Vec::new(),
            terms: vec![Vec::new(); terms.len()],
            trace: Trace::new(TraceLayout::of(net)),
            read: BTreeSet::new(),
        };
        run.note(net, &InputRow { dt: 0, ..InputRow::zero(net) }, terms);
        for row in stimulus.rows() {
            run.simulator.step(&row);
            run.note(net, &row, terms);
        }
        run
    }

    /// Records the last reaction.
    fn note(&mut self, net: &Net, input: &InputRow, terms: &[PropertyExpr]) {
        self.dts.push(input.dt.to_string());
        for (id, (_, cells)) in self.ids.iter().zip(&mut self.inputs) {
            cells.push(input.value(*id).to_string());
        }
        let layout = &self.trace.layout;
        let row = layout.row(self.simulator.row());
        let steps = layout.columns.iter().position(|column| column.kind == ColumnKind::Steps);
        self.active.push(steps.map_or_else(String::new, |at| layout.text(&row.values[at])));
        let fired: Vec<&str> = match self.dts.len() {
            // The reset row has no fired transitions.
            1 => Vec::new(),
            _ => self.simulator.fired().iter().map(|id| &*net.transitions[*id].name.text).collect(),
        };
        if self.dts.len() > 1 {
            for id in self.simulator.fired() {
                let transition = &net.transitions[*id];
                self.read.extend(&transition.events);
                for leaf in transition.guard.leaves() {
                    inputs_of(net, *leaf, &mut self.read);
                }
            }
        }
        self.fired.push(fired.join(" "));
        for (term, cells) in terms.iter().zip(&mut self.terms) {
            cells.push(self.simulator.value(term).to_string());
        }
        self.trace.push(row);
    }

    /// Leaves out inputs that neither change nor are read by a fired transition or by the question.
    fn keep_inputs(&mut self, net: &Net, also: &BTreeSet<InputId>) {
        let zero = InputRow::zero(net);
        let mut ids = self.ids.iter();
        let read = &self.read;
        self.inputs.retain(|(_, cells)| {
            let Some(id) = ids.next() else { return false };
            let rest = zero.value(*id).to_string();
            cells.iter().any(|cell| *cell != rest) || also.contains(id) || read.contains(id)
        });
        self.ids.clear();
    }

    /// The columns of a run: row number, `dt` if it is not 1 in every row, inputs, situation and fired transitions.
    fn columns(&self, active: &str, fired: &str) -> Vec<Cells> {
        let numbers = (0..self.dts.len()).map(|row| row.to_string()).collect();
        let mut all = vec![("row".to_owned(), numbers)];
        if self.dts.iter().skip(1).any(|dt| dt != "1") {
            all.push(("dt".to_owned(), self.dts.clone()));
        }
        all.extend(self.inputs.iter().cloned());
        all.push((active.to_owned(), self.active.clone()));
        all.push((fired.to_owned(), self.fired.clone()));
        all
    }

    /// A column of the trace, unless another column already shows it.
    fn column(&self, name: &str) -> Option<Cells> {
        let is_there = self.trace.layout.columns.iter().any(|column| {
            column.name == name
                && matches!(
                    column.kind,
                    ColumnKind::Output(_)
                        | ColumnKind::Calls(_)
                        | ColumnKind::Var(_)
                        | ColumnKind::Element(..)
                        | ColumnKind::Fault
                )
        });
        is_there.then(|| (name.to_owned(), cells(&self.trace, name)))
    }
}

/// The cells of a column of a trace; empty if there is no such column.
fn cells(trace: &Trace, name: &str) -> Vec<String> {
    let place = trace.layout.columns.iter().position(|column| column.name == name);
    let cell = |at: usize| trace.rows.iter().map(move |row| trace.layout.text(&row.values[at]));
    place.map(|at| cell(at).collect()).unwrap_or_default()
}

/// Collects the inputs that a leaf reads, also through edges and timers.
fn inputs_of(net: &Net, leaf: Leaf, all: &mut BTreeSet<InputId>) {
    let mut below = |expr: &grafsynth_ir::net::Expr| {
        for leaf in expr.leaves() {
            if let Leaf::Input(input) = leaf {
                all.insert(*input);
            }
        }
    };
    match leaf {
        Leaf::Input(input) => {
            all.insert(input);
        }
        Leaf::Rise(edge) | Leaf::Fall(edge) => below(&net.edges[edge].expr),
        Leaf::Timer(timer) => below(&net.timers[timer].condition),
        _ => {}
    }
}

/// Collects the leaves and elements of an expression, each once, in the order of the text.
fn leaves(expr: &PropertyExpr, all: &mut Vec<PropertyExpr>) {
    if matches!(expr.kind, ExprKind::Leaf(_) | ExprKind::Element(..)) {
        if !all.iter().any(|known| known.kind == expr.kind) {
            all.push(expr.clone());
        }
        return;
    }
    expr.children().for_each(|operand| leaves(operand, all));
}

/// The part of a true condition that makes it true: in a disjunction, the first operand that is true.
fn reason<'e>(simulator: &Simulator<'_>, expr: &'e PropertyExpr) -> &'e PropertyExpr {
    match &expr.kind {
        ExprKind::Or(all) => all
            .iter()
            .find(|one| simulator.value(one) != 0)
            .map_or(expr, |one| reason(simulator, one)),
        _ => expr,
    }
}

fn broken(simulator: &Simulator<'_>, net: &Net, never: &PropertyExpr) -> Broken {
    let term = reason(simulator, never);
    let mut all = Vec::new();
    for factor in term.factors() {
        leaves(reason(simulator, factor), &mut all);
    }
    let part = |expr: &PropertyExpr| Part {
        name: name_of(net, expr),
        value: simulator.value(expr),
        is_time: matches!(&expr.kind, ExprKind::Leaf(PropertyLeaf::Net(leaf)) if leaf.is_time()),
    };
    Broken { span: term.span, parts: all.iter().map(part).collect() }
}

/// A leaf as the author of a chart writes it.
fn name_of(net: &Net, expr: &PropertyExpr) -> String {
    if let ExprKind::Leaf(leaf) = &expr.kind {
        return leaf_name(net, leaf);
    }
    let ExprKind::Element(leaf, index) = &expr.kind else { return String::new() };
    let name = leaf_name(net, leaf);
    if let ExprKind::Int(number) = &index.kind {
        format!("{name}[{number}]")
    } else {
        format!("{name}[..]")
    }
}

fn leaf_name(net: &Net, leaf: &PropertyLeaf) -> String {
    let edge = |word: &str, edge: &grafsynth_ir::net::EdgeId| {
        format!("{word}({})", grafsynth_ir::text::print_expr(net, &net.edges[*edge].expr))
    };
    match leaf {
        PropertyLeaf::Output(output) => net.outputs[*output].name.text.clone(),
        PropertyLeaf::Net(Leaf::Rise(id)) => edge("rise", id),
        PropertyLeaf::Net(Leaf::Fall(id)) => edge("fall", id),
        PropertyLeaf::Net(leaf) => {
            grafsynth_ir::text::print_expr(net, &AnyExpr::leaf(*leaf, Span::default()))
        }
    }
}
