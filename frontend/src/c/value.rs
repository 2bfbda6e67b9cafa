//! Translates expressions of C to expressions of the net, and their side effects to statements of the current node.

use super::ast::{BinaryOp, Expr, ExprKind, UnaryOp};
use super::flow::Flow;
use super::graph::CallSite;
use super::number::{Num, Repr, Value};
use super::operators::loaded;
use super::resolve::{FunctionId, Home, Program, Reference, VarId};
use super::texts::one_line;
use super::types::{self, Scalar, Type};
use crate::codes;
use grafsynth_ir::chart::{self, Leaf, Path, StmtKind};
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::expr::{CompareOp, ExprKind as NetKind, Type as NetType};
use grafsynth_ir::{Name, Span, counted};

/// A target of an assignment.
pub(super) struct Place {
    pub(super) path: Path,
    pub(super) index: Option<Num>,
    pub(super) ty: Scalar,
}

/// The selector of a `switch`.
pub(super) struct Selected(Value);

/// The array and the indices of `a[i][j]`, `*p` (no index) and `*(p + i)`.
pub(super) fn element(expr: &Expr) -> Option<(&Expr, Vec<&Expr>)> {
    if matches!(expr.kind, ExprKind::Name(_)) {
        return Some((expr, Vec::new()));
    }
    if let ExprKind::Index(base, index) = &expr.kind {
        let (base, mut indices) = element(base)?;
        indices.push(index);
        return Some((base, indices));
    }
    let ExprKind::Deref(inner) = &expr.kind else { return None };
    if matches!(inner.kind, ExprKind::Name(_)) {
        return Some((inner, Vec::new()));
    }
    let ExprKind::Binary(BinaryOp::Add, a, b) = &inner.kind else { return None };
    matches!(a.kind, ExprKind::Name(_)).then(|| (a.as_ref(), vec![b.as_ref()]))
}

/// The value of `sizeof`, if it is known.
pub(super) fn size_of(program: &Program<'_>, expr: &Expr) -> Option<i64> {
    if let ExprKind::SizeofType(ty) = &expr.kind {
        let is_plain = ty.declarator.n_pointers == 0
            && ty.declarator.lengths.is_empty()
            && !ty.declarator.is_opaque
            && !ty.declarator.is_function;
        return types::scalar(&ty.specifiers.base, program.widths)
            .filter(|_| is_plain)
            .map(Scalar::size);
    }
    let ExprKind::Sizeof(operand) = &expr.kind else { return None };
    if !matches!(operand.kind, ExprKind::Name(_) | ExprKind::Index(..)) {
        return None;
    }
    let (base, indices) = element(operand)?;
    let var = &program.vars[program.var_at(base.span)?];
    match (&var.ty, indices.len()) {
        (Type::Scalar(scalar), 0) if var.reference == Reference::None => Some(scalar.size()),
        (Type::Array(scalar, ..), 0) if var.reference == Reference::None => {
            Some(scalar.size() * i64::from(var.length()?))
        }
        (Type::Array(scalar, _, rest), n) if n == rest.len() + 1 => Some(scalar.size()),
        _ => None,
    }
}

impl Selected {
    /// The constant converted to the type of the selector, as C does with a case label.
    pub(super) fn fold(&self, constant: i64) -> i64 {
        match self.0.ty {
            Scalar::Int { bits, is_signed } => {
                let n = 1_i64 << bits;
                let low = constant.rem_euclid(n);
                if is_signed && low >= n / 2 { low - n } else { low }
            }
            Scalar::Bool => constant,
        }
    }

    /// The condition of one case.
    pub(super) fn equals(&self, constant: i64, span: Span) -> chart::Expr {
        self.0.num().compare(CompareOp::Eq, &Num::constant(constant, span))
    }
}

impl<'s> Flow<'_, 's> {
    // Variables

    /// The path to a variable, as seen from this function.
    pub(super) fn path(&self, var: VarId, span: Span) -> Path {
        let name = self.context.var_names.get(&var).cloned().unwrap_or_default();
        Path::from(Name::new(name, span))
    }

    fn load(&self, place: &Place, span: Span) -> Value {
        let leaf = Leaf::Name(place.path.clone());
        let expr = match &place.index {
            None => chart::Expr::leaf(leaf, span),
            Some(index) => {
                chart::Expr::new(NetKind::Element(leaf, Box::new(index.expr.clone())), span)
            }
        };
        self.loaded(expr, place.ty)
    }

    fn loaded(&self, expr: chart::Expr, ty: Scalar) -> Value {
        if ty == Scalar::Bool {
            return Value { repr: Repr::Bool(expr), ty };
        }
        let (lo, hi) = ty.stored().bounds();
        Value { repr: Repr::Num(loaded(&Num { expr, lo, hi }, ty)), ty }
    }

    /// The expression that is assigned to a place of this type.
    fn raw(&mut self, value: &Value, ty: Scalar) -> chart::Expr {
        let value = self.converted(value, ty);
        match &value.repr {
            Repr::Bool(expr) if ty == Scalar::Bool => expr.clone(),
            Repr::Bool(_) | Repr::Num(_) => self.stored(&value.num(), ty).expr,
        }
    }

    pub(super) fn store(&mut self, place: &Place, value: &Value, span: Span) {
        let raw = self.raw(value, place.ty);
        self.clamped.clear();
        self.assign(
            place.path.clone(),
            place.index.as_ref().map(|index| index.expr.clone()),
            raw,
            span,
        );
    }

    pub(super) fn error(
        &mut self,
        span: Span,
        message: impl FnOnce() -> String,
        help: &str,
    ) -> Value {
        self.findings
            .report(|| Diagnostic::error(codes::C_TYPE, message()).at(span, "").help(help));
        Value::int(0, self.int_type(), span)
    }

    /// The place that an expression refers to; `None` (with a report) if it is not assignable.
    fn place(&mut self, expr: &'s Expr) -> Option<Place> {
        let span = expr.span;
        let Some((base, indices)) = element(expr) else {
            if matches!(expr.kind, ExprKind::Index(..) | ExprKind::Deref(_)) {
                self.error(
                    span,
                    || "only a named array or parameter has elements".to_owned(),
                    "write the name of the array before the brackets",
                );
            } else {
                self.error(
                    span,
                    || "only a variable or an array element can be changed".to_owned(),
                    "write a single variable here; to compare, write `==`",
                );
            }
            return None;
        };
        let Some(var) = self.program().var_at(base.span) else {
            let shown = one_line(self.program().text_of(base.span));
            self.error(
                span,
                || format!("`{shown}` is a constant, not a variable"),
                "declare a variable for a value that changes",
            );
            return None;
        };
        let path = self.path(var, base.span);
        match self.program().vars[var].ty.clone() {
            Type::Scalar(ty) => Some(Place { path, index: None, ty }),
            Type::Array(ty, _, rest) => {
                let what = self.program().vars[var].name.text.clone();
                let length = i64::from(self.program().vars[var].length().unwrap_or(1));
                let flat = self.flat_index(&indices, &rest, span);
                if flat.lo == flat.hi && !(0..length).contains(&flat.lo) {
                    self.error(
                        span,
                        || {
                            format!(
                                "element {} of `{what}` does not exist; its elements are 0..{}",
                                flat.lo,
                                length - 1
                            )
                        },
                        "write an index in this range, or declare a longer array",
                    );
                    return None;
                }
                let index = if flat.lo >= 0 && flat.hi < length {
                    flat
                } else {
                    let hint = match indices.as_slice() {
                        [Expr { kind: ExprKind::Name(name), .. }] => format!("{name}_of_{what}"),
                        _ => format!("index_of_{what}"),
                    };
                    self.clamp(&hint, &flat, 0, length - 1)
                };
                Some(Place { path, index: Some(index), ty })
            }
            Type::Void | Type::Pointer(_) | Type::Opaque => {
                self.error(
                    span,
                    || "nets do not support variables of this type".to_owned(),
                    "use an integer or an array of integers, or keep the function as C with --keep",
                );
                None
            }
        }
    }

    /// The position of an element in its array; `rest` are the lengths after the first one.
    fn flat_index(&mut self, indices: &[&'s Expr], rest: &[u32], span: Span) -> Num {
        let ty = self.int_type();
        let mut flat = Num::constant(0, span);
        for (position, index) in indices.iter().enumerate() {
            let inner = rest.get(position..).unwrap_or(&[]).iter();
            let stride = inner.map(|one| i64::from(*one)).product();
            let (value, stride) = (self.eval(index), Value::int(stride, ty, index.span));
            let Value { repr, .. } = self.binary(BinaryOp::Mul, &value, &stride, index.span);
            let (sum, part) = (Value { repr: Repr::Num(flat), ty }, Value { repr, ty });
            flat = self.binary(BinaryOp::Add, &sum, &part, index.span).num();
        }
        flat
    }

    // Expressions

    /// Evaluates an expression. Its side effects are added to the current node.
    pub(super) fn eval(&mut self, expr: &'s Expr) -> Value {
        let span = expr.span;
        let int = self.int_type();
        match &expr.kind {
            ExprKind::Number { value, is_unsigned, n_long, is_decimal } => {
                let value = i64::try_from(*value).unwrap_or(0);
                Value::int(
                    value,
                    self.literal_type(value, *is_unsigned, *n_long > 0, *is_decimal),
                    span,
                )
            }
            ExprKind::Char(value) => Value::int(*value, int, span),
            ExprKind::Name(name) if self.program().var_at(span).is_none() => {
                self.named_constant(name, span)
            }
            ExprKind::Name(_) | ExprKind::Index(..) | ExprKind::Deref(_) => {
                match self.place(expr) {
                    Some(place) => self.load(&place, span),
                    None => Value::int(0, int, span),
                }
            }
            ExprKind::Call(name, arguments) => self.called(name, arguments, span),
            ExprKind::Step { operand, by, is_prefix } => self.step(operand, *by, *is_prefix, span),
            ExprKind::Unary(op, operand) => {
                let value = self.eval(operand);
                self.unary(*op, &value, span)
            }
            ExprKind::Cast(ty, operand) => {
                let value = self.eval(operand);
                match types::scalar(&ty.specifiers.base, self.program().widths) {
                    Some(ty) => {
                        let value = self.converted(&value, ty);
                        self.shallow(value)
                    }
                    None => value,
                }
            }
            ExprKind::SizeofType(_) | ExprKind::Sizeof(_) => {
                let size = size_of(self.program(), expr).unwrap_or(0);
                Value::int(
                    size,
                    Scalar::Int { bits: self.program().widths.int, is_signed: false },
                    span,
                )
            }
            ExprKind::Binary(op, a, b) => {
                let left = self.eval(a);
                let right = self.eval(b);
                self.binary(*op, &left, &right, span)
            }
            ExprKind::Junction(is_and, all) => self.junction(*is_and, all, expr),
            ExprKind::Conditional(condition, a, b) => self.conditional(condition, a, b, span),
            ExprKind::Assign(op, left, right) => self.assignment(*op, left, right, span),
            ExprKind::Comma(all) => {
                let Some((last, before)) = all.split_last() else {
                    return Value::int(0, int, span);
                };
                before.iter().for_each(|one| self.discard(one));
                self.eval(last)
            }
            ExprKind::Float | ExprKind::Text | ExprKind::Opaque(_) | ExprKind::AddressOf(_) => self
                .error(
                    span,
                    || "nets do not support this value".to_owned(),
                    "use integers, or keep the function as C with --keep",
                ),
        }
    }

    /// The value of a name that is no variable: a constant of the source.
    fn named_constant(&mut self, name: &str, span: Span) -> Value {
        match name {
            "true" => self.of_truth(chart::Expr::new(NetKind::Bool(true), span)),
            "false" | "NULL" => self.of_truth(chart::Expr::new(NetKind::Bool(false), span)),
            _ => {
                let value = self.program().constants.get(name).copied().unwrap_or(0);
                Value::int(value, self.literal_type(value, false, false, true), span)
            }
        }
    }

    /// The result of a call.
    fn called(&mut self, name: &Name, arguments: &'s [Expr], span: Span) -> Value {
        let Some(callee) = self.program().callee(&name.text) else {
            return self.error(
                span,
                || format!("this chart has no function `{name}`"),
                "write the function in this file",
            );
        };
        match self.call(callee, arguments, span) {
            Some(value) => value,
            None => self.error(
                span,
                || format!("`{name}` returns nothing, so it has no value"),
                "call it in a statement, or declare the type of its result",
            ),
        }
    }

    /// The type of a literal (C99 6.4.4.1): the first type that can represent the value.
    fn literal_type(
        &self,
        value: i64,
        is_unsigned: bool,
        is_long: bool,
        is_decimal: bool,
    ) -> Scalar {
        let int = self.program().widths.int;
        let widths: &[u32] = if is_long || int == 32 { &[32] } else { &[16, 32] };
        for bits in widths {
            let signed = Scalar::Int { bits: *bits, is_signed: true };
            let unsigned = Scalar::Int { bits: *bits, is_signed: false };
            if !is_unsigned && (signed.range().0..=signed.range().1).contains(&value) {
                return signed;
            }
            if (is_unsigned || !is_decimal || *bits == 32)
                && (0..=unsigned.range().1).contains(&value)
            {
                return unsigned;
            }
        }
        Scalar::Int { bits: 32, is_signed: true }
    }

    /// Evaluates an expression only for its side effects.
    fn discard(&mut self, expr: &'s Expr) {
        let program = self.program();
        if !program.has_effect(expr) {
            return;
        }
        if let ExprKind::Call(name, arguments) = &expr.kind
            && let Some(callee) = program.callee(&name.text)
        {
            self.call(callee, arguments, expr.span);
        } else if let ExprKind::Step { operand, by, .. } = &expr.kind {
            // The old value is not used.
            self.step(operand, *by, true, expr.span);
        } else if let ExprKind::Cast(_, inner) = &expr.kind {
            self.discard(inner);
        } else if let ExprKind::Comma(all) = &expr.kind {
            all.iter().for_each(|one| self.discard(one));
        } else if let ExprKind::Conditional(condition, a, b) = &expr.kind
            && (program.has_effect(a) || program.has_effect(b))
        {
            let (yes, no, behind) = (self.join(a.span), self.join(b.span), self.join(expr.span));
            self.branch_on(condition, yes, no);
            for (node, one) in [(yes, a), (no, b)] {
                self.current = Some(node);
                self.open("eval", &one_line(self.program().text_of(one.span)), one.span);
                self.discard(one);
                self.go_on(behind);
            }
        } else {
            self.eval(expr);
        }
    }

    /// Translates an expression statement.
    pub(super) fn effect(&mut self, expr: &'s Expr) {
        self.full_expression();
        if self.program().is_opaque(expr.span) {
            self.library_effect(expr);
            return;
        }
        self.discard(expr);
    }

    /// Translates `var = expr` for the initial value of a variable, an argument, or the return value of a function.
    pub(super) fn initialise(&mut self, var: VarId, expr: &'s Expr) {
        self.full_expression();
        if self.program().is_opaque(expr.span) {
            self.library_assign(var, expr);
            return;
        }
        let value = self.eval(expr);
        let Some(ty) = self.program().vars[var].scalar() else { return };
        let place = Place { path: self.path(var, expr.span), index: None, ty };
        self.store(&place, &value, expr.span);
    }

    fn step(&mut self, operand: &'s Expr, by: i64, is_prefix: bool, span: Span) -> Value {
        let int = self.int_type();
        let Some(place) = self.place(operand) else { return Value::int(0, int, span) };
        let old = self.load(&place, span);
        let old = if is_prefix { old } else { self.held(&old, "old") };
        let new = self.binary(BinaryOp::Add, &old, &Value::int(by, int, span), span);
        self.store(&place, &new, span);
        if is_prefix { self.load(&place, span) } else { old }
    }

    fn assignment(
        &mut self,
        op: Option<BinaryOp>,
        left: &'s Expr,
        right: &'s Expr,
        span: Span,
    ) -> Value {
        // Evaluates the value first: a call in it may end the node, and the index of the target must be evaluated in the next node.
        let is_element = !matches!(left.kind, ExprKind::Name(_));
        let early =
            if is_element && self.program().has_effect(left) { self.place(left) } else { None };
        let value = self.eval(right);
        let Some(place) = early.or_else(|| self.place(left)) else { return value };
        let value = match op {
            None => value,
            Some(op) => {
                let old = self.load(&place, left.span);
                self.binary(op, &old, &value, span)
            }
        };
        self.store(&place, &value, span);
        self.load(&place, left.span)
    }

    fn junction(&mut self, is_and: bool, all: &'s [Expr], expr: &'s Expr) -> Value {
        if all[1..].iter().any(|one| self.program().has_effect(one)) {
            let span = expr.span;
            let (yes, no, behind) = (self.join(span), self.join(span), self.join(span));
            let name = self.temp("truth", NetType::Bool);
            let path = Path::from(Name::new(name, span));
            self.branch_on(expr, yes, no);
            for (node, value) in [(yes, true), (no, false)] {
                self.current = Some(node);
                self.assign(path.clone(), None, chart::Expr::new(NetKind::Bool(value), span), span);
                self.go_on(behind);
            }
            return self.of_truth(chart::Expr::leaf(Leaf::Name(path), span));
        }
        // The operands after the first have no side effects. They can always be evaluated, because every operator of the net has a value.
        let truths: Vec<chart::Expr> = all.iter().map(|one| self.eval(one).truth()).collect();
        let truth = if is_and { chart::Expr::and(truths) } else { chart::Expr::or(truths) };
        let value = self.of_truth(chart::Expr { span: expr.span, ..truth });
        self.shallow(value)
    }

    fn conditional(&mut self, condition: &'s Expr, a: &'s Expr, b: &'s Expr, span: Span) -> Value {
        let widths = self.program().widths;
        if !self.program().has_effect(a) && !self.program().has_effect(b) {
            let truth = self.eval(condition).truth();
            let (x, y) = (self.eval(a), self.eval(b));
            if let (Repr::Bool(p), Repr::Bool(q)) = (&x.repr, &y.repr) {
                let choice = chart::Expr::new(
                    NetKind::Select(Box::new(truth), Box::new(p.clone()), Box::new(q.clone())),
                    span,
                );
                let value = self.of_truth(choice);
                return self.shallow(value);
            }
            let ty = x.ty.common(y.ty, widths);
            let (x, y) = (self.converted(&x, ty).num(), self.converted(&y, ty).num());
            let (lo, hi) = (x.lo.min(y.lo), x.hi.max(y.hi));
            let expr = chart::Expr::new(
                NetKind::Select(Box::new(truth), Box::new(x.expr), Box::new(y.expr)),
                span,
            );
            return self.shallow(Value { repr: Repr::Num(Num { expr, lo, hi }), ty });
        }
        let (yes, no, behind) = (self.join(a.span), self.join(b.span), self.join(span));
        self.branch_on(condition, yes, no);
        self.current = Some(yes);
        let x = self.eval(a);
        let yes_end = self.current.take();
        self.current = Some(no);
        let y = self.eval(b);
        let no_end = self.current.take();
        let ty = x.ty.common(y.ty, widths);
        let name = self.temp("choice", ty.stored());
        let place = Place { path: Path::from(Name::new(name, span)), index: None, ty };
        for (end, value) in [(yes_end, x), (no_end, y)] {
            self.current = end;
            self.store(&place, &value, span);
            self.go_on(behind);
        }
        self.load(&place, span)
    }

    // Conditions

    /// Evaluates a condition with its side effects, and ends the current node with two ways.
    pub(super) fn condition(&mut self, expr: &'s Expr, then: usize, otherwise: usize) {
        self.full_expression();
        if self.program().is_opaque(expr.span) {
            let guard = self.library_condition(expr);
            self.branch(guard, expr.span, then, otherwise);
            return;
        }
        self.branch_on(expr, then, otherwise);
    }

    fn branch_on(&mut self, expr: &'s Expr, then: usize, otherwise: usize) {
        if let ExprKind::Unary(UnaryOp::Not, inner) = &expr.kind
            && self.program().has_effect(inner)
        {
            self.branch_on(inner, otherwise, then);
        } else if let ExprKind::Junction(is_and, all) = &expr.kind
            && all[1..].iter().any(|one| self.program().has_effect(one))
            && let Some((last, before)) = all.split_last()
        {
            for one in before {
                let next = self.join(one.span);
                if *is_and {
                    self.branch_on(one, next, otherwise);
                } else {
                    self.branch_on(one, then, next);
                }
                self.nodes[next].is_test = true;
                self.nodes[next].hint = "test".to_owned();
                self.current = Some(next);
            }
            self.branch_on(last, then, otherwise);
        } else {
            let guard = self.eval(expr).truth();
            self.branch(guard, expr.span, then, otherwise);
        }
    }

    /// Evaluates the selector of a `switch`, promoted.
    pub(super) fn selector(&mut self, expr: &'s Expr) -> Selected {
        self.full_expression();
        let int = self.int_type();
        if self.program().is_opaque(expr.span) {
            let value = self.library_number(expr);
            let (lo, hi) = int.range();
            return Selected(Value { repr: Repr::Num(Num { expr: value, lo, hi }), ty: int });
        }
        let value = self.eval(expr);
        let ty = value.ty.promoted(self.program().widths);
        let value = self.converted(&value, ty);
        // Every case compares the selector, so the selector must be a small expression.
        let is_small = matches!(&value.repr, Repr::Num(Num { expr, .. }) if matches!(expr.kind, NetKind::Leaf(_) | NetKind::Element(..) | NetKind::Int(_)));
        Selected(if is_small { value } else { self.held(&value, "selected") })
    }

    // Calls

    /// Calls a function of the chart. Returns its value, if it has one.
    pub(super) fn call(
        &mut self,
        callee: FunctionId,
        arguments: &'s [Expr],
        span: Span,
    ) -> Option<Value> {
        let params = self.program().functions[callee].params.clone();
        let name = self.program().functions[callee].def.name.clone();
        if params.len() != arguments.len() {
            let (wanted, given) = (params.len(), arguments.len());
            self.findings.report(|| {
                Diagnostic::error(
                    codes::C_ARGUMENTS,
                    format!(
                        "`{name}` takes {}, not {given}",
                        counted(wanted, "argument", "arguments")
                    ),
                )
                .at(span, format!("{given} given here"))
                .at(name.span, "the function")
                .help(if given < wanted {
                    format!(
                        "write {} in this call, or remove parameters of `{name}`",
                        counted(wanted - given, "more argument", "more arguments")
                    )
                } else {
                    format!(
                        "remove {} from this call, or add parameters to `{name}`",
                        counted(given - wanted, "argument", "arguments")
                    )
                })
            });
        }
        let shared = self.context.shared.get(&callee).cloned();
        let is_shared = shared.is_some();
        let step = match shared {
            Some(step) => step,
            None => self.names.fresh(&format!("call_{name}")),
        };
        let mut latches = Vec::new();
        let mut returns: Vec<(Place, Path, Option<u32>)> = Vec::new();
        for (param, argument) in params.iter().zip(arguments) {
            self.argument(callee, *param, argument, &step, &mut latches, &mut returns);
        }
        let wait = is_shared.then(|| self.names.fresh(&format!("wait_{name}")));
        self.call_site(CallSite { callee, step: step.clone(), wait, latches, span });
        for (place, from, length) in returns {
            match length {
                None => {
                    let value = self.loaded(chart::Expr::leaf(Leaf::Name(from), span), place.ty);
                    self.store(&place, &value, span);
                }
                Some(length) => {
                    for index in 0..i64::from(length) {
                        let at = chart::Expr::new(NetKind::Int(index), span);
                        let value = chart::Expr::new(
                            NetKind::Element(Leaf::Name(from.clone()), Box::new(at.clone())),
                            span,
                        );
                        self.assign(place.path.clone(), Some(at), value, span);
                    }
                }
            }
        }
        let result = self.program().functions[callee].result?;
        if self.program().vars[result].in_library {
            return Some(Value::int(0, self.int_type(), span));
        }
        let ty = self.program().vars[result].scalar()?;
        let path = self.inside(&step, result, span);
        let value = self.loaded(chart::Expr::leaf(Leaf::Name(path), span), ty);
        // The next call of a shared macro-step would overwrite the value.
        Some(if is_shared { self.held(&value, &format!("{name}_value")) } else { value })
    }

    /// A variable of a macro-step, as seen from outside.
    fn inside(&self, step: &str, var: VarId, span: Span) -> Path {
        let mut path = Path::from(Name::new(step, span));
        path.names.extend(self.path(var, span).names);
        path
    }

    fn argument(
        &mut self,
        callee: FunctionId,
        param: VarId,
        argument: &'s Expr,
        step: &str,
        latches: &mut chart::Block,
        returns: &mut Vec<(Place, Path, Option<u32>)>,
    ) {
        let span = argument.span;
        let (reference, in_library, is_written) = {
            let param = &self.program().vars[param];
            (param.reference, param.in_library, param.is_written)
        };
        if in_library {
            self.library_assign(param, argument);
            return;
        }
        let path = self.inside(step, param, span);
        match reference {
            Reference::None => {
                let value = self.eval(argument);
                let Some(ty) = self.program().vars[param].scalar() else { return };
                let raw = self.raw(&value, ty);
                latches.push(chart::Stmt {
                    kind: StmtKind::Assign { target: path, index: None, value: raw },
                    span,
                });
            }
            Reference::Scalar => {
                let target =
                    if let ExprKind::AddressOf(inner) = &argument.kind { inner } else { argument };
                let Some(place) = self.place(target) else { return };
                let value = self.load(&place, span);
                let Some(ty) = self.program().vars[param].scalar() else { return };
                let raw = self.raw(&value, ty);
                latches.push(chart::Stmt {
                    kind: StmtKind::Assign { target: path.clone(), index: None, value: raw },
                    span,
                });
                self.aliases(callee, target, span);
                returns.push((place, path, None));
            }
            Reference::Array => {
                let Some(var) = self.program().var_at(span) else { return };
                let (Some(mine), Some(theirs), Some(ty)) = (
                    self.program().vars[var].length(),
                    self.program().vars[param].length(),
                    self.program().vars[var].scalar(),
                ) else {
                    return;
                };
                let length = mine.min(theirs);
                let from = self.path(var, span);
                for index in 0..i64::from(length) {
                    let at = chart::Expr::new(NetKind::Int(index), span);
                    let value = chart::Expr::new(
                        NetKind::Element(Leaf::Name(from.clone()), Box::new(at.clone())),
                        span,
                    );
                    latches.push(chart::Stmt {
                        kind: StmtKind::Assign { target: path.clone(), index: Some(at), value },
                        span,
                    });
                }
                self.aliases(callee, argument, span);
                if is_written {
                    returns.push((Place { path: from, index: None, ty }, path, Some(length)));
                }
            }
        }
    }

    /// Reports a global variable that a function receives by reference and also uses by name: the parameter is a copy, so the variable
    /// would have two values at once.
    fn aliases(&mut self, callee: FunctionId, target: &Expr, span: Span) {
        let Some(var) = element(target).and_then(|(base, _)| self.program().var_at(base.span))
        else {
            return;
        };
        if self.program().vars[var].home != Home::Global {
            return;
        }
        let mut open = vec![callee];
        let mut seen = vec![callee];
        while let Some(function) = open.pop() {
            let info = &self.program().functions[function];
            let body = info.def.body.span;
            if self.program().uses.range(body.start..body.end).any(|(_, used)| *used == var) {
                let name = self.program().vars[var].name.text.clone();
                let function = info.def.name.text.clone();
                let help = format!("use only one way in `{function}`: its parameter, or `{name}`");
                self.error(
                    span,
                    || {
                        format!(
                            "`{name}` is passed by its address, but `{function}` also uses it by name"
                        )
                    },
                    &help,
                );
                return;
            }
            for (next, _) in &info.calls {
                if !seen.contains(next) {
                    seen.push(*next);
                    open.push(*next);
                }
            }
        }
    }
}
