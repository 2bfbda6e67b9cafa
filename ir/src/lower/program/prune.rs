//! Removes cells and temporaries that are written but never read.
//!
//! ```text
//! before: pending e := true;  a.t := a.t + dt;  a := ..      after: a := ..
//! ```
//!
//! Steps and variables are always kept, because a trace shows them.

use crate::Gather;
use std::collections::BTreeSet;

use crate::arena::{Arena, IdMap};
use crate::program::{Cell, CellId, Expr, Leaf, Origin, Program, Stmt, Temp, TempId, statements};

/// The program without values that are never read.
pub(super) fn prune(program: Program) -> Program {
    let mut program = program;
    loop {
        let read = reads(&program.body);
        let keep_cell = keep_cells(&program, &read);
        let keep_temp = IdMap::build(&program.temps, |id, _| read.contains(&Leaf::Temp(id)));
        let done = keep_cell.values().all(|keep| *keep) && keep_temp.values().all(|keep| *keep);
        if done {
            return program;
        }
        program = rebuilt(program, &keep_cell, &keep_temp);
    }
}

/// Does the same for the pieces of a program: `lists` and `exprs`. `kept_temp` and `kept_cells` count as read, because the caller uses them. Returns the new
/// ids.
pub(super) fn prune_pieces(
    program: &mut Program,
    lists: &mut [&mut Vec<Stmt>],
    exprs: &mut [&mut Expr],
    kept_temp: Option<TempId>,
    kept_cells: &[CellId],
) -> Pruned {
    let mut all = Pruned {
        cells: IdMap::build(&program.cells, |id, _| Some(id)),
        temps: IdMap::build(&program.temps, |id, _| Some(id)),
    };
    loop {
        let mut read: BTreeSet<Leaf> = lists.iter().flat_map(|list| reads(list)).gather();
        read.extend(exprs.iter().flat_map(|expr| expr.leaves()));
        read.extend(kept_cells.iter().filter_map(|id| all.cells[*id]).map(Leaf::Cell));
        read.extend(kept_temp.and_then(|id| all.temps[id]).map(Leaf::Temp));
        let keep_cell = keep_cells(program, &read);
        let keep_temp = IdMap::build(&program.temps, |id, _| read.contains(&Leaf::Temp(id)));
        if keep_cell.values().all(|keep| *keep) && keep_temp.values().all(|keep| *keep) {
            return all;
        }
        let (renamed, cells, temps) = renaming(program, &keep_cell, &keep_temp);
        for list in lists.iter_mut() {
            **list = renamed.list(std::mem::take(*list));
        }
        for expr in exprs.iter_mut() {
            **expr = renamed.expr(expr);
        }
        program.cells = cells;
        program.temps = temps;
        for id in all.cells.values_mut() {
            *id = id.and_then(|id| renamed.cells[id]);
        }
        for id in all.temps.values_mut() {
            *id = id.and_then(|id| renamed.temps[id]);
        }
    }
}

/// The new ids of cells and temporaries.
pub(super) type Pruned = Renamed;

/// Steps and variables, and all cells that are read.
fn keep_cells(program: &Program, read: &BTreeSet<Leaf>) -> IdMap<Cell, bool> {
    IdMap::build(&program.cells, |id, cell| {
        matches!(cell.origin, Origin::Step(_) | Origin::Var(_)) || read.contains(&Leaf::Cell(id))
    })
}

/// All values that are read, except by a counter that only updates itself.
fn reads(body: &[Stmt]) -> BTreeSet<Leaf> {
    let mut read = BTreeSet::new();
    for stmt in statements(body) {
        let own = stmt.target();
        let leaves = stmt.exprs().flat_map(Expr::leaves);
        read.extend(leaves.filter(|leaf| Some(**leaf) != own).copied());
    }
    read
}

/// The new ids of everything that is kept.
pub(super) struct Renamed {
    cells: IdMap<Cell, Option<CellId>>,
    temps: IdMap<Temp, Option<TempId>>,
}

fn rebuilt(
    program: Program,
    keep_cell: &IdMap<Cell, bool>,
    keep_temp: &IdMap<Temp, bool>,
) -> Program {
    let (renamed, cells, temps) = renaming(&program, keep_cell, keep_temp);
    let body = renamed.list(program.body);
    let evolution = program.evolution.and_then(|again| renamed.temps[again]);
    let carried = program.carried.into_iter();
    let carried = carried.filter_map(|(id, what)| Some((renamed.temps[id]?, what))).collect();
    Program { cells, temps, body, evolution, carried, ..program }
}

fn renaming(
    program: &Program,
    keep_cell: &IdMap<Cell, bool>,
    keep_temp: &IdMap<Temp, bool>,
) -> (Renamed, Arena<Cell>, Arena<Temp>) {
    let mut cells = Arena::new();
    let mut temps = Arena::new();
    let renamed = Renamed {
        cells: IdMap::build(&program.cells, |id, cell| {
            keep_cell[id].then(|| cells.push(cell.clone()))
        }),
        temps: IdMap::build(&program.temps, |id, temp| {
            keep_temp[id].then(|| temps.push(temp.clone()))
        }),
    };
    (renamed, cells, temps)
}

impl Renamed {
    pub(super) fn cell(&self, id: CellId) -> Option<CellId> {
        self.cells[id]
    }

    pub(super) fn temp(&self, id: TempId) -> Option<TempId> {
        self.temps[id]
    }

    fn list(&self, body: Vec<Stmt>) -> Vec<Stmt> {
        let mut out = Vec::new();
        for statement in body {
            match statement {
                Stmt::Set(temp, value) => {
                    if let Some(temp) = self.temps[temp] {
                        out.push(Stmt::Set(temp, self.expr(&value)));
                    }
                }
                Stmt::Store(cell, index, value) => {
                    if let Some(cell) = self.cells[cell] {
                        out.push(Stmt::Store(
                            cell,
                            index.map(|index| self.expr(&index)),
                            self.expr(&value),
                        ));
                    }
                }
                Stmt::If(condition, then, otherwise) => {
                    let (then, otherwise) = (self.list(then), self.list(otherwise));
                    if !then.is_empty() || !otherwise.is_empty() {
                        out.push(Stmt::If(self.expr(&condition), then, otherwise));
                    }
                }
                Stmt::Repeat { limit, condition, body } => {
                    let body = self.list(body);
                    out.push(Stmt::Repeat { limit, condition: self.expr(&condition), body });
                }
                Stmt::Output(output, value) => out.push(Stmt::Output(output, self.expr(&value))),
                Stmt::Call(output, arguments) => {
                    out.push(Stmt::Call(
                        output,
                        arguments.iter().map(|argument| self.expr(argument)).collect(),
                    ));
                }
                stmt @ (Stmt::Code(_) | Stmt::Mark(_)) => out.push(stmt),
                Stmt::Fault(value) => out.push(Stmt::Fault(self.expr(&value))),
            }
        }
        out
    }

    /// The expression with the new ids. A kept statement reads only kept values; only the update of a removed counter reads a removed value, and it is removed
    /// too.
    fn expr(&self, expr: &Expr) -> Expr {
        let leaf = |leaf: &Leaf| match leaf {
            Leaf::Cell(id) => self.cells[*id].map(Leaf::Cell),
            Leaf::Temp(id) => self.temps[*id].map(Leaf::Temp),
            Leaf::Input(_) | Leaf::Dt => Some(*leaf),
        };
        expr.map(
            &mut |inner, span| {
                leaf(inner).map_or_else(|| Expr::int(0), |inner| Expr::leaf(inner, span))
            },
            &mut |array, _| leaf(array).unwrap_or(Leaf::Dt),
        )
    }
}
