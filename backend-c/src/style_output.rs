//! The result of a style: everything that differs between the styles, ready for [`crate::header`] to lay out in files.

use crate::c::print::{Arm, Kind, Node};
use crate::cexpr::Helpers;
use crate::engine::room::Room;
use crate::range::Range;
use crate::times::Ticks;
use crate::{FileKind, Object};
use grafsynth_ir::Gather;
use grafsynth_ir::IdMap;
use grafsynth_ir::instance::{Carried, Holds, Local, Place};
use grafsynth_ir::net::{Step, StepId, VarId};
use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};

/// A member of the instance structure.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Member {
    /// Type and name, with the length of an array or the width of a bit-field: `uint8_t state`.
    pub(crate) declaration: String,
    /// A description of its contents.
    pub(crate) note: String,
    /// The objects of the net that it represents.
    pub(crate) objects: Vec<Object>,
}

/// A chart in C after all decisions.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct StyleOutput {
    /// The name of the style, for the header.
    pub(crate) style: &'static str,
    /// The state between reactions; empty for a chart without state.
    pub(crate) instance: Vec<Member>,
    /// Enumerators that name values of the instance.
    pub(crate) enumerators: Vec<Node>,
    /// For each step, the condition that it is active, over `self`.
    pub(crate) active: IdMap<Step, String>,
    /// The condition of a fault in the last reaction, over `self`; `None` if no reaction can have one.
    pub(crate) fault: Option<String>,
    /// True if the chart has a `fault` function (stable evolution or queues).
    pub(crate) has_fault: bool,
    /// How time is passed in; `None` if nothing depends on time.
    pub(crate) ticks: Option<Ticks>,
    /// Private types and tables.
    pub(crate) tables: Vec<Node>,
    /// Private functions, callees first.
    pub(crate) functions: Vec<Node>,
    /// The body of `NAME_init`.
    pub(crate) init: Vec<Node>,
    /// The body of `NAME_step`.
    pub(crate) step: Vec<Node>,
    /// The helpers that are called.
    pub(crate) helpers: Helpers,
    /// Additional parts of a chart that an engine interprets.
    pub(crate) engine: Option<Engine>,
    /// The value ranges of the instance members that are not single bits; empty if an engine stores them.
    pub(crate) ranges: Vec<Range>,
    /// The contents of each scalar of the instance, for the proof; empty if the style does not state them.
    pub(crate) holds: Vec<(Place, Holds)>,
    /// The contents of the locals of a reaction between the checks of a statechart, for the proof.
    pub(crate) locals: Vec<(Local, Carried)>,
    /// Steps that have their own bit, so that only a proof shows that two of them exclude each other.
    pub(crate) one_bit: BTreeSet<StepId>,
}

/// A file of an engine: its kind, name and text.
pub(crate) type EngineFile = (FileKind, &'static str, Cow<'static, str>);

/// The additional files and declarations of a chart that an engine interprets.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Engine {
    /// The engine's own files, the same for every chart, headers first.
    pub(crate) files: Vec<EngineFile>,
    /// The instance for which the image is checked, if there is one.
    pub(crate) room: Option<Room>,
    /// The maximum number of instructions that one reaction interprets, if the image is a program.
    pub(crate) instructions: Option<u64>,
    /// The file, one of these, that the chart's header includes.
    pub(crate) include: &'static str,
    /// The part of the header before the instance.
    pub(crate) before: Vec<Node>,
    /// Functions that the header declares.
    pub(crate) declarations: Vec<Node>,
    /// The expression that reads each variable, over `self`.
    pub(crate) values: BTreeMap<VarId, String>,
    /// The image that the engine loads; empty if it has none.
    pub(crate) image: Vec<u8>,
    /// The text of `NAME_tables.c` below its banner.
    pub(crate) tables: Vec<Node>,
}

/// True if some line of the text contains `word`.
pub(crate) fn mentions(nodes: &[Node], word: &str) -> bool {
    nodes.iter().any(|node| match &node.kind {
        Kind::Blank | Kind::Comment(_) => false,
        Kind::Line(text) | Kind::Verbatim(text) | Kind::Directive(text) => has_word(text, word),
        Kind::Block(arms) => {
            arms.iter().any(|arm| has_word(&arm.head, word) || mentions(&arm.body, word))
        }
        Kind::Case(_, body) | Kind::Nested(body) | Kind::Function(_, body) => mentions(body, word),
        Kind::Braces(head, body, tail) => {
            has_word(head, word) || has_word(tail, word) || mentions(body, word)
        }
    })
}

/// True if `word` occurs in `text` as a whole identifier.
fn has_word(text: &str, word: &str) -> bool {
    match word.strip_prefix('&') {
        // An address: the `&` precedes the identifier.
        Some(name) => {
            text.match_indices(word).any(|(at, _)| words(&text[at + 1..]).next() == Some(name))
        }
        None => words(text).any(|it| it == word),
    }
}

/// The identifiers and numbers of a line, except members: a member access (`out->in`) does not use a local or parameter of that name.
fn words(text: &str) -> impl Iterator<Item = &str> {
    let is_part = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let mut rest = text;
    let mut before = ' ';
    std::iter::from_fn(move || {
        loop {
            let start = rest.find(is_part)?;
            before = rest[..start].chars().next_back().unwrap_or(before);
            let word = &rest[start..];
            let end = word.find(|c: char| !is_part(c)).unwrap_or(word.len());
            rest = &word[end..];
            let is_member = matches!(before, '>' | '.');
            before = ' ';
            if !is_member {
                return Some(&word[..end]);
            }
        }
    })
}

/// `(void)name;` for each parameter that the body does not use.
pub(crate) fn with_unused(parameters: &[&str], mut body: Vec<Node>) -> Vec<Node> {
    let unused = parameters.iter().filter(|name| !mentions(&body, name));
    let unused: Vec<Node> = unused.map(|name| Node::line(format!("(void){name};"))).collect();
    body.extend(unused);
    body
}

/// A body without the locals that are never read. Folding leaves such locals: a receptivity that became constant no longer reads its inputs.
pub(crate) fn without_unused(mut body: Vec<Node>) -> Vec<Node> {
    loop {
        let mut reads: BTreeMap<String, usize> = BTreeMap::new();
        definitions(&body, &mut reads);
        if reads.is_empty() {
            return body;
        }
        count_reads(&body, &mut reads);
        let unread: BTreeSet<String> =
            reads.into_iter().filter(|(_, count)| *count == 0).map(|(name, _)| name).gather();
        if unread.is_empty() {
            return body;
        }
        body = drop_definitions(body, &unread);
    }
}

fn definitions(nodes: &[Node], names: &mut BTreeMap<String, usize>) {
    for node in nodes {
        if let Some(definition) = &node.defines {
            names.insert(definition.name.clone(), 0);
        }
        for list in lists(node) {
            definitions(list, names);
        }
    }
}

/// Counts how often each name occurs outside its own definitions.
fn count_reads(nodes: &[Node], names: &mut BTreeMap<String, usize>) {
    for node in nodes {
        let own = node.defines.as_ref().map(|it| it.name.as_str());
        let mut look = |text: &str| {
            for word in words(text).filter(|word| Some(*word) != own) {
                if let Some(count) = names.get_mut(word) {
                    *count += 1;
                }
            }
        };
        match &node.kind {
            Kind::Line(text) | Kind::Verbatim(text) | Kind::Directive(text) => look(text),
            Kind::Block(arms) => arms.iter().for_each(|arm| look(&arm.head)),
            Kind::Braces(head, _, tail) => {
                look(head);
                look(tail);
            }
            _ => {}
        }
        for list in lists(node) {
            count_reads(list, names);
        }
    }
}

fn lists(node: &Node) -> Vec<&[Node]> {
    match &node.kind {
        Kind::Block(arms) => arms.iter().map(|arm| arm.body.as_slice()).collect(),
        Kind::Case(_, body)
        | Kind::Nested(body)
        | Kind::Function(_, body)
        | Kind::Braces(_, body, _) => {
            vec![body.as_slice()]
        }
        Kind::Blank | Kind::Line(_) | Kind::Comment(_) | Kind::Verbatim(_) | Kind::Directive(_) => {
            Vec::new()
        }
    }
}

fn drop_definitions(nodes: Vec<Node>, unread: &BTreeSet<String>) -> Vec<Node> {
    let mut kept = Vec::with_capacity(nodes.len());
    for mut node in nodes {
        if let Some(definition) = &node.defines
            && unread.contains(&definition.name)
        {
            if let Some(effect) = definition.effect.clone() {
                kept.push(Node { kind: Kind::Line(effect), defines: None, ..node });
            }
            continue;
        }
        node.kind = match node.kind {
            Kind::Block(arms) => Kind::Block(
                arms.into_iter()
                    .map(|arm| Arm { body: drop_definitions(arm.body, unread), ..arm })
                    .collect(),
            ),
            Kind::Case(heads, body) => Kind::Case(heads, drop_definitions(body, unread)),
            Kind::Nested(body) => Kind::Nested(drop_definitions(body, unread)),
            Kind::Function(head, body) => Kind::Function(head, drop_definitions(body, unread)),
            Kind::Braces(head, body, tail) => {
                Kind::Braces(head, drop_definitions(body, unread), tail)
            }
            kind => kind,
        };
        kept.push(node);
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unread_locals_go_and_calls_stay() {
        let body = vec![
            Node::line("bool cond = f();").defining_by("cond", "(void)f();"),
            Node::line("const bool rise = cond && !self->was;").defining("rise"),
            Node::line("g();"),
        ];
        let kept = without_unused(body);
        assert_eq!(kept, [Node::line("(void)f();"), Node::line("g();")]);
    }

    #[test]
    fn words_are_whole_and_no_members() {
        assert!(has_word("if (in->a) {", "in"));
        assert!(!has_word("self->in = 1;", "in"));
        assert!(!has_word("main();", "in"));
        assert!(!has_word("a > b;", "c") && has_word("a >b;", "a"));
        assert!(has_word("f(self, &scan);", "&scan") && !has_word("f(&scanner);", "&scan"));
    }
}
