//! Codes of findings about files and about what a verb can take.

use grafsynth_ir::Code;

/// A file whose format cannot be told.
pub const UNKNOWN_FORMAT: Code = Code { id: "G0001", title: "the format of a file is not known" };
/// A verb that needs a chart was given logic.
pub const NEEDS_CHART: Code = Code { id: "G0002", title: "this verb needs a chart" };
/// A target that does not exist.
pub const UNKNOWN_TARGET: Code = Code { id: "G0003", title: "no such target" };
/// What the target says reads back as something else.
pub const NOT_EQUAL: Code = Code { id: "G0004", title: "an output is not equal to the chart" };
/// The proof ran into a limit.
pub const NOT_PROVED: Code = Code { id: "G0005", title: "an output could not be proved" };
/// A stimulus that this engine cannot take.
pub const STIMULUS_NOT_FOR_CHIP: Code = Code { id: "G0006", title: "a chip cannot run this stimulus" };
/// Logic read from a text does not fit the chart it shall be compared with.
pub const LOGIC_DOES_NOT_FIT: Code = Code { id: "G0007", title: "the logic does not fit the chart" };

/// All of them.
pub const ALL: &[Code] = &[
    UNKNOWN_FORMAT,
    NEEDS_CHART,
    UNKNOWN_TARGET,
    NOT_EQUAL,
    NOT_PROVED,
    STIMULUS_NOT_FOR_CHIP,
    LOGIC_DOES_NOT_FIT,
];
