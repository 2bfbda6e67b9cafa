//! Diagnostics of templates.

use grafsynth_ir::Code;

/// A template that cannot be read or rendered.
pub const TEMPLATE_ERROR: Code = Code { id: "G0611", title: "template error" };
/// A template refused the chart with `refuse`.
pub const TEMPLATE_REFUSED: Code = Code { id: "G0612", title: "chart refused by a template" };
/// A template that does not terminate, or whose output is too large.
pub const TEMPLATE_ENDLESS: Code = Code { id: "G0613", title: "template limit exceeded" };
/// All codes.
pub const ALL: &[Code] = &[TEMPLATE_ERROR, TEMPLATE_REFUSED, TEMPLATE_ENDLESS];
