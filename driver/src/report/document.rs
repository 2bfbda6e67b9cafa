//! A report as data: sections of paragraphs, lists, tables and figures. The writers ([`super::markdown()`], [`super::json()`], and that of HTML in the command line) decide
//! nothing about its content, so all forms of a report have the same facts.

/// A report.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Document {
    /// The name of the chart.
    pub title: String,
    /// The label of the chart; may be empty.
    pub subtitle: String,
    /// All sections, in order.
    pub sections: Vec<Section>,
}

/// A section. A section about one output is followed by its parts.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Section {
    /// The name of its kind for programs, such as `product-terms`; `output` for the heading of a chip.
    pub id: &'static str,
    /// The output that it is about, if it is about one.
    pub output: Option<String>,
    /// True for a part of the section of an output.
    pub is_part: bool,
    /// The heading.
    pub title: String,
    /// The content, in order.
    pub blocks: Vec<Block>,
}

/// A part of a section.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Block {
    /// Sentences.
    Paragraph(Rich),
    /// A list; each item may have a list of its own.
    List(Vec<Item>),
    /// A table.
    Table(Table),
    /// Text whose lines and blanks are kept: equations, commands.
    Text(String),
    /// A drawing.
    Figure(Figure),
}

/// A drawing in a file of its own, or inside of the report.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Figure {
    /// What it shows.
    pub about: String,
    /// The name of its file.
    pub file: String,
    /// The content of its file, an SVG drawing.
    pub svg: String,
}

/// An item of a list.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Item {
    /// The item itself.
    pub text: Rich,
    /// The items below it.
    pub parts: Vec<Rich>,
}

impl From<Rich> for Item {
    fn from(text: Rich) -> Self {
        Item { text, parts: Vec::new() }
    }
}

/// A text on one line, in runs.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Rich(pub Vec<Inline>);

/// A run of text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Inline {
    /// Words of this program.
    Words(String),
    /// A value: a number, or names that a user may have chosen.
    Text(String),
    /// A name or a command, as it is typed.
    Code(String),
    /// Text that stands out.
    Strong(String),
    /// A message of the tool, with its quotes (`` `a` ``).
    Message(String),
    /// A verdict.
    Verdict(Verdict, &'static str),
}

/// What a verdict means for the reader.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// Proved.
    Good,
    /// Open, tested, not checked, or assumed.
    Open,
    /// Refuted.
    Bad,
}

impl Inline {
    /// The text without its form.
    #[must_use]
    pub fn plain(&self) -> &str {
        match self {
            Inline::Words(text)
            | Inline::Text(text)
            | Inline::Code(text)
            | Inline::Strong(text)
            | Inline::Message(text) => text,
            Inline::Verdict(_, word) => word,
        }
    }
}

impl From<String> for Inline {
    fn from(text: String) -> Self {
        Inline::Text(text)
    }
}

impl From<&str> for Inline {
    fn from(text: &str) -> Self {
        Inline::Text(text.to_owned())
    }
}

impl Rich {
    /// A sentence: in `words`, which are always words of this program, `` `..` `` is code and each `{}` is replaced by the next value. A value is never read as
    /// words.
    pub(crate) fn say<const N: usize>(words: &str, values: [Inline; N]) -> Self {
        let mut runs = Vec::new();
        let mut values = values.into_iter();
        for (at, part) in words.split('`').enumerate() {
            let is_code = at % 2 == 1;
            for (place, text) in part.split("{}").enumerate() {
                if place > 0 {
                    runs.extend(values.next().map(|value| match value {
                        Inline::Text(text) if is_code => Inline::Code(text),
                        value => value,
                    }));
                }
                if !text.is_empty() {
                    let text = text.to_owned();
                    runs.push(if is_code { Inline::Code(text) } else { Inline::Words(text) });
                }
            }
        }
        Rich(joined(runs))
    }

    /// A value.
    pub(crate) fn plain(text: impl Into<String>) -> Self {
        Rich(vec![Inline::Text(text.into())])
    }

    /// A message of the tool.
    pub(crate) fn message(text: impl Into<String>) -> Self {
        Rich(vec![Inline::Message(text.into())])
    }

    /// A verdict.
    pub(crate) fn verdict(word: &'static str) -> Self {
        let verdict = match word {
            "proved" => Verdict::Good,
            "refuted" => Verdict::Bad,
            _ => Verdict::Open,
        };
        Rich(vec![Inline::Verdict(verdict, word)])
    }

    /// Adds another text after this one.
    pub(crate) fn and(mut self, mut more: Rich) -> Self {
        self.0.append(&mut more.0);
        Rich(joined(self.0))
    }

    /// The text without its form.
    #[must_use]
    pub fn text(&self) -> String {
        self.0.iter().map(Inline::plain).collect()
    }
}

/// Neighbours of the same form as one run.
fn joined(runs: Vec<Inline>) -> Vec<Inline> {
    let mut all: Vec<Inline> = Vec::with_capacity(runs.len());
    for run in runs {
        match (all.last_mut(), run) {
            (Some(Inline::Words(last)), Inline::Words(more))
            | (Some(Inline::Code(last)), Inline::Code(more)) => last.push_str(&more),
            (_, run) => all.push(run),
        }
    }
    all
}

/// A table. Every row has a cell for each column.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Table {
    /// The titles of the columns.
    pub head: Vec<Rich>,
    /// The cells, row by row.
    pub rows: Vec<Vec<Rich>>,
    /// The column whose numbers can be shown as bars.
    pub bars: Option<usize>,
}

impl Table {
    /// An empty table with these column titles, which are words as in [`Rich::say`].
    pub(crate) fn new<const N: usize>(head: [&str; N]) -> Self {
        Self::of(head.iter().map(|title| Rich::say(title, [])).collect())
    }

    /// An empty table with these column titles.
    pub(crate) fn of(head: Vec<Rich>) -> Self {
        Table { head, rows: Vec::new(), bars: None }
    }

    /// The table with bars for the numbers of a column.
    pub(crate) fn with_bars(mut self, column: usize) -> Self {
        self.bars = Some(column);
        self
    }

    /// Adds a row with one cell for each column.
    pub(crate) fn add(&mut self, cells: Vec<Rich>) {
        self.rows.push(cells);
    }

    /// Adds a row of texts.
    pub(crate) fn row<const N: usize>(&mut self, cells: [String; N]) {
        self.rows.push(cells.into_iter().map(Rich::plain).collect());
    }

    /// Replaces a cell of the last row.
    pub(crate) fn set_last(&mut self, column: usize, text: Rich) {
        if let Some(cell) = self.rows.last_mut().and_then(|row| row.get_mut(column)) {
            *cell = text;
        }
    }

    /// True if it has no rows.
    pub(crate) fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::{Inline, Rich};

    #[test]
    fn values_are_not_read_as_words() {
        let said = Rich::say(
            "use `{}` or {}, `--safe`: {}",
            ["a`b{}".into(), Inline::Strong("{}`x`".to_owned()), "*".into()],
        );
        assert_eq!(
            said.0,
            [
                Inline::Words("use ".to_owned()),
                Inline::Code("a`b{}".to_owned()),
                Inline::Words(" or ".to_owned()),
                Inline::Strong("{}`x`".to_owned()),
                Inline::Words(", ".to_owned()),
                Inline::Code("--safe".to_owned()),
                Inline::Words(": ".to_owned()),
                Inline::Text("*".to_owned()),
            ]
        );
        assert_eq!(said.text(), "use a`b{} or {}`x`, --safe: *");
    }
}
