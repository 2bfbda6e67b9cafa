//! The table of source texts: the meaning of a `FileId`, and the position of a byte.

use grafsynth_ir::{FileId, Span};

/// Texts by number, in the order in which they were added.
#[derive(Debug, Clone, Default)]
pub struct Sources {
    files: Vec<Source>,
}

/// One text.
#[derive(Debug, Clone)]
pub struct Source {
    /// The path as the user gave it; `<stdin>` and `<--assert>` for texts without a file.
    pub path: String,
    /// The text, UTF-8.
    pub text: String,
    line_starts: Vec<u32>,
}

/// A position as shown by editors: line and column from 1, columns in characters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Position {
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
}

impl Sources {
    /// Adds a text and returns its number. A byte order mark is kept: the front ends skip it.
    pub fn add(&mut self, path: impl Into<String>, text: impl Into<String>) -> FileId {
        let id = FileId(u32::try_from(self.files.len()).unwrap_or(u32::MAX));
        let text: String = text.into();
        let mut line_starts = vec![0];
        line_starts.extend(
            text.bytes()
                .enumerate()
                .filter(|(_, byte)| *byte == b'\n')
                .map(|(index, _)| u32::try_from(index + 1).unwrap_or(u32::MAX)),
        );
        self.files.push(Source { path: path.into(), text, line_starts });
        id
    }

    /// The text with that number.
    #[must_use]
    pub fn get(&self, file: FileId) -> Option<&Source> {
        self.files.get(file.0 as usize)
    }

    /// All texts in order.
    pub fn iter(&self) -> impl Iterator<Item = (FileId, &Source)> {
        self.files
            .iter()
            .enumerate()
            .map(|(index, source)| (FileId(u32::try_from(index).unwrap_or(u32::MAX)), source))
    }

    /// The start of a span; `None` for a span in an unknown file.
    #[must_use]
    pub fn start(&self, span: Span) -> Option<Position> {
        self.get(span.file).map(|source| source.position(span.start as usize))
    }

    /// The end of a span.
    #[must_use]
    pub fn end(&self, span: Span) -> Option<Position> {
        self.get(span.file).map(|source| source.position(span.end as usize))
    }

    /// `path:line:column`, or the path alone.
    #[must_use]
    pub fn describe(&self, span: Span) -> String {
        match (self.get(span.file), self.start(span)) {
            (Some(source), Some(at)) => format!("{}:{}:{}", source.path, at.line, at.column),
            _ => String::new(),
        }
    }
}

impl Source {
    /// The line of a byte, from 0.
    #[must_use]
    pub fn line_of(&self, offset: usize) -> usize {
        let offset = u32::try_from(offset).unwrap_or(u32::MAX);
        self.line_starts.partition_point(|start| *start <= offset).saturating_sub(1)
    }

    /// The bytes of line `line` (from 0) without its line break; empty beyond the last.
    #[must_use]
    pub fn line_range(&self, line: usize) -> std::ops::Range<usize> {
        let Some(start) = self.line_starts.get(line) else {
            return self.text.len()..self.text.len();
        };
        let start = *start as usize;
        let end = self.line_starts.get(line + 1).map_or(self.text.len(), |next| *next as usize - 1);
        start..end.max(start)
    }

    /// Line and column of a byte; a byte inside a character counts as that character's first byte.
    #[must_use]
    pub fn position(&self, offset: usize) -> Position {
        let offset = self.boundary(offset);
        let line = self.line_of(offset);
        let start = self.line_range(line).start;
        let column = self.text.get(start..offset).map_or(0, |before| before.chars().count());
        Position { line: line + 1, column: column + 1 }
    }

    /// The nearest character boundary at or before `offset`.
    #[must_use]
    pub fn boundary(&self, offset: usize) -> usize {
        let mut offset = offset.min(self.text.len());
        while !self.text.is_char_boundary(offset) {
            offset -= 1;
        }
        offset
    }
}

#[cfg(test)]
mod tests {
    use super::{Position, Sources};
    use grafsynth_ir::Span;

    #[test]
    fn positions_count_lines_and_characters() {
        let mut sources = Sources::default();
        let file = sources.add("x.graf", "aé\nb\n");
        let at = |offset| sources.start(Span::new(file, offset, offset)).unwrap();
        assert_eq!(at(0), Position { line: 1, column: 1 });
        assert_eq!(at(2), Position { line: 1, column: 2 }, "inside é");
        assert_eq!(at(3), Position { line: 1, column: 3 });
        assert_eq!(at(4), Position { line: 2, column: 1 });
        assert_eq!(at(6), Position { line: 3, column: 1 });
        assert_eq!(at(99), Position { line: 3, column: 1 });
    }
}
