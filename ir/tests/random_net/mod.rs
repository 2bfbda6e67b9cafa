//! Random nets in which every field of every type occurs in every form. They are deliberately invalid (ids dangle, names repeat, types do not fit),
//! because the text form must represent broken nets too.

use grafsynth_ir::Arena;
use grafsynth_ir::arena::Id;
use grafsynth_ir::expr::{ArithOp, CompareOp, Expr as GenericExpr, ExprKind, Type};
use grafsynth_ir::net::*;
use grafsynth_ir::span::{Name, Span};

pub(crate) struct Random(grafsynth_ir::random::Random);

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Random(grafsynth_ir::random::Random::new(seed))
    }

    pub(crate) fn below(&mut self, bound: usize) -> usize {
        self.0.below(bound)
    }

    pub(crate) fn flip(&mut self) -> bool {
        self.below(2) == 0
    }

    pub(crate) fn pick<T: Clone>(&mut self, all: &[T]) -> T {
        all[self.below(all.len())].clone()
    }

    fn many<T>(&mut self, at_most: usize, mut make: impl FnMut(&mut Self) -> T) -> Vec<T> {
        (0..self.below(at_most + 1)).map(|_| make(self)).collect()
    }

    fn arena<T>(&mut self, at_most: usize, make: impl FnMut(&mut Self) -> T) -> Arena<T> {
        self.many(at_most, make).into_iter().collect()
    }

    fn maybe<T>(&mut self, make: impl FnOnce(&mut Self) -> T) -> Option<T> {
        if self.flip() { Some(make(self)) } else { None }
    }

    /// An id that usually exists.
    fn id<T>(&mut self) -> Id<T> {
        Id::from_index(self.below(4))
    }

    fn number(&mut self) -> u32 {
        self.pick(&[0, 1, 2, 80, u32::MAX])
    }
}

const NAMES: &[&str] = &[
    "a",
    "b",
    "s1",
    "p2",
    "m1.s3",
    "x_1",
    "é",
    "S.t",
    "s.active",
    "and",
    "step",
    "when",
    "net",
    "odd name",
    "`",
    "a\\b",
    "1st",
    "",
    "a..b",
    "%0",
    "?0",
    "out",
    "T",
    "tab\there",
    "new\nline",
    "a-b",
    "q",
    "N",
    "\u{7f}",
    "straße.ü",
    "else",
    "R",
    "Z",
];
const TEXTS: &[&str] =
    &["", "waiting", "\"quoted\" \\ and\nmore", "// no comment", "`", "é ↑ \u{1}"];

fn name(r: &mut Random) -> Name {
    Name::new(r.pick(NAMES), Span::default())
}

fn meta(r: &mut Random) -> Meta {
    let req = r.many(2, |r| r.pick(TEXTS).to_owned());
    Meta { span: Span::default(), label: r.pick(TEXTS).to_owned(), req }
}

fn ty(r: &mut Random) -> Type {
    let bounds = [i64::MIN, -5, 0, 7, 300, i64::MAX];
    if r.flip() { Type::Bool } else { Type::Int { lo: r.pick(&bounds), hi: r.pick(&bounds) } }
}

fn leaf(r: &mut Random) -> Leaf {
    match r.below(11) {
        0 => Leaf::Input(r.id()),
        1 => Leaf::Var(r.id()),
        2 => Leaf::Active(r.id()),
        3 => Leaf::Elapsed(r.id()),
        4 => Leaf::LastElapsed(r.id()),
        5 => Leaf::TasksDone(r.id()),
        6 => Leaf::Timer(r.id()),
        7 => Leaf::Rise(r.id()),
        8 => Leaf::Fall(r.id()),
        9 => Leaf::Fireable(r.id()),
        _ => Leaf::Controlled(r.id()),
    }
}

fn expr<L>(r: &mut Random, depth: u64, leaf: &impl Fn(&mut Random) -> L) -> GenericExpr<L> {
    let kind = if depth == 0 || r.below(4) == 0 {
        match r.below(4) {
            0 => ExprKind::Bool(r.flip()),
            1 => ExprKind::Int(r.pick(&[0, 1, -1, -5, 99, i64::MAX, i64::MIN])),
            _ => ExprKind::Leaf(leaf(r)),
        }
    } else {
        let boxed = |r: &mut Random| Box::new(expr(r, depth - 1, leaf));
        match r.below(9) {
            0 => ExprKind::Element(leaf(r), boxed(r)),
            1 | 2 => ExprKind::Not(boxed(r)),
            3 => ExprKind::And(r.many(3, |r| expr(r, depth - 1, leaf))),
            4 => ExprKind::Or(r.many(3, |r| expr(r, depth - 1, leaf))),
            5 => {
                let all = [
                    CompareOp::Eq,
                    CompareOp::Ne,
                    CompareOp::Lt,
                    CompareOp::Le,
                    CompareOp::Gt,
                    CompareOp::Ge,
                ];
                ExprKind::Compare(r.pick(&all), boxed(r), boxed(r))
            }
            6 => ExprKind::Neg(boxed(r)),
            7 => {
                let all = [
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
                ];
                ExprKind::Arith(r.pick(&all), boxed(r), boxed(r))
            }
            _ => ExprKind::Select(boxed(r), boxed(r), boxed(r)),
        }
    };
    GenericExpr::new(kind, Span::default())
}

fn net_expr(r: &mut Random) -> Expr {
    expr(r, 4, &leaf)
}

fn property_expr(r: &mut Random) -> PropertyExpr {
    expr(r, 3, &|r| {
        if r.flip() { PropertyLeaf::Net(leaf(r)) } else { PropertyLeaf::Output(r.id()) }
    })
}

fn verbatim(r: &mut Random) -> Verbatim {
    Verbatim { language: r.pick(TEXTS).to_owned(), text: r.pick(TEXTS).to_owned() }
}

fn block(r: &mut Random, depth: u64) -> Block {
    let at_most = r.pick(&[0, 0, 2, 6]);
    r.many(at_most, |r| {
        let kind = match r.below(if depth > 0 { 8 } else { 6 }) {
            0 => StmtKind::Assign { var: r.id(), index: r.maybe(net_expr), value: net_expr(r) },
            1 => StmtKind::Raise(r.id()),
            2 => StmtKind::Send(r.id()),
            3 => StmtKind::Cancel(r.id()),
            4 => StmtKind::Call { output: r.id(), arguments: r.many(2, net_expr) },
            5 => StmtKind::Code(verbatim(r)),
            _ => StmtKind::If {
                condition: net_expr(r),
                then: block(r, depth - 1),
                otherwise: block(r, depth - 1),
            },
        };
        Stmt { kind, span: Span::default() }
    })
}

fn list(r: &mut Random) -> Block {
    block(r, 2)
}

fn enters(r: &mut Random) -> Vec<Enter> {
    r.many(3, |r| match r.below(5) {
        0 => Enter::InitialContent(r.id()),
        1 => Enter::History(r.id()),
        _ => Enter::Step(r.id()),
    })
}

fn driver(r: &mut Random) -> Driver {
    let emission = |r: &mut Random| Emission {
        step: r.id(),
        condition: r.maybe(net_expr),
        span: Span::default(),
    };
    match r.below(5) {
        0 => Driver::Continuous(r.many(3, emission)),
        1 => Driver::Mealy(r.many(3, emission)),
        2 => Driver::Stored(r.id()),
        3 => Driver::Controlled(r.id()),
        _ => Driver::Extern {
            params: r.many(2, |r| Param { name: r.pick(NAMES).to_owned(), ty: ty(r) }),
            calls: r.many(2, |r| ExternCall {
                step: r.id(),
                condition: r.maybe(net_expr),
                arguments: r.many(2, net_expr),
                span: Span::default(),
            }),
        },
    }
}

fn step(r: &mut Random) -> Step {
    use StepKind::{Composite, Enclosing, Final, Leaf, Parallel};
    Step {
        name: name(r),
        part: r.id(),
        is_initial: r.flip(),
        kind: r.pick(&[Leaf, Enclosing, Composite, Parallel, Final]),
        parent: r.maybe(Random::id),
        activation_link: r.flip(),
        hidden: r.flip(),
        priority: r.maybe(Random::number),
        entry: list(r),
        exit: list(r),
        initial_content: list(r),
        code: r.many(2, verbatim),
        tasks: r.many(2, |r| Task {
            name: name(r),
            cost: r.number(),
            body: list(r),
            meta: meta(r),
        }),
        budget: r.number(),
        locks: r.many(2, Random::id),
        done_event: r.maybe(Random::id),
        meta: meta(r),
    }
}

fn transition(r: &mut Random) -> Transition {
    let requires = r.many(3, Random::id);
    Transition {
        name: name(r),
        part: r.id(),
        kind: r.pick(&[TransitionKind::Move, TransitionKind::Reaction]),
        clears: if r.flip() { requires.clone() } else { r.many(3, Random::id) },
        requires,
        enters: enters(r),
        events: r.many(2, Random::id),
        guard: net_expr(r),
        priority: r.maybe(Random::number),
        restart: r.flip(),
        actions: list(r),
        deadline_ns: r.maybe(|r| r.pick(&[0, 5, u64::MAX])),
        meta: meta(r),
    }
}

fn settings(r: &mut Random) -> Settings {
    let policies = [
        Policy::All,
        Policy::Priority,
        Policy::PriorityAge,
        Policy::InnerFirst,
        Policy::OuterFirst,
    ];
    Settings {
        policy: r.pick(&policies),
        evolution: if r.flip() {
            Evolution::Single
        } else {
            Evolution::Stable { limit: r.number() }
        },
        schedule: r.pick(&[Schedule::Declared, Schedule::Level, Schedule::Priority]),
        fire_one: r.flip(),
        assign_simultaneous: r.flip(),
        final_scan: r.flip(),
        events_exclusive: r.flip(),
        queue: r.maybe(Random::number),
        tick_ns: r.pick(&[0, 1, 10_000_000, u64::MAX]),
    }
}

fn action(r: &mut Random) -> ControlledAction {
    ControlledAction {
        name: name(r),
        uses: r.many(2, |r| ActionUse {
            step: r.id(),
            qualifier: r.pick(&Qualifier::ALL),
            condition: r.maybe(net_expr),
            span: Span::default(),
        }),
        duration: r.number(),
        body: list(r),
        meta: meta(r),
    }
}

/// The net for this seed.
pub(crate) fn net(seed: u64) -> Net {
    let r = &mut Random::new(seed);
    let kinds = [InputKind::Pin, InputKind::Extern, InputKind::Event, InputKind::InternalEvent];
    let origins = [VarOrigin::Declared, VarOrigin::StoredOutput, VarOrigin::Hidden];
    let mut net = Net {
        name: name(r),
        settings: settings(r),
        parts: r.arena(3, |r| Part {
            name: name(r),
            level: r.number(),
            priority: r.maybe(Random::number),
            initial: enters(r),
            is_cut: r.number() % 4 == 0,
            meta: meta(r),
        }),
        inputs: r.arena(4, |r| Input {
            name: name(r),
            ty: ty(r),
            kind: r.pick(&kinds),
            synchronous: r.flip(),
            meta: meta(r),
        }),
        outputs: r.arena(4, |r| Output {
            name: name(r),
            ty: ty(r),
            driver: driver(r),
            safe: r.maybe(|r| r.pick(&[0, 1, -3, i64::MAX])),
            registered: r.flip(),
            meta: meta(r),
        }),
        vars: r.arena(4, |r| Var {
            name: name(r),
            ty: ty(r),
            len: r.maybe(Random::number),
            init: r.many(3, |r| r.pick(&[0, -1, 5, i64::MIN])),
            origin: r.pick(&origins),
            meta: meta(r),
        }),
        sharing: std::collections::BTreeMap::new(),
        timers: r.arena(3, |r| Timer {
            name: name(r),
            condition: net_expr(r),
            starts_expired: r.flip(),
            meta: meta(r),
        }),
        edges: r.arena(3, |r| EdgeOperand { expr: net_expr(r) }),
        steps: r.arena(5, step),
        transitions: r.arena(5, transition),
        actions: r.arena(3, action),
        sends: r.arena(2, |r| SendSlot {
            name: name(r),
            event: r.id(),
            delay: r.number(),
            meta: meta(r),
        }),
        histories: r.arena(2, |r| History {
            name: name(r),
            owner: r.id(),
            cases: r.many(2, |r| HistoryCase { step: r.id(), enters: enters(r) }),
            default: enters(r),
            default_content: list(r),
            meta: meta(r),
        }),
        forcings: r.many(2, |r| Forcing {
            step: r.id(),
            target: r.many(2, Random::id),
            order: if r.flip() {
                ForcingOrder::Hold
            } else {
                ForcingOrder::Situation(r.many(3, Random::id))
            },
            span: Span::default(),
        }),
        emergency: r.maybe(|r| Emergency { condition: net_expr(r), meta: meta(r) }),
        ending: r.maybe(|r| Ending { waits: net_expr(r), is_quiet: r.flip() }),
        properties: r.many(3, |r| Property {
            name: r.pick(NAMES).to_owned(),
            role: r.pick(&[PropertyRole::Assume, PropertyRole::Assert]),
            never: property_expr(r),
            meta: meta(r),
        }),
        unspecified: r.many(2, |r| Unspecified {
            when: net_expr(r),
            what: if r.flip() { OpenCell::Next } else { OpenCell::Output(r.id()) },
        }),
        macros: r.many(2, |r| MacroStep {
            name: name(r),
            steps: r.many(3, Random::id),
            entry: r.id(),
            exit: r.id(),
            meta: meta(r),
        }),
        placements: r.many(3, |r| Placement {
            item: match r.below(4) {
                0 => PlacedItem::Step(r.id()),
                1 => PlacedItem::Var(r.id()),
                2 => PlacedItem::Transition(r.id()),
                _ => PlacedItem::Output(r.id()),
            },
            part: name(r),
            span: Span::default(),
        }),
        board: Board { device: r.maybe(name), pins: r.many(2, |r| (name(r), r.number())) },
    };
    for var in net.vars.ids() {
        if let Some((_, sharing)) = r.maybe(|r| r.pick(&SHARINGS)) {
            net.sharing.insert(var, sharing);
        }
    }
    net
}
