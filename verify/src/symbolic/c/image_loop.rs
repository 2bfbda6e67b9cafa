//! The loop of an evolution in byte code, at which a reaction is cut.
//!
//! The code before the loop is executed up to the loop; then a round of the loop from any memory; then the whole reaction again, where the memory at the loop is
//! replaced by another one and the loop is skipped. A call from the same memory makes the same objects with the same numbers, so the other memory may be any
//! change of the one at the loop.
//!
//! The evolution is the last loop of the outermost code. In a statechart a loop can come before it, which puts the sends that are due in order.

use super::exec::{Done, Program, Stop};
use super::machine::{AtLoop, LoopOfImage, Machine, State};
use super::memory::Memory;
use super::program_image::Instruction;
use crate::symbolic::aig::Lit;

impl<'u> Program<'u> {
    /// Calls a function up to the evolution in the reaction's code. Returns the loop and the memory before it.
    pub(super) fn call_up_to_loop(
        &mut self,
        call: impl FnOnce(&mut Self) -> Done<()>,
    ) -> Done<(LoopOfImage<'u>, Memory)> {
        self.at_loop = Some(AtLoop::Stop);
        let done = call(self);
        match self.at_loop.take() {
            Some(AtLoop::Stopped(found, memory)) => {
                self.frames.clone_from(&found.frames);
                Ok((*found, memory))
            }
            _ => Err(done.err().unwrap_or_else(|| "the byte code has no loop".to_owned())),
        }
    }

    /// Calls a function as far as behind the loop, where the memory is another one.
    pub(super) fn call_from_loop(
        &mut self,
        memory: Memory,
        call: impl FnOnce(&mut Self) -> Done<()>,
    ) -> Done<()> {
        let mut obligations = std::mem::take(&mut self.obligations);
        let mut calls = std::mem::take(&mut self.calls);
        let mut reports = std::mem::take(&mut self.reports);
        let mut asked = std::mem::take(&mut self.asked);
        self.at_loop = Some(AtLoop::Skip(memory));
        let done = call(self);
        obligations.append(&mut self.obligations);
        calls.append(&mut self.calls);
        reports.append(&mut self.reports);
        for (function, mut ways) in std::mem::take(&mut self.asked) {
            asked.entry(function).or_default().append(&mut ways);
        }
        (self.obligations, self.calls) = (obligations, calls);
        (self.reports, self.asked) = (reports, asked);
        match self.at_loop.take() {
            None => done,
            Some(_) => Err("the byte code has no loop".to_owned()),
        }
    }

    /// At an instruction of the outermost code: executes it, unless the reaction is cut here.
    pub(super) fn outermost(
        &mut self,
        instruction: &Instruction,
        is_evolution: bool,
        machine: &Machine<'u>,
        mut state: State,
    ) -> Done<State> {
        let Instruction::Loop(rounds, pieces) = instruction else {
            return self.instruction(instruction, machine, state);
        };
        if !is_evolution {
            let inner = State { loops: 1, ..state };
            return Ok(State { loops: 0, ..self.instruction(instruction, machine, inner)? });
        }
        match (self.at_loop.take(), pieces.as_slice()) {
            (Some(AtLoop::Stop), [condition, body]) if self.here == Lit::TRUE => {
                self.hide_arguments(machine, &mut state.memory)?;
                let found = LoopOfImage {
                    machine: machine.clone(),
                    rounds: *rounds,
                    condition: condition.clone(),
                    body: body.clone(),
                    frames: self.frames.clone(),
                };
                self.at_loop = Some(AtLoop::Stopped(Box::new(found), state.memory));
                Err("the execution stops at the loop".to_owned())
            }
            (Some(AtLoop::Skip(memory)), [_, _]) if self.here == Lit::TRUE => {
                // What was recorded on the way to the loop belongs to another part of the proof.
                self.obligations.clear();
                self.calls.clear();
                self.reports.clear();
                self.asked.clear();
                state.memory = memory;
                Ok(state)
            }
            (None, _) => self.instruction(instruction, machine, state),
            (Some(_), _) => {
                Err::<_, Stop>("a loop of another form in byte code is not supported".to_owned())
            }
        }
    }

    /// The condition of another round, and the memory after its evaluation.
    pub(super) fn loop_condition(
        &mut self,
        of: &LoopOfImage<'u>,
        memory: Memory,
    ) -> Done<(Lit, Memory)> {
        let mut state = self.code(&of.condition, &of.machine, State::in_loop(memory))?;
        let value = state.pop()?;
        Ok((value.truth(&mut self.aig), state.memory))
    }

    /// The memory after a round whose condition is true.
    pub(super) fn loop_body(&mut self, of: &LoopOfImage<'u>, memory: Memory) -> Done<Memory> {
        Ok(self.code(&of.body, &of.machine, State::in_loop(memory))?.memory)
    }
}
