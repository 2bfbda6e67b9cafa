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
use grafsynth_sim::{Difference, MAX_DT, Stimulus};
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
    let stimulus = match arguments.stimulus.as_deref() {
        None => None,
        Some(path) => match stimulus(session, left, Some(path), None, arguments.seed, MAX_DT)? {
            Some(stimulus) => Some(stimulus),
            None => return Ok(Exit::Errors),
        },
    };
    let trace = arguments.trace.as_deref();
    let pair = Pair { left, right, first: "first", second: "second", trace };
    let comparison = Comparison { session, subject, pair, common: &common };
    match (stimulus, arguments.random.or(arguments.no_proof.then_some(10_000))) {
        (Some(stimulus), _) => comparison.on(&stimulus),
        (None, Some(reactions)) => comparison.by_chance(reactions, arguments.seed),
        (None, None) => comparison.proved(&arguments.effort.limits(), arguments.seed),
    }
}

/// A comparison of two charts in the columns that both have.
struct Comparison<'a> {
    session: &'a Session,
    /// The names of the charts, for the report.
    subject: &'a str,
    pair: Pair<'a>,
    common: &'a Common,
}

impl Comparison<'_> {
    /// By one stimulus.
    fn on(&self, stimulus: &Stimulus) -> Result<Exit, Stop> {
        let Pair { left, right, .. } = self.pair;
        let found = charts_on(left, right, self.common, stimulus);
        if let Some(apart) = found.apart {
            return self.refuted(&apart, &stimulus.to_csv(left));
        }
        let mut text =
            format!("no difference on this stimulus: {}", counted(found.compared, "row", "rows"));
        if found.compared < stimulus.len() {
            text += &format!(
                " of {}; row {} violates an assumption of one of the charts, or depends on something that one of them leaves undefined",
                stimulus.len(),
                found.compared + 1
            );
        }
        let answer = self.answer(Status::Done, &text).with("reactions", found.compared);
        self.session.answer(&answer, &format!("{text}\n{}", compared(self.common)));
        Ok(Exit::Done)
    }

    /// By random reactions.
    fn by_chance(&self, reactions: usize, seed: u64) -> Result<Exit, Stop> {
        let Pair { left, right, .. } = self.pair;
        match charts_by_chance(left, right, self.common, reactions, seed, MAX_DT) {
            Err(apart) => self.refuted(&apart, &apart.left.to_csv(left)),
            Ok(tested) if tested.reactions == 0 => Err(nothing_legal()),
            Ok(tested) => {
                let reactions = counted(tested.reactions, "reaction", "reactions");
                let message = format!("no difference found in {reactions}");
                let answer = self.answer(Status::Done, &message).tested(&tested);
                let text = format!("{message}\n{tested}\n{}", compared(self.common));
                self.session.answer(&answer, &text);
                Ok(Exit::Done)
            }
        }
    }

    /// By a proof for every stimulus.
    fn proved(&self, limits: &Limits, seed: u64) -> Result<Exit, Stop> {
        let Pair { left, right, .. } = self.pair;
        let columns = || compared(self.common);
        match charts_equal(left, right, self.common, limits, seed) {
            Verdict::Proved(SameBy::Product { reactions: 0, .. }) => Err(nothing_legal()),
            Verdict::Proved(by) => {
                let answer = self.answer(Status::Proved, &by.to_string());
                let answer = answer.proved_by(by.proof(), &Scope::EveryStimulus);
                let text = format!("equal: proved for every stimulus {by}\n{}", columns());
                self.session.answer(&answer, &text);
                Ok(Exit::Done)
            }
            Verdict::Refuted(apart) => self.refuted(&apart, &apart.left.to_csv(left)),
            Verdict::Open(why) => {
                let answer = self.answer(Status::Open, &why.to_string()).open(&why);
                let text = "open: no difference found, not proved equal";
                self.session.answer(&answer, &format!("{text}: {why}\n{}", columns()));
                Ok(self.session.demands.open(&why))
            }
        }
    }

    fn answer(&self, status: Status, message: &str) -> Answer {
        let columns: Vec<&str> =
            self.common.columns.iter().map(|column| column.name.as_str()).collect();
        let omitted: Vec<String> = self.common.omitted.iter().map(ToString::to_string).collect();
        Answer::new(About::Equality, self.subject, status, message)
            .with("compared", columns)
            .with("not_compared", omitted)
    }

    fn refuted(&self, apart: &Apart, witness: &str) -> Result<Exit, Stop> {
        let Pair { right, first, second, .. } = self.pair;
        let shown = self.pair.different(self.session, apart)?;
        let answer = self
            .answer(Status::Refuted, &cells(&apart.difference, first, second))
            .difference(&apart.difference)
            .with("is_shortest", apart.is_shortest)
            .with("witness_of_second", apart.right.to_csv(right))
            .witness(witness)
            .traces(shown.files);
        self.session.answer(&answer, &shown.text);
        Ok(Exit::Refuted)
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
