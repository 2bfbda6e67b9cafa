//! Expressions whose result depends on the order of evaluation, which C leaves open (C99 6.5p2, p3).
//!
//! Two operands are *unsequenced* if no sequence point is between them: the operands of `+`, the arguments of a call, an array and its index. It is an error if
//! one of them writes what the other may read or write, as in `a[i] = i++`; that is undefined. It is also an error if one calls a function that may write what
//! the other reads or writes, as in `f() + g()`: the calls do not overlap, but either may be first.
//!
//! The check is on the safe side: it also rejects `i = (i++, i)`, where a sequence point within an operand makes the order clear.
//!
//! Whether two places are the same object is decided by [`may_overlap`], and whether a function writes by [`effects`].

use crate::codes;
use crate::tree::{Expr, ExprKind, Init, Loc, Place, Symbol, Unit};
use crate::uses::{Accesses, Effect, Index, Summary, effects, may_overlap};
use crate::walk::{Full, Node, each_full, expr_parts, init_values, place_parts};
use grafsynth_ir::{Diagnostic, IdMap};

/// The maximum number of effects (writes, and calls that may write) in one expression.
const MAX_EFFECTS: usize = 256;

/// The expressions of a unit that depend on the order of evaluation.
#[must_use]
pub fn check(unit: &Unit) -> Vec<Diagnostic> {
    let index = Index::new(unit);
    let effects = effects(unit, &index);
    let mut checker =
        Checker { unit, index: &index, effects: &effects, n_effects: 0, found: Vec::new() };
    each_full(unit, &mut |_, full| {
        checker.n_effects = 0;
        match full {
            Full::Expr(expr) => {
                checker.expr(expr);
            }
            Full::Init(_, init) => checker.init(init),
        }
    });
    checker.found
}

/// A place that is written, and true if a called function writes it: such a write is complete when the function returns (C99 6.5.2.2p10).
type Write<'a> = (&'a Place, bool);

/// The reads, writes and calls of an operand and all its parts.
#[derive(Debug)]
struct Done<'a> {
    reads: Vec<&'a Place>,
    writes: Vec<Write<'a>>,
    /// The strongest effect of the calls in the operand.
    calls: Effect,
}

impl Default for Done<'_> {
    fn default() -> Self {
        Done { reads: Vec::new(), writes: Vec::new(), calls: Effect::None }
    }
}

impl<'a> Done<'a> {
    fn is_silent(&self) -> bool {
        self.writes.is_empty() && self.calls < Effect::Writes
    }

    /// Joins the accesses of two operands; the work is proportional to the smaller list.
    fn join(mut self, mut other: Done<'a>) -> Done<'a> {
        let size = |it: &Done| it.reads.len() + it.writes.len();
        if size(&self) < size(&other) {
            std::mem::swap(&mut self, &mut other);
        }
        self.reads.append(&mut other.reads);
        self.writes.append(&mut other.writes);
        self.calls = self.calls.max(other.calls);
        self
    }
}

struct Checker<'a> {
    unit: &'a Unit,
    index: &'a Index,
    effects: &'a IdMap<Symbol, Summary>,
    n_effects: usize,
    found: Vec<Diagnostic>,
}

impl<'a> Checker<'a> {
    fn init(&mut self, init: &'a Init) {
        // The values of a list are evaluated in any order (C99 6.7.8p23).
        let mut all = Done::default();
        let mut values = Vec::new();
        init_values(init, &mut |value| values.push(value));
        for value in values {
            let done = self.expr(value);
            self.compare(&all, &done, value.span);
            all = all.join(done);
        }
    }

    fn expr(&mut self, expr: &'a Expr) -> Done<'a> {
        let is_sequenced =
            matches!(expr.kind, ExprKind::Logical(..) | ExprKind::Choose(..) | ExprKind::Comma(..));
        let mut parts = Vec::new();
        expr_parts(expr, &mut |part| parts.push(part));
        let mut all = self.parts(&parts, is_sequenced, expr.span);
        self.own(expr, &mut all);
        all
    }

    fn parts(&mut self, parts: &[Node<'a>], is_sequenced: bool, span: Loc) -> Done<'a> {
        let mut all = Done::default();
        for part in parts {
            let done = match part {
                Node::Expr(inner) => self.expr(inner),
                Node::Place(place) => {
                    let mut inner = Vec::new();
                    place_parts(place, &mut |part| inner.push(part));
                    self.parts(&inner, false, place.span)
                }
            };
            if !is_sequenced {
                self.compare(&all, &done, span);
            }
            all = all.join(done);
        }
        all
    }

    /// Adds the accesses of the outermost operator, and compares them with the side effects of the operands.
    fn own(&mut self, expr: &'a Expr, all: &mut Done<'a>) {
        let mut own = Accesses::default();
        own.own(expr);
        for written in &own.writes {
            // Operands are read to compute what is written; only their side effects are unsequenced with the write (C99 6.5p2).
            let is_read = matches!(expr.kind, ExprKind::Update(..) | ExprKind::Step { .. });
            let meets = |(place, is_called): &Write| {
                (is_read || !is_called) && self.overlap(place, written)
            };
            let is_called = is_read && all.calls == Effect::Writes && self.is_reachable(written);
            if all.writes.iter().any(meets) || is_called {
                self.report(expr.span);
            }
        }
        let mut calls = Effect::None;
        let mut writes: Vec<Write> = own.writes.iter().map(|place| (*place, false)).collect();
        for call in &own.calls {
            let Some(id) = call.function else {
                calls = Effect::Writes;
                continue;
            };
            calls = calls.max(self.effects[id].effect);
            for at in &self.effects[id].written {
                match call.arguments.get(*at).map(|argument| &argument.kind) {
                    Some(ExprKind::Address(place) | ExprKind::Decay(place)) => {
                        writes.push((place, true));
                    }
                    _ => calls = Effect::Writes,
                }
            }
        }
        let before = self.n_effects;
        self.n_effects += writes.len() + usize::from(calls == Effect::Writes);
        if self.n_effects > MAX_EFFECTS {
            if before <= MAX_EFFECTS {
                let message = format!("the expression has more than {MAX_EFFECTS} side effects");
                let found = Diagnostic::error(codes::LIMIT, message);
                self.found.push(found.at(expr.span.0, "here"));
            }
            return;
        }
        all.reads.append(&mut own.reads);
        all.writes.append(&mut writes);
        all.calls = all.calls.max(calls);
    }

    fn overlap(&self, a: &Place, b: &Place) -> bool {
        may_overlap(self.unit, self.index, a, b)
    }

    /// True if a called function may access the place.
    fn is_reachable(&self, place: &Place) -> bool {
        match place.object() {
            Some(id) => {
                let is_constant = place.qualifiers.is_const && !place.qualifiers.is_volatile;
                self.index.is_shared(self.unit, id) && !is_constant
            }
            None => true,
        }
    }

    /// Reports an error if two unsequenced operands conflict.
    fn compare(&mut self, a: &Done<'a>, b: &Done<'a>, span: Loc) {
        if a.is_silent() && b.is_silent() {
            return;
        }
        if self.disturbs(a, b) || self.disturbs(b, a) {
            self.report(span);
        }
    }

    /// True if a side effect of `a` may touch a place that `b` reads or writes.
    fn disturbs(&self, a: &Done<'a>, b: &Done<'a>) -> bool {
        let touched = || b.reads.iter().copied().chain(b.writes.iter().map(|(place, _)| *place));
        let writes = a.writes.iter().any(|(written, _)| {
            touched().any(|place| self.overlap(place, written))
                || b.calls >= Effect::Reads && self.is_reachable(written)
        });
        let calls = a.calls == Effect::Writes
            && (b.calls >= Effect::Reads || touched().any(|place| self.is_reachable(place)));
        writes || calls
    }

    fn report(&mut self, span: Loc) {
        let message = "the result depends on the order of evaluation, which C leaves open";
        let found = Diagnostic::error(codes::ORDER, message)
            .at(span.0, "one operand changes what another one uses")
            .help("store one of the values in a variable first");
        self.found.push(found);
    }
}
