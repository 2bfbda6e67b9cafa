//! The machine that interprets byte code, as data: what its caller passes in, the state of a path, requests and the loop that performs them.

use std::collections::BTreeMap;
use std::rc::Rc;

use grafsynth_c::tree::types::Type;
use grafsynth_c::tree::{Expr, Loc, Stmt, SymbolId};

use super::memory::{Address, Cell, Memory, Object, Scalar};
use super::program_image::{Code, Image};
use super::value::Int;

/// What `gp_go` returns at the end of the code.
pub(super) const DONE: i128 = 0;

/// A function of the engine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum EngineFunction {
    Begin,
    Go,
}

impl EngineFunction {
    /// The function with this name.
    pub(super) fn named(name: &str) -> Option<Self> {
        match name {
            "gp_begin" => Some(EngineFunction::Begin),
            "gp_go" => Some(EngineFunction::Go),
            _ => None,
        }
    }
}

/// An array in memory.
#[derive(Debug, Clone, Copy)]
pub(super) struct Array {
    pub(super) at: Address,
    pub(super) len: usize,
}

/// The machine: the image, and where its caller keeps what it reads and writes.
#[derive(Clone)]
pub(super) struct Machine<'u> {
    pub(super) image: Image,
    pub(super) run: Structure,
    /// What performs its requests.
    pub(super) served: Option<Served<'u>>,
    pub(super) bits: Array,
    pub(super) values: Array,
    pub(super) inputs: Array,
    pub(super) outputs: Array,
    pub(super) flags: Array,
    pub(super) numbers: Array,
    pub(super) loc: Loc,
}

/// A `gp_run_t`, and the cells of its members.
#[derive(Debug, Clone)]
pub(super) struct Structure {
    pub(super) at: Address,
    pub(super) ty: Type,
    pub(super) n: usize,
}

/// The state of one path.
#[derive(Clone)]
pub(super) struct State {
    pub(super) memory: Memory,
    pub(super) stack: Vec<Int>,
    /// The number of loops around the current place.
    pub(super) loops: u32,
}

/// A loop that performs requests.
#[derive(Clone, Copy)]
pub(super) struct ServingLoop<'u> {
    pub(super) engine: SymbolId,
    /// The local with the request.
    pub(super) wants: SymbolId,
    pub(super) condition: &'u Expr,
    /// The statements of the loop up to the next call of the engine.
    pub(super) body: &'u [Stmt],
    /// The argument of the first call, and of the next one.
    pub(super) first: &'u Expr,
    pub(super) next: &'u Expr,
}

/// Such a loop while it runs.
#[derive(Clone)]
pub(super) struct Served<'u> {
    pub(super) by: ServingLoop<'u>,
    /// The object of the local.
    pub(super) wants: usize,
    /// The pointer to the machine.
    pub(super) run: Scalar,
}

/// What an instruction requests.
pub(super) struct Request {
    /// The number that the engine returns.
    pub(super) wanted: u8,
    /// The object that it is about.
    pub(super) number: usize,
    pub(super) arguments: Vec<Int>,
}

/// What happens at the loop of a reaction.
pub(super) enum AtLoop<'u> {
    /// The execution stops.
    Stop,
    /// It has stopped.
    Stopped(Box<LoopOfImage<'u>>, Memory),
    /// It goes on after the loop, in this memory.
    Skip(Memory),
}

/// A loop whose condition comes first.
pub(super) struct LoopOfImage<'u> {
    pub(super) machine: Machine<'u>,
    /// The maximum number of rounds.
    pub(super) rounds: u32,
    pub(super) condition: Code,
    pub(super) body: Code,
    /// The objects of the locals around it, by call.
    pub(super) frames: Vec<BTreeMap<SymbolId, Object>>,
}

impl State {
    /// A state in the outermost loop.
    pub(super) fn in_loop(memory: Memory) -> State {
        State { memory, stack: Vec::new(), loops: 1 }
    }

    pub(super) fn pop(&mut self) -> Result<Int, String> {
        self.stack.pop().ok_or_else(|| "the stack of the code is empty".to_owned())
    }
}

/// Stores a number in a cell of memory.
pub(super) fn put(memory: &mut Memory, at: Address, value: Int) -> Result<(), String> {
    let is_done = match at.object {
        Object::Changing(object) => {
            memory.put(object, at.cell, Rc::new(Cell::of(Scalar::Int(value))))
        }
        Object::Constant(_) => false,
    };
    if is_done { Ok(()) } else { Err("the engine writes outside of its objects".to_owned()) }
}
