//! Replaces leaves in a piece of a program: values are read from and stored in another place.

use grafsynth_ir::program::{Expr, Leaf, Stmt};

/// The expression with each leaf replaced by the result of `other`.
pub(super) fn expr(expr: &Expr, other: &impl Fn(Leaf) -> Leaf) -> Expr {
    expr.map_leaves(&|leaf| other(*leaf))
}

/// The statements with each leaf replaced where it is read or stored. Elements of arrays stay in cells.
pub(super) fn block(stmts: &[Stmt], other: &impl Fn(Leaf) -> Leaf) -> Vec<Stmt> {
    let expr = |old: &Expr| expr(old, other);
    let one = |stmt: &Stmt| match stmt {
        Stmt::Set(temp, value) => Stmt::Set(*temp, expr(value)),
        Stmt::Store(cell, index, value) => match (other(Leaf::Cell(*cell)), index) {
            (Leaf::Temp(temp), None) => Stmt::Set(temp, expr(value)),
            (Leaf::Cell(cell), index) => Stmt::Store(cell, index.as_ref().map(expr), expr(value)),
            (Leaf::Temp(_) | Leaf::Input(_) | Leaf::Dt, _) => {
                unreachable!("a cell is another cell, or a temporary that is no array")
            }
        },
        Stmt::If(condition, then, otherwise) => {
            Stmt::If(expr(condition), block(then, other), block(otherwise, other))
        }
        Stmt::Repeat { limit, condition, body } => {
            Stmt::Repeat { limit: *limit, condition: expr(condition), body: block(body, other) }
        }
        Stmt::Output(output, value) => Stmt::Output(*output, expr(value)),
        Stmt::Call(output, arguments) => Stmt::Call(*output, arguments.iter().map(expr).collect()),
        Stmt::Code(_) | Stmt::Mark(_) => stmt.clone(),
        Stmt::Fault(raised) => Stmt::Fault(expr(raised)),
    };
    stmts.iter().map(one).collect()
}
