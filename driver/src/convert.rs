//! Converts one format to another, and prints the canonical form.

use crate::automaton;
use crate::codes;
use crate::format::Format;
use crate::pipeline;
use crate::read::{Design, dialect};
use grafsynth_ir::logic::Logic;
use grafsynth_ir::{Diagnostic, FileId, Span};
use grafsynth_logic::minimise::Budget;
use grafsynth_verify::Limits;

/// A design in another format.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Converted {
    /// The text.
    pub text: String,
    /// What the text does not contain or expresses differently, each with its location; the behaviour is the same.
    pub lost: Vec<Diagnostic>,
}

/// The text of a design in another format.
///
/// # Errors
/// Everything that the target cannot express, each with its location.
pub fn convert(design: &Design, to: Format) -> Result<Converted, Vec<Diagnostic>> {
    if let (Design::Net(design), Format::Scxml) = (design, to) {
        let (text, lost) = match &design.chart {
            Some(chart) => grafsynth_frontend::scxml::write_design(chart, &design.net)?,
            None => grafsynth_frontend::scxml::write_net(&design.net)?,
        };
        return Ok(Converted { text, lost });
    }
    if let Design::Net(design) = design
        && matches!(to, Format::St | Format::Plcopen)
    {
        let (text, lost) = if to == Format::St {
            grafsynth_frontend::st::write_net(&design.net)?
        } else {
            grafsynth_frontend::plcopen::write_net(&design.net)?
        };
        return Ok(Converted { text, lost });
    }
    Ok(Converted { text: plain(design, to)?, lost: Vec::new() })
}

/// The text of a design in a format that loses no information.
fn plain(design: &Design, to: Format) -> Result<String, Vec<Diagnostic>> {
    match (design, to) {
        (Design::Net(design), Format::Graf) => match &design.chart {
            Some(chart) => Ok(grafsynth_frontend::graf::write_design(chart)),
            None => grafsynth_frontend::graf::write_net(&design.net),
        },
        (Design::Net(design), Format::Rules) => grafsynth_frontend::rules::write_net(&design.net),
        (Design::Net(_), Format::Scxml | Format::St | Format::Plcopen) => {
            unreachable!("what may lose something is written before")
        }
        (Design::Net(design), Format::Net) => Ok(grafsynth_ir::text::print(&design.net)),
        (
            Design::Net(design),
            Format::Palasm | Format::Cupl | Format::Galasm | Format::Verilog | Format::Blif,
        ) => {
            let net = &design.net;
            let facts = pipeline::facts(net, &Limits::default());
            let logic = pipeline::logic(net, &facts)?;
            let options = pipeline::emit_options(net, None, None);
            Ok(pipeline::through(&logic, dialect(to), &options)?.emitted.text)
        }
        // A design read from fuses is written product by product, regardless of its clocks.
        (Design::Logic(logic), Format::Palasm) if logic.fuses.is_some() => {
            let placement = logic.placement.as_ref().map_err(Clone::clone)?;
            Ok(grafsynth_backend_pld::fuse::palasm(placement))
        }
        (
            Design::Logic(logic),
            Format::Palasm | Format::Cupl | Format::Galasm | Format::Verilog | Format::Blif,
        ) => {
            let options = grafsynth_backend_pld::EmitOptions::default();
            Ok(grafsynth_backend_pld::emit(logic.circuit()?, dialect(to), &options)?.text)
        }
        (Design::Net(design), Format::Kiss2) => {
            let machine = automaton::machine(&design.net)?;
            Ok(grafsynth_frontend::kiss2::write(&machine))
        }
        (Design::Net(design), Format::Pla) => {
            let facts = pipeline::facts(&design.net, &Limits::default());
            table(&pipeline::logic(&design.net, &facts)?)
        }
        (Design::Logic(logic), Format::Pla) => table(logic.circuit()?),
        (Design::Net(design), Format::Jedec) => {
            let facts = pipeline::facts(&design.net, &Limits::default());
            let logic = pipeline::logic(&design.net, &facts)?;
            Ok(crate::jedec::burn(&design.net, &logic, None, None, None)?.text)
        }
        (Design::Logic(logic), Format::Jedec) => {
            crate::jedec::as_written(logic.placement.as_ref().map_err(Clone::clone)?)
        }
        (_, Format::C) => Err(vec![
            Diagnostic::error(codes::WRITES_C, "C output has several files, and `convert` writes one")
                .help("use `build FILE --target c -o FOLDER`, which also compares the C code with the chart"),
        ]),
        (
            Design::Logic(design),
            Format::Graf
            | Format::Rules
            | Format::Scxml
            | Format::St
            | Format::Plcopen
            | Format::Kiss2
            | Format::Net,
        ) => Err(vec![
            logic_not_chart(&design.interface.name.span, to),
        ]),
    }
}

/// The finding about logic that would have to be written as a chart.
fn logic_not_chart(place: &Span, to: Format) -> Diagnostic {
    let message = format!("logic cannot be written as {}: it does not define steps", to.name());
    let finding = Diagnostic::error(codes::NEEDS_CHART, message)
        .help("set --to to palasm, cupl, galasm, verilog, blif or pla");
    if *place == Span::default() { finding } else { finding.at(*place, "this circuit") }
}

/// The table of a circuit's functions.
fn table(logic: &Logic) -> Result<String, Vec<Diagnostic>> {
    let table = grafsynth_backend_pld::pla::table(logic, Budget::default())?;
    Ok(grafsynth_backend_pld::pla::write(&table))
}

/// The canonical form of a `.graf` text.
///
/// # Errors
/// The findings of a text that cannot be read.
pub fn format_graf(file: FileId, text: &str) -> Result<String, Vec<Diagnostic>> {
    grafsynth_frontend::graf::format(file, text)
}

/// The canonical form of a `.rules` text.
///
/// # Errors
/// The findings of a text that cannot be read.
pub fn format_rules(file: FileId, text: &str) -> Result<String, Vec<Diagnostic>> {
    grafsynth_frontend::rules::format(file, text)
}
