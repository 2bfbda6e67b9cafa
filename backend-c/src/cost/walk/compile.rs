//! Translates statements and expressions into the form for path exploration: names become cells, and each piece keeps its cost.

use super::super::paths::code::{Address, Base, Code, Op, Price, Question, Routine, What};
use super::super::paths::values::Kind as Numbers;
use super::super::tree::{self, Expr, Function, Stmt, Type, Unit};
use super::{Cost, Walker};

/// An array with more cells than this is represented by one cell.
const CELLS: usize = 512;

/// The pointer to a location that is not tracked.
pub(in crate::cost) const NOWHERE: i64 = -1;

/// The cells of a type.
pub(in crate::cost) fn cells(unit: &Unit, ty: &Type) -> usize {
    match ty {
        Type::Void => 0,
        Type::Number { .. } | Type::Pointer(..) => 1,
        Type::Array(element, n) => {
            let one = cells(unit, element);
            let all = usize::try_from(*n).ok().and_then(|n| n.checked_mul(one));
            all.filter(|all| *all <= CELLS).unwrap_or(one)
        }
        Type::Struct(index) => {
            let members = unit.structs.get(*index).map(Vec::as_slice).unwrap_or_default();
            members.iter().map(|it| cells(unit, &it.ty)).sum()
        }
    }
}

fn is_summary(unit: &Unit, ty: &Type) -> bool {
    matches!(ty, Type::Array(element, n) if *n != 1 && cells(unit, ty) == cells(unit, element))
}

/// The number type of a type; `None` if it is not a number. A one-bit bit-field (`bool name : 1`) counts as `bool`.
pub(in crate::cost) fn numbers(ty: &Type) -> Option<Numbers> {
    match ty {
        Type::Number { bits, signed, is_bool } => {
            Some(Numbers { bits: *bits, signed: *signed, is_bool: *is_bool })
        }
        Type::Void | Type::Pointer(..) | Type::Array(..) | Type::Struct(_) => None,
    }
}

/// The branches of an `if` with their conditions; `None` if a condition cannot be executed.
pub(super) fn all_asked(
    ways: Vec<(Option<Question>, Vec<Op>, Price)>,
) -> Option<Vec<(Question, Vec<Op>, Price)>> {
    ways.into_iter().map(|(question, body, jump)| Some((question?, body, jump))).collect()
}

/// The condition of a loop without its counter; `Some(None)` if nothing else is tested; `None` if the loop has no counter, or if the body or the rest of the condition reads the counter.
pub(super) fn without_counter<'e>(
    stmt: &Stmt,
    condition: Option<&'e Expr>,
    body: &[Stmt],
) -> Option<Option<&'e Expr>> {
    let tree::Kind::Loop { init: Some(init), step: Some(Expr::Count(_)), .. } = &stmt.kind else {
        return None;
    };
    let tree::Kind::Local { name, .. } = &init.kind else { return None };
    let is_counter = |expr: &Expr| matches!(expr, Expr::Binary("<", a, _) if matches!(&**a, Expr::Name(it) if it == name));
    let condition = condition?;
    let rest = if is_counter(condition) {
        None
    } else if let Expr::Binary("&&", a, b) = condition
        && is_counter(a)
    {
        Some(&**b)
    } else {
        return None;
    };
    let mut is_read = false;
    let mut look = |it: &str| is_read |= it == &**name;
    tree::each_name(body, &mut look);
    rest.into_iter().for_each(|rest| tree::names_in(rest, &mut look));
    (!is_read).then_some(rest)
}

/// A statement reduced to its cost.
pub(super) fn paid(op: &Op) -> Op {
    let price = match &op.what {
        What::Set(price, ..) | What::Pay(price) => *price,
        What::If(..)
        | What::Switch { .. }
        | What::Loop { .. }
        | What::Return(..)
        | What::Break
        | What::Continue
        | What::Block(_)
        | What::Forget(..)
        | What::Lost(_) => Price::default(),
    };
    Op { line: op.line, what: What::Pay(price) }
}

/// A cost without the called functions.
pub(super) fn own(cost: Cost) -> Price {
    Price { time: cost.own, user: cost.own_user }
}

impl Walker<'_> {
    /// Allocates cells for an object of this type; returns the first one.
    pub(super) fn place_for(&mut self, ty: &Type) -> usize {
        let first = self.n_cells;
        self.n_cells += cells(self.unit, ty);
        first
    }

    /// The executable form of a statement that was walked; if path exploration cannot follow a part of it, the result is [`What::Lost`].
    pub(super) fn op(&mut self, line: u32, make: impl FnOnce(&mut Self) -> What) -> Op {
        self.lost = None;
        let text = self.text;
        let helper = self.helper;
        let what = make(self);
        self.text = text;
        self.helper = helper;
        let what = match self.lost.take() {
            Some(why) => What::Lost(why),
            None => what,
        };
        Op { line, what }
    }

    /// A condition; `None` if it cannot be executed.
    pub(super) fn op_of_question(&mut self, line: u32, condition: &Expr) -> Option<Question> {
        let mut found = None;
        let op = self.op(line, |it| {
            found = Some(it.question(condition, true));
            What::Break
        });
        found.filter(|_| matches!(op.what, What::Break))
    }

    pub(super) fn lost_op(&mut self, why: &str) -> What {
        self.lost.get_or_insert_with(|| why.to_owned());
        What::Break
    }

    /// The executable form of a function that was walked; `below` is the maximum number of cells of its callees.
    pub(super) fn routine(
        &mut self,
        function: &Function,
        body: Vec<Op>,
        entry: u64,
        below: usize,
    ) -> Routine {
        let unit = self.unit;
        let parameters = function
            .parameters
            .iter()
            .scan(0, |next, (_, ty)| {
                let at = *next;
                *next += cells(unit, ty);
                Some((at, numbers(ty)))
            })
            .collect();
        Routine {
            parameters,
            body,
            entry: Price { time: entry, user: 0 },
            gives: unit.declared.get(&function.name).and_then(numbers),
            cells: self.n_cells,
            depth: self.n_cells + below,
            line: function.body.first().map_or(0, |it| it.line.saturating_sub(1)),
        }
    }

    /// The executable form of an expression that is evaluated for its effect; `cost` is the cost of the whole expression.
    pub(super) fn effect_op(&mut self, expr: &Expr, cost: Cost) -> What {
        match expr {
            Expr::Cast(Type::Void, _) | Expr::Nothing => What::Pay(own(cost)),
            Expr::Assign(operator, left, right) => {
                let Some((address, ty)) = self.address(left) else {
                    return self.lost_op("an assignment to an unknown location");
                };
                let Some(kind) = numbers(&ty) else {
                    return match address.base {
                        Base::Nowhere => What::Pay(own(cost)),
                        Base::Cell(_) | Base::Behind(_) => {
                            if let Type::Pointer(..) = ty {
                                let value = self.code(right);
                                let any = Numbers { bits: 64, signed: true, is_bool: false };
                                return What::Set(own(cost), Some((address, any)), value);
                            }
                            self.lost_op("a structure that is copied")
                        }
                    };
                };
                let (right, priced) = self.root(right);
                let value = match operator {
                    Some(sign) => Code::Binary(
                        sign,
                        Box::new(Code::Read(Box::new(address.clone()), kind)),
                        Box::new(right),
                    ),
                    None => right,
                };
                What::Set(own(cost).less(priced), Some((address, kind)), value)
            }
            Expr::Count(inner) => {
                let Some((address, ty)) = self.address(inner) else {
                    return self.lost_op("an increment of an unknown location");
                };
                let kind = numbers(&ty).unwrap_or(Numbers::int(16));
                let value = Code::Read(Box::new(address.clone()), kind);
                let value = Code::Binary("+", Box::new(value), Box::new(Code::Constant(1)));
                What::Set(own(cost), Some((address, kind)), value)
            }
            _ => {
                let value = self.code(expr);
                What::Set(own(cost), None, value)
            }
        }
    }

    /// The executable form of the initialisation of a local.
    pub(super) fn local_op(
        &mut self,
        cell: usize,
        ty: &Type,
        init: Option<&Expr>,
        cost: Cost,
    ) -> What {
        let Some(init) = init else { return What::Pay(own(cost)) };
        let kind = match ty {
            Type::Number { .. } => numbers(ty),
            // A row of a table is not tracked, so it keeps no states apart.
            Type::Pointer(_, true) => None,
            Type::Pointer(_, false) => Some(Numbers { bits: 64, signed: true, is_bool: false }),
            Type::Void | Type::Array(..) | Type::Struct(_) => None,
        };
        let address =
            Address { base: Base::Cell(cell), offset: 0, indices: Vec::new(), is_summary: false };
        match (kind, ty) {
            (Some(kind), _) => {
                let (value, priced) = self.root(init);
                What::Set(own(cost).less(priced), Some((address, kind)), value)
            }
            // Its cells have no known value.
            (None, _) => What::Pay(own(cost)),
        }
    }

    /// The value that a statement tests or stores, and the part of its cost that depends on the path: the conditions within a Boolean
    /// expression.
    pub(super) fn root(&mut self, expr: &Expr) -> (Code, Price) {
        if matches!(expr, Expr::Unary("!", _) | Expr::Binary("&&" | "||", ..))
            && self.unit.value(expr).is_none()
        {
            let question = self.question(expr, true);
            let price = question.price();
            return (Code::Truth(Box::new(question)), price);
        }
        (self.code(expr), Price::default())
    }

    pub(super) fn question(&mut self, expr: &Expr, is_priced: bool) -> Question {
        if let Some(value) = self.unit.value(expr) {
            return Question::Some(Price::default(), Code::Constant(i64::from(value != 0)));
        }
        match expr {
            Expr::Binary("&&", a, b) => Question::Both(
                Box::new(self.question(a, is_priced)),
                Box::new(self.question(b, is_priced)),
            ),
            Expr::Binary("||", a, b) => Question::Either(
                Box::new(self.question(a, is_priced)),
                Box::new(self.question(b, is_priced)),
            ),
            Expr::Unary("!", inner) => Question::Not(Box::new(self.question(inner, is_priced))),
            Expr::Call(name, arguments) if self.small.contains_key(&**name) => {
                match self.inlined(name, arguments) {
                    Some(body) => self.question(&body, is_priced),
                    None => Question::Some(Price::default(), Code::Unknown(Numbers::int(16))),
                }
            }
            Expr::Binary(sign @ ("==" | "!=" | "<" | "<=" | ">" | ">="), a, b) => {
                let price = self.asked(expr, is_priced);
                Question::Compare(price, sign, self.code(a), self.code(b))
            }
            _ => {
                let price = self.asked(expr, is_priced);
                Question::Some(price, self.code(expr))
            }
        }
    }

    fn asked(&mut self, expr: &Expr, is_priced: bool) -> Price {
        if !is_priced {
            return Price::default();
        }
        match self.measured(|it| it.condition(expr)) {
            Ok((cost, _)) => own(cost),
            // This does not occur: the walk has already understood the expression.
            Err(_) => Price::default(),
        }
    }

    pub(super) fn code(&mut self, expr: &Expr) -> Code {
        let int = Numbers::int(self.machine.int_bits);
        if let Some(value) = self.unit.value(expr) {
            return match i64::try_from(value) {
                Ok(value) => Code::Constant(value),
                Err(_) => Code::Unknown(Numbers { bits: 64, signed: true, is_bool: false }),
            };
        }
        let boxed = |it: &mut Self, expr: &Expr| Box::new(it.code(expr));
        match expr {
            Expr::Unary("!", _)
            | Expr::Binary("&&" | "||" | "==" | "!=" | "<" | "<=" | ">" | ">=", ..) => {
                Code::Truth(Box::new(self.question(expr, false)))
            }
            Expr::Unary("&", inner) => match self.address(inner) {
                Some((address, _)) => Code::Pointer(Box::new(address)),
                None => Code::Constant(NOWHERE),
            },
            Expr::Unary(sign @ ("-" | "~" | "+"), inner) => Code::Unary(sign, boxed(self, inner)),
            Expr::Index(base, index) if matches!(&**base, Expr::Name(name) if self.find(name).is_none()) => {
                self.element(base, index)
            }
            Expr::Name(_) | Expr::Member(..) | Expr::Index(..) | Expr::Unary(..) => match self
                .address(expr)
            {
                Some((address, ty)) => match (numbers(&ty), &ty) {
                    (Some(kind), _) if matches!(address.base, Base::Nowhere) => Code::Unknown(kind),
                    (Some(kind), _) => Code::Read(Box::new(address), kind),
                    (None, Type::Pointer(_, false)) if !matches!(address.base, Base::Nowhere) => {
                        Code::Read(
                            Box::new(address),
                            Numbers { bits: 64, signed: true, is_bool: false },
                        )
                    }
                    (None, Type::Array(..)) if !matches!(address.base, Base::Nowhere) => {
                        Code::Pointer(Box::new(address))
                    }
                    (None, _) => Code::Constant(NOWHERE),
                },
                None => Code::Unknown(int),
            },
            Expr::Binary(sign, a, b) => {
                let a = boxed(self, a);
                Code::Binary(sign, a, boxed(self, b))
            }
            Expr::Choice(condition, yes, no) => {
                let question = Box::new(self.question(condition, false));
                let yes = boxed(self, yes);
                Code::Choice(question, yes, boxed(self, no))
            }
            Expr::Cast(ty, inner) => {
                let inner = boxed(self, inner);
                match numbers(ty) {
                    Some(kind) => Code::Cast(kind, inner),
                    None => *inner,
                }
            }
            Expr::Call(name, arguments) => {
                if let Some(body) = self.inlined(name, arguments) {
                    return self.code(&body);
                }
                let given: Vec<Code> = arguments.iter().map(|it| self.code(it)).collect();
                match self.by_name.get(name) {
                    Some(index) => Code::Call(*index, given),
                    None if matches!(&**name, "memcpy" | "memset" | "memmove" | "memcmp") => {
                        self.lost_op("a call of the C library");
                        Code::Unknown(int)
                    }
                    None => {
                        Code::Unknown(self.unit.declared.get(name).and_then(numbers).unwrap_or(int))
                    }
                }
            }
            Expr::Count(_) | Expr::Assign(..) => {
                self.lost_op("an assignment within an expression");
                Code::Unknown(int)
            }
            Expr::Number(_) | Expr::List(_) | Expr::Nothing => Code::Unknown(int),
        }
    }

    /// An element of a table in ROM.
    fn element(&mut self, base: &Expr, index: &Expr) -> Code {
        let Expr::Name(name) = base else { return Code::Unknown(Numbers::int(16)) };
        let global = self.unit.globals.get(name);
        let kind = match global.map(|it| &it.ty) {
            Some(Type::Array(element, _)) => numbers(element),
            Some(Type::Void | Type::Number { .. } | Type::Pointer(..) | Type::Struct(_)) | None => {
                None
            }
        };
        let Some(kind) = kind else { return Code::Constant(NOWHERE) };
        let index = self.code(index);
        match global.and_then(|it| it.numbers.clone()) {
            Some(all) => Code::Table(all, Box::new(index), kind),
            None => Code::Unknown(kind),
        }
    }

    /// The address of an object, and its type; `None` if it is not known.
    fn address(&mut self, expr: &Expr) -> Option<(Address, Type)> {
        let at = |base: Base| Address { base, offset: 0, indices: Vec::new(), is_summary: false };
        match expr {
            Expr::Name(name) => match self.find(name).cloned() {
                Some(local) if local.rom => Some((at(Base::Nowhere), local.ty)),
                Some(local) => Some((at(Base::Cell(local.cell)), local.ty)),
                None => {
                    let ty = self.unit.globals.get(name)?.ty.clone();
                    Some((at(Base::Nowhere), ty))
                }
            },
            Expr::Unary("*", inner) => {
                let (base, ty) = self.behind(inner)?;
                Some((at(base), ty))
            }
            Expr::Member(base, name) => {
                let (mut address, ty) = match self.behind(base) {
                    Some((base, ty)) => (at(base), ty),
                    None => self.address(base)?,
                };
                let members = self.unit.members(&ty)?;
                let mut offset = 0;
                for member in members {
                    if member.name == *name {
                        address.offset += offset;
                        return Some((address, member.ty.clone()));
                    }
                    offset += cells(self.unit, &member.ty);
                }
                None
            }
            Expr::Index(base, index) => {
                if let Some((base, ty)) = self.behind(base) {
                    let index = self.code(index);
                    let mut address = at(base);
                    address.indices.push((index, usize::MAX, cells(self.unit, &ty)));
                    return Some((address, ty));
                }
                let (mut address, ty) = self.address(base)?;
                let Type::Array(element, n) = &ty else { return None };
                let element = Type::clone(element);
                if is_summary(self.unit, &ty) {
                    address.is_summary = true;
                } else {
                    let index = self.code(index);
                    let n = usize::try_from(*n).unwrap_or(usize::MAX);
                    address.indices.push((index, n, cells(self.unit, &element)));
                }
                Some((address, element))
            }
            _ => None,
        }
    }

    /// The target of a local pointer.
    fn behind(&mut self, expr: &Expr) -> Option<(Base, Type)> {
        let Expr::Name(name) = expr else { return None };
        let local = self.find(name)?;
        match &local.ty {
            Type::Pointer(ty, true) => Some((Base::Nowhere, Type::clone(ty))),
            Type::Pointer(ty, false) => Some((Base::Behind(local.cell), Type::clone(ty))),
            Type::Void | Type::Number { .. } | Type::Array(..) | Type::Struct(_) => None,
        }
    }

    /// Frees the cells of the locals that a list declares, because nothing reads them after the list.
    pub(super) fn forget(&mut self, line: u32, from: usize) -> Option<Op> {
        (self.n_cells > from).then_some(Op { line, what: What::Forget(from, self.n_cells) })
    }

    /// The executable form of a statement that was just walked.
    pub(super) fn taken(&mut self, stmt: &Stmt) -> Op {
        let op = self.ops.get_mut(stmt.id).and_then(Option::take);
        op.unwrap_or_else(|| Op { line: stmt.line, what: What::Lost("a statement".to_owned()) })
    }
}
