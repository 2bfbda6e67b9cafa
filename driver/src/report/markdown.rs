//! A report as Markdown that is readable as plain text, too.

use super::document::{Block, Document, Inline, Item, Rich, Table};
use super::table::{inline, width};

/// The report as a Markdown page. The drawings are in files of their own.
#[must_use]
pub fn markdown(document: &Document) -> String {
    let mut text = format!("# {}\n", inline(&document.title));
    if !document.subtitle.is_empty() {
        text += &format!("\n{}\n", inline(&document.subtitle));
    }
    for section in &document.sections {
        let level = if section.is_part { "###" } else { "##" };
        text += &format!("\n{level} {}\n", inline(&section.title));
        for block in &section.blocks {
            text += &format!("\n{}\n", of_block(block).trim_end());
        }
    }
    text
}

fn of_block(block: &Block) -> String {
    match block {
        Block::Paragraph(rich) => of_rich(rich),
        Block::List(items) => items.iter().map(of_item).collect(),
        Block::Table(table) => of_table(table),
        Block::Text(text) => format!("```text\n{text}```\n"),
        Block::Figure(figure) => format!("![{}]({})", figure.about, figure.file),
    }
}

fn of_item(item: &Item) -> String {
    let mut text = format!("- {}\n", of_rich(&item.text));
    for part in &item.parts {
        text += &format!("  - {}\n", of_rich(part));
    }
    text
}

fn of_rich(rich: &Rich) -> String {
    let run = |run: &Inline| match run {
        Inline::Words(text) => text.clone(),
        Inline::Verdict(_, word) => (*word).to_owned(),
        Inline::Text(text) => inline(text),
        Inline::Code(text) => format!("`{}`", inline(text)),
        Inline::Strong(text) => format!("**{}**", inline(text)),
        Inline::Message(text) => text.replace('\n', " "),
    };
    rich.0.iter().map(run).collect()
}

/// The table as text. Every column is as wide as its widest cell.
fn of_table(table: &Table) -> String {
    let rows: Vec<Vec<String>> = std::iter::once(&table.head)
        .chain(&table.rows)
        .map(|row| row.iter().map(of_rich).collect())
        .collect();
    let n_columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let widths: Vec<usize> = (0..n_columns)
        .map(|column| {
            let cells = rows.iter().filter_map(|row| row.get(column));
            cells.map(|cell| width(cell)).max().unwrap_or(0).max(3)
        })
        .collect();
    let mut text = String::new();
    for (at, row) in rows.iter().enumerate() {
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
