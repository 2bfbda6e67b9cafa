//! Worst-case cost of a reaction: a static bound on time, stack and memory of the emitted C, and the worst-case path.
//!
//! [`bound`] reads the emitted text (not the chart: an object that is not in the text costs nothing) with the types that it declares, and adds up the cost of
//! each operation on a [`Machine`] whose constants are data. If paths diverge, the more expensive one counts: the branch of an `if`, the case of a
//! `switch`, every operand of `&&`. Loops have bounds: a constant in their condition, or a bound that the emitter states (`c::print::Arm::at_most`)
//! with its reason. A loop over micro-steps counts as many rounds as are proved ([`Rounds`]). There is no recursion, so a call costs as much
//! as its function, and callees come before their callers. Text that the analysis does not know is an internal error ([`NotUnderstood`]), never a
//! cost of 0.
//!
//! The compiler may do better. The constants include the cases in which it may do worse (too few registers, merged tails). Tests on simulated machines check
//! that a measured reaction never exceeds its bound.

mod avr;
mod choice;
mod cortex_m3;
mod i8051;
mod machine;
mod memory;
mod paths;
mod read;
mod rounds;
mod tasks;
mod tree;
mod walk;
mod x86_64;

pub(crate) use choice::emit_best;
pub use choice::{Candidate, Goal};
pub use machine::{Machine, Op, Widths};
pub(crate) use paths::Contract;
pub use paths::Way;
pub use rounds::{Rounds, rounds};
pub use tasks::{is_counted, tasks};
pub use walk::Place;

use crate::{File, Package};
use grafsynth_ir::net::StepId;
use std::fmt;

/// The machines whose constants are known.
pub const MACHINES: &[Machine] = &[avr::AVR, cortex_m3::CORTEX_M3, i8051::I8051, x86_64::X86_64];

/// The machine of that name.
#[must_use]
pub fn machine(name: &str) -> Option<&'static Machine> {
    MACHINES.iter().find(|machine| machine.name == name)
}

/// Emitted text that the analysis does not know.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NotUnderstood {
    /// The line of `NAME.c`, from 1; 0 for the headers.
    pub line: u32,
    /// The text found there.
    pub what: String,
}

impl NotUnderstood {
    pub(self) fn new(line: u32, what: impl Into<String>) -> Self {
        NotUnderstood { line, what: what.into() }
    }
}

impl fmt::Display for NotUnderstood {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "the cost of line {} of the emitted C is not known: {}", self.line, self.what)
    }
}

/// A static bound of one chart on one machine.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Bound {
    /// The maximum time of `NAME_step`, from call to return, in the machine's unit; without user functions.
    pub step: u64,
    /// How the paths for the bound were explored.
    pub way: Way,
    /// Why paths could not be explored, so that the bound is from the text alone; `None` if they were explored.
    pub open: Option<String>,
    /// Why `step` is not a useful bound, for example because it only reflects the limit of micro-steps; `None` if it is useful.
    pub unbounded: Option<String>,
    /// The maximum time of `NAME_init`, as in [`Bound::step`].
    pub init: u64,
    /// The maximum number of calls of user functions in one reaction.
    pub user_calls: u64,
    /// True if the reaction contains user code, which is not counted.
    pub user_code: bool,
    /// Stack bytes of `NAME_step` and everything that it calls, including the return address; without user functions.
    pub stack: u64,
    /// Bytes of the instance.
    pub instance: u64,
    /// Bytes of `NAME_in_t` and `NAME_out_t`.
    pub io: u64,
    /// Bytes of an event ring; 0 if there is none.
    pub ring: u64,
    /// An estimate of the code size in bytes, including tables.
    pub text: u64,
    /// The worst-case path, which costs `step`: its locations in execution order.
    pub path: Vec<Place>,
    /// The maximum of `NAME_scan`, with as many reactions as the ring of `NAME_port.h` has entries; `None` if there is no such function.
    pub scan: Option<ScanBound>,
    /// The maximum of `NAME_scan_isr`, as in [`Bound::scan`].
    pub scan_isr: Option<ScanBound>,
    /// The maximum cost of each task, in the order of the text.
    pub tasks: Vec<TaskBound>,
}

/// The maximum cost of a whole scan, from call to return; without the macros of `NAME_port.h` (critical sections, watchdog, idle: empty by default).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ScanBound {
    /// The time in the machine's unit; without user functions and user code.
    pub time: u64,
    /// The maximum number of calls of user functions.
    pub user_calls: u64,
    /// Bytes of stack, as in [`Bound::stack`].
    pub stack: u64,
}

/// The maximum cost of a task, including the check whether it is its turn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TaskBound {
    /// The step that it belongs to.
    pub step: StepId,
    /// The index of the task within the step, from 0.
    pub task: usize,
    /// The time in the machine's unit; without user functions and user code.
    pub time: u64,
}

/// The bound of a package.
///
/// # Errors
/// If the text contains something that the analysis does not know, or if an engine interprets the chart: then the text does not determine the time. For a program,
/// [`Package::instructions`] reports how many of its instructions run.
pub fn bound(package: &Package, machine: &Machine) -> Result<Bound, NotUnderstood> {
    if !package.image.is_empty() || package.style == "btrans" {
        return Err(NotUnderstood::new(
            0,
            "an engine interprets the chart, and its text is the same for all charts",
        ));
    }
    let stem = package.stem();
    let file = |name: &str| package.files.iter().find(|file| file.name == name);
    let source = file(&format!("{stem}.c"))
        .ok_or_else(|| NotUnderstood::new(0, "a package without a source"))?;
    let headers = [format!("{stem}.h"), format!("{stem}_port.h"), format!("{stem}_user.h")];
    let headers: Vec<&File> = headers.iter().filter_map(|name| file(name)).collect();
    let marks = &package.marks;
    let unit = read::read(&headers, source, &marks.user, machine)?;
    let prefix = &package.interface.names.prefix;
    walk::bound(&unit, machine, prefix, marks, &package.contract, &source.map)
}
