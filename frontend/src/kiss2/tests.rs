//! Tests with small tables.

use super::{Machine, Trit, covers_all, net, parse, write};
use grafsynth_ir::net::{Driver, OpenCell};
use grafsynth_ir::span::FileId;
use grafsynth_ir::validate;

fn read(text: &str) -> Machine {
    let (machine, findings) = parse(FileId(0), text);
    assert_eq!(findings, [], "{text}");
    machine.expect("a table")
}

#[test]
fn a_table_is_a_net_with_open_cells() {
    let machine = read(
        "# a lamp\n.i 2\n.o 2\n.p 4\n.s 2\n.ilb go stop\n1- 0 on -1 # comment\n01 0 0 01\n1- on * 10\n-1 on 0 1-\n.e\nwhatever",
    );
    assert_eq!(machine.initial, 0);
    assert_eq!(machine.outputs, ["out0", "out1"]);
    let net = validate(net(&machine, "lamp")).expect("a sound net");
    let steps: Vec<&str> = net.steps.values().map(|step| step.name.text.as_str()).collect();
    assert_eq!(steps, ["s0", "on"]);
    assert_eq!(net.transitions.len(), 2, "a row that stays is no transition");
    let open: Vec<OpenCell> = net.unspecified.iter().map(|open| open.what).collect();
    assert_eq!(open.iter().filter(|open| **open == OpenCell::Next).count(), 2, "{open:?}");
    assert_eq!(open.len(), 6, "both states leave inputs without a row");
    assert!(net.outputs.values().all(|output| matches!(output.driver, Driver::Mealy(_))));
}

#[test]
fn a_table_is_written_as_it_was_read() {
    let text = ".i 1\n.o 1\n.p 3\n.s 2\n.r b\n.ilb x\n.ob y\n0 * b -\n1 b a 1\n0 a * 0\n.e\n";
    let machine = read(text);
    assert_eq!(machine.states[machine.initial].name, "b");
    assert_eq!(write(&machine), text);
    let bare = ".i 0\n.o 0\n.p 2\n.s 2\n.r a\na b\nb a\n.e\n";
    assert_eq!(write(&read(bare)), bare);
}

#[test]
fn all_findings_come_at_once() {
    let line = |text: &str| -> Vec<(&'static str, usize)> {
        let (machine, findings) = parse(FileId(0), text);
        assert_eq!(machine.is_none(), findings.iter().any(|finding| finding.is_error()));
        findings
            .iter()
            .map(|finding| {
                let at = finding.labels.first().map_or(0, |label| label.span.start as usize);
                (finding.code.id, text[..at].matches('\n').count() + 1)
            })
            .collect()
    };
    assert_eq!(
        line(".i 1\n.o 1\n1x a b 1\n1 a b\n3 a b 1\n.q\n1 a b 11\n.r c\n"),
        [("G0131", 3), ("G0131", 4), ("G0131", 5), ("G0131", 6), ("G0131", 7), ("G0131", 8),]
    );
    assert_eq!(line(".i 1\n.o 1\n.p 3\n1 a b 1\n- a a 1\n0 a a 0\n"), [("G0132", 5), ("G0132", 6)]);
    assert_eq!(line(".i 1\n.o 1\n.s 4\n1 a b 1\n"), [("G0133", 3)]);
    assert_eq!(line("1 a b 1\n"), [("G0131", 1), ("G0131", 1)]);
    assert_eq!(line(""), [("G0131", 1)]);
}

#[test]
fn cubes_cover_everything_or_not() {
    use Trit::{Any, High, Low};
    let all: [&[Trit]; 3] = [&[High, Any], &[Low, High], &[Any, Low]];
    let most: [&[Trit]; 2] = [&[High, Any], &[Low, High]];
    let mut budget = 1000;
    assert_eq!(covers_all(&all, &mut budget), Some(true));
    assert_eq!(covers_all(&most, &mut budget), Some(false));
    assert_eq!(covers_all(&[], &mut budget), Some(false));
    assert_eq!(covers_all(&[&[]], &mut budget), Some(true));
    assert_eq!(covers_all(&all, &mut 2), None);
}
