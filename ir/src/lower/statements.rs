//! Statement lists: assignments, events, calls and choices.

use super::codes;
use super::context::{Lowering, Outcome, Role, ScopeId, Symbol};
use super::place::Place;
use crate::chart::{self, Path};
use crate::diag::{Diagnostic, nearest};
use crate::expr::{Expr, Type};
use crate::interval::{TypeError, TypeErrorKind};
use crate::net::{
    Block, Input, InputId, InputKind, Leaf, Meta, OutputId, Param, SendId, SendSlot, StepId,
    StepKind, Stmt, StmtKind, VarId,
};
use crate::span::{Name, Span};

/// The kind of list.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ListKind {
    /// A list of a step, transition or reaction: all statements are allowed.
    Change,
    /// A list of a controlled action: all statements, but no edges and events in conditions (semantics §3.7).
    Body,
    /// A list of a task: only assignments and calls are allowed.
    Task,
}

impl<'a> Lowering<'a> {
    /// Lowers a list; a statement with an error is reported and skipped.
    pub(super) fn block(
        &mut self,
        scope: ScopeId,
        kind: ListKind,
        drawn: &'a [chart::Stmt],
    ) -> Block {
        let place = match kind {
            ListKind::Change => Place::list(scope),
            ListKind::Body => Place::level(scope, "the list of a controlled action"),
            ListKind::Task => Place::level(scope, "a task"),
        };
        drawn.iter().filter_map(|stmt| self.stmt(&place, kind, stmt).ok()).collect()
    }

    fn stmt(&mut self, place: &Place<'_>, kind: ListKind, drawn: &'a chart::Stmt) -> Outcome<Stmt> {
        let span = drawn.span;
        let kind = match &drawn.kind {
            chart::StmtKind::Assign { target, index, value } => {
                self.assign(place, target, index.as_ref(), value)?
            }
            chart::StmtKind::Call { function, arguments } => {
                let symbol = self.wanting("extern action", |lowering| {
                    lowering.symbol_of(place.scope, function)
                })?;
                let output = if let Symbol::Output(output) = symbol
                    && self.net.outputs[output].is_extern()
                {
                    output
                } else {
                    let wanted = "an extern action";
                    return Err(self.wrong_kind(function.span, function, symbol, wanted));
                };
                let arguments = self.arguments(place, output, function, arguments, span)?;
                StmtKind::Call { output, arguments }
            }
            chart::StmtKind::If { condition, then, otherwise } => {
                let condition = self.condition(condition, place);
                let then = self.block(place.scope, kind, then);
                let otherwise = self.block(place.scope, kind, otherwise);
                StmtKind::If { condition: condition?, then, otherwise }
            }
            chart::StmtKind::Raise(_)
            | chart::StmtKind::Send { .. }
            | chart::StmtKind::Cancel(_)
                if kind == ListKind::Task =>
            {
                return Err(self.report(
                    Diagnostic::error(codes::TASK_BODY, "a task can only contain assignments and calls")
                        .at(span, "")
                        .help("set a variable in the task, and raise the event in a transition that reads the variable"),
                ));
            }
            chart::StmtKind::Raise(event) => StmtKind::Raise(self.event(place.scope, event)?),
            chart::StmtKind::Send { event, after, slot } => {
                self.only_statecharts_send(span, "send")?;
                let event_id = self.event(place.scope, event)?;
                match slot {
                    Some(slot) => StmtKind::Send(self.slot(place.scope, slot)?),
                    None => {
                        let delay = self.ticks(after.unwrap_or(0), span)?;
                        StmtKind::Send(self.new_slot(
                            &format!("{}_send", event.text),
                            event_id,
                            delay,
                            span,
                        ))
                    }
                }
            }
            chart::StmtKind::Cancel(slot) => {
                self.only_statecharts_send(span, "cancel")?;
                StmtKind::Cancel(self.slot(place.scope, slot)?)
            }
            chart::StmtKind::Code(code) => StmtKind::Code(code.clone()),
        };
        Ok(Stmt { kind, span })
    }

    fn assign(
        &mut self,
        place: &Place<'_>,
        target: &chart::Path,
        index: Option<&chart::Expr>,
        drawn: &chart::Expr,
    ) -> Outcome<StmtKind> {
        // Both sides are lowered before an error in one of them stops the statement.
        let value = self.typed(drawn, place);
        let index = index.map(|index| self.typed(index, place));
        let var = self.assigned(place.scope, target)?;
        let (ty, len) = (self.net.vars[var].ty, self.net.vars[var].len);
        let index = match (index.transpose()?, len) {
            (None, None) => None,
            (Some((index, ty)), Some(len)) => Some(self.index(index, ty, len)?),
            (None, Some(_)) => {
                let kind = TypeErrorKind::ArrayWithoutIndex;
                return Err(self.report_type(&TypeError { span: target.span(), kind }));
            }
            (Some(_), None) => {
                let kind = TypeErrorKind::NotAnArray;
                return Err(self.report_type(&TypeError { span: target.span(), kind }));
            }
        };
        let (value, value_type) = value?;
        self.fits(&value, value_type, ty, &format!("`{target}`"))?;
        Ok(StmtKind::Assign { var, index, value })
    }

    fn index(&mut self, index: Expr<Leaf>, ty: Type, len: u32) -> Outcome<Expr<Leaf>> {
        let kind = match ty {
            Type::Bool => TypeErrorKind::IntExpected,
            Type::Int { lo, hi } if lo < 0 || hi >= i64::from(len) => {
                TypeErrorKind::IndexOutOfArray { lo, hi, len }
            }
            Type::Int { .. } => return Ok(index),
        };
        Err(self.report_type(&TypeError { span: index.span, kind }))
    }

    /// The variable that an assignment changes.
    fn assigned(&mut self, scope: ScopeId, target: &chart::Path) -> Outcome<VarId> {
        match self.wanting("var", |lowering| lowering.symbol(scope, target))? {
            Symbol::Var(var) => Ok(var),
            Symbol::Output(output) => match self.roles[output.index()] {
                Role::Stored(var) => Ok(var),
                Role::Extern => Err(self.wrong_kind(
                    target.span(),
                    target,
                    Symbol::Output(output),
                    "a variable or an output",
                )),
                // Pass `roles` has already reported an assigned output with another role.
                Role::Continuous | Role::Mealy | Role::Controlled(_) | Role::Broken => {
                    Err(self.already_told())
                }
            },
            symbol @ Symbol::Input(_) => {
                let kind = self.kind(symbol);
                let help = if kind == "an event" {
                    format!("write `raise {target}`")
                } else {
                    "store the value in a variable declared with `var`".to_owned()
                };
                Err(self.report(
                    Diagnostic::error(
                        codes::WRONG_KIND,
                        format!("cannot assign to `{target}`: it is {kind}"),
                    )
                    .at(target.span(), "a variable or an output is needed here")
                    .help(help),
                ))
            }
            symbol @ (Symbol::Const(_)
            | Symbol::Action(_)
            | Symbol::Timer(_)
            | Symbol::Step(_)
            | Symbol::MacroStep(_)
            | Symbol::Macro(_)
            | Symbol::Transition(_)
            | Symbol::Chart(_)
            | Symbol::History(_)
            | Symbol::Alias(_)
            | Symbol::Broken) => {
                Err(self.wrong_kind(target.span(), target, symbol, "a variable or an output"))
            }
        }
    }

    /// Checks that a value has the kind of its target, and warns if it is always out of range.
    fn fits(
        &mut self,
        value: &Expr<Leaf>,
        value_type: Type,
        target: Type,
        name: &str,
    ) -> Outcome<()> {
        let kind = match (value_type, target) {
            (Type::Bool, Type::Bool) => return Ok(()),
            (Type::Int { lo, hi }, Type::Bool) => TypeErrorKind::BoolExpected { lo, hi },
            (Type::Bool, Type::Int { .. }) => TypeErrorKind::IntExpected,
            (Type::Int { lo, hi }, Type::Int { lo: least, hi: most }) => {
                if hi < least || lo > most {
                    let stored = if hi < least { least } else { most };
                    self.report(
                        Diagnostic::warning(
                            codes::NEVER_FITS,
                            {
                                let value = if lo == hi { lo.to_string() } else { format!("{lo}..{hi}") };
                                format!("{name} always becomes {stored}: the value is {value}, but the range is {least}..{most}")
                            },
                        )
                        .at(value.span, "never within the range")
                        .help("an assignment stores the nearest bound; declare a larger range if this is not intended"),
                    );
                }
                return Ok(());
            }
        };
        Err(self.report_type(&TypeError { span: value.span, kind }))
    }

    /// The arguments of a call, one for each parameter.
    pub(super) fn arguments(
        &mut self,
        place: &Place<'_>,
        output: OutputId,
        name: &Name,
        drawn: &[chart::Expr],
        span: Span,
    ) -> Outcome<Vec<Expr<Leaf>>> {
        let params: Vec<Param> = self.net.outputs[output].driver.params().to_vec();
        let lowered: Vec<Outcome<(Expr<Leaf>, Type)>> =
            drawn.iter().map(|argument| self.typed(argument, place)).collect();
        if drawn.len() != params.len() {
            let count = |n: usize| match n {
                0 => "no arguments".to_owned(),
                1 => "1 argument".to_owned(),
                n => format!("{n} arguments"),
            };
            let declared = self.net.outputs[output].meta.span;
            return Err(self.report(
                Diagnostic::error(
                    codes::CALL_ARGUMENTS,
                    format!("`{name}` takes {}, found {}", count(params.len()), count(drawn.len())),
                )
                .at(span, "")
                .at(declared, "declared here")
                .help("write one argument for each parameter of the declaration"),
            ));
        }
        let mut arguments = Vec::with_capacity(drawn.len());
        let mut failed = None;
        for (index, (argument, param)) in lowered.into_iter().zip(&params).enumerate() {
            let label = if param.name.is_empty() {
                format!("argument {} of `{name}`", index + 1)
            } else {
                format!("`{}` of `{name}`", param.name)
            };
            match argument
                .and_then(|(value, ty)| self.fits(&value, ty, param.ty, &label).map(|()| value))
            {
                Ok(value) => arguments.push(value),
                Err(reported) => failed = Some(reported),
            }
        }
        failed.map_or(Ok(arguments), Err)
    }

    /// The event with this name.
    pub(super) fn event(&mut self, scope: ScopeId, name: &Name) -> Outcome<InputId> {
        if self.is_statechart()
            && let Some(done) = done_event(self, scope, name)
        {
            return done;
        }
        let symbol = self.wanting("event", |lowering| lowering.symbol_of(scope, name))?;
        if let Symbol::Input(input) = symbol
            && self.net.inputs[input].kind.is_event()
        {
            return Ok(input);
        }
        Err(self.wrong_kind(name.span, name, symbol, "an event"))
    }

    fn only_statecharts_send(&mut self, span: Span, word: &str) -> Outcome<()> {
        if self.is_statechart() {
            return Ok(());
        }
        Err(self.report(
            Diagnostic::error(codes::CHART_KIND, format!("`{word}` is allowed only in a statechart"))
                .at(span, "")
                .help("wait in a step with `after`, or write `conflict inner-first` to make it a statechart"),
        ))
    }

    /// The slot with this name; the pass `roles` has already collected all slots.
    fn slot(&mut self, scope: ScopeId, name: &Name) -> Outcome<SendId> {
        let mut next = Some(scope);
        while let Some(scope) = next {
            if let Some(&index) = self.slots.get(&(scope, name.text.as_str())) {
                let slot = self.slot_list[index];
                if let Some(id) = slot.id {
                    return Ok(id);
                }
                let full = format!("{}{}", self.scopes[scope].prefix, name.text);
                let id = self.new_slot(&full, slot.event, slot.delay, slot.span);
                self.slot_list[index].id = Some(id);
                return Ok(id);
            }
            next = self.scopes[scope].parent;
        }
        let known: Vec<&str> = self.slots.keys().map(|(_, name)| *name).collect();
        let mut finding =
            Diagnostic::error(codes::UNKNOWN_NAME, format!("no send is called `{name}`"))
                .at(name.span, "");
        finding = finding.near(
            name.span,
            nearest(&name.text, known),
            format!("name the send: `send e after 2 s as {name}`"),
        );
        Err(self.report(finding))
    }

    fn new_slot(&mut self, base: &str, event: InputId, delay: u32, span: Span) -> SendId {
        let name = Name::new(self.fresh_name(base), span);
        let meta = Meta { span, ..Meta::default() };
        self.net.sends.push(SendSlot { name, event, delay, meta })
    }
}

/// The event `done.state.P`, created at its first use; `None` if the name does not have this form.
fn done_event(
    lowering: &mut Lowering<'_>,
    scope: ScopeId,
    name: &Name,
) -> Option<Outcome<InputId>> {
    let owner = name.text.strip_prefix("done.state.")?;
    let names = owner.split('.').map(|part| Name::new(part, name.span)).collect();
    let symbol = match lowering.symbol(scope, &Path { names }) {
        Ok(symbol) => symbol,
        Err(reported) => return Some(Err(reported)),
    };
    let has_children = |state: StepId| {
        matches!(lowering.net.steps[state].kind, StepKind::Composite | StepKind::Parallel)
    };
    let Symbol::Step(state) = symbol else {
        return Some(Err(lowering.wrong_kind(name.span, name, symbol, "a state with children")));
    };
    if !has_children(state) {
        let wanted = "a state with children";
        return Some(Err(lowering.wrong_kind(name.span, name, symbol, wanted)));
    }
    if let Some(event) = lowering.net.steps[state].done_event {
        return Some(Ok(event));
    }
    let full = format!("done.state.{}", lowering.net.steps[state].name);
    lowering.taken.insert(full.clone());
    let event = lowering.net.inputs.push(Input {
        name: Name::new(full, name.span),
        ty: crate::expr::Type::Bool,
        kind: InputKind::InternalEvent,
        synchronous: false,
        meta: Meta { span: name.span, ..Meta::default() },
    });
    lowering.net.steps[state].done_event = Some(event);
    Some(Ok(event))
}
