//! What each name stands for, what each parameter is, and what stands in no net.
//!
//! A source is cut into *units*: an expression statement, a condition, an initial value, an argument, a returned value. A unit that the net cannot say
//! (floating point, pointers, structures, calls of functions that are not in the source) is *opaque*: it becomes an extern function of the chart, whose
//! text is the unit's own. Variables that an opaque unit touches must lie in the library, and so a unit that touches such a variable is opaque too: the
//! rule is applied until nothing changes.

use super::Options;
use super::ast::{
    Declaration, Declarator, Expr, ExprKind, External, Function, Init, Param, Source, Specifiers,
    Stmt, StmtKind,
};
use super::sequence;
use super::types::{self, Scalar, Type, Widths};
use crate::codes;
use crate::graf::parser::Findings;
use grafsynth_ir::diag::{Diagnostic, any_error, nearest};
use grafsynth_ir::{FileId, Name, Span};
use std::collections::{BTreeMap, BTreeSet};

/// Number of a variable in [`Program::vars`].
pub(super) type VarId = usize;
/// Number of a function in [`Program::functions`].
pub(super) type FunctionId = usize;

/// Where a variable lives.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Home {
    /// At the level of the file, or `static` in a function: one for the whole chart.
    Global,
    /// In a function: one for each of its macro-steps.
    Local(FunctionId),
    /// A parameter, latched at entry.
    Param(FunctionId, usize),
    /// What a function returns.
    Result(FunctionId),
}

/// How a parameter refers to what the caller has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Reference {
    /// It is a copy.
    None,
    /// `int *p` that is used as `*p` only: copied in and out.
    Scalar,
    /// An array: copied in, and out if the function writes it.
    Array,
}

/// A variable of the source.
#[derive(Debug)]
pub(super) struct Var<'s> {
    pub(super) name: Name,
    pub(super) ty: Type,
    pub(super) home: Home,
    pub(super) reference: Reference,
    /// The function in which a `static` one is declared.
    pub(super) owner: Option<FunctionId>,
    pub(super) init: Option<&'s Init>,
    pub(super) is_volatile: bool,
    pub(super) is_extern: bool,
    pub(super) is_written: bool,
    /// It lies in the library, not in the net.
    pub(super) in_library: bool,
    /// As it was declared; none for what a function returns.
    pub(super) declared: Option<(&'s Specifiers, &'s Declarator)>,
}

impl Var<'_> {
    /// The scalar that it is or is made of.
    pub(super) fn scalar(&self) -> Option<Scalar> {
        match self.ty {
            Type::Scalar(scalar) | Type::Array(scalar, ..) | Type::Pointer(scalar) => Some(scalar),
            Type::Void | Type::Opaque => None,
        }
    }

    /// The number of elements of an array, all dimensions together.
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
    /// None for a `void` function.
    pub(super) result: Option<VarId>,
    /// It stays C.
    pub(super) is_kept: bool,
    /// Functions of the source that it calls, with the place of each call.
    pub(super) calls: Vec<(FunctionId, Span)>,
}

/// A source whose names are known.
#[derive(Debug)]
pub(super) struct Program<'s> {
    pub(super) file: FileId,
    pub(super) text: &'s str,
    pub(super) source: &'s Source,
    pub(super) options: &'s Options,
    pub(super) widths: Widths,
    pub(super) constants: BTreeMap<String, i64>,
    pub(super) vars: Vec<Var<'s>>,
    /// First byte of a name in an expression → its variable.
    pub(super) uses: BTreeMap<u32, VarId>,
    /// First byte of the name in a declaration → its variable.
    pub(super) declared: BTreeMap<u32, VarId>,
    pub(super) functions: Vec<FunctionInfo<'s>>,
    pub(super) by_name: BTreeMap<String, FunctionId>,
    pub(super) entry: FunctionId,
    /// Places of the units that are opaque.
    opaque: BTreeSet<(u32, u32)>,
}

impl<'s> Program<'s> {
    /// The variable that a name in an expression stands for.
    pub(super) fn var_at(&self, span: Span) -> Option<VarId> {
        self.uses.get(&span.start).copied()
    }

    /// True for a unit that the library does.
    pub(super) fn is_opaque(&self, span: Span) -> bool {
        self.opaque.contains(&(span.start, span.end))
    }

    /// The function of the chart that a call runs.
    pub(super) fn callee(&self, name: &str) -> Option<FunctionId> {
        self.by_name.get(name).copied().filter(|id| !self.functions[*id].is_kept)
    }

    /// The text of a place.
    pub(super) fn text_of(&self, span: Span) -> &'s str {
        self.text.get(span.range()).unwrap_or("")
    }

    /// True if the expression calls a function of the chart.
    pub(super) fn has_call(&self, expr: &Expr) -> bool {
        let mut found = false;
        expr.each(&mut |inner| {
            found |=
                matches!(&inner.kind, ExprKind::Call(name, _) if self.callee(&name.text).is_some())
        });
        found
    }

    /// True if evaluating the expression changes something.
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

/// A piece of the source that is said by the net as a whole, or not at all.
struct Unit<'s> {
    span: Span,
    exprs: Vec<&'s Expr>,
    touched: BTreeSet<VarId>,
    /// Why the net cannot say it.
    reason: Option<(Span, String)>,
}

/// Finds out everything that the drawing needs to know; none if the source has no function.
pub(super) fn resolve<'s>(
    file: FileId,
    text: &'s str,
    source: &'s Source,
    options: &'s Options,
    findings: &mut Findings,
) -> Option<Program<'s>> {
    let constants =
        source.constants.iter().map(|(name, value)| (name.text.clone(), *value)).collect();
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
        pointer_uses: BTreeMap::new(),
    };
    resolver.file();
    resolver.entry()?;
    resolver.recursion();
    resolver.references();
    resolver.lengths();
    // Notes about a source with errors would speak of what is mended next.
    if !any_error(&resolver.findings.kept) {
        resolver.units();
    }
    Some(resolver.program)
}

struct Resolver<'s, 'f> {
    program: Program<'s>,
    /// Innermost last; the first one is the file.
    scopes: Vec<BTreeMap<String, VarId>>,
    function: Option<FunctionId>,
    findings: &'f mut Findings,
    /// Functions that are declared without a body.
    prototypes: BTreeSet<String>,
    /// How parameters that are pointers are used.
    pointer_uses: BTreeMap<VarId, PointerUse>,
}

/// Uses of a pointer.
#[derive(Debug, Clone, Default)]
struct PointerUse {
    is_indexed: bool,
    /// Compared, moved, stored: a pointer indeed.
    is_other: bool,
    /// Handed on as this argument of that function.
    passed: Vec<(FunctionId, usize)>,
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
                            Diagnostic::error(
                                codes::C_TYPE,
                                format!("the function {} is defined twice", def.name),
                            )
                            .at(def.name.span, "again here")
                            .at(first, "first here")
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
                    .map(|near| format!("did you mean {near}?"));
                self.findings.report(|| {
                    let finding = Diagnostic::error(
                        codes::C_NO_FUNCTION,
                        format!("there is no function {name} to keep"),
                    )
                    .at(Span::new(self.program.file, 0, 0), "");
                    near.into_iter().fold(finding, Diagnostic::help)
                });
            }
        }
        for item in &source.items {
            match item {
                External::Declaration(declaration) => self.declaration(declaration),
                External::Function(def) => {
                    if let Some(id) = self.program.by_name.get(&def.name.text).copied()
                        && std::ptr::eq(self.program.functions[id].def, def)
                    {
                        self.function_body(id, def);
                    }
                }
            }
        }
        self.kept_callees();
    }

    /// What a kept function calls is kept too: its text needs it.
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
        // `f() { .. }` of K&R returns an `int` that nobody looks at unless it says `return e`.
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
                "the length of an array is no constant between 1 and 65536",
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
                // `extern int n;` and `int n;` are one variable: the definition counts.
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
                    Diagnostic::error(codes::C_TYPE, format!("{name} is declared twice"))
                        .at(name.span, "again here")
                        .at(first, "first here")
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
            // The name is known in its own initial value.
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
            StmtKind::Null
            | StmtKind::Goto(_)
            | StmtKind::Break
            | StmtKind::Continue
            | StmtKind::Return(None) => {}
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
            // Case labels are constants; their names are looked up there.
            StmtKind::Case(_, body) | StmtKind::Default(body) | StmtKind::Label(_, body) => {
                self.statement(body)
            }
        }
    }

    fn find(&self, name: &str) -> Option<VarId> {
        self.scopes.iter().rev().find_map(|scope| scope.get(name).copied())
    }

    fn expr(&mut self, expr: &'s Expr) {
        sequence::check(expr, self.findings);
        self.names(expr);
    }

    /// Looks up the names of an expression, and notes how pointers are used and what is written.
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
            ExprKind::Deref(pointer) => match &pointer.kind {
                ExprKind::Binary(super::ast::BinaryOp::Add, a, b) => {
                    self.base(a, true);
                    self.names(b);
                }
                _ => self.base(pointer, false),
            },
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
            ExprKind::Number { .. }
            | ExprKind::Char(_)
            | ExprKind::Float
            | ExprKind::Text
            | ExprKind::SizeofType(_) => {}
            ExprKind::Opaque(_)
            | ExprKind::Unary(..)
            | ExprKind::Cast(..)
            | ExprKind::Sizeof(_)
            | ExprKind::Binary(..)
            | ExprKind::Junction(..)
            | ExprKind::Conditional(..)
            | ExprKind::Comma(_) => {
                expr.operands().into_iter().for_each(|operand| self.names(operand))
            }
        }
    }

    /// The array or pointer that brackets or a star stand on.
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
            match &target.kind {
                ExprKind::Name(name) => {
                    if let Some(var) = self.find(name) {
                        self.program.vars[var].is_written = true;
                    }
                    return;
                }
                ExprKind::Index(inner, _) | ExprKind::Deref(inner) => target = inner,
                ExprKind::Opaque(all) | ExprKind::Comma(all) => match all.first() {
                    Some(first) => target = first,
                    None => return,
                },
                _ => return,
            }
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
            // A header that we do not read may declare it.
            || self.program.source.lines.iter().any(|line| self.program.text_of(*line).contains("include"));
        if !is_known {
            let names = self
                .scopes
                .iter()
                .flat_map(BTreeMap::keys)
                .chain(self.program.constants.keys())
                .chain(self.program.by_name.keys());
            let near = nearest(name, names.map(String::as_str)).map(str::to_owned);
            self.findings.report(|| {
                let finding =
                    Diagnostic::error(codes::C_UNDECLARED, format!("{name} is not declared"))
                        .at(span, "not known here");
                match near {
                    Some(near) => finding.help(format!("did you mean {near}?")).fix(span, near),
                    None => finding,
                }
            });
        }
        None
    }

    // Functions

    fn entry(&mut self) -> Option<()> {
        let program = &mut self.program;
        if let Some(wanted) = &program.options.entry {
            if let Some(id) = program.by_name.get(wanted) {
                program.entry = *id;
                return Some(());
            }
            let near = nearest(wanted, program.by_name.keys().map(String::as_str))
                .map(|near| format!("did you mean {near}?"));
            self.findings.report(|| {
                let finding = Diagnostic::error(
                    codes::C_NO_FUNCTION,
                    format!("there is no function {wanted}"),
                )
                .at(Span::new(program.file, 0, 0), "");
                near.into_iter().fold(finding, Diagnostic::help)
            });
            return None;
        }
        let called: BTreeSet<FunctionId> = program
            .functions
            .iter()
            .flat_map(|one| one.calls.iter().map(|(callee, _)| *callee))
            .collect();
        let roots: Vec<FunctionId> = (0..program.functions.len())
            .filter(|id| !called.contains(id) && !program.functions[*id].is_kept)
            .collect();
        program.entry = match program.by_name.get("main") {
            Some(main) => *main,
            None => roots.last().copied().or_else(|| {
                (0..program.functions.len()).find(|id| !program.functions[*id].is_kept)
            })?,
        };
        let others: Vec<&str> = roots
            .iter()
            .filter(|id| **id != program.entry)
            .map(|id| program.functions[*id].def.name.text.as_str())
            .collect();
        if !others.is_empty() {
            let entry = &program.functions[program.entry].def.name;
            let others = others.join(", ");
            self.findings.report(|| {
                Diagnostic::note(
                    codes::C_ENTRY,
                    format!("the chart is that of {entry}; nothing calls {others}"),
                )
                .at(entry.span, "the chart runs this function")
                .help("choose another one with --entry NAME")
            });
        }
        Some(())
    }

    /// Refuses a function that calls itself, also through others: each function is a macro-step, and a macro-step cannot contain itself.
    fn recursion(&mut self) {
        // Colours of a depth-first search with its own stack: 0 new, 1 open, 2 done.
        let mut colour = vec![0_u8; self.program.functions.len()];
        let mut stack = vec![(self.program.entry, 0_usize)];
        colour[self.program.entry] = 1;
        let mut reported = BTreeSet::new();
        while let Some((id, next)) = stack.last().copied() {
            let Some((callee, span)) = self.program.functions[id].calls.get(next).copied() else {
                colour[id] = 2;
                stack.pop();
                continue;
            };
            if let Some(top) = stack.last_mut() {
                top.1 += 1;
            }
            if self.program.functions[callee].is_kept {
                continue;
            }
            match colour[callee] {
                0 => {
                    colour[callee] = 1;
                    stack.push((callee, 0));
                }
                1 if reported.insert(callee) => {
                    let from = stack.iter().position(|(open, _)| *open == callee).unwrap_or(0);
                    let mut names: Vec<&str> = stack[from..]
                        .iter()
                        .map(|(open, _)| self.program.functions[*open].def.name.text.as_str())
                        .collect();
                    let name = self.program.functions[callee].def.name.clone();
                    names.push(&name.text);
                    let way = names.join(" calls ");
                    self.findings.report(|| {
                        Diagnostic::error(codes::C_RECURSION, format!("{name} is recursive: {way}"))
                            .at(span, "the call that closes the circle")
                            .at(name.span, "the function")
                            .help(format!(
                                "write it with a loop, or leave it in C with --keep {name}"
                            ))
                    });
                }
                _ => {}
            }
        }
    }

    /// What parameters that are pointers refer to.
    fn references(&mut self) {
        // Handed on, a pointer is what the other function makes of it: until nothing changes.
        loop {
            let mut changed = false;
            let uses: Vec<(VarId, PointerUse)> =
                self.pointer_uses.iter().map(|(var, one)| (*var, one.clone())).collect();
            for (var, one) in uses {
                let (mut is_indexed, mut is_other, mut is_written) =
                    (one.is_indexed, one.is_other, false);
                for (callee, index) in &one.passed {
                    let Some(param) = self.program.functions[*callee].params.get(*index).copied()
                    else {
                        continue;
                    };
                    is_other |= self.program.functions[*callee].is_kept;
                    if let Some(theirs) = self.pointer_uses.get(&param) {
                        is_indexed |= theirs.is_indexed;
                        is_other |= theirs.is_other
                            && !matches!(self.program.vars[param].ty, Type::Scalar(_));
                    }
                    let is_array =
                        matches!(self.program.vars[param].ty, Type::Array(..) | Type::Pointer(_));
                    is_written |= is_array && self.program.vars[param].is_written;
                }
                if let Some(mine) = self.pointer_uses.get_mut(&var)
                    && (mine.is_indexed, mine.is_other) != (is_indexed, is_other)
                {
                    (mine.is_indexed, mine.is_other) = (is_indexed, is_other);
                    changed = true;
                }
                if is_written && !self.program.vars[var].is_written {
                    self.program.vars[var].is_written = true;
                    changed = true;
                }
            }
            if !changed {
                break;
            }
        }
        for id in 0..self.program.vars.len() {
            let uses = self.pointer_uses.get(&id).cloned().unwrap_or_default();
            let var = &mut self.program.vars[id];
            let is_param = matches!(var.home, Home::Param(..));
            match (&var.ty, is_param) {
                (Type::Pointer(_) | Type::Array(..), true) if uses.is_other => {
                    var.ty = Type::Opaque
                }
                (Type::Pointer(scalar), true) if uses.is_indexed => {
                    var.ty = Type::Array(*scalar, None, Vec::new());
                    var.reference = Reference::Array;
                }
                (Type::Pointer(scalar), true) => {
                    var.ty = Type::Scalar(*scalar);
                    var.reference = Reference::Scalar;
                }
                (Type::Array(..), true) => var.reference = Reference::Array,
                (
                    Type::Pointer(_)
                    | Type::Array(..)
                    | Type::Void
                    | Type::Scalar(_)
                    | Type::Opaque,
                    _,
                ) => {}
            }
        }
    }

    /// Lengths of array parameters: as written, as the longest argument, or as the option says.
    fn lengths(&mut self) {
        let default = self.program.options.array_length.max(1);
        let entry = self.program.entry;
        for var in self.program.functions[entry].params.clone() {
            let var = &mut self.program.vars[var];
            if let Type::Array(_, first @ None, _) = &mut var.ty {
                *first = Some(default);
                let name = var.name.clone();
                self.findings.report(|| {
                    Diagnostic::note(
                        codes::C_ARRAY_LENGTH,
                        format!("{name} gets {default} elements"),
                    )
                    .at(name.span, "its length is not written")
                    .help("write it between the brackets, or choose another with --array-length N")
                });
            }
        }
        // Callers come before those they call: without recursion as many rounds as there are functions are enough.
        for _ in 0..self.program.functions.len() {
            let mut changed = false;
            for (param, length) in self.argument_lengths() {
                if let Type::Array(_, first, _) = &mut self.program.vars[param].ty
                    && first.is_none_or(|known| known < length)
                {
                    *first = Some(length);
                    changed = true;
                }
            }
            if !changed {
                break;
            }
        }
        for var in &mut self.program.vars {
            if let Type::Array(_, first @ None, _) = &mut var.ty {
                *first = Some(default);
            }
        }
    }

    /// For each array that is handed on: the parameter and the number of rows.
    fn argument_lengths(&self) -> Vec<(VarId, u32)> {
        let mut found = Vec::new();
        for (var, uses) in &self.pointer_uses {
            if let Type::Array(_, Some(length), _) = &self.program.vars[*var].ty {
                let of_callees = uses.passed.iter().filter_map(|(callee, index)| {
                    self.program.functions[*callee].params.get(*index)
                });
                found.extend(of_callees.map(|param| (*param, *length)));
            }
        }
        found
    }

    // Units

    fn units(&mut self) {
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
        // A kept function reads and writes globals by their names.
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
                    Diagnostic::note(codes::C_OPAQUE, format!("left to the C library: {reason}"))
                        .at(*span, "no engine but C runs this")
                        .help("the chart is for the CPU; what this touches is in no trace and in no proof")
                });
            }
            for expr in &unit.exprs {
                self.conditional_call(expr);
            }
        }
    }

    /// A call of the chart inside `&&`, `||` or `?:` of an opaque unit has no place in the chart: it may or may not happen.
    fn conditional_call(&mut self, expr: &'s Expr) {
        let mut inner: Option<Span> = None;
        let program = &self.program;
        expr.each(&mut |one| {
            let later: &[Expr] = match &one.kind {
                ExprKind::Junction(_, all) => &all[1..],
                ExprKind::Conditional(_, a, b) => {
                    for branch in [a, b] {
                        if program.has_call(branch) {
                            inner.get_or_insert(branch.span);
                        }
                    }
                    &[]
                }
                _ => &[],
            };
            for branch in later {
                if program.has_call(branch) {
                    inner.get_or_insert(branch.span);
                }
            }
        });
        if let Some(span) = inner {
            self.findings.report(|| {
                Diagnostic::error(codes::C_TYPE, "a call that may not happen stands in an expression that is left to the library")
                    .at(span, "")
                    .help("write the condition as an `if`, or leave the function in C with --keep")
            });
        }
    }
}

/// True if some `return` carries a value.
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
        StmtKind::Null
        | StmtKind::Expr(_)
        | StmtKind::Declaration(_)
        | StmtKind::Goto(_)
        | StmtKind::Break
        | StmtKind::Continue => false,
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
            StmtKind::Null
            | StmtKind::Goto(_)
            | StmtKind::Break
            | StmtKind::Continue
            | StmtKind::Return(None) => {}
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
                        touched: BTreeSet::from([var]),
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
            touched: also.into_iter().collect(),
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
                if super::value::size_of(program, expr).is_none()
                    && !matches!(expr.kind, ExprKind::Char(_))
                {
                    Self::refuse(unit, span, || {
                        "the size of a type that the net does not have".to_owned()
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
                            format!("{name} is used as a whole, or its type is none of the net")
                        });
                    }
                }
                None => {
                    if !program.constants.contains_key(name)
                        && !matches!(name.as_str(), "true" | "false" | "NULL")
                    {
                        Self::refuse(unit, span, || {
                            format!("{name} means something only to a C compiler")
                        });
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
                    || ty.specifiers.base == super::ast::Base::Void;
                if !is_plain || !is_known {
                    Self::refuse(unit, span, || {
                        "a cast to a type that the net does not have".to_owned()
                    });
                }
                self.look(inner, unit);
            }
            ExprKind::Step { .. }
            | ExprKind::Unary(..)
            | ExprKind::Binary(..)
            | ExprKind::Junction(..)
            | ExprKind::Conditional(..)
            | ExprKind::Assign(..)
            | ExprKind::Comma(_) => {
                expr.operands().into_iter().for_each(|operand| self.look(operand, unit))
            }
        }
    }

    /// `a[i]`, `a[i][j]`, `*p`, `*(p + i)`.
    fn element(&mut self, expr: &'s Expr, unit: &mut Unit<'s>) {
        let Some((base, indices)) = super::value::element(expr) else {
            Self::refuse(unit, expr.span, || "an element of something that is no array".to_owned());
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
                "an element of something that is no array of the net".to_owned()
            });
        }
        indices.into_iter().for_each(|index| self.look(index, unit));
    }

    fn call(&mut self, expr: &'s Expr, name: &'s Name, arguments: &'s [Expr], unit: &mut Unit<'s>) {
        let program = self.program;
        let Some(callee) = program.callee(&name.text) else {
            let what = if program.by_name.contains_key(&name.text) {
                "which is kept"
            } else {
                "which has no body here"
            };
            Self::refuse(unit, expr.span, || format!("a call of {name}, {what}"));
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
                    let touched = param.into_iter().chain(program.var_at(argument.span)).collect();
                    let mut own =
                        Unit { span: argument.span, exprs: vec![argument], touched, reason: None };
                    let matches = program
                        .var_at(argument.span)
                        .is_some_and(|var| argument_fits(program, param, var));
                    if !matches {
                        Self::refuse(&mut own, argument.span, || {
                            "a pointer that is no array of the net".to_owned()
                        });
                    }
                    self.units.push(own);
                }
                (ExprKind::AddressOf(inner), Reference::Scalar) => self.unit(inner, param),
                (_, Reference::Array | Reference::Scalar) => {
                    let mut own = Unit {
                        span: argument.span,
                        exprs: vec![argument],
                        touched: param.into_iter().collect(),
                        reason: None,
                    };
                    self.look(argument, &mut own);
                    Self::refuse(&mut own, argument.span, || {
                        "a pointer that is no array of the net".to_owned()
                    });
                    self.units.push(own);
                }
                (_, Reference::None) => self.unit(argument, param),
            }
        }
    }

    /// Arguments of a library function may be arrays and addresses: they touch what they name.
    fn library_argument(&mut self, argument: &'s Expr, unit: &mut Unit<'s>) {
        self.look(argument, unit);
    }
}

/// True if an array or pointer of the net can be handed to the parameter.
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
