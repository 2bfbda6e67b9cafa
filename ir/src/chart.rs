//! The chart: what the designer drew.
//!
//! Every front end produces a [`Design`]; [`crate::lower`] turns it into a net. References are still names here: the lowering resolves, types and reports
//! them, so that each front end reports the same errors. Every item has a source location. Items are in the order in which they were drawn, which is the
//! declaration order of semantics.md §1.

use crate::expr::{Expr as GenericExpr, Type};
use crate::net::{Meta, Policy, Qualifier, Schedule, Sharing, Verbatim};
use crate::span::{Name, Span};

/// An expression whose leaves are still names.
pub type Expr = GenericExpr<Leaf>;

/// A whole source: charts that run in parallel, and what they share.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Design {
    /// The `edition` line, if the file has one.
    pub edition: Option<(u32, Span)>,
    /// Files whose library charts the design uses, as written. The code that reads these files adds their library charts to `libraries`.
    pub imports: Vec<Import>,
    /// Library charts. They do not run themselves; only the instances that `use` creates do.
    pub libraries: Vec<Library>,
    /// Charts in order; names include the chart's name only if there are several charts.
    pub charts: Vec<Chart>,
}

/// One chart.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Chart {
    /// The name of the chart.
    pub name: Name,
    /// True if the text does not name the chart: `name` is a default of the front end, and the caller may replace it with the name of the file.
    pub is_unnamed: bool,
    /// The whole chart, for findings about it.
    pub span: Span,
    /// For a statechart: the states that reset enters. If empty, reset enters the outermost state that is marked as initial, or the first state.
    pub initial: Vec<Path>,
    /// Everything in the chart, in the order written.
    pub items: Vec<Item>,
    /// Comment and tags.
    pub meta: Meta,
}

/// `use "conveyors.graf"` before the first chart: the library charts of another file.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Import {
    /// The file's name, relative to the file that contains the `use`.
    pub file: String,
    /// Source location.
    pub span: Span,
}

/// `library chart conveyor(input start, output run, const limit = 5) { .. }`: a chart that others instantiate; each instance is a separate copy.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Library {
    /// The name of the library chart.
    pub name: Name,
    /// The declarations in parentheses; each `use` supplies a value for them.
    pub parameters: Vec<Parameter>,
    /// The items of the library chart.
    pub items: Vec<Item>,
    /// The certificate of the library chart, if its file contains one.
    pub certificate: Option<Certificate>,
    /// The whole library chart.
    pub span: Span,
    /// Source location, comment and tags.
    pub meta: Meta,
}

/// A parameter of a library chart.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Parameter {
    /// The declaration of the parameter inside the chart: an input, output, variable, event or constant.
    pub declaration: Declaration,
    /// The default argument, or the default value of a constant. Only inputs and constants can have one.
    pub default: Option<Expr>,
}

/// The properties that were proved for a library chart. `check` can prove them again instead of trusting the certificate.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Certificate {
    /// The certified library chart.
    pub of: Name,
    /// The version of the tool that proved the properties.
    pub version: String,
    /// SHA-256 of the canonical text of the library chart without comments, as 64 hexadecimal digits.
    pub hash: String,
    /// The properties that were proved, by name.
    pub properties: Vec<Name>,
    /// Source location.
    pub span: Span,
}

/// An instance of a library chart: `use conveyor as c1(start = m, done -> x)`.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Use {
    /// The library chart.
    pub library: Name,
    /// The name of this instance, which qualifies the names in it.
    pub name: Name,
    /// The arguments for the parameters of the library chart.
    pub arguments: Vec<Argument>,
    /// Source location, comment and tags.
    pub meta: Meta,
}

/// An argument of one instance.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Argument {
    /// The parameter.
    pub parameter: Name,
    /// The value of the argument.
    pub value: ArgumentValue,
    /// Source location.
    pub span: Span,
}

/// The kinds of argument.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ArgumentValue {
    /// `start = m and not b`: the instance reads this expression instead of the parameter.
    Reads(Expr),
    /// `done -> x`: when the instance writes the parameter, it writes this output, variable or event.
    Drives(Path),
}

/// One item of a chart, or of the body of a macro-step, enclosing step, state or region.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Item {
    /// A setting such as `tick` or `conflict`.
    Setting(Setting),
    /// `input`, `output`, `var`, `event`, `timer`, `extern`.
    Declaration(Declaration),
    /// A step.
    Step(Step),
    /// A transition.
    Transition(Transition),
    /// The body of a macro-step, declared once and used by `macro step`.
    Macro(Macro),
    /// A macro-step that uses such a body.
    MacroStep(MacroStep),
    /// An enclosing step.
    Enclosing(Enclosing),
    /// A state of a statechart.
    State(State),
    /// An instance of a library chart.
    Use(Use),
    /// A controlled action with a name of its own; without a statement list it only provides the latches of its qualifiers.
    Action(Action),
    /// The condition that forces all outputs to their safe values.
    Emergency(Emergency),
    /// A named property or assumption.
    Property(Property),
    /// A placement request for the partition.
    Place(Place),
    /// Pins and device.
    Board(Board),
}

impl Item {
    /// The setting, if it is one.
    #[must_use]
    pub fn as_setting(&self) -> Option<&Setting> {
        if let Item::Setting(setting) = self { Some(setting) } else { None }
    }

    /// The declaration, if it is one.
    #[must_use]
    pub fn as_declaration(&self) -> Option<&Declaration> {
        if let Item::Declaration(declaration) = self { Some(declaration) } else { None }
    }
}

/// A setting with its source location.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Setting {
    /// The setting and its value.
    pub kind: SettingKind,
    /// Source location.
    pub span: Span,
}

/// The settings of a chart; each is allowed once.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum SettingKind {
    /// `tick 10 ms`, in nanoseconds.
    Tick(u64),
    /// `conflict all`.
    Conflict(Policy),
    /// `evolution single`.
    EvolutionSingle,
    /// `evolution stable`, `evolution stable limit 20`.
    EvolutionStable(Option<u32>),
    /// `schedule level`.
    Schedule(Schedule),
    /// `fire one` (true) or `fire all` (false).
    FireOne(bool),
    /// `assign simultaneous` (true) or `assign ordered` (false).
    AssignSimultaneous(bool),
    /// `actions iec`.
    ActionsIec,
    /// `final scan`.
    FinalScan,
    /// `queue 4`.
    Queue(u32),
    /// `events exclusive`.
    EventsExclusive,
    /// `priority 2` of a partial chart.
    Priority(u32),
    /// `shared buffer`, for all variables of the file without a setting of their own; `shared buffer x, y` for these variables. The latter is allowed any
    /// number of times.
    Shared(Sharing, Vec<Path>),
}

/// A declaration.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Declaration {
    /// The name declared.
    pub name: Name,
    /// The kind of declaration, with its details.
    pub kind: DeclarationKind,
    /// Source location, comment and tags.
    pub meta: Meta,
}

/// Kinds of declarations.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum DeclarationKind {
    /// `input m`.
    Input {
        /// Boolean if not written.
        ty: Type,
        /// `synchronous`.
        synchronous: bool,
    },
    /// `output R`.
    Output {
        /// Boolean if not written.
        ty: Type,
        /// The value that a stored output has at reset, if written.
        init: Option<Expr>,
        /// `registered`.
        registered: bool,
        /// `mealy`.
        mealy: bool,
        /// `safe on`, `safe 3`: the value during an emergency and after a stop, if written.
        safe: Option<Expr>,
    },
    /// `var n: int 0..99 = 0`.
    Var {
        /// The type of the variable, or of each element of an array.
        ty: Type,
        /// Number of elements of an array.
        len: Option<u32>,
        /// Values at reset: empty (0, or the bound nearest to 0), one value for all elements, or one value for each element.
        init: Vec<Expr>,
    },
    /// `event E`.
    Event {
        /// True if only the chart raises the event.
        internal: bool,
    },
    /// `timer T while e`.
    Timer {
        /// The condition: T grows while it is true.
        condition: Expr,
    },
    /// `extern condition f()`.
    ExternCondition {
        /// Boolean if not written.
        ty: Type,
    },
    /// `extern action f(int 0..9)`.
    ExternAction {
        /// Names (may be empty) and types.
        params: Vec<(String, Type)>,
    },
    /// `const N = 5`: a name for a number or truth value.
    Const {
        /// The value, which is constant.
        value: Expr,
    },
}

/// A step.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Step {
    /// The name of the step, local to the body that contains it.
    pub name: Name,
    /// The role of the step: initial, entry, exit or final.
    pub role: StepRole,
    /// `*`: true if the enclosing step activates this step.
    pub activation_link: bool,
    /// `count 0..n`: the step stores a number of activations instead of one bit.
    pub count: Option<StepCount>,
    /// The items of the step's body, in order.
    pub body: Vec<StepItem>,
    /// Source location, comment and tags.
    pub meta: Meta,
}

/// The activation counter of a step, as in the paper on the Graphical FSM Editor (GFE).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StepCount {
    /// The largest number of activations; at least 1.
    pub max: u32,
    /// The number of activations at reset; `None` means 1 for an initial step, and 0 for any other step.
    pub initial: Option<u32>,
    /// Source location.
    pub span: Span,
}

/// `action count { n := n + 1 }`: a controlled action (semantics §3.5). Steps use it with qualifiers in the same way as an output; in conditions and
/// statement lists its name means its Q.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Action {
    /// The name of the action.
    pub name: Name,
    /// Runs once per reaction, at its end, while Q is true; empty for a Boolean memory.
    pub body: Block,
    /// Source location, comment and tags.
    pub meta: Meta,
}

/// The role of a step in its body.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum StepRole {
    /// A plain step.
    #[default]
    Plain,
    /// `initial step`.
    Initial,
    /// `entry step` of a macro-step.
    MacroEntry,
    /// `exit step` of a macro-step.
    MacroExit,
    /// Entry and exit step at once.
    MacroEntryExit,
    /// `final state`.
    Final,
}

/// One item of a step's body.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StepItem {
    /// The item itself.
    pub kind: StepItemKind,
    /// Source location.
    pub span: Span,
}

/// The items that are allowed in a step's body.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum StepItemKind {
    /// `R`, `R if c`, `R after 3 s`, `set R`, `R pulse`, `speed(5)`: an action on an output or extern action.
    Action {
        /// The output, controlled action or extern action.
        target: Name,
        /// Arguments of an extern action; `None` if no parentheses were written.
        arguments: Option<Vec<Expr>>,
        /// How the step uses the target.
        how: ActionHow,
        /// `if c`.
        condition: Option<Expr>,
    },
    /// `entry { .. }`.
    Entry(Block),
    /// `exit { .. }`.
    Exit(Block),
    /// `on E when c { .. }`: a reaction.
    On {
        /// The events, any of which triggers the reaction; empty for a condition alone.
        events: Vec<Name>,
        /// The condition.
        guard: Option<Expr>,
        /// The statements that the reaction runs.
        actions: Block,
    },
    /// `priority 3`.
    Priority(u32),
    /// `budget 200`.
    Budget(u32),
    /// `task ramp cost 80 { .. }`, or `task ramp { .. }`.
    Task {
        /// The name of the task.
        name: Name,
        /// The declared cost. Without one, the cost model of the selected machine supplies the cost.
        cost: Option<u32>,
        /// The statements of the task.
        body: Block,
    },
    /// `code c "..."`.
    Code(Verbatim),
    /// `force g { s3 }`.
    Force {
        /// The chart that is forced.
        target: Path,
        /// The situation that is forced.
        order: ForceOrder,
    },
}

impl StepItemKind {
    /// The statement list of an item that has one.
    #[must_use]
    pub fn list(&self) -> Option<&Block> {
        match self {
            StepItemKind::Entry(list)
            | StepItemKind::Exit(list)
            | StepItemKind::On { actions: list, .. }
            | StepItemKind::Task { body: list, .. } => Some(list),
            _ => None,
        }
    }
}

/// How a step uses an output.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ActionHow {
    /// No qualifier: continuous (or N).
    Bare,
    /// `after d` (continuous with `s.t >= d`, or D), in nanoseconds.
    After(u64),
    /// `for d` (continuous with `s.t < d`, or L), in nanoseconds.
    For(u64),
    /// An explicit qualifier: `set` is S, `reset` is R, `pulse` is P; the timed ones have a duration in nanoseconds.
    Qualified(Qualifier, Option<u64>),
}

/// A duration: a literal, or the name of a constant.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Length {
    /// A duration in nanoseconds.
    Ns(u64),
    /// The name of a constant.
    Named(Path),
}

/// The situation that a forcing order requests.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ForceOrder {
    /// `{ s1 s2 }`; empty is the empty situation.
    Situation(Vec<Path>),
    /// `init`.
    Init,
    /// `hold`.
    Hold,
}

/// A transition.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Transition {
    /// The name of the transition, if it has one.
    pub name: Option<Name>,
    /// Preceding steps; empty for a source transition.
    pub sources: Vec<Path>,
    /// Following steps; empty for a sink transition.
    pub targets: Vec<Path>,
    /// `on E`: the events, any of which triggers the transition.
    pub events: Vec<Name>,
    /// `when c`; `None` means `true`.
    pub guard: Option<Expr>,
    /// `after 3 s`, `after LIMIT`.
    pub after: Option<(Length, Span)>,
    /// `priority 2`.
    pub priority: Option<u32>,
    /// `-> sink`: the transition deliberately has no target. Only true for transitions without targets.
    pub is_sink: bool,
    /// `restart`.
    pub restart: bool,
    /// The transition does not leave its source. With targets (statecharts): its domain is the source itself if that is a composite state that contains
    /// all targets (semantics §3.9); otherwise it behaves like an external transition. Without targets, `in a on E do { .. }`: a reaction of the step,
    /// which consumes no activation.
    pub is_internal: bool,
    /// `deadline 1 us`, in nanoseconds.
    pub deadline_ns: Option<u64>,
    /// `do { .. }`.
    pub actions: Block,
    /// Source location, comment and tags.
    pub meta: Meta,
}

/// The body of a macro-step.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Macro {
    /// The name of the macro.
    pub name: Name,
    /// The items of the macro.
    pub items: Vec<Item>,
    /// Source location, comment and tags.
    pub meta: Meta,
}

/// A macro-step.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct MacroStep {
    /// The name of the macro-step.
    pub name: Name,
    /// The macro whose body replaces the macro-step.
    pub body: Name,
    /// The role of the macro-step. If the role is initial, the entry step of the macro-step is initial; if it is entry or exit of a macro, the entry or exit
    /// step of the macro-step has that role.
    pub role: StepRole,
    /// `priority 3`.
    pub priority: Option<u32>,
    /// Source location, comment and tags.
    pub meta: Meta,
}

/// An enclosing step: a step and the charts it encloses.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Enclosing {
    /// The step itself.
    pub step: Step,
    /// The charts that it encloses.
    pub items: Vec<Item>,
}

/// A state of a statechart, with its children.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct State {
    /// Name, role and body of the state itself.
    pub step: Step,
    /// True for `parallel`: each child is a region.
    pub is_parallel: bool,
    /// The initial child and the statements of the initial transition; `None` means the first child.
    pub initial: Option<(Vec<Path>, Block)>,
    /// The histories that are declared in the state.
    pub histories: Vec<History>,
    /// Children and transitions.
    pub items: Vec<Item>,
}

/// A history pseudo-state.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct History {
    /// The name of the history.
    pub name: Name,
    /// True if the history records atomic descendants, false if it records children.
    pub is_deep: bool,
    /// The targets of the default transition.
    pub default: Vec<Path>,
    /// The statements of the default transition.
    pub content: Block,
    /// Source location, comment and tags.
    pub meta: Meta,
}

/// `assume never (..)` and `assert never (..)`; also with `always`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Property {
    /// The name of the property, if it has one.
    pub name: Option<Name>,
    /// True for `assume`.
    pub is_assumption: bool,
    /// True for `never`, false for `always`.
    pub is_never: bool,
    /// The condition.
    pub expr: Expr,
    /// Source location, comment and tags.
    pub meta: Meta,
}

/// `emergency stop or not guard`: while the condition is true, all outputs have their safe values (semantics §3.8).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Emergency {
    /// The condition, over inputs, steps, variables and times.
    pub condition: Expr,
    /// Source location, comment and tags.
    pub meta: Meta,
}

/// A placement request: `place p2, p3 on chip`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place {
    /// The items to place.
    pub items: Vec<Path>,
    /// The name of the part of a split to place them on.
    pub part: Name,
    /// Source location.
    pub span: Span,
}

/// The pins of a device: `device gal22v10 { clock 1  m 2 }`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Board {
    /// The device's name.
    pub device: Name,
    /// Signals and pin numbers.
    pub pins: Vec<(Name, u32)>,
    /// Source location.
    pub span: Span,
}

/// A name with dots: `m1.s3`.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Path {
    /// The names between the dots; at least one.
    pub names: Vec<Name>,
}

impl Expr {
    /// The same expression without source locations, including those of the names in its leaves: two uses of the same condition become equal.
    #[must_use]
    pub fn unplaced(&self) -> Expr {
        self.map_leaves(&Leaf::unplaced).without_spans()
    }
}

impl Leaf {
    fn unplaced(&self) -> Leaf {
        match self {
            Leaf::Name(path) => {
                let names = path.names.iter();
                let bare = names.map(|name| Name::new(name.text.clone(), Span::default()));
                Leaf::Name(Path { names: bare.collect() })
            }
            Leaf::Rise(inner) => Leaf::Rise(Box::new(inner.unplaced())),
            Leaf::Fall(inner) => Leaf::Fall(Box::new(inner.unplaced())),
            Leaf::Otherwise => Leaf::Otherwise,
            Leaf::Duration(ns) => Leaf::Duration(*ns),
            Leaf::Delay(on, inner, off) => Leaf::Delay(*on, Box::new(inner.unplaced()), *off),
        }
    }
}

impl Path {
    /// The span from the first name to the last.
    #[must_use]
    pub fn span(&self) -> Span {
        match (self.names.first(), self.names.last()) {
            (Some(first), Some(last)) => first.span.to(last.span),
            _ => Span::default(),
        }
    }
}

impl From<Name> for Path {
    fn from(name: Name) -> Self {
        Path { names: vec![name] }
    }
}

impl std::fmt::Display for Path {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        for (index, name) in self.names.iter().enumerate() {
            if index > 0 {
                f.write_str(".")?;
            }
            f.write_str(&name.text)?;
        }
        Ok(())
    }
}

/// A value that an expression of a chart can read.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Leaf {
    /// An input, output, variable, constant, timer, event or extern condition (with or without parentheses). A path that ends in `active`, `t`, `T` or
    /// `done` reads this property of the step named before it.
    Name(Path),
    /// `rise(e)`.
    Rise(Box<Expr>),
    /// `fall(e)`.
    Fall(Box<Expr>),
    /// `otherwise`.
    Otherwise,
    /// `3 s`, in nanoseconds; can only be compared with a timer.
    Duration(u64),
    /// `t1/E/t2` of IEC 60848: on-delay and off-delay in nanoseconds.
    Delay(u64, Box<Expr>, u64),
}

/// A list of statements.
pub type Block = Vec<Stmt>;

/// A statement with its source location.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Stmt {
    /// The statement itself.
    pub kind: StmtKind,
    /// Source location.
    pub span: Span,
}

/// The kinds of statements.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum StmtKind {
    /// `n := n + 1`, `v[i] := 0`.
    Assign {
        /// The variable or stored output.
        target: Path,
        /// The index of the element, if the target is an array.
        index: Option<Expr>,
        /// The new value.
        value: Expr,
    },
    /// `raise e`.
    Raise(Name),
    /// `send e after 2 s as x`.
    Send {
        /// The event.
        event: Name,
        /// The delay in nanoseconds.
        after: Option<u64>,
        /// The slot's name.
        slot: Option<Name>,
    },
    /// `cancel x`.
    Cancel(Name),
    /// `call f(..)`.
    Call {
        /// The extern action.
        function: Name,
        /// The arguments of the call.
        arguments: Vec<Expr>,
    },
    /// `if c { .. } else { .. }`.
    If {
        /// The condition.
        condition: Expr,
        /// The statements that run if the condition is true.
        then: Block,
        /// The statements that run if the condition is false.
        otherwise: Block,
    },
    /// `code c "..."`.
    Code(Verbatim),
}

impl Stmt {
    /// The expressions that the statement itself evaluates, in this order; those of its lists are not included.
    pub fn exprs(&self) -> impl Iterator<Item = &Expr> {
        let (few, many): ([Option<&Expr>; 2], &[Expr]) = match &self.kind {
            StmtKind::Assign { index, value, .. } => ([index.as_ref(), Some(value)], &[]),
            StmtKind::Call { arguments, .. } => ([None; 2], arguments),
            StmtKind::If { condition, .. } => ([Some(condition), None], &[]),
            StmtKind::Raise(_)
            | StmtKind::Send { .. }
            | StmtKind::Cancel(_)
            | StmtKind::Code(_) => ([None; 2], &[]),
        };
        few.into_iter().flatten().chain(many)
    }

    /// Both branches of a choice; empty for any other statement.
    #[must_use]
    pub fn lists(&self) -> [&[Stmt]; 2] {
        if let StmtKind::If { then, otherwise, .. } = &self.kind {
            [then, otherwise]
        } else {
            [&[]; 2]
        }
    }
}

/// All statements of a list in the order of the text, each before those inside it.
pub fn statements(list: &[Stmt]) -> impl Iterator<Item = &Stmt> {
    crate::walk::nested(list, Stmt::lists)
}
