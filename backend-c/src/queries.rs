//! Questions about a net that several styles and files ask.

use grafsynth_ir::net::{Driver, Net, OutputId, StepId};
use grafsynth_ir::program::{Expr, Leaf};

pub(crate) use grafsynth_ir::net::is_c;

/// When an output asks its extern conditions: only while one of these steps is active, which carry it with a condition. None where `value`, what the output
/// becomes, reads no input: then nothing is asked.
pub(crate) fn carriers(net: &Net, output: OutputId, value: &Expr) -> Vec<StepId> {
    let mut reads = false;
    value.for_each_leaf(&mut |leaf| reads |= matches!(leaf, Leaf::Input(_)));
    match &net.outputs[output].driver {
        Driver::Continuous(emissions) | Driver::Mealy(emissions) if reads => {
            emissions.iter().filter(|it| it.condition.is_some()).map(|it| it.step).collect()
        }
        Driver::Continuous(_)
        | Driver::Mealy(_)
        | Driver::Stored(_)
        | Driver::Controlled(_)
        | Driver::Extern { .. } => Vec::new(),
    }
}
