//! Net to text.

use super::lexer::quote;
use super::{is_plain, lexer};
use crate::arena::{Arena, Id, IdMap};
use crate::expr::{Expr as GenericExpr, ExprKind, Type};
use crate::net::*;
use crate::span::Name;
use itertools::Itertools as _;
use std::collections::BTreeSet;
use std::fmt::Write;

/// The text of a net; the module documents its form. Spans are omitted.
#[must_use]
pub fn print(net: &Net) -> String {
    let mut printer = Printer { net, names: Names::of(net), out: String::new() };
    printer.net();
    printer.out
}

/// The text of one expression of a net, for messages and comments.
#[must_use]
pub fn print_expr(net: &Net, expr: &Expr) -> String {
    let mut printer = Printer { net, names: Names::default(), out: String::new() };
    printer.expr(expr, 0);
    printer.out
}

/// The text of a condition for readers: like [`print_expr`], with the operands of its edges in place of their numbers (`rise(a)` instead of `rise(%0)`).
#[must_use]
pub fn print_condition(net: &Net, expr: &Expr) -> String {
    let mut text = print_expr(net, expr);
    let edges: BTreeSet<EdgeId> = expr.leaves().filter_map(Leaf::edge).collect();
    // From the last one down: `%1` also begins `%10`.
    for edge in edges.into_iter().rev() {
        let operand = print_expr(net, &net.edges[edge].expr);
        text = text.replace(&format!("%{}", edge.index()), &operand);
    }
    text
}

/// Ids that their name does not identify, because an earlier object has the same name: they are written by position.
#[derive(Default)]
struct Names {
    parts: Shadowed<Part>,
    inputs: Shadowed<Input>,
    vars: Shadowed<Var>,
    timers: Shadowed<Timer>,
    outputs: Shadowed<Output>,
    steps: Shadowed<Step>,
    transitions: Shadowed<Transition>,
    actions: Shadowed<ControlledAction>,
    sends: Shadowed<SendSlot>,
    histories: Shadowed<History>,
}

type Shadowed<T> = Option<IdMap<T, bool>>;

fn shadowed<'a, T>(
    arena: &'a Arena<T>,
    taken: &mut BTreeSet<&'a str>,
    name: impl Fn(&'a T) -> &'a Name,
) -> Shadowed<T> {
    Some(IdMap::build(arena, |id, _| !taken.insert(name(&arena[id]).text.as_str())))
}

impl Names {
    fn of(net: &Net) -> Names {
        let signals = &mut BTreeSet::new();
        Names {
            inputs: shadowed(&net.inputs, signals, |item| &item.name),
            vars: shadowed(&net.vars, signals, |item| &item.name),
            timers: shadowed(&net.timers, signals, |item| &item.name),
            parts: shadowed(&net.parts, &mut BTreeSet::new(), |item| &item.name),
            outputs: shadowed(&net.outputs, &mut BTreeSet::new(), |item| &item.name),
            steps: shadowed(&net.steps, &mut BTreeSet::new(), |item| &item.name),
            transitions: shadowed(&net.transitions, &mut BTreeSet::new(), |item| &item.name),
            actions: shadowed(&net.actions, &mut BTreeSet::new(), |item| &item.name),
            sends: shadowed(&net.sends, &mut BTreeSet::new(), |item| &item.name),
            histories: shadowed(&net.histories, &mut BTreeSet::new(), |item| &item.name),
        }
    }
}

fn reference<T>(
    arena: &Arena<T>,
    shadowed: &Shadowed<T>,
    id: Id<T>,
    name: impl Fn(&T) -> &Name,
) -> String {
    match arena.get(id) {
        Some(item) if shadowed.as_ref().is_none_or(|shadowed| !shadowed[id]) => {
            named(&name(item).text)
        }
        Some(_) | None => format!("?{}", id.index()),
    }
}

/// A name in the text form.
fn named(name: &str) -> String {
    if is_plain(name) { name.to_owned() } else { quote(name, '`') }
}

fn join(items: impl IntoIterator<Item = String>) -> String {
    items.into_iter().join(", ")
}

struct Printer<'a> {
    net: &'a Net,
    names: Names,
    out: String,
}

/// Appends formatted text; writing to a `String` cannot fail.
macro_rules! put {
    ($printer:expr, $($text:tt)*) => {
        let _ = write!($printer.out, $($text)*);
    };
}

impl Printer<'_> {
    fn part(&self, id: PartId) -> String {
        reference(&self.net.parts, &self.names.parts, id, |item| &item.name)
    }
    fn input(&self, id: InputId) -> String {
        reference(&self.net.inputs, &self.names.inputs, id, |item| &item.name)
    }
    fn var(&self, id: VarId) -> String {
        reference(&self.net.vars, &self.names.vars, id, |item| &item.name)
    }
    fn timer(&self, id: TimerId) -> String {
        reference(&self.net.timers, &self.names.timers, id, |item| &item.name)
    }
    fn output(&self, id: OutputId) -> String {
        reference(&self.net.outputs, &self.names.outputs, id, |item| &item.name)
    }
    fn step(&self, id: StepId) -> String {
        reference(&self.net.steps, &self.names.steps, id, |item| &item.name)
    }
    fn transition(&self, id: TransitionId) -> String {
        reference(&self.net.transitions, &self.names.transitions, id, |item| &item.name)
    }
    fn action(&self, id: ActionId) -> String {
        reference(&self.net.actions, &self.names.actions, id, |item| &item.name)
    }
    fn slot(&self, id: SendId) -> String {
        reference(&self.net.sends, &self.names.sends, id, |item| &item.name)
    }
    fn history(&self, id: HistoryId) -> String {
        reference(&self.net.histories, &self.names.histories, id, |item| &item.name)
    }

    fn net(&mut self) {
        let net = self.net;
        put!(self, "net {}\n", named(&net.name.text));
        self.settings();
        self.gap();
        for part in net.parts.values() {
            self.part_item(part);
        }
        self.gap();
        for input in net.inputs.values() {
            self.input_item(input);
        }
        self.gap();
        for output in net.outputs.values() {
            self.output_item(output);
        }
        self.gap();
        for (id, var) in net.vars.iter() {
            self.var_item(id, var);
        }
        for timer in net.timers.values() {
            self.head("timer", &timer.name.text, &timer.meta);
            self.out.push_str(if timer.starts_expired { " expired while " } else { " while " });
            self.expr(&timer.condition, 0);
            self.out.push('\n');
        }
        for (id, edge) in net.edges.iter() {
            put!(self, "edge %{} = ", id.index());
            self.expr(&edge.expr, 0);
            self.out.push('\n');
        }
        self.gap();
        for step in net.steps.values() {
            self.step_item(step);
        }
        self.gap();
        for transition in net.transitions.values() {
            self.transition_item(transition);
        }
        self.gap();
        for action in net.actions.values() {
            self.action_item(action);
        }
        for slot in net.sends.values() {
            self.head("slot", &slot.name.text, &slot.meta);
            put!(self, " sends {} after {}\n", self.input(slot.event), slot.delay);
        }
        for history in net.histories.values() {
            self.history_item(history);
        }
        self.rest();
    }

    fn part_item(&mut self, part: &Part) {
        self.head("part", &part.name.text, &part.meta);
        put!(self, " level {}", part.level);
        self.optional("priority", part.priority);
        self.out.push_str(if part.is_cut { " cut" } else { "" });
        if !part.initial.is_empty() {
            put!(self, "\n    enter ({})", self.enters(&part.initial));
        }
        self.out.push('\n');
    }

    fn input_item(&mut self, input: &Input) {
        self.head("input", &input.name.text, &input.meta);
        let kind = match input.kind {
            InputKind::Pin => "",
            InputKind::Extern => " extern",
            InputKind::Event => " event",
            InputKind::InternalEvent => " internal",
        };
        put!(
            self,
            " {}{kind}{}\n",
            ty(input.ty),
            if input.synchronous { " synchronous" } else { "" }
        );
    }

    fn var_item(&mut self, id: VarId, var: &Var) {
        self.head("var", &var.name.text, &var.meta);
        put!(self, " {}", ty(var.ty));
        if let Some(len) = var.len {
            put!(self, " [{len}]");
        }
        self.out.push_str(match var.origin {
            VarOrigin::Declared => "",
            VarOrigin::StoredOutput => " stored",
            VarOrigin::Hidden => " hidden",
        });
        if let Some(sharing) = self.net.sharing.get(&id) {
            put!(self, " {}", sharing.word());
        }
        if !var.init.is_empty() {
            put!(self, " = {}", join(var.init.iter().map(i64::to_string)));
        }
        self.out.push('\n');
    }

    fn action_item(&mut self, action: &ControlledAction) {
        self.head("action", &action.name.text, &action.meta);
        put!(self, " duration {}\n", action.duration);
        for of in &action.uses {
            put!(self, "    use {} {}", self.step(of.step), of.qualifier.letters());
            self.condition("if", of.condition.as_ref());
        }
        self.list("body", &action.body);
    }

    fn history_item(&mut self, history: &History) {
        self.head("history", &history.name.text, &history.meta);
        put!(self, " of {}\n", self.step(history.owner));
        for case in &history.cases {
            put!(self, "    case {} ({})\n", self.step(case.step), self.enters(&case.enters));
        }
        if !history.default.is_empty() {
            put!(self, "    default ({})\n", self.enters(&history.default));
        }
        self.list("content", &history.default_content);
    }

    fn rest(&mut self) {
        let net = self.net;
        self.gap();
        for forcing in &net.forcings {
            let target = join(forcing.target.iter().map(|part| self.part(*part)));
            put!(self, "force {} ({target})", self.step(forcing.step));
            match &forcing.order {
                ForcingOrder::Hold => self.out.push_str(" hold\n"),
                ForcingOrder::Situation(steps) => {
                    put!(self, " situation ({})\n", self.steps(steps));
                }
            }
        }
        for drawn in &net.macros {
            self.head("macro", &drawn.name.text, &drawn.meta);
            let (entry, exit, steps) =
                (self.step(drawn.entry), self.step(drawn.exit), self.steps(&drawn.steps));
            put!(self, " entry {entry} exit {exit} steps ({steps})\n");
        }
        if let Some(emergency) = &net.emergency {
            self.out.push_str("emergency");
            self.meta(&emergency.meta);
            self.out.push_str(" when ");
            self.expr(&emergency.condition, 0);
            self.out.push('\n');
        }
        if let Some(ending) = &net.ending {
            self.out.push_str(if ending.is_quiet {
                "ending quiet unless "
            } else {
                "ending unless "
            });
            self.expr(&ending.waits, 0);
            self.out.push('\n');
        }
        for property in &net.properties {
            self.out.push_str(match property.role {
                PropertyRole::Assume => "assume",
                PropertyRole::Assert => "assert",
            });
            if !property.name.is_empty() {
                put!(self, " {}", named(&property.name));
            }
            self.meta(&property.meta);
            self.out.push_str(" never ");
            self.expr(&property.never, 0);
            self.out.push('\n');
        }
        for open in &net.unspecified {
            match open.what {
                OpenCell::Next => self.out.push_str("open next when "),
                OpenCell::Output(output) => {
                    put!(self, "open output {} when ", self.output(output));
                }
            }
            self.expr(&open.when, 0);
            self.out.push('\n');
        }
        for placement in &net.placements {
            let item = match placement.item {
                PlacedItem::Step(id) => format!("step {}", self.step(id)),
                PlacedItem::Var(id) => format!("var {}", self.var(id)),
                PlacedItem::Transition(id) => format!("transition {}", self.transition(id)),
                PlacedItem::Output(id) => format!("output {}", self.output(id)),
            };
            put!(self, "place {item} on {}\n", named(&placement.part.text));
        }
        if let Some(device) = &net.board.device {
            put!(self, "device {}\n", named(&device.text));
        }
        for (name, number) in &net.board.pins {
            put!(self, "pin {} {number}\n", named(&name.text));
        }
        while self.out.ends_with("\n\n") {
            self.out.pop();
        }
    }

    fn settings(&mut self) {
        let settings = &self.net.settings;
        let policy = settings.policy.word();
        let schedule = match settings.schedule {
            Schedule::Declared => "declared",
            Schedule::Level => "level",
            Schedule::Priority => "priority",
        };
        put!(self, "policy {policy}\n");
        match settings.evolution {
            Evolution::Single => self.out.push_str("evolution single\n"),
            Evolution::Stable { limit } => {
                put!(self, "evolution stable limit {limit}\n");
            }
        }
        put!(self, "schedule {schedule}\n");
        for (is_set, line) in [
            (settings.fire_one, "fire one\n"),
            (settings.assign_simultaneous, "assign simultaneous\n"),
            (settings.final_scan, "final scan\n"),
            (settings.events_exclusive, "events exclusive\n"),
        ] {
            self.out.push_str(if is_set { line } else { "" });
        }
        if let Some(bound) = settings.queue {
            put!(self, "queue {bound}\n");
        }
        put!(self, "tick {} ns\n", settings.tick_ns);
    }

    fn output_item(&mut self, output: &Output) {
        self.head("output", &output.name.text, &output.meta);
        put!(self, " {}{}", ty(output.ty), if output.registered { " registered" } else { "" });
        if let Some(safe) = output.safe {
            put!(self, " safe {safe}");
        }
        match &output.driver {
            Driver::Continuous(emissions) | Driver::Mealy(emissions) => {
                let is_mealy = matches!(output.driver, Driver::Mealy(_));
                self.out.push_str(if is_mealy { " mealy\n" } else { " continuous\n" });
                for emission in emissions {
                    put!(self, "    emit {}", self.step(emission.step));
                    self.condition("if", emission.condition.as_ref());
                }
            }
            Driver::Fires(transitions) => {
                self.out.push_str(" fires");
                for transition in transitions {
                    put!(self, " {}", self.transition(*transition));
                }
                self.out.push('\n');
            }
            Driver::Stored(var) => {
                put!(self, " stored {}\n", self.var(*var));
            }
            Driver::Controlled(action) => {
                put!(self, " controlled {}\n", self.action(*action));
            }
            Driver::Extern { params, calls } => {
                self.out.push_str(" extern\n");
                for param in params {
                    put!(self, "    param {}", ty(param.ty));
                    if !param.name.is_empty() {
                        put!(self, " {}", named(&param.name));
                    }
                    self.out.push('\n');
                }
                for call in calls {
                    put!(self, "    call {}", self.step(call.step));
                    self.arguments(&call.arguments);
                    self.condition("if", call.condition.as_ref());
                }
            }
        }
    }

    fn step_item(&mut self, step: &Step) {
        self.head("step", &step.name.text, &step.meta);
        put!(self, " in {}", self.part(step.part));
        self.out.push_str(if step.is_initial { " initial" } else { "" });
        self.out.push_str(match step.kind {
            StepKind::Leaf => "",
            StepKind::Enclosing => " enclosing",
            StepKind::Composite => " composite",
            StepKind::Parallel => " parallel",
            StepKind::Final => " final",
        });
        if let Some(parent) = step.parent {
            put!(self, " parent {}", self.step(parent));
        }
        self.out.push_str(if step.activation_link { " link" } else { "" });
        self.out.push_str(if step.hidden { " hidden" } else { "" });
        self.optional("priority", step.priority);
        if step.budget != 0 {
            put!(self, " budget {}", step.budget);
        }
        if !step.locks.is_empty() {
            put!(self, " locks ({})", join(step.locks.iter().map(|lock| self.var(*lock))));
        }
        if let Some(event) = step.done_event {
            put!(self, " done {}", self.input(event));
        }
        self.out.push('\n');
        self.list("entry", &step.entry);
        self.list("exit", &step.exit);
        self.list("content", &step.initial_content);
        for code in &step.code {
            put!(self, "    {}\n", verbatim(code));
        }
        for task in &step.tasks {
            self.out.push_str("    ");
            self.head("task", &task.name.text, &task.meta);
            put!(self, " cost {} ", task.cost);
            self.block(&task.body, 1);
            self.out.push('\n');
        }
    }

    fn transition_item(&mut self, transition: &Transition) {
        self.head("transition", &transition.name.text, &transition.meta);
        put!(self, " in {}", self.part(transition.part));
        let is_reaction = transition.kind == TransitionKind::Reaction;
        self.out.push_str(if is_reaction { " reaction" } else { "" });
        if !transition.requires.is_empty() {
            put!(self, " {}", self.steps(&transition.requires));
        }
        self.out.push_str(" ->");
        if !transition.enters.is_empty() {
            put!(self, " {}", self.enters(&transition.enters));
        }
        let usual: &[StepId] = if is_reaction { &[] } else { &transition.requires };
        if transition.clears != usual {
            put!(self, " clears ({})", self.steps(&transition.clears));
        }
        self.out.push_str(if transition.restart { " restart" } else { "" });
        if !transition.events.is_empty() {
            put!(self, " on ({})", join(transition.events.iter().map(|event| self.input(*event))));
        }
        self.optional("priority", transition.priority);
        if let Some(deadline) = transition.deadline_ns {
            put!(self, " deadline {deadline} ns");
        }
        let guard = Some(&transition.guard).filter(|guard| !guard.is_true());
        self.condition("when", guard);
        self.list("do", &transition.actions);
    }

    /// Writes an empty line between kinds of declarations.
    fn gap(&mut self) {
        if !self.out.ends_with("\n\n") {
            self.out.push('\n');
        }
    }

    fn head(&mut self, word: &str, name: &str, meta: &Meta) {
        put!(self, "{word} {}", named(name));
        self.meta(meta);
    }

    fn meta(&mut self, meta: &Meta) {
        if !meta.label.is_empty() {
            put!(self, " {}", quote(&meta.label, '"'));
        }
        for tag in &meta.req {
            put!(self, " req {}", quote(tag, '"'));
        }
    }

    fn optional(&mut self, word: &str, number: Option<u32>) {
        if let Some(number) = number {
            put!(self, " {word} {number}");
        }
    }

    /// Prints a condition, if there is one, and the end of the line.
    fn condition(&mut self, word: &str, condition: Option<&Expr>) {
        if let Some(condition) = condition {
            put!(self, " {word} ");
            self.expr(condition, 0);
        }
        self.out.push('\n');
    }

    fn steps(&self, steps: &[StepId]) -> String {
        join(steps.iter().map(|step| self.step(*step)))
    }

    fn enters(&self, enters: &[Enter]) -> String {
        join(enters.iter().map(|enter| match *enter {
            Enter::Step(step) => self.step(step),
            Enter::InitialContent(step) => format!("content {}", self.step(step)),
            Enter::History(history) => format!("history {}", self.history(history)),
        }))
    }

    fn arguments(&mut self, arguments: &[Expr]) {
        self.out.push('(');
        self.exprs(arguments);
        self.out.push(')');
    }

    fn exprs<L: WriteLeaf>(&mut self, all: &[GenericExpr<L>]) {
        for (index, expr) in all.iter().enumerate() {
            self.out.push_str(if index > 0 { ", " } else { "" });
            self.expr(expr, 0);
        }
    }

    /// Prints a list of statements below a declaration, if there is one.
    fn list(&mut self, word: &str, list: &[Stmt]) {
        if !list.is_empty() {
            put!(self, "    {word} ");
            self.block(list, 1);
            self.out.push('\n');
        }
    }

    /// Prints a block, on one line if it is short and flat.
    fn block(&mut self, list: &[Stmt], indent: usize) {
        let is_flat =
            !list.iter().any(|stmt| matches!(stmt.kind, StmtKind::If { .. })) && list.len() <= 4;
        if list.is_empty() {
            self.out.push_str("{ }");
        } else if is_flat {
            self.out.push_str("{ ");
            for (index, stmt) in list.iter().enumerate() {
                self.out.push_str(if index > 0 { "; " } else { "" });
                self.stmt(stmt, indent);
            }
            self.out.push_str(" }");
        } else {
            self.out.push_str("{\n");
            for stmt in list {
                self.out.push_str(&"    ".repeat(indent + 1));
                self.stmt(stmt, indent + 1);
                self.out.push('\n');
            }
            self.out.push_str(&"    ".repeat(indent));
            self.out.push('}');
        }
    }

    fn stmt(&mut self, stmt: &Stmt, indent: usize) {
        match &stmt.kind {
            StmtKind::Assign { var, index, value } => {
                self.out.push_str(&self.var(*var));
                if let Some(index) = index {
                    self.out.push('[');
                    self.expr(index, 0);
                    self.out.push(']');
                }
                self.out.push_str(" := ");
                self.expr(value, 0);
            }
            StmtKind::Raise(event) => {
                put!(self, "raise {}", self.input(*event));
            }
            StmtKind::Send(slot) => {
                put!(self, "send {}", self.slot(*slot));
            }
            StmtKind::Cancel(slot) => {
                put!(self, "cancel {}", self.slot(*slot));
            }
            StmtKind::Call { output, arguments } => {
                put!(self, "call {}", self.output(*output));
                self.arguments(arguments);
            }
            StmtKind::Code(code) => self.out.push_str(&verbatim(code)),
            StmtKind::If { condition, then, otherwise } => {
                self.out.push_str("if ");
                self.expr(condition, 0);
                self.out.push(' ');
                self.block(then, indent);
                if !otherwise.is_empty() {
                    self.out.push_str(" else ");
                    self.block(otherwise, indent);
                }
            }
        }
    }

    /// Writes an expression, in parentheses if it binds looser than `above`: or 1, and 2, not 3, comparison 4, sum
    /// 5, product 6.
    fn expr<L: WriteLeaf>(&mut self, expr: &GenericExpr<L>, above: u8) {
        let level = match &expr.kind {
            ExprKind::Or(all) if all.len() > 1 => 1,
            ExprKind::And(all) if all.len() > 1 => 2,
            ExprKind::Not(_) => 3,
            ExprKind::Compare(..) => 4,
            ExprKind::Arith(op, ..) => 5 + u8::from(!op.is_sum()),
            _ => 9,
        };
        if level < above {
            self.out.push('(');
            self.bare_expr(expr, level);
            self.out.push(')');
        } else {
            self.bare_expr(expr, level);
        }
    }

    fn bare_expr<L: WriteLeaf>(&mut self, expr: &GenericExpr<L>, level: u8) {
        match &expr.kind {
            ExprKind::Bool(value) => self.out.push_str(if *value { "true" } else { "false" }),
            ExprKind::Int(value) => {
                put!(self, "{value}");
            }
            ExprKind::Leaf(leaf) => self.out.push_str(&leaf.write(self)),
            ExprKind::Element(array, index) => {
                self.out.push_str(&array.write(self));
                self.out.push('[');
                self.expr(index, 0);
                self.out.push(']');
            }
            ExprKind::Not(a) => {
                self.out.push_str("not ");
                self.expr(a, 3);
            }
            ExprKind::And(all) | ExprKind::Or(all) => {
                let word = if matches!(expr.kind, ExprKind::And(_)) { "and" } else { "or" };
                if level == 9 {
                    put!(self, "{word}(");
                    self.exprs(all);
                    self.out.push(')');
                } else {
                    for (index, operand) in all.iter().enumerate() {
                        if index > 0 {
                            put!(self, " {word} ");
                        }
                        self.expr(operand, level + 1);
                    }
                }
            }
            ExprKind::Compare(op, a, b) => self.infix(op.symbol(), a, b, 5, 5),
            ExprKind::Arith(op, a, b) => self.infix(op.symbol(), a, b, level, level + 1),
            ExprKind::Neg(a) => {
                self.out.push_str("-(");
                self.expr(a, 0);
                self.out.push(')');
            }
            ExprKind::Select(c, a, b) => {
                self.out.push_str("select(");
                self.expr(c, 0);
                self.out.push_str(", ");
                self.expr(a, 0);
                self.out.push_str(", ");
                self.expr(b, 0);
                self.out.push(')');
            }
        }
    }

    fn infix<L: WriteLeaf>(
        &mut self,
        sign: &str,
        a: &GenericExpr<L>,
        b: &GenericExpr<L>,
        left: u8,
        right: u8,
    ) {
        self.expr(a, left);
        put!(self, " {sign} ");
        self.expr(b, right);
    }
}

trait WriteLeaf {
    fn write(&self, printer: &Printer<'_>) -> String;
}

impl WriteLeaf for Leaf {
    fn write(&self, printer: &Printer<'_>) -> String {
        match *self {
            Leaf::Input(id) => signal("input", printer.input(id)),
            Leaf::Var(id) => signal("var", printer.var(id)),
            Leaf::Timer(id) => signal("timer", printer.timer(id)),
            Leaf::Active(id) => format!("{}.active", printer.step(id)),
            Leaf::Elapsed(id) => format!("{}.t", printer.step(id)),
            Leaf::LastElapsed(id) => format!("{}.T", printer.step(id)),
            Leaf::TasksDone(id) => format!("{}.done", printer.step(id)),
            Leaf::Rise(id) => format!("rise({})", edge(printer.net, id)),
            Leaf::Fall(id) => format!("fall({})", edge(printer.net, id)),
            Leaf::Fireable(id) => format!("{}.fireable", printer.transition(id)),
            Leaf::Controlled(id) => format!("{}.q", printer.action(id)),
        }
    }
}

impl WriteLeaf for PropertyLeaf {
    fn write(&self, printer: &Printer<'_>) -> String {
        match self {
            PropertyLeaf::Net(leaf) => leaf.write(printer),
            PropertyLeaf::Output(id) => format!("{}.out", printer.output(*id)),
        }
    }
}

/// A reference to a signal; with its kind if the reference is a position, which alone does not identify the kind.
fn signal(kind: &str, reference: String) -> String {
    if reference.starts_with('?') { format!("{kind} {reference}") } else { reference }
}

fn edge(net: &Net, id: EdgeId) -> String {
    format!("{}{}", if net.edges.get(id).is_some() { '%' } else { '?' }, id.index())
}

fn verbatim(code: &Verbatim) -> String {
    format!("code {} {}", lexer::quote(&code.language, '"'), quote(&code.text, '"'))
}

fn ty(ty: Type) -> String {
    match ty {
        Type::Bool => "bool".to_owned(),
        Type::Int { lo, hi } => format!("int {lo}..{hi}"),
    }
}
