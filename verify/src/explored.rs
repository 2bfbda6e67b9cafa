//! One search of all reachable states that answers all questions about them.

use grafsynth_ir::facts::Facts;
use grafsynth_ir::net::Net;
use grafsynth_ir::{Diagnostic, Valid};

use crate::explore::{Searched, explore_any};
use crate::facts::{Watch, facts_of};
use crate::far;
use crate::limits::Limits;
use crate::lints::{self, Findings, Search, Shown, findings_in};
use crate::properties::{
    Outcome, PropertyVerdict, asserts, at_reset, decide, either, note_violations, properties,
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
        let (mut search, given_up) = explore_any(net, limits, begin, |collected, states, seen| {
            collected.watch.note_reaction(seen);
            collected.shown.note(states, seen);
            // When all assertions are refuted, the other questions still need the rest of the search.
            let _ = note_violations(net, &asserts, &mut collected.outcomes, states, seen, true);
            None
        });
        search.seen.shown.settle();
        Explored { net, limits: limits.clone(), search, given_up }
    }

    /// Like [`facts`](crate::facts).
    #[must_use]
    pub fn facts(&self) -> Facts {
        let Searched { seen, states, ended, .. } = &self.search;
        facts_of(self.net, &self.limits, &seen.watch, states, ended)
    }

    /// Like [`findings`](crate::findings). `facts` must belong to the same net.
    #[must_use]
    pub fn findings(&self, facts: &Facts) -> Findings {
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
        // If times are counted, the analysis needs other states than these.
        if Relevance::of(self.net).has_time() || limits.pairs > self.limits.pairs {
            return waiting(self.net, limits);
        }
        if rivals(self.net).is_empty() {
            return Ok(Vec::new());
        }
        let Searched { states, ended, .. } = &self.search;
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
