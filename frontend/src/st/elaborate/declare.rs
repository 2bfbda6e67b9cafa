//! Variables and instances: how each declaration of a unit becomes part of the chart.

use grafsynth_ir::Name;
use grafsynth_ir::chart::{Action, Declaration, DeclarationKind, Item};
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::expr::Type;
use grafsynth_ir::net::Meta;

use super::context::{Binding, Elaborator, FrameId, Object, ObjectKind, Place};
use super::types::Ty;
use super::usage::{Usage, upper};
use super::value::Value;
use crate::codes;
use crate::st::ast::{self, Body, Section, Var};

/// The comment of a declaration, after its address.
fn label_of(var: &Var) -> String {
    match &var.address {
        Some(address) => {
            format!("{} {}", address.text.to_ascii_uppercase(), var.label).trim_end().to_owned()
        }
        None => var.label.clone(),
    }
}

impl<'a> Elaborator<'a> {
    /// Declares a variable of a chart (`is_top`) or of the instance with this frame.
    pub(super) fn declare(&mut self, frame: FrameId, var: &'a Var, usage: &Usage, is_top: bool) {
        let key = upper(&var.name.text);
        if var.section == Section::External {
            if self.lookup(self.globals, &key).is_some() {
                return;
            }
            self.report(
                Diagnostic::warning(
                    codes::ST_LEFT_OUT,
                    format!("the text declares no global variable `{}`", var.name),
                )
                .at(var.name.span, "external")
                .help("it becomes an input; add it to a VAR_GLOBAL block to give it a value"),
            );
        }
        let ty = self.ty(frame, &var.ty);
        let name = var.name.clone();
        let binding = match &ty {
            Ty::Broken => Some(Binding::Broken),
            Ty::Time => Some(self.declare_time(frame, var, &name, usage, is_top)),
            Ty::Block(_) | Ty::User(_) | Ty::Struct(_) => {
                let init = self.fields_of(var);
                let object = self.instance(frame, &ty, &name, usage, &key, &init, 0);
                Some(object.map_or(Binding::Broken, Binding::Object))
            }
            Ty::Bool | Ty::Int { .. } if var.is_constant && var.section != Section::External => {
                Some(self.declare_constant(frame, var, &ty))
            }
            Ty::Bool | Ty::Int { .. } | Ty::Array(..) if is_top => {
                self.declare_top(frame, var, &ty, usage);
                None
            }
            Ty::Bool | Ty::Int { .. } | Ty::Array(..) => None,
        };
        if let Some(binding) = binding {
            self.frames[frame].names.insert(key, binding);
        }
    }

    /// The initial value of a variable: its own or that of its type.
    pub(super) fn init_of(&self, var: &Var) -> Option<ast::Init> {
        if var.init.is_some() {
            return var.init.clone();
        }
        match &var.ty.kind {
            ast::TypeKind::Named(name) => self.types.get(&upper(name))?.init.clone(),
            ast::TypeKind::Subrange(..)
            | ast::TypeKind::Array(..)
            | ast::TypeKind::Enum(_)
            | ast::TypeKind::Struct(_)
            | ast::TypeKind::Refused(_) => None,
        }
    }

    pub(super) fn fields_of(&self, var: &Var) -> Vec<(Name, ast::Init)> {
        match self.init_of(var) {
            Some(ast::Init::Fields(fields, _)) => fields,
            Some(ast::Init::Value(_) | ast::Init::List(..)) | None => Vec::new(),
        }
    }

    pub(super) fn declare_constant(&mut self, frame: FrameId, var: &Var, ty: &Ty) -> Binding {
        let Some(init) = &self.init_of(var) else {
            self.report(
                Diagnostic::error(
                    codes::ST_CONSTANT,
                    format!("the constant `{}` has no value", var.name),
                )
                .at(var.name.span, "")
                .help("write one, as in `n : INT := 5;`"),
            );
            return Binding::Broken;
        };
        match self.initial(frame, ty, init).map(|mut values| values.pop()) {
            Ok(Some(expr)) => Binding::Value(Value::literal(expr)),
            Ok(None) | Err(_) => Binding::Broken,
        }
    }

    /// Declares a variable of the chart itself. Its section, its address and its uses in the unit decide its kind.
    pub(super) fn declare_top(&mut self, frame: FrameId, var: &'a Var, ty: &Ty, usage: &Usage) {
        let key = upper(&var.name.text);
        let is_assigned = usage.assigned.contains(&key);
        let is_action = usage.actions.contains(&key);
        let address = var.address.as_ref().map(|address| address.text.to_ascii_uppercase());
        let area = address.as_deref().and_then(|address| address.chars().nth(1));
        let meta = Meta { span: var.name.span, label: label_of(var), ..Meta::default() };
        // A chart omits the sign before an address.
        let name = Name::new(var.name.text.trim_start_matches('%'), var.name.span);
        let values = match &self.init_of(var) {
            Some(init) => self.initial(frame, ty, init).unwrap_or_default(),
            None => Vec::new(),
        };
        let is_input = !is_assigned
            && !is_action
            && match var.section {
                Section::Input | Section::InOut | Section::External => true,
                Section::Local | Section::Global => area == Some('I'),
                Section::Output | Section::Temp => false,
            };
        if var.section == Section::Input && (is_assigned || is_action) {
            self.assigned_input(var);
            self.frames[frame].names.insert(key, Binding::Broken);
            return;
        }
        let is_output = var.section == Section::Output
            || (matches!(var.section, Section::Local | Section::Global) && area == Some('Q'));
        let place = Place { name: name.clone(), chart: self.chart, index: None, ty: ty.clone() };
        if let (true, Some(simple)) = (is_input, ty.simple()) {
            self.inputs.insert(upper(&name.text));
            let kind = DeclarationKind::Input { ty: simple, synchronous: false };
            self.items.push(Item::Declaration(Declaration { name, kind, meta }));
            self.frames[frame].names.insert(key, Binding::Place(place));
            return;
        }
        if is_input && !is_output {
            self.refused("arrays as inputs", var.name.span, "declare one input for each element");
            self.frames[frame].names.insert(key, Binding::Broken);
            return;
        }
        // Other charts cannot name an action, so a global that is an action becomes a variable that actions write.
        let is_flag = is_action
            && !is_assigned
            && *ty == Ty::Bool
            && (var.section != Section::Global || self.chart_names.len() == 1);
        if let (true, Some(simple)) = (is_output, ty.simple()) {
            if !is_assigned && !is_action && usage.read.contains(&key) {
                // No statement assigns the variable, so it keeps its initial value.
                let zero = || match simple {
                    Type::Bool => Value::constant(false, var.name.span),
                    Type::Int { .. } => Value::int(simple.saturate(0), var.name.span),
                };
                let value = values.first().cloned().map_or_else(zero, Value::literal);
                self.frames[frame].names.insert(key.clone(), Binding::Value(value));
            } else {
                self.frames[frame].names.insert(key.clone(), Binding::Place(place));
            }
            if is_flag {
                self.flags.insert(key, name.text.clone());
            }
            let init = if is_flag { None } else { values.into_iter().next() };
            let kind = DeclarationKind::Output {
                ty: simple,
                init,
                registered: false,
                mealy: false,
                safe: None,
            };
            self.items.push(Item::Declaration(Declaration { name, kind, meta }));
            return;
        }
        if is_flag {
            self.flags.insert(key.clone(), name.text.clone());
            self.frames[frame].names.insert(key, Binding::Place(place));
            self.items.push(Item::Action(Action { name, body: Vec::new(), meta }));
            return;
        }
        self.declare_var(frame, &key, name, ty, values, meta);
    }

    pub(super) fn assigned_input(&mut self, var: &Var) {
        self.report(
            Diagnostic::error(
                codes::ST_TYPE,
                format!("`{}` is an input, but the program assigns it", var.name),
            )
            .at(var.name.span, "declared here")
            .help("assign to a separate variable"),
        );
    }

    /// Declares an instance of a function block or structure, with all its variables.
    #[expect(clippy::too_many_arguments, reason = "the context of an instance")]
    pub(super) fn instance(
        &mut self,
        outer: FrameId,
        ty: &Ty,
        name: &Name,
        usage: &Usage,
        key: &str,
        init: &[(Name, ast::Init)],
        depth: usize,
    ) -> Option<usize> {
        if depth > 16 || self.spend(name.span, 8).is_err() {
            self.report(
                Diagnostic::error(
                    codes::ST_SIZE,
                    format!("`{name}` contains too many nested function blocks"),
                )
                .at(name.span, "")
                .help("declare fewer instances inside each other: at most 16 levels"),
            );
            return None;
        }
        let frame = self.new_frame(Some(self.globals));
        let kind = match ty {
            Ty::Block(block) => ObjectKind::Standard(*block),
            Ty::User(pou) => ObjectKind::User(*pou),
            Ty::Struct(_) => ObjectKind::Struct,
            Ty::Bool | Ty::Int { .. } | Ty::Time | Ty::Array(..) | Ty::Broken => return None,
        };
        let object = self.objects.len();
        self.objects.push(Object {
            kind,
            frame,
            prefix: name.text.clone(),
            preset: None,
            n_calls: 0,
        });
        // An input needs memory if a call omits it, or if it is read or assigned outside of calls.
        let omitted = |input: &str| {
            usage.fields.contains(&(key.to_owned(), input.to_owned()))
                || usage.calls.get(key).is_some_and(|calls| {
                    calls
                        .iter()
                        .any(|names| names.as_ref().is_some_and(|names| !names.contains(input)))
                })
        };
        match ty {
            Ty::Block(block) => {
                // An input may have a second name.
                let is_omitted = |input: &str| {
                    let first = block.canonical(input);
                    let all: Vec<&str> =
                        ["R", "RESET", "LD", "LOAD", "S1", "SET1", "S", "SET", "R1", "RESET1"]
                            .into_iter()
                            .filter(|name| block.canonical(name) == first)
                            .chain([input])
                            .collect();
                    all.iter().all(|name| omitted(name))
                        || all.iter().any(|name| {
                            usage.fields.contains(&(key.to_owned(), (*name).to_owned()))
                        })
                };
                self.declare_block(object, *block, name, &is_omitted, init, outer);
            }
            Ty::User(pou) => {
                let library = self.library;
                let pou = &library.pous[*pou];
                let is_called = self.may_call_charts && depth == 0 && outer != self.globals;
                if matches!(pou.body, Body::Sfc(_)) && !is_called {
                    // Its call is refused; uses of its variables are not reported again.
                    for var in &pou.vars {
                        self.frames[frame].names.insert(upper(&var.name.text), Binding::Broken);
                    }
                    return Some(object);
                }
                for refusal in &pou.refused {
                    self.refused(&refusal.what, refusal.span, &refusal.help);
                }
                let inner = self.usage(pou);
                for var in &pou.vars {
                    self.member(frame, var, name, &inner, &omitted, init, outer, depth);
                }
            }
            Ty::Struct(fields) => {
                for field in fields.clone() {
                    let ty = self.ty(outer, &field.ty);
                    let field_key = upper(&field.name.text);
                    let full = Name::new(format!("{name}.{}", field.name), field.name.span);
                    let given = init
                        .iter()
                        .find(|(one, _)| upper(&one.text) == field_key)
                        .map(|(_, init)| init.clone());
                    let given = given.or_else(|| field.init.clone());
                    match &ty {
                        Ty::Bool | Ty::Int { .. } | Ty::Array(..) => {
                            let values = match &given {
                                Some(init) => self.initial(outer, &ty, init).unwrap_or_default(),
                                None => Vec::new(),
                            };
                            self.declare_var(frame, &field_key, full, &ty, values, Meta::default());
                        }
                        Ty::Block(_) | Ty::User(_) | Ty::Struct(_) => {
                            let inner = self.instance(
                                outer,
                                &ty,
                                &full,
                                &Usage::default(),
                                &field_key,
                                &[],
                                depth + 1,
                            );
                            let binding = inner.map_or(Binding::Broken, Binding::Object);
                            self.frames[frame].names.insert(field_key, binding);
                        }
                        Ty::Time | Ty::Broken => {
                            self.frames[frame].names.insert(field_key, Binding::Broken);
                        }
                    }
                }
            }
            Ty::Bool | Ty::Int { .. } | Ty::Time | Ty::Array(..) | Ty::Broken => {}
        }
        Some(object)
    }

    /// Declares a variable of an instance of a user-defined function block.
    #[expect(clippy::too_many_arguments, reason = "the context of a variable of an instance")]
    pub(super) fn member(
        &mut self,
        frame: FrameId,
        var: &'a Var,
        instance: &Name,
        inner: &Usage,
        omitted: &dyn Fn(&str) -> bool,
        init: &[(Name, ast::Init)],
        outer: FrameId,
        depth: usize,
    ) {
        let key = upper(&var.name.text);
        if var.section == Section::External {
            if self.lookup(self.globals, &key).is_none() {
                self.unknown(
                    "global variable",
                    &var.name.text,
                    var.name.span,
                    &[],
                    "add it to a VAR_GLOBAL block",
                );
                self.frames[frame].names.insert(key, Binding::Broken);
            }
            return;
        }
        let ty = self.ty(frame, &var.ty);
        let full = Name::new(format!("{instance}.{}", var.name), var.name.span);
        let given = init.iter().find(|(one, _)| upper(&one.text) == key).map(|(_, init)| init);
        match &ty {
            Ty::Broken => {
                self.frames[frame].names.insert(key, Binding::Broken);
            }
            Ty::Time if var.section == Section::Input => {
                // The variable is bound when the block is called.
                let own = self.init_of(var);
                let start = match given.or(own.as_ref()) {
                    Some(ast::Init::Value(value)) => {
                        let place = if given.is_some() { outer } else { frame };
                        self.value(place, value).ok()
                    }
                    Some(ast::Init::List(..) | ast::Init::Fields(..)) | None => None,
                };
                let start = start.unwrap_or_else(|| Value::time(0, var.name.span));
                self.frames[frame].names.insert(key, Binding::Value(start));
            }
            // The parameter is bound to a variable when the block is called.
            Ty::Time if var.section == Section::InOut => {}
            Ty::Time => {
                let binding = self.declare_time(frame, var, &full, inner, false);
                self.frames[frame].names.insert(key, binding);
            }
            Ty::Block(_) | Ty::User(_) | Ty::Struct(_) => {
                let fields = self.fields_of(var);
                let object = self.instance(frame, &ty, &full, inner, &key, &fields, depth + 1);
                let binding = object.map_or(Binding::Broken, Binding::Object);
                self.frames[frame].names.insert(key, binding);
            }
            Ty::Bool | Ty::Int { .. } | Ty::Array(..) => {
                if var.is_constant {
                    let binding = self.declare_constant(frame, var, &ty);
                    self.frames[frame].names.insert(key, binding);
                    return;
                }
                let is_bound_by_calls = match var.section {
                    Section::Input => !omitted(&key) && !inner.assigned.contains(&key),
                    Section::InOut => true,
                    Section::Local
                    | Section::Output
                    | Section::Global
                    | Section::External
                    | Section::Temp => false,
                };
                if is_bound_by_calls {
                    return;
                }
                let values = match (given, &self.init_of(var)) {
                    (Some(init), _) => self.initial(outer, &ty, init).unwrap_or_default(),
                    (None, Some(init)) => self.initial(frame, &ty, init).unwrap_or_default(),
                    (None, None) => Vec::new(),
                };
                self.declare_var(frame, &key, full, &ty, values, Meta::default());
            }
        }
    }
}
