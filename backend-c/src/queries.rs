//! Queries about a net that several styles and files use.

use grafsynth_ir::net::{Driver, Net, OutputId, StepId};
use grafsynth_ir::program::{Expr, Leaf};

pub(crate) use grafsynth_ir::net::is_c;

/// The steps that assign an output: the extern conditions in its `value` are called only while one of these steps is active. Empty if
/// `value` reads no input, because nothing is called then.
pub(crate) fn carriers(net: &Net, output: OutputId, value: &Expr) -> Vec<StepId> {
    let reads = value.leaves().any(|leaf| matches!(leaf, Leaf::Input(_)));
    match &net.outputs[output].driver {
        Driver::Continuous(emissions) | Driver::Mealy(emissions) if reads => {
            emissions.iter().filter(|it| it.condition.is_some()).map(|it| it.step).collect()
        }
        _ => Vec::new(),
    }
}
