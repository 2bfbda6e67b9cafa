//! The net: what runs.
//!
//! A net is flat. Every macro-step is expanded, every instance copied, every name resolved; a hierarchy survives only as data that the reaction
//! needs (parents of enclosed steps and of states, history, forcing orders). The simulator, the verifier, both back ends and the partitioner take a
//! [`Valid`](crate::validate::Valid) net and nothing else.
//!
//! # Meaning
//! `docs/semantics.md` is the contract; each item below names the section it carries. In short, one *reaction* reads the inputs once, then runs
//! *micro-steps*: a transition is *enabled* when all its [`requires`](Transition::requires) are active, *fireable* when its receptivity is true too; the
//! conflict policy picks among the fireable ones, all picked ones fire at once, and the action lists run in a fixed order. In evolution
//! [`Single`](Evolution::Single) there is one micro-step, in [`Stable`](Evolution::Stable) as many as it takes (at most `limit`). Then controlled
//! actions, tasks, free timers and outputs follow.
//!
//! # Order
//! The order of an arena is the declaration order of semantics.md §1; wherever an order matters (actions, conflicts, trace columns), it is this one.

mod behaviour;
mod remarks;
mod texts;

pub use behaviour::{
    ActionUse, Block, ControlledAction, Qualifier, SendSlot, Stmt, StmtKind, Task, Verbatim,
};
pub use remarks::{
    Board, MacroStep, OpenCell, PlacedItem, Placement, Property, PropertyExpr, PropertyLeaf,
    PropertyRole, Side, Unspecified,
};
pub use texts::{is_c, without_c_texts};

use crate::arena::{Arena, Id};
use crate::expr::{Expr as GenericExpr, ExprKind, Type};
use crate::span::{Name, Span};
use std::collections::BTreeMap;

/// Names a step of a net.
pub type StepId = Id<Step>;
/// Names a transition of a net.
pub type TransitionId = Id<Transition>;
/// Names an input, an extern condition or an event.
pub type InputId = Id<Input>;
/// Names an output or an extern action.
pub type OutputId = Id<Output>;
/// Names a variable.
pub type VarId = Id<Var>;
/// Names a free timer.
pub type TimerId = Id<Timer>;
/// Names the operand of edges.
pub type EdgeId = Id<EdgeOperand>;
/// Names a controlled action.
pub type ActionId = Id<ControlledAction>;
/// Names a slot for delayed events.
pub type SendId = Id<SendSlot>;
/// Names a history.
pub type HistoryId = Id<History>;
/// Names a partial chart.
pub type PartId = Id<Part>;
/// An expression over the values of a net.
pub type Expr = GenericExpr<Leaf>;

/// What travels with every object from the source into reports, C and equations.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Meta {
    /// Where it was declared.
    pub span: Span,
    /// The designer's comment in quotes; empty when there is none.
    pub label: String,
    /// Requirement tags (`req "R12"`), in the order written.
    pub req: Vec<String>,
}

/// A value that an expression of a net can read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Leaf {
    /// An input or extern condition as latched, or an event: true in the micro-step in which it holds.
    Input(InputId),
    /// A variable or a stored output. For an array this leaf stands only in `Element`.
    Var(VarId),
    /// A step's bit (Boolean).
    Active(StepId),
    /// `s.t`: ticks since activation, 0 while inactive; stands only in a comparison with a constant.
    Elapsed(StepId),
    /// `s.T` of IEC 61131-3: as `Elapsed`, but keeps its last value while the step is inactive.
    LastElapsed(StepId),
    /// `s.done`: the step is active and all its tasks have run.
    TasksDone(StepId),
    /// A free timer in ticks; stands only in a comparison with a constant.
    Timer(TimerId),
    /// A rising edge of the operand.
    Rise(EdgeId),
    /// A falling edge of the operand.
    Fall(EdgeId),
    /// The transition is enabled and its receptivity is true in this micro-step, before any conflict is resolved. Only transitions declared
    /// earlier may be named, so this ends. It is what `otherwise` is lowered to.
    Fireable(TransitionId),
    /// Q of a controlled action, as it stood at the end of the previous reaction (or as just computed, in the outputs of this one).
    Controlled(ActionId),
}

impl Leaf {
    /// True for a time in ticks, which has no type and stands only in a comparison with a constant.
    #[must_use]
    pub fn is_time(&self) -> bool {
        matches!(self, Leaf::Elapsed(_) | Leaf::LastElapsed(_) | Leaf::Timer(_))
    }
}

/// The whole net.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Net {
    /// The chart's name, used to name what is emitted.
    pub name: Name,
    /// Policy, evolution, tick.
    pub settings: Settings,
    /// Partial charts; at least one. A step or transition belongs to exactly one.
    pub parts: Arena<Part>,
    /// Inputs, extern conditions and events, mixed in declaration order: the columns of the stimulus.
    pub inputs: Arena<Input>,
    /// Outputs and extern actions.
    pub outputs: Arena<Output>,
    /// Variables, stored outputs and what lowerings add.
    pub vars: Arena<Var>,
    /// What the designer says of variables that a halted step shares with others (§6); nothing was said of those that are not here.
    pub sharing: BTreeMap<VarId, Sharing>,
    /// Free timers (§7).
    pub timers: Arena<Timer>,
    /// Operands of edges (§3.7). Equal operands may be shared: all are compared at the same instants.
    pub edges: Arena<EdgeOperand>,
    /// Steps.
    pub steps: Arena<Step>,
    /// Transitions and reactions.
    pub transitions: Arena<Transition>,
    /// Actions with IEC 61131-3 qualifiers (§3.5).
    pub actions: Arena<ControlledAction>,
    /// Slots of delayed or external sends (§5).
    pub sends: Arena<SendSlot>,
    /// Histories of statecharts.
    pub histories: Arena<History>,
    /// Forcing orders (§8), in declaration order.
    pub forcings: Vec<Forcing>,
    /// The one condition that forces all outputs to their safe values.
    pub emergency: Option<Emergency>,
    /// What is known of the environment and what must hold.
    pub properties: Vec<Property>,
    /// Cells whose value the designer left open (§3.6).
    pub unspecified: Vec<Unspecified>,
    /// Macro-steps as they were drawn, for `m.active` in reports and traces.
    pub macros: Vec<MacroStep>,
    /// Where the designer wants things to be (§10).
    pub placements: Vec<Placement>,
    /// Pins and device.
    pub board: Board,
}

/// Everything a chart sets once.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Settings {
    /// The conflict policy (§4).
    pub policy: Policy,
    /// One micro-step a reaction, or until stable (§3.4).
    pub evolution: Evolution,
    /// What puts a partial chart's rank before all other keys (§4).
    pub schedule: Schedule,
    /// Only the first transition of the whole order fires in a micro-step (§4).
    pub fire_one: bool,
    /// Right-hand sides read the values at the start of the micro-step (§3.3).
    pub assign_simultaneous: bool,
    /// Bodies of controlled actions run once more when Q has fallen (§3.5).
    pub final_scan: bool,
    /// At most one event in a row of the stimulus (§5).
    pub events_exclusive: bool,
    /// The bound of the internal queue of a statechart, and of the external one; none where no queue is needed.
    pub queue: Option<u32>,
    /// Nanoseconds in a tick, at least 1.
    pub tick_ns: u64,
}

impl Default for Settings {
    fn default() -> Self {
        Settings {
            policy: Policy::All,
            evolution: Evolution::Single,
            schedule: Schedule::Declared,
            fire_one: false,
            assign_simultaneous: false,
            final_scan: false,
            events_exclusive: false,
            queue: None,
            tick_ns: 10_000_000,
        }
    }
}

/// How transitions that compete are picked (§4).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Policy {
    /// All fireable transitions fire (IEC 60848, rule 4).
    All,
    /// Those that share a preceding step compete by declared priority, then declaration.
    Priority,
    /// As `Priority`, but by the priority of the following steps, then their age (seed 004).
    PriorityAge,
    /// SCXML: the innermost source wins. Makes the net a statechart.
    InnerFirst,
    /// The mirror image: the outermost source wins. Makes the net a statechart.
    OuterFirst,
}

impl Policy {
    /// True for the two policies of statecharts.
    #[must_use]
    pub fn is_statechart(self) -> bool {
        matches!(self, Policy::InnerFirst | Policy::OuterFirst)
    }
}

/// The largest limit of micro-steps. A chart that turns for ever does so many in each reaction before the fault is seen.
pub const MAX_LIMIT: u32 = 1_000_000;

/// How many micro-steps a reaction makes (§3.4).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Evolution {
    /// One.
    Single,
    /// Until nothing is fireable and no event is pending, at most `limit` (at least 1, at most [`MAX_LIMIT`]).
    Stable {
        /// The largest number of micro-steps; in statecharts, for each external event.
        limit: u32,
    },
}

/// What ranks partial charts (§4).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Schedule {
    /// No rank before the other keys' declaration order: parts in declaration order.
    Declared,
    /// Lower [`Part::level`] first.
    Level,
    /// Lower [`Part::priority`] first, none last.
    Priority,
}

/// A partial chart: a connected drawing, the expansion of a macro-step, or what an enclosing step encloses.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Part {
    /// Full name.
    pub name: Name,
    /// Depth in the hierarchy: 1 is a root chart.
    pub level: u32,
    /// Declared priority, 1 first; none last.
    pub priority: Option<u32>,
    /// For a statechart, what reset enters, in document order.
    pub initial: Vec<Enter>,
    /// Place, comment and tags.
    pub meta: Meta,
}

/// A column of the stimulus.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Input {
    /// Its name.
    pub name: Name,
    /// Boolean or a range. Events are Boolean.
    pub ty: Type,
    /// Where its value comes from.
    pub kind: InputKind,
    /// The pin is in step with the clock, so the chip needs no synchroniser (§9).
    pub synchronous: bool,
    /// Place, comment and tags.
    pub meta: Meta,
}

/// Where the value of an [`Input`] comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum InputKind {
    /// A pin or a field of the input structure.
    Pin,
    /// A function of the user's C library, called at most once a reaction (§6).
    Extern,
    /// An event that the environment and the chart may raise.
    Event,
    /// An event that only the chart raises: no column.
    InternalEvent,
}

impl InputKind {
    /// True for both kinds of events.
    #[must_use]
    pub fn is_event(self) -> bool {
        matches!(self, InputKind::Event | InputKind::InternalEvent)
    }

    /// True for what the caller hands over with each reaction: pins and events from outside.
    #[must_use]
    pub fn is_handed(self) -> bool {
        matches!(self, InputKind::Pin | InputKind::Event)
    }
}

/// A column of the trace that the net computes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Output {
    /// Its name.
    pub name: Name,
    /// Boolean unless stored.
    pub ty: Type,
    /// What drives it: exactly one kind (§3.6).
    pub driver: Driver,
    /// The value at which the plant is safe, where one is declared; [`Output::safe_value`] says what holds where none is. None for extern actions.
    pub safe: Option<i64>,
    /// The chip drives the pin from a flip-flop (§9).
    pub registered: bool,
    /// Place, comment and tags.
    pub meta: Meta,
}

impl Output {
    /// What the output has while the [`Emergency`] holds, and when the chart is stopped: the declared safe value, else off or the value nearest to 0.
    #[must_use]
    pub fn safe_value(&self) -> i64 {
        self.safe.unwrap_or_else(|| self.ty.saturate(0))
    }

    /// What the output shows: `value`, or the safe one while `emergency` is true. Not for extern actions.
    #[must_use]
    pub fn forced<L>(&self, value: GenericExpr<L>, emergency: GenericExpr<L>) -> GenericExpr<L> {
        let (safe, span) = (self.safe_value(), value.span);
        match self.ty {
            Type::Bool if safe == 0 => GenericExpr::and([emergency.not(), value]),
            Type::Bool => GenericExpr::or([emergency, value]),
            Type::Int { .. } => {
                let safe = Box::new(GenericExpr::int(safe));
                GenericExpr::new(ExprKind::Select(Box::new(emergency), safe, Box::new(value)), span)
            }
        }
    }

    /// True for an extern action: a function of the user's library, which has no value.
    #[must_use]
    pub fn is_extern(&self) -> bool {
        matches!(self.driver, Driver::Extern { .. })
    }
}

impl Net {
    /// The value of an output as the world sees it: `value`, or the safe one while the emergency holds. Not for extern actions.
    #[must_use]
    pub fn forced(&self, output: OutputId, value: Expr) -> Expr {
        let Some(emergency) = &self.emergency else { return value };
        self.outputs[output].forced(value, emergency.condition.clone())
    }
}

/// `emergency c`: while the condition holds every output has its safe value, and continuous extern actions are not called (§3.8).
///
/// It forces what the world sees and nothing else: situation, variables, timers and stored outputs go on as if it were not there.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Emergency {
    /// Reads inputs, step bits, variables, controlled actions and timers, no edge, event or extern condition. Read where an output is: at E4; for mealy
    /// outputs at L2, with the state before the micro-step.
    pub condition: Expr,
    /// Place, comment and tags.
    pub meta: Meta,
}

/// What drives an [`Output`].
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Driver {
    /// True while some emission's step is active in the resulting situation and its condition holds. An output that nothing drives has none.
    Continuous(Vec<Emission>),
    /// As `Continuous`, but of the situation before the micro-step and this reaction's inputs; evolution `Single` only (§3.6).
    Mealy(Vec<Emission>),
    /// The value of a variable, which is the output's memory.
    Stored(VarId),
    /// Q of a controlled action.
    Controlled(ActionId),
    /// A function of the user's C library. Its column counts the calls of the reaction; with parameters it lists the tuples, joined by `;`.
    Extern {
        /// Types of the parameters, in order.
        params: Vec<Param>,
        /// Steps that call it once a reaction while active; where several are active, the arguments of the first.
        calls: Vec<ExternCall>,
    },
}

/// A parameter of an extern action.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Param {
    /// Its name; empty when none was given.
    pub name: String,
    /// Its type; arguments saturate to it.
    pub ty: Type,
}

/// One step's share in a continuous output.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Emission {
    /// The step.
    pub step: StepId,
    /// Holds no edge and no event.
    pub condition: Option<Expr>,
    /// Where it was written.
    pub span: Span,
}

/// A call of an extern action while a step is active.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ExternCall {
    /// The step.
    pub step: StepId,
    /// As in [`Emission`].
    pub condition: Option<Expr>,
    /// One for each parameter.
    pub arguments: Vec<Expr>,
    /// Where it was written.
    pub span: Span,
}

/// A variable, or the memory of a stored output.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Var {
    /// Its name.
    pub name: Name,
    /// The type of a value or of each element.
    pub ty: Type,
    /// The number of elements of an array, at least 1; none for a plain variable.
    pub len: Option<u32>,
    /// The value at reset: one, or one for each element.
    pub init: Vec<i64>,
    /// Whose it is; only declared ones have a trace column of their own.
    pub origin: VarOrigin,
    /// Place, comment and tags.
    pub meta: Meta,
}

/// Why a variable exists.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum VarOrigin {
    /// Declared with `var`: a trace column (one for each element).
    Declared,
    /// The memory of a stored output: the output's column shows it.
    StoredOutput,
    /// Made by a lowering: no column.
    Hidden,
}

/// What becomes of a variable that the tasks of a halted step share with others (§6, [`crate::sharing`]).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Sharing {
    /// Others may see it half done; nobody is told.
    Allow,
    /// Sharing it is an error.
    Refuse,
    /// The tasks work on a copy: taken when the first begins, published when the last is done.
    Buffer,
    /// Who touches it waits until the tasks are done.
    Protect,
}

/// The words of [`Sharing`], in every text that has them.
pub const SHARINGS: [(&str, Sharing); 4] = [
    ("allow", Sharing::Allow),
    ("refuse", Sharing::Refuse),
    ("buffer", Sharing::Buffer),
    ("protect", Sharing::Protect),
];

impl Sharing {
    /// Its word.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Sharing::Allow => "allow",
            Sharing::Refuse => "refuse",
            Sharing::Buffer => "buffer",
            Sharing::Protect => "protect",
        }
    }
}

/// `timer T while e`: at Latch T grows by dt if e held at the end of the previous reaction; at the end of a reaction T := 0 if e is false (§7).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Timer {
    /// Its name.
    pub name: Name,
    /// Holds no edge and no event.
    pub condition: Expr,
    /// Before the first reaction it stands at its largest value instead of 0 (for the off-delay of `t1/E/t2`).
    pub starts_expired: bool,
    /// Place, comment and tags.
    pub meta: Meta,
}

/// An expression whose edges are asked for (§3.7).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct EdgeOperand {
    /// Boolean, without edges and `Fireable`. An operand over inputs alone is compared with the previous reaction, any other with the last micro-step that fired.
    pub expr: Expr,
}

/// A step, or a state of a statechart.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Step {
    /// Full name, `macro.step` for steps that an expansion brought.
    pub name: Name,
    /// The partial chart it belongs to.
    pub part: PartId,
    /// Active after reset. In a statechart [`Part::initial`] says what is entered, and this is false everywhere.
    pub is_initial: bool,
    /// What kind of step it is.
    pub kind: StepKind,
    /// The enclosing step or the state it lies in.
    pub parent: Option<StepId>,
    /// For an enclosed step: the enclosing step activates it (`*`, §8).
    pub activation_link: bool,
    /// Made by a lowering: neither in the trace nor counted in `limit`.
    pub hidden: bool,
    /// P of seed 004: 1 first, none last.
    pub priority: Option<u32>,
    /// Runs when the step is activated.
    pub entry: Block,
    /// Runs when the step is deactivated.
    pub exit: Block,
    /// For a composite state: content of its initial transition; runs after `entry` when the state is entered by default.
    pub initial_content: Block,
    /// Text of a target language that runs once a reaction while the step is active, after the outputs are known.
    pub code: Vec<Verbatim>,
    /// Indivisible tasks in order (§6).
    pub tasks: Vec<Task>,
    /// Cost that its tasks may use in a reaction.
    pub budget: u32,
    /// Plain Boolean variables: while one of them is true, no first task begins (`shared protect`, §6).
    pub locks: Vec<VarId>,
    /// For a composite or parallel state: the event raised when it is complete.
    pub done_event: Option<InputId>,
    /// Place, comment and tags.
    pub meta: Meta,
}

impl Step {
    /// A leaf with nothing in it, inactive after reset and in no other step.
    #[must_use]
    pub fn new(name: Name, part: PartId) -> Self {
        Step {
            name,
            part,
            is_initial: false,
            kind: StepKind::Leaf,
            parent: None,
            activation_link: false,
            hidden: false,
            priority: None,
            entry: Block::new(),
            exit: Block::new(),
            initial_content: Block::new(),
            code: Vec::new(),
            tasks: Vec::new(),
            budget: 0,
            locks: Vec::new(),
            done_event: None,
            meta: Meta::default(),
        }
    }

    /// The tasks that one reaction runs, one range after the other: a step halts between them. Where they end follows from costs and budget alone.
    #[must_use]
    pub fn chunks(&self) -> Vec<std::ops::Range<usize>> {
        let mut chunks: Vec<std::ops::Range<usize>> = Vec::new();
        let mut rest = 0;
        for (at, task) in self.tasks.iter().enumerate() {
            match chunks.last_mut() {
                Some(chunk) if task.cost <= rest => {
                    chunk.end = at + 1;
                    rest -= task.cost;
                }
                Some(_) | None => {
                    chunks.push(at..at + 1);
                    rest = self.budget.saturating_sub(task.cost);
                }
            }
        }
        chunks
    }

    /// Its tasks need more than one reaction.
    #[must_use]
    pub fn halts(&self) -> bool {
        self.chunks().len() > 1
    }
}

/// Kinds of steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum StepKind {
    /// A plain step, or an atomic state.
    Leaf,
    /// An enclosing step (§8).
    Enclosing,
    /// A state with exactly one active child while it is active.
    Composite,
    /// A state all of whose children (its regions) are active while it is.
    Parallel,
    /// A final state: without a parent it ends its chart.
    Final,
}

/// Something that is entered, in document order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Enter {
    /// Activate this step.
    Step(StepId),
    /// Run [`Step::initial_content`] of this composite, which is entered by default.
    InitialContent(StepId),
    /// Enter what the history recorded, or its default.
    History(HistoryId),
}

/// A transition, or a reaction of a step.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Transition {
    /// Its name; made from its place in the chart when the designer gave none.
    pub name: Name,
    /// The partial chart it belongs to.
    pub part: PartId,
    /// Fires and moves, or only reacts.
    pub kind: TransitionKind,
    /// Steps that must all be active; empty for a source transition. In a statechart: the one source state.
    pub requires: Vec<StepId>,
    /// Steps that firing deactivates where they are active. Outside statecharts it equals `requires`; in a statechart it is every proper descendant
    /// of the transition's domain, so the exit set is what of it is active.
    pub clears: Vec<StepId>,
    /// What firing activates, in declaration order; empty for a sink transition.
    pub enters: Vec<Enter>,
    /// Fires only in a micro-step in which one of these events holds; empty: needs none.
    pub events: Vec<InputId>,
    /// The receptivity.
    pub guard: Expr,
    /// Declared priority: 1 is the most urgent, none last.
    pub priority: Option<u32>,
    /// Steps both deactivated and activated count as both (§3.2). Always true in a statechart.
    pub restart: bool,
    /// Run when the transition fires.
    pub actions: Block,
    /// The designer's deadline in nanoseconds, for the partition.
    pub deadline_ns: Option<u64>,
    /// Place, comment and tags.
    pub meta: Meta,
}

/// What a [`Transition`] does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum TransitionKind {
    /// Deactivates and activates steps.
    Move,
    /// Targetless, or `on EVENT { .. }` of a step: consumes nothing and, outside statecharts, never competes (§3.2).
    Reaction,
}

/// The memory of a composite state.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct History {
    /// Its name.
    pub name: Name,
    /// The state whose exit records it.
    pub owner: StepId,
    /// For each step that may be recorded: what is entered then. Shallow: the owner's children. Deep: its atomic descendants.
    pub cases: Vec<HistoryCase>,
    /// What is entered while nothing is recorded.
    pub default: Vec<Enter>,
    /// Content of the default transition; runs after the owner's entry list.
    pub default_content: Block,
    /// Place, comment and tags.
    pub meta: Meta,
}

/// One step that a [`History`] may record.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct HistoryCase {
    /// Recorded if active when the owner is left.
    pub step: StepId,
    /// What is entered when it was.
    pub enters: Vec<Enter>,
}

/// `F/G{..}`: while `step` is active, partial chart `target` has the given situation (§8).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Forcing {
    /// The forcing step.
    pub step: StepId,
    /// The chart that is forced: these parts (a chart and what its macro-steps and enclosing steps bring).
    pub target: Vec<PartId>,
    /// What it is forced to.
    pub order: ForcingOrder,
    /// Where it was written.
    pub span: Span,
}

/// The situation that a [`Forcing`] asks for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ForcingOrder {
    /// Exactly these steps, closed downwards; `init` and `{}` are special cases.
    Situation(Vec<StepId>),
    /// What it is at the start of the micro-step.
    Hold,
}
