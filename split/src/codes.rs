//! The codes of the findings of a split.

use grafsynth_ir::Code;

/// The chart has a feature that a split does not support.
pub const UNSUPPORTED: Code = Code { id: "G1001", title: "chart that cannot be split" };
/// Two objects that must lie on one part are placed on different parts.
pub const APART: Code = Code { id: "G1002", title: "objects that cannot be separated" };

/// All codes of this crate.
pub const ALL: &[Code] = &[UNSUPPORTED, APART];
