//! A function in the form for path exploration: names are memory cells, and every piece has a cost.
//!
//! [`crate::cost::walk`] writes it while it adds up costs; [`super::run`] executes it.

use super::values::Kind;
use std::rc::Rc;

/// A cost: the time, and the number of calls of user functions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(in crate::cost) struct Price {
    pub(in crate::cost) time: u64,
    pub(in crate::cost) user: u64,
}

impl Price {
    pub(in crate::cost) fn plus(self, other: Price) -> Price {
        Price {
            time: self.time.saturating_add(other.time),
            user: self.user.saturating_add(other.user),
        }
    }

    pub(in crate::cost) fn or(self, other: Price) -> Price {
        Price { time: self.time.max(other.time), user: self.user.max(other.user) }
    }

    /// The difference of two costs.
    pub(in crate::cost) fn less(self, other: Price) -> Price {
        Price {
            time: self.time.saturating_sub(other.time),
            user: self.user.saturating_sub(other.user),
        }
    }
}

/// A number.
#[derive(Debug, Clone)]
pub(in crate::cost) enum Code {
    /// A constant; its signedness is not kept.
    Constant(i64),
    /// The value of a location.
    Read(Box<Address>, Kind),
    /// The pointer to a location.
    Pointer(Box<Address>),
    /// An element of a table in ROM.
    Table(Rc<[i64]>, Box<Code>, Kind),
    /// An unknown number of this type.
    Unknown(Kind),
    Unary(&'static str, Box<Code>),
    Binary(&'static str, Box<Code>, Box<Code>),
    Choice(Box<Question>, Box<Code>, Box<Code>),
    Truth(Box<Question>),
    Cast(Kind, Box<Code>),
    /// A function of the text, with its arguments.
    Call(usize, Vec<Code>),
}

/// The address of an object.
#[derive(Debug, Clone)]
pub(in crate::cost) struct Address {
    pub(in crate::cost) base: Base,
    pub(in crate::cost) offset: usize,
    /// Indices: each with the number of elements and the number of cells of one element.
    pub(in crate::cost) indices: Vec<(Code, usize, usize)>,
    /// True if one cell represents all elements of an array.
    pub(in crate::cost) is_summary: bool,
}

#[derive(Debug, Clone)]
pub(in crate::cost) enum Base {
    /// A cell of the function.
    Cell(usize),
    /// The target of the pointer in that cell.
    Behind(usize),
    /// A location that is not tracked.
    Nowhere,
}

/// A condition, with the cost of its evaluation.
#[derive(Debug, Clone)]
pub(in crate::cost) enum Question {
    Both(Box<Question>, Box<Question>),
    Either(Box<Question>, Box<Question>),
    Not(Box<Question>),
    Compare(Price, &'static str, Code, Code),
    /// Not equal to 0.
    Some(Price, Code),
}

/// A statement.
#[derive(Debug, Clone)]
pub(in crate::cost) struct Op {
    /// Its line, to report where the time goes.
    pub(in crate::cost) line: u32,
    pub(in crate::cost) what: What,
}

#[derive(Debug, Clone)]
pub(in crate::cost) enum What {
    /// Stores a number in a location, truncated to that type.
    Set(Price, Option<(Address, Kind)>, Code),
    /// A statement that has a cost but does not affect the path.
    Pay(Price),
    /// Branches with their conditions and the cost of the jump after each; the last branch has no jump.
    If(Vec<(Question, Vec<Op>, Price)>, Vec<Op>),
    Switch {
        price: Price,
        subject: Code,
        sections: Vec<(Vec<Option<i64>>, Vec<Op>)>,
        jump: Price,
    },
    Loop {
        init: Vec<Op>,
        condition: Option<Question>,
        step: Vec<Op>,
        body: Vec<Op>,
        /// The cost of a jump, which is the same back to the condition and out of the loop.
        jump: Price,
        rounds: u64,
        /// True if `rounds` is a proved maximum: then no state is left after that many rounds. Otherwise the remaining states leave the loop there.
        is_proved: bool,
    },
    Return(Price, Option<Code>),
    Break,
    Continue,
    Block(Vec<Op>),
    /// Frees these cells: no later statement reads them.
    Forget(usize, usize),
    /// Something that path exploration cannot follow.
    Lost(String),
}

/// A function.
#[derive(Debug, Clone, Default)]
pub(in crate::cost) struct Routine {
    /// The cells of the parameters with their types; `None` for a parameter that is not a number.
    pub(in crate::cost) parameters: Vec<(usize, Option<Kind>)>,
    pub(in crate::cost) body: Vec<Op>,
    /// The cost of entering it.
    pub(in crate::cost) entry: Price,
    /// The type of its result.
    pub(in crate::cost) gives: Option<Kind>,
    /// The number of its cells, which follow those of its caller, and that number including everything that it calls.
    pub(in crate::cost) cells: usize,
    pub(in crate::cost) depth: usize,
    /// Its first line.
    pub(in crate::cost) line: u32,
}

impl Question {
    /// The cost of evaluating all parts.
    pub(in crate::cost) fn price(&self) -> Price {
        match self {
            Question::Both(a, b) | Question::Either(a, b) => a.price().plus(b.price()),
            Question::Not(inner) => inner.price(),
            Question::Compare(price, ..) | Question::Some(price, _) => *price,
        }
    }
}
