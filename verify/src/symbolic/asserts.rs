//! Asserts that the invariants or one step of induction decide.

use grafsynth_ir::Valid;
use grafsynth_ir::facts::{Facts, Proof as ProvedBy};
use grafsynth_ir::net::{Driver, Expr, Leaf, Net, PropertyExpr, PropertyLeaf};

use super::aig::Lit;
use super::number::Number;
use super::reaction::{self, Inputs};
use super::shared::Shared;
use super::state::Value;
use super::{Model, known_depth, reach};
use crate::limits::Limits;

/// Proves that a property of rows is never true after a reaction, for a net of any size. Either the invariants exclude it, or induction over one reaction
/// proves it, for any `dt`. `None` if neither works; the caller checks row 0.
pub(crate) fn never(
    net: &Valid<Net>,
    facts: &Facts,
    limits: &Limits,
    property: &PropertyExpr,
) -> Option<ProvedBy> {
    reaction::refuse_open_cells(net).ok()?;
    let never = over_state(net, property)?;
    let mut model = Model::of(net, known_depth(facts), limits).ok()?;
    reach::any_time(&mut model);
    if net.settings.policy.is_statechart() {
        return model.never_by_structure(facts, limits, &never);
    }
    let (state, inputs) = (model.state.clone(), model.inputs.clone());
    let now = model.maker.forbidden(&state, &inputs, &never);
    if model.difference(&mut Shared::new(), (facts, limits), now, Lit::FALSE)?.is_none() {
        return Some(ProvedBy::Structural);
    }
    // The previous row had its own inputs; all that is known about them is that the property was not violated.
    let before = Inputs {
        values: inputs
            .values
            .iter()
            .zip(net.inputs.values())
            .map(|(value, input)| match (value, input.ty) {
                (Value::Flag(_), _) => Value::Flag(model.aig().variable()),
                (Value::Number(_), ty) => {
                    let bits: Vec<Lit> = (0..ty.bits()).map(|_| model.aig().variable()).collect();
                    Value::Number(Number::from_code(model.aig(), &bits, ty.bounds().0))
                }
            })
            .collect(),
        ..inputs.clone()
    };
    let held = model.maker.forbidden(&state, &before, &never);
    let next = model.maker.reaction(&state, &inputs).ok()?;
    let then = model.maker.forbidden(&next.state, &inputs, &never);
    let broken = model.aig().and(then, !held);
    model
        .difference(&mut Shared::new(), (facts, limits), broken, Lit::FALSE)?
        .is_none()
        .then_some(ProvedBy::Induction)
}

impl Model<'_> {
    /// Proves that a statechart never violates a property, by the invariants of its states alone.
    fn never_by_structure(
        &mut self,
        facts: &Facts,
        limits: &Limits,
        never: &Expr,
    ) -> Option<ProvedBy> {
        self.prove_structure(limits).ok()?;
        let (state, inputs) = (self.state.clone(), self.inputs.clone());
        self.structure = Some(self.maker.structure(&state));
        let now = self.maker.forbidden(&state, &inputs, never);
        self.difference(&mut Shared::new(), (facts, limits), now, Lit::FALSE)?
            .is_none()
            .then_some(ProvedBy::Structural)
    }
}

/// A property as an expression over the state and the inputs, with outputs replaced by their drivers. `None` for properties that need more, and for those that
/// read times, whose caps may be below the property's constants.
pub(super) fn over_state(net: &Net, property: &PropertyExpr) -> Option<Expr> {
    let with_outputs = property.leaves().any(|leaf| leaf.net().is_none());
    let emergency = net.emergency.iter().filter(|_| with_outputs).map(|one| &one.condition);
    let has_time = (property.leaves().filter_map(PropertyLeaf::net))
        .chain(emergency.flat_map(Expr::leaves))
        .any(Leaf::is_time);
    if has_time {
        return None;
    }
    let leaf = |leaf: &PropertyLeaf, span| match leaf {
        PropertyLeaf::Net(leaf) => Ok(Expr::leaf(*leaf, span)),
        PropertyLeaf::Output(id) => {
            let value = match &net.outputs[*id].driver {
                Driver::Continuous(emissions) => Expr::or(emissions.iter().map(|emission| {
                    let active = Expr::leaf(Leaf::Active(emission.step), span);
                    Expr::and([active].into_iter().chain(emission.condition.clone()))
                })),
                Driver::Stored(var) => Expr::leaf(Leaf::Var(*var), span),
                Driver::Controlled(action) => Expr::leaf(Leaf::Controlled(*action), span),
                Driver::Mealy(_) | Driver::Fires(_) | Driver::Extern { .. } => return Err(()),
            };
            Ok(net.forced(*id, value))
        }
    };
    let mut array = |leaf: &PropertyLeaf, _| leaf.net().copied().ok_or(());
    property.try_map(&mut |one, span| leaf(one, span), &mut array).ok()
}
