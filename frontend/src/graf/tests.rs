//! Tests of the parser, one for each form.

use grafsynth_ir::FileId;
use grafsynth_ir::chart::{
    ActionHow, DeclarationKind, Expr, Item, Leaf, Length, SettingKind, Step, StepItemKind,
    StepRole, StmtKind, Transition,
};
use grafsynth_ir::expr::{ArithOp, ExprKind, Type};
use grafsynth_ir::net::Qualifier;
use itertools::Itertools as _;

use super::*;

/// The example of the language reference.
pub(crate) const TRUCK: &str = r#"chart truck {                              # the seed's truck: Fig. 1 of 004
    tick 10 ms
    conflict priority-age                  # all | priority | priority-age | inner-first | outer-first
    evolution single                       # single | stable

    input  m "loading request", b "right limit", p "loaded", a "left limit"
    output R "move right", Z "load", L "move left"
    assume never (a and b)                 # the environment: used by the verifier and as don't-cares on the chip
    assert never (R and L)                 # a property: proved or refuted by `check`

    initial step p1 "waiting"
    step p2 { R }
    step p3 { Z }
    step p4 { L }

    t1: p1 -> p2 when m
    t2: p2 -> p3 when b
    t3: p3 -> p4 when p
    t4: p4 -> p1 when a
}
"#;

/// The items of a chart, which must have no finding.
#[track_caller]
fn items(body: &str) -> Vec<Item> {
    let text = format!("chart c {{\n{body}\n}}");
    let parsed = parse(FileId(0), &text);
    assert_eq!(parsed.diagnostics, [], "{text}");
    parsed.design.unwrap().charts.remove(0).items
}

/// The codes of the findings in the body of a chart, and the text at each.
fn findings(body: &str) -> Vec<(String, String)> {
    let text = format!("chart c {{\n{body}\n}}");
    codes_of(&text)
}

fn codes_of(text: &str) -> Vec<(String, String)> {
    parse(FileId(0), text)
        .diagnostics
        .iter()
        .map(|d| {
            (
                d.code.id.to_owned(),
                d.labels.first().map_or("", |label| &text[label.span.range()]).to_owned(),
            )
        })
        .collect()
}

#[track_caller]
fn only_codes(body: &str) -> Vec<String> {
    findings(body).into_iter().map(|(code, _)| code).collect()
}

#[track_caller]
fn transition(text: &str) -> Transition {
    match items(text).pop() {
        Some(Item::Transition(transition)) => transition,
        other => panic!("no transition: {other:?}"),
    }
}

#[track_caller]
fn step(text: &str) -> Step {
    match items(text).pop() {
        Some(Item::Step(step)) => step,
        other => panic!("no step: {other:?}"),
    }
}

/// The guard of a transition in a chart with the given declarations, in a compact prefix notation.
#[track_caller]
fn guard(text: &str) -> String {
    let t = transition(&format!(
        "input n: int 0..9, k: int 0..9, a, b, c\nvar v: int 0..9[4]\nx -> y when {text}"
    ));
    show(&t.guard.unwrap())
}

fn show(expr: &Expr) -> String {
    let list = |all: &[Expr]| all.iter().map(show).join(" ");
    match &expr.kind {
        ExprKind::Bool(value) => value.to_string(),
        ExprKind::Int(value) => value.to_string(),
        ExprKind::Leaf(leaf) => match leaf {
            Leaf::Name(path) => path.to_string(),
            Leaf::Rise(inner) => format!("(rise {})", show(inner)),
            Leaf::Fall(inner) => format!("(fall {})", show(inner)),
            Leaf::Otherwise => "otherwise".to_owned(),
            Leaf::Duration(ns) => format!("{ns}ns"),
            Leaf::Delay(on, inner, off) => format!("(delay {on} {} {off})", show(inner)),
        },
        ExprKind::Element(Leaf::Name(path), index) => format!("{path}[{}]", show(index)),
        ExprKind::Element(..) => "?".to_owned(),
        ExprKind::Not(inner) => format!("(not {})", show(inner)),
        ExprKind::And(all) => format!("(and {})", list(all)),
        ExprKind::Or(all) => format!("(or {})", list(all)),
        ExprKind::Compare(op, a, b) => format!("({} {} {})", op.symbol(), show(a), show(b)),
        ExprKind::Neg(inner) => format!("(neg {})", show(inner)),
        ExprKind::Arith(op, a, b) => format!("({} {} {})", op.symbol(), show(a), show(b)),
        ExprKind::Select(a, b, c) => format!("(if {} {} {})", show(a), show(b), show(c)),
    }
}

#[test]
fn internal_ends_a_line_whatever_the_next_one_begins_with() {
    for next in ["-> c when d", "event e", "a: b -> c", "b & c -> d"] {
        let all = items(&format!("a -> b internal\n{next}"));
        assert_eq!(all.len(), 2, "{next}");
        let Some(Item::Transition(first)) = all.first() else { panic!("no transition: {all:?}") };
        assert!(first.is_internal, "{next}");
    }
}

#[test]
fn the_truck_is_read() {
    let parsed = parse(FileId(0), TRUCK);
    assert_eq!(parsed.diagnostics, []);
    assert_eq!(parsed.comments.len(), 5);
    let chart = &parsed.design.unwrap().charts[0];
    assert_eq!(chart.name.text, "truck");
    let count = |test: fn(&Item) -> bool| chart.items.iter().filter(|item| test(item)).count();
    assert_eq!(count(|item| matches!(item, Item::Setting(_))), 3);
    assert_eq!(count(|item| matches!(item, Item::Declaration(_))), 7);
    assert_eq!(count(|item| matches!(item, Item::Property(_))), 2);
    assert_eq!(count(|item| matches!(item, Item::Step(_))), 4);
    assert_eq!(count(|item| matches!(item, Item::Transition(_))), 4);
    let Item::Declaration(m) = &chart.items[3] else { panic!() };
    assert_eq!((m.name.text.as_str(), m.meta.label.as_str()), ("m", "loading request"));
}

#[test]
fn settings_of_all_kinds() {
    let items = items(
        "tick 1.5 ms conflict inner-first evolution stable limit 20\nschedule level fire one assign simultaneous actions iec final scan queue 4
        events exclusive\npriority 2\nevolution single\nevolution stable\nassign ordered\nfire all",
    );
    let kinds: Vec<SettingKind> = items
        .into_iter()
        .map(|item| match item {
            Item::Setting(setting) => setting.kind,
            other => panic!("{other:?}"),
        })
        .collect();
    use grafsynth_ir::net::{Policy, Schedule};
    assert_eq!(
        kinds,
        [
            SettingKind::Tick(1_500_000),
            SettingKind::Conflict(Policy::InnerFirst),
            SettingKind::EvolutionStable(Some(20)),
            SettingKind::Schedule(Schedule::Level),
            SettingKind::FireOne(true),
            SettingKind::AssignSimultaneous(true),
            SettingKind::ActionsIec,
            SettingKind::FinalScan,
            SettingKind::Queue(4),
            SettingKind::EventsExclusive,
            SettingKind::Priority(2),
            SettingKind::EvolutionSingle,
            SettingKind::EvolutionStable(None),
            SettingKind::AssignSimultaneous(false),
            SettingKind::FireOne(false),
        ]
    );
}

#[test]
fn declarations_of_all_kinds() {
    let items = items(
        "input m \"label\", b req \"R1\" req \"R2\"\ninput synchronous x, synchronous\ninput n: int -5..9 \"count\"
        output registered Q\nmealy output Z\noutput k: int 0..9 = 0, w: bool
        var v: int 0..9[4] = 0, f, g: bool[2] = [true, false]
        const N = 5, B = N > 3
        event E, F\ninternal event G\ntimer T while b or n > 3, U while m
        extern condition left(), right, level(): int 0..3\nextern action speed(int 0..9), go(v: int 0..9, on: bool), stop()",
    );
    let int = |lo, hi| Type::Int { lo, hi };
    let all: Vec<(String, DeclarationKind)> = items
        .into_iter()
        .map(|item| match item {
            Item::Declaration(declaration) => (declaration.name.text, declaration.kind),
            other => panic!("{other:?}"),
        })
        .collect();
    let of = |name: &str| &all.iter().find(|(other, _)| other == name).unwrap().1;
    assert_eq!(*of("m"), DeclarationKind::Input { ty: Type::Bool, synchronous: false });
    assert_eq!(*of("x"), DeclarationKind::Input { ty: Type::Bool, synchronous: true });
    assert_eq!(*of("synchronous"), DeclarationKind::Input { ty: Type::Bool, synchronous: true });
    assert_eq!(*of("n"), DeclarationKind::Input { ty: int(-5, 9), synchronous: false });
    assert!(matches!(
        of("Q"),
        DeclarationKind::Output { registered: true, mealy: false, init: None, .. }
    ));
    assert!(matches!(of("Z"), DeclarationKind::Output { registered: false, mealy: true, .. }));
    assert!(
        matches!(of("k"), DeclarationKind::Output { init: Some(_), ty, .. } if *ty == int(0, 9))
    );
    assert!(matches!(of("v"), DeclarationKind::Var { len: Some(4), init, .. } if init.len() == 1));
    assert!(
        matches!(of("f"), DeclarationKind::Var { len: None, init, ty: Type::Bool } if init.is_empty())
    );
    assert!(matches!(of("g"), DeclarationKind::Var { len: Some(2), init, .. } if init.len() == 2));
    assert!(matches!(of("B"), DeclarationKind::Const { value } if show(value) == "(> N 3)"));
    assert_eq!(*of("F"), DeclarationKind::Event { internal: false });
    assert_eq!(*of("G"), DeclarationKind::Event { internal: true });
    assert!(
        matches!(of("T"), DeclarationKind::Timer { condition } if show(condition) == "(or b (> n 3))")
    );
    assert_eq!(*of("right"), DeclarationKind::ExternCondition { ty: Type::Bool });
    assert_eq!(*of("level"), DeclarationKind::ExternCondition { ty: int(0, 3) });
    assert_eq!(
        *of("speed"),
        DeclarationKind::ExternAction { params: vec![(String::new(), int(0, 9))] }
    );
    assert_eq!(
        *of("go"),
        DeclarationKind::ExternAction {
            params: vec![("v".to_owned(), int(0, 9)), ("on".to_owned(), Type::Bool)]
        }
    );
}

#[test]
fn step_bodies_hold_every_form() {
    let step = step(
        "initial step p1 \"waiting\" req \"R12\" {
            R; Z if a and b
            L after 3 s
            L for 1.5 s if c; set R; reset R if a
            R pulse, R P, R P0, R P1
            R N; R S; R R; R D 3 s; R L 3 s; R SD 3 s; R DS 3 s if c; R SL 3 s
            speed(n + 1) if a; go()
            entry { n := n + 1; v[i] := 0 } exit { raise e; cancel x }
            on E, F when a { send e after 2 s as x; send e }
            when b { if a { n := 1 } else if b { n := 2 } else { call f(1, a); g(2) } }
            priority 3; budget 200
            task ramp cost 80 { call motor_ramp() }
            code c \"x = 1;\\n\"; force g { s3, m.s4 s5 }; force g init; force g {}; force g hold
        }",
    );
    assert_eq!(
        (step.role, step.meta.label.as_str(), step.meta.req.len()),
        (StepRole::Initial, "waiting", 1)
    );
    assert_eq!(step.body.len(), 32);
    let hows: Vec<(ActionHow, bool)> = step
        .body
        .iter()
        .filter_map(|item| match &item.kind {
            StepItemKind::Action { how, condition, .. } => Some((*how, condition.is_some())),
            _ => None,
        })
        .collect();
    let s = 1_000_000_000;
    use ActionHow::{After, Bare, For, Qualified};
    assert_eq!(
        hows,
        [
            (Bare, false),
            (Bare, true),
            (After(3 * s), false),
            (For(3 * s / 2), true),
            (Qualified(Qualifier::S, None), false),
            (Qualified(Qualifier::R, None), true),
            (Qualified(Qualifier::P, None), false),
            (Qualified(Qualifier::P, None), false),
            (Qualified(Qualifier::P0, None), false),
            (Qualified(Qualifier::P1, None), false),
            (Qualified(Qualifier::N, None), false),
            (Qualified(Qualifier::S, None), false),
            (Qualified(Qualifier::R, None), false),
            (Qualified(Qualifier::D, Some(3 * s)), false),
            (Qualified(Qualifier::L, Some(3 * s)), false),
            (Qualified(Qualifier::SD, Some(3 * s)), false),
            (Qualified(Qualifier::DS, Some(3 * s)), true),
            (Qualified(Qualifier::SL, Some(3 * s)), false),
            (Bare, true),
            (Bare, false),
        ]
    );
}

#[test]
fn transitions_with_all_clauses() {
    let t = transition(
        "t1: a & m1.s3 -> b & c on E, F when x after 3 s priority 2 restart deadline 1 us \"label\" req \"R\" do { n := 1; raise e }",
    );
    assert_eq!((t.sources.len(), t.targets.len(), t.events.len(), t.actions.len()), (2, 2, 2, 2));
    assert_eq!(
        (t.priority, t.restart, t.deadline_ns, t.after.map(|a| a.0)),
        (Some(2), true, Some(1_000), Some(Length::Ns(3_000_000_000)))
    );
    assert_eq!((t.meta.label.as_str(), t.meta.req.len()), ("label", 1));
    assert_eq!(t.sources[1].to_string(), "m1.s3");

    let source = transition("-> b when x");
    assert!(source.sources.is_empty() && source.targets.len() == 1 && source.name.is_none());
    let sink = transition("t: a -> sink");
    assert!(sink.targets.is_empty() && sink.guard.is_none());
    assert!(transition("a -> sink when x").targets.is_empty());
    // If a step is named `sink`, the word refers to that step. In backquotes, `sink` is always a name.
    assert_eq!(transition("step sink\na -> sink").targets.len(), 1);
    assert_eq!(transition("a -> `sink`").targets.len(), 1);
    assert_eq!(findings("a -> when x"), [("G0121".to_owned(), "->".to_owned())]);
    // A line break ends the targets. A keyword of a clause is a name if it can be nothing else.
    let both =
        items("conflict inner-first\na ->\nwhen -> after & do\non: x -> y\nstep: entry -> macro");
    assert_eq!(both.len(), 5);
    // Clauses may continue on the next line, but a priority there belongs to the chart.
    let both = items("a -> b\n  when x\n  do { n := 1 }\npriority 3");
    assert!(
        matches!((&both[0], &both[1], both.len()), (Item::Transition(t), Item::Setting(_), 2) if t.guard.is_some())
    );
}

#[test]
fn macros_places_boards_properties() {
    let all = items(
        "macro fill \"fills\" { entry step e \n step x { R } exit step s \n e -> x when a \n x -> s macro inner { entry exit step es } }
        macro step m1 = fill priority 2 \"first\"\ninitial macro step m2 = fill
        place p2, p3, m1.x on chip\nplace n on cpu
        device gal22v10 { clock 1  m 2, R 23\n n[0] 3 m1.q 4 }\ndevice gal16v8
        assume never (a and b)\nassert safe: always R \"label\" req \"R1\"",
    );
    assert_eq!(all.len(), 9);
    assert!(matches!(&all[0], Item::Macro(m) if m.items.len() == 6));
    assert!(
        matches!(&all[1], Item::MacroStep(m) if m.priority == Some(2) && m.role == StepRole::Plain && m.body.text == "fill")
    );
    assert!(matches!(&all[2], Item::MacroStep(m) if m.role == StepRole::Initial));
    assert!(
        matches!(&all[5], Item::Board(b) if b.pins.len() == 5 && b.pins[3].0.text == "n[0]" && b.pins[4].0.text == "m1.q")
    );
    assert!(
        matches!(&all[8], Item::Property(p) if !p.is_never && !p.is_assumption && p.name.is_some() && p.meta.req.len() == 1)
    );
}

#[test]
fn words_and_precedence() {
    assert_eq!(guard("a or b and not c"), "(or a (and b (not c)))");
    assert_eq!(guard("a and b and c or a"), "(or (and a b c) a)");
    assert_eq!(guard("(a and b) and c"), "(and (and a b) c)");
    assert_eq!(guard("not n = 3 and a"), "(and (not (= n 3)) a)");
    assert_eq!(guard("n + 1 * k mod 2 - 3 <= k"), "(<= (- (+ n (mod (* 1 k) 2)) 3) k)");
    assert_eq!(
        guard("n == 1 or n != 2 or n <> 3 or n ≥ 4"),
        "(or (= n 1) (<> n 2) (<> n 3) (>= n 4))"
    );
    assert_eq!(guard("-n < -5 and n > -(5)"), "(and (< (neg n) -5) (> n (neg 5)))");
    assert_eq!(guard("if a then n > 1 else b or c"), "(if a (> n 1) (or b c))");
    assert_eq!(guard("v[n + 1] = v[0]"), "(= v[(+ n 1)] v[0])");
    assert_eq!(
        guard("s.active and s.t >= 3 s and m.s.t < 10 ms"),
        "(and s.active (>= s.t 3000000000ns) (< m.s.t 10000000ns))"
    );
    assert_eq!(
        guard("f() and rise(a) or fall(b and c) and otherwise"),
        "(or (and f (rise a)) (and (fall (and b c)) otherwise))"
    );
    assert_eq!(guard("n > 0x10 or n > 0b11 or n > 1_000"), "(or (> n 16) (> n 3) (> n 1000))");
    assert_eq!(guard("n > -9223372036854775808"), "(> n -9223372036854775808)");
    assert_eq!(guard("rise and fall and `and`"), "(and rise fall and)");
}

#[test]
fn signs_of_grafcet_are_read() {
    assert_eq!(guard("a·/b + c"), "(or (and a (not b)) c)");
    assert_eq!(guard("a * b * c + /a*b"), "(or (and a b c) (and (not a) b))");
    assert_eq!(guard("↑a + ↓(b*c)"), "(or (rise a) (fall (and b c)))");
    assert_eq!(guard("¬a ∧ b ∨ c"), "(or (and (not a) b) c)");
    assert_eq!(guard("a*b or c"), "(or (and a b) c)");
    assert_eq!(guard("a + b or c"), "(or a b c)");
    assert_eq!(guard("a * (n > 3)"), "(and a (> n 3))");
    // A number in the chain makes it arithmetic.
    assert_eq!(guard("n + k > 3"), "(> (+ n k) 3)");
    assert_eq!(guard("s.t * 2 > 3"), "(> (* s.t 2) 3)");
    assert_eq!(guard("v[0] + v[1] = n * k"), "(= (+ v[0] v[1]) (* n k))");
    assert_eq!(
        guard("3s/a/2 s + 10 ms/(a*b)"),
        "(or (delay 3000000000 a 2000000000) (delay 10000000 (and a b) 0))"
    );
    let t = transition("input `c d`\nx -> y when a + b * `c d`");
    assert_eq!(show(&t.guard.unwrap()), "(or a (and b c d))");
}

#[test]
fn what_reads_in_two_ways_is_refused() {
    for text in
        ["not a * b", "not a + b", "a and b + c", "a + b = c", "a = b * c", "n < 1 < 2", "a / b"]
    {
        let found = only_codes(&format!("input a, b, c, n: int 0..9\nx -> y when {text}"));
        assert_eq!(found, ["G0115"], "{text}");
    }
    for text in [
        "not (a * b)",
        "(not a) * b",
        "/a * b",
        "a and (b + c)",
        "(a + b) = c",
        "a and b * c",
        "n / 2 > 1",
    ] {
        let found = only_codes(&format!("input a, b, c, n: int 0..9\nx -> y when {text}"));
        assert_eq!(found, [""; 0], "{text}");
    }
}

#[test]
fn names_may_be_odd() {
    let all = items(
        "input X, int, reg, é, on, step, rise, `and`, `1`, `a b`, set\nstep int { X }\nstep `x.y` { `set` }\nint -> `x.y` when on and rise",
    );
    assert_eq!(all.len(), 14);
    assert!(matches!(&all[7], Item::Declaration(d) if d.name.text == "and"));
    assert!(matches!(&all[12], Item::Step(s) if s.name.text == "x.y" && s.body.len() == 1));
}

#[test]
fn every_error_is_reported_at_once() {
    let text = "chart c {
    tick 10 sec
    conflict priority-ages
    input n: int, k: int 9..0, l: int 0..99999999999
    stpe p1
    step p2 { R Q; R pulze; n := 1 }
    t1: p1 -> p2 when
    t2: p2 -> p1 wen m
    t3: p2 -> p1 when m when k after 3
    enclosing run { step x }
    t4: p2 p1
    p1 -> p2 when (a or b
    step and
    t5: p1 -> p2 do { n = 1; foo bar } restart
    assert sometimes a
}";
    let found = codes_of(text);
    let expected = [
        ("G0106", "10"),
        ("G0104", "priority-ages"),
        ("G0114", "int"),
        ("G0104", "stpe"),
        ("G0101", "Q"),
        ("G0104", "pulze"),
        ("G0113", "n"),
        ("G0117", ""),
        ("G0104", "wen"),
        ("G0112", "when k"),
        ("G0106", "3"),
        ("G0104", "enclosing"),
        ("G0101", "p1"),
        ("G0101", ""),
        ("G0101", "and"),
        ("G0101", "="),
        ("G0104", "foo"),
        ("G0101", "sometimes"),
    ];
    let found: Vec<(&str, &str)> =
        found.iter().map(|(code, at)| (code.as_str(), at.as_str())).collect();
    assert_eq!(found, expected);
    let parsed = parse(FileId(0), text);
    assert!(parsed.design.is_some());
}

#[test]
fn unclosed_blocks_are_one_error_each() {
    assert_eq!(
        codes_of("chart c {\n step a { R\n step b { Z }\n a -> b\n}"),
        [("G0111".to_owned(), "{".to_owned())]
    );
    assert_eq!(
        codes_of("chart c {\n step a { entry { if x { n := 1"),
        [("G0111".to_owned(), "{".to_owned())]
    );
    assert_eq!(codes_of("chart c {\n a -> b } }")[0].0, "G0111");
    assert_eq!(codes_of("")[0].0, "G0116");
    assert_eq!(codes_of("step a")[0].0, "G0116");
    assert_eq!(codes_of("edition 2 chart c {}")[0].0, "G0118");
    assert!(codes_of("edition 1\nchart c { }\nchart d { }").is_empty());
}

#[test]
fn limits_hold() {
    // 100 000 opening brackets of each kind cause an error, but no stack overflow and no flood of messages.
    for open in ["(", "not ", "/", "-", "↑", "a[", "if a then ", "rise("] {
        let text = format!("chart c {{ x -> y when {}\n a -> b }}", open.repeat(100_000));
        let found = codes_of(&text);
        assert!(!found.is_empty() && found.len() < 4, "{open}: {found:?}");
    }
    for open in [
        "{",
        "if a {",
        "macro m {",
        "state s {",
        "enclosing step s {",
        "step s {",
        "entry {",
        "chart c {",
        "[",
    ] {
        let found = codes_of(&format!("chart c {{ step s {{ entry {{ {}", open.repeat(100_000)));
        assert!(!found.is_empty() && found.len() <= 101, "{open}: {found:?}");
        let found = codes_of(&format!("chart c {{ {}", open.repeat(100_000)));
        assert!(!found.is_empty() && found.len() <= 101, "{open}: {found:?}");
    }
    let chain = |sign: &str, n: usize| {
        format!(
            "chart c {{ input a, n: int 0..9\nx -> y when n{sign} = 1 }}",
            sign = sign.repeat(n)
        )
    };
    assert_eq!(codes_of(&chain(" + n", 254)).len(), 0);
    assert_eq!(codes_of(&chain(" + n", 300))[0].0, "G0107");
    let flat = |sign: &str, n: usize| {
        format!("chart c {{ input a\nx -> y when a{sign} }}", sign = sign.repeat(n))
    };
    for sign in [" + a", " and a", "·a", " or a"] {
        assert_eq!(codes_of(&flat(sign, 100_000)).len(), 0, "{sign}");
    }
    assert_eq!(
        codes_of(&format!("chart c {{ x -> y when {}a{} }}", "(".repeat(250), ")".repeat(250)))
            .len(),
        0
    );
    let limits = Limits { source: 10, ..Limits::default() };
    assert_eq!(parse_within(FileId(0), "chart c { }", &limits).diagnostics[0].code.id, "G0108");
    let many = parse(FileId(0), &"? ".repeat(150)).diagnostics;
    assert_eq!((many.len(), many[100].code.id), (101, "G0109"));
    assert!(many[100].message.starts_with("50 more"));
}

#[test]
fn strings() {
    let step = step("step s \"a\\\"b\\n\\\\\" { code c \"\"\"\nif (x) {\n  y();\n}\"\"\" }");
    assert_eq!(step.meta.label, "a\"b\n\\");
    assert!(matches!(&step.body[0].kind, StepItemKind::Code(v) if v.text == "if (x) {\n  y();\n}"));
    assert_eq!(only_codes("step s \"a\\q\""), ["G0119"]);
    assert_eq!(only_codes("step s \"a\nstep t"), ["G0103"]);
    assert_eq!(only_codes("step `s\nstep t"), ["G0103"]);
}

#[test]
fn statements_in_lists() {
    let t = transition("a -> b do { x := 1\n y[2] := x + 1; if a { x := 2 } y := 3; m.v := 4 }");
    assert_eq!(t.actions.len(), 5);
    assert!(
        matches!(&t.actions[4].kind, StmtKind::Assign { target, .. } if target.to_string() == "m.v")
    );
    assert!(
        matches!(&t.actions[1].kind, StmtKind::Assign { value, .. } if matches!(value.kind, ExprKind::Arith(ArithOp::Add, ..)))
    );
    assert_eq!(only_codes("a -> b do { x := 1 y := 2 }"), ["G0101"]);
}

#[test]
fn a_large_source_with_an_error_gives_findings_and_no_tree() {
    let text = format!("chart c {{\n{}\n oops ! }}", "st1 -> st2 when i3 and i4\n".repeat(50_000));
    let parsed = parse(FileId(0), &text);
    assert!(parsed.design.is_none() && !parsed.diagnostics.is_empty());
}
