//! Receptivities as Boolean formulas: simplification and small equivalence checks.
//!
//! Only this module uses the crate `boolean_expression`, and only [`Receptivity`] contains its values. Its algebra is correct and fast for the few
//! conditions that a designer writes, but it does not minimise (no don't-cares, no irredundancy), so nothing with a product-term budget uses it; see
//! [`crate::minimise`] for that.

use boolean_expression as algebra;
use grafsynth_ir::expr::{Expr, ExprKind};
use grafsynth_ir::simplify::compare_shapes;

/// The maximum number of different conditions in a formula; a larger formula is left unchanged, because the diagrams of `boolean_expression` have no limit of
/// their own.
pub const MAX_CONDITIONS: usize = 10;

/// A Boolean expression as a formula over conditions: inputs, step bits, comparisons and everything else that is not a Boolean operator.
#[derive(Debug, Clone)]
pub struct Receptivity<L> {
    formula: algebra::Expr<usize>,
    conditions: Vec<Expr<L>>,
}

impl<L: Clone + Ord> Receptivity<L> {
    /// The formula of a Boolean expression; `None` if it has more than [`MAX_CONDITIONS`] different conditions.
    #[must_use]
    pub fn of(expr: &Expr<L>) -> Option<Self> {
        let mut conditions = Vec::new();
        let formula = formula(expr, &mut conditions)?;
        Some(Receptivity { formula, conditions })
    }

    /// The number of different conditions.
    #[must_use]
    pub fn n_conditions(&self) -> usize {
        self.conditions.len()
    }

    /// True if the formula is false for all values of the conditions.
    #[must_use]
    pub fn is_never(&self) -> bool {
        self.is_constant(false)
    }

    /// True if the formula is true for all values of the conditions.
    #[must_use]
    pub fn is_always(&self) -> bool {
        self.is_constant(true)
    }

    fn is_constant(&self, value: bool) -> bool {
        let mut bdd = algebra::BDD::new();
        let function = bdd.from_expr(&self.formula);
        function == bdd.constant(value)
    }

    /// A sum of products with the same value and fewer literals, or `None` if the algebra finds nothing shorter.
    #[must_use]
    pub fn simplified(&self) -> Option<Expr<L>> {
        let simpler = self.formula.clone().simplify_via_bdd();
        if literals(&simpler) >= literals(&self.formula) {
            return None;
        }
        Some(self.expr(&simpler))
    }

    fn expr(&self, formula: &algebra::Expr<usize>) -> Expr<L> {
        match formula {
            algebra::Expr::Terminal(index) => self.conditions[*index].clone(),
            algebra::Expr::Const(value) => Expr::bool(*value),
            algebra::Expr::Not(a) => self.expr(a).not(),
            algebra::Expr::And(a, b) => Expr::and([self.expr(a), self.expr(b)]),
            algebra::Expr::Or(a, b) => Expr::or([self.expr(a), self.expr(b)]),
        }
    }
}

/// The shorter form of a Boolean expression, if there is one. An expression in which no condition occurs twice is already the shortest.
#[must_use]
pub fn simplify<L: Clone + Ord>(expr: &Expr<L>) -> Option<Expr<L>> {
    let receptivity = Receptivity::of(expr)?;
    if literals(&receptivity.formula) <= receptivity.n_conditions() {
        return None;
    }
    receptivity.simplified()
}

/// Whether two Boolean expressions have the same value for all values of their conditions. Equal conditions count as one, all others are independent. `None` if
/// there are more than [`MAX_CONDITIONS`].
#[must_use]
pub fn equivalent<L: Clone + Ord>(a: &Expr<L>, b: &Expr<L>) -> Option<bool> {
    let mut conditions = Vec::new();
    let (a, b) = (formula(a, &mut conditions)?, formula(b, &mut conditions)?);
    let mut bdd = algebra::BDD::new();
    Some(bdd.from_expr(&a) == bdd.from_expr(&b))
}

fn formula<L: Clone + Ord>(
    expr: &Expr<L>,
    conditions: &mut Vec<Expr<L>>,
) -> Option<algebra::Expr<usize>> {
    Some(match &expr.kind {
        ExprKind::Bool(value) => algebra::Expr::Const(*value),
        ExprKind::Not(a) => !formula(a, conditions)?,
        ExprKind::And(all) => junction(all, conditions, true)?,
        ExprKind::Or(all) => junction(all, conditions, false)?,
        _ => {
            let index =
                match conditions.iter().position(|known| compare_shapes(known, expr).is_eq()) {
                    Some(index) => index,
                    None if conditions.len() == MAX_CONDITIONS => return None,
                    None => {
                        conditions.push(expr.clone());
                        conditions.len() - 1
                    }
                };
            algebra::Expr::Terminal(index)
        }
    })
}

fn junction<L: Clone + Ord>(
    all: &[Expr<L>],
    conditions: &mut Vec<Expr<L>>,
    is_and: bool,
) -> Option<algebra::Expr<usize>> {
    // A long list has many conditions or many repetitions; the crate nests it, so its length is bounded too.
    if all.len() > 4 * MAX_CONDITIONS {
        return None;
    }
    let mut total: Option<algebra::Expr<usize>> = None;
    for operand in all {
        let operand = formula(operand, conditions)?;
        total = Some(match total {
            None => operand,
            Some(total) if is_and => total & operand,
            Some(total) => total | operand,
        });
    }
    Some(total.unwrap_or(algebra::Expr::Const(is_and)))
}

fn literals(formula: &algebra::Expr<usize>) -> usize {
    match formula {
        algebra::Expr::Terminal(_) => 1,
        algebra::Expr::Const(_) => 0,
        algebra::Expr::Not(a) => literals(a),
        algebra::Expr::And(a, b) | algebra::Expr::Or(a, b) => literals(a) + literals(b),
    }
}

#[cfg(test)]
mod tests {
    use super::{Receptivity, equivalent, simplify};
    use grafsynth_ir::expr::{CompareOp, Expr, ExprKind};
    use grafsynth_ir::{FileId, Span};
    use proptest::prelude::*;

    type E = Expr<u8>;

    /// A leaf at an arbitrary source location, which must not matter.
    fn leaf(name: u8, at: usize) -> E {
        Expr::leaf(name, Span::new(FileId(0), at, at + 1))
    }

    fn eval(expr: &E, values: u32) -> bool {
        expr.eval(&mut |name, _| i64::from(values >> name & 1)) != 0
    }

    fn formula() -> impl Strategy<Value = E> {
        let atom = prop_oneof![
            (0u8..5, 0usize..100).prop_map(|(name, at)| leaf(name, at)),
            any::<bool>().prop_map(E::bool)
        ];
        atom.prop_recursive(4, 24, 3, |inner| {
            prop_oneof![
                inner.clone().prop_map(|a| Expr::new(ExprKind::Not(Box::new(a)), Span::default())),
                proptest::collection::vec(inner.clone(), 0..3)
                    .prop_map(|all| Expr::new(ExprKind::And(all), Span::default())),
                proptest::collection::vec(inner, 0..3)
                    .prop_map(|all| Expr::new(ExprKind::Or(all), Span::default())),
            ]
        })
    }

    proptest! {
        #[test]
        fn simplifying_keeps_the_value(a in formula(), b in formula()) {
            if let Some(simpler) = simplify(&a) {
                for values in 0..32 {
                    prop_assert_eq!(eval(&a, values), eval(&simpler, values));
                }
                prop_assert_eq!(simplify(&a), Some(simpler));
            }
            let same = (0..32).all(|values| eval(&a, values) == eval(&b, values));
            prop_assert_eq!(equivalent(&a, &b), Some(same));
            let receptivity = Receptivity::of(&a).unwrap();
            prop_assert_eq!(receptivity.is_never(), (0..32).all(|values| !eval(&a, values)));
            prop_assert_eq!(receptivity.is_always(), (0..32).all(|values| eval(&a, values)));
        }
    }

    #[test]
    fn an_absorbed_literal_disappears() {
        // m or (not m and a) is m or a; m * (m + b) is m.
        let (m, a) = (leaf(0, 0), leaf(1, 5));
        let expr = Expr::or([m.clone(), Expr::and([leaf(0, 9).not(), a.clone()])]);
        let simpler = simplify(&expr).unwrap();
        assert_eq!(equivalent(&simpler, &Expr::or([m.clone(), a.clone()])), Some(true));
        assert_eq!(simplify(&Expr::and([m.clone(), Expr::or([leaf(0, 9), a])])), Some(m));
    }

    #[test]
    fn comparisons_are_conditions_of_their_own() {
        let at_least = |limit| Expr::compare(CompareOp::Ge, leaf(3, 0), E::int(limit));
        let expr = Expr::or([at_least(5), at_least(5).not()]);
        assert!(Receptivity::of(&expr).unwrap().is_always());
        assert_eq!(equivalent(&at_least(5), &at_least(6)), Some(false));
    }
}
