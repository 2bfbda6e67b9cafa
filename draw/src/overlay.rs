//! What is added to a drawing or left out of it: a situation, the parts of a split, numbers of activations, and blanks for exercises.

use crate::NotDrawn;
use crate::content::{Content, Scope};
use crate::picture::Pen;
use crate::states::{Kind, Tree};
use crate::symbol::{self, Symbol, When};
use crate::text::Rich;
use grafsynth_ir::Span;
use std::collections::{BTreeMap, BTreeSet};

/// What a drawing leaves blank, for exercises.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Blank {
    /// The contents of action boxes, and the actions and activities of states.
    pub actions: bool,
    /// Receptivities, and the labels of transitions between states.
    pub receptivities: bool,
    /// Names of steps, states and transitions, with their comments.
    pub names: bool,
}

/// A part of a split. Steps and transitions are named by their source locations, because several objects of a net may be drawn once.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Part {
    /// The name, for the explanation of its letter.
    pub name: String,
    /// The source locations of its steps and transitions.
    pub elements: BTreeSet<Span>,
}

/// How often steps were active and transitions fired.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Counts {
    /// The number for each step and transition, by its source location.
    pub by_element: BTreeMap<Span, u64>,
    /// The explanation of the numbers.
    pub note: String,
}

/// A situation for a frame of its own.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Frame {
    /// The heading of the frame.
    pub title: String,
    /// The source locations of the active steps and states.
    pub active: BTreeSet<Span>,
}

/// Room for an answer.
const ROOM: &str = "                        ";
/// Room for an answer beside a bar or arrow.
const DOTS: &str = "………………";

/// Marks active steps and states, by name (`p1`) or with the names around it (`machine.p1`).
///
/// # Errors
/// Returns the first name that no step or state has.
pub(crate) fn mark_active(content: &mut Content, names: &[String]) -> Result<(), NotDrawn> {
    for name in names {
        let mut is_known = false;
        for scope in &mut content.scopes {
            is_known |= mark(scope, name);
        }
        if !is_known {
            return Err(NotDrawn::NoStep(name.clone()));
        }
    }
    Ok(())
}

fn mark(scope: &mut Scope, name: &str) -> bool {
    let is_meant =
        |id: &str| id.strip_suffix(name).is_some_and(|rest| rest.is_empty() || rest.ends_with('.'));
    let mut is_known = false;
    for symbol in scope.symbols.iter_mut().filter(|it| it.is_step()) {
        if symbol.element.as_ref().is_some_and(|element| is_meant(&element.id)) {
            (symbol.is_active, is_known) = (true, true);
        }
    }
    if let Some(tree) = &mut scope.states {
        for vertex in &mut tree.vertices {
            let is_box = matches!(vertex.kind, Kind::State | Kind::Region | Kind::Final);
            if is_box && vertex.element.as_ref().is_some_and(|element| is_meant(&element.id)) {
                (vertex.is_active, is_known) = (true, true);
            }
        }
    }
    for inner in &mut scope.inner {
        is_known |= mark(inner, name);
    }
    is_known
}

/// Marks the steps and states with these source locations as active, and all others as not active.
pub(crate) fn light(content: &mut Content, active: &BTreeSet<Span>) {
    content.scopes.iter_mut().for_each(|scope| light_scope(scope, active));
}

fn light_scope(scope: &mut Scope, active: &BTreeSet<Span>) {
    for symbol in scope.symbols.iter_mut().filter(|it| it.is_step()) {
        symbol.is_active = symbol.element.as_ref().is_some_and(|it| active.contains(&it.span));
    }
    for vertex in scope.states.iter_mut().flat_map(|tree| &mut tree.vertices) {
        let is_box = matches!(vertex.kind, Kind::State | Kind::Region | Kind::Final);
        vertex.is_active =
            is_box && vertex.element.as_ref().is_some_and(|it| active.contains(&it.span));
    }
    scope.inner.iter_mut().for_each(|inner| light_scope(inner, active));
}

/// Adds the letters and colours of parts, with their explanation.
pub(crate) fn mark_parts(content: &mut Content, parts: &[Part]) {
    if parts.is_empty() {
        return;
    }
    content.legend.push((None, "parts:".to_owned()));
    for (index, part) in parts.iter().enumerate() {
        let text = format!("{}: {}", letter(index), part.name);
        content.legend.push((Some(Pen::of_part(index)), text));
    }
    each_symbol(&mut content.scopes, &mut |symbol, span| {
        let own = (0..).zip(parts).filter(|(_, part)| part.elements.contains(&span));
        let own: Vec<usize> = own.map(|(index, _)| index).collect();
        let letters: Vec<String> = own.iter().map(|index| letter(*index)).collect();
        symbol.tag.text = letters.join(" ");
        // A step on several parts, because its macro is used several times, has no colour.
        if let [only] = own.as_slice() {
            symbol.tag.fill = symbol.is_step().then(|| Pen::of_part(*only));
        }
    });
}

/// `A` to `Z`, then `A1` and so on.
fn letter(index: usize) -> String {
    let letter = char::from(b'A' + u8::try_from(index % 26).unwrap_or(0));
    if index < 26 { letter.to_string() } else { format!("{letter}{}", index / 26) }
}

/// Adds the number of activations and firings, with its explanation.
pub(crate) fn mark_counts(content: &mut Content, counts: &Counts) {
    content.legend.push((None, counts.note.clone()));
    content.legend.push((Some(Pen::Never), "never: not once".to_owned()));
    let number = |span: Span| match counts.by_element.get(&span)? {
        0 => Some("never".to_owned()),
        n => Some(format!("{n}×")),
    };
    each_symbol(&mut content.scopes, &mut |symbol, span| {
        let Some(text) = number(span) else { return };
        if counts.by_element.get(&span) == Some(&0) && symbol.is_step() {
            symbol.tag.fill = Some(Pen::Never);
        }
        symbol.tag.text = format!("{} {text}", symbol.tag.text).trim().to_owned();
    });
    for tree in content.scopes.iter_mut().filter_map(|scope| scope.states.as_mut()) {
        for vertex in &mut tree.vertices {
            vertex.remarks.extend(vertex.element.as_ref().and_then(|it| number(it.span)));
        }
        for edge in &mut tree.edges {
            edge.remarks.extend(edge.element.as_ref().and_then(|it| number(it.span)));
        }
    }
}

/// Calls `change` with each step and transition that has a source location.
fn each_symbol(scopes: &mut [Scope], change: &mut impl FnMut(&mut Symbol, Span)) {
    for scope in scopes {
        for symbol in &mut scope.symbols {
            if let Some(span) = symbol.element.as_ref().map(|element| element.span) {
                change(symbol, span);
            }
        }
        each_symbol(&mut scope.inner, change);
    }
}

/// Keeps the order of the charts as they are now, whatever is added or left blank later.
pub(crate) fn keep_order(scopes: &mut [Scope]) {
    for scope in scopes {
        scope.plain = scope.symbols.iter().map(|symbol| symbol.draw().0).collect();
        keep_order(&mut scope.inner);
    }
}

/// Leaves parts of all charts blank.
pub(crate) fn leave_blank(content: &mut Content, blank: Blank) {
    content.scopes.iter_mut().for_each(|scope| leave_scope(scope, blank));
}

fn leave_scope(scope: &mut Scope, blank: Blank) {
    scope.symbols.iter_mut().for_each(|symbol| leave_symbol(symbol, blank));
    if let Some(tree) = &mut scope.states {
        leave_states(tree, blank);
    }
    scope.inner.iter_mut().for_each(|inner| leave_scope(inner, blank));
}

fn leave_symbol(symbol: &mut Symbol, blank: Blank) {
    if blank.actions {
        for action in &mut symbol.actions {
            action.text = Rich::plain(ROOM);
            (action.qualifier, action.condition) = (String::new(), None);
            (action.when, action.is_forcing) = (When::Always, false);
            action.indicator.clear();
        }
    }
    if blank.receptivities && symbol.kind == symbol::Kind::Transition {
        symbol.receptivity = Some(Rich::plain(DOTS));
        symbol.remarks.clear();
    }
    if blank.names && symbol.kind != symbol::Kind::Reference {
        symbol.name.clear();
        symbol.remarks.clear();
    }
}

fn leave_states(tree: &mut Tree, blank: Blank) {
    for vertex in &mut tree.vertices {
        if blank.actions {
            vertex.lines.iter_mut().for_each(|line| *line = DOTS.to_owned());
        }
        if blank.names && vertex.kind != Kind::Chart {
            // A composite state keeps the place of its name.
            vertex.name = if vertex.name.is_empty() { String::new() } else { ROOM.to_owned() };
            vertex.remarks.clear();
        }
    }
    for edge in tree.edges.iter_mut().filter(|_| blank.receptivities) {
        if !edge.label.is_empty() {
            DOTS.clone_into(&mut edge.label);
        }
        edge.remarks.clear();
    }
}
