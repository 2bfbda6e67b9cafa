//! Diagnostics of the C back end.

use grafsynth_ir::Code;

/// The style that was asked for can't carry the chart.
pub const STYLE_REFUSED: Code = Code { id: "G0601", title: "chart not supported by the C style" };
/// Text for a language that is not C.
pub const FOREIGN_CODE: Code =
    Code { id: "G0602", title: "foreign code omitted from the C output" };
/// A function of the user's library can't be called what the chart calls it.
pub const RENAMED: Code = Code { id: "G0603", title: "renamed C function" };
/// The compiled chart needs more memory than the machine has that is to run it.
pub const TOO_LARGE: Code = Code { id: "G0604", title: "chart too large for the microcontroller" };
/// The gate can't stand in front of a chart that calls functions.
pub const GATE_REFUSED: Code =
    Code { id: "G0605", title: "chart not supported by the quiescence gate" };
/// The table engine lacks what the chart uses.
pub const ENGINE_REFUSED: Code =
    Code { id: "G0606", title: "chart not supported by the table engine" };
/// What stands against a trace ring.
pub const TRACE_REFUSED: Code = Code { id: "G0607", title: "unsupported trace ring" };
/// A package of a chart whose names are those of its ecosystem.
pub const PACKAGE_REFUSED: Code =
    Code { id: "G0610", title: "name that clashes with the package's ecosystem" };
/// The layout of seed 002 lacks columns for what the chart uses.
pub const BTRANS_REFUSED: Code =
    Code { id: "G0620", title: "chart not supported by the state and transition tables" };
/// A shape whose state variables have no ranges of their own.
pub const SAFE_STATE_REFUSED: Code =
    Code { id: "G0630", title: "C target without safe-state checks" };
/// What a task does can't be counted.
pub const TASK_NOT_COUNTED: Code =
    Code { id: "G0635", title: "task whose cost cannot be determined" };
/// All of them.
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
