//! Types of expressions, and which values each context may read (invariants 7 to 13).

use super::Checker;
use crate::codes;
use crate::diag::Diagnostic;
use crate::expr::{Expr as GenericExpr, Type};
use crate::interval::{Leaves, NetLeaves, TypeError, TypeErrorKind, check};
use crate::net::{Driver, Expr, InputKind, Leaf, Net, PropertyLeaf, PropertyRole, TransitionId};
use crate::span::Span;

/// The context of an expression.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Place {
    /// The receptivity of a transition.
    Guard(TransitionId),
    /// A list of a step, transition or history.
    List,
    /// A context without edges and events, with its name.
    Quiet(&'static str),
    /// `unspecified`.
    Unspecified,
    /// An assertion.
    Assert,
    /// An assumption.
    Assume,
}

impl Place {
    fn name(self) -> &'static str {
        match self {
            Place::Guard(_) => "a receptivity",
            Place::List => "a list of actions",
            Place::Quiet(name) => name,
            Place::Unspecified => "the condition of an open cell",
            Place::Assert => "a property",
            Place::Assume => "an assumption",
        }
    }
}

/// The leaves of a net that `place` may read.
struct Scope<'a> {
    net: &'a Net,
    place: Place,
}

impl Scope<'_> {
    /// Why this cannot be read here, in the user's terms.
    fn objection(&self, leaf: &Leaf) -> Option<&'static str> {
        let net = self.net;
        let event = match leaf {
            Leaf::Input(input) => {
                net.inputs.get(*input).map(|input| input.kind).filter(|kind| kind.is_event())
            }
            _ => None,
        };
        let is_input = matches!(leaf, Leaf::Input(_));
        match self.place {
            Place::Assume if !is_input => return Some("a value that is not an input"),
            Place::Unspecified if !is_input && !matches!(leaf, Leaf::Active(_)) => {
                return Some("a value that is neither an input nor a step bit");
            }
            Place::Assume | Place::Assert => {
                if event == Some(InputKind::InternalEvent) {
                    return Some("an internal event, which is true only within a reaction,");
                }
            }
            Place::Guard(_) | Place::List
                if event.is_some() && net.settings.policy.is_statechart() =>
            {
                return Some("an event of a statechart, which belongs after `on`,");
            }
            Place::Quiet(_) if event.is_some() => {
                return Some("an event, which is true only within a micro-step,");
            }
            Place::Guard(_) | Place::List | Place::Quiet(_) | Place::Unspecified => {}
        }
        match (leaf, self.place) {
            (Leaf::Rise(_) | Leaf::Fall(_), Place::Quiet(_) | Place::Assert) => {
                Some("an edge, which is true only within a reaction,")
            }
            (Leaf::Fireable(other), Place::Guard(transition)) if *other >= transition => {
                Some("whether this transition or a later one is fireable")
            }
            (Leaf::Fireable(_), Place::List | Place::Quiet(_) | Place::Assert) => {
                Some("whether a transition is fireable")
            }
            _ => None,
        }
    }

    fn may_read(&self, leaf: &Leaf, span: Span) -> Result<(), TypeError> {
        match self.objection(leaf) {
            None => Ok(()),
            Some(what) => Err(TypeError {
                span,
                kind: TypeErrorKind::NotReadableHere { what, place: self.place.name() },
            }),
        }
    }
}

impl Leaves<Leaf> for Scope<'_> {
    fn leaf(&mut self, leaf: &Leaf, span: Span) -> Result<Type, TypeError> {
        let ty = NetLeaves(self.net).leaf(leaf, span)?;
        self.may_read(leaf, span).map(|()| ty)
    }
    fn array(&mut self, leaf: &Leaf, span: Span) -> Result<(Type, Option<u32>), TypeError> {
        let found = NetLeaves(self.net).array(leaf, span)?;
        self.may_read(leaf, span).map(|()| found)
    }
    fn is_duration(&self, leaf: &Leaf) -> bool {
        NetLeaves(self.net).is_duration(leaf)
    }
}

impl Leaves<PropertyLeaf> for Scope<'_> {
    fn leaf(&mut self, leaf: &PropertyLeaf, span: Span) -> Result<Type, TypeError> {
        match leaf {
            PropertyLeaf::Net(leaf) => Leaves::<Leaf>::leaf(self, leaf, span),
            PropertyLeaf::Output(id) => {
                let ty = NetLeaves(self.net).leaf(leaf, span)?;
                let place = self.place.name();
                let driver = self.net.outputs.get(*id).map(|output| &output.driver);
                let what = match driver {
                    _ if self.place == Place::Assume => "an output",
                    Some(Driver::Extern { params, .. }) if !params.is_empty() => {
                        "an extern action with arguments, which has no single value,"
                    }
                    _ => return Ok(ty),
                };
                Err(TypeError { span, kind: TypeErrorKind::NotReadableHere { what, place } })
            }
        }
    }
    fn array(&mut self, leaf: &PropertyLeaf, span: Span) -> Result<(Type, Option<u32>), TypeError> {
        match leaf {
            PropertyLeaf::Net(leaf) => Leaves::<Leaf>::array(self, leaf, span),
            PropertyLeaf::Output(_) => NetLeaves(self.net).array(leaf, span),
        }
    }
    fn is_duration(&self, leaf: &PropertyLeaf) -> bool {
        NetLeaves(self.net).is_duration(leaf)
    }
}

impl<'a> Checker<'a> {
    /// Checks the expressions that do not belong to a step, transition, output or action.
    pub(super) fn expressions(&mut self) {
        let net = self.net;
        for timer in net.timers.values() {
            self.condition(&timer.condition, Place::Quiet("the condition of a timer"));
        }
        for edge in net.edges.values() {
            self.condition(&edge.expr, Place::Quiet("the operand of an edge"));
        }
        if let Some(emergency) = &net.emergency {
            self.condition(&emergency.condition, Place::Quiet("an emergency"));
        }
        if let Some(ending) = &net.ending {
            self.condition(&ending.waits, Place::Quiet("the condition of `ending`"));
        }
        for property in &net.properties {
            let place = match property.role {
                PropertyRole::Assume => Place::Assume,
                PropertyRole::Assert => Place::Assert,
            };
            self.generic(&property.never, place, true);
        }
        for open in &net.unspecified {
            self.condition(&open.when, Place::Unspecified);
        }
    }

    /// Checks a Boolean at `place`.
    pub(super) fn condition(&mut self, expr: &Expr, place: Place) {
        self.generic(expr, place, true);
    }

    /// Checks a value at `place` against the kind of `wanted`; returns its type if it has one.
    pub(super) fn value(&mut self, expr: &Expr, place: Place, wanted: Type) -> Option<Type> {
        self.generic(expr, place, wanted.is_bool())
    }

    fn generic<L>(&mut self, expr: &GenericExpr<L>, place: Place, wants_bool: bool) -> Option<Type>
    where
        Scope<'a>: Leaves<L>,
    {
        let error = match check(expr, &mut Scope { net: self.net, place }) {
            Ok(Type::Int { lo, hi }) if wants_bool => {
                TypeError { span: expr.span, kind: TypeErrorKind::BoolExpected { lo, hi } }
            }
            Ok(Type::Bool) if !wants_bool => {
                TypeError { span: expr.span, kind: TypeErrorKind::IntExpected }
            }
            Ok(ty) => return Some(ty),
            Err(error) => error,
        };
        let diagnostic =
            Diagnostic::error(codes::of_type_error(&error.kind), error.kind.to_string());
        let diagnostic = diagnostic.at(error.span, "");
        self.out.push(match error.kind.help() {
            Some(help) => diagnostic.help(help),
            None => diagnostic,
        });
        None
    }
}
