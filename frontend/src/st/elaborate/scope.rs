//! Finds the object that a name refers to. The rules of all units are here.
//!
//! | use of the name | looked up in this order; the first match counts |
//! |---|---|
//! | expression, target of an assignment | the unit or instance: its variables and steps; the globals; the values of the enumerations |
//! | `a.b` | `b` in the instance or structure `a`, or `X` and `T` of the step `a`; if nothing is named `a`: an enumeration `a`, the globals (`a` names their list) |
//! | type | elementary types; types of the library; function blocks of the library; standard function blocks |
//! | `a();` | an instance; an action of the unit; a function; a program, which is refused |
//! | `a.b();` | an action `b` of the block of the instance `a`; an instance `b` in it |
//! | `a()` in an expression | a function of the library; an instance, which is refused; a standard function |
//! | action of a step | an action of the chart; a Boolean that is used only as an action; the unit and the globals |
//! | `FROM a TO b` | the steps of the chart, including those in its macro-steps |
//! | argument `a := x` of a block | its parameters, by either name if it is a standard block |
//!
//! An instance does not see the names of the unit that declares it. All frames of units and instances therefore have the same outer frame,
//! the globals. Names are the same if their symbols are the same ([`crate::st::symbol`]).

use super::context::{Binding, Elaborator, Frame, FrameId, GLOBALS, Outcome};
use super::value::Value;
use crate::st::ast::TypeKind;
use crate::st::symbol::{Ident, Symbol};

impl Elaborator<'_> {
    pub(super) fn new_frame(&mut self) -> FrameId {
        self.frames.push(Frame::default());
        self.frames.len() - 1
    }

    /// The object that a name refers to in the frame itself.
    pub(super) fn own(&self, frame: FrameId, id: &str) -> Option<&Binding> {
        self.frames[frame].names.get(id)
    }

    /// Makes a name of the frame refer to an object; returns the object that the name referred to before.
    pub(super) fn bind(&mut self, frame: FrameId, id: &Symbol, to: Binding) -> Option<Binding> {
        self.frames[frame].names.insert(id.clone(), to)
    }

    /// The object that a name refers to in the frame or among the globals.
    pub(super) fn lookup(&self, frame: FrameId, id: &str) -> Option<Binding> {
        self.own(frame, id).or_else(|| self.own(GLOBALS, id)).cloned()
    }

    /// The instance or structure that a name refers to.
    pub(super) fn object(&self, frame: FrameId, id: &str) -> Option<usize> {
        if let Some(Binding::Object(object)) = self.lookup(frame, id) { Some(object) } else { None }
    }

    /// The object that a name in an expression refers to.
    pub(super) fn resolve(&mut self, frame: FrameId, name: &Ident) -> Outcome<Binding> {
        let span = self.at(name.span);
        match (self.lookup(frame, &name.id), self.enumerated.get(&name.id)) {
            // In the expansion of a standard block, the value is an argument of the call, which keeps its own location.
            (Some(Binding::Value(value)), _) if self.call_site.is_none() => {
                Ok(Binding::Value(value.seen_at(span)))
            }
            (Some(binding), _) => binding.declared(),
            (None, Some(value)) => Ok(Binding::Value(Value::int(*value, span))),
            (None, None) => {
                let candidates = self.candidates(frame);
                Err(self.unknown("variable", name, &candidates, "declare it in a VAR block"))
            }
        }
    }

    /// The object that `list.name` refers to; `None` if `list` is not the name of an enumeration or of a list of globals.
    pub(super) fn qualified(
        &mut self,
        frame: FrameId,
        list: &Ident,
        name: &Ident,
    ) -> Option<Outcome<Binding>> {
        if self.lookup(frame, &list.id).is_some() {
            return None;
        }
        match self.types.get(&list.id).map(|def| &def.ty.kind) {
            Some(TypeKind::Enum(_)) => Some(self.resolve(frame, name)),
            _ => self.own(GLOBALS, &name.id).is_some().then(|| self.resolve(GLOBALS, name)),
        }
    }

    /// The names that an expression can use, for suggestions.
    pub(super) fn candidates(&self, frame: FrameId) -> Vec<String> {
        let mut all: Vec<String> = self.frames[frame].names.keys().map(Symbol::to_string).collect();
        if frame != GLOBALS {
            all.extend(self.frames[GLOBALS].names.keys().map(Symbol::to_string));
        }
        all
    }
}
