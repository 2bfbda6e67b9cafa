//! Codes of findings about names, types and lowering: `G0200` to `G0299` but `G0250`, which is one of [programs](super::program::codes). Each has a page in `docs/codes`.

use crate::diag::Code;

macro_rules! codes {
    ($($(#[$doc:meta])* $name:ident = $id:literal, $title:literal;)*) => {
        $($(#[$doc])* pub const $name: Code = Code { id: $id, title: $title };)*
        /// All codes of this crate's lowering, in order.
        pub const ALL: &[Code] = &[$($name),*];
    };
}

codes! {
    /// Nothing of that name is visible at this place.
    UNKNOWN_NAME = "G0201", "unknown name";
    /// Two things of one body have one name.
    DUPLICATE_NAME = "G0202", "name declared twice";
    /// The name stands for something else than what is needed here.
    WRONG_KIND = "G0203", "name of the wrong kind";
    /// A macro-step lies in its own expansion.
    MACRO_RECURSION = "G0204", "recursive macro";
    /// A macro needs exactly one entry and one exit step.
    MACRO_SHAPE = "G0205", "macro without one entry and one exit step";
    /// A setting stands twice.
    SETTING_TWICE = "G0206", "duplicate setting";
    /// Two settings, or a setting and an item, exclude each other.
    SETTING_CONFLICT = "G0207", "conflicting settings";
    /// An expression has no type, or another one than is needed.
    TYPE = "G0208", "type error in an expression";
    /// A value must be known before the chart runs.
    CONSTANT_NEEDED = "G0209", "constant expected";
    /// A duration is no multiple of the tick.
    DURATION_ROUNDED = "G0210", "duration rounded up to the tick";
    /// A duration has more ticks than a timer can count.
    DURATION_TOO_LONG = "G0211", "duration too long";
    /// A time stands elsewhere than in a comparison with a constant.
    TIME_ALONE = "G0212", "time not compared with a constant";
    /// An edge or an event stands where it has no meaning.
    PULSE_PLACE = "G0213", "misplaced edge or event";
    /// `otherwise` stands elsewhere than in the receptivity of a transition that leaves a step.
    OTHERWISE_PLACE = "G0214", "misplaced `otherwise`";
    /// An output is driven in two ways.
    OUTPUT_ROLES = "G0215", "output driven in two ways";
    /// Nothing drives an output.
    OUTPUT_UNDRIVEN = "G0216", "output never driven";
    /// An output that has no memory is read.
    OUTPUT_UNREADABLE = "G0217", "unreadable output";
    /// A timed action lacks its duration, has a needless one, or two.
    ACTION_DURATION = "G0218", "invalid duration of a timed action";
    /// A call does not fit its declaration.
    CALL_ARGUMENTS = "G0219", "invalid arguments of a call";
    /// `after` needs a step whose time it can ask for.
    AFTER_SOURCE = "G0220", "`after` on a source transition";
    /// The queues of a statechart need a bound.
    QUEUE_NEEDED = "G0221", "event queue without a bound";
    /// Something stands in a chart of the other kind.
    CHART_KIND = "G0222", "feature not allowed in this kind of chart";
    /// An assignment stores a bound whatever its value.
    NEVER_FITS = "G0223", "assignment always out of range";
    /// A task costs more than its step may use.
    BUDGET = "G0224", "task above its budget";
    /// A task holds assignments and calls only.
    TASK_BODY = "G0225", "statement not allowed in a task";
    /// An initial value does not fit its declaration.
    INITIAL_VALUE = "G0226", "invalid initial value";
    /// An assumption speaks of more than inputs.
    ASSUMPTION = "G0227", "assumption about more than the inputs";
    /// Pins of a board contradict each other.
    BOARD = "G0228", "conflicting pin assignment";
    /// The expansion has more objects than the tool accepts.
    EXPANSION_SIZE = "G0229", "expansion too large";
    /// A chart without an initial step never does anything.
    NO_INITIAL_STEP = "G0230", "no initial step";
    /// A priority that the conflict policy never asks for.
    PRIORITY_UNUSED = "G0231", "priority without effect";
    /// A macro that no macro-step uses.
    UNUSED_MACRO = "G0232", "unused macro";
    /// Two sends of one name differ.
    SEND_SLOT = "G0233", "conflicting sends with one name";
    /// A forcing order that cannot be obeyed.
    FORCING = "G0234", "invalid forcing order";
    /// A step stands twice on one side of a transition.
    STEP_TWICE = "G0235", "duplicate step or event in a transition";
    /// An element of something that is no array, or an array without its index.
    ARRAY = "G0236", "invalid use of an array or index";
    /// A signal of the environment is declared inside a body.
    DECLARED_INSIDE = "G0237", "declaration not allowed in a body";
    /// A range or an array size that cannot be.
    RANGE = "G0238", "invalid range or array size";
    /// Something written has no effect here.
    NO_EFFECT = "G0239", "item without effect";
    /// Something is declared and never used.
    UNUSED = "G0240", "unused declaration";
    /// Two transitions are the same.
    DUPLICATE_TRANSITION = "G0241", "duplicate transition";
    /// No path of transitions leads to a step.
    UNREACHED_STEP = "G0242", "unreachable step";
    /// No transition leaves a step.
    NO_WAY_OUT = "G0243", "step without an exit";
    /// A condition has one value whatever happens.
    CONSTANT_CONDITION = "G0244", "constant condition";
    /// A more urgent transition of the same step always fires.
    NEVER_TAKEN = "G0245", "transition that is never taken";
    /// The time of a macro-step that is left and entered within one reaction.
    MACRO_TIME = "G0246", "time of a re-entered macro-step";
    /// What stands for a parameter of a library chart does not fit it.
    ARGUMENT = "G0247", "invalid argument of a library chart";
    /// A counted step says, or stands in, what no number can be.
    COUNTED = "G0248", "unsupported use of a counted step";
    /// An enclosed step is initial, and the step around it is not active after reset.
    INITIAL_INSIDE = "G0249", "initial step in an inactive enclosing step";
    /// A safe value does not fit its output.
    SAFE_VALUE = "G0251", "invalid safe value";
    /// Something that an emergency does not keep from happening.
    BEYOND_EMERGENCY = "G0252", "call not covered by the emergency";
    /// A design has one condition that forces all outputs.
    EMERGENCY_TWICE = "G0253", "second emergency";
    /// A step has a budget, and nothing says what one of its tasks costs.
    TASK_WITHOUT_COST = "G0254", "task without a cost";
    /// `place` and `deadline`, which wait for the partition.
    NOT_YET = "G0255", "unsupported placement or deadline";
    /// A transition leaves and enters a step, which stays active, and the step does something when it is entered or left.
    STAYS_ACTIVE = "G0256", "step that stays active";
    /// Two steps that follow each other pulse one action, which gives one pulse.
    ONE_PULSE = "G0257", "single pulse for two consecutive steps";
    /// A source transition activates a step of a chart that begins with an initial step, and nothing is left.
    SOURCE_ADDS = "G0258", "transition that leaves no step";
    /// Branches that begin together end one by one.
    NO_JOIN = "G0259", "parallel branches that are not joined";
}
