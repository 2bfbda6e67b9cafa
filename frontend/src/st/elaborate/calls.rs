//! Calls in statements: function block instances, their actions, and actions of the unit itself.

use grafsynth_ir::chart::{Block, Expr, Stmt, StmtKind};
use grafsynth_ir::diag::{Diagnostic, ErrorReported, counted};
use grafsynth_ir::expr::Type;
use grafsynth_ir::net::Meta;
use grafsynth_ir::{Name, Span};

use super::context::{Binding, Elaborator, FrameId, Object, ObjectKind, Outcome, bodies_of};
use super::prelude;
use super::types::Ty;
use super::usage::Params;
use super::value::{Kind, Time, Value, mentions, reads_only};
use crate::codes;
use crate::st::ast::{self, Arg, Body, Section};
use crate::st::symbol::Ident;

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
            && self.lookup(frame, &name.id).is_none()
        {
            return self.call_by_name(frame, name, arguments, span, out);
        }
        if let ast::ExprKind::Field(inner, name) = &target.kind
            && let Some(done) = self.call_action_of(frame, inner, name, arguments, span, out)
        {
            return done;
        }
        let Binding::Object(object) = self.access(frame, target)? else {
            return Err(self.report(
                Diagnostic::error(codes::ST_CALL, "not a function block")
                    .at(target.span, "called here")
                    .help("call an instance of a function block, or an action; a function is called in an expression"),
            ));
        };
        let ObjectKind::Block(index) = self.objects[object].kind else {
            return Err(self.report(
                Diagnostic::error(codes::ST_CALL, "a structure cannot be called")
                    .at(target.span, "called here")
                    .help("assign its fields, as in `name.field := ..;`"),
            ));
        };
        let arguments = self.named_arguments(index, arguments, span)?;
        let enable = arguments.iter().find(|one| !one.is_output && one.is_for("EN"));
        let enable = enable.map(|one| self.condition(frame, &one.value)).transpose()?;
        let mut list = Block::new();
        self.call_block(frame, object, index, &arguments, span, &mut list)?;
        for argument in arguments.iter().filter(|one| one.is_output) {
            if argument.is_for("ENO") {
                let value = enable.clone().unwrap_or_else(|| Expr::bool(true));
                let place = self.place(frame, &argument.value)?;
                self.assign(&place, Value::bool(value), span, out)?;
            } else {
                self.pass_output(frame, object, argument, &mut list)?;
            }
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

    /// Assigns an output of an instance to the variable that a call gives for it.
    pub(super) fn pass_output(
        &mut self,
        frame: FrameId,
        object: usize,
        argument: &Arg,
        out: &mut Block,
    ) -> Outcome<()> {
        let Some(name) = &argument.name else { return Ok(()) };
        let output = self.field(object, name)?;
        let value = self.read(output, name.span)?;
        let value = if argument.is_negated { Value::bool(value.expr.not()) } else { value };
        let place = self.place(frame, &argument.value)?;
        self.assign(&place, value, argument.value.span, out)
    }

    /// Expands `instance.action();`: runs a list of the instance's block on its variables. Returns `None` if the block has no such action.
    fn call_action_of(
        &mut self,
        frame: FrameId,
        instance: &ast::Expr,
        name: &Ident,
        arguments: &[Arg],
        span: Span,
        out: &mut Block,
    ) -> Option<Outcome<()>> {
        self.object(frame, &instance.root()?.id)?;
        let Ok(Binding::Object(object)) = self.access(frame, instance) else { return None };
        let ObjectKind::Block(index) = self.objects[object].kind else { return None };
        let pou = self.unit(index);
        let is_called = |one: &&ast::Action| one.name.id == name.id;
        if let Body::Sfc(chart) = &pou.body
            && chart.actions.iter().any(|one| is_called(&one))
        {
            return Some(Err(self.refused(
                &format!("a call of `{name}`, an action of a function block with a chart,"),
                span,
                "make the block the design, or make it a program that runs in parallel",
            )));
        }
        let action = pou.actions.iter().find(is_called)?;
        if !arguments.is_empty() {
            return Some(Err(self.refused(
                &format!("a call of the action `{name}` with arguments"),
                span,
                "an action has no parameters; assign to variables of the block first",
            )));
        }
        let inside = self.objects[object].frame;
        let outside = std::mem::replace(&mut self.bodies, bodies_of(&pou.actions));
        let done = self.call_body(inside, Some(name), name, &action.body, span, out);
        self.bodies = outside;
        Some(done)
    }

    /// Expands the body of an action or block at its call.
    fn call_body(
        &mut self,
        frame: FrameId,
        action: Option<&Ident>,
        name: &Ident,
        list: &[ast::Stmt],
        span: Span,
        out: &mut Block,
    ) -> Outcome<()> {
        // Expanding a body that calls itself would never end.
        let key = (frame, action.map(|one| one.id.clone()));
        if self.open_bodies.contains(&key) {
            return Err(self.report(
                Diagnostic::error(codes::ST_CALL, format!("`{name}` calls itself"))
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
        name: &Ident,
        arguments: &[Arg],
        span: Span,
        out: &mut Block,
    ) -> Outcome<()> {
        if let Some(list) = self.bodies.get(&name.id).copied()
            && arguments.is_empty()
        {
            return self.call_body(frame, Some(name), name, list, span, out);
        }
        if self.functions.contains_key(&name.id) {
            // The value is not used, but its arguments must still be checked.
            return self.call_function(frame, name, arguments, span).map(|_| ());
        }
        if self.library.pous.iter().any(|pou| pou.name.id == name.id) {
            return Err(self.refused(
                &format!("a call of the program `{name}`"),
                span,
                "make it a function block, or let both programs run in parallel",
            ));
        }
        let candidates = self.candidates(frame);
        Err(self.unknown("function block", name, &candidates, "declare an instance of it"))
    }

    /// Labels every argument, positional or named, with the main name of its parameter, and checks that the parameter exists.
    pub(super) fn named_arguments(
        &mut self,
        index: usize,
        arguments: &[Arg],
        span: Span,
    ) -> Outcome<Vec<Arg>> {
        let params = self.parameters(index);
        let is_positional = arguments.iter().any(|one| one.name.is_none());
        if is_positional && arguments.len() > params.len() {
            return Err(self.report(
                Diagnostic::error(
                    codes::ST_CALL,
                    format!(
                        "the block has {}, found {}",
                        counted(params.len(), "parameter", "parameters"),
                        counted(arguments.len(), "argument", "arguments")
                    ),
                )
                .at(span, "")
                .help(format!(
                    "remove {}",
                    counted(arguments.len() - params.len(), "argument", "arguments")
                )),
            ));
        }
        let mut named = Vec::new();
        let mut failed = Ok(());
        for (place, argument) in arguments.iter().enumerate() {
            let mut argument = argument.clone();
            let (main, span) = match &argument.name {
                None => {
                    argument.is_output = params[place].section == Section::Output;
                    (params.get(place), argument.value.span)
                }
                Some(name) => (params.iter().find(|one| one.second == Some(&name.id)), name.span),
            };
            if let Some(main) = main {
                argument.name = Some(Ident::new(main.id.as_str(), span));
            }
            failed = failed.and(self.check_argument(&argument, &params));
            named.push(argument);
        }
        failed.map(|()| named)
    }

    /// Reports an argument that names no parameter of its direction.
    fn check_argument(&mut self, argument: &Arg, params: &Params) -> Outcome<()> {
        let Some(name) = &argument.name else { return Ok(()) };
        let (wanted, what) = match argument.is_output {
            true => (Section::Output, "output of the block"),
            false => (Section::Input, "input of the block"),
        };
        let known = params.iter().filter(|one| [wanted, Section::InOut].contains(&one.section));
        let known: Vec<String> = known.map(|one| one.id.to_string()).collect();
        if known.iter().any(|one| name.id == **one) || matches!(name.id.as_str(), "EN" | "ENO") {
            return Ok(());
        }
        let help = match params.iter().find(|one| one.is(&name.id)) {
            None => "the block has no such parameter".to_owned(),
            Some(_) if argument.is_output => format!("it is an input: write `{name} := value`"),
            Some(_) => format!("it is an output: write `{name} => variable`"),
        };
        Err(self.unknown(what, name, &known, &help))
    }

    /// Expands a call of a function block: inserts its body with the variables of the instance.
    fn call_block(
        &mut self,
        frame: FrameId,
        object: usize,
        index: usize,
        arguments: &[Arg],
        span: Span,
        out: &mut Block,
    ) -> Outcome<()> {
        let pou = self.unit(index);
        let Body::Statements(body) = &pou.body else {
            return Err(self.refused(
                &format!("a call of `{}`, a function block with its own chart, in this place", pou.name),
                span,
                "call it once in each scan, in a program without a chart and without RETURN or a condition around the call; or make it a program",
            ));
        };
        let is_standard = self.is_standard(index);
        if is_standard && pou.vars.iter().any(|var| prelude::clock(var).is_some()) {
            self.count_call(object, span);
        }
        let inside = self.objects[object].frame;
        // All arguments are evaluated before any input is assigned.
        let mut given = Vec::new();
        for var in &pou.vars {
            let argument = argument(arguments, var);
            if var.section == Section::InOut {
                self.in_out(frame, inside, var, argument, span)?;
            } else if var.section == Section::Input {
                if let Some(argument) = argument {
                    let value = self.input(frame, object, var, argument)?;
                    given.push((var, value));
                } else if is_standard {
                    self.omitted(inside, var, span)?;
                }
            }
        }
        for (var, (ty, value)) in given {
            self.give(object, var, &ty, value, span, out)?;
        }
        for var in pou.vars.iter().filter(|var| var.section == Section::Temp) {
            self.reset(inside, var, span, out)?;
        }
        let bodies = std::mem::replace(&mut self.bodies, bodies_of(&pou.actions));
        let site = std::mem::replace(&mut self.call_site, is_standard.then_some(span));
        let done = self.call_body(inside, None, &pou.name, body, span, out);
        (self.bodies, self.call_site) = (bodies, site);
        if is_standard {
            // Only the statements of this call read its arguments; PT of a timer stays known.
            for var in pou.vars.iter().filter(|var| var.section == Section::Input) {
                if let Some(Binding::Value(Value { kind: Kind::Bool | Kind::Int(..), .. })) =
                    self.own(inside, &var.name.id)
                {
                    self.frames[inside].names.remove(&var.name.id);
                }
            }
        }
        done
    }

    /// Binds an input of a standard block if the input has no variable and the call has no argument for it.
    fn omitted(&mut self, inside: FrameId, var: &ast::Var, span: Span) -> Outcome<()> {
        if self.own(inside, &var.name.id).is_none() {
            let ty = self.ty(inside, &var.ty);
            let value = Binding::Value(self.zero_value(&ty, span)?);
            self.bind(inside, &var.name.id, value);
        }
        Ok(())
    }

    /// Counts a call of a timer, and warns if it is the second.
    fn count_call(&mut self, object: usize, span: Span) {
        self.objects[object].n_calls += 1;
        if self.objects[object].n_calls == 2 {
            let prefix = &self.objects[object].prefix;
            self.report(
                Diagnostic::warning(
                    codes::ST_TIMER,
                    format!("`{prefix}` is called in several places"),
                )
                .at(span, "called again here")
                .help("a timer that stops and restarts within one scan keeps running; call each timer once"),
            );
        }
    }

    /// The value of an argument for an input.
    pub(super) fn input(
        &mut self,
        frame: FrameId,
        object: usize,
        var: &ast::Var,
        argument: &Arg,
    ) -> Outcome<(Ty, Value)> {
        let value = self.value(frame, &argument.value)?;
        let ty = self.ty(self.objects[object].frame, &var.ty);
        Ok((ty.clone(), self.fit(value, &ty, &format!("`{}`", var.name))?))
    }

    /// Binds an in-out parameter to the variable that a call gives.
    fn in_out(
        &mut self,
        frame: FrameId,
        inside: FrameId,
        var: &ast::Var,
        argument: Option<&Arg>,
        span: Span,
    ) -> Outcome<()> {
        if let Some(argument) = argument {
            let binding = self.access(frame, &argument.value)?;
            self.bind(inside, &var.name.id, binding);
        } else if self.own(inside, &var.name.id).is_none() {
            return Err(self.report(
                Diagnostic::error(
                    codes::ST_CALL,
                    format!("the in-out parameter `{}` needs a variable", var.name),
                )
                .at(span, "in this call")
                .help(format!("add `{} := variable` to the call", var.name)),
            ));
        }
        Ok(())
    }

    /// Passes a value to an input: assigns it to the input's variable or, if there is none, binds the input to the value.
    fn give(
        &mut self,
        object: usize,
        var: &ast::Var,
        ty: &Ty,
        value: Value,
        span: Span,
        out: &mut Block,
    ) -> Outcome<()> {
        let Object { frame: inside, prefix, .. } = self.objects[object].clone();
        match self.own(inside, &var.name.id).cloned() {
            Some(Binding::Place(place)) => return self.assign(&place, value, span, out),
            Some(Binding::Value(_)) | None => {}
            Some(Binding::Object(_) | Binding::Step(_) | Binding::Broken) => {
                return Err(ErrorReported);
            }
        }
        // The statements of a standard block change only its own variables.
        let is_standard = self.is_standard_object(object);
        let is_steady =
            self.is_steady(&value) || is_standard && !mentions(&value.expr, &format!("{prefix}."));
        if let Kind::Time(time) = &value.kind {
            self.check_time(object, var, time, is_steady, value.expr.span)?;
        } else if !is_steady {
            let declared = if is_standard { span } else { var.name.span };
            let name = Name::new(format!("{prefix}.{}", var.name), declared);
            let place = self.new_var(name, ty, Vec::new(), Meta::default());
            self.bind(inside, &var.name.id, Binding::Place(place.clone()));
            return self.assign(&place, value, span, out);
        }
        self.bind(inside, &var.name.id, Binding::Value(value));
        Ok(())
    }

    /// Checks a time that a call binds to an input.
    fn check_time(
        &mut self,
        object: usize,
        var: &ast::Var,
        time: &Time,
        is_steady: bool,
        span: Span,
    ) -> Outcome<()> {
        let prefix = &self.objects[object].prefix;
        let (message, label, help) = match (time, self.is_standard_object(object)) {
            (Time::Constant(_) | Time::Varying(Some(_)), true) => {
                self.objects[object].has_preset = true;
                return Ok(());
            }
            (_, true) => (
                format!("{} of `{prefix}` can have any value", var.name),
                "computed at run time",
                "give a constant, or a TIME variable to which only constants are assigned",
            ),
            (Time::Varying(_), false) if !is_steady => (
                format!("parameter `{}` is given a TIME variable that changes", var.name),
                "in this call",
                "declare the parameter VAR_IN_OUT, or give a constant",
            ),
            (_, false) => return Ok(()),
        };
        Err(self.report(Diagnostic::error(codes::ST_TIMER, message).at(span, label).help(help)))
    }

    /// Assigns its initial value to a VAR_TEMP variable.
    fn reset(
        &mut self,
        inside: FrameId,
        var: &ast::Var,
        span: Span,
        out: &mut Block,
    ) -> Outcome<()> {
        let binding = self.own(inside, &var.name.id).cloned();
        let Some(Binding::Place(place)) = binding else { return Ok(()) };
        match place.ty.simple().filter(|_| place.index.is_none()) {
            Some(Type::Bool) => self.assign(&place, Value::constant(false, span), span, out),
            Some(ty @ Type::Int { .. }) => {
                self.assign(&place, Value::int(ty.saturate(0), span), span, out)
            }
            None => Ok(()),
        }
    }

    /// Whether a value cannot change within a scan: constants, inputs, steps.
    fn is_steady(&self, value: &Value) -> bool {
        let is_step = |last: &Name| matches!(last.text.as_str(), "active" | "t" | "T");
        reads_only(value, |names| {
            names.len() > 1 && names.last().is_some_and(is_step)
                || names.first().is_some_and(|name| self.inputs.contains(&name.text))
        })
    }
}

/// The argument that a call gives for an input or in-out parameter.
pub(super) fn argument<'c>(arguments: &'c [Arg], var: &ast::Var) -> Option<&'c Arg> {
    arguments
        .iter()
        .find(|one| (!one.is_output || var.section == Section::InOut) && one.is_for(&var.name.id))
}
