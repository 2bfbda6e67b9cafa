//! All possible rows of a stimulus of a net, if there are few.

use grafsynth_ir::Gather;
use grafsynth_ir::Valid;
use grafsynth_ir::lower::program::{ProgramOptions, program as reaction};
use grafsynth_ir::net::{Expr, InputId, InputKind, Leaf, Net, PropertyLeaf};
use grafsynth_ir::program::{self, expressions};
use grafsynth_sim::{InputRow, breaks_assumption};
use std::collections::BTreeSet;

/// Every input row with one of these values of `dt` that violates no assumption and in which only one event occurs if events exclude each other; `None` if
/// there are more than `max` rows before the assumptions are checked. Inputs that do not vary have their value at reset.
#[must_use]
pub fn all(
    net: &Net,
    dts: &[u32],
    max: usize,
    varies: impl Fn(InputId) -> bool,
) -> Option<Vec<InputRow>> {
    let mut rows: Vec<InputRow> =
        dts.iter().map(|dt| InputRow { dt: *dt, ..InputRow::zero(net) }).collect();
    for (id, input) in net.inputs.iter().filter(|(_, input)| input.kind != InputKind::InternalEvent)
    {
        let one = input.ty.saturate(0);
        let (lo, hi) = if varies(id) { input.ty.bounds() } else { (one, one) };
        let width = usize::try_from(hi.abs_diff(lo)).ok()?.checked_add(1)?;
        if rows.len().checked_mul(width)? > max {
            return None;
        }
        rows = rows
            .iter()
            .flat_map(|row| (lo..=hi).map(|value| row.clone().with(id, value)))
            .collect();
    }
    let n_events = |row: &InputRow| {
        net.inputs.iter().filter(|(id, input)| input.kind.is_event() && row.value(*id) != 0).count()
    };
    rows.retain(|row| {
        !(breaks_assumption(net, row) || net.settings.events_exclusive && n_events(row) > 1)
    });
    Some(rows)
}

/// The input pins that the net reads, including those that only its properties and assumptions read.
#[must_use]
pub fn read_pins(net: &Net) -> BTreeSet<InputId> {
    let of_net = net.expressions().flat_map(Expr::leaves).filter_map(Leaf::input);
    let of_properties = net.properties.iter().flat_map(|property| property.never.leaves());
    let of_properties = of_properties.filter_map(|leaf| match leaf {
        PropertyLeaf::Net(leaf) => leaf.input(),
        PropertyLeaf::Output(_) => None,
    });
    let all: BTreeSet<InputId> = of_net.chain(of_properties).gather();
    all.into_iter().filter(|input| net.inputs[*input].kind == InputKind::Pin).gather()
}

/// True if the behaviour of the net can depend on `dt`: its reaction measures time.
#[must_use]
pub fn uses_time(net: &Valid<Net>) -> bool {
    let Ok(reaction) = reaction(net, &ProgramOptions::default()) else { return true };
    expressions(&reaction.body)
        .flat_map(|expr| expr.leaves())
        .any(|leaf| *leaf == program::Leaf::Dt)
}
