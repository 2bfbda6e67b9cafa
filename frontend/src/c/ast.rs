//! Syntax tree of a C source, close to the text: names are not resolved, and types are as written.

use grafsynth_ir::{Name, Span};

/// A whole source.
#[derive(Debug, Default)]
pub(super) struct Source {
    pub(super) items: Vec<External>,
    /// Comments with their delimiters, in source order.
    pub(super) comments: Vec<Span>,
    /// `#define NAME constant`.
    pub(super) constants: Vec<(Name, i64)>,
    /// Constants given by the caller, as with the option `-D NAME=VALUE`.
    pub(super) given: Vec<(String, i64)>,
    /// Lines that the library needs verbatim: includes, and defines that are not constants.
    pub(super) lines: Vec<Span>,
    /// Names of the defines that are not constants.
    pub(super) opaque_macros: Vec<String>,
}

/// A declaration or definition at file level.
#[derive(Debug)]
pub(super) enum External {
    Function(Box<Function>),
    Declaration(Declaration),
}

impl External {
    /// Whether this item is a type or a prototype. Only the library needs such items.
    pub(super) fn is_type_or_prototype(&self) -> bool {
        match self {
            External::Function(_) => false,
            External::Declaration(declaration) => {
                declaration.specifiers.is_typedef
                    || declaration.declared.is_empty()
                    || declaration
                        .declared
                        .iter()
                        .all(|(declarator, _)| declarator.is_function && !declarator.is_opaque)
            }
        }
    }
}

/// A function with its body.
#[derive(Debug)]
pub(super) struct Function {
    pub(super) name: Name,
    pub(super) specifiers: Specifiers,
    pub(super) declarator: Declarator,
    pub(super) params: Vec<Param>,
    pub(super) body: Stmt,
    /// The span from the first specifier to the closing brace.
    pub(super) span: Span,
}

/// A parameter of a prototype, a definition or a K&R definition.
#[derive(Debug, Clone)]
pub(super) struct Param {
    pub(super) name: Name,
    pub(super) specifiers: Specifiers,
    pub(super) declarator: Declarator,
}

/// The specifiers before the declarators.
#[derive(Debug, Clone)]
pub(super) struct Specifiers {
    pub(super) base: Base,
    pub(super) is_static: bool,
    pub(super) is_extern: bool,
    pub(super) is_typedef: bool,
    pub(super) is_const: bool,
    pub(super) is_volatile: bool,
    /// The span of the type, without the storage class; empty if no type was written (`int` is implied).
    pub(super) span: Span,
}

/// The type named by the specifiers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Base {
    Void,
    Bool,
    /// `char`: whether it is signed; `None` if the source does not say.
    Char(Option<bool>),
    Short {
        is_signed: bool,
    },
    Int {
        is_signed: bool,
    },
    Long {
        is_signed: bool,
    },
    /// `long long` and 64-bit types.
    LongLong,
    /// A type of fixed width.
    Fixed {
        bits: u32,
        is_signed: bool,
    },
    /// `enum ..`
    Enum,
    /// An opaque type: `float`, structures, unknown names. Typedefs of this source are already replaced by their types.
    Opaque,
}

/// A declared name with its pointers, array lengths and parameters.
#[derive(Debug, Clone, Default)]
pub(super) struct Declarator {
    pub(super) name: Name,
    /// Number of stars before the name.
    pub(super) n_pointers: u32,
    /// Lengths of an array, outermost first; `None` for `[]`.
    pub(super) lengths: Vec<Option<Expr>>,
    /// Whether this is a function (`f()`) or a pointer to one.
    pub(super) is_function: bool,
    /// Whether the declarator is too complex to analyse, such as a pointer to a function; only its text is kept.
    pub(super) is_opaque: bool,
    /// The span from the first star to the last bracket.
    pub(super) span: Span,
}

/// A declaration.
#[derive(Debug)]
pub(super) struct Declaration {
    pub(super) specifiers: Specifiers,
    pub(super) declared: Vec<(Declarator, Option<Init>)>,
    pub(super) span: Span,
}

/// An initial value.
#[derive(Debug)]
pub(super) enum Init {
    One(Expr),
    /// `{ .. }`; an initialiser with designators is opaque.
    List(Vec<Init>, Span),
}

/// A statement.
#[derive(Debug)]
pub(super) struct Stmt {
    pub(super) kind: StmtKind,
    pub(super) span: Span,
}

/// The kinds of statements.
#[derive(Debug)]
pub(super) enum StmtKind {
    Null,
    Expr(Expr),
    Block(Vec<Stmt>),
    Declaration(Declaration),
    If(Expr, Box<Stmt>, Option<Box<Stmt>>),
    While(Expr, Box<Stmt>),
    Do(Box<Stmt>, Expr),
    For { first: Option<Box<Stmt>>, condition: Option<Expr>, last: Option<Expr>, body: Box<Stmt> },
    Switch(Expr, Box<Stmt>),
    Case(Expr, Box<Stmt>),
    Default(Box<Stmt>),
    Label(Name, Box<Stmt>),
    Goto(Name),
    Break,
    Continue,
    Return(Option<Expr>),
}

/// An expression.
#[derive(Debug, Clone)]
pub(super) struct Expr {
    pub(super) kind: ExprKind,
    pub(super) span: Span,
}

/// The kinds of expressions.
#[derive(Debug, Clone)]
pub(super) enum ExprKind {
    Number {
        value: u64,
        is_unsigned: bool,
        n_long: u8,
        is_decimal: bool,
    },
    Char(i64),
    Float,
    Text,
    Name(String),
    Index(Box<Expr>, Box<Expr>),
    Call(Name, Vec<Expr>),
    /// A member of a structure, a call through a pointer, or another construct that only a C compiler handles.
    Opaque(Vec<Expr>),
    /// `++` and `--`: the increment, and whether it is a prefix.
    Step {
        operand: Box<Expr>,
        by: i64,
        is_prefix: bool,
    },
    Unary(UnaryOp, Box<Expr>),
    Deref(Box<Expr>),
    AddressOf(Box<Expr>),
    Cast(Box<TypeName>, Box<Expr>),
    SizeofType(Box<TypeName>),
    Sizeof(Box<Expr>),
    Binary(BinaryOp, Box<Expr>, Box<Expr>),
    /// A flat chain of `&&` (true) or `||` (false).
    Junction(bool, Vec<Expr>),
    Conditional(Box<Expr>, Box<Expr>, Box<Expr>),
    Assign(Option<BinaryOp>, Box<Expr>, Box<Expr>),
    Comma(Vec<Expr>),
}

/// A type without a name, as in a cast.
#[derive(Debug, Clone)]
pub(super) struct TypeName {
    pub(super) specifiers: Specifiers,
    pub(super) declarator: Declarator,
}

/// Operators with one operand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum UnaryOp {
    Plus,
    Minus,
    /// `~`
    Complement,
    /// `!`
    Not,
}

/// Binary operators that evaluate both operands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum BinaryOp {
    Add,
    Sub,
    Mul,
    Div,
    Mod,
    ShiftLeft,
    ShiftRight,
    And,
    Or,
    Xor,
    Eq,
    Ne,
    Lt,
    Le,
    Gt,
    Ge,
}

impl Expr {
    /// The direct operands, from left to right.
    pub(super) fn operands(&self) -> Vec<&Expr> {
        match &self.kind {
            ExprKind::Number { .. }
            | ExprKind::Char(_)
            | ExprKind::Float
            | ExprKind::Text
            | ExprKind::Name(_)
            | ExprKind::SizeofType(_) => Vec::new(),
            ExprKind::Index(a, b) | ExprKind::Binary(_, a, b) | ExprKind::Assign(_, a, b) => {
                vec![a, b]
            }
            ExprKind::Call(_, all)
            | ExprKind::Opaque(all)
            | ExprKind::Junction(_, all)
            | ExprKind::Comma(all) => all.iter().collect(),
            ExprKind::Step { operand: a, .. }
            | ExprKind::Unary(_, a)
            | ExprKind::Deref(a)
            | ExprKind::AddressOf(a)
            | ExprKind::Cast(_, a)
            | ExprKind::Sizeof(a) => vec![a],
            ExprKind::Conditional(a, b, c) => vec![a, b, c],
        }
    }

    /// Calls `visit` on the expression and all its parts, outermost first. Skips the operand of `sizeof`, which is not evaluated.
    pub(super) fn each<'e>(&'e self, visit: &mut impl FnMut(&'e Expr)) {
        visit(self);
        if matches!(self.kind, ExprKind::Sizeof(_)) {
            return;
        }
        for operand in self.operands() {
            operand.each(visit);
        }
    }
}
