//! Walks over trees: the parts of expressions, and the full expressions of statements.

use crate::tree::{
    Callee, Expr, ExprKind, Init, Item, ItemKind, Label, Place, PlaceKind, SizeOfOperand, Stmt,
    StmtKind, SymbolId, Unit,
};

/// A part of an expression.
#[derive(Debug, Clone, Copy)]
pub enum Node<'a> {
    /// An expression.
    Expr(&'a Expr),
    /// A place; the parent node determines whether it is read, written or has its address taken.
    Place(&'a Place),
}

/// Calls `look` for each operand of an expression that is evaluated, in the order of the text.
pub fn expr_parts<'a>(expr: &'a Expr, look: &mut dyn FnMut(Node<'a>)) {
    match &expr.kind {
        ExprKind::Literal(..)
        | ExprKind::Bool(_)
        | ExprKind::Null
        | ExprKind::Constant(_)
        | ExprKind::Function(_)
        | ExprKind::SizeOf(_) => {}
        ExprKind::Read(place) | ExprKind::Address(place) | ExprKind::Decay(place) => {
            look(Node::Place(place));
        }
        ExprKind::Unary(_, a)
        | ExprKind::Convert(a)
        | ExprKind::Cast(_, a)
        | ExprKind::Member(a, _) => look(Node::Expr(a)),
        ExprKind::Binary(_, a, b) | ExprKind::Comma(a, b) => {
            look(Node::Expr(a));
            look(Node::Expr(b));
        }
        ExprKind::Logical(_, all) => all.iter().for_each(|one| look(Node::Expr(one))),
        ExprKind::Choose(c, a, b) => [c, a, b].into_iter().for_each(|one| look(Node::Expr(one))),
        ExprKind::Assign(place, value) | ExprKind::Update(_, place, value, _) => {
            look(Node::Place(place));
            look(Node::Expr(value));
        }
        ExprKind::Step { place, .. } => look(Node::Place(place)),
        ExprKind::Call(callee, arguments) => {
            if let Callee::Pointer(pointer) = callee {
                look(Node::Expr(pointer));
            }
            arguments.iter().for_each(|one| look(Node::Expr(one)));
        }
    }
}

/// Calls `look` for each part of a place that is evaluated to find it.
pub fn place_parts<'a>(place: &'a Place, look: &mut dyn FnMut(Node<'a>)) {
    match &place.kind {
        PlaceKind::Symbol(_) => {}
        PlaceKind::Member(base, _) => look(Node::Place(base)),
        PlaceKind::Element(base, index) => {
            look(Node::Place(base));
            look(Node::Expr(index));
        }
        PlaceKind::At(pointer, index) => {
            look(Node::Expr(pointer));
            look(Node::Expr(index));
        }
        PlaceKind::Deref(pointer) => look(Node::Expr(pointer)),
    }
}

/// Calls `look` for an expression and all its parts, including the operands of `sizeof`, parents first.
pub fn each_node<'a>(node: Node<'a>, look: &mut dyn FnMut(Node<'a>)) {
    look(node);
    match node {
        Node::Expr(expr) => {
            if let ExprKind::SizeOf(operand) = &expr.kind {
                match &**operand {
                    SizeOfOperand::Type(_) => {}
                    SizeOfOperand::Place(place) => each_node(Node::Place(place), look),
                    SizeOfOperand::Value(value) => each_node(Node::Expr(value), look),
                }
            }
            expr_parts(expr, &mut |part| each_node(part, look));
        }
        Node::Place(place) => place_parts(place, &mut |part| each_node(part, look)),
    }
}

/// A full expression (C99 6.8p4), or an initialiser.
#[derive(Debug, Clone, Copy)]
pub enum Full<'a> {
    /// An expression.
    Expr(&'a Expr),
    /// The initialiser of an object.
    Init(SymbolId, &'a Init),
}

/// Calls `look` for each value of an initialiser.
pub fn init_values<'a>(init: &'a Init, look: &mut dyn FnMut(&'a Expr)) {
    match init {
        Init::Value(value) => look(value),
        Init::Parts(parts) => parts.iter().for_each(|part| init_values(&part.init, look)),
    }
}

/// Calls `look` for each statement of a body and of the bodies in it, parents first.
pub fn each_stmt<'a>(body: &'a [Stmt], look: &mut dyn FnMut(&'a Stmt)) {
    for stmt in body {
        look(stmt);
        for_each_body(stmt, &mut |inner| each_stmt(inner, look));
    }
}

/// Calls `look` for each body of a statement.
pub fn for_each_body<'a>(stmt: &'a Stmt, look: &mut dyn FnMut(&'a [Stmt])) {
    match &stmt.kind {
        StmtKind::If { arms, otherwise } => {
            arms.iter().for_each(|arm| look(&arm.body));
            look(otherwise);
        }
        StmtKind::Switch { cases, .. } => cases.iter().for_each(|case| look(&case.body)),
        StmtKind::While { body, .. } | StmtKind::DoWhile { body, .. } | StmtKind::Block(body) => {
            look(body);
        }
        StmtKind::For { init, body, .. } => {
            look(init);
            look(body);
        }
        StmtKind::Expr(_)
        | StmtKind::Define { .. }
        | StmtKind::Break
        | StmtKind::Continue
        | StmtKind::Return(_)
        | StmtKind::Barrier
        | StmtKind::Opaque(_) => {}
    }
}

/// Calls `look` for the full expressions of a statement itself, without those of its bodies.
pub fn full_exprs<'a>(stmt: &'a Stmt, look: &mut dyn FnMut(Full<'a>)) {
    match &stmt.kind {
        StmtKind::Expr(value) | StmtKind::Return(Some(value)) => look(Full::Expr(value)),
        StmtKind::Define { symbol, init: Some(init) } => look(Full::Init(*symbol, init)),
        StmtKind::If { arms, .. } => arms.iter().for_each(|arm| look(Full::Expr(&arm.condition))),
        StmtKind::Switch { on, cases } => {
            look(Full::Expr(on));
            for label in cases.iter().flat_map(|case| &case.labels) {
                if let Label::Case(value, _) = label {
                    look(Full::Expr(value));
                }
            }
        }
        StmtKind::While { condition, .. } | StmtKind::DoWhile { condition, .. } => {
            look(Full::Expr(condition));
        }
        StmtKind::For { condition, step, .. } => {
            condition.iter().chain(step).for_each(|one| look(Full::Expr(one)));
        }
        StmtKind::Define { init: None, .. }
        | StmtKind::Return(None)
        | StmtKind::Break
        | StmtKind::Continue
        | StmtKind::Block(_)
        | StmtKind::Barrier
        | StmtKind::Opaque(_) => {}
    }
}

/// Calls `look` for each declaration, including those within `extern "C"`.
pub fn each_item<'a>(items: &'a [Item], look: &mut dyn FnMut(&'a Item)) {
    for item in items {
        look(item);
        if let ItemKind::ExternC(inner) = &item.kind {
            each_item(inner, look);
        }
    }
}

/// Calls `look` for each full expression of a unit, with the function that contains it.
pub fn each_full<'a>(unit: &'a Unit, look: &mut dyn FnMut(Option<SymbolId>, Full<'a>)) {
    each_item(&unit.items, &mut |item| match &item.kind {
        ItemKind::Function { symbol, body, .. } => {
            each_stmt(body, &mut |stmt| full_exprs(stmt, &mut |full| look(Some(*symbol), full)));
        }
        ItemKind::Object { symbol, init: Some(init), .. } => look(None, Full::Init(*symbol, init)),
        ItemKind::Include(_)
        | ItemKind::DeclareStruct(_)
        | ItemKind::DefineStruct(_)
        | ItemKind::DefineEnum(_)
        | ItemKind::Typedef { .. }
        | ItemKind::Object { init: None, .. }
        | ItemKind::Prototype { .. }
        | ItemKind::ExternC(_) => {}
    });
}
