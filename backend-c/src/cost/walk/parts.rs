//! Finds the functions that a compiler inlines into their only caller, and what each function then keeps in registers and on the stack.
//!
//! gcc inlines a `static` function with one call site (`-finline-functions-called-once`, part of `-Os` and `-O2`): no call, no arguments in separate
//! registers, no saved registers. Three things prevent it, and in these cases the model keeps the cost of a call:
//! - two functions with the same code become one (`-fipa-icf`), which then has two callers: [`shape`] finds the candidates;
//! - the caller would become too large (`large-function-insns`, 2700) or its frame (`large-stack-frame`, 256 bytes): [`LARGE`] and [`LARGE_FRAME`]
//!   are well below;
//! - the caller itself may be copied into several callers, and its callee with it.

use super::super::machine::Machine;
use super::super::memory::size;
use super::super::tree::{Expr, Function, Kind, Stmt, Type, Unit, each_name};
use super::frame::{Frame, is_one_return};
use super::kept::{self, each_local, handed};
use grafsynth_ir::Gather;
use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

/// The maximum number of names that a function mentions together with its parts. An instruction in gcc's count mentions at least one name.
const LARGE: usize = 2000;

/// The maximum number of bytes of structures and arrays that a function has on the stack together with its parts.
const LARGE_FRAME: u64 = 128;

/// How a function is compiled.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Setting {
    /// True if it is part of its only caller.
    pub(super) is_part: bool,
    /// The number of bytes of registers that it saves; a part saves none: its caller saves them.
    pub(super) saved: u64,
    /// True if locals are on the stack because there are too few registers.
    pub(super) is_spilled: bool,
    /// True if stores may use a pointer without an offset.
    pub(super) is_far: bool,
    /// Bytes of locals on the stack.
    pub(super) on_stack: u64,
}

/// The registers and memory that a function needs at the same time.
#[derive(Debug, Clone, Copy, Default)]
struct Need {
    /// Bytes of all locals.
    registers: u64,
    /// The maximum number of bytes that are live at the same time.
    live: u64,
    /// Bytes of structures among them.
    structures: u64,
    memory: u64,
    pointers: u32,
    /// The width in bits of the widest computation.
    widest: u8,
    /// Members that are kept in registers because they are read again.
    kept: u64,
    calls: bool,
    /// The number of names that it mentions.
    names: usize,
}

impl Need {
    fn of(frame: &Frame, function: &Function) -> Need {
        let mut names = 0;
        each_name(&function.body, &mut |_| names += 1);
        Need {
            registers: frame.registers,
            live: frame.live.most,
            structures: 0,
            memory: frame.memory,
            pointers: frame.pointers,
            widest: frame.widest,
            kept: frame.reads.values().filter(|n| **n > 1).count() as u64,
            calls: frame.calls,
            names,
        }
    }

    /// Moves these structures from memory to registers.
    fn keep(
        &mut self,
        unit: &Unit,
        machine: &Machine,
        function: &Function,
        kept: &BTreeSet<Rc<str>>,
    ) {
        each_local(&function.body, &mut |name, ty, _| {
            if kept.contains(name) {
                self.memory -= size(unit, machine, ty).min(self.memory);
                let bytes = kept::bytes(unit, ty, machine.register);
                self.registers += bytes;
                self.structures += bytes;
                self.live += bytes;
            }
        });
    }

    /// The need of a function with parts, one of which runs at a time.
    fn with(self, parts: &[Need], calls: bool) -> Need {
        let most = |of: &dyn Fn(&Need) -> u64| parts.iter().map(of).max().unwrap_or(0);
        Need {
            registers: self.registers + most(&|it| it.registers),
            live: self.live.max(self.structures + most(&|it| it.live)),
            structures: self.structures,
            memory: self.memory + parts.iter().map(|it| it.memory).sum::<u64>(),
            pointers: self.pointers + parts.iter().map(|it| it.pointers).max().unwrap_or(0),
            widest: parts.iter().map(|it| it.widest).fold(self.widest, u8::max),
            kept: self.kept + most(&|it| it.kept),
            calls: calls || parts.iter().any(|it| it.calls),
            names: self.names + parts.iter().map(|it| it.names).sum::<usize>(),
        }
    }

    fn setting(&self, machine: &Machine) -> Setting {
        // In addition to the named values: both operands of the widest operator.
        let temporary = 2 * u64::from(self.widest / 8).max(2);
        let registers = self.registers + temporary + self.kept;
        let scratch = if self.calls { 0 } else { u64::from(machine.scratch) };
        let saved = registers.saturating_sub(scratch).min(u64::from(machine.saved));
        let at_once = self.live + temporary + self.kept;
        let spilled = at_once.saturating_sub(u64::from(machine.registers));
        // If there are too few registers, temporaries are in memory too.
        let on_stack = self.memory + 3 * spilled + if spilled > 0 { temporary } else { 0 };
        Setting {
            is_part: false,
            saved,
            is_spilled: spilled > 0,
            is_far: self.pointers > machine.near_pointers,
            on_stack,
        }
    }
}

/// How a function is compiled: separately, and with inlining into its callers.
#[derive(Debug, Clone, Default)]
pub(super) struct Compiled {
    /// The setting of the function if it is compiled separately: not part of another function, and without parts.
    pub(super) alone: Setting,
    /// The setting of the function with its callees inlined, and inlined into its caller if it has only one.
    pub(super) whole: Setting,
    /// Its structures that are in registers, and its pointers to such structures.
    pub(super) kept: BTreeSet<Rc<str>>,
}

/// How these functions are compiled, callees first. `sites` are the call sites in the whole text; `known` is a function whose cost is known without
/// its text.
pub(super) fn compiled(
    unit: &Unit,
    machine: &Machine,
    functions: &[&Function],
    sites: &BTreeMap<Rc<str>, u64>,
    known: Option<&str>,
) -> Vec<Compiled> {
    let frames: Vec<Frame> =
        functions.iter().map(|function| Frame::of(unit, machine, function)).collect();
    let by_name: BTreeMap<&str, usize> =
        functions.iter().enumerate().map(|(at, it)| (&*it.name, at)).gather();
    // For each function its call sites, and its last caller.
    let mut sites: Vec<(u64, usize)> =
        functions.iter().map(|it| (sites.get(&it.name).copied().unwrap_or(0), 0)).collect();
    for (caller, frame) in frames.iter().enumerate() {
        for at in frame.called.keys().filter_map(|name| by_name.get(&**name)) {
            if let Some(site) = sites.get_mut(*at) {
                site.1 = caller;
            }
        }
    }
    let mut shapes: BTreeMap<Vec<i128>, u32> = BTreeMap::new();
    let shape_of: Vec<Vec<i128>> = functions.iter().map(|it| shape(unit, it)).collect();
    shape_of.iter().for_each(|shape| *shapes.entry(shape.clone()).or_default() += 1);
    let may_be_part: Vec<bool> = (functions.iter().zip(&shape_of).zip(&sites))
        .map(|((function, shape), (n, caller))| {
            // A function that others may call exists once in any case.
            let is_caller_copied = sites.get(*caller).is_some_and(|(n, _)| *n > 1)
                && functions.get(*caller).is_some_and(|it| it.is_static);
            machine.merges_single_calls
                && function.is_static
                && !is_one_return(function)
                && *n == 1
                && !is_caller_copied
                && shapes.get(shape) == Some(&1)
                && known != Some(&*function.name)
                && !has_user_code(&function.body)
        })
        .collect();
    let mut is_part = may_be_part;
    let program = Program { unit, machine, functions, frames: &frames, by_name: &by_name };
    program.whole(&mut is_part, &[]);
    let parts = (functions.iter().enumerate().zip(&sites))
        .filter(|((at, _), _)| is_part.get(*at) == Some(&true))
        .filter_map(|((at, function), (_, caller))| {
            let given = frames.get(*caller)?.arguments.get(&function.name)?;
            Some((&*function.name, (at, *caller, given.as_slice())))
        })
        .gather();
    let kept = kept::kept(unit, functions, &parts);
    // Structures in registers are no longer in memory, so no function becomes larger.
    let needs = program.whole(&mut is_part, &kept);
    let mut all: Vec<Compiled> = (needs.iter().zip(kept))
        .enumerate()
        .map(|(at, (need, kept))| {
            let alone = functions.get(at).zip(frames.get(at));
            let alone = alone.map(|(function, frame)| Need::of(frame, function));
            let alone = alone.unwrap_or_default().setting(machine);
            Compiled { alone, whole: need.setting(machine), kept }
        })
        .collect();
    // Callers come last: they decide about their parts.
    for at in (0..all.len()).rev() {
        if is_part.get(at) != Some(&true) {
            continue;
        }
        let caller = sites.get(at).and_then(|(_, caller)| all.get(*caller)).map(|it| it.whole);
        if let (Some(one), Some(caller)) = (all.get_mut(at), caller) {
            one.whole = Setting { is_part: true, saved: 0, on_stack: 0, ..caller };
        }
    }
    all
}

/// The functions to analyse.
struct Program<'a> {
    unit: &'a Unit,
    machine: &'a Machine,
    functions: &'a [&'a Function],
    frames: &'a [Frame],
    by_name: &'a BTreeMap<&'a str, usize>,
}

impl Program<'_> {
    /// The need of each function, including its parts. A function that becomes too large keeps its parts as separate functions. `kept` are the structures in
    /// registers.
    fn whole(&self, is_part: &mut [bool], kept: &[BTreeSet<Rc<str>>]) -> Vec<Need> {
        let mut needs: Vec<Need> = Vec::with_capacity(self.functions.len());
        for (at, (function, frame)) in self.functions.iter().zip(self.frames).enumerate() {
            let mut own = Need::of(frame, function);
            if let Some(kept) = kept.get(at) {
                own.keep(self.unit, self.machine, function, kept);
            }
            let callees: BTreeSet<usize> =
                frame.called.keys().filter_map(|name| self.by_name.get(&**name)).copied().gather();
            let called_parts: Vec<usize> =
                callees.iter().copied().filter(|it| is_part.get(*it) == Some(&true)).collect();
            let part_needs: Vec<Need> = (called_parts.iter())
                .filter_map(|it| {
                    let (need, part) = (needs.get(*it)?, self.functions.get(*it)?);
                    let need = without_handed_on(need, part, frame, self.machine);
                    let around = frame.live.at_calls.get(&part.name).copied().unwrap_or(0);
                    Some(Need { live: need.live + around, ..need })
                })
                .collect();
            let is_all_parts = frame.called.keys().all(|name| {
                self.by_name.get(&**name).is_some_and(|it| is_part.get(*it) == Some(&true))
            });
            let calls = frame.calls && (!is_all_parts || has_user_code(&function.body));
            let whole = own.with(&part_needs, calls);
            if whole.names > LARGE || whole.memory > LARGE_FRAME {
                // It is not known which of the parts remain functions.
                for part in called_parts {
                    if let Some(part) = is_part.get_mut(part) {
                        *part = false;
                    }
                }
                needs.push(own);
            } else {
                needs.push(whole);
            }
        }
        needs
    }
}

/// The additional need of a part within its caller: a pointer that is passed on unchanged is already in a register.
fn without_handed_on(need: &Need, part: &Function, caller: &Frame, machine: &Machine) -> Need {
    let arguments = caller.arguments.get(&part.name).map(Vec::as_slice).unwrap_or_default();
    let handed_on = (part.parameters.iter().zip(arguments))
        .filter(|((_, ty), argument)| is_handed_on(ty, argument))
        .count();
    let bytes = u64::from(machine.pointer.max(machine.register)) * handed_on as u64;
    Need {
        registers: need.registers.saturating_sub(bytes),
        live: need.live.saturating_sub(bytes),
        pointers: need.pointers.saturating_sub(u32::try_from(handed_on).unwrap_or(0)),
        ..*need
    }
}

/// True for a pointer that a part receives unchanged from its caller, or that points to a local of its caller.
pub(super) fn is_handed_on(ty: &Type, argument: &Expr) -> bool {
    matches!(ty, Type::Pointer(..)) && handed(argument).is_some()
}

fn has_user_code(list: &[Stmt]) -> bool {
    list.iter().any(|stmt| match &stmt.kind {
        Kind::UserCode => true,
        Kind::If(arms, otherwise) => {
            arms.iter().any(|(_, body)| has_user_code(body)) || has_user_code(otherwise)
        }
        Kind::Switch(_, sections) => sections.iter().any(|(_, body)| has_user_code(body)),
        Kind::Loop { body, .. } | Kind::Block(body) => has_user_code(body),
        Kind::Expr(_) | Kind::Local { .. } | Kind::Return(_) | Kind::Break | Kind::Continue => {
            false
        }
    })
}

/// The shape of a function: its names in order, each as the value of a constant or as the index of its first occurrence. Two functions with the same code have
/// the same result, whatever their locals and members are called.
fn shape(unit: &Unit, function: &Function) -> Vec<i128> {
    let mut met: Vec<Rc<str>> = Vec::new();
    let mut out = vec![function.parameters.len() as i128];
    each_name(&function.body, &mut |name| {
        if let Some(value) = unit.constants.get(name) {
            out.extend([0, *value]);
            return;
        }
        let at = met.iter().position(|it| &**it == name).unwrap_or_else(|| {
            met.push(Rc::from(name));
            met.len() - 1
        });
        out.extend([1, at as i128]);
    });
    out
}
