//! Code that the net cannot express: the extern functions of the chart, and the C text that defines them.
//!
//! An opaque statement becomes an extern action, an opaque condition an extern condition. The text is taken from the source. The local
//! variables, parameters and results that it uses become variables of the library file. There is no recursion, so one copy of each is enough.

use super::ast::{Expr, ExprKind, External};
use super::flow::{Externs, Flow, Question};
use super::lexer::{self, Kind};
use super::resolve::{FunctionId, Home, Program, VarId};
use super::types::Type;
use crate::codes;
use crate::findings::Findings;
use grafsynth_ir::chart::{self, Leaf, Path, StmtKind};
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::{Name, Span};
use std::fmt::Write;

/// The name of a variable in the library.
fn library_name(program: &Program<'_>, id: VarId) -> String {
    let var = &program.vars[id];
    let same = |other: &super::resolve::Var<'_>, owner: FunctionId| {
        matches!(other.home, Home::Local(f) | Home::Param(f, _) | Home::Result(f) if f == owner)
            && other.name.text == var.name.text
    };
    let (owner, plain) = match (var.home, var.owner) {
        (Home::Global, None) => return var.name.text.clone(),
        (Home::Global, Some(function))
        | (Home::Local(function) | Home::Param(function, _) | Home::Result(function), _) => {
            (function, &var.name.text)
        }
    };
    let before = program.vars[..id].iter().filter(|other| same(other, owner)).count();
    let number = if before > 0 { format!("_{}", before + 1) } else { String::new() };
    format!("{}_{plain}{number}", program.functions[owner].def.name)
}

/// The text of a part of the source, with the names that its variables have in the library. `replaced` lists the calls of chart functions
/// in it, each with the text that replaces it.
fn rewritten(program: &Program<'_>, span: Span, replaced: &[(Span, String)]) -> String {
    let mut silent = Findings { kept: Vec::new(), limit: 0, rest: 0 };
    let lexed = lexer::lex(
        program.file,
        program.text,
        span.range(),
        program.options.is_unsigned_char,
        &mut silent,
    );
    let mut text = String::new();
    let mut at = span.start;
    for token in lexed.tokens {
        if token.span.start < at || token.kind == Kind::End {
            continue;
        }
        let call = replaced.iter().find(|(call, _)| call.start == token.span.start);
        let (piece, end) = if let Some((call, value)) = call {
            (value.clone(), call.end)
        } else {
            let name = if token.kind == Kind::Word {
                program.uses.get(&token.span.start).map(|var| library_name(program, *var))
            } else {
                None
            };
            (name.unwrap_or_else(|| program.text_of(token.span).to_owned()), token.span.end)
        };
        text.push_str(program.text.get(at as usize..token.span.start as usize).unwrap_or(""));
        text.push_str(&piece);
        at = end;
    }
    text.push_str(program.text.get(at as usize..span.end as usize).unwrap_or(""));
    one_whole_line(&text)
}

/// Removes comments and line breaks, so that the text fits on one line of the library.
fn one_whole_line(text: &str) -> String {
    if text.contains('\n') || text.contains("/*") {
        let mut line = String::new();
        for part in text.lines() {
            if !line.is_empty() {
                line.push(' ');
            }
            // A `//` comment would hide the rest of the line.
            let part = if part.contains('"') || part.contains('\'') {
                part
            } else {
                part.split("//").next().unwrap_or(part)
            };
            line.push_str(part.trim());
        }
        return line;
    }
    text.to_owned()
}

impl<'s> Flow<'_, 's> {
    /// Calls the chart functions in an opaque unit before the unit runs, so that the library receives their values.
    fn calls_before(&mut self, expr: &'s Expr) {
        let mut open = vec![expr];
        let mut calls: Vec<(&'s Expr, FunctionId)> = Vec::new();
        while let Some(one) = open.pop() {
            if let ExprKind::Call(name, _) = &one.kind
                && let Some(callee) = self.program().callee(&name.text)
            {
                calls.push((one, callee));
                continue;
            }
            open.extend(one.operands());
        }
        calls.sort_by_key(|(call, _)| call.span.start);
        for (index, (call, callee)) in calls.iter().enumerate() {
            if calls[..index].iter().any(|(_, other)| other == callee) {
                let span = call.span;
                self.findings.report(|| {
                    Diagnostic::error(
                        codes::C_TYPE,
                        "two calls of one function in an expression that is kept as C",
                    )
                    .at(span, "second call")
                    .help("split the expression into two statements")
                });
                return;
            }
            if let ExprKind::Call(_, arguments) = &call.kind {
                self.call(*callee, arguments, call.span);
                if let Some(result) = self.program().functions[*callee].result {
                    let name = library_name(self.program(), result);
                    self.replaced.push((call.span, name));
                }
            }
        }
    }

    fn action(&mut self, text: String, span: Span) {
        let here = self.here();
        let function = self.program().functions[self.function].def.name.text.clone();
        let hint = self.nodes[here].hint.clone();
        let known = self
            .externs
            .actions
            .iter()
            .find(|(_, known, _)| *known == text)
            .map(|(name, _, _)| name.clone());
        let name = match known {
            Some(name) => name,
            None => {
                let name = self
                    .externs
                    .names
                    .fresh(&format!("{function}_{}", if hint.is_empty() { "do" } else { &hint }));
                self.externs.actions.push((name.clone(), text, span));
                name
            }
        };
        self.emit(StmtKind::Call { function: Name::new(name, span), arguments: Vec::new() }, span);
    }

    /// Translates an opaque expression statement.
    pub(super) fn library_effect(&mut self, expr: &'s Expr) {
        self.calls_before(expr);
        let is_call = matches!(&expr.kind, ExprKind::Call(name, _) if self.program().callee(&name.text).is_some());
        if !is_call {
            let text = format!("{};", rewritten(self.program(), expr.span, &self.replaced));
            self.action(text, expr.span);
        }
    }

    /// Translates `var = expr` for a variable in the library or an opaque expression.
    pub(super) fn library_assign(&mut self, var: VarId, expr: &'s Expr) {
        self.calls_before(expr);
        let name = library_name(self.program(), var);
        let text = format!("{name} = {};", rewritten(self.program(), expr.span, &self.replaced));
        self.action(text, expr.span);
    }

    /// Translates the initial value of an array or structure in the library.
    pub(super) fn library_init(&mut self, var: VarId, list: Span) {
        let program = self.program();
        let name = library_name(program, var);
        let Some(declared) = declared_as(program, var, "initial") else { return };
        let text = format!(
            "{{ const {declared} = {}; memcpy(&{name}, &initial, sizeof initial); }}",
            rewritten(program, list, &[])
        );
        self.action(text, list);
    }

    /// Translates an opaque condition.
    pub(super) fn library_condition(&mut self, expr: &'s Expr) -> chart::Expr {
        self.calls_before(expr);
        let text =
            format!("return ({}) != 0;", rewritten(self.program(), expr.span, &self.replaced));
        self.question(text, None, expr.span)
    }

    /// Translates an opaque selector of a `switch`.
    pub(super) fn library_number(&mut self, expr: &'s Expr) -> chart::Expr {
        self.calls_before(expr);
        let range = self.int_type().range();
        let text = format!("return {};", rewritten(self.program(), expr.span, &self.replaced));
        self.question(text, Some(range), expr.span)
    }

    fn question(&mut self, text: String, range: Option<(i64, i64)>, span: Span) -> chart::Expr {
        let function = self.program().functions[self.function].def.name.text.clone();
        let here = self.here();
        let hint = self.nodes[here].hint.clone();
        let kind = if self.nodes[here].is_test && !hint.is_empty() {
            hint
        } else {
            "condition".to_owned()
        };
        // The text may have side effects, so every use gets a function of its own, even if the texts are the same.
        let name = self.externs.names.fresh(&format!("{function}_{kind}"));
        self.externs.conditions.push(Question { name: name.clone(), text, range, span });
        chart::Expr::leaf(Leaf::Name(Path::from(Name::new(name, span))), span)
    }
}

/// The declaration of a variable under another name, without storage class: `double x[3]` → `double initial[3]`.
fn declared_as(program: &Program<'_>, id: VarId, name: &str) -> Option<String> {
    let var = &program.vars[id];
    let Some((specifiers, declarator)) = var.declared else {
        let Home::Result(function) = var.home else { return None };
        let def = program.functions[function].def;
        let ty = program.text_of(def.specifiers.span);
        let stars = "*".repeat(def.declarator.n_pointers as usize);
        return Some(format!("{} {stars}{name}", if ty.is_empty() { "int" } else { ty }));
    };
    let ty = program.text_of(specifiers.span);
    // The body of a structure is written only once, with the types.
    let ty = ty.find('{').map_or(ty, |at| ty[..at].trim_end());
    let words: Vec<&str> = ty.split_whitespace().filter(|word| *word != "const").collect();
    let ty = if words.is_empty() { "int".to_owned() } else { words.join(" ") };
    let before = program
        .text
        .get(declarator.span.start as usize..declarator.name.span.start as usize)
        .unwrap_or("");
    let after = program
        .text
        .get(declarator.name.span.end as usize..declarator.span.end as usize)
        .unwrap_or("");
    if matches!(var.home, Home::Param(..)) && !declarator.lengths.is_empty() {
        // An array parameter is a pointer to its first row.
        let rest = after.split_once(']').map_or("", |(_, rest)| rest);
        let rest = rewritten_plain(rest);
        return Some(if rest.is_empty() {
            format!("{ty} {before}*{name}")
        } else {
            format!("{ty} {before}(*{name}){rest}")
        });
    }
    let after = match (&var.ty, declarator.lengths.first()) {
        (Type::Array(_, Some(length), _), Some(None)) => {
            after.replacen("[]", &format!("[{length}]"), 1)
        }
        _ => after.to_owned(),
    };
    Some(format!("{ty} {before}{name}{after}"))
}

fn rewritten_plain(text: &str) -> String {
    text.trim().to_owned()
}

/// The text of the library of a chart; `None` if the chart has no extern functions.
pub(super) fn write(
    program: &Program<'_>,
    chart: &str,
    externs: &Externs,
    used: &[FunctionId],
) -> Option<String> {
    if externs.actions.is_empty() && externs.conditions.is_empty() {
        return None;
    }
    let (text, entry) = (String::new(), Vec::new());
    let mut library = Library { program, chart, text, entry };
    library.head();
    library.types();
    library.variables(used);
    library.functions();
    library.line(format_args!(""));
    library.accessors();
    library.externs(externs);
    Some(library.text)
}

/// The text of a library, section by section.
struct Library<'a> {
    program: &'a Program<'a>,
    chart: &'a str,
    text: String,
    /// The variables for which the caller has a function: the parameters and the result of the chart.
    entry: Vec<VarId>,
}

impl Library<'_> {
    fn line(&mut self, words: std::fmt::Arguments<'_>) {
        // Writing to a string cannot fail.
        let _ = self.text.write_fmt(words);
        self.text.push('\n');
    }

    /// The headers, directives and constants of the source.
    fn head(&mut self) {
        let (program, chart) = (self.program, self.chart);
        self.line(format_args!(
            "/* Parts of the functions of chart {chart} that stay C. Local variables are variables of this file, so only one call of a function may run at a time. */"
        ));
        self.line(format_args!("#include \"{chart}_user.h\""));
        self.line(format_args!("#include <string.h>"));
        for (name, value) in &program.source.given {
            self.line(format_args!("#ifndef {name}\n#define {name} ({value})\n#endif"));
        }
        for directive in &program.source.lines {
            self.line(format_args!("{}", program.text_of(*directive)));
        }
        for (name, value) in &program.source.constants {
            // Constants of an `enum` are declared with it.
            let at = name.span.start as usize;
            let is_define =
                program.text.get(..at).is_some_and(|before| before.trim_end().ends_with("define"));
            if is_define {
                self.line(format_args!("#define {name} ({value})"));
            }
        }
        self.line(format_args!(""));
    }

    /// The types and prototypes of the source.
    fn types(&mut self) {
        let program = self.program;
        for item in &program.source.items {
            if item.is_type_or_prototype()
                && let External::Declaration(declaration) = item
            {
                self.line(format_args!("{}", program.text_of(declaration.span)));
            } else if let External::Declaration(declaration) = item
                && program.text_of(declaration.specifiers.span).contains('{')
            {
                self.line(format_args!("{};", program.text_of(declaration.specifiers.span)));
            }
        }
    }

    /// The variables that the functions of the library use.
    fn variables(&mut self, used: &[FunctionId]) {
        let program = self.program;
        for (id, var) in program.vars.iter().enumerate() {
            if !var.in_library {
                continue;
            }
            let of_used = match var.home {
                Home::Global => true,
                Home::Local(function) | Home::Param(function, _) | Home::Result(function) => {
                    used.contains(&function)
                }
            };
            let name = library_name(program, id);
            let Some(declared) =
                declared_as(program, id, &name).filter(|_| of_used && var.ty != Type::Void)
            else {
                continue;
            };
            let storage = if var.is_extern && var.init.is_none() { "extern" } else { "static" };
            let init = match (var.home, var.init) {
                (Home::Global, Some(super::ast::Init::One(expr))) => {
                    format!(" = {}", program.text_of(expr.span))
                }
                (Home::Global, Some(super::ast::Init::List(_, span))) => {
                    format!(" = {}", program.text_of(*span))
                }
                _ => String::new(),
            };
            self.line(format_args!("{storage} {declared}{init};"));
            let (Home::Param(function, _) | Home::Result(function)) = var.home else { continue };
            if function == program.entry {
                self.entry.push(id);
            }
        }
    }

    /// The functions that are kept whole.
    fn functions(&mut self) {
        let program = self.program;
        for info in program.functions.iter().filter(|info| info.is_kept) {
            self.line(format_args!(""));
            let body = program.text_of(info.def.span);
            // A prototype in the source already defines the linkage.
            let has_prototype = program.source.items.iter().any(|item| match item {
                External::Declaration(declaration) => declaration
                    .declared
                    .iter()
                    .any(|(declarator, _)| declarator.name.text == info.def.name.text),
                External::Function(_) => false,
            });
            let is_linked =
                has_prototype || info.def.specifiers.is_static || body.starts_with("static");
            let storage = if is_linked { "" } else { "static " };
            self.line(format_args!("{storage}{body}"));
        }
    }

    /// The functions that set the parameters and get the result of the chart.
    fn accessors(&mut self) {
        let (program, chart) = (self.program, self.chart);
        for id in std::mem::take(&mut self.entry) {
            let name = library_name(program, id);
            let plain = &program.vars[id].name.text;
            if matches!(program.vars[id].home, Home::Param(..)) {
                if let Some(declared) = declared_as(program, id, plain) {
                    self.line(format_args!("/* For the caller, before the chart starts. */"));
                    self.line(format_args!("void {chart}_set_{plain}({declared});"));
                    self.line(format_args!(
                        "void {chart}_set_{plain}({declared}) {{ {name} = {plain}; }}"
                    ));
                }
            } else if let Some(declared) = declared_as(program, id, &format!("{chart}_get_result"))
            {
                self.line(format_args!("/* For the caller, after the chart has ended. */"));
                self.line(format_args!("{declared}(void);"));
                self.line(format_args!("{declared}(void) {{ return {name}; }}"));
            }
        }
    }

    /// The extern conditions and actions of the chart.
    fn externs(&mut self, externs: &Externs) {
        for Question { name, text: body, range, .. } in &externs.conditions {
            let ty = match range {
                None => "bool",
                Some((_, hi)) if *hi > i64::from(i16::MAX) => "int32_t",
                Some(_) => "int16_t",
            };
            self.line(format_args!("{ty} {name}(void) {{ {body} }}"));
        }
        for (name, body, _) in &externs.actions {
            self.line(format_args!("void {name}(void) {{ {body} }}"));
        }
    }
}
