//! Diagnostics of the C back end.

use grafsynth_ir::Code;

/// The requested style cannot express the chart.
pub const STYLE_REFUSED: Code = Code { id: "G0601", title: "chart not supported by the C style" };
/// Text for a language that is not C.
pub const FOREIGN_CODE: Code =
    Code { id: "G0602", title: "foreign code omitted from the C output" };
/// A function of the user's library needs another name in C than in the chart.
pub const RENAMED: Code = Code { id: "G0603", title: "renamed C function" };
/// The compiled chart needs more memory than the target machine has.
pub const TOO_LARGE: Code = Code { id: "G0604", title: "chart too large for the microcontroller" };
/// The gate (`--gate`) cannot be used with a chart that calls functions or contains C text.
pub const GATE_REFUSED: Code = Code { id: "G0605", title: "chart not supported by `--gate`" };
/// The table engine does not support something that the chart uses.
pub const ENGINE_REFUSED: Code =
    Code { id: "G0606", title: "chart not supported by the table engine" };
/// The chart cannot have a trace ring.
pub const TRACE_REFUSED: Code = Code { id: "G0607", title: "unsupported trace ring" };
/// Names of the chart clash with names of the package's ecosystem.
pub const PACKAGE_REFUSED: Code =
    Code { id: "G0610", title: "name that clashes with the package's ecosystem" };
/// The table layout has no columns for something that the chart uses.
pub const BTRANS_REFUSED: Code =
    Code { id: "G0620", title: "chart not supported by the state and transition tables" };
/// The state variables of this style have no value ranges that can be checked.
pub const SAFE_STATE_REFUSED: Code =
    Code { id: "G0630", title: "C target without safe-state checks" };
/// The cost of a task cannot be determined.
pub const TASK_NOT_COUNTED: Code =
    Code { id: "G0635", title: "task whose cost cannot be determined" };
/// All codes of this crate.
pub const ALL: &[Code] = &[
    STYLE_REFUSED,
    FOREIGN_CODE,
    RENAMED,
    TOO_LARGE,
    GATE_REFUSED,
    ENGINE_REFUSED,
    TRACE_REFUSED,
    PACKAGE_REFUSED,
    BTRANS_REFUSED,
    SAFE_STATE_REFUSED,
    TASK_NOT_COUNTED,
];
