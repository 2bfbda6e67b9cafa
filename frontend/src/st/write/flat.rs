//! Expands macro-steps: textual IEC 61131-3 has none, and a net already contains their steps and transitions.

use grafsynth_ir::Gather;
use std::collections::{BTreeMap, BTreeSet};

use grafsynth_ir::Diagnostic;
use grafsynth_ir::arena::Arena;
use grafsynth_ir::net::{Net, PartId, Schedule};

use crate::codes;

/// The same net without macro-steps, and warnings about what is lost. The steps in macro-steps are named `macro.step` in the enclosing chart. A net
/// whose charts do not run in source order is not changed, because there the depth of a macro-step matters.
pub(crate) fn flat(net: &Net) -> (Net, Vec<Diagnostic>) {
    let mut flat = net.clone();
    if net.macros.is_empty() || net.settings.schedule != Schedule::Declared {
        return (flat, Vec::new());
    }
    let macros: BTreeSet<&str> = net.macros.iter().map(|one| one.name.text.as_str()).gather();
    let is_root = |id: PartId| !macros.contains(net.parts[id].name.text.as_str());
    let mut parts = Arena::new();
    let mut moved: BTreeMap<PartId, PartId> = BTreeMap::new();
    let mut lost = Vec::new();
    for (id, part) in net.parts.iter() {
        if is_root(id) {
            moved.insert(id, parts.push(part.clone()));
        }
    }
    let first = moved.values().next().copied();
    for (id, part) in net.parts.iter().filter(|(id, _)| !is_root(*id)) {
        let around = moved.iter().find(|(root, _)| {
            is_root(**root)
                && part
                    .name
                    .text
                    .strip_prefix(net.parts[**root].name.text.as_str())
                    .is_some_and(|rest| rest.starts_with('.'))
        });
        let Some(around) = around.map(|(_, new)| *new).or(first) else { continue };
        moved.insert(id, around);
        lost.push(
            Diagnostic::warning(codes::ST_LOST, format!("macro-step `{}` is expanded", part.name))
                .at(part.name.span, "this")
                .help("its steps are steps of the chart, under their full names"),
        );
    }
    let new = |part: PartId| moved.get(&part).copied().unwrap_or(part);
    let steps: Vec<_> = flat.steps.ids().collect();
    for id in steps {
        flat.steps[id].part = new(flat.steps[id].part);
    }
    let transitions: Vec<_> = flat.transitions.ids().collect();
    for id in transitions {
        flat.transitions[id].part = new(flat.transitions[id].part);
    }
    for forcing in &mut flat.forcings {
        forcing.target.iter_mut().for_each(|part| *part = new(*part));
    }
    flat.parts = parts;
    flat.macros.clear();
    (flat, lost)
}
