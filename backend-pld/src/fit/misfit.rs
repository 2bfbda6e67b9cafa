//! What does not fit, in the user's terms.

use super::pins::Need;
use crate::codes;
use crate::device::Device;
use crate::equations::Signal;
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::logic::Logic;
use grafsynth_ir::net::Meta;

/// What a device lacks.
#[derive(Debug, Default)]
pub(crate) struct Misfit {
    inputs: usize,
    macrocells: usize,
    /// Signals whose sums are wider than any macrocell: name, terms, place.
    wide: Vec<(String, usize, Meta)>,
}

impl Misfit {
    pub(crate) fn is_none(&self) -> bool {
        self.inputs + self.macrocells == 0 && self.wide.is_empty()
    }

    pub(crate) fn note(&mut self, need: Need, signal: &Signal, device: &Device) {
        match need {
            Need::Clock | Need::Input => self.inputs += 1,
            Need::Macrocell { terms, .. } if terms > widest(device) => {
                self.wide.push((signal.name.clone(), terms, signal.meta.clone()));
            }
            Need::Macrocell { .. } => self.macrocells += 1,
        }
    }

    pub(crate) fn parts(&self, device: &Device) -> Vec<String> {
        let mut parts = Vec::new();
        if self.macrocells > 0 {
            parts.push(format!(
                "{} of its registers and outputs find no macrocell",
                self.macrocells
            ));
        }
        if self.inputs > 0 {
            parts.push(format!("{} of its inputs find no pin", self.inputs));
        }
        for (name, terms, _) in &self.wide {
            parts.push(format!(
                "`{name}` needs {terms} product terms and the largest macrocell has {}",
                widest(device)
            ));
        }
        parts
    }

    pub(crate) fn diagnostic(&self, logic: &Logic, device: &Device) -> Diagnostic {
        let message = format!(
            "`{}` does not fit one {}: {}",
            logic.name,
            device.name,
            self.parts(device).join("; ")
        );
        let mut finding =
            Diagnostic::error(codes::DOES_NOT_FIT, message).at(logic.name.span, "this chart");
        for (_, _, meta) in &self.wide {
            finding = finding.at(meta.span, "too wide");
        }
        finding.help("take a larger device, split the chart, or build for `palasm` or `cupl`, which leave pins open")
    }
}

pub(crate) fn widest(device: &Device) -> usize {
    let terms =
        |cell: &crate::device::Macrocell| cell.registered_terms.max(cell.combinational_terms);
    device.macrocells.iter().map(terms).max().unwrap_or(0) as usize
}
