//! The diagnostic codes of this crate: `G05`, stimuli, traces and findings of a simulation.

use grafsynth_ir::Code;

/// A column of a stimulus that the chart does not have.
pub const UNKNOWN_COLUMN: Code = Code { id: "G0501", title: "unknown column in a stimulus" };
/// Two columns with the same name.
pub const DOUBLE_COLUMN: Code = Code { id: "G0502", title: "duplicate column" };
/// A cell whose value is not of the column's type.
pub const BAD_VALUE: Code = Code { id: "G0503", title: "cell value outside its type" };
/// A row that is longer or shorter than the header.
pub const CELL_COUNT: Code = Code { id: "G0504", title: "row with too many or too few cells" };
/// A `dt` that is not a number of ticks.
pub const BAD_DT: Code = Code { id: "G0505", title: "invalid dt" };
/// Two events in one row although the chart excludes this.
pub const EXCLUSIVE_EVENTS: Code = Code { id: "G0506", title: "two events in one row" };
/// A stimulus without a header.
pub const NO_HEADER: Code = Code { id: "G0507", title: "stimulus without a header" };
/// A column for an event that only the chart raises.
pub const INTERNAL_EVENT: Code = Code { id: "G0508", title: "stimulus for an internal event" };
/// A row that violates an assumption of the chart.
pub const ASSUMPTION_BROKEN: Code =
    Code { id: "G0509", title: "stimulus that violates an assumption" };
/// A stimulus with more ticks than the limit of clocks for a chip.
pub const DT_ON_CHIP: Code = Code { id: "G0510", title: "stimulus too long for a chip" };
/// A trace that is not one of this chart.
pub const TRACE_HEADER: Code = Code { id: "G0511", title: "trace of another chart" };
/// A cell of a trace that cannot be read.
pub const TRACE_CELL: Code = Code { id: "G0512", title: "invalid cell in a trace" };
/// A saved state that cannot be read.
pub const BAD_STATE: Code = Code { id: "G0513", title: "incompatible saved state" };
/// Inputs in the row of the reset.
pub const RESET_ROW: Code = Code { id: "G0514", title: "inputs in the reset row" };
/// A short name of a column that could be one of several.
pub const AMBIGUOUS_COLUMN: Code = Code { id: "G0515", title: "ambiguous column" };
/// A line of a session that is not a command.
pub const SESSION_COMMAND: Code = Code { id: "G0516", title: "invalid command in a session" };
/// A stimulus that parts that run on their own cannot get event by event.
pub const NO_EVENTS: Code =
    Code { id: "G0517", title: "stimulus that is no sequence of single events" };
/// An assignment whose value was out of range, so that the nearest bound was stored.
pub const SATURATED: Code = Code { id: "G0520", title: "saturated assignment" };
/// Two lists that wrote the same variable in one micro-step.
pub const RACE: Code = Code { id: "G0521", title: "two writers in one micro-step" };
/// A send slot that was started again while it was running.
pub const RESENT: Code = Code { id: "G0522", title: "send restarted before it expired" };
/// An event that was lost because its queue was full.
pub const QUEUE_FULL: Code = Code { id: "G0523", title: "event queue full" };
/// A reaction that did not become stable.
pub const LIMIT_REACHED: Code = Code { id: "G0524", title: "micro-step limit reached" };
/// Two forcing orders for one chart that contradict each other.
pub const FORCING_RACE: Code = Code { id: "G0525", title: "conflicting forcing orders" };

/// All codes of this crate, in order.
pub const ALL: &[Code] = &[
    UNKNOWN_COLUMN,
    DOUBLE_COLUMN,
    BAD_VALUE,
    CELL_COUNT,
    BAD_DT,
    EXCLUSIVE_EVENTS,
    NO_HEADER,
    INTERNAL_EVENT,
    ASSUMPTION_BROKEN,
    DT_ON_CHIP,
    TRACE_HEADER,
    TRACE_CELL,
    BAD_STATE,
    RESET_ROW,
    AMBIGUOUS_COLUMN,
    SESSION_COMMAND,
    NO_EVENTS,
    SATURATED,
    RACE,
    RESENT,
    QUEUE_FULL,
    LIMIT_REACHED,
    FORCING_RACE,
];
