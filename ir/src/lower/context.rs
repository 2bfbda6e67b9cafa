//! State that the passes of the lowering share: the unfinished net, the scopes of names, and the findings.

use super::task_costs::TaskCosts;
use crate::chart::{self, Design};
use crate::diag::{Diagnostic, ErrorReported};
use crate::expr::Expr;
use crate::net::{
    ActionId, EdgeId, HistoryId, InputId, Leaf, Net, OutputId, PartId, SendId, Sharing, StepId,
    TimerId, TransitionId, VarId,
};
use crate::span::{Name, Span};
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

/// A result whose error was already reported to the user.
pub(super) type Outcome<T> = Result<T, ErrorReported>;

/// The maximum number of errors, and of warnings, that are kept: more than anybody reads, and small enough for a broken file of any size.
const MAX_FINDINGS: usize = 20_000;

/// See [`Lowering::max_objects`].
const MAX_OBJECTS: usize = 300_000;

/// The findings so far, without duplicates: an error in a macro that is expanded ten times is reported once.
#[derive(Debug, Default)]
pub(super) struct Findings {
    pub(super) list: Vec<Diagnostic>,
    seen: BTreeSet<(&'static str, Option<Span>, String)>,
    n_errors: usize,
    n_others: usize,
}

impl Findings {
    pub(super) fn add(&mut self, diagnostic: Diagnostic) -> ErrorReported {
        let count = if diagnostic.is_error() { &mut self.n_errors } else { &mut self.n_others };
        if *count < MAX_FINDINGS {
            let place = diagnostic.labels.first().map(|label| label.span);
            if self.seen.insert((diagnostic.code.id, place, diagnostic.message.clone())) {
                *count += 1;
                self.list.push(diagnostic);
            }
        }
        ErrorReported
    }
}

/// Identifies one of [`Lowering::scopes`].
pub(super) type ScopeId = usize;
/// Identifies one of [`Lowering::macros`].
pub(super) type MacroId = usize;
/// Identifies one of [`Lowering::instances`].
pub(super) type InstanceId = usize;

/// A body in which names are declared: a chart, an expansion of a macro, an enclosure, a state.
#[derive(Debug)]
pub(super) struct Scope<'a> {
    /// The scope that is searched next; for an expansion, the body that declares the macro, not the one that uses it.
    pub(super) parent: Option<ScopeId>,
    /// The prefix that makes a local name a full name.
    pub(super) prefix: String,
    /// The names declared here.
    pub(super) names: BTreeMap<&'a str, Entry>,
    /// The partial chart that the steps and transitions of the body belong to.
    pub(super) part: PartId,
    /// The body whose names this body shares: enclosures and states share the names of the surrounding chart or expansion (semantics C25); any other body is
    /// its own home.
    pub(super) home: ScopeId,
    /// The innermost enclosing step or state.
    pub(super) inside: Option<StepId>,
    /// The chart, as an index into [`Design::charts`].
    pub(super) chart: usize,
    /// True for the outermost scope of an instance of a library chart.
    pub(super) is_instance: bool,
}

/// A declared name.
#[derive(Debug, Clone, Copy)]
pub(super) struct Entry {
    pub(super) symbol: Symbol,
    /// Source location of the declaration.
    pub(super) span: Span,
    /// The body that contains the declaration, for findings.
    pub(super) body: ScopeId,
}

/// A constant's value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Value {
    Bool(bool),
    Int(i64),
    /// Nanoseconds.
    Duration(u64),
}

/// The object that a name refers to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Symbol {
    Const(Value),
    Input(InputId),
    Output(OutputId),
    /// A controlled action with its own declaration, as an index into [`Lowering::drawn_actions`].
    Action(usize),
    Var(VarId),
    Timer(TimerId),
    Step(StepId),
    MacroStep(InstanceId),
    Macro(MacroId),
    Transition(TransitionId),
    /// A chart, or an instance of a library chart.
    Chart(ScopeId),
    History(HistoryId),
    /// A parameter of a library chart whose argument is an expression.
    Alias(usize),
    /// A name whose declaration was rejected; uses of the name are not reported again.
    Broken,
}

/// A macro as drawn, in one of the bodies where it is visible.
#[derive(Debug, Clone, Copy)]
pub(super) struct MacroDefinition<'a> {
    pub(super) source: &'a chart::Macro,
    pub(super) scope: ScopeId,
    pub(super) is_used: bool,
}

/// A controlled action with its own declaration (not an output).
#[derive(Debug, Clone)]
pub(super) struct DrawnAction<'a> {
    /// The full name of the action.
    pub(super) name: Name,
    /// The id of the action in the net. Pass `roles` creates it, so that all controlled actions are in the order of their declarations.
    pub(super) id: Option<ActionId>,
    /// The uses of the action in step bodies.
    pub(super) uses: Vec<Use<'a>>,
}

/// The argument for a parameter in one instance of a library chart. Its names are resolved in the body that contains the `use`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Alias<'a> {
    pub(super) scope: ScopeId,
    pub(super) value: AliasValue<'a>,
}

/// See [`Alias`].
#[derive(Debug, Clone, Copy)]
pub(super) enum AliasValue<'a> {
    Expr(&'a chart::Expr),
    Path(&'a chart::Path),
}

/// A send slot that has a name.
#[derive(Debug, Clone, Copy)]
pub(super) struct Slot {
    pub(super) event: InputId,
    pub(super) delay: u32,
    pub(super) span: Span,
    /// The id of the slot, which is created at its first use.
    pub(super) id: Option<SendId>,
}

/// One expansion of a macro.
#[derive(Debug)]
pub(super) struct Instance {
    pub(super) scope: ScopeId,
    pub(super) entry: Option<StepId>,
    pub(super) exit: Option<StepId>,
    /// All steps of the expansion, including nested ones: they are consecutive.
    pub(super) steps: Range<usize>,
    /// The timer of `m.t`, created at its first use.
    pub(super) timer: Option<TimerId>,
}

/// An object whose contents a later pass lowers.
#[derive(Debug, Clone, Copy)]
pub(super) enum Work<'a> {
    Declaration { scope: ScopeId, source: &'a chart::Declaration, symbol: Symbol },
    Step { scope: ScopeId, id: StepId, source: &'a chart::Step },
    State { scope: ScopeId, id: StepId, source: &'a chart::State },
    Reaction { scope: ScopeId, id: TransitionId, step: StepId, source: &'a chart::StepItem },
    Transition { scope: ScopeId, id: TransitionId, source: &'a chart::Transition },
    Action { scope: ScopeId, action: usize, source: &'a chart::Action },
    Emergency { scope: ScopeId, source: &'a chart::Emergency },
    Property { scope: ScopeId, source: &'a chart::Property },
    Place { scope: ScopeId, source: &'a chart::Place },
    Board { scope: ScopeId, source: &'a chart::Board },
    Shared { scope: ScopeId, sharing: Sharing, names: &'a [chart::Path] },
}

/// The kind of driver of an output.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Role {
    Continuous,
    Mealy,
    Stored(VarId),
    Controlled(ActionId),
    Extern,
    /// The declaration of the output, or a use of it, was rejected.
    Broken,
}

/// One step's use of an output or extern action.
#[derive(Debug, Clone, Copy)]
pub(super) struct Use<'a> {
    pub(super) step: StepId,
    pub(super) scope: ScopeId,
    pub(super) how: chart::ActionHow,
    pub(super) condition: Option<&'a chart::Expr>,
    pub(super) arguments: Option<&'a [chart::Expr]>,
    pub(super) span: Span,
}

/// A parameter and its argument in a `use`, to check when all names are known.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bound<'a> {
    pub(super) parameter: &'a chart::Parameter,
    pub(super) value: &'a chart::ArgumentValue,
    /// The scope of the `use`.
    pub(super) scope: ScopeId,
}

/// The states of all charts as a forest. A state comes directly before its descendants, so these are a range of steps.
#[derive(Debug, Default)]
pub(super) struct Tree {
    /// Per step, its children in document order.
    pub(super) children: Vec<Vec<StepId>>,
    /// Per part, its outermost states.
    pub(super) roots: Vec<Vec<StepId>>,
    /// Per step, one past its last descendant.
    pub(super) end: Vec<usize>,
    /// Per composite state, the targets of its initial transition and whether that has statements.
    pub(super) initial: BTreeMap<StepId, (Vec<Goal>, bool)>,
    /// Children that are marked as initial.
    pub(super) marked: BTreeSet<StepId>,
}

/// A target of a transition.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Goal {
    State(StepId),
    History(HistoryId),
}

/// A transition to a history of a state that contains its source.
#[derive(Debug, Clone, Copy)]
pub(super) struct Inner {
    pub(super) transition: TransitionId,
    pub(super) history: HistoryId,
    pub(super) is_internal: bool,
}

/// The names of a finished net. A step may have the same name as a signal.
#[derive(Debug, Default)]
pub(super) struct FlatNames {
    /// Steps and macro-steps.
    pub(super) steps: BTreeMap<String, Symbol>,
    /// Everything else.
    pub(super) others: BTreeMap<String, Symbol>,
}

/// The state of a lowering; each pass adds its part to `net`.
#[derive(Debug)]
pub(super) struct Lowering<'a> {
    pub(super) design: &'a Design,
    /// The costs of tasks that declare no cost.
    pub(super) costs: TaskCosts,
    /// The locations of tasks that declare no cost.
    pub(super) undeclared: BTreeSet<Span>,
    pub(super) net: Net,
    pub(super) found: Findings,
    pub(super) scopes: Vec<Scope<'a>>,
    /// Charts by name.
    pub(super) charts: BTreeMap<&'a str, ScopeId>,
    /// Per chart: its scope and its partial charts, which are consecutive.
    pub(super) chart_bodies: Vec<(ScopeId, Range<usize>)>,
    /// Per chart: true if it contains `actions iec`.
    pub(super) iec: Vec<bool>,
    /// Per enclosing step or state, the scope inside it.
    pub(super) bodies: BTreeMap<StepId, ScopeId>,
    pub(super) macros: Vec<MacroDefinition<'a>>,
    pub(super) instances: Vec<Instance>,
    /// Parameters of instances of library charts.
    pub(super) aliases: Vec<Alias<'a>>,
    /// The variables of counted steps.
    pub(super) counted: BTreeMap<StepId, VarId>,
    /// Arguments to check when all names are known.
    pub(super) bound: Vec<Bound<'a>>,
    /// Number of library charts expanded so far.
    pub(super) n_instances: usize,
    /// Aliases whose expressions are being lowered, innermost last.
    pub(super) open_aliases: Vec<usize>,
    /// Number of times that an alias expression was lowered.
    pub(super) alias_mentions: usize,
    /// Number of aliases being followed; it stops an alias that refers to itself.
    pub(super) following: std::cell::Cell<u32>,
    /// The library charts in use, as indices into the design's list.
    pub(super) used_libraries: BTreeSet<usize>,
    /// Names of histories that occur in several states of one body.
    pub(super) shared_histories: BTreeSet<(ScopeId, &'a str)>,
    /// True if unused macros are expanded too, to find the errors in them.
    pub(super) expand_unused: bool,
    /// All objects whose contents later passes lower, in declaration order.
    pub(super) work: Vec<Work<'a>>,
    /// Full names assigned so far.
    pub(super) taken: BTreeSet<String>,
    /// Per base of generated names: the next number to try.
    pub(super) next_suffix: BTreeMap<String, u32>,
    /// Per output: its uses in step bodies.
    pub(super) uses: Vec<Vec<Use<'a>>>,
    /// The role of each output.
    pub(super) roles: Vec<Role>,
    pub(super) drawn_actions: Vec<DrawnAction<'a>>,
    /// Operands of edges by shape.
    pub(super) edges: BTreeMap<Expr<Leaf>, EdgeId>,
    /// The expressions for delays `t1/E/t2`, by both durations in ticks and the shape of E.
    pub(super) delays: BTreeMap<(u32, Expr<Leaf>, u32), Expr<Leaf>>,
    /// Named send slots, by body and name, as indices into `slot_list`.
    pub(super) slots: BTreeMap<(ScopeId, &'a str), usize>,
    pub(super) slot_list: Vec<Slot>,
    /// Per step, transitions declared so far that leave it.
    pub(super) leaving: Vec<Vec<TransitionId>>,
    /// Number of transitions that all `otherwise` together refer to.
    pub(super) otherwise_mentions: usize,
    /// Limit of steps and transitions that expansions may create.
    pub(super) max_objects: usize,
    /// Number of candidates examined for name suggestions.
    pub(super) suggestions: usize,
    /// The keyword that would declare the name being looked up, such as `input`: messages about unknown names suggest such a declaration.
    pub(super) wanted: &'static str,
    /// The source steps of the transition whose receptivity is being lowered: messages suggest them first.
    pub(super) left: Vec<StepId>,
    /// The states of statecharts.
    pub(super) tree: Tree,
    /// Per controlled action, the additional actions for its other durations.
    pub(super) more_timers: BTreeMap<ActionId, Vec<(u64, ActionId)>>,
    /// Transitions to histories of states that enclose their source.
    pub(super) inner_histories: Vec<Inner>,
    /// The targets of the default transitions of histories.
    pub(super) history_goals: BTreeMap<HistoryId, Vec<Goal>>,
    /// Full names of a finished net; used instead of scopes when properties are added to it.
    pub(super) flat: Option<FlatNames>,
    /// The file's sharing setting for variables without a setting of their own.
    pub(super) sharing: Option<Sharing>,
    /// Steps with tasks: `s.done` needs them before tasks are lowered.
    pub(super) tasked: BTreeSet<StepId>,
    /// The nesting depth of the current expression.
    pub(super) expression_depth: usize,
}

impl<'a> Lowering<'a> {
    pub(super) fn new(design: &'a Design) -> Self {
        Lowering {
            design,
            costs: TaskCosts::default(),
            undeclared: BTreeSet::new(),
            net: Net::default(),
            found: Findings::default(),
            scopes: Vec::new(),
            charts: BTreeMap::new(),
            chart_bodies: Vec::new(),
            iec: Vec::new(),
            bodies: BTreeMap::new(),
            macros: Vec::new(),
            instances: Vec::new(),
            shared_histories: BTreeSet::new(),
            aliases: Vec::new(),
            counted: BTreeMap::new(),
            bound: Vec::new(),
            n_instances: 0,
            open_aliases: Vec::new(),
            alias_mentions: 0,
            following: std::cell::Cell::new(0),
            used_libraries: BTreeSet::new(),
            expand_unused: false,
            work: Vec::new(),
            taken: BTreeSet::new(),
            next_suffix: BTreeMap::new(),
            uses: Vec::new(),
            roles: Vec::new(),
            drawn_actions: Vec::new(),
            edges: BTreeMap::new(),
            delays: BTreeMap::new(),
            slots: BTreeMap::new(),
            slot_list: Vec::new(),
            leaving: Vec::new(),
            otherwise_mentions: 0,
            max_objects: MAX_OBJECTS,
            suggestions: 0,
            wanted: "input",
            left: Vec::new(),
            flat: None,
            tree: Tree::default(),
            more_timers: BTreeMap::new(),
            inner_histories: Vec::new(),
            history_goals: BTreeMap::new(),
            tasked: BTreeSet::new(),
            sharing: None,
            expression_depth: 0,
        }
    }

    pub(super) fn report(&mut self, diagnostic: Diagnostic) -> ErrorReported {
        self.found.add(diagnostic)
    }

    /// A full name that is not in use yet: `base` itself, or `base` with the first free number.
    pub(super) fn fresh_name(&mut self, base: &str) -> String {
        if self.taken.insert(base.to_owned()) {
            return base.to_owned();
        }
        let next = self.next_suffix.entry(base.to_owned()).or_insert(2);
        loop {
            let name = format!("{base}_{next}");
            *next += 1;
            if self.taken.insert(name.clone()) {
                return name;
            }
        }
    }

    pub(super) fn is_statechart(&self) -> bool {
        self.net.settings.policy.is_statechart()
    }
}
