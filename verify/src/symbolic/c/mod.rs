//! The proof that emitted C behaves like the net, by induction over one reaction.
//!
//! The text is read by `grafsynth_c`, and one call of `NAME_step` is executed on all paths at once, in the graph of the second encoding. The [`Representation`]
//! describes how the instance stores the state of the net, as a relation between the two. If `NAME_init` establishes it, and each reaction from related states
//! with equal inputs
//! and equal `dt` gives equal outputs and related states, the C behaves like the net for ever. The relation is only a hint: if it is wrong, one of the two steps fails.
//! This module does not depend on how the text was made. The absence of undefined behaviour (overflow, indices out of range, values that were never set) is an
//! obligation like the others, for the machine for which the text is read.
#![allow(clippy::wildcard_enum_match_arm, reason = "variants that are not listed are refused")]

mod answers;
mod asked;
mod assume;
mod attempt;
mod byte_code;
mod bytes;
mod callbacks;
mod cases;
mod eval;
mod evolution;
mod exec;
mod extra;
mod gate;
mod image_loop;
mod interface;
mod locals;
mod machine;
mod memory;
mod merged;
mod net_values;
mod pointers;
mod program_image;
mod question;
mod relation;
mod report;
mod run;
mod serving;
mod settle;
mod value;

use grafsynth_c::tree::Unit;
use grafsynth_ir::Valid;
use grafsynth_ir::counted;
use grafsynth_ir::facts::Facts;
use grafsynth_ir::instance::{Extra, Representation};
use grafsynth_ir::net::Net;

use crate::cover::cover;
use crate::limits::Limits;
use question::Subject;
pub use question::{Functions, functions_of};
pub use run::{Interpreter, Shown, Snapshot, Stuck};

/// The proof that the C behaves like its net.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Induction {
    /// The number of functions that are equal by construction.
    pub same: usize,
    /// The number of functions that the solver proved equal.
    pub solved: usize,
    /// The number of operations that C may leave undefined and that were proved to be defined.
    pub obligations: usize,
    /// True if the text is an image with the C around it: the engine that interprets the image is not part of the proof.
    pub is_of_image: bool,
    /// The number of nodes of the graph in all questions for the solver, a measure of its work.
    work: usize,
    /// The same for the cases of single questions.
    split: usize,
}

impl Induction {
    /// Counts a check that is not equal by construction.
    fn add_solved(&mut self, check: &question::Check) {
        match check.question {
            question::Question::Obligation(..) => self.obligations += 1,
            _ => self.solved += 1,
        }
    }
}

impl std::fmt::Display for Induction {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let functions = counted(self.same + self.solved, "function", "functions");
        let Induction { same, solved, obligations, .. } = self;
        let of_image = if self.is_of_image { " of the image" } else { "" };
        write!(
            f,
            "proved by induction{of_image}: {functions}, {same} equal by construction, {solved} by the solver"
        )?;
        if *obligations > 0 {
            let dangers = counted(*obligations, "operation", "operations");
            write!(f, ", {dangers} never undefined")?;
        }
        Ok(())
    }
}

/// Proves that the C of a unit behaves like the net, for every stimulus and every `dt` that the C accepts.
///
/// # Errors
/// The reason why there is no proof. The C may still be correct.
pub fn prove(
    net: &Valid<Net>,
    facts: &Facts,
    unit: &Unit,
    hint: &Representation,
    limits: &Limits,
) -> Result<Induction, String> {
    let functions = &question::functions_of(unit);
    let further = &cover(net).further;
    let subject =
        Subject { net, facts, further, unit, functions, hint, unset: &[], is_cut: false, limits };
    let is_of_image = hint.extra.iter().any(|(_, extra)| *extra == Extra::Image);
    subject.prove().map(|proved| Induction { is_of_image, ..proved })
}
