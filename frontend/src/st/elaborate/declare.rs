//! Variables and instances: how each declaration of a unit becomes part of the chart.

use grafsynth_ir::Name;
use grafsynth_ir::chart::{Action, Declaration, DeclarationKind, Item};
use grafsynth_ir::diag::{Diagnostic, ErrorReported};
use grafsynth_ir::expr::Type;
use grafsynth_ir::net::Meta;

use super::context::{Binding, Elaborator, FrameId, GLOBALS, Object, ObjectKind, Place};
use super::prelude;
use super::types::Ty;
use super::usage::Usage;
use super::value::{Kind, Time, Value, leaf};
use crate::codes;
use crate::st::ast::{self, Body, Section, Var};
use crate::st::symbol::{Ident, Symbol};

/// The comment of a declaration, after its address.
fn label_of(var: &Var) -> String {
    match &var.address {
        Some(address) => format!("{} {}", address.id, var.label).trim_end().to_owned(),
        None => var.label.clone(),
    }
}

impl<'a> Elaborator<'a> {
    /// Declares a variable of a chart (`is_top`) or of the instance with this frame.
    pub(super) fn declare(&mut self, frame: FrameId, var: &'a Var, usage: &Usage, is_top: bool) {
        let key = &var.name.id;
        if var.section == Section::External {
            if self.own(GLOBALS, key).is_some() {
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
        let name = var.name.name();
        let binding = match &ty {
            Ty::Broken => Some(Binding::Broken),
            Ty::Time => Some(self.declare_time(frame, var, &name, usage, is_top)),
            Ty::Block(_) | Ty::Struct(_) => {
                let init = self.fields_of(var);
                let within = Within { outer: frame, usage, key, init: &init, depth: 0 };
                let object = self.instance(&ty, &name, &within);
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
            self.bind(frame, key, binding);
        }
    }

    /// The initial value of a variable: its own or that of its type.
    pub(super) fn init_of(&self, var: &Var) -> Option<ast::Init> {
        if var.init.is_some() {
            return var.init.clone();
        }
        self.types.get(&var.ty.name()?.id)?.init.clone()
    }

    pub(super) fn fields_of(&self, var: &Var) -> Vec<(Ident, ast::Init)> {
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
        let key = &var.name.id;
        let is_assigned = usage.assigned.contains(key);
        let is_action = usage.actions.contains(key);
        let area = var.address.as_ref().and_then(|address| address.id.chars().nth(1));
        let meta = Meta { span: var.name.span, label: label_of(var), ..Meta::default() };
        // The name in the chart omits the `%` of an address.
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
            self.bind(frame, key, Binding::Broken);
            return;
        }
        let is_output = var.section == Section::Output
            || (matches!(var.section, Section::Local | Section::Global) && area == Some('Q'));
        let place = Place { name: name.clone(), chart: self.chart, index: None, ty: ty.clone() };
        if let (true, Some(simple)) = (is_input, ty.simple()) {
            self.inputs.insert(name.text.clone());
            let kind = DeclarationKind::Input { ty: simple, synchronous: false };
            self.items.push(Item::Declaration(Declaration { name, kind, meta }));
            self.bind(frame, key, Binding::Place(place));
            return;
        }
        if is_input && !is_output {
            self.refused("arrays as inputs", var.name.span, "declare one input for each element");
            self.bind(frame, key, Binding::Broken);
            return;
        }
        // Other charts cannot name an action, so a global that is an action becomes a variable that actions write.
        let is_flag = is_action
            && !is_assigned
            && *ty == Ty::Bool
            && (var.section != Section::Global || self.chart_names.len() == 1);
        if let (true, Some(simple)) = (is_output, ty.simple()) {
            if !is_assigned && !is_action && usage.read.contains(key) {
                // No statement assigns the variable, so it keeps its initial value.
                let zero = || match simple {
                    Type::Bool => Value::constant(false, var.name.span),
                    Type::Int { .. } => Value::int(simple.saturate(0), var.name.span),
                };
                let value = values.first().cloned().map_or_else(zero, Value::literal);
                self.bind(frame, key, Binding::Value(value));
            } else {
                self.bind(frame, key, Binding::Place(place));
            }
            if is_flag {
                self.flags.insert(key.clone(), name.text.clone());
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
            self.bind(frame, key, Binding::Place(place));
            self.items.push(Item::Action(Action { name, body: Vec::new(), meta }));
            return;
        }
        self.declare_var(frame, key, name, ty, values, meta);
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
    fn instance(&mut self, ty: &Ty, name: &Name, within: &Within<'_>) -> Option<usize> {
        if within.depth > 16 || self.spend(name.span, 8).is_err() {
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
        let kind = match ty {
            Ty::Block(index) => ObjectKind::Block(*index),
            Ty::Struct(_) => ObjectKind::Struct,
            Ty::Bool | Ty::Int { .. } | Ty::Time | Ty::Array(..) | Ty::Broken => return None,
        };
        let frame = self.new_frame();
        let object = self.objects.len();
        let prefix = name.text.clone();
        self.objects.push(Object { kind, frame, prefix, has_preset: false, n_calls: 0 });
        match ty {
            Ty::Block(index) => self.members(object, *index, name, within),
            Ty::Struct(fields) => {
                for field in fields {
                    self.field_of(frame, field, name, within);
                }
            }
            Ty::Bool | Ty::Int { .. } | Ty::Time | Ty::Array(..) | Ty::Broken => {}
        }
        Some(object)
    }

    /// Declares a field of a structure.
    fn field_of(&mut self, frame: FrameId, field: &Var, name: &Name, within: &Within<'_>) {
        let ty = self.ty(within.outer, &field.ty);
        let key = &field.name.id;
        let full = Name::new(format!("{name}.{}", field.name), field.name.span);
        let binding = match &ty {
            Ty::Bool | Ty::Int { .. } | Ty::Array(..) => {
                let values = match within.init(key).or(field.init.as_ref()) {
                    Some(init) => self.initial(within.outer, &ty, init).unwrap_or_default(),
                    None => Vec::new(),
                };
                return self.declare_var(frame, key, full, &ty, values, Meta::default());
            }
            Ty::Block(_) | Ty::Struct(_) => {
                let (usage, depth) = (&Usage::default(), within.depth + 1);
                let inner = Within { usage, key, init: &[], depth, ..*within };
                self.instance(&ty, &full, &inner).map_or(Binding::Broken, Binding::Object)
            }
            Ty::Time | Ty::Broken => Binding::Broken,
        };
        self.bind(frame, key, binding);
    }

    /// Declares the variables of an instance of a function block.
    fn members(&mut self, object: usize, index: usize, name: &Name, within: &Within<'_>) {
        let frame = self.objects[object].frame;
        let pou = self.unit(index);
        let is_called = self.may_call_charts && within.depth == 0 && within.outer != GLOBALS;
        if matches!(pou.body, Body::Sfc(_)) && !is_called {
            // Its call is refused; uses of its variables are not reported again.
            for var in &pou.vars {
                self.bind(frame, &var.name.id, Binding::Broken);
            }
            return;
        }
        for refusal in &pou.refused {
            self.report(refusal.diagnostic());
        }
        let mut inner = self.usage(pou);
        if !self.is_standard(index) {
            for var in &pou.vars {
                self.member(frame, var, name, &inner, within);
            }
            return;
        }
        let params = self.parameters(index);
        let main = |(name, init): &(Ident, ast::Init)| {
            let one = params.iter().find(|one| one.is(&name.id))?;
            Some((Ident::new(one.id.as_str(), name.span), init.clone()))
        };
        let init: Vec<_> = within.init.iter().filter_map(main).collect();
        let within = &Within { init: &init, ..*within };
        // The condition of a timer is a variable of the chart.
        let clocks = pou.vars.iter().filter_map(prelude::clock);
        inner.assigned.extend(clocks.map(|(running, _)| running.id.clone()));
        for var in &pou.vars {
            if let Some((running, _)) = prelude::clock(var) {
                self.declare_timer(frame, var, running, name);
                continue;
            }
            if var.ty.is_named("TIME") {
                self.objects[object].has_preset = within.init(&var.name.id).is_some();
            }
            // Everything in a standard block has the location of the instance's declaration.
            let mut var = var.clone();
            var.name.span = name.span;
            self.member(frame, &var, name, &inner, within);
        }
    }

    /// Declares a timer of an instance of a standard block.
    fn declare_timer(&mut self, frame: FrameId, var: &Var, running: &Ident, instance: &Name) {
        let full = |part: &Ident| Name::new(format!("{instance}.{part}"), instance.span);
        let condition = leaf(full(running).into(), instance.span);
        self.items.push(Item::Declaration(Declaration {
            name: full(&var.name),
            kind: DeclarationKind::Timer { condition },
            meta: Meta { span: instance.span, ..Meta::default() },
        }));
        let expr = leaf(full(&var.name).into(), instance.span);
        let value = Value { expr, kind: Kind::Time(Time::Running) };
        self.bind(frame, &var.name.id, Binding::Value(value));
    }

    /// Declares a variable of an instance of a function block.
    fn member(
        &mut self,
        frame: FrameId,
        var: &Var,
        instance: &Name,
        inner: &Usage,
        within: &Within<'_>,
    ) {
        let key = &var.name.id;
        if var.section == Section::External {
            if self.own(GLOBALS, key).is_none() {
                self.unknown("global variable", &var.name, &[], "add it to a VAR_GLOBAL block");
                self.bind(frame, key, Binding::Broken);
            }
            return;
        }
        let ty = self.ty(frame, &var.ty);
        let full = Name::new(format!("{instance}.{}", var.name), var.name.span);
        let binding = match &ty {
            Ty::Broken => Binding::Broken,
            Ty::Time if var.section == Section::Input => {
                Binding::Value(self.first_time(frame, var, key, within))
            }
            // The parameter is bound to a variable when the block is called.
            Ty::Time if var.section == Section::InOut => return,
            Ty::Time => self.declare_time(frame, var, &full, inner, false),
            Ty::Block(_) | Ty::Struct(_) => {
                let (init, depth) = (&self.fields_of(var), within.depth + 1);
                let inner = Within { outer: frame, usage: inner, key, init, depth };
                self.instance(&ty, &full, &inner).map_or(Binding::Broken, Binding::Object)
            }
            Ty::Bool | Ty::Int { .. } if var.is_constant => self.declare_constant(frame, var, &ty),
            Ty::Bool | Ty::Int { .. } | Ty::Array(..) => {
                let is_bound_by_calls = var.section == Section::InOut
                    || var.section == Section::Input
                        && !within.omits(key)
                        && !inner.assigned.contains(key);
                if is_bound_by_calls {
                    return;
                }
                let values = match (within.init(key), &self.init_of(var)) {
                    (Some(init), _) => self.initial(within.outer, &ty, init).unwrap_or_default(),
                    (None, Some(init)) => self.initial(frame, &ty, init).unwrap_or_default(),
                    (None, None) => Vec::new(),
                };
                return self.declare_var(frame, key, full, &ty, values, Meta::default());
            }
        };
        self.bind(frame, key, binding);
    }

    /// The value of a TIME input before the first call, which binds the input to its argument.
    fn first_time(&mut self, frame: FrameId, var: &Var, key: &str, within: &Within<'_>) -> Value {
        let (given, own) = (within.init(key), self.init_of(var));
        let place = if given.is_some() { within.outer } else { frame };
        let value = match given.or(own.as_ref()) {
            Some(ast::Init::Value(value)) => self.value(place, value),
            Some(ast::Init::List(..) | ast::Init::Fields(..)) | None => Err(ErrorReported),
        };
        let value = value.and_then(|value| self.fit(value, &Ty::Time, &format!("`{}`", var.name)));
        value.unwrap_or_else(|_| Value::time(0, var.name.span))
    }
}

/// The unit or instance that declares an instance.
struct Within<'w> {
    outer: FrameId,
    /// How the unit uses its names; it knows the instance as `key`.
    usage: &'w Usage,
    key: &'w Symbol,
    /// The initial values of the instance.
    init: &'w [(Ident, ast::Init)],
    depth: usize,
}

impl Within<'_> {
    /// Whether an input needs a variable: a call omits it, or it is read or assigned outside of calls.
    fn omits(&self, input: &Symbol) -> bool {
        let mut calls = self.usage.calls.get(self.key).into_iter().flatten();
        calls.any(|given| !given.contains(input))
            || self.usage.fields.contains(&(self.key.clone(), input.clone()))
    }

    /// The initial value of a variable.
    fn init(&self, key: &str) -> Option<&ast::Init> {
        let mut init = self.init.iter();
        init.find(|(name, _)| name.id == *key).map(|(_, init)| init)
    }
}
