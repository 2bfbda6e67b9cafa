//! A function as a run goes through it: names are cells of a memory, and every piece has its price.
//!
//! [`crate::cost::walk`] writes it while it adds up prices; [`super::run`] goes through it.

use super::values::Kind;
use std::rc::Rc;

/// Time, and calls of functions of the user.
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

    /// What is left of it.
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
    /// A constant; its sign is not kept.
    Constant(i64),
    /// What a place holds.
    Read(Box<Address>, Kind),
    /// The pointer to a place.
    Pointer(Box<Address>),
    /// An element of a table in ROM.
    Table(Rc<[i64]>, Box<Code>, Kind),
    /// Nothing is known but its type.
    Unknown(Kind),
    Unary(&'static str, Box<Code>),
    Binary(&'static str, Box<Code>, Box<Code>),
    Choice(Box<Question>, Box<Code>, Box<Code>),
    Truth(Box<Question>),
    Cast(Kind, Box<Code>),
    /// A function of the text, with what it is given.
    Call(usize, Vec<Code>),
}

/// Where something lies.
#[derive(Debug, Clone)]
pub(in crate::cost) struct Address {
    pub(in crate::cost) base: Base,
    pub(in crate::cost) offset: usize,
    /// Indices: each with the number of elements and the cells of one.
    pub(in crate::cost) indices: Vec<(Code, usize, usize)>,
    /// One cell stands for all elements of an array.
    pub(in crate::cost) is_summary: bool,
}

#[derive(Debug, Clone)]
pub(in crate::cost) enum Base {
    /// A cell of the function.
    Cell(usize),
    /// Where the pointer in that cell leads.
    Behind(usize),
    /// Nowhere that is looked at.
    Nowhere,
}

/// A condition, with what asking costs.
#[derive(Debug, Clone)]
pub(in crate::cost) enum Question {
    Both(Box<Question>, Box<Question>),
    Either(Box<Question>, Box<Question>),
    Not(Box<Question>),
    Compare(Price, &'static str, Code, Code),
    /// Other than 0.
    Some(Price, Code),
}

/// A statement.
#[derive(Debug, Clone)]
pub(in crate::cost) struct Op {
    /// Its line, to say where the time goes.
    pub(in crate::cost) line: u32,
    pub(in crate::cost) what: What,
}

#[derive(Debug, Clone)]
pub(in crate::cost) enum What {
    /// A number goes to a place, of which only numbers of that type are kept.
    Set(Price, Option<(Address, Kind)>, Code),
    /// Text that does not matter for the path.
    Pay(Price),
    /// Arms with their conditions and the price of the jump behind each; the last has none.
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
        /// Of a jump back, and of one out of it.
        jump: Price,
        rounds: u64,
        /// It is proved that it goes no more often; else it counts so far.
        is_proved: bool,
    },
    Return(Price, Option<Code>),
    Break,
    Continue,
    Block(Vec<Op>),
    /// From here on nobody asks what these cells hold.
    Forget(usize, usize),
    /// What a run can't follow.
    Lost(String),
}

/// A function.
#[derive(Debug, Clone, Default)]
pub(in crate::cost) struct Routine {
    /// The cells of the parameters with what they may hold; none for one that is no number.
    pub(in crate::cost) parameters: Vec<(usize, Option<Kind>)>,
    pub(in crate::cost) body: Vec<Op>,
    /// What it costs to enter it.
    pub(in crate::cost) entry: Price,
    /// What it gives.
    pub(in crate::cost) gives: Option<Kind>,
    /// How many cells it has, which stand behind those of its caller; and with those of all that it calls.
    pub(in crate::cost) cells: usize,
    pub(in crate::cost) depth: usize,
    /// Its first line.
    pub(in crate::cost) line: u32,
}

impl Question {
    /// What asking everything costs.
    pub(in crate::cost) fn price(&self) -> Price {
        match self {
            Question::Both(a, b) | Question::Either(a, b) => a.price().plus(b.price()),
            Question::Not(inner) => inner.price(),
            Question::Compare(price, ..) | Question::Some(price, _) => *price,
        }
    }
}
