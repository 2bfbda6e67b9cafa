//! The expressions of C (C99 6.5), with their effects. Every conversion is a node of the tree; what the standard leaves undefined becomes an obligation.

use std::rc::Rc;

use grafsynth_c::tree::types::{IntKind, Qualified, Type};
use grafsynth_c::tree::{
    BinaryOp, Callee, Expr, ExprKind, Init, Loc, LogicalOp, Place, PlaceKind, SymbolKind, UnaryOp,
};
use grafsynth_ir::expr::{ArithOp, CompareOp};

use super::exec::{Done, Program};
use super::memory::{
    Address, Cell, Memory, Object, Pointer, Scalar, member_offset, merge_cells, merge_scalars,
    n_cells, pointer_cases,
};
use super::value::{self, Int};
use crate::symbolic::aig::Lit;
use crate::symbolic::number::Number;

/// The maximum number of elements that one access with a variable index considers.
const MAX_TARGETS: usize = 1 << 16;

/// An operand of a chain of `&&` or `||` that does not decide it on all paths.
struct Earlier {
    value: Lit,
    /// The condition under which the next operand is evaluated.
    goes_on: Lit,
    /// The memory after the operand, and the same on the path on which the next one is evaluated.
    memory: Memory,
    start: Memory,
}

impl<'u> Program<'u> {
    /// Runs an expression whose value is not used.
    pub(super) fn effect(&mut self, expr: &'u Expr, memory: &mut Memory) -> Done<()> {
        match &expr.kind {
            ExprKind::Assign(place, value) if place.ty.as_struct().is_some() => {
                let cells = self.assigned(value, memory)?;
                let to = self.addresses(place, memory)?;
                for (at, cell) in cells.into_iter().enumerate() {
                    let to: Vec<(Address, Lit)> =
                        to.iter().map(|(it, when)| (it.behind(at), *when)).collect();
                    self.store(&to, cell, memory)?;
                }
                Ok(())
            }
            ExprKind::Cast(ty, inner) if ty.ty == Type::Void => self.effect(inner, memory),
            ExprKind::Comma(a, b) => {
                self.effect(a, memory)?;
                self.effect(b, memory)
            }
            ExprKind::Read(place) if !place.ty.is_scalar() => {
                self.addresses(place, memory).map(|_| ())
            }
            _ => self.evaluate(expr, memory).map(|_| ()),
        }
    }

    /// The value of an expression; an error if it has none (a call of a `void` function).
    pub(super) fn scalar(&mut self, expr: &'u Expr, memory: &mut Memory) -> Done<Scalar> {
        self.evaluate(expr, memory)?
            .ok_or_else(|| "an expression that needs a value has none".to_owned())
    }

    pub(super) fn int(&mut self, expr: &'u Expr, memory: &mut Memory) -> Done<Int> {
        match self.scalar(expr, memory)? {
            Scalar::Int(value) => Ok(value),
            Scalar::Pointer(_) => Err("a pointer used as a number is not supported".to_owned()),
        }
    }

    /// The condition that a scalar is not 0.
    pub(super) fn truth(&mut self, expr: &'u Expr, memory: &mut Memory) -> Done<Lit> {
        let value = self.scalar(expr, memory)?;
        Ok(self.is_not_zero(&value))
    }

    fn is_not_zero(&mut self, value: &Scalar) -> Lit {
        match value {
            Scalar::Int(value) => value.truth(&mut self.aig),
            Scalar::Pointer(cases) => {
                let null: Vec<Lit> = cases
                    .iter()
                    .filter(|(pointer, _)| *pointer == Pointer::Null)
                    .map(|(_, when)| *when)
                    .collect();
                !self.aig.or_all(null)
            }
        }
    }

    /// The cells of a value that initialises or is assigned to an object.
    pub(super) fn assigned(&mut self, value: &'u Expr, memory: &mut Memory) -> Done<Vec<Rc<Cell>>> {
        if value.ty.as_struct().is_none() {
            return Ok(vec![Rc::new(Cell::of(self.scalar(value, memory)?))]);
        }
        let ExprKind::Read(place) = &value.kind else {
            return Err("a structure that a function returns is not supported".to_owned());
        };
        let n = n_cells(self.unit, &value.ty).ok_or("the size of a structure is not known")?;
        let from = self.addresses(place, memory)?;
        (0..n)
            .map(|at| {
                let from: Vec<(Address, Lit)> =
                    from.iter().map(|(it, when)| (it.behind(at), *when)).collect();
                // A copy of what is not tracked is not tracked either.
                self.cell(&from, memory)
            })
            .collect()
    }

    /// Sets the cells of an object to 0.
    pub(super) fn zero(&self, ty: &Type, cells: &mut [Rc<Cell>], at: &mut usize) {
        match ty {
            Type::Array(element, len) => {
                for _ in 0..len.unwrap_or(0) {
                    self.zero(&element.ty, cells, at);
                }
            }
            Type::Struct(id) => {
                for member in &self.unit.structs[*id].members {
                    self.zero(&member.canonical.ty, cells, at);
                }
            }
            _ => {
                if let Some(cell) = cells.get_mut(*at) {
                    *cell = Rc::new(Cell::of(match ty {
                        Type::Pointer(_) => Scalar::Pointer(vec![(Pointer::Null, Lit::TRUE)]),
                        Type::Int(IntKind::Bool) => Scalar::Int(Int::Bit(Lit::FALSE)),
                        _ => Scalar::Int(Int::constant(0)),
                    }));
                }
                *at += 1;
            }
        }
    }

    /// Fills the cells from `at` with an initialiser.
    pub(super) fn fill(
        &mut self,
        ty: &Type,
        init: &'u Init,
        cells: &mut [Rc<Cell>],
        at: usize,
    ) -> Done<()> {
        match init {
            Init::Value(value) => {
                // An initialiser in braces changes nothing.
                let values = self.assigned(value, &mut Memory::default())?;
                for (cell, value) in cells.iter_mut().skip(at).zip(values) {
                    *cell = value;
                }
                Ok(())
            }
            Init::Parts(parts) => {
                for part in parts {
                    let index = usize::try_from(part.at)
                        .map_err(|_| "the index of an initialiser is too large")?;
                    let (inner, offset) = match ty {
                        Type::Array(element, _) => {
                            let size = n_cells(self.unit, &element.ty).unwrap_or(0);
                            (element.ty.clone(), index * size)
                        }
                        Type::Struct(id) => {
                            let member = self.unit.structs[*id].members.get(index);
                            let inner = member.map(|it| it.canonical.ty.clone());
                            let offset = member_offset(self.unit, ty, index);
                            inner.zip(offset).ok_or("a member of a structure is not known")?
                        }
                        _ => (ty.clone(), 0),
                    };
                    self.fill(&inner, &part.init, cells, at + offset)?;
                }
                Ok(())
            }
        }
    }

    fn kind(&self, expr: &Expr) -> Done<IntKind> {
        self.unit.integer(&expr.ty).ok_or_else(|| {
            "arithmetic on a value that is not an integer is not supported".to_owned()
        })
    }

    fn evaluate(&mut self, expr: &'u Expr, memory: &mut Memory) -> Done<Option<Scalar>> {
        self.deeper(|this| this.operator(expr, memory))
    }

    /// The value of the outermost operator.
    fn operator(&mut self, expr: &'u Expr, memory: &mut Memory) -> Done<Option<Scalar>> {
        let number = |value: i128| Ok(Some(Scalar::Int(Int::constant(value))));
        match &expr.kind {
            ExprKind::Literal(value, _) => number(i128::from(*value)),
            ExprKind::Bool(value) => Ok(Some(Scalar::Int(Int::Bit(Lit::constant(*value))))),
            ExprKind::Constant(id) => match self.unit.symbols[*id].kind {
                SymbolKind::Constant(value) => number(value),
                _ => Err("the value of a constant is not known".to_owned()),
            },
            ExprKind::SizeOf(_) => match self.unit.constant(expr) {
                Some(value) => number(value),
                None => Err("the value of a `sizeof` is not known".to_owned()),
            },
            ExprKind::Null => Ok(Some(Scalar::Pointer(vec![(Pointer::Null, Lit::TRUE)]))),
            ExprKind::Function(id) => {
                Ok(Some(Scalar::Pointer(vec![(Pointer::Function(*id), Lit::TRUE)])))
            }
            ExprKind::Read(place) => self.read(place, memory, expr.span),
            ExprKind::Address(place) => {
                let is_object = matches!(place.kind, PlaceKind::Symbol(_) | PlaceKind::Member(..));
                self.pointer(place, is_object, memory)
            }
            ExprKind::Decay(place) => self.pointer(place, true, memory),
            ExprKind::Unary(op, a) => self.unary(expr, *op, a, memory),
            ExprKind::Binary(op, a, b) => {
                let (x, y) = (self.scalar(a, memory)?, self.scalar(b, memory)?);
                match (x, y) {
                    (Scalar::Int(x), Scalar::Int(y)) => {
                        let kind = self.kind(a)?;
                        self.binary(*op, kind, &x, &y, expr.span).map(|it| Some(Scalar::Int(it)))
                    }
                    (x, y) => self.same_pointer(*op, &x, &y).map(|it| Some(Scalar::Int(it))),
                }
            }
            ExprKind::Logical(op, all) => {
                let is_and = *op == LogicalOp::And;
                let lit = self.logical(is_and, all, memory)?;
                Ok(Some(Scalar::Int(Int::Bit(lit))))
            }
            ExprKind::Choose(c, a, b) => self.choose(c, a, b, memory),
            ExprKind::Comma(a, b) => {
                self.effect(a, memory)?;
                self.evaluate(b, memory)
            }
            ExprKind::Convert(a) | ExprKind::Cast(_, a) => {
                if expr.ty == Type::Void {
                    self.effect(a, memory)?;
                    return Ok(None);
                }
                let value = self.scalar(a, memory)?;
                self.converted(value, &a.ty, &expr.ty).map(Some)
            }
            ExprKind::Assign(place, value) => {
                let value = self.scalar(value, memory)?;
                let to = self.addresses(place, memory)?;
                self.store(&to, Rc::new(Cell::of(value.clone())), memory)?;
                Ok(Some(value))
            }
            ExprKind::Update(op, place, value, ty) => {
                let operand = self.int(value, memory)?;
                self.updated(*op, place, &operand, ty, memory, expr.span).map(|it| Some(it.1))
            }
            ExprKind::Step { is_increment, is_prefix, place } => {
                let op = if *is_increment { BinaryOp::Add } else { BinaryOp::Sub };
                let (old, new) = self.stepped(op, place, memory, expr.span)?;
                Ok(Some(if *is_prefix { new } else { old }))
            }
            ExprKind::Call(Callee::Function(function), arguments) => {
                let values = arguments.iter().map(|it| self.scalar(it, memory));
                let values = values.collect::<Done<_>>()?;
                self.call(*function, values, memory)
            }
            ExprKind::Call(Callee::Pointer(_), _) => {
                Err("a call through a pointer is not supported".to_owned())
            }
            ExprKind::Member(..) => {
                Err("a structure that a function returns is not supported".to_owned())
            }
        }
    }

    /// Changes a place by one. Returns the values before and after.
    fn stepped(
        &mut self,
        op: BinaryOp,
        place: &'u Place,
        memory: &mut Memory,
        span: Loc,
    ) -> Done<(Scalar, Scalar)> {
        let kind = self.unit.integer(&place.ty).ok_or("arithmetic on pointers is not supported")?;
        let ty = Type::Int(self.unit.machine.promoted(kind));
        self.updated(op, place, &Int::constant(1), &ty, memory, span)
    }

    /// The value of a place.
    fn read(&mut self, place: &'u Place, memory: &mut Memory, span: Loc) -> Done<Option<Scalar>> {
        if !place.ty.is_scalar() {
            return Err("a structure used as a value is not supported here".to_owned());
        }
        if let Some(byte) = self.byte(place, memory)? {
            return Ok(Some(Scalar::Int(byte)));
        }
        let from = self.addresses(place, memory)?;
        let cell = self.tracked(&from, memory)?;
        self.oblige(cell.unset, "reads a value that was never set", span);
        self.is_alive(cell.value.as_ref(), memory, span);
        // If the cell was never set, the obligation fails.
        Ok(Some(cell.value.clone().unwrap_or(Scalar::Int(Int::constant(0)))))
    }

    /// A pointer to a place; `is_whole`: it may move within the whole object.
    fn pointer(
        &mut self,
        place: &'u Place,
        is_whole: bool,
        memory: &mut Memory,
    ) -> Done<Option<Scalar>> {
        let whole = n_cells(self.unit, &place.ty).ok_or("the size of an object is not known")?;
        // The pointer to an element may move within its array (C99 6.5.6p8), and a pointer to anything else only within that.
        let cases = self
            .reached(place, memory)?
            .into_iter()
            .map(|(it, left, when)| (Pointer::To(it, if is_whole { whole } else { left }), when));
        let cases = cases.collect();
        Ok(Some(Scalar::Pointer(pointer_cases(&mut self.aig, cases))))
    }

    /// `c ? a : b`; only the chosen operand is evaluated.
    fn choose(
        &mut self,
        c: &'u Expr,
        a: &'u Expr,
        b: &'u Expr,
        memory: &mut Memory,
    ) -> Done<Option<Scalar>> {
        let when = self.truth(c, memory)?;
        match when.as_constant() {
            Some(true) => return self.evaluate(a, memory),
            Some(false) => return self.evaluate(b, memory),
            None => {}
        }
        let mut other = memory.clone();
        self.assume(c, true, memory);
        self.assume(c, false, &mut other);
        let (yes, no) = (self.on_path(when, a, memory)?, self.on_path(!when, b, &mut other)?);
        self.join(when, memory, other);
        let (Some(yes), Some(no)) = (yes, no) else { return Ok(None) };
        Ok(merge_scalars(&mut self.aig, &[(when, &yes), (!when, &no)]))
    }

    /// Changes a place: its value is converted to a type for the operation. Returns the values before and after.
    fn updated(
        &mut self,
        op: BinaryOp,
        place: &'u Place,
        operand: &Int,
        ty: &Type,
        memory: &mut Memory,
        loc: Loc,
    ) -> Done<(Scalar, Scalar)> {
        let to = self.addresses(place, memory)?;
        let old = self.loaded(&to, memory, loc)?;
        let wide = self.converted(old.clone(), &place.ty, ty)?;
        let (Scalar::Int(wide), Some(kind)) = (wide, self.unit.integer(ty)) else {
            return Err("arithmetic on pointers is not supported".to_owned());
        };
        let new = self.binary(op, kind, &wide, operand, loc)?;
        let new = self.converted(Scalar::Int(new), ty, &place.ty)?;
        self.store(&to, Rc::new(Cell::of(new.clone())), memory)?;
        Ok((old, new))
    }

    fn on_path(&mut self, when: Lit, expr: &'u Expr, memory: &mut Memory) -> Done<Option<Scalar>> {
        let before = self.here;
        self.here = self.aig.and(before, when);
        let done = self.evaluate(expr, memory);
        self.here = before;
        done
    }

    /// Joins two paths of an expression.
    fn join(&mut self, when: Lit, memory: &mut Memory, other: Memory) {
        let first = self.next_object();
        let ends = vec![(when, std::mem::take(memory)), (!when, other)];
        *memory = Memory::merge(&mut self.aig, ends, first);
    }

    /// A chain of `&&` or `||`, which can have any number of operands.
    fn logical(&mut self, is_and: bool, all: &'u [Expr], memory: &mut Memory) -> Done<Lit> {
        let before = self.here;
        let mut earlier = Vec::new();
        let last = self.operands(is_and, all, memory, &mut earlier);
        self.here = before;
        let (mut conjunction, mut values) = (last?, Vec::new());
        for Earlier { value, goes_on, memory: own, start } in earlier.into_iter().rev() {
            let later = std::mem::replace(memory, own);
            if !later.is_same(&start) {
                self.join(!goes_on, memory, later);
            }
            match is_and {
                true => conjunction = self.aig.and(value, conjunction),
                false => values.push(value),
            }
        }
        // The other side makes such disjunctions too: of any transition, of the steps of an output.
        Ok(if is_and {
            conjunction
        } else {
            self.aig.or_all(values.into_iter().chain([conjunction]))
        })
    }

    /// Evaluates operands up to one that decides the chain. Returns the value of the last one, after which `memory` is that of its path.
    fn operands(
        &mut self,
        is_and: bool,
        all: &'u [Expr],
        memory: &mut Memory,
        earlier: &mut Vec<Earlier>,
    ) -> Done<Lit> {
        let Some((last, others)) = all.split_last() else { return Ok(Lit::constant(is_and)) };
        for operand in others {
            let value = self.truth(operand, memory)?;
            if value == Lit::constant(!is_and) {
                return Ok(value);
            }
            let goes_on = if is_and { value } else { !value };
            let mut later = memory.clone();
            self.assume(operand, is_and, &mut later);
            let start = later.clone();
            let memory = std::mem::replace(memory, later);
            earlier.push(Earlier { value, goes_on, memory, start });
            self.here = self.aig.and(self.here, goes_on);
        }
        self.truth(last, memory)
    }

    fn unary(
        &mut self,
        expr: &'u Expr,
        op: UnaryOp,
        a: &'u Expr,
        memory: &mut Memory,
    ) -> Done<Option<Scalar>> {
        if op == UnaryOp::Not {
            let lit = self.truth(a, memory)?;
            return Ok(Some(Scalar::Int(Int::Bit(!lit))));
        }
        let value = self.int(a, memory)?;
        let kind = self.kind(expr)?;
        let zero = Int::constant(0);
        let result = match op {
            UnaryOp::Plus | UnaryOp::Not => value,
            UnaryOp::Neg => self.binary(BinaryOp::Sub, kind, &zero, &value, expr.span)?,
            // In two's complement, ~a is -1 - a, which never overflows.
            UnaryOp::BitNot => {
                self.binary(BinaryOp::Sub, kind, &Int::constant(-1), &value, expr.span)?
            }
        };
        Ok(Some(Scalar::Int(result)))
    }

    /// An operator on two integers of a common type (of a shift: the type of the left one).
    fn binary(&mut self, op: BinaryOp, kind: IntKind, a: &Int, b: &Int, loc: Loc) -> Done<Int> {
        let compared = match op {
            BinaryOp::Lt => Some(CompareOp::Lt),
            BinaryOp::Le => Some(CompareOp::Le),
            BinaryOp::Gt => Some(CompareOp::Gt),
            BinaryOp::Ge => Some(CompareOp::Ge),
            BinaryOp::Eq => Some(CompareOp::Eq),
            BinaryOp::Ne => Some(CompareOp::Ne),
            _ => None,
        };
        if let Some(op) = compared {
            return Ok(Int::Bit(value::compare(&mut self.aig, op, a, b)));
        }
        if matches!(op, BinaryOp::Shl | BinaryOp::Shr) {
            return self.shift(op == BinaryOp::Shl, kind, a, b, loc);
        }
        let arith = |op: ArithOp| {
            move |aig: &mut _, a: &Number, b: &Number| Some(value::arith(aig, op, a, b))
        };
        let aig = &mut self.aig;
        let found = match op {
            BinaryOp::Add => value::binary(aig, a, b, i128::checked_add, arith(ArithOp::Add)),
            BinaryOp::Sub => value::binary(aig, a, b, i128::checked_sub, arith(ArithOp::Sub)),
            // The product of two unsigned 64-bit constants can exceed 127 bits; its low bits, which the type keeps, are those of the wrapped product.
            BinaryOp::Mul => {
                let product = |x: i128, y: i128| Some(x.wrapping_mul(y));
                value::binary(aig, a, b, product, arith(ArithOp::Mul))
            }
            BinaryOp::Div => value::binary(aig, a, b, i128::checked_div, arith(ArithOp::Div)),
            BinaryOp::Rem => value::binary(aig, a, b, i128::checked_rem, arith(ArithOp::Mod)),
            BinaryOp::BitAnd => value::binary(
                aig,
                a,
                b,
                |x, y| Some(x & y),
                |aig, a, b| {
                    Some((value::bitwise(aig, a, b, |aig, x, y| aig.and(x, y)), Lit::FALSE))
                },
            ),
            BinaryOp::BitOr => value::binary(
                aig,
                a,
                b,
                |x, y| Some(x | y),
                |aig, a, b| Some((value::bitwise(aig, a, b, |aig, x, y| aig.or(x, y)), Lit::FALSE)),
            ),
            BinaryOp::BitXor => value::binary(
                aig,
                a,
                b,
                |x, y| Some(x ^ y),
                |aig, a, b| {
                    Some((value::bitwise(aig, a, b, |aig, x, y| aig.xor(x, y)), Lit::FALSE))
                },
            ),
            _ => None,
        };
        let (exact, without) = found.ok_or("an operator is not supported")?;
        if op == BinaryOp::Rem && self.unit.machine.is_signed(kind) {
            // The remainder exists only if the quotient does (C99 6.5.5p6).
            let least = self.unit.machine.range(kind).0;
            let (is_least, is_minus_one) = (a.is(&mut self.aig, least), b.is(&mut self.aig, -1));
            let overflows = self.aig.and(is_least, is_minus_one);
            self.oblige(overflows, "overflows", loc);
        }
        self.oblige(without, "divides by 0", loc);
        self.fitted(exact, kind, loc)
    }

    /// The exact result of an operator in its type: unsigned types wrap, signed ones must contain it (C99 6.2.5p9, 6.5p5).
    fn fitted(&mut self, exact: Int, kind: IntKind, loc: Loc) -> Done<Int> {
        let machine = self.unit.machine;
        if machine.is_signed(kind) {
            let (lo, hi) = machine.range(kind);
            let outside = exact.outside(&mut self.aig, lo, hi);
            self.oblige(outside, "overflows", loc);
        }
        Ok(exact.wrapped(&mut self.aig, machine.bits(kind), machine.is_signed(kind)))
    }

    fn shift(&mut self, is_left: bool, kind: IntKind, a: &Int, b: &Int, loc: Loc) -> Done<Int> {
        let machine = self.unit.machine;
        let bits = machine.bits(kind);
        let bad = b.outside(&mut self.aig, 0, i128::from(bits) - 1);
        self.oblige(bad, "shifts by too many bits", loc);
        if is_left && machine.is_signed(kind) {
            let negative = value::compare(&mut self.aig, CompareOp::Lt, a, &Int::constant(0));
            self.oblige(negative, "shifts a negative number to the left", loc);
        }
        let amounts = b.cases().unwrap_or_else(|| {
            let (least, largest) = b.number(&mut self.aig).bounds();
            let all = least.max(0)..=largest.min(i128::from(bits) - 1);
            all.map(|amount| (amount, b.is(&mut self.aig, amount))).collect()
        });
        let mut ways = Vec::new();
        for (amount, when) in amounts {
            let Some(by) = usize::try_from(amount).ok().filter(|by| *by < 64) else { continue };
            let value = match a.cases() {
                Some(cases) => {
                    let shifted = |x: i128| if is_left { x << by } else { x >> by };
                    Int::choice(
                        &mut self.aig,
                        cases.into_iter().map(|(x, when)| (shifted(x), when)),
                    )
                }
                None => {
                    let a = a.number(&mut self.aig);
                    Int::Word(if is_left {
                        value::shifted_left(&a, by)
                    } else {
                        value::shifted_right(&a, by)
                    })
                }
            };
            ways.push((when, value));
        }
        let exact = match ways.as_slice() {
            [(_, only)] => only.clone(),
            _ => Int::merge(&mut self.aig, &ways),
        };
        self.fitted(exact, kind, loc)
    }

    /// A value converted to another type (C99 6.3).
    fn converted(&mut self, value: Scalar, from: &Type, to: &Type) -> Done<Scalar> {
        if let Some(kind) = self.unit.integer(to) {
            if kind == IntKind::Bool {
                let lit = self.is_not_zero(&value);
                return Ok(Scalar::Int(Int::Bit(lit)));
            }
            let Scalar::Int(value) = value else {
                return Err("the conversion of a pointer to a number is not supported".to_owned());
            };
            let machine = self.unit.machine;
            let wrapped = value.wrapped(&mut self.aig, machine.bits(kind), machine.is_signed(kind));
            return Ok(Scalar::Int(wrapped));
        }
        match (&value, to) {
            (Scalar::Pointer(cases), Type::Pointer(target)) => {
                let is_null = cases.iter().all(|(pointer, _)| *pointer == Pointer::Null);
                let keeps_const =
                    |from: &Qualified| target.qualifiers.is_const || !from.qualifiers.is_const;
                let is_same = from.target().is_some_and(|it| it.ty == target.ty && keeps_const(it));
                let stays = |from: &Qualified| from.qualifiers.space == target.qualifiers.space;
                if !is_null && !from.target().is_some_and(stays) {
                    return Err("a conversion between pointers to different address spaces is not supported".to_owned());
                }
                if is_null || is_same {
                    return Ok(value);
                }
                if let Some(bytes) = self.as_bytes(cases, from, target) {
                    return Ok(bytes);
                }
                Err("a conversion between pointers that changes the type or drops `const` is not supported"
                    .to_owned())
            }
            (Scalar::Int(number), Type::Pointer(_)) if number.as_constant() == Some(0) => {
                Ok(Scalar::Pointer(vec![(Pointer::Null, Lit::TRUE)]))
            }
            _ => Err("a conversion to a type that is not an integer is not supported".to_owned()),
        }
    }

    fn loaded(&mut self, from: &[(Address, Lit)], memory: &Memory, loc: Loc) -> Done<Scalar> {
        let cell = self.tracked(from, memory)?;
        self.oblige(cell.unset, "reads a value that was never set", loc);
        Ok(cell.value.clone().unwrap_or(Scalar::Int(Int::constant(0))))
    }

    /// The cell at an address that is one of several; its value must be tracked.
    fn tracked(&mut self, from: &[(Address, Lit)], memory: &Memory) -> Done<Rc<Cell>> {
        let cell = self.cell(from, memory)?;
        match cell.is_untracked() {
            true => Err("a read of a member whose value is not tracked".to_owned()),
            false => Ok(cell),
        }
    }

    /// The cell at an address that is one of several.
    fn cell(&mut self, from: &[(Address, Lit)], memory: &Memory) -> Done<Rc<Cell>> {
        let mut cells = Vec::with_capacity(from.len());
        for (address, when) in from {
            cells.push((*when, self.at(*address, memory)?));
        }
        match cells.as_slice() {
            [(_, only)] => Ok(only.clone()),
            all => {
                let all: Vec<(Lit, &Rc<Cell>)> = all.iter().map(|(when, it)| (*when, it)).collect();
                Ok(merge_cells(&mut self.aig, &all))
            }
        }
    }

    pub(super) fn at(&self, address: Address, memory: &Memory) -> Done<Rc<Cell>> {
        let cells = match address.object {
            Object::Constant(id) => self.constants.get(id),
            Object::Changing(id) => memory.object(id),
        };
        let cell = cells.and_then(|cells| cells.get(address.cell));
        cell.cloned().ok_or_else(|| "an access is outside of its object".to_owned())
    }

    fn store(&mut self, to: &[(Address, Lit)], cell: Rc<Cell>, memory: &mut Memory) -> Done<()> {
        for (address, when) in to {
            let Object::Changing(object) = address.object else {
                return Err("a constant is assigned".to_owned());
            };
            let old = self.at(*address, memory)?;
            let new = if old.is_untracked() {
                continue;
            } else if to.len() == 1 {
                cell.clone()
            } else {
                merge_cells(&mut self.aig, &[(*when, &cell), (!*when, &old)])
            };
            if !memory.put(object, address.cell, new) {
                return Err("an access is outside of its object".to_owned());
            }
        }
        Ok(())
    }

    // ---- places ----

    /// The addresses of a place with their conditions, of which exactly one is true.
    pub(super) fn addresses(
        &mut self,
        place: &'u Place,
        memory: &mut Memory,
    ) -> Done<Vec<(Address, Lit)>> {
        let all = self.reached(place, memory)?;
        Ok(all.into_iter().map(|(it, _, when)| (it, when)).collect())
    }

    /// Like [`Program::addresses`]; for an element of an array, each with the number of cells from there to the end of the array.
    fn reached(
        &mut self,
        place: &'u Place,
        memory: &mut Memory,
    ) -> Done<Vec<(Address, usize, Lit)>> {
        self.deeper(|this| this.part(place, memory))
    }

    fn part(&mut self, place: &'u Place, memory: &mut Memory) -> Done<Vec<(Address, usize, Lit)>> {
        if self.is_declared_volatile(place) {
            return Err("a volatile object is not supported".to_owned());
        }
        match &place.kind {
            PlaceKind::Symbol(id) => {
                let local = self.frames.last().and_then(|frame| frame.get(id));
                let object = local.or_else(|| self.statics.get(id)).copied();
                let object = object.ok_or_else(|| {
                    format!(
                        "the object `{}` keeps a value outside the instance; this is not supported",
                        self.unit.symbols[*id].name
                    )
                })?;
                Ok(vec![(Address { object, cell: 0 }, 0, Lit::TRUE)])
            }
            PlaceKind::Member(base, member) => {
                let offset = member_offset(self.unit, &base.ty, *member);
                let offset = offset.ok_or("a member of a structure is not known")?;
                let all = self.addresses(base, memory)?;
                Ok(all.into_iter().map(|(it, when)| (it.behind(offset), 0, when)).collect())
            }
            PlaceKind::Element(base, index) => {
                let index = self.int(index, memory)?;
                let all = self.addresses(base, memory)?;
                let Type::Array(element, Some(len)) = &base.ty else {
                    return Err("the length of an array is not known".to_owned());
                };
                let size = n_cells(self.unit, &element.ty)
                    .ok_or("the size of an array element is not known")?;
                let len = usize::try_from(*len).map_err(|_| "an array is too large")?;
                let from: Vec<(Address, usize, Lit)> =
                    all.into_iter().map(|(it, when)| (it, len, when)).collect();
                self.elements(&from, &index, size, place.span)
            }
            PlaceKind::At(pointer, index) => {
                let index = self.int(index, memory)?;
                let all = self.targets(pointer, memory, place.span)?;
                let size = n_cells(self.unit, &place.ty)
                    .ok_or("the size of an array element is not known")?;
                let from: Vec<(Address, usize, Lit)> = all
                    .into_iter()
                    .map(|(it, extent, when)| (it, extent / size.max(1), when))
                    .collect();
                self.elements(&from, &index, size, place.span)
            }
            PlaceKind::Deref(pointer) => self.targets(pointer, memory, place.span),
        }
    }

    /// The elements at an index, counted from one of several addresses, each with the number of its elements. Each result has the number of cells from there to
    /// the end of the array.
    fn elements(
        &mut self,
        from: &[(Address, usize, Lit)],
        index: &Int,
        size: usize,
        loc: Loc,
    ) -> Done<Vec<(Address, usize, Lit)>> {
        let mut all = Vec::new();
        for (address, len, when) in from {
            let len = *len;
            let outside = index.outside(&mut self.aig, 0, len as i128 - 1);
            let outside = self.aig.and(*when, outside);
            self.oblige(outside, "uses an index outside of its array", loc);
            let inside: Vec<(usize, Lit)> = match index.cases() {
                Some(cases) => cases
                    .into_iter()
                    .filter_map(|(value, when)| Some((usize::try_from(value).ok()?, when)))
                    .filter(|(value, _)| *value < len)
                    .collect(),
                None if len <= MAX_TARGETS => {
                    (0..len).map(|at| (at, index.is(&mut self.aig, at as i128))).collect()
                }
                None => return Err("an index into a large array is not supported".to_owned()),
            };
            for (at, is_here) in inside {
                let when = self.aig.and(*when, is_here);
                if when != Lit::FALSE {
                    all.push((address.behind(at * size), (len - at) * size, when));
                }
            }
        }
        if all.is_empty() {
            // The obligation above fails on each path that reaches this point.
            return Err("an index is always outside of its array".to_owned());
        }
        Ok(all)
    }
}
