//! A document as a tree of states, transitions and statements, before names and types are resolved.

use grafsynth_ir::{Name, Span};

use super::expr::{Ast, Language};

/// A whole document.
#[derive(Debug, Default)]
pub(super) struct Machine {
    /// Span of the root element.
    pub(super) span: Span,
    pub(super) name: Option<Name>,
    /// States and histories in the `initial` attribute.
    pub(super) initial: Vec<Name>,
    pub(super) states: Vec<State>,
    pub(super) data: Vec<Datum>,
    pub(super) settings: Settings,
}

/// The attributes of the grafsynth namespace at the root.
#[derive(Debug, Default)]
pub(super) struct Settings {
    pub(super) tick_ns: Option<(u64, Span)>,
    pub(super) queue: Option<(u32, Span)>,
    pub(super) limit: Option<(u32, Span)>,
    pub(super) exclusive: Option<Span>,
    /// Events that may also come from outside although the chart raises them.
    pub(super) inputs: Vec<Name>,
    /// Events that never come from outside although the chart does not raise them.
    pub(super) internals: Vec<Name>,
}

/// The kind of a state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum StateKind {
    State,
    Parallel,
    Final,
}

/// A `state`, `parallel` or `final` element.
#[derive(Debug)]
pub(super) struct State {
    pub(super) kind: StateKind,
    /// Its identifier; `None` if the document does not define one.
    pub(super) id: Option<Name>,
    /// Span of its start tag.
    pub(super) span: Span,
    pub(super) label: String,
    /// The initial states, by attribute or element, and the content of the initial transition.
    pub(super) initial: Option<(Vec<Name>, Vec<Act>)>,
    pub(super) entry: Vec<Handler>,
    pub(super) exit: Vec<Handler>,
    pub(super) histories: Vec<History>,
    /// States and transitions in document order.
    pub(super) children: Vec<Child>,
}

/// An `onentry` or `onexit` element.
#[derive(Debug)]
pub(super) struct Handler {
    pub(super) acts: Vec<Act>,
    pub(super) span: Span,
}

/// A child of a state.
#[derive(Debug)]
pub(super) enum Child {
    State(State),
    Transition(Transition),
}

/// A `history` element.
#[derive(Debug)]
pub(super) struct History {
    pub(super) id: Option<Name>,
    pub(super) span: Span,
    pub(super) is_deep: bool,
    pub(super) targets: Vec<Name>,
    pub(super) content: Vec<Act>,
}

/// A `transition` of a state.
#[derive(Debug)]
pub(super) struct Transition {
    pub(super) span: Span,
    /// Event descriptors; empty for an eventless transition.
    pub(super) events: Vec<Name>,
    pub(super) has_event: bool,
    pub(super) condition: Option<Ast>,
    pub(super) targets: Vec<Name>,
    pub(super) is_internal: bool,
    pub(super) content: Vec<Act>,
}

/// A `data` element.
#[derive(Debug)]
pub(super) struct Datum {
    pub(super) id: Name,
    pub(super) value: Option<Ast>,
    /// Its range, from an attribute of the grafsynth namespace.
    pub(super) range: Option<(i64, i64)>,
    pub(super) role: Role,
    pub(super) label: String,
}

/// The role of a data element in the controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum Role {
    #[default]
    Variable,
    Input,
    Output,
}

/// A statement.
#[derive(Debug)]
pub(super) struct Act {
    pub(super) kind: ActKind,
    pub(super) span: Span,
}

/// The kinds of statements.
#[derive(Debug)]
pub(super) enum ActKind {
    Assign {
        target: String,
        target_span: Span,
        index: Option<Ast>,
        value: Ast,
    },
    Raise(Name),
    Send {
        event: Name,
        after_ns: Option<u64>,
        slot: Option<Name>,
    },
    Cancel(Name),
    /// Conditions with their statements in order, and the statements of `else`.
    If {
        arms: Vec<(Ast, Vec<Act>)>,
        otherwise: Vec<Act>,
    },
    Foreach {
        array: Ast,
        item: Name,
        index: Option<Name>,
        body: Vec<Act>,
    },
}

impl Machine {
    /// Calls `visit` on every statement in document order, outer before inner.
    pub(super) fn each_act<'m>(&'m self, visit: &mut impl FnMut(&'m Act)) {
        self.each_act_but(&|_| false, visit);
    }

    /// Like `each_act`, but skips the contents of some transitions.
    pub(super) fn each_act_but<'m>(
        &'m self,
        is_left_out: &impl Fn(&Transition) -> bool,
        visit: &mut impl FnMut(&'m Act),
    ) {
        fn acts<'m>(list: &'m [Act], visit: &mut impl FnMut(&'m Act)) {
            for act in list {
                visit(act);
                match &act.kind {
                    ActKind::If { arms, otherwise } => {
                        for (_, arm) in arms {
                            acts(arm, visit);
                        }
                        acts(otherwise, visit);
                    }
                    ActKind::Foreach { body, .. } => acts(body, visit),
                    _ => {}
                }
            }
        }
        self.each_state(&mut |state| {
            for handler in &state.entry {
                acts(&handler.acts, visit);
            }
            if let Some((_, content)) = &state.initial {
                acts(content, visit);
            }
            for history in &state.histories {
                acts(&history.content, visit);
            }
            for child in &state.children {
                if let Child::Transition(transition) = child
                    && !is_left_out(transition)
                {
                    acts(&transition.content, visit);
                }
            }
            for handler in &state.exit {
                acts(&handler.acts, visit);
            }
        });
    }

    /// Calls `visit` on every state in document order, parent before child.
    pub(super) fn each_state<'m>(&'m self, visit: &mut impl FnMut(&'m State)) {
        fn walk<'m>(state: &'m State, visit: &mut impl FnMut(&'m State)) {
            visit(state);
            for child in &state.children {
                if let Child::State(inner) = child {
                    walk(inner, visit);
                }
            }
        }
        for state in &self.states {
            walk(state, visit);
        }
    }
}

impl State {
    /// The direct child states.
    pub(super) fn states(&self) -> impl Iterator<Item = &State> {
        self.children.iter().filter_map(|child| match child {
            Child::State(state) => Some(state),
            Child::Transition(_) => None,
        })
    }
}

/// The data model named by an attribute; `None` if it is not supported.
pub(super) fn language(name: &str) -> Option<Language> {
    match name {
        "null" => Some(Language::Null),
        "ecmascript" => Some(Language::Ecmascript),
        "c89" => Some(Language::C89),
        _ => None,
    }
}
