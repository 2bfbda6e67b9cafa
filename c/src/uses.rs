//! Finds the accesses and calls of an expression, of a statement, or of a whole unit.
//!
//! ```
//! # use grafsynth_c::{Config, Input, SourceFile, parse, uses};
//! # use grafsynth_ir::FileId;
//! let text = "static int n; int next(void) { n += 1; return n; }";
//! let files = [SourceFile { file: FileId(0), name: "a.c", text }];
//! let (unit, _) = parse(&Input { files: &files, verbatim: &[], readers: &[], config: &Config::host() });
//! let unit = unit.expect("C");
//! let index = uses::Index::new(&unit);
//! let (n, _) = unit.symbols.iter().find(|(_, symbol)| symbol.name == "n").expect("n");
//! assert_eq!((index.uses[n].reads.len(), index.uses[n].writes.len()), (2, 1));
//! ```

use crate::tree::types::{IntKind, Type};
use crate::tree::{
    Callee, Expr, ExprKind, ItemKind, Loc, Place, PlaceKind, SizeOfOperand, Stmt, StmtKind, Symbol,
    SymbolId, SymbolKind, Unit,
};
use crate::walk::{
    Full, Node, each_full, each_item, each_node, each_stmt, expr_parts, full_exprs, init_values,
    place_parts,
};
use grafsynth_ir::IdMap;
use std::collections::{BTreeMap, BTreeSet};

/// The objects that code reads or writes, and the functions that it calls.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Accesses<'a> {
    /// Objects whose value is read; the place is the whole object that is read, such as `self->bits[3]`.
    pub reads: Vec<&'a Place>,
    /// Objects that are written.
    pub writes: Vec<&'a Place>,
    /// Objects whose address is taken, by `&` or because an array becomes a pointer.
    pub addresses: Vec<&'a Place>,
    /// Functions that are called.
    pub calls: Vec<Called<'a>>,
    /// True if the code contains user code that was not read, which may access everything that is visible.
    pub is_opaque: bool,
}

/// A call.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Called<'a> {
    /// The called function; `None` if the call is through a pointer.
    pub function: Option<SymbolId>,
    /// The arguments.
    pub arguments: &'a [Expr],
    /// Source location.
    pub span: Loc,
}

impl<'a> Accesses<'a> {
    /// The accesses of an expression and all its parts. The operand of `sizeof` is not evaluated and has none.
    #[must_use]
    pub fn of_expr(expr: &'a Expr) -> Self {
        let mut found = Accesses::default();
        found.expr(expr);
        found
    }

    /// The accesses of a statement itself: of its full expressions, without those of its bodies.
    #[must_use]
    pub fn of_stmt(stmt: &'a Stmt) -> Self {
        let mut found = Accesses { is_opaque: is_opaque(stmt), ..Accesses::default() };
        full_exprs(stmt, &mut |full| found.full(full));
        found
    }

    /// The accesses of statements with all their bodies. The initialisation of a local is not a write.
    #[must_use]
    pub fn of_body(body: &'a [Stmt]) -> Self {
        let mut found = Accesses::default();
        each_stmt(body, &mut |stmt| {
            found.is_opaque |= is_opaque(stmt);
            full_exprs(stmt, &mut |full| found.full(full));
        });
        found
    }

    fn full(&mut self, full: Full<'a>) {
        match full {
            Full::Expr(expr) => self.expr(expr),
            Full::Init(_, init) => init_values(init, &mut |value| self.expr(value)),
        }
    }

    fn expr(&mut self, expr: &'a Expr) {
        self.own(expr);
        expr_parts(expr, &mut |part| self.part(part));
    }

    fn part(&mut self, part: Node<'a>) {
        match part {
            Node::Expr(inner) => self.expr(inner),
            Node::Place(place) => place_parts(place, &mut |part| self.part(part)),
        }
    }

    /// The accesses of the outermost operator of an expression.
    pub(crate) fn own(&mut self, expr: &'a Expr) {
        match &expr.kind {
            ExprKind::Read(place) => self.reads.push(place),
            ExprKind::Address(place) | ExprKind::Decay(place) => self.addresses.push(place),
            ExprKind::Assign(place, _) => self.writes.push(place),
            ExprKind::Update(_, place, ..) | ExprKind::Step { place, .. } => {
                self.reads.push(place);
                self.writes.push(place);
            }
            ExprKind::Call(callee, arguments) => {
                let function = match callee {
                    Callee::Function(id) => Some(*id),
                    Callee::Pointer(_) => None,
                };
                self.calls.push(Called { function, arguments, span: expr.span });
            }
            _ => {}
        }
    }
}

fn is_opaque(stmt: &Stmt) -> bool {
    matches!(stmt.kind, StmtKind::Opaque(_))
}

/// An occurrence of a symbol.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Site {
    /// The function that contains the occurrence; `None` if it is in an initialiser at file scope.
    pub function: Option<SymbolId>,
    /// Source location.
    pub span: Loc,
}

/// The occurrences of a symbol.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Uses {
    /// Reads of the object or of a part of it. Following a pointer reads the pointer.
    pub reads: Vec<Site>,
    /// Assignments to the object or to a part of it. Initialisation does not count.
    pub writes: Vec<Site>,
    /// Occurrences that take the address of the object or of a part of it, and occurrences of a function's name that do not call it.
    pub addresses: Vec<Site>,
    /// Calls of the function.
    pub calls: Vec<Site>,
    /// Occurrences that neither read nor write: operands of `sizeof`, and uses of a constant.
    pub mentions: Vec<Site>,
}

impl Uses {
    /// True if the symbol occurs nowhere.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        let all = [&self.reads, &self.writes, &self.addresses, &self.calls, &self.mentions];
        all.iter().all(|one| one.is_empty())
    }
}

/// All occurrences of all symbols of a unit, in the order of the text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Index {
    /// The occurrences of each symbol.
    pub uses: IdMap<Symbol, Uses>,
}

impl Index {
    /// The index of a unit.
    #[must_use]
    pub fn new(unit: &Unit) -> Self {
        let mut index = Index { uses: IdMap::filled(&unit.symbols, Uses::default()) };
        each_full(unit, &mut |function, full| match full {
            Full::Expr(expr) => index.expr(expr, function),
            Full::Init(_, init) => init_values(init, &mut |value| index.expr(value, function)),
        });
        index
    }

    fn expr(&mut self, expr: &Expr, function: Option<SymbolId>) {
        each_node(Node::Expr(expr), &mut |node| {
            let Node::Expr(expr) = node else { return };
            let site = Site { function, span: expr.span };
            let mut found = Accesses::default();
            found.own(expr);
            for (places, kind) in [(&found.reads, 0), (&found.writes, 1), (&found.addresses, 2)] {
                for id in places.iter().filter_map(|place| place.object()) {
                    let uses = &mut self.uses[id];
                    [&mut uses.reads, &mut uses.writes, &mut uses.addresses][kind].push(site);
                }
            }
            for id in found.calls.iter().filter_map(|call| call.function) {
                self.uses[id].calls.push(site);
            }
            if let ExprKind::Function(id) = &expr.kind {
                self.uses[*id].addresses.push(site);
            } else if let ExprKind::Constant(id) = &expr.kind {
                self.uses[*id].mentions.push(site);
            } else if let ExprKind::SizeOf(operand) = &expr.kind
                && let SizeOfOperand::Place(place) = &**operand
                && let Some(id) = place.object()
            {
                self.uses[id].mentions.push(site);
            }
        });
    }

    /// True if the object can be accessed other than by its own name: if its address is taken, or if it is visible outside the unit's functions.
    #[must_use]
    pub fn is_shared(&self, unit: &Unit, id: SymbolId) -> bool {
        let is_local = match unit.symbols[id].kind {
            SymbolKind::Local { is_static } => !is_static,
            SymbolKind::Parameter => true,
            _ => false,
        };
        !is_local || !self.uses[id].addresses.is_empty()
    }
}

/// The effect of a call on memory that does not belong to the called function.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Effect {
    /// No effect: the value depends only on the arguments and on constants.
    None,
    /// The call may read such memory, but does not write it.
    Reads,
    /// The call may read and write such memory.
    Writes,
}

/// The effects of a call of a function.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Summary {
    /// The effect of the call, apart from writes through the parameters in `written`.
    pub effect: Effect,
    /// Indexes of the pointer parameters through which the function writes.
    pub written: BTreeSet<usize>,
}

impl Summary {
    fn new(effect: Effect) -> Self {
        Summary { effect, written: BTreeSet::new() }
    }
}

/// A call within a function, with the origin of each pointer that is passed to it.
struct Passed {
    called: Option<SymbolId>,
    arguments: Vec<Passing>,
}

#[derive(Clone, Copy)]
enum Passing {
    /// The pointer leads to an object of the caller itself.
    Own,
    /// The pointer comes from the parameter of the caller with this index.
    Param(usize),
    Other,
}

/// The effects of each function of a unit; the entries of all other symbols are empty. A function without a body may write anything, and so may a call through
/// a pointer.
#[must_use]
pub fn effects(unit: &Unit, index: &Index) -> IdMap<Symbol, Summary> {
    let mut effects = IdMap::build(&unit.symbols, |_, symbol| {
        Summary::new(match &symbol.kind {
            SymbolKind::Function(kind) if kind.is_pure => Effect::Reads,
            SymbolKind::Function(_) => Effect::Writes,
            SymbolKind::Object { .. }
            | SymbolKind::Local { .. }
            | SymbolKind::Parameter
            | SymbolKind::Typedef
            | SymbolKind::Constant(_) => Effect::None,
        })
    });
    let mut calls: BTreeMap<SymbolId, Vec<Passed>> = BTreeMap::new();
    let mut callers: IdMap<Symbol, Vec<SymbolId>> = IdMap::filled(&unit.symbols, Vec::new());
    each_item(&unit.items, &mut |item| {
        let ItemKind::Function { symbol, params, body } = &item.kind else { return };
        let (summary, passed) = own_effects(unit, index, params, body);
        effects[*symbol] = summary;
        for one in passed.iter().filter_map(|one| one.called) {
            callers[one].push(*symbol);
        }
        calls.insert(*symbol, passed);
    });
    // A function has the effects of the functions that it calls; each summary can grow only a few times.
    let mut changed: Vec<SymbolId> = calls.keys().rev().copied().collect();
    while let Some(id) = changed.pop() {
        let mut summary = effects[id].clone();
        for call in calls.get(&id).into_iter().flatten() {
            let called = call.called.map_or(Summary::new(Effect::Writes), |id| effects[id].clone());
            summary.effect = summary.effect.max(called.effect);
            for param in called.written {
                match call.arguments.get(param) {
                    Some(Passing::Own) => {}
                    Some(Passing::Param(own)) => {
                        summary.written.insert(*own);
                    }
                    Some(Passing::Other) | None => summary.effect = Effect::Writes,
                }
            }
        }
        if summary != effects[id] {
            effects[id] = summary;
            changed.extend(callers[id].iter().copied());
        }
    }
    effects
}

/// The effects of a function without those of the functions that it calls, and the pointers that it passes to them.
fn own_effects(
    unit: &Unit,
    index: &Index,
    params: &[SymbolId],
    body: &[Stmt],
) -> (Summary, Vec<Passed>) {
    let found = Accesses::of_body(body);
    let mut summary = Summary::new(Effect::None);
    for place in found.reads {
        if !is_own(unit, place) && !is_table(unit, place) {
            summary.effect = summary.effect.max(Effect::Reads);
        }
    }
    // A parameter that always has the value that the caller passed.
    let fixed = |id: &SymbolId| {
        let uses = &index.uses[*id];
        uses.writes.is_empty() && uses.addresses.is_empty()
    };
    let param = |pointer: &Expr| {
        let ExprKind::Read(place) = &pointer.kind else { return None };
        let PlaceKind::Symbol(id) = place.kind else { return None };
        params.iter().position(|param| *param == id).filter(|_| fixed(&id))
    };
    for place in found.writes {
        match pointer_of(place) {
            None if is_own(unit, place) => {}
            None => summary.effect = Effect::Writes,
            Some(pointer) => match param(pointer) {
                Some(at) => {
                    summary.written.insert(at);
                }
                None => summary.effect = Effect::Writes,
            },
        }
    }
    let is_unknown = |stmt: &Stmt| matches!(stmt.kind, StmtKind::Opaque(_) | StmtKind::Barrier);
    each_stmt(body, &mut |stmt| {
        if is_unknown(stmt) {
            summary.effect = Effect::Writes;
        }
    });
    let passing = |argument: &Expr| {
        if let ExprKind::Address(place) | ExprKind::Decay(place) = &argument.kind
            && is_own(unit, place)
        {
            return Passing::Own;
        }
        param(argument).map_or(Passing::Other, Passing::Param)
    };
    let passed = |call: &Called| Passed {
        called: call.function,
        arguments: call.arguments.iter().map(passing).collect(),
    };
    let passed = found.calls.iter().map(passed).collect();
    (summary, passed)
}

/// True for objects that exist once for each call.
fn is_own(unit: &Unit, place: &Place) -> bool {
    place.object().is_some_and(|id| {
        matches!(
            unit.symbols[id].kind,
            SymbolKind::Local { is_static: false } | SymbolKind::Parameter
        )
    })
}

/// True for objects that never change.
fn is_table(unit: &Unit, place: &Place) -> bool {
    let is_constant = place.qualifiers.is_const && !place.qualifiers.is_volatile;
    let is_object = |id: SymbolId| matches!(unit.symbols[id].kind, SymbolKind::Object { .. });
    is_constant && place.object().is_some_and(is_object)
}

/// The pointer that is followed to reach a place, if there is one.
fn pointer_of(place: &Place) -> Option<&Expr> {
    match &place.kind {
        PlaceKind::Symbol(_) => None,
        PlaceKind::Member(base, _) | PlaceKind::Element(base, _) => pointer_of(base),
        PlaceKind::At(pointer, _) | PlaceKind::Deref(pointer) => Some(pointer),
    }
}

/// True if two places may share memory. Different members never do, nor do different objects; objects of different types do not, unless one of them consists
/// of characters (C99 6.5p7).
#[must_use]
pub fn may_overlap(unit: &Unit, index: &Index, a: &Place, b: &Place) -> bool {
    match (a.object(), b.object()) {
        (Some(x), Some(y)) => x == y && parts_may_overlap(unit, a, b),
        (Some(own), None) if !index.is_shared(unit, own) => false,
        (None, Some(own)) if !index.is_shared(unit, own) => false,
        // Two objects of one type are the same or disjoint.
        _ if root_type(a) == root_type(b) => parts_may_overlap(unit, a, b),
        _ => members_may_overlap(a, b) && types_may_overlap(unit, &a.ty, &b.ty),
    }
}

/// The type of the object, or of the target of a pointer, that the place is a part of.
fn root_type(place: &Place) -> &Type {
    let mut at = place;
    while let PlaceKind::Member(base, _) | PlaceKind::Element(base, _) = &at.kind {
        at = base;
    }
    &at.ty
}

/// True if two parts of one object may share memory.
fn parts_may_overlap(unit: &Unit, a: &Place, b: &Place) -> bool {
    let (a, b) = (steps(a), steps(b));
    for (x, y) in a.iter().zip(&b) {
        match (&x.kind, &y.kind) {
            (PlaceKind::Member(_, x), PlaceKind::Member(_, y)) if x != y => return false,
            (PlaceKind::Element(_, x), PlaceKind::Element(_, y)) => {
                if let (Some(x), Some(y)) = (unit.constant(x), unit.constant(y))
                    && x != y
                {
                    return false;
                }
            }
            _ => {}
        }
    }
    true
}

/// The members and elements from the object inwards.
fn steps(place: &Place) -> Vec<&Place> {
    let mut all = Vec::new();
    let mut at = place;
    while let PlaceKind::Member(base, _) | PlaceKind::Element(base, _) = &at.kind {
        all.push(at);
        at = base;
    }
    all.reverse();
    all
}

/// False if the paths differ in a member of one structure type: different members, and the elements in them, never share memory.
fn members_may_overlap(a: &Place, b: &Place) -> bool {
    fn innermost(place: &Place) -> Option<(&Type, usize)> {
        let mut at = place;
        loop {
            match &at.kind {
                PlaceKind::Member(base, index) => return Some((&base.ty, *index)),
                PlaceKind::Element(base, _) => at = base,
                PlaceKind::Symbol(_) | PlaceKind::At(..) | PlaceKind::Deref(_) => return None,
            }
        }
    }
    match (innermost(a), innermost(b)) {
        (Some((x, i)), Some((y, j))) => x != y || i == j,
        _ => true,
    }
}

fn types_may_overlap(unit: &Unit, a: &Type, b: &Type) -> bool {
    match (unit.integer(a), unit.integer(b)) {
        (Some(x), Some(y)) => {
            let is_character = |kind: IntKind| kind.rank() == IntKind::Char.rank();
            is_character(x) || is_character(y) || x.unsigned() == y.unsigned()
        }
        // A pointer and a number share memory only if the number is a character. Structures and arrays may contain an object of the other type.
        (Some(x), None) if matches!(b, Type::Pointer(_)) => x.rank() == IntKind::Char.rank(),
        (None, Some(y)) if matches!(a, Type::Pointer(_)) => y.rank() == IntKind::Char.rank(),
        _ => true,
    }
}
