//! The net: the flat form of a chart that all engines execute.
//!
//! A net is flat. Every macro-step is expanded, every instance is copied, every name is resolved; a hierarchy remains only as data that the reaction needs
//! (parents of enclosed steps and of states, history, forcing orders). The simulator, the verifier, both back ends and the partitioner accept only a
//! [`Valid`](crate::validate::Valid) net.
//!
//! # Meaning
//! `docs/semantics.md` is the contract; each item below cites its section. In short, one *reaction* reads the inputs once, then runs *micro-steps*: a
//! transition is *enabled* when all its [`requires`](Transition::requires) are active, and *fireable* when its receptivity is also true. The conflict
//! policy picks some of the fireable transitions, all picked transitions fire at once, and the statement lists run in a fixed order. In evolution
//! [`Single`](Evolution::Single) there is one micro-step; in [`Stable`](Evolution::Stable) micro-steps run until nothing is fireable (at most `limit`).
//! Then controlled actions, tasks, free timers and outputs follow.
//!
//! # Order
//! The order of an arena is the declaration order of semantics.md §1; every order that matters (actions, conflicts, trace columns) is this one.

mod behaviour;
mod qualifier;
mod remarks;
mod texts;

pub use behaviour::{ActionUse, Block, ControlledAction, SendSlot, Stmt, StmtKind, Task, Verbatim};
pub use qualifier::{ActionPart, Qualifier};
pub use remarks::{
    Board, MacroStep, OpenCell, PlacedItem, Placement, Property, PropertyExpr, PropertyLeaf,
    PropertyRole, Unspecified,
};
pub use texts::{is_c, without_c_texts};

use crate::arena::{Arena, Id};
use crate::expr::{Expr as GenericExpr, ExprKind, Type};
use crate::span::{Name, Span};
use std::collections::BTreeMap;

/// Identifies a step of a net.
pub type StepId = Id<Step>;
/// Identifies a transition of a net.
pub type TransitionId = Id<Transition>;
/// Identifies an input, an extern condition or an event.
pub type InputId = Id<Input>;
/// Identifies an output or an extern action.
pub type OutputId = Id<Output>;
/// Identifies a variable.
pub type VarId = Id<Var>;
/// Identifies a free timer.
pub type TimerId = Id<Timer>;
/// Identifies the operand of edges.
pub type EdgeId = Id<EdgeOperand>;
/// Identifies a controlled action.
pub type ActionId = Id<ControlledAction>;
/// Identifies a slot for delayed events.
pub type SendId = Id<SendSlot>;
/// Identifies a history.
pub type HistoryId = Id<History>;
/// Identifies a partial chart.
pub type PartId = Id<Part>;
/// An expression over the values of a net.
pub type Expr = GenericExpr<Leaf>;

/// Source location, comment and tags: every object has them, so that reports, C and equations can show them.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Meta {
    /// Source location of the declaration.
    pub span: Span,
    /// The designer's comment in quotes; empty when there is none.
    pub label: String,
    /// Requirement tags (`req "R12"`), in the order written.
    pub req: Vec<String>,
}

/// A value that an expression of a net can read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Leaf {
    /// An input or extern condition as latched, or an event, which is true during one micro-step.
    Input(InputId),
    /// A variable or a stored output. An array occurs only in `Element`.
    Var(VarId),
    /// A step's bit (Boolean).
    Active(StepId),
    /// `s.t`: ticks since activation, 0 while inactive; allowed only in a comparison with a constant.
    Elapsed(StepId),
    /// `s.T` of IEC 61131-3: like `Elapsed`, but keeps its last value while the step is inactive.
    LastElapsed(StepId),
    /// `s.done`: the step is active and all its tasks have run.
    TasksDone(StepId),
    /// A free timer in ticks; allowed only in a comparison with a constant.
    Timer(TimerId),
    /// A rising edge of the operand.
    Rise(EdgeId),
    /// A falling edge of the operand.
    Fall(EdgeId),
    /// The transition is enabled and its receptivity is true in this micro-step, before any conflict is resolved. It can refer only to transitions
    /// declared earlier, so there is no cycle. `otherwise` is lowered to it.
    Fireable(TransitionId),
    /// Q of a controlled action at the end of the previous reaction (in outputs: as just computed in this reaction).
    Controlled(ActionId),
}

impl Leaf {
    /// True for a time in ticks, which has no type and is allowed only in a comparison with a constant.
    #[must_use]
    pub fn is_time(&self) -> bool {
        matches!(self, Leaf::Elapsed(_) | Leaf::LastElapsed(_) | Leaf::Timer(_))
    }

    /// The input, extern condition or event.
    #[must_use]
    pub fn input(&self) -> Option<InputId> {
        if let Leaf::Input(input) = self { Some(*input) } else { None }
    }

    /// The step whose bit, time or tasks the leaf reads.
    #[must_use]
    pub fn step(&self) -> Option<StepId> {
        match *self {
            Leaf::Active(step)
            | Leaf::Elapsed(step)
            | Leaf::LastElapsed(step)
            | Leaf::TasksDone(step) => Some(step),
            _ => None,
        }
    }

    /// The operand of an edge.
    #[must_use]
    pub fn edge(&self) -> Option<EdgeId> {
        if let Leaf::Rise(edge) | Leaf::Fall(edge) = self { Some(*edge) } else { None }
    }
}

/// The whole net.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Net {
    /// The chart's name; emitted files and functions are named after it.
    pub name: Name,
    /// Policy, evolution, tick.
    pub settings: Settings,
    /// Partial charts; at least one. A step or transition belongs to exactly one.
    pub parts: Arena<Part>,
    /// Inputs, extern conditions and events, mixed in declaration order: the columns of the stimulus.
    pub inputs: Arena<Input>,
    /// Outputs and extern actions.
    pub outputs: Arena<Output>,
    /// Variables, stored outputs and variables added by lowerings.
    pub vars: Arena<Var>,
    /// The designer's sharing settings for variables of halted steps (§6); a variable without a setting is not listed.
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
    /// The condition that forces all outputs to their safe values.
    pub emergency: Option<Emergency>,
    /// The rounds in which a part of a split makes no END (§10.2); no chart has this.
    pub ending: Option<Ending>,
    /// Assumptions about the environment, and properties to prove.
    pub properties: Vec<Property>,
    /// Cells whose value the designer left open (§3.6).
    pub unspecified: Vec<Unspecified>,
    /// Macro-steps as drawn, for `m.active` in reports and traces.
    pub macros: Vec<MacroStep>,
    /// Placement requests of the designer (§10).
    pub placements: Vec<Placement>,
    /// Pins and device.
    pub board: Board,
}

/// The settings of a chart.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Settings {
    /// The conflict policy (§4).
    pub policy: Policy,
    /// One micro-step per reaction, or until stable (§3.4).
    pub evolution: Evolution,
    /// The source of the rank of a partial chart, which is the first sort key (§4).
    pub schedule: Schedule,
    /// True if only the first transition of the whole order fires in a micro-step (§4).
    pub fire_one: bool,
    /// True if right-hand sides read the values from the start of the micro-step (§3.3).
    pub assign_simultaneous: bool,
    /// True if bodies of controlled actions run once more after Q becomes false (§3.5).
    pub final_scan: bool,
    /// True if a row of the stimulus contains at most one event (§5).
    pub events_exclusive: bool,
    /// The bound of the internal queue of a statechart, and of the external one; `None` if no queue is needed.
    pub queue: Option<u32>,
    /// Nanoseconds per tick, at least 1.
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

/// How conflicts between transitions are resolved (§4).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Policy {
    /// All fireable transitions fire (IEC 60848, rule 4).
    All,
    /// Transitions that share a preceding step compete by declared priority, then by declaration order.
    Priority,
    /// Like `Priority`, but by the priority of the following steps, then by their age (the paper on Grafcet, C and PALASM).
    PriorityAge,
    /// SCXML: the innermost source wins. The net is a statechart.
    InnerFirst,
    /// The reverse: the outermost source wins. The net is a statechart.
    OuterFirst,
}

impl Policy {
    /// The policy in the chart language, such as `priority-age`.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Policy::All => "all",
            Policy::Priority => "priority",
            Policy::PriorityAge => "priority-age",
            Policy::InnerFirst => "inner-first",
            Policy::OuterFirst => "outer-first",
        }
    }

    /// True for the two policies of statecharts.
    #[must_use]
    pub fn is_statechart(self) -> bool {
        matches!(self, Policy::InnerFirst | Policy::OuterFirst)
    }
}

/// The largest limit of micro-steps. With this limit, a chart that never becomes stable runs a million micro-steps in each reaction before the fault is
/// detected.
pub const MAX_LIMIT: u32 = 1_000_000;

/// The number of micro-steps in a reaction (§3.4).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Evolution {
    /// One micro-step.
    Single,
    /// Micro-steps until nothing is fireable and no event is pending, at most `limit` (at least 1, at most [`MAX_LIMIT`]).
    Stable {
        /// The largest number of micro-steps; in statecharts, for each external event.
        limit: u32,
    },
}

/// The source of the rank of partial charts (§4).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Schedule {
    /// All parts have the same rank, so declaration order decides.
    Declared,
    /// Lower [`Part::level`] first.
    Level,
    /// Lower [`Part::priority`] first; parts without a priority last.
    Priority,
}

/// A partial chart: a connected drawing, the expansion of a macro-step, or what an enclosing step encloses.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Part {
    /// Full name.
    pub name: Name,
    /// Depth in the hierarchy: 1 is a root chart.
    pub level: u32,
    /// Declared priority, 1 is first; `None` is last.
    pub priority: Option<u32>,
    /// For a statechart, the entries of a reset, in document order.
    pub initial: Vec<Enter>,
    /// True in a part of a split that may have only some steps of the chart, so that nothing has to begin here (§10.2).
    pub is_cut: bool,
    /// Source location, comment and tags.
    pub meta: Meta,
}

/// A column of the stimulus.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Input {
    /// The name of the input.
    pub name: Name,
    /// Boolean or a range. Events are Boolean.
    pub ty: Type,
    /// The source of the input's value.
    pub kind: InputKind,
    /// True if the pin is synchronous to the clock, so that the chip needs no synchroniser (§9).
    pub synchronous: bool,
    /// Source location, comment and tags.
    pub meta: Meta,
}

/// The source of the value of an [`Input`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum InputKind {
    /// A pin or a field of the input structure.
    Pin,
    /// A function of the user's C library, called at most once per reaction (§6).
    Extern,
    /// An event that the environment can raise: a column of the stimulus.
    Event,
    /// An event that only the chart raises; it has no column in a stimulus.
    InternalEvent,
}

impl InputKind {
    /// True for both kinds of events.
    #[must_use]
    pub fn is_event(self) -> bool {
        matches!(self, InputKind::Event | InputKind::InternalEvent)
    }

    /// True for everything that the caller supplies with each reaction: pins and external events.
    #[must_use]
    pub fn is_handed(self) -> bool {
        matches!(self, InputKind::Pin | InputKind::Event)
    }
}

/// A column of the trace that the net computes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Output {
    /// The name of the output.
    pub name: Name,
    /// Boolean, unless the output is stored.
    pub ty: Type,
    /// The driver of the output, of exactly one kind (§3.6).
    pub driver: Driver,
    /// The declared safe value for the plant; [`Output::safe_value`] supplies the default. `None` for extern actions.
    pub safe: Option<i64>,
    /// True if the chip drives the pin from a flip-flop (§9).
    pub registered: bool,
    /// Source location, comment and tags.
    pub meta: Meta,
}

impl Output {
    /// The value of the output during an [`Emergency`] and after a stop: the declared safe value; without one, off or the value nearest to 0.
    #[must_use]
    pub fn safe_value(&self) -> i64 {
        self.safe.unwrap_or_else(|| self.ty.saturate(0))
    }

    /// The visible value: `value`, or the safe value while `emergency` is true. Not for extern actions.
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

    /// True if an emergency forces the output to its safe value: all outputs of the plant, so neither extern actions nor [`Driver::Fires`].
    #[must_use]
    pub fn is_forced(&self) -> bool {
        !matches!(self.driver, Driver::Extern { .. } | Driver::Fires(_))
    }

    /// True for an extern action: a function of the user's library, which has no value.
    #[must_use]
    pub fn is_extern(&self) -> bool {
        matches!(self.driver, Driver::Extern { .. })
    }
}

impl Net {
    /// The value of an output at the pin: `value`, or the safe value during an emergency if that forces the output.
    #[must_use]
    pub fn forced(&self, output: OutputId, value: Expr) -> Expr {
        let Some(emergency) = &self.emergency else { return value };
        if !self.outputs[output].is_forced() {
            return value;
        }
        self.outputs[output].forced(value, emergency.condition.clone())
    }
}

/// `emergency c`: while the condition is true, every output has its safe value, and continuous extern actions are not called (§3.8).
///
/// It changes only the visible outputs: situation, variables, timers and stored outputs continue unaffected.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Emergency {
    /// Reads inputs, step bits, variables, controlled actions and timers, but no edge, event or extern condition. It is evaluated when the output is: at
    /// E4; for mealy outputs at L2, with the state before the micro-step.
    pub condition: Expr,
    /// Source location, comment and tags.
    pub meta: Meta,
}

impl Net {
    /// True if the expression reads an extern condition, so that evaluating it may call a function.
    #[must_use]
    pub fn asks(&self, expr: &Expr) -> bool {
        let is_extern =
            |id: InputId| self.inputs.get(id).is_some_and(|input| input.kind == InputKind::Extern);
        expr.leaves().filter_map(Leaf::input).any(is_extern)
    }
}

/// For a net whose reaction is one of several rounds: END, except for showing outputs, waits for the round in which no part moves (§10.2).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Ending {
    /// True in a round in which another part moves, or any part; reads only pins.
    pub waits: Expr,
    /// True if END also waits in a round in which a transition of the net itself fires. On a chip, `waits` already includes them.
    pub is_quiet: bool,
}

/// The driver of an [`Output`].
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Driver {
    /// True while the step of some emission is active in the resulting situation and the emission's condition is true. The list is empty for an output
    /// that nothing drives.
    Continuous(Vec<Emission>),
    /// Like `Continuous`, but reads the situation before the micro-step and the inputs of this reaction; evolution `Single` only (§3.6).
    Mealy(Vec<Emission>),
    /// True in a reaction in which one of the transitions fires, false at reset; evolution `Single` only. A part of a split shows it to the other parts (§10).
    /// On a chip the pin has this value before the clock edge. An emergency does not force it, because it is not an output of the plant.
    Fires(Vec<TransitionId>),
    /// The value of a variable, which stores the output.
    Stored(VarId),
    /// Q of a controlled action.
    Controlled(ActionId),
    /// A function of the user's C library. Its column counts the calls in the reaction; if it has parameters, the column lists the argument tuples, joined
    /// by `;`.
    Extern {
        /// Types of the parameters, in order.
        params: Vec<Param>,
        /// Steps that call it once per reaction while active; if several are active, the arguments of the first are used.
        calls: Vec<ExternCall>,
    },
}

/// A parameter of an extern action.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Param {
    /// The name of the parameter; may be empty.
    pub name: String,
    /// The type of the parameter; arguments saturate to its range.
    pub ty: Type,
}

/// The contribution of one step to a continuous output.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Emission {
    /// The step.
    pub step: StepId,
    /// An additional condition; contains no edge and no event.
    pub condition: Option<Expr>,
    /// Source location.
    pub span: Span,
}

/// A call of an extern action while a step is active.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ExternCall {
    /// The step.
    pub step: StepId,
    /// An additional condition, as in [`Emission`].
    pub condition: Option<Expr>,
    /// The arguments, one for each parameter.
    pub arguments: Vec<Expr>,
    /// Source location.
    pub span: Span,
}

/// A variable, or the memory of a stored output.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Var {
    /// The name of the variable.
    pub name: Name,
    /// The type of a value or of each element.
    pub ty: Type,
    /// The number of elements of an array, at least 1; `None` for a plain variable.
    pub len: Option<u32>,
    /// The values at reset: one value, or one for each element.
    pub init: Vec<i64>,
    /// The reason why the variable exists; only declared variables have a trace column of their own.
    pub origin: VarOrigin,
    /// Source location, comment and tags.
    pub meta: Meta,
}

/// The reason why a variable exists.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum VarOrigin {
    /// Declared with `var`: a trace column (one for each element).
    Declared,
    /// The memory of a stored output; the output's column shows it.
    StoredOutput,
    /// Created by a lowering; such a variable has no column.
    Hidden,
}

/// How to handle a variable that the tasks of a halted step share with others (§6, [`crate::sharing`]).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Sharing {
    /// Others may see intermediate values; no warning is given.
    Allow,
    /// Sharing the variable is an error.
    Refuse,
    /// The tasks work on a copy: it is taken when the first task begins and written back when the last is done.
    Buffer,
    /// Other code that accesses the variable waits until the tasks are done.
    Protect,
}

/// The keywords for [`Sharing`], in every text form.
pub const SHARINGS: [(&str, Sharing); 4] = [
    ("allow", Sharing::Allow),
    ("refuse", Sharing::Refuse),
    ("buffer", Sharing::Buffer),
    ("protect", Sharing::Protect),
];

impl Sharing {
    /// The keyword of the setting.
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

/// `timer T while e`: at Latch, T grows by dt if e was true at the end of the previous reaction; at the end of a reaction, T := 0 if e is false (§7).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Timer {
    /// The name of the timer.
    pub name: Name,
    /// The condition of the timer; contains no edge and no event.
    pub condition: Expr,
    /// True if the timer has its largest value instead of 0 before the first reaction (for the off-delay of `t1/E/t2`).
    pub starts_expired: bool,
    /// Source location, comment and tags.
    pub meta: Meta,
}

/// An expression whose edges are read (§3.7).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct EdgeOperand {
    /// Boolean, without edges and `Fireable`. An operand over inputs alone is compared with the previous reaction; any other operand with the last
    /// micro-step in which a transition fired.
    pub expr: Expr,
}

/// A step, or a state of a statechart.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Step {
    /// Full name; `macro.step` for steps from an expansion.
    pub name: Name,
    /// The partial chart that the step belongs to.
    pub part: PartId,
    /// True if the step is active after reset. Always false in a statechart, where [`Part::initial`] lists the states that are entered.
    pub is_initial: bool,
    /// The kind of the step.
    pub kind: StepKind,
    /// The enclosing step or the state that contains it.
    pub parent: Option<StepId>,
    /// For an enclosed step: true if the enclosing step activates it (`*`, §8).
    pub activation_link: bool,
    /// True if a lowering created the step: such a step is neither in the trace nor counted in `limit`.
    pub hidden: bool,
    /// The priority (P in the paper on Grafcet, C and PALASM): 1 is first, `None` is last.
    pub priority: Option<u32>,
    /// The statements that run when the step is activated.
    pub entry: Block,
    /// The statements that run when the step is deactivated.
    pub exit: Block,
    /// For a composite state: statements of its initial transition; they run after `entry` when the state is entered by default.
    pub initial_content: Block,
    /// Target-language text that runs once per reaction while the step is active, after the outputs are computed.
    pub code: Vec<Verbatim>,
    /// Indivisible tasks in order (§6).
    pub tasks: Vec<Task>,
    /// The total cost that the tasks of the step may use in a reaction.
    pub budget: u32,
    /// Plain Boolean variables: while one of them is true, the first task does not begin (`shared protect`, §6).
    pub locks: Vec<VarId>,
    /// For a composite or parallel state: the event that is raised when the state is complete.
    pub done_event: Option<InputId>,
    /// Source location, comment and tags.
    pub meta: Meta,
}

impl Step {
    /// A leaf step without content, inactive after reset and without a parent.
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

    /// The tasks of each reaction, as consecutive ranges: the step halts between them. Costs and budget alone determine the ranges.
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

    /// True if the tasks of the step need more than one reaction.
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
    /// A state whose children (its regions) are all active while it is active.
    Parallel,
    /// A final state; without a parent, it ends its chart.
    Final,
}

/// One entry in a list of entered states, which is in document order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Enter {
    /// Activate this step.
    Step(StepId),
    /// Run [`Step::initial_content`] of this composite state, which is entered by default.
    InitialContent(StepId),
    /// Enter what the history recorded, or its default if it recorded nothing.
    History(HistoryId),
}

/// A transition, or a reaction of a step.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Transition {
    /// The name of the transition; if the designer gave none, a name made from the steps before and after it.
    pub name: Name,
    /// The partial chart that the transition belongs to.
    pub part: PartId,
    /// The kind: whether the transition changes the situation or only reacts.
    pub kind: TransitionKind,
    /// Steps that must all be active; empty for a source transition. In a statechart: the one source state.
    pub requires: Vec<StepId>,
    /// Steps that firing deactivates if they are active. Outside statecharts this equals `requires`; in a statechart it contains every proper descendant
    /// of the transition's domain, so the exit set is its active part.
    pub clears: Vec<StepId>,
    /// The entries when the transition fires, in declaration order; empty for a sink transition.
    pub enters: Vec<Enter>,
    /// The events that trigger the transition: it fires only in a micro-step in which one of them is present. Empty if it needs no event.
    pub events: Vec<InputId>,
    /// The receptivity.
    pub guard: Expr,
    /// Declared priority: 1 is the most urgent, `None` is last.
    pub priority: Option<u32>,
    /// True if a step that is removed and added is deactivated and activated again instead of staying active (§3.2). Always true in a statechart.
    pub restart: bool,
    /// The statements that run when the transition fires.
    pub actions: Block,
    /// The designer's deadline in nanoseconds, for the partition.
    pub deadline_ns: Option<u64>,
    /// Source location, comment and tags.
    pub meta: Meta,
}

/// The effect of a [`Transition`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum TransitionKind {
    /// Deactivates and activates steps.
    Move,
    /// Without targets, or `on EVENT { .. }` of a step: consumes no activation and, outside statecharts, never competes (§3.2).
    Reaction,
}

/// The memory of a composite state.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct History {
    /// The name of the history.
    pub name: Name,
    /// The state whose exit updates the history.
    pub owner: StepId,
    /// One case for each step that may be recorded. A shallow history has a case for each child of the owner; a deep history for each atomic descendant.
    pub cases: Vec<HistoryCase>,
    /// The entries if nothing is recorded.
    pub default: Vec<Enter>,
    /// Statements of the default transition; they run after the owner's entry list.
    pub default_content: Block,
    /// Source location, comment and tags.
    pub meta: Meta,
}

/// One case of a [`History`]: a step that the history may record.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct HistoryCase {
    /// The step, which is recorded if it is active when the owner is left.
    pub step: StepId,
    /// The entries if the step was recorded.
    pub enters: Vec<Enter>,
}

/// `F/G{..}`: while `step` is active, the partial chart `target` is forced to the given situation (§8).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Forcing {
    /// The forcing step.
    pub step: StepId,
    /// The chart that is forced, as its parts (including those from its macro-steps and enclosing steps).
    pub target: Vec<PartId>,
    /// The situation that the chart is forced to.
    pub order: ForcingOrder,
    /// Source location.
    pub span: Span,
}

/// The situation that a [`Forcing`] requests.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ForcingOrder {
    /// Exactly these steps, closed downwards; `init` and `{}` are special cases.
    Situation(Vec<StepId>),
    /// The situation at the start of the micro-step.
    Hold,
}
