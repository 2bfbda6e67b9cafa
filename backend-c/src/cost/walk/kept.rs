//! Finds the structures that a compiler keeps in registers, member by member.
//!
//! gcc replaces a local structure of numbers by one variable for each member (`-ftree-sra`, part of `-O1` and above) if only its members are ever used.
//! A pointer to it that is passed to a part of the function (see [`super::parts`]) is replaced too, if the part also uses only its members.

use super::super::tree::{Expr, Function, Kind, Stmt, Type, Unit, each_expr, each_inner, names_in};
use grafsynth_ir::Gather;
use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

/// The structure that an argument passes by its address: `&name`, or `name` if it is already a pointer.
pub(super) fn handed(argument: &Expr) -> Option<&Rc<str>> {
    let argument = if let Expr::Unary("&", inner) = argument { inner } else { argument };
    if let Expr::Name(name) = argument { Some(name) } else { None }
}

/// For each function, callees first, the names of its structures that are in registers, and of its pointers to such structures. `parts` are the
/// functions that are part of their only caller, by name, each with its index, its caller's index, and its arguments.
pub(super) fn kept(
    unit: &Unit,
    functions: &[&Function],
    parts: &BTreeMap<&str, (usize, usize, &[Expr])>,
) -> Vec<BTreeSet<Rc<str>>> {
    let mut all: Vec<BTreeSet<Rc<str>>> = Vec::with_capacity(functions.len());
    for (at, function) in functions.iter().enumerate() {
        let may_take = |name: &str, place: usize| {
            let taken = parts.get(name).and_then(|(callee, ..)| {
                let (parameter, _) = functions.get(*callee)?.parameters.get(place)?;
                Some(all.get(*callee)?.contains(parameter))
            });
            taken == Some(true)
        };
        let is_part = parts.get(&*function.name).is_some_and(|(own, ..)| *own == at);
        let is_pointer =
            |ty: &Type| matches!(ty, Type::Pointer(inner, false) if is_numbers(unit, inner));
        let pointers = function.parameters.iter().filter(|(_, ty)| is_part && is_pointer(ty));
        let pointers = pointers.map(|(name, _)| name.clone());
        let mut declared: BTreeMap<Rc<str>, (u32, bool)> = BTreeMap::new();
        function.parameters.iter().for_each(|(name, _)| {
            declared.insert(name.clone(), (1, false));
        });
        each_local(&function.body, &mut |name, ty, is_open| {
            let entry = declared.entry(name.clone()).or_default();
            *entry = (entry.0 + 1, is_open && is_numbers(unit, ty));
        });
        let structures =
            declared.iter().filter(|(_, (n, fits))| *n == 1 && *fits).map(|(name, _)| name.clone());
        let found = pointers.chain(structures).filter(|name| {
            let mut is_kept = true;
            each_expr(&function.body, &mut |it| is_kept &= asks_members(it, name, &may_take));
            is_kept
        });
        let found = found.gather();
        all.push(found);
    }
    // A pointer leads to a structure of its caller. Callers come last, so their own pointers are decided first.
    for (at, function) in functions.iter().enumerate().rev() {
        let Some((_, caller, arguments)) = parts.get(&*function.name) else { continue };
        for ((name, _), argument) in function.parameters.iter().zip(*arguments) {
            let of_caller = all.get(*caller);
            let is_kept = handed(argument).zip(of_caller).is_some_and(|(it, of)| of.contains(it));
            if let (false, Some(own)) = (is_kept, all.get_mut(at)) {
                own.remove(name);
            }
        }
    }
    all
}

/// Bytes that the members of such a structure take in registers of the given size.
pub(super) fn bytes(unit: &Unit, ty: &Type, register: u32) -> u64 {
    let members = unit.members(ty).unwrap_or_default();
    let of = |ty: &Type| if let Type::Number { bits, .. } = ty { u64::from(bits / 8) } else { 0 };
    members.iter().map(|it| of(&it.ty).max(u64::from(register))).sum()
}

/// True for a structure that contains only numbers.
fn is_numbers(unit: &Unit, ty: &Type) -> bool {
    let is_number = |ty: &Type| matches!(ty, Type::Number { .. });
    matches!(ty, Type::Struct(_))
        && unit.members(ty).is_some_and(|all| all.iter().all(|it| is_number(&it.ty)))
}

/// Calls `look` for each local, with its type and whether it is uninitialised.
pub(super) fn each_local(list: &[Stmt], look: &mut dyn FnMut(&Rc<str>, &Type, bool)) {
    for stmt in list {
        match &stmt.kind {
            Kind::Local { name, ty, init, .. } => look(name, ty, init.is_none()),
            Kind::If(arms, otherwise) => {
                arms.iter().for_each(|(_, body)| each_local(body, look));
                each_local(otherwise, look);
            }
            Kind::Switch(_, sections) => {
                sections.iter().for_each(|(_, body)| each_local(body, look));
            }
            Kind::Loop { init, body, .. } => {
                init.iter().for_each(|it| each_local(std::slice::from_ref(it), look));
                each_local(body, look);
            }
            Kind::Block(body) => each_local(body, look),
            Kind::Expr(_) | Kind::Return(_) | Kind::Break | Kind::Continue | Kind::UserCode => {}
        }
    }
}

/// True if an expression uses only the members of a structure, or passes it to a function that may receive it.
fn asks_members(expr: &Expr, name: &Rc<str>, may_take: &dyn Fn(&str, usize) -> bool) -> bool {
    let again = |it: &Expr| asks_members(it, name, may_take);
    if let Expr::Name(it) = expr {
        return it != name;
    }
    if let Expr::Member(base, _) = expr
        && matches!(&**base, Expr::Name(it) if it == name)
    {
        return true;
    }
    if let Expr::Call(callee, arguments) = expr {
        return arguments.iter().enumerate().all(|(place, argument)| {
            if handed(argument) == Some(name) { may_take(callee, place) } else { again(argument) }
        });
    }
    let mut is_kept = true;
    if let Expr::Unary("&", inner) = expr {
        names_in(inner, &mut |it| is_kept &= *it != **name);
    }
    each_inner(expr, &mut |it| is_kept &= again(it));
    is_kept
}
