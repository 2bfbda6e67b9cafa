//! What the passes of the lowering share: the net as far as it is built, the scopes of names, and the findings.

use super::expand::Work;
use super::inner_history::Inner;
use super::libraries::Bound;
use super::roles::{Role, Use};
use super::statechart::{Goal, Tree};
use super::task_costs::TaskCosts;
use crate::chart::{self, Design};
use crate::diag::Diagnostic;
use crate::expr::Expr;
use crate::net::{
    ActionId, EdgeId, HistoryId, InputId, Leaf, Net, OutputId, PartId, SendId, Sharing, StepId,
    TimerId, TransitionId, VarId,
};
use crate::span::{Name, Span};
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

/// Says that a diagnostic was given; whoever holds one goes on with the next item.
#[derive(Debug, Clone, Copy)]
pub(super) struct Reported(());

impl Reported {
    /// What stands behind was told where it was declared.
    pub(super) fn already() -> Self {
        Reported(())
    }
}

/// A result whose error was already told to the user.
pub(super) type Outcome<T> = Result<T, Reported>;

/// How many errors, and how many warnings, are kept: more than anybody reads, and few enough for a broken file of any size.
const MAX_FINDINGS: usize = 20_000;

/// See [`Lowering::max_objects`].
const MAX_OBJECTS: usize = 300_000;

/// The findings so far, each once: a macro that is expanded ten times has its mistakes told once.
#[derive(Debug, Default)]
pub(super) struct Findings {
    pub(super) list: Vec<Diagnostic>,
    seen: BTreeSet<(&'static str, Option<Span>, String)>,
    n_errors: usize,
    n_others: usize,
}

impl Findings {
    pub(super) fn add(&mut self, diagnostic: Diagnostic) -> Reported {
        let count = if diagnostic.is_error() { &mut self.n_errors } else { &mut self.n_others };
        if *count < MAX_FINDINGS {
            let place = diagnostic.labels.first().map(|label| label.span);
            if self.seen.insert((diagnostic.code.id, place, diagnostic.message.clone())) {
                *count += 1;
                self.list.push(diagnostic);
            }
        }
        Reported(())
    }
}

/// Names one of [`Lowering::scopes`].
pub(super) type ScopeId = usize;
/// Names one of [`Lowering::macros`].
pub(super) type MacroId = usize;
/// Names one of [`Lowering::instances`].
pub(super) type InstanceId = usize;

/// A body in which names are declared: a chart, an expansion of a macro, an enclosure, a state.
#[derive(Debug)]
pub(super) struct Scope<'a> {
    /// Where a name is looked for next; for an expansion the body in which the macro was drawn, not the one that uses it.
    pub(super) parent: Option<ScopeId>,
    /// What stands before a local name in its full name.
    pub(super) prefix: String,
    /// What is declared here.
    pub(super) names: BTreeMap<&'a str, Entry>,
    /// The partial chart that its steps and transitions belong to.
    pub(super) part: PartId,
    /// The body whose names it shares: enclosures and states share those of the chart or expansion around them (semantics C25); else itself.
    pub(super) home: ScopeId,
    /// The innermost enclosing step or state.
    pub(super) inside: Option<StepId>,
    /// The chart, as an index into [`Design::charts`].
    pub(super) chart: usize,
    /// The top of an instance of a library chart.
    pub(super) is_instance: bool,
}

/// A declared name.
#[derive(Debug, Clone, Copy)]
pub(super) struct Entry {
    pub(super) symbol: Symbol,
    /// Where it was declared.
    pub(super) span: Span,
    /// The body in which it stands, for findings.
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

/// What a name stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Symbol {
    Const(Value),
    Input(InputId),
    Output(OutputId),
    /// A controlled action of its own, as an index into [`Lowering::drawn_actions`].
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
    /// A parameter of a library chart for which an expression stands.
    Alias(usize),
    /// Its declaration was refused; uses of it are not reported again.
    Broken,
}

/// A macro as drawn, in one of the bodies that see it.
#[derive(Debug, Clone, Copy)]
pub(super) struct MacroDefinition<'a> {
    pub(super) source: &'a chart::Macro,
    pub(super) scope: ScopeId,
    pub(super) is_used: bool,
}

/// A controlled action that was drawn as such, not as an output.
#[derive(Debug, Clone)]
pub(super) struct DrawnAction<'a> {
    /// Its full name.
    pub(super) name: Name,
    /// In the net; made by `roles`, so that all controlled actions stand in the order of their declarations.
    pub(super) id: Option<ActionId>,
    /// How step bodies use it.
    pub(super) uses: Vec<Use<'a>>,
}

/// What stands for a parameter in one instance of a library chart. Names in it are those of the body that it was written in.
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
    /// Made at its first mention.
    pub(super) id: Option<SendId>,
}

/// One expansion of a macro.
#[derive(Debug)]
pub(super) struct Instance {
    pub(super) scope: ScopeId,
    pub(super) entry: Option<StepId>,
    pub(super) exit: Option<StepId>,
    /// All steps of the expansion, nested ones included: they stand together.
    pub(super) steps: Range<usize>,
    /// The timer of `m.t`, made at its first use.
    pub(super) timer: Option<TimerId>,
}

/// The names of a finished net. A step may be called like a signal.
#[derive(Debug, Default)]
pub(super) struct FlatNames {
    /// Steps and macro-steps.
    pub(super) steps: BTreeMap<String, Symbol>,
    /// Everything else.
    pub(super) others: BTreeMap<String, Symbol>,
}

/// The state of a lowering; each pass takes it, adds its share to `net`, and hands it on.
#[derive(Debug)]
pub(super) struct Lowering<'a> {
    pub(super) design: &'a Design,
    /// What tasks cost that declare none.
    pub(super) costs: TaskCosts,
    /// Tasks that declare no cost.
    pub(super) undeclared: BTreeSet<Span>,
    pub(super) net: Net,
    pub(super) found: Findings,
    pub(super) scopes: Vec<Scope<'a>>,
    /// Charts by name.
    pub(super) charts: BTreeMap<&'a str, ScopeId>,
    /// Per chart: its scope and its partial charts, which stand together.
    pub(super) chart_bodies: Vec<(ScopeId, Range<usize>)>,
    /// Per chart: says `actions iec`.
    pub(super) iec: Vec<bool>,
    /// The scope inside an enclosing step or a state.
    pub(super) bodies: BTreeMap<StepId, ScopeId>,
    pub(super) macros: Vec<MacroDefinition<'a>>,
    pub(super) instances: Vec<Instance>,
    /// Parameters of instances of library charts.
    pub(super) aliases: Vec<Alias<'a>>,
    /// The variables of counted steps.
    pub(super) counted: BTreeMap<StepId, VarId>,
    /// Arguments to be looked at when all names are known.
    pub(super) bound: Vec<Bound<'a>>,
    /// How many library charts were expanded.
    pub(super) n_instances: usize,
    /// Aliases whose expressions are being lowered, the innermost last.
    pub(super) open_aliases: Vec<usize>,
    /// How often the expressions of aliases were lowered.
    pub(super) alias_mentions: usize,
    /// How many aliases are being followed: one that leads back to itself ends there.
    pub(super) following: std::cell::Cell<u32>,
    /// The library charts that something uses, by their places in the design.
    pub(super) used_libraries: BTreeSet<usize>,
    /// Names that several states of one body have histories of.
    pub(super) shared_histories: BTreeSet<(ScopeId, &'a str)>,
    /// Expands macros that nothing uses, to find the mistakes in them.
    pub(super) expand_unused: bool,
    /// Everything with an inside, in declaration order.
    pub(super) work: Vec<Work<'a>>,
    /// Full names given so far.
    pub(super) taken: BTreeSet<String>,
    /// For bases that several made names share: the next number to try.
    pub(super) next_suffix: BTreeMap<String, u32>,
    /// Per output, how step bodies use it.
    pub(super) uses: Vec<Vec<Use<'a>>>,
    /// Per output.
    pub(super) roles: Vec<Role>,
    pub(super) drawn_actions: Vec<DrawnAction<'a>>,
    /// Operands of edges by shape.
    pub(super) edges: BTreeMap<Expr<Leaf>, EdgeId>,
    /// `t1/E/t2` by durations in ticks and shape of E.
    pub(super) delays: BTreeMap<(u32, Expr<Leaf>, u32), Expr<Leaf>>,
    /// Named send slots, by body and name: where they stand in `slot_list`.
    pub(super) slots: BTreeMap<(ScopeId, &'a str), usize>,
    pub(super) slot_list: Vec<Slot>,
    /// Per step, transitions declared so far that leave it.
    pub(super) leaving: Vec<Vec<TransitionId>>,
    /// How many mentions `otherwise` was turned into.
    pub(super) otherwise_mentions: usize,
    /// How many steps and transitions expansions may bring the net to.
    pub(super) max_objects: usize,
    /// Candidates looked at for name suggestions.
    pub(super) suggestions: usize,
    /// The steps that the transition leaves whose receptivity is read: what a message names first.
    pub(super) left: Vec<StepId>,
    /// The states of statecharts.
    pub(super) tree: Tree,
    /// Per controlled action, the actions that keep its further durations.
    pub(super) more_timers: BTreeMap<ActionId, Vec<(u64, ActionId)>>,
    /// Transitions to histories of states around their source.
    pub(super) inner_histories: Vec<Inner>,
    /// Where the default transitions of histories lead.
    pub(super) history_goals: BTreeMap<HistoryId, Vec<Goal>>,
    /// Names with dots of a finished net; used instead of scopes when properties are added to one.
    pub(super) flat: Option<FlatNames>,
    /// What the file says of shared variables that nothing else is said of.
    pub(super) sharing: Option<Sharing>,
    /// Steps with tasks: `s.done` asks for them before they are lowered.
    pub(super) tasked: BTreeSet<StepId>,
    /// How many expressions lie around the present one.
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

    pub(super) fn report(&mut self, diagnostic: Diagnostic) -> Reported {
        self.found.add(diagnostic)
    }

    /// A full name that nothing has yet, made of `base`: itself, or with the first free number behind it.
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
