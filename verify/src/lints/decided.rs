//! The messages about a conflict that the policy resolves: why one transition wins, and how to make the losing one win.

use grafsynth_ir::Diagnostic;
use grafsynth_ir::diag::Notation;
use grafsynth_ir::net::{Net, Policy, Transition};

/// The reason why the winner has precedence over the loser.
pub(super) fn reason(net: &Net, winner: &Transition, loser: &Transition) -> &'static str {
    let in_one_state = winner.requires == loser.requires;
    match net.settings.policy {
        Policy::InnerFirst if is_inside(net, winner, loser) => "its state is further inside",
        Policy::OuterFirst if is_inside(net, loser, winner) => "its state is further outside",
        Policy::InnerFirst | Policy::OuterFirst if !in_one_state => "its state is declared first",
        Policy::InnerFirst | Policy::OuterFirst | Policy::All => "declared first",
        Policy::Priority if winner.priority == loser.priority => "declared first",
        Policy::Priority => "its priority is more urgent",
        Policy::PriorityAge => {
            "its following steps have the more urgent priority, or were always activated earlier"
        }
    }
}

/// Adds help: what to change if the other transition should fire. With `is_mutual`, sometimes one wins and sometimes the other.
pub(super) fn advise(
    note: Diagnostic,
    net: &Net,
    winner: &Transition,
    loser: &Transition,
    is_mutual: bool,
) -> Diagnostic {
    let in_one_state = winner.requires == loser.requires;
    let (winner_inside, loser_inside) =
        (is_inside(net, winner, loser), is_inside(net, loser, winner));
    let (winner, loser) = (&winner.name, &loser.name);
    if is_mutual {
        return note.help(format!(
            "if one of them must go first, write `conflict priority` and give it the smaller number, as in `priority 1`; to exclude both, add `not ..` to \
             the receptivity of `{loser}`"
        ));
    }
    let negated = |place: &str| {
        format!("if `{loser}` should fire, add its negated condition to the {place} of `{winner}`")
    };
    match net.settings.policy {
        Policy::Priority => note
            .help(format!(
                "if `{loser}` should fire, give it a smaller priority number than `{winner}`, as in `priority 1` for `{loser}` and `priority 2` for `{winner}`"
            ))
            .help_in(
                Notation::Iec,
                format!("if `{loser}` should fire, give it a smaller priority number than `{winner}`"),
            )
            .help_in(Notation::C, negated("condition")),
        Policy::InnerFirst if winner_inside => note
            .help(format!("if `{loser}` should fire, write `conflict outer-first`"))
            .help_in(
                Notation::Scxml,
                format!("the inner state has priority in SCXML: if `{loser}` should fire, exclude that case in the attribute cond of `{winner}`"),
            ),
        Policy::OuterFirst if loser_inside => {
            note.help(format!("if `{loser}` should fire, write `conflict inner-first`"))
        }
        Policy::InnerFirst | Policy::OuterFirst if !in_one_state => note.help(format!(
            "if `{loser}` should fire, declare its state before that of `{winner}`"
        )),
        Policy::InnerFirst | Policy::OuterFirst | Policy::All => {
            note.help(format!("if `{loser}` should fire, declare it before `{winner}`"))
        }
        Policy::PriorityAge => note.help(negated("receptivity")),
    }
}

/// True if the state that the first transition leaves is inside the state that the second one leaves.
fn is_inside(net: &Net, inner: &Transition, outer: &Transition) -> bool {
    let ([inner], [outer]) = (inner.requires.as_slice(), outer.requires.as_slice()) else {
        return false;
    };
    let mut parents = std::iter::successors(net.steps[*inner].parent, |at| net.steps[*at].parent);
    parents.any(|parent| parent == *outer)
}
