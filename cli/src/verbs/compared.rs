//! The number of reactions that a comparison covered, for all kinds of comparisons.

use crate::load::Stop;
use grafsynth_ir::counted;

/// The number of compared reactions, and the total number, as text.
pub(super) fn reactions(asked: usize, all: usize) -> String {
    let total = counted(all, "reaction", "reactions");
    if asked == all {
        return total;
    }
    format!("{asked} of {total} (the others come after a violated assumption)")
}

/// The error if no row of a stimulus satisfies the assumptions of the chart, so that nothing was compared.
pub(super) fn nothing_asked() -> Stop {
    Stop::Input(
        "every row comes after a violated assumption, so there is nothing to compare".to_owned(),
    )
}
