//! C as a typed tree: the subset of C99 that grafsynth writes, and the constructs that a user would write when editing that text.
//!
//! - Every expression has its type, and every implicit conversion is a node ([`ExprKind::Convert`], [`ExprKind::Read`], [`ExprKind::Decay`]).
//! - An object is a [`Place`]: a symbol followed by members, elements and dereferences. Expressions do not name objects themselves; they refer to places.
//! - A tree is what a compiler sees after preprocessing for one machine. Brackets, `.` or `->`, comments and layout exist only in text.
//! - Scopes are resolved: symbols, structures and enumerations are referred to by id.
//!
//! Not in the subset: floating point, strings, unions, bit-fields except `bool name : 1`, `goto`, variadic and old-style functions, compound literals, arrays
//! of variable length.
//!
//! The constructors in [`typing`] check the constraints of C99 6.5 and insert the conversions. A tree that is built with them has the same types as the tree
//! that the parser makes from its printed text.

pub mod constant;
mod strip;
pub mod types;
pub mod typing;

use grafsynth_ir::net::{ActionId, InputId, OutputId, StepId, TimerId, TransitionId, VarId};
use grafsynth_ir::{Arena, Id, Span};
use types::{IntKind, Machine, Qualified, Qualifiers, Type};

/// Identifies a symbol of a [`Unit`].
pub type SymbolId = Id<Symbol>;
/// Identifies a structure of a [`Unit`].
pub type StructId = Id<Struct>;
/// Identifies an enumeration of a [`Unit`].
pub type EnumId = Id<Enum>;

/// A source location. All locations compare equal, so that a comparison of two trees ignores them.
#[derive(Debug, Clone, Copy, Default)]
pub struct Loc(pub Span);

impl PartialEq for Loc {
    fn eq(&self, _: &Loc) -> bool {
        true
    }
}

impl Eq for Loc {}

/// A translation unit: the text of one `.c` file with everything that it includes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Unit {
    /// The machine for which the types and constants of the unit were determined.
    pub machine: Machine,
    /// All symbols (names of objects, functions, types and constants): first those of the standard headers, then the others in the order of their declarations.
    pub symbols: Arena<Symbol>,
    /// All structures, in the order of their first mention.
    pub structs: Arena<Struct>,
    /// All enumerations, in the order of their definitions.
    pub enums: Arena<Enum>,
    /// The declarations, in order.
    pub items: Vec<Item>,
}

/// A declared name and its meaning.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Symbol {
    /// The name.
    pub name: String,
    /// Its kind.
    pub kind: SymbolKind,
    /// The type as it is declared.
    pub ty: Qualified,
    /// The type without typedef names.
    pub canonical: Qualified,
    /// The location of the first declaration.
    pub span: Loc,
}

/// The kinds of symbols.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum SymbolKind {
    /// An object with static storage duration.
    Object {
        /// True if the object is declared `static`.
        is_static: bool,
    },
    /// An object of a block.
    Local {
        /// True if the local keeps its value from one call to the next (`static`).
        is_static: bool,
    },
    /// A parameter of a function definition.
    Parameter,
    /// A function.
    Function(FunctionKind),
    /// A name for a type.
    Typedef,
    /// An enumerator, or a constant of a standard header such as `INT32_MAX`; the payload is its value.
    Constant(i128),
}

/// How a function is declared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct FunctionKind {
    /// True if the function is declared `static`.
    pub is_static: bool,
    /// True if the function is declared `inline`.
    pub is_inline: bool,
    /// True if the locals of the function are on the stack: `__reentrant` of sdcc.
    pub is_on_stack: bool,
    /// True if the function has no body here but is known to change nothing that the program can see: a function of the standard library, or one in
    /// [`Input::readers`](crate::Input::readers).
    pub is_pure: bool,
}

/// A structure.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Struct {
    /// The tag of the structure, if it has one.
    pub tag: Option<String>,
    /// The members; empty if the structure is declared but not defined.
    pub members: Vec<Member>,
    /// Size and alignment in bytes; `None` if the structure is declared but not defined.
    pub layout: Option<(u64, u64)>,
    /// True if a member, or a part of one, is `const`: then the structure cannot be assigned as a whole (C99 6.3.2.1p1).
    pub has_const: bool,
    /// True if every scalar in it is `const`: then its value never changes.
    pub is_const: bool,
    /// The number of scalars in it, with those of its structures and arrays; `u64::MAX` if there are more.
    pub n_scalars: u64,
    /// The nesting: 1 if no member is or contains a structure.
    pub nesting: usize,
    /// The location of the first mention.
    pub span: Loc,
}

/// A member of a structure.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Member {
    /// The name of the member.
    pub name: String,
    /// The type as it is declared.
    pub ty: Qualified,
    /// The type without typedef names.
    pub canonical: Qualified,
    /// True for a `bool` of one bit: `bool name : 1`, the only kind of bit-field that is supported. The address of such a member cannot be taken (C99
    /// 6.5.3.2p1).
    pub is_bit: bool,
    /// A comment.
    pub note: Note,
}

/// An enumeration.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Enum {
    /// The tag of the enumeration, if it has one.
    pub tag: Option<String>,
    /// The enumerators, in order.
    pub constants: Vec<SymbolId>,
    /// The integer type that the machine uses for the enumeration.
    pub kind: IntKind,
    /// Comments of the enumerators, in order; the list is shorter than `constants` if the last enumerators have no comment.
    pub notes: Vec<Note>,
}

/// The text of a comment, without the delimiters. Empty if there is no comment.
pub type Note = String;

/// An object of the net that a statement comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[expect(missing_docs, reason = "each variant names the thing it points to")]
pub enum Origin {
    Step(StepId),
    Transition(TransitionId),
    Input(InputId),
    Output(OutputId),
    Var(VarId),
    Timer(TimerId),
    Action(ActionId),
}

/// A declaration of a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Item {
    /// The kind of declaration, with its details.
    pub kind: ItemKind,
    /// The comment in front of the declaration.
    pub note: Note,
    /// Source location.
    pub span: Loc,
}

/// The kinds of declarations.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ItemKind {
    /// `#include` of a standard header.
    Include(Header),
    /// `struct TAG;`.
    DeclareStruct(StructId),
    /// `struct TAG { .. };`.
    DefineStruct(StructId),
    /// `enum { .. };`.
    DefineEnum(EnumId),
    /// `typedef .. NAME;`.
    Typedef {
        /// The name.
        symbol: SymbolId,
        /// The structure or enumeration that is defined within the declaration.
        defines: Option<Tag>,
    },
    /// An object with static storage duration.
    Object {
        /// The object.
        symbol: SymbolId,
        /// The structure or enumeration that is defined within the declaration.
        defines: Option<Tag>,
        /// True if the object is declared `extern`.
        is_extern: bool,
        /// The initialiser of the object, if it has one.
        init: Option<Init>,
    },
    /// A declaration of a function, without its body.
    Prototype {
        /// The function.
        symbol: SymbolId,
        /// The name of each parameter; `None` for a parameter without a name.
        params: Vec<Option<String>>,
    },
    /// A definition of a function.
    Function {
        /// The function.
        symbol: SymbolId,
        /// The parameters of the function.
        params: Vec<SymbolId>,
        /// The body of the function.
        body: Vec<Stmt>,
    },
    /// `extern "C" { .. }` of C++.
    ExternC(Vec<Item>),
}

/// A structure or an enumeration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tag {
    /// A structure.
    Struct(StructId),
    /// An enumeration.
    Enum(EnumId),
}

/// The standard headers that are known.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Header {
    /// `<limits.h>`.
    Limits,
    /// `<stdbool.h>`.
    StdBool,
    /// `<stddef.h>`.
    StdDef,
    /// `<stdint.h>`.
    StdInt,
    /// `<stdlib.h>`: `abs`, `labs`, `abort`.
    StdLib,
    /// `<string.h>`: `memcpy`, `memmove`, `memset`, `memcmp`.
    String,
}

impl Header {
    /// All headers.
    pub const ALL: [Header; 6] = [
        Header::Limits,
        Header::StdBool,
        Header::StdDef,
        Header::StdInt,
        Header::StdLib,
        Header::String,
    ];

    /// The name of the file.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Header::Limits => "limits.h",
            Header::StdBool => "stdbool.h",
            Header::StdDef => "stddef.h",
            Header::StdInt => "stdint.h",
            Header::StdLib => "stdlib.h",
            Header::String => "string.h",
        }
    }
}

/// An initialiser (C99 6.7.8). Braces that the text omits are added, and every value has an explicit position. Parts that are not listed are zero.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Init {
    /// A value of the type of the object.
    Value(Expr),
    /// The initialised parts of an array or a structure, in any order, each at most once.
    Parts(Vec<Part>),
}

/// The value of a part.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Part {
    /// The index of the element or of the member.
    pub at: u64,
    /// The initialiser of the part.
    pub init: Init,
}

/// A statement.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Stmt {
    /// The kind of statement, with its details.
    pub kind: StmtKind,
    /// Additional information, which does not change the meaning of the statement.
    pub marks: Marks,
    /// Source location.
    pub span: Loc,
}

/// Information about a statement that its C text does not contain. The parser leaves all of it empty.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Marks {
    /// A comment.
    pub note: Note,
    /// The objects of the net from which the statement was generated.
    pub origins: Vec<Origin>,
    /// The maximum number of iterations of a loop.
    pub at_most: Option<u64>,
    /// The step and the index of its task, if the statement is an `if` that runs a task.
    pub task: Option<(StepId, usize)>,
}

/// The kinds of statements. A body is always a block, whose scope ends with it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum StmtKind {
    /// An expression statement: the expression is evaluated for its side effects, and its value is discarded.
    Expr(Expr),
    /// The definition of one local.
    Define {
        /// The local.
        symbol: SymbolId,
        /// The initialiser of the local; `None` if the initial value is indeterminate (C99 6.7.8p10).
        init: Option<Init>,
    },
    /// `if` with any number of `else if`, and an `else` that is empty if there is none.
    If {
        /// The branches, at least one: the first whose condition compares unequal to 0 runs (C99 6.8.4.1p2).
        arms: Vec<Arm>,
        /// The body of the `else`.
        otherwise: Vec<Stmt>,
    },
    /// `switch`; control continues from the end of a case into the next one (C99 6.8.4.2p4).
    Switch {
        /// The promoted controlling expression.
        on: Expr,
        /// The cases, in order; all bodies are one scope.
        cases: Vec<Case>,
    },
    /// `while`.
    While {
        /// The condition.
        condition: Expr,
        /// The body.
        body: Vec<Stmt>,
    },
    /// `do .. while`.
    DoWhile {
        /// The body.
        body: Vec<Stmt>,
        /// The condition.
        condition: Expr,
    },
    /// `for`.
    For {
        /// Definitions of locals that are visible in the whole loop, or one expression statement; empty if the clause is empty.
        init: Vec<Stmt>,
        /// The condition; `None` means always true.
        condition: Option<Expr>,
        /// The expression that is evaluated after each iteration, if there is one.
        step: Option<Expr>,
        /// The body.
        body: Vec<Stmt>,
    },
    /// `break`.
    Break,
    /// `continue`.
    Continue,
    /// `return`; the value, if there is one, is converted to the return type of the function.
    Return(Option<Expr>),
    /// A nested block.
    Block(Vec<Stmt>),
    /// A compiler barrier: the compiler must not keep values of memory in registers across it (`__asm__ volatile("" ::: "memory")`).
    Barrier,
    /// A block of user code that is not read (`code c`). It may read and write everything that is visible.
    Opaque(String),
}

/// A branch of an `if`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Arm {
    /// The condition.
    pub condition: Expr,
    /// The body.
    pub body: Vec<Stmt>,
    /// Additional information, which does not change the meaning of the branch.
    pub marks: Marks,
}

/// A case of a `switch`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Case {
    /// The labels, at least one.
    pub labels: Vec<Label>,
    /// The statements up to the next label.
    pub body: Vec<Stmt>,
    /// Additional information, which does not change the meaning of the case.
    pub marks: Marks,
}

/// A label of a `switch`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Label {
    /// `case X:` with the value of `X` converted to the type of the controlling expression.
    Case(Expr, i128),
    /// `default:`.
    Default,
}

/// An expression; it has no value if its type is `void`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Expr {
    /// The kind of expression, with its operands.
    pub kind: ExprKind,
    /// The canonical type of the expression. Values have no qualifiers (C99 6.3.2.1p2).
    pub ty: Type,
    /// Source location.
    pub span: Loc,
}

/// How a constant is spelled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Spelling {
    /// `10`; the type determines the suffix.
    Decimal,
    /// `0x0A`.
    Hex,
    /// `INT32_C(10)`, `UINT64_C(10)` and so on.
    Sized {
        /// The width in bits: 8, 16, 32 or 64.
        bits: u8,
        /// True for `INT`, false for `UINT`.
        is_signed: bool,
    },
    /// `'a'`.
    Character,
}

/// The kinds of expressions.
///
/// The operands of [`Logical`](ExprKind::Logical), [`Choose`](ExprKind::Choose) and [`Comma`](ExprKind::Comma) are evaluated from left to right, with a
/// sequence point after each (C99 6.5.13..15, 6.5.17). All other operands, and the arguments of a call, are evaluated in any order (C99 6.5p3); the parser
/// rejects an expression whose result could depend on it ([`crate::order`]).
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ExprKind {
    /// An integer constant (C99 6.4.4.1, 6.4.4.4).
    Literal(u64, Spelling),
    /// `true` or `false`: the constant 1 or 0 of type `int` (C99 7.16).
    Bool(bool),
    /// `NULL`, with the type `void *`.
    Null,
    /// An enumerator, or a constant of a standard header.
    Constant(SymbolId),
    /// A pointer to a function: the function designator has decayed (C99 6.3.2.1p4).
    Function(SymbolId),
    /// The value of an object (C99 6.3.2.1p2).
    Read(Box<Place>),
    /// `&place`.
    Address(Box<Place>),
    /// A pointer to the first element of an array (C99 6.3.2.1p3).
    Decay(Box<Place>),
    /// An operator with one operand. The operand of `!` is any scalar; all others are promoted.
    Unary(UnaryOp, Box<Expr>),
    /// An operator with two operands, which have a common type, except: shifts, whose result has the type of the left operand (C99 6.5.7p3), and pointer
    /// arithmetic. Comparisons give 0 or 1 of type `int`.
    Binary(BinaryOp, Box<Expr>, Box<Expr>),
    /// `&&` or `||` of two or more scalars, of type `int`. Evaluation stops at the first operand that determines the result.
    Logical(LogicalOp, Vec<Expr>),
    /// `condition ? a : b`; both arms have the type of the result.
    Choose(Box<Expr>, Box<Expr>, Box<Expr>),
    /// `a, b`.
    Comma(Box<Expr>, Box<Expr>),
    /// An implicit conversion to the type of this node (C99 6.3). Integers: [`Machine::wrap`]; pointers: the same address; any scalar to `_Bool`: 1 if
    /// the value compares unequal to 0, otherwise 0.
    Convert(Box<Expr>),
    /// A cast to a type as it is written; the conversion is that of [`Convert`](ExprKind::Convert).
    Cast(Qualified, Box<Expr>),
    /// `place = value`: the value after the assignment. The value has the type of the place.
    Assign(Box<Place>, Box<Expr>),
    /// `place op= value` (C99 6.5.16.2p3). The value of the place is converted to the given type before the operation, and the result is converted to the type
    /// of the place. The place is evaluated once.
    Update(BinaryOp, Box<Place>, Box<Expr>, Type),
    /// `++` or `--` of a place; `++` has the effect of `place += 1`, and `--` that of `place -= 1`.
    Step {
        /// True for `++`.
        is_increment: bool,
        /// True for a prefix operator, whose value is that after the change.
        is_prefix: bool,
        /// The place that is changed.
        place: Box<Place>,
    },
    /// A call; the arguments are converted to the types of the parameters (C99 6.5.2.2p7).
    Call(Callee, Vec<Expr>),
    /// A member of a structure value that is not an object, such as the result of a call; the index is that of the member.
    Member(Box<Expr>, usize),
    /// `sizeof`, of type `size_t`; the operand is not evaluated.
    SizeOf(Box<SizeOfOperand>),
}

/// The operand of `sizeof`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum SizeOfOperand {
    /// A type as it is written.
    Type(Qualified),
    /// An object.
    Place(Place),
    /// A value.
    Value(Expr),
}

/// The target of a call.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Callee {
    /// A function by its name.
    Function(SymbolId),
    /// A pointer to a function.
    Pointer(Box<Expr>),
}

/// An object, or a part of one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place {
    /// The kind of place.
    pub kind: PlaceKind,
    /// The canonical type of the place.
    pub ty: Type,
    /// The qualifiers of the place, including those of the objects that contain it.
    pub qualifiers: Qualifiers,
    /// Source location.
    pub span: Loc,
}

/// The kinds of places.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum PlaceKind {
    /// An object by its name.
    Symbol(SymbolId),
    /// A member of a structure: the structure and the index of the member.
    Member(Box<Place>, usize),
    /// An element of an array: the array and the index.
    Element(Box<Place>, Box<Expr>),
    /// `pointer[index]`, which is `*(pointer + index)`.
    At(Box<Expr>, Box<Expr>),
    /// `*pointer`.
    Deref(Box<Expr>),
}

/// Operators with one operand.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum UnaryOp {
    /// `+`.
    Plus,
    /// `-`.
    Neg,
    /// `~`.
    BitNot,
    /// `!`, of type `int`.
    Not,
}

impl UnaryOp {
    /// The spelling of the operator.
    #[must_use]
    pub fn sign(self) -> &'static str {
        match self {
            UnaryOp::Plus => "+",
            UnaryOp::Neg => "-",
            UnaryOp::BitNot => "~",
            UnaryOp::Not => "!",
        }
    }
}

/// Operators with two operands that are both evaluated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[expect(missing_docs, reason = "the names are those of the operators")]
pub enum BinaryOp {
    Mul,
    Div,
    Rem,
    Add,
    Sub,
    Shl,
    Shr,
    Lt,
    Le,
    Gt,
    Ge,
    Eq,
    Ne,
    BitAnd,
    BitXor,
    BitOr,
}

impl BinaryOp {
    /// All operators.
    pub const ALL: [BinaryOp; 16] = [
        BinaryOp::Mul,
        BinaryOp::Div,
        BinaryOp::Rem,
        BinaryOp::Add,
        BinaryOp::Sub,
        BinaryOp::Shl,
        BinaryOp::Shr,
        BinaryOp::Lt,
        BinaryOp::Le,
        BinaryOp::Gt,
        BinaryOp::Ge,
        BinaryOp::Eq,
        BinaryOp::Ne,
        BinaryOp::BitAnd,
        BinaryOp::BitXor,
        BinaryOp::BitOr,
    ];

    /// The spelling of the operator.
    #[must_use]
    pub fn sign(self) -> &'static str {
        match self {
            BinaryOp::Mul => "*",
            BinaryOp::Div => "/",
            BinaryOp::Rem => "%",
            BinaryOp::Add => "+",
            BinaryOp::Sub => "-",
            BinaryOp::Shl => "<<",
            BinaryOp::Shr => ">>",
            BinaryOp::Lt => "<",
            BinaryOp::Le => "<=",
            BinaryOp::Gt => ">",
            BinaryOp::Ge => ">=",
            BinaryOp::Eq => "==",
            BinaryOp::Ne => "!=",
            BinaryOp::BitAnd => "&",
            BinaryOp::BitXor => "^",
            BinaryOp::BitOr => "|",
        }
    }

    /// True for `<`, `<=`, `>`, `>=`, `==` and `!=`.
    #[must_use]
    pub fn is_comparison(self) -> bool {
        match self {
            BinaryOp::Lt
            | BinaryOp::Le
            | BinaryOp::Gt
            | BinaryOp::Ge
            | BinaryOp::Eq
            | BinaryOp::Ne => true,
            BinaryOp::Mul
            | BinaryOp::Div
            | BinaryOp::Rem
            | BinaryOp::Add
            | BinaryOp::Sub
            | BinaryOp::Shl
            | BinaryOp::Shr
            | BinaryOp::BitAnd
            | BinaryOp::BitXor
            | BinaryOp::BitOr => false,
        }
    }

    /// True if the operator has a compound assignment `place op= value`.
    #[must_use]
    pub fn can_update(self) -> bool {
        !self.is_comparison()
    }
}

/// Operators that may leave their later operands unevaluated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum LogicalOp {
    /// `&&`.
    And,
    /// `||`.
    Or,
}

impl LogicalOp {
    /// The spelling of the operator.
    #[must_use]
    pub fn sign(self) -> &'static str {
        match self {
            LogicalOp::And => "&&",
            LogicalOp::Or => "||",
        }
    }
}

impl From<StmtKind> for Stmt {
    fn from(kind: StmtKind) -> Self {
        Stmt { kind, marks: Marks::default(), span: Loc::default() }
    }
}

impl Place {
    /// The object that contains the place; `None` if the place is reached through a pointer.
    #[must_use]
    pub fn object(&self) -> Option<SymbolId> {
        match &self.kind {
            PlaceKind::Symbol(id) => Some(*id),
            PlaceKind::Member(base, _) | PlaceKind::Element(base, _) => base.object(),
            PlaceKind::At(..) | PlaceKind::Deref(_) => None,
        }
    }
}
