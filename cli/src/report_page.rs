//! The report of a build as one HTML file: it loads nothing and runs nothing. Its content is that of [`Document`]; this module only decides how it looks.

use grafsynth_driver::report::Document;
use grafsynth_driver::report::document::{
    Block, Figure, Inline, Item, Rich, Section, Table, Verdict,
};
use grafsynth_ir::markup::escape;
use std::fmt::Write as _;

const STYLE: &str = include_str!("report_page.css");

/// The width of a bar, in hundredths.
const WIDTH: u64 = 100;

/// The largest width, in pixels, of a drawing that is made smaller to fit; a wider one would be illegible, and is scrolled.
const FITS: i64 = 1150;

/// The drawing of the chart.
pub(crate) struct Chart {
    /// The drawing.
    pub(crate) svg: String,
    /// Its width in pixels.
    pub(crate) width: i64,
}

/// The report as a document, with the drawing of the chart if it can be drawn.
pub(crate) fn html(document: &Document, chart: Option<&Chart>) -> String {
    let policy = format!(
        "default-src 'none'; style-src '{}'; img-src data:; base-uri 'none'; form-action 'none'",
        grafsynth_page::content_hash(STYLE)
    );
    let title = escape(&document.title);
    let mut out = String::new();
    // Writing into a String cannot fail.
    let _ = write!(
        out,
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta http-equiv=\"Content-Security-Policy\" content=\"{policy}\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<meta name=\"color-scheme\" content=\"light dark\">\n\
         <title>{title}: report</title>\n<style>{STYLE}</style>\n</head>\n<body>\n<header>\n<h1><bdi>{title}</bdi></h1>\n"
    );
    if !document.subtitle.is_empty() {
        let _ = writeln!(out, "<p dir=\"auto\">{}</p>", escape(&document.subtitle));
    }
    out += "</header>\n<nav aria-label=\"Sections\">\n<ul>\n";
    if chart.is_some() {
        out += "<li><a href=\"#chart\">Chart</a></li>\n";
    }
    let sections: Vec<&[Section]> = document.sections.chunk_by(|_, next| next.is_part).collect();
    for (at, section) in sections.iter().enumerate() {
        let title = section.first().map_or(String::new(), |head| escape(&head.title));
        let _ = writeln!(out, "<li><a href=\"#s{at}\"><bdi>{title}</bdi></a></li>");
    }
    out += "</ul>\n</nav>\n<main>\n";
    if let Some(Chart { svg, width }) = chart {
        out += "<section id=\"chart\">\n<h2>Chart</h2>\n";
        out += &image(&format!("drawing of {}", document.title), svg, *width > FITS);
        out += "</section>\n";
    }
    for (at, section) in sections.iter().enumerate() {
        let _ = writeln!(out, "<section id=\"s{at}\">");
        for part in *section {
            let level = if part.is_part { 3 } else { 2 };
            let _ = writeln!(out, "<h{level}><bdi>{}</bdi></h{level}>", escape(&part.title));
            part.blocks.iter().for_each(|block| out += &of_block(block, &part.title));
        }
        out += "</section>\n";
    }
    out += "</main>\n</body>\n</html>\n";
    out
}

fn of_block(block: &Block, title: &str) -> String {
    match block {
        Block::Paragraph(rich) => format!("<p>{}</p>\n", of_rich(rich)),
        Block::List(items) => {
            let items: String = items.iter().map(of_item).collect();
            format!("<ul>\n{items}</ul>\n")
        }
        Block::Table(table) => of_table(table, title),
        Block::Text(text) => {
            // Line breaks stay; everything else is escaped like other text.
            let lines: Vec<String> = text.trim_end().split('\n').map(escape).collect();
            format!("<pre tabindex=\"0\">{}</pre>\n", lines.join("\n"))
        }
        Block::Figure(Figure { about, svg, .. }) => image(about, svg, false),
    }
}

fn of_item(item: &Item) -> String {
    let parts: String =
        item.parts.iter().map(|part| format!("<li>{}</li>\n", of_rich(part))).collect();
    let parts = if parts.is_empty() { parts } else { format!("\n<ul>\n{parts}</ul>\n") };
    format!("<li>{}{parts}</li>\n", of_rich(&item.text))
}

/// Values are isolated, so that a name that is written from right to left does not move its neighbours.
fn of_rich(rich: &Rich) -> String {
    let run = |run: &Inline| match run {
        Inline::Words(text) => escape(&joined_units(text)),
        Inline::Text(text) if text.is_empty() => String::new(),
        Inline::Text(text) => format!("<bdi>{}</bdi>", escape(&joined_units(text))),
        Inline::Message(text) => of_message(text),
        Inline::Code(text) => format!("<code><bdi>{}</bdi></code>", escape(text)),
        Inline::Strong(text) => format!("<strong><bdi>{}</bdi></strong>", escape(text)),
        Inline::Verdict(verdict, word) => {
            let class = match verdict {
                Verdict::Good => "good",
                Verdict::Open => "open",
                Verdict::Bad => "bad",
            };
            format!("<span class=\"{class}\">{}</span>", escape(word))
        }
    };
    rich.0.iter().map(run).collect()
}

/// The units of the report.
const UNITS: [&str; 17] = [
    "B", "KB", "kB", "MB", "ns", "us", "µs", "ms", "s", "Hz", "kHz", "MHz", "V", "mA", "pF", "cm",
    "%",
];

/// The text with no line break between a number and its unit, or within a number (`10 000`).
fn joined_units(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for word in text.split_inclusive(' ') {
        let unit = word.trim_end_matches(|c: char| !c.is_alphanumeric() && c != '%');
        // The word before is a number, perhaps after a sign or a bracket.
        let before = out.strip_suffix(' ');
        let is_group = unit.len() == 3 && unit.bytes().all(|byte| byte.is_ascii_digit());
        if (is_group || UNITS.contains(&unit))
            && before.is_some_and(|it| it.ends_with(|c: char| c.is_ascii_digit()))
        {
            out.pop();
            out.push('\u{a0}');
        }
        out += word;
    }
    out
}

/// A message: what it quotes (`` `a` ``) is code, unless a quote has no end.
fn of_message(text: &str) -> String {
    let parts: Vec<&str> = text.split('`').collect();
    let part = |(at, part): (usize, &&str)| match at % 2 {
        0 => escape(part),
        _ => format!("<code><bdi>{}</bdi></code>", escape(part)),
    };
    let inner = match parts.len() % 2 {
        0 => escape(text),
        _ => parts.iter().enumerate().map(part).collect(),
    };
    format!("<bdi>{inner}</bdi>")
}

/// A drawing as an image: its styles and names are its own, and it cannot run anything.
fn image(about: &str, svg: &str, is_wide: bool) -> String {
    let data = grafsynth_page::base64(svg.as_bytes());
    let about = escape(about);
    let class = if is_wide { " class=\"wide\" tabindex=\"0\"" } else { "" };
    format!(
        "<figure{class}><img alt=\"{about}\" src=\"data:image/svg+xml;base64,{data}\"></figure>\n"
    )
}

fn of_table(table: &Table, title: &str) -> String {
    let number = |row: &[Rich], column: usize| {
        row.get(column).and_then(|cell| cell.text().parse::<u64>().ok())
    };
    let n_columns = table.head.len();
    // A column is aligned to the right if it contains numbers only.
    let is_number: Vec<bool> = (0..n_columns)
        .map(|column| {
            let cells = table.rows.iter().filter(|row| {
                row.get(column).is_some_and(|cell| !matches!(cell.text().as_str(), "" | "-"))
            });
            let mut cells = cells.map(|row| number(row, column).is_some());
            cells.next().is_some_and(|first| first && cells.all(|one| one))
        })
        .collect();
    let class = |column: usize| {
        if is_number.get(column) == Some(&true) { " class=\"n\"" } else { "" }
    };
    let bars = table.bars;
    let most =
        bars.and_then(|column| table.rows.iter().filter_map(|row| number(row, column)).max());
    let mut out = format!(
        "<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"{}\">\n<table>\n<thead><tr>",
        escape(title)
    );
    for (column, head) in table.head.iter().enumerate() {
        let _ = write!(out, "<th scope=\"col\"{}>{}</th>", class(column), of_rich(head));
    }
    out += "</tr></thead>\n<tbody>\n";
    for row in &table.rows {
        out += "<tr>";
        for (column, cell) in row.iter().enumerate() {
            let bar = match (number(row, column), most) {
                (Some(n), Some(most)) if bars == Some(column) => of_bar(n, most),
                _ => String::new(),
            };
            let _ = write!(out, "<td{}>{}{bar}</td>", class(column), of_rich(cell));
        }
        out += "</tr>\n";
    }
    out + "</tbody>\n</table>\n</div>\n"
}

/// A number as a part of the largest one of its column.
fn of_bar(n: u64, most: u64) -> String {
    let width = u128::from(n) * u128::from(WIDTH) / u128::from(most.max(1));
    format!(
        "<svg class=\"bar\" viewBox=\"0 0 {WIDTH} 10\" preserveAspectRatio=\"none\" aria-hidden=\"true\"><rect width=\"{width}\" height=\"10\"/></svg>"
    )
}

#[cfg(test)]
mod tests {
    use super::{Chart, html};
    use grafsynth_driver::report::document::{
        Block, Document, Figure, Inline, Item, Rich, Section, Table,
    };
    use grafsynth_driver::report::{json, markdown};

    /// A document with hostile text in every place.
    fn hostile(text: &str) -> Document {
        let rich = || {
            Rich(vec![
                Inline::Text(text.to_owned()),
                Inline::Code(text.to_owned()),
                Inline::Strong(text.to_owned()),
                Inline::Message(text.to_owned()),
            ])
        };
        let table = Table { head: vec![rich()], rows: vec![vec![rich()]], bars: Some(0) };
        let figure =
            Figure { about: text.to_owned(), file: "x.svg".to_owned(), svg: text.to_owned() };
        let blocks = vec![
            Block::Paragraph(rich()),
            Block::List(vec![Item { text: rich(), parts: vec![rich()] }]),
            Block::Table(table),
            Block::Text(format!("{text}\n{text}\n")),
            Block::Figure(figure),
        ];
        let section = Section {
            id: "x",
            output: Some(text.to_owned()),
            is_part: false,
            title: text.to_owned(),
            blocks,
        };
        Document { title: text.to_owned(), subtitle: text.to_owned(), sections: vec![section] }
    }

    #[test]
    fn nothing_that_a_user_wrote_is_markup() {
        let text = "</script><script>alert(1)</script><img src=x onerror='a'>\" onload=\"x &amp; \u{202e}\u{2067}مرحبا😀`|*";
        let chart = Chart { svg: text.to_owned(), width: 5000 };
        let page = html(&hostile(text), Some(&chart));
        let tags: Vec<&str> = page
            .split('<')
            .skip(1)
            .map(|part| part.split(['>', ' ', '\n']).next().unwrap_or_default())
            .collect();
        let known = "!DOCTYPE html head meta title style body header h1 h2 p nav ul li a main section figure img bdi code strong pre div table thead tbody tr th td";
        let known: Vec<&str> = known.split(' ').collect();
        for tag in tags {
            assert!(known.contains(&tag.trim_start_matches('/')), "<{tag}>");
        }
        assert!(!page.contains(['\u{202e}', '\u{2067}']) && page.contains("مرحبا😀"));
        assert!(!page.contains("<img src=x") && !page.contains("onload=\"x"));
    }

    #[test]
    fn what_a_message_quotes_is_code() {
        assert_eq!(
            super::of_message("step `a<b` waits"),
            "<bdi>step <code><bdi>a&lt;b</bdi></code> waits</bdi>"
        );
        assert_eq!(super::of_message("no `end"), "<bdi>no `end</bdi>");
    }

    #[test]
    fn a_number_is_not_separated_from_its_unit() {
        let joined = super::joined_units("12 B (100 ms), then 5 steps s 10 000 B");
        assert_eq!(joined, "12\u{a0}B (100\u{a0}ms), then 5 steps s 10\u{a0}000\u{a0}B");
    }

    /// The texts of a page without its tags.
    fn texts(page: &str) -> String {
        let body = page.split_once("<main>").map_or(page, |(_, body)| body);
        let parts = body.split('<').map(|part| part.split_once('>').map_or("", |(_, text)| text));
        let text: String = parts.collect();
        let text = text.replace("&lt;", "<").replace("&gt;", ">").replace("&quot;", "\"");
        text.replace("&amp;", "&").split_whitespace().collect::<Vec<_>>().join(" ")
    }

    #[test]
    fn all_forms_have_every_text_of_the_document() {
        let document = hostile("a plain text");
        let (page, json, markdown) =
            (texts(&html(&document, None)), json(&document), markdown(&document));
        // The title, four runs in five places, two lines; the figure is an image.
        let n = |text: &str| text.matches("a plain text").count();
        assert_eq!(n(&page), 1 + 4 * 5 + 2);
        assert_eq!(n(&markdown), 2 + n(&page) + 1);
        let value: serde_json::Value = serde_json::from_str(&json).expect("JSON");
        assert_eq!(value["sections"][0]["blocks"].as_array().map(Vec::len), Some(5));
        // In addition, the name of the output, and the drawing.
        assert_eq!(n(&json), 2 + n(&page) + 1 + 2);
    }
}
