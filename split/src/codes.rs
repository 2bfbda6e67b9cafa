//! The codes of the findings of a split.

use grafsynth_ir::Code;

/// The chart has a feature that a split does not support.
pub const UNSUPPORTED: Code = Code { id: "G1001", title: "chart that cannot be split" };
/// Two objects that must be on the same part are placed on different parts.
pub const APART: Code = Code { id: "G1002", title: "objects that cannot be separated" };
/// A transition does not meet its deadline, or it is open whether it does.
pub const DEADLINE: Code = Code { id: "G1003", title: "missed deadline" };
/// The part on the CPU needs more flash or RAM than the CPU has.
pub const MEMORY: Code = Code { id: "G1004", title: "too little memory on the CPU" };

/// The request for a link does not match the parts, the chips or the CPU.
pub const LINK: Code = Code { id: "G1010", title: "link that cannot be wired" };
/// The CPU has fewer pins than the link needs.
pub const PINS: Code = Code { id: "G1011", title: "too few pins on the CPU" };

/// All codes of this crate.
pub const ALL: &[Code] = &[UNSUPPORTED, APART, DEADLINE, MEMORY, LINK, PINS];
