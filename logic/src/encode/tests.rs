//! Small programs, encoded and compared with expectations made by hand.

use super::{EncodeOptions, encode};
use crate::chip::ChipSim;
use crate::codes;
use crate::minimise::{Budget, sum_of_products};
use crate::node_bdds::Var;
use grafsynth_ir::Span;
use grafsynth_ir::arena::Id;
use grafsynth_ir::expr::{ArithOp, CompareOp, Expr, Type};
use grafsynth_ir::facts::{Facts, Invariant, Proof, Proved};
use grafsynth_ir::logic::{Logic, PinRole};
use grafsynth_ir::net::*;
use grafsynth_ir::program::{
    Cell, Leaf, Origin, Program, ResetEffect, Stmt, Temp, TempId, TempRole,
};
use grafsynth_ir::span::Name;
use grafsynth_ir::validate::{Valid, validate};

type PExpr = Expr<Leaf>;

fn name(text: &str) -> Name {
    Name::new(text, Span::default())
}

fn input(text: &str) -> Input {
    Input {
        name: name(text),
        ty: Type::Bool,
        kind: InputKind::Pin,
        synchronous: true,
        meta: Meta::default(),
    }
}

fn output(text: &str, ty: Type, driver: Driver) -> Output {
    Output { name: name(text), ty, driver, safe: None, registered: false, meta: Meta::default() }
}

fn step(text: &str, is_initial: bool) -> Step {
    Step { is_initial, ..Step::new(name(text), Id::from_index(0)) }
}

fn transition(text: &str, from: usize, to: usize, guard: usize) -> Transition {
    let (from, to) = (Id::from_index(from), Id::from_index(to));
    Transition {
        name: name(text),
        part: Id::from_index(0),
        kind: TransitionKind::Move,
        requires: vec![from],
        clears: vec![from],
        enters: vec![Enter::Step(to)],
        events: vec![],
        guard: Expr::leaf(grafsynth_ir::net::Leaf::Input(Id::from_index(guard)), Span::default()),
        priority: None,
        restart: false,
        actions: vec![],
        deadline_ns: None,
        meta: Meta::default(),
    }
}

fn at(leaf: Leaf) -> PExpr {
    Expr::leaf(leaf, Span::default())
}

fn cell(index: usize) -> Leaf {
    Leaf::Cell(Id::from_index(index))
}

fn bool_cell(text: &str, init: bool, origin: Origin) -> Cell {
    Cell { name: text.into(), ty: Type::Bool, len: None, init: vec![i64::from(init)], origin }
}

/// A ring of `n` steps, with one input and one output each: net and program, as the lowering makes them.
fn ring(n: usize) -> (Valid<Net>, Program) {
    let mut net = Net { name: name("ring"), ..Net::default() };
    net.parts.push(Part { name: name("ring"), level: 1, ..Part::default() });
    let mut program = Program { reset_outputs: vec![0; n], ..Program::default() };
    for k in 0..n {
        net.inputs.push(input(&format!("i{k}")));
        let emission = Emission { step: Id::from_index(k), condition: None, span: Span::default() };
        net.outputs.push(output(&format!("o{k}"), Type::Bool, Driver::Continuous(vec![emission])));
        net.steps.push(step(&format!("p{k}"), k == 0));
        net.transitions.push(transition(&format!("t{k}"), k, (k + 1) % n, k));
        program.cells.push(bool_cell(&format!("p{k}"), k == 0, Origin::Step(Id::from_index(k))));
    }
    program.reset_outputs[0] = 1;
    let temp = |program: &mut Program, role| {
        program.temps.push(Temp { name: "t".into(), ty: Type::Bool, role })
    };
    let mut fires: Vec<TempId> = Vec::new();
    for k in 0..n {
        let fire = temp(&mut program, TempRole::Fire(Id::from_index(k)));
        fires.push(fire);
        program
            .body
            .push(Stmt::Set(fire, Expr::and([at(cell(k)), at(Leaf::Input(Id::from_index(k)))])));
    }
    for k in 0..n {
        let next = temp(&mut program, TempRole::NextActive(Id::from_index(k)));
        let hold = Expr::and([at(cell(k)), at(Leaf::Temp(fires[k])).not()]);
        let enter = at(Leaf::Temp(fires[(k + n - 1) % n]));
        program.body.push(Stmt::Set(next, Expr::or([enter, hold])));
    }
    for k in 0..n {
        program.body.push(Stmt::Store(
            Id::from_index(k),
            None,
            at(Leaf::Temp(Id::from_index(n + k))),
        ));
    }
    for k in 0..n {
        program.body.push(Stmt::Output(Id::from_index(k), at(cell(k))));
    }
    (validate(net).unwrap(), program)
}

fn encoded(net: &Valid<Net>, program: &Program) -> Logic {
    encode(net, program, &Facts::default(), &EncodeOptions::default()).unwrap()
}

#[test]
fn the_truck_has_the_equations_of_the_paper() {
    let (net, program) = ring(4);
    let logic = encoded(&net, &program);
    let wires: Vec<&str> = logic.wires.iter().map(|wire| wire.name.as_str()).collect();
    assert_eq!(wires, ["fire_t0", "fire_t1", "fire_t2", "fire_t3"]);
    for (id, flop) in logic.flops.iter() {
        // Two products: enter and hold.
        let sum = sum_of_products(&logic, flop.next, false, false, Budget::default()).unwrap();
        let before = Id::from_index((id.index() + 3) % 4);
        let mut want = vec![
            vec![(Var::Flop(id), true), (Var::Input(Id::from_index(id.index())), false)],
            vec![(Var::Flop(before), true), (Var::Input(Id::from_index(before.index())), true)],
        ];
        want.sort_unstable();
        let mut sum = sum;
        sum.sort_unstable();
        assert_eq!(sum, want, "{}", flop.name);
    }
    for (id, output) in logic.outputs.iter() {
        assert_eq!(output.registered, None);
        let sum = sum_of_products(&logic, output.value, false, false, Budget::default()).unwrap();
        assert_eq!(sum, vec![vec![(Var::Flop(Id::from_index(id.index())), true)]]);
    }
    let mut chip = ChipSim::new(&net, &logic);
    let situation = |chip: &ChipSim<'_>| {
        (0..4).filter(|&k| chip.is_active(Id::from_index(k)) == Some(true)).collect::<Vec<_>>()
    };
    assert_eq!(situation(&chip), [0]);
    for (row, want) in [
        ([0, 0, 0, 0], 0),
        ([1, 1, 0, 0], 1),
        ([1, 0, 1, 1], 1),
        ([0, 1, 0, 0], 2),
        ([0, 0, 1, 0], 3),
        ([0, 0, 0, 1], 0),
    ] {
        chip.react(&row, 1).unwrap();
        assert_eq!(situation(&chip), [want]);
        assert_eq!(chip.output(Id::from_index(want)), Some(1));
    }
    assert!(chip.react(&[0; 4], 2).is_err());
}

#[test]
fn ten_thousand_steps_cost_a_handful_of_nodes_each() {
    let (net, program) = ring(10_000);
    let logic = encoded(&net, &program);
    // Input, flip-flop, fire, not fire, hold, next.
    assert_eq!(logic.nodes.len(), 60_000);
}

/// A counter with a saturating range, a timer, a stored output of three bits and a strobe.
fn counter() -> (Valid<Net>, Program) {
    let mut net = Net { name: name("count"), ..Net::default() };
    net.parts.push(Part { name: name("part"), level: 1, ..Part::default() });
    net.steps.push(step("s", true));
    net.inputs.push(input("up"));
    net.inputs.push(Input { ty: Type::Int { lo: -1, hi: 3 }, ..input("by") });
    let ty = Type::Int { lo: 2, hi: 7 };
    let var = net.vars.push(grafsynth_ir::net::Var {
        name: name("n"),
        ty,
        len: None,
        init: vec![4],
        origin: VarOrigin::StoredOutput,
        meta: Meta::default(),
    });
    net.outputs.push(output("n", ty, Driver::Stored(var)));
    net.outputs.push(output("beep", Type::Bool, Driver::Extern { params: vec![], calls: vec![] }));
    let mut program = Program { reset_outputs: vec![4, 0], ..Program::default() };
    program.cells.push(Cell {
        name: "n".into(),
        ty,
        len: None,
        init: vec![4],
        origin: Origin::Var(var),
    });
    let timer = Type::Int { lo: 0, hi: 3 };
    let origin = Origin::Elapsed(Id::from_index(0));
    program.cells.push(Cell { name: "s_t".into(), ty: timer, len: None, init: vec![0], origin });
    let arith = |op, a, b| {
        Expr::new(
            grafsynth_ir::expr::ExprKind::Arith(op, Box::new(a), Box::new(b)),
            Span::default(),
        )
    };
    let grown = arith(ArithOp::Add, at(cell(1)), at(Leaf::Dt));
    program.body.push(Stmt::Store(Id::from_index(1), None, grown));
    let add = arith(ArithOp::Add, at(cell(0)), at(Leaf::Input(Id::from_index(1))));
    let sub = arith(ArithOp::Sub, at(cell(0)), Expr::int(1));
    program.body.push(Stmt::If(
        at(Leaf::Input(Id::from_index(0))),
        vec![Stmt::Store(Id::from_index(0), None, add)],
        vec![Stmt::If(
            Expr::compare(CompareOp::Ge, at(cell(1)), Expr::int(2)),
            vec![
                Stmt::Store(Id::from_index(0), None, sub),
                Stmt::Store(Id::from_index(1), None, Expr::int(0)),
                Stmt::Call(Id::from_index(1), vec![]),
            ],
            vec![],
        )],
    ));
    program.body.push(Stmt::Output(Id::from_index(0), at(cell(0))));
    (validate(net).unwrap(), program)
}

#[test]
fn counters_saturate_and_strobes_show_the_call() {
    let (net, program) = counter();
    let logic = encoded(&net, &program);
    assert!(logic.inputs.values().any(|input| input.role == PinRole::Tick));
    // Codes 5, 6 and 7 of `by` are beyond 3.
    assert_eq!(logic.never.len(), 1);
    let mut chip = ChipSim::new(&net, &logic);
    let (n, beep) = (Id::from_index(0), Id::from_index(1));
    assert_eq!(
        (chip.output(n), chip.output(beep), chip.var(Id::from_index(0), 0)),
        (Some(4), Some(0), Some(4))
    );
    let (mut value, mut timer) = (4i64, 0i64);
    for row in 0..200i64 {
        let (up, by, dt) = (i64::from(row % 7 < 2), row % 5 - 1, row % 3 % 2);
        chip.react(&[up, by], dt.unsigned_abs()).unwrap();
        timer = (timer + dt).min(3);
        let mut called = 0;
        if up == 1 {
            value = (value + by).clamp(2, 7);
        } else if timer >= 2 {
            value = (value - 1).clamp(2, 7);
            timer = 0;
            called = 1;
        }
        assert_eq!((chip.output(n), chip.output(beep)), (Some(value), Some(called)), "row {row}");
        assert_eq!(chip.code(Origin::Elapsed(Id::from_index(0)), 0), Some(timer.unsigned_abs()));
    }
}

#[test]
fn outputs_of_the_new_situation_are_combinational_and_others_get_a_register() {
    let (net, program) = counter();
    let logic = encoded(&net, &program);
    let registered: Vec<(&str, Option<bool>)> =
        logic.outputs.values().map(|o| (o.name.as_str(), o.registered)).collect();
    assert_eq!(registered, [("n_0", None), ("n_1", None), ("n_2", None), ("beep", Some(false))]);
}

#[test]
fn arrays_are_bits_and_their_index_a_choice() {
    // v[i] := v[j] + 1 over four elements of 0..5.
    let mut net = Net { name: name("array"), ..Net::default() };
    net.parts.push(Part { name: name("part"), level: 1, ..Part::default() });
    net.steps.push(step("s", true));
    let index = Type::Int { lo: 0, hi: 3 };
    net.inputs.push(Input { ty: index, ..input("i") });
    net.inputs.push(Input { ty: index, ..input("j") });
    let ty = Type::Int { lo: 0, hi: 5 };
    net.vars.push(grafsynth_ir::net::Var {
        name: name("v"),
        ty,
        len: Some(4),
        init: vec![0, 1, 2, 3],
        origin: VarOrigin::Declared,
        meta: Meta::default(),
    });
    let net = validate(net).unwrap();
    let mut program = Program::default();
    program.cells.push(Cell {
        name: "v".into(),
        ty,
        len: Some(4),
        init: vec![0, 1, 2, 3],
        origin: Origin::Var(Id::from_index(0)),
    });
    let element = Expr::new(
        grafsynth_ir::expr::ExprKind::Element(
            cell(0),
            Box::new(at(Leaf::Input(Id::from_index(1)))),
        ),
        Span::default(),
    );
    let sum = Expr::new(
        grafsynth_ir::expr::ExprKind::Arith(
            ArithOp::Add,
            Box::new(element),
            Box::new(Expr::int(1)),
        ),
        Span::default(),
    );
    program.body.push(Stmt::Store(
        Id::from_index(0),
        Some(at(Leaf::Input(Id::from_index(0)))),
        sum,
    ));
    let logic = encoded(&net, &program);
    let mut chip = ChipSim::new(&net, &logic);
    let mut model = [0i64, 1, 2, 3];
    for row in 0..64usize {
        let (i, j) = (row * 7 % 4, row / 3 % 4);
        chip.react(&[i as i64, j as i64], 0).unwrap();
        model[i] = (model[j] + 1).min(5);
        for (k, &value) in model.iter().enumerate() {
            assert_eq!(chip.var(Id::from_index(0), k as u32), Some(value), "row {row}");
        }
    }
}

#[test]
fn micro_steps_are_unrolled_as_deep_as_proved() {
    // Count a counter down to 0 in one reaction; three rounds are enough from 3.
    let mut net = Net { name: name("down"), ..Net::default() };
    net.settings.evolution = Evolution::Stable { limit: 40 };
    net.parts.push(Part { name: name("part"), level: 1, ..Part::default() });
    net.steps.push(step("s", true));
    net.inputs.push(Input { ty: Type::Int { lo: 0, hi: 3 }, ..input("start") });
    let ty = Type::Int { lo: 0, hi: 3 };
    net.vars.push(grafsynth_ir::net::Var {
        name: name("n"),
        ty,
        len: None,
        init: vec![0],
        origin: VarOrigin::Declared,
        meta: Meta::default(),
    });
    let net = validate(net).unwrap();
    let mut program = Program::default();
    program.cells.push(Cell {
        name: "n".into(),
        ty,
        len: None,
        init: vec![0],
        origin: Origin::Var(Id::from_index(0)),
    });
    program.cells.push(Cell {
        name: "rounds".into(),
        ty,
        len: None,
        init: vec![0],
        origin: Origin::Helper,
    });
    let plus = |a: PExpr, by| {
        Expr::new(
            grafsynth_ir::expr::ExprKind::Arith(ArithOp::Add, Box::new(a), Box::new(Expr::int(by))),
            Span::default(),
        )
    };
    let more = Expr::compare(CompareOp::Gt, at(cell(0)), Expr::int(0));
    program.body = vec![
        Stmt::Store(Id::from_index(0), None, at(Leaf::Input(Id::from_index(0)))),
        Stmt::Store(Id::from_index(1), None, Expr::int(0)),
        Stmt::Repeat {
            limit: 40,
            condition: more.clone(),
            body: vec![
                Stmt::Store(Id::from_index(0), None, plus(at(cell(0)), -1)),
                Stmt::Store(Id::from_index(1), None, plus(at(cell(1)), 1)),
            ],
        },
        Stmt::Fault(more),
    ];
    let unproved = encoded(&net, &program);
    let facts =
        Facts { stable_depth: Some(Proved { value: 3, by: Proof::Explicit }), ..Facts::default() };
    let proved = encode(&net, &program, &facts, &EncodeOptions::default()).unwrap();
    assert!(proved.outputs.is_empty() && !unproved.outputs.is_empty());
    assert!(proved.nodes.len() < unproved.nodes.len());
    for logic in [&unproved, &proved] {
        let mut chip = ChipSim::new(&net, logic);
        for start in [3, 0, 2, 1] {
            chip.react(&[start], 1).unwrap();
            assert_eq!(
                (chip.var(Id::from_index(0), 0), chip.code(Origin::Helper, 0), chip.fault()),
                (Some(0), Some(start.unsigned_abs()), false)
            );
        }
    }
    let small = EncodeOptions { max_nodes: 50, ..EncodeOptions::default() };
    assert_eq!(
        encode(&net, &program, &Facts::default(), &small).unwrap_err()[0].code,
        codes::TOO_LARGE
    );
}

/// Two steps that call one action each.
fn two_calls() -> (Valid<Net>, Program) {
    let (net, mut program) = ring(2);
    let mut net = net.into_inner();
    let beep = net.outputs.push(output(
        "beep",
        Type::Bool,
        Driver::Extern { params: vec![], calls: vec![] },
    ));
    program.reset_outputs.push(0);
    program.reset_effects.push(ResetEffect::Call(beep, vec![]));
    for k in 0..2 {
        program.body.push(Stmt::If(at(cell(k)), vec![Stmt::Call(beep, vec![])], vec![]));
    }
    (validate(net).unwrap(), program)
}

#[test]
fn a_strobe_may_pulse_once_only() {
    let (net, program) = two_calls();
    let twice = encode(&net, &program, &Facts::default(), &EncodeOptions::default()).unwrap_err();
    assert_eq!(twice[0].code, codes::CALLED_TWICE);
    // With the invariant only one of them can call. The pin is then a function of the new situation.
    let steps = vec![Id::from_index(0), Id::from_index(1)];
    let facts = Facts {
        invariants: vec![Invariant { steps, count: 1, by: Proof::Structural }],
        ..Facts::default()
    };
    let logic = encode(&net, &program, &facts, &EncodeOptions::default()).unwrap();
    let pin = logic.outputs.values().find(|output| output.name == "beep").unwrap();
    assert_eq!(pin.registered, None);
    let mut chip = ChipSim::new(&net, &logic);
    assert_eq!(chip.output(Id::from_index(2)), Some(1));
    chip.react(&[1, 0], 0).unwrap();
    assert_eq!(chip.output(Id::from_index(2)), Some(1));
}

#[test]
fn what_a_chip_cannot_do_is_refused_all_at_once() {
    let (net, mut program) = ring(2);
    let mut net = net.into_inner();
    let text = Verbatim { language: "c".into(), text: "x();".into() };
    net.steps[Id::from_index(0)].code.push(text.clone());
    let speed = net.outputs.push(output(
        "speed",
        Type::Bool,
        Driver::Extern { params: vec![], calls: vec![] },
    ));
    let net = validate(net).unwrap();
    program.body.push(Stmt::Call(speed, vec![Expr::int(3)]));
    program.body.push(Stmt::Code(text));
    let found = encode(&net, &program, &Facts::default(), &EncodeOptions::default()).unwrap_err();
    let found: Vec<_> = found.iter().map(|diagnostic| diagnostic.code).collect();
    assert_eq!(found, [codes::CALL_ARGUMENTS, codes::VERBATIM]);
}
