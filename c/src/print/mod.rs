//! A tree as text. The printer alone determines parentheses, `.` or `->`, comments and layout; reading the text gives the same tree.
//!
//! Lines are indented by four spaces per level; the cases of a `switch` have the indentation of the `switch`. Every body is in braces. A chain of `else if` ends with
//! an `else`, which shows that no case was forgotten (MISRA-C:2012, rule 15.7).

mod expr;
mod item;

use crate::tree::types::Qualified;
use crate::tree::{Case, Label, Marks, Stmt, StmtKind, SymbolKind, Unit};

/// The maximum length of a line in a table, in characters.
const WIDTH: usize = 120;

/// The text of a unit.
#[must_use]
pub fn print(unit: &Unit) -> String {
    let mut printer = Printer { unit, text: String::new(), indent: 0 };
    printer.items(&unit.items);
    printer.text
}

/// A type without a name, as in a cast.
#[must_use]
pub fn type_name(unit: &Unit, ty: &Qualified) -> String {
    Printer { unit, text: String::new(), indent: 0 }.declarator(ty, "", None)
}

struct Printer<'a> {
    unit: &'a Unit,
    text: String,
    indent: usize,
}

impl Printer<'_> {
    /// A line with an optional comment.
    fn line(&mut self, text: &str, note: &str) {
        if !text.is_empty() {
            for _ in 0..self.indent {
                self.text.push_str("    ");
            }
            self.text.push_str(text);
        }
        if !note.is_empty() {
            self.text.push_str(" /* ");
            self.text.push_str(&comment(note));
            self.text.push_str(" */");
        }
        self.text.push('\n');
    }

    /// A comment of one or more lines.
    fn comment(&mut self, note: &str) {
        let lines: Vec<String> = note.lines().map(comment).collect();
        let n_lines = lines.len();
        for (at, line) in lines.into_iter().enumerate() {
            let begin = if at == 0 { "/*" } else { " *" };
            let space = if line.is_empty() { "" } else { " " };
            let end = if at + 1 == n_lines { " */" } else { "" };
            self.line(&format!("{begin}{space}{line}{end}"), "");
        }
    }

    fn body(&mut self, body: &[Stmt]) {
        self.indent += 1;
        body.iter().for_each(|stmt| self.stmt(stmt));
        self.indent -= 1;
    }

    /// `head {`, the body, and `}`.
    fn block(&mut self, head: &str, marks: &Marks, body: &[Stmt]) {
        let space = if head.is_empty() { "" } else { " " };
        self.line(&format!("{head}{space}{{"), &marks.note);
        self.body(body);
        self.line("}", "");
    }

    fn stmt(&mut self, stmt: &Stmt) {
        let note = &stmt.marks.note;
        match &stmt.kind {
            StmtKind::Expr(value) => {
                let text = self.expr(value);
                self.line(&format!("{text};"), note);
            }
            StmtKind::Define { .. } => self.define(stmt),
            StmtKind::If { arms, otherwise } => {
                let mut open = "";
                for arm in arms {
                    let condition = self.condition(&arm.condition);
                    let note = if arm.marks.note.is_empty() && open.is_empty() {
                        note
                    } else {
                        &arm.marks.note
                    };
                    self.line(&format!("{open}if ({condition}) {{"), note);
                    self.body(&arm.body);
                    open = "} else ";
                }
                if !otherwise.is_empty() {
                    self.line("} else {", "");
                    self.body(otherwise);
                } else if arms.len() > 1 {
                    self.line("} else {", "");
                    self.indent += 1;
                    self.comment("Nothing else happens.");
                    self.indent -= 1;
                }
                self.line("}", "");
            }
            StmtKind::Switch { on, cases } => {
                // The promotion is implicit.
                let on = self.expr(on);
                self.line(&format!("switch ({on}) {{"), note);
                cases.iter().for_each(|case| self.case(case));
                self.line("}", "");
            }
            StmtKind::While { condition, body } => {
                let head = format!("while ({})", self.condition(condition));
                self.block(&head, &stmt.marks, body);
            }
            StmtKind::DoWhile { body, condition } => {
                self.line("do {", note);
                self.body(body);
                let condition = self.condition(condition);
                self.line(&format!("}} while ({condition});"), "");
            }
            StmtKind::For { init, condition, step, body } => {
                let init = self.for_init(init);
                let condition = condition.as_ref().map(|one| format!(" {}", self.condition(one)));
                let step = step.as_ref().map(|one| format!(" {}", self.expr(one)));
                let (condition, step) = (condition.unwrap_or_default(), step.unwrap_or_default());
                self.block(&format!("for ({init};{condition};{step})"), &stmt.marks, body);
            }
            StmtKind::Break => self.line("break;", note),
            StmtKind::Continue => self.line("continue;", note),
            StmtKind::Return(None) => self.line("return;", note),
            StmtKind::Return(Some(value)) => {
                let text = self.expr(value);
                self.line(&format!("return {text};"), note);
            }
            StmtKind::Block(body) => self.block("", &stmt.marks, body),
            StmtKind::Barrier => self.line("__asm__ volatile(\"\" ::: \"memory\");", note),
            StmtKind::Opaque(text) => {
                self.line("{", "");
                text.lines().for_each(|line| self.line(line.trim_end(), ""));
                self.line("}", "");
            }
        }
    }

    fn case(&mut self, case: &Case) {
        for (at, label) in case.labels.iter().enumerate() {
            let text = match label {
                Label::Case(value, _) => format!("case {}:", self.expr(value)),
                Label::Default => "default:".to_owned(),
            };
            self.line(&text, if at == 0 { &case.marks.note } else { "" });
        }
        if case.body.is_empty() {
            // A label must precede a statement, even at the end of a block.
            self.indent += 1;
            self.line(";", "");
            self.indent -= 1;
        }
        self.body(&case.body);
    }

    fn define(&mut self, stmt: &Stmt) {
        if let StmtKind::Define { symbol, init } = &stmt.kind {
            let head = self.declared(*symbol, None);
            let head = match self.unit.symbols[*symbol].kind {
                SymbolKind::Local { is_static: true } => format!("static {head}"),
                SymbolKind::Local { is_static: false }
                | SymbolKind::Object { .. }
                | SymbolKind::Parameter
                | SymbolKind::Function(_)
                | SymbolKind::Typedef
                | SymbolKind::Constant(_) => head,
            };
            self.initialised(&head, *symbol, init.as_ref(), &stmt.marks.note);
        }
    }

    /// The first clause of a `for`. Several definitions share one type specifier.
    fn for_init(&mut self, init: &[Stmt]) -> String {
        let mut text = String::new();
        for (at, stmt) in init.iter().enumerate() {
            match &stmt.kind {
                StmtKind::Define { symbol, init } => {
                    let declared = if at == 0 {
                        self.declared(*symbol, None)
                    } else {
                        self.declared_without_base(*symbol)
                    };
                    text.push_str(if at == 0 { "" } else { ", " });
                    text.push_str(&declared);
                    if let Some(init) = init {
                        text.push_str(" = ");
                        let ty = &self.unit.symbols[*symbol].canonical.ty;
                        text.push_str(&self.init(init, ty));
                    }
                }
                StmtKind::Expr(value) => text.push_str(&self.expr(value)),
                StmtKind::If { .. }
                | StmtKind::Switch { .. }
                | StmtKind::While { .. }
                | StmtKind::DoWhile { .. }
                | StmtKind::For { .. }
                | StmtKind::Break
                | StmtKind::Continue
                | StmtKind::Return(_)
                | StmtKind::Block(_)
                | StmtKind::Barrier
                | StmtKind::Opaque(_) => {
                    unreachable!("the first part of a `for` defines locals or is an expression")
                }
            }
        }
        text
    }
}

/// The text on one line, without character sequences that would end a comment.
fn comment(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        let c = if grafsynth_ir::names::is_unseen(c) { ' ' } else { c };
        // `*/` would end the comment, `/*` causes a warning, `??/` is a trigraph.
        if c == '/' && out.ends_with('*')
            || c == '*' && out.ends_with('/')
            || c == '?' && out.ends_with('?')
        {
            out.push(' ');
        }
        out.push(c);
    }
    out.trim().to_owned()
}
