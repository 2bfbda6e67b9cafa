//! The loop of a chart that performs what its byte code requests.
//!
//! The engine returns to the chart at each request, and the chart calls it again: code and loop are coroutines. Each request is at a place of the code that is
//! known, so here the code calls the loop instead: at a request, the body is executed once, on the path and in the memory of this place, and the code goes on.
//! This needs a loop of one form: a local takes the result of the first call, the loop ends when its condition says so, which must be exactly at the end of the
//! code, and its last statement takes the result of the next call.
//!
//! How far the engine is, and its stack except arguments, has no value meanwhile: the loop must not read it, and must leave it and the pointers as they are.

use std::rc::Rc;

use grafsynth_c::tree::{Callee, Expr, ExprKind, Init, PlaceKind, Stmt, StmtKind, SymbolId};

use super::exec::{Done, Program};
use super::machine::{DONE, EngineFunction, Machine, Request, Served, ServingLoop, Structure, put};
use super::memory::{Cell, Memory, Object, Scalar, member_offset, n_cells, whole};
use super::value::Int;
use crate::symbolic::aig::Lit;

/// The members of the machine that change from one instruction to the next.
const PROGRESS: [&str; 5] = ["at", "depth", "loops", "rounds", "begins"];
/// The members that the loop may use: what the machine stores in them, and what the next instruction reads from them.
const SHARED: [&str; 4] = ["number", "stack", "dt", "fault"];

impl<'u> Program<'u> {
    /// The loop that two consecutive statements are, if they have the form of one.
    pub(super) fn serving_loop(
        &self,
        start: &'u Stmt,
        rounds: &'u Stmt,
    ) -> Option<ServingLoop<'u>> {
        self.engine?;
        let StmtKind::Define { symbol: wants, init: Some(Init::Value(value)) } = &start.kind else {
            return None;
        };
        let (engine, first) = self.continues(value)?;
        let StmtKind::While { condition, body } = &rounds.kind else { return None };
        let (last, body) = body.split_last()?;
        let StmtKind::Expr(Expr { kind: ExprKind::Assign(place, value), .. }) = &last.kind else {
            return None;
        };
        let (_, next) = self.continues(value)?;
        let is_same = matches!(place.kind, PlaceKind::Symbol(symbol) if symbol == *wants);
        is_same.then_some(ServingLoop { engine, wants: *wants, condition, body, first, next })
    }

    /// The function and the argument of a call that continues the code.
    fn continues(&self, value: &'u Expr) -> Option<(SymbolId, &'u Expr)> {
        let ExprKind::Call(Callee::Function(function), arguments) = &value.kind else {
            return None;
        };
        let which = EngineFunction::named(&self.unit.symbols[*function].name);
        match arguments.as_slice() {
            [run] if which == Some(EngineFunction::Go) => Some((*function, run)),
            _ => None,
        }
    }

    /// Executes the code with the loop that performs its requests.
    pub(super) fn serve(&mut self, by: ServingLoop<'u>, mut memory: Memory) -> Done<Memory> {
        let run = self.scalar(by.first, &mut memory)?;
        let object = self.object(&mut memory, Cell::unset(1));
        let Object::Changing(wants) = object else { return Ok(memory) };
        if let Some(frame) = self.frames.last_mut() {
            frame.insert(by.wants, object);
        }
        let mut machine = self.machine(by.engine, std::slice::from_ref(&run), &memory)?;
        machine.served = Some(Served { by, wants, run });
        self.go(&machine, &mut memory)?;
        match self.goes_on(by, wants, DONE, &mut memory)?.as_constant() {
            Some(false) => Ok(memory),
            _ => Err("the loop around the engine goes on after the end of the code".to_owned()),
        }
    }

    /// Stores what the engine returns. Returns the condition of the loop.
    fn goes_on(
        &mut self,
        by: ServingLoop<'u>,
        wants: usize,
        value: i128,
        memory: &mut Memory,
    ) -> Done<Lit> {
        memory.put(wants, 0, Rc::new(Cell::of(Scalar::Int(Int::constant(value)))));
        self.truth(by.condition, memory)
    }

    /// Performs a request: executes the body of the loop once.
    pub(super) fn serve_once(
        &mut self,
        machine: &Machine<'u>,
        request: Request,
        mut memory: Memory,
    ) -> Done<Memory> {
        let Some(served) = &machine.served else {
            return Err("byte code calls functions, but not in a loop around `gp_go`".to_owned());
        };
        let run = &machine.run;
        let number = self.member(run, "number")?;
        put(&mut memory, number, Int::constant(request.number as i128))?;
        self.forget(run, "stack", &mut memory)?;
        let stack = self.member(run, "stack")?;
        for (at, argument) in request.arguments.into_iter().enumerate() {
            put(&mut memory, stack.behind(at), argument)?;
        }
        let wanted = i128::from(request.wanted);
        let goes_on = self.goes_on(served.by, served.wants, wanted, &mut memory)?;
        if goes_on.as_constant() != Some(true) {
            return Err("the loop around the engine ends before the end of the code".to_owned());
        }
        let before = memory.clone();
        let mut memory = self.once(served.by.body, memory)?;
        if self.scalar(served.by.next, &mut memory)? != served.run {
            return Err("the engine continues with another machine".to_owned());
        }
        self.keeps_machine(run, &before, &memory)?;
        Ok(memory)
    }

    /// Takes the values of the members that show how far the machine is.
    pub(super) fn hide_progress(&self, run: &Structure, memory: &mut Memory) -> Done<()> {
        PROGRESS.iter().try_for_each(|name| self.forget(run, name, memory))
    }

    /// Takes the arguments of the last request.
    pub(super) fn hide_arguments(&self, machine: &Machine<'u>, memory: &mut Memory) -> Done<()> {
        match machine.served.is_some() {
            true => self.forget(&machine.run, "stack", memory),
            false => Ok(()),
        }
    }

    /// Takes the values of a member of the machine.
    fn forget(&self, run: &Structure, name: &str, memory: &mut Memory) -> Done<()> {
        let cells = self.cells_of(run, name)?;
        if let Object::Changing(object) = run.at.object {
            for at in cells {
                memory.put(object, at, Rc::new(Cell::UNSET));
            }
        }
        Ok(())
    }

    /// The cells of a member of the machine, in its object.
    fn cells_of(&self, run: &Structure, name: &str) -> Done<std::ops::Range<usize>> {
        let members = run.ty.as_struct().map(|id| &self.unit.structs[id].members);
        let all = members.into_iter().flatten().enumerate();
        let found = all.filter(|(_, member)| member.name == name).find_map(|(at, member)| {
            let from = run.at.cell + member_offset(self.unit, &run.ty, at)?;
            Some(from..from + n_cells(self.unit, &member.canonical.ty)?)
        });
        found.ok_or_else(|| format!("`{name}` is not known"))
    }

    /// Checks that the loop changed only those members of the machine that it may change.
    fn keeps_machine(&self, run: &Structure, before: &Memory, after: &Memory) -> Done<()> {
        let shared: Vec<_> =
            SHARED.iter().map(|name| self.cells_of(run, name)).collect::<Done<_>>()?;
        let own = run.at.cell..run.at.cell + run.n;
        for at in own.filter(|at| !shared.iter().any(|range| range.contains(at))) {
            let at = run.at.behind(at - run.at.cell);
            let (old, new) = (self.at(at, before)?, self.at(at, after)?);
            if !Rc::ptr_eq(whole(&old), whole(&new)) {
                return Err("the loop around the engine changes the state of the engine".to_owned());
            }
        }
        Ok(())
    }
}
