//! Expressions, shared by the chart, the net and the reaction program: the same operators over different leaves.
//!
//! A value is a Boolean or an exact integer. There is no short-circuit evaluation and no overflow: every expression has a static interval
//! ([`crate::interval`]), and an expression whose interval exceeds 64 bits is rejected before anything is built from it. Division truncates toward zero
//! and `mod` has the sign of the dividend, as in C99. The bit operators work on the two's complement of an exact integer, which has infinitely many bits, so they
//! need no width: a mask states the width explicitly.

use crate::span::Span;
use std::convert::Infallible;

/// The type of a value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Type {
    /// False or true; in traces 0 or 1.
    Bool,
    /// An integer between both bounds, inclusive. Declared bounds fit in 32 bits; bounds of expressions fit in 64 bits.
    Int {
        /// Smallest value.
        lo: i64,
        /// Largest value, at least `lo`.
        hi: i64,
    },
}

impl Type {
    /// True for `Bool`.
    #[must_use]
    pub fn is_bool(self) -> bool {
        self == Type::Bool
    }

    /// Smallest and largest value as a number, with 0 and 1 for a Boolean.
    #[must_use]
    pub fn bounds(self) -> (i64, i64) {
        match self {
            Type::Bool => (0, 1),
            Type::Int { lo, hi } => (lo, hi),
        }
    }

    /// `value` clamped to the bounds, as an assignment stores it.
    #[must_use]
    pub fn saturate(self, value: i64) -> i64 {
        let (lo, hi) = self.bounds();
        value.clamp(lo, hi)
    }

    /// The number of bits of a register for this type, offset binary from `lo` (1 for a Boolean, 0 if `lo == hi`).
    #[must_use]
    pub fn bits(self) -> u32 {
        let (lo, hi) = self.bounds();
        64 - hi.abs_diff(lo).leading_zeros()
    }
}

/// An expression over leaves of type `L`, with its source location.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Expr<L> {
    /// The operator or leaf.
    pub kind: ExprKind<L>,
    /// Source location; an expression made by a lowering has the location of its origin.
    pub span: Span,
}

/// A comparison of two integers; `Eq` and `Ne` also compare two Booleans.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[expect(missing_docs, reason = "the names are the usual ones")]
pub enum CompareOp {
    Eq,
    Ne,
    Lt,
    Le,
    Gt,
    Ge,
}

/// Integer arithmetic. `Div` truncates toward zero, `Mod` has the dividend's sign. The bit operators read their operands as two's complement with infinitely
/// many bits; `Shl` multiplies by a power of two, and `Shr` divides by a power of two and rounds down. The amount of a shift is in `0..=63`. The complement of `x`
/// has no operator of its own: it is `x` `BitXor` -1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[expect(missing_docs, reason = "the names are the usual ones")]
pub enum ArithOp {
    Add,
    Sub,
    Mul,
    Div,
    Mod,
    BitAnd,
    BitOr,
    BitXor,
    Shl,
    Shr,
}

/// The largest amount of a shift.
pub const LARGEST_SHIFT: i64 = 63;

/// The kinds of expressions.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum ExprKind<L> {
    /// `true` or `false`.
    Bool(bool),
    /// An integer constant.
    Int(i64),
    /// A leaf: a value that is read.
    Leaf(L),
    /// One element of an array; the index counts from 0, and its interval is within the array.
    Element(L, Box<Expr<L>>),
    /// Negation of a Boolean.
    Not(Box<Expr<L>>),
    /// True if all operands are true; `And([])` is true.
    And(Vec<Expr<L>>),
    /// True if at least one operand is true; `Or([])` is false.
    Or(Vec<Expr<L>>),
    /// Comparison.
    Compare(CompareOp, Box<Expr<L>>, Box<Expr<L>>),
    /// Arithmetic negation.
    Neg(Box<Expr<L>>),
    /// Arithmetic.
    Arith(ArithOp, Box<Expr<L>>, Box<Expr<L>>),
    /// The second operand if the first is true, otherwise the third; both must be Boolean or both integer.
    Select(Box<Expr<L>>, Box<Expr<L>>, Box<Expr<L>>),
}

impl CompareOp {
    /// The result of the comparison for two numbers.
    #[must_use]
    pub fn apply(self, a: i64, b: i64) -> bool {
        match self {
            CompareOp::Eq => a == b,
            CompareOp::Ne => a != b,
            CompareOp::Lt => a < b,
            CompareOp::Le => a <= b,
            CompareOp::Gt => a > b,
            CompareOp::Ge => a >= b,
        }
    }

    /// The comparison with its sides exchanged.
    #[must_use]
    pub fn mirrored(self) -> Self {
        match self {
            CompareOp::Eq => CompareOp::Eq,
            CompareOp::Ne => CompareOp::Ne,
            CompareOp::Lt => CompareOp::Gt,
            CompareOp::Le => CompareOp::Ge,
            CompareOp::Gt => CompareOp::Lt,
            CompareOp::Ge => CompareOp::Le,
        }
    }

    /// The comparison that is true exactly when this one is false.
    #[must_use]
    pub fn negated(self) -> Self {
        match self {
            CompareOp::Eq => CompareOp::Ne,
            CompareOp::Ne => CompareOp::Eq,
            CompareOp::Lt => CompareOp::Ge,
            CompareOp::Le => CompareOp::Gt,
            CompareOp::Gt => CompareOp::Le,
            CompareOp::Ge => CompareOp::Lt,
        }
    }

    /// The operator in the chart language.
    #[must_use]
    pub fn symbol(self) -> &'static str {
        match self {
            CompareOp::Eq => "=",
            CompareOp::Ne => "<>",
            CompareOp::Lt => "<",
            CompareOp::Le => "<=",
            CompareOp::Gt => ">",
            CompareOp::Ge => ">=",
        }
    }
}

impl ArithOp {
    /// The exact result, or `None` if the divisor is 0, the amount of a shift is not in `0..=63`, or the result exceeds 64 bits (validation excludes all
    /// three).
    #[must_use]
    pub fn apply(self, a: i64, b: i64) -> Option<i64> {
        match self {
            ArithOp::Add => a.checked_add(b),
            ArithOp::Sub => a.checked_sub(b),
            ArithOp::Mul => a.checked_mul(b),
            ArithOp::Div => a.checked_div(b),
            ArithOp::Mod => a.checked_rem(b),
            ArithOp::BitAnd => Some(a & b),
            ArithOp::BitOr => Some(a | b),
            ArithOp::BitXor => Some(a ^ b),
            ArithOp::Shl => {
                let by = u32::try_from(b).ok().filter(|_| b <= LARGEST_SHIFT)?;
                i64::try_from(i128::from(a) << by).ok()
            }
            ArithOp::Shr => a.checked_shr(u32::try_from(b).ok()?),
        }
    }

    /// True for `band`, `bor`, `bxor`, `shl` and `shr`.
    #[must_use]
    pub fn is_bitwise(self) -> bool {
        match self {
            ArithOp::Add | ArithOp::Sub | ArithOp::Mul | ArithOp::Div | ArithOp::Mod => false,
            ArithOp::BitAnd | ArithOp::BitOr | ArithOp::BitXor | ArithOp::Shl | ArithOp::Shr => {
                true
            }
        }
    }

    /// True for `shl` and `shr`, whose right operand is in `0..=63`.
    #[must_use]
    pub fn is_shift(self) -> bool {
        matches!(self, ArithOp::Shl | ArithOp::Shr)
    }

    /// True if the operator binds like a sum: `+ - bor bxor`. The others bind tighter, like a product.
    #[must_use]
    pub fn is_sum(self) -> bool {
        matches!(self, ArithOp::Add | ArithOp::Sub | ArithOp::BitOr | ArithOp::BitXor)
    }

    /// The operator in the chart language.
    #[must_use]
    pub fn symbol(self) -> &'static str {
        match self {
            ArithOp::Add => "+",
            ArithOp::Sub => "-",
            ArithOp::Mul => "*",
            ArithOp::Div => "/",
            ArithOp::Mod => "mod",
            ArithOp::BitAnd => "band",
            ArithOp::BitOr => "bor",
            ArithOp::BitXor => "bxor",
            ArithOp::Shl => "shl",
            ArithOp::Shr => "shr",
        }
    }
}

impl<L> Expr<L> {
    /// An expression of this kind at `span`.
    #[must_use]
    pub fn new(kind: ExprKind<L>, span: Span) -> Self {
        Expr { kind, span }
    }

    /// `true` or `false`, made by a lowering (without a source location).
    #[must_use]
    pub fn bool(value: bool) -> Self {
        Expr::new(ExprKind::Bool(value), Span::default())
    }

    /// A constant, made by a lowering (without a source location).
    #[must_use]
    pub fn int(value: i64) -> Self {
        Expr::new(ExprKind::Int(value), Span::default())
    }

    /// A leaf at `span`.
    #[must_use]
    pub fn leaf(leaf: L, span: Span) -> Self {
        Expr::new(ExprKind::Leaf(leaf), span)
    }

    /// True for the constant `true`.
    #[must_use]
    pub fn is_true(&self) -> bool {
        matches!(self.kind, ExprKind::Bool(true))
    }

    /// True for the constant `false`.
    #[must_use]
    pub fn is_false(&self) -> bool {
        matches!(self.kind, ExprKind::Bool(false))
    }

    /// The leaf, if the expression is one.
    #[must_use]
    pub fn as_leaf(&self) -> Option<&L> {
        if let ExprKind::Leaf(leaf) = &self.kind { Some(leaf) } else { None }
    }

    /// The negation, with constants and double negation removed.
    #[must_use]
    #[expect(
        clippy::should_implement_trait,
        reason = "it simplifies, which an operator should not hide"
    )]
    pub fn not(self) -> Self {
        let span = self.span;
        match self.kind {
            ExprKind::Bool(value) => Expr::new(ExprKind::Bool(!value), span),
            ExprKind::Not(inner) => *inner,
            kind => Expr::new(ExprKind::Not(Box::new(Expr::new(kind, span))), span),
        }
    }

    /// The conjunction, flattened, with constants removed; a single operand is returned unchanged.
    #[must_use]
    pub fn and(operands: impl IntoIterator<Item = Expr<L>>) -> Self {
        Self::junction(operands, true)
    }

    /// The disjunction, flattened, with constants removed; a single operand is returned unchanged.
    #[must_use]
    pub fn or(operands: impl IntoIterator<Item = Expr<L>>) -> Self {
        Self::junction(operands, false)
    }

    /// The operands of a conjunction; any other expression is its own only operand.
    #[must_use]
    pub fn factors(&self) -> &[Expr<L>] {
        if let ExprKind::And(factors) = &self.kind { factors } else { std::slice::from_ref(self) }
    }

    /// The operands of a disjunction; any other expression is its own only operand.
    #[must_use]
    pub fn alternatives(&self) -> &[Expr<L>] {
        if let ExprKind::Or(all) = &self.kind { all } else { std::slice::from_ref(self) }
    }

    fn junction(operands: impl IntoIterator<Item = Expr<L>>, is_and: bool) -> Self {
        let mut flat = Vec::new();
        for operand in operands {
            match (operand.kind, is_and) {
                (ExprKind::Bool(value), _) if value == is_and => {}
                (ExprKind::Bool(value), _) => {
                    return Expr::new(ExprKind::Bool(value), operand.span);
                }
                (ExprKind::And(inner), true) | (ExprKind::Or(inner), false) => flat.extend(inner),
                (kind, _) => flat.push(Expr::new(kind, operand.span)),
            }
        }
        if flat.len() == 1
            && let Some(only) = flat.pop()
        {
            return only;
        }
        let span = match (flat.first(), flat.last()) {
            (Some(first), Some(last)) => first.span.to(last.span),
            _ => Span::default(),
        };
        match (flat.is_empty(), is_and) {
            (true, _) => Expr::new(ExprKind::Bool(is_and), span),
            (false, true) => Expr::new(ExprKind::And(flat), span),
            (false, false) => Expr::new(ExprKind::Or(flat), span),
        }
    }

    /// A comparison whose span covers both sides.
    #[must_use]
    pub fn compare(op: CompareOp, a: Expr<L>, b: Expr<L>) -> Self {
        let span = a.span.to(b.span);
        Expr::new(ExprKind::Compare(op, Box::new(a), Box::new(b)), span)
    }

    /// The direct operands, left to right (including the index of an element, but not its leaf).
    pub fn children(&self) -> impl Iterator<Item = &Expr<L>> {
        let (few, many): ([Option<&Expr<L>>; 3], &[Expr<L>]) = match &self.kind {
            ExprKind::Bool(_) | ExprKind::Int(_) | ExprKind::Leaf(_) => ([None; 3], &[]),
            ExprKind::Element(_, a) | ExprKind::Not(a) | ExprKind::Neg(a) => {
                ([Some(a), None, None], &[])
            }
            ExprKind::And(all) | ExprKind::Or(all) => ([None; 3], all),
            ExprKind::Compare(_, a, b) | ExprKind::Arith(_, a, b) => {
                ([Some(a), Some(b), None], &[])
            }
            ExprKind::Select(a, b, c) => ([Some(a), Some(b), Some(c)], &[]),
        };
        few.into_iter().flatten().chain(many)
    }

    /// Like [`Expr::children`], to change them.
    pub fn children_mut(&mut self) -> impl Iterator<Item = &mut Expr<L>> {
        let (few, many): ([Option<&mut Expr<L>>; 3], &mut [Expr<L>]) = match &mut self.kind {
            ExprKind::Bool(_) | ExprKind::Int(_) | ExprKind::Leaf(_) => {
                ([None, None, None], &mut [])
            }
            ExprKind::Element(_, a) | ExprKind::Not(a) | ExprKind::Neg(a) => {
                ([Some(a), None, None], &mut [])
            }
            ExprKind::And(all) | ExprKind::Or(all) => ([None, None, None], all),
            ExprKind::Compare(_, a, b) | ExprKind::Arith(_, a, b) => {
                ([Some(a), Some(b), None], &mut [])
            }
            ExprKind::Select(a, b, c) => ([Some(a), Some(b), Some(c)], &mut []),
        };
        few.into_iter().flatten().chain(many)
    }

    /// The expression and all expressions inside it, each before its operands, left to right.
    pub fn subexpressions(&self) -> impl Iterator<Item = &Expr<L>> {
        let mut open = vec![self];
        std::iter::from_fn(move || {
            let next = open.pop()?;
            let at = open.len();
            open.extend(next.children());
            open[at..].reverse();
            Some(next)
        })
    }

    /// The leaves, including the arrays of elements, left to right.
    pub fn leaves(&self) -> impl Iterator<Item = &L> {
        self.subexpressions().filter_map(|expr| match &expr.kind {
            ExprKind::Leaf(leaf) | ExprKind::Element(leaf, _) => Some(leaf),
            _ => None,
        })
    }

    /// Each leaf that is compared with a constant, on either side, and the constant.
    pub fn compared(&self) -> impl Iterator<Item = (&L, i64)> {
        self.subexpressions().filter_map(|expr| {
            let ExprKind::Compare(_, a, b) = &expr.kind else { return None };
            match (&a.kind, &b.kind) {
                (ExprKind::Leaf(leaf), ExprKind::Int(constant))
                | (ExprKind::Int(constant), ExprKind::Leaf(leaf)) => Some((leaf, *constant)),
                _ => None,
            }
        })
    }

    /// The height of the tree: 1 for a constant or leaf.
    #[must_use]
    pub fn height(&self) -> usize {
        1 + self.children().map(Expr::height).max().unwrap_or(0)
    }

    /// The same expression without source locations: two expressions of the same shape become equal. Spans inside leaves are kept.
    #[must_use]
    pub fn without_spans(&self) -> Self
    where
        L: Clone,
    {
        let mut bare = self.clone();
        bare.erase_spans();
        bare
    }

    /// Removes the source locations; see [`Expr::without_spans`].
    pub fn erase_spans(&mut self) {
        self.span = Span::default();
        self.children_mut().for_each(Expr::erase_spans);
    }

    /// The same expression over other leaves. `leaf` maps a plain leaf to an expression; `array` maps the array of an element.
    ///
    /// # Errors
    /// Returns the first error of `leaf` or `array`.
    pub fn try_map<M, E>(
        &self,
        leaf: &mut impl FnMut(&L, Span) -> Result<Expr<M>, E>,
        array: &mut impl FnMut(&L, Span) -> Result<M, E>,
    ) -> Result<Expr<M>, E> {
        let span = self.span;
        let kind = match &self.kind {
            ExprKind::Bool(value) => ExprKind::Bool(*value),
            ExprKind::Int(value) => ExprKind::Int(*value),
            ExprKind::Leaf(inner) => return leaf(inner, span),
            ExprKind::Element(inner, index) => {
                let index = Box::new(index.try_map(leaf, array)?);
                ExprKind::Element(array(inner, span)?, index)
            }
            ExprKind::Not(a) => ExprKind::Not(Box::new(a.try_map(leaf, array)?)),
            ExprKind::And(all) => {
                ExprKind::And(all.iter().map(|a| a.try_map(leaf, array)).collect::<Result<_, _>>()?)
            }
            ExprKind::Or(all) => {
                ExprKind::Or(all.iter().map(|a| a.try_map(leaf, array)).collect::<Result<_, _>>()?)
            }
            ExprKind::Compare(op, a, b) => ExprKind::Compare(
                *op,
                Box::new(a.try_map(leaf, array)?),
                Box::new(b.try_map(leaf, array)?),
            ),
            ExprKind::Neg(a) => ExprKind::Neg(Box::new(a.try_map(leaf, array)?)),
            ExprKind::Arith(op, a, b) => ExprKind::Arith(
                *op,
                Box::new(a.try_map(leaf, array)?),
                Box::new(b.try_map(leaf, array)?),
            ),
            ExprKind::Select(a, b, c) => ExprKind::Select(
                Box::new(a.try_map(leaf, array)?),
                Box::new(b.try_map(leaf, array)?),
                Box::new(c.try_map(leaf, array)?),
            ),
        };
        Ok(Expr::new(kind, span))
    }

    /// [`Expr::try_map`] without errors.
    #[must_use]
    pub fn map<M>(
        &self,
        leaf: &mut impl FnMut(&L, Span) -> Expr<M>,
        array: &mut impl FnMut(&L, Span) -> M,
    ) -> Expr<M> {
        let mapped = self.try_map::<M, Infallible>(
            &mut |inner, span| Ok(leaf(inner, span)),
            &mut |inner, span| Ok(array(inner, span)),
        );
        match mapped {
            Ok(mapped) => mapped,
            Err(never) => match never {},
        }
    }

    /// The same expression with each leaf, arrays of elements included, replaced by the result of `leaf`.
    #[must_use]
    pub fn map_leaves<M>(&self, leaf: &impl Fn(&L) -> M) -> Expr<M> {
        self.map(&mut |inner, span| Expr::leaf(leaf(inner), span), &mut |inner, _| leaf(inner))
    }

    /// The value, with 0 and 1 for Booleans. `leaf` returns the value of a leaf (index 0) or of an array element.
    ///
    /// This evaluator is for everything that produces output. The simulator and the symbolic verifier have their own, so that a mistake here cannot be proved
    /// correct. Cases that validation excludes (division by zero, more than 64 bits) give 0, so no expression can stop the program.
    pub fn eval(&self, leaf: &mut impl FnMut(&L, i64) -> i64) -> i64 {
        match &self.kind {
            ExprKind::Bool(value) => i64::from(*value),
            ExprKind::Int(value) => *value,
            ExprKind::Leaf(inner) => leaf(inner, 0),
            ExprKind::Element(array, index) => {
                let index = index.eval(leaf);
                leaf(array, index)
            }
            ExprKind::Not(a) => i64::from(a.eval(leaf) == 0),
            ExprKind::And(all) => i64::from(all.iter().all(|a| a.eval(leaf) != 0)),
            ExprKind::Or(all) => i64::from(all.iter().any(|a| a.eval(leaf) != 0)),
            ExprKind::Compare(op, a, b) => {
                let a = a.eval(leaf);
                i64::from(op.apply(a, b.eval(leaf)))
            }
            ExprKind::Neg(a) => a.eval(leaf).checked_neg().unwrap_or(0),
            ExprKind::Arith(op, a, b) => {
                let a = a.eval(leaf);
                op.apply(a, b.eval(leaf)).unwrap_or(0)
            }
            ExprKind::Select(c, a, b) => {
                let chosen = if c.eval(leaf) != 0 { a } else { b };
                chosen.eval(leaf)
            }
        }
    }

    /// The value if a leaf for which `leaf` returns `None`, and each array element, may have any value; `None` if the value depends on them or does not exist.
    pub fn known(&self, leaf: &impl Fn(&L) -> Option<i64>) -> Option<i64> {
        // One operand with this value decides, whatever the others are.
        let decided = |all: &[Expr<L>], by: i64| {
            let mut is_open = false;
            for one in all {
                match one.known(leaf) {
                    Some(value) if value == by => return Some(by),
                    Some(_) => {}
                    None => is_open = true,
                }
            }
            (!is_open).then_some(1 - by)
        };
        Some(match &self.kind {
            ExprKind::Bool(value) => i64::from(*value),
            ExprKind::Int(value) => *value,
            ExprKind::Leaf(inner) => leaf(inner)?,
            ExprKind::Element(..) => return None,
            ExprKind::Not(a) => 1 - a.known(leaf)?,
            ExprKind::And(all) => decided(all, 0)?,
            ExprKind::Or(all) => decided(all, 1)?,
            ExprKind::Compare(op, a, b) => i64::from(op.apply(a.known(leaf)?, b.known(leaf)?)),
            ExprKind::Neg(a) => a.known(leaf)?.checked_neg()?,
            ExprKind::Arith(op, a, b) => op.apply(a.known(leaf)?, b.known(leaf)?)?,
            ExprKind::Select(c, a, b) => if c.known(leaf)? != 0 { a } else { b }.known(leaf)?,
        })
    }

    /// The value of a constant, with 0 and 1 for Booleans; `None` if it depends on a leaf or does not exist (division by 0, more than 64 bits).
    #[must_use]
    pub fn as_constant(&self) -> Option<i64> {
        Some(match &self.kind {
            ExprKind::Bool(value) => i64::from(*value),
            ExprKind::Int(value) => *value,
            ExprKind::Leaf(_) | ExprKind::Element(..) => return None,
            ExprKind::Not(a) => 1 - a.as_constant()?,
            ExprKind::And(all) => all.iter().try_fold(1, |sum, a| Some(sum & a.as_constant()?))?,
            ExprKind::Or(all) => all.iter().try_fold(0, |sum, a| Some(sum | a.as_constant()?))?,
            ExprKind::Compare(op, a, b) => i64::from(op.apply(a.as_constant()?, b.as_constant()?)),
            ExprKind::Neg(a) => a.as_constant()?.checked_neg()?,
            ExprKind::Arith(op, a, b) => op.apply(a.as_constant()?, b.as_constant()?)?,
            ExprKind::Select(c, a, b) => if c.as_constant()? != 0 { a } else { b }.as_constant()?,
        })
    }
}
