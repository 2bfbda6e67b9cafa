//! Converts one format to another.

use crate::codes;
use crate::design::Design;
use crate::languages::{Language, Writer};
use crate::pipeline;
use grafsynth_backend_pld::Dialect;
use grafsynth_ir::{Diagnostic, Span};
use grafsynth_verify::Limits;

/// A design in another format.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Converted {
    /// The text.
    pub text: String,
    /// Findings about parts that the text omits or expresses differently, each with its location; the behaviour is the same.
    pub lost: Vec<Diagnostic>,
}

/// The text of a design in another format.
///
/// # Errors
/// One finding for each part that the target cannot express, with its location.
pub fn convert(design: &Design, to: &Language) -> Result<Converted, Vec<Diagnostic>> {
    let text = match (design, &to.write) {
        (Design::Net(design), Writer::Chart(write)) => {
            let (text, lost) = write(design)?;
            return Ok(Converted { text, lost });
        }
        (Design::Logic(design), Writer::Chart(_)) => {
            return Err(vec![logic_not_chart(&design.interface.name.span, to)]);
        }
        (Design::Net(design), Writer::Equations(dialect)) => {
            let net = &design.net;
            let facts = pipeline::facts(net, &Limits::default());
            let logic = pipeline::logic(net, &facts)?;
            let options = pipeline::emit_options(net, None, None);
            pipeline::through(&logic, *dialect, &options)?.emitted.text
        }
        // A design read from fuses is written product by product, regardless of its clocks.
        (Design::Logic(logic), Writer::Equations(Dialect::Palasm)) if logic.fuses.is_some() => {
            let placement = logic.placement.as_ref().map_err(Clone::clone)?;
            grafsynth_backend_pld::fuse::palasm(placement)
        }
        (Design::Logic(logic), Writer::Equations(dialect)) => {
            let options = grafsynth_backend_pld::EmitOptions::default();
            grafsynth_backend_pld::emit(logic.circuit()?, *dialect, &options)?.text
        }
        (Design::Net(design), Writer::Circuit(write, _)) => write(&design.net)?,
        (Design::Logic(design), Writer::Circuit(_, write)) => write(design)?,
        (_, Writer::None(why)) => return Err(vec![why()]),
    };
    Ok(Converted { text, lost: Vec::new() })
}

/// The finding about logic that would have to be written as a chart.
fn logic_not_chart(place: &Span, to: &Language) -> Diagnostic {
    let message = format!("logic cannot be written as {}: it does not define steps", to.name);
    let finding = Diagnostic::error(codes::NEEDS_CHART, message)
        .help("set --to to palasm, cupl, galasm, verilog, blif or pla");
    if *place == Span::default() { finding } else { finding.at(*place, "this circuit") }
}
