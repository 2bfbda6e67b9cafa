//! The reaction of a statechart in pieces, for code that organises the evolution itself.
//!
//! [`super::program`] writes every choice and every step bit as straight-line code. A back end that keeps one state variable for each region and branches on it
//! needs the same lists, receptivities, queues and ends of reactions, but not that code: this module provides the pieces, made by the same builder.
//!
//! ```text
//! before
//! repeat while again
//!     check                            named receptivities, present values of edges
//!     choose by `guard`, inner-first or outer-first (§4)
//!     nothing chosen:                  idle        the next event, or the end
//!     something chosen, and is_full:   too_long    fault
//!     something chosen:                exits (states.exit), transitions.actions, entries (states.entry, initial_content, default_content);  fired
//!     chosen, or not again:            renew
//! after
//! ```
//!
//! Receptivities are read before anything changes. The lists read the bits of [`StatePieces::is_watched`] states while these change; the exit and entry
//! lists store them. The caller keeps all other bits. They are read in `before`, `check`, `fired` and `after`, where nothing changes, and in the lists of
//! final states that complete a parallel state ([`StatePieces::completes`]): in these lists, a state that has been left reads false, and so does a state
//! that has not been entered yet.

use super::queues::External;
use super::statechart::Rounds;
use super::tree::Tree;
use super::{Additions, Builder, ProgramOptions, temp};
use crate::arena::IdMap;
use crate::diag::Diagnostic;
use crate::expr::{CompareOp, ExprKind};
use crate::instance::Carried;
use crate::net::{History, InputId, InputKind, Leaf as NetLeaf, Net, Step, StepKind, Transition};
use crate::program::{CellId, Expr, Leaf, Program, Stmt, TempId, TempRole};
use crate::simplify::simplify;
use crate::validate::Valid;

/// The pieces of a statechart's reaction. Cells and temporaries belong to `program`, whose body is empty.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pieces {
    /// Cells with their values after reset, temporaries, and the visible results of the reset.
    pub program: Program,
    /// Everything before the evolution: timers advance, events are queued, `count`, `again` and `event` get their first values.
    pub before: Vec<Stmt>,
    /// Statements at the start of each check.
    pub check: Vec<Stmt>,
    /// Statements after a micro-step.
    pub fired: Vec<Stmt>,
    /// Statements that run instead of a micro-step beyond the limit.
    pub too_long: Vec<Stmt>,
    /// Statements that run after a check that chooses nothing.
    pub idle: Vec<Stmt>,
    /// Statements after a micro-step, and after the last check.
    pub renew: Vec<Stmt>,
    /// Statements after the evolution: the end of the reaction.
    pub after: Vec<Stmt>,
    /// True while checks continue.
    pub again: Expr,
    /// True if no further micro-step is allowed.
    pub is_full: Expr,
    /// The number of the current event, 0 for none; `None` if the net has no events.
    pub event: Option<TempId>,
    /// The events by number, from 1.
    pub events: Vec<InputId>,
    /// A bound on the number of checks.
    pub rounds: u32,
    /// The cell of each step's bit.
    pub bits: IdMap<Step, CellId>,
    /// The lists of each state.
    pub states: IdMap<Step, StatePieces>,
    /// The receptivity and actions of each transition.
    pub transitions: IdMap<Transition, TransitionPieces>,
    /// Content of the default transition of each history.
    pub default_content: IdMap<History, Vec<Stmt>>,
    /// For each history, its cells, one per recorded state.
    pub recorded: IdMap<History, Vec<CellId>>,
    /// The temporaries whose values at the end of a check are read later.
    pub carried: Vec<(TempId, Carried)>,
}

/// The lists of a state.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct StatePieces {
    /// The statements that run when the state is left.
    pub exit: Vec<Stmt>,
    /// The statements that run when the state is entered.
    pub entry: Vec<Stmt>,
    /// The statements that run after `entry` when the state is entered by default.
    pub initial_content: Vec<Stmt>,
    /// The statements that run last: they raise the done events of a final state, or end its chart.
    pub finish: Vec<Stmt>,
    /// True if some list reads the state's bit in a micro-step that changes it: `exit` and `entry` then store the bit.
    pub is_watched: bool,
    /// True for a final state that completes a parallel state, if a list reads the bit of the final state.
    pub completes: bool,
}

/// The receptivity and actions of a transition.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TransitionPieces {
    /// Its receptivity without its events, true only while its chart is running. If `is_named`, the complete fireable condition: source, event and
    /// receptivity.
    pub guard: Expr,
    /// True if `check` evaluates the guard, because something else reads it or because it calls a function.
    pub is_named: bool,
    /// The actions of the transition.
    pub actions: Vec<Stmt>,
}

/// The pieces of a statechart.
///
/// # Errors
/// Constructs that a bounded program cannot express ([`super::codes`]).
pub fn pieces(net: &Valid<Net>) -> Result<Pieces, Vec<Diagnostic>> {
    let mut builder = Builder::new(net, &ProgramOptions::default(), Additions::default());
    let mut pieces = builder.pieces();
    if !builder.findings.is_empty() {
        return Err(builder.findings);
    }
    super::with_reset(builder, net, &mut pieces.program);
    Ok(pieces.pruned())
}

impl Builder<'_> {
    fn pieces(&mut self) -> Pieces {
        let net = self.net;
        let tree = Tree::of(net);
        let mut before = Vec::new();
        let fault = self.begin_reaction(&mut before);
        let rounds = self.begin_evolution(&mut before);
        let events = self.queues.as_ref().map_or_else(Vec::new, |queues| queues.events.clone());
        let mut check = Vec::new();
        self.compare_others(&mut check);
        let guards = self.guards(rounds.current, &mut check);
        // The lists of one micro-step; their positions in its sequence are unknown.
        self.begin_sequence();
        let watched = IdMap::build(&net.steps, |step, _| self.needs.watched[step]);
        let mut states = IdMap::filled(&net.steps, StatePieces::default());
        for (step, data) in net.steps.iter() {
            let exit = self.exit_list(step, watched[step]);
            let entry = self.entry_list(step, watched[step]);
            let initial_content = self.list(&data.initial_content);
            let mut finish = Vec::new();
            let mut asked = Vec::new();
            if data.kind == StepKind::Final {
                let is_final = &mut |builder: &Builder<'_>, child| {
                    asked.push(child);
                    builder.is_active(child)
                };
                self.finish(&tree, step, is_final, &mut finish);
            }
            for child in asked {
                states[child].completes = true;
            }
            let completes = states[step].completes;
            let is_watched = watched[step];
            states[step] =
                StatePieces { exit, entry, initial_content, finish, is_watched, completes };
        }
        let mut transitions = guards;
        for (id, transition) in net.transitions.iter() {
            transitions[id].actions = self.list(&transition.actions);
        }
        let default_content =
            IdMap::build(&net.histories, |_, history| self.list(&history.default_content));
        self.end_sequence(Vec::new());
        let recorded = IdMap::build(&net.histories, |id, history| {
            let cells = history.cases.iter().filter_map(|case| self.recorded.get(&(id, case.step)));
            cells.copied().collect()
        });
        let fired = self.after_micro_step(rounds);
        let too_long = self.too_long(fault, rounds);
        let idle = self.take_next(rounds);
        let mut renew = Vec::new();
        self.renew_edges(&mut renew);
        let mut after = Vec::new();
        self.end_reaction(fault, &mut after);
        let limit = self.limit().unwrap_or(1);
        let carried = self.carried(fault, rounds);
        Pieces {
            program: Program { temps: std::mem::take(&mut self.temps), ..Program::default() },
            before,
            check,
            fired,
            too_long,
            idle,
            renew,
            after,
            again: temp(rounds.again),
            is_full: Expr::compare(CompareOp::Ge, temp(rounds.count), Expr::int(i64::from(limit))),
            event: rounds.current,
            events,
            rounds: self.most_rounds(limit),
            bits: self.step.clone(),
            states,
            transitions,
            default_content,
            recorded,
            carried,
        }
    }

    /// The temporaries that carry something from check to check, and to the end of the reaction.
    pub(super) fn carried(&self, fault: TempId, rounds: Rounds) -> Vec<(TempId, Carried)> {
        let mut all = vec![
            (fault, Carried::Fault),
            (rounds.again, Carried::Again),
            (rounds.count, Carried::Count),
        ];
        if let Some(queues) = &self.queues {
            all.extend(rounds.current.map(|it| (it, Carried::Event(queues.events.clone()))));
            if let External::Row(events) = &queues.external {
                let waits = |(event, temp): &(InputId, Option<TempId>)| {
                    temp.map(|temp| (temp, Carried::Waits(*event)))
                };
                all.extend(events.iter().filter_map(waits));
            }
        }
        all.extend(rounds.restarts.map(|it| (it, Carried::Restarts)));
        for (part, had_ended) in self.now.had_ended.iter() {
            if let Some(ExprKind::Leaf(Leaf::Temp(it))) = had_ended.as_ref().map(|it| &it.kind) {
                all.push((*it, Carried::HadEnded(part)));
            }
        }
        all
    }

    /// The receptivities; those that others read, or that call functions, become named temporaries.
    fn guards(
        &mut self,
        current: Option<TempId>,
        check: &mut Vec<Stmt>,
    ) -> IdMap<Transition, TransitionPieces> {
        let net = self.net;
        let is = |number: i64| {
            current.map_or_else(
                || Expr::bool(number == 0),
                |current| Expr::compare(CompareOp::Eq, temp(current), Expr::int(number)),
            )
        };
        for event in net.inputs.ids() {
            if let Some(number) = self.queues.as_ref().and_then(|queues| queues.number(event)) {
                self.now.holds[event] = Some(is(number));
            }
        }
        let none =
            TransitionPieces { guard: Expr::bool(false), is_named: false, actions: Vec::new() };
        let mut pieces = IdMap::filled(&net.transitions, none);
        for (id, transition) in net.transitions.iter() {
            let mut calls = false;
            for leaf in transition.guard.leaves() {
                if let NetLeaf::Input(input) = leaf {
                    calls |= net.inputs[*input].kind == InputKind::Extern;
                }
            }
            // A chart that has ended is in its final state, so no other transition is enabled.
            let source = transition.requires.first().map(|source| &net.steps[*source]);
            let is_last =
                source.is_some_and(|it| it.kind == StepKind::Final && it.parent.is_none());
            let running = self.has_ended(transition.part).filter(|_| is_last).map(Expr::not);
            if self.needs.fireable[id] || calls {
                let eventless = transition.events.is_empty().then(|| is(0));
                let now = [self.fireable_now(id)].into_iter().chain(eventless).chain(running);
                let name = format!("{}.fireable", transition.name);
                let role = TempRole::Fireable(id);
                let guard = self.named(name, role, Expr::and(now), check);
                self.now.fireable[id] = Some(guard.clone());
                pieces[id].guard = guard;
                pieces[id].is_named = true;
            } else {
                let guard = self.read(&transition.guard);
                pieces[id].guard = simplify(&Expr::and([guard].into_iter().chain(running)));
            }
        }
        pieces
    }
}

impl Pieces {
    /// The pieces without cells and temporaries that are never read.
    fn pruned(mut self) -> Self {
        let mut lists: Vec<&mut Vec<Stmt>> = vec![
            &mut self.before,
            &mut self.check,
            &mut self.fired,
            &mut self.too_long,
            &mut self.idle,
            &mut self.renew,
            &mut self.after,
        ];
        let mut exprs = vec![&mut self.again, &mut self.is_full];
        for state in self.states.values_mut() {
            let StatePieces { exit, entry, initial_content, finish, .. } = state;
            lists.extend([exit, entry, initial_content, finish]);
        }
        for transition in self.transitions.values_mut() {
            lists.push(&mut transition.actions);
            exprs.push(&mut transition.guard);
        }
        lists.extend(self.default_content.values_mut());
        let kept: Vec<CellId> = self.recorded.values().flatten().copied().collect();
        let renamed = super::prune::prune_pieces(
            &mut self.program,
            &mut lists,
            &mut exprs,
            self.event,
            &kept,
        );
        self.event = self.event.and_then(|id| renamed.temp(id));
        let carried = std::mem::take(&mut self.carried).into_iter();
        self.carried = carried.filter_map(|(id, it)| Some((renamed.temp(id)?, it))).collect();
        for id in self.bits.values_mut().chain(self.recorded.values_mut().flatten()) {
            *id = renamed.cell(*id).unwrap_or(*id);
        }
        self
    }
}
