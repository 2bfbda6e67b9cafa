//! What a style decides: everything that differs between the styles, ready to be laid out in files by [`crate::header`].

use crate::Object;
use crate::cexpr::Helpers;
use crate::ctext::Node;
use crate::times::Ticks;
use grafsynth_ir::IdMap;
use grafsynth_ir::net::Step;

/// A member of the instance structure.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Member {
    /// Type and name, with the length of an array or the width of a bit-field: `uint8_t state`.
    pub(crate) declaration: String,
    /// What it holds.
    pub(crate) note: String,
    /// What of the net it holds.
    pub(crate) objects: Vec<Object>,
}

/// A chart in C, all decisions taken.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct CProgram {
    /// The name of the style, for the header.
    pub(crate) style: &'static str,
    /// The state between reactions; a chart without any has none.
    pub(crate) instance: Vec<Member>,
    /// Enumerators that name values of the instance.
    pub(crate) enumerators: Vec<Node>,
    /// For each step, the condition that it is active, over `self`.
    pub(crate) active: IdMap<Step, String>,
    /// The condition of a fault in the last reaction, over `self`; none where no reaction can have one.
    pub(crate) fault: Option<String>,
    /// The chart has a `fault` at all (stable evolution or queues).
    pub(crate) has_fault: bool,
    /// How time comes in; none when nothing depends on it.
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
}

/// True when some line of the text holds `word`.
pub(crate) fn mentions(nodes: &[Node], word: &str) -> bool {
    use crate::ctext::Kind;
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

/// True when `word` stands in `text` as a whole identifier.
fn has_word(text: &str, word: &str) -> bool {
    let is_part = |c: char| c.is_ascii_alphanumeric() || c == '_';
    text.match_indices(word).any(|(at, _)| {
        let before = text[..at].chars().next_back();
        let after = text[at + word.len()..].chars().next();
        // A member of that name (`out->in`) is no use of the parameter.
        !before.is_some_and(|c| is_part(c) || c == '>' || c == '.') && !after.is_some_and(is_part)
    })
}

/// `(void)name;` for each parameter that the body does not use.
pub(crate) fn with_unused(parameters: &[&str], mut body: Vec<Node>) -> Vec<Node> {
    let unused: Vec<Node> = parameters
        .iter()
        .filter(|name| !mentions(&body, name))
        .map(|name| Node::line(format!("(void){name};")))
        .collect();
    // Declarations come first in a block; C99 does not ask for it, readers do.
    let at = body.len();
    body.splice(at..at, unused);
    body
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_whole_and_no_members() {
        assert!(has_word("if (in->a) {", "in"));
        assert!(!has_word("self->in = 1;", "in"));
        assert!(!has_word("main();", "in"));
    }
}
