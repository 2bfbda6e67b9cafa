//! Engines: everything that can run a design with a stimulus and return a trace.
//!
//! ```text
//! for engine in engines::all() {
//!     match engine.availability() { Availability::Here => .., Availability::Missing(tool) => report it }
//!     let trace = engine.run(&job)?;      // the same columns for every engine: semantics.md §11
//! }
//! ```
//!
//! `ir` is the reference simulator, `c` the emitted C compiled by the host's compiler, `equations` the circuit before any text, `palasm`, `cupl`,
//! `galasm`, `blif` and `netlist` the emitted texts read back, `jedec` the fuse map of a GAL simulated fuse by fuse, `verilog` the emitted Verilog run by
//! Icarus Verilog, `js` the JavaScript of a page run by node, `c-avr`, `c-arm` and `c-8051` the emitted C on a simulated microcontroller. Only this crate
//! starts processes.

mod arm;
mod avr;
pub mod c;
mod c8051;
mod circuit;
mod device;
mod executed;
pub mod exhaustive;
mod explorer;
mod firmware;
pub mod ice40;
mod interpreted;
mod js;
pub mod measure;
pub mod memory;
pub mod scratch;
mod simavr;
mod split;
pub mod tested;
pub mod tools;
mod unread_inputs;
mod verilog;
mod watchdog;

use grafsynth_ir::facts::Facts;
use grafsynth_ir::net::Net;
use grafsynth_ir::{Diagnostic, Valid};
use grafsynth_sim::{Stimulus, Trace};

pub use arm::ArmEngine;
pub use avr::AvrEngine;
pub use c::CEngine;
pub use c8051::C8051Engine;
pub use circuit::CircuitEngine;
pub use device::DeviceEngine;
pub use firmware::{Machine, Piece};
pub use js::{JsEngine, js_traces};
pub use split::{OfCpu, SplitEngine};
pub use verilog::VerilogEngine;

/// The input of an engine.
#[derive(Debug, Clone, Copy)]
pub struct Job<'a> {
    /// The net.
    pub net: &'a Valid<Net>,
    /// The facts about it.
    pub facts: &'a Facts,
    /// The stimulus.
    pub stimulus: &'a Stimulus,
}

/// Whether an engine can run on this machine.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Availability {
    /// It can run.
    Here,
    /// This program is missing.
    Missing(String),
}

/// How an engine takes the rows of a stimulus.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Pace {
    /// One reaction for each row.
    Rows,
    /// One reaction for each clock: a row with several ticks becomes that many clocks, each with its own row of the trace ([`Clocked`](grafsynth_sim::Clocked)).
    Clocks,
    /// One event at a time, with the reactions of the chart until it is at rest: the trace has the rows of [`Events`](grafsynth_sim::Events).
    Events,
}

/// Why there is no trace.
#[derive(Debug, Clone)]
pub enum EngineError {
    /// The back end does not support this chart, or the engine does not support the stimulus.
    Refused(Vec<Diagnostic>),
    /// A program failed; this is its output.
    Failed(String),
}

/// Something that can run a net.
pub trait Engine: Sync {
    /// Its name on the command line.
    fn name(&self) -> &'static str;

    /// A short description.
    fn about(&self) -> &'static str;

    /// Whether the programs that it needs are installed.
    fn availability(&self) -> Availability {
        Availability::Here
    }

    /// True if `compare` runs it when no engine is named.
    fn by_default(&self) -> bool {
        true
    }

    /// How it takes the rows of a stimulus.
    fn pace(&self) -> Pace {
        Pace::Rows
    }

    /// True if it compiles and runs the emitted C, which includes C code of the chart's author.
    fn runs_c(&self) -> bool {
        false
    }

    /// The trace of this job.
    ///
    /// # Errors
    /// See [`EngineError`].
    fn run(&self, job: &Job<'_>) -> Result<Trace, EngineError>;
}

/// The reference simulator.
#[derive(Debug, Clone, Copy)]
pub struct ReferenceEngine;

impl Engine for ReferenceEngine {
    fn name(&self) -> &'static str {
        "ir"
    }

    fn about(&self) -> &'static str {
        "the reference simulator"
    }

    fn run(&self, job: &Job<'_>) -> Result<Trace, EngineError> {
        Ok(grafsynth_driver::run::net_trace(job.net, job.stimulus))
    }
}

/// All engines, the reference first.
#[must_use]
pub fn all() -> Vec<Box<dyn Engine>> {
    let mut engines: Vec<Box<dyn Engine>> =
        vec![Box::new(ReferenceEngine), Box::new(CEngine::default())];
    engines.extend(CircuitEngine::ALL.map(|engine| Box::new(engine) as Box<dyn Engine>));
    engines.push(Box::new(DeviceEngine { device: None }));
    engines.push(Box::new(VerilogEngine));
    engines.push(Box::new(JsEngine));
    engines.push(Box::new(AvrEngine::default()));
    engines.push(Box::new(ArmEngine::default()));
    engines.push(Box::new(C8051Engine::default()));
    engines
}

/// The engine with this name; engines that run C accept a style after it: `c-avr:engine`.
#[must_use]
pub fn named(name: &str) -> Option<Box<dyn Engine>> {
    if let Some((machine, style)) = name.split_once(':') {
        let style = grafsynth_backend_c::Style::from_name(style)?;
        let options = grafsynth_backend_c::Options { style, ..Default::default() };
        return match machine {
            "c" => Some(Box::new(CEngine { options })),
            "c-avr" => Some(Box::new(AvrEngine { options, ..AvrEngine::default() })),
            "c-arm" => Some(Box::new(ArmEngine { options })),
            "c-8051" => Some(Box::new(C8051Engine { options })),
            _ => None,
        };
    }
    all().into_iter().find(|engine| engine.name() == name)
}
