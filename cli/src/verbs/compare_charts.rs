//! `grafsynth compare A B` with two charts: a proof for every stimulus, or a test with some.

use super::sim::stimulus;
use crate::args::Compare;
use crate::evidence::Shown;
use crate::exit::Exit;
use crate::load::{Session, Stop};
use crate::report::{About, Answer, Status};
use grafsynth_driver::compare as driver_compare;
use grafsynth_driver::evidence::Evidence;
use grafsynth_ir::net::Net;
use grafsynth_ir::{Valid, counted};
use grafsynth_sim::{Difference, MAX_DT};
use grafsynth_verify::pair::{Apart, Common, SameBy, charts_by_chance, charts_equal, charts_on};
use grafsynth_verify::verdict::Verdict;
use grafsynth_verify::{Limits, Scope};
use std::path::Path;

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
    let pair =
        Pair { left, right, first: "first", second: "second", trace: arguments.trace.as_deref() };
    let refuted = |session: &Session, apart: &Apart, witness: &str| -> Result<Exit, Stop> {
        let shown = pair.different(session, apart)?;
        let answer = answer(Status::Refuted, &cells(&apart.difference, "first", "second"))
            .difference(&apart.difference)
            .with("is_shortest", apart.is_shortest)
            .with("witness_of_second", apart.right.to_csv(right))
            .witness(witness)
            .traces(shown.files);
        session.answer(&answer, &shown.text);
        Ok(Exit::Refuted)
    };
    if let Some(path) = arguments.stimulus.as_deref() {
        let Some(stimulus) = stimulus(session, left, Some(path), None, arguments.seed, MAX_DT)?
        else {
            return Ok(Exit::Errors);
        };
        let found = charts_on(left, right, &common, &stimulus);
        return match found.apart {
            Some(apart) => refuted(session, &apart, &stimulus.to_csv(left)),
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
                Ok(Exit::Done)
            }
        };
    }
    if let Some(reactions) = arguments.random.or(arguments.no_proof.then_some(10_000)) {
        let found = charts_by_chance(left, right, &common, reactions, arguments.seed, MAX_DT);
        return match found {
            Err(apart) => refuted(session, &apart, &apart.left.to_csv(left)),
            Ok(tested) if tested.reactions == 0 => Err(nothing_legal()),
            Ok(tested) => {
                let message = format!(
                    "no difference found in {}",
                    counted(tested.reactions, "reaction", "reactions")
                );
                session.answer(
                    &answer(Status::Done, &message).tested(&tested),
                    &format!("{message}\n{tested}\n{}", compared(&common)),
                );
                Ok(Exit::Done)
            }
        };
    }
    match charts_equal(left, right, &common, &Limits::default(), arguments.seed) {
        Verdict::Proved(SameBy::Product { reactions: 0, .. }) => Err(nothing_legal()),
        Verdict::Proved(by) => {
            session.answer(
                &answer(Status::Proved, &by.to_string())
                    .proved_by(by.proof(), &Scope::EveryStimulus),
                &format!("equal: proved for every stimulus {by}\n{}", compared(&common)),
            );
            Ok(Exit::Done)
        }
        Verdict::Refuted(apart) => refuted(session, &apart, &apart.left.to_csv(left)),
        Verdict::Open(why) => {
            session.answer(
                &answer(Status::Open, &why.to_string()).open(&why),
                &format!(
                    "open: no difference found, not proved equal: {why}\n{}",
                    compared(&common)
                ),
            );
            Ok(session.demands.open(&why))
        }
    }
}

/// The error if no row of inputs satisfies the assumptions of both charts, so that nothing can be compared.
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

/// Two charts with their names in messages.
pub(super) struct Pair<'a> {
    pub(super) left: &'a Valid<Net>,
    pub(super) right: &'a Valid<Net>,
    pub(super) first: &'a str,
    pub(super) second: &'a str,
    /// The file of `--trace`.
    pub(super) trace: Option<&'a Path>,
}

impl Pair<'_> {
    /// The difference between two charts, and the relevant part of the runs that show it. Each chart can replay its own trace.
    pub(super) fn different(&self, session: &Session, apart: &Apart) -> Result<Shown, Stop> {
        let Pair { left, right, first, second, trace } = *self;
        let (ours, theirs) = ((left, &apart.left, first), (right, &apart.right, second));
        let evidence = Evidence::of_pair(ours, theirs, &apart.difference.column);
        let ours = grafsynth_sim::run(left, &apart.left);
        let theirs = grafsynth_sim::run(right, &apart.right);
        let shown = session.shown(trace, &evidence, &[(first, &ours), (second, &theirs)])?;
        let stimulus = if apart.is_shortest { "the shortest stimulus" } else { "this stimulus" };
        let cells = cells(&apart.difference, first, second);
        let text = format!("different: {cells}\nunder {stimulus}:\n{}", shown.text);
        Ok(Shown { text, ..shown })
    }
}
