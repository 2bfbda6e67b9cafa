//! Names: the variable, instance or step that a name, a field or an index refers to.

use grafsynth_ir::chart::{Expr, Leaf, Path};
use grafsynth_ir::diag::{Diagnostic, ErrorReported};
use grafsynth_ir::expr::ExprKind;
use grafsynth_ir::{Name, Span};

use super::context::{Binding, Elaborator, FrameId, GLOBALS, Object, ObjectKind, Outcome, Place};
use super::prelude;
use super::types::Ty;
use super::value::{Kind, Time, Value, leaf};
use crate::codes;
use crate::st::ast::{self, Op};
use crate::st::symbol::{Ident, Symbol};

impl Elaborator<'_> {
    /// Resolves a name, a field or an element.
    pub(super) fn access(&mut self, frame: FrameId, syntax: &ast::Expr) -> Outcome<Binding> {
        let span = syntax.span;
        match &syntax.kind {
            ast::ExprKind::Name(name) => self.resolve(frame, name),
            ast::ExprKind::Address(address) => self.address(address),
            ast::ExprKind::Flag(flag) => {
                let binding = self.frames[frame].flags.get(flag).cloned();
                match binding.unwrap_or(Binding::Broken).declared()? {
                    Binding::Value(value) => Ok(Binding::Value(value.seen_at(span))),
                    binding => Ok(binding),
                }
            }
            ast::ExprKind::Field(inner, field) => {
                // `color.red` and `globals.x`: a name qualified by the name of its list.
                if let ast::ExprKind::Name(list) = &inner.kind
                    && let Some(found) = self.qualified(frame, list, field)
                {
                    return found;
                }
                match self.access(frame, inner)? {
                    Binding::Object(object) => self.field(object, field),
                    Binding::Step(step) => self.step_field(&step, field),
                    Binding::Place(_) | Binding::Value(_) => {
                        Err(self.unknown("field", field, &[], "not a structure, block or step"))
                    }
                    Binding::Broken => Err(ErrorReported),
                }
            }
            ast::ExprKind::Index(inner, indices) => self.indexed(frame, inner, indices, span),
            ast::ExprKind::Refused(_) => Err(ErrorReported),
            ast::ExprKind::Bool(_)
            | ast::ExprKind::Int(_)
            | ast::ExprKind::Time(_)
            | ast::ExprKind::Bit(..)
            | ast::ExprKind::Not(_)
            | ast::ExprKind::Neg(_)
            | ast::ExprKind::Binary(..)
            | ast::ExprKind::And(_)
            | ast::ExprKind::Or(_)
            | ast::ExprKind::Call(..) => Err(self.type_error("expected a variable", span)),
        }
    }

    fn indexed(
        &mut self,
        frame: FrameId,
        inner: &ast::Expr,
        indices: &[ast::Expr],
        span: Span,
    ) -> Outcome<Binding> {
        let values = self.values(frame, indices.iter())?;
        match self.access(frame, inner)? {
            Binding::Place(place) => self.element(place, values, span),
            Binding::Value(_) | Binding::Object(_) | Binding::Step(_) => {
                Err(self.type_error("not an array", inner.span))
            }
            Binding::Broken => Err(ErrorReported),
        }
    }

    pub(super) fn field(&mut self, object: usize, field: &Ident) -> Outcome<Binding> {
        if let Some(value) = self.elapsed(object, field) {
            return value.map(Binding::Value);
        }
        let frame = self.objects[object].frame;
        if let Some(binding) = self.own(frame, &field.id) {
            return binding.clone().declared();
        }
        let known: Vec<String> = self.frames[frame].names.keys().map(Symbol::to_string).collect();
        let what = match self.objects[object].kind {
            ObjectKind::Struct => "field",
            ObjectKind::Block(_) => "variable of the block",
        };
        Err(self.unknown(what, field, &known, "use one of the names that it declares"))
    }

    /// The elapsed time of a standard block as other units read it, such as `t.ET`; `None` for other fields.
    pub(super) fn elapsed(&mut self, object: usize, field: &Ident) -> Option<Outcome<Value>> {
        let ObjectKind::Block(index) = self.objects[object].kind else { return None };
        if !self.is_standard(index) {
            return None;
        }
        let pou = self.unit(index);
        let var = pou.vars.iter().find(|var| var.name.id == field.id)?;
        let (running, limit) = prelude::clock(var)?;
        let Some(limit) = limit else {
            return Some(Err(self.refused(
                &format!("{} of {}", field.id, pou.name),
                field.span,
                "read ET of a TON, or a step's time",
            )));
        };
        let Object { frame, prefix, has_preset, .. } = self.objects[object].clone();
        let preset = self.own(frame, &limit.id).filter(|_| has_preset);
        let Some(Binding::Value(Value { kind: Kind::Time(Time::Constant(ns)), .. })) = preset
        else {
            return Some(Err(self.report(
                Diagnostic::error(
                    codes::ST_TIMER,
                    format!("ET of `{prefix}` is read before its PT is known"),
                )
                .at(field.span, "")
                .help("give PT in the declaration, as in `t : TON := (PT := T#3s);`, or call the block before"),
            )));
        };
        let limit = *ns;
        let part = |part: &Ident| {
            leaf(Name::new(format!("{prefix}.{part}"), field.span).into(), field.span)
        };
        let kind = Kind::Time(Time::Elapsed { running: Box::new(part(running)), limit });
        Some(Ok(Value { expr: part(&var.name), kind }))
    }

    fn step_field(&mut self, step: &Name, field: &Ident) -> Outcome<Binding> {
        let span = step.span.to(field.span);
        let part = |text: &str| Path { names: vec![step.clone(), Name::new(text, field.span)] };
        match field.id.as_str() {
            "X" => Ok(Binding::Value(Value::bool(leaf(part("active"), span)))),
            "T" => {
                let is_left = self.leaving.contains(&step.text);
                // The time of a step that is certainly active needs no memory.
                let path = part(if is_left { "t" } else { "T" });
                Ok(Binding::Value(Value {
                    expr: leaf(path, span),
                    kind: Kind::Time(Time::Running),
                }))
            }
            _ => {
                let candidates = ["X".to_owned(), "T".to_owned()];
                let help = "a step has X (active) and T (time)";
                Err(self.unknown("part of a step", field, &candidates, help))
            }
        }
    }

    fn element(&mut self, place: Place, indices: Vec<Value>, span: Span) -> Outcome<Binding> {
        let Ty::Array(bounds, element) = place.ty.clone() else {
            return Err(self.type_error("not an array", span));
        };
        if place.index.is_some() || indices.len() > bounds.len() {
            return Err(self.type_error("this array has fewer dimensions", span));
        }
        if indices.len() < bounds.len() {
            // Only `a[1, 2]` is supported, not the equivalent `a[1][2]`.
            return Err(self.refused(
                "a part of an array of several dimensions",
                span,
                "write all indices in one pair of brackets: `a[1, 2]`",
            ));
        }
        let mut index: Option<Value> = None;
        for (value, (lo, hi)) in indices.into_iter().zip(&bounds) {
            let at = value.expr.span;
            if !matches!(value.kind, Kind::Int(..)) {
                return Err(self.type_error("an index must be a number", at));
            }
            let own = if *lo == 0 {
                value
            } else {
                self.binary(Op::Sub, value, Value::int(*lo, at), at)?
            };
            index = Some(match index {
                None => own,
                Some(outer) => {
                    let size = Value::int(hi - lo + 1, at);
                    let scaled = self.binary(Op::Mul, outer, size, at)?;
                    self.binary(Op::Add, scaled, own, at)?
                }
            });
        }
        let index = index.map(|index| index.expr);
        Ok(Binding::Place(Place { index, ty: *element, ..place }))
    }

    /// The value that a resolved name, field or element has.
    pub(super) fn read(&mut self, access: Binding, span: Span) -> Outcome<Value> {
        match access {
            Binding::Value(value) => Ok(value),
            Binding::Place(place) => {
                let path = self.path(&place, span);
                let values = if place.ty == Ty::Time { self.values_of(&place) } else { None };
                let name = Leaf::Name(path);
                let expr = match place.index {
                    Some(index) => Expr::new(ExprKind::Element(name, Box::new(index)), span),
                    None => Expr::leaf(name, span),
                };
                match place.ty {
                    Ty::Bool => Ok(Value { expr, kind: Kind::Bool }),
                    Ty::Int { lo, hi, .. } => Ok(Value { expr, kind: Kind::Int(lo, hi) }),
                    Ty::Broken => Err(ErrorReported),
                    Ty::Time => Ok(Value { expr, kind: Kind::Time(Time::Varying(values)) }),
                    Ty::Array(..) | Ty::Block(_) | Ty::Struct(_) => Err(self.type_error(
                        "expected a simple value, found a whole array, block or structure",
                        span,
                    )),
                }
            }
            Binding::Broken => Err(ErrorReported),
            Binding::Object(_) => {
                Err(self.type_error("expected a value, found a block or a structure", span))
            }
            Binding::Step(step) => Err(self.report(
                Diagnostic::error(
                    codes::ST_TYPE,
                    format!("step `{step}` cannot be used as a value"),
                )
                .at(span, "")
                .help(format!("write `{step}.X` to test whether it is active"))
                .fix(span, format!("{step}.X")),
            )),
        }
    }

    /// Resolves an address, which denotes an input or output without a name.
    fn address(&mut self, address: &Ident) -> Outcome<Binding> {
        if let Some(binding) = self.own(GLOBALS, &address.id) {
            return binding.clone().declared();
        }
        Err(self.refused(
            &format!("the direct address `{address}`"),
            address.span,
            "declare a variable at this address, as in `m AT %IX0.0 : BOOL;`",
        ))
    }
}
