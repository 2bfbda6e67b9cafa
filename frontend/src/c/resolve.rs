//! Resolves names and parameters, and finds the code that no net can express.
//!
//! A source is divided into *units*: an expression statement, a condition, an initial value, an argument, a returned value. A unit that the
//! net cannot express (floating point, pointers, structures, calls of functions outside the source) is *opaque*: it becomes an extern
//! function of the chart with the text of the unit. Variables used by an opaque unit must be in the library, so every other unit that uses
//! such a variable is opaque too. This rule is applied until nothing changes.

use super::Options;
use super::ast::{
    Declaration, Declarator, Expr, ExprKind, External, Function, Init, Param, Source, Specifiers,
    Stmt, StmtKind,
};
use super::sequence;
use super::types::{self, Scalar, Type, Widths};
use crate::codes;
use crate::findings::Findings;
use grafsynth_ir::Gather;
use grafsynth_ir::diag::{Diagnostic, any_error, joined, nearest};
use grafsynth_ir::{FileId, Name, Span};
use std::collections::{BTreeMap, BTreeSet};

/// Index of a variable in [`Program::vars`].
pub(super) type VarId = usize;
/// Index of a function in [`Program::functions`].
pub(super) type FunctionId = usize;

/// Where a variable is declared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Home {
    /// At file level, or `static` in a function: one variable for the whole chart.
    Global,
    /// In a function: one variable for each macro-step of the function.
    Local(FunctionId),
    /// A parameter, latched at entry.
    Param(FunctionId, usize),
    /// The return value of a function.
    Result(FunctionId),
}

/// How a parameter refers to a variable of the caller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Reference {
    /// It does not refer to a variable: it is a copy of the argument.
    None,
    /// `int *p` that is only used as `*p`: copied in and out.
    Scalar,
    /// An array: copied in, and copied out if the function writes it.
    Array,
}

/// A variable of the source.
#[derive(Debug)]
pub(super) struct Var<'s> {
    pub(super) name: Name,
    pub(super) ty: Type,
    pub(super) home: Home,
    pub(super) reference: Reference,
    /// The function that declares a `static` variable.
    pub(super) owner: Option<FunctionId>,
    pub(super) init: Option<&'s Init>,
    pub(super) is_volatile: bool,
    pub(super) is_extern: bool,
    pub(super) is_written: bool,
    /// Whether the variable is in the library, not in the net.
    pub(super) in_library: bool,
    /// Its declaration; `None` for the return value of a function.
    pub(super) declared: Option<(&'s Specifiers, &'s Declarator)>,
}

impl Var<'_> {
    /// The scalar type of the variable or of its elements.
    pub(super) fn scalar(&self) -> Option<Scalar> {
        match self.ty {
            Type::Scalar(scalar) | Type::Array(scalar, ..) | Type::Pointer(scalar) => Some(scalar),
            Type::Void | Type::Opaque => None,
        }
    }

    /// The number of elements of an array in all dimensions.
    pub(super) fn length(&self) -> Option<u32> {
        match &self.ty {
            Type::Array(_, first, rest) => Some(
                rest.iter().fold(first.unwrap_or(1), |product, one| product.saturating_mul(*one)),
            ),
            Type::Void | Type::Scalar(_) | Type::Pointer(_) | Type::Opaque => None,
        }
    }
}

/// A function with a body.
#[derive(Debug)]
pub(super) struct FunctionInfo<'s> {
    pub(super) def: &'s Function,
    pub(super) params: Vec<VarId>,
    /// `None` for a `void` function.
    pub(super) result: Option<VarId>,
    /// Whether the function is kept as C.
    pub(super) is_kept: bool,
    /// The functions of the source that it calls, with the span of each call.
    pub(super) calls: Vec<(FunctionId, Span)>,
}

/// A source with resolved names.
#[derive(Debug)]
pub(super) struct Program<'s> {
    pub(super) file: FileId,
    pub(super) text: &'s str,
    pub(super) source: &'s Source,
    pub(super) options: &'s Options,
    pub(super) widths: Widths,
    pub(super) constants: BTreeMap<String, i64>,
    pub(super) vars: Vec<Var<'s>>,
    /// The variable of each name in an expression, by the offset of the name.
    pub(super) uses: BTreeMap<u32, VarId>,
    /// The variable of each declaration, by the offset of the name.
    pub(super) declared: BTreeMap<u32, VarId>,
    pub(super) functions: Vec<FunctionInfo<'s>>,
    pub(super) by_name: BTreeMap<String, FunctionId>,
    pub(super) entry: FunctionId,
    /// Spans of the opaque units.
    pub(super) opaque: BTreeSet<(u32, u32)>,
}

impl<'s> Program<'s> {
    /// The variable that a name in an expression refers to.
    pub(super) fn var_at(&self, span: Span) -> Option<VarId> {
        self.uses.get(&span.start).copied()
    }

    /// Whether the unit is left to the library.
    pub(super) fn is_opaque(&self, span: Span) -> bool {
        self.opaque.contains(&(span.start, span.end))
    }

    /// The function of the chart that a call runs.
    pub(super) fn callee(&self, name: &str) -> Option<FunctionId> {
        self.by_name.get(name).copied().filter(|id| !self.functions[*id].is_kept)
    }

    /// The source text of a span.
    pub(super) fn text_of(&self, span: Span) -> &'s str {
        self.text.get(span.range()).unwrap_or("")
    }

    /// Whether the expression calls a function of the chart.
    pub(super) fn has_call(&self, expr: &Expr) -> bool {
        let mut found = false;
        expr.each(&mut |inner| {
            found |=
                matches!(&inner.kind, ExprKind::Call(name, _) if self.callee(&name.text).is_some())
        });
        found
    }

    /// Whether evaluating the expression has side effects.
    pub(super) fn has_effect(&self, expr: &Expr) -> bool {
        let mut found = false;
        expr.each(&mut |inner| {
            found |= matches!(
                inner.kind,
                ExprKind::Call(..) | ExprKind::Step { .. } | ExprKind::Assign(..)
            );
        });
        found
    }
}

/// Collects everything that the translation needs; `None` if the source has no function.
pub(super) fn resolve<'s>(
    file: FileId,
    text: &'s str,
    source: &'s Source,
    options: &'s Options,
    findings: &mut Findings,
) -> Option<Program<'s>> {
    let constants =
        source.constants.iter().map(|(name, value)| (name.text.clone(), *value)).gather();
    let widths = Widths {
        int: if options.int_bits == 16 { 16 } else { 32 },
        is_unsigned_char: options.is_unsigned_char,
    };
    let mut resolver = Resolver {
        program: Program {
            file,
            text,
            source,
            options,
            widths,
            constants,
            vars: Vec::new(),
            uses: BTreeMap::new(),
            declared: BTreeMap::new(),
            functions: Vec::new(),
            by_name: BTreeMap::new(),
            entry: 0,
            opaque: BTreeSet::new(),
        },
        scopes: vec![BTreeMap::new()],
        function: None,
        findings,
        prototypes: BTreeSet::new(),
        undeclared: BTreeSet::new(),
        unknown_constants: Vec::new(),
        pointer_uses: BTreeMap::new(),
    };
    resolver.file();
    resolver.report_unknown_constants();
    resolver.entry()?;
    resolver.recursion();
    resolver.references();
    resolver.lengths();
    resolver.report_unknown_constants();
    // Notes about a source with errors would refer to code that is about to be fixed.
    if !any_error(&resolver.findings.kept) {
        resolver.units();
    }
    Some(resolver.program)
}

pub(super) struct Resolver<'s, 'f> {
    pub(super) program: Program<'s>,
    /// Scopes, innermost last; the first one is the file.
    pub(super) scopes: Vec<BTreeMap<String, VarId>>,
    pub(super) function: Option<FunctionId>,
    pub(super) findings: &'f mut Findings,
    /// Functions that are declared without a body.
    pub(super) prototypes: BTreeSet<String>,
    /// Names that are already reported; each is reported once.
    undeclared: BTreeSet<String>,
    /// The undeclared names in capitals, which are constants by convention, with their first uses.
    unknown_constants: Vec<(String, Span)>,
    /// How pointer parameters are used.
    pub(super) pointer_uses: BTreeMap<VarId, PointerUse>,
}

/// Uses of a pointer.
#[derive(Debug, Clone, Default)]
pub(super) struct PointerUse {
    pub(super) is_indexed: bool,
    /// True if the pointer is compared, moved or stored, so that it must remain a real pointer.
    pub(super) is_other: bool,
    /// Calls that pass the pointer on: the function and the index of the argument.
    pub(super) passed: Vec<(FunctionId, usize)>,
}

impl<'s> Resolver<'s, '_> {
    // Names

    fn file(&mut self) {
        let source = self.program.source;
        for item in &source.items {
            match item {
                External::Function(def) => {
                    let id = self.program.functions.len();
                    if let Some(earlier) = self.program.by_name.get(&def.name.text) {
                        let first = self.program.functions[*earlier].def.name.span;
                        self.findings.report(|| {
                            Diagnostic::twice(
                                codes::C_TYPE,
                                format!("the function `{}` is defined twice", def.name),
                                [def.name.span, first],
                                "rename or remove one of them",
                            )
                        });
                        continue;
                    }
                    let is_kept = self.program.options.keep.contains(&def.name.text);
                    self.program.by_name.insert(def.name.text.clone(), id);
                    self.program.functions.push(FunctionInfo {
                        def,
                        params: Vec::new(),
                        result: None,
                        is_kept,
                        calls: Vec::new(),
                    });
                }
                External::Declaration(_) => {}
            }
        }
        for name in &self.program.options.keep {
            if !self.program.by_name.contains_key(name) {
                let near = nearest(name, self.program.by_name.keys().map(String::as_str))
                    .map_or_else(
                        || "give the name of a function with a body in this file".to_owned(),
                        |near| format!("did you mean `{near}`?"),
                    );
                self.findings.report(|| {
                    let finding = Diagnostic::error(
                        codes::C_NO_FUNCTION,
                        format!("unknown function `{name}` in --keep"),
                    )
                    .at(Span::new(self.program.file, 0, 0), "");
                    finding.help(near)
                });
            }
        }
        for item in &source.items {
            match item {
                External::Declaration(declaration) => self.declaration(declaration),
                External::Function(def) => {
                    if let Some(id) = self.program.by_name.get(&def.name.text).copied()
                        && std::ptr::eq(self.program.functions[id].def, def.as_ref())
                    {
                        self.function_body(id, def);
                    }
                }
            }
        }
        self.kept_callees();
    }

    /// Keeps the callees of kept functions too, because the C text of a kept function calls them.
    fn kept_callees(&mut self) {
        let mut open: Vec<FunctionId> = (0..self.program.functions.len())
            .filter(|id| self.program.functions[*id].is_kept)
            .collect();
        while let Some(id) = open.pop() {
            let callees: Vec<FunctionId> =
                self.program.functions[id].calls.iter().map(|(callee, _)| *callee).collect();
            for callee in callees {
                if !self.program.functions[callee].is_kept {
                    self.program.functions[callee].is_kept = true;
                    open.push(callee);
                }
            }
        }
    }

    fn function_body(&mut self, id: FunctionId, def: &'s Function) {
        self.function = Some(id);
        self.scopes.push(BTreeMap::new());
        for (index, param) in def.params.iter().enumerate() {
            let var = self.param(id, index, param);
            self.program.functions[id].params.push(var);
        }
        let result = types::of(
            &def.specifiers,
            &Declarator { is_function: false, ..def.declarator.clone() },
            self.program.widths,
            &self.program.constants,
        );
        let ty = result.unwrap_or(Type::Opaque);
        // `f() { .. }` in K&R style returns an unused `int`, unless it contains `return e`.
        let is_silent =
            def.specifiers.span.start == def.specifiers.span.end && !returns_value(&def.body);
        if ty != Type::Void && !is_silent {
            let name = Name::new("result", def.name.span);
            let ty = if matches!(ty, Type::Pointer(_)) { Type::Opaque } else { ty };
            let var = self.var(Var {
                name,
                ty,
                home: Home::Result(id),
                reference: Reference::None,
                owner: None,
                init: None,
                is_volatile: false,
                is_extern: false,
                is_written: true,
                in_library: false,
                declared: None,
            });
            self.program.functions[id].result = Some(var);
        }
        self.statement(&def.body);
        self.scopes.pop();
        self.function = None;
    }

    fn var(&mut self, var: Var<'s>) -> VarId {
        self.program.vars.push(var);
        self.program.vars.len() - 1
    }

    fn param(&mut self, function: FunctionId, index: usize, param: &'s Param) -> VarId {
        let ty = match types::of(
            &param.specifiers,
            &param.declarator,
            self.program.widths,
            &self.program.constants,
        ) {
            Ok(ty) => ty,
            Err(span) => {
                self.bad_length(span);
                Type::Opaque
            }
        };
        self.declare(
            &param.name,
            ty,
            Home::Param(function, index),
            &param.specifiers,
            &param.declarator,
            None,
        )
    }

    fn bad_length(&mut self, span: Span) {
        self.findings.report(|| {
            Diagnostic::error(
                codes::C_CONSTANT,
                "the array length is not a constant between 1 and 65536",
            )
            .at(span, "")
            .help("write a number, or a name from `#define` or `enum`")
        });
    }

    fn declare(
        &mut self,
        name: &Name,
        ty: Type,
        home: Home,
        specifiers: &'s Specifiers,
        declarator: &'s Declarator,
        init: Option<&'s Init>,
    ) -> VarId {
        let id = self.var(Var {
            name: name.clone(),
            ty,
            home,
            reference: Reference::None,
            owner: self.function,
            init,
            is_volatile: specifiers.is_volatile,
            is_extern: specifiers.is_extern,
            is_written: false,
            in_library: false,
            declared: Some((specifiers, declarator)),
        });
        self.program.declared.insert(name.span.start, id);
        let file_level = self.scopes.len() == 1;
        if let Some(scope) = self.scopes.last_mut()
            && let Some(earlier) = scope.insert(name.text.clone(), id)
        {
            let first = &mut self.program.vars[earlier];
            if file_level && (first.is_extern || specifiers.is_extern) {
                // `extern int n;` and `int n;` are one variable; the definition is used.
                let is_volatile = first.is_volatile || specifiers.is_volatile;
                if specifiers.is_extern && first.init.is_some() | !first.is_extern {
                    scope.insert(name.text.clone(), earlier);
                    self.program.vars[earlier].is_volatile = is_volatile;
                    self.program.vars[id].in_library = false;
                    return earlier;
                }
                self.program.vars[id].is_volatile = is_volatile;
                for used in self.program.uses.values_mut() {
                    if *used == earlier {
                        *used = id;
                    }
                }
            } else if !name.text.is_empty() {
                let first = first.name.span;
                self.findings.report(|| {
                    Diagnostic::twice(
                        codes::C_TYPE,
                        format!("`{name}` is declared twice"),
                        [name.span, first],
                        "rename one of them, or remove it if both mean the same",
                    )
                });
            }
        }
        id
    }

    fn declaration(&mut self, declaration: &'s Declaration) {
        if declaration.specifiers.is_typedef {
            return;
        }
        for (declarator, init) in &declaration.declared {
            if declarator.is_function && !declarator.is_opaque {
                self.prototypes.insert(declarator.name.text.clone());
                continue;
            }
            let ty = types::of(
                &declaration.specifiers,
                declarator,
                self.program.widths,
                &self.program.constants,
            );
            let mut ty = match ty {
                Ok(ty) => ty,
                Err(span) => {
                    self.bad_length(span);
                    Type::Opaque
                }
            };
            if let Type::Array(_, first @ None, _) = &mut ty {
                *first = self.length_of(init.as_ref());
            }
            if matches!(ty, Type::Pointer(_) | Type::Array(_, None, _)) {
                ty = Type::Opaque;
            }
            let home = match self.function {
                Some(function)
                    if !declaration.specifiers.is_static && !declaration.specifiers.is_extern =>
                {
                    Home::Local(function)
                }
                _ => Home::Global,
            };
            // A name is visible in its own initial value.
            self.declare(
                &declarator.name,
                ty,
                home,
                &declaration.specifiers,
                declarator,
                init.as_ref(),
            );
            if let Some(init) = init {
                self.init(init);
            }
        }
    }

    fn length_of(&mut self, init: Option<&Init>) -> Option<u32> {
        match init? {
            Init::List(values, _) => u32::try_from(values.len()).ok().filter(|length| *length > 0),
            Init::One(Expr { kind: ExprKind::Text, span }) => {
                let length = super::lexer::characters(
                    self.program.file,
                    self.program.text,
                    *span,
                    self.findings,
                )
                .len()
                    + 1;
                u32::try_from(length).ok()
            }
            Init::One(_) => None,
        }
    }

    fn init(&mut self, init: &'s Init) {
        match init {
            Init::One(expr) => self.expr(expr),
            Init::List(all, _) => all.iter().for_each(|one| self.init(one)),
        }
    }

    fn statement(&mut self, statement: &'s Stmt) {
        match &statement.kind {
            StmtKind::Expr(expr) | StmtKind::Return(Some(expr)) => self.expr(expr),
            StmtKind::Block(all) => {
                self.scopes.push(BTreeMap::new());
                all.iter().for_each(|one| self.statement(one));
                self.scopes.pop();
            }
            StmtKind::Declaration(declaration) => self.declaration(declaration),
            StmtKind::If(condition, then, otherwise) => {
                self.expr(condition);
                self.statement(then);
                otherwise.iter().for_each(|one| self.statement(one));
            }
            StmtKind::While(condition, body)
            | StmtKind::Do(body, condition)
            | StmtKind::Switch(condition, body) => {
                self.expr(condition);
                self.statement(body);
            }
            StmtKind::For { first, condition, last, body } => {
                self.scopes.push(BTreeMap::new());
                first.iter().for_each(|one| self.statement(one));
                condition.iter().chain(last).for_each(|one| self.expr(one));
                self.statement(body);
                self.scopes.pop();
            }
            // Case labels are constant expressions, so they use no variables.
            StmtKind::Case(_, body) | StmtKind::Default(body) | StmtKind::Label(_, body) => {
                self.statement(body)
            }
            _ => {}
        }
    }

    fn find(&self, name: &str) -> Option<VarId> {
        self.scopes.iter().rev().find_map(|scope| scope.get(name).copied())
    }

    fn expr(&mut self, expr: &'s Expr) {
        sequence::check(expr, self.findings);
        self.names(expr);
    }

    /// Resolves the names of an expression, and records the uses of pointers and the written variables.
    fn names(&mut self, expr: &'s Expr) {
        match &expr.kind {
            ExprKind::Name(name) => {
                if let Some(var) = self.name(name, expr.span) {
                    self.pointer_uses.entry(var).or_default().is_other = true;
                }
            }
            ExprKind::Index(array, index) => {
                self.base(array, true);
                self.names(index);
            }
            ExprKind::Deref(pointer) => {
                if let ExprKind::Binary(super::ast::BinaryOp::Add, a, b) = &pointer.kind {
                    self.base(a, true);
                    self.names(b);
                } else {
                    self.base(pointer, false);
                }
            }
            ExprKind::Call(name, arguments) => {
                let callee = self.program.by_name.get(&name.text).copied();
                if let (Some(callee), Some(function)) = (callee, self.function) {
                    self.program.functions[function].calls.push((callee, expr.span));
                }
                for (index, argument) in arguments.iter().enumerate() {
                    match (&argument.kind, callee) {
                        (ExprKind::Name(text), Some(callee)) => {
                            if let Some(var) = self.name(text, argument.span) {
                                self.pointer_uses
                                    .entry(var)
                                    .or_default()
                                    .passed
                                    .push((callee, index));
                            }
                        }
                        (ExprKind::AddressOf(inner), Some(_)) => {
                            self.written(inner);
                            self.names(inner);
                        }
                        _ => self.names(argument),
                    }
                }
            }
            ExprKind::Assign(_, target, _) => {
                self.written(target);
                expr.operands().into_iter().for_each(|operand| self.names(operand));
            }
            ExprKind::Step { operand, .. } | ExprKind::AddressOf(operand) => {
                self.written(operand);
                self.names(operand);
            }
            _ => expr.operands().into_iter().for_each(|operand| self.names(operand)),
        }
    }

    /// Resolves the array or pointer before brackets or after a star.
    fn base(&mut self, expr: &'s Expr, is_indexed: bool) {
        if let ExprKind::Name(name) = &expr.kind {
            if let Some(var) = self.name(name, expr.span) {
                self.pointer_uses.entry(var).or_default().is_indexed |= is_indexed;
            }
        } else {
            self.names(expr);
        }
    }

    fn written(&mut self, target: &Expr) {
        let mut target = target;
        loop {
            if let ExprKind::Index(inner, _) | ExprKind::Deref(inner) = &target.kind {
                target = inner;
            } else if let ExprKind::Opaque(all) | ExprKind::Comma(all) = &target.kind
                && let Some(first) = all.first()
            {
                target = first;
            } else {
                break;
            }
        }
        if let ExprKind::Name(name) = &target.kind
            && let Some(var) = self.find(name)
        {
            self.program.vars[var].is_written = true;
        }
    }

    fn name(&mut self, name: &str, span: Span) -> Option<VarId> {
        if let Some(var) = self.find(name) {
            self.program.uses.insert(span.start, var);
            return Some(var);
        }
        let is_known = matches!(name, "true" | "false" | "NULL")
            || self.program.constants.contains_key(name)
            || self.program.by_name.contains_key(name)
            || self.prototypes.contains(name)
            || self.program.source.opaque_macros.iter().any(|known| known == name)
            // A header that is not read may declare the name.
            || self.program.source.lines.iter().any(|line| self.program.text_of(*line).contains("include"));
        if !is_known && self.undeclared.insert(name.to_owned()) {
            let names = self
                .scopes
                .iter()
                .flat_map(BTreeMap::keys)
                .chain(self.program.constants.keys())
                .chain(self.program.by_name.keys());
            let near = nearest(name, names.map(String::as_str)).map(str::to_owned);
            // By convention, names in capitals are macros.
            let is_constant = name
                .bytes()
                .all(|byte| byte.is_ascii_uppercase() || byte.is_ascii_digit() || byte == b'_');
            if near.is_none() && is_constant {
                self.unknown_constants.push((name.to_owned(), span));
                return None;
            }
            self.findings.report(|| {
                let finding =
                    Diagnostic::error(codes::C_UNDECLARED, format!("`{name}` is not declared"))
                        .at(span, "first used here");
                finding.near(span, near, format!("declare `{name}` in this file"))
            });
        }
        None
    }

    /// Reports the undeclared names in capitals together, because they usually come from one header.
    fn report_unknown_constants(&mut self) {
        let unknown = std::mem::take(&mut self.unknown_constants);
        // If there are more names than fit on a readable line, each gets its own finding.
        for names in unknown.chunks(if unknown.len() > 8 { 1 } else { 8 }) {
            let shown: Vec<String> = names.iter().map(|(name, _)| format!("`{name}`")).collect();
            let values: Vec<String> = names
                .iter()
                .filter_map(|(name, _)| {
                    let (_, value) = ARDUINO.iter().find(|(known, _)| known == name)?;
                    Some(format!("-D {name}={value}"))
                })
                .collect();
            let first = names.first().map_or("NAME", |(name, _)| name);
            let is_arduino = values.len() == names.len();
            let (are, they) =
                if names.len() == 1 { ("is", "it belongs") } else { ("are", "they belong") };
            let mut message = format!("{} {are} not declared", joined(&shown, "and"));
            if is_arduino {
                message += &format!(": {they} to Arduino.h, which is not read");
            }
            let help = if is_arduino {
                format!(
                    "give the values with {}; the calls of Arduino.h, such as `digitalRead`, then stay C code, so replace each pin by an `extern volatile bool` variable to see it in traces and proofs",
                    values.join(" ")
                )
            } else {
                format!(
                    "declare each with #define or enum, or give its value with -D, as in -D {first}=VALUE"
                )
            };
            self.findings.report(|| {
                let finding = Diagnostic::error(codes::C_UNDECLARED, message);
                let finding = names
                    .iter()
                    .fold(finding, |finding, (_, span)| finding.at(*span, "first used here"));
                finding.help(help)
            });
        }
    }
}

/// Constants of Arduino.h with their values, for the help of a message. The Arduino environment includes that header in every sketch.
const ARDUINO: [(&str, u32); 5] =
    [("LOW", 0), ("HIGH", 1), ("INPUT", 0), ("OUTPUT", 1), ("INPUT_PULLUP", 2)];

/// True if some `return` has a value.
fn returns_value(statement: &Stmt) -> bool {
    match &statement.kind {
        StmtKind::Return(value) => value.is_some(),
        StmtKind::Block(all) => all.iter().any(returns_value),
        StmtKind::If(_, then, otherwise) => {
            returns_value(then) || otherwise.as_deref().is_some_and(returns_value)
        }
        StmtKind::While(_, body)
        | StmtKind::Do(body, _)
        | StmtKind::Switch(_, body)
        | StmtKind::For { body, .. }
        | StmtKind::Case(_, body)
        | StmtKind::Default(body)
        | StmtKind::Label(_, body) => returns_value(body),
        _ => false,
    }
}
