//! The diagnostic codes of this crate: `G08`, results of proofs and analyses of a chart.

use grafsynth_ir::Code;

/// A step that no stimulus activates.
pub const UNREACHABLE_STEP: Code = Code { id: "G0801", title: "step that is never active" };
/// A transition that no stimulus makes fire.
pub const DEAD_TRANSITION: Code = Code { id: "G0802", title: "transition that never fires" };
/// A situation that the chart never leaves.
pub const DEAD_END: Code = Code { id: "G0803", title: "deadlock" };
/// Two transitions that leave one step and fire in one micro-step.
pub const CONFLICT: Code = Code { id: "G0804", title: "conflicting transitions that both fire" };
/// A reaction that does not become stable.
pub const LIVELOCK: Code = Code { id: "G0805", title: "chart that does not become stable" };
/// Two lists that write the same variable in one micro-step.
pub const RACE: Code = Code { id: "G0806", title: "two writers of one variable" };
/// An event that is lost because its queue is full.
pub const QUEUE_OVERFLOW: Code = Code { id: "G0807", title: "event lost in a full queue" };
/// A branch that may wait for ever.
pub const STARVATION: Code = Code { id: "G0808", title: "starving branch" };
/// Assumptions that no input satisfies.
pub const ASSUMPTION_EMPTY: Code = Code { id: "G0809", title: "unsatisfiable assumptions" };
/// An assignment of a value outside the range of its variable.
pub const SATURATION: Code = Code { id: "G0810", title: "value outside the range of its variable" };
/// Two forcing orders that contradict each other.
pub const FORCING_RACE: Code = Code { id: "G0811", title: "forcing orders that can conflict" };
/// A variable that others access while the tasks of a step are partly done.
pub const SHARED: Code = Code { id: "G0812", title: "variable shared with a halted step" };
/// Conflicts between transitions that the conflict policy resolves.
pub const DECIDED_CONFLICT: Code = Code { id: "G0813", title: "conflict resolved by the policy" };

/// All codes of this crate, in order.
pub const ALL: &[Code] = &[
    UNREACHABLE_STEP,
    DEAD_TRANSITION,
    DEAD_END,
    CONFLICT,
    LIVELOCK,
    RACE,
    QUEUE_OVERFLOW,
    STARVATION,
    ASSUMPTION_EMPTY,
    SATURATION,
    FORCING_RACE,
    SHARED,
    DECIDED_CONFLICT,
];
