//! Layout of the canonical text in Wadler's algebra (crate `pretty`): a group is written on one line if it fits, and otherwise on several.
//!
//! Widths are bytes: the fingerprint of a library depends on where its lines are broken.

use pretty::{Doc as Node, RcDoc};

/// The maximum line width, where it can be kept.
pub(super) const WIDTH: usize = 100;

/// A text whose line breaks are not yet chosen.
pub(super) type Doc = RcDoc<'static>;

/// A text without a choice. A line break in it is written as it is, without indentation.
pub(super) fn text(text: impl Into<Box<str>>) -> Doc {
    Node::OwnedText(text.into()).into()
}

/// A text that may exceed the width of its line.
pub(super) fn wide(written: impl Into<Box<str>>) -> Doc {
    Node::RenderLen(0, text(written)).into()
}

/// Nothing, but what contains it does not fit on one line.
pub(super) fn broken() -> Doc {
    Doc::nil().flat_alt(Doc::fail())
}

pub(super) fn indented(doc: Doc) -> Doc {
    doc.nest(4)
}

/// A line break, or `flat` on one line.
fn newline(flat: &'static str) -> Doc {
    Doc::hardline().flat_alt(flat)
}

/// Joins pieces with blanks, and with line breaks where the next piece would leave less than `reserve` columns. `between` ends each piece
/// but the last, `lead` begins each but the first.
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

/// Lines below each other, or beside each other if they are short.
pub(super) struct Lines {
    lines: Vec<Doc>,
    /// What begins the next line.
    start: Doc,
    /// What separates lines beside each other.
    between: &'static str,
    /// The next lines are indented.
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

    /// A blank line precedes the next line. It is not indented, and needs no room.
    pub(super) fn blank(&mut self) {
        if !self.lines.is_empty() {
            self.start = wide("\n").append(Doc::hardline()).flat_alt(self.between);
        }
    }

    /// Continues the last line.
    pub(super) fn extend_last(&mut self, doc: Option<Doc>) {
        if let (Some(doc), Some(last)) = (doc, self.lines.last_mut()) {
            *last = last.clone().append(doc);
        }
    }

    /// Chooses the breaks of the last line, so that only its text is kept. It is not a part of a line.
    pub(super) fn settle(&mut self, level: usize) {
        if let Some(last) = self.lines.last_mut() {
            let deep = (0..level).fold(last.clone(), |doc, _| indented(doc));
            *last = wide(deep.pretty(WIDTH).to_string());
        }
    }

    /// `{`, the lines one level deeper, `}`. `comment` follows the opening brace.
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

/// On one line, if nothing breaks it.
pub(super) fn on_one_line(doc: Doc) -> String {
    doc.group().pretty(usize::MAX).to_string()
}

/// A balanced tree, so that many lines do not make a deep one.
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
