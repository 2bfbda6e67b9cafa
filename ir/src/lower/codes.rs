//! Codes of findings about names, types and lowering: `G0200` to `G0299`, except `G0250`, which belongs to [programs](super::program::codes). Each has a
//! page in `docs/codes`.

use crate::diag::Code;

macro_rules! codes {
    ($($(#[$doc:meta])* $name:ident = $id:literal, $title:literal;)*) => {
        $($(#[$doc])* pub const $name: Code = Code { id: $id, title: $title };)*
        /// All codes of this crate's lowering, in order.
        pub const ALL: &[Code] = &[$($name),*];
    };
}

codes! {
    /// The name is not visible here.
    UNKNOWN_NAME = "G0201", "unknown name";
    /// Two items of one body have the same name.
    DUPLICATE_NAME = "G0202", "name declared twice";
    /// The name refers to an item of the wrong kind.
    WRONG_KIND = "G0203", "name of the wrong kind";
    /// The expansion of a macro-step contains the macro-step itself.
    MACRO_RECURSION = "G0204", "recursive macro";
    /// A macro does not have exactly one entry step and one exit step.
    MACRO_SHAPE = "G0205", "macro without one entry and one exit step";
    /// A setting is written twice.
    SETTING_TWICE = "G0206", "duplicate setting";
    /// Two settings, or a setting and an item, contradict each other.
    SETTING_CONFLICT = "G0207", "conflicting settings";
    /// An expression has no type or the wrong type.
    TYPE = "G0208", "type error in an expression";
    /// A value must be a constant.
    CONSTANT_NEEDED = "G0209", "constant expected";
    /// A duration is not a multiple of the tick.
    DURATION_ROUNDED = "G0210", "duration rounded up to the tick";
    /// A duration exceeds the range of a timer.
    DURATION_TOO_LONG = "G0211", "duration too long";
    /// A time is used other than in a comparison with a constant.
    TIME_ALONE = "G0212", "time not compared with a constant";
    /// An edge or an event is used where it has no meaning.
    PULSE_PLACE = "G0213", "misplaced edge or event";
    /// `otherwise` is used outside the receptivity of a transition that leaves a step.
    OTHERWISE_PLACE = "G0214", "misplaced `otherwise`";
    /// An output is driven in two ways.
    OUTPUT_ROLES = "G0215", "output driven in two ways";
    /// Nothing drives an output.
    OUTPUT_UNDRIVEN = "G0216", "output never driven";
    /// An output without memory is read.
    OUTPUT_UNREADABLE = "G0217", "unreadable output";
    /// A timed action has no duration, an unnecessary duration, or two durations.
    ACTION_DURATION = "G0218", "invalid duration of a timed action";
    /// The arguments of a call do not match its declaration.
    CALL_ARGUMENTS = "G0219", "invalid arguments of a call";
    /// `after` needs a source step whose time it can measure.
    AFTER_SOURCE = "G0220", "`after` on a source transition";
    /// The queues of a statechart need a bound.
    QUEUE_NEEDED = "G0221", "event queue without a bound";
    /// An item is not allowed in this kind of chart.
    CHART_KIND = "G0222", "feature not allowed in this kind of chart";
    /// An assignment always stores a bound, because its value is always out of range.
    NEVER_FITS = "G0223", "assignment always out of range";
    /// The cost of a task exceeds the budget of its step.
    BUDGET = "G0224", "task above its budget";
    /// A task may contain only assignments and calls.
    TASK_BODY = "G0225", "statement not allowed in a task";
    /// An initial value does not fit its declaration.
    INITIAL_VALUE = "G0226", "invalid initial value";
    /// An assumption reads values that are not inputs.
    ASSUMPTION = "G0227", "assumption about more than the inputs";
    /// Pin assignments of a board contradict each other.
    BOARD = "G0228", "conflicting pin assignment";
    /// The expansion has more objects than the tool accepts.
    EXPANSION_SIZE = "G0229", "expansion too large";
    /// A chart without an initial step never does anything.
    NO_INITIAL_STEP = "G0230", "no initial step";
    /// The conflict policy does not use a priority.
    PRIORITY_UNUSED = "G0231", "priority without effect";
    /// A macro that no macro-step uses.
    UNUSED_MACRO = "G0232", "unused macro";
    /// Two sends with the same name differ.
    SEND_SLOT = "G0233", "conflicting sends with one name";
    /// A forcing order cannot be carried out.
    FORCING = "G0234", "invalid forcing order";
    /// A step or event is listed twice in a transition.
    STEP_TWICE = "G0235", "duplicate step or event in a transition";
    /// Something that is not an array has an index, or an array has none.
    ARRAY = "G0236", "invalid use of an array or index";
    /// A signal of the environment is declared inside a body.
    DECLARED_INSIDE = "G0237", "declaration not allowed in a body";
    /// A range or an array size is invalid.
    RANGE = "G0238", "invalid range or array size";
    /// An item has no effect here.
    NO_EFFECT = "G0239", "item without effect";
    /// An item is declared but never used.
    UNUSED = "G0240", "unused declaration";
    /// Two transitions are the same.
    DUPLICATE_TRANSITION = "G0241", "duplicate transition";
    /// No path of transitions leads to the step.
    UNREACHED_STEP = "G0242", "unreachable step";
    /// No transition leaves the step.
    NO_WAY_OUT = "G0243", "step without an exit";
    /// A condition is constant.
    CONSTANT_CONDITION = "G0244", "constant condition";
    /// A more urgent transition of the same step always fires first.
    NEVER_TAKEN = "G0245", "transition that is never taken";
    /// The time of a macro-step is read, and the macro-step can be left and entered again within one reaction.
    MACRO_TIME = "G0246", "time of a re-entered macro-step";
    /// An argument does not match the parameter of a library chart.
    ARGUMENT = "G0247", "invalid argument of a library chart";
    /// A counted step is used in a way that its number does not support.
    COUNTED = "G0248", "unsupported use of a counted step";
    /// An enclosed step is initial, but its enclosing step is not active after reset.
    INITIAL_INSIDE = "G0249", "initial step in an inactive enclosing step";
    /// A safe value does not fit its output.
    SAFE_VALUE = "G0251", "invalid safe value";
    /// An emergency does not prevent this call.
    BEYOND_EMERGENCY = "G0252", "call not covered by the emergency";
    /// A design may have only one emergency condition.
    EMERGENCY_TWICE = "G0253", "second emergency";
    /// A step has a budget, but the cost of one of its tasks is not given.
    TASK_WITHOUT_COST = "G0254", "task without a cost";
    /// `deadline` has an effect only in a split.
    DEADLINE = "G0255", "deadline outside a split";
    /// A transition leaves and enters the same step, which stays active, although the step has an effect on entry or exit.
    STAYS_ACTIVE = "G0256", "step that stays active";
    /// Two consecutive steps pulse the same action, which gives only one pulse.
    ONE_PULSE = "G0257", "single pulse for two consecutive steps";
    /// A source transition activates a step of a chart that has an initial step, and no step is deactivated.
    SOURCE_ADDS = "G0258", "transition that leaves no step";
    /// Parallel branches start together but end separately.
    NO_JOIN = "G0259", "parallel branches that are not joined";
}
