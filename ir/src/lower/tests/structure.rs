//! Tests of names, expansion and order.

use super::build::*;
use crate::chart::{Item, MacroStep, StepRole};
use crate::expr::ExprKind;
use crate::lower::context::Lowering;
use crate::lower::expand::expand;
use crate::lower::lower;
use crate::net::{Enter, Evolution, Leaf, Net, Policy, TransitionKind};

fn step_names(net: &Net) -> Vec<&str> {
    net.steps.values().map(|step| step.name.text.as_str()).collect()
}
fn transition_names(net: &Net) -> Vec<&str> {
    net.transitions.values().map(|one| one.name.text.as_str()).collect()
}

/// The truck in the paper on Grafcet, C and PALASM.
fn truck() -> Vec<Vec<Item>> {
    vec![
        vec![single(), conflict(Policy::PriorityAge)],
        inputs("m b p a"),
        vec![output("R"), output("Z"), output("L")],
        vec![
            initial("p1", vec![]),
            step("p2", vec![action("R")]),
            step("p3", vec![action("Z")]),
            step("p4", vec![action("L")]),
            named("t1", "p1 -> p2", v("m")),
            named("t2", "p2 -> p3", v("b")),
            named("t3", "p3 -> p4", v("p")),
            named("t4", "p4 -> p1", v("a")),
        ],
    ]
}

#[test]
fn the_truck_has_four_steps_and_transitions() {
    let net = clean(truck());
    assert_eq!(step_names(&net), ["p1", "p2", "p3", "p4"]);
    assert_eq!(transition_names(&net), ["t1", "t2", "t3", "t4"]);
    assert_eq!(net.settings.evolution, Evolution::Single);
    assert!(net.steps.values().next().unwrap().is_initial);
}

/// The paper on Grafcet, C and PALASM prints `t4: p1*a |- @p1`, so no transition leaves p4.
#[test]
fn the_misprint_of_the_seed_is_told() {
    let mut items = truck();
    items[3].pop();
    items[3].push(named("t4", "p1 -> p1", v("a")));
    assert_eq!(findings(items), ["G0243 step `p4` has no outgoing transition"]);
}

fn fill() -> Item {
    macro_of(
        "fill",
        vec![
            step_of("e", StepRole::MacroEntry, vec![]),
            step_of("x", StepRole::MacroExit, vec![]),
            go("e -> x", v("a")),
        ],
    )
}

#[test]
fn macro_steps_stand_at_their_place_each_with_its_own_steps() {
    let net = clean(vec![
        vec![single()],
        inputs("a b"),
        vec![
            fill(),
            initial("p", vec![]),
            macro_step("m1", "fill"),
            step("q", vec![]),
            macro_step("m2", "fill"),
            go("p -> m1", v("b")),
            go("m1 -> q", v("b")),
            go("q -> m2", v("m1.active")),
            go("m2 -> p", v("m2.x.active")),
        ],
    ]);
    assert_eq!(step_names(&net), ["p", "m1.e", "m1.x", "q", "m2.e", "m2.x"]);
    assert_eq!(transition_names(&net), ["m1.e_x", "m2.e_x", "p_m1", "m1_q", "q_m2", "m2_p"]);
    let ids: Vec<_> = net.steps.ids().collect();
    let all: Vec<_> = net.transitions.values().collect();
    assert_eq!(all[2].enters, [Enter::Step(ids[1])], "entered at the entry step");
    assert_eq!(all[3].requires, [ids[2]], "left from the exit step");
    let active = |id: usize| Leaf::Active(ids[id]);
    let mut read = Vec::new();
    for leaf in all[4].guard.leaves() {
        read.push(*leaf);
    }
    assert_eq!(read, [active(1), active(2)], "m1.active is the OR of its steps");
    let levels: Vec<u32> = net.parts.values().map(|part| part.level).collect();
    assert_eq!(levels, [1, 2, 2]);
    assert_eq!(net.macros.len(), 2);
    assert_eq!((net.macros[1].entry, net.macros[1].exit), (ids[4], ids[5]));
}

#[test]
fn macros_nest_and_local_names_win() {
    let outer = macro_of(
        "outer",
        vec![
            step_of("e", StepRole::MacroEntry, vec![]),
            macro_step("inner", "fill"),
            step_of("a", StepRole::MacroExit, vec![]),
            go("e -> inner", v("a.active")),
            go("inner -> a", v("b")),
        ],
    );
    let net = clean(vec![
        vec![single()],
        inputs("a b"),
        vec![
            // The macro is used before it is declared.
            macro_step("m", "outer"),
            outer,
            fill(),
            initial("p", vec![]),
            go("p -> m", v("b")),
            go("m -> p", v("m.inner.active")),
        ],
    ]);
    assert_eq!(step_names(&net), ["m.e", "m.inner.e", "m.inner.x", "m.a", "p"]);
    let guard = &net.transitions.values().find(|one| one.name.text == "m.e_inner").unwrap().guard;
    let local = net.steps.ids().nth(3).unwrap();
    assert_eq!(guard.kind, ExprKind::Leaf(Leaf::Active(local)), "the step a, not the input a");
    assert_eq!(net.macros.len(), 2);
    assert_eq!(net.macros.iter().map(|one| one.steps.len()).collect::<Vec<_>>(), [4, 2]);
}

#[test]
fn an_initial_macro_step_starts_at_its_entry() {
    let initial = Item::MacroStep(MacroStep {
        name: name("m"),
        body: name("fill"),
        role: StepRole::Initial,
        priority: None,
        meta: meta(),
    });
    let net = clean(vec![vec![single()], inputs("a"), vec![fill(), initial, go("m -> m", v("a"))]]);
    assert_eq!(net.steps.values().map(|step| step.is_initial).collect::<Vec<_>>(), [true, false]);
}

#[test]
fn a_chart_may_begin_in_a_macro_step_alone() {
    let initial = Item::MacroStep(MacroStep {
        name: name("m"),
        body: name("fill"),
        role: StepRole::Initial,
        priority: None,
        meta: meta(),
    });
    let items =
        vec![fill(), initial, step("p", vec![]), go("m -> p", v("a")), go("p -> m", v("a"))];
    assert_eq!(clean(vec![vec![single()], inputs("a"), items]).parts.len(), 2);
}

/// A macro may begin and end with a macro-step: it begins and ends where that one does; `complete` refers to its last step.
#[test]
fn a_macro_may_end_with_a_macro_step() {
    let last = Item::MacroStep(MacroStep {
        name: name("i"),
        body: name("fill"),
        role: StepRole::MacroExit,
        priority: None,
        meta: meta(),
    });
    let first = step_of("b", StepRole::MacroEntry, vec![]);
    let outer = macro_of("outer", vec![first, last, go("b -> i", v("a"))]);
    let items = vec![fill(), outer, initial("p", vec![]), macro_step("m", "outer")];
    let moves =
        vec![go("p -> m", v("a")), go("m -> p", v("m.complete")), go("p -> p", v("m.i.complete"))];
    let net = clean(vec![vec![single()], inputs("a"), items, moves]);
    let exit = net.steps.iter().find(|(_, step)| step.name.text == "m.i.x").unwrap().0;
    let back = net.transitions.values().find(|one| one.name.text == "m_p").unwrap();
    assert_eq!(back.requires, [exit]);
    assert_eq!(back.guard.kind, ExprKind::Leaf(Leaf::Active(exit)));
    assert!(net.macros.iter().all(|one| one.exit == exit));
}

#[test]
fn a_macro_in_itself_is_refused_with_the_way_there() {
    let body = |inner: &str| {
        vec![
            step_of("e", StepRole::MacroEntry, vec![]),
            macro_step("i", inner),
            step_of("x", StepRole::MacroExit, vec![]),
            go("e -> i", v("true")),
            go("i -> x", v("true")),
        ]
    };
    let found = findings(vec![vec![
        macro_of("a", body("b")),
        macro_of("b", body("c")),
        macro_of("c", body("b")),
        initial("p", vec![]),
        macro_step("m", "a"),
        go("p -> m", v("true")),
        go("m -> p", v("true")),
    ]]);
    assert_eq!(found, ["G0204 macro `b` contains itself: b -> c -> b"]);
}

#[test]
fn an_expansion_that_explodes_is_stopped() {
    let mut items = vec![
        initial("p", vec![]),
        macro_step("m", "a0"),
        go("p -> m", v("true")),
        go("m -> p", v("true")),
    ];
    for level in 0..30 {
        let next = format!("a{}", level + 1);
        items.push(macro_of(
            &format!("a{level}"),
            vec![
                step_of("e", StepRole::MacroEntry, vec![]),
                macro_step("l", &next),
                macro_step("r", &next),
                step_of("x", StepRole::MacroExit, vec![]),
                go("e -> l & r", v("true")),
                go("l & r -> x", v("true")),
            ],
        ));
    }
    items.push(macro_of("a30", vec![step_of("e", StepRole::MacroEntryExit, vec![])]));
    let design = design(vec![chart("c", vec![items])]);
    let mut lowering = Lowering::new(&design);
    lowering.max_objects = 5_000;
    expand(&mut lowering);
    assert_eq!(
        told(&lowering.found.list),
        ["G0229 the expansion of macro-steps has more than 5000 steps and transitions"]
    );
}

/// Macros without steps create no objects, so the macros themselves must be counted.
#[test]
fn an_expansion_of_nothing_is_stopped_too() {
    let mut items = vec![initial("p", vec![]), macro_step("m", "a0")];
    for level in 0..40 {
        let next = format!("a{}", level + 1);
        items.push(macro_of(
            &format!("a{level}"),
            vec![macro_step("l", &next), macro_step("r", &next)],
        ));
    }
    items.push(macro_of("a40", vec![]));
    let design = design(vec![chart("c", vec![items])]);
    let mut lowering = Lowering::new(&design);
    lowering.max_objects = 5_000;
    expand(&mut lowering);
    let found = told(&lowering.found.list);
    assert!(found.iter().any(|one| one.starts_with("G0229")), "{found:?}");
}

#[test]
fn mistakes_in_an_unused_macro_are_found_too() {
    let found = findings(vec![
        inputs("a"),
        vec![
            macro_of(
                "m",
                vec![
                    step_of("e", StepRole::MacroEntry, vec![]),
                    step_of("x", StepRole::MacroExit, vec![]),
                    go("e -> x", v("aa")),
                ],
            ),
            initial("p", vec![]),
            go("p -> p", v("a")),
        ],
    ]);
    assert_eq!(found, ["G0232 macro `m` is never used", "G0201 unknown name `aa`"]);
}

#[test]
fn made_names_leave_the_users_names_alone() {
    let net = clean(vec![
        vec![single()],
        inputs("a b"),
        vec![
            initial("p", vec![]),
            step("q", vec![]),
            go("p -> q", v("a")),
            go("p -> q", v("b")),
            named("p_q", "q -> p", v("a")),
        ],
    ]);
    assert_eq!(transition_names(&net), ["p_q_2", "p_q_3", "p_q"]);
}

#[test]
fn charts_side_by_side_carry_their_names() {
    let one = |text: &str, guard: &str| {
        chart(
            text,
            vec![
                vec![single()],
                inputs("a"),
                vec![
                    output("R"),
                    initial("p", vec![action("R")]),
                    step("q", vec![]),
                    go("p -> q", v(guard)),
                    go("q -> p", v("a")),
                ],
            ],
        )
    };
    let (net, found) = lower(&design(vec![one("g", "a"), one("h", "g.p.active")]));
    assert_eq!(told(&found), Vec::<String>::new());
    let net = net.unwrap();
    assert_eq!(step_names(&net), ["g.p", "g.q", "h.p", "h.q"]);
    assert_eq!(
        net.inputs.values().map(|one| one.name.text.as_str()).collect::<Vec<_>>(),
        ["g.a", "h.a"]
    );
    assert_eq!(net.parts.len(), 2);
}

#[test]
fn settings_of_charts_side_by_side_must_agree() {
    use crate::chart::SettingKind::Tick;
    let one = |text: &str, settings| chart(text, vec![settings, vec![initial("p", vec![])]]);
    let (_, found) = lower(&design(vec![
        one("g", vec![setting(Tick(1)), setting(Tick(2))]),
        one("h", vec![setting(Tick(3)), single()]),
    ]));
    assert_eq!(
        told(&found),
        ["G0206 `tick` is set twice", "G0207 the charts of one file differ in `tick`"]
    );
    let (net, _) = lower(&design(vec![one("g", vec![]), one("h", vec![single()])]));
    assert_eq!(net.unwrap().settings.evolution, Evolution::Single, "said once for all");
}

#[test]
fn the_limit_counts_steps_and_transitions() {
    let net = clean(vec![
        vec![setting(crate::chart::SettingKind::EvolutionStable(None))],
        inputs("a b"),
        vec![initial("p", vec![]), step("q", vec![]), go("p -> q", v("a")), go("q -> p", v("b"))],
    ]);
    assert_eq!(net.settings.evolution, Evolution::Stable { limit: 4 });
    assert_eq!(net.settings.policy, Policy::All);
}

#[test]
fn reactions_stand_at_their_step() {
    use crate::chart::{StepItemKind, StmtKind};
    let on = |text: &str| {
        item(StepItemKind::On {
            events: vec![name(text)],
            guard: None,
            actions: vec![stmt(StmtKind::Raise(name("done")))],
        })
    };
    let net = clean(vec![
        vec![single()],
        inputs("a"),
        vec![
            event("E"),
            event("done"),
            initial("p", vec![]),
            go("p -> q", v("a")),
            step("q", vec![on("E")]),
            go("q -> p", v("done")),
        ],
    ]);
    assert_eq!(transition_names(&net), ["p_q", "q_on_E", "q_p"]);
    let kinds: Vec<_> = net.transitions.values().map(|one| one.kind).collect();
    assert_eq!(kinds, [TransitionKind::Move, TransitionKind::Reaction, TransitionKind::Move]);
    let reaction = net.transitions.values().nth(1).unwrap();
    assert_eq!((reaction.requires.len(), reaction.clears.len(), reaction.events.len()), (1, 0, 1));
}

#[test]
fn otherwise_names_what_stands_above_and_leaves_a_common_step() {
    let net = clean(vec![
        vec![single()],
        inputs("a b"),
        vec![
            initial("p", vec![]),
            initial("q", vec![]),
            named("t1", "p -> p", v("a")),
            named("t2", "q -> q", v("b")),
            named("t3", "p & q -> p & q", v("otherwise")),
            named("t4", "p -> q", v("otherwise")),
            named("t5", "p -> q", v("b")),
        ],
    ]);
    let read = |index: usize| {
        let mut read = Vec::new();
        for leaf in net.transitions.values().nth(index).unwrap().guard.leaves() {
            match leaf {
                Leaf::Fireable(id) => read.push(net.transitions[*id].name.text.as_str()),
                _ => panic!("{leaf:?}"),
            }
        }
        read
    };
    assert_eq!(read(2), ["t1", "t2"]);
    assert_eq!(read(3), ["t1", "t3"]);
}
