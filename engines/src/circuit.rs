//! Runs circuits in this process: as encoded, and as read back from each equation language.

use crate::{Engine, EngineError, Job, Pace};
use grafsynth_backend_pld::Dialect;
use grafsynth_driver::pipeline;
use grafsynth_driver::run::logic_trace;
use grafsynth_sim::Trace;

/// The circuit of a net, optionally written to a text and read back.
#[derive(Debug, Clone, Copy)]
pub struct CircuitEngine {
    name: &'static str,
    about: &'static str,
    dialect: Option<Dialect>,
}

impl CircuitEngine {
    /// One engine for the circuit itself and one for each equation language.
    pub const ALL: [CircuitEngine; 6] = [
        CircuitEngine { name: "equations", about: "the circuit, before any text", dialect: None },
        CircuitEngine {
            name: "palasm",
            about: "the PALASM text, read back",
            dialect: Some(Dialect::Palasm),
        },
        CircuitEngine {
            name: "cupl",
            about: "the CUPL text, read back",
            dialect: Some(Dialect::Cupl),
        },
        CircuitEngine {
            name: "galasm",
            about: "the GALasm text, read back",
            dialect: Some(Dialect::Galasm),
        },
        CircuitEngine {
            name: "blif",
            about: "the BLIF text, read back",
            dialect: Some(Dialect::Blif),
        },
        CircuitEngine {
            name: "netlist",
            about: "the Verilog text, read back",
            dialect: Some(Dialect::Verilog),
        },
    ];
}

impl Engine for CircuitEngine {
    fn name(&self) -> &'static str {
        self.name
    }

    fn about(&self) -> &'static str {
        self.about
    }

    fn pace(&self) -> Pace {
        Pace::Clocks
    }

    fn run(&self, job: &Job<'_>) -> Result<Trace, EngineError> {
        let logic = pipeline::logic(job.net, job.facts).map_err(EngineError::Refused)?;
        let logic = match self.dialect {
            None => logic,
            Some(dialect) => {
                let options = pipeline::emit_options(job.net, None, None);
                pipeline::through(&logic, dialect, &options)
                    .map_err(EngineError::Refused)?
                    .read_back
            }
        };
        logic_trace(job.net, &logic, job.stimulus).map_err(EngineError::Refused)
    }
}
