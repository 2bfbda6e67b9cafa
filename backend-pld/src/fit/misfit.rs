//! What does not fit, in the user's terms.

use super::pins::Need;
use crate::codes;
use crate::device::{Blocks, Device};
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
    /// Functions that no logic block has room for: name, signals read, place.
    homeless: Vec<(String, usize, Meta)>,
    /// What such a block holds: macrocells and signals.
    block: (u32, u32),
}

impl Misfit {
    pub(crate) fn is_none(&self) -> bool {
        self.inputs + self.macrocells == 0 && self.wide.is_empty() && self.homeless.is_empty()
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

    /// A function for which no logic block has enough macrocells, pins and ways in left.
    pub(crate) fn note_block(&mut self, signal: &Signal, n_signals: usize, blocks: &Blocks) {
        self.block = (blocks.n_cells, blocks.fan_in);
        self.homeless.push((signal.name.clone(), n_signals, signal.meta.clone()));
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
        if let Some((name, n_signals, _)) = self.homeless.first() {
            parts.push(format!(
                "{} of its functions find no room in a logic block of {} macrocells that reads {} signals, the first is `{name}`, which reads {n_signals}",
                self.homeless.len(),
                self.block.0,
                self.block.1
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
        for (_, _, meta) in &self.homeless {
            finding = finding.at(meta.span, "finds no room");
        }
        finding.help("take a larger device, split the chart, or build for `palasm` or `cupl`, which leave pins open")
    }
}

pub(crate) fn widest(device: &Device) -> usize {
    let terms =
        |cell: &crate::device::Macrocell| cell.registered_terms.max(cell.combinational_terms);
    device.macrocells.iter().map(terms).max().unwrap_or(0) as usize
}
