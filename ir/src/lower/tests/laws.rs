//! Properties of the lowering that are true for every chart, tested on random charts with many errors.

use super::build::*;
use crate::FileId;
use crate::chart::*;
use crate::diag::any_error;
use crate::expr::{ArithOp, CompareOp, ExprKind, Type};
use crate::lower::{TaskCosts, dump_after, lower, passes};
use crate::net::{Policy, Qualifier};
use crate::text;
use proptest::prelude::*;

const NAMES: &[&str] =
    &["a", "b", "n", "R", "E", "p", "q", "m", "m.e", "c", "t", "f", "p.active", "p.t", "T", "zz"];

fn any_name() -> impl Strategy<Value = &'static str> {
    proptest::sample::select(NAMES)
}

fn any_expr() -> impl Strategy<Value = Expr> {
    let leaf = prop_oneof![
        4 => any_name().prop_map(v),
        1 => proptest::sample::select(&["true", "false", "3", "-1", "25ms", "otherwise"][..]).prop_map(v),
    ];
    leaf.prop_recursive(3, 12, 3, |inner| {
        let pair = || (inner.clone(), inner.clone());
        prop_oneof![
            inner.clone().prop_map(not),
            pair().prop_map(|(a, b)| and(vec![a, b])),
            pair().prop_map(|(a, b)| or(vec![a, b])),
            pair().prop_map(|(a, b)| e(ExprKind::Compare(CompareOp::Ge, Box::new(a), Box::new(b)))),
            pair().prop_map(|(a, b)| e(ExprKind::Arith(ArithOp::Div, Box::new(a), Box::new(b)))),
            pair().prop_map(|(a, b)| plus(a, b)),
            inner.clone().prop_map(rise),
            inner.clone().prop_map(|a| delay(20, a, 30)),
            (any_name(), inner.clone()).prop_map(|(name, index)| element(name, index)),
        ]
    })
}

fn any_stmt() -> impl Strategy<Value = Stmt> {
    let simple = prop_oneof![
        4 => (any_name(), any_expr()).prop_map(|(to, value)| assign(to, value)),
        1 => any_name().prop_map(|text| stmt(StmtKind::Raise(name(text)))),
        1 => any_name().prop_map(|text| stmt(StmtKind::Send { event: name(text), after: Some(1), slot: Some(name("s")) })),
        1 => Just(()).prop_map(|()| stmt(StmtKind::Cancel(name("s")))),
        1 => (any_name(), any_expr()).prop_map(|(text, one)| stmt(StmtKind::Call { function: name(text), arguments: vec![one] })),
    ];
    simple.prop_recursive(2, 4, 2, |inner| {
        (any_expr(), proptest::collection::vec(inner, 0..3))
            .prop_map(|(condition, then)| stmt(StmtKind::If { condition, then, otherwise: vec![] }))
    })
}

fn any_block() -> impl Strategy<Value = Block> {
    proptest::collection::vec(any_stmt(), 0..3)
}

fn any_how() -> impl Strategy<Value = ActionHow> {
    prop_oneof![
        3 => Just(ActionHow::Bare),
        1 => Just(ActionHow::After(20_000_000)),
        1 => Just(ActionHow::For(30_000_000)),
        1 => Just(ActionHow::Qualified(Qualifier::S, None)),
        1 => Just(ActionHow::Qualified(Qualifier::P, None)),
        1 => Just(ActionHow::Qualified(Qualifier::SD, Some(20_000_000))),
    ]
}

fn any_step_item() -> impl Strategy<Value = StepItem> {
    prop_oneof![
        4 => (any_name(), any_how(), proptest::option::of(any_expr())).prop_map(|(to, how, condition)| act(to, how, condition)),
        1 => any_block().prop_map(|block| item(StepItemKind::Entry(block))),
        1 => any_block().prop_map(|block| item(StepItemKind::Exit(block))),
        1 => (any_name(), any_block()).prop_map(|(event, actions)| item(StepItemKind::On { events: vec![name(event)], guard: None, actions })),
        1 => any_block().prop_map(|body| item(StepItemKind::Task { name: name("task"), cost: Some(5), body })),
        1 => (1u32..9).prop_map(|budget| item(StepItemKind::Budget(budget))),
        1 => (1u32..9).prop_map(|number| item(StepItemKind::Priority(number))),
        1 => any_name().prop_map(|text| item(StepItemKind::Force { target: path(text), order: ForceOrder::Init })),
    ]
}

fn any_step() -> impl Strategy<Value = Step> {
    let role = proptest::sample::select(
        &[
            StepRole::Plain,
            StepRole::Initial,
            StepRole::MacroEntry,
            StepRole::MacroExit,
            StepRole::MacroEntryExit,
            StepRole::Final,
        ][..],
    );
    let count = proptest::option::weighted(0.1, 0u32..4);
    (any_name(), role, any::<bool>(), count, proptest::collection::vec(any_step_item(), 0..3))
        .prop_map(|(text, role, link, count, body)| {
            let text = text.replace('.', "_");
            Step {
                name: name(&text),
                role,
                activation_link: link,
                count: count.map(|max| StepCount { max, initial: Some(2), span: span() }),
                body,
                meta: meta(),
            }
        })
}

fn any_transition() -> impl Strategy<Value = Item> {
    let side = || proptest::collection::vec(any_name().prop_map(path), 0..3);
    (
        side(),
        side(),
        proptest::option::of(any_expr()),
        proptest::option::of(prop_oneof![
            Just(Length::Ns(20_000_000)),
            any_name().prop_map(|name| Length::Named(path(name))),
        ]),
        any_block(),
        any::<bool>(),
        proptest::bool::weighted(0.2),
    )
        .prop_map(|(sources, targets, guard, after, actions, restart, is_internal)| {
            let after = after.map(|length| (length, span()));
            Item::Transition(Transition {
                sources,
                targets,
                guard,
                after,
                actions,
                restart,
                is_internal,
                meta: meta(),
                ..Transition::default()
            })
        })
}

/// An instance of one of the two library charts of [`any_design`], or of none.
fn any_use() -> impl Strategy<Value = Use> {
    let argument = (any_name(), any_expr(), any_name(), any::<bool>()).prop_map(
        |(parameter, value, target, reads)| Argument {
            parameter: name(parameter),
            value: if reads {
                ArgumentValue::Reads(value)
            } else {
                ArgumentValue::Drives(path(target))
            },
            span: span(),
        },
    );
    (
        proptest::sample::select(&["l1", "l2", "l3"][..]),
        any_name(),
        proptest::collection::vec(argument, 0..4),
    )
        .prop_map(|(library, text, arguments)| Use {
            library: name(library),
            name: name(&text.replace('.', "_")),
            arguments,
            meta: meta(),
        })
}

fn any_library(text: &'static str) -> impl Strategy<Value = Library> {
    let kinds = [
        DeclarationKind::Input { ty: Type::Bool, synchronous: false },
        DeclarationKind::Input { ty: int(0, 9), synchronous: false },
        DeclarationKind::Output {
            ty: Type::Bool,
            init: None,
            registered: false,
            mealy: false,
            safe: None,
        },
        DeclarationKind::Var { ty: int(0, 9), len: None, init: vec![] },
        DeclarationKind::Event { internal: false },
        DeclarationKind::Const { value: v("3") },
    ];
    let parameter = (any_name(), proptest::sample::select(kinds.to_vec()), any::<bool>()).prop_map(
        |(text, kind, has_default)| Parameter {
            declaration: Declaration { name: name(&text.replace('.', "_")), kind, meta: meta() },
            default: has_default.then(|| v("1")),
        },
    );
    (proptest::collection::vec(parameter, 0..4), proptest::collection::vec(any_item(), 0..4))
        .prop_map(move |(parameters, items)| Library {
            name: name(text),
            parameters,
            items,
            span: span(),
            meta: meta(),
            ..Library::default()
        })
}

fn any_item() -> impl Strategy<Value = Item> {
    let leaf = prop_oneof![
        6 => any_step().prop_map(Item::Step),
        6 => any_transition(),
        1 => any_expr().prop_map(|value| constant("k", value)),
        1 => any_expr().prop_map(|condition| declare("T2", DeclarationKind::Timer { condition })),
        1 => any_expr().prop_map(|init| declare("w", DeclarationKind::Var { ty: int(0, 3), len: Some(3), init: vec![init] })),
        1 => any_expr().prop_map(|expr| Item::Property(assert_never(expr))),
        1 => any_name().prop_map(|text| Item::Place(Place { items: vec![path(text)], part: name("chip"), span: span() })),
        1 => any_name().prop_map(|body| macro_step("m", body)),
        1 => any_use().prop_map(Item::Use),
    ];
    leaf.prop_recursive(2, 8, 4, |inner| {
        let items = || proptest::collection::vec(inner.clone(), 0..4);
        prop_oneof![
            items().prop_map(|items| macro_of("f", items)),
            (any_step(), items())
                .prop_map(|(step, items)| Item::Enclosing(Enclosing { step, items })),
            (any_step(), any::<bool>(), items()).prop_map(|(step, is_parallel, items)| {
                Item::State(State { step, is_parallel, items, ..State::default() })
            }),
        ]
    })
}

fn any_design() -> impl Strategy<Value = Design> {
    let policy = proptest::sample::select(
        &[
            Policy::All,
            Policy::Priority,
            Policy::PriorityAge,
            Policy::InnerFirst,
            Policy::OuterFirst,
        ][..],
    );
    let libraries = (any_library("l1"), any_library("l2"));
    (policy, any::<bool>(), proptest::collection::vec(any_item(), 0..8), libraries).prop_map(
        |(policy, is_single, items, (first, second))| {
            let settings = vec![
                conflict(policy),
                if is_single { single() } else { setting(SettingKind::EvolutionStable(None)) },
            ];
            let declared = vec![
                output("R"),
                event("E"),
                var("n", int(0, 9)),
                declare("T", DeclarationKind::Timer { condition: v("a") }),
                declare("t", DeclarationKind::Var { ty: Type::Bool, len: Some(4), init: vec![] }),
                initial("i", vec![]),
            ];
            let signals = [inputs("a b"), declared].concat();
            let mut made = design(vec![chart("c", vec![settings, signals, items])]);
            made.libraries = vec![first, second];
            made
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 150, ..ProptestConfig::default() })]

    /// The lowering never panics, gives the same result for the same chart, and accepts only valid charts: it reports every error itself, in terms of the
    /// chart.
    #[test]
    fn every_chart_is_lowered_or_told(design in any_design()) {
        let (net, found) = lower(&design);
        prop_assert_eq!(net.is_none(), any_error(&found));
        for finding in found.iter().filter(|finding| finding.is_error()) {
            // Structural errors that only validation finds.
            let is_structure = matches!(finding.code.id, "G0312" | "G0323" | "G0324" | "G0325" | "G0333");
            prop_assert!(finding.code.id.starts_with("G02") || is_structure, "{:?} of {:#?}", finding, design);
            prop_assert!(!finding.labels.is_empty(), "{:?}", finding);
        }
        let again = lower(&design);
        prop_assert_eq!(&again.1, &found);
        if let Some(net) = net {
            let printed = text::print(&net);
            let (back, problems) = text::parse(FileId(0), &printed);
            prop_assert!(problems.is_empty(), "{:?}\n{}", problems, printed);
            prop_assert_eq!(text::print(&back.unwrap()), printed);
        }
    }
}

/// A condition over the declarations of `sound`.
fn sound_bool() -> impl Strategy<Value = Expr> {
    let atom = proptest::sample::select(
        &["a", "b", "p.active", "m.active", "m.x.active", "p.done", "flag", "Q", "true"][..],
    );
    let leaf = prop_oneof![
        4 => atom.prop_map(v),
        1 => (1i64..60).prop_map(|ms| ge("p.t", &format!("{ms}0ms"))),
        1 => (1i64..60).prop_map(|ms| lt("T", &format!("{ms}0ms"))),
        1 => sound_int().prop_map(|n| e(ExprKind::Compare(CompareOp::Ge, Box::new(n), Box::new(v("4"))))),
    ];
    leaf.prop_recursive(3, 10, 3, |inner| {
        prop_oneof![
            inner.clone().prop_map(not),
            (inner.clone(), inner.clone()).prop_map(|(a, b)| and(vec![a, b])),
            (inner.clone(), inner.clone()).prop_map(|(a, b)| or(vec![a, b])),
            inner.prop_map(|a| delay(20, a, 30)),
        ]
    })
}

fn sound_int() -> impl Strategy<Value = Expr> {
    let leaf = prop_oneof![
        Just(v("n")),
        Just(v("N")),
        (0i64..9).prop_map(|n| v(&n.to_string())),
        Just(element("w", v("2")))
    ];
    leaf.prop_recursive(2, 6, 2, |inner| (inner.clone(), inner).prop_map(|(a, b)| plus(a, b)))
}

fn sound_block() -> impl Strategy<Value = Block> {
    let simple = prop_oneof![
        sound_int().prop_map(|value| assign("n", value)),
        sound_int().prop_map(|value| assign("N", value)),
        sound_bool().prop_map(|value| assign("flag", value)),
        sound_int()
            .prop_map(|n| stmt(StmtKind::Call { function: name("speed"), arguments: vec![n] })),
        Just(()).prop_map(|()| stmt(StmtKind::Raise(name("E")))),
        sound_bool().prop_map(|condition| stmt(StmtKind::If {
            condition,
            then: vec![assign("n", v("1"))],
            otherwise: vec![]
        })),
    ];
    proptest::collection::vec(simple, 0..3)
}

fn sound_body() -> impl Strategy<Value = Vec<StepItem>> {
    let one = prop_oneof![
        proptest::option::of(sound_bool()).prop_map(|condition| act(
            "R",
            ActionHow::Bare,
            condition
        )),
        sound_bool().prop_map(|condition| act("R", ActionHow::After(20_000_000), Some(condition))),
        Just(()).prop_map(|()| act("Q", ActionHow::Qualified(Qualifier::S, None), None)),
        Just(()).prop_map(|()| act(
            "Q",
            ActionHow::Qualified(Qualifier::SL, Some(30_000_000)),
            None
        )),
        sound_block().prop_map(|block| item(StepItemKind::Entry(block))),
        sound_block().prop_map(|block| item(StepItemKind::Exit(block))),
        (sound_bool(), sound_block()).prop_map(|(guard, actions)| item(StepItemKind::On {
            events: vec![name("E")],
            guard: Some(guard),
            actions
        })),
    ];
    proptest::collection::vec(one, 0..4)
}

fn sound_transition(steps: &'static [&'static str]) -> impl Strategy<Value = Item> {
    let side = || proptest::sample::subsequence(steps, 1..=2);
    let guard = prop_oneof![
        4 => sound_bool(),
        1 => sound_bool().prop_map(|a| and(vec![rise(v("a")), a])),
        1 => Just(()).prop_map(|()| and(vec![v("otherwise"), v("a")])),
        1 => Just(()).prop_map(|()| v("E")),
    ];
    (side(), side(), guard, any::<bool>(), sound_block()).prop_map(
        |(from, to, guard, restart, actions)| {
            let arrow_text = format!("{} -> {}", from.join(" & "), to.join(" & "));
            Item::Transition(Transition { restart, actions, ..arrow(&arrow_text, Some(guard)) })
        },
    )
}

/// A Grafcet without errors: two steps, a macro-step, an enclosing step, and items from the strategies above.
fn sound() -> impl Strategy<Value = Design> {
    let policy =
        proptest::sample::select(&[Policy::All, Policy::Priority, Policy::PriorityAge][..]);
    let outer = || proptest::collection::vec(sound_transition(&["p", "q", "m", "z", "m.x"]), 1..5);
    let inner = || proptest::collection::vec(sound_transition(&["c", "d"]), 0..3);
    (
        policy,
        any::<bool>(),
        [sound_body(), sound_body(), sound_body(), sound_body()],
        outer(),
        inner(),
    )
        .prop_map(|(policy, is_single, [p, q, e, c], outer, inner)| {
            let mut items = inputs("a b");
            items.extend([
                conflict(policy),
                if is_single { single() } else { setting(SettingKind::EvolutionStable(Some(9))) },
                output("R"),
                output("Q"),
                output_of("N", int(0, 3), false),
                event("E"),
                var("n", int(-4, 9)),
                var("flag", Type::Bool),
                declare(
                    "w",
                    DeclarationKind::Var { ty: int(0, 3), len: Some(3), init: vec![v("1")] },
                ),
                declare("T", DeclarationKind::Timer { condition: v("a") }),
                declare(
                    "speed",
                    DeclarationKind::ExternAction { params: vec![("v".into(), int(0, 9))] },
                ),
                macro_of(
                    "f",
                    vec![
                        step_of("e", StepRole::MacroEntry, e),
                        step_of(
                            "x",
                            StepRole::MacroExit,
                            vec![item(StepItemKind::Exit(vec![assign("N", v("1"))]))],
                        ),
                        go("e -> x", v("a")),
                    ],
                ),
                initial("p", p),
                step(
                    "q",
                    [q, vec![act("Q", ActionHow::Qualified(Qualifier::R, None), None)]].concat(),
                ),
                macro_step("m", "f"),
                Item::Enclosing(Enclosing {
                    step: Step { name: name("z"), meta: meta(), ..Step::default() },
                    items: [
                        vec![
                            Item::Step(Step {
                                name: name("c"),
                                activation_link: true,
                                body: c,
                                meta: meta(),
                                ..Step::default()
                            }),
                            step("d", vec![]),
                        ],
                        inner,
                    ]
                    .concat(),
                }),
            ]);
            items.extend(outer);
            design(vec![chart("c", vec![items])])
        })
}

/// A state: its parent among the earlier states, whether its children are regions, and whether it is final.
type DrawnState = (prop::sample::Index, bool, bool);
/// A transition: source, target, and whether it leads to the target's history.
type DrawnTransition = (prop::sample::Index, prop::sample::Index, bool);

fn statechart() -> impl Strategy<Value = (Vec<DrawnState>, Vec<DrawnTransition>)> {
    (
        proptest::collection::vec(
            (any::<prop::sample::Index>(), any::<bool>(), proptest::bool::weighted(0.1)),
            2..14,
        ),
        proptest::collection::vec(
            (
                any::<prop::sample::Index>(),
                any::<prop::sample::Index>(),
                proptest::bool::weighted(0.2),
            ),
            1..8,
        ),
    )
}

fn grown(states: &[DrawnState], transitions: &[DrawnTransition]) -> Design {
    // Parent 0 is the chart; state i is number i + 1.
    let parents: Vec<usize> =
        states.iter().enumerate().map(|(i, (parent, ..))| parent.index(i + 1)).collect();
    let has_children = |number: usize| parents.contains(&number);
    let is_parallel = |number: usize| number > 0 && states[number - 1].1 && has_children(number);
    let is_final = |number: usize| {
        states[number - 1].2
            && !has_children(number)
            && !is_parallel(parents[number - 1])
            && number > 1
    };
    let full = |number: usize| {
        let mut names = vec![format!("s{number}")];
        let mut parent = parents[number - 1];
        while parent > 0 {
            names.insert(0, format!("s{parent}"));
            parent = parents[parent - 1];
        }
        names.join(".")
    };
    fn build(
        number: usize,
        parents: &[usize],
        make: &dyn Fn(usize, Vec<Item>) -> Item,
    ) -> Vec<Item> {
        (1..=parents.len())
            .filter(|child| parents[child - 1] == number)
            .map(|child| make(child, build(child, parents, make)))
            .collect()
    }
    let make = |number: usize, items: Vec<Item>| {
        let role = if is_final(number) { StepRole::Final } else { StepRole::Plain };
        let step =
            Step { name: name(&format!("s{number}")), role, meta: meta(), ..Step::default() };
        let mut state = State { step, is_parallel: is_parallel(number), items, ..State::default() };
        if has_children(number) {
            state.histories.push(History {
                name: name("H"),
                is_deep: states[number - 1].2,
                meta: meta(),
                ..History::default()
            });
        }
        Item::State(state)
    };
    let mut items = build(0, &parents, &make);
    for (from, to, by_history) in transitions {
        let (from, to) = (from.index(states.len()) + 1, to.index(states.len()) + 1);
        if is_final(from) {
            continue;
        }
        let target =
            if *by_history && has_children(to) { format!("{}.H", full(to)) } else { full(to) };
        items.push(Item::Transition(Transition {
            events: vec![name("E")],
            ..arrow(&format!("{} -> {target}", full(from)), None)
        }));
    }
    design(vec![chart("c", vec![vec![conflict(Policy::InnerFirst), event("E")], items])])
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 100, ..ProptestConfig::default() })]

    /// A chart without errors has a net, and the net's text parses back to it.
    #[test]
    fn sound_charts_have_nets(design in sound()) {
        let (net, found) = lower(&design);
        prop_assert!(net.is_some(), "{:#?}", found.iter().filter(|one| one.is_error()).collect::<Vec<_>>());
        let printed = text::print(&net.unwrap());
        let (back, problems) = text::parse(FileId(0), &printed);
        prop_assert!(problems.is_empty(), "{:?}\n{}", problems, printed);
        prop_assert_eq!(text::print(&back.unwrap()), printed);
    }

    /// For any transitions between the states of a tree, each transition leaves one domain and enters a complete configuration: validation agrees.
    #[test]
    fn statecharts_of_any_shape_have_nets((states, transitions) in statechart()) {
        let (net, found) = lower(&grown(&states, &transitions));
        prop_assert!(net.is_some(), "{:#?}", found);
    }
}

#[test]
fn every_pass_can_be_looked_into() {
    let design = design(vec![chart("c", vec![vec![single()], vec![initial("p", vec![])]])]);
    for pass in passes() {
        assert!(dump_after(&design, &TaskCosts::default(), pass).is_some(), "{pass}");
    }
    assert!(dump_after(&design, &TaskCosts::default(), "unknown").is_none());
}
