//! The data that a function needs at the same time. It decides how many registers the function saves and how much stack it uses.

use super::super::machine::Machine;
use super::super::memory::size;
use super::super::tree::{Expr, Function, Kind, Stmt, Type, Unit};
use super::live::Live;
use std::collections::BTreeMap;
use std::rc::Rc;

/// An expression with parameters replaced by arguments.
pub(super) fn replaced(expr: &Expr, arguments: &BTreeMap<&str, &Expr>) -> Expr {
    let again = |it: &Expr| Box::new(replaced(it, arguments));
    match expr {
        Expr::Name(name) => match arguments.get(&**name) {
            Some(argument) => Expr::clone(argument),
            None => expr.clone(),
        },
        Expr::Member(base, name) => Expr::Member(again(base), name.clone()),
        Expr::Index(a, b) => Expr::Index(again(a), again(b)),
        Expr::Call(name, all) => {
            Expr::Call(name.clone(), all.iter().map(|it| replaced(it, arguments)).collect())
        }
        Expr::Unary(sign, inner) => Expr::Unary(sign, again(inner)),
        Expr::Count(inner) => Expr::Count(again(inner)),
        Expr::Binary(sign, a, b) => Expr::Binary(sign, again(a), again(b)),
        Expr::Assign(sign, a, b) => Expr::Assign(*sign, again(a), again(b)),
        Expr::Choice(a, b, c) => Expr::Choice(again(a), again(b), again(c)),
        Expr::Cast(ty, inner) => Expr::Cast(ty.clone(), again(inner)),
        Expr::Number(_) | Expr::List(_) | Expr::Nothing => expr.clone(),
    }
}

/// True if a function only returns the value of an expression.
pub(super) fn is_one_return(function: &Function) -> bool {
    matches!(function.body.as_slice(), [Stmt { kind: Kind::Return(Some(_)), .. }])
}

/// The data that a function needs: bytes in registers if there are enough, and bytes in memory.
#[derive(Debug, Default)]
pub(super) struct Frame {
    pub(super) registers: u64,
    pub(super) memory: u64,
    /// The bytes in registers that are live at the same time.
    pub(super) live: Live,
    pub(super) pointers: u32,
    /// How often each member is read on a straight path: a compiler keeps a value that is read again.
    pub(super) reads: BTreeMap<(Rc<str>, Rc<str>), u32>,
    /// The width in bits of the widest computation.
    pub(super) widest: u8,
    pub(super) calls: bool,
    /// The called functions, with the number of call sites.
    pub(super) called: BTreeMap<Rc<str>, u64>,
    /// The arguments of each called function, at the last call site.
    pub(super) arguments: BTreeMap<Rc<str>, Vec<Expr>>,
}

impl Frame {
    /// The frame of a whole function.
    pub(super) fn of(unit: &Unit, machine: &Machine, function: &Function) -> Frame {
        let mut frame = Frame::default();
        for (_, ty) in &function.parameters {
            frame.add(unit, machine, ty);
        }
        frame.look(unit, machine, &function.body);
        frame.kept(&function.body);
        frame.live = Live::of(unit, machine, function);
        frame
    }

    fn add(&mut self, unit: &Unit, machine: &Machine, ty: &Type) {
        let bytes = size(unit, machine, ty);
        match ty {
            Type::Number { .. } | Type::Pointer(..) => {
                self.registers += bytes.max(u64::from(machine.register));
                self.pointers += u32::from(matches!(ty, Type::Pointer(..)));
            }
            Type::Array(..) | Type::Struct(_) => self.memory += bytes,
            Type::Void => {}
        }
    }

    fn look(&mut self, unit: &Unit, machine: &Machine, list: &[Stmt]) {
        for stmt in list {
            match &stmt.kind {
                Kind::Expr(expr) | Kind::Return(Some(expr)) => self.expr(expr),
                Kind::Local { ty, init, rom, .. } => {
                    if !rom {
                        self.add(unit, machine, ty);
                    }
                    init.iter().for_each(|init| self.expr(init));
                }
                Kind::If(arms, otherwise) => {
                    for (condition, body) in arms {
                        self.expr(condition);
                        self.look(unit, machine, body);
                    }
                    self.look(unit, machine, otherwise);
                }
                Kind::Switch(subject, sections) => {
                    self.expr(subject);
                    sections.iter().for_each(|(_, body)| self.look(unit, machine, body));
                }
                Kind::Loop { init, condition, step, body } => {
                    if let Some(init) = init {
                        self.look(unit, machine, std::slice::from_ref(init));
                    }
                    condition.iter().chain(step).for_each(|expr| self.expr(expr));
                    self.look(unit, machine, body);
                }
                Kind::Block(body) => self.look(unit, machine, body),
                Kind::UserCode => self.calls = true,
                Kind::Return(None) | Kind::Break | Kind::Continue => {}
            }
        }
    }

    fn kept(&mut self, list: &[Stmt]) {
        for stmt in list {
            match &stmt.kind {
                Kind::Expr(expr) | Kind::Return(Some(expr)) => self.read(expr),
                Kind::Local { init, .. } => init.iter().for_each(|init| self.read(init)),
                Kind::If(arms, _) => {
                    arms.iter().take(1).for_each(|(condition, _)| self.read(condition))
                }
                Kind::Switch(subject, _) => self.read(subject),
                Kind::Loop { condition, body, .. } => {
                    condition.iter().for_each(|condition| self.read(condition));
                    self.kept(body);
                }
                Kind::Block(body) => self.kept(body),
                Kind::Return(None) | Kind::Break | Kind::Continue | Kind::UserCode => {}
            }
        }
    }

    fn read(&mut self, expr: &Expr) {
        match expr {
            Expr::Member(base, name) => {
                if let Expr::Name(base) = &**base {
                    *self.reads.entry((base.clone(), name.clone())).or_default() += 1;
                } else {
                    self.read(base);
                }
            }
            Expr::Assign(operator, left, right) => {
                if operator.is_some() {
                    self.read(left);
                }
                self.read(right);
            }
            Expr::Call(_, arguments) => arguments.iter().for_each(|it| self.read(it)),
            Expr::Cast(_, inner) | Expr::Unary(_, inner) | Expr::Count(inner) => self.read(inner),
            Expr::Index(a, b) | Expr::Binary(_, a, b) => {
                self.read(a);
                self.read(b);
            }
            Expr::Choice(a, b, c) => [a, b, c].into_iter().for_each(|it| self.read(it)),
            Expr::Number(_) | Expr::Name(_) | Expr::List(_) | Expr::Nothing => {}
        }
    }

    /// The called functions of a function, without the rest of its frame.
    pub(super) fn calls_of(
        unit: &Unit,
        machine: &Machine,
        list: &[Stmt],
    ) -> BTreeMap<Rc<str>, u64> {
        let mut frame = Frame::default();
        frame.look(unit, machine, list);
        frame.called
    }

    fn expr(&mut self, expr: &Expr) {
        match expr {
            Expr::Call(name, arguments) => {
                self.calls = true;
                *self.called.entry(name.clone()).or_default() += 1;
                self.arguments.insert(name.clone(), arguments.clone());
                arguments.iter().for_each(|it| self.expr(it));
            }
            Expr::Cast(ty, inner) => {
                if let Type::Number { bits, .. } = ty {
                    self.widest = self.widest.max(*bits);
                }
                self.expr(inner);
            }
            Expr::Member(inner, _) | Expr::Unary(_, inner) | Expr::Count(inner) => self.expr(inner),
            Expr::Index(a, b) | Expr::Binary(_, a, b) | Expr::Assign(_, a, b) => {
                self.expr(a);
                self.expr(b);
            }
            Expr::Choice(a, b, c) => [a, b, c].into_iter().for_each(|it| self.expr(it)),
            Expr::Number(_) | Expr::Name(_) | Expr::List(_) | Expr::Nothing => {}
        }
    }
}
