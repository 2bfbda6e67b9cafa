//! Drops cells and temps that are written and never read.
//!
//! ```text
//! before: pending e := true;  a.t := a.t + dt;  a := ..      after: a := ..
//! ```
//!
//! Steps and variables always stay: a trace shows them.

use std::collections::BTreeSet;
use std::convert::Infallible;

use crate::arena::{Arena, IdMap};
use crate::expr::Expr as GenericExpr;
use crate::program::{Cell, CellId, Expr, Leaf, Origin, Program, Stmt, Temp, TempId};

/// The program without what nobody reads.
pub(super) fn prune(program: Program) -> Program {
    let mut program = program;
    loop {
        let mut read = BTreeSet::new();
        reads(&program.body, &mut read);
        let keep_cell = IdMap::build(&program.cells, |id, cell| {
            matches!(cell.origin, Origin::Step(_) | Origin::Var(_))
                || read.contains(&Leaf::Cell(id))
        });
        let keep_temp = IdMap::build(&program.temps, |id, _| read.contains(&Leaf::Temp(id)));
        let done = keep_cell.values().all(|keep| *keep) && keep_temp.values().all(|keep| *keep);
        if done {
            return program;
        }
        program = rebuilt(program, &keep_cell, &keep_temp);
    }
}

/// What is read, but for a counter that only counts itself.
fn reads(body: &[Stmt], read: &mut BTreeSet<Leaf>) {
    fn note(read: &mut BTreeSet<Leaf>, expr: &Expr, but: Option<Leaf>) {
        expr.for_each_leaf(&mut |leaf| {
            if Some(*leaf) != but {
                read.insert(*leaf);
            }
        });
    }
    for statement in body {
        match statement {
            Stmt::Set(temp, value) => note(read, value, Some(Leaf::Temp(*temp))),
            Stmt::Store(cell, index, value) => {
                for expr in index.iter().chain([value]) {
                    note(read, expr, Some(Leaf::Cell(*cell)));
                }
            }
            Stmt::If(condition, then, otherwise) => {
                note(read, condition, None);
                reads(then, read);
                reads(otherwise, read);
            }
            Stmt::Repeat { condition, body, .. } => {
                note(read, condition, None);
                reads(body, read);
            }
            Stmt::Output(_, value) | Stmt::Fault(value) => note(read, value, None),
            Stmt::Call(_, arguments) => {
                arguments.iter().for_each(|argument| note(read, argument, None))
            }
            Stmt::Code(_) => {}
        }
    }
}

struct Renamed {
    cells: IdMap<Cell, Option<CellId>>,
    temps: IdMap<Temp, Option<TempId>>,
}

fn rebuilt(
    program: Program,
    keep_cell: &IdMap<Cell, bool>,
    keep_temp: &IdMap<Temp, bool>,
) -> Program {
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
    let body = renamed.list(program.body);
    Program { cells, temps, body, ..program }
}

impl Renamed {
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
                Stmt::Code(text) => out.push(Stmt::Code(text)),
                Stmt::Fault(value) => out.push(Stmt::Fault(self.expr(&value))),
            }
        }
        out
    }

    /// A kept statement reads kept things only, but for what a dropped self-reference stood for.
    fn expr(&self, expr: &Expr) -> Expr {
        let leaf = |leaf: &Leaf| match leaf {
            Leaf::Cell(id) => self.cells[*id].map(Leaf::Cell),
            Leaf::Temp(id) => self.temps[*id].map(Leaf::Temp),
            Leaf::Input(_) | Leaf::Dt => Some(*leaf),
        };
        let mapped = expr.try_map::<Leaf, Infallible>(
            &mut |inner, span| {
                Ok(leaf(inner)
                    .map_or_else(|| GenericExpr::int(0), |inner| GenericExpr::leaf(inner, span)))
            },
            &mut |array, _| Ok(leaf(array).unwrap_or(Leaf::Dt)),
        );
        let Ok(mapped) = mapped;
        mapped
    }
}
