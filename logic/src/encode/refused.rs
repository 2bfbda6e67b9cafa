//! Constructs that a chip does not support: calls with arguments, several calls in one reaction, target-language text.

use super::Encoder;
use crate::codes;
use grafsynth_ir::Span;
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::net::{self, Net};
use grafsynth_ir::program::ResetEffect;
use std::collections::BTreeMap;

impl Encoder<'_> {
    pub(super) fn refuse_reset_effects(&mut self) {
        let mut called: BTreeMap<net::OutputId, usize> = BTreeMap::new();
        for effect in &self.program.reset_effects {
            match effect {
                ResetEffect::Call(output, arguments) => {
                    if !arguments.is_empty() {
                        self.refuse_arguments(*output, self.net.outputs[*output].meta.span);
                    }
                    *called.entry(*output).or_default() += 1;
                }
                ResetEffect::Code(_) => self.refuse_code(),
            }
        }
        for (output, times) in called {
            if times > 1 {
                let output = &self.net.outputs[output];
                let message = format!(
                    "`{}` is called {times} times at reset, but a chip has only one strobe pin for it",
                    output.name
                );
                self.diagnostics.push(
                    Diagnostic::error(codes::CALLED_TWICE, message)
                        .at(output.meta.span, "this action")
                        .help("call it from one initial step only, or build for `c`"),
                );
            }
        }
    }

    pub(super) fn refuse_arguments(&mut self, output: net::OutputId, span: Span) {
        let name = &self.net.outputs[output].name;
        let message = format!(
            "the call of `{name}` has arguments, but a strobe pin of a chip cannot carry arguments"
        );
        let finding = Diagnostic::error(codes::CALL_ARGUMENTS, message)
            .at(span, "called with arguments")
            .help("store the value in a separate output and call the action without arguments, or build for `c`");
        // Unrolled micro-steps reach this point more than once.
        if !self.diagnostics.contains(&finding) {
            self.diagnostics.push(finding);
        }
    }

    pub(super) fn refuse_code(&mut self) {
        if self.code_reported {
            return;
        }
        self.code_reported = true;
        let spans = code_places(self.net);
        let mut diagnostic = Diagnostic::error(
            codes::VERBATIM,
            "the chart contains verbatim code, which a chip cannot run".to_owned(),
        )
        .help("write the action with assignments, make it an `extern action`, or build for `c`");
        for span in spans {
            diagnostic = diagnostic.at(span, "verbatim code");
        }
        self.diagnostics.push(diagnostic);
    }
}

/// The location of every verbatim text in the net.
fn code_places(net: &Net) -> Vec<Span> {
    fn in_block(block: &net::Block, spans: &mut Vec<Span>) {
        for stmt in block {
            match &stmt.kind {
                net::StmtKind::Code(_) => spans.push(stmt.span),
                net::StmtKind::If { then, otherwise, .. } => {
                    in_block(then, spans);
                    in_block(otherwise, spans);
                }
                net::StmtKind::Assign { .. }
                | net::StmtKind::Raise(_)
                | net::StmtKind::Send(_)
                | net::StmtKind::Cancel(_)
                | net::StmtKind::Call { .. } => {}
            }
        }
    }
    let mut spans = Vec::new();
    for step in net.steps.values() {
        if !step.code.is_empty() {
            spans.push(step.meta.span);
        }
        let tasks = step.tasks.iter().map(|task| &task.body);
        for block in [&step.entry, &step.exit, &step.initial_content].into_iter().chain(tasks) {
            in_block(block, &mut spans);
        }
    }
    for transition in net.transitions.values() {
        in_block(&transition.actions, &mut spans);
    }
    for action in net.actions.values() {
        in_block(&action.body, &mut spans);
    }
    spans.sort_unstable();
    spans.dedup();
    spans
}
