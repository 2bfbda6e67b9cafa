//! The diagnostic codes of the C parser: `G0640` to `G0644`.

use grafsynth_ir::Code;

/// The text is not C, or outside the supported subset.
pub const SYNTAX: Code = Code { id: "G0640", title: "C that cannot be read" };
/// The preprocessor cannot continue.
pub const PREPROCESSOR: Code = Code { id: "G0641", title: "preprocessing error in C" };
/// A name is unknown, or a type does not fit.
pub const TYPE: Code = Code { id: "G0642", title: "name or type error in C" };
/// The meaning of an expression depends on the order of evaluation.
pub const ORDER: Code = Code { id: "G0643", title: "C that depends on the order of evaluation" };
/// The text is nested too deeply or expands to too much.
pub const LIMIT: Code = Code { id: "G0644", title: "C beyond a limit of the parser" };
/// All codes of this crate.
pub const ALL: &[Code] = &[SYNTAX, PREPROCESSOR, TYPE, ORDER, LIMIT];
