//! Function blocks with charts that are called by a program without a chart.
//!
//! ```text
//! PROGRAM p                          action scan_body      limit := limit AND hot;
//!   limit := limit AND hot;          the actions of the block's chart, its variables and steps under `lights.`
//!   lights(ON := switch);            action scan_body_2    lamp := lights.GREEN;
//!   lamp := lights.GREEN;
//! END_PROGRAM
//! ```
//! On a controller, such a chart evolves when it is called. In a net, all charts evolve at the beginning of the reaction. Both are the
//! same if the block is called once in every scan and its conditions read nothing that the program changes before the call: only inputs
//! of the program, constants and the block's own state. Everything else is refused.

use grafsynth_ir::chart::{Action, ActionHow, Block, Item, Step, StepItem, StepItemKind, StepRole};
use grafsynth_ir::diag::ErrorReported;
use grafsynth_ir::net::Meta;
use grafsynth_ir::{Name, Span};

use super::calls::argument;
use super::context::{Binding, Elaborator, FrameId, ObjectKind, Outcome, bodies_of};
use super::jump_elimination::{self, Leaves};
use super::usage::Usage;
use super::value::{Value, reads_only};
use crate::st::ast::{self, Arg, Body, Pou, Section, StmtKind};
use crate::st::symbol::Symbol;

/// The parts of a program without a chart.
struct Pieces {
    items: Vec<Item>,
    /// The names of the actions that contain its statements.
    names: Vec<Name>,
    /// Statements that are not yet part of an action.
    open: Block,
}

impl<'a> Elaborator<'a> {
    /// Builds a program without a chart: one step whose actions run in every scan, and between them the charts of the blocks that the
    /// program calls.
    pub(super) fn one_step(
        &mut self,
        frame: FrameId,
        pou: &'a Pou,
        list: &'a [ast::Stmt],
        usage: &Usage,
    ) -> Vec<Item> {
        let span = pou.name.span;
        self.bodies = bodies_of(&pou.actions);
        let mut pieces = Pieces { items: Vec::new(), names: Vec::new(), open: Block::new() };
        let calls: Vec<Option<(usize, usize)>> =
            list.iter().map(|stmt| self.calls_chart(frame, stmt)).collect();
        let leaves = jump_elimination::has(list, Leaves::Return);
        if leaves || calls.iter().all(Option::is_none) {
            self.body(frame, list, span, &mut pieces.open);
        } else {
            let mut seen = Vec::new();
            for (stmt, call) in list.iter().zip(calls) {
                let (StmtKind::Call { arguments, .. }, Some((object, index))) = (&stmt.kind, call)
                else {
                    let _ = self.stmt(frame, stmt, &mut pieces.open);
                    continue;
                };
                if seen.contains(&object) {
                    self.refused(
                        "a second call of a function block with a chart",
                        stmt.span,
                        "call it once in each scan, or declare two instances",
                    );
                    continue;
                }
                seen.push(object);
                self.close(&mut pieces, span);
                let called = (object, index, arguments.as_slice());
                let _ = self.call_chart(frame, called, usage, stmt.span, &mut pieces);
            }
        }
        if !pieces.open.is_empty() || pieces.names.is_empty() {
            self.close_always(&mut pieces, span);
        }
        let step = Name::new(self.free_name("running"), span);
        let uses = pieces.names.into_iter().map(|target| {
            let how = ActionHow::Bare;
            let kind = StepItemKind::Action { target, arguments: None, how, condition: None };
            StepItem { kind, span }
        });
        let mut items = pieces.items;
        items.push(Item::Step(Step {
            name: step,
            role: StepRole::Initial,
            body: uses.collect(),
            meta: Meta { span, ..Meta::default() },
            ..Step::default()
        }));
        items
    }

    /// Makes the statements collected so far an action, if there are any.
    fn close(&mut self, pieces: &mut Pieces, span: Span) {
        if !pieces.open.is_empty() {
            self.close_always(pieces, span);
        }
    }

    fn close_always(&mut self, pieces: &mut Pieces, span: Span) {
        let name = Name::new(self.free_name("scan_body"), span);
        let body = std::mem::take(&mut pieces.open);
        let meta = Meta { span, ..Meta::default() };
        pieces.items.push(Item::Action(Action { name: name.clone(), body, meta }));
        pieces.names.push(name);
    }

    /// The instance and the unit of a call of a block with a chart.
    fn calls_chart(&self, frame: FrameId, stmt: &ast::Stmt) -> Option<(usize, usize)> {
        let StmtKind::Call { target, .. } = &stmt.kind else { return None };
        let ast::ExprKind::Name(name) = &target.kind else { return None };
        let object = self.object(frame, &name.id)?;
        let ObjectKind::Block(index) = self.objects[object].kind else { return None };
        matches!(self.unit(index).body, Body::Sfc(_)).then_some((object, index))
    }

    /// Adds the chart of a block next to the program's own step.
    fn call_chart(
        &mut self,
        frame: FrameId,
        (object, index, arguments): (usize, usize, &[Arg]),
        usage: &Usage,
        span: Span,
        pieces: &mut Pieces,
    ) -> Outcome<()> {
        let pou = self.unit(index);
        let Body::Sfc(chart) = &pou.body else { return Err(ErrorReported) };
        let arguments = self.named_arguments(index, arguments, span)?;
        if let Some(enable) = arguments.iter().find(|one| one.is_for("EN") || one.is_for("ENO")) {
            return Err(self.refused(
                &format!("EN or ENO in a call of `{}`, a function block with a chart,", pou.name),
                enable.value.span,
                "a chart runs in every scan: give it an input that its transitions test",
            ));
        }
        let prefix = self.objects[object].prefix.clone();
        self.check_chart(pou, &prefix, usage, span)?;
        let inside = self.objects[object].frame;
        for var in &pou.vars {
            let Some(argument) = argument(&arguments, var) else { continue };
            if var.section == Section::InOut {
                return Err(self.refused(
                    "in-out parameters of blocks with charts",
                    argument.value.span,
                    "use inputs and outputs",
                ));
            }
            let (_, value) = self.input(frame, object, var, argument)?;
            let is_bound = matches!(self.own(inside, &var.name.id), None | Some(Binding::Value(_)));
            if !is_bound || !self.is_input(&value) {
                return Err(self.refused(
                    &format!("`{}` of `{prefix}` as an expression that changes within a scan", var.name),
                    argument.value.span,
                    "the chart runs at the beginning of the scan: pass only inputs of the program and constants",
                ));
            }
            self.bind(inside, &var.name.id, Binding::Value(value));
        }
        let outside = std::mem::take(&mut self.bodies);
        let before = std::mem::replace(&mut self.prefix, format!("{prefix}."));
        let items = self.sfc(inside, chart);
        (self.bodies, self.prefix) = (outside, before);
        pieces.items.extend(items);
        for argument in arguments.iter().filter(|one| one.is_output) {
            self.pass_output(frame, object, argument, &mut pieces.open)?;
        }
        Ok(())
    }

    /// Refuses blocks whose chart would see changes that the program makes before the call.
    fn check_chart(&mut self, pou: &Pou, prefix: &str, usage: &Usage, span: Span) -> Outcome<()> {
        if pou.options != ast::Options::default() {
            return Err(self.refused(
                &format!("a call of `{}`, a function block with settings in its chart,", pou.name),
                span,
                "make the block the design, or move the settings to the program",
            ));
        }
        if usage.assigned.contains(&Symbol::of(prefix)) {
            return Err(self.refused(
                &format!("assignments to variables of `{prefix}`, a function block with a chart,"),
                span,
                "pass them as inputs in the call",
            ));
        }
        let inner = self.usage(pou);
        let own = pou.own_names();
        let shared = self.library.globals.iter().map(|var| &var.name.id).find(|name| {
            !own.contains(name) && inner.read.contains(*name) && usage.assigned.contains(*name)
        });
        if let Some(shared) = shared {
            return Err(self.refused(
                &format!(
                    "a call of `{}`, whose chart reads `{shared}`, a variable that the program changes,",
                    pou.name
                ),
                span,
                "pass it as an input, or make the block a program that runs in parallel",
            ));
        }
        Ok(())
    }

    /// Whether a value contains only inputs and constants, so that it does not change within a scan.
    fn is_input(&self, value: &Value) -> bool {
        reads_only(value, |names| names.len() == 1 && self.inputs.contains(&names[0].text))
    }
}
