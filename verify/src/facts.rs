//! All facts about a net, for reports and back ends.

use grafsynth_ir::Gather;
use std::collections::BTreeSet;

use grafsynth_ir::Valid;
use grafsynth_ir::arena::IdMap;
use grafsynth_ir::facts::{Component, Facts, Invariant, Proof, Proved, Reach};
use grafsynth_ir::net::{
    Enter, Evolution, ForcingOrder, Net, Step, StepId, StepKind, StmtKind, Transition,
    TransitionId, TransitionKind,
};
use grafsynth_sim::{Directed, MAX_DT, Simulator};
use indexmap::IndexSet;

use crate::cover::{self, cover};
use crate::exclusive::entered;
use crate::explore::{Searched, Seen, States, explore_any};
use crate::far::{self, Far};
use crate::limits::Limits;
use crate::symbolic::{self, Reached};
use crate::verdict::OpenReason;

/// The maximum number of steps outside components for which a decision diagram is queried about every pair.
const PAIRED: usize = 128;

/// The proved facts of a net. [`Facts::open`] lists what was not decided within the limits; nothing in the other fields is a guess.
///
/// Facts about situations apply to every stimulus that satisfies the chart's assumptions, with any `dt`.
#[must_use]
pub fn facts(net: &Valid<Net>, limits: &Limits) -> Facts {
    let note = |watch: &mut Watch<'_>, _: &States, seen: &Seen<'_, '_>| {
        watch.note_reaction(seen);
        None::<()>
    };
    let limits = &far::within(net, limits);
    let (Searched { seen, states, ended, .. }, _) =
        explore_any(net, limits, || Watch::new(net), note);
    facts_of(net, limits, &seen, &states, ended.open(), || diagram_facts(net, limits))
}

/// The facts of a net, given the results of a search within these limits, the reason why it did not end, if so, and the facts from a decision diagram.
pub(crate) fn facts_of(
    net: &Valid<Net>,
    limits: &Limits,
    watch: &Watch<'_>,
    states: &States,
    open: Option<&OpenReason>,
    by_diagram: impl FnOnce() -> Result<Facts, String>,
) -> Facts {
    let Some(why) = open else {
        let mut facts = structural_facts(net);
        explicit_facts(net, limits, watch, states, &mut facts);
        return facts;
    };
    by_diagram().unwrap_or_else(|again| {
        let mut facts = structural_facts(net);
        facts.all_dead_known = is_all_else_seen(net, limits, watch, &facts);
        facts.open.push(format!(
            "not all states were enumerated: {why}; the decision diagram failed too: {again}"
        ));
        facts
    })
}

/// True if runs show every step and every transition that the structure does not exclude.
fn is_all_else_seen(net: &Valid<Net>, limits: &Limits, watch: &Watch<'_>, facts: &Facts) -> bool {
    let mut unseen: BTreeSet<TransitionId> = net.transitions.ids().gather();
    facts.dead_transitions.iter().for_each(|dead| {
        unseen.remove(dead);
    });
    let mut untouched: BTreeSet<StepId> = net.steps.ids().gather();
    facts.unreachable_steps.iter().for_each(|step| {
        untouched.remove(step);
    });
    let mut see = |fired: &mut dyn Iterator<Item = TransitionId>, steps: &[StepId]| {
        for transition in fired.filter(|transition| unseen.remove(transition)) {
            entered(&net.transitions[transition]).for_each(|step| {
                untouched.remove(&step);
            });
        }
        steps.iter().for_each(|step| {
            untouched.remove(step);
        });
        unseen.is_empty() && untouched.is_empty()
    };
    see(&mut net.transitions.ids().filter(|it| watch.fired[*it]), &[]);
    let mut runs = Directed::new(net, 1, MAX_DT);
    let mut is_seen = see(&mut runs.simulator().fired().iter().copied(), &runs.row().steps);
    for _ in 0..limits.random_rows {
        if is_seen || runs.next().is_none() {
            break;
        }
        is_seen = see(&mut runs.simulator().fired().iter().copied(), &runs.row().steps);
    }
    if !is_seen {
        Far::of(net, limits).each(net, |simulator| {
            is_seen = see(&mut simulator.fired().iter().copied(), &simulator.row().steps);
        });
    }
    is_seen
}

/// The facts that follow from the structure of a net: cheap for any size.
#[must_use]
pub fn structural_facts(net: &Valid<Net>) -> Facts {
    let cover = cover(net);
    let mut facts = Facts {
        component_of: (!cover.components.is_empty()).then_some(cover.component_of),
        components: cover.components,
        invariants: cover.invariants,
        ..Facts::default()
    };
    let reached = reached(net);
    facts.unreachable_steps =
        reached.iter().filter(|(_, reached)| !**reached).map(|(step, _)| step).collect();
    facts.dead_transitions = net
        .transitions
        .iter()
        .filter(|(_, transition)| {
            transition.guard.is_false() || transition.requires.iter().any(|step| !reached[*step])
        })
        .map(|(id, _)| id)
        .collect();
    facts
}

/// Steps that some sequence of transitions could activate, if every receptivity except `false` could be true at any time.
fn reached(net: &Net) -> IdMap<Step, bool> {
    let mut spread = Spread {
        net,
        reached: IdMap::filled(&net.steps, false),
        todo: Vec::new(),
        links: IdMap::filled(&net.steps, Vec::new()),
    };
    for (id, step) in net.steps.iter() {
        if let Some(parent) = step
            .parent
            .filter(|parent| step.activation_link && net.steps[*parent].kind == StepKind::Enclosing)
        {
            spread.links[parent].push(id);
        }
    }
    cover::initial_situation(net).into_iter().for_each(|step| spread.reach(step));
    for part in net.parts.values() {
        spread.enters(&part.initial);
    }
    let mut waiting: IdMap<Transition, usize> =
        IdMap::build(&net.transitions, |_, transition| transition.requires.len());
    let mut leaving: IdMap<Step, Vec<TransitionId>> = IdMap::filled(&net.steps, Vec::new());
    for (id, transition) in net.transitions.iter() {
        transition.requires.iter().for_each(|step| leaving[*step].push(id));
        if transition.requires.is_empty() && !transition.guard.is_false() {
            spread.enters(&transition.enters);
        }
    }
    while let Some(step) = spread.todo.pop() {
        for id in &leaving[step] {
            waiting[*id] -= 1;
            let transition = &net.transitions[*id];
            if waiting[*id] == 0
                && transition.kind == TransitionKind::Move
                && !transition.guard.is_false()
            {
                spread.enters(&transition.enters);
            }
        }
        for forcing in net.forcings.iter().filter(|forcing| forcing.step == step) {
            if let ForcingOrder::Situation(steps) = &forcing.order {
                steps.iter().for_each(|step| spread.reach(*step));
            }
        }
    }
    spread.reached
}

struct Spread<'n> {
    net: &'n Net,
    reached: IdMap<Step, bool>,
    todo: Vec<StepId>,
    links: IdMap<Step, Vec<StepId>>,
}

impl Spread<'_> {
    fn reach(&mut self, step: StepId) {
        let mut waiting = vec![step];
        while let Some(step) = waiting.pop() {
            if !self.reached[step] {
                self.reached[step] = true;
                self.todo.push(step);
                waiting.extend(self.links[step].iter().copied());
            }
        }
    }

    fn enters(&mut self, enters: &[Enter]) {
        let mut lists: Vec<&[Enter]> = vec![enters];
        let mut seen: BTreeSet<usize> = BTreeSet::new();
        while let Some(list) = lists.pop() {
            for enter in list {
                match enter {
                    Enter::Step(step) => self.reach(*step),
                    Enter::InitialContent(_) => {}
                    // Recorded states of a history were reached before; its default may not have been.
                    Enter::History(history) => {
                        if seen.insert(history.index()) {
                            lists.push(&self.net.histories[*history].default);
                            for case in &self.net.histories[*history].cases {
                                if self.reached[case.step] {
                                    lists.push(&case.enters);
                                }
                            }
                        }
                    }
                }
            }
        }
    }
}

/// The results collected from the visited reactions.
pub(crate) struct Watch<'n> {
    net: &'n Net,
    fired: IdMap<Transition, bool>,
    touched: IdMap<Step, bool>,
    most: Most,
    unstable: bool,
}

impl<'n> Watch<'n> {
    pub(crate) fn new(net: &'n Valid<Net>) -> Self {
        let at_reset = Simulator::new(net);
        let mut watch = Watch {
            net,
            fired: IdMap::filled(&net.transitions, false),
            touched: IdMap::filled(&net.steps, false),
            most: Most::default(),
            unstable: at_reset.row().fault,
        };
        // The reset is a reaction too: a statechart runs to completion in it.
        watch.note(&at_reset);
        watch
    }

    pub(crate) fn note_reaction(&mut self, seen: &Seen<'_, '_>) {
        self.note(seen.simulator);
        self.unstable |= seen.row.fault;
    }

    fn note(&mut self, simulator: &Simulator<'_>) {
        for transition in simulator.fired() {
            self.fired[*transition] = true;
            // A transient step is active only between two micro-steps.
            entered(&self.net.transitions[*transition]).for_each(|step| self.touched[step] = true);
        }
        self.most.note(simulator);
    }
}

/// Situations, unreachable objects and the depth of reactions, by enumeration of all states.
fn explicit_facts(
    net: &Valid<Net>,
    limits: &Limits,
    watch: &Watch<'_>,
    states: &States,
    facts: &mut Facts,
) {
    let Watch { fired, touched, most, unstable, .. } = watch;
    let mut situations: IndexSet<Vec<u64>> = IndexSet::new();
    let mut active = IdMap::filled(&net.steps, false);
    for situation in states.situations() {
        situations.insert(situation.words().to_vec());
        situation.iter().for_each(|step| active[step] = true);
    }
    facts.reach = Some(Reach {
        situations: situations.len() as u128,
        exact: true,
        by: Proof::Explicit,
        sets: (situations.len() <= limits.listed_situations)
            .then(|| situations.iter().cloned().collect()),
    });
    if shows_all_steps(net) {
        facts.unreachable_steps =
            net.steps.ids().filter(|step| !active[*step] && !touched[*step]).collect();
    }
    facts.dead_transitions =
        net.transitions.ids().filter(|transition| !fired[*transition]).collect();
    facts.all_dead_known = true;
    // Within a reaction there may be situations that no row shows. So the rows show all steps that are active together only if a reaction has a single
    // micro-step.
    if net.settings.evolution == Evolution::Single {
        explicit_components(net, &situations, facts);
    }
    if matches!(net.settings.evolution, Evolution::Stable { .. }) && !*unstable {
        let by = Proof::Explicit;
        facts.always_stable = Some(by);
        facts.rounds = Some(Proved { value: most.rounds.max(1), by });
        // In a statechart the limit restarts with each external event, so it does not bound the reaction.
        facts.stable_depth = (!net.settings.policy.is_statechart())
            .then(|| Proved { value: most.micro_steps.max(1), by });
    }
    if net.settings.queue.is_some() {
        facts.single_pending = if !raises_anything(net) {
            Some(Proved { value: true, by: Proof::Structural })
        } else {
            (!*unstable && most.internal <= 1)
                .then_some(Proved { value: true, by: Proof::Explicit })
        };
    }
}

/// The maxima over all reactions.
#[derive(Debug, Default)]
struct Most {
    rounds: u32,
    micro_steps: u32,
    /// The number of events in the internal queue at the same time.
    internal: usize,
}

impl Most {
    fn note(&mut self, simulator: &Simulator<'_>) {
        let more = simulator.asked().map_or(0, |asked| asked.more_rounds);
        self.rounds = self.rounds.max(simulator.rounds() + more);
        self.micro_steps = self.micro_steps.max(simulator.micro_steps());
        self.internal = self.internal.max(simulator.longest_internal());
    }
}

/// True if every step that is ever active is in some situation or is entered by a transition that fires. Enclosed steps may become active and
/// inactive again within a reaction without either, so with such steps only those that the structure excludes are known to be unreachable.
fn shows_all_steps(net: &Net) -> bool {
    net.steps.values().all(|step| step.parent.is_none()) && net.forcings.is_empty()
        || net.settings.evolution == Evolution::Single
}

/// The facts from a decision diagram of all reachable states, for charts with too many states to enumerate. The error is the reason why there is no diagram.
pub(crate) fn diagram_facts(net: &Valid<Net>, limits: &Limits) -> Result<Facts, String> {
    let mut facts = structural_facts(net);
    let mut reached = symbolic::reach(net, &facts, limits, &[], &[])?;
    let situations = reached.count();
    if situations == u128::MAX {
        facts.open.push(
            "more than 10^38 situations are reachable; the exact number was not counted".to_owned(),
        );
    }
    if !reached.exact {
        facts.open.push(
            "the count of situations may include some that an assumption on outputs excludes"
                .to_owned(),
        );
    }
    facts.reach = Some(Reach {
        situations,
        exact: reached.exact && situations != u128::MAX,
        by: Proof::Symbolic,
        sets: None,
    });
    // The diagram starts after reset, which is a reaction too.
    let at_reset = Simulator::new(net);
    at_reset.fired().iter().for_each(|transition| reached.fires[transition.index()] = true);
    let mut seen = IdMap::filled(&net.steps, false);
    for (transition, _) in net.transitions.values().zip(&reached.fires).filter(|(_, fires)| **fires)
    {
        entered(transition).for_each(|step| seen[step] = true);
    }
    if shows_all_steps(net) {
        for step in net.steps.ids() {
            seen[step] = seen[step] || reached.together(&[step])?;
        }
        facts.unreachable_steps = net.steps.ids().filter(|step| !seen[*step]).collect();
    }
    facts.dead_transitions = net
        .transitions
        .ids()
        .zip(&reached.fires)
        .filter(|(_, fires)| !**fires)
        .map(|(id, _)| id)
        .collect();
    facts.all_dead_known = reached.exact;
    match net.settings.evolution {
        Evolution::Single => symbolic_components(net, &mut reached, &mut facts)?,
        Evolution::Stable { .. } => {
            let depth = reached.depth.map(|depth| depth.max(at_reset.micro_steps()).max(1));
            facts.stable_depth = depth.map(|value| Proved { value, by: Proof::Symbolic });
        }
    }
    Ok(facts)
}

/// Adds components that only the reachable situations show.
fn symbolic_components(net: &Net, reached: &mut Reached, facts: &mut Facts) -> Result<(), String> {
    let left = outside_components(net, facts);
    if left.is_empty() || left.len() > PAIRED {
        return Ok(());
    }
    let mut together = vec![vec![false; left.len()]; left.len()];
    for a in 0..left.len() {
        for b in 0..=a {
            let both = reached.together(&[left[a], left[b]])?;
            together[a][b] = both;
            together[b][a] = both;
        }
    }
    let mut found = Vec::new();
    for steps in apart(net, &left, &together) {
        let always = reached.always_one(&steps)?;
        found.push((steps, always));
    }
    add_components(net, found, Proof::Symbolic, facts);
    Ok(())
}

/// Adds components that only the enumeration shows: steps outside the structural components that are never active together.
fn explicit_components(net: &Net, situations: &IndexSet<Vec<u64>>, facts: &mut Facts) {
    let contains =
        |words: &Vec<u64>, step: StepId| words[step.index() / 64] >> (step.index() % 64) & 1 == 1;
    let left = outside_components(net, facts);
    if left.is_empty() || left.len() > 512 || left.len() * situations.len() > 50_000_000 {
        return;
    }
    // Which of them are ever active together.
    let mut together = vec![vec![false; left.len()]; left.len()];
    for words in situations {
        let active: Vec<usize> = (0..left.len()).filter(|at| contains(words, left[*at])).collect();
        for a in &active {
            for b in &active {
                together[*a][*b] = true;
            }
        }
    }
    let always = |steps: &Vec<StepId>| {
        situations.iter().all(|words| steps.iter().any(|step| contains(words, *step)))
    };
    let found = apart(net, &left, &together)
        .into_iter()
        .map(|steps| {
            let always = always(&steps);
            (steps, always)
        })
        .collect();
    add_components(net, found, Proof::Explicit, facts);
}

/// The steps that are not in a component yet.
fn outside_components(net: &Net, facts: &Facts) -> Vec<StepId> {
    let is_outside =
        |step: &StepId| facts.component_of.as_ref().is_none_or(|map| map[*step].is_none());
    net.steps.ids().filter(is_outside).collect()
}

/// Greedy sets of at least two steps of `left`, in declaration order, of which no two are ever active together.
fn apart(net: &Net, left: &[StepId], together: &[Vec<bool>]) -> Vec<Vec<StepId>> {
    let mut is_free: Vec<bool> =
        left.iter().map(|step| net.steps[*step].parent.is_none()).collect();
    let mut sets = Vec::new();
    for first in 0..left.len() {
        if !is_free[first] {
            continue;
        }
        let mut members = vec![first];
        for other in first + 1..left.len() {
            if is_free[other] && members.iter().all(|member| !together[*member][other]) {
                members.push(other);
            }
        }
        if members.len() >= 2 {
            members.iter().for_each(|member| is_free[*member] = false);
            sets.push(members.into_iter().map(|member| left[member]).collect());
        }
    }
    sets
}

/// Adds components; the flag of each is true if one of its steps is always active.
fn add_components(net: &Net, found: Vec<(Vec<StepId>, bool)>, by: Proof, facts: &mut Facts) {
    let mut component_of =
        facts.component_of.take().unwrap_or_else(|| IdMap::filled(&net.steps, None));
    for (steps, always) in found {
        let number = facts.components.len() as u32;
        steps.iter().for_each(|step| component_of[*step] = Some(number));
        if always {
            facts.invariants.push(Invariant { steps: steps.clone(), count: 1, by });
        }
        facts.components.push(Component { steps, always, by });
    }
    facts.component_of = Some(component_of);
}

fn raises_anything(net: &Net) -> bool {
    let mut raises = net.steps.values().any(|step| step.done_event.is_some());
    for stmt in net.statements() {
        raises |= matches!(stmt.kind, StmtKind::Raise(_) | StmtKind::Send(_))
    }
    raises
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{chart, names, valid};

    fn of(text: &str) -> (Facts, Valid<Net>) {
        let net = valid(chart(text));
        (facts(&net, &Limits::default()), net)
    }

    #[test]
    fn a_small_chart_is_known_completely() {
        let (facts, net) = of("a* b c d | a>b:x b>a:nx c>d:x");
        let reach = facts.reach.expect("enumerated");
        assert_eq!((reach.situations, reach.exact, reach.by), (2, true, Proof::Explicit));
        assert_eq!(names(&net, &facts.unreachable_steps), "c d");
        assert_eq!(facts.dead_transitions.len(), 1);
        assert_eq!(facts.components[0].steps.len(), 2);
        assert!(facts.components[0].always);
    }

    #[test]
    fn what_the_structure_cannot_know_the_enumeration_does() {
        // The token moves through b or c, never both, because `x` and `not x` exclude each other.
        let (facts, net) = of("a* b c d | a>b:x a>c:nx b>d:x c>d:nx");
        assert_eq!(facts.reach.map(|reach| reach.situations), Some(4));
        assert_eq!(names(&net, &facts.unreachable_steps), "");
        let (facts, _) = of("s* a b | s>a:x s>b:y a>s:nx b>s:ny");
        assert!(
            facts
                .components
                .iter()
                .all(|component| component.by == Proof::Explicit || component.steps.len() == 1)
        );
    }

    #[test]
    fn the_depth_of_a_stable_chart() {
        let mut net = chart("a* b c d | a>b:x b>c:t c>d:t d>a:nx");
        net.settings.evolution = Evolution::Stable { limit: 9 };
        let facts = facts(&valid(net), &Limits::default());
        assert_eq!(facts.stable_depth, Some(Proved { value: 3, by: Proof::Explicit }));
    }

    #[test]
    fn limits_end_the_search() {
        let net = valid(chart("a* b c d | a>b:x b>c:y c>d:z d>a:w"));
        let facts = facts(&net, &Limits { pairs: 4, image_work: 10, ..Limits::default() });
        assert!(facts.reach.is_none());
        assert_eq!(facts.open.len(), 1);
        assert!(facts.open[0].contains("10 steps of work"), "{:?}", facts.open);
        assert_eq!(facts.components.len(), 1);
    }
}
