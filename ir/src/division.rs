//! A net that is divided into parts: one for each chip, and the last one for the CPU (semantics §10).
//!
//! Each part is a net of its own, which back ends, engines and proofs accept like any other net. This module is only data: `grafsynth-split` creates it, and
//! `grafsynth-verify` proves that the parts, joined by their wires, equal the net.

use crate::arena::IdMap;
use crate::diag::Diagnostic;
use crate::net::{
    ActionId, ControlledAction, Driver, EdgeId, EdgeOperand, Ending, Evolution, Expr, Input,
    InputId, InputKind, Leaf, Net, Output, OutputId, PropertyLeaf, PropertyRole, Step, StepId,
    Timer, TimerId, Transition, TransitionId, Var, VarId,
};
use crate::validate::{Valid, validate};

/// The index of a part in [`Division::parts`].
pub type PartIndex = usize;

/// The part that owns each object of the net.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Owners {
    /// The owner of a step runs its lists and tasks; other parts may have copies of the step's bit and timer.
    pub steps: IdMap<Step, PartIndex>,
    /// The owner of a transition decides whether it fires, and runs its actions.
    pub transitions: IdMap<Transition, PartIndex>,
    /// The owner of a variable is the only part that reads or writes it.
    pub vars: IdMap<Var, PartIndex>,
    /// The owner of a controlled action has its latches and runs its body.
    pub actions: IdMap<ControlledAction, PartIndex>,
    /// The owner of an output drives it.
    pub outputs: IdMap<Output, PartIndex>,
}

/// How the parts run together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub enum Running {
    /// The CPU clocks the chips, and all parts make their reactions in common rounds (§10.3).
    #[default]
    Lockstep,
    /// Each part reacts on its own, the chips with clocks of their own (§10.7).
    Free,
}

impl Running {
    /// Both of them.
    pub const ALL: [Running; 2] = [Running::Lockstep, Running::Free];

    /// The name on the command line and in partition files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Running::Lockstep => "lockstep",
            Running::Free => "free-running",
        }
    }

    /// The way with this name.
    #[must_use]
    pub fn named(name: &str) -> Option<Running> {
        Running::ALL.into_iter().find(|one| one.name() == name)
    }
}

/// A net that is divided into parts.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Division {
    /// How the parts run together.
    pub running: Running,
    /// The parts, in the order in which they decide: chips first, the CPU last.
    pub parts: Vec<PartNet>,
    /// The part that owns each object.
    pub owners: Owners,
    /// The wires between parts, in the order of what they show.
    pub wires: Vec<Wire>,
}

/// What a wire shows in a round.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Signal {
    /// Whether a transition of the net fires.
    Fires(TransitionId),
    /// Whether a step is active at the end of the last reaction of its part: a state of a statechart (§10.8), or a step of a part that runs on its own (§10.7).
    Active(StepId),
}

impl Signal {
    /// The signal in words: "transition `t1` fires", "step `s1` is active".
    #[must_use]
    pub fn describe(self, net: &Net) -> String {
        match self {
            Signal::Fires(id) => format!("transition `{}` fires", net.transitions[id].name),
            Signal::Active(id) => {
                let kind = if net.settings.policy.is_statechart() { "state" } else { "step" };
                format!("{kind} `{}` is active", net.steps[id].name)
            }
        }
    }
}

/// A wire between parts: it shows a signal in each round.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Wire {
    /// What it shows, in the net.
    pub signal: Signal,
    /// The name of the wire: that of the output of its owner and of the input of each reader.
    pub name: String,
    /// The part that drives the wire.
    pub from: PartIndex,
    /// The output of that part.
    pub output: OutputId,
    /// The parts that read the wire, each with its input; at least one, in order.
    pub to: Vec<(PartIndex, InputId)>,
}

/// One part: its net, and for each of its objects the original in the whole net.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PartNet {
    /// The name of the part, as in `--part NAME=DEVICE`.
    pub name: String,
    /// The net of the part.
    pub net: Valid<Net>,
    /// The original of each step. On a chip beside a statechart, the only step is always active and stands for the first state.
    pub steps: IdMap<Step, Original>,
    /// The original of each transition, which may be an image that repeats its effect.
    pub transitions: IdMap<Transition, TransitionId>,
    /// The original of each variable.
    pub vars: IdMap<Var, VarId>,
    /// The original of each timer, which may be a copy.
    pub timers: IdMap<Timer, TimerId>,
    /// The original of each operand of edges, which may be a copy.
    pub edges: IdMap<EdgeOperand, EdgeId>,
    /// The original of each controlled action.
    pub actions: IdMap<ControlledAction, ActionId>,
    /// The source of each input.
    pub inputs: IdMap<Input, Source>,
    /// The meaning of each output.
    pub outputs: IdMap<Output, Shown>,
}

/// What a step of a part stands for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Original {
    /// A step of the net, which the part owns or copies.
    Step(StepId),
    /// The rest of a sequential component: it is active if none of these steps, which the part also has, is active.
    Away(Vec<StepId>),
}

impl Original {
    /// The step of the net, if it stands for one.
    #[must_use]
    pub fn step(&self) -> Option<StepId> {
        match self {
            Original::Step(id) => Some(*id),
            Original::Away(_) => None,
        }
    }
}

/// The source of an input of a part.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Source {
    /// The input of the net, as latched for the round.
    Input(InputId),
    /// The input of the net, as its pin shows it at every moment; only the emergency condition of a chip reads it.
    Direct(InputId),
    /// The wire of another part that shows this signal.
    Wire(Signal),
    /// Whether this round is followed by another one of the same reaction, so that END waits: on a chip, whether any part moves; on the CPU, whether a chip does.
    More,
}

/// The meaning of an output of a part.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Shown {
    /// The output of the net.
    Output(OutputId),
    /// A wire: the signal of a transition or state of the part.
    Wire(Signal),
    /// Whether any transition that the part owns fires in this round; only in parts of a net with evolution `stable`.
    Moves,
}

/// The largest number of micro-steps in a reaction, if each of them is a round of the parts; `None` if a reaction is one round: with evolution `single`, and in a
/// statechart, which is on one part as a whole (§10.8).
#[must_use]
pub fn rounds_of(net: &Net) -> Option<u32> {
    match net.settings.evolution {
        Evolution::Stable { limit } if !net.settings.policy.is_statechart() => Some(limit),
        Evolution::Stable { .. } | Evolution::Single => None,
    }
}

/// True if END of the net does more than show outputs: it has controlled actions, tasks, free timers, continuous extern actions, or outputs whose conditions call a
/// function.
#[must_use]
pub fn has_ending(net: &Net) -> bool {
    let is_called = |output: &Output| match &output.driver {
        Driver::Extern { calls, .. } => !calls.is_empty(),
        driver => driver.exprs().any(|expr| net.asks(expr)),
    };
    !net.actions.is_empty()
        || !net.timers.is_empty()
        || net.steps.values().any(|step| !step.tasks.is_empty())
        || net.outputs.values().any(is_called)
}

/// The net whose reaction is one round of the parts (semantics §10.3): the net itself or, if a reaction is several rounds, its micro-step, after which END waits
/// unless nothing fires.
///
/// Its properties are the assumptions that every round satisfies. In all rounds of a reaction except the first one, events are absent; so an assumption about
/// events may be false there, and is left out.
///
/// # Errors
/// Findings of validation, which would be a bug.
pub fn round_of(net: &Valid<Net>) -> Result<Valid<Net>, Vec<Diagnostic>> {
    if rounds_of(net).is_none() {
        return Ok(net.clone());
    }
    let mut round = net.clone().into_inner();
    round.settings.evolution = Evolution::Single;
    round.ending = has_ending(net).then(|| Ending { waits: Expr::bool(false), is_quiet: true });
    let is_held = |leaf: &PropertyLeaf| matches!(leaf, PropertyLeaf::Net(Leaf::Input(id)) if net.inputs[*id].kind == InputKind::Pin);
    round.properties.retain(|property| {
        property.role == PropertyRole::Assume && property.never.leaves().all(is_held)
    });
    validate(round)
}
