//! Calls of extern actions (semantics §6): the sequence that a reaction makes, and the condition that two such sequences differ.

use grafsynth_ir::expr::CompareOp;
use grafsynth_ir::net::OutputId;

use super::aig::{Aig, Lit};
use super::number::Number;

/// The maximum number of calls of a sequence; the functions grow with its square.
const MAX_CALLS: usize = 300;

/// A call that a reaction may make.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Call {
    /// The action.
    pub(crate) output: OutputId,
    /// The condition under which the call is made.
    pub(crate) when: Lit,
    /// The arguments; false is 0 and true is 1.
    pub(crate) arguments: Vec<Number>,
}

/// The conditions under which two sequences of calls differ in number, order or arguments. Calls are in the order in which they are made.
///
/// # Errors
/// A sequence is too long.
pub(crate) fn differ(aig: &mut Aig, ours: &[Call], theirs: &[Call]) -> Result<Vec<Lit>, String> {
    if ours.len().max(theirs.len()) > MAX_CALLS {
        return Err(format!("a reaction with more than {MAX_CALLS} calls is not supported"));
    }
    let (ours, theirs) = (positions(aig, ours), positions(aig, theirs));
    let mut all = Vec::new();
    for at in 0..ours.len().max(theirs.len()) {
        let none = Vec::new();
        let (a, b) = (ours.get(at).unwrap_or(&none), theirs.get(at).unwrap_or(&none));
        let mut outputs: Vec<OutputId> = a.iter().chain(b).map(|call| call.output).collect();
        outputs.sort_unstable();
        outputs.dedup();
        for output in outputs {
            let (a, b) = (merged(aig, a, output), merged(aig, b, output));
            all.push(aig.xor(a.when, b.when));
            let is_made = aig.and(a.when, b.when);
            if a.arguments.len() != b.arguments.len() {
                all.push(is_made);
            }
            for (x, y) in a.arguments.iter().zip(&b.arguments) {
                let other = Number::compare(aig, CompareOp::Ne, x, y);
                all.push(aig.and(is_made, other));
            }
        }
    }
    Ok(all)
}

/// For each position of a sequence, the calls that may be there. At most one of them is made there.
fn positions(aig: &mut Aig, calls: &[Call]) -> Vec<Vec<Call>> {
    let mut all: Vec<Vec<Call>> = Vec::new();
    // For each number, the condition that so many calls were made before.
    let mut count = vec![Lit::TRUE];
    for call in calls.iter().filter(|call| call.when != Lit::FALSE) {
        let mut next = vec![Lit::FALSE; count.len() + 1];
        for (at, so_many) in count.into_iter().enumerate() {
            let here = aig.and(so_many, call.when);
            let not_here = aig.and(so_many, !call.when);
            next[at] = aig.or(next[at], not_here);
            next[at + 1] = here;
            if here == Lit::FALSE {
                continue;
            }
            if all.len() <= at {
                all.resize_with(at + 1, Vec::new);
            }
            all[at].push(Call { when: here, ..call.clone() });
        }
        while next.last() == Some(&Lit::FALSE) {
            next.pop();
        }
        count = next;
    }
    all
}

/// The calls of one action at one position as one call.
fn merged(aig: &mut Aig, calls: &[Call], output: OutputId) -> Call {
    let mut all = calls.iter().filter(|call| call.output == output);
    let Some(mut one) = all.next().cloned() else {
        return Call { output, when: Lit::FALSE, arguments: Vec::new() };
    };
    for call in all {
        let arguments = one.arguments.iter().zip(&call.arguments);
        one.arguments = arguments.map(|(a, b)| Number::select(aig, call.when, b, a)).collect();
        one.when = aig.or(one.when, call.when);
    }
    one
}
