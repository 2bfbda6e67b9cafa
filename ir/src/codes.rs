//! What can be wrong with a net or its text form; each code has a page under `docs/codes`.

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
    /// The text form has something that its grammar does not allow there.
    NET_SYNTAX = "G0301", "unexpected text in a net";
    /// The text form names something that the net does not declare.
    NET_NAME = "G0302", "unknown name in a net";
    /// A number of the text form does not fit where it stands.
    NET_NUMBER = "G0303", "number out of range in a net";
    /// Too many levels of parentheses or blocks, or a text that is too long.
    NET_LIMIT = "G0304", "net too deep or too large";
    /// An id that no object has.
    DANGLING = "G0310", "dangling reference";
    /// A name that is empty, reserved by the trace, or has a character that a trace cannot show.
    BAD_NAME = "G0311", "name that a trace cannot show";
    /// Two objects of one name.
    NAME_TWICE = "G0312", "name declared twice in a net";
    /// A range without values or beyond 32 bits, an array without elements, an event that is a number.
    BAD_TYPE = "G0313", "invalid range or array size in a net";
    /// A reset value outside the type, or too many or too few of them.
    BAD_INIT = "G0314", "reset value outside the type";
    /// A number where a truth value is needed, or the other way round.
    KIND_MISMATCH = "G0315", "number mixed with a Boolean";
    /// An intermediate result beyond 64 bits.
    OVERFLOW = "G0316", "result larger than 64 bits";
    /// A divisor that can be 0.
    DIVISOR = "G0317", "possible division by 0";
    /// An index that can leave its array, a missing or a needless one.
    INDEX = "G0318", "index outside the array";
    /// A time that is not compared with a constant.
    DURATION = "G0319", "time used as a number";
    /// An edge, event or other leaf at a place where it has no meaning.
    NOT_READABLE = "G0320", "value not readable here";
    /// Settings that exclude each other.
    SETTINGS = "G0321", "conflicting settings in a net";
    /// An output that is driven in a way that its declaration excludes.
    DRIVER = "G0322", "invalid way of driving an output";
    /// Something of a statechart in a Grafcet chart, or the other way round.
    WRONG_WORLD = "G0323", "statechart mixed with Grafcet";
    /// Parents, levels or parts that contradict each other.
    HIERARCHY = "G0324", "inconsistent hierarchy";
    /// A transition whose sources, targets or events don't fit together.
    TRANSITION = "G0325", "inconsistent transition";
    /// Something listed twice.
    LISTED_TWICE = "G0326", "duplicate entry in a list";
    /// Priority, level or limit below 1.
    BELOW_ONE = "G0327", "number below 1";
    /// Tasks that don't fit their budget, or hold what a task cannot hold.
    TASK = "G0328", "invalid task";
    /// Duration or use of a controlled action.
    ACTION = "G0329", "duration without a timed qualifier";
    /// An assignment, call, raise or send that does not fit its target.
    STATEMENT = "G0330", "statement that does not match its target";
    /// Forcing orders that cannot be carried out.
    FORCING = "G0331", "invalid forcing order in a net";
    /// History of a state that records or restores something outside it.
    HISTORY = "G0332", "history outside its state";
    /// Entered states that are no complete configuration.
    CONFIGURATION = "G0333", "incomplete configuration";
    /// A chart without a beginning.
    NO_BEGINNING = "G0334", "chart that is never active";
    /// A macro-step whose entry or exit is not among its steps.
    MACRO = "G0335", "macro-step without its entry or exit step";
    /// An emergency that could not force every output at once.
    EMERGENCY = "G0336", "unenforceable emergency";
}

/// The code for an expression that has no type.
#[must_use]
pub fn of_type_error(kind: &TypeErrorKind) -> Code {
    match kind {
        TypeErrorKind::BoolExpected { .. } | TypeErrorKind::IntExpected | TypeErrorKind::Mixed => {
            KIND_MISMATCH
        }
        TypeErrorKind::Overflow64 { .. } => OVERFLOW,
        TypeErrorKind::DivisorMayBeZero { .. } => DIVISOR,
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
