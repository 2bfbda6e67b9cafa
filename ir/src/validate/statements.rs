//! Outputs, statement lists, controlled actions, tasks (invariants 14 to 19).

use super::Checker;
use super::expressions::Place;
use crate::arena::Id;
use crate::codes;
use crate::diag::counted;
use crate::expr::{Expr as GenericExpr, Type};
use crate::interval::{DEPTH_LIMIT, LONGEST, index_help, values};
use crate::net::{
    ActionUse, Driver, Evolution, Expr, ExternCall, Output, OutputId, Param, Stmt, StmtKind,
    VarOrigin,
};
use crate::span::Span;

/// The statements that a list may contain in addition to assignments, calls and `if`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ListKind {
    /// All statements.
    Free,
    /// No other statements.
    Task,
}

impl Checker<'_> {
    pub(super) fn outputs(&mut self) {
        let net = self.net;
        let mut memories = vec![0u32; net.vars.len()];
        let mut actions = vec![0u32; net.actions.len()];
        for output in net.outputs.values() {
            let (name, span) = (&output.name, output.name.span);
            let mut wants_bool = true;
            match &output.driver {
                Driver::Continuous(emissions) | Driver::Mealy(emissions) => {
                    for emission in emissions {
                        self.has(&net.steps, emission.step, emission.span, "step");
                        if let Some(condition) = &emission.condition {
                            self.condition(condition, Place::Quiet("the condition of an output"));
                        }
                    }
                    if matches!(output.driver, Driver::Mealy(_))
                        && net.settings.evolution != Evolution::Single
                    {
                        let message =
                            format!("the output `{name}` is mealy, but the evolution is stable");
                        self.report_with_help(
                            codes::SETTINGS,
                            span,
                            message,
                            "use `evolution single` or remove `mealy`",
                        );
                    }
                }
                Driver::Fires(transitions) => {
                    for transition in transitions {
                        self.has(&net.transitions, *transition, span, "transition");
                    }
                    if net.settings.evolution != Evolution::Single {
                        let message = format!(
                            "the output `{name}` shows that a transition fires, but the evolution is stable"
                        );
                        self.report(codes::SETTINGS, span, message);
                    }
                }
                Driver::Stored(var) => {
                    wants_bool = false;
                    self.memory(output, *var, &mut memories);
                }
                Driver::Controlled(action) => {
                    if self.has(&net.actions, *action, span, "action") {
                        actions[action.index()] += 1;
                        if actions[action.index()] == 2 {
                            let action = &net.actions[*action].name;
                            let message =
                                format!("the action `{action}` drives `{name}` and another output");
                            self.report(codes::DRIVER, span, message);
                        }
                    }
                }
                Driver::Extern { params, calls } => {
                    self.continuous_calls(output, params, calls);
                }
            }
            if wants_bool && !output.ty.is_bool() {
                let message = format!("the output `{name}` has a range, but no variable stores it");
                self.report_with_help(
                    codes::DRIVER,
                    span,
                    message,
                    "assign to it in a list to make it stored",
                );
            }
        }
        for (id, var) in net.vars.iter().filter(|(_, var)| var.origin == VarOrigin::StoredOutput) {
            let count = memories[id.index()];
            if count != 1 {
                let message = format!(
                    "the variable `{}` is the memory of {count} outputs, but must be the memory of one",
                    var.name
                );
                self.report(codes::DRIVER, var.name.span, message);
            }
        }
    }

    /// The calls of an extern action while steps are active.
    fn continuous_calls(&mut self, output: &Output, params: &[Param], calls: &[ExternCall]) {
        let net = self.net;
        for param in params {
            self.range(param.ty, output.name.span, "parameter");
        }
        for call in calls {
            self.has(&net.steps, call.step, call.span, "step");
            if let Some(condition) = &call.condition {
                self.condition(condition, Place::Quiet("the condition of a call"));
            }
            let place = Place::Quiet("an argument of a continuous call");
            self.arguments(output, params, &call.arguments, call.span, place);
        }
    }

    fn memory(&mut self, output: &Output, var: Id<crate::net::Var>, memories: &mut [u32]) {
        let (name, span) = (&output.name, output.name.span);
        if !self.has(&self.net.vars, var, span, "variable") {
            return;
        }
        memories[var.index()] += 1;
        let var = &self.net.vars[var];
        if var.origin != VarOrigin::StoredOutput {
            let message = format!(
                "the output `{name}` is stored in the variable `{}`, which is not the memory of an output",
                var.name
            );
            self.report(codes::DRIVER, span, message);
        } else if var.len.is_some() || var.ty != output.ty {
            let message =
                format!("the output `{name}` and its memory `{}` have different types", var.name);
            self.report(codes::DRIVER, span, message);
        }
    }

    fn arguments(
        &mut self,
        output: &Output,
        params: &[Param],
        arguments: &[Expr],
        span: Span,
        place: Place,
    ) {
        if params.len() != arguments.len() {
            let (name, wanted, given) = (&output.name, params.len(), arguments.len());
            let wanted = counted(wanted, "argument", "arguments");
            let message = format!("`{name}` takes {wanted}, found {given}");
            self.report(codes::STATEMENT, span, message);
        }
        for (param, argument) in params.iter().zip(arguments) {
            self.value(argument, place, param.ty);
        }
    }

    /// Checks the lists and tasks of steps; the structure of steps is checked elsewhere.
    pub(super) fn steps(&mut self) {
        let net = self.net;
        for step in net.steps.values() {
            for list in [&step.entry, &step.exit, &step.initial_content] {
                self.list(list, Place::List, ListKind::Free, 0);
            }
            let (name, span) = (&step.name, step.name.span);
            if !step.tasks.is_empty() && step.budget == 0 {
                let message = format!("the step `{name}` has tasks and a budget of 0");
                self.report_with_help(
                    codes::TASK,
                    span,
                    message,
                    "give it a budget of at least its largest task",
                );
            }
            for (at, lock) in step.locks.iter().enumerate() {
                if !self.has(&net.vars, *lock, span, "variable") {
                    continue;
                }
                let var = &net.vars[*lock];
                if !var.ty.is_bool() || var.len.is_some() || step.locks[..at].contains(lock) {
                    let message = format!("`{}` cannot be a lock of the step `{name}`", var.name);
                    self.report_with_help(
                        codes::TASK,
                        span,
                        message,
                        "list plain Boolean variables, each once",
                    );
                }
            }
            for task in &step.tasks {
                if task.cost > step.budget && step.budget > 0 {
                    let (task, cost, budget) = (&task.name, task.cost, step.budget);
                    let message = format!(
                        "the task `{task}` costs {cost}, but the step `{name}` has a budget of {budget}"
                    );
                    self.report_with_help(
                        codes::TASK,
                        task.span,
                        message,
                        "raise the budget, or split the task",
                    );
                }
                self.list(&task.body, Place::Quiet("a task"), ListKind::Task, 0);
            }
        }
    }

    pub(super) fn actions(&mut self) {
        let net = self.net;
        for action in net.actions.values() {
            let (name, span) = (&action.name, action.name.span);
            for ActionUse { step, condition, span, .. } in &action.uses {
                self.has(&net.steps, *step, *span, "step");
                if let Some(condition) = condition {
                    self.condition(condition, Place::Quiet("the condition of an action"));
                }
            }
            if action.duration > 0 && !action.uses.iter().any(|of| of.qualifier.is_timed()) {
                let message = format!(
                    "the action `{name}` has a duration, but none of its qualifiers is timed"
                );
                self.report(codes::ACTION, span, message);
            }
            self.not_too_long(action.duration, span, "the duration of the action");
            self.list(&action.body, Place::Quiet("the body of an action"), ListKind::Free, 0);
        }
        for slot in net.sends.values() {
            self.not_too_long(slot.delay, slot.name.span, "the delay of the send slot");
            if self.has(&net.inputs, slot.event, slot.name.span, "event")
                && !net.inputs[slot.event].kind.is_event()
            {
                let event = &net.inputs[slot.event].name;
                self.report(
                    codes::STATEMENT,
                    slot.name.span,
                    format!("`{event}` is sent, but it is an input, not an event"),
                );
            }
        }
    }

    fn not_too_long(&mut self, ticks: u32, span: Span, what: &str) {
        if i64::from(ticks) > LONGEST {
            let message = format!("{what} is {ticks} ticks; the maximum is {LONGEST}");
            self.report_with_help(codes::DURATION, span, message, "use a longer tick");
        }
    }

    pub(super) fn list(&mut self, list: &[Stmt], place: Place, kind: ListKind, depth: usize) {
        let net = self.net;
        for Stmt { kind: stmt, span } in list {
            let span = *span;
            let foreign = match stmt {
                StmtKind::Assign { var, index, value } => {
                    self.assignment(*var, index.as_ref(), value, span, place);
                    None
                }
                StmtKind::Call { output, arguments } => {
                    self.call(*output, arguments, span, place);
                    None
                }
                StmtKind::If { condition, then, otherwise } => {
                    self.condition(condition, place);
                    if depth + 1 >= DEPTH_LIMIT {
                        self.report(
                            codes::NET_LIMIT,
                            span,
                            format!("`if` is nested more than {DEPTH_LIMIT} levels deep"),
                        );
                    } else {
                        self.list(then, place, kind, depth + 1);
                        self.list(otherwise, place, kind, depth + 1);
                    }
                    None
                }
                StmtKind::Raise(event) => {
                    if self.has(&net.inputs, *event, span, "event")
                        && !net.inputs[*event].kind.is_event()
                    {
                        let name = &net.inputs[*event].name;
                        self.report(
                            codes::STATEMENT,
                            span,
                            format!("`{name}` is raised, but it is an input, not an event"),
                        );
                    }
                    Some("raises an event")
                }
                StmtKind::Send(slot) => {
                    self.has(&net.sends, *slot, span, "send slot");
                    Some("sends an event")
                }
                StmtKind::Cancel(slot) => {
                    self.has(&net.sends, *slot, span, "send slot");
                    Some("cancels a send")
                }
                StmtKind::Code(_) => Some("contains target-language text"),
            };
            if let (Some(what), ListKind::Task) = (foreign, kind) {
                let message = format!("a task {what}, but it may only assign and call");
                self.report_with_help(
                    codes::TASK,
                    span,
                    message,
                    "move it to the entry or exit list of the step",
                );
            }
        }
    }

    fn assignment(
        &mut self,
        var: Id<crate::net::Var>,
        index: Option<&Expr>,
        value: &Expr,
        span: Span,
        place: Place,
    ) {
        if !self.has(&self.net.vars, var, span, "variable") {
            return;
        }
        let var = &self.net.vars[var];
        match (index, var.len) {
            (None, None) => {}
            (None, Some(len)) => {
                let message =
                    format!("`{}` is an array of {len} elements, so an index is needed", var.name);
                self.report_with_help(
                    codes::INDEX,
                    span,
                    message,
                    "assign to one element, for example `v[0] := 0`",
                );
            }
            (Some(_), None) => {
                self.report(codes::INDEX, span, format!("`{}` is not an array", var.name))
            }
            (Some(index), Some(len)) => {
                let found = self.value(index, place, Type::Int { lo: 0, hi: 0 });
                if let Some(Type::Int { lo, hi }) = found
                    && (lo < 0 || hi >= i64::from(len))
                {
                    let message = format!(
                        "the index is {}, but `{}` has elements 0..{}",
                        values(lo, hi),
                        var.name,
                        i64::from(len) - 1
                    );
                    self.report_with_help(codes::INDEX, index.span, message, index_help(lo, hi));
                }
            }
        }
        self.value(value, place, var.ty);
    }

    fn call(
        &mut self,
        id: OutputId,
        arguments: &[GenericExpr<crate::net::Leaf>],
        span: Span,
        place: Place,
    ) {
        if !self.has(&self.net.outputs, id, span, "output") {
            return;
        }
        let output = &self.net.outputs[id];
        let name = &output.name;
        if let Driver::Extern { params, calls } = &output.driver {
            if !calls.is_empty() {
                let message = format!("`{name}` is called here, but a step calls it continuously");
                self.report_with_help(
                    codes::DRIVER,
                    span,
                    message,
                    "declare a second extern action for one of the two uses",
                );
            }
            self.arguments(output, params, arguments, span, place);
        } else {
            self.report(
                codes::STATEMENT,
                span,
                format!("`{name}` is called, but it is not an extern action"),
            );
        }
    }
}
