//! `grafsynth diff OLD NEW`.

use super::compare_charts::{cells, compared, different, nothing_legal};
use crate::args::{Diff, Reading};
use crate::exit::Exit;
use crate::load::{Session, Stop};
use crate::progress;
use crate::report::{About, Answer, Status};
use grafsynth_driver::diff::{Behaviour, Part};
use grafsynth_verify::Scope;
use grafsynth_verify::pair::SameBy;
use grafsynth_verify::verdict::Verdict;

pub(crate) fn run(session: &mut Session, arguments: &Diff) -> Result<Exit, Stop> {
    let reading = Reading { machine: arguments.machine, ..Reading::default() };
    session.begin(&arguments.old);
    let (old, found_old) = session.net_at(&arguments.old, &reading)?;
    session.show(&found_old);
    let (new, found_new) = session.net_at(&arguments.new, &reading)?;
    session.show(&found_new);
    if session.demands.refuse(&found_old) || session.demands.refuse(&found_new) {
        return Ok(Exit::Errors);
    }
    if session.is_impossible(&old.net) || session.is_impossible(&new.net) {
        return Ok(Exit::Errors);
    }
    progress::doing(format!("comparing {} and {}", arguments.old, arguments.new));
    let diff = grafsynth_driver::diff::diff(&old.net, &new.net, arguments.random, arguments.seed);
    for Part { name, old, new } in &diff.parts {
        let word = match (old, new) {
            (Some(_), Some(_)) => "changed",
            (Some(_), None) => "gone",
            (None, _) => "new",
        };
        let mut text = format!("{word:<8} {name}\n");
        for (sign, block) in [('-', old), ('+', new)] {
            for line in block.iter().flat_map(|block| block.lines()) {
                text.push_str(&format!("    {sign} {line}\n"));
            }
        }
        let answer = Answer::new(About::Part, name.as_str(), Status::Refuted, word)
            .with("old", old.as_deref())
            .with("new", new.as_deref());
        session.answer(&answer, &text);
    }
    let same = if diff.parts.is_empty() { Exit::Done } else { Exit::Refuted };
    let subject = format!("behaviour of {} and {}", arguments.old, arguments.new);
    let answer =
        |status, message: String| Answer::new(About::Equality, subject.as_str(), status, message);
    Ok(match &diff.behaviour {
        Behaviour::Incomparable(why) => {
            let answer = answer(Status::NotChecked, why.to_string());
            session.answer(&answer, &format!("behaviour not compared: {why}\n"));
            Exit::Refuted
        }
        Behaviour::Compared(common, verdict) => match verdict {
            Verdict::Proved(SameBy::Product { reactions: 0, .. }) => return Err(nothing_legal()),
            Verdict::Proved(by) => {
                let answer = answer(Status::Proved, by.to_string())
                    .proved_by(by.proof(), &Scope::EveryStimulus);
                session.answer(
                    &answer,
                    &format!(
                        "same behaviour: proved for every stimulus {by}\n{}",
                        compared(common)
                    ),
                );
                same
            }
            Verdict::Open(why) => {
                session.answer(
                    &answer(Status::Open, why.to_string()).open(why),
                    &format!(
                        "no difference in behaviour found, not proved: {why}\n{}",
                        compared(common)
                    ),
                );
                same.worse(session.demands.open(why))
            }
            Verdict::Refuted(apart) => {
                let text = different(&old.net, &new.net, common, apart, "old", "new");
                let answer = answer(Status::Refuted, cells(&apart.difference, "old", "new"))
                    .difference(&apart.difference)
                    .with("is_shortest", apart.is_shortest)
                    .with("witness_of_second", apart.right.to_csv(&new.net))
                    .witness(&apart.left.to_csv(&old.net));
                session.answer(&answer, &text);
                Exit::Refuted
            }
        },
    })
}
