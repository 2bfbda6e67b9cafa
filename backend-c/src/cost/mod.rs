//! What a reaction costs at most: a static bound on time, stack and memory of the emitted C, and the path that costs it.
//!
//! [`bound`] reads the text that was emitted (not the chart: what is not in the text costs nothing) with the types that it declares, and adds up what each operation
//! costs on a [`Machine`] whose constants are data. Where paths part the dearer one counts: the arm of an `if`, the case of a `switch`, every operand of `&&`. Loops have
//! bounds: a constant in their condition, or one that the emitter marks (`ctext::Arm::at_most`) with its reason; a loop over micro-steps goes as often as is proved ([`Rounds`]). There is no recursion, so a call costs what
//! its function costs, and functions come after their callees. What is not understood is an error of ours ([`NotUnderstood`]), never 0.
//!
//! The compiler is free to do better; what it can do worse (registers that run short, merged tails) is within the constants, which tests on simulated machines check: a measured
//! reaction is never dearer than its bound.

mod avr;
mod choice;
mod cortex_m3;
mod i8051;
mod machine;
mod memory;
mod paths;
mod rounds;
mod syntax;
mod tasks;
mod tokens;
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

use crate::{Object, Package};
use grafsynth_ir::net::StepId;
use std::fmt;

/// The machines whose constants are known.
pub const MACHINES: &[Machine] = &[avr::AVR, cortex_m3::CORTEX_M3, i8051::I8051, x86_64::X86_64];

/// The machine of that name.
#[must_use]
pub fn machine(name: &str) -> Option<&'static Machine> {
    MACHINES.iter().find(|machine| machine.name == name)
}

/// Text of ours that the analysis does not know.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NotUnderstood {
    /// The line of `NAME.c`, from 1; 0 for the headers.
    pub line: u32,
    /// What stands there.
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
    /// The most time of `NAME_step`, from the call to the return, in the machine's unit; without functions of the user.
    pub step: u64,
    /// How that was found.
    pub way: Way,
    /// Where it was found by the text alone, why.
    pub open: Option<String>,
    /// Why `step` bounds nothing that a chart would be built for: it is what the limit of micro-steps or the text alone would allow.
    pub unbounded: Option<String>,
    /// The same of `NAME_init`.
    pub init: u64,
    /// The most calls of functions of the user in one reaction, and whether code of the user stands in it.
    pub user_calls: u64,
    /// Text of the user stands in the reaction: it is not counted.
    pub user_code: bool,
    /// Bytes of stack of `NAME_step` and all that it calls, the return address of the call among them; without functions of the user.
    pub stack: u64,
    /// Bytes of the instance.
    pub instance: u64,
    /// Bytes of `NAME_in_t` and `NAME_out_t`.
    pub io: u64,
    /// Bytes of an event ring; 0 where there is none.
    pub ring: u64,
    /// An estimate of the bytes of text, tables among them.
    pub text: u64,
    /// The path that costs `step`: its places in the order of execution.
    pub path: Vec<Place>,
    /// The most of `NAME_scan`, with as many reactions as the ring of `NAME_port.h` has places; none where there is no such function.
    pub scan: Option<ScanBound>,
    /// The same of `NAME_scan_isr`.
    pub scan_isr: Option<ScanBound>,
    /// What each task takes at most, in the order of the text.
    pub tasks: Vec<TaskBound>,
}

/// The most that a whole scan takes, from the call to the return; without what the macros of `NAME_port.h` are defined as (critical sections, watchdog, idle: nothing by default).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ScanBound {
    /// In the machine's unit; without functions and text of the user.
    pub time: u64,
    /// The most calls of functions of the user.
    pub user_calls: u64,
    /// Bytes of stack, as in [`Bound::stack`].
    pub stack: u64,
}

/// What a task takes at most, the question whether it is its turn among it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TaskBound {
    /// The step that it belongs to.
    pub step: StepId,
    /// Which of the tasks of the step, from 0.
    pub task: usize,
    /// In the machine's unit; without functions and text of the user.
    pub time: u64,
}

/// The bound of a package.
///
/// # Errors
/// Text that the analysis does not know. Where an engine interprets the chart, the text says nothing of it; of a program [`Package::instructions`] says how many of its instructions run.
pub fn bound(package: &Package, machine: &Machine) -> Result<Bound, NotUnderstood> {
    if !package.image.is_empty() || package.style == "btrans" {
        return Err(NotUnderstood::new(
            0,
            "an engine interprets the chart, and its text is the same for all charts",
        ));
    }
    let prefix = &package.interface.names.prefix;
    let stem = package.stem();
    let name = format!("{stem}.c");
    let source = package.files.iter().find(|file| file.name == name);
    let source = source.ok_or_else(|| NotUnderstood::new(0, "a package without a source"))?;
    let headers = [format!("{stem}.h"), format!("{stem}_port.h"), format!("{stem}_user.h")];
    let headers = headers.iter().filter_map(|name| {
        package.files.iter().find(|file| file.name == *name).map(|file| file.text.as_str())
    });
    of_texts(headers, &source.text, package, &source.map, prefix, machine)
}

/// The bound of a source with its headers, in the order in which they are read.
fn of_texts<'a>(
    headers: impl Iterator<Item = &'a str>,
    source: &str,
    package: &Package,
    map: &[(u32, Vec<Object>)],
    prefix: &str,
    machine: &Machine,
) -> Result<Bound, NotUnderstood> {
    let marks = &package.marks;
    let mut reader = tokens::Preprocessor::new(machine.defines);
    for text in headers {
        reader.read(text, false, &[])?;
    }
    reader.read(source, true, &marks.user)?;
    let unit = syntax::parse(&reader.finish(), machine)?;
    walk::bound(&unit, machine, prefix, marks, &package.contract, map)
}
