//! Diagnostics of the C back end.

use grafsynth_ir::Code;

/// The style that was asked for can't carry the chart.
pub const STYLE_REFUSED: Code = Code { id: "G0601", title: "the C style cannot carry this chart" };
/// Text for a language that is not C.
pub const FOREIGN_CODE: Code =
    Code { id: "G0602", title: "code for another language is left out of the C text" };
/// A function of the user's library can't be called what the chart calls it.
pub const RENAMED: Code =
    Code { id: "G0603", title: "a function of the C library has another name than in the chart" };
/// The compiled chart needs more memory than the machine has that is to run it.
pub const TOO_LARGE: Code =
    Code { id: "G0604", title: "the chart does not fit into a microcontroller" };
/// The gate can't stand in front of a chart that calls functions.
pub const GATE_REFUSED: Code =
    Code { id: "G0605", title: "the quiescence gate cannot stand in front of this chart" };
/// The table engine lacks what the chart uses.
pub const ENGINE_REFUSED: Code =
    Code { id: "G0606", title: "the table engine cannot carry this chart" };
/// What stands against a trace ring.
pub const TRACE_REFUSED: Code =
    Code { id: "G0607", title: "the trace ring cannot stand in this instance" };
/// A package of a chart whose names are those of its ecosystem.
pub const PACKAGE_REFUSED: Code =
    Code { id: "G0610", title: "a name of the chart hides one of the package's ecosystem" };
/// The layout of seed 002 lacks columns for what the chart uses.
pub const BTRANS_REFUSED: Code =
    Code { id: "G0620", title: "the tables of states and transitions cannot carry this chart" };
/// A shape whose state variables have no ranges of their own.
pub const SAFE_STATE_REFUSED: Code =
    Code { id: "G0630", title: "the safe state cannot watch this shape of C" };
/// What a task does can't be counted.
pub const TASK_NOT_COUNTED: Code =
    Code { id: "G0635", title: "the cost of a task cannot be counted" };
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
