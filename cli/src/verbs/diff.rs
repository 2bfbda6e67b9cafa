//! `grafsynth diff OLD NEW`.

use super::compare_charts::{Pair, cells, compared, nothing_legal};
use crate::args::{Diff, Reading};
use crate::evidence;
use crate::exit::Exit;
use crate::load::{Session, Stop};
use crate::progress;
use crate::report::{About, Answer, Status};
use grafsynth_driver::diff::{Behaviour, Change, ChangeKind};
use grafsynth_ir::Valid;
use grafsynth_ir::net::Net;
use grafsynth_verify::Scope;
use grafsynth_verify::pair::SameBy;
use grafsynth_verify::verdict::Verdict;

pub(crate) fn run(session: &mut Session, arguments: &Diff) -> Result<Exit, Stop> {
    evidence::check_name(arguments.trace.as_deref())?;
    let exit = both(session, arguments)?;
    session.no_trace(arguments.trace.as_deref());
    Ok(exit)
}

fn both(session: &mut Session, arguments: &Diff) -> Result<Exit, Stop> {
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
    let diff = grafsynth_driver::diff::diff(&old, &new, arguments.random, arguments.seed);
    if let Some(text) = boards(session, [(&arguments.old, &old.net), (&arguments.new, &new.net)]) {
        session.tell(&text);
    }
    for change in &diff.changes {
        session.answer(&answer_of(change), &text_of(change));
    }
    let same = if diff.changes.is_empty() { Exit::Done } else { Exit::Refuted };
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
                let pair = Pair {
                    left: &old.net,
                    right: &new.net,
                    first: "old",
                    second: "new",
                    trace: arguments.trace.as_deref(),
                };
                let shown = pair.different(session, apart)?;
                let answer = answer(Status::Refuted, cells(&apart.difference, "old", "new"))
                    .difference(&apart.difference)
                    .with("is_shortest", apart.is_shortest)
                    .with("witness_of_second", apart.right.to_csv(&new.net))
                    .witness(&apart.left.to_csv(&old.net))
                    .traces(shown.files);
                session.answer(&answer, &shown.text);
                Exit::Refuted
            }
        },
    })
}

/// States the boards of two files, if only one of them has a board.
fn boards(session: &Session, files: [(&String, &Valid<Net>); 2]) -> Option<String> {
    let board = |net: &Valid<Net>| {
        let span = net.board.device.as_ref()?.span;
        Some(session.sources.get(span.file)?.path.clone())
    };
    let boards = files.map(|(path, net)| (path, board(net)));
    if boards[0].1.is_some() == boards[1].1.is_some() {
        return None;
    }
    let part = |(path, board): (&String, Option<String>)| match board {
        Some(board) if board == *path => format!("{path} contains a board"),
        Some(board) => format!("{path} is read with the board {board}"),
        None => format!("{path} has no board"),
    };
    Some(boards.map(part).join("; ") + "\n")
}

/// A change in machine-readable form.
fn answer_of(change: &Change) -> Answer {
    let text = |parts: &[String]| (!parts.is_empty()).then(|| parts.join("\n"));
    let mut message = change.kind.word().to_owned();
    if let Some(name) = &change.old_name {
        message.push_str(&format!(", was {name}"));
    }
    if let Some((from, to)) = &change.moved {
        message.push_str(&format!(", was {from}, is now {to}"));
    }
    let mut answer = Answer::new(About::Part, change.name.as_str(), Status::Refuted, message)
        .with("change", change.kind.word())
        .with("old", text(&change.old))
        .with("new", text(&change.new));
    if let Some(name) = &change.old_name {
        answer = answer.with("old_name", name.as_str());
    }
    if let Some((from, to)) = &change.moved {
        answer = answer.with("old_place", from.to_string()).with("new_place", to.to_string());
    }
    answer
}

/// A change as text for people.
fn text_of(change: &Change) -> String {
    let mut text = format!("{:<8} {}", change.kind.word(), change.name);
    if let Some(name) = &change.old_name {
        text.push_str(&format!(" (was {name})"));
    }
    text.push('\n');
    if let Some((from, to)) = &change.moved {
        text.push_str(&format!("    was {from}, is now {to}\n"));
    }
    let lines = |parts: &[String]| -> Vec<String> {
        parts.iter().flat_map(|part| part.lines()).map(str::to_owned).collect()
    };
    let (old, new) = (lines(&change.old), lines(&change.new));
    // Added or removed text is shown in full. For changes, only the lines around the change are shown.
    let is_pair = change.kind != ChangeKind::Added && change.kind != ChangeKind::Removed;
    let n_same = |pairs: &mut dyn Iterator<Item = (&String, &String)>| {
        if is_pair { pairs.take_while(|(old, new)| old == new).count() } else { 0 }
    };
    let head = n_same(&mut old.iter().zip(&new));
    let most = old.len().min(new.len()) - head;
    let tail = n_same(&mut old.iter().rev().zip(new.iter().rev())).min(most);
    let mut show = |sign: char, line: &str| text.push_str(&format!("    {sign} {line}\n"));
    if head > 0 {
        // The first line shows what the text is; the line before the change shows the context.
        show(' ', &old[0]);
        if head > 2 {
            show(' ', "...");
        }
        if head > 1 {
            show(' ', &old[head - 1]);
        }
    }
    for line in &old[head..old.len() - tail] {
        show('-', line);
    }
    for line in &new[head..new.len() - tail] {
        show('+', line);
    }
    if tail > 0 {
        show(' ', &old[old.len() - tail]);
        if tail > 1 {
            show(' ', "...");
        }
    }
    text
}
