//! The items of a step as rows of an action block of IEC 61131-3: qualifier, action, indicator.
//!
//! ```text
//! R                    N        R                       entry { done := true }   P1   done := TRUE   done
//! R if a or b          N        R IF a OR b             R for 1500 ms            L T#1500ms   R
//! ```

use crate::foreign::{Foreign, note_expr, note_list};
use crate::notation::{Notation, Signs, literal, quoted};
use crate::symbol::Action;
use crate::text::Rich;
use grafsynth_ir::Gather;
use grafsynth_ir::chart::{
    ActionHow, Expr, ForceOrder, Leaf, Path, StepItem, StepItemKind, Stmt, StmtKind, statements,
};
use grafsynth_ir::expr::ExprKind;
use grafsynth_ir::net::Qualifier;
use std::collections::BTreeSet;

/// What a row depends on besides its item.
pub(crate) struct Context<'a> {
    pub(crate) notation: &'a Notation,
    /// The Boolean outputs and variables of the design.
    pub(crate) booleans: &'a BTreeSet<String>,
    /// The outputs and actions that the control of IEC 61131-3 runs, with its own timers for D and L; `None` for all.
    pub(crate) controlled: Option<&'a BTreeSet<String>>,
    /// Receives the notation that IEC 61131-3 lacks.
    pub(crate) foreign: &'a mut BTreeSet<Foreign>,
}

/// The row of an item; `None` for a priority or budget, which is not an action.
pub(crate) fn row(context: &mut Context<'_>, item: &StepItem) -> Option<Action> {
    let notation = context.notation;
    match &item.kind {
        StepItemKind::Action { target, arguments, how, condition } => {
            let mut text = notation.word(&target.text);
            if let Some(arguments) = arguments {
                arguments.iter().for_each(|one| note_expr(context.foreign, one));
                let all: Vec<String> =
                    arguments.iter().map(|one| notation.expr(one).text).collect();
                text.push_str(&format!("({})", all.join(", ")));
            }
            if let Some(condition) = condition {
                note_expr(context.foreign, condition);
                context.foreign.insert(Foreign::Condition);
                let word = if notation.signs == Signs::St { "IF" } else { "if" };
                text.push_str(&format!(" {word} {}", notation.expr(condition).text));
            }
            Some(action(context.qualifier(&target.text, *how), text))
        }
        StepItemKind::Entry(list) => Some(context.list("P1", list)),
        StepItemKind::Exit(list) => Some(context.list("P0", list)),
        StepItemKind::On { events, guard, actions } => {
            context.foreign.insert(Foreign::Reaction);
            let events = events.iter().map(|name| {
                Expr::new(ExprKind::Leaf(Leaf::Name(Path::from(name.clone()))), name.span)
            });
            let events: Vec<Expr> = events.collect();
            let any = (!events.is_empty()).then(|| Expr::or(events));
            Some(context.list("on", &guarded(any, guard.as_ref(), actions, item)))
        }
        StepItemKind::Priority(_) | StepItemKind::Budget(_) => None,
        StepItemKind::Task { name, cost, body } => {
            context.foreign.insert(Foreign::Task);
            let cost = cost.map(|cost| format!(" cost {cost}")).unwrap_or_default();
            Some(context.list(&format!("task {}{cost}", notation.word(&name.text)), body))
        }
        StepItemKind::Code(code) => {
            context.foreign.insert(Foreign::Code);
            let text = format!("{} {}", notation.word(&code.language), quoted(&code.text));
            Some(action("code".to_owned(), text))
        }
        StepItemKind::Force { target, order } => {
            context.foreign.insert(Foreign::Forcing);
            let text = forced(notation, target, order);
            Some(action("force".to_owned(), text))
        }
    }
}

/// A forcing order: the chart and its situation.
pub(crate) fn forced(notation: &Notation, target: &Path, order: &ForceOrder) -> String {
    let order = match order {
        ForceOrder::Situation(steps) => {
            let steps: Vec<String> = steps.iter().map(|step| notation.path(step)).collect();
            steps.join(", ")
        }
        ForceOrder::Init => "INIT".to_owned(),
        ForceOrder::Hold => "*".to_owned(),
    };
    format!("G {} {{{order}}}", notation.path(target))
}

impl Context<'_> {
    /// The letters of the qualifier with its time.
    fn qualifier(&mut self, target: &str, how: ActionHow) -> String {
        let (qualifier, ns) = match how {
            ActionHow::Bare => (Qualifier::N, None),
            ActionHow::After(ns) => (Qualifier::D, Some(ns)),
            ActionHow::For(ns) => (Qualifier::L, Some(ns)),
            ActionHow::Qualified(qualifier, ns) => (qualifier, ns),
        };
        // Everything else is continuous: `after` and `for` compare the time of the step.
        if matches!(how, ActionHow::After(_) | ActionHow::For(_))
            && self.controlled.is_some_and(|names| !names.contains(target))
        {
            self.foreign.insert(Foreign::StepTime);
        }
        let time = ns.map(|ns| format!(" {}", literal(ns))).unwrap_or_default();
        format!("{}{time}", qualifier.letters())
    }

    /// A list of statements; its indicator is the only Boolean variable or output that it assigns.
    fn list(&mut self, qualifier: &str, list: &[Stmt]) -> Action {
        note_list(self.foreign, list);
        let assigned: BTreeSet<&str> = statements(list).filter_map(assigned).gather();
        let mut booleans = assigned.into_iter().filter(|name| self.booleans.contains(*name));
        let indicator = match (booleans.next(), booleans.next()) {
            (Some(only), None) => self.notation.word(only),
            _ => String::new(),
        };
        Action { indicator, ..action(qualifier.to_owned(), self.notation.block(list)) }
    }
}

/// The variable or output of the chart that a statement assigns.
fn assigned(stmt: &Stmt) -> Option<&str> {
    match &stmt.kind {
        StmtKind::Assign { target, index: None, .. } => match target.names.as_slice() {
            [only] => Some(&only.text),
            _ => None,
        },
        _ => None,
    }
}

/// The list under the conjunction of both conditions.
fn guarded(any: Option<Expr>, guard: Option<&Expr>, list: &[Stmt], item: &StepItem) -> Vec<Stmt> {
    let conditions: Vec<Expr> = any.into_iter().chain(guard.cloned()).collect();
    if conditions.is_empty() {
        return list.to_vec();
    }
    let (condition, then) = (Expr::and(conditions), list.to_vec());
    let kind = StmtKind::If { condition, then, otherwise: Vec::new() };
    vec![Stmt { kind, span: item.span }]
}

fn action(qualifier: String, text: String) -> Action {
    Action { qualifier, text: Rich::plain(text), ..Action::default() }
}
