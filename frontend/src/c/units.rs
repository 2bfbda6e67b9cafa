//! Decides for each unit whether the net can express it or whether it is left to the library: applies the rule of [`super::resolve`] until
//! nothing changes.

use super::ast::{Base, Declaration, Expr, ExprKind, Init, Stmt, StmtKind};
use super::resolve::{FunctionId, Home, Program, Reference, Resolver, VarId};
use super::types::{self, Type};
use super::value;
use crate::codes;
use grafsynth_ir::Gather;
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::{Name, Span};
use std::collections::BTreeSet;

/// A part of the source that the net expresses either completely or not at all.
struct Unit<'s> {
    span: Span,
    exprs: Vec<&'s Expr>,
    touched: BTreeSet<VarId>,
    /// The reason why the net cannot express it.
    reason: Option<(Span, String)>,
}

impl<'s> Resolver<'s, '_> {
    pub(super) fn units(&mut self) {
        let mut units = Vec::new();
        for id in 0..self.program.functions.len() {
            if !self.program.functions[id].is_kept {
                let body = &self.program.functions[id].def.body;
                Collector { program: &self.program, function: id, units: &mut units }
                    .statement(body);
            }
        }
        for var in &mut self.program.vars {
            var.in_library |= matches!(var.ty, Type::Opaque);
        }
        // A kept function accesses globals by their names.
        let in_kept: Vec<VarId> = self
            .program
            .functions
            .iter()
            .filter(|one| one.is_kept)
            .flat_map(|one| {
                let span = one.def.span;
                self.program
                    .uses
                    .range(span.start..span.end)
                    .map(|(_, var)| *var)
                    .collect::<Vec<_>>()
            })
            .collect();
        for var in in_kept {
            self.program.vars[var].in_library = true;
        }
        let mut is_opaque = vec![false; units.len()];
        loop {
            let mut changed = false;
            for (unit, is_opaque) in units.iter().zip(&mut is_opaque) {
                let now = *is_opaque
                    || unit.reason.is_some()
                    || unit.touched.iter().any(|var| self.program.vars[*var].in_library);
                if now && !*is_opaque {
                    *is_opaque = true;
                    changed = true;
                    for var in &unit.touched {
                        self.program.vars[*var].in_library = true;
                    }
                }
            }
            if !changed {
                break;
            }
        }
        for (unit, is_opaque) in units.iter().zip(is_opaque) {
            if !is_opaque {
                continue;
            }
            self.program.opaque.insert((unit.span.start, unit.span.end));
            if let Some((span, reason)) = &unit.reason {
                self.findings.report(|| {
                    Diagnostic::note(codes::C_OPAQUE, format!("kept as C code: {reason}"))
                        .at(*span, "only the C engine can run this")
                        .help("the chart runs on a CPU only; traces and proofs do not cover the variables used here")
                });
            }
            for expr in &unit.exprs {
                self.conditional_call(expr);
            }
        }
    }

    /// Reports a call of a chart function inside `&&`, `||` or `?:` of an opaque unit: the call is conditional, but the chart runs all
    /// calls before the unit.
    fn conditional_call(&mut self, expr: &'s Expr) {
        let mut inner: Option<Span> = None;
        let program = &self.program;
        expr.each(&mut |one| {
            let mut later: Vec<&Expr> = Vec::new();
            if let ExprKind::Junction(_, all) = &one.kind {
                later.extend(&all[1..]);
            } else if let ExprKind::Conditional(_, a, b) = &one.kind {
                later.extend([a.as_ref(), b.as_ref()]);
            }
            for branch in later {
                if program.has_call(branch) {
                    inner.get_or_insert(branch.span);
                }
            }
        });
        if let Some(span) = inner {
            self.findings.report(|| {
                Diagnostic::error(
                    codes::C_TYPE,
                    "an expression that is kept as C contains a conditional call",
                )
                .at(span, "")
                .help("write the condition as an `if`, or keep the function as C with --keep")
            });
        }
    }
}

struct Collector<'p, 's> {
    program: &'p Program<'s>,
    function: FunctionId,
    units: &'p mut Vec<Unit<'s>>,
}

impl<'s> Collector<'_, 's> {
    fn statement(&mut self, statement: &'s Stmt) {
        match &statement.kind {
            StmtKind::Expr(expr) => self.unit(expr, None),
            StmtKind::Return(Some(expr)) => {
                self.unit(expr, self.program.functions[self.function].result)
            }
            StmtKind::Block(all) => all.iter().for_each(|one| self.statement(one)),
            StmtKind::Declaration(declaration) => self.declaration(declaration),
            StmtKind::If(condition, then, otherwise) => {
                self.unit(condition, None);
                self.statement(then);
                otherwise.iter().for_each(|one| self.statement(one));
            }
            StmtKind::While(condition, body)
            | StmtKind::Do(body, condition)
            | StmtKind::Switch(condition, body) => {
                self.unit(condition, None);
                self.statement(body);
            }
            StmtKind::For { first, condition, last, body } => {
                first.iter().for_each(|one| self.statement(one));
                condition.iter().chain(last).for_each(|one| self.unit(one, None));
                self.statement(body);
            }
            StmtKind::Case(_, body) | StmtKind::Default(body) | StmtKind::Label(_, body) => {
                self.statement(body)
            }
            _ => {}
        }
    }

    fn declaration(&mut self, declaration: &'s Declaration) {
        for (declarator, init) in &declaration.declared {
            let Some(var) = self.program.declared.get(&declarator.name.span.start).copied() else {
                continue;
            };
            if !matches!(self.program.vars[var].home, Home::Local(_)) {
                continue;
            }
            match init {
                None => {}
                Some(Init::One(Expr { kind: ExprKind::Text, .. }))
                    if matches!(self.program.vars[var].ty, Type::Array(..)) => {}
                Some(Init::One(expr)) => self.unit(expr, Some(var)),
                Some(Init::List(all, span)) => {
                    let mut unit = Unit {
                        span: *span,
                        exprs: Vec::new(),
                        touched: [var].into_iter().gather(),
                        reason: None,
                    };
                    self.list(all, &mut unit);
                    self.units.push(unit);
                }
            }
        }
    }

    fn list(&mut self, all: &'s [Init], unit: &mut Unit<'s>) {
        for one in all {
            match one {
                Init::One(expr) => {
                    unit.exprs.push(expr);
                    self.look(expr, unit);
                }
                Init::List(inner, _) => self.list(inner, unit),
            }
        }
    }

    fn unit(&mut self, expr: &'s Expr, also: Option<VarId>) {
        let mut unit = Unit {
            span: expr.span,
            exprs: vec![expr],
            touched: also.into_iter().gather(),
            reason: None,
        };
        self.look(expr, &mut unit);
        self.units.push(unit);
    }

    fn refuse(unit: &mut Unit<'s>, span: Span, reason: impl FnOnce() -> String) {
        if unit.reason.is_none() {
            unit.reason = Some((span, reason()));
        }
    }

    fn look(&mut self, expr: &'s Expr, unit: &mut Unit<'s>) {
        let program = self.program;
        let span = expr.span;
        match &expr.kind {
            ExprKind::Number { value, n_long, .. } => {
                if *n_long > 1 || *value > u64::from(u32::MAX) {
                    Self::refuse(unit, span, || "a number of more than 32 bits".to_owned());
                }
            }
            ExprKind::Char(_) | ExprKind::SizeofType(_) | ExprKind::Sizeof(_) => {
                if value::size_of(program, expr).is_none()
                    && !matches!(expr.kind, ExprKind::Char(_))
                {
                    Self::refuse(unit, span, || {
                        "the size of a type that nets do not support".to_owned()
                    });
                }
            }
            ExprKind::Float => Self::refuse(unit, span, || "a floating-point number".to_owned()),
            ExprKind::Text => Self::refuse(unit, span, || "a string".to_owned()),
            ExprKind::Name(name) => match program.var_at(span) {
                Some(var) => {
                    unit.touched.insert(var);
                    if !matches!(program.vars[var].ty, Type::Scalar(_))
                        || program.vars[var].reference == Reference::Scalar
                    {
                        Self::refuse(unit, span, || {
                            format!("`{name}` is used as a whole, or nets do not support its type")
                        });
                    }
                }
                None => {
                    if !program.constants.contains_key(name)
                        && !matches!(name.as_str(), "true" | "false" | "NULL")
                    {
                        Self::refuse(unit, span, || format!("only a C compiler knows `{name}`"));
                    }
                }
            },
            ExprKind::Index(..) | ExprKind::Deref(_) => self.element(expr, unit),
            ExprKind::Call(name, arguments) => self.call(expr, name, arguments, unit),
            ExprKind::Opaque(all) => {
                Self::refuse(unit, span, || "a structure or a call through a pointer".to_owned());
                all.iter().for_each(|one| self.look(one, unit));
            }
            ExprKind::AddressOf(inner) => {
                Self::refuse(unit, span, || "an address".to_owned());
                self.look(inner, unit);
            }
            ExprKind::Cast(ty, inner) => {
                let is_plain = ty.declarator.n_pointers == 0
                    && !ty.declarator.is_opaque
                    && ty.declarator.lengths.is_empty()
                    && !ty.declarator.is_function;
                let is_known = types::scalar(&ty.specifiers.base, program.widths).is_some()
                    || ty.specifiers.base == Base::Void;
                if !is_plain || !is_known {
                    Self::refuse(unit, span, || {
                        "a cast to a type that nets do not support".to_owned()
                    });
                }
                self.look(inner, unit);
            }
            _ => expr.operands().into_iter().for_each(|operand| self.look(operand, unit)),
        }
    }

    /// Handles `a[i]`, `a[i][j]`, `*p`, `*(p + i)`.
    fn element(&mut self, expr: &'s Expr, unit: &mut Unit<'s>) {
        let Some((base, indices)) = value::element(expr) else {
            Self::refuse(unit, expr.span, || {
                "an element of something that is not an array".to_owned()
            });
            expr.operands().into_iter().for_each(|operand| self.look(operand, unit));
            return;
        };
        let is_known = match self.program.var_at(base.span) {
            Some(var) => {
                unit.touched.insert(var);
                match &self.program.vars[var].ty {
                    Type::Array(_, _, rest) => {
                        indices.len() == rest.len() + 1 || (indices.is_empty() && rest.is_empty())
                    }
                    Type::Scalar(_) => {
                        self.program.vars[var].reference == Reference::Scalar && indices.is_empty()
                    }
                    Type::Void | Type::Pointer(_) | Type::Opaque => false,
                }
            }
            None => false,
        };
        if !is_known {
            Self::refuse(unit, expr.span, || {
                "an element of something that is not an array of the net".to_owned()
            });
        }
        indices.into_iter().for_each(|index| self.look(index, unit));
    }

    fn call(&mut self, expr: &'s Expr, name: &'s Name, arguments: &'s [Expr], unit: &mut Unit<'s>) {
        let program = self.program;
        let Some(callee) = program.callee(&name.text) else {
            let what = if program.by_name.contains_key(&name.text) {
                "which is kept as C"
            } else {
                "which has no body in this file"
            };
            Self::refuse(unit, expr.span, || format!("a call of `{name}`, {what}"));
            if let Some(var) = program.var_at(name.span) {
                unit.touched.insert(var);
            }
            arguments.iter().for_each(|one| self.library_argument(one, unit));
            return;
        };
        unit.touched.extend(program.functions[callee].result);
        for (index, argument) in arguments.iter().enumerate() {
            let param = program.functions[callee].params.get(index).copied();
            let reference = param.map_or(Reference::None, |param| program.vars[param].reference);
            match (&argument.kind, reference) {
                (ExprKind::Name(_), Reference::Array | Reference::Scalar) => {
                    let touched = param.into_iter().chain(program.var_at(argument.span)).gather();
                    let mut own =
                        Unit { span: argument.span, exprs: vec![argument], touched, reason: None };
                    let matches = program
                        .var_at(argument.span)
                        .is_some_and(|var| argument_fits(program, param, var));
                    if !matches {
                        Self::refuse(&mut own, argument.span, || {
                            "a pointer that is not an array of the net".to_owned()
                        });
                    }
                    self.units.push(own);
                }
                (ExprKind::AddressOf(inner), Reference::Scalar) => self.unit(inner, param),
                (_, Reference::Array | Reference::Scalar) => {
                    let mut own = Unit {
                        span: argument.span,
                        exprs: vec![argument],
                        touched: param.into_iter().gather(),
                        reason: None,
                    };
                    self.look(argument, &mut own);
                    Self::refuse(&mut own, argument.span, || {
                        "a pointer that is not an array of the net".to_owned()
                    });
                    self.units.push(own);
                }
                (_, Reference::None) => self.unit(argument, param),
            }
        }
    }

    /// Handles an argument of a library function, which may be an array or an address of a variable. The function may use that variable.
    fn library_argument(&mut self, argument: &'s Expr, unit: &mut Unit<'s>) {
        self.look(argument, unit);
    }
}

/// Whether an array or pointer of the net can be passed to the parameter.
fn argument_fits(program: &Program<'_>, param: Option<VarId>, var: VarId) -> bool {
    let Some(param) = param else { return false };
    match (&program.vars[param].ty, &program.vars[var].ty) {
        (Type::Array(a, _, more), Type::Array(b, _, others)) => a == b && more == others,
        (Type::Scalar(a), Type::Scalar(b)) => {
            a == b && program.vars[var].reference == Reference::Scalar
        }
        _ => false,
    }
}
