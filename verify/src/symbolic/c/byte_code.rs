//! The engine that interprets the image of a reaction program, executed on all paths at once.
//!
//! The C of a chart calls two functions of the engine: `gp_begin`, which clears the memory of a reaction and selects its code, and `gp_go`, which executes this
//! code until it ends or requests a function of the chart. Their text is the same for all charts and is not read here: this module is written from the
//! description of the machine in docs/c.md. So the proof is about the image and the text around it, and assumes that the interpreter does what that page says.
//!
//! Code that an instruction contains is executed under its condition, and memory is merged where paths join, as for the statements of C. At a request, the loop
//! of the chart that serves it is executed once (`serving.rs`).

use grafsynth_c::tree::{Loc, SymbolId};
use grafsynth_ir::expr::ArithOp;

use super::exec::{Done, Program};
use super::machine::{Array, DONE, EngineFunction, Machine, Request, State, Structure, put};
use super::memory::{Address, Memory, Object, Pointer, Scalar, member_offset, n_cells};
use super::program_image::{CellRow, Code, HEADER, Image, Instruction, Sizes, Source, Target, Two};
use super::value::{self, Int};
use crate::symbolic::aig::Lit;
use crate::symbolic::number::Number;

/// The bits of the numbers with which the machine computes.
const BITS: u32 = 64;
/// Calls a function of the engine; `None` if it is not one.
pub(super) fn call<'u>(
    program: &mut Program<'u>,
    function: SymbolId,
    arguments: &[Scalar],
    memory: &mut Memory,
) -> Option<Done<Option<Scalar>>> {
    let which = EngineFunction::named(&program.unit.symbols[function].name)?;
    Some(program.call_engine(which, function, arguments, memory))
}

impl<'u> Program<'u> {
    fn call_engine(
        &mut self,
        which: EngineFunction,
        function: SymbolId,
        arguments: &[Scalar],
        memory: &mut Memory,
    ) -> Done<Option<Scalar>> {
        let machine = self.machine(function, arguments, memory)?;
        match (which, arguments) {
            (EngineFunction::Begin, [_, Scalar::Int(is_reset)]) => {
                let is_reset = is_reset.truth(&mut self.aig).as_constant();
                let is_reset = is_reset.ok_or("the kind of a reaction is not known")?;
                self.begin_code(&machine, is_reset, memory)?;
                Ok(None)
            }
            (EngineFunction::Go, [_]) => Ok(Some(self.go(&machine, memory)?)),
            _ => Err("a function of the engine is called with other arguments".to_owned()),
        }
    }

    /// The machine behind the first argument of a function of the engine.
    pub(super) fn machine(
        &mut self,
        function: SymbolId,
        arguments: &[Scalar],
        memory: &Memory,
    ) -> Done<Machine<'u>> {
        let data = &self.unit.symbols[function];
        let param = data.canonical.ty.as_function().and_then(|it| it.params.first().cloned());
        let ty = param.and_then(|it| self.unit.canonical(&it).ty.target().map(|it| it.ty.clone()));
        let ty = ty.ok_or("the engine has other parameters")?;
        let Some(Scalar::Pointer(cases)) = arguments.first() else {
            return Err("the engine needs a pointer".to_owned());
        };
        let [(Pointer::To(at, _), _)] = cases.as_slice() else {
            return Err("the engine needs one known object".to_owned());
        };
        let n = n_cells(self.unit, &ty).ok_or("the size of a structure is not known")?;
        let run = Structure { at: *at, ty, n };
        let names = ["bits", "values", "in", "out", "flags", "numbers", "image"];
        let [bits, values, inputs, outputs, flags, numbers, image] =
            names.map(|name| self.array(&run, name, memory));
        let (bits, values, inputs) = (bits?, values?, inputs?);
        let (outputs, flags, numbers) = (outputs?, flags?, numbers?);
        let own = Array { at: run.at, len: run.n };
        are_apart(&[bits, values, inputs, outputs, flags, numbers, own])?;
        let sizes = Sizes {
            inputs: inputs.len,
            outputs: outputs.len,
            bytes_of_bits: bits.len,
            values: values.len,
            bytes_of_flags: flags.len,
            numbers: numbers.len,
        };
        let image = Image::read(&self.bytes_of(image?)?, &sizes);
        let image = image.map_err(|why| format!("the image is damaged: {why}"))?;
        let loc = data.span;
        let served = None;
        Ok(Machine { image, run, served, bits, values, inputs, outputs, flags, numbers, loc })
    }

    /// The array to which a member points.
    fn array(&self, run: &Structure, name: &str, memory: &Memory) -> Done<Array> {
        let cell = self.at(self.member(run, name)?, memory)?;
        match &cell.value {
            Some(Scalar::Pointer(cases)) if cell.unset == Lit::FALSE => match cases.as_slice() {
                [(Pointer::To(at, len), _)] => Ok(Array { at: *at, len: *len }),
                _ => Err(format!("it is not known to what `{name}` points")),
            },
            _ => Err(format!("`{name}` is not set before the engine is called")),
        }
    }

    pub(super) fn member(&self, run: &Structure, name: &str) -> Done<Address> {
        let members = run.ty.as_struct().map(|id| &self.unit.structs[id].members);
        let at = members.and_then(|all| all.iter().position(|member| member.name == name));
        let offset = at.and_then(|at| member_offset(self.unit, &run.ty, at));
        offset.map(|cells| run.at.behind(cells)).ok_or_else(|| format!("`{name}` is not known"))
    }

    /// The bytes of a constant array.
    fn bytes_of(&self, array: Array) -> Done<Vec<u8>> {
        let Object::Constant(_) = array.at.object else {
            return Err("an image that is not constant is not supported".to_owned());
        };
        let byte = |at: usize| {
            let cell = self.at(array.at.behind(at), &Memory::default())?;
            match &cell.value {
                Some(Scalar::Int(value)) => {
                    let byte = value.as_constant().and_then(|value| u8::try_from(value).ok());
                    byte.ok_or_else(|| "the image has something that is not a byte".to_owned())
                }
                _ => Err("the image has something that is not a number".to_owned()),
            }
        };
        (0..array.len).map(byte).collect()
    }

    /// Begins a reset or a reaction.
    fn begin_code(
        &mut self,
        machine: &Machine<'u>,
        is_reset: bool,
        memory: &mut Memory,
    ) -> Done<()> {
        let image = &machine.image;
        let cleared = [
            (machine.flags, image.n_flags.div_ceil(8)),
            (machine.numbers, image.n_numbers),
            (machine.bits, if is_reset { image.n_bits.div_ceil(8) } else { 0 }),
            (machine.values, if is_reset { image.n_values } else { 0 }),
        ];
        for (array, n) in cleared {
            for at in 0..n {
                put(memory, array.at.behind(at), Int::constant(0))?;
            }
        }
        let [first, middle, end] = image.places;
        let (at, end) = if is_reset { (first, middle) } else { (middle, end) };
        for (name, value) in
            [("at", at), ("end", end), ("depth", 0), ("loops", 0), ("cells", HEADER)]
        {
            put(memory, self.member(&machine.run, name)?, Int::constant(value as i128))?;
        }
        put(memory, self.member(&machine.run, "fault")?, Int::Bit(Lit::FALSE))
    }

    /// Executes the code from the place at which the machine is, which must be a beginning, to its end.
    pub(super) fn go(&mut self, machine: &Machine<'u>, memory: &mut Memory) -> Done<Scalar> {
        let known = ["at", "end", "depth", "loops", "cells"];
        let [at, end, depth, loops, cells] = known.map(|name| self.known(machine, name, memory));
        if cells != Some(HEADER as i128) {
            return Err("the place of the cells in the image was changed".to_owned());
        }
        let [first, middle, last] = machine.image.places.map(|place| place as i128);
        let is_at = |from, to| at == Some(from) && end == Some(to);
        let code = match (depth, loops) {
            (Some(0), Some(0)) if is_at(first, middle) => &machine.image.reset,
            (Some(0), Some(0)) if is_at(middle, last) => &machine.image.reaction,
            _ => return Err("the engine does not start at the beginning of its code".to_owned()),
        };
        if machine.served.is_some() {
            self.hide_progress(&machine.run, memory)?;
        }
        let mut state = State { memory: std::mem::take(memory), stack: Vec::new(), loops: 0 };
        let evolution = code.iter().rposition(|it| matches!(it, Instruction::Loop(..)));
        for (at, instruction) in code.iter().enumerate() {
            let is_evolution = evolution == Some(at);
            state =
                self.deeper(|this| this.outermost(instruction, is_evolution, machine, state))?;
        }
        *memory = state.memory;
        for (name, value) in [("at", end.unwrap_or(0)), ("depth", 0), ("loops", 0)] {
            put(memory, self.member(&machine.run, name)?, Int::constant(value))?;
        }
        Ok(Scalar::Int(Int::constant(DONE)))
    }

    /// The number in a member of the machine, if it is constant.
    fn known(&self, machine: &Machine<'u>, name: &str, memory: &Memory) -> Option<i128> {
        let cell = self.at(self.member(&machine.run, name).ok()?, memory).ok()?;
        match &cell.value {
            Some(Scalar::Int(value)) if cell.unset == Lit::FALSE => value.as_constant(),
            _ => None,
        }
    }

    pub(super) fn code(
        &mut self,
        code: &Code,
        machine: &Machine<'u>,
        mut state: State,
    ) -> Done<State> {
        for instruction in code {
            state = self.deeper(|this| this.instruction(instruction, machine, state))?;
        }
        Ok(state)
    }

    pub(super) fn instruction(
        &mut self,
        instruction: &Instruction,
        machine: &Machine<'u>,
        mut state: State,
    ) -> Done<State> {
        match instruction {
            Instruction::Constant(value) => state.stack.push(Int::constant(i128::from(*value))),
            Instruction::Push(source, at) => {
                let value = self.source(*source, *at, machine, &state.memory)?;
                state.stack.push(value);
            }
            Instruction::Not => {
                let truth = state.pop()?.truth(&mut self.aig);
                state.stack.push(Int::Bit(!truth));
            }
            Instruction::Neg => {
                let value = state.pop()?;
                let zero = Int::constant(0);
                let value = self.arithmetic(ArithOp::Sub, &zero, &value)?;
                state.stack.push(value);
            }
            Instruction::Element(cell) => {
                let index = state.pop()?;
                let value = self.element(&machine.image.cells[*cell], &index, machine, &state)?;
                state.stack.push(value);
            }
            Instruction::Two(two) => {
                let (b, a) = (state.pop()?, state.pop()?);
                let value = self.two(*two, &a, &b)?;
                state.stack.push(value);
            }
            Instruction::Store(target, at) => self.target(*target, *at, machine, &mut state)?,
            Instruction::Request(wanted, number, n) => {
                let first = state.stack.len().saturating_sub(*n);
                let arguments = state.stack.split_off(first);
                let request = Request { wanted: *wanted, number: *number, arguments };
                state.memory = self.serve_once(machine, request, state.memory)?;
            }
            Instruction::If(then, otherwise) => {
                let when = state.pop()?.truth(&mut self.aig);
                return self.one_of(when, then, otherwise, machine, state);
            }
            Instruction::Keep(truth, rest) => return self.decide(*truth, rest, machine, state),
            Instruction::Loop(rounds, pieces) => {
                return self.repeat(*rounds, pieces, machine, state);
            }
        }
        Ok(state)
    }

    // --- control ---

    /// Executes one of two parts.
    fn one_of(
        &mut self,
        when: Lit,
        then: &Code,
        otherwise: &Code,
        machine: &Machine<'u>,
        state: State,
    ) -> Done<State> {
        match when.as_constant() {
            Some(true) => return self.code(then, machine, state),
            Some(false) => return self.code(otherwise, machine, state),
            None => {}
        }
        let other = state.clone();
        let yes = self.under(when, |this| this.code(then, machine, state))?;
        let no = self.under(!when, |this| this.code(otherwise, machine, other))?;
        self.joined_states(vec![(when, yes), (!when, no)])
    }

    /// Keeps the top if it decides, else executes a part instead of it.
    fn decide(
        &mut self,
        truth: bool,
        rest: &Code,
        machine: &Machine<'u>,
        state: State,
    ) -> Done<State> {
        let mut kept = state.clone();
        let mut state = state;
        let top = state.pop()?;
        let decides = top.truth(&mut self.aig).negate_if(!truth);
        match decides.as_constant() {
            Some(true) => return Ok(kept),
            Some(false) => return self.code(rest, machine, state),
            None => {}
        }
        // On this path the top has the truth that decides.
        if let (Some(last), true) = (kept.stack.last_mut(), !truth || matches!(top, Int::Bit(_))) {
            *last = Int::Bit(Lit::constant(truth));
        }
        let other = self.under(!decides, |this| this.code(rest, machine, state))?;
        self.joined_states(vec![(decides, kept), (!decides, other)])
    }

    /// Repeats pieces of code, between which the loop ends unless the top is true.
    fn repeat(
        &mut self,
        rounds: u32,
        pieces: &[Code],
        machine: &Machine<'u>,
        mut state: State,
    ) -> Done<State> {
        let before = self.here;
        let mut running = Lit::TRUE;
        let mut ends = Vec::new();
        // The evolution is the only loop whose rounds are counted by the facts.
        let most = self.most_rounds.filter(|_| state.loops == 0);
        state.loops += 1;
        for round in 0..rounds {
            for (at, piece) in pieces.iter().enumerate() {
                if at > 0 {
                    let goes_on = state.pop()?.truth(&mut self.aig);
                    let leaves = self.aig.and(running, !goes_on);
                    if leaves != Lit::FALSE {
                        ends.push((leaves, state.clone()));
                    }
                    running = self.aig.and(running, goes_on);
                    self.here = self.aig.and(before, running);
                    if most.is_some_and(|most| round >= most) {
                        // The net makes no more checks, so that the path cannot be taken.
                        self.oblige(Lit::TRUE, "makes more rounds than are possible", machine.loc);
                        running = Lit::FALSE;
                    }
                    if running == Lit::FALSE {
                        break;
                    }
                }
                state = self.code(piece, machine, state)?;
            }
            if running == Lit::FALSE {
                break;
            }
        }
        self.here = before;
        if running != Lit::FALSE {
            ends.push((running, state));
        }
        for (_, state) in &mut ends {
            state.loops -= 1;
        }
        self.joined_states(ends)
    }

    /// The state after several paths, each with its condition, of which exactly one is true.
    fn joined_states(&mut self, ends: Vec<(Lit, State)>) -> Done<State> {
        let height = ends.iter().map(|(_, state)| state.stack.len()).min().unwrap_or(0);
        let mut stack = Vec::with_capacity(height);
        for at in 0..height {
            let all: Vec<(Lit, Int)> =
                ends.iter().map(|(when, state)| (*when, state.stack[at].clone())).collect();
            let is_same = all.iter().all(|(_, value)| *value == all[0].1);
            stack.push(if is_same { all[0].1.clone() } else { Int::merge(&mut self.aig, &all) });
        }
        let loops = ends.first().ok_or("a loop of the code never ends")?.1.loops;
        let ends = ends.into_iter().map(|(when, state)| (when, state.memory)).collect();
        let first = self.next_object();
        Ok(State { memory: Memory::merge(&mut self.aig, ends, first), stack, loops })
    }

    // --- values ---

    fn two(&mut self, two: Two, a: &Int, b: &Int) -> Done<Int> {
        let aig = &mut self.aig;
        Ok(match two {
            Two::And | Two::Or => {
                let (a, b) = (a.truth(aig), b.truth(aig));
                Int::Bit(if two == Two::And { aig.and(a, b) } else { aig.or(a, b) })
            }
            Two::Compare(op) => Int::Bit(value::compare(aig, op, a, b)),
            Two::Arith(op) => return self.arithmetic(op, a, b),
        })
    }

    /// The result of an operator in 64 bits, which wraps; the quotient and the remainder of a division by 0 are 0.
    fn arithmetic(&mut self, op: ArithOp, a: &Int, b: &Int) -> Done<Int> {
        // Of the amount of a shift, the six lowest bits count.
        let is_shift = matches!(op, ArithOp::Shl | ArithOp::Shr);
        let b = &if is_shift { b.wrapped(&mut self.aig, 6, false) } else { b.clone() };
        let constant = |x: i128, y: i128| match op {
            ArithOp::Add => x.checked_add(y),
            ArithOp::Sub => x.checked_sub(y),
            ArithOp::Mul => Some(x.wrapping_mul(y)),
            ArithOp::Div => Some(x.checked_div(y).unwrap_or(0)),
            ArithOp::Mod => Some(x.checked_rem(y).unwrap_or(0)),
            ArithOp::BitAnd => Some(x & y),
            ArithOp::BitOr => Some(x | y),
            ArithOp::BitXor => Some(x ^ y),
            ArithOp::Shl => Some(x << y),
            ArithOp::Shr => Some(x >> y),
        };
        let word = |aig: &mut _, x: &Number, y: &Number| {
            let (value, without) = value::arith(aig, op, x, y);
            let value = Number::select(aig, without, &Number::constant(0), &value);
            Some((value, Lit::FALSE))
        };
        let found = value::binary(&mut self.aig, a, b, constant, word);
        let (exact, _) = found.ok_or("an operator is not supported")?;
        Ok(exact.wrapped(&mut self.aig, BITS, true))
    }

    /// The value in a range that is nearest.
    fn clamped(&mut self, value: &Int, lo: i64, hi: i64) -> Int {
        match value.cases() {
            Some(cases) => {
                let clamp = |value: i128| value.clamp(lo.into(), hi.into());
                let is_inside = cases.iter().all(|(value, _)| clamp(*value) == *value);
                if is_inside {
                    return value.clone();
                }
                Int::choice(&mut self.aig, cases.into_iter().map(|(it, when)| (clamp(it), when)))
            }
            None => Int::Word(value.number(&mut self.aig).saturate(&mut self.aig, lo, hi)),
        }
    }

    // --- memory ---

    /// The number in a cell of memory, which must have been set.
    fn number_at(&mut self, at: Address, memory: &Memory, loc: Loc) -> Done<Int> {
        let cell = self.at(at, memory)?;
        self.oblige(cell.unset, "reads a value that was never set", loc);
        match &cell.value {
            Some(Scalar::Int(value)) => Ok(value.clone()),
            _ => Err("the engine reads something that has no value".to_owned()),
        }
    }

    /// A bit of an array of bytes.
    fn bit_at(&mut self, array: Array, at: usize, memory: &Memory, loc: Loc) -> Done<Lit> {
        let byte = self.number_at(array.at.behind(at / 8), memory, loc)?;
        Ok(byte.number(&mut self.aig).bit(at % 8))
    }

    /// Changes a bit of an array of bytes.
    fn put_bit(
        &mut self,
        array: Array,
        at: usize,
        bit: Lit,
        memory: &mut Memory,
        loc: Loc,
    ) -> Done<()> {
        let place = array.at.behind(at / 8);
        let byte = self.number_at(place, memory, loc)?.number(&mut self.aig);
        let own = |it| if it == at % 8 { bit } else { byte.bit(it) };
        let bits = (0..8).map(own).chain([Lit::FALSE]).collect();
        put(memory, place, Int::Word(Number::of_bits(bits)))
    }

    fn source(
        &mut self,
        source: Source,
        at: usize,
        machine: &Machine<'u>,
        memory: &Memory,
    ) -> Done<Int> {
        let loc = machine.loc;
        let array = match source {
            Source::Bit => return self.bit_at(machine.bits, at, memory, loc).map(Int::Bit),
            Source::Flag => return self.bit_at(machine.flags, at, memory, loc).map(Int::Bit),
            Source::Ticks => {
                let dt = self.member(&machine.run, "dt")?;
                return self.number_at(dt, memory, loc);
            }
            Source::Input => machine.inputs,
            Source::Value => machine.values,
            Source::Number => machine.numbers,
        };
        self.number_at(array.at.behind(at), memory, loc)
    }

    /// Pops a value and stores it.
    fn target(
        &mut self,
        target: Target,
        at: usize,
        machine: &Machine<'u>,
        state: &mut State,
    ) -> Done<()> {
        let value = state.pop()?;
        let loc = machine.loc;
        match target {
            Target::Bit | Target::Flag => {
                let array = if target == Target::Bit { machine.bits } else { machine.flags };
                let bit = value.truth(&mut self.aig);
                self.put_bit(array, at, bit, &mut state.memory, loc)
            }
            Target::Number => put(&mut state.memory, machine.numbers.at.behind(at), value),
            Target::Output => {
                let value = self.clamped(&value, i32::MIN.into(), i32::MAX.into());
                put(&mut state.memory, machine.outputs.at.behind(at), value)
            }
            Target::Fault => {
                let fault = self.member(&machine.run, "fault")?;
                let bit = value.truth(&mut self.aig);
                put(&mut state.memory, fault, Int::Bit(bit))
            }
            Target::Cell | Target::Element => {
                let index = match target {
                    Target::Element => state.pop()?,
                    _ => Int::constant(0),
                };
                let cell = &machine.image.cells[at];
                let value = self.clamped(&value, cell.lo, cell.hi);
                for (when, place) in self.places(cell, &index, machine) {
                    let old = self.number_at(place, &state.memory, loc)?;
                    let ways = [(when, value.clone()), (!when, old)];
                    let new = if when == Lit::TRUE {
                        value.clone()
                    } else {
                        Int::merge(&mut self.aig, &ways)
                    };
                    put(&mut state.memory, place, new)?;
                }
                Ok(())
            }
        }
    }

    /// The value of a cell with an index; 0 if there is none.
    fn element(
        &mut self,
        cell: &CellRow,
        index: &Int,
        machine: &Machine<'u>,
        state: &State,
    ) -> Done<Int> {
        let mut ways = Vec::new();
        for (when, place) in self.places(cell, index, machine) {
            let value = self.number_at(place, &state.memory, machine.loc)?;
            if when == Lit::TRUE {
                return Ok(value);
            }
            ways.push((when, value));
        }
        let outside = index.outside(&mut self.aig, 0, cell.n as i128 - 1);
        if outside != Lit::FALSE {
            ways.push((outside, Int::constant(0)));
        }
        Ok(Int::merge(&mut self.aig, &ways))
    }

    /// The places of the values of a cell, each with the condition that the index selects it.
    fn places(
        &mut self,
        cell: &CellRow,
        index: &Int,
        machine: &Machine<'u>,
    ) -> Vec<(Lit, Address)> {
        let all = (0..cell.n).map(|at| {
            let when = index.is(&mut self.aig, at as i128);
            (when, machine.values.at.behind(cell.first + at))
        });
        all.filter(|(when, _)| *when != Lit::FALSE).collect()
    }
}

/// Checks that no two arrays have a cell in common.
fn are_apart(all: &[Array]) -> Done<()> {
    let meet = |a: &Array, b: &Array| {
        let (x, y) = (a.at.cell, b.at.cell);
        a.at.object == b.at.object && x < y + b.len && y < x + a.len
    };
    let mut pairs =
        all.iter().enumerate().flat_map(|(at, a)| all[..at].iter().map(move |b| (a, b)));
    match pairs.any(|(a, b)| meet(a, b)) {
        true => Err("objects of the engine overlap".to_owned()),
        false => Ok(()),
    }
}
