//! The routes of transitions: what of each is drawn inside of which state.
//!
//! A transition between states at different depths is divided at the borders that it crosses. From outside in, each part is given a side of the border.

use crate::states::{Edge, Kind, Tree};
use grafsynth_ir::Gather;
use std::collections::{BTreeMap, BTreeSet};

/// A side of a box.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Side {
    Top,
    Bottom,
}

/// A part of a transition inside of one container.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Part {
    pub(crate) edge: usize,
    pub(crate) ends: Ends,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Ends {
    /// From one child to another, or back to itself.
    Children(usize, usize),
    /// From the inner side of the container to a child.
    Local(usize),
    /// Between a child and the border of the container. True if the transition begins in the child.
    Border(usize, Side, bool),
}

/// What is to be drawn in a container.
#[derive(Debug, Clone, Default)]
pub(crate) struct Plan {
    pub(crate) parts: Vec<Part>,
    /// The row of each child, from 0.
    pub(crate) rows: BTreeMap<usize, usize>,
}

/// The containers from outside in, and what is in each.
pub(crate) fn plans(tree: &Tree) -> (Vec<usize>, Vec<Plan>) {
    let mut plans = vec![Plan::default(); tree.vertices.len()];
    for (number, edge) in tree.edges.iter().enumerate() {
        let (container, ends) = ends(tree, edge);
        plans[container].parts.push(Part { edge: number, ends });
    }
    let mut order = vec![0];
    let mut next = 0;
    while let Some(&container) = order.get(next) {
        next += 1;
        let children = &tree.vertices[container].children;
        order.extend(children.iter().filter(|child| !tree.vertices[**child].children.is_empty()));
        plans[container].rows = rows(tree, container, &plans[container].parts);
        for part in plans[container].parts.clone() {
            for (child, side, is_from) in crossed(&plans[container].rows, part.ends) {
                let edge = &tree.edges[part.edge];
                let end = if is_from { edge.from } else { edge.to };
                let above = tree.ancestors(end);
                if let Some(inner) = above.iter().find(|it| tree.vertices[**it].parent == child)
                    && end != child
                {
                    let ends = Ends::Border(*inner, side, is_from);
                    plans[child].parts.push(Part { edge: part.edge, ends });
                }
            }
        }
    }
    (order, plans)
}

/// The container in which a transition has its label, and its ends there.
fn ends(tree: &Tree, edge: &Edge) -> (usize, Ends) {
    let (above_from, above_to) = (tree.ancestors(edge.from), tree.ancestors(edge.to));
    let child = |above: &[usize], container: usize| {
        above.iter().copied().find(|it| *it != 0 && tree.vertices[*it].parent == container)
    };
    if edge.is_local {
        return (edge.from, Ends::Local(child(&above_to, edge.from).unwrap_or(edge.to)));
    }
    let around: BTreeSet<usize> = above_to.iter().skip(1).copied().gather();
    let container = above_from.iter().skip(1).find(|it| around.contains(it)).copied().unwrap_or(0);
    let end = |above: &[usize], own| child(above, container).unwrap_or(own);
    (container, Ends::Children(end(&above_from, edge.from), end(&above_to, edge.to)))
}

/// The children whose sides a part touches.
pub(crate) fn crossed(rows: &BTreeMap<usize, usize>, ends: Ends) -> Vec<(usize, Side, bool)> {
    match ends {
        Ends::Children(from, to) => {
            let (first, second) = (rows.get(&from), rows.get(&to));
            let below = |leads_down| if leads_down { Side::Bottom } else { Side::Top };
            if first == second {
                return vec![(from, Side::Bottom, true), (to, Side::Bottom, false)];
            }
            vec![(from, below(first < second), true), (to, below(second < first), false)]
        }
        Ends::Local(child) => vec![(child, Side::Top, false)],
        Ends::Border(child, side, is_from) => vec![(child, side, is_from)],
    }
}

/// The row of each child: below the states that lead to it, except for transitions that lead back.
fn rows(tree: &Tree, container: usize, parts: &[Part]) -> BTreeMap<usize, usize> {
    let children = &tree.vertices[container].children;
    let is_region = |child: usize| tree.vertices[child].kind == Kind::Region;
    let mut next: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for part in parts {
        if let Ends::Children(from, to) = part.ends
            && from != to
            && !is_region(from)
            && !is_region(to)
        {
            next.entry(from).or_default().push(to);
        }
    }
    let nexts = |child: usize| next.get(&child).map(Vec::as_slice).unwrap_or_default();
    let is_first = |child: &usize| tree.vertices[*child].kind == Kind::Initial;
    let (mut starts, rest): (Vec<usize>, Vec<usize>) = children.iter().partition(|it| is_first(it));
    starts.extend(rest);
    // A depth-first search: a transition to a state on the path leads back.
    let mut finished = Vec::new();
    let mut back = BTreeSet::new();
    let (mut seen, mut on_path) = (BTreeSet::new(), BTreeSet::new());
    for start in starts {
        let mut path = Vec::new();
        if seen.insert(start) {
            on_path.insert(start);
            path.push((start, 0));
        }
        while let Some((child, index)) = path.last_mut() {
            let child = *child;
            let Some(&to) = nexts(child).get(*index) else {
                path.pop();
                on_path.remove(&child);
                finished.push(child);
                continue;
            };
            *index += 1;
            if on_path.contains(&to) {
                back.insert((child, to));
            } else if seen.insert(to) {
                on_path.insert(to);
                path.push((to, 0));
            }
        }
    }
    finished.reverse();
    let mut rows: BTreeMap<usize, usize> = children.iter().map(|child| (*child, 0)).gather();
    let mut above: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (&from, targets) in &next {
        for &to in targets {
            let (high, low) = if back.contains(&(from, to)) { (to, from) } else { (from, to) };
            above.entry(low).or_default().push(high);
        }
    }
    for child in &finished {
        let highest = above.get(child).into_iter().flatten().map(|it| rows[it] + 1);
        rows.insert(*child, highest.max().unwrap_or(0));
    }
    // What has nothing above it is directly above the first state that it leads to.
    for child in finished.iter().rev().filter(|child| !above.contains_key(*child)) {
        let lowest = nexts(*child).iter().map(|to| rows[to]).min().unwrap_or(0);
        rows.insert(*child, lowest.saturating_sub(1));
    }
    if children.iter().any(|child| is_region(*child)) {
        let others = rows.iter().filter(|(child, _)| !is_region(**child));
        let last = others.map(|(_, row)| row + 1).max().unwrap_or(0);
        children.iter().filter(|child| is_region(**child)).for_each(|child| {
            rows.insert(*child, last);
        });
    }
    rows
}
