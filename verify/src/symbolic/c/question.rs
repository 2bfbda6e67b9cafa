//! The subject of a proof, and its questions.

use std::collections::BTreeMap;

use grafsynth_c::tree::{ItemKind, SymbolId, SymbolKind, Unit};
use grafsynth_c::walk::each_item;
use grafsynth_ir::Valid;
use grafsynth_ir::facts::{Facts, Invariant};
use grafsynth_ir::instance::Representation;
use grafsynth_ir::net::{Net, StepId};

use super::exec::Danger;
use crate::limits::Limits;
use crate::symbolic::aig::Lit;

/// A question of the induction; every case asks the same questions.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Question {
    /// A scalar of the instance, by its number in the hint, after a reaction.
    State(usize),
    /// An output, by its number in the hint.
    Output(usize),
    /// An output after `NAME_stop`, by its number in the hint.
    Stopped(usize),
    /// A scalar that holds nothing of the net, by its number in the hint.
    Extra(usize),
    /// The gate: reactions are skipped only if they would change nothing.
    Gate,
    /// The fault flag.
    Fault,
    /// The function that returns whether a step is active, by its number in the hint.
    Active(usize),
    /// The function that returns a variable, by its number in the hint.
    Var(usize),
    /// The calls of extern actions in a reaction.
    Calls,
    /// The calls of callbacks for changes in a reaction.
    Callbacks,
    /// An extern condition that is called more than once in a reaction, by its number in the hint.
    CalledTwice(usize),
    /// Something that the C must never do, with its location.
    Obligation(Danger, u32, usize),
    /// A scalar of the instance, by its number in the hint, whose meaning requires that some states exclude each other.
    Exclusive(usize),
    /// A scalar of the instance, by its number in the hint, at a place in a cut evolution.
    Within(Place, usize),
    /// A local of a reaction, by its number in the hint, at a place in a cut evolution.
    Local(Place, usize),
    /// The counter of the loop, by its position, at a place in a cut evolution.
    Counter(Place, usize),
    /// Whether there is another check, at a place in a cut evolution.
    GoesOn(Place),
    /// An invariant of the second encoding, by its number, at a place in a cut evolution.
    Invariant(Place, usize),
    /// The second encoding starts an evolution as the bound on its checks assumes.
    Begins,
    /// The second encoding makes progress with each check.
    Progress,
}

/// A place in a cut evolution.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Place {
    /// Before the first check.
    Start,
    /// After a check.
    Check,
    /// After the last check.
    End,
}

impl Place {
    pub(super) fn text(self) -> &'static str {
        match self {
            Place::Start => "before the first check",
            Place::Check => "after a check",
            Place::End => "after the last check",
        }
    }
}

#[derive(Clone)]
pub(super) struct Check {
    pub(super) question: Question,
    /// The condition that must never be true.
    pub(super) broken: Lit,
}

/// A case: the active step of a component, or none of its steps.
#[derive(Debug, Clone, Copy)]
pub(super) struct Focus {
    pub(super) component: usize,
    pub(super) active: Option<StepId>,
}

/// The functions of a unit by name, each with its parameters if its body is in the text.
pub type Functions<'a> = BTreeMap<&'a str, (SymbolId, &'a [SymbolId])>;

/// The functions of a unit by name.
#[must_use]
pub fn functions_of(unit: &Unit) -> Functions<'_> {
    let mut all = Functions::new();
    for (id, symbol) in unit.symbols.iter() {
        if matches!(symbol.kind, SymbolKind::Function(_)) {
            all.entry(symbol.name.as_str()).or_insert((id, &[]));
        }
    }
    let mut params: BTreeMap<SymbolId, &[SymbolId]> = BTreeMap::new();
    each_item(&unit.items, &mut |item| {
        if let ItemKind::Function { symbol, params: own, .. } = &item.kind {
            params.insert(*symbol, own);
        }
    });
    for (symbol, own) in all.values_mut() {
        *own = params.get(symbol).copied().unwrap_or_default();
    }
    all
}

/// The subject of a proof: the net with its facts, the C, the hint about their relation, and the limits.
#[derive(Clone, Copy)]
pub(super) struct Subject<'a> {
    pub(super) net: &'a Valid<Net>,
    pub(super) facts: &'a Facts,
    /// Invariants besides those of the facts.
    pub(super) further: &'a [Invariant],
    pub(super) unit: &'a Unit,
    pub(super) functions: &'a Functions<'a>,
    pub(super) hint: &'a Representation,
    /// The members, by their number in the hint, that are no part of the relation and that `NAME_init` may leave without a value.
    pub(super) unset: &'a [usize],
    /// True if the evolution is cut into its checks, so that it is not unrolled.
    pub(super) is_cut: bool,
    pub(super) limits: &'a Limits,
}
