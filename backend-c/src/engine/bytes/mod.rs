//! The reaction program as byte code for `grafsynth_program.c`.
//!
//! Expressions are postfix on a stack of 64-bit values. Code that is skipped or repeated is *contained* in the instruction before it, which encodes its
//! length; parts are nested and never overlap. So one pass over the code can check that it stays within its bytes, its stack and its rounds,
//! and no jump can leave the code.
//!
//! The engine's stack and nesting depth are small. Expressions deeper than [`HEIGHT`] are split, and their operands are stored in temporaries of the
//! reaction; lists deeper than [`LEVELS`] are flattened, with a flag for the branch that was taken.

mod places;

pub(super) use places::{Place, Places};

use super::image::narrow;
use crate::queries::{carriers, is_c};
use crate::refusal::Refusal;
use grafsynth_ir::Span;
use grafsynth_ir::expr::{ArithOp, CompareOp, ExprKind, Type};
use grafsynth_ir::interval::type_of;
use grafsynth_ir::net::{InputId, Net, OutputId, StepId, TransitionId};
use grafsynth_ir::program::{
    CellId, Expr, Leaf, Mark, Origin, Program, ResetEffect, Stmt, Temp, TempRole,
};
use std::collections::{BTreeMap, BTreeSet};

/// The maximum depth of an expression that is evaluated on the stack directly.
const HEIGHT: usize = 10;
/// The maximum depth of nested `if`s.
const LEVELS: usize = 10;
/// The size of the engine's stack, which is also the maximum number of call arguments.
const STACK: usize = 16;
/// The maximum depth of nested loops.
const LOOPS: usize = 3;

/// The instructions, in the order of their codes.
#[derive(Debug, Clone, Copy)]
pub(super) enum Op {
    Byte = 0,
    Long = 1,
    Wide = 2,
    Dt = 3,
    Input = 4,
    Bit = 5,
    Value = 6,
    Flag = 7,
    Number = 8,
    Element = 9,
    Not = 10,
    Neg = 11,
    And = 12,
    Or = 13,
    Eq = 14,
    Ne = 15,
    Lt = 16,
    Le = 17,
    Gt = 18,
    Ge = 19,
    Add = 20,
    Sub = 21,
    Mul = 22,
    Div = 23,
    Mod = 24,
    SetBit = 25,
    SetValue = 26,
    SetFlag = 27,
    SetNumber = 28,
    SetElement = 29,
    Output = 30,
    Fault = 31,
    Ask = 32,
    Call = 33,
    Text = 34,
    Fired = 35,
    Micro = 36,
    Unless = 37,
    Else = 38,
    AndThen = 39,
    OrElse = 40,
    Loop = 41,
    While = 42,
    Again = 43,
    BitAnd = 44,
    BitOr = 45,
    BitXor = 46,
    Shl = 47,
    Shr = 48,
}

/// The number of operand bytes of each instruction.
pub(super) const OPERANDS: [u8; 49] = [
    1, 4, 8, 0, 2, 2, 2, 2, 2, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 2, 2, 2, 2, 2, 2, 0,
    2, 3, 2, 2, 0, 2, 2, 2, 2, 6, 0, 0, 0, 0, 0, 0, 0,
];

/// Code under construction.
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
    code: Vec<u8>,
}

type Coded<T = ()> = Result<T, Refusal>;

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
            code: Vec::new(),
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

    /// The code of the reset.
    ///
    /// # Errors
    /// If the engine does not support something in the net.
    pub(super) fn reset(&mut self) -> Coded<Vec<u8>> {
        for (id, cell) in self.program.cells.iter() {
            for (index, value) in cell.init.iter().enumerate().filter(|(_, value)| **value != 0) {
                if cell.len.is_some() {
                    self.constant(i64::try_from(index).unwrap_or(i64::MAX));
                }
                self.constant(*value);
                self.store(id, cell.len.is_some());
            }
        }
        if self.sets_fault && self.program.reset_fault {
            self.constant(1);
            self.op(Op::Fault);
        }
        for (id, number) in &self.places.outputs {
            let value = self.program.reset_outputs.get(id.index()).copied().unwrap_or(0);
            if value != 0 {
                self.constant(value);
                self.with(Op::Output, *number);
            }
        }
        for effect in &self.program.reset_effects {
            match effect {
                ResetEffect::Call(output, values) => {
                    values.iter().for_each(|value| self.constant(*value));
                    self.call(*output, values.len())?;
                }
                ResetEffect::Code(text) => self.text(&text.language, &text.text),
            }
        }
        Ok(std::mem::take(&mut self.code))
    }

    /// The code of the reaction; `eager` are the conditions that are called before it.
    ///
    /// # Errors
    /// If the engine does not support something in the net.
    pub(super) fn reaction(&mut self, eager: &BTreeSet<InputId>) -> Coded<Vec<u8>> {
        for input in eager {
            self.with(Op::Ask, self.places.inputs[input]);
        }
        let program = self.program;
        self.list(&program.body, &Context { level: 0, loops: 0, rounds: 1 })?;
        Ok(std::mem::take(&mut self.code))
    }

    // --- pieces ----------------------------------------------------------------------------------------------------------------------------

    fn op(&mut self, op: Op) {
        self.code.push(op as u8);
    }

    fn with(&mut self, op: Op, operand: u16) {
        self.op(op);
        self.code.extend(operand.to_le_bytes());
    }

    fn constant(&mut self, value: i64) {
        if let Ok(byte) = i8::try_from(value) {
            self.op(Op::Byte);
            self.code.extend(byte.to_le_bytes());
        } else if let Ok(long) = i32::try_from(value) {
            self.op(Op::Long);
            self.code.extend(long.to_le_bytes());
        } else {
            self.op(Op::Wide);
            self.code.extend(value.to_le_bytes());
        }
    }

    /// Emits an instruction that contains code; returns the position of its length.
    fn open(&mut self, op: Op) -> usize {
        self.with(op, 0);
        self.code.len() - 2
    }

    /// Ends the code that an instruction contains. A length of more than 16 bits makes the image too large, and it is rejected as a
    /// whole.
    fn close(&mut self, length_at: usize) {
        let length = narrow(self.code.len() - length_at - 2);
        self.code[length_at..length_at + 2].copy_from_slice(&length.to_le_bytes());
    }

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
            Place::Bit(at) => self.with(Op::Flag, at),
            Place::Number(at) => self.with(Op::Number, at),
        }
    }

    fn set_temp(&mut self, temp: usize) {
        match self.temps[temp].1 {
            Place::Bit(at) => self.with(Op::SetFlag, at),
            Place::Number(at) => self.with(Op::SetNumber, at),
        }
    }

    fn store(&mut self, cell: CellId, is_element: bool) {
        match self.places.cells[cell] {
            Place::Bit(at) => self.with(Op::SetBit, at),
            Place::Number(at) if is_element => self.with(Op::SetElement, at),
            Place::Number(at) => self.with(Op::SetValue, at),
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
        self.with(Op::Call, narrow(number.unwrap_or_default()));
        self.code.push(u8::try_from(many).unwrap_or(u8::MAX));
        Ok(())
    }

    fn text(&mut self, language: &str, text: &str) {
        if is_c(language) {
            let number = self.places.texts.iter().position(|it| it == text);
            self.with(Op::Text, narrow(number.unwrap_or_default()));
        }
    }

    // --- expressions -----------------------------------------------------------------------------------------------------------------------

    /// Puts the value of an expression on the stack. Operands that are too deep are first moved into temps, which are added to `kept`; the caller releases
    /// them.
    fn value(&mut self, expr: &Expr, kept: &mut Vec<usize>) {
        if expr.height() > HEIGHT {
            let lower = self.lowered(expr.clone(), kept);
            self.push(&lower);
        } else {
            self.push(expr);
        }
    }

    /// Moves operands that are too deep into temps.
    fn lowered(&mut self, mut expr: Expr, kept: &mut Vec<usize>) -> Expr {
        let span = expr.span;
        for child in expr.children_mut() {
            let operand = std::mem::replace(child, Expr::bool(false));
            let operand = self.lowered(operand, kept);
            *child = if operand.height() < HEIGHT {
                operand
            } else {
                let temp = self.borrow(self.is_bool(&operand));
                self.push(&operand);
                self.set_temp(temp);
                kept.push(temp);
                Expr::leaf(Leaf::Temp(temp_id(temp)), span)
            };
        }
        expr
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

    fn push(&mut self, expr: &Expr) {
        match &expr.kind {
            ExprKind::Bool(value) => self.constant(i64::from(*value)),
            ExprKind::Int(value) => self.constant(*value),
            ExprKind::Leaf(leaf) => self.leaf(*leaf),
            ExprKind::Element(array, index) => {
                self.push(index);
                match array {
                    Leaf::Cell(cell) => match self.places.cells[*cell] {
                        Place::Number(row) => self.with(Op::Element, row),
                        Place::Bit(_) => unreachable!("an array is not a bit"),
                    },
                    Leaf::Temp(_) | Leaf::Input(_) | Leaf::Dt => {
                        unreachable!("only cells are arrays")
                    }
                }
            }
            ExprKind::Not(a) => {
                self.push(a);
                self.op(Op::Not);
            }
            ExprKind::Neg(a) => {
                self.push(a);
                self.op(Op::Neg);
            }
            ExprKind::And(all) => self.junction(all, Op::And, Op::AndThen, 1),
            ExprKind::Or(all) => self.junction(all, Op::Or, Op::OrElse, 0),
            ExprKind::Compare(op, a, b) => {
                self.push(a);
                self.push(b);
                self.op(match op {
                    CompareOp::Eq => Op::Eq,
                    CompareOp::Ne => Op::Ne,
                    CompareOp::Lt => Op::Lt,
                    CompareOp::Le => Op::Le,
                    CompareOp::Gt => Op::Gt,
                    CompareOp::Ge => Op::Ge,
                });
            }
            ExprKind::Arith(op, a, b) => {
                self.push(a);
                self.push(b);
                self.op(match op {
                    ArithOp::Add => Op::Add,
                    ArithOp::Sub => Op::Sub,
                    ArithOp::Mul => Op::Mul,
                    ArithOp::Div => Op::Div,
                    ArithOp::Mod => Op::Mod,
                    ArithOp::BitAnd => Op::BitAnd,
                    ArithOp::BitOr => Op::BitOr,
                    ArithOp::BitXor => Op::BitXor,
                    ArithOp::Shl => Op::Shl,
                    ArithOp::Shr => Op::Shr,
                });
            }
            ExprKind::Select(c, a, b) => {
                self.push(c);
                let unless = self.open(Op::Unless);
                self.push(a);
                let other = self.open(Op::Else);
                self.close(unless);
                self.push(b);
                self.close(other);
            }
        }
    }

    /// Emits a conjunction or disjunction. Operands other than leaves are skipped if the result is already known; none has a side effect.
    fn junction(&mut self, all: &[Expr], both: Op, then: Op, none: i64) {
        let Some((first, rest)) = all.split_first() else { return self.constant(none) };
        self.push(first);
        for operand in rest {
            if operand.children().next().is_none() {
                self.push(operand);
                self.op(both);
            } else {
                let held = self.open(then);
                self.push(operand);
                self.close(held);
            }
        }
    }

    fn leaf(&mut self, leaf: Leaf) {
        match leaf {
            Leaf::Cell(cell) => match self.places.cells[cell] {
                Place::Bit(at) => self.with(Op::Bit, at),
                Place::Number(at) => self.with(Op::Value, at),
            },
            Leaf::Temp(temp) => self.read_temp(temp.index()),
            Leaf::Input(input) => match self.places.inputs.get(&input) {
                Some(at) => self.with(Op::Input, *at),
                // An internal event is raised inside the chart, never from outside.
                None => self.constant(0),
            },
            Leaf::Dt => self.op(Op::Dt),
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
                let when = if let TempRole::Fireable(transition) = role {
                    self.enabled(transition)
                } else {
                    Vec::new()
                };
                self.ask(&[value], &Expr::and(when));
                self.value(value, &mut kept);
                self.set_temp(temp.index());
            }
            Stmt::Store(cell, index, value) => {
                let mentioned: Vec<&Expr> = index.iter().chain([value]).collect();
                self.ask(&mentioned, &Expr::bool(true));
                let is_element = index.is_some();
                let all = index.iter().chain([value]);
                let lower: Vec<Expr> = all.map(|it| self.low(it, &mut kept)).collect();
                lower.iter().for_each(|it| self.push(it));
                self.store(*cell, is_element);
            }
            Stmt::If(condition, then, otherwise) => {
                self.ask(&[condition], &Expr::bool(true));
                if around.level >= LEVELS {
                    self.flat(condition, then, otherwise, around)?;
                } else {
                    self.value(condition, &mut kept);
                    self.give_back(std::mem::take(&mut kept));
                    let inner = Context { level: around.level + 1, ..*around };
                    let unless = self.open(Op::Unless);
                    self.list(then, &inner)?;
                    if otherwise.is_empty() {
                        self.close(unless);
                    } else {
                        let other = self.open(Op::Else);
                        self.close(unless);
                        self.list(otherwise, &inner)?;
                        self.close(other);
                    }
                }
            }
            Stmt::Repeat { limit, condition, body } => {
                if *limit > 0 {
                    self.repeat(*limit, condition, body, around)?;
                }
            }
            Stmt::Output(output, value) => {
                self.ask(&[value], &self.carriers(*output, value));
                let value = self.fitted(value, self.net.outputs[*output].ty, &mut kept);
                self.push(&value);
                if let Some(number) = self.places.outputs.get(output) {
                    self.with(Op::Output, *number);
                }
            }
            Stmt::Call(output, arguments) => {
                let mentioned: Vec<&Expr> = arguments.iter().collect();
                self.ask(&mentioned, &Expr::bool(true));
                // The stack is reserved for the arguments, so nested operands are moved into temps first.
                let mut lower = Vec::new();
                for argument in arguments {
                    let value = self.low(argument, &mut kept);
                    lower.push(if value.children().next().is_some() {
                        self.keep(&value, &mut kept)
                    } else {
                        value
                    });
                }
                lower.iter().for_each(|it| self.push(it));
                self.call(*output, lower.len())?;
            }
            Stmt::Code(text) => self.text(&text.language, &text.text),
            Stmt::Mark(Mark::MicroStep) => self.op(Op::Micro),
            Stmt::Mark(Mark::Fires(id)) => self.with(Op::Fired, narrow(id.index())),
            Stmt::Fault(value) => {
                if self.sets_fault {
                    self.value(value, &mut kept);
                    self.op(Op::Fault);
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
        self.op(Op::Loop);
        self.code.extend(limit.to_le_bytes());
        self.code.extend([0, 0]);
        let length_at = self.code.len() - 2;
        let mut kept = Vec::new();
        if !condition.is_true() {
            self.value(condition, &mut kept);
            self.op(Op::While);
        }
        self.give_back(kept);
        self.list(body, &inner)?;
        self.op(Op::Again);
        self.close(length_at);
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
        self.decide(condition, yes, no);
        self.on_the_way(yes, then, around)?;
        self.on_the_way(no, otherwise, around)?;
        self.give_back(vec![yes, no]);
        Ok(())
    }

    /// Emits code that sets the flag of the branch that is taken: `yes` or `no`.
    fn decide(&mut self, condition: &Expr, yes: usize, no: usize) {
        let mut kept = Vec::new();
        self.value(condition, &mut kept);
        self.give_back(kept);
        self.set_temp(yes);
        self.read_temp(yes);
        self.op(Op::Not);
        self.set_temp(no);
    }

    fn on_the_way(&mut self, way: usize, list: &[Stmt], around: &Context) -> Coded {
        for stmt in list {
            if let Stmt::If(condition, then, otherwise) = stmt {
                // The inner branches are not taken if this one is not.
                let (yes, no) = (self.borrow(true), self.borrow(true));
                for flag in [yes, no] {
                    self.constant(0);
                    self.set_temp(flag);
                }
                self.read_temp(way);
                let held = self.open(Op::Unless);
                self.ask(&[condition], &Expr::bool(true));
                self.decide(condition, yes, no);
                self.close(held);
                self.on_the_way(yes, then, around)?;
                self.on_the_way(no, otherwise, around)?;
                self.give_back(vec![yes, no]);
            } else {
                self.read_temp(way);
                let held = self.open(Op::Unless);
                self.stmt(stmt, around)?;
                self.close(held);
            }
        }
        Ok(())
    }

    /// The expression, changed so that it is not too deep.
    fn low(&mut self, expr: &Expr, kept: &mut Vec<usize>) -> Expr {
        if expr.height() > HEIGHT { self.lowered(expr.clone(), kept) } else { expr.clone() }
    }

    fn keep(&mut self, expr: &Expr, kept: &mut Vec<usize>) -> Expr {
        let temp = self.borrow(self.is_bool(expr));
        self.push(expr);
        self.set_temp(temp);
        kept.push(temp);
        Expr::leaf(Leaf::Temp(temp_id(temp)), expr.span)
    }

    /// A value clamped to the range of a type.
    fn fitted(&mut self, value: &Expr, ty: Type, kept: &mut Vec<usize>) -> Expr {
        let own = type_of(value, &mut |leaf| self.leaf_type(leaf));
        let ((lo, hi), bounds) = (ty.bounds(), own.map(Type::bounds));
        let value = self.low(value, kept);
        if ty.is_bool() || bounds.is_ok_and(|(a, b)| lo <= a && b <= hi) {
            return value;
        }
        let value = self.keep(&value, kept);
        let choose = |op, bound: i64, other: Expr| {
            let condition = Expr::compare(op, value.clone(), Expr::int(bound));
            let kind =
                ExprKind::Select(Box::new(condition), Box::new(Expr::int(bound)), Box::new(other));
            Expr::new(kind, Span::default())
        };
        let below = choose(CompareOp::Lt, lo, value.clone());
        choose(CompareOp::Gt, hi, below)
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
    fn ask(&mut self, expressions: &[&Expr], when: &Expr) {
        if self.lazy.is_empty() {
            return;
        }
        let mentioned: BTreeSet<InputId> =
            (expressions.iter()).flat_map(|expr| expr.leaves()).filter_map(Leaf::input).collect();
        for input in mentioned {
            let Some(flag) = self.lazy.get(&input).copied() else { continue };
            let asked = Expr::leaf(Leaf::Temp(temp_id(flag)), Span::default());
            self.push(&Expr::and([when.clone(), asked.not()]));
            let held = self.open(Op::Unless);
            self.constant(1);
            self.set_temp(flag);
            self.with(Op::Ask, self.places.inputs[&input]);
            self.close(held);
        }
    }
}

/// The context of a statement.
#[derive(Debug, Clone, Copy)]
struct Context {
    level: usize,
    loops: usize,
    rounds: u64,
}

/// The id of a temp that may not belong to the program.
fn temp_id(at: usize) -> grafsynth_ir::Id<Temp> {
    grafsynth_ir::Id::from_index(at)
}
