//! For each invariant of `validate`, at least one net that violates it. Each net is a valid one in which a piece of text is replaced.

use grafsynth_ir::expr::{Expr, ExprKind};
use grafsynth_ir::interval::DEPTH_LIMIT;
use grafsynth_ir::net::{Net, StepId, Stmt, StmtKind};
use grafsynth_ir::{FileId, Id, Span, Valid, text, validate};

/// A Grafcet with every kind of object.
const GRAFCET: &str = "
net plant
policy priority
evolution single
schedule level
tick 10000000 ns

part plant level 1
part inner level 2 priority 3
part drawn level 2
part slave level 1

input m \"loading request\" bool synchronous
input n_in int 0..9
input f bool extern
input E bool event
input I bool internal

output R \"move right\" bool registered continuous
    emit p2 if m and not p1.active
output Q bool mealy
    emit p1 if m
output pos int 0..9 stored pos
output lamp bool controlled lamp
output call_me bool extern
    call p1() if m
output speed bool extern
    param int 0..9 v
    param bool

var n int 0..99 = 0
var v int -3..3 [4] = 0, 1, 2, -3
var b bool = 1
var pos int 0..9 stored = 5
var later bool hidden = 0
timer T while m or b
edge %0 = m and n_in > 3
edge %1 = p1.active

step p1 in plant initial priority 2 budget 100
    entry { n := n + 1; v[n mod 4] := n - 50; if E or rise(%0) { raise I } else { call speed(n, m) } }
    exit { pos := pos + 1 }
    task ramp cost 80 { b := not b }
    task stop cost 20 { call speed(0, false) }
step p2 in plant
    code \"c\" \"beep();\"
step p3 in plant enclosing
step in1 in inner parent p3 link
step in2 in inner parent p3
step m1.e in drawn
step m1.s in drawn
step x1 in slave initial
step x2 in slave

transition t1 in plant p1 -> p2 on (E) priority 1 deadline 5 ns when m and p1.t >= 5 and p1.done
    do { n := 0 }
transition t2 in plant p1 -> p3 restart priority 2 when rise(%0) and not t1.fireable and lamp.q
transition t3 in plant p2 -> m1.e
transition t4 in drawn m1.e -> m1.s when T > 3 and m1.e.T < 9
transition t5 in drawn m1.s -> p1 when fall(%1) or I
transition t6 in inner in1 -> in2
transition t7 in plant p3 -> p1
transition r1 in plant reaction p2 -> when m
    do { b := true }
transition t8 in slave x1 -> x2
transition src in slave -> x1 when E

action lamp duration 5
    use p1 N
    use p2 SD if n > 3
    body { n := n }
force p2 (slave) situation (x2)
force p3 (slave) hold
macro m1 entry m1.e exit m1.s steps (m1.e, m1.s)
assume never m and n_in = 0
assert safe never R.out and p1.active and n > 50
open next when p1.active and m
open output R when m
place step p2 on chip
place var n on cpu
place transition t1 on chip
place output R on chip
device gal22v10
pin m 2
";

/// A statechart with every kind of object.
const STATECHART: &str = "
net radio
policy inner-first
evolution stable limit 20
schedule declared
queue 4
tick 1000000 ns

part radio level 1
    enter (Off)

input power bool event
input skip bool event
input done.On bool internal
input m bool

output lamp bool continuous
    emit On
var n int 0..9 = 0

step Off in radio
step On in radio composite
    entry { n := 0 }
    content { n := 1 }
step Both in radio parallel parent On done done.On
step A in radio composite parent Both
step A1 in radio parent A
step A2 in radio final parent A
step B in radio composite parent Both
step B1 in radio parent B
    entry { send wake; cancel wake }
step B2 in radio final parent B
step Idle in radio parent On

transition t1 in radio Off -> On, content On, Both, A, A1, B, B1 clears (Off, On, Both, A, A1, A2, B, B1, B2, Idle) restart on (power)
transition t2 in radio On -> Off clears (Off, On, Both, A, A1, A2, B, B1, B2, Idle) restart on (power) when m
transition t3 in radio A1 -> A2 clears (A1, A2) restart on (skip)
transition t4 in radio B1 -> B2 clears (B1, B2) restart on (skip)
transition t5 in radio Both -> Idle clears (Both, A, A1, A2, B, B1, B2, Idle) restart on (done.On)
transition t6 in radio Off -> On, history H clears (Off, On, Both, A, A1, A2, B, B1, B2, Idle) restart on (skip)
transition t7 in radio reaction Idle -> on (skip)
    do { raise power }
slot wake sends skip after 3
history H of On
    case A1 (Both, A, A1)
    case A2 (Both, A, A2)
    case B1 (Both, B, B1)
    case B2 (Both, B, B2)
    case Idle (Idle)
    default (Idle)
    content { n := 2 }
";

fn net(source: &str) -> Net {
    let (net, findings) = text::parse(FileId(0), source);
    net.unwrap_or_else(|| panic!("{findings:?}"))
}

/// The codes that `validate` reports, without duplicates.
fn codes(net: Net) -> Vec<&'static str> {
    let findings = validate(net).err().unwrap_or_default();
    let mut codes: Vec<_> = findings.iter().map(|finding| finding.code.id).collect();
    codes.sort_unstable();
    codes.dedup();
    codes
}

/// The text with `old` replaced everywhere; it must occur.
fn changed(base: &str, changes: &[(&str, &str)]) -> String {
    changes.iter().fold(base.to_owned(), |text, (old, new)| {
        assert!(text.contains(old), "the base has no {old:?}");
        text.replace(old, new)
    })
}

#[track_caller]
fn breaks(base: &str, changes: &[(&str, &str)], code: &str) {
    let source = changed(base, changes);
    let found = codes(net(&source));
    assert_eq!(found, [code], "{changes:?}: {:?}", validate(net(&source)).err());
}

/// Like `breaks`, for an edit that violates more than one invariant.
#[track_caller]
fn reports(base: &str, changes: &[(&str, &str)], code: &str) {
    let found = codes(net(&changed(base, changes)));
    assert!(found.contains(&code), "{changes:?}: {found:?}");
}

#[track_caller]
fn holds(base: &str, changes: &[(&str, &str)]) {
    let source = changed(base, changes);
    let found: Result<Valid<Net>, _> = validate(net(&source));
    assert!(found.is_ok(), "{changes:?}: {:?}", found.err());
}

#[test]
fn the_bases_are_valid() {
    holds(GRAFCET, &[]);
    holds(STATECHART, &[]);
}

#[test]
fn i01_ids_lie_in_their_arenas() {
    for (old, new) in [
        ("emit p2", "emit ?99"),
        ("step p2 in plant", "step p2 in ?99"),
        ("p1 -> p2 on", "p1 -> ?99 on"),
        ("on (E)", "on (?99)"),
        ("raise I", "raise ?99"),
        ("n := 0", "?99 := 0"),
        ("call speed(0, false)", "call ?99(0, false)"),
        ("rise(%0) and not", "rise(?99) and not"),
        ("p1.t >= 5", "?99.t >= 5"),
        ("T > 3", "timer ?99 > 3"),
        ("lamp.q", "?99.q"),
        ("not t1.fireable", "not ?99.fireable"),
        ("use p1 N", "use ?99 N"),
        ("force p2", "force ?99"),
        ("force p2 (slave)", "force p2 (?99)"),
        ("situation (x2)", "situation (?99)"),
        ("exit m1.s steps", "exit ?99 steps"),
        ("R.out", "?99.out"),
        ("open output R", "open output ?99"),
        ("place step p2", "place step ?99"),
        ("place var n", "place var ?99"),
        ("place transition t1", "place transition ?99"),
        ("place output R", "place output ?99"),
        ("call p1()", "call ?99()"),
    ] {
        breaks(GRAFCET, &[(old, new)], "G0310");
    }
    // Without its driver, the variable belongs to no output and so has a name of its own.
    assert_eq!(
        codes(net(&changed(GRAFCET, &[("9 stored pos", "9 stored ?99")]))),
        ["G0310", "G0312", "G0322"]
    );
    breaks(GRAFCET, &[("bool controlled lamp", "bool controlled ?99")], "G0310");
    for (old, new) in [
        ("done done.On", "done ?99"),
        ("sends skip", "sends ?99"),
        ("send wake", "send ?99"),
        ("case Idle (Idle)", "case ?99 (Idle)"),
        ("enter (Off)", "enter (?99)"),
        ("history H clears", "history ?99 clears"),
    ] {
        breaks(STATECHART, &[(old, new)], "G0310");
    }
}

#[test]
fn i02_names_fit_a_trace() {
    for name in ["`a b`", "``", "`a,b`", "`a\\u{7f}`", "`v[0]`", "`#x`"] {
        breaks(GRAFCET, &[("x2", name)], "G0311");
        breaks(GRAFCET, &[("net plant", &format!("net {name}"))], "G0311");
        breaks(GRAFCET, &[("transition r1", &format!("transition {name}"))], "G0311");
    }
    for name in ["dt", "scan", "`steps`"] {
        breaks(GRAFCET, &[("n_in", name)], "G0311");
        breaks(GRAFCET, &[("output Q", &format!("output {name}"))], "G0311");
    }
    breaks(STATECHART, &[("lamp", "fault")], "G0311");
    holds(GRAFCET, &[("output Q", "output fault"), ("var later", "var dt"), ("x2", "`größe-2`")]);
}

#[test]
fn i03_names_are_unique() {
    for (old, new) in [
        ("step p2 in", "step p1 in plant\nstep p2 in"),
        ("macro m1 ", "macro p1 "),
        ("input f bool extern", "input m bool"),
        ("output Q", "output m"),
        ("var later", "var T"),
        ("var later bool hidden", "var pos bool hidden"),
        ("timer T", "timer b while m\ntimer T"),
        ("transition t2 in", "transition t1 in"),
        ("part drawn", "part plant level 2\npart drawn"),
        ("task stop", "task ramp"),
        ("input f bool", "input `p1.t` bool"),
        ("var later", "var `m1.active`"),
    ] {
        let mut found = codes(net(&changed(GRAFCET, &[(old, new)])));
        found.retain(|code| *code == "G0312");
        assert_eq!(found, ["G0312"], "{new}");
    }
    breaks(GRAFCET, &[("action lamp", "action lamp duration 0\naction lamp")], "G0312");
    breaks(STATECHART, &[("slot wake", "slot wake sends skip after 3\nslot wake")], "G0312");
    breaks(
        STATECHART,
        &[("history H of", "history H of On\n default (Idle)\nhistory H of")],
        "G0312",
    );
}

#[test]
fn i04_types_can_be() {
    reports(GRAFCET, &[("v int -3..3", "v int 3..-3")], "G0313");
    breaks(GRAFCET, &[("n_in int 0..9", "n_in int 0..2147483648")], "G0313");
    breaks(GRAFCET, &[("param int 0..9", "param int 9..0")], "G0313");
    breaks(
        GRAFCET,
        &[("input I bool internal", "input I int 0..1 internal"), ("or I", "")],
        "G0313",
    );
    breaks(GRAFCET, &[("[4] = 0, 1, 2, -3", "[0] = 0"), ("v[n mod 4] := n - 50;", "")], "G0313");
}

#[test]
fn i05_values_at_reset_fit() {
    breaks(GRAFCET, &[("n int 0..99 = 0", "n int 0..99 = 100")], "G0314");
    breaks(GRAFCET, &[("b bool = 1", "b bool = 2")], "G0314");
    breaks(GRAFCET, &[("= 0, 1, 2, -3", "= 0, 1")], "G0314");
    breaks(GRAFCET, &[("n int 0..99 = 0", "n int 0..99")], "G0314");
    holds(GRAFCET, &[("= 0, 1, 2, -3", "= 3")]);
}

#[test]
fn i06_numbers_are_at_least_one_and_lists_name_nothing_twice() {
    breaks(GRAFCET, &[("part inner level 2 priority 3", "part inner level 2 priority 0")], "G0327");
    breaks(GRAFCET, &[("part slave level 1", "part slave level 0")], "G0327");
    breaks(GRAFCET, &[("initial priority 2", "initial priority 0")], "G0327");
    breaks(GRAFCET, &[("on (E) priority 1", "on (E) priority 0")], "G0327");
    breaks(GRAFCET, &[("tick 10000000", "tick 0")], "G0327");
    breaks(STATECHART, &[("limit 20", "limit 0")], "G0327");
    breaks(STATECHART, &[("queue 4", "queue 0")], "G0327");
    breaks(GRAFCET, &[("t1 in plant p1 ->", "t1 in plant p1, p1 ->")], "G0326");
    breaks(GRAFCET, &[("p1 -> p2 on", "p1 -> p2, p2 on")], "G0326");
    breaks(GRAFCET, &[("on (E)", "on (E, I, E)")], "G0326");
    breaks(GRAFCET, &[("force p2 (slave)", "force p2 (slave, slave)")], "G0326");
    breaks(GRAFCET, &[("steps (m1.e, m1.s)", "steps (m1.e, m1.s, m1.e)")], "G0326");
}

#[test]
fn i07_expressions_have_types() {
    breaks(GRAFCET, &[("when m and p1.t", "when n and p1.t")], "G0315");
    breaks(GRAFCET, &[("n := n + 1", "n := m")], "G0315");
    breaks(GRAFCET, &[("b := true", "b := 3")], "G0315");
    breaks(GRAFCET, &[("when T > 3", "when m = 3 and T > 3")], "G0315");
    breaks(GRAFCET, &[("call speed(n, m)", "call speed(m, m)")], "G0315");
    let large = "9223372036854775807 + n > 3";
    breaks(
        GRAFCET,
        &[("never m and", &format!("never m and {large} and")), ("+ n > 3", "+ n_in > 3")],
        "G0316",
    );
    breaks(GRAFCET, &[("n + 1", "5 / n")], "G0317");
    breaks(GRAFCET, &[("n mod 4", "n mod 5")], "G0318");
    breaks(GRAFCET, &[("n > 50", "v[n] > 50")], "G0318");
    breaks(GRAFCET, &[("n > 50", "v > 50")], "G0318");
    breaks(GRAFCET, &[("n > 50", "n[0] > 50")], "G0318");
    let mut deep = net(GRAFCET);
    for _ in 0..DEPTH_LIMIT {
        let guard = std::mem::replace(&mut deep.properties[1].never, Expr::bool(true));
        deep.properties[1].never = Expr::new(ExprKind::Not(Box::new(guard)), Span::default());
    }
    assert_eq!(codes(deep), ["G0304"]);
    let mut deep = net(GRAFCET);
    for _ in 0..DEPTH_LIMIT {
        let then = std::mem::take(&mut deep.actions[Id::from_index(0)].body);
        let kind = StmtKind::If { condition: Expr::bool(true), then, otherwise: Vec::new() };
        deep.actions[Id::from_index(0)].body = vec![Stmt { kind, span: Span::default() }];
    }
    assert_eq!(codes(deep), ["G0304"]);
}

#[test]
fn i08_times_are_compared_with_constants() {
    for condition in
        ["p1.t >= n", "p1.t + 1 > 3", "p1.t >= -1", "p1.t >= 2147483647", "T = p1.t", "p1.T > T"]
    {
        breaks(GRAFCET, &[("p1.t >= 5", condition)], "G0319");
    }
    holds(GRAFCET, &[("p1.t >= 5", "5 < p1.t and p1.t <> 2147483646 and T <= 0")]);
}

#[test]
fn i09_to_i12_edges_events_and_fireable_stand_where_they_have_a_meaning() {
    for bad in ["rise(%0)", "E", "I", "t1.fireable"] {
        breaks(GRAFCET, &[("emit p2 if m", &format!("emit p2 if {bad}"))], "G0320");
        breaks(GRAFCET, &[("emit p1 if m", &format!("emit p1 if {bad}"))], "G0320");
        breaks(GRAFCET, &[("call p1() if m", &format!("call p1() if {bad}"))], "G0320");
        breaks(GRAFCET, &[("SD if n > 3", &format!("SD if {bad}"))], "G0320");
        breaks(GRAFCET, &[("while m or b", &format!("while m or {bad}"))], "G0320");
        breaks(GRAFCET, &[("b := not b", &format!("b := {bad}"))], "G0320");
        breaks(GRAFCET, &[("body { n := n }", &format!("body {{ b := {bad} }}"))], "G0320");
        breaks(GRAFCET, &[("edge %0 = m", &format!("edge %0 = {bad}"))], "G0320");
    }
    breaks(GRAFCET, &[("not t1.fireable", "not t2.fireable")], "G0320");
    breaks(GRAFCET, &[("not t1.fireable", "not t3.fireable")], "G0320");
    breaks(GRAFCET, &[("b := true", "b := t1.fireable")], "G0320");
    breaks(STATECHART, &[("when m", "when m and skip")], "G0320");
    breaks(STATECHART, &[("entry { n := 0 }", "entry { if skip { n := 0 } }")], "G0320");
    breaks(GRAFCET, &[("edge %0 = m and n_in > 3", "edge %0 = n_in")], "G0315");
}

#[test]
fn i13_properties_and_open_cells_read_what_they_may() {
    breaks(GRAFCET, &[("never m and n_in", "never b and n_in")], "G0320");
    breaks(GRAFCET, &[("never m and n_in", "never R.out and n_in")], "G0320");
    breaks(GRAFCET, &[("never m and n_in", "never I and n_in")], "G0320");
    for bad in ["rise(%0)", "t1.fireable", "I"] {
        breaks(GRAFCET, &[("never R.out", &format!("never {bad}"))], "G0320");
    }
    breaks(GRAFCET, &[("never R.out", "never speed.out")], "G0320");
    holds(GRAFCET, &[("never R.out", "never call_me.out")]);
    breaks(GRAFCET, &[("when p1.active and m", "when p1.active and b")], "G0320");
    breaks(GRAFCET, &[("when p1.active and m", "when rise(%0)")], "G0320");
}

#[test]
fn i14_outputs_have_one_driver() {
    breaks(
        GRAFCET,
        &[("output R \"move right\" bool", "output R int 0..1"), ("R.out", "R.out > 0")],
        "G0322",
    );
    breaks(GRAFCET, &[("output pos int 0..9", "output pos int 0..8")], "G0322");
    breaks(
        GRAFCET,
        &[("pos int 0..9 stored = 5", "pos int 0..9 hidden = 5"), ("output pos", "output other")],
        "G0322",
    );
    breaks(GRAFCET, &[("later bool hidden", "later bool stored")], "G0322");
    breaks(
        GRAFCET,
        &[("output Q bool", "output second int 0..9 stored pos\noutput Q bool")],
        "G0322",
    );
    breaks(
        GRAFCET,
        &[("output Q bool", "output second bool controlled lamp\noutput Q bool")],
        "G0322",
    );
}

#[test]
fn i15_extern_actions_are_continuous_or_called_with_the_right_arguments() {
    breaks(GRAFCET, &[("call speed(0, false)", "call call_me()")], "G0322");
    breaks(GRAFCET, &[("call speed(0, false)", "call speed(0)")], "G0330");
    breaks(GRAFCET, &[("call p1()", "call p1(3)")], "G0330");
    breaks(GRAFCET, &[("call speed(0, false)", "call speed(false, false)")], "G0315");
}

#[test]
fn i16_mealy_outputs_need_single_evolution() {
    breaks(GRAFCET, &[("evolution single", "evolution stable limit 9")], "G0321");
}

#[test]
fn i17_statements_fit_their_targets() {
    breaks(GRAFCET, &[("v[n mod 4] :=", "v :=")], "G0318");
    breaks(GRAFCET, &[("n := 0", "n[0] := 0")], "G0318");
    breaks(GRAFCET, &[("v[n mod 4] :=", "v[n] :=")], "G0318");
    breaks(GRAFCET, &[("raise I", "raise m")], "G0330");
    breaks(GRAFCET, &[("call speed(0, false)", "call R()")], "G0330");
    breaks(GRAFCET, &[("on (E)", "on (m)")], "G0325");
    breaks(STATECHART, &[("sends skip", "sends m")], "G0330");
}

#[test]
fn i18_durations_fit() {
    breaks(GRAFCET, &[("use p2 SD", "use p2 S")], "G0329");
    breaks(GRAFCET, &[("duration 5", "duration 2147483647")], "G0319");
    breaks(STATECHART, &[("after 3", "after 4000000000")], "G0319");
    holds(GRAFCET, &[("duration 5", "duration 0")]);
}

#[test]
fn i19_tasks_fit_their_budget() {
    breaks(GRAFCET, &[("budget 100", "budget 79")], "G0328");
    breaks(GRAFCET, &[(" budget 100", "")], "G0328");
    for bad in ["raise I", "code \"c\" \"x\""] {
        breaks(GRAFCET, &[("b := not b", bad)], "G0328");
    }
}

#[test]
fn i20_no_statechart_parts_elsewhere() {
    for (old, new) in [
        ("schedule level", "schedule level\nqueue 3"),
        ("step p2 in plant", "step p2 in plant composite"),
        ("step p2 in plant", "step p2 in plant final"),
        ("step p2 in plant", "step p2 in plant done I"),
        ("step p2 in plant", "step p2 in plant\n    content { n := 0 }"),
        ("part slave level 1", "part slave level 1\n    enter (x1)"),
        ("p1 -> p2 on", "p1 -> p2, content p2 on"),
        ("macro m1 ", "slot s sends E after 2\nmacro m1 "),
        ("macro m1 ", "history h of p3\n    default (in1)\nmacro m1 "),
    ] {
        breaks(GRAFCET, &[(old, new)], "G0323");
    }
}

#[test]
fn i21_transitions_can_fire() {
    breaks(GRAFCET, &[("p1 -> p2 on", "p1 -> p2 clears (p2) on")], "G0325");
    breaks(GRAFCET, &[("p1 -> p2 on", "p1 -> p2 clears () on")], "G0325");
    breaks(GRAFCET, &[("src in slave -> x1", "src in slave ->")], "G0325");
    breaks(GRAFCET, &[("reaction p2 ->", "reaction p2, p1 ->")], "G0325");
    breaks(GRAFCET, &[("reaction p2 ->", "reaction p2 -> p1")], "G0325");
    breaks(GRAFCET, &[("reaction p2 ->", "reaction p2 -> clears (p2)")], "G0325");
    breaks(GRAFCET, &[("reaction p2 ->", "reaction p2 -> priority 2")], "G0325");
}

#[test]
fn i22_enclosures_nest() {
    breaks(GRAFCET, &[("plant enclosing", "plant")], "G0324");
    breaks(GRAFCET, &[("step p2 in plant", "step p2 in plant link")], "G0324");
    breaks(
        GRAFCET,
        &[("step in2 in inner parent p3", "step in2 in inner"), ("in1 -> in2", "in1 ->")],
        "G0324",
    );
    breaks(GRAFCET, &[("part inner level 2", "part inner level 1")], "G0324");
    breaks(GRAFCET, &[("in1 -> in2", "in1 -> p2")], "G0325");
    let late = [
        ("step p3 in plant enclosing\n", ""),
        ("step x1 in", "step p3 in plant enclosing\nstep x1 in"),
    ];
    breaks(GRAFCET, &late, "G0324");
}

#[test]
fn i23_forcing_can_be_carried_out() {
    breaks(GRAFCET, &[("force p2 (slave)", "force p2 ()"), ("(x2)", "()")], "G0331");
    breaks(GRAFCET, &[("situation (x2)", "situation (p1)")], "G0331");
    breaks(GRAFCET, &[("force p2 (slave)", "force p2 (slave, plant)")], "G0331");
    breaks(GRAFCET, &[("macro m1", "force x1 (plant) hold\nmacro m1")], "G0331");
    breaks(
        GRAFCET,
        &[(
            "macro m1",
            "force x1 (drawn) hold\nforce m1.e (plant, inner) situation (p3)\nmacro m1",
        )],
        "G0331",
    );
}

#[test]
fn i24_something_can_happen() {
    breaks(GRAFCET, &[("p1 in plant initial", "p1 in plant")], "G0334");
    // A forced chart and a chart with a source transition need no initial step.
    holds(GRAFCET, &[("x1 in slave initial", "x1 in slave")]);
}

#[test]
fn i25_macro_steps_hold_their_ends() {
    breaks(GRAFCET, &[("steps (m1.e, m1.s)", "steps (m1.e)")], "G0335");
    breaks(GRAFCET, &[("steps (m1.e, m1.s)", "steps (m1.s)")], "G0335");
}

#[test]
fn i26_no_grafcet_parts_in_statecharts() {
    breaks(STATECHART, &[("evolution stable limit 20", "evolution single")], "G0321");
    breaks(STATECHART, &[("schedule declared", "schedule declared\nfire one")], "G0321");
    for (old, new) in [
        ("step Off in radio", "step Off in radio initial"),
        ("step Off in radio", "step Off in radio priority 2"),
        ("step Off in radio", "step Off in radio enclosing"),
        ("step Idle in radio parent On", "step Idle in radio parent On link"),
        ("slot wake", "force Off (radio) hold\nslot wake"),
        ("slot wake", "macro m entry Off exit Off steps (Off)\nslot wake"),
        ("restart on (done.On)", "restart on (done.On) priority 3"),
        ("restart on (done.On)", "on (done.On)"),
        ("t5 in radio Both -> Idle", "t5 in radio Both, A -> Idle"),
        ("t5 in radio Both -> Idle", "t5 in radio -> Idle"),
    ] {
        breaks(STATECHART, &[(old, new)], "G0323");
    }
    let no_target = [(
        "Both -> Idle clears (Both, A, A1, A2, B, B1, B2, Idle)",
        "Both -> clears (Both, A, A1, A2, B, B1, B2, Idle)",
    )];
    reports(STATECHART, &no_target, "G0323");
}

#[test]
fn i27_queues_have_a_bound() {
    breaks(STATECHART, &[("queue 4\n", "")], "G0321");
    let quiet = [
        ("queue 4\n", ""),
        ("send wake; cancel wake", ""),
        ("raise power", "n := 3"),
        (" done done.On", ""),
    ];
    holds(STATECHART, &quiet);
}

#[test]
fn i28_states_nest() {
    for (old, new) in [
        ("step Idle in radio", "step Idle in radio composite"),
        ("step Idle in radio parent On", "step Idle in radio parent Off"),
        ("step Off in radio", "step Off in radio done done.On"),
        ("parent On done done.On", "parent On done m"),
        ("step Off in radio", "step Off in radio\n    content { n := 0 }"),
        ("step B in radio composite parent Both", "step B in radio final parent Both"),
        ("step A in radio composite parent Both", "step A in radio composite parent Idle"),
    ] {
        reports(STATECHART, &[(old, new)], "G0324");
    }
    breaks(STATECHART, &[("parent On done done.On", "parent On done m")], "G0324");
}

#[test]
fn i29_moves_leave_what_lies_in_one_state() {
    breaks(STATECHART, &[("A1 -> A2 clears (A1, A2)", "A1 -> A2 clears (A1)")], "G0325");
    breaks(STATECHART, &[("A1 -> A2 clears (A1, A2)", "A1 -> A2 clears (A1, A2, B1)")], "G0325");
    breaks(STATECHART, &[("A1 -> A2 clears (A1, A2)", "A1 -> A2 clears ()")], "G0325");
    breaks(STATECHART, &[("A1 -> A2 clears (A1, A2)", "A1 -> B2 clears (B1, B2)")], "G0325");
    breaks(STATECHART, &[("t3 in radio A1", "t3 in radio A2")], "G0325");
    holds(STATECHART, &[("t3 in radio A1", "t3 in radio A")]);
}

#[test]
fn i30_what_is_entered_is_complete() {
    for entered in [
        "On, content On, Both, A, A1",
        "On, content On, Both, A, A1, B",
        "On",
        "On, Idle, Both, A, A1, B, B1",
        "Both, A, A1, B, B1",
        "A1",
        "On, history H, Idle",
        "Off, On, Idle",
        "content On, On, Idle",
        "history H",
    ] {
        breaks(STATECHART, &[("On, content On, Both, A, A1, B, B1", entered)], "G0333");
    }
    breaks(STATECHART, &[("enter (Off)", "enter (Off, On)")], "G0333");
    breaks(STATECHART, &[("enter (Off)", "")], "G0333");
    breaks(STATECHART, &[("default (Idle)", "default (Both)")], "G0333");
    breaks(STATECHART, &[("case A1 (Both, A, A1)", "case A1 (A, A1)")], "G0333");
}

#[test]
fn i31_histories_stay_inside() {
    breaks(STATECHART, &[("case Idle (Idle)", "case Off (Idle)")], "G0332");
    breaks(STATECHART, &[("case Idle (Idle)", "case A1 (Idle)")], "G0326");
    breaks(STATECHART, &[("default (Idle)", "default (history H)")], "G0332");
    breaks(STATECHART, &[("history H of On", "history G of Off\nhistory H of On")], "G0332");
}

#[test]
fn a_hundred_thousand_steps_are_checked_in_a_moment() {
    let n = 100_000;
    let mut source = String::from("net big\npart big level 1\ninput m bool\n");
    for step in 0..n {
        source
            .push_str(&format!("step s{step} in big{}\n", if step == 0 { " initial" } else { "" }));
    }
    for step in 0..n {
        let next = (step + 1) % n;
        source.push_str(&format!(
            "transition t{step} in big s{step} -> s{next} when m and s{step}.t >= 3\n"
        ));
    }
    let valid = validate(net(&source)).unwrap();
    assert_eq!(valid.transitions[Id::from_index(n - 1)].enters.len(), 1);
    assert_eq!(valid.steps[StepId::from_index(7)].name.text, "s7");
}
