//! Divides sums that are too wide for the macrocells of a device over spare macrocells.
//!
//! ```text
//! f = a*c + a*d + b*c + b*d + e        n = a + b                 a factor: the function reads it instead of its products
//!                                  =>  f = n*c + n*d + e
//! f = p1 + .. + p20                    n = p15 + .. + p20        a part: no factor is needed, one product reads it
//!                                  =>  f = p1 + .. + p14 + n
//! ```
//! A divisor needs a macrocell. It is read through the array, so it adds one pass. It may serve several functions. The search tries one divisor,
//! then two, and so on up to the number of spare macrocells. Of the smallest sets of divisors with which the design fits, it takes the one with the
//! fewest product terms; it tries at most [`MOST_TRIES`] placements in each mode. Divisors are the kernels that two products have in common (Brayton
//! and McMullen) and parts cut to the widths that the device has.

use super::matching::{PinRequest, Rank};
use super::need::{Need, View};
use super::pins::Order;
use crate::EmitOptions;
use crate::device::{FlipFlop, Polarity};
use crate::equations::{Equation, Equations, Signal, SignalIndex, Source};
use grafsynth_ir::Gather;
use grafsynth_ir::logic::Logic;
use std::collections::BTreeSet;

/// The maximum number of placements that the search tries.
const MOST_TRIES: usize = 2000;
/// Functions with more products than this are only cut into parts: the search for kernels examines every pair of products.
const MOST_PRODUCTS: usize = 64;
/// The maximum number of divisors tried for one function.
const MOST_KERNELS: usize = 8;

type Product = Vec<(SignalIndex, bool)>;

/// A function in the search.
#[derive(Debug, Clone)]
struct Sum {
    signal: SignalIndex,
    is_registered: bool,
    is_complemented: bool,
    flip_flop: FlipFlop,
    inverter: Option<Product>,
    products: Vec<Product>,
}

impl Sum {
    fn n_terms(&self) -> usize {
        self.products.len() + self.inverter.iter().count()
    }
}

/// All sums, some of them divided; the divisors are last, as the signals from [`State::first`] on.
#[derive(Debug, Clone)]
struct State {
    sums: Vec<Sum>,
    /// For each divisor, the function in which it was found.
    owners: Vec<SignalIndex>,
    first: SignalIndex,
}

impl State {
    fn terms(&self) -> usize {
        self.sums.iter().map(Sum::n_terms).sum()
    }

    /// The state at its narrowest: `n_more` more divisors, and one product in every sum.
    fn narrow(&self, n_more: usize) -> State {
        let mut state = self.clone();
        for sum in &mut state.sums {
            sum.products.truncate(1);
            sum.inverter = None;
        }
        let Some(first) = state.sums.first().cloned() else { return state };
        for more in 0..n_more {
            let signal = self.first + more;
            state.sums.push(Sum { signal, is_registered: false, ..first.clone() });
        }
        state
    }

    /// Replaces a divisor by a separate signal in this sum and in every sum that gets smaller by it.
    fn divided(&self, at: usize, divisor: &[Product]) -> State {
        let signal = self.first + self.owners.len();
        let mut state = self.clone();
        for (index, sum) in state.sums.iter_mut().enumerate() {
            let quotient = quotient(&sum.products, divisor);
            let is_worth_it = divisor.len() * quotient.len() > quotient.len();
            if quotient.is_empty() || !(is_worth_it || index == at) {
                continue;
            }
            let covered: BTreeSet<Product> = quotient
                .iter()
                .flat_map(|rest| divisor.iter().map(move |part| union(rest, part)))
                .gather();
            sum.products.retain(|product| !covered.contains(product));
            sum.products.extend(quotient.iter().map(|rest| union(rest, &[(signal, true)])));
        }
        state.owners.push(match self.sums[at].signal.checked_sub(self.first) {
            Some(divisor) => self.owners[divisor],
            None => self.sums[at].signal,
        });
        state.sums.push(Sum {
            signal,
            is_registered: false,
            is_complemented: false,
            flip_flop: FlipFlop::D,
            inverter: None,
            products: divisor.to_vec(),
        });
        state
    }
}

/// The quotient of the algebraic division of a sum by a divisor: `sum = quotient * divisor + rest`.
fn quotient(sum: &[Product], divisor: &[Product]) -> Vec<Product> {
    let mut common: Option<BTreeSet<Product>> = None;
    for part in divisor {
        let rests: BTreeSet<Product> = sum
            .iter()
            .filter(|product| part.iter().all(|literal| product.contains(literal)))
            .map(|product| without(product, part))
            .gather();
        common = Some(match common {
            None => rests,
            Some(common) => common.intersection(&rests).cloned().gather(),
        });
    }
    common.unwrap_or_default().into_iter().collect()
}

fn without(product: &Product, part: &Product) -> Product {
    product.iter().filter(|literal| !part.contains(literal)).copied().collect()
}

fn union(a: &[(SignalIndex, bool)], b: &[(SignalIndex, bool)]) -> Product {
    let mut all: Product = a.iter().chain(b).copied().collect();
    all.sort_unstable();
    all.dedup();
    all
}

/// The kernels of a sum that save the most. For two products, the kernel is the sum of all products that contain their common literals, without these literals.
fn kernels(sum: &[Product]) -> Vec<Vec<Product>> {
    if sum.len() > MOST_PRODUCTS {
        return Vec::new();
    }
    let mut seen: BTreeSet<Vec<Product>> = BTreeSet::new();
    let mut found: Vec<(usize, Vec<Product>)> = Vec::new();
    for (at, one) in sum.iter().enumerate() {
        for other in &sum[at + 1..] {
            let common: Product =
                one.iter().filter(|literal| other.contains(literal)).copied().collect();
            if common.is_empty() {
                continue;
            }
            let mut kernel: Vec<Product> = sum
                .iter()
                .filter(|product| common.iter().all(|literal| product.contains(literal)))
                .map(|product| without(product, &common))
                .collect();
            kernel.sort_unstable();
            kernel.dedup();
            let saved = (kernel.len().saturating_sub(1)) * quotient(sum, &kernel).len();
            if kernel.len() > 1 && seen.insert(kernel.clone()) {
                found.push((saved, kernel));
            }
        }
    }
    found.sort_by(|a, b| b.0.cmp(&a.0).then_with(|| a.1.cmp(&b.1)));
    found.into_iter().take(MOST_KERNELS).map(|(_, kernel)| kernel).collect()
}

struct Search<'a> {
    order: &'a Order,
    view: View,
    /// The capacity of each macrocell without and with its flip-flop, the widest first.
    cells: [Vec<usize>; 2],
    tries: usize,
    best: Option<State>,
}

impl Search<'_> {
    /// The number of product terms of a function without a macrocell: the first that the quick check finds, otherwise the narrowest. `None` if everything fits.
    fn misplaced(&mut self, state: &State) -> Option<usize> {
        self.tries += 1;
        // A quick check without pins: the widest functions must fit in the widest macrocells, one by one.
        for (cells, is_registered) in self.cells.iter().zip([false, true]) {
            let of_kind = state.sums.iter().filter(|sum| sum.is_registered == is_registered);
            let mut terms: Vec<usize> = of_kind.map(Sum::n_terms).collect();
            terms.sort_unstable_by(|a, b| b.cmp(a));
            if let Some((terms, _)) = terms.iter().zip(cells).find(|(terms, limit)| terms > limit) {
                return Some(*terms);
            }
        }
        let read: BTreeSet<SignalIndex> =
            (state.sums.iter().flat_map(|sum| sum.products.iter().chain(&sum.inverter).flatten()))
                .map(|literal| literal.0)
                .gather();
        let mut order = self.order.clone();
        let need = |sum: &Sum| Need::Macrocell {
            terms: sum.n_terms(),
            is_registered: sum.is_registered,
            is_read: read.contains(&sum.signal),
        };
        for sum in &state.sums {
            match order.wishes.iter_mut().find(|wish| wish.index == sum.signal) {
                Some(wish) => wish.need = need(sum),
                None => order.wishes.push(PinRequest {
                    index: sum.signal,
                    need: need(sum),
                    key: 0,
                    kept: None,
                    rank: Rank::Inner,
                    natural: None,
                }),
            }
        }
        let attempt = order.attempt(self.view);
        if attempt.fits() {
            return None;
        }
        let left = attempt.left.iter().map(|wish| wish.index);
        let refused = attempt.refused.iter().map(|(at, ..)| order.board[*at].1);
        let left: BTreeSet<SignalIndex> = left.chain(refused).gather();
        let left = state.sums.iter().filter(|sum| left.contains(&sum.signal));
        Some(left.map(Sum::n_terms).min().unwrap_or(usize::MAX))
    }

    /// Divides further, at most this many times.
    fn deepen(&mut self, state: &State, depth: usize) {
        if depth == 0 && self.best.as_ref().is_some_and(|best| state.terms() >= best.terms()) {
            return;
        }
        let Some(narrowest) = self.misplaced(state) else {
            if self.best.as_ref().is_none_or(|best| state.terms() < best.terms()) {
                self.best = Some(state.clone());
            }
            return;
        };
        if depth == 0 {
            return;
        }
        // Dividing another function of the same width may help as well.
        let mut wide: Vec<usize> = (0..state.sums.len())
            .filter(|&at| state.sums[at].n_terms() >= narrowest.max(3))
            .collect();
        wide.sort_by_key(|&at| usize::MAX - state.sums[at].products.len());
        for at in wide {
            for divisor in self.divisors(&state.sums[at]) {
                if self.tries >= MOST_TRIES {
                    return;
                }
                self.deepen(&state.divided(at, &divisor), depth - 1);
            }
        }
    }

    fn divisors(&self, sum: &Sum) -> Vec<Vec<Product>> {
        let n = sum.products.len();
        let own = &self.cells[usize::from(sum.is_registered)];
        let rest = own.iter().filter(|width| **width < n).map(|width| n + 1 - width);
        let sizes: BTreeSet<usize> = rest.chain(self.cells[0].iter().copied()).gather();
        // Products with common literals stay together: such a part may be divided further, and few functions share its literals.
        let mut products = sum.products.clone();
        products.sort_by(|a, b| b.cmp(a));
        let parts = sizes.into_iter().filter(|size| (2..n).contains(size));
        let parts = parts.map(|size| products[..size].to_vec());
        kernels(&sum.products).into_iter().chain(parts).collect()
    }
}

impl Equations {
    /// Divides sums that fit in no macrocell over as few spare macrocells as possible. If the design still does not fit, nothing changes.
    pub(crate) fn divide(
        &mut self,
        logic: &Logic,
        options: &EmitOptions,
        name: &mut dyn FnMut(&str, usize) -> String,
    ) {
        let mut findings = Vec::new();
        let order = self.order(logic, options, &mut findings);
        let n_functions = self.equations.len();
        let spare = self.device.macrocells.len().saturating_sub(n_functions);
        // The capacity of blocks is counted differently, and their sums can be wide.
        if !findings.is_empty() || spare == 0 || self.device.blocks.is_some() {
            return;
        }
        let sums = self.equations.iter().map(|equation| Sum {
            signal: equation.signal,
            is_registered: equation.is_registered,
            is_complemented: equation.is_complemented,
            flip_flop: equation.flip_flop,
            inverter: equation.inverter.clone(),
            products: equation.products.iter().map(|product| union(product, &[])).collect(),
        });
        let start = State { sums: sums.collect(), owners: Vec::new(), first: self.signals.len() };
        for view in View::all(self.device, order.has_registers) {
            let cells = [false, true].map(|is_registered| {
                let cells = self.device.macrocells.iter();
                let mut cells: Vec<usize> =
                    cells.map(|cell| view.terms(cell, is_registered) as usize).collect();
                cells.sort_unstable_by(|a, b| b.cmp(a));
                cells
            });
            let mut search = Search { order: &order, view, cells, tries: 0, best: None };
            let mut depth = 1;
            while depth <= spare && search.best.is_none() && search.tries < MOST_TRIES {
                // Tests whether there are enough pins if all sums are narrow.
                if search.misplaced(&start.narrow(depth)).is_some() {
                    break;
                }
                search.deepen(&start, depth);
                depth += 1;
            }
            if let Some(best) = search.best {
                self.take(best, name);
                return;
            }
        }
    }

    fn take(&mut self, state: State, name: &mut dyn FnMut(&str, usize) -> String) {
        for (at, owner) in state.owners.iter().enumerate() {
            let count = self
                .signals
                .iter()
                .filter(|signal| matches!(signal.source, Source::Buried(_)))
                .count();
            let n_of_owner = state.owners[..=at].iter().filter(|other| *other == owner).count();
            let own = name(&self.signals[*owner].name, n_of_owner);
            debug_assert_eq!(self.signals.len(), state.first + at, "divisors follow all signals");
            let meta = &self.signals[*owner].meta;
            let mut signal = Signal::new(own, Source::Buried(count), meta);
            // If a pin can only be the complement of the sum, it shows the node inverted.
            signal.is_pin_inverted = self.device.polarity == Polarity::ActiveLow;
            self.signals.push(signal);
        }
        self.equations = state
            .sums
            .into_iter()
            .map(|sum| Equation {
                signal: sum.signal,
                is_complemented: sum.is_complemented,
                is_registered: sum.is_registered,
                products: sum.products,
                flip_flop: sum.flip_flop,
                inverter: sum.inverter,
            })
            .collect();
        self.depth = self.longest_chain();
    }

    /// The length of the longest chain of buried nodes.
    fn longest_chain(&self) -> usize {
        let buried: Vec<&Equation> = (self.equations.iter())
            .filter(|equation| matches!(self.signals[equation.signal].source, Source::Buried(_)))
            .collect();
        let mut depths: std::collections::BTreeMap<SignalIndex, usize> =
            buried.iter().map(|equation| (equation.signal, 1)).gather();
        // There are no cycles, so the depth is stable after as many rounds as there are nodes.
        for _ in 0..buried.len() {
            for equation in &buried {
                let below =
                    equation.products.iter().flatten().filter_map(|(signal, _)| depths.get(signal));
                let depth = 1 + below.copied().max().unwrap_or(0);
                depths.insert(equation.signal, depth);
            }
        }
        depths.into_values().max().unwrap_or(0)
    }
}
