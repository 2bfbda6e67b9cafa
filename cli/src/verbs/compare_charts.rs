//! `grafsynth compare A B` with two charts: a proof for every stimulus, or a test with some.

use super::sim::stimulus;
use crate::args::Compare;
use crate::exit::Exit;
use crate::load::{Session, Stop};
use crate::report::{About, Answer, Status};
use grafsynth_driver::compare as driver_compare;
use grafsynth_ir::net::Net;
use grafsynth_ir::{Valid, counted};
use grafsynth_sim::{Difference, MAX_DT};
use grafsynth_verify::pair::{Apart, Common, SameBy, charts_by_chance, charts_equal, charts_on};
use grafsynth_verify::verdict::Verdict;
use grafsynth_verify::{Limits, Scope};

pub(crate) fn run(
    session: &mut Session,
    arguments: &Compare,
    subject: &str,
    left: &Valid<Net>,
    right: &Valid<Net>,
) -> Result<Exit, Stop> {
    if session.is_impossible(left) || session.is_impossible(right) {
        return Ok(Exit::Errors);
    }
    let common = match driver_compare::common(left, right) {
        Ok(common) => common,
        Err(found) => {
            session.show(&found);
            return Ok(Exit::Errors);
        }
    };
    let answer = |status, message: &str| {
        let columns: Vec<&str> = common.columns.iter().map(|column| column.name.as_str()).collect();
        let omitted: Vec<String> = common.omitted.iter().map(ToString::to_string).collect();
        Answer::new(About::Equality, subject, status, message)
            .with("compared", columns)
            .with("not_compared", omitted)
    };
    let refuted = |session: &Session, apart: &Apart| {
        let text = different(left, right, &common, apart, "first", "second");
        let answer = answer(Status::Refuted, &cells(&apart.difference, "first", "second"))
            .difference(&apart.difference)
            .with("is_shortest", apart.is_shortest)
            .with("witness_of_second", apart.right.to_csv(right))
            .witness(&apart.left.to_csv(left));
        session.answer(&answer, &text);
        Exit::Refuted
    };
    if let Some(path) = arguments.stimulus.as_deref() {
        let Some(stimulus) = stimulus(session, left, Some(path), None, arguments.seed, MAX_DT)?
        else {
            return Ok(Exit::Errors);
        };
        let found = charts_on(left, right, &common, &stimulus);
        return Ok(match found.difference {
            Some(difference) => {
                let message = cells(&difference, "first", "second");
                session.answer(
                    &answer(Status::Refuted, &message)
                        .difference(&difference)
                        .witness(&stimulus.to_csv(left)),
                    &format!("different: {message}\n"),
                );
                Exit::Refuted
            }
            None => {
                let mut text = format!(
                    "no difference on this stimulus: {}",
                    counted(found.compared, "row", "rows")
                );
                if found.compared < stimulus.len() {
                    text += &format!(
                        " of {}; row {} violates an assumption of one of the charts, or depends on something that one of them leaves undefined",
                        stimulus.len(),
                        found.compared + 1
                    );
                }
                session.answer(
                    &answer(Status::Done, &text).with("reactions", found.compared),
                    &format!("{text}\n{}", compared(&common)),
                );
                Exit::Done
            }
        });
    }
    if let Some(reactions) = arguments.random.or(arguments.no_proof.then_some(10_000)) {
        let found = charts_by_chance(left, right, &common, reactions, arguments.seed, MAX_DT);
        return Ok(match found {
            Err(apart) => refuted(session, &apart),
            Ok(tested) if tested.reactions == 0 => return Err(nothing_legal()),
            Ok(tested) => {
                let message = format!(
                    "no difference found in {}",
                    counted(tested.reactions, "reaction", "reactions")
                );
                session.answer(
                    &answer(Status::Done, &message).tested(&tested),
                    &format!("{message}\n{tested}\n{}", compared(&common)),
                );
                Exit::Done
            }
        });
    }
    Ok(match charts_equal(left, right, &common, &Limits::default(), arguments.seed) {
        Verdict::Proved(SameBy::Product { reactions: 0, .. }) => return Err(nothing_legal()),
        Verdict::Proved(by) => {
            session.answer(
                &answer(Status::Proved, &by.to_string())
                    .proved_by(by.proof(), &Scope::EveryStimulus),
                &format!("equal: proved for every stimulus {by}\n{}", compared(&common)),
            );
            Exit::Done
        }
        Verdict::Refuted(apart) => refuted(session, &apart),
        Verdict::Open(why) => {
            session.answer(
                &answer(Status::Open, &why.to_string()).open(&why),
                &format!(
                    "open: no difference found, not proved equal: {why}\n{}",
                    compared(&common)
                ),
            );
            session.demands.open(&why)
        }
    })
}

/// The error for two charts that allow no common row, so nothing can be compared.
pub(crate) fn nothing_legal() -> Stop {
    Stop::Input(
        "no row of inputs satisfies the assumptions of both charts, so there is nothing to compare"
            .to_owned(),
    )
}

/// The columns that a comparison covers and those that it does not, by name.
pub(crate) fn compared(common: &Common) -> String {
    let names: Vec<&str> = common.columns.iter().map(|column| column.name.as_str()).collect();
    let mut text = format!("compared: {}\n", names.join(", "));
    for omitted in &common.omitted {
        text += &format!("{omitted}\n");
    }
    text
}

/// The values in which two traces differ.
pub(crate) fn cells(difference: &Difference, first: &str, second: &str) -> String {
    let Difference { row, column, left, right } = difference;
    format!("scan {row}, {column}: `{left}` in the {first}, `{right}` in the {second}")
}

/// The difference between two charts, and a stimulus that shows it.
pub(crate) fn different(
    left: &Net,
    right: &Net,
    common: &Common,
    apart: &Apart,
    first: &str,
    second: &str,
) -> String {
    let shortest = if apart.is_shortest { "shortest " } else { "" };
    let mut text = format!("different: {}\n", cells(&apart.difference, first, second));
    let (ours, theirs) = (apart.left.to_csv(left), apart.right.to_csv(right));
    let mut show = |title: &str, stimulus: &str| {
        text += &format!("{title}\n");
        for line in stimulus.lines() {
            text += &format!("    {line}\n");
        }
    };
    // Both charts accept the same file if they have the same inputs, because the order of the
    // columns does not matter.
    if common.inputs.iter().all(|input| input.left.is_some() && input.right.is_some()) {
        show(&format!("under the {shortest}stimulus"), &ours);
    } else {
        show(&format!("under the {shortest}stimulus of the {first}"), &ours);
        show(&format!("and of the {second}"), &theirs);
    }
    text
}
