//! The findings about tables of two-level logic (`G0750` to `G0756`).

use grafsynth_ir::Code;

/// The text does not follow the format.
pub const SYNTAX: Code = Code { id: "G0750", title: "syntax error in a table" };
/// An unknown directive.
pub const UNKNOWN_DIRECTIVE: Code = Code { id: "G0751", title: "unknown directive in a table" };
/// Many-valued or symbolic tables, and state tables.
pub const UNSUPPORTED: Code = Code { id: "G0752", title: "table beyond two-level binary logic" };
/// For the same input values, an output is both on and off.
pub const CONTRADICTION: Code =
    Code { id: "G0753", title: "point in both the on-set and the off-set" };
/// For the same input values, an output is both on and a don't-care.
pub const OVERLAP: Code =
    Code { id: "G0754", title: "point in both the on-set and the don't-care set" };
/// A count or a list of names contradicts the rows.
pub const MISCOUNTED: Code = Code { id: "G0755", title: "inconsistent counts or names of a table" };
/// The functions are too large.
pub const TOO_LARGE: Code = Code { id: "G0756", title: "table too large to minimise" };

/// All codes.
pub const ALL: &[Code] =
    &[SYNTAX, UNKNOWN_DIRECTIVE, UNSUPPORTED, CONTRADICTION, OVERLAP, MISCOUNTED, TOO_LARGE];
