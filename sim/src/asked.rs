//! The functions of the input row that a reaction evaluates, for searches that try one row of each class.
//! While a simulator records, it notes each question that a reaction asks about its row: an expression whose other operands have been replaced by their values.
//! The effect of a reaction depends on the row only through the answers, and each question depends only on the earlier answers. So two rows that give the same
//! answers to the questions of one reaction give the same reaction, from the same state and with the same `dt`.
//!
//! An edge operand is a question when an edge of it is read, and when its value stays in the state (semantics §3.7). An event of a statechart is a question
//! when its transitions would fire, not when it joins the queue (§5).

use grafsynth_ir::Span;
use grafsynth_ir::expr::{ArithOp, CompareOp, Expr, ExprKind};
use grafsynth_ir::net::{InputId, OutputId};
use indexmap::IndexSet;

/// A function of the input row.
pub type Function = Expr<InputId>;

/// A question about the input row; its answer is a number, 0 or 1 for a Boolean.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum Question {
    /// The value of a function.
    Value(Function),
    /// Whether the event at this place of a list of events joins a queue with room for `room` of them, if they join in this order.
    Queued {
        /// The number of the list, see [`Asked::lists`].
        list: usize,
        /// The place of the event in the list.
        place: usize,
        /// The number of events that fit.
        room: usize,
    },
    /// Whether that event occurs and does not fit.
    Lost {
        /// The number of the list.
        list: usize,
        /// The place of the event in the list.
        place: usize,
        /// The number of events that fit.
        room: usize,
    },
    /// Whether more than `room` events of the list occur.
    Overflow {
        /// The number of the list.
        list: usize,
        /// The number of events that fit.
        room: usize,
    },
}

/// The value of an expression as far as it is known without the input row.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Partial {
    Known(i64),
    Free(Function),
}

impl Partial {
    fn into_function(self) -> Function {
        match self {
            // In Boolean positions `and`, `or` and `not` fold constants, so a constant is left only as an operand of a comparison or of arithmetic.
            Partial::Known(value) => Expr::int(value),
            Partial::Free(function) => function,
        }
    }

    pub(crate) fn input(input: InputId) -> Partial {
        Partial::Free(Expr::leaf(input, Span::default()))
    }

    pub(crate) fn not(self) -> Partial {
        match self {
            Partial::Known(value) => Partial::Known(i64::from(value == 0)),
            Partial::Free(function) => Partial::Free(function.not()),
        }
    }

    pub(crate) fn and(all: impl IntoIterator<Item = Partial>) -> Partial {
        Self::junction(all, 1)
    }

    pub(crate) fn or(all: impl IntoIterator<Item = Partial>) -> Partial {
        Self::junction(all, 0)
    }

    /// A conjunction (`neutral` is 1) or a disjunction (0).
    fn junction(all: impl IntoIterator<Item = Partial>, neutral: i64) -> Partial {
        let mut free: Vec<Function> = Vec::new();
        for one in all {
            match one {
                Partial::Known(value) if i64::from(value != 0) == neutral => {}
                Partial::Known(_) => return Partial::Known(1 - neutral),
                Partial::Free(function) => free.push(function),
            }
        }
        match (free.is_empty(), neutral) {
            (true, _) => Partial::Known(neutral),
            (false, 0) => Partial::Free(Expr::or(free)),
            (false, _) => Partial::Free(Expr::and(free)),
        }
    }
}

/// The partial value of an expression. `leaf` gives that of a leaf, or of the element with an index; `len` gives the number of elements.
pub(crate) fn partial<L>(
    expr: &Expr<L>,
    leaf: &impl Fn(&L, Option<i64>) -> Partial,
    len: &impl Fn(&L) -> i64,
) -> Partial {
    let of = |expr: &Expr<L>| partial(expr, leaf, len);
    match &expr.kind {
        ExprKind::Bool(value) => Partial::Known(i64::from(*value)),
        ExprKind::Int(value) => Partial::Known(*value),
        ExprKind::Leaf(own) => leaf(own, None),
        ExprKind::Element(own, index) => match of(index) {
            Partial::Known(index) => leaf(own, Some(index)),
            Partial::Free(index) => element(&index, &|at| leaf(own, Some(at)), len(own)),
        },
        ExprKind::Not(a) => of(a).not(),
        ExprKind::And(all) => Partial::and(all.iter().map(of)),
        ExprKind::Or(all) => Partial::or(all.iter().map(of)),
        ExprKind::Compare(op, a, b) => pair(of(a), of(b), |a, b| ExprKind::Compare(*op, a, b)),
        ExprKind::Neg(a) => {
            pair(Partial::Known(0), of(a), |zero, a| ExprKind::Arith(ArithOp::Sub, zero, a))
        }
        ExprKind::Arith(op, a, b) => pair(of(a), of(b), |a, b| ExprKind::Arith(*op, a, b)),
        ExprKind::Select(a, b, c) => match of(a) {
            Partial::Known(0) => of(c),
            Partial::Known(_) => of(b),
            Partial::Free(condition) => select(condition, of(b), of(c)),
        },
    }
}

fn free(kind: ExprKind<InputId>) -> Partial {
    Partial::Free(Expr::new(kind, Span::default()))
}

fn pair(
    a: Partial,
    b: Partial,
    make: impl Fn(Box<Function>, Box<Function>) -> ExprKind<InputId>,
) -> Partial {
    let is_known = matches!((&a, &b), (Partial::Known(_), Partial::Known(_)));
    let kind = make(Box::new(a.into_function()), Box::new(b.into_function()));
    if is_known {
        return Partial::Known(value(&Expr::new(kind, Span::default()), &|_| 0));
    }
    free(kind)
}

fn select(condition: Function, then: Partial, otherwise: Partial) -> Partial {
    if then == otherwise {
        return then;
    }
    let [then, otherwise] = [then, otherwise].map(|one| Box::new(one.into_function()));
    free(ExprKind::Select(Box::new(condition), then, otherwise))
}

/// The element with an index that depends on the row. As everywhere, an index outside the array reads its first or last element.
fn element(index: &Function, at: &impl Fn(i64) -> Partial, len: i64) -> Partial {
    let last = len.max(1) - 1;
    (0..last).rev().fold(at(last), |behind, place| {
        let here = [index.clone(), Expr::int(place)].map(Box::new);
        let [index, place_of] = here;
        let is_here = Expr::new(ExprKind::Compare(CompareOp::Le, index, place_of), Span::default());
        select(is_here, at(place), behind)
    })
}

/// The value of a function in a row.
#[must_use]
pub fn value(function: &Function, input: &impl Fn(InputId) -> i64) -> i64 {
    crate::evaluate::eval_by(function, &|leaf, _| input(*leaf))
}

/// The questions of the last reaction.
#[derive(Debug, Clone, Default)]
pub struct Asked {
    /// All questions of all reactions so far; a number in the other fields is an index into this set.
    pub questions: IndexSet<Question>,
    /// The lists of events that questions name.
    pub lists: IndexSet<Vec<InputId>>,
    /// The questions of the last reaction, in order, with their answers. A question may occur twice.
    pub answers: Vec<(usize, i64)>,
    /// Questions about receptivities in the first check. They are asked in every reaction from this state with this `dt`, whatever the answers are.
    pub first_check: Vec<usize>,
    /// A reaction with the same answers has at most this many checks more than the last reaction: each event that fires nothing also takes a check.
    pub more_rounds: u32,
}

/// The state of a recording.
#[derive(Debug, Clone, Default)]
pub(crate) struct Recorder {
    pub(crate) asked: Asked,
    /// For each input, true if its value is now that of the row.
    pub(crate) is_free: Vec<bool>,
    /// For each edge operand: its value now, its last compared value, and its edges in this check.
    pub(crate) now: Vec<Partial>,
    pub(crate) old: Vec<Partial>,
    pub(crate) rise: Vec<Partial>,
    pub(crate) fall: Vec<Partial>,
    /// The outputs whose values in the row are of interest.
    pub(crate) outputs: Vec<bool>,
    /// True if it is of interest whether the emergency is active.
    pub(crate) emergency: bool,
    /// Statecharts: the events of the row whose effect is not decided yet.
    pub(crate) events: Events,
}

/// The events of a row that a statechart has not taken from its queue yet.
#[derive(Debug, Clone, Default)]
pub(crate) struct Events {
    /// Their list, its length, and the place of the next event.
    pub(crate) list: usize,
    pub(crate) len: usize,
    pub(crate) next: usize,
    /// The number of events for which there is room in the queue.
    pub(crate) room: usize,
    /// The number of due sends in front of them in the queue.
    pub(crate) n_due: usize,
    /// The number of events in the queue, and of those that are not in the queue and would fire nothing.
    pub(crate) queued: usize,
    pub(crate) skipped: usize,
}

impl Recorder {
    pub(crate) fn begin(&mut self, old: impl Iterator<Item = i64>) {
        self.asked.answers.clear();
        self.asked.first_check.clear();
        self.asked.more_rounds = 0;
        self.is_free.fill(false);
        self.old.clear();
        self.old.extend(old.map(Partial::Known));
        for edges in [&mut self.rise, &mut self.fall, &mut self.now] {
            edges.clear();
            edges.resize(self.old.len(), Partial::Known(0));
        }
        self.events = Events::default();
    }

    /// Records a question with its answer.
    pub(crate) fn ask(&mut self, question: Question, answer: i64) {
        let number = match self.asked.questions.get_index_of(&question) {
            Some(number) => number,
            None => self.asked.questions.insert_full(question).0,
        };
        self.asked.answers.push((number, answer));
    }

    /// Records the evaluation of an expression.
    pub(crate) fn note(&mut self, partial: Partial, answer: i64) {
        if let Partial::Free(function) = partial {
            self.ask(Question::Value(function), answer);
        }
    }

    /// K1 for one operand: its edges, if they are visible.
    pub(crate) fn edge(&mut self, edge: usize, is_visible: bool) {
        let both = |now: Partial, old: Partial| match is_visible {
            true => Partial::and([now, old]),
            false => Partial::Known(0),
        };
        let (now, old) = (self.now[edge].clone(), self.old[edge].clone());
        self.rise[edge] = both(now.clone(), old.clone().not());
        self.fall[edge] = both(now.not(), old);
    }
}

/// Which outputs a recording observes.
pub(crate) fn observed(n_outputs: usize, outputs: &[OutputId]) -> Vec<bool> {
    let mut observed = vec![false; n_outputs];
    outputs.iter().for_each(|output| observed[output.index()] = true);
    observed
}
