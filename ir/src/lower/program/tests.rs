//! Tests with programs of small nets: they compare the text of the program if its form matters, otherwise the rows of a run.

use super::{ProgramOptions, codes, program, show};
use crate::net::Net;
use crate::program::{Origin, Program, ResetEffect};
use crate::program_run::Machine;
use crate::{FileId, Valid, text, validate};

fn net(source: &str) -> Valid<Net> {
    let (net, findings) = text::parse(FileId(0), source);
    assert!(findings.is_empty(), "{findings:?}");
    validate(net.unwrap()).unwrap()
}

fn made(source: &str) -> (Valid<Net>, Program) {
    let net = net(source);
    let program = program(&net, &ProgramOptions::default()).unwrap();
    (net, program)
}

fn shown(source: &str) -> String {
    let (net, program) = made(source);
    show(&net, &program)
}

/// The rows of a run: each input line sets the named inputs to 1 for one tick. A row lists the active steps, then the outputs that are not 0, including
/// `fault`.
fn rows(source: &str, stimulus: &[&str]) -> Vec<String> {
    let (net, program) = made(source);
    let mut machine = Machine::new(&program);
    let row = |machine: &Machine<'_>, shown: crate::program_run::Shown| {
        let mut words = Vec::new();
        for (id, cell) in program.cells.iter() {
            if let Origin::Step(step) = cell.origin
                && machine.cell(id) == [1]
            {
                words.push(net.steps[step].name.text.clone());
            }
        }
        for (id, cell) in program.cells.iter() {
            if let Origin::Var(_) = cell.origin {
                words.push(format!("{}={:?}", cell.name, machine.cell(id)));
            }
        }
        for (id, output) in net.outputs.iter() {
            if shown.outputs[id.index()] != 0 {
                words.push(format!("{}={}", output.name, shown.outputs[id.index()]));
            }
        }
        for effect in &shown.effects {
            if let ResetEffect::Call(output, arguments) = effect {
                words.push(format!("{}({arguments:?})", net.outputs[*output].name));
            }
        }
        if shown.fault {
            words.push("fault".to_owned());
        }
        words.join(" ")
    };
    let reset = machine.reset();
    let mut rows = vec![row(&machine, reset)];
    for line in stimulus {
        let inputs: Vec<i64> = net
            .inputs
            .values()
            .map(|input| i64::from(line.split(' ').any(|word| word == input.name.text)))
            .collect();
        let shown = machine.react(&inputs, 1);
        rows.push(row(&machine, shown));
    }
    rows
}

const TRUCK: &str = "
net truck
policy priority-age
evolution single
part truck level 1
input m bool
input b bool
input p bool
input a bool
output R bool continuous
    emit p2
step p1 in truck initial
step p2 in truck
step p3 in truck
step p4 in truck
transition t1 in truck p1 -> p2 when m
transition t2 in truck p2 -> p3 when b
transition t3 in truck p3 -> p4 when p
transition t4 in truck p4 -> p1 when a
";

#[test]
fn a_plain_chart_is_fire_bits_and_next_bits_only() {
    let expected = "\
cell p1 = 1
cell p2 = 0
cell p3 = 0
cell p4 = 0

%t1 := p1 and m
%t2 := p2 and b
%t3 := p3 and p
%t4 := p4 and a
p1 := (p1 and not %t1) or %t4
p2 := (p2 and not %t2) or %t1
p3 := (p3 and not %t3) or %t2
p4 := (p4 and not %t4) or %t3
output R = p2
";
    assert_eq!(shown(TRUCK), expected);
}

#[test]
fn only_true_rivals_are_tested() {
    let source = "
net demo
policy priority
evolution single
part demo level 1
input x bool
input y bool
step s in demo initial
step t in demo initial
step u in demo
transition t1 in demo s -> u when x
transition t2 in demo s -> u when y and not t1.fireable
transition t3 in demo s -> u when not x
transition t4 in demo t -> u when x
transition t5 in demo s -> u priority 1 when y
";
    let text = shown(source);
    let body = text.split("\n\n").nth(1).unwrap();
    // The conditions of t1 and t3 exclude each other, and so does the `otherwise` of t2; t4 leaves another step.
    let expected = "\
%t1.fireable := s and x
%t4 := t and x
%t5 := s and y
%t1 := %t1.fireable and not %t5
%t2 := s and y and not %t1.fireable and not %t5
%t3 := s and not x and not %t2 and not %t5
s := s and not (%t1 or %t2 or %t3 or %t5)
t := t and not %t4
u := u or %t1 or %t2 or %t3 or %t4 or %t5
";
    assert_eq!(body, expected);
}

#[test]
fn a_step_with_many_ways_out_gathers_the_takers() {
    let mut source = String::from(
        "net star\npolicy priority\nevolution single\npart star level 1\nstep s in star initial\nstep e in star\n",
    );
    for at in 0..200 {
        source += &format!("input i{at} bool\ntransition t{at} in star s -> e when i{at}\n");
    }
    let text = shown(&source);
    let literals = text.matches("not %").count();
    assert!(literals < 200 * 12, "{literals} tests of rivals for 200 transitions");
    assert_eq!(rows(&source, &["i150 i199"]), ["s", "e"]);
}

#[test]
fn lists_see_bits_move_only_where_they_look() {
    let source = "
net demo
policy all
evolution single
part demo level 1
input x bool
var n int 0..9 = 0
step a in demo initial
    exit { if a.active { n := n + 1 } }
step b in demo
    entry { if a.active { n := 9 } ; if b.active { n := n + 1 } }
step c in demo
transition t1 in demo a -> b when x
transition t2 in demo b -> c when x
";
    let text = shown(source);
    assert!(text.contains("    a := false") && !text.contains("c := false"), "{text}");
    assert_eq!(rows(source, &["x", "x"]), ["a n=[0]", "b n=[2]", "c n=[2]"]);
}

#[test]
fn simultaneous_assignments_swap() {
    let source = "
net demo
policy all
evolution single
assign simultaneous
part demo level 1
var v int 0..9[2] = 3, 4
var x int 0..9 = 1
var y int 0..9 = 2
step a in demo initial
step b in demo
transition t1 in demo a -> b
    do { x := y; y := x; v[0] := v[1]; v[1] := v[0] }
";
    assert_eq!(rows(source, &[""]), ["a v=[3, 4] x=[1] y=[2]", "b v=[4, 3] x=[2] y=[1]"]);
}

#[test]
fn a_livelock_stops_at_the_limit_with_a_fault() {
    let source = "
net demo
policy all
evolution stable limit 3
part demo level 1
step a in demo initial
step b in demo
transition t1 in demo a -> b
transition t2 in demo b -> a
";
    assert_eq!(rows(source, &["", ""]), ["a", "b fault", "a fault"]);
}

#[test]
fn an_event_that_makes_nothing_fire_is_no_fault() {
    let source = |tail: &str| {
        format!(
            "
net demo
policy all
evolution stable limit 1
part demo level 1
input E bool event
step a in demo initial
step b in demo
transition t1 in demo a -> b
    do {{ raise E }}
{tail}
"
        )
    };
    assert_eq!(rows(&source(""), &[""]), ["a", "b"]);
    assert_eq!(
        rows(&source("transition t2 in demo b -> a on (E)"), &["", ""]),
        ["a", "b fault", "b"]
    );
}

#[test]
fn ages_pick_the_branch_that_waited_longer() {
    let source = "
net demo
policy priority-age
evolution single
part demo level 1
step i in demo initial
step a in demo
step b in demo
transition t1 in demo i -> a
transition t2 in demo i -> b
transition t3 in demo a -> i
transition t4 in demo b -> i
";
    assert_eq!(rows(source, &["", "", "", ""]), ["i", "a", "i", "b", "i"]);
    let (_, program) = made(source);
    let ages =
        program.cells.values().filter(|cell| matches!(cell.origin, Origin::Older(..))).count();
    assert_eq!(ages, 1, "one bit for the one pair that competes");
}

#[test]
fn a_targetless_transition_acts_where_it_is_selected() {
    // P offers `outer` through the first region that offers nothing of its own; `inner` of the other region runs before or after it.
    let source = "
net demo
policy inner-first
evolution stable limit 9
part demo level 1
    enter (P, r1, a, r2, b)
input E bool event
input x bool
input y bool
var n int 0..999 = 0
step P in demo parallel
step r1 in demo composite parent P
step a in demo parent r1
step r2 in demo composite parent P
step b in demo parent r2
transition in_a in demo reaction a -> clears () on (E) when x
    do { n := n * 10 + 1 }
transition outer in demo reaction P -> clears () on (E)
    do { n := n * 10 + 2 }
transition in_b in demo reaction b -> clears () on (E) when y
    do { n := n * 10 + 3 }
";
    let source = source.replace("-> clears ()", "->");
    let values = |stimulus: &str| rows(&source, &[stimulus]).pop().unwrap();
    assert_eq!(values("E x"), "P r1 a r2 b n=[12]", "a offers its own, b what P has");
    assert_eq!(values("E y"), "P r1 a r2 b n=[23]", "a offers what P has, b its own");
    assert_eq!(values("E x y"), "P r1 a r2 b n=[13]", "nobody offers what P has");
    assert_eq!(values("E"), "P r1 a r2 b n=[2]", "both offer it, it acts once");
}

#[test]
fn regions_that_finish_together_complete_their_parallel_once() {
    let source = "
net demo
policy inner-first
evolution stable limit 9
queue 8
part demo level 1
    enter (P, r1, a, r2, b)
input E bool event
input donep bool internal
var n int 0..99 = 0
step P in demo parallel done donep
step r1 in demo composite parent P
step a in demo parent r1
step f1 in demo final parent r1
step r2 in demo composite parent P
step b in demo parent r2
step f2 in demo final parent r2
transition t1 in demo a -> f1 clears (a, f1) restart on (E)
transition t2 in demo b -> f2 clears (b, f2) restart on (E)
transition t3 in demo reaction P -> on (donep)
    do { n := n + 1 }
";
    assert_eq!(
        rows(source, &["E", "E"]),
        ["P r1 a r2 b n=[0]", "P r1 f1 r2 f2 n=[1]", "P r1 f1 r2 f2 n=[1]"]
    );
}

#[test]
fn a_chart_that_sends_to_itself_for_ever_ends_in_a_fault() {
    let source = "
net demo
policy inner-first
evolution stable limit 4
queue 2
part demo level 1
    enter (a)
input E bool event
var n int 0..99 = 0
step a in demo
transition t1 in demo reaction a -> on (E)
    do { n := n + 1; send again }
slot again sends E after 0
";
    assert_eq!(rows(source, &["", "E", ""]), ["a n=[0]", "a n=[0]", "a n=[4] fault", "a n=[4]"]);
}

#[test]
fn due_sends_join_by_due_time() {
    let source = "
net demo
policy inner-first
evolution stable limit 9
queue 4
part demo level 1
    enter (s)
input A bool event
input B bool event
var n int 0..99 = 0
step s in demo
    entry { send sa; send sb; send sc }
transition t1 in demo reaction s -> on (A)
    do { n := n * 10 + 1 }
transition t2 in demo reaction s -> on (B)
    do { n := n * 10 + 2 }
slot sa sends A after 3
slot sb sends B after 2
slot sc sends A after 9
";
    let (net, program) = made(source);
    let mut machine = Machine::new(&program);
    let n =
        program.cells.ids().find(|id| matches!(program.cells[*id].origin, Origin::Var(_))).unwrap();
    machine.react(&[0, 0], 5);
    assert_eq!(machine.cell(n), [21], "B after 2 ticks, A after 3, in {}", net.name);
    machine.react(&[0, 0], 3);
    assert_eq!(machine.cell(n), [21]);
    machine.react(&[0, 1], 1);
    assert_eq!(machine.cell(n), [99], "the send before the event of the row");
}

#[test]
fn a_queue_beyond_all_measure_is_refused() {
    let source = "
net demo
policy inner-first
evolution stable limit 4
queue 100000
part demo level 1
    enter (a)
input E bool event
step a in demo
step b in demo
transition t1 in demo a -> b clears (a, b) restart on (E)
    do { raise E }
";
    let findings = program(&net(source), &ProgramOptions::default()).unwrap_err();
    assert_eq!(findings.len(), 1);
    assert_eq!(findings[0].code, codes::QUEUE_TOO_LONG);
}

#[test]
fn reset_leaves_constants() {
    let source = "
net demo
policy all
evolution single
part demo level 1
output hello bool extern
    param int 0..9
var n int 0..9 = 4
step a in demo initial
    entry { call hello(n + 20); n := n - 1 }
";
    let (_, program) = made(source);
    assert!(
        matches!(program.reset_effects.as_slice(), [ResetEffect::Call(_, arguments)] if arguments == &[9])
    );
    assert_eq!(rows(source, &[""]), ["a n=[3] hello([9])", "a n=[3]"]);
}

#[test]
fn size_is_linear() {
    let chart = |n: usize| {
        let mut source = String::from(
            "net long\npolicy priority-age\nevolution stable limit 5\npart long level 1\ninput x bool\n",
        );
        for at in 0..n {
            source += &format!("step s{at} in long{}\n", if at == 0 { " initial" } else { "" });
            source += &format!(
                "transition t{at} in long s{at} -> s{} when x and s{at}.t >= 3\n",
                (at + 1) % n
            );
        }
        shown(&source).len()
    };
    let (small, large) = (chart(100), chart(800));
    assert!(large < small * 10, "{small} characters for 100 steps, {large} for 800");
}
