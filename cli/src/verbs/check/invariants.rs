//! `check --invariants OUTPUT` and `check --recheck INVARIANTS`.

use super::written;
use crate::exit::Exit;
use crate::files;
use crate::load::{Session, Stop};
use crate::report::{About, Answer, Status};
use grafsynth_driver::invariants::{self, Damaged};
use grafsynth_ir::facts::Proof;
use grafsynth_ir::net::{Net, PropertyRole};
use grafsynth_ir::{Valid, counted};
use grafsynth_verify::{Limits, Open, OpenReason, PropertyVerdict, Scope};
use std::path::Path;

/// Writes the invariants of the proved asserts.
pub(super) fn write(
    session: &Session,
    net: &Valid<Net>,
    verdicts: &[PropertyVerdict],
    output: &Path,
    limits: &Limits,
) -> Result<Exit, Stop> {
    let made = invariants::write(net, verdicts, limits);
    if output.as_os_str() == "-" {
        crate::print(&made.text);
    } else {
        files::write_named(vec![(output.to_owned(), made.text.into_bytes())])?;
    }
    for (property, why) in &made.missing {
        session.note(&format!(
            "no invariant for {}: {why}\n",
            written(session, &net.properties[*property])
        ));
    }
    session.note(&format!("invariants of {}\n", counted(made.asserts, "assert", "asserts")));
    Ok(if made.missing.is_empty() { Exit::Done } else { Exit::Open })
}

/// Proves the asserts by the invariants in a file; those without an invariant are open.
pub(super) fn recheck(
    session: &Session,
    net: &Valid<Net>,
    file: &str,
    limits: &Limits,
) -> Result<Exit, Stop> {
    let text = files::read_text(file, session.source_limit).map_err(Stop::Usage)?;
    let refused = |Damaged { line, why }: Damaged| Stop::Input(format!("{file}:{line}: {why}"));
    let sections = invariants::read(net, &text).map_err(refused)?;
    for section in &sections {
        invariants::recheck(net, section, limits).map_err(refused)?;
    }
    let mut exit = Exit::Done;
    for (at, property) in net.properties.iter().enumerate() {
        if property.role != PropertyRole::Assert {
            continue;
        }
        let subject = written(session, property);
        let answer = |status, message: String| Answer {
            place: Some(property.meta.span),
            requirements: property.meta.req.clone(),
            ..Answer::new(About::Assert, subject.as_str(), status, message)
        };
        let Some(section) = sections.iter().find(|section| section.property == at) else {
            let why = Open::because(OpenReason::Method(format!("{file} has no invariant for it")));
            let answer = answer(Status::Open, why.to_string()).open(&why);
            session.answer(&answer, &format!("open     {subject}: {why}\n"));
            exit = exit.worse(session.demands.open(&why));
            continue;
        };
        let how = format!(
            "invariant of {}, rechecked",
            counted(section.invariant.clauses.len(), "clause", "clauses")
        );
        let answer = answer(Status::Proved, format!("proved by an {how}"))
            .proved_by(Proof::Induction, &Scope::EveryStimulus)
            .with("clauses", section.invariant.clauses.len());
        session.answer(&answer, &format!("proved   {subject} ({how})\n"));
    }
    Ok(exit)
}
