//! Helpers for the nets of parts: names, new ids, wires and assumptions.

use grafsynth_ir::Gather;
use std::collections::{BTreeMap, BTreeSet};

use grafsynth_ir::division::{PartIndex, PartNet, Shown, Signal, Source, Wire};
use grafsynth_ir::expr::Type;
use grafsynth_ir::net::{
    Input, InputId, InputKind, Leaf, Meta, Net, Property, PropertyLeaf, PropertyRole,
};
use grafsynth_ir::{Id, Name};

/// Old ids with their new ids, in order.
pub(crate) type Ids<T> = BTreeMap<Id<T>, Id<T>>;

/// The wires of signals, each with its name and the part that drives it.
pub(crate) fn connect(
    parts: &[PartNet],
    signals: impl IntoIterator<Item = (Signal, String, PartIndex)>,
) -> Vec<Wire> {
    let of = |(signal, name, from): (Signal, String, PartIndex)| {
        let shows = |(_, shown): &(_, &Shown)| **shown == Shown::Wire(signal);
        let (output, _) = parts.get(from)?.outputs.iter().find(shows)?;
        let reads = |(_, source): &(InputId, &Source)| **source == Source::Wire(signal);
        let to = parts.iter().enumerate();
        let to = to.filter_map(|(part, net)| Some((part, net.inputs.iter().find(reads)?.0)));
        Some(Wire { signal, name, from, output, to: to.collect() })
    };
    signals.into_iter().filter_map(of).collect()
}

/// The names of a net with which that of a wire would be confused: outputs, inputs and steps share the columns of a trace.
pub(crate) fn used_names(net: &Net) -> BTreeSet<String> {
    let inputs = net.inputs.values().map(|it| it.name.text.as_str());
    let outputs = net.outputs.values().map(|it| it.name.text.as_str());
    let steps = net.steps.values().map(|it| it.name.text.as_str());
    let vars = net.vars.values().map(|it| it.name.text.as_str());
    inputs.chain(outputs).chain(steps).chain(vars).map(str::to_owned).gather()
}

/// The name, made different from those that are used.
pub(crate) fn unused(mut name: String, used: &mut BTreeSet<String>) -> String {
    while !used.insert(name.clone()) {
        name.push('_');
    }
    name
}

/// The name, made different from those of a net with which it would be confused.
#[must_use]
pub fn unused_name(net: &Net, name: &str) -> String {
    unused(name.to_owned(), &mut used_names(net))
}

/// Numbers ids from 0 in their order.
pub(crate) fn numbered<T>(ids: impl IntoIterator<Item = Id<T>>) -> Ids<T> {
    ids.into_iter().enumerate().map(|(at, id)| (id, Id::from_index(at))).gather()
}

/// The input of a part that reads a wire. It changes only between two rounds.
pub(crate) fn wire_input(name: Name) -> Input {
    let (ty, kind, meta) = (Type::Bool, InputKind::Pin, Meta::default());
    Input { name, ty, kind, synchronous: true, meta }
}

/// An assumption of the net in the ids of a part, if all its inputs are there. The others only exclude rows, so a part without them is proved for more rows than
/// it gets.
pub(crate) fn assumption(property: &Property, inputs: &Ids<Input>) -> Option<Property> {
    let here = |leaf: &PropertyLeaf| matches!(leaf, PropertyLeaf::Net(Leaf::Input(id)) if inputs.contains_key(id));
    if property.role != PropertyRole::Assume || !property.never.leaves().all(here) {
        return None;
    }
    let mut property = property.clone();
    property.never = property.never.map_leaves(&|leaf| match leaf {
        PropertyLeaf::Net(Leaf::Input(id)) => {
            PropertyLeaf::Net(Leaf::Input(inputs.get(id).copied().unwrap_or(*id)))
        }
        other => *other,
    });
    Some(property)
}

/// True if a net reads an input, or if it is an event or a function. The part of a statechart on the CPU has inputs that only chips read.
pub(crate) fn reads(net: &Net, input: InputId) -> bool {
    net.inputs[input].kind != InputKind::Pin
        || net.expressions().flat_map(|expr| expr.leaves()).any(|leaf| leaf.input() == Some(input))
}
