//! Codes of findings about files and about the inputs of verbs.

pub use grafsynth_backend_pld::codes::UNKNOWN_DEVICE;
use grafsynth_ir::Code;

/// The format of a file is unknown.
pub const UNKNOWN_FORMAT: Code = Code { id: "G0001", title: "unknown file format" };
/// A conversion that needs a chart was given logic.
pub const NEEDS_CHART: Code = Code { id: "G0002", title: "logic instead of a chart" };
/// Two designs that cannot be compared with each other.
pub const LOGIC_DOES_NOT_FIT: Code = Code { id: "G0003", title: "designs that cannot be compared" };
/// A conversion to C, which consists of more than one text.
pub const WRITES_C: Code = Code { id: "G0004", title: "C code requested from `convert`" };
/// A file with library charts that cannot be used.
pub const LIBRARY_FILE: Code = Code { id: "G0010", title: "unusable library file" };
/// A certificate that does not apply to the library chart as it is now.
pub const CERTIFICATE: Code = Code { id: "G0011", title: "invalid certificate of a library chart" };
/// A stimulus for which the outputs of a circuit cannot be predicted row by row.
pub const NO_BENCH: Code = Code { id: "G0019", title: "no test bench for this circuit" };
/// A chart that has numbers or calls, or is too large for a state table.
pub const NO_TABLE: Code = Code { id: "G0012", title: "no state table for this chart" };
/// Two outputs of one build have the same name.
pub const SAME_OUTPUT: Code = Code { id: "G0013", title: "two output files with the same name" };
/// One clock per micro-step was requested for a chart that does not support it.
pub const ONE_CLOCK: Code = Code { id: "G0014", title: "one clock per micro-step not possible" };
/// Files of the same chart that an older build wrote and this build does not overwrite.
pub const OLDER_SOURCE: Code = Code { id: "G0015", title: "outdated output file" };
/// C code of the chart's author, which proofs do not cover and which is not run without permission.
pub const OWN_C: Code = Code { id: "G0016", title: "C code in the chart" };
/// The objects of a chart cannot be placed on the parts of a split.
pub const NO_PARTITION: Code = Code { id: "G0017", title: "no partition" };
/// All codes of this crate.
pub const ALL: &[Code] = &[
    UNKNOWN_FORMAT,
    NEEDS_CHART,
    LOGIC_DOES_NOT_FIT,
    WRITES_C,
    LIBRARY_FILE,
    CERTIFICATE,
    NO_BENCH,
    NO_TABLE,
    SAME_OUTPUT,
    ONE_CLOCK,
    OLDER_SOURCE,
    OWN_C,
    NO_PARTITION,
];
