//! Codes for findings in a net or its text form; each code has a page under `docs/codes`.

use crate::diag::Code;
use crate::interval::TypeErrorKind;

macro_rules! codes {
    ($($(#[$doc:meta])* $name:ident = $id:literal, $title:literal;)*) => {
        $($(#[$doc])* pub const $name: Code = Code { id: $id, title: $title };)*
        /// All codes of this module, in order.
        pub const ALL: &[Code] = &[$($name),*];
    };
}

codes! {
    /// The text form contains something that its grammar does not allow.
    NET_SYNTAX = "G0301", "unexpected text in a net";
    /// The text form refers to a name that the net does not declare.
    NET_NAME = "G0302", "unknown name in a net";
    /// A number of the text form is out of range.
    NET_NUMBER = "G0303", "number out of range in a net";
    /// Parentheses or blocks are nested too deeply, or the text is too long.
    NET_LIMIT = "G0304", "net too deep or too large";
    /// An id refers to an object that does not exist.
    DANGLING = "G0310", "dangling reference";
    /// A name is empty, reserved by the trace, or contains a character that a trace cannot show.
    BAD_NAME = "G0311", "name that a trace cannot show";
    /// Two objects have the same name.
    NAME_TWICE = "G0312", "name declared twice in a net";
    /// A range is empty or exceeds 32 bits, an array has no elements, or an event is a number.
    BAD_TYPE = "G0313", "invalid range or array size in a net";
    /// A reset value is outside the type, or the number of reset values is wrong.
    BAD_INIT = "G0314", "reset value outside the type";
    /// A number is used as a Boolean, or a Boolean as a number.
    KIND_MISMATCH = "G0315", "number mixed with a Boolean";
    /// An intermediate result exceeds 64 bits.
    OVERFLOW = "G0316", "result larger than 64 bits";
    /// A divisor can be 0.
    DIVISOR = "G0317", "possible division by 0";
    /// An index can be outside its array, is missing, or is not needed.
    INDEX = "G0318", "index outside the array";
    /// A time is used other than in a comparison with a constant.
    DURATION = "G0319", "time used as a number";
    /// An edge, event or other leaf is read where it has no meaning.
    NOT_READABLE = "G0320", "value not readable here";
    /// Settings contradict each other.
    SETTINGS = "G0321", "conflicting settings in a net";
    /// An output is driven in a way that its declaration does not allow.
    DRIVER = "G0322", "invalid way of driving an output";
    /// A Grafcet chart contains a statechart feature, or a statechart contains a Grafcet feature.
    WRONG_WORLD = "G0323", "statechart mixed with Grafcet";
    /// Parents, levels or parts contradict each other.
    HIERARCHY = "G0324", "inconsistent hierarchy";
    /// The sources, targets or events of a transition do not fit together.
    TRANSITION = "G0325", "inconsistent transition";
    /// Something is listed twice.
    LISTED_TWICE = "G0326", "duplicate entry in a list";
    /// A priority, level or limit is below 1.
    BELOW_ONE = "G0327", "number below 1";
    /// A task costs more than the budget of its step, or contains a statement that tasks do not allow.
    TASK = "G0328", "invalid task";
    /// The duration or a use of a controlled action is invalid.
    ACTION = "G0329", "duration without a timed qualifier";
    /// An assignment, call, raise or send does not match its target.
    STATEMENT = "G0330", "statement that does not match its target";
    /// A forcing order cannot be carried out.
    FORCING = "G0331", "invalid forcing order in a net";
    /// A history records or restores something outside its state.
    HISTORY = "G0332", "history outside its state";
    /// The entered states are not a complete configuration.
    CONFIGURATION = "G0333", "incomplete configuration";
    /// A chart never becomes active.
    NO_BEGINNING = "G0334", "chart that is never active";
    /// The entry or exit of a macro-step is not one of its steps.
    MACRO = "G0335", "macro-step without its entry or exit step";
    /// An emergency cannot force every output at once.
    EMERGENCY = "G0336", "unenforceable emergency";
    /// The amount of a shift can be below 0 or above 63.
    SHIFT = "G0337", "shift by an amount out of range";
}

/// The code for this kind of type error.
#[must_use]
pub fn of_type_error(kind: &TypeErrorKind) -> Code {
    match kind {
        TypeErrorKind::BoolExpected { .. } | TypeErrorKind::IntExpected | TypeErrorKind::Mixed => {
            KIND_MISMATCH
        }
        TypeErrorKind::Overflow64 { .. } => OVERFLOW,
        TypeErrorKind::DivisorMayBeZero { .. } => DIVISOR,
        TypeErrorKind::ShiftOutOfRange { .. } => SHIFT,
        TypeErrorKind::IndexOutOfArray { .. }
        | TypeErrorKind::ArrayWithoutIndex
        | TypeErrorKind::NotAnArray => INDEX,
        TypeErrorKind::DurationAlone
        | TypeErrorKind::DurationNegative { .. }
        | TypeErrorKind::DurationTooLong { .. } => DURATION,
        TypeErrorKind::Dangling => DANGLING,
        TypeErrorKind::NotReadableHere { .. } => NOT_READABLE,
        TypeErrorKind::TooDeep => NET_LIMIT,
    }
}
