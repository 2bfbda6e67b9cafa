//! The emitted C as a tree: types, functions, statements, expressions. [`super::read`] makes it.

use std::collections::BTreeMap;
use std::rc::Rc;

/// A type.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Type {
    Void,
    /// A number or `bool`: its number of bits, and whether it is signed.
    Number {
        bits: u8,
        signed: bool,
        is_bool: bool,
    },
    /// A pointer, and whether its target is in ROM.
    Pointer(Rc<Type>, bool),
    Array(Rc<Type>, u64),
    /// A structure, by its index in [`Unit::structs`].
    Struct(usize),
}

impl Type {
    pub(super) const BOOL: Type = Type::Number { bits: 8, signed: false, is_bool: true };

    pub(super) fn number(bits: u8, signed: bool) -> Type {
        Type::Number { bits, signed, is_bool: false }
    }
}

/// A member of a structure.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Member {
    pub(super) name: Rc<str>,
    pub(super) ty: Type,
    /// True for a bit-field of one bit.
    pub(super) is_bit: bool,
}

/// An expression.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Expr {
    Number(i128),
    Name(Rc<str>),
    Member(Box<Expr>, Rc<str>),
    Index(Box<Expr>, Box<Expr>),
    Call(Rc<str>, Vec<Expr>),
    /// `!`, `~`, `-`, `+`, `*`, `&`.
    Unary(&'static str, Box<Expr>),
    /// `++`, prefix or postfix.
    Count(Box<Expr>),
    Binary(&'static str, Box<Expr>, Box<Expr>),
    /// `=`, or a compound assignment (`|=`: Some("|")).
    Assign(Option<&'static str>, Box<Expr>, Box<Expr>),
    Choice(Box<Expr>, Box<Expr>, Box<Expr>),
    Cast(Type, Box<Expr>),
    /// A value in braces, of a table or an aggregate; the payload is its length.
    List(u64),
    /// A label or a barrier: costs nothing.
    Nothing,
}

/// A statement with its own number and its line.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Stmt {
    pub(super) id: usize,
    pub(super) line: u32,
    pub(super) kind: Kind,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Kind {
    Expr(Expr),
    Local {
        name: Rc<str>,
        ty: Type,
        rom: bool,
        init: Option<Expr>,
    },
    /// The branches of a chain, each with its condition, and the statements of `else`.
    If(Vec<(Expr, Vec<Stmt>)>, Vec<Stmt>),
    /// The labels of each section with its statements; `default` has no value.
    Switch(Expr, Vec<(Vec<Option<i128>>, Vec<Stmt>)>),
    /// `for`, and `while`, which has no initialisation and no step.
    Loop {
        init: Option<Box<Stmt>>,
        condition: Option<Expr>,
        step: Option<Expr>,
        body: Vec<Stmt>,
    },
    Return(Option<Expr>),
    Break,
    Continue,
    Block(Vec<Stmt>),
    UserCode,
}

/// A function.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Function {
    pub(super) name: Rc<str>,
    pub(super) parameters: Vec<(Rc<str>, Type)>,
    pub(super) body: Vec<Stmt>,
    /// True if it is not called from outside.
    pub(super) is_static: bool,
    /// `static inline`, in a header.
    pub(super) is_inline: bool,
}

/// A global variable.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Global {
    pub(super) ty: Type,
    pub(super) rom: bool,
    /// The values of a table of numbers, if all are constants.
    pub(super) numbers: Option<Rc<[i64]>>,
}

/// The contents of all files of a chart.
#[derive(Debug, Default)]
pub(super) struct Unit {
    pub(super) structs: Vec<Vec<Member>>,
    pub(super) types: BTreeMap<Rc<str>, Type>,
    pub(super) constants: BTreeMap<Rc<str>, i128>,
    pub(super) globals: BTreeMap<Rc<str>, Global>,
    /// The functions in the order of the text: callees come first.
    pub(super) functions: Vec<Function>,
    /// The result types of functions that are only declared.
    pub(super) declared: BTreeMap<Rc<str>, Type>,
    pub(super) n_stmts: usize,
}

impl Unit {
    /// The value of an expression over constants.
    pub(super) fn value(&self, expr: &Expr) -> Option<i128> {
        Some(match expr {
            Expr::Number(value) => *value,
            Expr::Name(name) => *self.constants.get(name)?,
            Expr::Unary("-", inner) => -self.value(inner)?,
            Expr::Unary("+", inner) => self.value(inner)?,
            Expr::Cast(Type::Number { bits, signed, is_bool: false }, inner) => {
                let value = self.value(inner)?;
                let size = 1_i128 << bits;
                let low = value.rem_euclid(size);
                if *signed && low >= size / 2 { low - size } else { low }
            }
            Expr::Binary(sign, a, b) => {
                let (a, b) = (self.value(a)?, self.value(b)?);
                match *sign {
                    "+" => a.checked_add(b)?,
                    "-" => a.checked_sub(b)?,
                    "*" => a.checked_mul(b)?,
                    "/" => a.checked_div(b)?,
                    "%" => a.checked_rem(b)?,
                    "&" => a & b,
                    "|" => a | b,
                    "<<" => a.checked_shl(u32::try_from(b).ok().filter(|n| *n < 64)?)?,
                    ">>" => a.checked_shr(u32::try_from(b).ok().filter(|n| *n < 64)?)?,
                    _ => return None,
                }
            }
            _ => return None,
        })
    }

    /// The member of a structure with that name.
    pub(super) fn member(&self, ty: &Type, name: &str) -> Option<&Member> {
        self.members(ty)?.iter().find(|it| &*it.name == name)
    }

    /// The members of a structure, or of the target of a pointer.
    pub(super) fn members(&self, ty: &Type) -> Option<&[Member]> {
        let index = match ty {
            Type::Struct(index) => *index,
            Type::Pointer(inner, _) => match &**inner {
                Type::Struct(index) => *index,
                Type::Void | Type::Number { .. } | Type::Pointer(..) | Type::Array(..) => {
                    return None;
                }
            },
            Type::Void | Type::Number { .. } | Type::Array(..) => return None,
        };
        self.structs.get(index).map(Vec::as_slice)
    }
}

/// Calls `look` for each expression of these statements.
pub(super) fn each_expr(list: &[Stmt], look: &mut dyn FnMut(&Expr)) {
    for stmt in list {
        match &stmt.kind {
            Kind::Expr(expr) | Kind::Return(Some(expr)) => look(expr),
            Kind::Local { init, .. } => init.iter().for_each(&mut *look),
            Kind::If(arms, otherwise) => {
                for (condition, body) in arms {
                    look(condition);
                    each_expr(body, look);
                }
                each_expr(otherwise, look);
            }
            Kind::Switch(subject, sections) => {
                look(subject);
                sections.iter().for_each(|(_, body)| each_expr(body, look));
            }
            Kind::Loop { init, condition, step, body } => {
                init.iter().for_each(|it| each_expr(std::slice::from_ref(it), look));
                condition.iter().chain(step).for_each(&mut *look);
                each_expr(body, look);
            }
            Kind::Block(body) => each_expr(body, look),
            Kind::Return(None) | Kind::Break | Kind::Continue | Kind::UserCode => {}
        }
    }
}

/// Calls `look` for each name that an expression of these statements mentions.
pub(super) fn each_name(list: &[Stmt], look: &mut dyn FnMut(&str)) {
    each_expr(list, &mut |expr| names_in(expr, look));
}

/// Calls `look` for each name that an expression mentions.
pub(super) fn names_in(expr: &Expr, look: &mut dyn FnMut(&str)) {
    if let Expr::Name(name) = expr {
        look(name);
    }
    each_inner(expr, &mut |it| names_in(it, look));
}

/// Calls `look` for each call in an expression, with the name of the function.
pub(super) fn each_call(expr: &Expr, look: &mut dyn FnMut(&Rc<str>)) {
    if let Expr::Call(name, _) = expr {
        look(name);
    }
    each_inner(expr, &mut |it| each_call(it, look));
}

/// Calls `look` for each direct operand of an expression.
pub(super) fn each_inner(expr: &Expr, look: &mut dyn FnMut(&Expr)) {
    match expr {
        Expr::Member(inner, _)
        | Expr::Unary(_, inner)
        | Expr::Count(inner)
        | Expr::Cast(_, inner) => look(inner),
        Expr::Index(a, b) | Expr::Binary(_, a, b) | Expr::Assign(_, a, b) => {
            look(a);
            look(b);
        }
        Expr::Choice(a, b, c) => [a, b, c].into_iter().for_each(|it| look(it)),
        Expr::Call(_, all) => all.iter().for_each(look),
        Expr::Number(_) | Expr::Name(_) | Expr::List(_) | Expr::Nothing => {}
    }
}
