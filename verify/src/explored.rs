//! One search of all reachable states that answers all questions about them.

use std::cell::OnceCell;

use grafsynth_ir::facts::{Component, Facts};
use grafsynth_ir::net::{Net, Property};
use grafsynth_ir::{Diagnostic, Valid};

use crate::explore::{Ended, Searched, States, explore_any};
use crate::facts::{Watch, diagram_facts, facts_of, structural_facts};
use crate::far;
use crate::limits::Limits;
use crate::lints::{self, Findings, Search, Shown, findings_in};
use crate::properties::{
    Outcome, PropertyVerdict, asserts, at_reset, decide, decide_soon, either, note_violations,
    properties,
};
use crate::relevance::Relevance;
use crate::verdict::OpenReason;
use crate::waiting::{Waiting, rivals, waiting};

/// The results of one search of all reachable states of a net: its facts, its lints, its asserts, and how long transitions wait. Each result is the one
/// that [`facts`](crate::facts), [`findings`](crate::findings), [`properties`] and [`waiting`] return with the same limits; the states are visited only
/// once.
pub struct Explored<'n> {
    net: &'n Valid<Net>,
    limits: Limits,
    search: Searched<Collected<'n>, ()>,
    /// An earlier search that was abandoned.
    given_up: Option<Searched<Collected<'n>, ()>>,
    /// All answers, if they were found without the rest of the search.
    answers: Option<Answers>,
    /// The facts from a decision diagram, if one was made within all limits during the search.
    by_diagram: OnceCell<Result<Facts, String>>,
}

/// The number of reactions after which the other methods are asked whether they answer everything without the rest of the search.
const SOON: u64 = 20_000;
/// The maximum number of reactions of a search that can only add the number of situations.
const COUNTED: u64 = 100_000;
/// If the search may end soon, the other methods are first tried with their work divided by this number.
const PART: u64 = 10;

/// The answers to all questions that need all states.
struct Answers {
    facts: Facts,
    findings: Findings,
    verdicts: Vec<PropertyVerdict>,
}

/// The data collected from the reactions.
struct Collected<'n> {
    watch: Watch<'n>,
    shown: Shown<'n>,
    outcomes: Vec<Option<Outcome>>,
}

impl<'n> Explored<'n> {
    /// Searches all states within the limits.
    #[must_use]
    pub fn of(net: &'n Valid<Net>, limits: &Limits) -> Self {
        let limits = &far::within(net, limits);
        let asserts = asserts(net);
        let begin = || Collected {
            watch: Watch::new(net),
            shown: Shown::new(net),
            outcomes: at_reset(net, &asserts),
        };
        let (answers, by_diagram) = (OnceCell::new(), OnceCell::new());
        let (mut search, given_up) = explore_any(net, limits, begin, |collected, states, seen| {
            collected.watch.note_reaction(seen);
            collected.shown.note(states, seen);
            // When all assertions are refuted, the other questions still need the rest of the search.
            let _ = note_violations(net, &asserts, &mut collected.outcomes, states, seen, true);
            if states.pairs < SOON || limits.pairs <= SOON {
                return None;
            }
            let find = || collected.answers(net, limits, &asserts, states, &by_diagram);
            let answers: &Option<Answers> = answers.get_or_init(find);
            let is_counted = |it: &Answers| it.facts.reach.is_some() || states.pairs >= COUNTED;
            answers.as_ref().is_some_and(is_counted).then_some(())
        });
        search.seen.shown.settle();
        let is_stopped = matches!(search.ended, Ended::Stopped(()));
        let answers = answers.into_inner().flatten().filter(|_| is_stopped);
        Explored { net, limits: limits.clone(), search, given_up, answers, by_diagram }
    }

    /// Like [`facts`](crate::facts).
    #[must_use]
    pub fn facts(&self) -> Facts {
        if let Some(answers) = &self.answers {
            return answers.facts.clone();
        }
        let Searched { seen, states, ended, .. } = &self.search;
        let diagram = || self.by_diagram.get_or_init(|| diagram_facts(self.net, &self.limits));
        let by_diagram = || diagram().clone();
        facts_of(self.net, &self.limits, &seen.watch, states, ended.open(), by_diagram)
    }

    /// Like [`findings`](crate::findings). `facts` must belong to the same net.
    #[must_use]
    pub fn findings(&self, facts: &Facts) -> Findings {
        if let Some(answers) = &self.answers {
            return answers.findings.clone();
        }
        let last = &self.search;
        let search = Search {
            shown: &last.seen.shown,
            widest: &self.widest().seen.shown,
            states: &last.states,
            open: last.ended.open(),
            by_zones: last.by_zones,
        };
        findings_in(self.net, facts, &self.limits, search)
    }

    /// Like [`properties`]; a search that did not end is repeated if the limits are now different.
    #[must_use]
    pub fn properties(&self, limits: &Limits) -> Vec<PropertyVerdict> {
        let asserts = asserts(self.net);
        if asserts.is_empty() {
            return Vec::new();
        }
        if let Some(answers) = &self.answers {
            return answers.verdicts.clone();
        }
        let Searched { seen, states, ended, .. } = &self.search;
        if ended.open().is_some() && *limits != self.limits {
            return properties(self.net, limits);
        }
        let given_up = self.given_up.as_ref().map(|it| it.seen.outcomes.clone());
        let outcomes = either(seen.outcomes.clone(), given_up);
        decide(self.net, limits, &asserts, outcomes, states, ended)
    }

    /// The number of asserts that the search itself refutes; [`Explored::properties`] may refute more by other methods.
    #[must_use]
    pub fn refuted(&self) -> usize {
        let given_up = self.given_up.as_ref().map(|it| it.seen.outcomes.clone());
        let outcomes = either(self.search.seen.outcomes.clone(), given_up);
        outcomes.iter().filter(|one| matches!(one, Some(Outcome::Refuted { .. }))).count()
    }

    /// Like [`waiting`].
    ///
    /// # Errors
    /// Like [`waiting`].
    pub fn waiting(&self, limits: &Limits) -> Result<Vec<Waiting>, OpenReason> {
        if rivals(self.net).is_empty() {
            return Ok(Vec::new());
        }
        let Searched { states, ended, by_zones, .. } = &self.search;
        let most = if self.answers.is_some() { limits.pairs.min(COUNTED) } else { limits.pairs };
        // The analysis needs more nodes than a search with zones.
        if *by_zones && !matches!(ended, Ended::Complete) && states.pairs >= most {
            return Err(OpenReason::Pairs { limit: most, states: states.len() });
        }
        // If times are counted, it needs other states than these.
        if Relevance::of(self.net).has_time() || limits.pairs > self.limits.pairs {
            return waiting(self.net, limits);
        }
        states.within(limits.pairs)?;
        match ended.open() {
            Some(why) => Err(why.clone()),
            None => waiting(self.net, limits),
        }
    }

    /// If no search ended, the one that visited the most; otherwise the search that gives the answer.
    fn widest(&self) -> &Searched<Collected<'n>, ()> {
        match &self.given_up {
            Some(given_up) if self.search.ended.open().is_some() => given_up,
            Some(_) | None => &self.search,
        }
    }
}

impl Collected<'_> {
    /// The answers of the other methods, with the results of a search so far; `None` unless every question has an answer.
    fn answers(
        &self,
        net: &Valid<Net>,
        limits: &Limits,
        asserts: &[(usize, &Property)],
        states: &States,
        by_diagram: &OnceCell<Result<Facts, String>>,
    ) -> Option<Answers> {
        // If the structure allows few situations, the search may end soon, and other methods must not take longer.
        let is_needed = most_situations(net) > u128::from(limits.pairs);
        let part = if is_needed { 1 } else { PART };
        let (image_work, conflicts) = (limits.image_work / part, limits.conflicts / part);
        let limits = &Limits { image_work, conflicts, ..limits.clone() };
        let verdicts = decide_soon(net, limits, asserts, &self.outcomes)?;
        let why = OpenReason::Pairs { limit: SOON, states: states.len() };
        let diagram = || match is_needed {
            true => by_diagram.get_or_init(|| diagram_facts(net, limits)).clone(),
            false => diagram_facts(net, limits),
        };
        let facts = facts_of(net, limits, &self.watch, states, Some(&why), diagram);
        let shown = &self.shown;
        // The search goes on, if necessary; no other one is begun now.
        let search = Search { shown, widest: shown, states, open: Some(&why), by_zones: false };
        let findings = findings_in(net, &facts, limits, search);
        let is_exact = facts.reach.as_ref().is_none_or(|reach| reach.exact);
        let is_complete = is_exact && findings.checked.iter().all(|one| one.open.is_none());
        is_complete.then_some(Answers { facts, findings, verdicts })
    }
}

/// The number of situations that the structure allows.
fn most_situations(net: &Valid<Net>) -> u128 {
    let facts = structural_facts(net);
    let n_covered: usize = facts.components.iter().map(|it| it.steps.len()).sum();
    let alone = (n_covered..net.steps.len()).map(|_| 2);
    let of = |it: &Component| it.steps.len() as u128 + u128::from(!it.always);
    alone.chain(facts.components.iter().map(of)).fold(1, u128::saturating_mul)
}

/// All findings about a net, in a fixed order. `facts` must belong to the same net.
#[must_use]
pub fn lints(net: &Valid<Net>, facts: &Facts) -> Vec<Diagnostic> {
    findings(net, facts, &Limits::default()).found
}

/// Like [`lints`], with given limits for the search, and with the list of checks.
#[must_use]
pub fn findings(net: &Valid<Net>, facts: &Facts, limits: &Limits) -> Findings {
    let limits = lints::limits(facts, limits);
    Explored::of(net, &limits).findings(facts)
}
