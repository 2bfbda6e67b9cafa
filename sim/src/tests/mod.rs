//! Each section of `docs/semantics.md` on the smallest net that demonstrates it, with its exact trace.

mod choices;
mod commands;
mod directed;
mod formats;
mod grafcet;
mod lasting;
mod pages;
mod statechart;
mod stepper;
mod timing;

use grafsynth_ir::net::Net;
use grafsynth_ir::net::{Driver, OutputId};
use grafsynth_ir::{FileId, Valid, text, validate};

use crate::{Simulator, Stimulus, run};

/// A net of one part `g`; `settings` and `body` are lines of the text form.
fn net(settings: &str, body: &str) -> Valid<Net> {
    let has = |word: &str| {
        settings.lines().chain(body.lines()).any(|line| line.trim_start().starts_with(word))
    };
    let mut source = String::from("net chart\n");
    for (word, line) in [
        ("policy", "policy all\n"),
        ("evolution", "evolution single\n"),
        ("schedule", "schedule declared\n"),
        ("tick", "tick 10000000 ns\n"),
        ("part", "part g level 1\n"),
    ] {
        if !has(word) {
            source.push_str(line);
        }
    }
    source = format!("{source}{settings}\n{body}\n");
    let (net, problems) = text::parse(FileId(0), &source);
    let show = || {
        let all: Vec<String> = problems
            .iter()
            .map(|problem| {
                let place = problem.labels.first().map_or("", |label| &source[label.span.range()]);
                format!("{}: {} at `{place}`", problem.code.id, problem.message)
            })
            .collect();
        all.join("\n")
    };
    let net = net.unwrap_or_else(|| panic!("{}", show()));
    assert!(problems.is_empty(), "{}", show());
    validate(net).unwrap_or_else(|problems| panic!("{problems:#?}"))
}

/// The trace for a stimulus, without the columns `scan` and those of the stimulus, which are redundant.
fn trace(net: &Valid<Net>, stimulus: &str) -> String {
    let (parsed, problems) = Stimulus::parse_csv(net, FileId(0), stimulus);
    let parsed = parsed.unwrap_or_else(|| panic!("{problems:#?}"));
    let csv = run(net, &parsed).to_csv();
    let mut lines = csv.lines();
    let header: Vec<&str> = lines.next().unwrap_or("").split(',').collect();
    let first = header.iter().position(|name| *name == "steps").unwrap_or(0);
    let shown = |line: &str| line.split(',').skip(first).collect::<Vec<_>>().join(",");
    std::iter::once(header.join(",").as_str()).chain(lines).map(|line| shown(line) + "\n").collect()
}

/// Compares traces line by line; `expected` may be indented.
fn check(net: &Valid<Net>, stimulus: &str, expected: &str) {
    let wanted: String = expected
        .lines()
        .map(str::trim)
        .filter(|line| !line.is_empty())
        .map(|l| l.to_owned() + "\n")
        .collect();
    let found = trace(net, stimulus);
    assert_eq!(found.replace(" \n", "\n"), wanted, "\nfound:\n{found}");
    survives_saving(net, stimulus);
}

/// Checks that saving and restoring between any two rows changes nothing.
fn survives_saving(net: &Valid<Net>, stimulus: &str) {
    let (Some(parsed), _) = Stimulus::parse_csv(net, FileId(0), stimulus) else { return };
    let mut straight = Simulator::new(net);
    for row in parsed.rows() {
        let mut restored = Simulator::new(net);
        let report = restored.restore(&straight.save()).unwrap();
        assert!(
            report.new.is_empty() && report.lost.is_empty() && report.cut.is_empty(),
            "{report:?}"
        );
        assert_eq!(restored.state(), straight.state());
        // The value of a call is not kept.
        let is_shown =
            |output: &&OutputId| !matches!(net.outputs[**output].driver, Driver::Extern { .. });
        for output in net.outputs.ids().filter(|output| is_shown(&output)) {
            let at = output.index();
            assert_eq!(restored.row().outputs[at], straight.row().outputs[at]);
        }
        let mut moved = Simulator::new(net);
        moved.set_state(straight.state());
        let row_after = straight.react(&row);
        assert_eq!(restored.react(&row).steps, row_after.steps);
        assert_eq!(moved.react(&row).outputs, row_after.outputs);
        assert_eq!(moved.state(), straight.state());
    }
}

const TRUCK: &str = "
    input m bool
    input b bool
    input p bool
    input a bool
    output R bool continuous
        emit p2
    output Z bool continuous
        emit p3
    output L bool continuous
        emit p4
    step p1 in g initial
    step p2 in g
    step p3 in g
    step p4 in g
    transition t1 in g p1 -> p2 when m
    transition t2 in g p2 -> p3 when b
    transition t3 in g p3 -> p4 when p
    transition t4 in g p4 -> p1 when a
    assume never a and b
";
