//! Expressions as text.
//!
//! An operand is in parentheses unless it is a unary or postfix expression, or the left operand of a chain of operators of one precedence. A reader of the
//! code therefore does not need to know the precedences (MISRA-C:2012, rule 12.1), and compilers do not warn.

use super::Printer;
use crate::tree::types::{IntKind, Type};
use crate::tree::{
    BinaryOp, Callee, Expr, ExprKind, LogicalOp, Place, PlaceKind, SizeOfOperand, Spelling, UnaryOp,
};

/// The precedence of an expression.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Level {
    Comma,
    Assign,
    Choose,
    Or,
    And,
    BitOr,
    BitXor,
    BitAnd,
    /// A comparison; as the operand of another comparison, it is in parentheses.
    Compare,
    Shift,
    Sum,
    Product,
    Unary,
    Postfix,
}

impl Printer<'_> {
    pub(super) fn expr(&self, expr: &Expr) -> String {
        let mut text = String::new();
        self.put(expr, &mut text);
        text
    }

    /// A condition. An assignment is in parentheses, because compilers otherwise warn about `=`.
    pub(super) fn condition(&self, expr: &Expr) -> String {
        let mut text = String::new();
        let is_assignment = matches!(expr.kind, ExprKind::Assign(..));
        let least = if is_assignment { Level::Choose } else { Level::Comma };
        self.put_from(expr, least, &mut text);
        text
    }

    /// An expression in a list, such as an argument; a comma expression is in parentheses.
    pub(super) fn item_expr(&self, expr: &Expr) -> String {
        let mut text = String::new();
        self.put_from(expr, Level::Assign, &mut text);
        text
    }

    /// An operand: in parentheses unless its precedence is at least `least`.
    fn put_from(&self, expr: &Expr, least: Level, out: &mut String) {
        if level(expr) >= least {
            self.put(expr, out);
        } else {
            out.push('(');
            self.put(expr, out);
            out.push(')');
        }
    }

    fn put(&self, expr: &Expr, out: &mut String) {
        match &expr.kind {
            ExprKind::Literal(value, spelling) => {
                out.push_str(&literal(*value, *spelling, &expr.ty));
            }
            ExprKind::Bool(value) => out.push_str(if *value { "true" } else { "false" }),
            ExprKind::Null => out.push_str("NULL"),
            ExprKind::Constant(id) | ExprKind::Function(id) => {
                out.push_str(&self.unit.symbols[*id].name);
            }
            ExprKind::Read(place) | ExprKind::Decay(place) => self.put_place(place, out),
            ExprKind::Address(place) => {
                out.push('&');
                self.put_place(place, out);
            }
            ExprKind::Unary(op, a) => {
                out.push_str(op.sign());
                self.put_sign_operand(*op, a, out);
            }
            ExprKind::Binary(op, a, b) => {
                self.put_chain(expr, a, out);
                spaced(op.sign(), out);
                self.put_from(b, Level::Unary, out);
            }
            ExprKind::Logical(op, all) => {
                for (at, one) in all.iter().enumerate() {
                    if at > 0 {
                        spaced(op.sign(), out);
                    }
                    self.put_from(one, Level::Unary, out);
                }
            }
            ExprKind::Choose(c, a, b) => {
                self.put_from(c, Level::Postfix, out);
                out.push_str(" ? ");
                self.put_from(a, Level::Unary, out);
                out.push_str(" : ");
                self.put_from(b, Level::Unary, out);
            }
            ExprKind::Comma(a, b) => {
                if matches!(bare(a).kind, ExprKind::Comma(..)) {
                    self.put(a, out);
                } else {
                    self.put_from(a, Level::Assign, out);
                }
                out.push_str(", ");
                self.put_from(b, Level::Assign, out);
            }
            ExprKind::Convert(a) => self.put(a, out),
            ExprKind::Cast(to, a) => {
                out.push('(');
                out.push_str(&super::type_name(self.unit, to));
                out.push(')');
                self.put_from(a, Level::Unary, out);
            }
            ExprKind::Assign(place, value) => {
                self.put_place(place, out);
                out.push_str(" = ");
                self.put_from(value, Level::Choose, out);
            }
            ExprKind::Update(op, place, value, _) => {
                self.put_place(place, out);
                out.push(' ');
                out.push_str(op.sign());
                out.push_str("= ");
                self.put_from(value, Level::Choose, out);
            }
            ExprKind::Step { is_increment, is_prefix, place } => {
                self.put_step(*is_increment, *is_prefix, place, out);
            }
            ExprKind::Call(callee, arguments) => self.put_call(callee, arguments, out),
            ExprKind::Member(a, index) => {
                self.put_from(a, Level::Postfix, out);
                out.push('.');
                out.push_str(self.member_name(&a.ty, *index));
            }
            ExprKind::SizeOf(operand) => self.put_size_of(operand, out),
        }
    }

    fn put_step(&self, is_increment: bool, is_prefix: bool, place: &Place, out: &mut String) {
        let sign = if is_increment { "++" } else { "--" };
        if is_prefix {
            out.push_str(sign);
            self.put_place(place, out);
        } else {
            self.put_place_postfix(place, out);
            out.push_str(sign);
        }
    }

    fn put_size_of(&self, operand: &SizeOfOperand, out: &mut String) {
        out.push_str("sizeof(");
        match operand {
            SizeOfOperand::Type(ty) => out.push_str(&super::type_name(self.unit, ty)),
            SizeOfOperand::Place(place) => self.put_place(place, out),
            SizeOfOperand::Value(value) => self.put(value, out),
        }
        out.push(')');
    }

    /// The left operand of a binary operator: an operator of the same precedence needs no parentheses, unless it is a comparison.
    fn put_chain(&self, whole: &Expr, left: &Expr, out: &mut String) {
        let own = level(whole);
        let is_chain = own != Level::Compare && level(left) == own;
        self.put_from(left, if is_chain { own } else { Level::Unary }, out);
    }

    /// The operand of a unary operator; parentheses separate two signs that would be read as another operator, such as `--`.
    fn put_sign_operand(&self, op: UnaryOp, a: &Expr, out: &mut String) {
        let mut inner = String::new();
        self.put_from(a, Level::Unary, &mut inner);
        let merges = matches!(op, UnaryOp::Plus | UnaryOp::Neg) && inner.starts_with(op.sign());
        if merges {
            out.push('(');
            out.push_str(&inner);
            out.push(')');
        } else {
            out.push_str(&inner);
        }
    }

    fn put_call(&self, callee: &Callee, arguments: &[Expr], out: &mut String) {
        match callee {
            Callee::Function(id) => out.push_str(&self.unit.symbols[*id].name),
            Callee::Pointer(pointer) => self.put_from(pointer, Level::Postfix, out),
        }
        out.push('(');
        for (at, argument) in arguments.iter().enumerate() {
            out.push_str(if at == 0 { "" } else { ", " });
            self.put_from(argument, Level::Assign, out);
        }
        out.push(')');
    }

    fn member_name(&self, ty: &Type, index: usize) -> &str {
        match ty {
            Type::Struct(id) => &self.unit.structs[*id].members[index].name,
            Type::Void
            | Type::Int(_)
            | Type::Enum(_)
            | Type::Pointer(_)
            | Type::Array(..)
            | Type::Function(_)
            | Type::Named(_) => unreachable!("only structures have members"),
        }
    }

    fn put_place(&self, place: &Place, out: &mut String) {
        match &place.kind {
            PlaceKind::Symbol(id) => out.push_str(&self.unit.symbols[*id].name),
            PlaceKind::Member(base, index) => {
                if let PlaceKind::Deref(pointer) = &base.kind {
                    self.put_from(pointer, Level::Postfix, out);
                    out.push_str("->");
                } else {
                    self.put_place_postfix(base, out);
                    out.push('.');
                }
                out.push_str(self.member_name(&base.ty, *index));
            }
            PlaceKind::Element(base, index) => {
                self.put_place_postfix(base, out);
                out.push('[');
                self.put(index, out);
                out.push(']');
            }
            PlaceKind::At(pointer, index) => {
                self.put_from(pointer, Level::Postfix, out);
                out.push('[');
                self.put(index, out);
                out.push(']');
            }
            PlaceKind::Deref(pointer) => {
                out.push('*');
                self.put_from(pointer, Level::Unary, out);
            }
        }
    }

    /// A place in front of a postfix operator.
    fn put_place_postfix(&self, place: &Place, out: &mut String) {
        if matches!(place.kind, PlaceKind::Deref(_)) {
            out.push('(');
            self.put_place(place, out);
            out.push(')');
        } else {
            self.put_place(place, out);
        }
    }
}

/// The expression without the implicit conversions around it.
fn bare(expr: &Expr) -> &Expr {
    let mut at = expr;
    while let ExprKind::Convert(inner) = &at.kind {
        at = inner;
    }
    at
}

fn level(expr: &Expr) -> Level {
    match &bare(expr).kind {
        ExprKind::Literal(..)
        | ExprKind::Bool(_)
        | ExprKind::Null
        | ExprKind::Constant(_)
        | ExprKind::Function(_)
        | ExprKind::Call(..)
        | ExprKind::Member(..)
        | ExprKind::Step { is_prefix: false, .. } => Level::Postfix,
        ExprKind::Read(place) | ExprKind::Decay(place) => match place.kind {
            PlaceKind::Deref(_) => Level::Unary,
            PlaceKind::Symbol(_)
            | PlaceKind::Member(..)
            | PlaceKind::Element(..)
            | PlaceKind::At(..) => Level::Postfix,
        },
        ExprKind::Address(_)
        | ExprKind::Unary(..)
        | ExprKind::Cast(..)
        | ExprKind::SizeOf(_)
        | ExprKind::Step { is_prefix: true, .. } => Level::Unary,
        ExprKind::Binary(op, ..) => match op {
            BinaryOp::Mul | BinaryOp::Div | BinaryOp::Rem => Level::Product,
            BinaryOp::Add | BinaryOp::Sub => Level::Sum,
            BinaryOp::Shl | BinaryOp::Shr => Level::Shift,
            BinaryOp::Lt
            | BinaryOp::Le
            | BinaryOp::Gt
            | BinaryOp::Ge
            | BinaryOp::Eq
            | BinaryOp::Ne => Level::Compare,
            BinaryOp::BitAnd => Level::BitAnd,
            BinaryOp::BitXor => Level::BitXor,
            BinaryOp::BitOr => Level::BitOr,
        },
        ExprKind::Logical(LogicalOp::And, _) => Level::And,
        ExprKind::Logical(LogicalOp::Or, _) => Level::Or,
        ExprKind::Choose(..) => Level::Choose,
        ExprKind::Assign(..) | ExprKind::Update(..) => Level::Assign,
        ExprKind::Comma(..) => Level::Comma,
        ExprKind::Convert(_) => unreachable!("conversions are stripped"),
    }
}

/// A constant in a spelling that has its type.
fn literal(value: u64, spelling: Spelling, ty: &Type) -> String {
    let suffixes = [
        (IntKind::UInt, "U"),
        (IntKind::Long, "L"),
        (IntKind::ULong, "UL"),
        (IntKind::LLong, "LL"),
        (IntKind::ULLong, "ULL"),
    ];
    let own = suffixes.iter().find(|(kind, _)| *ty == Type::Int(*kind));
    let suffix = own.map_or("", |(_, suffix)| suffix);
    match spelling {
        Spelling::Decimal => format!("{value}{suffix}"),
        Spelling::Hex => format!("0x{value:02X}{suffix}"),
        Spelling::Sized { bits, is_signed } => {
            let sign = if is_signed { "" } else { "U" };
            format!("{sign}INT{bits}_C({value})")
        }
        Spelling::Character => match u8::try_from(value) {
            Ok(byte @ (b'\'' | b'\\')) => format!("'\\{}'", char::from(byte)),
            Ok(byte) if byte.is_ascii_graphic() || byte == b' ' => {
                format!("'{}'", char::from(byte))
            }
            _ => format!("'\\{value:o}'"),
        },
    }
}

/// Writes a binary operator.
fn spaced(sign: &str, out: &mut String) {
    out.extend([" ", sign, " "]);
}
