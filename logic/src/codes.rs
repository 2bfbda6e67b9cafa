//! The findings of this crate (`G070x`); the equation languages go on from `G0710`.

use grafsynth_ir::Code;

/// A chip cannot run text of another language.
pub const VERBATIM: Code = Code { id: "G0701", title: "verbatim code on a chip" };
/// A strobe pin carries no arguments.
pub const CALL_ARGUMENTS: Code = Code { id: "G0702", title: "call with arguments on a chip" };
/// A strobe pin cannot pulse twice in one clock.
pub const CALLED_TWICE: Code = Code { id: "G0703", title: "two calls in one reaction on a chip" };
/// The circuit grows beyond the limit.
pub const TOO_LARGE: Code = Code { id: "G0704", title: "circuit too large" };

/// All of them.
pub const ALL: &[Code] = &[VERBATIM, CALL_ARGUMENTS, CALLED_TWICE, TOO_LARGE];
