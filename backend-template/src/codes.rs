//! Diagnostics of templates.

use grafsynth_ir::Code;

/// A template that cannot be read or rendered.
pub const TEMPLATE_ERROR: Code = Code { id: "G0611", title: "template error" };
/// A template said itself that it cannot carry the chart.
pub const TEMPLATE_REFUSED: Code = Code { id: "G0612", title: "chart refused by a template" };
/// A template that does not end, or writes without end.
pub const TEMPLATE_ENDLESS: Code = Code { id: "G0613", title: "template limit exceeded" };
/// All of them.
pub const ALL: &[Code] = &[TEMPLATE_ERROR, TEMPLATE_REFUSED, TEMPLATE_ENDLESS];
