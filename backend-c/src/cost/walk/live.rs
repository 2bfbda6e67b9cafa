//! The number of bytes of locals that are live at the same time in a function: each local is live from its declaration to its last use.
//!
//! A local that is declared before a loop and used in it is live to the end of the loop. Registers that a compiler needs besides those of the locals are not
//! counted here.

use super::super::machine::Machine;
use super::super::memory::size;
use super::super::tree::{Expr, Function, Kind, Stmt, Type, Unit, each_call, names_in};
use std::collections::BTreeMap;
use std::rc::Rc;

/// Bytes of locals that are live at the same time.
#[derive(Debug, Clone, Default)]
pub(super) struct Live {
    /// The maximum in the whole function.
    pub(super) most: u64,
    /// For each called function, the maximum at its calls.
    pub(super) at_calls: BTreeMap<Rc<str>, u64>,
}

impl Live {
    pub(super) fn of(unit: &Unit, machine: &Machine, function: &Function) -> Live {
        let mut spans = Spans::new(unit, machine);
        for (name, ty) in &function.parameters {
            spans.declare(name, ty);
        }
        spans.list(&function.body);
        // The bytes whose lifetimes begin and end at each position.
        let mut changes = vec![(0_u64, 0_u64); spans.at + 2];
        for span in &spans.all {
            changes[span.first].0 += span.bytes;
            changes[span.last + 1].1 += span.bytes;
        }
        let mut live = Live::default();
        let mut now = 0;
        let mut calls = spans.calls.iter().peekable();
        for (at, (begun, ended)) in changes.into_iter().enumerate() {
            now = now + begun - ended;
            live.most = live.most.max(now);
            while let Some((_, name)) = calls.next_if(|(place, _)| *place == at) {
                let most = live.at_calls.entry(name.clone()).or_default();
                *most = now.max(*most);
            }
        }
        live
    }
}

/// A local: the positions of its declaration and of its last use.
struct Span {
    bytes: u64,
    first: usize,
    last: usize,
}

struct Spans<'a> {
    unit: &'a Unit,
    machine: &'a Machine,
    /// The current position; each expression has one.
    at: usize,
    all: Vec<Span>,
    /// For each name, the locals of that name in scope, the innermost last.
    around: BTreeMap<Rc<str>, Vec<usize>>,
    declared: Vec<Rc<str>>,
    /// Calls with their positions, in that order.
    calls: Vec<(usize, Rc<str>)>,
}

impl<'a> Spans<'a> {
    fn new(unit: &'a Unit, machine: &'a Machine) -> Self {
        Spans {
            unit,
            machine,
            at: 0,
            all: Vec::new(),
            around: BTreeMap::new(),
            declared: Vec::new(),
            calls: Vec::new(),
        }
    }

    fn declare(&mut self, name: &Rc<str>, ty: &Type) {
        let bytes = match ty {
            Type::Number { .. } | Type::Pointer(..) => {
                size(self.unit, self.machine, ty).max(u64::from(self.machine.register))
            }
            Type::Void | Type::Array(..) | Type::Struct(_) => 0,
        };
        self.around.entry(name.clone()).or_default().push(self.all.len());
        self.declared.push(name.clone());
        self.all.push(Span { bytes, first: self.at, last: self.at });
    }

    fn expr(&mut self, expr: &Expr) {
        self.at += 1;
        let at = self.at;
        names_in(expr, &mut |name| {
            let local = self.around.get(name).and_then(|all| all.last());
            if let Some(span) = local.and_then(|local| self.all.get_mut(*local)) {
                span.last = at;
            }
        });
        each_call(expr, &mut |name| self.calls.push((at, name.clone())));
    }

    /// Visits the statements in braces: their locals are not visible after them.
    fn list(&mut self, list: &[Stmt]) {
        let n = self.declared.len();
        list.iter().for_each(|it| self.stmt(it));
        self.leave(n);
    }

    /// Ends the scope of all locals after the first `n`.
    fn leave(&mut self, n: usize) {
        for name in self.declared.split_off(n) {
            if let Some(all) = self.around.get_mut(&name) {
                all.pop();
            }
        }
    }

    fn stmt(&mut self, stmt: &Stmt) {
        match &stmt.kind {
            Kind::Expr(expr) | Kind::Return(Some(expr)) => self.expr(expr),
            Kind::Local { name, ty, init, .. } => {
                init.iter().for_each(|it| self.expr(it));
                self.declare(name, ty);
            }
            Kind::If(arms, otherwise) => {
                for (condition, body) in arms {
                    self.expr(condition);
                    self.list(body);
                }
                self.list(otherwise);
            }
            Kind::Switch(subject, sections) => {
                self.expr(subject);
                sections.iter().for_each(|(_, body)| self.list(body));
            }
            Kind::Loop { init, condition, step, body } => {
                let n = self.declared.len();
                init.iter().for_each(|it| self.stmt(it));
                let begin = self.at;
                condition.iter().for_each(|it| self.expr(it));
                self.list(body);
                step.iter().for_each(|it| self.expr(it));
                let end = self.at;
                let is_around = |it: &&mut Span| it.first <= begin && it.last > begin;
                self.all.iter_mut().filter(is_around).for_each(|it| it.last = end);
                self.leave(n);
            }
            Kind::Block(body) => self.list(body),
            Kind::Return(None) | Kind::Break | Kind::Continue | Kind::UserCode => {}
        }
    }
}
