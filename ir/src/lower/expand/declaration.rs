//! Declarations become inputs, outputs, variables, timers and constants of the net; a later pass lowers their initial values.

use super::super::codes;
use super::super::context::{Lowering, ScopeId, Symbol, Work};
use super::Expansion;
use crate::chart::{self, DeclarationKind};
use crate::diag::Diagnostic;
use crate::expr::{Expr, Type};
use crate::net::{Driver, Input, InputKind, Net, Output, Param, Timer, Var, VarOrigin};

/// The maximum number of elements of an array.
const MAX_LENGTH: u32 = 65_536;

/// What a declaration declares, if that is part of the interface of the whole chart.
fn outside(kind: &DeclarationKind) -> Option<&'static str> {
    match kind {
        DeclarationKind::Input { .. } => Some("an input"),
        DeclarationKind::Output { .. } => Some("an output"),
        DeclarationKind::ExternCondition { .. } => Some("an extern condition"),
        DeclarationKind::ExternAction { .. } => Some("an extern action"),
        DeclarationKind::Event { internal: false } => Some("an event"),
        DeclarationKind::Event { internal: true }
        | DeclarationKind::Var { .. }
        | DeclarationKind::Timer { .. }
        | DeclarationKind::Const { .. } => None,
    }
}

impl<'a> Expansion<'_, 'a> {
    pub(in crate::lower) fn declaration(&mut self, scope: ScopeId, source: &'a chart::Declaration) {
        let is_top = self.lowering.scopes[scope].parent.is_none();
        if let Some(what) = outside(&source.kind).filter(|_| !is_top) {
            let message = format!("{what} belongs to the chart, not to a body in it");
            self.lowering.report(
                Diagnostic::error(codes::DECLARED_INSIDE, message)
                    .at(source.name.span, "declared here")
                    .help("declare it at the top level of the chart; it is visible in all bodies"),
            );
        }
        let name = self.lowering.full_name(scope, &source.name);
        let meta = source.meta.clone();
        let ranges_fit = self.ranges(source);
        // A rejected range must not break later computations with it.
        let sane = |ty: Type| match ty {
            Type::Int { lo, hi } if lo > hi => Type::Int { lo: hi, hi: lo },
            Type::Int { .. } | Type::Bool => ty,
        };
        let net = &mut self.lowering.net;
        let input = |net: &mut Net, ty, kind, synchronous| {
            let (name, meta) = (name.clone(), meta.clone());
            Symbol::Input(net.inputs.push(Input { name, ty, kind, synchronous, meta }))
        };
        let symbol = match &source.kind {
            DeclarationKind::Input { ty, synchronous } => {
                input(net, sane(*ty), InputKind::Pin, *synchronous)
            }
            DeclarationKind::ExternCondition { ty } => {
                input(net, sane(*ty), InputKind::Extern, false)
            }
            DeclarationKind::Event { internal } => {
                let kind = if *internal { InputKind::InternalEvent } else { InputKind::Event };
                input(net, Type::Bool, kind, false)
            }
            DeclarationKind::Output { ty, registered, .. } => {
                let driver = Driver::Continuous(Vec::new());
                let (ty, registered) = (sane(*ty), *registered);
                let output = Output { name, ty, driver, safe: None, registered, meta };
                Symbol::Output(net.outputs.push(output))
            }
            DeclarationKind::ExternAction { params } => {
                let params = params
                    .iter()
                    .map(|(name, ty)| Param { name: name.clone(), ty: sane(*ty) })
                    .collect();
                let driver = Driver::Extern { params, calls: Vec::new() };
                let (ty, registered) = (Type::Bool, false);
                let output = Output { name, ty, driver, safe: None, registered, meta };
                Symbol::Output(net.outputs.push(output))
            }
            DeclarationKind::Var { ty, len, .. } => {
                let ty = sane(*ty);
                let zero = ty.saturate(0);
                let init = vec![zero; len.unwrap_or(1).clamp(1, MAX_LENGTH) as usize];
                let origin = VarOrigin::Declared;
                let len = len.map(|len| len.clamp(1, MAX_LENGTH));
                Symbol::Var(net.vars.push(Var { name, ty, len, init, origin, meta }))
            }
            DeclarationKind::Timer { .. } => {
                let (condition, starts_expired) = (Expr::bool(false), false);
                Symbol::Timer(net.timers.push(Timer { name, condition, starts_expired, meta }))
            }
            DeclarationKind::Const { value } => match self.lowering.constant_value(scope, value) {
                Ok(value) => Symbol::Const(value),
                Err(_) => Symbol::Broken,
            },
        };
        let is_new = self.lowering.declare(scope, &source.name, symbol);
        if ranges_fit && is_new {
            self.lowering.work.push(Work::Declaration { scope, source, symbol });
        }
    }

    /// Checks declared ranges and lengths.
    fn ranges(&mut self, source: &chart::Declaration) -> bool {
        let mut fit = true;
        let mut check = |ty: &Type, lowering: &mut Lowering<'a>| {
            let Type::Int { lo, hi } = *ty else { return };
            let message = if lo > hi {
                format!("the range {lo}..{hi} of `{}` is empty", source.name)
            } else if lo < i64::from(i32::MIN) || hi > i64::from(i32::MAX) {
                format!("the range {lo}..{hi} of `{}` needs more than 32 bits", source.name)
            } else {
                return;
            };
            fit = false;
            let mut finding =
                Diagnostic::error(codes::RANGE, message).at(source.name.span, "declared here");
            if lo > hi {
                finding = finding.help(format!("write {hi}..{lo}"));
            } else {
                finding = finding.help("use bounds between -2147483648 and 2147483647");
            }
            lowering.report(finding);
        };
        match &source.kind {
            DeclarationKind::Input { ty, .. }
            | DeclarationKind::Output { ty, .. }
            | DeclarationKind::ExternCondition { ty } => check(ty, self.lowering),
            DeclarationKind::Var { ty, len, .. } => {
                check(ty, self.lowering);
                if let Some(len) = *len
                    && (len == 0 || len > MAX_LENGTH)
                {
                    fit = false;
                    self.lowering.report(
                        Diagnostic::error(
                            codes::RANGE,
                            format!("the array `{}` has {len} elements", source.name),
                        )
                        .at(source.name.span, "declared here")
                        .help(format!("use 1 to {MAX_LENGTH} elements")),
                    );
                }
            }
            DeclarationKind::ExternAction { params } => {
                for (_, ty) in params {
                    check(ty, self.lowering);
                }
            }
            DeclarationKind::Event { .. }
            | DeclarationKind::Timer { .. }
            | DeclarationKind::Const { .. } => {}
        }
        fit
    }
}
