//! Names: legal in a trace, and unique (invariants 2 and 3).

use super::Checker;
use crate::codes;
use crate::diag::Diagnostic;
use crate::net::{Driver, Evolution, InputKind, VarOrigin};
use crate::span::{Name, Span};
use std::collections::BTreeMap;

/// Characters that separate or quote something in traces, stimuli and the text form.
const FORBIDDEN: &str = ",;\"'`#()[]{}";

/// The names in use and their owners.
type Taken<'a> = BTreeMap<&'a str, (&'static str, Span)>;

impl<'a> Checker<'a> {
    pub(super) fn names(&mut self) {
        let net = self.net;
        self.fit(&net.name, "chart");

        let mut steps = Taken::new();
        for step in net.steps.values() {
            self.claim(&mut steps, &step.name, "step");
        }
        for drawn in &net.macros {
            self.claim(&mut steps, &drawn.name, "macro-step");
        }
        self.signals(&steps);

        self.claim_all(net.parts.values().map(|part| &part.name), "partial chart");
        self.claim_all(net.transitions.values().map(|transition| &transition.name), "transition");
        self.claim_all(net.actions.values().map(|action| &action.name), "action");
        self.claim_all(net.sends.values().map(|slot| &slot.name), "send slot");
        self.claim_all(net.histories.values().map(|history| &history.name), "history");
        for step in net.steps.values().filter(|step| !step.tasks.is_empty()) {
            self.claim_all(step.tasks.iter().map(|task| &task.name), "task");
        }
    }

    /// Checks the names of inputs, outputs, variables and timers, which share one set of names.
    fn signals(&mut self, steps: &Taken<'a>) {
        let net = self.net;
        let mut taken = Taken::new();
        let mut columns: Vec<&'a Name> = Vec::new();
        for input in net.inputs.values() {
            self.claim(&mut taken, &input.name, "input or event");
            if input.kind != InputKind::InternalEvent {
                columns.push(&input.name);
            }
        }
        for output in net.outputs.values() {
            self.claim(&mut taken, &output.name, "output");
            columns.push(&output.name);
        }
        // The memory of a stored output usually has the output's name.
        let mut memory_of: BTreeMap<_, &str> = BTreeMap::new();
        for output in net.outputs.values() {
            if let Driver::Stored(var) = output.driver {
                memory_of.insert(var, output.name.text.as_str());
            }
        }
        for (id, var) in net.vars.iter() {
            if var.origin != VarOrigin::StoredOutput
                || memory_of.get(&id) != Some(&var.name.text.as_str())
            {
                self.claim(&mut taken, &var.name, "variable");
            }
            if var.origin == VarOrigin::Declared {
                columns.push(&var.name);
            }
        }
        for timer in net.timers.values() {
            self.claim(&mut taken, &timer.name, "timer");
        }
        let mut said: BTreeMap<&str, Span> = BTreeMap::new();
        for property in net.properties.iter().filter(|property| !property.name.is_empty()) {
            let (name, span) = (property.name.as_str(), property.meta.span);
            let Some(first) = said.insert(name, span) else { continue };
            let message = format!("two properties are called `{name}`");
            self.out.push(
                Diagnostic::error(codes::NAME_TWICE, message)
                    .at(span, "the second")
                    .at(first, "the first")
                    .help("rename one of them"),
            );
        }
        let stable = matches!(net.settings.evolution, Evolution::Stable { .. });
        for name in columns {
            let text = name.text.as_str();
            if matches!(text, "dt" | "scan" | "steps") || (text == "fault" && stable) {
                let message = format!("`{text}` is a column that every trace has");
                self.report_with_help(codes::BAD_NAME, name.span, message, "choose another name");
            }
        }
        for (text, (what, span)) in taken {
            if let Some((prefix, "active" | "t" | "T" | "done")) = text.rsplit_once('.')
                && let Some((owner, other)) = steps.get(prefix)
            {
                let message = format!(
                    "the {what} `{text}` has the same name as a value of the {owner} `{prefix}`"
                );
                self.out.push(
                    Diagnostic::error(codes::NAME_TWICE, message)
                        .at(span, "")
                        .at(*other, "declared here"),
                );
            }
        }
    }

    fn claim_all(&mut self, names: impl Iterator<Item = &'a Name>, what: &'static str) {
        let mut taken = Taken::new();
        for name in names {
            self.claim(&mut taken, name, what);
        }
    }

    fn claim(&mut self, taken: &mut Taken<'a>, name: &'a Name, what: &'static str) {
        if !self.fit(name, what) {
            return;
        }
        if let Some((other, span)) = taken.get(name.text.as_str()) {
            let message = if *other == what {
                format!("two {what}s are called `{name}`")
            } else {
                format!("the {what} `{name}` has the same name as another {other}")
            };
            let diagnostic =
                Diagnostic::error(codes::NAME_TWICE, message).at(name.span, "the second");
            self.out.push(diagnostic.at(*span, "the first").help("rename one of them"));
        } else {
            taken.insert(&name.text, (what, name.span));
        }
    }

    fn fit(&mut self, name: &Name, what: &str) -> bool {
        let wrong = name
            .text
            .chars()
            .find(|c| c.is_whitespace() || c.is_control() || FORBIDDEN.contains(*c));
        match wrong {
            _ if name.text.is_empty() => {
                self.report(codes::BAD_NAME, name.span, format!("a {what} has an empty name"));
                false
            }
            Some(wrong) => {
                let message = format!(
                    "the name {:?} of a {what} contains the character {wrong:?}",
                    name.text
                );
                self.report_with_help(
                    codes::BAD_NAME,
                    name.span,
                    message,
                    "use letters, digits, `_` and `.`",
                );
                false
            }
            None => true,
        }
    }
}
