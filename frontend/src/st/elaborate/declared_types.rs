//! The types that declarations name, and initial values.

use grafsynth_ir::Span;
use grafsynth_ir::chart::Expr;
use grafsynth_ir::diag::{Diagnostic, ErrorReported};
use grafsynth_ir::expr::ExprKind;

use super::context::{Elaborator, FrameId, Outcome};
use super::types::{Ty, WIDEST, integer, length, zero};
use super::value::{Kind, Value};
use crate::codes;
use crate::st::ast::{self, Init, TypeKind, TypeRef};
use crate::st::symbol::{Ident, Symbol};

impl Elaborator<'_> {
    /// Resolves a type reference.
    pub(super) fn ty(&mut self, frame: FrameId, syntax: &TypeRef) -> Ty {
        self.ty_within(frame, syntax, 0)
    }

    fn ty_within(&mut self, frame: FrameId, syntax: &TypeRef, depth: usize) -> Ty {
        if depth > 64 {
            self.report(
                Diagnostic::error(codes::ST_TYPE, "this type contains itself")
                    .at(syntax.span, "")
                    .help("use another type for this element"),
            );
            return Ty::Broken;
        }
        match &syntax.kind {
            TypeKind::Named(name) => self.named(frame, name, depth),
            TypeKind::Subrange(base, range) => {
                let (lo, hi) =
                    (self.constant_int(frame, &range.0), self.constant_int(frame, &range.1));
                let (Ok(lo), Ok(hi)) = (lo, hi) else { return Ty::Broken };
                let fits = integer(&base.id)
                    .is_some_and(|(least, most)| least <= lo && lo <= hi && hi <= most);
                if !fits || lo < WIDEST.0 || hi > WIDEST.1 {
                    self.report(
                        Diagnostic::error(
                            codes::ST_TYPE,
                            format!("{lo}..{hi} is not a valid range of {base} within 32 bits"),
                        )
                        .at(syntax.span, "")
                        .help("write the smaller bound first, and both within the base type and -2147483648..2147483647"),
                    );
                    return Ty::Broken;
                }
                Ty::Int { lo, hi, wraps: false }
            }
            TypeKind::Array(ranges, element) => {
                let mut bounds = Vec::new();
                for (low, high) in ranges {
                    let (Ok(lo), Ok(hi)) =
                        (self.constant_int(frame, low), self.constant_int(frame, high))
                    else {
                        return Ty::Broken;
                    };
                    if hi < lo || hi.abs_diff(lo) >= 65_536 {
                        self.report(
                            Diagnostic::error(
                                codes::ST_TYPE,
                                format!("the range {lo}..{hi} of an array has no elements or more than 65536"),
                            )
                            .at(syntax.span, "")
                            .help("write the smaller bound first, as in ARRAY [0..9], and at most 65536 elements"),
                        );
                        return Ty::Broken;
                    }
                    bounds.push((lo, hi));
                }
                match self.ty_within(frame, element, depth + 1) {
                    Ty::Broken => Ty::Broken,
                    // `ARRAY [..] OF ARRAY [..] OF t` has one index for each array, like an array of two dimensions.
                    Ty::Array(inner, element) => {
                        bounds.extend(inner);
                        Ty::Array(bounds, element)
                    }
                    element @ (Ty::Bool | Ty::Int { .. }) => Ty::Array(bounds, Box::new(element)),
                    Ty::Time | Ty::Block(_) | Ty::Struct(_) => {
                        self.refused(
                            "arrays of times, blocks or structures",
                            syntax.span,
                            "declare the elements one by one",
                        );
                        Ty::Broken
                    }
                }
            }
            TypeKind::Enum(values) => self.enumeration(frame, values),
            TypeKind::Struct(fields) => Ty::Struct(fields.clone()),
            TypeKind::Refused(what) => {
                self.refused(what, syntax.span, "use BOOL, an integer type or TIME");
                Ty::Broken
            }
        }
    }

    /// Declares enumeration values as constants, which are visible everywhere.
    fn enumeration(&mut self, frame: FrameId, values: &[(Ident, Option<ast::Expr>)]) -> Ty {
        let (mut lo, mut hi, mut next) = (i64::MAX, i64::MIN, 0);
        for (name, value) in values {
            if let Some(value) = value {
                match self.constant_int(frame, value) {
                    Ok(value) => next = value,
                    Err(_) => return Ty::Broken,
                }
            }
            self.enumerated.insert(name.id.clone(), next);
            (lo, hi) = (lo.min(next), hi.max(next));
            next = next.saturating_add(1);
        }
        if lo < WIDEST.0 || hi > WIDEST.1 {
            return Ty::Broken;
        }
        Ty::Int { lo, hi, wraps: false }
    }

    fn named(&mut self, frame: FrameId, name: &Ident, depth: usize) -> Ty {
        let (key, span) = (&name.id, name.span);
        if *key == "BOOL" {
            return Ty::Bool;
        }
        if matches!(key.as_str(), "TIME" | "LTIME") {
            return Ty::Time;
        }
        if let Some((lo, hi)) = integer(key) {
            if lo < WIDEST.0 || hi > WIDEST.1 {
                let narrow = (lo.max(WIDEST.0), hi.min(WIDEST.1));
                if self.narrowed.insert(key.clone()) {
                    self.report(
                        Diagnostic::warning(
                            codes::ST_NARROWED,
                            format!("{key} is narrowed to {}..{}; other values become the nearest bound", narrow.0, narrow.1),
                        )
                        .at(span, "first use")
                        .help("use DINT if its range is sufficient, or a subrange such as `DINT (0..999)`"),
                    );
                }
                return Ty::Int { lo: narrow.0, hi: narrow.1, wraps: false };
            }
            return Ty::Int { lo, hi, wraps: true };
        }
        if let Some(def) = self.types.get(key).copied() {
            return self.ty_within(frame, &def.ty, depth + 1);
        }
        if let Some(&index) = self.blocks.get(key) {
            return Ty::Block(index);
        }
        let known = [
            "REAL",
            "LREAL",
            "STRING",
            "WSTRING",
            "CHAR",
            "WCHAR",
            "DATE",
            "TOD",
            "DT",
            "TIME_OF_DAY",
            "DATE_AND_TIME",
            "LDATE",
            "LTOD",
            "LDT",
        ];
        if known.contains(&key.as_str()) {
            self.refused(key, span, "use BOOL, an integer type or TIME");
        } else {
            let candidates: Vec<String> = self
                .types
                .keys()
                .chain(self.blocks.keys())
                .map(Symbol::to_string)
                .chain(["BOOL", "INT", "DINT", "TIME"].map(str::to_owned))
                .collect();
            self.unknown(
                "type",
                name,
                &candidates,
                "the file declares no type or function block of this name",
            );
        }
        Ty::Broken
    }

    /// Evaluates a constant integer.
    pub(super) fn constant_int(&mut self, frame: FrameId, syntax: &ast::Expr) -> Outcome<i64> {
        let value = self.value(frame, syntax)?;
        match (value.kind, &value.expr.kind) {
            (Kind::Int(lo, hi), _) if lo == hi => Ok(lo),
            _ => Err(self.not_constant(syntax.span)),
        }
    }

    pub(super) fn not_constant(&mut self, span: Span) -> ErrorReported {
        self.report(
            Diagnostic::error(codes::ST_CONSTANT, "expected a constant")
                .at(span, "not a constant expression")
                .help("write a number, or a variable declared with VAR CONSTANT"),
        )
    }

    /// Initial values of a simple variable or an array: a single one for all elements, or one for each element.
    pub(super) fn initial(&mut self, frame: FrameId, ty: &Ty, init: &Init) -> Outcome<Vec<Expr>> {
        match (ty, init) {
            (Ty::Bool | Ty::Int { .. }, Init::Value(value)) => {
                Ok(vec![self.initial_value(frame, ty, value)?])
            }
            (Ty::Array(bounds, element), Init::List(..)) => {
                let len = length(bounds);
                let mut values = Vec::new();
                self.flatten(frame, element, init, &mut values, len)?;
                values.truncate(len);
                while values.len() < len {
                    values.push(zero(element));
                }
                Ok(values)
            }
            (Ty::Array(_, element), Init::Value(value)) => {
                Ok(vec![self.initial_value(frame, element, value)?])
            }
            (
                _,
                Init::Value(ast::Expr { span, .. }) | Init::List(_, span) | Init::Fields(_, span),
            ) => Err(self
                .report(Diagnostic::error(codes::ST_TYPE, "invalid initial value")
                    .at(*span, "does not fit the type")
                    .help("write a value for a simple variable, `[1, 2]` for an array, and `(field := 1)` for a structure or block"))),
        }
    }

    fn flatten(
        &mut self,
        frame: FrameId,
        element: &Ty,
        init: &Init,
        values: &mut Vec<Expr>,
        most: usize,
    ) -> Outcome<()> {
        match init {
            Init::Value(value) => values.push(self.initial_value(frame, element, value)?),
            Init::List(list, _) => {
                for (count, one) in list {
                    let count = match count {
                        Some(count) => self.constant_int(frame, count)?,
                        None => 1,
                    };
                    for _ in 0..count {
                        if values.len() >= most {
                            break;
                        }
                        self.flatten(frame, element, one, values, most)?;
                    }
                }
            }
            Init::Fields(_, span) => {
                return Err(self.report(
                    Diagnostic::error(codes::ST_TYPE, "invalid initial value of an element")
                        .at(*span, "fields of a structure")
                        .help("write one value for each element, as in `[1, 2]`"),
                ));
            }
        }
        Ok(())
    }

    fn initial_value(&mut self, frame: FrameId, ty: &Ty, syntax: &ast::Expr) -> Outcome<Expr> {
        let value = self.value(frame, syntax)?;
        let value = self.fit(value, ty, "its initial value")?;
        match (&value.kind, &value.expr.kind) {
            (Kind::Bool, ExprKind::Bool(_)) => Ok(value.expr),
            (Kind::Int(lo, hi), _) if lo == hi => Ok(Expr::new(ExprKind::Int(*lo), syntax.span)),
            _ => Err(self.not_constant(syntax.span)),
        }
    }

    /// Converts `value` to the type of its target; wraps it if the type wraps around.
    pub(super) fn fit(&mut self, value: Value, ty: &Ty, what: &str) -> Outcome<Value> {
        let span = value.expr.span;
        let (wrong, help) = match (ty, &value.kind) {
            (Ty::Bool, Kind::Bool) | (Ty::Time, Kind::Time(_)) => return Ok(value),
            // 0 and 1 are also literals of BOOL.
            (Ty::Bool, Kind::Int(lo, hi)) if lo == hi && (0..=1).contains(lo) => {
                let expr = Expr::new(ExprKind::Bool(*lo == 1), span);
                return Ok(Value { expr, kind: Kind::Bool });
            }
            (Ty::Int { lo, hi, wraps }, Kind::Int(least, most)) => {
                if !wraps || (lo <= least && most <= hi) {
                    return Ok(value);
                }
                return Ok(value.wrapped(*lo, *hi));
            }
            (Ty::Bool, Kind::Int(..)) => {
                ("expected a Boolean, found a number", "compare it, as in `n <> 0`")
            }
            (Ty::Bool, Kind::Time(_)) => {
                ("expected a Boolean, found a time", "compare it, as in `t.ET >= T#3s`")
            }
            (Ty::Int { .. }, Kind::Bool) => {
                ("expected a number, found a Boolean", "write SEL(b, 0, 1) for a Boolean b")
            }
            (Ty::Int { .. }, Kind::Time(_)) => (
                "expected a number, found a time",
                "write a number, or declare the variable as TIME",
            ),
            (Ty::Time, Kind::Bool | Kind::Int(..)) => {
                ("expected a time", "write a time, as in T#3s")
            }
            (Ty::Broken, _) => return Err(ErrorReported),
            (Ty::Array(..) | Ty::Block(_) | Ty::Struct(_), _) => (
                "a whole array, structure or block cannot be assigned",
                "assign its elements or fields one by one",
            ),
        };
        Err(self.report(
            Diagnostic::error(codes::ST_TYPE, wrong).at(span, format!("for {what}")).help(help),
        ))
    }
}
