//! The codes of this crate (`G0700` to `G0709`); the equation languages use `G0710` and above.

use grafsynth_ir::Code;

/// A chip cannot run target-language text.
pub const VERBATIM: Code = Code { id: "G0701", title: "verbatim code on a chip" };
/// A strobe pin cannot carry arguments.
pub const CALL_ARGUMENTS: Code = Code { id: "G0702", title: "call with arguments on a chip" };
/// A strobe pin cannot pulse twice in one clock period.
pub const CALLED_TWICE: Code = Code { id: "G0703", title: "two calls in one reaction on a chip" };
/// The circuit exceeds the limit.
pub const TOO_LARGE: Code = Code { id: "G0704", title: "circuit too large" };

/// All codes of this module.
pub const ALL: &[Code] = &[VERBATIM, CALL_ARGUMENTS, CALLED_TWICE, TOO_LARGE];
