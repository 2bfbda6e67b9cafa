//! The proof that emitted C is the net, by induction over one reaction.
//!
//! The text is read by `grafsynth_c`, and one call of `NAME_step` is executed on all paths at once, in the graph of the second encoding. The [`Representation`] tells
//! how the instance stores the state of the net: as a relation between the two. If `NAME_init` establishes it, and each reaction from related states with equal inputs
//! and equal `dt` gives equal outputs and related states, the C behaves like the net for ever. The relation is only a hint: if it is wrong, one of the two steps fails.
//!
//! Nothing here knows how the text was made. What C leaves undefined (overflow, indices, values that were never set) is an obligation like the others, for the
//! machine for which the text is read.
#![allow(clippy::wildcard_enum_match_arm, reason = "what is not listed is refused")]

mod answers;
mod assume;
mod attempt;
mod cases;
mod eval;
mod exec;
mod interface;
mod memory;
mod net_values;
mod question;
mod relation;
mod value;

use grafsynth_c::tree::Unit;
use grafsynth_ir::Valid;
use grafsynth_ir::counted;
use grafsynth_ir::facts::Facts;
use grafsynth_ir::instance::Representation;
use grafsynth_ir::net::Net;

use crate::cover::cover;
use crate::limits::Limits;
use question::Subject;

/// The proof that C is its net.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Induction {
    /// The number of functions that are equal by construction.
    pub same: usize,
    /// The number of functions that the solver proved equal.
    pub solved: usize,
    /// The number of things that C leaves undefined and that were proved not to happen.
    pub obligations: usize,
    /// The number of nodes of the graph in all questions for the solver, a measure of its work.
    work: usize,
    /// The same for the cases of single questions.
    split: usize,
}

impl std::fmt::Display for Induction {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let functions = counted(self.same + self.solved, "function", "functions");
        let Induction { same, solved, obligations, .. } = self;
        write!(
            f,
            "proved by induction: {functions}, {same} equal by construction, {solved} by the solver"
        )?;
        if *obligations > 0 {
            let dangers = counted(*obligations, "operation", "operations");
            write!(f, ", {dangers} never undefined")?;
        }
        Ok(())
    }
}

/// Proves that the C of a unit is the net, for every stimulus and every `dt` that the C accepts.
///
/// # Errors
/// The reason why there is no proof. The C may be right nevertheless.
pub fn prove(
    net: &Valid<Net>,
    facts: &Facts,
    unit: &Unit,
    hint: &Representation,
    limits: &Limits,
) -> Result<Induction, String> {
    let functions = &question::functions_of(unit);
    let further = &cover(net).further;
    Subject { net, facts, further, unit, functions, hint, limits }.prove()
}
