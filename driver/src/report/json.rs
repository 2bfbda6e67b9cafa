//! A report as JSON (docs/report.md): the same blocks, for programs.

use super::document::{Block, Document, Item, Rich};
use serde_json::{Value, json};

/// The version of the format.
const VERSION: u32 = 1;

/// The report as a JSON document, with a line break at its end. Drawings are named by their contents, which are SVG.
#[must_use]
pub fn json(document: &Document) -> String {
    let sections = document.sections.iter().map(|section| {
        json!({
            "id": section.id,
            "output": section.output,
            "title": section.title,
            "blocks": section.blocks.iter().map(of_block).collect::<Vec<Value>>(),
        })
    });
    let value = json!({
        "format": "grafsynth report",
        "version": VERSION,
        "title": document.title,
        "subtitle": document.subtitle,
        "sections": sections.collect::<Vec<Value>>(),
    });
    // The value contains only strings, numbers and lists, so writing cannot fail.
    serde_json::to_string_pretty(&value).unwrap_or_default() + "\n"
}

fn of_block(block: &Block) -> Value {
    match block {
        Block::Paragraph(rich) => json!({ "kind": "paragraph", "text": rich.text() }),
        Block::List(items) => {
            let items: Vec<Value> = items.iter().map(of_item).collect();
            json!({ "kind": "list", "items": items })
        }
        Block::Table(table) => {
            let rows: Vec<Vec<String>> = table.rows.iter().map(|row| texts(row)).collect();
            json!({ "kind": "table", "head": texts(&table.head), "rows": rows })
        }
        Block::Text(text) => json!({ "kind": "text", "text": text }),
        Block::Figure(figure) => {
            json!({ "kind": "figure", "about": figure.about, "svg": figure.svg })
        }
    }
}

fn of_item(item: &Item) -> Value {
    json!({ "text": item.text.text(), "parts": texts(&item.parts) })
}

fn texts(all: &[Rich]) -> Vec<String> {
    all.iter().map(Rich::text).collect()
}
