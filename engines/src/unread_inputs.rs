//! The inputs that emitted C cannot read, found in its text: an input that neither the chart nor the C reads needs only one value in an enumeration.
//!
//! The text is read by the C parser, which knows nothing of the back end. Whatever is not a read of one member of the input structure through a
//! variable counts as a read of all inputs: copies of the structure (the gate compares one), C written by the user, a pointer that is stored, converted
//! or passed to a function that is not in the text, a call through a pointer.

use grafsynth_backend_c::Package;
use grafsynth_c::tree::types::Type;
use grafsynth_c::tree::{Callee, Expr, ExprKind, ItemKind, Place, PlaceKind, StructId, SymbolId};
use grafsynth_c::walk::{Full, Node, each_full, each_item, expr_parts, init_values, place_parts};
use grafsynth_c::{Config, Input, parse};
use grafsynth_ir::Gather;
use grafsynth_ir::net::Net;
use std::collections::{BTreeMap, BTreeSet};

/// The names of the members of the input structure that no reaction of the C of a package reads. Inputs that are bits of a word are not members.
pub(crate) fn unread_inputs(net: &Net, package: &Package) -> BTreeSet<String> {
    if !net.c_texts().is_empty() {
        return BTreeSet::new();
    }
    unread(package).unwrap_or_default()
}

/// Like [`unread_inputs`]; `None` if a reaction may read all.
fn unread(package: &Package) -> Option<BTreeSet<String>> {
    let files = package.sources();
    if files.first()?.name != format!("{}.c", package.stem()) {
        return None;
    }
    let config = Config::host();
    let (unit, _) = parse(&Input { files: &files, verbatim: &[], readers: &[], config: &config });
    let unit = unit?;
    let name = format!("{}_in_t", package.prefix());
    let symbol = unit.symbols.values().find(|symbol| symbol.name == name)?;
    let Type::Struct(inputs) = symbol.canonical.ty else { return None };
    let mut found: BTreeMap<SymbolId, Reads> = BTreeMap::new();
    each_item(&unit.items, &mut |item| {
        if let ItemKind::Function { symbol, .. } = &item.kind {
            found.insert(*symbol, Reads::default());
        }
    });
    let defined: BTreeSet<SymbolId> = found.keys().copied().gather();
    each_full(&unit, &mut |function, full| {
        // Constant tables read nothing.
        let Some(reads) = function.and_then(|function| found.get_mut(&function)) else { return };
        let mut search = Search { inputs, defined: &defined, reads };
        match full {
            Full::Expr(expr) => search.expr(expr),
            Full::Init(_, init) => init_values(init, &mut |value| search.expr(value)),
        }
    });
    // Only what a reaction can call counts: the header also has functions that copy inputs, for interrupts.
    let step = format!("{}_step", package.prefix());
    let mut todo: Vec<SymbolId> =
        defined.iter().copied().filter(|id| unit.symbols[*id].name == step).collect();
    let mut reached: BTreeSet<SymbolId> = BTreeSet::new();
    let mut members: BTreeSet<usize> = BTreeSet::new();
    if todo.is_empty() {
        return None;
    }
    while let Some(function) = todo.pop() {
        let Some(reads) = found.get(&function) else { continue };
        if reached.insert(function) {
            if reads.all {
                return None;
            }
            members.extend(&reads.members);
            todo.extend(&reads.calls);
        }
    }
    let all = unit.structs[inputs].members.iter().enumerate();
    Some(all.filter(|(at, _)| !members.contains(at)).map(|(_, it)| it.name.clone()).gather())
}

/// The members of the structure that one function reads.
#[derive(Default)]
struct Reads {
    /// The members that are read, by their index.
    members: BTreeSet<usize>,
    /// True if something may read any input.
    all: bool,
    /// The functions of the text that it calls.
    calls: BTreeSet<SymbolId>,
}

struct Search<'a> {
    inputs: StructId,
    /// The functions with a body in the text.
    defined: &'a BTreeSet<SymbolId>,
    reads: &'a mut Reads,
}

impl Search<'_> {
    fn is_structure(&self, ty: &Type) -> bool {
        *ty == Type::Struct(self.inputs)
    }

    fn is_pointer(&self, ty: &Type) -> bool {
        matches!(ty, Type::Pointer(target) if self.is_structure(&target.ty))
    }

    /// True for the parameter (or another variable) that points to the structure.
    fn is_variable(&self, expr: &Expr) -> bool {
        matches!(&expr.kind, ExprKind::Read(place) if matches!(place.kind, PlaceKind::Symbol(_)))
            && self.is_pointer(&expr.ty)
    }

    /// True for a member of the structure, or a part of one.
    fn is_part(&self, place: &Place) -> bool {
        match &place.kind {
            PlaceKind::Member(base, _) | PlaceKind::Element(base, _) => {
                self.is_structure(&base.ty) || self.is_part(base)
            }
            PlaceKind::Symbol(_) | PlaceKind::At(..) | PlaceKind::Deref(_) => false,
        }
    }

    fn node(&mut self, node: Node<'_>) {
        match node {
            Node::Expr(expr) => self.expr(expr),
            Node::Place(place) => self.place(place),
        }
    }

    fn expr(&mut self, expr: &Expr) {
        if let ExprKind::Call(Callee::Function(function), arguments) = &expr.kind
            && self.defined.contains(function)
        {
            // The body of the function is searched too.
            self.reads.calls.insert(*function);
            let other = arguments.iter().filter(|argument| !self.is_variable(argument));
            other.collect::<Vec<_>>().into_iter().for_each(|argument| self.expr(argument));
            return;
        }
        self.reads.all |= matches!(&expr.kind, ExprKind::Call(Callee::Pointer(_), _));
        // From the address of a member, all others can be reached.
        let is_address = matches!(
            &expr.kind,
            ExprKind::Address(place) | ExprKind::Decay(place)
                if self.is_pointer(&place.ty) || self.is_part(place)
        );
        self.reads.all |= is_address || self.is_pointer(&expr.ty) || self.is_structure(&expr.ty);
        expr_parts(expr, &mut |part| self.node(part));
    }

    fn place(&mut self, place: &Place) {
        if let PlaceKind::Member(base, member) = &place.kind
            && self.is_structure(&base.ty)
        {
            match &base.kind {
                PlaceKind::Deref(pointer) if self.is_variable(pointer) => {
                    self.reads.members.insert(*member);
                }
                _ => self.reads.all = true,
            }
            return;
        }
        self.reads.all |= self.is_structure(&place.ty);
        place_parts(place, &mut |part| self.node(part));
    }
}
