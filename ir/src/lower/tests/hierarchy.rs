//! Tests of enclosing steps, forcing, and statecharts.

use super::build::*;
use crate::chart::*;
use crate::lower::lower;
use crate::net::{Enter, ForcingOrder, Net, Policy, StepKind, TransitionKind};
use itertools::Itertools as _;

fn state_of(text: &str, role: StepRole, is_parallel: bool, items: Vec<Item>) -> State {
    let step = Step { name: name(text), role, meta: meta(), ..Step::default() };
    State { step, is_parallel, items, ..State::default() }
}
fn state(text: &str, items: Vec<Item>) -> Item {
    Item::State(state_of(text, StepRole::Plain, false, items))
}
fn on(text: &str, event: &str) -> Item {
    Item::Transition(Transition { events: vec![name(event)], ..arrow(text, None) })
}

/// The entries of a list, by local names.
fn enters(net: &Net, list: &[Enter]) -> String {
    let last = |text: &str| text.rsplit('.').next().unwrap_or(text).to_owned();
    let one = |enter: &Enter| match *enter {
        Enter::Step(step) => last(&net.steps[step].name.text),
        Enter::InitialContent(step) => format!("do {}", last(&net.steps[step].name.text)),
        Enter::History(history) => last(&net.histories[history].name.text),
    };
    list.iter().map(one).join(" ")
}
fn clears(net: &Net, index: usize) -> String {
    let steps = &net.transitions.values().nth(index).unwrap().clears;
    let last = |text: &str| text.rsplit('.').next().unwrap_or(text).to_owned();
    steps.iter().map(|step| last(&net.steps[*step].name.text)).join(" ")
}
fn entered_by(net: &Net, index: usize) -> String {
    enters(net, &net.transitions.values().nth(index).unwrap().enters)
}

/// Two states with children; one of them is parallel.
fn player() -> Vec<Vec<Item>> {
    let mut playing = state_of(
        "playing",
        StepRole::Plain,
        false,
        vec![
            Item::State(state_of("slow", StepRole::Plain, false, vec![])),
            state("fast", vec![]),
            on("slow -> fast", "E"),
        ],
    );
    playing.histories.push(History {
        name: name("H"),
        default: vec![path("fast")],
        meta: meta(),
        ..History::default()
    });
    playing.initial = Some((vec![path("slow")], vec![assign("n", v("1"))]));
    let both = state_of(
        "both",
        StepRole::Plain,
        true,
        vec![
            state("left", vec![state("a", vec![]), state("b", vec![]), on("a -> b", "E")]),
            state("right", vec![state("c", vec![]), state("d", vec![]), on("c -> d", "E")]),
        ],
    );
    vec![
        vec![conflict(Policy::InnerFirst), event("E"), event("F"), var("n", int(0, 3))],
        vec![
            step("off", vec![]),
            Item::State(playing),
            Item::State(both),
            on("off -> playing", "E"),
            on("playing -> both.right.d", "F"),
            on("both -> playing.H", "F"),
            on("both -> both", "E"),
            on("off -> both.left.b & both.right.d", "F"),
            on("off ->", "F"),
        ],
    ]
}

#[test]
fn transitions_of_statecharts_leave_their_domain_and_complete_their_targets() {
    let net = clean(player());
    let kinds: Vec<StepKind> = net.steps.values().map(|step| step.kind).collect();
    use StepKind::{Composite as C, Leaf as L, Parallel as P};
    assert_eq!(kinds, [L, C, L, L, P, C, L, L, C, L, L]);
    assert_eq!(enters(&net, &net.parts.values().next().unwrap().initial), "off");
    assert_eq!((clears(&net, 0).as_str(), entered_by(&net, 0).as_str()), ("slow fast", "fast"));
    assert_eq!(entered_by(&net, 3), "playing do playing slow");
    assert_eq!(entered_by(&net, 4), "both left a right d");
    assert_eq!(clears(&net, 4), "off playing slow fast both left a b right c d");
    assert_eq!(entered_by(&net, 5), "playing H");
    assert_eq!(entered_by(&net, 6), "both left a right c");
    assert_eq!(entered_by(&net, 7), "both left b right d");
    let last = net.transitions.values().last().unwrap();
    assert_eq!((last.kind, last.clears.len()), (TransitionKind::Reaction, 0));
    let history = net.histories.values().next().unwrap();
    assert_eq!(enters(&net, &history.default), "fast");
    assert_eq!(
        history.cases.iter().map(|case| enters(&net, &case.enters)).collect::<Vec<_>>(),
        ["slow", "fast"]
    );
}

#[test]
fn states_with_history_in_a_grafcet_are_errors_only() {
    let mut items = player();
    // The chart has no statechart policy, for example because the line that sets it is damaged.
    items[0].remove(0);
    let (net, found) = lower(&design(vec![chart("c", items)]));
    assert!(net.is_none());
    assert!(found.iter().any(|one| one.is_error() && one.message.contains("state")), "{found:#?}");
}

#[test]
fn an_internal_transition_does_not_leave_its_source() {
    let internal = |text: &str| {
        Item::Transition(Transition {
            is_internal: true,
            events: vec![name("E")],
            ..arrow(text, None)
        })
    };
    let mut items = player();
    items[1].extend([
        internal("playing -> playing.fast"),
        internal("playing -> playing.H"),
        // These behave like external transitions: the first target is not inside the source, and the second source
        // is parallel.
        internal("playing -> playing"),
        internal("both -> both.left.b"),
        internal("off ->"),
    ]);
    let net = clean(items);
    let first = net.transitions.len() - 5;
    let seen: Vec<(String, String)> =
        (first..first + 5).map(|index| (clears(&net, index), entered_by(&net, index))).collect();
    let all = "off playing slow fast both left a b right c d";
    assert_eq!(seen[0], ("slow fast".into(), "fast".into()));
    assert_eq!(seen[1], ("slow fast".into(), "H".into()));
    assert_eq!(seen[2], (all.into(), "playing do playing slow".into()));
    assert_eq!(seen[3], (all.into(), "both left b right c".into()));
    assert_eq!(seen[4], (String::new(), String::new()));
}

#[test]
fn a_reaction_can_be_written_beside_its_step() {
    let inside = |text: &str| {
        Item::Transition(Transition { is_internal: true, ..arrow(text, Some(v("m"))) })
    };
    let chart = |extra: Vec<Item>| {
        vec![
            vec![single()],
            inputs("m"),
            vec![
                initial("p", vec![]),
                step("q", vec![]),
                go("p -> q", v("m")),
                go("q -> p", v("m")),
            ],
            extra,
        ]
    };
    let net = clean(chart(vec![inside("p ->")]));
    let last = net.transitions.values().last().unwrap();
    assert_eq!(last.kind, TransitionKind::Reaction);
    assert!(last.clears.is_empty() && last.enters.is_empty() && last.requires.len() == 1);
    assert_eq!(
        findings(chart(vec![inside("p -> q"), inside("p & q ->")])),
        [
            "G0222 an internal transition is allowed only in a statechart",
            "G0222 a reaction belongs to exactly one step"
        ]
    );
}

#[test]
fn names_in_states_are_those_of_the_chart() {
    let drawn = |extra: Vec<Item>| {
        let mut items = player();
        items[1].extend(extra);
        items
    };
    // Names alone, and qualified by any enclosing state.
    let net = clean(drawn(vec![
        on("off -> d & b", "E"),
        on("right.c -> both.left.a", "E"),
        on("slow -> H", "E"),
    ]));
    let names: Vec<&str> = net.steps.values().map(|step| step.name.text.as_str()).collect();
    assert_eq!(
        names,
        ["off", "playing", "slow", "fast", "both", "left", "a", "b", "right", "c", "d"]
    );
    assert_eq!(
        findings(drawn(vec![state("more", vec![step("a", vec![]), var("n", int(0, 3))])])),
        ["G0202 `a` is declared twice", "G0202 `n` is declared twice"]
    );
    // Histories are not part of a trace, so two states may have histories of the same name.
    let history = |owner: &str| {
        let mut made =
            state_of(owner, StepRole::Plain, false, vec![step(&format!("{owner}1"), vec![])]);
        made.histories.push(History { name: name("H"), meta: meta(), ..History::default() });
        Item::State(made)
    };
    let two = |target: &str| {
        drawn(vec![history("x"), history("y"), on(&format!("off -> {target}"), "E")])
    };
    let net = lower(&design(vec![chart("c", two("y.H"))])).0.unwrap();
    let names: Vec<&str> = net.histories.values().map(|one| one.name.text.as_str()).collect();
    assert_eq!(names, ["playing.H", "x.H", "y.H"]);
    assert!(findings(two("H")).contains(&"G0201 unknown name `H`".to_owned()));
}

#[test]
fn deep_histories_record_atomic_states() {
    let mut items = player();
    let Item::State(both) = &mut items[1][2] else { panic!() };
    both.histories.push(History {
        name: name("D"),
        is_deep: true,
        meta: meta(),
        ..History::default()
    });
    items[1].push(on("off -> both.D", "E"));
    let net = clean(items);
    let deep = net.histories.values().nth(1).unwrap();
    let cases: Vec<String> = deep.cases.iter().map(|case| enters(&net, &case.enters)).collect();
    assert_eq!(cases, ["left a", "left b", "right c", "right d"]);
    assert_eq!(enters(&net, &deep.default), "left a right c");
}

#[test]
fn the_completion_of_a_state_is_an_event_and_needs_a_queue() {
    let ends = |queue: Option<u32>| {
        let work = state(
            "work",
            vec![step("w", vec![]), step_of("end", StepRole::Final, vec![]), on("w -> end", "E")],
        );
        vec![
            vec![conflict(Policy::OuterFirst), event("E")],
            queue.map(|bound| setting(SettingKind::Queue(bound))).into_iter().collect(),
            vec![
                work,
                step("rest", vec![]),
                on("work -> rest", "done.state.work"),
                on("rest -> work", "E"),
            ],
        ]
    };
    assert_eq!(
        findings(ends(None)),
        ["G0221 events are raised or sent without delay, but the queues have no bound"]
    );
    let net = clean(ends(Some(2)));
    let done = net.steps.values().next().unwrap().done_event.unwrap();
    assert_eq!(net.inputs[done].name.text, "done.state.work");
    assert_eq!(net.transitions.values().nth(1).unwrap().events, [done]);
}

#[test]
fn delayed_sends_give_the_queue_its_bound() {
    let send = |slot: Option<&str>| {
        stmt(StmtKind::Send { event: name("E"), after: Some(20_000_000), slot: slot.map(name) })
    };
    let list =
        vec![stmt(StmtKind::Cancel(name("x"))), send(Some("x")), send(None), send(Some("x"))];
    let net = clean(vec![
        vec![conflict(Policy::InnerFirst), event("E"), event("F")],
        vec![
            step("p", vec![item(StepItemKind::Entry(list))]),
            step("q", vec![]),
            on("p -> q", "E"),
            on("q -> p", "F"),
        ],
    ]);
    let slots: Vec<&str> = net.sends.values().map(|slot| slot.name.text.as_str()).collect();
    assert_eq!(slots, ["x", "E_send"]);
    assert_eq!(net.settings.queue, Some(4));
}

#[test]
fn statecharts_refuse_what_only_a_grafcet_has() {
    let more = |extra: Vec<Item>| {
        findings(vec![
            vec![conflict(Policy::InnerFirst)],
            inputs("a"),
            vec![step("p", vec![]), step("q", vec![]), go("p -> q", v("a")), go("q -> p", v("a"))],
            extra,
        ])
    };
    assert_eq!(
        more(vec![go("p & q -> p", v("a")), go("-> p", v("a")), single()]),
        [
            "G0207 a statechart runs to completion, so its evolution is `stable`",
            "G0222 a transition with several sources is not allowed in a statechart",
            "G0222 a source transition is not allowed in a statechart"
        ]
    );
    assert_eq!(
        more(vec![event("E"), go("p -> q", v("E"))]),
        ["G0213 the event `E` is not allowed in a condition of a statechart"]
    );
    let grafcet = findings(vec![vec![state("s", vec![]), initial("p", vec![])]]);
    assert_eq!(grafcet, ["G0222 a state is allowed only in a statechart"]);
}

#[test]
fn enclosed_charts_are_parts_of_their_own() {
    let link = |text: &str| {
        Item::Step(Step {
            name: name(text),
            activation_link: true,
            meta: meta(),
            ..Step::default()
        })
    };
    let run = Enclosing {
        step: Step { name: name("run"), meta: meta(), ..Step::default() },
        items: vec![
            link("a"),
            step("b", vec![]),
            go("a -> b", v("m")),
            go("b -> a", v("m")),
            go("-> b", v("m")),
        ],
    };
    let items = |extra| {
        vec![
            vec![single()],
            inputs("m"),
            vec![
                initial("p", vec![]),
                Item::Enclosing(run.clone()),
                go("p -> run", v("m")),
                go("run -> p", v("run.a.active")),
            ],
            extra,
        ]
    };
    let net = clean(items(vec![]));
    let names: Vec<_> = net.steps.values().map(|step| step.name.text.as_str()).collect();
    assert_eq!(names, ["p", "run", "a", "b"]);
    let parents: Vec<_> = net.steps.values().map(|step| step.parent.map(|id| id.index())).collect();
    assert_eq!(parents, [None, None, Some(1), Some(1)]);
    assert_eq!(net.parts.len(), 2);
    let across = findings(items(vec![go("p -> run.b", v("m"))]));
    assert_eq!(across.len(), 1, "{across:?}");
}

#[test]
fn forcing_orders_name_steps_of_the_forced_chart() {
    let force = |target: &str, order| item(StepItemKind::Force { target: path(target), order });
    let charts = |body: Vec<StepItem>, back: Vec<StepItem>| {
        design(vec![
            chart(
                "top",
                vec![
                    vec![single()],
                    inputs("m"),
                    vec![
                        initial("p", vec![]),
                        step("q", body),
                        go("p -> q", v("m")),
                        go("q -> p", v("m")),
                    ],
                ],
            ),
            chart(
                "g",
                vec![
                    inputs("n"),
                    vec![
                        initial("s", back),
                        step("u", vec![]),
                        go("s -> u", v("n")),
                        go("u -> s", v("n")),
                    ],
                ],
            ),
        ])
    };
    let (net, found) = lower(&charts(
        vec![
            force("g", ForceOrder::Situation(vec![path("u")])),
            force("g", ForceOrder::Init),
            force("g", ForceOrder::Hold),
            force("g", ForceOrder::Situation(vec![])),
        ],
        vec![],
    ));
    assert_eq!(told(&found), Vec::<String>::new());
    let net = net.unwrap();
    let orders: Vec<usize> = net
        .forcings
        .iter()
        .map(|one| match &one.order {
            ForcingOrder::Situation(steps) => steps.iter().map(|step| step.index() + 10).sum(),
            ForcingOrder::Hold => 1,
        })
        .collect();
    assert_eq!(orders, [13, 12, 1, 0]);
    let (_, found) = lower(&charts(
        vec![force("g", ForceOrder::Init), force("h", ForceOrder::Hold)],
        vec![force("top", ForceOrder::Hold), force("g", ForceOrder::Hold)],
    ));
    assert_eq!(
        told(&found),
        [
            "G0201 unknown name `h`",
            "G0234 chart `g` forces itself",
            "G0234 charts force each other in a cycle: top -> g -> top"
        ]
    );
}
