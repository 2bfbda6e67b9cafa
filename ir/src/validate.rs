//! Validation: the invariants of every net that a back end, the simulator or the verifier accepts.
//!
//! # Invariants
//! General:
//! 1. Every id refers to an item of its arena.
//! 2. Names are not empty and contain no character that a trace cannot show
//!    (blanks, control characters, any of `` , ; " ' ` # ( ) [ ] { } ``).
//!    Only properties and parameters may be unnamed.
//!    No column of the trace is called `dt`, `scan` or `steps`, nor `fault` if the evolution is stable.
//! 3. Names are unique within each of these groups: signals (inputs, outputs, variables, timers; the memory of a stored output may have the output's
//!    name), steps with macro-steps, parts, transitions, controlled actions, send slots, histories, the tasks of a step. No signal is called `S.active`,
//!    `S.t`, `S.T` or `S.done` for a step or macro-step S.
//! 4. A range has `lo <= hi`, both within 32 bits, signed. An array has at least one element. An event is Boolean.
//! 5. Reset values are within the type; there is one, or one for each element.
//! 6. Priorities, levels, `limit`, the queue bound and the tick are at least 1. Lists of steps, events and parts contain no duplicates.
//!
//! Expressions ([`crate::interval`]):
//!
//! 7. Every expression has a type of the kind (Boolean or number) that its context needs: no result exceeds 64 bits, no divisor can be 0, no index can be
//!    outside its array, and neither expressions nor blocks are nested deeper than [`crate::interval::DEPTH_LIMIT`].
//! 8. Tick counts (`s.t`, `s.T`, free timers) occur only in comparisons with constants in `0..=`[`crate::interval::LONGEST`].
//! 9. Edges occur only in receptivities and in statement lists of steps, transitions and histories.
//! 10. The same is true for events. In a statechart, they do not occur in expressions: a transition lists them in `events`.
//! 11. `Fireable` occurs only in receptivities and refers to a transition declared earlier.
//! 12. The operand of an edge is Boolean, without edges, events and `Fireable`.
//! 13. An `unspecified` condition reads only inputs and step bits. A property reads no edges, `Fireable` or internal events; an assumption reads only
//!     inputs; an assertion reads no extern action with parameters (one without parameters is true in a reaction that calls it).
//!
//! Outputs, statements, actions and tasks:
//!
//! 14. Continuous, mealy and controlled outputs and extern actions are Boolean. A stored output has the type of its variable, which is not an array and
//!     has the origin `StoredOutput`; each such variable is the memory of exactly one output. A controlled action drives at most one output.
//! 15. An extern action is continuous or called, never both; it has one argument of the right kind for each parameter.
//! 16. Mealy outputs, and outputs that show that a transition fires, are allowed only in evolution `Single`.
//! 17. An assignment has an index if and only if its target is an array, and a value of the target's kind. Only events are raised or sent; only extern actions
//!     are called.
//! 18. A controlled action has duration 0 unless one of its qualifiers is timed. No duration of an action or a send is above [`crate::interval::LONGEST`].
//! 19. A task contains only assignments, calls and `if`; its cost is at most its step's budget, and a step with tasks has a budget. Locks are plain
//!     Boolean variables, each listed once.
//!
//! Structure outside statecharts:
//!
//! 20. There are no statechart features: step kinds are `Leaf` and `Enclosing`; there is no history, send, queue, initial content, done event or part with
//!     `initial`; only steps are entered.
//! 21. `clears` equals `requires`. A move has a step on at least one side. A reaction has one step, clears and enters nothing, and has no priority.
//! 22. Parents are enclosing steps declared earlier, in a part of a lower level; all steps of a part have one parent; only an enclosed step has an
//!     activation link; a transition does not cross the border of an enclosure.
//! 23. Forcing: at least one target part, and a situation within the target, closed downwards along activation links; forcing has no cycle.
//! 24. A root part with steps has an initial step or a source transition, or is forced.
//! 25. The entry and exit of a macro-step are among its steps.
//!
//! Structure of statecharts (policy `InnerFirst` or `OuterFirst`):
//!
//! 26. Evolution is `Stable`. There is no enclosing step, activation link, initial flag, macro-step, forcing, `fire one`, priority of a step or a
//!     transition, source or sink transition, or second source; every move restarts.
//! 27. If anything is raised or sent (including done events), there is a queue bound.
//! 28. Parents are composite or parallel, declared earlier, in the same part. Only composite and parallel states have children, and they have at least
//!     one. A region is not final; a final state is not a source and has no children. Only composite states have initial content; only composite and
//!     parallel states have a done event, and it is an input of kind event.
//! 29. `clears` of a move is exactly the set of proper descendants of one composite state or of the part; the source is in this set or is that state.
//! 30. The entered states of a move or of `initial` complete a configuration: parents before children; one child (or a history of it) for each entered
//!     composite state and for the domain, all children for each entered parallel state (or a history of it); initial content only of entered composite
//!     states.
//! 31. A history belongs to a composite or parallel state. Everything that it records and enters is inside that state, and histories in its lists belong to
//!     states inside that state; no step is recorded twice.
//!
//! Emergencies:
//!
//! 32. A safe value is within the type of its output; extern actions have none. A net with an emergency has no `registered` output and no open cell, and
//!     its condition reads no extern condition.
//!
//! Parts of a split:
//!
//! 33. A net with an [`Ending`](crate::net::Ending) has evolution `Single`, and the condition reads only pins.
//!
//! All checks together take linear time in the size of the net, except for sorting names.

pub(crate) mod emergency;
mod expressions;
mod names;
mod statechart;
mod statements;
mod structure;

use crate::arena::{Arena, Id};
use crate::codes;
use crate::diag::{Code, Diagnostic};
use crate::net::Net;
use crate::span::Span;

/// A value that passed validation. Only [`validate`] makes one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Valid<T>(T);

impl<T> Valid<T> {
    /// Returns the value, which then no longer counts as valid.
    #[must_use]
    pub fn into_inner(self) -> T {
        self.0
    }
}

impl<T> std::ops::Deref for Valid<T> {
    type Target = T;
    fn deref(&self) -> &T {
        &self.0
    }
}

/// Checks a net against the invariants of this module.
///
/// # Errors
/// Every violation, with its location, in the order of the net's fields.
pub fn validate(net: Net) -> Result<Valid<Net>, Vec<Diagnostic>> {
    let findings = breaches(&net);
    if findings.is_empty() { Ok(Valid(net)) } else { Err(findings) }
}

/// The findings of [`validate`]; empty for a valid net.
#[must_use]
pub fn breaches(net: &Net) -> Vec<Diagnostic> {
    let mut checker =
        Checker { net, out: Vec::new(), statechart: net.settings.policy.is_statechart() };
    checker.names();
    checker.settings();
    checker.parts();
    checker.declarations();
    checker.expressions();
    checker.outputs();
    checker.steps();
    checker.transitions();
    checker.actions();
    if checker.statechart {
        checker.statechart_structure();
    } else {
        checker.grafcet_structure();
    }
    checker.rest();
    checker.out
}

/// The findings so far and their subject. The checks are in the submodules, by topic.
struct Checker<'a> {
    net: &'a Net,
    out: Vec<Diagnostic>,
    statechart: bool,
}

impl Checker<'_> {
    fn report(&mut self, code: Code, span: Span, message: impl Into<String>) {
        self.out.push(Diagnostic::error(code, message).at(span, ""));
    }

    fn report_with_help(
        &mut self,
        code: Code,
        span: Span,
        message: impl Into<String>,
        help: impl Into<String>,
    ) {
        self.out.push(Diagnostic::error(code, message).at(span, "").help(help));
    }

    /// True if the arena has the item; otherwise the missing item is reported. `what` is the item's kind.
    fn has<T>(&mut self, arena: &Arena<T>, id: Id<T>, span: Span, what: &str) -> bool {
        let found = arena.get(id).is_some();
        if !found {
            let (number, len) = (id.index(), arena.len());
            self.report(
                codes::DANGLING,
                span,
                match len {
                    0 => format!("the net refers to {what} number {number}, but it has no {what}"),
                    _ => format!(
                        "the net refers to {what} number {number}, but the last one is number {}",
                        len - 1
                    ),
                },
            );
        }
        found
    }

    /// Reports ids that are listed twice; `name` returns the text for the message.
    fn twice<T>(
        &mut self,
        ids: &[Id<T>],
        span: Span,
        list: &str,
        name: impl Fn(Id<T>) -> Option<String>,
    ) {
        if ids.len() < 2 {
            return;
        }
        let mut sorted = ids.to_vec();
        sorted.sort_unstable();
        for pair in sorted.chunk_by(|a, b| a == b).filter(|same| same.len() > 1) {
            let name = name(pair[0]).unwrap_or_default();
            self.report(
                codes::LISTED_TWICE,
                span,
                format!("`{name}` is listed {} times in {list}", pair.len()),
            );
        }
    }

    fn at_least_one(&mut self, number: Option<u64>, span: Span, what: &str) {
        if number == Some(0) {
            self.report(codes::BELOW_ONE, span, format!("{what} is 0; the minimum is 1"));
        }
    }
}
