//! Warnings about probable mistakes. Every finding is shown by an exhaustive search or follows from the structure of the chart; nothing is reported on
//! suspicion, and checks that were not carried out are listed.

mod constant;
mod decided;
mod livelock;
mod search;
mod starving;
mod structural;

pub(crate) use search::{Search, Shown, limits};

use grafsynth_ir::Gather;
use std::collections::{BTreeMap, BTreeSet};

use grafsynth_ir::diag::joined;
use grafsynth_ir::facts::Facts;
use grafsynth_ir::net::{Net, StepId, TransitionId, TransitionKind, VarId};
use grafsynth_ir::{Diagnostic, Valid};

use crate::codes;
use crate::limits::Limits;
use crate::properties::check_assumption;
use crate::verdict::OpenReason;

/// The checks of a chart.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Check {
    /// Steps that are never active and transitions that never fire.
    Unreachable,
    /// Transitions that leave one step together.
    Conflicts,
    /// Situations that the chart never leaves.
    DeadEnds,
    /// Two writers of one variable, values outside a range, lost events, and forcing orders that contradict each other.
    Races,
    /// Reactions that do not become stable within the limit of micro-steps.
    Livelock,
    /// Branches that others can block for ever.
    Starvation,
    /// Variables that others access while the tasks of a step are partly done.
    Sharing,
}

impl Check {
    /// The name of the check in a report.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Check::Unreachable => "unreachable",
            Check::Conflicts => "conflicts",
            Check::DeadEnds => "dead ends",
            Check::Races => "races",
            Check::Livelock => "livelock",
            Check::Starvation => "starvation",
            Check::Sharing => "sharing",
        }
    }
}

/// The result of one check: completed or open.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Checked {
    /// The check.
    pub check: Check,
    /// The reason why the check was not completed; `None` if it was completed.
    pub open: Option<OpenReason>,
}

/// Two transitions that share a preceding step and fire in one micro-step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Conflict {
    /// The first step that both transitions leave.
    pub step: StepId,
    /// The transition that is declared first.
    pub first: TransitionId,
    /// The other transition.
    pub second: TransitionId,
}

/// Two transitions that were fireable in one micro-step; the conflict policy let one of them fire.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Decided {
    /// The transition that fired.
    pub winner: TransitionId,
    /// The transition that did not fire. If either can win, the pair is listed twice.
    pub loser: TransitionId,
}

/// The findings about a chart, and the checks that were carried out.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Findings {
    /// All findings, in a fixed order.
    pub found: Vec<Diagnostic>,
    /// All pairs in conflict, except those for which firing both is the same as firing one.
    pub conflicts: Vec<Conflict>,
    /// Conflicts that the conflict policy resolves; these are correct.
    pub decided: Vec<Decided>,
    /// Notes about the resolved conflicts, which are shown on request.
    pub notes: Vec<Diagnostic>,
    /// The situations in which nothing ever fires again, except intended ends.
    pub dead_ends: Vec<Vec<StepId>>,
    /// One entry for each check that this chart can fail.
    pub checked: Vec<Checked>,
}

/// The findings about a net that was searched within these limits.
pub(crate) fn findings_in(
    net: &Valid<Net>,
    facts: &Facts,
    limits: &Limits,
    search: Search<'_, '_>,
) -> Findings {
    let mut findings = Findings::default();
    if let Some(error) = check_assumption(net) {
        // If no input is possible, nothing ever happens, and all other findings follow from that.
        findings.found.push(error);
        return findings;
    }
    unreachable(net, facts, &mut findings.found);
    let not_counted = || OpenReason::Method(facts.open.join("; "));
    let is_counted = facts.reach.as_ref().is_some_and(|reach| reach.exact);
    let open = (!facts.all_dead_known).then(not_counted);
    findings.checked.push(Checked { check: Check::Unreachable, open });
    if net.steps.values().any(grafsynth_ir::net::Step::halts) {
        findings.found.extend(crate::sharing::shared(net, facts));
        let open = (!is_counted).then(not_counted);
        findings.checked.push(Checked { check: Check::Sharing, open });
    }
    search::run(net, facts, limits, search, &mut findings);
    findings.checked.sort_by_key(|checked| checked.check);
    findings
}

/// The names of the steps. Hidden steps are omitted.
fn shown_names(net: &Net, steps: impl IntoIterator<Item = StepId>) -> Vec<&str> {
    steps
        .into_iter()
        .filter(|step| !net.steps[*step].hidden)
        .map(|step| net.steps[step].name.text.as_str())
        .collect()
}

/// The steps in a sentence: `` `a`, `b` and `c` ``. Hidden steps are omitted.
fn step_names(net: &Net, steps: impl IntoIterator<Item = StepId>) -> String {
    let names: Vec<String> =
        shown_names(net, steps).into_iter().map(|name| format!("`{name}`")).collect();
    joined(&names, "and")
}

fn unreachable(net: &Net, facts: &Facts, out: &mut Vec<Diagnostic>) {
    let never: BTreeSet<StepId> = facts.unreachable_steps.iter().copied().gather();
    let causes = constant::causes(net);
    let explained = explained(net, &never, &causes);
    for step in never.iter().filter(|step| !net.steps[**step].hidden && !explained.contains(step)) {
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
        .plural(format!("`{}`", data.name), "steps", "are never active")
        .at(data.meta.span, "no stimulus activates it");
        warning = match entering.first() {
            None => warning.help("no transition leads to it: add one, or make it initial"),
            Some(first) => warning
                .at(
                    net.transitions[*first].meta.span,
                    "this transition leads to it and never fires",
                )
                .help("check why the transitions to it never fire"),
        };
        out.push(warning);
    }
    let dead = facts.dead_transitions.iter().filter(|transition| {
        // A transition from a step that is never active needs no finding of its own.
        !net.transitions[**transition].requires.iter().any(|step| never.contains(step))
    });
    for transition in dead {
        let data = &net.transitions[*transition];
        let what = match data.kind {
            TransitionKind::Move => "transition",
            TransitionKind::Reaction => "reaction",
        };
        let mut warning = Diagnostic::warning(
            codes::DEAD_TRANSITION,
            format!("{what} `{}` never fires", data.name),
        )
        .plural(format!("`{}`", data.name), format!("{what}s"), "never fire")
        .at(data.meta.span, "no stimulus makes it fire");
        if let Some(vars) = causes.get(transition) {
            out.push(constant::finding(net, *transition, vars));
            continue;
        }
        if data.guard.is_false() {
            warning = warning.at(data.guard.span, "this is never true");
        } else {
            let receptivity = match data.requires.len() {
                0 => "the receptivity is never true",
                1 => "the receptivity is never true while the preceding step is active",
                _ => "the preceding steps are never all active while the receptivity is true",
            };
            let mut or = "";
            for order in net.forcings.iter().filter(|one| one.target.contains(&data.part)) {
                let step = &net.steps[order.step].name;
                let label = format!("no transition of its chart fires while `{step}` is active");
                warning = warning.at(order.span, label);
                or = ", or a forcing order always prevents it";
            }
            warning = warning.help(format!("{receptivity}, or another transition always wins{or}"));
        }
        out.push(warning);
    }
}

/// Steps that are never active only because variables in the transitions to them never change: those transitions are reported instead.
fn explained(
    net: &Net,
    never: &BTreeSet<StepId>,
    causes: &BTreeMap<TransitionId, Vec<VarId>>,
) -> BTreeSet<StepId> {
    let mut explained: BTreeSet<StepId> = BTreeSet::new();
    if causes.is_empty() {
        return explained;
    }
    loop {
        let more: Vec<StepId> = never
            .iter()
            .copied()
            .filter(|step| !explained.contains(step))
            .filter(|step| {
                let mut entering = net
                    .transitions
                    .iter()
                    .filter(|(_, one)| crate::exclusive::entered(one).any(|entry| entry == *step))
                    .peekable();
                entering.peek().is_some()
                    && entering.all(|(id, one)| {
                        causes.contains_key(&id)
                            || one.requires.iter().any(|from| explained.contains(from))
                    })
            })
            .collect();
        if more.is_empty() {
            return explained;
        }
        explained.extend(more);
    }
}

#[cfg(test)]
mod tests {
    use grafsynth_ir::net::{Evolution, Policy};

    use super::*;
    use crate::testing::{chart, valid};
    use crate::{facts, lints};

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
