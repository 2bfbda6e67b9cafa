//! The gate: what is true of every net that a back end, the simulator or the verifier sees.
//!
//! # Invariants
//! Of everything:
//! 1. Every id lies in its arena.
//! 2. Names are not empty and have no character that a trace could not show (blanks, control characters, any of `` , ; " ' ` # ( ) [ ] { } ``).
//!    Only properties, parameters and nothing else may be without a name. A column of the trace is not called `dt`, `scan` or `steps`,
//!    nor `fault` where the evolution is stable.
//! 3. Names are unique within each of these: signals (inputs, outputs, variables, timers; the memory of a stored output may be called
//!    like its output), steps with macro-steps, parts, transitions, controlled actions, send slots, histories, the tasks of a step. No signal is
//!    called `S.active`, `S.t`, `S.T` or `S.done` for a step or macro-step S.
//! 4. A range has `lo <= hi`, both within 32 bits, signed. An array has at least one element. An event is Boolean.
//! 5. The value at reset lies in the type; there is one, or one for each element.
//! 6. Priorities, levels, `limit`, the queue bound and the tick are at least 1. Lists of steps, events and parts name nothing twice.
//!
//! Of expressions ([`crate::interval`]):
//!
//! 7. Every expression has a type, and the kind (truth value or number) that its place needs: no result leaves 64 bits, no divisor can be 0, no index
//!    can leave its array, and none is deeper than [`crate::interval::DEPTH_LIMIT`]; nor are blocks.
//! 8. Tick counts (`s.t`, `s.T`, free timers) stand only in comparisons with constants in `0..=`[`crate::interval::LONGEST`].
//! 9. Edges stand in receptivities and in lists of steps, transitions and histories; nowhere else.
//! 10. Events likewise, and not at all in a statechart: there a transition names them in `events`.
//! 11. `Fireable` stands in receptivities only and names a transition declared earlier.
//! 12. The operand of an edge is Boolean, without edges, events and `Fireable`.
//! 13. An `unspecified` condition reads inputs and step bits only; a property neither edges, `Fireable` nor internal events; an assumption inputs only,
//!     an assertion no extern action with parameters (one without is true in a reaction that calls it).
//!
//! Of outputs, statements, actions and tasks:
//!
//! 14. Continuous, mealy and controlled outputs and extern actions are Boolean; a stored output has the type of its variable, which is a plain one of
//!     origin `StoredOutput`, and each such variable is the memory of exactly one output. A controlled action drives at most one output.
//! 15. An extern action is continuous or called, never both; it has one argument of the right kind for each parameter.
//! 16. Mealy outputs exist only in evolution `Single`.
//! 17. An assignment has an index exactly if its target is an array, and a value of the target's kind. What is raised or sent is an event; what is
//!     called is an extern action.
//! 18. A controlled action has a duration of 0 unless one of its qualifiers is timed, and none above [`crate::interval::LONGEST`]; so have sends.
//! 19. A task holds assignments, calls and `if` only; its cost is at most its step's budget, and a step with tasks has a budget.
//!     Locks are plain Boolean variables, each listed once.
//!
//! Of structure outside statecharts:
//!
//! 20. No statechart part: kinds are `Leaf` and `Enclosing`; no history, send, queue, initial content, done event or part with `initial`; only steps
//!     are entered.
//! 21. `clears` equals `requires`. A move has a step on at least one side. A reaction has one step, clears and enters nothing, and has no priority.
//! 22. Parents are enclosing steps declared earlier, in a part of a lower level; all steps of a part have one parent; only an enclosed step has an
//!     activation link; a transition does not cross the border of an enclosure.
//! 23. Forcing: at least one target part, and a situation within the target, closed downwards along activation links; forcing has no cycle.
//! 24. A root part with steps has an initial step or a source transition, or is forced.
//! 25. The entry and exit of a macro-step are among its steps.
//!
//! Of structure in statecharts (policy `InnerFirst` or `OuterFirst`):
//!
//! 26. Evolution is `Stable`. There is no enclosing step, activation link, initial flag, macro-step, forcing, `fire one`, priority of a step or a transition,
//!     source or sink transition, nor a second source; every move restarts.
//! 27. A queue bound exists where something is raised or sent, done events included.
//! 28. Parents are composite or parallel, declared earlier, of the same part. Only composite and parallel states have children, and they have at least one;
//!     a region is not final; a final state is no source and has no children. Only composites have initial content; only composites and
//!     parallels a done event, which is an event.
//! 29. `clears` of a move is exactly the proper descendants of one composite state or of the part, and contains its source or lies below it.
//! 30. What is entered, by a move or by `initial`, completes a configuration: parents before children; one child (or a history of it) for each entered
//!     composite and for the domain, all children for each entered parallel (or a history of it); initial content only of entered composites.
//! 31. A history belongs to a composite or parallel state; what it records and enters lies inside, histories in its lists belong to states inside;
//!     no step is recorded twice.
//!
//! Of emergencies:
//!
//! 32. A safe value lies in the type of its output; extern actions have none. A net with an emergency has no `registered` output and no open cell, and
//!     its condition asks no extern condition.
//!
//! All checks together are linear in the size of the net, but for sorting names.

mod emergency;
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

/// A value that passed its validation. Only [`validate`] makes one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Valid<T>(T);

impl<T> Valid<T> {
    /// The value, no longer known to be valid.
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
/// Every breach, with its place, in the order of the net's fields.
pub fn validate(net: Net) -> Result<Valid<Net>, Vec<Diagnostic>> {
    let findings = breaches(&net);
    if findings.is_empty() { Ok(Valid(net)) } else { Err(findings) }
}

/// What [`validate`] would report; empty for a valid net.
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

/// The findings so far, and what they are about. Checks are spread over the submodules by topic.
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

    /// True if the arena has the item; else reports it. `what` is the item's kind.
    fn has<T>(&mut self, arena: &Arena<T>, id: Id<T>, span: Span, what: &str) -> bool {
        let found = arena.get(id).is_some();
        if !found {
            let (number, len) = (id.index(), arena.len());
            self.report(
                codes::DANGLING,
                span,
                format!("{what} number {number} is named, the net has {len} of them"),
            );
        }
        found
    }

    /// Reports ids that stand twice; `name` gives the text for the message.
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
                format!("`{name}` stands {} times in {list}", pair.len()),
            );
        }
    }

    fn at_least_one(&mut self, number: Option<u64>, span: Span, what: &str) {
        if number == Some(0) {
            self.report(codes::BELOW_ONE, span, format!("{what} is 0, the least is 1"));
        }
    }
}
