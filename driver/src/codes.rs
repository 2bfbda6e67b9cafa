//! Codes of findings about files and about what a verb can take.

pub use grafsynth_backend_pld::codes::UNKNOWN_DEVICE;
use grafsynth_ir::Code;

/// A file whose format cannot be told.
pub const UNKNOWN_FORMAT: Code = Code { id: "G0001", title: "unknown file format" };
/// A conversion that needs a chart was given logic.
pub const NEEDS_CHART: Code = Code { id: "G0002", title: "logic instead of a chart" };
/// Logic read from a text does not fit the chart it shall be compared with.
pub const LOGIC_DOES_NOT_FIT: Code = Code { id: "G0003", title: "designs that cannot be compared" };
/// A conversion to C, which is more than one text.
pub const WRITES_C: Code = Code { id: "G0004", title: "C code requested from `convert`" };
/// A file with library charts that cannot be used.
pub const LIBRARY_FILE: Code = Code { id: "G0010", title: "unusable library file" };
/// A certificate that does not stand for the library chart as it is.
pub const CERTIFICATE: Code = Code { id: "G0011", title: "invalid certificate of a library chart" };
/// A stimulus whose answers cannot be told row by row.
pub const NO_BENCH: Code = Code { id: "G0019", title: "no test bench for this circuit" };
/// A chart that is no finite table of bits.
pub const NO_TABLE: Code = Code { id: "G0012", title: "no state table for this chart" };
/// Two outputs of one build with one name.
pub const SAME_OUTPUT: Code = Code { id: "G0013", title: "two output files with the same name" };
/// A chart that cannot have a clock for each micro-step was to have one.
pub const ONE_CLOCK: Code = Code { id: "G0014", title: "one clock per micro-step not possible" };
/// Files of the same chart that a build leaves as an older build wrote them.
pub const OLDER_SOURCE: Code = Code { id: "G0015", title: "outdated output file" };
/// C that the author of a chart wrote, which proofs do not see and which is not run unasked.
pub const OWN_C: Code = Code { id: "G0016", title: "C code in the chart" };
/// All of them.
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
];
