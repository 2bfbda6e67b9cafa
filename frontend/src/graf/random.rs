//! Random designs for the tests, with almost every form of the language. Their text can be parsed again.

use grafsynth_ir::chart::*;
use grafsynth_ir::expr::{ArithOp, CompareOp, ExprKind, Type};
use grafsynth_ir::net::{Meta, Policy, Qualifier, SHARINGS, Schedule, Verbatim};
use grafsynth_ir::{Name, Span};

/// Random choices.
pub(crate) struct Random(grafsynth_ir::random::Random);

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Random(grafsynth_ir::random::Random::new(seed))
    }

    pub(crate) fn below(&mut self, n: usize) -> usize {
        self.0.below(n)
    }

    pub(crate) fn chance(&mut self, percent: usize) -> bool {
        self.below(100) < percent
    }

    pub(crate) fn pick<T: Clone>(&mut self, from: &[T]) -> T {
        from[self.below(from.len())].clone()
    }

    fn some<T>(&mut self, percent: usize, make: impl FnOnce(&mut Self) -> T) -> Option<T> {
        if self.chance(percent) { Some(make(self)) } else { None }
    }

    fn list<T>(&mut self, most: usize, mut make: impl FnMut(&mut Self) -> T) -> Vec<T> {
        (0..self.below(most + 1)).map(|_| make(self)).collect()
    }
}

const TRUTHS: &[&str] =
    &["a", "b", "é", "on", "and", "a b", "rise", "step", "mod", "then", "x.y", "T1", "s"];
const NUMBERS: &[&str] = &["n", "k", "count", "1"];
const STEPS: &[&str] = &[
    "p1", "p2", "when", "on", "do", "after", "chart", "if", "assert", "3", "é", "restart", "macro",
    "step",
];

fn name(text: &str) -> Name {
    Name::new(text, Span::default())
}

fn one(text: &str) -> Path {
    Path::from(name(text))
}

fn leaf(leaf: Leaf) -> Expr {
    Expr::leaf(leaf, Span::default())
}

fn expr(kind: ExprKind<Leaf>) -> Expr {
    Expr::new(kind, Span::default())
}

fn meta(r: &mut Random) -> Meta {
    Meta {
        span: Span::default(),
        label: if r.chance(20) {
            r.pick(&["waiting", "a \"b\" \\ \n", "é"]).to_owned()
        } else {
            String::new()
        },
        req: if r.chance(15) {
            r.list(2, |r| r.pick(&["R1", "R12"]).to_owned())
        } else {
            Vec::new()
        },
    }
}

pub(crate) fn truth(r: &mut Random, depth: usize) -> Expr {
    let kind = if depth == 0 { r.below(4) } else { r.below(13) };
    let junction = |r: &mut Random| -> Vec<Expr> {
        (0..2 + r.below(3)).map(|_| truth(r, depth - 1)).collect()
    };
    match kind {
        0..=2 => leaf(Leaf::Name(one(r.pick::<&str>(TRUTHS)))),
        3 => match r.below(3) {
            0 => expr(ExprKind::Bool(r.chance(50))),
            1 => leaf(Leaf::Otherwise),
            _ => {
                leaf(Leaf::Name(Path { names: vec![name(r.pick::<&str>(STEPS)), name("active")] }))
            }
        },
        4 => expr(ExprKind::Not(Box::new(truth(r, depth - 1)))),
        5 | 6 => expr(ExprKind::And(junction(r))),
        7 | 8 => expr(ExprKind::Or(junction(r))),
        9 => {
            let op = r.pick(&[
                CompareOp::Eq,
                CompareOp::Ne,
                CompareOp::Lt,
                CompareOp::Le,
                CompareOp::Gt,
                CompareOp::Ge,
            ]);
            if r.chance(20) {
                let path = Path { names: vec![name(r.pick::<&str>(STEPS)), name("t")] };
                let duration = leaf(Leaf::Duration(r.pick(&[
                    1,
                    1_500,
                    10_000_000,
                    3_000_000_000,
                    60_000_000_000,
                ])));
                return Expr::compare(op, leaf(Leaf::Name(path)), duration);
            }
            Expr::compare(op, number(r, depth - 1), number(r, depth - 1))
        }
        10 => Expr::compare(
            r.pick(&[CompareOp::Eq, CompareOp::Ne]),
            truth(r, depth - 1),
            truth(r, depth - 1),
        ),
        11 => {
            let inner = Box::new(truth(r, depth - 1));
            match r.below(3) {
                0 => leaf(Leaf::Rise(inner)),
                1 => leaf(Leaf::Fall(inner)),
                _ => leaf(Leaf::Delay(3_000_000_000, inner, r.pick(&[0, 2_000_000_000]))),
            }
        }
        _ => expr(ExprKind::Select(
            Box::new(truth(r, depth - 1)),
            Box::new(truth(r, depth - 1)),
            Box::new(truth(r, depth - 1)),
        )),
    }
}

pub(crate) fn number(r: &mut Random, depth: usize) -> Expr {
    let kind = if depth == 0 { r.below(2) } else { r.below(8) };
    match kind {
        0 => expr(ExprKind::Int(r.pick(&[0, 1, 5, -5, 1_000, i64::MIN, i64::MAX]))),
        1 => leaf(Leaf::Name(one(r.pick::<&str>(NUMBERS)))),
        2 => expr(ExprKind::Neg(Box::new(number(r, depth - 1)))),
        3 => expr(ExprKind::Element(Leaf::Name(one("v")), Box::new(number(r, depth - 1)))),
        4 => expr(ExprKind::Select(
            Box::new(truth(r, depth - 1)),
            Box::new(number(r, depth - 1)),
            Box::new(number(r, depth - 1)),
        )),
        _ => {
            let op = r.pick(&[
                ArithOp::Add,
                ArithOp::Sub,
                ArithOp::Mul,
                ArithOp::Div,
                ArithOp::Mod,
                ArithOp::BitAnd,
                ArithOp::BitOr,
                ArithOp::BitXor,
                ArithOp::Shl,
                ArithOp::Shr,
            ]);
            expr(ExprKind::Arith(
                op,
                Box::new(number(r, depth - 1)),
                Box::new(number(r, depth - 1)),
            ))
        }
    }
}

fn value(r: &mut Random) -> Expr {
    if r.chance(50) { truth(r, 2) } else { number(r, 2) }
}

fn block(r: &mut Random, depth: usize) -> Block {
    r.list(3, |r| stmt(r, depth))
}

fn stmt(r: &mut Random, depth: usize) -> Stmt {
    let any = |r: &mut Random| name(r.pick::<&str>(TRUTHS));
    let kind = match r.below(if depth == 0 { 7 } else { 9 }) {
        0 | 1 => StmtKind::Assign {
            target: one(r.pick::<&str>(TRUTHS)),
            index: r.some(30, |r| number(r, 1)),
            value: value(r),
        },
        2 => StmtKind::Raise(any(r)),
        3 => StmtKind::Send {
            event: any(r),
            after: r.some(50, |_| 2_000_000_000),
            slot: r.some(50, any),
        },
        4 => StmtKind::Cancel(any(r)),
        5 => StmtKind::Call { function: any(r), arguments: r.list(2, value) },
        6 => StmtKind::Code(Verbatim {
            language: "c".to_owned(),
            text: r.pick(&["x = 1;", "if (a) {\n  b();\n}", "\n\"q\"\"\""]).to_owned(),
        }),
        _ => StmtKind::If {
            condition: truth(r, 2),
            then: block(r, depth - 1),
            otherwise: block(r, depth - 1),
        },
    };
    Stmt { kind, span: Span::default() }
}

fn step_item(r: &mut Random) -> StepItem {
    let kind = match r.below(16) {
        0..=7 => {
            let (how, condition, arguments) = match r.below(7) {
                0 | 1 => {
                    (ActionHow::Bare, r.some(30, |r| truth(r, 2)), r.some(30, |r| r.list(2, value)))
                }
                2 => (ActionHow::After(3_000_000_000), r.some(30, |r| truth(r, 2)), None),
                3 => (ActionHow::For(10_000_000), None, None),
                4 => {
                    let q: Vec<Qualifier> =
                        Qualifier::ALL.into_iter().filter(|it| !it.is_timed()).collect();
                    (ActionHow::Qualified(r.pick(&q), None), r.some(30, |r| truth(r, 1)), None)
                }
                _ => {
                    let q: Vec<Qualifier> =
                        Qualifier::ALL.into_iter().filter(|it| it.is_timed()).collect();
                    (
                        ActionHow::Qualified(r.pick(&q), Some(500_000_000)),
                        r.some(30, |r| truth(r, 1)),
                        None,
                    )
                }
            };
            let target =
                name(r.pick(&[
                    "R", "Z", "set", "on", "entry", "pulse", "step", "a b", "input", "if",
                ]));
            StepItemKind::Action { target, arguments, how, condition }
        }
        8 | 9 => StepItemKind::Entry(block(r, 2)),
        10 => StepItemKind::Exit(block(r, 2)),
        11 => {
            let events = r.list(2, |r| name(r.pick(&["E", "when", "F"])));
            let guard =
                if events.is_empty() { Some(truth(r, 2)) } else { r.some(50, |r| truth(r, 2)) };
            StepItemKind::On { events, guard, actions: block(r, 1) }
        }
        12 => StepItemKind::Priority(u32::try_from(r.below(5)).unwrap()),
        13 => StepItemKind::Budget(200),
        14 => StepItemKind::Task {
            name: name("ramp"),
            cost: (r.below(3) > 0).then_some(80),
            body: block(r, 1),
        },
        _ => match r.below(4) {
            0 => StepItemKind::Code(Verbatim {
                language: "c".to_owned(),
                text: r.pick(&["y();", "a\nb"]).to_owned(),
            }),
            1 => StepItemKind::Force {
                target: one("g"),
                order: ForceOrder::Situation(r.list(3, |r| one(r.pick::<&str>(STEPS)))),
            },
            2 => StepItemKind::Force { target: one("g"), order: ForceOrder::Init },
            _ => StepItemKind::Force { target: one("g"), order: ForceOrder::Hold },
        },
    };
    StepItem { kind, span: Span::default() }
}

fn int() -> Type {
    Type::Int { lo: -5, hi: 9 }
}

fn declaration(r: &mut Random) -> Declaration {
    let (label, kind) = match r.below(10) {
        0 | 1 => (
            r.pick::<&str>(TRUTHS),
            DeclarationKind::Input { ty: Type::Bool, synchronous: r.chance(20) },
        ),
        2 => (r.pick::<&str>(NUMBERS), DeclarationKind::Input { ty: int(), synchronous: false }),
        3 => {
            let (registered, mealy) = (r.chance(20), r.chance(20));
            (
                r.pick(&["R", "Z", "mealy"]),
                DeclarationKind::Output {
                    ty: Type::Bool,
                    init: None,
                    registered,
                    mealy,
                    safe: r.some(20, |r| Expr::bool(r.chance(50))),
                },
            )
        }
        4 => {
            let init = r.some(50, |r| number(r, 1));
            (
                r.pick(NUMBERS),
                DeclarationKind::Output {
                    ty: int(),
                    init,
                    registered: false,
                    mealy: false,
                    safe: r.some(30, |_| Expr::int(1)),
                },
            )
        }
        5 => {
            let init = r.list(3, |r| number(r, 1));
            (r.pick(NUMBERS), DeclarationKind::Var { ty: int(), len: r.some(50, |_| 4), init })
        }
        6 => (r.pick(&["E", "F", "internal"]), DeclarationKind::Event { internal: r.chance(30) }),
        7 => ("T1", DeclarationKind::Timer { condition: truth(r, 2) }),
        8 => (r.pick(&["f", "left", "on"]), DeclarationKind::ExternCondition { ty: Type::Bool }),
        _ => {
            let params =
                r.list(2, |r| (r.pick(&["", "v", "on"]).to_owned(), r.pick(&[int(), Type::Bool])));
            (r.pick(&["go", "speed"]), DeclarationKind::ExternAction { params })
        }
    };
    Declaration { name: name(label), kind, meta: meta(r) }
}

fn setting(r: &mut Random) -> Setting {
    let kind = match r.below(13) {
        0 => SettingKind::Tick(r.pick(&[10_000_000, 1_500, 7])),
        1 => SettingKind::Conflict(r.pick(&[Policy::All, Policy::PriorityAge, Policy::OuterFirst])),
        2 => SettingKind::EvolutionSingle,
        3 => SettingKind::EvolutionStable(r.some(50, |_| 20)),
        4 => SettingKind::Schedule(r.pick(&[
            Schedule::Declared,
            Schedule::Level,
            Schedule::Priority,
        ])),
        5 => SettingKind::FireOne(r.chance(50)),
        6 => SettingKind::AssignSimultaneous(r.chance(50)),
        7 => SettingKind::ActionsIec,
        8 => SettingKind::FinalScan,
        9 => SettingKind::Queue(4),
        10 => SettingKind::EventsExclusive,
        11 => {
            let sharing = r.pick(&SHARINGS).1;
            let names = if r.chance(50) { Vec::new() } else { vec![step_path(r), step_path(r)] };
            SettingKind::Shared(sharing, names)
        }
        _ => SettingKind::Priority(2),
    };
    Setting { kind, span: Span::default() }
}

fn step_path(r: &mut Random) -> Path {
    if r.chance(20) {
        Path { names: vec![name("m1"), name(r.pick::<&str>(STEPS))] }
    } else {
        one(r.pick::<&str>(STEPS))
    }
}

fn transition(r: &mut Random) -> Transition {
    let made = Transition {
        name: r.some(50, |r| name(r.pick(&["t1", "assert", "chart", "step", "3", "on"]))),
        sources: r.list(2, step_path),
        targets: r.list(2, step_path),
        events: r.list(1, |r| name(r.pick(&["E", "when", "F"]))),
        guard: r.some(80, |r| if r.chance(5) { wide(r) } else { truth(r, 3) }),
        after: r.some(20, |r| {
            let length = if r.chance(50) {
                Length::Ns(3_000_000_000)
            } else {
                Length::Named(one(r.pick(&["LIMIT", "when", "on", "3", "restart"])))
            };
            (length, Span::default())
        }),
        priority: r.some(15, |_| 2),
        is_sink: false,
        restart: r.chance(10),
        is_internal: r.chance(15),
        deadline_ns: r.some(10, |_| 1_000),
        actions: if r.chance(30) { block(r, 2) } else { Vec::new() },
        meta: meta(r),
    };
    // A reaction must name its step.
    let is_internal = made.is_internal && !(made.sources.is_empty() && made.targets.is_empty());
    // A transition without a target is a sink, or a reaction of a statechart.
    let is_sink = made.targets.is_empty() && !made.sources.is_empty() && !is_internal;
    Transition { is_internal, is_sink, ..made }
}

/// A guard that needs several lines.
fn wide(r: &mut Random) -> Expr {
    let operands = (0..30).map(|_| truth(r, 1)).collect();
    expr(if r.chance(50) { ExprKind::And(operands) } else { ExprKind::Or(operands) })
}

fn step(r: &mut Random, roles: &[StepRole]) -> Step {
    Step {
        name: name(r.pick::<&str>(STEPS)),
        role: r.pick(roles),
        activation_link: r.chance(15),
        count: r.some(10, |r| StepCount {
            max: 3,
            initial: r.some(50, |_| 2),
            span: Span::default(),
        }),
        body: r.list(4, step_item),
        meta: meta(r),
    }
}

/// A step that contains others. It has at most one priority, which comes first.
fn outer_step(r: &mut Random, roles: &[StepRole]) -> Step {
    let mut made = step(r, roles);
    made.body.retain(|item| !matches!(item.kind, StepItemKind::Priority(_)));
    if r.chance(15) {
        let kind = StepItemKind::Priority(4);
        made.body.insert(0, StepItem { kind, span: Span::default() });
    }
    made
}

fn state(r: &mut Random, depth: usize, is_child_of_parallel: bool) -> State {
    let is_parallel = r.chance(25);
    let roles: &[StepRole] = if is_child_of_parallel || r.chance(70) {
        &[StepRole::Plain]
    } else {
        &[StepRole::Initial]
    };
    let targets = |r: &mut Random| (0..1 + r.below(2)).map(|_| step_path(r)).collect();
    State {
        step: outer_step(r, roles),
        is_parallel,
        initial: r.some(30, |r| (targets(r), block(r, 1))),
        histories: r.list(2, |r| History {
            name: name(r.pick(&["H", "deep", "history"])),
            is_deep: r.chance(50),
            default: if r.chance(50) { targets(r) } else { Vec::new() },
            content: block(r, 1),
            meta: meta(r),
        }),
        items: r.list(3, |r| {
            if is_parallel && r.chance(80) {
                Item::State(state(r, depth.saturating_sub(1), true))
            } else {
                item(r, depth.saturating_sub(1))
            }
        }),
    }
}

fn instance(r: &mut Random) -> Use {
    let argument = |r: &mut Random| Argument {
        parameter: name(r.pick(&["start", "done", "limit", "if"])),
        value: if r.chance(50) {
            ArgumentValue::Reads(value(r))
        } else {
            ArgumentValue::Drives(step_path(r))
        },
        span: Span::default(),
    };
    Use {
        library: name("conveyor"),
        name: name("c1"),
        arguments: r.list(3, argument),
        meta: meta(r),
    }
}

fn item(r: &mut Random, depth: usize) -> Item {
    if depth > 0 && r.chance(15) {
        return match r.below(3) {
            0 => Item::Enclosing(Enclosing {
                step: outer_step(r, &[StepRole::Plain, StepRole::Initial, StepRole::MacroEntry]),
                items: r.list(4, |r| item(r, depth - 1)),
            }),
            _ => Item::State(state(r, depth, false)),
        };
    }
    match r.below(19) {
        18 => Item::Action(Action {
            name: name(r.pick(&["count", "action", "s"])),
            body: if r.chance(60) { block(r, 2) } else { Vec::new() },
            meta: meta(r),
        }),
        16 => Item::Use(instance(r)),
        17 => Item::Step(step(r, &[StepRole::Final])),
        0 => Item::Setting(setting(r)),
        1..=3 => Item::Declaration(declaration(r)),
        4..=7 => Item::Step(step(r, &[StepRole::Plain, StepRole::Initial])),
        8..=11 => Item::Transition(transition(r)),
        12 => Item::Macro(Macro {
            name: name(r.pick(&["fill", "step", "macro"])),
            items: r.list(4, |r| match r.below(3) {
                0 => Item::Transition(transition(r)),
                1 => Item::Step(step(
                    r,
                    &[StepRole::MacroEntry, StepRole::MacroExit, StepRole::MacroEntryExit],
                )),
                _ => Item::Step(step(r, &[StepRole::Plain])),
            }),
            meta: meta(r),
        }),
        13 => Item::MacroStep(MacroStep {
            name: name("m1"),
            body: name("fill"),
            role: r.pick(&[
                StepRole::Plain,
                StepRole::Initial,
                StepRole::MacroEntry,
                StepRole::MacroExit,
                StepRole::MacroEntryExit,
            ]),
            priority: r.some(30, |_| 1),
            meta: meta(r),
        }),
        14 => Item::Property(Property {
            name: r.some(30, |r| name(r.pick(&["safe", "never"]))),
            is_assumption: r.chance(50),
            is_never: r.chance(50),
            expr: truth(r, 3),
            meta: meta(r),
        }),
        _ => {
            if r.chance(50) {
                let items = (0..1 + r.below(3)).map(|_| step_path(r)).collect();
                Item::Place(Place {
                    items,
                    part: name(r.pick(&["chip", "cpu", "big chip"])),
                    span: Span::default(),
                })
            } else {
                let pins =
                    r.list(30, |r| (name(r.pick(&["m", "clock", "n[0]", "m1.q", "a b", "s"])), 7));
                Item::Board(Board { device: name("gal22v10"), pins, span: Span::default() })
            }
        }
    }
}

/// A library chart with the items of a chart.
fn library(r: &mut Random, chart: fn(&mut Random) -> Chart) -> Library {
    let label = name(r.pick(&["conveyor", "certificate", "a b"]));
    let parameters = r.list(9, |r| {
        let mut declaration = declaration(r);
        let default = match &mut declaration.kind {
            DeclarationKind::Input { synchronous, .. } => {
                *synchronous = false;
                r.some(30, value)
            }
            DeclarationKind::Output { init, registered, mealy, safe, .. } => {
                (*init, *registered, *mealy, *safe) = (None, false, false, None);
                None
            }
            DeclarationKind::Var { len, init, .. } => {
                (*len, *init) = (None, Vec::new());
                None
            }
            DeclarationKind::Event { internal } => {
                *internal = false;
                None
            }
            _ => {
                let value = number(r, 1);
                declaration.kind = DeclarationKind::Const { value: value.clone() };
                Some(value)
            }
        };
        Parameter { declaration, default }
    });
    let certificate = r.some(40, |r| Certificate {
        of: label.clone(),
        version: "0.1.0".to_owned(),
        hash: "00ff".to_owned(),
        properties: r.list(2, |r| name(r.pick(&["safe", "never", "by"]))),
        span: Span::default(),
    });
    let Chart { items, meta, .. } = chart(r);
    Library { name: label, parameters, items, certificate, span: Span::default(), meta }
}

/// A random design of one or two charts that declare integer inputs and an array.
pub(crate) fn design(r: &mut Random) -> Design {
    let chart = |r: &mut Random| {
        let mut items: Vec<Item> = NUMBERS
            .iter()
            .map(|n| {
                Item::Declaration(Declaration {
                    name: name(n),
                    kind: DeclarationKind::Input { ty: int(), synchronous: false },
                    meta: Meta::default(),
                })
            })
            .collect();
        let kind = DeclarationKind::Var { ty: int(), len: Some(4), init: Vec::new() };
        items.push(Item::Declaration(Declaration { name: name("v"), kind, meta: Meta::default() }));
        items.extend(r.list(14, |r| item(r, 3)));
        if r.chance(20) {
            let emergency = Emergency { condition: truth(r, 3), meta: meta(r) };
            items.push(Item::Emergency(emergency));
        }
        Chart {
            is_unnamed: false,
            name: name(r.pick(&["truck", "chart", "é", "1"])),
            span: Span::default(),
            initial: r.some(20, |r| one(r.pick::<&str>(STEPS))).into_iter().collect(),
            items,
            meta: meta(r),
        }
    };
    let edition = r.some(20, |_| (1, Span::default()));
    let imports = r.list(1, |_| Import { file: "a \"b\".graf".to_owned(), span: Span::default() });
    let libraries: Vec<Library> = r.list(1, |r| library(r, chart));
    let least = usize::from(libraries.is_empty());
    let charts = (0..least + r.below(2)).map(|_| chart(r)).collect();
    Design { edition, imports, libraries, charts }
}
