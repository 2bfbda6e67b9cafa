//! Tests of expressions, times, outputs and lists.

use super::build::*;
use crate::chart::{ActionHow, DeclarationKind, Item, Length, StepItemKind, Transition};
use crate::expr::{CompareOp, ExprKind, Type};
use crate::lower::properties;
use crate::net::{Driver, Leaf, Net, Qualifier, VarOrigin};
use itertools::Itertools as _;

/// An expression as one line, for comparisons.
fn show(net: &Net, expr: &crate::net::Expr) -> String {
    let join = |all: &[crate::net::Expr], sep: &str| {
        format!("({})", all.iter().map(|one| show(net, one)).join(sep))
    };
    match &expr.kind {
        ExprKind::Bool(value) => value.to_string(),
        ExprKind::Int(value) => value.to_string(),
        ExprKind::Leaf(leaf) => match *leaf {
            Leaf::Input(id) => net.inputs[id].name.text.clone(),
            Leaf::Var(id) => net.vars[id].name.text.clone(),
            Leaf::Active(id) => format!("{}.active", net.steps[id].name),
            Leaf::Elapsed(id) => format!("{}.t", net.steps[id].name),
            Leaf::LastElapsed(id) => format!("{}.T", net.steps[id].name),
            Leaf::TasksDone(id) => format!("{}.done", net.steps[id].name),
            Leaf::Timer(id) => net.timers[id].name.text.clone(),
            Leaf::Rise(id) => format!("rise{}", show(net, &net.edges[id].expr)),
            Leaf::Fall(id) => format!("fall{}", show(net, &net.edges[id].expr)),
            Leaf::Fireable(id) => format!("fireable {}", net.transitions[id].name),
            Leaf::Controlled(id) => format!("Q {}", net.actions[id].name),
        },
        ExprKind::Element(_, index) => format!("[{}]", show(net, index)),
        ExprKind::Not(a) => format!("not {}", show(net, a)),
        ExprKind::And(all) => join(all, " and "),
        ExprKind::Or(all) => join(all, " or "),
        ExprKind::Compare(op, a, b) => format!("{} {} {}", show(net, a), op.symbol(), show(net, b)),
        ExprKind::Neg(a) => format!("-{}", show(net, a)),
        ExprKind::Arith(op, a, b) => format!("({} {} {})", show(net, a), op.symbol(), show(net, b)),
        ExprKind::Select(c, a, b) => {
            format!("select({}, {}, {})", show(net, c), show(net, a), show(net, b))
        }
    }
}

/// The lowered receptivity of a condition between two steps p and q.
fn guard(extra: Vec<Item>, condition: crate::chart::Expr) -> (String, Net) {
    let net = clean(vec![
        vec![single()],
        inputs("a"),
        extra,
        vec![
            initial("p", vec![]),
            step("q", vec![]),
            go("p -> q", condition),
            go("q -> p", v("a")),
        ],
    ]);
    let text = show(&net, &net.transitions.values().next().unwrap().guard);
    (text, net)
}

#[test]
fn times_become_ticks_with_the_time_on_the_left() {
    assert_eq!(guard(vec![], ge("p.t", "3s")).0, "p.t >= 300");
    assert_eq!(guard(vec![], lt("30ms", "p.t")).0, "p.t > 3");
    assert_eq!(guard(vec![], ge("p.t", "7")).0, "p.t >= 7");
    assert_eq!(guard(vec![constant("D", v("1s"))], ge("p.t", "D")).0, "p.t >= 100");
    let timer = declare("T", DeclarationKind::Timer { condition: v("a") });
    assert_eq!(guard(vec![timer], ge("T", "1s")).0, "T >= 100");
}

#[test]
fn after_takes_the_name_of_a_duration() {
    let limit = declare("LIMIT", DeclarationKind::Const { value: v("30ms") });
    let length = Length::Named(path("LIMIT"));
    let transition = Transition { after: Some((length, span())), ..arrow("p -> q", None) };
    let (p, q) = (initial("p", vec![]), step("q", vec![]));
    let net = clean(vec![vec![
        single(),
        limit,
        p,
        q,
        Item::Transition(transition),
        go("q -> p", v("p.active")),
    ]]);
    assert_eq!(show(&net, &net.transitions.values().next().unwrap().guard), "p.t >= 3");
}

/// §3.5: L and D of one action may have several durations; each additional duration gives a separate action, declared before it.
#[test]
fn further_durations_of_an_action_have_timers_of_their_own() {
    let timed = |ns| act("R", ActionHow::Qualified(Qualifier::L, Some(ns)), None);
    let set = act("R", ActionHow::Qualified(Qualifier::S, None), None);
    let net = clean(vec![
        vec![single(), output("R")],
        inputs("a"),
        vec![
            initial("p", vec![timed(20_000_000)]),
            step("q", vec![timed(30_000_000)]),
            step("r", vec![set]),
            go("p -> q", v("a")),
            go("q -> r", v("a")),
            go("r -> p", v("a")),
        ],
    ]);
    let actions: Vec<(&str, u32, Vec<Qualifier>)> = net
        .actions
        .values()
        .map(|one| {
            let uses = one.uses.iter().map(|one| one.qualifier).collect();
            (one.name.text.as_str(), one.duration, uses)
        })
        .collect();
    assert_eq!(
        actions,
        [
            ("R_timed", 3, vec![Qualifier::L]),
            ("R", 2, vec![Qualifier::L, Qualifier::N, Qualifier::S])
        ]
    );
}

#[test]
fn after_asks_every_source() {
    let transition = Transition {
        after: Some((Length::Ns(20_000_000), span())),
        restart: true,
        ..arrow("p & q -> p & q", Some(v("a")))
    };
    let net = clean(vec![
        vec![single()],
        inputs("a"),
        vec![initial("p", vec![]), initial("q", vec![]), Item::Transition(transition)],
    ]);
    assert_eq!(
        show(&net, &net.transitions.values().next().unwrap().guard),
        "(a and p.t >= 2 and q.t >= 2)"
    );
}

#[test]
fn equal_edges_share_an_operand() {
    let (text, net) =
        guard(vec![], or(vec![rise(v("a")), and(vec![rise(v("a")), rise(v("q.active"))])]));
    assert_eq!(text, "(risea or (risea and riseq.active))");
    assert_eq!(net.edges.len(), 2);
}

#[test]
fn the_delay_operator_is_two_timers() {
    let (text, net) = guard(vec![], or(vec![delay(20, v("a"), 50), delay(20, v("a"), 50)]));
    assert_eq!(text, "((a and a_on_delay >= 2) or a_off_delay < 5 or (a and a_on_delay >= 2) or a_off_delay < 5)".replace("(a and a_on_delay >= 2) or a_off_delay < 5 or (a and a_on_delay >= 2) or a_off_delay < 5", "((a and a_on_delay >= 2) or a_off_delay < 5) or ((a and a_on_delay >= 2) or a_off_delay < 5)"));
    let timers: Vec<_> = net.timers.values().collect();
    assert_eq!(timers.len(), 2, "equal delays share their timers");
    assert_eq!((timers[0].starts_expired, timers[1].starts_expired), (false, true));
    assert_eq!(show(&net, &timers[1].condition), "not (a and a_on_delay >= 2)");
    assert_eq!(guard(vec![], delay(20, v("a"), 0)).0, "(a and a_on_delay >= 2)");
}

#[test]
fn the_time_of_a_macro_step_is_a_timer_that_counts_while_it_is_active() {
    let macro_ = macro_of("f", vec![step_of("e", crate::chart::StepRole::MacroEntryExit, vec![])]);
    let net = clean(vec![
        vec![single()],
        vec![
            macro_,
            initial("p", vec![]),
            macro_step("m", "f"),
            go("p -> m", lt("m.t", "1s")),
            go("m -> p", ge("m.t", "1s")),
        ],
    ]);
    let guards: Vec<String> = net.transitions.values().map(|one| show(&net, &one.guard)).collect();
    assert_eq!(guards, ["(not m.e.active or m_time < 100)", "(m.e.active and m_time >= 100)"]);
}

#[test]
fn constants_are_values() {
    let items =
        vec![constant("N", v("5")), constant("M", plus(v("N"), v("1"))), var("n", int(0, 9))];
    assert_eq!(guard(items, ge("n", "M")).0, "n >= 6");
}

#[test]
fn done_of_a_step_without_tasks_is_its_bit() {
    assert_eq!(guard(vec![], v("p.done")).0, "p.active");
}

fn chart_with(outputs: Vec<Item>, body: Vec<crate::chart::StepItem>) -> Net {
    clean(vec![
        vec![single()],
        inputs("a"),
        outputs,
        vec![initial("p", vec![]), step("q", body), go("p -> q", v("a")), go("q -> p", v("a"))],
    ])
}

#[test]
fn timed_actions_are_continuous_until_a_qualifier_controls_the_output() {
    let body = || {
        vec![
            act("R", ActionHow::After(20_000_000), Some(v("a"))),
            act("R", ActionHow::For(50_000_000), None),
        ]
    };
    let net = chart_with(vec![output("R")], body());
    let Driver::Continuous(emissions) = &net.outputs.values().next().unwrap().driver else {
        panic!()
    };
    let conditions: Vec<String> =
        emissions.iter().map(|one| show(&net, one.condition.as_ref().unwrap())).collect();
    assert_eq!(conditions, ["(a and q.t >= 2)", "q.t < 5"]);

    let body = vec![
        act("R", ActionHow::After(20_000_000), Some(v("a"))),
        act("R", ActionHow::Qualified(Qualifier::S, None), None),
    ];
    let net = chart_with(vec![output("R")], body);
    let Driver::Controlled(action) = net.outputs.values().next().unwrap().driver else { panic!() };
    let action = &net.actions[action];
    assert_eq!(action.duration, 2);
    let qualifiers: Vec<_> = action.uses.iter().map(|one| one.qualifier).collect();
    assert_eq!(qualifiers, [Qualifier::D, Qualifier::S]);
}

#[test]
fn an_assigned_output_is_a_variable_of_its_own() {
    let body = vec![item(StepItemKind::Entry(vec![assign("N", plus(v("N"), v("1")))]))];
    let net = chart_with(vec![output_of("N", int(0, 9), false)], body);
    assert!(matches!(net.outputs.values().next().unwrap().driver, Driver::Stored(_)));
    assert_eq!(net.vars.values().next().unwrap().origin, VarOrigin::StoredOutput);
}

#[test]
fn extern_actions_are_calls_or_controlled() {
    let speed = || {
        declare("speed", DeclarationKind::ExternAction { params: vec![("v".into(), int(0, 9))] })
    };
    let net = chart_with(vec![speed()], vec![call_of("speed", vec![v("5")])]);
    let Driver::Extern { calls, .. } = &net.outputs.values().next().unwrap().driver else {
        panic!()
    };
    assert_eq!((calls.len(), calls[0].arguments.len()), (1, 1));
    let pulse = |n: &str| {
        item(StepItemKind::Action {
            target: name("speed"),
            arguments: Some(vec![v(n)]),
            how: ActionHow::Qualified(Qualifier::P, None),
            condition: None,
        })
    };
    let net = chart_with(vec![speed()], vec![pulse("1"), pulse("2"), pulse("1")]);
    let uses: Vec<_> = net
        .actions
        .values()
        .map(|one| (one.name.text.as_str(), one.uses.len(), one.body.len()))
        .collect();
    assert_eq!(uses, [("speed", 2, 1), ("speed_2", 1, 1)]);
}

#[test]
fn initial_values_are_checked_and_spread() {
    let array = |init| declare("t", DeclarationKind::Var { ty: int(1, 9), len: Some(3), init });
    let init = |init| {
        let net = guard(
            vec![array(init)],
            not(e(ExprKind::Compare(
                CompareOp::Eq,
                Box::new(element("t", v("0"))),
                Box::new(v("2")),
            ))),
        )
        .1;
        net.vars.values().next().unwrap().init.clone()
    };
    assert_eq!(init(vec![]), [1, 1, 1], "the bound nearest to 0");
    assert_eq!(init(vec![v("4")]), [4, 4, 4]);
    assert_eq!(init(vec![v("1"), v("2"), v("3")]), [1, 2, 3]);
}

#[test]
fn properties_are_added_to_a_finished_net_by_full_names() {
    let net = clean(vec![
        vec![single()],
        inputs("a"),
        vec![output("R"), output("L")],
        vec![
            initial("p", vec![action("R")]),
            step("q", vec![action("L")]),
            go("p -> q", v("a")),
            go("q -> p", v("a")),
        ],
    ]);
    let never = |expr| vec![assert_never(expr)];
    let found = properties(&net, &never(and(vec![v("R"), v("c.q.active"), ge("p.t", "1s")])));
    assert_eq!(found.map(|all| all.len()), Ok(1));
    let found = properties(&net, &never(and(vec![v("R"), v("LL"), rise(v("a")), v("p")])));
    assert_eq!(
        told(&found.unwrap_err()),
        [
            "G0201 unknown name `LL`",
            "G0213 an edge is not allowed in a property",
            "G0203 step `p` cannot be used as a value"
        ]
    );
}

#[test]
fn a_property_may_ask_whether_an_extern_action_is_called() {
    let go_ = declare("fw", DeclarationKind::ExternAction { params: vec![] });
    let speed =
        declare("speed", DeclarationKind::ExternAction { params: vec![("v".into(), int(0, 9))] });
    let net = chart_with(vec![go_, speed], vec![action("fw"), call_of("speed", vec![v("5")])]);
    assert_eq!(properties(&net, &[assert_never(v("fw"))]).map(|all| all.len()), Ok(1));
    let found = properties(&net, &[assert_never(v("speed"))]).unwrap_err();
    assert_eq!(told(&found), ["G0203 `speed` is an extern action, not a value"]);
}

#[test]
fn a_bool_var_may_start_at_a_number() {
    let items =
        vec![declare("n", DeclarationKind::Var { ty: Type::Bool, len: None, init: vec![v("1")] })];
    assert_eq!(guard(items, v("n")).1.vars.values().next().unwrap().init, [1]);
}
