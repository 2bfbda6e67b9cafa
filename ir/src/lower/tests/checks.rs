//! Tests of errors: all errors are reported at once, in the user's words, with help.

use super::build::*;
use crate::chart::*;
use crate::expr::Type;
use crate::lower::lower;
use crate::net::{Policy, Qualifier};

/// The findings for a transition with this condition, in a chart with a few declarations.
fn about(condition: Expr) -> Vec<String> {
    findings(vec![
        vec![single()],
        inputs("motor"),
        vec![
            output("R"),
            event("E"),
            var("n", int(0, 9)),
            declare("v", DeclarationKind::Var { ty: int(0, 9), len: Some(4), init: vec![] }),
            declare("go", DeclarationKind::ExternAction { params: vec![] }),
            initial("p1", vec![action("R"), action("go")]),
            go(
                "p1 -> p1",
                and(vec![
                    v("motor"),
                    v("E"),
                    ge("n", "1"),
                    e(crate::expr::ExprKind::Compare(
                        crate::expr::CompareOp::Ge,
                        Box::new(element("v", v("0"))),
                        Box::new(v("1")),
                    )),
                ]),
            ),
            go("p1 -> p1", condition),
        ],
    ])
}

#[test]
fn every_unknown_name_is_told_with_a_near_one() {
    let condition = and(vec![v("moter"), not(v("nothing_like_it")), v("p1.activ")]);
    let (_, found) = lower(&design(vec![chart(
        "c",
        vec![inputs("motor"), vec![initial("p1", vec![]), go("p1 -> p2", condition)]],
    )]));
    assert_eq!(
        told(&found),
        [
            "G0201 unknown name `p2`",
            "G0201 unknown name `moter`",
            "G0201 unknown name `nothing_like_it`",
            "G0203 `p1` is a step and has no part named `activ`"
        ]
    );
    let near = found.iter().find(|one| one.message.ends_with("`moter`")).unwrap();
    assert_eq!(near.help.as_deref(), Some("did you mean `motor`?"));
    assert_eq!(near.fix.as_ref().unwrap().replacement, "motor");
}

#[test]
fn wrong_kinds_are_named() {
    assert_eq!(about(v("p1")), ["G0203 step `p1` cannot be used as a value"]);
    assert_eq!(about(v("go")), ["G0203 `go` is an extern action, not a value"]);
    assert_eq!(about(v("c")), ["G0203 `c` is a chart, not a value"]);
    assert_eq!(about(v("R")), ["G0217 `R` is a continuous output and cannot be read"]);
    assert_eq!(about(v("p1.t")), ["G0212 the time `p1.t` can only be compared with a constant"]);
    assert_eq!(about(v("3s")), ["G0212 3 s must be compared with the time of a step or timer"]);
    assert_eq!(about(ge("p1.t", "n")), ["G0209 expected a constant, but `n` is a variable"]);
    assert_eq!(about(v("n")), ["G0208 expected a Boolean, found a number (0..9)"]);
    assert_eq!(about(ge("v", "1")), ["G0236 an array is read without an index"]);
    assert_eq!(about(element("n", v("0"))).len(), 1);
    assert_eq!(about(rise(rise(v("motor")))), ["G0213 an edge is not allowed in an edge"]);
    assert_eq!(about(rise(v("E"))), ["G0213 the event `E` is not allowed in an edge"]);
    assert_eq!(about(v("c.p1.active")), Vec::<String>::new());
}

#[test]
fn a_transition_needs_steps_at_its_ends() {
    let found = findings(vec![
        inputs("m"),
        vec![initial("p", vec![]), go("m -> p", v("m")), go("p -> p & p", v("m"))],
    ]);
    assert_eq!(found, ["G0203 `m` is an input, not a step", "G0235 step `p` is listed twice"]);
}

#[test]
fn names_are_declared_once() {
    let (_, found) =
        lower(&design(vec![chart("c", vec![inputs("p"), vec![initial("p", vec![])]])]));
    assert_eq!(told(&found), ["G0202 `p` is declared twice"]);
    assert_eq!(found[0].labels.len(), 2, "both places");
}

#[test]
fn an_output_has_one_kind() {
    let both = vec![action("R"), item(StepItemKind::Exit(vec![assign("R", v("true"))]))];
    assert_eq!(
        findings(vec![vec![output("R"), output("U"), initial("p", both)]]),
        [
            "G0215 output `R` is driven while a step is active and assigned in lists",
            "G0216 nothing drives output `U`"
        ]
    );
    let mealy = vec![single(), output_of("R", Type::Bool, true)];
    let set = act("R", ActionHow::Qualified(Qualifier::S, None), None);
    assert_eq!(
        findings(vec![mealy, vec![initial("p", vec![set])]]),
        ["G0215 the mealy output `R` cannot have memory"]
    );
    assert_eq!(
        findings(vec![vec![output_of("N", int(0, 3), false), initial("p", vec![action("N")])]]),
        ["G0208 output `N` is a number (0..3) but is used as a Boolean"]
    );
}

#[test]
fn mealy_needs_single() {
    let mealy = output_of("R", Type::Bool, true);
    assert_eq!(
        findings(vec![vec![
            setting(crate::chart::SettingKind::EvolutionStable(None)),
            mealy,
            initial("p", vec![action("R")])
        ]]),
        ["G0207 the mealy output `R` needs `evolution single`"]
    );
}

#[test]
fn pulses_stand_in_receptivities_and_lists_only() {
    let rising = act("R", ActionHow::Bare, Some(rise(v("m"))));
    let event_here = act("R", ActionHow::Bare, Some(v("E")));
    let items = vec![
        event("E"),
        output("R"),
        initial("p", vec![rising, event_here]),
        go("p -> p", and(vec![v("m"), v("E")])),
    ];
    assert_eq!(
        findings(vec![vec![single()], inputs("m"), items]),
        [
            "G0213 an edge is not allowed in the condition of an output",
            "G0213 the event `E` is not allowed in the condition of an output"
        ]
    );
    let misplaced = item(StepItemKind::Entry(vec![stmt(StmtKind::If {
        condition: v("otherwise"),
        then: vec![],
        otherwise: vec![],
    })]));
    assert_eq!(
        findings(vec![vec![initial("p", vec![misplaced]), go("-> p", v("otherwise"))]]),
        [
            "G0214 `otherwise` is not allowed in a list",
            "G0214 `otherwise` is not allowed on a source transition"
        ]
    );
}

#[test]
fn durations_fit_and_are_rounded_aloud() {
    assert_eq!(
        about(ge("p1.t", "25ms")),
        [
            "G0210 25 ms is rounded up to 30 ms",
            "G0256 `p1` stays active when `p1_p1` fires: its time continues",
            "G0256 `p1` stays active when `p1_p1_2` fires: its time continues",
        ]
    );
    assert_eq!(
        about(ge("p1.t", "99999999s")),
        ["G0211 99999999 s is 9999999900 ticks of 10 ms, but a timer counts at most 2147483646"]
    );
    let source =
        Transition { after: Some((Length::Ns(20_000_000), span())), ..arrow("-> p", None) };
    assert_eq!(
        findings(vec![vec![initial("p", vec![]), Item::Transition(source)]]),
        ["G0220 `after` is not allowed on a source transition"]
    );
}

#[test]
fn a_controlled_action_stores_with_one_duration() {
    let timed = |how| act("R", how, None);
    let body = vec![
        timed(ActionHow::Qualified(Qualifier::SD, Some(20_000_000))),
        timed(ActionHow::Qualified(Qualifier::DS, Some(30_000_000))),
        timed(ActionHow::Qualified(Qualifier::SL, None)),
        timed(ActionHow::Qualified(Qualifier::S, Some(1))),
    ];
    assert_eq!(
        findings(vec![vec![output("R"), initial("p", body)]]),
        [
            "G0218 the stored qualifiers of action `R` have two durations, 20 ms and 30 ms",
            "G0218 qualifier SL needs a duration",
            "G0218 qualifier S takes no duration"
        ]
    );
}

#[test]
fn assignments_and_calls_fit_their_targets() {
    let speed = declare(
        "speed",
        DeclarationKind::ExternAction { params: vec![(String::new(), int(0, 9))] },
    );
    let call = |arguments| stmt(StmtKind::Call { function: name("speed"), arguments });
    let list = vec![
        assign("n", v("10")),
        assign("n", v("true")),
        assign("b", v("3")),
        assign("m", v("true")),
        assign("E", v("true")),
        assign("w", v("1")),
        stmt(StmtKind::Assign { target: path("w"), index: Some(v("4")), value: v("1") }),
        call(vec![]),
        call(vec![v("10")]),
        stmt(StmtKind::Raise(name("m"))),
        stmt(StmtKind::Send { event: name("E"), after: None, slot: None }),
    ];
    let found = findings(vec![
        inputs("m"),
        vec![
            event("E"),
            var("n", int(0, 9)),
            var("b", Type::Bool),
            declare(
                "w",
                DeclarationKind::Var { ty: int(0, 9), len: Some(4), init: vec![v("1"), v("2")] },
            ),
            speed,
            initial("p", vec![item(StepItemKind::Entry(list))]),
        ],
    ]);
    assert_eq!(
        found,
        [
            "G0226 `w` has 4 elements but 2 initial values",
            "G0223 `n` always becomes 9: the value is 10, but the range is 0..9",
            "G0208 expected a number, found a Boolean",
            "G0208 expected a Boolean, found the number 3",
            "G0203 cannot assign to `m`: it is an input",
            "G0203 cannot assign to `E`: it is an event",
            "G0236 an array is read without an index",
            "G0236 the index is 4, but the array has elements 0..3",
            "G0219 `speed` takes 1 argument, found no arguments",
            "G0223 argument 1 of `speed` always becomes 9: the value is 10, but the range is 0..9",
            "G0203 `m` is an input, not an event",
            "G0222 `send` is allowed only in a statechart"
        ]
    );
}

#[test]
fn tasks_fit_their_budget() {
    let task = |text: &str, cost, body| {
        item(StepItemKind::Task { name: name(text), cost: Some(cost), body })
    };
    let body = vec![
        item(StepItemKind::Budget(100)),
        task("small", 80, vec![]),
        task("large", 120, vec![stmt(StmtKind::Raise(name("E")))]),
    ];
    assert_eq!(
        findings(vec![vec![event("E"), initial("p", body)]]),
        [
            "G0225 a task can only contain assignments and calls",
            "G0224 task `large` costs 120, but its step `p` has a budget of 100"
        ]
    );
}

#[test]
fn macros_have_an_entry_and_an_exit() {
    let found = findings(vec![vec![
        macro_of(
            "m",
            vec![
                step_of("e", StepRole::MacroEntry, vec![]),
                step_of("f", StepRole::MacroEntry, vec![]),
            ],
        ),
        initial("p", vec![]),
        macro_step("m1", "m"),
        macro_step("m2", "p"),
        go("p -> m1", v("true")),
        go("m2 -> p", v("true")),
    ]]);
    assert_eq!(
        found,
        [
            "G0205 macro `m` has more than one entry step",
            "G0205 macro `m` has no exit step",
            "G0203 `p` is a step, not a macro"
        ]
    );
}

#[test]
fn signals_of_the_environment_belong_to_the_chart() {
    let body = vec![
        vec![step_of("e", StepRole::MacroEntryExit, vec![])],
        inputs("i"),
        vec![var("n", int(5, 1)), setting(SettingKind::FinalScan)],
    ];
    let found = findings(vec![vec![
        macro_of("m", body.into_iter().flatten().collect()),
        initial("p", vec![]),
        macro_step("m1", "m"),
        go("p -> m1", v("true")),
        go("m1 -> p", v("true")),
    ]]);
    assert_eq!(
        found,
        [
            "G0237 an input belongs to the chart, not to a body in it",
            "G0238 the range 5..1 of `n` is empty",
            "G0237 this setting belongs to the chart, not to a body in it"
        ]
    );
}

#[test]
fn lints_see_what_is_probably_not_meant() {
    let priority = |number, arrow_text: &str, guard| {
        Item::Transition(Transition { priority: number, ..arrow(arrow_text, guard) })
    };
    let found = findings(vec![
        vec![single(), conflict(Policy::Priority)],
        inputs("a unused"),
        vec![
            var("n", int(0, 9)),
            initial("p", vec![]),
            step("q", vec![]),
            step("lost", vec![]),
            step("lost2", vec![]),
            priority(Some(1), "p -> q", None),
            priority(None, "p -> q", Some(v("a"))),
            go("q -> p", v("a")),
            go("q -> p", v("a")),
            go("q -> q", ge("n", "0")),
            go("q -> q", ge("n", "10")),
            go("q -> q", and(vec![v("a"), not(v("a"))])),
            go("lost -> lost2", v("a")),
            go("lost2 -> lost2", v("a")),
        ],
    ]);
    assert_eq!(
        found,
        [
            "G0240 input `unused` is never used",
            "G0241 transition `q_p_2` is the same as `q_p`",
            "G0242 step `lost` can never be active: no transition leads to it",
            "G0242 step `lost2` can never be active: the steps before it are never active",
            "G0244 the condition of `q_q` is always true",
            "G0244 the condition of `q_q_2` is never true, so this transition never fires",
            "G0244 the condition of `q_q_3` is never true, so this transition never fires",
            "G0245 transition `p_q_2` is never taken: `p_q` always fires first",
            "G0245 transition `q_q_2` is never taken: `q_q` always fires first",
            "G0245 transition `q_q_3` is never taken: `q_q` always fires first"
        ]
    );
}

#[test]
fn priorities_that_nothing_asks_for_are_told() {
    let with_priority =
        Item::Transition(Transition { priority: Some(1), ..arrow("p -> p", Some(v("a"))) });
    let found = findings(vec![
        inputs("a"),
        vec![single(), initial("p", vec![item(StepItemKind::Priority(2))]), with_priority],
    ]);
    assert_eq!(
        found,
        [
            "G0231 the priority of transition `p_p` has no effect under `conflict all`",
            "G0231 the priority of step `p` has no effect under `conflict all`"
        ]
    );
}

#[test]
fn boards_and_places_name_what_is_there() {
    let board = Item::Board(Board {
        device: name("gal22v10"),
        pins: vec![
            (name("clock"), 1),
            (name("m"), 2),
            (name("R"), 2),
            (name("Q"), 3),
            (name("m"), 4),
            (name("gnd"), 5),
            (name("gnd"), 6),
        ],
        span: span(),
    });
    let place =
        Item::Place(Place { items: vec![path("p"), path("zz")], part: name("chip"), span: span() });
    let found = findings(vec![
        vec![single()],
        inputs("m"),
        vec![output("R"), initial("p", vec![action("R")]), go("p -> p", v("m")), board, place],
    ]);
    assert_eq!(
        found,
        [
            "G0228 pin 2 is assigned to both `m` and `R`",
            "G0201 unknown name `Q`",
            "G0228 `m` has two pins",
            "G0201 unknown name `zz`"
        ]
    );
}

#[test]
fn a_chart_begins_somewhere() {
    assert_eq!(
        findings(vec![inputs("a"), vec![step("p", vec![]), go("p -> p", v("a"))]]),
        ["G0230 chart `c` has no initial step, so it never does anything"]
    );
}

#[test]
fn assumptions_are_about_inputs() {
    let assumption =
        Property { is_assumption: true, ..assert_never(and(vec![v("m"), v("p.active")])) };
    let found = findings(vec![
        vec![single()],
        inputs("m"),
        vec![initial("p", vec![]), go("p -> p", v("m")), Item::Property(assumption)],
    ]);
    assert_eq!(found, ["G0227 an assumption can only read inputs"]);
}
