//! The simple CSV of stimuli and traces: no quotes, `#` starts a comment, blanks around a cell are ignored (semantics §11).

use grafsynth_ir::{FileId, Span};

/// A cell with its source location.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Cell<'t> {
    pub(crate) text: &'t str,
    pub(crate) span: Span,
}

/// The lines that contain cells, each with its byte position.
pub(crate) fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    // A byte order mark is not part of the first name.
    let mark = text.len() - text.trim_start_matches('\u{feff}').len();
    let mut at = mark;
    text[mark..].split('\n').filter_map(move |line| {
        let start = at;
        at += line.len() + 1;
        let content = line.split('#').next().unwrap_or("");
        (!content.trim().is_empty()).then_some((start, content))
    })
}

/// The cells of a line that starts at byte `start`.
pub(crate) fn cells(file: FileId, start: usize, line: &str) -> impl Iterator<Item = Cell<'_>> {
    let mut at = start;
    line.split(',').map(move |raw| {
        let cell_start = at;
        at += raw.len() + 1;
        let text = raw.trim();
        let lead = raw.len() - raw.trim_start().len();
        let start = cell_start + if text.is_empty() { 0 } else { lead };
        Cell { text, span: Span::new(file, start, start + text.len()) }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_blanks_and_places() {
        let text = "# head\n a , b\r\n\n1,2 # tail\n";
        let found: Vec<(usize, Vec<&str>)> = lines(text)
            .map(|(start, line)| {
                (start, cells(FileId(0), start, line).map(|cell| cell.text).collect())
            })
            .collect();
        assert_eq!(found, [(7, vec!["a", "b"]), (16, vec!["1", "2"])]);
        let b = cells(FileId(0), 7, " a , b\r").nth(1).unwrap();
        assert_eq!(&text[b.span.range()], "b");
    }
}
