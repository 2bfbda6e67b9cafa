//! The forms of a flip-flop's function, and the product terms of each: D or T, plain or inverted, with and without don't-cares.
//!
//! A D flip-flop stores its input, a T flip-flop toggles if its input is 1: its function is the next value xor the present one. A macrocell with
//! programmable polarity can use the sum of the complement instead. A flip-flop that stores the complement of its bit needs the same four sums. The figures
//! show which forms a device should offer; docs/benchmarks.md lists them for families of charts.

use grafsynth_ir::logic::{Flop, FlopId, Logic, NodeId};
use grafsynth_ir::program::Origin;
use grafsynth_logic::bdd::{Bdd, Full, Ref};
use grafsynth_logic::minimise::{Budget, Minimum, Refused, minimise};
use grafsynth_logic::node_bdds::{Functions, Var};

/// A form of a flip-flop's function.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Form {
    /// The next value.
    D,
    /// The complement, inverted by the macrocell.
    InvertedD,
    /// True if the value changes.
    T,
    /// True if the value does not change, inverted by the macrocell.
    InvertedT,
}

impl Form {
    /// All forms.
    pub const ALL: [Form; 4] = [Form::D, Form::InvertedD, Form::T, Form::InvertedT];
    /// The forms of a D flip-flop.
    pub const OF_D: [Form; 2] = [Form::D, Form::InvertedD];
}

/// The size of a sum of products.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sum {
    /// The number of products.
    pub products: usize,
    /// Whether it is the minimum.
    pub minimum: Minimum,
}

/// The sums of one function, in the order of [`Form::ALL`].
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Forms {
    /// The flip-flop.
    pub name: String,
    /// Without don't-cares.
    pub as_it_is: [Sum; 4],
    /// With all don't-cares: [`Logic::never`] and [`Logic::unreachable`], over any signal of the circuit.
    pub with_dont_cares: [Sum; 4],
}

impl Forms {
    /// The minimum number of products among these forms, and the first form that has it.
    #[must_use]
    pub fn best(&self, forms: &[Form], dont_cares: bool) -> (usize, Form) {
        let sums = if dont_cares { &self.with_dont_cares } else { &self.as_it_is };
        let known = Form::ALL.iter().zip(sums).filter(|(form, _)| forms.contains(form));
        known.map(|(form, sum)| (sum.products, *form)).min().unwrap_or((0, Form::D))
    }
}

/// The forms of each flip-flop that stores a step, or a bit of a code for several steps.
///
/// # Errors
/// The budget is too small for a function without don't-cares.
pub fn of_steps(logic: &Logic, budget: Budget) -> Result<Vec<Forms>, Refused> {
    let of_step = |flop: &Flop| {
        flop.holds.is_none_or(|holds| matches!(holds.origin, Origin::Step(_) | Origin::Region(_)))
    };
    logic
        .flops
        .iter()
        .filter(|(_, flop)| of_step(flop))
        .map(|(id, flop)| {
            Ok(Forms {
                name: flop.name.clone(),
                as_it_is: sums(logic, flop.next, Some(id), &[], budget)?,
                with_dont_cares: sums(logic, flop.next, Some(id), &free(logic), budget)?,
            })
        })
        .collect()
}

/// The number of products of each output that is not simply a flip-flop, in the better polarity and with don't-cares. An output that equals
/// a flip-flop shares its macrocell.
///
/// # Errors
/// The budget is too small.
pub fn of_outputs(logic: &Logic, budget: Budget) -> Result<Vec<usize>, Refused> {
    let own = |node: NodeId| !matches!(logic.nodes[node], grafsynth_ir::logic::Node::Flop(_));
    logic
        .outputs
        .values()
        .filter(|output| own(output.value))
        .map(|output| {
            let [plain, inverted, ..] = sums(logic, output.value, None, &free(logic), budget)?;
            Ok(plain.products.min(inverted.products))
        })
        .collect()
}

fn free(logic: &Logic) -> Vec<NodeId> {
    logic.never.iter().chain(&logic.unreachable).copied().collect()
}

/// The sums of [`Form::ALL`] of a function, for a flip-flop or for none (then T is D). Don't-cares add their own signals: an active step that a function does
/// not depend on can show that others are inactive.
fn sums(
    logic: &Logic,
    next: NodeId,
    flop: Option<FlopId>,
    dont_cares: &[NodeId],
    budget: Budget,
) -> Result<[Sum; 4], Refused> {
    let mut bdd = Bdd::with_limit(budget.nodes);
    let mut functions = Functions::new();
    let (d, t, free) = diagrams(&mut bdd, &mut functions, logic, next, flop, dont_cares)?;
    let mut sum = |value: Ref, is_complemented: bool| -> Result<Sum, Refused> {
        let on = if is_complemented { bdd.not(value)? } else { value };
        let (lower, upper) = (bdd.and_not(on, free)?, bdd.or(on, free)?);
        let (cover, minimum) = minimise(&mut bdd, lower, upper, functions.vars().len(), budget)?;
        Ok(Sum { products: cover.cubes.len(), minimum })
    };
    Ok([sum(d, false)?, sum(d, true)?, sum(t, false)?, sum(t, true)?])
}

/// The functions of a D and of a T flip-flop, and the don't-cares of both. Flip-flops come first in the order of variables.
fn diagrams(
    bdd: &mut Bdd,
    functions: &mut Functions,
    logic: &Logic,
    next: NodeId,
    flop: Option<FlopId>,
    dont_cares: &[NodeId],
) -> Result<(Ref, Ref, Ref), Full> {
    for id in logic.flops.ids().filter(|id| !dont_cares.is_empty() || Some(*id) == flop) {
        functions.level(Var::Flop(id));
    }
    let d = functions.build(bdd, logic, next)?;
    let present = match flop {
        Some(flop) => functions.flop(bdd, flop)?,
        None => Ref::FALSE,
    };
    let t = bdd.xor(d, present)?;
    let mut free = Ref::FALSE;
    for &node in dont_cares {
        let node = functions.build(bdd, logic, node)?;
        free = bdd.or(free, node)?;
    }
    Ok((d, t, free))
}

#[cfg(test)]
mod tests {
    use super::{Form, Forms, of_outputs, of_steps};
    use grafsynth_logic::build::Builder;
    use grafsynth_logic::minimise::{Budget, Minimum};

    fn products(forms: &Forms) -> ([usize; 4], [usize; 4]) {
        (forms.as_it_is.map(|sum| sum.products), forms.with_dont_cares.map(|sum| sum.products))
    }

    /// A step that is entered from two others on the same input, and left on either of two.
    fn circuit() -> grafsynth_ir::logic::Logic {
        let mut builder = Builder::default();
        let (p, first) = builder.flop_named("p", true);
        let (q, second) = builder.flop_named("q", false);
        let (s, step) = builder.flop_named("s", false);
        let inputs = ["a", "b", "c"].map(|name| builder.input_named(name));
        let [a, b, c] = inputs;
        let entered = builder.or([first, second]);
        let entered = builder.and([entered, a]);
        let left = builder.or([b, c]);
        let stays = builder.not(left);
        let stays = builder.and([step, stays]);
        builder.logic.flops[s].next = builder.or([entered, stays]);
        let leaves = builder.and([step, left]);
        let not_a = builder.not(a);
        let waits = builder.and([first, not_a]);
        builder.logic.flops[p].next = builder.or([waits, leaves]);
        builder.logic.flops[q].next = builder.and([second, not_a]);
        let mut exactly_one = Vec::new();
        for active in [first, second, step] {
            let others: Vec<_> =
                [first, second, step].into_iter().filter(|other| *other != active).collect();
            let others = builder.or(others);
            let none = builder.not(others);
            exactly_one.push(builder.and([active, none]));
        }
        let legal = builder.or(exactly_one);
        let illegal = builder.not(legal);
        builder.logic.unreachable.push(illegal);
        builder.finish()
    }

    #[test]
    fn counts_are_those_found_by_hand() {
        let forms = of_steps(&circuit(), Budget::default()).expect("small");
        let s = forms.iter().find(|forms| forms.name == "s").expect("the step");
        // D = p*a + q*a + s*/b*/c; the complement without don't-cares is (/p*/q + /a)*(/s + b + c).
        let (as_it_is, with_dont_cares) = products(s);
        assert_eq!(as_it_is[0], 3);
        assert_eq!(as_it_is[1], 6);
        // With don't-cares: a*/s + s*/b*/c, and /a*/s + s*b + s*c; T = a*/s + s*b + s*c, complement: /a*/s + s*/b*/c.
        assert_eq!(with_dont_cares, [2, 3, 3, 2]);
        assert_eq!(s.best(&Form::ALL, true), (2, Form::D));
        assert_eq!(s.best(&Form::OF_D, false), (3, Form::D));
        let all =
            forms.iter().flat_map(|forms| forms.as_it_is.iter().chain(&forms.with_dont_cares));
        assert!(all.into_iter().all(|sum| sum.minimum == Minimum::Exact));
    }

    #[test]
    fn an_output_that_is_a_step_needs_nothing() {
        let mut builder = Builder::default();
        let (_, step) = builder.flop_named("s", true);
        let input = builder.input_named("a");
        let gated = builder.or([step, input]);
        for value in [step, gated] {
            builder.logic.outputs.push(grafsynth_ir::logic::PinOutput {
                name: "y".to_owned(),
                role: grafsynth_ir::logic::PinRole::Unknown,
                value,
                registered: None,
                mealy: false,
                meta: grafsynth_ir::net::Meta::default(),
            });
        }
        // The complement of an or is one product.
        assert_eq!(of_outputs(&builder.finish(), Budget::default()), Ok(vec![1]));
    }
}
