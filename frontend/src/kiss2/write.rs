//! Writes a table as text.

use super::{Machine, Trit};
use itertools::Itertools as _;
use std::fmt::Write as _;

/// A name as a single word of the format, without blanks or `#`, and distinct from words with a special meaning.
fn word(name: &str) -> String {
    let text: String =
        name.chars().map(|c| if c.is_whitespace() || c == '#' { '_' } else { c }).collect();
    if text.is_empty() || text == "*" || text == "-" || text.starts_with('.') {
        format!("_{text}")
    } else {
        text
    }
}

/// Writes a table with aligned columns.
#[must_use]
pub fn write(machine: &Machine) -> String {
    let trits = |trits: &[Trit]| -> String {
        trits
            .iter()
            .map(|trit| match trit {
                Trit::Low => '0',
                Trit::High => '1',
                Trit::Any => '-',
            })
            .collect()
    };
    let names: Vec<String> = machine.states.iter().map(|state| word(&state.name)).collect();
    let width = names.iter().map(|name| name.chars().count()).max().unwrap_or(1);
    let name = |state: Option<usize>| state.map_or("*", |state| names[state].as_str());
    let mut text = String::new();
    let list = |names: &[String]| names.iter().map(|name| word(name)).join(" ");
    if !machine.name.is_empty() {
        let _ = writeln!(text, "# {}", machine.name.replace(['\n', '\r'], " "));
    }
    let _ = writeln!(text, ".i {}\n.o {}", machine.inputs.len(), machine.outputs.len());
    let _ = writeln!(text, ".p {}\n.s {}", machine.rows.len(), machine.states.len());
    if let Some(initial) = names.get(machine.initial) {
        let _ = writeln!(text, ".r {initial}");
    }
    for (head, names) in [(".ilb", &machine.inputs), (".ob", &machine.outputs)] {
        if !names.is_empty() {
            let _ = writeln!(text, "{head} {}", list(names));
        }
    }
    for row in &machine.rows {
        let cells = [
            trits(&row.inputs),
            format!("{:width$}", name(row.from)),
            format!("{:width$}", name(row.to)),
            trits(&row.outputs),
        ];
        let cells = cells.iter().map(String::as_str).filter(|cell| !cell.is_empty()).join(" ");
        let _ = writeln!(text, "{}", cells.trim_end());
    }
    text.push_str(".e\n");
    text
}
