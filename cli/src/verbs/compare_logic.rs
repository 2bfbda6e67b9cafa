//! `grafsynth compare A B` where A or B is imported logic: a test, and then a proof for every stimulus of a chip.

use super::compare_charts::cells;
use super::compared::{nothing_asked, reactions};
use super::sim::{clocked, stimulus};
use crate::args::Compare;
use crate::evidence::Shown;
use crate::exit::Exit;
use crate::load::{Session, Stop};
use crate::report::{About, Answer, Status};
use grafsynth_driver::compare::{Apart, Outcome as Compared};
use grafsynth_driver::evidence::Evidence;
use grafsynth_driver::judge::{self, CircuitsApart, Judged, Renames, Runs};
use grafsynth_driver::logic::LogicDesign;
use grafsynth_driver::read::{Design, NetDesign};
use grafsynth_ir::facts::Proof;
use grafsynth_ir::net::Net;
use grafsynth_ir::{Diagnostic, Valid, counted};
use grafsynth_sim::{Clocked, Difference, Stimulus};
use grafsynth_verify::equiv::Counterexample;
use grafsynth_verify::{Open, Scope, Tested, Verdict};

/// Compares a chart or logic with logic: with a stimulus, and then, unless the user asked for a test only, by a proof.
pub(super) fn run(
    session: &mut Session,
    arguments: &Compare,
    subject: &str,
    design: &Design,
    mut other: LogicDesign,
    renames: &Renames,
) -> Result<Exit, Stop> {
    if let Design::Logic(first) = design
        && let Some(circuit) = grafsynth_driver::pin_numbers::by_number(first, &other)
    {
        session.note("pins are compared by number because a fuse map does not name its pins\n");
        other.logic = Some(circuit);
    }
    let net = match design {
        Design::Net(design) => &design.net,
        Design::Logic(design) => &design.interface,
    };
    if session.is_impossible(net) {
        return Ok(Exit::Errors);
    }
    let rows = arguments.random.or(if arguments.stimulus.is_none() { Some(10_000) } else { None });
    let Some(stimulus) =
        stimulus(session, net, arguments.stimulus.as_deref(), rows, arguments.seed, 1)?
    else {
        return Ok(Exit::Errors);
    };
    let Some(Clocked { stimulus, .. }) = clocked(session, net, &stimulus) else {
        return Ok(Exit::Errors);
    };
    let tested = other.circuit().and_then(|circuit| match design {
        Design::Net(design) => judge::with_net(&design.net, circuit, &stimulus, renames),
        Design::Logic(design) => judge::with_logic(design, circuit, &stimulus, renames),
    });
    let tested = match tested {
        Ok(tested) => tested,
        Err(found) => {
            session.show(&found);
            return Ok(Exit::Errors);
        }
    };
    let is_test = arguments.no_proof || arguments.stimulus.is_some() || arguments.random.is_some();
    let asked = grafsynth_sim::run(net, &stimulus).asked_reactions();
    if asked == 0 && !stimulus.is_empty() {
        return Err(nothing_asked());
    }
    let question =
        Question { session, arguments, subject, design, net, other: &other, renames, tested };
    let exit = question.after_a_test(&stimulus, asked, is_test)?;
    if exit != Exit::Done || is_test {
        return Ok(exit);
    }
    question.prove(stimulus.len())
}

/// The question whether two designs are equal; the second is logic.
struct Question<'a> {
    session: &'a Session,
    arguments: &'a Compare,
    subject: &'a str,
    design: &'a Design,
    /// The chart, or the pins of the first logic.
    net: &'a Valid<Net>,
    other: &'a LogicDesign,
    renames: &'a Renames,
    /// The result of the test that comes first.
    tested: Compared,
}

impl Question<'_> {
    /// The names of the two designs in messages. A chart may be the second one on the command line.
    fn titles(&self) -> (&'static str, &'static str) {
        match self.design {
            Design::Net(_) => ("chart", "logic"),
            Design::Logic(_) => ("first", "second"),
        }
    }

    /// An answer with the compared columns.
    fn answer(&self, status: Status, message: &str) -> Answer {
        let answer = Answer::new(About::Equality, self.subject, status, message)
            .with("columns", self.tested.n_columns);
        let (first, second) = self.titles();
        let apart: Vec<String> = self.tested.apart.parts(first, second).collect();
        if apart.is_empty() { answer } else { answer.with("not_compared", apart) }
    }

    /// Reports the result of the test. If a proof follows, machines get only its answer.
    fn after_a_test(&self, stimulus: &Stimulus, asked: usize, is_test: bool) -> Result<Exit, Stop> {
        let answer = |status, message: &str| self.answer(status, message).with("reactions", asked);
        let Some(difference) = &self.tested.difference else {
            let mut text = format!(
                "no difference found in {}, {} in common\n",
                reactions(asked, stimulus.len()),
                counted(self.tested.n_columns, "column", "columns")
            );
            let answer = answer(Status::Done, text.trim_end());
            if self.tested.apart != Apart::default() {
                let (first, second) = self.titles();
                let parts: Vec<String> = self.tested.apart.parts(first, second).collect();
                text += &format!("not compared: {}\n", parts.join("; "));
            }
            if is_test {
                self.session.answer(&answer, &text);
            } else if !self.session.quiet {
                crate::print(&text);
            }
            return Ok(Exit::Done);
        };
        let mut short = stimulus.clone();
        short.truncate(difference.row);
        let answer = answer(Status::Refuted, "");
        self.different(answer, difference, &short, &stimulus.to_csv(self.net))
    }

    /// Reports a difference. `stimulus` ends with the row in which it occurs; `witness` is the stimulus that the answer contains, as CSV.
    fn different(
        &self,
        mut answer: Answer,
        difference: &Difference,
        stimulus: &Stimulus,
        witness: &str,
    ) -> Result<Exit, Stop> {
        let (first, second) = self.titles();
        answer.message = cells(difference, first, second);
        let runs = self.runs(stimulus)?;
        let (ours, theirs) = ((first, &runs.first), (second, &runs.second));
        let column = &difference.column;
        let evidence = Evidence::of_traces(self.net, stimulus, column, ours, theirs);
        let shown = self.shown(&evidence, &runs)?;
        let text = format!("different: {}\n{}", answer.message, shown.text);
        let answer = answer.difference(difference).witness(witness).traces(shown.files);
        self.session.answer(&answer, &text);
        Ok(Exit::Refuted)
    }

    /// The runs of both designs.
    fn runs(&self, stimulus: &Stimulus) -> Result<Runs, Stop> {
        judge::runs(self.design, self.other, stimulus, self.renames).map_err(|found| {
            self.session.show(&found);
            Stop::Errors
        })
    }

    /// The run as text, and the trace files, one for each design, which that design can replay.
    fn shown(&self, evidence: &Evidence, runs: &Runs) -> Result<Shown, Stop> {
        let (first, second) = self.titles();
        let traces = [(first, &runs.first), (second, &runs.own)];
        self.session.shown(self.arguments.trace.as_deref(), evidence, &traces)
    }

    /// The proof for every stimulus, after some were tried.
    fn prove(&self, reactions: usize) -> Result<Exit, Stop> {
        let limits = self.arguments.effort.limits();
        let judged = self.other.circuit().and_then(|circuit| match self.design {
            Design::Net(design) => {
                let verdict = judge::prove_with_net(&design.net, circuit, self.renames, &limits)?;
                Ok(self.of_chart(design, verdict, reactions))
            }
            Design::Logic(design) => {
                let judged = judge::prove_with_logic(design, circuit, self.renames, &limits)?;
                Ok(self.of_circuits(design, judged, reactions))
            }
        });
        judged.unwrap_or_else(|found: Vec<Diagnostic>| {
            self.session.show(&found);
            Ok(Exit::Errors)
        })
    }

    fn of_chart(
        &self,
        design: &NetDesign,
        verdict: Verdict,
        reactions: usize,
    ) -> Result<Exit, Stop> {
        match verdict {
            Verdict::Proved(certificate) => {
                Ok(self.equal(certificate.proof(), &certificate.to_string()))
            }
            Verdict::Refuted(Counterexample { stimulus, difference }) => {
                let answer = self.answer(Status::Refuted, "");
                self.different(answer, &difference, &stimulus, &stimulus.to_csv(&design.net))
            }
            Verdict::Open(why) => Ok(self.open(why, reactions)),
        }
    }

    fn of_circuits(
        &self,
        design: &LogicDesign,
        judged: Judged,
        reactions: usize,
    ) -> Result<Exit, Stop> {
        match judged {
            Judged::Equal(by) => Ok(self.equal(by.proof(), &by.to_string())),
            Judged::Different(apart) => self.apart(design, &apart),
            Judged::Open(why) => Ok(self.open(why, reactions)),
        }
    }

    /// Reports a difference of two circuits that a proof found.
    fn apart(&self, design: &LogicDesign, apart: &CircuitsApart) -> Result<Exit, Stop> {
        let stimulus = design.circuit().map(|circuit| apart.stimulus(self.net, circuit));
        let stimulus = stimulus.map_err(|found| {
            self.session.show(&found);
            Stop::Errors
        })?;
        let runs = self.runs(&stimulus)?;
        let (first, second) = self.titles();
        let shown = self.shown(&Evidence::of_circuits(apart, first, second), &runs)?;
        let message = apart.to_string();
        let answer = self.answer(Status::Refuted, &message).circuits(apart).traces(shown.files);
        self.session.answer(&answer, &format!("different: {message}\n{}", shown.text));
        Ok(Exit::Refuted)
    }

    fn equal(&self, by: Proof, how: &str) -> Exit {
        // A clock is one tick; a circuit has no other reaction.
        let answer = self.answer(Status::Proved, how).proved_by(by, &Scope::OneTick);
        self.session.answer(&answer, &format!("equal: {how}\n"));
        Exit::Done
    }

    fn open(&self, mut why: Open, reactions: usize) -> Exit {
        let text = format!("open: not proved equal: {why}\n");
        // The run before the proof is also a test.
        why.tested
            .get_or_insert_with(|| Tested { reactions: reactions as u64, ..Tested::default() });
        self.session.answer(&self.answer(Status::Open, &why.to_string()).open(&why), &text);
        self.session.demands.open(&why)
    }
}
