//! A function as a flow graph with one node per statement, as in NBS88, and conditions between the nodes.
//!
//! Every control statement of C becomes conditional and unconditional jumps: `while`, `do`, `for`, `switch`, `break`, `continue` and `goto`
//! only decide which node is next. Side effects under a condition (`a && i++`, a call in `?:`) become branches of the graph too. So if a
//! node runs, all of its statements run, in order.

use super::ast::{Declaration, Expr, ExprKind, Function, Init, Stmt, StmtKind};
use super::graph::{CallSite, Graph, Next, Node, NodeId, Part, Way};
use super::number::Num;
use super::resolve::{FunctionId, Home, Program, VarId};
use super::texts::{comment_text, hint, one_line};
use super::types::Type;
use super::{Group, constant};
use crate::codes;
use crate::findings::Findings;
use grafsynth_ir::chart::{self, Path};
use grafsynth_ir::diag::{Diagnostic, nearest};
use grafsynth_ir::expr::Type as NetType;
use grafsynth_ir::{Name, Span};
use std::collections::{BTreeMap, BTreeSet};

/// Names of one namespace of the chart. No name is returned twice.
#[derive(Debug, Clone, Default)]
pub(super) struct Names {
    taken: BTreeSet<String>,
    /// The last number appended to each name.
    numbers: BTreeMap<String, usize>,
}

impl Names {
    /// Like [`Names::fresh`], for names that are never used after the dot of a macro-step.
    pub(super) fn plain(&mut self, wanted: &str) -> String {
        if !wanted.is_empty() && self.taken.insert(wanted.to_owned()) {
            wanted.to_owned()
        } else {
            self.fresh(wanted)
        }
    }

    /// Returns `wanted`, shortened and with invalid characters replaced, and with a number if the name is taken.
    pub(super) fn fresh(&mut self, wanted: &str) -> String {
        let mut base: String = wanted
            .chars()
            .map(
                |letter| if letter.is_ascii_alphanumeric() || letter == '_' { letter } else { '_' },
            )
            .take(40)
            .collect();
        if base.is_empty() || base.starts_with(|first: char| first.is_ascii_digit()) {
            base.insert(0, 's');
        }
        // These words after a dot denote a property of a step, so they cannot name an item inside a macro-step.
        if ["active", "t", "T", "done"].contains(&base.as_str()) {
            base.push('_');
        }
        let mut name = base.clone();
        while !self.taken.insert(name.clone()) {
            let number = self.numbers.entry(base.clone()).or_insert(1);
            *number += 1;
            name = format!("{base}_{number}");
        }
        name
    }
}

/// Data about the other functions that the translation of one function needs.
pub(super) struct Context<'p, 's> {
    pub(super) program: &'p Program<'s>,
    /// The name of every variable in the chart, without its macro-step.
    pub(super) var_names: &'p BTreeMap<VarId, String>,
    /// Names of shared macro-steps.
    pub(super) shared: &'p BTreeMap<FunctionId, String>,
}

/// The extern functions made from the opaque units of a chart.
#[derive(Debug, Default)]
pub(super) struct Externs {
    pub(super) names: Names,
    /// Name, C text of the body, and span.
    pub(super) actions: Vec<(String, String, Span)>,
    pub(super) conditions: Vec<Question>,
}

/// An extern condition.
#[derive(Debug)]
pub(super) struct Question {
    pub(super) name: String,
    /// C text of the body.
    pub(super) text: String,
    /// The range of a number; `None` for a Boolean.
    pub(super) range: Option<(i64, i64)>,
    pub(super) span: Span,
}

/// Builder of the graph of a function.
pub(super) struct Flow<'p, 's> {
    pub(super) context: &'p Context<'p, 's>,
    pub(super) function: FunctionId,
    pub(super) names: &'p mut Names,
    pub(super) externs: &'p mut Externs,
    pub(super) findings: &'p mut Findings,
    pub(super) nodes: Vec<Node>,
    /// The current node; `None` in unreachable code.
    pub(super) current: Option<NodeId>,
    pub(super) temps: Vec<(String, NetType)>,
    /// Temporaries by purpose and type, and how many of them the current full expression uses.
    pub(super) pool: BTreeMap<(String, NetType), (Vec<String>, usize)>,
    /// Numbers that are already in a temporary: the expression, the range of the temporary, and the number that reads the temporary.
    /// Cleared at every side effect.
    pub(super) clamped: Vec<(chart::Expr, (i64, i64), Num)>,
    /// Values of calls in the current opaque unit: span of the call, and the text that replaces it.
    pub(super) replaced: Vec<(Span, String)>,
    parts: Vec<Part>,
    part: usize,
    breaks: Vec<NodeId>,
    continues: Vec<NodeId>,
    labels: BTreeMap<String, (NodeId, bool, Span)>,
    switches: Vec<Switch>,
    exit: NodeId,
}

/// A `switch` that is being translated.
struct Switch {
    cases: Vec<(i64, NodeId, Span, String)>,
    default: Option<(NodeId, Span)>,
}

/// Builds the graph of a function.
pub(super) fn graph(
    context: &Context<'_, '_>,
    function: FunctionId,
    names: &mut Names,
    externs: &mut Externs,
    findings: &mut Findings,
) -> Graph {
    let def = context.program.functions[function].def;
    let mut flow = Flow {
        context,
        function,
        names,
        externs,
        findings,
        nodes: Vec::new(),
        current: None,
        temps: Vec::new(),
        pool: BTreeMap::new(),
        clamped: Vec::new(),
        replaced: Vec::new(),
        parts: vec![Part { parent: 0, name: def.name.text.clone(), text: String::new() }],
        part: 0,
        breaks: Vec::new(),
        continues: Vec::new(),
        labels: BTreeMap::new(),
        switches: Vec::new(),
        exit: 0,
    };
    flow.exit = flow.node("", "", def.span);
    flow.nodes[flow.exit].next = Next::Exit;
    let start = flow.node("enter", "", def.name.span);
    flow.nodes[start].is_kept = true;
    flow.current = Some(start);
    flow.function_body(def);
    flow.undefined_labels();
    Graph { nodes: flow.nodes, start, parts: flow.parts, temps: flow.temps }
}

impl<'s> Flow<'_, 's> {
    pub(super) fn program(&self) -> &Program<'s> {
        self.context.program
    }

    // Nodes

    fn node(&mut self, hint: &str, text: &str, span: Span) -> NodeId {
        self.nodes.push(Node {
            hint: hint.to_owned(),
            text: text.to_owned(),
            test: String::new(),
            comments: Vec::new(),
            span,
            body: Vec::new(),
            next: Next::None,
            is_kept: false,
            is_test: false,
            group: self.part,
        });
        self.nodes.len() - 1
    }

    /// Creates an empty node where ways meet.
    pub(super) fn join(&mut self, span: Span) -> NodeId {
        self.node("", "", Span { end: span.start, ..span })
    }

    fn end_with(&mut self, next: Next) {
        if let Some(current) = self.current.take()
            && matches!(self.nodes[current].next, Next::None)
        {
            self.nodes[current].next = next;
        }
    }

    /// Continues at `node`, from the current node and from all jumps to it.
    pub(super) fn go_on(&mut self, node: NodeId) {
        self.forget();
        self.end_with(Next::Goto(node));
        self.current = Some(node);
    }

    /// Forgets which numbers are in temporaries, because their values may differ from here on.
    fn forget(&mut self) {
        self.clamped.clear();
    }

    /// Creates a node after the current one.
    pub(super) fn open(&mut self, hint: &str, text: &str, span: Span) -> NodeId {
        let node = self.node(hint, text, span);
        self.go_on(node);
        node
    }

    /// The node to which statements are added.
    pub(super) fn here(&mut self) -> NodeId {
        match self.current {
            Some(node) => node,
            None => {
                let node = self.node("", "", Span::default());
                self.current = Some(node);
                node
            }
        }
    }

    pub(super) fn emit(&mut self, kind: chart::StmtKind, span: Span) {
        let here = self.here();
        self.nodes[here].body.push(chart::Stmt { kind, span });
    }

    pub(super) fn assign(
        &mut self,
        target: Path,
        index: Option<chart::Expr>,
        value: chart::Expr,
        span: Span,
    ) {
        self.emit(chart::StmtKind::Assign { target, index, value }, span);
    }

    /// Ends the current node with a two-way branch.
    pub(super) fn branch(
        &mut self,
        guard: chart::Expr,
        span: Span,
        then: NodeId,
        otherwise: NodeId,
    ) {
        let text = one_line(self.program().text_of(span));
        let here = self.here();
        if self.nodes[here].test.is_empty() {
            self.nodes[here].test.clone_from(&text);
        }
        self.end_with(Next::Branch(vec![Way { guard, text, to: then }], otherwise));
        self.forget();
    }

    /// Ends the current node with a call. The value is available in the next node.
    pub(super) fn call_site(&mut self, site: CallSite) {
        let here = self.here();
        let (hint, text, span, is_test) = {
            let node = &self.nodes[here];
            (node.hint.clone(), node.text.clone(), node.span, node.is_test)
        };
        let then = self.node(&hint, &text, span);
        self.nodes[then].is_test = is_test;
        self.nodes[here].hint = format!("call_{}", self.program().functions[site.callee].def.name);
        self.end_with(Next::Call(Box::new(site), then));
        self.current = Some(then);
        self.forget();
    }

    /// Begins a new full expression: the temporaries of the previous one are free.
    pub(super) fn full_expression(&mut self) {
        for (_, n_used) in self.pool.values_mut() {
            *n_used = 0;
        }
        self.replaced.clear();
        self.clamped.clear();
    }

    // Statements

    fn function_body(&mut self, def: &'s Function) {
        self.statement(&def.body);
        let exit = self.exit;
        self.end_with(Next::Goto(exit));
    }

    fn statement(&mut self, statement: &'s Stmt) {
        let span = statement.span;
        let text = one_line(self.program().text_of(span));
        match &statement.kind {
            StmtKind::Null => {
                let node = self.open("null", &text, span);
                self.nodes[node].is_kept = true;
            }
            StmtKind::Expr(expr) => {
                let hint = hint(expr);
                self.open(&hint, &text, span);
                self.effect(expr);
            }
            StmtKind::Block(all) => self.block(all),
            StmtKind::Declaration(declaration) => self.declaration(declaration),
            StmtKind::If(condition, then, otherwise) => {
                self.if_statement(condition, then, otherwise.as_deref())
            }
            StmtKind::While(condition, body) => self.while_statement(span, condition, body),
            StmtKind::Do(body, condition) => self.do_statement(span, body, condition),
            StmtKind::For { first, condition, last, body } => {
                self.for_statement(span, first.as_deref(), condition.as_ref(), last.as_ref(), body)
            }
            StmtKind::Switch(value, body) => self.switch(span, value, body),
            StmtKind::Case(value, inner) => {
                let node = self.join(inner.span);
                self.case(value, node);
                self.go_on(node);
                self.labelled(inner);
            }
            StmtKind::Default(inner) => {
                let node = self.join(inner.span);
                self.default(node, span);
                self.go_on(node);
                self.labelled(inner);
            }
            StmtKind::Label(name, inner) => {
                let node = self.label(name, true);
                self.nodes[node].span =
                    Span { end: inner.span.start, start: inner.span.start, ..inner.span };
                self.go_on(node);
                self.labelled(inner);
            }
            StmtKind::Goto(name) => {
                let node = self.label(name, false);
                self.end_with(Next::Goto(node));
            }
            StmtKind::Break => match self.breaks.last().copied() {
                Some(node) => self.end_with(Next::Goto(node)),
                None => self.jump_error(
                    span,
                    "`break` outside of a loop or `switch`",
                    "remove it, or write `return` to leave the function",
                ),
            },
            StmtKind::Continue => match self.continues.last().copied() {
                Some(node) => self.end_with(Next::Goto(node)),
                None => self.jump_error(
                    span,
                    "`continue` outside of a loop",
                    "remove it, or move it into a loop",
                ),
            },
            StmtKind::Return(value) => self.return_statement(span, &text, value.as_ref()),
        }
    }

    /// Translates a labelled statement. A label at the end of a block has no statement, and no step is created for it.
    fn labelled(&mut self, inner: &'s Stmt) {
        if inner.span.start < inner.span.end {
            self.statement(inner);
        }
    }

    /// Creates the node that evaluates a condition.
    fn test_node(&mut self, hint: &str, condition: &Expr) -> NodeId {
        let node = self.open(hint, "", condition.span);
        self.nodes[node].is_test = true;
        node
    }

    fn while_statement(&mut self, span: Span, condition: &'s Expr, body: &'s Stmt) {
        let test = self.test_node("while", condition);
        let (inside, behind) = (self.join(body.span), self.join(span));
        self.condition(condition, inside, behind);
        self.current = Some(inside);
        self.loop_body(body, "while_body", behind, test);
        self.end_with(Next::Goto(test));
        self.current = Some(behind);
    }

    fn do_statement(&mut self, span: Span, body: &'s Stmt, condition: &'s Expr) {
        let begin = self.join(body.span);
        self.go_on(begin);
        let (test, behind) = (self.join(condition.span), self.join(span));
        self.loop_body(body, "do_body", behind, test);
        self.go_on(test);
        self.test_node("until", condition);
        self.condition(condition, begin, behind);
        self.current = Some(behind);
    }

    /// Makes a node the `default` of its `switch`.
    fn default(&mut self, node: NodeId, span: Span) {
        match self.switches.last_mut() {
            None => self.jump_error(
                span,
                "`default` outside of a `switch`",
                "move it into a `switch`, or remove it",
            ),
            Some(Switch { default: Some((_, first)), .. }) => {
                let first = *first;
                self.findings.report(|| {
                    Diagnostic::twice(
                        codes::C_JUMP,
                        "two `default` labels in one `switch`",
                        [span, first],
                        "remove one of them",
                    )
                });
            }
            Some(switch) => switch.default = Some((node, span)),
        }
    }

    fn if_statement(&mut self, condition: &'s Expr, then: &'s Stmt, otherwise: Option<&'s Stmt>) {
        self.test_node("test", condition);
        let (yes, behind) =
            (self.join(then.span), self.join(Span { start: then.span.end, ..then.span }));
        let no = otherwise.map(|otherwise| self.join(otherwise.span));
        self.condition(condition, yes, no.unwrap_or(behind));
        self.current = Some(yes);
        self.under(then, "then");
        self.end_with(Next::Goto(behind));
        if let (Some(no), Some(otherwise)) = (no, otherwise) {
            self.current = Some(no);
            self.under(otherwise, "else");
            self.end_with(Next::Goto(behind));
        }
        self.current = Some(behind);
    }

    fn loop_body(&mut self, body: &'s Stmt, name: &str, behind: NodeId, again: NodeId) {
        self.breaks.push(behind);
        self.continues.push(again);
        self.under(body, name);
        self.breaks.pop();
        self.continues.pop();
    }

    /// Translates a statement under a condition. With `--group blocks`, its block becomes a macro-step.
    fn under(&mut self, statement: &'s Stmt, name: &str) {
        let is_part = self.program().options.group == Group::Blocks
            && matches!(statement.kind, StmtKind::Block(_));
        if is_part {
            self.in_part(name, "", |flow| flow.statement(statement));
        } else {
            self.statement(statement);
        }
    }

    /// Puts the nodes that `build` creates into a part with this name.
    fn in_part(&mut self, name: &str, text: &str, build: impl FnOnce(&mut Self)) {
        let outer = self.part;
        self.parts.push(Part { parent: outer, name: name.to_owned(), text: text.to_owned() });
        self.part = self.parts.len() - 1;
        build(self);
        self.part = outer;
    }

    fn for_statement(
        &mut self,
        span: Span,
        first: Option<&'s Stmt>,
        condition: Option<&'s Expr>,
        last: Option<&'s Expr>,
        body: &'s Stmt,
    ) {
        // NBS88: a missing expression is a null statement; a missing condition is true.
        match first {
            Some(first) => self.statement(first),
            None => {
                let node = self.open("null", "", Span { end: span.start, ..span });
                self.nodes[node].is_kept = true;
            }
        }
        let head = condition.map_or(body.span, |condition| condition.span);
        let (inside, step, behind) = (self.join(body.span), self.join(head), self.join(span));
        let test = match condition {
            Some(condition) => {
                let test = self.test_node("for", condition);
                self.condition(condition, inside, behind);
                test
            }
            None => {
                self.go_on(inside);
                inside
            }
        };
        self.current = Some(inside);
        self.loop_body(body, "for_body", behind, step);
        self.go_on(step);
        match last {
            Some(last) => {
                let text = one_line(self.program().text_of(last.span));
                self.open(&hint(last), &text, last.span);
                self.effect(last);
            }
            None => {
                let node = self.open("null", "", Span { end: span.start, ..span });
                self.nodes[node].is_kept = true;
            }
        }
        self.end_with(Next::Goto(test));
        self.current = Some(behind);
    }

    fn switch(&mut self, span: Span, value: &'s Expr, body: &'s Stmt) {
        self.test_node("switch", value);
        let selected = self.selector(value);
        let head = self.current.take();
        let behind = self.join(span);
        self.switches.push(Switch { cases: Vec::new(), default: None });
        self.breaks.push(behind);
        // Statements before the first label are unreachable, unless a goto leads there.
        self.statement(body);
        self.end_with(Next::Goto(behind));
        self.breaks.pop();
        let Some(switch) = self.switches.pop() else { return };
        let default = match switch.default {
            Some((node, _)) => node,
            None => {
                // NBS88: without a default, a null statement follows `otherwise`.
                let null = self.node("null", "", Span { end: span.start, ..span });
                self.nodes[null].next = Next::Goto(behind);
                null
            }
        };
        let mut seen: BTreeMap<i64, Span> = BTreeMap::new();
        let mut ways = Vec::new();
        for (constant, node, at, text) in switch.cases {
            let folded = selected.fold(constant);
            if let Some(first) = seen.insert(folded, at) {
                self.findings.report(|| {
                    Diagnostic::twice(
                        codes::C_JUMP,
                        format!("two cases for {constant} in one `switch`"),
                        [at, first],
                        "remove one of them, or write another value",
                    )
                });
            }
            ways.push(Way { guard: selected.equals(folded, at), text, to: node });
        }
        if let Some(head) = head {
            self.nodes[head].test =
                format!("switch ({})", one_line(self.program().text_of(value.span)));
            self.nodes[head].next =
                if ways.is_empty() { Next::Goto(default) } else { Next::Branch(ways, default) };
        }
        self.current = Some(behind);
    }

    fn case(&mut self, value: &Expr, node: NodeId) {
        let constant = match constant::value(value, &self.program().constants) {
            Ok(constant) => constant,
            Err(span) => {
                self.findings.report(|| {
                    Diagnostic::error(codes::C_CONSTANT, "a case label must be constant")
                        .at(span, "not a constant expression")
                        .help("use numbers, characters, and names from `#define` and `enum`")
                });
                return;
            }
        };
        let text = format!("case {}", one_line(self.program().text_of(value.span)));
        match self.switches.last_mut() {
            Some(switch) => switch.cases.push((constant, node, value.span, text)),
            None => self.jump_error(
                value.span,
                "`case` outside of a `switch`",
                "move it into a `switch`, or remove it",
            ),
        }
    }

    fn jump_error(&mut self, span: Span, message: &str, help: &str) {
        self.findings.report(|| Diagnostic::error(codes::C_JUMP, message).at(span, "").help(help));
    }

    fn label(&mut self, name: &Name, is_definition: bool) -> NodeId {
        if let Some((node, is_defined, first)) = self.labels.get(&name.text).copied() {
            if is_definition && is_defined {
                self.findings.report(|| {
                    Diagnostic::twice(
                        codes::C_JUMP,
                        format!("duplicate label `{name}`"),
                        [name.span, first],
                        "rename one of them, and each `goto` that refers to it",
                    )
                });
            }
            if is_definition {
                self.labels.insert(name.text.clone(), (node, true, name.span));
                self.nodes[node].group = self.part;
            }
            return node;
        }
        let node = self.join(name.span);
        // The labelled statement becomes a step with the name of the label.
        self.nodes[node].hint.clone_from(&name.text);
        self.labels.insert(name.text.clone(), (node, is_definition, name.span));
        node
    }

    fn undefined_labels(&mut self) {
        let missing: Vec<(String, Span)> = self
            .labels
            .iter()
            .filter(|(_, (_, is_defined, _))| !is_defined)
            .map(|(name, (_, _, span))| (name.clone(), *span))
            .collect();
        for (name, span) in missing {
            let known = self
                .labels
                .iter()
                .filter(|(_, (_, is_defined, _))| *is_defined)
                .map(|(name, _)| name.as_str());
            let near = nearest(&name, known).map(str::to_owned);
            self.findings.report(|| {
                let finding = Diagnostic::error(
                    codes::C_JUMP,
                    format!("there is no label `{name}` in this function"),
                )
                .at(span, "no statement has this label");
                finding.near(span, near, format!(
                        "write `{name}:` before the statement to continue with; a label cannot be in another function"
                    ))
            });
        }
    }

    fn return_statement(&mut self, span: Span, text: &str, value: Option<&'s Expr>) {
        self.open("return", text, span);
        let result = self.program().functions[self.function].result;
        if let Some(value) = value {
            match result {
                Some(result) => self.initialise(result, value),
                None => self.findings.report(|| {
                    Diagnostic::error(codes::C_TYPE, "a void function returns a value")
                        .at(value.span, "")
                        .help("declare the type of the value before the function name")
                }),
            }
        }
        let exit = self.exit;
        self.end_with(Next::Goto(exit));
    }

    fn declaration(&mut self, declaration: &'s Declaration) {
        for (declarator, init) in &declaration.declared {
            let Some(var) = self.program().declared.get(&declarator.name.span.start).copied()
            else {
                continue;
            };
            let Some(init) = init else { continue };
            if !matches!(self.program().vars[var].home, Home::Local(_)) {
                continue;
            }
            let span = declarator.span;
            let whole = match init {
                Init::One(expr) => span.to(expr.span),
                Init::List(_, list) => span.to(*list),
            };
            let text = one_line(self.program().text_of(declaration.specifiers.span.to(whole)));
            let hint = format!("init_{}", declarator.name);
            self.open(&hint, &text, whole);
            match init {
                Init::One(Expr { kind: ExprKind::Text, span })
                    if matches!(self.program().vars[var].ty, Type::Array(..)) =>
                {
                    let text = *span;
                    if self.program().vars[var].in_library {
                        self.library_init(var, text);
                    } else {
                        self.full_expression();
                        self.init_string(var, text);
                    }
                }
                Init::One(expr) => self.initialise(var, expr),
                Init::List(all, list) => {
                    self.full_expression();
                    if self.program().is_opaque(*list) || self.program().vars[var].in_library {
                        self.library_init(var, *list);
                    } else {
                        self.init_list(var, all, *list);
                    }
                }
            }
        }
    }

    fn block(&mut self, all: &'s [Stmt]) {
        if self.program().options.group != Group::Comments {
            all.iter().for_each(|one| self.statement(one));
            return;
        }
        let starts: Vec<Option<String>> = all
            .iter()
            .enumerate()
            .map(|(index, one)| {
                self.heading(index.checked_sub(1).map(|before| all[before].span), one.span)
            })
            .collect();
        let mut index = 0;
        while index < all.len() {
            let Some(heading) = &starts[index] else {
                self.statement(&all[index]);
                index += 1;
                continue;
            };
            let end =
                (index + 1..all.len()).find(|next| starts[*next].is_some()).unwrap_or(all.len());
            let (name, group) = (heading.clone(), &all[index..end]);
            self.in_part(&name, &name, |flow| group.iter().for_each(|one| flow.statement(one)));
            index = end;
        }
    }

    /// The comment on its own lines directly before a statement, used as a heading.
    fn heading(&self, before: Option<Span>, statement: Span) -> Option<String> {
        let program = self.program();
        let text = program.text;
        let comment =
            program.source.comments.iter().rfind(|comment| comment.end <= statement.start)?;
        if before.is_some_and(|before| comment.start < before.end) {
            return None;
        }
        // Only blanks may separate the comment from the statement and from the beginning of its line.
        let gap = text.get(comment.end as usize..statement.start as usize)?;
        let line_start = text[..comment.start as usize].rfind('\n').map_or(0, |at| at + 1);
        let lead = text.get(line_start..comment.start as usize)?;
        (gap.trim().is_empty() && lead.trim().is_empty())
            .then(|| comment_text(program.text_of(*comment)))
    }
}
