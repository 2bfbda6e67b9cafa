//! Random trees: an untyped recipe, which can be shrunk, and the tree that the constructors make from it.

use crate::good;
use grafsynth_c::tree::types::{FunctionType, IntKind, Qualified, Qualifiers, Type};
use grafsynth_c::tree::typing::Suffix;
use grafsynth_c::tree::{
    Arm, BinaryOp, Case, Expr, ExprKind, FunctionKind, Init, Item, ItemKind, Label, Loc, LogicalOp,
    Marks, Part, Place, SizeOfOperand, Spelling, Stmt, StmtKind, Symbol, SymbolId, SymbolKind,
    UnaryOp, Unit,
};
use grafsynth_c::{Config, order};
use proptest::prelude::*;
use std::sync::Arc;

/// The declarations that the random function can use.
const PRELUDE: &str = "#include <stdbool.h>\n#include <stddef.h>\n#include <stdint.h>\n\
    enum colour { RED, GREEN = 5, BLUE = -3 };\n\
    typedef struct { bool on : 1; bool off : 1; int8_t small; uint16_t wide; int32_t many[4]; } inner_t;\n\
    struct node { inner_t inner; inner_t rows[2][3]; struct node *next; const uint8_t *text;\n\
        int32_t (*call)(int32_t a, uint8_t b); uint64_t huge; enum colour colour; volatile uint8_t pin; };\n\
    typedef struct node node_t;\n\
    static const uint8_t table[5] = { 1, 2, 3 };\n\
    static int32_t sum(int32_t a, uint8_t b) { return a + b; }\n\
    int32_t unknown(int32_t a, uint8_t b);\n";

/// An expression without types.
#[derive(Debug, Clone)]
pub(crate) enum Value {
    Number(u64, u8),
    Word(u8),
    Object(Spot),
    Address(Spot),
    Unary(u8, Box<Value>),
    Binary(u8, Box<Value>, Box<Value>),
    Logical(bool, Box<Value>, Box<Value>),
    Choose(Box<Value>, Box<Value>, Box<Value>),
    Comma(Box<Value>, Box<Value>),
    Cast(u8, Box<Value>),
    Assign(Spot, Box<Value>),
    Update(u8, Spot, Box<Value>),
    Step(u8, Spot),
    Call(u8, Box<Value>, Box<Value>),
    SizeOf(u8, Box<Value>),
}

/// An object without types.
#[derive(Debug, Clone)]
pub(crate) enum Spot {
    Symbol(u8),
    Member(Box<Spot>, u8),
    Element(Box<Spot>, Box<Value>),
    At(Box<Value>, Box<Value>),
    Deref(Box<Value>),
}

/// A statement without types.
#[derive(Debug, Clone)]
pub(crate) enum Recipe {
    Do(Value),
    Define(u8, Option<Vec<(u8, Value)>>),
    If(Vec<(Value, Vec<Recipe>)>, Vec<Recipe>),
    Switch(Value, Vec<(Vec<i8>, Vec<Recipe>)>),
    While(Value, Vec<Recipe>),
    DoWhile(Vec<Recipe>, Value),
    For(u8, Value, Value, Vec<Recipe>),
    Jump(u8),
    Return(Value),
    Block(Vec<Recipe>),
    Barrier,
}

fn one_of<T: std::fmt::Debug + 'static>(
    all: Vec<(u32, BoxedStrategy<T>)>,
) -> impl Strategy<Value = T> {
    prop::strategy::Union::new_weighted(all)
}

fn values() -> impl Strategy<Value = Value> {
    let leaf = prop_oneof![
        (prop_oneof![0_u64..9, 0_u64..100_000, any::<u64>()], any::<u8>())
            .prop_map(|(value, form)| Value::Number(value, form)),
        any::<u8>().prop_map(Value::Word),
        any::<u8>().prop_map(|it| Value::Object(Spot::Symbol(it))),
        (any::<u8>(), any::<u8>(), any::<u8>()).prop_map(|(a, b, c)| {
            let first = Spot::Member(Box::new(Spot::Symbol(a)), b);
            Value::Object(Spot::Member(Box::new(first), c))
        }),
    ];
    leaf.prop_recursive(5, 40, 3, |inner| {
        let one = || inner.clone().prop_map(Box::new);
        let spot = || {
            let leaf = any::<u8>().prop_map(Spot::Symbol).boxed();
            leaf.prop_recursive(4, 8, 1, {
                let inner = inner.clone();
                move |spot| {
                    let one = || inner.clone().prop_map(Box::new);
                    prop_oneof![
                        (spot.clone(), any::<u8>()).prop_map(|(a, b)| Spot::Member(Box::new(a), b)),
                        (spot, one()).prop_map(|(a, b)| Spot::Element(Box::new(a), b)),
                        (one(), one()).prop_map(|(a, b)| Spot::At(a, b)),
                        one().prop_map(Spot::Deref),
                    ]
                }
            })
        };
        one_of(vec![
            (1, spot().prop_map(Value::Object).boxed()),
            (1, spot().prop_map(Value::Address).boxed()),
            (1, (any::<u8>(), one()).prop_map(|(op, a)| Value::Unary(op, a)).boxed()),
            (4, (any::<u8>(), one(), one()).prop_map(|(op, a, b)| Value::Binary(op, a, b)).boxed()),
            (
                2,
                (any::<bool>(), one(), one())
                    .prop_map(|(op, a, b)| Value::Logical(op, a, b))
                    .boxed(),
            ),
            (1, (one(), one(), one()).prop_map(|(c, a, b)| Value::Choose(c, a, b)).boxed()),
            (1, (one(), one()).prop_map(|(a, b)| Value::Comma(a, b)).boxed()),
            (2, (any::<u8>(), one()).prop_map(|(to, a)| Value::Cast(to, a)).boxed()),
            (1, (spot(), one()).prop_map(|(a, b)| Value::Assign(a, b)).boxed()),
            (
                1,
                (any::<u8>(), spot(), one()).prop_map(|(op, a, b)| Value::Update(op, a, b)).boxed(),
            ),
            (1, (any::<u8>(), spot()).prop_map(|(how, a)| Value::Step(how, a)).boxed()),
            (1, (any::<u8>(), one(), one()).prop_map(|(to, a, b)| Value::Call(to, a, b)).boxed()),
            (1, (any::<u8>(), one()).prop_map(|(of, a)| Value::SizeOf(of, a)).boxed()),
        ])
    })
}

/// Random statements.
pub(crate) fn recipes() -> impl Strategy<Value = Vec<Recipe>> {
    let parts = || prop::option::of(prop::collection::vec((any::<u8>(), values()), 1..5));
    let leaf = one_of(vec![
        (4, values().prop_map(Recipe::Do).boxed()),
        (3, (any::<u8>(), parts()).prop_map(|(ty, parts)| Recipe::Define(ty, parts)).boxed()),
        (1, any::<u8>().prop_map(Recipe::Jump).boxed()),
        (1, values().prop_map(Recipe::Return).boxed()),
        (1, Just(Recipe::Barrier).boxed()),
    ]);
    let one = leaf.prop_recursive(4, 24, 4, |inner| {
        let body = || prop::collection::vec(inner.clone(), 0..3);
        let labels = || prop::collection::vec(any::<i8>(), 1..3);
        prop_oneof![
            (prop::collection::vec((values(), body()), 1..4), body())
                .prop_map(|(arms, other)| Recipe::If(arms, other)),
            (values(), prop::collection::vec((labels(), body()), 0..4))
                .prop_map(|(on, cases)| Recipe::Switch(on, cases)),
            (values(), body()).prop_map(|(value, body)| Recipe::While(value, body)),
            (body(), values()).prop_map(|(body, value)| Recipe::DoWhile(body, value)),
            (any::<u8>(), values(), values(), body())
                .prop_map(|(form, a, b, body)| Recipe::For(form, a, b, body)),
            body().prop_map(Recipe::Block),
        ]
    });
    prop::collection::vec(one, 1..6)
}

/// The unit with a function that the recipes describe. An expression without a type is replaced by one of its parts; if the order of evaluation matters, so are
/// all inner side effects.
pub(crate) fn build(recipes: &[Recipe], config: &Config) -> Unit {
    let unit = built(recipes, config, true);
    if order::check(&unit).is_empty() { unit } else { built(recipes, config, false) }
}

fn built(recipes: &[Recipe], config: &Config, has_effects: bool) -> Unit {
    let unit = good(PRELUDE, config);
    let mut builder =
        Builder { unit, visible: Vec::new(), n_locals: 0, n_loops: 0, n_switches: 0, has_effects };
    builder.function(recipes);
    builder.unit
}

struct Builder {
    unit: Unit,
    visible: Vec<SymbolId>,
    n_locals: usize,
    n_loops: usize,
    n_switches: usize,
    /// True if effects may be within expressions.
    has_effects: bool,
}

const AT: Loc = Loc(grafsynth_ir::Span { file: grafsynth_ir::FileId(0), start: 0, end: 0 });

impl Builder {
    fn id(&self, name: &str) -> SymbolId {
        let mut found = self.unit.symbols.iter().filter(|(_, symbol)| symbol.name == name);
        found.next().expect("a symbol of the prelude").0
    }

    fn named(&self, name: &str) -> Qualified {
        Type::Named(self.id(name)).into()
    }

    fn kind(&self, at: u8) -> Qualified {
        let is_const = at % 32 > 15;
        let ty = match at % 16 {
            0 => self.named("uint8_t"),
            1 => self.named("int16_t"),
            2 => self.named("uint16_t"),
            3 => self.named("int32_t"),
            4 => self.named("uint32_t"),
            5 => self.named("int64_t"),
            6 => Type::Int(IntKind::Bool).into(),
            7 => Type::Int(IntKind::Long).into(),
            8 => Type::Int(IntKind::Char).into(),
            9 => Type::pointer(self.named("node_t")).into(),
            10 => Type::pointer(Qualified {
                qualifiers: Qualifiers { is_const: true, ..Qualifiers::default() },
                ..self.named("uint8_t")
            })
            .into(),
            11 => self.named("inner_t"),
            12 => Type::Array(Arc::new(self.named("inner_t")), Some(3)).into(),
            13 => Type::Array(
                Arc::new(Type::Array(Arc::new(self.named("uint8_t")), Some(2)).into()),
                Some(4),
            )
            .into(),
            14 => Type::Enum(grafsynth_ir::Id::from_index(0)).into(),
            _ => Type::pointer(
                Type::Function(Arc::new(FunctionType {
                    result: self.named("int32_t"),
                    params: vec![self.named("int32_t"), self.named("uint8_t")],
                }))
                .into(),
            )
            .into(),
        };
        let is_array = matches!(ty.ty, Type::Array(..));
        Qualified {
            qualifiers: Qualifiers { is_const: is_const && !is_array, ..ty.qualifiers },
            ..ty
        }
    }

    fn symbol(&mut self, name: &str, kind: SymbolKind, ty: Qualified) -> SymbolId {
        let canonical = self.unit.canonical(&ty);
        self.unit.symbols.push(Symbol { name: name.to_owned(), kind, ty, canonical, span: AT })
    }

    fn function(&mut self, recipes: &[Recipe]) {
        let params = [
            ("self", Type::pointer(self.named("node_t")).into()),
            ("byte", self.named("uint8_t")),
            ("big", self.named("int64_t")),
            ("flag", Type::Int(IntKind::Bool).into()),
        ];
        let types = params.iter().map(|(_, ty): &(&str, Qualified)| ty.clone()).collect();
        let ty =
            Type::Function(Arc::new(FunctionType { result: self.named("int32_t"), params: types }));
        let kind =
            SymbolKind::Function(FunctionKind { is_static: true, ..FunctionKind::default() });
        let symbol = self.symbol("random", kind, ty.into());
        let table = self.id("table");
        self.visible.push(table);
        let mut ids = Vec::new();
        for (name, ty) in params {
            ids.push(self.symbol(name, SymbolKind::Parameter, ty));
        }
        self.visible.extend(&ids);
        let body = self.body(recipes);
        let kind = ItemKind::Function { symbol, params: ids, body };
        self.unit.items.push(Item { kind, note: String::new(), span: AT });
    }

    fn body(&mut self, recipes: &[Recipe]) -> Vec<Stmt> {
        let n_visible = self.visible.len();
        let body = recipes.iter().map(|recipe| self.stmt(recipe)).collect();
        self.visible.truncate(n_visible);
        body
    }

    fn round(&mut self, recipes: &[Recipe]) -> Vec<Stmt> {
        self.n_loops += 1;
        let body = self.body(recipes);
        self.n_loops -= 1;
        body
    }

    fn stmt(&mut self, recipe: &Recipe) -> Stmt {
        let kind = match recipe {
            Recipe::Do(value) => StmtKind::Expr(self.top(value)),
            Recipe::Define(ty, parts) => self.define(*ty, parts.as_deref()),
            Recipe::If(arms, otherwise) => {
                let arms = arms.iter().map(|(condition, body)| Arm {
                    condition: self.scalar(condition),
                    body: self.body(body),
                    marks: Marks::default(),
                });
                let arms = arms.collect();
                StmtKind::If { arms, otherwise: self.body(otherwise) }
            }
            Recipe::Switch(on, cases) => self.switch(on, cases),
            Recipe::While(condition, body) => {
                StmtKind::While { condition: self.scalar(condition), body: self.round(body) }
            }
            Recipe::DoWhile(body, condition) => {
                StmtKind::DoWhile { body: self.round(body), condition: self.scalar(condition) }
            }
            Recipe::For(form, condition, step, body) => {
                let n_visible = self.visible.len();
                let init = if form % 4 == 0 {
                    Vec::new()
                } else if form % 4 == 1 {
                    vec![StmtKind::Expr(self.top(step)).into()]
                } else {
                    let first = self.define(form / 4 % 8, None).into();
                    if form % 4 == 2 {
                        vec![first]
                    } else {
                        vec![first, self.define(form / 4 % 8, None).into()]
                    }
                };
                let condition = (form % 3 != 0).then(|| self.scalar(condition));
                let step = (form % 5 != 0).then(|| self.top(step));
                let body = self.round(body);
                self.visible.truncate(n_visible);
                StmtKind::For { init, condition, step, body }
            }
            Recipe::Jump(how) => match how % 2 {
                0 if self.n_loops + self.n_switches > 0 => StmtKind::Break,
                _ if self.n_loops > 0 => StmtKind::Continue,
                _ => StmtKind::Opaque("user text;\n    'unbalanced".to_owned()),
            },
            Recipe::Return(value) => {
                let value = self.top(value);
                let to = self.unit.canonical(&self.named("int32_t")).ty;
                let zero = || self.number(0, 0);
                let value =
                    self.unit.convert_to(value, &to).or_else(|_| self.unit.convert_to(zero(), &to));
                StmtKind::Return(value.ok())
            }
            Recipe::Block(body) => StmtKind::Block(self.body(body)),
            Recipe::Barrier => StmtKind::Barrier,
        };
        kind.into()
    }

    fn switch(&mut self, on: &Value, cases: &[(Vec<i8>, Vec<Recipe>)]) -> StmtKind {
        let on = self.top(on);
        let on = self.unit.promote(on).unwrap_or_else(|_| self.number(0, 0));
        let kind = self.unit.integer(&on.ty).expect("an integer");
        let n_visible = self.visible.len();
        self.n_switches += 1;
        let mut seen = std::collections::BTreeSet::new();
        let mut built: Vec<Case> = Vec::new();
        for (labels, body) in cases {
            let mut own = Vec::new();
            for label in labels {
                let value = self.number(u64::from(label.unsigned_abs()), 0);
                let value = if *label < 0 {
                    self.unit.unary(UnaryOp::Neg, value, AT).expect("an integer")
                } else {
                    value
                };
                let number = self.unit.machine.wrap(i128::from(*label), kind);
                if seen.insert(number) {
                    own.push(Label::Case(value, number));
                }
            }
            if own.is_empty() && seen.insert(1_000) {
                own.push(Label::Default);
            }
            if own.is_empty() {
                continue;
            }
            // A label must precede a statement.
            let mut body: Vec<Stmt> = body.iter().map(|recipe| self.stmt(recipe)).collect();
            if matches!(body.first().map(|it| &it.kind), Some(StmtKind::Define { .. })) {
                body.insert(0, StmtKind::Block(Vec::new()).into());
            }
            built.push(Case { labels: own, body, marks: Marks::default() });
        }
        self.n_switches -= 1;
        self.visible.truncate(n_visible);
        StmtKind::Switch { on, cases: built }
    }

    fn define(&mut self, ty: u8, parts: Option<&[(u8, Value)]>) -> StmtKind {
        let is_static = ty >= 200 && parts.is_none();
        let ty = self.kind(ty);
        let canonical = self.unit.canonical(&ty).ty;
        let name = format!("v{}", self.n_locals);
        self.n_locals += 1;
        let init = parts.and_then(|parts| self.init(&canonical, parts, true));
        let symbol = self.symbol(&name, SymbolKind::Local { is_static }, ty);
        self.visible.push(symbol);
        StmtKind::Define { symbol, init }
    }

    fn init(&mut self, ty: &Type, parts: &[(u8, Value)], is_whole: bool) -> Option<Init> {
        let (at, value) = parts.first()?;
        if ty.is_scalar() || at % 7 == 0 {
            // The values of a list are evaluated in any order.
            let value = if is_whole { self.top(value) } else { self.expr(value) };
            return self.unit.convert_to(value, ty).ok().map(Init::Value);
        }
        let mut seen = std::collections::BTreeSet::new();
        let mut all = Vec::new();
        for (index, (at, _)) in parts.iter().enumerate() {
            let (len, part) = if let Type::Array(element, len) = ty {
                (len.unwrap_or(1), element.ty.clone())
            } else {
                let members = &self.unit.structs[ty.as_struct()?].members;
                let at = usize::from(*at) % members.len();
                (members.len() as u64, members[at].canonical.ty.clone())
            };
            let at = u64::from(*at) % len;
            if seen.insert(at)
                && let Some(init) = self.init(&part, &parts[index..], false)
            {
                all.push(Part { at, init });
            }
        }
        (!all.is_empty()).then_some(Init::Parts(all))
    }

    fn number(&self, value: u64, form: u8) -> Expr {
        let is_hex = form % 3 == 1;
        let suffix = Suffix { is_unsigned: form % 2 == 1, longs: form / 4 % 3 };
        let spelling = if is_hex { Spelling::Hex } else { Spelling::Decimal };
        if form % 11 == 10 {
            let character = Spelling::Character;
            return self.unit.literal(value % 128, character, IntKind::Int, AT);
        }
        if form % 7 == 6 {
            let (bits, is_signed) =
                ([8, 16, 32, 64][usize::from(form / 16 % 4)], form.is_multiple_of(2));
            let kind = self.unit.machine.exact(u32::from(bits), is_signed);
            let value = value % (self.unit.machine.range(kind).1 as u64);
            let kind = self.unit.machine.promoted(kind);
            return self.unit.literal(value, Spelling::Sized { bits, is_signed }, kind, AT);
        }
        match self.unit.literal_kind(value, !is_hex, suffix) {
            Some(kind) => self.unit.literal(value, spelling, kind, AT),
            None => self.unit.literal(0, Spelling::Decimal, IntKind::Int, AT),
        }
    }

    /// The expression of a statement: an outermost side effect never depends on the order of evaluation.
    fn top(&mut self, value: &Value) -> Expr {
        let effects = std::mem::replace(&mut self.has_effects, true);
        let is_effect = matches!(
            value,
            Value::Assign(..) | Value::Update(..) | Value::Step(..) | Value::Call(..)
        );
        let expr = if effects || !is_effect {
            self.has_effects = effects;
            self.expr(value)
        } else {
            self.has_effects = false;
            self.effect(value)
        };
        self.has_effects = effects;
        expr
    }

    fn scalar(&mut self, value: &Value) -> Expr {
        let value = self.top(value);
        self.unit.scalar(value).unwrap_or_else(|_| self.number(1, 0))
    }

    fn expr(&mut self, value: &Value) -> Expr {
        let is_effect = matches!(
            value,
            Value::Assign(..) | Value::Update(..) | Value::Step(..) | Value::Call(..)
        );
        if is_effect && !self.has_effects {
            return self.number(7, 0);
        }
        self.effect(value)
    }

    fn effect(&mut self, value: &Value) -> Expr {
        let result = match value {
            Value::Number(value, form) => return self.number(*value, *form),
            Value::Word(at) => return self.word(*at),
            Value::Object(spot) => self.spot(spot).and_then(|place| self.unit.read(place).ok()),
            Value::Address(spot) => {
                self.spot(spot).and_then(|place| self.unit.address(place, AT).ok())
            }
            Value::Unary(op, a) => {
                let a = self.expr(a);
                let ops = [UnaryOp::Plus, UnaryOp::Neg, UnaryOp::BitNot, UnaryOp::Not];
                self.unit.unary(ops[usize::from(op % 4)], a, AT).ok()
            }
            Value::Binary(op, a, b) => {
                let (a, b) = (self.expr(a), self.expr(b));
                let op = BinaryOp::ALL[usize::from(op % 16)];
                self.unit.binary(op, a.clone(), b, AT).ok().or(Some(a))
            }
            Value::Logical(is_and, a, b) => {
                let (a, b) = (self.expr(a), self.expr(b));
                let op = if *is_and { LogicalOp::And } else { LogicalOp::Or };
                self.unit.logical(op, a.clone(), b, AT).ok().or(Some(a))
            }
            Value::Choose(c, a, b) => {
                let (c, a, b) = (self.expr(c), self.expr(a), self.expr(b));
                self.unit.choose(c, a.clone(), b, AT).ok().or(Some(a))
            }
            Value::Comma(a, b) => {
                let (a, b) = (self.expr(a), self.expr(b));
                Some(self.unit.comma(a, b, AT))
            }
            Value::Cast(to, a) => {
                let a = self.expr(a);
                let to = self.kind(*to % 16);
                self.unit.cast(to, a.clone(), AT).ok().or(Some(a))
            }
            Value::Assign(spot, value) => {
                let value = self.expr(value);
                self.spot(spot).and_then(|place| self.unit.assign(place, value, AT).ok())
            }
            Value::Update(op, spot, value) => {
                let value = self.expr(value);
                let op = BinaryOp::ALL[usize::from(op % 16)];
                self.spot(spot)
                    .filter(|_| op.can_update())
                    .and_then(|place| self.unit.update(op, place, value, AT).ok())
            }
            Value::Step(how, spot) => self
                .spot(spot)
                .and_then(|place| self.unit.step(how % 2 == 0, how % 4 < 2, place, AT).ok()),
            Value::Call(to, a, b) => self.call(*to, a, b),
            Value::SizeOf(of, a) => {
                let a = self.expr(a);
                let operand = match (of % 3, a.kind) {
                    (0, ExprKind::Read(place)) => SizeOfOperand::Place(*place),
                    (1, kind)
                        if !matches!(
                            kind,
                            ExprKind::Function(_) | ExprKind::Read(_) | ExprKind::Decay(_)
                        ) =>
                    {
                        SizeOfOperand::Value(Expr { kind, ty: a.ty, span: AT })
                    }
                    _ => SizeOfOperand::Type(self.kind(*of)),
                };
                self.unit.size_of(operand, AT).ok()
            }
        };
        result.unwrap_or_else(|| self.number(3, 0))
    }

    fn call(&mut self, to: u8, a: &Value, b: &Value) -> Option<Expr> {
        let (a, b) = (self.expr(a), self.expr(b));
        let callee = match to % 3 {
            0 => self.unit.function(self.id("sum"), AT),
            1 => self.unit.function(self.id("unknown"), AT),
            _ => {
                let node = self.unit.place_of(self.id("self"), AT).ok()?;
                let node = self.unit.deref(self.unit.read(node).ok()?, AT).ok()?;
                self.unit.read(self.unit.member(node, "call", AT).ok()?).ok()?
            }
        };
        self.unit.call(callee, vec![a, b], AT).ok()
    }

    fn word(&self, at: u8) -> Expr {
        match at % 6 {
            0 => Expr { kind: ExprKind::Bool(at > 100), ty: Type::INT, span: AT },
            1 => Expr { kind: ExprKind::Null, ty: Type::pointer(Type::Void.into()), span: AT },
            2 => self.unit.constant_of(self.id("BLUE"), AT),
            3 => self.unit.constant_of(self.id("INT32_MIN"), AT),
            4 => self.unit.constant_of(self.id("UINT16_MAX"), AT),
            _ => self.unit.function(self.id("sum"), AT),
        }
    }

    /// The place, or a part of it that exists.
    fn spot(&mut self, spot: &Spot) -> Option<Place> {
        let byte = self.unit.place_of(self.id("byte"), AT).ok();
        match spot {
            Spot::Symbol(at) => {
                let id = self.visible[usize::from(*at) % self.visible.len()];
                self.unit.place_of(id, AT).ok()
            }
            Spot::Member(base, at) => {
                let base = self.spot(base)?;
                self.member(base.clone(), *at).or(Some(base))
            }
            Spot::Element(base, index) => {
                let base = self.spot(base)?;
                let index = self.expr(index);
                self.unit.element(base.clone(), index, AT).ok().or(Some(base))
            }
            Spot::At(pointer, index) => {
                let (pointer, index) = (self.expr(pointer), self.expr(index));
                // An element of an array is a different place.
                if matches!(pointer.kind, ExprKind::Decay(_)) {
                    return byte;
                }
                self.unit.at(pointer, index, AT).ok().or(byte)
            }
            Spot::Deref(pointer) => {
                let pointer = self.expr(pointer);
                self.unit.deref(pointer, AT).ok().or(byte)
            }
        }
    }

    fn member(&self, base: Place, at: u8) -> Option<Place> {
        let base = match base.ty.target() {
            Some(_) => {
                let pointer = self.unit.read(base).ok()?;
                self.unit.deref(pointer, AT).ok()?
            }
            None => base,
        };
        let members = &self.unit.structs[base.ty.as_struct()?].members;
        let name = members[usize::from(at) % members.len()].name.clone();
        self.unit.member(base, &name, AT).ok()
    }
}
