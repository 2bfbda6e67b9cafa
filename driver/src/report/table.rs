//! Tables and inline text of a page: aligned Markdown, so that it is readable as plain text too.

use grafsynth_ir::names::is_unseen;

/// A table with a head; cells are escaped for Markdown when they are added.
pub(super) struct Table {
    rows: Vec<Vec<String>>,
}

impl Table {
    /// An empty table with these column titles.
    pub(super) fn new<const N: usize>(head: [&str; N]) -> Self {
        Table { rows: vec![head.iter().map(|title| (*title).to_owned()).collect()] }
    }

    /// An empty table with these column titles.
    pub(super) fn of(head: Vec<String>) -> Self {
        Table { rows: vec![head] }
    }

    /// Adds a row with one cell for each column.
    pub(super) fn add(&mut self, cells: &[String]) {
        self.rows.push(cells.iter().map(|cell| inline(cell)).collect());
    }

    /// Adds a row; missing cells at its end are empty.
    pub(super) fn row<const N: usize>(&mut self, cells: [String; N]) {
        self.add(&cells);
    }

    /// Replaces a cell of the last row by this text without escaping; the text must not come from the user, and may contain Markdown.
    pub(super) fn set_last(&mut self, column: usize, text: &str) {
        if let Some(cell) = self.rows.last_mut().and_then(|row| row.get_mut(column)) {
            text.clone_into(cell);
        }
    }

    /// True if it has no rows except its head.
    pub(super) fn is_empty(&self) -> bool {
        self.rows.len() <= 1
    }

    /// The table as text. Every column is as wide as its widest cell.
    pub(super) fn text(&self) -> String {
        let n_columns = self.rows.iter().map(Vec::len).max().unwrap_or(0);
        let widths: Vec<usize> = (0..n_columns)
            .map(|column| {
                let cells = self.rows.iter().filter_map(|row| row.get(column));
                cells.map(|cell| width(cell)).max().unwrap_or(0).max(3)
            })
            .collect();
        let mut text = String::new();
        for (at, row) in self.rows.iter().enumerate() {
            let cells: Vec<String> = (widths.iter().enumerate())
                .map(|(column, wanted)| {
                    let cell = row.get(column).map_or("", String::as_str);
                    format!("{cell}{}", " ".repeat(wanted - width(cell)))
                })
                .collect();
            text += &format!("| {} |\n", cells.join(" | "));
            if at == 0 {
                let rules: Vec<String> = widths.iter().map(|width| "-".repeat(*width)).collect();
                text += &format!("| {} |\n", rules.join(" | "));
            }
        }
        text
    }
}

/// A text for one line of Markdown: no line breaks, and no characters of the user that would begin a link, a tag, emphasis or a cell.
pub(super) fn inline(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '|' | '<' | '[' | ']' | '`' | '\\' => {
                out.push('\\');
                out.push(c);
            }
            c if is_unseen(c) => out.push(' '),
            c => out.push(c),
        }
    }
    out
}

/// The width of a text in columns of a monospaced font: ideographs and similar characters are two columns wide, combining marks have
/// no width.
pub(super) fn width(text: &str) -> usize {
    text.chars().map(char_width).sum()
}

/// The columns of one character. The ranges are the large ones of Unicode's East Asian Width (wide), and the combining marks.
fn char_width(c: char) -> usize {
    match u32::from(c) {
        0x0300..=0x036F | 0x200B..=0x200F | 0x20D0..=0x20FF | 0xFE00..=0xFE0F => 0,
        0x1100..=0x115F
        | 0x2E80..=0xA4CF
        | 0xAC00..=0xD7A3
        | 0xF900..=0xFAFF
        | 0xFE30..=0xFE6F
        | 0xFF00..=0xFF60
        | 0xFFE0..=0xFFE6
        | 0x1F300..=0x1FAFF
        | 0x20000..=0x3FFFD => 2,
        _ => 1,
    }
}
