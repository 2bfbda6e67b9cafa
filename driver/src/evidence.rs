//! The relevant part of a run: the inputs that change or are read, the situation, the fired transitions, and the values of the property or column in question.
//!
//! This is data: [`Evidence`] is a table of cells, and [`Evidence::excerpt`] combines equal rows and shortens a table that is too long for people. Only the
//! command line converts it to text. The trace of the stimulus has every column of every row.

use crate::judge::CircuitsApart;
use grafsynth_ir::Span;
use grafsynth_ir::Valid;
use grafsynth_ir::expr::{Expr as AnyExpr, ExprKind};
use grafsynth_ir::net::{
    Driver, Expr, InputId, InputKind, Leaf, Net, Property, PropertyExpr, PropertyLeaf, Transition,
};
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
    /// One list of cells for each row of the trace; the first cell is the row's number.
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

/// A name or array element in a term.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Part {
    /// Its name.
    pub name: String,
    /// Its value: Booleans are 0 and 1, times are in ticks.
    pub value: i64,
    /// True if it is a time.
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
    /// The evidence that a property is violated in the last row of a stimulus.
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
        let mut all = run.columns();
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
        let Some(column) = column else {
            let mut run = Run::of(net, stimulus, &[]);
            run.keep_inputs(net, &BTreeSet::new());
            return table(run.columns());
        };
        let mut run = Run::to_a_difference(net, stimulus, column);
        let mut all = run.columns();
        all.append(&mut run.named_terms);
        if let Some((place, _)) = place(&run.trace, &run.trace, column, stimulus.len())
            && !is_shown(&run.trace, place)
        {
            all.push((column.to_owned(), cells(&run.trace, place)));
        }
        table(all)
    }

    /// The evidence of two runs of one net, which may come from other engines, up to the last row of the stimulus: `column` contains the difference, and `left`
    /// and `right` name the runs in the headers.
    #[must_use]
    pub fn of_traces(
        net: &Valid<Net>,
        stimulus: &Stimulus,
        column: &str,
        (left, ours): (&str, &Trace),
        (right, theirs): (&str, &Trace),
    ) -> Self {
        let mut run = Run::to_a_difference(net, stimulus, column);
        let mut all = run.given();
        let mut values = std::mem::take(&mut run.named_terms);
        let mut active = vec![("active".to_owned(), std::mem::take(&mut run.active))];
        if let Some((a, b)) = place(ours, theirs, column, stimulus.len()) {
            let is_situation = ours.layout.columns[a].kind == ColumnKind::Steps;
            let name = if is_situation { "active" } else { column };
            let sides = [(left, cells(ours, a)), (right, cells(theirs, b))];
            let sides = sides.map(|(title, cells)| (format!("{name} ({title})"), cells));
            if is_situation {
                active = sides.into();
            } else {
                values.extend(sides);
            }
        }
        all.append(&mut active);
        all.push(("fired".to_owned(), run.fired));
        all.append(&mut values);
        table(all)
    }

    /// The evidence of two nets, each under its own stimulus, with the column in which they differ.
    #[must_use]
    pub fn of_pair(
        (left, ours, first): (&Valid<Net>, &Stimulus, &str),
        (right, theirs, second): (&Valid<Net>, &Stimulus, &str),
        column: &str,
    ) -> Self {
        let mut a = Run::to_a_difference(left, ours, column);
        let mut b = Run::to_a_difference(right, theirs, column);
        b.inputs.retain(|(name, _)| !a.inputs.iter().any(|(other, _)| other == name));
        a.inputs.append(&mut b.inputs);
        let mut all = a.given();
        // A column that is equal in both is shown once.
        let mut both = |name: &str, sides: [Option<Vec<String>>; 2]| match sides {
            [Some(ours), Some(theirs)] if ours == theirs => all.push((name.to_owned(), ours)),
            sides => {
                let sides = [first, second].into_iter().zip(sides);
                all.extend(
                    sides.filter_map(|(title, it)| Some((format!("{name} ({title})"), it?))),
                );
            }
        };
        both("active", [&mut a.active, &mut b.active].map(std::mem::take).map(Some));
        both("fired", [&mut a.fired, &mut b.fired].map(std::mem::take).map(Some));
        for (name, ours) in std::mem::take(&mut a.named_terms) {
            let twin = b.named_terms.iter().position(|(other, _)| *other == name);
            both(&name, [Some(ours), twin.map(|at| b.named_terms.remove(at).1)]);
        }
        for (name, theirs) in std::mem::take(&mut b.named_terms) {
            both(&name, [None, Some(theirs)]);
        }
        if let Some((ours, theirs)) = place(&a.trace, &b.trace, column, ours.len())
            && !is_shown(&a.trace, ours)
        {
            both(column, [cells(&a.trace, ours), cells(&b.trace, theirs)].map(Some));
        }
        table(all)
    }

    /// The evidence that two circuits differ: the inputs and the output at each clock, before its edge, up to the difference.
    #[must_use]
    pub fn of_circuits(apart: &CircuitsApart, first: &str, second: &str) -> Self {
        let bit = |value: bool| u8::from(value).to_string();
        let numbers = (0..apart.rows.len()).map(|at| (at + 1).to_string()).collect();
        let mut all = vec![("clock".to_owned(), numbers)];
        for (at, name) in apart.inputs.iter().enumerate() {
            let is_high = |row: &Vec<bool>| row.get(at) == Some(&true);
            if apart.rows.iter().any(is_high) {
                all.push((name.clone(), apart.rows.iter().map(|row| bit(is_high(row))).collect()));
            }
        }
        let ours: Vec<String> = apart.outputs.iter().copied().map(bit).collect();
        let mut theirs = ours.clone();
        if let Some(last) = theirs.last_mut() {
            *last = bit(!apart.left);
        }
        all.push((format!("{} ({first})", apart.output), ours));
        all.push((format!("{} ({second})", apart.output), theirs));
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

/// A column of the table: its header and its cells.
type Cells = (String, Vec<String>);

/// The table of these columns, without those that are empty in every row.
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
    /// Terms with their names: the variables that may explain a difference.
    named_terms: Vec<Cells>,
}

impl<'n> Run<'n> {
    /// A run whose last row shows a difference in a column, with the inputs and variables that may explain it: those in the receptivities of the transitions that
    /// were enabled before the last row, and in the conditions of the column's output.
    fn to_a_difference(net: &'n Valid<Net>, stimulus: &Stimulus, column: &str) -> Self {
        let (mut inputs, mut terms) = (BTreeSet::new(), Vec::new());
        for condition in deciding(net, stimulus, column, &mut inputs) {
            condition.leaves().for_each(|leaf| inputs_of(net, *leaf, &mut inputs));
            leaves(&condition.map_leaves(&|leaf| PropertyLeaf::Net(*leaf)), &mut terms);
        }
        // Times are left out: they change in each row, so that no rows would be equal any more.
        let is_var = |term: &PropertyExpr| {
            matches!(
                &term.kind,
                ExprKind::Leaf(PropertyLeaf::Net(Leaf::Var(_)))
                    | ExprKind::Element(PropertyLeaf::Net(Leaf::Var(_)), _)
            )
        };
        terms.retain(|term| is_var(term) && name_of(net, term) != column);
        let mut run = Run::of(net, stimulus, &terms);
        run.keep_inputs(net, &inputs);
        let names = terms.iter().map(|term| name_of(net, term));
        run.named_terms = names.zip(std::mem::take(&mut run.terms)).collect();
        run
    }

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
            named_terms: Vec::new(),
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
                read_by(net, &net.transitions[*id], &mut self.read);
            }
        }
        self.fired.push(fired.join(" "));
        for (term, cells) in terms.iter().zip(&mut self.terms) {
            cells.push(self.simulator.value(term).to_string());
        }
        self.trace.push(row);
    }

    /// Leaves out inputs that are never set, are not in `also`, and are not read by a fired transition.
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

    /// The columns of a run: those of [`Run::given`], the situation and the fired transitions.
    fn columns(&self) -> Vec<Cells> {
        let mut all = self.given();
        all.push(("active".to_owned(), self.active.clone()));
        all.push(("fired".to_owned(), self.fired.clone()));
        all
    }

    /// The row number, `dt` if it is not 1 in every row, and the inputs.
    fn given(&self) -> Vec<Cells> {
        let numbers = (0..self.dts.len()).map(|row| row.to_string()).collect();
        let mut all = vec![("row".to_owned(), numbers)];
        if self.dts.iter().skip(1).any(|dt| dt != "1") {
            all.push(("dt".to_owned(), self.dts.clone()));
        }
        all.extend(self.inputs.iter().cloned());
        all
    }
}

/// True if another column of the evidence shows this column of the trace.
fn is_shown(trace: &Trace, place: usize) -> bool {
    match trace.layout.columns[place].kind {
        ColumnKind::Scan | ColumnKind::Dt | ColumnKind::Input(_) | ColumnKind::Steps => true,
        ColumnKind::Output(_)
        | ColumnKind::Calls(_)
        | ColumnKind::Var(_)
        | ColumnKind::Element(..)
        | ColumnKind::Fault => false,
    }
}

/// The index of a column in each of two traces; `None` if there is no such column, and for the row number. If several columns have this name (an output may be
/// called `steps`), the result is the one that differs in this row.
fn place(ours: &Trace, theirs: &Trace, name: &str, row: usize) -> Option<(usize, usize)> {
    let places = |trace: &Trace| -> Vec<usize> {
        let columns = trace.layout.columns.iter().enumerate();
        let named =
            columns.filter(|(_, column)| column.name == name && column.kind != ColumnKind::Scan);
        named.map(|(at, _)| at).collect()
    };
    let text = |trace: &Trace, at: usize| {
        let value = trace.rows.get(row).and_then(|row| row.values.get(at));
        value.map(|value| trace.layout.text(value))
    };
    let pairs: Vec<(usize, usize)> = places(ours).into_iter().zip(places(theirs)).collect();
    let differs = |(a, b): &&(usize, usize)| text(ours, *a) != text(theirs, *b);
    pairs.iter().find(differs).or(pairs.first()).copied()
}

/// The cells of a column of a trace.
fn cells(trace: &Trace, place: usize) -> Vec<String> {
    trace.rows.iter().map(|row| trace.layout.text(&row.values[place])).collect()
}

/// The conditions that decide the last row of a run: the receptivities of the transitions that were enabled before it, and the conditions of the output with the
/// name of a column. Events of these transitions are added to `events`.
fn deciding<'n>(
    net: &'n Valid<Net>,
    stimulus: &Stimulus,
    column: &str,
    events: &mut BTreeSet<InputId>,
) -> Vec<&'n Expr> {
    let mut simulator = Simulator::new(net);
    for row in stimulus.rows().take(stimulus.len().saturating_sub(1)) {
        simulator.step(&row);
    }
    // No transition decides the row of the reset.
    let is_enabled = |it: &&Transition| {
        !stimulus.is_empty() && it.requires.iter().all(|step| simulator.is_active(*step))
    };
    let enabled: Vec<&Transition> = net.transitions.values().filter(is_enabled).collect();
    events.extend(enabled.iter().flat_map(|transition| &transition.events));
    let mut all: Vec<&Expr> = enabled.iter().map(|transition| &transition.guard).collect();
    let output = net.outputs.values().find(|output| output.name.text == column);
    match output.map(|output| &output.driver) {
        Some(Driver::Continuous(emissions) | Driver::Mealy(emissions)) => {
            all.extend(emissions.iter().filter_map(|emission| emission.condition.as_ref()));
            all.extend(net.emergency.iter().map(|emergency| &emergency.condition));
        }
        Some(
            Driver::Fires(_) | Driver::Stored(_) | Driver::Controlled(_) | Driver::Extern { .. },
        )
        | None => {}
    }
    all
}

/// The inputs that the receptivity of a transition reads, and its events.
fn read_by(net: &Net, transition: &Transition, all: &mut BTreeSet<InputId>) {
    all.extend(&transition.events);
    transition.guard.leaves().for_each(|leaf| inputs_of(net, *leaf, all));
}

/// Collects the inputs that a leaf reads, also through edges and timers.
fn inputs_of(net: &Net, leaf: Leaf, all: &mut BTreeSet<InputId>) {
    let mut below = |expr: &Expr| {
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

/// A leaf or an array element as the author of a chart writes it.
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
