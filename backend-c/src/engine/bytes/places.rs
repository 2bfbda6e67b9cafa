//! Assigns locations to cells and temps, and numbers to the parameters of the code.

use crate::engine::image::narrow;
use crate::queries::is_c;
use grafsynth_ir::Gather;
use grafsynth_ir::IdMap;
use grafsynth_ir::net::{InputId, InputKind, Net, OutputId};
use grafsynth_ir::program::{Cell, CellId, Program, ResetEffect, Stmt, statements};
use std::collections::BTreeMap;

/// The location of a cell in an instance, or of a temp in a reaction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::engine) enum Place {
    /// A Boolean: its bit number.
    Bit(u16),
    /// An integer: the row of a cell, or the index of a temp.
    Number(u16),
}

/// The locations of the program's data, and its parameters.
pub(in crate::engine) struct Places {
    /// The location of each cell.
    pub(in crate::engine) cells: IdMap<Cell, Place>,
    /// For each row: its cell, the index of its first number in the instance, and how many numbers it has.
    pub(in crate::engine) rows: Vec<(CellId, usize, usize)>,
    /// The position of each input or condition in the inputs of a reaction.
    pub(in crate::engine) inputs: BTreeMap<InputId, u16>,
    /// Extern actions, by number.
    pub(in crate::engine) actions: Vec<OutputId>,
    /// The positions of the outputs that are not extern actions.
    pub(in crate::engine) outputs: BTreeMap<OutputId, u16>,
    /// C texts, by number.
    pub(in crate::engine) texts: Vec<String>,
    /// The total number of bits.
    pub(in crate::engine) n_bits: usize,
    /// The total number of numbers.
    pub(in crate::engine) n_values: usize,
}

impl Places {
    /// The index of a row's first number in the instance.
    pub(in crate::engine) fn first(&self, row: u16) -> u16 {
        self.rows.get(usize::from(row)).map_or(0, |(_, first, _)| narrow(*first))
    }

    /// Assigns all locations. Steps come first, in declaration order, so that an unrelated edit moves little.
    pub(in crate::engine) fn of(net: &Net, program: &Program) -> Self {
        let (mut n_bits, mut n_values) = (0, 0);
        let mut rows = Vec::new();
        let cells = IdMap::build(&program.cells, |id, cell| {
            if cell.ty.is_bool() && cell.len.is_none() {
                n_bits += 1;
                return Place::Bit(narrow(n_bits - 1));
            }
            let len = cell.len.map_or(1, |len| len as usize);
            rows.push((id, n_values, len));
            n_values += len;
            Place::Number(narrow(rows.len() - 1))
        });
        let handed = net.inputs.iter().filter(|(_, it)| it.kind.is_handed());
        let asked = net.inputs.iter().filter(|(_, it)| it.kind == InputKind::Extern);
        let inputs = handed.chain(asked).enumerate().map(|(at, (id, _))| (id, narrow(at))).gather();
        let is_action = |id: &OutputId| net.outputs[*id].is_extern();
        let all: Vec<OutputId> = net.outputs.iter().map(|(id, _)| id).collect();
        let actions: Vec<OutputId> = all.iter().copied().filter(is_action).collect();
        let others = all.iter().copied().filter(|id| !is_action(id));
        let outputs = others.enumerate().map(|(at, id)| (id, narrow(at))).gather();
        let mut texts = Vec::new();
        let mut note = |language: &str, text: &str| {
            if is_c(language) && !texts.iter().any(|known| known == text) {
                texts.push(text.to_owned());
            }
        };
        for effect in &program.reset_effects {
            if let ResetEffect::Code(text) = effect {
                note(&text.language, &text.text);
            }
        }
        for stmt in statements(&program.body) {
            if let Stmt::Code(text) = stmt {
                note(&text.language, &text.text);
            }
        }
        Places { cells, rows, inputs, actions, outputs, texts, n_bits, n_values }
    }
}
