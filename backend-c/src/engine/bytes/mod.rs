//! The reaction program as code of the wide machine.
//!
//! The machine's stack and nesting depth are small. Expressions deeper than [`HEIGHT`] are split, and their operands are stored in temporaries of the
//! reaction; lists deeper than [`LEVELS`] are flattened, with a flag for the branch that was taken.

mod places;

pub(super) use places::{Place, Places};

use super::assemble::{Code, Coded, Encode};
use super::image::narrow;
use super::ops::{LOOPS, Machine, Op, STACK};
use crate::queries::{carriers, is_c};
use crate::refusal::Refusal;
use grafsynth_ir::Gather;
use grafsynth_ir::Span;
use grafsynth_ir::expr::{CompareOp, ExprKind, Type};
use grafsynth_ir::interval::type_of;
use grafsynth_ir::net::{InputId, Net, OutputId, StepId, TransitionId};
use grafsynth_ir::program::{
    CellId, Expr, Leaf, Mark, Origin, Program, ResetEffect, Stmt, Temp, TempId, TempRole,
};
use std::collections::{BTreeMap, BTreeSet};

/// The maximum depth of an expression that is evaluated on the stack directly.
const HEIGHT: usize = 10;
/// The maximum depth of nested `if`s.
const LEVELS: usize = 10;
/// Encodes a program.
pub(super) struct Assembler<'a> {
    net: &'a Net,
    program: &'a Program,
    places: &'a Places,
    /// The temps of the program, and those that hold operands.
    temps: Vec<(Type, Place)>,
    /// Temps that are free for operands: those for flags, and those for numbers.
    free: [Vec<usize>; 2],
    /// The number of flags and numbers so far.
    pub(super) n_flags: usize,
    pub(super) n_numbers: usize,
    /// The maximum number of rounds of the enclosing loops together.
    pub(super) rounds: u64,
    /// The position of the loop of the evolution.
    pub(super) evolution: Option<usize>,
    sets_fault: bool,
    step_cells: BTreeMap<StepId, CellId>,
    /// Conditions that are called when first needed, with the flag that records the call.
    lazy: BTreeMap<InputId, usize>,
    code: Code,
}

impl<'a> Assembler<'a> {
    pub(super) fn new(
        net: &'a Net,
        program: &'a Program,
        places: &'a Places,
        lazy: &BTreeSet<InputId>,
        sets_fault: bool,
    ) -> Self {
        let mut assembler = Assembler {
            net,
            program,
            places,
            temps: Vec::new(),
            free: [Vec::new(), Vec::new()],
            n_flags: 0,
            n_numbers: 0,
            rounds: 1,
            evolution: None,
            sets_fault,
            step_cells: BTreeMap::new(),
            lazy: BTreeMap::new(),
            code: Code::default(),
        };
        for (id, cell) in program.cells.iter() {
            if let Origin::Step(step) = cell.origin {
                assembler.step_cells.insert(step, id);
            }
        }
        for temp in program.temps.values() {
            assembler.new_temp(temp.ty);
        }
        for input in lazy {
            let flag = assembler.new_temp(Type::Bool);
            assembler.lazy.insert(*input, flag);
        }
        assembler
    }

    /// The place of a temp of the program.
    pub(super) fn place(&self, temp: TempId) -> Place {
        self.temps[temp.index()].1
    }

    /// The conditions that are called when first needed, each with the place of the flag that records the call.
    pub(super) fn asked(&self) -> impl Iterator<Item = (InputId, Place)> {
        self.lazy.iter().map(|(input, temp)| (*input, self.temps[*temp].1))
    }

    /// The code of the reset.
    ///
    /// # Errors
    /// If the engine does not support something in the net.
    pub(super) fn reset(&mut self) -> Coded<Vec<u8>> {
        for (id, cell) in self.program.cells.iter() {
            for (index, value) in cell.init.iter().enumerate().filter(|(_, value)| **value != 0) {
                if cell.len.is_some() {
                    self.code.constant(i64::try_from(index).unwrap_or(i64::MAX));
                }
                self.code.constant(*value);
                self.store(id, cell.len.is_some());
            }
        }
        if self.sets_fault && self.program.reset_fault {
            self.code.constant(1);
            self.code.op(Op::Fault);
        }
        for (id, number) in &self.places.outputs {
            let value = self.program.reset_outputs.get(id.index()).copied().unwrap_or(0);
            if value != 0 {
                self.code.constant(value);
                self.code.with(Op::Output, *number);
            }
        }
        for effect in &self.program.reset_effects {
            match effect {
                ResetEffect::Call(output, values) => {
                    values.iter().for_each(|value| self.code.constant(*value));
                    self.call(*output, values.len())?;
                }
                ResetEffect::Code(text) => self.text(&text.language, &text.text),
            }
        }
        Ok(std::mem::take(&mut self.code).finish())
    }

    /// The code of the reaction; `eager` are the conditions that are called before it.
    ///
    /// # Errors
    /// If the engine does not support something in the net.
    pub(super) fn reaction(&mut self, eager: &BTreeSet<InputId>) -> Coded<Vec<u8>> {
        for input in eager {
            self.code.with(Op::Ask, self.places.inputs[input]);
        }
        let program = self.program;
        self.list(&program.body, &Context { level: 0, loops: 0, rounds: 1 })?;
        Ok(std::mem::take(&mut self.code).finish())
    }

    // --- pieces ----------------------------------------------------------------------------------------------------------------------------

    fn new_temp(&mut self, ty: Type) -> usize {
        let count = if ty.is_bool() { &mut self.n_flags } else { &mut self.n_numbers };
        let at = narrow(*count);
        *count += 1;
        let place = if ty.is_bool() { Place::Bit(at) } else { Place::Number(at) };
        self.temps.push((ty, place));
        self.temps.len() - 1
    }

    /// Takes a temp for a short-lived value.
    fn borrow(&mut self, is_bool: bool) -> usize {
        let ty = if is_bool { Type::Bool } else { Type::Int { lo: i64::MIN, hi: i64::MAX } };
        self.free[usize::from(is_bool)].pop().unwrap_or_else(|| self.new_temp(ty))
    }

    fn give_back(&mut self, temps: Vec<usize>) {
        for temp in temps {
            self.free[usize::from(self.temps[temp].0.is_bool())].push(temp);
        }
    }

    fn read_temp(&mut self, temp: usize) {
        match self.temps[temp].1 {
            Place::Bit(at) => self.code.with(Op::Flag, at),
            Place::Number(at) => self.code.with(Op::Number, at),
        }
    }

    fn set_temp(&mut self, temp: usize) {
        match self.temps[temp].1 {
            Place::Bit(at) => self.code.with(Op::SetFlag, at),
            Place::Number(at) => self.code.with(Op::SetNumber, at),
        }
    }

    fn store(&mut self, cell: CellId, is_element: bool) {
        match self.places.cells[cell] {
            Place::Bit(at) => self.code.with(Op::SetBit, at),
            Place::Number(at) if is_element => self.code.with(Op::SetElement, at),
            Place::Number(at) => self.code.with(Op::SetValue, at),
        }
    }

    fn call(&mut self, output: OutputId, many: usize) -> Coded {
        if many > STACK {
            return Err(Refusal {
                what: format!("an extern action with {many} arguments (at most {STACK})"),
                span: self.net.outputs[output].meta.span,
            });
        }
        let number = self.places.actions.iter().position(|it| *it == output);
        let many = u8::try_from(many).unwrap_or(u8::MAX);
        self.code.call(narrow(number.unwrap_or_default()), many);
        Ok(())
    }

    fn text(&mut self, language: &str, text: &str) {
        if is_c(language) {
            let number = self.places.texts.iter().position(|it| it == text);
            self.code.with(Op::Text, narrow(number.unwrap_or_default()));
        }
    }

    // --- expressions -----------------------------------------------------------------------------------------------------------------------

    /// Puts the value of an expression on the stack. Operands that are too deep are first moved into temps, which are added to `kept`; the caller releases
    /// them.
    fn value(&mut self, expr: &Expr, kept: &mut Vec<usize>) -> Coded {
        let lower = self.low(expr, kept)?;
        self.push(&lower)
    }

    /// Moves operands that are too deep into temps.
    fn lowered(&mut self, mut expr: Expr, kept: &mut Vec<usize>) -> Coded<Expr> {
        let span = expr.span;
        for child in expr.children_mut() {
            let operand = std::mem::replace(child, Expr::bool(false));
            let operand = self.lowered(operand, kept)?;
            *child = if operand.height() < HEIGHT {
                operand
            } else {
                let temp = self.borrow(self.is_bool(&operand));
                self.push(&operand)?;
                self.set_temp(temp);
                kept.push(temp);
                Expr::leaf(Leaf::Temp(temp_id(temp)), span)
            };
        }
        Ok(expr)
    }

    fn is_bool(&self, expr: &Expr) -> bool {
        match &expr.kind {
            ExprKind::Bool(_)
            | ExprKind::Not(_)
            | ExprKind::And(_)
            | ExprKind::Or(_)
            | ExprKind::Compare(..) => true,
            ExprKind::Int(_) | ExprKind::Neg(_) | ExprKind::Arith(..) => false,
            ExprKind::Leaf(leaf) | ExprKind::Element(leaf, _) => self.leaf_type(leaf).is_bool(),
            ExprKind::Select(_, a, _) => self.is_bool(a),
        }
    }

    fn leaf_type(&self, leaf: &Leaf) -> Type {
        match *leaf {
            Leaf::Cell(cell) => self.program.cells[cell].ty,
            Leaf::Temp(temp) => self.temps[temp.index()].0,
            Leaf::Input(input) => self.net.inputs[input].ty,
            Leaf::Dt => grafsynth_ir::interval::TICKS,
        }
    }

    // --- statements ------------------------------------------------------------------------------------------------------------------------

    fn list(&mut self, list: &[Stmt], around: &Context) -> Coded {
        list.iter().try_for_each(|stmt| self.stmt(stmt, around))
    }

    fn stmt(&mut self, stmt: &Stmt, around: &Context) -> Coded {
        let mut kept = Vec::new();
        match stmt {
            Stmt::Set(temp, value) => {
                let role = self.program.temps[*temp].role;
                let when = if let TempRole::Fireable(transition) | TempRole::Fire(transition) = role
                {
                    self.enabled(transition)
                } else {
                    Vec::new()
                };
                self.ask(&[value], &Expr::and(when))?;
                self.value(value, &mut kept)?;
                self.set_temp(temp.index());
            }
            Stmt::Store(cell, index, value) => {
                let mentioned: Vec<&Expr> = index.iter().chain([value]).collect();
                self.ask(&mentioned, &Expr::bool(true))?;
                let is_element = index.is_some();
                let all = index.iter().chain([value]);
                let lower = all.map(|it| self.low(it, &mut kept)).collect::<Coded<Vec<Expr>>>()?;
                lower.iter().try_for_each(|it| self.push(it))?;
                self.store(*cell, is_element);
            }
            Stmt::If(condition, then, otherwise) => {
                self.ask(&[condition], &Expr::bool(true))?;
                if around.level >= LEVELS {
                    self.flat(condition, then, otherwise, around)?;
                } else {
                    self.value(condition, &mut kept)?;
                    self.give_back(std::mem::take(&mut kept));
                    let inner = Context { level: around.level + 1, ..*around };
                    let other = |it: &mut Self| it.list(otherwise, &inner);
                    let other = (!otherwise.is_empty()).then_some(other);
                    self.choose(|it| it.list(then, &inner), other)?;
                }
            }
            Stmt::Repeat { limit, condition, body } => {
                if *limit > 0 {
                    self.repeat(*limit, condition, body, around)?;
                }
            }
            Stmt::Output(output, value) => {
                self.ask(&[value], &self.carriers(*output, value))?;
                let value = self.fitted(value, self.net.outputs[*output].ty, &mut kept)?;
                self.push(&value)?;
                if let Some(number) = self.places.outputs.get(output) {
                    self.code.with(Op::Output, *number);
                }
            }
            Stmt::Call(output, arguments) => {
                let mentioned: Vec<&Expr> = arguments.iter().collect();
                self.ask(&mentioned, &Expr::bool(true))?;
                // The stack is reserved for the arguments, so nested operands are moved into temps first.
                let mut lower = Vec::new();
                for argument in arguments {
                    let value = self.low(argument, &mut kept)?;
                    lower.push(if value.children().next().is_some() {
                        self.keep(&value, &mut kept)?
                    } else {
                        value
                    });
                }
                lower.iter().try_for_each(|it| self.push(it))?;
                self.call(*output, lower.len())?;
            }
            Stmt::Code(text) => self.text(&text.language, &text.text),
            Stmt::Mark(Mark::MicroStep) => self.code.op(Op::Micro),
            Stmt::Mark(Mark::Fires(id)) => self.code.with(Op::Fired, narrow(id.index())),
            Stmt::Fault(value) => {
                if self.sets_fault {
                    self.value(value, &mut kept)?;
                    self.code.op(Op::Fault);
                }
            }
        }
        self.give_back(kept);
        Ok(())
    }

    fn repeat(&mut self, limit: u32, condition: &Expr, body: &[Stmt], around: &Context) -> Coded {
        let rounds = around.rounds.saturating_mul(u64::from(limit));
        if around.loops == LOOPS || rounds > u64::from(u32::MAX) {
            return Err(Refusal {
                what: "nested loops whose rounds together exceed 32 bits".to_owned(),
                span: self.net.name.span,
            });
        }
        self.rounds = self.rounds.max(rounds);
        let inner = Context { level: around.level + 1, loops: around.loops + 1, rounds };
        if let ExprKind::Leaf(Leaf::Temp(asked)) = condition.kind
            && Some(asked) == self.program.evolution
        {
            self.evolution = Some(self.code.len());
        }
        let round = self.code.open_loop(limit);
        let mut kept = Vec::new();
        if !condition.is_true() {
            self.value(condition, &mut kept)?;
            self.code.op(Op::While);
        }
        self.give_back(kept);
        self.list(body, &inner)?;
        self.code.op(Op::Again);
        self.code.close(round);
        Ok(())
    }

    /// Emits an `if` without nesting: each statement of its lists is guarded by the flag of its branch.
    fn flat(
        &mut self,
        condition: &Expr,
        then: &[Stmt],
        otherwise: &[Stmt],
        around: &Context,
    ) -> Coded {
        let (yes, no) = (self.borrow(true), self.borrow(true));
        self.decide(condition, yes, no)?;
        self.on_the_way(yes, then, around)?;
        self.on_the_way(no, otherwise, around)?;
        self.give_back(vec![yes, no]);
        Ok(())
    }

    /// Emits code that sets the flag of the branch that is taken: `yes` or `no`.
    fn decide(&mut self, condition: &Expr, yes: usize, no: usize) -> Coded {
        let mut kept = Vec::new();
        self.value(condition, &mut kept)?;
        self.give_back(kept);
        self.set_temp(yes);
        self.read_temp(yes);
        self.code.op(Op::Not);
        self.set_temp(no);
        Ok(())
    }

    fn on_the_way(&mut self, way: usize, list: &[Stmt], around: &Context) -> Coded {
        for stmt in list {
            if let Stmt::If(condition, then, otherwise) = stmt {
                // The inner branches are not taken if this one is not.
                let (yes, no) = (self.borrow(true), self.borrow(true));
                for flag in [yes, no] {
                    self.code.constant(0);
                    self.set_temp(flag);
                }
                self.read_temp(way);
                let held = self.code.open(Op::Unless);
                self.ask(&[condition], &Expr::bool(true))?;
                self.decide(condition, yes, no)?;
                self.code.close(held);
                self.on_the_way(yes, then, around)?;
                self.on_the_way(no, otherwise, around)?;
                self.give_back(vec![yes, no]);
            } else {
                self.read_temp(way);
                let held = self.code.open(Op::Unless);
                self.stmt(stmt, around)?;
                self.code.close(held);
            }
        }
        Ok(())
    }

    /// The expression, changed so that it is not too deep.
    fn low(&mut self, expr: &Expr, kept: &mut Vec<usize>) -> Coded<Expr> {
        if expr.height() > HEIGHT { self.lowered(expr.clone(), kept) } else { Ok(expr.clone()) }
    }

    fn keep(&mut self, expr: &Expr, kept: &mut Vec<usize>) -> Coded<Expr> {
        let temp = self.borrow(self.is_bool(expr));
        self.push(expr)?;
        self.set_temp(temp);
        kept.push(temp);
        Ok(Expr::leaf(Leaf::Temp(temp_id(temp)), expr.span))
    }

    /// A value clamped to the range of a type.
    fn fitted(&mut self, value: &Expr, ty: Type, kept: &mut Vec<usize>) -> Coded<Expr> {
        let own = type_of(value, &mut |leaf| self.leaf_type(leaf));
        let ((lo, hi), bounds) = (ty.bounds(), own.map(Type::bounds));
        let value = self.low(value, kept)?;
        if ty.is_bool() || bounds.is_ok_and(|(a, b)| lo <= a && b <= hi) {
            return Ok(value);
        }
        let value = self.keep(&value, kept)?;
        let choose = |op, bound: i64, other: Expr| {
            let condition = Expr::compare(op, value.clone(), Expr::int(bound));
            let kind =
                ExprKind::Select(Box::new(condition), Box::new(Expr::int(bound)), Box::new(other));
            Expr::new(kind, Span::default())
        };
        let below = choose(CompareOp::Lt, lo, value.clone());
        Ok(choose(CompareOp::Gt, hi, below))
    }

    // --- extern conditions -----------------------------------------------------------------------------------------------------------------

    /// Expressions that read the bits of a transition's source steps.
    fn enabled(&self, transition: TransitionId) -> Vec<Expr> {
        let requires = self.net.transitions[transition].requires.iter();
        requires.filter_map(|step| self.active(*step)).collect()
    }

    fn active(&self, step: StepId) -> Option<Expr> {
        let cell = self.step_cells.get(&step)?;
        Some(Expr::leaf(Leaf::Cell(*cell), Span::default()))
    }

    /// The condition that some step which assigns the output is active.
    fn carriers(&self, output: OutputId, value: &Expr) -> Expr {
        let steps = carriers(self.net, output, value);
        if steps.is_empty() {
            return Expr::bool(true);
        }
        Expr::or(steps.into_iter().filter_map(|step| self.active(step)))
    }

    /// If `when` is true, calls the conditions that expressions mention and that were not called yet.
    fn ask(&mut self, expressions: &[&Expr], when: &Expr) -> Coded {
        if self.lazy.is_empty() {
            return Ok(());
        }
        let mentioned: BTreeSet<InputId> =
            (expressions.iter()).flat_map(|expr| expr.leaves()).filter_map(Leaf::input).gather();
        for input in mentioned {
            let Some(flag) = self.lazy.get(&input).copied() else { continue };
            let asked = Expr::leaf(Leaf::Temp(temp_id(flag)), Span::default());
            self.push(&Expr::and([when.clone(), asked.not()]))?;
            let held = self.code.open(Op::Unless);
            self.code.constant(1);
            self.set_temp(flag);
            self.code.with(Op::Ask, self.places.inputs[&input]);
            self.code.close(held);
        }
        Ok(())
    }
}

impl Encode<Leaf> for Assembler<'_> {
    const MACHINE: Machine = Machine::Wide;

    fn code(&mut self) -> &mut Code {
        &mut self.code
    }

    fn fits(&self, _: &Expr) -> Coded {
        Ok(())
    }

    fn leaf(&mut self, leaf: &Leaf, _: Span) -> Coded {
        match *leaf {
            Leaf::Cell(cell) => match self.places.cells[cell] {
                Place::Bit(at) => self.code.with(Op::Bit, at),
                Place::Number(row) => self.code.with(Op::Value, self.places.first(row)),
            },
            Leaf::Temp(temp) => self.read_temp(temp.index()),
            Leaf::Input(input) => match self.places.inputs.get(&input) {
                Some(at) => self.code.with(Op::Input, *at),
                // An internal event is raised inside the chart, never from outside.
                None => self.code.constant(0),
            },
            Leaf::Dt => self.code.op(Op::Dt),
        }
        Ok(())
    }

    fn element(&mut self, array: &Leaf, _: Span) -> Coded {
        match *array {
            Leaf::Cell(cell) => match self.places.cells[cell] {
                Place::Number(row) => self.code.with(Op::Element, row),
                Place::Bit(_) => unreachable!("an array is not a bit"),
            },
            Leaf::Temp(_) | Leaf::Input(_) | Leaf::Dt => unreachable!("only cells are arrays"),
        }
        Ok(())
    }
}

/// The context of a statement.
#[derive(Debug, Clone, Copy)]
struct Context {
    level: usize,
    loops: usize,
    rounds: u64,
}

/// The id of a temp, which may be one beyond the temps of the program.
fn temp_id(at: usize) -> grafsynth_ir::Id<Temp> {
    grafsynth_ir::Id::from_index(at)
}
