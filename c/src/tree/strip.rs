//! Removes from a tree all information that its C text does not contain.

use super::{Item, ItemKind, Marks, Stmt, StmtKind, Unit};

impl Unit {
    /// Removes notes, origins, tasks and loop bounds.
    pub fn strip(&mut self) {
        for (_, one) in self.structs.iter_mut() {
            one.members.iter_mut().for_each(|member| member.note.clear());
        }
        for (_, one) in self.enums.iter_mut() {
            one.notes.clear();
        }
        strip_items(&mut self.items);
    }
}

fn strip_items(items: &mut [Item]) {
    for item in items {
        item.note.clear();
        match &mut item.kind {
            ItemKind::Function { body, .. } => strip_body(body),
            ItemKind::ExternC(inner) => strip_items(inner),
            _ => {}
        }
    }
}

fn strip_body(body: &mut [Stmt]) {
    for stmt in body {
        stmt.marks = Marks::default();
        match &mut stmt.kind {
            StmtKind::If { arms, otherwise } => {
                for arm in arms {
                    arm.marks = Marks::default();
                    strip_body(&mut arm.body);
                }
                strip_body(otherwise);
            }
            StmtKind::Switch { cases, .. } => {
                for case in cases {
                    case.marks = Marks::default();
                    strip_body(&mut case.body);
                }
            }
            StmtKind::While { body, .. } | StmtKind::DoWhile { body, .. } => strip_body(body),
            StmtKind::For { init, body, .. } => {
                strip_body(init);
                strip_body(body);
            }
            StmtKind::Block(body) => strip_body(body),
            _ => {}
        }
    }
}
