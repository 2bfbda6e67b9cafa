//! The reaction in several clocks: rewrites the program so that one clock runs one round of the evolution (semantics.md §9).
//!
//! ```text
//!   one reaction              one clock
//!   before                    take the inputs, or those held         an event that comes while busy is kept
//!   repeat while c       ──►  if not busy { before } else { values of before and of the last round that are still read := held }
//!     { round }               if c { round }
//!   after                     if not c { after, outputs and fault into registers }
//!                             busy := c;  held := what the next clock reads
//! ```
//! A round is one check with its effect: a micro-step, an event taken from a queue, or the empty check that ends the reaction. So outside
//! statecharts a reaction of k micro-steps takes k + 1 clocks, and one that changes nothing takes one. The micro-step count, the limit and the fault come
//! from the program itself. The rest of the encoder only knows the cells for pins ([`Registers`]).
//!
//! Held values have no meaning once `busy` is 0: the next clock overwrites them before it reads them. They are not cleared, because that would add the
//! products of `busy`'s function to every such flip-flop.

use super::{has_pin, substitute};
use grafsynth_ir::Gather;
use grafsynth_ir::Span;
use grafsynth_ir::arena::{Arena, Id};
use grafsynth_ir::expr::{CompareOp, ExprKind, Type};
use grafsynth_ir::net::{InputId, Net, OutputId};
use grafsynth_ir::program::{
    Cell, CellId, Expr, Leaf, Origin, Program, ResetEffect, Stmt, Temp, TempId, TempRole,
    expressions, statements,
};
use std::collections::{BTreeMap, BTreeSet};

/// A program that runs one round per clock.
pub(super) struct Stepwise {
    pub(super) program: Program,
    pub(super) registers: Registers,
}

/// The cells whose values pins show directly; they change when a reaction ends.
pub(super) struct Registers {
    /// 1 while the reaction is running; this cell changes at every clock.
    pub(super) busy: CellId,
    /// The fault flag of the last row.
    pub(super) fault: CellId,
    /// For each extern action, true if it was called in the last row.
    pub(super) strobes: BTreeMap<OutputId, CellId>,
}

/// The program over several clocks. `None` if its form does not allow this: nothing evolves, or actions are called between micro-steps. A chip can show
/// one call per reaction, and the encoder cannot exclude a second call in a later clock.
pub(super) fn stepwise(net: &Net, program: &Program) -> Option<Stepwise> {
    let at = program.body.iter().position(|stmt| is_evolution(program, stmt))?;
    let (before, rest) = program.body.split_at(at);
    let (Some(Stmt::Repeat { condition, body, .. }), after) =
        (rest.first(), rest.get(1..).unwrap_or(&[]))
    else {
        return None;
    };
    if !(only_stores(before) && only_stores(body)) {
        return None;
    }
    let mut exposed = Exposed::default();
    exposed.block(body);
    exposed.expr(condition);
    exposed.block(after);
    // Values that depend only on inputs are computed again in each clock; all other values that are still read must be held.
    let (pure, start) = split_pure(program, before, &exposed.read);
    let pure_temps: BTreeSet<TempId> = pure.iter().map(|&(temp, _)| temp).gather();
    let mut later = Used::default();
    pure.iter().for_each(|(_, value)| later.expr(value));
    later.block(body);
    later.expr(condition);
    later.block(after);
    let mut at_start = Used::default();
    at_start.block(&start);

    let mut maker = Maker::new(net, program, &at_start, &later);
    maker.note_calls(net, after);
    let held: Vec<(TempId, CellId)> = exposed
        .read
        .difference(&pure_temps)
        .map(|&temp| {
            let Temp { name, ty, .. } = &program.temps[temp];
            (temp, maker.cell(name.clone(), *ty, 0, Origin::Helper))
        })
        .collect();
    let mut out = maker.take_inputs();
    for (temp, value) in pure {
        out.push(Stmt::Set(temp, maker.expr(value)));
    }
    let goes_on = maker.temp("goes_on", Type::Bool);
    let mut start = maker.block(&start);
    start.push(Stmt::Set(goes_on, maker.expr(condition)));
    let mut resume: Vec<Stmt> =
        held.iter().map(|&(temp, cell)| Stmt::Set(temp, of_cell(cell))).collect();
    resume.push(Stmt::Set(goes_on, Expr::bool(true)));
    out.push(Stmt::If(of_cell(maker.busy), resume, start));
    out.push(Stmt::If(of_temp(goes_on), maker.block(body), Vec::new()));
    let again = maker.temp("again", Type::Bool);
    out.push(Stmt::Set(again, maker.expr(condition)));
    let end = maker.end(after);
    out.push(Stmt::If(of_temp(again), Vec::new(), end));
    out.extend(maker.hold(again, &held));
    Some(maker.finish(out))
}

/// True for the loop that changes the situation; other loops resolve conflicts or order due sends.
fn is_evolution(program: &Program, stmt: &Stmt) -> bool {
    matches!(stmt, Stmt::Repeat { body, .. } if moves(program, body))
}

/// True if the block may change the bit of a step.
pub(super) fn moves(program: &Program, block: &[Stmt]) -> bool {
    statements(block).filter_map(Stmt::target).any(|target| match target {
        Leaf::Cell(cell) => matches!(program.cells[cell].origin, Origin::Step(_)),
        // A state that is coded by its region changes as a temporary.
        Leaf::Temp(temp) => matches!(program.temps[temp].role, TempRole::NextActive(_)),
        Leaf::Input(_) | Leaf::Dt => false,
    })
}

/// Extracts temporaries that are set once, to a value that depends only on inputs, and that `wanted` reads directly or indirectly; returns them and the
/// rest of the block.
fn split_pure<'a>(
    program: &Program,
    before: &'a [Stmt],
    wanted: &BTreeSet<TempId>,
) -> (Vec<(TempId, &'a Expr)>, Vec<Stmt>) {
    let mut n_sets: BTreeMap<TempId, usize> = BTreeMap::new();
    for stmt in statements(&program.body) {
        if let Stmt::Set(temp, _) = stmt {
            *n_sets.entry(*temp).or_default() += 1;
        }
    }
    let mut pure: BTreeSet<TempId> = BTreeSet::new();
    for stmt in before {
        if let Stmt::Set(temp, value) = stmt
            && n_sets.get(temp) == Some(&1)
        {
            let follows = value.leaves().all(|leaf| match leaf {
                Leaf::Input(_) | Leaf::Dt => true,
                Leaf::Temp(temp) => pure.contains(temp),
                Leaf::Cell(_) => false,
            });
            if follows {
                pure.insert(*temp);
            }
        }
    }
    let mut needed: BTreeSet<TempId> = wanted.intersection(&pure).copied().gather();
    for stmt in before.iter().rev() {
        if let Stmt::Set(temp, value) = stmt
            && needed.contains(temp)
        {
            for leaf in value.leaves() {
                if let Leaf::Temp(temp) = leaf {
                    needed.insert(*temp);
                }
            }
        }
    }
    let mut sets = Vec::new();
    let mut rest = Vec::new();
    for stmt in before {
        if let Stmt::Set(temp, value) = stmt
            && needed.contains(temp)
        {
            sets.push((*temp, value));
        } else {
            rest.push(stmt.clone());
        }
    }
    (sets, rest)
}

/// True if the block has no effect outside the reaction.
fn only_stores(block: &[Stmt]) -> bool {
    use Stmt::{If, Mark, Repeat, Set, Store};
    statements(block)
        .all(|stmt| matches!(stmt, Set(..) | Store(..) | If(..) | Repeat { .. } | Mark(_)))
}

fn calls(block: &[Stmt]) -> BTreeSet<OutputId> {
    let called = statements(block)
        .filter_map(|stmt| if let Stmt::Call(output, _) = stmt { Some(*output) } else { None });
    called.gather()
}

fn of_cell(cell: CellId) -> Expr {
    Expr::leaf(Leaf::Cell(cell), Span::default())
}

fn of_temp(temp: TempId) -> Expr {
    Expr::leaf(Leaf::Temp(temp), Span::default())
}

fn select(condition: Expr, then: Expr, otherwise: Expr) -> Expr {
    Expr::new(
        ExprKind::Select(Box::new(condition), Box::new(then), Box::new(otherwise)),
        Span::default(),
    )
}

/// Inputs and time that the program reads.
#[derive(Default)]
struct Used {
    inputs: BTreeSet<InputId>,
    dt: bool,
}

impl Used {
    fn expr(&mut self, expr: &Expr) {
        for leaf in expr.leaves() {
            match leaf {
                Leaf::Input(input) => {
                    self.inputs.insert(*input);
                }
                Leaf::Dt => self.dt = true,
                Leaf::Cell(_) | Leaf::Temp(_) => {}
            }
        }
    }

    fn block(&mut self, block: &[Stmt]) {
        expressions(block).for_each(|expr| self.expr(expr));
    }
}

/// The temporaries that a block may read before it sets them. A temporary that only one branch sets counts as set only in that branch.
#[derive(Default)]
struct Exposed {
    read: BTreeSet<TempId>,
    set: BTreeSet<TempId>,
}

impl Exposed {
    fn expr(&mut self, expr: &Expr) {
        for leaf in expr.leaves() {
            if let Leaf::Temp(temp) = leaf
                && !self.set.contains(temp)
            {
                self.read.insert(*temp);
            }
        }
    }

    fn branch(&mut self, block: &[Stmt]) {
        let outer = self.set.clone();
        self.block(block);
        self.set = outer;
    }

    fn block(&mut self, block: &[Stmt]) {
        for stmt in block {
            match stmt {
                Stmt::Set(temp, value) => {
                    self.expr(value);
                    self.set.insert(*temp);
                }
                Stmt::If(condition, then, otherwise) => {
                    self.expr(condition);
                    self.branch(then);
                    self.branch(otherwise);
                }
                Stmt::Repeat { condition, body, .. } => {
                    self.expr(condition);
                    self.branch(body);
                }
                Stmt::Store(..)
                | Stmt::Output(..)
                | Stmt::Call(..)
                | Stmt::Fault(_)
                | Stmt::Code(_)
                | Stmt::Mark(_) => {
                    stmt.exprs().for_each(|expr| self.expr(expr));
                }
            }
        }
    }
}

/// An input of the reaction, or its tick.
struct Taken {
    /// The value of the pin.
    pin: Expr,
    /// The value that the reaction uses.
    now: TempId,
    ty: Type,
    /// The value that the later clocks of the reaction use, if one of them reads the input.
    held: Option<CellId>,
    /// For an event or the tick: an occurrence that arrived while the circuit was busy.
    late: Option<CellId>,
}

struct Maker<'a> {
    program: &'a Program,
    cells: Arena<Cell>,
    temps: Arena<Temp>,
    busy: CellId,
    inputs: BTreeMap<InputId, Taken>,
    tick: Option<Taken>,
    /// An event or tick arrived while another occurrence was already stored.
    lost: Option<CellId>,
    outputs: BTreeMap<OutputId, CellId>,
    /// Temporaries that record the calls of extern actions at the end.
    called: BTreeMap<OutputId, TempId>,
    strobes: BTreeMap<OutputId, CellId>,
    fault: CellId,
}

impl<'a> Maker<'a> {
    fn new(net: &Net, program: &'a Program, at_start: &Used, later: &Used) -> Self {
        let (cells, temps) = (program.cells.clone(), program.temps.clone());
        // The two cells that every such program has get their ids below.
        let mut maker = Maker {
            program,
            cells,
            temps,
            busy: Id::from_index(0),
            inputs: BTreeMap::new(),
            tick: None,
            lost: None,
            outputs: BTreeMap::new(),
            called: BTreeMap::new(),
            strobes: BTreeMap::new(),
            fault: Id::from_index(0),
        };
        maker.busy = maker.cell("busy".to_owned(), Type::Bool, 0, Origin::Helper);
        let init = i64::from(program.reset_fault);
        maker.fault = maker.cell("fault".to_owned(), Type::Bool, init, Origin::Fault);
        for &id in at_start.inputs.union(&later.inputs) {
            let input = &net.inputs[id];
            if has_pin(input.kind) {
                let pin = Expr::leaf(Leaf::Input(id), Span::default());
                let is_held = later.inputs.contains(&id);
                let taken =
                    maker.taken(&input.name.text, input.ty, pin, is_held, input.kind.is_event());
                maker.inputs.insert(id, taken);
            }
        }
        if at_start.dt || later.dt {
            let pin = Expr::leaf(Leaf::Dt, Span::default());
            let ty = Type::Int { lo: 0, hi: 1 };
            maker.tick = Some(maker.taken("tick", ty, pin, later.dt, true));
        }
        for (id, output) in net.outputs.iter() {
            let init = program.reset_outputs.get(id.index()).copied().unwrap_or(0);
            if !output.is_extern() {
                let origin = Origin::HeldOutput(id, Id::from_index(0));
                let held = maker.cell(output.name.text.clone(), output.ty, init, origin);
                maker.outputs.insert(id, held);
            }
        }
        maker
    }

    /// Creates registers for the actions that are called at the end of a reaction or at reset.
    fn note_calls(&mut self, net: &Net, after: &[Stmt]) {
        let mut at_reset = BTreeSet::new();
        for effect in &self.program.reset_effects {
            match effect {
                ResetEffect::Call(output, _) => {
                    at_reset.insert(*output);
                }
                ResetEffect::Code(_) => {}
            }
        }
        let mut called = calls(after);
        called.extend(&at_reset);
        for id in called {
            let name = net.outputs[id].name.text.clone();
            let here = self.temp(&format!("{name}.called"), Type::Bool);
            let origin = Origin::HeldOutput(id, Id::from_index(0));
            let held = self.cell(name, Type::Bool, i64::from(at_reset.contains(&id)), origin);
            self.called.insert(id, here);
            self.strobes.insert(id, held);
        }
    }

    fn cell(&mut self, name: String, ty: Type, init: i64, origin: Origin) -> CellId {
        self.cells.push(Cell { name, ty, len: None, init: vec![ty.saturate(init)], origin })
    }

    fn temp(&mut self, name: &str, ty: Type) -> TempId {
        self.temps.push(Temp { name: name.to_owned(), ty, role: TempRole::Helper })
    }

    fn taken(&mut self, name: &str, ty: Type, pin: Expr, is_held: bool, is_event: bool) -> Taken {
        let now = self.temp(name, ty);
        let held = is_held.then(|| self.cell(format!("{name}.taken"), ty, 0, Origin::Helper));
        let late =
            is_event.then(|| self.cell(format!("{name}.late"), Type::Bool, 0, Origin::Helper));
        if is_event && self.lost.is_none() {
            self.lost = Some(self.cell("lost".to_owned(), Type::Bool, 0, Origin::Helper));
        }
        Taken { pin, now, ty, held, late }
    }

    fn all_taken(&self) -> impl Iterator<Item = &Taken> {
        self.inputs.values().chain(&self.tick)
    }

    /// Sets the inputs of the reaction: in a clock with busy 0, to the values of the pins and the late events; otherwise to the values taken in the first clock
    /// of the reaction.
    fn take_inputs(&self) -> Vec<Stmt> {
        let mut out = Vec::new();
        let mut lost = Vec::new();
        let mut keep = Vec::new();
        for taken in self.all_taken() {
            let mut fresh = taken.pin.clone();
            if let Some(late) = taken.late {
                let occurs = match taken.ty {
                    Type::Bool => taken.pin.clone(),
                    Type::Int { .. } => {
                        Expr::compare(CompareOp::Ne, taken.pin.clone(), Expr::int(0))
                    }
                };
                fresh = match taken.ty {
                    Type::Bool => Expr::or([fresh, of_cell(late)]),
                    Type::Int { .. } => select(of_cell(late), Expr::int(1), fresh),
                };
                lost.push(Expr::and([occurs.clone(), of_cell(late)]));
                let kept = Expr::or([occurs, of_cell(late)]);
                keep.push(Stmt::Store(late, None, Expr::and([of_cell(self.busy), kept])));
            }
            // An input without a cell is read only in the first clock.
            let value = match taken.held {
                Some(held) => select(of_cell(self.busy), of_cell(held), fresh),
                None => fresh,
            };
            out.push(Stmt::Set(taken.now, value));
        }
        if let Some(cell) = self.lost {
            // Losses in an earlier reaction were reported in its row.
            lost.push(Expr::and([of_cell(self.busy), of_cell(cell)]));
            out.push(Stmt::Store(cell, None, Expr::or(lost)));
        }
        out.extend(keep);
        out
    }

    /// The end of the reaction: outputs, calls and the fault flag go into registers.
    fn end(&self, after: &[Stmt]) -> Vec<Stmt> {
        let mut out: Vec<Stmt> =
            self.called.values().map(|&called| Stmt::Set(called, Expr::bool(false))).collect();
        // A program without a fault statement has no fault.
        out.push(Stmt::Store(
            self.fault,
            None,
            self.lost.map_or_else(|| Expr::bool(false), of_cell),
        ));
        out.extend(self.registers(self.block(after)));
        for (output, &held) in &self.strobes {
            out.extend(
                self.called.get(output).map(|&called| Stmt::Store(held, None, of_temp(called))),
            );
        }
        out
    }

    fn registers(&self, block: Vec<Stmt>) -> Vec<Stmt> {
        let mut out = Vec::new();
        for stmt in block {
            let stmt = match stmt {
                Stmt::Output(output, value) => match self.outputs.get(&output) {
                    Some(&cell) => Stmt::Store(cell, None, value),
                    None => Stmt::Output(output, value),
                },
                Stmt::Fault(raised) => {
                    let raised = [raised].into_iter().chain(self.lost.map(of_cell));
                    Stmt::Store(self.fault, None, Expr::or(raised))
                }
                Stmt::If(condition, then, otherwise) => {
                    Stmt::If(condition, self.registers(then), self.registers(otherwise))
                }
                Stmt::Repeat { limit, condition, body } => {
                    Stmt::Repeat { limit, condition, body: self.registers(body) }
                }
                Stmt::Call(output, arguments) => {
                    // The call is kept, because the encoder tests whether there may be two.
                    if let Some(&called) = self.called.get(&output) {
                        out.push(Stmt::Set(called, Expr::bool(true)));
                    }
                    Stmt::Call(output, arguments)
                }
                stmt @ (Stmt::Set(..) | Stmt::Store(..) | Stmt::Code(_) | Stmt::Mark(_)) => stmt,
            };
            out.push(stmt);
        }
        out
    }

    /// Stores the values that the next clock needs, and sets the pins.
    fn hold(&self, again: TempId, temps: &[(TempId, CellId)]) -> Vec<Stmt> {
        let mut out = Vec::new();
        let inputs = self.all_taken().filter_map(|taken| taken.held.map(|held| (taken.now, held)));
        for (temp, cell) in inputs.chain(temps.iter().copied()) {
            out.push(Stmt::Store(cell, None, of_temp(temp)));
        }
        out.push(Stmt::Store(self.busy, None, of_temp(again)));
        for (&output, &cell) in &self.outputs {
            out.push(Stmt::Output(output, of_cell(cell)));
        }
        out
    }

    /// Replaces inputs and `dt` by the taken values.
    fn other(&self, leaf: Leaf) -> Leaf {
        match leaf {
            Leaf::Input(input) => {
                self.inputs.get(&input).map_or(leaf, |taken| Leaf::Temp(taken.now))
            }
            Leaf::Dt => self.tick.as_ref().map_or(leaf, |taken| Leaf::Temp(taken.now)),
            Leaf::Cell(_) | Leaf::Temp(_) => leaf,
        }
    }

    fn expr(&self, expr: &Expr) -> Expr {
        substitute::expr(expr, &|leaf| self.other(leaf))
    }

    fn block(&self, block: &[Stmt]) -> Vec<Stmt> {
        substitute::block(block, &|leaf| self.other(leaf))
    }

    fn finish(self, body: Vec<Stmt>) -> Stepwise {
        let registers = Registers { busy: self.busy, fault: self.fault, strobes: self.strobes };
        let program = Program {
            cells: self.cells,
            temps: self.temps,
            reset_effects: self.program.reset_effects.clone(),
            reset_outputs: self.program.reset_outputs.clone(),
            reset_fault: self.program.reset_fault,
            body,
            // Each micro-step has its own clock.
            evolution: None,
            carried: Vec::new(),
            shared_timers: self.program.shared_timers.clone(),
        };
        Stepwise { program, registers }
    }
}
