//! Parser and writer of PLCopen TC6 XML (`.xml`).
//!
//! Elements are identified by their local names, so the three namespaces in use are read in the same way. Bodies in ladder and function
//! block diagram become statements (`network`), charts become the tree of `crate::st::ast`, and `crate::st::elaborate` defines their
//! meaning, as for text.
//!
//! ```
//! use grafsynth_frontend::plcopen;
//! use grafsynth_ir::FileId;
//!
//! let parsed = plcopen::parse(FileId(0), "<project><types><pous/></types></project>");
//! assert_eq!(parsed.diagnostics[0].code.id, "G0450");
//! ```

mod il;
mod markup;
mod network;
mod project;
mod reader;
mod rules;
mod sfc;
mod write;

use grafsynth_ir::FileId;
use grafsynth_ir::diag::Diagnostic;

use crate::codes;
use crate::findings::Findings;
use crate::graf::{Limits, Parsed};
use crate::xml;

/// Reads a project with the default limits.
#[must_use]
pub fn parse(file: FileId, text: &str) -> Parsed {
    parse_within(file, text, &Limits::default())
}

/// Reads a project with the given limits.
#[must_use]
pub fn parse_within(file: FileId, text: &str, limits: &Limits) -> Parsed {
    let document = match xml::parse(file, text, limits) {
        Ok(document) => document,
        Err(finding) => return Parsed { diagnostics: vec![*finding], ..Parsed::default() },
    };
    let mut findings = Findings { kept: Vec::new(), limit: limits.diagnostics, rest: 0 };
    let root = document.root_element();
    if root.tag_name().name() != "project" {
        let name = root.tag_name().name().to_owned();
        findings.report(|| {
            Diagnostic::error(
                codes::PLC_PROJECT,
                format!("not a PLCopen project: the root element is <{name}>"),
            )
            .at(xml::tag_span(file, root), "expected <project>")
            .help("export the project as PLCopen XML; for another XML format, give it with --from")
        });
        return Parsed { diagnostics: findings.finish(), ..Parsed::default() };
    }
    let mut reader =
        reader::Reader { file, text, findings: &mut findings, nesting: limits.nesting };
    let library = reader.project(root);
    crate::st::finish(&library, findings)
}

/// Writes a net as a project that reads back as the same net. The diagnostics list what the project cannot contain.
///
/// # Errors
/// Returns a finding for everything in the net that a project cannot express.
pub fn write_net(
    net: &grafsynth_ir::net::Net,
) -> Result<(String, Vec<Diagnostic>), Vec<Diagnostic>> {
    write::net(net)
}

#[cfg(test)]
mod tests;
