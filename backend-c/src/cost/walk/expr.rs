//! Expressions: the cost of each operator and operand; the types decide its width.

use super::super::NotUnderstood;
use super::super::memory::size;
use super::super::tree::{Expr, Kind, Stmt, Type};
use super::frame::replaced;
use super::parts::is_handed_on;
use super::{Cost, Local, Walker, width};
use grafsynth_ir::Gather;
use std::rc::Rc;

/// The result of an expression.
#[derive(Debug, Clone)]
pub(super) struct Value {
    ty: Type,
    /// The number of bits that it needs, which may be less than the width of its type.
    bits: u8,
    /// True if it is in ROM.
    rom: bool,
    /// True if it is a member of a structure that is kept in registers.
    is_kept: bool,
}

impl Value {
    fn of(ty: Type, rom: bool) -> Value {
        let bits = match &ty {
            Type::Number { bits, .. } => *bits,
            Type::Void | Type::Pointer(..) | Type::Array(..) | Type::Struct(_) => 16,
        };
        Value { ty, bits, rom, is_kept: false }
    }
}

impl Walker<'_> {
    pub(super) fn find(&self, name: &str) -> Option<&Local> {
        self.locals.iter().rev().find(|(it, _)| &**it == name).map(|(_, local)| local)
    }

    fn is_kept(&self, name: &Rc<str>) -> bool {
        self.kept.contains(name)
    }

    pub(super) fn local(&mut self, bits: u8) {
        let machine = self.machine;
        let widths = if self.spilled { &machine.load } else { &machine.local };
        self.pay_width(widths, bits);
    }

    /// Adds the cost of an expression that is evaluated for its effect.
    pub(super) fn effect(&mut self, expr: &Expr) -> Result<(), NotUnderstood> {
        // `(void)name` and `((void)0)` cost nothing.
        if let Expr::Cast(Type::Void, inner) = expr
            && matches!(**inner, Expr::Number(_) | Expr::Name(_))
        {
            return Ok(());
        }
        self.value(expr).map(|_| ())
    }

    /// Adds the cost of an expression as a condition: every operand is evaluated, and each ends in a jump.
    pub(super) fn condition(&mut self, expr: &Expr) -> Result<(), NotUnderstood> {
        let machine = self.machine;
        if self.unit.value(expr).is_some() {
            return Ok(());
        }
        match expr {
            Expr::Binary("&&" | "||", a, b) => {
                self.condition(a)?;
                self.condition(b)
            }
            Expr::Unary("!", inner) => self.condition(inner),
            Expr::Call(name, arguments) if self.small.contains_key(&**name) => {
                match self.inlined(name, arguments) {
                    Some(body) => self.condition(&body),
                    None => self.unknown(format!("the function `{name}`")),
                }
            }
            Expr::Binary("==" | "!=" | "<" | "<=" | ">" | ">=", a, b) => {
                self.compared(a, b)?;
                self.pay(machine.branch);
                Ok(())
            }
            _ => {
                let value = self.value(expr)?;
                self.pay_width(&machine.compare, value.bits);
                self.pay(machine.branch);
                Ok(())
            }
        }
    }

    fn compared(&mut self, a: &Expr, b: &Expr) -> Result<(), NotUnderstood> {
        let machine = self.machine;
        let (a, b) = (self.operand(a)?, self.operand(b)?);
        self.pay_width(&machine.compare, a.bits.max(b.bits));
        Ok(())
    }

    /// The operand of an operator: constants are part of the instruction.
    fn operand(&mut self, expr: &Expr) -> Result<Value, NotUnderstood> {
        match self.unit.value(expr) {
            Some(value) => Ok(constant(value)),
            None => self.value(expr),
        }
    }

    /// Adds the cost of a value that is stored in this type.
    pub(super) fn value_into(&mut self, expr: &Expr, ty: &Type) -> Result<(), NotUnderstood> {
        let machine = self.machine;
        let value = self.value(expr)?;
        if let (Type::Number { bits, .. }, Type::Number { .. }) = (ty, &value.ty)
            && *bits > value.bits
        {
            self.pay_width(&machine.widen, *bits);
        }
        Ok(())
    }

    pub(super) fn value(&mut self, expr: &Expr) -> Result<Value, NotUnderstood> {
        let machine = self.machine;
        if let Some(known) = self.unit.value(expr) {
            let value = constant(known);
            self.pay_width(&machine.constant, value.bits);
            return Ok(value);
        }
        match expr {
            Expr::Number(_) | Expr::Nothing | Expr::List(_) => {
                Ok(Value::of(Type::number(16, false), false))
            }
            Expr::Name(name) => self.named(name),
            Expr::Member(..) | Expr::Index(..) | Expr::Unary("*", _) => {
                let (value, field) = self.place(expr)?;
                self.load(&value, field);
                Ok(value)
            }
            Expr::Unary("&", inner) => {
                let known =
                    if let Expr::Name(name) = &**inner { self.find(name).cloned() } else { None };
                let value = match known {
                    Some(local) => Value::of(local.ty, local.rom),
                    None => self.place(inner)?.0,
                };
                self.pay_width(&machine.sum, 16);
                Ok(Value::of(Type::Pointer(Rc::new(value.ty), value.rom), false))
            }
            Expr::Unary("!", _) | Expr::Binary("&&" | "||", ..) => {
                self.condition(expr)?;
                self.pay(machine.truth);
                Ok(Value::of(Type::BOOL, false))
            }
            Expr::Binary("==" | "!=" | "<" | "<=" | ">" | ">=", a, b) => {
                self.compared(a, b)?;
                self.pay(machine.truth);
                Ok(Value::of(Type::BOOL, false))
            }
            Expr::Unary(_, inner) => {
                let value = self.value(inner)?;
                let bits = self.promoted(&value);
                self.pay_width(&machine.sum, bits);
                Ok(Value::of(Type::number(bits, true), false))
            }
            Expr::Count(inner) => {
                let value = if matches!(**inner, Expr::Name(_)) {
                    self.value(inner)?
                } else {
                    let (value, field) = self.place(inner)?;
                    self.load(&value, field);
                    self.store(&value, field);
                    value
                };
                self.pay_width(&machine.sum, value.bits);
                Ok(value)
            }
            Expr::Binary(sign, a, b) => self.arithmetic(sign, a, b),
            Expr::Assign(operator, left, right) => self.assign(*operator, left, right),
            Expr::Choice(condition, yes, no) => self.choice(condition, yes, no),
            Expr::Cast(ty, inner) => self.cast(ty, inner),
            Expr::Call(name, arguments) => self.call(name, arguments),
        }
    }

    /// The value of a variable: a local, a parameter or a global.
    fn named(&mut self, name: &str) -> Result<Value, NotUnderstood> {
        let machine = self.machine;
        let local = self.find(name).cloned();
        let is_local = local.is_some();
        let value = match (local, self.unit.globals.get(name)) {
            (Some(local), _) => Value::of(local.ty, local.rom),
            (None, Some(global)) => Value::of(global.ty.clone(), global.rom),
            (None, None) => return self.unknown(format!("the name `{name}`")),
        };
        match value.ty {
            Type::Number { bits, .. } if value.rom => self.pay_width(&machine.rom, bits),
            Type::Number { bits, .. } if is_local => self.local(bits),
            Type::Number { bits, .. } => self.pay_width(&machine.load, bits),
            Type::Pointer(..) if is_local => self.local(16),
            Type::Array(..) if is_local => {}
            Type::Array(..) | Type::Pointer(..) => self.pay_width(&machine.constant, 16),
            Type::Void | Type::Struct(_) => {}
        }
        Ok(value)
    }

    /// `condition ? yes : no`. The worst-case path takes the more expensive arm.
    fn choice(&mut self, condition: &Expr, yes: &Expr, no: &Expr) -> Result<Value, NotUnderstood> {
        let machine = self.machine;
        self.condition(condition)?;
        let (before, n) = (self.cost, self.calls.len());
        let left = self.value(yes)?;
        let (first, calls) = (self.cost, self.calls.split_off(n));
        self.cost = before;
        let right = self.value(no)?;
        if first.time > self.cost.time {
            self.calls.truncate(n);
            self.calls.extend(calls);
        }
        self.cost = self.cost.or(first);
        self.pay(machine.jump);
        let value = if left.bits >= right.bits { left } else { right };
        // The narrower operand is widened to the wider one.
        self.pay_width(&machine.widen, value.bits);
        Ok(value)
    }

    /// A conversion: to a truth value, a comparison with zero; to a wider number, an extension.
    fn cast(&mut self, ty: &Type, inner: &Expr) -> Result<Value, NotUnderstood> {
        let machine = self.machine;
        let value = self.value(inner)?;
        let Type::Number { bits, is_bool, .. } = ty else {
            return Ok(Value::of(ty.clone(), value.rom));
        };
        if *is_bool && !matches!(value.ty, Type::Number { is_bool: true, .. }) {
            self.pay_width(&machine.compare, value.bits);
            self.pay(machine.truth);
        } else if *bits > value.bits {
            self.pay_width(&machine.widen, *bits);
        }
        Ok(Value::of(ty.clone(), false))
    }

    fn promoted(&self, value: &Value) -> u8 {
        match value.ty {
            Type::Number { bits, .. } => bits.max(self.machine.int_bits),
            Type::Void | Type::Pointer(..) | Type::Array(..) | Type::Struct(_) => 16,
        }
    }

    fn arithmetic(&mut self, sign: &str, a: &Expr, b: &Expr) -> Result<Value, NotUnderstood> {
        let machine = self.machine;
        if matches!(sign, "<<" | ">>") {
            let value = self.value(a)?;
            let bits = self.promoted(&value);
            let n = match self.unit.value(b) {
                Some(n) => u64::try_from(n).unwrap_or(0),
                None => {
                    self.value(b)?;
                    u64::from(bits) - 1
                }
            };
            // Unsigned: the operand of a left shift, and unsigned types.
            let has_sign =
                matches!(value.ty, Type::Number { bits: own, signed, .. } if signed || own < bits);
            if let Some((from, moved)) = machine.byte_shift
                && bits == 16
                && n >= from
                && (sign == "<<" || !has_sign)
                && self.unit.value(b).is_some()
            {
                self.pay(moved);
                return Ok(Value::of(Type::number(bits, false), false));
            }
            let (base, each) = &machine.shift;
            self.pay_width(base, bits);
            self.pay_times(each[width(bits)], n);
            return Ok(Value::of(Type::number(bits, false), false));
        }
        let (left, right) = (self.operand(a)?, self.operand(b)?);
        let both = left.bits.max(right.bits);
        let promoted = self.promoted(&left).max(self.promoted(&right));
        let (widths, bits) = match sign {
            // A bit of the result depends only on the same bits of the operands, so compilers compute only the bits that are used.
            "&" | "|" | "^" => (&machine.sum, both),
            "+" | "-" => (&machine.sum, promoted),
            "*" => (&machine.multiply, promoted),
            "/" | "%" => (&machine.divide, promoted),
            other => return self.unknown(format!("the operator `{other}`")),
        };
        if left.bits != right.bits {
            self.pay_width(&machine.widen, bits);
        }
        if matches!(sign, "*" | "/" | "%") {
            self.helper = self.helper.max(u64::from(machine.helper_stack[width(bits)]));
        }
        self.pay_width(widths, bits);
        let mut value = Value::of(Type::number(promoted, true), false);
        value.bits = bits;
        Ok(value)
    }

    fn assign(
        &mut self,
        operator: Option<&str>,
        left: &Expr,
        right: &Expr,
    ) -> Result<Value, NotUnderstood> {
        let machine = self.machine;
        if let Expr::Name(name) = left
            && let Some(local) = self.find(name).cloned()
        {
            self.value_into(right, &local.ty)?;
            match &local.ty {
                Type::Number { bits, .. } => {
                    if let Some(operator) = operator {
                        self.operated(operator, *bits);
                    }
                    self.local(*bits);
                }
                Type::Struct(_) => {
                    let bytes = size(self.unit, machine, &local.ty);
                    self.pay_times(machine.copy, bytes);
                }
                Type::Void | Type::Pointer(..) | Type::Array(..) => self.local(16),
            }
            return Ok(Value::of(local.ty, local.rom));
        }
        let (value, field) = self.place(left)?;
        self.value_into(right, &value.ty)?;
        if let Some(operator) = operator {
            self.load(&value, field);
            self.operated(operator, value.bits);
        }
        self.store(&value, field);
        Ok(value)
    }

    fn operated(&mut self, operator: &str, bits: u8) {
        let machine = self.machine;
        match operator {
            "*" => self.pay_width(&machine.multiply, bits),
            "/" | "%" => self.pay_width(&machine.divide, bits),
            "<<" | ">>" => {
                self.pay_width(&machine.shift.0, bits);
                self.pay_times(machine.shift.1[width(bits)], u64::from(bits));
            }
            _ => self.pay_width(&machine.sum, bits),
        }
    }

    /// The address of an object that is not in a register, and whether it is a bit-field.
    fn place(&mut self, expr: &Expr) -> Result<(Value, bool), NotUnderstood> {
        let machine = self.machine;
        match expr {
            Expr::Member(base, name) => {
                let is_kept = matches!(&**base, Expr::Name(name) if self.is_kept(name));
                let base = self.base(base)?;
                let rom = match &base.ty {
                    Type::Pointer(_, rom) => *rom,
                    Type::Void | Type::Number { .. } | Type::Array(..) | Type::Struct(_) => {
                        base.rom
                    }
                };
                match self.unit.member(&base.ty, name) {
                    Some(member) => {
                        let value = Value { is_kept, ..Value::of(member.ty.clone(), rom) };
                        Ok((value, member.is_bit))
                    }
                    None => self.unknown(format!("the member `{name}`")),
                }
            }
            Expr::Index(base, index) => {
                let base = self.base(base)?;
                let (element, rom) = match &base.ty {
                    Type::Array(element, _) => (Type::clone(element), base.rom),
                    Type::Pointer(element, rom) => (Type::clone(element), *rom),
                    Type::Void | Type::Number { .. } | Type::Struct(_) => {
                        return self.unknown("an index of something that is not an array");
                    }
                };
                if self.unit.value(index).is_none() {
                    self.value(index)?;
                    let bytes = size(self.unit, machine, &element);
                    let simple = bytes.is_power_of_two();
                    self.pay(if simple { machine.index.0 } else { machine.index.1 });
                }
                Ok((Value::of(element, rom), false))
            }
            Expr::Unary("*", inner) => {
                let value = self.value(inner)?;
                match &value.ty {
                    Type::Pointer(element, rom) => {
                        Ok((Value::of(Type::clone(element), *rom), false))
                    }
                    Type::Void | Type::Number { .. } | Type::Array(..) | Type::Struct(_) => {
                        self.unknown("a `*` before something that is not a pointer")
                    }
                }
            }
            Expr::Name(name) => match self.unit.globals.get(name) {
                Some(global) => Ok((Value::of(global.ty.clone(), global.rom), false)),
                None => self.unknown(format!("the name `{name}`")),
            },
            _ => self.unknown("a place"),
        }
    }

    /// Adds the cost of the object whose member or element is used: a pointer in a register costs nothing more.
    fn base(&mut self, expr: &Expr) -> Result<Value, NotUnderstood> {
        if let Expr::Name(name) = expr
            && let Some(local) = self.find(name).cloned()
        {
            if self.spilled && matches!(local.ty, Type::Pointer(..)) && !self.is_kept(name) {
                self.local(16);
            }
            return Ok(Value::of(local.ty, local.rom));
        }
        if matches!(expr, Expr::Member(..) | Expr::Index(..)) {
            let (value, field) = self.place(expr)?;
            if matches!(value.ty, Type::Pointer(..)) {
                self.load(&value, field);
            }
            return Ok(value);
        }
        self.value(expr)
    }

    fn load(&mut self, value: &Value, field: bool) {
        let machine = self.machine;
        match &value.ty {
            Type::Number { bits, .. } if value.is_kept => self.local(*bits),
            Type::Number { .. } if field => self.pay(machine.field.0),
            Type::Number { bits, .. } if value.rom => self.pay_width(&machine.rom, *bits),
            Type::Number { bits, .. } => self.pay_width(&machine.load, *bits),
            Type::Pointer(..) => self.pay_width(&machine.load, 16),
            Type::Void | Type::Array(..) | Type::Struct(_) => {}
        }
    }

    fn store(&mut self, value: &Value, field: bool) {
        let machine = self.machine;
        match &value.ty {
            Type::Number { bits, .. } if value.is_kept => self.local(*bits),
            Type::Number { .. } if field => self.pay(machine.field.1),
            Type::Number { bits, .. } if self.far => self.pay_width(&machine.far_store, *bits),
            Type::Number { bits, .. } => self.pay_width(&machine.store, *bits),
            Type::Pointer(..) => self.pay_width(&machine.far_store, 16),
            Type::Struct(_) => {
                let bytes = size(self.unit, machine, &value.ty);
                self.pay_times(machine.copy, bytes);
            }
            Type::Void | Type::Array(..) => {}
        }
    }

    fn call(&mut self, name: &Rc<str>, arguments: &[Expr]) -> Result<Value, NotUnderstood> {
        let machine = self.machine;
        if matches!(&**name, "memcpy" | "memcmp" | "memset") {
            let bytes = match arguments.last() {
                Some(Expr::Number(bytes)) => u64::try_from(*bytes).unwrap_or(0),
                Some(_) | None => return self.unknown(format!("the length of `{name}`")),
            };
            self.pay(machine.call);
            self.pay_times(machine.argument[1], 3);
            self.spend(u64::from(machine.copy.time) * bytes);
            return Ok(Value::of(Type::number(16, true), false));
        }
        if &**name == "__sync_synchronize" {
            return Ok(Value::of(Type::Void, false));
        }
        if let Some(body) = self.inlined(name, arguments) {
            return self.value(&body);
        }
        let part = self.parts.get(&**name).copied();
        for (at, argument) in arguments.iter().enumerate() {
            let parameter = part.and_then(|it| it.parameters.get(at));
            if parameter.is_some_and(|(_, ty)| is_handed_on(ty, argument)) {
                continue;
            }
            let value = self.value(argument)?;
            self.pay_width(&machine.argument, value.bits);
        }
        let returns = match self.unit.declared.get(name) {
            Some(ty) => ty.clone(),
            None => return self.unknown(format!("the function `{name}`")),
        };
        match self.by_name.get(name).copied() {
            Some(index) => {
                if part.is_none() {
                    self.pay(machine.call);
                }
                let callee = self.summaries.get(index).cloned().unwrap_or_default();
                self.cost = self.cost.plus(Cost { own: 0, own_user: 0, ..callee.cost });
                self.calls.push(index);
            }
            None if self.unit.functions.iter().any(|it| it.name == *name) => {
                return self.unknown(format!("`{name}`, called before its definition"));
            }
            None => {
                self.pay(machine.user);
                self.cost.user = self.cost.user.saturating_add(1);
                self.cost.own_user = self.cost.own_user.saturating_add(1);
            }
        }
        Ok(Value::of(returns, false))
    }

    /// The expression of a small header function, replacing its call: every compiler inlines it.
    pub(super) fn inlined(&self, name: &str, arguments: &[Expr]) -> Option<Expr> {
        let function = self.small.get(name)?;
        match function.body.as_slice() {
            [Stmt { kind: Kind::Return(Some(value)), .. }] => {
                let names = function.parameters.iter().map(|(name, _)| &**name);
                Some(replaced(value, &names.zip(arguments).gather()))
            }
            _ => None,
        }
    }
}

fn constant(value: i128) -> Value {
    let bits = match value {
        -128..=255 => 8,
        -32768..=65535 => 16,
        -0x8000_0000..=0xffff_ffff => 32,
        _ => 64,
    };
    Value::of(Type::number(bits, value < 0), false)
}
