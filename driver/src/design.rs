//! The contents of a source.

use crate::logic::LogicDesign;
use crate::task_costs::Counted;
use grafsynth_ir::net::Net;
use grafsynth_ir::{Valid, chart};

/// The contents of a source.
#[derive(Debug, Clone)]
pub enum Design {
    /// A chart, and the net that runs.
    Net(Box<NetDesign>),
    /// Logic without a chart: the meaning of names is unknown.
    Logic(Box<LogicDesign>),
}

/// A chart with its net.
#[derive(Debug, Clone)]
pub struct NetDesign {
    /// The chart as drawn; `None` for a `.net` text.
    pub chart: Option<chart::Design>,
    /// The net that runs.
    pub net: Valid<Net>,
    /// The tasks whose costs are estimated by a model; `None` if there are none.
    pub counted: Option<Counted>,
    /// For a chart that was read from C: the C text that defines its extern functions.
    pub library: Option<String>,
}
