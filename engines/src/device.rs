//! Simulates a programmed device, fuse by fuse.

use crate::{Engine, EngineError, Job, Pace};
use grafsynth_driver::run::device_trace;
use grafsynth_driver::{jedec, pipeline};
use grafsynth_sim::Trace;

/// The fuse map of a net in the fuse simulator, with the state assignment that a build would choose. A circuit that does not fit with any assignment is rejected.
#[derive(Debug, Clone, Copy)]
pub struct DeviceEngine {
    /// The device; `None` selects that of the net's board, or the default.
    pub device: Option<&'static str>,
}

impl Engine for DeviceEngine {
    fn name(&self) -> &'static str {
        "jedec"
    }

    fn about(&self) -> &'static str {
        "the fuse map of a GAL, fuse by fuse"
    }

    fn pace(&self) -> Pace {
        Pace::Clocks
    }

    fn run(&self, job: &Job<'_>) -> Result<Trace, EngineError> {
        let logic = pipeline::logic(job.net, job.facts).map_err(EngineError::Refused)?;
        let burned = jedec::burn_coded(job.net, job.facts, &logic, self.device, Some(1))
            .map_err(EngineError::Refused)?;
        device_trace(job.net, &burned.map, &burned.logic, &burned.roles, job.stimulus)
            .map_err(EngineError::Refused)
    }
}
