//! Expressions of the text form: operator precedence, with a bound on depth.

use super::SUFFIXES;
use super::lexer::Kind;
use super::parse::{Fail, Parser, Signal};
use crate::codes;
use crate::expr::{ArithOp, CompareOp, Expr, ExprKind};
use crate::interval::DEPTH_LIMIT;
use crate::net::{Leaf, OutputId, PropertyLeaf};
use crate::span::Span;

/// An expression and its height.
type Tall<L> = (Box<Expr<L>>, usize);

/// Leaves that the text form can refer to.
pub(super) trait ReadLeaf: Sized {
    fn net(leaf: Leaf) -> Self;
    /// The leaf for an output; `None` if outputs cannot be read.
    fn output(id: OutputId) -> Option<Self>;
}

impl ReadLeaf for Leaf {
    fn net(leaf: Leaf) -> Self {
        leaf
    }
    fn output(_: OutputId) -> Option<Self> {
        None
    }
}

impl ReadLeaf for PropertyLeaf {
    fn net(leaf: Leaf) -> Self {
        PropertyLeaf::Net(leaf)
    }
    fn output(id: OutputId) -> Option<Self> {
        Some(PropertyLeaf::Output(id))
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Infix {
    Or,
    And,
    Compare(CompareOp),
    Arith(ArithOp),
}

impl Infix {
    /// The precedence level of the operator, as in the printer.
    fn level(self) -> u8 {
        match self {
            Infix::Or => 1,
            Infix::And => 2,
            Infix::Compare(_) => 4,
            Infix::Arith(op) => 5 + u8::from(!op.is_sum()),
        }
    }
}

impl Parser<'_> {
    pub(super) fn expr<L: ReadLeaf>(&mut self) -> Result<Expr<L>, Fail> {
        Ok(*self.above(0, 0)?.0)
    }

    /// An expression whose operators bind tighter than `level`.
    fn above<L: ReadLeaf>(&mut self, level: u8, depth: usize) -> Result<Tall<L>, Fail> {
        let mut left = self.operand(level, depth)?;
        let mut compared = false;
        while let Some(op) = self.infix().filter(|op| op.level() > level) {
            if matches!(op, Infix::Compare(_)) && std::mem::replace(&mut compared, true) {
                return self.chained();
            }
            self.bump();
            // Both operands of a comparison are sums; operators of one level group to the left.
            let right = self.above(op.level(), depth + 1)?;
            left = combine(op, left, right);
            while matches!(op, Infix::And | Infix::Or) && self.infix() == Some(op) {
                self.bump();
                let more = self.above(op.level(), depth + 1)?;
                append(&mut left, more);
            }
            self.not_too_deep(left.1)?;
        }
        Ok(left)
    }

    fn chained<T>(&mut self) -> Result<T, Fail> {
        self.fail(codes::NET_SYNTAX, self.here(), "comparisons cannot be chained: use parentheses")
    }

    fn not_too_deep(&mut self, levels: usize) -> Result<(), Fail> {
        if levels <= DEPTH_LIMIT {
            return Ok(());
        }
        self.fail(
            codes::NET_LIMIT,
            self.here(),
            format!("the expression has more than {DEPTH_LIMIT} levels"),
        )
    }

    fn infix(&self) -> Option<Infix> {
        let token = self.token();
        if !matches!(token.kind, Kind::Word | Kind::Symbol) {
            return None;
        }
        Some(match self.text() {
            "or" => Infix::Or,
            "and" => Infix::And,
            "=" => Infix::Compare(CompareOp::Eq),
            "<>" => Infix::Compare(CompareOp::Ne),
            "<" => Infix::Compare(CompareOp::Lt),
            "<=" => Infix::Compare(CompareOp::Le),
            ">" => Infix::Compare(CompareOp::Gt),
            ">=" => Infix::Compare(CompareOp::Ge),
            "+" => Infix::Arith(ArithOp::Add),
            "-" => Infix::Arith(ArithOp::Sub),
            "*" => Infix::Arith(ArithOp::Mul),
            "/" => Infix::Arith(ArithOp::Div),
            "mod" => Infix::Arith(ArithOp::Mod),
            "band" => Infix::Arith(ArithOp::BitAnd),
            "bor" => Infix::Arith(ArithOp::BitOr),
            "bxor" => Infix::Arith(ArithOp::BitXor),
            "shl" => Infix::Arith(ArithOp::Shl),
            "shr" => Infix::Arith(ArithOp::Shr),
            _ => return None,
        })
    }

    /// An operand. Each form has a function of its own, which keeps the stack frames of the recursion small.
    fn operand<L: ReadLeaf>(&mut self, level: u8, depth: usize) -> Result<Tall<L>, Fail> {
        // Each level of the expression has at most one operator and one pair of parentheses.
        self.not_too_deep(depth.div_ceil(2))?;
        match (self.token().kind, self.text()) {
            (Kind::Symbol, "(") => {
                self.bump();
                let inner = self.above(0, depth + 1)?;
                self.expect(")")?;
                Ok(inner)
            }
            (Kind::Symbol, "-") => self.minus(depth),
            (Kind::Word, "not") if level <= 3 => self.negation(depth),
            (Kind::Word, "and" | "or") => self.junction(depth),
            (Kind::Word, "select") => self.select(depth),
            (Kind::Word, "true" | "false") => Ok(self.truth()),
            (Kind::Number, _) => self.constant(),
            _ => self.leaf_or_element(depth),
        }
    }

    fn truth<L>(&mut self) -> Tall<L> {
        let value = self.text() == "true";
        let span = self.here();
        self.bump();
        tall(ExprKind::Bool(value), span, 0)
    }

    fn constant<L>(&mut self) -> Result<Tall<L>, Fail> {
        let start = self.here();
        let value = self.integer()?;
        let span = start.to(self.before());
        self.no_unit(value, start);
        Ok(tall(ExprKind::Int(value), span, 0))
    }

    fn negation<L: ReadLeaf>(&mut self, depth: usize) -> Result<Tall<L>, Fail> {
        let start = self.here();
        self.bump();
        let (inner, height) = self.above(2, depth + 1)?;
        let span = start.to(inner.span);
        Ok(tall(ExprKind::Not(inner), span, height))
    }

    /// Parses `and(..)`, the form of a conjunction of fewer than two operands.
    fn junction<L: ReadLeaf>(&mut self, depth: usize) -> Result<Tall<L>, Fail> {
        let start = self.here();
        let is_and = self.text() == "and";
        self.bump();
        let (all, height) = self.several(depth)?;
        let kind = if is_and { ExprKind::And(all) } else { ExprKind::Or(all) };
        Ok(tall(kind, start.to(self.before()), height))
    }

    fn select<L: ReadLeaf>(&mut self, depth: usize) -> Result<Tall<L>, Fail> {
        let start = self.here();
        self.bump();
        self.expect("(")?;
        let (c, h) = self.above(0, depth + 1)?;
        self.expect(",")?;
        let (a, i) = self.above(0, depth + 1)?;
        self.expect(",")?;
        let (b, j) = self.above(0, depth + 1)?;
        self.expect(")")?;
        Ok(tall(ExprKind::Select(c, a, b), start.to(self.before()), h.max(i).max(j)))
    }

    /// Parses a minus sign: `-5` is a constant, `-(5)` the negation of one.
    fn minus<L: ReadLeaf>(&mut self, depth: usize) -> Result<Tall<L>, Fail> {
        if self.peek_kind() == Kind::Number {
            return self.constant();
        }
        let start = self.here();
        self.bump();
        self.expect("(")?;
        let (inner, height) = self.above(0, depth + 1)?;
        self.expect(")")?;
        Ok(tall(ExprKind::Neg(inner), start.to(self.before()), height))
    }

    /// `( [e {, e}] )`
    fn several<L: ReadLeaf>(&mut self, depth: usize) -> Result<(Vec<Expr<L>>, usize), Fail> {
        let mut height = 0;
        let all = self.list(|parser| {
            let (expr, tall) = parser.above(0, depth + 1)?;
            height = height.max(tall);
            Ok(*expr)
        })?;
        Ok((all, height))
    }

    pub(super) fn arguments(&mut self) -> Result<Vec<Expr<Leaf>>, Fail> {
        Ok(self.several(0)?.0)
    }

    fn leaf_or_element<L: ReadLeaf>(&mut self, depth: usize) -> Result<Tall<L>, Fail> {
        let start = self.here();
        let leaf = self.leaf()?;
        if !self.eat("[") {
            return Ok(tall(ExprKind::Leaf(leaf), start.to(self.before()), 0));
        }
        let (index, height) = self.above(0, depth + 1)?;
        self.expect("]")?;
        Ok(tall(ExprKind::Element(leaf, index), start.to(self.before()), height))
    }

    fn leaf<L: ReadLeaf>(&mut self) -> Result<L, Fail> {
        let token = self.token();
        let leaf = match (token.kind, self.text()) {
            (Kind::Word, edge @ ("rise" | "fall")) => {
                let is_rise = edge == "rise";
                self.bump();
                self.expect("(")?;
                let id = self.edge()?;
                self.expect(")")?;
                if is_rise { Leaf::Rise(id) } else { Leaf::Fall(id) }
            }
            (Kind::Word, "input") => {
                self.bump();
                Leaf::Input(self.position()?)
            }
            (Kind::Word, "var") => {
                self.bump();
                Leaf::Var(self.position()?)
            }
            (Kind::Word, "timer") => {
                self.bump();
                Leaf::Timer(self.position()?)
            }
            (Kind::Word | Kind::Quoted | Kind::Position, _) => return self.named_leaf(),
            _ => return self.unexpected("a value"),
        };
        Ok(L::net(leaf))
    }

    fn named_leaf<L: ReadLeaf>(&mut self) -> Result<L, Fail> {
        let token = self.token();
        // A plain word includes its ending; after a quoted name or a position the ending is a separate token.
        let split = if token.kind == Kind::Word {
            self.text().rsplit_once('.').filter(|(_, last)| SUFFIXES.binary_search(last).is_ok())
        } else {
            None
        };
        let (owner, ending) = match split {
            Some((owner, ending)) => (
                crate::text::lexer::Token { end: token.start + owner.len(), ..token },
                Some(ending),
            ),
            None => (token, None),
        };
        self.not_reserved()?;
        self.bump();
        let ending = match ending {
            Some(ending) => Some(ending),
            None if self.token().kind == Kind::Suffix => {
                let ending = &self.text()[1..];
                self.bump();
                Some(ending)
            }
            None => None,
        };
        Ok(L::net(match ending {
            None => match self.signal(owner)? {
                Signal::Input(id) => Leaf::Input(id),
                Signal::Var(id) => Leaf::Var(id),
                Signal::Timer(id) => Leaf::Timer(id),
            },
            Some("active") => Leaf::Active(self.step_named(owner)?),
            Some("t") => Leaf::Elapsed(self.step_named(owner)?),
            Some("T") => Leaf::LastElapsed(self.step_named(owner)?),
            Some("done") => Leaf::TasksDone(self.step_named(owner)?),
            Some("fireable") => Leaf::Fireable(self.transition_named(owner)?),
            Some("q") => Leaf::Controlled(self.action_named(owner)?),
            Some("out") => {
                let id = self.output_named(owner)?;
                let span = token.span(self.file());
                return match L::output(id) {
                    Some(leaf) => Ok(leaf),
                    None => self.fail(
                        codes::NET_SYNTAX,
                        span,
                        "an output can only be read in a property",
                    ),
                };
            }
            Some(other) => {
                let message = format!("unknown ending `.{other}`");
                return self.fail(codes::NET_SYNTAX, self.before(), message);
            }
        }))
    }
}

/// An expression of this kind whose highest operand has `below` levels.
fn tall<L>(kind: ExprKind<L>, span: Span, below: usize) -> Tall<L> {
    (Box::new(Expr::new(kind, span)), below + 1)
}

fn combine<L>(op: Infix, (a, h): Tall<L>, (b, i): Tall<L>) -> Tall<L> {
    let span = a.span.to(b.span);
    let kind = match op {
        Infix::Or => ExprKind::Or(vec![*a, *b]),
        Infix::And => ExprKind::And(vec![*a, *b]),
        Infix::Compare(op) => ExprKind::Compare(op, a, b),
        Infix::Arith(op) => ExprKind::Arith(op, a, b),
    };
    tall(kind, span, h.max(i))
}

/// Adds an operand to a conjunction or disjunction.
fn append<L>(left: &mut Tall<L>, (more, height): Tall<L>) {
    left.0.span = left.0.span.to(more.span);
    left.1 = left.1.max(height + 1);
    if let ExprKind::And(all) | ExprKind::Or(all) = &mut left.0.kind {
        all.push(*more);
    }
}
