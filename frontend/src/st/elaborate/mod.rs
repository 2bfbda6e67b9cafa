//! Turns the tree of IEC 61131-3 into charts: decides which units become charts, what their variables become, and which names are visible
//! where.
//!
//! - Each program, or each program instance of a configuration, becomes a chart (`conflict priority`, `evolution single`, `actions iec`). In a file without
//!   programs, each function block with a chart becomes one; if there is no such block either, each function block that no other unit contains becomes one.
//! - Function blocks are expanded in their callers, with one set of variables per instance, named `instance.variable`.
//! - The standard function blocks are expanded in the same way, from a text of their own (`prelude`).
//! - Functions become expressions.
//!
//! An error does not end the elaboration. Unsupported features are reported by name; everything else is still checked.
//!
//! `types`, `value` and `usage` define the data. `scope` contains the rules that find what a name refers to. `context` is the state that all parts share; each
//! part adds methods to it, and `roots` is the entry point.

mod access;
mod bits;
mod calls;
mod charts;
mod context;
mod declare;
mod declared_types;
mod expressions;
mod functions;
mod jump_elimination;
mod prelude;
mod roots;
mod scope;
mod sfc;
mod statements;
mod times;
mod types;
mod usage;
mod user_functions;
mod value;

use grafsynth_ir::chart::Design;
use grafsynth_ir::diag::Diagnostic;

use super::ast::{Library, TypeKind};
use context::Elaborator;
pub(crate) use prelude::block as standard_block;

/// Turns a library into a design. The findings are in source order.
pub(crate) fn design(library: &Library) -> (Option<Design>, Vec<Diagnostic>) {
    let mut elaborator = Elaborator::new(library);
    // Enumeration values are visible everywhere.
    for def in &library.types {
        if matches!(def.ty.kind, TypeKind::Enum(_)) {
            let _ = elaborator.ty(context::GLOBALS, &def.ty);
        }
    }
    let design = elaborator.design();
    let mut found = elaborator.found;
    found.sort_by_key(|finding| finding.labels.first().map_or(0, |label| label.span.start));
    found.dedup();
    (design, found)
}
