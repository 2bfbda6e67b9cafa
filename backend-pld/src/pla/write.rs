//! The writer of tables: one row for each product of the on-set, the don't-care set and the off-set.

use super::{Kind, Pla};
use grafsynth_logic::minimise::Terms;
use std::fmt::Write as _;

/// The text of a table. Each row defines one set: on, free, or off.
#[must_use]
pub fn write(table: &Pla) -> String {
    let shape = table.shape();
    let mut text = String::new();
    let _ = writeln!(text, ".i {}\n.o {}", shape.inputs(), shape.outputs());
    for (word, names) in [(".ilb", &table.inputs), (".ob", &table.outputs)] {
        if let Some(names) = names {
            let _ = writeln!(text, "{word} {}", names.join(" "));
        }
    }
    if table.is_inverted.contains(&true) {
        let phase: String =
            table.is_inverted.iter().map(|inverted| if *inverted { '0' } else { '1' }).collect();
        let _ = writeln!(text, ".phase {phase}");
    }
    if table.kind != Kind::Fd {
        let _ = writeln!(text, ".type {}", table.kind.name());
    }
    let count = table.on.len() + table.free.len() + table.off.len();
    let _ = writeln!(text, ".p {count}");
    // If 0 means off, `~` means nothing; otherwise 0 does, as is usual.
    let nothing = if table.kind.says_off() { '~' } else { '0' };
    rows(&mut text, &table.on, '1', nothing);
    rows(&mut text, &table.free, '-', nothing);
    rows(&mut text, &table.off, '0', nothing);
    text.push_str(".e\n");
    text
}

fn rows(text: &mut String, terms: &Terms, yes: char, nothing: char) {
    let shape = terms.shape;
    for term in terms.iter() {
        for input in 0..shape.inputs() {
            text.push(match shape.literal(term, input) {
                Some(true) => '1',
                Some(false) => '0',
                None => '-',
            });
        }
        text.push(' ');
        for output in 0..shape.outputs() {
            text.push(if shape.has_output(term, output) { yes } else { nothing });
        }
        text.push('\n');
    }
}
