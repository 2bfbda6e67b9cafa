//! Calls in statements: function block instances, their actions, and actions of the unit itself.

use grafsynth_ir::chart::{Block, Expr, Stmt, StmtKind};
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::diag::ErrorReported;
use grafsynth_ir::net::Meta;
use grafsynth_ir::{Name, Span};

use super::context::{Access, Binding, Elaborator, FrameId, ObjectKind, Outcome, bodies_of};
use super::usage::upper;
use super::value::{Kind, Time, Value};
use crate::codes;
use crate::st::ast::{self, Arg, Body, Section};

impl Elaborator<'_> {
    pub(super) fn call(
        &mut self,
        frame: FrameId,
        target: &ast::Expr,
        arguments: &[Arg],
        span: Span,
        out: &mut Block,
    ) -> Outcome<()> {
        if let ast::ExprKind::Name(name) = &target.kind
            && self.lookup(frame, &name.text).is_none()
        {
            return self.call_by_name(frame, name, arguments, span, out);
        }
        if let ast::ExprKind::Field(inner, name) = &target.kind
            && let Some(done) = self.call_action_of(frame, inner, name, arguments, span, out)
        {
            return done;
        }
        let Access::Object(object) = self.access(frame, target)? else {
            return Err(self.report(
                Diagnostic::error(codes::ST_CALL, "not a function block")
                    .at(target.span, "called here")
                    .help("call an instance of a function block, or an action; a function is called in an expression"),
            ));
        };
        let kind = self.objects[object].kind;
        let arguments = self.named_arguments(kind, arguments, span)?;
        let enable = arguments
            .iter()
            .find(|one| {
                !one.is_output && one.name.as_ref().is_some_and(|name| upper(&name.text) == "EN")
            })
            .map(|one| self.condition(frame, &one.value));
        let enable = enable.transpose()?;
        let mut list = Block::new();
        match kind {
            ObjectKind::Standard(block) => {
                self.check_arguments(object, &arguments)?;
                self.call_block(frame, object, block, &arguments, span, &mut list)?;
            }
            ObjectKind::User(pou) => {
                self.check_arguments(object, &arguments)?;
                self.call_user(frame, object, pou, &arguments, span, &mut list)?;
            }
            ObjectKind::Struct => {
                return Err(self.report(
                    Diagnostic::error(codes::ST_CALL, "a structure cannot be called")
                        .at(target.span, "called here")
                        .help("assign its fields, as in `name.field := ..;`"),
                ));
            }
        }
        for argument in arguments.iter().filter(|one| one.is_output) {
            let Some(name) = &argument.name else { continue };
            if upper(&name.text) == "ENO" {
                let value = enable.clone().unwrap_or_else(|| Expr::bool(true));
                let place = self.place(frame, &argument.value)?;
                self.assign(&place, Value::bool(value), span, out)?;
                continue;
            }
            let value = self.output_of(object, name)?;
            let value = if argument.is_negated { Value::bool(value.expr.not()) } else { value };
            let place = self.place(frame, &argument.value)?;
            self.assign(&place, value, argument.value.span, &mut list)?;
        }
        match enable {
            Some(condition) => {
                let kind = StmtKind::If { condition, then: list, otherwise: Block::new() };
                out.push(Stmt { kind, span });
            }
            None => out.extend(list),
        }
        Ok(())
    }

    /// Expands `instance.action();`: runs a list of the instance's block on its variables. Returns `None` if the block has no such action.
    fn call_action_of(
        &mut self,
        frame: FrameId,
        instance: &ast::Expr,
        name: &Name,
        arguments: &[Arg],
        span: Span,
        out: &mut Block,
    ) -> Option<Outcome<()>> {
        let key = upper(&name.text);
        let root = instance.root()?;
        let Some(Binding::Object(_)) = self.lookup(frame, &root.text) else { return None };
        let Ok(Access::Object(object)) = self.access(frame, instance) else { return None };
        let ObjectKind::User(index) = self.objects[object].kind else { return None };
        let pou = &self.library.pous[index];
        let in_chart = match &pou.body {
            Body::Sfc(chart) => chart.actions.as_slice(),
            Body::Statements(_) => &[],
        };
        if in_chart.iter().any(|one| upper(&one.name.text) == key) {
            return Some(Err(self.refused(
                &format!("a call of `{name}`, an action of a function block with a chart"),
                span,
                "make the block the design, or make it a program that runs in parallel",
            )));
        }
        let action = pou.actions.iter().find(|one| upper(&one.name.text) == key)?;
        if !arguments.is_empty() {
            return Some(Err(self.refused(
                &format!("a call of the action `{name}` with arguments"),
                span,
                "an action has no parameters; assign to variables of the block first",
            )));
        }
        let inside = self.objects[object].frame;
        let outside = std::mem::replace(&mut self.bodies, bodies_of(&pou.actions));
        let done = self.call_body(inside, &key, name, &action.body, span, out);
        self.bodies = outside;
        Some(done)
    }

    /// Expands the list of an action at its call.
    fn call_body(
        &mut self,
        frame: FrameId,
        key: &str,
        name: &Name,
        list: &[ast::Stmt],
        span: Span,
        out: &mut Block,
    ) -> Outcome<()> {
        // Expanding a body that calls itself would never end.
        let key = (frame, key.to_owned());
        if self.open_bodies.contains(&key) {
            return Err(self.report(
                Diagnostic::error(codes::ST_CALL, format!("{name} calls itself"))
                    .at(span, "in this call")
                    .help("write a FOR loop instead of the recursion"),
            ));
        }
        self.spend(span, 1)?;
        self.open_bodies.push(key);
        self.body(frame, list, span, out);
        self.open_bodies.pop();
        Ok(())
    }

    /// Expands a call of a name that is not an instance: an action of the unit, a function called for its effects, or another program.
    fn call_by_name(
        &mut self,
        frame: FrameId,
        name: &Name,
        arguments: &[Arg],
        span: Span,
        out: &mut Block,
    ) -> Outcome<()> {
        let key = upper(&name.text);
        if let Some(list) = self.bodies.get(&key).cloned()
            && arguments.is_empty()
        {
            return self.call_body(frame, &key, name, &list, span, out);
        }
        if self.functions.contains_key(&key) {
            // The value is not used, but its arguments must still be checked.
            return self.call_function(frame, name, arguments, span).map(|_| ());
        }
        if self.library.pous.iter().any(|pou| upper(&pou.name.text) == key) {
            return Err(self.refused(
                &format!("a call of the program `{name}`"),
                span,
                "make it a function block, or let both programs run in parallel",
            ));
        }
        let candidates = self.candidates(frame);
        Err(self.unknown(
            "function block",
            &name.text,
            name.span,
            &candidates,
            "declare an instance of it",
        ))
    }

    /// Gives positional arguments the names of their parameters.
    pub(super) fn named_arguments(
        &mut self,
        kind: ObjectKind,
        arguments: &[Arg],
        span: Span,
    ) -> Outcome<Vec<Arg>> {
        if arguments.iter().all(|one| one.name.is_some()) {
            return Ok(arguments.to_vec());
        }
        let order: Vec<(String, bool)> = match kind {
            ObjectKind::Standard(block) => {
                let order = block.order();
                order
                    .iter()
                    .map(|name| ((*name).to_owned(), block.canonical(name).is_none()))
                    .collect()
            }
            ObjectKind::User(pou) => self.library.pous[pou]
                .vars
                .iter()
                .filter(|var| {
                    matches!(var.section, Section::Input | Section::Output | Section::InOut)
                })
                .map(|var| (var.name.text.clone(), var.section == Section::Output))
                .collect(),
            ObjectKind::Struct => Vec::new(),
        };
        if arguments.len() > order.len() {
            return Err(self.report(
                Diagnostic::error(
                    codes::ST_CALL,
                    format!(
                        "{} arguments given, but the block has {} parameters",
                        arguments.len(),
                        order.len()
                    ),
                )
                .at(span, "")
                .help(format!("remove {} of them", arguments.len() - order.len())),
            ));
        }
        let mut named = Vec::new();
        for (argument, (name, is_output)) in arguments.iter().zip(order) {
            let mut argument = argument.clone();
            if argument.name.is_none() {
                argument.is_output = is_output;
                argument.name = Some(Name::new(name, argument.value.span));
            }
            named.push(argument);
        }
        Ok(named)
    }

    /// Checks that every argument names a parameter.
    pub(super) fn check_arguments(&mut self, object: usize, arguments: &[Arg]) -> Outcome<()> {
        let kind = self.objects[object].kind;
        let mut failed = Ok(());
        for argument in arguments {
            let Some(name) = &argument.name else { continue };
            let key = upper(&name.text);
            if matches!(key.as_str(), "EN" | "ENO") {
                continue;
            }
            let known: Vec<String> = match kind {
                ObjectKind::Standard(block) => {
                    if !argument.is_output && block.canonical(&key).is_some() {
                        continue;
                    }
                    block.order().iter().map(|name| (*name).to_owned()).collect()
                }
                ObjectKind::User(pou) => self.library.pous[pou]
                    .vars
                    .iter()
                    .filter(|var| match var.section {
                        Section::Input => !argument.is_output,
                        Section::Output => argument.is_output,
                        Section::InOut => true,
                        Section::Local | Section::Global | Section::External | Section::Temp => {
                            false
                        }
                    })
                    .map(|var| upper(&var.name.text))
                    .collect(),
                ObjectKind::Struct => Vec::new(),
            };
            if !known.contains(&key) {
                let what =
                    if argument.is_output { "output of the block" } else { "input of the block" };
                failed = Err(self.unknown(
                    what,
                    &name.text,
                    name.span,
                    &known,
                    "the block has no such parameter",
                ));
            }
        }
        failed
    }

    pub(super) fn output_of(&mut self, object: usize, name: &Name) -> Outcome<Value> {
        let frame = self.objects[object].frame;
        if let Some(value) = self.block_field(object, &upper(&name.text), name.span) {
            return value;
        }
        match self.frames[frame].names.get(&upper(&name.text)).cloned() {
            Some(Binding::Place(place)) => self.read(Access::Place(place), name.span),
            Some(Binding::Value(value)) => Ok(value),
            Some(Binding::Object(_) | Binding::Step(_) | Binding::Broken) | None => {
                Err(ErrorReported)
            }
        }
    }

    /// Expands a call of a user-defined function block: inserts its body with the variables of the instance.
    fn call_user(
        &mut self,
        frame: FrameId,
        object: usize,
        index: usize,
        arguments: &[Arg],
        span: Span,
        out: &mut Block,
    ) -> Outcome<()> {
        let library = self.library;
        let pou = &library.pous[index];
        let Body::Statements(body) = &pou.body else {
            return Err(self.refused(
                &format!("a call of `{}` here, a function block with its own chart", pou.name),
                span,
                "call it once in each scan, in a program without a chart and without RETURN or a condition around the call; or make it a program",
            ));
        };
        let inside = self.objects[object].frame;
        let prefix = self.objects[object].prefix.clone();
        // All arguments are evaluated before the first one changes anything.
        let mut taken = Vec::new();
        for var in &pou.vars {
            let key = upper(&var.name.text);
            let given = arguments.iter().find(|one| {
                one.name.as_ref().is_some_and(|name| upper(&name.text) == key)
                    && (!one.is_output || var.section == Section::InOut)
            });
            match (var.section, given) {
                (Section::Input, Some(argument)) => {
                    let value = self.value(frame, &argument.value)?;
                    let ty = self.ty(inside, &var.ty);
                    let value = self.fit(value, &ty, &var.name.text)?;
                    taken.push((key, var, ty, value));
                }
                (Section::InOut, Some(argument)) => {
                    let access = self.access(frame, &argument.value)?;
                    let binding = match access {
                        Access::Place(place) => Binding::Place(place),
                        Access::Object(object) => Binding::Object(object),
                        Access::Value(value) => Binding::Value(value),
                        Access::Step(step) => Binding::Step(step),
                    };
                    self.frames[inside].names.insert(key, binding);
                }
                (Section::InOut, None) => {
                    if !self.frames[inside].names.contains_key(&key) {
                        return Err(self.report(
                            Diagnostic::error(
                                codes::ST_CALL,
                                format!("the in-out parameter `{}` needs a variable", var.name),
                            )
                            .at(span, "in this call")
                            .help(format!("add `{} := variable` to the call", var.name)),
                        ));
                    }
                }
                (
                    Section::Input
                    | Section::Local
                    | Section::Output
                    | Section::Global
                    | Section::External
                    | Section::Temp,
                    _,
                ) => {}
            }
        }
        for (key, var, ty, value) in taken {
            match self.frames[inside].names.get(&key).cloned() {
                Some(Binding::Place(place)) => self.assign(&place, value, span, out)?,
                Some(Binding::Value(_)) | None if self.is_steady(&value) => {
                    self.frames[inside].names.insert(key, Binding::Value(value));
                }
                Some(Binding::Value(_)) | None => {
                    if let Kind::Time(Time::Varying(_)) = value.kind {
                        return Err(self.report(
                            Diagnostic::error(
                                codes::ST_TIMER,
                                format!(
                                    "parameter `{}` is given a TIME variable that changes",
                                    var.name
                                ),
                            )
                            .at(value.expr.span, "in this call")
                            .help("declare the parameter VAR_IN_OUT, or give a constant"),
                        ));
                    }
                    if matches!(value.kind, Kind::Time(_)) {
                        self.frames[inside].names.insert(key, Binding::Value(value));
                        continue;
                    }
                    let name = Name::new(format!("{prefix}.{}", var.name), var.name.span);
                    self.declare_var(inside, &key, name, &ty, Vec::new(), Meta::default());
                    if let Some(Binding::Place(place)) =
                        self.frames[inside].names.get(&key).cloned()
                    {
                        self.assign(&place, value, span, out)?;
                    }
                }
                Some(Binding::Object(_) | Binding::Step(_) | Binding::Broken) => {
                    return Err(ErrorReported);
                }
            }
        }
        for var in pou.vars.iter().filter(|var| var.section == Section::Temp) {
            if let Some(Binding::Place(place)) =
                self.frames[inside].names.get(&upper(&var.name.text)).cloned()
                && place.index.is_none()
                && let Some(ty) = place.ty.simple()
            {
                let value = match ty {
                    grafsynth_ir::expr::Type::Bool => Value::constant(false, span),
                    ty @ grafsynth_ir::expr::Type::Int { .. } => Value::int(ty.saturate(0), span),
                };
                self.assign(&place, value, span, out)?;
            }
        }
        let outside = std::mem::replace(&mut self.bodies, bodies_of(&pou.actions));
        let done = self.call_body(inside, "", &pou.name, body, span, out);
        self.bodies = outside;
        done
    }

    /// Whether a value cannot change within a scan: constants, inputs, steps.
    fn is_steady(&self, value: &Value) -> bool {
        let mut steady = true;
        value.expr.for_each_leaf(&mut |leaf| {
            if let grafsynth_ir::chart::Leaf::Name(path) = leaf {
                let first = path.names.first().map(|name| upper(&name.text)).unwrap_or_default();
                steady &= path.names.len() > 1
                    && path
                        .names
                        .last()
                        .is_some_and(|last| matches!(last.text.as_str(), "active" | "t" | "T"))
                    || self.inputs.contains(&first);
            }
        });
        steady
    }
}
