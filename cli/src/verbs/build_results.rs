//! The results of a build for people and machines: a line for each output; each difference from the chart once, with the run that shows it.

use crate::load::{Session, Stop};
use crate::report::Answer;
use grafsynth_driver::pipeline::Refusal;
use grafsynth_driver::report::{Note, Outcome, OutputFault, OutputReport, OutputVerdict};
use grafsynth_ir::Valid;
use grafsynth_ir::net::Net;
use std::path::Path;

/// Reports the result for each output. If nothing was written, reports the reason first. `trace` is the file for the traces of refuted outputs.
pub(super) fn say(
    session: &Session,
    net: &Valid<Net>,
    trace: Option<&Path>,
    lines: &[OutputReport],
    unwritten: Option<&str>,
) -> Result<(), Stop> {
    if let Some(why) = unwritten.filter(|_| !lines.is_empty()) {
        session.tell(&format!("nothing was written: {why}\n"));
    }
    session.know(Vec::new());
    let is_written = unwritten.is_none();
    for group in groups(lines) {
        match (group.as_slice(), group.first().and_then(|line| fault(line))) {
            (lines, Some(fault)) => refuted(session, net, trace, lines, fault, Some(is_written))?,
            (others, None) => {
                for line in others {
                    let (answer, _) = answer(net, line, Some(is_written));
                    session.answer(&answer, &line_of(line, lines));
                }
            }
        }
    }
    Ok(())
}

/// Reports the result for one text that was not built.
pub(super) fn report(
    session: &Session,
    net: &Valid<Net>,
    trace: Option<&Path>,
    line: &OutputReport,
) -> Result<(), Stop> {
    match fault(line) {
        Some(fault) => refuted(session, net, trace, &[line], fault, None),
        None => {
            session.answer(&Answer::of_output(line, net), &format!("{line}\n"));
            Ok(())
        }
    }
}

/// The line about an output. A fault that also refutes an earlier output is reported only at the earlier output.
fn line_of(line: &OutputReport, all: &[OutputReport]) -> String {
    let earlier = || all.iter().take_while(|other| !std::ptr::eq(*other, line));
    let mut parts = vec![line.verdict.to_string()];
    parts.extend(line.notes.iter().map(|note| {
        let known = earlier().find(|other| other.notes.contains(note));
        match (note, known.filter(|_| note.outcome() == Outcome::Refuted)) {
            (Note::Emergency(_), Some(known)) => {
                format!("emergency does not dominate, as in {}", known.name)
            }
            (note, _) => note.to_string(),
        }
    }));
    format!("{:<24} {}\n", line.name, parts.join("; "))
}

/// The reports in order; reports with the same fault are grouped with the first of them.
fn groups(lines: &[OutputReport]) -> Vec<Vec<&OutputReport>> {
    let mut groups: Vec<Vec<&OutputReport>> = Vec::new();
    for line in lines {
        let is_same = |group: &&mut Vec<&OutputReport>| {
            let known = group.first().and_then(|first| fault(first));
            known.zip(fault(line)).is_some_and(|(known, own)| known.is_same(own))
        };
        match groups.iter_mut().find(is_same) {
            Some(group) => group.push(line),
            None => groups.push(vec![line]),
        }
    }
    groups
}

/// The difference of a refuted output.
fn fault(line: &OutputReport) -> Option<&OutputFault> {
    match &line.verdict {
        OutputVerdict::Refuted(fault) => Some(fault),
        _ => None,
    }
}

/// Reports the outputs that a fault refutes.
fn refuted(
    session: &Session,
    net: &Valid<Net>,
    trace: Option<&Path>,
    lines: &[&OutputReport],
    fault: &OutputFault,
    is_written: Option<bool>,
) -> Result<(), Stop> {
    let traces = fault.traces(net);
    let titled: Vec<_> = traces.iter().map(|(title, trace)| (*title, trace)).collect();
    let shown = match fault.evidence(net) {
        Some(evidence) => session.shown(trace, &evidence, &titled)?,
        None => Default::default(),
    };
    let mut run = match fault {
        OutputFault::Row(row) => session.declaration(net, &row.column),
        _ => String::new(),
    };
    run += &shown.text;
    let mut text = text(lines, fault, &run);
    for line in lines {
        let answer = answer(net, line, is_written).0.traces(shown.files.clone());
        session.answer(&answer, &std::mem::take(&mut text));
    }
    Ok(())
}

/// The text about the outputs that a fault refutes: several are named in one line, and their notes follow the run.
fn text(lines: &[&OutputReport], fault: &OutputFault, run: &str) -> String {
    if let [line] = lines {
        return format!("{line}\n{run}");
    }
    let names: Vec<&str> = lines.iter().map(|line| line.name.as_str()).collect();
    let mut text = format!("{:<24} {}\n{run}", names.join(", "), fault.of_several());
    for line in lines.iter().filter(|line| !line.notes.is_empty()) {
        let notes: Vec<String> = line.notes.iter().map(ToString::to_string).collect();
        text += &format!("{:<24} {}\n", line.name, notes.join("; "));
    }
    text
}

fn answer(net: &Valid<Net>, line: &OutputReport, is_written: Option<bool>) -> (Answer, String) {
    let answer = Answer::of_output(line, net);
    let answer = match is_written {
        Some(is_written) => answer.with("written", is_written),
        None => answer,
    };
    (answer, format!("{line}\n"))
}

/// Stores what is known so far in case the user interrupts the build.
pub(super) fn know(session: &Session, net: &Valid<Net>, lines: &[OutputReport]) {
    session.know(lines.iter().map(|line| answer(net, line, Some(false))).collect());
}

/// Why nothing was written: the refused targets with the codes of the findings, which do not name the targets. Targets with the same codes are listed together.
pub(super) fn refusal(refused: &[Refusal]) -> String {
    let mut groups: Vec<(&[&str], Vec<&str>)> = Vec::new();
    for Refusal { target, codes } in refused {
        match groups.iter_mut().find(|(known, _)| *known == codes.as_slice()) {
            Some((_, targets)) => targets.push(target),
            None => groups.push((codes, vec![target])),
        }
    }
    let group = |(codes, targets): &(&[&str], Vec<&str>)| {
        format!("{}: {}", targets.join(", "), codes.join(", "))
    };
    let groups: Vec<String> = groups.iter().map(group).collect();
    match groups.is_empty() {
        true => "an output cannot be made".to_owned(),
        false => format!("an output cannot be made ({})", groups.join("; ")),
    }
}

#[cfg(test)]
mod tests {
    use super::{fault, groups, line_of, refusal, text};
    use grafsynth_driver::pipeline::Refusal;
    use grafsynth_driver::report::{Note, OutputFault, OutputProof, OutputReport, Ran, RowFault};
    use grafsynth_ir::net::Net;
    use grafsynth_sim::{InputRow, Stimulus};
    use grafsynth_verify::Dominance;

    fn wrong(name: &str, rows: usize, of: Ran) -> OutputReport {
        let net = Net::default();
        let rows = vec![InputRow { dt: 1, ..InputRow::zero(&net) }; rows];
        let fault = RowFault {
            stimulus: Stimulus::of_rows(&net, &rows),
            column: "lit".to_owned(),
            chart: "1".to_owned(),
            output: "0".to_owned(),
            of,
            trace: None,
        };
        OutputReport::refuted(name, OutputFault::Row(Box::new(fault)))
    }

    #[test]
    fn a_difference_of_several_outputs_is_one_finding() {
        let mut lines = vec![
            wrong("lamp.pds", 2, Ran::Circuit),
            OutputReport::proved("lamp.net", OutputProof::SameNet),
            wrong("lamp.v", 3, Ran::Circuit),
            wrong("lamp.c", 2, Ran::C),
        ];
        lines[3].notes.push(Note::NoStyle);
        let groups = groups(&lines);
        let names: Vec<Vec<&str>> = groups
            .iter()
            .map(|group| group.iter().map(|line| line.name.as_str()).collect())
            .collect();
        assert_eq!(names, [vec!["lamp.pds", "lamp.c"], vec!["lamp.net"], vec!["lamp.v"]]);
        assert_eq!(
            text(&groups[0], fault(&lines[0]).unwrap(), "    the run\n"),
            "lamp.pds, lamp.c         differ from the chart after 2 reactions: lit is `1` in the chart and `0` in the outputs\n    the run\nlamp.c                   this is a bug in grafsynth\n"
        );
        assert_eq!(
            text(&groups[2], fault(&lines[2]).unwrap(), ""),
            "lamp.v                   differs from the chart after 3 reactions: lit is `1` in the chart and `0` in the output\n"
        );
    }

    #[test]
    fn an_emergency_that_several_outputs_break_in_one_way_is_explained_once() {
        let found = Dominance::Refuted { pin: "lit".to_owned(), set: vec!["stop".to_owned()] };
        let line = |name: &str, found: &Dominance| OutputReport {
            notes: vec![Note::Gate, Note::Emergency(found.clone())],
            ..OutputReport::proved(name, OutputProof::SameNet)
        };
        let other = Dominance::Refuted { pin: "lit".to_owned(), set: Vec::new() };
        let lines = [line("a.pds", &found), line("a.v", &found), line("a.blif", &other)];
        let said: Vec<String> = lines.iter().map(|line| line_of(line, &lines)).collect();
        assert_eq!(said[0], format!("{}\n", lines[0]));
        assert!(said[0].contains("not safe when these are 1: stop"), "{}", said[0]);
        assert!(
            said[1]
                .ends_with("through the gate (--gate); emergency does not dominate, as in a.pds\n"),
            "{}",
            said[1]
        );
        assert_eq!(said[2], format!("{}\n", lines[2]));
    }

    #[test]
    fn refused_targets_are_named_with_the_codes_of_their_findings() {
        let refused = |target, codes: &[&'static str]| Refusal { target, codes: codes.to_vec() };
        let all = [
            refused("galasm", &["G0711"]),
            refused("c", &["G0601", "G0602"]),
            refused("jedec", &["G0711"]),
        ];
        assert_eq!(
            refusal(&all),
            "an output cannot be made (galasm, jedec: G0711; c: G0601, G0602)"
        );
        assert_eq!(refusal(&[]), "an output cannot be made");
    }
}
