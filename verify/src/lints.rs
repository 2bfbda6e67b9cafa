//! What is probably not what the designer meant. Every finding is shown by an exhaustive search or follows from the structure of the chart; nothing is
//! reported on suspicion.

use std::collections::{BTreeMap, BTreeSet};

use grafsynth_ir::facts::{Facts, Proof};
use grafsynth_ir::net::{Evolution, Net, Policy, StepId, StepKind, TransitionId, TransitionKind};
use grafsynth_ir::{Diagnostic, Span, Valid};
use grafsynth_sim::{InputRow, Noticed, Simulator, Situation, State, Stimulus, Writer};

use crate::codes;
use crate::exclusive::{Overlap, compatible_pairs};
use crate::explore::{Ended, States, Ticks, explore};
use crate::guards::{holds, is_enabled, reads_inputs_only};
use crate::limits::Limits;
use crate::properties::check_assumption;

/// The most findings of one kind; more would hide the first.
const OF_A_KIND: usize = 8;
/// Edges of the state graph that are kept for the questions about cycles.
const EDGE_LIMIT: usize = 4_000_000;

/// All findings about a net, in a fixed order. `facts` are those of the same net.
#[must_use]
pub fn lints(net: &Valid<Net>, facts: &Facts) -> Vec<Diagnostic> {
    lints_with(net, facts, &Limits::default())
}

/// As [`lints`], with limits of one's own for the search.
#[must_use]
pub fn lints_with(net: &Valid<Net>, facts: &Facts, limits: &Limits) -> Vec<Diagnostic> {
    let mut out = Vec::new();
    if let Some(warning) = check_assumption(net) {
        // Where no input is possible nothing ever happens, and whatever else could be said follows from that.
        return vec![warning];
    }
    unreachable(net, facts, &mut out);
    out.extend(crate::sharing::shared(net, facts));
    let overlaps: Vec<Overlap> =
        compatible_pairs(net).into_iter().filter(|overlap| overlap.is_certain).collect();
    let is_enumerated =
        facts.reach.as_ref().is_some_and(|reach| reach.by == Proof::Explicit && reach.exact);
    if is_enumerated {
        let mut search = Search::new(net, &overlaps);
        if search.run(limits) {
            search.report(&mut out);
        }
    }
    out
}

fn step_names<'a>(net: &'a Net, steps: impl IntoIterator<Item = StepId>) -> String {
    let names: Vec<&'a str> = steps
        .into_iter()
        .filter(|step| !net.steps[*step].hidden)
        .map(|step| net.steps[step].name.text.as_str())
        .collect();
    names.join(" ")
}

fn unreachable(net: &Net, facts: &Facts, out: &mut Vec<Diagnostic>) {
    let never: BTreeSet<StepId> = facts.unreachable_steps.iter().copied().collect();
    for step in never.iter().filter(|step| !net.steps[**step].hidden).take(OF_A_KIND) {
        let data = &net.steps[*step];
        let entering: Vec<TransitionId> = net
            .transitions
            .iter()
            .filter(|(_, transition)| {
                crate::exclusive::entered(transition).any(|target| target == *step)
            })
            .map(|(id, _)| id)
            .collect();
        let mut warning = Diagnostic::warning(
            codes::UNREACHABLE_STEP,
            format!("step `{}` is never active", data.name),
        )
        .at(data.meta.span, "no stimulus activates it");
        warning = match entering.first() {
            None => warning.help("no transition leads to it: draw one, or make it initial"),
            Some(first) => warning
                .at(
                    net.transitions[*first].meta.span,
                    "this transition leads to it and never fires",
                )
                .help("see why the transitions to it never fire"),
        };
        out.push(warning);
    }
    let dead = facts.dead_transitions.iter().filter(|transition| {
        // What hangs on a step that is never active needs no finding of its own.
        !net.transitions[**transition].requires.iter().any(|step| never.contains(step))
    });
    for transition in dead.take(OF_A_KIND) {
        let data = &net.transitions[*transition];
        let what = match data.kind {
            TransitionKind::Move => "transition",
            TransitionKind::Reaction => "reaction",
        };
        let mut warning = Diagnostic::warning(
            codes::DEAD_TRANSITION,
            format!("{what} `{}` never fires", data.name),
        )
        .at(data.meta.span, "no stimulus makes it fire");
        if data.guard.is_false() {
            warning = warning.at(data.guard.span, "this is never true");
        } else if data.requires.len() > 1 {
            warning = warning
                .help("its preceding steps are never active together with its receptivity true");
        } else {
            warning = warning.help("its receptivity is never true while its step is active, or another transition always wins");
        }
        out.push(warning);
    }
}

/// One search that answers all questions about states.
struct Search<'n> {
    net: &'n Valid<Net>,
    overlaps: &'n [Overlap],
    /// Pairs of overlaps seen firing in one reaction.
    fire_together: Vec<bool>,
    /// Transitions that compete, whose chances are followed.
    rivals: Vec<TransitionId>,
    /// From, to, bit set of rivals that were fireable and did not fire, bit set of those that fired, whether anything fired.
    edges: Vec<Edge>,
    noticed: BTreeMap<Noticed, (Vec<InputRow>, State)>,
    states: Option<States>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Edge {
    from: u32,
    to: u32,
    lost: u32,
    won: u32,
    fires: bool,
}

impl<'n> Search<'n> {
    fn new(net: &'n Valid<Net>, overlaps: &'n [Overlap]) -> Self {
        let competes = matches!(net.settings.policy, Policy::Priority | Policy::PriorityAge);
        let mut rivals = BTreeSet::new();
        if competes && net.settings.evolution == Evolution::Single {
            for overlap in overlaps {
                for (id, transition) in net.transitions.iter() {
                    if transition.kind == TransitionKind::Move
                        && transition.requires == [overlap.step]
                        && reads_inputs_only(net, transition)
                    {
                        rivals.insert(id);
                    }
                }
            }
        }
        Search {
            net,
            overlaps,
            fire_together: vec![false; overlaps.len()],
            rivals: rivals.into_iter().take(32).collect(),
            edges: Vec::new(),
            noticed: BTreeMap::new(),
            states: None,
        }
    }

    /// False if the search did not end.
    fn run(&mut self, limits: &Limits) -> bool {
        let net = self.net;
        let mut fire_together = std::mem::take(&mut self.fire_together);
        let mut noticed = std::mem::take(&mut self.noticed);
        let mut edges = std::mem::take(&mut self.edges);
        let mut n_noticed = 0;
        let (states, ended) = explore::<()>(net, limits, Ticks::Any, &mut |states, seen| {
            let fired = seen.simulator.fired();
            for (overlap, together) in self.overlaps.iter().zip(&mut fire_together) {
                *together |= fired.contains(&overlap.first) && fired.contains(&overlap.second);
            }
            let notes = seen.simulator.notes();
            if notes.iter().count() > n_noticed {
                for (what, _) in notes.iter() {
                    noticed.entry(*what).or_insert_with(|| {
                        let mut way = states.way_to(seen.from);
                        way.push(seen.input.clone());
                        (way, states.states[seen.from].clone())
                    });
                }
                n_noticed = notes.iter().count();
            }
            if edges.len() < EDGE_LIMIT {
                let situation = states.states[seen.from].situation();
                let mut edge = Edge {
                    from: seen.from as u32,
                    to: seen.to as u32,
                    lost: 0,
                    won: 0,
                    fires: !fired.is_empty(),
                };
                for (bit, rival) in self.rivals.iter().enumerate() {
                    let data = &net.transitions[*rival];
                    if fired.contains(rival) {
                        edge.won |= 1 << bit;
                    } else if is_enabled(data, situation) && holds(data, situation, seen.input) {
                        edge.lost |= 1 << bit;
                    }
                }
                if edges.last() != Some(&edge) {
                    edges.push(edge);
                }
            }
            None
        });
        edges.sort_unstable();
        edges.dedup();
        self.edges = edges;
        self.fire_together = fire_together;
        self.noticed = noticed;
        self.states = Some(states);
        matches!(ended, Ended::Complete)
    }

    fn report(&self, out: &mut Vec<Diagnostic>) {
        self.conflicts(out);
        self.notes(out);
        if self.edges.len() < EDGE_LIMIT {
            self.dead_ends(out);
            self.starvation(out);
        }
    }

    fn conflicts(&self, out: &mut Vec<Diagnostic>) {
        let net = self.net;
        if net.settings.policy != Policy::All {
            return;
        }
        let seen = self.overlaps.iter().zip(&self.fire_together).filter(|(_, together)| **together);
        for (overlap, _) in seen.take(OF_A_KIND) {
            let (first, second) =
                (&net.transitions[overlap.first], &net.transitions[overlap.second]);
            let step = &net.steps[overlap.step];
            let targets = |transition| step_names(net, crate::exclusive::entered(transition));
            out.push(
                Diagnostic::note(
                    codes::CONFLICT,
                    format!("`{}` and `{}` can leave step `{}` together: under `conflict all` both fire", first.name, second.name, step.name),
                )
                .at(second.meta.span, format!("activates {}", targets(second)))
                .at(first.meta.span, format!("activates {} in the same micro-step", targets(first)))
                .help(
                    "if only one of them shall fire, let the receptivities exclude each other (`a and not b`, `b and not a`, and a third \
                     transition for `a and b`), or declare `conflict priority`",
                ),
            );
        }
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
                            "a value for `{}` can leave {lo}..{hi}{shown}",
                            net.vars[*var].name
                        ),
                    )
                    .at(*span, "the nearest bound is stored")
                    .help("widen the range, or test before the assignment")
                }
                Noticed::ArgumentSaturated(output, span) => Diagnostic::note(
                    codes::SATURATION,
                    format!(
                        "an argument of `{}` can leave the range of its parameter{shown}",
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
                    .at(second_span, "this value stays")
                    .at(first_span, "this value is lost")
                    .help("let one of them write it, or see that they never run together")
                }
                Noticed::Resent(send) => Diagnostic::note(
                    codes::QUEUE_OVERFLOW,
                    format!(
                        "the send `{}` can be started while it runs{shown}",
                        net.sends[*send].name
                    ),
                )
                .at(net.sends[*send].meta.span, "its time starts anew")
                .help("give sends that may run side by side their own names with `as`"),
                Noticed::QueueFull(event) => Diagnostic::warning(
                    codes::QUEUE_OVERFLOW,
                    format!(
                        "event `{}` can be lost: its queue is full{shown}",
                        net.inputs[*event].name
                    ),
                )
                .at(net.inputs[*event].meta.span, "declared here")
                .help("declare a longer queue with `queue N`"),
                Noticed::LimitReached => self.livelock(way, state, &shown),
                Noticed::ForcingRace(part) => Diagnostic::warning(
                    codes::FORCING_RACE,
                    format!(
                        "two forcing orders for `{}` can disagree{shown}",
                        net.parts[*part].name
                    ),
                )
                .at(net.parts[*part].meta.span, "the order declared first holds")
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

    /// A limit that is too small is not yet a livelock: with much more of it the reaction may end.
    fn livelock(&self, way: &[InputRow], state: &State, shown: &str) -> Diagnostic {
        let net = self.net;
        let Evolution::Stable { limit } = net.settings.evolution else {
            return Diagnostic::error(codes::LIVELOCK, format!("a reaction does not end{shown}"));
        };
        let more = limit.saturating_mul(8).saturating_add(64).min(4096).max(limit);
        let mut patient = (**net).clone();
        patient.settings.evolution = Evolution::Stable { limit: more };
        let mut turning: Vec<TransitionId> = Vec::new();
        let mut ends = false;
        if let (Ok(patient), Some(last)) = (grafsynth_ir::validate(patient), way.last()) {
            let mut simulator = Simulator::new(&patient);
            simulator.set_state(state);
            ends = !simulator.step(last).fault;
            let fired = simulator.fired();
            turning = fired[fired.len().saturating_sub(8)..].to_vec();
        }
        if ends {
            return Diagnostic::warning(
                codes::LIVELOCK,
                format!("a reaction needs more than the {limit} micro-steps of the limit{shown}"),
            )
            .at(net.name.span, "fault is 1 in that row")
            .help(format!("with `evolution stable limit {more}` it ends"));
        }
        let mut error =
            Diagnostic::error(codes::LIVELOCK, format!("the chart turns for ever{shown}"));
        turning.sort_unstable();
        turning.dedup();
        for transition in turning {
            error = error.at(net.transitions[transition].meta.span, "fires again and again");
        }
        error.help("let one of these wait for an edge, an event or a time; `evolution single` makes one micro-step a reaction")
    }

    /// States from which nothing ever fires again.
    fn dead_ends(&self, out: &mut Vec<Diagnostic>) {
        let Some(states) = &self.states else { return };
        let net = self.net;
        let n = states.states.len();
        let mut alive = vec![false; n];
        let mut before: Vec<Vec<u32>> = vec![Vec::new(); n];
        let mut todo: Vec<u32> = Vec::new();
        for edge in &self.edges {
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
        let mut reported: BTreeSet<&Situation> = BTreeSet::new();
        for (at, state) in states.states.iter().enumerate() {
            let situation = state.situation();
            if alive[at]
                || net.transitions.is_empty()
                || reported.len() >= OF_A_KIND
                || !reported.insert(situation)
            {
                continue;
            }
            if is_end(net, situation) {
                continue;
            }
            let rows = states.stimulus(net, at, None);
            let waiting = net.transitions.iter().find(|(_, transition)| {
                transition.kind == TransitionKind::Move
                    && transition.requires.iter().any(|step| situation.contains(*step))
            });
            let active: Vec<StepId> = situation.iter().collect();
            let mut warning = Diagnostic::warning(
                codes::DEAD_END,
                format!(
                    "nothing fires any more in the situation {}{}",
                    step_names(net, active.iter().copied()),
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
            out.push(warning.help("draw a way out, or a receptivity that can become true"));
        }
    }

    /// Competing transitions that are fireable again and again on some cycle and never fire there.
    fn starvation(&self, out: &mut Vec<Diagnostic>) {
        let Some(states) = &self.states else { return };
        let net = self.net;
        let mut starving: BTreeMap<StepId, Vec<TransitionId>> = BTreeMap::new();
        for (bit, rival) in self.rivals.iter().enumerate() {
            let mut graph: petgraph::graph::DiGraph<(), ()> = petgraph::graph::DiGraph::new();
            (0..states.states.len()).for_each(|_| {
                graph.add_node(());
            });
            let kept = || self.edges.iter().filter(|edge| edge.won >> bit & 1 == 0);
            let node = |state: u32| petgraph::graph::NodeIndex::new(state as usize);
            for edge in kept() {
                graph.update_edge(node(edge.from), node(edge.to), ());
            }
            let mut component = vec![0_usize; states.states.len()];
            for (number, members) in petgraph::algo::tarjan_scc(&graph).into_iter().enumerate() {
                members.into_iter().for_each(|member| component[member.index()] = number);
            }
            // It loses on an edge within a strongly connected part, so it can lose there for ever. Something else must have fired on it.
            let loses = kept().any(|edge| {
                edge.lost >> bit & 1 == 1
                    && edge.fires
                    && component[edge.from as usize] == component[edge.to as usize]
            });
            if loses {
                starving.entry(net.transitions[*rival].requires[0]).or_default().push(*rival);
            }
        }
        for (step, transitions) in starving.into_iter().take(OF_A_KIND) {
            let names: Vec<String> = transitions
                .iter()
                .map(|transition| format!("`{}`", net.transitions[*transition].name))
                .collect();
            let mut note = Diagnostic::note(
                codes::STARVATION,
                format!(
                    "{} can starve at step `{}`: others may win every time",
                    names.join(", "),
                    net.steps[step].name
                ),
            );
            for transition in &transitions {
                note = note.at(
                    net.transitions[*transition].meta.span,
                    "may wait for ever though its receptivity holds again and again",
                );
            }
            let help = match net.settings.policy {
                Policy::Priority => {
                    "`conflict priority-age` lets the branch go first that has waited longest"
                }
                Policy::PriorityAge => {
                    "give the steps that follow the same priority: among equals the oldest goes first"
                }
                Policy::All | Policy::InnerFirst | Policy::OuterFirst => {
                    "let the receptivities exclude each other"
                }
            };
            out.push(note.help(help));
        }
    }
}

/// A situation that is meant to be the end: final states, or only steps that nothing leaves.
fn is_end(net: &Net, situation: &Situation) -> bool {
    if net.settings.policy.is_statechart() {
        return situation.iter().any(|step| net.steps[step].kind == StepKind::Final);
    }
    situation
        .iter()
        .all(|step| !net.transitions.values().any(|transition| transition.requires.contains(&step)))
}

/// How to get there, for a message.
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
                    input.name.text.clone()
                } else {
                    format!("{}={}", input.name, row.value(id))
                }
            })
            .collect();
        let mut text = if values.is_empty() { "-".to_owned() } else { values.join(",") };
        if row.dt != 1 {
            text += &format!(" dt={}", row.dt);
        }
        rows.push(text);
    }
    match stimulus.len() {
        0 => " (after reset)".to_owned(),
        n if n <= ROWS => format!(" (after the rows {})", rows.join("; ")),
        n => format!(" (after {n} rows, beginning {})", rows.join("; ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::facts;
    use crate::testing::{chart, valid};

    fn found(net: Net) -> Vec<&'static str> {
        let net = valid(net);
        lints(&net, &facts(&net, &Limits::default()))
            .iter()
            .map(|diagnostic| diagnostic.code.id)
            .collect()
    }

    #[test]
    fn a_good_chart_is_quiet() {
        assert!(found(chart("a* b c | a>b:x b>c:y c>a:nx")).is_empty());
        assert!(found(chart("s* a b | s>a:x s>b:nx a>s:y b>s:y")).is_empty());
    }

    #[test]
    fn what_never_happens_is_reported_once() {
        assert_eq!(found(chart("a* b c d | a>b:x b>a:nx c>d:x d>c:x")), ["G0801", "G0801"]);
    }

    #[test]
    fn a_join_that_waits_for_ever_is_a_dead_end() {
        let found = found(chart("s* a b c | s>a:x s>b:nx a,b>c c>s"));
        assert!(found.contains(&"G0803"), "{found:?}");
    }

    #[test]
    fn a_conflict_is_reported_under_all_only() {
        let fig5 = || chart("s* a b | s>a:x s>b:y a>s:nx b>s:ny");
        assert_eq!(found(fig5()), ["G0804"]);
        let mut net = fig5();
        net.settings.policy = Policy::PriorityAge;
        assert!(found(net).is_empty());
    }

    #[test]
    fn who_always_loses_starves() {
        let arbiter = |policy| {
            let mut net = chart("f* a b c | f>a:x f>b:y f>c:z a>f:t b>f:t c>f:t");
            net.settings.policy = policy;
            found(net)
        };
        assert_eq!(arbiter(Policy::Priority), ["G0808"]);
        assert!(arbiter(Policy::PriorityAge).is_empty());
    }

    #[test]
    fn a_chart_that_turns_for_ever_is_an_error() {
        let mut net = chart("a* b | a>b:x b>a:x");
        net.settings.evolution = Evolution::Stable { limit: 4 };
        let net = valid(net);
        let diagnostics = lints(&net, &facts(&net, &Limits::default()));
        assert!(
            diagnostics.iter().any(|one| one.code == codes::LIVELOCK && one.is_error()),
            "{diagnostics:?}"
        );
        let mut net = chart("a* b c d | a>b:x b>c:t c>d:t d>a:nx");
        net.settings.evolution = Evolution::Stable { limit: 2 };
        let net = valid(net);
        let diagnostics = lints(&net, &facts(&net, &Limits::default()));
        assert!(
            diagnostics.iter().any(|one| one.code == codes::LIVELOCK && !one.is_error()),
            "{diagnostics:?}"
        );
    }
}
