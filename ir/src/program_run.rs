//! Runs a reaction program: a simple interpreter.
//!
//! The lowering uses it to execute the reset of a net (so that all effects of the reset are constants of the [`Program`]), and the differential tests use
//! it as an engine: the program of a net must give the same results as the simulator.
//!
//! ```
//! use grafsynth_ir::program::Program;
//! use grafsynth_ir::program_run::Machine;
//! let program = Program::default();
//! let mut machine = Machine::new(&program);
//! assert!(machine.react(&[], 1).outputs.is_empty());
//! ```

use crate::program::{CellId, Expr, Leaf, Program, ResetEffect, Stmt};

/// A program and its current state.
#[derive(Debug, Clone)]
pub struct Machine<'a> {
    program: &'a Program,
    cells: Vec<Vec<i64>>,
    temps: Vec<i64>,
}

/// The visible results of one reaction or of the reset.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Shown {
    /// The value of each output by its id; 0 for extern actions and for outputs that the program does not set.
    pub outputs: Vec<i64>,
    /// Calls of extern actions and target-language texts, in order.
    pub effects: Vec<ResetEffect>,
    /// The fault flag.
    pub fault: bool,
}

impl<'a> Machine<'a> {
    /// The machine after reset.
    #[must_use]
    pub fn new(program: &'a Program) -> Self {
        Machine {
            program,
            cells: program.cells.values().map(|cell| cell.init.clone()).collect(),
            temps: vec![0; program.temps.len()],
        }
    }

    /// Returns to the state after reset, and reports the visible results of the reset.
    pub fn reset(&mut self) -> Shown {
        *self = Machine::new(self.program);
        Shown {
            outputs: self.program.reset_outputs.clone(),
            effects: self.program.reset_effects.clone(),
            fault: self.program.reset_fault,
        }
    }

    /// The elements of a cell; one if it is not an array.
    #[must_use]
    pub fn cell(&self, cell: CellId) -> &[i64] {
        self.cells.get(cell.index()).map_or(&[], Vec::as_slice)
    }

    /// One reaction: `inputs` by input id (missing inputs are 0; those of internal events are ignored), `dt` ticks after the previous reaction.
    pub fn react(&mut self, inputs: &[i64], dt: u32) -> Shown {
        let program = self.program;
        let mut shown = Shown { outputs: vec![0; program.reset_outputs.len()], ..Shown::default() };
        self.run(&program.body, &Latched { inputs, dt }, &mut shown);
        shown
    }

    fn run(&mut self, body: &[Stmt], latched: &Latched<'_>, shown: &mut Shown) {
        for statement in body {
            match statement {
                Stmt::Set(temp, value) => {
                    let value = self.value(value, latched);
                    if let Some(slot) = self.temps.get_mut(temp.index()) {
                        *slot = value;
                    }
                }
                Stmt::Store(cell, index, value) => {
                    let value = self.value(value, latched);
                    let index = index.as_ref().map_or(0, |index| self.value(index, latched));
                    if let Ok(index) = usize::try_from(index) {
                        self.store(*cell, index, value);
                    }
                }
                Stmt::If(condition, then, otherwise) => {
                    let holds = self.value(condition, latched) != 0;
                    self.run(if holds { then } else { otherwise }, latched, shown);
                }
                Stmt::Repeat { limit, condition, body } => {
                    for _ in 0..*limit {
                        if self.value(condition, latched) == 0 {
                            break;
                        }
                        self.run(body, latched, shown);
                    }
                }
                Stmt::Output(output, value) => {
                    let value = self.value(value, latched);
                    if shown.outputs.len() <= output.index() {
                        shown.outputs.resize(output.index() + 1, 0);
                    }
                    shown.outputs[output.index()] = value;
                }
                Stmt::Call(output, arguments) => {
                    let arguments = arguments.iter().map(|a| self.value(a, latched)).collect();
                    shown.effects.push(ResetEffect::Call(*output, arguments));
                }
                Stmt::Code(text) => shown.effects.push(ResetEffect::Code(text.clone())),
                Stmt::Mark(_) => {}
                Stmt::Fault(value) => shown.fault = self.value(value, latched) != 0,
            }
        }
    }

    fn store(&mut self, cell: CellId, index: usize, value: i64) {
        if let (Some(declared), Some(values)) =
            (self.program.cells.get(cell), self.cells.get_mut(cell.index()))
            && let Some(slot) = values.get_mut(index)
        {
            *slot = declared.ty.saturate(value);
        }
    }

    fn value(&self, expr: &Expr, latched: &Latched<'_>) -> i64 {
        expr.eval(&mut |leaf, index| match leaf {
            Leaf::Cell(cell) => {
                let index = usize::try_from(index).ok();
                index.and_then(|index| self.cell(*cell).get(index)).copied().unwrap_or(0)
            }
            Leaf::Temp(temp) => self.temps.get(temp.index()).copied().unwrap_or(0),
            Leaf::Input(input) => latched.inputs.get(input.index()).copied().unwrap_or(0),
            Leaf::Dt => i64::from(latched.dt),
        })
    }
}

struct Latched<'a> {
    inputs: &'a [i64],
    dt: u32,
}
