//! Layout of the canonical text in Wadler's algebra (crate `pretty`): a group is written on one line if it fits, and otherwise on several.
//!
//! Widths are bytes: the fingerprint of a library depends on where its lines are broken.

use pretty::{Doc as Node, RcDoc};

/// The maximum line width in bytes. A piece without a possible line break may exceed it.
pub(super) const WIDTH: usize = 100;

/// A text whose line breaks are not yet chosen.
pub(super) type Doc = RcDoc<'static>;

/// A text that is written unchanged. The layout adds no indentation after a line break in it.
pub(super) fn text(text: impl Into<Box<str>>) -> Doc {
    Node::OwnedText(text.into()).into()
}

/// A text that is not counted in the width of its line, so that the line may exceed the maximum.
pub(super) fn wide(written: impl Into<Box<str>>) -> Doc {
    Node::RenderLen(0, text(written)).into()
}

/// An empty document. The group that contains it cannot be written on one line.
pub(super) fn broken() -> Doc {
    Doc::nil().flat_alt(Doc::fail())
}

pub(super) fn indented(doc: Doc) -> Doc {
    doc.nest(4)
}

/// A line break; if the group is written on one line, `flat` replaces it.
fn newline(flat: &'static str) -> Doc {
    Doc::hardline().flat_alt(flat)
}

/// Joins pieces with blanks, or with a line break if the next piece would leave fewer than `reserve` columns free. Each piece but the last ends with `between`;
/// each but the first begins with `lead`.
pub(super) fn fill(
    pieces: &[String],
    between: &'static str,
    lead: &'static str,
    reserve: usize,
) -> Doc {
    let docs = pieces.iter().enumerate().map(|(index, piece)| {
        let between = if index + 1 < pieces.len() { between } else { "" };
        if index == 0 {
            return text(format!("{piece}{between}"));
        }
        let piece = format!("{lead}{piece}{between}");
        let width = 1 + piece.len() + reserve;
        let space = move |column| {
            if column + width > WIDTH { Doc::hardline() } else { Doc::space() }
        };
        Doc::column(space).append(text(piece))
    });
    indented(concat(&docs.collect::<Vec<_>>()))
}

/// Pieces that are written on separate lines, or together on one line if they fit.
pub(super) struct Lines {
    lines: Vec<Doc>,
    /// The separator before the next piece.
    start: Doc,
    /// The separator of pieces that are written on the same line.
    between: &'static str,
    /// Whether the lines that are added next are indented.
    pub(super) hanging: bool,
}

impl Lines {
    /// The lines of a text.
    pub(super) fn outermost() -> Self {
        Lines { lines: Vec::new(), start: Doc::nil(), between: "", hanging: false }
    }

    /// The lines of a block. On one line they are separated by `between`.
    pub(super) fn separated_by(between: &'static str) -> Self {
        Lines { lines: Vec::new(), start: newline(" "), between, hanging: false }
    }

    pub(super) fn push(&mut self, doc: Doc) {
        let line = std::mem::replace(&mut self.start, newline(self.between)).append(doc);
        self.lines.push(if self.hanging { indented(line) } else { line });
    }

    /// Adds a blank line before the next line. It has no indentation and no width.
    pub(super) fn blank(&mut self) {
        if !self.lines.is_empty() {
            self.start = wide("\n").append(Doc::hardline()).flat_alt(self.between);
        }
    }

    /// Appends `doc` to the last line.
    pub(super) fn extend_last(&mut self, doc: Option<Doc>) {
        if let (Some(doc), Some(last)) = (doc, self.lines.last_mut()) {
            *last = last.clone().append(doc);
        }
    }

    /// Lays out the last piece now, at this nesting level, and keeps only its text. The piece must begin its own line.
    pub(super) fn settle(&mut self, level: usize) {
        if let Some(last) = self.lines.last_mut() {
            let deep = (0..level).fold(last.clone(), |doc, _| indented(doc));
            *last = wide(deep.pretty(WIDTH).to_string());
        }
    }

    /// Puts the lines in braces, one level deeper. `comment` follows the opening brace.
    pub(super) fn in_braces(self, comment: Option<Doc>) -> Doc {
        let end = newline(if self.lines.is_empty() { "" } else { " " });
        Doc::text("{").append(comment).append(indented(self.below())).append(end).append("}")
    }

    pub(super) fn below(self) -> Doc {
        concat(&self.lines)
    }

    /// The text of the outermost lines.
    pub(super) fn render(self) -> String {
        self.below().pretty(WIDTH).to_string()
    }
}

/// The document on one line, unless it contains a forced line break.
pub(super) fn on_one_line(doc: Doc) -> String {
    doc.group().pretty(usize::MAX).to_string()
}

/// Concatenates documents as a balanced tree, so that many lines do not make a deep tree.
fn concat(docs: &[Doc]) -> Doc {
    match docs {
        [] => Doc::nil(),
        [only] => only.clone(),
        _ => {
            let (left, right) = docs.split_at(docs.len() / 2);
            concat(left).append(concat(right))
        }
    }
}
