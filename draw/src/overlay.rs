//! What is added to a drawing or left out of it: a situation, and blanks for exercises.

use crate::NotDrawn;
use crate::content::{Content, Scope};
use crate::states::{Kind, Tree};
use crate::symbol::{self, Symbol, When};
use crate::text::Rich;

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
    let is_meant = |id: &str| id.strip_suffix(name).is_some_and(|rest| rest.ends_with('.'));
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
