//! Constant tables: data that differ only by a number between the transitions or states of a region.
//!
//! Regions of the same structure have the same numbers in their tables, so such regions share their tables, even if the names differ.

use super::Emit;
use crate::Object;
use crate::c::print::Node;
use grafsynth_ir::net::TransitionId;

/// An entry of a table.
#[derive(Debug, Clone)]
pub(super) struct Row {
    /// Its value as a number.
    pub(super) value: usize,
    /// Its text.
    pub(super) text: String,
    /// The transition that it belongs to.
    pub(super) about: Option<TransitionId>,
}

impl Row {
    /// An entry that means "none".
    pub(super) fn none() -> Row {
        Row { value: 0, text: "0".to_owned(), about: None }
    }
}

/// A table that was defined.
#[derive(Debug, Clone)]
pub(super) struct Table {
    name: String,
    /// Its position among the functions.
    at: usize,
    is_shared: bool,
}

impl Emit<'_> {
    /// The name of a table of these numbers, each of the type `ty`. The table is defined before the next definition, unless it already exists.
    pub(super) fn table(
        &mut self,
        wanted: &str,
        ty: &'static str,
        note: &str,
        rows: &[Row],
    ) -> String {
        let key = (ty, rows.iter().map(|row| row.value).collect::<Vec<usize>>());
        if let Some(table) = self.tables.get_mut(&key) {
            if !table.is_shared {
                table.is_shared = true;
                let node = &mut self.functions[table.at];
                node.note.push_str("; shared by regions with the same numbers");
            }
            return table.name.clone();
        }
        let name = format!("{}_{}", self.names.prefix, self.taken.name(wanted));
        let mut lines = Vec::new();
        for (at, row) in rows.iter().enumerate() {
            let comma = if at + 1 == rows.len() { "" } else { "," };
            let line = Node::line(format!("{}{comma}", row.text));
            lines.push(match row.about {
                Some(id) => line.note(self.transition_note(id)).about(Object::Transition(id)),
                None => line,
            });
        }
        let head = format!("static {}_ROM {ty} {name}[{}] =", self.names.upper, rows.len());
        let node = Node::braced(head, lines);
        let at = self.functions.len();
        self.functions.push(node.note(note));
        self.functions.push(Node::blank());
        self.tables.insert(key, Table { name: name.clone(), at, is_shared: false });
        name
    }
}
