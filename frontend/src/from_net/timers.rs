//! Further durations of an action, which lowering turns into separate actions.
//!
//! ```text
//! action Q_timed duration 2        step s { Q D 40 ms; Q D 20 ms }
//!     use s D
//! action Q duration 4
//!     use s D
//!     use s N if Q_timed.q
//! ```

use std::collections::BTreeMap;

use grafsynth_ir::expr::ExprKind;
use grafsynth_ir::net::{ActionId, ActionUse, Driver, Expr, Leaf, Net, PropertyLeaf, Qualifier};

/// The action whose Q is the only condition of this use, if the use has that form.
pub(super) fn asked(one: &ActionUse) -> Option<ActionId> {
    match (one.qualifier, one.condition.as_ref().map(|condition| &condition.kind)) {
        (Qualifier::N, Some(ExprKind::Leaf(Leaf::Controlled(action)))) => Some(*action),
        _ => None,
    }
}

/// Maps each action that is a further duration to its main action. Lowering a chart with these durations restores them.
pub(super) fn of(net: &Net) -> BTreeMap<ActionId, ActionId> {
    let mut n_reads: BTreeMap<ActionId, usize> = BTreeMap::new();
    let in_properties = net.properties.iter().flat_map(|one| one.never.leaves());
    let in_properties = in_properties.filter_map(PropertyLeaf::net);
    for leaf in net.expressions().flat_map(Expr::leaves).chain(in_properties) {
        if let Leaf::Controlled(action) = leaf {
            *n_reads.entry(*action).or_default() += 1;
        }
    }
    let drives =
        |id: ActionId| net.outputs.values().any(|output| output.driver == Driver::Controlled(id));
    let mut found = BTreeMap::new();
    // Preceding actions that may be durations of the current one.
    let mut before: Vec<ActionId> = Vec::new();
    for (id, action) in net.actions.iter() {
        // The durations in the order of their first occurrence, in which lowering creates the actions; the first duration stays in the main
        // action.
        let mut timers: Vec<ActionId> = Vec::new();
        for timer in action.uses.iter().filter_map(asked) {
            if !timers.contains(&timer) {
                timers.push(timer);
            }
        }
        let is_whole = |timer: &ActionId| {
            let asking = action.uses.iter().filter(|one| asked(one) == Some(*timer));
            let own = &net.actions[*timer].uses;
            let prefix = format!("{}_timed", action.name.text);
            n_reads.get(timer) == Some(&own.len())
                && net.actions[*timer].name.text.starts_with(&prefix)
                && asking.map(|one| one.step).eq(own.iter().map(|one| one.step))
        };
        timers.retain(is_whole);
        let mut durations: Vec<u32> = timers.iter().map(|it| net.actions[*it].duration).collect();
        durations.push(action.duration);
        durations.sort_unstable();
        let is_twice = durations.windows(2).any(|pair| pair[0] == pair[1]);
        let stores = |one: &ActionUse| {
            one.qualifier.is_timed() && !matches!(one.qualifier, Qualifier::L | Qualifier::D)
        };
        let first = action.uses.iter().find(|one| {
            one.qualifier.is_timed() || asked(one).is_some_and(|timer| timers.contains(&timer))
        });
        let keeps =
            action.uses.iter().any(stores) || first.is_some_and(|one| one.qualifier.is_timed());
        if before.ends_with(&timers) && !is_twice && keeps {
            found.extend(timers.into_iter().map(|timer| (timer, id)));
        }
        let is_timer = !drives(id)
            && action.body.is_empty()
            && action.meta.label.is_empty()
            && action.meta.req.is_empty()
            && !action.uses.is_empty()
            && action.uses.iter().all(|one| matches!(one.qualifier, Qualifier::L | Qualifier::D));
        if is_timer {
            before.push(id);
        } else {
            before.clear();
        }
    }
    found
}
