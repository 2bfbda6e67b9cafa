//! C text as a tree, and the writer that prints it.
//!
//! The tree defines the layout; it does not depend on charts. All decisions (names, types, order, style) are made earlier, in
//! [`crate::switch`], [`crate::bits`] and [`crate::header`]; the writer only indents, places comments and records the origin of each line.

use crate::Object;
use grafsynth_ir::names::is_unseen;
use grafsynth_ir::net::StepId;
use std::fmt::Display;

/// A piece of a file.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Node {
    /// The kind of the piece, with its contents.
    pub(crate) kind: Kind,
    /// A comment at the end of the (first) line; empty if there is none.
    pub(crate) note: String,
    /// The objects of the net from which this piece is generated.
    pub(crate) objects: Vec<Object>,
    /// For a line that only defines a local: see [`crate::style_output::without_unused`].
    pub(crate) defines: Option<Definition>,
}

/// A local that a line defines.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Definition {
    /// The local.
    pub(crate) name: String,
    /// The text that must be printed even if nothing reads the local: a call, for its effect.
    pub(crate) effect: Option<String>,
}

/// The kinds of pieces.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) enum Kind {
    /// An empty line.
    #[default]
    Blank,
    /// One line, unchanged.
    Line(String),
    /// A separate comment, one line for each line of the text.
    Comment(String),
    /// User text: its lines are printed unchanged, at the current indentation.
    Verbatim(String),
    /// A preprocessor line, never indented.
    Directive(String),
    /// `head {` body `}`; further branches (`else if`, `else`) follow on the closing line.
    Block(Vec<Arm>),
    /// `case X:` (its labels), followed by its contents one level deeper.
    Case(Vec<String>, Vec<Node>),
    /// Pieces one level deeper.
    Nested(Vec<Node>),
    /// A function: the opening brace is on its own line.
    Function(String, Vec<Node>),
    /// `head {` body `} tail`: a type or a table.
    Braces(String, Vec<Node>, String),
}

/// The roles of the branches of a [`Kind::Block`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ArmKind {
    /// The only one, such as a loop.
    Single,
    /// A condition: `else` is printed before it unless it is the first branch.
    Condition,
    /// All other cases: the last branch.
    Otherwise,
}

/// One branch of a [`Kind::Block`].
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Arm {
    /// `if (..)`, `switch (..)`, `while (..)`; empty for `else`.
    pub(crate) head: String,
    /// The role of the branch in its chain.
    pub(crate) kind: ArmKind,
    /// A comment after the opening brace.
    pub(crate) note: String,
    /// The objects of the net that this branch comes from.
    pub(crate) objects: Vec<Object>,
    /// The contents.
    pub(crate) body: Vec<Node>,
    /// The maximum number of rounds of a loop, if its head does not show it. The code that sets this number states the reason.
    pub(crate) at_most: Option<u64>,
    /// For an `if` that runs a task: the step and the index of its task.
    pub(crate) task: Option<(StepId, usize)>,
}

impl Arm {
    /// A block with that text before its brace, such as a loop.
    pub(crate) fn new(head: impl Into<String>, body: Vec<Node>) -> Self {
        Arm {
            head: head.into(),
            kind: ArmKind::Single,
            note: String::new(),
            objects: Vec::new(),
            body,
            at_most: None,
            task: None,
        }
    }

    /// A branch with its condition.
    pub(crate) fn when(condition: &str, body: Vec<Node>) -> Self {
        Arm { kind: ArmKind::Condition, ..Arm::new(format!("if ({condition})"), body) }
    }

    /// The branch for all other cases.
    pub(crate) fn otherwise(body: Vec<Node>) -> Self {
        Arm { kind: ArmKind::Otherwise, ..Arm::new("", body) }
    }

    /// The text before the opening brace of the branch with that index.
    fn text(&self, index: usize) -> String {
        match self.kind {
            ArmKind::Condition if index > 0 => format!("else {}", self.head),
            ArmKind::Single | ArmKind::Condition => self.head.clone(),
            ArmKind::Otherwise => "else".to_owned(),
        }
    }

    /// Sets the maximum number of rounds of a loop.
    pub(crate) fn at_most(mut self, rounds: u64) -> Self {
        self.at_most = Some(rounds);
        self
    }

    /// Adds a comment and the object that the branch comes from.
    pub(crate) fn noted(mut self, note: impl Into<String>, object: Object) -> Self {
        self.note = note.into();
        self.objects.push(object);
        self
    }
}

impl Node {
    pub(crate) fn line(text: impl Into<String>) -> Self {
        Kind::Line(text.into()).into()
    }

    pub(crate) fn comment(text: impl Into<String>) -> Self {
        Kind::Comment(text.into()).into()
    }

    pub(crate) fn directive(text: impl Into<String>) -> Self {
        Kind::Directive(text.into()).into()
    }

    pub(crate) fn blank() -> Self {
        Kind::Blank.into()
    }

    /// `if (condition) { .. }`.
    pub(crate) fn when(condition: &str, body: Vec<Node>) -> Self {
        Kind::Block(vec![Arm::when(condition, body)]).into()
    }

    /// `head { .. }`.
    pub(crate) fn block(head: impl Into<String>, body: Vec<Node>) -> Self {
        Kind::Block(vec![Arm::new(head, body)]).into()
    }

    /// A function definition.
    pub(crate) fn function(head: impl Into<String>, body: Vec<Node>) -> Self {
        Kind::Function(head.into(), body).into()
    }

    /// The definition of a type: `typedef head { .. } name;`. `head` is `struct` or `enum`.
    pub(crate) fn typedef(head: &str, body: Vec<Node>, name: impl Display) -> Self {
        Kind::Braces(format!("typedef {head}"), body, format!(" {name};")).into()
    }

    /// A definition with braces: `head { .. };`, such as a table or an `enum` without a name.
    pub(crate) fn braced(head: impl Into<String>, body: Vec<Node>) -> Self {
        Kind::Braces(head.into(), body, ";".to_owned()).into()
    }

    /// A constant table: `static UPPER_ROM ty name[..] = { .. };`. Each row is the line of an element, without a comma.
    pub(crate) fn table(upper: &str, ty: &str, name: &str, mut rows: Vec<Node>) -> Self {
        let count = rows.len();
        for row in rows.iter_mut().rev().skip(1) {
            if let Kind::Line(text) = &mut row.kind {
                text.push(',');
            }
        }
        Node::braced(format!("static {upper}_ROM {ty} {name}[{count}] ="), rows)
    }

    /// `case label: .. break;`.
    pub(crate) fn case(label: impl Display, body: Vec<Node>) -> Self {
        Node::cases([label], body)
    }

    /// `case label: case label: .. break;`.
    pub(crate) fn cases(labels: impl IntoIterator<Item: Display>, mut body: Vec<Node>) -> Self {
        body.push(Node::line("break;"));
        Kind::Case(labels.into_iter().map(|it| format!("case {it}:")).collect(), body).into()
    }

    /// A `switch` that does nothing for all values without a case.
    pub(crate) fn switch(subject: impl Display, mut cases: Vec<Node>) -> Self {
        cases.push(Kind::Case(vec!["default:".to_owned()], vec![Node::line("break;")]).into());
        Node::block(format!("switch ({subject})"), cases)
    }

    /// A macro with its default value: `#ifndef`, `#define`, `#endif`. `name` contains the parameters, if any.
    pub(crate) fn default_macro(name: &str, value: &str) -> [Self; 3] {
        let (bare, _) = name.split_once('(').unwrap_or((name, ""));
        [
            Node::directive(format!("#ifndef {bare}")),
            Node::directive(format!("#define {name} {value}")),
            Node::directive("#endif"),
        ]
    }

    /// A function definition with a comment above and an empty line below.
    pub(crate) fn documented(comment: &str, head: String, body: Vec<Node>) -> [Self; 3] {
        [Node::comment(comment), Node::function(head, body), Node::blank()]
    }

    /// Declarations with the linkage of C, also in C++.
    pub(crate) fn c_linkage(declarations: Vec<Node>) -> impl Iterator<Item = Self> {
        let within = |line: &str| {
            [Node::directive("#ifdef __cplusplus"), Node::line(line), Node::directive("#endif")]
        };
        [Node::blank()]
            .into_iter()
            .chain(within("extern \"C\" {"))
            .chain([Node::blank()])
            .chain(declarations)
            .chain(within("}"))
            .chain([Node::blank()])
    }

    /// Adds a comment at the end of the line.
    pub(crate) fn note(mut self, note: impl Into<String>) -> Self {
        self.note = note.into();
        self
    }

    /// Marks the line as the definition of a local. A structure member does not count: another function may read it.
    pub(crate) fn defining(self, name: impl Into<String>) -> Self {
        self.definition(name.into(), None)
    }

    /// Marks the line as the definition of a local by a call that must always be made.
    pub(crate) fn defining_by(self, name: impl Into<String>, effect: impl Into<String>) -> Self {
        self.definition(name.into(), Some(effect.into()))
    }

    fn definition(mut self, name: String, effect: Option<String>) -> Self {
        if name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_') {
            self.defines = Some(Definition { name, effect });
        }
        self
    }

    /// Adds an origin.
    pub(crate) fn about(mut self, object: Object) -> Self {
        self.objects.push(object);
        self
    }

    /// Adds several origins.
    pub(crate) fn about_all(mut self, objects: impl IntoIterator<Item = Object>) -> Self {
        self.objects.extend(objects);
        self
    }
}

impl From<Kind> for Node {
    fn from(kind: Kind) -> Self {
        Node { kind, note: String::new(), objects: Vec::new(), defines: None }
    }
}

/// Text that is safe inside a C comment, on one line.
pub(crate) fn comment_text(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        let c = if is_unseen(c) { ' ' } else { c };
        // `*/` would end the comment, `/*` causes a warning, `??/` is a trigraph.
        if (c == '/' && out.ends_with('*'))
            || (c == '*' && out.ends_with('/'))
            || (c == '?' && out.ends_with('?'))
        {
            out.push(' ');
        }
        out.push(c);
    }
    out.trim().to_string()
}

/// Additional facts for an analysis of the text; lines are counted from 1.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Marks {
    /// Lines of loops with the maximum number of rounds.
    pub(crate) loops: Vec<(u32, u64)>,
    /// Lines of `if`s that run a task: the step, and the index of the task.
    pub(crate) tasks: Vec<(u32, StepId, usize)>,
    /// First and last lines of user text.
    pub(crate) user: Vec<(u32, u32)>,
}

/// Prints a tree.
#[derive(Debug, Default)]
pub(crate) struct Writer {
    text: String,
    line: u32,
    indent: usize,
    map: Vec<(u32, Vec<Object>)>,
    marks: Marks,
}

impl Writer {
    /// The text of all `nodes` and, for each line that comes from the net, its origins.
    pub(crate) fn write(nodes: &[Node]) -> (String, Vec<(u32, Vec<Object>)>) {
        let mut writer = Writer::default();
        writer.nodes(nodes);
        (writer.text, writer.map)
    }

    /// Like [`Writer::write`], with the facts for an analysis.
    pub(crate) fn write_marked(nodes: &[Node]) -> (String, Vec<(u32, Vec<Object>)>, Marks) {
        let mut writer = Writer::default();
        writer.nodes(nodes);
        (writer.text, writer.map, writer.marks)
    }

    fn nodes(&mut self, nodes: &[Node]) {
        for node in nodes {
            self.node(node);
        }
    }

    fn node(&mut self, node: &Node) {
        match &node.kind {
            Kind::Blank => self.put("", "", &node.objects),
            Kind::Line(text) => self.put(text, &node.note, &node.objects),
            Kind::Comment(text) => self.comment(text, &node.objects),
            Kind::Verbatim(text) => {
                let first = self.line + 1;
                for line in text.lines() {
                    self.put(line.trim_end(), "", &node.objects);
                }
                if self.line >= first {
                    self.marks.user.push((first, self.line));
                }
            }
            Kind::Directive(text) => {
                let indent = std::mem::take(&mut self.indent);
                self.put(text, &node.note, &node.objects);
                self.indent = indent;
            }
            Kind::Block(arms) => self.block(arms, node),
            Kind::Case(heads, body) => {
                for (index, head) in heads.iter().enumerate() {
                    let note = if index == 0 { node.note.as_str() } else { "" };
                    self.put(head, note, &node.objects);
                }
                self.indented(body);
            }
            Kind::Nested(body) => self.indented(body),
            Kind::Function(head, body) => {
                self.put(head, &node.note, &node.objects);
                self.put("{", "", &[]);
                self.indented(body);
                self.put("}", "", &[]);
            }
            Kind::Braces(head, body, tail) => {
                self.put(&format!("{head} {{"), &node.note, &node.objects);
                self.indented(body);
                self.put(&format!("}}{tail}"), "", &[]);
            }
        }
    }

    fn block(&mut self, arms: &[Arm], node: &Node) {
        for (index, arm) in arms.iter().enumerate() {
            let open = if index == 0 { "" } else { "} " };
            let objects: Vec<Object> = if index == 0 {
                node.objects.iter().chain(&arm.objects).copied().collect()
            } else {
                arm.objects.clone()
            };
            let note = if index == 0 && arm.note.is_empty() { &node.note } else { &arm.note };
            self.put(&format!("{open}{} {{", arm.text(index)), note, &objects);
            if let Some(rounds) = arm.at_most {
                self.marks.loops.push((self.line, rounds));
            }
            if let Some((step, task)) = arm.task {
                self.marks.tasks.push((self.line, step, task));
            }
            // The cases of a `switch` have the same indentation as the `switch`.
            if arm.body.iter().any(|it| matches!(it.kind, Kind::Case(..))) {
                self.nodes(&arm.body);
            } else {
                self.indented(&arm.body);
            }
        }
        // A chain ends with an `else`, which shows that no case was forgotten (MISRA-C:2012, rule 15.7).
        if arms.len() > 1 && arms.last().is_some_and(|arm| arm.kind == ArmKind::Condition) {
            self.put("} else {", "", &[]);
            self.indented(&[Node::comment("Nothing else happens.")]);
        }
        self.put("}", "", &[]);
    }

    fn indented(&mut self, nodes: &[Node]) {
        self.indent += 1;
        self.nodes(nodes);
        self.indent -= 1;
    }

    fn comment(&mut self, text: &str, objects: &[Object]) {
        let lines: Vec<String> = text.lines().map(comment_text).collect();
        match lines.as_slice() {
            [] => {}
            [only] => self.put(&format!("/* {only} */"), "", objects),
            [first, rest @ ..] => {
                self.put(&format!("/* {first}"), "", objects);
                for (index, line) in rest.iter().enumerate() {
                    let end = if index + 1 == rest.len() { " */" } else { "" };
                    let space = if line.is_empty() { "" } else { " " };
                    self.put(&format!(" *{space}{line}{end}"), "", objects);
                }
            }
        }
    }

    fn put(&mut self, text: &str, note: &str, objects: &[Object]) {
        self.line += 1;
        if !text.is_empty() {
            for _ in 0..self.indent {
                self.text.push_str("    ");
            }
            self.text.push_str(text);
        }
        if !note.is_empty() {
            self.text.push_str(" /* ");
            self.text.push_str(&comment_text(note));
            self.text.push_str(" */");
        }
        self.text.push('\n');
        if !objects.is_empty() {
            self.map.push((self.line, objects.to_vec()));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_cannot_be_left() {
        assert_eq!(comment_text("a */ b /* c\nd ??/"), "a * / b / * c d ? ?/");
        assert_eq!(comment_text("**//**"), "** // **");
        assert_eq!(comment_text("a\u{202e}b\u{2028}c"), "a b c");
    }

    #[test]
    fn arms_share_a_line_with_the_closing_brace() {
        let arms = vec![
            Arm::when("a", vec![Node::line("b();")])
                .noted("t1", Object::Step(grafsynth_ir::Id::from_index(0))),
            Arm::otherwise(vec![Node::line("c();")]),
        ];
        let (text, map) = Writer::write(&[Kind::Block(arms).into()]);
        assert_eq!(text, "if (a) { /* t1 */\n    b();\n} else {\n    c();\n}\n");
        assert_eq!(map.len(), 1);
    }
}
