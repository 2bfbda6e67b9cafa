//! When an output asks its extern conditions: only while some step is active that carries the output with a condition.

use grafsynth_ir::net::{Driver, Net, OutputId, StepId};
use grafsynth_ir::program::{Expr, Leaf};

/// The steps that carry the output with a condition; none where `value`, what the output becomes, reads no input: then nothing is asked.
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
