//! Findings from a search of all reachable states: conflicts, dead ends, races, livelocks, starvation.

use itertools::Itertools as _;
use std::collections::{BTreeMap, BTreeSet};

use grafsynth_ir::diag::{Notation, joined};
use grafsynth_ir::facts::{Facts, Proof};
use grafsynth_ir::net::{
    Evolution, Net, Policy, StepId, StepKind, StmtKind, Transition, TransitionId, TransitionKind,
};
use grafsynth_ir::{Diagnostic, Span, Valid};
use grafsynth_sim::{InputRow, Noticed, Simulator, Situation, State, Stimulus, Writer};

use super::livelock::livelock;
use super::{
    Check, Checked, Conflict, Decided, Findings, decided, shown_names, starving, step_names,
    structural,
};
use crate::codes;
use crate::exclusive::{all_compatible_pairs, compatible_pairs, entered};
use crate::explore::{Ended, Seen, States, Ticks, Times, explore};
use crate::guards::{holds, is_enabled, reads_inputs_only};
use crate::limits::Limits;
use crate::symbolic;
use crate::verdict::OpenReason;

/// The maximum number of edges of the state graph that are kept for questions about cycles.
const EDGE_LIMIT: usize = 4_000_000;
/// The limit of pairs for a search that is known not to end.
const HOPELESS: u64 = 200_000;

/// A set of pairs of transitions.
type Together = BTreeSet<(TransitionId, TransitionId)>;

/// The results of a search, for all questions about states.
pub(crate) struct Shown<'n> {
    net: &'n Valid<Net>,
    /// Competing transitions, which are observed for starvation.
    rivals: Vec<TransitionId>,
    /// Pairs that fired in one micro-step and share a preceding step, in declaration order.
    together: Together,
    /// Pairs of a winner and a loser under the conflict policy.
    contests: BTreeSet<(TransitionId, TransitionId)>,
    /// The reactions, for questions about cycles and ends.
    edges: Vec<Edge>,
    /// The reason why some reactions are missing; `None` if all are present.
    edges_open: Option<OpenReason>,
    n_noticed: usize,
    noticed: BTreeMap<Noticed, (Vec<InputRow>, State)>,
}

/// A reaction, as an edge of the graph of nodes. It stores the nodes that it leads from and to, the rivals that were fireable and did not fire (a bit set), the
/// rivals that fired (a bit set), whether anything fired, and whether it is possible from every state of the node.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Edge {
    from: u32,
    to: u32,
    lost: u32,
    won: u32,
    fires: bool,
    is_sure: bool,
}

/// A search of all reachable states, and what it showed.
#[derive(Clone, Copy)]
pub(crate) struct Search<'s, 'n> {
    /// The results of the search that gives the answer, or of the last search if none ended.
    pub(crate) shown: &'s Shown<'n>,
    /// The results of the search that visited the most reactions.
    pub(crate) widest: &'s Shown<'n>,
    /// The states of the search that gives the answer.
    pub(crate) states: &'s States,
    /// The reason why the search did not end; `None` if it did.
    pub(crate) open: Option<&'s OpenReason>,
    /// True if nodes represent sets of times.
    pub(crate) by_zones: bool,
}

/// The limits of a search for findings, given whether a similar search ended.
pub(crate) fn limits(facts: &Facts, limits: &Limits) -> Limits {
    let is_enumerated =
        facts.reach.as_ref().is_some_and(|reach| reach.by == Proof::Explicit && reach.exact);
    let pairs = if is_enumerated { limits.pairs } else { limits.pairs.min(HOPELESS) };
    Limits { pairs, ..limits.clone() }
}

/// Searches for all findings that depend on the reachable states.
pub(super) fn run(
    net: &Valid<Net>,
    facts: &Facts,
    limits: &Limits,
    search: Search<'_, '_>,
    findings: &mut Findings,
) {
    let seen_open = search.open.cloned();
    let widest = search.widest;
    let mut late = Vec::new();
    let (mut ends_open, mut starvation_open) = ways(net, limits, search, findings, &mut late);
    if ends_open.is_some() && structural::is_always_alive(net, facts, limits) {
        ends_open = None;
    }
    if search.shown.rivals.is_empty() {
        starvation_open = None;
    }
    let (mut together, mut contests) = (widest.together.clone(), widest.contests.clone());
    let mut conflicts_open = seen_open.clone();
    if seen_open.is_some()
        && (structural::see_all_contests(net, facts, limits, &mut together, &mut contests)
            || widest.ask_diagram(facts, limits, &mut together))
    {
        conflicts_open = None;
    }
    let mut races_open = seen_open.clone();
    if seen_open.is_some() && structural::is_free_of_races(net, facts, limits) {
        races_open = None;
    }
    findings.conflicts = widest.conflicts(&together, &mut findings.found);
    widest.notes(&mut findings.found);
    findings.found.append(&mut late);
    findings.decided = (contests.iter())
        .map(|(winner, loser)| Decided { winner: *winner, loser: *loser })
        .collect();
    findings.notes = widest.decided(&contests);
    let is_single = net.settings.evolution == Evolution::Single;
    let mut check = |check, open: &Option<OpenReason>| {
        findings.checked.push(Checked { check, open: open.clone() });
    };
    check(Check::Conflicts, &conflicts_open);
    check(Check::DeadEnds, &ends_open);
    if can_race(net) {
        check(Check::Races, &races_open);
    }
    if !is_single {
        // Any proof of a bound on the micro-steps is sufficient.
        let is_bounded = facts.stable_depth.is_some() || facts.always_stable.is_some();
        check(Check::Livelock, if is_bounded { &None } else { &seen_open });
    }
    if is_single && matches!(net.settings.policy, Policy::Priority | Policy::PriorityAge) {
        check(Check::Starvation, &starvation_open);
    }
}

/// Answers the questions about paths: dead ends and starvation. Returns the reason for each that is open.
///
/// A search with zones skips zones contained in others, so an edge may lead to only some of the states of its target node. An edge that is sure
/// exists from every state of its node; an absent edge exists from none. If the graph of sure edges and the graph of all edges give the same result, that is
/// the answer. Otherwise the search is repeated with more nodes.
fn ways(
    net: &Valid<Net>,
    limits: &Limits,
    search: Search<'_, '_>,
    findings: &mut Findings,
    out: &mut Vec<Diagnostic>,
) -> (Option<OpenReason>, Option<OpenReason>) {
    let Search { shown, states, open, by_zones, .. } = search;
    if let Some(why) = open.or(shown.edges_open.as_ref()) {
        // A search that uses more nodes for the same states will not end either. A one-by-one search may need fewer nodes, unless it was already tried.
        let few = Limits { pairs: limits.pairs.min(HOPELESS), ..limits.clone() };
        if by_zones && let Ok((each, states)) = Shown::one_by_one(net, states, &few) {
            findings.dead_ends = each.dead_ends(&states, out);
            each.starvation(each.starving(&states, |_| true), out);
            return (None, None);
        }
        let starving = starving::starving(net, &shown.rivals, limits);
        if let Some(starving) = starving {
            shown.starvation(starving, out);
        }
        return (Some(why.clone()), starving.is_none().then(|| why.clone()));
    }
    let starving = shown.starving(states, |_| true);
    let starves_for_sure = shown.starving(states, |edge| edge.is_sure);
    let are_ends_exact = shown.are_ends_exact(states);
    if are_ends_exact && starving == starves_for_sure {
        findings.dead_ends = shown.dead_ends(states, out);
        shown.starvation(starving, out);
        return (None, None);
    }
    let (all, all_states, all_ended) = Shown::of(net, limits, Times::AllZones);
    let all_open = all_ended.open().or(all.edges_open.as_ref());
    if all_open.is_none() && all.are_ends_exact(&all_states) {
        findings.dead_ends = all.dead_ends(&all_states, out);
        all.starvation(all.starving(&all_states, |_| true), out);
        return (None, None);
    }
    // Even if a node has a successor, some of the states that it represents may have none.
    match (Shown::one_by_one(net, states, limits), all_open) {
        (Ok((each, states)), _) => {
            findings.dead_ends = each.dead_ends(&states, out);
            each.starvation(each.starving(&states, |_| true), out);
            (None, None)
        }
        // Every dead end and every starvation reported here exists; whether all are reported is a separate question.
        (Err(why), None) => {
            findings.dead_ends = all.dead_ends(&all_states, out);
            all.starvation(all.starving(&all_states, |_| true), out);
            ((!are_ends_exact).then_some(why), None)
        }
        (Err(_), Some(why)) => {
            findings.dead_ends = shown.dead_ends(states, out);
            shown.starvation(starves_for_sure, out);
            let open = |is_exact: bool| (!is_exact).then(|| why.clone());
            (open(are_ends_exact), open(starving == starves_for_sure))
        }
    }
}

impl<'n> Shown<'n> {
    /// Starts with the results of the reset.
    pub(crate) fn new(net: &'n Valid<Net>) -> Self {
        let mut shown = Shown {
            net,
            rivals: rivals(net),
            together: BTreeSet::new(),
            contests: BTreeSet::new(),
            edges: Vec::new(),
            edges_open: None,
            n_noticed: 0,
            noticed: BTreeMap::new(),
        };
        // A statechart runs to completion in its reset.
        shown.firings(&Simulator::new(net));
        shown
    }

    /// A search that runs until it ends or reaches its limit.
    fn of(net: &'n Valid<Net>, limits: &Limits, times: Times) -> (Self, States, Ended<()>) {
        let mut shown = Shown::new(net);
        let (states, ended) = explore(net, limits, times, &mut |states, seen| {
            shown.note(states, seen);
            None::<()>
        });
        shown.settle();
        (shown, states, ended)
    }

    /// A search of all states one by one, each `dt` up to the longest time. `known` contains some of the states without their times.
    fn one_by_one(
        net: &'n Valid<Net>,
        known: &States,
        limits: &Limits,
    ) -> Result<(Self, States), OpenReason> {
        if known.are_too_many_one_by_one(net, limits) {
            return Err(OpenReason::Pairs { limit: limits.pairs, states: known.len() });
        }
        let (shown, states, ended) = Shown::of(net, limits, Times::Each(Ticks::Any));
        match ended.open().or(shown.edges_open.as_ref()) {
            None => Ok((shown, states)),
            Some(why) => Err(why.clone()),
        }
    }

    /// Sorts the reactions and removes duplicates, when all reactions are noted.
    pub(crate) fn settle(&mut self) {
        self.edges.sort_unstable();
        self.edges.dedup();
    }

    fn firings(&mut self, simulator: &Simulator<'_>) {
        self.contests.extend(simulator.contests());
        if self.net.settings.policy != Policy::All {
            return;
        }
        let net = self.net;
        for fired in simulator.firings() {
            for (at, one) in fired.iter().enumerate() {
                for other in &fired[..at] {
                    if shared_step(net, *one, *other).is_some() {
                        self.together.insert((*one.min(other), *one.max(other)));
                    }
                }
            }
        }
    }

    /// Finds the pairs that fire together without a search: from the receptivities alone, or from the decision diagram of all reachable states. Returns
    /// false if some pair remains unknown.
    fn ask_diagram(&self, facts: &Facts, limits: &Limits, together: &mut Together) -> bool {
        let net = self.net;
        if net.settings.policy != Policy::All || net.settings.fire_one {
            return net.settings.fire_one;
        }
        let unknown: Vec<(TransitionId, TransitionId)> = all_compatible_pairs(net)
            .into_iter()
            .filter(|pair| !together.contains(pair))
            .filter(|(first, second)| {
                !does_the_same(&net.transitions[*first], &net.transitions[*second])
            })
            .collect();
        if unknown.is_empty() {
            return true;
        }
        let Ok(reached) = symbolic::reach(net, facts, limits, &[], &unknown) else { return false };
        if reached.exact {
            let found = unknown.into_iter().zip(&reached.pairs).filter(|(_, fire)| **fire);
            together.extend(found.map(|(pair, _)| pair));
        }
        reached.exact
    }

    /// Notes a reaction.
    pub(crate) fn note(&mut self, states: &States, seen: &Seen<'_, 'n>) {
        let net = self.net;
        self.firings(seen.simulator);
        let notes = seen.simulator.notes();
        if notes.iter().count() > self.n_noticed {
            for (what, _) in notes.iter() {
                self.noticed
                    .entry(*what)
                    .or_insert_with(|| (states.way_of(seen), seen.before.clone()));
            }
            self.n_noticed = notes.iter().count();
        }
        if self.edges.len() >= EDGE_LIMIT {
            let why = || OpenReason::Method(format!("more than {EDGE_LIMIT} reactions"));
            self.edges_open.get_or_insert_with(why);
            return;
        }
        let fired = seen.simulator.fired();
        let situation = states.situation(seen.from);
        let mut edge = Edge {
            from: seen.from as u32,
            to: seen.to as u32,
            lost: 0,
            won: 0,
            fires: !fired.is_empty(),
            is_sure: seen.is_sure,
        };
        for (bit, rival) in self.rivals.iter().enumerate() {
            let data = &net.transitions[*rival];
            if fired.contains(rival) {
                edge.won |= 1 << bit;
            } else if is_enabled(data, situation) && holds(data, situation, seen.input) {
                edge.lost |= 1 << bit;
            }
        }
        if self.edges.last() != Some(&edge) {
            self.edges.push(edge);
        }
    }

    /// Reports transitions that leave the same step in one micro-step. Pairs with the same effect are skipped: firing both is the same as firing one.
    fn conflicts(&self, together: &Together, out: &mut Vec<Diagnostic>) -> Vec<Conflict> {
        let net = self.net;
        let mut conflicts = Vec::new();
        for (a, b) in together {
            let Some(step) = shared_step(net, *a, *b) else { continue };
            let (first, second) = (&net.transitions[*a], &net.transitions[*b]);
            if does_the_same(first, second) {
                continue;
            }
            conflicts.push(Conflict { step, first: *a, second: *b });
            let targets = |transition| match step_names(net, entered(transition)) {
                names if names.is_empty() => "activates nothing".to_owned(),
                names => format!("activates {names}"),
            };
            let note = Diagnostic::note(
                codes::CONFLICT,
                format!(
                    "`{}` and `{}` can leave step `{}` together: under `conflict all` both fire",
                    first.name, second.name, net.steps[step].name
                ),
            )
            .at(second.meta.span, targets(second))
            .at(first.meta.span, format!("{} in the same micro-step", targets(first)));
            let is_same_receptivity = first.events == second.events
                && first.guard.without_spans() == second.guard.without_spans()
                && first.requires == second.requires;
            out.push(note.help(if is_same_receptivity {
                "their receptivities are equal, so both always fire: write one transition that activates the steps of both (`s -> x & y when a`)"
            } else {
                "if only one of them should fire, make the receptivities exclude each other (`a and not b`, `b and not a`), or declare `conflict priority`; \
                 if both should fire, write one transition that activates the steps of both for that case (`s -> x & y when a and b`)"
            }));
        }
        conflicts
    }

    /// Notes about the conflicts that the policy resolves: which transition wins, or that either may win.
    fn decided(&self, contests: &Together) -> Vec<Diagnostic> {
        let net = self.net;
        let mut out = Vec::new();
        for (won, lost) in contests {
            let is_mutual = contests.contains(&(*lost, *won));
            if is_mutual && lost < won {
                continue;
            }
            let (winner, loser) = (&net.transitions[*won], &net.transitions[*lost]);
            let step = match shared_step(net, *won, *lost) {
                Some(step) => format!("step `{}`", net.steps[step].name),
                None => "a common state".to_owned(),
            };
            let (who, why) = if is_mutual {
                ("either can fire first".to_owned(), "sometimes one, sometimes the other")
            } else {
                (format!("`{}` fires", winner.name), decided::reason(net, winner, loser))
            };
            let note = Diagnostic::note(
                codes::DECIDED_CONFLICT,
                format!(
                    "`{}` and `{}` leave {step} and can be fireable together: {who}",
                    winner.name, loser.name
                ),
            )
            .at(winner.meta.span, why)
            .at(loser.meta.span, if is_mutual { "its competitor" } else { "does not fire then" });
            out.push(decided::advise(note, net, winner, loser, is_mutual));
        }
        out
    }

    fn notes(&self, out: &mut Vec<Diagnostic>) {
        let net = self.net;
        for (what, (way, state)) in &self.noticed {
            let rows = Stimulus::of_rows(net, way);
            let shown = shown(net, &rows);
            let diagnostic = match what {
                Noticed::Saturated(var, span) => {
                    let (lo, hi) = net.vars[*var].ty.bounds();
                    Diagnostic::note(
                        codes::SATURATION,
                        format!(
                            "a value for `{}` can be outside {lo}..{hi}{shown}",
                            net.vars[*var].name
                        ),
                    )
                    .at(*span, "the nearest bound is stored")
                    .help("widen the range, or test before the assignment")
                }
                Noticed::ArgumentSaturated(output, span) => Diagnostic::note(
                    codes::SATURATION,
                    format!(
                        "an argument of `{}` can be outside the range of its parameter{shown}",
                        net.outputs[*output].name
                    ),
                )
                .at(*span, "the nearest bound is passed")
                .help("widen the range, or test before the call"),
                Noticed::Race(var, first, second) => {
                    let (first_span, second_span) = (self.writer(*first), self.writer(*second));
                    Diagnostic::warning(
                        codes::RACE,
                        format!(
                            "`{}` is written twice in one micro-step{shown}",
                            net.vars[*var].name
                        ),
                    )
                    .at(second_span, "this value is kept")
                    .at(first_span, "this value is lost")
                    .help("let only one of them write it, or make sure that they never run together")
                }
                Noticed::Resent(send) => Diagnostic::warning(
                    codes::QUEUE_OVERFLOW,
                    format!(
                        "the send `{}` can be started again while it is running{shown}",
                        net.sends[*send].name
                    ),
                )
                .at(net.sends[*send].meta.span, "its delay starts again")
                .help("give sends that may run at the same time different names with `as`, or cancel the first")
                .help_in(
                    Notation::Scxml,
                    "SCXML would deliver both: write two <send> with an `id` each, or <cancel> the first",
                ),
                Noticed::QueueFull(event) => Diagnostic::warning(
                    codes::QUEUE_OVERFLOW,
                    format!(
                        "event `{}` can be lost: its queue is full{shown}",
                        net.inputs[*event].name
                    ),
                )
                .at(net.inputs[*event].meta.span, "declared here")
                .help("declare a longer queue with `queue N`")
                .help_in(
                    Notation::Scxml,
                    "allow a longer queue with the attribute `g:queue` of <scxml>",
                ),
                Noticed::LimitReached => livelock(self.net, way, state, &shown),
                Noticed::ForcingRace(part) => Diagnostic::warning(
                    codes::FORCING_RACE,
                    format!(
                        "two forcing orders for `{}` can contradict each other{shown}",
                        net.parts[*part].name
                    ),
                )
                .at(net.parts[*part].meta.span, "the order declared first wins")
                .help("let only one of the forcing steps be active at a time"),
            };
            out.push(diagnostic);
        }
    }

    fn writer(&self, writer: Writer) -> Span {
        let net = self.net;
        match writer {
            Writer::Exit(step) | Writer::Entry(step) | Writer::InitialContent(step) => {
                net.steps[step].meta.span
            }
            Writer::Transition(transition) => net.transitions[transition].meta.span,
            Writer::HistoryContent(history) => net.histories[history].meta.span,
        }
    }

    /// True if a transition that eventually fires from one state of a node does so from all of them; then the dead ends found are all that exist.
    fn are_ends_exact(&self, states: &States) -> bool {
        self.alive(states, |_| true) == self.alive(states, |edge| edge.is_sure)
    }

    /// For each node, whether something fires in it or later, along edges that are `kept`.
    fn alive(&self, states: &States, kept: impl Fn(&Edge) -> bool) -> Vec<bool> {
        let n = states.len();
        let mut alive = vec![false; n];
        let mut before: Vec<Vec<u32>> = vec![Vec::new(); n];
        let mut todo: Vec<u32> = Vec::new();
        for edge in self.edges.iter().filter(|edge| kept(edge)) {
            if edge.from != edge.to {
                before[edge.to as usize].push(edge.from);
            }
            if edge.fires && !alive[edge.from as usize] {
                alive[edge.from as usize] = true;
                todo.push(edge.from);
            }
        }
        while let Some(state) = todo.pop() {
            for from in &before[state as usize] {
                if !alive[*from as usize] {
                    alive[*from as usize] = true;
                    todo.push(*from);
                }
            }
        }
        alive
    }

    /// Reports the situations in which nothing ever fires again, except intended ends.
    fn dead_ends(&self, states: &States, out: &mut Vec<Diagnostic>) -> Vec<Vec<StepId>> {
        let net = self.net;
        let causes = super::constant::causes(net);
        let alive = self.alive(states, |_| true);
        let mut reported: BTreeSet<&Situation> = BTreeSet::new();
        let mut found = Vec::new();
        for (at, is_alive) in alive.iter().enumerate() {
            let situation = states.situation(at);
            if *is_alive || net.transitions.is_empty() || !reported.insert(situation) {
                continue;
            }
            if is_end(net, situation) {
                continue;
            }
            // If every blocked transition is already reported because of a variable that never changes, the dead end is only a consequence and gets no warning
            // of its own.
            let mut blocked = net
                .transitions
                .iter()
                .filter(|(_, transition)| {
                    transition.kind == TransitionKind::Move
                        && transition.requires.iter().any(|step| situation.contains(*step))
                })
                .peekable();
            if blocked.peek().is_some() && blocked.all(|(id, _)| causes.contains_key(&id)) {
                found.push(situation.iter().collect());
                continue;
            }
            let rows = states.stimulus(net, at);
            let waiting = net.transitions.iter().find(|(_, transition)| {
                transition.kind == TransitionKind::Move
                    && transition.requires.iter().any(|step| situation.contains(*step))
            });
            let active: Vec<StepId> = situation.iter().collect();
            let mut warning = Diagnostic::warning(
                codes::DEAD_END,
                format!(
                    "no transition can ever fire again in situation `{{{}}}`{}",
                    shown_names(net, active.iter().copied()).join(", "),
                    shown(net, &rows)
                ),
            );
            for step in active.iter().take(3) {
                warning = warning.at(net.steps[*step].meta.span, "active for ever");
            }
            if let Some((_, transition)) = waiting {
                let missing: Vec<StepId> = transition
                    .requires
                    .iter()
                    .copied()
                    .filter(|step| !situation.contains(*step))
                    .collect();
                warning = if missing.is_empty() {
                    warning.at(transition.meta.span, "its receptivity is never true here")
                } else {
                    warning
                        .at(transition.meta.span, format!("waits for {}", step_names(net, missing)))
                };
            }
            out.push(warning.help(
                "add a transition that leaves the situation, or change a receptivity so that it can become true",
            ));
            found.push(active);
        }
        found
    }

    /// Competing transitions that are fireable again and again on some cycle of edges that are `kept`, but never fire there: a bit for each rival.
    fn starving(&self, states: &States, kept: impl Fn(&Edge) -> bool) -> u32 {
        let mut starving = 0;
        for bit in 0..self.rivals.len() {
            let mut graph: petgraph::graph::DiGraph<(), ()> = petgraph::graph::DiGraph::new();
            (0..states.len()).for_each(|_| {
                graph.add_node(());
            });
            let lost = || self.edges.iter().filter(|edge| edge.won >> bit & 1 == 0 && kept(edge));
            let node = |state: u32| petgraph::graph::NodeIndex::new(state as usize);
            for edge in lost() {
                graph.update_edge(node(edge.from), node(edge.to), ());
            }
            let mut component = vec![0_usize; states.len()];
            for (number, members) in petgraph::algo::kosaraju_scc(&graph).into_iter().enumerate() {
                members.into_iter().for_each(|member| component[member.index()] = number);
            }
            // The transition does not fire on an edge within a strongly connected part, so it can wait there for ever. Something else must have fired
            // on that edge.
            let loses = lost().any(|edge| {
                edge.lost >> bit & 1 == 1
                    && edge.fires
                    && component[edge.from as usize] == component[edge.to as usize]
            });
            starving |= u32::from(loses) << bit;
        }
        starving
    }

    /// Reports the rivals that starve.
    fn starvation(&self, bits: u32, out: &mut Vec<Diagnostic>) {
        let net = self.net;
        let mut starving: BTreeMap<StepId, Vec<TransitionId>> = BTreeMap::new();
        let rivals = self.rivals.iter().enumerate().filter(|(bit, _)| bits >> bit & 1 == 1);
        for (_, rival) in rivals {
            starving.entry(net.transitions[*rival].requires[0]).or_default().push(*rival);
        }
        for (step, transitions) in starving {
            let names = transitions
                .iter()
                .map(|transition| format!("`{}`", net.transitions[*transition].name))
                .join(", ");
            let mut note = Diagnostic::note(
                codes::STARVATION,
                format!(
                    "{} can starve at step `{}`: other transitions may win every time",
                    names, net.steps[step].name
                ),
            );
            for transition in &transitions {
                note = note.at(
                    net.transitions[*transition].meta.span,
                    "may wait for ever although its receptivity is true again and again",
                );
            }
            let help = match net.settings.policy {
                Policy::Priority => {
                    "write `conflict priority-age`: the branch that has waited longest goes first"
                }
                Policy::PriorityAge => {
                    "give the following steps the same priority: the branch that has waited longest then goes first"
                }
                Policy::All | Policy::InnerFirst | Policy::OuterFirst => {
                    "make the receptivities exclude each other"
                }
            };
            note = note.help(help);
            if net.settings.policy == Policy::Priority {
                note = note
                    .help_in(
                        Notation::Iec,
                        "write {grafsynth conflict priority-age} in the program: the branch that has waited longest goes first",
                    )
                    .help_in(Notation::C, "make the conditions exclude each other");
            }
            out.push(note);
        }
    }
}

/// Transitions that compete for a step if at least two of them can be fireable at once, and if their receptivities depend only on a row and a situation.
fn rivals(net: &Net) -> Vec<TransitionId> {
    let competes = matches!(net.settings.policy, Policy::Priority | Policy::PriorityAge);
    if !competes || net.settings.evolution != Evolution::Single {
        return Vec::new();
    }
    let mut rivals = BTreeSet::new();
    for overlap in compatible_pairs(net).into_iter().filter(|overlap| overlap.is_certain) {
        for (id, transition) in net.transitions.iter() {
            if transition.kind == TransitionKind::Move
                && transition.requires == [overlap.step]
                && reads_inputs_only(net, transition)
            {
                rivals.insert(id);
            }
        }
    }
    rivals.into_iter().take(32).collect()
}

/// True if something in the net can be written twice, be out of range, be lost or be forced in two ways.
fn can_race(net: &Net) -> bool {
    let mut writes = net.settings.queue.is_some() || net.forcings.len() > 1;
    for stmt in net.statements() {
        writes |= matches!(stmt.kind, StmtKind::Assign { .. } | StmtKind::Call { .. });
    }
    writes || net.outputs.values().any(grafsynth_ir::net::Output::is_extern)
}

/// The first step that both transitions leave, if they are two different moves.
fn shared_step(net: &Net, a: TransitionId, b: TransitionId) -> Option<StepId> {
    let (first, second) = (&net.transitions[a], &net.transitions[b]);
    let is_move = |one: &Transition| one.kind == TransitionKind::Move;
    if a == b || !is_move(first) || !is_move(second) {
        return None;
    }
    first.requires.iter().copied().find(|step| second.requires.contains(step))
}

/// True if firing both is the same as firing one: they have the same preceding and following steps, and no actions.
fn does_the_same(a: &Transition, b: &Transition) -> bool {
    let sorted = |steps: &mut dyn Iterator<Item = StepId>| {
        let mut steps: Vec<StepId> = steps.collect();
        steps.sort_unstable();
        steps
    };
    let same_before =
        sorted(&mut a.requires.iter().copied()) == sorted(&mut b.requires.iter().copied());
    let same_behind = sorted(&mut entered(a)) == sorted(&mut entered(b));
    same_before
        && same_behind
        && a.restart == b.restart
        && a.actions.is_empty()
        && b.actions.is_empty()
}

/// True for an intended end: in a statechart, a final state is active; otherwise, no transition leaves an active step.
fn is_end(net: &Net, situation: &Situation) -> bool {
    if net.settings.policy.is_statechart() {
        return situation.iter().any(|step| net.steps[step].kind == StepKind::Final);
    }
    situation
        .iter()
        .all(|step| !net.transitions.values().any(|transition| transition.requires.contains(&step)))
}

/// The path to the situation, for a message.
fn shown(net: &Net, stimulus: &Stimulus) -> String {
    const ROWS: usize = 4;
    let mut rows = Vec::new();
    for row in stimulus.rows().take(ROWS) {
        let values: Vec<String> = net
            .inputs
            .iter()
            .filter(|(id, _)| row.value(*id) != 0)
            .map(|(id, input)| {
                if input.ty.is_bool() {
                    format!("`{}`", input.name)
                } else {
                    format!("`{}={}`", input.name, row.value(id))
                }
            })
            .collect();
        let mut text = match values.as_slice() {
            [] => "no input".to_owned(),
            all => joined(all, "and"),
        };
        if row.dt != 1 {
            text += &format!(" with dt={}", row.dt);
        }
        rows.push(text);
    }
    let rows = rows.join(", then ");
    match stimulus.len() {
        0 => " (after reset)".to_owned(),
        1 => format!(" (after an input row with {rows})"),
        n if n <= ROWS => format!(" (after {n} input rows: {rows})"),
        n => format!(" (after {n} input rows: {rows}, ...)"),
    }
}
